"""Creepages from which a wheelset comes back, against runs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from wheelsets import MASSES, plausible_vehicle, torque_run

import contactlib as cl
from contactlib.stability.basin import AWAY, LONGEST, REACH, _ahead
from contactlib.vehicle import CreepCurve

V = 10.0  # [m/s]


def slips_away(body: cl.Wheelset, torque: float, creepage: float) -> bool:
    run = torque_run(body, torque, creepage, 3.0)
    away = run.first("slip_away") is not None
    assert away or abs(run["creepage"][-1]) < 0.017  # either beyond, or back at grip
    return away


@pytest.mark.slow
@pytest.mark.parametrize("mass", MASSES)
@pytest.mark.parametrize("part", [0.92, 0.98])
def test_the_basin_ends_at_its_limits(
    locomotive: cl.Model, mass: float | None, part: float
) -> None:
    body = replace(locomotive.wheelset, mass=mass)
    for sign in (1.0, -1.0):
        # Braking slows the vehicle, which turns the wheelset back too: a little less torque.
        torque = (
            sign * part * cl.find_fold(body, speed=V).drive_torque * (1.0 if sign > 0 else 0.97)
        )
        basin = cl.stability.basin(body, drive_torque=torque, speed=V)
        border, other = basin.highest, basin.lowest
        if sign < 0.0:
            border, other = other, border
        assert math.isinf(other)
        assert abs(border) > abs(basin.creepage)
        assert not slips_away(body, torque, (1.0 - 1e-3) * border)
        assert slips_away(body, torque, (1.0 + 1e-3) * border)
        line = cl.stability.separatrix(body, drive_torque=torque, speed=[V])
        assert line.tolist() == [border]


def test_the_separatrix_of_a_light_vehicle_is_not_the_unstable_branch(
    locomotive: cl.Model,
) -> None:
    body = replace(locomotive.wheelset, mass=8e3)
    fold = cl.find_fold(body, speed=V)
    torque = 0.995 * fold.drive_torque
    states = cl.steady_states(body, drive_torque=torque, speed=V)
    frozen = float(states.creepage[~states.stable][0])
    border = cl.stability.basin(body, drive_torque=torque, speed=V).highest
    apart = abs(border / frozen - 1.0)
    assert apart > 3e-5
    assert not slips_away(body, torque, (1.0 - 0.2 * apart) * border)
    assert slips_away(body, torque, (1.0 + 0.2 * apart) * border)


def test_the_separatrix_is_a_motion(locomotive: cl.Model) -> None:
    # Three points of it: the equations of motion lead from the first along the others.
    body = replace(locomotive.wheelset, mass=22.5e3)
    torque = 0.97 * cl.find_fold(body, speed=V).drive_torque
    speeds = np.array([10.0, 10.1, 10.2])
    line = cl.stability.separatrix(body, drive_torque=torque, speed=speeds)
    given: dict[str, Any] = {"output_interval": 1e-3, "tolerance": 1e-12, "stop_at": ()}
    run = torque_run(body, torque, float(line[0]), 0.11, **given)
    assert run["speed"][-1] > speeds[-1]
    along = np.interp(speeds, run["speed"], run["creepage"])
    # What is left of the trace's error grows by exp(p t), 1e3 here.
    np.testing.assert_allclose(line, along, rtol=1e-4)
    assert line[2] != pytest.approx(line[0], rel=1e-4)


def test_a_saddle_lies_on_its_separatrix(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    point = next(
        p for p in body.equilibria(drive_torque=25.5e3) if 0.0 < p.creepage < 1.0 and not p.stable
    )
    assert (point.eigenvalues < 0.0).tolist() == [False, True]
    values, vectors = np.linalg.eig(point.jacobian)
    omega, speed = vectors[:, values.argmin()]
    for side in (-0.5, 0.5):  # its stable manifold leaves along the eigenvector
        at = point.speed + side
        border = cl.stability.basin(body, drive_torque=25.5e3, speed=at).highest
        tangent = point.omega + side * omega / speed
        assert border == pytest.approx(body.radius * tangent / at - 1.0, rel=2e-3)
        assert border != pytest.approx(point.creepage, rel=1e-5)
    there = cl.stability.basin(body, drive_torque=25.5e3, speed=point.speed).highest
    assert there == pytest.approx(point.creepage, rel=1e-8)


def test_no_border_and_no_grip(rig: cl.Model) -> None:
    fold = cl.find_fold(rig.wheelset, speed=V)
    low = cl.stability.basin(rig.wheelset, drive_torque=0.999 * fold.return_torque, speed=V)
    assert (low.lowest, low.highest) == (-math.inf, math.inf)
    assert not slips_away(replace(rig.wheelset), 0.9 * fold.return_torque, 0.1)
    with pytest.raises(ValueError, match="no stable state below the peak"):
        cl.stability.basin(rig.wheelset, drive_torque=1.001 * fold.drive_torque, speed=V)


@pytest.mark.slow
def test_every_plausible_vehicle_gets_an_answer(locomotive: cl.Model) -> None:
    soon = 0
    for i in range(120):
        train, speed, torque = plausible_vehicle(locomotive, i, held=0.0)
        body = train.wheelset
        basin = cl.stability.basin(body, drive_torque=torque, speed=speed)
        states = cl.steady_states(body, drive_torque=torque, speed=speed).creepage
        unstable = float(states[np.abs(states).argmin() + 1])
        at = body.conditions(speed=speed)
        if _ahead(body, torque, unstable, at) is not None:
            continue
        soon += 1  # the unstable branch ends soon: runs on either side decide
        reach = basin.creepage + REACH * (unstable - basin.creepage)
        sides = [(0.999, True), (1.001, False)]
        border = basin.highest
        if math.isinf(border):
            border, sides = reach, [(0.999, True)]
        middle = 0.5 * (basin.creepage + unstable)
        for part, comes_back in sides:
            run = torque_run(
                body,
                torque,
                part * border,
                LONGEST / float(CreepCurve(body, at).pole(unstable)),
                initial_speed=speed,
                output_interval=None,
                slip_away_creepage=basin.creepage + AWAY * (unstable - basin.creepage),
                stop_at=["slip_away", "standstill"],
            )
            assert (run["creepage"].min() < middle) == comes_back
    assert soon >= 3
