"""A scenario or model file as a study: its runs by controller, and what analysis predicts."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType

from contactlib.files.model import Model, load_model
from contactlib.files.reading import file_kind
from contactlib.files.scenario import Scenario, check_names, load_scenario
from contactlib.runs.result import Result
from contactlib.runs.scenario_runs import run_scenario
from contactlib.runs.signals import UNITS
from contactlib.runs.simulation import simulate
from contactlib.stability import controllability, worst_pole
from contactlib.traction import Sensors
from contactlib.traction.interface import Controller
from contactlib.vehicle.available_force import available_force
from contactlib.vehicle.continuous_control import ContinuousController
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.wheelset import Wheelset

Run = Callable[[Callable[[float], object]], Result]


@dataclass(frozen=True, kw_only=True)
class Study:
    """Runs of one drivetrain that can be compared.

    Attributes
    ----------
    name, source : str
        Title, and the origin of the numbers.
    drivetrain : Drivetrain
        The drivetrain of all runs.
    measured : str
        Description of the sensors; empty if the controllers see the true state.
    runs : mapping
        Functions by the controller's name; each takes a progress callback, which is called with
        the fraction done, and returns a result with the signals of a scenario run.
    outlook : tuple of str
        Lines that say whether a loop with these delays can hold the falling branch.
    """

    name: str
    source: str
    drivetrain: Drivetrain
    measured: str
    runs: Mapping[str, Run]
    outlook: tuple[str, ...]

    def chosen(self, control: str | None, every: bool) -> dict[str, Run]:
        """Return all runs, the one of this name, or the first.

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
    controllers: Mapping[str, Controller] = MappingProxyType({}),
    progress: Callable[[float], object] = lambda part: None,
) -> Study:
    """Read a scenario or model file.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a shipped one.
    seed : int, optional
        Seed of the sensors' noise. Default: the file's. A model has no noise.
    controllers : mapping, optional
        Controllers of the user's own by name, beside those of a scenario.
    progress : callable, optional
        As for `contactlib.load_model`.

    Raises
    ------
    ModelError
        If the file is not valid; a line for each mistake names file, key,
        value and limit.
    ValueError
        If the scenario has a controller of such a name, or the file is no scenario.
    OSError
        If the file cannot be read.
    """
    if file_kind(path) == "scenario":
        scenario = load_scenario(path, progress=progress)
        if seed is not None:
            scenario = replace(scenario, sensors=replace(scenario.sensors, seed=float(seed)))
        return _of_scenario(with_controllers(path, scenario, controllers))
    if controllers:
        raise ValueError(f"{path} is no scenario: a controller of your own runs in one")
    return _of_model(load_model(path, progress=progress))


def with_controllers(
    path: str | os.PathLike[str], scenario: Scenario, controllers: Mapping[str, Controller]
) -> Scenario:
    """Add controllers of the user's own to the scenario of a file.

    Raises
    ------
    ValueError
        If the scenario has a controller of such a name.
    """
    if taken := set(controllers) & set(scenario.controllers):
        raise ValueError(f"{path} has a controller {min(taken)} itself: take another name")
    every = {**scenario.controllers, **controllers}
    check_names(every)
    return replace(scenario, controllers=every)


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
            + _errors(sensors)
        ),
        runs=MappingProxyType({name: partial(run, name) for name in scenario.controllers}),
        outlook=tuple(outlook(scenario)),
    )


def _errors(sensors: Sensors) -> str:
    """Systematic errors of the sensors that have any."""
    told = {
        f"bias of the vehicle speed {100 * sensors.vehicle_speed_bias:.3g} %": (
            sensors.vehicle_speed_bias
        ),
        f"its drift {sensors.vehicle_speed_drift:.3g} m/s2": sensors.vehicle_speed_drift,
        f"error of the wheel diameter {100 * sensors.wheel_diameter_error:.3g} %": (
            sensors.wheel_diameter_error
        ),
        f"encoder with {sensors.encoder_pulses:g} pulses": sensors.encoder_pulses,
    }
    found = ", ".join(text for text, value in told.items() if value)
    return f" {found[0].upper()}{found[1:]}." if found else ""


def outlook(scenario: Scenario) -> list[str]:
    """Tell for each sample time, on the worst and best friction, if the falling branch can be held.

    A line names the steepest point of the falling branch at the design speed, its pole, and the
    gains that hold it with the delays of the loop.
    """
    drivetrain, speed = scenario.drivetrain, scenario.design_speed
    lines = []
    for sample_time in sorted(
        {scenario.controller(name).sample_time for name in scenario.controllers}
    ):
        for friction, slope in sorted({scenario.track.lowest, scenario.track.highest}):
            wheelset = drivetrain.wheelset.with_slope(slope)
            worst = worst_pole(wheelset, speed=speed, friction_scale=friction)
            where = f"at {speed:g} m/s, friction factor {friction:g}"
            where += "" if slope == 1.0 else f", slope factor {slope:g}"
            if worst.pole <= 0.0:
                lines.append(f"{where}: no branch on which a constant torque runs away")
                continue
            verdict = controllability(
                worst.pole,
                delay=scenario.sensors.delay,
                lag=drivetrain.motor.lag,
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

    def run(controller: ContinuousController, progress: Callable[[float], object]) -> Result:
        found = simulate(
            model.wheelset, controller, initial_speed=model.initial_speed, progress=progress
        )
        return as_scenario_run(found, model.wheelset)

    controls: dict[str, ContinuousController] = {
        "torque": model.torque_control,
        "creep": model.creep_control,
    }
    return Study(
        name=model.name,
        source=model.source,
        drivetrain=drivetrain,
        measured="",
        runs=MappingProxyType({name: partial(run, c) for name, c in controls.items()}),
        outlook=(),
    )


def as_scenario_run(result: Result, wheelset: Wheelset) -> Result:
    """Give a run of `simulate` the signals of a scenario run."""
    available = available_force(
        wheelset.element,
        **{name: result[name] for name in ("speed", "normal_load", "friction_scale")},
    )
    known = {**result.signals, "available_force": available}
    return Result(result.time, {name: known[name] for name in UNITS}, UNITS, result.events)
