"""Runs of many wheelsets at once, under one controller: one row after another, for all of them.

The controller is asked every sample time and sees what the sensors tell; its torque is held in
between. The kernel steps every wheelset from row to row, with friction as its track has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from contactlib import kernel
from contactlib.fleet.available import AvailableForce
from contactlib.fleet.profiles import ManyProfiles
from contactlib.fleet.signals import Block
from contactlib.fleet.start import start
from contactlib.fleet.timing import Timing
from contactlib.parameters import FloatArray
from contactlib.profile import Profile
from contactlib.scenario import Scenario
from contactlib.traction import Measurement, SensorReader, TractionController

BLOCK = 16_384  # rows times runs that are kept at once
AHEAD = 256  # rows whose profiles are read at once
FREE = Profile.of(0.0)  # stands for the speed that is not held


class Runs:
    """Runs of n scenarios, row by row.

    Parameters
    ----------
    scenarios : sequence of Scenario
        What is driven. Their sensors have the same delay, and their frictions all fall with slip
        speed or all do not.
    control : TractionController
        For all of them.
    timing : Timing
        Of all of them.
    index : sequence of int
        Of each among all that there are: its noise is its own.
    tolerance : float
        Relative error of each of the integrator's substeps [1].
    creepage : float, optional
        At the start [1]; steady under the first demand if left out.

    Attributes
    ----------
    trains : list of Drivetrain
        Of each run.
    fleet : NativeFleet
        The same for the kernel.
    radius : ndarray
        Rolling radii [m].
    failed : ndarray of bool
        Runs that could not start, whose integrator gave up, or whose numbers overflowed; they stay
        where they are.
    refused : dict
        Why those could not start that could not, by place.
    """

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        control: TractionController,
        timing: Timing,
        *,
        index: Sequence[int],
        tolerance: float,
        creepage: float | None = None,
    ) -> None:
        self._control, self._timing, self._tolerance = control, timing, tolerance
        trains, tracks = [one.drivetrain for one in scenarios], [one.track for one in scenarios]
        bodies, n = [train.wheelset for train in trains], len(scenarios)
        members = [t.member(track.native) for t, track in zip(trains, tracks, strict=True)]
        self.fleet = kernel.NativeFleet(members)
        self.trains, self._tracks = trains, tracks
        self.radius = np.array([body.radius for body in bodies])
        self._demands = ManyProfiles([one.demand for one in scenarios])
        self._speeds = ManyProfiles([one.held_speed or FREE for one in scenarios])
        sensors = [one.sensors for one in scenarios]
        self._reader = SensorReader(sensors, control.sample_time, index)
        self._memory: Any = None
        self.failed, self._substeps = np.zeros(n, dtype=np.bool_), np.zeros(n)

        self._inputs = np.zeros((max(1, BLOCK // n), n), kernel.drivetrain_dtype("input"))
        load = [0.5 * body.element.contact.normal_load for body in bodies]
        self._inputs["load_left"] = self._inputs["load_right"] = load
        inputs, (demand, acceleration) = self._inputs[0], self._ahead(0, 1)
        inputs["acceleration"] = acceleration[0]
        self._states = np.zeros(n, kernel.drivetrain_dtype("state"))
        self._advance(inputs, 0, 0.0)  # tells the friction there
        begin = start(scenarios, self.fleet, inputs, demand[0], creepage)
        self._states, self._torque, self.refused = begin
        self.failed[list(self.refused)] = True

    @cached_property
    def available(self) -> AvailableForce:
        """Largest creep forces that friction allows."""
        return AvailableForce(self.trains, self._tracks)

    def blocks(self) -> Iterator[Block]:
        """All rows, some at a time; a block is valid until the next one is asked for."""
        inputs, rows = self._inputs, self._timing.rows
        states = np.empty(inputs.shape, self._states.dtype)
        # As plain numbers: numpy copies records field by field.
        kept, now = (each.view(np.float64) for each in (states, self._states))
        stored: list[FloatArray] = []
        for first in range(0, rows, AHEAD):
            demands, accelerations = self._ahead(first, min(AHEAD, rows - first))
            for done in range(0, len(demands), len(inputs)):
                demand = demands[done : done + len(inputs)]
                count = len(demand)
                inputs["acceleration"][:count] = accelerations[done : done + count]
                for i in range(count):
                    kept[i] = now
                    self._row(first + done + i, demand[i], inputs[i])
                self.failed |= ~np.isfinite(now.reshape(self.failed.size, -1)).all(axis=1)
                yield Block(
                    self._timing.times(first + done, count),
                    demand,
                    inputs[:count],
                    states[:count],
                    self,
                    stored,
                )

    def _row(self, row: int, demand: FloatArray, inputs: Any) -> None:
        """Ask the controller, if it is time to, and step on to the next row."""
        if row % self._timing.per_sample == 0:
            states = self._states
            rim = 0.5 * self.radius * (states["omega_left"] + states["omega_right"])
            measured = Measurement(demand, *self._reader.read(rim, states["speed"]))
            if row == 0:
                self._memory = self._control.start(measured, self._torque)
            self._torque, self._memory = self._control.sample(measured, self._memory)
        inputs["commanded_torque"] = self._torque
        self._advance(inputs, row, self._timing.step if row < self._timing.rows - 1 else 0.0)

    def _advance(self, inputs: Any, row: int, step: float) -> None:
        self.fleet.advance(
            inputs,
            self._states,
            self._timing.step * row,
            step,
            self._tolerance,
            self._substeps,
            self.failed,
        )

    def _ahead(self, first: int, count: int) -> tuple[FloatArray, FloatArray]:
        """Demand of some rows, that of their sample [N.m], and acceleration of held speeds."""
        rows = np.arange(first, first + count + 1, dtype=np.float64)
        sampled = rows[:-1] - rows[:-1] % self._timing.per_sample
        speeds = self._speeds(self._timing.step * rows)
        return (
            self._demands(self._timing.step * sampled),
            np.diff(speeds, axis=0) / self._timing.step,
        )
