"""Write kernel/structs.ts: the kernel's structs of doubles, from its C headers."""

from __future__ import annotations

import re

from contactlib import kernel
from contactlib.files import package_folder

STRUCTS = (
    "force_element_parameters",
    "force_element_input",
    "force_element_output",
    "contact_scales",
    "wheelset_parameters",
    "wheelset_rates",
    "drivetrain_parameters",
    "drivetrain_state",
    "drivetrain_input",
    "drivetrain_output",
)
HEADERS = ("force_element.h", "wheelset.h", "drivetrain.h")
TYPES = {"double": "number", "double[2][2]": "number[]"}

HEAD = """\
// The kernel's structs of doubles, written by build.py from the C headers: do not edit.
"""
FIELDS = """\
/** Names of each struct's doubles in their order. A struct within one stands before them, an array
 * behind them. */
export const FIELDS = {
"""


def camel(name: str) -> str:
    """Name of the TypeScript interface of a C struct."""
    return "".join(part.capitalize() for part in name.split("_"))


def comments(name: str) -> dict[str, str]:
    """What the header says about each field of a struct."""
    for header in HEADERS:
        text = (package_folder("fmu") / header).read_text(encoding="ascii")
        found = re.search(rf"typedef struct \{{([^}}]*)\}} {name};", text)
        if found:
            return dict(re.findall(r"(\w+)(?:\[2\])*;\s*/\* (.*?) \*/", found[1]))
    raise SystemExit(f"no header declares {name}")


def structs_source() -> str:
    """Text of kernel/structs.ts."""
    kernel.library()
    interfaces, tables = [], []
    for name in STRUCTS:
        said, lines, doubles = comments(name), [], []
        for field, given in kernel.ffi.typeof(name).fields:
            kind = given.type.cname
            if field in said:
                lines.append(f"  /** {said[field]} */\n")
            lines.append(f"  {field}: {TYPES.get(kind) or camel(kind)};\n")
            if kind == "double":
                doubles.append(f'    "{field}",\n')
        interfaces.append(f"/** {name} of the kernel. */\n")
        interfaces.append(f"export interface {camel(name)} {{\n{''.join(lines)}}}\n\n")
        tables.append(f"  {camel(name)}: [\n{''.join(doubles)}  ],\n")
    return f"{HEAD}\n{''.join(interfaces)}{FIELDS}{''.join(tables)}}} as const;\n"
