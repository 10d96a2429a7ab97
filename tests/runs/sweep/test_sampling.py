"""Grids and random samples."""

from __future__ import annotations

from pathlib import Path

import pytest
from sweep_files import write_sweep

from contactlib.runs import sweep


def test_a_grid_has_only_so_many_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactlib.runs.sweep.sampling.MOST_RUNS", 5)
    with pytest.raises(ValueError, match="the grid has 6 points: at most 5"):
        sweep.load_sweep(write_sweep(tmp_path))
