"""Result of a run: signals over time, of one axle or of several, their units, and events."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, Limits, ReadOnly, checked_whole
from contactlib.base.text import no_signal
from contactlib.base.writing import write_whole
from contactlib.runs.signals import WORKS, long_name

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

TOTALS = (
    "creep_force",
    "available_force",
    "drive_torque",
    *WORKS,
    "stored_energy",
    "energy_defect",
)
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


@dataclass(frozen=True, eq=False)
class Result:
    """Time series of one run, of a wheelset or of all axles of a vehicle.

    Results are equal if all of their numbers are; nan equals nan.

    Attributes
    ----------
    time : ndarray
        Rising times [s]; at a jump of an input there is one row, with the value after the jump.
    signals, units : mapping
        Signals and their units by name: arrays of the shape of `time`, those of several axles of
        the shape (rows, axles). Speed, acceleration and speed limit are those of the vehicle.
    events : tuple of Event
        Events in order of time.
    """

    time: FloatArray
    signals: Mapping[str, FloatArray]
    units: Mapping[str, str]
    events: tuple[Event, ...] = ()

    def __post_init__(self) -> None:
        for name in ("signals", "units"):
            object.__setattr__(self, name, ReadOnly(getattr(self, name)))

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal."""
        if name not in self.signals:
            raise no_signal(name, self.signals, self)
        return self.signals[name]

    @property
    def axles(self) -> int:
        """Number of axles."""
        return max((y.shape[1] for y in self.signals.values() if y.ndim > 1), default=1)

    @property
    def by_axle(self) -> tuple[Result, ...]:
        """Result of each axle, the first one at the front."""
        return tuple(self.axle(number) for number in range(1, self.axles + 1))

    def axle(self, number: int) -> Result:
        """Result of one axle, by its number from 1, as that of a wheelset."""
        place = checked_whole("number", number, Limits(at_least=1, at_most=self.axles)) - 1
        signals = {name: y if y.ndim == 1 else y[:, place] for name, y in self.signals.items()}
        return Result(self.time, signals, self.units, self.events)

    def total(self, name: str) -> FloatArray:
        """Sum of a force, torque, work or energy over the axles."""
        if name not in TOTALS:
            raise KeyError(f"no total of {name!r}: there are {', '.join(TOTALS)}")
        return self[name] if self[name].ndim == 1 else np.asarray(self[name].sum(axis=1))

    @property
    def totals(self) -> Mapping[str, FloatArray]:
        """All totals, and the speed, by name."""
        sums = {name: self.total(name) for name in TOTALS if name in self.signals}
        return ReadOnly({"speed": self["speed"], **sums})

    def _columns(self) -> dict[str, tuple[FloatArray, str]]:
        """Values and unit of each column of a table: those of several axles have their number."""
        columns = {}
        for name, y in self.signals.items():
            if y.ndim == 1:
                columns[name] = y, self.units[name]
            else:
                axles = enumerate(y.T, start=1)
                columns |= {f"{name}_{i}": (values, self.units[name]) for i, values in axles}
        return columns

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Result):
            return NotImplemented
        mine, theirs = ((list(r.signals), r.units, r.events) for r in (self, other))
        return mine == theirs and all(
            np.array_equal(*pair, equal_nan=True)
            for pair in zip(
                (self.time, *self.signals.values()),
                (other.time, *other.signals.values()),
                strict=True,
            )
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        ends = f" from {self.time[0]:g} to {self.time[-1]:g} s" if self.time.size else ""
        events = "".join(f", {event.name} at {event.time:.4g} s" for event in self.events[:3])
        more = f", {len(self.events) - 3} more events" if len(self.events) > 3 else ""
        of = f" of {self.axles} axles" if self.axles > 1 else ""
        what = f"{self.time.size} rows{ends} of {len(self.signals)} signals{of}"
        return f"<contactlib.Result: {what}{events}{more}>"

    def _repr_html_(self) -> str:
        """Table of the signals, for a notebook."""
        frame = self.to_pandas()
        table = frame.agg(["min", "max"]).T if len(frame) else frame.T
        for place, name, row in ((0, "start", 0), (1, "end", -1)) if len(frame) else ():
            table.insert(place, name, frame.iloc[row])
        table.insert(0, "unit", [unit for _, unit in self._columns().values()])
        return f"<p>{html.escape(repr(self))}</p>{table.to_html(float_format='{:.5g}'.format)}"

    def first(self, name: str) -> Event | None:
        """Return the first event of a name, or None."""
        return next((event for event in self.events if event.name == name), None)

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write all signals: names and units in the first line, numbers to full precision.

        Those of several axles have a column for each, as ``creep_force_1 [N]``.
        """
        columns = self._columns()
        head = ",".join(["time [s]", *(f"{name} [{unit}]" for name, (_, unit) in columns.items())])
        rows = np.column_stack([self.time, *(y for y, _ in columns.values())]).tolist()
        lines = [head, *(",".join(map(repr, row)) for row in rows)]
        return write_whole(path, ("\n".join(lines) + "\n").encode())

    def to_pandas(self) -> DataFrame:
        """Convert to a `pandas.DataFrame` over time [s], with the units in ``attrs["units"]``.

        Its columns are those of `to_csv`, without units.
        """
        pandas = optional_library("pandas")
        index = pandas.Index(self.time, name="time")
        columns = self._columns()
        values = {name: y for name, (y, _) in columns.items()}
        frame: DataFrame = pandas.DataFrame(values, index=index)
        frame.attrs["units"] = {"time": "s", **{name: unit for name, (_, unit) in columns.items()}}
        return frame

    def to_xarray(self) -> Dataset:
        """Convert to an `xarray.Dataset` over time: variables with ``units`` and ``long_name``.

        Signals of several axles also have the dimension ``axle``, with numbers from 1.
        """
        xarray = optional_library("xarray")

        def variable(name: str, values: FloatArray, unit: str) -> tuple[Any, FloatArray, Any]:
            dims = ("time", "axle")[: values.ndim]
            return dims, values, {"units": unit, "long_name": long_name(name)}

        data = {name: variable(name, y, self.units[name]) for name, y in self.signals.items()}
        coords: dict[str, Any] = {"time": variable("time", self.time, "s")}
        if self.axles > 1:
            coords["axle"] = np.arange(1, self.axles + 1)
        made: Dataset = xarray.Dataset(data, coords=coords)
        return made
