"""Basin of attraction: the creepages from which the wheel re-adheres at constant torque.

With the speed held, the border is the unstable steady state. A free wheelset moves in the plane of
creepage and speed, and the border is a curve, the separatrix. An accelerating train may have no
saddle with this curve as its stable manifold, but it has the unstable quasi-steady branch,
along which the vehicle's speed changes slowly; a state close to the separatrix stays near this
branch for long. Backward in time, every motion that starts near the branch at a later moment
therefore approaches the separatrix at the rate of the unstable pole: twenty time constants reduce
the initial error, which is small, to 2e-9 of its size. Where there is a saddle, the trace ends on
its stable manifold.

Where the branch ends sooner, because the vehicle's speed changes, motions forward in time bracket
the border: it lies between a creepage from which they return and one from which they do not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.quantities import POSITIVE, FloatArray, checked
from contactlib.stability.poles import steady_rolling
from contactlib.vehicle.conditions import Conditions, GivenConditions, GivenInputs
from contactlib.vehicle.continuous_control import TorqueControl
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.track import Profile
from contactlib.vehicle.wheelset import Wheelset, checked_torque

TIME_CONSTANTS = 20
FEWEST = 8  # time constants if the branch ends sooner: they leave 3e-4 of the error
REACH = 3.0  # distance searched / that of the unstable state from the gripping one
AWAY = 30.0  # the same, beyond which a motion does not return
LONGEST = 200.0  # time of a motion that is tried [time constants]
CLOSE = 1e-6  # width of the bracket of a border / creepage
SHORTEST = 2.0**-5  # step [time constants]
AT_REST = 1e-6  # smallest gain of speed in a step / gain so far
ROUNDING = 1e-12  # of a speed


class Arrival(NamedTuple):
    """State in which a motion met its condition.

    Attributes
    ----------
    time, creepage, speed, distance : float
        Time since the start, negative backward [s]; state [1, m/s]; distance travelled [m].
    """

    time: float
    creepage: float
    speed: float
    distance: float


def move_until(
    wheelset: Wheelset,
    *crossings: Mapping[str, float],
    creepage: float,
    at: Conditions,
    drive_torque: float,
    horizon: float,
) -> Arrival:
    """Integrate the equations of motion until a sum of signals passes a level.

    The contact must have no memory, which would diverge backward in time.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    *crossings : mapping
        Weights of ``creepage`` and ``abs_speed``, and the ``level`` of their sum; the motion ends
        at the first level that is passed.
    creepage : float
        Creepage at the start [1].
    at : Conditions
        Speed at the start, and the other conditions, which stay constant.
    drive_torque : float
        Constant drive torque [N.m].
    horizon : float
        Longest time, negative for backward [s].

    Raises
    ------
    RuntimeError
        If no level is passed within the horizon.
    """
    omega = (1.0 + creepage) * at.speed / wheelset.radius
    first = {"speed": at.speed, "omega": omega}
    run = motion(wheelset, first, *crossings, at=at, drive_torque=drive_torque, horizon=horizon)
    if not run.stopped:
        raise RuntimeError(f"not there after {horizon:.6g} s")
    _, zeta, end = run.events[-1]
    return Arrival(*(float(x) for x in (end["time"], zeta, end["speed"], end["distance"])))


def motion(
    wheelset: Wheelset,
    first: Mapping[str, float],
    *crossings: Mapping[str, float],
    at: Conditions,
    drive_torque: float,
    horizon: float,
) -> kernel.NativeRun:
    """Integrate the equations of motion from a row to a horizon, or the first level passed.

    Parameters as for `move_until`; `first` holds the states at the start, with those of the memory.
    """
    inputs = {
        "reference": drive_torque,
        "axle_load": at.axle_load,
        "friction_scale": at.friction_scale,
        "resistance_force": at.resistance_force,
    }
    held = wheelset.element.friction.kinetic * at.axle_load
    scale = {"speed": at.speed, "distance": at.speed * abs(horizon)}
    scale |= {"held_force": held, "unslipped": 1.0, "outer_force": held}
    works = "drive_work", "creep_work", "resistance_work", "loss_work"
    scale |= dict.fromkeys(("integral_torque", *works), math.inf)  # they do not matter
    return kernel.run_wheelset(
        Drivetrain(wheelset).native,
        TorqueControl(Profile.of(drive_torque)).native,
        first,
        span=(0.0, horizon),
        inputs=(inputs, inputs),
        crossings=[{**crossing, "ends": True} for crossing in crossings],
        tolerance=1e-9,
        scale=scale,
    )


class Basin(NamedTuple):
    """Creepages at one speed from which a constant torque brings the wheelset to grip.

    Attributes
    ----------
    creepage : float
        Creepage of the gripping state, on the branch that rises through zero [1].
    lowest, highest : float
        Range around it, infinite where there is no border [1].
    """

    creepage: float
    lowest: float
    highest: float


def basin(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    **given: Unpack[GivenConditions],
) -> Basin:
    """Range of creepages at a speed from which a constant torque returns to grip.

    The range is exact for a held speed. For a free wheelset it is exact up to the error of the
    trace, unless the speed changes so much during the return that the gripping branch is lost. If
    the unstable branch ends within a few of its time constants, as the speed changes, the border is
    searched for up to three times the distance of the unstable state from the gripping one; without
    one there, it is infinite.

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
        If a value is out of range, or no gripping state holds this torque at this speed.
    """
    torque = checked_torque(drive_torque)
    at = wheelset.conditions(at, **given)
    curve = CreepCurve(steady_rolling(wheelset, "basin", at), at)
    states = curve.steady(torque)
    i = int(np.abs(states.creepage).argmin()) if states.creepage.size else 0
    try:
        curve.grip(torque)
    except ValueError:
        raise ValueError(
            f"drive_torque = {drive_torque!r} is out of range: no stable state below the peak at "
            f"speed = {at.speed!r}, axle_load = {at.axle_load!r}, friction_scale = "
            f"{at.friction_scale!r}, resistance_force = {at.resistance_force!r}"
        ) from None
    borders = [-math.inf, math.inf]
    for side, j in ((0, i - 1), (1, i + 1)):
        if 0 <= j < states.creepage.size:
            pair = float(states.creepage[i]), float(states.creepage[j])
            borders[side] = _border(curve, torque, *pair)
    return Basin(float(states.creepage[i]), borders[0], borders[1])


def separatrix(
    wheelset: Wheelset, *, drive_torque: float, speed: ArrayLike, **given: Unpack[GivenInputs]
) -> FloatArray:
    """Border between return and slip-away over speed, on the side of the torque's sign [1].

    Parameters and errors as for `basin`, but `speed` [m/s] may have any shape; infinite where
    there is no border.
    """
    torque, speeds = checked_torque(drive_torque), checked("speed", speed, POSITIVE)
    if speeds.size:
        slowest = wheelset.conditions(speed=float(speeds.min()), **given)
        wheelset = steady_rolling(wheelset, "separatrix", slowest)
    basins = [basin(wheelset, drive_torque=torque, speed=float(v), **given) for v in speeds.flat]
    borders = [at.highest if torque >= 0.0 else at.lowest for at in basins]
    return np.array(borders, dtype=np.float64).reshape(speeds.shape)


def _border(curve: CreepCurve, torque: float, grip: float, creepage: float) -> float:
    """Creepage at the speed of `at` on the separatrix that belongs to an unstable steady state."""
    wheelset, at = curve.wheelset, curve.at
    if wheelset.mass is None:
        return creepage
    side = math.copysign(1.0, creepage)
    farthest = 1e5 * wheelset.element.saturation_creepage_at(
        axle_load=at.axle_load, friction_scale=at.friction_scale
    )
    beyond = side * np.geomspace(abs(creepage), max(2.0 * abs(creepage), farthest), 400)
    # Rate of the slip velocity r omega - V, that is V dzeta/dt + zeta dV/dt [m/s2].
    surplus = wheelset.radius / wheelset.inertia * (torque - curve.torque(beyond))
    if (side * (surplus + beyond * curve.acceleration(beyond)) <= 0.0).all():
        return side * math.inf  # beyond, the creepage grows only because the vehicle stops
    trace = _ahead(wheelset, torque, creepage, at)
    if trace is None:
        return _searched(wheelset, torque, grip, creepage, at)
    later, branch, time = trace
    if abs(later.speed - at.speed) <= ROUNDING * at.speed:  # a saddle
        return creepage
    return move_until(
        wheelset,
        {"abs_speed": 1.0, "level": at.speed},
        creepage=branch,
        at=later,
        drive_torque=torque,
        horizon=-10.0 * time,
    ).creepage


def _ahead(
    wheelset: Wheelset, torque: float, creepage: float, at: Conditions
) -> tuple[Conditions, float, float] | None:
    """Follow the unstable branch; return conditions, creepage [1] and time [s] at the end.

    Steps are a time constant or less, as the end need only be near the branch. None if the branch
    ends within too few of its time constants.
    """
    later, branch, time, passed, share = at, creepage, 0.0, 0.0, 1.0
    curve = CreepCurve(wheelset, at)
    rate = float(curve.acceleration(branch))
    while passed < TIME_CONSTANTS:
        step = share / float(curve.pole(branch))
        if abs(rate * step) <= max(AT_REST * abs(later.speed - at.speed), ROUNDING * at.speed):
            break  # practically at a saddle, where branch and border meet
        ahead = replace(later, speed=later.speed + rate * step)
        on_branch = _on_branch(wheelset, torque, branch, ahead)
        if on_branch is not None and on_branch[1] * rate >= 0.0:
            later, curve, (branch, rate) = ahead, CreepCurve(wheelset, ahead), on_branch
            time, passed = time + step, passed + share
        elif share > SHORTEST:
            share *= 0.5  # to the end of the branch, or up to a saddle
        elif passed < FEWEST:
            return None
        else:
            break
    return later, branch, time


def _searched(
    wheelset: Wheelset, torque: float, grip: float, creepage: float, at: Conditions
) -> float:
    """Border found by motions forward in time; infinite without one within reach."""
    side, distance = math.copysign(1.0, creepage), abs(creepage - grip)
    middle, far = 0.5 * (grip + creepage), grip + side * AWAY * distance
    horizon = LONGEST / float(CreepCurve(wheelset, at).pole(creepage))

    decided: list[dict[str, float]] = [
        {"creepage": 1.0, "level": middle},
        {"creepage": 1.0, "level": far},
        {"abs_speed": 1.0, "level": wheelset.element.minimum_speed},
    ]

    def returns(start: float) -> bool:
        try:
            end = move_until(
                wheelset, *decided, creepage=start, at=at, drive_torque=torque, horizon=horizon
            )
        except RuntimeError:  # it spins, but not far away
            return False
        return side * end.creepage < 0.5 * side * (middle + far)

    known, unknown = middle, grip + side * REACH * distance
    if returns(unknown):
        return side * math.inf
    while abs(unknown - known) > CLOSE * abs(unknown):
        tried = 0.5 * (known + unknown)
        known, unknown = (tried, unknown) if returns(tried) else (known, tried)
    return 0.5 * (known + unknown)


def _on_branch(
    wheelset: Wheelset, torque: float, near: float, at: Conditions
) -> tuple[float, float] | None:
    """Unstable steady state next to a creepage, and the vehicle's acceleration there [m/s2].

    None if the vehicle stands or all states slip away.
    """
    if at.speed < wheelset.element.minimum_speed:
        return None
    curve = CreepCurve(wheelset, at)
    states = curve.steady(torque)
    unstable = states.creepage[states.pole > 0.0]
    if unstable.size == 0:
        return None
    creepage = float(unstable[np.abs(unstable - near).argmin()])
    return creepage, float(curve.acceleration(creepage))
