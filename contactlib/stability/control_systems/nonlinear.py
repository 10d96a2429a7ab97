"""Nonlinear wheelsets as systems of python-control: responses and operating points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    checked_rows,
)
from contactlib.stability import find_fold
from contactlib.vehicle.conditions import Conditions, GivenConditions, GivenInputs, OperatingPoint
from contactlib.vehicle.continuous_control import CreepControl
from contactlib.vehicle.track import Profile
from contactlib.vehicle.wheelset import Wheelset, checked_torque

if TYPE_CHECKING:
    from control import NonlinearIOSystem, TimeResponseData

BALANCED = 1e-6  # largest residual torque at an operating point / largest torque


def response(
    system: NonlinearIOSystem,
    inputs: Mapping[str, float | Profile],
    *,
    initial_state: ArrayLike,
    duration: float,
    output_interval: float | None = None,
    tolerance: float = 1e-8,
) -> TimeResponseData:
    """Response of a continuous system, integrated from corner to corner of its inputs.

    `control.input_output_response` integrates over one interval, in which a stiff solver at rest
    steps over a short pulse. Here every interval between corners is integrated separately.

    Parameters
    ----------
    system : control.NonlinearIOSystem
        System with named inputs, such as `Wheelset.to_nlsys` and `creep_control_system` return.
    inputs : mapping of str to float or Profile
        Every input of the system over time, by name.
    initial_state : array_like
        State at time zero.
    duration : float
        Duration [s].
    output_interval : float, optional
        Interval of the output rows, to which the corners are added [s]. Default: a thousandth of
        `duration`.
    tolerance : float, optional
        Relative tolerance of the solver (Radau) [1].

    Returns
    -------
    control.TimeResponseData
        At a jump of an input there is one row, with the value after the jump.

    Raises
    ------
    ValueError
        If the system is sampled, an input is missing or unknown, or a value is out of range.
    RuntimeError
        If the solver gives up.
    """
    import control

    if not system.isctime():
        raise ValueError(f"system.dt = {system.dt!r}: the system is sampled, it has no corners")
    if set(inputs) != set(system.input_labels):
        wanted = ", ".join(system.input_labels)
        raise ValueError(f"inputs = {sorted(inputs)!r} must be those of the system: {wanted}")
    duration, interval = checked_rows(duration, output_interval)
    tolerance = checked_number("tolerance", tolerance, Limits(at_least=1e-12, at_most=1e-2))
    given = {name: inputs[name] for name in system.input_labels}
    profiles = [
        value
        if isinstance(value, Profile)
        else Profile.of(checked_number(f"inputs[{name!r}]", value, FINITE))
        for name, value in given.items()
    ]
    corners = {0.0, float(duration)}
    corners.update(t for profile in profiles for t in profile.at if 0.0 < t < duration)
    state = checked("initial_state", initial_state, FINITE)
    if state.shape != (system.nstates,):
        raise ValueError(
            f"initial_state has the shape {state.shape}: it must have one number for each of "
            f"{system.nstates} states"
        )
    scale = np.maximum(np.abs(state), 1e-3)
    grid = interval * np.arange(1, int(np.ceil(duration / interval)))

    parts: list[Any] = []
    for start, end in pairwise(sorted(corners)):
        inside = grid[(grid > start) & (grid < end)]
        part = control.input_output_response(
            system,
            timepts=np.array([start, end]),
            inputs=np.array([profile.on(start, end) for profile in profiles]),
            initial_state=state,
            evaluation_times=np.concatenate([[start], inside, [end]]),
            squeeze=False,
            solve_ivp_method="Radau",
            solve_ivp_kwargs={"rtol": tolerance, "atol": tolerance * scale},
        )
        state = part.states[:, -1]
        parts.append(part)

    def joined(name: str) -> Any:
        rows = [getattr(part, name)[..., :-1] for part in parts[:-1]]
        return np.concatenate([*rows, getattr(parts[-1], name)], axis=-1)

    return control.TimeResponseData(
        joined("time"),
        joined("outputs"),
        joined("states"),
        joined("inputs"),
        issiso=False,
        output_labels=system.output_labels,
        state_labels=system.state_labels,
        input_labels=system.input_labels,
        sysname=system.name,
    )


def creep_control_system(
    wheelset: Wheelset, controller: CreepControl, *, speed: float | None = None
) -> NonlinearIOSystem:
    """Closed loop of wheelset and continuous creep controller, both nonlinear.

    Inputs are ``creepage_reference``, ``normal_load``, ``friction_scale`` and
    ``resistance_force``, outputs ``omega``, ``speed``, ``creepage``, ``creep_force`` and
    ``drive_torque``, states those of the wheelset and the controller's memory.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    controller : CreepControl
        Gains and limits; its reference is not used, as the reference is an input.
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
    wheelset: Wheelset, *, drive_torque: float, **given: Unpack[GivenInputs]
) -> NonlinearIOSystem:
    """A free wheelset at constant inputs, with the states ``creepage`` and ``speed``.

    These states suit `control.phase_plane_plot`: in (omega, speed) all motions but the run-away
    stay within a few hundredths of omega = speed/radius.

    Raises
    ------
    ValueError
        If the speed is held, so that there is no phase plane, or an input is out of range.
    """
    import control

    if wheelset.speed_held:
        raise ValueError("the speed of this wheelset is held: it has one state, and no phase plane")
    at = wheelset.conditions(speed=wheelset.element.minimum_speed, **given)
    torque = checked_torque(drive_torque)
    inputs = np.array([torque, at.normal_load, at.friction_scale, at.resistance_force])
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

    Beyond the fold, where there is none, that function may return the state closest to one.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset; for a free one the outer resistance is chosen such that it keeps `speed`.
    drive_torque : float
        Constant torque [N.m].
    creepage : float
        Guess on the wanted branch [1].
    at, **given
        Conditions, as for `Wheelset.conditions`.

    Raises
    ------
    ValueError
        If no point is found; the message names the torque and the fold's.
    """
    import control

    held = replace(wheelset, mass=None)
    at = wheelset.conditions(at, **given)
    omega = (1.0 + checked_number("creepage", creepage, FINITE)) * at.speed / wheelset.radius
    found = control.find_operating_point(
        held.to_nlsys(speed=at.speed),
        [omega],
        [checked_torque(drive_torque), at.normal_load, at.friction_scale, 0.0],
        return_result=True,
        root_kwargs={"tol": 1e-12},
    )
    left = wheelset.inertia * float(np.max(np.abs(found.result.fun)))  # [N.m]
    friction = wheelset.element.friction.static * at.friction_scale
    largest = wheelset.radius * friction * at.normal_load
    if not found.result.success or left > BALANCED * largest:
        raise ValueError(
            f"drive_torque = {drive_torque!r}: no operating point near creepage = {creepage!r} "
            f"(the torques differ by {left:.3g} N.m); {_fold(held, at)}"
        )
    return wheelset.balanced(at, creepage=float(found.outputs[2]))


def _fold(held: Wheelset, at: Conditions) -> str:
    try:
        fold = find_fold(held, at)
    except ValueError:
        return "its torque has no fold"
    return f"the fold is at {fold.drive_torque:.6g} N.m, creepage {fold.creepage:.6g}"
