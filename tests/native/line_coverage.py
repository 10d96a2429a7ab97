"""Lines of the C sources that the C programs run: ``python tests/native/line_coverage.py``.

Compiles fmu/ by gcc with counters, runs every program of this folder on every kind of FMU, and
prints for each file its lines that were run and all that there are, and the text of those that were
not. A line of a header counts as run if it was in any of the files that include it. Lines that are
not compiled on this machine are not counted; they are named at the end.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import c_sources, package_folder

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from exported_fmu import fitting
from fmu_instance import EXPORTS
from native_programs import COUNTED, NATIVE, WRAPPED, Build, Fmu, alone, clean, run

# Text of lines that no program on this machine runs, by file, and why.
NOT_RUN: dict[str, dict[str, str]] = {
    "simd_dispatch.c": {
        "return (b & (1u << 5)) != 0;": "of a processor without AVX-512",
    },
}


WITH_WHEELS = ("force_element", "force_element-memory", "wheelset-memory")


def of_wheels(model: cl.Model, folder: Path, name: str) -> Fmu:
    """An FMU of three wheels that differ in static friction."""
    options = {**EXPORTS[name], "wheels": 3, "per_wheel": ["static_friction"]}
    return Fmu(fitting(model, name), folder, **options)


class Line(NamedTuple):
    """A line of a source."""

    file: str
    number: int
    text: str

    def __str__(self) -> str:
        """As a compiler names it."""
        return f"{self.file}:{self.number}: {self.text}"


def run_all(
    build: Build, model: cl.Model, tables: Iterable[cl.CreepForceTable], folder: Path
) -> None:
    """Run every program: laws of every shape, every kind of FMU, memory, threads, golden cases."""
    tests, calls = build.program("test_native"), build.program("test_calls")
    for name, options in EXPORTS.items():
        fmu = Fmu(fitting(model, name), folder / name, fmi_version=2, **options)
        clean([calls, fmu.location, fmu.token, options["kind"], fmu.resources.parent])
        clean([tests, "60", fmu.location, fmu.token, options["kind"]])
        if name == "wheelset":
            clean([build.program("test_threads"), "2", "1", fmu.location, fmu.token])
    for name in WITH_WHEELS:
        fmu = of_wheels(model, folder / f"wheels-{name}", name)
        given = fmu.location, fmu.token, EXPORTS[name]["kind"], fmu.resources
        clean([build.program("test_wheels"), *given])
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
    program = alone(NATIVE / "run_golden.c", folder)
    for version in (2, 3):
        fmu = Fmu(model, folder / f"golden{version}", fmi_version=version, kind="wheelset")
        golden = folder / "golden.csv"
        torque = fmu.references["drive_torque"]
        golden.write_text(f"time,drive_torque:{torque}:in\n0,0\n0.01,0\n")
        run(program, str(version), build.library(), fmu.location, fmu.token, golden, "0")


def counts(folder: Path) -> dict[str, dict[int, int]]:
    """How often each line was run, by file."""
    found: dict[str, dict[int, int]] = defaultdict(lambda: defaultdict(int))
    done = subprocess.run(
        ["gcov", "--json-format", "--stdout", *sorted(p.name for p in folder.glob("*.gcda"))],
        cwd=folder,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    for unit in done.stdout.splitlines():
        for file in json.loads(unit)["files"]:
            path = Path(folder, file["file"])
            if path.parent.parent == package_folder("fmu"):
                for line in file["lines"]:
                    found[path.name][line["line_number"]] += line["count"]
    return found


def sources(pattern: str) -> list[Path]:
    """Files of the sources."""
    return c_sources(pattern)


def lines(name: str) -> list[str]:
    """Lines of a source."""
    return [line.strip() for line in c_sources(name)[0].read_text().splitlines()]


def not_compiled() -> Iterator[Line]:
    """Statements for Windows alone, which tests/export/test_interop.py runs under Wine."""
    for path in sources("*.[ch]"):
        inside = False
        for number, text in enumerate(lines(path.name), 1):
            if text.startswith("#"):
                inside = bool(re.match(r"#(ifdef|if) .*_WIN32", text))
            elif inside and text.endswith(";"):
                yield Line(path.name, number, text)


def not_run(found: dict[str, dict[int, int]]) -> list[Line]:
    """Lines that no program ran."""
    return [
        Line(name, number, lines(name)[number - 1])
        for name, file in sorted(found.items())
        for number, count in sorted(file.items())
        if count == 0
    ]


def reason(line: Line) -> str | None:
    """Why a line is not run, if that is known."""
    return NOT_RUN.get(line.file, {}).get(line.text)


def measured(
    model: cl.Model, tables: Iterable[cl.CreepForceTable], folder: Path
) -> dict[str, dict[int, int]]:
    """Compile, run all, count."""
    build = Build(folder, COUNTED)
    run_all(build, model, tables, folder)
    return counts(folder)


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


def shapes(cohesive: cl.CreepForceTable) -> list[cl.CreepForceTable]:
    """Tables of every shape but a line contact's own: one axis, two, and with a corner."""
    return [cl.CreepForceTable.from_law(SShaped()), cl.carter_griffith_table("elliptic"), cohesive]


def main() -> None:
    """Print the table, and the lines that were not run."""
    with tempfile.TemporaryDirectory() as scratch:
        tables = shapes(cl.table.cohesive_table("line", 0.45 / 0.21))
        found = measured(cl.load_model("locomotive.toml"), tables, Path(scratch))
    missed = not_run(found)
    ran = {name: sum(count > 0 for count in file.values()) for name, file in found.items()}
    for name in sorted(found):
        print(f"{name:24s}{ran[name]:6d} of {len(found[name]):4d}")
    print(f"{'all':24s}{sum(ran.values()):6d} of {sum(map(len, found.values())):4d}")
    for line in missed:
        print(f"not run: {line} ({reason(line) or 'a program is missing'})")
    for line in not_compiled():
        print(f"not compiled here: {line}")


if __name__ == "__main__":
    main()
