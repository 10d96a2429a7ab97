"""Cost against the number of runs and of steps: ``python benchmarks/scaling.py [FIGURE]``.

Processor time over three decades of each, and the largest memory in use against the size of a
chunk; with the line, a fixed cost and one in proportion, that fits, and the exponent of the last
decade. FIGURE is a PNG file.
"""

from __future__ import annotations

import subprocess
import sys
import time
import tracemalloc
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np
from bench_runs import ensemble
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.optimize import nnls
from wet_patch import many

from contactlib.base.quantities import FloatArray

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


class Line(NamedTuple):
    """Cost of n: ``fixed + each * n``.

    Attributes
    ----------
    fixed, each : float
        In the unit of the cost; neither is below zero.
    misfit : float
        Largest relative deviation of what was measured [1].
    exponent : float
        Power of n that the cost grows with over the last decade [1].
    """

    fixed: float
    each: float
    misfit: float
    exponent: float


def fitted(n: FloatArray, cost: FloatArray) -> Line:
    """The line with the least squares of relative deviations."""
    (fixed, each), _ = nnls(np.column_stack([1.0 / cost, n / cost]), np.ones(n.size))
    misfit = float(np.max(np.abs((fixed + each * n) / cost - 1.0)))
    late = n >= 0.099 * n[-1]
    exponent = float(np.polyfit(np.log(n[late]), np.log(cost[late]), 1)[0])
    return Line(float(fixed), float(each), misfit, exponent)


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
    command = [sys.executable, "-c", code]
    return int(subprocess.check_output(command, text=True, cwd=Path(__file__).parent))


class Panel(NamedTuple):
    """What is measured: its name, sizes, cost, the unit of that, and how it is called."""

    what: str
    n: FloatArray
    cost: FloatArray
    unit: str
    axis: str


def draw(panels: Sequence[Panel], path: Path) -> None:
    """Measured costs and their lines."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (what, n, cost, unit, axis) in zip(
        figure.subplots(1, len(panels)), panels, strict=True
    ):
        line = fitted(n, cost)
        axes.plot(n, cost, "ko", markersize=5, label="measured")
        at = np.geomspace(n[0], n[-1], 200)
        label = "fixed + proportional"
        axes.plot(at, line.fixed + line.each * at, color="0.5", zorder=0, label=label)
        axes.set(xlabel=what, ylabel=f"{axis} / {unit}")
        axes.grid(True, which="major", color="0.9")
        axes.set_title(f"{line.fixed:.2g} {unit} + {line.each:.2g} {unit} each", fontsize=10)
        if n[-1] >= 1000.0 * n[0]:
            axes.set(xscale="log", yscale="log")
    figure.axes[0].legend(frameon=False)
    figure.savefig(path, dpi=150)


@click.command(help=__doc__)
@click.argument("figure", required=False, type=click.Path(dir_okay=False, path_type=Path))
def main(figure: Path | None) -> None:
    """Measure, print, draw."""
    spent = [seconds(n, 1.0) for n in RUNS], [seconds(FEW, length) for length in DURATIONS]
    memory = [1e-6 * peak_memory_apart(n, CHUNK_DURATION) for n in CHUNKS]
    in_a_chunk = f"runs of {CHUNK_DURATION:g} s in a chunk"
    panels = [
        Panel("runs of 1 s", np.array(RUNS), np.array(spent[0]), "s", "processor time"),
        Panel(
            f"length of {FEW} runs / s",
            np.array(DURATIONS),
            np.array(spent[1]),
            "s",
            "processor time",
        ),
        Panel(in_a_chunk, np.array(CHUNKS), np.array(memory), "MB", "memory in use"),
    ]
    for what, n, cost, unit, axis in panels:
        line = fitted(n, cost)
        print(
            f"{axis} over {what}: {line.fixed:.3g} {unit} + {line.each:.3g} {unit} each, within "
            f"{100 * line.misfit:.0f} %; exponent of the last decade {line.exponent:.2f}"
        )
        for size, value in zip(n, cost, strict=True):
            print(f"  {size:8g} {value:10.4g} {unit}")
    if figure is not None:
        draw(panels, figure)


if __name__ == "__main__":
    main()
