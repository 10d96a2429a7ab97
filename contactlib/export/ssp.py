"""SSP 1.0 package of the force element coupled with the body of a wheelset, ready to run.

Tools support different parts of the standard; the package uses what they have in common:

- libcosim and ecos look for fixed schema prefixes, and refuse a connection to the system itself;
  FMPy sets unconnected inputs to zero. So the default structure has no connectors of its own. A
  variant has them, for tools that can make it a part of a larger system.
- libcosim and ecos support only parameters of a component, under the component's own names; FMPy
  applies none. So each component has a parameter file, and the FMUs start from the same values
  without it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, SubElement

from contactlib.base.text import version as tool_version
from contactlib.base.writing import write_whole
from contactlib.export.description import Description, Variable
from contactlib.export.fmu_page import asset, fragment
from contactlib.export.markup import TOLERANCE, document, number
from contactlib.export.package import describe, fmu, zipped
from contactlib.export.units import UNITS

if TYPE_CHECKING:
    from contactlib.files.model import Model
from contactlib.vehicle.creep_curve import CreepCurve

Names = dict[str, tuple[str, ...]]  # names of variables by component

SYSTEM_NAME, SUBSYSTEM_NAME = "CreepForceSystem", "CreepForceSubsystem"
SYSTEM_VALUES = "resources/system.ssv"  # without which tools set open connectors to zero
CONTACT, BODY = "contact", "body"
# Connections between the components: from, variable, to.
EXCHANGE = ((BODY, "omega", CONTACT), (BODY, "speed", CONTACT), (CONTACT, "creep_force", BODY))
# Connectors of the variant to a larger system.
INPUTS: Names = {
    BODY: ("drive_torque", "brake_torque", "resistance_force"),
    CONTACT: ("normal_load", "friction_scale"),
}
OUTPUTS: Names = {BODY: ("omega", "speed"), CONTACT: ("creep_force", "creepage")}
PARAMETERS: Names = {
    BODY: INPUTS[BODY],
    CONTACT: (*INPUTS[CONTACT], "implicit", "parallel_exchange", "effective_inverse_mass"),
}

START_CREEPAGE = 0.5  # initial creepage / saturation creepage
STOP, STEP = 10.0, 5e-3  # end and step of the default experiment [s]

# All are declared at the root: libcosim mistakes an attribute of osp:Algorithm for an algorithm.
SCHEMAS = {
    "xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "xmlns:ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "xmlns:osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    "xmlns:oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
}


def export_ssp(
    model: Model,
    path: str | os.PathLike[str],
    *,
    fmi_version: int = 2,
    platforms: Sequence[str] | None = None,
    author: str | None = None,
    version: str | None = None,
) -> Path:
    """Write `model` as an SSP 1.0 package of two coupled FMUs that is ready to run.

    The force element `contact` solves its own slip over each step, so that its coupling with the
    wheelset `body` is stable at any step and any speed. Both start at the steady state of a
    constant drive torque with half the saturation creepage, or less if the force already falls
    there.

    Parameters
    ----------
    model : Model
        Gives both FMUs and the parameters of the system.
    path : path
        File to write.
    fmi_version : {2, 3}, optional
        Version of the FMI standard. Default: 2.
    platforms : sequence of str, optional
        As for `export_fmu`.
    author, version : str, optional
        As for `export_fmu`, of the package and of both FMUs.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    ValueError
        If an argument is invalid, or a platform's library is missing and there is no compiler; the
        message names the command that installs it.
    RuntimeError
        If the reference run of an FMU fails.
    """
    starts = operating_point(model)
    given: dict[str, Any] = {"author": author, "version": version}
    contact = describe(model, "force_element", True, True, **given)
    contact = replace(contact, whole_wheelset=True)
    body = describe(model, "wheelset_body", False, False, **given)
    parts = {CONTACT: replace(contact, starts=starts), BODY: replace(body, starts=starts)}
    files = {
        "SystemStructure.ssd": _structure(SYSTEM_NAME, model, parts, closed=True),
        "Subsystem.ssd": _structure(SUBSYSTEM_NAME, model, parts, closed=False),
    }
    for name, part in parts.items():
        files[_fmu_path(part)] = fmu(part, fmi_version, platforms)
        files[_values_path(name)] = _values([(part, part.by_name[v]) for v in PARAMETERS[name]])
    inputs = [(parts[name], parts[name].by_name[v]) for name in INPUTS for v in INPUTS[name]]
    files[SYSTEM_VALUES] = _values(inputs)
    files["documentation/index.html"] = _page(model, parts)
    return write_whole(path, zipped(files))


def operating_point(model: Model) -> dict[str, float]:
    """Start values of a steady state on the rising branch."""
    wheelset, speed = model.wheelset, model.initial_speed
    curve = CreepCurve(wheelset, speed=speed)
    # If friction falls with slip speed, the creepage of the peak decreases with speed.
    saturation = wheelset.element.saturation_creepage
    creepage = min(START_CREEPAGE * saturation, 0.5 * curve.peak.creepage)
    element, omega = wheelset.element, (1.0 + creepage) * speed / wheelset.radius
    held = element.rolling_native.steady_memory(omega, speed, element.axle_load, 1.0)
    return {
        "drive_torque": float(curve.torque(creepage)),
        "omega": omega,
        "creep_force": held["held_force"],
        **held,
    }


def _fmu_path(part: Description) -> str:
    return f"resources/{part.model_name}.fmu"


def _values_path(name: str) -> str:
    return f"resources/{name}.ssv"


def _metadata(part: Description) -> dict[str, str]:
    """Metadata of a file: the version is that of the standard."""
    given = {"author": part.author, "fileversion": part.version}
    return {
        "version": "1.0",
        **{key: value for key, value in given.items() if value is not None},
        "license": "MIT",
        "generationTool": f"contactlib {tool_version()}",
    }


def _structure(name: str, model: Model, parts: dict[str, Description], *, closed: bool) -> bytes:
    """The system structure, either closed or with connectors to a larger system."""
    outside, visible = ({}, {}) if closed else (INPUTS, OUTPUTS)
    about = _metadata(parts[CONTACT])
    root = Element("ssd:SystemStructureDescription", {**SCHEMAS, **about, "name": name})
    root.set("description", f"{model.name}: wheel on rail")
    system = SubElement(root, "ssd:System", name="system")
    if not closed:
        _add_connectors(system, [*_variables(parts, INPUTS), *_variables(parts, OUTPUTS)])
        _bind(system, SYSTEM_VALUES)
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
    _add_master(system)
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
    _bind(component, _values_path(name))


def _bind(element: Element, values: str) -> None:
    bindings = SubElement(element, "ssd:ParameterBindings")
    SubElement(bindings, "ssd:ParameterBinding", source=values)


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
        base = UNITS[name].base or {}
        SubElement(unit, "ssc:BaseUnit", {key: str(power) for key, power in base.items()})


def _add_master(system: Element) -> None:
    """Add OMSimulator's annotation of the kind of a system: a master that steps all at once.

    It reads only the first annotation of a system.
    """
    annotations = SubElement(system, "ssd:Annotations")
    annotation = SubElement(annotations, "ssc:Annotation", type="org.openmodelica")
    information = SubElement(SubElement(annotation, "oms:Annotations"), "oms:SimulationInformation")
    tolerance = number(TOLERANCE)
    SubElement(
        information,
        "oms:FixedStepMaster",
        description="oms-ma",
        stepSize=number(STEP),
        absoluteTolerance=tolerance,
        relativeTolerance=tolerance,
    )


def _add_algorithm(experiment: Element) -> None:
    """Add the step that libcosim uses by default; without it libcosim ends the program."""
    annotations = SubElement(experiment, "ssd:Annotations")
    annotation = SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    algorithm = SubElement(annotation, "osp:Algorithm")
    SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=number(STEP))


def _values(variables: Sequence[tuple[Description, Variable]]) -> bytes:
    """The parameter file of a component or of the system, with its external inputs."""
    spaces = {key: SCHEMAS[key] for key in ("xmlns:ssv", "xmlns:ssc")}
    about = _metadata(variables[0][0])
    # Both components' sets have the same name, by which ecos applies them.
    root = Element("ssv:ParameterSet", {**spaces, **about, "name": "parameters"})
    parameters = SubElement(root, "ssv:Parameters")
    for part, v in variables:
        parameter = SubElement(parameters, "ssv:Parameter", name=v.name, description=v.description)
        typed = SubElement(parameter, "ssv:Boolean" if v.boolean else "ssv:Real")
        typed.set("value", _start(part, v))
        if not v.boolean:
            typed.set("unit", v.unit)
    _add_units(SubElement(root, "ssv:Units"), [v for _, v in variables])
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
    omega = parts[CONTACT].starts["omega"]
    page = fragment(
        "ssp.html",
        model_name=escape(model.name),
        source=escape(model.source),
        version=tool_version(),
        style=asset("page.css"),
        icon=asset("icon.svg"),
        speed=f"{model.initial_speed:.5g}",
        creepage=f"{100.0 * (omega * model.wheelset.radius / model.initial_speed - 1.0):.4g}",
        step=f"{1e3 * STEP:g}",
        rows="\n".join(rows),
    )
    return page.encode("ascii", "xmlcharrefreplace")
