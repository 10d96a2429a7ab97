"""modelDescription.xml of FMI 2.0."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from contactlib.export.description import Description
from contactlib.export.markup import (
    add_experiment,
    begun,
    dependency_attributes,
    document,
    states_of,
    type_attributes,
    types_of,
    unknowns,
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
    attributes = {
        "fmiVersion": "2.0",
        "guid": description.token,
        "numberOfEventIndicators": str(len(description.of_role("indicator"))),
    }
    capabilities = {
        "ModelExchange": CAPABILITIES
        | {"completedIntegratorStepNotNeeded": str(not description.rails).lower()},
        "CoSimulation": CAPABILITIES | {"canHandleVariableCommunicationStepSize": "true"},
    }
    root = begun(description, attributes, capabilities, sources)
    types = SubElement(root, "TypeDefinitions")
    for kind in types_of(description):
        SubElement(SubElement(types, "SimpleType", name=kind.name), "Real", type_attributes(kind))
    add_experiment(root, stop, step)
    _add_variables(root, description)
    _add_structure(root, description)
    return document(root)


def _indices(description: Description) -> dict[str, int]:
    """Index of each variable in the list, counted from one."""
    return {v.name: i for i, v in enumerate(description.variables, start=1)}


def _add_variables(root: Element, description: Description) -> None:
    indices, state_of = _indices(description), states_of(description)
    listed = SubElement(root, "ModelVariables")
    for v in description.variables:
        scalar = SubElement(listed, "ScalarVariable", variable_attributes(v))
        typed = value_attributes(v)
        if v.name in state_of:
            typed["derivative"] = str(indices[state_of[v.name].name])
        SubElement(scalar, "Boolean" if v.boolean else "Real", typed)


def _add_structure(root: Element, description: Description) -> None:
    indices = _indices(description)
    structure = SubElement(root, "ModelStructure")
    groups = ("Outputs", "Derivatives", "InitialUnknowns")
    for group, members in zip(groups, unknowns(description), strict=True):
        if not members:
            continue
        parent = SubElement(structure, group)
        for unknown in sorted(members, key=lambda u: indices[u.variable.name]):
            index = {"index": str(indices[unknown.variable.name])}
            SubElement(parent, "Unknown", {**index, **dependency_attributes(unknown, indices)})
