"""What a file can run: its controllers, and what is known before they are tried."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from contactlib.controllers import Controller, CreepControl
from contactlib.drivetrain import Drivetrain
from contactlib.fleet import UNITS
from contactlib.parameters import FloatArray
from contactlib.peak_force import available_force
from contactlib.scenario import Model, Scenario, is_scenario, load_model, load_scenario
from contactlib.simulation import Result, simulate
from contactlib.stability import controllability, worst_pole
from contactlib.traction_run import run_scenario
from contactlib.wheelset import Wheelset

Run = Callable[[Callable[[float], object]], Result]


@dataclass(frozen=True, kw_only=True)
class Study:
    """Runs that can be compared.

    Attributes
    ----------
    name, source : str
        What it is, and where its numbers come from.
    drivetrain : Drivetrain
        What is driven.
    measured : str
        What the controllers see, in words; empty if that is the truth.
    runs : mapping
        By the controller's name; each takes a function that is told the part done, and returns a
        result with the signals of a scenario's run.
    outlook : tuple of str
        What can be said before anything runs: whether a loop with these delays can hold the
        falling branch.
    """

    name: str
    source: str
    drivetrain: Drivetrain
    measured: str
    runs: Mapping[str, Run]
    outlook: tuple[str, ...]

    def chosen(self, control: str | None, every: bool) -> dict[str, Run]:
        """All runs, or the one of this name, or the first.

        Raises
        ------
        ValueError
            If there is no run of this name.
        """
        if every:
            return dict(self.runs)
        name = next(iter(self.runs)) if control is None else control
        if name not in self.runs:
            raise ValueError(f"control = {name!r} must be one of: {', '.join(self.runs)}")
        return {name: self.runs[name]}


def open_study(
    path: str | os.PathLike[str],
    *,
    seed: int | None = None,
    progress: Callable[[float], object] = lambda part: None,
) -> Study:
    """Read a scenario or model file.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a shipped one.
    seed : int, optional
        Of the sensors' noise, instead of the file's; a model has none.
    progress : callable, optional
        Is told what part of the law's table has been built, which the cohesive law needs.

    Raises
    ------
    ModelError
        If the file is not valid; one line names file, key, value and limit.
    OSError
        If it cannot be read.
    """
    if is_scenario(path):
        scenario = load_scenario(path, progress=progress)
        if seed is not None:
            scenario = replace(scenario, sensors=replace(scenario.sensors, seed=float(seed)))
        return _of_scenario(scenario)
    return _of_model(load_model(path, progress=progress))


def _of_scenario(scenario: Scenario) -> Study:
    def run(name: str, progress: Callable[[float], object]) -> Result:
        return run_scenario(scenario, name, progress=progress)

    sensors = scenario.sensors
    return Study(
        name=scenario.name,
        source=scenario.source,
        drivetrain=scenario.drivetrain,
        measured=(
            f"Sensors: delay {1e3 * sensors.delay:.3g} ms, noise {sensors.wheel_speed_noise:.2g} "
            f"and {sensors.vehicle_speed_noise:.2g} m/s on wheel and vehicle speed."
        ),
        runs=MappingProxyType({name: partial(run, name) for name in scenario.controllers}),
        outlook=tuple(outlook(scenario)),
    )


def outlook(scenario: Scenario) -> list[str]:
    """Whether the falling branch can be held, for each sample time, on the worst and best friction.

    A line names the steepest point of the falling branch at the design speed, its pole, and what
    the loop's delays leave of the gains that hold it.
    """
    drivetrain, speed = scenario.drivetrain, scenario.design_speed
    track = scenario.track
    sides = [track.friction_left, track.friction_right or track.friction_left]
    over_time = track.friction_over_time.value
    factors = [v * t for side in sides for v in side.value for t in over_time]
    lines = []
    for sample_time in sorted(
        {scenario.controller(name).sample_time for name in scenario.controllers}
    ):
        for friction in sorted({min(factors), max(factors)}):
            worst = worst_pole(drivetrain.wheelset, speed=speed, friction_scale=friction)
            where = f"at {speed:g} m/s, friction factor {friction:g}"
            if worst.pole <= 0.0:
                lines.append(f"{where}: no branch on which a constant torque runs away")
                continue
            verdict = controllability(
                worst.pole,
                delay=scenario.sensors.delay,
                lag=drivetrain.motor_lag,
                relaxation=drivetrain.relaxation_length / speed,
                sample_time=sample_time,
            )
            stay = "; control has to stay on the rising branch" if verdict.window.empty else ""
            lines.append(
                f"falling branch {where}, creepage {100.0 * worst.creepage:.3g} %: "
                f"{verdict.text}{stay}"
            )
    return lines


def _of_model(model: Model) -> Study:
    drivetrain = Drivetrain(model.wheelset)

    def run(controller: Controller, progress: Callable[[float], object]) -> Result:
        found = simulate(
            model.wheelset, controller, initial_speed=model.initial_speed, progress=progress
        )
        return as_scenario_run(found, drivetrain, controller)

    controls: dict[str, Controller] = {"torque": model.torque_control, "creep": model.creep_control}
    return Study(
        name=model.name,
        source=model.source,
        drivetrain=drivetrain,
        measured="",
        runs=MappingProxyType({name: partial(run, c) for name, c in controls.items()}),
        outlook=(),
    )


def _acceleration(wheelset: Wheelset, known: Mapping[str, Any]) -> FloatArray:
    """dV/dt in each row of a run [m/s2]."""
    names = ("omega", "speed", "drive_torque", "normal_load", "friction_scale", "resistance_force")
    rows = np.column_stack([known[name] for name in names]).tolist()
    return np.array([wheelset.rates(*row)[0].speed_rate for row in rows])


def as_scenario_run(result: Result, drivetrain: Drivetrain, controller: Controller) -> Result:
    """A run of one rigid wheelset under a continuous controller, with a scenario run's signals.

    What creep control would like to have is its largest torque.
    """
    wheelset = drivetrain.wheelset
    known: dict[str, Any] = dict(result.signals)
    demand = known["drive_torque"]
    if isinstance(controller, CreepControl):
        demand = np.full_like(demand, controller.torque_max)
    speed = known["speed"]
    known |= {
        "demand": demand,
        "commanded_torque": known["drive_torque"],
        "axle_torque": np.zeros_like(speed),
        "acceleration": _acceleration(wheelset, known),
        "available_force": available_force(
            wheelset.element,
            speed=speed,
            normal_load=known["normal_load"],
            friction_scale=known["friction_scale"],
        ),
    }
    for side in ("left", "right"):
        known |= {
            f"omega_{side}": known["omega"],
            f"creepage_{side}": known["creepage"],
            f"creep_force_{side}": 0.5 * known["creep_force"],
            f"friction_scale_{side}": known["friction_scale"],
        }
    return Result(
        result.time,
        MappingProxyType({name: known[name] for name in UNITS}),
        MappingProxyType(UNITS),
        result.events,
    )
