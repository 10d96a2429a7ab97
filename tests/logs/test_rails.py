"""Friction along the rails behind logs whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contactlib as cl
from contactlib.logs import Log, LogErrors, RailsEstimate, estimate_rails
from contactlib.logs.friction import GRID, walk
from contactlib.logs.motion import Motion
from contactlib.vehicle import Variation


def noisy(scenario: cl.Scenario, controller: str, seed: int) -> tuple[Log, list[float]]:
    """The log of a run at 100 Hz with the usual errors, and its logarithms of radii and torque."""
    rng, run = np.random.default_rng(seed), cl.run_scenario(scenario, controller, index=seed)
    rows = slice(None, None, round(0.01 / run.time[1]))
    true = Log.of(run)
    omega, radius = true.omega[rows], scenario.drivetrain.wheelset.radius
    larger, gain = rng.normal(0.0, 0.005, omega.shape[1]), float(rng.normal(0.0, 0.02))
    log = Log(
        time=run.time[rows],
        drive_torque=true.drive_torque[rows] * np.exp(-gain),
        omega=(omega + rng.normal(0.0, 0.01 / radius, omega.shape)) * np.exp(-larger),
        speed=run["speed"][rows] + rng.normal(0.0, 0.02, run.time[rows].shape),
    )
    return log, [*(float(one) for one in np.atleast_1d(larger)), gain]


@cache
def estimated() -> tuple[cl.Scenario, RailsEstimate, list[float]]:
    """Locomotive in traction, whose slip cleans the rails for the axles behind."""
    case = replace(cl.load_scenario("four_axles.toml"), duration=12.0)
    log, constants = noisy(case, "creep_pi", 5)
    return case, estimate_rails(log, case, draws=16), constants


def covered(case: cl.Scenario, estimate: RailsEstimate) -> tuple[np.ndarray, np.ndarray]:
    """Whether the interval has the true factor in each section, and the error of the median."""
    true = case.rails.friction_scale(estimate.place, 0.0)[:, 0]
    there = estimate.met.any(axis=1)
    inside = (estimate.low <= true) & (true <= estimate.high)
    return inside[there], np.log(estimate.median / true)[there & estimate.informative]


def test_friction_before_cleaning_radii_and_torque_are_found() -> None:
    case, estimate, constants = estimated()
    inside, error = covered(case, estimate)
    assert inside.mean() > 0.85
    assert np.sqrt(np.mean(error**2)) < 0.07
    assert error.size > 0.5 * inside.size
    for (value, spread), true in zip(estimate.constants.values(), constants, strict=True):
        assert abs(value - true) < 3.5 * spread
    assert estimate.constants["radius_1"][1] < 0.2 * estimate.errors.radius
    assert not estimate.doubts


def test_the_scenario_runs_on_the_rails_that_were_found() -> None:
    """It reproduces the slip of the log, whose controller is its own, within the patch."""
    case, estimate, _ = estimated()
    again, first = estimate.replayed("creep_pi"), cl.run_scenario(case, "creep_pi", index=5)
    assert again["speed"][-1] == pytest.approx(first["speed"][-1], rel=0.01)
    assert again["creep_work"].sum() > 0.0
    drawn = estimate.scenario_on(estimate.draws[0])
    assert drawn.rails.friction_left(estimate.place).tolist() == pytest.approx(
        estimate.draws[0].tolist()
    )


def test_files_hold_the_estimate(tmp_path: Path) -> None:
    _, estimate, _ = estimated()
    estimate.write(tmp_path / "found")
    rows = np.genfromtxt(tmp_path / "found" / "rails.csv", delimiter=",", names=True)
    assert rows.size == estimate.met.sum()
    assert (rows["low"] <= rows["friction"]).all()
    assert (rows["friction"] <= rows["high"]).all()
    mapped = np.loadtxt(tmp_path / "found" / "track.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(mapped[:, 1], estimate.median, rtol=1e-5)
    assert "torque over the log's" in (tmp_path / "found" / "rails.txt").read_text()
    found = estimate.to_xarray()
    assert found["draws"].dims == ("draw", "distance")


def test_the_gradient_of_the_motion_is_its_difference() -> None:
    """Of the cost by states and constants, whose walk weighs as its derivative."""
    case = replace(cl.load_scenario("dry_wet_dry.toml"), duration=2.0)
    log, _ = noisy(case, "creep_pi", 2)
    motion = Motion(case, log.rows(case), LogErrors())
    rng = np.random.default_rng(3)
    n = motion.count
    states = np.column_stack([motion.rows.omega, motion.rows.speed, np.full(n, -0.2)])
    states += rng.normal(0.0, 1e-3, states.shape)
    constants = np.array([2e-3, 0.01])
    blocks = motion._blocks(states, constants)
    there = rng.normal(0.0, 1.0, states.shape) * [1e-4, 1e-4, 1e-3]
    more = np.array([1e-5, 1e-4])
    ends = [motion._cost(states + s * there, constants + s * more) for s in (-0.1, 0.1)]
    slope = float(np.sum(blocks.gradient * there) + blocks.slope @ more)
    assert (ends[1] - ends[0]) / 0.2 == pytest.approx(slope, rel=1e-3)


def test_two_steps_of_the_walk_are_one_of_two_metres() -> None:
    """Up to its tails."""
    step = walk(LogErrors(), 1.0)
    np.testing.assert_allclose(step.sum(axis=1), 1.0, rtol=1e-12)
    middle = np.abs(GRID - GRID[60]) < 0.3
    twice, once = ((step @ step)[60, middle], walk(LogErrors(), 2.0)[60, middle])
    assert twice.sum() == pytest.approx(once.sum(), rel=0.02)


@pytest.mark.slow
def test_intervals_cover_the_truth_of_many_logs() -> None:
    """Three vehicles, four controllers, rails that vary at random; also rather too wide."""
    rng = np.random.default_rng(7)
    inside, errors, scores = list[bool](), list[float](), list[float]()
    for i in range(12):
        name, controllers = (
            ("four_axles.toml", ["creep_pi"]),
            ("coach_braking.toml", ["wsp"]),
            ("dry_wet_dry.toml", ["threshold", "creep_pi", "slope_seeking"]),
        )[i % 3]
        case = cl.load_scenario(name)
        variation = Variation(
            standard_deviation=rng.uniform(0.05, 0.3),
            correlation_length=rng.uniform(10.0, 60.0),
            seed=float(rng.integers(1000)),
        )
        speed = min(case.initial_speed, 22.0)
        case = replace(case, duration=20.0, variation=variation, initial_speed=speed)
        log, constants = noisy(case, controllers[i // 3 % len(controllers)], i)
        estimate = estimate_rails(log, case)
        covers, error = covered(case, estimate)
        inside += covers.tolist()
        errors += error.tolist()
        found = estimate.constants.values()
        scores += [(v - t) / s for (v, s), t in zip(found, constants, strict=True)]
    assert 0.85 < np.mean(inside) < 0.995
    assert np.sqrt(np.mean(np.square(errors))) < 0.1
    assert np.mean(np.abs(scores) < 1.645) > 0.85
