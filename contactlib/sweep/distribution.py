"""How the values of an axis are spread: the inverse of a distribution function for each kind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from contactlib.parameters import FloatArray

INSIDE = float(np.finfo(np.float64).epsneg)


class Distribution(Protocol):
    """What a random axis draws from."""

    def at(self, part: ArrayLike) -> FloatArray:
        """Values below which these parts, of [0, 1), of the distribution lie."""


@dataclass(frozen=True)
class Choice:
    """One of several values, each as likely."""

    values: tuple[float, ...]

    def at(self, part: ArrayLike) -> FloatArray:
        """The values in their order."""
        place = np.floor(np.asarray(part) * len(self.values)).astype(np.intp)
        values = np.array(self.values, dtype=np.float64)
        return np.asarray(values[np.minimum(place, len(self.values) - 1)])


@dataclass(frozen=True)
class Uniform:
    """Any value between two, each as likely."""

    start: float
    end: float

    def at(self, part: ArrayLike) -> FloatArray:
        """A straight line."""
        values = self.start + np.asarray(part) * (self.end - self.start)
        return np.asarray(np.clip(values, self.start, self.end))  # rounding may leave it


@dataclass(frozen=True)
class LogUniform:
    """Any value between two above zero, each ratio as likely."""

    start: float
    end: float

    def at(self, part: ArrayLike) -> FloatArray:
        """A straight line of logarithms."""
        width = math.log(self.end / self.start)
        return np.asarray(
            np.clip(self.start * np.exp(np.asarray(part) * width), self.start, self.end)
        )


@dataclass(frozen=True)
class Whole:
    """Any whole number from one to another, both included, each as likely."""

    start: float
    end: float

    def at(self, part: ArrayLike) -> FloatArray:
        """Stairs of equal steps."""
        values = self.start + np.floor(np.asarray(part) * (self.end - self.start + 1.0))
        return np.asarray(np.minimum(values, self.end))


@dataclass(frozen=True)
class Normal:
    """Normal distribution; what is beyond `start` and `end` is cut away, not moved there."""

    mean: float
    standard_deviation: float
    start: float = -math.inf
    end: float = math.inf

    def at(self, part: ArrayLike) -> FloatArray:
        """The normal distribution's, from the part below `start` to that below `end`."""
        ends = (np.array([self.start, self.end]) - self.mean) / self.standard_deviation
        # Above the mean the parts are near one and lose digits: there it is done mirrored.
        if ends[0] > 0.0:
            low, high = ndtr(-ends)
            deviation = -ndtri(np.clip(low + np.asarray(part) * (high - low), 1e-300, 1.0))
        else:
            low, high = ndtr(ends)
            inside = np.clip(low + np.asarray(part) * (high - low), 1e-300, 1.0 - INSIDE)
            deviation = ndtri(inside)
        values = self.mean + self.standard_deviation * deviation
        return np.asarray(np.clip(values, self.start, self.end))
