"""Elementwise functions of numbers or of arrays.

A formula that uses them applies to one wheelset, given as numbers, and to many, given as arrays.
NumPy's own functions take some ten times as long for a number: with arrays of one element, a run of
one wheelset takes 1.6 to 3 times as long, depending on its controller.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

ARRAY = np.ndarray
Numbers: TypeAlias = Any  # a number of one wheelset, or an array (n,) of many


def minimum(a: Numbers, b: Numbers) -> Numbers:
    """Smaller of two values; nan if the first is nan."""
    if type(a) is ARRAY or type(b) is ARRAY:
        return np.minimum(a, b)
    return b if b < a else a


def maximum(a: Numbers, b: Numbers) -> Numbers:
    """Larger of two values; nan if the first is nan."""
    if type(a) is ARRAY or type(b) is ARRAY:
        return np.maximum(a, b)
    return b if b > a else a


def where(condition: Numbers, a: Numbers, b: Numbers) -> Numbers:
    """The first value where a condition holds, the second elsewhere."""
    if type(condition) is ARRAY:
        return np.where(condition, a, b)
    return a if condition else b


def negated(condition: Numbers) -> Numbers:
    """Whether a condition does not hold."""
    return ~condition if type(condition) is ARRAY else not condition
