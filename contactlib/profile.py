"""Piecewise linear functions of one variable, which know every corner of theirs."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from contactlib.parameters import FINITE, FloatArray, checked, checked_number, shown


@dataclass(frozen=True)
class Profile:
    """Piecewise linear function of time or distance, by breakpoints; constant beyond its ends.

    A place given twice is a jump: the profile has the first value up to it, the second from it on.

    Parameters
    ----------
    at : sequence of float
        Times [s] or distances [m], rising or repeated at most once.
    value : sequence of float
        As many as places.

    Examples
    --------
    >>> pulse = Profile((1.0, 1.0, 2.0, 2.0), (0.0, 5.0, 5.0, 0.0))
    >>> pulse([0.5, 1.0, 1.5, 2.0]).tolist()
    [0.0, 5.0, 5.0, 0.0]
    >>> pulse.on(1.0, 2.0)  # the ends as seen from inside
    (5.0, 5.0)
    """

    at: tuple[float, ...]
    value: tuple[float, ...]

    def __post_init__(self) -> None:
        at, value = checked("at", self.at, FINITE), checked("value", self.value, FINITE)
        if at.ndim != 1 or at.size == 0 or at.shape != value.shape:
            raise ValueError(
                f"at has {at.size} and value {value.size} entries: both must be sequences of "
                "the same length, at least 1"
            )
        places = tuple(at.tolist())  # of few places plain numbers are quicker
        falls = any(b < a for a, b in pairwise(places))
        if falls or any(a == b for a, b in zip(places, places[2:], strict=False)):
            raise ValueError(f"at = {shown(self.at)} must rise, and repeat a place at most once")
        object.__setattr__(self, "at", places)
        object.__setattr__(self, "value", tuple(value.tolist()))

    @classmethod
    def of(cls, value: float | Profile) -> Profile:
        """`value` itself if it is a profile, else a constant."""
        return value if isinstance(value, Profile) else cls((0.0,), (value,))

    def __call__(self, at: ArrayLike) -> FloatArray:
        """Value at any places; at a jump the one from it on."""
        return np.asarray(np.interp(checked("at", at, FINITE, copy=False), self.at, self.value))

    def on(self, start: float, end: float) -> tuple[float, float]:
        """Values at `start` and `end` as seen between them; no breakpoint may lie between."""
        start = checked_number("start", start, FINITE)
        middle = 0.5 * start + 0.5 * checked_number("end", end, FINITE)
        at_start, at_middle = float(self(start)), float(self(middle))
        return at_start, 2.0 * at_middle - at_start
