"""All that a worker needs to know of a sweep, but for the values of its runs."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
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
from contactlib.scenario.kept import Kept
from contactlib.scenario.reading import in_file
from contactlib.sweep.axis import Axis
from contactlib.sweep.target import Target, change
from contactlib.table import CreepForceTable
from contactlib.traction import OpenLoop, TractionController
from contactlib.wheelset import Wheelset

NOBODY = {"open_loop": OpenLoop()}  # where nothing runs


def package_version() -> str:
    """Of contactlib."""
    return version("contactlib")


def made_with(package: object, token: object) -> str:
    """Which contactlib has made something, in words."""
    return f"contactlib {package} with kernel {token}"


@dataclass(frozen=True)
class Plan:
    """What is the same for all runs of a sweep. It can be pickled, and no run reads a file.

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

    @property
    def made_with(self) -> str:
        """Which contactlib made the plan, in words."""
        return made_with(self.package, self.token)

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
                f"a worker has {made_with(*here)}, the sweep was planned with {self.made_with}: "
                "install the same on all machines"
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
    """Builds the scenario of any run; each shares what is the same with the one before it."""

    def __init__(self, plan: Plan) -> None:
        self._plan, self._kept = plan, Kept()
        self._tables: dict[tuple[float, ...], CreepForceTable] = {}
        self._changed: dict[tuple[str, ...], list[tuple[int, Target]]] = {}
        for i, axis in enumerate(plan.axes):
            for target in axis.targets:
                self._changed.setdefault(target.section, []).append((i, target))

    def build(self, row: Sequence[float]) -> Scenario:
        """Scenario of a run with these values of the axes.

        Raises
        ------
        ValueError
            If they are not a valid scenario.
        """
        data, vehicle, controllers = self._contents(row)
        key = self.table_key(row)
        if key not in self._tables:
            self._tables[key] = CreepForceTable(self._plan.tables[key])
        wheelset = self._kept("vehicle", self._wheelset, vehicle, self._tables[key])
        return build_scenario(data, wheelset, controllers or NOBODY, self._kept)

    def build_table(
        self, row: Sequence[float], progress: Callable[[float], object]
    ) -> CreepForceTable:
        """Table of the law of a run; ValueError as of `build`."""
        _, vehicle, _ = self._contents(row)
        with in_file(self._plan.contents.label):
            folder = Path(self._plan.contents.folder)
            return build_wheelset(vehicle, folder, None, progress).element.table

    def table_key(self, row: Sequence[float]) -> tuple[float, ...]:
        """Values that the law's table depends on."""
        return tuple(float(row[i]) for i in self._plan.table_axes)

    def _contents(
        self, row: Sequence[float]
    ) -> tuple[dict[str, Any], dict[str, Any], dict[str, TractionController | ControllerDesign]]:
        """Contents of scenario and vehicle, and the controllers, in a run."""
        plan = self._plan
        data, vehicle = plan.contents.data, plan.contents.vehicle
        controllers = dict(plan.controllers)
        for section, changes in self._changed.items():
            values = [row[i] for i, _ in changes]
            made: Any = self._kept(section, self._section, section, *values)
            if section[0] == "controllers":
                controllers[section[1]] = made
            elif section[0] == "vehicle":
                vehicle = {**vehicle, section[1]: made}
            else:
                data = {**data, section[0]: made}
        return data, vehicle, controllers

    def _wheelset(self, vehicle: dict[str, Any], table: CreepForceTable) -> Wheelset:
        with in_file(self._plan.contents.label):
            folder = Path(self._plan.contents.folder)
            return build_wheelset(vehicle, folder, table, lambda part: None, self._kept)

    def _section(
        self, section: tuple[str, ...], *values: float
    ) -> dict[str, Any] | TractionController | ControllerDesign:
        """A section of a file, or a controller, with the values of its axes."""
        plan, changes = self._plan, self._changed[section]
        new = [
            (target, target.scale(value) if plan.axes[i].factor else value)
            for (i, target), value in zip(changes, values, strict=True)
        ]
        if section[0] == "controllers":
            fields = {target.key: value for target, value in new}
            return _changed(plan.controllers[section[1]], fields)
        of_vehicle = section[0] == "vehicle"
        contents = plan.contents.vehicle if of_vehicle else plan.contents.data
        table = dict(contents.get(section[-1], {}))
        for target, value in new:
            change(table, target, value)
        return table


def _changed(
    found: TractionController | ControllerDesign, changes: dict[str, Any]
) -> TractionController | ControllerDesign:
    """A controller, or the design of one, with other values of some of its fields."""
    if isinstance(found, ControllerDesign):
        return dataclasses.replace(found, given={**found.given, **changes})
    changed: TractionController = dataclasses.replace(found, **changes)  # type: ignore[type-var]
    return changed
