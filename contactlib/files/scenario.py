"""Scenario files: a vehicle (a model file with changes), its demand, track and controllers.

The controllers are the sampled ones of `contactlib.traction` and, where nothing acts between them
and the wheels, the continuous ones of `contactlib.vehicle`.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from contactlib.base.quantities import (
    FloatArray,
    Parameters,
    Quantity,
    ReadOnly,
    checked_number,
    checks_call,
    declared,
)
from contactlib.base.text import known_names
from contactlib.base.units import STANDARD_GRAVITY, unit_value
from contactlib.files.brake_pads import brake_of, with_pads
from contactlib.files.mistakes import Mistakes
from contactlib.files.model import LOAD_RATIO, BuildCache, build_model, read_model
from contactlib.files.rail_conditions import (
    SLOPE,
    TrackConditions,
    factors_of_conditions,
    with_condition,
    with_condition_file,
)
from contactlib.files.reading import (
    IS_SWEEP,
    check_keys,
    drop_warning,
    file_beside,
    in_file,
    loading,
    model_path,
    named,
    note_warning,
    parse,
    read_section,
    subsection,
    text,
    title,
)
from contactlib.files.sections import VEHICLE_SECTIONS, Keys, arguments, optional, without
from contactlib.files.track_map import track_of, with_track_map
from contactlib.table.creep_force_table import CreepForceTable
from contactlib.traction import CONTROLLERS, Sensors, TractionController
from contactlib.traction.interface import Controller, checked_controller
from contactlib.vehicle.continuous_control import (
    ContinuousController,
    CreepControl,
    TorqueControl,
    creepage_over_time,
)
from contactlib.vehicle.driver import Driver
from contactlib.vehicle.drivetrain import Axle, Brake, Drivetrain, Motor, Sanding
from contactlib.vehicle.dynamic_load import DynamicLoad
from contactlib.vehicle.peak_friction import at_speed, with_peaks
from contactlib.vehicle.track import TIME, Profile, Track, Values, Variation, profile_of
from contactlib.vehicle.vehicle import Vehicle
from contactlib.vehicle.wheelset import Wheelset

RESERVED = ("comparison", "metrics")  # files of a report that are not of one run
SPEED = Quantity("m/s", at_least=-500.0, at_most=500.0, usual=(-170.0, 170.0))
TERMS = "torque", "deceleration", "brake_force", "pressure"  # of a demand
MASS_RATIO = 1.25  # of a train and of that of its resistance, beyond which they are doubted
NEEDED = ("name", "source", "wheelset", "run", "demand", "controllers")
CONTINUOUS: Mapping[str, type[ContinuousController]] = {
    "torque_control": TorqueControl,
    "creep_control": CreepControl,
}
KINDS: Mapping[str, Keys] = {  # of controllers, with their keys; torque control follows the demand
    **{kind: declared(controller) for kind, controller in CONTROLLERS.items()},
    "torque_control": {},
    "creep_control": {**declared(creepage_over_time), **declared(CreepControl)},
}


@dataclass(frozen=True)
class ControllerDesign:
    """A controller with some fields given; a sampled one designs the others.

    Attributes
    ----------
    kind : str
        One of `contactlib.traction.CONTROLLERS`, ``"torque_control"`` or ``"creep_control"``.
    given : mapping
        Fields that are not designed.
    """

    kind: str
    given: Mapping[str, Any]

    def build(self, scenario: Scenario) -> TractionController | ContinuousController:
        """Design the controller for a scenario's drivetrain, design speed and sensors.

        Raises
        ------
        ValueError
            If a value is out of range, or the design has no solution.
        """
        if self.kind == "torque_control":
            return TorqueControl(scenario.demand)
        if self.kind == "creep_control":
            return CreepControl(
                reference=creepage_over_time(**arguments(creepage_over_time, self.given)),
                **arguments(CreepControl, self.given),
            )
        return CONTROLLERS[self.kind].for_drivetrain(
            scenario.drivetrain,
            speed=scenario.design_speed,
            sensors=scenario.sensors,
            **self.given,
        )


def check_names(names: Collection[str]) -> None:
    """Refuse names of controllers that cannot be names of files."""
    for name in names:
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", name) or name.lower() in RESERVED:
            raise ValueError(
                f"controllers.{name!r} is not a name for a controller: it must have 1 to 64 ASCII "
                f"letters, digits, _ or -, and not be one of: {', '.join(RESERVED)}"
            )
    if len({name.lower() for name in names}) < len(names):
        raise ValueError("controllers: names must differ in more than capital letters, as files do")


def read_controllers(sections: object) -> dict[str, ControllerDesign]:
    """Read the controllers by name."""
    named_sections = subsection("controllers", sections)
    check_names(named_sections)
    with Mistakes(named_sections) as mistakes:
        return {
            name: mistakes.of(_read_design, f"controllers.{name}", section)
            for name, section in named_sections.items()
        }


def _read_design(where: str, section: object) -> ControllerDesign:
    table = subsection(where, section)
    if "kind" not in table:
        raise ValueError(f"{where}.kind is missing; it is one of: {', '.join(KINDS)}")
    kind = text(f"{where}.kind", table["kind"])
    if kind not in KINDS:
        raise ValueError(f"{where}.kind = {kind!r} is not known; {known_names(kind, KINDS)}")
    whole = kind in CONTINUOUS  # nothing of it is designed
    return ControllerDesign(kind, read_section(where, KINDS[kind], table, ("kind",), whole=whole))


def vehicle_contents(data: Mapping[str, Any], folder: Path) -> tuple[str, dict[str, Any], Path]:
    """Read a scenario's wheelset: label for messages, file contents with changes, and folder.

    The folder is that of the file that names the law's data: the scenario's if a change does.
    """
    name = text("wheelset", data["wheelset"])
    changes = subsection("wheelset_changes", data.get("wheelset_changes", {}))
    check_keys("wheelset_changes.", changes, VEHICLE_SECTIONS, ())
    with Mistakes(changes) as mistakes:
        changed = {
            name: mistakes.of(
                read_section, f"wheelset_changes.{name}", VEHICLE_SECTIONS[name], table, whole=False
            )
            for name, table in changes.items()
        }
    label = f"wheelset {name} changed" if changed else f"wheelset {name}"
    with in_file(label):
        file = file_beside("wheelset", name, folder, "the scenario")
        vehicle = with_condition_file(parse(file), file.parent)
        changed = with_condition_file(changed, folder)
        if "demand" not in vehicle:  # else `build_model` refuses it as a scenario
            if "condition" in changed.get("friction", {}):  # it replaces the vehicle's own rails
                body = subsection("wheelset", vehicle.get("wheelset", {}))
                vehicle |= {"friction": {}, "wheelset": without(body, *SLOPE)}
            for section, keys in changed.items():
                vehicle[section] = {**subsection(section, vehicle.get(section, {})), **keys}
            vehicle = dict(with_condition(vehicle))  # so that a sweep finds its numbers
    return label, vehicle, folder if "file" in changed.get("law", {}) else file.parent


@dataclass(frozen=True, kw_only=True)
class Scenario(Parameters):
    """A drivetrain with its track, torque demand, sensors and traction controllers.

    Attributes
    ----------
    name, source : str
        Title, and the origin of the numbers.
    drivetrain : Drivetrain
        Wheelset, axle, motor and brake; those of each axle of a vehicle.
    vehicle : Vehicle or None
        Vehicle with one or more such axles; None for a wheelset by itself. The mass of each
        wheelset is its share of the vehicle's.
    track : Track
        Friction, slope, grade and speed limit over distance, and friction over time.
    variation : Variation or None
        Random factor on that friction; `rails` has it.
    dynamic_load : DynamicLoad or None
        Factor on the static load of both wheels over time; None if the load is static.
    demand : Profile
        The driver's torque demand over time [N.m].
    driver : Driver or None
        Driver who keeps the track's speed limits; None: the demand of traction falls near them.
    held_speed : Profile or None
        Speed of the roller rig over time [m/s]; None if, and only if, the wheelset is free.
    initial_speed : float
        Forward speed at the start [m/s]. Omit it in a file if, and only if, the file gives
        `held_speed`.
    design_speed : float
        Speed at which the controllers are designed [m/s]. A file's default: that at the
        start.
    duration : float
        Duration of a run [s].
    start : str, optional
        State at 0 s: "applied", steady under the first demand, with the brake filled if that
        brakes; or "released", coasting, so that motor and brake follow a first demand with their
        lags. Default: "applied".
    sensors : Sensors
        Delay and errors of the speeds that the controllers measure.
    controllers : mapping
        Controllers, or designs of them, by name in the order of the file. A continuous one applies
        its torque to the wheels directly and uses their true state, so it needs a scenario without
        axle, motor, brake, track and dynamic load, and with a constant held speed.
    speed_unit : str
        Unit in which the file gives the speed at the start, "m/s" or "km/h", and figures show all.

    Raises
    ------
    ValueError
        If a value is out of range, values contradict each other, or a controller cannot be
        designed.

    Notes
    -----
    ``dataclasses.replace`` makes a variant, for whose drivetrain, sensors and design speed every
    `ControllerDesign` is designed again.
    """

    name: str
    source: str
    drivetrain: Drivetrain
    vehicle: Vehicle | None = None
    track: Track = field(default_factory=Track)
    variation: Variation | None = None
    dynamic_load: DynamicLoad | None = None
    demand: Profile
    driver: Driver | None = None
    held_speed: Profile | None = None
    initial_speed: Annotated[float, SPEED]
    design_speed: Annotated[float, replace(SPEED, above=0.0, at_least=-math.inf)]
    duration: Annotated[float, Quantity("s", above=0.0, at_most=1e6)]
    start: Literal["applied", "released"] = "applied"
    sensors: Sensors
    controllers: Mapping[str, Controller | ContinuousController | ControllerDesign]
    speed_unit: str = "m/s"
    _designed: Mapping[str, Controller | ContinuousController] = field(
        init=False, repr=False, compare=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.held_speed is not None) != self.drivetrain.wheelset.speed_held:
            state = "held" if self.drivetrain.wheelset.speed_held else "free"
            raise ValueError(f"held_speed = {self.held_speed!r}: the wheelset's speed is {state}")
        if self.held_speed is not None and self.initial_speed != float(self.held_speed(0.0)):
            raise ValueError(
                f"initial_speed = {self.initial_speed!r} must equal held_speed at the start, "
                f"{float(self.held_speed(0.0))!r}"
            )
        if self.vehicle is not None:
            self._check_axles(self.vehicle)
        if self.driver is not None:
            self._check_driver(self.driver)
        sanded = self.drivetrain.sanding.axles if self.drivetrain.sanding else ()
        if max(sanded, default=0.0) > self.axles:
            raise ValueError(f"sanding.axles = {sanded!r} must be numbers from 1 to {self.axles}")
        if not self.controllers:
            raise ValueError("controllers must name at least one controller")
        designed: dict[str, Controller | ContinuousController] = {}
        for name, control in self.controllers.items():
            if not isinstance(control, ControllerDesign | ContinuousController):
                control = checked_controller(f"controllers.{name}", control)
            with named(f"controllers.{name}"):
                if isinstance(control, ControllerDesign):
                    control = control.build(self)
                if not isinstance(control, ContinuousController):
                    self.sensors.samples_of_delay(control.sample_time)
            if isinstance(control, ContinuousController):
                self.check_continuous(f"controllers.{name}")
            designed[name] = control
        object.__setattr__(self, "controllers", ReadOnly(self.controllers))
        object.__setattr__(self, "_designed", ReadOnly(designed))

    def _check_axles(self, vehicle: Vehicle) -> None:
        """Refuse what axles of a vehicle cannot have."""
        share = vehicle.mass / vehicle.axles
        if self.drivetrain.wheelset.mass != share:
            raise ValueError(
                f"drivetrain.wheelset.mass = {self.drivetrain.wheelset.mass!r} must be the "
                f"vehicle's mass over its number of axles, {share!r}"
            )
        if self.dynamic_load is not None:
            raise ValueError(
                "dynamic_load is for one wheelset: a vehicle's loads follow from its forces; leave "
                "out [dynamic_load] or [vehicle]"
            )

    def _check_driver(self, driver: Driver) -> None:
        """Refuse a driver who has nothing to keep."""
        limit = self.track.speed_limit
        if limit is None:
            raise ValueError(
                "driver keeps the speed limits of a track, which has none: give track.speed_limit "
                "or leave out [driver]"
            )
        if self.held_speed is not None:
            raise ValueError("driver needs a free speed: leave out [driver] or held_speed")
        with named("track.speed_limit"):
            limit.kept_by(driver.deceleration)

    @property
    def axles(self) -> int:
        """Number of axles, which share their speed."""
        return len(self.position)

    @property
    def position(self) -> Values:
        """Distance of each axle behind the first one [m]."""
        return (0.0,) if self.vehicle is None else self.vehicle.position

    @property
    def shares_of_demand(self) -> FloatArray:
        """Factors on the demand at each axle in traction and in braking, shape (2, axles)."""
        vehicle, every = self.vehicle, np.arange(1, self.axles + 1)
        acting = (vehicle.driven, vehicle.braked) if vehicle else ((), ())
        return np.array([np.isin(every, some or every) for some in acting], dtype=np.float64)

    @property
    def loads_change(self) -> bool:
        """Whether axles may have other loads than that for which their contact is given."""
        return self.vehicle is not None or self.dynamic_load is not None

    @property
    def static_load(self) -> float:
        """Load of an axle at rest, in a vehicle the mean of all [N]."""
        if self.vehicle is None:
            return self.drivetrain.wheelset.element.axle_load
        return self.vehicle.own_mass * STANDARD_GRAVITY / self.axles

    @cached_property
    def rails(self) -> Track:
        """The track as runs take it: in factors on friction, or with what gives them."""
        element, track = self.drivetrain.wheelset.element, self.track
        if self.variation is not None:
            survey = track.survey
            ends = sorted(survey.start + survey.sign * place for place in self._reach)
            with named("track.variation"):
                varied = self.variation.profile(*ends)
            track = replace(track, varied=varied.over_distance(survey))
        if track.unit == "adhesion":
            return with_peaks(track, element, loaded=self.loads_change)
        return track.in_factors(element.friction.kinetic)

    def rails_at(self, speed: float) -> Track:
        """The track in factors on friction, where they depend on it at a speed [m/s]."""
        speed = checked_number("speed", speed, SPEED)
        return at_speed(self.rails, self.drivetrain.wheelset.element, speed)

    @property
    def _reach(self) -> tuple[float, float]:
        """Smallest and largest distance that any axle can reach within the run [m]."""
        drivetrain, held = self.drivetrain, self.held_speed.value if self.held_speed else ()
        fastest, slowest = (
            max(map(abs, (self.initial_speed, *held))),
            max(map(abs, held), default=0.0),
        )
        brakes = drivetrain.brake is not None and max(self.demand.value) <= 0.0
        steepest = max(map(abs, (drivetrain.wheelset.resistance.grade, *self.track.grade.value)))
        # Friction and grades accelerate by no more, and no vehicle exceeds the limit of speeds.
        gained = STANDARD_GRAVITY * (2.0 * steepest + (not brakes)) * self.duration
        back, ahead = (
            self.duration * min(speed + 0.5 * gained, SPEED.at_most)
            for speed in (slowest, fastest)[:: -1 if self.initial_speed < 0.0 else 1]
        )
        return -back - self.position[-1], ahead

    @cached_property
    def on_uniform_friction(self) -> Scenario:
        """The scenario with its grades and controllers, on the friction of the wheelset's file."""
        return replace(self, track=self.rails.uniform, variation=None, controllers=self._designed)

    def check_continuous(self, name: str) -> None:
        """Refuse a continuous controller where something acts between it and the wheels."""
        between = {
            "[vehicle]": self.vehicle is not None,
            "[axle]": self.drivetrain.axle is not None,
            "[motor]": self.drivetrain.motor != Motor(),
            "[brake]": self.drivetrain.brake is not None,
            "[sanding]": self.drivetrain.sanding is not None,
            "[track]": self.track != Track() or self.variation is not None,
            "[dynamic_load]": self.dynamic_load is not None,
            "[held_speed]": self.held_speed is not None and len(set(self.held_speed.value)) > 1,
            'run.start = "released"': self.start == "released",
        }
        if present := [part for part, stands in between.items() if stands]:
            raise ValueError(
                f"{name} is continuous and acts on the wheels themselves: the scenario must not "
                f"have {' or '.join(present)}"
            )

    def controller(self, name: str) -> Controller:
        """Return the sampled controller of this name, designed for this scenario.

        Raises
        ------
        ValueError
            If the name is unknown, or of a continuous controller.
        """
        control = self.any_controller(name)
        if isinstance(control, ContinuousController):
            raise ValueError(
                f"controller = {name!r} is continuous: only run_scenario runs it; expected a "
                "sampled one"
            )
        return control

    def any_controller(self, name: str) -> Controller | ContinuousController:
        """Return the controller of this name, sampled or continuous; as `controller`."""
        if name not in self.controllers:
            known = ", ".join(self.controllers)
            raise ValueError(f"controller = {name!r} must be one of the scenario's: {known}")
        return self._designed[name]


