"""Running the chunks of a sweep on threads, processes or any executor."""

from __future__ import annotations

import importlib.util
import logging
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, InputWarning
from contactlib.element.force_element import RangeWarning
from contactlib.files.scenario import Scenario
from contactlib.runs.analysis import analyse, of_runs
from contactlib.runs.scenario_runs import FAILED, run_many
from contactlib.runs.sweep.plan import Plan, ScenarioBuilder
from contactlib.vehicle.track import OFF_MAP

AHEAD = 2  # chunks in flight for each worker, so that none waits
KEPT = (
    "finished chunks are kept if there is an output folder: start the same sweep again to continue"
)


class StoppedError(RuntimeError):
    """A chunk was stopped on request."""


class UnloadableError(RuntimeError):
    """A worker cannot load a controller or a metric of a user's own."""


def go_on() -> bool:
    """Never stop."""
    return False


def _packed(plan: Plan, executor: Executor) -> Plan | bytes:
    """The plan as `run_chunk` takes it from this executor: as bytes, if it leaves this process.

    A worker that cannot load a user's controller then reports this as the error of a chunk. It
    would die if the executor unpacked the plan.

    Raises
    ------
    ValueError
        If a controller or metric of a user's own cannot be sent to a process.
    """
    if isinstance(executor, ThreadPoolExecutor):
        return plan
    processes = isinstance(executor, ProcessPoolExecutor)
    pickler: Any = pickle
    if not processes and importlib.util.find_spec("cloudpickle"):  # as Dask has
        pickler = importlib.import_module("cloudpickle")
    try:
        return bytes(pickler.dumps(plan))
    except Exception as error:  # pickle raises anything
        if not processes:
            return plan
        raise ValueError(
            f"controllers and metrics cannot be sent to processes: {error}; define them at the "
            "top of a module, or use threads"
        ) from error


def _unpacked(plan: Plan | bytes) -> Plan:
    """The plan that was packed.

    Raises
    ------
    UnloadableError
        If a class or function that it needs cannot be imported here.
    """
    if isinstance(plan, Plan):
        return plan
    try:
        unpacked: Plan = pickle.loads(plan)  # noqa: S301 - of the process that sent the chunk
    except (ImportError, AttributeError) as error:
        raise UnloadableError(str(error)) from None
    return unpacked


def run_chunk(
    plan: Plan | bytes, first: int, values: FloatArray, stopped: Callable[[], bool] = go_on
) -> FloatArray:
    """Results of some runs; a pure function of the plan and the values.

    Parameters
    ----------
    plan : Plan or bytes
        Plan of the sweep; pickled, if it comes from another process.
    first : int
        Index of the first run in the sweep.
    values : ndarray
        Values of the axes, shape (n, axes).
    stopped : callable, optional
        Polled during the work; the chunk stops when it returns True.

    Returns
    -------
    ndarray
        Results in the rows of `Plan.rows`, a column for each run; nan where a run failed or its
        parameters do not give a valid scenario, which ``failed`` marks with ones.

    Raises
    ------
    RuntimeError
        If the plan was made with another contactlib.
    StoppedError
        If `stopped` returns True.
    UnloadableError
        If a controller or metric of a user's own cannot be imported here.
    """
    plan = _unpacked(plan)
    plan.check_machine()

    def go_on_or_stop(part: float) -> None:
        if stopped():
            raise StoppedError

    builder, n, rows = ScenarioBuilder(plan), len(values), plan.rows
    results = np.full((rows[FAILED].stop, n), np.nan)
    failed = results[rows[FAILED]]
    failed[:] = 0.0
    scenarios: list[Scenario | None] = []
    for i, row in enumerate(values):
        go_on_or_stop(0.0)
        try:
            scenarios.append(scenario := builder.build(row.tolist()))
        except ValueError:
            scenarios.append(None)
            failed[:, i] = 1.0
            continue
        for name, value in analyse(scenario, plan.outcomes).items():
            results[rows[name], i] = value
    valid = [scenario for scenario in scenarios if scenario is not None]
    # Any valid scenario fills the place of an invalid one.
    filled = [valid[0] if scenario is None else scenario for scenario in scenarios if valid]
    for j, controller in enumerate(plan.controllers if valid else ()):
        by_name = run_many(
            filled,
            controller,
            of_runs(plan.outcomes),
            metrics=plan.metrics,
            index=[plan.index_of(first + i) for i in range(n)],
            step=[plan.step_of(scenario) for scenario in filled],
            tolerance=plan.tolerance,
            until_stop=plan.until_stop,
            progress=go_on_or_stop,
        )
        failed[j] = np.maximum(failed[j], by_name.pop(FAILED))
        for name, column in by_name.items():
            results[rows[name]][j] = np.where(failed[j], np.nan, column)
    return results


