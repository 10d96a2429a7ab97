"""The S-curve: creepage over drive torque at one speed, with what a constant torque can hold."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from contactlib.parameters import FINITE, FloatArray, checked
from contactlib.stability.fold import Fold, find_fold
from contactlib.stability.quasi_steady import (
    creepage_grid,
    creepage_pole,
    quasi_steady_slope,
    quasi_steady_torque,
    turning_points,
)
from contactlib.wheelset import CONTACT, Wheelset, checked_conditions, checked_torque


@dataclass(frozen=True, kw_only=True)
class SteadyStates:
    """Quasi-steady states at one speed, by rising creepage.

    Attributes
    ----------
    creepage, drive_torque, pole : ndarray, shape (n,)
        States [1], the torque that keeps each [N.m], and the rate at which a small change of the
        creepage grows there, `creepage_pole` [1/s].
    stable : ndarray of bool, shape (n,)
        Where the pole is negative: a constant torque holds the creepage.
    """

    creepage: FloatArray
    drive_torque: FloatArray
    pole: FloatArray
    stable: NDArray[np.bool_]

    @classmethod
    def at(cls, wheelset: Wheelset, creepage: ArrayLike, **inputs: Any) -> Self:
        """States at rising creepages, with the inputs of `quasi_steady_torque`."""
        zeta = checked("creepage", creepage, FINITE)
        pole = creepage_pole(wheelset, zeta, **inputs)
        torque = quasi_steady_torque(wheelset, zeta, **inputs)
        return cls(creepage=zeta, drive_torque=torque, pole=pole, stable=pole < 0.0)


@dataclass(frozen=True, kw_only=True)
class SCurve(SteadyStates):
    """Quasi-steady states along a curve.

    Attributes
    ----------
    fold : Fold, optional
        Where the stable branch ends and where it is found again, in traction; None if the torque
        never falls with creepage.
    """

    fold: Fold | None = None


def s_curve(
    wheelset: Wheelset,
    *,
    speed: float,
    creepage: ArrayLike | None = None,
    braking: bool = False,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> SCurve:
    """Torque, pole and stability over creepage at one speed.

    Parameters
    ----------
    wheelset : Wheelset
        On rails, whose speed may be changing meanwhile, or on a roller rig.
    speed : float
        [m/s].
    creepage : array_like, optional
        Where [1]. Left out, from zero through the fold and along the return branch until the
        torque is as high again as at the fold, with fold and return among the points; a hundred
        times the saturation creepage if there is no return branch.
    braking : bool, optional
        Whether the creepages left out above are followed on the braking side too, to the locked
        wheel.
    normal_load, friction_scale, resistance_force : float, optional
        Further inputs [N, 1, N].

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    contact = {name: inputs[name] for name in CONTACT}
    try:
        fold = find_fold(wheelset, **inputs)
    except ValueError:
        fold = None
    if creepage is None:
        zeta = _whole_branch(wheelset, fold, contact, inputs)
        if braking:
            zeta = np.unique(np.concatenate([np.maximum(-zeta, -1.0), zeta]))
    else:
        zeta = np.sort(checked("creepage", creepage, FINITE), axis=None)
    return replace(SCurve.at(wheelset, zeta, **inputs), fold=fold)


def _whole_branch(
    wheelset: Wheelset, fold: Fold | None, contact: dict[str, Any], inputs: dict[str, Any]
) -> FloatArray:
    """Creepages from zero to where the torque of the fold is met again."""
    scale = wheelset.element.saturation_creepage_at(
        normal_load=contact["normal_load"], friction_scale=contact["friction_scale"]
    )
    end, marks = 100.0 * scale, np.array([])
    if fold is not None and math.isfinite(fold.return_creepage):
        grid = creepage_grid(wheelset, **contact)
        torque = quasi_steady_torque(wheelset, grid, **inputs)
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
    *,
    drive_torque: float,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> SteadyStates:
    """All states in which one torque keeps the creepage at one speed, on all branches.

    For a held speed they are the operating points of `Wheelset.equilibria`. A free wheelset may
    be gaining or losing speed in them, as it does in a train that is not yet at its final speed.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    wanted = checked_torque(drive_torque)
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    contact = {name: inputs[name] for name in CONTACT}

    def excess(zeta: ArrayLike) -> FloatArray:
        return quasi_steady_torque(wheelset, zeta, **inputs) - wanted

    positive = creepage_grid(wheelset, **contact)
    grid = np.concatenate([-positive[::-1], [0.0], positive])
    grid = np.union1d(
        grid, turning_points(lambda zeta: quasi_steady_slope(wheelset, zeta, **inputs), grid)
    )
    values = excess(grid)
    found = grid[values == 0.0].tolist()
    for i in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        ends = grid[i], grid[i + 1]
        found.append(brentq(lambda z: float(excess(z)), *ends, xtol=1e-16, rtol=1e-14))
    return SteadyStates.at(wheelset, np.array(sorted(found)), **inputs)
