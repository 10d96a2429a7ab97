"""Equations of motion, equilibria, and where they lose stability."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import contactlib as cl
from contactlib.simulation import steady_creepage


def variant(wheelset: cl.Wheelset, **changes: object) -> cl.Wheelset:
    return dataclasses.replace(wheelset, **changes)  # type: ignore[arg-type]


def test_rates_are_the_equations_of_motion(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    omega, speed, torque, outer = 21.0, 10.0, 2.5e4, 300.0
    rates, contact = body.rates(omega, speed, torque, 2e5, 0.8, outer)
    force = float(body.element.force(omega=omega, speed=speed, normal_load=2e5, friction_scale=0.8))
    assert contact.creep_force == force
    davis = 1811.0 + 66.6 * speed + 3.1 * speed**2
    assert rates.omega_rate == pytest.approx((torque - 0.5 * force - 5.0 * omega) / 250.0)
    assert rates.speed_rate == pytest.approx((force - davis - outer) / 142.5e3)
    assert rates.resistance == pytest.approx(davis)


def test_grade_pulls_back_and_a_held_speed_feels_neither(
    locomotive: cl.Model, rig: cl.Model
) -> None:
    hill = variant(locomotive.wheelset, resistance=cl.Resistance(grade=0.02))
    rates, contact = hill.rates(20.0, 10.0, 0.0, 2e5, 1.0, 0.0)
    assert contact.creep_force == 0.0
    assert rates.speed_rate == pytest.approx(-0.02 * 9.80665)
    steep_rig = variant(rig.wheelset, resistance=cl.Resistance(constant=1e3, grade=0.02))
    assert steep_rig.rates(21.0, 10.0, 0.0, 2e5, 1.0, 1e4)[0].speed_rate == 0.0


@pytest.mark.parametrize("state", [(20.1, 10.0), (21.0, 10.0), (0.1, 0.03), (-30.0, -14.0)])
def test_jacobian(locomotive: cl.Model, state: tuple[float, float]) -> None:
    body = variant(
        locomotive.wheelset,
        resistance=cl.Resistance(constant=1e3, linear=50.0, quadratic=4.0, grade=0.01),
    )

    def rates(omega: float, speed: float) -> np.ndarray:
        r, _ = body.rates(omega, speed, 1e4, 2e5, 1.0, 0.0)
        return np.array([r.omega_rate, r.speed_rate])

    jacobian = np.array([list(row) for row in body.rates(*state, 1e4, 2e5, 1.0, 0.0)[0].jacobian])
    for column in range(2):
        h = 1e-6 * max(abs(state[column]), 0.02)
        at = [np.array(state), np.array(state)]
        at[0][column] -= h
        at[1][column] += h
        difference = (rates(*at[1]) - rates(*at[0])) / (2.0 * h)
        np.testing.assert_allclose(jacobian[:, column], difference, rtol=2e-5, atol=1e-6)


def test_equilibria_on_both_branches(rig: cl.Model) -> None:
    body = rig.wheelset
    fold = cl.find_fold(body, speed=10.0)
    torque = 25.5e3
    points = body.equilibria(drive_torque=torque, speed=10.0)
    # Rising branch, falling branch, and the run-away end where damping takes the rest.
    assert [p.stable for p in points] == [True, False, True]
    assert points[0].creepage < fold.creepage < points[1].creepage < fold.return_creepage
    for p in points:
        assert p.drive_torque == pytest.approx(torque, rel=1e-9)
        rates, _ = body.rates(p.omega, p.speed, torque, p.normal_load, 1.0, 0.0)
        assert abs(rates.omega_rate) < 1e-6
    assert len(body.equilibria(drive_torque=1.001 * fold.drive_torque, speed=10.0)) == 1
    assert len(body.equilibria(drive_torque=0.999 * fold.return_torque, speed=10.0)) == 1
    mirrored = body.equilibria(drive_torque=-torque, speed=10.0)
    assert [p.stable for p in mirrored][-1:] == [True]


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


@pytest.mark.parametrize("below", [1e-4, 1e-6, 1e-9])
def test_a_free_wheelset_has_both_equilibria_next_to_the_fold(
    locomotive: cl.Model, below: float
) -> None:
    body = locomotive.wheelset
    davis = body.resistance

    def torque(creepage: float) -> float:
        """At the speed where Davis' resistance meets the force, which here knows no speed."""
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


