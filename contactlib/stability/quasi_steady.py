"""Steady states of the creepage at one speed, which for a free wheelset may still be changing.

With the speed frozen, the creepage of a wheelset under a drive torque T moves by

    dzeta/dt = (r/(J V)) (T - T_s(zeta)),    T_s = r Q + b omega + (J/r)(1 + zeta) dV/dt,

exactly, as J domega/dt = T - r Q - b omega and zeta = (r omega - V)/V. So the curve of T_s, the
quasi-steady torque, tells where the creepage rests, whether it stays there and how long it takes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.parameters import FINITE, FloatArray, checked
from contactlib.wheelset import CONTACT, Wheelset, checked_conditions


def quasi_steady_torque(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> FloatArray:
    """Drive torque that keeps a creepage unchanged while the vehicle accelerates [N.m].

    T = r Q + b omega + (J/r)(1 + zeta) dV/dt. The last term turns the wheelset along with the
    vehicle; it vanishes if the speed is held.
    """
    zeta = checked("creepage", creepage, FINITE)
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    speed = inputs["speed"]
    record = wheelset.element.at_creepage(zeta, **{name: inputs[name] for name in CONTACT})
    r, force = wheelset.radius, record["creep_force"]
    acceleration = _acceleration(wheelset, force, speed, inputs["resistance_force"])
    turning = wheelset.inertia / r * (1.0 + zeta) * acceleration
    return np.asarray(r * force + wheelset.damping * (1.0 + zeta) * speed / r + turning)


def quasi_steady_slope(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> FloatArray:
    """Derivative of `quasi_steady_torque` to the creepage, at fixed speed [N.m]."""
    zeta = checked("creepage", creepage, FINITE)
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    speed = inputs["speed"]
    record = wheelset.element.at_creepage(zeta, **{name: inputs[name] for name in CONTACT})
    r, rise = wheelset.radius, record["force_gradient"] * speed  # dQ/dzeta
    slope = r * rise + wheelset.damping * speed / r
    if wheelset.mass is not None:
        acceleration = _acceleration(
            wheelset, record["creep_force"], speed, inputs["resistance_force"]
        )
        slope = slope + wheelset.inertia / r * (acceleration + (1.0 + zeta) * rise / wheelset.mass)
    return np.asarray(slope)


def slip_acceleration(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    drive_torque: float,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> FloatArray:
    """Rate of the slip velocity r omega - V under a drive torque [m/s2].

    V dzeta/dt + zeta dV/dt: in a vehicle that brakes hard it may fall while the creepage grows.
    """
    inputs: dict[str, Any] = {
        "speed": speed,
        "normal_load": normal_load,
        "friction_scale": friction_scale,
        "resistance_force": resistance_force,
    }
    zeta = np.asarray(creepage, dtype=np.float64)
    surplus = drive_torque - quasi_steady_torque(wheelset, zeta, **inputs)
    stretching = zeta * vehicle_acceleration(wheelset, zeta, **inputs)
    return np.asarray(wheelset.radius / wheelset.inertia * surplus + stretching)


def vehicle_acceleration(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> FloatArray:
    """dV/dt at a creepage [m/s2]: zero if the speed is held."""
    record = wheelset.element.at_creepage(
        creepage, speed=speed, normal_load=normal_load, friction_scale=friction_scale
    )
    return _acceleration(wheelset, record["creep_force"], speed, resistance_force)


def creepage_pole(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> FloatArray:
    """Rate at which a creepage leaves its quasi-steady state, the speed frozen [1/s].

    -(r/(J V)) dT_s/dzeta: negative where the quasi-steady torque rises. For a held speed it is the
    pole of the wheelset; for a free one the fast pole but for terms of the size of F'/M.
    """
    slope = quasi_steady_slope(
        wheelset,
        creepage,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    return np.asarray(-wheelset.radius * slope / (wheelset.inertia * float(speed)))


def creepage_grid(
    wheelset: Wheelset,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
) -> FloatArray:
    """Creepages above zero [1], close enough to show every rise and fall of the torque."""
    scale = wheelset.element.saturation_creepage_at(
        normal_load=normal_load, friction_scale=friction_scale
    )
    # Where friction falls with slip speed, the peak may be at as little as its residual's zeta0,
    # and the tail is as long as the fall.
    friction = wheelset.element.friction
    fall = friction.slip_rate_decay * speed * scale  # over one zeta0
    first, last = 0.01 * friction.slip_rate_residual, max(1e5, 40.0 / fall if fall > 0.0 else 0.0)
    return scale * np.geomspace(first, last, round(571.0 * math.log10(last / first)) + 4)


def turning_points(slope: Callable[[Any], Any], grid: FloatArray) -> FloatArray:
    """Where a slope over creepages changes sign or vanishes, rising as `grid` does [1].

    A curve that only just reaches a value does so here, between two nodes of the grid.
    """
    values = slope(grid)
    ends = np.flatnonzero(values[:-1] * values[1:] < 0.0)

    def root(i: int) -> float:
        return float(
            brentq(lambda z: float(slope(z)), grid[i], grid[i + 1], xtol=1e-16, rtol=1e-14)
        )

    return np.union1d(grid[values == 0.0], [root(int(i)) for i in ends])


def _acceleration(
    wheelset: Wheelset, creep_force: Any, speed: float, resistance_force: float
) -> FloatArray:
    """dV/dt under a creep force [m/s2]: zero if the speed is held."""
    if wheelset.mass is None:
        return np.zeros_like(creep_force)
    load = wheelset.element.contact.normal_load
    omega = speed / wheelset.radius  # rolling without creepage, hence without creep force
    coasting, _ = wheelset.rates(omega, speed, 0.0, load, 1.0, resistance_force)
    return np.asarray(creep_force / wheelset.mass + coasting.speed_rate)
