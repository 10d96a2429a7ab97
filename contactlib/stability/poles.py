"""Poles of a wheelset under constant torque: one real pole is unstable where the force falls.

Closed forms of the linearisation in `vehicle.wheelset`. With kappa = Q'/V and F' = dF/dV it is

    A = [[ -(b + r**2 kappa)/J,  r kappa (1 + zeta)/J           ],
         [ r kappa/M,            -(kappa (1 + zeta) + F')/M     ]]

whose off-diagonal elements have the same sign: both eigenvalues are real, and the first one crosses
zero where the determinant vanishes. A contact with memory adds its states to the linearisation,
whose eigenvalues are then computed numerically; they are those of a slip-away, as
`Wheelset.jacobians` states.
"""

from __future__ import annotations

import warnings
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib import kernel
from contactlib.base.quantities import (
    MODERATE,
    MODERATE_POSITIVE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    common_shape,
)
from contactlib.element.force_element import RangeWarning, creepage_limits
from contactlib.vehicle.conditions import Conditions, GivenConditions, OperatingPoint
from contactlib.vehicle.creep_curve import CreepCurve, WorstPole
from contactlib.vehicle.wheelset import Wheelset, davis, of_the_motion

# Reduced frequency up to which slip-away and limit cycles of the steady law are within 5 % of those
# of a contact with memory; see `reduced_frequency`.
STEADY_ROLLING = 0.5


def slope_threshold(wheelset: Wheelset, point: OperatingPoint) -> float:
    """Creep force slope Q' = dQ/dzeta below which `point` is unstable at constant torque [N].

    It is -V/(r**2/b + (1 + zeta)/F') for a free wheelset, -b V/r**2 for a held speed, and zero, the
    case of the paper, without damping or without a resistance that grows with speed. If friction
    falls with slip speed, dQ/dV at fixed creepage is not zero, and a free wheelset with damping
    has -V (F' - dQ/dV)/(r**2 F'/b + 1 + zeta); with a light vehicle two eigenvalues may become
    complex before, and cross zero at -V ((F' - dQ/dV)/M + b/J)/(r**2/J + (1 + zeta)/M).
    """
    r, b, speed = wheelset.radius, wheelset.damping, point.speed
    if b == 0.0:
        return 0.0
    if wheelset.mass is None:
        return -b * speed / r**2
    growth, rolling = point.resistance_slope - point.creep_force_speed_slope, 1.0 + point.creepage
    # Slopes at which the determinant and the trace of the linearized motion are zero.
    determinant = -growth / (r**2 * point.resistance_slope / b + rolling)
    trace = -(growth / wheelset.mass + b / wheelset.inertia) / (
        r**2 / wheelset.inertia + rolling / wheelset.mass
    )
    return speed * max(determinant, trace)


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
    r = checked_number("radius", radius, MODERATE_POSITIVE)
    j = checked_number("inertia", inertia, MODERATE_POSITIVE)
    slope = checked("creep_force_slope", creep_force_slope, MODERATE)
    v = checked("speed", speed, MODERATE_POSITIVE)
    common_shape({"creep_force_slope": slope, "speed": v})
    return np.asarray(-(r**2) * slope / (j * v))


def poles(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: ArrayLike,
    axle_load: ArrayLike | None = None,
    friction_scale: ArrayLike = 1.0,
) -> NDArray[np.complex128]:
    """Eigenvalues of the wheelset at operating points, by falling real part [1/s].

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset, with torque and outer forces that balance each point.
    creepage, speed, axle_load, friction_scale : array_like
        Points [1, m/s, N, 1]; they broadcast.

    Returns
    -------
    ndarray, shape (..., n)
        One eigenvalue if the speed is held, else two: those of creepage and vehicle speed. They
        are real unless friction falls with slip speed. A contact with memory adds those of its
        held force and of its unslipped part, on the side of a slip-away: see `Wheelset.jacobians`.

    Raises
    ------
    ValueError
        If a value is out of range; the speed must be at least the element's minimum speed.
    """
    return _eigenvalues(wheelset, creepage, speed, axle_load, friction_scale)


def _eigenvalues(
    wheelset: Wheelset,
    creepage: ArrayLike,
    speed: ArrayLike,
    axle_load: ArrayLike | None,
    friction_scale: ArrayLike,
    *,
    away: bool = False,
) -> NDArray[np.complex128]:
    """The same, with memory and `away` those of a slip-away: see `of_the_motion`."""
    slowest = wheelset.element.minimum_speed
    fastest = kernel.wheelset_limits()["speed"].at_most
    v = checked("speed", speed, Limits(at_least=slowest, at_most=fastest))
    limits = creepage_limits(wheelset.element, float(v.max(initial=slowest)))
    zeta = checked("creepage", creepage, limits)
    common_shape({"creepage": zeta, "speed": v})
    r, j, b = wheelset.radius, wheelset.inertia, wheelset.damping
    load = wheelset.element.axle_load if axle_load is None else axle_load
    given = {"axle_load": load, "friction_scale": friction_scale}
    contact = wheelset.element.evaluate(omega=(1.0 + zeta) * v / r, speed=v, **given)
    if wheelset.element.memory:
        matrices = wheelset.jacobians(zeta, speed=v, **given)
        return _by_growth(np.linalg.eigvals(of_the_motion(matrices) if away else matrices))
    by_omega, by_speed = contact["force_by_omega"], contact["force_by_speed"]
    if wheelset.mass is None:
        return np.asarray(-(b + r * by_omega) / j, dtype=np.complex128)[..., np.newaxis]
    m = wheelset.mass
    growth = davis(wheelset.resistance, v)[1]
    trace = -(b + r * by_omega) / j + (by_speed - growth) / m
    # The determinant's two products of Q' with Q' cancel and are omitted.
    determinant = (b * (growth - by_speed) + r * by_omega * growth) / (j * m)
    root = np.sqrt((trace**2 - 4.0 * determinant).astype(np.complex128))
    larger = 0.5 * (trace + np.where(trace < 0.0, -root, root))  # without cancellation
    smaller = np.divide(determinant, larger, out=np.zeros_like(larger), where=larger != 0.0)
    return _by_growth(np.stack([larger, smaller], axis=-1))


