"""`simulate` and `tune`: what they print, what they write, and what they report before a run."""

from __future__ import annotations

import csv
import dataclasses
import json
import os
import re
import signal
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import pytest
from command_line import call, done, refused
from matplotlib.figure import Figure
from own_controller import SlipPI
from plain_scenario import controls, wet_patch

import contactlib as cl
from contactlib.cli import report
from contactlib.cli.commands import main
from contactlib.cli.report import outlook
from contactlib.files.scenario import ControllerDesign
from contactlib.runs import tuning
from contactlib.runs.outcomes import OUTCOMES, comparison_table
from contactlib.stability import reduced_plant
from contactlib.traction import OpenLoop, Sensors
from contactlib.vehicle import Axle, Drivetrain, Motor

OPEN = {"open_loop": OpenLoop()}
SHORT = """
name = "Short wet stretch"
source = "chosen"
wheelset = "locomotive.toml"

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


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("report")
    (folder / "short.toml").write_text(SHORT)
    command = "simulate", folder / "short.toml", "--compare", "--slip-limits", "0", "5 km/h"
    return folder, done(*command, "-o", folder / "out").output


def test_a_comparison_writes_all_it_promises(compared: tuple[Path, str]) -> None:
    folder, _ = compared
    names = {path.name for path in (folder / "out").iterdir()}
    stems = "plain", "cut", "plain.diagram", "cut.diagram", "comparison"
    figures = {f"{n}.{e}" for n in stems for e in ("png", "svg")}
    assert names == figures | {"plain.csv", "cut.csv"} | {
        f"metrics.{e}" for e in ("txt", "csv", "json")
    }


def test_the_numbers_are_those_of_the_runs(compared: tuple[Path, str]) -> None:
    folder, shown = compared
    case = cl.load_scenario(folder / "short.toml")
    written = json.loads((folder / "out" / "metrics.json").read_text())
    for name in ("plain", "cut"):
        run = cl.run_scenario(case, name)
        computed = cl.metrics(run, case.drivetrain)
        for key, value in computed._asdict().items():
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
    table = (folder / "out" / "metrics.txt").read_text()
    assert table.replace("the run", "1.5 s") in shown


@pytest.mark.slow
def test_a_vehicle_is_reported_as_a_whole_and_by_axle(tmp_path: Path) -> None:
    """Under a controller of the file and one of the user's own; 1.5 s of each."""
    shipped = cl.files.model_path("four_axles.toml").read_text()
    (tmp_path / "short.toml").write_text(shipped.replace("duration = 20.0", "duration = 1.5"))
    own = Path(__file__).parents[1] / "own_controller.py"
    command = "simulate", tmp_path / "short.toml", "--compare", "--controller", f"{own}:SlipPI"
    shown = done(*command, "--format", "png", "-o", tmp_path / "out").output
    each = ("csv", "png", "creep_curve.png", *(f"axles.{e}" for e in ("txt", "csv", "json")))
    names = {f"{n}.{e}" for n in ("open_loop", "creep_pi", "SlipPI") for e in each}
    names |= {"comparison.png", *(f"metrics.{e}" for e in ("txt", "csv", "json"))}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    case = cl.load_scenario(tmp_path / "short.toml")
    for name, controller in (("creep_pi", "creep_pi"), ("SlipPI", SlipPI())):
        run = cl.run_scenario(case, controller)
        with (tmp_path / "out" / f"{name}.csv").open() as file:
            head, *rows = csv.reader(file)
        columns = dict(zip(head, np.array(rows, np.float64).T, strict=True))
        np.testing.assert_array_equal(columns["time [s]"], run.time)
        for i, axle in enumerate(run.by_axle, start=1):
            np.testing.assert_array_equal(columns[f"creep_force_{i} [N]"], axle["creep_force"])
            np.testing.assert_array_equal(columns["speed [m/s]"], axle["speed"])
        written = json.loads((tmp_path / "out" / "metrics.json").read_text())[name]
        whole = cl.metrics(run, case.drivetrain)
        assert written["slip_work"]["value"] == whole.slip_work
        with (tmp_path / "out" / f"{name}.axles.csv").open() as file:
            lines = list(csv.DictReader(file))
        assert [line["axle"] for line in lines] == ["1", "2", "3", "4"]
        works = [float(line["slip_work [J]"]) for line in lines]
        assert sum(works) == pytest.approx(whole.slip_work, rel=1e-12)
        assert {line["energy_defect [1]"] for line in lines} == {"nan"}  # it closes in sum only
        assert (tmp_path / "out" / f"{name}.axles.txt").read_text().splitlines()[0].split() == [
            *("metric", "unit", "1", "2", "3", "4")
        ]
    assert "Axles under SlipPI:" in shown


