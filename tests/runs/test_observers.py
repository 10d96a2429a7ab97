"""Observers of runs before they have seen anything."""

from __future__ import annotations

import pytest

from contactlib.runs.observers import _known


def test_an_outcome_without_rows_has_no_value() -> None:
    with pytest.raises(ValueError, match="there is no row yet"):
        _known(None)
