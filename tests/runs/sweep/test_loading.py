"""Sweep files: mistakes, warnings and the shipped ones."""

from __future__ import annotations

import tomllib
from pathlib import Path

from sweep_files import SWEEP, write_sweep

from contactlib.base.writing import package_folder
from contactlib.runs import sweep

MODELS = package_folder("models").glob("*.toml")


SHIPPED = sorted(path.name for path in MODELS if "axes" in tomllib.loads(path.read_text()))


def test_a_sweep_of_analysis_alone_runs_nothing_and_else_all_controllers(tmp_path: Path) -> None:
    named = 'controllers = ["creep_pi", "open_loop"]\n'
    everyone = sweep.load_sweep(write_sweep(tmp_path, SWEEP.replace(named, "")))
    assert set(everyone.plan.controllers) == {"open_loop", "threshold", "creep_pi"}
    alone = SWEEP.replace(named, "").replace('"slip_work", ', "")
    assert sweep.load_sweep(write_sweep(tmp_path, alone)).simulated_time == 0.0
