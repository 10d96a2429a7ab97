"""XML that the descriptions of FMI 2.0 and FMI 3.0 have in common."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from contactlib.base.text import version
from contactlib.export.description import Description, Unknown, Variable
from contactlib.export.units import UNITS, Type

CATEGORIES = {
    "logStatusWarning": "a limit of the law is exceeded",
    "logStatusDiscard": "a value or a step was refused, and nothing changed",
    "logStatusError": "a call was not allowed",
}
TOLERANCE = 1e-6  # the integrator's, as in fmu/fmi/component.c


def number(value: float | bool) -> str:
    """A number or Boolean in the notation of XML."""
    return str(value).lower() if isinstance(value, bool) else repr(float(value))


def document(root: Element) -> bytes:
    """The file's bytes."""
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True))


def begun(
    description: Description,
    attributes: dict[str, str],
    capabilities: dict[str, dict[str, str]],
    sources: Sequence[str] = (),
) -> Element:
    """The description up to the units, with `attributes` of FMI's version and what each can do."""
    given = {"author": description.author, "version": description.version}
    metadata = {
        "modelName": description.model_name,
        "description": description.text,
        **{key: value for key, value in given.items() if value is not None},
        "license": "MIT",
        "generationTool": f"contactlib {version()}",
        "variableNamingConvention": "structured",
    }
    root = Element("fmiModelDescription", metadata | attributes)
    for interface, able in capabilities.items():
        element = SubElement(root, interface, {"modelIdentifier": description.model_name, **able})
        if sources:
            files = SubElement(element, "SourceFiles")
            for name in sources:
                SubElement(files, "File", name=name)
    add_units(root, description)
    return root


def states_of(description: Description) -> dict[str, Variable]:
    """The state of each derivative, by the derivative's name."""
    derivatives = [v.name for v in description.of_role("derivative")]
    return dict(zip(derivatives, description.of_role("state"), strict=True))


def unknowns(description: Description) -> tuple[list[Unknown], list[Unknown], list[Unknown]]:
    """Outputs, derivatives and what is calculated at the start, with what they depend on."""
    outputs = [v for v in description.variables if v.causality == "output"]
    derivatives = description.of_role("derivative")
    initial = [v for v in (*outputs, *derivatives) if v.initial in ("calculated", "approx")]
    return (
        description.unknowns(outputs),
        description.unknowns(derivatives),
        description.unknowns(initial, initial=True),
    )


def types_of(description: Description) -> list[Type]:
    """Types in use, sorted by name."""
    return sorted({v.type for v in description.variables if v.type is not None})


def add_units(root: Element, description: Description) -> None:
    """Units with their exponents of the base units, and display units."""
    parent = SubElement(root, "UnitDefinitions")
    for name in sorted({kind.unit for kind in types_of(description)}):
        unit = SubElement(parent, "Unit", name=name)
        base, displays = UNITS[name]
        if base is not None:
            SubElement(unit, "BaseUnit", {key: str(power) for key, power in base.items()})
        for display in displays:
            SubElement(unit, "DisplayUnit", name=display.name, factor=number(display.factor))


def type_attributes(kind: Type) -> dict[str, str]:
    """Attributes of a type's definition."""
    shown = {} if kind.display is None else {"displayUnit": kind.display.name}
    return {"quantity": kind.name, "unit": kind.unit, **shown}


def add_experiment(root: Element, stop: float, step: float) -> None:
    """The log categories of fmu/fmi/component.c, and the experiment of the reference run."""
    parent = SubElement(root, "LogCategories")
    for name, meaning in CATEGORIES.items():
        SubElement(parent, "Category", name=name, description=meaning)

    SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=number(stop),
        tolerance=number(TOLERANCE),
        stepSize=number(step),
    )


def variable_attributes(variable: Variable) -> dict[str, str]:
    """Name and role of a variable."""
    initial = {} if variable.initial is None else {"initial": variable.initial}
    return {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
        **initial,
    }


def value_attributes(variable: Variable) -> dict[str, str]:
    """Type, limits, nominal value and start of a variable."""
    kind = variable.type
    typed = {} if kind is None else {"declaredType": kind.name, **type_attributes(kind)}
    values = {
        "min": variable.minimum,
        "max": variable.maximum,
        "nominal": variable.nominal,
        "start": variable.start,
    }
    written = {key: number(value) for key, value in values.items() if value is not None}
    if variable.size and variable.start is not None:
        starts = [element.start for element in variable.elements()]
        written["start"] = " ".join(number(start) for start in starts if start is not None)
    return typed | written


def dependency_attributes(unknown: Unknown, indices: dict[str, int]) -> dict[str, str]:
    """Dependencies of an unknown, by the index of each known in the description."""
    return {"dependencies": " ".join(str(indices[name]) for name in unknown.dependencies)}
