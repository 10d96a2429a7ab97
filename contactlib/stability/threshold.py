"""Why a wheelset runs away under torque control: one real pole, unstable on a steep fall.

Closed forms of the linearisation in `contactlib.wheelset`. With kappa = Q'/V and F' = dF/dV it is

    A = [[ -(b + r**2 kappa)/J,  r kappa (1 + zeta)/J           ],
         [ r kappa/M,            -(kappa (1 + zeta) + F')/M     ]]

whose off-diagonal elements have the same sign: both eigenvalues are real, and the first to cross
zero does so where the determinant vanishes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar

from contactlib import kernel
from contactlib.element import creepage_limits
from contactlib.parameters import FloatArray, Limits, checked, checked_number, common_shape
from contactlib.stability import ranges
from contactlib.stability.quasi_steady import creepage_grid
from contactlib.wheelset import CONTACT, OperatingPoint, Wheelset, checked_conditions


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


def approximate_pole(
    *, radius: float, inertia: float, creep_force_slope: ArrayLike, speed: ArrayLike
) -> FloatArray:
    """Fast pole without damping and with the speed held: -r**2 Q'/(J V) [1/s].

    Parameters
    ----------
    radius, inertia : float
        r [m], J [kg.m2].
    creep_force_slope, speed : array_like
        Q' = dQ/dzeta [N] and V [m/s]; they broadcast.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    r = checked_number("radius", radius, ranges.POSITIVE)
    j = checked_number("inertia", inertia, ranges.POSITIVE)
    slope = checked("creep_force_slope", creep_force_slope, ranges.REAL)
    v = checked("speed", speed, ranges.POSITIVE)
    common_shape({"creep_force_slope": slope, "speed": v})
    return np.asarray(-(r**2) * slope / (j * v))


def poles(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: ArrayLike,
    normal_load: ArrayLike | None = None,
    friction_scale: ArrayLike = 1.0,
) -> NDArray[np.complex128]:
    """Eigenvalues of the wheelset at operating points, by falling real part [1/s].

    Parameters
    ----------
    wheelset : Wheelset
        With its torque, and what else pulls at the vehicle, such that each point is at rest.
    creepage, speed, normal_load, friction_scale : array_like
        Points [1, m/s, N, 1]; they broadcast.

    Returns
    -------
    ndarray, shape (..., 1) or (..., 2)
        One eigenvalue if the speed is held, else two: that of the creepage, and that of the
        vehicle. They are real but for friction that falls with slip speed.

    Raises
    ------
    ValueError
        If a value is out of range; the speed must be at least the element's minimum speed.
    """
    slowest = wheelset.element.minimum_speed
    fastest = kernel.wheelset_limits()["speed"].at_most
    v = checked("speed", speed, Limits(at_least=slowest, at_most=fastest))
    limits = creepage_limits(wheelset.element, float(v.max(initial=slowest)))
    zeta = checked("creepage", creepage, limits)
    common_shape({"creepage": zeta, "speed": v})
    r, j, b = wheelset.radius, wheelset.inertia, wheelset.damping
    contact = wheelset.element.evaluate(
        omega=(1.0 + zeta) * v / r,
        speed=v,
        normal_load=normal_load,
        friction_scale=friction_scale,
    )
    by_omega, by_speed = contact["force_by_omega"], contact["force_by_speed"]
    if wheelset.mass is None:
        return np.asarray(-(b + r * by_omega) / j, dtype=np.complex128)[..., np.newaxis]
    m = wheelset.mass
    growth = wheelset.resistance.linear + 2.0 * wheelset.resistance.quadratic * v  # F'
    trace = -(b + r * by_omega) / j + (by_speed - growth) / m
    # Of the products in the determinant the two of Q' with Q' cancel: they are left out.
    determinant = (b * (growth - by_speed) + r * by_omega * growth) / (j * m)
    root = np.sqrt((trace**2 - 4.0 * determinant).astype(np.complex128))
    larger = 0.5 * (trace + np.where(trace < 0.0, -root, root))  # nothing cancels here either
    smaller = np.divide(determinant, larger, out=np.zeros_like(larger), where=larger != 0.0)
    both = np.stack([larger, smaller], axis=-1)
    return np.take_along_axis(both, np.argsort(-both.real, axis=-1, kind="stable"), axis=-1)


def fast_pole(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: ArrayLike,
    normal_load: ArrayLike | None = None,
    friction_scale: ArrayLike = 1.0,
) -> FloatArray:
    """Real part of the eigenvalue of the creepage at operating points [1/s].

    Arguments as `poles`: the only one of a held speed; of a free wheelset's two the unstable one,
    or else the one farther from zero. Near `approximate_pole`.
    """
    found = poles(
        wheelset, creepage, speed=speed, normal_load=normal_load, friction_scale=friction_scale
    ).real
    first, last = found[..., 0], found[..., -1]
    return np.asarray(np.where(first > 0.0, first, last))


class WorstPole(NamedTuple):
    """The largest pole at one speed.

    Attributes
    ----------
    pole : float
        [1/s]; not above zero if a constant torque holds every creepage.
    creepage : float
        Where [1].
    """

    pole: float
    creepage: float


def worst_pole(
    wheelset: Wheelset,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
) -> WorstPole:
    """Largest `fast_pole` over the creepages of traction, and where it is.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    inputs = checked_conditions(
        wheelset, speed=speed, normal_load=normal_load, friction_scale=friction_scale
    )
    given = {name: inputs[name] for name in CONTACT}
    grid = creepage_grid(wheelset, **given)

    def stability(log_creepage: ArrayLike) -> FloatArray:
        return -fast_pole(wheelset, np.exp(log_creepage), **given)

    logs = np.log(grid)
    i = int(np.clip(np.argmin(stability(logs)), 1, grid.size - 2))
    best = minimize_scalar(
        lambda at: float(stability(at)),
        bounds=(logs[i - 1], logs[i + 1]),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return WorstPole(float(-best.fun), float(np.exp(best.x)))
