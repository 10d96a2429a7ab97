"""Where the time goes, and what arithmetic and memory allow: ``python tests/benchmarks/limits.py``.

Of the kernel's evaluation at many points, the time is held against that of its divisions and
square roots alone, and of moving its arrays alone. Of an ensemble, the profile is summed up by
what is done.
"""

from __future__ import annotations

import cProfile
import pstats
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from bench_runs import ensemble
from timing import Case, interleaved
from wet_patch import many

import contactlib as cl

# Of a point, in fmu/line_law.h and fmu/table_points.h: divisions and square roots. The line has 4
# and 1 in the start, 3 in each of two steps, 2 in what follows; the spline takes 2 and 2 more.
OPERATIONS = {"line": (12, 1), "elliptic": (14, 3)}
BYTES = 24  # of a point: a creepage is read, a traction ratio and a slope are written
IN_CACHE, IN_MEMORY = 1000, 4_000_000

# What a function of the profile does, by its file; the first that fits counts.
PARTS = {
    "kernel, which steps and evaluates": ("contactlib/kernel.py",),
    "controllers and sensors": ("contactlib/traction/",),
    "outcomes": ("contactlib/outcomes/", "contactlib/metrics.py"),
    "the loop over rows": ("contactlib/fleet/", "contactlib/traction_run.py", "ensemble_run.py"),
}


def kernel_limits(points: int = IN_MEMORY) -> list[tuple[str, float, float, float]]:
    """Each table's name, and ns per point: measured, of its divisions, of its memory traffic."""
    random = np.random.default_rng(0)
    x, few = random.uniform(0.0, 5.0, points), random.uniform(1.0, 2.0, IN_CACHE)
    copied, ones, out = np.empty_like(x), np.ones(IN_CACHE), np.empty(IN_CACHE)
    tables = {name: cl.carter_griffith_table(contact=name) for name in ("line", "elliptic")}
    # numpy uses the widest vectors that there are, as the kernel does.
    alone = Case(
        "limits",
        1.0,
        "ns",
        {
            "division": lambda: np.divide(ones, few, out=out),
            "root": lambda: np.sqrt(few, out=out),
            "copy": lambda: np.copyto(copied, x),
        },
    )
    seconds = interleaved(alone)
    division, root = (1e9 * seconds[name] / IN_CACHE for name in ("division", "root"))
    byte = 1e9 * seconds["copy"] / (16 * points)
    k_hat = np.array([0.3])
    whole = Case(
        "kernel",
        points,
        "ns",
        {
            name: lambda table=table: table.native.evaluate(x, k_hat)  # type: ignore[misc]
            for name, table in tables.items()
        },
    )
    measured = interleaved(whole)
    found = []
    for name, (divisions, roots) in OPERATIONS.items():
        arithmetic = divisions * division + roots * root
        found.append((name, whole.figure(name, measured[name]), arithmetic, BYTES * byte))
    return found


def ensemble_parts(runs: int = 256, duration: float = 5.0) -> dict[str, float]:
    """Shares of the time of an ensemble, by what is done; the rest is Python's and numpy's own."""
    scenarios = many(runs, 10.0, duration=duration)
    profile = cProfile.Profile()
    profile.runcall(ensemble, scenarios)
    stats: Any = pstats.Stats(profile)
    spent: dict[str, float] = defaultdict(float)
    for (file, _, _), (_, _, own, _, _) in stats.stats.items():
        name = Path(file).as_posix()
        fits = [part for part, places in PARTS.items() if any(place in name for place in places)]
        spent[fits[0] if fits else "the rest"] += own
    whole = sum(spent.values())
    return {part: seconds / whole for part, seconds in sorted(spent.items(), key=lambda p: -p[1])}


def lines(points: int = IN_MEMORY, runs: int = 256, duration: float = 5.0) -> list[str]:
    """Both as Markdown."""
    found = [
        f"| batch evaluation, {points} points | ns a point | its divisions and roots alone "
        "| its memory traffic alone |",
        "|---|---|---|---|",
    ]
    for name, measured, arithmetic, memory in kernel_limits(points):
        found.append(f"| {name} table | {measured:.1f} | {arithmetic:.1f} | {memory:.1f} |")
    found += ["", f"| time of {runs} runs of {duration:g} s | share |", "|---|---|"]
    found += [
        f"| {part} | {100 * share:.0f} % |"
        for part, share in ensemble_parts(runs, duration).items()
    ]
    return found


if __name__ == "__main__":
    print("\n".join(lines()))
