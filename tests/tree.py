"""The source tree: its root, and the folders that a source distribution contains."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = (
    *("benchmarks", "contactlib", "docs", "examples", "explorer"),
    *("fmu", "models", "tests", "tools"),
)
