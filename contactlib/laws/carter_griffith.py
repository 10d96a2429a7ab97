"""The Carter-Griffith law of line and elliptic contacts, solved to rounding.

Source: Ciavarella, Romano & Barber, "Rolling of a cylinder with slip-dependent friction: the
Carter solution revisited". `contactlib.laws.strips` solves the line contact and integrates
over an ellipse.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray
from contactlib.laws import layer
from contactlib.laws.contact_law import LAYER_RATIO, ContactLaw, Peak, places_at, strips_at
from contactlib.laws.strips import (
    MIN_ELLIPSE_K_HAT,
    MIN_LINE_K_HAT,
    carter_ellipse,
    griffith_ellipse,
    line_values,
    solve_split,
    split_at,
)


@dataclass(frozen=True, kw_only=True)
class CarterGriffith(ContactLaw):
    """Traction ratio q = Q/(f_d P) against normalized creepage x = zeta/zeta0.

    The law is the limit of slip weakening with a vanishing process zone: a square-root singularity
    of the traction at the stick boundary replaces the weakening law.

    Parameters
    ----------
    k_hat : float
        Largest normalized stress-intensity factor, Eq. (17) [1], from 0 to 2. Zero is Carter's
        law for Coulomb friction.
    contact : {"line", "elliptic"}
        Shape of the contact. The ellipse is a sum of uncoupled strips, so the ratio of its axes has
        no effect; a `ForceElement` adds the corrections for a half-space.
    layer_ratio : float, optional
        lam = L E*/(2 a) [1], from 0 to 1e7, of a thin elastic layer between the bodies, whose shear
        compliance L [m/Pa] is its thickness over its shear modulus; see `laws.layer`. It lowers the
        initial slope, bounds the traction and rounds the peak. Default: no layer.

    Raises
    ------
    ValueError
        If `k_hat` or `layer_ratio` is out of range or `contact` is not a known shape.

    Examples
    --------
    >>> law = CarterGriffith(k_hat=1.0)
    >>> law.peak
    Peak(normalized_creepage=1.5, traction_ratio=1.75)
    >>> law.slope(0.0).item()
    2.0
    >>> CarterGriffith(k_hat=1.0, layer_ratio=1.0).slope(0.0).round(6).item()
    0.773647
    """

    layer_ratio: Annotated[float, LAYER_RATIO] = 0.0

    @property
    def _k_hat(self) -> float:
        """`k_hat`, or zero where the law does not differ in any digit."""
        return self.k_hat if self.k_hat >= MIN_LINE_K_HAT else 0.0

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Traction ratio and slope at x >= 0."""
        if self.layer_ratio > 0.0 and self.contact == "elliptic":
            return layer.ellipse_with_layer(x, self._k_hat, self.layer_ratio)
        if self.layer_ratio > 0.0:
            return layer.line_with_layer(x, self._k_hat, self.layer_ratio)
        if self.contact == "line":
            return line_values(solve_split(x, self._k_hat))
        if self.k_hat < MIN_ELLIPSE_K_HAT:
            return carter_ellipse(x)
        ratio, slope = np.zeros(x.size), np.full(x.size, 0.75 * np.pi)
        rolling = np.flatnonzero(x)
        for part in np.array_split(rolling, 1 + rolling.size // 4096):  # to bound the memory
            at = x.flat[part]
            middle = solve_split(at, self.k_hat)
            ratio[part], slope[part] = griffith_ellipse(at, self.k_hat, middle)
        return ratio.reshape(x.shape), slope.reshape(x.shape)

    def stick_boundary(
        self, normalized_creepage: ArrayLike, lateral_position: ArrayLike = 0.0
    ) -> FloatArray:
        """Stick boundary c/a: the surface sticks for c < xi < a1, where a1 is the leading edge.

        Parameters
        ----------
        normalized_creepage : array_like
            x [1].
        lateral_position : array_like, optional
            eta = y/b [1], from -1 to 1, where the half-width is a1 = a sqrt(1 - eta**2). A line
            contact does not depend on it.

        Returns
        -------
        ndarray
            From -a1/a to a1/a; arguments broadcast.
        """
        x, w = strips_at(self.contact, normalized_creepage, lateral_position)
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
            Zero outside the contact. At the stick boundary it is infinite if `k_hat` > 0; with a
            layer it jumps there by k_hat sqrt(pi p/lam).
        """
        xi, x, w = places_at(self.contact, position, normalized_creepage, lateral_position)
        if self.layer_ratio > 0.0:
            return self._with_layer(xi, x, w, layer.line_traction)
        m, s = self._stick(x, w)
        lead = np.maximum(w - xi, 0.0)
        behind = np.maximum(xi - w * (m - s), 0.0)
        sliding = np.sqrt(lead * np.maximum(w + xi, 0.0))
        stick = (xi >= w * (m - s)) & (lead > 0.0) & (xi >= -w)
        with np.errstate(divide="ignore", invalid="ignore"):
            intensity = self._k_hat * (4.0 * m * s) ** 0.25  # Eq. (17): 1 - (c/a1)**2 = 4 m s
            singular = intensity / np.sqrt(2.0 * s) * np.sqrt(lead) / np.sqrt(behind)
        traction = sliding - np.where(stick, np.sqrt(lead * behind), 0.0)
        if self._k_hat > 0.0:
            traction = traction + np.where(stick & (s > 0.0), singular, 0.0)
        return np.asarray(np.copysign(1.0, x) * traction)  # Eq. (16)

    def slip_rate(
        self,
        position: ArrayLike,
        normalized_creepage: ArrayLike,
        lateral_position: ArrayLike = 0.0,
    ) -> FloatArray:
        """Slip per rolled distance over zeta0; arguments broadcast, as in `shear_traction`.

        It is the creepage less the surface strain, Eq. (9) with the traction of Eq. (16).

        Returns
        -------
        ndarray
            Zero where the surface sticks and outside the contact, infinite behind the stick
            boundary if `k_hat` > 0; the sign is that of x. A layer slips in addition by its
            shear at the stick boundary, at once.
        """
        xi, x, w = places_at(self.contact, position, normalized_creepage, lateral_position)
        if self.layer_ratio > 0.0:
            return self._with_layer(xi, x, w, layer.line_slip_rate)
        m, s = self._stick(x, w)
        lead = np.maximum(w - xi, 0.0)
        behind = np.where(xi >= -w, np.maximum(w * (m - s) - xi, 0.0), 0.0)
        rate = np.sqrt(lead * behind)
        if self._k_hat > 0.0:
            with np.errstate(divide="ignore", invalid="ignore"):
                intensity = self._k_hat * (4.0 * m * s) ** 0.25  # Eq. (17)
                singular = intensity / np.sqrt(2.0 * s) * np.sqrt(lead) / np.sqrt(behind)
            rate = rate + np.where((behind > 0.0) & (s > 0.0), singular, 0.0)
        else:
            # Beyond saturation the whole strip slips, by the excess creepage in addition.
            rate = rate + np.where(np.abs(xi) <= w, np.maximum(np.abs(x) - w, 0.0), 0.0)
        return np.asarray(np.copysign(1.0, x) * rate)

    def _with_layer(
        self,
        xi: FloatArray,
        x: FloatArray,
        w: FloatArray,
        of_line: Callable[[FloatArray, layer.Line], FloatArray],
    ) -> FloatArray:
        """What `of_line` gives at positions of strips with a layer; each strip is solved once."""
        values = np.zeros(xi.shape)
        for size, width in set(zip(np.abs(x).ravel().tolist(), w.ravel().tolist(), strict=True)):
            here = (np.abs(x) == size) & (w == width) & (np.abs(xi) <= width)
            if size > 0.0 and width > 0.0 and here.any():
                state = layer.line_state(
                    size / width, self._k_hat / width, self.layer_ratio / width
                )
                values[here] = width * of_line(xi[here] / width, state)
        return np.asarray(np.copysign(1.0, x) * values)

    def _stick(self, x: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stick measure m of the strips and 1 - m; a strip of zero width only slips."""
        m, s = np.ones(x.shape), np.zeros(x.shape)
        wide = w > 0.0
        k_hat = self._k_hat / w[wide] if self._k_hat > 0.0 else 0.0  # Eq. (22)
        with np.errstate(over="ignore"):  # infinite creepage means full slip
            at = np.abs(x[wide]) / w[wide]
        if self.layer_ratio > 0.0:
            log_t = layer.solve_layer(at, k_hat, self.layer_ratio / w[wide])
            m[wide], s[wide], _ = split_at(np.exp(log_t), 0.0)
        else:
            m[wide], s[wide], _ = solve_split(at, k_hat)
        return m, s

    @cached_property
    def peak(self) -> Peak:
        """Maximum of the law.

        For the line it is the root of k_hat (1 + t**4) (3 t**4 - 1) = 4 t**3, for the ellipse or
        with a layer the zero of the slope. For ``k_hat=0`` it is the first point of Carter's
        plateau, which a layer moves to infinity.
        """
        k = self._k_hat
        if k == 0.0:
            return Peak(1.0 if self.layer_ratio == 0.0 else math.inf, 1.0)
        if self.layer_ratio > 0.0:
            # Far out, q - 1 is positive: it falls like x**-2.5, and what Coulomb friction lacks
            # falls like x**-3. So the slope is negative there.
            return self._peak_beyond(0.25, 2.0)
        if self.contact == "elliptic":
            # Wide strips still rise where narrow ones fall: the peak is left of the line's.
            return self._peak_beyond(0.25, CarterGriffith(k_hat=k).peak.normalized_creepage)

        def condition(v: float) -> float:  # in v = 1/t, where the root is in (0, 3**(1/4))
            return k * (1.0 + v**4) * (3.0 - v**4) - 4.0 * v**5

        v = float(brentq(condition, 0.0, 3.0**0.25, xtol=1e-300, rtol=1e-15))
        split = split_at(np.array(1.0 / v), k)
        return Peak(float(split.m + split.y), float(line_values(split)[0]))
