"""The equations of the wet patch as a user would program them, for solve_ivp or a loop in numba.

The functions know floats only. numba compiles them if it is there; without it they are Python.
The wheelset is rigid and stays above its minimum speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, TypeVar, cast

import numpy as np

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.traction.creep_pi import BAND, CUT, MAX_SHARE, CreepPI
from contactlib.traction.filters import tracker_gains
from contactlib.vehicle.creep_curve import CreepCurve

numba: Any = None
with suppress(ImportError):
    numba = import_module("numba")

MIN_SHARE = CreepPI.minimum_share
TABLE_END, TABLE_CELLS = 6.0, 256  # of normalized creepage; right to 1e-6
OUTCOMES = ("distance", "speed", "largest_creepage", "slip_work")

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """The function, compiled if numba is there; threads may run it side by side."""
    if numba is None:
        return function
    return cast("F", numba.njit(nogil=True, error_model="numpy")(function))


# ---- one run's numbers ----------------------------------------------------------------------


def numbers(scenario: cl.Scenario, controller: str) -> dict[str, float]:
    """What the equations and the controller know of a scenario.

    Raises
    ------
    ValueError
        If the scenario has what the equations do not.
    """
    drivetrain, control = scenario.drivetrain, scenario.controller(controller)
    wheelset, track = drivetrain.wheelset, scenario.track
    friction = wheelset.element.friction
    patch = track.friction_left
    plain = drivetrain.axle is None and drivetrain.motor.lag == 0.0
    plain = plain and not wheelset.element.memory
    if not plain or friction.falls_with_slip_speed or wheelset.mass is None or len(patch.at) != 4:
        raise ValueError("the scenario is not a rigid wheelset that meets a patch")
    if not isinstance(control, cl.traction.CreepPI) or control.reference_torque is None:
        raise ValueError("the controller is no CreepPI whose reference follows the torque")
    gains = tracker_gains(control.sample_time, control.speed_filter_time)
    load, demand = wheelset.element.normal_load, float(scenario.demand(0.0))
    resistance = wheelset.resistance
    return {
        "radius": wheelset.radius,
        "inverse_inertia": 1.0 / wheelset.inertia,
        "inverse_mass": 1.0 / wheelset.mass,
        "damping": wheelset.damping,
        "constant": resistance.constant,
        "linear": resistance.linear,
        "quadratic": resistance.quadratic,
        "saturation_creepage": wheelset.element.saturation_creepage,
        "k_hat": wheelset.element.k_hat,
        "sliding": friction.kinetic * load,
        "largest": friction.static / friction.kinetic,
        "patch_start": patch.at[0],
        "patch_end": patch.at[-1],
        "patch_friction": patch.value[1],
        "demand": demand,
        "speed": scenario.initial_speed,
        "creepage": CreepCurve(
            wheelset,
            speed=scenario.initial_speed,
            normal_load=load,
            friction_scale=patch.value[0],
        ).grip(demand),
        "sample_time": control.sample_time,
        "reference": control.reference,
        "reference_torque": control.reference_torque,
        "proportional_gain": control.proportional_gain,
        "integral_gain": control.integral_gain,
        "low_speed": control.low_speed,
        "minimum_slip": control.minimum_slip,
        "recovery_time": control.recovery_time,
        "tracker_g": gains[0],
        "tracker_h": gains[1],
    }


def records(scenarios: Sequence[cl.Scenario], controller: str) -> Any:
    """The numbers of many runs, one record each."""
    rows = [numbers(scenario, controller) for scenario in scenarios]
    return np.rec.array(
        [tuple(row.values()) for row in rows], dtype=[(name, np.float64) for name in rows[0]]
    )


def record(given: dict[str, float]) -> Any:
    """The numbers of one run, as `records` has them."""
    return np.rec.array([tuple(given.values())], dtype=[(name, np.float64) for name in given])[0]


# ---- law, equations of motion, controller ---------------------------------------------------


@compiled
def line_law(x: float, k_hat: float) -> tuple[float, float]:
    """Traction ratio and slope of the line contact at x > 0.

    Eqs. (18) and (19) of Ciavarella, Romano & Barber, see contactlib/laws/strips.py.
    """
    low, high = 0.0, x / k_hat
    t = high / (1.0 + high)
    m = s = y = 0.0
    for _ in range(60):
        p = (t * t) * (t * t)
        s = 1.0 / (1.0 + p)
        m, y = p * s, k_hat * t
        residual = m + y - x
        if residual > 0.0:
            high = t
        else:
            low = t
        step = residual / (4.0 * m * s + y)  # of ln(t)
        if abs(step) < 1e-13:
            break
        following = t - t * step
        t = following if low < following < high else 0.5 * (low + high)
    share = m * y / (y + 4.0 * m * s)
    return m * (1.0 + s) + 2.0 * y * s, 2.0 * s * (1.0 - 4.0 * share)


@compiled
def tabulate(k_hat: float) -> FloatArray:
    """Cubic Hermite table of the law: values, and slopes times the cell's length."""
    length = TABLE_END / TABLE_CELLS
    nodes = np.empty((TABLE_CELLS + 1, 2))
    nodes[0, 0], nodes[0, 1] = 0.0, 2.0 * length
    for i in range(1, TABLE_CELLS + 1):
        ratio, slope = line_law(i * length, k_hat)
        nodes[i, 0], nodes[i, 1] = ratio, slope * length
    return nodes


