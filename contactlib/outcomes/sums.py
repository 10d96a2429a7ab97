"""Sums and extremes over the rows of many runs.

Rows are added one by one, in their order, so that a sum does not depend on how many rows a block
has, nor on how many runs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from contactlib.outcomes.rows import Seen
from contactlib.parameters import FloatArray

Quantity = Callable[[Seen], FloatArray]


class Observer(Protocol):
    """Sees the rows of n runs, block by block, and tells a number of each."""

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""

    def value(self) -> FloatArray:
        """What they come to, shape (n,)."""


class Joint:
    """Puts the last row of the block before in front of a block."""

    def __init__(self) -> None:
        self._last: tuple[FloatArray, ...] = ()

    def __call__(self, *signals: FloatArray) -> tuple[FloatArray, ...]:
        """Signals with that row, if there is one."""
        joined = signals
        if self._last:
            pairs = zip(self._last, signals, strict=True)
            joined = tuple(np.concatenate(pair) for pair in pairs)
        self._last = tuple(signal[-1:].copy() for signal in signals)
        return joined


class Integral:
    """Integral over time, trapezoidal, of a quantity; if asked for, while there is a demand."""

    def __init__(self, quantity: Quantity, *, demanded: bool = False) -> None:
        self._quantity, self._demanded, self._joint = quantity, demanded, Joint()
        self._twice: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        y, demand, time = self._joint(self._quantity(rows), rows["demand"], rows.time)
        if self._twice is None:
            self._twice = np.zeros(y.shape[1])
        parts = np.diff(time)[:, np.newaxis] * (y[1:] + y[:-1])
        if self._demanded:
            parts *= demand[:-1] != 0.0
        for part in parts:
            self._twice += part

    def value(self) -> FloatArray:
        """Of the rows so far."""
        return 0.5 * _known(self._twice)


class HeldIntegral:
    """Integral over time of a quantity that each row holds until the next."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity, self._joint = quantity, Joint()
        self._sum: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        y, time = self._joint(self._quantity(rows), rows.time)
        if self._sum is None:
            self._sum = np.zeros(y.shape[1])
        for part in np.diff(time)[:, np.newaxis] * y[:-1]:
            self._sum += part

    def value(self) -> FloatArray:
        """Of the rows so far."""
        return _known(self._sum)


class Extremes:
    """Least and largest value of a quantity."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity = quantity
        self._least: FloatArray | None = None
        self._largest: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        y = self._quantity(rows)
        least, largest = y.min(axis=0), y.max(axis=0)
        if self._least is not None and self._largest is not None:
            least, largest = np.minimum(self._least, least), np.maximum(self._largest, largest)
        self._least, self._largest = least, largest

    def value(self) -> FloatArray:
        """Largest."""
        return _known(self._largest)

    def range(self) -> FloatArray:
        """From the least to the largest."""
        return _known(self._largest) - _known(self._least)


class Ends:
    """A quantity's first and last value."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity = quantity
        self._first: FloatArray | None = None
        self._last: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        y = self._quantity(rows)
        if self._first is None:
            self._first = y[0].copy()
        self._last = y[-1].copy()

    def value(self) -> FloatArray:
        """Last."""
        return _known(self._last)

    def change(self) -> FloatArray:
        """From the first to the last."""
        return _known(self._last) - _known(self._first)


class Together:
    """What several observers come to together."""

    def __init__(self, value: Callable[..., FloatArray], *observers: Observer) -> None:
        self._value, self._observers = value, observers

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        for observer in self._observers:
            observer.see(rows)

    def value(self) -> FloatArray:
        """Of the rows so far."""
        return self._value(*self._observers)


def _known(values: FloatArray | None) -> FloatArray:
    if values is None:
        raise ValueError("there is no row yet")
    return values
