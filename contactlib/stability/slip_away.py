"""Time in which a constant torque changes the creepage from one value to another.

The speed is frozen: dt = (J V/r) dzeta/(T - T_s(zeta)), see `contactlib.vehicle.creep_curve`.
Rolling is taken as steady: see `reduced_frequency`.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, Unpack

import numpy as np
from scipy.integrate import quad

from contactlib.base.quantities import FINITE, POSITIVE, checked_number, derived
from contactlib.element.force_element import creepage_limits
from contactlib.stability.poles import steady_rolling
from contactlib.vehicle.conditions import Conditions, GivenConditions
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.wheelset import Wheelset, checked_torque

NEAR = 0.004  # distance over which the curvature is taken / creepage
ROUNDING = 4.0 * float(
    np.finfo(np.float64).eps
)  # relative distance below which a torque equals the fold's


def slip_away_time(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    start: float,
    end: float,
    **given: Unpack[GivenConditions],
) -> float:
    """Time in which a constant torque takes the creepage from `start` to `end` [s].

    The result is exact for a held speed. For a free wheelset the speed is frozen, but the vehicle's
    acceleration follows the creep force. If `end` is below `start`, it is the time to recover.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    drive_torque : float
        Constant torque [N.m].
    start, end : float
        First and last creepage [1].

    Returns
    -------
    float
        Infinite if the creepage never reaches `end`: it moves the other way, or comes to rest.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    torque, at = checked_torque(drive_torque), wheelset.conditions(at, **given)
    curve, speed = CreepCurve(steady_rolling(wheelset, "slip_away_time", at), at), at.speed
    first, last = (
        checked_number(name, value, creepage_limits(wheelset.element, speed))
        for name, value in (("start", start), ("end", end))
    )
    if first == last:
        return 0.0
    way = math.copysign(1.0, last - first)

    def surplus(creepage: Any) -> Any:
        """Excess torque in the direction of the change."""
        return way * (torque - curve.torque(creepage))

    low, high = min(first, last), max(first, last)
    turns = np.concatenate([curve.turns_in_braking[::-1], curve.turns])
    places = np.concatenate([[low], turns[(low < turns) & (turns < high)], [high]])
    values = surplus(places)
    smallest = float(values.min())
    rounding = ROUNDING * abs(torque)
    if smallest <= rounding:
        return math.inf

    # Most of the time passes near the smallest surplus D, where 1/(D + C z**2/2) is a narrow peak.
    # z = width sinh(u) turns it into 1/cosh(u), and shortens the long tails.
    centre = float(places[values.argmin()])
    near = NEAR * max(abs(centre), wheelset.element.saturation_creepage)
    around = np.array([max(low, centre - near), min(high, centre + near)])
    curvature = -way * float(np.diff(curve.slope(around))[0] / np.diff(around)[0])
    width = high - low
    if curvature > 0.0:
        width = min(width, math.sqrt(2.0 * smallest / curvature))
    ends = [math.asinh((z - centre) / width) for z in (low, high)]

    def integrand(u: float) -> float:
        return math.cosh(u) / float(surplus(centre + width * math.sinh(u)))

    parts = sorted({ends[0], max(ends[0], 0.0), min(ends[1], 0.0), ends[1]})
    error = max(1e-9, 10.0 * rounding / smallest)
    total = sum(
        quad(integrand, a, b, epsabs=0.0, epsrel=error, limit=400)[0] for a, b in pairwise(parts)
    )
    return float(wheelset.inertia * speed / wheelset.radius * width * total)


def slip_away_formula(
    *,
    radius: float,
    inertia: float,
    speed: float,
    overload: float,
    peak_force: float,
    peak_curvature: float,
    peak_creepage: float,
    end_creepage: float,
    sliding_force: float,
) -> float:
    """Closed form of the time in which an overload moves the creepage from zero to far out [s].

    pi (J V/r**2)/sqrt(eps Q_pk |Q''|/2) + J V (zeta_end - zeta_pk)/(r (T - r f_d P)), with
    T = (1 + eps) r Q_pk: the time to pass the peak, taken as an infinite parabola, plus the time
    under the torque in excess of kinetic friction, without damping and with the speed held. The
    far arm of the parabola is counted in addition, so the sum is too long, and the less so the
    smaller the overload and the farther the end. For the wheel of Fig. 6 (k_hat 0.3) it is within
    15 % up to an overload of 10 % if the end is ten times the saturation creepage, and within 4 %
    up to 50 % if it is 67 times that.

    Parameters
    ----------
    radius, inertia, speed : float
        r [m], J [kg.m2], V [m/s].
    overload : float
        eps, torque / torque of the peak - 1 [1].
    peak_force, peak_curvature, peak_creepage : float
        Q_pk [N], |Q''| there [N], zeta_pk [1].
    end_creepage : float
        zeta_end [1].
    sliding_force : float
        f_d P [N].

    Raises
    ------
    ValueError
        If a value is out of range, or the sliding wheel holds the torque.
    """
    given = {
        "radius": checked_number("radius", radius, POSITIVE),
        "inertia": checked_number("inertia", inertia, POSITIVE),
        "speed": checked_number("speed", speed, POSITIVE),
        "overload": checked_number("overload", overload, POSITIVE),
        "peak_force": checked_number("peak_force", peak_force, POSITIVE),
        "peak_curvature": checked_number("peak_curvature", peak_curvature, POSITIVE),
        "peak_creepage": checked_number("peak_creepage", peak_creepage, FINITE),
        "end_creepage": checked_number("end_creepage", end_creepage, FINITE),
        "sliding_force": checked_number("sliding_force", sliding_force, FINITE),
    }
    r, j, v, eps, force, curvature, start, end, sliding = given.values()

    def left_over() -> float:
        return r * ((1.0 + eps) * force - sliding)

    def time() -> float:
        passing = math.pi * j * v / (r**2 * math.sqrt(0.5 * eps * force * curvature))
        return passing + j * v * (end - start) / (r * left_over())

    derived("torque over sliding_force", left_over, given)
    return derived("slip-away time", time, given)


def slip_away_estimate(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    end: float,
    **given: Unpack[GivenConditions],
) -> float:
    """Apply `slip_away_formula` to the fold of a wheelset with damping and free speed [s].

    The quasi-steady torque replaces r Q, and its return torque r f_d P. The time is infinite if
    the torque is not above the fold.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    drive_torque, end : float
        Constant torque [N.m], and last creepage [1].

    Raises
    ------
    ValueError
        If a value is out of range, or there is no fold.
    """
    at = wheelset.conditions(at, **given)
    curve = CreepCurve(steady_rolling(wheelset, "slip_away_estimate", at), at)
    torque, far = checked_torque(drive_torque), checked_number("end", end, FINITE)
    fold = curve.fold
    overload = torque / fold.drive_torque - 1.0
    if overload <= 0.0:
        return math.inf
    step = 1e-4 * fold.creepage
    slopes = curve.slope([fold.creepage - step, fold.creepage + step])
    return slip_away_formula(
        radius=wheelset.radius,
        inertia=wheelset.inertia,
        speed=curve.at.speed,
        overload=overload,
        peak_force=fold.drive_torque / wheelset.radius,
        peak_curvature=float(slopes[0] - slopes[1]) / (2.0 * step * wheelset.radius),
        peak_creepage=fold.creepage,
        end_creepage=far,
        sliding_force=fold.return_torque / wheelset.radius,
    )
