"""Sweep files: a scenario, what varies in it, and what to report."""

from __future__ import annotations

import difflib
import os
import re
import tomllib
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from contactlib import kernel
from contactlib.element import ProcessZoneWarning
from contactlib.fleet import timing
from contactlib.parameters import FloatArray, Quantity
from contactlib.scenario import (
    ControllerDesign,
    Scenario,
    ScenarioContents,
    build_scenario,
    model_path,
    read_contents,
)
from contactlib.scenario.contact_sections import TABLE_KEYS
from contactlib.scenario.controllers import read_controllers
from contactlib.scenario.reading import check_keys, in_file, number, subsection, text
from contactlib.scenario.vehicle import file_beside
from contactlib.sweep.axis import Axis, read_axis, whole
from contactlib.sweep.outcomes import OUTCOMES, of_runs
from contactlib.sweep.plan import NOBODY, Plan, ScenarioBuilder, package_version
from contactlib.sweep.sampling import KINDS, MOST_RUNS, draw, extreme_runs, grid_shape
from contactlib.sweep.target import Target
from contactlib.table import CreepForceTable
from contactlib.traction import TractionController

NEEDED = ("name", "source", "scenario", "outcomes", "axes")
OPTIONAL = ("controllers", "sampling", "redesign", "step", "tolerance")
TAKEN = ("controller", "run", "failed")  # names of what else a dataset has
STEP = Quantity("s", above=0.0)
TOLERANCE = Quantity("1", at_least=1e-12, at_most=1e-2)
DEFAULT_TOLERANCE = 1e-6
MOST_TABLES = 64  # of the law; a cohesive one takes half a minute


@dataclass(frozen=True)
class Sweep:
    """Many runs that differ in some parameters.

    Attributes
    ----------
    name, source : str
        What it is, and where its numbers come from.
    stem : str
        Of the sweep's file, and so of the results'.
    text : str
        The file.
    kind : str
        ``grid``, ``latin_hypercube`` or ``monte_carlo``.
    seed : int
        Of the two random kinds.
    scenario : Scenario
        As its file has it.
    plan : Plan
        What is the same for all runs.
    values : ndarray
        Of the axes in each run, shape (runs, axes), in SI units.
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

    @property
    def runs(self) -> int:
        """Number of runs under each controller."""
        return len(self.values)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the outcomes: of the grid, or the number of runs."""
        return grid_shape(self.plan.axes) if self.kind == "grid" else (self.runs,)

    @property
    def simulated_time(self) -> float:
        """Of all runs together [s]; zero if nothing runs."""
        if not self.plan.controllers:
            return 0.0
        each = np.full(self.runs, self.scenario.duration)
        for axis, column in zip(self.plan.axes, self.values.T, strict=True):
            if "run.duration" in [target.path for target in axis.targets]:
                each = each * column if axis.factor else column
        return len(self.plan.controllers) * float(each.sum())

    @property
    def summary(self) -> str:
        """What is to be done, in words."""
        names = ", ".join(self.plan.controllers)
        what = f" of {self.scenario.duration:g} s under each of {names}" if names else ""
        return f"{self.runs} runs{what}"

    def describe(self, run: int) -> str:
        """Values of the axes in a run, in words."""
        axes = self.plan.axes
        return ", ".join(
            f"{axis.name} = {value:.6g}{'' if axis.unit == '1' else ' ' + axis.unit}"
            for axis, value in zip(axes, self.values[run], strict=True)
        )


def load_sweep(
    path: str | os.PathLike[str], *, progress: Callable[[float], object] = lambda part: None
) -> Sweep:
    """Read a sweep file, and the scenario that it names.

    Each axis's values are held against the limits of what it sets, and the scenarios at the ends
    of the axes are built, so that what is wrong is said before anything runs.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a shipped one such as ``"friction_and_load_sweep.toml"``.
    progress : callable, optional
        Is told what part of the law's table has been built, which the cohesive law needs.

    Raises
    ------
    ModelError
        If a file is not valid; one line names file, axis or key, value and limit.
    OSError
        If a file cannot be read.
    """
    file = model_path(path)
    with in_file(path):
        content = file.read_bytes().decode()
        return _build_sweep(tomllib.loads(content), content, file, progress)


