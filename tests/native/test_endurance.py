"""What long runs of an FMU leave behind: short ones here, whole ones by endurance.py."""

from __future__ import annotations

from pathlib import Path

import endurance
import pytest
from native_programs import compiler

import contactlib as cl

pytestmark = [pytest.mark.tools, pytest.mark.usefixtures("gcc")]


@pytest.fixture(scope="module")
def gcc() -> str:
    return compiler("gcc")


def test_instances_that_come_and_go_leave_nothing(locomotive: cl.Model, tmp_path: Path) -> None:
    for subject, growth in endurance.growths(locomotive, tmp_path, 300):
        assert growth.allocated == 0, subject
        assert growth.files == 0, subject
        assert growth.pages <= 64, subject  # the system counts them in lots


def test_trips_do_not_drift(locomotive: cl.Model, tmp_path: Path) -> None:
    done = endurance.run(locomotive, tmp_path, 3)
    first, *others = done.trips
    assert len({trip[:-1] for trip in others}) == 1  # every bit of every value
    assert first.fastest > 20.0
    assert first.fastest_backward < -2.0
    assert abs(others[-1].speed) < 1e-12
    assert others[-1].pages - first.pages <= 64
    assert done.energy_defect < 1e-7


@pytest.mark.parametrize("points", ["added", "counted"])
def test_time_is_the_tool_s(locomotive: cl.Model, tmp_path: Path, points: str) -> None:
    done = endurance.run(locomotive, tmp_path, 1, points)
    assert done.fmu_time == done.tool_time
    assert done.tool_time == pytest.approx(600.0, abs=1e-6)
