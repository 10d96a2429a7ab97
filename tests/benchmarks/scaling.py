"""Cost against the number of runs and of steps: ``python tests/benchmarks/scaling.py [FIGURE]``.

Processor time over three decades of each, the exponent that fits it, and the largest memory in use
against the size of a chunk. FIGURE is a PNG file.
"""

from __future__ import annotations

import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import click
import numpy as np
from bench_runs import ensemble
from wet_patch import many

from contactlib.parameters import FloatArray

RUNS = (10, 30, 100, 300, 1000, 3000, 10_000)  # of 1 s
DURATIONS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)  # of `FEW` runs [s]
CHUNKS = (16, 64, 256, 1024)  # runs of `CHUNK_DURATION`
FEW, CHUNK_DURATION = 16, 2.0
SPEED = 10.0  # [m/s]
REPEATS = 3


def seconds(runs: int, duration: float) -> float:
    """Shortest processor time of an ensemble, with its scenarios at hand [s]."""
    scenarios = many(runs, SPEED, duration=duration)
    spent = []
    for _ in range(REPEATS):
        start = time.process_time()
        ensemble(scenarios)
        spent.append(time.process_time() - start)
        if spent[0] > 10.0:  # long enough to be free of noise
            break
    return min(spent)


def exponent(n: FloatArray, cost: FloatArray) -> float:
    """Power of n that the cost grows with, by least squares of the logarithms."""
    return float(np.polyfit(np.log(n), np.log(cost), 1)[0])


def peak_memory(runs: int, duration: float) -> int:
    """Largest memory in use while an ensemble runs, beyond its scenarios [B]."""
    scenarios = many(runs, SPEED, duration=duration)
    ensemble(scenarios[:1])  # loads what is loaded once
    tracemalloc.start()
    ensemble(scenarios)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


def peak_memory_apart(runs: int, duration: float) -> int:
    """The same in a process of its own."""
    code = f"import scaling; print(scaling.peak_memory({runs}, {duration}))"
    answer = subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parent,
    )
    return int(answer.stdout)


def draw(by_runs: FloatArray, by_duration: FloatArray, by_chunk: FloatArray, path: Path) -> None:
    """Costs over runs and durations, memory over chunks."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    panels = (
        (RUNS, by_runs, "runs of 1 s", "processor time / s", 1.0),
        (DURATIONS, by_duration, f"length of {FEW} runs / s", "processor time / s", 1.0),
        (
            CHUNKS,
            by_chunk / 1e6,
            f"runs of {CHUNK_DURATION:g} s in a chunk",
            "memory in use / MB",
            1.0,
        ),
    )
    for axes, (n, cost, label, unit, slope) in zip(figure.subplots(1, 3), panels, strict=True):
        at = np.array(n, dtype=np.float64)
        axes.loglog(at, cost, "ko-", markersize=4, label="measured")
        middle = len(at) // 2
        line = cost[middle] * (at / at[middle]) ** slope
        axes.loglog(at, line, color="0.6", linestyle="--", label="in proportion")
        axes.set(xlabel=label, ylabel=unit)
        axes.grid(True, which="major", color="0.9")
        axes.set_title(f"exponent {exponent(at, cost):.2f}", fontsize=10)
    figure.axes[0].legend(frameon=False)
    figure.savefig(path, dpi=150)


@click.command(help=__doc__)
@click.argument("figure", required=False, type=click.Path(dir_okay=False, path_type=Path))
def main(figure: Path | None) -> None:
    """Measure, print, draw."""
    by_runs = np.array([seconds(n, 1.0) for n in RUNS])
    by_duration = np.array([seconds(FEW, duration) for duration in DURATIONS])
    by_chunk = np.array([peak_memory_apart(n, CHUNK_DURATION) for n in CHUNKS], dtype=np.float64)
    for what, n, cost, unit in (
        ("runs of 1 s", RUNS, by_runs, "s"),
        (f"seconds of {FEW} runs", DURATIONS, by_duration, "s"),
        (f"runs of {CHUNK_DURATION:g} s in a chunk", CHUNKS, by_chunk / 1e6, "MB"),
    ):
        at = np.array(n, dtype=np.float64)
        print(f"{what}: exponent {exponent(at, cost):.3f}")
        for size, value in zip(n, cost, strict=True):
            print(f"  {size:8g} {value:10.4g} {unit}")
    if figure is not None:
        draw(by_runs, by_duration, by_chunk, figure)


if __name__ == "__main__":
    main()
