"""S-curve: creepage over drive torque at one speed, its fold, and its stable states."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from contactlib.base.quantities import FINITE, FloatArray, checked
from contactlib.stability.quasi_steady import (
    creepage_grid,
    creepage_pole,
    quasi_steady_slope,
    quasi_steady_torque,
    turning_points,
)
from contactlib.vehicle.conditions import Conditions, GivenConditions
from contactlib.vehicle.wheelset import Wheelset, checked_torque


class Fold(NamedTuple):
    """Points at which a slow torque ramp leaves the stable branch and returns to it.

    Attributes
    ----------
    creepage, drive_torque : float
        The fold [1, N.m]: above this torque there are operating points only far out in the tail.
        On a plateau, its beginning.
    return_creepage, return_torque : float
        End of the run-away branch under a falling torque [1, N.m]; the creepage is infinite where
        the torque falls to its limit without a minimum. A limit below 0 counts as 0: no torque that
        drives brings the wheel back.
    """

    creepage: float
    drive_torque: float
    return_creepage: float
    return_torque: float

    @property
    def hysteresis(self) -> float:
        """Torque drop needed to return / critical torque [1]."""
        return 1.0 - self.return_torque / self.drive_torque


def find_fold(
    wheelset: Wheelset, at: Conditions | None = None, **given: Unpack[GivenConditions]
) -> Fold:
    """Fold of the (creepage, torque) curve in traction, at one speed.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.

    Raises
    ------
    ValueError
        If the torque has no maximum: the law does not fall, or damping outweighs its fall.
    """
    at = wheelset.conditions(at, **given)

    def torque(zeta: float) -> float:
        return float(quasi_steady_torque(wheelset, zeta, at))

    def slope(zeta: Any) -> Any:
        return quasi_steady_slope(wheelset, zeta, at)

    grid = creepage_grid(wheelset, at)
    slopes = slope(grid)
    falling = np.flatnonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))
    if falling.size == 0:
        friction = wheelset.element.friction
        level = friction.ratio == 1.0 and not friction.falls_with_slip_speed
        raise ValueError(
            f"speed = {at.speed!r}, normal_load = {at.normal_load!r}, "
            f"friction_scale = {at.friction_scale!r}, damping = {wheelset.damping!r}: the "
            "torque has no maximum over creepage, so there is no fold"
            f"{f'; friction does not fall, as static = kinetic = {friction.kinetic!r}' * level}"
        )

    def root(i: int) -> float:
        return float(turning_points(slope, grid[i : i + 2])[0])

    i = int(falling[0])
    plateau = slopes[i + 1] == 0.0  # the force is held at static friction
    fold = _end_of_rise(slope, float(grid[i]), float(grid[i + 1])) if plateau else root(i)
    highest = torque(fold)
    # The run-away ends where the torque reaches the fold's again; a falling torque then follows
    # this branch to its minimum.
    torques = quasi_steady_torque(wheelset, grid, at)
    higher = np.flatnonzero((grid > fold) & (slopes > 0.0) & (torques > highest))
    landing = int(higher[0]) if higher.size else grid.size - 1
    rising = np.flatnonzero((slopes[:landing] < 0.0) & (slopes[1 : landing + 1] > 0.0))
    back = root(int(rising[-1])) if rising.size and slopes[landing] > 0.0 else math.inf
    returns = torque(back) if math.isfinite(back) else max(0.0, torque(grid[-1]))
    return Fold(fold, highest, back, returns)


def _end_of_rise(slope: Callable[[float], float], rising: float, level: float) -> float:
    """Creepage at which a positive slope drops to zero, as at the beginning of a plateau [1]."""
    while rising < (middle := 0.5 * (rising + level)) < level:
        rising, level = (middle, level) if slope(middle) > 0.0 else (rising, middle)
    return level


@dataclass(frozen=True, kw_only=True)
class SteadyStates:
    """Quasi-steady states at one speed, by rising creepage.

    Attributes
    ----------
    creepage, drive_torque, pole : ndarray, shape (n,)
        Creepages [1], the torque that holds each [N.m], and the growth rate of a small deviation,
        `creepage_pole` [1/s].
    stable : ndarray of bool, shape (n,)
        Whether the pole is negative, so that a constant torque holds the creepage.
    """

    creepage: FloatArray
    drive_torque: FloatArray
    pole: FloatArray
    stable: NDArray[np.bool_]

    @classmethod
    def at(
        cls,
        wheelset: Wheelset,
        creepage: ArrayLike,
        at: Conditions | None = None,
        **given: Unpack[GivenConditions],
    ) -> Self:
        """States at rising creepages."""
        zeta, at = checked("creepage", creepage, FINITE), wheelset.conditions(at, **given)
        pole = creepage_pole(wheelset, zeta, at)
        torque = quasi_steady_torque(wheelset, zeta, at)
        return cls(creepage=zeta, drive_torque=torque, pole=pole, stable=pole < 0.0)


@dataclass(frozen=True, kw_only=True)
class SCurve(SteadyStates):
    """Quasi-steady states along a curve.

    Attributes
    ----------
    fold : Fold, optional
        Fold in traction; None if the torque never falls with creepage.
    """

    fold: Fold | None = None


def s_curve(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    creepage: ArrayLike | None = None,
    braking: bool = False,
    **given: Unpack[GivenConditions],
) -> SCurve:
    """Torque, pole and stability over creepage at one speed.

    Parameters
    ----------
    wheelset : Wheelset
        Wheelset on rails, whose speed may be changing, or on a roller rig.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    creepage : array_like, optional
        Creepages [1]. Default: from zero through the fold and along the return branch until the
        torque is that of the fold again, with fold and return among the points; to a hundred
        times the saturation creepage if there is no return branch.
    braking : bool, optional
        Whether the default creepages include the braking side, to the locked wheel.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    at = wheelset.conditions(at, **given)
    try:
        fold = find_fold(wheelset, at)
    except ValueError:
        fold = None
    if creepage is None:
        zeta = _whole_branch(wheelset, fold, at)
        if braking:
            zeta = np.unique(np.concatenate([np.maximum(-zeta, -1.0), zeta]))
    else:
        zeta = np.sort(checked("creepage", creepage, FINITE), axis=None)
    return replace(SCurve.at(wheelset, zeta, at), fold=fold)


