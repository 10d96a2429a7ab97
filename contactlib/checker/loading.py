"""Try the library that is for this machine, in a process of its own."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import fmpy

from contactlib.checker.binaries import library_path
from contactlib.checker.definitions import TOKENS
from contactlib.checker.description import INTERFACES
from contactlib.checker.libraries import read_libraries
from contactlib.checker.xml import is_true

PROGRAM = Path(__file__).with_name("instantiate.py")
TIME_LIMIT = 60.0


def loading_problems(
    files: Mapping[str, bytes], root: Any, version: int, time_limit: float = TIME_LIMIT
) -> Iterator[str]:
    """What goes wrong when each interface is instantiated and freed on this machine."""
    found = loadable(files, root, version)
    if not found:
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch) / "fmu"
        for name, data in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        for interface, path in found.items():
            identifier, token = Path(path).stem, root.get(TOKENS[version])
            arguments = [str(folder), str(version), interface, identifier, token]
            if problem := _run(arguments, scratch, time_limit):
                yield f"{path} {problem} for {interface}"


def loadable(files: Mapping[str, bytes], root: Any, version: int) -> dict[str, str]:
    """Library for this machine of each interface that has one and needs no other tool."""
    folder = fmpy.platform if version == 2 else fmpy.platform_tuple
    found = {}
    for interface in INTERFACES:
        for element in root.iterfind(interface):
            identifier = element.get("modelIdentifier")
            path = library_path(folder, identifier, fmpy.sharedLibraryExtension)
            needs_tool = is_true(element.get("needsExecutionTool"))
            if path in files and _is_for_this_machine(files[path]) and not needs_tool:
                found[interface] = path
    return found


def _is_for_this_machine(data: bytes) -> bool:
    # FMPy takes linux64 for its own on every machine of 64 bits.
    try:
        return any(library.platform == fmpy.platform_tuple for library in read_libraries(data))
    except ValueError:
        return False


def _run(arguments: list[str], folder: str, time_limit: float) -> str:
    # Without -P modules of this folder would stand before those of the same name elsewhere.
    command = [sys.executable, "-P", str(PROGRAM), *arguments]
    try:
        done = subprocess.run(  # noqa: S603 - arguments of our own, no shell
            command, cwd=folder, capture_output=True, text=True, errors="replace",
            timeout=time_limit, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"took more than {time_limit:g} s to instantiate"
    if done.returncode == 0:
        return ""
    said = "; ".join(line.strip() for line in (done.stdout + done.stderr).splitlines() if line)
    if done.returncode != 1:
        try:
            name = signal.Signals(-done.returncode).name
        except ValueError:
            name = f"exit status {done.returncode}"
        return f"crashed ({name}) when instantiated"
    return f"could not be instantiated ({said})"
