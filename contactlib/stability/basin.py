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
from scipy.integrate import solve_ivp
from scipy.optimize import newton

from contactlib.parameters import POSITIVE, FloatArray, checked
from contactlib.stability.quasi_steady import (
    creepage_grid,
    creepage_pole,
    quasi_steady_slope,
    quasi_steady_torque,
)
from contactlib.stability.s_curve import steady_states
from contactlib.stability.trajectory import move_until
from contactlib.wheelset import Wheelset

TIME_CONSTANTS = 20.0


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
    inputs: dict[str, Any] = {
        "normal_load": normal_load,
        "friction_scale": friction_scale,
        "resistance_force": resistance_force,
    }
    states = steady_states(wheelset, drive_torque=drive_torque, speed=speed, **inputs)
    i = int(np.abs(states.creepage).argmin()) if states.creepage.size else 0
    if not (states.creepage.size and _rises_to(wheelset, states.creepage[i], speed, inputs)):
        raise ValueError(
            f"drive_torque = {drive_torque!r} is out of range: no creepage holds it by grip at "
            f"speed = {speed!r}"
        )
    borders = [-math.inf, math.inf]
    for side, j in ((0, i - 1), (1, i + 1)):
        if 0 <= j < states.creepage.size:
            borders[side] = _border(
                wheelset,
                float(drive_torque),
                float(speed),
                float(states.creepage[j]),
                float(states.pole[j]),
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
    speeds = checked("speed", speed, POSITIVE)
    found = [
        basin(
            wheelset,
            drive_torque=drive_torque,
            speed=float(v),
            normal_load=normal_load,
            friction_scale=friction_scale,
            resistance_force=resistance_force,
        )
        for v in speeds.flat
    ]
    borders = [at.highest if drive_torque >= 0.0 else at.lowest for at in found]
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
    pole: float,
    inputs: dict[str, Any],
) -> float:
    """Creepage at `speed` on the separatrix that belongs to an unstable steady state."""
    if wheelset.mass is None:
        return creepage
    load = inputs["normal_load"]
    load = wheelset.element.contact.normal_load if load is None else load
    given = {**inputs, "normal_load": load}

    def acceleration(zeta: float, v: float) -> float:
        omega = (1.0 + zeta) * v / wheelset.radius
        motion, _ = wheelset.rates(
            omega, v, torque, load, given["friction_scale"], given["resistance_force"]
        )
        return float(motion.speed_rate)

    if pole + acceleration(creepage, speed) / speed <= 0.0:
        return math.copysign(math.inf, creepage)  # it grows only as the speed falls: no border

    def on_branch(v: float) -> float:
        def excess(zeta: float) -> float:
            return float(quasi_steady_torque(wheelset, zeta, speed=v, **given)) - torque

        def slope(zeta: float) -> float:
            return float(quasi_steady_slope(wheelset, zeta, speed=v, **given))

        # Where the branch has met that of grip, the iteration fails or finds one that is stable.
        found, how = newton(
            excess, creepage, slope, rtol=1e-12, tol=1e-14, full_output=True, disp=False
        )
        if not how.converged or slope(found) >= 0.0:
            raise ValueError(
                f"drive_torque = {torque!r}: the unstable branch that begins at speed = {speed!r} "
                f"is lost before {v:.6g} m/s, so there is no border to follow"
            )
        return float(found)

    def drift(_: float, state: FloatArray) -> list[float]:
        v = float(state[0])
        return [acceleration(on_branch(v), v)]

    ahead = TIME_CONSTANTS / pole
    slow = solve_ivp(drift, (0.0, ahead), [speed], rtol=1e-4, atol=1e-9 * speed)
    later = float(slow.y[0, -1])
    if abs(later - speed) < 1e-12 * speed:  # a saddle
        return creepage
    return move_until(
        wheelset,
        lambda _, v: v - speed,
        creepage=on_branch(later),
        speed=later,
        drive_torque=torque,
        horizon=-10.0 * ahead,
        **given,
    ).creepage
