"""Running a sweep from its file to its result: a labelled dataset with units in a NetCDF file."""

from __future__ import annotations

import json
import math
import os
import shutil
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contactlib import kernel
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, InputWarning
from contactlib.base.text import fixed_width, version
from contactlib.base.writing import write_whole
from contactlib.element.force_element import RangeWarning
from contactlib.files.scenario import ControllerDesign
from contactlib.runs.analysis import ANALYSES, SWEEP_OUTCOMES
from contactlib.runs.damage import warn_of_damaged_runs
from contactlib.runs.outcomes import MISJUDGED
from contactlib.runs.scenario_runs import FAILED, Metric, run_many, run_scenario
from contactlib.runs.sweep.execution import (
    Workers,
    default_workers,
    run_chunks,
    thread_workers,
)
from contactlib.runs.sweep.loading import load_sweep, with_own
from contactlib.runs.sweep.plan import ScenarioBuilder, Sweep
from contactlib.runs.sweep.store import OTHERWISE, ChunkStore, another_plan
from contactlib.traction.interface import Controller, OpenLoop
from contactlib.vehicle.track import OFF_MAP

if TYPE_CHECKING:
    from xarray import Dataset

RUN, DRAW = "run", "draw"
WHEELSET = "wheelset"  # column of outcomes of the analysis, for which no controller runs
# A chunk of a few runs costs as much as a chunk of one, and 2048 wheelsets take less than 100 MB; a
# vehicle whose rails vary takes 0.3 MB, and half as many axles are as fast. A core does 15 000
# simulated seconds per second; the longest chunk (simulated time, s) limits the work that a kill
# can cost and the time between signs of progress.
MIN_CHUNK, MAX_CHUNK, MAX_TIME = 64, 2048, 225_000.0
CHUNKS_EACH, ANALYSES_EACH = 2, 8  # chunks for each worker, to balance the load at the end


def make_dataset(sweep: Sweep, results: FloatArray, digest: str) -> Dataset:
    """Make the dataset of the results of all runs, in the rows of `Plan.rows`.

    The dimensions of a grid are the axes in the order of the file, then ``draw`` if any axis has a
    distribution; ``run`` is the index of the run. That of a sample is ``run``;
    outcomes of runs have ``controller`` before them. ``failed`` is one where a run's parameters do
    not give a valid scenario or the run could not be done; there the outcomes are nan.
    """
    xarray = optional_library("xarray")

    plan, grid = sweep.plan, sweep.kind == "grid"
    gridded = [axis.name for axis in plan.axes if grid and axis.spread.kind == "values"]
    drawn = [DRAW] if plan.draws else [] if grid else [RUN]
    dims = (*gridded, *drawn)
    coords: dict[str, Any] = {}
    if plan.controllers:
        names = np.array(list(plan.controllers))
        coords["controller"] = ("controller", names, {"long_name": "controller"})
    if drawn:
        described = {"units": "1", "long_name": "index of the run"}
        coords[RUN] = (dims, np.arange(sweep.runs, dtype=np.int32).reshape(sweep.shape), described)
    for axis, column in zip(plan.axes, sweep.values.T, strict=True):
        described = {"units": axis.unit, "long_name": axis.label}
        if axis.percent:
            described["display_units"] = "%"
        along = [axis.name] if axis.name in gridded else drawn
        place = tuple(slice(None) if [dim] == along else 0 for dim in dims)
        coords[axis.name] = (along, column.reshape(sweep.shape)[place], described)
    what = "run could not be done" if plan.controllers else "parameters are not valid"
    attributes = {
        **{name: SWEEP_OUTCOMES[name].attributes for name in plan.outcomes},
        **{name: _described(name, metric) for name, metric in plan.metrics.items()},
        FAILED: {"units": "1", "long_name": what},
    }
    data = {}
    for name, rows in plan.rows.items():
        driven = bool(plan.controllers) and name not in ANALYSES
        shape = (*((len(plan.controllers),) if driven else ()), *sweep.shape)
        of_all = ("controller", *dims) if driven else dims
        for i, control in enumerate(plan.controllers) if name == MISJUDGED else ():
            if isinstance(sweep.scenario.any_controller(control), OpenLoop):
                results[rows][i] = 0.0  # which makes no use of the speed
        data[name] = (of_all, results[rows].reshape(shape), attributes[name])
    dataset: Dataset = xarray.Dataset(data, coords=coords, attrs=_attributes(sweep, digest))
    dataset[FAILED] = dataset[FAILED].astype(np.int8)
    warn_of_damaged_runs(
        dataset, sweep.simulated_time / (sweep.runs * max(1, len(plan.controllers)))
    )
    return dataset


