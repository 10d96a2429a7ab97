"""Rules on the variables of modelDescription.xml."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping

from contactlib.checker.definitions import defined_units, repeated, unit_problems
from contactlib.checker.description import FLOATS, Description, Variable

UNBOUND = ("fixed", "tunable")
CHANGING = ("discrete", "continuous")
VARIABILITIES = {
    "parameter": UNBOUND,
    "structuralParameter": UNBOUND,
    "calculatedParameter": UNBOUND,
    "input": CHANGING,
    "output": ("constant", *CHANGING),
    "local": ("constant", *UNBOUND, *CHANGING),
    "independent": ("continuous",),
}
NUMBERS = (*FLOATS, "Integer", "Enumeration")
UNORDERED = ("Boolean", "String", "Binary", "Clock")
# Types of FMI 2.0 that the same functions get and set, so that they share value references.
BASE_TYPES = {"Enumeration": "Integer"}


def variable_problems(description: Description) -> Iterator[str]:
    """What is wrong with single variables, and with what they are to each other."""
    variables, units = description.variables, defined_units(description)
    aliases = (alias["name"] for variable in variables for alias in variable.aliases)
    yield from repeated("variable", [*(variable.name for variable in variables), *aliases])
    yield from _references(description)
    independent = [v.name for v in variables if v.causality == "independent"]
    if len(independent) > 1 or (description.version == 3 and not independent):
        limit = "exactly one" if description.version == 3 else "at most one"
        yield f"{len(independent)} variables have causality independent, must be {limit}"
    for variable in variables:
        for problem in (
            *_kind(variable, description.version),
            *_start(variable, description.version),
            *_declared_type(variable),
            *_values(variable),
            *_size(variable, description.by_key),
            *_relations(variable, description),
        ):
            yield f"{variable.where}: {problem}"
        yield from unit_problems(variable.where, variable.attributes, units)
        for alias in variable.aliases:
            yield from unit_problems(
                f'{variable.where}, alias "{alias["name"]}"',
                {**variable.attributes, **alias},
                units,
            )


def _kind(variable: Variable, version: int) -> Iterator[str]:
    """Type, causality, variability and initial."""
    causality, variability, initial = variable.causality, variable.variability, variable.initial
    if variability not in (allowed := VARIABILITIES[causality]):
        yield f"variability {variability} must be {' or '.join(allowed)} for causality {causality}"
    if variability == "continuous" and variable.kind not in FLOATS:
        yield f"variability continuous is not for type {variable.kind}"
    if causality == "independent" and variable.kind not in FLOATS:
        yield f"causality independent is not for type {variable.kind}"
    if variable.kind == "Clock" and causality not in ("input", "output", "local"):
        yield f"causality {causality} is not for type Clock"
    given = variable.own.get("initial")
    if given is not None and (
        causality == "independent" or (causality == "input" and version == 2)
    ):
        yield f"initial {given} is not for causality {causality}"
        return
    allowed = {
        "parameter": ("exact",),
        "structuralParameter": ("exact",),
        "calculatedParameter": ("calculated", "approx"),
        "input": ("exact",),
    }.get(causality, ("exact", "approx", "calculated"))
    if causality in ("output", "local"):
        if variability == "constant":
            allowed = ("exact",)
        elif variability in UNBOUND:
            allowed = ("calculated", "approx")
    if initial is not None and initial not in allowed:
        yield (
            f"initial {initial} must be {' or '.join(allowed)} for causality {causality} and "
            f"variability {variability}"
        )


def _start(variable: Variable, version: int) -> Iterator[str]:
    """Whether there is a start value where there must be one, and only there."""
    if variable.kind == "Clock":
        return
    initial, causality = variable.initial, variable.causality
    if variable.start is None:
        reason = None
        if initial in ("exact", "approx"):
            reason = f"initial {initial}"
        if causality in ("input", "parameter", "structuralParameter"):
            reason = f"causality {causality}"
        if reason:
            yield f"start is missing, must be given for {reason}"
    elif causality == "independent":
        yield "start is not for causality independent"
    elif initial == "calculated":
        yield "start is not for initial calculated"


def _declared_type(variable: Variable) -> Iterator[str]:
    if (name := variable.own.get("declaredType")) is None:
        return
    if variable.declared is None:
        yield f'declaredType "{name}" is not in TypeDefinitions'
    elif variable.declared.kind != variable.kind:
        yield f'declaredType "{name}" is for {variable.declared.kind}, must be for {variable.kind}'


def _values(variable: Variable) -> Iterator[str]:
    """Order of min, start and max; sense of the others."""
    given = variable.attributes
    if (nominal := given.get("nominal")) is not None and not 0.0 < float(nominal) < math.inf:
        yield f"nominal {nominal} must be positive and finite"
    if variable.kind in UNORDERED:
        return
    number = float if variable.kind in FLOATS else int
    low, high = given.get("min"), given.get("max")
    if low is not None and high is not None and not number(low) <= number(high):
        yield f"min {low} must not be above max {high}"
    for start in variable.start or ():
        value = number(start)
        if low is not None and not value >= number(low):
            yield f"start {start} must not be below min {low}"
        if high is not None and not value <= number(high):
            yield f"start {start} must not be above max {high}"
        if math.isnan(value):
            yield "start NaN must be a number"
        if variable.kind == "Enumeration" and variable.declared is not None:
            items = [int(item["value"]) for item in variable.declared.items]
            if value not in items:
                yield f'start {start} is no Item of type "{variable.declared.name}"'


def _size(variable: Variable, by_key: Mapping[int, Variable]) -> Iterator[str]:
    """Dimensions of an array, and how many start values it takes."""
    size = 1
    for dimension in variable.dimensions:
        if (length := dimension.get("start")) is None:
            reference = dimension.get("valueReference", "missing")
            other = by_key.get(int(reference)) if reference.isdigit() else None
            if other is None or other.kind != "UInt64" or not other.start:
                yield f"Dimension: valueReference {reference} is no UInt64 variable with a start"
                return
            if other.variability != "constant" and other.causality != "structuralParameter":
                yield f'Dimension: "{other.name}" must be constant or a structuralParameter'
            length = other.start[0]
        if int(length) < 1:
            yield f"Dimension {length} must be at least 1"
        size *= int(length)
    count = 1 if variable.start is None else len(variable.start)
    if count not in (1, size):
        yield f"start has {count} values, must have {size}{'' if size == 1 else ' or 1'}"


def _relations(variable: Variable, description: Description) -> Iterator[str]:
    """Variables that this one names by their keys."""
    by_key = description.by_key
    if (key := variable.derivative) is not None:
        state = by_key.get(key)
        if state is None:
            yield f"derivative {key}: there is no such variable"
        elif state is variable:
            yield f"derivative {key} is the variable itself"
        elif not state.is_continuous_float or not variable.is_continuous_float:
            yield f'derivative {key}: it and "{state.name}" must be continuous and floating point'
    if variable.own.get("reinit") in ("true", "1") and variable.key not in description.states:
        yield "reinit is for continuous states only"
    for reference in variable.own.get("clocks", "").split():
        clock = by_key.get(int(reference))
        if clock is None or clock.kind != "Clock":
            yield f"clocks: value reference {reference} is no Clock"
    if (previous := variable.own.get("previous")) is not None:
        other = by_key.get(int(previous))
        if other is None or other.kind != variable.kind or other is variable:
            yield f"previous {previous}: there is no other variable of type {variable.kind} there"
        if not variable.is_clocked:
            yield f"previous {previous} is for variables with clocks only"


def _references(description: Description) -> Iterator[str]:
    """Value references: unique in FMI 3.0; in FMI 2.0 those of aliases are the same."""
    groups = defaultdict(list)
    for variable in description.variables:
        base = BASE_TYPES.get(variable.kind, variable.kind) if description.version == 2 else ""
        groups[base, variable.reference].append(variable)
    for (_, reference), group in groups.items():
        if len(group) < 2:
            continue
        names = ", ".join(f'"{variable.name}"' for variable in group)
        said = f"value reference {reference} of variables {names}"
        if description.version == 3:
            yield f"{said} must be unique"
            continue
        if len({variable.attributes.get("unit") for variable in group}) > 1:
            yield f"{said}: aliases must have the same unit"
        constant = [variable for variable in group if variable.variability == "constant"]
        if constant and (len(constant) < len(group) or len({v.start for v in group}) > 1):
            yield f"{said}: aliases of a constant must be constants of the same start value"
        elif not constant and sum(variable.start is not None for variable in group) > 1:
            yield f"{said}: at most one alias may have a start value"
