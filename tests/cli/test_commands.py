"""The commands, as a user types them."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import re
import shlex
import time
import warnings
import zipfile
from pathlib import Path

import click
import pytest
from command_line import call, done, refused
from matplotlib.figure import Figure
from rich.console import Console
from sweep_files import write_sweep

import contactlib as cl
from contactlib import figures
from contactlib.base.text import printable_line
from contactlib.cli.commands import main
from contactlib.cli.console import ConsoleReporter, Pace
from contactlib.element import ProcessZoneWarning
from contactlib.figures import CONTACT_PATCH, PAPER_FIGURES, STABILITY_FIGURES
from contactlib.files.reading import model_path
from contactlib.runs import benchmarking


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("demo") / "out"
    return folder, done("demo", "--output", folder).output


@pytest.mark.slow
def test_demo_writes_all_it_promises(shown: tuple[Path, str]) -> None:
    folder, _ = shown
    names = {path.name for path in folder.iterdir()}
    for model in ("roller_rig", "locomotive"):
        for kind in ("creep_curve", "time_histories", "fold_diagram"):
            for suffix in ("png", "svg"):
                assert f"{model}_{kind}.{suffix}" in names
        for control in ("torque", "creep"):
            assert f"{model}_{control}_control.csv" in names
    others = {"CreepForceElement.fmu", "creep_table.bin", "explorer.html", "summary.json"}
    assert others <= names
    assert cl.CreepForceTable.load(folder / "creep_table.bin").max_error <= 1e-6


@pytest.mark.slow
def test_demo_s_numbers_are_right_and_all_in_the_summary(shown: tuple[Path, str]) -> None:
    folder, output = shown
    summary = json.loads((folder / "summary.json").read_text())
    rows = iter(output.splitlines())  # the sections and numbers stand in the same order
    for section in summary.values():
        assert section["title"] in rows
        for number in section["numbers"].values():
            line = next(row for row in rows if number["label"] in row)
            assert f"{number['value']:.6g}" in line

    def value(section: str, key: str) -> float:
        return float(summary[section]["numbers"][key]["value"])

    assert 0.0 < value("table", "max_error") <= 1e-6  # the table of an ellipse, no closed form
    assert value("table", "max_slope_error") <= 1e-4
    assert value("table", "peak_creepage") == pytest.approx(1.0079, abs=1e-4)
    assert value("table", "peak_ratio") == pytest.approx(1.15162, abs=1e-5)
    # Between the errors of strips against CONTACT: at a/b 1 without weakening, at 2 with k_hat 0.3.
    assert 0.085 < value("locomotive", "half_space_gain") < 0.23
    rig = "roller_rig"
    assert value(rig, "critical_torque_simulated") == pytest.approx(
        value(rig, "steady_torque"), rel=1e-3
    )
    for model in ("roller_rig", "locomotive"):
        assert abs(value(model, "critical_torque_difference")) < 1e-3
        assert value(model, "open_loop_pole") > 10.0
        assert value(model, "held_deviation") < 1e-5
        assert value(model, "gain") > value(model, "smallest_gain") > 0.0
    size = (folder / "explorer.html").stat().st_size / 1e3
    assert value("explorer", "size") == pytest.approx(size)
    assert value("fmu", "against_kernel") <= 1e-9


def test_bad_model_is_a_line_for_each_mistake_and_status_2(tmp_path: Path) -> None:
    name = "b\na\x1bd.toml" if os.name == "posix" else "bad.toml"
    path, shown = tmp_path / name, tmp_path / printable_line(name)
    path.write_text('name = "x"\nsource = "y"\n')
    for command in ("table", "fmu"):
        result = call(command, path, "-o", tmp_path / "out")
        assert result.exit_code == 2
        assert result.stderr.splitlines() == [  # all mistakes at once
            f"contactlib: {shown}: {section} is missing"
            for section in ("contact", "wheelset", "friction")
        ]
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("fmu roller_rig.toml --fmi3", "No such option:? '?--fmi3"),
        ("table roller_rig.toml --error '8 m/s'", "'8 m/s' must be a number in"),
        ("fmu roller_rig.toml -o none/x.fmu", r"no such folder to write to: .*x\.fmu"),
        *(
            (
                f"fmu roller_rig.toml --ssp {option}",
                f"^contactlib: --ssp cannot be combined with {name}$",
            )
            for option in ("--kind wheelset", "--implicit", "--parallel-exchange")
            for name in option.split()[:1]
        ),
        ("table roller_rig.toml --largest-creepage a", "'a' does not begin with a num"),
        (
            "table roller_rig.toml -o x.csv --load '22.5 t'",
            "--load = '22.5 t' is a mass; its weight is",
        ),
        (
            "table roller_rig.toml -o x.csv --speed 1:2:3",
            "--speed = '1:2:3' must be a range of two numbers",
        ),
        ("table roller_rig.toml -o x.csv --rebuild", r"--rebuild is for a file that ends in \.bin"),
        (
            "table roller_rig.toml -o x.bin --speed 5",
            r"--speed is for a file that ends in \.csv, \.mat",
        ),
        (
            "table roller_rig.toml -o x.txt",
            r"x\.txt: the ending must be one of: \.csv, \.mat, \.nc, \.bin",
        ),
        ("demo -o file/below", "file"),
        ("simulate no_such.toml", r"no_such\.toml"),
        ("sweep x.toml --controller mine.py", "^contactlib: --controller mine.py must be FILE"),
        *(
            (f"{command} --format png,docx", "^contactlib: --format = 'docx' must be one of: .*$")
            for command in ("simulate x", "sweep x", "figures --paper")
        ),
        *(
            (f"rails log.csv dry_wet_dry.toml --prior {prior}", message)
            for prior, message in {
                "mass": "--prior mass must be NAME=VALUE",
                "weight=1": "--prior: no constant is 'weight'; ",
                "'delay=2 kg'": "--prior delay = '2 kg' must be a number in s, or a number and one",
                "mass=300%": "LogPriors.mass = 3.0 is out of range: must be finite and >= 0 and",
            }.items()
        ),
        ("figures", "^contactlib: figures: pass --paper or --stability, or both$"),
        ("figures --paper -o file", "file"),
        ("figures --stability no_such_model.toml", r"no_such_model\.toml"),
    ],
)
def test_a_mistake_is_one_line_and_writes_nothing(
    command: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    assert re.search(message, refused(*shlex.split(command)))
    assert {path.name for path in tmp_path.iterdir()} == {"file"}


@pytest.mark.filterwarnings("always::contactlib.InputWarning")
@pytest.mark.parametrize(
    ("command", "file", "option", "forgotten", "right", "doubt"),
    [
        ("table", "c.csv", "--load", "11", "11 kN", "--load = 11 N is implausible"),
    ],
)
def test_an_option_without_its_unit_is_warned_of(
    command: str, file: str, option: str, forgotten: str, right: str, doubt: str, tmp_path: Path
) -> None:
    for text, lines in ((forgotten, 1), (right, 0)):
        result = done(command, "roller_rig.toml", "-o", tmp_path / file, option, text)
        assert result.stderr.count(doubt) == lines


def test_export_reports_the_largest_step_over_which_the_force_may_be_held(
    tmp_path: Path, rig: cl.Model
) -> None:
    # The pole of a wheelset with this force on each of its wheels, without slip.
    wheelset = rig.wheelset
    gradient = wheelset.element.evaluate(omega=10.0 / wheelset.radius, speed=10.0)["force_gradient"]
    longest = 2e3 / float(gradient * wheelset.effective_inverse_mass)
    note = (
        f"Largest stable step at 10 m/s: {longest:.2g} ms if both sides step in turn, "
        f"{0.5 * longest:.2g} ms if they step at once; with --implicit, any\n"
    )
    cases: tuple[tuple[list[str], bool], ...] = (
        ([], True),
        (["--fmi", "2.0", "--parallel-exchange"], True),
        (["--fmi", "3.0", "--implicit"], False),
        (["--kind", "wheelset"], False),
    )
    for options, held in cases:
        path = tmp_path / "x.fmu"
        result = done("fmu", "roller_rig.toml", *options, "-o", path)
        assert result.stderr == ""
        assert result.stdout == (note if held else "") + f"{path}\n"
        version = options[1] if "--fmi" in options else "2.0"
        with zipfile.ZipFile(path) as fmu:
            assert f'fmiVersion="{version}"'.encode() in fmu.read("modelDescription.xml")


def test_options_take_units(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    for text in ("15 %", "0.15"):
        done("table", "roller_rig.toml", "-o", path, "--largest-creepage", text)
        assert path.read_text().splitlines()[-1].startswith("0.15,")


KINDS = ("png", "svg", "csv")  # of the files of a figure


def test_figures_command_writes_the_papers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    papers = {number: figure._replace(draw=Figure) for number, figure in PAPER_FIGURES.items()}
    monkeypatch.setattr(figures, "PAPER_FIGURES", papers)
    monkeypatch.setattr(figures, "CONTACT_PATCH", CONTACT_PATCH._replace(draw=Figure))
    folder = tmp_path / "deep" / "out"
    result = done("figures", "--paper", "-o", folder)
    stems = [f"paper_figure_{number}" for number in range(1, 7)] + ["contact_patch"]
    assert {p.name for p in folder.iterdir()} == {f"{s}.{e}" for s in stems for e in KINDS}
    for stem, line in zip(stems, result.output.splitlines(), strict=True):
        paths, _, sentence = line.partition(": ")
        assert paths == f"{folder / stem}.png, {stem}.svg, {stem}.csv"
        assert sentence.endswith(".")


@pytest.mark.slow
@pytest.mark.parametrize("model", ["", "locomotive.toml"])
def test_figures_command_draws_a_models_stability(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: str
) -> None:
    quick = {"poles": STABILITY_FIGURES["poles"]}
    monkeypatch.setattr(figures, "STABILITY_FIGURES", quick)
    result = done("figures", "--stability", *filter(None, [model]), "-o", tmp_path)
    path = tmp_path / "stability_poles"
    assert (
        result.output == f"{path}.png, {path.name}.svg, {path.name}.csv: {quick['poles'].title}\n"
    )
    held = "held" in path.with_suffix(".svg").read_text()
    assert held == (model == "")  # on the roller rig


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ["figures", "--stability"],
        ["simulate", "torque_or_creep_rig.toml", "--control", "creep"],
        ["sweep", "SWEEP", "--workers", "1"],
    ],
    ids=lambda command: command[0],
)
def test_figures_have_the_formats_and_captions_that_are_requested(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    monkeypatch.setattr(figures, "STABILITY_FIGURES", {"poles": STABILITY_FIGURES["poles"]})
    command = [str(write_sweep(tmp_path)) if word == "SWEEP" else word for word in command]

    def lines_of_text(*options: str) -> list[int]:
        folder = tmp_path / f"out{len(options)}"
        done(*command, "--format", "SVG, eps", "-o", folder, *options)
        drawn = sorted(folder.glob("*.svg"))
        assert drawn
        assert [path.stem for path in sorted(folder.glob("*.eps"))] == [p.stem for p in drawn]
        assert not list(folder.glob("*.png"))
        slides = [re.search('width="720pt" height="540pt"', path.read_text()) for path in drawn]
        assert all(slides) == ("--size" in options)
        return [path.read_text().count("<text") for path in drawn]

    usual, bare = lines_of_text("--size", "4:3"), lines_of_text("--no-caption")
    assert all(few < many for few, many in zip(bare, usual, strict=True))


def test_a_figure_that_cannot_be_drawn_leaves_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> Figure:
        raise ValueError("nothing to see")

    poles = STABILITY_FIGURES["poles"]
    both = {"refused": poles._replace(draw=refuse), "poles": poles}
    monkeypatch.setattr(figures, "STABILITY_FIGURES", both)
    result = call("figures", "--stability", "-o", tmp_path)
    assert result.exit_code == 1
    assert result.stderr == "contactlib: no stability_refused: nothing to see\n"
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {f"stability_poles.{kind}" for kind in KINDS}


@pytest.mark.slow
def test_stability_figures_without_a_fold_are_drawn_as_far_as_possible(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each refusal is one line that names what to change in the file."""
    monkeypatch.chdir(tmp_path)
    level = re.sub("static = .*", "static = 0.21", model_path("roller_rig.toml").read_text())
    Path("level.toml").write_text(re.sub("k_hat = .*", "k_hat = 0", level))
    result = call("figures", "--stability", "level.toml", "--format", "svg", "-o", "out")
    assert result.exit_code == 1
    names = {path.name for path in Path("out").iterdir()}
    assert names == {"stability_creep_curve.svg", "stability_creep_curve.csv"}
    refused = [name for name in STABILITY_FIGURES if name != "creep_curve"]
    lines = result.stderr.splitlines()
    for name, line in zip(refused, lines, strict=True):
        assert line.startswith(f"contactlib: no stability_{name}: ")
        assert line.endswith(
            "friction does not fall, as static = kinetic = 0.21: it needs friction.static > "
            "friction.kinetic"
        )