@dataclass(frozen=True)
class Demand:
    """What the driver demands over time, and in which terms.

    Attributes
    ----------
    profile : Profile
        Over time [s].
    kind : str
        "torque", "deceleration", "brake_force" or "pressure", as in `demand_over_time`.
    """

    profile: Profile
    kind: str

    def torque(self, drivetrain: Drivetrain, vehicle: Vehicle | None, backward: bool) -> Profile:
        """Torque that it is at each axle which it acts on [N.m].

        A brake acts against the motion by itself, and a motor by the sign of its torque.

        Raises
        ------
        ValueError
            If the drivetrain lacks a number that follows from the terms.
        """
        if self.kind == "torque":
            return self.profile
        wheelset, brake = drivetrain.wheelset, drivetrain.brake
        axles, braked = (vehicle.axles, len({*vehicle.braked})) if vehicle else (1, 1)
        braked, against = braked or axles, 1.0 if backward and brake is None else -1.0
        if self.kind == "deceleration":
            if wheelset.mass is None:
                raise ValueError("demand.deceleration needs a mass: a roller rig holds its speed")
            moved = wheelset.mass * wheelset.radius + wheelset.inertia / wheelset.radius
            factor = against * moved * axles / braked
        elif self.kind == "brake_force":
            factor = against * wheelset.radius / braked
        else:
            if brake is None or brake.pressure is None:
                raise ValueError(
                    "demand.pressure needs brake.pressure, and brake.torque at that pressure"
                )
            factor = -1.0 / brake.pressure_per_torque
        return Profile(self.profile.at, tuple(factor * value for value in self.profile.value))


