"""Wheelsets that the tests of stability share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import control
import numpy as np
from hypothesis import strategies as st
from strategies import magnitude, number

import contactlib as cl
from contactlib.stability import control_systems
from contactlib.vehicle import Axle, Drivetrain, OperatingPoint, Resistance

TABLE = cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")
MASSES = [None, 142.5e3, 22.5e3, 8e3]  # speed held; a wheelset with a train, alone, a light one


def made_wheelset(
    k_hat: float, radius: float, load: float, kinetic: float, slope: float, **body: Any
) -> cl.Wheelset:
    """A wheelset with a line contact whose friction does not fall with slip speed."""
    contact = cl.LineContact.from_semi_width(
        semi_width=5e-3, radius=radius, contact_modulus=115.4e9, wheel_load=load
    )
    static = 4.0 * kinetic  # far above, so that the process zone stays short
    friction = cl.friction_with_k_hat(contact, k_hat=k_hat, static=static, kinetic=kinetic)
    element = cl.ForceElement(contact, friction, table=TABLE, radius=radius, slope_reduction=slope)
    return cl.Wheelset(element, **body)


BODIES = st.fixed_dictionaries(
    {
        "k_hat": number(0.1, 0.8),
        "radius": number(0.3, 0.7),
        "load": number(4e4, 3e5),
        "kinetic": number(0.05, 0.4),
        "slope": number(0.1, 1.0),
        "inertia": magnitude(30.0, 1000.0),
        "mass": magnitude(2e3, 2e5),
        "damping": magnitude(1.0, 500.0),
        "resistance": st.builds(
            Resistance,
            constant=number(0.0, 2000.0),
            linear=magnitude(10.0, 2000.0),
            quadratic=number(0.0, 10.0),
        ),
    }
)


def plausible_vehicle(
    locomotive: cl.Model, i: int, *, held: float = 0.2
) -> tuple[Drivetrain, float, float]:
    """Drivetrain that carries 5 to 200 t or stands on a rig, 0.1 to 80 m/s, and a torque.

    Friction is constant after microns, or falls with slip speed or heat as well. The torque is
    between those of return and fold; `held` is the part on rigs.
    """
    rng = np.random.default_rng([7, i])
    mass, speed = np.exp(rng.uniform(np.log([5e3, 0.1]), np.log([2e5, 80.0]))).tolist()
    falls: tuple[dict[str, Any], ...] = (
        {},
        {"slip_rate_residual": rng.uniform(0.4, 1.0), "slip_rate_decay": rng.uniform(0.0, 1.0)},
        {"softening_temperature": rng.uniform(300.0, 1500.0)},
    )
    element = locomotive.wheelset.element
    friction = replace(element.friction, **falls[int(rng.integers(3))])
    body = replace(
        locomotive.wheelset,
        mass=None if rng.random() < held else mass,
        inertia=float(rng.uniform(50.0, 400.0)),
        damping=float(rng.choice([0.0, 5.0, 50.0, 200.0])),
        element=replace(element, friction=friction),
    )
    axle = Axle(
        stiffness=float(10.0 ** rng.uniform(6.0, 7.2)),
        damping=float(10.0 ** rng.uniform(1.5, 3.5)),
        drive_share=float(rng.uniform(0.0, 1.0)),
    )
    fold = cl.find_fold(body, speed=speed)
    smallest = max(fold.return_torque, 0.3 * fold.drive_torque)
    torque = smallest + float(rng.uniform(0.02, 0.98)) * (fold.drive_torque - smallest)
    return Drivetrain(body, axle=axle), speed, torque


def torque_run(
    body: cl.Wheelset, torque: float, creepage: float, duration: float, **given: Any
) -> cl.Result:
    """Run at a constant torque, from 10 m/s and to the slip-away unless given otherwise."""
    settings: dict[str, Any] = {
        "initial_speed": 10.0,
        "output_interval": 1.0,
        "stop_at": ["slip_away"],
        **given,
    }
    control = cl.TorqueControl(cl.Profile.of(torque))
    return cl.simulate(body, control, initial_creepage=creepage, duration=duration, **settings)


def falling(wheelset: cl.Wheelset) -> tuple[OperatingPoint, float, float]:
    """A point on the falling branch, its pole [1/s], and the gain that holds it [N.m]."""
    point = wheelset.balanced(creepage=0.02, speed=10.0)
    return point, float(point.eigenvalues[0].real), cl.creep_control_gain(wheelset, point)


def unstable(loop: Any) -> int:
    return unstable_open(control_systems.closed_loop(loop))


def unstable_open(loop: Any) -> int:
    poles = loop.poles()
    return int((np.abs(poles) > 1.0).sum() if loop.dt else (poles.real > 0.0).sum())


def encirclements(loop: Any) -> int:
    """Those of -1 by python-control's Nyquist curve, clockwise."""
    omega = np.append(0.0, control_systems.frequencies(loop))
    return int(control.nyquist_response(loop, omega).count)
