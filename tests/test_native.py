"""The C sources, compiled strictly and run under sanitizers by the system's compiler."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import fmpy
import pytest
from fmu_instance import EXPORTS

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


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tests in C with all sources, compiled once."""
    if shutil.which("gcc") is None:
        pytest.skip("needs gcc")
    made = tmp_path_factory.mktemp("native") / "test_native"
    command = [
        "gcc",
        *FLAGS,
        f'-DCONTACTLIB_TOKEN="{kernel.token()}"',
        f"-isystem{Path(fmpy.__file__).parent / 'c-code'}",
        f"-I{package_folder('fmu')}",
        *map(str, sorted(package_folder("fmu").glob("*.c"))),
        str(Path(__file__).parent / "native" / "test_native.c"),
        "-lm",
        "-o",
        str(made),
    ]
    subprocess.run(command, check=True)
    return made


def run(program: Path, resources: Path, *arguments: str) -> None:
    done = subprocess.run(
        [str(program), resources.as_uri(), *arguments], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    assert done.stdout.strip() == "0 failures"


def test_kernel_and_shells_are_clean_under_sanitizers(
    program: Path, rig: cl.Model, cohesive_table: cl.CreepForceTable, tmp_path: Path
) -> None:
    fmu = cl.export_fmu(rig, tmp_path / "x.fmu")
    resources = Path(fmpy.extract(str(fmu), unzipdir=str(tmp_path / "a b"))) / "resources"
    polach = cl.Polach.dry(kalker_coefficient=3.7, poisson_ratio=0.28)
    tables = [
        rig.wheelset.element.table,
        cl.carter_griffith_table("elliptic"),
        cohesive_table,
        cl.CreepForceTable.from_law(polach),
    ]
    for table in tables:
        table.save(resources / "creep_table.bin")
        run(program, resources, f"{kernel.token()}-force_element-any")


@pytest.mark.parametrize("name", EXPORTS)
def test_any_calls_in_any_order_do_no_harm(
    program: Path, locomotive: cl.Model, tmp_path: Path, name: str
) -> None:
    fmu = cl.export_fmu(locomotive, tmp_path / "x.fmu", fmi_version=3, **EXPORTS[name])
    folder = Path(fmpy.extract(str(fmu), unzipdir=str(tmp_path / "x")))
    token = fmpy.read_model_description(str(folder)).guid
    run(program, folder / "resources", token, EXPORTS[name]["kind"])
