"""One run of a wheelset under a controller, by a stiff solver with the kernel's Jacobian."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from contactlib import kernel
from contactlib.controllers import Command, Controller
from contactlib.element import REFERENCE_SPEED, creepage_limits
from contactlib.files import write_whole
from contactlib.parameters import POSITIVE, FloatArray, Limits, checked, checked_number
from contactlib.profile import Profile
from contactlib.stability import quasi_steady_slope, quasi_steady_torque
from contactlib.stability.quasi_steady import creepage_grid, turning_points
from contactlib.wheelset import Wheelset

if TYPE_CHECKING:
    from xarray import Dataset

UNITS = {
    "omega": "rad/s",
    "speed": "m/s",
    "drive_torque": "N.m",
    "creep_force": "N",
    "creepage": "1",
    "normalized_creepage": "1",
    "traction_coefficient": "1",
    "slip_velocity": "m/s",
    "normal_load": "N",
    "friction_scale": "1",
    "resistance_force": "N",
    "falling_branch": "1",
}
WORKS = ("drive_work", "creep_work", "resistance_work", "loss_work")
WORK_UNITS = {"distance": "m", **dict.fromkeys((*WORKS, "stored_energy", "energy_defect"), "J")}

MOST_ROWS = 10_000_000

PEAK_PASSED, SLIP_AWAY, STANDSTILL = "peak_passed", "slip_away", "standstill"


class Event(NamedTuple):
    """Something that happened in a run.

    Attributes
    ----------
    name : str
        ``peak_passed``: the creep force began to fall with creepage; ``slip_away``: the creepage
        passed the threshold; ``standstill``: the speed fell through the minimum speed.
    time, creepage, speed, drive_torque : float
        When [s], and the state there [1, m/s, N.m].
    """

    name: str
    time: float
    creepage: float
    speed: float
    drive_torque: float


@dataclass(frozen=True)
class Result:
    """Time series of one run.

    Attributes
    ----------
    time : ndarray
        [s], rising; a jump of an input has one row, from it on.
    signals, units : mapping
        Signal arrays of the shape of `time`, and their units, by name.
    events : tuple of Event
        In order of time.
    """

    time: FloatArray
    signals: Mapping[str, FloatArray]
    units: Mapping[str, str]
    events: tuple[Event, ...] = ()

    def __getitem__(self, name: str) -> FloatArray:
        """One signal."""
        return self.signals[name]

    def first(self, name: str) -> Event | None:
        """First event of a name, or None."""
        return next((event for event in self.events if event.name == name), None)

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write all signals, names and units in the first line, numbers to full precision."""
        head = ",".join(["time [s]", *(f"{n} [{self.units[n]}]" for n in self.signals)])
        columns = np.column_stack([self.time, *self.signals.values()]).tolist()
        lines = [head, *(",".join(map(repr, row)) for row in columns)]
        return write_whole(path, ("\n".join(lines) + "\n").encode())

    def to_xarray(self) -> Dataset:
        """As an `xarray.Dataset` over time, each variable with its ``units``."""
        import xarray

        data = {
            name: ("time", values, {"units": self.units[name]})
            for name, values in self.signals.items()
        }
        return xarray.Dataset(data, coords={"time": ("time", self.time, {"units": "s"})})


def energy_defect(signals: Mapping[str, FloatArray]) -> FloatArray:
    """Drive work that is found neither in stored energy nor in any other work [J]: an error."""
    stored = signals["stored_energy"]
    drive, *others = (signals[name] for name in WORKS)
    return np.asarray(drive - (stored - stored[0]) - sum(others))


def make_result(
    wheelset: Wheelset,
    controller: Controller,
    columns: Mapping[str, FloatArray],
    events: tuple[Event, ...] = (),
) -> Result:
    """Put together a result from time, states and inputs, and works if there are any.

    What the contact did is evaluated once more, over all rows.
    """
    contact = wheelset.element.evaluate(
        omega=columns["omega"],
        speed=columns["speed"],
        normal_load=columns["normal_load"],
        friction_scale=columns["friction_scale"],
    )
    names = ("creep_force", "creepage", "normalized_creepage", "traction_coefficient")
    signals = {
        **columns,
        **{name: contact[name].copy() for name in (*names, "falling_branch")},
        "slip_velocity": wheelset.radius * columns["omega"] - columns["speed"],
    }
    units = {**UNITS, "reference": UNITS[controller.asks_for]}
    if "drive_work" in columns:
        omega, speed = columns["omega"], columns["speed"]
        stored = 0.5 * wheelset.inertia * omega**2
        if wheelset.mass is not None:
            stored = stored + 0.5 * wheelset.mass * speed**2
        signals["stored_energy"] = stored
        signals["energy_defect"] = energy_defect(signals)
        units |= WORK_UNITS
    return Result(
        columns["time"],
        MappingProxyType({name: signals[name] for name in units}),
        MappingProxyType(units),
        events,
    )


