"""Friction that slip work raises: of a wheel on its own rail, and of a train's axles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contactlib as cl
from contactlib.traction import OpenLoop
from contactlib.vehicle import RailState
from contactlib.vehicle.track import CELL

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


def test_a_wheel_cleans_the_rail_that_it_is_on() -> None:
    """The friction of a row is the law of the work in the row before, of each side."""
    track = replace(DIRTY, friction_right=cl.Profile.of(1.0))
    run = cl.run_scenario(sliding(track), "open_loop")
    radius = 0.5
    for side, before in (("left", WET(run["distance"])), ("right", np.ones(run.time.size))):
        slip = radius * run[f"omega_{side}"] - run["speed"]
        work = run[f"creep_force_{side}"] * slip / run["speed"]
        expected = track.cleaned(before[1:], np.maximum(work[:-1], 0.0))
        friction = run[f"friction_scale_{side}"][1:]
        np.testing.assert_allclose(friction, expected, atol=5e-3)
        assert (friction >= before[1:]).all()
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


def test_axles_find_what_those_in_front_have_done() -> None:
    state = RailState(DIRTY, np.array([20.0, 17.0, 5.0]))
    works = np.array([[4e3, 0.0], [2e3, 1e3], [9e9, 9e9]])
    for k in range(700):
        at = np.array([20.0, 17.0, 5.0]) + 0.5 * CELL * k
        friction = state.friction(at)
        state.slide(at, works)
    before = DIRTY.friction_scale(at, 0.0)
    done = [[0.0, 0.0], [4e3, 0.0], [6e3, 1e3]]
    np.testing.assert_allclose(friction, DIRTY.cleaned(before, done), rtol=1e-14)
    idle = RailState(replace(DIRTY, cleaning=0.0), at)
    idle.slide(at, works)
    assert not idle.cleans
    np.testing.assert_array_equal(idle.friction(at), before)


def test_limits() -> None:
    with pytest.raises(ValueError, match=r"^Track\.cleaning = -1.0 is out of range: must be"):
        replace(DIRTY, cleaning=-1.0)
    with pytest.raises(ValueError, match=r"^Track\.recovered = 0.0 is out of range: must be"):
        replace(DIRTY, recovered=0.0)
