"""The change of the acceleration from one window of time to the next."""

from __future__ import annotations

import numpy as np

from contactlib.outcomes.rows import Seen, Vehicles
from contactlib.parameters import FloatArray

WINDOW = 0.1  # time over which the acceleration is averaged [s]


class Jerk:
    """Largest |V(t) - 2 V(t + W) + V(t + 2 W)|/W**2 [m/s3]; nan if the speed is held.

    It keeps the rows of two windows; between rows the speed is a straight line.
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
        """Of the rows so far; nan if they are shorter than two windows."""
        return np.where(self._held, np.nan, self._largest / WINDOW**2)


def _at(time: FloatArray, values: FloatArray, when: FloatArray) -> FloatArray:
    """Rows of values at other times, linear in between."""
    after = np.clip(np.searchsorted(time, when), 1, time.size - 1)
    before = after - 1
    part = ((when - time[before]) / (time[after] - time[before]))[:, np.newaxis]
    return np.asarray(values[before] + part * (values[after] - values[before]))
