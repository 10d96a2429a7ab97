"""Friction along the rails behind logs whose truth is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from rails_from_logs import MISTAKES, logged, rails_line, scenario_of, sums_of_rails

import contactlib as cl
from contactlib.logs import Log, LogErrors, LogPriors, RailsEstimate, estimate_rails
from contactlib.logs.friction import (
    GRID,
    Rails,
    first_guess,
    force_errors,
    likelihoods,
    means,
    walk,
)
from contactlib.logs.motion import TORQUE, Motion


@cache
def run(name: str, duration: float) -> tuple[cl.Scenario, cl.Result, Log, list[float]]:
    """A run of a shipped scenario, and its log with the usual errors."""
    case = replace(cl.load_scenario(name), duration=duration)
    result = cl.run_scenario(case, "creep_pi", index=5)
    return case, result, *logged(case, result, np.random.default_rng(5))


@cache
def estimated() -> tuple[cl.Scenario, RailsEstimate, list[float]]:
    """Locomotive in traction, whose slip cleans the rails for the axles behind."""
    case, _, log, constants = run("four_axles.toml", 12.0)
    return case, estimate_rails(log, case, draws=16), constants


def short(priors: LogPriors | None = None) -> Motion:
    """Two seconds of a wheelset, whose speed is not known in the last one."""
    case, _, log, _ = run("dry_wet_dry.toml", 3.0)
    omega = np.where(log.time[:, np.newaxis] < 2.0, log.omega, np.nan)
    rows = replace(log, omega=omega).rows(case)
    return Motion(case, rows, LogErrors(), priors or LogPriors())


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
    """Wheel speeds differ from the log's by at most four times what other noise makes of them."""
    case, estimate, _ = estimated()
    first, again = run("four_axles.toml", 12.0)[1], estimate.replayed("creep_pi")
    other = cl.run_scenario(case, "creep_pi", index=6)
    differ = [np.std(one["omega"] - first["omega"]) for one in (again, other)]
    assert differ[0] < 4.0 * differ[1]
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
    motion = short(LogPriors(mass=0.1, delay=0.02, slope=0.2, decay=0.3))
    rng = np.random.default_rng(3)
    n = motion.count
    states = np.column_stack([2.0 * motion.rows.speed, motion.rows.speed, np.full(n, -0.2)])
    states += rng.normal(0.0, 1e-3, states.shape)
    constants = np.array([2e-3, 0.01, 0.05, 1.3e-3, -0.1, 0.2])
    blocks = motion._blocks(states, constants, motion._residuals(states, constants))
    there = rng.normal(0.0, 1.0, states.shape) * [1e-4, 1e-4, 1e-3]
    more = np.array([1e-5, 1e-4, 1e-4, 1e-5, 1e-4, 1e-4])
    moved = [(states + s * there, constants + s * more) for s in (-0.1, 0.1)]
    ends = [motion._cost(*one, motion._residuals(*one)) for one in moved]
    slope = float(np.sum(blocks.gradient * there) + blocks.slope @ more)
    assert (ends[1] - ends[0]) / 0.2 == pytest.approx(slope, rel=1e-3)


@pytest.mark.parametrize(("seed", "controller"), [(39, "slope_seeking"), (45, "threshold")])
def test_rough_rails_do_not_look_like_a_larger_wheel(seed: int, controller: str) -> None:
    """A log without errors: the wheel has its nominal radius."""
    case = scenario_of("dry_wet_dry.toml", np.random.default_rng(seed))
    log = Log.of(cl.run_scenario(case, controller, index=seed))
    motion = Motion(case, log.rows(case), LogErrors(), LogPriors())
    motion.solve(*first_guess(motion, np.zeros(1)))
    assert abs(motion.constants[0]) < 1.645 * np.sqrt(motion.covariance[0, 0])


def torque_of(case: cl.Scenario, log: Log) -> float:
    """Logarithm of the torque that moves a vehicle, over the log's."""
    motion = Motion(case, log.rows(case), LogErrors(), LogPriors())
    motion.solve(*first_guess(motion, np.array(case.position)))
    return float(motion.constants[TORQUE])


def test_a_coach_that_brakes_on_dry_rails_shows_its_torque() -> None:
    case = replace(cl.load_scenario("coach_braking.toml"), track=cl.Track(), duration=8.0)
    log = Log.of(cl.run_scenario(replace(case, initial_speed=13.0), "wsp", step=0.01))
    assert torque_of(case, log) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 6, 19])
