"""Good calls of the contact: laws, tables, friction, geometry, the force element, data and fits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any

import numpy as np
from hostile import Call

import contactlib as cl
from contactlib.contact.laws.polach import Polach

X = np.array([-2.0, -0.4, 0.0, 0.3, 1.0, 1.6])  # normalized creepages
XI = np.array([-1.0, -0.9, -0.3, 0.0, 0.6, 1.0])  # places in the contact
ZETA = np.linspace(0.001, 0.06, 12)  # creepages
MU = 0.3 * np.tanh(ZETA / 0.01)  # traction coefficients
SPEEDS = np.array([-20.0, 0.0, 0.05, 1.0, 10.0, 30.0])
LOADS = np.array([0.0, 1.0, 1e4, 1e5, 2e5, 3e5])
SCALES = np.array([0.1, 0.3, 0.5, 0.8, 1.0, 1.5])
SLIPS = np.array([0.0, 1e-7, 1e-6, 3e-6, 1e-5, 1e-3])
LOADED: dict[str, Any] = {"speed": SPEEDS, "normal_load": LOADS, "friction_scale": SCALES}

STEEL: dict[str, Any] = {"youngs_modulus": 210e9, "poisson_ratio": 0.3}
LINE: dict[str, Any] = {
    "normal_load_per_length": 1e6,
    "radius": 0.5,
    "contact_modulus": 115.4e9,
    "length": 0.02,
}
SEMI_WIDTH: dict[str, Any] = {
    "semi_width": 5e-3,
    "radius": 0.5,
    "contact_modulus": 115.4e9,
    "normal_load": 220e3,
}
ELLIPSE: dict[str, Any] = {
    "normal_load": 1e5,
    "radius_x": 0.5,
    "radius_y": 0.3,
    "contact_modulus": 115.4e9,
}
SEMI_AXES: dict[str, Any] = {
    "semi_axis_x": 6e-3,
    "semi_axis_y": 9e-3,
    "normal_load": 1e5,
    "contact_modulus": 115.4e9,
}
FRICTION: dict[str, Any] = {
    "static": 0.45,
    "kinetic": 0.21,
    "weakening_length": 1e-6,
    "slip_rate_residual": 0.6,
    "slip_rate_decay": 0.1,
}
POLACH: dict[str, Any] = {"adhesion_reduction": 1.0, "slip_reduction": 0.4}
IN_THE_PLANE: dict[str, Any] = {
    "semi_axis_x": np.linspace(4e-3, 8e-3, 6),
    "semi_axis_y": np.linspace(8e-3, 4e-3, 6),
    "normal_load": np.linspace(1e4, 1e5, 6),
    "creepage_x": np.linspace(-3e-3, 3e-3, 6),
    "creepage_y": np.linspace(2e-3, -1e-3, 6),
    "spin": np.linspace(-0.5, 1.0, 6),
    "friction_scale": np.linspace(0.5, 1.5, 6),
}
FALLING: dict[str, Any] = {"slip_rate_residual": 0.6, "slip_rate_decay": 0.1}


@cache
def line() -> cl.LineContact:
    return cl.LineContact.from_semi_width(**SEMI_WIDTH)


@cache
def ellipse() -> cl.EllipticContact:
    return cl.EllipticContact(**ELLIPSE)


def creep_forces(shear_modulus: float = 82e9, poisson_ratio: float = 0.28) -> cl.CreepForces:
    friction = cl.Friction(static=0.45, kinetic=0.21, weakening_length=1e-6)
    return cl.CreepForces(friction, shear_modulus=shear_modulus, poisson_ratio=poisson_ratio)


@cache
def element(shape: str = "line") -> cl.ForceElement:
    contact: Any = line() if shape == "line" else ellipse()
    table = cl.carter_griffith_table("line" if shape == "line" else "elliptic")
    return cl.ForceElement(contact, cl.Friction(**FRICTION), table=table, radius=0.5)


@cache
def measured() -> cl.MeasuredCurve:
    return cl.MeasuredCurve(ZETA, MU)


@cache
def measured_table() -> cl.CreepForceTable:
    return cl.CreepForceTable.from_law(measured())


@cache
def fitted() -> cl.FitResult:
    return cl.fit(cl.CarterGriffith, cl.TractionData(ZETA, MU), k_hat=0.0)


def fit_with(low: float, high: float, level: float, **fixed: Any) -> cl.FitResult:
    ranges = {"kinetic": (low, high)}
    data = cl.TractionData(ZETA, MU, 10.0)
    return cl.fit(cl.CarterGriffith, data, level=level, ranges=ranges, **fixed)


@cache
def heat(shape: str = "line") -> cl.ContactHeat:
    return cl.ContactHeat(contact=line() if shape == "line" else ellipse())


@cache
def hot(shape: str = "line") -> cl.HotContact:
    friction = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    softening = cl.Softening([0.0, 200.0, 700.0], [1.0, 0.9, 0.2])
    return cl.HotContact(heat=heat(shape), friction=friction, softening=softening)


def of_heat() -> Iterator[Call]:
    """Calls of what slip warms."""
    rows = {"creepage": 0.1 * X, "speed": SPEEDS[:-1].max() * SCALES}
    for what in (
        "peclet_number",
        "wheel_share",
        "entry_temperature",
        "mean_rise",
        "rise_per_creepage",
    ):
        yield from over(f"ContactHeat.{what}", method(heat, what), rows)
    for what in ("traction_coefficient", "mean_temperature", "local_traction_coefficient"):
        yield from over(f"HotContact.{what}", method(hot, what), rows)
    yield from over(
        "HotContact.traction_coefficient elliptic",
        method(lambda: hot("elliptic"), "traction_coefficient"),
        rows,
    )


def scales(contact: Any, slope_reduction: float = 1.0, **friction: Any) -> tuple[float, ...]:
    made = cl.Friction(**friction)
    return (
        cl.k_hat(contact, made),
        cl.process_zone_ratio(contact, made),
        cl.saturation_creepage(contact, made, slope_reduction=slope_reduction),
    )


def with_properties(kind: Callable[..., Any], *names: str) -> Callable[..., Any]:
    """Constructor whose answer is what these properties of the object are."""

    def made(**arguments: Any) -> tuple[Any, ...]:
        thing = kind(**arguments)
        return (thing, *(getattr(thing, name) for name in names))

    return made


def composite_modulus(**material: float) -> float:
    return cl.Material(**material).contact_modulus_with(cl.Material(**STEEL))


def using(
    function: Callable[[], Callable[..., Any]], **arguments: Any
) -> Callable[[], tuple[Callable[..., Any], dict[str, Any]]]:
    """What `Call.make` is, of a function that is made at its use."""
    return lambda: (function(), arguments)


def method(make: Callable[[], Any], name: str) -> Callable[[], Callable[..., Any]]:
    """Method of an object that is made at its use."""
    return lambda: getattr(make(), name)


def over(
    name: str,
    function: Callable[[], Callable[..., Any]],
    rows: dict[str, Any],
    **options: Any,
) -> Iterator[Call]:
    """Calls with one argument a row and the others the fifth number of theirs, for each."""
    point = {key: float(row[4]) for key, row in rows.items()}
    for argument, row in rows.items():
        yield Call(
            name=f"{name} over {argument}",
            make=using(function, **point | {argument: row}),
            arrays=(argument,),
            **options,
        )


def of_law(name: str, make: Callable[[], Any], **options: Any) -> Iterator[Call]:
    """Calls of a law's values and, if it has them, of its fields in the contact."""
    kind, _, kept = name.partition(" ")
    values: dict[str, Any] = {"normalized_creepage": X}
    strips = values | {"lateral_position": 0.9 * XI}
    places = {"position": XI} | strips
    for names, rows, more in (
        (("traction_ratio", "slope", "evaluate"), values, {}),
        (("stick_boundary",), strips, {}),
        # infinite at the stick boundary, or where friction has weakened
        (("shear_traction", "slip_rate", "slip"), places, {"infinite": True}),
    ):
        for what in names:
            if hasattr(make(), what):
                yield from over(
                    f"{kind}.{what} {kept}".strip(), method(make, what), rows, **more, **options
                )


