"""Model files: a wheelset, and the two runs of the demonstration."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, TypeVar, cast

from contactlib.base.quantities import Parameters
from contactlib.base.text import harmless_line
from contactlib.contact.element import ForceElement
from contactlib.contact.friction import Friction
from contactlib.contact.hertz import Contact
from contactlib.contact.table import CreepForceTable
from contactlib.files.mistakes import Mistakes, ModelError
from contactlib.files.reading import (
    IS_SWEEP,
    check_keys,
    doubt,
    loading,
    model_path,
    named,
    parse,
    read_section,
    text,
    title,
)
from contactlib.files.sections import (
    ContactSection,
    CreepSection,
    FrictionSection,
    LawSection,
    RunSection,
    TorqueSection,
    WheelsetSection,
)
from contactlib.vehicle.conditions import Resistance
from contactlib.vehicle.continuous_control import CreepControl, TorqueControl
from contactlib.vehicle.wheelset import Wheelset

Made = TypeVar("Made")
Section = TypeVar("Section", bound=Parameters)
EMPTY: dict[str, Any] = {}  # one object, so that a section no file has is read once

# Sections of the wheelset, which a scenario may change.
VEHICLE_SECTIONS: dict[str, type[Parameters]] = {
    "contact": ContactSection,
    "friction": FrictionSection,
    "law": LawSection,
    "wheelset": WheelsetSection,
    "resistance": Resistance,
}
RUNS = {"run": RunSection, "torque_control": TorqueSection, "creep_control": CreepSection}
REPLACED = ("saturation_creepage", "slope_reduction")  # keys of [wheelset], by a measured curve


class BuildCache:
    """Keeps the last object built under each name, and rebuilds it only if an input has changed.

    An input is unchanged if it is the same object or an equal float: a change to file contents
    must copy the tables that lead to it, and no others.
    """

    def __init__(self) -> None:
        self._built: dict[Hashable, tuple[tuple[Any, ...], Any]] = {}

    def __call__(self, name: Hashable, build: Callable[..., Made], *inputs: Any) -> Made:
        """Object of this name: the last one, or ``build(*inputs)``."""
        last = self._built.get(name)
        if last is None or any(_differ(*pair) for pair in zip(last[0], inputs, strict=True)):
            self._built[name] = last = inputs, build(*inputs)
        built: Made = last[1]
        return built

    def section(self, name: str, kind: type[Section], data: Mapping[str, Any]) -> Section:
        """Section of a file as the parameters `kind`; all defaults if the file omits it."""
        if name not in data and _needed(kind):
            raise ValueError(f"{name} is missing")
        found: Section = self(("section", name), _read, name, kind, data.get(name, EMPTY))
        return found


def _needed(kind: type[Any]) -> bool:
    return any(field.default is MISSING for field in fields(kind))


def _differ(one: Any, other: Any) -> bool:
    return one is not other and not (type(one) is type(other) is float and one == other)


def _read(name: str, kind: type[Section], table: object) -> Section:
    return read_section(name, kind, {name: table})


class Missing:
    """Stands for a part that a file does not describe: any use of it says what the file lacks."""

    def __init__(self, lacking: str, **known: object) -> None:
        self.__dict__.update(known, lacking=lacking)

    def __repr__(self) -> str:
        return f"<{self.lacking}>"

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):  # looked up by Python itself, as when an object is copied
            raise AttributeError(name)
        raise ModelError(self.lacking)


@dataclass(frozen=True, kw_only=True)
class Model:
    """A wheelset and the runs that its file describes.

    Attributes
    ----------
    name, source : str
        Title, and the origin of the numbers. Default: the file's name, and "not stated".
    wheelset : Wheelset
        Contact, friction, table and body. If the file describes a creep force only, it has only
        `element` and `radius`, and any other use raises a `ModelError`.
    torque_control, creep_control : TorqueControl, CreepControl
        Continuous controllers of the two runs of the demonstration; as above.
    initial_speed : float
        Speed at the start of both runs, and of an FMU [m/s]. Default: 10.
    """

    name: str
    source: str
    wheelset: Wheelset
    torque_control: TorqueControl
    creep_control: CreepControl
    initial_speed: float


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
        If a number is allowed but no vehicle has it.
    """
    with loading(path):
        file = model_path(path)
        data = {"name": harmless_line(file.stem), **parse(file)}
        return build_model(data, file.parent, table, progress)


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
    if "vehicle" in data:
        raise ValueError(
            f"is a scenario of the vehicle {data['vehicle']!r}, not a model: "
            "contactlib.load_scenario reads it and the command 'contactlib simulate' runs it"
        )
    kinds: dict[str, Any] = {"torque_control": TorqueSection, "creep_control": CreepSection}
    with Mistakes(data) as mistakes:
        mistakes.of(check_keys, "", data, ["name", "source", *VEHICLE_SECTIONS, *RUNS], [])
        given: dict[str, Any] = {
            "name": mistakes.of(title, "name", data.get("name", "Unnamed")),
            "source": mistakes.of(text, "source", data.get("source", "not stated")),
        }
        for key, kind in kinds.items():
            given[key] = Missing(f"[{key}] is missing: a run of the model needs it")
            if key in data:
                section = mistakes.of(read_section, key, kind, data)
                given[key] = section and mistakes.of(_built, key, section)
        run = mistakes.of(read_section, "run", RunSection, {"run": EMPTY, **data})
        mistakes.of(_read_vehicle, data, cache)
    return {**given, "initial_speed": run.initial_speed}


