"""Initial states of runs: each wheelset is steady under its first demand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.contact import kernel
from contactlib.files.scenario import Scenario
from contactlib.stability.quasi_steady import steady_creepage

TRIED = np.geomspace(1e-3, 30.0, 60)  # creepages / zeta0 that bracket the steady state
HALVINGS = 52  # of the bracket: down to rounding


class Start(NamedTuple):
    """State and torque [N.m] of each wheelset, and the errors of those without a steady state."""

    states: Any
    torque: FloatArray
    refused: dict[int, ValueError]


def start(
    scenarios: Sequence[Scenario],
    fleet: kernel.NativeFleet,
    inputs: Any,
    demand: FloatArray,
    creepage: float | None = None,
) -> Start:
    """Find the state of each wheelset at the start.

    Parameters
    ----------
    scenarios : sequence of Scenario
        One for each wheelset.
    fleet : NativeFleet
        Drivetrains of the scenarios.
    inputs : ndarray
        Kernel inputs of the first row; their torque is not used.
    demand : ndarray
        Demanded torque at the start [N.m].
    creepage : float, optional
        Creepage at the start [1]. Default: steady under the demand; zero at standstill and
        backward.
    """
    states = np.zeros(fleet.size, kernel.drivetrain_dtype("state"))
    bodies = [one.drivetrain.wheelset for one in scenarios]
    speed = np.array([one.initial_speed for one in scenarios])
    slowest = np.array([body.element.minimum_speed for body in bodies])
    radius = np.array([body.radius for body in bodies])
    moving = speed >= slowest
    states["speed"] = speed
    states["drive_torque"] = torque = np.where(moving, demand, 0.0)

    def slip_by(at: FloatArray) -> None:
        omega = (speed + at * np.maximum(np.abs(speed), slowest)) / radius
        states["omega_left"] = states["omega_right"] = omega
        states["relaxed_left"] = states["relaxed_right"] = at

    refused: dict[int, ValueError] = {}
    if creepage is not None:
        found = np.full(fleet.size, creepage)
    elif moving.any():
        found, unclear = _steady(scenarios, fleet, inputs, states, demand, slip_by)
        found = np.where(moving, found, 0.0)
        for i in np.flatnonzero(unclear & moving).tolist():
            try:
                found[i] = _steady_alone(scenarios[i], inputs[i], float(demand[i]))
            except ValueError as error:
                found[i], refused[i] = 0.0, error
    else:
        found = np.zeros(fleet.size)
    slip_by(found)
    _twist(scenarios, fleet, inputs, states)
    return Start(states, torque, refused)


def _steady(
    scenarios: Sequence[Scenario],
    fleet: kernel.NativeFleet,
    inputs: Any,
    states: Any,
    demand: FloatArray,
    slip_by: Any,
) -> tuple[FloatArray, Any]:
    """Creepages that hold the demands, and which of them this simple search cannot find.

    It cannot where a wheel passes its peak before the demand is met.
    """
    bodies = [one.drivetrain.wheelset for one in scenarios]
    radius = np.array([body.radius for body in bodies])
    damping = np.array([body.damping for body in bodies])
    turning = np.array([body.inertia for body in bodies]) / radius

    def excess(at: FloatArray) -> tuple[FloatArray, Any]:
        """Quasi-steady torque minus demand [N.m]; see `stability.quasi_steady`."""
        slip_by(at)
        out = fleet.evaluate(inputs, states)
        force = out["creep_force_left"] + out["creep_force_right"]
        rolling = damping * (1.0 + at) * states["speed"] / radius
        torque = radius * force + rolling + turning * (1.0 + at) * out["speed_rate"]
        return torque - demand, (out["falling_left"] > 0.0) | (out["falling_right"] > 0.0)

    at_rest, _ = excess(np.zeros(fleet.size))
    sign = np.where(at_rest <= 0.0, 1.0, -1.0)
    friction = np.maximum(inputs["friction_left"], inputs["friction_right"])
    unit = sign * friction * np.array([body.element.saturation_creepage for body in bodies])
    unit = unit / inputs["slope"]
    low, high = np.zeros(fleet.size), np.zeros(fleet.size)
    met, unclear = at_rest == 0.0, np.zeros(fleet.size, dtype=np.bool_)
    for x in TRIED:
        beyond, falls = excess(x * unit)
        unclear |= falls & ~met
        passed = ~met & (sign * beyond >= 0.0)
        high = np.where(passed, x * unit, high)
        low = np.where(met | passed, low, x * unit)
        met |= passed
        if (met | unclear).all():
            break
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = sign * excess(middle)[0] < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.where(at_rest == 0.0, 0.0, high), unclear | ~met


def _steady_alone(scenario: Scenario, given: Any, demand: float) -> float:
    """Creepage of one wheelset that holds the demand, also beyond the first wheel's peak."""
    wheelset = scenario.drivetrain.wheelset.with_slope(float(given["slope"]))
    turning = wheelset.inertia / wheelset.radius * float(given["acceleration"])
    creepage = 0.0
    for _ in range(4):  # a rig that accelerates: converges fast, as 1 + zeta is almost one
        creepage = steady_creepage(
            wheelset,
            demand - (1.0 + creepage) * turning,
            speed=scenario.initial_speed,
            normal_load=float(given["load_left"] + given["load_right"]),
            friction_scale=(float(given["friction_left"]), float(given["friction_right"])),
        )
        if not turning:
            break
    return creepage


def _twist(
    scenarios: Sequence[Scenario], fleet: kernel.NativeFleet, inputs: Any, states: Any
) -> None:
    """Twist elastic axles such that both wheels keep their creepage."""
    if all(one.drivetrain.axle is None for one in scenarios):
        return
    there = fleet.evaluate(inputs, states)
    for i, one in enumerate(scenarios):
        wheelset, axle = one.drivetrain.wheelset, one.drivetrain.axle
        if axle is None:
            continue
        # J/2 (1 + zeta)/r dV/dt = share T - r Q_left - b/2 omega - k twist
        gained = (1.0 + states["relaxed_left"][i]) / wheelset.radius
        lost = wheelset.radius * there["creep_force_left"][i]
        lost += 0.5 * wheelset.damping * states["omega_left"][i]
        lost += 0.5 * wheelset.inertia * gained * there["speed_rate"][i]
        given = axle.drive_share * states["drive_torque"][i]
        states["twist"][i] = (given - lost) / axle.stiffness
