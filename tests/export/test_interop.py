"""One FMU, one trajectory: in every tool, by the binaries of every platform, and from its sources.

The trajectory is documentation/reference_run.csv in each FMU, which the kernel wrote in Python. A
tool that a developer does not have is skipped; with CONTACTLIB_REQUIRE_TOOLS=1 it is a failure.
"""

from __future__ import annotations

import os
import runpy
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import cache
from pathlib import Path, PureWindowsPath
from typing import Any, NamedTuple
from xml.etree import ElementTree

import fmpy
import fmpy.build
import numpy as np
import pytest
from exported_fmu import exported, fitting
from fmu_instance import EXPORTS, Instance, Subject
from outside_tools import missing, module

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder
from contactlib.export.description import Description
from contactlib.export.platforms import FMI2_FOLDERS, FMI3_FOLDERS, PLATFORMS

pytestmark = pytest.mark.tools

# Models and kinds: the locomotive, as it has a mass that moves, and an ellipse with spin.
LOCOMOTIVE = [("locomotive", Subject(name, version)) for name in EXPORTS for version in (2, 3)]
# The rig slips away and magnifies what a tool adds up in its own way: for the platforms alone.
RIG = [("rig", Subject(name, 3)) for name in ("force_element-memory", "wheelset-memory")]

# Of a column's largest magnitude. A tool's step sizes differ in the last bits, as it adds up time
# in its own way, and a wheelset that slips away magnifies that. The platforms themselves do not
# differ: the kernel takes no function from a system that IEEE 754 does not define to the last bit.
TOLERANCE = 1e-12
# A vehicle's substeps hold what hardly changes: the last bits of a tool's step decide for or
# against it, and the difference is an error that the tolerance of the FMU allows.
OF_VEHICLE = 1e-5

HERE = kernel.platform_name()

# What runs the binaries of another platform here; each program is the first one that is found.
EMULATORS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "x86_64-linux": ((), ()),
    "x86_64-windows": (("wine64", "/usr/lib/wine/wine64", "wine"), ()),
    "aarch64-linux": (
        ("qemu-aarch64", "qemu-aarch64-static"),
        ("-L", "/usr/aarch64-linux-gnu"),
    ),
}


class Case(NamedTuple):
    """An FMU with its reference run."""

    fmu: Path
    folder: Path
    version: int
    time: FloatArray
    inputs: dict[str, FloatArray]
    outputs: list[str]
    golden: FloatArray
    """Outputs at the communication points, with the inputs of these points."""
    references: dict[str, int]
    booleans: set[str]
    description: Any

    @property
    def step(self) -> float:
        """Communication step [s]."""
        return float(self.description.defaultExperiment.stepSize)

    @property
    def steps(self) -> int:
        return self.time.size - 1

    def inputs_at(self, i: int) -> dict[str, float]:
        return {name: float(values[i]) for name, values in self.inputs.items()}


def case_name(case: tuple[str, Subject]) -> str:
    return f"{case[0]}-{case[1]}"


@pytest.fixture(scope="module", params=[*LOCOMOTIVE, *RIG], ids=case_name)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Case:
    model, subject = request.param
    return make_case(subject, request.getfixturevalue(model), tmp_path_factory)


