"""Outcomes of the analysis, against a second way."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from plain_scenario import wet_patch
from sweep_files import HEAD, SCENARIO, write_sweep

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.runs.analysis import analyse
from contactlib.runs.sweep.plan import ScenarioBuilder
from contactlib.vehicle import CreepCurve


def analysis_of(tmp_path: Path, axis: str, scenario: str = SCENARIO) -> dict[str, FloatArray]:
    """Outcomes of the analysis along one axis."""
    names = list(cl.runs.ANALYSES)
    text = re.sub(r"controllers = .*\n", "", HEAD)
    text = re.sub(r"outcomes = .*", f"outcomes = {json.dumps(names)}", text)
    results = cl.ensemble(write_sweep(tmp_path, f"{text}[axes.x]\n{axis}\n", scenario))
    assert "controller" not in results.dims
    return {name: results[name].values for name in [*names, "x"]}


def test_analysis_agrees_with_a_second_way(tmp_path: Path) -> None:
    results = analysis_of(tmp_path, 'factor_on = "demand.torque"\nvalues = [0.5, 1.0, 1.2]')
    scenario = cl.load_scenario(tmp_path / "s.toml")
    wheelset, speed = scenario.drivetrain.wheelset, scenario.design_speed
    # Eigenvalues of the steady states against the fold of the torque.
    torque = 23e3 * results["x"]
    assert (results["stable"] == (torque < results["critical_torque"])).all()
    assert (results["torque_margin"] > 0.0).tolist() == results["stable"].tolist()
    clearing = results["clearing_time"]
    assert clearing[0] == math.inf  # half of it holds on the patch too
    known = cl.clearing(wheelset, drive_torque=23e3, speed=speed, friction_scale=0.5)
    assert 0.0 < clearing[1] == known.time < 0.1
    assert clearing[2] == 0.0  # too much for good friction
    assert results["delay_limit"] == pytest.approx(1.0 / results["worst_pole"])
    curve = CreepCurve(wheelset, speed=speed)
    assert (results["available_force"] == curve.peak.creep_force).all()
    assert (results["critical_torque"] == curve.fold.drive_torque).all()
    assert (results["critical_creepage"] == curve.fold.creepage).all()


def test_the_patch_has_the_slope_of_the_track() -> None:
    wet = cl.Profile((20.0, 20.0), (1.0, 0.5))
    slope = cl.Profile((20.0, 20.0), (1.0, 0.29))
    case = wet_patch(track=cl.Track(friction_left=wet, slope=slope))
    body, speed = case.drivetrain.wheelset.with_slope(0.29), case.design_speed
    expected = cl.find_fold(body, speed=speed, friction_scale=0.5).drive_torque
    outcomes = analyse(case, ["patch_critical_torque", "critical_torque"])
    assert outcomes["patch_critical_torque"] == expected
    good = cl.find_fold(case.drivetrain.wheelset, speed=speed).drive_torque
    assert outcomes["critical_torque"] == good


DAMPING = "\n[wheelset_changes.wheelset]\ndamping = {}\n"


@pytest.mark.parametrize("damping", [0.0, 20.0, 100.0])
def test_margin_clearing_and_stability_agree_for_either_sign(
    tmp_path: Path, damping: float
) -> None:
    values = np.linspace(-1.4, 1.4, 15).round(2).tolist()
    axis = f'factor_on = "demand.torque"\nvalues = {values}'
    results = analysis_of(tmp_path, axis, SCENARIO + DAMPING.format(damping))
    torque, stable = 23e3 * results["x"], results["stable"] == 1.0
    known = np.isfinite(results["torque_margin"])
    assert known.any()
    assert ((results["torque_margin"] > 0.0) == stable)[known].all()
    for name in (
        "critical_torque",
        "patch_critical_torque",
        "critical_creepage",
        "hysteresis",
        "clearing_time",
    ):
        assert (np.isnan(results[name]) | (torque >= 0.0)).all()
    assert np.isnan(results["torque_margin"][torque < 0.0]).all()
    assert ((results["clearing_time"] > 0.0) == stable)[torque > 0.0].all()
    # Braking against the balance of torques, -r Q(-zeta) = r Q(zeta): damping brakes too.
    wheelset = cl.load_scenario(tmp_path / "s.toml").drivetrain.wheelset
    held = -cl.stability.quasi_steady_torque(
        wheelset, -np.linspace(0.0, 0.05, 5001), speed=10.0
    ).min()
    assert (stable == (-torque < held))[torque < 0.0].all()
    assert stable[torque < 0.0].any()
    assert not stable.all()


@pytest.mark.filterwarnings("ignore::contactlib.InputWarning")  # 1 N
def test_wheels_that_spin_against_their_bearings_are_not_held(tmp_path: Path) -> None:
    axis = 'parameter = "vehicle.contact.wheel_load"\nvalues = [1.0, "230 kN"]'
    scenario = SCENARIO + DAMPING.format(5.0)
    results = analysis_of(tmp_path, axis, scenario)
    assert results["stable"].tolist() == [0.0, 1.0]
    assert results["clearing_time"][0] == 0.0
    assert results["clearing_time"][1] > 0.0


@pytest.mark.slow
def test_maps_of_friction_and_load_are_in_order() -> None:
    sweep = cl.load_sweep("friction_and_load_sweep.toml")
    points = np.arange(sweep.runs).reshape(sweep.shape)[::9, ::4]  # (load, patch friction)
    builder = ScenarioBuilder(sweep.plan)
    outcomes = [
        [analyse(builder.build(sweep.values[i].tolist()), sweep.plan.outcomes) for i in row]
        for row in points
    ]

    def grid(name: str) -> FloatArray:
        return np.array([[point[name] for point in row] for row in outcomes])

    # At one k_hat and semi-width creep force and saturation creepage are of the load alone.
    loads = sweep.values[points[:, 0], 0]
    critical = grid("critical_torque")
    assert critical == pytest.approx(critical[:1] * (loads / loads[0])[:, np.newaxis], rel=5e-3)
    assert (grid("patch_critical_torque") < critical).all()
    assert (np.diff(grid("patch_critical_torque")) > 0.0).all()
    time = grid("clearing_time")
    assert (time[0] == 0.0).all()  # this light it does not hold the demand anywhere
    assert (time[1, 1:] >= time[1, :-1]).all()
    assert 0.0 < time[1, 0] < math.inf


def test_outcomes_of_runs_build_no_analysis(monkeypatch: pytest.MonkeyPatch) -> None:
    """It keeps 0.2 MB of each scenario."""
    monkeypatch.setattr("contactlib.runs.analysis.Analysis", None)
    assert analyse(wet_patch(), ["final_speed"]) == {}
