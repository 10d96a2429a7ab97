"""Building a table: a law is sampled, splined, packed and certified.

A law is sampled over the coordinates that fmu/kernel/creep_table.h explains. The grid is refined
until the certificate meets the target. The certificate is the largest error against the law on a
dense set of points that are not grid nodes, over all k_hat and from the smallest creepages to the
far tail.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, CubicSpline
from threadpoolctl import threadpool_limits

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.laws.law import Corner, Law
from contactlib.table import corner_sampling
from contactlib.table.corner_sampling import CornerRow, CornerSamples

HEADER_SIZE, NAME_SIZE = 216, 104  # of a table file; the name ends the header
K_MAX, MIN_K_MAX = 2.0, 0.1
LONGEST_WEAKENING = 12.0  # over f_d a^2/R: with a longer one, friction in a contact hardly falls
GRIDS = ((0, 0), (16, 8), (32, 16), (64, 32), (128, 64), (256, 192), (384, 288))
CORNER_GRIDS = {  # by twice the corner's power
    4: ((512, 204), (512, 232)),
    5: ((416, 160), (512, 232), (640, 288), (832, 384), (1024, 480)),
}
# Part of the range of sqrt(k_hat) below which the corner's terms fade out, and with which power. At
# very small k_hat a law has no corner, so none of the terms may remain.
FADES = {4: (0.14, 4), 5: (0.25, 10)}
LAYER_CELLS = (92, 44, 58)  # along u, sqrt(k_hat) and w of fmu/kernel/creep_table.h
LAYER_HEADER = "<IIIId"
# Of the coefficients with a layer: rounding to it changes the traction ratio by less than 2e-8, and
# the coefficients compress to a quarter.
LAYER_STEP = 2.0**-22
LAYER_MIDDLE = 0.6  # fourth root of the layer ratio at w = 1/2
ONE_AXIS_GRIDS = ((64, 1), (256, 1), (1024, 1), (4096, 1))
CERTIFIED_K_HATS = 44  # besides the smallest ones and the largest
CERTIFIED_LAYERS = (9, 21)  # values of k_hat, besides two small ones, and of the layer ratio
CUBIC = np.array([4.0, -6.0, 4.0, -1.0])  # extrapolates four values by one
CORNER = 7  # numbers in a row that describe a corner
REACH = 0.1  # of the fit to a corner, in t/T
SMOOTHING = 8  # intervals along sqrt(k_hat)

Row = TypeVar("Row")
# Traction ratio over normalized creepage, for each k_hat at one layer ratio.
Curves = Callable[[FloatArray, float], list[Callable[[FloatArray], FloatArray]]]


def largest_k_hat(static_to_kinetic: float) -> float:
    """Largest k_hat of a cohesive law's table, which its weakening length limits."""
    weakest = LONGEST_WEAKENING * (static_to_kinetic - 1.0) / (0.5 * np.pi)
    return float(np.clip(np.sqrt(weakest), MIN_K_MAX, K_MAX))  # Eq. (17)


class Certificate(NamedTuple):
    """Largest errors of a table against its law, and the number of points compared."""

    ratio_error: float
    slope_error: float
    points: int


def build(
    law: Callable[..., Law] | Law,
    options: dict[str, Any],
    targets: tuple[float, float],
    progress: Callable[[float], object],
    layers: bool = False,
) -> bytes:
    """Table file of a law; the arguments are those of `CreepForceTable.from_law`."""
    sampler = Sampler(law, options, progress)
    reference = _reference_values(sampler)
    samples, done = _corner_samples(sampler, 0.5, 0.9)
    for cells in sampler.grids:
        then = 0.5 * (1.0 + done)  # the required grid is not known in advance
        coefficients = _fit(sampler, samples, *cells, done, then)
        draft = kernel.NativeTable(pack(sampler, cells, Certificate(0.0, 0.0, 0), coefficients))
        certificate = _certify(draft, reference)
        if certificate.ratio_error <= targets[0] and certificate.slope_error <= targets[1]:
            layered = _with_layers(sampler, then) if layers else Layers()
            progress(1.0)
            return pack(sampler, cells, certificate, coefficients, layered)
        done = then
    raise ValueError(
        f"target = {targets[0]!r}, slope_target = {targets[1]!r} are not reached for "
        f"{sampler.name}: the finest grid has the error {certificate.ratio_error:.2e} of the "
        f"traction ratio and {certificate.slope_error:.2e} of its slope"
    )


