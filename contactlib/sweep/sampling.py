"""Which values the axes have in each run: a grid, a Latin hypercube or independent draws.

The whole sample is drawn at once from the seed, so it does not depend on how runs are shared out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import islice, product
from typing import Literal, get_args

import numpy as np

from contactlib.parameters import FloatArray
from contactlib.sweep.axis import Axis
from contactlib.sweep.distribution import Choice

Kind = Literal["grid", "latin_hypercube", "monte_carlo"]
KINDS: tuple[str, ...] = get_args(Kind)
MOST_RUNS = 10_000_000  # their values are held in memory


def grid_shape(axes: Sequence[Axis]) -> tuple[int, ...]:
    """Number of points along each axis of a grid."""
    return tuple(len(a.spread.values) for a in axes if isinstance(a.spread, Choice))


def draw(kind: str, axes: Sequence[Axis], runs: int, seed: int) -> FloatArray:
    """Values of the axes in each run.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    axes : sequence of Axis
        What varies.
    runs, seed : int
        Number of runs, and what their values are drawn from; a grid has its own number and takes
        no seed.

    Returns
    -------
    ndarray
        Shape (runs, axes). Of a grid the last axis varies fastest.

    Raises
    ------
    ValueError
        If there are too many.
    """
    if kind == "grid":
        runs = math.prod(grid_shape(axes))
        if runs > MOST_RUNS:
            raise ValueError(f"the grid has {runs} points: at most {MOST_RUNS}")
        points = [axis.spread.values for axis in axes if isinstance(axis.spread, Choice)]
        grid = np.meshgrid(*points, indexing="ij")
        return np.stack(grid, axis=-1).reshape(runs, len(axes))
    generator = np.random.default_rng(seed)
    if kind == "latin_hypercube":
        from scipy.stats import qmc  # late: a third of what a worker process starts with

        parts = qmc.LatinHypercube(len(axes), seed=generator).random(runs)
    else:
        parts = generator.random((runs, len(axes)))
    return np.stack([a.spread.at(u) for a, u in zip(axes, parts.T, strict=True)], axis=-1)


def extreme_runs(kind: str, axes: Sequence[Axis], values: FloatArray, most: int = 256) -> list[int]:
    """Runs at the ends of the axes: the corners of a grid, each axis's extremes of a sample.

    Of a grid with more than `most` corners only so many.
    """
    if kind != "grid":
        return sorted({int(i) for i in (*values.argmin(axis=0), *values.argmax(axis=0))})
    shape = grid_shape(axes)
    corners = islice(product(*({0, n - 1} for n in shape)), most)
    return sorted(int(np.ravel_multi_index(corner, shape)) for corner in corners)
