"""Every dependency has a lower bound, which CI installs."""

from __future__ import annotations

import tomllib

import pytest
from lowest import PYPROJECT, lowest

PROJECT = tomllib.loads(PYPROJECT.read_text())["project"]


def test_every_requirement_of_a_user_and_a_tester_is_there_at_its_bound() -> None:
    found = list(lowest(PROJECT, "test"))
    assert len(set(found)) == len(found)
    named = {line.split("==")[0] for line in found}
    for requirement in (*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["cluster"]):
        assert requirement.split(">=")[0] in named


def test_a_requirement_without_a_bound_is_refused() -> None:
    open_ended = {"name": "x", "dependencies": ["numpy"], "optional-dependencies": {}}
    with pytest.raises(ValueError, match="numpy has no lower bound"):
        list(lowest(open_ended))
