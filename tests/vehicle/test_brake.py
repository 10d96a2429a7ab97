"""Friction brakes: dead time, filling and venting, and wheels that lock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from brake_pads import GIVE
from scipy.interpolate import RegularGridInterpolator

import contactlib as cl
from contactlib import kernel
from contactlib.traction import OpenLoop, Sensors, total_delay
from contactlib.vehicle import Axle, Brake, Motor, Resistance

BRAKE = Brake(fill_time=0.3, vent_time=0.12, delay=0.04)
STEP = cl.Profile((1.0, 1.0, 3.0, 3.0), (0.0, -9e3, -9e3, 0.0))


def braking(brake: Brake | None, motor: Motor | None = None, **changes: object) -> cl.Scenario:
    """A locomotive without wagons on dry rails at 20 m/s, in open loop."""
    case = cl.load_scenario("braking.toml")
    wheelset = replace(case.drivetrain.wheelset, mass=22.5e3)
    train = replace(case.drivetrain, wheelset=wheelset, brake=brake, motor=motor or Motor())
    known = {"demand": STEP, "duration": 5.0, "track": cl.Track(), **changes}
    return replace(case, drivetrain=train, controllers={"open_loop": OpenLoop()}, **known)  # type: ignore[arg-type]


def run(case: cl.Scenario) -> cl.Result:
    return cl.run_scenario(case, "open_loop")


def test_filling_and_venting_are_of_first_order_after_the_dead_time() -> None:
    braked = run(braking(BRAKE))
    filled, vented = (braked.time - at - BRAKE.delay for at in (1.0, 3.0))
    top = 9e3 * -np.expm1(-2.0 / BRAKE.fill_time)
    torque = 9e3 * -np.expm1(-np.maximum(filled, 0.0) / BRAKE.fill_time)
    torque[vented > 0.0] = top * np.exp(-vented[vented > 0.0] / BRAKE.vent_time)
    np.testing.assert_allclose(-braked["drive_torque"], torque, atol=2.0)
    np.testing.assert_array_equal(braked["commanded_torque"], braked["demand"])


def test_a_brake_with_one_time_constant_is_a_motor_s_lag() -> None:
    lag = 0.2
    brake, motor = (
        run(braking(Brake(fill_time=lag, vent_time=lag))),
        run(braking(None, Motor(lag=lag))),
    )
    for signal in ("speed", "omega", "creep_force", "drive_work"):
        scale = np.abs(motor[signal]).max()
        np.testing.assert_allclose(brake[signal], motor[signal], atol=1e-5 * scale)


def test_a_brake_that_is_not_applied_changes_no_bit() -> None:
    case = braking(None, Motor(lag=0.01, power=3e5, torque_rate=4e4), demand=cl.Profile.of(2e4))
    brake = replace(BRAKE, pad_scale=0.5)
    with_brake = replace(case, drivetrain=replace(case.drivetrain, brake=brake))
    plain, other = run(case), run(with_brake)
    for signal in plain.signals:
        assert np.array_equal(plain[signal], other[signal], equal_nan=True), signal


@pytest.mark.parametrize(
    ("axle", "sign"),
    [
        (None, 1.0),
        pytest.param(None, -1.0, marks=pytest.mark.slow),
        pytest.param(Axle(stiffness=6e6, damping=200.0), 1.0, marks=pytest.mark.slow),
        (Axle(stiffness=6e6, damping=200.0), -1.0),
    ],
)
def test_wheels_lock(axle: Axle | None, sign: float) -> None:
    """At friction far below the demand, and in either direction of travel.

    They turn back by no more than the pads give, which give back no more than they took for it.
    """
    wet = cl.Track(friction_left=cl.Profile.of(0.15))
    case = braking(BRAKE, initial_speed=sign * 8.0, design_speed=8.0, track=wet, duration=25.0)
    case = replace(case, demand=cl.Profile((1.0, 1.0), (0.0, -2e4)))
    train = case.drivetrain
    plain = replace(train.wheelset, element=replace(train.wheelset.element, memory=False))
    braked = run(replace(case, drivetrain=replace(train, wheelset=plain, axle=axle)))
    for side in ("left", "right"):
        way = 0.5 * sign * np.cumsum(braked[f"omega_{side}"]) * braked.time[1]
        assert (np.maximum.accumulate(way) - way).max() < GIVE
    locked = (sign * braked["speed"] > 2.0) & (braked.time > 4.0)
    assert np.abs(sign * braked["creepage"][locked] + 1.0).max() < 0.03
    assert abs(braked["speed"][-1]) < 1e-6  # stands
    given_back = braked["drive_work"] - np.minimum.accumulate(braked["drive_work"])
    assert given_back.max() < GIVE * 2e4 / 0.5
    assert np.abs(braked["energy_defect"]).max() < 1e-3


def on_grade(grade: float, *, memory: bool = True, **changes: object) -> cl.Scenario:
    """The locomotive on a grade, braked from the start with 8 kN.m."""
    case = braking(BRAKE, **{"initial_speed": 0.0, "demand": cl.Profile.of(-8e3), **changes})  # type: ignore[arg-type]
    body = case.drivetrain.wheelset
    element = replace(body.element, memory=memory)
    body = replace(body, element=element, damping=0.0, resistance=Resistance(grade=grade))
    return replace(case, drivetrain=replace(case.drivetrain, wheelset=body))


@pytest.mark.parametrize("grade", [0.03, -0.03])
def test_a_brake_holds_on_a_grade(grade: float) -> None:
    """For an hour, after it has settled in the first tenths of a second."""
    case = on_grade(grade, duration=3600.0, sensors=Sensors())
    held = cl.run_scenario(case, OpenLoop(sample_time=0.5), step=0.5)
    moved = np.sign(-grade) * held["distance"]
    assert 0.0 < moved[1] < GIVE
    assert abs(moved[-1] - moved[1]) < 2e-6
    assert case.drivetrain.wheelset.mass is not None
    weight = case.drivetrain.wheelset.mass * 9.80665 * grade
    np.testing.assert_allclose(held["creep_force"][1:], weight, rtol=1e-3)
    np.testing.assert_allclose(held["drive_torque"][1:], 0.5 * weight, rtol=1e-3)


def test_a_stop_swings_back_once() -> None:
    """The brake's pads give back what they took, and their holders damp it."""
    stop = cl.run_scenario(on_grade(0.0, initial_speed=2.0, duration=8.0), "open_loop", step=1e-3)
    assert stop["speed"].min() == pytest.approx(-5e-3, abs=2e-3)
    stopped = stop.time[np.argmax(stop["speed"] < 0.0)]
    assert np.abs(stop["speed"][stop.time > stopped + 0.5]).max() < 1e-5
    assert np.abs(stop["energy_defect"]).max() < 1e-6


