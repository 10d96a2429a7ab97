"""The cohesive-zone law: friction that weakens over a finite slip, without the paper's limit.

The paper lets the weakening zone shrink to a point, where a singularity takes its place. Here the
friction f(u) acts over the zone's true length. That bounds the traction by f_s p, keeps the force
below f_s P, and gives the falling branch its true tail. The equations are those of
`contactlib.laws.slip_zone`; an ellipse is made of strips, as in `contactlib.laws.strips`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.friction import EXPONENTIAL, Weakening
from contactlib.laws import slip_strips
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.contact_law import ContactLaw, places_at, strips_at
from contactlib.laws.peak import Corner, Peak
from contactlib.laws.slip_curve import SlipCurve
from contactlib.laws.slip_profile import Along, along_contact, find_state
from contactlib.laws.slip_zone import sliding_creepage
from contactlib.parameters import FloatArray, Quantity

# Below these the Carter-Griffith law is nearer than 1e-12 and 2e-9.
SMALLEST_K_HAT = {"line": 1e-6, "elliptic": slip_strips.SMALLEST_K_HAT}
SMALLEST_X, LARGEST_X = 1e-9, 1e12


@lru_cache(maxsize=64)  # not a cached property, whose lock would keep threads waiting
def _curve(k_hat: float, static_to_kinetic: float, weakening: Weakening) -> SlipCurve:
    return SlipCurve.solve(np.array([k_hat]), static_to_kinetic, weakening)[0]


@dataclass(frozen=True, kw_only=True)
class CohesiveZone(ContactLaw):
    """Traction ratio q = Q/(f_d P) against normalized creepage x = zeta/zeta0.

    Parameters
    ----------
    k_hat : float
        Normalized stress-intensity factor of Eq. (17), from 0 to 2: it measures the weakening
        length, Delta R/(f_d a**2) = pi k_hat**2/(2 (r - 1)) with r = `static_to_kinetic`.
    static_to_kinetic : float
        r = f_s/f_d, above 1 and at most 30.
    contact : {"line", "elliptic"}
        Shape of the contact, as in `CarterGriffith`.
    weakening : Weakening
        Shape of f(u); Rabinowicz's exponential if left out. `Friction.weakening` has that of any
        friction.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    ConvergenceError
        On use, if a state has no solution that the iteration finds, or creepage does not grow
        along the curve.

    Examples
    --------
    >>> law = CohesiveZone(k_hat=0.3, static_to_kinetic=0.33 / 0.21)
    >>> round(law.traction_ratio(1.6).item(), 5)
    1.06477
    """

    static_to_kinetic: Annotated[float, Quantity("1", above=1.0, at_most=30.0)]
    weakening: Weakening = EXPONENTIAL

    @cached_property
    def _limit(self) -> CarterGriffith | None:
        """The law of a vanishing zone, where it takes over."""
        if self.k_hat >= SMALLEST_K_HAT[self.contact]:
            return None
        return CarterGriffith(k_hat=self.k_hat, contact=self.contact)

    @property
    def _curve(self) -> SlipCurve:
        return _curve(self.k_hat, self.static_to_kinetic, self.weakening)

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self._limit is not None:
            return self._limit.evaluate(x)
        line = self.contact == "line"
        slope = np.full(x.size, 2.0 if line else 0.75 * np.pi)
        ratio = slope * np.minimum(x.ravel(), 1.0)  # to nine digits at the smallest creepages
        rolling = np.flatnonzero(x > SMALLEST_X)
        at = np.minimum(x.flat[rolling], LARGEST_X)  # where q is 1 to the last digit
        if line:
            state = self._curve.at(at)
            ratio[rolling], slope[rolling] = state.traction_ratio, state.slope
        else:
            ratio[rolling], slope[rolling] = slip_strips.cohesive_ellipse(
                at, self.k_hat, self.static_to_kinetic, self.weakening
            )
        return ratio.reshape(x.shape), slope.reshape(x.shape)

    @property
    def sliding_creepage(self) -> float:
        """Creepage x from which on nothing sticks any more."""
        if self._limit is not None:
            return np.inf
        if self.contact == "elliptic":
            return sliding_creepage(self.k_hat, self.static_to_kinetic, self.weakening)
        return self._curve.sliding_creepage

    @property
    def tail_decay(self) -> float:
        """Power of 1/x like which q tends to 1: of the leading edge's pressure and its slip."""
        return 1.5

    @property
    def carter_at_zero(self) -> bool:
        """Whether q less that of the Carter-Griffith line contact vanishes at no `k_hat`."""
        return self.contact == "line"

    @property
    def corner(self) -> Corner | None:
        """Where the second derivative grows without bound, as a logarithm: where stick ends.

        In an ellipse that is the strip in the middle, and its neighbours soften it by half a power.
        """
        if self._limit is not None:
            return None
        return Corner(self.sliding_creepage, 2.0 if self.contact == "line" else 2.5)

    @cached_property
    def peak(self) -> Peak:
        """Maximum of the law."""
        if self._limit is not None:
            return self._limit.peak
        low, high = 0.1, 2.0 + 4.0 * self.static_to_kinetic
        x = float(brentq(lambda v: float(self.slope(v)), low, high, xtol=1e-15, rtol=1e-15))
        return Peak(x, float(self.traction_ratio(x)))

    def stick_boundary(
        self, normalized_creepage: ArrayLike, lateral_position: ArrayLike = 0.0
    ) -> FloatArray:
        """Stick boundary c/a, as `CarterGriffith.stick_boundary`; the leading edge in full slip."""
        if self._limit is not None:
            return self._limit.stick_boundary(normalized_creepage, lateral_position)
        x, w = strips_at(self.contact, normalized_creepage, lateral_position)
        if self.contact == "line":
            at = np.clip(np.abs(x).ravel(), SMALLEST_X, LARGEST_X)
            stick = self._curve.at(at).stick_length.reshape(x.shape)
            stick = np.where(np.abs(x) <= SMALLEST_X, 2.0, stick)  # to twelve digits
        else:
            stick = np.array([self._state(*pair)[0] for pair in zip(x.flat, w.flat, strict=True)])
        return np.asarray(w * (1.0 - stick.reshape(x.shape)))

    def shear_traction(
        self,
        position: ArrayLike,
        normalized_creepage: ArrayLike,
        lateral_position: ArrayLike = 0.0,
    ) -> FloatArray:
        """Surface shear traction over f_d p0, as `CarterGriffith.shear_traction`; bounded here."""
        along, w, sign = self._along(position, normalized_creepage, lateral_position)
        return sign * w * along.shear_traction

    def slip_rate(
        self,
        position: ArrayLike,
        normalized_creepage: ArrayLike,
        lateral_position: ArrayLike = 0.0,
    ) -> FloatArray:
        """Slip per rolled distance over zeta0, as `CarterGriffith.slip_rate`."""
        along, w, sign = self._along(position, normalized_creepage, lateral_position)
        return sign * w * along.slip_rate

    def slip(
        self,
        position: ArrayLike,
        normalized_creepage: ArrayLike,
        lateral_position: ArrayLike = 0.0,
    ) -> FloatArray:
        """Slip u since the stick boundary, over the weakening length; arguments broadcast.

        Infinite where friction has weakened to its last digit.
        """
        along, _, sign = self._along(position, normalized_creepage, lateral_position)
        return sign * along.slip

    def _state(self, x: float, w: float) -> tuple[float, float]:
        """Stick length and edge slip of the strip of relative half-width w, in its own units."""
        if abs(x) <= SMALLEST_X or w == 0.0:
            return (2.0, 0.0) if w > 0.0 else (0.0, 0.0)
        return find_state(
            min(abs(x), LARGEST_X) / w,
            k_hat=self.k_hat / w,
            static_to_kinetic=self.static_to_kinetic,
            weakening=self.weakening,
        )

    def _along(
        self, position: ArrayLike, normalized_creepage: ArrayLike, lateral_position: ArrayLike
    ) -> tuple[Along, FloatArray, FloatArray]:
        """Traction and slip in the units of each strip, its half-width, and the sign of x."""
        if self._limit is not None:
            raise ValueError(
                f"CohesiveZone.k_hat = {self.k_hat!r} is too small to resolve the weakening zone: "
                f"must be >= {SMALLEST_K_HAT[self.contact]}"
            )
        xi, x, w = places_at(self.contact, position, normalized_creepage, lateral_position)
        found = np.zeros((3, *x.shape))
        xi = np.clip(xi, -2.0, 2.0)  # where nothing is
        strips = set(zip(x.flat, w.flat, strict=True))
        for strip in (pair for pair in strips if abs(pair[0]) > SMALLEST_X and pair[1] > 0.0):
            here = (x == strip[0]) & (w == strip[1])
            found[:, here] = along_contact(
                xi[here] / strip[1],
                *self._state(*strip),
                k_hat=self.k_hat / strip[1],
                static_to_kinetic=self.static_to_kinetic,
                weakening=self.weakening,
            )
        return Along(*found), w, np.copysign(1.0, x)
