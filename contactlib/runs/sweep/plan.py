"""A sweep as read: the plan common to all runs, the values of each, scenarios and law tables."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import json
import pickle
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray, Parameters, Quantity
from contactlib.base.text import version
from contactlib.files.model import BuildCache, build_wheelset
from contactlib.files.reading import in_file
from contactlib.files.scenario import ControllerDesign, Scenario, ScenarioContents, build_scenario
from contactlib.files.sections import LAWS
from contactlib.runs.analysis import ANALYSES
from contactlib.runs.plant import TOLERANCE, common_step, default_step
from contactlib.runs.scenario_runs import FAILED, LONGEST_STEP, Metric
from contactlib.runs.sweep.axes import Axis, Target
from contactlib.runs.sweep.sampling import Spread, grid_shape
from contactlib.table.creep_force_table import CreepForceTable
from contactlib.traction import OpenLoop
from contactlib.traction.interface import Controller
from contactlib.vehicle.wheelset import Wheelset

PLACEHOLDER = {"open_loop": OpenLoop()}  # for scenarios that are only analysed
DIGESTED = "outcomes", "noise", "step", "tolerance", "until_stop"
MAX_TABLES = 64  # building a cohesive one takes several seconds


def this_contactlib() -> str:
    """Version of contactlib and digest of the kernel's sources, in words."""
    return f"contactlib {version()} with kernel {kernel.token()}"


@dataclass(frozen=True)
class Plan:
    """Everything that the runs of a sweep have in common.

    A plan can be pickled, and running it reads no file.

    Attributes
    ----------
    contents : ScenarioContents
        Contents of scenario and vehicle file.
    axes : tuple of Axis
        Axes along which runs vary.
    controllers : dict
        Controllers by name, designed for the scenario of the file, or designs that each run
        designs again. Empty if none runs.
    outcomes : tuple of str
        Outcomes to report, from the tables below.
    noise : str
        ``common`` if all runs have the sensors' noise of index 0 of their seed, so that they differ
        by their parameters alone, ``independent`` if each has the noise of its index, or of its
        draw on a grid. A file's default: common on a grid without draws.
    step : float or None
        Longest time between rows [s]. Default: 10 ms, or less: a twentieth of the axle's vibration
        period, a tenth of the shortest period of the dynamic load. It is shortened to a fraction
        that the sample times of all controllers have in common, so that the rows of all are equally
        far apart.
    tolerance : float
        Relative error of each of the integrator's substeps [1].
    table_axes : tuple of int
        Axes on which the law's table depends.
    tables : dict
        The law's table by the values of those axes.
    until_stop : bool, optional
        Whether a run ends when its vehicle has stopped, as for `contactlib.run_many`.
    draws : int
        Number of draws at each point of a grid; 0 of any other sweep.
    made_with : str
        Version of contactlib, and digest of the kernel's sources, in words.
    metrics : mapping
        Outcomes of the user's own by name: functions of a `Result`.
    key : str or None
        The user's name for the version of own controllers and metrics.
    """

    contents: ScenarioContents
    axes: tuple[Axis, ...]
    controllers: dict[str, Controller | ControllerDesign]
    outcomes: tuple[str, ...]
    noise: Literal["common", "independent"]
    step: Annotated[float | None, Quantity("s", above=0.0)]
    tolerance: Annotated[float, TOLERANCE]
    table_axes: tuple[int, ...]
    tables: dict[tuple[float, ...], bytes]
    until_stop: bool = False
    draws: int = 0
    made_with: str = dataclasses.field(default_factory=this_contactlib)
    metrics: Mapping[str, Metric] = dataclasses.field(default_factory=dict)
    key: str | None = None

    @property
    def spreads(self) -> list[Spread]:
        """Distribution of each axis's values."""
        return [axis.spread for axis in self.axes]

    def index_of(self, run: int) -> int:
        """Index of a run's noise, for `contactlib.run_scenario`."""
        return 0 if self.noise == "common" else run % self.draws if self.draws else run

    def step_of(self, scenario: Scenario) -> float:
        """Time between the rows of a run [s], for `contactlib.run_scenario`.

        It is the same under all of the sweep's controllers, so that metrics can be compared.
        """
        longest = default_step(scenario, LONGEST_STEP) if self.step is None else self.step
        times = [scenario.controller(name).sample_time for name in self.controllers]
        return common_step(longest, times)

    def settings_of(self, run: int, scenario: Scenario) -> dict[str, Any]:
        """Keyword arguments with which `contactlib.run_scenario` repeats a run to the last bit."""
        return {
            "index": self.index_of(run),
            "step": self.step_of(scenario),
            "tolerance": self.tolerance,
            "until_stop": self.until_stop,
        }

    def check_machine(self) -> None:
        """Raise a RuntimeError if this is not the contactlib that made the plan."""
        if (here := this_contactlib()) != self.made_with:
            raise RuntimeError(
                f"a worker has {here}, the sweep was planned with {self.made_with}: "
                "install the same on all machines"
            )

    @property
    def rows(self) -> dict[str, slice]:
        """Rows of each result among the numbers of a run: one for each controller that runs.

        Outcomes of the analysis, for which none runs, have one.
        """
        slices: dict[str, slice] = {}
        end = 0
        for name in (*self.outcomes, *self.metrics, FAILED):
            count = 1 if name in ANALYSES else max(1, len(self.controllers))
            slices[name] = slice(end, end := end + count)
        return slices

    def digest(self, values: FloatArray) -> str:
        """Digest of each part on which results depend, as JSON; `values` are those of all runs."""
        parts: dict[str, object] = {
            "scenario": self.contents.data,
            "vehicle": self.contents.vehicle,
            "values": hashlib.sha256(np.ascontiguousarray(values).data).digest(),
            **{f"axis {axis.name}": (axis.factor, axis.targets, axis.spread) for axis in self.axes},
            "controllers": list(self.controllers),
            "tables": sorted(self.tables.items()),
            **{name: getattr(self, name) for name in DIGESTED},
            **{
                f"controller {name}": self._identity(controller)
                for name, controller in self.controllers.items()
            },
            **{f"metric {name}": self._identity(metric) for name, metric in self.metrics.items()},
        }
        digests = {
            name: hashlib.sha256(repr(part).encode()).hexdigest() for name, part in parts.items()
        }
        return json.dumps({"contactlib": self.made_with, **digests})

    def _identity(self, user_object: Controller | ControllerDesign | Metric) -> object:
        """Identity of a controller or a metric: the key for the user's own.

        Without a key, its numbers and the text of the file that defines it; what has none, such as
        a function of a notebook, is never the same.
        """
        if type(user_object).__module__.startswith("contactlib."):
            return repr(user_object)
        if self.key is not None:
            return self.key
        try:
            own: Any = user_object.func if isinstance(user_object, partial) else user_object
            defined = own if inspect.isfunction(own) else type(own)
            return pickle.dumps(user_object), Path(inspect.getfile(defined)).read_bytes()
        except Exception:  # pickle raises anything
            return secrets.token_hex()


