"""How long a stretch of low friction may last before a constant torque runs away on it.

While on the patch, the creepage rises from where the torque grips on good friction. If it is not
beyond the separatrix of good friction when that is found again, it comes back.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from contactlib.stability.basin import Basin, basin, separatrix
from contactlib.stability.slip_away import slip_away_time
from contactlib.stability.trajectory import move_until
from contactlib.wheelset import Wheelset, checked_conditions, checked_torque


class Clearing(NamedTuple):
    """The longest patch of low friction that a constant torque survives.

    Attributes
    ----------
    time, distance : float
        How long it takes [s] and is [m]; infinite if the creepage does not reach the border.
    border : Basin
        Where the creepage starts, and what it must not pass, at the speed before the patch.
    """

    time: float
    distance: float
    border: Basin


def clearing(
    wheelset: Wheelset,
    *,
    drive_torque: float,
    speed: float,
    friction_scale: float,
    normal_load: float | None = None,
    resistance_force: float = 0.0,
) -> Clearing:
    """Longest time and way with friction times `friction_scale`, before and after it times 1.

    For a held speed the integral of (J V/r) dzeta/(T - T_s(zeta)) on the patch's friction between
    the stable and the unstable steady state of good friction. For a free wheelset the equations
    of motion on the patch, until they meet the separatrix of good friction.

    Parameters
    ----------
    wheelset : Wheelset
        What moves.
    drive_torque, speed : float
        Torque, and speed as the patch begins [N.m, m/s].
    friction_scale : float
        Factor on both friction coefficients on the patch [1].
    normal_load, resistance_force : float, optional
        Further inputs [N, N].

    Returns
    -------
    Clearing
        Infinite if the patch too holds the torque at some creepage short of the border, if
        friction there is no worse, or if the torque is so low that any creepage comes back.

    Raises
    ------
    ValueError
        If a value is out of range, or good friction does not hold the torque.
    """
    torque = checked_torque(drive_torque)
    path = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    path["drive_torque"] = torque
    speed, patch = path.pop("speed"), path["friction_scale"]
    common = {name: value for name, value in path.items() if name != "friction_scale"}
    border = basin(wheelset, speed=speed, **common)
    end = border.highest if torque >= 0.0 else border.lowest
    if not math.isfinite(end):
        return Clearing(math.inf, math.inf, border)
    frozen = slip_away_time(
        wheelset, start=border.creepage, end=end, speed=speed, friction_scale=patch, **common
    )
    if wheelset.speed_held or not math.isfinite(frozen):
        return Clearing(frozen, frozen * speed, border)

    # The border moves with the speed, which changes little meanwhile: a straight line from here
    # to the speed that the frozen time leads to, or beyond.
    start: dict[str, Any] = {"creepage": border.creepage, "speed": speed, "horizon": 100.0 * frozen}
    reached = move_until(wheelset, lambda zeta, _: zeta - end, **start, **path)
    try:
        later = float(separatrix(wheelset, speed=reached.speed, **common))
    except ValueError as error:
        later, why = math.inf, f": {error}"
    else:
        why = ""
    if not math.isfinite(later):
        raise ValueError(
            f"speed = {speed!r}, friction_scale = {patch!r}: out of range, as a border is needed "
            f"at {reached.speed:.6g} m/s too, where the patch may end{why}"
        )
    moved = later - end
    steepness = moved / (reached.speed - speed) if reached.speed != speed else 0.0
    arrival = move_until(
        wheelset, lambda zeta, v: zeta - end - steepness * (v - speed), **start, **path
    )
    return Clearing(arrival.time, arrival.distance, border)
