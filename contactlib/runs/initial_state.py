"""Initial states of runs: each wheelset is steady under its first demand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.files.scenario import Scenario
from contactlib.vehicle.creep_curve import beyond_grip

ROUNDS = 5  # in which the rim's speed and the friction of a brake's pads find each other


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
    brakes = [scenario.drivetrain.brake for scenario in scenarios]
    braked = np.array([brake is not None for brake in brakes])
    torque = np.where(moving, demand, 0.0)
    motor = np.where(braked, np.maximum(torque, 0.0), torque)
    states["drive_torque"] = motor
    states["brake_torque"] = braking = np.where(braked, np.maximum(-demand, 0.0), 0.0)
    states["pads_left"] = states["pads_right"] = np.where(braked, np.sign(speed), 0.0)

    padded = any(brake is not None and brake.pads is not None for brake in brakes)
    ahead = inputs.copy()  # as seen in the direction of motion
    for name in ("grade", "acceleration"):
        ahead[name] *= direction
    refused: dict[int, ValueError] = {}
    creepages = np.full(fleet.size, creepage or 0.0)
    for _ in range(ROUNDS if padded else 1):
        if creepage is None and moving.any():
            creepages, limit = fleet.grip(ahead, np.abs(speed), direction * motor - braking)
            beyond = np.isnan(creepages) & moving
            refused = {
                i: ValueError(beyond_grip(float(demand[i]), float(direction[i] * limit[i])))
                for i in np.flatnonzero(beyond).tolist()
            }
            creepages = direction * np.where(moving & ~beyond, creepages, 0.0)
        omega = (speed + creepages * np.maximum(np.abs(speed), slowest)) / radius
        states["omega_left"] = states["omega_right"] = omega
        if padded:
            braking = states["brake_torque"] * fleet.evaluate(inputs, states)["pad_friction"]
    fleet.settle(inputs, states)
    _twist(scenarios, fleet, inputs, states, creepages, braking)
    return Start(states, torque, refused)


def _twist(
    scenarios: Sequence[Scenario],
    fleet: kernel.NativeFleet,
    inputs: Any,
    states: Any,
    creepage: FloatArray,
    braking: FloatArray,
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
        given -= 0.5 * braking[i] * states["pads_left"][i]
        states["twist"][i] = (given - lost) / axle.stiffness
