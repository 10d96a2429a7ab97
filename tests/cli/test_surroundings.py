"""What must not depend on clock, locale, terminal and home folder, and files of other versions."""

from __future__ import annotations

import ast
import json
import os
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import pytest
from exported_fmu import exported
from outside_tools import missing
from sweep_files import write_sweep

import contactlib as cl
from contactlib import figures, kernel
from contactlib.figures.style import new_figure

HERE = Path(__file__).parent
posix = pytest.mark.skipif(os.name != "posix", reason="shells and signals of POSIX")
# '-P', since an installed command has no folder of work on its path either.
MAIN = [
    sys.executable,
    "-P",
    "-c",
    "from contactlib.cli.commands import main; main(prog_name='contactlib')",
]


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU of the roller rig."""
    return exported(cl.load_model("roller_rig.toml"), tmp_path_factory.mktemp("fmu"))


# ---- clock ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_files_do_not_know_the_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rig: cl.Model
) -> None:
    sweep = write_sweep(tmp_path)
    figure, axes = new_figure(3.0, 2.0)
    axes.plot([0.0, 1.0], [0.0, 0.5])

    def written(folder: Path) -> dict[str, bytes]:
        folder.mkdir()
        cl.ensemble(sweep, output=folder, workers=2, chunk=2)
        cl.export_fmu(rig, folder / "x.fmu")
        cl.export_ssp(rig, folder / "x.ssp")
        for kind in ("png", "svg", "pdf"):
            figures.save(figure, folder / f"x.{kind}")
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    before = written(tmp_path / "before")
    # The wall clock jumps by up to a century between any two looks at it.
    jumps, now = random.Random(8), time.time  # noqa: S311 - no secret
    monkeypatch.setattr(time, "time", lambda: now() + jumps.uniform(-1.5e9, 1.5e9))
    monkeypatch.setattr(time, "time_ns", lambda: int(1e9 * time.time()))
    # What matplotlib writes: a day of 1970, when no zip entry can be dated.
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert written(tmp_path / "after") == before
    assert len(before) == 6


def test_no_module_looks_at_the_wall_clock() -> None:
    """Neither for the time that is left nor for locks; nothing is dated."""
    readings = {"time", "time_ns", "localtime", "gmtime", "ctime", "strftime"}
    for path in Path(cl.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Attribute):
                wall = node.attr in readings and ast.unparse(node.value) == "time"
                assert not wall, f"{path}: {ast.unparse(node)}"
                assert node.attr not in {"st_mtime", "st_mtime_ns", "getmtime"}, path
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                names = {alias.name for alias in node.names}
                assert "datetime" not in names | {getattr(node, "module", "")}, path


# ---- locale ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def comma(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of a locale whose decimal separator is a comma."""
    localedef = shutil.which("localedef")
    if localedef is None or sys.platform != "linux":
        missing("needs localedef of Linux")
    folder = tmp_path_factory.mktemp("locale")
    subprocess.run(
        [localedef, "-i", "de_DE", "-f", "UTF-8", folder / "de_DE.UTF-8"],
        check=False, capture_output=True,
    )  # fmt: skip
    if not (folder / "de_DE.UTF-8" / "LC_NUMERIC").exists():
        missing("localedef has no de_DE")
    return {**os.environ, "LOCPATH": str(folder), "LC_ALL": "de_DE.UTF-8"}


@pytest.mark.slow
def test_a_decimal_comma_changes_no_number(
    tmp_path: Path, unpacked: Path, comma: dict[str, str]
) -> None:
    answers = {}
    for name, environment in (("comma", comma), ("dot", {**os.environ, "LC_ALL": "C"})):
        (tmp_path / name).mkdir()
        arguments = map(str, (HERE / "decimal_comma.py", tmp_path / name, unpacked))
        command = [sys.executable, *arguments]
        done = subprocess.run(command, capture_output=True, check=False, env=environment)
        assert done.returncode == 0, done.stderr
        answers[name] = json.loads(done.stdout)
    assert answers["comma"].pop("separator") == ","
    assert answers["dot"].pop("separator") == "."
    assert answers["comma"] == answers["dot"]
    first, tiny, point = answers["comma"]["messages"]
    assert first.startswith("friction_scale = -1.5 is out of range: must be from ")
    assert tiny.startswith("slip_rate_residual = 1.25e-300 is out of range")
    assert point == "communication point = 0.125 must be the FMU's time 0"


def run(
    *arguments: object, cwd: Path, shell: str = "", **environment: str | None
) -> subprocess.CompletedProcess[str]:
    """The command; what follows it in a shell, and the environment's changes, None to unset."""
    changed = {**os.environ, **environment}
    known = {name: value for name, value in changed.items() if value is not None}
    command = [*MAIN, *map(str, arguments)]
    if shell:
        command = ["sh", "-c", f'"$@" {shell}', "sh", *command]
    return subprocess.run(
        command, cwd=cwd, env=known, capture_output=True, text=True, check=False,
        encoding="utf-8", errors="surrogateescape",
    )  # fmt: skip


