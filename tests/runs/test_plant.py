"""Parts of runs of many: starts, profiles, drives, the largest forces row by row."""

from __future__ import annotations

import copy
import itertools
import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from designed import LIMITED
from falling_friction import with_falling
from plain_scenario import plain_scenario, wet_patch

import contactlib as cl
from contactlib.runs.plant import ManyProfiles, Runs, common_step, timing
from contactlib.traction import stacked
from contactlib.vehicle import Axle, CreepCurve, Drivetrain, DynamicLoad, Motor
from contactlib.vehicle.available_force import AvailableForce, track_levels

STEP = cl.Profile((30.0, 30.0, 60.0, 60.0), (1.0, 0.5, 0.5, 1.0))
SHAFT = Motor(rotor_inertia=7.5, gear_ratio=4.0, shaft_stiffness=1.5e6)
RAMP = cl.Profile((30.0, 40.0), (1.0, 0.5))


# ---- largest forces -------------------------------------------------------------------------


@pytest.mark.parametrize("falls", [False, True])
def test_interpolated_forces_are_those_that_are_searched(locomotive: cl.Model, falls: bool) -> None:
    rng = np.random.default_rng(3)
    laws = (0.1, 2.0), (0.0, 0.0), (0.9, 0.2)
    bodies = [locomotive.wheelset] * 3
    if falls:
        bodies = [with_falling(locomotive.wheelset, *law) for law in laws]
    split = cl.Track(friction_left=STEP, friction_right=cl.Profile.of(0.7))
    slope = cl.Profile((10.0, 10.0, 50.0, 70.0), (1.0, 0.3, 0.3, 2.0))
    tracks = [cl.Track(friction_left=STEP, slope=slope), split, cl.Track(friction_left=RAMP)]
    available = AvailableForce([Drivetrain(body) for body in bodies], tracks, loaded=True)
    speed = np.concatenate([10.0 ** rng.uniform(-3.0, 2.7, (15, 3)), [[0.0, -0.05, -20.0]]])
    where, when = rng.uniform(0.0, 90.0, speed.shape), 0.0
    scale = np.stack([t.friction_scale(x, when) for t, x in zip(tracks, where.T, strict=True)], 1)
    slopes = np.stack([track.slope(x) for track, x in zip(tracks, where.T, strict=True)], 1)
    nominal = np.array([body.element.axle_load for body in bodies])
    load = nominal * np.where(rng.uniform(size=speed.shape) < 0.3, 0.7, 1.0)
    load[3] = 0.0
    forces = available(speed, scale[..., 0], scale[..., 1], slopes, load)
    for i, body in enumerate(bodies):
        expected = [
            cl.vehicle.available_force(
                body.with_slope(slope).element,
                speed=speed[k, i],
                axle_load=load[k, i],
                friction_scale=scale[k, i, 0],
                other_friction_scale=scale[k, i, 1],
            )
            for k, slope in enumerate(slopes[:, i].tolist())
        ]
        np.testing.assert_allclose(forces[:, i], expected, rtol=1e-8)


def test_levels_of_a_track_are_where_it_does_not_change() -> None:
    assert track_levels(cl.Track()) == [(1.0, 1.0, 1.0)]
    assert track_levels(cl.Track(friction_left=STEP)) == [(0.5, 0.5, 1.0), (1.0, 1.0, 1.0)]
    rain = cl.Profile((0.0, 1.0, 2.0), (1.0, 0.8, 0.8))
    levels = track_levels(cl.Track(friction_left=RAMP, friction_over_time=rain))
    assert levels == [(f, f, 1.0) for f in (0.4, 0.5, 0.8, 1.0)]
    both = cl.Track(friction_left=STEP, friction_right=RAMP)
    assert track_levels(both) == [(0.5, 0.5, 1.0), (1.0, 0.5, 1.0), (1.0, 1.0, 1.0)]
    wet = cl.Track(
        friction_left=STEP, slope=cl.Profile((45.0, 45.0, 60.0, 90.0), (1.0, 0.3, 0.3, 1.0))
    )
    assert track_levels(wet) == [(0.5, 0.5, 0.3), (0.5, 0.5, 1.0), (1.0, 1.0, 1.0)]


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
    assert common_step(longest, times) == pytest.approx(step, rel=1e-12)