@pytest.mark.parametrize("command", ["kernel", "table", "explore --no-open", "figures --stability"])
def test_what_takes_a_model_names_that_of_a_vehicle(command: str) -> None:
    error = refused(*command.split(), "four_axles.toml")
    assert "is a scenario, not a model: name its model, 'locomotive.toml'" in error


def test_a_continuous_controller_drives_no_vehicle() -> None:
    control = cl.load_scenario("torque_or_creep.toml").any_controller("torque")
    case = cl.load_scenario("four_axles.toml")
    with pytest.raises(ValueError, match=r"controllers\.own is continuous .* \[vehicle\]"):
        dataclasses.replace(case, controllers={"own": control})


def test_what_delays_rule_out_is_reported_before_anything_runs(compared: tuple[Path, str]) -> None:
    _, shown = compared
    lines = shown.splitlines()
    first_run = next(i for i, line in enumerate(lines) if line.startswith("..."))
    before = lines[:first_run]
    assert len(before) == 2  # worst and best friction
    for line, friction in zip(before, ("0.6", "1"), strict=True):
        assert line.startswith(f"falling branch at 10 m/s, friction factor {friction}, creepage")
        assert "impossible: pole" in line
        assert "no gain holds" in line


def test_the_outlook_is_that_of_the_loop() -> None:
    case = wet_patch()
    at_once = dataclasses.replace(case.drivetrain, motor=Motor(lag=0.0))
    quick = {"quick": OpenLoop(sample_time=1e-3)}
    for line in outlook(wet_patch(drivetrain=at_once, sensors=Sensors(), controllers=quick)):
        assert ": holds: pole" in line
    worst = cl.worst_pole(case.drivetrain.wheelset, speed=10.0)
    for lag in (0.0, 0.01):
        late = dataclasses.replace(case.drivetrain, motor=Motor(lag=lag))
        expected = cl.controllability(worst.pole, delay=0.01, lag=lag, sample_time=0.01)
        assert expected.text in outlook(wet_patch(drivetrain=late))[-1]


@pytest.mark.parametrize(
    ("start", "slow"), [(0.0, "0.1"), (-0.02, "0.1"), (2.0, "2"), (10.0, None), (30.0, None)]
)
def test_the_outlook_is_given_at_the_speed_of_the_start_too(start: float, slow: str | None) -> None:
    """A gain that holds at the design speed may not hold at the start: poles grow like 1/V."""
    quick = {"quick": OpenLoop(sample_time=1e-3)}
    case = wet_patch(sensors=Sensors(), controllers=quick, track=cl.Track())
    at_once = dataclasses.replace(case.drivetrain, motor=Motor(lag=0.0))
    case = dataclasses.replace(case, drivetrain=at_once, initial_speed=start, design_speed=10.0)
    design, *others = [line for line in outlook(case) if line.startswith("falling branch")]
    assert design.startswith("falling branch at 10 m/s,")
    assert ": holds: pole" in design
    assert len(others) == (slow is not None)
    if slow is None:
        return
    assert others[0].startswith(f"falling branch at {slow} m/s,")
    worst = cl.worst_pole(at_once.wheelset, speed=float(slow))
    plant = reduced_plant(at_once.wheelset, worst.creepage, speed=float(slow))
    expected = cl.controllability(
        worst.pole, zeros=plant.zeros, poles=plant.poles, delay=0.0, lag=0.0, sample_time=1e-3
    )
    assert expected.text in others[0]
    assert others[0].count(": holds") == (slow == "2")


@pytest.mark.parametrize(("name", "gains"), [("wsp", False), ("creep_pi", True)])
def test_the_outlook_gives_gains_to_what_has_one(name: str, gains: bool) -> None:
    """Valves have none; that a braked wheel locks by its pole is true of any."""
    coach = cl.load_scenario("coach_braking.toml")
    lines = outlook(dataclasses.replace(coach, controllers={name: ControllerDesign(name, {})}))
    wet, speed = coach.drivetrain.wheelset, coach.design_speed
    worst = cl.worst_pole(wet, speed=speed, friction_scale=coach.rails.highest[0])
    assert f"pole {worst.pole:.4g} 1/s" in lines[-1]
    assert all(("gain holds" in line or "g Kp" in line) == gains for line in lines)