def _described(name: str, metric: Metric) -> dict[str, str]:
    text = (getattr(metric, "__doc__", None) or name.replace("_", " ")).strip().split("\n")[0]
    return {"units": getattr(metric, "units", ""), "long_name": text.rstrip(".")}


def _attributes(sweep: Sweep, digest: str) -> dict[str, Any]:
    plan, contents = sweep.plan, sweep.plan.contents
    redesign = any(isinstance(c, ControllerDesign) for c in plan.controllers.values())
    return {
        "title": sweep.name,
        "source": sweep.source,
        "sampling": sweep.kind,
        **({"seed": float(sweep.seed)} if sweep.plan.draws or sweep.kind != "grid" else {}),
        "step": "default" if plan.step is None else plan.step,
        "tolerance": plan.tolerance,
        "redesign": str(redesign).lower(),  # NetCDF has no booleans
        "noise": sweep.plan.noise,
        "contactlib_version": version(),
        "kernel_token": kernel.token(),
        "plan_digest": digest,
        "sweep_file": sweep.text,
        "scenario": json.dumps(contents.data),
        "vehicle": json.dumps(contents.vehicle),
        "controllers": json.dumps({name: repr(c) for name, c in plan.controllers.items()}),
    }


def report(sweep: Sweep, dataset: Dataset) -> list[str]:
    """Format the outcomes as a table: median and range of each, and the number of failed runs."""
    failed = dataset[FAILED].values.reshape(-1, sweep.runs) == 1
    analysed = [WHEELSET] if any(name in ANALYSES for name in sweep.plan.outcomes) else []
    names = list(sweep.plan.controllers)
    table = [["outcome", "unit", *names, *analysed]]
    for name in (*sweep.plan.outcomes, *sweep.plan.metrics):
        driven = name not in ANALYSES
        # An outcome of the analysis has failed where the runs of all controllers have.
        fails = failed if driven else failed.all(axis=0, keepdims=True)
        values = dataset[name].values.reshape(-1, sweep.runs)
        cells = [
            _spread(row[~(bad & np.isnan(row))]) for row, bad in zip(values, fails, strict=True)
        ]
        cells = [*cells, *("" for _ in analysed)] if driven else [*("" for _ in names), *cells]
        table.append([name.replace("_", " "), dataset[name].attrs["units"], *cells])
    counts = [str(int(row.sum())) for row in failed]
    table.append(["failed", "1", *counts, *("" for _ in analysed if names)])
    return [
        *(_first_failure(sweep, failed) if failed.any() else ()),
        f"Median (minimum, maximum) of {sweep.runs} runs, without those that failed:",
        *fixed_width(table).split("\n"),
    ]


def _spread(values: FloatArray) -> str:
    """Format median and range of an outcome, and the counts of infinite and missing values."""
    known = values[~np.isnan(values)]
    if known.size == 0:
        return "-"
    middle, low, high = (f"{f(known):.4g}" for f in (np.median, np.min, np.max))
    counts = {"inf": int(np.isinf(known).sum()), "nan": values.size - known.size}
    rest = "".join(f", {count} {what}" for what, count in counts.items() if count)
    return f"{middle} ({low}, {high}){rest}"


def _first_failure(sweep: Sweep, failed: NDArray[np.bool_]) -> Iterator[str]:
    """Repeat the first failed run for its error message."""
    controller, run = (int(i) for i in np.argwhere(failed)[0])
    plan, where = sweep.plan, f"run {run} ({sweep.describe(run)})"
    try:
        scenario = sweep.scenario_of(run)
        if plan.controllers:
            name = list(plan.controllers)[controller]
            where += f" under {name}"
            run_scenario(scenario, name, **plan.settings_of(run, scenario))
    except (ValueError, RuntimeError) as error:
        yield f"{where}: {error}"
    else:
        yield f"{where} failed among others, but not alone"


def write_dataset(dataset: Dataset, path: Path) -> Path:
    """Write a NetCDF 3 file atomically."""
    return write_whole(path, bytes(dataset.to_netcdf(engine="scipy")))


def write_table(dataset: Dataset, path: Path) -> Path:
    """Write a CSV file: a line for each run, below one of names and units."""
    frame = dataset.to_dataframe(dim_order=list(dataset.sizes)).reset_index()
    units = {name: dataset[name].attrs.get("units") for name in frame}
    frame.columns = [f"{name} [{unit}]" if unit else name for name, unit in units.items()]
    return write_whole(path, frame.to_csv(index=False, lineterminator="\n").encode())


def read_dataset(path: Path) -> Dataset:
    """Read a NetCDF 3 file into memory.

    Raises
    ------
    ValueError
        If it is not a NetCDF 3 file.
    OSError
        If it cannot be read.
    """
    xarray = optional_library("xarray")
    try:
        with xarray.open_dataset(path, engine="scipy") as dataset:
            loaded: Dataset = dataset.load()
            return loaded
    except (TypeError, ValueError, EOFError, LookupError, MemoryError):  # what scipy raises
        raise ValueError(f"{path} is not a complete NetCDF file: {OTHERWISE}") from None


