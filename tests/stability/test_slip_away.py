"""Slip-away times: quadrature and closed form against runs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from plain_scenario import plain_scenario
from wheelsets import torque_run

import contactlib as cl
from contactlib import stability
from contactlib.stability.poles import STEADY_ROLLING

V = 10.0  # [m/s]


def simulated_time(body: cl.Wheelset, torque: float, start: float, end: float) -> float:
    run = torque_run(body, torque, start, 100.0, output_interval=100.0, slip_away_creepage=end)
    event = run.first("slip_away")
    assert event is not None
    return event.time


@pytest.mark.parametrize("damping", [0.0, 50.0])
@pytest.mark.parametrize("overload", [1e-4, 1e-2, 0.3])
@pytest.mark.parametrize("end", [0.15, 1.0])
def test_slip_away_time_of_a_held_speed(
    rig: cl.Model, damping: float, overload: float, end: float
) -> None:
    body = replace(rig.wheelset, damping=damping)
    torque = (1.0 + overload) * cl.find_fold(body, speed=V).drive_torque
    time = cl.stability.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=end)
    assert time == pytest.approx(simulated_time(body, torque, 0.0, end), rel=1e-6)


@pytest.mark.parametrize(("mass", "tolerance"), [(142.5e3, 0.006), (22.5e3, 0.04)])
def test_slip_away_time_of_a_free_wheelset(
    locomotive: cl.Model, mass: float, tolerance: float
) -> None:
    # Its speed is frozen: the error is about half of what the speed gains meanwhile.
    body = replace(locomotive.wheelset, mass=mass)
    fold = cl.find_fold(body, speed=V)
    for overload in (0.01, 0.1):
        torque = (1.0 + overload) * fold.drive_torque
        time = cl.stability.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=0.15)
        assert time == pytest.approx(simulated_time(body, torque, 0.0, 0.15), rel=tolerance)
        # Without the vehicle's motion in the torque it would be far off at the same torque.
        as_held = replace(body, mass=None)
        wrong = cl.stability.slip_away_time(
            as_held, drive_torque=torque, speed=V, start=0.0, end=0.15
        )
        if mass == 22.5e3:
            assert wrong != pytest.approx(time, rel=tolerance)


@pytest.mark.parametrize(
    ("end", "overload", "within"),
    [
        *((0.15, overload, 0.15) for overload in (1e-4, 1e-3, 1e-2, 0.03, 0.1)),
        *((1.0, overload, 0.04) for overload in (1e-4, 1e-2, 0.1, 0.5)),
    ],
)
def test_slip_away_formula(rig: cl.Model, end: float, overload: float, within: float) -> None:
    body = replace(rig.wheelset, damping=0.0)
    law, zeta0 = cl.CarterGriffith(k_hat=0.3), body.element.saturation_creepage
    peak, sliding = law.peak, 0.21 * body.element.axle_load
    h = 1e-4
    ends = law.slope(peak.normalized_creepage + np.array([-h, h]))
    time = stability.slip_away_formula(
        radius=0.5,
        inertia=250.0,
        speed=V,
        overload=overload,
        peak_force=sliding * peak.traction_ratio,
        peak_curvature=sliding * float(ends[0] - ends[1]) / (2.0 * h * zeta0**2),
        peak_creepage=zeta0 * peak.normalized_creepage,
        end_creepage=end,
        sliding_force=sliding,
    )
    torque = (1.0 + overload) * 0.5 * sliding * peak.traction_ratio
    assert 0.0 < time / simulated_time(body, torque, 0.0, end) - 1.0 < within
    estimate = stability.slip_away_estimate(body, drive_torque=torque, speed=V, end=end)
    assert estimate == pytest.approx(time, rel=1e-3)


def test_slip_away_formula_is_best_at_the_peak(rig: cl.Model) -> None:
    # To pass a peak takes the time of a parabola, the more so the less the overload.
    body = replace(rig.wheelset, damping=0.0)
    fold = cl.find_fold(body, speed=V)
    overloads = np.array([1e-2, 1e-3, 1e-4, 1e-5])
    misses = []
    for overload in overloads:
        torque = (1.0 + overload) * fold.drive_torque
        exact = cl.stability.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=0.15)
        estimate = stability.slip_away_estimate(body, drive_torque=torque, speed=V, end=0.15)
        misses.append(abs(estimate / exact - 1.0))
    assert (np.diff(misses) < 0.0).all()
    assert misses[-1] < 0.005


@pytest.mark.parametrize("below", [1e-3, 1e-6, 1e-9, 1e-12, 0.0])
def test_no_slip_away_below_the_fold(rig: cl.Model, below: float) -> None:
    fold = cl.find_fold(rig.wheelset, speed=V)
    body, torque = rig.wheelset, (1.0 - below) * fold.drive_torque
    assert (
        cl.stability.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=0.1)
        == math.inf
    )
    assert stability.slip_away_estimate(body, drive_torque=torque, speed=V, end=0.1) == math.inf
    assert (
        cl.stability.slip_away_time(body, drive_torque=torque, speed=V, start=0.1, end=0.1) == 0.0
    )


@pytest.mark.parametrize("overload", [1e-14, 1e-12, 1e-10, 1e-8])
def test_slip_away_time_grows_without_end_towards_the_fold(rig: cl.Model, overload: float) -> None:
    # The squeeze past the peak goes as one over the root of the overload; the rest does not grow.
    fold = cl.find_fold(rig.wheelset, speed=V)
    given: dict[str, Any] = {"drive_torque": (1.0 + overload) * fold.drive_torque, "speed": V}
    time = cl.stability.slip_away_time(rig.wheelset, start=0.0, end=1.0, **given)
    estimate = stability.slip_away_estimate(rig.wheelset, end=1.0, **given)
    rounding = 4e-16 / overload * estimate  # of the torque
    assert time == pytest.approx(estimate, rel=0.0, abs=0.3 + rounding)


def test_time_to_recover(rig: cl.Model) -> None:
    body = rig.wheelset
    torque = 0.9 * cl.find_fold(body, speed=V).return_torque
    run = torque_run(body, torque, 0.5, 1.0, output_interval=None, stop_at=())
    arrived = np.flatnonzero(run["creepage"] <= 0.02)[0]
    end = float(run["creepage"][arrived])
    time = cl.stability.slip_away_time(body, drive_torque=torque, speed=V, start=0.5, end=end)
    assert time == pytest.approx(float(run.time[arrived]), rel=1e-6)
    back = cl.stability.slip_away_time(body, drive_torque=torque, speed=V, start=end, end=0.5)
    assert back == math.inf


@pytest.mark.parametrize("speed", [3.2, 1.4])
def test_memory_matters_only_where_rolling_is_not_steady(
    locomotive: cl.Model, speed: float
) -> None:
    body = replace(locomotive.wheelset, mass=None)
    memory = replace(body, element=replace(body.element, memory=True))
    fold = cl.find_fold(body, speed=speed)
    torque, start, end = 1.02 * fold.drive_torque, 0.5 * fold.creepage, 0.15
    given = {"initial_speed": speed, "design_speed": speed, "held_speed": cl.Profile.of(speed)}
    scenario = plain_scenario(memory, demand=cl.Profile.of(torque), duration=0.1, **given)
    run = cl.run_scenario(scenario, "open_loop", initial_creepage=start, step=1e-4)
    found = np.interp(end, run["creepage"], run.time)
    time = stability.slip_away_time(body, speed=speed, drive_torque=torque, start=start, end=end)
    pole = cl.worst_pole(body, speed=speed).pole
    steady = stability.reduced_frequency(body, pole, speed=speed) < STEADY_ROLLING
    assert (abs(found / time - 1.0) < 0.05) == steady == (speed > 3.0)
