"""Each feature in each use, and each pair of features, is what the guide's page says."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import pytest
from uses import FEATURES, OF_VEHICLE, USES, Case, Cell, cell_of, pair_of, together

import contactlib as cl
from contactlib.laws.friction import EXPONENTIAL
from contactlib.table import law_tables

PAGE = Path(__file__).resolve().parents[2] / "docs/reference/composition.md"


def cells_of_page(name: str) -> dict[tuple[str, str], Cell]:
    """Cells of a table of the page, with the reasons below it."""
    text = re.split(r"<!-- (?:\(\w+\)) -->", PAGE.read_text(encoding="utf-8"))
    part = text[1 if name == "uses" else 3]
    reasons = dict(re.findall(r"^(\d+)\. (.*)$", part, re.MULTILINE))
    rows = [[c.strip() for c in line.split("|")[1:-1]] for line in part.split("\n") if "|" in line]
    cells = {}
    for row in rows[2:]:
        for column, text_of in zip(rows[0][1:], row[1:], strict=True):
            word, _, number = text_of.partition(" [")
            if word:
                cells[row[0], column] = Cell(word, reasons[number[:-1]] if number else "")
    return cells


@pytest.fixture(autouse=True)
def coarse_tables(
    layered_cohesive_table: cl.CreepForceTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cohesive law's fine tables take half a minute; what composes does not depend on it."""
    keys = [("line", 0.45 / 0.21, EXPONENTIAL, layers) for layers in (False, True)]
    monkeypatch.setattr(law_tables, "_cohesive", dict.fromkeys(keys, layered_cohesive_table))


def marked(name: str) -> tuple[pytest.MarkDecorator, ...]:
    return (pytest.mark.tools,) if USES[name].tools else ()


@pytest.mark.parametrize("use", [pytest.param(d, marks=marked(d)) for d in USES])
@pytest.mark.parametrize("feature", list(FEATURES))
def test_feature_at_door(
    feature: str, use: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    tools = [request.getfixturevalue("page")] if USES[use].tools == "browser" else []
    cell = cell_of(Case(FEATURES[feature], tmp_path), USES[use], *tools)
    assert cell == cells_of_page("uses")[feature, use]


@pytest.mark.parametrize(("first", "second"), list(combinations(OF_VEHICLE, 2)))
def test_pair(first: str, second: str, tmp_path: Path) -> None:
    case = Case(together(OF_VEHICLE[first], OF_VEHICLE[second]), tmp_path)
    assert pair_of(case) == cells_of_page("pairs")[first, second]


def test_no_cell_is_silent() -> None:
    assert cells_of_page("uses").keys() == {(f, d) for f in FEATURES for d in USES}
    assert cells_of_page("pairs").keys() == set(combinations(OF_VEHICLE, 2))