class ScenarioBuilder:
    """Builds the scenario of any run, reusing the unchanged parts of the one before."""

    def __init__(self, plan: Plan) -> None:
        self._plan, self._cache = plan, BuildCache()
        self._tables: dict[tuple[float, ...], CreepForceTable] = {}
        self._changed: dict[tuple[str, str], list[tuple[int, Target]]] = {}
        for i, axis in enumerate(plan.axes):
            for target in axis.targets:
                self._changed.setdefault(target.section, []).append((i, target))

    def build(self, row: Sequence[float]) -> Scenario:
        """Build the scenario of a run from the values of its axes.

        Raises
        ------
        ValueError
            If the values do not give a valid scenario.
        """
        contents, key = self._contents(row), self.table_key(row)
        if key not in self._tables:
            self._tables[key] = CreepForceTable(self._plan.tables[key])
        wheelset = self._cache("vehicle", self._wheelset, contents["vehicle"], self._tables[key])
        controllers = contents["controllers"] or PLACEHOLDER
        return build_scenario(contents[""], wheelset, controllers, self._cache)

    def build_table(
        self, row: Sequence[float], progress: Callable[[float], object]
    ) -> CreepForceTable:
        """Build the law's table of a run; ValueError as for `build`."""
        return self._wheelset(self._contents(row)["vehicle"], None, progress).element.table

    def table_key(self, row: Sequence[float]) -> tuple[float, ...]:
        """Values of the axes on which the law's table depends."""
        return tuple(float(row[i]) for i in self._plan.table_axes)

    def _wheelset(
        self,
        vehicle: dict[str, Any],
        table: CreepForceTable | None,
        progress: Callable[[float], object] = lambda part: None,
    ) -> Wheelset:
        contents = self._plan.contents
        with in_file(contents.label):
            return build_wheelset(vehicle, Path(contents.folder), table, progress, self._cache)

    def _contents(self, row: Sequence[float]) -> dict[str, dict[str, Any]]:
        """Contents of scenario and vehicle, and controllers, of a run: as a target's section."""
        plan = self._plan
        contents = plan.contents
        changed = {"": contents.data, "vehicle": contents.vehicle, "controllers": plan.controllers}
        for section, changes in self._changed.items():
            where, name = section
            values = [row[i] for i, _ in changes]
            made = self._cache(section, self._section, section, changed[where].get(name), *values)
            changed[where] = {**changed[where], name: made}
        return changed

    def _section(self, section: tuple[str, str], known: Any, *values: float) -> Any:
        """Section of a file, or controller, with the values of its axes."""
        of_controller = section[0] == "controllers"
        table = {} if of_controller else dict(known or {})
        for (i, target), value in zip(self._changed[section], values, strict=True):
            target.put(table, value, factor=self._plan.axes[i].factor)
        if isinstance(known, ControllerDesign):
            return dataclasses.replace(known, given={**known.given, **table})
        return dataclasses.replace(known, **table) if of_controller else table


def _same(left: object, right: object) -> bool:
    """Whether these are one object, or equal parameters."""
    comparable = type(left) is type(right) and isinstance(left, Parameters | ControllerDesign)
    return left is right or (comparable and left == right)


