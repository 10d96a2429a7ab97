"""Outcomes of a sweep, from runs and from the stability analysis of each wheelset."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from types import MappingProxyType

from contactlib.files.scenario import Scenario
from contactlib.runs.outcomes import OUTCOMES, Outcome
from contactlib.stability import (
    clearing,
    creep_control_gain,
    delay_limit,
    reduced_frequency,
    reduced_plant,
)
from contactlib.vehicle.creep_curve import CreepCurve, Fold, WorstPole

DRIVING = "while driving; nan where the demand brakes"
LOWEST = "the track's lowest friction and slope, of any wheel and time"


class Analysis:
    """A scenario's wheelset at its design speed, on the friction of the wheelset's file (factor 1).

    The torque is the demand of the largest size; the patch has the smallest friction factor that
    the track has under any wheel at any time, and its smallest factor on the slope. Results that
    several outcomes use are computed once. All contain the memory of a contact. Critical torques
    are for driving, where damping increases them; in braking it decreases them.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.wheelset, self.speed = scenario.drivetrain.wheelset, scenario.design_speed
        self.torque = max(scenario.demand.value, key=abs)
        self.patch, self.slope = scenario.rails_at(self.speed).lowest
        self.curve = CreepCurve(self.wheelset, speed=self.speed)

    @cached_property
    def fold(self) -> Fold | None:
        """Fold of the torque; None if it has no maximum, or the demand brakes."""
        return _fold(self.curve) if self.torque >= 0.0 else None

    @cached_property
    def patch_fold(self) -> Fold | None:
        """Fold of the torque on the patch."""
        if self.torque < 0.0:
            return None
        wheelset = self.wheelset.with_slope(self.slope)
        return _fold(CreepCurve(wheelset, speed=self.speed, friction_scale=self.patch))

    @cached_property
    def worst(self) -> WorstPole:
        """Steepest point of the falling branch."""
        return self.curve.worst_pole

    @cached_property
    def grip(self) -> bool:
        """Whether the torque, of either sign, has a stable steady state below the peak.

        The torque's slope is almost even in creepage, so its peaks in driving and braking are at
        the same size of creepage. Where damping makes the torque rise forever, the peak of the
        force counts: beyond it the wheels spin, held by damping alone.
        """
        states = self.curve.steady(self.torque)
        fold = _fold(self.curve)
        last = self.curve.peak.creepage if fold is None else fold.creepage
        return bool((states.stable & (abs(states.creepage) < last)).any())

    @cached_property
    def clearing(self) -> tuple[float, float]:
        """Time and length of the longest patch after which the wheel re-adheres.

        Zero if the torque is too large for good friction. Nan if it brakes, or if good friction
        cannot transmit it, or has no border, at the speed that is reached on the patch.
        """
        if self.torque < 0.0:
            return math.nan, math.nan
        if not self.grip:
            return 0.0, 0.0
        try:
            longest = clearing(
                self.wheelset,
                drive_torque=self.torque,
                speed=self.speed,
                friction_scale=self.patch,
                slope=self.slope,
            )
        except ValueError:  # of the speed reached: the arguments come from a scenario
            return math.nan, math.nan
        return longest.time, longest.distance

    @property
    def margin(self) -> float:
        """Critical torque / largest demand - 1; infinite without a demand."""
        if self.fold is None:
            return math.nan
        return self.fold.drive_torque / self.torque - 1.0 if self.torque != 0.0 else math.inf

    @property
    def gain(self) -> float:
        """Minimum gain of creep control that stabilises the steepest point."""
        point = self.wheelset.balanced(creepage=self.worst.creepage, speed=self.speed)
        return max(0.0, creep_control_gain(self.wheelset, point))

    @property
    def delay_limit(self) -> float:
        """Delay beyond which no gain stabilises it."""
        plant = reduced_plant(self.wheelset, self.worst.creepage, speed=self.speed)
        return delay_limit(self.worst.pole, plant.zeros, plant.poles)


def _fold(curve: CreepCurve) -> Fold | None:
    try:
        return curve.fold
    except ValueError:  # it rises forever: the arguments are valid, as they come from a scenario
        return None


