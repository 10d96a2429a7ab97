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
from contactlib.vehicle.drivetrain import Drivetrain

WINDOW = 0.1  # time over which the jerk's acceleration is averaged [s]
RECOVERED = 0.9  # fraction of the transmittable force that counts as recovered [1]
STAYS = 1.0  # time without a lack of force after which a recovery is complete [s]
JUMP = 0.05  # change from row to row that counts as a jump / nominal friction or grip [1]
NEGLIGIBLE = 0.01  # lack of force that is ignored / grip [1]


class Rows(Protocol):
    """Signals of some rows of n runs."""

    @property
    def time(self) -> FloatArray:
        """Times of the rows [s]."""

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal, shape (rows, n)."""


class Vehicles(NamedTuple):
    """Parameters of the n drivetrains that outcomes use; arrays of shape (n,).

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
    """

    radius: FloatArray
    inertia: FloatArray
    damping: FloatArray
    inverse_mass: FloatArray
    grip: FloatArray
    held: NDArray[np.bool_]
    rigid: NDArray[np.bool_]

    @classmethod
    def of(cls, drivetrains: Sequence[Drivetrain]) -> Self:
        """Collect the parameters of drivetrains."""
        bodies = [train.wheelset for train in drivetrains]
        elements = [body.element for body in bodies]
        return cls(
            np.array([body.radius for body in bodies]),
            np.array([body.inertia for body in bodies]),
            np.array([body.damping for body in bodies]),
            np.array([0.0 if body.mass is None else 1.0 / body.mass for body in bodies]),
            np.array([one.friction.kinetic * one.normal_load for one in elements]),
            np.array([body.speed_held for body in bodies]),
            np.array([train.axle is None for train in drivetrains]),
        )


class Seen:
    """Rows, with derived signals that several outcomes share."""

    def __init__(self, rows: Rows, vehicles: Vehicles) -> None:
        self._rows, self.vehicles = rows, vehicles

    @property
    def time(self) -> FloatArray:
        """Times of the rows [s]."""
        return self._rows.time

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal, shape (rows, n)."""
        return self._rows[name]

    @cached_property
    def transmittable(self) -> tuple[FloatArray, FloatArray]:
        """Creep force in the demand's direction s Q, and transmittable force Q_t [N].

        Q_t is the smaller of the available force and the size of the force that the demand asks
        for; s is the sign of the latter.
        """
        v, force = self.vehicles, self["creep_force"]
        turning = v.inertia / v.radius
        left = self["demand"] - (v.damping / v.radius) * self["speed"]
        # F/M = Q/M - dV/dt; 1/M is zero if the speed is held.
        left = left + turning * (force * v.inverse_mass - self["acceleration"])
        demanded = left / (v.radius + turning * v.inverse_mass)
        wanted = np.minimum(self["available_force"], np.abs(demanded))
        return np.sign(demanded) * force, wanted


Quantity = Callable[[Seen], FloatArray]


