"""Warnings of runs that no vehicle survives."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sweep_files import write_sweep

import contactlib as cl
from contactlib.runs.damage import warn_of_damage

STRONG = """
name = "Too strong"
source = "chosen"
wheelset = "locomotive.toml"

[run]
initial_speed = 15.0
duration = 9.0

[demand]
time = [0.0, 0.1]
torque = [0.0, "80 kN.m"]

[controllers.open_loop]
kind = "open_loop"

[controllers.threshold]
kind = "threshold"
"""
PROTECTED = STRONG.replace("[run]", '[motor]\ntrip_speed = "50 m/s"\n\n[run]')
SWEEP = """
name = "Strong and weak"
source = "chosen"
scenario = "s.toml"
outcomes = ["largest_slip_speed", "slip_work"]

[axes.torque]
parameter = "demand.torque[1]"
values = ["20 kN.m", "80 kN.m"]
"""
CURE = "no vehicle survives that; lower the torque, let a controller hold the creepage, limit the "


@pytest.mark.parametrize(
    ("speed", "slip", "work", "duration", "warning"),
    [
        (60.0, 109.0, 1e6, 10.0, ""),
        (60.0, 111.0, 1e6, 10.0, "the run reaches a rim speed of 171 m/s: no vehicle"),
        (-60.0, -111.0, 1e6, 10.0, "the run reaches a rim speed of 171 m/s: no vehicle"),
        (60.0, -60.0, 1e6, 10.0, ""),  # a wheel that is locked
        (60.0, -60.0, 102e6, 10.0, "the run reaches a slip work of 102 MJ: no vehicle"),
        (20.0, 0.2, 300e6, 3600.0, ""),  # cooling carries it off
        (6.0, 61.0, 1e6, 10.0, "the run reaches a creepage of 1017 %: no vehicle"),
        (0.5, 20.0, 1e6, 10.0, ""),  # a wheel that spins as the train starts
        (19.0, 986.0, 164e6, 10.0, "rim speed of 1005 m/s, a slip work of 164 MJ, a creepage of 5"),
    ],
)
def test_what_no_vehicle_survives_is_warned_of(
    speed: float, slip: float, work: float, duration: float, warning: str
) -> None:
    row = np.ones(3)
    signals = {
        "speed": speed * row,
        "slip_velocity": slip * np.array([0.0, 1.0, 0.5]),
        "creepage": slip / abs(speed) * np.array([0.0, 1.0, 0.5]),
        "creep_work": work * np.array([0.0, 0.5, 1.0]),
    }
    run = cl.Result(np.array([0.0, 1.0, duration]), signals, dict.fromkeys(signals, "1"))
    if not warning:
        warn_of_damage(run)  # a warning would be an error
        return
    with pytest.warns(cl.InputWarning, match=re.escape(warning)) as caught:
        warn_of_damage(run)
    assert len(caught) == 1
    assert CURE in str(caught[0].message)


def test_every_kind_of_run_warns_once(locomotive: cl.Model, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(STRONG)
    scenario = cl.load_scenario(path)
    with pytest.warns(cl.InputWarning, match="the run reaches a rim speed of") as caught:
        run = cl.run_scenario(scenario, "open_loop")
    assert f"{np.abs(run['slip_velocity'] + run['speed']).max():.4g} m/s" in str(caught[0].message)
    assert caught[0].filename == __file__
    cl.run_scenario(scenario, "threshold")
    torque = cl.TorqueControl(cl.Profile((0.0, 0.1, 9.0), (0.0, 80e3, 80e3)))
    with pytest.warns(cl.InputWarning, match="the run reaches a rim speed of") as others:
        cl.simulate(locomotive.wheelset, torque, initial_speed=15.0)
    assert len(caught) == len(others) == 1
    path.write_text(PROTECTED)
    cl.run_scenario(cl.load_scenario(path), "open_loop")
    cl.run_many([replace(scenario, duration=1.0)], "open_loop", ["slip_work"])


def test_a_sweep_counts_such_runs(tmp_path: Path) -> None:
    path = write_sweep(tmp_path, SWEEP, STRONG)
    warning = (
        r"1 of 4 runs reach a slip speed of up to [3-9]\d\d\.\d m/s, 1 of 4 runs reach a slip w"
    )
    for _ in range(2):  # run, and read again
        with pytest.warns(cl.InputWarning, match=warning) as caught:
            cl.ensemble(path, output=tmp_path / "out", workers=1)
        assert len(caught) == 1
    path.write_text(SWEEP.replace('"80 kN.m"', '"21 kN.m"'))
    cl.ensemble(path, workers=1)
