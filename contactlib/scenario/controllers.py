"""The controllers of a scenario."""

from __future__ import annotations

import difflib
import re
from typing import Any

from contactlib.drivetrain import Drivetrain
from contactlib.scenario.reading import named, read_given, subsection, text
from contactlib.traction import CONTROLLERS, Sensors, TractionController

RESERVED = ("comparison", "metrics")  # names of what a report writes of all runs


def read_controllers(
    sections: object, drivetrain: Drivetrain, speed: float, sensors: Sensors
) -> dict[str, TractionController]:
    """Controllers by name; what a section leaves out is designed for the drivetrain.

    A name becomes that of files, beside those of the report.
    """
    for name in subsection("controllers", sections):
        if not re.fullmatch(r"[A-Za-z0-9_-]+", name) or name.lower() in RESERVED:
            raise ValueError(
                f"controllers.{name} is not a name for a controller: it must be of ASCII letters, "
                f"digits, _ and -, and none of: {', '.join(RESERVED)}"
            )
    return {
        name: _read_controller(f"controllers.{name}", section, drivetrain, speed, sensors)
        for name, section in subsection("controllers", sections).items()
    }


def _read_controller(
    where: str, section: object, drivetrain: Drivetrain, speed: float, sensors: Sensors
) -> TractionController:
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
    chosen: Any = CONTROLLERS[kind]
    given = read_given(where, chosen, table, others=("kind",))
    with named(where):
        controller: TractionController = chosen.for_drivetrain(
            drivetrain, speed=speed, sensors=sensors, **given
        )
    return controller
