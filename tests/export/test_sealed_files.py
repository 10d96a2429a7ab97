"""Files of an FMU whose checksum is right, and which hold what no tool can have written."""

from __future__ import annotations

import shutil
import struct
import zlib
from pathlib import Path

import pytest
from exported_fmu import exported
from fmu_instance import Instance

import contactlib as cl

FRAME = 24  # bytes before what a file holds


def sealed(data: bytes, at: int, layout: str, value: float) -> bytes:
    """The same bytes with another number, and a checksum that fits."""
    changed = bytearray(data)
    struct.pack_into(layout, changed, at, value)
    struct.pack_into("<I", changed, 12, zlib.crc32(changed[16:]))
    return bytes(changed)


@pytest.fixture(scope="module", params=[2, 3])
def folder(
    request: pytest.FixtureRequest, rig: cl.Model, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    return exported(rig, tmp_path_factory.mktemp("sealed"), "wheelset", request.param)


@pytest.mark.parametrize("value", [float("nan"), -1e300])
def test_start_values_that_no_export_wrote_are_refused(
    folder: Path, tmp_path: Path, value: float
) -> None:
    shutil.copytree(folder, tmp_path / "sent")
    path = tmp_path / "sent" / "resources" / "start_values.bin"
    path.write_bytes(sealed(path.read_bytes(), FRAME + 16, "<d", value))
    log: list[tuple[str, str]] = []
    with pytest.raises(Exception, match="instantiate"):
        Instance(tmp_path / "sent", log=log)
    assert log[-1][1] == "resource start_values.bin: the file holds a value out of range"


def test_saved_state_that_no_instance_wrote_is_refused(folder: Path) -> None:
    with Instance(folder).start(friction_scale=0.75) as fmu:
        fmu.step(0.0, 0.01)
        values = fmu.get("friction_scale", "creep_force")
        data = fmu.saved()
        friction, force = (data.index(struct.pack("<d", value)) for value in values)
        tolerance = FRAME + 80 + 8 * (32 * 5 + 1)  # after the token, truth values and stop time
        stage = tolerance + 8
        for at, layout, value in [
            (friction, "<d", -1.0),
            (force, "<d", float("nan")),
            (tolerance, "<d", 0.0),
            (stage, "<i", -1),
            (stage, "<i", 99),
        ]:
            fmu.log.clear()
            with fmu.refused("saved state: a value in it is not possible"):
                fmu.restore(sealed(data, at, layout, value))
        fmu.restore(sealed(data, friction, "<d", 0.5))  # which one can
        assert fmu.get("friction_scale") == [0.5]
