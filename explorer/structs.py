"""Members of the C structs for the page: all are doubles, so their names, in order."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from contactlib import kernel
from contactlib.base.writing import c_sources, write_whole

SOURCE = Path(__file__).resolve().parent
OF_DOUBLES = (
    "force_element_parameters",
    "force_element_input",
    "force_element_output",
    "contact_scales",
    "half_space_scales",
    "creep_value",
    "creep_conditions",
    "creep_point",
    "wheelset_parameters",
    "drivetrain_parameters",
    "drivetrain_state",
    "drivetrain_input",
    "drivetrain_output",
    "run_input",
    "run_row",
)


def _doubles(path: str, kind: Any) -> Iterator[str]:
    """Paths to all doubles of a type, such as ``body.radius`` and ``jacobian[0][1]``."""
    if kind.kind == "struct":
        for name, field in kind.fields:
            yield from _doubles(f"{path}.{name}", field.type)
    elif kind.kind == "array":
        for i in range(kind.length):
            yield from _doubles(f"{path}[{i}]", kind.item)
    elif kind.cname == "double":
        yield path
    else:
        raise TypeError(f"{path} is a {kind.cname}, which the page cannot read")


def struct_fields() -> dict[str, list[str]]:
    """Last names of the doubles of each struct, such as ``radius`` of ``body.radius``."""
    kernel.library()
    paths = {name: _doubles("", kernel.ffi.typeof(name)) for name in OF_DOUBLES}
    return {name: [path.split(".")[-1] for path in fields] for name, fields in paths.items()}


def write_types(functions: tuple[str, ...], sections: Mapping[str, Iterable[str]]) -> None:
    """Declare structs of doubles, functions and sections of a model for the TypeScript compiler."""
    lines = ["// Written by build_page.py from the kernel's C and Python's declarations."]
    for name, members in (("Fields", struct_fields()), ("Sections", sections)):
        keys = {key: " | ".join(map(json.dumps, names)) for key, names in members.items()}
        lines += [f"export interface {name} {{", *(f"  {k}: {names};" for k, names in keys.items())]
        lines.append("}")
    lines += ["export interface Functions {", *map(_function, functions), "}"]
    write_whole(SOURCE / "kernel" / "structs.d.ts", "\n".join(lines).encode() + b"\n")


def _function(name: str) -> str:
    """A C function as TypeScript calls it: every argument is a number."""
    for path in (SOURCE / "module.c", *c_sources("*.h")):
        text = path.read_text(encoding="ascii")
        declared = re.search(rf"(\w+) \*?{name}\(([^)]*)\)", text)
        if declared:
            kind, listed = declared.groups()
            arguments = re.findall(r"(\w+)(?:\[\d*\])?(?=,|$)", listed.replace("void", ""))
            result = "void" if kind == "void" else "number"
            return f"  {name}({', '.join(f'{each}: number' for each in arguments)}): {result};"
    raise LookupError(f"no header declares {name}")
