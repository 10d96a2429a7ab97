"""What stands after a fault: the old file or the new one, whole, and an error in one line."""

from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from sweep_files import write_sweep

import contactlib as cl
from contactlib.base.writing import write_whole
from contactlib.cli.report import write_report
from contactlib.figures import files

posix = pytest.mark.skipif(os.name != "posix", reason="limits, rights and signals of POSIX")
HERE = Path(__file__).parent
OUTPUTS = ["run.csv", "results.nc"]
COMMANDS = [
    "command.bin", "command.fmu", "command.ssp", "command.html", "torque.csv",
    "stability_poles.png", "quick_sweep.nc", "creep_table.bin",
]  # fmt: skip
Found = dict[str, dict[str, dict[str, Any]]]


def come_of(folder: Path, *commands: str) -> Found:
    """What comes of all faults, by fault and file; see faults.py."""
    command = [sys.executable, str(HERE / "faults.py"), str(folder), *commands]
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    known: Found = json.loads(done.stdout)
    return known


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> Found:
    known = come_of(tmp_path_factory.mktemp("faults"))
    assert all(set(OUTPUTS) == set(tried) for tried in known.values())
    return known


@pytest.fixture(scope="module")
def found_by_command(tmp_path_factory: pytest.TempPathFactory) -> Found:
    return come_of(tmp_path_factory.mktemp("faults"), "commands")


# ---- a full disk, a folder that cannot be written -------------------------------------------

REASONS = {"full": errno.EFBIG, "read_only": errno.EACCES}


@pytest.mark.slow
@posix
@pytest.mark.parametrize("fault", REASONS)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_reports_it_in_a_line_and_ends_with_2(
    found_by_command: Found, fault: str, name: str
) -> None:
    if fault == "read_only" and sys.platform != "linux" and os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    tried, code = found_by_command[fault][name], REASONS[fault]
    assert tried["files"] == {name: "old"}
    start = f"SystemExit: 2 SystemExit contactlib: [Errno {code}] {os.strerror(code)}: "
    assert tried["error"].startswith(start)
    assert tried["error"].count("\n") == 1
    where = tried["error"].removeprefix(start).strip().strip("'")
    assert where.startswith(str(Path(tried["path"]).parent))


class Silent:
    """A reporter."""

    def step(self, title: str) -> Any:
        return nullcontext(lambda part: None)

    def line(self, text: str) -> None:
        """Print nothing."""


def test_an_old_comparison_stays_until_the_new_one_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = cl.load_scenario(write_sweep(tmp_path).with_name("s.toml"))
    old = [write_whole(tmp_path / f"comparison.{kind}", b"old") for kind in ("png", "svg")]

    def full(figure: object, paths: list[Path]) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(paths[0]))

    monkeypatch.setattr(files, "_write", full)
    with pytest.raises(OSError, match="No space"):
        write_report(scenario, list(scenario.controllers)[:2], tmp_path, Silent())
    assert all(path.read_bytes() == b"old" for path in old)


# ---- killed ---------------------------------------------------------------------------------


@pytest.mark.slow
@posix
@pytest.mark.parametrize("name", OUTPUTS)
def test_a_kill_before_the_rename_leaves_the_old_file_and_one_that_is_hidden(
    outcomes: Found, name: str
) -> None:
    tried = outcomes["SIGKILL"][name]
    assert tried["status"] == -9
    hidden, kept = sorted(tried["files"])
    assert kept == name
    assert tried["files"][name] == "old"
    assert re.fullmatch(re.escape(f".{name}.") + "[0-9a-f]{16}", hidden)
    (status, error), files = tried["next"]  # which ignores what was left
    assert (status, error) == (0, "")
    assert files[name] == files[hidden] == tried["files"][hidden]


@pytest.mark.slow
@posix
@pytest.mark.parametrize("name", OUTPUTS)
def test_ctrl_c_before_the_rename_leaves_the_old_file_alone(outcomes: Found, name: str) -> None:
    tried = outcomes["SIGINT"][name]
    assert tried["error"] == "KeyboardInterrupt: "
    assert tried["files"] == {name: "old"}


# ---- two at once ----------------------------------------------------------------------------


SWEEPS = """
import sys, contactlib as cl
print("ready", flush=True)
sys.stdin.readline()
cl.ensemble(sys.argv[1], output=sys.argv[2], workers=1, chunk=2)
print("done")
"""


@pytest.mark.slow
def test_sweeps_that_start_at_once_on_one_folder_give_one_result(tmp_path: Path) -> None:
    path = write_sweep(tmp_path)
    cl.ensemble(path, output=tmp_path / "known")
    folder = tmp_path / "out"
    command = [sys.executable, "-c", SWEEPS, str(path), str(folder)]
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    running = [subprocess.Popen(command, **pipes) for _ in range(3)]
    for process in running:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in running:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    outputs = [process.communicate()[0].strip() for process in running]
    assert outputs == ["done"] * 3
    name = "quick_sweep.nc"
    assert (folder / name).read_bytes() == (tmp_path / "known" / name).read_bytes()
    assert [p.name for p in folder.iterdir()] == [name]
