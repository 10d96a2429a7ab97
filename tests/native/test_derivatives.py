"""Directional derivatives of the models, and the dependencies that an FMU declares."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Literal

import numpy as np
import pytest
from native_models import difference_quotient, native, with_memory

import contactlib as cl
from contactlib import kernel
from contactlib.export.description import Description
from contactlib.vehicle import Resistance


@pytest.fixture(scope="module")
def models(
    rig: cl.Model,
    cohesive_table: cl.CreepForceTable,
    layered_cohesive_table: cl.CreepForceTable,
) -> dict[str, cl.Model]:
    """A model for each kind of table."""
    wheelset = rig.wheelset
    polach = cl.Polach.dry()
    elliptic = cl.EllipticContact.from_semi_axes(
        semi_axis_x=5e-3, semi_axis_y=9e-3, wheel_load=90e3, contact_modulus=115e9
    )
    friction = cl.friction_with_k_hat(elliptic, k_hat=0.3, static=0.45, kinetic=0.21)
    elements = {
        "line": wheelset.element,
        "cohesive": _element(wheelset.element, cohesive_table),
        "polach": _element(wheelset.element, cl.CreepForceTable.from_law(polach)),
        "elliptic": cl.ForceElement(
            elliptic, friction, table=cl.carter_griffith_table("elliptic"), radius=0.5
        ),
    }
    for name in ("line", "elliptic", "polach"):
        cold = elements[name]
        friction = replace(cold.friction, softening_temperature=300.0)
        elements[f"softening {name}"] = replace(cold, friction=friction)
    for name in ("line", "softening elliptic"):
        kind: Literal["line", "elliptic"] = "line" if name == "line" else "elliptic"
        table = cl.carter_griffith_table(kind)
        soft = replace(elements[name], layer_compliance=1e-13, table=table)
        elements[f"layer {name}"] = soft
    cohesive = replace(elements["cohesive"], table=layered_cohesive_table)
    elements["layer cohesive"] = replace(cohesive, layer_compliance=1e-13)
    return {name: _model(rig, element) for name, element in elements.items()}


def _element(element: cl.ForceElement, table: cl.CreepForceTable) -> cl.ForceElement:
    return cl.ForceElement(
        element.contact,
        element.friction,
        table=table,
        radius=element.radius,
        slope_reduction=element.slope_reduction,
    )


def _model(rig: cl.Model, element: cl.ForceElement) -> cl.Model:
    wheelset = cl.Wheelset(
        element,
        inertia=250.0,
        mass=2e4,
        damping=50.0,
        resistance=Resistance(constant=1800.0, linear=66.0, quadratic=3.1, grade=0.01),
    )
    return cl.Model(name=rig.name, source=rig.source, wheelset=wheelset)


def random_points(description: Description, count: int, seed: int) -> Iterator[dict[str, float]]:
    """Start values all over both branches, in traction and braking, at speeds from zero on.

    One in nine has a load below zero, and half of them slip across rolling and spin.
    """
    rng = np.random.default_rng(seed)
    element = description.model.wheelset.element
    ratio = element.friction.ratio

    def sign() -> float:
        return float(rng.choice([-1.0, 1.0]))

    for i in range(count):
        speed = 0.0 if i % 8 == 0 else sign() * 10 ** rng.uniform(-2.0, 1.7)
        at_rest = 0.5 * element.minimum_speed
        width, load = element.contact.semi_width, element.contact.wheel_load
        across = (i % 2) * element.saturation_creepage * max(abs(speed), at_rest)
        creepage = element.saturation_creepage * sign() * 10 ** rng.uniform(-1.5, 1.0)
        point = {
            "omega": (speed + max(abs(speed), at_rest) * creepage) / element.radius,
            "speed": speed,
            "normal_load": element.contact.wheel_load * (rng.uniform(0.3, 2.0) if i % 9 else -0.5),
            "friction_scale": rng.uniform(0.5, 1.2),
            "lateral_velocity": across * sign() * 10 ** rng.uniform(-1.5, 0.5),
            "spin_velocity": across * sign() * 10 ** rng.uniform(-1.5, 0.5) / width,
            "semi_axis_x": width * rng.uniform(0.5, 2.0),
            "semi_axis_y": width * rng.uniform(0.5, 2.0),
            "creepage_x": creepage,
            "creepage_y": element.saturation_creepage * rng.normal(),
            "spin": element.saturation_creepage * rng.normal() / width,
            "slip_rate_residual": rng.uniform(0.3, 0.9),
            "slip_rate_decay": rng.uniform(0.1, 0.8),
            "held_lateral": 0.1 * load * sign(),
            "outer_lateral": 0.03 * load * sign(),
            "held_force": 0.4 * load * sign() * 10 ** rng.uniform(-1.5, 0.1),
            "outer_force": 0.07 * load * sign(),
            "drive_torque": rng.uniform(-3e4, 3e4),
            "brake_torque": (i % 3) * 5e3,
            "pads": (-0.8, 0.3, 0.9, -0.2)[i % 4],
            "resistance_force": rng.uniform(-1e3, 1e3),
            "weakening_length": element.friction.weakening_length * rng.uniform(0.5, 1.5),
            "creep_force": rng.uniform(-4e4, 4e4),
            "static_friction": 0.4 * ratio,
            "kinetic_friction": 0.4,
            "unslipped": rng.uniform(0.0, 1.0),
        }
        known = description.start_values
        yield {name: value for name, value in point.items() if name in known}


def room_of(model: kernel.NativeModel, name: str) -> float:
    """How far a variable can be changed before something passes zero."""
    size = abs(model.get(name)[0])
    if name not in ("omega", "speed", "radius"):
        return size or 1.0
    omega, speed, radius = model.get("omega", "speed", "radius")
    slip = abs(radius * omega - speed)
    rooms = {"omega": slip / radius, "speed": slip, "radius": slip / abs(omega or 1.0)}
    return float(min(max(size, 0.02), rooms[name]))


# Whose derivatives by each other are exact; all others are central differences.
BY_HAND = {
    *(
        "omega",
        "speed",
        "held_force",
        "unslipped",
        "outer_force",
        "held_lateral",
        "outer_lateral",
        "lateral_velocity",
        "spin_velocity",
        "friction_scale",
    ),
    *("normal_load", "drive_torque", "brake_torque", "pads", "resistance_force"),
    *("creepage_x", "creepage_y", "spin"),
    *("creep_force", "wheel_torque", "lateral_force", "spin_moment", "traction_coefficient"),
    *("creepage", "force_x", "force_y", "utilisation"),
}
LAWS = [
    "line",
    "elliptic",
    "cohesive",
    "polach",
    "softening line",
    "softening elliptic",
    "softening polach",
    "layer line",
    "layer softening elliptic",
    "layer cohesive",
]


@pytest.mark.parametrize(
    ("kind", "memory", "law"),
    [
        ("wheelset_body", False, "line"),
        ("creep_forces", False, "elliptic"),
        *product(["force_element"], [False, True], LAWS),
        *product(["wheelset"], [False, True], ["line", "softening elliptic", "layer cohesive"]),
    ],
)
def test_tangent_is_the_derivative(
    models: dict[str, cl.Model], kind: str, memory: bool, law: str
) -> None:
    description = Description(with_memory(models[law], memory), kind)
    unknowns = [
        v.name for v in description.of_role("output", "derivative", "indicator") if not v.boolean
    ]
    knowns = [v for v in description.of_role(*kernel.GIVEN) if not v.boolean]
    by_hand = np.array([n.startswith("der(") or n in BY_HAND for n in unknowns])
    branches, compared, unclear = set(), 0, 0
    for point in random_points(description, 16, seed=3):
        model = native(description, **point)
        if description.has_contact:
            branches.add(model.get("falling_branch")[0])
        values = np.abs(model.get(*unknowns))
        for known in knowns:
            scale = room_of(model, known.name)
            difference, doubt = difference_quotient(model, unknowns, known.name, 2e-3 * scale)
            exact = np.array(model.tangent(unknowns, {known.name: 1.0}))
            within = np.where(by_hand & (known.name in BY_HAND), 1e-7, 1e-6)
            allowed = within * np.maximum(np.abs(exact), values / scale) + 1e-12
            clear = doubt < 0.3 * allowed  # else a kink or rounding is in the way
            compared += int(clear.sum())
            unclear += int((~clear).sum())
            wrong = clear & (np.abs(difference - exact) > allowed)
            assert not wrong.any(), (known.name, np.array(unknowns)[wrong], point)
    assert unclear < 0.05 * compared
    if description.has_contact and law != "polach":
        assert branches == {0.0, 1.0}


@pytest.mark.parametrize("law", ["line", "softening polach"])
@pytest.mark.parametrize("memory", [False, True])
@pytest.mark.parametrize("kind", ["force_element", "wheelset", "wheelset_body"])
def test_outputs_depend_on_no_input_but_those_declared(
    models: dict[str, cl.Model], kind: str, memory: bool, law: str
) -> None:
    memory = memory and kind != "wheelset_body"
    description = Description(with_memory(models[law], memory), kind)
    knowns = [v.name for v in description.of_role("input", "state")]
    outputs = description.unknowns(description.of_role("output", "state"))
    names = [u.variable.name for u in outputs if not u.variable.boolean]
    dependencies: dict[str, set[str]] = {name: set() for name in names}
    for point in random_points(description, 60, seed=8):
        model = native(description, **point)
        for known in knowns:
            changes = model.tangent(names, {known: 1.0})
            for name, change in zip(names, changes, strict=True):
                if change != 0.0 or name == known:
                    dependencies[name].add(known)
    held = {"creep_force"} if memory else set()  # without friction it is zero at once
    # A controller may make the torque from any of them, without an algebraic loop.
    loops = {"drive_torque", "brake_torque", "resistance_force"} & set(knowns)
    for output in outputs:
        declared = set(output.dependencies)
        assert not loops & declared, output.variable.name
        assert declared >= dependencies.get(output.variable.name, set()), output.variable.name
        if output.variable.name in {"creepage", "omega", "speed", "creep_force"} - held:
            assert declared == dependencies[output.variable.name]
        if memory and output.variable.name in ("creep_force", "wheel_torque", "lateral_force"):
            assert not {"omega", "speed", "lateral_velocity"} & declared


@pytest.mark.parametrize("kind", ["force_element", "wheelset"])
@pytest.mark.parametrize("name", ["normal_load", "friction_scale"])
def test_derivatives_where_grip_begins_are_those_of_a_patch_that_slides(
    models: dict[str, cl.Model], kind: str, name: str
) -> None:
    description = Description(models["line"], kind)
    unknowns = ["creep_force", *[v.name for v in description.of_role("derivative")]]
    for omega in (19.0, 20.5):
        model = native(description, omega=omega, **{name: 0.0})
        assert model.get("creep_force") == [0.0]
        exact = np.array(model.tangent(unknowns, {name: 1.0}))
        start = np.array(model.get(*unknowns))
        step = {"normal_load": 1e-3, "friction_scale": 2e-6}[name]  # the contact is tiny then
        model.set(**{name: step})
        model.evaluate()
        difference = (np.array(model.get(*unknowns)) - start) / step
        np.testing.assert_allclose(exact, difference, rtol=1e-4)
        assert abs(exact[0]) > 0.0
