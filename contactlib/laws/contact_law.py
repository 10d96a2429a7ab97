"""Base of the laws of contact mechanics: parameters, symmetry, the strips of an ellipse."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    common_shape,
)

LATERAL = Limits(at_least=-1.0, at_most=1.0)
K_HAT = Quantity("1", at_least=0.0, at_most=2.0)
LAYER_RATIO = Quantity("1", at_least=0.0, at_most=1e7)


class Peak(NamedTuple):
    """The largest traction ratio, and the normalized creepage where it occurs."""

    normalized_creepage: float
    traction_ratio: float


@dataclass(frozen=True, kw_only=True)
class ContactLaw(Parameters, ABC):
    """Traction ratio q = Q/(f_d P) against normalized creepage x = zeta/zeta0 at one `k_hat`."""

    k_hat: Annotated[float, K_HAT]
    contact: Literal["line", "elliptic"] = "line"

    @abstractmethod
    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Traction ratio and slope at x >= 0, of any shape."""

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio q at x, for any shape of finite x; odd in x.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        return self.evaluate(normalized_creepage)[0]

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Slope dq/dx at x, for any shape of finite x; even in x.

        At x = 0 it is 2 for the line and 3 pi/4 for the ellipse, whatever `k_hat` is; less with a
        layer.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        return self.evaluate(normalized_creepage)[1]

    def evaluate(self, normalized_creepage: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """`traction_ratio` and `slope` together, at the cost of one."""
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        ratio, slope = self._evaluate(np.abs(x))
        return np.copysign(ratio, x), slope

    def _peak_beyond(self, low: float, high: float) -> Peak:
        """Zero of the slope beyond a creepage where q rises; `high` grows until q falls there."""
        while self.slope(high) > 0.0:
            low, high = high, 2.0 * high
        x = float(brentq(lambda v: float(self.slope(v)), low, high, xtol=1e-300, rtol=1e-15))
        return Peak(x, float(self.traction_ratio(x)))


def strips_at(
    contact: str, normalized_creepage: ArrayLike, lateral_position: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Creepage and relative half-width w of the strips, broadcast and checked."""
    x = checked("normalized_creepage", normalized_creepage, FINITE)
    eta = checked("lateral_position", lateral_position, LATERAL)
    w = np.sqrt((1.0 - eta) * (1.0 + eta)) if contact == "elliptic" else np.ones_like(eta)
    shape = common_shape({"normalized_creepage": x, "lateral_position": eta})
    return np.broadcast_to(x, shape), np.broadcast_to(w, shape)


def places_at(
    contact: str, position: ArrayLike, normalized_creepage: ArrayLike, lateral_position: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions, and the creepages and relative half-widths of their strips."""
    xi = checked("position", position, FINITE)
    x, w = strips_at(contact, normalized_creepage, lateral_position)
    shape = common_shape({"position": xi, "normalized_creepage and lateral_position": x})
    return np.broadcast_to(xi, shape), np.broadcast_to(x, shape), np.broadcast_to(w, shape)
