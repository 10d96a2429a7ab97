"""The integrator of the wheelset."""

from __future__ import annotations

import numpy as np
import pytest
from brake_pads import GIVE, held_by
from native_models import native, steady_memory, with_memory
from scipy.integrate import solve_ivp

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.export.description import Description


@pytest.mark.parametrize(("memory", "torque", "omega"), [(False, 26e3, 20.1), (True, 8e3, 20.005)])
def test_wheelset_is_integrated_with_third_order(
    locomotive: cl.Model, memory: bool, torque: float, omega: float
) -> None:
    """With memory where no zone begins to slip, as rates have a kink there."""
    description = Description(with_memory(locomotive, memory), "wheelset")
    radius, start = locomotive.wheelset.radius, {}
    if memory:
        start = steady_memory(description.element, omega=omega, speed=10.0)

    def slip(steps: int) -> float:
        model = native(description, drive_torque=torque, omega=omega, **start)
        for _ in range(steps):
            model.advance(0.02 / steps, tolerance=1e9)  # each step in one
        turning, speed = model.get("omega", "speed")
        return radius * turning - speed

    steps = np.array([40, 80, 160, 320])
    exact = slip(20480)
    errors = [abs(slip(n) - exact) for n in steps.tolist()]
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order > 2.75


@pytest.mark.parametrize("step", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("torque", [20e3, 26e3, 30e3])
def test_wheelset_moves_as_in_the_stiff_solver(
    locomotive: cl.Model, torque: float, step: float
) -> None:
    # From the rising branch, close below the peak, and in a slip-away.
    wheelset = locomotive.wheelset
    control = cl.TorqueControl(cl.Profile.of(torque))
    exact = cl.simulate(
        wheelset, control, duration=2.0, initial_speed=3.0, initial_creepage=0.0, tolerance=1e-11
    )
    description = Description(locomotive, "wheelset")
    model = native(description, drive_torque=torque, omega=3.0 / wheelset.radius, speed=3.0)
    for _ in range(round(2.0 / step)):
        model.advance(step, tolerance=1e-8)
    omega, speed = model.get("omega", "speed")
    assert omega == pytest.approx(exact["omega"][-1], rel=1e-6)
    assert speed == pytest.approx(exact["speed"][-1], rel=1e-6)


@pytest.mark.parametrize(
    ("speed", "memory"),
    # With memory a wheel at rest is a mass on a spring, which nothing damps.
    [(0.0, False), (0.01, False), (1.0, False), (100.0, False), (1.0, True), (100.0, True)],
)
def test_wheelset_takes_any_step_at_any_speed(rig: cl.Model, speed: float, memory: bool) -> None:
    # L-stable: however stiff, a long step ends where the slip is at rest.
    description = Description(with_memory(rig, memory), "wheelset")
    model = native(description, drive_torque=9e3, speed=speed, omega=1.001 * speed / 0.5)
    for _ in range(3):
        model.advance(10.0)
    (rate,) = model.get("der(omega)")
    assert abs(rate) < 1e-6 * 9e3 / rig.wheelset.inertia


# ---- the brake -----------------------------------------------------------------------------------

BRAKE = {"brake_torque": 2e4, "friction_scale": 0.3, "inverse_mass": 5e-5, "damping": 0.0}


def braked_run(model: cl.Model, step: float, steps: int, **given: float) -> FloatArray:
    """Rows of omega, speed, pads and creep force, with memory."""
    one, rows = native(Description(with_memory(model), "wheelset"), **{**BRAKE, **given}), []
    for _ in range(steps):
        one.advance(step, tolerance=1e-9)
        rows.append(one.get("omega", "speed", "pads", "creep_force"))
    return np.array(rows)


def test_braked_wheel_moves_by_the_equations_written_again(locomotive: cl.Model) -> None:
    """It locks in the first half of the second; its pads then stick."""
    body = with_memory(locomotive).wheelset
    contact, load, radius = body.element.rolling_native, body.element.axle_load, body.radius
    resisting = body.resistance

    def rates(_: float, y: FloatArray) -> list[float]:
        omega, speed, pads, *held = y.tolist()
        out = contact.evaluate_one(omega, speed, load, 0.3, *held)
        part, carried = held_by(pads, radius * omega)
        davis = resisting.constant + resisting.linear * speed + resisting.quadratic * speed**2
        turning = (-2e4 * part - radius * out.creep_force) / body.inertia
        moving = (out.creep_force - davis) / 2e4
        return [turning, moving, carried, out.held_rate, out.unslipped_rate, out.outer_rate]

    start, time = [10.0 / radius, 10.0, 1.0, 0.0, 1.0, 0.0], np.linspace(0.1, 1.0, 10)
    exact = solve_ivp(rates, (0.0, 1.0), start, "LSODA", time, rtol=1e-9, atol=1e-9)
    rows = braked_run(locomotive, 0.1, 10)
    assert abs(rows[-1, 0]) < 1e-6 < rows[2, 0]
    assert abs(rows[-1, 2]) < 0.9
    np.testing.assert_allclose(rows[:, :3], exact.y[:3].T, rtol=1e-6, atol=1e-6)


def test_brake_backward_is_the_mirror_of_forward(locomotive: cl.Model) -> None:
    """To the last bit, and neither way is energy gained but what the pads give back."""
    radius, inertia = locomotive.wheelset.radius, locomotive.wheelset.inertia
    forth, back = (
        sign
        * braked_run(locomotive, 0.01, 600, omega=sign * 4.0 / radius, speed=sign * 4.0, pads=sign)
        for sign in (1.0, -1.0)
    )
    np.testing.assert_array_equal(forth, back)
    energy = 0.5 * (inertia * forth[:, 0] ** 2 + 2e4 * forth[:, 1] ** 2)
    assert (energy - np.minimum.accumulate(energy)).max() < 2e4 * GIVE / radius
    assert np.abs(forth[-1, :2]).max() < 1e-6  # it stands


@pytest.mark.parametrize("step", [0.01, 10.0])
def test_braked_wheel_holds_on_a_grade(locomotive: cl.Model, step: float) -> None:
    given = {"grade_acceleration": 0.2, "omega": 0.0, "speed": 0.0, "pads": 0.0}
    omega, speed, pads, force = braked_run(locomotive, step, 200, **given)[-1]
    assert max(abs(omega), abs(speed)) < 1e-6
    assert force == pytest.approx(0.2 * 2e4, rel=1e-6)
    assert pads == pytest.approx(-0.2 * locomotive.wheelset.radius, rel=1e-6)
