"""Why a wheelset runs away under torque control: one real pole, unstable on a steep fall.

Closed forms of the linearisation in `contactlib.wheelset`.
"""

from __future__ import annotations

from contactlib.wheelset import OperatingPoint, Wheelset


def slope_threshold(wheelset: Wheelset, point: OperatingPoint) -> float:
    """Creep force slope Q' = dQ/dzeta below which a constant torque cannot hold `point` [N].

    -V/(r**2/b + (1 + zeta)/F') for a free wheelset, -b V/r**2 for a held speed; zero, the case
    of the paper, without damping or without a resistance that grows with speed. If friction falls
    with slip speed, dQ/dV at fixed creepage is not zero, and a free wheelset with damping has
    -V (F' - dQ/dV)/(r**2 F'/b + 1 + zeta).
    """
    r, b, speed = wheelset.radius, wheelset.damping, point.speed
    if b == 0.0:
        return 0.0
    if wheelset.speed_held:
        return -b * speed / r**2
    growth = point.resistance_slope - point.creep_force_speed_slope
    return -speed * growth / (r**2 * point.resistance_slope / b + 1.0 + point.creepage)
