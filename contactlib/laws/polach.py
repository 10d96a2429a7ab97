"""Polach's creep force of an elliptic contact in pure longitudinal creepage.

Source: O. Polach, "Creep forces in simulations of traction vehicles running on adhesion limit",
Wear 258 (2005) 992-1000. The force is (2 P mu/pi) (kA eps/(1 + (kA eps)**2) + atan(kS eps)) with
eps = G pi a b c11 zeta/(4 P mu). For two bodies of one material P = (2/3) pi a b p0 and
E* = G/(1 - nu). With zeta = x zeta0, where zeta0 = 2 mu p0/E* has the `tangential_modulus` of the
ellipse, E* c11/(pi**2/(4 (1 - nu))), friction, Kalker's c11 and nu drop out:

    eps = (3/16) pi**2 x,
    q = (2/pi) (kA eps/(1 + (kA eps)**2) + atan(kS eps)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FINITE, FloatArray, Quantity, checked
from contactlib.laws.contact_law import Peak
from contactlib.laws.formula import FormulaLaw

GRADIENT = 3.0 / 16.0 * math.pi**2  # eps/x
FAR = 1e150  # kA eps beyond which the area of adhesion has no effect in double precision


@dataclass(frozen=True, kw_only=True)
class Polach(FormulaLaw):
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
    >>> law = Polach.dry()
    >>> law.traction_ratio([0.5, 1.0, 3.0]).round(3).tolist()
    [0.543, 0.672, 0.842]
    >>> law.peak
    Peak(normalized_creepage=inf, traction_ratio=1.0)
    """

    kind = "polach"
    meaning = (
        "Polach's law of 2005, in longitudinal creepage; for an elliptic contact, which gives "
        "Kalker's coefficient."
    )
    contacts = ("elliptic",)
    example: ClassVar = {"adhesion_reduction": 0.3, "slip_reduction": 0.1}  # his wet rail

    adhesion_reduction: Annotated[float, Quantity("1", above=0.0, at_most=1.0)]
    slip_reduction: Annotated[float, Quantity("1", above=0.0, at_most=1.0)]

    @classmethod
    def dry(cls) -> Polach:
        """Polach's dry rail, for which he gives mu0 = 0.55, A = 0.40, B = 0.60 s/m."""
        return cls(adhesion_reduction=1.0, slip_reduction=0.4)

    @classmethod
    def wet(cls) -> Polach:
        """Polach's wet rail, for which he gives mu0 = 0.30, A = 0.40, B = 0.20 s/m."""
        return cls(adhesion_reduction=0.3, slip_reduction=0.1)

    @property
    def _stiffness(self) -> tuple[float, float]:
        """The factors kA eps/x and kS eps/x."""
        return self.adhesion_reduction * GRADIENT, self.slip_reduction * GRADIENT

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio q at x, for any shape of finite x; odd in x.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        stick, slip = self._stiffness
        with np.errstate(over="ignore"):  # the arctan of infinity is right
            ax, sx = np.clip(stick * x, -FAR, FAR), slip * x
        return np.asarray(2.0 / math.pi * (ax / (1.0 + ax**2) + np.arctan(sx)))

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Slope dq/dx at x, for any shape of finite x; even in x.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        stick, slip = self._stiffness
        with np.errstate(over="ignore"):  # the slope is zero there
            square = np.clip(stick * x, -FAR, FAR) ** 2
            of_stick = (1.0 - square) / (1.0 + square) * _bend(stick, x)
            return np.asarray(2.0 / math.pi * (of_stick + _bend(slip, x)))

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
        stick, _ = self._stiffness
        x = math.sqrt(v) / stick if stick > 0.0 else math.inf
        return Peak(x, 2.0 / math.pi * (math.sqrt(v) / (1.0 + v) + math.atan2(math.sqrt(v), u)))


def _bend(stiffness: float, x: FloatArray) -> FloatArray:
    """Derivative of arctan(stiffness x), without overflow of the square."""
    if stiffness == 0.0:  # the product of small numbers may underflow
        return np.zeros_like(x)
    return np.asarray(1.0 / (1.0 / stiffness + stiffness * x * x))
