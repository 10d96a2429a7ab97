"""Friction brakes: dead time, filling and venting, and wheels that lock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contactlib as cl
from contactlib.traction import OpenLoop, total_delay
from contactlib.vehicle import Axle, Brake, Motor

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
    with_brake = replace(case, drivetrain=replace(case.drivetrain, brake=BRAKE))
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
def test_wheels_lock_and_never_turn_backward(axle: Axle | None, sign: float) -> None:
    """At friction far below the demand, and in either direction of travel."""
    wet = cl.Track(friction_left=cl.Profile.of(0.15))
    case = braking(BRAKE, initial_speed=sign * 8.0, design_speed=8.0, track=wet, duration=25.0)
    case = replace(case, demand=cl.Profile((1.0, 1.0), (0.0, -2e4)))
    train = case.drivetrain
    plain = replace(train.wheelset, element=replace(train.wheelset.element, memory=False))
    braked = run(replace(case, drivetrain=replace(train, wheelset=plain, axle=axle)))
    turning = sign * np.minimum(sign * braked["omega_left"], sign * braked["omega_right"])
    assert (sign * turning).min() > -1e-12
    locked = (sign * braked["speed"] > 2.0) & (braked.time > 4.0)
    assert np.abs(sign * braked["creepage"][locked] + 1.0).max() < 0.03
    assert abs(braked["speed"][-1]) < 1e-6  # stands
    assert np.diff(braked["drive_work"]).max() < 1e-6  # a brake only takes energy
    assert np.abs(braked["energy_defect"]).max() < 1e-3


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
    together = cl.Plant(cases)
    singles = [cl.Plant(case) for case in cases]
    for k in range(200):
        torque = -1e4 if k % 50 < 30 else 5e3
        together.step(torque)
        for plant in singles:
            plant.step(torque)
    for signal in ("speed", "omega", "drive_torque"):
        np.testing.assert_array_equal(together[signal], [plant[signal] for plant in singles])


def test_designs_know_the_slowest_response() -> None:
    case = braking(BRAKE, Motor(lag=0.01))
    assert case.drivetrain.lag == pytest.approx(0.34)
    late = total_delay(case.drivetrain, case.sensors, 0.01)
    assert late == pytest.approx(0.34 + case.sensors.delay + 0.005)


@pytest.mark.parametrize("key", ["fill_time", "vent_time", "delay"])
def test_limits(key: str) -> None:
    with pytest.raises(ValueError, match=rf"^Brake\.{key} = -1.0 is out of range: must be .* 0"):
        replace(BRAKE, **{key: -1.0})