def test_noise_of_wheel_speeds_does_not_look_like_torque(seed: int) -> None:
    """The creep force of a slip that is noisy is less than that of its mean."""
    case = scenario_of("coach_braking.toml", np.random.default_rng(seed))
    run = cl.run_scenario(replace(case, initial_speed=13.0), "wsp", index=seed, step=0.01)
    rng, noise = np.random.default_rng(0), 0.01 / case.drivetrain.wheelset.radius
    log = Log.of(run)
    noisy = replace(log, omega=log.omega + rng.normal(0.0, noise, log.omega.shape))
    assert abs(torque_of(case, noisy) - torque_of(case, log)) < 0.005


def test_two_steps_of_the_walk_are_one_of_two_metres() -> None:
    """Up to its tails."""
    step = walk(LogErrors(), 1.0)
    np.testing.assert_allclose(step.sum(axis=1), 1.0, rtol=1e-12)
    middle = np.abs(GRID - GRID[60]) < 0.3
    twice, once = ((step @ step)[60, middle], walk(LogErrors(), 2.0)[60, middle])
    assert twice.sum() == pytest.approx(once.sum(), rel=0.02)


def test_a_wheel_whose_speed_is_missing_tells_nothing() -> None:
    motion = short()
    speed = motion.rows.speed
    at = means(motion.rows, 2.0 * speed[:, np.newaxis], speed, np.zeros(1))
    constants = np.zeros(motion.spread.size)
    unsure = force_errors(motion, at, constants)
    found = likelihoods(motion, at, constants, unsure)[:, 0]
    known = at.time < 2.0
    assert (found[~known] == 0.0).all()
    assert (found[known] != 0.0).any(axis=1).all()


def test_evidence_adds_up_to_the_probability_of_all_that_was_met() -> None:
    motion = short()
    at = means(motion.rows, motion.rows.omega, motion.rows.speed, np.zeros(1))
    rails, rng = Rails(at, LogErrors(), 8.0), np.random.default_rng(1)
    likelihood = rng.normal(0.0, 1.0, (rails.place.size, 1, GRID.size))
    probability = rails._first * np.exp(likelihood[0, 0])
    for section in likelihood[1:, 0]:
        probability = probability @ rails._step * np.exp(section)
    assert np.exp(rails.evidence(likelihood).sum()) == pytest.approx(probability.sum())


def test_a_log_without_vehicle_speed_is_refused() -> None:
    case, _, log, _ = run("dry_wet_dry.toml", 3.0)
    with pytest.raises(ValueError, match="speed: the log has no vehicle speed"):
        estimate_rails(replace(log, speed=None), case)


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
    run = cl.run_scenario(other, controller, index=seed)
    log, (radius, gain) = logged(other, run, np.random.default_rng(seed), delay=TRUE["delay"])
    return case, log, {"radius_1": radius, "torque": gain, **TRUE}


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


@pytest.mark.parametrize(("off", "doubted"), [(2.6, 1), (-2.6, 1), (2.4, 0)])
def test_a_constant_that_moved_too_far_is_doubted(off: float, doubted: int) -> None:
    """By the variance that the log took away: 0.02^2 = 0.016^2 + 0.012^2."""
    estimate = replace(estimated()[1], constants={"torque": (off * 0.016, 0.012)}, conflicts=())
    assert sum("torque is" in one for one in estimate.doubts) == doubted


def test_columns_of_two_axles_that_are_mixed_are_doubted() -> None:
    case, _, log, _ = run("four_axles.toml", 12.0)
    mixed = replace(log, omega=log.omega[:, [3, 1, 2, 0]])
    (doubt,) = estimate_rails(mixed, case, draws=4).doubts
    assert doubt.startswith(("axle 1", "axle 4"))
    assert "most clearly" in doubt


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
    """Vehicles, controllers, rails and noise are drawn at random; half of the logs have faults."""
    found = sums_of_rails([rails_line(seed) for seed in range(40)])
    assert 0.85 < found["inside"] < 0.99
    assert found["rms"] < 0.1
    assert found["radii_inside"] > 0.85
    assert found["gain_inside"] > 0.75
    assert found["doubted"] <= 0.1


@pytest.mark.slow
@pytest.mark.parametrize("mistake", MISTAKES)
def test_logs_of_another_vehicle_are_doubted(mistake: str) -> None:
    """But for that of a wheelset alone, every third one, with another law."""
    lines = [rails_line(seed, mistake, draws=4) for seed in range(6)]
    assert sums_of_rails(lines)["doubted"] > (0.5 if mistake == "law" else 0.7)
