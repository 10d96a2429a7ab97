"""Runs of many wheelsets side by side under one sampled controller, row by row.

At every sample the controller reads the sensors; its torque, within the drive's limits, is held
until the next. The kernel steps every wheelset from row to row, with the friction of its track and
the load of the row.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from contactlib.base.quantities import MOST_ROWS, POSITIVE, FloatArray, checked_number, shown
from contactlib.base.text import USERS_ERRORS, explained
from contactlib.contact import kernel
from contactlib.files.scenario import Scenario
from contactlib.runs.signals import Block
from contactlib.runs.start import start
from contactlib.traction import Measurement, SensorReader, TractionController
from contactlib.traction.interface import Controller
from contactlib.vehicle.available_force import AvailableForce
from contactlib.vehicle.drivetrain import Motor
from contactlib.vehicle.track import Profile
from contactlib.vehicle.wheel_load import WheelLoad

LONGEST_STEP = 5e-3  # default limit of the time between rows [s]
FRACTIONS = 50  # of a sample time that are tried for a step that is common to controllers
BLOCK = 16_384  # rows times runs in a block
AHEAD = 256  # rows whose profiles are evaluated at once
FREE = Profile.of(0.0)  # placeholder for the held speed of a free wheelset
STATIC = Profile.of(1.0)  # factor on the load


class ManyProfiles:
    """A profile or load over time for each wheelset; equal ones are evaluated once.

    Parameters
    ----------
    profiles : sequence of Profile or WheelLoad
        One for each wheelset.
    """

    def __init__(self, profiles: Sequence[Profile | WheelLoad]) -> None:
        distinct: dict[Profile | WheelLoad, list[int]] = {}
        for i, profile in enumerate(profiles):
            distinct.setdefault(profile, []).append(i)
        self._steady = np.zeros(len(profiles))
        self._moving = []
        for profile, places in distinct.items():
            if isinstance(profile, Profile) and len(set(profile.value)) == 1:
                self._steady[places] = profile.value[0]
            else:
                self._moving.append((profile, places))

    def __call__(self, times: FloatArray) -> FloatArray:
        """Values at times [s], shape (times, n)."""
        found = np.empty((times.size, self._steady.size))
        found[:] = self._steady
        for profile, places in self._moving:
            found[:, places] = profile(times)[:, np.newaxis]
        return found


class Drives:
    """Limits of the drives of n wheelsets, which act at the controller's samples.

    Parameters
    ----------
    motors : sequence of Motor
        Motor of each wheelset.
    radius : ndarray
        Rolling radii [m].
    sample_time : float
        Sample time [s].
    """

    def __init__(self, motors: Sequence[Motor], radius: FloatArray, sample_time: float) -> None:
        limits = [(one.power, one.torque_rate, one.trip_speed) for one in motors]
        found = np.array(
            [[math.inf if limit is None else limit for limit in row] for row in limits]
        )
        self._limited = bool(np.isfinite(found).any())
        self._power, rate, self._trip = found.T
        self._change, self._radius = rate * sample_time, radius
        self._tripped = np.zeros(len(motors), dtype=np.bool_)

    def possible(self, demand: FloatArray, speed: FloatArray) -> FloatArray:
        """Part of the driver's demand [N.m] that the power allows at the vehicle's speed [m/s]."""
        if not self._limited:
            return demand
        with np.errstate(all="ignore"):  # the limit of a wheel that stands is infinite
            return _within(demand, self._power / (np.abs(speed) / self._radius))

    def command(
        self, wanted: FloatArray, last: FloatArray, demand: FloatArray, omega: FloatArray
    ) -> FloatArray:
        """Torque that the drive is commanded until the next sample [N.m].

        Parameters
        ----------
        wanted, last : ndarray
            Torque that the controller asks for now, and the one commanded at the last sample [N.m].
        demand : ndarray
            The driver's demand [N.m].
        omega : ndarray
            Mean angular velocity of the wheels [rad/s].
        """
        if not self._limited:
            return np.array(np.broadcast_to(wanted, demand.shape), dtype=np.float64)
        over = self._radius * np.abs(omega) >= self._trip
        self._tripped = over | (self._tripped & (demand != 0.0))
        with np.errstate(all="ignore"):
            torque = _within(np.where(self._tripped, 0.0, wanted), self._power / np.abs(omega))
            least, most = last - self._change, last + self._change
            return np.asarray(np.minimum(np.maximum(torque, least), most))


def _within(torque: FloatArray, most: FloatArray) -> FloatArray:
    return np.asarray(np.minimum(np.maximum(torque, -most), most))


class Timing(NamedTuple):
    """Rows and samples of a run.

    Attributes
    ----------
    step : float
        Time between rows [s].
    per_sample : int
        Rows from one sample of the controller to the next.
    rows : int
        Number of rows, to the last whole step of the duration.
    """

    step: float
    per_sample: int
    rows: int

    def times(self, first: int, count: int) -> FloatArray:
        """Times of rows [s]."""
        return self.step * np.arange(first, first + count, dtype=np.float64)


def default_step(scenario: Scenario, longest: float = LONGEST_STEP) -> float:
    """Longest time between rows if none is given [s].

    It is `longest`, or less: a twentieth of the period of an elastic axle's swing, a tenth of the
    shortest period in the wheel load.
    """
    load, axle = scenario.wheel_load, scenario.drivetrain.axle
    if load is not None and load.highest_frequency > 0.0:
        longest = min(longest, 0.1 / load.highest_frequency)
    if axle is not None:
        longest = min(longest, 2.0 * math.pi / scenario.drivetrain.torsional_frequency / 20.0)
    return longest


def common_step(longest: float, controls: Sequence[Controller]) -> float:
    """Time between rows that is the same under several controllers [s]: at most `longest`.

    It is a whole fraction of every sample time, or of the shortest if `FRACTIONS` tries find none.
    """
    times = [control.sample_time for control in controls]
    least = max(1, math.ceil(min(times) / longest * (1.0 - 1e-9)))
    steps = [min(times) / n for n in range(least, least + FRACTIONS)]
    for step in steps:
        if all(abs(time / step - round(time / step)) < 1e-6 for time in times):
            return step
    return steps[0]


def timing(scenario: Scenario, control: Controller, step: float | None = None) -> Timing:
    """Timing of a scenario under a controller.

    Parameters
    ----------
    scenario : Scenario
        Its duration and axle matter.
    control : SampledController or TractionController
        Its sample time matters.
    step : float, optional
        Longest time between rows [s]. Default: `default_step`.

    Raises
    ------
    ValueError
        If the step is out of range, or there would be too many rows.
    """
    step = default_step(scenario) if step is None else step
    longest = checked_number("step", step, POSITIVE)
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


class Runs:
    """Runs of n scenarios, row by row.

    Parameters
    ----------
    scenarios : sequence of Scenario
        Their sensors have the same delay; all of their frictions fall with slip speed or none does,
        and all have a wheel load or none has.
    control : TractionController
        Controller of all runs, with parameters stacked.
    timing : Timing
        Common rows and samples.
    index : sequence of int
        Index of each run, from which its noise is drawn.
    tolerance : float
        Relative error of each of the integrator's substeps [1].
    creepage : float, optional
        Creepage at the start [1]. Default: steady under the first demand.

    Attributes
    ----------
    trains : list of Drivetrain
        Drivetrain of each run.
    fleet : NativeFleet
        The drivetrains in the kernel.
    radius : ndarray
        Rolling radii [m].
    failed : ndarray of bool
        Runs that could not start, whose integrator gave up, or whose numbers overflowed; their
        states are frozen.
    refused : dict
        Errors of the runs that could not start, by position.
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
        self._reader = SensorReader(sensors, control.sample_time, index, radius=self.radius)
        self._memory: Any = None
        self.failed, self._substeps = np.zeros(n, dtype=np.bool_), np.zeros(n)

        self._inputs = np.zeros((max(1, BLOCK // n), n), kernel.drivetrain_dtype("input"))
        self._load = np.array([0.5 * body.element.normal_load for body in bodies])
        self._inputs["load_left"] = self._inputs["load_right"] = self._load
        loads = [one.wheel_load or STATIC for one in scenarios]
        self._load_factors = None if set(loads) == {STATIC} else ManyProfiles(loads)
        inputs, (demand, held) = self._inputs[0], self._ahead(0, 1)
        self._drives = Drives([one.motor for one in trains], self.radius, control.sample_time)
        speed = np.array([one.initial_speed for one in scenarios])
        self._demand = self._drives.possible(demand[0], speed)
        for name, values in held.items():
            inputs[name] = values[0]
        self._states = np.zeros(n, kernel.drivetrain_dtype("state"))
        self._advance(inputs, 0, 0.0)  # sets the friction at the start
        begin = start(scenarios, self.fleet, inputs, self._demand, creepage)
        self._states, self._torque, self.refused = begin
        self.failed[list(self.refused)] = True

    @cached_property
    def available(self) -> AvailableForce:
        """Largest creep forces that friction allows."""
        loaded = self._load_factors is not None
        return AvailableForce(self.trains, self._tracks, loaded=loaded)

    def blocks(self) -> Iterator[Block]:
        """Yield all rows in blocks, each of which is valid until the next."""
        inputs, rows = self._inputs, self._timing.rows
        states = np.empty(inputs.shape, self._states.dtype)
        # Views as plain numbers, as numpy copies records field by field.
        kept, now = (each.view(np.float64) for each in (states, self._states))
        stored: list[FloatArray] = []
        for first in range(0, rows, AHEAD):
            demands, held = self._ahead(first, min(AHEAD, rows - first))
            for done in range(0, len(demands), len(inputs)):
                demand = demands[done : done + len(inputs)]
                count = len(demand)
                for name, values in held.items():
                    inputs[name][:count] = values[done : done + count]
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
        """Call controller and drive if a sample is due, and step; limits the demand in place."""
        if row % self._timing.per_sample == 0:
            states = self._states
            turning = states["omega_left"] + states["omega_right"]
            rim = 0.5 * self.radius * turning
            self._demand = self._drives.possible(demand, states["speed"])
            speeds = self._reader.read(rim, states["speed"], self._demand)
            measured = Measurement(self._demand, *speeds, self._torque)
            if row == 0:
                self._memory = self._asked("start", row, measured, self._torque)
            answer = self._asked("sample", row, measured, self._memory)
            if row == 0 and not (
                isinstance(answer, tuple)
                and len(answer) == 2
                and np.shape(answer[0]) in ((), demand.shape)
            ):
                raise ValueError(
                    f"{type(self._control).__name__}.sample returned {shown(answer)}: it must "
                    f"return the torques, an array of the shape {demand.shape}, and the memory"
                )
            wanted, self._memory = answer
            self._torque = self._drives.command(wanted, self._torque, self._demand, 0.5 * turning)
        demand[:] = self._demand
        inputs["commanded_torque"] = self._torque
        self._advance(inputs, row, self._timing.step if row < self._timing.rows - 1 else 0.0)

    def _asked(self, method: str, row: int, *given: Any) -> Any:
        """Answer of a method of the controller at a row."""
        try:
            return getattr(self._control, method)(*given)
        except (ValueError, RuntimeError):  # as of a SampledController, already explained
            raise
        except USERS_ERRORS as error:
            what = f"{type(self._control).__name__}.{method} at {self._timing.step * row:.6g} s"
            raise explained(what, error) from error

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

    def _ahead(self, first: int, count: int) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Demand [N.m] at the sample of each row, and the inputs that change from row to row."""
        rows = np.arange(first, first + count + 1, dtype=np.float64)
        sampled = rows[:-1] - rows[:-1] % self._timing.per_sample
        speeds = self._speeds(self._timing.step * rows)
        held = {"acceleration": np.diff(speeds, axis=0) / self._timing.step}
        if self._load_factors is not None:
            load = self._load * self._load_factors(self._timing.step * rows[:-1])
            held |= {"load_left": load, "load_right": load}
        return self._demands(self._timing.step * sampled), held
