"""Longest patch of low friction after which the wheel re-adheres at constant torque.

On the patch the creepage rises from the gripping state of good friction. It returns if it has not
passed the separatrix of good friction when the patch ends. A contact with memory has no such border
in creepage and speed: motions over patches of different lengths bracket the longest one.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import NamedTuple, Unpack

from contactlib.stability.basin import AWAY, LONGEST, Basin, basin, motion, move_until
from contactlib.stability.slip_away import slip_away_time
from contactlib.vehicle.conditions import Conditions, GivenConditions
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.wheelset import Wheelset, checked_torque

CLOSE = 1e-4  # width of the bracket of a time with memory / time


class Clearing(NamedTuple):
    """The longest patch of low friction after which the wheel re-adheres at constant torque.

    Attributes
    ----------
    time, distance : float
        Duration [s] and length [m]; infinite if the creepage does not reach the border.
    border : Basin
        Initial creepage, and the border that it must not pass, at the speed before the patch; in
        steady rolling.
    """

    time: float
    distance: float
    border: Basin


def clearing(
    wheelset: Wheelset,
    at: Conditions | None = None,
    *,
    drive_torque: float,
    slope: float = 1.0,
    **given: Unpack[GivenConditions],
) -> Clearing:
    """Longest patch with friction times `friction_scale`, between stretches with factor 1.

    For a held speed the time is the integral of (J V/r) dzeta/(T - T_s(zeta)) on the patch's
    friction between the stable and the unstable steady state of good friction. For a free wheelset
    the equations of motion are integrated to the separatrix of good friction. With memory motions
    that return and motions that do not bracket it to 1e-4; borders are those of steady rolling.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    at, **given
        Conditions at the start of the patch, as `Wheelset.conditions` takes them; the friction
        scale is the factor on the patch.
    drive_torque : float
        Constant torque [N.m].
    slope : float, optional
        Factor on the creep force's initial slope on the patch, see `Track.slope` [1]. Default: 1.

    Returns
    -------
    Clearing
        Infinite if the torque is held on the patch at a creepage short of the border, if friction
        is no lower there, or if the torque is so low that any creepage returns, with memory also
        after the vehicle has gained speed on the patch.

    Raises
    ------
    ValueError
        If a value is out of range, or good friction cannot transmit the torque.
    """
    torque, at = checked_torque(drive_torque), wheelset.conditions(at, **given)
    if wheelset.element.memory:
        return _with_memory(wheelset, at, torque, slope)
    on_patch = wheelset.with_slope(slope)
    good = replace(at, friction_scale=1.0)
    border = basin(wheelset, good, drive_torque=torque)
    end = border.highest if torque >= 0.0 else border.lowest
    if not math.isfinite(end):
        return Clearing(math.inf, math.inf, border)
    frozen = slip_away_time(on_patch, at, drive_torque=torque, start=border.creepage, end=end)
    if wheelset.speed_held or not math.isfinite(frozen):
        return Clearing(frozen, frozen * at.speed, border)

    # The border moves with the speed, which changes little on the patch: take it as linear up to
    # the speed that is reached at the border's first creepage.
    path = partial(
        move_until,
        on_patch,
        creepage=border.creepage,
        at=at,
        drive_torque=torque,
        horizon=100.0 * frozen,
    )
    reached = path({"creepage": 1.0, "level": end})
    try:
        there = basin(wheelset, good, drive_torque=torque, speed=reached.speed)
        later, why = there.highest if torque >= 0.0 else there.lowest, ""
    except ValueError as error:
        later, why = math.inf, f": {error}"
    if not math.isfinite(later):
        raise ValueError(
            f"speed = {at.speed!r}, friction_scale = {at.friction_scale!r}: out of range, as a "
            f"border is needed at {reached.speed:.6g} m/s too, where the patch may end{why}"
        )
    moved, gained = later - end, reached.speed - at.speed
    steepness = moved / gained if gained != 0.0 else 0.0
    level = end - steepness * at.speed
    arrival = path({"creepage": 1.0, "abs_speed": -steepness, "level": level})
    return Clearing(arrival.time, arrival.distance, border)


def _with_memory(wheelset: Wheelset, at: Conditions, torque: float, slope: float) -> Clearing:
    """The same by motions over patches, around the longest one of steady rolling."""
    steady = clearing(wheelset.without_memory(), at, drive_torque=torque, slope=slope)
    if not 0.0 < steady.time < math.inf:
        return steady
    on_patch, good = wheelset.with_slope(slope), replace(at, friction_scale=1.0)
    border = steady.border
    end = border.highest if torque >= 0.0 else border.lowest
    distance = end - border.creepage
    side, middle = math.copysign(1.0, distance), border.creepage + 0.5 * distance
    decided: list[dict[str, float]] = [
        {"creepage": 1.0, "level": middle, "direction": -int(side)},
        {"creepage": 1.0, "level": border.creepage + AWAY * distance, "direction": int(side)},
        {"abs_speed": 1.0, "level": wheelset.element.minimum_speed, "direction": -1},
    ]
    horizon = LONGEST / float(CreepCurve(wheelset.without_memory(), good).pole(end))
    omega = (1.0 + border.creepage) * at.speed / wheelset.radius
    rolling = wheelset.element.rolling_native.evaluate_one(omega, at.speed, at.normal_load, 1.0)
    first = {
        "speed": at.speed,
        "omega": omega,
        "held_force": rolling.steady_force,
        "unslipped": rolling.sticking,
        "outer_force": rolling.steady_outer,
    }

    def after(time: float) -> tuple[bool, float]:
        """Whether the wheel re-adheres after a patch of this duration, and its length."""
        row = motion(on_patch, first, at=at, drive_torque=torque, horizon=time).rows[-1]
        there = {name: row[name].item() for name in (*first, "distance")}
        run = motion(wheelset, there, *decided, at=good, drive_torque=torque, horizon=horizon)
        if run.stopped:
            return run.events[-1][0] == 0, there["distance"]
        last = run.rows[-1]
        reached = wheelset.radius * last["omega"] / last["speed"] - 1.0
        return bool(side * (reached - middle) < 0.0), there["distance"]

    low = high = steady.time
    while not after(low)[0]:
        low, high = 0.5 * low, low
    while low == high or after(high)[0]:
        if high > horizon:  # the vehicle gains so much speed that any creepage returns
            return Clearing(math.inf, math.inf, border)
        low, high = high, 2.0 * high
    while high > (1.0 + CLOSE) * low:
        tried = 0.5 * (low + high)
        low, high = (tried, high) if after(tried)[0] else (low, tried)
    time = 0.5 * (low + high)
    return Clearing(time, after(time)[1], border)