_asked_to_stop: Event | None = None  # in a worker process


@dataclass(frozen=True)
class Workers:
    """An executor, and a way to stop the chunks that it runs.

    Attributes
    ----------
    executor : Executor
        Executor of ``concurrent.futures``.
    count : int
        Number of chunks that it runs at once.
    stopped : callable
        Function that chunks poll.
    stop : callable
        Makes `stopped` return True, if it can.
    watch : callable
        Called each second while no chunk is done; returns whether it waits for workers. Then it is
        called again as soon as one is.
    """

    executor: Executor
    count: int
    stopped: Callable[[], bool] = go_on
    stop: Callable[[], Any] = go_on
    watch: Callable[[], bool] = go_on


def default_workers() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def thread_workers(count: int) -> Iterator[Workers]:
    """Threads of this process; the kernel releases the GIL while it steps."""
    event = threading.Event()
    with ThreadPoolExecutor(count) as executor:
        try:
            yield Workers(executor, count, event.is_set, event.set)
        finally:
            event.set()


class _IgnoresInterrupts(SpawnProcess):
    """A process that ignores Ctrl-C in a terminal, also while it starts."""

    def start(self) -> None:
        """Start with the signal blocked, which the process inherits."""
        block = getattr(signal, "pthread_sigmask", None)  # of POSIX
        before = block(signal.SIG_BLOCK, {signal.SIGINT}) if block else None
        try:
            super().start()
        finally:
            if block:
                block(signal.SIG_SETMASK, before)


class _Spawning(SpawnContext):
    Process = _IgnoresInterrupts


@contextmanager
def process_workers(count: int) -> Iterator[Workers]:
    """Spawned processes of this machine; a script needs a ``__name__`` guard."""
    context = _Spawning()
    event = context.Event()
    with ProcessPoolExecutor(count, context, _begin, (event,)) as executor:
        try:
            yield Workers(executor, count, _stopped, event.set)
        finally:
            event.set()


def _begin(event: Event) -> None:
    """Prepare a worker process."""
    global _asked_to_stop
    _asked_to_stop = event
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles it and sets the event
    warnings.simplefilter("ignore", RangeWarning)  # shown once, by the parent
    warnings.filterwarnings("ignore", OFF_MAP, InputWarning)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _stopped() -> bool:
    return _asked_to_stop is not None and _asked_to_stop.is_set()


