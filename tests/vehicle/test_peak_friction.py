"""Rails given by the largest traction coefficients: found again by SciPy on the steady curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import minimize_scalar

import contactlib as cl
from contactlib.traction import OpenLoop
from contactlib.vehicle import DynamicLoad, Variation

RANDOM = np.random.default_rng(2)
FALLING = {"slip_rate_residual": 0.4, "slip_rate_decay": 0.4}


def element_of(file: str, **changes: Any) -> cl.ForceElement:
    element = cl.load_model(file).wheelset.element
    friction = {key: value for key, value in changes.items() if hasattr(element.friction, key)}
    others = {key: value for key, value in changes.items() if key not in friction}
    return replace(element, friction=replace(element.friction, **friction), **others)


def on_rails(element: cl.ForceElement, rails: cl.Track, **changes: Any) -> cl.Scenario:
    case = cl.load_scenario("wheel_slide_protection.toml")
    body = replace(case.drivetrain.wheelset, element=element)
    train, controllers = replace(case.drivetrain, wheelset=body), {"open_loop": OpenLoop()}
    changes = {"drivetrain": train, "track": rails, "controllers": controllers, **changes}
    return replace(case, design_speed=10.0, **changes)


def loaded(factor: float) -> DynamicLoad:
    return DynamicLoad(time=(0.0,), factor=(factor,))


def largest(element: cl.ForceElement, **at: float) -> float:
    """Largest traction coefficient in steady rolling, by SciPy."""

    def lacking(log: npt.ArrayLike) -> npt.NDArray[np.float64]:
        found = element.at_creepage(np.exp(log), **at)
        return -np.asarray(found["traction_coefficient"])

    grid = np.linspace(np.log(1e-5), np.log(30.0), 200)
    i = int(np.clip(lacking(grid).argmin(), 1, grid.size - 2))
    best = minimize_scalar(
        lambda log: float(lacking(log)), bounds=(grid[i - 1], grid[i + 1]), method="bounded"
    )
    return -float(best.fun)


@pytest.mark.parametrize(
    ("element", "speeds"),
    [
        (
            element_of("locomotive.toml", slip_rate_decay=0.6, slip_rate_residual=0.857),
            (0.0, -44.0),
        ),
        (element_of("coach.toml"), (0.1, 100.0)),
        (element_of("roller_rig.toml", memory=True, **FALLING), (3.0, 60.0)),
        (element_of("locomotive.toml", softening_temperature=700.0), (30.0,)),
        (element_of("locomotive.toml", layer_compliance=3e-13, **FALLING), (80.0,)),
    ],
)
def test_a_wheel_finds_the_number_that_was_given(
    element: cl.ForceElement, speeds: Sequence[float]
) -> None:
    """At any speed, load and slope, forward and backward, under both wheels."""
    (left, right), slope = RANDOM.uniform(0.05, 0.12, 2), RANDOM.uniform(0.3, 1.0)
    rails = cl.Track.from_breakpoints(
        distance=(0.0, 10.0),
        friction_left=(left, 0.1),
        friction_right=(right, 0.06),
        slope=(slope, 1.0),
        unit="adhesion",
    )
    there = replace(element, slope_reduction=element.slope_reduction * slope)
    for speed in speeds:
        load = float(RANDOM.choice([0.7, 1.0, 1.3]))
        case = on_rails(element, rails, initial_speed=speed, dynamic_load=loaded(load))
        plant = cl.Plant(case, initial_creepage=0.0)
        for side, number in (("left", left), ("right", right)):
            at = {
                "speed": max(abs(speed), element.minimum_speed),
                "axle_load": load * element.axle_load,
                "friction_scale": plant[f"friction_scale_{side}"],
            }
            assert largest(there, **at) == pytest.approx(number, rel=0.01), (speed, load, side)


def braking(number: float, file: str = "locomotive.toml", **friction: float) -> cl.Scenario:
    """A brake that is stronger than the rails."""
    element = element_of(file, memory=True, **friction)
    rails = cl.Track.from_breakpoints(distance=(0.0,), friction=(number,), unit="adhesion")
    return on_rails(element, rails, demand=cl.Profile.of(-30e3), start="released", duration=2.5)


@pytest.mark.parametrize("number", [0.05, 0.12])
def test_locked_wheels_brake_with_that_part_of_the_weight(number: float) -> None:
    """Where friction falls neither at the peak nor with slip speed, at the peak."""
    case = braking(number, static=0.3, kinetic=0.3, weakening_length=0.0)
    run, body = cl.run_scenario(case, "open_loop"), case.drivetrain.wheelset
    assert run["creepage"][-1] == pytest.approx(-1.0, abs=1e-6)
    force = number * body.element.axle_load
    assert run["available_force"][-1] == pytest.approx(force, rel=0.01)
    davis, speed = body.resistance, run["speed"][-1]
    against = force + davis.constant + davis.linear * speed + davis.quadratic * speed**2
    assert run["acceleration"][-1] == pytest.approx(-against / body.mass, rel=0.01)


def test_rails_vary_in_their_largest_coefficient() -> None:
    """Under a wheel that rolls, at the row's place and load, by the draw of the variation."""
    variation = Variation(standard_deviation=0.2, correlation_length=20.0, seed=3)
    case = replace(
        braking(0.1, "locomotive.toml", **FALLING), variation=variation, demand=cl.Profile.of(-2e3)
    )
    run = cl.run_scenario(case, "open_loop")
    number = 0.1 * variation.profile(-100.0, 200.0)(run["distance"])
    np.testing.assert_allclose(run["available_force"] / run["axle_load"], number, rtol=0.01)
    assert np.ptp(number) > 0.02


