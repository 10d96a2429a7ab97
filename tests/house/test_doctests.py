"""Every example in a docstring, and the ones in the README, give what they show."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
from pathlib import Path

import pytest

import contactlib

MODULES = [info.name for info in pkgutil.walk_packages(contactlib.__path__, prefix="contactlib.")]
SLOW = ("contactlib.runs.benchmarking", "contactlib.runs.tuning")


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in MODULES],
)
def test_docstrings(name: str) -> None:
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_there_are_examples() -> None:
    finder = doctest.DocTestFinder()
    examples = [t for name in MODULES for t in finder.find(importlib.import_module(name))]
    assert sum(len(t.examples) for t in examples) > 10


@pytest.mark.parametrize(
    "name", ["README.md", pytest.param("models/README.md", marks=pytest.mark.slow)]
)
def test_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)  # its examples write files
    readme = Path(__file__).parents[2] / name
    result = doctest.testfile(str(readme), module_relative=False, encoding="utf-8")
    assert result.attempted > 5
    assert result.failed == 0
