"""What creep control needs to hold a point that a constant torque cannot.

Closed forms of the linearisation in `contactlib.wheelset`.
"""

from __future__ import annotations

import math

from contactlib.wheelset import OperatingPoint, Wheelset


def creep_control_gain(wheelset: Wheelset, point: OperatingPoint) -> float:
    """Smallest gain Kp of T = T0 + Kp (zeta_ref - zeta) that holds `point` [N.m].

    The larger of two bounds, from the determinant and the trace of the closed loop; zero or less
    where a constant torque does it too. Infinite where no gain does: with damping, and a
    resistance that does not grow with speed, a faster vehicle is left less and less torque by the
    drive, asks for less creepage, and on the falling branch gains the force to go faster still.
    Without damping such a vehicle is merely free to roll at any speed, and the trace decides.
    """
    r, j, b = wheelset.radius, wheelset.inertia, wheelset.damping
    fall, speed, stretch = -point.creep_force_slope, point.speed, 1.0 + point.creepage
    if wheelset.mass is None:
        return r * fall - b * speed / r
    m, slope = wheelset.mass, point.resistance_slope
    growth = slope - point.creep_force_speed_slope
    trace = r * fall * (1.0 + j * stretch / (m * r**2)) - speed / r * (b + j * growth / m)
    loss = r * fall * (slope + b * stretch / r**2) - b * speed / r * growth
    if growth > 0.0:
        return max(loss / growth, trace)  # det is growth Kp - loss, but for a factor
    return trace if growth * trace >= loss else math.inf