@pytest.mark.parametrize(
    ("kind", "residual"),
    [
        *itertools.product(["held", "held, damped", "free", "free, damped"], [1.0, 0.4]),
        ("free, no F'", 1.0),
        ("free, damped, no F'", 0.4),
    ],
)
def test_eigenvalue_changes_sign_at_the_threshold(
    rig: cl.Model, kind: str, residual: float
) -> None:
    body = variant(
        weaker(rig.wheelset, residual, 0.6),
        damping=400.0 if "damped" in kind else 0.0,
        mass=None if "held" in kind else 22.5e3,
        resistance=cl.Resistance(linear=0.0 if "no F'" in kind else 900.0),
    )
    speed = 8.0
    peak = cl.find_fold(variant(body, damping=0.0, mass=None), speed=speed).creepage

    def growth(creepage: float) -> float:
        """Sign of the determinant: one real eigenvalue crosses zero."""
        point = body.balanced(creepage=creepage, speed=speed)
        sign = 1.0 if body.speed_held else -1.0
        return sign * float(np.linalg.det(point.jacobian))

    def margin(creepage: float) -> float:
        point = body.balanced(creepage=creepage, speed=speed)
        return point.creep_force_slope - cl.slope_threshold(body, point)

    predicted = brentq(margin, 0.9 * peak, 1.25 * peak, xtol=1e-15)
    below, above = (
        body.balanced(creepage=predicted * (1.0 + side * 1e-6), speed=speed) for side in (-1, 1)
    )
    assert not above.stable
    assert above.eigenvalues[0].imag == 0.0  # a saddle, no oscillation
    if kind == "free, no F'":  # nothing resists a common acceleration: one eigenvalue stays zero
        assert below.eigenvalues == pytest.approx([0.0, below.jacobian.trace()], abs=1e-9)
        assert below.jacobian.trace() < 0.0 < above.jacobian.trace()
    else:
        assert below.stable
        assert brentq(growth, 0.9 * peak, 1.25 * peak, xtol=1e-15) == pytest.approx(
            predicted, rel=1e-6
        )


def test_threshold_without_damping_is_the_peak(rig: cl.Model) -> None:
    body = variant(rig.wheelset, damping=0.0)
    point = body.balanced(creepage=0.02, speed=10.0)
    assert cl.slope_threshold(body, point) == 0.0
    assert not point.stable
    # Fast pole r^2 |Q'|/(J V)
    pole = 0.25 * -point.creep_force_slope / (250.0 * 10.0)
    assert point.eigenvalues[0] == pytest.approx(pole, rel=1e-12)


def test_linear_model_follows_the_nonlinear_one(locomotive: cl.Model) -> None:
    import control

    body = locomotive.wheelset
    point = body.balanced(creepage=0.006, speed=12.0)
    system = body.linearize(point)
    assert system.state_labels == ["omega", "speed"]
    time = np.linspace(0.0, 0.2, 101)
    kick = 10.0
    linear = control.forced_response(system, time, np.vstack([np.full(101, kick), np.zeros(101)]))
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(point.drive_torque + kick)),
        duration=0.2,
        initial_speed=12.0,
        initial_creepage=0.006,
        resistance_force=point.resistance_force,
    )
    for row, name in enumerate(system.output_labels):
        change = np.interp(time, run.time, run[name]) - getattr(point, name)
        scale = np.abs(linear.outputs[row]).max()
        np.testing.assert_allclose(change, linear.outputs[row], atol=1e-2 * scale)


def test_fold_and_hysteresis(rig: cl.Model) -> None:
    free_running = variant(rig.wheelset, damping=0.0)
    fold = cl.find_fold(free_running, speed=10.0)
    peak = cl.CarterGriffith(k_hat=0.3).peak
    assert fold.creepage == pytest.approx(0.015 * peak.normalized_creepage, rel=1e-9)
    assert fold.drive_torque == pytest.approx(0.5 * 0.21 * 220.65e3 * peak.traction_ratio, rel=1e-9)
    assert fold.hysteresis == pytest.approx(1.0 - 1.0 / peak.traction_ratio, rel=1e-6)
    assert fold.hysteresis == pytest.approx(0.119, abs=5e-4)
    assert np.isinf(fold.return_creepage)


