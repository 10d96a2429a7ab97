"""The wet patch as a user would program it: equations, a batch of fixed steps, and solve_ivp.

The functions know floats only. numba compiles them if it is there; without it they are Python.
The wheelset is rigid and stays above its minimum speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, TypeVar, cast

import numpy as np
from scipy.integrate import solve_ivp

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.traction.creep_pi import BAND, CUT, MAX_SHARE, CreepPI
from contactlib.traction.filters import tracker_gains
from contactlib.vehicle.creep_curve import CreepCurve

numba: Any = None
with suppress(ImportError):
    numba = import_module("numba")

MIN_SHARE = CreepPI.minimum_share
TABLE_END, TABLE_CELLS = 6.0, 256  # of normalized creepage; right to 1e-6
GAMMA = 1.0 - math.sqrt(0.5)  # of ROS2, which is L-stable with it
OUTCOMES = ("distance", "largest_creepage", "slip_work")

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """The function, compiled if numba is there; threads may run it side by side."""
    if numba is None:
        return function
    return cast("F", numba.njit(nogil=True, error_model="numpy")(function))


def records(scenarios: Sequence[cl.Scenario], controller: str) -> Any:
    """What the equations and the controller know of scenarios, one record each."""
    rows = []
    for scenario in scenarios:
        wheelset, patch = scenario.drivetrain.wheelset, scenario.track.friction_left
        control: Any = scenario.controller(controller)
        element, resistance = wheelset.element, wheelset.resistance
        gains = tracker_gains(control.sample_time, control.speed_filter_time)
        demand, speed = float(scenario.demand(0.0)), scenario.initial_speed
        assert wheelset.mass is not None
        row = {
            "radius": wheelset.radius,
            "inverse_inertia": 1.0 / wheelset.inertia,
            "inverse_mass": 1.0 / wheelset.mass,
            "damping": wheelset.damping,
            "constant": resistance.constant,
            "linear": resistance.linear,
            "quadratic": resistance.quadratic,
            "saturation_creepage": element.saturation_creepage,
            "k_hat": element.k_hat,
            "sliding": element.friction.kinetic * element.axle_load,
            "largest": element.friction.static / element.friction.kinetic,
            "patch_start": patch.at[0],
            "patch_end": patch.at[-1],
            "patch_friction": patch.value[1],
            "demand": demand,
            "speed": speed,
            "creepage": CreepCurve(wheelset, speed=speed).grip(demand),
            "sample_time": control.sample_time,
            "reference": control.reference,
            "reference_torque": control.reference_torque,
            "proportional_gain": control.proportional_gain,
            "integral_gain": control.integral_gain,
            "low_speed": control.low_speed,
            "minimum_slip": control.minimum_slip,
            "recovery_time": control.recovery_time,
            "tracker_g": gains[0],
            "tracker_h": gains[1],
        }
        rows.append(row)
    return np.rec.array(
        [tuple(row.values()) for row in rows], dtype=[(name, np.float64) for name in rows[0]]
    )


# ---- law, equations of motion, controller ---------------------------------------------------


@compiled
def line_law(x: float, k_hat: float) -> tuple[float, float]:
    """Traction ratio and slope of the line contact at x > 0.

    Eqs. (18) and (19) of Ciavarella, Romano & Barber, see contactlib/laws/strips.py.
    """
    low, high = 0.0, x / k_hat
    t = high / (1.0 + high)
    m = s = y = 0.0
    for _ in range(60):
        p = (t * t) * (t * t)
        s = 1.0 / (1.0 + p)
        m, y = p * s, k_hat * t
        residual = m + y - x
        if residual > 0.0:
            high = t
        else:
            low = t
        step = residual / (4.0 * m * s + y)  # of ln(t)
        if abs(step) < 1e-13:
            break
        following = t - t * step
        t = following if low < following < high else 0.5 * (low + high)
    share = m * y / (y + 4.0 * m * s)
    return m * (1.0 + s) + 2.0 * y * s, 2.0 * s * (1.0 - 4.0 * share)


@compiled
def tabulate(k_hat: float) -> FloatArray:
    """Cubic Hermite table of the law: values, and slopes times the cell's length."""
    length = TABLE_END / TABLE_CELLS
    nodes = np.empty((TABLE_CELLS + 1, 2))
    nodes[0, 0], nodes[0, 1] = 0.0, 2.0 * length
    for i in range(1, TABLE_CELLS + 1):
        ratio, slope = line_law(i * length, k_hat)
        nodes[i, 0], nodes[i, 1] = ratio, slope * length
    return nodes


