"""Creep force with thermal softening of friction, in closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.quantities import (
    FINITE,
    NOT_NEGATIVE,
    FloatArray,
    Parameters,
    checked,
    common_shape,
)
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.friction import Friction
from contactlib.laws.heat import CREEPAGE, MEANS, ContactHeat, Softening
from contactlib.laws.scales import SLOPE_REDUCTION, k_hat, saturation_creepage

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
    `traction_coefficient` is a closed form. The reference solver ``tools/thermal_strips.py`` solves
    temperature and traction along the contact. For linear softening and heat numbers V zeta0/w_T
    up to 0.2 they differ by less than 0.004 of f0 for k_hat 0, and up to 0.025 for k_hat 0.3.

    Examples
    --------
    >>> from contactlib.laws.hertz import LineContact
    >>> contact = LineContact.from_semi_width(
    ...     semi_width=6e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=100e3)
    >>> hot = ThermalContact(
    ...     heat=ContactHeat(contact=contact),
    ...     friction=Friction(static=0.3, kinetic=0.3, weakening_length=0.0),
    ...     softening=Softening.linear(800.0))
    >>> hot.traction_coefficient([0.01, 0.1, 0.5], speed=20.0).round(4).tolist()
    [0.2918, 0.2313, 0.1232]
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
            factor = friction_factor(x, number, k_hat=k_hats, contact=self.heat.shape)
            colder = share > factor
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
