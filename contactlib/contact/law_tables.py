"""Tables by the name of their law: shipped ones are read, others are built once per process."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from contactlib.base.quantities import checked_number
from contactlib.base.writing import PACKAGE
from contactlib.contact.friction import EXPONENTIAL, Weakening
from contactlib.contact.laws.carter_griffith import CarterGriffith
from contactlib.contact.laws.cohesive import CohesiveZone
from contactlib.contact.table import CreepForceTable

Shape = Literal["line", "elliptic"]


def _silent(part: float) -> None:
    """Report no progress."""


def shipped_path(contact: Shape) -> Path:
    """File of a shipped table."""
    return PACKAGE / "contact" / "tables" / f"carter_griffith_{contact}.bin"


@lru_cache
def carter_griffith_table(contact: Shape) -> CreepForceTable:
    """The shipped table of the Carter-Griffith law."""
    return CreepForceTable.load(shipped_path(contact))


def build_carter_griffith_table(
    contact: str, progress: Callable[[float], object] = _silent
) -> CreepForceTable:
    """Build that table from the law, which takes seconds."""
    return CreepForceTable.from_law(CarterGriffith, contact=contact, progress=progress)


_cohesive: dict[tuple[str, float, Weakening], CreepForceTable] = {}


def cohesive_table(
    contact: Shape,
    static_to_kinetic: float,
    weakening: Weakening = EXPONENTIAL,
    progress: Callable[[float], object] = _silent,
) -> CreepForceTable:
    """Table of the cohesive-zone law for one friction ratio; building takes seconds."""
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
