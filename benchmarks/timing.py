"""Timing side by side: each round calls every subject once, so that noise hits all of them."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator, Mapping
from statistics import median

Call = Callable[[], object]
Clock = Callable[[], float]


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Keep to one processor, where the system allows it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def compare(
    what: str,
    work: float,
    unit: str,
    subjects: Mapping[str, Call],
    *,
    less_work: Mapping[str, float] | None = None,
    clock: Clock = time.process_time,
    rounds: int = 11,
    shortest: float = 0.02,
) -> None:
    """Print what each subject does, and the time that it takes over that of the first.

    Parameters
    ----------
    what : str
        What is done.
    work : float
        Points, calls or simulated seconds of one call of a subject.
    unit : str
        Of the figures: "ns" or "us" per unit of work, or "s/s" for work per time.
    subjects : mapping
        Functions without arguments by name.
    less_work : mapping, optional
        The work of a slow subject that is given less.
    clock : callable, optional
        Time in seconds: of the processor, or of the wall where threads are to save it.
    rounds : int, optional
        How often each has its turn; one whose call takes longer than a second has it once, and
        one beyond a tenth of a second three times.
    shortest : float, optional
        Time that a turn lasts at least, with as many calls as that needs [s].
    """
    print(what)
    works = {**dict.fromkeys(subjects, work), **(less_work or {})}
    each = {n: s / works[n] for n, s in interleaved(subjects, clock, rounds, shortest).items()}
    for name, seconds in each.items():
        figure = 1.0 / seconds if unit == "s/s" else seconds * {"ns": 1e9, "us": 1e6}[unit]
        print(f"    {name:38} {figure:8.3g} {unit:3} {seconds / next(iter(each.values())):8.3g}")


def interleaved(
    subjects: Mapping[str, Call], clock: Clock, rounds: int, shortest: float
) -> dict[str, float]:
    """Median of the times of one call of each subject [s]."""

    def spent(subject: Call, count: int) -> float:
        start = clock()
        for _ in range(count):
            subject()
        return clock() - start

    calls, turns = {}, {}
    for name, subject in subjects.items():
        subject()  # whatever is made at the first call
        count, once = 1, spent(subject, 1)
        while once < shortest:
            count *= max(2, min(1000, round(shortest / max(once, 1e-9))))
            once = spent(subject, count)
        calls[name] = count
        turns[name] = 1 if once / count > 1.0 else 3 if once / count > 0.1 else rounds
    times: dict[str, list[float]] = {name: [] for name in subjects}
    for turn in range(rounds):
        for name, subject in subjects.items():
            if turn < turns[name]:
                times[name].append(spent(subject, calls[name]) / calls[name])
    # Unlike the shortest, the median does not favour who has more turns.
    return {name: median(found) for name, found in times.items()}
