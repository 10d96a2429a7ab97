"""The force element coupled with the body of a wheelset, in a package that runs as it is (SSP 1.0).

Tools read different parts of the standard, and what is here is what they have in common:

- libcosim and ecos look for the prefixes of the schemas, whatever they stand for, and refuse a
  connection to the system itself; FMPy sets what is connected to nothing to zero. So the default
  structure has no connectors of its own, and a variant has them, for tools that can make it a part
  of a larger system.
- libcosim and ecos know parameters of a component only, by its own names; FMPy applies none. So
  there is one file for each component, and the FMUs start from the same values without it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

from contactlib.export.description import Description, Variable
from contactlib.export.documentation import version
from contactlib.export.markup import document, number
from contactlib.export.package import describe, fmu, zipped
from contactlib.export.page_sections import asset, fragment
from contactlib.export.units import UNITS
from contactlib.files import write_whole
from contactlib.stability import quasi_steady_torque

if TYPE_CHECKING:
    from contactlib.scenario import Model

Names = dict[str, tuple[str, ...]]  # of variables, by component

SYSTEM_NAME, SUBSYSTEM_NAME = "CreepForceSystem", "CreepForceSubsystem"
CONTACT, BODY = "contact", "body"
# What each hands over to the other, from and to variables of the same name.
EXCHANGE = ((BODY, "omega", CONTACT), (BODY, "speed", CONTACT), (CONTACT, "creep_force", BODY))
# What comes from outside and goes there, in the variant.
INPUTS: Names = {
    BODY: ("drive_torque", "resistance_force"),
    CONTACT: ("normal_load", "friction_scale"),
}
OUTPUTS: Names = {BODY: ("omega", "speed"), CONTACT: ("creep_force", "creepage")}
PARAMETERS: Names = {
    BODY: INPUTS[BODY],
    CONTACT: (*INPUTS[CONTACT], "implicit", "parallel_exchange", "effective_inverse_mass"),
}

START_CREEPAGE = 0.5  # of the saturation creepage
STOP, STEP = 10.0, 5e-3  # of the default experiment [s]

# All at the root: libcosim takes an attribute of osp:Algorithm for an algorithm.
SCHEMAS = {
    "xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "xmlns:ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "xmlns:osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
}
METADATA = {"version": "1.0", "license": "MIT", "generationTool": "contactlib"}


def export_ssp(
    model: Model,
    path: str | os.PathLike[str],
    *,
    fmi_version: int = 2,
    platforms: Sequence[str] | None = None,
    relaxation_length: float | None = None,
) -> Path:
    """Write `model` as a system of two FMUs that runs as it is (SSP 1.0).

    The force element `contact` solves its own slip over each step, so that its coupling with the
    wheelset `body` is stable at any step and any speed. Both start where a constant drive torque
    holds half the saturation creepage, or less of it if the force falls there already.

    Parameters
    ----------
    model : Model
        Gives both FMUs and the parameters of the system.
    path : path
        The file to write.
    fmi_version : {2, 3}, optional
        Version of the FMUs' standard.
    platforms : sequence of str, optional
        As for `export_fmu`.
    relaxation_length : float, optional
        Distance rolled in which the force follows the creepage [m]; it adds a state to `contact`.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        If an argument is unknown or out of range, or a platform's library is not built; the
        message names the command that builds it.
    """
    starts = operating_point(model)
    contact = describe(model, "force_element", relaxation_length, True, True)
    body = describe(model, "wheelset_body", None, False, False)
    parts = {CONTACT: replace(contact, starts=starts), BODY: replace(body, starts=starts)}
    files = {
        "SystemStructure.ssd": _structure(SYSTEM_NAME, model, parts, closed=True),
        "Subsystem.ssd": _structure(SUBSYSTEM_NAME, model, parts, closed=False),
    }
    for name, part in parts.items():
        files[_fmu_path(part)] = fmu(part, fmi_version, platforms)
        files[_values_path(name)] = _values(name, part)
    files["documentation/index.html"] = _page(model, parts)
    return write_whole(path, zipped(files))


def operating_point(model: Model) -> dict[str, float]:
    """Start values at which the creepage stays as it is, on the rising branch."""
    wheelset, speed = model.wheelset, model.initial_speed
    element = wheelset.element
    creepage = START_CREEPAGE * element.saturation_creepage
    # Where friction falls with slip speed, the peak is at less the faster the wheel rolls.
    while element.at_creepage(creepage, speed=speed)["force_gradient"] <= 0.0:
        creepage *= 0.5
    return {
        "drive_torque": float(quasi_steady_torque(wheelset, creepage, speed=speed)),
        "omega": (1.0 + creepage) * speed / wheelset.radius,
        "creep_force": float(element.at_creepage(creepage, speed=speed)["creep_force"]),
        "relaxed_creepage": creepage,
    }


def _fmu_path(part: Description) -> str:
    return f"resources/{part.model_name}.fmu"


def _values_path(name: str) -> str:
    return f"resources/{name}.ssv"


def _structure(name: str, model: Model, parts: dict[str, Description], *, closed: bool) -> bytes:
    """The structure, either closed or with connectors for what comes from outside."""
    outside, visible = ({}, {}) if closed else (INPUTS, OUTPUTS)
    root = Element("ssd:SystemStructureDescription", {**SCHEMAS, **METADATA, "name": name})
    root.set("description", f"{model.name}: wheel on rail")
    system = SubElement(root, "ssd:System", name="system")
    if not closed:
        _add_connectors(system, [*_variables(parts, INPUTS), *_variables(parts, OUTPUTS)])
    elements = SubElement(system, "ssd:Elements")
    for part, description in parts.items():
        taken = [v for _, v, to in EXCHANGE if to == part]
        shown = [*taken, *outside.get(part, ()), *OUTPUTS[part]]
        _add_component(elements, part, description, [description.by_name[v] for v in shown])
    connections = SubElement(system, "ssd:Connections")
    for start, v, end in EXCHANGE:
        _connect(connections, v, startElement=start, endElement=end)
    for group, side in ((outside, "endElement"), (visible, "startElement")):
        for part, names in group.items():
            for v in names:
                _connect(connections, v, **{side: part})
    exchanged = [v for group in (outside, OUTPUTS) for v in _variables(parts, group)]
    _add_units(SubElement(root, "ssd:Units"), exchanged)
    experiment = SubElement(root, "ssd:DefaultExperiment", startTime="0", stopTime=number(STOP))
    _add_algorithm(experiment)
    return document(root)


def _variables(parts: dict[str, Description], names: Names) -> list[Variable]:
    return [parts[part].by_name[v] for part in names for v in names[part]]


def _add_component(
    elements: Element, name: str, description: Description, variables: Sequence[Variable]
) -> None:
    attributes = {
        "name": name,
        "type": "application/x-fmu-sharedlibrary",
        "source": _fmu_path(description),
        "implementation": "CoSimulation",
    }
    component = SubElement(elements, "ssd:Component", attributes)
    _add_connectors(component, variables)
    bindings = SubElement(component, "ssd:ParameterBindings")
    SubElement(bindings, "ssd:ParameterBinding", source=_values_path(name))


def _add_connectors(element: Element, variables: Iterable[Variable]) -> None:
    connectors = SubElement(element, "ssd:Connectors")
    for v in variables:
        attributes = {"name": v.name, "kind": v.causality, "description": v.description}
        connector = SubElement(connectors, "ssd:Connector", attributes)
        SubElement(connector, "ssc:Real", unit=v.unit)


def _connect(connections: Element, variable: str, **elements: str) -> None:
    ends = {"startConnector": variable, "endConnector": variable}
    SubElement(connections, "ssd:Connection", {**elements, **ends})


def _add_units(parent: Element, variables: Iterable[Variable]) -> None:
    for name in sorted({v.unit for v in variables if v.type is not None}):
        unit = SubElement(parent, "ssc:Unit", name=name)
        exponents = {key: str(power) for key, power in UNITS[name].base.items()}
        SubElement(unit, "ssc:BaseUnit", exponents)


def _add_algorithm(experiment: Element) -> None:
    """What libcosim needs when it is not told a step: else it ends, and the program with it."""
    annotations = SubElement(experiment, "ssd:Annotations")
    annotation = SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    algorithm = SubElement(annotation, "osp:Algorithm")
    SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=number(STEP))


def _values(name: str, part: Description) -> bytes:
    """The file of a component's parameters, and of its inputs from outside."""
    variables = [part.by_name[v] for v in PARAMETERS[name]]
    spaces = {key: SCHEMAS[key] for key in ("xmlns:ssv", "xmlns:ssc")}
    # One name for the sets of both: ecos asks which to apply.
    root = Element("ssv:ParameterSet", {**spaces, **METADATA, "name": "parameters"})
    parameters = SubElement(root, "ssv:Parameters")
    for v in variables:
        parameter = SubElement(parameters, "ssv:Parameter", name=v.name, description=v.description)
        typed = SubElement(parameter, "ssv:Boolean" if v.boolean else "ssv:Real")
        typed.set("value", _start(part, v))
        if not v.boolean:
            typed.set("unit", v.unit)
    _add_units(SubElement(root, "ssv:Units"), variables)
    return document(root)


def _start(part: Description, variable: Variable) -> str:
    value = part.start_values[variable.name]
    return number(bool(value) if variable.boolean else value)


def _page(model: Model, parts: dict[str, Description]) -> bytes:
    """documentation/index.html of the package, in ASCII."""
    rows = [
        f'<tr><th scope="row"><code>{part}.{v.name}</code></th><td>{escape(v.unit)}</td>'
        f"<td>{_start(parts[part], v)}</td><td>{escape(v.description)}</td></tr>"
        for part in parts
        for v in (parts[part].by_name[name] for name in PARAMETERS[part])
    ]
    page = fragment(
        "ssp.html",
        model_name=escape(model.name),
        source=escape(model.source),
        version=version(),
        style=asset("page.css"),
        icon=asset("icon.svg"),
        speed=f"{model.initial_speed:.5g}",
        creepage=f"{100.0 * parts[CONTACT].starts['relaxed_creepage']:.4g}",
        step=f"{1e3 * STEP:g}",
        rows="\n".join(rows),
    )
    return page.encode("ascii", "xmlcharrefreplace")