def test_the_outlook_names_a_curve_that_does_not_fall(rig: cl.Model) -> None:
    case = cl.load_scenario("torsion.toml")
    friction = cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0)
    element = dataclasses.replace(rig.wheelset.element, friction=friction)
    wheelset = dataclasses.replace(rig.wheelset, element=element)
    plain = dataclasses.replace(case, drivetrain=Drivetrain(wheelset), controllers=OPEN)
    (line,) = outlook(plain)
    assert "no branch on which the wheel slips away under constant torque" in line


@pytest.mark.parametrize("memory", [False, True])
def test_the_outlook_warns_of_rolling_that_is_not_steady(memory: bool) -> None:
    """Of the slip-away and of the axle's vibration, without memory."""
    rigid = wet_patch().drivetrain
    element = dataclasses.replace(rigid.wheelset.element, memory=memory)
    rigid = Drivetrain(dataclasses.replace(rigid.wheelset, element=element))
    elastic = dataclasses.replace(rigid, axle=Axle(stiffness=6e6, damping=0.0))
    dry = wet_patch(track=cl.Track())
    steady = outlook(dataclasses.replace(dry, drivetrain=elastic))
    assert all("; reduced frequency p a/V 0.0" in line for line in steady)
    pole = cl.worst_pole(rigid.wheelset, speed=1.5).pole
    *_, last = outlook(dataclasses.replace(dry, drivetrain=rigid, design_speed=1.5))
    text = f"is not steady, and analysis is inaccurate: the largest rate, {pole:.3g} 1/s"
    assert (text in last) is not memory
    assert ("add memory = true to [contact]" in last) is not memory
    *_, last = outlook(dataclasses.replace(dry, drivetrain=elastic, design_speed=4.0))
    assert (f"the largest rate, {elastic.torsional_frequency:.3g} 1/s" in last) is not memory


def test_the_seed_may_be_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactlib.figures.scenario_run", lambda *given, **more: Figure())
    text = SHORT.replace(
        "[sensors]", "[sensors]\nvehicle_speed_noise = 0.1\nwheel_speed_noise = 0.1"
    )
    (tmp_path / "short.toml").write_text(text)

    def torque(*seed: str) -> str:
        done("simulate", tmp_path / "short.toml", "--control", "cut", *seed, "-o", tmp_path / "out")
        return (tmp_path / "out" / "cut.csv").read_text()

    assert torque() == torque("--seed", "0")  # the file's
    assert torque("--seed", "1") == torque("--seed", "1")
    assert torque("--seed", "1") != torque("--seed", "2")


def test_figures_may_be_drawn_over_the_distance(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT)
    for over, label in (("time", "time  [s]"), ("distance", "distance  [m]")):
        file, options = tmp_path / "short.toml", ("--over", over, "--format", "svg")
        done("simulate", file, *options, "-o", tmp_path / over)
        drawn = (tmp_path / over / "plain.svg").read_text()
        assert label.replace("  ", " ") in re.sub(" +", " ", drawn)
        assert "friction" in drawn
    assert "'place' is not one of 'time', 'distance'" in refused(
        "simulate", tmp_path / "short.toml", "--over", "place"
    )


def test_a_report_says_what_a_number_hides() -> None:
    """That a stop does not end, and that controllers got a wrong speed; an open loop gets none."""
    coach = dataclasses.replace(cl.load_scenario("coach_braking.toml"), duration=0.7)
    run = cl.run_scenario(coach, "wsp", tolerance=1e-4)
    table = comparison_table({"wsp": cl.metrics(run, coach.drivetrain)}, within="0.7 s")
    assert "- stopping distance: does not stop within 0.7 s" in table.splitlines()
    fastest = float(run["speed"].max())
    for share, name, doubted in ((0.049, "wsp", 0), (0.051, "wsp", 1), (0.9, "open_loop", 0)):
        lines = report.warning_of_speed(coach, name, run, share * fastest)
        assert len(lines) == doubted
        assert all(f"off by up to {share * fastest:.3g} m/s, 5% of" in line for line in lines)


def test_one_run_has_no_comparison(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT)
    done("simulate", tmp_path / "short.toml", "-o", tmp_path / "out")
    stems = {path.stem for path in (tmp_path / "out").iterdir()}
    assert stems == {"plain", "metrics"}  # the first in the file