class Observer(Protocol):
    """Reduces the rows of n runs, block by block, to one number for each run."""

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far, shape (n,)."""


class Joint:
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
        self._quantity, self._demanded, self._joint = quantity, demanded, Joint()
        self._twice: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        y, demand, time = self._joint(self._quantity(rows), rows["demand"], rows.time)
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
        self._quantity, self._joint = quantity, Joint()
        self._sum: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        y, time = self._joint(self._quantity(rows), rows.time)
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
        self._least: FloatArray | None = None
        self._largest: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        y = self._quantity(rows)
        least, largest = y.min(axis=0), y.max(axis=0)
        if self._least is not None and self._largest is not None:
            least, largest = np.minimum(self._least, least), np.maximum(self._largest, largest)
        self._least, self._largest = least, largest

    def value(self) -> FloatArray:
        """Return the largest value."""
        return _known(self._largest)

    def range(self) -> FloatArray:
        """Return the difference of largest and smallest value."""
        return _known(self._largest) - _known(self._least)


class Ends:
    """First and last value of a quantity."""

    def __init__(self, quantity: Quantity) -> None:
        self._quantity = quantity
        self._first: FloatArray | None = None
        self._last: FloatArray | None = None

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
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


class Together:
    """Combines several observers by a function of them."""

    def __init__(self, value: Callable[..., FloatArray], *observers: Observer) -> None:
        self._value, self._observers = value, observers

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        for observer in self._observers:
            observer.see(rows)

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

    def __init__(self, vehicles: Vehicles) -> None:
        self._held = vehicles.held
        self._largest = np.full(self._held.size, np.nan)
        self._time = np.zeros(0)
        self._speed = np.zeros((0, self._held.size))

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
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
    """Metric ``recovery_time`` of `contactlib.runs.outcomes.Metrics`."""

    def __init__(self, vehicles: Vehicles) -> None:
        n = vehicles.grip.size
        torque = vehicles.radius * vehicles.grip
        self._negligible = NEGLIGIBLE * vehicles.grip
        self._jumps = {
            "friction_scale_left": np.full(n, JUMP),
            "friction_scale_right": np.full(n, JUMP),
            "demand": JUMP * torque,
        }
        self._moved = {name: np.zeros(n, dtype=np.bool_) for name in self._jumps}
        self._joint = Joint()
        self._changes = np.zeros(n, dtype=np.bool_)  # the last row
        self._changed = np.zeros(n, dtype=np.bool_)  # any row so far
        self._over = np.ones(n, dtype=np.bool_)  # recovered, until the next change
        self._since = np.full(n, np.nan)  # time of the first lack not yet recovered from
        self._back = np.full(n, np.nan)  # time of the first row after the last lack
        self._last = np.full(n, np.nan)  # time of the last lack
        self._longest = np.zeros(n)
        self._end = 0.0, np.zeros(n, dtype=np.bool_)  # time and lack of the last row

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        force, wanted = rows.transmittable
        lack = np.maximum((1.0 - RECOVERED) * wanted, self._negligible)
        lacking = (wanted - force > lack) & (rows["demand"] != 0.0)
        signals = [rows[name] for name in self._jumps]
        time, lacking, *signals = self._joint(rows.time, lacking, *signals)
        changes = np.zeros(lacking.shape, dtype=np.bool_)
        changes[0] = self._changes
        for (name, jump), signal in zip(self._jumps.items(), signals, strict=True):
            step = np.abs(np.diff(signal, axis=0))
            moves = np.concatenate([self._moved[name][np.newaxis], step != 0.0])
            changes[1:] |= (moves[1:] & ~moves[:-1]) | (step > jump)
            self._moved[name] = moves[-1]
        # The last row waits for the next block: no controller can react to a run's last row.
        for i, t in enumerate(time[:-1].tolist()):
            self._row(t, changes[i], lacking[i])
        self._changes, self._end = changes[-1], (float(time[-1]), lacking[-1])

    def value(self) -> FloatArray:
        """Return the numbers of the rows so far."""
        time, lacking = self._end
        self._row(time, np.zeros_like(lacking), lacking)
        waits = ~np.isnan(self._since)
        last = np.where(np.isnan(self._back), np.inf, self._back - self._since)
        longest = np.where(waits, np.maximum(self._longest, last), self._longest)
        return np.where(self._changed, longest, np.nan)

    def _row(self, time: float, changes: NDArray[np.bool_], lacking: NDArray[np.bool_]) -> None:
        waits = ~np.isnan(self._since)
        if not (waits.any() or changes.any() or (lacking & ~self._over).any()):
            return
        back = ~np.isnan(self._back)
        stays = waits & back & (time - self._last > STAYS)
        answered = waits & back & (changes | stays)
        took = np.where(answered, self._back - self._since, 0.0)
        self._longest = np.maximum(self._longest, took)
        self._since[answered] = self._back[answered] = np.nan
        self._over = (self._over | stays) & ~changes
        self._changed |= changes

        lacks = lacking & ~self._over
        self._since = np.where(lacks & np.isnan(self._since), time, self._since)
        self._last = np.where(lacks, time, self._last)
        self._back[lacks] = np.nan
        comes = ~lacking & ~np.isnan(self._since) & np.isnan(self._back)
        self._back = np.where(comes, time, self._back)
