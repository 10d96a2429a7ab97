"""What must be true of every FMU that contactlib writes: archive, description, sources, libraries.

    python tests/export/fmu_proof.py FMU ...

prints what is wrong with FMUs that carry the libraries of all platforms, and exits with 1 if
anything is. FMPy checks modelDescription.xml; the rules here are those that it does not know, and
our own. The library for this machine is loaded and instantiated.
"""

from __future__ import annotations

import re
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import chdir
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import fmpy
import lief
from fmpy.validation import validate_fmu
from fmu_instance import Instance
from lxml import etree

FMPY = Path(fmpy.__file__).parent
lief.logging.disable()  # which reports on stderr what it does not find
# The newest glibc or macOS that the library for each platform may require.
NEWEST: dict[str, tuple[int, ...]] = {
    "x86_64-linux": (2, 17),
    "aarch64-linux": (2, 17),
    "x86_64-windows": (),
    "x86_64-darwin": (10, 15),
    "aarch64-darwin": (11, 0),
}
# Platforms whose libraries are in each folder of binaries/, by the version of FMI.
FOLDERS: dict[int, dict[str, list[str]]] = {
    2: {
        "linux64": ["x86_64-linux"],
        "aarch64-linux": ["aarch64-linux"],
        "win64": ["x86_64-windows"],
        "darwin64": ["x86_64-darwin", "aarch64-darwin"],
        "aarch64-darwin": ["aarch64-darwin"],
    },
    3: {name: [name] for name in NEWEST},
}
SUFFIXES = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}
SYSTEM_LIBRARY = re.compile(
    r"lib[cm]\.so\.6|kernel32\.dll|api-ms-win-crt-[-\w]+\.dll|/usr/lib/libSystem\.B\.dylib", re.I
)
# A folder of the machine that built it; libraries of the system lie elsewhere.
MACHINE = re.compile(
    rb"/(?:tmp|home|root|Users|private|var/folders|builds?|workspace|opt|mnt)/[\w.-]"
    rb"|[A-Za-z]:\\\\?(?:Users|a|hostedtoolcache)\\|site-packages/|\.pdb\b"
)
SCHEMAS = {
    "sources/buildDescription.xml": "fmi3BuildDescription.xsd",
    "terminalsAndIcons/terminalsAndIcons.xml": "fmi3TerminalsAndIcons.xsd",
}


class Library(NamedTuple):
    """A shared library for one processor."""

    platform: str
    """FMI 3 platform tuple."""
    exports: set[str]
    needs: list[str]
    """Names of other libraries."""
    oldest: tuple[int, ...]
    """Oldest glibc or macOS that it runs on; empty if the file does not state it."""


def libraries(path: Path) -> list[Library]:
    """The shared libraries in an ELF, PE or Mach-O file; none if it is something else."""
    file: Any
    if lief.is_elf(str(path)):
        file = lief.ELF.parse(str(path))
        if file.header.file_type != lief.ELF.Header.FILE_TYPE.DYN:
            return []
        versions = [
            tuple(map(int, version.name.removeprefix("GLIBC_").split(".")))
            for needed in file.symbols_version_requirement
            for version in needed.get_auxiliary_symbols()
        ]
        exports = {symbol.name for symbol in file.exported_symbols}
        oldest = max(versions, default=())
        return [
            Library(
                _platform(file.header.machine_type, "linux"), exports, list(file.libraries), oldest
            )
        ]
    if lief.is_pe(str(path)):
        file = lief.PE.parse(str(path))
        if not file.header.has_characteristic(lief.PE.Header.CHARACTERISTICS.DLL):
            return []
        exports = {entry.name for entry in file.get_export().entries}
        needs = [imported.name for imported in file.imports]
        return [Library(_platform(file.header.machine, "windows"), exports, needs, ())]
    entries = []
    if lief.is_macho(str(path)):
        id_command = lief.MachO.LoadCommand.TYPE.ID_DYLIB
        file = lief.MachO.parse(str(path))  # a name, as its parts do not keep it alive
        for part in file:
            if part.header.file_type == lief.MachO.Header.FILE_TYPE.DYLIB:
                exports = {symbol.name.removeprefix("_") for symbol in part.exported_symbols}
                needs = [each.name for each in part.libraries if each.command != id_command]
                oldest = tuple(part.build_version.minos)[:2] if part.has_build_version else ()
                platform = _platform(part.header.cpu_type, "darwin")
                entries.append(Library(platform, exports, needs, oldest))
    return entries


