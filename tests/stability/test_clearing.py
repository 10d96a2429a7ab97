"""Critical clearing times against bisection over runs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from wheelsets import MASSES, torque_run

import contactlib as cl

V = 10.0  # [m/s]


def test_a_slope_of_one_is_none_and_a_patch_is_the_wheelset_on_its_slope(
    locomotive: cl.Model,
) -> None:
    """At held speed the integral of the patch's own wheelset between good friction's states."""
    body = replace(locomotive.wheelset, mass=None)
    torque = 0.95 * cl.find_fold(body, speed=V).drive_torque
    given: dict[str, Any] = {"drive_torque": torque, "speed": V}
    plain = cl.clearing(body, friction_scale=0.5, **given)
    assert cl.clearing(body, friction_scale=0.5, slope=1.0, **given) == plain
    sloped = cl.clearing(body, friction_scale=0.5, slope=0.29, **given)
    expected = cl.stability.slip_away_time(
        body.with_slope(0.29),
        friction_scale=0.5,
        start=plain.border.creepage,
        end=plain.border.highest,
        **given,
    )
    assert sloped.border == plain.border
    assert sloped.time == pytest.approx(expected, rel=1e-12)


def survives(body: cl.Wheelset, torque: float, scale: float, creepage: float, time: float) -> bool:
    patch = cl.Profile((0.0, time, time), (scale, scale, 1.0))
    run = torque_run(body, torque, creepage, time + 2.0, friction_scale=patch)
    return run.first("slip_away") is None


@pytest.mark.slow
@pytest.mark.parametrize("mass", MASSES)
@pytest.mark.parametrize("scale", [0.3, 0.6, 0.85])  # friction over that before the patch
def test_clearing_time(locomotive: cl.Model, mass: float | None, scale: float) -> None:
    body = replace(locomotive.wheelset, mass=mass)
    torque = 0.95 * cl.find_fold(body, speed=V).drive_torque
    clearing = cl.clearing(body, drive_torque=torque, speed=V, friction_scale=scale)
    start = clearing.border.creepage
    low, high = 0.5 * clearing.time, 2.0 * clearing.time
    assert survives(body, torque, scale, start, low)
    assert not survives(body, torque, scale, start, high)
    while high > 1.001 * low:
        middle = math.sqrt(low * high)
        if survives(body, torque, scale, start, middle):
            low = middle
        else:
            high = middle
    assert clearing.time == pytest.approx(math.sqrt(low * high), rel=0.002)
    assert clearing.distance == pytest.approx(
        V * clearing.time, rel=1e-12 if mass is None else 0.02
    )
    given: dict[str, Any] = {"drive_torque": torque, "speed": V, "friction_scale": scale}
    # With the speed frozen, the integral alone is near for anything that pulls a train.
    frozen = cl.stability.slip_away_time(body, start=start, end=clearing.border.highest, **given)
    if mass is None:
        assert frozen == clearing.time
    elif mass >= 22.5e3:
        assert frozen == pytest.approx(clearing.time, rel=0.01)


@pytest.mark.parametrize("mass", [None, 22.5e3])
@pytest.mark.parametrize(
    ("speed", "scale", "ratio"), [(10.0, 0.85, 1.001), (3.0, 0.3, 0.33), (1.0, 0.85, 1.09)]
)
def test_clearing_time_with_memory(
    locomotive: cl.Model, mass: float | None, speed: float, scale: float, ratio: float
) -> None:
    steady = replace(locomotive.wheelset, mass=mass)
    body = replace(steady, element=replace(steady.element, memory=True))
    torque = 0.95 * cl.find_fold(body, speed=speed).drive_torque
    given: dict[str, Any] = {"drive_torque": torque, "speed": speed, "friction_scale": scale}
    found = cl.clearing(body, **given)
    start = found.border.creepage
    for part, returns in ((0.998, True), (1.002, False)):
        first, last = 1e-4, 1e-4 + part * found.time  # the contact comes from good friction
        times, factors = (0.0, first, first, last, last), (1.0, 1.0, scale, scale, 1.0)
        run = cl.simulate(
            body,
            cl.TorqueControl(cl.Profile.of(torque)),
            initial_speed=speed,
            initial_creepage=start,
            duration=last + 1.0,
            friction_scale=cl.Profile(times, factors),
            stop_at=["slip_away"],
            tolerance=1e-8,
        )
        assert (run.first("slip_away") is None) == returns
    assert found.distance == pytest.approx(speed * found.time, rel=1e-12 if mass is None else 0.02)
    # The force falls with friction at once, but grows back over the distance rolled.
    without = cl.clearing(steady, **given)
    assert found.border == without.border
    assert found.time / without.time == pytest.approx(ratio, rel=0.05)


def test_a_patch_that_holds_the_torque_may_be_of_any_length(rig: cl.Model) -> None:
    body, scale = rig.wheelset, 0.9
    held = cl.find_fold(body, speed=V, friction_scale=scale).drive_torque
    for part, held_there in ((0.999, True), (1.0 - 3e-7, True), (1.001, False)):
        given: dict[str, Any] = {"drive_torque": part * held, "speed": V, "friction_scale": scale}
        clearing = cl.clearing(body, **given)
        assert (clearing.time == math.inf) == held_there
        assert (clearing.distance == math.inf) == held_there
    low = 0.99 * cl.find_fold(body, speed=V).return_torque  # comes back from anywhere
    assert cl.clearing(body, drive_torque=low, speed=V, friction_scale=0.2).time == math.inf


def test_a_torque_near_the_return_s_has_a_longest_patch_with_memory() -> None:
    """A wheel that slips away there comes back minutes later, as the vehicle has gained speed."""
    scenario = cl.load_sweep("friction_and_load_sweep.toml").scenario_of(117)
    body, scale = scenario.drivetrain.wheelset, scenario.track.friction_left.value[1]
    torque = max(scenario.demand.value)
    given: dict[str, Any] = {"drive_torque": torque, "speed": V, "friction_scale": scale}
    assert torque < 1.01 * cl.find_fold(body, speed=V).return_torque
    steady = cl.clearing(body.without_memory(), **given)
    assert cl.clearing(body, **given).time == pytest.approx(steady.time, rel=1e-3)


def test_clearing_time_of_braking(rig: cl.Model) -> None:
    body = replace(rig.wheelset, damping=0.0)
    torque = 0.95 * cl.find_fold(body, speed=V).drive_torque
    times = [
        cl.clearing(body, drive_torque=sign * torque, speed=V, friction_scale=0.6).time
        for sign in (1.0, -1.0)
    ]
    assert times[0] == pytest.approx(times[1], rel=1e-8)
