"""Every plausible vehicle gets an answer from every public analysis."""

from __future__ import annotations

from typing import Any

import pytest
from wheelsets import plausible_vehicle

import contactlib as cl
from contactlib import stability
from contactlib.stability.torsion import bistable_range, torsional_state


@pytest.mark.parametrize(
    "vehicles",
    [
        pytest.param(range(2), marks=pytest.mark.slow),
        pytest.param(range(2000), marks=pytest.mark.reference),
    ],
    ids=lambda vehicles: str(len(vehicles)),
)
def test_every_analysis_answers(locomotive: cl.Model, vehicles: range) -> None:
    for i in vehicles:
        train, speed, torque = plausible_vehicle(locomotive, i)
        body = train.wheelset
        fold = cl.find_fold(body, speed=speed)
        between: dict[str, Any] = {"drive_torque": torque, "speed": speed}
        above: dict[str, Any] = {"drive_torque": 1.05 * fold.drive_torque, "speed": speed}
        far = 1.3 * fold.creepage
        cl.s_curve(body, speed=speed)
        cl.steady_states(body, **between)
        cl.stability.basin(body, **between)
        cl.stability.separatrix(body, **between)
        cl.clearing(body, friction_scale=0.5, **between)
        cl.worst_pole(body, speed=speed)
        cl.stability.slip_away_time(body, start=0.0, end=far, **above)
        stability.slip_away_estimate(body, end=far, **above)
        stability.reduced_plant(body, far, speed=speed)
        cl.vehicle.available_force(body.element, speed=speed)
        point = body.balanced(creepage=far, speed=speed)
        cl.stability.slope_threshold(body, point)
        cl.creep_control_gain(body, point)
        torsional_state(train, point)
        bistable_range(train, speed=speed)
