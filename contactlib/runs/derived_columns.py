"""Signals of runs: of a block of rows of many, each computed on first use, and of a single one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.runs.result import WORK_UNITS, WORKS, Event, Result, energy_defect
from contactlib.vehicle.available_force import AvailableForce
from contactlib.vehicle.continuous_control import ContinuousController, CreepControl
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.wheelset import Wheelset

UNITS = {
    "demand": "N.m",
    "commanded_torque": "N.m",
    "drive_torque": "N.m",
    "axle_torque": "N.m",
    "omega": "rad/s",
    "omega_left": "rad/s",
    "omega_right": "rad/s",
    "speed": "m/s",
    "acceleration": "m/s2",
    "slip_velocity": "m/s",
    "creepage": "1",
    "creepage_left": "1",
    "creepage_right": "1",
    "creep_force": "N",
    "creep_force_left": "N",
    "creep_force_right": "N",
    "available_force": "N",
    "friction_scale_left": "1",
    "friction_scale_right": "1",
    "slope_scale": "1",
    "grade": "1",
    "normal_load": "N",
    "falling_branch": "1",
    **WORK_UNITS,
}
CONTINUOUS_UNITS = {  # of a run under a continuous controller, beside most of those above
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


class Source(Protocol):
    """Source of rows: the drivetrains, their radii [m] and their largest forces."""

    fleet: kernel.NativeFleet
    radius: FloatArray
    axles: int  # of each vehicle

    @property
    def available(self) -> AvailableForce | None:
        """Largest creep forces that friction allows; None if no signal needs them."""

    def speed_limit(self, distance: FloatArray) -> FloatArray:
        """Speed limits of the tracks at distances of shape (rows, n) [m/s]."""

    @property
    def measured_speed(self) -> FloatArray | None:
        """Measured vehicle speed of the block's rows [m/s]; None of a single wheelset."""


class Block:
    """Signals of some rows of n runs by name: arrays of shape (rows, n).

    The arrays share the fleet's memory and are valid until its next block.

    Parameters
    ----------
    time : ndarray
        Times of the rows [s].
    demand : ndarray
        Demanded torque [N.m], shape (rows, n).
    inputs, states : ndarray
        Records of the kernel, shape (rows, n).
    source : Source
        Source of the rows.
    stored : list of ndarray
        Stored energy at the start of the run [J]; the run's first block appends it.
    """

    def __init__(
        self,
        time: FloatArray,
        demand: FloatArray,
        inputs: Any,
        states: Any,
        source: Source,
        stored: list[FloatArray],
    ) -> None:
        self.time = time
        self._demand, self._inputs, self._states = demand, inputs, states
        self._source, self._stored = source, stored
        self._found: dict[str, FloatArray] = {"demand": demand}

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal."""
        if name not in self._found:
            self._found[name] = self._make(name)
        return self._found[name]

    @cached_property
    def _outputs(self) -> Any:
        return self._source.fleet.evaluate(self._inputs, self._states)

    def _make(self, name: str) -> FloatArray:
        if name in DERIVED:
            return DERIVED[name](self)
        if name == "slope_scale" or name.startswith("friction_scale_"):
            return np.asarray(self._inputs[name.replace("_scale", "")])
        if name in ("commanded_torque", "grade"):
            return np.asarray(self._inputs[name])
        if name in STATES:
            return np.asarray(self._states[name])
        return np.asarray(self._outputs[name])

    def _omega(self) -> FloatArray:
        return 0.5 * (self["omega_left"] + self["omega_right"])

    def _slip_velocity(self) -> FloatArray:
        return self._source.radius * self["omega"] - self["speed"]

    def _acceleration(self) -> FloatArray:
        own = np.asarray(self._outputs["speed_rate"])
        axles = self._source.axles
        if axles == 1:
            return own
        shared = own.reshape(len(own), -1, axles).mean(axis=-1)  # each has the same mass
        return np.asarray(np.repeat(shared, axles, axis=1))

    def _measured_speed(self) -> FloatArray:
        measured: Any = self._source.measured_speed
        return np.asarray(measured[: self.time.size])

    def _speed_limit(self) -> FloatArray:
        return self._source.speed_limit(self["distance"])

    def _creepage(self) -> FloatArray:
        return 0.5 * (self["creepage_left"] + self["creepage_right"])

    def _creep_force(self) -> FloatArray:
        return self["creep_force_left"] + self["creep_force_right"]

    def _falling_branch(self) -> FloatArray:
        sides = self._outputs["falling_left"], self._outputs["falling_right"]
        return np.asarray(np.maximum(*sides))

    def _available_force(self) -> FloatArray:
        names = "speed", "friction_scale_left", "friction_scale_right", "slope_scale", "normal_load"
        available: Any = self._source.available
        return np.asarray(available(*(self[name] for name in names)))

    def _normal_load(self) -> FloatArray:
        return np.asarray(self._inputs["load_left"] + self._inputs["load_right"])

    def _energy_defect(self) -> FloatArray:
        if not self._stored:
            self._stored.append(self["stored_energy"][0].copy())
        return energy_defect(self, self._stored[0])


STATES = ("omega_left", "omega_right", "speed", "distance", "brake_torque", *WORKS)
DERIVED: Mapping[str, Callable[[Any], FloatArray]] = {
    name.removeprefix("_"): getattr(Block, name)
    for name in (
        "_omega",
        "_slip_velocity",
        "_acceleration",
        "_measured_speed",
        "_speed_limit",
        "_creepage",
        "_creep_force",
        "_falling_branch",
        "_available_force",
        "_normal_load",
        "_energy_defect",
    )
}


@dataclass
class SingleWheelset:
    """Source of rows of a single wheelset, without available force."""

    fleet: kernel.NativeFleet
    radius: FloatArray
    axles: int = 1
    available: None = None
    measured_speed: None = None

    def speed_limit(self, distance: FloatArray) -> FloatArray:
        """No limit: continuous controllers have no track."""
        return np.full(distance.shape, np.inf)


def continuous_result(
    wheelset: Wheelset,
    controller: ContinuousController,
    columns: Mapping[str, FloatArray],
    events: tuple[Event, ...] = (),
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
    half, friction = 0.5 * columns["normal_load"], columns["friction_scale"]
    of_inputs = {
        "commanded_torque": columns["drive_torque"],
        "resistance_force": columns["resistance_force"],
        **dict.fromkeys(("load_left", "load_right"), half),
        **dict.fromkeys(("friction_left", "friction_right"), friction),
        "slope": np.ones(count),
    }
    memory = {
        f"{name.removesuffix('_force')}_{side}": columns[name]
        for side in ("left", "right")
        for name in kernel.HELD
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
    units = {**CONTINUOUS_UNITS, "reference": CONTINUOUS_UNITS[controller.prescribes], **UNITS}
    del units["available_force"]
    if "drive_work" not in columns:
        units = {name: unit for name, unit in units.items() if name not in WORK_UNITS}
    contact = wheelset.element.evaluate(
        **{name: columns[name] for name in ("omega", "speed", "normal_load", "friction_scale")}
    )
    known = {
        **columns,
        **{name: contact[name].copy() for name in ("normalized_creepage", "traction_coefficient")},
    }
    if wheelset.element.memory:
        load, force = columns["normal_load"], block["creep_force"][:, 0]
        shares = np.divide(force, load, out=np.zeros(count), where=load > 0.0)
        known["traction_coefficient"] = shares
    signals = {name: known[name] if name in known else block[name][:, 0].copy() for name in units}
    return Result(columns["time"], signals, units, events)