@checks_call
def demand_over_time(
    *,
    time: Annotated[Values, TIME],
    torque: Annotated[Values, Quantity("N.m", usual=(-3e5, 3e5))] = (),
    deceleration: Annotated[Values, Quantity("m/s2", at_least=0.0, usual=(0.0, 5.0))] = (),
    brake_force: Annotated[Values, Quantity("N", at_least=0.0, usual=(0.0, 5e6))] = (),
    pressure: Annotated[Values, Quantity("Pa", at_least=0.0, usual=(0.0, 2e6))] = (),
) -> Demand:
    """The driver's demand, in one of four terms.

    Those of braking are what the brakes give while their pads have their nominal friction.

    Parameters
    ----------
    time : tuple of float
        Breakpoints of the demand [s].
    torque : tuple of float, optional
        Torque at the axle that the driver demands; negative in braking [N.m].
    deceleration : tuple of float, optional
        Deceleration by the brakes alone, on a level track and with all wheels rolling [m/s2]. The
        braked axles share the force for the vehicle with its train and for what turns in it;
        resistances come on top.
    brake_force : tuple of float, optional
        Force of all brakes at the rims of the wheels while they turn evenly [N].
    pressure : tuple of float, optional
        Pressure in the brake cylinders [Pa], of a brake with `pressure` and `torque`.
    """
    terms = dict(zip(TERMS, (torque, deceleration, brake_force, pressure), strict=True))
    given = [name for name, values in terms.items() if values]
    if len(given) != 1:
        raise ValueError(
            f"demand must have one of {', '.join(terms)}; given: {', '.join(given) or 'nothing'}"
        )
    return Demand(profile_of(time=time, **{given[0]: terms[given[0]]}), given[0])


