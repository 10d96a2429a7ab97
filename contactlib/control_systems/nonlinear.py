"""The nonlinear loop as systems of python-control, and what is found of it by its solvers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlib.controllers import CreepControl
from contactlib.parameters import FloatArray
from contactlib.stability import find_fold
from contactlib.wheelset import OperatingPoint, Wheelset, checked_conditions, checked_torque

if TYPE_CHECKING:
    from control import NonlinearIOSystem

BALANCED = 1e-6  # what may be left of the torque at an operating point, over the largest torque


def creep_control_system(
    wheelset: Wheelset, controller: CreepControl, *, speed: float | None = None
) -> NonlinearIOSystem:
    """Wheelset and creep controller in a loop, both nonlinear.

    Inputs ``creepage_reference``, ``normal_load``, ``friction_scale``, ``resistance_force``;
    outputs ``omega``, ``speed``, ``creepage``, ``creep_force``, ``drive_torque``; states those of
    the wheelset, then the controller's memory.

    Parameters
    ----------
    wheelset : Wheelset
        What moves.
    controller : CreepControl
        Gains and limits; its own reference is not used, as the reference is an input here.
    speed : float, optional
        As in `Wheelset.to_nlsys` [m/s].
    """
    import control

    def update(_: float, x: FloatArray, u: FloatArray, __: Mapping[str, Any]) -> list[float]:
        return [controller.command(u[0], u[1], x[0]).memory_rate]

    def output(_: float, x: FloatArray, u: FloatArray, __: Mapping[str, Any]) -> list[float]:
        return [controller.command(u[0], u[1], x[0]).torque]

    rule = control.nlsys(
        update,
        output,
        name="creep_control",
        states=["memory"],
        inputs=["creepage_reference", "creepage"],
        outputs=["drive_torque"],
    )
    return control.interconnect(
        [wheelset.to_nlsys(speed=speed), rule],
        inputs=["creepage_reference", "normal_load", "friction_scale", "resistance_force"],
        outputs=["omega", "speed", "creepage", "creep_force", "drive_torque"],
    )


def phase_plane_system(
    wheelset: Wheelset,
    *,
    drive_torque: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> NonlinearIOSystem:
    """A free wheelset at constant inputs, in the states ``creepage`` and ``speed``.

    That is the plane for `control.phase_plane_plot`: in (omega, speed) everything but the run-away
    happens in a strip along omega = speed/radius as narrow as a few hundredths.

    Raises
    ------
    ValueError
        If the speed is held, so that there is no plane, or an input is out of range.
    """
    import control

    if wheelset.speed_held:
        raise ValueError("the speed of this wheelset is held: it has one state, and no phase plane")
    given = checked_conditions(
        wheelset,
        speed=wheelset.element.minimum_speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    system, radius = wheelset.to_nlsys(), wheelset.radius
    inputs = np.array([checked_torque(drive_torque), *list(given.values())[1:]])

    def update(t: float, x: FloatArray, _: Any, __: Mapping[str, Any]) -> FloatArray:
        creepage, speed = x
        omega = (1.0 + creepage) * speed / radius
        omega_rate, speed_rate = system.dynamics(t, [omega, speed], inputs)
        creepage_rate = (radius * omega_rate - (1.0 + creepage) * speed_rate) / speed
        return np.array([creepage_rate, speed_rate])

    return control.nlsys(update, None, inputs=0, states=["creepage", "speed"], name="wheelset")


def operating_point(
    wheelset: Wheelset,
    *,
    drive_torque: float,
    creepage: float,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
) -> OperatingPoint:
    """The operating point near a guess by `control.find_operating_point`, checked to be one.

    Beyond the fold that function finds no point, and returns None, or what is least far from one
    if it is asked for its result or to use least squares.

    Parameters
    ----------
    wheelset : Wheelset
        What moves; at a free one the outer resistance is found that keeps `speed`.
    drive_torque : float
        [N.m].
    creepage : float
        Guess, on the wanted branch [1].
    speed : float
        Forward speed [m/s].
    normal_load, friction_scale : float, optional
        Further inputs [N, 1].

    Raises
    ------
    ValueError
        If no point is found; the message names the torque and the fold's.
    """
    import control

    held = replace(wheelset, mass=None)
    guess = wheelset.balanced(
        creepage=creepage, speed=speed, normal_load=normal_load, friction_scale=friction_scale
    )
    given = [checked_torque(drive_torque), guess.normal_load]
    found = control.find_operating_point(
        held.to_nlsys(speed=guess.speed),
        [guess.omega],
        [*given, guess.friction_scale, 0.0],
        return_result=True,
        root_kwargs={"tol": 1e-12},
    )
    left = wheelset.inertia * float(np.max(np.abs(found.result.fun)))  # [N.m]
    largest = (
        wheelset.radius
        * wheelset.element.friction.static
        * guess.normal_load
        * guess.friction_scale
    )
    if not found.result.success or left > BALANCED * largest:
        raise ValueError(
            f"drive_torque = {drive_torque!r}: no operating point near creepage = {creepage!r} "
            f"(the torques differ by {left:.3g} N.m); {_fold(held, guess)}"
        )
    return wheelset.balanced(
        creepage=float(found.outputs[2]),
        speed=guess.speed,
        normal_load=guess.normal_load,
        friction_scale=guess.friction_scale,
    )


def _fold(held: Wheelset, near: OperatingPoint) -> str:
    try:
        fold = find_fold(
            held,
            speed=near.speed,
            normal_load=near.normal_load,
            friction_scale=near.friction_scale,
        )
    except ValueError:
        return "its torque has no fold"
    return f"the fold is at {fold.drive_torque:.6g} N.m, creepage {fold.creepage:.6g}"
