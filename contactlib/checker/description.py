"""modelDescription.xml of FMI 2.0 and 3.0 in one form, so that each rule is written once.

It is only read once it is valid against its schema, so attributes are present and numbers are
numbers.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

FILE = "modelDescription.xml"
INTERFACES = ("ModelExchange", "CoSimulation", "ScheduledExecution")
FLOATS = ("Real", "Float32", "Float64")
FMI2_TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")
PARAMETERS = ("parameter", "calculatedParameter", "structuralParameter")

# Element of ModelStructure and what is in it: FMI 2.0, FMI 3.0.
STRUCTURE = {
    "outputs": ("Outputs", "Output"),
    "derivatives": ("Derivatives", "ContinuousStateDerivative"),
    "initial_unknowns": ("InitialUnknowns", "InitialUnknown"),
    "clocked_states": ("none", "ClockedState"),
    "event_indicators": ("none", "EventIndicator"),
}


def fmi_version(root: Any) -> int:
    """2 or 3.

    Raises
    ------
    ValueError
        If it is another version, or no model description.
    """
    if root.tag != "fmiModelDescription":
        raise ValueError(f"the root element is {root.tag}, must be fmiModelDescription")
    version = root.get("fmiVersion", "missing")
    if version != "2.0" and not version.startswith("3."):
        raise ValueError(f"fmiVersion is {version}, must be 2.0 or 3.0")
    return int(version[0])


class Type(NamedTuple):
    """A type that variables may declare."""

    name: str
    kind: str
    attributes: Mapping[str, str]
    items: tuple[Mapping[str, str], ...]

    @property
    def where(self) -> str:
        """Words that name it."""
        return f'type "{self.name}"'


@dataclass(frozen=True)
class Variable:
    """A variable; `key` is what ModelStructure and `derivative` name it by."""

    name: str
    line: int
    key: int
    reference: int
    kind: str
    own: Mapping[str, str]
    declared: Type | None
    start: tuple[str, ...] | None
    aliases: tuple[Mapping[str, str], ...]
    dimensions: tuple[Mapping[str, str], ...]

    @property
    def where(self) -> str:
        """Words that name it."""
        return f'variable "{self.name}" (line {self.line})'

    @cached_property
    def attributes(self) -> Mapping[str, str]:
        """Own attributes, and those of the declared type where there is no own one."""
        declared = {} if self.declared is None else dict(self.declared.attributes)
        return ChainMap(dict(self.own), declared)

    @property
    def causality(self) -> str:
        """As given, or its default."""
        return self.own.get("causality", "local")

    @property
    def variability(self) -> str:
        """As given, or its default."""
        if (given := self.own.get("variability")) is not None:
            return given
        return "continuous" if self.kind in FLOATS else "discrete"

    @property
    def initial(self) -> str | None:
        """As given, or its default; None where the standard has none."""
        if (given := self.own.get("initial")) is not None:
            return given
        if self.kind == "Clock" or self.causality == "independent":
            return None
        if self.causality in ("parameter", "structuralParameter", "input"):
            return "exact"
        return "exact" if self.variability == "constant" else "calculated"

    @property
    def is_continuous_float(self) -> bool:
        """Whether it may be a state, its derivative or an event indicator."""
        return self.kind in FLOATS and self.variability == "continuous"

    @property
    def is_clocked(self) -> bool:
        """Whether it changes with clocks only."""
        return "clocks" in self.own

    @property
    def derivative(self) -> int | None:
        """Key of the variable that this one is the derivative of."""
        given = self.own.get("derivative")
        return None if given is None else int(given)


class Unknown(NamedTuple):
    """An entry of ModelStructure."""

    line: int
    key: int
    dependencies: list[int] | None
    kinds: list[str] | None


class Description:
    """What the rules need to know of a valid modelDescription.xml."""

    def __init__(self, root: Any) -> None:
        self.root = root
        self.version = fmi_version(root)
        self.interfaces = {name: e for name in INTERFACES for e in root.iterfind(name)}
        self.types = [self._type(element) for element in root.iterfind("TypeDefinitions/*")]
        self.units = list(root.iterfind("UnitDefinitions/Unit"))
        by_name = {each.name: each for each in self.types}
        listed = [e for e in root.iterfind("ModelVariables/*") if isinstance(e.tag, str)]
        self.variables = [self._variable(i, e, by_name) for i, e in enumerate(listed, start=1)]
        self.by_key = {each.key: each for each in self.variables}
        self.structure = {name: self._unknowns(*tags) for name, tags in STRUCTURE.items()}

    def structure_name(self, name: str) -> str:
        """What the standard calls an element of ModelStructure."""
        return f"ModelStructure/{STRUCTURE[name][self.version - 2]}"

    @cached_property
    def states(self) -> set[int]:
        """Keys of the continuous states, as far as ModelStructure lists their derivatives."""
        listed = (self.by_key.get(unknown.key) for unknown in self.structure["derivatives"])
        return {v.derivative for v in listed if v is not None and v.derivative is not None}

    def _type(self, element: Any) -> Type:
        typed = element
        if self.version == 2:
            typed = next(child for child in element if child.tag in FMI2_TYPES)
        items = tuple(dict(item.attrib) for item in typed.iterfind("Item"))
        kind = typed.tag.removesuffix("Type")
        return Type(element.get("name"), kind, dict(typed.attrib), items)

    def _variable(self, index: int, element: Any, types: Mapping[str, Type]) -> Variable:
        typed, own = element, dict(element.attrib)
        if self.version == 2:
            typed = next(child for child in element if child.tag in FMI2_TYPES)
            own |= typed.attrib
            own.setdefault("variability", "continuous")
        elif own.get("causality") in PARAMETERS:
            own.setdefault("variability", "fixed")
        start = None
        if "start" in own:
            start = (own["start"],) if self.version == 2 else tuple(own["start"].split())
        elif listed := element.findall("Start"):
            start = tuple(each.get("value", "") for each in listed)
        reference = int(own["valueReference"])
        return Variable(
            name=own["name"],
            line=element.sourceline,
            key=index if self.version == 2 else reference,
            reference=reference,
            kind=typed.tag,
            own=own,
            declared=types.get(own.get("declaredType", "")),
            start=start,
            aliases=tuple(dict(alias.attrib) for alias in element.iterfind("Alias")),
            dimensions=tuple(dict(each.attrib) for each in element.iterfind("Dimension")),
        )

    def _unknowns(self, fmi2: str, fmi3: str) -> list[Unknown]:
        path, key = (f"{fmi2}/Unknown", "index") if self.version == 2 else (fmi3, "valueReference")
        unknowns = []
        for element in self.root.iterfind(f"ModelStructure/{path}"):
            dependencies, kinds = element.get("dependencies"), element.get("dependenciesKind")
            unknowns.append(
                Unknown(
                    element.sourceline,
                    int(element.get(key)),
                    None if dependencies is None else [int(each) for each in dependencies.split()],
                    None if kinds is None else kinds.split(),
                )
            )
        return unknowns
