"""One run of the wet patch by SciPy's solve_ivp."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from wheelset_rival import control, is_wet, motion, numba, record, start

from contactlib.base.quantities import FloatArray


def drive_by_solve_ivp(
    given: dict[str, float],
    duration: float,
    *,
    method: str,
    tolerance: float,
    row: float | None = None,
    corners: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """One run by solve_ivp, which starts again at each of the controller's samples.

    Parameters
    ----------
    given : dict
        Of `numbers`.
    duration : float
        [s].
    method : str
        Of solve_ivp.
    tolerance : float
        Relative, and absolute for creepages and metres over ten.
    row : float, optional
        Time between rows [s]; the sample time if left out.
    corners : bool, optional
        Whether it stops at the patch's ends, too.

    Returns
    -------
    outcomes : ndarray
        `OUTCOMES`.
    creepages : ndarray
        Of the rows.
    """
    run: Any = SimpleNamespace(**given) if numba is None else record(given)
    memory = np.zeros(4)
    state = np.array([start(run, memory), run.speed, 0.0, 0.0])
    samples = round(duration / run.sample_time)
    per_sample = 1 if row is None else round(run.sample_time / row)
    solved = np.empty((0, 2))  # no table: the law itself
    integrate: Any = solve_ivp
    creepages: list[FloatArray] = []
    ends = [given["patch_start"], given["patch_end"], math.inf]

    def friction_at(distance: float) -> float:
        return float(run.patch_friction) if is_wet(run, distance) else 1.0

    def solve(state: FloatArray, times: FloatArray, torque: float) -> Any:
        within = state[2] + 1e-9 if corners else None

        def rates(_: float, y: FloatArray) -> list[float]:
            friction = friction_at(y[2] if within is None else within)
            f0, f1, _, _, _, _, force = motion(run, solved, y[0], y[1], torque, friction)
            return [f0, f1, y[1], force * (run.radius * y[0] - y[1])]

        def jacobian(_: float, y: FloatArray) -> list[list[float]]:
            friction = friction_at(y[2] if within is None else within)
            _, _, j00, j01, j10, j11, force = motion(run, solved, y[0], y[1], torque, friction)
            slip = run.radius * y[0] - y[1]
            by_omega = j10 / run.inverse_mass * slip + force * run.radius
            by_speed = -j01 / (run.radius * run.inverse_inertia) * slip - force
            return [
                [j00, j01, 0.0, 0.0],
                [j10, j11, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [by_omega, by_speed, 0.0, 0.0],
            ]

        def to_corner(_: float, y: FloatArray) -> float:
            return float(y[2]) - next(end for end in ends if end > state[2] + 1e-9)

        to_corner.terminal = True  # type: ignore[attr-defined]
        return integrate(
            rates,
            (times[0], times[-1]),
            state,
            method=method,
            t_eval=times,
            rtol=tolerance,
            atol=tolerance * np.array([1.0, 1.0, 0.1, 1e3]),
            events=to_corner if corners and state[2] < ends[1] - 1e-9 else None,
            jac=jacobian,
        )

    for i in range(samples):
        torque = control(run, memory, run.radius * state[0], state[1])
        times = grid = run.sample_time * (i + np.arange(per_sample + 1) / per_sample)
        while True:
            found = solve(state, times, torque)
            rows = found.y[:, np.isin(found.t, grid[:-1])]
            creepages.append(run.radius * rows[0] / rows[1] - 1.0)
            if found.status == 0:
                break
            at, state = found.t_events[0][0], found.y_events[0][0]
            times = np.concatenate([[at], grid[grid > at]])
        state = found.y[:, -1]
    creepages.append(np.array([run.radius * state[0] / state[1] - 1.0]))
    every = np.concatenate(creepages)
    return np.array([state[2], state[1], np.abs(every).max(), state[3]]), every