@compiled
def law(nodes: FloatArray, k_hat: float, friction: float, x: float) -> tuple[float, float]:
    """Traction ratio and slope at x >= 0: of the table, or solved where it ends."""
    per_length = TABLE_CELLS / TABLE_END
    place = x * per_length
    if place < nodes.shape[0] - 1:
        cell = int(place)
        f = place - cell
        a, b = nodes[cell, 0], nodes[cell, 1]
        rise, end = nodes[cell + 1, 0] - a, nodes[cell + 1, 1]
        c, d = 3.0 * rise - 2.0 * b - end, b + end - 2.0 * rise
        return a + f * (b + f * (c + f * d)), (b + f * (2.0 * c + 3.0 * f * d)) * per_length
    return line_law(x, k_hat / math.sqrt(friction)) if x > 0.0 else (0.0, 2.0)


@compiled
def motion(
    run: Any, nodes: FloatArray, omega: float, speed: float, torque: float, friction: float
) -> tuple[float, float, float, float, float, float, float]:
    """Rates of omega and speed, their Jacobian by rows, and the creep force."""
    inverse_speed = 1.0 / speed
    creepage = (run.radius * omega - speed) * inverse_speed
    saturation = run.saturation_creepage * friction
    ratio, slope = law(nodes, run.k_hat, friction, abs(creepage) / saturation)
    if ratio > run.largest:
        ratio, slope = run.largest, 0.0
    force = math.copysign(run.sliding * friction * ratio, creepage)
    by_slip = run.sliding * slope / run.saturation_creepage * inverse_speed
    by_speed = -by_slip * (1.0 + creepage)
    resistance = run.constant + (run.linear + run.quadratic * speed) * speed
    by_resistance = run.linear + 2.0 * run.quadratic * speed
    return (
        (torque - run.radius * force - run.damping * omega) * run.inverse_inertia,
        (force - resistance) * run.inverse_mass,
        -(run.radius * run.radius * by_slip + run.damping) * run.inverse_inertia,
        -run.radius * by_speed * run.inverse_inertia,
        run.radius * by_slip * run.inverse_mass,
        (by_speed - by_resistance) * run.inverse_mass,
        force,
    )


@compiled
def control(run: Any, memory: FloatArray, wheel_speed: float, vehicle_speed: float) -> float:
    """Torque of the creep controller until its next sample; see contactlib/traction/creep_pi.py.

    Memory: filtered vehicle speed, its change, integral, 1 if limiting.
    """
    expected = memory[0] + memory[1]
    surprise = vehicle_speed - expected
    memory[0] = expected + run.tracker_g * surprise
    memory[1] += run.tracker_h * surprise
    share = min(max(memory[2] / run.reference_torque, MIN_SHARE), MAX_SHARE)
    scale = max(abs(memory[0]), run.low_speed)
    target = max(run.reference * share * scale, run.minimum_slip)
    demand = run.demand
    integral = min(memory[2], demand) if memory[3] > 0.0 else demand
    error = target - (wheel_speed - memory[0])
    requested = run.proportional_gain * error + integral
    part = error / target
    ease = max(min(part, 1.0), BAND) - BAND - CUT * max(min(-part, 4.0) - 3.0, 0.0)
    integral += run.sample_time * (run.integral_gain * error + demand * ease / run.recovery_time)
    memory[2] = min(max(integral, 0.0), demand)
    memory[3] = 1.0 if requested < demand else 0.0
    return float(min(max(requested, 0.0), demand))


@compiled
def start(run: Any, memory: FloatArray) -> float:
    """Angular velocity at the start; the controller has been giving the demand."""
    memory[0], memory[1], memory[2], memory[3] = run.speed, 0.0, run.demand, 0.0
    return float(run.speed * (1.0 + run.creepage) / run.radius)


@compiled
def is_wet(run: Any, distance: float) -> bool:
    """Whether a place lies in the patch."""
    return bool(run.patch_start <= distance < run.patch_end)
