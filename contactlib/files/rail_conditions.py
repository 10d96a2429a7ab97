"""Rails with names: published parameter sets of dry, wet and contaminated rails.

A condition is a file of ``models/conditions``, or one of your own beside the file that names it. It
gives keys of a model file that describe the rail: friction and its fall with slip speed in
``[friction]``, the initial slope or a layer in ``[wheelset]``, and the reductions of Polach's
formula in ``[law]``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any

from contactlib.base.quantities import (
    Parameters,
    Quantity,
    ReadOnly,
    declared,
)
from contactlib.base.text import known_names
from contactlib.base.writing import package_folder
from contactlib.element.force_element import RADIUS, ForceElement, check_layer
from contactlib.files.mistakes import Mistakes
from contactlib.files.reading import (
    check_keys,
    file_beside,
    in_file,
    model_path,
    named,
    note_warning,
    parse,
    read_section,
    title,
)
from contactlib.files.sections import VEHICLE_SECTIONS, Law, contact_of, friction_of, law_table
from contactlib.laws.formula import formula_laws
from contactlib.laws.friction import Friction
from contactlib.laws.traction_data import TractionData
from contactlib.vehicle.track import RAILS

TEXTS = ("name", "source", "table", "read_in", "vehicle", "speed", "fitted")
GIVEN = ("friction", "law", "wheelset")  # sections of a model file that a condition fills
# Keys of a model file that replace one of a condition.
REPLACED_BY = {
    "k_hat": ("weakening_length",),
    "slip_rate_residual": ("softening_temperature",),
    "slip_rate_decay": ("softening_temperature",),
    "softening_temperature": ("slip_rate_residual", "slip_rate_decay"),
    "slope_reduction": ("saturation_creepage", "layer_compliance"),
    "layer_compliance": ("saturation_creepage", "slope_reduction"),
}
SLOPE = ("slope_reduction", "layer_compliance", "saturation_creepage")
POLACH = "Polach"  # law of a table
SPEED = 10.0  # at which slopes without slip are compared; they do not depend on it [m/s]


@dataclass(frozen=True, kw_only=True)
class Comparison(Parameters):
    """How a condition compares with its source, in the contact of its file.

    Attributes
    ----------
    radius : float
        Rolling radius of the wheel [m].
    speed : float
        Forward speed [m/s].
    deviation : float
        Largest deviation of the traction coefficient from the source's points or formula [1].
    creepage, traction_coefficient : tuple of float
        The source's points [1]; none if it gives a formula.
    file : str or None
        Shipped file of measured points, in place of these.
    """

    radius: Annotated[float, RADIUS]
    speed: Annotated[float, Quantity("m/s", above=0.0)]
    deviation: Annotated[float, Quantity("1", above=0.0, below=1.0)]
    creepage: Annotated[tuple[float, ...], Quantity("1", at_least=-1.0)] = ()
    traction_coefficient: Annotated[tuple[float, ...], Quantity("1", at_least=-5.0)] = ()
    file: str | None = None


@dataclass(frozen=True, kw_only=True)
class RailCondition:
    """A published parameter set of the rail.

    Attributes
    ----------
    key : str
        Its name in files.
    name, source : str
        What it is, and where it was published or measured.
    table : str
        Which table or figure has the numbers. Like all that follows but friction, a file of your
        own may leave it out.
    read_in : str
        The text in which the numbers were read.
    vehicle, speed : str
        For which vehicle and at which speeds they hold.
    fitted : str
        What the source, and what contactlib, fitted, and to what.
    friction, law, wheelset : mapping
        Keys of these sections of a model file, in SI units.
    contact : mapping
        Contact of the comparison.
    comparison : Comparison or None
        Comparison with the source.

    Examples
    --------
    >>> import contactlib as cl
    >>> wet = cl.files.load_condition("wet")
    >>> wet.friction["static"], wet.compared.deviation
    (0.3, 0.049)
    """

    key: str
    name: str
    source: str
    table: str
    read_in: str
    vehicle: str
    speed: str
    fitted: str
    friction: Mapping[str, Any]
    law: Mapping[str, Any]
    wheelset: Mapping[str, Any]
    contact: Mapping[str, Any]
    comparison: Comparison | None

    @cached_property
    def element(self) -> ForceElement:
        """Force element of the comparison, by the Carter-Griffith law."""
        contact = contact_of(self.contact)
        # A source without static friction has the limit law, which only bounds the force by it.
        friction = friction_of({"static": 3.0 * self.friction["kinetic"], **self.friction}, contact)
        table = law_table({}, contact, friction, lambda part: None)
        radius = self.compared.radius
        return ForceElement(contact, friction, table=table, radius=radius, **self.wheelset)

    @cached_property
    def points(self) -> TractionData | None:
        """The source's points, if it has any."""
        compared = self.compared
        if compared.file is not None:
            return TractionData.from_csv(model_path(compared.file), speed=compared.speed)
        if not compared.creepage:
            return None
        points = compared.creepage, compared.traction_coefficient
        return TractionData(*points, speed=compared.speed)

    @property
    def compared(self) -> Comparison:
        """Comparison with the source, without which it raises a ValueError."""
        if self.comparison is None:
            raise ValueError(f"condition {self.key!r} has no [compared], so it is not compared")
        return self.comparison


