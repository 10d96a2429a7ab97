"""Sections of a scenario file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from contactlib.drivetrain import LARGEST_LAG
from contactlib.parameters import Parameters, Quantity
from contactlib.profile import Profile
from contactlib.scenario.reading import profile
from contactlib.track import Track

Places = tuple[float, ...]
LONGEST = 1e6  # duration of a run [s]
SPEED = Quantity("m/s", at_least=-500.0, at_most=500.0)


@dataclass(frozen=True, kw_only=True)
class MotorSection(Parameters):
    """``[motor]``: time with which the drive torque follows its command."""

    lag: Annotated[float, Quantity("s", at_least=0.0, at_most=LARGEST_LAG)] = 0.0


@dataclass(frozen=True, kw_only=True)
class RelaxationSection(Parameters):
    """``[contact_relaxation]``: way over which the creep force follows the creepage."""

    length: Annotated[float, Quantity("m", at_least=0.0)] = 0.0


@dataclass(frozen=True, kw_only=True)
class ScenarioRunSection(Parameters):
    """``[run]``: where it begins and how long it lasts.

    `initial_speed` is left out if the speed is held; `design_speed` is the one at which the
    controllers are designed, the initial one if left out.
    """

    duration: Annotated[float, Quantity("s", above=0.0, at_most=LONGEST)]
    initial_speed: Annotated[float | None, SPEED] = None
    design_speed: Annotated[float | None, SPEED] = None


@dataclass(frozen=True, kw_only=True)
class DemandSection(Parameters):
    """``[demand]``: breakpoints of the torque that the driver asks for."""

    time: Annotated[Places, Quantity("s", at_least=0.0)]
    torque: Annotated[Places, Quantity("N.m")]

    def build(self) -> Profile:
        """Demand over time."""
        return profile(self, "time", "torque")


@dataclass(frozen=True, kw_only=True)
class HeldSpeedSection(Parameters):
    """``[held_speed]``: breakpoints of the speed that a roller rig holds."""

    time: Annotated[Places, Quantity("s", at_least=0.0)]
    speed: Annotated[Places, SPEED]

    def build(self) -> Profile:
        """Speed over time."""
        return profile(self, "time", "speed")


@dataclass(frozen=True, kw_only=True)
class TrackSection(Parameters):
    """``[track]``: factors on friction over distance, on one or both sides, and over time."""

    distance: Annotated[Places, Quantity("m")] = ()
    friction: Annotated[Places, Quantity("1", above=0.0)] = ()
    friction_left: Annotated[Places, Quantity("1", above=0.0)] = ()
    friction_right: Annotated[Places, Quantity("1", above=0.0)] = ()
    time: Annotated[Places, Quantity("s", at_least=0.0)] = ()
    friction_over_time: Annotated[Places, Quantity("1", above=0.0)] = ()

    def build(self) -> Track:
        """The track."""
        allowed: dict[tuple[str, ...], dict[str, str]] = {
            (): {},
            ("distance", "friction"): {"friction_left": "friction"},
            ("distance", "friction_left", "friction_right"): {
                "friction_left": "friction_left",
                "friction_right": "friction_right",
            },
        }
        over_distance = self._given("distance", "friction", "friction_left", "friction_right")
        if over_distance not in allowed:
            raise ValueError(
                "distance goes with friction, or with friction_left and friction_right; "
                f"given are {' and '.join(over_distance)}"
            )
        over_time = self._given("time", "friction_over_time")
        if len(over_time) == 1:
            raise ValueError(f"time and friction_over_time go together; given is {over_time[0]}")
        sides = allowed[over_distance].items()
        factors = {side: profile(self, "distance", key) for side, key in sides}
        if over_time:
            factors["friction_over_time"] = profile(self, *over_time)
        return Track(**factors)

    def _given(self, *keys: str) -> tuple[str, ...]:
        return tuple(key for key in keys if getattr(self, key))
