"""Who runs the chunks: threads, processes, or any executor that somebody else has made."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.synchronize import Event
from typing import Any

from contactlib.element import ProcessZoneWarning
from contactlib.sweep.chunk import go_on

_asked_to_stop: Event | None = None  # in a worker process


@dataclass(frozen=True)
class Workers:
    """An executor, and how to ask what it runs to give up.

    Attributes
    ----------
    executor : Executor
        Of ``concurrent.futures``.
    count : int
        How many chunks it runs at once.
    stopped : callable
        What a chunk asks.
    stop : callable
        Makes `stopped` say yes, if it can.
    """

    executor: Executor
    count: int
    stopped: Callable[[], bool] = go_on
    stop: Callable[[], Any] = go_on


def default_workers() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def thread_workers(count: int) -> Iterator[Workers]:
    """Threads of this process; the kernel lets go of the interpreter while it steps."""
    event = threading.Event()
    with ThreadPoolExecutor(count) as executor:
        try:
            yield Workers(executor, count, event.is_set, event.set)
        finally:
            event.set()


@contextmanager
def process_workers(count: int) -> Iterator[Workers]:
    """Processes on this machine, started afresh: a script needs its ``__name__`` guard."""
    context = multiprocessing.get_context("spawn")
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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that planned is told, and tells
    warnings.simplefilter("ignore", ProcessZoneWarning)  # said once, where it was planned
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _stopped() -> bool:
    return _asked_to_stop is not None and _asked_to_stop.is_set()


def _leave_with_parent() -> None:
    """End this process when the one that started it is gone, for whatever reason."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def cluster_workers(address: str) -> Iterator[Workers]:
    """The workers of a Dask cluster, by the address of its scheduler.

    Raises
    ------
    ValueError
        If dask.distributed is not installed.
    OSError
        If no scheduler answers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(
            "a cluster needs dask.distributed: pip install 'contactlib[cluster]'"
        ) from None
    with Client(address) as client:  # type: ignore[no-untyped-call]
        count = sum(client.nthreads().values())
        with client.get_executor() as executor:
            yield Workers(executor, max(1, count))
