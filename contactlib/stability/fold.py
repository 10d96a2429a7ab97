"""Steady states over the torque: how far it can rise, and how far it must fall again."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from contactlib.stability.quasi_steady import (
    creepage_grid,
    quasi_steady_slope,
    quasi_steady_torque,
    turning_points,
)
from contactlib.wheelset import CONTACT, Wheelset, checked_conditions


class Fold(NamedTuple):
    """Where a slow torque ramp loses the stable branch, and where it finds it again.

    Attributes
    ----------
    creepage, drive_torque : float
        The fold [1, N.m]: no operating point stands above this torque but far out in the tail.
        On a plateau its beginning.
    return_creepage, return_torque : float
        The end of the run-away branch on the way down [1, N.m]; the creepage is infinite where
        the torque falls to its limit without a minimum.
    """

    creepage: float
    drive_torque: float
    return_creepage: float
    return_torque: float

    @property
    def hysteresis(self) -> float:
        """Torque drop needed to come back, over the critical torque [1]."""
        return 1.0 - self.return_torque / self.drive_torque


def find_fold(
    wheelset: Wheelset,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> Fold:
    """Fold of the (creepage, torque) curve in traction, at one speed.

    Raises
    ------
    ValueError
        If the torque has no maximum: the law does not fall, or damping outweighs its fall.
    """
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    contact = {name: inputs[name] for name in CONTACT}

    def torque(zeta: float) -> float:
        return float(quasi_steady_torque(wheelset, zeta, **inputs))

    def slope(zeta: Any) -> Any:
        return quasi_steady_slope(wheelset, zeta, **inputs)

    grid = creepage_grid(wheelset, **contact)
    slopes = slope(grid)
    falling = np.flatnonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))
    if falling.size == 0:
        raise ValueError(
            f"speed = {inputs['speed']!r}, normal_load = {inputs['normal_load']!r}, "
            f"friction_scale = {inputs['friction_scale']!r}, damping = {wheelset.damping!r}: the "
            "torque has no maximum over creepage, so there is no fold"
        )

    def root(i: int) -> float:
        return float(turning_points(slope, grid[i : i + 2])[0])

    i = int(falling[0])
    plateau = slopes[i + 1] == 0.0  # the force is held at static friction
    fold = _end_of_rise(slope, float(grid[i]), float(grid[i + 1])) if plateau else root(i)
    highest = torque(fold)
    # The run-away ends where the torque is as high again; on the way down it stays on that branch.
    torques = quasi_steady_torque(wheelset, grid, **inputs)
    higher = np.flatnonzero((grid > fold) & (slopes > 0.0) & (torques > highest))
    landing = int(higher[0]) if higher.size else grid.size - 1
    rising = np.flatnonzero((slopes[:landing] < 0.0) & (slopes[1 : landing + 1] > 0.0))
    back = root(int(rising[-1])) if rising.size and slopes[landing] > 0.0 else math.inf
    return Fold(fold, highest, back, torque(back if math.isfinite(back) else grid[-1]))


def _end_of_rise(slope: Callable[[float], float], rising: float, level: float) -> float:
    """Where a slope above zero ends at once, as at a plateau's beginning [1]."""
    while rising < (middle := 0.5 * (rising + level)) < level:
        rising, level = (middle, level) if slope(middle) > 0.0 else (rising, middle)
    return level
