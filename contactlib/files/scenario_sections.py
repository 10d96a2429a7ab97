"""A scenario's sections, as far as they can be read without its vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from contactlib.files.mistakes import Mistakes
from contactlib.files.model import BuildCache
from contactlib.files.reading import named, text, title
from contactlib.files.sections import (
    DemandSection,
    HeldSpeedSection,
    RelaxationSection,
    ScenarioRunSection,
    TrackSection,
)
from contactlib.traction import Sensors
from contactlib.vehicle.drivetrain import Axle, Motor
from contactlib.vehicle.track import Profile, Track
from contactlib.vehicle.wheel_load import WheelLoad


class Sections(NamedTuple):
    """Sections of a scenario that do not depend on its vehicle."""

    axle: Axle | None
    motor: Motor
    relaxation: RelaxationSection
    run: ScenarioRunSection
    demand: Profile
    track: Track
    wheel_load: WheelLoad | None
    held: HeldSpeedSection | None
    sensors: Sensors


def read_sections(data: Mapping[str, Any], cache: BuildCache) -> Sections:
    """Read them all, so that all mistakes come at once; what the file lacks is None."""
    lacking: Any = None
    with Mistakes(data) as mistakes:
        of, section = mistakes.of, cache.section
        for key, read in (("name", title), ("source", text)):
            if key in data:
                of(read, key, data[key])
        demand = of(section, "demand", DemandSection, data) if "demand" in data else lacking
        track = of(section, "track", TrackSection, data)
        held = of(section, "held_speed", HeldSpeedSection, data) if "held_speed" in data else None
        load = of(section, "wheel_load", WheelLoad, data) if "wheel_load" in data else None
        return Sections(
            axle=of(section, "axle", Axle, data) if "axle" in data else None,
            motor=of(section, "motor", Motor, data),
            relaxation=of(section, "contact_relaxation", RelaxationSection, data),
            run=of(section, "run", ScenarioRunSection, data) if "run" in data else lacking,
            demand=demand and of(cache, "demand", _demand, demand),
            track=track and of(cache, "track", _track, track),
            wheel_load=load,
            held=held,
            sensors=of(section, "sensors", Sensors, data),
        )


def _demand(section: DemandSection) -> Profile:
    with named("demand"):
        return section.build()


def _track(section: TrackSection) -> Track:
    with named("track"):
        return section.build()


def speeds(
    run: ScenarioRunSection, section: HeldSpeedSection | None, speed_held: bool
) -> tuple[float, Profile | None]:
    """Speed at the start, and the speed over time that a roller rig holds."""
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
