"""Design of sampled creep control with dead time, from the linearised wheelset.

About an operating point the slip speed w = r omega - V follows dw/dt = p w + (r/J) T, with
p = -(r^2/J + 1/M) Q'/V, Q' = dQ/dzeta: unstable on the falling branch (p > 0). All dead times in
the loop and the motor's lag are lumped into one delay theta. Proportional control T = -k w then
holds the point if and only if, with lambda = k r/J,

    p < lambda < p / cos(x),    tan(x)/x = 1/(p theta),    0 < x < pi/2

(the characteristic root crosses at i x/theta). The window closes at p theta = 1. The same k suits
all speeds: creepage is w/V, so the gain from creepage to torque is k V, and the pole p falls as
1/V.
"""

from __future__ import annotations

import math

from contactlib.stability import proportional_window, sampled_delay
from contactlib.traction.filters import tracked_variance
from contactlib.traction.sensors import Sensors
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.wheelset import Wheelset

ROBUST = (0.15, 0.3)  # range of p theta for which a gain is designed
RISING_FOREVER = 30.0  # creepage / zeta0 that replaces the peak of a law without one
INTEGRAL = 10.0  # lambda times the time of the integral action
STICKS = 0.03  # traction coefficient at which a wheel sticks on any rail
TORQUE_NOISE = 0.01  # largest standard deviation of the torque by noise / r P


def total_delay(
    drivetrain: Drivetrain, sensors: Sensors, sample_time: float, *, braking: bool = False
) -> float:
    """Delay theta [s]: sensors, half a sample for the held torque, the lag of motor or brake."""
    lag = drivetrain.brake_lag if braking else drivetrain.motor.lag
    return sampled_delay(delay=sensors.delay, lag=lag, sample_time=sample_time)


def minimum_slip(sensors: Sensors, sample_time: float, filter_time: float) -> float:
    """Smallest slip speed above the noise: 3.5 standard deviations of its measurement [m/s]."""
    tracked = tracked_variance(sample_time, filter_time)
    return 3.5 * math.sqrt(sensors.wheel_speed_noise**2 + tracked * sensors.vehicle_speed_noise**2)


def peak_creepage(wheelset: Wheelset, speed: float) -> float:
    """Creepage [1] of the largest creep force at a speed [m/s].

    For a law that rises forever, thirty times the saturation creepage.
    """
    peak = CreepCurve(wheelset, speed=speed).peak.creepage
    return peak if math.isfinite(peak) else RISING_FOREVER * wheelset.element.saturation_creepage


def sticking(wheelset: Wheelset, speed: float, sensors: Sensors) -> dict[str, float]:
    """Fields of `SlipLimiter` for the measured creepage of a sticking wheelset at a speed [m/s].

    The compliance, creepage / load torque [1/(N.m)], does not depend on friction, to which zeta0
    and the largest force are both proportional.
    """
    element, radius = wheelset.element, wheelset.radius
    speed = wheelset.conditions(speed=speed).speed
    slope = element.steepest_gradient(speed) * speed
    return {
        "speed_noise": math.hypot(sensors.wheel_speed_noise, sensors.vehicle_speed_noise),
        "stick_torque": STICKS * radius * element.axle_load,
        "stick_compliance": float(1.0 / (radius * slope)),
    }


def slip_gains(
    drivetrain: Drivetrain, *, pole: float, sensors: Sensors, sample_time: float
) -> dict[str, float]:
    """Gains of `SlipLimiter` on slip speed.

    lambda is the geometric mean of the window's ends at the p theta of `pole`, limited to 0.15 to
    0.3: below, a gain of zero would do; above, no gain is robust. The time of the integral action
    is 10/lambda. The gain may then be wrong by a factor of 2.1 either way, and the largest
    sensitivity is 1.6 on the rising branch, 1.7 at p theta = 0.15 and 2.7 at 0.3. Noise of the
    wheel speed limits the gain. Of the rail, only `pole` is used; if it is infinite, the gains are
    those at p theta = 0.3. Traction and braking each have the lambda of their own delay.
    """
    wheelset, rates = drivetrain.wheelset, []
    for braking in (False, True):
        delay = total_delay(drivetrain, sensors, sample_time, braking=braking)
        product = min(max(pole * delay, ROBUST[0]), ROBUST[1])
        window = proportional_window(product / delay, delay=delay)
        rate = math.sqrt(window.lowest * window.highest)
        if sensors.wheel_speed_noise > 0.0:
            torque = wheelset.radius * wheelset.element.axle_load
            noisy = TORQUE_NOISE * torque / sensors.wheel_speed_noise  # largest gain [N.s]
            rate = min(rate, noisy * wheelset.radius / wheelset.inertia)
        rates.append(rate)
    rate, brake_rate = rates
    gain = rate * wheelset.inertia / wheelset.radius
    return {
        "proportional_gain": gain,
        "integral_gain": gain * rate / INTEGRAL,
        "brake_share": brake_rate / rate,
    }
