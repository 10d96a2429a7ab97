"""Every plausible vehicle gets an answer from every public analysis."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import contactlib as cl
from contactlib import stability
from contactlib.stability.torsion import bistable_range, torsional_state


def vehicle(locomotive: cl.Model, i: int) -> tuple[cl.Drivetrain, float, float]:
    """Drivetrain that carries 5 to 200 t or stands on a rig, 0.1 to 80 m/s, and a part of a range.

    Friction is constant after microns, or falls with slip speed or heat as well.
    """
    rng = np.random.default_rng([7, i])
    mass, speed = np.exp(rng.uniform(np.log([5e3, 0.1]), np.log([2e5, 80.0]))).tolist()
    falls: tuple[dict[str, Any], ...] = (
        {},
        {"slip_rate_residual": rng.uniform(0.4, 1.0), "slip_rate_decay": rng.uniform(0.0, 1.0)},
        {"softening_temperature": rng.uniform(300.0, 1500.0)},
    )
    element = locomotive.wheelset.element
    friction = replace(element.friction, **falls[int(rng.integers(3))])
    body = replace(
        locomotive.wheelset,
        mass=None if rng.random() < 0.2 else mass,
        inertia=float(rng.uniform(50.0, 400.0)),
        damping=float(rng.choice([0.0, 5.0, 50.0, 200.0])),
        element=replace(element, friction=friction),
    )
    axle = cl.Axle(
        stiffness=float(10.0 ** rng.uniform(6.0, 7.2)),
        damping=float(10.0 ** rng.uniform(1.5, 3.5)),
        drive_share=float(rng.uniform(0.0, 1.0)),
    )
    return cl.Drivetrain(body, axle=axle), speed, float(rng.uniform(0.02, 0.98))


def analyses(
    train: cl.Drivetrain, speed: float, part: float
) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Names of the analyses, and what computes them."""
    body = train.wheelset
    fold = cl.find_fold(body, speed=speed)
    least = max(fold.return_torque, 0.3 * fold.drive_torque)
    between: dict[str, Any] = {
        "drive_torque": least + part * (fold.drive_torque - least),
        "speed": speed,
    }
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
    longest: dict[str, tuple[float, int]] = {}
    for i in vehicles:
        for name, analysis in analyses(*vehicle(locomotive, i)):
            start = time.process_time()
            analysis()
            took = time.process_time() - start
            longest[name] = max(longest.get(name, (0.0, i)), (took, i))
    for name, (took, i) in longest.items():  # shown by "pytest -s"
        print(f"{name}: at most {took:.2f} s, for vehicle {i}")