# ---- starts ---------------------------------------------------------------------------------


def begun(scenarios: list[cl.Scenario]) -> Runs:
    control = stacked([scenarios[0].controller("open_loop")])
    when = timing(scenarios[0], control.sample_time)
    return Runs(scenarios, control, when, index=range(len(scenarios)), tolerance=1e-6)


def test_starts_are_steady_on_the_rising_branch(locomotive: cl.Model, rig: cl.Model) -> None:
    """Together as one by one, at the first creepage that the equations of motion hold."""
    wet = cl.Polach.wet()
    flat = replace(locomotive.wheelset.element, table=cl.CreepForceTable.from_law(wet))
    bodies = [
        locomotive.wheelset,
        rig.wheelset,
        with_falling(locomotive.wheelset),
        with_falling(locomotive.wheelset, 0.0),
        with_falling(replace(locomotive.wheelset, element=flat)),
    ]
    cases, curves = [], []
    for body, right in itertools.product(bodies, (1.0, 0.6)):
        sides = [CreepCurve(body, speed=10.0, friction_scale=scale) for scale in (1.0, right)]
        track = cl.Track(friction_left=cl.Profile.of(1.0), friction_right=cl.Profile.of(right))
        for share in (-0.9, 0.0, 1e-4, 0.5, 0.97):
            demand = cl.Profile.of(share * sides[1].fold.drive_torque)
            case = plain_scenario(body, track=track, demand=demand)
            if body.speed_held:
                held = cl.Profile((0.0, 9.0), (10.0, 19.0))  # gains 1 m/s2
                case = replace(case, held_speed=held)
            cases.append(case)
            curves.append(sides)
    runs = begun(cases)
    assert not runs.failed.any()
    block = next(runs.blocks())
    for i, (case, sides) in enumerate(zip(cases, curves, strict=True)):
        wheelset, creepage = case.drivetrain.wheelset, float(block["creepage"][0, i])
        turning = wheelset.inertia / wheelset.radius if wheelset.speed_held else 0.0
        before = np.linspace(0.0, creepage, 200)
        torques, slopes = np.mean([(c.torque(before), c.slope(before)) for c in sides], axis=0)
        excess = torques + (1.0 + before) * turning - case.demand.value[0]
        assert abs(excess[-1] / slopes[-1]) <= 1e-12 * abs(creepage) + 1e-14
        assert (slopes > 0.0).all()


@pytest.mark.parametrize("axle", [None, Axle(stiffness=6e6, drive_share=0.3)])
def test_a_start_twists_axle_and_shaft(rig: cl.Model, axle: Axle | None) -> None:
    """While the speed rises by 1 m/s2, the shaft lacks the torque that the rotor takes."""
    train, held = Drivetrain(rig.wheelset, axle=axle, motor=SHAFT), (10.0, 19.0)
    given = {"demand": cl.Profile.of(8e3), "held_speed": cl.Profile((0.0, 9.0), held)}
    run = cl.run_scenario(plain_scenario(train, **given, duration=0.3), "open_loop")
    assert run.time[1] <= 0.1 * np.pi / math.hypot(*train.vibrations)
    taken = 4.0**2 * 7.5 * (1.0 + run["creepage"][0]) / rig.wheelset.radius
    np.testing.assert_allclose(run["shaft_torque"], 8e3 - taken, rtol=1e-3)
    np.testing.assert_allclose(run["motor_omega"], run["omega"], rtol=1e-6)
    np.testing.assert_allclose(run["creepage_left"], run["creepage_right"], rtol=1e-2)
    more = set(run.units) - set(cl.run_scenario(plain_scenario(rig.wheelset), "open_loop").units)
    assert more == {"motor_omega", "shaft_torque"}


