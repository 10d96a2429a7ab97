"""Equations of motion, equilibria, and where they lose stability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import contactlib as cl
from contactlib.vehicle import Resistance


def test_rates_are_the_equations_of_motion(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    omega, speed, torque, outer = 21.0, 10.0, 2.5e4, 300.0
    rates, contact = body.rates(omega, speed, torque, 2e5, 0.8, outer)
    force = float(body.element.force(omega=omega, speed=speed, axle_load=2e5, friction_scale=0.8))
    assert contact.creep_force == force
    davis = 1811.0 + 66.6 * speed + 3.1 * speed**2
    assert rates.omega_rate == pytest.approx((torque - 0.5 * force - 5.0 * omega) / 250.0)
    assert rates.speed_rate == pytest.approx((force - davis - outer) / 142.5e3)
    assert rates.resistance == pytest.approx(davis)


def test_grade_pulls_back_and_a_held_speed_has_neither(locomotive: cl.Model, rig: cl.Model) -> None:
    hill = replace(locomotive.wheelset, resistance=Resistance(grade=0.02))
    rates, contact = hill.rates(20.0, 10.0, 0.0, 2e5, 1.0, 0.0)
    assert contact.creep_force == 0.0
    assert rates.speed_rate == pytest.approx(-0.02 * 9.80665)
    steep_rig = replace(rig.wheelset, resistance=Resistance(constant=1e3, grade=0.02))
    assert steep_rig.rates(21.0, 10.0, 0.0, 2e5, 1.0, 1e4)[0].speed_rate == 0.0


@pytest.mark.parametrize("state", [(20.1, 10.0), (21.0, 10.0), (0.1, 0.03), (-30.0, -14.0)])
def test_jacobian(locomotive: cl.Model, state: tuple[float, float]) -> None:
    body = replace(
        locomotive.wheelset,
        resistance=Resistance(constant=1e3, linear=50.0, quadratic=4.0, grade=0.01),
    )

    def rates(at: np.ndarray) -> np.ndarray:
        omega, speed = at.tolist()
        r, _ = body.rates(omega, speed, 1e4, 2e5, 1.0, 0.0)
        return np.array([r.omega_rate, r.speed_rate])

    jacobian = np.array([list(row) for row in body.rates(*state, 1e4, 2e5, 1.0, 0.0)[0].jacobian])
    steps = np.diag(1e-6 * np.maximum(np.abs(state), 0.02))
    difference = [(rates(state + h) - rates(state - h)) / (2.0 * h.sum()) for h in steps]
    np.testing.assert_allclose(jacobian, np.transpose(difference), rtol=2e-5, atol=1e-6)


def test_a_free_wheelset_finds_its_speed(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    (point,) = (p for p in body.equilibria(drive_torque=4e3) if p.creepage < 0.01)
    assert point.stable
    davis = 1811.0 + 66.6 * point.speed + 3.1 * point.speed**2
    assert point.creep_force == pytest.approx(davis, rel=1e-9)
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(4e3)),
        duration=2e4,
        initial_speed=0.8 * point.speed,
        output_interval=100.0,
    )
    assert run["speed"][-1] == pytest.approx(point.speed, rel=1e-6)
    assert run["creepage"][-1] == pytest.approx(point.creepage, rel=1e-6)


@pytest.mark.parametrize("outer", [0.0, -1200.0])
def test_states_near_the_smallest_force_of_a_free_wheelset_are_found(
    rig: cl.Model, outer: float
) -> None:
    """No speed balances a force below the resistance at rest: the curve begins at a creepage."""
    body = replace(rig.wheelset, mass=60e3, resistance=Resistance(constant=588.0, linear=50.0))
    at = body.conditions(speed=body.element.minimum_speed, resistance_force=outer)
    creepage = np.geomspace(1e-6, 1e-2, 400) * np.array([[1.0], [-1.0]])
    curve = body.native_curve(at, balanced=True).points(creepage)
    there = curve[np.isfinite(curve["torque"])]
    assert 100 < there.size < creepage.size
    for point in there[:: there.size // 60]:
        torque = float(point["torque"])
        states = body.equilibria(drive_torque=torque, resistance_force=outer)
        assert any(p.creepage == pytest.approx(point["creepage"], rel=1e-6) for p in states)


@pytest.mark.parametrize("below", [1e-4, 1e-6, 1e-9])
def test_a_free_wheelset_has_both_equilibria_next_to_the_fold(
    locomotive: cl.Model, below: float
) -> None:
    body = locomotive.wheelset
    davis = body.resistance

    def torque(creepage: float) -> float:
        """At the speed where Davis' resistance meets the force, here independent of speed."""
        force = float(body.element.at_creepage(creepage, speed=10.0)["creep_force"])
        left = davis.constant - force
        root = np.sqrt(davis.linear**2 - 4.0 * davis.quadratic * left)
        speed = (root - davis.linear) / (2.0 * davis.quadratic)
        return float(body.radius * force + body.damping * (1.0 + creepage) * speed / body.radius)

    peak = minimize_scalar(
        lambda creepage: -torque(creepage),
        bounds=(0.012, 0.03),
        method="bounded",
        options={"xatol": 1e-12},
    )
    points = body.equilibria(drive_torque=-(1.0 - below) * peak.fun)
    near = [p for p in points if abs(p.creepage / peak.x - 1.0) < 0.1]
    assert len(near) == 2
    assert near[0].creepage < peak.x < near[1].creepage
    for p in near:
        assert torque(p.creepage) == pytest.approx(-(1.0 - below) * peak.fun, rel=1e-11)


def test_speed_must_fit_the_kind_of_wheelset(rig: cl.Model, locomotive: cl.Model) -> None:
    with pytest.raises(ValueError, match="is needed"):
        rig.wheelset.equilibria(drive_torque=1e3)
    with pytest.raises(ValueError, match="is found, not given"):
        locomotive.wheelset.equilibria(drive_torque=1e3, speed=10.0)
