"""The track: friction by place, side and time."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np
import pytest

import contactlib as cl
from contactlib.vehicle import Track, Variation

PATCH = cl.Profile((50.0, 50.0, 150.0, 150.0), (1.0, 0.5, 0.5, 1.0))


def test_each_side_has_its_own_and_time_multiplies() -> None:
    rain = cl.Profile((10.0, 20.0), (1.0, 0.8))
    track = cl.Track(
        friction_left=PATCH, friction_right=cl.Profile((0.0,), (0.9,)), friction_over_time=rain
    )
    distance = np.array([0.0, 50.0, 149.9, 150.0])
    expected = np.array([[1.0, 0.9], [0.5, 0.9], [0.5, 0.9], [1.0, 0.9]])
    np.testing.assert_allclose(track.friction_scale(distance, 0.0), expected, rtol=1e-15)
    np.testing.assert_allclose(track.friction_scale(distance, 15.0), 0.9 * expected, rtol=1e-15)
    assert track.friction_scale(60.0, 30.0).tolist() == pytest.approx([0.4, 0.72])


def test_the_right_rail_is_as_the_left_one_by_default() -> None:
    scale = cl.Track(friction_left=PATCH).friction_scale(np.linspace(0.0, 200.0, 9), 1.0)
    assert scale.shape == (9, 2)
    np.testing.assert_array_equal(scale[:, 0], scale[:, 1])
    np.testing.assert_array_equal(cl.Track().friction_scale([3.0, 4.0], 5.0), np.ones((2, 2)))


def test_extremes_are_of_any_wheel_and_time() -> None:
    track = cl.Track(
        friction_left=PATCH,
        friction_right=cl.Profile.of(1.2),
        friction_over_time=cl.Profile((0.0, 1.0), (1.0, 0.8)),
        slope=cl.Profile((50.0, 60.0), (1.5, 0.3)),
    )
    assert track.lowest == (0.4, 0.3)
    assert track.highest == (1.2, 1.5)
    assert cl.Track().lowest == cl.Track().highest == (1.0, 1.0)


@pytest.mark.parametrize("start", [0.0, 12_400.0, 812_345.0])
@pytest.mark.parametrize("direction", ["increasing", "decreasing"])
def test_places_count_from_the_start_in_the_direction_of_travel(
    start: float, direction: Literal["increasing", "decreasing"]
) -> None:
    rng = np.random.default_rng(7)
    at = np.sort(start + rng.integers(-500, 500, 20)).astype(float)
    left, right, slope = rng.uniform(0.1, 1.0, (3, 20))
    at[8] = at[7]  # a jump
    keep = np.append(True, np.diff(at) > 0.0) | (np.arange(20) == 8)
    rows = {"distance": at, "friction_left": left, "friction_right": right, "slope": slope}
    lists: dict[str, Any] = {name: tuple(row[keep].tolist()) for name, row in rows.items()}
    track = cl.Track.from_breakpoints(start=start, direction=direction, **lists)
    plain = cl.Track.from_breakpoints(**lists)
    distance = rng.uniform(-600.0, 600.0, 200)
    sign = 1.0 if direction == "increasing" else -1.0
    expected = plain.friction_scale(start + sign * distance, 0.0)
    friction = track.friction_scale(distance, 0.0)
    np.testing.assert_allclose(friction, expected[:, :: int(sign)], rtol=1e-9)  # left is right
    np.testing.assert_allclose(track.slope(distance), plain.slope(start + sign * distance), 1e-9)


def test_friction_coefficients_are_those_of_any_vehicle() -> None:
    given: dict[str, Any] = {
        "distance": (0.0, 10.0),
        "friction_left": (0.3, 0.1),
        "friction_right": (0.15, 0.2),
    }
    rails = cl.Track.from_breakpoints(**given, unit="coefficient", slope=(1.0, 0.5), recovered=0.8)
    for kinetic in (0.21, 0.4):
        factors = rails.in_factors(kinetic)
        friction = kinetic * factors.friction_scale([0.0, 10.0], 0.0)
        np.testing.assert_allclose(friction, [[0.3, 0.15], [0.1, 0.2]], rtol=1e-15)
        assert (factors.slope.value, factors.recovered) == ((1.0, 0.5), 0.8)
        assert factors.in_factors(kinetic) is factors
    with pytest.raises(ValueError, match="unit = 'coefficient' must be 'factor' here: in_factors"):
        rails.friction_scale(0.0, 0.0)


LEAVES, NEVER = "leaves the map m.csv, which covers ", "never meets "


@pytest.mark.parametrize(
    ("given", "low", "high", "text"),
    [
        ({"map": "m.csv"}, 0.0, 300.0, None),
        ({"map": "m.csv"}, -0.01, 300.0, None),
        ({"map": "m.csv"}, 0.0, 420.0, f"from 0 to 420 m, {LEAVES}0 to 400 m"),
        ({"map": "m.csv"}, -30.0, 5.0, f"from -30 to 5 m, {LEAVES}0 to 400 m"),
        ({"map": "m.csv"}, -30.0, -2.0, f"from -30 to -2 m, {NEVER}the map m.csv"),
        ({"map": "m.csv", "start": 7300.0}, 0.0, 9.0, f"from 7300 to 7309 m, {NEVER}the map"),
        ({"map": "m.csv", "start": 350.0}, -9.0, 40.0, None),
        ({"map": "m.csv", "start": 350.0, "direction": "decreasing"}, 0.0, 349.0, None),
        (
            {"map": "m.csv", "start": 350.0, "direction": "decreasing"},
            0.0,
            370.0,
            f"from -20 to 350 m, {LEAVES}0 to 400 m",
        ),
        ({}, 0.0, 900.0, None),  # a patch has ends
        ({"start": -30.0}, 0.0, 20.0, None),  # nor need a short run reach it
        ({"start": -30.0}, -20.0, 0.0, f"from -50 to -30 m, {NEVER}the values of track.dis"),
        ({}, -20.0, 0.02, f"from -20 to 0.02 m, {NEVER}the values of track.distance"),
        ({"start": 500.0}, 0.0, 90.0, f"from 500 to 590 m, {NEVER}the values"),
        ({"start": -1900.0}, 0.0, 800.0, f"from -1900 to -1100 m, {NEVER}the values"),
        ({"start": -12_400.0}, 0.0, 90.0, f"from -12400 to -12310 m, {NEVER}the values"),
    ],
)
def test_a_run_off_its_map_is_doubted(
    given: dict[str, Any], low: float, high: float, text: str | None
) -> None:
    track = cl.Track.from_breakpoints(distance=(0.0, 400.0), friction=(0.6, 0.9), **given)
    doubt = track.warning(low, high)
    assert (doubt is None) == (text is None)
    assert text is None or (doubt is not None and text in doubt and "track.start" in doubt)
    level = cl.Track.from_breakpoints(distance=(0.0, 400.0), friction=(0.6, 0.6), **given)
    assert level.warning(low, high) is None


@pytest.mark.parametrize("length", [10.0, 23.0])  # and so nodes at other places
def test_a_variation_is_the_process_that_it_names(length: float) -> None:
    field = Variation(standard_deviation=0.3, correlation_length=length, median=0.8, seed=5.0)
    x = np.log(np.array(field.profile(0.0, 2e4 * length).value) / 0.8) / 0.3
    error = 4.0 / np.sqrt(2e4 / 2.0)  # four standard errors of so many correlation lengths
    assert abs(x.mean()) < 2.0 * error
    assert x.std() == pytest.approx(1.0, abs=error)
    for nodes in (1, 5, 10, 30):  # a tenth of the length apart
        assert np.mean(x[nodes:] * x[:-nodes]) == pytest.approx(np.exp(-0.1 * nodes), abs=error)
    seeds = [
        dataclasses.replace(field, seed=float(seed)).profile(7.0, 9.0)(8.0) for seed in range(999)
    ]
    share = (np.array(seeds) < 0.8).mean()
    assert share == pytest.approx(0.5, abs=2.0 / np.sqrt(999))


def test_a_place_has_one_variation_in_runs_of_any_length_start_and_direction() -> None:
    field = Variation(standard_deviation=0.2, correlation_length=3.0, seed=1.0)
    scenario = dataclasses.replace(cl.load_scenario("coach_braking.toml"), variation=field)
    lists: Any = {"distance": (0.0, 90.0, 90.0), "friction": (0.5, 0.5, 0.9)}
    places = np.linspace(-20.0, 600.0, 301)
    known = Track.from_breakpoints(**lists).friction_scale(places, 0.0)[:, 0] * field.profile(
        -30.0, 700.0
    )(places)
    ways: list[tuple[float, Any]] = [(0.0, "increasing"), (-400.0, "increasing")]
    for start, direction in (*ways, (700.0, "decreasing")):
        track = Track.from_breakpoints(**lists, start=start, direction=direction)
        there = (places - start) * (1.0 if direction == "increasing" else -1.0)
        for duration in (20.0, 45.0):
            rails = dataclasses.replace(scenario, track=track, duration=duration).rails
            reached = (there > -20.0) & (there < duration * scenario.initial_speed)
            found = rails.friction_scale(there[reached], 0.0)
            np.testing.assert_allclose(found, known[reached, None] * [[1.0, 1.0]], rtol=1e-12)