def _platform(machine: Any, system: str) -> str:
    processors = {"AMD64": "x86_64", "X86_64": "x86_64", "ARM64": "aarch64", "AARCH64": "aarch64"}
    return f"{processors.get(machine.name, machine.name)}-{system}"


def faults(fmu: Path, *, everywhere: bool = False) -> Iterator[str]:
    """What is wrong with an FMU, which has the libraries of all platforms if `everywhere`."""
    with zipfile.ZipFile(fmu) as archive, tempfile.TemporaryDirectory() as scratch:
        yield from _archive(archive)
        if problems := validate_fmu(str(fmu)):
            yield from problems
            return
        archive.extractall(scratch)
        description = fmpy.read_model_description(str(fmu))
        yield from _description(description)
        names = archive.namelist()
        yield from _companions(Path(scratch), names, description)
        folders = {name.split("/")[1] for name in names if name.startswith("binaries/")}
        known = FOLDERS[int(description.fmiVersion[0])]
        if everywhere and (lacking := known.keys() - folders):
            yield f"binaries/ lacks {sorted(lacking)}"
        if not folders:
            yield "there is no library"
        for folder in sorted(folders):
            if folder not in known:
                yield f"binaries/{folder} is the folder of no platform"
                continue
            yield from _binary(Path(scratch), folder, known[folder], description)
        if {fmpy.platform, fmpy.platform_tuple} & folders:
            yield from _instances(Path(scratch))


def _archive(archive: zipfile.ZipFile) -> Iterator[str]:
    if damaged := archive.testzip():
        yield f"{damaged} is damaged"
    for name, times in Counter(name.casefold() for name in archive.namelist()).items():
        if times > 1:
            yield f"{name}: {times} names that differ in nothing but case"
    for entry in archive.infolist():
        path = PurePosixPath(entry.filename)
        if path.is_absolute() or ".." in path.parts or str(path) != entry.filename:
            yield f"{entry.filename} is no relative path of a file"
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            yield f"{entry.filename}: compression method {entry.compress_type}"
        if match := MACHINE.search(archive.read(entry)):
            yield f"{entry.filename} has a path of a machine: {match[0]!r}"


def _description(description: Any) -> Iterator[str]:
    variables = description.modelVariables
    for v in variables:
        if v.type in ("Real", "Float64") and v.unit is None:
            yield f"{v.name} has no unit"
        low, high, nominal = float(v.min or "-inf"), float(v.max or "inf"), float(v.nominal or 1)
        if not low < high or nominal <= 0.0:
            yield f"{v.name}: min {low:g}, max {high:g}, nominal {nominal:g}"
        if v.type != "Boolean" and v.start is not None and not low <= float(v.start) <= high:
            yield f"{v.name}: start {v.start} must be from {low:g} to {high:g}"
    rates = [unknown.variable for unknown in description.derivatives]
    if lacking := [v.name for v in variables if v.derivative is not None and v not in rates]:
        yield f"ModelStructure lacks the derivatives {lacking}"
    states = [rate.derivative for rate in rates]
    given = [v for v in variables if v.causality in ("input", "independent", "parameter")]
    exact = [v for v in variables if v.initial == "exact"]
    initial = description.initialUnknowns
    for unknowns, knowns in (
        (description.outputs, [*given, *states]),
        (description.derivatives, [*given, *states]),
        (description.eventIndicators, [*given, *states]),
        (initial, [*given, *exact]),
    ):
        listed = [unknown.variable.name for unknown in unknowns]
        if len(set(listed)) < len(listed):
            yield f"ModelStructure lists one twice: {listed}"
        for unknown in unknowns:
            needed = unknown.dependencies or []
            if len({v.name for v in needed}) < len(needed) or any(v not in knowns for v in needed):
                names = [v.name for v in needed]
                yield f"{unknown.variable.name} depends on {names}, not all known or one twice"
    places = [variables.index(unknown.variable) for unknown in initial]
    if description.fmiVersion == "2.0" and places != sorted(places):
        yield "InitialUnknowns are not in the order of the variables"
    for interface in (description.coSimulation, description.modelExchange):
        if not (interface and interface.canGetAndSetFMUstate and interface.canSerializeFMUstate):
            yield "an interface lacks, or cannot save its state"
    experiment = description.defaultExperiment
    if not 0.0 < float(experiment.stepSize) < float(experiment.stopTime):
        yield f"step {experiment.stepSize} and stop time {experiment.stopTime} of the experiment"


