"""Root locus and Nyquist plot against the closed forms of the gains."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from wheelsets import falling, unstable

import contactlib as cl
from contactlib.stability import control_systems


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


def test_gains_of_a_root_locus_rise(rig: cl.Model) -> None:
    point = rig.wheelset.balanced(creepage=0.021, speed=10.0)
    loop = control_systems.creep_loop(rig.wheelset, point, proportional_gain=1e5)
    for gains in ([2.0, 1.0], [[1.0, 2.0]], [1.0, 1.0]):
        with pytest.raises(ValueError, match=r"gains = array.* must be one row that rises"):
            control_systems.root_locus(loop, gains)
