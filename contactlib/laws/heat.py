"""Flash temperature of a sliding contact, and how friction falls with temperature.

Each surface runs through the contact with its own speed v and thermal effusivity e = sqrt(lambda
rho c). The speed is high (v a/(2 kappa) >> 1), so conduction along the surface is negligible, and
the strips of a contact are independent. The flux q warms the surface from the leading edge on; with
xi = x/a and both bodies at one temperature T,

    e_i sqrt(v_i) T(xi) = sqrt(a/pi) int_xi^1 q_i(eta)/sqrt(eta - xi) d eta,    q_1 + q_2 = q.

The kernel is the same for both bodies, so they share the heat as e sqrt(v) everywhere in the
contact. Surfaces that enter with different temperatures immediately reach their mean with these
weights, and exchange a flux ~ 1/sqrt(1 - xi) that does not change this mean. In full slip q = f p0
sqrt(1 - eta**2) w, which gives Blok's

    T = f p0 w sqrt(a/pi) Theta(xi)/(e_1 sqrt(v_1) + e_2 sqrt(v_2)),
    Theta = (4 sqrt(2)/3) ((2 m - 1) E(m) + (1 - m) K(m)),    m = (1 - xi)/2.

`laws.thermal_contact` computes the creep force with thermal softening.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.special import beta, gamma, hyp2f1

from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checked_samples,
    common_shape,
    derived,
    shown,
)
from contactlib.laws.friction import FALL_TEMPERATURE
from contactlib.laws.hertz import Contact, EllipticContact

CREEPAGE = Limits(at_least=-1.0, at_most=1e3)  # a wheel that turns back enters behind
SPEED = Limits(above=0.0, at_most=1e4)
INNER = Limits(above=-1.0, below=1.0)
TEMPERATURE = Quantity("K", at_least=-1e4, at_most=1e4)
PROPERTY: dict[str, Any] = {"at_least": 1e-9, "at_most": 1e9}  # products do not overflow
COEFFICIENT = Limits(at_least=0.0, at_most=1e6)
# Pressure-weighted mean of Theta: sqrt(2 pi) times the integral of J1(k)**2 k**-2.5, which Weber
# and Schafheitlin give. A strip of an ellipse is w times as long, and T ~ w**1.5.
MEAN = math.sqrt(2.0 * math.pi) * gamma(2.5) * gamma(0.25)
MEAN /= 2.0**2.5 * gamma(1.75) ** 2 * gamma(2.75)
MEANS = {"line": MEAN, "elliptic": 0.75 * beta(0.5, 2.75) * MEAN}


def flash_profile(position: ArrayLike) -> FloatArray:
    """Theta(xi), the shape of the flash temperature along a fully sliding line contact [1].

    Parameters
    ----------
    position : array_like
        xi = x/a [1], the leading edge being +1; below -1 it is behind the contact.

    Raises
    ------
    ValueError
        If a position is not finite.

    Examples
    --------
    >>> flash_profile([1.0, 0.0, -1.0]).round(5).tolist()
    [0.0, 1.74804, 1.88562]
    """
    xi = checked("position", position, FINITE)
    m = 0.5 * (1.0 - np.clip(xi, -1.0, 1.0))
    inside = math.sqrt(2.0) * math.pi * m * hyp2f1(-0.5, 1.5, 2.0, m)
    gap = 1.0 - np.minimum(xi, -1.0)
    behind = 0.5 * math.pi / np.sqrt(gap) * hyp2f1(0.5, 1.5, 3.0, 2.0 / gap)
    return np.where(xi < -1.0, behind, inside)


@dataclass(frozen=True, kw_only=True)
class ThermalMaterial(Parameters):
    """Heat conduction of a material.

    Parameters
    ----------
    conductivity : float
        lambda [W/(m K)].
    density : float
        rho [kg/m^3].
    heat_capacity : float
        c [J/(kg K)].

    Examples
    --------
    >>> round(STEEL.effusivity), round(1e6 * STEEL.diffusivity, 2)
    (13437, 13.85)
    """

    conductivity: Annotated[float, Quantity("W/(m.K)", **PROPERTY)]
    density: Annotated[float, Quantity("kg/m^3", **PROPERTY)]
    heat_capacity: Annotated[float, Quantity("J/(kg.K)", **PROPERTY)]

    @property
    def effusivity(self) -> float:
        """E = sqrt(lambda rho c) [W s^0.5/(m^2 K)]."""
        return math.sqrt(self.conductivity * self.density * self.heat_capacity)

    @property
    def diffusivity(self) -> float:
        """Kappa = lambda/(rho c) [m^2/s]."""
        return self.conductivity / (self.density * self.heat_capacity)


# Wheel and rail steel at about 60 C. EN 1993-1-2, 3.4.1, gives 54 - 0.0333 T W/(m K) and 440 to
# 488 J/(kg K) between 20 and 100 C, an effusivity of 13 570 to 13 930.
STEEL = ThermalMaterial(conductivity=50.0, density=7850.0, heat_capacity=460.0)


@dataclass(frozen=True, init=False)
class Softening:
    """Fall of friction with temperature, as samples and the monotone cubic through them.

    Parameters
    ----------
    temperature : array_like
        Temperatures above ambient [K], strictly increasing from 0.
    coefficient : array_like
        Friction coefficients there [1], decreasing; only their ratio to the first one matters. The
        last one applies to higher temperatures, the first one to lower ones.

    Raises
    ------
    ValueError
        If the samples are not two rows of one length, out of range, or do not fall.

    Examples
    --------
    >>> Softening([0.0, 400.0, 800.0], [0.4, 0.32, 0.1]).fraction([0.0, 800.0]).tolist()
    [1.0, 0.25]
    """

    temperature: tuple[float, ...]
    share: tuple[float, ...]

    def __init__(self, temperature: ArrayLike, coefficient: ArrayLike) -> None:
        limits = Limits(at_least=0.0, at_most=1e6)
        t, f = checked_samples(limits, apart=1e-6, temperature=temperature, coefficient=coefficient)
        if not f[0] >= 1e-6 or np.any(np.diff(f) >= 0.0):
            raise ValueError(f"coefficient = {shown(f.tolist())} must be >= 1e-6 at first and fall")
        object.__setattr__(self, "temperature", tuple(t.tolist()))
        object.__setattr__(self, "share", tuple((f / f[0]).tolist()))

    @classmethod
    def linear(cls, softening_temperature: float) -> Softening:
        """F = 1 - T/T_m with T_m [K] above ambient, from 1 to 1e6: Ertz and Knothe's law."""
        top = checked_number("softening_temperature", softening_temperature, FALL_TEMPERATURE)
        return cls([0.0, top], [1.0, 0.0])

    @cached_property
    def _curve(self) -> Any:
        return PchipInterpolator(self.temperature, self.share)

    def fraction(self, temperature: ArrayLike) -> FloatArray:
        """F, friction over that at ambient temperature [1], at temperatures above ambient [K]."""
        t = checked("temperature", temperature, FINITE)
        return np.asarray(self._curve(np.clip(t, 0.0, self.temperature[-1])))

    def slope(self, temperature: ArrayLike) -> FloatArray:
        """dF/dT [1/K], at temperatures above ambient [K]."""
        t = checked("temperature", temperature, FINITE)
        top = self.temperature[-1]
        return np.where((t < 0.0) | (t > top), 0.0, self._curve(np.clip(t, 0.0, top), 1))


