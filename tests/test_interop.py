"""One FMU, one trajectory: in every tool, and by the binaries of every platform.

A tool that a developer does not have is skipped; with CONTACTLIB_REQUIRE_TOOLS=1 it is a failure.
"""

from __future__ import annotations

import importlib
import os
import runpy
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path, PureWindowsPath
from typing import Any, NamedTuple, NoReturn

import fmpy
import numpy as np
import pytest
from numpy.typing import NDArray

import contactlib as cl
from contactlib import kernel
from contactlib.export import FMI2_PLATFORMS
from contactlib.files import package_folder
from contactlib.parameters import FloatArray

# Kind and FMI version.
SUBJECTS = [("force_element", 2)]

STEP, STEPS = 1e-3, 1000
# Of a column's largest magnitude. Tools add up time in their own ways, and a wheelset that runs
# away magnifies it.
TOLERANCE = 1e-9

# What runs the binaries of another platform here; each program is the first one that is found.
EMULATORS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "x86_64-linux": ((), ()),
    "x86_64-windows": (("wine64", "/usr/lib/wine/wine64", "wine"), ()),
    "aarch64-linux": (
        ("qemu-aarch64", "qemu-aarch64-static"),
        ("-L", "/usr/aarch64-linux-gnu"),
    ),
}


def missing(what: str) -> NoReturn:
    if os.environ.get("CONTACTLIB_REQUIRE_TOOLS") == "1":
        pytest.fail(what)
    pytest.skip(what)


def module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:  # OSError: a library that it is linked to
        missing(f"{name} cannot be imported: {error}")


def inputs_over_time(kind: str, model: cl.Model, time: FloatArray) -> dict[str, FloatArray]:
    """From stick over the peak into slip, under a load and a friction that change."""
    load = model.wheelset.element.contact.normal_load * (1.0 + 0.1 * np.sin(20.0 * time))
    common = {"normal_load": load, "friction_scale": 1.0 - 0.2 * time}
    if kind == "force_element":
        return {"omega": 20.0 + 0.6 * time, "speed": 10.0 + 0.1 * time, **common}
    torque = 2e4 + 2e4 * time
    return {"drive_torque": torque, "resistance_force": 100.0 * time, **common}


class Case(NamedTuple):
    """An FMU, and what to run it with."""

    fmu: Path
    folder: Path
    version: int
    time: FloatArray
    inputs: dict[str, FloatArray]
    outputs: list[str]
    references: dict[str, int]
    booleans: set[str]
    description: Any


@pytest.fixture(scope="module", params=SUBJECTS, ids=lambda p: f"{p[0]}-fmi{p[1]}")
def case(
    request: pytest.FixtureRequest, rig: cl.Model, tmp_path_factory: pytest.TempPathFactory
) -> Case:
    kind, version = request.param
    folder = tmp_path_factory.mktemp("with space")
    platforms = [
        name
        for name in EMULATORS
        if kernel.library_path(name).is_file() and (version > 2 or name in FMI2_PLATFORMS)
    ]
    fmu = cl.export_fmu(
        rig, folder / "subject.fmu", kind=kind, fmi_version=version, platforms=platforms
    )
    fmpy.extract(str(fmu), unzipdir=str(folder / "unzipped"))
    description = fmpy.read_model_description(str(fmu))
    time = STEP * np.arange(STEPS + 1, dtype=np.float64)
    return Case(
        fmu,
        folder / "unzipped",
        version,
        time,
        inputs_over_time(kind, rig, time),
        [v.name for v in description.modelVariables if v.causality == "output"],
        {v.name: v.valueReference for v in description.modelVariables},
        {v.name for v in description.modelVariables if v.type == "Boolean"},
        description,
    )


class Reference(NamedTuple):
    """Outputs, row by row: at the end of every step, and once the next inputs are set there."""

    stepped: FloatArray
    golden: FloatArray


