"""Gains of the creep controllers and of the load observer."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from designed import SENSORS, STEP, designed
from scipy.linalg import expm

import contactlib as cl
from contactlib import stability
from contactlib.traction import Measurement, Sensors, total_delay
from contactlib.traction.design import peak_creepage, slip_gains
from contactlib.vehicle import Drivetrain
from contactlib.vehicle.drivetrain import Brake, Motor


def linearised_loop(
    model: cl.Model, controller: cl.traction.CreepPI, creepage: float, speed: float
) -> Any:
    """One sample of held-speed plant, sensors and the controller itself, as a matrix.

    State: angular velocity, the measurements under way, and the controller's own memory.
    """
    wheelset = replace(model.wheelset, mass=None)
    point = wheelset.balanced(creepage=creepage, speed=speed)
    step, radius = controller.sample_time, wheelset.radius
    generator = np.zeros((2, 2))
    generator[0] = point.jacobian[0, 0], 1.0 / wheelset.inertia
    grown, pushed = expm(step * generator)[0]
    delay = SENSORS.samples_of_delay(step)
    demand = np.array(2.0 * point.drive_torque)

    def advance(state: np.ndarray) -> np.ndarray:
        omega, late, (tracked, change, integral) = state[0], state[1:-3], state[-3:]
        seen = np.append(omega, late)[delay]
        given = np.array(integral)
        measured = Measurement(demand, np.array(radius * seen), np.array(speed), given)
        memory = controller.start(measured, integral)
        vehicle = memory.vehicle._replace(speed=np.array(tracked), change=np.array(change))
        torque, memory = controller.sample(measured, memory._replace(vehicle=vehicle))
        onward = point.omega + grown * (omega - point.omega)
        onward += pushed * (float(torque) - point.drive_torque)
        kept = (memory.vehicle.speed, memory.vehicle.change, memory.integral)
        return np.array([onward, omega, *late[:-1], *map(float, kept)])

    rest = np.array([point.omega] * (delay + 1) + [speed, 0.0, point.drive_torque])
    np.testing.assert_allclose(advance(rest), rest, rtol=1e-9, atol=1e-9)
    sizes = np.array([1e-4] * (delay + 1) + [1e-4, 1e-4, 1.0])
    columns = [
        (advance(rest + d) - advance(rest - d)) / (2.0 * size)
        for d, size in zip(np.diag(sizes), sizes, strict=True)
    ]
    return np.array(columns).T


def test_the_peak_of_friction_that_does_not_fall_is_where_the_rise_ends(rig: cl.Model) -> None:
    coulomb = cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0)
    element = replace(rig.wheelset.element, friction=coulomb)
    at = peak_creepage(replace(rig.wheelset, element=element), 10.0)
    assert at == pytest.approx(element.saturation_creepage, rel=5e-3)


@pytest.mark.parametrize("constant", [False, True])
def test_designed_creep_control_is_stable_over_speeds_and_creepages(
    locomotive: cl.Model, constant: bool
) -> None:
    wheelset, beyond = locomotive.wheelset, 0
    delay = total_delay(Drivetrain(wheelset), SENSORS, STEP)
    for speed in (3.0, 10.0, 20.0, 40.0):
        peak = peak_creepage(wheelset, speed)
        for creepage in peak * np.array([0.3, 0.6, 0.85, 1.0, 1.02, 1.05, 1.1, 1.3]):
            pole = float(cl.stability.fast_pole(wheelset, float(creepage), speed=speed))
            designed_for = float(cl.stability.fast_pole(wheelset, float(creepage), speed=10.0))
            if pole * delay > 0.3 or designed_for * delay > 1.0:
                continue  # beyond what a gain can be robust for, or hold at all
            torque = None
            if not constant:
                torque = wheelset.balanced(creepage=creepage, speed=speed).drive_torque
            controller = designed(
                "creep_pi",
                locomotive,
                reference=float(creepage),
                reference_torque=torque,
                minimum_slip=0.0,
                creepage_error=0.0,
            )
            assert isinstance(controller, cl.traction.CreepPI)
            loop = linearised_loop(locomotive, controller, float(creepage), speed)
            assert np.abs(np.linalg.eigvals(loop)).max() < 1.0, (speed, creepage)
            beyond += pole > 0.0
    assert beyond >= 6  # points that a constant torque cannot hold


def test_designed_gains_are_robust(locomotive: cl.Model) -> None:
    drivetrain = Drivetrain(locomotive.wheelset)
    inertia, radius = drivetrain.wheelset.inertia, drivetrain.wheelset.radius
    delay = total_delay(drivetrain, SENSORS, STEP)
    for product, bound in ((0.0, 1.6), (0.15, 1.75), (0.3, 2.7)):
        pole = product / delay
        gains = slip_gains(drivetrain, pole=pole, sensors=SENSORS, sample_time=STEP)
        names = ("proportional_gain", "integral_gain")
        proportional, integral = (gains[name] * radius / inertia for name in names)
        s = 1j * np.geomspace(1e-2, 1e3, 20001)
        loop = (proportional + integral / s) * np.exp(-delay * s) / (s - pole)
        assert np.abs(1.0 / (1.0 + loop)).max() < bound
        window = stability.proportional_window(pole, delay=delay)
        assert 2.1 * window.lowest < proportional < window.highest / 2.1


@pytest.mark.parametrize("kind", ["creep_pi", "slope_seeking"])
def test_traction_and_braking_each_have_the_gains_of_their_own_lag(
    locomotive: cl.Model, kind: str
) -> None:
    """Those of a motor with that lag; gains that a file gives hold in both."""
    brake = Brake(fill_time=0.6, vent_time=0.2, delay=0.04)
    plain, braked = Drivetrain(locomotive.wheelset), Drivetrain(locomotive.wheelset, brake=brake)
    slow = replace(plain, motor=Motor(lag=0.64))

    def design(drivetrain: Drivetrain, **given: Any) -> Any:
        known = {"speed": 10.0, "sensors": SENSORS, "sample_time": STEP, **given}
        return cl.CONTROLLERS[kind].for_drivetrain(drivetrain, **known)

    quick, both, late = map(design, (plain, braked, slow))
    share = both.brake_share
    assert share < 0.2
    assert (both.proportional_gain, both.integral_gain) == (
        quick.proportional_gain,
        quick.integral_gain,
    )
    assert share * both.proportional_gain == pytest.approx(late.proportional_gain, rel=1e-12)
    assert share**2 * both.integral_gain == pytest.approx(late.integral_gain, rel=1e-12)
    assert quick.brake_share == design(braked, proportional_gain=1e5).brake_share == 1.0


def test_noise_bounds_the_gain(locomotive: cl.Model) -> None:
    # Without delay a gain could be as high as one likes.
    quick = Sensors(wheel_speed_noise=0.02)
    controller = designed("creep_pi", locomotive, sensors=quick, sample_time=0.001)
    assert isinstance(controller, cl.traction.CreepPI)
    assert controller.proportional_gain * 0.02 == pytest.approx(0.01 * 220.65e3 * 0.5)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.2])
def test_slope_seeking_gets_no_friction(locomotive: cl.Model, noise: float) -> None:
    # The same stiffness and layer: 0.2 m/s of noise is enough to bound the gain.
    element, sensors = locomotive.wheelset.element, replace(SENSORS, wheel_speed_noise=noise)
    fields = []
    for kinetic, static, weakening in ((0.21, 0.45, 1.0), (0.3, 0.33, 0.1), (0.21, 0.21, 0.0)):
        friction = replace(
            element.friction,
            kinetic=kinetic,
            static=static,
            weakening_length=weakening * element.friction.weakening_length,
        )
        other = replace(element, friction=friction)
        model = replace(locomotive, wheelset=replace(locomotive.wheelset, element=other))
        fields.append(asdict(designed("slope_seeking", model, sensors=sensors)))  # type: ignore[call-overload]
    for other_fields in fields[1:]:
        assert other_fields == pytest.approx(fields[0], rel=1e-6)


def test_a_reference_that_no_gain_can_hold_is_refused(locomotive: cl.Model) -> None:
    steep = cl.worst_pole(locomotive.wheelset, speed=5.0).creepage
    with pytest.raises(ValueError, match=r"cannot be held at 5.0 m/s"):
        designed("creep_pi", locomotive, speed=5.0, reference=steep)
    assert designed("creep_pi", locomotive, speed=40.0, reference=steep)
