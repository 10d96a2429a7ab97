"""Result of a run: signals over time, their units, and events."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, ReadOnly
from contactlib.base.text import known_names
from contactlib.base.writing import write_whole
from contactlib.runs.signals import long_name

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

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
    """Time series of one run.

    Results are equal if all of their numbers are; nan equals nan.

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

    def __post_init__(self) -> None:
        for name in ("signals", "units"):
            object.__setattr__(self, name, ReadOnly(getattr(self, name)))

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal."""
        if name not in self.signals:
            raise KeyError(f"no signal {name!r}; {known_names(str(name), self.signals)}")
        return self.signals[name]

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
        what = f"{self.time.size} rows{ends} of {len(self.signals)} signals"
        return f"<contactlib.Result: {what}{events}{more}>"

    def _repr_html_(self) -> str:
        """Table of the signals, for a notebook."""
        frame = self.to_pandas()
        table = frame.agg(["min", "max"]).T if len(frame) else frame.T
        for place, name, row in ((0, "start", 0), (1, "end", -1)) if len(frame) else ():
            table.insert(place, name, frame.iloc[row])
        table.insert(0, "unit", [self.units[name] for name in self.signals])
        return f"<p>{html.escape(repr(self))}</p>{table.to_html(float_format='{:.5g}'.format)}"

    def first(self, name: str) -> Event | None:
        """Return the first event of a name, or None."""
        return next((event for event in self.events if event.name == name), None)

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write all signals: names and units in the first line, numbers to full precision."""
        head = ",".join(["time [s]", *(f"{n} [{self.units[n]}]" for n in self.signals)])
        columns = np.column_stack([self.time, *self.signals.values()]).tolist()
        lines = [head, *(",".join(map(repr, row)) for row in columns)]
        return write_whole(path, ("\n".join(lines) + "\n").encode())

    def to_pandas(self) -> DataFrame:
        """Convert to a `pandas.DataFrame` over time [s], with the units in ``attrs["units"]``."""
        pandas = optional_library("pandas")
        index = pandas.Index(self.time, name="time")
        frame: DataFrame = pandas.DataFrame(dict(self.signals), index=index)
        frame.attrs["units"] = {"time": "s", **self.units}
        return frame

    def to_xarray(self) -> Dataset:
        """Convert to an `xarray.Dataset` over time: variables with ``units`` and ``long_name``."""
        xarray = optional_library("xarray")

        def variable(name: str, values: FloatArray, unit: str) -> tuple[str, FloatArray, Any]:
            return "time", values, {"units": unit, "long_name": long_name(name)}

        data = {name: variable(name, y, self.units[name]) for name, y in self.signals.items()}
        made: Dataset = xarray.Dataset(data, coords={"time": variable("time", self.time, "s")})
        return made
