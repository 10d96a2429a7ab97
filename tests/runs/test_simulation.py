"""Runs: the fold, creep control, pulses, events, and an independent solution."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from native_models import with_memory
from plain_scenario import controls
from scipy.integrate import solve_ivp, trapezoid

import contactlib as cl
from contactlib.runs import Event


def check_energy(run: cl.Result, *, within: float = 1e-8) -> None:
    work = np.abs(np.diff(run["drive_work"])).sum()
    assert np.abs(run["energy_defect"]).max() < within * work
    power = run["creep_force"] * run["slip_velocity"]
    assert run["creep_work"][-1] == pytest.approx(float(trapezoid(power, run.time)), rel=1e-3)


def ramp_past_the_fold(body: cl.Wheelset, rate: float) -> Event:
    critical = cl.find_fold(body, speed=10.0).drive_torque
    run = cl.simulate(
        body,
        cl.TorqueControl(
            cl.Profile((0.0, 0.03 * critical / rate), (0.98 * critical, 1.01 * critical))
        ),
        duration=0.03 * critical / rate,
        initial_speed=10.0,
        stop_at=["peak_passed"],
    )
    event = run.first("peak_passed")
    assert event is not None
    assert run.time[-1] == event.time
    return event


def test_slow_ramp_finds_the_critical_torque(rig: cl.Model) -> None:
    body = rig.wheelset
    peak = cl.CarterGriffith(k_hat=0.3).peak
    creepage = 0.015 * peak.normalized_creepage
    omega = (1.0 + creepage) * 10.0 / 0.5
    predicted = 0.5 * 0.21 * 220.65e3 * peak.traction_ratio + 50.0 * omega  # r Q_peak + b omega
    rates = np.array([160.0, 40.0, 10.0])
    late = [ramp_past_the_fold(body, r).drive_torque / predicted - 1.0 for r in rates]
    assert late[1] < 1e-3
    # Passing a fold is late by the ramp's rate to the power 2/3.
    order = np.polyfit(np.log(rates), np.log(late), 1)[0]
    assert order == pytest.approx(2.0 / 3.0, abs=0.05)


def test_demonstration_ramps_meet_the_fold(rig: cl.Model, locomotive: cl.Model) -> None:
    for model, (control, _) in ((rig, controls("rig")), (locomotive, controls("locomotive"))):
        run = cl.simulate(model.wheelset, control, initial_speed=model.initial_speed)
        passed, away = run.first("peak_passed"), run.first("slip_away")
        assert passed is not None
        assert away is not None
        fold = cl.find_fold(model.wheelset, speed=passed.speed)
        assert passed.drive_torque == pytest.approx(fold.drive_torque, rel=1e-3)
        assert run["creepage"].max() > 1.0
        assert run["creepage"][-1] < fold.creepage  # and comes back when the torque is low enough
        check_energy(run)


def test_creep_control_stays_on_the_falling_branch(rig: cl.Model, locomotive: cl.Model) -> None:
    for model, (_, control) in ((rig, controls("rig")), (locomotive, controls("locomotive"))):
        run = cl.simulate(model.wheelset, control, duration=40.0, initial_speed=model.initial_speed)
        late = run.time > 20.0
        target = control.reference.value[-1]
        np.testing.assert_allclose(run["creepage"][late], target, rtol=2e-4)
        assert (run["falling_branch"][late] == 1.0).all()
        point = model.wheelset.balanced(creepage=target, speed=float(run["speed"][-1]))
        assert not point.stable  # what constant torque would do there
        check_energy(run)


def test_agrees_with_an_independent_model(locomotive: cl.Model, rig: cl.Model) -> None:
    # The law in Python, the equations written again, another solver: nothing shared but numbers.
    law = cl.CarterGriffith(k_hat=0.3)
    ramp = cl.Profile((0.0, 4.0), (2.4e4, 2.8e4))

    def motion(time: float, state: np.ndarray) -> list[float]:
        omega, speed = state
        force = 0.21 * 220.65e3 * float(law.traction_ratio((0.5 * omega / speed - 1.0) / 0.015))
        torque = 2.4e4 + 1e3 * time
        davis = 1811.0 + 66.6 * speed + 3.1 * speed**2
        return [(torque - 0.5 * force - 5.0 * omega) / 250.0, (force - davis) / 142.5e3]

    body = replace(locomotive.wheelset, element=rig.wheelset.element)
    run = cl.simulate(
        body, cl.TorqueControl(ramp), duration=4.0, initial_speed=10.0, initial_creepage=0.01
    )
    assert run.first("slip_away") is not None
    other: Any = solve_ivp(
        motion, (0.0, 4.0), [20.2, 10.0], method="LSODA", rtol=1e-10, atol=1e-10, dense_output=True
    )
    omega, speed = other.sol(run.time)
    np.testing.assert_allclose(run["omega"], omega, rtol=1e-6)
    np.testing.assert_allclose(run["speed"], speed, rtol=1e-7)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("creep", [True, False])
def test_agrees_with_radau_where_all_inputs_change(
    locomotive: cl.Model, held: bool, creep: bool
) -> None:
    # The equations of motion and the PI law written again, another integrator.
    body = replace(locomotive.wheelset, mass=None) if held else locomotive.wheelset
    end, load = 4.0, locomotive.wheelset.element.axle_load
    reference = cl.Profile((0.0, end), (0.006, 0.03) if creep else (1.5e4, 3.2e4))
    inputs: dict[str, Any] = {
        "axle_load": cl.Profile((0.0, end), (load, 0.8 * load)),
        "friction_scale": cl.Profile((0.0, end), (1.0, 0.7)),
        "resistance_force": cl.Profile((0.0, end), (0.0, 5e3)),
    }
    gain, integral, largest = 1e6, 2e6, 3e4
    control = cl.CreepControl(
        reference=reference,
        proportional_gain=gain,
        integral_gain=integral,
        torque_min=0.0,
        torque_max=largest,
    )

    def motion(time: float, state: np.ndarray) -> list[float]:
        omega, speed, memory, _ = state
        known = {name: float(profile(time)) for name, profile in inputs.items()}
        resisting = known.pop("resistance_force")
        contact = body.element.evaluate(omega=omega, speed=speed, **known)
        error = float(reference(time)) - float(contact["creepage"])
        unlimited = gain * error + memory
        torque = min(max(unlimited, 0.0), largest) if creep else float(reference(time))
        rate = integral * error + integral / gain * (torque - unlimited) if creep else 0.0
        force = float(contact["creep_force"])
        gained = torque - body.radius * force - body.damping * omega
        a = body.resistance
        davis = a.constant + a.linear * speed + a.quadratic * speed**2 + resisting
        return [
            gained / body.inertia,
            0.0 if body.mass is None else (force - davis) / body.mass,
            rate,
            speed,
        ]

    run = cl.simulate(
        body,
        control if creep else cl.TorqueControl(reference),
        initial_speed=10.0,
        initial_creepage=0.006,
        duration=end,
        **inputs,
    )
    start = [run["omega"][0], 10.0, float(run["drive_torque"][0]) if creep else 0.0, 0.0]
    solution: Any = solve_ivp(
        motion, (0.0, end), start, method="Radau", rtol=1e-10, atol=1e-10, dense_output=True
    )
    omega, speed, _, distance = solution.sol(run.time)
    for name, values in (("omega", omega), ("speed", speed), ("distance", distance)):
        np.testing.assert_allclose(run[name], values, rtol=2e-7, atol=1e-8)


def test_no_pulse_is_stepped_over(rig: cl.Model) -> None:
    # 2 ms in the middle of a run whose steps would be seconds: the impulse must all arrive.
    body = rig.wheelset
    low, start = 1e3, 50.0
    pulse = cl.Profile((start, start, start + 2e-3, start + 2e-3), (low, 5e4, 5e4, low))
    run = cl.simulate(body, cl.TorqueControl(pulse), duration=100.0, initial_speed=10.0)
    before, after = (int(np.searchsorted(run.time, start + t)) for t in (-1e-9, 2e-3))
    gained = 250.0 * (run["omega"][after] - run["omega"][before])
    part = (run.time >= start) & (run.time <= start + 2e-3)
    net = 5e4 - 0.5 * run["creep_force"][part] - 50.0 * run["omega"][part]
    assert gained == pytest.approx(float(trapezoid(net, run.time[part])), rel=2e-3)
    assert run["omega"][-1] == pytest.approx(run["omega"][0], rel=1e-9)


def test_anti_windup_lets_go_of_the_limit(rig: cl.Model) -> None:
    # However long the reference exceeded what the limit gives, the memory holds no more.
    def recovery(held: float) -> float:
        end = 1.0 + held
        control = cl.CreepControl(
            reference=cl.Profile((1.0, 1.0, end, end), (0.006, 0.03, 0.03, 0.008)),
            proportional_gain=1e6,
            integral_gain=4e6,
            torque_min=0.0,
            torque_max=2.4e4,
        )
        run = cl.simulate(rig.wheelset, control, duration=end + 4.0, initial_speed=10.0)
        at_limit = run["drive_torque"] >= 2.4e4
        assert run["drive_torque"].max() <= 2.4e4
        assert np.ptp(run.time[at_limit]) > 0.9 * held
        away = np.abs(run["creepage"] - 0.008) > 1e-5
        return float(run.time[away][-1]) - end

    assert recovery(1.0) < 3.5
    assert recovery(10.0) == pytest.approx(recovery(1.0), abs=0.05)


def test_jumps_of_friction_are_met(rig: cl.Model) -> None:
    wet = cl.Profile((5.0, 5.0, 6.0, 6.0), (1.0, 0.5, 0.5, 1.0))
    run = cl.simulate(
        rig.wheelset,
        cl.TorqueControl(cl.Profile.of(2e4)),
        duration=20.0,
        initial_speed=10.0,
        friction_scale=wet,
    )
    away = run.first("slip_away")
    assert away is not None
    assert 5.0 < away.time < 6.0
    assert run["friction_scale"].min() == 0.5
    inside = (run.time > 5.0) & (run.time < 6.0)
    assert (run["friction_scale"][inside] == 0.5).all()
    assert (np.diff(run.time) > 0.0).all()


def test_braking_to_standstill(locomotive: cl.Model) -> None:
    run = cl.simulate(
        locomotive.wheelset,
        cl.TorqueControl(cl.Profile.of(-8e3)),
        duration=200.0,
        initial_speed=5.0,
        stop_at=["standstill"],
    )
    event = run.first("standstill")
    assert event is not None
    assert run["speed"][-1] == pytest.approx(0.1)
    assert (run["creepage"] < 0.0).all()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"duration": -1.0}, "duration = -1.0"),
        ({"initial_speed": np.nan}, "initial_speed = nan"),
        ({"axle_load": -5.0}, "axle_load = -5.0"),
        ({"friction_scale": np.nan}, "friction_scale = nan"),
        ({"tolerance": 1.0}, "tolerance = 1.0"),
        ({"stop_at": ["crash"]}, "crash"),
        ({"controller": cl.TorqueControl(cl.Profile.of(4e4))}, r"drive_torque = 40000\.0 .*rising"),
    ],
)
def test_bad_settings_are_refused(rig: cl.Model, given: dict[str, Any], message: str) -> None:
    settings = {"controller": controls("rig")[0], "duration": 1.0, "initial_speed": 10.0, **given}
    with pytest.raises(ValueError, match=message):
        cl.simulate(rig.wheelset, **settings)


def test_memory_is_that_of_another_integrator(locomotive: cl.Model) -> None:
    body = with_memory(locomotive).wheelset
    native, radius, start = body.element.rolling_native, body.radius, 0.004
    load = cl.Profile((0.0, 0.04, 0.1), (1.0e5, 1.4e5, 0.8e5))
    torque = cl.Profile((0.0, 0.06, 0.1), (5e3, 1.5e4, 4e3))
    given: dict[str, Any] = {"initial_speed": 2.0, "initial_creepage": start}
    run = cl.simulate(body, cl.TorqueControl(torque), axle_load=load, tolerance=1e-10, **given)
    check_energy(run, within=1e-6)

    def rates(t: float, x: np.ndarray) -> list[float]:
        contact = native.evaluate_one(x[0], x[1], float(load(t)), 1.0, *x[2:])
        moved = body.native.motion(x[0], x[1], float(torque(t)), 0.0, contact)
        held = contact.held_rate, contact.unslipped_rate, contact.outer_rate
        return [moved.omega_rate, moved.speed_rate, *held]

    omega = (1.0 + start) * 2.0 / radius
    steady = native.evaluate_one(omega, 2.0, 1.0e5, 1.0)
    first = [omega, 2.0, steady.steady_force, steady.sticking, steady.steady_outer]
    end = float(run.time[-1])
    other = solve_ivp(rates, (0.0, end), first, "BDF", rtol=1e-9, atol=1e-9, max_step=1e-3)
    assert run["creep_force"][-1] == pytest.approx(other.y[2, -1], rel=1e-5)
    assert run["creepage"][-1] == pytest.approx(
        radius * other.y[0, -1] / other.y[1, -1] - 1.0, rel=1e-4
    )
    assert run["traction_coefficient"][-1] == pytest.approx(other.y[2, -1] / 0.8e5, rel=1e-5)


def test_a_line_that_is_short_under_the_load_is_reported(rig: cl.Model) -> None:
    body = with_memory(rig).wheelset
    contact: Any = body.element.contact
    load = body.element.axle_load * (contact.length / (4.0 * contact.semi_width)) ** 2
    control = cl.TorqueControl(cl.Profile((0.0, 0.01), (0.0, 0.0)))
    native, rolling = body.element.rolling_native, (10.0 / body.radius, 10.0)
    for factor, short in ((1.0, 0.0), (1.02, 1.0)):
        assert native.evaluate_one(*rolling, factor * load, 1.0).length_limited == short
    cl.simulate(body, control, initial_speed=10.0, axle_load=load)
    with pytest.warns(cl.InputWarning, match=r"3\.96 semi-widths long"):
        cl.simulate(body, control, initial_speed=10.0, axle_load=1.02 * load)
    cl.simulate(rig.wheelset, control, initial_speed=10.0, axle_load=1.02 * load)


@pytest.mark.parametrize("times", [(0.3, 0.3), (0.3, 0.5)])
def test_lift_off_takes_few_steps(locomotive: cl.Model, times: tuple[float, float]) -> None:
    """A sliding contact is close to corners of its rates while its load changes."""
    body = with_memory(locomotive).wheelset
    load = body.element.axle_load
    torque = 0.1 * load * body.radius
    places = (0.0, *dict.fromkeys(times), 0.8, 1.0)
    down = cl.Profile(places, tuple(load if t in (0.0, 0.8, 1.0) else 0.0 for t in places))
    control = cl.TorqueControl(cl.Profile((0.0, 1.0), (torque, torque)))
    coarse, fine = (
        cl.simulate(
            body, control, initial_speed=10.0, axle_load=down, tolerance=tolerance,
            output_interval=1.0,
        )
        for tolerance in (1e-6, 1e-9)
    )  # fmt: skip
    assert max(coarse.time.size, fine.time.size) < 4000
    assert coarse["omega"][-1] == pytest.approx(fine["omega"][-1], rel=1e-7)


def test_profile_ends_jumps_and_refusals() -> None:
    profile = cl.Profile((0.0, 1.0, 1.0, 3.0), (0.0, 1.0, 5.0, 6.0))
    np.testing.assert_allclose(profile([-1.0, 0.5, 1.0, 2.0, 9.0]), [0.0, 0.5, 5.0, 5.5, 6.0])
    jumps = cl.Profile((0.0, 0.0, 2.0, 2.0), (1.0, 2.0, 3.0, 4.0))  # at both ends
    np.testing.assert_allclose(
        jumps([-1e-9, 0.0, 1.0, 2.0 - 1e-12, 2.0]), [1.0, 2.0, 2.5, 3.0, 4.0]
    )
    assert profile.on(0.5, 1.0) == (0.5, 1.0)
    assert profile.on(1.0, 2.0) == (5.0, 5.5)
    for time, value, message in (
        ((1.0, 0.0), (0.0, 0.0), "at "),
        ((), (), "at "),
        ((0.0,), (1.0, 2.0), "at "),
        ((1.0, 1.0, 1.0), (0.0, 1.0, 2.0), "at most twice"),
    ):
        with pytest.raises(ValueError, match=message):
            cl.Profile(time, value)


def test_from_standstill_to_forty_and_back_through_zero(locomotive: cl.Model) -> None:
    torque = cl.Profile((0.0, 1.0, 28.0, 29.0, 56.0), (0.0, 2.2e4, 2.2e4, -2.2e4, -2.2e4))
    run = cl.simulate(
        replace(locomotive.wheelset, mass=22.5e3),
        cl.TorqueControl(torque),
        initial_speed=0.0,
    )
    assert run["speed"].max() > 40.0
    assert run["speed"][-1] < -0.5
    assert run["creepage"].min() < 0.0 < run["creepage"].max()
    for values in run.signals.values():
        assert np.isfinite(values).all()
    check_energy(run, within=1e-6)
