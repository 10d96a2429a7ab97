"""The SSP package: its contents, and that tools which take it run it alike.

A tool that a developer does not have is skipped; with CONTACTLIB_REQUIRE_TOOLS=1 it is a failure.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import fmpy.ssp.simulation
import fmpy.ssp.ssd
import numpy as np
import pytest
from command_line import done
from fmu_proof import faults
from native_models import with_memory
from outside_tools import module

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.export.package import describe
from contactlib.export.ssp import operating_point

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SSC = "{http://ssp-standard.org/SSP1/SystemStructureCommon}"
OMS = "{https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
STRUCTURES = ("SystemStructure.ssd", "Subsystem.ssd")
SIGNALS = (
    ("body", "omega"),
    ("body", "speed"),
    ("contact", "creep_force"),
    ("contact", "creepage"),
)
DEFAULT_STEP = 5e-3
TOLERANCE = 1e-9  # of a signal's largest magnitude


@pytest.fixture(scope="module")
def ssp(locomotive: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return cl.export_ssp(locomotive, tmp_path_factory.mktemp("with space") / "system.ssp")


@pytest.fixture(scope="module", params=[2, 3])
def package(
    request: pytest.FixtureRequest,
    locomotive: cl.Model,
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """The package, unzipped."""
    folder = tmp_path_factory.mktemp("package")
    path = cl.export_ssp(locomotive, folder / "it.ssp", fmi_version=request.param)
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    return folder


def root_of(path: Path) -> ElementTree.Element:
    return ElementTree.parse(path).getroot()


def description_of(package: Path, component: ElementTree.Element) -> Any:
    return fmpy.read_model_description(str(package / component.get("source", "")))


# ---- contents -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pattern", "count", "schema"),
    [
        ("*.ssd", 2, "SystemStructureDescription.xsd"),
        ("resources/*.ssv", 3, "SystemStructureParameterValues.xsd"),
    ],
)
def test_files_follow_the_schemas(package: Path, pattern: str, count: int, schema: str) -> None:
    paths = list(package.glob(pattern))
    assert len(paths) == count
    for path in paths:
        tree = fmpy.ssp.ssd.etree.parse(str(path))
        fmpy.ssp.ssd.validate_tree(tree.getroot(), schema)  # raises


def test_package_holds_what_the_standard_requires(package: Path) -> None:
    with zipfile.ZipFile(package / "it.ssp") as archive:
        names = archive.namelist()
        assert {entry.compress_type for entry in archive.infolist()} <= {0, 8}
    assert all(name in names for name in STRUCTURES)
    assert "documentation/index.html" in names
    folders = {name.split("/")[0] for name in names if "/" in name}
    assert folders == {"resources", "documentation"}
    titles = [root_of(package / name).get("name") for name in STRUCTURES]
    assert len(set(titles)) == 2
    for fmu in (package / "resources").glob("*.fmu"):
        assert list(faults(fmu)) == []


@pytest.mark.parametrize("structure", STRUCTURES)
def test_connectors_are_variables_of_the_fmus(package: Path, structure: str) -> None:
    root = root_of(package / structure)
    units = {
        unit.get("name"): unit.find(f"{SSC}BaseUnit").attrib  # type: ignore[union-attr]
        for unit in root.iter(f"{SSC}Unit")
    }
    used = set()
    for component in root.iter(f"{SSD}Component"):
        description = description_of(package, component)
        variables = {v.name: v for v in description.modelVariables}
        definitions = {unit.name: unit.baseUnit for unit in description.unitDefinitions}
        for connector in component.iter(f"{SSD}Connector"):
            variable = variables[connector.get("name")]
            assert connector.get("kind") == variable.causality
            real = connector.find(f"{SSC}Real")
            assert real is not None
            unit = real.get("unit")
            assert unit == (variable.unit or variable.declaredType.unit)
            for base in ("kg", "m", "s", "A", "K", "mol", "cd", "rad"):
                assert int(units[unit].get(base, 0)) == getattr(definitions[unit], base)
            used.add(unit)
    assert set(units) == used


def connector_kinds(root: ElementTree.Element) -> dict[tuple[str | None, str], tuple[str, str]]:
    """Kind and unit of each connector, by element (None: the system) and name."""
    system = root.find(f"{SSD}System")
    assert system is not None
    return {
        (None if element is system else element.get("name"), connector.get("name", "")): (
            connector.get("kind", ""),
            connector.find(f"{SSC}Real").get("unit", ""),  # type: ignore[union-attr]
        )
        for element in (system, *system.iter(f"{SSD}Component"))
        for connector in element.findall(f"{SSD}Connectors/{SSD}Connector")
    }


@pytest.mark.parametrize("structure", STRUCTURES)
def test_every_input_comes_from_one_place(package: Path, structure: str) -> None:
    root = root_of(package / structure)
    kinds = connector_kinds(root)
    targets = []
    for c in root.iter(f"{SSD}Connection"):
        start = (c.get("startElement"), c.get("startConnector", ""))
        end = (c.get("endElement"), c.get("endConnector", ""))
        assert kinds[start][1] == kinds[end][1]  # unit
        # What enters the system goes to inputs, and what leaves it comes from outputs.
        expected = (
            "input" if start[0] is None else "output",
            "output" if end[0] is None else "input",
        )
        assert (kinds[start][0], kinds[end][0]) == expected
        targets.append(end)
    fed = {
        place for place, (kind, _) in kinds.items() if (kind == "input") == (place[0] is not None)
    }
    assert sorted(targets, key=str) == sorted(fed, key=str)


def test_subsystem_has_the_connectors_of_a_wheelset(package: Path) -> None:
    kinds = connector_kinds(root_of(package / "Subsystem.ssd"))
    outer = {name: kind for (element, name), (kind, _) in kinds.items() if element is None}
    torques = ("drive_torque", "brake_torque")
    inputs = (*torques, "resistance_force", "normal_load", "friction_scale")
    outputs = ("omega", "speed", "creep_force", "creepage")
    assert outer == {**dict.fromkeys(inputs, "input"), **dict.fromkeys(outputs, "output")}
    closed = connector_kinds(root_of(package / "SystemStructure.ssd"))
    assert not any(element is None for element, _ in closed)


def test_parameters_are_start_values_of_the_fmus(package: Path, locomotive: cl.Model) -> None:
    values = {}
    for component in root_of(package / STRUCTURES[0]).iter(f"{SSD}Component"):
        (binding,) = component.iter(f"{SSD}ParameterBinding")
        root = root_of(package / binding.get("source", ""))
        units = {unit.get("name") for unit in root.iter(f"{SSC}Unit")}
        variables = {v.name: v for v in description_of(package, component).modelVariables}
        for parameter in root.iter(f"{SSV}Parameter"):
            variable, (value,) = variables[parameter.get("name")], parameter
            assert variable.causality in ("parameter", "input")  # libcosim takes no others
            assert value.get("value") == variable.start
            if value.tag == f"{SSV}Boolean":
                assert variable.type == "Boolean"
            else:
                assert value.get("unit") == (variable.unit or variable.declaredType.unit)
                assert value.get("unit") in units
            values[variable.name] = value.get("value", "")
    wheelset = locomotive.wheelset
    assert wheelset.mass is not None
    assert values["implicit"] == values["parallel_exchange"] == "true"
    inverse = wheelset.radius**2 / wheelset.inertia + 1.0 / wheelset.mass
    assert float(values["effective_inverse_mass"]) == pytest.approx(inverse, rel=1e-15)
    assert float(values["normal_load"]) == wheelset.element.axle_load
    assert float(values["friction_scale"]) == 1.0
    assert float(values["resistance_force"]) == 0.0


def test_inputs_of_the_subsystem_have_start_values_where_nothing_is_connected(
    package: Path,
) -> None:
    # OMSimulator sets a system's open connectors to zero, and with it those of its components.
    system = root_of(package / "Subsystem.ssd").find(f"{SSD}System")
    assert system is not None
    (binding,) = system.findall(f"{SSD}ParameterBindings/{SSD}ParameterBinding")
    bound = {
        parameter.get("name"): (parameter[0].get("value"), parameter[0].get("unit"))
        for parameter in root_of(package / binding.get("source", "")).iter(f"{SSV}Parameter")
    }
    starts = {
        v.name: (v.start, v.unit or v.declaredType.unit)
        for component in system.iter(f"{SSD}Component")
        for v in description_of(package, component).modelVariables
        if v.causality == "input"
    }
    kinds = connector_kinds(root_of(package / "Subsystem.ssd"))
    inputs = {name for (part, name), (kind, _) in kinds.items() if (part, kind) == (None, "input")}
    assert bound == {name: starts[name] for name in inputs}
    closed = root_of(package / "SystemStructure.ssd").find(f"{SSD}System")
    assert closed is not None
    assert closed.find(f"{SSD}ParameterBindings") is None


@pytest.mark.parametrize("structure", STRUCTURES)
def test_omsimulator_finds_its_master(package: Path, structure: str) -> None:
    # As it writes it itself. It reads the first annotation of a system and no other.
    (annotations,) = root_of(package / structure).findall(f"{SSD}System/{SSD}Annotations")
    (annotation,) = annotations.findall(f"{SSC}Annotation")
    assert annotation.get("type") == "org.openmodelica"
    master = annotation.find(f"{OMS}Annotations/{OMS}SimulationInformation/{OMS}FixedStepMaster")
    assert master is not None
    assert master.get("description") == "oms-ma"  # both step at once, as the element expects
    assert float(master.get("stepSize", "")) == DEFAULT_STEP
    text = (package / structure).read_text(encoding="utf-8")
    assert "<oms:FixedStepMaster " in text  # it reads prefixes, not namespaces


def test_package_names_who_made_what(locomotive: cl.Model, tmp_path: Path) -> None:
    path = cl.export_ssp(locomotive, tmp_path / "it.ssp", author="A. B.", version="7")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    for name in (*STRUCTURES, "resources/contact.ssv", "resources/body.ssv"):
        root = root_of(tmp_path / name)
        assert [root.get(key) for key in ("version", "author", "fileversion")] == [
            *("1.0", "A. B.", "7")
        ]
        assert root.get("generationTool", "").startswith("contactlib ")
    for fmu in (tmp_path / "resources").glob("*.fmu"):
        assert fmpy.read_model_description(str(fmu)).author == "A. B."


@pytest.mark.parametrize("memory", [False, True])
@pytest.mark.parametrize("law", ["carter_griffith", "falling_friction", "polach"])
def test_start_is_steady_and_on_the_rising_branch(
    locomotive: cl.Model, tmp_path: Path, law: str, memory: bool
) -> None:
    text = cl.files.model_path("locomotive.toml").read_text(encoding="ascii")
    table = locomotive.wheelset.element.table
    if law == "polach":
        table = cl.CreepForceTable.from_law(cl.Polach.wet())
    elif law == "falling_friction":
        text = text.replace(
            "k_hat = 0.3", "k_hat = 0.3\nslip_rate_residual = 0.1\nslip_rate_decay = 5"
        )
        text = text.replace("initial_speed = 10.0", "initial_speed = 50.0")
    (tmp_path / "it.toml").write_text(text, encoding="ascii")
    model = cl.load_model(tmp_path / "it.toml", table=table)
    contact, body = parts(with_memory(model) if memory else model)
    contact.set(**dict(zip(("omega", "speed"), body.get("omega", "speed"), strict=True)))
    contact.evaluate()
    force, gradient, zeta = contact.get("creep_force", "force_gradient", "creepage")
    assert gradient > 0.0
    if memory:
        rates = np.array(contact.get("der(held_force)", "der(unslipped)", "der(outer_force)"))
        assert rates / [force, 1.0, force] == pytest.approx([0.0, 0.0, 0.0], abs=1e-8)  # [1/s]
    body.set(creep_force=force)
    body.evaluate()
    spin, pull = body.get("der(omega)", "der(speed)")
    assert pull > 0.0
    assert model.wheelset.radius * spin == pytest.approx((1.0 + zeta) * pull, rel=1e-9)


# ---- runs ---------------------------------------------------------------------------------------


def parts(model: cl.Model) -> list[kernel.NativeModel]:
    """Contact and body as the FMUs of the package hold them."""
    table, given = model.wheelset.element.native_contact, operating_point(model)
    made = []
    for kind, mode in (("force_element", True), ("wheelset_body", False)):
        description = replace(describe(model, kind, mode, mode), starts=given, whole_wheelset=True)
        made.append(kernel.NativeModel(kind, table, description.start_values))
    return made


def exchange(
    contact: kernel.NativeModel,
    body: kernel.NativeModel,
    *,
    step: float,
    count: int,
    from_nothing: bool = False,
) -> FloatArray:
    """The signals after each step, if both sides step at once.

    From nothing: the first step is made with zeros in place of what is exchanged.
    """
    velocities, force = {"omega": 0.0, "speed": 0.0}, 0.0
    if not from_nothing:
        velocities = dict(zip(velocities, body.get(*velocities), strict=True))
        contact.set(**velocities)
        contact.evaluate()
        (force,) = contact.get("creep_force")
    rows = []
    for _ in range(count):
        contact.set(**velocities)
        contact.evaluate()
        contact.advance(step)
        body.set(creep_force=force)
        body.evaluate()
        body.advance(step)
        velocities = dict(zip(velocities, body.get(*velocities), strict=True))
        force, creepage = contact.get("creep_force", "creepage")
        rows.append([*velocities.values(), force, creepage])
    return np.array(rows)


def run_fmpy(ssp: Path, step: float | None, count: int) -> FloatArray:
    step = DEFAULT_STEP if step is None else step
    result = fmpy.ssp.simulation.simulate_ssp(
        str(ssp), stop_time=(count - 0.5) * step, step_size=step
    )
    return np.array([result[f"{part}.{name}"] for part, name in SIGNALS]).T


def run_libcosim(ssp: Path, step: float | None, count: int) -> FloatArray:
    cosim = module("libcosimpy.CosimExecution").CosimExecution
    observers = module("libcosimpy.CosimObserver").CosimObserver
    execution = cosim.from_ssp_file(str(ssp), *([] if step is None else [step * 1e9]))
    observer = observers.create_last_value()
    assert execution.add_observer(observer)
    indices = {info.name.decode(): info.index for info in execution.slave_infos()}
    references = {
        (part, v.name.decode()): v.reference
        for part, index in indices.items()
        for v in execution.slave_variables(index)
    }
    rows = []
    for _ in range(count):
        assert execution.step(), execution.status()
        rows.append(
            [
                observer.last_real_values(indices[part], [references[part, name]])[0]
                for part, name in SIGNALS
            ]
        )
    return np.array(rows)


def run_ecos(ssp: Path, step: float | None, count: int) -> FloatArray:
    ecos = module("ecospy")
    rows = []
    step = DEFAULT_STEP if step is None else step
    with ecos.EcosSimulation(step, ssp_path=str(ssp)) as simulation:
        assert simulation.init(0.0, "parameters"), ecos.EcosLib.get_last_error()
        for _ in range(count):
            simulation.step()
            rows.append([float(simulation.get_real(f"{p}::{name}")) for p, name in SIGNALS])
        simulation.terminate()
    return np.array(rows)


def assert_equal(computed: FloatArray, expected: FloatArray) -> None:
    assert computed.shape == expected.shape
    allowed = TOLERANCE * np.abs(expected).max(axis=0)
    assert (np.abs(computed - expected).max(axis=0) <= allowed).all()


@pytest.mark.parametrize("run", [run_fmpy, run_libcosim, run_ecos])
@pytest.mark.parametrize(
    ("step", "speed"),
    [
        (1e-2, 10.0),
        *(
            pytest.param(step, speed, marks=pytest.mark.slow)
            for step, speed in ((1e-3, 10.0), (None, 10.0), (1e-3, 1.0), (1e-2, 1.0), (None, 1.0))
        ),
    ],
)
def test_tool_runs_it_as_both_step_at_once(
    locomotive: cl.Model,
    tmp_path: Path,
    run: Callable[[Path, float | None, int], FloatArray],
    step: float | None,
    speed: float,
) -> None:
    model = replace(locomotive, initial_speed=speed)
    rows = run(cl.export_ssp(model, tmp_path / "it.ssp"), step, 200)
    expected = exchange(
        *parts(model), step=step or DEFAULT_STEP, count=200, from_nothing=run is run_fmpy
    )
    assert_equal(rows, expected)


@pytest.mark.parametrize("run", [run_fmpy, run_libcosim, run_ecos])
def test_contact_may_lag(
    rig: cl.Model, tmp_path: Path, run: Callable[[Path, float | None, int], FloatArray]
) -> None:
    # A roller rig holds the speed: another body, besides the states.
    model = with_memory(rig)
    path = cl.export_ssp(model, tmp_path / "it.ssp")
    made = parts(model)
    expected = exchange(*made, step=1e-2, count=100, from_nothing=run is run_fmpy)
    assert_equal(run(path, 1e-2, 100), expected)
    held = 0.5 * rig.wheelset.element.saturation_creepage
    assert expected[-1, 3] == pytest.approx(held, rel=1e-9)


def stiff_solution(model: cl.Model, duration: float) -> FloatArray:
    """Omega and speed at the end, by the solver of the package."""
    start = operating_point(model)
    torque = start["drive_torque"]
    run = cl.simulate(
        model.wheelset,
        cl.TorqueControl(cl.Profile((0.0, duration), (torque, torque))),
        initial_speed=model.initial_speed,
        initial_creepage=start["omega"] * model.wheelset.radius / model.initial_speed - 1.0,
    )
    return np.array([run["omega"][-1], run["speed"][-1]])


@pytest.mark.parametrize("speed", [1.0, 10.0])
def test_system_converges_to_the_stiff_solver_with_first_order(
    locomotive: cl.Model, speed: float
) -> None:
    model = replace(locomotive, initial_speed=speed)
    exact = stiff_solution(model, 2.0)
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        rows = exchange(*parts(model), step=step, count=round(2.0 / step))
        errors.append(np.abs(rows[-1, :2] - exact))
    orders = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert ((orders > 0.9) & (orders < 1.25)).all()
    assert (errors[-1] < 1e-5 * exact).all()


# ---- page, errors, command ----------------------------------------------------------------------


@pytest.mark.parametrize("tool", ["libcosim", "fmpy", "ecos"])
def test_page_s_code_runs(
    ssp: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tool: str
) -> None:
    needed = {"libcosim": "libcosimpy.CosimExecution", "fmpy": "fmpy", "ecos": "ecospy"}
    module(needed[tool])
    with zipfile.ZipFile(ssp) as archive:
        page = archive.read("documentation/index.html")
    assert page.isascii()
    root = ElementTree.fromstring(page)
    (code,) = (e for e in root.iter("{http://www.w3.org/1999/xhtml}code") if e.get("class") == tool)
    (tmp_path / "CreepForceSystem.ssp").write_bytes(ssp.read_bytes())
    monkeypatch.chdir(tmp_path)
    printed: list[Any] = []
    exec("".join(code.itertext()), {"print": printed.append})  # noqa: S102
    (speed,) = np.ravel(printed)
    assert 10.0 < speed < 15.0


@pytest.mark.slow
def test_command_writes_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    model = cl.load_model("locomotive.toml")
    stated: dict[str, Any] = {"author": "A. B.", "version": "1.2"}
    options = ["--author", "A. B.", "--version", "1.2"]
    assert done("fmu", "locomotive.toml", "--ssp", *options).output == "CreepForceSystem.ssp\n"
    same = cl.export_ssp(model, tmp_path / "same.ssp", **stated)
    assert (tmp_path / "CreepForceSystem.ssp").read_bytes() == same.read_bytes()
    done("fmu", "locomotive.toml", *options)
    same = cl.export_fmu(model, tmp_path / "same.fmu", **stated)
    assert (tmp_path / "CreepForceElement.fmu").read_bytes() == same.read_bytes()