def ensemble(
    sweep: Sweep | str | os.PathLike[str],
    *,
    controllers: Mapping[str, Controller] | None = None,
    metrics: Mapping[str, Metric] | None = None,
    executor: Executor | Workers | None = None,
    workers: int | None = None,
    output: str | os.PathLike[str] | None = None,
    key: str | None = None,
    chunk: int | None = None,
    restart: bool = False,
    progress: Callable[[float], object] = lambda part: None,
) -> Dataset:
    """Run a sweep.

    Parameters
    ----------
    sweep : Sweep or path
        A sweep from `load_sweep`, or a sweep file.
    controllers : mapping, optional
        Controllers of your own by name, beside those of the sweep or in place of one. Processes
        and clusters need a class that they can import, from a module or a script;
        ``distributed.Client(address).upload_file("my_module.py")`` sends a module to a cluster.
    metrics : mapping, optional
        Outcomes of your own by name: functions of a `Result` that return one number, nan if it
        does not apply. A metric's unit is the function's attribute `units`, if it has one. The rows
        of a run are equally far apart under all controllers, whatever their sample times: 10 ms, or
        the sweep's `step`, or the longest shorter fraction that all sample times have in common.
    executor : concurrent.futures.Executor or Workers, optional
        Executor of the chunks, such as ``distributed.Client(address).get_executor()``, or the
        workers that `process_workers` or `cluster_workers` yields. Default: threads. Results do
        not depend on it, to the last bit.
    workers : int, optional
        Number of threads, or of workers of the executor, which gets twice as many chunks at a
        time. Default: one for each processor.
    output : path, optional
        Folder for the NetCDF file and, until it is complete, for finished chunks: if the process is
        killed, the same call resumes; with controllers or metrics of another `key` it raises an
        error. Default: nothing is written.
    key : str, optional
        Name of the version of your controllers and metrics. Default: their numbers and the text of
        the files that define them, but not of what these import; what a notebook defines is never
        the same.
    chunk : int, optional
        Number of runs in a chunk.
    restart : bool, optional
        Whether to discard previous results of this sweep in `output`.
    progress : callable, optional
        Called with the fraction of the runs that is done, from 0 to 1; first with the fraction
        done before.

    Returns
    -------
    xarray.Dataset
        Outcomes and metrics with the dimensions (controller, axis, ...) of a grid or (controller,
        run) of a sample; every variable and coordinate has ``units`` and ``long_name``.

    Raises
    ------
    ModelError
        If a file is not valid.
    ValueError
        If the folder has results of another plan, a number is out of range, or a controller or
        metric is invalid, or returns what it must not.
    RuntimeError
        If a worker died, a controller or metric raises an error, or another process is running the
        sweep to the same folder.
    OSError
        If a file cannot be read or written.
    ImportError
        If xarray is not installed.
    KeyboardInterrupt
        If it is stopped; the same call continues, if there is an output folder.

    Warns
    -----
    InputWarning
        If slip speeds or slip work of the outcomes would destroy a vehicle, or the first run leaves
        the map of its track or never meets it.
    """
    optional_library("xarray")  # which holds the results: better now than after the runs
    try:
        sweep = sweep if isinstance(sweep, Sweep) else load_sweep(sweep)
        sweep = with_own(sweep, controllers or {}, metrics or {}, key)
        for name, number in (("workers", workers), ("chunk", chunk)):
            if number is not None and number < 1:
                raise ValueError(f"{name} = {number!r} is out of range: must be >= 1")
        digest = sweep.plan.digest(sweep.values)
        count = workers or (executor.count if isinstance(executor, Workers) else default_workers())
        chunk = min(chunk or default_chunk(sweep, count), sweep.runs)
        if output is None:
            return make_dataset(sweep, _run(sweep, None, chunk, executor, count, progress), digest)
        path = results_path(sweep, output)
        return _in_folder(sweep, digest, path, chunk, executor, count, restart, progress)
    except KeyboardInterrupt:  # without the traceback of what waits for the workers
        kept = "" if output is None else f"; finished chunks are kept in {os.fspath(output)}"
        continues = kept and ", and the same call continues"
        raise KeyboardInterrupt(f"stopped{kept}{continues}") from None


