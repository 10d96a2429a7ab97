"""Creep control that finds the peak of the creep force by itself, whatever the friction.

A disturbance observer gives the load torque r Q from the wheel speed and the drive's own torque
(K. Ohishi, K. Nakano, I. Miyashita, S. Yasukawa, "Anti-slip control of electric motor coach based
on disturbance observer", AMC 1998). How load torque and creepage vary together gives the slope of
the creep force, and the reference creepage goes up the slope (A. Kawamura, M. Cao et al.,
"Measurement of tractive force in the creep region and maximum adhesion control of high speed
railway systems", Yokohama; A. F. Abouzeid et al., arXiv:2406.13650, 2024, compare such schemes).
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
from contactlib.traction.design import fast_pole, slip_gains, steepest_fall
from contactlib.traction.interface import Measurement, plausible
from contactlib.traction.limiter import LimiterMemory, Slip, SlipLimiter
from contactlib.traction.sensors import Sensors

STIFF = 1.0  # elasticity of a contact whose creepage does not move
FASTEST_MOVE = (-2.0, 1.0)  # what the elasticity is held within


class Observed(NamedTuple):
    """Load torque and creepage, filtered alike.

    Attributes
    ----------
    wheel_speed, slip : ndarray
        Filtered [m/s]; the slip in the demand's direction.
    motor_torque, torque : ndarray
        What the motor gives by now [N.m], and that filtered.
    """

    wheel_speed: FloatArray
    slip: FloatArray
    motor_torque: FloatArray
    torque: FloatArray


class SeekingMemory(NamedTuple):
    """What the controller keeps.

    Attributes
    ----------
    limiter : LimiterMemory
        Of the inner loop.
    sent : tuple of ndarray
        Torques that were sent and whose effect is not seen yet, oldest first [N.m].
    observed : Observed
        The observer's filters.
    creepage, load : ndarray
        Slow means [1, N.m].
    covariance, variance : ndarray
        Of load and creepage, and of creepage, with forgetting [N.m, 1].
    reference : ndarray
        Creepage that is held, but for the dither [1].
    phase : ndarray
        Of the dither, 0 to 1.
    """

    limiter: LimiterMemory
    sent: tuple[FloatArray, ...]
    observed: Observed
    creepage: FloatArray
    load: FloatArray
    covariance: FloatArray
    variance: FloatArray
    reference: FloatArray
    phase: FloatArray


@dataclass(frozen=True, kw_only=True)
class SlopeSeeking(SlipLimiter):
    """Limits the demand so that the creepage stays at the peak of the creep force, or just below.

    Parameters
    ----------
    radius, inertia : float
        Of the wheelset with its drive [m, kg.m2].
    delay, motor_lag : float, optional
        Of the sensors, in whole samples, and of the motor [s].
    proportional_gain, integral_gain : float
        Kp, Ki of the inner loop on slip speed [N.s, N].
    first_reference, least_reference, largest_reference : float, optional
        Creepage to begin with, and its bounds [1].
    seeking_rate : float, optional
        Relative rate of the reference for an elasticity of one [1/s].
    dither, dither_period : float, optional
        Share of the reference that it is moved by, up and down, and how long that takes [1, s].
    memory_time : float, optional
        Over which the slope is estimated [s].
    observer_time : float, optional
        Time constant of the observer [s].
    sample_time, low_speed, speed_filter_time : float, optional
        As of `CreepPI`.

    Notes
    -----
    The elasticity d ln Q / d ln zeta is one for a stiff contact and zero at the peak on any rail,
    so nothing needs scaling by friction or load. It is the least-squares slope of load torque over
    creepage, both less their slow means, with exponential forgetting; a variance that noise alone
    could make counts as no slope.
    """

    radius: Annotated[float, Quantity("m", above=0.0)]
    inertia: Annotated[float, Quantity("kg.m2", above=0.0)]
    delay: Annotated[float, Quantity("s", at_least=0.0)] = 0.0
    motor_lag: Annotated[float, Quantity("s", at_least=0.0)] = 0.0
    first_reference: Annotated[float, Quantity("1", above=0.0)] = 0.015
    least_reference: Annotated[float, Quantity("1", above=0.0)] = 0.002
    largest_reference: Annotated[float, Quantity("1", above=0.0)] = 0.05
    seeking_rate: Annotated[float, Quantity("1/s", at_least=0.0)] = 1.5
    dither: Annotated[float, Quantity("1", at_least=0.0, at_most=0.5)] = 0.12
    dither_period: Annotated[float, Quantity("s", above=0.0)] = 0.6
    memory_time: Annotated[float, Quantity("s", above=0.0)] = 0.6
    observer_time: Annotated[float, Quantity("s", above=0.0)] = 0.04

    @cached_property
    def _delayed_samples(self) -> int:
        return Sensors(delay=self.delay).samples_of_delay(self.sample_time)

    @cached_property
    def _gains(self) -> tuple[float, float, float, float]:
        """Per sample: of the observer, of the slow means and sums, of the motor."""
        step, lag = self.sample_time, self.motor_lag
        return (
            -math.expm1(-step / self.observer_time),
            -math.expm1(-step / self.memory_time),
            -math.expm1(-step / (0.5 * self.dither_period)),
            -math.expm1(-step / lag) if lag > 0.0 else 1.0,
        )

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Gains by `slip_gains` for the steepest fall; the drive's and the sensors' constants."""
        wheelset, sample_time = drivetrain.wheelset, given.get("sample_time", cls.sample_time)
        pole = fast_pole(wheelset, steepest_fall(wheelset, speed), speed)
        gains = slip_gains(drivetrain, pole=pole, sensors=sensors, sample_time=sample_time)
        known = {
            "radius": wheelset.radius,
            "inertia": wheelset.inertia,
            "delay": sensors.delay,
            "motor_lag": drivetrain.motor_lag,
            "proportional_gain": gains[0],
            "integral_gain": gains[1],
        }
        return cls(**{**known, **given})

    def start(self, measurement: Measurement, torque: ArrayLike) -> SeekingMemory:
        """Memory that goes on from `torque` [N.m]."""
        known = plausible(measurement)
        limiter = self.start_limiter(known, torque)
        slip, _ = self.slip(known, limiter.vehicle)
        none = np.zeros_like(slip.speed)
        signed = torque + none
        return SeekingMemory(
            limiter,
            (signed,) * (self._delayed_samples + 1),
            Observed(np.array(known.wheel_speed), slip.speed, signed, signed),
            np.maximum(slip.speed / slip.scale, 0.0),
            np.abs(signed),
            none,
            none,
            none + self.first_reference,
            none,
        )

    def sample(
        self, measurement: Measurement, memory: SeekingMemory
    ) -> tuple[FloatArray, SeekingMemory]:
        """Torque [N.m] and new memory."""
        known = plausible(measurement)
        slip, vehicle = self.slip(known, memory.limiter.vehicle)
        observed, load, creepage = self._observe(known, slip, memory)
        _, forget, slow, _ = self._gains
        off_load, off_creepage = load - memory.load, creepage - memory.creepage
        mean_load = memory.load + slow * off_load
        mean_creepage = memory.creepage + slow * off_creepage
        reference = memory.reference
        expected = (self.dither * reference) ** 2
        squared = off_creepage * off_creepage
        weight = expected / (expected + squared)
        covariance = memory.covariance + forget * (
            weight * off_creepage * off_load - memory.covariance
        )
        variance = memory.variance + forget * (weight * squared - memory.variance)

        doubt = 0.04 * expected
        rise = covariance * mean_creepage / np.maximum(mean_load, 1e-3 * slip.demand + 1.0)
        elasticity = (rise + doubt * STIFF) / (variance + doubt)
        climb = np.minimum(np.maximum(elasticity, FASTEST_MOVE[0]), FASTEST_MOVE[1])
        moving = memory.limiter.limiting & (slip.braking == memory.limiter.braking)
        reference = reference * (
            1.0 + np.where(moving, self.sample_time * self.seeking_rate * climb, 0.0)
        )
        reference = np.minimum(np.maximum(reference, self.least_reference), self.largest_reference)

        phase = memory.phase + self.sample_time / self.dither_period
        phase = np.where(phase >= 1.0, phase - 1.0, phase)
        wave = 4.0 * np.abs(phase - 0.5) - 1.0  # triangle, -1 to 1
        torque, limiter = self.limit(
            slip, vehicle, reference * (1.0 + self.dither * wave), memory.limiter
        )
        return torque, SeekingMemory(
            limiter,
            (*memory.sent[1:], torque),
            observed,
            mean_creepage,
            mean_load,
            covariance,
            variance,
            reference,
            phase,
        )

    def _observe(
        self, known: Measurement, slip: Slip, memory: SeekingMemory
    ) -> tuple[Observed, FloatArray, FloatArray]:
        """Filters, load torque in the demand's direction [N.m] and creepage [1] of one time.

        J domega/dt = T - r Q, all under one first-order filter. The creepage is that of the middle
        of the sample time, as is the derivative: then white noise of the wheel speed gives them no
        covariance.
        """
        gain, _, _, motor = self._gains
        last = memory.observed
        given = last.motor_torque + motor * (memory.sent[0] - last.motor_torque)
        change = gain * (known.wheel_speed - last.wheel_speed)
        moved = gain * (slip.speed - last.slip)
        torque = last.torque + gain * (given - last.torque)
        load = torque - self.inertia / (self.radius * self.sample_time) * change
        observed = Observed(last.wheel_speed + change, last.slip + moved, given, torque)
        return (
            observed,
            np.where(slip.braking, -load, load),
            (last.slip + 0.5 * moved) / slip.scale,
        )
