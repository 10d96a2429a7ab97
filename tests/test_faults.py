"""What stands after a fault: the old file or the new one, whole, and a line that says why."""

from __future__ import annotations

import ast
import errno
import json
import os
import re
import stat
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from sweep_files import write_sweep

import contactlib as cl
from contactlib.figures import style
from contactlib.files import write_whole
from contactlib.report import write_report
from contactlib.study import open_study
from contactlib.sweep.lock import locked
from contactlib.sweep.store import ChunkStore, discard

posix = pytest.mark.skipif(os.name != "posix", reason="limits, rights and signals of POSIX")
HERE = Path(__file__).parent
OUTPUTS = [
    "table.bin", "element.fmu", "system.ssp", "results.nc", "000000000.chunk", "run.csv",
    "metrics.txt", "figure.png", "figure.svg", "figure.pdf", "page.html",
]  # fmt: skip
COMMANDS = [
    "command.bin", "command.fmu", "command.ssp", "command.html", "torque.csv",
    "stability_poles.png", "quick_sweep.nc", "creep_table.bin",
]  # fmt: skip
Found = dict[str, dict[str, dict[str, Any]]]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """What came of all faults with all outputs, by fault and file; see faults.py."""
    folder = tmp_path_factory.mktemp("faults")
    command = [sys.executable, str(HERE / "faults.py"), str(folder)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    known: Found = json.loads(done.stdout)
    assert all(set(OUTPUTS) <= set(tried) for tried in known.values())
    return known


# ---- a full disk, a folder that cannot be written -------------------------------------------

REASONS = {"full": errno.EFBIG, "read_only": errno.EACCES}


@posix
@pytest.mark.parametrize("fault", REASONS)
@pytest.mark.parametrize("name", OUTPUTS)
def test_the_old_file_stays_and_the_error_names_it(found: Found, fault: str, name: str) -> None:
    if fault == "read_only" and sys.platform != "linux" and os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    tried, code = found[fault][name], REASONS[fault]
    assert tried["files"] == {name: "old"}
    kind = type(OSError(code, "")).__name__
    assert tried["said"] == f"{kind}: [Errno {code}] {os.strerror(code)}: {tried['path']!r}"


@posix
@pytest.mark.parametrize("fault", REASONS)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_says_so_in_a_line_and_ends_with_2(found: Found, fault: str, name: str) -> None:
    if fault == "read_only" and sys.platform != "linux" and os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    tried, code = found[fault][name], REASONS[fault]
    assert tried["files"] == {name: "old"}
    start = f"SystemExit: 2 SystemExit contactlib: [Errno {code}] {os.strerror(code)}: "
    assert tried["said"].startswith(start)
    assert tried["said"].count("\n") == 1
    where = tried["said"].removeprefix(start).strip().strip("'")
    assert where.startswith(str(Path(tried["path"]).parent))


def test_no_space_left_is_told_with_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_whole(tmp_path / "kept", b"old")

    def no_space(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OSError, match=f"No space left on device: {str(path)!r}"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_lock_that_cannot_be_written_is_not_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fdopen = os.fdopen

    def full(descriptor: int, mode: str) -> Any:
        fdopen(descriptor, mode).close()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fdopen", full)
        with pytest.raises(OSError, match=r"No space left .*lock"), locked(tmp_path / "x.chunks"):
            pass
    with locked(tmp_path / "x.chunks"):
        pass


class Silent:
    """A reporter."""

    def step(self, title: str) -> Any:
        return threading.Lock()  # a context manager; nothing here tells its progress

    def line(self, text: str) -> None:
        """Say nothing."""


def test_an_old_comparison_stays_until_the_new_one_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = open_study("roller_rig.toml")
    run = cl.run_scenario(cl.load_scenario(write_sweep(tmp_path).with_name("s.toml")), "open_loop")
    old = [write_whole(tmp_path / f"comparison.{kind}", b"old") for kind in ("png", "svg")]

    def full(figure: object, path: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(style, "save", full)
    runs = {name: lambda progress: run for name in ("open_loop", "creep_pi")}
    with pytest.raises(OSError, match="No space"):
        write_report(study, runs, tmp_path, Silent())
    assert all(path.read_bytes() == b"old" for path in old)


# ---- killed ---------------------------------------------------------------------------------


@posix
@pytest.mark.parametrize("name", OUTPUTS)
def test_a_kill_before_the_rename_leaves_the_old_file_and_one_that_is_hidden(
    found: Found, name: str
) -> None:
    tried = found["SIGKILL"][name]
    assert tried["status"] == -9
    hidden, kept = sorted(tried["files"])
    assert kept == name
    assert tried["files"][name] == "old"
    assert re.fullmatch(re.escape(f".{name}.") + "[0-9a-f]{16}", hidden)
    (status, said), files = tried["next"]  # which does not mind what was left
    assert (status, said) == (0, "")
    assert files[name] == files[hidden] == tried["files"][hidden]


@posix
@pytest.mark.parametrize("name", OUTPUTS)
def test_ctrl_c_before_the_rename_leaves_the_old_file_alone(found: Found, name: str) -> None:
    tried = found["SIGINT"][name]
    assert tried["said"] == "KeyboardInterrupt: "
    assert tried["files"] == {name: "old"}


def test_what_kills_left_among_the_chunks_is_removed_with_them(tmp_path: Path) -> None:
    folder = tmp_path / "x.chunks"
    ChunkStore(folder, "d", "this one", runs=4, chunk=2)
    for name in (".plan.json.0123456789abcdef", ".000000000.chunk.0123456789abcdef"):
        (folder / name).touch()
    discard(folder)
    assert not folder.exists()


def test_data_are_on_the_disk_before_the_name_and_the_name_before_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[object] = []
    fsync, replace = os.fsync, os.replace

    def noted_fsync(descriptor: int) -> None:
        known = os.fstat(descriptor)
        happened.append("folder" if stat.S_ISDIR(known.st_mode) else known.st_size)
        fsync(descriptor)

    def noted_replace(source: Path, target: Path) -> None:
        happened.append("rename")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_replace)
    write_whole(tmp_path / "x", bytes(100_000))
    assert happened == [100_000, "rename", *(["folder"] if os.name == "posix" else [])]


# ---- two at once ----------------------------------------------------------------------------

WRITERS = """
import sys
from contactlib.files import write_whole
path, letter, count = sys.argv[1:]
for _ in range(int(count)):
    write_whole(path, 300_000 * letter.encode())
"""


def test_two_that_write_one_file_leave_it_whole_at_any_time(tmp_path: Path) -> None:
    path = write_whole(tmp_path / "x", 300_000 * b"a")
    running = [
        subprocess.Popen([sys.executable, "-c", WRITERS, path, letter, "60"]) for letter in "ab"
    ]
    while any(process.poll() is None for process in running):
        data = path.read_bytes()
        assert len(data) == 300_000
        assert data.count(data[:1]) == 300_000
    assert [process.returncode for process in running] == [0, 0]
    assert list(tmp_path.iterdir()) == [path]


SWEEPS = """
import sys, contactlib as cl
print("ready", flush=True)
sys.stdin.readline()
try:
    cl.ensemble(sys.argv[1], output=sys.argv[2], workers=1, chunk=2)
    print("done")
except RuntimeError as error:
    print(error)
"""


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
    said = [process.communicate()[0].strip() for process in running]
    assert "done" in said
    assert all(text == "done" or " is in use by " in text for text in said)
    name = "quick_sweep.nc"
    assert (folder / name).read_bytes() == (tmp_path / "known" / name).read_bytes()
    assert [p.name for p in folder.iterdir()] == [name]


# ---- targets that are no ordinary file ------------------------------------------------------


@posix
def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    real = write_whole(tmp_path / "far" / "real", b"old")
    for name, target in (("a", real), ("b", "a"), ("c", "far/new")):
        link = tmp_path / name
        link.symlink_to(target)
        assert write_whole(link, name.encode()) == link
        assert link.is_symlink()
        assert link.read_bytes() == name.encode()
    assert real.read_bytes() == b"b"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b", "c", "far"]


@posix
def test_a_pipe_takes_the_bytes_and_stays(tmp_path: Path) -> None:
    pipe, read = tmp_path / "pipe", list[bytes]()
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()), daemon=True)
    reader.start()
    write_whole(pipe, b"all of it")
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    reader.join()
    assert read == [b"all of it"]


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=re.escape(repr(str(tmp_path)))) as caught:
        write_whole(tmp_path, b"x")
    assert caught.value.filename2 is None
    assert list(tmp_path.iterdir()) == []


