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

from contactlib.checker.archive import is_safe
from contactlib.checker.binaries import library_path
from contactlib.checker.definitions import TOKENS
from contactlib.checker.description import INTERFACES
from contactlib.checker.xml import is_true

PROGRAM = Path(__file__).with_name("instantiate.py")
TIME_LIMIT = 60.0


def loading_problems(
    files: Mapping[str, bytes], root: Any, version: int, time_limit: float = TIME_LIMIT
) -> Iterator[str]:
    """What goes wrong when each interface is instantiated and freed on this machine."""
    elements = [(name, e) for name in INTERFACES for e in root.iterfind(name)]
    paths = {name: host_library(e, version) for name, e in elements}
    if not any(path in files for path in paths.values()) or not all(map(is_safe, files)):
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch) / "fmu"
        for name, data in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        for interface, element in elements:
            # A tool on another machine may have what this one has not.
            if paths[interface] in files and not is_true(element.get("needsExecutionTool")):
                token = root.get(TOKENS[version], "")
                arguments = [str(version), interface, element.get("modelIdentifier", ""), token]
                if problem := _run([str(folder), *arguments], scratch, time_limit):
                    yield f"{paths[interface]} {problem} for {interface}"


def host_library(interface: Any, version: int) -> str:
    """Where the library for this machine should be."""
    folder = fmpy.platform if version == 2 else fmpy.platform_tuple
    identifier = interface.get("modelIdentifier", "")
    return library_path(folder, identifier, fmpy.sharedLibraryExtension)


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