@pytest.mark.slow
def test_runs_under_continuous_controllers_are_reported_too(rig: cl.Model, tmp_path: Path) -> None:
    name = "torque_or_creep_rig.toml"
    shown = done("simulate", name, "--control", "creep", "-o", tmp_path)
    assert "peak_passed" in shown.output
    assert {p.name for p in tmp_path.iterdir()} >= {"creep.csv", "creep.png", "creep.svg"}
    scenario, (ramp, held) = cl.load_scenario(name), controls("rig")
    run = cl.run_scenario(scenario, "torque", tolerance=1e-9)
    other = cl.simulate(rig.wheelset, ramp, initial_speed=10.0)
    np.testing.assert_allclose(run["creep_force"], other["creep_force"], rtol=1e-12)
    halves = run["creep_force_left"] + run["creep_force_right"]
    np.testing.assert_allclose(halves, run["creep_force"], rtol=1e-15)
    element = rig.wheelset.element
    assert run["available_force"].max() == pytest.approx(
        element.friction.kinetic * element.axle_load * 1.1350256, rel=1e-6
    )
    assert np.array_equal(run["demand"], other["drive_torque"])
    creep = cl.run_scenario(scenario, "creep")
    assert (creep["demand"] == held.torque_max).all()  # what it would like to have


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--control", "pid"), "contactlib: control = 'pid' must be one of: plain, cut"),
        (("--control", "cut", "--compare"), "contactlib: --control cut cannot be combined with "),
        (
            ("--slip-limits", "0", "600"),
            "contactlib: --slip-limits = 600.0 is out of range: must be ",
        ),
        (("--slip-limits", "1", "2 kN"), "contactlib: --slip-limits = '2 kN' must be a number in "),
    ],
)
def test_mistakes_are_one_line(arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT)
    error = refused("simulate", tmp_path / "short.toml", *arguments, "-o", tmp_path / "out")
    assert error.startswith(message)
    assert not (tmp_path / "out").exists()


# ---- contactlib tune ------------------------------------------------------------------------


@pytest.fixture
def short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of a short scenario with two controllers that declare settings."""
    (tmp_path / "short.toml").write_text(f'{SHORT}\n[controllers.pi]\nkind = "creep_pi"\n')
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_tune_reports_what_it_maximises_above_a_table_with_headings(short: Path) -> None:
    shown = done("tune", "short.toml", "cut", "--trials", "60", "-o", "out", "--format", "svg")
    lines = shown.output.splitlines()
    assert lines[1] == "The search tried 60 settings of each controller, for the largest mean of"
    for line, name in zip(lines[2:4], tuning.OBJECTIVE, strict=True):
        assert line == f"- {name.replace('_', ' ')}: {OUTCOMES[name].description}"
    assert lines[5].split() == ["limited", "utilisation", "utilisation"]
    assert lines[6].split() == ["controller", "scenario", *["designed", "tuned"] * 2]
    assert lines[7].split()[:4] == ["cut", "Short", "wet", "stretch"]
    assert len(lines[7].split()) == 4 + 4
    assert "Short wet stretch: limited utilisation, mean over noise (minimum)" in lines
    assert {path.name for path in (short / "out").iterdir()} == {
        "settings.toml",
        "errors.csv",
        "errors.txt",
        "errors.svg",
    }
    table = (short / "out" / "errors.txt").read_text()
    assert table in shown.output
    assert "vehicle speed -2 %" in table
    head, *rows = (short / "out" / "errors.csv").read_text().splitlines()
    assert head == "scenario,controller,error,noise,limited_utilisation"
    assert len(rows) == 14 * 10
    scenario = SHORT.split("[controllers")[0] + (short / "out" / "settings.toml").read_text()
    (short / "mine.toml").write_text(scenario)
    assert list(cl.load_scenario("mine.toml").controllers) == ["cut"]


OWN = """
import contactlib as cl

class Mine(cl.SampledController):
    sample_time = 0.01
    search_ranges = {"share": (0.1, 1.0)}

    def __init__(self, share=0.2):
        self.share = share

    def torque(self, measurement):
        return self.share * measurement.demand

class Bare(Mine):
    search_ranges = {}
