"""Quasi-steady creepage: steady states of the creepage with the speed frozen.

With the speed frozen, the creepage of a wheelset under a drive torque T moves by

    dzeta/dt = (r/(J V)) (T - T_s(zeta)),    T_s = r Q + b omega + (J/r)(1 + zeta) dV/dt,

exactly, as J domega/dt = T - r Q - b omega and zeta = (r omega - V)/V. The curve of T_s, the
quasi-steady torque, gives the steady creepages, their stability and the time between two of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.base.quantities import FINITE, FloatArray, checked
from contactlib.vehicle.conditions import Conditions, GivenConditions
from contactlib.vehicle.wheelset import Wheelset


def quasi_steady_torque(
    wheelset: Wheelset,
    creepage: ArrayLike,
    at: Conditions | None = None,
    **given: Unpack[GivenConditions],
) -> FloatArray:
    """Drive torque that keeps a creepage unchanged while the vehicle accelerates [N.m].

    T = r Q + b omega + (J/r)(1 + zeta) dV/dt. The last term accelerates the rotation along with
    the vehicle; it vanishes if the speed is held.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    creepage : array_like
        Creepages [1].
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    """
    zeta = checked("creepage", creepage, FINITE)
    at = wheelset.conditions(at, **given)
    record = wheelset.element.at_creepage(zeta, **at.contact)
    r, force = wheelset.radius, record["creep_force"]
    acceleration = _acceleration(wheelset, force, at)
    turning = wheelset.inertia / r * (1.0 + zeta) * acceleration
    return np.asarray(r * force + wheelset.damping * (1.0 + zeta) * at.speed / r + turning)


def quasi_steady_slope(
    wheelset: Wheelset,
    creepage: ArrayLike,
    at: Conditions | None = None,
    **given: Unpack[GivenConditions],
) -> FloatArray:
    """Derivative of `quasi_steady_torque` with respect to the creepage, at fixed speed [N.m].

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    creepage : array_like
        Creepages [1].
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    """
    zeta = checked("creepage", creepage, FINITE)
    at = wheelset.conditions(at, **given)
    record = wheelset.element.at_creepage(zeta, **at.contact)
    r, rise = wheelset.radius, record["force_gradient"] * at.speed  # dQ/dzeta
    slope = r * rise + wheelset.damping * at.speed / r
    if wheelset.mass is not None:
        acceleration = _acceleration(wheelset, record["creep_force"], at)
        slope = slope + wheelset.inertia / r * (acceleration + (1.0 + zeta) * rise / wheelset.mass)
    return np.asarray(slope)


def slip_acceleration(
    wheelset: Wheelset,
    creepage: ArrayLike,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    **given: Unpack[GivenConditions],
) -> FloatArray:
    """Rate of the slip velocity r omega - V under a drive torque [m/s2].

    V dzeta/dt + zeta dV/dt: under hard braking the slip velocity may fall while the creepage grows.
    """
    at = wheelset.conditions(at, **given)
    zeta = np.asarray(creepage, dtype=np.float64)
    surplus = drive_torque - quasi_steady_torque(wheelset, zeta, at)
    stretching = zeta * vehicle_acceleration(wheelset, zeta, at)
    return np.asarray(wheelset.radius / wheelset.inertia * surplus + stretching)


def vehicle_acceleration(
    wheelset: Wheelset,
    creepage: ArrayLike,
    at: Conditions | None = None,
    **given: Unpack[GivenConditions],
) -> FloatArray:
    """Vehicle acceleration dV/dt at a creepage [m/s2]: zero if the speed is held."""
    at = wheelset.conditions(at, **given)
    record = wheelset.element.at_creepage(creepage, **at.contact)
    return _acceleration(wheelset, record["creep_force"], at)


def creepage_pole(
    wheelset: Wheelset,
    creepage: ArrayLike,
    at: Conditions | None = None,
    **given: Unpack[GivenConditions],
) -> FloatArray:
    """Pole of the creepage about its quasi-steady state, with the speed frozen [1/s].

    -(r/(J V)) dT_s/dzeta: negative where the quasi-steady torque rises. For a held speed it is the
    pole of the wheelset; for a free one it is the fast pole up to terms of the size of F'/M.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    creepage : array_like
        Creepages [1].
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    """
    at = wheelset.conditions(at, **given)
    slope = quasi_steady_slope(wheelset, creepage, at)
    return np.asarray(-wheelset.radius * slope / (wheelset.inertia * at.speed))


def creepage_grid(
    wheelset: Wheelset, at: Conditions | None = None, **given: Unpack[GivenConditions]
) -> FloatArray:
    """Positive creepages [1], dense enough to resolve every rise and fall of the torque."""
    at = wheelset.conditions(at, **given)
    scale = wheelset.element.saturation_creepage_at(
        normal_load=at.normal_load, friction_scale=at.friction_scale
    )
    # Where friction falls with slip speed, the peak may be as early as the zeta0 of the friction
    # that is left, and the grid must extend over the whole fall; with heat it never ends.
    friction = wheelset.element.friction
    fall = friction.slip_rate_decay * at.speed * scale  # over one zeta0
    first, last = 0.01 * friction.least_left, max(1e5, 40.0 / fall if fall > 0.0 else 0.0)
    if friction.softens_with_heat:
        last = 1e6
    return scale * np.geomspace(first, last, round(571.0 * math.log10(last / first)) + 4)


def turning_points(slope: Callable[[Any], Any], grid: FloatArray) -> FloatArray:
    """Creepages at which a slope changes sign or vanishes, in the order of `grid` [1].

    They catch a curve that only just reaches a value between two nodes of the grid.
    """
    values = slope(grid)
    ends = np.flatnonzero(values[:-1] * values[1:] < 0.0)

    def root(i: int) -> float:
        return float(
            brentq(lambda z: float(slope(z)), grid[i], grid[i + 1], xtol=1e-16, rtol=1e-14)
        )

    return np.union1d(grid[values == 0.0], [root(int(i)) for i in ends])


def steady_creepage(
    wheelset: Wheelset,
    torque: float,
    *,
    speed: float,
    normal_load: float,
    friction_scale: float | tuple[float, float],
    resistance_force: float = 0.0,
) -> float:
    """Creepage on the rising branch that a drive torque [N.m] holds [1].

    Two friction scales are those of the two wheels, each of which carries half of the load.

    Raises
    ------
    ValueError
        If there is none: the torque is above the fold.
    """
    contacts: list[dict[str, Any]] = [
        {"speed": speed, "normal_load": normal_load, "friction_scale": friction}
        for friction in sorted(set(np.atleast_1d(friction_scale).tolist()))
    ]

    def mean(curve: Callable[..., FloatArray], creepage: ArrayLike, of: Any) -> FloatArray:
        each = [
            curve(wheelset, creepage, resistance_force=resistance_force, **contact)
            for contact in of
        ]
        return np.asarray(np.mean(each, axis=0))

    def excess(creepage: ArrayLike) -> FloatArray:
        return mean(quasi_steady_torque, creepage, contacts) - torque

    sign = 1.0 if excess(0.0) <= 0.0 else -1.0
    grids = [creepage_grid(wheelset, **contact) for contact in contacts]
    grid = np.unique(np.concatenate([[0.0], *grids]))

    def turns(of: Any) -> FloatArray:
        return turning_points(lambda z: mean(quasi_steady_slope, sign * z, of), grid)

    # The branch ends at the peak; with two wheels, at the later of their peaks.
    reach = max(float(np.min(turns([contact]), initial=grid[-1])) for contact in contacts)
    ends = np.union1d(np.append(grid, reach), turns(contacts))
    ends = sign * ends[ends <= reach]
    passed = np.flatnonzero(sign * excess(ends) >= 0.0)
    if passed.size == 0:
        most = torque + sign * float(np.max(sign * excess(ends)))
        raise ValueError(
            f"drive torque = {torque!r} at the start is out of range: the rising branch ends at "
            f"{most:.6g}"
        )
    i = int(passed[0])
    if i == 0:
        return 0.0
    return float(brentq(lambda z: float(excess(z)), ends[i - 1], ends[i], xtol=1e-16))


def _acceleration(wheelset: Wheelset, creep_force: Any, at: Conditions) -> FloatArray:
    """Vehicle acceleration under a creep force [m/s2]: zero if the speed is held."""
    if wheelset.mass is None:
        return np.zeros_like(creep_force)
    load = wheelset.element.normal_load
    omega = at.speed / wheelset.radius  # rolling without creepage and creep force
    coasting, _ = wheelset.rates(omega, at.speed, 0.0, load, 1.0, at.resistance_force)
    return np.asarray(creep_force / wheelset.mass + coasting.speed_rate)
