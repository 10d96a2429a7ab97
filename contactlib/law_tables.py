"""Tables by the name of their law: shipped ones are read, others are built once a process."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from contactlib.files import PACKAGE
from contactlib.friction import EXPONENTIAL, Weakening
from contactlib.laws import CarterGriffith, CohesiveZone
from contactlib.parameters import checked_number
from contactlib.table import CreepForceTable

Shape = Literal["line", "elliptic"]


def _silent(part: float) -> None:
    """Report to nobody."""


def shipped_path(contact: Shape) -> Path:
    """File of a shipped table."""
    return PACKAGE / "tables" / f"carter_griffith_{contact}.bin"


@lru_cache
def carter_griffith_table(contact: Shape) -> CreepForceTable:
    """The shipped table of the Carter-Griffith law."""
    return CreepForceTable.load(shipped_path(contact))


def build_carter_griffith_table(
    contact: str, progress: Callable[[float], object] = _silent
) -> CreepForceTable:
    """The same table from the law itself: a second for the line, some for the ellipse."""
    return CreepForceTable.from_law(CarterGriffith, contact=contact, progress=progress)


_cohesive: dict[tuple[str, float, Weakening], CreepForceTable] = {}


def cohesive_table(
    contact: Shape,
    static_to_kinetic: float,
    weakening: Weakening = EXPONENTIAL,
    progress: Callable[[float], object] = _silent,
) -> CreepForceTable:
    """Table of the cohesive-zone law for one friction ratio; it takes some tens of seconds."""
    static_to_kinetic = checked_number(
        "static_to_kinetic", static_to_kinetic, CohesiveZone.quantities()["static_to_kinetic"]
    )
    key = (contact, static_to_kinetic, weakening)
    if key not in _cohesive:
        options: dict[str, Any] = {} if weakening is EXPONENTIAL else {"weakening": weakening}
        _cohesive[key] = CreepForceTable.from_law(
            CohesiveZone,
            contact=contact,
            static_to_kinetic=static_to_kinetic,
            progress=progress,
            **options,
        )
    return _cohesive[key]
