"""What Python declares of a model file's keys, for the page's own reader of model files."""

from __future__ import annotations

import math
from dataclasses import MISSING, fields
from typing import Any

from contactlib.base.quantities import Parameters
from contactlib.base.units import SPELLINGS, UNITS
from contactlib.contact import kernel
from contactlib.files.model import RUNS, VEHICLE_SECTIONS

SECTIONS: dict[str, type[Parameters]] = {
    **{n: s for n, s in VEHICLE_SECTIONS.items() if n != "law"},
    **RUNS,
}
BOUNDS = ("above", "at_least", "below", "at_most")


def _keys(section: type[Parameters]) -> dict[str, dict[str, Any]]:
    """Of each number: unit, finite bounds, whether it is a list, and its default if it has one."""
    keys: dict[str, dict[str, Any]] = {}
    defaults = {field.name: field.default for field in fields(section)}  # type: ignore[arg-type]
    for name, quantity in section.quantities().items():
        bounds = {bound: getattr(quantity, bound) for bound in BOUNDS}
        keys[name] = {"unit": quantity.unit, "list": name in section.list_names()}
        keys[name] |= {bound: limit for bound, limit in bounds.items() if math.isfinite(limit)}
        if defaults[name] is not MISSING:
            keys[name]["default"] = defaults[name]
    return keys


def declarations() -> dict[str, Any]:
    """Values of the units, keys of the sections that every model file has, and the law's limit."""
    return {
        "units": UNITS,
        "spellings": SPELLINGS,
        "sections": {name: _keys(section) for name, section in SECTIONS.items()},
        "process_zone_limit": kernel.process_zone_limit(),
    }