@pytest.mark.parametrize("memory", [True, False])
def test_a_brake_that_is_too_weak_lets_the_vehicle_roll_back(memory: bool) -> None:
    case = on_grade(0.03, memory=memory, initial_speed=1.0, demand=cl.Profile.of(-1e3))
    body = case.drivetrain.wheelset
    back = run(case)
    assert body.mass is not None
    mass = body.mass + body.inertia / 0.5**2
    push, hold = 9.80665 * 0.03 * body.mass, 1e3 / 0.5
    for moving, force in ((back["speed"] > 0.2, -push - hold), (back["speed"] < -0.2, hold - push)):
        np.testing.assert_allclose(back["acceleration"][moving], force / mass, rtol=2e-3)


def test_contacts_without_memory_creep() -> None:
    """Their speed is that at which the steady force at the minimum speed is the weight's part."""
    case = on_grade(0.03, memory=False, duration=10.0)
    with pytest.warns(cl.InputWarning, match=r"^at the end the brake holds .* creeps at \d"):
        held = run(case)
    body = case.drivetrain.wheelset
    assert body.mass is not None
    slow = body.element.minimum_speed
    weight = 9.80665 * 0.03 * body.mass
    slip = -held["speed"][-1]
    force = body.element.evaluate(omega=slip / 0.5, speed=0.0)["creep_force"]
    assert force == pytest.approx(weight, rel=1e-6)
    assert 0.0 < slip < 1e-3 * slow


