"""The table: what stands between a contact law and everything that runs.

A law is sampled over the coordinates that fmu/creep_table.h explains, splined, written into one
checked block of bytes, and evaluated through the kernel. This module knows no contact mechanics:
it takes any factory ``law_type(k_hat=..., **options)`` whose objects have ``traction_ratio`` and
``slope``.

The grid is refined until the certificate meets the target: the largest error against the law,
found on a dense set of points that are not grid nodes, over all k_hat and from the smallest
creepages to the far tail.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from contactlib import kernel
from contactlib.files import write_whole
from contactlib.parameters import FINITE, FloatArray, Limits, checked

MAGIC, VERSION, NAME_SIZE = b"CREEPTAB", 1, 64
K_MAX = 2.0
GRIDS = ((0, 0), (16, 8), (32, 16), (64, 32), (128, 64), (256, 192), (384, 288))
SLOPE_TARGET = 1e-4


class Law(Protocol):
    """What a table needs of a contact law at one k_hat."""

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio at normalized creepages."""

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Its derivative."""


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
        self.native = kernel.NativeTable(data)

    @classmethod
    def from_law(
        cls,
        law_type: Callable[..., Law],
        *,
        target: float = 1e-8,
        progress: Callable[[float], object] = lambda part: None,
        **options: Any,
    ) -> CreepForceTable:
        """Tabulate a law for all k_hat from 0 to 2 and certify the result.

        Parameters
        ----------
        law_type : callable
            ``law_type(k_hat=k, **options)`` is the law at one k_hat.
        target : float
            Largest error of the traction ratio to accept [1]; the slope's is 1e-4.
        progress : callable
            Is told what part of the certificate's points the law has been solved at.
        **options
            Handed to `law_type`.

        Raises
        ------
        ValueError
            If the finest grid misses the target; the message names the error reached.
        """
        checked("target", target, Limits(above=0.0))
        name = " ".join([law_type.__name__, *(f"{k}={v}" for k, v in options.items())])

        def law_at(k_hat: float) -> Law:
            return law_type(k_hat=k_hat, **options)

        reference = _reference_values(law_at, progress)
        for cells_u, cells_k in GRIDS:
            coefficients = _fit(law_at, cells_u, cells_k)
            draft = cls(_pack(name, cells_u, cells_k, (0.0, 0.0, 0), coefficients))
            certificate = draft._errors_against(reference)
            if certificate[0] <= target and certificate[1] <= SLOPE_TARGET:
                return cls(_pack(name, cells_u, cells_k, certificate, coefficients))
        raise ValueError(
            f"target = {target!r} is not reached for {name}: the finest grid has the error "
            f"{certificate[0]:.2e} of the traction ratio and {certificate[1]:.2e} of its slope"
        )

    def _errors_against(self, reference: list[_Reference]) -> tuple[float, float, int]:
        error = slope_error = 0.0
        points = 0
        for k_hat, x, law_ratio, law_slope in reference:
            ratio, slope = self.native.evaluate(x, np.array([k_hat]))
            error = max(error, float(np.max(np.abs(ratio - law_ratio))))
            slope_error = max(slope_error, float(np.max(np.abs(slope - law_slope))))
            points += x.size
        return error, slope_error, points

    @property
    def law(self) -> str:
        """Name and options of the law behind the table."""
        return self.data[64 : 64 + NAME_SIZE].rstrip(b"\0").decode()

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
        return self._evaluate(normalized_creepage, k_hat)[0]

    def slope(self, normalized_creepage: ArrayLike, k_hat: ArrayLike) -> FloatArray:
        """Derivative of `traction_ratio` to normalized creepage; arguments broadcast."""
        return self._evaluate(normalized_creepage, k_hat)[1]

    def _evaluate(self, x: ArrayLike, k_hat: ArrayLike) -> tuple[FloatArray, FloatArray]:
        x = checked("normalized_creepage", x, FINITE)
        k_hat = checked("k_hat", k_hat, Limits(at_least=0.0, at_most=self.k_max))
        if k_hat.size != 1 or k_hat.ndim > x.ndim:
            x, k_hat = np.broadcast_arrays(x, k_hat)
        return self.native.evaluate(x, k_hat)

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


_Reference = tuple[float, FloatArray, FloatArray, FloatArray]


def _reference_values(
    law_at: Callable[[float], Law], progress: Callable[[float], object]
) -> list[_Reference]:
    """Values of the law on the certificate's points, none of which is a node of any grid."""
    # Irrational fractions of the table's axes; the ends are its real borders.
    inner = K_MAX * _off_nodes(96) ** 2
    k_hats = [0.0, *np.geomspace(1e-12, 1e-3, 10).tolist(), *inner.tolist(), K_MAX]
    rows = []
    for row, k_hat in enumerate(k_hats):
        law = law_at(k_hat)
        in_cells = kernel.table_nodes(_off_nodes(1500), k_hat).normalized_creepage
        x = np.concatenate([in_cells, np.geomspace(1e-12, 1e6, 500), [0.0, 1.0]])
        rows.append((k_hat, x, law.traction_ratio(x), law.slope(x)))
        progress((row + 1) / len(k_hats))
    return rows


def _off_nodes(n: int) -> FloatArray:
    return np.asarray((np.arange(n) + np.sqrt(0.5)) / (n + 1.0))


def _fit(law_at: Callable[[float], Law], cells_u: int, cells_k: int) -> FloatArray:
    """Spline coefficients of what the law adds to the line contact: (cells_k+3, cells_u+3)."""
    if cells_u == 0:
        return np.empty((0, 0))
    u = np.linspace(0.0, 1.0, cells_u + 1)
    inner = u[1:-1]  # the ends, where the weight vanishes, continue the cubic
    samples = np.empty((cells_k + 1, cells_u + 1))
    for row, root_k in enumerate(np.linspace(0.0, np.sqrt(K_MAX), cells_k + 1)):
        k_hat = min(float(root_k) ** 2, K_MAX)  # rounding must not leave the law's range
        node = kernel.table_nodes(inner, k_hat)
        ratio = law_at(k_hat).traction_ratio(node.normalized_creepage)
        samples[row] = _with_ends((ratio - node.line) / node.weight)
    return _b_spline(_b_spline(samples.T).T)


def _with_ends(h: FloatArray) -> FloatArray:
    cubic = np.array([4.0, -6.0, 4.0, -1.0])
    return np.concatenate([[cubic @ h[:4]], h, [cubic @ h[:-5:-1]]])


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
    name: str,
    cells_u: int,
    cells_k: int,
    certificate: tuple[float, float, int],
    coefficients: FloatArray,
) -> bytes:
    """The table file; its layout is that of fmu/creep_table.c."""
    header = struct.pack("<IIdddd", cells_u, cells_k, K_MAX, *certificate)
    label = name.encode()[:NAME_SIZE].ljust(NAME_SIZE, b"\0")
    body = np.ascontiguousarray(coefficients, dtype="<f8").tobytes()
    return kernel.framed(MAGIC, VERSION, header + label + body)
