"""Parts of runs of many: starts, profiles, the largest forces row by row."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from falling_friction import with_falling

import contactlib as cl
from contactlib.runs.fleet import ManyProfiles, Runs, common_step, timing
from contactlib.stability.quasi_steady import steady_creepage
from contactlib.traction import stacked
from contactlib.vehicle.available_force import AvailableForce, friction_levels

STEP = cl.Profile((30.0, 30.0, 60.0, 60.0), (1.0, 0.5, 0.5, 1.0))
RAMP = cl.Profile((30.0, 40.0), (1.0, 0.5))


# ---- largest forces -------------------------------------------------------------------------


@pytest.mark.parametrize("falls", [False, True])
def test_interpolated_forces_are_those_that_are_searched(locomotive: cl.Model, falls: bool) -> None:
    rng = np.random.default_rng(3)
    laws = (0.1, 2.0), (0.4, 0.6), (0.9, 0.2)
    bodies = [locomotive.wheelset] * 3
    if falls:
        bodies = [with_falling(locomotive.wheelset, *law) for law in laws]
    split = cl.Track(friction_left=STEP, friction_right=cl.Profile.of(0.7))
    tracks = [cl.Track(friction_left=STEP), split, cl.Track(friction_left=RAMP)]
    available = AvailableForce([cl.Drivetrain(body) for body in bodies], tracks)
    speed = np.concatenate([10.0 ** rng.uniform(-3.0, 2.7, (40, 3)), [[0.0, -0.05, -20.0]]])
    where, when = rng.uniform(0.0, 90.0, speed.shape), 0.0
    scale = np.stack([t.friction_scale(x, when) for t, x in zip(tracks, where.T, strict=True)], 1)
    found = available(speed, scale[..., 0], scale[..., 1])
    for i, body in enumerate(bodies):
        expected = cl.available_force(
            body.element,
            speed=speed[:, i],
            friction_scale=scale[:, i, 0],
            other_friction_scale=scale[:, i, 1],
        )
        np.testing.assert_allclose(found[:, i], expected, rtol=1e-8)
        # As it would be by itself, row by row too.
        alone = AvailableForce([cl.Drivetrain(body)], [tracks[i]])
        for k in (0, 7, 40):
            one = (part[[k]][:, [i]] for part in (speed, scale[..., 0], scale[..., 1]))
            assert alone(*one) == found[k, i]


def test_levels_of_friction_are_where_it_does_not_change() -> None:
    assert friction_levels(cl.Track()) == [(1.0, 1.0)]
    assert friction_levels(cl.Track(friction_left=STEP)) == [(0.5, 0.5), (1.0, 1.0)]
    rain = cl.Profile((0.0, 1.0, 2.0), (1.0, 0.8, 0.8))
    found = friction_levels(cl.Track(friction_left=RAMP, friction_over_time=rain))
    assert found == [(0.4, 0.4), (0.5, 0.5), (0.8, 0.8), (1.0, 1.0)]
    both = cl.Track(friction_left=STEP, friction_right=RAMP)
    assert friction_levels(both) == [(0.5, 0.5), (1.0, 0.5), (1.0, 1.0)]


# ---- rows -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("longest", "times", "step"),
    [
        (0.01, [0.01], 0.01),
        (0.01, [0.01, 0.005], 0.005),
        (0.01, [0.025, 0.01], 0.005),
        (0.01, [0.003, 0.01], 0.001),
        (0.004, [0.02, 0.01], 0.01 / 3),
        (0.01, [0.01, 0.01 * np.sqrt(2.0)], 0.01),  # nothing in common
    ],
)
def test_a_common_step_is_a_fraction_of_all_sample_times(
    longest: float, times: list[float], step: float
) -> None:
    controls = [cl.OpenLoop(sample_time=time) for time in times]
    assert common_step(longest, controls) == pytest.approx(step, rel=1e-12)


# ---- starts ---------------------------------------------------------------------------------


def begun(scenarios: list[cl.Scenario]) -> Runs:
    control = stacked([scenarios[0].controller("open_loop")])
    when = timing(scenarios[0], control)
    return Runs(scenarios, control, when, index=range(len(scenarios)), tolerance=1e-6)


def test_starts_are_steady_on_the_rising_branch(locomotive: cl.Model, rig: cl.Model) -> None:
    """Together as one by one with a root finder, up to next to nothing below the fold."""
    wet = cl.Polach.wet()
    flat = dataclasses.replace(locomotive.wheelset.element, table=cl.CreepForceTable.from_law(wet))
    bodies = [
        locomotive.wheelset,
        rig.wheelset,
        with_falling(locomotive.wheelset),
        with_falling(dataclasses.replace(locomotive.wheelset, element=flat)),
    ]
    cases = []
    for body in bodies:
        held = cl.Profile((0.0, 9.0), (10.0, 19.0)) if body.speed_held else None
        for right in (1.0, 0.6):
            for share in (-0.9, 0.0, 1e-4, 0.5, 0.97):
                low = cl.find_fold(body, speed=10.0, friction_scale=right).drive_torque
                track = cl.Track(
                    friction_left=cl.Profile.of(1.0), friction_right=cl.Profile.of(right)
                )
                cases.append(
                    cl.Scenario(
                        name="test",
                        source="chosen",
                        drivetrain=cl.Drivetrain(body),
                        track=track,
                        demand=cl.Profile.of(share * low),
                        held_speed=held,
                        initial_speed=10.0,
                        design_speed=10.0,
                        duration=1.0,
                        sensors=cl.Sensors(),
                        controllers={"open_loop": cl.OpenLoop()},
                    )
                )
    runs = begun(cases)
    assert not runs.failed.any()
    block = next(runs.blocks())
    for i, case in enumerate(cases):
        wheelset = case.drivetrain.wheelset
        turning = wheelset.inertia / wheelset.radius if wheelset.speed_held else 0.0
        creepage, friction = float(block["creepage"][0, i]), case.track.friction_right
        assert friction is not None
        expected = steady_creepage(
            wheelset,
            case.demand.value[0] - (1.0 + creepage) * turning,  # the rig gains 1 m/s2
            speed=10.0,
            normal_load=wheelset.element.normal_load,
            friction_scale=(1.0, friction.value[0]),
        )
        assert creepage == pytest.approx(expected, rel=1e-12, abs=1e-14)


def test_at_the_very_fold_and_beyond(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    fold = cl.find_fold(body, speed=10.0)
    shipped = cl.load_scenario("dry_wet_dry.toml")
    given: dict[str, Any] = {"drivetrain": cl.Drivetrain(body), "sensors": cl.Sensors()}

    def at(share: float) -> cl.Scenario:
        demand = cl.Profile.of(share * fold.drive_torque)
        return dataclasses.replace(shipped, demand=demand, **given)

    runs = begun([at(1.0 - 1e-9), at(1.0 + 1e-6), at(0.5)])
    assert runs.failed.tolist() == [False, True, False]
    assert "the rising branch ends at" in str(runs.refused[1])
    first = next(runs.blocks())["creepage"][0]
    assert first[0] == pytest.approx(fold.creepage, rel=1e-3)


# ---- profiles -------------------------------------------------------------------------------


def test_many_profiles_are_each_of_them() -> None:
    profiles = [STEP, cl.Profile.of(3.0), RAMP, STEP, cl.Profile((1.0, 2.0), (5.0, 5.0))]
    times = np.linspace(0.0, 80.0, 33)
    found = ManyProfiles(profiles)(times)
    np.testing.assert_array_equal(found, np.stack([p(times) for p in profiles], axis=1))
