"""Wheelsets in python-control: the loop's bounds against simulation, and that library's traps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import contactlib as cl
from contactlib import control_systems
from contactlib.control_systems import growth_rate

SPEED = 10.0


def held_speed(wheelset: cl.Wheelset) -> float | None:
    return SPEED if wheelset.speed_held else None


def falling(wheelset: cl.Wheelset) -> tuple[cl.OperatingPoint, float, float]:
    """A point on the falling branch, its pole [1/s], and the gain that holds it [N.m]."""
    point = wheelset.balanced(creepage=0.02, speed=SPEED)
    return point, float(point.eigenvalues[0].real), cl.creep_control_gain(wheelset, point)


def unstable(loop: Any) -> int:
    poles = control_systems.closed_loop(loop).poles()
    return int((np.abs(poles) > 1.0).sum() if loop.dt else (poles.real > 0.0).sum())


# ---- the nonlinear system -------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rig", "locomotive"])
@pytest.mark.parametrize("creepage", [0.006, 0.024])
def test_its_linearisation_is_the_kernels(
    name: str, creepage: float, request: pytest.FixtureRequest
) -> None:
    body = request.getfixturevalue(name).wheelset
    point = body.balanced(creepage=creepage, speed=SPEED)
    system = body.to_nlsys(speed=held_speed(body))
    states = [point.omega, point.speed][: system.nstates]
    inputs = [point.drive_torque, point.normal_load, 1.0, point.resistance_force]
    theirs = control.linearize(system, states, inputs)
    ours = body.linearize(point)
    assert system.state_labels == ours.state_labels
    assert system.output_labels == ours.output_labels
    assert system.input_labels == [
        "drive_torque",
        "normal_load",
        "friction_scale",
        "resistance_force",
    ]
    np.testing.assert_allclose(theirs.A, ours.A, rtol=1e-3)
    np.testing.assert_allclose(theirs.B[:, [0, 3]], ours.B, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(theirs.C, ours.C, rtol=1e-3, atol=1e-8)
    np.testing.assert_allclose(system.output(0.0, states, inputs)[2], creepage, rtol=1e-12)


def test_system_refuses_what_python_control_makes_of_a_forgotten_input(rig: cl.Model) -> None:
    system = rig.wheelset.to_nlsys(speed=SPEED)
    with pytest.raises(ValueError, match=r"friction_scale = 0\.0 is out of range"):
        control.input_output_response(system, [0.0, 1.0], [2e4, 2e5, 0.0, 0.0], [20.0])
    with pytest.raises(ValueError, match="normal_load = -1"):
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


@pytest.mark.parametrize("name", ["rig", "locomotive"])
def test_nonlinear_loop_runs_as_the_simulation_does(
    name: str, request: pytest.FixtureRequest
) -> None:
    model = request.getfixturevalue(name)
    body, rule = model.wheelset, model.creep_control
    wet = cl.Profile((4.0, 4.0, 5.0), (1.0, 0.8, 1.0))
    run = cl.simulate(body, rule, initial_speed=SPEED, duration=12.0, friction_scale=wet)
    system = control_systems.creep_control_system(body, rule, speed=held_speed(body))
    start = [run["omega"][0], SPEED][: system.nstates - 1]
    found = control_systems.response(
        system,
        {
            "creepage_reference": rule.reference,
            "normal_load": 220.65e3,
            "friction_scale": wet,
            "resistance_force": 0.0,
        },
        initial_state=[*start, run["drive_torque"][0]],
        duration=12.0,
        output_interval=0.05,
    )
    for name_of, row in zip(system.output_labels, found.outputs, strict=True):
        there = np.interp(found.time, run.time, run[name_of])
        after = np.abs(found.time - 4.0) > 0.02  # straight lines between rows hide the jump
        scale = np.abs(run[name_of]).max()
        np.testing.assert_allclose(row[after], there[after], atol=1e-5 * scale)


# ---- traps ----------------------------------------------------------------------------------


def test_a_short_pulse_is_not_stepped_over(rig: cl.Model) -> None:
    body = rig.wheelset
    (first, *_) = body.equilibria(drive_torque=24e3, speed=SPEED)
    pulse = cl.Profile((5.0, 5.0, 5.05, 5.05), (24e3, 35e3, 35e3, 24e3))
    load = first.normal_load
    system = body.to_nlsys(speed=SPEED)
    time = np.linspace(0.0, 10.0, 10001)
    inputs = [pulse(time), load, 1.0, 0.0]
    bare = control.input_output_response(
        system, time, inputs, [first.omega], solve_ivp_method="BDF"
    )
    assert bare.outputs[2].max() < 1.001 * first.creepage  # the trap: nothing happened
    ours = control_systems.response(
        system,
        {"drive_torque": pulse, "normal_load": load, "friction_scale": 1.0, "resistance_force": 0},
        initial_state=[first.omega],
        duration=10.0,
    )
    run = cl.simulate(body, cl.TorqueControl(pulse), initial_speed=SPEED, duration=10.0)
    assert run["creepage"].max() > 5.0 * first.creepage
    assert ours.outputs[2].max() == pytest.approx(run["creepage"].max(), rel=1e-6)
    assert np.diff(ours.time).min() > 0.0
    assert set(pulse.at) <= set(ours.time.tolist())


def test_response_names_what_is_missing(rig: cl.Model) -> None:
    system = rig.wheelset.to_nlsys(speed=SPEED)
    with pytest.raises(ValueError, match="must be those of the system: drive_torque, normal_load"):
        control_systems.response(system, {"drive_torque": 1.0}, initial_state=[20.0], duration=1.0)
    sampled = control.nlsys(lambda t, x, u, p: x, None, states=1, inputs=0, dt=0.1)
    with pytest.raises(ValueError, match="sampled"):
        control_systems.response(sampled, {}, initial_state=[20.0], duration=1.0)


def test_no_operating_point_past_the_fold(rig: cl.Model) -> None:
    body = rig.wheelset
    fold = cl.find_fold(body, speed=SPEED)
    below, above = 0.99 * fold.drive_torque, 1.01 * fold.drive_torque
    found = control_systems.operating_point(body, drive_torque=below, creepage=0.01, speed=SPEED)
    assert found.drive_torque == pytest.approx(below, rel=1e-9)
    assert found.stable
    beyond = control_systems.operating_point(body, drive_torque=below, creepage=0.022, speed=SPEED)
    assert not beyond.stable

    bare = control.find_operating_point(
        body.to_nlsys(speed=SPEED),
        [found.omega],
        [above, found.normal_load, 1.0, 0.0],
        root_method="lm",
    )
    assert bare.result.success  # the trap: it says so of a state that is not at rest
    assert abs(bare.result.fun[0]) * body.inertia > 100.0  # N.m
    with pytest.raises(ValueError, match=rf"drive_torque = {above!r}.* fold is at 27313\.5 N\.m"):
        control_systems.operating_point(body, drive_torque=above, creepage=0.01, speed=SPEED)


def test_operating_point_of_a_free_wheelset_keeps_its_speed(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    found = control_systems.operating_point(body, drive_torque=2e4, creepage=0.005, speed=SPEED)
    rates, _ = body.rates(found.omega, SPEED, 2e4, found.normal_load, 1.0, found.resistance_force)
    assert abs(rates.omega_rate) < 1e-6
    assert abs(rates.speed_rate) < 1e-9


def test_a_sampled_controller_needs_a_sampled_plant(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, gain = falling(body)
    plant = body.linearize(point)[["creepage"], ["drive_torque"]]
    sampled = control.tf([2.0 * gain, -1.9 * gain], [1.0, -1.0], 0.01)
    named = control.ss(sampled, inputs="creepage_error", outputs="drive_torque")
    with pytest.raises(ValueError, match="incompatible timebases"):
        control.interconnect([named, plant], inputs="creepage_error", outputs="creepage")
    with pytest.raises(ValueError, match=r"sample the plant first, control\.sample_system\(plant"):
        control_systems.open_loop(plant, sampled)
    ready = control.sample_system(plant, 0.01, "zoh")
    ready = control.ss(ready, inputs="drive_torque", outputs="creepage")
    loop = control_systems.open_loop(ready, sampled)
    ours = control_systems.sampled_loop(
        body, point, sample_time=0.01, proportional_gain=1.9 * gain, integral_gain=10.0 * gain
    )
    z = np.exp(1j * np.linspace(0.1, 3.0, 7))
    np.testing.assert_allclose(loop(z), ours(z), rtol=1e-9)


def test_phase_plane_of_creepage_and_speed(locomotive: cl.Model) -> None:
    # From a grid of starts, as the library's phase plots use one, the equilibrium is found.
    body, torque = locomotive.wheelset, 6e3
    (there,) = (p for p in body.equilibria(drive_torque=torque) if p.stable)
    plane = control_systems.phase_plane_system(body, drive_torque=torque)
    bare = body.to_nlsys()
    inputs = [torque, there.normal_load, 1.0, 0.0]

    def reached(system: Any, states: Any, given: Any) -> bool:
        found = control.find_operating_point(system, states, given, return_result=True)
        gap = system.dynamics(0.0, found.states, given)
        return bool(found.result.success and np.abs(gap).max() < 1e-6 and found.states[1] > 0.0)

    grid = [(a, v) for a in np.linspace(0.0, 1.0, 6) for v in np.linspace(20.0, 70.0, 6)]
    ours = sum(reached(plane, [0.03 * a, v], []) for a, v in grid)
    theirs = sum(reached(bare, [40.0 + 100.0 * a, v], inputs) for a, v in grid)
    assert ours >= 20
    assert theirs <= ours // 2
    omega_rate, speed_rate = bare.dynamics(0.0, [81.0, 40.0], inputs)
    rates = plane.dynamics(0.0, [0.0125, 40.0], [])
    assert rates == pytest.approx([(0.5 * omega_rate - 1.0125 * speed_rate) / 40.0, speed_rate])


def test_a_held_speed_has_no_phase_plane(rig: cl.Model) -> None:
    with pytest.raises(ValueError, match="no phase plane"):
        control_systems.phase_plane_system(rig.wheelset, drive_torque=2e4)


# ---- root locus, Nyquist --------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rig", "locomotive"])
@pytest.mark.parametrize("sample_time", [None, 1e-3])
def test_root_locus_crosses_zero_at_the_gain_of_creep_control(
    name: str, sample_time: float | None, request: pytest.FixtureRequest
) -> None:
    body = request.getfixturevalue(name).wheelset
    point, pole, bound = falling(body)
    if sample_time is None:
        loop = control_systems.creep_loop(body, point, proportional_gain=1.0)
    else:
        loop = control_systems.sampled_loop(
            body, point, sample_time=sample_time, proportional_gain=1.0
        )
    found = control_systems.root_locus(loop, bound * np.geomspace(0.3, 100.0, 14))
    assert found.critical_gains[0] == pytest.approx(bound, rel=1e-6)
    assert (found.growth[found.gains < bound] > 0.0).all()
    if sample_time is None:
        assert len(found.critical_gains) == 1
        np.testing.assert_allclose(found.poles.real.max(axis=1), found.growth, rtol=1e-4, atol=1e-7)
    else:  # z = exp(p h) - (K/K0)(exp(p h) - 1) passes -1
        assert len(found.critical_gains) == 2
        if body.speed_held:
            late = 1.0 + 2.0 / math.expm1(pole * sample_time)
            assert found.critical_gains[1] == pytest.approx(bound * late, rel=1e-6)


@pytest.mark.parametrize("name", ["rig", "locomotive"])
def test_nyquist_counts_on_both_sides_of_every_bound(
    name: str, request: pytest.FixtureRequest
) -> None:
    body = request.getfixturevalue(name).wheelset
    point, _, bound = falling(body)
    given: dict[str, Any] = {"lag": 1e-3, "delay": 2e-3, "proportional_gain": 1.0}
    loops = [
        control_systems.creep_loop(body, point, proportional_gain=1.0),
        control_systems.creep_loop(body, point, integral_gain=10.0, **given),
        control_systems.sampled_loop(body, point, sample_time=1e-3, integral_gain=10.0, **given),
    ]
    for loop, bounds in zip(loops, (1, 2, 2), strict=True):
        critical = control_systems.root_locus(
            loop, bound * np.geomspace(0.3, 40.0, 12)
        ).critical_gains
        assert len(critical) == bounds
        for gain in critical:
            sides = [control_systems.nyquist(factor * gain * loop) for factor in (0.98, 1.02)]
            assert sides[0].stable != sides[1].stable
            for side, factor in zip(sides, (0.98, 1.02), strict=True):
                assert side.unstable_poles == 1  # P
                assert side.unstable_closed_loop_poles == unstable(factor * gain * loop)  # Z
                assert side.encirclements == side.unstable_closed_loop_poles - 1  # N = Z - P


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    creepage=st.floats(0.0175, 0.03),
    p_lag=st.floats(0.02, 1.6),
    gain=st.floats(0.3, 4.0),
    integral=st.floats(0.02, 3.0),
)
def test_pi_with_lag_is_stable_as_routh_says(
    locomotive: cl.Model, creepage: float, p_lag: float, gain: float, integral: float
) -> None:
    body = replace(locomotive.wheelset, mass=None, damping=0.0)
    point = body.balanced(creepage=creepage, speed=SPEED)
    p, g = float(point.eigenvalues[0]), body.radius / (body.inertia * SPEED)
    lag, kp, ki = p_lag / p, gain * p / g, integral * gain * p**2 / g
    # g Kp > p and g Ki < (1 - p tau)(g Kp - p)/tau; with g Ki > 0 they imply p tau < 1
    excess = (1.0 - p_lag) * (g * kp - p) / lag - g * ki
    if abs(excess) < 1e-6 * p**2:
        return
    loop = control_systems.creep_loop(body, point, proportional_gain=kp, integral_gain=ki, lag=lag)
    assert (unstable(loop) == 0) == (g * kp > p and p_lag < 1.0 and excess > 0.0)


# ---- margins --------------------------------------------------------------------------------


def test_margins_of_a_proportional_loop_are_those_on_paper(rig: cl.Model) -> None:
    # L = f p/(s - p): leaves -1 for f -> 1, |L| = 1 at p sqrt(f^2 - 1), phase acos(1/f)
    body = rig.wheelset
    point, pole, gain = falling(body)
    for f in (1.3, 2.0, 5.0):
        found = control_systems.margins(
            control_systems.creep_loop(body, point, proportional_gain=f * gain)
        )
        crossover = pole * math.sqrt(f**2 - 1.0)
        assert found.gain_lower == pytest.approx(1.0 / f, rel=1e-6)
        assert found.gain_upper == math.inf
        assert found.crossover == pytest.approx(crossover, rel=1e-6)
        assert found.phase == pytest.approx(math.acos(1.0 / f), rel=1e-6)
        assert found.delay == pytest.approx(math.acos(1.0 / f) / crossover, rel=1e-6)
        # |1 + L| is f - 1 at rest and rises or falls to 1.
        assert found.sensitivity_peak == pytest.approx(max(1.0 / (f - 1.0), 1.0), rel=1e-4)
        (bare,) = (
            control.margin(control_systems.creep_loop(body, point, proportional_gain=f * gain)),
        )
        assert found.phase == pytest.approx(math.radians(bare[1]), rel=1e-6)


def test_disk_margin_bounds_gain_and_phase(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, gain = falling(body)
    loop = control_systems.creep_loop(body, point, proportional_gain=1.8 * gain, delay=3e-3)
    found = control_systems.margins(loop)
    assert 1.0 / found.disk_gain > found.gain_lower * (1.0 - 1e-3)
    assert found.disk_gain < found.gain_upper
    assert found.disk_phase < found.phase
    assert found.sensitivity_peak > 1.0
    for factor in (0.99 * found.disk_gain, 1.01 / found.disk_gain):
        assert unstable(factor * loop) == 0


def test_no_margins_without_stability(rig: cl.Model) -> None:
    point, _, gain = falling(rig.wheelset)
    with pytest.raises(ValueError, match="not stable, so it has no margins"):
        control_systems.margins(
            control_systems.creep_loop(rig.wheelset, point, proportional_gain=0.9 * gain)
        )


def test_pade_orders_converge_to_the_delay(rig: cl.Model) -> None:
    body = rig.wheelset
    point, pole, gain = falling(body)
    delay = 0.3 / pole
    # K exp(-j w tau) p/(j w - p) = -1: w = p tan(w tau), K/K0 = sqrt(1 + (w/p)^2)
    omega = brentq(lambda w: w - pole * math.tan(w * delay), 0.1 / delay, 1.57 / delay)
    exact = math.hypot(1.0, omega / pole)
    errors = []
    for order in (1, 2, 3):
        given: dict[str, Any] = {"delay": delay, "pade_order": order}
        loop = control_systems.creep_loop(body, point, proportional_gain=1.2 * gain, **given)
        errors.append(abs(1.2 * control_systems.margins(loop).gain_upper / exact - 1.0))
    assert errors[1] < 0.1 * errors[0]
    assert errors[2] < 0.03 * errors[1]
    final = control_systems.margins(
        control_systems.creep_loop(body, point, proportional_gain=1.2 * gain, delay=delay)
    )
    assert 1.2 * final.gain_upper == pytest.approx(exact, rel=1e-6)


def delayed_growth(
    wheelset: cl.Wheelset, point: cl.OperatingPoint, gain: float, delay: float, duration: float
) -> float:
    """Late over early size of a small deviation, T = T0 + Kp (zeta_m - zeta(t - delay)).

    The kernel's nonlinear equations by Heun's method, 200 steps to a delay.
    """
    step = delay / 200.0
    omega, speed = point.omega * (1.0 + 1e-6), point.speed
    seen = [0.0] * 201  # creepage deviations, oldest first
    sizes = []
    for _ in range(round(duration / step)):
        torque = [point.drive_torque - gain * z for z in seen[:2]]
        one, contact = wheelset.rates(omega, speed, torque[0], point.normal_load, 1.0, 0.0)
        ahead = omega + step * one.omega_rate
        two, _ = wheelset.rates(ahead, speed, torque[1], point.normal_load, 1.0, 0.0)
        seen = [*seen[1:-1], contact.creepage - point.creepage, 0.0]
        omega += 0.5 * step * (one.omega_rate + two.omega_rate)
        seen[-1] = wheelset.radius * omega / speed - 1.0 - point.creepage
        sizes.append(abs(seen[-1]))
    third = len(sizes) // 3
    return max(sizes[-third:]) / max(sizes[third : 2 * third])


@pytest.mark.parametrize("factor", [1.3, 2.0])
def test_delay_margin_is_the_delay_at_which_a_simulation_loses_it(
    rig: cl.Model, factor: float
) -> None:
    body = rig.wheelset
    point, pole, gain = falling(body)
    found = control_systems.margins(
        control_systems.creep_loop(body, point, proportional_gain=factor * gain)
    )
    duration = 60.0 / pole
    for part, holds in ((0.95, True), (1.05, False)):
        ratio = delayed_growth(body, point, factor * gain, part * found.delay, duration)
        assert (ratio < 1.0) == holds


def test_gain_at_which_a_delayed_simulation_loses_it(rig: cl.Model) -> None:
    body = rig.wheelset
    point, pole, gain = falling(body)
    delay = 0.3 / pole
    found = control_systems.margins(
        control_systems.creep_loop(body, point, proportional_gain=1.5 * gain, delay=delay)
    )
    for factor, holds in ((0.97, True), (1.03, False)):
        kp = 1.5 * gain * found.gain_upper * factor
        assert (delayed_growth(body, point, kp, delay, 40.0 / pole) < 1.0) == holds


def best(loop_at: Callable[[float], Any]) -> float:
    """Least M_s over the gain."""
    peaks = []
    for factor in (1.5, 1.6, 1.7, 1.8):
        loop = loop_at(factor)
        if growth_rate(control_systems.closed_loop(loop).poles()) < 0.0:
            peaks.append(control_systems.margins(loop).sensitivity_peak)
    return min(peaks)


def test_robust_design_needs_a_pole_slower_than_the_delay_by_three(rig: cl.Model) -> None:
    # M_s ~ 2 at p tau = 0.3; and no controller does better than exp(p tau).
    body = rig.wheelset
    point, pole, gain = falling(body)

    def peak(p_delay: float) -> float:
        delay = p_delay / pole
        return best(
            lambda f: control_systems.creep_loop(
                body, point, proportional_gain=f * gain, delay=delay
            )
        )

    found = {x: peak(x) for x in (0.2, 0.3, 0.4)}
    assert found[0.2] < 1.65
    assert found[0.3] == pytest.approx(2.0, abs=0.05)
    assert found[0.4] > 2.5
    assert all(value > math.exp(x) for x, value in found.items())


# ---- the sampled loop -----------------------------------------------------------------------


def test_sampled_loop_against_a_sampled_simulation(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, bound = falling(body)
    h, wait, ki = 2e-3, 2, 5.0  # ki over kp [1/s]
    loop = control_systems.sampled_loop(
        body,
        point,
        sample_time=h,
        proportional_gain=1.0,
        integral_gain=ki,
        delay=wait * h,
    )
    low, high = control_systems.root_locus(loop, bound * np.geomspace(0.5, 20.0, 12)).critical_gains

    def growth(gain: float) -> float:
        omega, total, pending = point.omega * (1.0 + 1e-7), 0.0, [point.drive_torque] * wait
        sizes = []
        for _ in range(450):
            error = point.creepage - (body.radius * omega / SPEED - 1.0)
            total += ki * h * error
            pending.append(point.drive_torque + gain * (error + total))
            torque = pending.pop(0)
            for _ in range(4):  # Heun's method within a sample
                one, _ = body.rates(omega, SPEED, torque, point.normal_load, 1.0, 0.0)
                ahead = omega + 0.25 * h * one.omega_rate
                two, _ = body.rates(ahead, SPEED, torque, point.normal_load, 1.0, 0.0)
                omega += 0.125 * h * (one.omega_rate + two.omega_rate)
            sizes.append(abs(error))
        return max(sizes[-150:]) / max(sizes[150:300])

    assert growth(0.98 * high) < 1.0 < growth(1.02 * high)
    assert growth(1.05 * low) < 1.0 < growth(0.95 * low)


def test_fast_sampling_is_the_continuous_loop(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, gain = falling(body)
    given: dict[str, Any] = {
        "proportional_gain": 2.0 * gain,
        "integral_gain": 20.0 * gain,
        "lag": 2e-3,
        "delay": 2e-3,
    }
    frequency = np.array([10.0, 60.0, 200.0])
    exact = control_systems.creep_loop(body, point, **given)(1j * frequency)
    errors = []
    for h in (1e-3, 5e-4, 2.5e-4):
        loop = control_systems.sampled_loop(body, point, sample_time=h, **given)
        # The hold delays by half a sample.
        errors.append(np.abs(loop(np.exp(1j * frequency * h)) / exact - 1.0))
    order = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(order, 1.0, atol=0.1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"delay": 1.5e-3}, r"delay = 0\.0015 must be a whole number of samples"),
        ({"proportional_gain": 0.0}, r"proportional_gain = 0\.0 is out of range"),
        ({"integral_gain": -1.0}, r"integral_gain = -1\.0 is out of range"),
        ({"lag": -1.0}, r"lag = -1\.0 is out of range"),
        ({"sample_time": 0.0}, r"sample_time = 0\.0 is out of range"),
    ],
)
def test_bad_values_are_named(rig: cl.Model, changes: dict[str, float], message: str) -> None:
    point, _, gain = falling(rig.wheelset)
    given: dict[str, Any] = {"sample_time": 1e-3, "proportional_gain": gain, **changes}
    with pytest.raises(ValueError, match=message):
        control_systems.sampled_loop(rig.wheelset, point, **given)
