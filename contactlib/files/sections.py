"""Sections of a model file. Their keys are the parameters of the classes that they describe.

A class declares unit, limits, usual range, default and meaning of a key, or a function that makes
its objects from other numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from contactlib.base.quantities import Parameter, Parameters, declared
from contactlib.element.force_element import ForceElement
from contactlib.files.reading import file_beside, in_file, note_warning
from contactlib.laws.formula import formula_laws
from contactlib.laws.friction import Friction
from contactlib.laws.hertz import Contact, EllipticContact, LineContact, Material
from contactlib.laws.measured import MeasuredCurve
from contactlib.laws.scales import friction_with_k_hat, k_hat, slope_reduction_of
from contactlib.laws.traction_data import LARGEST, TractionData
from contactlib.table.building import largest_k_hat
from contactlib.table.creep_force_table import CreepForceTable
from contactlib.table.law_tables import Shape, carter_griffith_table, cohesive_table
from contactlib.vehicle.wheelset import Resistance, Wheelset, geared_inertia

Keys = Mapping[str, Parameter]
Given = Mapping[str, Any]  # values of a section's keys, in SI units
OF_CURVE = tuple(declared(TractionData.from_csv))
LINE = "semi_width and radius"
ELLIPSE = "radius_x and radius_y, or semi_axis_x and semi_axis_y"


class LawKind(NamedTuple):
    """A kind of law.

    Attributes
    ----------
    meaning : str
        Sentences for the guide.
    keys, optional_keys : tuple of str
        Keys of ``[law]`` that it needs, and others that it accepts.
    table_keys : tuple of str
        Keys of the file that change its table.
    without_layer : str
        What replaces a layer in a law that has none.
    """

    meaning: str
    keys: tuple[str, ...] = ()
    table_keys: tuple[str, ...] = ()
    optional_keys: tuple[str, ...] = ()
    without_layer: str = ""


LAWS = {
    "carter_griffith": LawKind("Limit of a short weakening zone. Its table is shipped."),
    "cohesive": LawKind(
        "The law without that limit. Its table is built when a file is first read, in some 8 s, "
        "and half a minute with a layer.",
        table_keys=("friction.static", "friction.kinetic"),
    ),
    **{
        kind: LawKind(
            law.meaning,
            keys=tuple(declared(law)),
            table_keys=tuple(f"law.{key}" for key in declared(law)),
            without_layer=law.without_layer,
        )
        for kind, law in formula_laws().items()
    },
    "measured": LawKind(
        "A curve through measured points, as it was measured at the contact's nominal load. It "
        "replaces `[friction]`, and `saturation_creepage` and `slope_reduction` in `[wheelset]`. "
        "It is one for all speeds: a column of speeds only serves to doubt points of several.",
        keys=("file",),
        optional_keys=("load_exponent", *OF_CURVE),
        without_layer="the curve contains the layer of the rail on which it was measured; leave "
        "the layer out",
    ),
}
FORMULA_KEYS = {key: p for law in formula_laws().values() for key, p in declared(law).items()}


@dataclass(frozen=True, kw_only=True)
class Law(Parameters):
    """The law of the creep force.

    Parameters
    ----------
    kind : str
        One of the kinds in the next table.
    file : str, optional
        CSV file of a measured curve. It lies beside the model file or below its folder, or is a
        shipped one.
    """

    kind: str = "carter_griffith"
    file: str | None = None


@dataclass(frozen=True, kw_only=True)
class Rails(Parameters):
    """Rails with a name.

    Parameters
    ----------
    condition : str, optional
        Name of a published parameter set, which ``contactlib conditions`` lists, or of a file of
        your own like ``"my_rails.toml"``, beside the model file or below its folder. It gives the
        keys of this section, and `slope_reduction` or `layer_compliance`; those that the file gives
        win.
    """

    condition: str | None = None


def without(keys: Keys, *names: str) -> dict[str, Parameter]:
    """All keys except the named ones."""
    return {name: parameter for name, parameter in keys.items() if name not in names}


def optional(keys: Keys, *names: str) -> dict[str, Parameter]:
    """The keys; a file may omit the named ones."""
    return {**keys, **{name: replace(keys[name], default=None) for name in names}}


ELEMENT = declared(ForceElement)
CONTACTS: dict[tuple[str, ...], Callable[..., Contact]] = {
    ("semi_width", "radius"): LineContact.from_semi_width,
    ("radius_x", "radius_y"): EllipticContact,
    ("semi_axis_x", "semi_axis_y"): EllipticContact.from_semi_axes,
}
SHAPES = tuple(key for pair in CONTACTS for key in pair)
# Sections of the wheelset, which a scenario may change.
VEHICLE_SECTIONS: Mapping[str, Keys] = {
    "contact": optional(
        without(
            {k: v for make in (*CONTACTS.values(), Material) for k, v in declared(make).items()},
            "contact_modulus",
        )
        | {"memory": ELEMENT["memory"]},
        *SHAPES,
    ),
    "friction": optional(
        {**declared(Rails), **declared(Friction), **declared(friction_with_k_hat)},
        "weakening_length",
        "k_hat",
    ),
    "law": optional(
        {
            **declared(Law),
            "kind": replace(declared(Law)["kind"], choices=tuple(LAWS)),
            **FORMULA_KEYS,
            **{key: declared(TractionData.from_csv)[key] for key in OF_CURVE},
            "load_exponent": ELEMENT["load_exponent"],
        },
        *FORMULA_KEYS,
    ),
    "wheelset": optional(
        {
            **without(ELEMENT, "load_exponent", "memory"),
            **declared(Wheelset),
            **declared(geared_inertia),
            **declared(slope_reduction_of),
        },
        "inertia",
    ),
    "resistance": declared(Resistance),
}


def arguments(make: Any, given: Given, *others: str) -> dict[str, Any]:
    """The values that a class or function needs, except the named ones."""
    return {key: given[key] for key in given if key in declared(make) and key not in others}


def contact_of(given: Given) -> Contact:
    """Contact of two bodies of one material, from one of three pairs of numbers."""
    shape = tuple(key for key in SHAPES if key in given)
    if shape not in CONTACTS:
        pairs = ", or ".join(" and ".join(pair) for pair in CONTACTS)
        raise ValueError(
            f"{pairs}: give exactly one of these pairs, not {' and '.join(shape) or 'nothing'}"
        )
    make = CONTACTS[shape]
    if "theory" in given and "theory" not in declared(make):
        raise ValueError(f"theory = {given['theory']!r} is for an ellipse, not for a line contact")
    material = Material(**arguments(Material, given))
    modulus = material.contact_modulus_with(material)
    contact = make(contact_modulus=modulus, **arguments(make, given))
    for key in ("radius_x", "radius_y") if "semi_axis_x" in given else ():
        radius, quantity = getattr(contact, key), EllipticContact.quantities()[key]
        if quantity.usual and not quantity.is_usual(radius):
            low, high = quantity.usual
            note_warning(
                "contact.semi_axis_x",
                f"contact: with the normal load of {contact.wheel_load:g} N and Young's modulus, "
                f"the semi-axes are those of a relative {key} of {radius:.4g} m: {low:g} to "
                f"{high:g} m is usual",
            )
    return contact


def friction_of(given: Given, contact: Contact) -> Friction:
    """Friction with the weakening length given or from `k_hat`."""
    if not LARGEST.allow(given["static"]):
        raise ValueError(
            f"static = {given['static']!r} is out of range: must be <= {LARGEST.at_most:g}; if it "
            "is in per cent, write its unit"
        )
    lengths = [key for key in ("weakening_length", "k_hat") if key in given]
    if len(lengths) != 1:
        raise ValueError(
            f"weakening_length and k_hat: give exactly one of them, not {len(lengths)}"
        )
    return friction_with_k_hat(contact, **given) if "k_hat" in given else Friction(**given)


def check_law(given: Given) -> None:
    """Refuse keys that the kind of law would ignore."""
    kind = given.get("kind", Law.kind)
    keys, more = LAWS[kind].keys, LAWS[kind].optional_keys
    others = [key for key in VEHICLE_SECTIONS["law"] if key in given and key != "kind"]
    if [key for key in others if key not in more] != list(keys):
        what = f"the keys {', '.join((*keys, *more))}" if keys else "no other key"
        raise ValueError(f"kind = {kind!r} accepts {what}, not {others}")


def measured_table(given: Given, folder: Path) -> CreepForceTable:
    """Table of the measured curve; `folder` is the folder of the model file."""
    name = given["file"]
    with in_file(f"file {name}"):
        path = file_beside("file", name, folder, "the model")
    try:
        curve = MeasuredCurve.from_csv(path, **arguments(TractionData.from_csv, given))
    except ValueError as error:
        place = str(error).removeprefix(f"{path}: ")
        raise ValueError(f"file = {name!r}: {place}") from None
    try:
        return CreepForceTable.from_law(curve)
    except ValueError:
        raise ValueError(
            f"file = {name!r}: the curve is too abrupt for a table: {curve.summary}"
        ) from None


def check_layer_of(law: Given, body: Given) -> None:
    """Refuse a layer with a law that has none, before its table is built."""
    kind, compliance = law.get("kind", Law.kind), body.get("layer_compliance", 0.0)
    if LAWS[kind].without_layer and compliance > 0.0:
        raise ValueError(
            f"wheelset.layer_compliance = {compliance!r} must be 0 with law.kind = {kind!r}: "
            f"{LAWS[kind].without_layer}, or law.kind = 'carter_griffith' or 'cohesive'"
        )


def law_table(
    given: Given,
    contact: Contact,
    friction: Friction,
    progress: Callable[[float], object],
    layers: bool = False,
) -> CreepForceTable:
    """Table of a law that is not measured."""
    kind = given.get("kind", Law.kind)
    shape: Shape = "elliptic" if isinstance(contact, EllipticContact) else "line"
    if kind == "cohesive":
        contact_k_hat, largest = k_hat(contact, friction), largest_k_hat(friction.ratio)
        if contact_k_hat > largest * (1.0 + 1e-9):  # before the table is built
            raise ValueError(
                f"kind = 'cohesive' has k_hat up to {largest:.4g} for this ratio of static to "
                f"kinetic friction, but contact and friction give {contact_k_hat:.4g}: choose a "
                "shorter weakening_length"
            )
        return cohesive_table(shape, friction.ratio, friction.weakening, progress, layers=layers)
    if kind == "carter_griffith":
        return carter_griffith_table(shape)
    law = formula_laws()[kind]
    if shape not in law.contacts:
        of, needs = ("an ellipse", ELLIPSE) if shape == "line" else ("a line contact", LINE)
        raise ValueError(f"kind = {kind!r} is the law of {of}: [contact] needs {needs}")
    chosen = law(**arguments(law, given))
    try:
        return CreepForceTable.from_law(chosen)
    except ValueError as error:
        values = ", ".join(f"{key} = {getattr(chosen, key):g}" for key in declared(law))
        raise ValueError(f"kind = {kind!r} with {values} has no accurate table: {error}") from error
