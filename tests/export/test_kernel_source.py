"""The kernel as one C file: what it holds, and that it gives the FMU's numbers to the last bit."""

from __future__ import annotations

import math
import re
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from cffi import FFI
from click.testing import CliRunner
from exported_fmu import fitting
from fmu_instance import Instance
from one_file_kernel import RULES, Library, compiler, compiler_flags, declarations, run

import contactlib as cl
from contactlib.cli.commands import main

PLAIN = ("-fno-stack-protector", "-fno-pic", "-fno-pie")  # nothing of the system's hardening
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
pytestmark = pytest.mark.filterwarnings("ignore:effective_inverse_mass:contactlib.InputWarning")
CURVE = """
name = "a curve */ with a comment /* in its name \u00e9"
[contact]
radius_x = 0.46
radius_y = 0.3
wheel_load = 1e5
youngs_modulus = 210e9
poisson_ratio = 0.3
[law]
kind = "measured"
file = "curve.csv"
columns = ["slip", "mu"]
creepage_unit = "1"
[wheelset]
radius = 0.46
"""
SLIPS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3)
POINTS = tuple(zip(SLIPS, (0.1, 0.2, 0.28, 0.3, 0.26, 0.22, 0.2), strict=True))


@pytest.fixture(scope="module")
def models(
    rig: cl.Model,
    locomotive: cl.Model,
    layered_cohesive_table: cl.CreepForceTable,
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, cl.Model]:
    """A line contact, an ellipse with spin, a measured curve, a cohesive law with a layer."""
    folder = tmp_path_factory.mktemp("curve")
    rows = ["slip,mu", *(f"{slip},{mu}" for slip, mu in POINTS)]
    (folder / "curve.csv").write_text("\n".join(rows))
    (folder / "curve.toml").write_text(CURVE, encoding="utf-8")
    line = replace(rig.wheelset.element, table=layered_cohesive_table, layer_compliance=1e-13)
    return {
        "rig": rig,
        "locomotive": locomotive,
        "curve": cl.load_model(folder / "curve.toml"),
        "layer": replace(rig, wheelset=replace(rig.wheelset, element=line)),
    }


@pytest.fixture(scope="module")
def folders(
    models: dict[str, cl.Model], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("kernel")
    return {name: cl.export_kernel(model, folder / name) for name, model in models.items()}


@pytest.fixture
def library(folders: dict[str, Path]) -> Library:
    return Library(folders["locomotive"], *compiler("zig"), *compiler_flags())


def random_inputs(model: cl.Model, count: int) -> Iterator[dict[str, float]]:
    """Inputs over both branches, in traction and braking, at standstill, without load or grip."""
    rng, element = np.random.default_rng(22), model.wheelset.element
    for _ in range(count):
        speed = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, 2.0)
        size = 10.0 ** rng.uniform(-5.0, 0.5, 3) * rng.choice([-1.0, 0.0, 1.0], 3)
        yield {
            "speed": float(speed),
            "omega": float(speed * (1.0 + size[0]) / element.radius),
            "normal_load": float(
                element.axle_load * rng.choice([-0.1, 0.0, *rng.uniform(0.1, 2.0, 8)])
            ),
            "friction_scale": float(rng.choice([0.0, 1e-7, *rng.uniform(0.1, 2.0, 8)])),
            "lateral_velocity": float(0.1 * size[1] * speed),
            "spin_velocity": float(size[2] * speed),
        }


def bits(values: list[float]) -> list[str]:
    return [value.hex() for value in values]


# ---- without a compiler --------------------------------------------------------------------------


def test_the_files_need_nothing_else(folders: dict[str, Path], models: dict[str, cl.Model]) -> None:
    for name, folder in folders.items():
        assert {path.name for path in folder.iterdir()} >= {
            "contactlib.c",
            "contactlib.h",
            "example.c",
        }
        source = (folder / "contactlib.c").read_text(encoding="ascii")
        assert re.findall(r'#include "(.*)"', source) == ["contactlib.h"]
        assert set(re.findall(r"#include <(.*)>", source)) <= {
            *("float.h", "math.h", "stddef.h", "stdint.h", "string.h")
        }
        assert not re.search(r"@\w+@|CONTACTLIB_API|ONE_FILE_KERNEL|_tangent\([^;{]*\{", source)
        again = cl.export_kernel(models[name], folder.parent / "again")
        assert (again / "contactlib.c").read_text(encoding="ascii") == source
        assert len((folder / "example.c").read_text().splitlines()) <= 30


