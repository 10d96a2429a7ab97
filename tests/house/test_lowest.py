"""Every dependency has a lower bound, which CI installs."""

from __future__ import annotations

import tomllib

import pytest
from lowest import PYPROJECT, lowest

PROJECT = tomllib.loads(PYPROJECT.read_text())["project"]


def test_every_requirement_of_a_user_and_a_tester_is_there_at_its_bound() -> None:
    bounds = lowest(PROJECT, "test")
    optional = PROJECT["optional-dependencies"]
    for requirement in (*PROJECT["dependencies"], *optional["control"], *optional["test"][1:]):
        assert requirement.split(">=")[0] in bounds
    assert bounds["fmpy"] == "0.3.30"  # not that of the users' extra


def test_a_requirement_without_a_bound_is_refused() -> None:
    open_ended = {"name": "x", "dependencies": ["numpy"], "optional-dependencies": {}}
    with pytest.raises(ValueError, match="numpy has no lower bound"):
        lowest(open_ended)