@compiled
def law(nodes: FloatArray, k_hat: float, friction: float, x: float) -> tuple[float, float]:
    """Traction ratio and slope at x >= 0: of the table, or solved where it ends."""
    per_length = TABLE_CELLS / TABLE_END
    place = x * per_length
    if place < nodes.shape[0] - 1:
        cell = int(place)
        f = place - cell
        a, b = nodes[cell, 0], nodes[cell, 1]
        rise, end = nodes[cell + 1, 0] - a, nodes[cell + 1, 1]
        c, d = 3.0 * rise - 2.0 * b - end, b + end - 2.0 * rise
        return a + f * (b + f * (c + f * d)), (b + f * (2.0 * c + 3.0 * f * d)) * per_length
    return line_law(x, k_hat / math.sqrt(friction)) if x > 0.0 else (0.0, 2.0)


@compiled
def motion(
    run: Any, nodes: FloatArray, omega: float, speed: float, torque: float, friction: float
) -> tuple[float, float, float, float, float, float, float]:
    """Rates of omega and speed, their Jacobian by rows, and the creep force."""
    inverse_speed = 1.0 / speed
    creepage = (run.radius * omega - speed) * inverse_speed
    saturation = run.saturation_creepage * friction
    ratio, slope = law(nodes, run.k_hat, friction, abs(creepage) / saturation)
    if ratio > run.largest:
        ratio, slope = run.largest, 0.0
    force = math.copysign(run.sliding * friction * ratio, creepage)
    by_slip = run.sliding * slope / run.saturation_creepage * inverse_speed
    by_speed = -by_slip * (1.0 + creepage)
    resistance = run.constant + (run.linear + run.quadratic * speed) * speed
    by_resistance = run.linear + 2.0 * run.quadratic * speed
    return (
        (torque - run.radius * force - run.damping * omega) * run.inverse_inertia,
        (force - resistance) * run.inverse_mass,
        -(run.radius * run.radius * by_slip + run.damping) * run.inverse_inertia,
        -run.radius * by_speed * run.inverse_inertia,
        run.radius * by_slip * run.inverse_mass,
        (by_speed - by_resistance) * run.inverse_mass,
        force,
    )


@compiled
def control(run: Any, memory: FloatArray, wheel_speed: float, vehicle_speed: float) -> float:
    """Torque of the creep controller until its next sample; see contactlib/traction/creep_pi.py.

    Memory: filtered vehicle speed, its change, integral, 1 if limiting.
    """
    expected = memory[0] + memory[1]
    surprise = vehicle_speed - expected
    memory[0] = expected + run.tracker_g * surprise
    memory[1] += run.tracker_h * surprise
    share = min(max(memory[2] / run.reference_torque, MIN_SHARE), MAX_SHARE)
    scale = max(abs(memory[0]), run.low_speed)
    target = max(run.reference * share * scale, run.minimum_slip)
    demand = run.demand
    integral = min(memory[2], demand) if memory[3] > 0.0 else demand
    error = target - (wheel_speed - memory[0])
    requested = run.proportional_gain * error + integral
    part = error / target
    ease = max(min(part, 1.0), BAND) - BAND - CUT * max(min(-part, 4.0) - 3.0, 0.0)
    integral += run.sample_time * (run.integral_gain * error + demand * ease / run.recovery_time)
    memory[2] = min(max(integral, 0.0), demand)
    memory[3] = 1.0 if requested < demand else 0.0
    return float(min(max(requested, 0.0), demand))


@compiled
def start(run: Any, memory: FloatArray) -> float:
    """Angular velocity at the start; the controller has been giving the demand."""
    memory[0], memory[1], memory[2], memory[3] = run.speed, 0.0, run.demand, 0.0
    return float(run.speed * (1.0 + run.creepage) / run.radius)