def _certify(table: kernel.NativeTable, reference: list[_Reference]) -> Certificate:
    error = slope_error = 0.0
    points = 0
    for row in reference:
        ratio, slope = table.evaluate(row.x, np.array([row.k_hat]), np.zeros(1))
        error = max(error, float(np.max(np.abs(ratio - row.ratio))))
        slope_error = max(slope_error, float(np.max(np.abs(slope - row.slope))))
        points += row.x.size
    return Certificate(error, slope_error, points)


class _Reference(NamedTuple):
    """A law's values at the certificate's points for one k_hat."""

    k_hat: float
    x: FloatArray
    ratio: FloatArray
    slope: FloatArray


class Sampler:
    """A law to tabulate, and the shape of its table."""

    def __init__(
        self,
        law: Callable[..., Law] | Law,
        options: dict[str, Any],
        progress: Callable[[float], object],
    ) -> None:
        self._law, self._options, self._progress = law, options, progress
        self.one_axis = not callable(law)
        kind = type(law).__name__ if self.one_axis else getattr(law, "__name__", "law")
        stated = options or getattr(law, "scales", {})
        self.name = " ".join(
            [kind, *(f"{key}={getattr(value, 'name', value)}" for key, value in stated.items())]
        )
        some = self.at(1.0)
        corner: Corner | None = getattr(some, "corner", None)
        self.static_to_kinetic = float(getattr(some, "static_to_kinetic", 0.0))
        self.k_max = K_MAX
        if self.static_to_kinetic:
            self.k_max = largest_k_hat(self.static_to_kinetic)
        self.shape = {
            "one_axis": int(self.one_axis),
            "twice_decay": round(2.0 * float(getattr(some, "tail_decay", 3.0))) + 2,
            "twice_corner": 0 if corner is None else round(2.0 * corner.power),
            "root_k": int(bool(getattr(some, "carter_at_zero", False))),
        }

    @property
    def grids(self) -> tuple[tuple[int, int], ...]:
        """Numbers of cells to try, coarse to fine."""
        if self.one_axis:
            return ONE_AXIS_GRIDS
        return CORNER_GRIDS.get(self.shape["twice_corner"], GRIDS)

    def at(self, k_hat: float, layer_ratio: float = 0.0) -> Law:
        """The law at one k_hat and layer."""
        if callable(self._law):
            layer = {"layer_ratio": layer_ratio} if layer_ratio > 0.0 else {}
            return self._law(k_hat=k_hat, **self._options, **layer)
        return self._law

    def rows(
        self, row: Callable[..., Row], k_hats: Sequence[Any], done: float, then: float
    ) -> list[Row]:
        """Call `row` for every k_hat, in threads; report progress from `done` to `then`.

        Neighbours may share work that a law keeps, so the threads take k_hats far apart.
        """
        found: dict[int, Row] = {}
        order = np.random.default_rng(0).permutation(len(k_hats)).tolist()
        # The law's linear algebra has small matrices, for which more threads are slower.
        with threadpool_limits(1), ThreadPoolExecutor(os.cpu_count()) as pool:
            jobs = {pool.submit(row, k_hats[i]): i for i in order}
            try:
                for job in as_completed(jobs):
                    found[jobs[job]] = job.result()
                    self._progress(done + (then - done) * len(found) / len(k_hats))
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
        return [found[i] for i in range(len(k_hats))]


def _reference_values(sampler: Sampler) -> list[_Reference]:
    """The law's values at the certificate's points, which are not nodes of any grid."""

    def row(k_hat: float) -> _Reference:
        law = sampler.at(k_hat)
        in_cells = kernel.table_nodes(_off_nodes(500), k_hat, **sampler.shape).normalized_creepage
        x = np.concatenate([in_cells, np.geomspace(1e-12, 1e6, 150), [0.0, 1.0]])
        evaluate = getattr(law, "evaluate", None)
        values = evaluate(x) if evaluate else (law.traction_ratio(x), law.slope(x))
        return _Reference(k_hat, x, *values)

    # Irrational fractions of the table's axes; the ends are the table's borders.
    inner = sampler.k_max * _off_nodes(CERTIFIED_K_HATS) ** 2
    k_hats = [0.0, 1e-12, 1e-9, 1e-6, 1e-5, 1e-4, 1e-3, *inner.tolist(), sampler.k_max]
    return sampler.rows(row, [1.0] if sampler.one_axis else k_hats, 0.0, 0.5)


class Layers(NamedTuple):
    """Spline with a layer: cells along u, sqrt(k_hat) and w, coefficients, and largest error."""

    cells: tuple[int, int, int] = (0, 0, 0)
    coefficients: NDArray[np.float32] = np.empty(0, np.float32)
    error: float = 0.0


