"""The C sources compiled in several ways, and the programs of tests/native with them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from exported_fmu import fitting
from fmu_instance import EXPORTS
from numpy.typing import ArrayLike
from outside_tools import missing

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import c_sources, package_folder

NATIVE = Path(__file__).parent
INCLUDES = tuple(f"-I{package_folder('fmu') / name}" for name in ("kernel", "fmi"))
WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-g1")
# Ways to compile, the compiler first; libFuzzer's targets are linked to what is SANITIZED too.
STRICT = "-fno-sanitize-recover=all"
SANITIZED = ("clang", "-O1", "-fsanitize=fuzzer-no-link,address,undefined", STRICT)
INITIALIZED = ("clang", "-O1", "-fsanitize=memory", STRICT)
THREADED = ("gcc", "-O1", "-fsanitize=thread")
COUNTED = ("gcc", "-O0", "--coverage", "-fPIC")
# What the linker needs for test_allocation.c.
WRAPPED = tuple(f"-Wl,--wrap={name}" for name in ("malloc", "calloc", "realloc", "free"))


# Loops over many points: with the sanitizers' checks in them an optimizing compiler takes a minute.
LOOPS = re.compile("simd_|drivetrain_|lateral_spin_force|creep_forces|wheelset_")
# What reads bytes: only in these the fuzzer sees the operands of comparisons.
READERS = {"checked_file", "component", "creep_table", "file_io"}


def compiler(name: str) -> str:
    """A compiler, by its plain name or that with a version; without it the test is skipped, but
    not in CI."""
    names = [name, *(f"{name}-{version}" for version in range(21, 12, -1))]
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        missing(f"there is no {name}")
    return path


def compiled(source: Path, made: Path, way: tuple[str, ...], *options: str) -> Path:
    """Object file of one source."""
    if "-fsanitize" in " ".join(way) and LOOPS.match(source.stem):
        options = (*options, "-O0")
    if "fuzzer" in " ".join(way) and source.parent != NATIVE and source.stem not in READERS:
        options = (*options, "-fno-sanitize-coverage=trace-cmp")
    run(compiler(way[0]), *flags(), *way[1:], *options, "-c", source, "-o", made)
    return made


class Build:
    """The sources compiled in one way, once, in a folder; programs are linked to them."""

    def __init__(self, folder: Path, way: tuple[str, ...]) -> None:
        self.folder, self.way = folder, way
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            sources = c_sources("*.c")
            objects = pool.map(lambda path: compiled(path, folder / f"{path.stem}.o", way), sources)
            self.objects = list(objects)

    def program(self, name: str, *flags: str) -> Path:
        """A program of tests/native with all of the sources; `flags` are of the linker."""
        made = self.folder / name
        if made.exists():
            return made
        program = compiled(NATIVE / f"{name}.c", self.folder / f"{name}.o", self.way)
        self.link(made, program, *self.objects, "-pthread", *flags)
        return made

    def library(self) -> Path:
        """The sources as a library like an FMU's."""
        made = self.folder / "library.so"
        self.link(made, "-shared", *self.objects)
        return made

    def link(self, made: Path, *parts: object) -> None:
        name, *options = self.way
        run(compiler(name), *options, *parts, "-lm", "-o", made)


def flags() -> tuple[str, ...]:
    """How the sources and all programs are compiled, by any compiler."""
    headers = Path(fmpy.__file__).parent / "c-code"
    token = f'-DCONTACTLIB_TOKEN="{kernel.token()}"'
    return (*WARNINGS, token, f"-isystem{headers}", *INCLUDES, f"-I{NATIVE}")


def standalone(source: Path, folder: Path, *way: str) -> Path:
    """A program without the sources: it opens an FMU's library by itself, or needs none."""
    made = folder / source.stem
    name, *options = way or ("gcc", "-O2")
    run(compiler(name), *flags(), *options, source, "-pthread", "-ldl", "-lm", "-o", made)
    return made


def run(*command: object) -> None:
    """Run a command that must not fail, and show its output if it does."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, f"{command[0]}: {done.stdout}{done.stderr}"


def clean(command: Iterable[object], **environment: str) -> None:
    """Run a program of tests/native, which prints how many of its checks failed."""
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


WITH_WHEELS = ("force_element", "force_element-memory", "wheelset-memory", "vehicle")


def of_wheels(model: cl.Model, folder: Path, name: str) -> Fmu:
    """An FMU of three wheels that differ in static friction, or of a vehicle's three axles."""
    options = {} if name == "vehicle" else {"wheels": 3, "per_wheel": ["static_friction"]}
    return Fmu(fitting(model, name, axles=3), folder, **EXPORTS[name], **options)


class SShaped:
    """A law of one axis that rises in an S."""

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        x = np.asarray(normalized_creepage, dtype=np.float64)
        u = np.abs(x) / (1.0 + np.abs(x))
        return np.asarray(np.sign(x) * u * (0.3 + u * (2.1 - 1.4 * u)))

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        x = np.abs(np.asarray(normalized_creepage, dtype=np.float64))
        u = x / (1.0 + x)
        return np.asarray((0.3 + 4.2 * u * (1.0 - u)) / (1.0 + x) ** 2)


def table_shapes(cohesive: cl.CreepForceTable) -> list[cl.CreepForceTable]:
    """Tables of every shape but a line contact's own: one axis, two, and with a corner."""
    return [cl.CreepForceTable.from_law(SShaped()), cl.carter_griffith_table("elliptic"), cohesive]
