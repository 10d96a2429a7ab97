"""S-curve: creepage over drive torque at one speed, its fold, and its stable states."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FINITE, FloatArray, checked
from contactlib.vehicle.conditions import Conditions, GivenConditions
from contactlib.vehicle.creep_curve import CreepCurve, Fold, SteadyStates
from contactlib.vehicle.wheelset import Wheelset

BEYOND = 1.005  # last creepage / that at which the torque of the fold is reached again


def quasi_steady_torque(
    wheelset: Wheelset,
    creepage: ArrayLike,
    at: Conditions | None = None,
    **given: Unpack[GivenConditions],
) -> FloatArray:
    """Drive torque that keeps creepages [1] unchanged: `CreepCurve.torque` [N.m]."""
    return CreepCurve(wheelset, at, **given).torque(creepage)


def find_fold(
    wheelset: Wheelset, at: Conditions | None = None, **given: Unpack[GivenConditions]
) -> Fold:
    """Fold of the torque over creepage at one speed: `CreepCurve.fold`."""
    return CreepCurve(wheelset, at, **given).fold


def steady_states(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    both_sides: bool = False,
    **given: Unpack[GivenConditions],
) -> SteadyStates:
    """States in which a torque holds the creepage at one speed, from the gripping one outward.

    Between return and fold these are the gripping state, the border of its basin, and the wheel
    that has slipped away. The speed of a free wheelset may be changing, as in a train that is not
    at its final speed.

    Parameters
    ----------
    wheelset : Wheelset
        Wheelset on rails, whose speed may be changing, or on a roller rig.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.
    drive_torque : float
        Torque T [N.m]. If it is not negative, the states are those of traction, in order of
        increasing creepage; else those of braking, in order of decreasing creepage.
    both_sides : bool, optional
        Whether to return all states of `CreepCurve.steady`, in order of increasing creepage, with
        those in which the wheel spins against its torque, as beside a vehicle that the creep force
        decelerates. For a held speed they are the operating points of `Wheelset.equilibria`.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    curve = CreepCurve(wheelset, at, **given)
    states = curve.steady(drive_torque)
    if both_sides:
        return states
    side = -1.0 if drive_torque < 0.0 else 1.0
    try:
        grip = curve.grip(drive_torque)  # of a small torque it lies on the other side of zero
    except ValueError:  # the torque is above the peak
        grip = 0.0
    ahead = side * states.creepage >= min(0.0, side * grip)
    order = np.flatnonzero(ahead)[:: int(side)]
    return SteadyStates(**{name: values[order] for name, values in vars(states).items()})


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
    curve = CreepCurve(wheelset, at, **given)
    try:
        fold = curve.fold
    except ValueError:
        fold = None
    if creepage is None:
        zeta = _whole_branch(curve, fold)
        if braking:
            zeta = np.unique(np.concatenate([np.maximum(-zeta, -1.0), zeta]))
    else:
        zeta = np.sort(checked("creepage", creepage, FINITE), axis=None)
    return SCurve(**vars(curve.states(zeta)), fold=fold)


def _whole_branch(curve: CreepCurve, fold: Fold | None) -> FloatArray:
    """Creepages from zero to the point at which the torque of the fold is reached again."""
    scale = curve.wheelset.element.saturation_creepage_at(
        axle_load=curve.at.axle_load, friction_scale=curve.at.friction_scale
    )
    end, marks = 100.0 * scale, np.array([])
    if fold is not None and math.isfinite(fold.return_creepage):
        again = curve.steady(fold.drive_torque).creepage
        again = again[again > fold.return_creepage]
        end = BEYOND * again[0] if again.size else max(end, 10.0 * fold.return_creepage)
        marks = np.array([fold.creepage, fold.return_creepage])
    elif fold is not None:
        marks, end = np.array([fold.creepage]), max(end, 10.0 * fold.creepage)
    far = 3.0 * max(scale, fold.creepage if fold is not None else 0.0)
    parts = [np.linspace(0.0, far, 601), np.geomspace(far, max(end, 2.0 * far), 400), marks]
    return np.unique(np.concatenate(parts))
