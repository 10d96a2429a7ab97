"""Assemble the force element as an FMU: a zip of the library, the table and one description.

No compiler is needed. The kernel's own list of variables gives names, units, limits and value
references; the start values stand beside the table in ``resources/``, where the library reads
them, and in modelDescription.xml, where the tool does.
"""

from __future__ import annotations

import io
import os
import struct
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from contactlib import kernel
from contactlib.files import write_whole

if TYPE_CHECKING:
    from contactlib.scenario import Model

MODEL_NAME = "CreepForceElement"
START_VALUES_VERSION = 1

# FMI 2 folder of each FMI 3 platform tuple.
FMI2_PLATFORMS = {
    "x86_64-linux": "linux64",
    "x86_64-windows": "win64",
    "x86_64-darwin": "darwin64",
}

# Exponents of the SI base units.
BASE_UNITS = {
    "1": {},
    "m": {"m": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "m/s": {"m": 1, "s": -1},
    "s/m": {"m": -1, "s": 1},
    "rad/s": {"rad": 1, "s": -1},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.s/m": {"kg": 1, "s": -1},
}

CAUSALITY = {
    "fixed_parameter": {"causality": "parameter", "variability": "fixed"},
    "tunable_parameter": {"causality": "parameter", "variability": "tunable"},
    "input": {"causality": "input", "variability": "continuous"},
    "output": {"causality": "output", "variability": "continuous"},
}


def export_fmu(
    model: Model,
    path: str | os.PathLike[str],
    *,
    fmi_version: int = 2,
    kind: str = "force_element",
    platforms: Sequence[str] | None = None,
) -> Path:
    """Write the force element of `model` as an FMI 2.0 co-simulation FMU.

    Parameters
    ----------
    model : Model
        Gives parameters, table and start values.
    path : path
        The file to write.
    fmi_version : {2}, optional
        Version of the standard.
    kind : {"force_element"}, optional
        What to export.
    platforms : sequence of str, optional
        FMI 3 platform tuples, such as ``"x86_64-linux"``; this machine's if left out.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        If an argument is unknown, or a platform's library is not built; the message names the
        command that builds it.
    """
    if fmi_version != 2:
        raise ValueError(f"fmi_version = {fmi_version!r} must be 2")
    if kind != "force_element":
        raise ValueError(f"kind = {kind!r} must be 'force_element'")
    wanted = [kernel.platform_name()] if platforms is None else list(platforms)
    files = {
        "modelDescription.xml": model_description(model),
        "resources/creep_table.bin": model.wheelset.element.table.data,
        "resources/start_values.bin": _start_values_file(model),
    }
    for name in wanted:
        if name not in FMI2_PLATFORMS:
            raise ValueError(f"platforms holds {name!r}, must be of {', '.join(FMI2_PLATFORMS)}")
        library = kernel.library_path(name)
        if not library.is_file():
            raise ValueError(
                f"platforms holds {name!r}, whose library is not built; in a checkout, "
                f"'python fmu/build_hook.py {name}' builds it"
            )
        binary = f"binaries/{FMI2_PLATFORMS[name]}/{MODEL_NAME}{library.suffix}"
        files[binary] = library.read_bytes()
    return write_whole(path, _zip(files))


def start_values(model: Model) -> dict[str, float]:
    """Start value of every parameter and input, by name, in SI units."""
    element, speed = model.wheelset.element, model.initial_speed
    inputs = {
        "omega": speed / element.radius,
        "speed": speed,
        "normal_load": element.contact.normal_load,
        "friction_scale": 1.0,
    }
    return {**element.parameters, **inputs}


def _start_values_file(model: Model) -> bytes:
    """Values in the order of the list of variables; read by fmu/fmi2.c."""
    values = start_values(model)
    ordered = [values[v.name] for v in kernel.force_element_variables() if v.role != "output"]
    body = struct.pack(f"<{len(ordered)}d", *ordered)
    return kernel.framed(b"CREEPVAL", START_VALUES_VERSION, body)


def model_description(model: Model) -> bytes:
    """modelDescription.xml of the force element for FMI 2.0 co-simulation."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=MODEL_NAME,
        guid=kernel.token(),
        description=f"Creep force of a wheel ({model.wheelset.element.table.law}): {model.name}",
        generationTool="contactlib",
        variableNamingConvention="flat",
        numberOfEventIndicators="0",
    )
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=MODEL_NAME,
        canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUstate="true",
    )
    variables = kernel.force_element_variables()
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for name in sorted({v.unit for v in variables} - {"Boolean"}):
        unit = ElementTree.SubElement(units, "Unit", name=name)
        exponents = {base: str(power) for base, power in BASE_UNITS[name].items()}
        ElementTree.SubElement(unit, "BaseUnit", exponents)
    categories = ElementTree.SubElement(root, "LogCategories")
    for category in ("logStatusWarning", "logStatusError"):
        ElementTree.SubElement(categories, "Category", name=category)
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stopTime="10", stepSize="1e-3")
    values = start_values(model)
    listed = ElementTree.SubElement(root, "ModelVariables")
    for reference, v in enumerate(variables):
        boolean = v.unit == "Boolean"
        attributes = dict(CAUSALITY[v.role])
        if boolean:
            attributes["variability"] = "discrete"
        scalar = ElementTree.SubElement(
            listed,
            "ScalarVariable",
            {
                "name": v.name,
                "valueReference": str(reference),
                "description": v.description,
                **attributes,
            },
        )
        typed = {} if boolean else {"unit": v.unit}
        if v.role != "output":
            typed["min"], typed["max"] = repr(v.limits.at_least), repr(v.limits.at_most)
            typed["start"] = repr(values[v.name])
        ElementTree.SubElement(scalar, "Boolean" if boolean else "Real", typed)
    structure = ElementTree.SubElement(root, "ModelStructure")
    for group in ("Outputs", "InitialUnknowns"):
        unknowns = ElementTree.SubElement(structure, group)
        for index, v in enumerate(variables, start=1):
            if v.role == "output":
                ElementTree.SubElement(unknowns, "Unknown", index=str(index))
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True))


def _zip(files: dict[str, bytes]) -> bytes:
    """Zip whose bytes depend on its contents alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o755 << 16 if name.startswith("binaries/") else 0o644 << 16
            archive.writestr(entry, data)
    return buffer.getvalue()