@pytest.mark.parametrize("mass", [None, 22.5e3])
def test_fold_is_the_largest_quasi_steady_torque(rig: cl.Model, mass: float | None) -> None:
    body = variant(rig.wheelset, mass=mass)
    fold = cl.find_fold(body, speed=10.0)
    zeta = np.linspace(0.012, 0.03, 200_001)
    torque = cl.quasi_steady_torque(body, zeta, speed=10.0)
    assert fold.drive_torque == pytest.approx(torque.max(), rel=1e-10)
    assert fold.creepage == pytest.approx(zeta[torque.argmax()], abs=2e-6)
    far = np.linspace(0.03, 0.2, 200_001)
    least = cl.quasi_steady_torque(body, far, speed=10.0)
    assert fold.return_torque == pytest.approx(least.min(), rel=1e-10)


def weaker(wheelset: cl.Wheelset, residual: float, decay: float) -> cl.Wheelset:
    """The wheelset with friction that falls with slip speed as well."""
    element = wheelset.element
    friction = dataclasses.replace(
        element.friction, slip_rate_residual=residual, slip_rate_decay=decay
    )
    return variant(wheelset, element=dataclasses.replace(element, friction=friction))


@pytest.mark.parametrize("mass", [None, 22.5e3])
@pytest.mark.parametrize(
    ("residual", "decay", "tolerance"),
    # In the last case the peak is the kink where the force begins to be held at static friction,
    # and where that ends the torque has another hump.
    [(0.4, 0.6, 1e-8), (0.2, 30.0, 1e-8), (0.5, 1e-2, 1e-8), (0.03, 1e3, 1e-6)],
)
def test_fold_of_friction_that_falls_with_slip_speed(
    rig: cl.Model, mass: float | None, residual: float, decay: float, tolerance: float
) -> None:
    body = weaker(variant(rig.wheelset, mass=mass), residual, decay)
    fold = cl.find_fold(body, speed=10.0)
    zeta = np.geomspace(1e-6, 1e3, 900_001)
    torque = cl.quasi_steady_torque(body, zeta, speed=10.0)
    peak = int(np.flatnonzero(np.diff(torque) < 0.0)[0])  # the first maximum
    assert fold.drive_torque == pytest.approx(torque[peak], rel=tolerance)
    assert fold.creepage == pytest.approx(zeta[peak], rel=5e-5)
    assert fold.return_torque == pytest.approx(torque[peak:].min(), rel=tolerance)
    # Without damping the torque falls to what slip speed leaves of kinetic friction.
    free_running = variant(body, damping=0.0, mass=None)
    left = 0.5 * residual * 0.21 * 220.65e3
    tail = cl.find_fold(free_running, speed=10.0)
    assert np.isinf(tail.return_creepage)
    assert tail.return_torque == pytest.approx(left, rel=1e-6)


def test_coulomb_friction_that_falls_with_slip_speed_has_a_fold(
    rig: cl.Model, table: cl.CreepForceTable
) -> None:
    coulomb = cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0)
    element = dataclasses.replace(rig.wheelset.element, friction=coulomb)
    body = weaker(variant(rig.wheelset, element=element), 0.4, 0.6)
    fold = cl.find_fold(body, speed=10.0)
    saturated = body.element.at_creepage(fold.creepage, speed=10.0)["normalized_creepage"]
    assert 0.8 < saturated < 1.0  # the fall begins before Carter's stick zone has vanished


