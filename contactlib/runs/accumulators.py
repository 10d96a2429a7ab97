"""Observers that reduce the rows of many runs to outcomes: sums, extremes, jerk and recovery.

Rows are added one by one, in their order, so that a sum depends neither on the number of rows in
a block nor on the number of runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.runs.result import Result
from contactlib.vehicle.drivetrain import Drivetrain

WINDOW = 0.1  # time over which the jerk's acceleration is averaged [s]
# Fraction of the transmittable force that counts as recovered [1]. Limit cycles of cut and re-apply
# use nearly 0.9 in the mean; on a share this close, noise would decide.
RECOVERED = 0.8
RECOVERY_TIME = 1.0  # time over which it has to be recovered in the mean [s]
RESPONSE_TIME = 0.1  # time in which a sampled controller follows a change of the demand [s]
STOPPED_SPEED = 0.1  # speed below which a vehicle has stopped [m/s]
MIN_LOCK_SPEED = 5.0 / 3.6  # speed above which a wheel counts as locked [m/s]
LOCKED = 0.05  # rim speed / vehicle speed below which it is locked [1]
NEGLIGIBLE = 0.01  # lack of force that is ignored / grip [1]


class Rows(Protocol):
    """Signals of some rows of n runs."""

    @property
    def time(self) -> FloatArray:
        """Times of the rows [s]."""

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal, shape (rows, n)."""


class OneRun:
    """Presents a result as the rows of all axles of one run."""

    def __init__(self, result: Result) -> None:
        self._result = result

    @property
    def time(self) -> FloatArray:
        """Times of the rows [s]."""
        return self._result.time

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal, shape (rows, axles)."""
        values = self._result[name]
        if values.ndim > 1:
            return values
        return np.broadcast_to(values[:, np.newaxis], (values.size, self._result.axles))


class DrivetrainArrays(NamedTuple):
    """Parameters of the n drivetrains that outcomes use; arrays of shape (n,).

    Outcomes are of vehicles: of each drivetrain, or of several neighbouring axles.

    Attributes
    ----------
    radius, inertia, damping : ndarray
        Parameters of the wheelset [m, kg.m2, N.m.s/rad].
    inverse_mass : ndarray
        Zero if the speed is held [1/kg].
    grip : ndarray
        Kinetic friction times nominal load [N].
    held, rigid : ndarray of bool
        Whether the speed is held; whether the axle is rigid.
    minimum_speed : ndarray
        Minimum speed of the creepage, below which a brake has stopped the vehicle [m/s].
    braked : ndarray of bool
        Whether there is a brake.
    padded : ndarray of bool
        Whether the friction of its pads changes.
    axles : int
        Number of drivetrains that make a vehicle.
    """

    radius: FloatArray
    inertia: FloatArray
    damping: FloatArray
    inverse_mass: FloatArray
    grip: FloatArray
    held: NDArray[np.bool_]
    rigid: NDArray[np.bool_]
    minimum_speed: FloatArray
    braked: NDArray[np.bool_]
    padded: NDArray[np.bool_]
    axles: int = 1

    @classmethod
    def of(cls, drivetrains: Sequence[Drivetrain], axles: int = 1) -> Self:
        """Collect the parameters of drivetrains; `axles` neighbours make a vehicle."""
        bodies = [train.wheelset for train in drivetrains]
        elements = [body.element for body in bodies]
        return cls(
            np.array([body.radius for body in bodies]),
            np.array([body.inertia for body in bodies]),
            np.array([body.damping for body in bodies]),
            np.array([0.0 if body.mass is None else 1.0 / body.mass for body in bodies]),
            np.array([element.friction.kinetic * element.axle_load for element in elements]),
            np.array([body.speed_held for body in bodies]),
            np.array([train.axle is None for train in drivetrains]),
            np.array([element.minimum_speed for element in elements]),
            np.array([train.brake is not None for train in drivetrains]),
            np.array([bool(train.brake and train.brake.pads) for train in drivetrains]),
            axles,
        )

    def first(self, values: FloatArray) -> FloatArray:
        """Value of each vehicle's first axle; the last axis has the axles of all."""
        return values[..., :: self.axles]

    def total(self, values: FloatArray) -> FloatArray:
        """Sum over each vehicle's axles."""
        return values if self.axles == 1 else np.asarray(self._by_axle(values).sum(axis=-1))

    def largest(self, values: FloatArray) -> FloatArray:
        """Largest value of each vehicle's axles that is not nan."""
        return values if self.axles == 1 else np.asarray(np.fmax.reduce(self._by_axle(values), -1))

    def _by_axle(self, values: FloatArray) -> FloatArray:
        return values.reshape(*values.shape[:-1], -1, self.axles)