def exchange_layers(data: bytes, present: bytes, layers: Layers = Layers()) -> bytes:  # noqa: B008
    """A table file with other layers, or none; the coefficients of the present ones end it."""
    end = HEADER_SIZE - NAME_SIZE
    start = end - struct.calcsize(LAYER_HEADER)
    kept = data[24:start] + _layer_header(layers) + data[end:].removesuffix(present)
    whole = kept + layers.coefficients.astype("<f4").tobytes()
    return kernel.framed(kernel.TABLE_MAGIC, kernel.TABLE_VERSION, whole)


def _layer_header(layers: Layers) -> bytes:
    return struct.pack(LAYER_HEADER, *layers.cells, 0, layers.error)


def layer_at(w: float) -> float:
    """Layer ratio at a coordinate w < 1."""
    return float((LAYER_MIDDLE * w / (1.0 - w)) ** 4)


def layer_table(sampler: Sampler, layers: Layers) -> kernel.NativeTable:
    """Table of the layers alone."""
    return kernel.NativeTable(pack(sampler, (0, 0), Certificate(0.0, 0.0, 0), np.empty(0), layers))


def spline_layers(
    sampler: Sampler,
    cells: tuple[int, int, int],
    curves: Curves,
    progress: tuple[float, float],
    thinnest: float = 0.0,
    initial_slope: Callable[[float], float] | None = None,
) -> Layers:
    """Spline over u, sqrt(k_hat) and w through the curves of all k_hat and one layer ratio.

    Thinner layers than the thinnest one have its curves. The initial slope makes H exact at u = 0.
    """
    cells_u, cells_k, cells_w = cells
    u, k_hats = np.arange(1, cells_u) / cells_u, _k_hats(sampler, np.arange(cells_k + 1) / cells_k)

    def plane(lams: list[float]) -> list[list[FloatArray]]:
        pairs = list(zip(k_hats.tolist(), curves(k_hats, max(lams[0], thinnest)), strict=True))
        return [[row(lam, *pair) for pair in pairs] for lam in lams]

    def row(lam: float, k_hat: float, curve: Callable[[FloatArray], FloatArray]) -> FloatArray:
        node = kernel.table_nodes(u, k_hat, max(lam, 1e-300), **sampler.shape)
        h = _with_ends((curve(node.normalized_creepage) - node.line) / node.weight)
        if initial_slope is not None:
            h[0] = (1.0 + 0.5 * np.pi * lam) * initial_slope(lam) - 2.0
        return h

    lams = [layer_at(w) for w in np.arange(cells_w) / cells_w]
    thin = [lam for lam in lams if lam <= thinnest]
    h = np.concatenate(
        sampler.rows(plane, [thin, *([lam] for lam in lams[len(thin) :])], *progress)
    )
    h = np.concatenate([h, (CUBIC @ h[:-5:-1].reshape(4, -1)).reshape(1, *h.shape[1:])])
    for axis in range(3):
        h = np.moveaxis(_b_spline(np.moveaxis(h, axis, 0)), 0, axis)
    rounded = LAYER_STEP * np.rint(h / LAYER_STEP) + 0.0  # no -0.0
    return Layers(cells, rounded.astype(np.float32))


def layer_error(
    sampler: Sampler, layers: Layers, curves: Curves, progress: tuple[float, float]
) -> float:
    """Largest error of the layers against curves at points that are not nodes."""
    table, (k_hats, lams) = layer_table(sampler, layers), between_layers(sampler, layers)

    def error(lam: float) -> float:
        errors = []
        for k_hat, curve in zip(k_hats.tolist(), curves(k_hats, lam), strict=True):
            node = kernel.table_nodes(_off_nodes(100), k_hat, lam, **sampler.shape)
            x = node.normalized_creepage
            q = table.traction_ratio(x, np.array([k_hat]), np.array([lam]))
            errors.append(np.abs(q - curve(x)).max())
        return float(max(errors))

    return max(sampler.rows(error, lams, *progress))


def between_layers(sampler: Sampler, layers: Layers) -> tuple[FloatArray, list[float]]:
    """Values of k_hat and layer ratios between the nodes."""
    n_k, n_w = CERTIFIED_LAYERS
    root_k = [0.5 / layers.cells[1], 0.5 / (0.3 * layers.cells[1]), *_off_nodes(n_k)]
    return _k_hats(sampler, np.array(root_k)), [layer_at(w) for w in _off_nodes(n_w)]


