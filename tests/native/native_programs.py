"""The C sources compiled by gcc in several ways, and the programs of tests/native with them."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fmpy
from outside_tools import missing

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.contact import kernel

NATIVE = Path(__file__).parent
WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-g1")
# Ways to compile. The vectors' files cost gcc five times as much with -O1 under the sanitizers.
SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
THREADED = ("-O1", "-fsanitize=thread")
PLAIN = ("-O1",)
COUNTED = ("-O0", "--coverage", "-fPIC")
# What the linker needs for test_allocation.c.
WRAPPED = tuple(f"-Wl,--wrap={name}" for name in ("malloc", "calloc", "realloc", "free"))


def gcc() -> str:
    """The compiler; without it the test is skipped, but not in CI."""
    found = shutil.which("gcc")
    if found is None:
        missing("there is no gcc")
    return found


class Build:
    """The sources compiled in one way, once, in a folder; programs are linked to them."""

    def __init__(self, folder: Path, way: tuple[str, ...]) -> None:
        self.folder, self.way, self.flags = folder, way, flags()
        with ThreadPoolExecutor(2) as pool:
            sources = sorted(package_folder("fmu").glob("*.c"))
            self.objects = list(pool.map(self._compiled, sources))

    def _compiled(self, source: Path) -> Path:
        made = self.folder / f"{source.stem}.o"
        way = self.way
        if source.stem.startswith("wide_") and way == SANITIZED:
            way = ("-O0", *way[1:])
        run(gcc(), *self.flags, *way, "-c", source, "-o", made)
        return made

    def program(self, name: str, *flags: str) -> Path:
        """A program of tests/native with all of the sources; `flags` are of the linker."""
        made = self.folder / name
        if made.exists():
            return made
        source = (NATIVE / f"{name}.c", *self.objects)
        run(gcc(), *self.flags, *self.way, "-pthread", *source, *flags, "-lm", "-o", made)
        return made

    def library(self) -> Path:
        """The sources as a library like an FMU's."""
        made = self.folder / "library.so"
        run(gcc(), *self.way, "-shared", *self.objects, "-lm", "-o", made)
        return made


def flags() -> tuple[str, ...]:
    """How the sources and all programs are compiled, by any compiler."""
    headers = Path(fmpy.__file__).parent / "c-code"
    token = f'-DCONTACTLIB_TOKEN="{kernel.token()}"'
    return (*WARNINGS, token, f"-isystem{headers}", f"-I{package_folder('fmu')}", f"-I{NATIVE}")


def alone(source: Path, folder: Path, *way: str) -> Path:
    """A program without the sources: it opens an FMU's library by itself, or needs none."""
    made = folder / source.stem
    run(gcc(), *flags(), *(way or ("-O2",)), source, "-pthread", "-ldl", "-lm", "-o", made)
    return made


def run(*command: object) -> None:
    """Run a command that must not fail, and show what it says if it does."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, f"{command[0]}: {done.stdout}{done.stderr}"


def clean(command: Iterable[object], **environment: str) -> None:
    """Run a program of tests/native, which says how many of its checks failed."""
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, env=os.environ | environment)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-6000:]
    assert done.stdout.strip() == "0 failures"


class Fmu:
    """An FMU that was exported and unpacked: what a program needs to make an instance of it."""

    def __init__(self, model: cl.Model, folder: Path, **options: Any) -> None:
        path = folder.parent / f"{folder.name}.fmu"
        cl.export_fmu(model, path, platforms=[kernel.platform_name()], **options)
        folder = Path(fmpy.extract(str(path), unzipdir=str(folder)))
        self.description = fmpy.read_model_description(str(folder))
        self.version: str = self.description.fmiVersion[0]
        self.token: str = self.description.guid or self.description.instantiationToken
        self.resources = folder / "resources"
        (self.library,) = folder.glob(
            f"binaries/*/*{kernel.library_path(kernel.platform_name()).suffix}"
        )
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}

    @property
    def location(self) -> str:
        """The resources as the tool names them."""
        return f"{self.resources}/" if self.version == "3" else self.resources.as_uri()