def condition_names() -> list[str]:
    """Names of the conditions.

    Examples
    --------
    >>> condition_names()[0]
    'dry'
    """
    return sorted(path.stem for path in (package_folder("models") / "conditions").glob("*.toml"))


def found_condition(name: Any, folder: Path) -> Any:
    """A condition's name, or the contents of the file in `folder` that it names, ``x.toml``."""
    if not (isinstance(name, str) and name.endswith(".toml")):
        return name
    with in_file(f"condition {name}"):
        path = file_beside("condition", name, folder, "the file that names it")
        return {**parse(path), "key": name}


def with_condition_file(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Contents of a model file in `folder`, with those of the file that its friction names."""
    friction = data.get("friction")
    if not isinstance(friction, Mapping) or "condition" not in friction:
        return data
    condition = found_condition(friction["condition"], folder)
    return {**data, "friction": {**friction, "condition": condition}}


def load_condition(name: str | os.PathLike[str] | Mapping[str, Any]) -> RailCondition:
    """Read a condition.

    Parameters
    ----------
    name : str, path or mapping
        One of the names that ``contactlib conditions`` lists, or a file of your own; or the
        contents of such a file.

    Raises
    ------
    ValueError
        If no condition has this name, where the message names the closest one and all others; or
        the file is not valid.
    OSError
        If the file cannot be read.
    """
    if isinstance(name, Mapping):
        return _condition_of(name)
    if isinstance(name, os.PathLike) or name.endswith(".toml"):
        path = Path(name)
        with in_file(path.name):
            contents = parse(path)
        return _condition_of({**contents, "key": path.name})
    return _shipped_condition(name)


@cache
def _shipped_condition(name: str) -> RailCondition:
    if name not in condition_names():
        raise ValueError(
            f"condition = {name!r} is not known; {known_names(name, condition_names())}; or the "
            "name of a file of your own, such as 'my_rails.toml'"
        )
    return _condition_of(
        {**parse(package_folder("models") / "conditions" / f"{name}.toml"), "key": name}
    )


def _condition_of(contents: Mapping[str, Any]) -> RailCondition:
    """Condition of a file's contents and its key."""
    data = {name: value for name, value in contents.items() if name != "key"}
    with in_file(str(contents["key"])):
        check_keys(
            "",
            data,
            [*TEXTS, *GIVEN, "contact", "compared"],
            ["name", "source", "friction", *(["contact"] if "compared" in data else [])],
        )
        sections: dict[str, Any] = {}
        for section in (*GIVEN, "contact"):
            keys = {
                key: one for key, one in VEHICLE_SECTIONS[section].items() if key != "condition"
            }
            given = read_section(section, keys, data.get(section, {}), whole=False)
            sections[section] = ReadOnly(given)
        both = {key: sections["friction"].get(key) for key in ("static", "kinetic")}
        if None not in both.values():
            with named("friction"):
                Friction(**both, weakening_length=0.0)  # checks one against the other
        texts: dict[str, Any] = {key: title(key, data.get(key, "not stated")) for key in TEXTS}
        comparison = None
        if "compared" in data:
            given = read_section("compared", declared(Comparison), data["compared"])
            with named("compared"):
                comparison = Comparison(**given)
        return RailCondition(key=contents["key"], **texts, **sections, comparison=comparison)


def with_condition(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Contents of a model file, with the keys of the condition that its friction names.

    Keys that the file gives win. A measured curve contains its rail.

    Raises
    ------
    ValueError
        If the condition is not known, or neither it nor the file gives a key that friction needs.
    """
    friction, law = (data.get(name, {}) for name in ("friction", "law"))
    if not (isinstance(friction, Mapping) and isinstance(law, Mapping) and "condition" in friction):
        return data
    kind = law.get("kind", Law.kind)
    friction = {key: value for key, value in friction.items() if key != "condition"}
    if kind == "measured":
        return {**data, "friction": friction}
    with named("friction"):
        condition = condition_of(data["friction"]["condition"])
        filled = {**data, "friction": _filled(condition.friction, friction)}
        check_keys_given(condition.key, filled["friction"])
    if kind == "polach":
        return {**filled, "law": {**condition.law, **law}}
    body = data.get("wheelset", {})
    if not isinstance(body, Mapping) or not body:
        return filled  # reading the section reports that
    wheelset = _filled(condition.wheelset, body)
    if kind in formula_laws() and wheelset.get("layer_compliance", 0.0) > 0.0:
        raise ValueError(
            f"friction.condition = {condition.key!r} gives a layer_compliance, which law.kind = "
            f"{kind!r} does not have: give wheelset.slope_reduction beside it"
        )
    return {**filled, "wheelset": wheelset}


def condition_of(given: Any) -> RailCondition:
    """Condition of a name, or of contents that `found_condition` has read."""
    return load_condition(given if isinstance(given, Mapping) else title("condition", given))


def _filled(of_condition: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a section, with those of a condition that nothing given replaces."""
    kept = {
        key: value
        for key, value in of_condition.items()
        if not any(other in given for other in REPLACED_BY.get(key, ()))
    }
    return {**kept, **given}


def check_keys_given(condition: str, friction: Mapping[str, Any]) -> None:
    """Refuse friction that lacks a key which the condition cannot fill."""
    for key in ("static", "kinetic"):
        if key not in friction:
            raise ValueError(
                f"{key} is missing: the source of the condition {condition!r} does not give it; "
                "give it beside the condition"
            )


# ---- the track ------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class TrackConditions(Parameters):
    """Conditions along a track.

    Parameters
    ----------
    condition : tuple of str, optional
        Names of the rails at the places of `distance`, which ``contactlib conditions`` lists, or of
        files of your own beside the scenario. They replace `friction` and `slope`, whose factors
        follow from those rails and the vehicle's.
    """

    condition: tuple[str, ...] = ()


def placeholder_lists(condition: Sequence[str], given: Mapping[str, Any]) -> dict[str, Any]:
    """Lists of a track whose conditions are checked before its vehicle is known.

    Raises
    ------
    ValueError
        If a condition is not known, lacks its place, or its factors are also given by lists.
    """
    others = [key for key in (*RAILS, "unit") if key in given]
    if others:
        raise ValueError(f"condition replaces {' and '.join(others)}: give either of them")
    places = len(given.get("distance", ()))
    if places != len(condition):
        raise ValueError(
            f"distance has {places} and condition {len(condition)} entries: both must have as many"
        )
    with Mistakes() as mistakes:
        for name, one in {str(one): one for one in condition}.items():
            mistakes.of(load_condition, one if isinstance(one, Mapping) else name)
    ones = [1.0] * len(condition)
    return {**given, "friction": ones, "slope": ones, "unit": "factor"}


def factors_of_conditions(track: Mapping[str, Any], element: ForceElement) -> dict[str, Any]:
    """Section of a track, with the factors of the conditions that it names.

    The factor on friction is the ratio of the kinetic coefficients, that on the slope the ratio of
    the forces at small creepage, in the vehicle's contact at its nominal load.

    Raises
    ------
    ValueError
        If the vehicle's law has no parameters that a condition could give.
    """
    with named("track"):
        known = {str(one): condition_of(one) for one in track["condition"]}
        conditions = [known[str(one)] for one in track["condition"]]
        for condition in conditions:
            if "kinetic" not in condition.friction:
                raise ValueError(
                    f"condition = {condition.key!r} does not give friction.kinetic, from which a "
                    "track's factor on friction follows"
                )
        slopes = {c.key: slope_factor(c, element) for c in conditions}
    for condition in conditions:
        if left := left_out(condition, element):
            note_warning(
                f"track.condition {condition.key}",
                f"track.condition = {condition.key!r}: a track changes friction and the initial "
                f"slope only; these rails have the vehicle's {left}",
            )
    kinetic = element.friction.kinetic
    return {
        **{key: value for key, value in track.items() if key != "condition"},
        "friction": [c.friction["kinetic"] / kinetic for c in conditions],
        "slope": [slopes[c.key] for c in conditions],
        "unit": "factor",
    }


def slope_factor(condition: RailCondition, element: ForceElement) -> float:
    """Initial slope of the creep force on the condition's rail, over that on the vehicle's [1]."""
    law, own = element.table.law, element.steepest_gradient(SPEED)
    if not element.table.one_axis:
        check_layer(
            f"layer_compliance of {condition.key!r}",
            condition.wheelset.get("layer_compliance", 0.0),
            element.table,
        )
        slope = {"slope_reduction": 1.0, "layer_compliance": 0.0, **condition.wheelset}
        changed: ForceElement = replace(element, **slope)
        return changed.steepest_gradient(SPEED) / own
    if law != POLACH or not condition.law:
        lacks = (
            f"it has no parameters of {law!r}"
            if law in {one.__name__ for one in formula_laws().values()}
            else "a measured curve is that of its own rail"
        )
        if law == POLACH:
            lacks = "its source gives no adhesion_reduction and slip_reduction"
        raise ValueError(f"condition = {condition.key!r} needs another law.kind: {lacks}")
    clean = replace(
        element,
        table=law_table({}, element.contact, element.friction, lambda part: None),
        slope_reduction=1.0,
    )
    reduction = sum(condition.law.values()) / 2.0  # Polach's (kA + kS)/2
    return float(reduction) * clean.steepest_gradient(SPEED) / own


def left_out(condition: RailCondition, element: ForceElement) -> str:
    """What a track cannot give of a condition: the vehicle's friction differs in it."""
    friction = element.friction
    fall = {
        key: (condition.friction.get(key, default), getattr(friction, key))
        for key, default in (
            ("slip_rate_residual", 1.0),
            ("slip_rate_decay", 0.0),
            ("softening_temperature", 0.0),
        )
    }
    parts = [
        f"{key} = {own:g} in place of {of_rail:g}"
        for key, (of_rail, own) in fall.items()
        if of_rail != own
    ]
    k_hat = condition.friction.get("k_hat", 0.0)
    if abs(k_hat - element.k_hat) > 1e-9:
        parts.append(f"k_hat = {element.k_hat:.3g} in place of {k_hat:g}")
    return ", ".join(parts)
