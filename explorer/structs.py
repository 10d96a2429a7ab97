"""Members of the C structs for the page: all are doubles, so their names, in order."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

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


def struct_fields() -> dict[str, list[str]]:
    """Names of the doubles of each struct, such as ``radius`` and ``memory_by[0][1]``."""
    return {struct: list(_doubles(kernel.struct_dtype(struct))) for struct in OF_DOUBLES}


def _doubles(struct: np.dtype[np.void]) -> Iterator[str]:
    for name, (kind, *_) in (struct.fields or {}).items():
        for place in np.ndindex(kind.shape):
            yield name + "".join(f"[{i}]" for i in place)


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
