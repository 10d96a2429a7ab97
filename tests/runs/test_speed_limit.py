"""Speed limits of a track: no traction above them, and drivers who keep them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from plain_scenario import plain_scenario

import contactlib as cl
from contactlib.runs import run_many
from contactlib.runs.line import BELOW, RESERVE
from contactlib.traction import Sensors
from contactlib.vehicle import Driver, Track

BODY = cl.load_model("locomotive.toml").wheelset
LOWER = cl.Profile((30.0, 30.0), (11.2, 9.0))


def test_traction_falls_to_zero_at_the_limit_and_braking_remains() -> None:
    track = Track(speed_limit=LOWER)
    case = plain_scenario(BODY, track=track, duration=6.0)
    run = cl.run_scenario(case, "open_loop")
    assert_array_equal(run["speed_limit"], LOWER(run["distance"]))
    assert run["distance"][-1] > 30.0
    sampled = slice(None, None, round(0.01 / run.time[1]))
    share = np.clip(run["speed_limit"] - run["speed"], 0.0, 1.0)[sampled]
    assert_allclose(run["demand"][sampled], 2e4 * share, atol=1e-9)
    assert {0.0, 1.0} < set(share.tolist())
    braked = replace(case, demand=cl.Profile.of(-1e4))
    free = replace(braked, track=Track())
    assert_array_equal(
        cl.run_scenario(braked, "open_loop")["speed"], cl.run_scenario(free, "open_loop")["speed"]
    )
    plant = cl.Plant(case)
    assert plant["speed_limit"] == 11.2
    with pytest.raises(KeyError, match="no signal 'speed_limit'; did you mean 'speed'"):
        cl.Plant(free)["speed_limit"]


def test_the_speed_stays_below_the_limit() -> None:
    case = plain_scenario(BODY, track=Track(speed_limit=cl.Profile.of(10.5)), duration=20.0)
    limited = cl.run_scenario(case, "open_loop")
    free = cl.run_scenario(replace(case, track=Track()), "open_loop")
    assert 10.0 < limited["speed"].max() < 10.5 < free["speed"].max()
    assert "speed_limit" not in free.units


def test_the_limit_of_a_vehicle_is_the_lowest_under_its_axles() -> None:
    lists: dict[str, Any] = {"distance": (-8.0, -8.0), "speed_limit": (5.0, 30.0)}
    track = Track.from_breakpoints(direction="decreasing", **lists)
    assert track.speed_limit == cl.Profile((8.0, 8.0), (30.0, 5.0))
    case = cl.load_scenario("four_axles.toml")
    case = replace(case, track=track, sensors=Sensors(), duration=2.0)
    run = cl.run_scenario(case, "open_loop")
    first = track.speed_limit(run["distance"]).min(axis=1)
    assert_array_equal(run["speed_limit"], first)
    assert run["distance"][-1, 1] > 8.0
    late = run["distance"][:, 0] > 8.2  # a sample later
    assert not run["demand"][late].any()
    runs = run_many([case, replace(case, track=Track())], "open_loop", ["final_speed", "overspeed"])
    assert runs["final_speed"][0] == pytest.approx(run["speed"][-1], rel=1e-9)
    assert runs["final_speed"][1] > run["speed"][-1] + 0.01
    excess = (run["speed"] - first).max()
    assert_allclose(runs["overspeed"], [excess, np.nan], rtol=1e-3)  # at longer steps
    assert excess > 4.0
    with pytest.raises(ValueError, match=r"Track.speed_limit.*0\.0 is out of range: must be .*> 0"):
        Track(speed_limit=cl.Profile.of(0.0))
    assert "never meets" in str(Track.from_breakpoints(start=5e4, **lists).warning(0.0, 10.0))


def test_a_limit_holds_until_the_tail_has_passed() -> None:
    """By the lowest of the limits under points of the train, half a metre apart."""
    at = (-5.0, 4.0, 4.5, 9.0, 14.0)
    limit = cl.Profile.steps(at, (8.0, 30.0, 12.0, 6.0, 25.0))
    case = cl.load_scenario("four_axles.toml")
    vehicle = case.vehicle
    assert vehicle is not None
    case = replace(case, track=Track(speed_limit=limit), sensors=Sensors(), duration=4.0)
    train = replace(case, vehicle=replace(vehicle, length=20.25))
    run = cl.run_scenario(train, "open_loop")
    place = run["distance"][:, 0]
    under = [limit(place - behind) for behind in np.arange(0.0, 20.5, 0.25)]
    shown = np.abs(place[:, None] - np.array([*at, *(x + 20.25 for x in at)])).min(axis=1) > 0.25
    assert_array_equal(run["speed_limit"][shown], np.min(under, axis=0)[shown])
    assert shown.mean() > 0.8
    assert {6.0, 25.0} < set(run["speed_limit"].tolist())
    own = replace(train, vehicle=replace(vehicle, length=vehicle.position[-1]))
    axles = cl.run_scenario(replace(case, track=Track(speed_limit=limit)), "open_loop")
    assert (cl.run_scenario(own, "open_loop")["speed_limit"] <= axles["speed_limit"]).all()
    with pytest.raises(ValueError, match=r"length = 5.0 is out of range: must be >= 12.9, the la"):
        replace(vehicle, length=5.0)


def driven(name: str, *limits: float, deceleration: float, **changes: Any) -> cl.Scenario:
    """A shipped scenario downhill, whose limit falls at 120 m from the first to the second one."""
    limit = cl.Profile.steps((0.0, 120.0), limits)
    grade = cl.Profile((0.0, 60.0), (0.0, -0.01))
    return replace(
        cl.load_scenario(name),
        track=Track(speed_limit=limit, grade=grade),
        driver=Driver(deceleration=deceleration),
        demand=cl.Profile.of(changes.pop("demand")),
        sensors=Sensors(),
        duration=20.0,
        **changes,
    )


KEPT = {
    "brake with a delay": driven(
        "coach_braking.toml", 16.0, 13.0, deceleration=0.7, initial_speed=15.0, demand=2.5e3
    ),
    "motor, train": driven(
        "four_axles.toml", 12.0, 10.5, deceleration=0.2, initial_speed=11.5, demand=8e3
    ),
    "wheelset": driven(
        "dry_wet_dry.toml", 12.9, 12.0, deceleration=0.2, initial_speed=12.5, demand=9e3
    ),
}


@pytest.mark.parametrize("name", KEPT)
def test_a_driver_keeps_limits_within_the_deceleration(name: str) -> None:
    case = KEPT[name]
    assert case.driver is not None
    assert case.track.speed_limit is not None
    a = case.driver.deceleration
    control = next(iter(case.controllers))
    run = cl.run_scenario(case, control)
    speed, limit = run["speed"], run["speed_limit"]
    assert (speed < limit).all()
    assert np.diff(speed).min() > -1.001 * a * run.time[1]
    # It falls from where v^2 = v_limit^2 + 2 a s, and at last stays just below the limit.
    high, low = np.sqrt(case.track.speed_limit.kept_by(RESERVE * a)([0.0, 120.0]))
    place = run["distance"].reshape(run.time.size, -1)[:, 0]
    begin = 120.0 - (high**2 - low**2) / (2.0 * RESERVE * a)
    middle = (place > begin + 10.0) & (place < 118.0)
    kept = np.sqrt(low**2 + 2.0 * RESERVE * a * (120.0 - place[middle]))
    assert place[-1] > 160.0
    assert_allclose(speed[middle], kept, atol=2.0 * BELOW)
    assert_allclose(speed[-1], low - BELOW, atol=0.02)
    assert_allclose(np.diff(speed)[-10:], 0.0, atol=2e-3 * run.time[1])


def test_drivers_of_many_vehicles_are_their_own() -> None:
    """One of three has a driver, and a limit that wet rails do not allow to keep is exceeded."""
    kept = replace(KEPT["brake with a delay"], duration=11.0)
    control = next(iter(kept.controllers))
    icy = replace(kept.track, friction_left=cl.Profile.of(0.05))
    cases = [kept, replace(kept, driver=None), replace(kept, track=icy, demand=cl.Profile.of(0.0))]
    runs = run_many(cases, control, ["final_speed", "overspeed"])
    for i, case in enumerate(cases):
        one = cl.run_scenario(case, control)
        assert runs["final_speed"][i] == pytest.approx(one["speed"][-1], rel=1e-6)
    assert runs["overspeed"][0] == 0.0
    assert runs["overspeed"][1] > 1.5
    assert runs["overspeed"][2] > 1.0


def test_a_driver_needs_a_limit_in_steps_and_a_free_speed() -> None:
    case = KEPT["wheelset"]
    for track, message in (
        (Track(), "driver keeps the speed limits of a track, which has none: give track.speed_li"),
        (
            Track(speed_limit=cl.Profile((0.0, 9.0), (20.0, 9.0))),
            "track.speed_limit.value = .*step",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            replace(case, track=track)
    with pytest.raises(ValueError, match=r"deceleration = 0\.0 is out of range"):
        Driver(deceleration=0.0)
