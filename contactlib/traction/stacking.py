"""One controller of many: fields that differ become arrays, one element for each wheelset.

Controllers are elementwise, so the stacked one answers as each of them would by itself, to the last
bit. What it derives from its fields is taken from each of them too, and not worked out anew.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import fields, is_dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from contactlib.traction.interface import TractionController


def structure(value: Any) -> Hashable:
    """What has to be equal for values to be stacked: everything but their numbers."""
    kind: Any = type(value)
    if kind is float or value is None:
        return (kind,)
    if isinstance(value, tuple):
        return kind, *map(structure, value)
    if is_dataclass(value):
        return kind, *map(structure, _parts(value).values())
    return value if isinstance(value, Hashable) else id(value)


def stacked(controllers: Sequence[TractionController]) -> TractionController:
    """One controller for as many wheelsets as there are controllers.

    Parameters
    ----------
    controllers : sequence of TractionController
        Of one kind and `structure`, each checked when it was made. The sample time of the result
        is that of the first: it has to be that of all.
    """
    first = controllers[0]
    whole: TractionController = _stacked(controllers)
    if whole is not first:
        object.__setattr__(whole, "sample_time", first.sample_time)
    return whole


def _stacked(values: Sequence[Any]) -> Any:
    first = values[0]
    if all(value is first for value in values):
        return first
    if isinstance(first, float):
        same = all(value == first for value in values)
        return first if same else np.array(values, dtype=np.float64)
    if isinstance(first, tuple):
        return tuple(_stacked(parts) for parts in zip(*values, strict=True))
    if is_dataclass(first):
        whole: Any = object.__new__(type(first))
        parts = [_parts(value) for value in values]
        for name in parts[0]:
            # Past the checks: an array is no number, but each of its elements was checked.
            whole.__dict__[name] = _stacked([part[name] for part in parts])
        return whole
    return first


def _parts(value: Any) -> dict[str, Any]:
    """Fields and derived values of a dataclass, by name."""
    kind: Any = type(value)
    return {name: getattr(value, name) for name in _names(kind)}


@cache
def _names(kind: Any) -> tuple[str, ...]:
    derived = {
        name
        for base in kind.__mro__
        for name, member in vars(base).items()
        if isinstance(member, cached_property)
    }
    return *(field.name for field in fields(kind)), *sorted(derived)
