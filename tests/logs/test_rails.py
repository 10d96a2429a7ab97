"""Friction along the rails behind logs whose truth is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contactlib as cl
from contactlib.logs import Log, LogErrors, LogPriors, RailsEstimate, estimate_rails
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
    assert estimate.constants["radius_1"][1] < 0.2 * estimate.priors["radius_1"]
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
    table = np.genfromtxt(
        tmp_path / "found" / "constants.csv", delimiter=",", names=True, dtype=None, encoding=None
    )
    assert table["name"].tolist() == list(estimate.constants)
    assert table["narrowed_"] == pytest.approx(
        100.0 * (1.0 - table["standard_deviation"] / table["prior"]), abs=1e-3
    )
    assert "torque [1]: " in (tmp_path / "found" / "rails.txt").read_text()
    found = estimate.to_xarray()
    assert found["draws"].dims == ("draw", "distance")


def test_the_gradient_of_the_motion_is_its_difference() -> None:
    """Of the cost by states and all constants, whose walk weighs as its derivative."""
    case = replace(cl.load_scenario("dry_wet_dry.toml"), duration=2.0)
    log, _ = noisy(case, "creep_pi", 2)
    priors = LogPriors(mass=0.1, delay=0.02, slope=0.2, decay=0.3)
    motion = Motion(case, log.rows(case), LogErrors(), priors)
    rng = np.random.default_rng(3)
    n = motion.count
    states = np.column_stack([motion.rows.omega, motion.rows.speed, np.full(n, -0.2)])
    states += rng.normal(0.0, 1e-3, states.shape)
    constants = np.array([2e-3, 0.01, 0.05, 1.3e-3, -0.1, 0.2])
    blocks = motion._blocks(states, constants, motion._residuals(states, constants))
    there = rng.normal(0.0, 1.0, states.shape) * [1e-4, 1e-4, 1e-3]
    more = np.array([1e-5, 1e-4, 1e-4, 1e-5, 1e-4, 1e-4])
    moved = [(states + s * there, constants + s * more) for s in (-0.1, 0.1)]
    ends = [motion._cost(*one, motion._residuals(*one)) for one in moved]
    slope = float(np.sum(blocks.gradient * there) + blocks.slope @ more)
    assert (ends[1] - ends[0]) / 0.2 == pytest.approx(slope, rel=1e-3)


def test_two_steps_of_the_walk_are_one_of_two_metres() -> None:
    """Up to its tails."""
    step = walk(LogErrors(), 1.0)
    np.testing.assert_allclose(step.sum(axis=1), 1.0, rtol=1e-12)
    middle = np.abs(GRID - GRID[60]) < 0.3
    twice, once = ((step @ step)[60, middle], walk(LogErrors(), 2.0)[60, middle])
    assert twice.sum() == pytest.approx(once.sum(), rel=0.02)


def with_mass(case: cl.Scenario, factor: float) -> cl.Scenario:
    """One wheelset with another mass."""
    body = case.drivetrain.wheelset
    assert body.mass is not None
    body = replace(body, mass=factor * body.mass)
    return replace(case, drivetrain=replace(case.drivetrain, wheelset=body))


TRUE = {"mass": np.log(1.1), "delay": 0.02, "slope": np.log(0.8)}


@cache
def off(controller: str, seed: int) -> tuple[cl.Scenario, Log, Mapping[str, float]]:
    """A scenario, the log of a heavier run on a softer contact, late torques; all constants."""
    case = replace(cl.load_scenario("dry_wet_dry.toml"), duration=12.0)
    soft = replace(case.track, slope=cl.Profile((0.0,), (np.exp(TRUE["slope"]),)))
    other = replace(with_mass(case, np.exp(TRUE["mass"])), track=soft)
    log, (radius, gain) = noisy(other, controller, seed)
    torque = np.interp(log.time - TRUE["delay"], log.time, log.drive_torque[:, 0])
    late = replace(log, drive_torque=torque[:, np.newaxis])
    return case, late, {"radius_1": radius, "torque": gain, **TRUE}


def test_mass_delay_and_slope_are_found() -> None:
    case, log, true = off("slope_seeking", 4)
    priors = LogPriors(mass=0.1, delay=0.02, slope=0.2)
    estimate = estimate_rails(log, case, priors=priors, draws=4)
    assert estimate.constants.keys() == true.keys()
    for name, (value, spread) in estimate.constants.items():
        assert abs(value - true[name]) < 2.5 * spread
        assert spread < 0.5 * estimate.priors[name] or name == "torque"
    found, given = (one.drivetrain.wheelset for one in (estimate.scenario, case))
    slope = found.element.slope_reduction / given.element.slope_reduction
    assert np.log(slope) == pytest.approx(estimate.constants["slope"][0])


def test_mass_and_torque_go_together() -> None:
    """If both are unknown, and the slope too; with the torque known the mass is found."""
    case, log, _ = off("slope_seeking", 4)
    sentence = "torque and mass cannot be separated"
    priors = LogPriors(torque=0.1, mass=0.1, delay=0.02, slope=0.5)
    both = estimate_rails(log, case, priors=priors, draws=4)
    assert sentence in both.summary()
    one = estimate_rails(log, case, priors=replace(priors, torque=0.0), draws=4)
    assert sentence not in one.summary()
    assert "torque" not in one.constants
    assert one.constants["mass"][1] < 0.3 * one.priors["mass"]


def test_all_constants_may_be_known(tmp_path: Path) -> None:
    case, log, _ = off("slope_seeking", 4)
    estimate = estimate_rails(log, case, priors=LogPriors(radius=0.0, torque=0.0), draws=4)
    estimate.write(tmp_path)
    assert not estimate.constants
    assert (tmp_path / "constants.csv").read_text().count("\n") == 1


def test_refusals() -> None:
    case, log, _ = off("slope_seeking", 4)
    coulomb = replace(
        case.drivetrain.wheelset.element.friction, slip_rate_residual=1.0, slip_rate_decay=0.0
    )
    body = case.drivetrain.wheelset
    body = replace(body, element=replace(body.element, friction=coulomb))
    plain = replace(case, drivetrain=replace(case.drivetrain, wheelset=body))
    soft = replace(case.track, slope=cl.Profile((0.0, 9.0), (1.0, 0.3)))
    with pytest.raises(ValueError, match=r"decay = 0\.1 must be 0: the scenario's friction has no"):
        estimate_rails(log, plain, priors=LogPriors(decay=0.1))
    with pytest.raises(ValueError, match=r"slope changes from 0\.3 to 1: must be constant"):
        estimate_rails(log, replace(case, track=soft))


@pytest.mark.slow
def test_constants_of_many_logs_are_covered() -> None:
    scores = list[float]()
    for controller in ("threshold", "creep_pi", "slope_seeking"):
        for seed in range(4, 8):
            case, log, true = off(controller, seed)
            priors = LogPriors(mass=0.1, delay=0.02, slope=0.2)
            found = estimate_rails(log, case, priors=priors, draws=4).constants
            scores += [(value - true[name]) / spread for name, (value, spread) in found.items()]
    assert np.mean(np.abs(scores) < 1.645) > 0.8
    assert np.sqrt(np.mean(np.square(scores))) < 1.3


@pytest.mark.slow
def test_intervals_cover_the_truth_of_many_logs() -> None:
    """Three vehicles, four controllers, rails that vary at random."""
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
    assert 0.85 < np.mean(inside) < 0.96
    assert np.sqrt(np.mean(np.square(errors))) < 0.08
    assert np.mean(np.abs(scores) < 1.645) > 0.85
