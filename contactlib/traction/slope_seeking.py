"""Creep control that finds the peak of the creep force by itself, whatever the friction.

The slope of the creep force at no creepage is a matter of stiffness and not of friction, as both
zeta0 and f_d P are proportional to f_d. So where friction changes, the peak moves along a ray of
constant creepage per creep force, and the reference creepage, a compliance times the load torque
of an observer (`contactlib.traction.load_observer`), follows a wet patch at once. The compliance
of the peak depends on law and layer. It is found by going up the slope of the creep force, as in
A. Kawamura, M. Cao et al., "Measurement of tractive force in the creep region and maximum adhesion
control of high speed railway systems"; a small movement of the reference tells the slope
(`contactlib.traction.elasticity`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import FloatArray, Quantity
from contactlib.traction.design import least_slip, slip_gains, stick_compliance
from contactlib.traction.elasticity import Moments, add_sample, elasticity, slip_noise
from contactlib.traction.interface import Measurement, plausible
from contactlib.traction.limiter import LimiterMemory, SlipLimiter
from contactlib.traction.load_observer import LoadObserver, Observed
from contactlib.traction.sensors import Sensors

HELD = 0.3  # of the reference: further from it the slope is not that of the reference
RANGE = (0.7, 10.0)  # shares of the first compliance that it stays within; see `for_drivetrain`


class SeekingMemory(NamedTuple):
    """What the controller keeps.

    Attributes
    ----------
    limiter : LimiterMemory
        Of the inner loop.
    observed : Observed
        Of the load observer.
    moments : Moments
        Of load and creepage.
    compliance : ndarray
        Creepage per load torque that is held, but for the dither [1/(N.m)].
    phase : ndarray
        Of the dither, 0 to 1.
    """

    limiter: LimiterMemory
    observed: Observed
    moments: Moments
    compliance: FloatArray
    phase: FloatArray


@dataclass(frozen=True, kw_only=True)
class SlopeSeeking(SlipLimiter):
    """Limits the demand so that the creepage stays at the peak of the creep force.

    Parameters
    ----------
    radius, inertia : float
        Of the wheelset with its drive [m, kg.m2].
    delay, motor_lag : float, optional
        Of the sensors, in whole samples, and of the motor [s].
    first_compliance : float
        Creepage per load torque to begin with [1/(N.m)].
    proportional_gain, integral_gain : float
        Kp, Ki of the inner loop on slip speed [N.s, N].
    least_reference, largest_reference : float, optional
        Bounds of the reference creepage [1].
    seeking_rate : float, optional
        Relative rate of the compliance for an elasticity of one [1/s].
    target_elasticity : float, optional
        Elasticity to settle at [1]: zero is the peak. At 0.2 the last per cent of creepage, and so
        of slip work, still brings 0.2 per cent of force; a broad peak is not climbed to the top.
    dither, dither_period : float, optional
        Share of the reference that it is moved by, up and down, and how long that takes [1, s].
    memory_time : float, optional
        Over which the slope is estimated [s].
    observer_time : float, optional
        Time constant of the load observer [s].
    slip_noise : float, optional
        Standard deviation of the slip that comes out of it [m/s].
    sample_time, low_speed, least_slip, speed_filter_time, recovery_time : float, optional
        As of `SlipLimiter`.
    """

    radius: Annotated[float, Quantity("m", above=0.0)]
    inertia: Annotated[float, Quantity("kg.m2", above=0.0)]
    delay: Annotated[float, Quantity("s", at_least=0.0)] = 0.0
    motor_lag: Annotated[float, Quantity("s", at_least=0.0)] = 0.0
    first_compliance: Annotated[float, Quantity("1/(N.m)", above=0.0)]
    least_reference: Annotated[float, Quantity("1", at_least=1e-4)] = 0.002
    largest_reference: Annotated[float, Quantity("1", at_least=1e-4)] = 0.05
    seeking_rate: Annotated[float, Quantity("1/s", at_least=0.0)] = 0.35
    target_elasticity: Annotated[float, Quantity("1", at_least=-0.5, at_most=0.5)] = 0.2
    dither: Annotated[float, Quantity("1", at_least=1e-3, at_most=0.5)] = 0.1
    dither_period: Annotated[float, Quantity("s", above=0.0)] = 0.6
    memory_time: Annotated[float, Quantity("s", above=0.0)] = 0.6
    observer_time: Annotated[float, Quantity("s", above=0.0)] = 0.04
    slip_noise: Annotated[float, Quantity("m/s", at_least=0.0)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.least_reference > self.largest_reference:
            raise ValueError(
                f"SlopeSeeking.least_reference = {self.least_reference!r} is out of range: must "
                f"be <= largest_reference = {self.largest_reference!r}"
            )
        self.observer.delayed_samples  # noqa: B018 - refuses a delay that is not whole

    @cached_property
    def observer(self) -> LoadObserver:
        """Of the load torque."""
        return LoadObserver(
            sample_time=self.sample_time,
            radius=self.radius,
            inertia=self.inertia,
            delay=self.delay,
            motor_lag=self.motor_lag,
            filter_time=self.observer_time,
        )

    @cached_property
    def _gains(self) -> tuple[float, float]:
        """Of the slow means and of the moments, per sample."""
        step = self.sample_time
        return (
            -math.expm1(-step / (0.5 * self.dither_period)),
            -math.expm1(-step / self.memory_time),
        )

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Constants of the drive, of the sensors and of the contact's stiffness; no friction.

        The gains are those that `slip_gains` has for any pole: the steepest that it is robust for.
        The first compliance is 1.8 times that of the stiff contact, where Carter's law gives 99 %
        of its largest force; it has its peak at twice. Other laws have it at 0.77 (line contact,
        k_hat = 2) of that or more; on flat curves at several times as much.
        """
        wheelset, sample_time = drivetrain.wheelset, given.get("sample_time", cls.sample_time)
        filter_time = given.get("speed_filter_time", cls.speed_filter_time)
        gains = slip_gains(drivetrain, pole=math.inf, sensors=sensors, sample_time=sample_time)
        known = {
            "radius": wheelset.radius,
            "inertia": wheelset.inertia,
            "delay": sensors.delay,
            "motor_lag": drivetrain.motor_lag,
            "proportional_gain": gains[0],
            "integral_gain": gains[1],
            "least_slip": least_slip(sensors, sample_time, filter_time),
            "first_compliance": 1.8 * stick_compliance(wheelset, speed),
        }
        designed = cls(**{**known, **given})
        if "slip_noise" in given:
            return designed
        noise = slip_noise(
            sensors, designed.sample_time, designed.speed_filter_time, designed.observer.gains[0]
        )
        return cls(**{**known, **given, "slip_noise": noise})

    def start(self, measurement: Measurement, torque: ArrayLike) -> SeekingMemory:
        """Memory that goes on from `torque` [N.m]."""
        known = plausible(measurement)
        limiter = self.start_limiter(known, torque)
        slip, _ = self.slip(known, limiter.vehicle)
        none = np.zeros_like(slip.speed)
        return SeekingMemory(
            limiter,
            self.observer.start(torque, known.wheel_speed, slip.speed),
            Moments(np.abs(torque) + none, np.maximum(slip.speed / slip.scale, 0.0), none, none),
            none + self.first_compliance,
            none,
        )

    def sample(
        self, measurement: Measurement, memory: SeekingMemory
    ) -> tuple[FloatArray, SeekingMemory]:
        """Torque [N.m] and new memory."""
        known = plausible(measurement)
        slip, vehicle = self.slip(known, memory.limiter.vehicle)
        observed, load, slipped = self.observer.observe(
            memory.observed, known.wheel_speed, slip.speed
        )
        load, creepage = slip.sign * load, slipped / slip.scale
        reference = np.minimum(
            np.maximum(memory.compliance * load, self.least_reference), self.largest_reference
        )

        expected = self.dither * self.dither * reference * reference
        away = creepage - reference
        away = away * away
        moments = add_sample(
            memory.moments, load, creepage, away=away, expected=expected, gains=self._gains
        )
        slope = elasticity(
            moments,
            noise=self.slip_noise * self.slip_noise / (slip.scale * slip.scale),
            expected=expected,
            least_load=1e-3 * slip.demand + 1.0,
        )
        near = HELD * HELD * reference * reference
        seeking = memory.limiter.limiting & (away < near)
        step = self.sample_time * self.seeking_rate * seeking
        compliance = memory.compliance * (1.0 + step * (slope - self.target_elasticity))
        compliance = np.minimum(
            np.maximum(compliance, RANGE[0] * self.first_compliance),
            RANGE[1] * self.first_compliance,
        )

        phase = (memory.phase + self.sample_time / self.dither_period) % 1.0
        wave = 4.0 * np.abs(phase - 0.5) - 1.0  # triangle, -1 to 1
        torque, limiter = self.limit(
            slip, vehicle, reference * (1.0 + self.dither * wave), memory.limiter
        )
        return torque, SeekingMemory(
            limiter, self.observer.send(observed, torque), moments, compliance, phase
        )
