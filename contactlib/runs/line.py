"""What a line asks of vehicles: speed limits, the torque of their drivers, the pull of a train."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.files.scenario import Scenario
from contactlib.vehicle.track import Profile

OfPlace = TypeVar("OfPlace")  # what can be a key

UNLIMITED = Profile.of(np.finfo(float).max)
RESERVE = 0.85  # part of the driver's deceleration that is planned
BELOW, SHARE_BELOW = 0.3, 0.05  # how far below a speed the driver aims [m/s], and as its share
SHORTEST_WAY = 1e-6  # over which a mean is taken [m]
SHORTEST = 2.0  # time constant with which the driver corrects the speed [s]
LAGS = 4.0  # of the brake in that time constant: then the speed does not swing


def grouped(profiles: Sequence[OfPlace]) -> list[tuple[OfPlace, NDArray[np.intp]]]:
    """Different profiles, and the numbers of those that are equal to each."""
    groups: dict[OfPlace, list[int]] = {}
    for i, profile in enumerate(profiles):
        groups.setdefault(profile, []).append(i)
    return [(profile, np.array(numbers)) for profile, numbers in groups.items()]


class Along:
    """A profile for each of n axles by its own place; equal ones are evaluated once.

    Parameters
    ----------
    profiles : sequence of Profile
        One for each axle.
    """

    def __init__(self, profiles: Sequence[Profile]) -> None:
        self._groups = grouped(profiles)

    def __call__(self, distance: FloatArray) -> FloatArray:
        """Values at distances, shape (..., n)."""
        if len(self._groups) == 1:
            return self._groups[0][0](distance)
        values = np.empty(distance.shape)
        for profile, axles in self._groups:
            values[..., axles] = profile(distance[..., axles])
        return values


class Line:
    """Speed limits, drivers and trains of vehicles with the same number of axles.

    Parameters
    ----------
    scenarios : sequence of Scenario
        One for each vehicle.
    sample_time : float
        Time over which the driver takes the fall of the speed to be kept [s].
    """

    def __init__(self, scenarios: Sequence[Scenario], sample_time: float) -> None:
        self._axles, self._ahead = scenarios[0].axles, sample_time
        held = cache(Profile.held_behind)  # many vehicles may run on one line
        limits = list[Profile]()
        for one in scenarios:
            limit, length = one.track.speed_limit, one.vehicle and one.vehicle.length
            every = [UNLIMITED if limit is None else limit] * one.axles
            if limit is not None and length is not None:
                every[0] = held(limit, length)
            limits += every
        grades = [one.track.grade for one in scenarios for _ in range(one.axles)]
        self._limits, self._grades = Along(limits), Along(grades)
        self._driven_by(scenarios, limits)
        self._towed_by(scenarios)

    def _of(self, numbers: list[float]) -> FloatArray:
        return np.array(numbers, dtype=np.float64)

    def _driven_by(self, scenarios: Sequence[Scenario], limits: Sequence[Profile]) -> None:
        """Prepare the torque of the drivers."""
        drivers = [one.driver for one in scenarios]
        self.has_driver = np.array([driver is not None for driver in drivers])
        keeping = [0.0 if driver is None else driver.deceleration for driver in drivers]
        kept = cache(Profile.kept_by)
        curves = [[UNLIMITED] * len(limits), [UNLIMITED] * len(limits)]
        for i, limit in enumerate(limits):
            a = RESERVE * keeping[i // self._axles]
            if a > 0.0:
                curves[0][i] = kept(limit, a)
                curves[1][i] = kept(limit.mirrored(), a)
        self._curves = Along(curves[0]), Along(curves[1])
        self._braking = self._of(keeping)
        trains = [one.drivetrain for one in scenarios]
        bodies = [train.wheelset for train in trains]
        self._lag = self._of([train.brake_lag for train in trains])
        self._time = np.maximum(SHORTEST, LAGS * self._lag)
        self._radius = self._of([body.radius for body in bodies])
        self._mass = self._of([body.mass or 0.0 for body in bodies])  # of each axle
        turning = self._of([body.inertia for body in bodies]) / self._radius**2
        self._moved = self._axles * (self._mass + turning)
        davis = [(r.constant, r.linear, r.quadratic) for r in (body.resistance for body in bodies)]
        self._constant, linear, self._quadratic = np.array(davis, dtype=np.float64).T
        self._linear = linear + self._of([body.damping for body in bodies]) / self._radius**2
        self._own_grade = self._of([body.resistance.grade for body in bodies])
        self._acting = np.sum([one.shares_of_demand for one in scenarios], axis=2).T
        self._braked = np.array([train.brake is not None for train in trains])

    def _towed_by(self, scenarios: Sequence[Scenario]) -> None:
        """Prepare the pull of trains that stand on other grades than their vehicles."""
        trains: dict[tuple[Profile, float, float, float], list[int]] = {}
        for i, one in enumerate(scenarios):
            vehicle, grade = one.vehicle, one.track.grade
            if vehicle is None or vehicle.length is None or len(set(grade.value)) == 1:
                continue
            train = grade, vehicle.train_mass, vehicle.position[-1], vehicle.length
            if vehicle.train_mass > 0.0 and vehicle.length > vehicle.position[-1]:
                trains.setdefault(train, []).append(i)
        self.towing = [(np.array(vehicles), *train) for train, vehicles in trains.items()]

    def limit(self, distance: FloatArray) -> FloatArray:
        """Lowest speed limit under each vehicle, at its axles [m/s]; inf without one.

        Parameters
        ----------
        distance : ndarray
            Distances of all axles [m], shape (..., n).
        """
        lowest = self._vehicles(self._limits(distance)).min(axis=-1)
        lowest[lowest == UNLIMITED.value[0]] = np.inf
        return np.repeat(lowest, self._axles, axis=-1)

    def fading(self, distance: FloatArray) -> FloatArray:
        """Limits before which traction fades, as nobody brakes for them: as `limit`."""
        free = np.repeat(self.has_driver, self._axles)
        return np.where(free, np.inf, self.limit(distance))

    def pull(self, distance: FloatArray, way: FloatArray) -> FloatArray:
        """Mean force of trains that are on other grades than their vehicles, for each axle [N].

        Parameters
        ----------
        distance, way : ndarray
            Distances of all axles, and the way from there over which the mean is meant [m].
        """
        places = self._vehicles(distance)
        ways = self._vehicles(np.where(np.abs(way) < SHORTEST_WAY, SHORTEST_WAY, way))
        force = np.zeros(len(places))
        for vehicles, grade, mass, near, far in self.towing:
            at, on = places[vehicles], ways[vehicles]
            behind = grade.mean_behind(at[:, 0] + 0.5 * on[:, 0], near, far)
            under = grade.mean_behind(at, -on, 0.0).mean(axis=-1)
            force[vehicles] = mass * STANDARD_GRAVITY * (behind - under)
        return np.repeat(force / self._axles, self._axles)

    def _vehicles(self, values: FloatArray) -> FloatArray:
        """Values of all axles, by vehicle and axle."""
        return values.reshape(*values.shape[:-1], -1, self._axles)

    def kept(self, demand: FloatArray, distance: FloatArray, speed: FloatArray) -> FloatArray:
        """Demand of drivers who keep the limits, at each axle [N.m].

        Parameters
        ----------
        demand : ndarray
            Torque of the demand over time, the same at all axles of a vehicle [N.m], shape (n,).
        distance, speed : ndarray
            Of all axles [m], [m/s].
        """
        n = self._axles
        v, torque = speed[::n], demand[::n]
        sign = np.where(np.where(v != 0.0, v, torque) < 0.0, -1.0, 1.0)
        way = np.multiply.outer([0.0, 1.0, 1.0], v * self._lag) + [[0.0], [0.0], [self._ahead]] * v
        at = distance + np.repeat(way, n, axis=1)
        squares = self._vehicles(self._curves[0](at)).min(axis=-1)
        if (sign < 0.0).any():
            backward = self._vehicles(self._curves[1](-at)).min(axis=-1)
            squares = np.where(sign > 0.0, squares, backward)
        here, there, later = np.sqrt(squares)  # highest speeds, here and where the brake acts
        v = np.abs(v)
        aim = here - np.minimum(BELOW, SHARE_BELOW * here)
        falling = np.minimum((later - there) / self._ahead, 0.0)
        rate = np.maximum(falling + (aim - v) / self._time, -self._braking)
        grade = self._own_grade + self._vehicles(self._grades(distance)).mean(axis=-1)
        weight = self._mass * STANDARD_GRAVITY * grade
        if self.towing:
            weight = weight + self.pull(distance, 0.0 * distance)[::n]
        running = n * (self._constant + (self._linear + self._quadratic * v) * v)
        force = self._moved * rate + running + n * sign * weight
        most = force * self._radius / np.where(force < 0.0, self._acting[1], self._acting[0])
        brakes = self._braked & (torque < 0.0)
        ahead = np.minimum(np.where(brakes, torque, sign * torque), most)
        made = np.where(self._braked & (ahead < 0.0), ahead, sign * ahead)
        return np.repeat(np.where(self.has_driver, made, torque), n)