class DerivedRows:
    """Rows or a part of them, with derived signals that several outcomes share."""

    def __init__(
        self, rows: Rows, drivetrains: DrivetrainArrays, part: slice = slice(None)
    ) -> None:
        self._rows, self.drivetrains, self._part = rows, drivetrains, part

    @property
    def time(self) -> FloatArray:
        """Times of the rows [s]."""
        return self._rows.time[self._part]

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal, shape (rows, n)."""
        return self._demand if name == "demand" else self._rows[name][self._part]

    @cached_property
    def _demand(self) -> FloatArray:
        """Demanded torque on the axle [N.m]; that of a brake by its pads, against the motion."""
        demand, braked = self._rows["demand"][self._part], self.drivetrains.braked
        if not braked.any():
            return demand
        moving = np.where(self.moves, np.sign(self["speed"]), 0.0)
        return np.asarray(np.where((demand < 0.0) & braked, demand * moving * self._pads, demand))

    @cached_property
    def _pads(self) -> FloatArray | float:
        """Friction of the brakes' pads over the nominal one [1]."""
        return self["pad_friction"] if self.drivetrains.padded.any() else 1.0

    @cached_property
    def applied(self) -> FloatArray:
        """Torque of the brakes at nominal friction of their pads, as that of their air [N.m]."""
        return self["brake_torque"] / self._pads

    @cached_property
    def moves(self) -> NDArray[np.bool_]:
        """Whether the vehicle is at least as fast as the minimum speed, shape (rows, n)."""
        return np.asarray(np.abs(self["speed"]) >= self.drivetrains.minimum_speed)

    @cached_property
    def brake_demand(self) -> FloatArray:
        """Torque that a brake follows, also one that holds a standing vehicle [N.m]."""
        return np.where(
            self.drivetrains.braked, np.maximum(-self._rows["demand"][self._part], 0.0), 0.0
        )

    @cached_property
    def braking(self) -> FloatArray:
        """1 where the demand is against the motion, else 0, shape (rows, n)."""
        return np.where(self["demand"] * self["speed"] < 0.0, 1.0, 0.0)

    @cached_property
    def limited(self) -> NDArray[np.bool_]:
        """Whether the demand exceeds the available force, shape (rows, n)."""
        limited = self.transmittable[1] >= self["available_force"]
        return np.asarray(limited & (self["demand"] != 0.0))

    @cached_property
    def transmittable(self) -> tuple[FloatArray, FloatArray]:
        """Creep force in the demand's direction s Q, and transmittable force Q_t [N].

        Q_t is the smaller of the available force and the magnitude of the demanded force; s is the
        sign of the latter.
        """
        v, force = self.drivetrains, self["creep_force"]
        turning = v.inertia / v.radius
        left = self["demand"] - (v.damping / v.radius) * self["speed"]
        # F/M = Q/M - dV/dt; 1/M is zero if the speed is held.
        left = left + turning * (force * v.inverse_mass - self["acceleration"])
        demanded = left / (v.radius + turning * v.inverse_mass)
        possible = np.minimum(self["available_force"], np.abs(demanded))
        return np.sign(demanded) * force, possible


Quantity = Callable[[DerivedRows], FloatArray]


