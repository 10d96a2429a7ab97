"""Resources and saved states that no export wrote: damaged, of another version, or impossible."""

from __future__ import annotations

import shutil
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from exported_fmu import exported
from fmu_instance import Instance

import contactlib as cl

FRAME = 24  # bytes before what a file holds
Damage = Callable[[bytes], bytes | None]


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


def with_number(value: float) -> Damage:
    """The first number after that of the wheels is replaced."""
    return lambda data: sealed(data, FRAME + 16, "<d", value)


def of_version(change: int) -> Damage:
    return lambda data: data[:8] + bytes([data[8] + change]) + data[9:]


DAMAGES: list[tuple[str, Damage, str]] = [
    *(
        (file, damage, message)
        for file in ("creep_table.bin", "lateral_spin_contact.bin", "start_values.bin")
        for damage, message in (
            (lambda data: None, "cannot open"),
            (lambda data: data[:-1], "length"),
            (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "checksum"),
            (of_version(-1), "the file has an older format version"),
            (of_version(1), "the file has a newer format version"),
        )
    ),
    ("start_values.bin", with_number(float("nan")), "the file holds a value out of range"),
    ("start_values.bin", with_number(-1e300), "the file holds a value out of range"),
]


@pytest.mark.parametrize(("file", "damage", "message"), DAMAGES)
def test_a_bad_resource_is_a_clear_message(
    folder: Path, tmp_path: Path, file: str, damage: Damage, message: str
) -> None:
    shutil.copytree(folder, tmp_path / "sent")
    path = tmp_path / "sent" / "resources" / file
    data = damage(path.read_bytes())
    path.unlink()
    if data is not None:
        path.write_bytes(data)
    log: list[tuple[str, str]] = []
    with pytest.raises(Exception, match="instantiate"):
        Instance(tmp_path / "sent", log=log, logging=False)
    assert log[-1][1].startswith(f"resource {file}: ")
    assert message in log[-1][1]


def test_saved_state_that_no_instance_wrote_is_refused(folder: Path) -> None:
    with Instance(folder).start(friction_scale=0.75) as fmu:
        fmu.step(0.0, 0.01)
        values = fmu.get("friction_scale", "creep_force")
        data = fmu.saved()
        friction, force = (data.index(struct.pack("<d", value)) for value in values)
        tolerance = FRAME + 80 + 8 * (32 * 6 + 1)  # after the token, truth values and stop time
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