NO_FOLD = "no maximum, or braking"
_clearing = partial(Outcome, infinite="survives any length", zero="not held even before the patch")

ANALYSES = {
    "critical_torque": Outcome(
        "N.m",
        f"torque at which the wheel slips away in a slow ramp, {DRIVING}",
        analyse=lambda a: math.nan if a.fold is None else a.fold.drive_torque,
        missing=NO_FOLD,
    ),
    "patch_critical_torque": Outcome(
        "N.m",
        f"torque at which the wheel slips away in a slow ramp, on {LOWEST}, {DRIVING}",
        analyse=lambda a: math.nan if a.patch_fold is None else a.patch_fold.drive_torque,
        missing=NO_FOLD,
    ),
    "critical_creepage": Outcome(
        "1",
        f"creepage at which the wheel slips away in a slow ramp, {DRIVING}",
        analyse=lambda a: math.nan if a.fold is None else a.fold.creepage,
        percent=True,
        missing=NO_FOLD,
    ),
    "available_force": Outcome(
        "N",
        "largest creep force",
        analyse=lambda a: a.curve.peak.creep_force,
    ),
    "hysteresis": Outcome(
        "1",
        f"torque drop that ends a slip-away / critical torque, {DRIVING}",
        analyse=lambda a: math.nan if a.fold is None else a.fold.hysteresis,
        percent=True,
        missing=NO_FOLD,
    ),
    "torque_margin": Outcome(
        "1",
        f"critical torque / largest demand - 1, {DRIVING}",
        analyse=lambda a: a.margin,
        percent=True,
        infinite="no demand",
        border="demand = critical torque",
        missing=NO_FOLD,
    ),
    "stable": Outcome(
        "1",
        "whether the largest demand, of either sign, is held at constant torque short of the peak",
        analyse=lambda a: float(a.grip),
        yes_or_no=("held", "not held"),
    ),
    "worst_pole": Outcome(
        "1/s",
        "largest pole of the falling branch at constant torque",
        analyse=lambda a: a.worst.pole,
        border="zero: below it no slip-away",
    ),
    "reduced_frequency": Outcome(
        "1",
        "largest pole times semi-width over speed; above 0.5 rolling is not steady",
        analyse=lambda a: float(reduced_frequency(a.wheelset, a.worst.pole, speed=a.speed)),
    ),
    "delay_limit": Outcome(
        "s",
        "delay beyond which no gain holds the falling branch's steepest point",
        analyse=lambda a: a.delay_limit,
        infinite="any delay",
    ),
    "required_gain": Outcome(
        "N.m",
        "smallest gain of creep control that holds the steepest point",
        analyse=lambda a: a.gain,
        zero="needs none",
    ),
    "clearing_time": _clearing(
        "s",
        f"longest time on {LOWEST}, factor 1 before, that the largest demand survives {DRIVING}",
        analyse=lambda a: a.clearing[0],
    ),
    "clearing_distance": _clearing(
        "m",
        f"longest stretch of {LOWEST}, factor 1 before, that the largest demand survives {DRIVING}",
        analyse=lambda a: a.clearing[1],
    ),
}
MARGIN = "torque_margin"  # zero where the largest demand is the critical torque
SWEEP_OUTCOMES: Mapping[str, Outcome] = MappingProxyType({**OUTCOMES, **ANALYSES})


def of_runs(names: Sequence[str]) -> list[str]:
    """Select the outcomes for which controllers have to run."""
    return [name for name in names if SWEEP_OUTCOMES[name].analyse is None]


def analyse(scenario: Scenario, names: Sequence[str]) -> dict[str, float]:
    """Compute outcomes of the analysis of one scenario; nan where one does not apply."""
    found = ((name, SWEEP_OUTCOMES[name].analyse) for name in names)
    functions = {name: f for name, f in found if f is not None}
    if not functions:  # of runs alone, which need none of its data
        return {}
    analysis = Analysis(scenario)
    return {name: float(f(analysis)) for name, f in functions.items()}
