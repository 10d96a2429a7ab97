"""Wheelsets as the explorer page describes them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import contactlib as cl
from contactlib.element.force_element import RangeWarning
from contactlib.laws.scales import friction_with_k_hat
from contactlib.table.law_tables import carter_griffith_table

SPEED = 10.0  # that the shipped models begin at [m/s]
SAMPLE = 2e-4  # of the page's control [s]
POISSON_RATIO = 0.3  # of every wheelset here: a contact has only its modulus


def vehicle_of(wheelset: cl.Wheelset, initial_speed: float = 10.0) -> dict[str, Any]:
    """Fields of the page's Vehicle, for a wheelset under the Carter-Griffith law."""
    element, resistance = wheelset.element, wheelset.resistance
    contact, friction = element.contact, element.friction
    fields: tuple[tuple[Any, str], ...] = (
        (contact, "semi_width peak_pressure"),
        (element, "wheels axle_load k_hat layer_compliance slope_reduction minimum_speed memory"),
        (friction, "slip_rate_residual slip_rate_decay softening_temperature thermal_effusivity"),
        (wheelset, " ".join(["radius", *wheelset.quantities()])),
        (resistance, " ".join(resistance.quantities())),
    )
    return {
        "name": "a wheelset",
        "source": "a test",
        "contact": "elliptic" if isinstance(contact, cl.EllipticContact) else "line",
        "theory": getattr(contact, "theory", "half_space"),
        "youngs_modulus": 2.0 * (1.0 - POISSON_RATIO**2) * contact.contact_modulus,
        "poisson_ratio": POISSON_RATIO,
        "static_friction": friction.static,
        "kinetic_friction": friction.kinetic,
        "initial_speed": initial_speed,
        **{name: getattr(part, name) for part, names in fields for name in names.split()},
    }


def fold_of(wheelset: cl.Wheelset, speed: float = SPEED) -> cl.vehicle.Fold:
    """Python's fold, which is there."""
    fold = cl.stability.find_fold(wheelset, speed=speed)
    assert fold is not None
    return fold


def with_memory(wheelset: cl.Wheelset) -> cl.Wheelset:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RangeWarning)
        return replace(wheelset, element=replace(wheelset.element, memory=True))


def changed(wheelset: cl.Wheelset, changes: Mapping[str, float], ellipse: bool) -> cl.Wheelset:
    """A wheelset after entries by a visitor; a line that becomes an ellipse keeps a, p0 and P."""
    element = wheelset.element
    contact, friction = element.contact, element.friction
    left: dict[str, Any] = dict(changes)
    kinetic = left.pop("kinetic", friction.kinetic)
    ratio = left.pop("ratio", friction.static / friction.kinetic)
    heat = left.pop("heat", 0.0)
    load, a, p0 = contact.wheel_load, contact.semi_width, contact.peak_pressure
    if ellipse and isinstance(contact, cl.LineContact):
        contact = cl.EllipticContact.from_semi_axes(
            semi_axis_x=a,
            semi_axis_y=1.5 * load / (math.pi * a * p0),
            wheel_load=load,
            contact_modulus=contact.contact_modulus,
        )
    changed_friction = friction_with_k_hat(
        contact,
        k_hat=left.pop("k_hat", element.k_hat),
        static=ratio * kinetic,
        kinetic=kinetic,
        slip_rate_residual=left.pop("residual", friction.slip_rate_residual),
        slip_rate_decay=left.pop("decay", 0.0 if heat else friction.slip_rate_decay),
        softening_temperature=1.0 / heat if heat else friction.softening_temperature,
    )
    slope = left.pop("slope", element.slope_reduction)
    table = carter_griffith_table("elliptic" if ellipse else "line")
    new = replace(
        element, contact=contact, friction=changed_friction, table=table, slope_reduction=slope
    )
    return replace(wheelset, element=new, **left)
