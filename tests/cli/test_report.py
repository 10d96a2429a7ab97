"""`contactlib simulate`: what it says, what it writes, and what it knows before it runs."""

from __future__ import annotations

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from matplotlib.figure import Figure

import contactlib as cl
from contactlib.cli.commands import main
from contactlib.runs.study import as_scenario_run, open_study, outlook
from contactlib.traction import OpenLoop, Sensors

OPEN = {"open_loop": OpenLoop()}
SHORT = """
name = "Short wet stretch"
source = "chosen"
vehicle = "locomotive.toml"

[motor]
lag = "5 ms"

[run]
initial_speed = 10.0
duration = 1.5

[demand]
time = [0.0]
torque = ["24 kN.m"]

[track]
distance = [3.0, 3.0, 5.0, 5.0]
friction = [1.0, 0.6, 0.6, 1.0]

[sensors]
delay = "10 ms"

[controllers.plain]
kind = "open_loop"

[controllers.cut]
kind = "threshold"
"""


def simulate(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["simulate", *map(str, arguments)])


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("report")
    (folder / "short.toml").write_text(SHORT)
    shown = simulate(folder / "short.toml", "--compare", "-o", folder / "out")
    assert shown.exit_code == 0, shown.output
    return folder, shown.output


def test_a_comparison_writes_all_it_promises(compared: tuple[Path, str]) -> None:
    folder, _ = compared
    names = {path.name for path in (folder / "out").iterdir()}
    figures = {f"{n}.{e}" for n in ("plain", "cut", "comparison") for e in ("png", "svg")}
    assert names == figures | {"plain.csv", "cut.csv"} | {
        f"metrics.{e}" for e in ("txt", "csv", "json")
    }


def test_the_numbers_are_those_of_the_runs(compared: tuple[Path, str]) -> None:
    folder, shown = compared
    case = cl.load_scenario(folder / "short.toml")
    written = json.loads((folder / "out" / "metrics.json").read_text())
    for name in ("plain", "cut"):
        run = cl.run_scenario(case, name)
        found = cl.metrics(run, case.drivetrain)
        for key, value in found._asdict().items():
            stored = written[name][key]["value"]
            if np.isfinite(value):
                assert stored == value
                assert f"{value:.5g}" in shown
            else:
                assert stored in (None, "never")
        with (folder / "out" / f"{name}.csv").open() as file:
            head, *rows = csv.reader(file)
        assert head[0] == "time [s]"
        column = head.index("creepage [1]")
        np.testing.assert_array_equal([float(row[column]) for row in rows], run["creepage"])
    assert (folder / "out" / "metrics.txt").read_text() in shown


def test_what_delays_rule_out_is_said_before_anything_runs(compared: tuple[Path, str]) -> None:
    _, shown = compared
    lines = shown.splitlines()
    first_run = next(i for i, line in enumerate(lines) if line.startswith("..."))
    said = lines[:first_run]
    assert len(said) == 2  # worst and best friction
    for line, friction in zip(said, ("0.6", "1"), strict=True):
        assert line.startswith(f"falling branch at 10 m/s, friction factor {friction}, creepage")
        assert "impossible: pole" in line
        assert "no gain holds" in line


def test_the_outlook_is_that_of_the_loop() -> None:
    case = cl.load_scenario("dry_wet_dry.toml")
    quick = dataclasses.replace(
        case,
        drivetrain=dataclasses.replace(case.drivetrain, motor=cl.Motor(lag=0.0)),
        sensors=Sensors(),
        controllers={"quick": dataclasses.replace(case.controller("open_loop"), sample_time=1e-3)},  # type: ignore[type-var]
    )
    for line in outlook(quick):
        assert ": holds: pole" in line
    worst = cl.worst_pole(case.drivetrain.wheelset, speed=10.0)
    for lag in (0.0, 0.01):
        late = dataclasses.replace(
            case, drivetrain=dataclasses.replace(case.drivetrain, motor=cl.Motor(lag=lag))
        )
        relaxation = case.drivetrain.relaxation_length / 10.0
        said = cl.controllability(
            worst.pole, delay=0.01, lag=lag, relaxation=relaxation, sample_time=0.01
        )
        assert said.text in outlook(late)[-1]


def test_the_outlook_knows_when_nothing_falls(rig: cl.Model) -> None:
    case = cl.load_scenario("torsion.toml")
    friction = cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0)
    element = dataclasses.replace(rig.wheelset.element, friction=friction)
    wheelset = dataclasses.replace(rig.wheelset, element=element)
    plain = dataclasses.replace(case, drivetrain=cl.Drivetrain(wheelset), controllers=OPEN)
    (said,) = outlook(plain)
    assert "no branch on which a constant torque runs away" in said


def test_the_seed_may_be_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactlib.figures.scenario_run", lambda *given, **more: Figure())
    text = SHORT.replace(
        "[sensors]", "[sensors]\nvehicle_speed_noise = 0.1\nwheel_speed_noise = 0.1"
    )
    (tmp_path / "short.toml").write_text(text)

    def torque(*seed: str) -> str:
        shown = simulate(tmp_path / "short.toml", "--control", "cut", *seed, "-o", tmp_path / "out")
        assert shown.exit_code == 0, shown.output
        return (tmp_path / "out" / "cut.csv").read_text()

    assert torque() == torque("--seed", "0")  # the file's
    assert torque("--seed", "1") == torque("--seed", "1")
    assert torque("--seed", "1") != torque("--seed", "2")


def test_one_run_has_no_comparison(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT)
    shown = simulate(tmp_path / "short.toml", "-o", tmp_path / "out")
    assert shown.exit_code == 0, shown.output
    stems = {path.stem for path in (tmp_path / "out").iterdir()}
    assert stems == {"plain", "metrics"}  # the first in the file


@pytest.mark.slow
def test_a_model_s_own_runs_are_reported_too(rig: cl.Model, tmp_path: Path) -> None:
    shown = simulate("roller_rig.toml", "--control", "creep", "-o", tmp_path)
    assert shown.exit_code == 0, shown.output
    assert "peak_passed" in shown.output
    assert {p.name for p in tmp_path.iterdir()} >= {"creep.csv", "creep.png", "creep.svg"}
    study = open_study("roller_rig.toml")
    run = study.runs["torque"](lambda part: None)
    other = cl.simulate(rig.wheelset, rig.torque_control, initial_speed=10.0)
    np.testing.assert_allclose(run["creep_force"], other["creep_force"], rtol=1e-12)
    halves = run["creep_force_left"] + run["creep_force_right"]
    np.testing.assert_allclose(halves, run["creep_force"], rtol=1e-15)
    element = rig.wheelset.element
    assert run["available_force"].max() == pytest.approx(
        element.friction.kinetic * element.normal_load * 1.1350256, rel=1e-6
    )
    held = as_scenario_run(other, study.drivetrain, rig.torque_control)
    assert np.array_equal(held["demand"], other["drive_torque"])
    creep = study.runs["creep"](lambda part: None)
    assert (creep["demand"] == rig.creep_control.torque_max).all()  # what it would like to have


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--control", "pid"), "contactlib: control = 'pid' must be one of: plain, cut"),
        (("--control", "cut", "--compare"), "contactlib: --control cut cannot be combined with "),
    ],
)
def test_mistakes_are_one_line(arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT)
    shown = simulate(tmp_path / "short.toml", *arguments, "-o", tmp_path / "out")
    assert shown.exit_code == 2
    assert shown.stderr.startswith(message)
    assert shown.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()
