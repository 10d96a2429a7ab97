"""Nonlinear wheelsets in python-control, and the traps of that library."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest
from native_models import with_memory
from plain_scenario import controls

import contactlib as cl
from contactlib.stability import control_systems

SPEED = 10.0


def held_speed(wheelset: cl.Wheelset) -> float | None:
    return SPEED if wheelset.speed_held else None


@pytest.mark.parametrize("name", ["rig", "locomotive"])
@pytest.mark.parametrize("creepage", [0.006, 0.024])
@pytest.mark.parametrize("memory", [False, True])
def test_its_linearisation_is_the_kernels(
    name: str, creepage: float, memory: bool, request: pytest.FixtureRequest
) -> None:
    body = with_memory(request.getfixturevalue(name), memory).wheelset
    point = body.balanced(creepage=creepage, speed=SPEED)
    system, exact = body.to_nlsys(speed=held_speed(body)), body.linearize(point)
    states = [point.omega] if body.speed_held else [point.omega, point.speed]
    if memory:
        native = body.element.rolling_native
        steady = native.evaluate_one(point.omega, SPEED, point.axle_load, 1.0)
        # On the side of a motion towards larger creepage; as the force falls, no part sticks.
        aside = 1e-5 if creepage < 0.01 else 2e-7
        states += [steady.steady_force * (1.0 + 1e-6), steady.sticking - aside, steady.steady_outer]
    inputs = [point.drive_torque, point.axle_load, 1.0, point.resistance_force]
    n = exact.nstates
    numerical = control.linearize(system, states, inputs, eps=1e-7)
    assert system.state_labels[:n] == exact.state_labels
    assert system.output_labels == exact.output_labels
    assert system.input_labels == [
        "drive_torque",
        "axle_load",
        "friction_scale",
        "resistance_force",
    ]
    scale = np.abs(exact.A).max(axis=1, keepdims=True)
    assert (np.abs(numerical.A[:n, n:]) < 1e-6 * scale).all()
    difference = np.abs(numerical.A[:n, :n] - exact.A)
    assert (difference < 1e-3 * np.abs(exact.A) + 1e-6 * scale).all()
    np.testing.assert_allclose(numerical.B[:n, [0, 3]], exact.B, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(numerical.C[:, :n], exact.C, rtol=1e-3, atol=1e-8)
    np.testing.assert_allclose(system.output(0.0, states, inputs)[2], creepage, rtol=1e-12)


@pytest.mark.parametrize("name", ["rig", "locomotive"])
def test_rounding_does_not_change_the_lag_of_steady_rolling(
    name: str, request: pytest.FixtureRequest
) -> None:
    body = with_memory(request.getfixturevalue(name)).wheelset
    zeta = np.geomspace(1e-4, 0.5, 2000)
    matrices = body.jacobians(zeta, speed=SPEED, axle_load=body.element.axle_load)
    assert np.abs(np.diff(np.log(-matrices[:, -1, -1]))).max() < 0.2  # 3 where it did


def test_system_refuses_what_python_control_makes_of_a_forgotten_input(rig: cl.Model) -> None:
    system = rig.wheelset.to_nlsys(speed=SPEED)
    with pytest.raises(ValueError, match=r"friction_scale = 0\.0 is out of range"):
        control.input_output_response(system, [0.0, 1.0], [2e4, 2e5, 0.0, 0.0], [20.0])
    with pytest.raises(ValueError, match="axle_load = -1"):
        system.dynamics(0.0, [20.0], [2e4, -1.0, 1.0, 0.0])


def test_speed_is_a_parameter_if_held_and_a_state_if_not(
    rig: cl.Model, locomotive: cl.Model
) -> None:
    with pytest.raises(ValueError, match="is needed"):
        rig.wheelset.to_nlsys()
    with pytest.raises(ValueError, match="is a state"):
        locomotive.wheelset.to_nlsys(speed=SPEED)
    faster = rig.wheelset.to_nlsys(speed=SPEED).output(
        0.0, [44.0], [0.0, 2e5, 1.0, 0.0], params={"speed": 20.0}
    )
    assert faster[1:3] == pytest.approx([20.0, 0.1])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rig", "locomotive"])
def test_nonlinear_loop_runs_as_the_simulation_does(
    name: str, request: pytest.FixtureRequest
) -> None:
    model = request.getfixturevalue(name)
    body, (_, rule) = model.wheelset, controls(name)
    wet = cl.Profile((1.0, 1.0, 2.0), (1.0, 0.8, 1.0))
    run = cl.simulate(
        body, rule, initial_speed=SPEED, duration=3.0, friction_scale=wet, output_interval=2e-3
    )
    system = control_systems.creep_control_system(body, rule, speed=held_speed(body))
    start = [run["omega"][0], SPEED][: system.nstates - 1]
    time = np.union1d(np.linspace(0.0, 3.0, 301), np.nextafter(1.0, 0.0))  # a jump at 1 s
    response = control.input_output_response(
        system,
        time,
        [rule.reference(time), 220.65e3, wet(time), 0.0],
        [*start, run["drive_torque"][0]],
        solve_ivp_method="Radau",
        solve_ivp_kwargs={"rtol": 1e-8, "atol": 1e-8, "max_step": 0.01},
    )
    for name_of, row in zip(system.output_labels, response.outputs, strict=True):
        there = np.interp(response.time, run.time, run[name_of])
        after = np.abs(response.time - 1.0) > 0.02  # straight lines between rows hide the jump
        scale = np.abs(run[name_of]).max()
        np.testing.assert_allclose(row[after], there[after], atol=1e-5 * scale)


def test_no_operating_point_past_the_fold(rig: cl.Model) -> None:
    body = rig.wheelset
    fold = cl.find_fold(body, speed=SPEED)
    below, above = 0.99 * fold.drive_torque, 1.01 * fold.drive_torque
    point = control_systems.operating_point(body, drive_torque=below, creepage=0.01, speed=SPEED)
    assert point.drive_torque == pytest.approx(below, rel=1e-9)
    assert point.stable
    beyond = control_systems.operating_point(body, drive_torque=below, creepage=0.022, speed=SPEED)
    assert not beyond.stable
    with pytest.raises(ValueError, match=rf"drive_torque = {above!r}.* fold is at 27313\.5 N\.m"):
        control_systems.operating_point(body, drive_torque=above, creepage=0.01, speed=SPEED)


def test_operating_point_of_a_free_wheelset_keeps_its_speed(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    point = control_systems.operating_point(body, drive_torque=2e4, creepage=0.005, speed=SPEED)
    rates, _ = body.rates(point.omega, SPEED, 2e4, point.axle_load, 1.0, point.resistance_force)
    assert abs(rates.omega_rate) < 1e-6
    assert abs(rates.speed_rate) < 1e-9


def test_phase_plane_of_creepage_and_speed(locomotive: cl.Model) -> None:
    # From a grid of starts, as the library's phase plots use one, the equilibrium is found.
    body, torque = locomotive.wheelset, 6e3
    (there,) = (p for p in body.equilibria(drive_torque=torque) if p.stable)
    plane = control_systems.phase_plane_system(body, drive_torque=torque)
    bare = body.to_nlsys()
    inputs = [torque, there.axle_load, 1.0, 0.0]

    def reached(system: Any, states: Any, given: Any) -> bool:
        search = control.find_operating_point(system, states, given, return_result=True)
        gap = system.dynamics(0.0, search.states, given)
        return bool(search.result.success and np.abs(gap).max() < 1e-6 and search.states[1] > 0.0)

    grid = [(a, v) for a in np.linspace(0.0, 1.0, 6) for v in np.linspace(20.0, 70.0, 6)]
    from_plane = sum(reached(plane, [0.03 * a, v], []) for a, v in grid)
    from_states = sum(reached(bare, [40.0 + 100.0 * a, v], inputs) for a, v in grid)
    assert from_plane >= 20
    assert from_states <= from_plane // 2
    omega_rate, speed_rate = bare.dynamics(0.0, [81.0, 40.0], inputs)
    rates = plane.dynamics(0.0, [0.0125, 40.0], [])
    assert rates == pytest.approx([(0.5 * omega_rate - 1.0125 * speed_rate) / 40.0, speed_rate])


def test_a_held_speed_has_no_phase_plane(rig: cl.Model) -> None:
    with pytest.raises(ValueError, match="no phase plane"):
        control_systems.phase_plane_system(rig.wheelset, drive_torque=2e4)