@posix
def test_a_protected_file_is_refused_and_the_old_rights_stay(tmp_path: Path) -> None:
    path = write_whole(tmp_path / "x", b"old")
    path.chmod(0o640)
    write_whole(path, b"new")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_file_without_write_permission_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_whole(tmp_path / "x", b"old")
    path.chmod(0o444)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # what root is never told
    with pytest.raises(PermissionError, match=re.escape(repr(str(path)))):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    path.chmod(0o644)


@pytest.mark.parametrize("name", ["n" * 255, "\u65e5" * 85, "-o", " a b ", "a\u00fc\u65e5.bin"])
def test_any_name_that_the_system_takes_will_do(tmp_path: Path, name: str) -> None:
    try:
        (tmp_path / name).touch()
    except OSError:
        pytest.skip("no such name here")
    assert write_whole(tmp_path / name, b"new").read_bytes() == b"new"
    assert [p.name for p in tmp_path.iterdir()] == [name]


# ---- one place ------------------------------------------------------------------------------


def test_no_other_module_writes_files() -> None:
    """All of the above holds as long as every file is written by `write_whole`."""
    package = Path(cl.__file__).parent
    # The lock, scratch folders, and what only builds the page.
    others = {"files.py", "lock.py", "loading.py", "bundle.py", "wasm.py"}
    ways = {"write_text", "write_bytes", "savetxt", "tofile", "open", "fdopen", "mkstemp", "rename"}
    for path in package.rglob("*.py"):
        if path.name in others:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "attr", getattr(node.func, "id", ""))
                where = ast.unparse(node)
                reads = name == "open" and where.startswith(
                    ("webbrowser.open(", "archive.open(entry)")
                )
                assert name not in ways or reads, f"{path}: {where}"
                if name == "savefig":  # to memory
                    assert ast.unparse(node.args[0]) == "buffer", f"{path}: {where}"