@checks_call
def speed_over_time(*, time: Annotated[Values, TIME], speed: Annotated[Values, SPEED]) -> Profile:
    """The speed of a roller rig.

    Parameters
    ----------
    time : tuple of float
        Breakpoints of the speed [s].
    speed : tuple of float
        Forward speed at the breakpoints [m/s].
    """
    return profile_of(time=time, speed=speed)


# Sections of a scenario that do not depend on its vehicle: what they describe, and their keys.
MADE: Mapping[str, Callable[..., Any]] = {
    "vehicle": Vehicle,
    "demand": demand_over_time,
    "driver": Driver,
    "axle": Axle,
    "motor": Motor,
    "brake": brake_of,
    "sanding": Sanding,
    "track": track_of,
    "track.variation": Variation,
    "dynamic_load": DynamicLoad,
    "held_speed": speed_over_time,
    "sensors": Sensors,
}
SECTIONS: Mapping[str, Keys] = {
    "run": optional(
        without(declared(Scenario), "name", "source", "speed_unit"), "initial_speed", "design_speed"
    ),
    **{name: declared(make) for name, make in MADE.items()},
    "brake": {**declared(Brake), **declared(Brake.from_times), **declared(brake_of)},
    "track": {**declared(Track.from_breakpoints), **declared(TrackConditions)},
}
PARTS = ("vehicle", "axle", "motor", "brake", "sanding")  # of the drivetrain
ABSENT = (
    "vehicle",
    "driver",
    "axle",
    "brake",
    "sanding",
    "dynamic_load",
    "held_speed",
    "track.variation",
)  # sections that are optional parts of a scenario
KEYS = ("wheelset_changes", *(key for key in SECTIONS if key not in NEEDED))


