"""Every benchmark on one core, as the tables of the README: ``python benchmarks/report.py``.

Ours and its rivals run in turns in one process, so that noise hits all of them; figures are the
median of the turns, in processor time but for threads. What is quoted is not measured here.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import os
import pickle
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import bench_kernel
import bench_runs
import bench_table
import click
import fmu_step
import numpy as np
from timing import Case, interleaved

import contactlib as cl
from contactlib.runs.sweep.execution import run_chunk

PACKAGES = ("contactlib", "numpy", "scipy", "numba", "ziglang")
MILLION, SECONDS = 1_000_000, 5.0  # runs of a sweep, and their length [s]
SWEEP = "uncertain_wheelset_sweep.toml"
TIMED = """name = "Timed"
source = "chosen"
scenario = "dry_wet_dry.toml"
controllers = ["creep_pi"]
outcomes = ["distance", "largest_creepage", "slip_work"]

[axes.duration]
parameter = "run.duration"
values = [{seconds}]

[axes.inertia]
parameter = "vehicle.wheelset.inertia"
from = 80.0
to = 180.0
count = {runs}
"""
QUOTED = "Quoted, not measured here: the Reference FMUs 58 to 141 ns a step."


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


def machine() -> str:
    """Processor, system, compiler and versions in one line."""
    command = [sys.executable, "-m", "ziglang", "cc", "--version"]
    compiler = subprocess.check_output(command, text=True).splitlines()[0]
    installed = {found.name: found.version for found in importlib.metadata.distributions()}
    versions = [f"{name} {installed.get(name, 'missing')}" for name in PACKAGES]
    return (
        f"{fmu_step.processor()}, {os.cpu_count()} cores; {platform.system()} "
        f"{platform.release()}; {compiler}; Python {platform.python_version()}; "
        + ", ".join(versions)
    )


def number(value: float) -> str:
    """Three digits."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def rows(case: Case, *, rounds: int = 11, shortest: float = 0.02) -> list[str]:
    """A line for each pair: what, ours, rival, ratio, goal."""
    seconds = interleaved(case, rounds=rounds, shortest=shortest)
    figures = {name: number(case.figure(name, s)) for name, s in seconds.items()}
    own_goal = f" (goal {case.goals['']})" if "" in case.goals else ""
    found = []
    for ours, other in case.pairs():
        ratio = number(case.times_faster(ours, other, seconds))
        found.append(
            f"| {case.what} | {ours}: {figures[ours]} {case.unit}{own_goal} "
            f"| {other}: {figures[other]} {case.unit} | {ratio} | {case.goals.get(other, '')} |"
        )
    return found


def accuracy_lines(duration: float = 5.0) -> list[str]:
    """Errors of the outcomes of one run against a reference of 1e-10."""
    each = {speed: bench_runs.accuracy(speed, duration) for speed in bench_runs.SPEEDS}
    speeds = " | ".join(f"at {speed:g} m/s" for speed in each)
    found = [f"| largest relative error of the outcomes | {speeds} |", "|---" * 3 + "|"]
    for name in each[bench_runs.SPEEDS[0]]:
        errors = " | ".join(f"{found[name]:.1e}" for found in each.values())
        found.append(f"| {name} | {errors} |")
    return found


def lateral_spin_lines() -> list[str]:
    """Errors of lateral and spin force against CONTACT, by group of its cases and of all."""
    errors = bench_kernel.lateral_spin_errors()
    names = next(iter(errors.values()))
    errors["all"] = {who: np.concatenate([e[who] for e in errors.values()]) for who in names}
    found = [
        f"| error of lateral and spin force, maximum (rms) | {' | '.join(names)} |",
        "|---" * (1 + len(names)) + "|",
    ]
    for group, each in errors.items():
        sizes = [np.hypot(*error.T) for error in each.values()]
        parts = [f"{size.max():.4f} ({np.sqrt(np.mean(size**2)):.4f})" for size in sizes]
        found.append(f"| {group} | {' | '.join(parts)} |")
    return found


