"""The C sources, compiled strictly by the system's compiler and watched by sanitizers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from exported_fmu import fitting
from fmu_instance import EXPORTS
from native_programs import (
    INITIALIZED,
    THREADED,
    WITH_WHEELS,
    WRAPPED,
    Build,
    Fmu,
    clean,
    compiler,
    flags,
    of_wheels,
    run,
    table_shapes,
)

import contactlib as cl
from contactlib.base.writing import c_sources

pytestmark = pytest.mark.tools


@pytest.mark.parametrize("version", ["2", "3"])
def test_types_are_those_of_the_standard(tmp_path: Path, version: str) -> None:
    text = c_sources(f"fmi{version}_types.h")[0].read_text()
    text = "\n".join(text[text.index("#elif") :].split("\n")[1:]).rsplit("#endif", 2)[0]
    text = text.replace(f"fmi{version}", f"own{version}")
    checks, structures = [], re.findall(r"typedef struct \{(.*?)\} own(\w+);", text, re.S)
    for members, name in structures:
        for member in re.findall(r"(\w+);|\(\*(\w+)\)", members):
            first, second = (f"offsetof({x}{name}, {''.join(member)})" for x in ("own", "fmi"))
            checks.append(f"{first} == {second}")
    for values in re.findall(r"typedef enum \{(.*?)\}", text, re.S):
        checks += [f"(int)own{x} == (int)fmi{x}" for x in re.findall(r"own(\w+)", values)]
    for line in re.findall(r"typedef (?!struct|enum)([^()]*?);", text):
        names = re.findall(r"own(\w+)(?=,|$)", line)
        checks += [f"__builtin_types_compatible_p(own{x}, fmi{x})" for x in names]
    for name, value in re.findall(r"#define own(\w+) (\S+)", text):
        equal = "__builtin_strcmp(own{0}, fmi{0}) == 0" if '"' in value else "own{0} == fmi{0}"
        checks.append(equal.format(name))
    assert len(checks) > 30
    source = tmp_path / "types.c"
    asserted = "".join(f'_Static_assert({each}, "{each}");\n' for each in checks)
    header = f'#include "fmi{version}Functions.h"\n'
    source.write_text(f"{header}{text}\n{asserted}int main(void) {{ return 0; }}\n")
    run(compiler("gcc"), *flags(), "-std=c11", "-c", source, "-o", tmp_path / "types.o")


@pytest.mark.parametrize("shape", range(4))
def test_kernel_and_shells_are_clean_under_sanitizers(
    sanitized: Build, rig: cl.Model, cohesive_table: cl.CreepForceTable, tmp_path: Path, shape: int
) -> None:
    fmu = Fmu(rig, tmp_path / "a b")
    table = [rig.wheelset.element.table, *table_shapes(cohesive_table)][shape]
    table.save(fmu.resources / "creep_table.bin")
    clean([sanitized.program("test_native"), "1000", fmu.location, fmu.token])


@pytest.mark.parametrize("name", EXPORTS)
def test_every_function_of_fmi_is_clean_under_sanitizers(
    sanitized: Build, locomotive: cl.Model, tmp_path: Path, name: str
) -> None:
    fmu = Fmu(fitting(locomotive, name), tmp_path / "x", **EXPORTS[name])
    kind = EXPORTS[name]["kind"]
    location = fmu.resources.as_uri()
    clean([sanitized.program("test_calls"), location, fmu.token, kind, fmu.resources.parent])
    # A vehicle's steps take longer, and those of a life whose values no substep fits take minutes.
    lives = "2" if name == "vehicle" else "4"
    clean([sanitized.program("test_native"), lives, location, fmu.token, kind])


@pytest.mark.parametrize("name", WITH_WHEELS)
def test_wheels_of_one_fmu_are_clean_under_sanitizers(
    sanitized: Build, locomotive: cl.Model, tmp_path: Path, name: str
) -> None:
    fmu = of_wheels(locomotive, tmp_path / "x", name)
    kind = EXPORTS[name]["kind"]
    given = fmu.resources.as_uri(), fmu.token, kind, fmu.resources
    clean([sanitized.program("test_wheels"), *given])
    clean([sanitized.program("test_native"), "2", *given[:-1]])


def test_memory_that_is_refused_is_an_error_and_no_leak(
    sanitized: Build, rig: cl.Model, tmp_path: Path
) -> None:
    fmu = Fmu(rig, tmp_path / "x")
    large = cl.carter_griffith_table("elliptic")  # read in many pieces
    large.save(fmu.resources / "creep_table.bin")
    clean([sanitized.program("test_allocation", *WRAPPED), fmu.location, fmu.token])


def test_no_memory_is_read_before_it_is_written(locomotive: cl.Model, tmp_path: Path) -> None:
    build = Build(tmp_path, INITIALIZED)
    fmu = Fmu(locomotive, tmp_path / "x")
    clean([build.program("test_native"), "100", fmu.location, fmu.token])
    kind = (fmu.location, fmu.token, "force_element", fmu.resources.parent)
    clean([build.program("test_calls"), *kind])


def test_threads_with_instances_of_their_own_do_not_meet(
    locomotive: cl.Model, tmp_path: Path
) -> None:
    build = Build(tmp_path, THREADED)
    fmu = Fmu(locomotive, tmp_path / "x", kind="wheelset")
    clean([build.program("test_threads"), "4", "5", fmu.location, fmu.token])