@pytest.fixture(scope="module")
def reference(case: Case) -> Reference:
    """The FMU in the plainest of loops."""
    fmu = fmpy.simulation.instantiate_fmu(str(case.folder), case.description, "CoSimulation")
    set_values, get_values = (
        (fmu.setReal, fmu.getReal) if case.version == 2 else (fmu.setFloat64, fmu.getFloat64)
    )

    def set_inputs(i: int) -> None:
        set_values(
            [case.references[name] for name in case.inputs],
            [float(values[i]) for values in case.inputs.values()],
        )

    def outputs() -> list[float]:
        return [
            float((fmu.getBoolean if name in case.booleans else get_values)([reference])[0])
            for name, reference in ((name, case.references[name]) for name in case.outputs)
        ]

    if case.version == 2:
        fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    set_inputs(0)
    fmu.exitInitializationMode()
    stepped, golden = [], [outputs()]
    for i in range(STEPS):
        fmu.doStep(float(case.time[i]), float(case.time[i + 1] - case.time[i]))
        stepped.append(outputs())
        set_inputs(i + 1)
        golden.append(outputs())
    fmu.terminate()
    fmu.freeInstance()
    return Reference(np.array(stepped), np.array(golden))


def test_case_goes_from_stick_to_slip(case: Case, reference: Reference) -> None:
    # What stays on one branch would show little.
    falling = reference.golden[:, case.outputs.index("falling_branch")]
    assert {*falling.tolist()} == {0.0, 1.0}
    assert np.isfinite(reference.golden).all()


# ---- tools --------------------------------------------------------------------------------------


def run_fmpy(case: Case) -> FloatArray:
    signals = np.empty(STEPS + 1, dtype=[(name, np.float64) for name in ("time", *case.inputs)])
    for name, values in {"time": case.time, **case.inputs}.items():
        signals[name] = values
    result = fmpy.simulate_fmu(
        str(case.fmu),
        fmi_type="CoSimulation",
        stop_time=float(case.time[-1]),
        output_interval=STEP,
        input=signals,
        output=case.outputs,
    )
    return np.array([result[name][1:] for name in case.outputs], dtype=np.float64).T


def run_ecos(case: Case) -> FloatArray:
    ecos = module("ecospy")
    rows = []

    def read(name: str) -> float:
        get = simulation.get_bool if name in case.booleans else simulation.get_real
        return float(get(f"subject::{name}"))

    with ecos.EcosSimulationStructure() as structure:
        structure.add_model("subject", str(case.fmu))
        start = {f"subject::{name}": float(values[0]) for name, values in case.inputs.items()}
        assert structure.add_parameter_set("start", start)
        with ecos.EcosSimulation(STEP, structure=structure) as simulation:
            assert simulation.init(0.0, "start"), ecos.EcosLib.get_last_error()
            for i in range(STEPS):
                for name, values in case.inputs.items():
                    simulation.set_real(f"subject::{name}", float(values[i]))
                simulation.step()
                rows.append([read(name) for name in case.outputs])
            simulation.terminate()
    return np.array(rows)


def run_libcosim(case: Case) -> FloatArray:
    if case.version != 2:
        pytest.skip("libcosim reads FMI 2 only")
    cosim = module("libcosimpy.CosimExecution").CosimExecution
    observers = module("libcosimpy.CosimObserver").CosimObserver
    manipulators = module("libcosimpy.CosimManipulator").CosimManipulator
    execution = cosim.from_step_size(round(STEP * 1e9))
    slave = module("libcosimpy.CosimSlave").CosimLocalSlave(str(case.fmu), "subject")
    assert slave.ptr(), "libcosim cannot read the FMU"  # it would crash on it
    index = execution.add_local_slave(slave)
    observer, manipulator = observers.create_last_value(), manipulators.create_override()
    assert execution.add_observer(observer)
    assert execution.add_manipulator(manipulator)
    inputs = [case.references[name] for name in case.inputs]
    reals = [case.references[name] for name in case.outputs if name not in case.booleans]
    booleans = [case.references[name] for name in case.outputs if name in case.booleans]
    for reference, values in zip(inputs, case.inputs.values(), strict=True):
        assert execution.real_initial_value(index, reference, float(values[0]))
    rows = []
    for i in range(STEPS):
        now = [float(values[i]) for values in case.inputs.values()]
        assert manipulator.slave_real_values(index, inputs, now)
        assert execution.step(), execution.status()
        got = dict(zip(reals, observer.last_real_values(index, reals), strict=True))
        got |= dict(zip(booleans, observer.last_boolean_values(index, booleans), strict=True))
        rows.append([float(got[case.references[name]]) for name in case.outputs])
    return np.array(rows)


