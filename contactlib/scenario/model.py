"""Model files: a wheelset, and the two runs of the demonstration."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from contactlib.controllers import CreepControl, TorqueControl
from contactlib.element import ForceElement
from contactlib.parameters import Parameters
from contactlib.scenario.contact_sections import (
    ContactSection,
    FrictionSection,
    LawSection,
    WheelsetSection,
)
from contactlib.scenario.control_sections import CreepSection, RunSection, TorqueSection
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
        A TOML file, or the name of a shipped one such as ``"models/roller_rig.toml"``.
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
        return build_model(parse(model_path(path)), table, progress)


def build_model(
    data: Mapping[str, Any],
    table: CreepForceTable | None,
    progress: Callable[[float], object],
) -> Model:
    """Model of a file's contents; a mistake is a ValueError of one line."""
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
    wheelset = build_wheelset(data, table, progress)
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
    table: CreepForceTable | None,
    progress: Callable[[float], object],
) -> Wheelset:
    """Wheelset of a model file's contents; a mistake is a ValueError of one line."""
    contact_section = read_section("contact", ContactSection, data)
    friction_section = read_section("friction", FrictionSection, data)
    law_section = read_section("law", LawSection, {"law": {}, **data})
    body = read_section("wheelset", WheelsetSection, data)
    with named("contact"):
        contact = contact_section.build()
    with named("friction"):
        friction = friction_section.build(contact)
    with named("law"):
        law_section.check_keys()  # also where the table is given
        if table is None:
            table = law_section.build(contact, friction, contact_section.poisson_ratio, progress)
    with named("wheelset"):
        element = ForceElement(
            contact,
            friction,
            table=table,
            radius=body.radius,
            slope_reduction=body.reduction(contact, friction),
            minimum_speed=body.minimum_speed,
        )
    return Wheelset(
        element,
        inertia=body.inertia,
        mass=body.mass,
        damping=body.damping,
        resistance=read_section("resistance", Resistance, data),
    )
