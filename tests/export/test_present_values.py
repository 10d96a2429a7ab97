"""A value that is set now gives what a model that was declared with it gives.

`variants` changes each number that a model's parts declare, by a random factor: the FMU of the
model is set to the values that follow and compared with the FMU of the changed model.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_fmu import exported
from fmu_instance import Instance

import contactlib as cl
from contactlib.base.quantities import declared
from contactlib.export.description import Description
from contactlib.export.package import _start_values_file

LAYER = {"layer_compliance": 1e-13}  # a ratio of 0.86 in the ellipse [m/Pa]
FALL = {"slip_rate_residual": 0.8, "slip_rate_decay": 0.5}
HEAT = {"softening_temperature": 600.0}
# Of each case the model, what is replaced in its element, and in the element's friction.
CASES: dict[str, tuple[str, dict[str, Any], dict[str, float]]] = {
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
KINDS = ("force_element", "wheelset", "wheelset_body", "creep_forces")
HELD = ("elliptic", "memory", "softening", "poisson_ratio")  # those of the exported contact
STATES = {  # over the load, but for the part that has not slipped
    "held_force": 0.11,
    "unslipped": 0.8,
    "outer_force": 0.02,
    "held_lateral": 0.02,
    "outer_lateral": 0.01,
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
            element = replace(element, contact=replace(element.contact, theory="strips"))
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


def of_friction(model: cl.Model, **given: float) -> cl.Model:
    return of_part(model, "friction", replace(model.wheelset.element.friction, **given))


def random_value(name: str, value: Any, rng: np.random.Generator) -> Any:
    """Another value of a declared number, where zero and None mean something absent."""
    absent = {"grade": 0.01, "load_exponent": 0.3, "mass": 2e4, "slip_rate_decay": 0.2}
    absent |= {
        "weakening_length": 1e-6,
        "constant": 100.0,
        "linear": 5.0,
        "quadratic": 1.0,
        "damping": 20.0,
    }
    if not value:
        return absent.get(name, value)
    within = {"wheels": (1.6, 2.4), "slip_rate_residual": (0.6, 0.9)}
    return round(
        value * rng.uniform(*within.get(name, (0.75, 1.25))), 0 if name == "wheels" else 99
    )


def variants(model: cl.Model, kind: str, seed: int) -> Iterator[Variant]:
    rng = np.random.default_rng(seed)
    element = model.wheelset.element
    both = rng.uniform(0.7, 1.3)
    of_both = {name: both * getattr(element.friction, name) for name in ("static", "kinetic")}
    yield "friction.both", of_friction(model, **of_both), {}
    for part, value in parts_of(model).items():
        for name, parameter in declared(type(value)).items():
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


def run(tool: Instance, description: Description, later: dict[str, float], seed: int) -> Any:
    """Outputs, rates and indicators after the start and at random inputs; and which are rates."""
    rng, load = np.random.default_rng(seed), description.element.normal_load
    variables = tool.description.modelVariables
    made = [v for v in variables if v.causality == "output" or v.causality == "local"]
    names, given = [v.name for v in made], {v.name for v in variables if v.causality == "input"}
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
    return np.array(rows), np.array([bool(v.derivative) for v in made]), names


def compare(found: Any, expected: Any, of_rate: Any, names: list[str]) -> None:
    size = np.abs(expected).max(axis=0)
    error = np.abs(found - expected).max(axis=0) / np.where(size > 0.0, size, 1.0)
    bound = np.where(of_rate, 1e-10, 1e-12)  # rates of a stiff contact magnify the rounding
    assert (error < bound).all(), {
        n: e for n, e, b in zip(names, error, bound, strict=True) if e >= b
    }


@cache
def way(name: str, kind: str) -> tuple[bool, int]:
    """The interface and version of FMI that the quick run takes: all four alternate."""
    at = list(CASES).index(name) + KINDS.index(kind)
    return bool(at % 2), 2 + at // 2 % 2


FMUS = [
    pytest.param(name, kind, *other, marks=[] if other == way(name, kind) else pytest.mark.slow)
    for name in CASES
    for kind in kinds_of(name)
    for other in ((exchange, version) for exchange in (False, True) for version in (2, 3))
]


@pytest.mark.parametrize(("name", "kind", "exchange", "version"), FMUS)
def test_fmu(
    models: dict[str, cl.Model], tmp_path: Path, name: str, kind: str, exchange: bool, version: int
) -> None:
    """Tunable values are set while it steps, others before."""
    model = models[name]
    options: dict[str, Any] = {"kind": kind, "version": version}
    folder = exported(model, tmp_path, options.pop("kind"), version)
    nominal = Description(model, kind)
    file, seed = folder / "resources" / "start_values.bin", list(CASES).index(name)
    original, seen = file.read_bytes(), set()
    tunable = {v.name for v in nominal.of_role("tunable_parameter")} if not exchange else set()
    for key, other, given in variants(model, kind, seed):
        declared_so = Description(other, kind, **given)
        values = changed(nominal, declared_so)
        if not values:
            continue
        seen |= values.keys()
        file.write_bytes(original)
        with Instance(folder, exchange=exchange) as tool:
            tool.initialize()
            later = {n: v for n, v in values.items() if n in tunable}
            for n, v in values.items():
                if n in tool.booleans:
                    tool.fmu.setBoolean([tool.references[n]], [bool(v)])
                elif n not in later:
                    tool.set(**{n: v})
            if reason := refusal(nominal, declared_so):
                tool.set(**later)
                with tool.refused(reason, "export the model"):
                    tool.fmu.exitInitializationMode()
                continue
            tool.fmu.exitInitializationMode()
            found, of_rate, names = run(tool, declared_so, later, seed)
        file.write_bytes(_start_values_file(declared_so))
        with Instance(folder, exchange=exchange) as tool:
            tool.start()
            expected, *_ = run(tool, declared_so, {}, seed)
        try:
            compare(found, expected, of_rate, names)
        except AssertionError as e:
            raise AssertionError(f"{key}: {e}") from e
    assert seen == {v.name for v in nominal.variables if v.start is not None}