def test_at_the_very_fold_and_beyond(locomotive: cl.Model) -> None:
    fold = cl.find_fold(locomotive.wheelset, speed=10.0)
    demands = [cl.Profile.of(x * fold.drive_torque) for x in (1.0 - 1e-9, 1.0 + 1e-6, 0.5)]
    runs = begun([plain_scenario(locomotive.wheelset, demand=demand) for demand in demands])
    assert runs.failed.tolist() == [False, True, False]
    assert "the rising branch ends at" in str(runs.refused[1])
    first = next(runs.blocks())["creepage"][0]
    assert first[0] == pytest.approx(fold.creepage, rel=1e-3)


# ---- profiles -------------------------------------------------------------------------------


def test_many_profiles_are_each_of_them() -> None:
    profiles = [STEP, cl.Profile.of(3.0), RAMP, STEP, cl.Profile((1.0, 2.0), (5.0, 5.0))]
    times = np.linspace(0.0, 80.0, 33)
    values = ManyProfiles(profiles)(times)
    np.testing.assert_array_equal(values, np.stack([p(times) for p in profiles], axis=1))


# ---- drives ---------------------------------------------------------------------------------

HUGE = Motor(lag=0.01, power=1e100, torque_rate=1e100, trip_speed=1e100)


def driven(motor: Motor, **changes: Any) -> cl.Scenario:
    """A wet patch, on which the open loop slips away, with another drive."""
    drivetrain = replace(wet_patch().drivetrain, motor=motor)
    given: dict[str, Any] = {"duration": 8.0, "demand": cl.Profile.of(23.5e3), **changes}
    return wet_patch(drivetrain=drivetrain, **given)


def at_samples(case: cl.Scenario, controller: str) -> dict[str, np.ndarray]:
    """Signals at the controller's samples, from rows twice as dense."""
    run = cl.run_scenario(case, controller, step=0.005)
    names = ("demand", "commanded_torque", "omega", "speed")
    assert (run["commanded_torque"][1::2] == run["commanded_torque"][:-1:2]).all()  # it is held
    assert cl.metrics(run, case.drivetrain).energy_defect < 1e-8
    return {name: run[name][::2] for name in names}


