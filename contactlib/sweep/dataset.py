"""The result of a sweep: a labelled dataset with units, and its NetCDF file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlib.comparison import fixed_width
from contactlib.ensemble_run import FAILED, LONGEST_STEP
from contactlib.files import write_whole
from contactlib.fleet import timing
from contactlib.parameters import FloatArray
from contactlib.scenario import ControllerDesign
from contactlib.sweep.outcomes import OUTCOMES, of_runs
from contactlib.sweep.sweep import Sweep
from contactlib.traction_run import run_scenario

WHEELSET = "wheelset"  # heading of what no controller has to run for

if TYPE_CHECKING:
    from xarray import Dataset


def make_dataset(sweep: Sweep, results: Mapping[str, FloatArray], digest: str) -> Dataset:
    """Dataset of the outcomes of all runs.

    Of a grid the dimensions are the axes in the order of the file, of a sample ``run``; outcomes
    of runs have ``controller`` before them. ``failed`` is one where a run's parameters are not a
    valid scenario or the run could not be done: there the outcomes are nan.
    """
    import xarray

    plan, grid = sweep.plan, sweep.kind == "grid"
    dims = tuple(axis.name for axis in plan.axes) if grid else ("run",)
    coords: dict[str, Any] = {}
    if plan.controllers:
        names = np.array(list(plan.controllers))
        coords["controller"] = ("controller", names, {"long_name": "controller"})
    if not grid:
        described = {"units": "1", "long_name": "index of the run"}
        coords["run"] = ("run", np.arange(sweep.runs, dtype=np.int32), described)
    for axis, column in zip(plan.axes, sweep.values.T, strict=True):
        described = {"units": axis.unit, "long_name": axis.label}
        points = column.reshape(sweep.shape)
        if grid:
            place = tuple(slice(None) if dim == axis.name else 0 for dim in dims)
            coords[axis.name] = (axis.name, points[place], described)
        else:
            coords[axis.name] = ("run", points, described)

    def variable(name: str, described: dict[str, str]) -> tuple[Any, ...]:
        values = results[name]
        if values.ndim == 2:
            shape = (len(plan.controllers), *sweep.shape)
            return ("controller", *dims), values.reshape(shape), described
        return dims, values.reshape(sweep.shape), described

    data = {
        name: variable(
            name, {"units": OUTCOMES[name].unit, "long_name": OUTCOMES[name].description}
        )
        for name in plan.outcomes
    }
    what = "run could not be done" if of_runs(plan.outcomes) else "parameters are not valid"
    data[FAILED] = variable(FAILED, {"units": "1", "long_name": what})
    found = xarray.Dataset(data, coords=coords, attrs=_attributes(sweep, digest))
    found[FAILED] = found[FAILED].astype(np.int8)
    return found


def _attributes(sweep: Sweep, digest: str) -> dict[str, Any]:
    plan, contents = sweep.plan, sweep.plan.contents
    redesign = any(isinstance(c, ControllerDesign) for c in plan.controllers.values())
    return {
        "title": sweep.name,
        "source": sweep.source,
        "sampling": sweep.kind,
        **({} if sweep.kind == "grid" else {"seed": float(sweep.seed)}),
        "step": "default" if plan.step is None else plan.step,
        "tolerance": plan.tolerance,
        "redesign": str(redesign).lower(),  # NetCDF knows no truth values
        "noise": sweep.plan.noise,
        "contactlib_version": plan.package,
        "kernel_token": plan.token,
        "plan_digest": digest,
        "sweep_file": sweep.text,
        "scenario": json.dumps(contents.data),
        "vehicle": json.dumps(contents.vehicle),
        "controllers": json.dumps({name: repr(c) for name, c in plan.controllers.items()}),
    }


def report(sweep: Sweep, dataset: Dataset) -> list[str]:
    """Lines on the outcomes: median and range of each, and how many runs failed, as a table."""
    lines = []
    failed = dataset[FAILED].values.reshape(-1, sweep.runs) == 1
    if failed.any():
        lines.append(_first_failure(sweep, dataset))
    analysed = len(of_runs(sweep.plan.outcomes)) < len(sweep.plan.outcomes)
    last = [WHEELSET] if analysed else []
    names = list(sweep.plan.controllers)
    rows = [["outcome", "unit", *names, *last]]
    for name in sweep.plan.outcomes:
        found = dataset[name]
        driven = "controller" in found.dims
        # What was analysed failed where no controller could run either.
        fails = failed if driven else failed.all(axis=0, keepdims=True)
        values = found.values.reshape(-1, sweep.runs)
        cells = [
            _spread(row[~(bad & np.isnan(row))]) for row, bad in zip(values, fails, strict=True)
        ]
        empty = [""] * (len(last) if driven else len(names))
        cells = [*cells, *empty] if driven else [*empty, *cells]
        rows.append([name.replace("_", " "), found.attrs["units"], *cells])
    counts = [str(int(row.sum())) for row in failed]
    rows.append(["failed", "1", *counts, *([""] if names else []) * len(last)])
    lines.append(f"Median (least, largest) of {sweep.runs} runs but those that failed:")
    return [*lines, *fixed_width(rows).split("\n")]


def _spread(values: FloatArray) -> str:
    """Median and range of an outcome, and how often it is infinite or does not apply."""
    known = values[~np.isnan(values)]
    if known.size == 0:
        return "-"
    middle, low, high = (f"{f(known):.4g}" for f in (np.median, np.min, np.max))
    counts = {"inf": int(np.isinf(known).sum()), "nan": values.size - known.size}
    rest = "".join(f", {count} {what}" for what, count in counts.items() if count)
    return f"{middle} ({low}, {high}){rest}"


def _first_failure(sweep: Sweep, dataset: Dataset) -> str:
    """What the first failed run says if it is tried once more."""
    found = dataset[FAILED].values.reshape(-1, sweep.runs)
    controller, run = (int(i) for i in np.argwhere(found)[0])
    plan, where = sweep.plan, f"run {run} ({sweep.describe(run)})"
    try:
        scenario = sweep.scenario_of(run)
        if plan.controllers:
            name = list(plan.controllers)[controller]
            where += f" under {name}"
            index, step, tolerance = plan.index_of(run), plan.step, plan.tolerance
            when = timing(scenario, scenario.controller(name), step, longest=LONGEST_STEP)
            run_scenario(scenario, name, index=index, step=when.step, tolerance=tolerance)
    except (ValueError, RuntimeError) as error:
        return f"{where}: {error}"
    return f"{where} failed among others, but not alone"


def write_dataset(dataset: Dataset, path: Path) -> Path:
    """Write a NetCDF 3 file, whole or not at all."""
    return write_whole(path, bytes(dataset.to_netcdf(engine="scipy")))


def read_dataset(path: Path) -> Dataset:
    """Read such a file into memory.

    Raises
    ------
    ValueError
        If it is no NetCDF 3 file.
    OSError
        If it cannot be read.
    """
    import xarray

    try:
        with xarray.open_dataset(path, engine="scipy") as dataset:
            return dataset.load()
    except (TypeError, ValueError, EOFError, LookupError, MemoryError):  # what scipy raises
        raise ValueError(
            f"{path} is not a whole NetCDF file: start anew with --restart (restart=True), or "
            "choose another output folder"
        ) from None