def test_the_motor_s_limits_are_not_the_brake_s() -> None:
    limits = Motor(power=5e4, torque_rate=2e3, trip_speed=10.0)
    braked = run(braking(BRAKE, limits))
    np.testing.assert_array_equal(braked["drive_torque"], run(braking(BRAKE))["drive_torque"])
    both = cl.Profile((1.0, 1.0, 2.0, 2.0), (0.0, -9e3, -9e3, 9e3))
    after = run(braking(BRAKE, Motor(torque_rate=2e3), demand=both))
    rising = (after.time > 2.0) & (after.time < 3.0)
    rate = np.diff(after["commanded_torque"][rising])
    assert rate.max() <= 2e3 * 0.01 * (1.0 + 1e-9)  # from zero, a sample at a time


def test_many_are_one_by_one() -> None:
    delays = (0.0, 0.04, 0.1)
    cases = [braking(replace(BRAKE, delay=delay)) for delay in delays] + [braking(None)]
    cases += [braking(replace(BRAKE, pad_speed=(0.0, 20.0), pad_friction=(1.2, 0.8)))]
    together = cl.Plant(cases)
    singles = [cl.Plant(case) for case in cases]
    for k in range(200):
        torque = -1e4 if k % 50 < 30 else 5e3
        together.step(torque)
        for plant in singles:
            plant.step(torque)
    for signal in ("speed", "omega", "drive_torque"):
        np.testing.assert_array_equal(together[signal], [plant[signal] for plant in singles])


def test_each_direction_is_designed_for_its_own_response() -> None:
    case = braking(BRAKE, Motor(lag=0.01))
    for lag, brakes in ((0.01, False), (0.34, True)):
        late = total_delay(case.drivetrain, case.sensors, 0.01, braking=brakes)
        assert late == pytest.approx(lag + case.sensors.delay + 0.005)


def test_a_stop_may_begin_with_its_demand() -> None:
    """Released, a demand at 0 s is one of later; applied, the brake is full from the start."""

    def held(since: float) -> cl.Profile:
        return cl.Profile(at=(since, since), value=(0.0, -9e3))

    later = run(braking(BRAKE, demand=held(1.0)))
    speed = float(later["speed"][np.searchsorted(later.time, 1.0)])
    begins = braking(BRAKE, demand=held(0.0), initial_speed=speed, duration=4.0)
    released, applied = run(replace(begins, start="released")), run(begins)
    after = slice(np.searchsorted(later.time, 1.0), None)
    for signal in ("speed", "creep_force", "drive_torque"):
        scale = np.abs(later[signal]).max()
        np.testing.assert_allclose(released[signal], later[signal][after], atol=1e-6 * scale)
    np.testing.assert_allclose(applied["drive_torque"], -9e3, rtol=1e-9)