def test_command(tmp_path: Path, folders: dict[str, Path]) -> None:
    folder = tmp_path / "new" / "folder"
    done = CliRunner().invoke(main, ["kernel", "locomotive.toml", "-o", str(folder)])
    assert done.exit_code == 0, done.output
    for name in ("contactlib.c", "contactlib.h", "example.c"):
        assert (folder / name).read_bytes() == (folders["locomotive"] / name).read_bytes()


def test_a_file_in_the_place_of_the_folder_is_named(tmp_path: Path, rig: cl.Model) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        cl.export_kernel(rig, tmp_path / "file")


def test_structs_in_c_sharp_have_the_members_of_the_header(folders: dict[str, Path]) -> None:
    folder = folders["locomotive"]
    text = (folder / "Contactlib.cs").read_text(encoding="ascii")
    structs = dict(re.findall(r"public struct (\w+) \{(.*?)\}", text, RULES))
    ffi: Any = FFI()
    ffi.cdef(declarations(folder))
    for name in ("Parameters", "Input", "Output", "Element"):
        fields = ffi.typeof(f"contactlib_{name.lower()}").fields
        declared = re.sub(r"public \w+", "", structs[name])
        members: list[str] = []
        for field, member in fields:  # numbers of an array and of a struct of states one by one
            size = ffi.sizeof(member.type) // 8
            inner = [one for one, _ in member.type.fields] if member.type.kind == "struct" else []
            states = inner if field in ("memory", "lateral") and name == "Input" else [field]
            array = member.type.kind == "array"
            members += [f"{field}_{i}" for i in range(size)] if array else states
        assert re.findall(r"\w+", declared) == members
    assert f"Size = {ffi.sizeof('contactlib_memory')})" in text


# ---- with one ------------------------------------------------------------------------------------


@pytest.mark.tools
@pytest.mark.parametrize("language", [("-std=c99",), ("-xc++",), ("-xc++", "-std=c++11")], ids=str)
@pytest.mark.parametrize("name", ["gcc", "clang", "zig"])
def test_it_compiles_without_a_warning(
    folders: dict[str, Path], tmp_path: Path, name: str, language: tuple[str, ...]
) -> None:
    flags = [flag for flag in compiler_flags() if not flag.startswith("-std")]
    made = ("-c", "-o", tmp_path / "o")  # some warnings come only with optimisation
    for folder in (folders["locomotive"], folders["rig"]):  # with a table's numbers and without
        for source in ("contactlib.c", "example.c"):
            run(*compiler(name), *language, *flags, *WARNINGS, folder / source, *made)


@pytest.mark.tools
def test_it_calls_no_more_than_the_c_library_s_mathematics(folders: dict[str, Path]) -> None:
    made = folders["locomotive"] / "contactlib.o"
    source = made.with_suffix(".c")
    run(*compiler("gcc"), *compiler_flags(), *PLAIN, "-c", source, "-o", made)
    symbols = [line.split()[-2:] for line in run("nm", made).splitlines()]
    assert {name for kind, name in symbols if kind == "U"} <= {
        *("ceil", "fmax", "fmin", "memcpy", "memset", "sqrt", "_GLOBAL_OFFSET_TABLE_")
    }
    assert {name for kind, name in symbols if kind in "TDBC"} == {
        *("contactlib_start", "contactlib_force", "contactlib_step")
    }
    assert {kind for kind, _ in symbols} <= set("UTtRr")  # no data that can change


MODES: dict[str, dict[str, Any]] = {
    "held": {},
    "memory": {},
    "implicit": {"implicit": True},
    "implicit-memory": {"implicit": True},
    "implicit-parallel": {"implicit": True, "parallel_exchange": True},
}