def test_the_speed_changes_friction_within_a_row() -> None:
    """Rows ten times as long give the same end, and the energy balance closes in both."""
    case = braking(0.12, "coach.toml", slope_reduction=0.05, **FALLING)
    long, short = (
        cl.run_scenario(case, "open_loop", step=step, tolerance=1e-10) for step in (1e-2, 1e-3)
    )
    assert long["friction_scale_left"][-1] < 0.99 * long["friction_scale_left"][0]
    assert long["speed"][-1] == pytest.approx(short["speed"][-1], abs=1e-8)
    for run in (long, short):
        assert np.abs(run["energy_defect"]).max() < 1e-9 * abs(run["drive_work"][-1])


def test_rails_of_all_units_run_side_by_side() -> None:
    """They do with the bits of single runs, and on equal friction as one."""
    wet = braking(0.07, slip_rate_residual=1.0, slip_rate_decay=0.0)
    factor = float(wet.rails_at(10.0).friction_left(0.0))
    kinetic = wet.drivetrain.wheelset.element.friction.kinetic
    tracks = (
        cl.Track(friction_left=cl.Profile.of(0.07), unit="adhesion"),
        cl.Track(friction_left=cl.Profile.of(factor)),
        cl.Track(friction_left=cl.Profile.of(factor * kinetic), unit="coefficient"),
    )
    cases = [replace(wet, track=track) for track in tracks]
    found = cl.run_many(cases, "open_loop", ["distance"])["distance"]
    single = [cl.run_many([case], "open_loop", ["distance"])["distance"].item() for case in cases]
    assert found.tolist() == single
    np.testing.assert_allclose(found, single[0], rtol=1e-5)


def test_numbers_that_nothing_reaches_and_tools_without_a_contact_are_refused(
    tmp_path: Path,
) -> None:
    wet = cl.load_scenario("four_axles.toml")
    rails = cl.Track(friction_left=cl.Profile.of(0.07), unit="adhesion")
    steep = replace(rails, friction_left=cl.Profile.of(50.0))
    with pytest.raises(ValueError, match=r"track.friction = 50 .* must be <= .* 100 times"):
        cl.run_scenario(replace(wet, track=steep), "open_loop")
    with pytest.raises(ValueError, match=r"unit = 'adhesion': .* give the rails as factors"):
        cl.export_fmu(replace(wet, track=rails), tmp_path / "x.fmu", kind="vehicle")
    with pytest.raises(ValueError, match="unit = 'adhesion' must be 'factor' here: Scenario"):
        rails.friction_scale(0.0, 0.0)
