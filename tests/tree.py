"""The source tree: its root, the folders that a source distribution contains, an installation."""

from __future__ import annotations

import shutil
from pathlib import Path

from contactlib.base.writing import PACKAGE, package_folder

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = (
    *("benchmarks", "contactlib", "docs", "examples", "explorer"),
    *("fmu", "models", "tests", "tools"),
)


def installed(site_packages: Path, *left_out: str) -> Path:
    """The package as a wheel holds it, with nothing of the tree beside it; returns its folder."""
    package = site_packages / "contactlib"
    ignored = shutil.ignore_patterns("__pycache__", "locomotive_train", *left_out)
    shutil.copytree(PACKAGE, package, ignore=ignored)
    for folder in ("fmu", "models"):
        shutil.copytree(
            package_folder(folder), package / folder, ignore=ignored, dirs_exist_ok=True
        )
    return package
