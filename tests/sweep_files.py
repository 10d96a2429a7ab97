"""A sweep that takes a second, and the surroundings of commands that a test stops."""

from __future__ import annotations

import os
from pathlib import Path

import contactlib as cl
from contactlib.runs import Sweep

# Coverage does not count a process that a test stops: killed while it saves, it would leave half a
# file, and a handler of signals that is counted too waits for coverage's lock for ever.
UNCOUNTED = {k: v for k, v in os.environ.items() if not k.startswith("COVERAGE_PROCESS")}

SCENARIO = """name = "Quick"
source = "chosen"
wheelset = "locomotive.toml"

[wheelset_changes.friction]
slip_rate_residual = 0.857
slip_rate_decay = 0.60

[run]
initial_speed = 10.0
duration = 0.6

[demand]
time = [0.0, 0.1]
torque = ["10 kN.m", "23 kN.m"]

[track]
distance = [2.0, 2.0, 3.0, 3.0]
friction = [1.0, 0.5, 0.5, 1.0]

[sensors]
wheel_speed_noise = 0.01
vehicle_speed_noise = 0.02
delay = "10 ms"
seed = 1

[controllers.open_loop]
kind = "open_loop"

[controllers.threshold]
kind = "threshold"

[controllers.creep_pi]
kind = "creep_pi"
"""
SWEEP = """name = "Quick"
source = "chosen"
scenario = "s.toml"
controllers = ["creep_pi", "open_loop"]
outcomes = ["slip_work", "critical_torque", "clearing_time"]

[axes.patch]
parameter = ["track.friction[1]", "track.friction[2]"]
values = [0.5, 0.9]

[axes.inertia]
parameter = "vehicle.wheelset.inertia"
from = 200.0
to = 300.0
count = 3
"""
HEAD = SWEEP.partition("[axes")[0]
AXES = '[axes.x]\nparameter = "vehicle.wheelset.inertia"\nfrom = 200.0\nto = 300.0\n'
RANDOM = '[sampling]\nkind = "{}"\nruns = {}\nseed = {}\n'


def write_sweep(folder: Path, text: str = SWEEP, scenario: str = SCENARIO) -> Path:
    """Write a sweep and its scenario to a folder."""
    (folder / "s.toml").write_text(scenario)
    path = folder / "quick_sweep.toml"
    path.write_text(text)
    return path


def scenarios_of(sweep: Sweep) -> list[cl.Scenario]:
    return [sweep.scenario_of(run) for run in range(sweep.runs)]


def one_axis(tmp_path: Path, axis: str, scenario: str = SCENARIO) -> Path:
    """Write a sweep along one axis."""
    return write_sweep(tmp_path, f"{HEAD}[axes.x]\n{axis}\n", scenario)


def axis_values(tmp_path: Path, axis: str, scenario: str = SCENARIO) -> list[cl.Scenario]:
    return scenarios_of(cl.load_sweep(one_axis(tmp_path, axis, scenario)))


def chunks_kept(folder: Path) -> int:
    """Number of chunks of a sweep, which may be at work."""
    return len(list((folder / "quick_sweep.chunks").glob("*.chunk")))
