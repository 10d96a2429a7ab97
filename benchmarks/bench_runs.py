"""Runs of a wet patch, one and many, beside solve_ivp and a batch in numba.

``python benchmarks/bench_runs.py`` times the same scenarios under the same sampled controller, and
prints the errors of their outcomes.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import wheelset_rival as rival
from timing import Call, compare, one_core
from wheelset_rival import OUTCOMES, drive_by_solve_ivp, records

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.runs.scenario_runs import DEFAULT_TOLERANCE, LONGEST_STEP, run_many
from contactlib.traction import Sensors
from contactlib.vehicle import Drivetrain

CONTROLLER = "creep"
SPEEDS = (10.0, 1.0)  # [m/s]
STEP, TOLERANCE = 1e-3, 1e-6  # [s, 1]
AS_IT_IS = DEFAULT_TOLERANCE, LONGEST_STEP  # tolerance and step [s] unless noted otherwise
FLEET = 2048  # runs of a thread: as many as `run_many` has side by side


def wet_patch(
    speed: float, *, duration: float = 10.0, friction: float = 0.545, torque: float = 23.5e3
) -> cl.Scenario:
    """A locomotive's wheelset that meets a wet patch after a fifth of its way.

    Its contact is the roller rig's line, whose law the rivals solve.

    Parameters
    ----------
    speed : float
        At the start [m/s].
    duration : float, optional
        [s].
    friction : float, optional
        Factor on friction in the patch [1].
    torque : float, optional
        Demand [N.m].
    """
    line = cl.load_model("roller_rig.toml").wheelset.element
    drivetrain = Drivetrain(replace(cl.load_model("locomotive.toml").wheelset, element=line))
    sensors = Sensors()
    controller = cl.traction.CreepPI.for_drivetrain(
        drivetrain,
        speed=speed,
        sensors=sensors,
        creepage_error=0.0,  # the rivals have exact sensors, too
    )
    way = speed * duration
    places = (0.2 * way, 0.2 * way, 0.6 * way, 0.6 * way)
    return replace(
        cl.load_scenario("dry_wet_dry.toml"),
        drivetrain=drivetrain,
        track=cl.Track(friction_left=cl.Profile(places, (1.0, friction, friction, 1.0))),
        sensors=sensors,
        demand=cl.Profile.of(torque),
        initial_speed=speed,
        design_speed=speed,
        duration=duration,
        controllers={CONTROLLER: controller},
    )


def many(n: int, speed: float, *, duration: float = 10.0) -> list[cl.Scenario]:
    """Scenarios of one vehicle that differ in the patch's friction and in the demand."""
    random = np.random.default_rng(0)
    first = wet_patch(speed, duration=duration)
    found = []
    for friction, torque in random.uniform((0.4, 22e3), (0.7, 24.5e3), (n, 2)).tolist():
        places = first.track.friction_left.at
        track = cl.Track(friction_left=cl.Profile(places, (1.0, friction, friction, 1.0)))
        found.append(replace(first, track=track, demand=cl.Profile.of(torque)))
    return found


@cache
def reference(speed: float, duration: float) -> tuple[FloatArray, FloatArray]:
    """Outcomes and creepages of the wet patch, right to 1e-10: Radau stopped at the corners."""
    (run,) = records([wet_patch(speed, duration=duration)], CONTROLLER)
    return drive_by_solve_ivp(
        run, duration, method="Radau", tolerance=1e-11, row=STEP, corners=True
    )


def accuracy(speed: float, duration: float) -> dict[str, float]:
    """Largest relative error of the outcomes against the reference, by who found them."""
    scenario = wet_patch(speed, duration=duration)
    given, found = records([scenario], CONTROLLER), {}
    for tolerance, step in ((1e-6, STEP), (1e-10, STEP), AS_IT_IS):
        outcomes = ensemble([scenario], tolerance, step)
        row = np.array([outcomes[name][0] for name in OUTCOMES])
        found[f"contactlib, tolerance {tolerance:g}, {1e3 * step:g} ms"] = row
    found["LSODA"], _ = drive_by_solve_ivp(given[0], duration, method="LSODA", tolerance=1e-6)
    (found["numba ROS2, 1 ms"],) = batch(given, duration)
    exact, _ = reference(speed, duration)
    return {who: float(np.max(np.abs(row / exact - 1.0))) for who, row in found.items()}


def batch(runs: Any, duration: float) -> FloatArray:
    """Outcomes of the batch in numba, (n, outcomes)."""
    found = np.empty((runs.size, len(OUTCOMES)))
    rival.drive_many(runs, round(duration / STEP), round(runs.sample_time[0] / STEP), found)
    return found


def ensemble(
    scenarios: list[cl.Scenario], tolerance: float = TOLERANCE, step: float = STEP
) -> dict[str, FloatArray]:
    """Outcomes of many runs."""
    return run_many(scenarios, CONTROLLER, OUTCOMES, step=step, tolerance=tolerance)


def main(runs: int = 1024, duration: float = 10.0, **how: Any) -> None:
    """Time one run with all its signals, and many whose outcomes are kept."""
    for speed in SPEEDS:
        scenarios = many(runs, speed, duration=duration)
        first, given = scenarios[0], records(scenarios, CONTROLLER)

        by_ivp = partial(
            drive_by_solve_ivp, given[0], duration, method="LSODA", tolerance=TOLERANCE
        )
        alone = partial(cl.run_scenario, first, CONTROLLER, step=STEP, tolerance=TOLERANCE)
        subjects: dict[str, Call] = {"run_scenario": alone, "solve_ivp LSODA": by_ivp}
        compare(f"one run at {speed:g} m/s, rows of 1 ms", duration, "s/s", subjects, **how)
        compare(
            f"{runs} runs at {speed:g} m/s",
            runs * duration,
            "s/s",
            {
                "run_many as it is": partial(ensemble, scenarios, *AS_IT_IS),
                "run_many, 1 ms, tolerance 1e-6": partial(ensemble, scenarios),
                "solve_ivp LSODA, first run only": by_ivp,
                "numba ROS2, 1 ms": partial(batch, given, duration),
            },
            less_work={"solve_ivp LSODA, first run only": duration},
            **how,
        )


def threads(runs: int = FLEET, duration: float = 2.0, **how: Any) -> None:
    """Fleets of their full size, by the wall's clock."""
    scenarios = many(2 * runs, SPEEDS[0], duration=duration)
    halves = scenarios[::2], scenarios[1::2]

    def part(some: list[cl.Scenario]) -> object:
        return ensemble(some, *AS_IT_IS)

    with ThreadPoolExecutor(2) as pool:
        subjects = {
            "2 threads": lambda: list(pool.map(part, halves)),
            "1 thread": lambda: [part(half) for half in halves],
        }
        what, work = f"{2 * runs} runs in 2 threads", 2 * runs * duration
        compare(what, work, "s/s", subjects, clock=time.perf_counter, **how)


if __name__ == "__main__":
    with one_core():
        main()
        for speed in SPEEDS:
            print(f"largest relative error at {speed:g} m/s:", accuracy(speed, 5.0))
    threads()  # needs two cores