def fmu_lines() -> list[str]:
    """Nanoseconds of set, step and get of the FMUs."""
    found = ["| FMU, steps of 1 ms | set + step + get | goal |", "|---|---|---|"]
    with tempfile.TemporaryDirectory() as scratch:
        for subject, time in fmu_step.each(Path(scratch)):
            goal = "<= 200 ns" if "force" in subject else "<= 1000 ns"
            found.append(f"| {subject} | {time:.0f} ns | {goal} |")
    return found


def ensemble_rate(runs: int = 2 * bench_runs.FLEET, rounds: int = 3) -> float:
    """Simulated seconds a second of `cl.ensemble` on one core, scenarios and all."""
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "timed.toml"
        path.write_text(TIMED.format(seconds=SECONDS, runs=runs))
        sweep = cl.load_sweep(path)
    what = "cl.ensemble"
    case = Case(what, runs * SECONDS, "s/s", {what: lambda: cl.ensemble(sweep, workers=1)})
    return case.figure(what, interleaved(case, rounds=rounds)[what])


def traffic(chunk: int = bench_runs.FLEET) -> tuple[int, int, int]:
    """Runs of a sweep's chunk, and bytes that go to a worker for it and come back."""
    sweep = cl.load_sweep(SWEEP)
    results = run_chunk(sweep.plan, 0, sweep.values[:1])
    there = run_chunk, sweep.plan, 0, np.resize(sweep.values, (chunk, sweep.values.shape[1]))
    back = np.resize(results, (len(results), chunk))
    runs = chunk * len(sweep.plan.controllers)
    return runs, len(pickle.dumps(there)), len(pickle.dumps(back))


def plan_lines(measured: int = 2 * bench_runs.FLEET) -> list[str]:
    """Time of a million runs at the rate of so many that are measured."""
    rate = ensemble_rate(measured)
    runs, there, back = traffic()
    chunks = -(-MILLION // runs)
    moved = chunks * (there + back) / 1e6
    alone = MILLION * SECONDS / rate
    found = [
        f"A million runs of {SECONDS:g} s at {number(rate)} simulated seconds a second and core, "
        f"as cl.ensemble does with {measured} runs that differ in the vehicle, "
        f"in {chunks} chunks of {runs}: as {SWEEP} has them, {there} bytes go to a worker and "
        f"{back} come back for each, {moved:.0f} MB in all.",
        "",
        "| cores | planned time | traffic of the machine that keeps the results |",
        "|---|---|---|",
    ]
    for count in sorted({1, os.cpu_count() or 1, 32, 256}):
        minutes, flow = alone / count / 60.0, moved / (alone / count)
        found.append(f"| {count} | {minutes:.2g} min | {flow:.2g} MB/s |")
    return found


@click.command(help=__doc__)
@click.option("--points", default=bench_table.POINTS, help="Of arrays from Python.")
@click.option("--runs", default=bench_runs.RUNS, help="Of an ensemble.")
@click.option("--duration", default=10.0, help="Of a run [s].")
@click.option("--rounds", default=11, help="Turns of each subject.")
def main(points: int, runs: int, duration: float, rounds: int) -> None:
    """Check every rival, time all, print Markdown."""
    for module in (bench_table, bench_kernel, bench_runs):
        module.check()
    print(machine() + "\n")
    print("| what | ours | rival | times faster | goal |\n|---|---|---|---|---|")
    with one_core():
        small = min(points, bench_kernel.POINTS)
        timed = [*bench_kernel.cases(small), *bench_table.cases(points)]
        for case in timed:
            print("\n".join(rows(case, rounds=rounds)), flush=True)
    runs_cases = bench_runs.cases(runs, duration)
    for case in runs_cases[:-1]:
        with one_core():
            print("\n".join(rows(case, rounds=rounds)), flush=True)
    print("\n".join(rows(runs_cases[-1], rounds=rounds)))  # two threads need two cores
    print("\n" + QUOTED + "\n")
    print("\n".join(lateral_spin_lines()) + "\n", flush=True)
    with one_core():
        print("\n".join(accuracy_lines()) + "\n", flush=True)
        print("\n".join(fmu_lines()) + "\n", flush=True)
        print("\n".join(plan_lines()))


if __name__ == "__main__":
    main()
