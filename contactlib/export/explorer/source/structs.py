"""What the page knows of the C structs: names for its compiler, offsets from its module.

The names come from the C headers. Only the module knows where it has put what they name.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from contactlib.base.writing import package_folder, write_whole
from contactlib.contact import kernel

SOURCE = Path(__file__).resolve().parent
OPAQUE = ("creep_table", "drivetrain_member", "patch")  # the page needs their sizes alone
OF_DOUBLES = (
    "force_element_parameters",
    "force_element_input",
    "force_element_output",
    "contact_scales",
    "half_space_scales",
    "creep_conditions",
    "creep_point",
    "wheelset_parameters",
    "wheelset_rates",
    "drivetrain_parameters",
    "drivetrain_state",
    "drivetrain_input",
    "drivetrain_output",
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


def members() -> str:
    """Lines of module.c's table: sizes of structs, and offsets of their doubles."""
    kernel.library()
    lines = [f'{{"{name}", sizeof({name})}},' for name in (*OPAQUE, *OF_DOUBLES)]
    for name in OF_DOUBLES:
        for path in _doubles("", kernel.ffi.typeof(name)):
            field = path.removeprefix(".")
            lines.append(f'{{"{name}.{field}", offsetof({name}, {field})}},')
    return "\n".join(lines) + "\n"


def write_types(functions: tuple[str, ...], sections: Mapping[str, Mapping[str, object]]) -> None:
    """Tell the compiler of the script structs of doubles, functions and sections of a model."""
    kernel.library()
    lines = ["// Written by build.py from the kernel's C.", "export interface Fields {"]
    for name in OF_DOUBLES:
        paths = _doubles("", kernel.ffi.typeof(name))
        lines.append(f"  {name}: {' | '.join(json.dumps(path.split('.')[-1]) for path in paths)};")
    lines += ["}", "export interface Functions {", *map(_function, functions), "}"]
    keys = {name: " | ".join(map(json.dumps, section)) for name, section in sections.items()}
    lines += ["export interface Sections {", *(f"  {n}: {k};" for n, k in keys.items()), "}"]
    write_whole(SOURCE / "kernel" / "structs.d.ts", "\n".join(lines).encode() + b"\n")


def _function(name: str) -> str:
    """A C function as TypeScript calls it: every argument is a number."""
    for path in (SOURCE / "module.c", *package_folder("fmu").glob("*.h")):
        text = path.read_text(encoding="ascii")
        found = re.search(rf"(\w+) \*?{name}\(([^)]*)\)", text)
        if found:
            arguments = re.findall(r"(\w+)(?=,|$)", found[2].replace("void", ""))
            result = "void" if found[1] == "void" else "number"
            return f"  {name}({', '.join(f'{each}: number' for each in arguments)}): {result};"
    raise LookupError(f"no header declares {name}")
