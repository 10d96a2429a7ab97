"""Every plausible vehicle gets an answer from every public analysis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from wheelsets import plausible_vehicle

import contactlib as cl
from contactlib import stability
from contactlib.stability.torsion import bistable_range, torsional_state


def analyses(
    train: cl.Drivetrain, speed: float, torque: float
) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Names of the analyses, and what computes them."""
    body = train.wheelset
    fold = cl.find_fold(body, speed=speed)
    between: dict[str, Any] = {"drive_torque": torque, "speed": speed}
    above: dict[str, Any] = {"drive_torque": 1.05 * fold.drive_torque, "speed": speed}
    far = 1.3 * fold.creepage
    yield "find_fold", lambda: cl.find_fold(body, speed=speed)
    yield "s_curve", lambda: cl.s_curve(body, speed=speed)
    yield "steady_states", lambda: cl.steady_states(body, **between)
    yield "basin", lambda: cl.basin(body, **between)
    yield "separatrix", lambda: stability.separatrix(body, **between)
    yield "clearing", lambda: cl.clearing(body, friction_scale=0.5, **between)
    yield "worst_pole", lambda: stability.worst_pole(body, speed=speed)
    yield "slip_away_time", lambda: stability.slip_away_time(body, start=0.0, end=far, **above)
    yield "slip_away_estimate", lambda: stability.slip_away_estimate(body, end=far, **above)
    yield "reduced_plant", lambda: stability.reduced_plant(body, far, speed=speed)
    yield "available_force", lambda: cl.available_force(body.element, speed=speed)
    point = body.balanced(creepage=far, speed=speed)
    yield "slope_threshold", lambda: stability.slope_threshold(body, point)
    yield "creep_control_gain", lambda: stability.creep_control_gain(body, point)
    yield "torsional_state", lambda: torsional_state(train, point)
    yield "bistable_range", lambda: bistable_range(train, speed=speed)


@pytest.mark.parametrize(
    "vehicles",
    [
        range(4),
        pytest.param(range(4, 12), marks=pytest.mark.slow),
        pytest.param(range(2000), marks=pytest.mark.reference),
    ],
    ids=lambda vehicles: str(len(vehicles)),
)
def test_every_analysis_answers(locomotive: cl.Model, vehicles: range) -> None:
    for i in vehicles:
        for name, analysis in analyses(*plausible_vehicle(locomotive, i)):
            try:
                analysis()
            except Exception as error:
                raise AssertionError(f"{name} of vehicle {i}") from error
