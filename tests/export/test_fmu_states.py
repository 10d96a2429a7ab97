"""What an FMU remembers: nothing of other instances, and all of it in a saved state."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import fmu_run
import pytest
from exported_fmu import exported
from fmu_instance import EXPORTS, Instance, Subject

import contactlib as cl

BEFORE, AFTER = 330, 200  # steps before and after a state is saved, as the wheel passes the peak


# What a state holds is one for both versions, which hand it over in their own calls.
SUBJECTS = [*(Subject(name, 3) for name in EXPORTS), Subject("wheelset-memory", 2)]


@pytest.fixture(scope="module", params=SUBJECTS, ids=str)
def subject(request: pytest.FixtureRequest) -> Subject:
    chosen: Subject = request.param
    return chosen


@pytest.fixture(scope="module")
def folder(
    subject: Subject, locomotive: cl.Model, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    return exported(locomotive, tmp_path_factory.mktemp("fmu"), *subject)


def test_saved_state_goes_on_here_and_in_another_process(folder: Path, tmp_path: Path) -> None:
    state = tmp_path / "state.bin"
    with Instance(folder).start() as fmu:
        fmu_run.run(fmu, 0, BEFORE)
        state.write_bytes(fmu.saved())
        kept = fmu.fmu.getFMUState()
        expected = fmu_run.run(fmu, BEFORE, AFTER)
        outer = ("normal_load", "resistance_force", "rear_coupler_force")
        fmu.set(**{next(name for name in outer if name in fmu.references): 1e5})
        fmu.fmu.setFMUState(kept)
        fmu.fmu.freeFMUState(kept)
        assert fmu_run.run(fmu, BEFORE, AFTER) == expected
    other = subprocess.run(
        [sys.executable, fmu_run.__file__, str(folder), str(state), str(BEFORE), str(AFTER)],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert other.stdout.splitlines() == expected
    assert len(set(expected)) > AFTER // 2
