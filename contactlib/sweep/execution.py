"""Running the chunks of a sweep, a bounded number of them at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool

from contactlib.parameters import FloatArray
from contactlib.sweep.chunk import go_on, run_chunk
from contactlib.sweep.plan import Plan
from contactlib.sweep.workers import Workers

AHEAD = 2  # chunks in flight for each worker, so that none waits
Results = dict[str, FloatArray]


def run_chunks(
    plan: Plan,
    values: FloatArray,
    chunks: Iterable[tuple[int, int]],
    workers: Workers,
    keep: Callable[[int, Results], object],
) -> None:
    """Run chunks and hand on the results of each as soon as it is done.

    Parameters
    ----------
    plan : Plan
        Of the sweep.
    values : ndarray
        Of the axes in all runs.
    chunks : iterable of (int, int)
        First run of each chunk, and the one after its last.
    workers : Workers
        Who runs them.
    keep : callable
        Is given the first run of a chunk, and its results.

    Raises
    ------
    RuntimeError
        If a worker process dies; what was done by then has been handed on.
    """
    left, flying = iter(chunks), dict[Future[Results], int]()
    asked = () if workers.stopped is go_on else (workers.stopped,)
    try:
        while True:
            while len(flying) < AHEAD * workers.count and (chunk := next(left, None)) is not None:
                first, end = chunk
                job = workers.executor.submit(run_chunk, plan, first, values[first:end], *asked)
                flying[job] = first
            if not flying:
                return
            done, _ = wait(flying, return_when=FIRST_COMPLETED)
            for job in sorted(done, key=flying.__getitem__):
                keep(flying.pop(job), job.result())
    except BaseException as error:
        workers.stop()
        for job in flying:
            job.cancel()
        if isinstance(error, BrokenProcessPool):
            raise RuntimeError(
                "a worker process died, maybe for want of memory; what was done is kept if there "
                "is an output folder: start the same sweep again to go on"
            ) from None
        raise