def _end_with_parent() -> None:
    """End this process when its parent has ended for any reason."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def cluster_workers(
    address: str,
    report: Callable[[str], object] = lambda line: None,
    modules: Iterable[str | os.PathLike[str]] = (),
) -> Iterator[Workers]:
    """Workers of the Dask cluster with this scheduler address.

    A sweep that has lost all workers waits for one. `report` is called with a line about this, and
    with another one when the sweep resumes. `modules` are files that all workers get, with
    controllers and metrics of a user's own.

    Raises
    ------
    ImportError
        If dask.distributed is not installed.
    OSError
        If no scheduler answers.
    """
    distributed = optional_library("distributed")
    waits = False
    for name in logging.root.manager.loggerDict:
        if name.split(".")[0] in ("distributed", "tornado"):  # `report` replaces their messages
            logging.getLogger(name).setLevel(logging.CRITICAL)
    with distributed.Client(address) as client:
        for module in modules:
            client.upload_file(os.fspath(module))

        def watch() -> bool:
            nonlocal waits
            if waits != (not client.nthreads()):
                waits = not waits
                report("No worker is left: waiting for one" if waits else "A worker has come")
            return waits

        count = sum(client.nthreads().values())
        with client.get_executor() as executor:
            yield Workers(executor, max(1, count), watch=watch)


def run_chunks(
    plan: Plan,
    values: FloatArray,
    chunks: Iterable[tuple[int, int]],
    workers: Workers,
    keep: Callable[[int, FloatArray], object],
) -> None:
    """Run chunks, a bounded number at a time, and pass on the results of each when it is done.

    An executor that is not of this machine gets a chunk a second time if the first attempt fails
    in a way that a lost worker can cause.

    Parameters
    ----------
    plan : Plan
        Plan of the sweep.
    values : ndarray
        Values of the axes in all runs.
    chunks : iterable of (int, int)
        First run of each chunk, and the run after its last.
    workers : Workers
        Workers that run the chunks.
    keep : callable
        Called with the first run of a chunk and its results.

    Raises
    ------
    ValueError
        If a controller or metric of a user's own cannot be sent to a process.
    RuntimeError
        If a worker process dies or cannot import a controller or metric; results finished before
        have been passed on.
    """
    packed = _packed(plan, workers.executor)
    left, flying, again = iter(chunks), dict[Future[FloatArray], tuple[int, int]](), set[int]()
    local = isinstance(workers.executor, (ThreadPoolExecutor, ProcessPoolExecutor))
    stopped = () if workers.stopped is go_on else (workers.stopped,)
    waits = False
    try:
        while True:
            while len(flying) < AHEAD * workers.count and (chunk := next(left, None)) is not None:
                first, end = chunk
                job = workers.executor.submit(run_chunk, packed, first, values[first:end], *stopped)
                flying[job] = chunk
            if not flying:
                return
            done, _ = wait(flying, timeout=1.0, return_when=FIRST_COMPLETED)
            if not done or waits:
                waits = workers.watch()
            for job in sorted(done, key=flying.__getitem__):
                first, end = flying.pop(job)
                try:
                    results = job.result()
                except (AttributeError, TypeError, ValueError):
                    # Dask's executor takes results for an error if the worker that holds them ends
                    # as they come (its version 2026.8), so another attempt is made.
                    if local or first in again:
                        raise
                    again.add(first)
                    left = chain([(first, end)], left)
                else:
                    keep(first, results)
    except BaseException as error:
        workers.stop()
        for job in flying:
            job.cancel()
        if isinstance(error, CancelledError):
            why = "a chunk was cancelled, as by a cluster whose scheduler has gone"
            raise RuntimeError(f"{why}; {KEPT}") from None
        if isinstance(error, UnloadableError):
            raise RuntimeError(_remedy(plan, str(error))) from None
        if isinstance(error, BrokenProcessPool):
            raise RuntimeError(f"a worker process died, perhaps {_why(plan)}") from None
        raise


def _why(plan: Plan) -> str:
    """Likely cause of the death of a worker process, and the remedy."""
    script = getattr(sys.modules["__main__"], "__file__", None)
    if script and "__name__" not in Path(script).read_text(errors="replace"):
        return f"as {script} lacks the line if __name__ == '__main__': before what it does; {KEPT}"
    return f"for lack of memory; {KEPT}"


def _remedy(plan: Plan, error: str) -> str:
    """Sentence about a controller or metric that a worker cannot load."""
    own = {**plan.controllers, **plan.metrics}.values()
    interactive = not getattr(sys.modules["__main__"], "__file__", None)
    if interactive and any(getattr(member, "__module__", "") == "__main__" for member in own):
        why = "cannot import what a notebook defines"
        return f"a worker {why}; {KEPT}, with controllers and metrics in a module"
    return (
        f"a worker cannot load your controllers or metrics: {error}; install their module where "
        f"the workers are, or send it with distributed.Client(ADDRESS).upload_file(FILE); {KEPT}"
    )
