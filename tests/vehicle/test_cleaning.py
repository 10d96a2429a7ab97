"""Friction that slip work raises: of a wheel on its own rail, and of a train's axles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contactlib as cl
from contactlib.traction import OpenLoop, Sensors

RATE = 1e-4
WET = cl.Profile((100.0, 100.0), (0.5, 0.35))
DIRTY = cl.Track(friction_left=WET, cleaning=RATE, recovered=0.9)


def sliding(track: cl.Track, duration: float = 6.0) -> cl.Scenario:
    """Wheels that lock on slippery rails."""
    case = cl.load_scenario("wheel_slide_protection.toml")
    return replace(case, track=track, duration=duration, controllers={"open_loop": OpenLoop()})


def test_works_add_up_and_friction_never_falls() -> None:
    once = DIRTY.cleaned(DIRTY.cleaned(0.35, 3e3), 8e3)
    assert once == pytest.approx(float(DIRTY.cleaned(0.35, 11e3)), rel=1e-14)
    assert DIRTY.cleaned(0.35, 1.0 / RATE) == pytest.approx(0.35 + 0.55 * (1.0 - np.exp(-1.0)))
    assert DIRTY.cleaned([0.35, 1.2], [1e9, 1e9]).tolist() == [0.9, 1.2]
    assert DIRTY.cleaned(0.35, 0.0) == 0.35


def test_without_cleaning_no_bit_changes() -> None:
    plain = cl.Track(friction_left=WET)
    run, other = (
        cl.run_scenario(sliding(track), "open_loop")
        for track in (plain, replace(plain, recovered=0.7))
    )
    for signal in run.signals:
        assert np.array_equal(run[signal], other[signal], equal_nan=True), signal


def slip_work(run: cl.Result, side: str, radius: float) -> np.ndarray:
    """Slip work per length of a wheel [J/m]."""
    slip = radius * run[f"omega_{side}"] - run["speed"]
    return np.maximum(run[f"creep_force_{side}"] * slip / np.abs(run["speed"]), 0.0)


def test_a_wheel_cleans_the_rail_that_it_is_on() -> None:
    """The friction of a row is the law of its own work, of each side."""
    track = replace(DIRTY, friction_right=cl.Profile.of(1.0))
    run = cl.run_scenario(sliding(track), "open_loop")
    for side, before in (("left", WET(run["distance"])), ("right", np.ones(run.time.size))):
        expected = track.cleaned(before, slip_work(run, side, 0.5))
        np.testing.assert_allclose(run[f"friction_scale_{side}"], expected, atol=1e-6)
    assert np.ptp(run["friction_scale_right"]) == 0.0
    assert run["friction_scale_left"].max() > 0.5
    assert np.abs(run["energy_defect"]).max() < 1e-6 * abs(run["drive_work"][-1])


def test_cleaning_shortens_a_slide() -> None:
    clean, dirty = (
        cl.run_scenario(sliding(replace(DIRTY, cleaning=rate), 20.0), "open_loop")
        for rate in (RATE, 0.0)
    )
    assert clean["speed"][-1] < dirty["speed"][-1] - 3.0


def test_many_are_one_by_one() -> None:
    cases = [sliding(replace(DIRTY, cleaning=rate)) for rate in (0.0, 1e-5, 1e-4)]
    together, singles = cl.Plant(cases), [cl.Plant(case) for case in cases]
    for _ in range(300):
        for plant in (together, *singles):
            plant.step(-1.2e4)
        assert together["speed"].shape == (3,)  # to look does not change what follows
    friction = together["friction_scale_left"]
    np.testing.assert_array_equal(friction, [plant["friction_scale_left"] for plant in singles])
    assert friction[0] < friction[1] < friction[2]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_axles_find_what_those_in_front_have_done(direction: float) -> None:
    """The friction of each is the law of all work at its place, summed from the run's own rows."""
    scenario = cl.load_scenario("four_axles.toml")
    ends, left = (30.0, 30.0, 130.0, 130.0), (1.0, 0.545, 0.545, 1.0)
    dirty = cl.Profile(tuple(direction * end for end in ends)[:: int(direction)], left)
    track = replace(scenario.track, friction_left=dirty, friction_right=cl.Profile.of(0.7))
    scenario = replace(
        scenario,
        track=track,
        sensors=Sensors(),
        initial_speed=direction * scenario.initial_speed,
        demand=cl.Profile((1.0, 2.0), (0.0, direction * 24e3)),
        duration=8.0,
    )
    run = cl.run_scenario(scenario, "open_loop", step=1e-3)
    radius = scenario.drivetrain.wheelset.radius
    for side, rails in (("left", dirty), ("right", track.friction_right)):
        assert isinstance(rails, cl.Profile)
        axles = [run.axle(i) for i in range(1, 5)]
        done = [slip_work(axle, side, radius) for axle in axles]
        for i, axle in enumerate(axles):
            at, work = axle["distance"], done[i].copy()
            for other, theirs in zip(axles, done, strict=True):
                if direction * (other["distance"] - at)[0] > 0.0:
                    reached = direction * (at - other["distance"][0]) > 0.2
                    there = np.interp(direction * at, direction * other["distance"], theirs)
                    work += np.where(reached, there, 0.0)
            expected = track.cleaned(rails(at), work)
            error = np.abs(axle[f"friction_scale_{side}"] - expected)
            assert error.mean() < 1e-3
            assert np.quantile(error, 0.99) < 0.02  # nodes of the rails are 0.1 m apart


@pytest.mark.parametrize("cleaning", [3e-5, 1e-4])
def test_an_axle_may_spin_onto_slippery_rails(cleaning: float) -> None:
    """What its slip has just done there does not feed back on itself from substep to substep."""
    scenario = cl.load_scenario("four_axles.toml")
    slippery = cl.Profile((30.0, 30.0), (1.0, 0.2))
    track = replace(scenario.track, friction_left=slippery, cleaning=cleaning)
    demand = cl.Profile((0.0, 1.0), (0.0, 60e3))
    scenario = replace(scenario, track=track, initial_speed=24.0, demand=demand, duration=1.6)
    run = cl.run_scenario(scenario, "open_loop", tolerance=1e-6)
    assert run["distance"][-1, 0] > 35.0
    assert run["creepage"].max() > 1.0


@pytest.mark.parametrize("cleaning", [1e-3, 0.0])
def test_rows_do_not_matter(cleaning: float) -> None:
    """Loads and rails follow within a row, at the integrator's own substeps."""
    scenario = cl.load_scenario("four_axles.toml")
    track = replace(scenario.track, cleaning=cleaning)
    scenario = replace(scenario, track=track, duration=8.0)
    fine, coarse = (cl.run_scenario(scenario, "creep_pi", step=step) for step in (1e-3, 5e-3))
    friction = scenario.drivetrain.wheelset.element.friction.kinetic * coarse["axle_load"]
    error = np.abs(coarse["creep_force"] - fine["creep_force"][::5]) / friction
    assert error.max() < 1e-4
    assert error.mean() < 1e-5


def test_limits() -> None:
    with pytest.raises(ValueError, match=r"^Track\.cleaning = -1.0 is out of range: must be"):
        replace(DIRTY, cleaning=-1.0)
    with pytest.raises(ValueError, match=r"^Track\.recovered = 0.0 is out of range: must be"):
        replace(DIRTY, recovered=0.0)
