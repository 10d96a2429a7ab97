"""The integrator of the wheelset."""

from __future__ import annotations

import numpy as np
import pytest
from native_models import native, steady_memory, with_memory

import contactlib as cl
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
