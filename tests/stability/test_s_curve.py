"""The S-curve of steady states, its fold and its return."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from falling_friction import with_falling
from wheelsets import made_wheelset

import contactlib as cl

V = 10.0  # [m/s]


@pytest.mark.parametrize("name", ["rig", "locomotive"])
def test_s_curve_changes_stability_at_fold_and_return(
    name: str, request: pytest.FixtureRequest
) -> None:
    body = request.getfixturevalue(name).wheelset
    curve = cl.s_curve(body, speed=V)
    fold = cl.find_fold(body, speed=V)
    assert curve.fold == fold
    falls = (curve.creepage > fold.creepage) & (curve.creepage < fold.return_creepage)
    rises = (curve.creepage < fold.creepage) | (curve.creepage > fold.return_creepage)
    assert not curve.stable[falls].any()
    assert curve.stable[rises].all()
    assert fold.creepage in curve.creepage
    assert fold.return_creepage in curve.creepage
    assert curve.creepage[0] == 0.0
    assert curve.drive_torque[-1] > fold.drive_torque  # the run-away branch, followed to the end
    assert (np.diff(curve.creepage) > 0.0).all()


def test_s_curve_of_braking_is_the_mirror_image_without_damping(rig: cl.Model) -> None:
    body = replace(rig.wheelset, damping=0.0)
    curve, ahead = (cl.s_curve(body, speed=V, braking=side) for side in (True, False))
    assert curve.creepage[0] == -1.0  # locked
    count = int((ahead.creepage < 1.0).sum())
    np.testing.assert_allclose(curve.creepage[1 : count + 1], -ahead.creepage[count - 1 :: -1])
    for name in ("creepage", "drive_torque"):
        behind = -getattr(curve, name)[count::-1][:count]
        np.testing.assert_allclose(behind, getattr(ahead, name)[:count], rtol=1e-12, atol=1e-9)
    clear = np.abs(ahead.pole[:count]) > 1e-9 * np.abs(ahead.pole).max()  # not at the fold itself
    assert (curve.stable[count::-1][:count] == ahead.stable[:count])[clear].all()


def test_s_curve_without_weakening_has_no_fold(rig: cl.Model) -> None:
    body = made_wheelset(0.0, 0.5, 2e5, 0.2, 0.14, inertia=250.0, damping=10.0)
    curve = cl.s_curve(body, speed=V)
    assert curve.fold is None
    assert curve.stable.all()
    with pytest.raises(ValueError, match="friction_scale"):
        cl.s_curve(body, speed=V, friction_scale=-1.0)


@pytest.mark.parametrize("part", [0.6, 0.93, 0.99, 1.0 - 1e-6, 1.0 - 1e-11, 1.1])
def test_steady_states_are_the_equilibria_of_a_held_speed(rig: cl.Model, part: float) -> None:
    torque = part * cl.find_fold(rig.wheelset, speed=V).drive_torque
    states = cl.steady_states(rig.wheelset, drive_torque=torque, speed=V)
    points = rig.wheelset.equilibria(drive_torque=torque, speed=V)
    # Near the fold what rounds the torque moves the creepage by more.
    near = max(1e-9, 1e-14 / math.sqrt(abs(1.0 - part)))
    assert [p.creepage for p in points] == pytest.approx(states.creepage.tolist(), rel=near)
    assert len(points) == (3 if part > 0.9 and part < 1.0 else 1)
    assert [p.stable for p in points] == states.stable.tolist()
    assert [p.eigenvalues[0] for p in points] == pytest.approx(states.pole.tolist(), rel=1e-5)
    np.testing.assert_allclose(states.drive_torque, torque, rtol=1e-9)


def test_steady_states_of_an_accelerating_train(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    torque = 0.95 * cl.find_fold(body, speed=V).drive_torque
    states = cl.steady_states(body, drive_torque=torque, speed=V)
    ahead = states.creepage > 0.0
    assert states.stable[ahead].tolist() == [True, False, True]
    for creepage in states.creepage[ahead][:2]:
        omega = (1.0 + creepage) * V / body.radius
        rates, _ = body.rates(omega, V, torque, 220.65e3, 1.0, 0.0)
        assert rates.speed_rate > 0.0
        # zeta = r omega/V - 1 does not change
        change = body.radius * (rates.omega_rate / V - omega * rates.speed_rate / V**2)
        assert abs(change) < 1e-9


def test_fold_and_hysteresis(rig: cl.Model) -> None:
    free_running = replace(rig.wheelset, damping=0.0)
    fold = cl.find_fold(free_running, speed=10.0)
    peak = cl.CarterGriffith(k_hat=0.3).peak
    assert fold.creepage == pytest.approx(0.015 * peak.normalized_creepage, rel=1e-9)
    assert fold.drive_torque == pytest.approx(0.5 * 0.21 * 220.65e3 * peak.traction_ratio, rel=1e-9)
    assert fold.hysteresis == pytest.approx(1.0 - 1.0 / peak.traction_ratio, rel=1e-6)
    assert fold.hysteresis == pytest.approx(0.119, abs=5e-4)
    assert np.isinf(fold.return_creepage)


@pytest.mark.parametrize("mass", [None, 22.5e3])
def test_fold_is_the_largest_quasi_steady_torque(rig: cl.Model, mass: float | None) -> None:
    body = replace(rig.wheelset, mass=mass)
    fold = cl.find_fold(body, speed=10.0)
    zeta = np.linspace(0.012, 0.03, 200_001)
    torque = cl.quasi_steady_torque(body, zeta, speed=10.0)
    assert fold.drive_torque == pytest.approx(torque.max(), rel=1e-10)
    assert fold.creepage == pytest.approx(zeta[torque.argmax()], abs=2e-6)
    far = np.linspace(0.03, 0.2, 200_001)
    least = cl.quasi_steady_torque(body, far, speed=10.0)
    assert fold.return_torque == pytest.approx(least.min(), rel=1e-10)


def test_fold_of_a_train_is_higher_by_what_turns_the_wheelset_along(locomotive: cl.Model) -> None:
    free = locomotive.wheelset
    assert free.mass is not None
    fold, held = (cl.find_fold(body, speed=10.0) for body in (free, replace(free, mass=None)))
    point = free.balanced(creepage=held.creepage, speed=10.0)
    acceleration = point.resistance_force / free.mass
    along = free.inertia / free.radius * (1.0 + held.creepage) * acceleration
    assert fold.drive_torque - held.drive_torque == pytest.approx(along, rel=1e-3)
    assert along / held.drive_torque == pytest.approx(0.0067, abs=5e-5)


@pytest.mark.slow
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
    body = with_falling(replace(rig.wheelset, mass=mass), residual, decay)
    fold = cl.find_fold(body, speed=10.0)
    zeta = np.geomspace(1e-6, 1e3, 900_001)
    torque = cl.quasi_steady_torque(body, zeta, speed=10.0)
    peak = int(np.flatnonzero(np.diff(torque) < 0.0)[0])  # the first maximum
    assert fold.drive_torque == pytest.approx(torque[peak], rel=tolerance)
    assert fold.creepage == pytest.approx(zeta[peak], rel=5e-5)
    assert fold.return_torque == pytest.approx(torque[peak:].min(), rel=tolerance)
    # Without damping the torque falls to what slip speed leaves of kinetic friction.
    free_running = replace(body, damping=0.0, mass=None)
    left = 0.5 * residual * 0.21 * 220.65e3
    tail = cl.find_fold(free_running, speed=10.0)
    assert np.isinf(tail.return_creepage)
    assert tail.return_torque == pytest.approx(left, rel=1e-6)


def test_coulomb_friction_that_falls_with_slip_speed_has_a_fold(
    rig: cl.Model, table: cl.CreepForceTable
) -> None:
    coulomb = cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0)
    element = replace(rig.wheelset.element, friction=coulomb)
    body = with_falling(replace(rig.wheelset, element=element), 0.4, 0.6)
    fold = cl.find_fold(body, speed=10.0)
    saturated = body.element.at_creepage(fold.creepage, speed=10.0)["normalized_creepage"]
    assert 0.8 < saturated < 1.0  # the fall begins before Carter's stick zone has vanished


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
        cl.find_fold(replace(rig.wheelset, element=coulomb), speed=10.0)
