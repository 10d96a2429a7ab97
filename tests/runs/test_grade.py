"""Grades of a track: work against them, loads of a vehicle on them, and their direction."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from plain_scenario import plain_scenario

import contactlib as cl
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.traction import Sensors
from contactlib.vehicle import Resistance, Track

BODY = cl.load_model("locomotive.toml").wheelset
HILL = cl.Profile((10.0, 20.0, 35.0, 35.0, 50.0), (0.0, 0.012, 0.02, -0.01, 0.003))


def altitude(profile: cl.Profile, distance: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Integral of a profile from place 0 [m], of each trapezium exactly."""
    ends = np.unique(np.concatenate([[0.0], profile.at, distance]))
    parts = [0.5 * sum(profile.on(a, b)) * (b - a) for a, b in pairwise(ends.tolist())]
    return np.asarray(np.interp(distance, ends, np.concatenate([[0.0], np.cumsum(parts)])))


def test_the_work_against_a_grade_is_that_of_the_altitude() -> None:
    """Without other resistance; the drive's work becomes kinetic energy, heat and altitude."""
    body = replace(BODY, resistance=Resistance())
    case = plain_scenario(body, track=Track(grade=HILL), duration=6.0)
    run = cl.run_scenario(case, "open_loop", step=5e-4, tolerance=1e-10)
    assert body.mass is not None
    gained = body.mass * STANDARD_GRAVITY * altitude(HILL, run["distance"])
    work = run["drive_work"][-1]
    assert run["distance"][-1] > 50.0
    assert np.abs(gained).max() > 1e-3 * work
    assert np.abs(run["energy_defect"]).max() < 1e-9 * work
    stored = run["stored_energy"] - run["stored_energy"][0]
    balance = run["drive_work"] - run["creep_work"] - run["loss_work"] - stored - gained
    assert np.abs(balance).max() < 1e-8 * work  # a row meets the grade in its middle
    assert_allclose(run["grade"], HILL(run["distance"]), atol=1e-15)


def test_a_constant_grade_is_that_of_the_vehicle_file() -> None:
    body = BODY
    own = replace(body, resistance=replace(body.resistance, grade=0.01 + body.resistance.grade))
    track = Track(grade=cl.Profile.of(0.01))
    there = cl.run_scenario(plain_scenario(body, track=track), "open_loop")
    other = cl.run_scenario(plain_scenario(own), "open_loop")
    level = cl.run_scenario(plain_scenario(body), "open_loop")
    for name in ("speed", "omega", "resistance_work"):
        assert_allclose(there[name], other[name], rtol=1e-12)
        assert not np.allclose(there[name], level[name], rtol=1e-6)


def test_a_grade_changes_its_sign_with_the_direction_of_travel() -> None:
    lists: dict[str, Any] = {"distance": (0.0, 60.0, 60.0), "grade": (0.01, 0.02, -0.03)}
    track = Track.from_breakpoints(start=100.0, direction="decreasing", **lists)
    assert track.grade == cl.Profile((40.0, 40.0, 100.0), (0.03, -0.02, -0.01))
    assert Track.from_breakpoints(**lists).grade == cl.Profile(lists["distance"], lists["grade"])
    assert "never meets" in str(Track.from_breakpoints(start=-5e4, **lists).warning(0.0, 10.0))
    with pytest.raises(ValueError, match=r"Track.grade.*0\.6 is out of range: must be .*0\.5"):
        Track(grade=cl.Profile.of(0.6))
    with pytest.raises(ValueError, match="distance has 1 and grade 2 entries"):
        Track.from_breakpoints(distance=(0.0,), grade=(0.0, 0.1))


def vehicle_on(track: Track, grade: float = 0.0) -> cl.Scenario:
    case = cl.load_scenario("four_axles.toml")
    wheelset = case.drivetrain.wheelset
    resistance = replace(wheelset.resistance, grade=grade)
    drivetrain = replace(case.drivetrain, wheelset=replace(wheelset, resistance=resistance))
    return replace(case, drivetrain=drivetrain, track=track, sensors=Sensors(), duration=2.0)


