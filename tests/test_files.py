"""Files are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from contactlib.files import package_folder, write_whole


def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_whole(tmp_path / "kept", b"old")

    def disk_full(source: str, target: str) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", disk_full)
    with pytest.raises(OSError, match="No space left"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_new_file_has_ordinary_permissions(tmp_path: Path) -> None:
    ordinary = tmp_path / "ordinary"
    ordinary.touch()
    assert write_whole(tmp_path / "new", b"").stat().st_mode == ordinary.stat().st_mode


def test_sources_and_models_are_found() -> None:
    assert (package_folder("fmu") / "creep_table.c").is_file()
    assert (package_folder("models") / "roller_rig.toml").is_file()
