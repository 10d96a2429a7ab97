"""Speed sensors with their errors and delay, and indices of runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.elementwise import maximum, minimum, where
from contactlib.base.quantities import (
    POSITIVE,
    SEED,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checked_whole,
    shown,
)

SPEED_NOISE = Quantity("m/s", at_least=0.0, usual=(0.0, 5.0))
DELAY = Quantity("s", at_least=0.0, usual=(0.0, 1.0))
COUNTED = Limits(at_least=1e-6, at_most=1e6)  # of an encoder's radius [m] and sample time [s]
AHEAD = 256  # samples of noise drawn at once
COUNTS = Limits(at_least=1.0, at_most=1e6)
INDEX = Limits(at_least=0.0, below=2.0**63)  # of a run, for its noise
LONGEST_DELAY = 10_000  # samples, which are all stored
TOGETHER = 64  # wheelsets whose noise is written at once


def checked_indices(index: Sequence[int]) -> list[int]:
    """Return indices of runs as integers, or raise a ValueError."""
    places = checked("index", index, INDEX)
    if places.ndim != 1 or (places != np.floor(places)).any():
        raise ValueError(f"index = {shown(index)} must be one row of whole numbers")
    return [int(run) for run in index]


@dataclass(frozen=True, kw_only=True)
class Sensors(Parameters):
    """Speed sensors: systematic errors, white Gaussian noise on every sample, and one delay.

    With the wheel's true speed r omega and the vehicle's V, they measure at the time t of a run

        (1 + wheel_diameter_error) r omega + noise,
        (1 + vehicle_speed_bias) V + vehicle_speed_drift t + noise

    Where an undriven axle is the sensor of V, `vehicle_speed_bias` is the error of its diameter and
    `vehicle_speed_noise` its noise. With an `acceleration_limit` a there is no such sensor, as on a
    locomotive whose axles are all driven. Slip makes the measured wheel speed u too high in
    traction and too low in braking, so the vehicle speed is estimated under the demand T, from one
    sample to the next after dt, as

        min(u, last estimate + a dt) if T > 0, max(u, last estimate - a dt) if T < 0

    and both limits apply while nothing is demanded. The axles of a vehicle share one estimate: T is
    the sum of their demands, and u the lowest of their wheel speeds in traction, the highest in
    braking, else the one next to the last estimate. An axle without a motor or brake turns
    freely and so keeps the estimate right. Where all axles slip, the estimate follows its limit
    alone; after a `trial_time` of that, the demand of one axle is zero for a `trial_time`, so that
    its wheel returns to the vehicle's speed: of the last axle in the direction of motion first,
    then of the one in front.

    Parameters
    ----------
    vehicle_speed_bias : float, optional
        Error of the measured vehicle speed / vehicle speed [1].
    vehicle_speed_drift : float, optional
        Rate at which the measured vehicle speed departs from the true one [m/s2].
    wheel_diameter_error : float, optional
        (Diameter that the measurement assumes - true one) / true one [1].
    encoder_pulses : float, optional
        Pulses per revolution of the encoder on the wheel, a whole number: the measured wheel speed
        is the way of the pulses counted since the last sample / sample time. Zero: as if there were
        infinitely many, at the instant of the sample.
    wheel_speed_noise : float, optional
        Standard deviation of the measured wheel speed [m/s].
    vehicle_speed_noise : float, optional
        Standard deviation of the measured vehicle speed [m/s]; 0 if it is estimated.
    acceleration_limit : float, optional
        Maximum acceleration a of the estimated vehicle speed in the direction of slip [m/s2], which
        no train exceeds. Default: a sensor measures the vehicle speed.
    trial_time : float, optional
        Time for which the estimate follows its limit alone before one axle of the vehicle is let
        free, and for which it is [s]. Default: no axle is let free.
    delay : float, optional
        Time from the measurement to the controller [s], a whole number of samples.
    seed : float, optional
        Seed of the noise, a whole number.

    Raises
    ------
    ValueError
        If a value is out of range, the seed or the number of pulses is not whole, or a vehicle
        speed that is estimated has errors of a sensor.
    """

    vehicle_speed_bias: Annotated[
        float, Quantity("1", at_least=-0.5, at_most=0.5, percent=True, usual=(-0.05, 0.05))
    ] = 0.0
    vehicle_speed_drift: Annotated[
        float, Quantity("m/s2", at_least=-10.0, at_most=10.0, usual=(-0.1, 0.1))
    ] = 0.0
    wheel_diameter_error: Annotated[
        float, Quantity("1", at_least=-0.5, at_most=0.5, percent=True, usual=(-0.1, 0.1))
    ] = 0.0
    encoder_pulses: Annotated[
        float, Quantity("1", at_least=0.0, at_most=1e6, usual=(0.0, 1e5), whole=True)
    ] = 0.0
    wheel_speed_noise: Annotated[float, SPEED_NOISE] = 0.0
    vehicle_speed_noise: Annotated[float, SPEED_NOISE] = 0.0
    acceleration_limit: Annotated[
        float | None, Quantity("m/s2", above=0.0, at_most=1e3, usual=(0.05, 5.0))
    ] = None
    trial_time: Annotated[
        float | None, Quantity("s", above=0.0, at_most=60.0, usual=(0.1, 10.0))
    ] = None
    delay: Annotated[float, DELAY] = 0.0
    seed: Annotated[float, SEED] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("vehicle_speed_bias", "vehicle_speed_drift", "vehicle_speed_noise"):
            value = getattr(self, name)
            if self.acceleration_limit is not None and value != 0.0:
                raise ValueError(
                    f"Sensors.{name} = {value!r} must be 0 with acceleration_limit = "
                    f"{self.acceleration_limit!r}: the vehicle speed then has no sensor"
                )
        if self.trial_time is not None and self.acceleration_limit is None:
            raise ValueError(
                f"Sensors.trial_time = {self.trial_time!r} needs acceleration_limit: a sensor "
                "measures the vehicle speed"
            )

    def samples_of_delay(self, sample_time: float) -> int:
        """Delay in samples.

        Raises
        ------
        ValueError
            If it is not a whole number of samples, or too long.
        """
        step = checked_number("sample_time", sample_time, POSITIVE)
        samples = self.delay / step
        if samples > LONGEST_DELAY:
            raise ValueError(
                f"Sensors.delay = {self.delay!r} is out of range: must be <= {LONGEST_DELAY} "
                f"samples of sample_time = {step!r}"
            )
        nearest = round(samples) * step
        if abs(nearest - self.delay) > 1e-6 * step:
            raise ValueError(
                f"sample_time = {step!r} s: the sensors' delay, {self.delay!r} s, is not a whole "
                f"number of samples: take {self.delay / max(1, round(samples)):.6g} s, or a delay "
                f"of {nearest:.6g} s"
            )
        return round(samples)

    def reader(
        self, count: int, sample_time: float, *, first: int = 0, radius: ArrayLike | None = None
    ) -> SensorReader:
        """Reader for `count` wheelsets; `first` is the index of the first, `radius` in m."""
        n, start = checked_whole("count", count, COUNTS), checked_whole("first", first, INDEX)
        return SensorReader([self] * n, sample_time, range(start, start + n), radius=radius)


class SensorReader:
    """Reads the sensors of many wheelsets, sample by sample.

    The noise of a wheelset is drawn from (seed, index) alone, so it does not depend on the others.
    Until the first delayed sample arrives, the reader returns the first sample.

    Parameters
    ----------
    sensors : sequence of Sensors
        Sensors of each wheelset.
    sample_time : float
        Sample time [s].
    index : sequence of int
        Index of each wheelset among all runs.
    radius : array_like, optional
        Rolling radius of each wheelset, or of all [m]; an encoder needs it.
    numbers : bool, optional
        Whether the speeds of a single wheelset are numbers, not arrays, which is faster.
    axles : int, optional
        Number of axles of each vehicle, whose wheelsets are neighbours and share one estimate of
        its speed. Default: 1.

    Attributes
    ----------
    free : ndarray of bool
        Wheelsets that a trial lets free since the last sample.

    Raises
    ------
    ValueError
        If the delays are not equal numbers of samples, an index is out of range, an encoder has no
        radius, or a wheelset without a vehicle has a `trial_time`.
    """

    def __init__(
        self,
        sensors: Sequence[Sensors],
        sample_time: float,
        index: Sequence[int],
        *,
        radius: ArrayLike | None = None,
        numbers: bool = False,
        axles: int = 1,
    ) -> None:
        places, axles = checked_indices(index), checked_whole("axles", axles, COUNTS)
        if not len(sensors) == len(places) > 0:
            raise ValueError(
                f"index has {len(places)} entries for {len(sensors)} sensors: there must be as "
                "many, and one at least"
            )
        delays = {sensor.samples_of_delay(sample_time) for sensor in set(sensors)}
        if len(delays) > 1:
            raise ValueError(f"sensors have delays of {sorted(delays)} samples: they must be equal")
        self._count, self._delay, self._step = len(sensors), delays.pop(), float(sample_time)
        self._numbers = numbers
        self._none = self._each(0.0 for _ in sensors)
        self._gains = [
            self._each(1.0 + getattr(sensor, name) for sensor in sensors)
            for name in ("wheel_diameter_error", "vehicle_speed_bias")
        ]
        self._drift = self._each(sensor.vehicle_speed_drift for sensor in sensors)
        self._true = all(
            sensor.wheel_diameter_error
            == sensor.vehicle_speed_bias
            == sensor.vehicle_speed_drift
            == 0.0
            for sensor in sensors
        )
        self._pulses = self._each(sensor.encoder_pulses for sensor in sensors)
        self._counts = any(sensor.encoder_pulses > 0.0 for sensor in sensors)
        if self._counts:
            if radius is None:
                raise ValueError(
                    "radius is missing: it converts the pulses of an encoder to a speed"
                )
            checked_number("sample_time", sample_time, COUNTED)
            turn = 2.0 * np.pi * checked("radius", radius, COUNTED)
            if turn.shape not in ((), (self._count,)):
                raise ValueError(
                    f"radius has the shape {turn.shape}: must be () or ({self._count},)"
                )
            turns = np.broadcast_to(turn, self._count).tolist()
            self._pulse = self._each(
                around / max(sensor.encoder_pulses, 1.0)
                for around, sensor in zip(turns, sensors, strict=True)
            )
        self._axles = axles
        self.free: Any = np.zeros(self._count, dtype=np.bool_)
        trials = [sensor.trial_time for sensor in sensors]
        if axles == 1 and any(trial is not None for trial in trials):
            raise ValueError("trial_time is for a vehicle of several axles: leave it out")
        times = np.array([np.inf if trial is None else trial for trial in trials[::axles]])
        self._trial = np.maximum(np.rint(times / self._step), 1.0)
        self._alone, self._trying, self._tried = np.zeros((3, times.size))  # samples, and trials
        limits = [sensor.acceleration_limit for sensor in sensors]
        self._estimating = any(limit is not None for limit in limits)
        self._estimates = self._each(limit is not None for limit in limits)
        self._change = self._each((limit or 0.0) * self._step for limit in limits)  # [m/s]
        self._estimate: Any = None
        self._scale = np.array(
            [[sensor.wheel_speed_noise, sensor.vehicle_speed_noise] for sensor in sensors]
        ).T
        noisy = np.flatnonzero(self._scale.any(axis=0)).tolist()
        # Philox gives independent streams for any keys.
        self._streams = {
            i: np.random.Generator(np.random.Philox(key=[int(sensors[i].seed), places[i]]))
            for i in noisy
        }
        self._noise = np.zeros((AHEAD, 2, self._count)) if noisy else np.zeros((0, 2, 0))
        self._ahead: Iterator[Any] = iter(())
        self._history: list[tuple[Any, Any]] = []
        self._reads = 0
        self._rim: Any = None  # speed at the last sample
        # Since the last pulse, at first half of the way to the next in either direction.
        self._way = 0.5 * self._pulse if self._counts else self._none

    def _each(self, values: Iterable[Any]) -> Any:
        """One value for each wheelset: an array, or a number."""
        numbers = list(values)
        return numbers[0] if self._numbers else np.array(numbers)

    def read(self, wheel_speed: Any, vehicle_speed: Any, demand: Any) -> tuple[Any, Any]:
        """Measured wheel and vehicle speed from the true ones; all [m/s], shape (n,).

        The sign of the demanded torque on the axle [N.m], which of a brake is against the motion,
        gives the direction of slip for an estimated vehicle speed.
        """
        wheel, vehicle = wheel_speed + self._none, vehicle_speed + self._none  # as they may change
        if self._counts:
            wheel = where(self._pulses > 0.0, self._counted(wheel), wheel)
        if not self._true:
            wheel = wheel * self._gains[0]
            vehicle = vehicle * self._gains[1] + self._drift * (self._step * self._reads)
        if self._streams:
            noise = next(self._ahead, None)
            if noise is None:
                self._ahead = iter(self._draw())
                noise = next(self._ahead)
            wheel, vehicle = wheel + noise[0], vehicle + noise[1]
        if self._estimating:
            vehicle = where(self._estimates, self._estimated(wheel, demand), vehicle)
        self._reads += 1
        if self._delay == 0:
            return wheel, vehicle
        if not self._history:
            self._history = [(wheel, vehicle)] * (self._delay + 1)
        slot = self._reads % (self._delay + 1)
        self._history[slot] = wheel, vehicle
        return self._history[(slot + 1) % (self._delay + 1)]

    def _estimated(self, wheel: Any, demand: Any) -> Any:
        """Wheel speed with limited change in the direction of slip."""
        if self._axles > 1:
            return self._shared(wheel, demand)
        last = wheel if self._estimate is None else self._estimate
        low = where(demand > self._none, wheel, maximum(wheel, last - self._change))
        self._estimate = where(demand < self._none, low, minimum(low, last + self._change))
        return self._estimate

    def _shared(self, wheel: Any, demand: Any) -> Any:
        """Estimate of each vehicle from all of its wheel speeds, for each of its axles."""
        wheels, total = (x.reshape(-1, self._axles) for x in (wheel, demand))
        total = total.sum(axis=1)
        low, high = wheels.min(axis=1), wheels.max(axis=1)
        last = 0.5 * (low + high) if self._estimate is None else self._estimate
        reached = np.where(total > 0.0, low, np.where(total < 0.0, high, np.clip(last, low, high)))
        step = np.inf if self._estimate is None else self._change[:: self._axles]
        slowest, fastest = np.where(total > 0.0, -np.inf, last - step), last + step
        self._estimate = np.clip(reached, slowest, np.where(total < 0.0, np.inf, fastest))
        alone = self._estimate != reached
        self._alone = np.where(alone, self._alone + 1.0, 0.0)
        begins = (self._alone >= self._trial) & (self._trying <= 1.0)
        self._trying = np.where(begins, self._trial, np.maximum(self._trying - 1.0, 0.0))
        self._tried = self._tried + begins
        turn = (np.arange(self._axles) + self._tried[:, np.newaxis]) % self._axles == 0.0
        turn = np.where(self._estimate[:, np.newaxis] < 0.0, turn[:, ::-1], turn)
        self.free = (turn & (self._trying[:, np.newaxis] > 0.0)).ravel()
        return np.repeat(self._estimate, self._axles)

    def _counted(self, rim: Any) -> Any:
        """Mean speed since the last sample that whole pulses show; their rest is kept."""
        last = rim if self._rim is None else self._rim
        self._rim, way = rim, self._way + 0.5 * self._step * (last + rim)
        counted = np.floor(way / self._pulse) * self._pulse
        self._way = way - counted
        return counted / self._step

    def _draw(self) -> Any:
        """Noise of the next samples, drawn for several wheelsets at a time.

        Single ones would miss the cache.
        """
        noisy, together = list(self._streams), np.empty((TOGETHER, AHEAD, 2))
        for start in range(0, len(noisy), TOGETHER):
            some = noisy[start : start + TOGETHER]
            for part, i in zip(together, some, strict=False):
                self._streams[i].standard_normal(out=part)
            self._noise[:, :, some] = together[: len(some)].transpose(1, 2, 0)
        self._noise *= self._scale
        return self._noise[:, :, 0].tolist() if self._numbers else self._noise
