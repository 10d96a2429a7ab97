"""Wheelsets as the explorer page describes them, and random ones."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

import contactlib as cl
from contactlib.base.quantities import Parameters
from contactlib.element.force_element import RangeWarning
from contactlib.laws.hertz import Contact
from contactlib.laws.scales import friction_with_k_hat
from contactlib.table.law_tables import Shape, carter_griffith_table
from contactlib.vehicle import Resistance

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


def random_wheelset(rng: np.random.Generator) -> cl.Wheelset:
    """Any parameters within their ranges in practice and somewhat beyond."""
    modulus = float(rng.uniform(50e9, 150e9))
    load = float(rng.uniform(50e3, 250e3))
    a, b = (float(size) for size in rng.uniform(3e-3, 9e-3, 2))
    shape: Shape = "line" if rng.random() < 0.5 else "elliptic"
    contact: Contact
    if shape == "line":
        contact = cl.LineContact.from_semi_width(
            semi_width=a, radius=0.5, contact_modulus=modulus, wheel_load=load
        )
    else:
        contact = cl.EllipticContact.from_semi_axes(
            semi_axis_x=a, semi_axis_y=b, wheel_load=load, contact_modulus=modulus
        )
    kinetic = float(rng.uniform(0.05, 0.4))
    friction = friction_with_k_hat(
        contact,
        k_hat=float(rng.choice([rng.uniform(0.0, 2.0), rng.uniform(0.0, 0.3)])),
        static=kinetic * float(rng.uniform(1.05, 4.0)),
        kinetic=kinetic,
        slip_rate_residual=float(rng.choice([1.0, rng.uniform(0.2, 1.0)])),
        **_fall(rng),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RangeWarning)
        element = cl.ForceElement(
            contact,
            friction,
            table=carter_griffith_table(shape),
            radius=float(rng.uniform(0.3, 0.7)),
            slope_reduction=float(10.0 ** rng.uniform(-1.5, 0.0)),
            layer_compliance=1e-13 if int(load) % 2 else 0.0,
        )
    body = {
        "inertia": float(10.0 ** rng.uniform(1.5, 3.0)),
        "mass": None if rng.random() < 0.5 else float(10.0 ** rng.uniform(3.5, 5.5)),
        "damping": float(rng.choice([0.0, 10.0 ** rng.uniform(0.0, 2.5)])),
    }
    resistance = {
        "constant": float(rng.uniform(0.0, 3e3)),
        "linear": float(rng.uniform(0.0, 100.0)),
        "quadratic": float(rng.uniform(0.0, 5.0)),
        "grade": float(rng.uniform(-0.01, 0.01)),
    }
    return cl.Wheelset(
        element,
        **_completed(cl.Wheelset, body),
        resistance=Resistance(**_completed(Resistance, resistance)),
    )


def _completed(part: type[Parameters], given: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers of a part, with a small one of each other that it declares."""
    high = {n: (q.usual or (0.0, q.at_most))[1] for n, q in part.quantities().items()}
    return {**{name: 1e-3 * value for name, value in high.items()}, **given}


def with_memory(wheelset: cl.Wheelset) -> cl.Wheelset:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RangeWarning)
        return replace(wheelset, element=replace(wheelset.element, memory=True))


def _fall(rng: np.random.Generator) -> dict[str, float]:
    if rng.random() < 0.3:
        return {"softening_temperature": float(rng.uniform(200.0, 2000.0))}
    return {"slip_rate_decay": float(rng.uniform(0.0, 2.0))}


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
