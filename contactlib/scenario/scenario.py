"""Scenario files: a vehicle, how it is driven, where, and by which controllers."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from contactlib.drivetrain import Axle, Drivetrain
from contactlib.parameters import Parameters, Quantity
from contactlib.profile import Profile
from contactlib.scenario.controllers import ControllerDesign, read_controllers
from contactlib.scenario.kept import Kept
from contactlib.scenario.model import build_model
from contactlib.scenario.reading import (
    IS_SWEEP,
    check_keys,
    in_file,
    model_path,
    named,
    parse,
    text,
)
from contactlib.scenario.scenario_sections import (
    LONGEST,
    DemandSection,
    HeldSpeedSection,
    MotorSection,
    RelaxationSection,
    ScenarioRunSection,
    TrackSection,
)
from contactlib.scenario.vehicle import vehicle_contents
from contactlib.table import CreepForceTable
from contactlib.track import Track
from contactlib.traction import Sensors, TractionController
from contactlib.wheelset import Wheelset

NEEDED = ("name", "source", "vehicle", "run", "demand", "controllers")
OPTIONAL = (
    "vehicle_changes",
    "axle",
    "motor",
    "contact_relaxation",
    "track",
    "held_speed",
    "sensors",
)


@dataclass(frozen=True, kw_only=True)
class Scenario(Parameters):
    """A drivetrain and what it is put through.

    Attributes
    ----------
    name, source : str
        What it is, and where its numbers come from.
    drivetrain : Drivetrain
        Vehicle, axle and motor.
    track : Track
        Friction over distance and time.
    demand : Profile
        Torque that the driver asks for over time [N.m].
    held_speed : Profile or None
        Speed over time that a roller rig holds [m/s]; None if, and only if, the wheelset is free.
    initial_speed, design_speed : float
        At the start, and the one that the controllers are designed for [m/s].
    duration : float
        [s].
    sensors : Sensors
        What the controllers see.
    controllers : mapping
        Controllers by name, in the order of the file, or designs of them.

    Raises
    ------
    ValueError
        If a value is out of range, what is given contradicts itself, or a controller cannot be
        designed.

    Notes
    -----
    ``dataclasses.replace`` makes a variant. What is a design is made anew for its drivetrain,
    sensors and design speed.
    """

    name: str
    source: str
    drivetrain: Drivetrain
    track: Track = field(default_factory=Track)
    demand: Profile
    held_speed: Profile | None = None
    initial_speed: Annotated[float, Quantity("m/s")]
    design_speed: Annotated[float, Quantity("m/s", above=0.0)]
    duration: Annotated[float, Quantity("s", above=0.0, at_most=LONGEST)]
    sensors: Sensors
    controllers: Mapping[str, TractionController | ControllerDesign]
    _designed: Mapping[str, TractionController] = field(
        init=False, repr=False, compare=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.held_speed is not None) != self.drivetrain.wheelset.speed_held:
            state = "held" if self.drivetrain.wheelset.speed_held else "free"
            raise ValueError(f"held_speed = {self.held_speed!r}: the wheelset's speed is {state}")
        if self.held_speed is not None and self.initial_speed != float(self.held_speed(0.0)):
            raise ValueError(
                f"initial_speed = {self.initial_speed!r} is not that of held_speed, "
                f"{float(self.held_speed(0.0))!r}"
            )
        if not self.controllers:
            raise ValueError("controllers must name at least one controller")
        designed: dict[str, TractionController] = {}
        for name, found in self.controllers.items():
            with named(f"controllers.{name}"):
                if isinstance(found, ControllerDesign):
                    found = found.build(self.drivetrain, self.design_speed, self.sensors)
                self.sensors.samples_of_delay(found.sample_time)
            designed[name] = found
        object.__setattr__(self, "controllers", MappingProxyType(dict(self.controllers)))
        object.__setattr__(self, "_designed", MappingProxyType(designed))

    def controller(self, name: str) -> TractionController:
        """One of the controllers, designed for this scenario.

        Raises
        ------
        ValueError
            If there is none of this name.
        """
        if name not in self.controllers:
            known = ", ".join(self.controllers)
            raise ValueError(f"controller = {name!r} is none of the scenario's: {known}")
        return self._designed[name]


def load_scenario(
    path: str | os.PathLike[str],
    *,
    table: CreepForceTable | None = None,
    progress: Callable[[float], object] = lambda part: None,
) -> Scenario:
    """Read a scenario file.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a shipped one such as ``"dry_wet_dry.toml"``. A file that it or
        its vehicle's names lies beside the one that names it or below, or is a shipped one.
    table : CreepForceTable, optional
        The law; if left out that of the vehicle's ``[law]`` section, or Carter and Griffith's.
    progress : callable
        Is told what part of the law's table has been built, which the cohesive law needs.

    Raises
    ------
    ModelError
        If the file or that of its vehicle is not valid; one line names file, key, value and limit.
    OSError
        If a file cannot be read.
    """
    with in_file(path):
        found = read_contents(path)
        return build_scenario(found.data, found.build_vehicle(table, progress))


@dataclass(frozen=True)
class ScenarioContents:
    """What a scenario's file and that of its vehicle say: enough to build it anywhere.

    Attributes
    ----------
    data : dict
        Of the scenario's file.
    vehicle : dict
        Of the vehicle's, with the scenario's changes.
    label : str
        What a message calls the vehicle.
    folder : str
        Of the file that names the file of the vehicle's law, if it has one.
    """

    data: dict[str, Any]
    vehicle: dict[str, Any]
    label: str
    folder: str  # no path: those of one system cannot be sent to another

    def build_vehicle(
        self, table: CreepForceTable | None, progress: Callable[[float], object]
    ) -> Wheelset:
        """The wheelset, once the whole model file is seen to be right."""
        with in_file(self.label):
            return build_model(self.vehicle, Path(self.folder), table, progress).wheelset


def read_contents(path: str | os.PathLike[str]) -> ScenarioContents:
    """Contents of a scenario file, with those of its vehicle.

    Raises
    ------
    ValueError
        If the file is not TOML or lacks what a scenario needs.
    OSError
        If a file cannot be read.
    """
    file = model_path(path)
    data = parse(file)
    if "axes" in data:
        raise ValueError(IS_SWEEP)
    if "vehicle" not in data and "contact" in data:
        raise ValueError(
            "is a model, not a scenario: contactlib.load_model reads it; a scenario names its "
            "model file with the key 'vehicle'"
        )
    check_keys("", data, [*NEEDED, *OPTIONAL], NEEDED)
    label, vehicle, folder = vehicle_contents(data, file.parent)
    return ScenarioContents(data, vehicle, label, str(folder))


def build_scenario(
    data: Mapping[str, Any],
    wheelset: Wheelset,
    controllers: Mapping[str, TractionController | ControllerDesign] | None = None,
    kept: Kept | None = None,
) -> Scenario:
    """Scenario of a file's contents, with its own controllers or others.

    What `kept` has of a scenario before and would come out the same is not made anew.

    Raises
    ------
    ValueError
        As one line, if a section or key is wrong.
    """
    kept = kept or Kept()
    name, source = (text(key, data[key]) for key in ("name", "source"))
    axle = kept.section("axle", Axle, data) if "axle" in data else None
    motor = kept.section("motor", MotorSection, data)
    relaxation = kept.section("contact_relaxation", RelaxationSection, data)
    drivetrain = kept("drivetrain", _drivetrain, wheelset, axle, motor, relaxation)
    run = kept.section("run", ScenarioRunSection, data)
    demand = kept("demand", _demand, kept.section("demand", DemandSection, data))
    track = kept("track", _track, kept.section("track", TrackSection, data))
    held = kept.section("held_speed", HeldSpeedSection, data) if "held_speed" in data else None
    initial_speed, held_speed = kept("speeds", _speeds, run, held, wheelset.speed_held)
    design_speed = initial_speed if run.design_speed is None else run.design_speed
    if design_speed < wheelset.element.minimum_speed:
        given = "is missing, and the initial speed" if run.design_speed is None else "="
        raise ValueError(
            f"run.design_speed {given} {design_speed!r} is out of range: controllers are designed "
            f"for a speed >= the minimum speed {wheelset.element.minimum_speed!r}"
        )
    return Scenario(
        name=name,
        source=source,
        drivetrain=drivetrain,
        track=track,
        demand=demand,
        held_speed=held_speed,
        initial_speed=initial_speed,
        design_speed=design_speed,
        duration=run.duration,
        sensors=kept.section("sensors", Sensors, data),
        controllers=read_controllers(data["controllers"]) if controllers is None else controllers,
    )


def _drivetrain(
    wheelset: Wheelset, axle: Axle | None, motor: MotorSection, relaxation: RelaxationSection
) -> Drivetrain:
    return Drivetrain(wheelset, axle=axle, motor_lag=motor.lag, relaxation_length=relaxation.length)


def _demand(section: DemandSection) -> Profile:
    with named("demand"):
        return section.build()


def _track(section: TrackSection) -> Track:
    with named("track"):
        return section.build()


def _speeds(
    run: ScenarioRunSection, section: HeldSpeedSection | None, speed_held: bool
) -> tuple[float, Profile | None]:
    """Speed at the start, and the one over time that a roller rig holds."""
    if section is not None and not speed_held:
        raise ValueError("held_speed needs a vehicle without wheelset.mass: a roller rig")
    if (section is None) == (run.initial_speed is None):
        both = "both are" if section is not None else "none is"
        raise ValueError(f"run.initial_speed and held_speed: give one of them; {both} given")
    if section is None:
        initial = float(run.initial_speed or 0.0)
        return initial, Profile.of(initial) if speed_held else None
    with named("held_speed"):
        held = section.build()
    return float(held(0.0)), held
