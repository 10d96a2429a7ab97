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
        Torque at the start [N.m]; that of a brake acts at any speed, against the motion.
    creepage : float, optional
        Creepage at the start [1]. Default: steady under the torque; zero at standstill.
    """
    states = np.zeros(fleet.size, kernel.drivetrain_dtype("state"))
    bodies = [scenario.drivetrain.wheelset for scenario in scenarios]
    speed = np.array([scenario.initial_speed for scenario in scenarios])
    slowest = np.array([body.element.minimum_speed for body in bodies])
    radius = np.array([body.radius for body in bodies])
    moving = np.abs(speed) >= slowest
    direction = np.where(speed < 0.0, -1.0, 1.0)
    states["speed"] = speed
    braked = np.array([scenario.drivetrain.brake is not None for scenario in scenarios])
    torque = np.where(moving, demand, 0.0)
    motor = np.where(braked, np.maximum(torque, 0.0), torque)
    states["drive_torque"] = motor
    states["brake_torque"] = braking = np.where(braked, np.maximum(-demand, 0.0), 0.0)
    states["pads_left"] = states["pads_right"] = np.where(braked, np.sign(speed), 0.0)

    refused: dict[int, ValueError] = {}
    if creepage is not None:
        creepages = np.full(fleet.size, creepage)
    elif moving.any():
        ahead = inputs.copy()  # as seen in the direction of motion
        for name in ("grade", "acceleration"):
            ahead[name] *= direction
        creepages, limit = fleet.grip(ahead, np.abs(speed), direction * motor - braking)
        for i in np.flatnonzero(np.isnan(creepages) & moving).tolist():
            refused[i] = ValueError(beyond_grip(float(demand[i]), float(direction[i] * limit[i])))
        creepages = direction * np.where(moving & ~np.isnan(creepages), creepages, 0.0)
    else:
        creepages = np.zeros(fleet.size)
    omega = (speed + creepages * np.maximum(np.abs(speed), slowest)) / radius
    states["omega_left"] = states["omega_right"] = omega
    fleet.settle(inputs, states)
    _twist(scenarios, fleet, inputs, states, creepages)
    return Start(states, torque, refused)


def _twist(
    scenarios: Sequence[Scenario],
    fleet: kernel.NativeFleet,
    inputs: Any,
    states: Any,
    creepage: FloatArray,
) -> None:
    """Twist elastic axles and shafts such that both wheels keep their creepage."""
    if not any(scenario.drivetrain.vibrations for scenario in scenarios):
        return
    there = fleet.evaluate(inputs, states)
    for i, train in enumerate(scenario.drivetrain for scenario in scenarios):
        wheelset, axle, motor = train.without_rotor, train.axle, train.motor
        # d omega/dt = (1 + zeta)/r dV/dt
        gained = (1.0 + creepage[i] * np.sign(states["speed"][i])) / wheelset.radius
        gained *= there["speed_rate"][i]
        torque = states["drive_torque"][i] - motor.inertia_at_axle * gained
        if motor.shaft_stiffness is not None:
            states["motor_omega"][i] = states["omega_left"][i]
            states["shaft_twist"][i] = torque / motor.shaft_stiffness
        if axle is None:
            continue
        # J/2 d omega/dt = share T - T_brake/2 - r Q_left - b/2 omega - k twist
        lost = wheelset.radius * there["creep_force_left"][i]
        lost += 0.5 * wheelset.damping * states["omega_left"][i]
        lost += 0.5 * wheelset.inertia * gained
        given = axle.drive_share * torque
        given -= 0.5 * states["brake_torque"][i] * states["pads_left"][i]
        states["twist"][i] = (given - lost) / axle.stiffness