def read_sections(data: Mapping[str, Any], cache: BuildCache) -> dict[str, Any]:
    """Read all sections, so that all mistakes come at once; None for a section that is absent."""
    with Mistakes(data) as mistakes:
        for key, read in (("name", title), ("source", text)):
            if key in data:
                mistakes.of(read, key, data[key])
        return {
            name: mistakes.of(cache.section, name, keys, data, MADE.get(name, dict))
            if name in data or name not in (*ABSENT, *NEEDED)
            else None
            for name, keys in SECTIONS.items()
        }


def _speeds(
    initial: float | None, held: Profile | None, speed_held: bool
) -> tuple[float, Profile | None]:
    """Speed at the start, and the speed over time that a roller rig holds."""
    if held is not None and not speed_held:
        raise ValueError("held_speed needs a vehicle without wheelset.mass: a roller rig")
    if (held is None) == (initial is None):
        both = "both are" if held is not None else "none is"
        raise ValueError(f"run.initial_speed and held_speed: give one of them; {both} given")
    if held is not None:
        return float(held(0.0)), held
    return initial or 0.0, Profile.of(initial or 0.0) if speed_held else None


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
        A TOML file, or the name of a shipped one such as ``"dry_wet_dry.toml"``. A file that it
        or its vehicle refers to, such as the map of its track, lies in the folder of the referring
        file or below, or is a shipped one.
    table, progress : optional
        As for `load_model`.

    Raises
    ------
    ModelError
        If the file or its vehicle is not valid; a line for each mistake names file, key,
        value and limit.
    OSError
        If a file cannot be read.

    Warns
    -----
    InputWarning
        If a number is allowed but implausible for a vehicle.
    """
    with loading(path):
        contents = read_contents(path)
        return build_scenario(contents.data, contents.build_vehicle(table, progress))


@dataclass(frozen=True)
class ScenarioContents:
    """Parsed contents of a scenario file and its vehicle file, sufficient to build the scenario.

    Attributes
    ----------
    data : dict
        Contents of the scenario file.
    vehicle : dict
        Contents of the vehicle file, with the scenario's changes.
    label : str
        Name of the vehicle in messages.
    folder : str
        Folder of the file that names the data file of the vehicle's law.
    """

    data: dict[str, Any]
    vehicle: dict[str, Any]
    label: str
    folder: str  # not a Path, which cannot be sent to another operating system

    def build_vehicle(
        self, table: CreepForceTable | None, progress: Callable[[float], object]
    ) -> Wheelset:
        """Check the whole model file and build its wheelset."""
        with in_file(self.label):
            return build_model(self.vehicle, Path(self.folder), table, progress).wheelset


def read_contents(path: str | os.PathLike[str]) -> ScenarioContents:
    """Read the contents of a scenario file and of its vehicle.

    Raises
    ------
    ValueError
        If the file is not TOML or lacks a key that a scenario needs.
    OSError
        If a file cannot be read.
    """
    file = model_path(path)
    data = parse(file)
    if "axes" in data:
        raise ValueError(IS_SWEEP)
    if "demand" not in data and "contact" in data:
        raise ValueError(
            "is a model, not a scenario: contactlib.load_model reads it; a scenario names its "
            "model file with the key 'wheelset', and 'contactlib new scenario' writes one"
        )
    with Mistakes(data) as mistakes:
        mistakes.of(check_keys, "", data, [*NEEDED, *KEYS], NEEDED)
        if "wheelset" in data:
            vehicle_source = mistakes.of(vehicle_contents, data, file.parent)
            if vehicle_source:
                mistakes.of(_check_vehicle, *vehicle_source[:2])
                if "vehicle" in data:
                    drop_warning("mass")  # the vehicle has its own
        data = mistakes.of(with_track_map, data, file.parent) or without(data, "track")
        data = mistakes.of(with_pads, data, file.parent) or without(data, "brake")
        if isinstance(track := data.get("track"), Mapping) and "variation" in track:
            parts = {"track.variation": track["variation"], "track": without(track, "variation")}
            data = {**data, **parts}
        mistakes.of(read_sections, data, BuildCache())
        if "controllers" in data:
            mistakes.of(read_controllers, data["controllers"])
    label, vehicle, folder = vehicle_source
    return ScenarioContents(data, vehicle, label, str(folder))


def _check_vehicle(label: str, vehicle: dict[str, Any]) -> None:
    with in_file(label):
        read_model(vehicle, BuildCache())


def build_scenario(
    data: Mapping[str, Any],
    wheelset: Wheelset,
    controllers: Mapping[str, Controller | ContinuousController | ControllerDesign] | None = None,
    cache: BuildCache | None = None,
) -> Scenario:
    """Build a scenario from a file's contents, with its own controllers or the given ones.

    Raises
    ------
    ValueError
        In a line for each mistake, if sections or keys are wrong.
    """
    cache = cache or BuildCache()
    if "condition" in data.get("track", {}):
        track = cache("conditions", factors_of_conditions, data["track"], wheelset.element)
        data = {**data, "track": track}
    made = read_sections(data, cache)
    run, parts = made["run"], [made[name] for name in PARTS]
    drivetrain = cache("drivetrain", _drivetrain, wheelset, *parts)
    wheelset = drivetrain.wheelset
    initial_speed, held_speed = cache(
        "speeds", _speeds, run.get("initial_speed"), made["held_speed"], wheelset.speed_held
    )
    trip = drivetrain.motor.trip_speed
    if trip is not None and trip <= abs(initial_speed):
        note_warning(
            "trip_speed", f"motor.trip_speed = {trip:g} m/s trips at the initial speed already"
        )
    design_speed = run.get("design_speed", abs(initial_speed))
    if design_speed < wheelset.element.minimum_speed:
        given = "=" if "design_speed" in run else "is missing, and the initial speed"
        raise ValueError(
            f"run.design_speed {given} {design_speed!r} is out of range: controllers are designed "
            f"for a speed >= the minimum speed {wheelset.element.minimum_speed!r}"
        )
    backward = initial_speed < 0.0
    demand = cache("demand", Demand.torque, made["demand"], drivetrain, made["vehicle"], backward)
    first = float(demand(0.0))
    if made["brake"] and first < 0.0 and initial_speed != 0.0 and "start" not in run:
        note_warning(
            "run.start",
            f"demand = {first:g} N.m at 0 s: the run begins with the brake filled; for a stop that "
            'begins with the demand, run.start = "released"',
        )
    given = data["run"].get("initial_speed") or data.get("held_speed", {}).get("speed", [0.0])[0]
    unit = unit_value(str(given).lstrip("+-.0123456789eE "), "m/s")
    return Scenario(
        name=data["name"],
        source=data["source"],
        drivetrain=drivetrain,
        held_speed=held_speed,
        controllers=read_controllers(data["controllers"]) if controllers is None else controllers,
        speed_unit="km/h" if unit == unit_value("km/h", "m/s") else "m/s",
        demand=demand,
        variation=made["track.variation"],
        **{key: made[key] for key in ("vehicle", "driver", "track", "dynamic_load", "sensors")},
        **run | {"initial_speed": initial_speed, "design_speed": design_speed},
    )


def _drivetrain(
    wheelset: Wheelset,
    vehicle: Vehicle | None,
    axle: Axle | None,
    motor: Motor,
    brake: Brake | None,
    sanding: Sanding | None,
) -> Drivetrain:
    if vehicle is not None:
        drop_warning("mass")  # of the wheelset's file
        _check_plausible_axles(vehicle, wheelset)
        wheelset = replace(wheelset, mass=vehicle.mass / vehicle.axles)
    return Drivetrain(wheelset, axle=axle, motor=motor, brake=brake, sanding=sanding)


def _check_plausible_axles(vehicle: Vehicle, wheelset: Wheelset) -> None:
    """Doubt numbers of a wheelset's file that do not fit the vehicle whose axles it describes."""
    resistance, wheels = wheelset.resistance, wheelset.element.wheels
    free = not (resistance.constant or resistance.linear or resistance.quadratic)
    nominal, share = wheelset.element.contact.wheel_load, vehicle.mass / vehicle.axles
    load = vehicle.own_mass * STANDARD_GRAVITY / vehicle.axles / wheels
    gaps = (b - a for a, b in pairwise(vehicle.position))
    mass, gap = wheelset.mass or share, min(gaps, default=math.inf)
    for key, fits, sentence in (
        ("wheels", wheels == 2, f"wheelset.wheels = {wheels:g}: each axle of a vehicle has 2"),
        (
            "wheel_load",
            1.0 / LOAD_RATIO < nominal / load < LOAD_RATIO,
            f"contact.wheel_load = {nominal:.4g} N, but by the vehicle's masses each wheel "
            f"carries {load:.4g} N at rest",
        ),
        (
            "resistance",
            free or 1.0 / MASS_RATIO < share / mass < MASS_RATIO,
            f"resistance is that of wheelset.mass = {mass:.4g} kg, but each axle of the vehicle "
            f"and its train moves {share:.4g} kg: give both in wheelset_changes",
        ),
        (
            "position",
            gap >= 2.0 * wheelset.radius,
            f"vehicle.position has axles {gap:.4g} m apart: wheels of wheelset.radius = "
            f"{wheelset.radius:.4g} m overlap",
        ),
    ):
        if not fits:
            note_warning(key, sentence)
