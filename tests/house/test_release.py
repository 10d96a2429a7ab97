"""What a release declares: one version, its changes, and how to cite it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from tree import FOLDERS, ROOT

from contactlib.base.lazy import EXTRAS

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_newest_changes_are_those_of_this_version() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.findall(r"^## (\S+)$", text, re.MULTILINE)
    assert versions[0] == PROJECT["version"]
    in_turn = sorted(versions, key=lambda v: [int(part) for part in v.split(".")], reverse=True)
    assert versions == in_turn
    assert len(set(versions)) == len(versions)


def test_the_version_stands_in_one_place() -> None:
    kinds = {".py", ".md", ".c", ".h", ".inc", ".cff", ".toml", ".txt"}
    allowed = {Path("pyproject.toml"), Path("CHANGELOG.md")}
    quoted = re.compile(rf"(?<![\d.]){re.escape(PROJECT['version'])}(?![\d.])")
    inside = (path for name in FOLDERS for path in (ROOT / name).rglob("*"))
    files = [*ROOT.glob("*"), *(path for path in inside if "node_modules" not in path.parts)]
    places = {
        path.relative_to(ROOT)
        for path in files
        if path.suffix in kinds and path.is_file() and quoted.search(path.read_text("utf-8"))
    }
    assert places <= allowed
    assert Path("pyproject.toml") in places


def test_commands_of_the_set_up_run_in_every_shell() -> None:
    """PowerShell 5.1 has no &&. The workflow runs the README's two lines, as .ci/run does."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "&&" not in readme + (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    first, second = readme.split("```")[1].strip().splitlines()
    workflow = (ROOT / ".github/workflows/test.yml").read_text(encoding="utf-8")
    assert f"- run: {first}\n      - run: {second}\n" in workflow


def test_how_to_cite_it() -> None:
    yaml = pytest.importorskip("yaml")
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(cited)  # what the format demands
    assert cited["authors"] == PROJECT["authors"]
    assert cited["license"] == PROJECT["license"]
    assert cited["title"].startswith("contactlib: ")
    assert "version" not in cited


def test_the_extras_bring_their_libraries() -> None:
    extras = PROJECT["optional-dependencies"]
    page = (ROOT / "docs" / "howto" / "install.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\| (`.+?) \|", page, re.MULTILINE)
    assert {name for cell in cells for name in re.findall(r"`(\w+)`", cell)} == set(extras)
    for library, extra in EXTRAS.items():
        assert any(line.startswith(f"{library}>=") for line in extras[extra])
        assert extra in extras["all"][0]
        assert not any(line.startswith(library) for line in PROJECT["dependencies"])
