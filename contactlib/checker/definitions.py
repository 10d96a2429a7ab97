"""Rules on what modelDescription.xml defines beside its variables."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain

from contactlib.checker.description import Description, Type
from contactlib.checker.xml import is_true

TOKENS = {2: "guid", 3: "instantiationToken"}
# A capability, and the one it is of no use without.
NEEDED_CAPABILITIES = {
    "canSerializeFMUstate": "canGetAndSetFMUstate",
    "canSerializeFMUState": "canGetAndSetFMUState",
    "canReturnEarlyAfterIntermediateUpdate": "providesIntermediateUpdate",
}


def definition_problems(description: Description) -> Iterator[str]:
    """What is wrong with interfaces, experiment, log categories, units and types."""
    yield from _interfaces(description)
    yield from _experiment(description)
    categories = description.root.iterfind("LogCategories/Category")
    yield from repeated("log category", (category.get("name") for category in categories))
    yield from _units(description)
    yield from _types(description)


def repeated(what: str, names: Iterable[str]) -> Iterator[str]:
    """A problem for every name that stands there more than once."""
    for name, times in Counter(names).items():
        if times > 1:
            yield f'{what} "{name}" is defined {times} times, must be unique'


def unit_problems(
    where: str, attributes: Mapping[str, str], units: Mapping[str, set[str]]
) -> Iterator[str]:
    """What is wrong with the unit and the display unit of a variable or a type."""
    unit, display = attributes.get("unit"), attributes.get("displayUnit")
    if unit is not None and unit not in units:
        yield f'{where}: unit "{unit}" is not in UnitDefinitions'
    elif display is not None and unit is None:
        yield f'{where}: displayUnit "{display}" needs a unit'
    elif display is not None and unit is not None and display not in units[unit]:
        yield f'{where}: displayUnit "{display}" is not defined for unit "{unit}"'


def defined_units(description: Description) -> dict[str, set[str]]:
    """Names of the display units of each unit."""
    return {
        unit.get("name"): {each.get("name") for each in unit.iterfind("DisplayUnit")}
        for unit in description.units
    }


def _interfaces(description: Description) -> Iterator[str]:
    token = TOKENS[description.version]
    if not description.root.get(token, "").strip():
        yield f"{token} is empty"
    if not description.interfaces:
        yield "there is no interface: neither ModelExchange nor CoSimulation"
    for name, element in description.interfaces.items():
        identifier = element.get("modelIdentifier")
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", identifier):
            yield f'{name}: modelIdentifier "{identifier}" must be an identifier of C'
        for capability, other in NEEDED_CAPABILITIES.items():
            if is_true(element.get(capability)) and not is_true(element.get(other)):
                yield f"{name}: {capability} is true, so {other} must be true"
        step = element.get("fixedInternalStepSize")
        if step is not None and not 0.0 < float(step) < math.inf:
            yield f"{name}: fixedInternalStepSize {step} must be positive"


def _experiment(description: Description) -> Iterator[str]:
    if (experiment := description.root.find("DefaultExperiment")) is None:
        return
    given = dict(experiment.attrib)
    for name, value in given.items():
        if not math.isfinite(float(value)):
            yield f"DefaultExperiment: {name} {value} must be finite"
    for name in ("stepSize", "tolerance"):
        if name in given and float(given[name]) <= 0.0:
            yield f"DefaultExperiment: {name} {given[name]} must be positive"
    start = given.get("startTime", "0")
    if "stopTime" in given and float(given["stopTime"]) <= float(start):
        yield f"DefaultExperiment: stopTime {given['stopTime']} must be above startTime {start}"


def _units(description: Description) -> Iterator[str]:
    yield from repeated("unit", (unit.get("name") for unit in description.units))
    for unit in description.units:
        name = unit.get("name")
        displays = unit.findall("DisplayUnit")
        yield from repeated(
            f'unit "{name}": display unit', (display.get("name") for display in displays)
        )
        for element in chain(unit.iterfind("BaseUnit"), displays):
            what = f'unit "{name}": {element.tag} {element.get("name", "")}'.rstrip()
            factor, offset = float(element.get("factor", 1)), float(element.get("offset", 0))
            if factor == 0.0 or not math.isfinite(factor):
                yield f"{what}: factor {element.get('factor')} must be finite and not 0"
            if not math.isfinite(offset):
                yield f"{what}: offset {element.get('offset')} must be finite"
            if is_true(element.get("inverse")) and offset != 0.0:
                yield f"{what}: offset {element.get('offset')} must be 0 as inverse is true"


def _types(description: Description) -> Iterator[str]:
    yield from repeated("type", (each.name for each in description.types))
    variables = {variable.name for variable in description.variables}
    units = defined_units(description)
    for each in description.types:
        if each.name in variables:
            yield f"{each.where}: there is a variable of the same name"
        yield from unit_problems(each.where, each.attributes, units)
        yield from _items(each)


def _items(each: Type) -> Iterator[str]:
    for attribute in ("name", "value"):
        yield from repeated(
            f"{each.where}: Item {attribute}", (item.get(attribute, "") for item in each.items)
        )
