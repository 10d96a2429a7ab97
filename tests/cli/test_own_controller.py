"""A controller from a user's Python file on the command line."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import call, done, refused
from sweep_files import SCENARIO

import contactlib as cl
from contactlib.cli.own_controller import load_controller, with_controllers

FILE = """
import sys
import contactlib as cl
from beside import HALF

class Mine(cl.SampledController):
    sample_time = 0.01

    def __init__(self, share=HALF):
        self.share = share

    def torque(self, measurement):
        return self.share * measurement.demand

class Greedy(Mine):
    def torque(self, measurement):
        return 2.0 * measurement.demand

class NeedsGain(Mine):
    def __init__(self, gain):
        self.gain = gain

class Leaves(Mine):
    def torque(self, measurement):
        sys.exit(0)

class LeavesAtStart(Mine):
    def reset(self, measurement, torque):
        sys.exit(0)

class LeavesAtOnce(Mine):
    def __init__(self):
        sys.exit(0)

class LeavesWithMany:
    sample_time = 0.01

    def start(self, measurement, torque):
        return None

    def sample(self, measurement, memory):
        sys.exit(0)

quarter = Mine(0.25)

def function(measurement):
    return measurement.demand
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    (tmp_path / "s.toml").write_text(SCENARIO)
    (tmp_path / "mine.py").write_text(FILE)
    (tmp_path / "beside.py").write_text("HALF = 0.5\n")
    (tmp_path / "broken.py").write_text("x = 1\ny = (\n")
    (tmp_path / "leaves.py").write_text("import sys\nsys.exit()\n")
    (tmp_path / "fails.py").write_text("import nothing_of_this_name\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield tmp_path
    sys.modules.pop("beside", None)


def torques(name: str) -> list[float]:
    with open(f"out/{name}.csv", encoding="ascii") as file:
        return [float(row["commanded_torque [N.m]"]) for row in csv.DictReader(file)]


@pytest.mark.usefixtures("folder")
def test_a_controller_of_a_file_runs() -> None:
    result = done("simulate", "s.toml", "-o", "out", "--controller", "mine.py:Mine")
    assert torques("Mine")[-1] == 0.5 * 23e3
    assert "... Quick: Mine" in result.output
    assert "creep_pi" not in result.output


@pytest.mark.usefixtures("folder")
def test_a_class_or_an_object_stands_beside_the_scenario_s_own() -> None:
    for given, share in (("Mine", 0.5), ("quarter", 0.25)):
        name, controller = load_controller(f"mine.py:{given}")
        scenario = with_controllers("s.toml", cl.load_scenario("s.toml"), {name: controller})
        assert list(scenario.controllers) == ["open_loop", "threshold", "creep_pi", name]
        run = cl.run_scenario(scenario, name)
        assert run["commanded_torque"][-1] == share * 23e3


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("mine.py", "--controller mine.py must be FILE.py:NAME, such as my_file.py:MyController"),
        (":Mine", "--controller :Mine must be FILE.py:NAME, such as my_file.py:MyController"),
        ("none.py:Mine", "[Errno 2] No such file or directory: 'none.py'"),
        ("s.toml:Mine", "--controller s.toml:Mine must be FILE.py:NAME, such as s.py:Mine"),
        ("mine:Mine", "--controller mine:Mine must be FILE.py:NAME, such as mine.py:Mine"),
        ("mine.py:Mime", "--controller mine.py:Mime: the file has no Mime; did you mean 'Mine'?"),
        ("broken.py:Mine", "--controller broken.py: SyntaxError: '(' was never closed"),
        (
            "fails.py:Mine",
            "--controller fails.py: ModuleNotFoundError: No module named 'nothing_of_this_name' "
            "(fails.py, line 1)",
        ),
        ("mine.py:function", "--controller mine.py:function = function is not a controller"),
        ("mine.py:NeedsGain", "--controller mine.py:NeedsGain: TypeError: "),
        # sys.exit(0) in a user's code is not the end of a command that did its work
        ("leaves.py:Mine", "--controller leaves.py: SystemExit (leaves.py, line 2)"),
        ("mine.py:Leaves", "Leaves.torque at 0 s: SystemExit: 0 (mine.py, line "),
        ("mine.py:LeavesAtStart", "LeavesAtStart.reset: SystemExit: 0 (mine.py, line "),
        ("mine.py:LeavesAtOnce", "--controller mine.py:LeavesAtOnce: SystemExit: 0 (mine.py, "),
        ("mine.py:LeavesWithMany", "LeavesWithMany.sample at 0 s: SystemExit: 0 (mine.py, "),
        ("mine.py:Greedy", "Greedy.torque at 0 s returned 20000.0: it must return one number"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_mistakes_are_one_line_and_status_2(place: str, message: str) -> None:
    result = call("simulate", "s.toml", "-o", "out", "--controller", place)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith(f"contactlib: {message}")
    in_run = result.stderr.endswith("in the run of Leaves; nothing is written to out\n")
    assert in_run == (place == "mine.py:Leaves")


@pytest.mark.usefixtures("folder")
def test_what_cannot_be_combined_is_refused() -> None:
    options = ("-o", "out", "--controller", "mine.py:Mine")
    error = refused("simulate", "s.toml", *options, "--control", "creep_pi")
    assert "--control cannot be combined with --controller" in error
    error = refused("simulate", "roller_rig.toml", *options)
    assert "roller_rig.toml: is a model, not a scenario" in error
    Path("s.toml").write_text(SCENARIO.replace("controllers.creep_pi", "controllers.Mine"))
    error = refused("simulate", "s.toml", *options)
    assert error == "contactlib: s.toml has a controller Mine itself: take another name\n"
