"""Values of the axes in each run: a grid, a Latin hypercube or independent draws.

The whole sample is drawn at once from the seed, so it does not depend on the division into chunks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, product
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from contactlib.base.quantities import FloatArray

INSIDE = float(np.finfo(np.float64).epsneg)
Kind = Literal["grid", "latin_hypercube", "monte_carlo"]
KINDS: tuple[str, ...] = get_args(Kind)
MOST_RUNS = 10_000_000  # their values are held in memory


class Distribution(Protocol):
    """Distribution of the values of an axis."""

    def at(self, part: ArrayLike) -> FloatArray:
        """Quantiles for probabilities in [0, 1)."""


@dataclass(frozen=True)
class Choice:
    """One of several equally likely values."""

    values: tuple[float, ...]

    def at(self, part: ArrayLike) -> FloatArray:
        """Quantiles: the values in their order."""
        place = np.floor(np.asarray(part) * len(self.values)).astype(np.intp)
        values = np.array(self.values, dtype=np.float64)
        return np.asarray(values[np.minimum(place, len(self.values) - 1)])


@dataclass(frozen=True)
class Uniform:
    """Uniform distribution between two values."""

    start: float
    end: float

    def at(self, part: ArrayLike) -> FloatArray:
        """Quantiles: linear."""
        values = self.start + np.asarray(part) * (self.end - self.start)
        return np.asarray(np.clip(values, self.start, self.end))  # against rounding


@dataclass(frozen=True)
class LogUniform:
    """Distribution between two positive values whose logarithm is uniform."""

    start: float
    end: float

    def at(self, part: ArrayLike) -> FloatArray:
        """Quantiles: exponential."""
        width = math.log(self.end / self.start)
        return np.asarray(
            np.clip(self.start * np.exp(np.asarray(part) * width), self.start, self.end)
        )


@dataclass(frozen=True)
class Whole:
    """Uniform distribution of the whole numbers from one to another, both included."""

    start: float
    end: float

    def at(self, part: ArrayLike) -> FloatArray:
        """Quantiles: equal steps."""
        values = self.start + np.floor(np.asarray(part) * (self.end - self.start + 1.0))
        return np.asarray(np.minimum(values, self.end))


@dataclass(frozen=True)
class Normal:
    """Normal distribution, truncated at `start` and `end`."""

    mean: float
    standard_deviation: float
    start: float = -math.inf
    end: float = math.inf

    def at(self, part: ArrayLike) -> FloatArray:
        """Quantiles of the truncated distribution."""
        ends = (np.array([self.start, self.end]) - self.mean) / self.standard_deviation
        # Above the mean probabilities are near one and lose digits: there mirror the distribution.
        if ends[0] > 0.0:
            low, high = ndtr(-ends)
            deviation = -ndtri(np.clip(low + np.asarray(part) * (high - low), 1e-300, 1.0))
        else:
            low, high = ndtr(ends)
            inside = np.clip(low + np.asarray(part) * (high - low), 1e-300, 1.0 - INSIDE)
            deviation = ndtri(inside)
        values = self.mean + self.standard_deviation * deviation
        return np.asarray(np.clip(values, self.start, self.end))


def grid_shape(spreads: Sequence[Distribution]) -> tuple[int, ...]:
    """Number of points along each axis of a grid."""
    return tuple(len(spread.values) for spread in spreads if isinstance(spread, Choice))


def draw(kind: str, spreads: Sequence[Distribution], runs: int, seed: int) -> FloatArray:
    """Draw the values of the axes in each run.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    spreads : sequence of Distribution
        Distribution of each axis; on a grid each is a `Choice`.
    runs, seed : int
        Number of runs, and seed; a grid ignores both.

    Returns
    -------
    ndarray
        Values, shape (runs, axes). On a grid the last axis varies fastest.

    Raises
    ------
    ValueError
        If a grid has too many points.
    """
    if kind == "grid":
        runs = math.prod(grid_shape(spreads))
        if runs > MOST_RUNS:
            raise ValueError(f"the grid has {runs} points: at most {MOST_RUNS}")
        points = [spread.values for spread in spreads if isinstance(spread, Choice)]
        grid = np.meshgrid(*points, indexing="ij")
        return np.stack(grid, axis=-1).reshape(runs, len(spreads))
    generator = np.random.default_rng(seed)
    if kind == "latin_hypercube":
        from scipy.stats import qmc  # imported late, as it takes a third of a worker's start

        parts = qmc.LatinHypercube(len(spreads), seed=generator).random(runs)
    else:
        parts = generator.random((runs, len(spreads)))
    return np.stack([spread.at(u) for spread, u in zip(spreads, parts.T, strict=True)], axis=-1)


def extreme_runs(
    kind: str, spreads: Sequence[Distribution], values: FloatArray, most: int = 256
) -> list[int]:
    """Runs at the ends of the axes: at most `most` corners of a grid, or a sample's extremes."""
    if kind != "grid":
        return sorted({int(i) for i in (*values.argmin(axis=0), *values.argmax(axis=0))})
    shape = grid_shape(spreads)
    corners = islice(product(*({0, n - 1} for n in shape)), most)
    return sorted(int(np.ravel_multi_index(corner, shape)) for corner in corners)
