"""From which creepages a constant torque brings a wheelset back, and where that ends.

With the speed held the border is the unstable steady state. A free wheelset moves in the plane of
creepage and speed, and the border is a curve, the separatrix. In an accelerating train there need
be no saddle whose stable manifold that curve could be; but there is the unstable quasi-steady
branch, along which the vehicle's speed changes slowly. A state that is only just undecided stays
near that branch for long. So, followed back in time, every motion that starts near the branch at
a later moment is drawn to the separatrix, at the rate of the unstable pole: twenty time constants
leave 2e-9 of an error that is small to begin with. Where there is a saddle the same trace ends on
its stable manifold.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import newton

from contactlib.parameters import POSITIVE, FloatArray, checked
from contactlib.stability.quasi_steady import (
    creepage_grid,
    creepage_pole,
    quasi_steady_slope,
    quasi_steady_torque,
    slip_acceleration,
    vehicle_acceleration,
)
from contactlib.stability.s_curve import steady_states
from contactlib.stability.trajectory import move_until
from contactlib.wheelset import Wheelset, checked_conditions, checked_torque

TIME_CONSTANTS = 20
FEWEST = 8  # if the branch ends sooner: they leave 3e-4 of the error
SHORTEST = 2.0**-5  # step [time constants]
AT_REST = 1e-6  # speed gained by a step, of all that was gained
ROUNDING = 1e-12  # of a speed


class Basin(NamedTuple):
    """Creepages at one speed from which a constant torque brings the wheelset to grip.

    Attributes
    ----------
    creepage : float
        The gripping state itself, on the branch that rises through zero [1].
    lowest, highest : float
        The range around it, infinite where no border is met [1].
    """

    creepage: float
    lowest: float
    highest: float


def basin(
    wheelset: Wheelset,
    *,
    drive_torque: float,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> Basin:
    """Range of creepages at `speed` from which a constant torque returns to grip.

    Exact for a held speed. For a free wheelset exact up to the error of the trace, as long as the
    speed does not change so much meanwhile that the gripping branch itself is lost.

    Raises
    ------
    ValueError
        If a value is out of range, no gripping state has this torque at this speed, or the
        unstable branch is lost while the speed changes within its own time constants.
    """
    torque = checked_torque(drive_torque)
    inputs = checked_conditions(
        wheelset,
        speed=speed,
        normal_load=normal_load,
        friction_scale=friction_scale,
        resistance_force=resistance_force,
    )
    speed = inputs.pop("speed")
    states = steady_states(wheelset, drive_torque=torque, speed=speed, **inputs)
    i = int(np.abs(states.creepage).argmin()) if states.creepage.size else 0
    if not (states.creepage.size and _rises_to(wheelset, states.creepage[i], speed, inputs)):
        raise ValueError(
            f"drive_torque = {drive_torque!r} is out of range: no creepage holds it by grip at "
            f"speed = {speed!r}, normal_load = {inputs['normal_load']!r}, friction_scale = "
            f"{inputs['friction_scale']!r}, resistance_force = {inputs['resistance_force']!r}"
        )
    borders = [-math.inf, math.inf]
    for side, j in ((0, i - 1), (1, i + 1)):
        if 0 <= j < states.creepage.size:
            borders[side] = _border(
                wheelset,
                torque,
                speed,
                float(states.creepage[j]),
                inputs,
            )
    return Basin(float(states.creepage[i]), borders[0], borders[1])


def separatrix(
    wheelset: Wheelset,
    *,
    drive_torque: float,
    speed: ArrayLike,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> FloatArray:
    """Border between return and slip-away over speed, on the side of the torque's sign [1].

    Parameters and errors as `basin`, but that `speed` [m/s] has any shape; infinite where there
    is no border.
    """
    torque, speeds = checked_torque(drive_torque), checked("speed", speed, POSITIVE)
    found = [
        basin(
            wheelset,
            drive_torque=torque,
            speed=float(v),
            normal_load=normal_load,
            friction_scale=friction_scale,
            resistance_force=resistance_force,
        )
        for v in speeds.flat
    ]
    borders = [at.highest if torque >= 0.0 else at.lowest for at in found]
    return np.array(borders, dtype=np.float64).reshape(speeds.shape)


def _rises_to(wheelset: Wheelset, creepage: float, speed: float, inputs: dict[str, Any]) -> bool:
    """Whether no peak lies between zero and a steady state: it is one of grip."""
    contact = {name: inputs[name] for name in ("normal_load", "friction_scale")}
    grid = creepage_grid(wheelset, speed=speed, **contact)
    between = np.append(grid[grid < abs(creepage)], abs(creepage))
    path = math.copysign(1.0, creepage) * between
    return bool((creepage_pole(wheelset, path, speed=speed, **inputs) < 0.0).all())


def _border(
    wheelset: Wheelset,
    torque: float,
    speed: float,
    creepage: float,
    inputs: dict[str, Any],
) -> float:
    """Creepage at `speed` on the separatrix that belongs to an unstable steady state."""
    if wheelset.mass is None:
        return creepage
    side = math.copysign(1.0, creepage)
    contact = {name: inputs[name] for name in ("normal_load", "friction_scale")}
    grid = creepage_grid(wheelset, speed=speed, **contact)
    beyond = side * np.append(abs(creepage), grid[grid > abs(creepage)])
    away = side * slip_acceleration(wheelset, beyond, drive_torque=torque, speed=speed, **inputs)
    if (away <= 0.0).all():
        return side * math.inf  # from there the creepage grows only as the vehicle stops
    later, branch, time = _ahead(wheelset, torque, speed, creepage, inputs)
    if abs(later - speed) <= ROUNDING * speed:  # a saddle
        return creepage
    return move_until(
        wheelset,
        lambda _, v: v - speed,
        creepage=branch,
        speed=later,
        drive_torque=torque,
        horizon=-10.0 * time,
        **inputs,
    ).creepage


def _ahead(
    wheelset: Wheelset, torque: float, speed: float, creepage: float, inputs: dict[str, Any]
) -> tuple[float, float, float]:
    """Speed [m/s], creepage [1] and time [s] at the end of the way along the unstable branch.

    By steps of a time constant or less: followed back from there, what is near the branch will do.
    """

    def gain(zeta: float, v: float) -> float:
        return float(vehicle_acceleration(wheelset, zeta, **{**inputs, "speed": v}))

    later, branch, time, passed, share = speed, creepage, 0.0, 0.0, 1.0
    rate = gain(branch, later)
    while passed < TIME_CONSTANTS:
        step = share / float(creepage_pole(wheelset, branch, **{**inputs, "speed": later}))
        if abs(rate * step) <= max(AT_REST * abs(later - speed), ROUNDING * speed):
            break  # as good as at a saddle, where branch and border meet
        ahead = later + rate * step
        found = _on_branch(wheelset, torque, ahead, branch, inputs)
        if found is not None and gain(found, ahead) * rate >= 0.0:
            later, branch, rate = ahead, found, gain(found, ahead)
            time, passed = time + step, passed + share
        elif share > SHORTEST:
            share *= 0.5  # to the end of the branch, or up to a saddle
        elif passed < FEWEST:
            raise ValueError(
                f"speed = {speed!r}, drive_torque = {torque!r}: the unstable branch is lost "
                f"before {ahead:.6g} m/s, {passed:.3g} of its time constants on; a border takes "
                f">= {FEWEST}"
            )
        else:
            break
    return later, branch, time


def _on_branch(
    wheelset: Wheelset, torque: float, speed: float, near: float, inputs: dict[str, Any]
) -> float | None:
    """Unstable steady state near a creepage, or None: the vehicle stands, or all slip away."""
    if speed < wheelset.element.minimum_speed:
        return None

    def excess(zeta: float) -> float:
        return float(quasi_steady_torque(wheelset, zeta, speed=speed, **inputs)) - torque

    def slope(zeta: float) -> float:
        return float(quasi_steady_slope(wheelset, zeta, speed=speed, **inputs))

    # Where the branch has met that of grip, the iteration fails or finds one that is stable.
    try:
        found = float(newton(excess, near, slope, rtol=1e-12, tol=1e-14))
    except RuntimeError:
        return None
    return found if slope(found) < 0.0 else None
