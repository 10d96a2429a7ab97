"""The curve of steady creep: its search finds what a dense grid shows, and no less."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import contactlib as cl

RNG = np.random.default_rng(5)


def random_wheelset(body: cl.Wheelset) -> cl.Wheelset:
    """A wheelset with constant, slip-rate or thermal friction, with or without mass and damping."""
    kinetic = RNG.uniform(0.05, 0.4)
    fall: dict[str, Any] = [
        {},
        {"slip_rate_residual": RNG.uniform(0.2, 0.9), "slip_rate_decay": RNG.uniform(0.01, 1.0)},
        {"softening_temperature": RNG.uniform(300.0, 1200.0)},
    ][RNG.integers(3)]
    friction = cl.friction_with_k_hat(
        body.element.contact,
        k_hat=RNG.uniform(0.02, 0.6),
        static=kinetic * RNG.uniform(1.1, 2.5),
        kinetic=kinetic,
    )
    element = replace(
        body.element, friction=replace(friction, **fall), slope_reduction=RNG.uniform(0.1, 1.0)
    )
    damping = float(RNG.choice([0.0, 5.0, 50.0, 500.0]))
    mass = [None, 22.5e3][RNG.integers(2)]
    return replace(body, element=element, damping=damping, mass=mass)


@pytest.mark.filterwarnings("ignore::contactlib.ProcessZoneWarning")
def test_the_search_finds_every_turn_of_a_dense_grid(locomotive: cl.Model) -> None:
    for _ in range(40):
        curve = cl.CreepCurve(random_wheelset(locomotive.wheelset), speed=RNG.uniform(0.5, 50.0))
        scale = curve.wheelset.element.saturation_creepage
        zeta = scale * np.geomspace(1e-3, 1e4, 50_001)
        for side, turns in ((1.0, curve.turns), (-1.0, curve.turns_in_braking)):
            # At a locked wheel, the regularised speed of a hot one makes a dip of a part in 1000.
            zeta = zeta[side * zeta > -0.9]
            signs = np.sign(curve.slope(side * zeta))
            at = np.flatnonzero(signs[:-1] != signs[1:])
            inside = turns[(abs(turns) > zeta[0]) & (abs(turns) < zeta[-1])]
            assert len(at) == inside.size
            assert (abs(inside) >= zeta[at]).all()
            assert (abs(inside) <= zeta[at + 1]).all()


@pytest.mark.filterwarnings("ignore::contactlib.ProcessZoneWarning")
def test_the_search_finds_every_state_of_a_dense_grid(locomotive: cl.Model) -> None:
    for _ in range(40):
        curve = cl.CreepCurve(random_wheelset(locomotive.wheelset), speed=RNG.uniform(0.5, 50.0))
        scale = curve.wheelset.element.saturation_creepage
        zeta = scale * np.geomspace(1e-3, 1e4, 50_001)
        zeta = np.concatenate([-zeta[::-1], zeta])
        torque = RNG.uniform(-1.0, 1.0) * float(curve.torque(3.0 * scale))
        excess = np.sign(curve.torque(zeta) - torque)
        at = np.flatnonzero(excess[:-1] != excess[1:])
        found = curve.steady(torque)
        inside = found.creepage[(found.creepage > zeta[0]) & (found.creepage < zeta[-1])]
        assert len(at) == inside.size
        assert (inside >= zeta[at]).all()
        assert (inside <= zeta[at + 1]).all()
        np.testing.assert_allclose(found.drive_torque, torque, rtol=1e-9, atol=1e-6)
        held = found.creepage[np.abs(found.creepage).argmin()] if found.creepage.size else None
        try:
            assert curve.grip(torque) == held
        except ValueError as error:
            limit = float(str(error).rpartition(" ")[2])  # to six digits
            side = 1.0 if torque >= curve.torque(0.0) else -1.0
            assert side * (torque - limit) > -1e-5 * abs(limit)


def test_slope_and_acceleration_are_those_of_the_equations_of_motion(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    at: dict[str, Any] = {"speed": 8.0, "friction_scale": 0.7, "resistance_force": 500.0}
    curve, zeta, step = cl.CreepCurve(body, **at), np.array([-0.02, 0.0, 0.005, 0.3]), 1e-7
    ends = curve.torque(zeta + step) - curve.torque(zeta - step)
    np.testing.assert_allclose(curve.slope(zeta), ends / (2.0 * step), rtol=1e-6)
    for creepage, acceleration in zip(zeta, curve.acceleration(zeta), strict=True):
        point = body.balanced(creepage=float(creepage), speed=8.0, friction_scale=0.7)
        assert body.mass is not None
        surplus = point.resistance_force - 500.0
        assert acceleration == pytest.approx(surplus / body.mass, rel=1e-12)


@pytest.mark.parametrize("scale", [1.0, 0.3])
def test_the_peak_is_the_available_force(locomotive: cl.Model, scale: float) -> None:
    body = locomotive.wheelset
    peak = cl.CreepCurve(body, speed=10.0, friction_scale=scale).peak
    force = body.element.at_creepage(peak.creepage, speed=10.0, friction_scale=scale)["creep_force"]
    assert force == pytest.approx(peak.creep_force, rel=1e-12)
    expected = cl.available_force(body.element, speed=10.0, friction_scale=scale)
    assert peak.creep_force == pytest.approx(float(expected), rel=1e-14)