def _k_hats(sampler: Sampler, root_k: FloatArray) -> FloatArray:
    return np.asarray(np.minimum((root_k * np.sqrt(sampler.k_max)) ** 2, sampler.k_max))


def _with_layers(sampler: Sampler, done: float) -> Layers:
    """Spline of a law with layers, certified."""
    then = 0.5 * (1.0 + done)

    def curves(k_hats: FloatArray, lam: float) -> list[Callable[[FloatArray], FloatArray]]:
        return [sampler.at(k_hat, lam).traction_ratio for k_hat in k_hats.tolist()]

    layers = spline_layers(sampler, LAYER_CELLS, curves, (done, then))
    return layers._replace(error=layer_error(sampler, layers, curves, (then, 1.0)))


def _off_nodes(n: int) -> FloatArray:
    return np.asarray((np.arange(n) + np.sqrt(0.5)) / (n + 1.0))


def _corner_samples(
    sampler: Sampler, done: float, then: float
) -> tuple[CornerSamples | None, float]:
    """Samples of (1 - u)^d H of a law with a corner, and the progress made; else nothing."""
    largest = float(np.sqrt(sampler.k_max))

    def row(k_hat: float) -> CornerRow | None:
        law = sampler.at(k_hat)
        corner: Corner | None = getattr(law, "corner", None)
        if corner is None:
            return None
        t = kernel.table_coordinate(corner.normalized_creepage, k_hat)
        place = t / (1.0 + t)
        below, beyond = corner_sampling.nodes(place)
        u = np.concatenate([below, beyond])
        node = kernel.table_nodes(u, k_hat, **sampler.shape)
        h = (law.traction_ratio(node.normalized_creepage) - node.line) / node.weight
        values = h * (1.0 - u) ** (0.5 * sampler.shape["twice_decay"])
        return CornerRow(place, values[: below.size], values[below.size :])

    if not sampler.shape["twice_corner"]:
        return None, done
    k_hats = (corner_sampling.root_k_nodes(largest) ** 2).tolist()
    rows = sampler.rows(row, k_hats, done, then)
    known = [r for r in rows if r is not None]
    return (CornerSamples(known, largest) if len(known) == len(rows) else None), then


def _fit(
    sampler: Sampler,
    samples: CornerSamples | None,
    cells_u: int,
    cells_k: int,
    done: float,
    then: float,
) -> FloatArray:
    """Coefficients of the table, one row for each spline coefficient along sqrt(k_hat)."""
    if cells_u == 0:
        return np.empty((0, 0))
    inner = np.linspace(0.0, 1.0, cells_u + 1)[1:-1]

    lead = CORNER if sampler.shape["twice_corner"] else 0

    def row(k_hat: float) -> FloatArray:
        if k_hat == 0.0 and sampler.shape["root_k"]:
            return np.zeros(lead + cells_u - 1)
        at, place = _h_at(sampler, samples, k_hat)
        h = at(inner)
        return np.concatenate([_corner_numbers(sampler, at, place), h]) if lead else h

    if sampler.one_axis:
        return _b_spline(_with_ends(row(1.0)))[np.newaxis]
    root_k = np.linspace(0.0, np.sqrt(sampler.k_max), cells_k + 1)
    # Rounding must not leave the law's range.
    k_hats = np.minimum(root_k**2, sampler.k_max).tolist()
    rows = np.array(sampler.rows(row, k_hats, done, then))
    numbers, h = rows[:, :lead], rows[:, lead:]
    if lead:
        # Each row's fit has some noise, which an interpolation between rows would amplify.
        fade = FADES.get(sampler.shape["twice_corner"], FADES[4])
        numbers[:, 1:] = _smooth(root_k, numbers[:, 1:], *fade)
        power, t = 0.5 * sampler.shape["twice_corner"], inner / (1.0 - inner)
        for values, number in zip(h, numbers, strict=True):
            values -= _corner_terms(t, number[0], power) @ number[1:]
    along_u = _b_spline(np.apply_along_axis(_with_ends, 1, h).T).T
    return _b_spline(np.hstack([numbers, along_u]))


def _smooth(x: FloatArray, values: FloatArray, fade_below: float, fade_power: int) -> FloatArray:
    """Quintic splines over few intervals through the columns of `values`, by least squares.

    They fade out at small x, where a corner is too weak to need its terms.
    """
    fade = 1.0 / (1.0 + (fade_below * x[-1] / np.maximum(x, 1e-6)) ** fade_power)
    knots = np.linspace(0.0, x[-1], SMOOTHING + 1)
    knots = np.concatenate([[0.0] * 5, knots, [x[-1]] * 5])
    basis = fade[:, np.newaxis] * BSpline.design_matrix(x, knots, 5).toarray()
    return np.asarray(basis @ np.linalg.lstsq(basis, values, rcond=None)[0])


