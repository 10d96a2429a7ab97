"""The chunks of a sweep on disk: those that were saved, or none."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from contactlib.runs.sweep.store import CHECKSUM, ChunkStore

FOUND = np.arange(12.0).reshape(3, 4)
DIGEST = '{"contactlib": "this"}'


@pytest.mark.parametrize("harm", ["none", "flip", "cut", "empty", "swap", "foreign"])
def test_a_chunk_is_that_which_was_saved_or_none(tmp_path: Path, harm: str) -> None:
    store = ChunkStore(tmp_path / "x", DIGEST, 3)
    for first in (0, 4):
        store.save(first, FOUND + first)
    saved, last = ((tmp_path / "x" / f"{first}.chunk").read_bytes() for first in (0, 4))
    harmed = {
        "none": last,
        "flip": last[:-9] + bytes([last[-9] ^ 1]) + last[-8:],
        "cut": last[:-9],
        "empty": b"",
        "swap": saved,
        "foreign": bytes(CHECKSUM) + last[CHECKSUM:],
    }
    (tmp_path / "x" / "4.chunk").write_bytes(harmed[harm])
    again = ChunkStore(tmp_path / "x", DIGEST, 3)
    chunks = again.load()
    assert_array_equal(chunks.pop(0), FOUND)
    if harm == "none":
        assert_array_equal(chunks.pop(4), FOUND + 4)
    assert not chunks
    again.save(8, FOUND[:, :2])
    assert_array_equal(again.load()[8], FOUND[:, :2])


@pytest.mark.parametrize("text", ['{"kind": ', "[]", '{"digest": 3}'])
def test_another_or_damaged_plan_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "plan.json").write_text(text)
    with pytest.raises(ValueError, match="of another plan: made with another contactlib, this is"):
        ChunkStore(tmp_path, DIGEST, 3)


def test_two_processes_on_one_folder_do_not_mix(tmp_path: Path) -> None:
    first, second = (ChunkStore(tmp_path / "x", DIGEST, 3) for _ in range(2))
    first.save(0, FOUND)
    assert_array_equal(second.load()[0], FOUND)
    first.remove()
    second.save(4, FOUND)
    (tmp_path / "x" / "plan.json").unlink(missing_ok=True)
    other = ChunkStore(tmp_path / "x", '{"contactlib": "another"}', 3)
    assert not other.load()
    assert list(second.load()) == [4]


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
def test_a_full_disk_is_reported_and_what_was_saved_stays(tmp_path: Path) -> None:
    import resource

    store = ChunkStore(tmp_path, DIGEST, 3)
    store.save(0, FOUND)
    _, largest = known = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (50, largest))
        with pytest.raises(OSError, match=r"File too large: .*4\.chunk"):
            store.save(4, FOUND)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, known)
    assert list(store.load()) == [0]