@pytest.mark.tools
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", ["rig", "locomotive", "curve", "layer"])
def test_it_gives_the_bits_of_the_fmu(
    folders: dict[str, Path], models: dict[str, cl.Model], tmp_path: Path, name: str, mode: str
) -> None:
    model = fitting(models[name], mode)
    fmu = cl.export_fmu(model, tmp_path / "x.fmu", **MODES[mode])
    unpacked = Path(fmpy.extract(str(fmu), unzipdir=str(tmp_path / "unpacked")))
    library = Library(folders[name], *compiler("zig"), *compiler_flags())
    library.set(**{"implicit": 0.0, **{key: float(value) for key, value in MODES[mode].items()}})
    if mode.endswith("memory"):
        library.set(**model.wheelset.element.memory_parameters)
    with Instance(unpacked) as tool:
        variables = tool.description.modelVariables
        names = [v.name for v in variables if v.causality == "output"]
        given = {v.name for v in variables if v.causality == "input"}
        steady = [n for n in names if n != "step_size_hint"]  # which depends on the coupling
        tool.start()
        time, rng = 0.0, np.random.default_rng(23)
        for inputs in random_inputs(models[name], 500):
            known = {key: value for key, value in inputs.items() if key in given}
            step = 10.0 ** rng.uniform(-4.0, -1.0)
            tool.set(**known)
            library.set(**known)
            if "implicit" not in mode:
                assert library.force() == ""
                assert bits(library.get(*steady)) == bits(tool.get(*steady)), inputs
            tool.step(time, step)
            assert library.step(step) == ""
            assert bits(library.get(*names)) == bits(tool.get(*names)), inputs
            time += step


