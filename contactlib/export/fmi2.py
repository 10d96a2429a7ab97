"""modelDescription.xml of FMI 2.0."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from contactlib.export.description import Description, Unknown
from contactlib.export.markup import (
    add_default_experiment,
    add_log_categories,
    add_units,
    dependency_attributes,
    document,
    metadata,
    type_attributes,
    types_of,
    value_attributes,
    variable_attributes,
)

CAPABILITIES = {
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
    "canNotUseMemoryManagementFunctions": "true",
}


def model_description(
    description: Description, sources: Sequence[str], stop: float, step: float
) -> bytes:
    """modelDescription.xml; `sources` are C files, `stop` and `step` the experiment's [s]."""
    indicators = description.of_role("indicator")
    root = Element(
        "fmiModelDescription",
        metadata(description),
        fmiVersion="2.0",
        guid=description.token,
        numberOfEventIndicators=str(len(indicators)),
    )
    own = {
        "ModelExchange": {"completedIntegratorStepNotNeeded": "true"},
        "CoSimulation": {"canHandleVariableCommunicationStepSize": "true"},
    }
    for interface, attributes in own.items():
        element = SubElement(
            root,
            interface,
            {"modelIdentifier": description.model_name, **CAPABILITIES, **attributes},
        )
        files = SubElement(element, "SourceFiles")
        for name in sources:
            SubElement(files, "File", name=name)
    add_units(root, description)
    types = SubElement(root, "TypeDefinitions")
    for kind in types_of(description):
        SubElement(SubElement(types, "SimpleType", name=kind.name), "Real", type_attributes(kind))
    add_log_categories(root)
    add_default_experiment(root, stop, step)
    _add_variables(root, description)
    _add_structure(root, description)
    return document(root)


def _indices(description: Description) -> dict[str, int]:
    """Index of each variable in the list, counted from one."""
    return {v.name: i for i, v in enumerate(description.variables, start=1)}


def _add_variables(root: Element, description: Description) -> None:
    indices = _indices(description)
    states = [v.name for v in description.of_role("state")]
    derivatives = [v.name for v in description.of_role("derivative")]
    state_of = dict(zip(derivatives, states, strict=True))
    listed = SubElement(root, "ModelVariables")
    for v in description.variables:
        scalar = SubElement(listed, "ScalarVariable", variable_attributes(v))
        typed = value_attributes(v)
        if v.name in state_of:
            typed["derivative"] = str(indices[state_of[v.name]])
        SubElement(scalar, "Boolean" if v.boolean else "Real", typed)


def _add_structure(root: Element, description: Description) -> None:
    indices = _indices(description)
    outputs = [v for v in description.variables if v.causality == "output"]
    derivatives = description.of_role("derivative")
    initial = [v for v in (*outputs, *derivatives) if v.initial == "calculated"]
    structure = SubElement(root, "ModelStructure")
    groups: dict[str, list[Unknown]] = {
        "Outputs": description.unknowns(outputs),
        "Derivatives": description.unknowns(derivatives),
        "InitialUnknowns": description.unknowns(initial, initial=True),
    }
    for group, unknowns in groups.items():
        if not unknowns:
            continue
        parent = SubElement(structure, group)
        for unknown in sorted(unknowns, key=lambda u: u.variable.reference):
            index = {"index": str(indices[unknown.variable.name])}
            SubElement(parent, "Unknown", {**index, **dependency_attributes(unknown, indices)})
