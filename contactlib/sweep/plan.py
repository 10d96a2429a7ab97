"""All that a worker needs to know of a sweep, but for the values of its runs."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from contactlib import kernel
from contactlib.parameters import FloatArray
from contactlib.scenario import (
    ControllerDesign,
    Scenario,
    ScenarioContents,
    build_scenario,
    build_wheelset,
)
from contactlib.scenario.reading import in_file
from contactlib.sweep.axis import Axis
from contactlib.sweep.target import change
from contactlib.table import CreepForceTable
from contactlib.traction import OpenLoop, TractionController
from contactlib.wheelset import Wheelset

NOBODY = {"open_loop": OpenLoop()}  # where nothing runs


def package_version() -> str:
    """Of contactlib."""
    return version("contactlib")


@dataclass(frozen=True)
class Plan:
    """What is the same for all runs of a sweep. It can be pickled, and names no file.

    Attributes
    ----------
    contents : ScenarioContents
        Scenario and vehicle as their files have them.
    axes : tuple of Axis
        What varies.
    controllers : dict
        By name, designed for the scenario as it is in the file, or designs to be made anew for
        each run. Empty if nothing runs.
    outcomes : tuple of str
        What is asked for.
    noise : str
        ``common`` if all runs have the sensors' noise of index 0 of their seed, ``independent`` if
        each has that of its own index.
    step : float or None
        Of the rows [s].
    tolerance : float
        Of the integrator [1].
    table_axes : tuple of int
        Axes that the law's table depends on.
    tables : dict
        The law's table by the values of those axes.
    package, token : str
        Version of contactlib, and digest of the kernel's sources.
    """

    contents: ScenarioContents
    axes: tuple[Axis, ...]
    controllers: dict[str, TractionController | ControllerDesign]
    outcomes: tuple[str, ...]
    noise: str
    step: float | None
    tolerance: float
    table_axes: tuple[int, ...]
    tables: dict[tuple[float, ...], bytes]
    package: str
    token: str

    def index_of(self, run: int) -> int:
        """Which noise a run has: `index` of `contactlib.run_scenario`."""
        return 0 if self.noise == "common" else run

    def check_machine(self) -> None:
        """Refuse to run where contactlib is another one.

        Raises
        ------
        RuntimeError
            If version or kernel differ from those of the plan.
        """
        here = package_version(), kernel.token()
        if here != (self.package, self.token):
            raise RuntimeError(
                f"a worker has contactlib {here[0]} with kernel {here[1]}, the sweep was planned "
                f"with {self.package} and {self.token}: install the same on all machines"
            )

    def digest(self, values: FloatArray) -> str:
        """Of everything that the results depend on; `values` are those of all runs."""
        known = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        tables = known.pop("tables")
        axes = known.pop("axes")
        known["contents"] = [self.contents.data, self.contents.vehicle]
        known["axes"] = [(axis.name, axis.factor, axis.targets) for axis in axes]
        found = hashlib.sha256(json.dumps(known, sort_keys=True, default=repr).encode())
        for key, table in sorted(tables.items()):
            found.update(repr(key).encode() + table)
        found.update(repr(values.shape).encode() + values.tobytes())
        return found.hexdigest()


class ScenarioBuilder:
    """Builds the scenario of any run of a plan; what does not vary is built once."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._tables = {key: CreepForceTable(data) for key, data in plan.tables.items()}
        sections = {target.section[0] for axis in plan.axes for target in axis.targets}
        self._wheelset: Wheelset | None = None
        if "vehicle" not in sections:
            self._wheelset = self._build_wheelset(plan.contents.vehicle, self._tables.get(()))

    def build(self, row: Sequence[float]) -> Scenario:
        """Scenario of a run with these values of the axes.

        Raises
        ------
        ValueError
            If they are not a valid scenario.
        """
        data, vehicle, changes = self._changes(row)
        wheelset = self._wheelset
        if wheelset is None:
            wheelset = self._build_wheelset(vehicle, self._tables[self.table_key(row)])
        controllers = {
            name: _changed(found, changes.get(name, {}))
            for name, found in self._plan.controllers.items()
        }
        return build_scenario(data, wheelset, controllers or NOBODY)

    def build_table(
        self, row: Sequence[float], progress: Callable[[float], object]
    ) -> CreepForceTable:
        """Table of the law of a run; ValueError as of `build`."""
        _, vehicle, _ = self._changes(row)
        return self._build_wheelset(vehicle, None, progress).element.table

    def table_key(self, row: Sequence[float]) -> tuple[float, ...]:
        """Values that the law's table depends on."""
        return tuple(float(row[i]) for i in self._plan.table_axes)

    def _changes(
        self, row: Sequence[float]
    ) -> tuple[dict[str, Any], dict[str, Any], dict[str, dict[str, float]]]:
        """Contents of scenario and vehicle, and fields of controllers, in a run."""
        contents = self._plan.contents
        data, vehicle = dict(contents.data), dict(contents.vehicle)
        changes: dict[str, dict[str, float]] = {}
        for axis, value in zip(self._plan.axes, row, strict=True):
            for target in axis.targets:
                new: Any = target.scale(value) if axis.factor else value
                where, *section = target.section
                if where == "controllers":
                    changes.setdefault(section[0], {})[target.key] = new
                elif where == "vehicle":
                    change(vehicle, section, target.key, target.index, new)
                else:
                    change(data, target.section, target.key, target.index, new)
        return data, vehicle, changes

    def _build_wheelset(
        self,
        vehicle: Mapping[str, Any],
        table: CreepForceTable | None,
        progress: Callable[[float], object] = lambda part: None,
    ) -> Wheelset:
        with in_file(self._plan.contents.label):
            return build_wheelset(vehicle, table, progress)


def _changed(
    found: TractionController | ControllerDesign, changes: dict[str, float]
) -> TractionController | ControllerDesign:
    """A controller, or the design of one, with other values of some of its fields."""
    if not changes:
        return found
    if isinstance(found, ControllerDesign):
        return dataclasses.replace(found, given={**found.given, **changes})
    changed: TractionController = dataclasses.replace(found, **changes)  # type: ignore[type-var]
    return changed