@pytest.mark.tools
def test_a_limit_of_substeps_leaves_easy_steps_alone_and_estimates_the_error_of_others(
    library: Library,
) -> None:
    library.start()
    radius, load = library.get("radius", "normal_load")
    friction = library.get("static_friction")[0] * load
    inertia = radius**2 / library.get("effective_inverse_mass")[0]
    errors: dict[float, list[float]] = {1.0: [], 3.0: [], 1e5: []}
    limited = dict.fromkeys(errors, 0)
    for i in range(400):
        library.set(friction_scale=0.2 if i // 50 % 2 else 1.0)
        before = library.bytes
        for limit, of_limit in errors.items():
            library.set(max_substeps=limit)
            assert library.step(1e-3) == ""
            force, held = library.get("creep_force", "held_tolerance")
            limited[limit] += held > 1e-6
            library.ffi.memmove(library.element, before, len(before))
            assert library.step(1e-3) == ""
            exact, torque = library.get("creep_force", "wheel_torque")
            of_limit.append(abs(force - exact) / friction)
            if held == 1e-6:
                assert of_limit[-1] < 1e-6
            if limit < 1e5:
                library.ffi.memmove(library.element, before, len(before))
        torque += 0.4 * friction * radius * (1.0 + 0.5 * math.sin(0.1 * i))
        library.set(omega=library.get("omega")[0] + 1e-3 * torque / inertia)
    assert limited[1.0] > limited[3.0] > limited[1e5] == max(errors[1e5]) == 0.0
    assert max(errors[3.0]) < 0.2 * max(errors[1.0])


@pytest.mark.tools
@pytest.mark.parametrize("name", ["gcc", "clang"])
def test_another_compiler_gives_the_same_numbers(
    library: Library, models: dict[str, cl.Model], tmp_path: Path, name: str
) -> None:
    folder = cl.export_kernel(models["locomotive"], tmp_path)
    other = Library(folder, *compiler(name), "-std=c99", "-O3", "-ffp-contract=off")
    for inputs in random_inputs(models["locomotive"], 300):
        for build in (library, other):
            build.set(**inputs)
            assert build.step(1e-2) == ""
        # fmax(0.0, -0.0) has any sign.
        assert np.array_equal(np.frombuffer(other.bytes), np.frombuffer(library.bytes))


@pytest.mark.tools
def test_fast_mathematics_are_refused(folders: dict[str, Path], tmp_path: Path) -> None:
    command = [*compiler("gcc"), "-ffast-math", "-c", str(folders["rig"] / "contactlib.c")]
    done = subprocess.run([*command, "-o", str(tmp_path / "o")], capture_output=True, text=True)
    assert "compile it without -ffast-math" in done.stderr


@pytest.fixture(scope="module")
def printed(folders: dict[str, Path]) -> dict[str, str]:
    """What the example prints with each folder's file, which becomes a library there."""
    outputs = {}
    for name, folder in folders.items():
        library, program = folder / "libcontactlib.so", folder / "example"
        command = (*compiler("gcc"), "-std=c99", "-O2", "-ffp-contract=off")
        run(*command, "-shared", "-fPIC", folder / "contactlib.c", "-lm", "-o", library)
        run(*command, folder / "example.c", library, f"-Wl,-rpath,{folder}", "-o", program)
        outputs[name] = run(program)
    return outputs


@pytest.mark.tools
def test_the_example_slips_away(printed: dict[str, str], models: dict[str, cl.Model]) -> None:
    for name, text in printed.items():
        rows = [list(map(float, line.split())) for line in text.splitlines()[1:]]
        forces = [row[-1] for row in rows]
        assert rows[0][3] < 0.1 < 1.0 < rows[-1][3]
        element, speed = replace(models[name].wheelset.element, wheels=1.0), rows[0][2]
        peak = cl.vehicle.available_force(element, speed=element.radius * speed)
        assert forces[-1] < max(forces) == pytest.approx(peak, rel=0.1)  # rows are 0.1 s apart
        steady = element.force(omega=rows[-1][2], speed=models[name].initial_speed)
        assert forces[-1] == pytest.approx(steady, rel=1e-3)


@pytest.mark.tools
def test_the_example_in_c_sharp_prints_the_same(
    folders: dict[str, Path], printed: dict[str, str]
) -> None:
    for name, folder in folders.items():
        program = folder / "Contactlib.exe"
        run(*compiler("mcs"), "-warnaserror", f"-out:{program}", folder / "Contactlib.cs")
        assert run(*compiler("mono"), program) == printed[name]


@pytest.mark.tools
@pytest.mark.parametrize(
    ("values", "step", "message"),
    [
        ({}, (1e-3, math.nan), "tolerance must be from 1e-10 to 1e-2"),
        ({"omega": math.nan}, (1e-3,), r"omega must be from -1e\+09 to 1e\+09"),
        ({"normal_load": math.inf}, (1e-3,), "normal_load must be from"),
        ({"friction_scale": -1.0}, (1e-3,), "friction_scale must be from -1e-06 to 1000"),
        ({"radius": 0.0}, (1e-3,), "radius must be from 1e-06"),
        ({"memory": 0.5}, (1e-3,), "memory must be 0 or from 1 to 1"),
        ({"memory": 1.0}, (1e-3,), "memory needs body_modulus and transverse_half_length"),
        ({"softening": 0.1}, (1e-3,), "softening must be 0.06.*, that of the exported contact"),
        (
            {"softening_temperature": 500.0, "slip_rate_decay": 0.5},
            (1e-3,),
            "softening_temperature and slip_rate_decay: at most one may be above 0",
        ),
        (
            {"memory": 1.0, "body_modulus": 1e11, "poisson_ratio": 0.6},
            (1e-3,),
            "poisson_ratio must be 0 or from 0 to 0.5",
        ),
        ({"kinetic_friction": 2.0}, (1e-3,), "static_friction must be at least kinetic_friction"),
        ({"effective_inverse_mass": 0.0}, (1e-3,), "effective_inverse_mass must be from 1e-12"),
        ({"max_substeps": -1.0}, (1e-3,), "max_substeps must be from 0 to 100000"),
        ({}, (math.nan,), "step must be finite and above zero"),
    ],
)
def test_a_mistake_is_named_and_changes_nothing(
    library: Library, values: dict[str, float], step: tuple[float, ...], message: str
) -> None:
    assert library.step(1e-3) == ""
    library.set(**values)
    before = library.bytes
    assert re.match(message, library.step(*step))
    assert library.bytes == before
    if values and not {"effective_inverse_mass", "max_substeps"} & values.keys():
        assert re.match(message, library.force())
        assert library.bytes == before
