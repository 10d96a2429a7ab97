"""A sweep from its file to its dataset."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contactlib.element import ProcessZoneWarning
from contactlib.sweep.dataset import make_dataset, read_dataset, write_dataset
from contactlib.sweep.execution import Results, run_chunks
from contactlib.sweep.loading import load_sweep
from contactlib.sweep.lock import locked
from contactlib.sweep.plan import made_with
from contactlib.sweep.store import ChunkStore, another_plan, discard
from contactlib.sweep.sweep import Sweep
from contactlib.sweep.workers import Workers, default_workers, thread_workers

if TYPE_CHECKING:
    from xarray import Dataset

# Runs in a chunk: side by side a few cost as much as one, and what two thousand take is less than
# 100 MB. Its simulated time, of which a core does 15 000 s in a second, is what a kill can cost,
# and what passes between signs of progress.
LEAST, MOST, LONGEST = 64, 2048, 225_000.0
CHUNKS_EACH, ANALYSES_EACH = 2, 8  # for a worker, so that none waits long for the last


def ensemble(
    sweep: Sweep | str | os.PathLike[str],
    *,
    executor: Executor | Workers | None = None,
    workers: int | None = None,
    output: str | os.PathLike[str] | None = None,
    chunk: int | None = None,
    restart: bool = False,
    progress: Callable[[float], object] = lambda part: None,
) -> Dataset:
    """Run a sweep.

    Parameters
    ----------
    sweep : Sweep or path
        What `load_sweep` read, or reads.
    executor : concurrent.futures.Executor, optional
        Who runs the chunks, such as ``distributed.Client(address).get_executor()``, or what
        `process_workers` and `cluster_workers` yield; threads if left out. Results do not depend
        on it, to the last bit.
    workers : int, optional
        Number of threads, or of the workers of an executor, which gets twice as many chunks at a
        time; one for each processor if left out.
    output : path, optional
        Folder for the NetCDF file, and for what is done until then: killed at any time, the same
        call goes on from there. Left out, nothing is written.
    chunk : int, optional
        Number of runs in a chunk; those of an output folder that has some are taken as they are.
    restart : bool, optional
        Whether to do away with what the folder has of this sweep's name, and start anew.
    progress : callable, optional
        Is told the part of the runs that is done, from 0 to 1; first what was done before.

    Returns
    -------
    xarray.Dataset
        With the dimensions (controller, axis, ...) of a grid or (controller, run) of a sample;
        ``units`` and ``long_name`` at every variable and coordinate.

    Raises
    ------
    ModelError
        If a file is not valid.
    ValueError
        If the folder has results of another plan, or a number is out of range.
    RuntimeError
        If a worker died, or another process is running the sweep to the same folder.
    OSError
        If a file cannot be read or written.
    """
    sweep = sweep if isinstance(sweep, Sweep) else load_sweep(sweep)
    for name, number in (("workers", workers), ("chunk", chunk)):
        if number is not None and number < 1:
            raise ValueError(f"{name} = {number!r} is out of range: must be >= 1")
    digest = sweep.plan.digest(sweep.values)
    count = workers or (executor.count if isinstance(executor, Workers) else default_workers())
    chunk = min(chunk or default_chunk(sweep, count), sweep.runs)
    if output is None:
        results = _run(sweep, None, chunk, executor, count, progress)
        return make_dataset(sweep, results, digest)
    path = results_path(sweep, output)
    folder = path.with_suffix(".chunks")
    if path.exists() and not restart and not folder.exists():
        progress(1.0)
        return _finished(sweep, digest, path)
    with locked(folder):
        if restart:
            path.unlink(missing_ok=True)
            discard(folder)
        if path.exists():  # of a kill between the file and the removal of the chunks
            known = _finished(sweep, digest, path)
            discard(folder)
            progress(1.0)
            return known
        store = ChunkStore(folder, digest, sweep.plan.made_with, runs=sweep.runs, chunk=chunk)
        results = _run(sweep, store, store.chunk, executor, count, progress)
        dataset = make_dataset(sweep, results, digest)
        write_dataset(dataset, path)
        discard(folder)
    return dataset


def _finished(sweep: Sweep, digest: str, path: Path) -> Dataset:
    """Dataset of a file whose runs are those of the sweep, described as the sweep now is."""
    known = read_dataset(path)
    if known.attrs.get("plan_digest") != digest:
        found = made_with(*map(known.attrs.get, ("contactlib_version", "kernel_token")))
        raise another_plan(f"{path} is", found, sweep.plan.made_with)
    rows = (-1, sweep.runs)
    results = {
        name: v.values.reshape(rows if "controller" in v.dims else sweep.runs)
        for name, v in known.data_vars.items()
    }
    dataset = make_dataset(sweep, {str(name): v for name, v in results.items()}, digest)
    if not dataset.identical(known):  # a name, source or label is another
        write_dataset(dataset, path)
    return dataset


def results_path(sweep: Sweep, output: str | os.PathLike[str]) -> Path:
    """NetCDF file of a sweep in an output folder."""
    return Path(output) / f"{sweep.stem}.nc"


def default_chunk(sweep: Sweep, workers: int) -> int:
    """Number of runs in a chunk."""
    if not sweep.plan.controllers:  # an analysis is done one by one
        return min(MOST, math.ceil(sweep.runs / (ANALYSES_EACH * workers)))
    shared = math.ceil(sweep.runs / (CHUNKS_EACH * workers))
    most = min(MOST, math.ceil(LONGEST * sweep.runs / sweep.simulated_time))
    return max(LEAST, min(most, shared))


def _run(
    sweep: Sweep,
    store: ChunkStore | None,
    chunk: int,
    executor: Executor | Workers | None,
    count: int,
    progress: Callable[[float], object],
) -> Results:
    """Outcomes of all runs, of which the store may have some."""
    found: dict[int, Results] = {}
    starts = range(0, sweep.runs, chunk)
    for first in starts if store is not None else ():
        known = store.load(first) if store is not None else None
        if known is not None:
            found[first] = known
    progress(len(found) / len(starts))

    def keep(first: int, results: Results) -> None:
        if store is not None:
            store.save(first, results)
        found[first] = results
        progress(len(found) / len(starts))

    todo = [(i, min(i + chunk, sweep.runs)) for i in starts if i not in found]
    entered: AbstractContextManager[Workers]
    if executor is None:
        entered = thread_workers(count)
    elif isinstance(executor, Workers):
        entered = nullcontext(executor)
    else:
        entered = nullcontext(Workers(executor, count))
    with warnings.catch_warnings(), entered as workers:
        warnings.simplefilter("ignore", ProcessZoneWarning)  # said when the sweep was read
        if todo:
            run_chunks(sweep.plan, sweep.values, todo, workers, keep)
    parts = [found[first] for first in starts]
    return {name: np.concatenate([part[name] for part in parts], axis=-1) for name in parts[0]}
