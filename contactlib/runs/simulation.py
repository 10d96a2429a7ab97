"""One run of a wheelset under a continuous controller.

A stiff solver integrates with the kernel's Jacobian, from corner to corner of the inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from contactlib.base.quantities import (
    POSITIVE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    checked_rows,
)
from contactlib.contact import kernel
from contactlib.contact.element import REFERENCE_SPEED, creepage_limits
from contactlib.runs.damage import warn_of_damage
from contactlib.runs.result import (
    PEAK_PASSED,
    SLIP_AWAY,
    STANDSTILL,
    WORKS,
    Event,
    Result,
    make_result,
)
from contactlib.vehicle.conditions import Conditions
from contactlib.vehicle.continuous_control import Command, ContinuousController
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.track import Profile
from contactlib.vehicle.wheelset import Wheelset


@dataclass(frozen=True)
class _Segment:
    """An interval of time on which every input is linear."""

    start: float
    end: float
    ends: dict[str, tuple[float, float]]

    def at(self, time: float) -> dict[str, float]:
        part = (time - self.start) / (self.end - self.start)
        return {name: a + part * (b - a) for name, (a, b) in self.ends.items()}


def _segments(profiles: Mapping[str, Profile], duration: float) -> list[_Segment]:
    corners = {0.0, duration}
    for profile in profiles.values():
        corners.update(t for t in profile.at if 0.0 < t < duration)
    return [
        _Segment(a, b, {name: profile.on(a, b) for name, profile in profiles.items()})
        for a, b in pairwise(sorted(corners))
    ]


class _Loop:
    """Wheelset and controller on one segment: right-hand side, Jacobian, events, rows.

    The state is omega, speed, the controller's memory, the distance and the works.
    """

    def __init__(
        self, wheelset: Wheelset, controller: ContinuousController, segment: _Segment
    ) -> None:
        self._wheelset, self._controller, self._segment = wheelset, controller, segment

    def at(self, time: float, state: FloatArray) -> tuple[Command, Any, Any]:
        omega, speed, memory = state[:3].tolist()
        given = self._segment.at(time)
        load, scale = given["normal_load"], given["friction_scale"]
        contact = self._wheelset.element.native.evaluate_one(omega, speed, load, scale)
        command = self._controller.command(given["reference"], contact.creepage, memory)
        rates = self._wheelset.native.motion(
            omega, speed, command.torque, given["resistance_force"], contact
        )
        return command, contact, rates

    def right_hand_side(self, time: float, state: FloatArray) -> list[float]:
        command, contact, rates = self.at(time, state)
        omega, speed = float(state[0]), float(state[1])
        body, force = self._wheelset, contact.creep_force
        resisting = rates.resistance + self._segment.at(time)["resistance_force"]
        return [
            rates.omega_rate,
            rates.speed_rate,
            command.memory_rate,
            speed,
            command.torque * omega,
            force * (body.radius * omega - speed),
            (force if body.speed_held else resisting) * speed,  # a rig absorbs the whole force
            body.damping * omega**2,
        ]

    def jacobian(self, time: float, state: FloatArray) -> FloatArray:
        command, contact, rates = self.at(time, state)
        (a, b), (c, d) = rates.jacobian
        by_omega, by_speed = contact.creepage_by_omega, contact.creepage_by_speed
        through = command.torque_by_creepage / self._wheelset.inertia
        whole = np.zeros((state.size, state.size))  # distance and works feed nothing back
        whole[:3, :3] = [
            [
                a + through * by_omega,
                b + through * by_speed,
                command.torque_by_memory / self._wheelset.inertia,
            ],
            [c, d, 0.0],
            [
                command.rate_by_creepage * by_omega,
                command.rate_by_creepage * by_speed,
                command.rate_by_memory,
            ],
        ]
        return whole

    def conditions(self, slip_away_creepage: float) -> dict[str, Callable[..., float]]:
        """Functions that rise through zero when an event happens."""

        def peak_passed(time: float, state: FloatArray) -> float:
            return -float(self.at(time, state)[1].force_gradient)

        def slip_away(time: float, state: FloatArray) -> float:
            return abs(float(self.at(time, state)[1].creepage)) - slip_away_creepage

        def standstill(time: float, state: FloatArray) -> float:
            return self._wheelset.element.minimum_speed - abs(float(state[1]))

        return {PEAK_PASSED: peak_passed, SLIP_AWAY: slip_away, STANDSTILL: standstill}

    def integrate(
        self,
        state: FloatArray,
        conditions: Mapping[str, Callable[..., float]],
        stop_at: Collection[str],
        tolerance: float,
        scales: FloatArray,
    ) -> Any:
        """Solve from `state` at the segment's start to its end, or to a terminal event."""
        for name, function in conditions.items():
            function.direction = 1.0  # type: ignore[attr-defined]
            function.terminal = name in stop_at  # type: ignore[attr-defined]
        solution: Any = solve_ivp(
            self.right_hand_side,
            (self._segment.start, self._segment.end),
            state,
            method="Radau",
            jac=self.jacobian,
            events=list(conditions.values()),
            rtol=tolerance,
            atol=tolerance * scales,
            dense_output=True,
        )
        if not solution.success:
            raise RuntimeError(f"the solver stopped at {solution.t[-1]:.6g} s: {solution.message}")
        return solution

    def event(self, name: str, time: float, state: FloatArray) -> Event:
        command, contact, _ = self.at(time, state)
        return Event(name, float(time), contact.creepage, float(state[1]), float(command.torque))

    def rows(self, times: FloatArray, states: FloatArray) -> dict[str, FloatArray]:
        """Columns of a result; `states` has one column for each time."""
        torques = [self.at(t, y)[0].torque for t, y in zip(times, states.T, strict=True)]
        inputs = [self._segment.at(t) for t in times]
        return {
            "time": times,
            "omega": states[0],
            "speed": states[1],
            "drive_torque": np.array(torques),
            **dict(zip(("distance", *WORKS), states[3:], strict=True)),
            **{name: np.array([row[name] for row in inputs]) for name in self._segment.ends},
        }