def of_class(
    name: str,
    kind: Callable[..., Any],
    good: dict[str, Any],
    *properties: str,
    **options: Any,
) -> Call:
    """A call of a constructor with numbers only, and of properties of what it makes."""
    return Call(
        name=name,
        make=lambda: (with_properties(kind, *properties), dict(good)),
        numbers=tuple(good),
        **options,
    )


def of_table(shape: Any) -> Iterator[Call]:
    """Calls of a table's values."""
    rows = {"normalized_creepage": X, "k_hat": np.abs(X)}
    for what in ("traction_ratio", "slope", "evaluate"):
        make = method(lambda: cl.carter_griffith_table(shape), what)
        yield from over(f"CreepForceTable.{what} {shape}", make, rows)


def of_element(shape: str) -> Iterator[Call]:
    """Calls of the force element's values."""
    rows = {"omega": 2.02 * SPEEDS} | LOADED
    plane = {"lateral_velocity": 2e-3 * SPEEDS, "spin_velocity": -0.3 * SPEEDS}
    for what in ("force", "evaluate"):
        rows |= plane if what == "evaluate" and shape == "elliptic" else {}
        make = method(lambda: element(shape), what)
        yield from over(f"ForceElement.{what} {shape}", make, rows, optional=("normal_load",))


CONTACT = ("normal_load", "semi_width", "peak_pressure")
AXES = ("semi_axis_x", "semi_axis_y", "peak_pressure")

