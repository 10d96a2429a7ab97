"""Every line of the C sources is run by a program in C."""

from __future__ import annotations

from pathlib import Path

import line_coverage
import pytest

import contactlib as cl

pytestmark = pytest.mark.tools


def test_every_line_is_run_or_has_a_reason(
    locomotive: cl.Model, cohesive_table: cl.CreepForceTable, tmp_path: Path
) -> None:
    found = line_coverage.measured(locomotive, line_coverage.shapes(cohesive_table), tmp_path)
    assert not [
        str(line) for line in line_coverage.not_run(found) if line_coverage.reason(line) is None
    ]
    compiled = {path.name for path in line_coverage.sources("*.c")}
    widths = ("portable", "avx2", "avx512")
    of_headers = {f"simd_{kind}{width}.c" for width in widths for kind in ("", "wheels_")}
    assert compiled - set(found) <= of_headers | {"drivetrain_in_turn.c"}


def test_every_reason_is_of_a_line() -> None:
    for name, reasons in line_coverage.NOT_RUN.items():
        assert set(reasons) <= set(line_coverage.lines(name))


def test_only_windows_has_statements_that_are_not_compiled() -> None:
    assert {line.file for line in line_coverage.not_compiled()} == {"file_io.c"}