def _corner_terms(t: ArrayLike, inverse_place: float, power: float) -> FloatArray:
    """The singular functions of fmu/kernel/creep_table.h at t, (t.size, CORNER - 1)."""
    y = np.asarray(t) * inverse_place
    z = np.maximum(1.0 - y, 0.0) if inverse_place > 0.0 else np.zeros_like(y)
    logarithm = np.log(np.where(z > 0.0, z, 1.0))
    parts = y**4 * z ** (power + np.arange(CORNER // 2)[:, np.newaxis])
    return np.stack([v for part in parts for v in (part, part * logarithm)], axis=1)


def _h_at(
    sampler: Sampler, samples: CornerSamples | None, k_hat: float
) -> tuple[Callable[[FloatArray], FloatArray], float]:
    """H of fmu/kernel/creep_table.h as a function of u, and the corner's t, or infinity."""
    if samples is not None and np.sqrt(k_hat) >= corner_sampling.LOWEST:
        row, decay = samples.at(np.sqrt(k_hat)), 0.5 * sampler.shape["twice_decay"]

        def sampled(u: FloatArray) -> FloatArray:
            return np.asarray(corner_sampling.value(row, u) / (1.0 - u) ** decay)

        return sampled, row.place / (1.0 - row.place)
    law = sampler.at(k_hat)

    def solved(u: FloatArray) -> FloatArray:
        node = kernel.table_nodes(u, k_hat, **sampler.shape)
        return np.asarray((law.traction_ratio(node.normalized_creepage) - node.line) / node.weight)

    corner: Corner | None = getattr(law, "corner", None)
    if corner is None or k_hat == 0.0:
        return solved, np.inf
    return solved, kernel.table_coordinate(corner.normalized_creepage, k_hat)


def _corner_numbers(
    sampler: Sampler, h: Callable[[FloatArray], FloatArray], place: float
) -> FloatArray:
    """1/T and the factors of the singular functions, fitted close to the corner t = T."""
    if place == np.inf:
        return np.zeros(CORNER)
    off = REACH * ((np.arange(60) + 0.5) / 60.0) ** 2
    off = np.concatenate([-off, off])
    t = place * (1.0 + off)
    # Columns: the singular terms, then a smooth remainder.
    terms = _corner_terms(t, 1.0 / place, 0.5 * sampler.shape["twice_corner"])
    matrix = np.hstack([terms, chebvander(off / REACH, 8)])
    factors = np.linalg.lstsq(matrix, h(t / (1.0 + t)), rcond=None)[0]
    return np.concatenate([[1.0 / place], factors[: CORNER - 1]])


def _with_ends(h: FloatArray) -> FloatArray:
    return np.concatenate([[CUBIC @ h[:4]], h, [CUBIC @ h[:-5:-1]]])


def _b_spline(values: FloatArray) -> FloatArray:
    """Uniform B-spline coefficients of the not-a-knot spline through `values` along axis 0.

    With node distance 1 a uniform cubic B-spline has c[j] = f[j] - f''[j]/6 at the nodes.
    """
    curvature = CubicSpline(np.arange(len(values)), values)(np.arange(len(values)), 2)
    c = values - curvature / 6.0
    first = curvature[0] + 2.0 * c[0] - c[1]
    last = curvature[-1] + 2.0 * c[-1] - c[-2]
    return np.concatenate([first[None], c, last[None]])


def pack(
    sampler: Sampler,
    cells: tuple[int, int],
    certificate: Certificate,
    coefficients: FloatArray,
    layers: Layers = Layers(),  # noqa: B008 (it is immutable)
) -> bytes:
    """Pack a table file, whose layout is defined in fmu/kernel/creep_table.c."""
    shape = sampler.shape
    header = struct.pack("<IIdddd", *cells, sampler.k_max, *certificate) + struct.pack(
        "<dIIII",
        sampler.static_to_kinetic,
        shape["one_axis"],
        shape["twice_decay"],
        shape["twice_corner"],
        shape["root_k"],
    )
    header += _layer_header(layers)
    label = sampler.name.encode()[:NAME_SIZE].ljust(NAME_SIZE, b"\0")
    body = np.ascontiguousarray(coefficients, dtype="<f8").tobytes()
    body += np.ascontiguousarray(layers.coefficients, dtype="<f4").tobytes()
    return kernel.framed(kernel.TABLE_MAGIC, kernel.TABLE_VERSION, header + label + body)
