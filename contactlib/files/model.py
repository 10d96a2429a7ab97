"""Model files: a wheelset, or a wheel's creep force."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple, NoReturn, TypeVar, cast

from contactlib.base.quantities import Parameters, Quantity, declared
from contactlib.base.text import printable_line
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.element.force_element import ForceElement
from contactlib.files.mistakes import Mistakes, ModelError
from contactlib.files.rail_conditions import with_condition, with_condition_file
from contactlib.files.reading import (
    IS_SWEEP,
    check_keys,
    loading,
    model_path,
    named,
    note_warning,
    parse,
    read_section,
    text,
    title,
)
from contactlib.files.sections import (
    VEHICLE_SECTIONS,
    Given,
    Keys,
    arguments,
    check_law,
    check_layer_of,
    contact_of,
    friction_of,
    law_table,
    measured_table,
    without,
)
from contactlib.laws.friction import Friction
from contactlib.laws.hertz import Contact
from contactlib.laws.scales import slope_reduction_of
from contactlib.table.creep_force_table import CreepForceTable
from contactlib.vehicle.wheelset import Resistance, Wheelset, geared_inertia

Made = TypeVar("Made")
EMPTY: dict[str, Any] = {}  # one object, so that a section no file has is read once
# Ratios of numbers that belong together; beyond them the numbers are doubted.
SAME, ON_ROLLER, LOAD_RATIO = 1.01, 0.9, 1.1  # of radii, on a rail or a roller, and of loads
REPLACED = tuple(declared(slope_reduction_of))  # keys of [wheelset], by a measured curve


class BuildCache:
    """Keeps the last object built under each name, and rebuilds it only if an input has changed.

    An input is unchanged if it is the same object, an equal float or an equal table of a file: a
    change to file contents must copy the tables that lead to it, and no others.
    """

    def __init__(self) -> None:
        self._built: dict[Hashable, tuple[tuple[Any, ...], Any]] = {}

    def __getstate__(self) -> dict[str, Any]:
        """A copy or a pickle begins empty: the objects can be built again."""
        return {"_built": {}}

    def __call__(self, name: Hashable, build: Callable[..., Made], *inputs: Any) -> Made:
        """Object of this name: the last one, or ``build(*inputs)``."""
        last = self._built.get(name)
        if last is None or any(_differ(*pair) for pair in zip(last[0], inputs, strict=True)):
            self._built[name] = last = inputs, build(*inputs)
        built: Made = last[1]
        return built

    def section(self, name: str, keys: Keys, data: Mapping[str, Any], make: Any = dict) -> Any:
        """Object that `make` builds from a section, or from defaults if the file omits it."""
        if name not in data and any(key.needed for key in keys.values()):
            raise ValueError(f"{name} is missing")
        return self(("section", name), _section, name, keys, data.get(name, EMPTY), make)

    def made(self, name: str, make: Callable[..., Made], *inputs: Any, **given: Any) -> Made:
        """Result of a function; its errors name the section that its inputs come from."""

        def build(given: Given, *inputs: Any) -> Made:
            with named(name):
                return make(*inputs, **given)

        return self(("made", name, make), build, given, *inputs)


def _section(name: str, keys: Keys, table: object, make: Callable[..., Made]) -> Made:
    given = read_section(name, keys, table)
    with named(name):
        return make(**given)


def _differ(last: Any, given: Any) -> bool:
    return last is not given and not (type(last) is type(given) in (float, dict) and last == given)


class Missing:
    """Placeholder for a part that a file does not describe: any use of it raises an error."""

    def __init__(self, lacking: str, **known: object) -> None:
        self.__dict__.update(known, lacking=lacking)

    def __repr__(self) -> str:
        return f"<{self.lacking}>"

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):  # looked up by Python itself, as when an object is copied
            raise AttributeError(name)
        raise ModelError(self.lacking)


@dataclass(frozen=True, kw_only=True)
class Model(Parameters):
    """A wheelset, as its file describes it.

    Attributes
    ----------
    name, source : str
        Title, and the origin of the numbers. Default: the file's name, and "not stated".
    wheelset : Wheelset
        Contact, friction, table and body. If the file describes a creep force only, it has only
        `element` and `radius`, and any other use raises a `ModelError`.
    initial_speed : float
        Speed at which an FMU of the wheelset starts [m/s].
    """

    name: str
    source: str
    wheelset: Wheelset
    initial_speed: Annotated[float, Quantity("m/s", above=0.0, usual=(0.0, 170.0))] = 10.0


RUN: Keys = without(declared(Model), "name", "source")  # keys of [run]


def load_model(
    path: str | os.PathLike[str],
    *,
    table: CreepForceTable | None = None,
    progress: Callable[[float], object] = lambda part: None,
) -> Model:
    """Read a model file.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a shipped one such as ``"models/roller_rig.toml"``. A file that
        it refers to lies in its folder or below, or is a shipped one.
    table : CreepForceTable, optional
        Table of the law. Default: the law of the file's ``[law]`` section, or Carter and
        Griffith's.
    progress : callable, optional
        Called with the fraction of the table that has been built, from 0 to 1; only the cohesive
        law needs to build one.

    Raises
    ------
    ModelError
        If the file is not a valid model; a line for each mistake names file, key,
        value and limit.
    OSError
        If the file cannot be read.

    Warns
    -----
    InputWarning
        If a number is allowed but implausible for a vehicle.
    """
    with loading(path):
        file = model_path(path)
        data = {"name": printable_line(file.stem), **parse(file)}
        return build_model(with_condition_file(data, file.parent), file.parent, table, progress)


def build_model(
    data: Mapping[str, Any],
    folder: Path,
    table: CreepForceTable | None,
    progress: Callable[[float], object],
) -> Model:
    """Build a model from the contents of a file in `folder`; errors are `ModelError`."""
    cache = BuildCache()
    given = read_model(data, cache)
    return Model(**given, wheelset=build_wheelset(data, folder, table, progress, cache))


def read_model(data: Mapping[str, Any], cache: BuildCache) -> dict[str, Any]:
    """Read all sections, so that all mistakes come at once: the model's parts but the wheelset."""
    if "axes" in data:
        raise ValueError(IS_SWEEP)
    if "demand" in data:
        raise ValueError(
            f"is a scenario, not a model: name its model, {data.get('wheelset')!r}; "
            "contactlib.load_scenario reads a scenario and 'contactlib simulate' runs it"
        )
    with Mistakes(data) as mistakes:
        mistakes.of(check_keys, "", data, ["name", "source", *VEHICLE_SECTIONS, "run"], [])
        given: dict[str, Any] = {
            "name": mistakes.of(title, "name", data.get("name", "Unnamed")),
            "source": mistakes.of(text, "source", data.get("source", "not stated")),
        }
        given |= mistakes.of(cache.section, "run", RUN, data) or {}
        mistakes.of(_read_vehicle, data, cache)
    return given