def test_table_is_rebuilt_from_the_law(tmp_path: Path) -> None:
    result = done("table", "roller_rig.toml", "--rebuild", "-o", tmp_path / "t.bin")
    assert "CarterGriffith contact=line, largest error found" in result.output
    assert cl.CreepForceTable.load(tmp_path / "t.bin").max_error < 1e-13


def test_help_and_version() -> None:
    for command in ("demo", "fmu"):
        done(command, "-h")
    assert "wet_patch_sweep.toml" in done("--help").output
    assert "contactlib" in done("--version").output


def test_a_terminal_shows_bars_and_the_rest_lines() -> None:
    shown = io.StringIO()
    reporter = ConsoleReporter()
    reporter._console = Console(file=shown, force_terminal=True, width=120)
    pace = Pace()
    with reporter.step("Drawing [1]") as progress:
        progress(1.0)
    with reporter.countdown("Running", pace) as progress:
        for part in (0.2, 0.6):
            progress(part)
            time.sleep(1e-3)
    assert "Drawing [1]" in shown.getvalue()
    assert "100%" in shown.getvalue()
    assert "60%" in shown.getvalue()
    assert pace.part == pytest.approx(0.4)


def test_warnings_are_lines_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    @click.command()
    def warns() -> None:
        warnings.warn("mind the gap", ProcessZoneWarning, stacklevel=1)

    monkeypatch.setitem(main.commands, "warns", warns)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        shown = call("warns")
    assert (shown.exit_code, shown.stderr) == (0, "warning: mind the gap\n")


def test_benchmark_scores_a_controller_of_the_user_s_own_beside_the_shipped_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    extent = benchmarking.Extent(("torque_step",), ("as in the file",), 2)
    scenario = dataclasses.replace(cl.load_scenario("torque_step.toml"), duration=5.0)
    monkeypatch.setattr(benchmarking, "SMALL", extent)
    monkeypatch.setattr(benchmarking, "load_scenario", lambda _: scenario)
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text("from contactlib.traction import OpenLoop as Mine\n")
    shown = done("benchmark", "--small", "--controller", "mine.py:Mine", "--trials", "0").output
    table = Path("contactlib-benchmark", "benchmark.txt").read_text()
    assert table in shown
    assert table.startswith("contactlib benchmark 2 (small), seed 1: 2 runs each\ncontroller  ")
    names = [line.split()[0] for line in table.splitlines()[3:7]]
    assert names == [*benchmarking.SHIPPED, "Mine"]
    assert "--trials 3 needs --controller" in refused("benchmark", "--trials", "3")
    assert "--controller nothing" in refused("benchmark", "--controller", "nothing")
