"""Result of a run: signals over time, their units, and events."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import write_whole
from contactlib.vehicle.continuous_control import ContinuousController
from contactlib.vehicle.wheelset import Wheelset

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
PEAK_PASSED, SLIP_AWAY, STANDSTILL = "peak_passed", "slip_away", "standstill"


class Event(NamedTuple):
    """An event of a run.

    Attributes
    ----------
    name : str
        ``peak_passed``: the creep force began to fall with creepage; ``slip_away``: the creepage
        passed the threshold; ``standstill``: the speed fell below the minimum speed.
    time, creepage, speed, drive_torque : float
        Time and state at the event [s, 1, m/s, N.m].
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
        Rising times [s]; at a jump of an input there is one row, with the value after the jump.
    signals, units : mapping
        Signal arrays of the shape of `time`, and their units, by name.
    events : tuple of Event
        Events in order of time.
    """

    time: FloatArray
    signals: Mapping[str, FloatArray]
    units: Mapping[str, str]
    events: tuple[Event, ...] = ()

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal."""
        return self.signals[name]

    def first(self, name: str) -> Event | None:
        """Return the first event of a name, or None."""
        return next((event for event in self.events if event.name == name), None)

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write all signals: names and units in the first line, numbers to full precision."""
        head = ",".join(["time [s]", *(f"{n} [{self.units[n]}]" for n in self.signals)])
        columns = np.column_stack([self.time, *self.signals.values()]).tolist()
        lines = [head, *(",".join(map(repr, row)) for row in columns)]
        return write_whole(path, ("\n".join(lines) + "\n").encode())

    def to_xarray(self) -> Dataset:
        """Convert to an `xarray.Dataset` over time, each variable with its ``units``."""
        import xarray

        data = {
            name: ("time", values, {"units": self.units[name]})
            for name, values in self.signals.items()
        }
        return xarray.Dataset(data, coords={"time": ("time", self.time, {"units": "s"})})


class Signals(Protocol):
    """Signals by name."""

    def __getitem__(self, name: str, /) -> FloatArray:
        """Return one signal."""


def energy_defect(signals: Signals, stored_at_start: FloatArray) -> FloatArray:
    """Error of the energy balance: drive work - change of stored energy - other works [J]."""
    drive, *others = (signals[name] for name in WORKS)
    return np.asarray(drive - (signals["stored_energy"] - stored_at_start) - sum(others))


def make_result(
    wheelset: Wheelset,
    controller: ContinuousController,
    columns: Mapping[str, FloatArray],
    events: tuple[Event, ...] = (),
) -> Result:
    """Make a result from time, states, inputs and, if there are any, works.

    The contact is evaluated again, over all rows at once.
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
        signals["energy_defect"] = energy_defect(signals, stored[0])
        units |= WORK_UNITS
    return Result(
        columns["time"],
        MappingProxyType({name: signals[name] for name in units}),
        MappingProxyType(units),
        events,
    )
