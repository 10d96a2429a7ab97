"""The curve of steady creep: its search finds what a dense grid shows, and no less."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from falling_friction import with_falling
from strategies import random_wheelset

import contactlib as cl
from contactlib import kernel
from contactlib.vehicle import CreepCurve

RNG = np.random.default_rng(5)


@pytest.mark.filterwarnings("ignore::contactlib.element.ProcessZoneWarning")
def test_the_search_finds_every_turn_of_a_dense_grid(locomotive: cl.Model) -> None:
    for _ in range(15):
        body = random_wheelset(locomotive.wheelset, RNG)
        curve = CreepCurve(body, speed=RNG.uniform(0.5, 50.0))
        scale = curve.wheelset.element.saturation_creepage
        zeta = scale * np.geomspace(1e-3, 1e4, 50_001)
        for side, turns in ((1.0, curve.turns), (-1.0, curve.turns_in_braking)):
            # At a locked wheel, the regularised speed of a hot one makes a dip of a part in 1000.
            sizes = zeta[side * zeta > -0.9]
            signs = np.sign(curve.slope(side * sizes))
            at = np.flatnonzero(signs[:-1] != signs[1:])
            inside = turns[(abs(turns) > sizes[0]) & (abs(turns) < sizes[-1])]
            assert len(at) == inside.size
            assert (abs(inside) >= sizes[at]).all()
            assert (abs(inside) <= sizes[at + 1]).all()
        check_fold(curve, zeta)
        worst = curve.worst_pole
        tried = np.append(zeta, worst.creepage)
        poles = cl.stability.fast_pole(curve.wheelset, tried, speed=curve.at.speed)
        assert poles.max() - worst.pole <= 1e-9 * np.abs(poles).max()
        assert poles[-1] == pytest.approx(worst.pole, rel=1e-9)
        both = np.concatenate([-zeta[zeta < 0.9], zeta])
        forces = curve.wheelset.element.at_creepage(both, speed=curve.at.speed)["creep_force"]
        assert np.abs(forces).max() <= curve.peak.creep_force * (1.0 + 1e-12)


def check_fold(curve: CreepCurve, zeta: np.ndarray) -> None:
    """A torque that rises slowly leaves at the first maximum, and returns at the least after it."""
    if not curve.turns.size:
        return
    fold, torque = curve.fold, curve.torque(zeta)
    assert fold.creepage == curve.turns[0]
    assert fold.drive_torque == float(curve.torque(fold.creepage))
    beyond = torque[zeta > fold.creepage]
    slip_away = beyond[: int(np.argmax(beyond > fold.drive_torque)) or None]
    assert torque[zeta <= fold.creepage].max() <= fold.drive_torque
    assert fold.return_torque <= max(0.0, slip_away.min()) * (1.0 + 1e-12)
    if fold.return_creepage < zeta[-1]:
        assert fold.return_torque == pytest.approx(max(0.0, slip_away.min()), rel=1e-6)


@pytest.mark.filterwarnings("ignore::contactlib.element.ProcessZoneWarning")
def test_the_search_finds_every_state_of_a_dense_grid(locomotive: cl.Model) -> None:
    for _ in range(40):
        inputs: dict[str, Any] = {
            "friction_scale": RNG.uniform(0.2, 1.5),
            "resistance_force": RNG.uniform(-2e4, 4e4),
        }
        body = random_wheelset(locomotive.wheelset, RNG)
        curve = CreepCurve(body, speed=RNG.uniform(0.5, 50.0), **inputs)
        scale = curve.wheelset.element.saturation_creepage
        zeta = scale * np.geomspace(1e-3, 1e4, 50_001)
        check_fold(curve, zeta)
        zeta = np.concatenate([-zeta[::-1], zeta])
        torque = RNG.uniform(-1.0, 1.0) * float(curve.torque(3.0 * scale))
        excess = np.sign(curve.torque(zeta) - torque)
        at = np.flatnonzero(excess[:-1] != excess[1:])
        states = curve.steady(torque)
        assert all(a != b for a, b in pairwise(states.stable.tolist()))
        element, slopes = curve.wheelset.element, np.abs(curve.slope(states.creepage))
        largest = curve.wheelset.radius * element.friction.static * element.axle_load
        left = np.abs(curve.torque(states.creepage) - torque)
        assert (left <= 1e-11 * largest + 1e-14 * slopes * np.abs(states.creepage)).all()
        inside = states.creepage[(states.creepage > zeta[0]) & (states.creepage < zeta[-1])]
        assert len(at) == inside.size
        assert (inside >= zeta[at]).all()
        assert (inside <= zeta[at + 1]).all()
        np.testing.assert_allclose(states.drive_torque, torque, rtol=1e-9, atol=1e-6)
        held = states.creepage[np.abs(states.creepage).argmin()] if states.creepage.size else None
        try:
            assert curve.grip(torque) == held
        except ValueError as error:
            limit = float(str(error).rpartition(" ")[2])  # to six digits
            side = 1.0 if torque >= curve.torque(0.0) else -1.0
            assert side * (torque - limit) > -1e-5 * abs(limit)


def test_torque_slope_and_acceleration_are_those_of_the_equations_of_motion(
    locomotive: cl.Model,
) -> None:
    body = locomotive.wheelset
    at: dict[str, Any] = {"speed": 8.0, "friction_scale": 0.7, "resistance_force": 500.0}
    curve, zeta, step = CreepCurve(body, **at), np.array([-0.02, 0.0, 0.005, 0.3]), 1e-7
    ends = curve.torque(zeta + step) - curve.torque(zeta - step)
    np.testing.assert_allclose(curve.slope(zeta), ends / (2.0 * step), rtol=1e-6)
    states = np.stack([zeta, curve.torque(zeta), curve.acceleration(zeta)], axis=1)
    for creepage, torque, acceleration in states.tolist():
        omega = (1.0 + creepage) * 8.0 / body.radius
        rates, _ = body.rates(omega, 8.0, torque, body.element.axle_load, 0.7, 500.0)
        assert acceleration == pytest.approx(rates.speed_rate, rel=1e-12)
        # zeta = r omega/V - 1 does not change
        change = body.radius * (rates.omega_rate / 8.0 - omega * rates.speed_rate / 8.0**2)
        assert abs(change) < 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_grip_of_wheels_on_two_frictions_whose_force_peaks_far_out(
    rig: cl.Model, sign: float
) -> None:
    element = replace(rig.wheelset.element, table=cl.CreepForceTable.from_law(cl.Polach.wet()))
    body = with_falling(replace(rig.wheelset, element=element, damping=0.0), 0.4, 0.06)
    zeta, scales = np.geomspace(1e-4, 10.0, 200_001), [0.6, 1.0]
    torque = np.mean(
        [CreepCurve(body, speed=2.0, friction_scale=x).torque(zeta) for x in scales],
        axis=0,
    )
    i = int(np.argmax(torque))
    assert zeta[i] > 5.0 * element.saturation_creepage
    load = [element.axle_load] * 2
    native = kernel.NativeCurve(
        body.element.native, body.native, speed=2.0, normal_load=load, friction_scale=scales
    )
    for part in (0.5, 0.9, 0.999):
        creepage = native.grip(sign * part * torque[i])[0]
        expected = np.interp(part * torque[i], torque[: i + 1], zeta[: i + 1])
        assert creepage == pytest.approx(sign * expected, rel=1e-6)
    creepage, limit = native.grip(sign * 1.001 * torque[i])
    assert np.isnan(creepage)
    assert limit == pytest.approx(sign * torque[i], rel=1e-6)


@pytest.mark.parametrize("scale", [1.0, 0.3])
def test_the_peak_is_the_available_force(locomotive: cl.Model, scale: float) -> None:
    body = locomotive.wheelset
    peak = CreepCurve(body, speed=10.0, friction_scale=scale).peak
    force = body.element.at_creepage(peak.creepage, speed=10.0, friction_scale=scale)["creep_force"]
    assert force == pytest.approx(peak.creep_force, rel=1e-12)
    expected = cl.vehicle.available_force(body.element, speed=10.0, friction_scale=scale)
    assert peak.creep_force == pytest.approx(float(expected), rel=1e-14)
