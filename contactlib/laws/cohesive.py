"""The cohesive-zone law: friction that weakens over a finite slip, without the paper's limit.

In the paper the weakening zone shrinks to a point with a singularity. Here the friction f(u) acts
over the zone's true length. This bounds the traction by f_s p and the force by f_s P, and gives the
correct tail of the falling branch. The equations are those of `laws.cohesive_zone`; an ellipse
consists of strips, as in `laws.strips`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray, Quantity
from contactlib.laws import cohesive_ellipse as ellipse
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.cohesive_line import SlipCurve
from contactlib.laws.cohesive_zone import (
    between_nodes,
    enough_nodes,
    sliding_creepage,
    solve_cohesive_zones,
    weakening_length,
)
from contactlib.laws.contact_law import ContactLaw, Peak, places_at, strips_at
from contactlib.laws.friction import EXPONENTIAL, Weakening
from contactlib.laws.law import Corner

# Below these the Carter-Griffith law differs by less than 1e-12 and 2e-9.
MIN_K_HAT = {"line": 1e-6, "elliptic": ellipse.MIN_K_HAT}
MIN_X, MAX_X = 1e-9, 1e12


def find_state(
    x: float, *, k_hat: float, static_to_kinetic: float, weakening: Weakening
) -> tuple[float, float]:
    """Stick length and edge slip at a creepage x > 0."""

    def beyond(stick: float, slipped: float, edge: float) -> float:
        zones = solve_cohesive_zones(
            *(np.array([v]) for v in (stick, slipped, edge)),
            k_hat=np.array([k_hat]),
            static_to_kinetic=static_to_kinetic,
            weakening=weakening,
        )
        return float(0.5 * slipped + edge + zones.release[0] - x)

    if x < sliding_creepage(k_hat, static_to_kinetic, weakening):
        slipped = brentq(lambda v: beyond(2.0 - v, v, 0.0), 1e-9 * x, 2.0, xtol=1e-14, rtol=1e-14)
        return 2.0 - float(slipped), 0.0
    edge = brentq(lambda v: beyond(0.0, 2.0, v), 0.0, x, xtol=1e-14, rtol=1e-14)
    return 0.0, float(edge)


class Along(NamedTuple):
    """Traction and slip along a contact; arrays of one shape."""

    shear_traction: FloatArray  # over f_d p0
    slip_rate: FloatArray  # per rolled distance, over zeta0
    slip: FloatArray  # over the weakening length


def along_contact(
    position: FloatArray,
    stick_length: float,
    edge_slip: float,
    *,
    k_hat: float,
    static_to_kinetic: float,
    weakening: Weakening,
) -> Along:
    """Traction and slip at places xi/a of a contact, (n,), the leading edge being +1."""
    state = (np.array([v]) for v in (stick_length, 2.0 - stick_length, edge_slip))
    zones = solve_cohesive_zones(
        *state,
        k_hat=np.array([k_hat]),
        static_to_kinetic=static_to_kinetic,
        weakening=weakening,
        nodes=2
        * enough_nodes(k_hat, static_to_kinetic, weakening),  # for interpolation between the nodes
    )
    y, h, weight = zones.distance[0], zones.intensity[0], zones.weight[0]
    inside = np.abs(position) <= 1.0
    behind = np.where(inside, 1.0 - stick_length - position, 0.0)  # the stick boundary
    slips = inside & (behind >= 0.0)
    to = np.sqrt(np.maximum(behind, 0.0))
    root = np.sqrt(stick_length + to**2)

    bracket = (zones.slip_rate[0] - edge_slip) / np.where(y > 0.0, _root(y, stick_length), 1.0)
    near, over_length = between_nodes(to / y[-1], np.stack([bracket, zones.slip[0]]))
    beyond = to > y[-1]
    far = np.where(beyond, to, 2.0 * y[-1])[:, np.newaxis]
    push = (2.0 / np.pi) * (weight * h / (far**2 - y**2)).sum(axis=1)
    slip_rate = np.where(slips, root * np.where(beyond, to * (1.0 + push), near) + edge_slip, 0.0)
    length = weakening_length(np.array(k_hat), static_to_kinetic)
    slip = np.where(beyond, np.inf, np.maximum(over_length, 0.0) / length)

    pressure = np.sqrt(np.maximum(1.0 - position**2, 0.0))
    left = np.where(slips & ~beyond, weakening.fraction(np.where(beyond, 0.0, slip)), 0.0)
    sliding = pressure * (1.0 + (static_to_kinetic - 1.0) * left)
    # Stick zone: the traction of full sliding less that of the stick zone.
    ahead = np.maximum(-behind, 0.0)[:, np.newaxis]
    tip = np.where(ahead > 0.0, np.sqrt(ahead), 1.0)
    steep = 2.0 * h[0] * np.arctan2(y[-1], tip[:, 0]) / tip[:, 0]
    pull = (steep + 2.0 * (weight * (h - h[0]) / (tip**2 + y**2)).sum(axis=1)) / np.pi
    gap = np.sqrt(np.maximum(1.0 - position, 0.0) * ahead[:, 0])
    traction = np.where(slips, sliding, pressure - gap * (1.0 - pull))
    return Along(np.where(inside, traction, 0.0), slip_rate, np.where(slips, slip, 0.0))


def _root(y: FloatArray, stick_length: float) -> FloatArray:
    return np.asarray(np.sqrt(stick_length + y * y))


@lru_cache(maxsize=64)  # not a cached property, whose lock would make threads wait
def _curve(k_hat: float, static_to_kinetic: float, weakening: Weakening) -> SlipCurve:
    return SlipCurve.solve(np.array([k_hat]), static_to_kinetic, weakening)[0]


@dataclass(frozen=True, kw_only=True)
class CohesiveZone(ContactLaw):
    """Traction ratio q = Q/(f_d P) against normalized creepage x = zeta/zeta0.

    Parameters
    ----------
    k_hat : float
        Normalized stress-intensity factor of Eq. (17), from 0 to 2. It sets the weakening length,
        Delta R/(f_d a**2) = pi k_hat**2/(2 (r - 1)) with r = `static_to_kinetic`.
    static_to_kinetic : float
        r = f_s/f_d, above 1 and at most 30.
    contact : {"line", "elliptic"}
        Shape of the contact, as in `CarterGriffith`.
    weakening : Weakening
        Shape of f(u), such as `Friction.weakening`. Default: Rabinowicz's exponential.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    ConvergenceError
        On use, if a state has no solution that the iteration finds.

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
        """The law of a vanishing zone, if `k_hat` is so small that it applies."""
        if self.k_hat >= MIN_K_HAT[self.contact]:
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
        ratio = slope * np.minimum(x.ravel(), 1.0)  # right to nine digits up to MIN_X
        rolling = np.flatnonzero(x > MIN_X)
        at = np.minimum(x.flat[rolling], MAX_X)  # there q is 1 to the last digit
        if line:
            state = self._curve.at(at)
            ratio[rolling], slope[rolling] = state.traction_ratio, state.slope
        else:
            ratio[rolling], slope[rolling] = ellipse.cohesive_ellipse(
                at, self.k_hat, self.static_to_kinetic, self.weakening
            )
        return ratio.reshape(x.shape), slope.reshape(x.shape)

    @property
    def sliding_creepage(self) -> float:
        """Creepage x at which full slip begins."""
        if self._limit is not None:
            return np.inf
        if self.contact == "elliptic":
            return sliding_creepage(self.k_hat, self.static_to_kinetic, self.weakening)
        return self._curve.sliding_creepage

    @property
    def tail_decay(self) -> float:
        """Power of 1/x at which q tends to 1; pressure and slip at the leading edge set it."""
        return 1.5

    @property
    def carter_at_zero(self) -> bool:
        """Whether q equals that of the Carter-Griffith line contact at ``k_hat=0``."""
        return self.contact == "line"

    @property
    def corner(self) -> Corner | None:
        """End of stick, where the second derivative grows without bound, like a logarithm.

        In an ellipse it is that of the middle strip, softened by half a power by its neighbours.
        """
        if self._limit is not None:
            return None
        return Corner(self.sliding_creepage, 2.0 if self.contact == "line" else 2.5)

    @cached_property
    def peak(self) -> Peak:
        """Maximum of the law."""
        if self._limit is not None:
            return self._limit.peak
        return self._peak_beyond(0.1, 2.0 + 4.0 * self.static_to_kinetic)

    def stick_boundary(
        self, normalized_creepage: ArrayLike, lateral_position: ArrayLike = 0.0
    ) -> FloatArray:
        """Stick boundary c/a, as `CarterGriffith.stick_boundary`; the leading edge in full slip."""
        if self._limit is not None:
            return self._limit.stick_boundary(normalized_creepage, lateral_position)
        x, w = strips_at(self.contact, normalized_creepage, lateral_position)
        return np.asarray(w * (1.0 - self._stick_length(x, w)))

    def _stick_length(self, x: FloatArray, w: FloatArray) -> FloatArray:
        """Stick length of strips of relative half-widths w, in their units."""
        if self.contact == "line":
            at = np.clip(np.abs(x).ravel(), MIN_X, MAX_X)
            stick = self._curve.at(at).stick_length.reshape(x.shape)
            return np.where(np.abs(x) <= MIN_X, 2.0, stick)  # right to twelve digits
        stick = np.array([self._state(*pair)[0] for pair in zip(x.flat, w.flat, strict=True)])
        return stick.reshape(x.shape)

    def shear_traction(
        self,
        position: ArrayLike,
        normalized_creepage: ArrayLike,
        lateral_position: ArrayLike = 0.0,
    ) -> FloatArray:
        """Surface shear traction over f_d p0, as `CarterGriffith.shear_traction`, but bounded."""
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

        It is infinite where friction has weakened to its last digit.
        """
        along, _, sign = self._along(position, normalized_creepage, lateral_position)
        return sign * along.slip

    def _state(self, x: float, w: float) -> tuple[float, float]:
        """Stick length and edge slip of the strip of relative half-width w, in its units."""
        if abs(x) <= MIN_X or w == 0.0:
            return (2.0, 0.0) if w > 0.0 else (0.0, 0.0)
        return find_state(
            min(abs(x), MAX_X) / w,
            k_hat=self.k_hat / w,
            static_to_kinetic=self.static_to_kinetic,
            weakening=self.weakening,
        )

    def _along(
        self, position: ArrayLike, normalized_creepage: ArrayLike, lateral_position: ArrayLike
    ) -> tuple[Along, FloatArray, FloatArray]:
        """Traction and slip in the units of each strip, the strip's half-width, the sign of x."""
        if self._limit is not None:
            raise ValueError(
                f"CohesiveZone.k_hat = {self.k_hat!r} is too small to resolve the weakening zone: "
                f"must be >= {MIN_K_HAT[self.contact]}"
            )
        xi, x, w = places_at(self.contact, position, normalized_creepage, lateral_position)
        along = np.zeros((3, *x.shape))
        xi = np.clip(xi, -2.0, 2.0)  # +-2 is outside the contact
        strips = set(zip(x.flat, w.flat, strict=True))
        for strip in (pair for pair in strips if abs(pair[0]) > MIN_X and pair[1] > 0.0):
            here = (x == strip[0]) & (w == strip[1])
            along[:, here] = self._along_strip(xi[here] / strip[1], *strip)
        return Along(*along), w, np.copysign(1.0, x)

    def _along_strip(self, position: FloatArray, x: float, w: float) -> Along:
        """Traction and slip at places of a strip, in its units."""
        return along_contact(
            position,
            *self._state(x, w),
            k_hat=self.k_hat / w,
            static_to_kinetic=self.static_to_kinetic,
            weakening=self.weakening,
        )
