"""Several wheels in one FMU, against as many FMUs of one wheel; for messages see test_wheels.c."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from exported_fmu import exported
from fmpy.validation import validate_fmu
from fmu_instance import EXPORTS, Instance, Wheels

import contactlib as cl
from contactlib.kernel.library import ffi, library, pointer, struct_dtype

WHEELS = 8
# From the start of the run; each wheel has its own load, velocities and friction.
INPUTS: dict[str, Any] = {
    "omega": lambda i, k: (1.0 + 0.002 * i * np.sin(0.3 * k)) * 20.0,
    "speed": lambda i, k: 10.0 - 0.01 * k,
    "drive_torque": lambda i, k: 2e4 + 2e3 * i,
    "brake_torque": lambda i, k: 1e5 if i % 3 == 2 else 0.0,  # locks
    "normal_load": lambda i, k: 0.0 if i == 3 else 1e5 - 2e3 * i + 50.0 * k,
    "friction_scale": lambda i, k: 0.3 if i == 4 else 1.0 - 0.02 * i,
    "semi_axis_x": lambda i, k: 0.0 if i == 3 else 6e-3 + 1e-4 * i,  # by Hertz, wheel 4 in the air
    "semi_axis_y": lambda i, k: 0.0 if i == 3 else 5e-3,
    "lateral_velocity": lambda i, k: 0.01 if i == 5 else 0.0,
    "spin_velocity": lambda i, k: 0.02 if i == 6 else 0.0,
    "creepage_x": lambda i, k: -0.0005 * i,
    "creepage_y": lambda i, k: 0.0001 * k,
    "spin": lambda i, k: 0.01 * i,
}
FRICTION = [0.45 + 0.01 * i for i in range(WHEELS)]


def inputs_at(names: list[str], wheel: int, step: int) -> dict[str, float]:
    return {name: INPUTS[name](wheel, step) for name in names if name in INPUTS}


# Axles of a vehicle are no single ones: test_vehicle_fmu.py has them.
CASES = [name for name in EXPORTS if name not in ("wheelset_body", "vehicle")]


@pytest.fixture(scope="module", params=[(n, v) for n in CASES for v in (2, 3)], ids=str)
def pair(
    request: pytest.FixtureRequest, locomotive: cl.Model, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """FMUs of several wheels and of one."""
    (name, version), folder = request.param, tmp_path_factory.mktemp("wheels")
    options = {"wheels": WHEELS, "per_wheel": ["static_friction"]}
    return (
        exported(locomotive, folder, name, version, **options),
        exported(locomotive, folder, name, version),
    )


def test_wheels_have_the_bits_of_single_ones(pair: tuple[Path, Path]) -> None:
    together = Wheels(Instance(pair[0]).initialize(), WHEELS)
    singles = [Instance(pair[1]).initialize() for _ in range(WHEELS)]
    together.set(static_friction=FRICTION)
    states = [v.derivative.name for v in singles[0].description.modelVariables if v.derivative]
    for k in range(40):
        names = [name for name in together.inputs if k == 0 or name not in states]
        given = [inputs_at(names, i, k) for i in range(WHEELS)]
        together.set(**{name: [wheel[name] for wheel in given] for name in given[0]})
        for i, (single, values) in enumerate(zip(singles, given, strict=True)):
            single.set(**values, **({"static_friction": FRICTION[i]} if k == 0 else {}))
        for tool in (together.tool, *singles):
            if k == 0:
                tool.fmu.exitInitializationMode()
            tool.step(0.001 * k, 0.001)
        for name in together.outputs:
            expected = [single.get(name)[0] for single in singles]
            assert together.get(name) == expected, (name, k)
    if states:
        assert len({*together.get(states[0])}) == WHEELS


@pytest.mark.parametrize(
    ("name", "value"), [("layer_compliance", 1e-13), ("softening_temperature", 500.0)]
)
@pytest.mark.parametrize("memory", [False, True])
def test_a_wheel_may_be_the_only_one_of_its_kind(
    locomotive: cl.Model, name: str, value: float, memory: bool
) -> None:
    element = replace(locomotive.wheelset.element, memory=memory)
    contact, parameters = element.rolling_native.structs
    members = [field for field, _ in ffi.typeof("force_element_parameters").fields]
    inputs = np.zeros(WHEELS, struct_dtype("force_element_input"))
    inputs["speed"], inputs["omega"] = 10.0, 22.0
    inputs["normal_load"], inputs["friction_scale"] = 9e4, 1.0
    for only in (1, WHEELS - 1):
        each = []
        for wheel in range(WHEELS):
            given = {field: getattr(parameters, field) for field in members}
            given["thermal_effusivity"] = 1.2e4
            given |= {name: value} if wheel == only else {}
            each.append(ffi.new("force_element_parameters *", given))
        together, single = (np.zeros(WHEELS, struct_dtype("force_element_output")) for _ in "12")
        at = [pointer(inputs[i:], "force_element_input") for i in range(WHEELS)]
        to = [pointer(together[i:], "force_element_output") for i in range(WHEELS)]
        tasks = ffi.new("force_task[]", list(zip(each, at, to, strict=True)))
        library().force_elements_evaluate(contact, tasks, WHEELS)
        for i in range(WHEELS):
            room = pointer(single[i:], "force_element_output")
            library().force_element_evaluate(contact, each[i], at[i], room)
        np.testing.assert_array_equal(together, single)
        assert single["steady_force"][only] != single["steady_force"][0]


def test_states_and_events_of_each_wheel(pair: tuple[Path, Path]) -> None:
    tools = Instance(pair[0], exchange=True), Instance(pair[1], exchange=True)
    together, count = Wheels(tools[0].start(), WHEELS), WHEELS
    single = tools[1].start()
    for tool in (together.tool, single):
        tool.fmu.newDiscreteStates() if tool.version == 2 else tool.fmu.updateDiscreteStates()
        tool.fmu.enterContinuousTimeMode()
    names = [v.derivative.name for v in single.description.modelVariables if v.derivative]
    falling = [name for name in ("falling_branch",) if name in together.outputs]
    given = [inputs_at(together.inputs, i, 7) for i in range(count)]
    together.set(**{name: [of[name] for of in given] for name in given[0]})
    start = {"omega": 20.0, "speed": 10.0, "held_force": 1e4}
    for i in range(count):
        single.set(**given[i], **{n: (1.0 + 0.001 * i) * start[n] for n in names if n in start})
        for name in names:
            values = together.get(name)
            values[i] = single.get(name)[0]
            together.set(**{name: values})
        states, n = len(names), len(single.description.eventIndicators or ()) or 6
        for call, size in (
            ("ContinuousStates", states),
            ("ContinuousStateDerivatives" if single.version == 3 else "Derivatives", states),
            ("EventIndicators", n if falling else 0),
        ):
            all_of, of_one = np.zeros(size * count), np.zeros(size)
            for tool, numbers in ((together.tool, all_of), (single, of_one)):
                pointer = np.ctypeslib.as_ctypes(numbers)
                function = getattr(tool.fmu, f"fmi{tool.version}Get{call}")
                function(tool.fmu.component, pointer, numbers.size)
            np.testing.assert_array_equal(all_of.reshape(size, count)[:, i], of_one, err_msg=call)


def test_derivatives_couple_no_wheels(pair: tuple[Path, Path]) -> None:
    together, single = Wheels(Instance(pair[0]).start(), WHEELS), Instance(pair[1]).start()
    outputs = [n for n in together.outputs if n in ("creep_force", "force_x", "lateral_force")]
    known = "creepage_x" if "creepage_x" in together.inputs else "omega"
    given = [inputs_at(together.inputs, i, 2) for i in range(WHEELS)]
    together.set(**{name: [of[name] for of in given] for name in given[0]})
    of, to = together.references(*outputs), together.references(known)
    seed = [0.0] * WHEELS
    for i in range(WHEELS):
        single.set(**given[i])
        expected = single.derivative(outputs, [known], [2.0])
        seed[i] = 2.0
        size = [WHEELS * len(outputs)] if together.version == 3 else []
        derivative = together.tool.fmu.getDirectionalDerivative(of, to, seed, *size)
        table = np.reshape(derivative, (len(outputs), WHEELS))
        seed[i] = 0.0
        np.testing.assert_array_equal(table[:, i], expected)
        assert np.count_nonzero(np.delete(table, i, axis=1)) == 0
    friction = ["static_friction", "kinetic_friction"]
    if together.version == 3:  # a common parameter moves all wheels, one per wheel only its own
        references = [together.tool.references[name] for name in friction]
        weight = np.arange(1.0, WHEELS * len(outputs) + 1.0).tolist()
        adjoint = together.tool.fmu.getAdjointDerivative(of, references, weight, WHEELS + 1)
        columns = [
            together.tool.fmu.getDirectionalDerivative(
                of, references, np.eye(WHEELS + 1)[j].tolist(), len(weight)
            )
            for j in range(WHEELS + 1)
        ]
        np.testing.assert_allclose(adjoint, np.array(columns) @ weight, rtol=1e-12, atol=1e-9)


def test_saved_states_hold_all_wheels(pair: tuple[Path, Path]) -> None:
    together = Wheels(Instance(pair[0]).start(), WHEELS)

    def step(time: float) -> list[list[float]]:
        together.set(friction_scale=[1.0 - 0.05 * i - time for i in range(WHEELS)])
        together.tool.step(time, 0.01)
        return [together.get(name) for name in together.outputs]

    step(0.0)
    saved = together.tool.saved()
    first = step(0.01)
    step(0.02)
    other = Wheels(Instance(pair[0]).start(), WHEELS)
    other.tool.restore(saved)
    together.tool.restore(saved)
    assert step(0.01) == first
    assert together.tool.saved() != saved
    with Instance(pair[1]).start() as single, single.refused("another FMU"):
        single.restore(saved)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", ["wheelset", "force_element", "force_element-memory"])
def test_wheels_of_other_radii_begin_without_slip(
    locomotive: cl.Model, tmp_path: Path, kind: str, version: int
) -> None:
    folder = exported(locomotive, tmp_path, kind, version, wheels=WHEELS, per_wheel=["radius"])
    together = Wheels(Instance(folder).initialize(), WHEELS)
    (start,) = {*together.get("omega")}
    given = [locomotive.wheelset.radius * (1.0 - 0.01 * i) for i in range(WHEELS)]
    together.set(radius=[0.3] * WHEELS)
    together.set(radius=given)  # the last one counts
    omega = together.get("omega")
    assert omega[0] == start
    np.testing.assert_allclose(np.multiply(omega, given), start * given[0], rtol=1e-15)
    together.set(omega=[0.5 * start] * WHEELS)
    together.set(radius=given[::-1])
    assert together.get("omega") == [0.5 * start] * WHEELS  # as the tool has set it
    together.set(radius=given, omega=omega)
    together.tool.fmu.exitInitializationMode()
    assert np.abs(together.get("creepage")).max() < 1e-15
    together.tool.step(0.0, 1e-3)
    assert together.tool.log == []


@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.slow), 3])
@pytest.mark.parametrize("name", ["wheelset-memory", "creep_forces"])
def test_description_is_valid_and_names_each_wheel(
    locomotive: cl.Model, tmp_path: Path, name: str, version: int
) -> None:
    options: dict[str, Any] = {"wheels": WHEELS, "per_wheel": ["static_friction"]}
    folder = exported(locomotive, tmp_path, name, version, **options)
    assert validate_fmu(str(folder)) == []
    description = fmpy.read_model_description(str(folder))
    variables = {v.name: v for v in description.modelVariables}
    if description.fmiVersion == "2.0":
        assert {"friction_scale[8]", "kinetic_friction", "static_friction[8]"} < set(variables)
        output = next(v for v in description.outputs if v.variable.name.endswith("[3]"))
        assert {d.name.partition("[")[2] for d in output.dependencies} <= {"", "3]"}
        return
    arrays = {name for name, v in variables.items() if v.dimensions}
    assert {"friction_scale", "static_friction"} < arrays
    assert not {"kinetic_friction", "time"} & arrays
    assert all(int(variables[name].dimensions[0].start) == WHEELS for name in arrays)


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_fmpy_runs_eight_wheelsets(locomotive: cl.Model, tmp_path: Path, version: int) -> None:
    options: dict[str, Any] = {"kind": "wheelset", "fmi_version": version}
    eight = cl.export_fmu(locomotive, tmp_path / "8.fmu", wheels=WHEELS, **options)
    single = cl.export_fmu(locomotive, tmp_path / "1.fmu", **options)
    ends = ["omega"] if version == 3 else [f"omega[{i + 1}]" for i in range(WHEELS)]
    torque = np.linspace(1e4, 2e4, WHEELS)
    starts: dict[str, Any] = {f"drive_torque[{i + 1}]": t for i, t in enumerate(torque)}
    if version == 3:
        starts = {"drive_torque": torque}
    for interface in ("CoSimulation", "ModelExchange"):

        def end(fmu: Path, output: list[str], given: dict[str, Any], how: str = interface) -> Any:
            run = fmpy.simulate_fmu(
                str(fmu), fmi_type=how, start_values=given, output=output, stop_time=1.0
            )
            return np.array([run[name][-1] for name in output]).ravel()

        expected = [end(single, ["omega"], {"drive_torque": value})[0] for value in torque]
        np.testing.assert_allclose(end(eight, ends, starts), expected, rtol=1e-5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"wheels": 0}, "wheels = 0"),
        ({"wheels": 33}, "wheels = 33"),
        ({"wheels": 2.5}, "wheels = 2.5"),
        ({"wheels": 2, "kind": "wheelset_body"}, "needs a kind with a contact"),
        ({"wheels": 2, "per_wheel": ["implicit"]}, "per_wheel = 'implicit' must be one of"),
        ({"wheels": 2, "per_wheel": ["omega"]}, "per_wheel = 'omega' must be one of: radius,"),
        ({"per_wheel": ["radius"]}, "per_wheel = 'radius' needs wheels > 1"),
    ],
)
def test_bad_numbers_of_wheels_are_refused(
    locomotive: cl.Model, tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        cl.export_fmu(locomotive, tmp_path / "x.fmu", **options)
