"""One run of a scenario: a drivetrain under a sampled controller, stepped by the kernel.

The controller is asked every sample time and sees what the sensors tell; its torque is held in
between. Friction is held over each step at the factor in its middle; a step ends where friction
jumps, so that no stretch is too short to be met.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from contactlib import kernel
from contactlib.parameters import FINITE, POSITIVE, FloatArray, Limits, checked
from contactlib.peak_force import available_force
from contactlib.scenario import Scenario
from contactlib.simulation import WORK_UNITS, WORKS, Result, energy_defect, steady_creepage
from contactlib.traction import Measurement, TractionController

UNITS = {
    "demand": "N.m",
    "commanded_torque": "N.m",
    "drive_torque": "N.m",
    "axle_torque": "N.m",
    "omega": "rad/s",
    "omega_left": "rad/s",
    "omega_right": "rad/s",
    "speed": "m/s",
    "acceleration": "m/s2",
    "slip_velocity": "m/s",
    "creepage": "1",
    "creepage_left": "1",
    "creepage_right": "1",
    "creep_force": "N",
    "creep_force_left": "N",
    "creep_force_right": "N",
    "available_force": "N",
    "friction_scale_left": "1",
    "friction_scale_right": "1",
    "falling_branch": "1",
    **WORK_UNITS,
}
MOST_ROWS = 10_000_000
LONGEST_STEP = 5e-3  # of rows and friction if nothing else is asked for [s]


def run_scenario(
    scenario: Scenario,
    controller: str | TractionController,
    *,
    initial_creepage: float | None = None,
    step: float | None = None,
    tolerance: float = 1e-8,
    progress: Callable[[float], object] = lambda part: None,
) -> Result:
    """Drive a scenario under one controller.

    Parameters
    ----------
    scenario : Scenario
        Vehicle, track, demand and sensors.
    controller : str or TractionController
        One of the scenario's by its name, or any other.
    initial_creepage : float, optional
        [1]. Left out, the run starts steady under the first demand, and rolling if it starts at
        standstill or backward.
    step : float, optional
        Time between rows, and for which friction is held [s]; rounded down to a whole part of the
        sample time. The sample time, but at most 5 ms and a twentieth of the axle's vibration, if
        left out.
    tolerance : float, optional
        Relative error of each of the integrator's substeps [1].
    progress : callable, optional
        Is told the part of the duration that is done, from 0 to 1.

    Returns
    -------
    Result
        Signals of `UNITS`, to the last whole step of the duration. Rows are `step` apart; torques
        are those of the step that follows.

    Raises
    ------
    ValueError
        If a value is out of range, the scenario has no controller of this name, the delay is not a
        whole number of samples, or no steady state has the first demand.
    RuntimeError
        If the integrator gives up.
    """
    control = scenario.controller(controller) if isinstance(controller, str) else controller
    longest = min(control.sample_time, LONGEST_STEP) if step is None else step
    if step is None and scenario.drivetrain.axle is not None:
        longest = min(longest, 2.0 * math.pi / scenario.drivetrain.torsional_frequency / 20.0)
    checked("step", longest, POSITIVE)
    checked("tolerance", tolerance, Limits(at_least=1e-12, at_most=1e-2))
    per_sample = max(1, math.ceil(control.sample_time / longest * (1.0 - 1e-9)))
    length = control.sample_time / per_sample
    rows = max(2, math.floor(scenario.duration / length * (1.0 + 1e-9)) + 1)
    if rows > MOST_ROWS:
        raise ValueError(
            f"duration = {scenario.duration!r} has {rows} steps of {length:.6g} s: "
            f"at most {MOST_ROWS}"
        )
    time = length * np.arange(rows, dtype=np.float64)
    demand = scenario.demand(time[::per_sample])
    inputs = np.zeros(rows, kernel.drivetrain_dtype("input"))
    states = np.zeros(rows, kernel.drivetrain_dtype("state"))
    wheelset = scenario.drivetrain.wheelset
    fleet = kernel.NativeFleet([scenario.drivetrain.member(scenario.track.native)])
    load = 0.5 * wheelset.element.contact.normal_load
    inputs["load_left"] = inputs["load_right"] = load
    if scenario.held_speed is not None:
        speeds = scenario.held_speed(np.append(time, time[-1] + length))
        inputs["acceleration"] = np.diff(speeds) / length

    inputs["friction_left"][0], inputs["friction_right"][0] = scenario.track.friction_scale(
        0.0, 0.0
    )
    state, torque = _start(scenario, inputs[:1], float(demand[0]), initial_creepage)
    reader = scenario.sensors.reader(1, control.sample_time)
    memory: Any = None
    substep = np.zeros(1)
    for i in range(rows):
        given = inputs[i : i + 1]
        if i % per_sample == 0:
            rim = 0.5 * wheelset.radius * (state["omega_left"] + state["omega_right"])
            asked = demand[i // per_sample : i // per_sample + 1]
            measured = Measurement(asked, *reader.read(rim, state["speed"]))
            if memory is None:
                memory = control.start(measured, torque)
            torque, memory = control.sample(measured, memory)
            checked(f"torque of {type(control).__name__} at {time[i]:.6g} s", torque, FINITE)
            progress(i / rows)
        given["commanded_torque"] = torque
        states[i] = state[0]
        fleet.advance(given, state, time[i], length if i < rows - 1 else 0.0, tolerance, substep)
    progress(1.0)
    return _result(scenario, time, np.repeat(demand, per_sample)[:rows], inputs, states)


def _start(
    scenario: Scenario, given: Any, demand: float, initial_creepage: float | None
) -> tuple[Any, FloatArray]:
    """State and torque at the start, under the inputs of the first row but for the torque."""
    drivetrain, speed = scenario.drivetrain, scenario.initial_speed
    wheelset, axle = drivetrain.wheelset, drivetrain.axle
    slowest = wheelset.element.minimum_speed
    creepage, torque = 0.0, demand if speed >= slowest else 0.0
    if initial_creepage is not None:
        creepage = initial_creepage
    elif speed >= slowest:
        friction = float(given["friction_left"][0]), float(given["friction_right"][0])
        load = wheelset.element.contact.normal_load
        turning = wheelset.inertia / wheelset.radius * float(given["acceleration"][0])
        for _ in range(4):  # of a rig that gains speed; (1 + zeta) is all but one
            left = demand - (1.0 + creepage) * turning
            creepage = steady_creepage(
                wheelset, left, speed=speed, normal_load=load, friction_scale=friction
            )
            if not turning:
                break
    state = np.zeros(1, kernel.drivetrain_dtype("state"))
    state["speed"] = speed
    state["omega_left"] = state["omega_right"] = (
        speed + creepage * max(abs(speed), slowest)
    ) / wheelset.radius
    state["relaxed_left"] = state["relaxed_right"] = creepage
    state["drive_torque"] = torque
    if axle is not None:
        # J/2 (1 + zeta)/r dV/dt = share T - r Q_left - b/2 omega - k twist
        there = drivetrain.native.evaluate(given, state)
        half, gained = 0.5 * wheelset.inertia, (1.0 + creepage) / wheelset.radius
        lost = wheelset.radius * there["creep_force_left"]
        lost = lost + 0.5 * wheelset.damping * state["omega_left"]
        lost = lost + half * gained * there["speed_rate"]
        state["twist"] = (axle.drive_share * torque - lost) / axle.stiffness
    return state, np.array([torque])


def _result(
    scenario: Scenario, time: FloatArray, demand: FloatArray, inputs: Any, states: Any
) -> Result:
    drivetrain = scenario.drivetrain
    outputs = drivetrain.native.evaluate(inputs, states)
    radius, speed = drivetrain.wheelset.radius, states["speed"]
    omega = 0.5 * (states["omega_left"] + states["omega_right"])
    frictions = {f"friction_scale_{side}": inputs[f"friction_{side}"] for side in ("left", "right")}
    available = available_force(
        drivetrain.wheelset.element,
        speed=speed,
        friction_scale=inputs["friction_left"],
        other_friction_scale=inputs["friction_right"],
    )
    found: Mapping[str, FloatArray] = {
        "demand": demand,
        "commanded_torque": inputs["commanded_torque"],
        "omega": omega,
        "slip_velocity": radius * omega - speed,
        "acceleration": outputs["speed_rate"],
        "creepage": 0.5 * (outputs["creepage_left"] + outputs["creepage_right"]),
        "creep_force": outputs["creep_force_left"] + outputs["creep_force_right"],
        "available_force": available,
        "falling_branch": np.maximum(outputs["falling_left"], outputs["falling_right"]),
        **frictions,
        **{name: states[name] for name in ("omega_left", "omega_right", "speed", "distance")},
        **{name: states[name] for name in WORKS},
        **{name: outputs[name] for name in outputs.dtype.names or () if name in UNITS},
    }
    signals = {name: np.array(values, dtype=np.float64) for name, values in found.items()}
    signals["energy_defect"] = energy_defect(signals)
    return Result(
        time,
        MappingProxyType({name: signals[name] for name in UNITS}),
        MappingProxyType(UNITS),
    )
