"""Polach's creep force of an elliptic contact in pure longitudinal creepage.

Source: O. Polach, "Creep forces in simulations of traction vehicles running on adhesion limit",
Wear 258 (2005) 992-1000. The force is (2 P mu/pi) (kA eps/(1 + (kA eps)**2) + atan(kS eps)) with
eps = G pi a b c11 zeta/(4 P mu). For two bodies of one material P = (2/3) pi a b p0 and
E* = G/(1 - nu), and the friction drops out against zeta = x zeta0 = 2 x mu p0/E*, with the zeta0
of independent strips:

    eps = (3/4) (1 - nu) c11 x,
    q = (2/pi) (kA eps/(1 + (kA eps)**2) + atan(kS eps)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FINITE, FloatArray, Parameters, Quantity, checked
from contactlib.contact.kalker import A_OVER_B, POISSON_RATIO, kalker_coefficients
from contactlib.contact.laws.contact_law import Peak

FAR = 1e150  # kA eps beyond which the area of adhesion changes no digit


@dataclass(frozen=True, kw_only=True)
class Polach(Parameters):
    """Polach's traction ratio q = Q/(mu P) against normalized creepage x = zeta/zeta0.

    Friction that falls with slip speed, mu = mu0 ((1 - A) exp(-B w) + A), belongs to the friction
    and not to the law; without it, and with kS <= kA, the traction never exceeds mu P.

    Parameters
    ----------
    adhesion_reduction : float
        kA, factor on Kalker's stiffness in the area of adhesion [1], above 0 and at most 1.
    slip_reduction : float
        kS, factor in the area of slip [1], above 0 and at most 1. Polach requires kS <= kA, or the
        traction exceeds mu P; kS > kA is allowed here, so that a fit can find it.
    a_over_b : float
        Semi-axis of the contact ellipse in the rolling direction over that across it [1], from
        0.05 to 20. With `poisson_ratio` it gives Kalker's c11, see `kalker_coefficients`.
    poisson_ratio : float
        nu of both bodies [1], from 0 to 0.5.

    Raises
    ------
    ValueError
        If a value is not finite or out of its range.

    Notes
    -----
    The initial slope is (kA + kS)/2 times that of Kalker's linear theory: kA and kS are the
    reduction for a third-body layer, so zeta0 needs no other.

    Examples
    --------
    >>> law = Polach.dry(a_over_b=1.0, poisson_ratio=0.25)
    >>> law.traction_ratio([0.5, 1.0, 3.0]).round(3).tolist()
    [0.591, 0.707, 0.87]
    >>> law.peak
    Peak(normalized_creepage=inf, traction_ratio=1.0)
    """

    adhesion_reduction: Annotated[float, Quantity("1", above=0.0, at_most=1.0)]
    slip_reduction: Annotated[float, Quantity("1", above=0.0, at_most=1.0)]
    a_over_b: Annotated[float, A_OVER_B]
    poisson_ratio: Annotated[float, POISSON_RATIO]

    @classmethod
    def dry(cls, *, a_over_b: float, poisson_ratio: float) -> Polach:
        """Polach's dry rail, for which he gives mu0 = 0.55, A = 0.40, B = 0.60 s/m."""
        return cls(
            adhesion_reduction=1.0,
            slip_reduction=0.4,
            a_over_b=a_over_b,
            poisson_ratio=poisson_ratio,
        )

    @classmethod
    def wet(cls, *, a_over_b: float, poisson_ratio: float) -> Polach:
        """Polach's wet rail, for which he gives mu0 = 0.30, A = 0.40, B = 0.20 s/m."""
        return cls(
            adhesion_reduction=0.3,
            slip_reduction=0.1,
            a_over_b=a_over_b,
            poisson_ratio=poisson_ratio,
        )

    @cached_property
    def _stiffness(self) -> tuple[float, float]:
        """The factors kA eps/x and kS eps/x."""
        c11 = float(kalker_coefficients(self.a_over_b, self.poisson_ratio).c11)
        gradient = 0.75 * (1.0 - self.poisson_ratio) * c11
        return self.adhesion_reduction * gradient, self.slip_reduction * gradient

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio q at x, for any shape of finite x; odd in x.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        adhesion, slip = self._stiffness
        with np.errstate(over="ignore"):  # the arctan of infinity is right
            ax, sx = np.clip(adhesion * x, -FAR, FAR), slip * x
        return np.asarray(2.0 / math.pi * (ax / (1.0 + ax**2) + np.arctan(sx)))

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Slope dq/dx at x, for any shape of finite x; even in x.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        adhesion, slip = self._stiffness
        with np.errstate(over="ignore"):  # the slope is zero there
            square = np.clip(adhesion * x, -FAR, FAR) ** 2
            of_adhesion = (1.0 - square) / (1.0 + square) * _bend(adhesion, x)
            return np.asarray(2.0 / math.pi * (of_adhesion + _bend(slip, x)))

    @property
    def peak(self) -> Peak:
        """Maximum of the law; the limit 1 at infinite creepage if kS <= kA.

        The law then rises throughout if kS/kA >= tan(pi/24) = 0.1317, else it has a hump at small
        creepage that is lower than the limit. If kS > kA it has one maximum, above 1.
        """
        u = self.adhesion_reduction / self.slip_reduction
        if u >= 1.0:
            return Peak(math.inf, 1.0)
        # With v = (kA eps)**2, dq/dx = 0 is (1 - u) v**2 - (1 + 2 u - u**2) v - (u + u**2) = 0.
        b = 1.0 + 2.0 * u - u * u
        v = (b + math.sqrt(b * b + 4.0 * (1.0 - u) * (u + u * u))) / (2.0 * (1.0 - u))
        adhesion, _ = self._stiffness
        x = math.sqrt(v) / adhesion if adhesion > 0.0 else math.inf
        return Peak(x, 2.0 / math.pi * (math.sqrt(v) / (1.0 + v) + math.atan2(math.sqrt(v), u)))


def _bend(stiffness: float, x: FloatArray) -> FloatArray:
    """Derivative of arctan(stiffness x), without overflow of the square."""
    if stiffness == 0.0:  # the product of small numbers may underflow
        return np.zeros_like(x)
    return np.asarray(1.0 / (1.0 / stiffness + stiffness * x * x))