@pytest.mark.parametrize("run", [run_fmpy, run_ecos, run_libcosim])
def test_tool_gives_the_same_trajectory(
    case: Case, reference: Reference, run: Callable[[Case], FloatArray]
) -> None:
    found = run(case)
    assert found.shape == reference.stepped.shape
    allowed = TOLERANCE * np.abs(reference.stepped).max(axis=0)
    errors = np.abs(found - reference.stepped).max(axis=0)
    rows = zip(case.outputs, errors.tolist(), allowed.tolist(), strict=True)
    assert {name: error for name, error, most in rows if not error <= most} == {}


def test_two_fmus_in_one_system_keep_their_parameters(rig: cl.Model, tmp_path: Path) -> None:
    # A system unpacks what has the guid of an FMU before once, and takes that one's resources.
    cosim = module("libcosimpy.CosimExecution").CosimExecution
    observers = module("libcosimpy.CosimObserver").CosimObserver
    text = cl.model_path("roller_rig.toml").read_text(encoding="utf-8")
    (tmp_path / "light.toml").write_text(text.replace('"220.65 kN"', '"100 kN"'), encoding="utf-8")
    light = cl.load_model(tmp_path / "light.toml", table=rig.wheelset.element.table)
    fmus = [cl.export_fmu(m, tmp_path / f"{i}.fmu") for i, m in enumerate((rig, light))]
    simulators = "".join(f'<Simulator name="s{fmu.stem}" source="{fmu.name}"/>' for fmu in fmus)
    (tmp_path / "OspSystemStructure.xml").write_text(
        '<OspSystemStructure version="0.1" '
        'xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure">'
        f"<BaseStepSize>{STEP}</BaseStepSize><Algorithm>fixedStep</Algorithm>"
        f"<Simulators>{simulators}</Simulators>"
        "</OspSystemStructure>"
    )
    execution = cosim.from_osp_config_file(str(tmp_path))
    observer = observers.create_last_value()
    assert execution.add_observer(observer)
    assert execution.step()
    variables = fmpy.read_model_description(str(fmus[0])).modelVariables
    (reference,) = (v.valueReference for v in variables if v.name == "normal_load")
    loads = {
        info.name.decode(): observer.last_real_values(info.index, [reference])[0]
        for info in execution.slave_infos()
    }
    assert loads == {"s0": 220650.0, "s1": 100000.0}


# ---- platforms ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def golden_csv(case: Case, reference: Reference, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The reference as tests/native/run_golden.c reads it."""
    return write_golden(case, reference.golden, tmp_path_factory.mktemp("golden") / "golden.csv")