def _build_sweep(
    data: Mapping[str, Any], content: str, file: Path, progress: Callable[[float], object]
) -> Sweep:
    if "axes" not in data and {"vehicle", "contact"} & set(data):
        what = "scenario" if "vehicle" in data else "model"
        raise ValueError(
            f"is a {what}, not a sweep: the command 'contactlib simulate' runs it; a sweep names "
            "a scenario and the axes along which it varies"
        )
    check_keys("", data, [*NEEDED, *OPTIONAL], NEEDED)
    name, source = (text(key, data[key]) for key in ("name", "source"))
    outcomes = _names("outcomes", data["outcomes"], OUTCOMES)
    redesign = data.get("redesign", False)
    if not isinstance(redesign, bool):
        raise ValueError(f"redesign = {redesign!r} must be true or false")
    scenario_file = text("scenario", data["scenario"])
    with in_file(f"scenario {scenario_file}"):
        contents = read_contents(file_beside("scenario", scenario_file, file.parent, "the sweep"))
        designs = read_controllers(contents.data["controllers"])
    chosen = _controllers(data, designs, outcomes)
    with in_file(f"scenario {scenario_file}"):
        wheelset = contents.build_vehicle(None, progress)
        scenario = build_scenario(contents.data, wheelset, chosen or NOBODY)
    controllers: dict[str, TractionController | ControllerDesign] = {
        name: chosen[name] if redesign else scenario.controller(name) for name in chosen
    }
    kind, runs, seed = _sampling(data.get("sampling", {}))
    axes = tuple(_axes(data["axes"], contents, controllers, grid=kind == "grid"))
    values = draw(kind, axes, runs, seed)
    for axis, column in zip(axes, values.T, strict=True):
        with in_file(f"axes.{axis.name}"):
            axis.check(np.unique(column))
    plan = Plan(
        contents=contents,
        axes=axes,
        controllers=controllers,
        outcomes=outcomes,
        step=number("step", data["step"], STEP) if "step" in data else None,
        tolerance=number("tolerance", data.get("tolerance", DEFAULT_TOLERANCE), TOLERANCE),
        table_axes=_table_axes(axes, contents),
        tables={},
        package=package_version(),
        token=kernel.token(),
    )
    plan = replace(plan, tables=_tables(plan, values, wheelset.element.table, progress))
    sweep = Sweep(name, source, file.stem, content, kind, seed, scenario, plan, values)
    _check_ends(sweep)
    return sweep


def _check_ends(sweep: Sweep) -> None:
    """Build the scenarios at the ends of the axes; what several of them warn of is said once."""
    builder = ScenarioBuilder(sweep.plan)
    ends = extreme_runs(sweep.kind, sweep.plan.axes, sweep.values)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ProcessZoneWarning)
        for run in ends:
            with in_file(f"run {run} ({sweep.describe(run)})"):
                scenario = builder.build(sweep.values[run].tolist())
                for name in sweep.plan.controllers:
                    timing(scenario, scenario.controller(name), sweep.plan.step)
    found = [w.message for w in caught if isinstance(w.message, ProcessZoneWarning)]
    if found:
        warnings.warn(
            f"{len(found)} of {len(ends)} runs at the ends of the axes: {found[0]}",
            ProcessZoneWarning,
            stacklevel=4,
        )


def _names(what: str, found: object, known: Collection[str]) -> tuple[str, ...]:
    if not isinstance(found, list) or not found:
        raise ValueError(f"{what} = {found!r} must be a list of at least one name")
    names = tuple(text(what, name) for name in found)
    for name in names:
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            meant = f"did you mean {close[0]!r}? " if close else ""
            raise ValueError(f"{what}: {name!r} is not known; {meant}known: {', '.join(known)}")
    if len(set(names)) < len(names):
        raise ValueError(f"{what} = {found!r} has a name twice")
    return names


def _controllers(
    data: Mapping[str, Any], designs: Mapping[str, ControllerDesign], outcomes: Sequence[str]
) -> dict[str, ControllerDesign]:
    """Designs of the controllers that run: all of the scenario's if the sweep names none."""
    if not of_runs(outcomes):
        if "controllers" in data:
            raise ValueError(
                "controllers: none runs, as all outcomes are of the analysis of the wheelset"
            )
        return {}
    if "controllers" not in data:
        return dict(designs)
    return {name: designs[name] for name in _names("controllers", data["controllers"], designs)}


