"""Sweep files: mistakes, warnings and the shipped ones."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path

import pytest
from command_line import refused
from sweep_files import AXES, HEAD, SCENARIO, SWEEP, write_sweep

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.element import ProcessZoneWarning

MODELS = package_folder("models").glob("*.toml")
SHIPPED = sorted(path.name for path in MODELS if "axes" in tomllib.loads(path.read_text()))


def test_a_sweep_of_analysis_alone_runs_nothing_and_else_all_controllers(tmp_path: Path) -> None:
    named = 'controllers = ["creep_pi", "open_loop"]\n'
    everyone = cl.load_sweep(write_sweep(tmp_path, SWEEP.replace(named, "")))
    assert set(everyone.plan.controllers) == {"open_loop", "threshold", "creep_pi"}
    of_analysis = SWEEP.replace(named, "").replace('"slip_work", ', "")
    assert cl.load_sweep(write_sweep(tmp_path, of_analysis)).simulated_time == 0.0


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('scenario = "s.toml"', 'scenario = "t.toml"', "t.toml: no such file"),
        ('scenario = "s.toml"', 'scenario = "../s.toml"', "must lie beside the sweep"),
        ('scenario = "s.toml"', 'scenario = "roller_rig.toml"', "is a model, not a scenario"),
        ('"slip_work"', '"slip_wrok"', "did you mean 'slip_work'"),
        ('"slip_work"', '"distance", "distance"', "a name twice"),
        ('["creep_pi", "open_loop"]', '["pid"]', "'pid' is not known"),
        ('["creep_pi", "open_loop"]', "[]", "controllers = [] must be a list of at least one name"),
        ('["slip_work", ', "[", "no controller runs, as all outcomes come from the analysis"),
        (SWEEP[SWEEP.index("[axes") :], "axes = {}\n", "axes: give at least one, [axes.NAME]"),
        ("outcomes", "outcome", "outcome is not a known key; did you mean 'outcomes'"),
        ("[axes.inertia]", "[axes.slip_work]", "not be the name of an outcome"),
        ("[axes.inertia]", "[axes.run]", "'run' is not a name"),
        ("[axes.inertia]", "[axes.string9]", "'string9' is not a name"),
        ("track.friction[1]", "track.friction[2]", "set by axes.patch already"),
        ("[axes.patch]", '[sampling]\nkind = "monte_carlo"\n[axes.patch]', "runs is missing"),
        ("[axes.patch]", "[sampling]\nseed = 1\n[axes.patch]", "runs is missing"),
        ("[axes.patch]", "[sampling]\nruns = 2\nseed = 1\n[axes.patch]", "and none has one"),
        ("[axes.patch]", "limit = [9.0, 9.0, 9.0]\n[axes.patch]", "it must have 0 or 1 or 2 or 6"),
        ('name = "Quick"', 'redesign = 1\nname = "Quick"', "redesign = 1 must be true or false"),
        ("[axes.patch]", "[axes.patch", "at line"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert old in SWEEP
    path = write_sweep(tmp_path, SWEEP.replace(old, new, 1))
    if expected.startswith("set by"):
        path.write_text(SWEEP.replace(old, new))
    with pytest.raises(cl.ModelError) as caught:
        cl.load_sweep(path)
    message = str(caught.value)
    assert expected in message
    assert message.startswith(f"{path}: ")


def test_each_kind_of_file_names_its_command() -> None:
    for command, name, expected in (
        ("simulate", SHIPPED[0], "'contactlib sweep' runs it"),
        ("table", SHIPPED[0], "'contactlib sweep' runs it"),
        ("sweep", "roller_rig.toml", "is a model; a sweep names a scenario"),
        ("sweep", "sanding.toml", "is a scenario, which the command 'contactlib simulate' runs"),
    ):
        assert expected in refused(command, name)


def test_a_file_may_begin_with_the_mark_of_its_encoding(tmp_path: Path) -> None:
    plain = cl.load_sweep(path := write_sweep(tmp_path))
    for file in (path, tmp_path / "s.toml"):
        file.write_text(file.read_text(), encoding="utf-8-sig")
    marked = cl.load_sweep(path)
    assert marked.text == plain.text
    assert marked.plan.digest(marked.values) == plain.plan.digest(plain.values)


def test_warnings_at_the_ends_are_counted(tmp_path: Path) -> None:
    # Friction falls far enough at both values of one axis, whatever the other is.
    axes = AXES.replace("from = 200.0\nto = 300.0", "values = [200.0, 300.0]")
    axes += '[axes.y]\nparameter = "vehicle.friction.k_hat"\nvalues = [0.3, 1.5]\n'
    with pytest.warns(ProcessZoneWarning, match="2 of 4 runs at the ends"):
        cl.load_sweep(write_sweep(tmp_path, HEAD + axes))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_sweeps_load_and_their_ends_can_run(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sweep = cl.load_sweep(name)
    assert sweep.source
    assert sweep.runs <= 1000


@pytest.mark.parametrize("broken", ["its scenario", "its axes"])
def test_all_mistakes_of_a_sweep_come_at_once(broken: str, tmp_path: Path) -> None:
    bad = SCENARIO.replace("duration = 0.6", 'duration = "0.6 m"').replace("seed", "sed")
    (tmp_path / "s.toml").write_text(bad if broken == "its scenario" else SCENARIO)
    text = SWEEP.replace('"slip_work"', '"slip_wrk"').replace("to = 300.0", 'to = "300 kg"')
    path = tmp_path / "quick.toml"
    path.write_text(f"redesig = true\ntolerance = -1\n{text}")
    with pytest.raises(cl.ModelError) as caught:
        cl.load_sweep(path)
    lines = [line.partition("quick.toml: ")[2] for line in caught.value.lines]
    expected = {
        "its scenario": ["scenario s.toml: run.dur", "scenario s.toml: sensors.sed", "outcomes:"],
        "its axes": ["outcomes:", "axes.inertia: to"],
    }[broken]
    assert len(lines) == 2 + len(expected), lines
    for line, start in zip(lines, ["redesig", "tolerance", *expected], strict=True):
        assert line.startswith(start), line
