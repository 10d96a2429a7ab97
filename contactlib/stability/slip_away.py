"""How long a creepage takes from one value to another under a constant torque.

The speed is frozen meanwhile: dt = (J V/r) dzeta/(T - T_s(zeta)), see
`contactlib.stability.quasi_steady`.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import quad

from contactlib.element import creepage_limits
from contactlib.parameters import FINITE, POSITIVE, FloatArray, checked_number, derived
from contactlib.stability.fold import find_fold
from contactlib.stability.quasi_steady import (
    creepage_grid,
    quasi_steady_slope,
    quasi_steady_torque,
    turning_points,
)
from contactlib.wheelset import CONTACT, Wheelset, checked_conditions, checked_torque

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)  # of the torque; so close it is the fold's own


def slip_away_time(
    wheelset: Wheelset,
    *,
    drive_torque: float,
    speed: float,
    start: float,
    end: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> float:
    """Time in which a constant torque takes the creepage from `start` to `end` [s].

    Exact for a held speed. A free wheelset's speed is frozen, the acceleration of the vehicle
    with the creep force is not. If `end` is below `start` it is the time to recover.

    Parameters
    ----------
    wheelset : Wheelset
        What moves.
    drive_torque, speed : float
        [N.m, m/s].
    start, end : float
        Creepages [1].
    normal_load, friction_scale, resistance_force : float, optional
        Further inputs [N, 1, N].

    Returns
    -------
    float
        Infinite if the creepage never gets there: it moves the other way, or comes to rest.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    torque = checked_torque(drive_torque)
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    contact = {name: inputs[name] for name in CONTACT}
    first, last = (
        checked_number(name, value, creepage_limits(wheelset.element, inputs["speed"]))
        for name, value in (("start", start), ("end", end))
    )
    if first == last:
        return 0.0
    way = math.copysign(1.0, last - first)

    def surplus(creepage: Any) -> Any:
        """Torque that is left to move the creepage along its way."""
        return way * (torque - quasi_steady_torque(wheelset, creepage, **inputs))

    def slope(creepage: Any) -> Any:
        return -way * quasi_steady_slope(wheelset, creepage, **inputs)

    low, high = min(first, last), max(first, last)
    positive = creepage_grid(wheelset, **contact)
    grid = np.concatenate([-positive[::-1], [0.0], positive])
    grid = np.union1d(grid, turning_points(slope, grid))  # or a fold would hide between nodes
    grid = np.concatenate([[low], grid[(low < grid) & (grid < high)], [high]])
    values = surplus(grid)
    least = float(values.min())
    rounding = ROUNDING * abs(torque)
    if least <= rounding:
        return math.inf

    # The time is spent around the least surplus D, where 1/(D + C z**2/2) is a narrow peak. With
    # z = width sinh(u) it becomes 1/cosh(u), and a long way off stays short.
    i = int(values.argmin())
    centre = float(grid[i])
    width = _width(grid, slope(grid), i, least)
    ends = [math.asinh((z - centre) / width) for z in (low, high)]

    def integrand(u: float) -> float:
        return math.cosh(u) / float(surplus(centre + width * math.sinh(u)))

    parts = sorted({ends[0], max(ends[0], 0.0), min(ends[1], 0.0), ends[1]})
    error = max(1e-9, 10.0 * rounding / least)
    total = sum(
        quad(integrand, a, b, epsabs=0.0, epsrel=error, limit=400)[0] for a, b in pairwise(parts)
    )
    return float(wheelset.inertia * inputs["speed"] / wheelset.radius * width * total)


def _width(grid: FloatArray, slopes: FloatArray, i: int, least: float) -> float:
    """Distance from the least value, at node i, over which a parabola from it doubles [1]."""
    a, c = max(i - 1, 0), min(i + 1, grid.size - 1)
    span = float(grid[-1] - grid[0])
    curvature = float(slopes[c] - slopes[a]) / float(grid[c] - grid[a])
    return min(span, math.sqrt(2.0 * least / curvature)) if curvature > 0.0 else span


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
    """Closed form of the time in which an overload takes the creepage from rest to far out [s].

    pi (J V/r**2)/sqrt(eps Q_pk |Q''|/2) + J V (zeta_end - zeta_pk)/(r (T - r f_d P)), with
    T = (1 + eps) r Q_pk: the time to squeeze past the peak, taken as a parabola of endless arms,
    and then the time under the torque that kinetic friction leaves over. Without damping, and
    with the speed held. The far arm of the parabola is counted on top of the second time, so the
    sum is too long: the less so the smaller the overload and the farther the end. For the wheel of
    Fig. 6 (k_hat 0.3) it is within 15 % up to an overload of 10 % if the end is ten times the
    saturation creepage, and within 4 % up to 50 % if it is sixty-six times that.

    Parameters
    ----------
    radius, inertia, speed : float
        r [m], J [kg.m2], V [m/s].
    overload : float
        eps, torque above that of the peak, over it [1].
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
    *,
    drive_torque: float,
    speed: float,
    end: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> float:
    """`slip_away_formula` for a wheelset with damping and a free speed, from its fold [s].

    The quasi-steady torque takes the place of r Q, its return torque that of r f_d P.
    Infinite if the torque is not above the fold.

    Raises
    ------
    ValueError
        If a value is out of range, or there is no fold.
    """
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    torque, far = checked_torque(drive_torque), checked_number("end", end, FINITE)
    fold = find_fold(wheelset, **inputs)
    overload = torque / fold.drive_torque - 1.0
    if overload <= 0.0:
        return math.inf
    step = 1e-4 * fold.creepage
    slopes = quasi_steady_slope(wheelset, [fold.creepage - step, fold.creepage + step], **inputs)
    return slip_away_formula(
        radius=wheelset.radius,
        inertia=wheelset.inertia,
        speed=inputs["speed"],
        overload=overload,
        peak_force=fold.drive_torque / wheelset.radius,
        peak_curvature=float(slopes[0] - slopes[1]) / (2.0 * step * wheelset.radius),
        peak_creepage=fold.creepage,
        end_creepage=far,
        sliding_force=fold.return_torque / wheelset.radius,
    )
