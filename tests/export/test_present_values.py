"""A value that is set now gives what a model that was declared with it gives.

`variants` changes each number that a model's parts declare, by a random factor: the FMU of the
model is set to the values that follow and compared with the FMU of the changed model.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_fmu import exported
from fmu_instance import Instance, Wheels
from one_file_kernel import Library, compiler

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray, declared
from contactlib.export.description import Description
from contactlib.export.package import _start_values_file
from contactlib.kernel.drivetrains import drivetrain_dtype
from contactlib.vehicle.drivetrain import Axle, Brake, Drivetrain, Motor

LAYER = {"layer_compliance": 1e-13}  # a ratio of 0.86 in the ellipse [m/Pa]
FALL = {"slip_rate_residual": 0.8, "slip_rate_decay": 0.5}
HEAT = {"softening_temperature": 600.0}
# Of each case the model, what is replaced in its element, and in the element's friction.
CASES: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "line": ("rig", {}, {}),
    "line-memory": ("rig", {"memory": True}, FALL),
    "ellipse": ("locomotive", {}, {}),
    "layer-memory": ("locomotive", {**LAYER, "memory": True}, {}),
    "layer-fall-memory": ("locomotive", {**LAYER, "memory": True}, FALL),
    "heat-memory": ("locomotive", {"memory": True}, HEAT),
    "heat-layer": ("locomotive", LAYER, HEAT),
    "strips-memory": ("locomotive", {**LAYER, "memory": True}, {}),
    "measured-memory": ("locomotive", {"memory": True}, {}),
    "cohesive-layer-memory": ("rig", {**LAYER, "memory": True}, {}),
}
COMPILED = ("layer-fall-memory", "heat-memory", "cohesive-layer-memory")  # each takes seconds
# Values of a vehicle are set in test_vehicle_fmu.py.
KINDS = ("force_element", "wheelset", "wheelset_body", "creep_forces")
HELD = ("elliptic", "memory", "softening", "poisson_ratio")  # those of the exported contact
STATES = {  # over the load, but for the part that has not slipped
    "held_force": 0.11,
    "unslipped": 0.8,
    "outer_force": 0.02,
    "held_lateral": 0.02,
    "outer_lateral": 0.01,
}
ABSENT = {  # what becomes of a number that is not given
    "weakening_length": 1e-6,
    "slip_rate_decay": 0.2,
    "load_exponent": 0.3,
    "mass": 2e4,
    "damping": 20.0,
    "constant": 100.0,
    "linear": 5.0,
    "quadratic": 1.0,
    "grade": 0.01,
}
Variant = tuple[str, cl.Model, dict[str, Any]]  # what is changed, model, options of a Description
pytestmark = pytest.mark.filterwarnings(
    "ignore::contactlib.element.force_element.RangeWarning", "ignore::contactlib.InputWarning"
)


@pytest.fixture(scope="module")
def models(
    rig: cl.Model, locomotive: cl.Model, layered_cohesive_table: cl.CreepForceTable
) -> dict[str, cl.Model]:
    given, made = {"rig": rig, "locomotive": locomotive}, {}
    zeta = np.linspace(0.0, 0.1, 41)
    curve = cl.MeasuredCurve(zeta, 0.3 * np.tanh(zeta / 0.01) * np.exp(-zeta / 0.2))
    for name, (base, parts, friction) in CASES.items():
        model = given[base]
        element = model.wheelset.element
        if name.startswith("measured"):
            options = {"radius": element.radius, "wheels": element.wheels}
            element = cl.ForceElement.from_curve(curve, element.contact, **options)
        if name.startswith("cohesive"):
            element = replace(element, table=layered_cohesive_table)
        if name.startswith("strips"):
            contact: Any = element.contact
            element = replace(element, contact=replace(contact, theory="strips"))
        element = replace(element, friction=replace(element.friction, **friction), **parts)
        made[name] = of_part(model, "element", element)
    return made


# ---- models with other numbers -------------------------------------------------------------------


def parts_of(model: cl.Model) -> dict[str, Any]:
    wheelset = model.wheelset
    return {
        "contact": wheelset.element.contact,
        "friction": wheelset.element.friction,
        "element": wheelset.element,
        "resistance": wheelset.resistance,
        "wheelset": wheelset,
    }


def of_part(model: cl.Model, part: str, value: Any) -> cl.Model:
    """The model with another part."""
    wheelset = model.wheelset
    if part in ("contact", "friction"):
        part, value = "element", replace(wheelset.element, **{part: value})
    return replace(
        model, wheelset=value if part == "wheelset" else replace(wheelset, **{part: value})
    )


def of_friction(model: cl.Model, **given: Any) -> cl.Model:
    return of_part(model, "friction", replace(model.wheelset.element.friction, **given))


def random_value(name: str, value: Any, rng: np.random.Generator) -> Any:
    """Another value of a declared number, where zero and None mean something absent."""
    if not value:
        return ABSENT.get(name, value)
    if name == "wheels":
        return 2.0 * value
    low, high = (0.6, 0.9) if name == "slip_rate_residual" else (0.75, 1.25)
    return value * rng.uniform(low, high)


def variants(model: cl.Model, kind: str, seed: int) -> Iterator[Variant]:
    rng = np.random.default_rng(seed)
    element = model.wheelset.element
    both = rng.uniform(0.7, 1.3)
    of_both = {name: both * getattr(element.friction, name) for name in ("static", "kinetic")}
    yield "friction.both", of_friction(model, **of_both), {}
    for part, value in parts_of(model).items():
        source: Any = type(value)
        for name, parameter in declared(source).items():
            old = getattr(value, name)
            new = old if parameter.quantity is None else random_value(name, old, rng)
            if new == old or (name == "slip_rate_decay" and element.friction.softens_with_heat):
                continue  # it falls in one way only
            if name in ("static", "kinetic") and element.table.static_to_kinetic:
                continue  # the table is for one ratio
            if name == "static":
                new = max(new, value.kinetic)
            if name == "kinetic":
                new = min(new, value.static)
            yield f"{part}.{name}", of_part(model, part, replace(value, **{name: new})), {}
    speed = 10.0 * rng.uniform(0.5, 1.5)
    starts = {"speed": speed, "omega": 1.01 * speed / element.radius, "friction_scale": 0.8}
    starts |= {"drive_torque": 2e3, "resistance_force": 500.0, "creep_force": 9e3}
    starts |= {"brake_torque": 1e3, "pads": 0.9}
    starts |= {"lateral_velocity": 0.02, "creepage_x": -0.002, "creepage_y": 1e-3}
    starts |= {name: 1e4 * value for name, value in STATES.items()} | {"unslipped": 0.7}
    starts |= {"spin": 0.2, "spin_velocity": 0.3 if Description(model, kind).spins else 0.0}
    yield "starts", model, {"starts": starts}
    yield "max_substeps", model, {"starts": {"max_substeps": 2.0, "omega": 1.01 * speed}}
    if kind == "force_element":
        yield "effective_inverse_mass", model, {"starts": {"effective_inverse_mass": 1e-3}}
        yield "implicit", model, {"implicit": True}
        yield "parallel_exchange", model, {"implicit": True, "parallel_exchange": True}
    line = element.parameters["elliptic"] == 0.0
    for name, held in {"elliptic": float(line), "memory": 0.0, "softening": 0.01}.items():
        yield name, model, {"starts": {name: held}}
    if element.friction.softens_with_heat:
        yield "slip_rate_decay", model, {"starts": {"slip_rate_decay": 0.2}}


def changed(of: Description, to: Description) -> dict[str, float]:
    """Values of the variables of `of` that differ in `to`."""
    before, after = of.start_values, to.start_values
    return {n: after[n] for n in of.by_name if n in after and before[n] != after[n]}


def refusal(of: Description, to: Description) -> str:
    """Words with which an FMU refuses to become the other; empty if it must not."""
    start, values = of.start_values, changed(of, to)
    contacts = of.element.contact, to.element.contact
    shapes = [c.semi_width / c.transverse_half_length for c in contacts]
    bent = isinstance(contacts[0], cl.EllipticContact) and abs(shapes[0] / shapes[1] - 1.0) > 1e-9
    held = [n for n in HELD if n in values and abs(values[n] - start[n]) > 1e-9 * abs(start[n])]
    if of.has_contact and (held or (bent and of.remembers)):
        return "of the exported contact"
    both = all(to.start_values.get(n, 0.0) for n in ("slip_rate_decay", "softening_temperature"))
    return "friction already falls with temperature" if both else ""


def kinds_of(name: str) -> list[str]:
    """Kinds of FMU of a case: creep forces are those of half-spaces, a body has no contact."""
    half_space = CASES[name][0] == "locomotive" and not name.startswith("strips")
    needed = {"creep_forces": half_space, "wheelset_body": name in ("line", "ellipse")}
    return [kind for kind in KINDS if needed.get(kind, True)]


# ---- FMUs ----------------------------------------------------------------------------------------


def run(
    tool: Instance, description: Description, later: dict[str, float], seed: int
) -> dict[str, FloatArray]:
    """Outputs, rates and indicators after the start and at random inputs."""
    rng, load = np.random.default_rng(seed), description.element.axle_load
    variables = tool.description.modelVariables
    names = [v.name for v in variables if v.causality in ("output", "local")]
    given = {v.name for v in variables if v.causality == "input"}
    radius, rows = description.element.radius, []
    exchange = not hasattr(tool.fmu, "doStep")
    if exchange:
        tool.fmu.newDiscreteStates() if tool.version == 2 else tool.fmu.updateDiscreteStates()
        tool.fmu.enterContinuousTimeMode()
    else:
        tool.set(**later)
    for k in range(4):
        if not exchange:
            tool.step(1e-3 * k, 1e-3)
        rows.append(tool.get(*names))
        speed = rng.uniform(5.0, 15.0)
        inputs = {
            "speed": speed,
            "omega": (1.0 + rng.uniform(-0.02, 0.02)) * speed / radius,
            "normal_load": load * rng.uniform(0.5, 1.2),
            "friction_scale": rng.uniform(0.5, 1.2),
            "lateral_velocity": 0.003 * speed * rng.uniform(-1.0, 1.0) * (k % 2),
            "spin_velocity": 0.1 * speed * rng.uniform(-1.0, 1.0) * (k % 2),
            "drive_torque": 1e4 * rng.uniform(-1.0, 1.0),
            "brake_torque": 4e3 * rng.uniform(0.0, 1.0) * (k % 2),
            "pads": rng.uniform(-1.0, 1.0),
            "resistance_force": 1e4 * rng.uniform(-1.0, 1.0),
            "creep_force": load * rng.uniform(-0.2, 0.2),
            "creepage_x": rng.uniform(-0.01, 0.01),
            "creepage_y": rng.uniform(-0.003, 0.003),
            "spin": rng.uniform(-0.5, 0.5),
            "semi_axis_x": 1e-3 * rng.uniform(4.0, 6.0),
            "semi_axis_y": 1e-3 * rng.uniform(4.0, 6.0),
        }
        states = {n: v * (1.0 if n == "unslipped" else load) for n, v in STATES.items()}
        if exchange:
            given |= {v.derivative.name for v in variables if v.derivative}
        tool.set(**{n: v for n, v in {**inputs, **states}.items() if n in given})
    return dict(zip(names, np.transpose(rows), strict=True))


def compare(
    key: str, found: dict[str, Any], expected: dict[str, Any], rounding: float = 1e-12
) -> None:
    for name, values in expected.items():
        # Rates of a stiff contact magnify the rounding of its states.
        bound = 100.0 * rounding if "rate" in name or "der(" in name else rounding
        error = np.abs(found[name] - values).max()
        assert error <= bound * np.abs(values).max(), (key, name, found[name], values)


# Of other kinds than the force element, which has all variables of the contact.
QUICK = ("line", "layer-fall-memory", "heat-layer")


def is_quick(name: str, kind: str, exchange: bool, version: int) -> bool:
    """Whether the quick run has it; its interfaces and versions of FMI alternate."""
    at = list(CASES).index(name) + KINDS.index(kind)
    return (kind == "force_element" or name in QUICK) and (exchange, version) == (
        at % 2 == 1,
        2 + at // 2 % 2,
    )


FMUS = [
    pytest.param(name, kind, *other, marks=[] if is_quick(name, kind, *other) else pytest.mark.slow)
    for name in CASES
    for kind in kinds_of(name)
    for other in ((exchange, version) for exchange in (False, True) for version in (2, 3))
]


@pytest.mark.parametrize(("name", "kind", "exchange", "version"), FMUS)
def test_fmu(
    models: dict[str, cl.Model], tmp_path: Path, name: str, kind: str, exchange: bool, version: int
) -> None:
    """Tunable values are set while it steps, others before."""
    nominal, seed = Description(models[name], kind), list(CASES).index(name)
    folder = exported(models[name], tmp_path, kind, version)
    tunable = set() if exchange else {v.name for v in nominal.of_role("tunable_parameter")}
    seen: set[str] = set()
    with Instance(folder, exchange=exchange) as tool:
        for key, other, options in variants(models[name], kind, seed):
            expected = Description(other, kind, **options)
            values = changed(nominal, expected)
            if not values:
                continue
            seen |= values.keys()
            tool.fmu.reset()
            tool.initialize()
            later = {n: v for n, v in values.items() if n in tunable}
            for n, v in values.items():
                if n in tool.booleans:
                    tool.fmu.setBoolean([tool.references[n]], [bool(v)])
                elif n not in later:
                    tool.set(**{n: v})
            if reason := refusal(nominal, expected):
                tool.set(**later)
                with tool.refused(reason, "export the model"):
                    tool.fmu.exitInitializationMode()
                continue
            tool.fmu.exitInitializationMode()
            found = run(tool, expected, later, seed)
            (folder / "resources" / "start_values.bin").write_bytes(_start_values_file(expected))
            with Instance(folder, exchange=exchange, description=tool.description) as given:
                given.start()
                compare(key, found, run(given, expected, {}, seed))
    assert seen == {v.name for v in nominal.variables if v.start is not None}


@pytest.mark.parametrize("version", [2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["force_element", "wheelset", "creep_forces"])
@pytest.mark.parametrize(
    "name", ["layer-fall-memory", pytest.param("heat-layer", marks=pytest.mark.slow)]
)
def test_fmu_of_several_wheels(
    models: dict[str, cl.Model], tmp_path: Path, name: str, kind: str, version: int
) -> None:
    """Each wheel has another start value."""
    model = models[name]
    nominal = Description(model, kind)
    given = {k: Description(m, kind, **options) for k, m, options in variants(model, kind, 1)}
    wheels = {key: d for key, d in given.items() if not (d.implicit or refusal(nominal, d))}
    numbers = [v for v in nominal.variables if v.start is not None and not v.boolean]
    parameters = [v.name for v in numbers if v.causality == "parameter"]
    count = {"wheels": len(wheels), "per_wheel": parameters}
    single = exported(model, tmp_path, kind, version)
    with Instance(exported(model, tmp_path, kind, version, **count)) as tool:
        together = Wheels(tool.initialize(), len(wheels))
        for variable in numbers:  # the start of omega follows the radius, which is set before
            together.set(
                **{variable.name: [d.start_values[variable.name] for d in wheels.values()]}
            )
        tool.fmu.exitInitializationMode()
        for k in range(3):
            tool.step(1e-3 * k, 1e-3)
        for i, (key, description) in enumerate(wheels.items()):
            found = {output: together.get(output)[i] for output in together.outputs}
            (single / "resources" / "start_values.bin").write_bytes(_start_values_file(description))
            with Instance(single) as alone:
                alone.start()
                for k in range(3):
                    alone.step(1e-3 * k, 1e-3)
                compare(key, found, dict(zip(found, alone.get(*found), strict=True)))


@pytest.mark.tools
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in COMPILED else pytest.mark.slow) for name in CASES],
)
def test_kernel_file(models: dict[str, cl.Model], tmp_path: Path, name: str) -> None:
    """The same of the one-file kernel, in which memory can be switched off."""
    kind, seed = "force_element", list(CASES).index(name)
    nominal = Description(models[name], kind, implicit=True)
    outputs = [v.name for v in nominal.of_role("output", "state")]
    folder = cl.export_kernel(models[name], tmp_path)
    library = Library(folder, *compiler("gcc"), "-O0", "-ffp-contract=off")
    for key, other, options in variants(models[name], kind, seed):
        expected = Description(other, kind, **{"implicit": key == "starts", **options})
        if key == "memory":
            continue
        library.start()
        library.set(**changed(nominal, expected))
        if refusal(nominal, expected):
            assert re.search("exported contact|at most one", library.step(1e-3)), key
            continue
        model = kernel.NativeModel(kind, expected.native_contact, expected.start_values)
        for _ in range(3):
            assert library.step(1e-3) == "", key
            model.advance(1e-3)
        found = dict(zip(outputs, library.get(*outputs), strict=True))
        compare(key, found, dict(zip(outputs, model.get(*outputs), strict=True)))


# ---- inputs --------------------------------------------------------------------------------------

LOADS_AND_FRICTIONS = ((0.1, 1.0), (1.3, 1.0), (1.0, 0.4), (1.0, 1.6), (0.6, 0.5))


def at_input(model: cl.Model, load: float, friction: float, slope: float = 1.0) -> cl.Model:
    """The model declared for factors on load, both friction coefficients and initial slope."""
    contact, of = model.wheelset.element.contact, model.wheelset.element.friction
    if isinstance(contact, cl.LineContact):
        per_length = load * contact.normal_load_per_length
        model = of_part(model, "contact", replace(contact, normal_load_per_length=per_length))
    else:
        nominal = load * contact.wheel_load
        model = of_part(model, "contact", replace(contact, wheel_load=nominal))
    model = of_friction(model, static=friction * of.static, kinetic=friction * of.kinetic)
    return of_part(model, "wheelset", model.wheelset.with_slope(slope))


@pytest.mark.parametrize(("load", "friction"), LOADS_AND_FRICTIONS)
@pytest.mark.parametrize("name", CASES)
def test_inputs(models: dict[str, cl.Model], name: str, load: float, friction: float) -> None:
    """Load and friction scale act as the nominal load and friction, in all outputs and rates."""
    nominal = models[name].wheelset.element
    declared_so = at_input(models[name], load, friction).wheelset.element
    rng, weight = np.random.default_rng(54), declared_so.axle_load
    given = np.zeros(60, kernel.struct_dtype("force_element_input"))
    given["speed"] = speed = rng.choice([0.0, 0.02, 1.0, 20.0], given.size)
    reference = np.maximum(speed, nominal.minimum_speed)
    creepage = 10.0 ** rng.uniform(-5.0, -0.5, given.size) * rng.choice([-1.0, 1.0], given.size)
    given["omega"] = (speed + creepage * reference) / nominal.radius
    given["lateral_velocity"][::2] = 0.2 * (creepage * reference)[::2]
    if Description(models[name], "force_element").spins:
        given["spin_velocity"][::3] = 0.1 * reference[::3]
    for key, part in STATES.items():
        given[key] = part * (1.0 if key == "unslipped" else friction * weight)
    given["normal_load"], given["friction_scale"] = weight, friction
    present = nominal.rolling_native.evaluate(given)
    given["friction_scale"] = 1.0
    expected = declared_so.rolling_native.evaluate(given)
    names = expected.dtype.names or ()
    compare("", {n: present[n] for n in names}, {n: expected[n] for n in names}, 1e-11)


@pytest.mark.parametrize(
    ("load", "friction", "slope"),
    [(0.1, 1.0, 1.0), (1.3, 1.0, 1.0), (1.0, 0.4, 1.0), (1.0, 1.0, 0.6), (0.6, 1.5, 0.7)],
)
@pytest.mark.parametrize("name", CASES)
def test_inputs_of_a_drivetrain(
    models: dict[str, cl.Model], name: str, load: float, friction: float, slope: float
) -> None:
    """The same of loads, friction and slope of both wheels, at one point and after steps."""
    declared_so = at_input(models[name], load, friction, slope).wheelset
    radius, weight = declared_so.radius, declared_so.element.axle_load
    parts: dict[str, Any] = {
        "axle": Axle(stiffness=6e6, damping=100.0, drive_share=0.6),
        "motor": Motor(lag=0.02),
        "brake": Brake(fill_time=0.1, vent_time=0.2),
    }
    rows = []
    for wheelset, scales in (
        (models[name].wheelset, (friction, friction, slope)),
        (declared_so, (1.0, 1.0, 1.0)),
    ):
        inputs, states = (
            np.zeros(1, drivetrain_dtype("input")),
            np.zeros(1, drivetrain_dtype("state")),
        )
        inputs["load_left"], inputs["load_right"] = 0.4 * weight, 0.6 * weight
        inputs["commanded_torque"], inputs["commanded_brake"] = 4e3, 200.0
        inputs["friction_left"], inputs["friction_right"], inputs["slope"] = scales
        states["speed"], states["twist"], states["drive_torque"] = 5.0, 1e-4, 3e3
        for side, creepage in (("left", 0.004), ("right", 0.003)):
            states[f"omega_{side}"] = (1.0 + creepage) * 5.0 / radius
            states[f"held_force_{side}"] = 0.06 * friction * weight
            states[f"unslipped_{side}"] = 0.7
            states[f"outer_force_{side}"] = 0.01 * friction * weight
        fleet = Drivetrain(wheelset, **parts).native
        begin = fleet.evaluate(inputs, states)
        for k in range(5):
            fleet.advance(inputs, states, 1e-3 * k, 1e-3, 1e-11, np.zeros(1))
        end = fleet.evaluate(inputs, states)
        speed = np.array([5.0])
        limits = {
            "grip": fleet.grip(inputs, speed, speed)[0],
            "peak": fleet.peak(inputs, speed, np.arange(len(speed))),
        }
        rows.append((begin, end, states, limits))
    for key, rounding, found, expected in zip(
        ("begin", "end", "state", "limit"), (1e-12, 1e-7, 1e-7, 1e-9), *rows, strict=True
    ):
        names = expected if isinstance(expected, dict) else expected.dtype.names or ()
        compare(key, {n: found[n] for n in names}, {n: expected[n] for n in names}, rounding)
