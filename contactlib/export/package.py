"""What an FMU consists of, put together: libraries, table, description and what a person reads.

No compiler is needed. The kernel's own list of variables gives names, units, limits and value
references; the start values stand beside the table in ``resources/``, where the library reads
them, and in modelDescription.xml, where the tool does.
"""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Sequence
from typing import TYPE_CHECKING

from contactlib import kernel
from contactlib.export import documentation, fmi2, fmi3
from contactlib.export.description import Description
from contactlib.export.platforms import binaries
from contactlib.export.reference_run import EXPERIMENTS, reference_run
from contactlib.files import package_folder
from contactlib.parameters import checked, shown

if TYPE_CHECKING:
    from contactlib.scenario import Model

START_VALUES_VERSION = 2


def describe(
    model: Model,
    kind: str,
    relaxation_length: float | None,
    implicit: bool,
    parallel_exchange: bool,
) -> Description:
    """A checked description; the parameters are those of `contactlib.export_fmu`."""
    if kind not in kernel.MODEL_KINDS:
        raise ValueError(f"kind = {kind!r} must be one of: {', '.join(kernel.MODEL_KINDS)}")
    if relaxation_length is not None:
        limits = {v.name: v.limits for v in kernel.model_variables("force_element")}
        checked("relaxation_length", relaxation_length, limits["relaxation_length"])
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


def fmu(description: Description, fmi_version: int, platforms: Sequence[str] | None) -> bytes:
    """The FMU's bytes."""
    if not (isinstance(fmi_version, int) and fmi_version in (2, 3)):
        raise ValueError(f"fmi_version = {shown(fmi_version)} must be 2 or 3")
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
    return zipped(files)


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


def zipped(files: dict[str, bytes]) -> bytes:
    """Zip whose bytes depend on its contents alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o755 << 16 if name.startswith("binaries/") else 0o644 << 16
            archive.writestr(entry, data)
    return buffer.getvalue()
