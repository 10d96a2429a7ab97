"""When a run has its rows and its samples."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contactlib.parameters import POSITIVE, FloatArray, checked_number
from contactlib.scenario import Scenario
from contactlib.traction import TractionController

MOST_ROWS = 10_000_000
LONGEST_STEP = 5e-3  # of rows and friction if nothing else is asked for [s]


class Timing(NamedTuple):
    """Rows and samples of a run.

    Attributes
    ----------
    step : float
        Time between rows [s].
    per_sample : int
        Rows from one sample of the controller to the next.
    rows : int
        From the start to the last whole step of the duration.
    """

    step: float
    per_sample: int
    rows: int

    def times(self, first: int, count: int) -> FloatArray:
        """Times of rows [s]."""
        return self.step * np.arange(first, first + count, dtype=np.float64)


def timing(
    scenario: Scenario,
    control: TractionController,
    step: float | None = None,
    *,
    longest: float = LONGEST_STEP,
) -> Timing:
    """Timing of a scenario under a controller.

    Parameters
    ----------
    scenario : Scenario
        Of which duration and axle count.
    control : TractionController
        Of which the sample time counts.
    step : float, optional
        Longest time between rows [s]; the sample time, but at most `longest` and a twentieth of
        the axle's vibration, if left out.
    longest : float, optional
        [s].

    Raises
    ------
    ValueError
        If the step is out of range, or there would be too many rows.
    """
    longest = min(control.sample_time, longest) if step is None else step
    if step is None and scenario.drivetrain.axle is not None:
        longest = min(longest, 2.0 * math.pi / scenario.drivetrain.torsional_frequency / 20.0)
    longest = checked_number("step", longest, POSITIVE)
    if control.sample_time / longest > MOST_ROWS:
        raise ValueError(
            f"step = {longest!r} is out of range: must be >= {control.sample_time / MOST_ROWS:.6g},"
            f" as the sample time is {control.sample_time!r}"
        )
    per_sample = max(1, math.ceil(control.sample_time / longest * (1.0 - 1e-9)))
    length = control.sample_time / per_sample
    rows = max(2, math.floor(scenario.duration / length * (1.0 + 1e-9)) + 1)
    if rows > MOST_ROWS:
        raise ValueError(
            f"duration = {scenario.duration!r} has {rows} steps of {length:.6g} s: "
            f"at most {MOST_ROWS}, so the step must be longer"
        )
    return Timing(length, per_sample, rows)