@dataclass(frozen=True)
class _Segment:
    """A stretch of time on which every input is a straight line."""

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

    def __init__(self, wheelset: Wheelset, controller: Controller, segment: _Segment) -> None:
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
            (force if body.speed_held else resisting) * speed,  # a rig takes the whole force
            body.damping * omega**2,
        ]

    def jacobian(self, time: float, state: FloatArray) -> FloatArray:
        command, contact, rates = self.at(time, state)
        (a, b), (c, d) = rates.jacobian
        by_omega, by_speed = contact.creepage_by_omega, contact.creepage_by_speed
        through = command.torque_by_creepage / self._wheelset.inertia
        whole = np.zeros((state.size, state.size))  # works feed nothing back, and follow at once
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
        """Solve from `state` at the segment's start to its end, or to an event that stops it."""
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
        """Columns of a result; `states` has a column for each time."""
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
    controller: Controller,
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
    """Integrate a wheelset under a controller.

    Parameters
    ----------
    wheelset, controller
        What moves, and what drives it.
    initial_speed : float
        [m/s]; zero and backwards too.
    duration : float, optional
        [s]; to the last breakpoint of the controller's reference if left out.
    initial_creepage : float, optional
        [1]. Left out, the run starts where the reference is met: at the reference creepage of
        creep control, or on the stable branch at the first torque; below the minimum speed, and
        backwards, it rolls.
    normal_load, friction_scale, resistance_force : float or Profile, optional
        Inputs over time [N, 1, N].
    slip_away_creepage : float, optional
        Threshold of the slip-away event [1]; ten times the saturation creepage if left out.
    stop_at : collection of str, optional
        Names of the events that end the run.
    output_interval : float, optional
        Rows are the solver's own steps and this grid [s]; a thousandth of `duration` if left out.
    tolerance : float, optional
        Relative error tolerance of the solver [1].
    progress : callable, optional
        Is told the part of `duration` that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If a value is out of range, or no stable operating point gives the first torque.
    RuntimeError
        If the solver cannot meet the tolerance.
    """
    end = controller.reference.at[-1] if duration is None else duration
    away = slip_away_creepage
    if away is None:
        away = 10.0 * wheelset.element.saturation_creepage
    end = checked_number("duration", end, Limits(at_least=1e-9))
    interval = end / 1000.0 if output_interval is None else output_interval
    interval = checked_number("output_interval", interval, POSITIVE)
    if end / interval > MOST_ROWS:
        raise ValueError(
            f"output_interval = {interval!r} is out of range: must be >= duration = {end!r} over "
            f"{MOST_ROWS}"
        )
    limits = kernel.wheelset_limits()
    initial_speed = checked_number("initial_speed", initial_speed, limits["speed"])
    tolerance = checked_number("tolerance", tolerance, Limits(at_least=1e-13, at_most=1e-2))
    away = checked_number("slip_away_creepage", away, POSITIVE)
    unknown = set(stop_at) - {PEAK_PASSED, SLIP_AWAY, STANDSTILL}
    if unknown:
        raise ValueError(f"stop_at = {sorted(unknown)!r} holds no name of an event")
    nominal_load = wheelset.element.contact.normal_load
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
        if creepage is None and controller.asks_for == "creepage":
            creepage = reference
        elif creepage is None:
            creepage = steady_creepage(wheelset, reference, speed=initial_speed, **given)
        torque = float(quasi_steady_torque(wheelset, creepage, speed=initial_speed, **given))
    omega = (initial_speed + creepage * max(abs(initial_speed), slowest)) / wheelset.radius
    # Of each state what a small part of is little.
    least = max(abs(initial_speed), slowest)
    turning, stored = (
        least / wheelset.radius,
        0.5 * wheelset.inertia * (least / wheelset.radius) ** 2,
    )
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
    return make_result(wheelset, controller, columns, tuple(events))


def steady_creepage(
    wheelset: Wheelset,
    torque: float,
    *,
    speed: float,
    normal_load: float,
    friction_scale: float | tuple[float, float],
    resistance_force: float = 0.0,
) -> float:
    """Creepage that a drive torque [N.m] holds on the rising branch [1].

    Two friction scales are those of the wheels, which have half of the load each.

    Raises
    ------
    ValueError
        If none does: the torque is above the fold.
    """
    contacts: list[dict[str, Any]] = [
        {"speed": speed, "normal_load": normal_load, "friction_scale": friction}
        for friction in sorted(set(np.atleast_1d(friction_scale).tolist()))
    ]

    def mean(curve: Callable[..., FloatArray], creepage: ArrayLike, of: Any) -> FloatArray:
        each = [
            curve(wheelset, creepage, resistance_force=resistance_force, **contact)
            for contact in of
        ]
        return np.asarray(np.mean(each, axis=0))

    def excess(creepage: ArrayLike) -> FloatArray:
        return mean(quasi_steady_torque, creepage, contacts) - torque

    sign = 1.0 if excess(0.0) <= 0.0 else -1.0
    grids = [creepage_grid(wheelset, **contact) for contact in contacts]
    grid = np.unique(np.concatenate([[0.0], *grids]))

    def turns(of: Any) -> FloatArray:
        return turning_points(lambda z: mean(quasi_steady_slope, sign * z, of), grid)

    # The branch ends at the peak; with two, at that of the wheel that holds on for longer.
    reach = max(float(np.min(turns([contact]), initial=grid[-1])) for contact in contacts)
    ends = np.union1d(np.append(grid, reach), turns(contacts))
    ends = sign * ends[ends <= reach]
    passed = np.flatnonzero(sign * excess(ends) >= 0.0)
    if passed.size == 0:
        most = torque + sign * float(np.max(sign * excess(ends)))
        raise ValueError(
            f"drive torque = {torque!r} at the start is out of range: the rising branch ends at "
            f"{most:.6g}"
        )
    i = int(passed[0])
    if i == 0:
        return 0.0
    return float(brentq(lambda z: float(excess(z)), ends[i - 1], ends[i], xtol=1e-16))
