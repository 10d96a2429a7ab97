"""The force element coupled to a wheelset: held and implicit steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from native_models import native, steady_memory, with_memory, with_shift

import contactlib as cl
from contactlib import kernel
from contactlib.export.description import Description


def coupled(
    model: cl.Model,
    *,
    speed: float,
    torque: float | Callable[[float], float],
    step: float | Callable[[int], float],
    count: int,
    creepage: float = 0.0,
    mass_factor: float = 1.0,
    memory: bool = False,
    implicit: bool = True,
    parallel: bool = False,
    **across: float,
) -> np.ndarray:
    """Slip velocity and force of a body and the force element that exchange step by step."""
    wheelset = model.wheelset
    model = with_memory(model, memory)
    description = Description(
        model,
        "force_element",
        implicit=implicit,
        parallel_exchange=parallel,
        whole_wheelset=True,
    )
    omega = (1.0 + creepage) * speed / wheelset.radius
    start = {"omega": omega, "speed": speed}
    start |= steady_memory(description.element, **start)
    inverse_mass = mass_factor * description.start_values["effective_inverse_mass"]
    element = native(description, **start, **across, effective_inverse_mass=inverse_mass)
    (force,) = element.get("creep_force")
    rows, time = [], 0.0
    for i in range(count):
        before = force
        length = step(i) if callable(step) else step
        drive = torque(time) if callable(torque) else torque
        element.set(omega=omega, speed=speed)
        element.evaluate()
        if not (implicit or memory):
            (force,) = element.get("creep_force")
        element.advance(length)
        if implicit or memory:
            (force,) = element.get("creep_force")
        rows.append((wheelset.radius * omega - speed, force))
        contact = kernel.ffi.new(
            "force_element_output *", {"creep_force": before if parallel else force}
        )
        rates = wheelset.native.motion(omega, speed, drive, 0.0, contact)
        omega, speed = omega + length * rates.omega_rate, speed + length * rates.speed_rate
        time += length
    return np.array(rows)


def settles(run: np.ndarray) -> bool:
    """Whether the force comes to rest."""
    tail = run[-len(run) // 10 :, 1]
    return bool(np.ptp(tail) < 1e-3 * abs(tail.mean()))


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("speed", [0.01, 0.1, 1.0, 10.0])
def test_implicit_steps_are_stable_at_any_speed(
    rig: cl.Model, speed: float, parallel: bool
) -> None:
    for step in (1e-3, 1e-2):
        run = coupled(rig, speed=speed, torque=20e3, step=step, count=2000, parallel=parallel)
        assert settles(run)
        # Where the wheel's own balance is: T = r Q + b omega.
        balance = 20e3 - 0.5 * run[-1, 1] - 50.0 * (run[-1, 0] + speed) / 0.5
        assert abs(balance) < 1e-6 * 20e3


def test_held_steps_are_not(rig: cl.Model) -> None:
    assert settles(coupled(rig, speed=10.0, torque=20e3, step=1e-3, count=500, implicit=False))
    assert not settles(coupled(rig, speed=1.0, torque=20e3, step=1e-3, count=500, implicit=False))
    # The pole, and with it the longest step, is that of the creepage that the torque holds.
    for torque, step, stable in ((2e3, 4e-3, False), (20e3, 5e-3, True)):
        run = coupled(rig, speed=10.0, torque=torque, step=step, count=500, implicit=False)
        assert settles(run) == stable


@pytest.mark.parametrize(
    ("parallel", "stable", "unstable"),
    [(False, (0.78, 1.0, 10.0), (0.72,)), (True, (0.83, 1.0, 1.2), (0.77, 1.3))],
)
def test_implicit_steps_need_the_inverse_mass_this_well(
    rig: cl.Model, parallel: bool, stable: tuple[float, ...], unstable: tuple[float, ...]
) -> None:
    # In the stiff limit: above 3/4 of the true one; between 4/5 and 5/4 if both step at once.
    for factor in stable + unstable:
        run = coupled(
            rig,
            speed=0.01,
            torque=9e3,
            step=1e-2,
            count=2000,
            mass_factor=factor,
            parallel=parallel,
        )
        assert settles(run) == (factor in stable), factor


@pytest.mark.parametrize(
    ("parallel", "growth", "stable"),
    [(False, 100.0, True), (True, 2.0, True), (True, 3.5, False)],
)
def test_implicit_steps_may_grow_this_much(
    rig: cl.Model, parallel: bool, growth: float, stable: bool
) -> None:
    # A parallel force is made for as long a step as the last; what slip there was is multiplied
    # by 1 - growth in the stiff limit, and by 1 - 1/growth in the shorter step that follows.
    run = coupled(
        rig,
        speed=0.01,
        torque=9e3,
        step=lambda i: 1e-2 if i % 2 else 1e-2 / growth,
        count=2000,
        parallel=parallel,
    )
    assert settles(run) == stable


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("step", [1e-9, 1e-3])
@pytest.mark.parametrize("load", [1e-60, 1e-9, 1e-3])
def test_implicit_force_stays_below_static_friction_at_any_load(
    rig: cl.Model, load: float, step: float, parallel: bool
) -> None:
    # It is a small difference of momenta, whose rounding may be larger than a small load.
    description = Description(rig, "force_element", implicit=True, parallel_exchange=parallel)
    model = native(description, omega=1020.0, normal_load=load)
    for i in range(20):
        model.set(omega=1020.0 + 100.0 * np.sin(i))
        model.evaluate()
        model.advance(step)
        force, coefficient = model.get("creep_force", "traction_coefficient")
        largest = rig.wheelset.element.friction.static * (1.0 + 1e-12)
        assert abs(coefficient) <= largest
        assert abs(force) <= largest * load


@pytest.mark.parametrize("parallel", [False, True])
def test_implicit_exchange_converges_with_first_order(locomotive: cl.Model, parallel: bool) -> None:
    # Up a ramp of torque, so that what drives the slip changes.
    wheelset, duration = locomotive.wheelset, 0.4
    ramp = cl.Profile((0.0, duration), (15e3, 25e3))
    exact = cl.simulate(
        wheelset,
        cl.TorqueControl(ramp),
        initial_speed=10.0,
        initial_creepage=0.006,
        tolerance=1e-11,
    )
    end = wheelset.radius * exact["omega"][-1] - exact["speed"][-1]
    counts = np.array([1000, 2000, 4000])
    errors = []
    for n in counts.tolist():
        run = coupled(
            locomotive,
            speed=10.0,
            creepage=0.006,
            torque=lambda time: 15e3 + 25e3 * time,
            step=duration / n,
            count=n + 1,
            parallel=parallel,
        )
        errors.append(abs(run[-1, 0] - end))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("memory", [False, True])
def test_twice_the_hint_is_the_stable_step(rig: cl.Model, parallel: bool, memory: bool) -> None:
    speed, creepage = 2.0, 0.002
    point = rig.wheelset.balanced(creepage=creepage, speed=speed)
    description = Description(
        with_memory(rig, memory), "force_element", parallel_exchange=parallel, whole_wheelset=True
    )
    at = {"omega": point.omega, "speed": speed}
    model = native(description, **at)
    sticking = steady_memory(replace(description.element, memory=True), **at)["unslipped"]
    length = sticking * description.element.memory_scales.relaxation_length
    limit = 2.0 * model.get("step_size_hint")[0]
    pole = model.get("force_gradient")[0] * rig.wheelset.radius**2 / rig.wheelset.inertia

    def grows(step: float) -> bool:
        run = coupled(
            rig,
            speed=speed,
            torque=point.drive_torque,
            step=step,
            count=2000,
            creepage=creepage * (1.0 + 1e-6),
            implicit=False,
            parallel=parallel,
            memory=memory,
        )
        away = np.abs(run[:, 0] - creepage * speed)
        return bool(away[-40:].max() > 10.0 * away[0])

    assert not grows(0.97 * limit)
    if memory and not parallel:
        # While it sticks, a contact lags by sigma m, with m the part that sticks.
        steps = np.linspace(limit, 3.0 * limit, 20001)
        exact = steps[np.argmax(steps * pole * np.tanh(speed * steps / (2.0 * length)) > 2.0)]
        assert not grows(0.97 * exact)
        limit = float(exact)
    assert grows(1.05 * limit)


@pytest.mark.parametrize("shift", [0.0, 1e-3, 4e-3])
@pytest.mark.parametrize("load", [0.5, 1.0])
def test_steps_fit_the_steepest_place_of_a_curve_that_rises_in_an_s(
    rig: cl.Model, shift: float, load: float
) -> None:
    model, speed = with_shift(rig, shift), 5.0
    description = Description(model, "force_element", whole_wheelset=True)
    element, m = description.element, description.start_values["effective_inverse_mass"]
    zeta = np.linspace(-0.02, 0.02, 4001)
    given = {"speed": speed, "normal_load": load * element.axle_load}
    gradient = element.at_creepage(zeta, speed=speed, axle_load=given["normal_load"])[
        "force_gradient"
    ]
    largest, place = gradient.max(), abs(zeta[gradient.argmax()])
    assert (place > 0.5 * shift) if shift else (place < 1e-4)
    if load == 1.0:
        assert element.steepest_gradient(speed) == pytest.approx(largest, rel=2e-3)
    for at in (0.0, -0.9 * place, 0.5 * place):  # where the wheel sticks
        omega = (1.0 + at) * speed / element.radius
        at_place = native(description, omega=omega, **given)
        assert at_place.get("step_size_hint")[0] == pytest.approx(1.0 / (largest * m), rel=2e-3)
    beyond = native(description, omega=(1.0 + 1.5 * place + 1e-3) * speed / element.radius, **given)
    expected = 1.0 / (beyond.get("force_gradient")[0] * m)
    assert beyond.get("step_size_hint")[0] == pytest.approx(expected, rel=1e-9)


def test_implicit_steps_follow_a_wheelset_that_slips_across(locomotive: cl.Model) -> None:
    # A wheelset that is stepped as one, under the same lateral velocity and spin.
    across: dict[str, Any] = {"lateral_velocity": 0.08, "spin_velocity": 1.5}
    speed, torque, ends, steps = 10.0, 18e3, [], (4e-3, 2e-3, 1e-3)
    for step in steps:
        run = coupled(
            locomotive, speed=speed, torque=torque, step=step, count=round(0.4 / step), **across
        )
        ends.append(run[-1, 1])
    whole = native(Description(locomotive, "wheelset"), omega=speed / 0.5, speed=speed, **across)
    straight = native(Description(locomotive, "wheelset"), omega=speed / 0.5, speed=speed)
    for model in (whole, straight):
        model.set(drive_torque=torque)
        for _ in range(400):
            model.advance(1e-3, 1e-9)
    force = whole.get("creep_force")[0]
    errors = np.abs(np.array(ends) - force)
    assert errors[-1] < 2e-3 * force
    assert np.all(errors[1:] < 0.7 * errors[:-1])  # first order
    slips = [m.get("omega")[0] * 0.5 - m.get("speed")[0] for m in (whole, straight)]
    assert slips[0] > 1.3 * slips[1]  # the same force takes more slip
