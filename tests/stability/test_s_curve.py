"""The S-curve of steady states, its fold and its return."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from falling_friction import with_falling

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
    assert curve.drive_torque[-1] > fold.drive_torque  # the slip-away branch, followed to the end
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


@pytest.mark.parametrize("part", [0.6, 0.93, 0.99, 1.0 - 1e-6, 1.0 - 1e-11, 1.1])
def test_steady_states_are_the_equilibria_of_a_held_speed(rig: cl.Model, part: float) -> None:
    torque = part * cl.find_fold(rig.wheelset, speed=V).drive_torque
    states = cl.steady_states(rig.wheelset, drive_torque=torque, speed=V)
    points = rig.wheelset.equilibria(drive_torque=torque, speed=V)
    for p in points:
        rates, _ = rig.wheelset.rates(p.omega, V, torque, p.axle_load, 1.0, 0.0)
        assert abs(rates.omega_rate) < 1e-6
    # Near the fold what rounds the torque moves the creepage by more.
    near = max(1e-9, 1e-14 / math.sqrt(abs(1.0 - part)))
    assert [p.creepage for p in points] == pytest.approx(states.creepage.tolist(), rel=near)
    assert len(points) == (3 if part > 0.9 and part < 1.0 else 1)
    assert [p.stable for p in points] == states.stable.tolist()
    assert [p.eigenvalues[0] for p in points] == pytest.approx(states.pole.tolist(), rel=1e-5)
    np.testing.assert_allclose(states.drive_torque, torque, rtol=1e-9)


@pytest.mark.parametrize("speed", [1.0, 10.0, 40.0])
@pytest.mark.parametrize("part", [1e-6, 0.01, 0.5, 0.97, 1.05, -0.01, -0.5])
def test_steady_states_begin_with_the_gripping_one(
    locomotive: cl.Model, part: float, speed: float
) -> None:
    """Of a free vehicle too, which a wheel that spins against its torque would decelerate."""
    body = locomotive.wheelset
    fold = cl.find_fold(body, speed=speed)
    torque = part * fold.drive_torque
    given: dict[str, Any] = {"drive_torque": torque, "speed": speed}
    states, every = (
        cl.steady_states(body, **given),
        cl.steady_states(body, **given, both_sides=True),
    )
    side = np.sign(part)
    assert (np.diff(side * states.creepage) > 0.0).all()
    assert set(states.creepage) <= set(every.creepage)
    assert (np.diff(every.creepage) > 0.0).all()
    if part > 0.0 and speed == V:  # the wheel that spins against its torque
        assert every.creepage[0] < -100.0
    assert (side * states.creepage > -1e-3).all()
    if part < 1.0:
        basin = cl.stability.basin(body, **given)
        assert states.creepage[0] == basin.creepage
        assert states.stable[0]
    if fold.return_torque < torque < fold.drive_torque:
        assert states.stable.tolist() == [True, False, True]
        assert states.creepage[1] == pytest.approx(basin.highest, rel=0.05)
    for name in ("drive_torque", "pole"):
        assert getattr(states, name).shape == states.creepage.shape


@pytest.mark.parametrize("residual", [1.0, 0.4, 0.03])
def test_fold_and_hysteresis(rig: cl.Model, residual: float) -> None:
    """Without damping the torque falls to what slip speed leaves of kinetic friction."""
    fold = cl.find_fold(with_falling(replace(rig.wheelset, damping=0.0), residual, 0.6), speed=V)
    sliding = 0.5 * 0.21 * 220.65e3
    assert fold.return_torque == pytest.approx(residual * sliding, rel=1e-6)
    assert np.isinf(fold.return_creepage)
    if residual == 1.0:
        peak = cl.CarterGriffith(k_hat=0.3).peak
        assert fold.creepage == pytest.approx(0.015 * peak.normalized_creepage, rel=1e-9)
        assert fold.drive_torque == pytest.approx(sliding * peak.traction_ratio, rel=1e-9)
        assert fold.hysteresis == pytest.approx(0.119, abs=5e-4)


def test_fold_of_a_train_is_higher_by_what_turns_the_wheelset_along(locomotive: cl.Model) -> None:
    free = locomotive.wheelset
    assert free.mass is not None
    fold, held = (cl.find_fold(body, speed=10.0) for body in (free, replace(free, mass=None)))
    point = free.balanced(creepage=held.creepage, speed=10.0)
    acceleration = point.resistance_force / free.mass
    along = free.inertia / free.radius * (1.0 + held.creepage) * acceleration
    assert fold.drive_torque - held.drive_torque == pytest.approx(along, rel=1e-3)
    assert along / held.drive_torque == pytest.approx(0.0067, abs=5e-5)


def test_coulomb_friction_has_a_fold_only_if_it_falls_with_slip_speed(rig: cl.Model) -> None:
    element = rig.wheelset.element
    coulomb = cl.friction_with_k_hat(element.contact, k_hat=0.0, static=0.21, kinetic=0.21)
    body = replace(rig.wheelset, element=replace(element, friction=coulomb))
    with pytest.raises(ValueError, match="no fold"):
        cl.find_fold(body, speed=V)
    curve = cl.s_curve(body, speed=V)
    assert curve.fold is None
    assert curve.stable.all()
    falls = with_falling(body, 0.4, 0.6)
    fold = cl.find_fold(falls, speed=V)
    saturated = falls.element.at_creepage(fold.creepage, speed=V)["normalized_creepage"]
    assert 0.8 < saturated < 1.0  # the fall begins before Carter's stick zone has vanished
