"""Every line of the C sources is run by a program in C, as gcov counts them."""

from __future__ import annotations

import json
import subprocess
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import pytest
from exported_fmu import fitting
from fmu_instance import EXPORTS
from native_programs import (
    COUNTED,
    NATIVE,
    WITH_WHEELS,
    WRAPPED,
    Build,
    Fmu,
    clean,
    of_wheels,
    run,
    standalone,
    table_shapes,
)

import contactlib as cl
from contactlib.base.writing import c_sources

pytestmark = pytest.mark.tools


def run_all(
    build: Build, model: cl.Model, tables: Iterable[cl.CreepForceTable], folder: Path
) -> None:
    """Run every program: laws of every shape, every kind of FMU, memory, threads, golden cases."""
    tests, calls = build.program("test_native"), build.program("test_calls")
    for name, options in EXPORTS.items():
        fmu = Fmu(fitting(model, name), folder / name, fmi_version=2, **options)
        clean([calls, fmu.location, fmu.token, options["kind"], fmu.resources.parent])
        lives = "6" if name == "vehicle" else "60"  # its steps take longer
        clean([tests, lives, fmu.location, fmu.token, options["kind"]])
        if name == "wheelset":
            clean([build.program("test_threads"), "2", "1", fmu.location, fmu.token])
    for name in WITH_WHEELS:
        fmu = of_wheels(model, folder / f"wheels-{name}", name)
        given = fmu.location, fmu.token, EXPORTS[name]["kind"], fmu.resources
        clean([build.program("test_wheels"), *given])
        clean([tests, "6", *given[:-1]])
    fmu = Fmu(model, folder / "tables", fmi_version=2)
    table = fmu.resources / "creep_table.bin"
    clean([tests, "200", fmu.location, fmu.token])
    for made in tables:
        made.save(table)
        clean([tests, "200", fmu.location, fmu.token])
        clean([calls, fmu.location, fmu.token, "force_element", fmu.resources.parent])
    clean([build.program("test_allocation", *WRAPPED), fmu.location, fmu.token])
    run_golden(build, model, folder)


def run_golden(build: Build, model: cl.Model, folder: Path) -> None:
    """A library opened as a tool opens it: two rows of a wheelset that rolls freely."""
    program = standalone(NATIVE / "run_golden.c", folder)
    for version in (2, 3):
        fmu = Fmu(model, folder / f"golden{version}", fmi_version=version, kind="wheelset")
        golden = folder / "golden.csv"
        torque = fmu.references["drive_torque"]
        golden.write_text(f"time,drive_torque:{torque}:in\n0,0\n0.01,0\n")
        run(program, str(version), build.library(), fmu.location, fmu.token, golden, "0")


def lines_not_run(folder: Path) -> list[str]:
    """Lines that no program ran; one of a header counts as run if it was in any file."""
    counts = Counter[tuple[str, int]]()
    data = sorted(path.name for path in folder.glob("*.gcda"))
    command = ["gcov", "--json-format", "--stdout", *data]
    report = subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
    for unit in report.stdout.splitlines():
        for file in json.loads(unit)["files"]:
            for line in file["lines"]:
                counts.update({(Path(file["file"]).name, line["line_number"]): line["count"]})
    texts = {path.name: path.read_text().splitlines() for path in c_sources()}
    return [
        f"{name}: {texts[name][number - 1].strip()}"
        for (name, number), count in sorted(counts.items())
        if count == 0 and name in texts
    ]


def test_every_line_is_run(
    locomotive: cl.Model, cohesive_table: cl.CreepForceTable, tmp_path: Path
) -> None:
    build = Build(tmp_path, COUNTED)
    run_all(build, locomotive, table_shapes(cohesive_table), tmp_path)
    assert lines_not_run(tmp_path) == []
