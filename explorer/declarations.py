"""What Python declares of a model file's keys, for the page's own reader of model files."""

from __future__ import annotations

import math
from typing import Any

from contactlib import kernel
from contactlib.base.units import SPELLINGS, STANDARD_GRAVITY, UNITS
from contactlib.files.model import RUN
from contactlib.files.rail_conditions import REPLACED_BY, condition_names, load_condition
from contactlib.files.sections import CONTACTS, VEHICLE_SECTIONS, Keys
from contactlib.laws.hertz import ROLLING
from contactlib.laws.relaxation import LINE

SECTIONS: dict[str, Keys] = {
    **{name: keys for name, keys in VEHICLE_SECTIONS.items() if name != "law"},
    "run": RUN,
}
BOUNDS = ("above", "at_least", "below", "at_most")


def _keys(section: Keys) -> dict[str, dict[str, Any]]:
    """Of each number: unit, finite bounds, and its default if it has one."""
    keys: dict[str, dict[str, Any]] = {}
    for name, key in section.items():
        if key.quantity is not None:
            bounds = {bound: getattr(key.quantity, bound) for bound in BOUNDS}
            keys[name] = {"unit": key.quantity.unit}
            keys[name] |= {bound: limit for bound, limit in bounds.items() if math.isfinite(limit)}
            if not key.needed:
                keys[name]["default"] = key.default
    return keys


def _conditions() -> dict[str, dict[str, dict[str, float]]]:
    """Keys that the names of rails fill, by name and section."""
    known = map(load_condition, condition_names())
    return {of.key: {"friction": {**of.friction}, "wheelset": {**of.wheelset}} for of in known}


def declarations() -> dict[str, Any]:
    """Keys of a model file and what fills them, values of the units, limits of contact and law."""
    return {
        "units": UNITS,
        "spellings": SPELLINGS,
        "sections": {name: _keys(section) for name, section in SECTIONS.items()},
        "conditions": _conditions(),
        "replaced_by": REPLACED_BY,
        "contacts": list(CONTACTS),
        "theories": VEHICLE_SECTIONS["contact"]["theory"].choices,
        "longest_ellipse": ROLLING.at_most,
        "shortest_line": LINE.at_least,
        "gravity": STANDARD_GRAVITY,
        "process_zone_limit": kernel.process_zone_limit(),
    }