def test_each_axle_of_a_vehicle_meets_the_grade_of_its_place() -> None:
    """The sum of the forces on the vehicle is that of its axles' weights."""
    step = cl.Profile((5.0, 5.0), (0.0, 0.02))
    case = replace(vehicle_on(Track(grade=step)), demand=cl.Profile.of(0.0))
    run = cl.run_scenario(case, "open_loop", tolerance=1e-9)
    assert_array_equal(run["grade"], step(run["distance"]))
    assert len(np.unique(run["grade"].sum(axis=-1))) == 5  # one axle after the other
    wheelset, speed = case.drivetrain.wheelset, run["speed"]
    assert wheelset.mass is not None
    own = wheelset.resistance
    davis = own.constant + own.linear * speed + own.quadratic * speed**2
    weight = wheelset.mass * STANDARD_GRAVITY * run["grade"]
    net = (run["creep_force"] - weight - davis[:, np.newaxis]).sum(axis=-1)
    rows = np.flatnonzero(np.diff(run["grade"].sum(axis=-1)) == 0.0)[1:]
    found = 4.0 * wheelset.mass * np.diff(speed) / np.diff(run.time)
    assert_allclose(found[rows], 0.5 * (net[:-1] + net[1:])[rows], atol=1e-3 * weight.max())


def test_the_loads_of_a_vehicle_are_those_on_its_own_grade() -> None:
    there = cl.run_scenario(vehicle_on(Track(grade=cl.Profile.of(0.02))), "open_loop")
    other = cl.run_scenario(vehicle_on(Track(), 0.02), "open_loop")
    for name in ("axle_load", "speed", "creep_force"):
        assert_allclose(there[name], other[name], rtol=1e-10)


def test_a_train_is_on_the_grades_behind_its_vehicle() -> None:
    """The work against them is that of its altitudes, and the coupler's force changes the loads."""
    slope = cl.Profile((0.0, 15.0, 15.0, 40.0), (0.0, 0.02, -0.01, 0.0))
    case = vehicle_on(Track(grade=slope))
    wheelset, vehicle = case.drivetrain.wheelset, case.vehicle
    assert vehicle is not None
    assert wheelset.mass is not None
    body = replace(wheelset, resistance=Resistance())
    case = replace(case, drivetrain=replace(case.drivetrain, wheelset=body), duration=4.0)
    train = replace(case, vehicle=replace(vehicle, length=60.0))
    run = cl.run_scenario(train, "open_loop", tolerance=1e-9)
    rows = np.arange(0, run.time.size, 100)
    place, speed = run["distance"][rows], run["speed"]
    behind = 12.9 + 47.1 * (np.arange(1000) + 0.5) / 1000.0
    own = [altitude(slope, axles).mean() for axles in place]
    far = [altitude(slope, x - behind).mean() for x in place[:, 0]]
    weights = vehicle.own_mass * np.array(own) + vehicle.train_mass * np.array(far)
    gained = STANDARD_GRAVITY * (weights - weights[0])
    work = run["resistance_work"].sum(axis=-1)[rows]
    assert np.ptp(gained) > 1e5
    assert_allclose(work, gained, atol=1e-5 * np.ptp(gained))
    # Moments about the rail: of inertia and weight along the track, and of the coupler's force.
    last, h = -200, run.time[1]
    pull = vehicle.train_mass * STANDARD_GRAVITY * slope(run["distance"][last, 0] - behind).mean()
    rate = (speed[last + 1] - speed[last - 1]) / (2.0 * h)
    along = rate + STANDARD_GRAVITY * run["grade"][last].mean()
    bodies = (
        (vehicle.body_mass, vehicle.body_height),
        (2.0 * vehicle.bogie_mass, vehicle.bogie_height),
    )
    moment = sum(mass * along * height for mass, height in bodies)
    moment += 4.0 * vehicle.wheelset_mass * along * wheelset.radius
    moment += (vehicle.train_mass * rate + pull) * vehicle.coupler_height
    turning = (run["omega"][last + 1] - run["omega"][last - 1]).sum() / (2.0 * h)
    moment += vehicle.pitch_inertia * turning
    shift = run["axle_load"][last] - run["axle_load"][last].mean()
    assert shift @ vehicle.position == pytest.approx(moment, rel=2e-3)