class _Vehicle(NamedTuple):
    """Sections of a wheelset, and what is built from them without a table."""

    contact: Contact
    law: LawSection
    body: WheelsetSection
    inertia: float | None  # with the rotor's
    friction: Friction | None  # none for a measured curve
    reduction: float
    resistance: Resistance


def _read_vehicle(data: Mapping[str, Any], cache: BuildCache) -> _Vehicle:
    friction, reduction = None, 1.0
    with Mistakes(data) as mistakes:
        section = mistakes.of(cache.section, "contact", ContactSection, data)
        contact = section and mistakes.of(cache, "contact", partial(_built, "contact"), section)
        law = mistakes.of(cache.section, "law", LawSection, data)
        if law:
            mistakes.of(_check_law, law)  # even if the table is given
        body = mistakes.of(cache.section, "wheelset", WheelsetSection, data)
        inertia = body and mistakes.of(cache, "inertia", _inertia, body)
        if not (law and law.kind == "measured"):
            rubbing = mistakes.of(cache.section, "friction", FrictionSection, data)
            if rubbing and contact:
                friction = mistakes.of(cache, "friction", _friction, rubbing, contact)
            if friction and body:
                reduction = mistakes.of(_reduction, body, contact, friction)
        resistance = mistakes.of(cache.section, "resistance", Resistance, data)
    return _Vehicle(contact, law, body, inertia, friction, reduction, resistance)


def build_wheelset(
    data: Mapping[str, Any],
    folder: Path,
    table: CreepForceTable | None,
    progress: Callable[[float], object],
    cache: BuildCache | None = None,
) -> Wheelset:
    """Build a wheelset from the contents of a model file in `folder`; errors as `build_model`."""
    cache = cache or BuildCache()
    contact, law, body, inertia, friction, reduction, resistance = _read_vehicle(data, cache)
    sizes = body.radius, body.minimum_speed, body.wheels or 1.0
    if friction is None:
        with named("law"):
            table = table or law.measured(folder)
        _warn_of_unused(data)
        element = cache("element", _measured, contact, table, law, *sizes)
    else:
        with named("law"):
            table = table or law.build(contact, friction, progress)
        with named("wheelset"):
            element = cache("element", _element, contact, friction, table, reduction, *sizes)
    return cache("wheelset", _wheelset, element, body, inertia, resistance)


def _warn_of_unused(data: Mapping[str, Any]) -> None:
    replaced = ["friction", *(f"wheelset.{key}" for key in REPLACED if key in data["wheelset"])]
    unused = [name for name in replaced if "." in name or name in data]
    if unused:
        doubt(
            "law",
            f"law.kind = 'measured' makes no use of {' and '.join(unused)}: the curve is taken as "
            "it was measured",
        )


def _built(name: str, section: Any) -> Any:
    with named(name):
        return section.build()


def _check_law(law: LawSection) -> None:
    with named("law"):
        law.check_keys()


def _inertia(body: WheelsetSection) -> float | None:
    with named("wheelset"):
        return body.whole_inertia()


def _reduction(body: WheelsetSection, contact: Contact, friction: Friction) -> float:
    with named("wheelset"):
        return body.reduction(contact, friction)


def _friction(section: FrictionSection, contact: Contact) -> Friction:
    with named("friction"):
        return section.build(contact)


def _element(
    contact: Contact,
    friction: Friction,
    table: CreepForceTable,
    slope_reduction: float,
    radius: float,
    minimum_speed: float,
    wheels: float,
) -> ForceElement:
    return ForceElement(
        contact,
        friction,
        table=table,
        radius=radius,
        slope_reduction=slope_reduction,
        minimum_speed=minimum_speed,
        wheels=wheels,
    )


def _measured(
    contact: Contact,
    table: CreepForceTable,
    law: LawSection,
    radius: float,
    minimum_speed: float,
    wheels: float,
) -> ForceElement:
    with named("law"):
        return ForceElement.from_curve(
            table,
            contact,
            radius=radius,
            minimum_speed=minimum_speed,
            wheels=wheels,
            load_exponent=law.load_exponent,
        )


def _wheelset(
    element: ForceElement, body: WheelsetSection, inertia: float | None, resistance: Resistance
) -> Wheelset:
    if inertia is None or body.wheels is None:
        lacking = " and ".join(key for key in ("inertia", "wheels") if getattr(body, key) is None)
        made: Any = Missing(
            f"[wheelset] needs {lacking}: the file describes a wheel's creep force only",
            element=element,
            radius=body.radius,
        )
        return cast(Wheelset, made)
    return Wheelset(
        element,
        inertia=inertia,
        mass=body.mass,
        damping=body.damping,
        resistance=resistance,
    )
