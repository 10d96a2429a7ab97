"""Steady states over the torque: how far it can rise, and how far it must fall again."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from contactlib.parameters import FloatArray
from contactlib.wheelset import Wheelset


def quasi_steady_torque(
    wheelset: Wheelset,
    creepage: ArrayLike,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> FloatArray:
    """Drive torque that keeps a creepage unchanged while the vehicle accelerates [N.m].

    T = r Q + b omega + (J/r)(1 + zeta) dV/dt. The last term turns the wheelset along with the
    vehicle; it vanishes if the speed is held.
    """
    zeta = np.asarray(creepage, dtype=np.float64)
    record = wheelset.element.at_creepage(
        zeta, speed=speed, normal_load=normal_load, friction_scale=friction_scale
    )
    r, force = wheelset.radius, record["creep_force"]
    acceleration = _acceleration(wheelset, force, speed, resistance_force)
    turning = wheelset.inertia / r * (1.0 + zeta) * acceleration
    return np.asarray(r * force + wheelset.damping * (1.0 + zeta) * speed / r + turning)


def _acceleration(
    wheelset: Wheelset, creep_force: FloatArray, speed: float, resistance_force: float
) -> FloatArray:
    """dV/dt under a creep force [m/s2]: zero if the speed is held."""
    if wheelset.mass is None:
        return np.zeros_like(creep_force)
    load = wheelset.element.contact.normal_load
    omega = speed / wheelset.radius  # rolling without creepage, hence without creep force
    coasting, _ = wheelset.rates(omega, speed, 0.0, load, 1.0, resistance_force)
    return np.asarray(creep_force / wheelset.mass + coasting.speed_rate)


class Fold(NamedTuple):
    """Where a slow torque ramp loses the stable branch, and where it finds it again.

    Attributes
    ----------
    creepage, drive_torque : float
        The fold [1, N.m]: no operating point stands above this torque but far out in the tail.
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
    inputs: dict[str, Any] = {
        "speed": speed,
        "normal_load": normal_load,
        "friction_scale": friction_scale,
    }
    r, inertia, damping = wheelset.radius, wheelset.inertia, wheelset.damping

    def torque(zeta: float) -> float:
        found = quasi_steady_torque(wheelset, zeta, resistance_force=resistance_force, **inputs)
        return float(found)

    def torque_slope(zeta: ArrayLike) -> FloatArray:
        """Derivative of `quasi_steady_torque` to the creepage."""
        record = wheelset.element.at_creepage(zeta, **inputs)
        fall = record["force_gradient"] * speed  # dQ/dzeta
        slope = r * fall + damping * speed / r
        if wheelset.mass is not None:
            force = record["creep_force"]
            acceleration = _acceleration(wheelset, force, speed, resistance_force)
            stretch = 1.0 + np.asarray(zeta)
            slope = slope + inertia / r * (acceleration + stretch * fall / wheelset.mass)
        return np.asarray(slope)

    scale = wheelset.element.saturation_creepage_at(
        normal_load=normal_load, friction_scale=friction_scale
    )
    # Where friction falls with slip speed, the peak may be at as little as its residual's zeta0,
    # and the tail is as long as the fall.
    friction = wheelset.element.friction
    fall = friction.slip_rate_decay * speed * scale  # over one zeta0
    first, last = 0.01 * friction.slip_rate_residual, max(1e5, 40.0 / fall if fall > 0.0 else 0.0)
    grid = scale * np.geomspace(first, last, round(571.0 * math.log10(last / first)) + 4)
    slopes = torque_slope(grid)
    falling = np.flatnonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))
    if falling.size == 0:
        raise ValueError(
            f"speed = {speed!r}, damping = {wheelset.damping!r}: the torque has no maximum over "
            "creepage, so there is no fold"
        )

    def root(i: int) -> float:
        return float(
            brentq(lambda z: float(torque_slope(z)), grid[i], grid[i + 1], xtol=1e-16, rtol=1e-14)
        )

    fold = root(int(falling[0]))
    highest = torque(fold)
    # The run-away ends where the torque is as high again; on the way down it stays on that branch.
    torques = quasi_steady_torque(wheelset, grid, resistance_force=resistance_force, **inputs)
    higher = np.flatnonzero((grid > fold) & (slopes > 0.0) & (torques > highest))
    landing = int(higher[0]) if higher.size else grid.size - 1
    rising = np.flatnonzero((slopes[:landing] < 0.0) & (slopes[1 : landing + 1] > 0.0))
    back = root(int(rising[-1])) if rising.size and slopes[landing] > 0.0 else math.inf
    return Fold(fold, highest, back, torque(back if math.isfinite(back) else grid[-1]))
