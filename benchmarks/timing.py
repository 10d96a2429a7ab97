"""Timing side by side: each round calls every subject once, so that noise hits all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from statistics import median

Call = Callable[[], object]


@dataclass(frozen=True)
class Case:
    """One thing to do, and who can do it; the first subjects are contactlib's.

    Attributes
    ----------
    what : str
        What is done.
    work : float
        Points, calls or simulated seconds of one call of a subject.
    unit : str
        Of the figures: "ns", "us" or "ms" per unit of work, or "s/s" for work per time.
    subjects : mapping
        Functions without arguments by name.
    goals : mapping
        By the rival's name, what the ratio is to be; an empty name stands for our figure itself.
    clock : callable
        Time in seconds: of the processor, or of the wall where threads are to save it.
    ours : int
        How many of the subjects are contactlib's.
    less_work : mapping
        The work of a slow subject that is given less.
    """

    what: str
    work: float
    unit: str
    subjects: Mapping[str, Call]
    goals: Mapping[str, str] = field(default_factory=dict)
    clock: Callable[[], float] = time.process_time
    ours: int = 1
    less_work: Mapping[str, float] = field(default_factory=dict)

    def figure(self, name: str, seconds: float) -> float:
        """What a subject does, from the time of one call."""
        work = self.less_work.get(name, self.work)
        if self.unit == "s/s":
            return work / seconds
        return seconds / work * {"ns": 1e9, "us": 1e6, "ms": 1e3}[self.unit]

    def times_faster(self, ours: str, rival: str, seconds: Mapping[str, float]) -> float:
        """How many times faster one subject is than another one, from the times of their calls."""
        each = [seconds[name] / self.less_work.get(name, self.work) for name in (rival, ours)]
        return each[0] / each[1]

    def pairs(self) -> list[tuple[str, str]]:
        """What is to be compared: our first with every rival, others with the one of the goal."""
        names = list(self.subjects)
        ours, others = names[: self.ours], names[self.ours :]
        main = [name for name in others if name in self.goals] or others[:1]
        return [(ours[0], name) for name in others] + [(o, name) for o in ours[1:] for name in main]


def interleaved(case: Case, *, rounds: int = 11, shortest: float = 0.02) -> dict[str, float]:
    """Median of the times of one call of each subject [s].

    Parameters
    ----------
    case : Case
        Who does what.
    rounds : int, optional
        How often each has its turn; one whose call takes longer than a second has it once, and
        one beyond a tenth of a second three times.
    shortest : float, optional
        Time that a turn lasts at least, with as many calls as that needs [s].
    """
    calls, turns = {}, {}
    for name, subject in case.subjects.items():
        subject()  # whatever is made at the first call
        count, spent = 1, _spent(case, subject, 1)
        while spent < shortest:
            count *= max(2, min(1000, round(shortest / max(spent, 1e-9))))
            spent = _spent(case, subject, count)
        calls[name] = count
        turns[name] = 1 if spent / count > 1.0 else 3 if spent / count > 0.1 else rounds
    spent_in: dict[str, list[float]] = {name: [] for name in case.subjects}
    for turn in range(rounds):
        for name, subject in case.subjects.items():
            if turn < turns[name]:
                spent_in[name].append(_spent(case, subject, calls[name]) / calls[name])
    # Unlike the shortest, the median does not favour who has more turns.
    return {name: median(times) for name, times in spent_in.items()}


def _spent(case: Case, subject: Call, count: int) -> float:
    start = case.clock()
    for _ in range(count):
        subject()
    return case.clock() - start
