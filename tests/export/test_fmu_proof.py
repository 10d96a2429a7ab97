"""Every FMU that is exported passes `fmu_proof`, which finds a fault that was planted."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from exported_fmu import fitting
from fmu_instance import EXPORTS
from fmu_proof import faults

import contactlib as cl
from contactlib import kernel
from contactlib.export.platforms import PLATFORMS


@pytest.mark.parametrize(
    ("name", "version", "given"),
    [
        *((name, 3, {}) for name in EXPORTS),
        ("force_element", 2, {}),
        ("vehicle", 2, {"brake_pressure": True}),
    ],
)
def test_every_fmu_is_faultless(
    locomotive: cl.Model, tmp_path: Path, name: str, version: int, given: dict[str, bool]
) -> None:
    built = [platform for platform in PLATFORMS if kernel.library_path(platform).is_file()]
    options = {**EXPORTS[name], "fmi_version": version, "platforms": built, **given}
    path = cl.export_fmu(fitting(locomotive, name), tmp_path / "x.fmu", **options)
    assert list(faults(path, everywhere=len(built) == len(PLATFORMS))) == []


def test_a_planted_fault_is_found(rig: cl.Model, tmp_path: Path) -> None:
    path = cl.export_fmu(rig, tmp_path / "x.fmu")
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("x.txt", "built in /home/someone/here")
    (fault,) = faults(path)
    assert fault.startswith("x.txt has a path of a machine")
