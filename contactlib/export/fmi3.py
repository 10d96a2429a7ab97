"""modelDescription.xml, build description and terminals of FMI 3.0."""

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
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
}

# Members of the flanges: variable and kind. Both sides of a connection share the velocities; the
# force of the contact on the wheel flows out of the force element and into the body.
Flange = dict[str, tuple[str, str]]
TERMINALS: dict[str, dict[str, Flange]] = {
    "force_element": {
        "rotational_flange": {
            "angular_velocity": ("omega", "signal"),
            "torque": ("wheel_torque", "outflow"),
        },
        "translational_flange": {
            "velocity": ("speed", "signal"),
            "force": ("creep_force", "outflow"),
        },
    },
    "wheelset": {
        "rotational_flange": {
            "angular_velocity": ("omega", "signal"),
            "torque": ("drive_torque", "inflow"),
        },
        "translational_flange": {
            "velocity": ("speed", "signal"),
            "force": ("resistance_force", "outflow"),
        },
    },
    "vehicle": {
        "front_coupler": {
            "velocity": ("speed", "signal"),
            "force": ("front_coupler_force", "inflow"),
        },
        "rear_coupler": {
            "velocity": ("speed", "signal"),
            "force": ("rear_coupler_force", "outflow"),
        },
    },
    "creep_forces": {
        "contact": {
            "force_x": ("force_x", "outflow"),
            "force_y": ("force_y", "outflow"),
            "spin_moment": ("spin_moment", "outflow"),
        },
    },
    "wheelset_body": {
        "rotational_flange": {
            "angular_velocity": ("omega", "signal"),
            "torque": ("drive_torque", "inflow"),
        },
        "translational_flange": {
            "velocity": ("speed", "signal"),
            "force": ("creep_force", "inflow"),
        },
    },
}


def model_description(description: Description, stop: float, step: float) -> bytes:
    """modelDescription.xml; `stop` and `step` are those of the experiment [s]."""
    attributes = {"fmiVersion": "3.0", "instantiationToken": description.token}
    capabilities = {
        "ModelExchange": CAPABILITIES
        | {"needsCompletedIntegratorStep": str(bool(description.rails)).lower()},
        "CoSimulation": CAPABILITIES | {"canHandleVariableCommunicationStepSize": "true"},
    }
    root = begun(description, attributes, capabilities)
    types = SubElement(root, "TypeDefinitions")
    for kind in types_of(description):
        SubElement(types, "Float64Type", {"name": kind.name, **type_attributes(kind)})
    add_experiment(root, stop, step)
    _add_variables(root, description)
    _add_structure(root, description)
    return document(root)


def _add_variables(root: Element, description: Description) -> None:
    state_of = states_of(description)
    listed = SubElement(root, "ModelVariables")
    for v in description.variables:
        attributes = variable_attributes(v) | value_attributes(v)
        if v.name in state_of:
            attributes["derivative"] = str(state_of[v.name].reference)
        element = SubElement(listed, "Boolean" if v.boolean else "Float64", attributes)
        if v.size:
            SubElement(element, "Dimension", start=str(v.size))


def _add_structure(root: Element, description: Description) -> None:
    references = {v.name: v.reference for v in description.variables}
    structure = SubElement(root, "ModelStructure")
    indicators = description.unknowns(description.of_role("indicator"))
    tags = ("Output", "ContinuousStateDerivative", "InitialUnknown", "EventIndicator")
    for tag, members in zip(tags, (*unknowns(description), indicators), strict=True):
        for unknown in members:
            reference = {"valueReference": str(unknown.variable.reference)}
            SubElement(structure, tag, {**reference, **dependency_attributes(unknown, references)})


def build_description(description: Description, sources: Sequence[str]) -> bytes:
    """sources/buildDescription.xml; `sources` are the names of the C files."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    # One for any platform, and one each where C's mathematics is a separate library.
    for platform in (None, "x86_64-linux", "aarch64-linux"):
        build = SubElement(root, "BuildConfiguration", modelIdentifier=description.model_name)
        files = SubElement(build, "SourceFileSet", language="C99")
        for name in sources:
            SubElement(files, "SourceFile", name=name)
        if platform is not None:
            build.set("platform", platform)
            SubElement(build, "Library", name="m", external="true")
    return document(root)


def terminals_and_icons(description: Description) -> bytes:
    """terminalsAndIcons/terminalsAndIcons.xml: the flanges, and the place of the icon."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    view = SubElement(root, "GraphicalRepresentation")
    box = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    SubElement(view, "CoordinateSystem", {**box, "suggestedScalingFactorTo_mm": "0.1"})
    SubElement(view, "Icon", box)
    terminals = SubElement(root, "Terminals")
    owner = "vehicle" if description.rails else "wheel"
    for name, flange in TERMINALS[description.kind].items():
        terminal = SubElement(
            terminals,
            "Terminal",
            name=name,
            matchingRule="bus",
            terminalKind=f"contactlib.{name}",
            description=f"{name.replace('_', ' ')} of the {owner}",
        )
        for member, (variable, kind) in flange.items():
            SubElement(
                terminal,
                "TerminalMemberVariable",
                variableName=variable,
                memberName=member,
                variableKind=kind,
            )
    return document(root)