@pytest.mark.parametrize("controller", ["open_loop", "creep_pi"])
def test_power_is_limited_at_every_sample(controller: str) -> None:
    power = 4.6e5  # the demand at the start has 4.7e5 W
    samples = at_samples(driven(Motor(lag=0.01, power=power)), controller)
    given = np.abs(samples["commanded_torque"] * samples["omega"])
    assert given.max() == pytest.approx(power, rel=1e-12)
    assert samples["omega"][-1] > 2.0 * samples["omega"][0] or controller == "creep_pi"
    possible = samples["demand"] * samples["speed"] / 0.5
    np.testing.assert_allclose(possible, power, rtol=1e-12)
    assert (samples["commanded_torque"] <= samples["demand"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("controller", LIMITED)
def test_torque_changes_at_the_largest_rate_at_most(controller: str) -> None:
    rate = 1.5e5
    demand = cl.Profile((1.0, 1.0, 5.0, 5.0, 6.0), (0.0, 23.5e3, 23.5e3, -20e3, -20e3))
    case = driven(Motor(lag=0.01, torque_rate=rate), demand=demand)
    torque = at_samples(case, controller)["commanded_torque"]
    change = np.diff(torque) / 0.01
    assert (change.min(), change.max()) == pytest.approx((-rate, rate), rel=1e-9)
    assert torque[0] == 0.0


def test_a_drive_that_has_tripped_waits_until_nothing_is_demanded() -> None:
    trip = 14.0
    demand = cl.Profile((5.0, 5.0, 5.5, 5.5), (23.5e3, 0.0, 0.0, 10e3))
    samples = at_samples(driven(Motor(trip_speed=trip), demand=demand), "open_loop")
    rim, torque = 0.5 * samples["omega"], samples["commanded_torque"]
    first = int(np.argmax(rim >= trip))
    assert (torque[:first] == samples["demand"][:first]).all()
    assert 1.0 < 0.01 * first < 5.0
    # After the sample at which it trips nothing accelerates the wheel.
    assert trip < rim.max() == rim[first] < trip + 0.01 * 0.5 * 23.5e3 / 250.0
    assert (torque[first:550] == 0.0).all()  # although the wheel sticks again, and there is demand
    assert (rim[first + 200 : 500] < trip).all()
    assert (torque[550:] == 10e3).all()


def test_a_wheel_above_the_trip_speed_stays_without_torque() -> None:
    slow = driven(Motor(trip_speed=9.0), demand=cl.Profile((1.0, 1.0), (0.0, 10e3)))
    assert not at_samples(slow, "open_loop")["commanded_torque"][1:].any()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the run reaches")  # which limits would keep it from
@pytest.mark.parametrize("controller", [name for name in cl.CONTROLLERS if name != "wsp"])
def test_limits_that_are_never_reached_change_no_bit(controller: str) -> None:
    free, huge = (cl.run_scenario(driven(motor), controller) for motor in (Motor(lag=0.01), HUGE))
    for name in ("omega", "speed", "commanded_torque", "creep_work"):
        assert (free[name] == huge[name]).all(), name


def test_the_drive_does_not_depend_on_the_rows() -> None:
    motor = Motor(lag=0.01, power=5e5, torque_rate=1.5e5, trip_speed=13.0)
    wet = cl.Track(friction_over_time=cl.Profile((3.0, 3.0, 6.0, 6.0), (1.0, 0.55, 0.55, 1.0)))
    case = driven(motor, track=wet)
    coarse, fine = (cl.run_scenario(case, "creep_pi", step=step) for step in (0.01, 0.0025))
    np.testing.assert_allclose(
        fine["commanded_torque"][::4], coarse["commanded_torque"], rtol=1e-5, atol=0.1
    )


ENCODER = {"encoder_pulses": 100.0, "acceleration_limit": 0.3, "vehicle_speed_noise": 0.0}
MEMORIES = {
    "drives and brakes": lambda: cl.load_scenario("wheel_slide_protection.toml"),
    "vehicle": lambda: cl.load_scenario("coach_braking.toml"),
    "elastic axle": lambda: cl.load_scenario("torsion.toml"),
    "shaft": lambda: wet_patch(drivetrain=replace(wet_patch().drivetrain, motor=SHAFT)),
    "sensors": lambda: wet_patch(ENCODER),
    "load": lambda: wet_patch(dynamic_load=DynamicLoad(frequency=(0.5, 9.0), density=(0.02, 0.0))),
    "cleaned rail": lambda: wet_patch(
        track=replace(wet_patch().track, cleaning=1e-3, recovered=1.0)
    ),
}


@pytest.mark.parametrize("name", MEMORIES)
def test_copies_of_a_plant_go_on_with_its_bits_on_their_own(name: str) -> None:
    scenario = MEMORIES[name]()
    for plant in (cl.Plant(scenario), cl.Plant([scenario] * 3)):
        demand = plant.reset(5).demand
        torques = [share * demand for share in np.linspace(0.5, 1.0, 30)]
        for torque in torques:
            plant.step(torque)
        pickled = pickle.loads(pickle.dumps(plant))  # noqa: S301 - of our own making
        copies = [copy.deepcopy(plant), copy.copy(plant), pickled]
        expected = [(plant.step(torque), plant["creep_work"]) for torque in torques]
        for copied in copies:
            steps = [(copied.step(torque), copied["creep_work"]) for torque in torques]
            np.testing.assert_equal(steps, expected)


def test_a_plant_refuses_what_it_cannot_do() -> None:
    with pytest.raises(ValueError, match="expected a Scenario, got 'dry_wet_dry'"):
        cl.Plant(["dry_wet_dry"])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="at least one wheelset"):
        cl.Plant([])
    with pytest.raises(ValueError, match=r"drive_torque = 80000\.0 is out of range: the rising"):
        cl.Plant(wet_patch(demand=cl.Profile.of(9e4)))
    plant = cl.Plant([wet_patch()] * 2)
    with pytest.raises(ValueError, match=r"torque has the shape \(3,\): must be \(\) or \(2,\)"):
        plant.step([1.0, 2.0, 3.0])
    with pytest.raises(KeyError, match=r"no signal 'slip'; .*known: demand, "):
        plant["slip"]