def test_friction_of_pads_is_bilinear_between_the_points_of_its_table() -> None:
    """As SciPy's, of both wheels; constant beyond."""
    rng = np.random.default_rng(5)
    speed, pressure, friction = (0.0, 3.0, 20.0, 50.0), (5e4, 2e5, 4e5), rng.uniform(0.5, 1.5, 12)
    rows = list(zip(*np.array([(v, p) for v in speed for p in pressure]).T, friction, strict=True))
    v, p, mu = zip(*(rows[i] for i in rng.permutation(12)), strict=True)
    brake = replace(BRAKE, pressure=4e5, torque=1e4, pad_scale=0.7)
    brake = replace(brake, pad_speed=v, pad_pressure=p, pad_friction=mu)
    train = replace(braking(brake).drivetrain, axle=Axle(stiffness=6e6))
    states = np.zeros((500, 1), kernel.drivetrain_dtype("state"))
    rim, torque = rng.uniform(-70.0, 70.0, (2, 500, 1)), rng.uniform(0.0, 1.2e4, (500, 1))
    states["omega_left"], states["omega_right"] = rim / train.wheelset.radius
    states["brake_torque"], states["pads_left"], states["pads_right"] = torque, *np.sign(rim)
    there = train.native.evaluate(np.ones_like(states, kernel.drivetrain_dtype("input")), states)
    inside = np.clip(np.abs(rim), 0.0, 50.0), np.clip(torque / 1e4 * 4e5, 5e4, 4e5)
    found = 0.7 * RegularGridInterpolator((speed, pressure), friction.reshape(4, 3))(inside)
    np.testing.assert_allclose(there["pad_friction"], found.mean(axis=0), rtol=1e-12)
    acting = 1.0 - torque * (np.sign(rim) * found).mean(axis=0)  # 1 N.m is commanded
    np.testing.assert_allclose(there["drive_torque"], acting, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_stop_with_pads_is_that_of_a_point_mass(sign: float) -> None:
    """Whose friction falls with speed, in closed form: dv/dt = -k (1.3 - 0.02 s/m v)."""
    brake = replace(BRAKE, pad_speed=(30.0, 0.0), pad_friction=(0.7, 1.3))
    stiff = cl.Track(slope=cl.Profile.of(100.0))  # so that wheels roll
    case = braking(brake, demand=cl.Profile.of(-8e3), initial_speed=sign * 15.0, track=stiff)
    body = replace(case.drivetrain.wheelset, damping=0.0, resistance=Resistance())
    case = replace(case, drivetrain=replace(case.drivetrain, wheelset=body), duration=24.0)
    stop = cl.run_scenario(case, "open_loop", step=0.01)
    assert body.mass is not None
    k, rest = 8e3 / (body.radius * (body.mass + body.inertia / body.radius**2)), 1.3 / 0.02
    moves = stop.time < np.log(rest / (rest - 15.0)) / (0.02 * k) - 0.1
    speed = rest - (rest - 15.0) * np.exp(0.02 * k * stop.time[moves])
    np.testing.assert_allclose(sign * stop["speed"][moves], speed, atol=15.0 * 1e-4)
    friction = 1.3 - 0.02 * np.abs(body.radius * stop["omega"])
    np.testing.assert_allclose(stop["brake_torque"], 8e3 * friction, rtol=1e-9)
    assert np.abs(stop["energy_defect"]).max() < 1e-8 * np.abs(stop["drive_work"]).max()
    assert abs(stop["speed"][-1]) < 1e-5  # stands


def test_pads_of_half_the_friction_need_twice_the_torque() -> None:
    """Through a stop, and while they hold the vehicle on a grade."""
    case = on_grade(0.03, initial_speed=1.0, start="released", duration=5.0)
    train = case.drivetrain
    weak = replace(train, brake=replace(BRAKE, pad_scale=0.5))
    twice = replace(case, drivetrain=weak, demand=cl.Profile.of(-1.6e4))
    plain, other = run(case), run(twice)
    assert np.ptp(plain["distance"][-100:]) < 1e-6  # it holds
    for signal in ("speed", "omega", "creep_force", "drive_torque", "brake_torque"):
        np.testing.assert_allclose(other[signal], plain[signal], atol=1e-5 * plain[signal].max())
    for one, two in zip(cl.metrics(plain, train), cl.metrics(other, weak), strict=True):
        assert two == pytest.approx(one, rel=1e-4, abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        *(({key: -1.0}, rf"^Brake\.{key} = -1.0 is out of .* 0") for key in ("fill_time", "delay")),
        ({"vent_time": -1.0}, r"^Brake\.vent_time = -1.0 is out of range: must be .* 0"),
        ({"pad_speed": (0.0, 9.0)}, "pad_friction has 0, pad_speed 2 and pad_pressure 0 entries"),
        ({"pad_pressure": (0.0,), "pad_friction": (1.0,)}, "pad_pressure needs pressure"),
        ({"pad_speed": (1.0, 1.0), "pad_friction": (1.0, 2.0)}, "has 2 entries: must have 1"),
        ({"pad_friction": (0.0,)}, r"Brake.pad_friction = 0.0 is out .* > 0"),
        ({"pad_scale": 0.0}, r"Brake.pad_scale = 0.0 is out .* > 0"),
    ],
)
def test_limits(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(BRAKE, **changes)
