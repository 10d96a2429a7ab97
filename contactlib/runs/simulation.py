"""One run of a wheelset under a continuous controller, from corner to corner of the inputs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import (
    POSITIVE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    checked_rows,
    warn,
)
from contactlib.element.force_element import REFERENCE_SPEED, creepage_limits
from contactlib.runs.damage import warn_of_damage
from contactlib.runs.result import (
    PEAK_PASSED,
    SLIP_AWAY,
    STANDSTILL,
    Event,
    Result,
)
from contactlib.runs.signals import CONTINUOUS, SIDES, UNITS, WORKS, Block, checked_signals, units
from contactlib.vehicle.conditions import Conditions
from contactlib.vehicle.continuous_control import ContinuousController, CreepControl
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.track import Profile
from contactlib.vehicle.wheelset import Wheelset


def _stretches(
    profiles: Mapping[str, Profile], duration: float
) -> list[tuple[tuple[float, float], list[dict[str, float]]]]:
    """Stretches of time on which every input is linear, with the inputs at both ends."""
    corners = {0.0, duration}
    for profile in profiles.values():
        corners.update(t for t in profile.at if 0.0 < t < duration)
    stretches = []
    for span in pairwise(sorted(corners)):
        ends = {name: profile.on(*span) for name, profile in profiles.items()}
        stretches.append((span, [{name: pair[i] for name, pair in ends.items()} for i in (0, 1)]))
    return stretches


def simulate(
    wheelset: Wheelset,
    controller: ContinuousController,
    *,
    initial_speed: float,
    duration: float | None = None,
    initial_creepage: float | None = None,
    axle_load: float | Profile | None = None,
    friction_scale: float | Profile = 1.0,
    resistance_force: float | Profile = 0.0,
    slip_away_creepage: float | None = None,
    stop_at: Collection[str] = (),
    output_interval: float | None = None,
    signals: Collection[str] = (),
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
        backwards, zero. A contact with memory has rolled steadily before.
    axle_load, friction_scale, resistance_force : float or Profile, optional
        Inputs over time [N, 1, N].
    slip_away_creepage : float, optional
        Threshold of the slip-away event [1]. Default: ten times the saturation creepage.
    stop_at : collection of str, optional
        Names of the events that end the run.
    output_interval : float, optional
        Interval of the output rows, which are added to the integrator's own steps [s]. Default: a
        thousandth of `duration`.
    signals : collection of str, optional
        More signals of the result, those of the contact, as in `run_scenario`.
    tolerance : float, optional
        Relative error of each of the integrator's steps [1]; that of the slip is relative to slip
        plus saturation slip.
    progress : callable, optional
        Called with the fraction of `duration` that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If a value is out of range, or no stable operating point gives the first torque.
    RuntimeError
        If the integrator cannot meet the tolerance.

    Warns
    -----
    InputWarning
        If the run's rim speed, slip work or creepage would destroy a vehicle, or its load makes a
        line contact with memory shorter than four semi-widths.
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
    checked_signals(signals, [wheelset.element])
    unknown = set(stop_at) - {PEAK_PASSED, SLIP_AWAY, STANDSTILL}
    if unknown:
        known = ", ".join((PEAK_PASSED, SLIP_AWAY, STANDSTILL))
        raise ValueError(f"stop_at = {sorted(unknown)!r} must be names of events: {known}")
    nominal_load = wheelset.element.axle_load
    given_inputs = {
        "axle_load": nominal_load if axle_load is None else axle_load,
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
    stretches = _stretches(profiles, end)
    given = dict(stretches[0][1][0])
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
            given_creepage = controller.prescribes == "creepage"
            creepage = reference if given_creepage else curve.grip(reference)
        torque = float(curve.torque(creepage))
    omega = (initial_speed + creepage * max(abs(initial_speed), slowest)) / wheelset.radius
    # Size of each state, to which the tolerance is relative.
    smallest = max(abs(initial_speed), slowest)
    stored = 0.5 * wheelset.inertia * (smallest / wheelset.radius) ** 2
    size = max(abs(torque), 1.0)
    scale = {"speed": smallest, "integral_torque": size, "distance": smallest}
    scale |= dict.fromkeys(WORKS, stored)
    passing: dict[str, dict[str, float]] = {
        PEAK_PASSED: {"fall": 1.0, "direction": 1},
        SLIP_AWAY: {"abs_creepage": 1.0, "level": away, "direction": 1},
        STANDSTILL: {"abs_speed": 1.0, "level": slowest, "direction": -1},
    }
    crossings = [{**event, "ends": name in stop_at} for name, event in passing.items()]
    row = {"speed": initial_speed, "omega": omega, "integral_torque": controller.start(torque)}
    rolling = omega, initial_speed, given["axle_load"], given["friction_scale"]
    row |= wheelset.element.rolling_native.steady_memory(*rolling)
    held = wheelset.element.friction.kinetic * nominal_load
    memory = kernel.memory_states()
    states = ("speed", "omega", "integral_torque", *memory, "distance", *WORKS)
    scale |= {name: 1.0 if name == "unslipped" else held for name in memory}
    train = Drivetrain(wheelset).native
    parts: list[Any] = []
    inputs: list[dict[str, FloatArray]] = []
    events: list[Event] = []
    for span, ends in stretches:
        run = kernel.run_wheelset(
            train,
            controller.native,
            row,
            span=span,
            inputs=ends,
            crossings=crossings,
            interval=interval,
            tolerance=tolerance,
            scale=scale,
        )
        for i, zeta, at in run.events:
            there = at["time"].item(), zeta, at["speed"].item(), at["drive_torque"].item()
            events.append(Event(list(passing)[i], *there))
        row = {name: run.rows[name][-1] for name in states}
        last = run.stopped or span[1] == end
        rows = run.rows if last else run.rows[:-1]  # the next stretch begins with this row
        part = (rows["time"] - span[0]) / (span[1] - span[0])
        inputs.append({name: a + part * (ends[1][name] - a) for name, a in ends[0].items()})
        parts.append(rows)
        progress(run.rows["time"][-1] / end)
        if run.stopped:
            break

    whole = np.concatenate(parts)
    columns = {
        name: whole[name].copy()
        for name in ("time", "omega", "speed", "drive_torque", *memory, "distance", *WORKS)
    }
    columns |= {name: np.concatenate([part[name] for part in inputs]) for name in profiles}
    result = continuous_result(wheelset, controller, columns, tuple(events), signals)
    warn_of_damage(result)
    if warning := wheelset.element.warning(float(max(profiles["axle_load"].value))):
        warn(warning)
    return result


@dataclass
class SingleWheelset:
    """Source of rows of a single wheelset, without available force."""

    fleet: kernel.NativeFleet
    radius: FloatArray
    axles: int = 1
    available: None = None
    measured_speed: Any = None
    sand_rate: Any = None
    pressure_per_torque: Any = None
    padded: bool = False

    def speed_limit(self, distance: FloatArray) -> FloatArray:
        """No limit: continuous controllers have no track."""
        return np.full(distance.shape, np.inf)


def continuous_result(
    wheelset: Wheelset,
    controller: ContinuousController,
    columns: Mapping[str, FloatArray],
    events: tuple[Event, ...] = (),
    signals: Collection[str] = (),
) -> Result:
    """Make a result from time, states, inputs and, if there are any, works.

    The demand of creep control is its largest torque. The available force is left out, as it takes
    a search in every row. Without states of the memory the forces are those of steady rolling.
    """
    if "held_force" not in columns:
        wheelset = wheelset.without_memory()
    count = columns["time"].size
    inputs = np.zeros((count, 1), kernel.drivetrain_dtype("input"))
    states = np.zeros((count, 1), kernel.drivetrain_dtype("state"))
    half, friction = 0.5 * columns["axle_load"], columns["friction_scale"]
    of_inputs = {
        "commanded_torque": columns["drive_torque"],
        "resistance_force": columns["resistance_force"],
        **dict.fromkeys(("load_left", "load_right"), half),
        **dict.fromkeys(("friction_left", "friction_right"), friction),
        "slope": np.ones(count),
    }
    memory = {
        f"{name}_{side}": columns[name]
        for side in SIDES
        for name in kernel.memory_states()
        if name in columns
    }
    of_states = {
        "omega_left": columns["omega"],
        "omega_right": columns["omega"],
        **columns,
        **memory,
    }
    for records, values in ((inputs, of_inputs), (states, of_states)):
        for name in set(records.dtype.names or ()) & set(values):
            records[name][:, 0] = values[name]
    demand = columns["drive_torque"]
    if isinstance(controller, CreepControl):
        demand = np.full_like(demand, controller.torque_max)
    source = SingleWheelset(Drivetrain(wheelset).native, np.array([wheelset.radius]))
    block = Block(columns["time"], demand[:, np.newaxis], inputs, states, source, [])
    given = {**units(CONTINUOUS), "reference": units(CONTINUOUS)[controller.prescribes], **UNITS}
    for name in ("available_force", "brake_torque", "measured_speed"):
        del given[name]
    if "drive_work" not in columns:
        left_out = {"distance", "stored_energy", "energy_defect", *WORKS}
        given = {name: unit for name, unit in given.items() if name not in left_out}
    given |= checked_signals(signals, [wheelset.element])
    found = {name: columns[name] if name in columns else block[name][:, 0] for name in given}
    values = {name: np.array(value) for name, value in found.items()}
    return Result(columns["time"], values, given, events)
