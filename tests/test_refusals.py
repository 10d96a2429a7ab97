"""What is refused, and in which words, where nothing else comes by; and what a terminal shows."""

from __future__ import annotations

import dataclasses
import io
import pickle
import time
import warnings
import zipfile
from importlib import metadata
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from lxml import etree
from rich.console import Console
from sweep_files import SCENARIO, SWEEP, write_sweep

import contactlib as cl
from contactlib import cli, control_systems, explorer, kernel, sweep
from contactlib.checker.archive import read_archive
from contactlib.checker.description import fmi_version
from contactlib.export import documentation
from contactlib.figures.setting import drivetrain_setting
from contactlib.outcomes.sums import _known
from contactlib.sweep.store import _read_plan

# ---- files ----------------------------------------------------------------------------------


def test_an_fmu_s_entry_that_nobody_can_unpack_is_a_problem(tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", "<x/>")
    data = bytearray(path.read_bytes())
    for signature, offset in ((b"PK\3\4", 8), (b"PK\1\2", 10)):
        data[data.index(signature) + offset] = 99  # a method of compression that there is not
    path.write_bytes(data)
    problems = read_archive(path).problems
    assert problems[0].endswith("compression method 99 must be 0 (stored) or 8 (deflate)")
    assert problems[1].startswith("modelDescription.xml: cannot be unpacked: ")


def test_another_xml_is_no_model_description() -> None:
    with pytest.raises(ValueError, match="root element is html, must be fmiModelDescription"):
        fmi_version(etree.fromstring("<html/>"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[controllers.threshold]", "[controllers.Open_Loop]", "differ by capital letters only"),
        ("initial_speed = 10.0", f"initial_speed = 1{400 * '0'}", "initial_speed is out of range"),
        ("[run]", "[axes.x]\nvalues = [1.0]\n[run]", "is a sweep"),
    ],
)
def test_scenario_files(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.replace(old, new))
    with pytest.raises(ValueError, match=said) as told:
        cl.load_scenario(path)
    assert str(told.value).startswith(f"{path}: ")
    assert "\n" not in str(told.value)


def test_numbers_that_no_formula_can_bring_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def overflows(*given: Any, **more: Any) -> None:
        raise OverflowError("math range error")

    monkeypatch.setattr("contactlib.scenario.contact_sections.ContactSection.build", overflows)
    with pytest.raises(cl.ModelError, match=r"locomotive\.toml: its numbers are too far apart"):
        cl.load_model("locomotive.toml")


AXES = SWEEP[SWEEP.index("[axes.patch]") :]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (AXES, "axes = {}\n", r"axes: give at least one, \[axes\.NAME\]"),
        ('["creep_pi", "open_loop"]', "[]", r"controllers = \[\] must be a list of at least one"),
        ('["slip_work", ', "[", "controllers: none runs, as all outcomes are of the analysis"),
    ],
)
def test_sweep_files(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in SWEEP
    with pytest.raises(ValueError, match=said):
        sweep.load_sweep(write_sweep(tmp_path, SWEEP.replace(old, new)))


def test_a_grid_has_only_so_many_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactlib.sweep.sampling.MOST_RUNS", 5)
    with pytest.raises(ValueError, match="the grid has 6 points: at most 5"):
        sweep.load_sweep(write_sweep(tmp_path))


def test_a_sweep_of_analysis_alone_runs_nothing_and_else_all_controllers(tmp_path: Path) -> None:
    named = 'controllers = ["creep_pi", "open_loop"]\n'
    everyone = sweep.load_sweep(write_sweep(tmp_path, SWEEP.replace(named, "")))
    assert set(everyone.plan.controllers) == {"open_loop", "threshold", "creep_pi"}
    alone = SWEEP.replace(named, "").replace('"slip_work", ', "")
    assert sweep.load_sweep(write_sweep(tmp_path, alone)).simulated_time == 0.0


def test_a_damaged_plan_is_no_plan(tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text('{"kind": ')
    assert _read_plan(tmp_path / "plan.json") == {}


# ---- arguments ------------------------------------------------------------------------------


def test_gains_of_a_root_locus_rise(rig: cl.Model) -> None:
    point = rig.wheelset.balanced(creepage=0.021, speed=10.0)
    loop = control_systems.creep_loop(rig.wheelset, point, proportional_gain=1e5)
    for gains in ([2.0, 1.0], [[1.0, 2.0]], [1.0, 1.0]):
        with pytest.raises(ValueError, match=r"gains = array.* must be one row that rises"):
            control_systems.root_locus(loop, gains)


def test_kinds_of_model() -> None:
    with pytest.raises(ValueError, match=r"kind = 'bogie' must be one of: force_element"):
        kernel.model_variables("bogie")


def test_bounds_of_the_reference_are_in_order() -> None:
    designed = cl.load_scenario("dry_wet_dry.toml").controller("slope_seeking")
    with pytest.raises(ValueError, match=r"least_reference = 1\.0 is out of range: must be <="):
        dataclasses.replace(designed, least_reference=1.0)  # type: ignore[type-var]


def test_an_outcome_without_rows_has_no_value() -> None:
    with pytest.raises(ValueError, match="there is no row yet"):
        _known(None)


# ---- laws and tables ------------------------------------------------------------------------


def test_a_short_process_zone_is_the_limit() -> None:
    law = cl.CohesiveZone(k_hat=1e-8, static_to_kinetic=2.0)
    limit = cl.CarterGriffith(k_hat=1e-8)
    x = np.array([0.2, 0.9, 1.5])
    np.testing.assert_array_equal(law.stick_boundary(x), limit.stick_boundary(x))
    assert law.sliding_creepage == np.inf
    assert law.corner is None


def test_a_table_comes_back_from_a_pickle(table: cl.CreepForceTable) -> None:
    assert pickle.loads(pickle.dumps(table)).data == table.data  # noqa: S301 - of our own making


def test_an_error_of_the_law_ends_the_building_of_its_table() -> None:
    class Broken(cl.CarterGriffith):
        def traction_ratio(self, normalized_creepage: Any) -> Any:
            raise cl.ConvergenceError("no solution")

        evaluate = None  # type: ignore[assignment]

    with pytest.raises(cl.ConvergenceError, match="no solution"):
        cl.CreepForceTable.from_law(Broken)


def test_the_model_file_s_cohesive_law(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, table: cl.CreepForceTable
) -> None:
    asked: list[Any] = []

    def built(*given: Any) -> cl.CreepForceTable:
        asked.extend(given[:2])
        given[-1](0.5)
        return table  # any will do

    monkeypatch.setattr("contactlib.scenario.contact_sections.cohesive_table", built)
    text = cl.model_path("roller_rig.toml").read_text() + '\n[law]\nkind = "cohesive"\n'
    (tmp_path / "x.toml").write_text(text)
    shown = CliRunner().invoke(
        cli.main, ["table", str(tmp_path / "x.toml"), "-o", str(tmp_path / "t.bin")]
    )
    assert shown.exit_code == 0, shown.output
    assert asked == ["line", pytest.approx(0.45 / 0.21)]
    assert "... Building the table of the law\n" in shown.output
    assert (tmp_path / "t.bin").read_bytes() == table.data


# ---- figures, documents and the terminal ----------------------------------------------------


def test_a_caption_has_what_is_driven(locomotive: cl.Model) -> None:
    drivetrain = cl.Drivetrain(
        locomotive.wheelset,
        axle=cl.Axle(stiffness=6e6, damping=500.0, drive_share=0.4),
        motor_lag=0.01,
        relaxation_length=8e-3,
    )
    said = drivetrain_setting(drivetrain).replace("\u00a0", " ")
    hertz = drivetrain.torsional_frequency / (2.0 * np.pi)
    assert f"Motor lag 10 ms, relaxation length 8 mm, axle {hertz:.3g} Hz, " in said
    assert said.endswith("% of critical.")
    assert cl.Drivetrain(locomotive.wheelset).torsional_damping_ratio == 0.0


def test_an_installed_package_brings_its_licence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class File:
        name = "LICENSE"

        def read_binary(self) -> bytes:
            return b"MIT"

    monkeypatch.setattr(documentation, "PACKAGE", tmp_path / "contactlib")
    monkeypatch.setattr(metadata, "files", lambda name: [File()])
    assert documentation.licence_text() == b"MIT"
    monkeypatch.setattr(metadata, "files", lambda name: None)
    with pytest.raises(FileNotFoundError, match="installed without its LICENSE"):
        documentation.licence_text()


def test_a_checkout_is_unreleased(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", unknown)
    assert documentation.version() == "unreleased"


def test_a_page_without_a_place_for_a_model_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "page.html").write_text("<html></html>")
    monkeypatch.setattr(explorer, "PAGE", tmp_path / "page.html")
    with pytest.raises(RuntimeError, match="has no one place for a model"):
        explorer.write_explorer(tmp_path / "made.html", "locomotive.toml")
    assert not (tmp_path / "made.html").exists()


def test_a_terminal_shows_bars_and_the_rest_lines() -> None:
    shown = io.StringIO()
    reporter = cli._ConsoleReporter()
    reporter._console = Console(file=shown, force_terminal=True, width=120)
    pace = cli._Pace()
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
        warnings.warn("mind the gap", cl.ProcessZoneWarning, stacklevel=1)

    monkeypatch.setitem(cli.main.commands, "warns", warns)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        shown = CliRunner().invoke(cli.main, ["warns"])
    assert (shown.exit_code, shown.stderr) == (0, "warning: mind the gap\n")
