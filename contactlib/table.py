"""The table: what stands between a contact law and everything that runs.

A law is sampled over the coordinates that fmu/creep_table.h explains, splined, written into one
checked block of bytes, and evaluated through the kernel. This module knows no contact mechanics:
it takes any factory ``law_type(k_hat=..., **options)`` whose objects have ``traction_ratio`` and
``slope``, or one such object that does not depend on k_hat.

The grid is refined until the certificate meets the target: the largest error against the law,
found on a dense set of points that are not grid nodes, over all k_hat and from the smallest
creepages to the far tail.
"""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, CubicSpline
from threadpoolctl import threadpool_limits

from contactlib import kernel
from contactlib.files import write_whole
from contactlib.parameters import FINITE, FloatArray, Limits, checked, checked_number, common_shape

HEADER, NAME_SIZE = 192, 104
K_MAX = 2.0
GRIDS = ((0, 0), (16, 8), (32, 16), (64, 32), (128, 64), (256, 192), (384, 288))
CORNER_GRIDS = {
    4: ((512, 204), (512, 232)),
    5: ((416, 160), (512, 232)),
}  # by twice the corner's power
ONE_AXIS_GRIDS = ((64, 1), (256, 1), (1024, 1), (4096, 1))
SLOPE_TARGET = 1e-4
CERTIFIED_K_HATS = 44  # besides the smallest ones and the largest
CUBIC = np.array([4.0, -6.0, 4.0, -1.0])  # continues four values by one
LARGEST = sys.float_info.max
CORNER = 7  # numbers a row that describe a corner

REACH = 0.1  # of the fit to a corner, in t/T
SMOOTHING = 8  # intervals along sqrt(k_hat)
FADE = 0.2

Row = TypeVar("Row")


class Law(Protocol):
    """What a table needs of a contact law at one k_hat.

    A law that tends to 1 like a power of 1/x other than the third says which as `tail_decay`; one
    whose second derivative is not continuous says where as `corner`; one that knows both values at
    once gives them as ``evaluate(x)``.
    """

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio at normalized creepages."""

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Its derivative."""


class Corner(Protocol):
    """A creepage x* below which a law has parts like (x* - x)**power, also times ln(x* - x)."""

    @property
    def normalized_creepage(self) -> float:
        """Creepage x*."""

    @property
    def power(self) -> float:
        """A multiple of one half."""


@lru_cache(maxsize=64)
def _native(data: bytes) -> kernel.NativeTable:
    """The kernel's table of these bytes: one for all, as wheelsets of one table step together."""
    return kernel.NativeTable(data)


