"""The Carter-Griffith law of line and elliptic contacts, solved to rounding.

Source: Ciavarella, Romano & Barber, "Rolling of a cylinder with slip-dependent friction: the
Carter solution revisited". With m = (1 + c/a)/2 and t = (m/(1 - m))**(1/4), their Eqs. (18) and
(19) become, for s = 1 - m = 1/(1 + t**4) and y = k_hat t,

    x = m + y,    q = m (1 + s) + 2 y s,    dq/dx = 2 s (1 - 4 m y/(y + 4 m s)),

sums of positive terms for x > 0 (but for the sign change of dq/dx at the peak), so every digit
survives from x = 1e-12 to the far tail. x grows strictly with t: one root, found in ln(t).
An ellipse is made of such line contacts, see `contactlib.laws.strips`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.laws.peak import Peak
from contactlib.laws.strips import SMALLEST_K_HAT, carter_ellipse, griffith_ellipse
from contactlib.parameters import FINITE, FloatArray, Limits, Parameters, Quantity, checked

LATERAL = Limits(at_least=-1.0, at_most=1.0)


class _Split(NamedTuple):
    """Stick measure m, its complement s = 1 - m, and y = k_hat t, at x = m + y."""

    m: FloatArray
    s: FloatArray
    y: FloatArray


def _split(t: FloatArray, k_hat: float | FloatArray) -> _Split:
    with np.errstate(over="ignore", divide="ignore"):
        small = t < 1.0
        power = np.where(small, t, 1.0 / t) ** 4
        m = np.where(small, power, 1.0) / (1.0 + power)
        s = np.where(small, 1.0, power) / (1.0 + power)
    return _Split(m, s, k_hat * t)


def _solve_split(x: FloatArray, k_hat: float | FloatArray) -> _Split:
    """Solve x = m + y for x >= 0: Newton's method in ln(t), kept inside a bracket.

    `k_hat` is zero, or above zero with the shape of `x`.
    """
    if (
        np.ndim(k_hat) == 0 and k_hat == 0.0
    ):  # Carter: stick until x = 1, then y = x - 1 is pure sliding
        m = np.minimum(x, 1.0)
        return _Split(m, 1.0 - m, x - m)
    # x is a sum of m and y, so at the root neither exceeds x and one is at least x/2.
    with np.errstate(divide="ignore"):
        carter = np.where(x < 1.0, x / np.where(x < 1.0, 1.0 - x, 1.0), np.inf) ** 0.25
        half = np.where(x < 2.0, x / np.where(x < 2.0, 2.0 - x, 1.0), np.inf) ** 0.25
        upper = np.log(np.minimum(carter, x / k_hat))
        lower = np.log(np.maximum(np.minimum(half, x / (2.0 * k_hat)), (x - 1.0) / k_hat))
    zero = x == 0.0
    lower, upper = np.where(zero, 0.0, lower), np.where(zero, 0.0, upper)
    log_t = 0.5 * (lower + upper)
    for _ in range(200):
        m, s, y = _split(np.exp(log_t), k_hat)
        residual = (m - x) + y
        lower = np.where(residual <= 0.0, log_t, lower)
        upper = np.where(residual >= 0.0, log_t, upper)
        newton = log_t - residual / (4.0 * m * s + y)
        # A converged step may land on a bracket end: that is still inside.
        inside = (newton >= lower) & (newton <= upper)
        step = np.where(inside, newton, 0.5 * (lower + upper)) - log_t
        log_t = log_t + step
        # Rounding is reached in ln(t), or in x where x hardly depends on t.
        small = np.abs(step) <= 4e-16 * np.maximum(1.0, np.abs(log_t))
        if np.all(zero | small | (np.abs(residual) <= 4e-16 * x)):
            break
    return _split(np.where(zero, 0.0, np.exp(log_t)), k_hat)


@dataclass(frozen=True, kw_only=True)
class CarterGriffith(Parameters):
    """Traction ratio q = Q/(f_d P) against normalized creepage x = zeta/zeta0.

    The limit of slip weakening over a vanishing process zone: a square-root singularity of the
    traction at the stick boundary takes the place of the weakening law.

    Parameters
    ----------
    k_hat : float
        Largest normalized stress-intensity factor, Eq. (17) [1], from 0 to 2. Zero is Carter's
        law for Coulomb friction.
    contact : {"line", "elliptic"}
        Shape of the contact. An ellipse follows strip theory, which is meant for contacts longer
        across the rolling direction than along it; its axes do not enter.

    Raises
    ------
    ValueError
        If `k_hat` is out of range or `contact` is not a known shape.

    Examples
    --------
    >>> law = CarterGriffith(k_hat=1.0)
    >>> law.peak
    Peak(normalized_creepage=1.5, traction_ratio=1.75)
    >>> law.slope(0.0).item()
    2.0
    """

    k_hat: Annotated[float, Quantity("1", at_least=0.0, at_most=2.0)]
    contact: Literal["line", "elliptic"] = "line"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.contact not in ("line", "elliptic"):
            raise ValueError(
                f"CarterGriffith.contact = {self.contact!r} must be 'line' or 'elliptic'"
            )

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio q at x, for any shape of finite x; odd in x. Eqs. (18), (19), (23), (24).

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        return np.copysign(self._evaluate(np.abs(x))[0], x)

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Slope dq/dx at x, for any shape of finite x; even in x.

        At x = 0 it is 2 for the line and 3 pi/4 for the ellipse, whatever `k_hat` is.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        return self._evaluate(np.abs(x))[1]

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Traction ratio and slope at x >= 0."""
        if self.contact == "line":
            return _line(_solve_split(x, self.k_hat))
        if self.k_hat < SMALLEST_K_HAT:
            return carter_ellipse(x)
        ratio, slope = np.zeros(x.size), np.full(x.size, 0.75 * np.pi)
        rolling = np.flatnonzero(x)
        for part in np.array_split(rolling, 1 + rolling.size // 4096):  # to bound the memory
            at = x.flat[part]
            middle = _solve_split(at, self.k_hat)
            ratio[part], slope[part] = griffith_ellipse(at, self.k_hat, middle)
        return ratio.reshape(x.shape), slope.reshape(x.shape)

    def stick_boundary(
        self, normalized_creepage: ArrayLike, lateral_position: ArrayLike = 0.0
    ) -> FloatArray:
        """Stick boundary c/a: the surface sticks for c < xi < a1, the leading edge there.

        Parameters
        ----------
        normalized_creepage : array_like
            x [1].
        lateral_position : array_like, optional
            eta = y/b [1], from -1 to 1; the half-width there is a1 = a sqrt(1 - eta**2). A line
            contact is the same everywhere.

        Returns
        -------
        ndarray
            From -a1/a to a1/a; arguments broadcast.
        """
        x, w = self._strips(normalized_creepage, lateral_position)
        m, s = self._stick(x, w)
        return np.asarray(w * (m - s))

    def shear_traction(
        self,
        position: ArrayLike,
        normalized_creepage: ArrayLike,
        lateral_position: ArrayLike = 0.0,
    ) -> FloatArray:
        """Surface shear traction q(xi, eta)/(f_d p0), Eq. (16); arguments broadcast.

        Parameters
        ----------
        position : array_like
            xi/a [1], from -1 to 1, the leading edge being +1.
        normalized_creepage : array_like
            x [1].
        lateral_position : array_like, optional
            eta = y/b [1], from -1 to 1, as in `stick_boundary`.

        Returns
        -------
        ndarray
            Zero outside the contact, infinite at the stick boundary if `k_hat` > 0.
        """
        x, w = self._strips(normalized_creepage, lateral_position)
        xi, x, w = np.broadcast_arrays(checked("position", position, FINITE), x, w)
        m, s = self._stick(x, w)
        lead = np.maximum(w - xi, 0.0)
        behind = np.maximum(xi - w * (m - s), 0.0)
        sliding = np.sqrt(lead * np.maximum(w + xi, 0.0))
        stick = (xi >= w * (m - s)) & (lead > 0.0) & (xi >= -w)
        with np.errstate(divide="ignore", invalid="ignore"):
            intensity = self.k_hat * (4.0 * m * s) ** 0.25  # Eq. (17): 1 - (c/a1)**2 = 4 m s
            singular = intensity / np.sqrt(2.0 * s) * np.sqrt(lead / behind)
        traction = sliding - np.where(stick, np.sqrt(lead * behind), 0.0)
        if self.k_hat > 0.0:
            traction = traction + np.where(stick & (s > 0.0), singular, 0.0)
        return np.asarray(np.copysign(1.0, x) * traction)  # Eq. (16)

    def _strips(
        self, normalized_creepage: ArrayLike, lateral_position: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Creepage and relative half-width w of the strips, broadcast."""
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        eta = checked("lateral_position", lateral_position, LATERAL)
        w = np.sqrt((1.0 - eta) * (1.0 + eta)) if self.contact == "elliptic" else np.ones_like(eta)
        x, w = np.broadcast_arrays(x, w)
        return x, w

    def _stick(self, x: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stick measure m of the strips and its complement; a strip of no width only slips."""
        m, s = np.ones(x.shape), np.zeros(x.shape)
        wide = w > 0.0
        k_hat = self.k_hat / w[wide] if self.k_hat > 0.0 else 0.0  # Eq. (22)
        m[wide], s[wide], _ = _solve_split(np.abs(x[wide]) / w[wide], k_hat)
        return m, s

    @cached_property
    def peak(self) -> Peak:
        """Maximum of the law.

        On the line it is the root of k_hat (1 + t**4) (3 t**4 - 1) = 4 t**3; on the ellipse the
        slope's change of sign. For ``k_hat=0`` it is the first point of Carter's plateau.
        """
        k = self.k_hat
        if k == 0.0:
            return Peak(1.0, 1.0)
        if self.contact == "elliptic":
            # Wide strips still rise where narrow ones fall: the peak is left of the line's.
            top = CarterGriffith(k_hat=k).peak.normalized_creepage
            x = float(brentq(lambda v: float(self.slope(v)), 0.25, top, xtol=1e-300, rtol=1e-15))
            return Peak(x, float(self.traction_ratio(x)))

        def condition(v: float) -> float:  # in v = 1/t, where the root is in (0, 3**(1/4))
            return k * (1.0 + v**4) * (3.0 - v**4) - 4.0 * v**5

        v = float(brentq(condition, 0.0, 3.0**0.25, xtol=1e-300, rtol=1e-15))
        split = _split(np.array(1.0 / v), k)
        return Peak(float(split.m + split.y), float(_line(split)[0]))


def _line(split: _Split) -> tuple[FloatArray, FloatArray]:
    """Traction ratio and slope of a line contact."""
    m, s, y = split
    stretch = y + 4.0 * m * s  # dx/d(ln t)
    share = np.divide(m * y, stretch, out=np.zeros_like(m), where=stretch > 0.0)
    ratio = m * (1.0 + s) + 2.0 * (y * s)  # Eq. (18)
    return np.asarray(ratio), np.asarray(2.0 * s * (1.0 - 4.0 * share))
