"""Files to start from are complete and run, and a name that is nearly right finds its file."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from command_line import done, refused

import contactlib as cl
from contactlib.cli.new_files import TEMPLATES
from contactlib.files.reading import file_kind, shipped_files


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def written(kind: str) -> str:
    assert done("new", kind).stdout.startswith(f"my_{kind}.toml: to try it, contactlib ")
    return f"my_{kind}.toml"


def test_a_force_is_enough_for_an_fmu_and_a_table() -> None:
    path = written("force")
    for arguments in (("fmu", path), ("table", path, "-o", "curve.csv")):
        assert done(*arguments).stderr == ""
    assert {"CreepForceElement.fmu", "curve.csv"} < {p.name for p in Path.cwd().iterdir()}
    assert set(tomllib.loads(Path(path).read_text())) == {
        *("name", "source", "contact", "friction", "wheelset")
    }


@pytest.mark.filterwarnings("always::contactlib.InputWarning")
def test_an_inverse_mass_that_is_assumed_is_warned_of_where_it_must_be_set() -> None:
    path = written("force")
    for arguments, warned in (
        (("fmu", path, "--implicit"), True),
        (("kernel", path), True),  # whose element is implicit
        (("fmu", path), False),
    ):
        result = done(*arguments)
        assert ("effective_inverse_mass = 0.004 1/kg is assumed" in result.stderr) == warned
        assert ("(for 0.004 1/kg, assumed as there is no inertia)" in result.stdout) != warned


def test_a_file_may_be_named_instead_of_a_kind() -> None:
    output = done("new", "my_wheelset.toml").stdout
    assert output == "my_wheelset.toml: to try it, contactlib explore my_wheelset.toml\n"
    assert cl.load_model("my_wheelset.toml").wheelset.mass == 60e3
    error = refused("new", "mine.toml", "-o", "yours.toml")
    assert error == "contactlib: new: give one file to write, not mine.toml and yours.toml\n"
    refused("new", "modle")


@pytest.mark.parametrize(
    ("name", "command"),
    [("coach.toml", "explore"), ("line.toml", "simulate"), ("wet_patch_sweep.toml", "sweep")],
)
def test_the_name_of_a_shipped_file_gives_its_copy(name: str, command: str) -> None:
    shipped = cl.files.model_path(name).read_bytes()
    for given, path in (((name,), name), ((name, "-o", "mine.toml"), "mine.toml")):
        assert done("new", *given).stdout == f"{path}: to try it, contactlib {command} {path}\n"
        assert Path(path).read_bytes() == shipped
    assert refused("new", name) == f"contactlib: {name} already exists: --overwrite replaces it\n"


def test_the_measured_alternative_of_a_force_runs_too() -> None:
    text = Path(written("force")).read_text()
    kept, _, rest = text.partition("[friction]")
    law = rest[rest.index("# [law]") : rest.index("\n\n[wheelset]")].replace("# [", "[")
    law = law.replace("\n# ", "\n")
    Path("mine.toml").write_text(kept + law + rest[rest.index("\n\n[wheelset]") :])
    Path("my_curve.csv").write_text("slip;mu\n0,5;0,15\n1;0,25\n1,5;0,28\n2;0,28\n4;0,26\n8;0,22\n")
    element = cl.load_model("mine.toml").wheelset.element
    coefficient = element.at_creepage(0.02, speed=10.0)["traction_coefficient"]
    assert float(coefficient) == pytest.approx(0.28, abs=0.01)
    summary = "my_curve.csv: 6 points, 0.5 to 8 %; the curve differs by at most "
    for command in ("fmu", "table"):
        result = done(command, "mine.toml", "--output", f"mine.{command}.csv")
        assert result.output.startswith(summary)
    head = Path("mine.table.csv").read_text()
    for line in ("model: My wheel", "source: where the num", f"measured_curve: {summary}"):
        assert f"\n# {line}" in head


def test_the_model_runs_and_slips_away() -> None:
    model = cl.load_model(written("model"))
    fold = cl.find_fold(model.wheelset, speed=model.initial_speed)
    ramp = cl.Profile((0.0, 20.0), (0.5 * fold.drive_torque, 1.1 * fold.drive_torque))
    run = cl.simulate(model.wheelset, cl.TorqueControl(ramp), initial_speed=model.initial_speed)
    assert [event.name for event in run.events] == ["peak_passed", "slip_away"]


def test_the_scenario_runs_with_all_its_controllers() -> None:
    scenario = cl.load_scenario(written("scenario"))
    runs = {name: cl.run_scenario(scenario, name) for name in scenario.controllers}
    used = {n: cl.metrics(r, scenario.drivetrain).utilisation for n, r in runs.items()}
    assert used["open_loop"] < 0.85 < 0.9 < min(used["threshold"], used["creep_pi"])


def test_the_sweep_runs() -> None:
    results = cl.ensemble(written("sweep"))
    assert dict(results.sizes) == {"controller": 2, "patch_friction": 4, "inertia": 3}
    assert bool(results.slip_work.notnull().all())


def test_every_kind_has_a_template_that_the_command_names() -> None:
    assert {path.stem for path in TEMPLATES.iterdir()} == {"force", "model", "scenario", "sweep"}
    for kind in ("force", "model", "scenario", "sweep"):
        assert file_kind(written(kind)) == (kind if kind != "force" else "model")
    done("new", "-o", "other.toml")
    assert Path("other.toml").read_text().count("explore other.toml") == 1


def test_nothing_is_overwritten_by_default() -> None:
    Path("my_model.toml").write_text("mine")
    error = refused("new", "model")
    assert error == "contactlib: my_model.toml already exists: --overwrite replaces it\n"
    assert Path("my_model.toml").read_text() == "mine"
    done("new", "model", "--overwrite")
    assert cl.load_model("my_model.toml").name == "My wheelset"


def test_the_shipped_files_are_listed_with_their_titles() -> None:
    lines = done("new", "--list").stdout.splitlines()
    names = [name for names in shipped_files().values() for name in names]
    assert [line.split()[0] for line in lines] == names
    assert "dry_wet_dry.toml" in names
    assert lines[names.index("dry_wet_dry.toml")].endswith("scenario  Wet patch on dry rails")


@pytest.mark.parametrize("command", ["simulate", "fmu", "table", "sweep", "explore"])
def test_every_command_finds_the_file_that_is_meant(command: str) -> None:
    Path("my_wheel.toml").write_text("")
    names = {"dry_wet_dy.toml": "dry_wet_dry.toml", "my_whel.toml": "my_wheel.toml"}
    for name, meant in names.items():
        error = refused(command, name)
        assert error == f"contactlib: {name}: no such file; did you mean {meant}?\n"
    assert "did you mean" not in refused(command, "xyzzy.toml")


def test_a_vehicle_that_is_meant_is_found() -> None:
    text = Path(written("scenario")).read_text().replace("locomotive.toml", "locomotiv.toml")
    Path("mine.toml").write_text(text)
    with pytest.raises(cl.ModelError, match=r"did you mean locomotive\.toml\?"):
        cl.load_scenario("mine.toml")