class _Vehicle(NamedTuple):
    """Sections of a wheelset, and what is built from them without a table."""

    contact: Contact
    law: Given
    body: Given
    inertia: float  # with the rotor's
    friction: Friction | None  # none for a measured curve
    reduction: float
    resistance: Resistance
    memory: bool


def _read_vehicle(data: Mapping[str, Any], cache: BuildCache) -> _Vehicle:
    friction, reduction, inertia = None, 1.0, 1.0
    with Mistakes(data) as mistakes:
        filled = mistakes.of(with_condition, data)
        data = filled or data

        def read(name: str, make: Any = dict) -> Any:
            return mistakes.of(cache.section, name, VEHICLE_SECTIONS[name], data, make)

        section = read("contact")
        contact = section and mistakes.of(cache.made, "contact", contact_of, section)
        law, body = read("law"), read("wheelset")
        if law is not None:
            mistakes.of(cache.made, "law", check_law, law)  # even if the table is given
            mistakes.of(check_layer_of, law, body or {})
        if body:
            # The rotor is checked even if a wheel's creep force is all that the file describes.
            given = arguments(geared_inertia, {"inertia": 1.0, **body})
            inertia = mistakes.of(cache.made, "wheelset", geared_inertia, **given)
        # A law with mistakes may be that of a measured curve, which needs no friction.
        curve = law and law.get("kind") == "measured"
        if filled and not curve and (law is not None or "friction" in data):
            rubbing = read("friction")
            if rubbing and contact:
                friction = mistakes.of(cache.made, "friction", friction_of, rubbing, contact)
            if friction and body:
                given = arguments(slope_reduction_of, body)
                clean = contact, friction
                reduction = mistakes.of(cache.made, "wheelset", slope_reduction_of, *clean, **given)
        resistance = read("resistance", Resistance)
        if contact and body and "radius" in body:
            _check_plausible_body(section, body)
    memory = bool(section and section.get("memory", False))
    return _Vehicle(contact, law, body, inertia, friction, reduction, resistance, memory)