def simulate(
    wheelset: Wheelset,
    controller: ContinuousController,
    *,
    initial_speed: float,
    duration: float | None = None,
    initial_creepage: float | None = None,
    normal_load: float | Profile | None = None,
    friction_scale: float | Profile = 1.0,
    resistance_force: float | Profile = 0.0,
    slip_away_creepage: float | None = None,
    stop_at: Collection[str] = (),
    output_interval: float | None = None,
    tolerance: float = 1e-9,
    progress: Callable[[float], object] = lambda part: None,
) -> Result:
    """Integrate a wheelset under a continuous controller.

    Parameters
    ----------
    wheelset : Wheelset
        Contact and body.
    controller : TorqueControl or CreepControl
        Continuous controller with its reference over time; for the sampled controllers of
        `contactlib.traction` see `run_scenario`.
    initial_speed : float
        Speed at the start, also zero or negative [m/s].
    duration : float, optional
        Duration [s]. Default: to the last breakpoint of the controller's reference.
    initial_creepage : float, optional
        Creepage at the start [1]. Default: the reference creepage of creep control, or the
        creepage on the stable branch that holds the first torque; below the minimum speed and
        backwards, zero.
    normal_load, friction_scale, resistance_force : float or Profile, optional
        Inputs over time [N, 1, N].
    slip_away_creepage : float, optional
        Threshold of the slip-away event [1]. Default: ten times the saturation creepage.
    stop_at : collection of str, optional
        Names of the events that end the run.
    output_interval : float, optional
        Interval of the output rows, which are added to the solver's own steps [s]. Default: a
        thousandth of `duration`.
    tolerance : float, optional
        Relative error tolerance of the solver [1].
    progress : callable, optional
        Called with the fraction of `duration` that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If a value is out of range, or no stable operating point gives the first torque.
    RuntimeError
        If the solver cannot meet the tolerance.

    Warns
    -----
    InputWarning
        If no vehicle survives the run's rim speed, slip work or creepage.
    """
    end, interval = checked_rows(
        controller.reference.at[-1] if duration is None else duration, output_interval
    )
    away = slip_away_creepage
    if away is None:
        away = 10.0 * wheelset.element.saturation_creepage

    limits = kernel.wheelset_limits()
    initial_speed = checked_number("initial_speed", initial_speed, limits["speed"])
    tolerance = checked_number("tolerance", tolerance, Limits(at_least=1e-13, at_most=1e-2))
    away = checked_number("slip_away_creepage", away, POSITIVE)
    unknown = set(stop_at) - {PEAK_PASSED, SLIP_AWAY, STANDSTILL}
    if unknown:
        known = ", ".join((PEAK_PASSED, SLIP_AWAY, STANDSTILL))
        raise ValueError(f"stop_at = {sorted(unknown)!r} must be names of events: {known}")
    nominal_load = wheelset.element.normal_load
    given_inputs = {
        "normal_load": nominal_load if normal_load is None else normal_load,
        "friction_scale": friction_scale,
        "resistance_force": resistance_force,
    }
    profiles = {"reference": controller.reference}
    for name, value in given_inputs.items():
        if isinstance(value, Profile):
            checked(name, value.value, limits[name])
            profiles[name] = value
        else:
            profiles[name] = Profile.of(checked_number(name, value, limits[name]))
    segments = _segments(profiles, end)
    given = segments[0].at(0.0)
    reference = given.pop("reference")
    slowest = wheelset.element.minimum_speed
    creepage, torque = initial_creepage, 0.0
    if creepage is not None:
        reference_speed = max(abs(initial_speed), slowest)
        reachable = creepage_limits(wheelset.element, reference_speed, REFERENCE_SPEED)
        creepage = checked_number("initial_creepage", creepage, reachable)
    if initial_speed < slowest:
        creepage = 0.0 if creepage is None else creepage
    else:
        curve = CreepCurve(wheelset, Conditions(speed=initial_speed, **given))
        if creepage is None:
            given_creepage = controller.asks_for == "creepage"
            creepage = reference if given_creepage else curve.grip(reference)
        torque = float(curve.torque(creepage))
    omega = (initial_speed + creepage * max(abs(initial_speed), slowest)) / wheelset.radius
    # Scale of each state, to which the tolerance is relative.
    least = max(abs(initial_speed), slowest)
    turning = least / wheelset.radius
    stored = 0.5 * wheelset.inertia * turning**2
    scales = np.array([turning, least, max(abs(torque), 1.0), least, *(stored for _ in WORKS)])
    state = np.array([omega, initial_speed, controller.start(torque), 0.0, *(0.0 for _ in WORKS)])

    parts: list[dict[str, FloatArray]] = []
    events: list[Event] = []
    for segment in segments:
        loop = _Loop(wheelset, controller, segment)
        conditions = loop.conditions(away)
        solution = loop.integrate(state, conditions, stop_at, tolerance, scales)
        for name, when, where in zip(conditions, solution.t_events, solution.y_events, strict=True):
            events += [loop.event(name, t, y) for t, y in zip(when, where, strict=True)]
        stopped = solution.status == 1
        grid = interval * np.arange(np.ceil(segment.start / interval), solution.t[-1] / interval)
        times = np.union1d(solution.t, grid[(grid > segment.start) & (grid < solution.t[-1])])
        if not stopped and segment is not segments[-1]:
            times = times[:-1]  # the next segment begins with this row
        parts.append(loop.rows(times, solution.sol(times)))
        state = solution.y[:, -1]
        progress(solution.t[-1] / end)
        if stopped:
            break

    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    events.sort(key=lambda event: event.time)
    result = make_result(wheelset, controller, columns, tuple(events))
    warn_of_damage(result)
    return result