class Accumulator(Protocol):
    """Reduces the rows of n runs, block by block, to one number for each run."""

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far, shape (n,)."""


class BlockJoiner:
    """Prepends the last row of the previous block to a block."""

    def __init__(self) -> None:
        self._last: tuple[FloatArray, ...] = ()

    def __call__(self, *signals: FloatArray) -> tuple[FloatArray, ...]:
        """Return the signals with that row, if there is one."""
        joined = signals
        if self._last:
            pairs = zip(self._last, signals, strict=True)
            joined = tuple(np.concatenate(pair) for pair in pairs)
        self._last = tuple(signal[-1:].copy() for signal in signals)
        return joined


class Integral:
    """Trapezoidal integral of a quantity over time; `demanded`: only while there is a demand."""

    def __init__(self, quantity: Quantity, *, demanded: bool = False) -> None:
        self._quantity, self._demanded, self._join = quantity, demanded, BlockJoiner()
        self._twice: FloatArray | None = None

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        y, demand, time = self._join(self._quantity(rows), rows["demand"], rows.time)
        if self._twice is None:
            self._twice = np.zeros(y.shape[1])
        parts = np.diff(time)[:, np.newaxis] * (y[1:] + y[:-1])
        if self._demanded:
            parts *= demand[:-1] != 0.0
        for part in parts:
            self._twice += part

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far."""
        return 0.5 * _known(self._twice)


class HeldIntegral:
    """Integral over time of a quantity that is constant from each row to the next."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity, self._join = quantity, BlockJoiner()
        self._sum: FloatArray | None = None

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        y, time = self._join(self._quantity(rows), rows.time)
        if self._sum is None:
            self._sum = np.zeros(y.shape[1])
        for part in np.diff(time)[:, np.newaxis] * y[:-1]:
            self._sum += part

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far."""
        return _known(self._sum)


class Extremes:
    """Smallest and largest value of a quantity."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity = quantity
        self._smallest: FloatArray | None = None
        self._largest: FloatArray | None = None

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        y = self._quantity(rows)
        smallest, largest = y.min(axis=0), y.max(axis=0)
        if self._smallest is not None and self._largest is not None:
            smallest, largest = (
                np.minimum(self._smallest, smallest),
                np.maximum(self._largest, largest),
            )
        self._smallest, self._largest = smallest, largest

    def value(self) -> FloatArray:
        """Return the largest value."""
        return _known(self._largest)

    def range(self) -> FloatArray:
        """Return the difference of largest and smallest value."""
        return _known(self._largest) - _known(self._smallest)


class Ends:
    """First and last value of a quantity."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity = quantity
        self._first: FloatArray | None = None
        self._last: FloatArray | None = None

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        y = self._quantity(rows)
        if self._first is None:
            self._first = y[0].copy()
        self._last = y[-1].copy()

    def value(self) -> FloatArray:
        """Return the last value."""
        return _known(self._last)

    def change(self) -> FloatArray:
        """Return the difference of last and first value."""
        return _known(self._last) - _known(self._first)


class Falls:
    """Sum of all falls of a quantity from row to row."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity, self._join = quantity, BlockJoiner()
        self._sum: FloatArray | None = None

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        (y,) = self._join(self._quantity(rows))
        if self._sum is None:
            self._sum = np.zeros(y.shape[1])
        for part in np.maximum(-np.diff(y, axis=0), 0.0):
            self._sum += part

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far."""
        return _known(self._sum)


