"""Initial states of runs: each wheelset is steady under its first demand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.files.scenario import Scenario
from contactlib.vehicle.creep_curve import beyond_grip


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
    torque = np.where(moving, demand, 0.0)
    braked = np.array([one.drivetrain.brake is not None for one in scenarios])
    states["brake_torque"] = np.where(braked, np.maximum(-torque, 0.0), 0.0)
    states["drive_torque"] = np.where(braked, np.maximum(torque, 0.0), torque)

    refused: dict[int, ValueError] = {}
    if creepage is not None:
        found = np.full(fleet.size, creepage)
    elif moving.any():
        found, limit = fleet.grip(inputs, speed, demand)
        for i in np.flatnonzero(np.isnan(found) & moving).tolist():
            refused[i] = ValueError(beyond_grip(float(demand[i]), float(limit[i])))
        found = np.where(moving & ~np.isnan(found), found, 0.0)
    else:
        found = np.zeros(fleet.size)
    omega = (speed + found * np.maximum(np.abs(speed), slowest)) / radius
    states["omega_left"] = states["omega_right"] = omega
    steady = fleet.evaluate(inputs, states)
    for side in ("left", "right"):
        states[f"traction_{side}"] = steady[f"steady_{side}"]
        states[f"unslipped_{side}"] = steady[f"sticking_{side}"]
    _twist(scenarios, fleet, inputs, states, torque, found)
    return Start(states, torque, refused)


def _twist(
    scenarios: Sequence[Scenario],
    fleet: kernel.NativeFleet,
    inputs: Any,
    states: Any,
    torque: FloatArray,
    creepage: FloatArray,
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
        gained = (1.0 + creepage[i]) / wheelset.radius
        lost = wheelset.radius * there["creep_force_left"][i]
        lost += 0.5 * wheelset.damping * states["omega_left"][i]
        lost += 0.5 * wheelset.inertia * gained * there["speed_rate"][i]
        given = axle.drive_share * torque[i]
        states["twist"][i] = (given - lost) / axle.stiffness
