"""The table of a contact law, which all simulations evaluate.

A table is one checked block of bytes that the kernel evaluates. This module contains no contact
mechanics: it accepts any factory ``law_type(k_hat=..., **options)`` whose objects have
``traction_ratio`` and ``slope``, or one such object that does not depend on k_hat.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    common_shape,
)
from contactlib.base.writing import write_whole
from contactlib.laws.law import Law
from contactlib.laws.traction_data import TractionData
from contactlib.table.building import HEADER_SIZE, NAME_SIZE, build, exchange_layers

FLOATS = frozenset((float, np.float64))  # a point of them is quicker without an array's checks


@lru_cache(maxsize=64)
def _native(data: bytes) -> kernel.NativeTable:
    """The kernel's table of these bytes, shared, as only wheelsets of one table step together."""
    return kernel.NativeTable(data)


class CreepForceTable:
    """Traction ratio over normalized creepage, k_hat and layer ratio, with a certificate.

    Make one with `from_law` or `load`.

    Attributes
    ----------
    data : bytes
        The table as `save` writes it.
    note : str
        The law's `summary`, if it has one: the fit residual of a measured curve.
    points : TractionData or None
        Those points. Neither they nor `note` are part of the file.

    Examples
    --------
    >>> from contactlib.laws.carter_griffith import CarterGriffith
    >>> table = CreepForceTable.from_law(CarterGriffith, contact="line")
    >>> table.max_error < 1e-14
    True
    >>> round(table.traction_ratio(1.131634, 0.3).item(), 6)
    1.135026
    """

    def __init__(self, data: bytes, note: str = "", points: TractionData | None = None) -> None:
        self.data = data
        self.note = note
        self.points = points
        self.native = _native(data)
        lib, struct = kernel.library(), self.native.struct
        self._ratio_at = partial(lib.creep_table_ratio, struct)
        self._slope_at = partial(lib.creep_table_slope, struct)

    def __reduce__(self) -> tuple[Any, ...]:
        return CreepForceTable, (self.data, self.note, self.points)

    @classmethod
    def from_law(
        cls,
        law: Callable[..., Law] | Law,
        *,
        target: float = 1e-8,
        slope_target: float = 1e-4,
        layers: bool = False,
        progress: Callable[[float], object] = lambda part: None,
        **options: Any,
    ) -> CreepForceTable:
        """Tabulate a law for all k_hat from 0 to 2 and certify the result.

        If the law has a `static_to_kinetic` below 1.52, k_hat ends where the weakening length is 12
        f_d a^2/R, as friction in a contact hardly falls over a longer one.

        Parameters
        ----------
        law : callable or Law
            ``law(k_hat=k, **options)`` is the law at one k_hat; or a law without k_hat.
        target, slope_target : float
            Maximum accepted errors of the traction ratio and of its slope [1].
        layers : bool
            Whether the table has a third axis, of the law's ``layer_ratio``, from 0 to 1e7. It
            takes minutes; `max_layer_error` is what it reaches.
        progress : callable
            Called with the fraction done, from 0 to 1.
        **options
            Keyword arguments for `law`.

        Raises
        ------
        ValueError
            If the finest grid misses a target; the message names the errors reached.
        """
        targets = (
            checked_number("target", target, Limits(above=0.0)),
            checked_number("slope_target", slope_target, Limits(above=0.0)),
        )
        of_law = getattr(law, "summary", ""), getattr(law, "points", None)
        return cls(build(law, options, targets, progress, layers), *of_law)

    @property
    def law(self) -> str:
        """Name and options of the law behind the table."""
        return self.data[HEADER_SIZE - NAME_SIZE : HEADER_SIZE].rstrip(b"\0").decode()

    @property
    def options(self) -> dict[str, str]:
        """Options of the law by name, as text."""
        return dict(word.split("=", 1) for word in self.law.split()[1:])

    @property
    def one_axis(self) -> bool:
        """Whether the law does not depend on k_hat."""
        return bool(self.native.struct.one_axis)

    @property
    def is_limit(self) -> bool:
        """Whether the law depends on k_hat but not on the friction ratio."""
        return not self.one_axis and self.static_to_kinetic is None

    @property
    def static_to_kinetic(self) -> float | None:
        """Friction ratio f_s/f_d to which the law applies; None means any."""
        return float(self.native.struct.static_to_kinetic) or None

    @property
    def max_error(self) -> float:
        """Certificate: maximum error of the traction ratio found [1]."""
        return float(self.native.struct.max_error)

    @property
    def max_slope_error(self) -> float:
        """Certificate: maximum error of the slope found [1]."""
        return float(self.native.struct.max_slope_error)

    @property
    def max_layer_error(self) -> float:
        """Certificate: maximum error of the traction ratio with a layer found [1]."""
        return float(self.native.struct.max_layer_error)

    @property
    def layer_bytes(self) -> bytes:
        """Coefficients of the layers, which end the file; nothing in a table without layers."""
        count = math.prod(n + 3 for n in self.layer_cells) if self.layered else 0
        return self.data[len(self.data) - 4 * count :]

    def without_layers(self) -> CreepForceTable:
        """The same table without its axis of layers."""
        if not self.layered:
            return self
        return CreepForceTable(exchange_layers(self.data, self.layer_bytes), self.note, self.points)

    @property
    def certificate_points(self) -> int:
        """Number of points at which the table was compared with the law."""
        return int(self.native.struct.certificate_points)

    @property
    def cells(self) -> tuple[int, int]:
        """Spline cells along creepage and k_hat; (0, 0) for the line contact's own law."""
        return self.native.struct.cells_u, self.native.struct.cells_k

    @property
    def layer_cells(self) -> tuple[int, int, int]:
        """Spline cells along creepage, k_hat and layer ratio; zeros in a table without layers."""
        struct = self.native.struct
        return struct.layer_u, struct.layer_k, struct.layer_w

    @property
    def k_max(self) -> float:
        """Largest k_hat of the table [1]."""
        return float(self.native.struct.k_max)

    @property
    def steepest_creepage(self) -> float:
        """Normalized creepage at which the law rises most steeply [1].

        It is zero, but for a measured curve that rises in an S.
        """
        return float(self.native.struct.steepest_creepage)

    @property
    def layered(self) -> bool:
        """Whether the law may have a layer."""
        return bool(self.native.struct.layer_w)

    def traction_ratio(
        self, normalized_creepage: ArrayLike, k_hat: ArrayLike, layer_ratio: ArrayLike = 0.0
    ) -> FloatArray:
        """Q/(f_d P); arguments broadcast.

        Raises
        ------
        ValueError
            If a creepage is not finite, a k_hat is not from 0 to `k_max`, or a layer ratio is below
            zero, or above it in a table without layers.
        """
        if {type(normalized_creepage), type(k_hat), type(layer_ratio)} <= FLOATS:
            ratio = self._ratio_at(normalized_creepage, k_hat, layer_ratio)
            if ratio == ratio:  # else an argument is out of range
                return np.array(ratio)
        return self.native.traction_ratio(*self._arrays(normalized_creepage, k_hat, layer_ratio))

    def slope(
        self, normalized_creepage: ArrayLike, k_hat: ArrayLike, layer_ratio: ArrayLike = 0.0
    ) -> FloatArray:
        """Derivative of `traction_ratio` by normalized creepage; arguments broadcast."""
        if {type(normalized_creepage), type(k_hat), type(layer_ratio)} <= FLOATS:
            slope = self._slope_at(normalized_creepage, k_hat, layer_ratio)
            if slope == slope:
                return np.array(slope)
        return self.native.slope(*self._arrays(normalized_creepage, k_hat, layer_ratio))

    def evaluate(
        self, normalized_creepage: ArrayLike, k_hat: ArrayLike, layer_ratio: ArrayLike = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """`traction_ratio` and `slope` together, at little more than the cost of one."""
        return self.native.evaluate(*self._arrays(normalized_creepage, k_hat, layer_ratio))

    def _arrays(
        self, normalized_creepage: ArrayLike, k_hat: ArrayLike, layer_ratio: ArrayLike
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The arguments, checked; all have the first one's shape, or the others one element."""
        x = checked("normalized_creepage", normalized_creepage, FINITE, copy=False)
        limits = Limits(at_least=0.0, at_most=self.k_max)
        k_hat = checked("k_hat", k_hat, limits, copy=False)
        max_layer_ratio = kernel.library().MAX_LAYER_RATIO if self.layered else 0.0
        layers = Limits(at_least=0.0, at_most=max_layer_ratio)
        layer_ratio = checked("layer_ratio", layer_ratio, layers, copy=False)
        if max(k_hat.size, layer_ratio.size) != 1 or max(k_hat.ndim, layer_ratio.ndim) > x.ndim:
            named = {"normalized_creepage": x, "k_hat": k_hat, "layer_ratio": layer_ratio}
            shape = common_shape(named)
            x, k_hat, layer_ratio = (np.broadcast_to(v, shape) for v in named.values())
        return x, k_hat, layer_ratio

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the table to a file; an interrupted write leaves no partial file."""
        return write_whole(path, self.data)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> CreepForceTable:
        """Read a table file.

        Raises
        ------
        ValueError
            If the file is not a table, is damaged or has another version; the message names it.
        """
        try:
            return cls(Path(path).read_bytes())
        except ValueError as error:
            raise ValueError(f"{os.fspath(path)}: {error}") from None