def _companions(folder: Path, names: Iterable[str], description: Any) -> Iterator[str]:
    if "documentation/index.html" not in names:
        yield "documentation/index.html is missing"
    listed = [name for each in description.buildConfigurations for files in each.sourceFileSets
              for name in files.sourceFiles]  # fmt: skip
    if not listed:
        yield "no sources are listed"
    for name in sorted({f"sources/{name}" for name in listed} - set(names)):
        yield f"{name} is missing"
    variables = {v.name for v in description.modelVariables}
    for name, schema in SCHEMAS.items():
        if name in names:
            document = etree.parse(folder / name)
            rules = etree.XMLSchema(file=str(FMPY / "schema" / "fmi3" / schema))
            if not rules.validate(document):
                yield f"{name}: {rules.error_log.last_error}"
            for member in document.iterfind(".//TerminalMemberVariable"):
                if member.get("variableName") not in variables:
                    yield f"{name}: there is no variable {member.get('variableName')}"


def _binary(scratch: Path, folder: str, platforms: list[str], description: Any) -> Iterator[str]:
    version = description.fmiVersion[0]
    path = scratch / "binaries" / folder / description.modelName
    path = path.with_suffix(SUFFIXES[platforms[0].split("-")[1]])
    what = path.relative_to(scratch).as_posix()
    if not path.is_file():
        yield f"{what} is missing"
        return
    header = (FMPY / "c-code" / f"fmi{version}Functions.h").read_text()
    functions = set(re.findall(rf"#define (fmi{version}\w+)\s+fmi{version}FullName", header))
    parts = libraries(path)
    if not parts or not {each.platform for each in parts} <= set(platforms):
        yield f"{what} is for {[each.platform for each in parts]}, must be for {platforms}"
    for each in parts:
        if lacking := functions - each.exports:
            yield f"{what} does not export {sorted(lacking)}"
        if others := [name for name in each.needs if not SYSTEM_LIBRARY.fullmatch(name)]:
            yield f"{what} needs {others}"
        newest = NEWEST.get(each.platform, ())
        if each.oldest > newest or (newest and not each.oldest):
            yield f"{what} needs glibc or macOS {each.oldest}, must name one up to {newest}"


def _instances(folder: Path) -> Iterator[str]:
    for exchange in (False, True):
        log: list[tuple[str, str]] = []
        try:
            with chdir(folder), Instance(folder, exchange=exchange, log=log) as made:
                made.start()
        except Exception as error:  # FMPy raises bare exceptions
            yield f"cannot be instantiated: {error} {log}"


def main(paths: list[str]) -> int:
    lines = [f"{path}: {fault}" for path in paths for fault in faults(Path(path), everywhere=True)]
    print(*(lines or [f"{len(paths)} FMUs are as they must be"]), sep="\n")
    return 1 if lines or not paths else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
