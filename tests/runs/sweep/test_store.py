"""The file of a sweep's chunks: locked, whole or not used."""

from __future__ import annotations

import errno
import json
import os
import platform
from io import FileIO
from pathlib import Path

import numpy as np
import pytest

from contactlib.runs.sweep import store
from contactlib.runs.sweep.store import OWNER, ChunkStore, locked

FOUND = np.arange(12.0).reshape(3, 4)
DIGEST = '{"contactlib": "this"}'


def opened(file: FileIO, digest: str = DIGEST) -> ChunkStore:
    return ChunkStore(file, digest, rows=3, runs=10, chunk=4)


@pytest.mark.parametrize("harm", ["none", "flip", "cut", "swap", "foreign"])
def test_a_chunk_is_that_which_was_saved_or_none(tmp_path: Path, harm: str) -> None:
    path = tmp_path / "x.chunks"
    with locked(path) as file:
        for first in (0, 4):
            opened(file).save(first, FOUND + first)
    data = path.read_bytes()
    size = store.CHECKSUM + FOUND.nbytes
    one, two = data[-2 * size : -size], data[-size:]
    harmed = {
        "none": one + two,
        "flip": one + two[:-9] + bytes([two[-9] ^ 1]) + two[-8:],
        "cut": one + two[:-9],  # as by a kill or a full disk
        "swap": one + one,
        "foreign": one + bytes(size),
    }
    path.write_bytes(data[: -2 * size] + harmed[harm])
    with locked(path) as file:
        kept = opened(file)
        assert np.array_equal(kept.load(0), FOUND)  # type: ignore[arg-type]
        second = kept.load(4)
        assert second is None if harm != "none" else np.array_equal(second, FOUND + 4)  # type: ignore[arg-type]
        assert kept.load(8) is None
        kept.save(8, last := FOUND[:, :2])
        assert np.array_equal(kept.load(8), last)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ['{"kind": ', "[]", '{"digest": 3}'])
def test_a_damaged_plan_is_no_plan(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.chunks"
    path.write_text(" " * OWNER + text + "\n")
    with (
        pytest.raises(ValueError, match="of another plan: made with another contactlib, this is"),
        locked(path) as file,
    ):
        opened(file)


def test_a_chunk_has_the_length_of_the_chunks_before(tmp_path: Path) -> None:
    with locked(tmp_path / "x.chunks") as file:
        opened(file).save(0, FOUND)
        again = ChunkStore(file, DIGEST, rows=3, runs=10, chunk=5)
        assert again.chunk == 4
        assert again.load(0) is not None


def test_a_lock_is_of_one_and_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "new" / "lock"
    for _ in range(2):
        with locked(path):
            who = f"in use by process {os.getpid()} on {platform.node()}, which writes to it"
            with pytest.raises(RuntimeError, match=who), locked(path):
                pass
        assert not path.exists()


@pytest.mark.skipif(os.name != "posix", reason="elsewhere an open file is not removed")
def test_a_lock_that_its_owner_has_just_removed_is_not_taken_for_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, lock, tried = tmp_path / "new" / "lock", store._lock, []

    def late(file: FileIO) -> None:
        tried.append(file)
        if len(tried) == 1:
            path.unlink()
        lock(file)

    monkeypatch.setattr(store, "_lock", late)
    with locked(path):
        assert path.exists()
    assert len(tried) == 2


def test_a_file_system_without_locks_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(file: FileIO) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(store, "_lock", none)
    with pytest.raises(OSError, match=r"No locks available: .*lock"), locked(tmp_path / "lock"):
        pass


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
def test_a_full_disk_is_reported_and_what_was_saved_stays(tmp_path: Path) -> None:
    import resource

    path = tmp_path / "x.chunks"
    with locked(path) as file:
        kept = opened(file)
        kept.save(0, FOUND)
        _, largest = known = resource.getrlimit(resource.RLIMIT_FSIZE)
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 50, largest))
            with pytest.raises(OSError, match=r"File too large: .*x\.chunks"):  # not: no space
                kept.save(4, FOUND)
            with pytest.raises(OSError, match=r"File too large: .*x\.chunks"):
                kept.save(8, FOUND[:, :2])
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, known)
        assert kept.load(4) is None
        assert np.array_equal(kept.load(0), FOUND)  # type: ignore[arg-type]
    assert json.loads(path.read_bytes()[OWNER:].split(b"\n")[0])["chunk"] == 4
