"""Cost against the number of runs and of steps: ``python benchmarks/scaling.py``.

Processor time over three decades of each, and the largest memory in use against the size of a
chunk.
"""

from __future__ import annotations

import time
import tracemalloc

from bench_runs import ensemble, many
from timing import one_core

RUNS = (10, 30, 100, 300, 1000, 3000, 10_000)  # of 1 s
DURATIONS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)  # of `FEW` runs [s]
CHUNKS = (16, 64, 256, 1024)  # runs of 2 s
FEW, SPEED = 16, 10.0  # [1, m/s]


def seconds(runs: int, duration: float) -> float:
    """Processor time of an ensemble, with its scenarios at hand [s]."""
    scenarios = many(runs, SPEED, duration=duration)
    start = time.process_time()
    ensemble(scenarios)
    return time.process_time() - start


def peak_memory(runs: int, duration: float) -> int:
    """Largest memory in use while an ensemble runs, beyond its scenarios [B]."""
    scenarios = many(runs, SPEED, duration=duration)
    ensemble(scenarios[:1])  # loads what is loaded once
    tracemalloc.start()
    ensemble(scenarios)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


if __name__ == "__main__":
    with one_core():
        for runs in RUNS:
            print(f"{runs} runs of 1 s: {1e3 * seconds(runs, 1.0) / runs:.3g} ms each")
        for duration in DURATIONS:
            cost = 1e3 * seconds(FEW, duration) / duration
            print(f"{FEW} runs of {duration:g} s: {cost:.3g} ms per s")
        for runs in CHUNKS:
            print(
                f"{runs} runs of 2 s in a chunk: {1e-3 * peak_memory(runs, 2.0) / runs:.3g} kB each"
            )
