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

from contactlib.stability.basin import Basin, basin, motion, move_until
from contactlib.stability.slip_away import slip_away_time
from contactlib.vehicle.conditions import Conditions, GivenConditions
from contactlib.vehicle.wheelset import Wheelset, checked_torque

SETTLED = 20.0  # relaxation lengths after which a motion rolls steadily
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
    that return and motions that do not bracket it to 1e-4; infinite times and borders are those of
    steady rolling.

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
        is no lower there, or if the torque is so low that any creepage returns.

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
    later = _border(wheelset, at, torque, reached.speed)
    moved, gained = later - end, reached.speed - at.speed
    steepness = moved / gained if gained != 0.0 else 0.0
    level = end - steepness * at.speed
    arrival = path({"creepage": 1.0, "abs_speed": -steepness, "level": level})
    return Clearing(arrival.time, arrival.distance, border)


def _border(wheelset: Wheelset, at: Conditions, torque: float, speed: float) -> float:
    """Border of good friction on the side of slip-away at the speed where a patch ends [1]."""
    try:
        there = basin(wheelset, replace(at, friction_scale=1.0), drive_torque=torque, speed=speed)
        found, why = there.highest if torque >= 0.0 else there.lowest, ""
    except ValueError as error:
        found, why = math.inf, f": {error}"
    if not math.isfinite(found):
        raise ValueError(
            f"speed = {at.speed!r}, friction_scale = {at.friction_scale!r}: out of range, as a "
            f"border is needed at {speed:.6g} m/s too, where the patch may end{why}"
        )
    return found


def _with_memory(wheelset: Wheelset, at: Conditions, torque: float, slope: float) -> Clearing:
    """The same by motions over patches, around the longest one of steady rolling."""
    steady = clearing(wheelset.without_memory(), at, drive_torque=torque, slope=slope)
    if not 0.0 < steady.time < math.inf:
        return steady
    on_patch, good = wheelset.with_slope(slope), replace(at, friction_scale=1.0)
    border, side = steady.border, math.copysign(1.0, torque)
    settling = SETTLED * wheelset.element.memory_scales.relaxation_length
    omega = (1.0 + border.creepage) * at.speed / wheelset.radius
    rolling = omega, at.speed, at.axle_load, 1.0
    held = wheelset.element.rolling_native.steady_memory(*rolling)
    first = {"speed": at.speed, "omega": omega, **held}

    def patch(time: float) -> dict[str, float]:
        """State at the end of a patch of this duration."""
        row = motion(on_patch, first, at=at, drive_torque=torque, horizon=time).rows[-1]
        return {name: row[name].item() for name in (*first, "distance")}

    def returns(time: float) -> bool:
        """Whether the wheel re-adheres after a patch of this duration.

        Where rolling is steady again, the creepage is short of the border at the speed reached.
        """
        there = patch(time)
        settled = settling / there["speed"]
        row = motion(wheelset, there, at=good, drive_torque=torque, horizon=settled).rows[-1]
        reached, speed = wheelset.radius * row["omega"] / row["speed"] - 1.0, row["speed"].item()
        if wheelset.speed_held:
            end = border.highest if torque >= 0.0 else border.lowest
        else:
            end = _border(wheelset.without_memory(), at, torque, speed)
        return bool(side * (reached - end) < 0.0)

    low = high = steady.time
    while not returns(low):
        low, high = 0.5 * low, low
    while low == high or returns(high):
        low, high = high, 2.0 * high
    while high > (1.0 + CLOSE) * low:
        tried = 0.5 * (low + high)
        low, high = (tried, high) if returns(tried) else (low, tried)
    time = 0.5 * (low + high)
    return Clearing(time, patch(time)["distance"], border)
