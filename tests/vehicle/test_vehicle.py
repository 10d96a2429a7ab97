"""Loads of a vehicle's axles against statics by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.vehicle import Vehicle

FOUR: dict[str, Any] = {
    "position": (0.0, 3.0, 9.9, 12.9),
    "body_mass": 53.6e3,
    "bogie_mass": 13e3,
    "wheelset_mass": 2.6e3,
    "train_mass": 480e3,
    "body_height": 1.8,
    "bogie_height": 0.6,
    "pivot_height": 0.4,
    "coupler_height": 1.04,
}
SIX = FOUR | {"position": (0.0, 1.9, 4.1, 10.0, 11.9, 14.1), "axles_per_bogie": 3}
TWO = FOUR | {"position": (0.0, 9.0), "axles_per_bogie": 1}
RADIUS = 0.52


@pytest.mark.parametrize("given", [FOUR, SIX, TWO], ids=["four axles", "six axles", "two axles"])
def test_loads_balance_forces_and_moments_of_all_bodies(given: dict[str, Any]) -> None:
    """Of the whole vehicle, and of the first bogie about its pivot, by separate sums."""
    v = Vehicle(**given)
    rng = np.random.default_rng(5)
    force, a = rng.uniform(-6e4, 6e4, (50, v.axles)), rng.uniform(-1.5, 1.5, 50)
    load = v.loads(force, acceleration=a, radius=RADIUS)
    assert_allclose(load.sum(axis=1), v.own_mass * STANDARD_GRAVITY, rtol=1e-12)
    # Moments about the rail under the middle of the vehicle. What resists acts on vehicle and train
    # by their masses, at the body's centre and at the coupler, which also pulls the train.
    bogies = v.axles / v.axles_per_bogie
    inertia = (
        v.body_mass * v.body_height
        + bogies * v.bogie_mass * v.bogie_height
        + v.axles * v.wheelset_mass * RADIUS
    )
    resistance = force.sum(axis=1) - v.mass * a
    coupler = v.train_mass * a + v.train_mass / v.mass * resistance
    own = v.own_mass / v.mass * resistance
    at = np.mean(v.position) - np.array(v.position)
    moment = load @ at + coupler * v.coupler_height + own * v.body_height + inertia * a
    assert_allclose(moment, 0.0, atol=1e-8 * v.own_mass)
    # The first bogie: its axles' loads about the pivot against forces at rail and pivot.
    n = int(v.axles_per_bogie)
    if n == 1:
        return
    mass = v.bogie_mass + n * v.wheelset_mass
    pull = force[:, :n].sum(axis=1) - mass * a
    arm = np.mean(v.position[:n]) - np.array(v.position[:n])
    lifts = v.bogie_mass * v.bogie_height + n * v.wheelset_mass * RADIUS
    assert_allclose(load[:, :n] @ arm + pull * v.pivot_height + lifts * a, 0.0, atol=1e-8 * mass)


@pytest.mark.parametrize("given", [FOUR, TWO], ids=["of its bogie", "of the body"])
def test_a_wheelset_that_spins_up_lifts_the_front(given: dict[str, Any]) -> None:
    v = Vehicle(**given, pitch_inertia=200.0)
    none = np.zeros(v.axles)
    spins = none + 30.0 * (np.arange(v.axles) == 0)
    at_rest, spun = (
        v.loads(none, acceleration=0.0, radius=RADIUS, omega_rate=rate) for rate in (none, spins)
    )
    change = 200.0 * 30.0 / v.position[1]
    assert_allclose(spun - at_rest, [-change, change, *none[2:]], atol=1e-9)


def test_without_a_train_nothing_pulls_at_the_coupler() -> None:
    """Whatever resists the motion."""
    low, high = (
        Vehicle(**(FOUR | {"train_mass": 0.0, "coupler_height": height})) for height in (0.0, 4.0)
    )
    first, second = (v.loads([5e3] * 4, acceleration=0.1, radius=RADIUS) for v in (low, high))
    assert_allclose(first, second, rtol=1e-14)


@pytest.mark.parametrize("per_bogie", [1, 2])
def test_a_single_axle_carries_the_weight(per_bogie: int) -> None:
    """Whatever force and spin it has, as nothing is there to carry a moment."""
    v = Vehicle(**(FOUR | {"position": (0.0,), "axles_per_bogie": per_bogie}))
    weight = (53.6e3 + 13e3 + 2.6e3) * STANDARD_GRAVITY
    load = v.loads([4e4], acceleration=0.7, radius=RADIUS, omega_rate=[30.0])
    assert_allclose(load, [weight], rtol=1e-14)
    assert v.own_mass * STANDARD_GRAVITY == pytest.approx(weight, rel=1e-14)


def test_an_axle_cannot_pull_on_the_rail() -> None:
    v = Vehicle(**FOUR)
    assert v.loads([9e5, 9e5, 9e5, 9e5], acceleration=0.0, radius=RADIUS).min() == 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": ()}, "position has 0 entries: a vehicle has 1 to 8 axles"),
        ({"position": (0.0, 3.0, 2.0, 5.0)}, "must start with 0 and be strictly increasing"),
        ({"axles_per_bogie": 3}, "axles_per_bogie = 3 must give two or more bogies of 4 axles"),
        ({"driven": (1, 5)}, r"driven = \[1, 5\] must be numbers from 1 to 4"),
        ({"body_mass": 0.0}, "body_mass = 0.0 is out of range"),
    ],
)
def test_limits(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Vehicle(**(FOUR | changes))
    with pytest.raises(ValueError, match="creep_force has the shape"):
        Vehicle(**FOUR).loads([1.0, 2.0], acceleration=0.0, radius=RADIUS)


def test_the_shipped_vehicle_is_the_file() -> None:
    scenario = cl.load_scenario("four_axles.toml")
    assert scenario.vehicle == Vehicle(**FOUR)
    assert scenario.drivetrain.wheelset.mass == scenario.vehicle.mass / 4
