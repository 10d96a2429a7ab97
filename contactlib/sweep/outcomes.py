"""What a sweep may report: numbers of runs, and of the analysis of each wheelset."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

from contactlib import outcomes
from contactlib.peak_force import available_force
from contactlib.scenario import Scenario
from contactlib.stability import (
    Fold,
    WorstPole,
    clearing,
    creep_control_gain,
    delay_limit,
    find_fold,
    steady_states,
    worst_pole,
)
from contactlib.stability.quasi_steady import creepage_grid

DRIVING = "in driving; nan where the demand brakes"
LOWEST = "the track's lowest factor on friction, of any wheel and time"


class Analysis:
    """A scenario's wheelset at its design speed, on friction of the vehicle's file (factor 1).

    The torque is the demand of the largest size; the patch has the smallest factor on friction
    that the track has under any wheel at any time. What several outcomes need is worked out once.
    Critical torques are of driving: damping adds to them, and takes from those of braking.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.wheelset, self.speed = scenario.drivetrain.wheelset, scenario.design_speed
        self.torque = max(scenario.demand.value, key=abs)
        track = scenario.track
        sides = (track.friction_left, track.friction_right or track.friction_left)
        self.patch = min(min(s.value) for s in sides) * min(track.friction_over_time.value)

    @cached_property
    def fold(self) -> Fold | None:
        """Where the torque has its maximum; None if it has none, or the demand brakes."""
        return self._driving_fold if self.torque >= 0.0 else None

    @cached_property
    def patch_fold(self) -> Fold | None:
        """The same on the patch."""
        return self._fold(self.patch) if self.torque >= 0.0 else None

    @cached_property
    def _driving_fold(self) -> Fold | None:
        return self._fold(1.0)

    def _fold(self, friction_scale: float) -> Fold | None:
        try:
            return find_fold(self.wheelset, speed=self.speed, friction_scale=friction_scale)
        except ValueError:  # it rises forever: all arguments are those of a valid scenario
            return None

    @cached_property
    def worst(self) -> WorstPole:
        """Steepest point of the falling branch."""
        return worst_pole(self.wheelset, speed=self.speed)

    @cached_property
    def grip(self) -> bool:
        """Whether the torque has a stable steady state short of the peak, of either sign.

        The torque's slope over creepage is as good as even, so its peaks in driving and braking
        are at one creepage. Where damping lets the torque rise forever, the force has the peak:
        beyond it the wheels spin, held by damping alone.
        """
        found = steady_states(self.wheelset, drive_torque=self.torque, speed=self.speed)
        fold = self._driving_fold
        last = self._largest_force_creepage() if fold is None else fold.creepage
        return bool((found.stable & (abs(found.creepage) < last)).any())

    def _largest_force_creepage(self) -> float:
        """Least creepage with the largest creep force, to the width of the grid."""
        creepage = creepage_grid(self.wheelset, speed=self.speed)
        force = self.wheelset.element.at_creepage(creepage, speed=self.speed)["creep_force"]
        return float(creepage[int((force >= (1.0 - 1e-9) * force.max()).argmax())])

    @cached_property
    def clearing(self) -> tuple[float, float]:
        """Time and length of the longest patch that the torque survives.

        Zero if it is too much for good friction; nan if it brakes, as a wheelset that brakes
        slows down so much meanwhile that the border may be lost, or if there is none to follow.
        """
        if self.torque < 0.0:
            return math.nan, math.nan
        if not self.grip:
            return 0.0, 0.0
        try:
            found = clearing(
                self.wheelset, drive_torque=self.torque, speed=self.speed, friction_scale=self.patch
            )
        except ValueError:  # all arguments are those of a valid scenario
            return math.nan, math.nan
        return found.time, found.distance

    def gain(self) -> float:
        """Smallest gain that holds the steepest point."""
        point = self.wheelset.balanced(creepage=self.worst.creepage, speed=self.speed)
        return max(0.0, creep_control_gain(self.wheelset, point))


class Outcome(NamedTuple):
    """A number that a sweep reports.

    Attributes
    ----------
    unit, description : str
        SI unit, and one line.
    analyse : callable or None
        From the analysis of a wheelset; None if controllers have to run for it.
    """

    unit: str
    description: str
    analyse: Callable[[Analysis], float] | None = None


ANALYSES = {
    "critical_torque": Outcome(
        "N.m",
        f"torque at which a slow ramp runs away {DRIVING}",
        lambda a: math.nan if a.fold is None else a.fold.drive_torque,
    ),
    "patch_critical_torque": Outcome(
        "N.m",
        f"torque at which a slow ramp runs away on {LOWEST}, {DRIVING}",
        lambda a: math.nan if a.patch_fold is None else a.patch_fold.drive_torque,
    ),
    "critical_creepage": Outcome(
        "1",
        f"creepage at which a slow ramp runs away {DRIVING}",
        lambda a: math.nan if a.fold is None else a.fold.creepage,
    ),
    "available_force": Outcome(
        "N",
        "largest creep force",
        lambda a: float(available_force(a.wheelset.element, speed=a.speed)),
    ),
    "hysteresis": Outcome(
        "1",
        f"torque drop that ends a run-away, over the critical torque, {DRIVING}",
        lambda a: math.nan if a.fold is None else a.fold.hysteresis,
    ),
    "torque_margin": Outcome(
        "1",
        f"critical torque over the largest demand, less one, {DRIVING}",
        lambda a: (
            math.nan
            if a.fold is None
            else a.fold.drive_torque / a.torque - 1.0
            if a.torque != 0.0
            else math.inf
        ),
    ),
    "stable": Outcome(
        "1",
        "whether the largest demand, of either sign, is held at constant torque short of the peak",
        lambda a: float(a.grip),
    ),
    "worst_pole": Outcome(
        "1/s", "largest pole of the falling branch at constant torque", lambda a: a.worst.pole
    ),
    "delay_limit": Outcome(
        "s",
        "delay beyond which no gain holds the falling branch's steepest point",
        lambda a: delay_limit(a.worst.pole),
    ),
    "required_gain": Outcome(
        "N.m", "smallest gain of creep control that holds the steepest point", Analysis.gain
    ),
    "clearing_time": Outcome(
        "s",
        f"longest time on {LOWEST}, factor 1 before, that the largest demand survives {DRIVING}",
        lambda a: a.clearing[0],
    ),
    "clearing_distance": Outcome(
        "m",
        f"longest stretch of {LOWEST}, factor 1 before, that the largest demand survives {DRIVING}",
        lambda a: a.clearing[1],
    ),
}
OUTCOMES: dict[str, Outcome] = {
    **{name: Outcome(of.unit, of.description) for name, of in outcomes.OUTCOMES.items()},
    **ANALYSES,
}


def of_runs(names: Sequence[str]) -> list[str]:
    """Those outcomes for which controllers have to run."""
    return [name for name in names if OUTCOMES[name].analyse is None]


def analyse(scenario: Scenario, names: Sequence[str]) -> dict[str, float]:
    """Outcomes of the analysis of one scenario; nan where one does not apply."""
    analysis = Analysis(scenario)
    functions = {name: OUTCOMES[name].analyse for name in names}
    return {name: float(f(analysis)) for name, f in functions.items() if f is not None}
