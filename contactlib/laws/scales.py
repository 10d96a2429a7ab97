"""Dimensionless numbers by which load, friction and materials enter the law.

All are at zero slip speed; friction that has fallen to the fraction g multiplies zeta0 by g and
k_hat by 1/sqrt(g).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

from contactlib import kernel
from contactlib.base.quantities import (
    NOT_NEGATIVE,
    POSITIVE,
    Quantity,
    checked_number,
    checks_call,
    derived,
)
from contactlib.laws.contact_law import K_HAT
from contactlib.laws.friction import Friction
from contactlib.laws.hertz import Contact, EllipticContact

SLOPE_REDUCTION = Quantity("1", above=0.0, at_most=1e6)
LAYER_COMPLIANCE = Quantity("m/Pa", at_least=0.0, at_most=1e-6, usual=(0.0, 1e-9))


def contact_parameters(
    contact: Contact, friction: Friction, slope_reduction: float, layer_compliance: float = 0.0
) -> dict[str, float]:
    """The kernel's parameters that describe contact and friction, by name."""
    return {
        "static_friction": friction.static,
        "kinetic_friction": friction.kinetic,
        "weakening_length": friction.weakening_length,
        "slip_rate_residual": friction.slip_rate_residual,
        "slip_rate_decay": friction.slip_rate_decay,
        "softening_temperature": friction.softening_temperature,
        "thermal_effusivity": friction.thermal_effusivity,
        "elliptic": float(isinstance(contact, EllipticContact)),
        "slope_reduction": slope_reduction,
        "layer_compliance": layer_compliance,
        "semi_width": contact.semi_width,
        "peak_pressure": contact.peak_pressure,
        "contact_modulus": contact.tangential_modulus,
        "nominal_load": contact.wheel_load,
        "load_exponent": contact.load_exponent,
    }


def _scale(name: str, contact: Contact, friction: Friction, slope_reduction: float) -> float:
    parameters = contact_parameters(contact, friction, slope_reduction)
    scales = kernel.contact_scales(parameters, contact.wheel_load)
    limits = POSITIVE if name == "saturation_creepage" else NOT_NEGATIVE
    return derived(name, lambda: getattr(scales, name), parameters, limits)


def saturation_creepage(
    contact: Contact, friction: Friction, *, slope_reduction: float = 1.0
) -> float:
    """zeta0 = 2 f_d p0/E* at the nominal load, over the slope reduction [1], Eq. (15).

    For a line contact this is f_d a/R; for an ellipse E* is its `tangential_modulus`.
    """
    reduction = checked_number("slope_reduction", slope_reduction, SLOPE_REDUCTION)
    return _scale("saturation_creepage", contact, friction, reduction)


def k_hat(contact: Contact, friction: Friction) -> float:
    """Largest normalized stress-intensity factor at the nominal load [1], Eq. (17).

    Examples
    --------
    >>> from contactlib.laws.hertz import LineContact
    >>> contact = LineContact.from_semi_width(
    ...     semi_width=5e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=220e3)
    >>> round(k_hat(contact, Friction(static=0.45, kinetic=0.21, weakening_length=1.3e-6)), 3)
    0.3
    """
    return _scale("k_hat", contact, friction, 1.0)


def process_zone_ratio(contact: Contact, friction: Friction) -> float:
    """Length of the weakening zone over the contact semi-width, at the nominal load [1].

    It is 2 pi k_hat**2 (f_d/(f_s - f_d))**2. The Carter-Griffith law is the limit of zero and
    becomes inaccurate above 0.5.
    """
    return _scale("process_zone_ratio", contact, friction, 1.0)


@checks_call
def friction_with_k_hat(
    contact: Contact,
    *,
    k_hat: Annotated[float, K_HAT],
    static: float,
    kinetic: float,
    **others: Any,
) -> Friction:
    """Friction whose weakening length gives `k_hat` in `contact` at its nominal load.

    Parameters
    ----------
    contact : LineContact or EllipticContact
        Contact at its nominal load.
    k_hat : float
        Largest normalized stress-intensity factor, Eq. (17), at the nominal load, from which the
        weakening length follows [1].
    static, kinetic : float
        Friction coefficients [1].
    **others
        Other fields of `Friction`.

    Raises
    ------
    ValueError
        If a value is out of range, or `k_hat` is above zero and `static` equals `kinetic`.
    """
    of_one_metre = Friction(static=static, kinetic=kinetic, weakening_length=1.0, **others)
    if k_hat > 0.0 and static == kinetic:
        raise ValueError(f"k_hat = {k_hat!r} needs static > kinetic = {kinetic!r}")
    reference = _scale("k_hat", contact, of_one_metre, 1.0)
    if k_hat == 0.0:
        return replace(of_one_metre, weakening_length=0.0)
    length = derived(  # k_hat grows like the square root of the length
        "weakening_length",
        lambda: (k_hat / reference) ** 2,
        {"k_hat": k_hat, "static": static, "kinetic": kinetic},
    )
    return replace(of_one_metre, weakening_length=length)


@checks_call
def slope_reduction_of(
    contact: Contact,
    friction: Friction,
    *,
    saturation_creepage: Annotated[
        float | None, Quantity("1", above=0.0, percent=True, usual=(1e-4, 0.3))
    ] = None,
    slope_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None,
    layer_compliance: Annotated[float, LAYER_COMPLIANCE] = 0.0,
) -> float:
    """Slope reduction [1] from either of two numbers; without them it is 1.

    Parameters
    ----------
    contact, friction : LineContact or EllipticContact, Friction
        Clean surfaces at the nominal load.
    saturation_creepage : float, optional
        Creepage zeta0 at the nominal load [1]. Default and minimum: that of clean surfaces.
    slope_reduction : float, optional
        The initial slope over that of clean surfaces; zeta0 is divided by it [1].
    layer_compliance : float, optional
        L of a thin elastic layer [m/Pa], which leaves zeta0 as it is. Default: no layer.

    Raises
    ------
    ValueError
        If a value is out of range, or `saturation_creepage` is given with one of the others.
    """
    if saturation_creepage is None:
        return 1.0 if slope_reduction is None else slope_reduction
    if slope_reduction is not None:
        raise ValueError("saturation_creepage and slope_reduction: give at most one of them, not 2")
    if layer_compliance > 0.0:
        raise ValueError(
            f"layer_compliance = {layer_compliance!r} must be 0 with a saturation_creepage: a "
            "layer lowers the slope and leaves zeta0 that of clean surfaces"
        )
    clean = _scale("saturation_creepage", contact, friction, 1.0)
    if saturation_creepage < clean * (1.0 - 1e-12):
        raise ValueError(
            f"saturation_creepage = {saturation_creepage!r} is out of range: must be >= "
            f"{clean:.6g}, that of clean surfaces"
        )
    return min(1.0, clean / saturation_creepage)