@dataclass(frozen=True, kw_only=True)
class ContactHeat(Parameters):
    """Flash temperature of a contact at its nominal load, from the slip of the wheel.

    Parameters
    ----------
    contact : LineContact or EllipticContact
        Geometry and pressure.
    wheel, rail : ThermalMaterial, optional
        Default: steel.
    wheel_temperature, rail_temperature : float, optional
        Bulk temperatures above ambient [K]. Default: 0.

    Notes
    -----
    The theory is that of a fast source. Jaeger's solution for any speed has a mean rise higher by
    2.8 % at a Peclet number of 5, 1.5 % at 10 and 0.16 % at 100; steel in a contact 12 mm long is
    at 10 at 0.05 m/s. A body at rest absorbs no heat.

    Examples
    --------
    >>> from contactlib.laws.hertz import LineContact
    >>> contact = LineContact.from_semi_width(
    ...     semi_width=6e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=100e3)
    >>> heat = ContactHeat(contact=contact)
    >>> round(0.3 * heat.mean_rise(creepage=0.05, speed=10.0).item(), 1)  # friction 0.3
    82.9
    """

    contact: Contact
    wheel: ThermalMaterial = STEEL
    rail: ThermalMaterial = STEEL
    wheel_temperature: Annotated[float, TEMPERATURE] = 0.0
    rail_temperature: Annotated[float, TEMPERATURE] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        a, p0 = self.contact.semi_width, self.contact.peak_pressure
        given = {"semi_width": a, "peak_pressure": p0, "rail.effusivity": self.rail.effusivity}
        derived(
            "ContactHeat's rise of temperature",
            lambda: p0 * math.sqrt(a) / self.rail.effusivity,
            given,
            Limits(above=0.0, at_most=1e30),
        )

    @property
    def shape(self) -> Literal["line", "elliptic"]:
        """Shape of the contact: "line" or "elliptic"."""
        return "elliptic" if isinstance(self.contact, EllipticContact) else "line"

    def _weights(self, creepage: ArrayLike, speed: ArrayLike) -> tuple[FloatArray, ...]:
        """Creepage, speed, and e sqrt(v) of wheel and rail [W s^0.5/(m^2 K) (m/s)^0.5]."""
        zeta, v = checked("creepage", creepage, CREEPAGE), checked("speed", speed, SPEED)
        common_shape({"creepage": zeta, "speed": v})
        root = np.sqrt(v)
        wheel = self.wheel.effusivity * np.sqrt(1.0 + zeta) * root
        return zeta, v, wheel, self.rail.effusivity * root

    def peclet_number(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """The smaller v a/(2 kappa) of wheel and rail [1]; arguments as in `mean_rise`."""
        zeta, v, *_ = self._weights(creepage, speed)
        half = 0.5 * self.contact.semi_width * v
        wheel = half * (1.0 + zeta) / self.wheel.diffusivity
        return np.asarray(np.minimum(wheel, half / self.rail.diffusivity))

    def wheel_share(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Part of frictional heat that flows into the wheel [1]; arguments as in `mean_rise`."""
        _, _, wheel, rail = self._weights(creepage, speed)
        return np.asarray(wheel / (wheel + rail))

    def entry_temperature(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Temperature above ambient that two surfaces take where they meet, before they slip [K].

        Arguments as in `mean_rise`.
        """
        share = self.wheel_share(creepage, speed)
        return np.asarray(share * self.wheel_temperature + (1.0 - share) * self.rail_temperature)

    def mean_rise(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Rise of the mean temperature over friction coefficient in full slip [K].

        The mean is weighted with the pressure. Arguments broadcast.

        Parameters
        ----------
        creepage : array_like
            zeta [1], from -1, a wheel that stands still, to 1000.
        speed : array_like
            V [m/s], above 0 and at most 1e4.

        Raises
        ------
        ValueError
            If a number is out of range.
        """
        zeta = checked("creepage", creepage, CREEPAGE)
        return np.asarray(np.abs(zeta) * self.rise_per_creepage(zeta, speed))

    def rise_per_creepage(self, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
        """`mean_rise` over creepage [K]; it depends on the creepage by the wheel's own speed."""
        _, v, wheel, rail = self._weights(creepage, speed)
        flow = self.contact.peak_pressure * math.sqrt(self.contact.semi_width / math.pi) * v
        return np.asarray(MEANS[self.shape] * flow / (wheel + rail))

    def temperature(
        self,
        position: ArrayLike,
        lateral_position: ArrayLike = 0.0,
        *,
        friction_coefficient: float,
        creepage: float,
        speed: float,
    ) -> FloatArray:
        """Temperature above ambient at places of a contact in full slip [K]; places broadcast.

        Parameters
        ----------
        position : array_like
            x/a [1], the leading edge of the middle strip being +1.
        lateral_position : array_like, optional
            y/b [1], between -1 and 1; a line contact does not depend on it.
        friction_coefficient : float
            The same everywhere [1], not negative.
        creepage, speed : float
            As in `mean_rise`.

        Raises
        ------
        ValueError
            If a number is out of range.
        """
        xi, eta = (
            checked("position", position, FINITE),
            checked("lateral_position", lateral_position, INNER),
        )
        common_shape({"position": xi, "lateral_position": eta})
        f = checked_number("friction_coefficient", friction_coefficient, COEFFICIENT)
        zeta = checked_number("creepage", creepage, CREEPAGE)
        v = checked_number("speed", speed, SPEED)
        rise = f * float(self.mean_rise(zeta, v)) / MEANS[self.shape]
        w = np.sqrt((1.0 - eta) * (1.0 + eta)) if self.shape == "elliptic" else np.ones_like(eta)
        with np.errstate(over="ignore"):  # far behind a narrow strip
            places = np.clip(xi / w, -1e300, 1e300)
        flash = rise * w**1.5 * np.where(places < 1.0, flash_profile(places), 0.0)
        return np.asarray(self.entry_temperature(zeta, v) + flash)
