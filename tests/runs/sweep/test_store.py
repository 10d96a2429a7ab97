"""The lock of a sweep's folder, where another process does something at the same time."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable
from pathlib import Path

import pytest

from contactlib.runs.sweep import store as lock
from contactlib.runs.sweep.store import ChunkStore, locked

PLACEHOLDER = 2**22 + 1  # Linux gives no such number


def owner(pid: int) -> str:
    return json.dumps({"host": platform.node(), "pid": pid})


@pytest.mark.skipif(os.name != "posix", reason="elsewhere nobody is asked whether a process lives")
def test_a_process_of_another_user_lives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def not_yours(pid: int, signal: int) -> None:
        raise PermissionError

    (tmp_path / "lock").write_text(owner(PLACEHOLDER))
    monkeypatch.setattr(os, "kill", not_yours)
    with (
        pytest.raises(RuntimeError, match=f"in use by process {PLACEHOLDER} on "),
        locked(tmp_path),
    ):
        pass
    assert (tmp_path / "lock").read_text() == owner(PLACEHOLDER)


def test_a_lock_that_names_nobody_is_not_taken_over(tmp_path: Path) -> None:
    (tmp_path / "lock").write_text("{}")
    with pytest.raises(RuntimeError, match="in use by another process, "), locked(tmp_path):
        pass


@pytest.fixture
def meanwhile(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Path], object]], None]:
    """Do something to the lock between finding its process dead and removing it."""

    def arrange(act: Callable[[Path], object]) -> None:
        def lives(pid: int, path: Path) -> bool:
            if pid == PLACEHOLDER:
                act(path)
            return pid != PLACEHOLDER

        monkeypatch.setattr(lock, "_lives", lives)

    return arrange


def test_a_new_lock_that_takes_the_place_of_a_stale_one_stays(
    tmp_path: Path, meanwhile: Callable[[Callable[[Path], object]], None]
) -> None:
    (tmp_path / "lock").write_text(owner(PLACEHOLDER))
    meanwhile(lambda path: path.write_text(owner(1)))
    with pytest.raises(RuntimeError, match="in use by process 1 on "), locked(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["lock"]
    assert (tmp_path / "lock").read_text() == owner(1)


def test_a_stale_lock_that_is_removed_meanwhile_is_no_error(
    tmp_path: Path, meanwhile: Callable[[Callable[[Path], object]], None]
) -> None:
    (tmp_path / "lock").write_text(owner(PLACEHOLDER))
    meanwhile(Path.unlink)
    with locked(tmp_path):
        assert json.loads((tmp_path / "lock").read_text())["pid"] == os.getpid()
    assert not tmp_path.exists()


@pytest.mark.parametrize("text", ['{"kind": ', "[]", '{"digest": 3}'])
def test_a_damaged_plan_is_no_plan(tmp_path: Path, text: str) -> None:
    (tmp_path / "plan.json").write_text(text)
    with pytest.raises(ValueError, match="of another plan: made with another contactlib, this is"):
        ChunkStore(tmp_path, '{"contactlib": "this"}', runs=4, chunk=4)
