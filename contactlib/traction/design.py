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
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import POSITIVE, checked
from contactlib.traction.sensors import Sensors
from contactlib.wheelset import Wheelset

ROBUST = (0.15, 0.3)  # p theta that a gain is designed for
INTEGRAL = 10.0  # lambda times the integral action's time
TORQUE_NOISE = 0.05  # of the nominal kinetic friction's torque, what measured noise may shake


class GainWindow(NamedTuple):
    """Which proportional gains hold a point.

    Attributes
    ----------
    pole : float
        p, the fast pole; above zero on the falling branch [1/s].
    delay : float
        theta, all dead times and lags of the loop [s].
    lower, upper : float
        Bounds of lambda = k r/J [1/s]; without any between them if p theta >= 1.
    """

    pole: float
    delay: float
    lower: float
    upper: float

    @property
    def controllable(self) -> bool:
        """Whether any gain holds the point."""
        return self.pole * self.delay < 1.0


def gain_window(pole: float, delay: float) -> GainWindow:
    """Window of lambda for an unstable pole [1/s] and a delay [s]; `pole` may be below zero.

    Raises
    ------
    ValueError
        If the delay is not above zero.

    Examples
    --------
    >>> window = gain_window(0.0, 0.02)  # a pure integrator: pi/2 over the delay
    >>> round(window.lower, 3), round(window.upper, 3)
    (0.0, 78.54)
    >>> gain_window(60.0, 0.02).controllable
    False
    """
    checked("delay", delay, POSITIVE)
    product = pole * delay
    if product >= 1.0:
        return GainWindow(pole, delay, pole, pole)
    if product == 0.0:
        crossing = 0.5 * math.pi
    else:
        # x cos(x) = p theta sin(x), x the phase that the delay takes at the crossing.
        def excess(x: float) -> float:
            return x * math.cos(x) - product * math.sin(x)

        most = 0.5 * math.pi if product > 0.0 else math.pi
        crossing = float(brentq(excess, 1e-9 if product > 0.0 else 0.5 * math.pi, most))
    return GainWindow(pole, delay, max(pole, 0.0), math.hypot(crossing / delay, pole))


def total_delay(drivetrain: Drivetrain, sensors: Sensors, sample_time: float) -> float:
    """Delay theta [s]: sensors, half a sample for the held torque, the motor's lag."""
    return sensors.delay + 0.5 * sample_time + drivetrain.motor_lag


def fast_pole(wheelset: Wheelset, creepage: float, speed: float) -> float:
    """Pole p at a creepage [1] and speed [m/s], friction as nominal [1/s]."""
    slope = wheelset.balanced(creepage=creepage, speed=speed).creep_force_slope
    return -wheelset.effective_inverse_mass * slope / speed


def steepest_fall(wheelset: Wheelset, speed: float) -> float:
    """Creepage at which the creep force falls most steeply at a speed [m/s] [1]."""
    creepage = wheelset.element.saturation_creepage * np.geomspace(0.01, 30.0, 3001)
    return float(
        creepage[np.argmin(wheelset.element.at_creepage(creepage, speed=speed)["force_gradient"])]
    )


def peak_creepage(wheelset: Wheelset, speed: float) -> float:
    """Creepage of the largest creep force at a speed [m/s] [1]."""
    creepage = wheelset.element.saturation_creepage * np.geomspace(0.01, 30.0, 3001)
    return float(
        creepage[np.argmax(wheelset.element.at_creepage(creepage, speed=speed)["creep_force"])]
    )


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
    0.3. Noise of the wheel speed bounds the gain.
    """
    wheelset, delay = drivetrain.wheelset, total_delay(drivetrain, sensors, sample_time)
    product = min(max(pole * delay, ROBUST[0]), ROBUST[1])
    window = gain_window(product / delay, delay)
    rate = math.sqrt(window.lower * window.upper)
    if sensors.wheel_speed_noise > 0.0:
        element = wheelset.element
        torque = wheelset.radius * element.friction.kinetic * element.contact.normal_load
        noisy = TORQUE_NOISE * torque / sensors.wheel_speed_noise  # largest gain [N.s]
        rate = min(rate, noisy * wheelset.radius / wheelset.inertia)
    gain = rate * wheelset.inertia / wheelset.radius
    return gain, gain * rate / INTEGRAL