def _by_growth(eigenvalues: NDArray[Any]) -> NDArray[np.complex128]:
    order = np.argsort(-eigenvalues.real, axis=-1, kind="stable")
    return np.take_along_axis(eigenvalues.astype(np.complex128), order, axis=-1)


def fast_pole(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: ArrayLike,
    axle_load: ArrayLike | None = None,
    friction_scale: ArrayLike = 1.0,
) -> FloatArray:
    """Real part of the eigenvalue of the creepage at operating points [1/s].

    Arguments as for `poles`. For a held speed it is the only eigenvalue; for a free wheelset the
    unstable one or, if both are stable, the one farther from zero. `approximate_pole` is close.
    Of a contact with memory it is the growth of a slip-away, see `Wheelset.jacobians`; the
    eigenvalue of the held force counts if it decays more slowly.
    """
    both = _eigenvalues(wheelset, creepage, speed, axle_load, friction_scale, away=True).real
    first, own = both[..., 0], both[..., 0 if wheelset.speed_held else 1]
    return np.asarray(np.where(first > 0.0, first, own))


def worst_pole(
    wheelset: Wheelset, at: Conditions | None = None, **given: Unpack[GivenConditions]
) -> WorstPole:
    """Largest `fast_pole` over the creepages of traction: `CreepCurve.worst_pole`."""
    return CreepCurve(wheelset, at, **given).worst_pole


def reduced_frequency(
    wheelset: Wheelset,
    rate: ArrayLike,
    at: Conditions | None = None,
    **given: Unpack[GivenConditions],
) -> FloatArray:
    """Rate of a change times the time in which the wheel rolls a semi-width, |rate| a/V [1].

    Poles, linearised systems, gains, delays, clearing times and simulations contain the memory of a
    contact. Slip-away times, the basin and the range of limit cycles take rolling as steady: up to
    0.5 the errors of slip-away times and limit cycles are below about 5 %.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset, whose contact has the semi-width a at the load.
    rate : array_like
        Growth rate, such as the pole of `worst_pole`, or angular frequency, such as
        `Drivetrain.torsional_frequency` [1/s].
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.

    Raises
    ------
    ValueError
        If a value is out of range.

    Notes
    -----
    A contact follows a change of its creepage over a length L of rolling, so that a rate has the
    relative error |rate| L/V in the first order. L is about 2 a, a being the semi-width, where the
    contact sticks; where it slides, it is the distance Delta/zeta over which friction weakens. The
    guide's page on memory tabulates the changes by memory for models/locomotive.toml. With
    k_hat = 0.85 instead of 0.3 memory changes the steepest pole at 0.5 by 5 % instead of 1 %. The
    decay at a creepage near zero changes by about 1.5 times its own |p| a/V, and beyond 0.2 the
    wheel oscillates on its contact.

    Examples
    --------
    >>> import contactlib as cl
    >>> wheelset = cl.load_model("locomotive.toml").wheelset
    >>> for speed in (10.0, 1.0):
    ...     pole = cl.worst_pole(wheelset, speed=speed).pole
    ...     print(f"{reduced_frequency(wheelset, pole, speed=speed):.2g}")
    0.051
    5.1
    """
    at = wheelset.conditions(at, **given)
    p = wheelset.element.parameters
    growth = (at.axle_load / p["nominal_load"]) ** p["load_exponent"]
    return np.asarray(np.abs(checked("rate", rate, MODERATE)) * p["semi_width"] * growth / at.speed)


class SteadyRollingWarning(RangeWarning):
    """An analysis takes rolling as steady, although the contact has memory."""


def steady_rolling(wheelset: Wheelset, name: str, at: Conditions) -> Wheelset:
    """Return the wheelset without memory, for an analysis that takes rolling as steady.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    name : str
        Name of the analysis, for the warning.
    at : Conditions
        Its conditions.

    Warns
    -----
    SteadyRollingWarning
        If the contact has memory; with the reduced frequency of the largest pole.
    """
    if not wheelset.element.memory:
        return wheelset
    steady = wheelset.without_memory()
    frequency = float(reduced_frequency(steady, worst_pole(steady, at).pole, at))
    warnings.warn(
        f"{name} takes rolling as steady, although the contact has memory: at {at.speed:g} m/s "
        f"the largest pole has the reduced frequency p a/V = {frequency:.2g}; above "
        f"{STEADY_ROLLING:g} errors exceed 5 %, and simulate or run_scenario contain the memory",
        SteadyRollingWarning,
        stacklevel=3,
    )
    return steady
