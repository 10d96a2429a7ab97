"""Sweep files: a scenario, the axes along which it varies, and the outcomes to report."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from contactlib.base.quantities import Parameters, declared
from contactlib.base.text import known_names
from contactlib.element.force_element import RangeWarning
from contactlib.files.mistakes import Mistakes
from contactlib.files.reading import (
    check_keys,
    file_beside,
    in_file,
    loading,
    model_path,
    parse_text,
    read_section,
    read_value,
    text,
    title,
    toml_text,
)
from contactlib.files.scenario import (
    ControllerDesign,
    ScenarioContents,
    build_scenario,
    check_names,
    read_contents,
    read_controllers,
)
from contactlib.runs.analysis import SWEEP_OUTCOMES, of_runs
from contactlib.runs.outcomes import MISJUDGED
from contactlib.runs.plant import timing
from contactlib.runs.scenario_runs import (
    DEFAULT_TOLERANCE,
    FAILED,
    Metric,
    checked_metrics,
)
from contactlib.runs.sweep.axes import read_axes
from contactlib.runs.sweep.plan import (
    PLACEHOLDER,
    Plan,
    ScenarioBuilder,
    Sweep,
    law_tables,
    table_axes,
)
from contactlib.runs.sweep.sampling import draw, extreme_runs, grid_shape
from contactlib.traction import CONTROLLERS
from contactlib.traction.interface import Controller, checked_controller

Names = tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Source(Parameters):
    """Keys of a sweep file about its scenario.

    Parameters
    ----------
    scenario : str
        A scenario file beside the sweep, below its folder, or shipped.
    controllers : list of str, optional
        Those of the scenario's controllers that run. Default: all.
    redesign : bool, optional
        Whether controllers are designed for each run. By default they are designed for the nominal
        values of the file, because a designer usually does not know the varied ones.
    """

    scenario: str
    controllers: Names | None = None
    redesign: bool = False


OF_SWEEP, OF_PLAN = declared(Sweep), declared(Plan)
KEYS = {
    **{key: OF_SWEEP[key] for key in ("name", "source")},
    **declared(Source),
    "outcomes": OF_PLAN["outcomes"],
    "until_stop": OF_PLAN["until_stop"],
    "limit": OF_SWEEP["limit"],
    **{key: replace(OF_PLAN[key], default=None) for key in ("noise", "step")},
    "tolerance": replace(OF_PLAN["tolerance"], default=DEFAULT_TOLERANCE),
}
NEEDED = [*(key for key, one in KEYS.items() if one.needed), "axes"]


def load_sweep(
    path: str | os.PathLike[str], *, progress: Callable[[float], object] = lambda part: None
) -> Sweep:
    """Read a sweep file and its scenario.

    The values of each axis are checked against the limits of the numbers that they set, and the
    scenarios at the ends of the axes are built, so that errors show before anything runs.

    With ``noise = "common"``, the default of a grid, every run has the sensors' noise of index 0
    of its seed, so that runs differ by their parameters alone; with ``noise = "independent"``, the
    default of random samples, each run has the noise of its index.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a shipped one such as ``"friction_and_load_sweep.toml"``. Its
        scenario lies in its folder or below, or is a shipped one.
    progress : callable, optional
        As for `load_model`.

    Raises
    ------
    ModelError
        If a file is not valid; a line for each mistake names file, axis or key, value
        and limit.
    OSError
        If a file cannot be read.

    Warns
    -----
    InputWarning
        If a number is allowed but implausible for a vehicle.

    Examples
    --------
    >>> sweep = load_sweep("wet_patch_sweep.toml")
    >>> sweep.runs, sweep.shape, list(sweep.plan.controllers)
    (208, (16, 13), ['threshold', 'creep_pi', 'slope_seeking'])
    >>> sweep.describe(5)
    'patch_friction = 0.3, patch_end = 85 m'
    """
    file = model_path(path)
    with loading(path):
        content = toml_text(file.read_bytes())
        return _build_sweep(parse_text(content), content, file, progress)


def _build_sweep(
    data: Mapping[str, Any], content: str, file: Path, progress: Callable[[float], object]
) -> Sweep:
    if "axes" not in data and {"demand", "contact"} & set(data):
        what = "model"
        if "demand" in data:
            what = "scenario, which the command 'contactlib simulate' runs"
        raise ValueError(
            f"is a {what}; a sweep names a scenario and the axes along which it varies"
        )
    scenario_contents: Any = None
    with Mistakes(data) as mistakes:
        of = mistakes.of
        of(check_keys, "", data, [*KEYS, "axes", "sampling"], NEEDED)
        given = {key: of(read_value, key, data[key], KEYS[key]) for key in KEYS if key in data}
        of(title, "name", data.get("name", ""))
        outcomes = of(_names, "outcomes", given.get("outcomes") or (), SWEEP_OUTCOMES)
        sampling = of(_sampling, data.get("sampling", {})) or {}
        grid = sampling.get("kind", "grid") == "grid"
        if given.get("scenario") is not None:
            scenario_contents = of(_read_scenario, given["scenario"], file.parent)
        if scenario_contents and outcomes:
            chosen = of(_controllers, given.get("controllers"), scenario_contents[1], outcomes)
        if scenario_contents and "axes" in data:
            of(partial(read_axes, grid=grid), data["axes"], scenario_contents[0], None)
    contents = scenario_contents[0]
    with Mistakes(data) as mistakes:
        with in_file(f"scenario {data['scenario']}"):
            wheelset = contents.build_vehicle(None, progress)
            scenario = build_scenario(contents.data, wheelset, chosen or PLACEHOLDER)
        controllers: dict[str, Controller | ControllerDesign] = dict(chosen)
        if not given.get("redesign"):
            controllers = {name: scenario.controller(name) for name in chosen}
        axes = read_axes(data["axes"], contents, controllers, grid=grid)
        drawn = [axis.name for axis in axes if axis.spread.kind != "values"]
        if grid and bool(drawn) != bool(sampling["runs"]):
            raise ValueError(
                f"axes.{drawn[0]}: distribution on a grid needs sampling.runs, the number of draws "
                "at each of its points, and sampling.seed"
                if drawn
                else f"sampling.runs = {sampling['runs']} is on a grid the number of draws of axes "
                "with a distribution, and none has one"
            )
        values = draw([axis.spread for axis in axes], **sampling)
        for axis, column in zip(axes, values.T, strict=True):
            mistakes.of(axis.check, np.unique(column))
    if scenario.axles > 1 and of_runs(outcomes):
        outcomes = tuple(dict.fromkeys((*outcomes, MISJUDGED)))
    plan = Plan(
        contents=contents,
        axes=axes,
        controllers=controllers,
        outcomes=outcomes,
        # Common noise keeps maps free of speckle.
        noise=given.get("noise") or ("common" if grid and not drawn else "independent"),
        step=given.get("step"),
        tolerance=given.get("tolerance", DEFAULT_TOLERANCE),
        table_axes=table_axes(axes, contents),
        tables={},
        until_stop=given.get("until_stop", False),
        draws=sampling["runs"] if grid else 0,
    )
    plan = replace(plan, tables=law_tables(plan, values, wheelset.element.table, progress))
    described = data["name"], data["source"], file.stem, content
    kind, seed, limit = sampling["kind"], sampling["seed"], given.get("limit", ())
    points = grid_shape(plan.spreads) if grid else ()
    if len(limit) not in (known := {0, 1, *points[:1], math.prod(points)}):
        raise ValueError(
            f"limit has {len(limit)} entries: it must have {' or '.join(map(str, sorted(known)))}"
        )
    sweep = Sweep(*described, kind, seed, scenario, plan, values, limit)
    _check_ends(sweep)
    return sweep


def with_own(
    sweep: Sweep,
    controllers: Mapping[str, Controller],
    metrics: Mapping[str, Metric],
    key: str | None = None,
) -> Sweep:
    """Add controllers and metrics of a user's own to a sweep.

    Raises
    ------
    ValueError
        If a name is taken, or an object is not a controller or a metric.
    """
    plan, axes = sweep.plan, sweep.plan.axes
    taken = {*SWEEP_OUTCOMES, "controller", "run", FAILED, *(axis.name for axis in axes)}
    checked_metrics(metrics, taken)
    for name, controller in controllers.items():
        checked_controller(f"controllers[{name!r}]", controller)
        varied = [
            t.path for axis in axes for t in axis.targets if t.section == ("controllers", name)
        ]
        if varied:
            raise ValueError(
                f"controllers[{name!r}]: an axis varies {varied[0]}; take another name"
            )
    every = {**plan.controllers, **controllers}
    check_names(every)
    if controllers and not (metrics or of_runs(plan.outcomes)):
        raise ValueError("no controller runs, as all outcomes come from the analysis: add metrics")
    if metrics and not every:
        raise ValueError("metrics: no controller runs in this sweep: pass controllers")
    if not controllers and not metrics:
        return sweep
    plan = replace(plan, controllers=every, metrics=metrics, key=key)
    scenario = replace(sweep.scenario, controllers=every)
    made = replace(sweep, plan=plan, scenario=scenario)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RangeWarning)  # shown when the sweep was read
        _check_ends(made)
    return made


def _read_scenario(file: str, folder: Path) -> tuple[ScenarioContents, dict[str, ControllerDesign]]:
    with in_file(f"scenario {file}"):
        contents = read_contents(file_beside("scenario", file, folder, "the sweep"))
        return contents, read_controllers(contents.data["controllers"])


def _sampling(section: object) -> dict[str, Any]:
    """Kind, number of runs and seed."""
    keys = declared(draw)
    given = {"kind": keys["kind"].default, **read_section("sampling", keys, section)}
    drawn = given["kind"] != "grid" or "runs" in given or "seed" in given
    check_keys("sampling.", given, ["kind", "runs", "seed"], ["runs", "seed"] if drawn else [])
    return {**given, **{key: int(given.get(key, 0)) for key in ("runs", "seed")}}


def _check_ends(sweep: Sweep) -> None:
    """Build the scenarios at the ends of the axes; issue one warning for all of them."""
    ends = extreme_runs(sweep.kind, sweep.plan.spreads, sweep.values)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RangeWarning)
        for run in ends:
            with in_file(f"run {run} ({sweep.describe(run)})"):
                # Without a shared cache, as scenarios that share their vehicle warn only once.
                scenario = ScenarioBuilder(sweep.plan).build(sweep.values[run].tolist())
                for name in sweep.plan.controllers:
                    sample_time = scenario.controller(name).sample_time
                    timing(scenario, sample_time, sweep.plan.step_of(scenario))
    messages = [w.message for w in caught if isinstance(w.message, RangeWarning)]
    if messages:
        warnings.warn(
            f"{len(messages)} of {len(ends)} runs at the ends of the axes: {messages[0]}",
            type(messages[0]),
            stacklevel=4,
        )


def _names(what: str, names: Names, known: Collection[str]) -> Names:
    for name in names:
        if text(what, name) not in known:
            raise ValueError(f"{what}: {name!r} is not known; {known_names(name, known)}")
    if len(set(names)) < len(names):
        raise ValueError(f"{what} = {list(names)!r} has a name twice")
    return names


def _controllers(
    names: Names | None, designs: Mapping[str, ControllerDesign], outcomes: Names
) -> dict[str, ControllerDesign]:
    """Designs of the controllers that run. Default: all sampled controllers of the scenario."""
    if not of_runs(outcomes):
        if names is not None:
            raise ValueError(
                "no controller runs, as all outcomes come from the analysis of the wheelset"
            )
        return {}
    sampled = {name: design for name, design in designs.items() if design.kind in CONTROLLERS}
    return {name: sampled[name] for name in _names("controllers", names or (), sampled) or sampled}
