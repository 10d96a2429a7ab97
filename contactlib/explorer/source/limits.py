"""Units and limits of a model file's numbers, as the page's own reader needs them."""

from __future__ import annotations

import math
from typing import Any

from contactlib.parameters import Parameters, Quantity
from contactlib.scenario.control_sections import CreepSection, RunSection, TorqueSection
from contactlib.scenario.model import VEHICLE_SECTIONS

SECTIONS: dict[str, type[Parameters]] = {
    **VEHICLE_SECTIONS,
    "run": RunSection,
    "torque_control": TorqueSection,
    "creep_control": CreepSection,
}
BOUNDS = ("above", "at_least", "below", "at_most")


def _limit(quantity: Quantity) -> dict[str, Any]:
    bounds = {name: getattr(quantity, name) for name in BOUNDS}
    finite = {name: bound for name, bound in bounds.items() if math.isfinite(bound)}
    return {"unit": quantity.unit, **finite}


def limits() -> dict[str, dict[str, Any]]:
    """By section and key: unit and bounds; a bound that is infinite is left out."""
    return {
        f"{section}.{key}": _limit(quantity)
        for section, kind in SECTIONS.items()
        for key, quantity in kind.quantities().items()
    }