def _in_folder(
    sweep: Sweep,
    digest: str,
    path: Path,
    chunk: int,
    executor: Executor | Workers | None,
    count: int,
    restart: bool,
    progress: Callable[[float], object],
) -> Dataset:
    """Run what of the sweep is not yet in the folder of its results."""
    chunks = path.with_suffix(".chunks")
    if restart:
        shutil.rmtree(chunks, ignore_errors=True)
    elif path.exists():
        dataset = _finished(sweep, digest, path, progress)
        shutil.rmtree(chunks, ignore_errors=True)  # that a kill has left
        return dataset
    store = ChunkStore(chunks, digest, sweep.plan.rows[FAILED].stop)
    path.unlink(missing_ok=True)  # of a restart; not before the disk has room for more
    dataset = make_dataset(sweep, _run(sweep, store, chunk, executor, count, progress), digest)
    if path.exists():  # by a second process
        _check_plan(read_dataset(path), path, digest)
    write_dataset(dataset, path)
    store.remove()
    return dataset


def _check_plan(known: Dataset, path: Path, digest: str) -> None:
    if known.attrs.get("plan_digest") != digest:
        raise another_plan(f"{path} is", known.attrs.get("plan_digest"), digest)


def _finished(
    sweep: Sweep, digest: str, path: Path, progress: Callable[[float], object]
) -> Dataset:
    """Read the dataset of a finished sweep, and update its name, source and labels."""
    known = read_dataset(path)
    _check_plan(known, path, digest)
    rows = [known[name].values.reshape(-1, sweep.runs) for name in sweep.plan.rows]
    dataset = make_dataset(sweep, np.concatenate(rows), digest)
    if not dataset.identical(known):  # a name, source or label has changed
        write_dataset(dataset, path)
    progress(1.0)
    return dataset


def results_path(sweep: Sweep, output: str | os.PathLike[str]) -> Path:
    """NetCDF file of a sweep in an output folder."""
    return Path(output) / f"{sweep.stem}.nc"


def default_chunk(sweep: Sweep, workers: int) -> int:
    """Default number of runs in a chunk."""
    if not sweep.plan.controllers:  # analyses run one after the other
        return min(MAX_CHUNK, math.ceil(sweep.runs / (ANALYSES_EACH * workers)))
    shared = math.ceil(sweep.runs / (CHUNKS_EACH * workers))
    axles = sweep.scenario.axles
    # Axles are stepped side by side, and vehicles need more memory.
    side_by_side = MAX_CHUNK if axles == 1 else MAX_CHUNK // (2 * axles)
    limit = min(side_by_side, math.ceil(MAX_TIME * sweep.runs / sweep.simulated_time))
    return max(MIN_CHUNK, min(limit, shared))


def _check_plausible_map(sweep: Sweep) -> None:
    """Warn if the first run, with a map, leaves it or never meets it."""
    plan, known = sweep.plan, (ValueError, RuntimeError)  # which the sweep itself reports
    with suppress(*known):
        scenario = ScenarioBuilder(plan).build(sweep.values[0].tolist())
        for controller in [*plan.controllers][:1] if scenario.track.survey.map else ():
            settings = plan.settings_of(0, scenario)
            run_many([scenario], controller, **settings | {"index": [settings["index"]]})


def _run(
    sweep: Sweep,
    store: ChunkStore | None,
    chunk: int,
    executor: Executor | Workers | None,
    count: int,
    progress: Callable[[float], object],
) -> FloatArray:
    """Results of all runs; those that the store has are not computed again."""
    results = np.empty((sweep.plan.rows[FAILED].stop, sweep.runs))
    done = np.zeros(sweep.runs, dtype=bool)

    def put(first: int, some: FloatArray) -> None:
        runs = slice(first, first + some.shape[1])
        results[:, runs], done[runs] = some, True

    def keep(first: int, some: FloatArray) -> None:
        if store is not None:
            store.save(first, some)
        put(first, some)
        progress(float(done.mean()))

    for first, some in store.load().items() if store else ():
        put(first, some)
    progress(float(done.mean()))
    left = np.flatnonzero(~done)
    gaps = np.split(left, np.flatnonzero(np.diff(left) > 1) + 1) if left.size else []
    todo = [
        (first, min(first + chunk, int(gap[-1]) + 1))
        for gap in gaps
        for first in range(int(gap[0]), int(gap[-1]) + 1, chunk)
    ]
    if todo:
        _check_plausible_map(sweep)
    entered: AbstractContextManager[Workers]
    if executor is None:
        entered = thread_workers(count)
    else:
        given = executor if isinstance(executor, Workers) else Workers(executor, count)
        entered = nullcontext(given)
    with warnings.catch_warnings(), entered as workers:
        warnings.simplefilter("ignore", RangeWarning)  # shown when the sweep was read
        warnings.filterwarnings("ignore", OFF_MAP, InputWarning)  # shown for the first run
        if todo:
            run_chunks(sweep.plan, sweep.values, todo, workers, keep)
    return results