def write_golden(case: Case, outputs: NDArray[np.float64], path: Path) -> Path:
    header = ["time"]
    header += [f"{name}:{case.references[name]}:in" for name in case.inputs]
    for name in case.outputs:
        kind = "boolean" if name in case.booleans else "out"
        header.append(f"{name}:{case.references[name]}:{kind}")
    rows = np.column_stack([case.time, *case.inputs.values(), outputs])
    lines = [",".join(header), *(",".join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


@pytest.fixture(scope="session")
def wine_environment() -> Iterator[dict[str, str]]:
    """A Windows of its own, without windows: its making takes ten seconds and 0.7 GB."""
    command = emulator("x86_64-windows")
    if not command:
        yield {}
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as prefix:
        # No menus, and no question whether to fetch what .NET and HTML would need.
        environment = {
            "WINEPREFIX": prefix,
            "WINEDEBUG": "-all",
            "WINEDLLOVERRIDES": "mscoree,mshtml,winemenubuilder.exe=",
        }
        yield environment
        server = Path(command[0]).with_name("wineserver")
        subprocess.run([server, "-k"], env=os.environ | environment, check=False)


def emulator(platform: str) -> list[str]:
    """Command that runs a program of `platform`, which goes behind it."""
    if platform == kernel.platform_name():
        return []
    programs, options = EMULATORS[platform]
    found = [path for path in map(shutil.which, programs) if path]
    folders = [option for option in options if option.startswith("/")]
    if not found or not all(Path(folder).is_dir() for folder in folders):
        missing(f"nothing here runs programs of {platform}: {' or '.join(programs)} {folders}")
    return [found[0], *options]


def library_of(case: Case, platform: str) -> Path:
    """The binary in the FMU; beside it for a platform that FMI 2 has no name for."""
    name = case.description.coSimulation.modelIdentifier
    built = kernel.library_path(platform)
    if not built.is_file():
        missing(f"'python fmu/build_hook.py {platform}' has not been run")
    folder = platform if case.version > 2 else FMI2_PLATFORMS.get(platform)
    return case.folder / "binaries" / folder / f"{name}{built.suffix}" if folder else built


def compile_runner(platform: str, program: Path) -> None:
    for name in ("ziglang", "hatchling"):
        module(name)
    hook = runpy.run_path(str(package_folder("fmu") / "build_hook.py"))
    hook["zig_cc"](
        platform,
        # Stripped like the library, so that both take the same Windows runtime from the compiler's
        # cache: it builds one for every setting, in a minute and a half.
        *("-s", "-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"),
        # As a system's: the FMI headers have their own warnings.
        *("-isystem", str(hook["fmi_headers"]())),
        str(Path(__file__).parent / "native" / "run_golden.c"),
        *("-o", str(program)),
    )


def run_golden(
    case: Case, platform: str, csv: Path, program: Path, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    command, library = emulator(platform), library_of(case, platform)
    compile_runner(platform, program)
    # Wine's drive Z: is the root of the file system.
    wine = bool(command) and platform.endswith("windows")
    drive = "Z:" if wine else ""
    resources = case.folder / "resources"
    if case.version == 2:
        location = resources.as_uri().replace("file://", "file:///Z:" if wine else "file://")
    else:
        location = f"{PureWindowsPath(f'Z:{resources}')}\\" if wine else f"{resources}/"
    token = case.description.guid or case.description.instantiationToken
    arguments = [str(case.version), f"{drive}{library}", location, token, f"{drive}{csv}"]
    return subprocess.run(
        [*command, str(program), *arguments, repr(TOLERANCE)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.mark.parametrize("platform", EMULATORS)
def test_binary_of_each_platform_gives_the_same_trajectory(
    case: Case,
    golden_csv: Path,
    platform: str,
    tmp_path: Path,
    request: pytest.FixtureRequest,
) -> None:
    windows = platform.endswith("windows")
    environment = request.getfixturevalue("wine_environment") if windows else {}
    run = run_golden(case, platform, golden_csv, tmp_path / "run_golden.exe", environment)
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stdout.startswith(f"{STEPS + 1} rows")


def test_runner_finds_one_wrong_value(case: Case, reference: Reference, tmp_path: Path) -> None:
    wrong = reference.golden.copy()
    column = case.outputs.index("creep_force")
    wrong[STEPS // 2, column] += 1e-6 * np.abs(wrong[:, column]).max()
    csv = write_golden(case, wrong, tmp_path / "wrong.csv")
    run = run_golden(case, kernel.platform_name(), csv, tmp_path / "run_golden.exe", {})
    assert run.returncode == 1
    assert "error 1e-06 in creep_force" in run.stdout
