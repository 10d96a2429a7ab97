"""Elementwise functions of numbers or of arrays.

A formula that uses them applies to one wheelset, given as numbers, and to many, given as arrays.
NumPy's own functions take some ten times as long for a number.
"""

from __future__ import annotations

from typing import Any

import numpy as np

ARRAY = np.ndarray


def minimum(a: Any, b: Any) -> Any:
    """Smaller of two values; nan if the first is nan."""
    if type(a) is ARRAY or type(b) is ARRAY:
        return np.minimum(a, b)
    return b if b < a else a


def maximum(a: Any, b: Any) -> Any:
    """Larger of two values; nan if the first is nan."""
    if type(a) is ARRAY or type(b) is ARRAY:
        return np.maximum(a, b)
    return b if b > a else a


def where(condition: Any, a: Any, b: Any) -> Any:
    """The first value where a condition holds, the second elsewhere."""
    if type(condition) is ARRAY:
        return np.where(condition, a, b)
    return a if condition else b


def negated(condition: Any) -> Any:
    """Whether a condition does not hold."""
    return ~condition if type(condition) is ARRAY else not condition