MODEL = (cl.files.model_path("roller_rig.toml")).read_text()


@pytest.mark.slow
def test_names_that_the_terminal_cannot_show(tmp_path: Path) -> None:
    path = tmp_path / "Pr\u00fcfstand \u65e5.toml"
    text = cl.files.model_path("torque_or_creep_rig.toml").read_text(encoding="ascii")
    name = next(line for line in text.splitlines() if line.startswith("name"))
    path.write_text(text.replace(name, 'name = "Pr\u00fcfstand"'), encoding="utf-8")
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = run("simulate", path, "-o", "a \u00fc", cwd=tmp_path, **plain)
    assert done.returncode == 0, done.stderr
    assert "Pr\\xfcfstand" in done.stdout
    assert {"torque.csv", "torque.png", "metrics.json"} <= set(os.listdir(tmp_path / "a \u00fc"))


# ---- home, screen, terminal -----------------------------------------------------------------


@pytest.mark.slow
@posix
def test_no_home_no_screen_no_folder(tmp_path: Path) -> None:
    """A folder that was removed meanwhile, and a backend that would need a screen."""
    gone, output = tmp_path / "gone", tmp_path / "out"
    gone.mkdir()
    nothing = {"HOME": None, "DISPLAY": None, "MPLCONFIGDIR": None, "XDG_CACHE_HOME": None}
    command = [*MAIN, "simulate", "torque_or_creep_rig.toml", "-o", str(output)]
    done = subprocess.run(
        ["sh", "-c", 'rmdir ../gone; HOME=/nowhere; export HOME; exec "$@"', "sh", *command],
        cwd=gone, capture_output=True, text=True, check=False,
        env={**{k: v for k, v in os.environ.items() if k not in nothing}, "MPLBACKEND": "TkAgg"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert (output / "torque.png").stat().st_size > 1000


@posix
@pytest.mark.parametrize(
    ("shell", "status", "error"),
    [
        ("| head -n 1 >&2", 0, ""),  # the status is head's
        (">/dev/full", 2, "contactlib: [Errno 28] No space left on device\n"),
        pytest.param(">&-", 0, "", marks=pytest.mark.slow),
        pytest.param("<&- >&- 2>&-", 0, "", marks=pytest.mark.slow),
    ],
    ids=["broken pipe", "full", "closed", "all closed"],
)
def test_where_the_output_goes_is_no_matter(
    tmp_path: Path, shell: str, status: int, error: str
) -> None:
    if "/dev/full" in shell and not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")
    done = run("table", "roller_rig.toml", "-o", "t.bin", cwd=tmp_path, shell=shell)
    assert done.returncode == status
    if error or "head" not in shell:
        assert done.stderr == error
    assert cl.CreepForceTable.load(tmp_path / "t.bin").max_error < 1e-13


@posix
def test_a_reader_that_has_gone_ends_the_command_quietly(tmp_path: Path) -> None:
    inlet, outlet = os.pipe()
    os.close(inlet)
    try:
        done = subprocess.run(
            [*MAIN, "table", "roller_rig.toml", "-o", "t.bin"],
            cwd=tmp_path, stdout=outlet, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    finally:
        os.close(outlet)
    assert (done.returncode, done.stderr) == (1, "")


# ---- other versions -------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "word"), [(1, "older"), (4, "newer")])
def test_a_table_of_another_version_names_it(
    tmp_path: Path, table: cl.CreepForceTable, version: int, word: str
) -> None:
    path = tmp_path / "t.bin"
    path.write_bytes(kernel.framed(kernel.TABLE_MAGIC, version, table.data[24:]))
    with pytest.raises(ValueError, match=word) as caught:
        cl.CreepForceTable.load(path)
    assert str(caught.value) == (
        f"{path}: the file has a{'n' * (word == 'older')} {word} format version: {version}, "
        f"this contactlib reads {kernel.TABLE_VERSION}"
    )


@pytest.mark.parametrize("what", ["chunks", "nc"])
def test_results_of_another_contactlib_name_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    path, folder = write_sweep(tmp_path), tmp_path / "out"

    @contextmanager
    def release(version: str) -> Iterator[None]:
        with monkeypatch.context() as patch:
            patch.setattr("contactlib.runs.sweep.plan.version", lambda: version)
            yield

    def stop(part: float) -> None:
        if part > 0.0 and what == "chunks":
            raise KeyboardInterrupt

    stopped = pytest.raises(KeyboardInterrupt) if what == "chunks" else nullcontext()
    with release("0.0.9"), stopped:
        cl.ensemble(path, output=folder, workers=1, chunk=3, progress=stop)
    here = cl.load_sweep(path).plan.made_with
    with pytest.raises(ValueError, match="of another plan") as caught:
        cl.ensemble(path, output=folder)
    made = f"made with contactlib 0.0.9 with kernel {kernel.token()}, this is {here};"
    assert made in str(caught.value)
    path.write_text(path.read_text().replace("300.0", "301.0"))
    with release("0.0.9"), pytest.raises(ValueError, match="not the same: axis inertia;"):
        cl.ensemble(path, output=folder)