CALLS: list[Call] = [
    # ---- laws ----
    of_class("CarterGriffith", cl.CarterGriffith, {"k_hat": 0.3}, "peak"),
    of_class(
        "CarterGriffith elliptic",
        partial(cl.CarterGriffith, contact="elliptic"),
        {"k_hat": 0.3},
        "peak",
    ),
    *of_law("CarterGriffith", lambda: cl.CarterGriffith(k_hat=0.3)),
    *of_law("CarterGriffith Coulomb", lambda: cl.CarterGriffith(k_hat=0.0)),
    *of_law("CarterGriffith smallest", lambda: cl.CarterGriffith(k_hat=5e-324)),
    *of_law("CarterGriffith elliptic", lambda: cl.CarterGriffith(k_hat=0.3, contact="elliptic")),
    of_class(
        "CohesiveZone",
        cl.CohesiveZone,
        {"k_hat": 0.3, "static_to_kinetic": 1.6},
        "sliding_creepage",
        slow=True,
        infinite=True,
    ),
    *of_law("CohesiveZone", lambda: cl.CohesiveZone(k_hat=0.3, static_to_kinetic=1.6), slow=True),
    *of_law(
        "CohesiveZone elliptic",
        lambda: cl.CohesiveZone(k_hat=0.3, static_to_kinetic=1.6, contact="elliptic"),
        slow=True,
        long=True,
    ),
    of_class("Polach", cl.Polach, POLACH, "peak", infinite=True),
    of_class(
        "Polach rising",
        cl.Polach,
        POLACH | {"adhesion_reduction": 0.2, "slip_reduction": 0.9},
        "peak",
        infinite=True,
    ),
    of_class("Polach.dry", cl.Polach.dry, {}, "peak", infinite=True),
    of_class("Polach.wet", cl.Polach.wet, {}, "peak", infinite=True),
    *of_law("Polach", lambda: cl.Polach(**POLACH)),
    *of_law("Polach soft", lambda: cl.Polach(**POLACH | {"slip_reduction": 5e-324})),
    Call(
        name="MeasuredCurve",
        make=lambda: (
            with_properties(cl.MeasuredCurve, "peak"),
            {
                "creepage": ZETA,
                "traction_coefficient": MU,
                "kinetic": 0.3,
                "saturation_creepage": 0.02,
                "cells": 8,
                "smoothing": 1e-7,
            },
        ),
        rows=("creepage", "traction_coefficient"),
        numbers=("kinetic", "saturation_creepage", "cells", "smoothing"),
        optional=("kinetic", "saturation_creepage"),
        infinite=True,
    ),
    *of_law("MeasuredCurve", measured),
    Call(
        name="MeasuredCurve.traction_coefficient",
        make=lambda: (measured().traction_coefficient, {"creepage": ZETA}),
        arrays=("creepage",),
    ),
    Call(
        name="ForceElement.from_curve",
        make=lambda: (
            cl.ForceElement.from_curve,
            {
                "curve": measured_table(),
                "contact": cl.LineContact(**LINE),
                "radius": 0.5,
                "minimum_speed": 0.1,
                "wheels": 2,
                "load_exponent": 0.3,
            },
        ),
        numbers=("radius", "minimum_speed", "wheels", "load_exponent"),
        optional=("load_exponent",),
    ),
    # ---- tables ----
    *of_table("line"),
    *of_table("elliptic"),
    Call(
        name="CreepForceTable",
        make=lambda: (cl.CreepForceTable, {"data": cl.carter_griffith_table("line").data}),
    ),
    Call(
        name="CreepForceTable.from_law",
        make=lambda: (cl.CreepForceTable.from_law, {"law": Polach(**POLACH), "target": 1e-3}),
        numbers=("target",),
        long=True,
    ),
    Call(
        name="carter_griffith_table", make=lambda: (cl.carter_griffith_table, {"contact": "line"})
    ),
    Call(
        name="cohesive_table",
        make=lambda: (cl.cohesive_table, {"contact": "line", "static_to_kinetic": 2.0}),
        numbers=("static_to_kinetic",),
        long=True,
    ),
    # ---- geometry and friction ----
    of_class("Material", cl.Material, STEEL),
    of_class("Material.contact_modulus_with", composite_modulus, STEEL),
    of_class("LineContact", cl.LineContact, LINE, *CONTACT),
    of_class("LineContact.from_semi_width", cl.LineContact.from_semi_width, SEMI_WIDTH, *CONTACT),
    of_class("EllipticContact", cl.EllipticContact, ELLIPSE, *AXES),
    of_class("EllipticContact.from_semi_axes", cl.EllipticContact.from_semi_axes, SEMI_AXES, *AXES),
    *over(
        "kalker_coefficients",
        lambda: cl.kalker_coefficients,
        {"a_over_b": np.geomspace(0.05, 20.0, 6), "poisson_ratio": np.linspace(0.0, 0.5, 6)},
    ),
    of_class("CreepForces", creep_forces, {"shear_modulus": 82e9, "poisson_ratio": 0.28}),
    *over("CreepForces.evaluate", lambda: creep_forces().evaluate, IN_THE_PLANE),
    of_class("Friction", cl.Friction, FRICTION, "ratio"),
    Call(
        name="Friction.coefficient",
        make=lambda: (cl.Friction(**FRICTION).coefficient, {"slip": SLIPS}),
        arrays=("slip",),
    ),
    Call(
        name="Friction.coefficient Coulomb",
        make=lambda: (
            cl.Friction(static=0.4, kinetic=0.3, weakening_length=0.0).coefficient,
            {"slip": SLIPS},
        ),
        arrays=("slip",),
    ),
    Call(
        name="Friction.coefficient short",
        make=lambda: (
            cl.Friction(static=0.4, kinetic=0.3, weakening_length=5e-324).coefficient,
            {"slip": SLIPS},
        ),
        arrays=("slip",),
    ),
    Call(
        name="Friction.slip_rate_factor",
        make=lambda: (cl.Friction(**FRICTION).slip_rate_factor, {"slip_speed": SPEEDS}),
        arrays=("slip_speed",),
    ),
    Call(
        name="Friction.from_samples",
        make=lambda: (
            cl.Friction.from_samples,
            {"slip": SLIPS, "coefficient": 0.4 - SCALES / 10.0, **FALLING},
        ),
        rows=("slip", "coefficient"),
        numbers=tuple(FALLING),
    ),
    Call(
        name="Friction.coefficient samples",
        make=lambda: (
            cl.Friction.from_samples(SLIPS, 0.4 - SCALES / 10.0).coefficient,
            {"slip": SLIPS},
        ),
        arrays=("slip",),
    ),
    Call(
        name="Friction.from_function",
        make=lambda: (
            partial(cl.Friction.from_function, lambda u: 0.2 + 0.2 / (1.0 + u / 1e-6) ** 3),
            {"kinetic": 0.2, **FALLING},
        ),
        numbers=("kinetic", *FALLING),
        optional=("kinetic",),
    ),
    Call(
        name="Friction.from_function value",
        make=lambda: (
            lambda level: cl.Friction.from_function(lambda u: level if u > 1e-6 else 0.4),
            {"level": 0.2},
        ),
        numbers=("level",),
        says={"level": "f|kinetic"},
    ),
    # ---- the force element ----
    of_class(
        "ForceElement",
        partial(
            cl.ForceElement, line(), cl.Friction(**FRICTION), table=cl.carter_griffith_table("line")
        ),
        {"radius": 0.5, "slope_reduction": 0.8, "minimum_speed": 0.1},
        "k_hat",
        "saturation_creepage",
    ),
    of_class("saturation_creepage", partial(scales, line()), {**FRICTION, "slope_reduction": 0.8}),
    of_class("k_hat", partial(scales, line()), FRICTION),
    of_class("process_zone_ratio", partial(scales, ellipse()), FRICTION),
    of_class(
        "friction_with_k_hat",
        partial(cl.friction_with_k_hat, line()),
        {"k_hat": 0.3, "static": 0.45, "kinetic": 0.21, **FALLING},
    ),
    of_class(
        "ForceElement.saturation_creepage_at",
        lambda **given: element().saturation_creepage_at(**given),
        {"normal_load": 1e5, "friction_scale": 0.5},
        optional=("normal_load",),
    ),
    *of_element("line"),
    *of_element("elliptic"),
    Call(
        name="ForceElement.at_creepage",
        make=lambda: (
            element().at_creepage,
            {"creepage": ZETA, "speed": 5.0, "normal_load": 1e5, "friction_scale": 0.9},
        ),
        arrays=("creepage",),
        numbers=("speed", "normal_load", "friction_scale"),
        optional=("normal_load",),
    ),
    *over(
        "available_force",
        lambda: partial(cl.available_force, element()),
        LOADED | {"other_friction_scale": SCALES[::-1].copy()},
        optional=("normal_load", "other_friction_scale"),
    ),
    # ---- heat ----
    of_class(
        "ThermalMaterial",
        cl.ThermalMaterial,
        {"conductivity": 50.0, "density": 7850.0, "heat_capacity": 460.0},
        "effusivity",
        "diffusivity",
    ),
    of_class(
        "ContactHeat",
        lambda **given: cl.ContactHeat(contact=line(), **given).entry_temperature(0.1, 10.0),
        {"wheel_temperature": 60.0, "rail_temperature": 20.0},
    ),
    Call(
        name="ContactHeat.temperature",
        make=lambda: (
            heat("elliptic").temperature,
            {
                "position": XI,
                "lateral_position": 0.9 * XI,
                "friction_coefficient": 0.3,
                "creepage": 0.05,
                "speed": 10.0,
            },
        ),
        arrays=("position", "lateral_position"),
        numbers=("friction_coefficient", "creepage", "speed"),
    ),
    Call(
        name="Softening",
        make=lambda: (
            cl.Softening,
            {"temperature": 1e8 * SLIPS, "coefficient": 0.4 - SCALES / 10.0},
        ),
        rows=("temperature", "coefficient"),
    ),
    *over(
        "Softening.fraction",
        method(lambda: cl.Softening.linear(800.0), "fraction"),
        {"temperature": 500.0 * X},
    ),
    *over(
        "Softening.slope",
        method(lambda: cl.Softening.linear(800.0), "slope"),
        {"temperature": 500.0 * X},
    ),
    of_class("Softening.linear", cl.Softening.linear, {"softening_temperature": 800.0}),
    *of_heat(),
    of_class(
        "HotContact",
        partial(
            cl.HotContact,
            heat=heat(),
            friction=cl.Friction(static=0.45, kinetic=0.21, weakening_length=1e-6),
            softening=cl.Softening.linear(800.0),
        ),
        {"slope_reduction": 0.8},
        "k_hat",
        "saturation_creepage",
    ),
    of_class(
        "HotContact.strip",
        lambda **given: hot("elliptic").strip(**given),
        {"creepage": 0.01, "speed": 10.0, "lateral_position": 0.3},
    ),
    # ---- data, fits, profiles, track ----
    Call(
        name="TractionData",
        make=lambda: (
            cl.TractionData,
            {"creepage": ZETA, "traction_coefficient": MU, "speed": 1.0 + ZETA},
        ),
        rows=("creepage", "traction_coefficient", "speed"),
        optional=("speed",),
    ),
    Call(
        name="fit",
        make=lambda: (
            fit_with,
            {"low": 0.1, "high": 1.0, "level": 0.95, "k_hat": 0.0, "saturation_creepage": 0.02},
        ),
        numbers=("low", "high", "level", "k_hat", "saturation_creepage"),
        says={"low": "kinetic", "high": "kinetic"},
        nan=True,  # a standard error that the data do not define
        slow=True,
    ),
    Call(
        name="FitResult.traction_coefficient",
        make=lambda: (fitted().traction_coefficient, {"creepage": ZETA}),
        rows=("creepage",),
    ),
    Call(
        name="Profile", make=lambda: (cl.Profile, {"at": ZETA, "value": MU}), rows=("at", "value")
    ),
    of_class("Profile.of", cl.Profile.of, {"value": 0.3}),
    Call(
        name="Profile.__call__",
        make=lambda: (cl.Profile((0.0, 0.5), (1.0, 2.0)), {"at": X}),
        arrays=("at",),
    ),
    of_class("Profile.on", cl.Profile((0.0, 0.5), (1.0, 2.0)).on, {"start": 0.1, "end": 0.4}),
    Call(
        name="Track",
        make=lambda: (
            cl.Track,
            {"friction_left": cl.Profile((0.0,), (0.5,)), "slope": cl.Profile((0.0,), (0.3,))},
        ),
    ),
    Call(
        name="Track.friction_scale",
        make=lambda: (
            cl.Track(friction_left=cl.Profile((0.0, 0.5), (1.0, 2.0))).friction_scale,
            {"distance": X, "time": 1.0},
        ),
        arrays=("distance",),
        numbers=("time",),
    ),
]

# Public names without a call, and why.
EXEMPT: dict[str, str] = {
    "KalkerCoefficients": "a result",
    "ConvergenceError": "an exception",
    "ProcessZoneWarning": "a warning",
    "AspectWarning": "a warning",
    "InputWarning": "a warning",
    "Weakening": "an abstract class",
    "Weakening.fraction": "abstract",
    "Weakening.slope": "abstract",
    "FitResult": "made by fit alone",
    "CreepForces.of": "takes an element alone: test_creep_forces.py",
    "CreepForceTable.save": "has a file alone: test_table.py",
    "CreepForceTable.load": "has a file alone: test_table.py",
    "MeasuredCurve.from_csv": "has a file alone: test_measured.py",
    "TractionData.from_csv": "has a file alone: test_data.py",
}
