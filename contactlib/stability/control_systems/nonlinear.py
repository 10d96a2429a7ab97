"""Nonlinear wheelsets as systems of python-control, and their operating points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    checked_number,
)
from contactlib.stability import find_fold
from contactlib.stability.poles import steady_rolling
from contactlib.vehicle.conditions import Conditions, GivenConditions, GivenInputs, OperatingPoint
from contactlib.vehicle.continuous_control import CreepControl
from contactlib.vehicle.wheelset import Wheelset, checked_torque

if TYPE_CHECKING:
    from control import NonlinearIOSystem

BALANCED = 1e-6  # largest residual torque at an operating point / largest torque


def creep_control_system(
    wheelset: Wheelset, controller: CreepControl, *, speed: float | None = None
) -> NonlinearIOSystem:
    """Closed loop of wheelset and continuous creep controller, both nonlinear.

    Inputs are ``creepage_reference``, ``axle_load``, ``friction_scale`` and
    ``resistance_force``, outputs ``omega``, ``speed``, ``creepage``, ``creep_force`` and
    ``drive_torque``, states those of the wheelset and the controller's integral torque.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    controller : CreepControl
        Gains and limits; its reference is not used, as the reference is an input.
    speed : float, optional
        As in `Wheelset.to_nlsys` [m/s].
    """
    control = optional_library("control")

    law = controller.native

    def update(_: float, x: FloatArray, u: FloatArray, __: Mapping[str, Any]) -> list[float]:
        return [law.command(u[0], u[1], x[0]).integral_rate]

    def output(_: float, x: FloatArray, u: FloatArray, __: Mapping[str, Any]) -> list[float]:
        return [law.command(u[0], u[1], x[0]).torque]

    rule = control.nlsys(
        update,
        output,
        name="creep_control",
        states=["integral_torque"],
        inputs=["creepage_reference", "creepage"],
        outputs=["drive_torque"],
    )
    return control.interconnect(
        [wheelset.to_nlsys(speed=speed), rule],
        inputs=["creepage_reference", "axle_load", "friction_scale", "resistance_force"],
        outputs=["omega", "speed", "creepage", "creep_force", "drive_torque"],
    )


def phase_plane_system(
    wheelset: Wheelset, *, drive_torque: float, **given: Unpack[GivenInputs]
) -> NonlinearIOSystem:
    """A free wheelset at constant inputs, with the states ``creepage`` and ``speed``.

    These states suit `control.phase_plane_plot`: in (omega, speed) all motions except slip-away
    stay within a few hundredths of omega = speed/radius.

    Raises
    ------
    ValueError
        If the speed is held, so that there is no phase plane, or an input is out of range.
    """
    control = optional_library("control")

    if wheelset.speed_held:
        raise ValueError("the speed of this wheelset is held: it has one state, and no phase plane")
    at = wheelset.conditions(speed=wheelset.element.minimum_speed, **given)
    torque = checked_torque(drive_torque)
    inputs = np.array([torque, at.axle_load, at.friction_scale, at.resistance_force])
    wheelset = steady_rolling(wheelset, "phase_plane_system", at)
    system, radius = wheelset.to_nlsys(), wheelset.radius

    def update(t: float, x: FloatArray, _: Any, __: Mapping[str, Any]) -> FloatArray:
        creepage, speed = x
        omega = (1.0 + creepage) * speed / radius
        omega_rate, speed_rate = system.dynamics(t, [omega, speed], inputs)
        creepage_rate = (radius * omega_rate - (1.0 + creepage) * speed_rate) / speed
        return np.array([creepage_rate, speed_rate])

    return control.nlsys(update, None, inputs=0, states=["creepage", "speed"], name="wheelset")


def operating_point(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    creepage: float,
    **given: Unpack[GivenConditions],
) -> OperatingPoint:
    """Operating point near a guess, from `control.find_operating_point` and checked.

    Beyond the fold, where none exists, that function may return the state closest to one.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset; for a free one the outer resistance is chosen such that it keeps `speed`.
    drive_torque : float
        Constant torque [N.m].
    creepage : float
        Guess on the branch to find [1].
    at, **given
        Conditions, as for `Wheelset.conditions`.

    Raises
    ------
    ValueError
        If no point is found; the message names the torque and the fold's.
    """
    control = optional_library("control")

    held = replace(wheelset.without_memory(), mass=None)  # which changes no steady state
    at = wheelset.conditions(at, **given)
    omega = (1.0 + checked_number("creepage", creepage, FINITE)) * at.speed / wheelset.radius
    operating = control.find_operating_point(
        held.to_nlsys(speed=at.speed),
        [omega],
        [checked_torque(drive_torque), at.axle_load, at.friction_scale, 0.0],
        return_result=True,
        root_kwargs={"tol": 1e-12},
    )
    left = wheelset.inertia * float(np.max(np.abs(operating.result.fun)))  # [N.m]
    friction = wheelset.element.friction.static * at.friction_scale
    largest = wheelset.radius * friction * at.axle_load
    if not operating.result.success or left > BALANCED * largest:
        raise ValueError(
            f"drive_torque = {drive_torque!r}: no operating point near creepage = {creepage!r} "
            f"(the torques differ by {left:.3g} N.m); {_fold(held, at)}"
        )
    return wheelset.balanced(at, creepage=float(operating.outputs[2]))


def _fold(held: Wheelset, at: Conditions) -> str:
    try:
        fold = find_fold(held, at)
    except ValueError:
        return "its torque has no fold"
    return f"the fold is at {fold.drive_torque:.6g} N.m, creepage {fold.creepage:.6g}"
