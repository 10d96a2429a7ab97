"""Runs of the wet patch, one and many, beside solve_ivp and a batch in numba.

All drive the same scenarios under the same sampled controller and report the same outcomes.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np
import wheelset_rival as rival
from timing import Call, Case
from wet_patch import CONTROLLER, STEP, many, wet_patch
from wheelset_batch import drive_many
from wheelset_ivp import drive_by_solve_ivp

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.runs.scenario_runs import DEFAULT_TOLERANCE, LONGEST_STEP, run_many

SPEEDS = (10.0, 1.0)  # [m/s]
TOLERANCE = 1e-6
AS_IT_IS = DEFAULT_TOLERANCE, LONGEST_STEP  # tolerance and step [s] unless noted otherwise
RUNS = 1024
FLEET = 2048  # runs of a thread: as many as `run_many` has side by side
OUTCOMES = ("distance", "largest_creepage", "slip_work")


@cache
def reference(speed: float, duration: float) -> tuple[FloatArray, FloatArray]:
    """Outcomes and creepages of the wet patch, right to 1e-10: Radau stopped at the corners."""
    given = rival.numbers(wet_patch(speed, duration=duration), CONTROLLER)
    return drive_by_solve_ivp(
        given, duration, method="Radau", tolerance=1e-11, row=STEP, corners=True
    )


def errors(found: FloatArray, exact: FloatArray) -> float:
    """Largest relative error of the outcomes that all of them have."""
    return float(np.max(np.abs(found / exact - 1.0)))


def of_all(outcomes: FloatArray) -> FloatArray:
    """What `OUTCOMES` names of what the rivals find, (..., outcomes)."""
    return outcomes[..., [rival.OUTCOMES.index(name) for name in OUTCOMES]]


def accuracy(speed: float, duration: float) -> dict[str, float]:
    """Largest relative error of the outcomes against the reference, by who found them."""
    exact = of_all(reference(speed, duration)[0])
    scenario = wet_patch(speed, duration=duration)
    found = {}
    for tolerance, step in ((1e-6, STEP), (1e-10, STEP), AS_IT_IS):
        ours = ensemble([scenario], tolerance, step)
        row = np.array([ours[name][0] for name in OUTCOMES])
        found[f"contactlib, tolerance {tolerance:g}, {1e3 * step:g} ms"] = errors(row, exact)
    given = rival.numbers(scenario, CONTROLLER)
    by_ivp, _ = drive_by_solve_ivp(given, duration, method="LSODA", tolerance=1e-6)
    found["LSODA, tolerance 1e-06"] = errors(of_all(by_ivp), exact)
    if rival.numba is not None:
        by_numba = batch(rival.records([scenario], CONTROLLER), duration)
        found["numba ROS2, 1 ms"] = errors(of_all(by_numba)[0], exact)
    return found


def batch(runs: Any, duration: float) -> FloatArray:
    """Outcomes of the batch in numba, (n, outcomes)."""
    found = np.empty((runs.size, len(rival.OUTCOMES)))
    drive_many(runs, round(duration / STEP), round(runs.sample_time[0] / STEP), found)
    return found


def check(duration: float = 1.0) -> None:
    """Every rival finds what the reference finds, and the creepages in between.

    Raises
    ------
    AssertionError
        If one does not.
    """
    for speed in SPEEDS:
        outcomes, creepages = reference(speed, duration)
        for name, error in accuracy(speed, duration).items():
            as_it_is, fine = (2e-4, 1e-6) if speed >= 10.0 else (2e-3, 2e-6)
            limits = {"10 ms": as_it_is, "numba": 2e-3, "LSODA": 2e-4, "contactlib": fine}
            limit = next(limit for word, limit in limits.items() if word in name)
            assert error < limit, f"{name} at {speed} m/s: {error}"
        result = cl.run_scenario(wet_patch(speed, duration=duration), CONTROLLER, step=STEP)
        largest = np.abs(creepages).max()
        assert np.abs(result["creepage"] - creepages).max() < 1e-4 * largest
        assert abs(result["speed"][-1] / outcomes[rival.OUTCOMES.index("speed")] - 1.0) < 1e-6


def cases(runs: int = RUNS, duration: float = 10.0, fleet: int = FLEET) -> list[Case]:
    """What is timed."""
    each = [_ensemble(runs, speed, duration) for speed in SPEEDS]
    return [_single(duration), *each, _threads(fleet, 0.2 * duration)]


def ensemble(
    scenarios: list[cl.Scenario], tolerance: float = TOLERANCE, step: float = STEP
) -> dict[str, FloatArray]:
    """Outcomes of many runs."""
    return run_many(scenarios, CONTROLLER, OUTCOMES, step=step, tolerance=tolerance)


def _by_ivp(given: dict[str, float], duration: float) -> Call:
    return lambda: drive_by_solve_ivp(given, duration, method="LSODA", tolerance=TOLERANCE)


def _single(duration: float) -> Case:
    """One run with all its signals."""
    scenario = wet_patch(SPEEDS[0], duration=duration)
    given = rival.numbers(scenario, CONTROLLER)
    return Case(
        f"one run at {SPEEDS[0]:g} m/s, rows of 1 ms",
        duration,
        "s/s",
        {
            "run_scenario": lambda: cl.run_scenario(
                scenario, CONTROLLER, step=STEP, tolerance=TOLERANCE
            ),
            "solve_ivp LSODA": _by_ivp(given, duration),
        },
    )


def _ensemble(runs: int, speed: float, duration: float) -> Case:
    """Many runs that differ in friction and demand; only outcomes are kept."""
    scenarios = many(runs, speed, duration=duration)
    given = rival.numbers(scenarios[0], CONTROLLER)
    found: dict[str, Call] = {
        "run_many as it is": lambda: ensemble(scenarios, *AS_IT_IS),
        "run_many, 1 ms, tolerance 1e-6": lambda: ensemble(scenarios),
        "solve_ivp LSODA, first run only": _by_ivp(given, duration),
    }
    if rival.numba is not None:
        records = rival.records(scenarios, CONTROLLER)
        found["numba ROS2, 1 ms"] = lambda: batch(records, duration)
    return Case(
        f"{runs} runs at {speed:g} m/s",
        runs * duration,
        "s/s",
        found,
        {"": ">= 15 000", "solve_ivp LSODA, first run only": ">= 100"},
        ours=2,
        less_work={"solve_ivp LSODA, first run only": duration},
    )


def _threads(runs: int, duration: float) -> Case:
    """Fleets of their full size, by the wall's clock."""
    scenarios = many(2 * runs, SPEEDS[0], duration=duration)
    pool = ThreadPoolExecutor(2)
    halves = scenarios[::2], scenarios[1::2]

    def part(some: list[cl.Scenario]) -> object:
        return ensemble(some, *AS_IT_IS)

    return Case(
        f"{2 * runs} runs in 2 threads",
        2 * runs * duration,
        "s/s",
        {
            "2 threads": lambda: list(pool.map(part, halves)),
            "1 thread": lambda: [part(half) for half in halves],
        },
        {"1 thread": ">= 1.8"},
        clock=time.perf_counter,
    )
