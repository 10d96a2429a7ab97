"""Creep force with thermal softening of friction: closed form and local solution."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.quantities import (
    FINITE,
    NOT_NEGATIVE,
    FloatArray,
    Limits,
    Parameters,
    checked,
    checked_number,
    common_shape,
    derived,
)
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.friction import Friction
from contactlib.laws.heat import CREEPAGE, INNER, MEANS, SPEED, ContactHeat, Softening
from contactlib.laws.scales import SLOPE_REDUCTION, k_hat, saturation_creepage
from contactlib.laws.thermal_zone import NODES, ThermalZone, solve_thermal_zone

STRIPS = 16  # of half an ellipse
HOTTEST = Limits(at_least=0.0, at_most=1e4)  # ratio of temperatures that is resolved
NO_SLIP = 1e-100  # of x
MIN_FRICTION = 1e-3  # of friction, where the surfaces meet
K_HATS = CarterGriffith.quantities()["k_hat"]


def friction_factor(
    normalized_creepage: ArrayLike,
    heat_number: ArrayLike,
    *,
    k_hat: ArrayLike = 0.0,
    contact: str = "line",
) -> FloatArray:
    """Fraction g of friction that thermal softening leaves, by the kernel's closed form.

    It applies to friction f0 (1 - T/T_m). The heat number n is V zeta0/w_T with the softening speed
    w_T, the slip speed that would warm the contact by T_m at constant friction f0.
    ``fmu/kernel/heat.h`` contains the formula and its derivation.

    Parameters
    ----------
    normalized_creepage : array_like
        x = zeta/zeta0 [1], zeta0 being that of cold friction.
    heat_number : array_like
        n [1], not negative.
    k_hat : array_like, optional
        k_hat of cold friction [1]. Default: 0.
    contact : {"line", "elliptic"}
        Shape of the contact.

    Returns
    -------
    ndarray
        g [1], to be used as q = g q_cold(x/g), and k_hat/sqrt(g) for k_hat.

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> friction_factor([0.0, 10.0, 1000.0], 0.02).round(4).tolist()
    [1.0, 0.832, 0.0424]
    """
    if contact not in MEANS:
        raise ValueError(f"contact = {contact!r} must be 'line' or 'elliptic'")
    x = np.abs(checked("normalized_creepage", normalized_creepage, FINITE))
    number = checked("heat_number", heat_number, NOT_NEGATIVE)
    k_hats = checked("k_hat", k_hat, NOT_NEGATIVE)
    common_shape({"normalized_creepage": x, "heat_number": number, "k_hat": k_hats})
    # Beyond, no friction is left.
    x, number = np.minimum(x, 1e20), np.minimum(number, 1e20)
    return kernel.thermal_softening(x, number, k_hats, elliptic=contact == "elliptic")


class ThermalStrip(NamedTuple):
    """Result of `ThermalContact.strip`; arrays (n,)."""

    position: FloatArray
    temperature: FloatArray
    friction_coefficient: FloatArray
    shear_traction: FloatArray
    slip_speed: FloatArray
    heat_flux: FloatArray


@dataclass(frozen=True, kw_only=True)
class ThermalContact(Parameters):
    """Creep force of a contact whose friction falls with its flash temperature.

    Both friction coefficients fall alike. Slip weakening follows the Carter-Griffith law.

    Parameters
    ----------
    heat : ContactHeat
        The contact and its thermal model.
    friction : Friction
        Friction at ambient temperature. It must not fall with slip speed.
    softening : Softening
        Fall of friction with temperature.
    slope_reduction : float, optional
        As in `ForceElement` [1]. Default: 1.

    Raises
    ------
    ValueError
        If a value is out of range.

    Notes
    -----
    `traction_coefficient` is a closed form, `local_traction_coefficient` solves temperature and
    traction along the contact. For linear softening and heat numbers V zeta0/w_T up to 0.2 they
    differ by less than 0.004 of f0 for k_hat 0, and up to 0.025 for k_hat 0.3.

    Examples
    --------
    >>> from contactlib.laws.hertz import LineContact
    >>> contact = LineContact.from_semi_width(
    ...     semi_width=6e-3, radius=0.5, contact_modulus=115.4e9, normal_load=100e3)
    >>> hot = ThermalContact(
    ...     heat=ContactHeat(contact=contact),
    ...     friction=Friction(static=0.3, kinetic=0.3, weakening_length=0.0),
    ...     softening=Softening.linear(800.0))
    >>> hot.traction_coefficient([0.01, 0.1, 0.5], speed=20.0).round(4).tolist()
    [0.2918, 0.2313, 0.1232]
    >>> hot.local_traction_coefficient([0.01, 0.1, 0.5], speed=20.0).round(4).tolist()
    [0.2918, 0.2314, 0.1231]
    """

    heat: ContactHeat
    friction: Friction
    softening: Softening
    slope_reduction: Annotated[float, SLOPE_REDUCTION] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.friction.falls_with_slip_speed:
            raise ValueError("ThermalContact.friction must not fall with slip speed by itself")
        if self.k_hat > K_HATS.at_most:
            raise ValueError(
                f"ThermalContact.k_hat = {self.k_hat!r} is out of range: must be {K_HATS}"
            )

    @cached_property
    def k_hat(self) -> float:
        """k_hat at ambient temperature [1]."""
        return k_hat(self.heat.contact, self.friction)

    @cached_property
    def saturation_creepage(self) -> float:
        """zeta0 at ambient temperature [1]."""
        return saturation_creepage(
            self.heat.contact, self.friction, slope_reduction=self.slope_reduction
        )

    def _entry(self, creepage: ArrayLike, speed: ArrayLike) -> tuple[FloatArray, ...]:
        """x, temperature and F where the surfaces meet, and mean rise over x [K], broadcast."""
        zeta = checked("creepage", creepage, CREEPAGE)
        enters = self.heat.entry_temperature(zeta, speed)
        left = self.softening.fraction(enters)
        if not np.all(left >= MIN_FRICTION):
            raise ValueError(
                f"friction where the surfaces meet must be >= {MIN_FRICTION} of that at ambient "
                f"temperature; given wheel_temperature = {self.heat.wheel_temperature!r} and "
                f"rail_temperature = {self.heat.rail_temperature!r}"
            )
        zeta0 = self.saturation_creepage * left
        rise = self.friction.kinetic * left * zeta0 * self.heat.rise_per_creepage(zeta, speed)
        return zeta / zeta0, enters, left, rise

    def _balance(self, creepage: ArrayLike, speed: ArrayLike) -> tuple[FloatArray, ...]:
        """`_entry`, the closed form's g and its mean temperature above the entry's [K].

        For softening that is not linear, T_m is the secant's through the mean temperature.
        """
        x, enters, left, rise = self._entry(creepage, speed)
        k_hats = self.k_hat / np.sqrt(left)
        low, high = np.zeros(left.shape), rise * np.abs(x)
        for _ in range(60):
            mean = 0.5 * (low + high)
            share = self.softening.fraction(enters + mean) / left
            number = rise * (1.0 - share) / np.where(mean > 0.0, mean, 1.0)
            found = friction_factor(x, number, k_hat=k_hats, contact=self.heat.shape)
            colder = share > found
            low, high = np.where(colder, mean, low), np.where(colder, high, mean)
        return x, enters, left, share, mean

    def mean_temperature(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Temperature above ambient that gives the contact its friction, in closed form [K].

        Arguments and errors are those of `traction_coefficient`.
        """
        _, enters, _, _, mean = self._balance(creepage, speed)
        return np.asarray(enters + mean)

    def traction_coefficient(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Q/P by the closed form of `friction_factor` [1]; arguments broadcast.

        Parameters
        ----------
        creepage, speed : array_like
            As in `ContactHeat.mean_rise`.

        Raises
        ------
        ValueError
            If a number is out of range, or no friction is left where the surfaces meet.
        """
        x, _, left, g, _ = self._balance(creepage, speed)
        law = CarterGriffith(k_hat=0.0, contact=self.heat.shape)
        if self.k_hat == 0.0:
            ratio = law.traction_ratio(x / g)
        else:
            k_hats = np.minimum(self.k_hat / np.sqrt(left * g), K_HATS.at_most)
            pairs = zip(k_hats.flat, (x / g).flat, strict=True)
            values = [float(replace(law, k_hat=float(k)).traction_ratio(v)) for k, v in pairs]
            ratio = np.reshape(values, x.shape)
        return np.asarray(self.friction.kinetic * left * g * ratio)

    def _zone(
        self, creepage: float, speed: float, w: float, nodes: int = NODES
    ) -> tuple[ThermalZone | None, float, float]:
        """Strip of relative half-width w; temperature and F where it begins."""
        x, enters, left, rise = (float(v) for v in self._entry(creepage, speed))
        if abs(x) < NO_SLIP:
            return None, enters, left
        derived(
            "the rise of temperature in full slip over the highest temperature of the softening",
            lambda: rise * abs(x) / self.softening.temperature[-1],
            {"creepage": creepage, "speed": speed},
            HOTTEST,
        )

        def fall(warmer: FloatArray) -> tuple[FloatArray, FloatArray]:
            at = enters + warmer
            return self.softening.fraction(at) / left, self.softening.slope(at) / left

        zone = solve_thermal_zone(
            abs(x) / w,
            rise=rise * MEANS["line"] / MEANS[self.heat.shape] * w**2.5,
            fall=fall,
            k_hat=self.k_hat / (np.sqrt(left) * w),
            nodes=nodes,
        )
        return zone, enters, left

    def strip(
        self, creepage: float, speed: float, *, lateral_position: float = 0.0
    ) -> ThermalStrip:
        """Temperature and traction along a strip, by the local solution.

        Parameters
        ----------
        creepage, speed : float
            As in `ContactHeat.mean_rise`; creepage not 0.
        lateral_position : float, optional
            y/b [1], between -1 and 1; a line contact does not depend on it.

        Returns
        -------
        ThermalStrip
            From the leading edge to the trailing edge: ``position`` x/a [1], ``temperature`` above
            ambient [K], ``friction_coefficient`` [1], ``shear_traction`` [Pa], ``slip_speed``
            [m/s], and ``heat_flux`` into both bodies [W/m^2].

        Raises
        ------
        ValueError
            If a number is out of range.
        ConvergenceError
            If the iteration finds no solution.
        """
        creepage = checked_number("creepage", creepage, CREEPAGE)
        speed = checked_number("speed", speed, SPEED)
        eta = checked_number("lateral_position", lateral_position, INNER)
        w = float(np.sqrt((1.0 - eta) * (1.0 + eta))) if self.heat.shape == "elliptic" else 1.0
        zone, enters, left = self._zone(creepage, speed, w, 3 * NODES)  # for curves
        if zone is None:
            raise ValueError(f"creepage = {creepage!r} is too close to 0: something must slip")
        c, xi = zone.stick_boundary, zone.position
        ahead = c + (1.0 - c) * np.sin(np.linspace(0.5 * np.pi, 0.01, 60 if c < 1.0 else 0)) ** 2

        def along(sticking: float, sliding: FloatArray) -> FloatArray:
            return np.append(np.full_like(ahead, sticking), sliding)

        friction = np.copysign(self.friction.kinetic * left, creepage)
        sliding = np.sqrt((1.0 - xi) * (1.0 + xi)) * zone.fraction
        traction = np.append(zone.stick_traction(ahead), sliding)
        traction *= friction * w * self.heat.contact.peak_pressure
        slip_speed = along(0.0, self.saturation_creepage * left * w * speed * zone.slip_rate)
        slip_speed = np.copysign(slip_speed, creepage)
        return ThermalStrip(
            position=w * np.append(ahead, xi),
            temperature=enters + along(0.0, zone.temperature),
            friction_coefficient=abs(friction) * along(1.0, zone.fraction),
            shear_traction=traction,
            slip_speed=slip_speed,
            heat_flux=traction * slip_speed,
        )

    def local_traction_coefficient(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Q/P by the local solution [1], 2 ms a point and 30 ms in an ellipse.

        Arguments and errors are those of `traction_coefficient`. Slip that would warm the contact
        more than 1e4 times as much as softening allows is out of range.

        Raises
        ------
        ConvergenceError
            If the iteration finds no solution.
        """
        zeta, v = checked("creepage", creepage, CREEPAGE), checked("speed", speed, SPEED)
        shape = common_shape({"creepage": zeta, "speed": v})
        if self.heat.shape == "line":
            strips = [(1.0, 1.0)]
        else:
            nodes, weights = np.polynomial.legendre.leggauss(STRIPS)
            width = np.cos(0.25 * np.pi * (nodes + 1.0))
            strips = list(zip(width, 0.375 * np.pi * weights * width**3, strict=True))
        found = []
        for one, at in np.broadcast(zeta, v):
            zones = [(weight, *self._zone(one, at, float(w))) for w, weight in strips]
            q = sum(weight * zone.traction_ratio for weight, zone, *_ in zones if zone)
            found.append(np.copysign(self.friction.kinetic * zones[0][3] * q, one))
        return np.reshape(found, shape)
