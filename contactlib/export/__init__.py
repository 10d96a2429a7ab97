"""Assemble an FMU: a zip of libraries, table, description and what a person finds in it.

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

from contactlib import kernel
from contactlib.export import documentation, fmi2, fmi3
from contactlib.export.description import MODEL_NAMES, Description
from contactlib.export.platforms import binaries
from contactlib.export.reference_run import EXPERIMENTS, reference_run
from contactlib.files import package_folder, write_whole
from contactlib.parameters import Limits, checked

if TYPE_CHECKING:
    from contactlib.scenario import Model

__all__ = ["MODEL_NAMES", "export_fmu"]

START_VALUES_VERSION = 2
RELAXATION_LENGTHS = Limits(at_least=1e-6, at_most=1e3)  # as in fmu/model.c [m]


def export_fmu(
    model: Model,
    path: str | os.PathLike[str],
    *,
    fmi_version: int = 2,
    kind: str = "force_element",
    platforms: Sequence[str] | None = None,
    relaxation_length: float | None = None,
    implicit: bool = False,
    parallel_exchange: bool = False,
) -> Path:
    """Write `model` as an FMU for model exchange and co-simulation.

    Parameters
    ----------
    model : Model
        Gives parameters, table and start values.
    path : path
        The file to write.
    fmi_version : {2, 3}, optional
        Version of the standard.
    kind : {"force_element", "wheelset", "wheelset_body"}, optional
        What to export: the creep force for given velocities; the wheelset with its creep force,
        for a given drive torque; or the wheelset for a given creep force.
    platforms : sequence of str, optional
        FMI 3 platform tuples, such as ``"x86_64-linux"``, or ``["all"]``; this machine's if left
        out.
    relaxation_length : float, optional
        Distance rolled in which the force follows the creepage [m]; it adds a state. Left out, the
        force follows at once.
    implicit, parallel_exchange : bool, optional
        Start values of the force element's parameters of these names: whether it solves its own
        slip over a step, and whether both sides of the coupling step at once.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        If an argument is unknown or does not go with the kind, or a platform's library is not
        built; the message names the command that builds it.
    """
    data = _fmu(
        _description(model, kind, relaxation_length, implicit, parallel_exchange),
        fmi_version,
        platforms,
    )
    return write_whole(path, data)


def _description(
    model: Model,
    kind: str,
    relaxation_length: float | None,
    implicit: bool,
    parallel_exchange: bool,
) -> Description:
    if kind not in kernel.MODEL_KINDS:
        raise ValueError(f"kind = {kind!r} must be one of: {', '.join(kernel.MODEL_KINDS)}")
    if relaxation_length is not None:
        checked("relaxation_length", relaxation_length, RELAXATION_LENGTHS)
        if kind == "wheelset_body":
            raise ValueError(
                f"relaxation_length = {relaxation_length!r} goes with a contact, not with {kind!r}"
            )
    if (implicit or parallel_exchange) and kind != "force_element":
        name = "implicit" if implicit else "parallel_exchange"
        raise ValueError(f"{name} = True goes with kind = 'force_element', not with {kind!r}")
    return Description(
        model,
        kind,
        relaxation_length=relaxation_length or 0.0,
        implicit=implicit,
        parallel_exchange=parallel_exchange,
    )


def _fmu(description: Description, fmi_version: int, platforms: Sequence[str] | None) -> bytes:
    """The FMU's bytes."""
    if fmi_version not in (2, 3):
        raise ValueError(f"fmi_version = {fmi_version!r} must be 2 or 3")
    stop, step = EXPERIMENTS[description.kind]
    sources = _sources(fmi_version)
    compiled = [name for name in sources if name.endswith(".c")]
    icon = documentation.icon()
    files: dict[str, bytes] = {}
    if fmi_version == 2:
        files["modelDescription.xml"] = fmi2.model_description(description, compiled, stop, step)
        files["model.png"] = icon
    else:
        files["modelDescription.xml"] = fmi3.model_description(description, stop, step)
        files["sources/buildDescription.xml"] = fmi3.build_description(description, compiled)
        files["terminalsAndIcons/terminalsAndIcons.xml"] = fmi3.terminals_and_icons(description)
        files["terminalsAndIcons/icon.png"] = icon
    files |= binaries(platforms, fmi_version, description.model_name)
    files |= {f"sources/{name}": data for name, data in sources.items()}
    files["resources/start_values.bin"] = _start_values_file(description)
    if description.has_contact:
        table = description.model.wheelset.element.table
        files["resources/creep_table.bin"] = table.data
        files["resources/creep_table.csv"] = documentation.readable_table(table)
    files["documentation/index.html"] = documentation.index_page(description)
    files["documentation/licenses/license.txt"] = documentation.licence_text()
    files["documentation/reference_run.csv"] = reference_run(description)
    return _zip(files)


def _sources(fmi_version: int) -> dict[str, bytes]:
    """The C sources that this version of the standard needs, by name.

    The headers of the standard are the importer's.
    """
    other = f"fmi{5 - fmi_version}.c"
    paths = sorted(package_folder("fmu").glob("*.[ch]"))
    found = {path.name: path.read_bytes() for path in paths if path.name != other}
    # What the build sets by a flag; see fmu/token.h.
    found["token_value.h"] = f'#define CONTACTLIB_TOKEN "{kernel.token()}"\n'.encode()
    return found


def _start_values_file(description: Description) -> bytes:
    """Values in the order of the list of variables; read by fmu/component.c."""
    ordered = list(description.start_values.values())
    body = struct.pack(f"<{len(ordered)}d", *ordered)
    return kernel.framed(b"CREEPVAL", START_VALUES_VERSION, body)


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