class Stop:
    """Outcome ``stopping_distance``: way from the first demand of braking to standstill [m].

    Attributes
    ----------
    rows : int
        Number of rows so far.
    last : ndarray
        Row in which each vehicle has stopped; -1 if it has not.
    """

    def __init__(self, drivetrains: DrivetrainArrays) -> None:
        self._of = drivetrains
        self.rows, self.last = 0, np.full(drivetrains.radius.size // drivetrains.axles, -1)
        self._begin: FloatArray | None = None  # places; nan before braking
        self._end: FloatArray | None = None

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        v = self._of
        braking = v.largest(rows.braking) > 0.0
        stands = np.abs(v.first(rows["speed"])) < STOPPED_SPEED
        distance = v.first(rows["distance"])
        if self._begin is None or self._end is None:
            self._begin, self._end = (np.full(distance.shape[1], np.nan) for _ in range(2))
        for place, on, still in zip(distance, braking, stands, strict=True):
            self._begin = np.where(np.isnan(self._begin) & on, place, self._begin)
            over = still & np.isnan(self._end) & ~np.isnan(self._begin)
            self._end = np.where(over, place, self._end)
            self.last = np.where(over, self.rows, self.last)
            self.rows += 1

    def value(self) -> FloatArray:
        """Return the ways of the rows so far: infinite without a stop, nan without braking."""
        way = np.abs(_known(self._end) - _known(self._begin))
        return np.where(np.isnan(way) & ~np.isnan(_known(self._begin)), np.inf, way)


class Locked:
    """Largest amount that passes while a wheel of an axle is locked: time, or slip work.

    Parameters
    ----------
    amount : callable
        Gives the amount up to each row, shape (rows, n).
    """

    def __init__(self, amount: Quantity) -> None:
        self._amount, self._join = amount, BlockJoiner()
        self._now: FloatArray | None = None
        self._largest: FloatArray | None = None

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        speed = np.abs(rows["speed"])
        rim = np.minimum(np.abs(rows["omega_left"]), np.abs(rows["omega_right"]))
        rolls = (speed <= MIN_LOCK_SPEED) | (rows.drivetrains.radius * rim >= LOCKED * speed)
        locked, amount = self._join(np.where(rolls, 0.0, 1.0), self._amount(rows))
        if self._now is None or self._largest is None:
            self._now = self._largest = np.zeros(speed.shape[1])
        for part, on in zip(np.diff(amount, axis=0), locked[:-1], strict=True):
            self._now = np.where(on > 0.0, self._now + part, 0.0)
            self._largest = np.maximum(self._largest, self._now)

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far."""
        return _known(self._largest)


class Combined:
    """Combines several accumulators by a function of them."""

    def __init__(self, value: Callable[..., FloatArray], *accumulators: Accumulator) -> None:
        self._value, self._observers = value, accumulators

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        for accumulator in self._observers:
            accumulator.add(rows)

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far."""
        return self._value(*self._observers)


def _known(values: FloatArray | None) -> FloatArray:
    if values is None:
        raise ValueError("there is no row yet")
    return values


class Jerk:
    """Metric ``jerk`` of `contactlib.runs.outcomes.Metrics`.

    Keeps the rows of two windows and interpolates the speed linearly between rows.
    """

    def __init__(self, drivetrains: DrivetrainArrays) -> None:
        self._held = drivetrains.held
        self._largest = np.full(self._held.size, np.nan)
        self._time = np.zeros(0)
        self._speed = np.zeros((0, self._held.size))

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        time = np.concatenate([self._time, rows.time])
        speed = np.concatenate([self._speed, rows["speed"]])
        done = np.count_nonzero(time + 2.0 * WINDOW <= time[-1])
        if done:
            v1, v2 = (_at(time, speed, time[:done] + i * WINDOW) for i in (1, 2))
            second = np.abs(speed[:done] - 2.0 * v1 + v2).max(axis=0)
            self._largest = np.fmax(self._largest, second)
        self._time, self._speed = time[done:], speed[done:]

    def value(self) -> FloatArray:
        """Return the jerk of the rows so far; nan if they are shorter than two windows."""
        return np.where(self._held, np.nan, self._largest / WINDOW**2)


def _at(time: FloatArray, values: FloatArray, when: FloatArray) -> FloatArray:
    """Interpolate rows of values linearly at other times."""
    after = np.clip(np.searchsorted(time, when), 1, time.size - 1)
    before = after - 1
    part = ((when - time[before]) / (time[after] - time[before]))[:, np.newaxis]
    return np.asarray(values[before] + part * (values[after] - values[before]))


class Recovery:
    """Metric ``recovery_time`` of `contactlib.runs.outcomes.Metrics`.

    Keeps the rows of one window. The surplus is the lack that does not count minus the shortfall.
    """

    def __init__(self, drivetrains: DrivetrainArrays) -> None:
        n = drivetrains.grip.size
        self._negligible = NEGLIGIBLE * drivetrains.grip
        self._join = BlockJoiner()
        self._time = np.zeros(0)
        self._lacks = np.zeros((0, n), dtype=np.bool_)  # whether the surplus is negative
        self._slips = np.zeros((0, n), dtype=np.bool_)  # whether slip or its control is the cause
        self._before = np.zeros(0), np.zeros((0, n))  # times and demands of the last moments
        self._sum = np.zeros((0, n))  # integral of the surplus up to each row
        self._since = np.full(n, np.nan)  # time of the first lack not yet recovered from
        self._longest = np.zeros(n)

    def add(self, rows: DerivedRows) -> None:
        """Add the next rows."""
        force, possible = rows.transmittable
        surplus = np.maximum((1.0 - RECOVERED) * possible, self._negligible)
        surplus -= np.where(rows["demand"] != 0.0, np.maximum(possible - force, 0.0), 0.0)
        lacks = np.concatenate([self._lacks, surplus < 0.0])
        slips = np.concatenate([self._slips, (rows["falling_branch"] > 0.0) | self._held(rows)])
        time = np.concatenate([self._time, rows.time])
        surplus, when = self._join(surplus, rows.time)
        parts = 0.5 * np.diff(when)[:, np.newaxis] * (surplus[1:] + surplus[:-1])
        sums = self._sum if self._time.size else np.zeros((1, self._since.size))
        sums = np.concatenate([sums, np.cumsum(np.concatenate([sums[-1:], parts]), axis=0)[1:]])
        done = int(np.count_nonzero(time + RECOVERY_TIME <= time[-1]))
        later = np.searchsorted(time, time[:done] + RECOVERY_TIME, side="right") - 1
        self._time, self._lacks, self._slips = time, lacks, slips
        self._since, self._longest = self._answered(sums[later] >= sums[:done])
        self._time, self._lacks, self._slips = time[done:], lacks[done:], slips[done:]
        self._sum = sums[done:].copy()

    def _held(self, rows: DerivedRows) -> NDArray[np.bool_]:
        """Whether less is commanded than the driver demands and did a moment ago."""
        time, demand = self._before
        time = np.concatenate([time, rows.time])
        demand = np.concatenate([demand, np.abs(rows["demand"])])
        before = np.maximum(np.searchsorted(time, rows.time - RESPONSE_TIME, side="right") - 1, 0)
        least = np.minimum(demand[before], demand[-rows.time.size :])
        first = int(np.searchsorted(time, time[-1] - 2.0 * RESPONSE_TIME))
        self._before = time[first:], demand[first:]
        return np.asarray(np.abs(rows["commanded_torque"]) < RECOVERED * least)

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far."""
        good = self._sum[-1] >= self._sum[0]  # in the mean over the last second
        since, longest = self._answered(np.broadcast_to(good, self._lacks.shape))
        unfinished = np.where(good, self._time[-1] - since, np.inf)
        return np.where(np.isnan(since), longest, np.maximum(longest, unfinished))

    def _answered(self, lasts: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """Begin of a recovery not ended by the first kept rows, nan if none, and the longest one.

        `lasts` contains for these rows whether no force lacks in the mean over the window.
        """
        since, longest = self._since, self._longest
        rows = zip(self._time.tolist(), self._lacks, self._slips, lasts, strict=False)
        for t, lacking, slips, good in rows:
            waits = ~np.isnan(since)
            if waits.any() or lacking.any():
                ends = waits & good & ~lacking
                longest = np.where(ends, np.maximum(longest, t - since), longest)
                since = np.where(ends, np.nan, np.where(lacking & slips & ~waits, t, since))
        return since, longest
