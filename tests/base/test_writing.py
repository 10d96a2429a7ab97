"""Files are written whole or not at all."""

from __future__ import annotations

import ast
import errno
import os
import re
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import contactlib as cl
from contactlib.base.writing import write_whole

posix = pytest.mark.skipif(os.name != "posix", reason="rights and special files of POSIX")


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_failed_write_names_the_file_keeps_the_old_one_and_leaves_no_other(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_whole(tmp_path / "kept", b"old")

    def disk_full(*given: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, call, disk_full)
    with pytest.raises(OSError, match=f"No space left on device: {str(path)!r}"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@posix
def test_a_folder_that_cannot_be_synced_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def files_only(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))

    monkeypatch.setattr(os, "fsync", files_only)
    assert write_whole(tmp_path / "new", b"new").read_bytes() == b"new"


def test_a_new_file_has_ordinary_permissions(tmp_path: Path) -> None:
    ordinary = tmp_path / "ordinary"
    ordinary.touch()
    assert write_whole(tmp_path / "new", b"").stat().st_mode == ordinary.stat().st_mode


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


WRITERS = """
import sys
from contactlib.base.writing import write_whole
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
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # which root never gets
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


def test_no_other_module_writes_files() -> None:
    """All of the above holds as long as every file is written by `write_whole`."""
    package = Path(cl.__file__).parent
    # The lock, scratch folders, and what only builds the page.
    others = {"writing.py", "store.py", "loading.py", "bundle.py", "wasm.py"}
    ways = {"write_text", "write_bytes", "savetxt", "tofile", "open", "fdopen", "mkstemp", "rename"}
    for path in package.rglob("*.py"):
        if path.name in others:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "attr", getattr(node.func, "id", ""))
                if name in ways:
                    where = ast.unparse(node)
                    reads = where.startswith(("webbrowser.open(", "archive.open(entry)"))
                    assert reads, f"{path}: {where}"
                if name == "savefig":  # to memory
                    assert ast.unparse(node.args[0]) == "buffer", f"{path}: {where}"