def make_case(subject: Subject, model: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> Case:
    folder = tmp_path_factory.mktemp("with space")
    built = [name for name in PLATFORMS if kernel.library_path(name).is_file()]
    model = fitting(model, subject.name)
    fmu = cl.export_fmu(model, folder / "subject.fmu", platforms=built, **subject.arguments)
    unzipped = Path(fmpy.extract(str(fmu), unzipdir=str(folder / "unzipped")))
    description = fmpy.read_model_description(str(fmu))
    with (unzipped / "documentation" / "reference_run.csv").open(encoding="ascii") as file:
        names = file.readline().strip().split(",")
        columns = dict(zip(names, np.loadtxt(file, delimiter=",").T, strict=True))
    variables = description.modelVariables
    outputs = [v.name for v in variables if v.causality == "output"]
    return Case(
        fmu,
        unzipped,
        subject.version,
        columns["time"],
        {v.name: columns[v.name] for v in variables if v.causality == "input"},
        outputs,
        np.column_stack([columns[name] for name in outputs]),
        {v.name: v.valueReference for v in variables},
        {v.name for v in variables if v.type == "Boolean"},
        description,
    )


class Run(NamedTuple):
    """Outputs of the plainest of loops, row by row."""

    stepped: FloatArray
    """At the end of every step: what most tools record."""
    golden: FloatArray
    """At every communication point, once its inputs are set."""


def run_through(case: Case) -> Run:
    with Instance(case.folder) as fmu:
        fmu.start(**case.inputs_at(0))
        stepped, golden = [], [fmu.get(*case.outputs)]
        for i in range(case.steps):
            fmu.step(float(case.time[i]), float(case.time[i + 1] - case.time[i]))
            stepped.append(fmu.get(*case.outputs))
            fmu.set(**case.inputs_at(i + 1))
            golden.append(fmu.get(*case.outputs))
        fmu.fmu.terminate()
    return Run(np.array(stepped), np.array(golden))


@pytest.fixture(scope="module")
def run(case: Case) -> Run:
    return run_through(case)


def test_fmu_gives_the_run_that_python_wrote_to_the_last_bit(case: Case, run: Run) -> None:
    np.testing.assert_array_equal(run.golden, case.golden)


# ---- tools --------------------------------------------------------------------------------------


def run_ecos(case: Case) -> FloatArray:
    ecos = module("ecospy")
    rows = []

    def read(name: str) -> float:
        get = simulation.get_bool if name in case.booleans else simulation.get_real
        return float(get(f"subject::{name}"))

    with ecos.EcosSimulationStructure() as structure:
        structure.add_model("subject", str(case.fmu))
        start = {f"subject::{name}": value for name, value in case.inputs_at(0).items()}
        assert structure.add_parameter_set("start", start)
        with ecos.EcosSimulation(case.step, structure=structure) as simulation:
            assert simulation.init(0.0, "start"), ecos.EcosLib.get_last_error()
            for i in range(case.steps):
                for name, value in case.inputs_at(i).items():
                    simulation.set_real(f"subject::{name}", value)
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
    execution = cosim.from_step_size(round(case.step * 1e9))
    slave = module("libcosimpy.CosimSlave").CosimLocalSlave(str(case.fmu), "subject")
    assert slave.ptr(), "libcosim cannot read the FMU"  # it would crash on it
    index = execution.add_local_slave(slave)
    observer, manipulator = observers.create_last_value(), manipulators.create_override()
    assert execution.add_observer(observer)
    assert execution.add_manipulator(manipulator)
    inputs = [case.references[name] for name in case.inputs]
    reals = [case.references[name] for name in case.outputs if name not in case.booleans]
    booleans = [case.references[name] for name in case.outputs if name in case.booleans]
    for reference, value in zip(inputs, case.inputs_at(0).values(), strict=True):
        assert execution.real_initial_value(index, reference, value)
    rows = []
    for i in range(case.steps):
        assert manipulator.slave_real_values(index, inputs, [*case.inputs_at(i).values()])
        assert execution.step(), execution.status()
        got = dict(zip(reals, observer.last_real_values(index, reals), strict=True))
        if booleans:  # none is an index out of range to it
            got |= dict(zip(booleans, observer.last_boolean_values(index, booleans), strict=True))
        rows.append([float(got[case.references[name]]) for name in case.outputs])
    return np.array(rows)


@pytest.mark.parametrize("case", LOCOMOTIVE, ids=case_name, indirect=True, scope="module")
@pytest.mark.parametrize("tool", [run_ecos, run_libcosim])
def test_tool_gives_the_same_trajectory(
    case: Case, run: Run, tool: Callable[[Case], FloatArray]
) -> None:
    trajectory = tool(case)
    assert trajectory.shape == run.stepped.shape
    of_vehicle = case.description.modelName == "Vehicle"
    allowed = (OF_VEHICLE if of_vehicle else TOLERANCE) * np.abs(run.stepped).max(axis=0)
    errors = np.abs(trajectory - run.stepped).max(axis=0)
    rows = zip(case.outputs, errors.tolist(), allowed.tolist(), strict=True)
    assert {name: error for name, error, largest in rows if not error <= largest} == {}


# ---- platforms ----------------------------------------------------------------------------------


def write_golden(case: Case, outputs: FloatArray, path: Path) -> Path:
    """A run as tests/native/run_golden.c reads it."""
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
    emulators = [path for path in map(shutil.which, programs) if path]
    folders = [option for option in options if option.startswith("/")]
    if not emulators or not all(Path(folder).is_dir() for folder in folders):
        missing(f"nothing here runs programs of {platform}: {' or '.join(programs)} {folders}")
    return [emulators[0], *options]


def library_of(case: Case, platform: str) -> Path:
    """The platform's binary in the FMU."""
    built = kernel.library_path(platform)
    if not built.is_file():
        missing(f"'python fmu/build_hook.py {platform}' has not been run")
    folders = FMI2_FOLDERS if case.version == 2 else FMI3_FOLDERS
    (folder,) = (name for name, served in folders.items() if served[0] == platform)
    name = case.description.coSimulation.modelIdentifier
    return case.folder / "binaries" / folder / f"{name}{built.suffix}"


@pytest.fixture(scope="session")
def runner(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Program that runs a golden case, by platform."""
    return cache(lambda platform: compiled("run_golden", platform, tmp_path_factory.mktemp("run")))


def compiled(name: str, platform: str, folder: Path) -> Path:
    """Program of tests/native, for a platform."""
    for needed in ("ziglang", "hatchling"):
        module(needed)
    hook = runpy.run_path(str(package_folder("fmu") / "build_hook.py"))
    program = folder / f"{name}.exe"
    hook["zig_cc"](
        platform,
        # Stripped like the library, so that both take the same Windows runtime from the
        # compiler's cache: it builds one for every setting, in a minute and a half.
        *("-s", "-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"),
        "-ffp-contract=off",
        # As a system's: the FMI headers have their own warnings.
        *(
            "-isystem",
            str(Path(fmpy.__file__).parent / "c-code"),
            f"-I{package_folder('fmu') / 'kernel'}",
            f"-I{package_folder('fmu') / 'fmi'}",
        ),
        str(Path(__file__).parents[1] / "native" / f"{name}.c"),
        *("-o", str(program)),
    )
    return program


def run_golden(
    case: Case, platform: str, library: Path, csv: Path, program: Path, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    command = emulator(platform)
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
        [*command, str(program), *arguments, "0"],  # nothing may differ
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.mark.parametrize("platform", EMULATORS)
def test_binary_of_each_platform_gives_the_same_trajectory(
    case: Case,
    platform: str,
    runner: Callable[[str], Path],
    request: pytest.FixtureRequest,
    tmp_path: Path,
) -> None:
    windows = platform.endswith("windows")
    environment = request.getfixturevalue("wine_environment") if windows else {}
    csv = write_golden(case, case.golden, tmp_path / "golden.csv")
    library = library_of(case, platform)
    ran = run_golden(case, platform, library, csv, runner(platform), environment)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert ran.stdout.startswith(f"{case.time.size} rows")


@pytest.mark.parametrize("platform", [name for name in EMULATORS if name != HERE])
def test_own_mathematics_has_the_same_bits_on_every_platform(
    platform: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    environment = os.environ.copy()
    if platform.endswith("windows"):
        environment |= request.getfixturevalue("wine_environment")
    sums = []
    for name in (HERE, platform):
        command = [*emulator(name), str(compiled("simd_math_functions", name, tmp_path)), "sums"]
        ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        sums.append(ran.stdout.split())
    assert sums[0] == sums[1]
    assert len(set(sums[0])) == 2 * 5  # functions and their sums


# ---- sources ------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[2, 3], ids=lambda version: f"fmi{version}")
def source_case(
    request: pytest.FixtureRequest, locomotive: cl.Model, tmp_path_factory: pytest.TempPathFactory
) -> Case:
    """An FMU without binaries. One kind stands for all, as all have the same sources."""
    if shutil.which("cc") is None:
        missing("there is no C compiler")
    made = make_case(Subject("wheelset-memory", request.param), locomotive, tmp_path_factory)
    shutil.rmtree(made.folder / "binaries")
    return made


def test_fmpy_compiles_the_fmu_from_its_sources(
    source_case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # CMake comes with FMPy, but for its way to it.
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    for program in ("c++", "make"):  # CMake requires both, and needs no C++
        if shutil.which(program) is None:
            missing(f"there is no {program}")
    build = tmp_path / "build"
    build.mkdir()
    fmpy.build.build_platform_binary(
        source_case.folder,
        build_dir=build,
        all_warnings=True,
        cmake_options={"CMAKE_C_FLAGS:STRING": "-Werror", "CMAKE_C_EXTENSIONS:BOOL": "OFF"},
    )
    np.testing.assert_array_equal(run_through(source_case).golden, source_case.golden)


def test_build_description_names_all_that_a_library_needs(
    source_case: Case, runner: Callable[[str], Path], tmp_path: Path
) -> None:
    platform = kernel.platform_name()
    if source_case.version == 2 or not platform.endswith("linux"):
        pytest.skip("FMI 2 has no word for libraries, and other platforms have none to name")
    sources = source_case.folder / "sources"
    builds = ElementTree.parse(sources / "buildDescription.xml").getroot()
    (build,) = builds.iterfind(f"BuildConfiguration[@platform='{platform}']")
    library = tmp_path / "built.so"
    subprocess.run(
        [
            *("cc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fPIC", "-shared"),
            "-Wl,-z,defs",  # nothing may be left for the program that loads it to bring along
            *("-isystem", str(Path(fmpy.__file__).parent / "c-code")),
            *(str(sources / file.attrib["name"]) for file in build.iter("SourceFile")),
            *(f"-l{needed.attrib['name']}" for needed in build.iter("Library")),
            *("-o", str(library)),
        ],
        check=True,
    )
    csv = write_golden(source_case, source_case.golden, tmp_path / "golden.csv")
    ran = run_golden(source_case, platform, library, csv, runner(platform), {})
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", ["force_element", "creep_forces"])
def test_casadi_reads_every_output_as_a_real_number(
    locomotive: cl.Model, tmp_path: Path, kind: str, version: int
) -> None:
    casadi = module("casadi")
    folder = exported(locomotive, tmp_path, kind, version, booleans=False)
    builder = casadi.DaeBuilder("contact", str(folder))
    inputs, outputs = list(builder.u()), list(builder.y())
    called = builder.create("outputs", ["u", "p"], ["y"])
    by_input = called.factory("slopes", ["u", "p"], ["jac:y:u"])
    parameters = builder.start(builder.p())
    with Instance(folder).start() as tool:
        assert set(outputs) == {
            v.name for v in tool.description.modelVariables if v.causality == "output"
        }
        assert tool.booleans == set()
        for slip in (0.0, 0.002, 0.05):
            given: dict[str, Any] = {
                "omega": 20.0 * (1.0 + slip),
                "speed": 10.0,
                "creepage_x": -slip,
            }
            start = dict(zip(inputs, builder.start(inputs), strict=True))
            values: dict[str, Any] = {name: given.get(name, start[name]) for name in inputs}
            answer = called(list(values.values()), parameters)
            slopes = by_input(list(values.values()), parameters)
            tool.set(**values)
            assert np.array(answer).ravel().tolist() == tool.get(*outputs)
            assert np.isfinite(np.array(slopes)).all()
    if kind == "force_element":
        falls = float(answer[outputs.index("falling_branch")])
        assert falls == 1.0  # at the last point


def test_casadi_takes_several_wheels_in_fmi_2(locomotive: cl.Model, tmp_path: Path) -> None:
    casadi = module("casadi")
    rates = {}
    for version in (2, 3):
        options: dict[str, Any] = {"wheels": 2, "booleans": False}
        folder = exported(locomotive, tmp_path, "wheelset", version, **options)
        dae = casadi.DaeBuilder("wheelsets", str(folder))
        with nullcontext() if version == 2 else pytest.raises(RuntimeError):  # no arrays
            equations = dae.create("equations", ["x", "u"], ["ode"])
            rates[version] = equations([20.0, 20.5, 10.0, 10.0, 1.0, 1.0], dae.start(dae.u()))
    first, second = rates[2].full().ravel()[:2]
    assert second < first  # the second one slips


@pytest.mark.parametrize("version", [2, 3])
def test_casadi_reads_derivatives_and_their_exact_jacobian(
    locomotive: cl.Model, tmp_path: Path, version: int
) -> None:
    casadi = module("casadi")
    settings: dict[str, Any] = {"kind": "wheelset", "fmi_version": version, "booleans": False}
    fmu = cl.export_fmu(locomotive, tmp_path / "wheelset.fmu", **settings)
    dae = casadi.DaeBuilder("wheelset", str(fmu))
    # Other derivatives of CasADi 3.8.2 are wrong: see docs/howto/optimal_control.md.
    by_jacobian = {"enable_forward": False, "enable_reverse": False}
    equations = dae.create("equations", ["x", "u"], ["ode", "y"], by_jacobian)
    known = casadi.MX.sym("known", dae.nx() + dae.nu())
    ode = equations(known[: dae.nx()], known[dae.nx() :])[0]
    jacobian = casadi.Function("jacobian", [known], [casadi.jacobian(ode, known)])
    names = {group: getattr(dae, group)() for group in ("x", "u", "y")}
    rates = [f"der({name})" for name in names["x"]]
    description = Description(locomotive, "wheelset")
    kind, contact, start = description.kind, description.native_contact, description.start_values
    native = kernel.NativeModel(kind, contact, start)
    falling = []
    for creepage in (-0.2, -1e-3, 1e-3, 0.01, 0.02, 0.5):
        point = {"drive_torque": 2e4, "lateral_velocity": 0.01, "spin_velocity": 0.5}
        point |= {"brake_torque": 1e3, "pads": 0.7}
        point = {**start, **point, "omega": 20.0 * (1.0 + creepage), "friction_scale": 0.8}
        x, u = ([point[name] for name in names[group]] for group in ("x", "u"))
        native.set(**point)
        native.evaluate()
        ode, y = equations(x, u)
        np.testing.assert_allclose(ode.full().ravel(), native.get(*rates), rtol=1e-13)
        np.testing.assert_allclose(y.full().ravel(), native.get(*names["y"]), rtol=1e-13)
        falling += native.get("falling_branch")
        computed = jacobian(x + u).full()
        columns = [native.tangent(rates, {name: 1.0}) for name in names["x"] + names["u"]]
        exact = np.transpose(columns)
        np.testing.assert_allclose(computed, exact, rtol=1e-9, atol=1e-12 * np.abs(exact).max())
    assert {0.0, 1.0} == {*falling}
