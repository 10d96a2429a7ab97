"""Observers of vehicle speed, load torque and slope of the creep force from sampled signals.

Vehicle speed (`track`): a two-state tracking filter of speed and acceleration with a double pole,
the critically damped g-h filter (E. Brookner, Tracking and Kalman Filtering Made Easy, Wiley 1998).
It follows a constant acceleration without error, so it does not bias the creepage of an
accelerating train.

Load torque (`LoadObserver`): from J domega/dt = T - r Q, with the same first-order filter on
derivative and torque,
    r Q_filtered = T_filtered - (J/r) d(r omega)_filtered/dt,
the disturbance observer of K. Ohishi, K. Nakano, I. Miyashita and S. Yasukawa, "Anti-slip control
of electric motor coach based on disturbance observer", 5th International Workshop on Advanced
Motion Control, 1998. A measured speed is paired with the torque of one `delay` earlier.

Slope (`elasticity`): d ln(rQ)/d ln(zeta) is one for a stiff contact and zero at the peak of the
creep force, on any rail. It is estimated as the least-squares slope of load over creepage, both
without their slow means, with exponential forgetting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple

from contactlib.base.elementwise import maximum, minimum, where
from contactlib.base.quantities import FloatArray, Parameters, Quantity
from contactlib.element.force_element import RADIUS
from contactlib.traction.interface import SAMPLE_TIME
from contactlib.traction.sensors import DELAY, Sensors
from contactlib.vehicle.drivetrain import LAG
from contactlib.vehicle.wheelset import INERTIA

UNMOVED = 0.125  # variance / expected variance below which the creepage counts as not moved
DOUBT = 0.04  # weight of the stiff contact that an unmoved creepage indicates / expected variance
FLOOR = 0.01  # share of the expected variance that counts as zero slope


class Tracked(NamedTuple):
    """Speed [m/s], and its change from sample to sample [m/s]."""

    speed: FloatArray
    change: FloatArray


def tracker_gains(sample_time: float, filter_time: float) -> tuple[float, float]:
    """Gains g and h for poles at exp(-sample_time/filter_time); no filter if it is zero."""
    pole = math.exp(-sample_time / filter_time) if filter_time > 0.0 else 0.0
    return 1.0 - pole**2, (1.0 - pole) ** 2


def tracked_variance(sample_time: float, filter_time: float) -> float:
    """Variance after / before the filter for white noise, (1 - p)(1 + 4 p + 5 p^2)/(1 + p)^3 [1].

    p is the pole; Brookner's formula for a g-h filter with the gains of `tracker_gains`.
    """
    p = math.exp(-sample_time / filter_time) if filter_time > 0.0 else 0.0
    return (1.0 - p) * (1.0 + 4.0 * p + 5.0 * p**2) / (1.0 + p) ** 3


def track(tracked: Tracked, measured: FloatArray, gains: tuple[float, float]) -> Tracked:
    """Filter state after one more sample [m/s]."""
    expected = tracked.speed + tracked.change
    surprise = measured - expected
    return Tracked(expected + gains[0] * surprise, tracked.change + gains[1] * surprise)


class Observed(NamedTuple):
    """State of the load observer.

    Attributes
    ----------
    sent : tuple of ndarray
        Torques commanded within the delay before the last sample, oldest first [N.m].
    motor_torque, torque : ndarray
        Torque of the motor, and its filtered value [N.m].
    wheel_speed, slip : ndarray
        Filtered wheel speed, and filtered forward slip [m/s].
    """

    sent: tuple[FloatArray, ...]
    motor_torque: FloatArray
    torque: FloatArray
    wheel_speed: FloatArray
    slip: FloatArray


@dataclass(frozen=True, kw_only=True)
class LoadObserver(Parameters):
    """Observer of the load torque, with the parameters of the drive.

    Parameters
    ----------
    sample_time : float
        Sample time [s].
    radius, inertia : float
        Parameters of the wheelset with its drive [m, kg.m2].
    delay, motor_lag, brake_lag : float
        Delay of the sensors, a whole number of samples, and lags of motor and braking [s].
    filter_time : float
        Time constant of the filter [s].
    """

    sample_time: Annotated[float, SAMPLE_TIME]
    radius: Annotated[float, RADIUS]
    inertia: Annotated[float, INERTIA]
    delay: Annotated[float, DELAY]
    motor_lag: Annotated[float, LAG]
    brake_lag: Annotated[float, LAG]
    filter_time: Annotated[float, Quantity("s", above=0.0)]

    @cached_property
    def delayed_samples(self) -> int:
        """Delay of the sensors in samples."""
        return Sensors(delay=self.delay).samples_of_delay(self.sample_time)

    @cached_property
    def gains(self) -> tuple[float, float, float]:
        """Gains of filter, motor and brake per sample."""
        times = self.filter_time, self.motor_lag, self.brake_lag
        observer, motor, brake = (first_order_gain(self.sample_time, time) for time in times)
        return observer, motor, brake

    def start(self, torque: Any, wheel_speed: FloatArray, slip: FloatArray) -> Observed:
        """State of a drive at steady `torque` [N.m] and speed [m/s]."""
        steady = torque + 0.0 * wheel_speed
        return Observed((steady,) * self.delayed_samples, steady, steady, wheel_speed, slip)

    def observe(
        self,
        last: Observed,
        torque: FloatArray,
        wheel_speed: FloatArray,
        slip: FloatArray,
        *,
        braking: Any = False,
    ) -> tuple[Observed, FloatArray, FloatArray]:
        """New state, and load torque [N.m] and slip [m/s] at the middle of the sample interval.

        `torque` has been commanded since the last sample [N.m], of the motor or, while `braking`,
        of the brake. The derivative is that at the middle. With the slip at the same time, white
        noise of the wheel speed does not correlate the two.
        """
        gain, motor, brake = self.gains
        sent = (*last.sent, torque)
        pace = where(braking, brake, motor)
        given = last.motor_torque + pace * (sent[0] - last.motor_torque)
        filtered = last.torque + gain * (given - last.torque)
        change, slipped = gain * (wheel_speed - last.wheel_speed), gain * (slip - last.slip)
        load = filtered - self.inertia / (self.radius * self.sample_time) * change
        new = Observed(sent[1:], given, filtered, last.wheel_speed + change, last.slip + slipped)
        return new, load, last.slip + 0.5 * slipped


class Moments(NamedTuple):
    """Moments of load torque and creepage.

    Attributes
    ----------
    load, creepage : ndarray
        Slow means [N.m, 1].
    covariance, variance : ndarray
        Covariance of load and creepage [N.m], and variance of the creepage [1].
    """

    load: FloatArray
    creepage: FloatArray
    covariance: FloatArray
    variance: FloatArray

    def turned(self, sign: FloatArray) -> Moments:
        """Moments of load and creepage in another direction, or in the same (sign = 1)."""
        return self._replace(load=sign * self.load, creepage=sign * self.creepage)


def add_sample(
    moments: Moments,
    load: FloatArray,
    creepage: FloatArray,
    *,
    away: FloatArray,
    expected: FloatArray,
    gains: tuple[float, float],
) -> Moments:
    """Moments with one more sample.

    Parameters
    ----------
    moments : Moments
        Moments so far.
    load, creepage : ndarray
        The sample [N.m, 1].
    away : ndarray
        Square of the distance from the reference creepage [1].
    expected : ndarray
        Square of the movement from which the slope is estimated [1]. Samples that are much further
        away belong to a transient and weigh less, as one of them would dominate for seconds.
    gains : tuple of float
        Gains of the means and of the moments per sample.
    """
    slow, forget = gains
    off_load, off_creepage = load - moments.load, creepage - moments.creepage
    squared = off_creepage * off_creepage
    weight = forget * expected / (expected + maximum(squared, away))
    keep = 1.0 - forget
    return Moments(
        moments.load + slow * off_load,
        moments.creepage + slow * off_creepage,
        keep * moments.covariance + weight * off_creepage * off_load,
        keep * moments.variance + weight * squared,
    )


def elasticity(
    moments: Moments, *, noise: FloatArray, expected: FloatArray, minimum_load: FloatArray
) -> Any:
    """Estimate of d ln(rQ)/d ln(zeta), limited to -1 to 1 [1].

    The variance `noise` of the creepage would flatten the slope and is subtracted. A creepage that
    does not move, although it should by the square root of `expected`, indicates a stiff contact,
    so the estimate then approaches one.
    """
    moved = maximum(moments.variance - noise, 0.0)
    stiff = DOUBT * maximum(expected - moved / UNMOVED, 0.0)
    rise = moments.covariance * moments.creepage / maximum(moments.load, minimum_load)
    estimate = (rise + stiff) / (moved + stiff + FLOOR * expected)
    return minimum(maximum(estimate, -1.0), 1.0)


def first_order_gain(sample_time: float, filter_time: float) -> float:
    """Gain per sample of a first-order filter [1]; 1, no filter, if its time is zero."""
    return -math.expm1(-sample_time / filter_time) if filter_time > 0.0 else 1.0


def filtered_noise(
    sensors: Sensors, sample_time: float, speed_filter_time: float, gains: tuple[float, float]
) -> tuple[float, float]:
    """Standard deviations of filtered slip [m/s] and wheel acceleration [m/s2] by sensor noise.

    The gains are those of the filters on the two. A first-order filter of gain g reduces white
    variance to g/(2 - g); its change per sample has 2 g**2/(2 - g) of it. The vehicle speed is
    that of the tracking filter.
    """
    slip, speed = gains
    wheel = sensors.wheel_speed_noise
    tracked = tracked_variance(sample_time, speed_filter_time)
    return (
        math.sqrt(slip / (2.0 - slip) * wheel**2 + tracked * sensors.vehicle_speed_noise**2),
        speed * math.sqrt(2.0 / (2.0 - speed)) * wheel / sample_time,
    )


def slip_noise(sensors: Sensors, sample_time: float, filter_time: float, gain: float) -> float:
    """Standard deviation of the observed slip due to the sensors' noise [m/s].

    A first-order filter of this gain reduces white variance to gain/(2 - gain), the mean of two
    neighbours by a further 1 - gain/2; the slow means remove about half of the variance that the
    tracking filter leaves.
    """
    tracked = tracked_variance(sample_time, filter_time)
    return math.sqrt(
        0.5 * gain * sensors.wheel_speed_noise**2 + 0.5 * tracked * sensors.vehicle_speed_noise**2
    )
