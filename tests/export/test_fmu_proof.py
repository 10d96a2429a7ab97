"""Every FMU that is exported passes `fmu_proof`, which finds what is wrong with others."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest
from exported_fmu import fitting
from fmu_instance import EXPORTS
from fmu_proof import faults, libraries

import contactlib as cl
from contactlib import kernel
from contactlib.export.platforms import PLATFORMS

Files = dict[str, bytes]
DESCRIPTION = "modelDescription.xml"
on_linux = pytest.mark.skipif(kernel.platform_name() != "x86_64-linux", reason="as are its faults")


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", EXPORTS)
def test_every_fmu_is_faultless(
    locomotive: cl.Model, tmp_path: Path, name: str, version: int
) -> None:
    built = [platform for platform in PLATFORMS if kernel.library_path(platform).is_file()]
    options = {**EXPORTS[name], "fmi_version": version, "platforms": built}
    path = cl.export_fmu(fitting(locomotive, name), tmp_path / "x.fmu", **options)
    assert list(faults(path, everywhere=len(built) == len(PLATFORMS))) == []


def replaced(name: str, old: bytes, new: bytes) -> Callable[[Files], Files]:
    """Replaces what matches, once, in the file whose name ends so."""

    def change(files: Files) -> Files:
        (path,) = (path for path in files if path.endswith(name))
        text, times = re.subn(old, new, files[path], count=1)
        assert times == 1
        return {**files, path: text}

    return change


def added(name: str, data: bytes = b"") -> Callable[[Files], Files]:
    return lambda files: {**files, name: data}


def without(name: str) -> Callable[[Files], Files]:
    return lambda files: {path: data for path, data in files.items() if not path.endswith(name)}


FAULTS: dict[str, tuple[Callable[[Files], Files], str]] = {
    "schema": (replaced(DESCRIPTION, b'valueReference="3"', b'valueReference="x"'), "valueRef"),
    "unit": (
        replaced(DESCRIPTION, b'(name="omega".*?) unit="rad/s"[^>]*?start', rb"\1 start"),
        "omega has no unit",
    ),
    "start": (replaced(DESCRIPTION, b'start="110325.0"', b'start="-1"'), "start -1 must be from"),
    "dependency": (
        replaced(DESCRIPTION, b'dependencies="\\d+ ', b'dependencies="29 '),
        "depends on",
    ),
    "state": (replaced(DESCRIPTION, b"canSerializeFMUState", b"needsExecutionTool"), "its state"),
    "documentation": (without("index.html"), "index.html is missing"),
    "source": (without("sources/model.c"), r"sources/model\.c is missing"),
    "terminal": (replaced("Icons.xml", b'variableName="omega"', b'variableName="x"'), "variable x"),
    "case": (added("Sources/MODEL.C"), "differ in nothing but case"),
    "path": (added("a/../../b"), "is no relative path"),
    "machine": (added("x.txt", b"built in /home/someone/here"), "has a path of a machine"),
    "folder": (added("binaries/x86_64-vax/x.so"), "is the folder of no platform"),
    "no library": (without("Element.so"), "there is no library"),
    "function": (
        replaced(".so", b"\0fmi3DoStep\0", b"\0fmi3DoStop\0"),
        "does not export.*fmi3DoStep",
    ),
    "library of another": (
        replaced(".so", b"\0libm.so.6\0", b"\0libx.so.6\0"),
        r"needs \['libx.so",
    ),
    "glibc": (replaced(".so", rb"\0GLIBC_2\.14\0", b"\0GLIBC_2.94\0"), r"needs glibc .*\(2, 94\)"),
    "table": (replaced("table.bin", rb"\Z", b"\0"), "cannot be instantiated.*creep_table.bin"),
}


@pytest.fixture(scope="module")
def exported(rig: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> Files:
    path = cl.export_fmu(rig, tmp_path_factory.mktemp("proof") / "x.fmu", fmi_version=3)
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def zipped(path: Path, files: Files) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


@pytest.mark.slow
@on_linux
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(fault: str, exported: Files, tmp_path: Path) -> None:
    change, message = FAULTS[fault]
    found = list(faults(zipped(tmp_path / "x.fmu", change(exported))))
    assert any(re.search(message, each) for each in found), found


@pytest.mark.parametrize(
    ("file", "folder", "message"),
    [
        ("win64/logging.dll", "x86_64-windows", "does not export"),
        ("win32/logging.dll", "x86_64-windows", "is for .*I386"),
        ("darwin64/logging.dylib", "x86_64-darwin", "is for .*aarch64-darwin"),
    ],
)
def test_a_library_for_another_system_is_read(
    file: str, folder: str, message: str, exported: Files, tmp_path: Path
) -> None:
    library = Path(fmpy.__file__).parent / "logging" / file
    assert {name for each in libraries(library) for name in each.exports} == {"addLoggerProxy"}
    path = f"binaries/{folder}/CreepForceElement{library.suffix}"
    files = {**exported, path: library.read_bytes()}
    found = list(faults(zipped(tmp_path / "x.fmu", files), everywhere=True))
    assert any(each.startswith(f"{path} ") and re.search(message, each) for each in found), found
    assert any(each.startswith("binaries/ lacks ") for each in found)
