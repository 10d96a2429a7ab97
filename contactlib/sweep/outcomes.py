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
    Clearing,
    Fold,
    WorstPole,
    clearing,
    creep_control_gain,
    delay_limit,
    find_fold,
    steady_states,
    worst_pole,
)


class Analysis:
    """A scenario's wheelset at its design speed, on friction of the vehicle's file (factor 1).

    The torque is the demand of the largest size; the patch has the smallest factor on friction
    that the track has under any wheel. What several outcomes need is worked out once.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.wheelset, self.speed = scenario.drivetrain.wheelset, scenario.design_speed
        self.torque = max(scenario.demand.value, key=abs)
        track = scenario.track
        sides = (track.friction_left, track.friction_right or track.friction_left)
        self.patch = min(min(s.value) for s in sides) * min(track.friction_over_time.value)

    @cached_property
    def fold(self) -> Fold | None:
        """Where the torque has its maximum; None if it has none."""
        return self._fold(1.0)

    @cached_property
    def patch_fold(self) -> Fold | None:
        """The same on the patch."""
        return self._fold(self.patch)

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
        """Whether the torque has a stable steady state short of the fold."""
        found = steady_states(self.wheelset, drive_torque=self.torque, speed=self.speed)
        last = math.inf if self.fold is None else self.fold.creepage
        return bool((found.stable & (abs(found.creepage) < last)).any())

    @cached_property
    def clearing(self) -> Clearing | None:
        """Longest patch that the torque survives; None if it is too much for good friction."""
        if not self.grip:
            return None
        return clearing(
            self.wheelset, drive_torque=self.torque, speed=self.speed, friction_scale=self.patch
        )

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
        "torque at which a slow ramp runs away",
        lambda a: math.nan if a.fold is None else a.fold.drive_torque,
    ),
    "patch_critical_torque": Outcome(
        "N.m",
        "torque at which a slow ramp runs away on the track's lowest friction",
        lambda a: math.nan if a.patch_fold is None else a.patch_fold.drive_torque,
    ),
    "critical_creepage": Outcome(
        "1",
        "creepage at which a slow ramp runs away",
        lambda a: math.nan if a.fold is None else a.fold.creepage,
    ),
    "available_force": Outcome(
        "N",
        "largest creep force",
        lambda a: float(available_force(a.wheelset.element, speed=a.speed)),
    ),
    "hysteresis": Outcome(
        "1",
        "torque drop that ends a run-away, over the critical torque",
        lambda a: math.nan if a.fold is None else a.fold.hysteresis,
    ),
    "torque_margin": Outcome(
        "1",
        "critical torque over the largest demand, less one",
        lambda a: (
            math.nan
            if a.fold is None
            else a.fold.drive_torque / abs(a.torque) - 1.0
            if a.torque != 0.0
            else math.inf
        ),
    ),
    "stable": Outcome(
        "1",
        "whether a constant torque of the largest demand is held short of the peak",
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
        "longest time on the track's lowest friction that the largest demand survives",
        lambda a: 0.0 if a.clearing is None else a.clearing.time,
    ),
    "clearing_distance": Outcome(
        "m",
        "longest stretch of the track's lowest friction that the largest demand survives",
        lambda a: 0.0 if a.clearing is None else a.clearing.distance,
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
