"""Motion of a wheelset under constant inputs, forward or backward in time, to a condition."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from contactlib.parameters import FloatArray
from contactlib.wheelset import Wheelset


class Arrival(NamedTuple):
    """Where a motion met its condition.

    Attributes
    ----------
    time, creepage, speed, distance : float
        Since the start, negative backward in time [s]; state [1, m/s]; way run meanwhile [m].
    """

    time: float
    creepage: float
    speed: float
    distance: float


def move_until(
    wheelset: Wheelset,
    condition: Callable[[float, float], float],
    *,
    creepage: float,
    speed: float,
    drive_torque: float,
    normal_load: float,
    friction_scale: float,
    resistance_force: float,
    horizon: float,
) -> Arrival:
    """Integrate the equations of motion until `condition` of (creepage, speed) changes sign.

    Parameters
    ----------
    wheelset, condition
        What moves, and until when.
    creepage, speed : float
        Start [1, m/s].
    drive_torque, normal_load, friction_scale, resistance_force : float
        Inputs [N.m, N, 1, N].
    horizon : float
        Longest time, negative for backward [s].

    Raises
    ------
    RuntimeError
        If the condition is not met within the horizon.
    """
    r = wheelset.radius

    def creepage_of(state: FloatArray) -> float:
        return float(r * state[0] / state[1] - 1.0)

    def rates(state: FloatArray) -> Any:
        given = (drive_torque, normal_load, friction_scale, resistance_force)
        return wheelset.rates(float(state[0]), float(state[1]), *given)[0]

    def right_hand_side(_: float, state: FloatArray) -> list[float]:
        found = rates(state)
        return [found.omega_rate, found.speed_rate, state[1]]

    def jacobian(_: float, state: FloatArray) -> list[list[float]]:
        (a, b), (c, d) = rates(state).jacobian
        return [[a, b, 0.0], [c, d, 0.0], [0.0, 1.0, 0.0]]

    def met(_: float, state: FloatArray) -> float:
        return condition(creepage_of(state), float(state[1]))

    met.terminal = True  # type: ignore[attr-defined]
    omega = (1.0 + creepage) * speed / r
    solution: Any = solve_ivp(
        right_hand_side,
        (0.0, horizon),
        [omega, speed, 0.0],
        method="Radau",
        jac=jacobian,
        events=met,
        rtol=1e-9,
        atol=1e-9 * np.array([abs(omega), speed, speed * abs(horizon)]),
    )
    if solution.status != 1:
        raise RuntimeError(f"not there after {solution.t[-1]:.6g} s: {solution.message}")
    end = solution.y_events[0][0]
    return Arrival(float(solution.t_events[0][0]), creepage_of(end), float(end[1]), float(end[2]))