"""


@pytest.mark.slow
def test_tune_takes_a_controller_of_the_user_s_own(short: Path) -> None:
    (short / "mine.py").write_text(OWN)
    given = ("--trials", "60", "-o", "out", "--format", "svg", "--controller")
    shown = done("tune", "short.toml", *given, "mine.py:Mine")
    assert "... Tuning Mine" in shown.output
    assert "cut" not in shown.output  # as with simulate, only it
    settings = (short / "out" / "settings.toml").read_text()
    assert settings.startswith("# Mine is a controller of your own: Mine(share=")
    both = done("tune", "short.toml", "cut", *given, "mine.py:Mine").output.splitlines()
    assert [line for line in both if "Tuning" in line] == ["... Tuning cut", "... Tuning Mine"]
    mixed = (short / "out" / "settings.toml").read_text()
    assert mixed.endswith(f"\n\n{settings}")
    assert list(tomllib.loads(mixed)["controllers"]) == ["cut"]
    assert refused("tune", "short.toml", *given, "mine.py:Bare") == (
        "contactlib: controller = 'Bare': the class Bare declares no settings to search: write "
        "into it search_ranges = {'share': (0.05, 0.8)}, the lowest and the highest value of each\n"
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--also", "same.toml"), "two of the scenarios have the name 'Short wet stretch'"),
        (("cut", "pid"), "controller = 'pid' must be one of the scenario's: plain, cut, pi"),
        (("cut", "plain"), "controller = 'plain' is an OpenLoop, which has no settings to search"),
        (("cut", "pi", "--also", "less.toml"), "controller = 'pi' must be one of the scenario's"),
        (("-o", "short.toml/out"), "[Errno 20] Not a directory: "),
        (("--trials", "59"), "59 is not in the range 60<=x<=1000000"),
    ],
)
def test_tune_refuses_before_it_searches(
    short: Path, monkeypatch: pytest.MonkeyPatch, given: tuple[str, ...], message: str
) -> None:
    monkeypatch.setattr(report, "tune", None)
    text = (short / "short.toml").read_text()
    (short / "same.toml").write_text(text)
    less = text.replace("[controllers.pi]", "[controllers.p]").replace("Short wet", "Other wet")
    (short / "less.toml").write_text(less)
    assert message in refused("tune", "short.toml", *given)
    assert not (short / "contactlib-tune-short").exists()


def test_the_options_of_a_search_have_its_limits() -> None:
    for option in main.commands["tune"].params:
        limits = {"trials": tuning.TRIALS, "seeds": tuning.SEEDS}.get(str(option.name))
        if limits is not None:
            assert isinstance(option.type, click.IntRange)
            assert (option.type.min, option.type.max) == (limits.at_least, limits.at_most)


@pytest.fixture
def search(short: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Searches that take no time: they find the design. Names in the list end the second one."""

    def instant_tune(scenarios: list[cl.Scenario], name: str, **_: object) -> tuning.Tuning:
        assert (short / "out").is_dir()  # before the first search
        if name in interrupted:
            os.kill(os.getpid(), signal.SIGINT)
        (design,) = tuning.searched(scenarios, name)
        numbers = np.ones((1, 2, 1))
        factors = dict.fromkeys(design.ranges, 1.0)
        return tuning.Tuning(factors, (design.control,), numbers, numbers, 60)

    interrupted: list[str] = []
    monkeypatch.setattr(report, "tune", instant_tune)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield interrupted
    signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_keeps_the_controllers_that_are_tuned(short: Path, search: list[str]) -> None:
    search.append("pi")
    shown = call("tune", "short.toml", "-o", "out")
    assert shown.exit_code == 130
    assert shown.stderr == "contactlib: interrupted\n"
    settings = Path("out/settings.toml")
    assert shown.stdout.endswith(f"Stopped. The settings of cut are in {settings}\n")
    assert list(tomllib.loads(settings.read_text())["controllers"]) == ["cut"]
    search.append("cut")
    shown = call("tune", "short.toml", "-o", "again/out")
    assert (shown.exit_code, shown.stdout) == (130, "... Tuning cut\n")
    assert not (short / "again" / "out").exists()


def test_settings_are_written_before_anything_is_formatted(
    short: Path, search: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(rows: object) -> str:
        raise TypeError

    monkeypatch.setattr(report, "fixed_width", fails)
    shown = call("tune", "short.toml", "-o", "out")
    assert isinstance(shown.exception, TypeError)
    settings = (short / "out" / "settings.toml").read_text()
    assert list(tomllib.loads(settings)["controllers"]) == ["cut", "pi"]
