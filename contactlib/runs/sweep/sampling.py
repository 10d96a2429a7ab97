"""Values of the axes in each run: a grid, a Latin hypercube or independent draws.

The whole sample is drawn at once from the seed, so it does not depend on the division into chunks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FloatArray

KINDS = ("grid", "latin_hypercube", "monte_carlo")
MOST_RUNS = 10_000_000  # their values are held in memory


@dataclass(frozen=True)
class Spread:
    """Distribution of the values of an axis.

    Attributes
    ----------
    kind : str
        ``values``, which are equally likely, or ``uniform``, ``log_uniform``, ``whole`` or
        ``normal``.
    numbers : tuple of float
        The values, or the smallest and the largest one; of ``normal`` before them mean and standard
        deviation.
    """

    kind: str
    numbers: tuple[float, ...]

    def at(self, part: ArrayLike) -> FloatArray:
        """Quantiles for probabilities in [0, 1], which are finite."""
        from scipy import stats  # imported late, as it takes a third of a worker's start

        inside = np.clip(part, 1e-300, 1.0 - np.finfo(np.float64).epsneg)
        if self.kind == "values":
            places = stats.randint(0, len(self.numbers)).ppf(inside).astype(np.intp)
            return np.array(self.numbers, dtype=np.float64)[places]
        *shape, start, end = self.numbers
        found: Any
        if self.kind == "normal":
            mean, deviation = shape
            ends = (start - mean) / deviation, (end - mean) / deviation
            found = stats.truncnorm(*ends, mean, deviation)
        elif self.kind == "log_uniform":
            found = stats.loguniform(start, end)
        elif self.kind == "whole":
            found = stats.randint(start, end + 1.0)
        else:
            found = stats.uniform(start, end - start)
        return np.asarray(np.clip(found.ppf(inside), start, end))  # against rounding


def grid_shape(spreads: Sequence[Spread]) -> tuple[int, ...]:
    """Number of points along each axis of a grid."""
    return tuple(len(spread.numbers) for spread in spreads)


def draw(kind: str, spreads: Sequence[Spread], runs: int, seed: int) -> FloatArray:
    """Draw the values of the axes in each run.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    spreads : sequence of Spread
        Distribution of each axis; on a grid each is of values.
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
        grid = np.meshgrid(*(spread.numbers for spread in spreads), indexing="ij")
        return np.stack(grid, axis=-1).reshape(runs, len(spreads))
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    hypercube = kind == "latin_hypercube"
    shape = runs, len(spreads)
    parts = qmc.LatinHypercube(shape[1], rng=rng).random(runs) if hypercube else rng.random(shape)
    return np.stack([spread.at(u) for spread, u in zip(spreads, parts.T, strict=True)], axis=-1)


def extreme_runs(
    kind: str, spreads: Sequence[Spread], values: FloatArray, most: int = 256
) -> list[int]:
    """Runs at the ends of the axes: at most `most` corners of a grid, or a sample's extremes."""
    if kind != "grid":
        return sorted({int(i) for i in (*values.argmin(axis=0), *values.argmax(axis=0))})
    shape = grid_shape(spreads)
    corners = islice(product(*({0, n - 1} for n in shape)), most)
    return sorted(int(np.ravel_multi_index(corner, shape)) for corner in corners)
