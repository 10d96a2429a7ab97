"""The C sources, compiled strictly and run under sanitizers by the system's compiler."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import fmpy
import pytest

import contactlib as cl
from contactlib import kernel
from contactlib.files import package_folder

FLAGS = [
    "-std=c99",
    "-O1",
    "-g",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Werror",
    "-ffp-contract=off",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
]


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_sources_are_strict_c99_and_clean_under_sanitizers(
    rig: cl.Model, cohesive_table: cl.CreepForceTable, tmp_path: Path
) -> None:
    fmu = cl.export_fmu(rig, tmp_path / "x.fmu")
    resources = Path(fmpy.extract(str(fmu), unzipdir=str(tmp_path / "a b"))) / "resources"
    headers = Path(fmpy.__file__).parent / "c-code"
    sources = sorted(package_folder("fmu").glob("*.c"))
    program = tmp_path / "test_native"
    subprocess.run(
        [
            "gcc",
            *FLAGS,
            f'-DCONTACTLIB_TOKEN="{kernel.token()}"',
            f"-isystem{headers}",
            f"-I{package_folder('fmu')}",
            *map(str, sources),
            str(Path(__file__).parent / "native" / "test_native.c"),
            "-lm",
            "-o",
            str(program),
        ],
        check=True,
    )
    polach = cl.Polach.dry(kalker_coefficient=3.7, poisson_ratio=0.28)
    tables = [
        rig.wheelset.element.table,
        cl.carter_griffith_table("elliptic"),
        cohesive_table,
        cl.CreepForceTable.from_law(polach),
    ]
    for table in tables:
        table.save(resources / "creep_table.bin")
        run = subprocess.run(
            [str(program), resources.as_uri(), f"{kernel.token()}-force_element-any"],
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, table.law + run.stdout + run.stderr
        assert run.stdout.strip() == "0 failures", table.law
