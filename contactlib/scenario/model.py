"""Model files: a wheelset, and the two runs of the demonstration."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contactlib.controllers import CreepControl, TorqueControl
from contactlib.element import ForceElement
from contactlib.friction import Friction
from contactlib.hertz import Contact
from contactlib.parameters import Parameters
from contactlib.scenario.contact_sections import (
    ContactSection,
    FrictionSection,
    LawSection,
    WheelsetSection,
)
from contactlib.scenario.control_sections import CreepSection, RunSection, TorqueSection
from contactlib.scenario.kept import Kept
from contactlib.scenario.reading import (
    IS_SWEEP,
    check_keys,
    in_file,
    model_path,
    named,
    parse,
    read_section,
    text,
)
from contactlib.table import CreepForceTable
from contactlib.wheelset import Resistance, Wheelset

# Of the wheelset, which a scenario may change, and of the runs.
VEHICLE_SECTIONS: dict[str, type[Parameters]] = {
    "contact": ContactSection,
    "friction": FrictionSection,
    "law": LawSection,
    "wheelset": WheelsetSection,
    "resistance": Resistance,
}
NEEDED = ("contact", "friction", "wheelset", "resistance", "run", "torque_control", "creep_control")


@dataclass(frozen=True, kw_only=True)
class Model:
    """A wheelset and what it is put through.

    Attributes
    ----------
    name, source : str
        What it is, and where its numbers come from.
    wheelset : Wheelset
        Contact, friction, table and body.
    torque_control, creep_control : TorqueControl, CreepControl
        The two runs of the demonstration.
    initial_speed : float
        [m/s].
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
        it names lies beside it or below its folder, or is a shipped one.
    table : CreepForceTable, optional
        The law; if left out that of the file's ``[law]`` section, or Carter and Griffith's.
    progress : callable
        Is told what part of the law's table has been built, which the cohesive law needs.

    Raises
    ------
    ModelError
        If the file is not a valid model; one line names file, key, value and limit.
    OSError
        If it cannot be read.
    """
    with in_file(path):
        file = model_path(path)
        return build_model(parse(file), file.parent, table, progress)


def build_model(
    data: Mapping[str, Any],
    folder: Path,
    table: CreepForceTable | None,
    progress: Callable[[float], object],
) -> Model:
    """Model of the contents of a file in `folder`; a mistake is a ValueError of one line."""
    if "axes" in data:
        raise ValueError(IS_SWEEP)
    if "vehicle" in data:
        raise ValueError(
            f"is a scenario of the vehicle {data['vehicle']!r}, not a model: "
            "contactlib.load_scenario reads it and the command 'contactlib simulate' runs it"
        )
    needed = ["name", "source", *NEEDED]
    check_keys("", data, [*needed, "law"], needed)
    name, source = (text(key, data[key]) for key in ("name", "source"))
    wheelset = build_wheelset(data, folder, table, progress)
    torque_section = read_section("torque_control", TorqueSection, data)
    creep_section = read_section("creep_control", CreepSection, data)
    with named("torque_control"):
        torque_control = torque_section.build()
    with named("creep_control"):
        creep_control = creep_section.build()
    return Model(
        name=name,
        source=source,
        wheelset=wheelset,
        torque_control=torque_control,
        creep_control=creep_control,
        initial_speed=read_section("run", RunSection, data).initial_speed,
    )


def build_wheelset(
    data: Mapping[str, Any],
    folder: Path,
    table: CreepForceTable | None,
    progress: Callable[[float], object],
    kept: Kept | None = None,
) -> Wheelset:
    """Wheelset of the contents of a model file in `folder`; a mistake is a ValueError of one line.

    What `kept` has of a wheelset before and would come out the same is not made anew.
    """
    kept = kept or Kept()
    contact_section = kept.section("contact", ContactSection, data)
    friction_section = kept.section("friction", FrictionSection, data)
    law_section = kept.section("law", LawSection, data)
    body = kept.section("wheelset", WheelsetSection, data)
    contact = kept("contact", _contact, contact_section)
    friction = kept("friction", _friction, friction_section, contact)
    with named("law"):
        law_section.check_keys()  # also where the table is given
        if table is None:
            ratio = contact_section.poisson_ratio
            table = law_section.build(contact, friction, ratio, folder, progress)
    with named("wheelset"):
        reduction = body.reduction(contact, friction)
        sizes = body.radius, reduction, body.minimum_speed
        element = kept("element", _element, contact, friction, table, *sizes)
    resistance = kept.section("resistance", Resistance, data)
    return kept("wheelset", _wheelset, element, body, resistance)


def _contact(section: ContactSection) -> Contact:
    with named("contact"):
        return section.build()


def _friction(section: FrictionSection, contact: Contact) -> Friction:
    with named("friction"):
        return section.build(contact)


def _element(
    contact: Contact,
    friction: Friction,
    table: CreepForceTable,
    radius: float,
    slope_reduction: float,
    minimum_speed: float,
) -> ForceElement:
    return ForceElement(
        contact,
        friction,
        table=table,
        radius=radius,
        slope_reduction=slope_reduction,
        minimum_speed=minimum_speed,
    )


def _wheelset(element: ForceElement, body: WheelsetSection, resistance: Resistance) -> Wheelset:
    return Wheelset(
        element,
        inertia=body.inertia,
        mass=body.mass,
        damping=body.damping,
        resistance=resistance,
    )