@dataclass(frozen=True)
class Sweep:
    """Many runs that differ in some parameters.

    Attributes
    ----------
    name : str
        Title, in one line.
    source : str
        Source of the numbers.
    stem : str
        Name of the sweep file without its suffix, which the results share.
    text : str
        Text of the sweep file.
    kind : str
        ``grid``, ``latin_hypercube`` or ``monte_carlo``.
    seed : int
        Seed of a random sample.
    scenario : Scenario
        The scenario of the file.
    plan : Plan
        Everything that the runs have in common.
    values : ndarray
        Values of the axes in each run, shape (runs, axes), in SI units.
    limit : tuple of float, optional
        Stopping distance that no stop should exceed [m]: one for all, for each value of the first
        axis or for each point of the grid. `contactlib stops` gives the share that does.
    """

    name: str
    source: str
    stem: str
    text: str
    kind: str
    seed: int
    scenario: Scenario
    plan: Plan
    values: FloatArray
    limit: Annotated[tuple[float, ...], Quantity("m", above=0.0)] = ()

    def __post_init__(self) -> None:
        for name, controller in self.scenario.controllers.items():
            planned: object = (self.plan.controllers or PLACEHOLDER).get(name)
            if not any(
                _same(planned, expected)
                for expected in (controller, self.scenario.controller(name))
            ):
                raise ValueError(
                    f"scenario: the sweep's plan does not run this controllers.{name}: pass it to "
                    f"ensemble(sweep, controllers={{{name!r}: ...}}) instead"
                )

    def scenario_of(self, run: int) -> Scenario:
        """Build the scenario of a run, with its controllers in the sweep.

        `contactlib.run_scenario` repeats the run under one of them with
        ``**sweep.plan.settings_of(run, scenario)``.

        Raises
        ------
        IndexError
            If there is no such run.
        ValueError
            If its parameters do not give a valid scenario.
        """
        return self._builder.build(self.values[range(self.runs)[run]].tolist())

    @cached_property
    def _builder(self) -> ScenarioBuilder:
        return ScenarioBuilder(self.plan)

    @property
    def runs(self) -> int:
        """Number of runs under each controller."""
        return len(self.values)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the outcomes: that of the grid, with its draws last, or the number of runs."""
        if self.kind != "grid":
            return (self.runs,)
        return (*grid_shape(self.plan.spreads), *([self.plan.draws] if self.plan.draws else []))

    @property
    def simulated_time(self) -> float:
        """Duration of all runs together [s]; zero if no controller runs."""
        if not self.plan.controllers:
            return 0.0
        each = np.full(self.runs, self.scenario.duration)
        for axis, column in zip(self.plan.axes, self.values.T, strict=True):
            if "run.duration" in [target.path for target in axis.targets]:
                each = each * column if axis.factor else column
        return len(self.plan.controllers) * float(each.sum())

    @property
    def summary(self) -> str:
        """Number and duration of the runs, in words."""
        names, runs = ", ".join(self.plan.controllers), self.runs * len(self.plan.controllers)
        what = f" of {self.simulated_time / runs:g} s under each of {names}" if names else ""
        return f"{self.runs} runs{what}"

    def describe(self, run: int) -> str:
        """Values of the axes in a run, in words."""
        axes = self.plan.axes
        return ", ".join(
            f"{axis.name} = {value:.6g}{'' if axis.unit == '1' else ' ' + axis.unit}"
            for axis, value in zip(axes, self.values[run], strict=True)
        )


def table_axes(axes: Sequence[Axis], contents: ScenarioContents) -> tuple[int, ...]:
    """Axes on which the law's table depends."""
    law = contents.vehicle.get("law", {}).get("kind", "carter_griffith")
    keys = {("vehicle", *key.split(".")) for key in LAWS[law].table_keys}
    return tuple(
        i for i, axis in enumerate(axes) if keys & {(*t.section, t.key) for t in axis.targets}
    )


def law_tables(
    plan: Plan, values: FloatArray, base: CreepForceTable, progress: Callable[[float], object]
) -> dict[tuple[float, ...], bytes]:
    """Build the law's table for all values of the axes on which it depends."""
    if not plan.table_axes:
        return {(): base.data}
    columns = values[:, plan.table_axes]
    needed, where = np.unique(columns, axis=0, return_index=True)
    if len(needed) > MAX_TABLES:
        names = " and ".join(f"axes.{plan.axes[i].name}" for i in plan.table_axes)
        raise ValueError(
            f"{names}: each of {len(needed)} values needs its own table of the law, which is built "
            f"first: at most {MAX_TABLES}, on a grid or from values = [...]"
        )
    builder, tables = ScenarioBuilder(plan), {}
    for done, run in enumerate(where):

        def part(of_one: float, done: int = done) -> None:
            progress((done + of_one) / len(where))

        with in_file(f"run {run}"):
            table = builder.build_table(values[run].tolist(), part)
        tables[builder.table_key(values[run].tolist())] = table.data
    return tables