def _check_plausible_body(contact: Given, body: Given) -> None:
    """Doubt radii and masses of a wheelset that do not fit its contacts."""
    radius, load = body["radius"], body.get("wheels", 1) * contact["wheel_load"]
    name = "radius_x" if "radius_x" in contact else "radius"
    ratio = contact.get(name, radius) / radius
    if ratio > SAME or ON_ROLLER < ratio < 1.0 / SAME:
        note_warning(
            "radius",
            f"contact.{name} = {contact[name]:g} m and wheelset.radius = {radius:g} m differ: on a "
            f"rail both are the wheel's, and on a roller the first is at most {ON_ROLLER:g} of it",
        )
    if body.get("mass", math.inf) * STANDARD_GRAVITY < load / LOAD_RATIO:
        note_warning(
            "mass",
            f"wheelset.mass = {body['mass']:g} kg is less than its wheels carry, "
            f"{load / STANDARD_GRAVITY:.4g} kg by contact.wheel_load",
        )


def build_wheelset(
    data: Mapping[str, Any],
    folder: Path,
    table: CreepForceTable | None,
    progress: Callable[[float], object],
    cache: BuildCache | None = None,
) -> Wheelset:
    """Build a wheelset from the contents of a model file in `folder`; errors as `build_model`."""
    cache = cache or BuildCache()
    contact, law, body, inertia, friction, reduction, resistance, memory = _read_vehicle(
        data, cache
    )
    if friction is None:
        sizes = arguments(ForceElement, body, *REPLACED) | arguments(ForceElement, law)
        table = table or cache.made("law", measured_table, law, folder)
        _warn_of_unused(data)
        element = cache.made("law", ForceElement.from_curve, table, contact, **sizes, memory=memory)
    else:
        layers = body.get("layer_compliance", 0.0) > 0.0
        table = table or cache.made("law", law_table, law, contact, friction, progress, layers)
        chosen = {"table": table, "slope_reduction": reduction, "memory": memory}
        sizes = {**arguments(ForceElement, body), **chosen}
        element = cache.made("wheelset", ForceElement, contact, friction, **sizes)
    if "inertia" not in body:
        known: dict[str, Any] = {"element": element, "radius": element.radius}
        text = "[wheelset] needs inertia: the file describes a wheel's creep force only"
        return cast(Wheelset, Missing(text, **known))
    given = {**arguments(Wheelset, body), "inertia": inertia, "resistance": resistance}
    return cache.made("wheelset", Wheelset, element, **given)


def _warn_of_unused(data: Mapping[str, Any]) -> None:
    replaced = ["friction", *(f"wheelset.{key}" for key in REPLACED if key in data["wheelset"])]
    unused = [name for name in replaced if "." in name or name in data]
    if unused:
        note_warning(
            "law",
            f"law.kind = 'measured' makes no use of {' and '.join(unused)}: the curve is taken as "
            "it was measured",
        )
