"""What an axis of a sweep sets: a number in a scenario's file or in that of its vehicle."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from contactlib.drivetrain import Axle
from contactlib.parameters import Parameters, Quantity
from contactlib.scenario import VEHICLE_SECTIONS, ScenarioContents
from contactlib.scenario.reading import number, subsection, text
from contactlib.scenario.scenario_sections import (
    DemandSection,
    HeldSpeedSection,
    MotorSection,
    RelaxationSection,
    ScenarioRunSection,
    TrackSection,
)
from contactlib.traction import CONTROLLERS, Sensors

SECTIONS: dict[str, type[Parameters]] = {
    "axle": Axle,
    "motor": MotorSection,
    "contact_relaxation": RelaxationSection,
    "run": ScenarioRunSection,
    "demand": DemandSection,
    "track": TrackSection,
    "held_speed": HeldSpeedSection,
    "sensors": Sensors,
}
PATH = re.compile(r"([A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)+)(?:\[(\d+)\])?")
EXAMPLES = "vehicle.wheelset.inertia, track.friction[1] or controllers.creep_pi.reference"


@dataclass(frozen=True)
class Target:
    """One number of a file, or all of a list.

    Attributes
    ----------
    path : str
        As the sweep file has it: section and key, from ``vehicle`` on for the vehicle's file.
    section : tuple of str
        Where: ``("track",)``, ``("vehicle", "wheelset")``, ``("controllers", "creep_pi")``.
    key : str
        In the section.
    index : int or None
        Place in a list, from zero; None for a number, or for a whole list.
    whole_list : bool
        Whether it is all of a list.
    quantity : Quantity
        Unit and limits.
    base : tuple of float or None
        The number or the list that the file has, in SI units; None if it has none.
    """

    path: str
    section: tuple[str, ...]
    key: str
    index: int | None
    whole_list: bool
    quantity: Quantity
    base: tuple[float, ...] | None

    @property
    def scaled(self) -> tuple[float, ...]:
        """Numbers that a factor multiplies."""
        numbers = self.base or ()
        return numbers if self.index is None else numbers[self.index : self.index + 1]

    def scale(self, factor: float) -> float | list[float]:
        """What it is times a factor."""
        numbers = [factor * number for number in self.scaled]
        return numbers if self.whole_list else numbers[0]


def find_target(path: str, contents: ScenarioContents, *, factor: bool) -> Target:
    """The number that a path names.

    Parameters
    ----------
    path : str
        Such as ``track.friction[1]``.
    contents : ScenarioContents
        Of the sweep's scenario.
    factor : bool
        Whether it is to be multiplied, not set: then the file, or the controllers' designer, has
        to give it, and a whole list will do.

    Raises
    ------
    ValueError
        If there is no such number; the message names the path.
    """
    found = PATH.fullmatch(path)
    if found is None:
        raise ValueError(f"{path!r} is not a path such as {EXAMPLES}")
    *section, key = found[1].split(".")
    index = None if found[2] is None else int(found[2])
    kind, table = _section(path, section, contents)
    quantities = kind.quantities()
    if key not in quantities:
        raise _unknown(path, key, quantities)
    quantity, base = quantities[key], None
    whole_list = key in kind.list_names() and index is None
    if key in kind.list_names():
        numbers = table.get(key)
        if not isinstance(numbers, list) or not numbers:
            raise ValueError(f"{path}: the scenario has no list of this name")
        base = tuple(number(path, entry, quantity) for entry in numbers)
        if whole_list and not factor:
            raise ValueError(
                f"{path} is a list of {len(base)}: name one entry, from {path}[0] on, or use "
                "factor_on for all of them"
            )
        if index is not None and index >= len(base):
            raise ValueError(f"{path}: the list has only {len(base)} entries, counted from zero")
    elif index is not None:
        raise ValueError(f"{path}: {found[1]} is a number, not a list")
    elif key in table:
        base = (number(path, table[key], quantity),)
    elif factor and section[0] != "controllers":
        raise ValueError(f"{path}: the file does not give the number that the factor is on")
    return Target(path, tuple(section), key, index, whole_list, quantity, base)


def _section(
    path: str, section: list[str], contents: ScenarioContents
) -> tuple[type[Any], dict[str, Any]]:
    """Kind of a section, and what the file has there."""
    data: Mapping[str, Any] = contents.data
    if section[0] == "vehicle_changes":
        meant = path.replace("vehicle_changes", "vehicle", 1)
        raise ValueError(f"{path}: say {meant}, which is with the scenario's changes")
    if section[0] == "vehicle":
        name, known, data = ".".join(section[1:]), VEHICLE_SECTIONS, contents.vehicle
    elif section[0] == "controllers":
        controllers = subsection("controllers", data["controllers"])
        name = ".".join(section[1:])
        if name not in controllers:
            raise _unknown(path, name, controllers)
        table = subsection(".".join(section), controllers[name])
        kind = text(f"controllers.{name}.kind", table.get("kind"))
        return CONTROLLERS[kind], table
    else:
        name, known = ".".join(section), SECTIONS
    if name not in known:
        names = known if section[0] == "vehicle" else [*known, "vehicle", "controllers"]
        raise _unknown(path, name, names)
    return known[name], subsection(name, data.get(name, {}))


def _unknown(path: str, word: str, known: Collection[str]) -> ValueError:
    close = difflib.get_close_matches(word, known, 1)
    meant = f"did you mean {close[0]!r}? " if close else ""
    return ValueError(f"{path}: {word!r} is not known; {meant}known: {', '.join(known)}")


def change(table: dict[str, Any], target: Target, value: float | list[float]) -> None:
    """Set a number or list in a section, copying the list that a number is in."""
    if target.index is None:
        table[target.key] = value
    else:
        table[target.key] = list(table[target.key])
        table[target.key][target.index] = value
