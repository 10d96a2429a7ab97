"""Gains of creep control with dead time, from the linearised wheelset.

About an operating point the slip speed w = r omega - V follows dw/dt = p w + (r/J) T, with
p = -(r^2/J + 1/M) Q'/V, Q' = dQ/dzeta: unstable on the falling branch (p > 0). All dead times in
the loop and the motor's lag are taken together as one delay theta. Proportional control
T = -k w then holds the point if, and only if, with lambda = k r/J,

    p < lambda < p / cos(x),    tan(x)/x = 1/(p theta),    0 < x < pi/2

(the characteristic root crosses at i x/theta), a window that closes at p theta = 1. The same k
serves all speeds: creepage is w/V, so the gain from creepage to torque is k V, and the pole p
falls as 1/V.
"""

from __future__ import annotations

import math

import numpy as np

from contactlib.drivetrain import Drivetrain
from contactlib.stability import proportional_window, sampled_delay
from contactlib.stability.quasi_steady import creepage_grid, turning_points
from contactlib.traction.sensors import Sensors
from contactlib.traction.speed_tracker import tracked_variance
from contactlib.wheelset import Wheelset

ROBUST = (0.15, 0.3)  # p theta that a gain is designed for
RISING_FOREVER = 30.0  # zeta0 for the creepage of a peak that is not there
INTEGRAL = 10.0  # lambda times the integral action's time
TORQUE_NOISE = 0.01  # of the torque r P of the normal load, what measured noise may shake


def total_delay(drivetrain: Drivetrain, sensors: Sensors, sample_time: float) -> float:
    """Delay theta [s]: sensors, half a sample for the held torque, the motor's lag."""
    return sampled_delay(delay=sensors.delay, lag=drivetrain.motor_lag, sample_time=sample_time)


def least_slip(sensors: Sensors, sample_time: float, filter_time: float) -> float:
    """Slip speed that is not noise: three standard deviations of it as measured [m/s]."""
    tracked = tracked_variance(sample_time, filter_time)
    return 3.0 * math.sqrt(sensors.wheel_speed_noise**2 + tracked * sensors.vehicle_speed_noise**2)


def peak_creepage(wheelset: Wheelset, speed: float) -> float:
    """Creepage of the largest creep force at a speed [m/s] [1].

    Of a law that rises forever thirty times the saturation creepage.
    """
    element = wheelset.element
    peaks = turning_points(
        lambda creepage: element.at_creepage(creepage, speed=speed)["force_gradient"],
        creepage_grid(wheelset, speed=speed),
    )
    if peaks.size == 0:
        return RISING_FOREVER * element.saturation_creepage
    return float(peaks[np.argmax(element.at_creepage(peaks, speed=speed)["creep_force"])])


def stick_compliance(wheelset: Wheelset, speed: float) -> float:
    """Creepage per load torque of a contact that sticks, at a speed [m/s] [1/(N.m)].

    Friction has no part in it: zeta0 and the largest force are both proportional to it.
    """
    slope = wheelset.element.at_creepage(0.0, speed=speed)["force_gradient"] * speed
    return float(1.0 / (wheelset.radius * slope))


def slip_gains(
    drivetrain: Drivetrain, *, pole: float, sensors: Sensors, sample_time: float
) -> tuple[float, float]:
    """Proportional [N.s] and integral [N] gain on slip speed.

    lambda is the geometric mean of the window's ends at p theta = 0.15 to 0.3, whichever is
    nearest to that of `pole`: below it a gain of zero is enough, above it no gain is robust. The
    integral action takes ten times 1/lambda. So the gain may be wrong by a factor of 2.1 either
    way, and the largest sensitivity is 1.6 on the rising branch, 1.7 at p theta = 0.15 and 2.7 at
    0.3. Noise of the wheel speed bounds the gain. Nothing of the rail is used but `pole`, and an
    infinite one stands for any: the gains are then those at p theta = 0.3.
    """
    wheelset, delay = drivetrain.wheelset, total_delay(drivetrain, sensors, sample_time)
    product = min(max(pole * delay, ROBUST[0]), ROBUST[1])
    window = proportional_window(product / delay, delay=delay)
    rate = math.sqrt(window.lowest * window.highest)
    if sensors.wheel_speed_noise > 0.0:
        torque = wheelset.radius * wheelset.element.contact.normal_load
        noisy = TORQUE_NOISE * torque / sensors.wheel_speed_noise  # largest gain [N.s]
        rate = min(rate, noisy * wheelset.radius / wheelset.inertia)
    gain = rate * wheelset.inertia / wheelset.radius
    return gain, gain * rate / INTEGRAL
