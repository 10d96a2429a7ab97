"""Values of the axes in each run: a grid, also with draws at each point, or a random sample.

The whole sample is drawn at once from the seed, so it does not depend on the division into chunks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, product
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import SEED, FloatArray, Quantity, checks_call

ANY = Quantity("1")  # in a file, unit and limits are those of the numbers that an axis sets
MAX_RUNS = 10_000_000  # their values are held in memory


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
        distribution: Any
        if self.kind == "normal":
            mean, deviation = shape
            ends = (start - mean) / deviation, (end - mean) / deviation
            distribution = stats.truncnorm(*ends, mean, deviation)
        elif self.kind == "log_uniform":
            distribution = stats.loguniform(start, end)
        elif self.kind == "whole":
            distribution = stats.randint(start, end + 1.0)
        else:
            distribution = stats.uniform(start, end - start)
        return np.asarray(np.clip(distribution.ppf(inside), start, end))  # against rounding


@checks_call
def values_of(*, values: Annotated[tuple[float, ...], ANY]) -> Spread:
    """Values one by one.

    Parameters
    ----------
    values : list of float
        Values, all different.
    """
    if len(set(values)) < len(values):
        raise ValueError(f"values = {list(values)!r} has a number twice")
    return Spread("values", values)


@checks_call
def points(
    *,
    from_: Annotated[float, ANY],
    to: Annotated[float, ANY],
    count: Annotated[float, Quantity("1", at_least=1.0, at_most=1e6, whole=True)],
    spacing: Literal["linear", "log"] = "linear",
) -> Spread:
    """Points of a grid.

    Parameters
    ----------
    from_ : float
        Minimum value.
    to : float
        Maximum value.
    count : float
        Number of points of a grid [1].
    spacing : str, optional
        How the points of a grid are spaced.
    """
    if spacing == "log" and min(from_, to) <= 0.0:
        raise ValueError(f"from = {from_!r}, to = {to!r}: log spacing needs both above zero")
    if count > 1 and from_ == to:
        raise ValueError(f"from = to = {from_!r}: {count:g} points would be the same")
    space = np.geomspace if spacing == "log" else np.linspace
    return Spread("values", tuple(space(from_, to, int(count)).tolist()))


@checks_call
def sample(
    *,
    distribution: Literal["uniform", "log_uniform", "whole", "normal"] = "uniform",
    from_: Annotated[float | None, ANY] = None,
    to: Annotated[float | None, ANY] = None,
    mean: Annotated[float | None, ANY] = None,
    standard_deviation: Annotated[float | None, Quantity("1", above=0.0)] = None,
) -> Spread:
    """Values of a random sample.

    Parameters
    ----------
    distribution : str, optional
        Distribution of a sample.
    from_, to : float
        Ends of the distribution; of a normal one, where it is cut.
    mean : float
        Mean of a normal distribution.
    standard_deviation : float
        Standard deviation of a normal distribution before `from` and `to` cut it.
    """
    shape = {"mean": mean, "standard_deviation": standard_deviation}
    ends = {"from": from_, "to": to}
    normal = distribution == "normal"
    for key in [key for key, value in (shape if normal else ends).items() if value is None]:
        raise ValueError(f"{key} is missing")
    for key in [key for key, value in shape.items() if value is not None and not normal]:
        raise ValueError(f"{key} is for a normal distribution, not for {distribution!r}")
    start, end = (-np.inf if from_ is None else from_), (np.inf if to is None else to)
    if start >= end:
        raise ValueError(f"from = {start!r} must be < to = {end!r}")
    if distribution == "whole" and (start != int(start) or end != int(end)):
        raise ValueError(f"from = {start!r}, to = {end!r} must be whole numbers")
    if distribution == "log_uniform" and start <= 0.0:
        raise ValueError(f"from = {start!r} must be > 0: log_uniform is of ratios")
    first = (value for value in shape.values() if value is not None)
    return Spread(distribution, (*first, start, end))


def grid_shape(spreads: Sequence[Spread]) -> tuple[int, ...]:
    """Number of points along each axis of a grid; those with a distribution have none."""
    return tuple(len(spread.numbers) for spread in spreads if spread.kind == "values")


def draw(
    spreads: Sequence[Spread],
    kind: Literal["grid", "latin_hypercube", "monte_carlo"] = "grid",
    runs: Annotated[int, Quantity("1", at_least=1.0, at_most=MAX_RUNS, whole=True)] = 0,
    seed: Annotated[int, SEED] = 0,
) -> FloatArray:
    """Draw the values of the axes in each run.

    Parameters
    ----------
    spreads : sequence of Spread
        Distribution of each axis; those of values make a grid.
    kind : str
        How the runs cover the axes.
    runs : int
        Number of samples; on a grid, which needs them if any axis has a distribution, the number of
        independent draws at each of its points, which are the same at every point.
    seed : int
        Seed of the random numbers.

    Returns
    -------
    ndarray
        Values, shape (runs, axes). On a grid the last axis varies fastest, or the draws do.

    Raises
    ------
    ValueError
        If a grid has too many points.
    """
    if kind == "grid":
        gridded = [i for i, spread in enumerate(spreads) if spread.kind == "values"]
        drawn = [i for i, spread in enumerate(spreads) if spread.kind != "values"]
        points, each = math.prod(grid_shape(spreads)), runs if drawn else 1
        if points * each > MAX_RUNS:
            raise ValueError(f"the grid has {points * each} points: at most {MAX_RUNS}")
        values = np.empty((points, each, len(spreads)))
        grid = np.meshgrid(*(spreads[i].numbers for i in gridded), indexing="ij")
        for i, column in zip(gridded, grid, strict=True):
            values[:, :, i] = column.reshape(points, 1)
        parts = np.random.default_rng(seed).random((each, len(drawn)))
        for i, u in zip(drawn, parts.T, strict=True):
            values[:, :, i] = spreads[i].at(u)
        return values.reshape(points * each, len(spreads))
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    hypercube = kind == "latin_hypercube"
    shape = runs, len(spreads)
    parts = qmc.LatinHypercube(shape[1], rng=rng).random(runs) if hypercube else rng.random(shape)
    return np.stack([spread.at(u) for spread, u in zip(spreads, parts.T, strict=True)], axis=-1)


def extreme_runs(
    kind: str, spreads: Sequence[Spread], values: FloatArray, limit: int = 256
) -> list[int]:
    """Runs at the ends of the axes: corners of a grid, at most `limit`, and a sample's extremes."""
    if kind != "grid":
        return sorted({int(i) for i in (*values.argmin(axis=0), *values.argmax(axis=0))})
    shape = grid_shape(spreads)
    corners = islice(product(*({0, n - 1} for n in shape)), limit)
    each = len(values) // math.prod(shape)
    points = {each * int(np.ravel_multi_index(corner, shape)) for corner in corners if shape}
    first = values[:each]  # with all draws
    return sorted({*points, *map(int, (*first.argmin(axis=0), *first.argmax(axis=0)))})