def _sampling(section: object) -> tuple[str, int, int]:
    """Kind, number of runs and seed."""
    table = subsection("sampling", section)
    kind = text("sampling.kind", table.get("kind", "grid"))
    if kind not in KINDS:
        raise ValueError(f"sampling.kind = {kind!r} must be one of: {', '.join(KINDS)}")
    if kind == "grid":
        check_keys("sampling.", table, ["kind"], [])
        return kind, 0, 0
    check_keys("sampling.", table, ["kind", "runs", "seed"], ["runs", "seed"])
    runs = whole("sampling.runs", table["runs"], 1, MOST_RUNS)
    return kind, runs, whole("sampling.seed", table["seed"], 0, 2**53)


def _axes(
    sections: object,
    contents: ScenarioContents,
    controllers: Mapping[str, TractionController | ControllerDesign],
    *,
    grid: bool,
) -> Iterator[Axis]:
    table = subsection("axes", sections)
    if not table:
        raise ValueError("axes: give at least one, [axes.NAME]")
    owner: dict[tuple[Any, ...], str] = {}
    for name, section in table.items():
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", name) or name in (*TAKEN, *OUTCOMES):
            raise ValueError(
                f"axes.{name!r} is not a name for an axis: it must be of 1 to 64 ASCII letters, "
                "digits and _, begin with a letter, and not be that of an outcome"
            )
        with in_file(f"axes.{name}"):
            axis = read_axis(name, section, contents, grid=grid)
            targets = tuple(_of_controllers(t, controllers, axis.factor) for t in axis.targets)
            for target in targets:
                for index in (
                    range(len(target.base or (0,))) if target.whole_list else [target.index]
                ):
                    place = (target.section, target.key, index)
                    if place in owner:
                        raise ValueError(f"{target.path} is set by axes.{owner[place]} already")
                    owner[place] = name
        yield replace(axis, targets=targets)


def _of_controllers(
    target: Target,
    controllers: Mapping[str, TractionController | ControllerDesign],
    factor: bool,
) -> Target:
    """The target; in a controller that runs, with the number that was designed."""
    if target.section[0] != "controllers":
        return target
    name = target.section[1]
    if name not in controllers:
        raise ValueError(f"{target.path}: the controller {name} does not run in this sweep")
    controller = controllers[name]
    if not isinstance(controller, ControllerDesign):
        designed = getattr(controller, target.key)
        target = replace(target, base=None if designed is None else (float(designed),))
    if factor and target.base is None:
        raise ValueError(f"{target.path}: nothing gives the number that the factor is on")
    return target


def _table_axes(axes: Sequence[Axis], contents: ScenarioContents) -> tuple[int, ...]:
    """Axes that change the law's table."""
    law = contents.vehicle.get("law", {}).get("kind", "carter_griffith")
    keys = {("vehicle", *key.split(".")) for key in TABLE_KEYS[law]}
    return tuple(
        i for i, axis in enumerate(axes) if keys & {(*t.section, t.key) for t in axis.targets}
    )


def _tables(
    plan: Plan, values: FloatArray, base: CreepForceTable, progress: Callable[[float], object]
) -> dict[tuple[float, ...], bytes]:
    """The law's table for all values of the axes that it depends on."""
    if not plan.table_axes:
        return {(): base.data}
    columns = values[:, plan.table_axes]
    needed, where = np.unique(columns, axis=0, return_index=True)
    if len(needed) > MOST_TABLES:
        names = " and ".join(f"axes.{plan.axes[i].name}" for i in plan.table_axes)
        raise ValueError(
            f"{names}: each of {len(needed)} values needs a table of the law of its own, which is "
            f"built first: at most {MOST_TABLES}, on a grid or from values = [...]"
        )
    builder, tables = ScenarioBuilder(plan), {}
    for done, run in enumerate(where):

        def part(of_one: float, done: int = done) -> None:
            progress((done + of_one) / len(where))

        with in_file(f"run {run}"):
            table = builder.build_table(values[run].tolist(), part)
        tables[builder.table_key(values[run].tolist())] = table.data
    return tables