class CreepForceTable:
    """Traction ratio over normalized creepage and k_hat, with a certificate.

    Make one with `from_law` or `load`.

    Examples
    --------
    >>> from contactlib.laws import CarterGriffith
    >>> table = CreepForceTable.from_law(CarterGriffith, contact="line")
    >>> table.max_error < 1e-14
    True
    >>> round(table.traction_ratio(1.131634, 0.3).item(), 6)
    1.135026
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.native = _native(data)
        self._evaluate_point = partial(kernel.library().creep_table_evaluate, self.native.struct)
        self._largest_k_hat = self.k_max
        self._spare: list[Any] = []

    def __reduce__(self) -> tuple[Any, ...]:
        return CreepForceTable, (self.data,)

    @classmethod
    def from_law(
        cls,
        law: Callable[..., Law] | Law,
        *,
        target: float = 1e-8,
        progress: Callable[[float], object] = lambda part: None,
        **options: Any,
    ) -> CreepForceTable:
        """Tabulate a law for all k_hat from 0 to 2 and certify the result.

        Parameters
        ----------
        law : callable or Law
            ``law(k_hat=k, **options)`` is the law at one k_hat; or a law that has none.
        target : float
            Largest error of the traction ratio to accept [1]; the slope's is 1e-4.
        progress : callable
            Is told what part of the work has been done, from 0 to 1.
        **options
            Handed to `law`.

        Raises
        ------
        ValueError
            If the finest grid misses the target; the message names the error reached.
        """
        target = checked_number("target", target, Limits(above=0.0))
        sampler = _Sampler(law, options, progress)
        reference = _reference_values(sampler)
        done = 0.5
        for cells in sampler.grids:
            then = 0.5 * (1.0 + done)  # nobody knows which grid will do
            coefficients = _fit(sampler, *cells, done, then)
            draft = cls(_pack(sampler, cells, (0.0, 0.0, 0), coefficients))
            certificate = draft._errors_against(reference)
            if certificate[0] <= target and certificate[1] <= SLOPE_TARGET:
                progress(1.0)
                return cls(_pack(sampler, cells, certificate, coefficients))
            done = then
        raise ValueError(
            f"target = {target!r} is not reached for {sampler.name}: the finest grid has the error "
            f"{certificate[0]:.2e} of the traction ratio and {certificate[1]:.2e} of its slope"
        )

    def _errors_against(self, reference: list[_Reference]) -> tuple[float, float, int]:
        error = slope_error = 0.0
        points = 0
        for row in reference:
            ratio, slope = self.native.evaluate(row.x, np.array([row.k_hat]))
            error = max(error, float(np.max(np.abs(ratio - row.ratio))))
            slope_error = max(slope_error, float(np.max(np.abs(slope - row.slope))))
            points += row.x.size
        return error, slope_error, points

    @property
    def law(self) -> str:
        """Name and options of the law behind the table."""
        return self.data[HEADER - NAME_SIZE : HEADER].rstrip(b"\0").decode()

    @property
    def options(self) -> dict[str, str]:
        """Options of the law by name, as they stand in `law`."""
        return dict(word.split("=", 1) for word in self.law.split()[1:])

    @property
    def one_axis(self) -> bool:
        """Whether the law does not depend on k_hat."""
        return bool(self.native.struct.one_axis)

    @property
    def is_limit(self) -> bool:
        """Whether the law depends on k_hat but not on the friction ratio behind it."""
        return not self.one_axis and self.static_to_kinetic is None

    @property
    def static_to_kinetic(self) -> float | None:
        """Friction ratio f_s/f_d that the law holds for; None if for any."""
        return float(self.native.struct.static_to_kinetic) or None

    @property
    def max_error(self) -> float:
        """Certificate: largest error of the traction ratio found [1]."""
        return float(self.native.struct.max_error)

    @property
    def max_slope_error(self) -> float:
        """Certificate: largest error of the slope found [1]."""
        return float(self.native.struct.max_slope_error)

    @property
    def certificate_points(self) -> int:
        """Number of points at which the table was held against the law."""
        return int(self.native.struct.certificate_points)

    @property
    def cells(self) -> tuple[int, int]:
        """Spline cells along creepage and along k_hat; none if the law is the line contact's."""
        return self.native.struct.cells_u, self.native.struct.cells_k

    @property
    def k_max(self) -> float:
        """Largest k_hat of the table [1]."""
        return float(self.native.struct.k_max)

    def traction_ratio(self, normalized_creepage: ArrayLike, k_hat: ArrayLike) -> FloatArray:
        """Q/(f_d P); arguments broadcast.

        Raises
        ------
        ValueError
            If a creepage is not finite or a k_hat is not from 0 to `k_max`.
        """
        one = self._at_point("traction_ratio", normalized_creepage, k_hat)
        return self.evaluate(normalized_creepage, k_hat)[0] if one is None else np.array(one)

    def slope(self, normalized_creepage: ArrayLike, k_hat: ArrayLike) -> FloatArray:
        """Derivative of `traction_ratio` to normalized creepage; arguments broadcast."""
        one = self._at_point("slope", normalized_creepage, k_hat)
        return self.evaluate(normalized_creepage, k_hat)[1] if one is None else np.array(one)

    def evaluate(
        self, normalized_creepage: ArrayLike, k_hat: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """`traction_ratio` and `slope` at once, for the work of one."""
        x = checked("normalized_creepage", normalized_creepage, FINITE, copy=False)
        limits = Limits(at_least=0.0, at_most=self._largest_k_hat)
        k_hat = checked("k_hat", k_hat, limits, copy=False)
        if k_hat.size != 1 or k_hat.ndim > x.ndim:
            shape = common_shape({"normalized_creepage": x, "k_hat": k_hat})
            x, k_hat = np.broadcast_to(x, shape), np.broadcast_to(k_hat, shape)
        return self.native.evaluate(x, k_hat)

    def _at_point(self, what: str, x: object, k_hat: object) -> float | None:
        """One of the kernel's values at two floats within their limits, else None.

        Checks of arrays would cost twenty times as much as the kernel's work on one point.
        """
        if not (isinstance(x, float) and isinstance(k_hat, float)):
            return None
        if not (abs(x) <= LARGEST and 0.0 <= k_hat <= self._largest_k_hat):
            return None
        try:  # a struct that no other thread has; to make one costs as much as to use it
            value = self._spare.pop()
        except IndexError:
            value = kernel.ffi.new("creep_value *")
        self._evaluate_point(x, k_hat, value)
        found: float = getattr(value, what)
        self._spare.append(value)
        return found

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the table to a file, whole or not at all."""
        return write_whole(path, self.data)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> CreepForceTable:
        """Read a table file.

        Raises
        ------
        ValueError
            If the file is no table, damaged, or of another version; the message names the file.
        """
        try:
            return cls(Path(path).read_bytes())
        except ValueError as error:
            raise ValueError(f"{os.fspath(path)}: {error}") from None


class _Reference(NamedTuple):
    """Values of a law at points of the certificate for one k_hat."""

    k_hat: float
    x: FloatArray
    ratio: FloatArray
    slope: FloatArray


class _Sampler:
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
        self.name = " ".join(
            [kind, *(f"{key}={getattr(value, 'name', value)}" for key, value in options.items())]
        )
        some = self.at(1.0)
        corner: Corner | None = getattr(some, "corner", None)
        self.static_to_kinetic = float(getattr(some, "static_to_kinetic", 0.0))
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

    def at(self, k_hat: float) -> Law:
        """The law at one k_hat."""
        if callable(self._law):
            return self._law(k_hat=k_hat, **self._options)
        return self._law

    def rows(
        self, row: Callable[[float], Row], k_hats: Sequence[float], done: float, then: float
    ) -> list[Row]:
        """Call `row` for every k_hat, in threads; report progress from `done` to `then`.

        Neighbours may share work that a law keeps, so the threads take k_hats far apart.
        """
        found: dict[int, Row] = {}
        order = np.random.default_rng(0).permutation(len(k_hats)).tolist()
        # The law's own linear algebra is on small matrices, where more threads are slower.
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


def _reference_values(sampler: _Sampler) -> list[_Reference]:
    """Values of the law on the certificate's points, none of which is a node of any grid."""

    def row(k_hat: float) -> _Reference:
        law = sampler.at(k_hat)
        in_cells = kernel.table_nodes(_off_nodes(500), k_hat, **sampler.shape).normalized_creepage
        x = np.concatenate([in_cells, np.geomspace(1e-12, 1e6, 150), [0.0, 1.0]])
        evaluate = getattr(law, "evaluate", None)
        values = evaluate(x) if evaluate else (law.traction_ratio(x), law.slope(x))
        return _Reference(k_hat, x, *values)

    # Irrational fractions of the table's axes; the ends are its real borders.
    inner = K_MAX * _off_nodes(CERTIFIED_K_HATS) ** 2
    k_hats = [0.0, 1e-12, 1e-9, 1e-6, 1e-5, 1e-4, 1e-3, *inner.tolist(), K_MAX]
    return sampler.rows(row, [1.0] if sampler.one_axis else k_hats, 0.0, 0.5)


def _off_nodes(n: int) -> FloatArray:
    return np.asarray((np.arange(n) + np.sqrt(0.5)) / (n + 1.0))


def _fit(sampler: _Sampler, cells_u: int, cells_k: int, done: float, then: float) -> FloatArray:
    """Numbers of the table, a row for each spline coefficient along sqrt(k_hat)."""
    if cells_u == 0:
        return np.empty((0, 0))
    inner = np.linspace(0.0, 1.0, cells_u + 1)[1:-1]

    lead = CORNER if sampler.shape["twice_corner"] else 0

    def row(k_hat: float) -> FloatArray:
        if k_hat == 0.0 and sampler.shape["root_k"]:
            return np.zeros(lead + cells_u - 1)
        law = sampler.at(k_hat)
        node = kernel.table_nodes(inner, k_hat, **sampler.shape)
        h = (law.traction_ratio(node.normalized_creepage) - node.line) / node.weight
        return np.concatenate([_corner_numbers(sampler, law, k_hat), h]) if lead else np.asarray(h)

    if sampler.one_axis:
        return _b_spline(_with_ends(row(1.0)))[np.newaxis]
    root_k = np.linspace(0.0, np.sqrt(K_MAX), cells_k + 1)
    # Rounding must not leave the law's range.
    k_hats = np.minimum(root_k**2, K_MAX).tolist()
    rows = np.array(sampler.rows(row, k_hats, done, then))
    numbers, h = rows[:, :lead], rows[:, lead:]
    if lead:
        # Each row's fit has some noise, which an interpolation between rows would not forgive.
        numbers[:, 1:] = _smooth(root_k, numbers[:, 1:])
        power, t = 0.5 * sampler.shape["twice_corner"], inner / (1.0 - inner)
        for values, number in zip(h, numbers, strict=True):
            values -= _corner_terms(t, number[0], power) @ number[1:]
    along_u = _b_spline(np.apply_along_axis(_with_ends, 1, h).T).T
    return _b_spline(np.hstack([numbers, along_u]))


def _smooth(x: FloatArray, values: FloatArray) -> FloatArray:
    """Quintic splines over few intervals through the columns of `values`, by least squares.

    They fade out at small x, where a corner is too weak to need its terms.
    """
    fade = x**4 / (x**4 + FADE**4)
    knots = np.linspace(0.0, x[-1], SMOOTHING + 1)
    knots = np.concatenate([[0.0] * 5, knots, [x[-1]] * 5])
    basis = fade[:, np.newaxis] * BSpline.design_matrix(x, knots, 5).toarray()
    return np.asarray(basis @ np.linalg.lstsq(basis, values, rcond=None)[0])


def _corner_terms(t: ArrayLike, inverse_place: float, power: float) -> FloatArray:
    """The singular functions of fmu/creep_table.h at t, (t.size, CORNER - 1)."""
    y = np.asarray(t) * inverse_place
    z = np.maximum(1.0 - y, 0.0) if inverse_place > 0.0 else np.zeros_like(y)
    logarithm = np.log(np.where(z > 0.0, z, 1.0))
    parts = y**4 * z ** (power + np.arange(CORNER // 2)[:, np.newaxis])
    return np.stack([v for part in parts for v in (part, part * logarithm)], axis=1)


def _corner_numbers(sampler: _Sampler, law: Law, k_hat: float) -> FloatArray:
    """1/T and the factors of the singular functions, from a fit close to the corner."""
    corner: Corner | None = getattr(law, "corner", None)
    if corner is None or k_hat == 0.0:
        return np.zeros(CORNER)
    place = kernel.table_place(corner.normalized_creepage, k_hat)
    off = REACH * ((np.arange(60) + 0.5) / 60.0) ** 2
    off = np.concatenate([-off, off])
    t = place * (1.0 + off)
    node = kernel.table_nodes(t / (1.0 + t), k_hat, **sampler.shape)
    h = (law.traction_ratio(node.normalized_creepage) - node.line) / node.weight
    # The singular terms, and a smooth rest.
    terms = _corner_terms(t, 1.0 / place, corner.power)
    matrix = np.hstack([terms, chebvander(off / REACH, 8)])
    factors = np.linalg.lstsq(matrix, h, rcond=None)[0]
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


def _pack(
    sampler: _Sampler,
    cells: tuple[int, int],
    certificate: tuple[float, float, int],
    coefficients: FloatArray,
) -> bytes:
    """The table file; its layout is that of fmu/creep_table.c."""
    shape = sampler.shape
    header = struct.pack("<IIdddd", *cells, K_MAX, *certificate) + struct.pack(
        "<dIIII",
        sampler.static_to_kinetic,
        shape["one_axis"],
        shape["twice_decay"],
        shape["twice_corner"],
        shape["root_k"],
    )
    label = sampler.name.encode()[:NAME_SIZE].ljust(NAME_SIZE, b"\0")
    body = np.ascontiguousarray(coefficients, dtype="<f8").tobytes()
    return kernel.framed(kernel.TABLE_MAGIC, kernel.TABLE_VERSION, header + label + body)
