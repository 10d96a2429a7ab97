"""Rules on the shared libraries of an FMU, whatever machine they are for."""

from __future__ import annotations

import inspect
import posixpath
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from typing import Any

from fmpy import fmi2, fmi3

from contactlib.checker.companions import has_sources
from contactlib.checker.description import INTERFACES
from contactlib.checker.libraries import read_libraries
from contactlib.checker.library import Library, Version

# FMI 2.0.4 says that 64 means x86_64; earlier ones do not, and importers on Arm look there too.
FMI2_PLATFORMS = {
    "linux32": ("x86-linux",),
    "linux64": ("x86_64-linux", "aarch64-linux"),
    "win32": ("x86-windows",),
    "win64": ("x86_64-windows", "aarch64-windows"),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),
}
FMI3_PLATFORM = re.compile(r"(aarch32|aarch64|riscv32|riscv64|x86|x86_64|ppc32|ppc64)-[a-z]+")
SUFFIXES = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}
NEWEST_NEEDED: dict[str, Version] = {"glibc": (2, 28), "macOS": (11, 0)}
# What is on every machine of its kind, and may differ in case on Windows.
SYSTEM_LIBRARIES = {
    "linux": re.compile(r"(lib(c|m|dl|pthread|rt)|ld-linux[-\w]*)\.so(\.\d+)*"),
    "windows": re.compile(
        r"(kernel32|ntdll|msvcrt|ucrtbase|user32|advapi32|shell32|ole32|ws2_32|"
        r"bcrypt(primitives)?|api-ms-win-[-\w]+)\.dll",
        re.IGNORECASE,
    ),
    "darwin": re.compile(r"/usr/lib/.+|/System/Library/.+"),
}


def binary_problems(files: Mapping[str, bytes], root: Any, version: int) -> Iterator[str]:
    """What is wrong with the files in binaries/."""
    folders = binary_folders(files)
    if not folders and not has_sources(files, root):
        yield "binaries/ is missing, and there are no sources either"
    for folder in folders:
        platforms = _platforms(folder, version)
        if platforms is None:
            known = ", ".join(FMI2_PLATFORMS)
            yield f"binaries/{folder} is no platform of FMI 3.0, nor of FMI 2.0 ({known})"
            continue
        suffix = SUFFIXES.get(platforms[0].split("-")[1])
        if suffix is None:
            continue
        for identifier, needed in _functions_by_library(root, version).items():
            path = library_path(folder, identifier, suffix)
            if path not in files:
                yield f"{path} is missing"
                continue
            try:
                libraries = read_libraries(files[path])
            except ValueError as error:
                yield f"{path} {error}"
                continue
            for problem in _library_problems(libraries, platforms, needed, set(files), path):
                yield f"{path} {problem}"


def binary_folders(files: Mapping[str, bytes]) -> list[str]:
    """Names of the folders in binaries/."""
    parts = (name.split("/") for name in files)
    return sorted({part[1] for part in parts if part[0] == "binaries" and len(part) > 2})


def library_path(folder: str, identifier: str, suffix: str) -> str:
    """Where the standard wants a library."""
    return f"binaries/{folder}/{identifier}{suffix}"


@cache
def needed_functions(interface: str, version: int) -> frozenset[str]:
    """What the library must export: in FMI 2.0 all of the interface, in FMI 3.0 simply all.

    This is also so for functions that only serve capabilities which the FMU does not have.
    """
    if version == 3:
        classes = [fmi3.FMU3Model, fmi3.FMU3Slave, fmi3.FMU3ScheduledExecution]
    else:
        classes = [fmi2.FMU2Model if interface == "ModelExchange" else fmi2.FMU2Slave]
    members = (name for each in classes for name, _ in inspect.getmembers(each))
    return frozenset(name for name in members if name.startswith(f"fmi{version}"))


def oldest_systems(files: Mapping[str, bytes]) -> Iterator[str]:
    """What each library runs on, such as ``linux64 (glibc 2.17)``."""
    for folder in binary_folders(files):
        systems = set()
        for name, data in files.items():
            if name.startswith(f"binaries/{folder}/") and name.endswith(tuple(SUFFIXES.values())):
                with suppress(ValueError):  # beside the FMU's own libraries anything may stand
                    systems |= {library.oldest_system for library in read_libraries(data)}
        said = ", ".join(f"{name} {_dotted(v)}" for name, v in sorted(filter(None, systems)))
        yield f"{folder} ({said})" if said else folder


def _functions_by_library(root: Any, version: int) -> dict[str, frozenset[str]]:
    """One library may serve several interfaces."""
    needed: dict[str, frozenset[str]] = {}
    for interface in INTERFACES:
        for element in root.iterfind(interface):
            identifier = element.get("modelIdentifier", "")
            functions = needed_functions(interface, version)
            needed[identifier] = needed.get(identifier, frozenset()) | functions
    return needed


def _platforms(folder: str, version: int) -> tuple[str, ...] | None:
    if version == 2 and folder in FMI2_PLATFORMS:
        return FMI2_PLATFORMS[folder]
    # What follows the system is the vendor's own: other compilers, static libraries.
    found = FMI3_PLATFORM.fullmatch(folder)
    return None if found is None else (found[0],)


def _library_problems(
    libraries: list[Library],
    platforms: tuple[str, ...],
    functions: frozenset[str],
    files: set[str],
    path: str,
) -> Iterator[str]:
    fitting = [library for library in libraries if library.platform in platforms]
    if not fitting:
        found = ", ".join(library.platform for library in libraries)
        yield f"is for {found}, must be for {' or '.join(platforms)}"
    for library in fitting:
        if not library.is_shared:
            yield "is no shared library"
        if missing := sorted(functions - library.exports):
            yield f"does not export {', '.join(missing)}"
        system = SYSTEM_LIBRARIES[library.platform.split("-")[1]]
        for other in library.needed:
            beside = posixpath.join(posixpath.dirname(path), posixpath.basename(other))
            if not system.fullmatch(other) and beside not in files:
                yield f"needs {other}, which is neither in the FMU nor on every machine"
        if library.oldest_system is not None:
            name, version = library.oldest_system
            if version > (newest := NEWEST_NEEDED[name]):
                yield f"needs {name} {_dotted(version)}, must not need more than {_dotted(newest)}"


def _dotted(version: Version) -> str:
    return ".".join(map(str, version))
