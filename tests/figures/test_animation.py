"""The animation of runs: its frames, and the curve on which the point moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from numpy.testing import assert_allclose
from PIL import Image

import contactlib as cl
from contactlib.figures import animate_runs
from contactlib.figures.animation import RATE
from contactlib.figures.vehicle import curve_at


def test_an_animation_shows_runs_on_their_curves(tmp_path: Path) -> None:
    scenario = replace(cl.load_scenario("dry_wet_dry.toml"), duration=4.0)
    runs = {name: cl.run_scenario(scenario, name) for name in ("open_loop", "creep_pi")}
    wheelset = scenario.drivetrain.wheelset
    with Image.open(animate_runs(runs, wheelset, tmp_path / "x.gif", seconds=1.0)) as file:
        assert getattr(file, "n_frames", 1) == RATE  # those that differ
        assert file.info["duration"] == 1000 // RATE
    # Steady rolling on the rails of that moment: the controlled wheel is on its curve.
    run, row = runs["creep_pi"], -1
    assert run["friction_scale_left"][row] == 0.545
    used = run["creep_force"][row] / run["axle_load"][row]
    assert_allclose(curve_at(wheelset, run, row, run["creepage"][[row]]), used, rtol=0.01)
    with pytest.raises(ValueError, match=r"seconds = 0\.5 is out of range"):
        animate_runs(runs, wheelset, tmp_path / "y.gif", seconds=0.5)
    assert not (tmp_path / "y.gif").exists()
