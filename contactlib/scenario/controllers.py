"""The controllers of a scenario."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from contactlib.drivetrain import Drivetrain
from contactlib.scenario.reading import read_given, subsection, text
from contactlib.traction import CONTROLLERS, Sensors, TractionController

RESERVED = ("comparison", "metrics")  # names of what a report writes of all runs


@dataclass(frozen=True)
class ControllerDesign:
    """A kind of controller with what is given of it; the rest is designed for a drivetrain.

    Attributes
    ----------
    kind : str
        One of `contactlib.traction.CONTROLLERS`.
    given : mapping
        Fields that are not to be designed.
    """

    kind: str
    given: Mapping[str, Any]

    def build(self, drivetrain: Drivetrain, speed: float, sensors: Sensors) -> TractionController:
        """The controller for a drivetrain, a speed [m/s] and sensors.

        Raises
        ------
        ValueError
            If a value is out of range, or no controller of this kind can do it.
        """
        kind = CONTROLLERS[self.kind]
        return kind.for_drivetrain(drivetrain, speed=speed, sensors=sensors, **self.given)


def read_controllers(sections: object) -> dict[str, ControllerDesign]:
    """Controllers by name, which becomes that of files, beside those of the report."""
    named_sections = subsection("controllers", sections)
    for name in named_sections:
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", name) or name.lower() in RESERVED:
            raise ValueError(
                f"controllers.{name!r} is not a name for a controller: it must be of 1 to 64 ASCII "
                f"letters, digits, _ and -, and none of: {', '.join(RESERVED)}"
            )
    if len({name.lower() for name in named_sections}) < len(named_sections):
        raise ValueError("controllers: two names differ by capital letters only, as files must not")
    return {
        name: _read_design(f"controllers.{name}", section)
        for name, section in named_sections.items()
    }


def _read_design(where: str, section: object) -> ControllerDesign:
    table = subsection(where, section)
    if "kind" not in table:
        raise ValueError(f"{where}.kind is missing; it is one of: {', '.join(CONTROLLERS)}")
    kind = text(f"{where}.kind", table["kind"])
    if kind not in CONTROLLERS:
        close = difflib.get_close_matches(kind, CONTROLLERS, 1)
        meant = f"did you mean {close[0]!r}? " if close else ""
        raise ValueError(
            f"{where}.kind = {kind!r} is not known; {meant}known: {', '.join(CONTROLLERS)}"
        )
    return ControllerDesign(kind, read_given(where, CONTROLLERS[kind], table, others=("kind",)))