@pytest.mark.parametrize("torque", [2e3, 1.5e4, 2.5e4])
def test_start_on_the_rising_branch(rig: cl.Model, torque: float) -> None:
    body = weaker(rig.wheelset, 1e-3, 50.0)
    control = cl.TorqueControl(cl.Profile.of(torque))
    fold = cl.find_fold(body, speed=10.0)
    if torque > fold.drive_torque:
        with pytest.raises(ValueError, match="rising branch ends"):
            cl.simulate(body, control, duration=0.1, initial_speed=10.0)
    else:
        run = cl.simulate(body, control, duration=0.1, initial_speed=10.0)
        assert 0.0 < run["creepage"][0] < fold.creepage
        assert run["creepage"][-1] == pytest.approx(run["creepage"][0], rel=1e-6)


def of_wet_rail(wheelset: cl.Wheelset) -> cl.Wheelset:
    """The wheelset with a law whose force peaks far beyond the saturation creepage."""
    law = cl.Polach.wet(kalker_coefficient=3.7, poisson_ratio=0.28)
    element = dataclasses.replace(wheelset.element, table=cl.CreepForceTable.from_law(law))
    return weaker(variant(wheelset, element=element), 0.4, 0.06)


@pytest.mark.parametrize("friction", [1.0, (0.6, 1.0)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_start_on_a_rising_branch_that_is_long(
    rig: cl.Model, friction: float | tuple[float, float], sign: float
) -> None:
    body = of_wet_rail(variant(rig.wheelset, damping=0.0))
    load = body.element.contact.normal_load
    zeta = np.geomspace(1e-4, 10.0, 200_001)
    torque = np.mean(
        [
            cl.quasi_steady_torque(body, zeta, speed=2.0, friction_scale=scale)
            for scale in np.atleast_1d(friction)
        ],
        axis=0,
    )
    i = int(np.argmax(torque))
    assert zeta[i] > 5.0 * body.element.saturation_creepage
    given: dict[str, Any] = {"speed": 2.0, "normal_load": load, "friction_scale": friction}
    for part in (0.5, 0.9, 0.999):
        found = steady_creepage(body, sign * part * torque[i], **given)
        expected = np.interp(part * torque[i], torque[: i + 1], zeta[: i + 1])
        assert found == pytest.approx(sign * expected, rel=1e-6)
    with pytest.raises(ValueError, match=f"rising branch ends at {sign * torque[i]:.6g}"):
        steady_creepage(body, sign * 1.001 * torque[i], **given)


def test_no_fold_without_weakening(rig: cl.Model, table: cl.CreepForceTable) -> None:
    element = rig.wheelset.element
    coulomb = cl.ForceElement(
        element.contact,
        cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0),
        table=table,
        radius=0.5,
        slope_reduction=0.14,
    )
    with pytest.raises(ValueError, match="no fold"):
        cl.find_fold(variant(rig.wheelset, element=coulomb), speed=10.0)


def test_a_residual_of_one_is_no_fall_with_slip_speed(rig: cl.Model) -> None:
    body = weaker(variant(rig.wheelset, mass=22.5e3), 1.0, 0.6)  # with damping, no resistance
    for speed in np.linspace(2.0, 40.0, 40):
        point = body.balanced(creepage=0.03, speed=float(speed))
        assert point.creep_force_speed_slope == 0.0
        assert cl.creep_control_gain(body, point) == np.inf


@pytest.mark.parametrize("residual", [1.0, 0.4])
@pytest.mark.parametrize("mass", [None, 22.5e3])
@pytest.mark.parametrize("creepage", [0.019, 0.0216, 0.03])
def test_creep_control_gain(
    rig: cl.Model, mass: float | None, creepage: float, residual: float
) -> None:
    # The closed loop's Jacobian, from the open one and the gain, against the closed form.
    body = variant(
        weaker(rig.wheelset, residual, 0.6), mass=mass, resistance=cl.Resistance(linear=700.0)
    )
    point = body.balanced(creepage=creepage, speed=10.0)
    gain = cl.creep_control_gain(body, point)
    _, contact = body.rates(point.omega, 10.0, 0.0, point.normal_load, 1.0, 0.0)
    by_state = [contact.creepage_by_omega, contact.creepage_by_speed][: len(point.jacobian)]
    for factor, stable in ((0.999, False), (1.001, True)):
        closed = point.jacobian.copy()
        closed[0] -= factor * gain * np.array(by_state) / body.inertia
        assert (np.linalg.eigvals(closed).real.max() < 0.0) == stable