def _whole_branch(wheelset: Wheelset, fold: Fold | None, at: Conditions) -> FloatArray:
    """Creepages from zero to the point at which the torque of the fold is reached again."""
    scale = wheelset.element.saturation_creepage_at(
        normal_load=at.normal_load, friction_scale=at.friction_scale
    )
    end, marks = 100.0 * scale, np.array([])
    if fold is not None and math.isfinite(fold.return_creepage):
        grid = creepage_grid(wheelset, at)
        torque = quasi_steady_torque(wheelset, grid, at)
        again = grid[(grid > fold.return_creepage) & (torque > fold.drive_torque)]
        end = again[0] if again.size else max(end, 10.0 * fold.return_creepage)
        marks = np.array([fold.creepage, fold.return_creepage])
    elif fold is not None:
        marks, end = np.array([fold.creepage]), max(end, 10.0 * fold.creepage)
    far = 3.0 * max(scale, fold.creepage if fold is not None else 0.0)
    parts = [np.linspace(0.0, far, 601), np.geomspace(far, max(end, 2.0 * far), 400), marks]
    return np.unique(np.concatenate(parts))


def steady_states(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    **given: Unpack[GivenConditions],
) -> SteadyStates:
    """All states, on all branches, in which a torque holds the creepage at one speed.

    For a held speed they are the operating points of `Wheelset.equilibria`. The speed of a free
    wheelset may be changing, as in a train that is not at its final speed.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    drive_torque : float
        Constant torque [N.m].

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    wanted = checked_torque(drive_torque)
    at = wheelset.conditions(at, **given)

    def excess(zeta: ArrayLike) -> FloatArray:
        return quasi_steady_torque(wheelset, zeta, at) - wanted

    positive = creepage_grid(wheelset, at)
    grid = np.concatenate([-positive[::-1], [0.0], positive])
    grid = np.union1d(
        grid, turning_points(lambda zeta: quasi_steady_slope(wheelset, zeta, at), grid)
    )
    values = excess(grid)
    found = grid[values == 0.0].tolist()
    for i in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        ends = grid[i], grid[i + 1]
        found.append(brentq(lambda z: float(excess(z)), *ends, xtol=1e-16, rtol=1e-14))
    return SteadyStates.at(wheelset, np.array(sorted(found)), at)