@compiled
def is_wet(run: Any, distance: float) -> bool:
    """Whether a place lies in the patch."""
    return bool(run.patch_start <= distance < run.patch_end)


# ---- a batch of fixed steps; solve_ivp ------------------------------------------------------


@compiled
def until_corner(run: Any, distance: float, speed: float) -> float:
    """Time to the next end of the patch at this speed."""
    if distance < run.patch_start:
        return float((run.patch_start - distance) / speed)
    return float((run.patch_end - distance) / speed) if distance < run.patch_end else math.inf


@compiled
def drive(run: Any, steps: int, per_sample: int, found: FloatArray) -> None:
    """One run in fixed steps by ROS2; fills in `OUTCOMES`.

    The two-stage linearly implicit Rosenbrock method of Verwer et al., SIAM J. Sci. Comput. 20
    (1999) 1456-1480. A step ends where the patch does.
    """
    memory = np.zeros(4)
    omega, speed = start(run, memory), run.speed
    length = run.sample_time / per_sample
    distance = work = largest = torque = 0.0
    dry, wet = tabulate(run.k_hat), tabulate(run.k_hat / math.sqrt(run.patch_friction))
    i, left = 0, 0.0
    while True:
        if left == 0.0:
            largest = max(largest, abs(run.radius * omega / speed - 1.0))
            if i == steps:
                break
            if i % per_sample == 0:
                torque = control(run, memory, run.radius * omega, speed)
            left = length
            i += 1
        h = min(left, until_corner(run, distance, speed))
        h = h if h < left * (1.0 - 1e-9) else left
        in_patch = is_wet(run, distance + 0.5 * h * speed)
        nodes, friction = (wet, run.patch_friction) if in_patch else (dry, 1.0)
        f0, f1, j00, j01, j10, j11, force = motion(run, nodes, omega, speed, torque, friction)
        # (I - gamma h J) k = f
        a = GAMMA * h
        e00, e11, e01, e10 = 1.0 - a * j00, 1.0 - a * j11, a * j01, a * j10
        inverse = 1.0 / (e00 * e11 - e01 * e10)
        k0, k1 = inverse * (e11 * f0 + e01 * f1), inverse * (e10 * f0 + e00 * f1)
        power = force * (run.radius * omega - speed)
        middle = omega + h * k0, speed + h * k1
        g0, g1, _, _, _, _, force = motion(run, nodes, *middle, torque, friction)
        power += force * (run.radius * middle[0] - middle[1])
        g0, g1 = g0 - 2.0 * k0, g1 - 2.0 * k1
        l0, l1 = inverse * (e11 * g0 + e01 * g1), inverse * (e10 * g0 + e00 * g1)
        way = speed + a * k1
        distance += h * (1.5 * way + 0.5 * (middle[1] - 2.0 * way + a * l1))
        omega += h * (1.5 * k0 + 0.5 * l0)
        speed += h * (1.5 * k1 + 0.5 * l1)
        work += 0.5 * h * power
        if h < left:  # exactly at a corner, and not before it by rounding
            distance = run.patch_end if in_patch else run.patch_start
        left = left - h if h < left else 0.0
    found[0], found[1], found[2] = distance, largest, work


@compiled
def drive_many(runs: Any, steps: int, per_sample: int, found: FloatArray) -> None:
    """All runs, one after the other; `found` is (n, outcomes)."""
    for i in range(runs.size):
        drive(runs[i], steps, per_sample, found[i])


def drive_by_solve_ivp(
    run: Any,
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
    run : record
        Of `records`.
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
    memory = np.zeros(4)
    state = np.array([start(run, memory), run.speed, 0.0, 0.0])
    samples = round(duration / run.sample_time)
    per_sample = 1 if row is None else round(run.sample_time / row)
    solved = np.empty((0, 2))  # no table: the law itself
    integrate: Any = solve_ivp
    creepages: list[FloatArray] = []
    ends = [run.patch_start, run.patch_end, math.inf]

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
            return float(y[2] - next(end for end in ends if end > state[2] + 1e-9))

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
    return np.array([state[2], np.abs(every).max(), state[3]]), every
