"""The kernel without FMI: one C file and its header, with a model's table and parameters in them.

The module joins the C sources in ``fmu/`` in the order of their inclusion, without the parts that
``ONE_FILE_KERNEL`` excludes, and makes their functions static.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlib import kernel
from contactlib.base.text import printable_line, version
from contactlib.base.writing import c_sources, write_whole
from contactlib.element.force_element import ForceElement
from contactlib.export.description import MEMORY, Description
from contactlib.export.fmu_page import ASSETS
from contactlib.export.package import describe
from contactlib.laws.hertz import EllipticContact
from contactlib.table.building import HEADER_SIZE

if TYPE_CHECKING:
    from contactlib.files.model import Model

SOURCES = (
    "creep_table.c",
    "hertz.c",
    "half_space.c",
    "lateral_spin_force.c",
    "force_element.c",
    "wheelset.c",
    "wheelset_step.c",
    "force_element_model.c",
)
# Types that the header defines under these names. That of the element is the header's own: it has
# only those members that the functions above use.
PUBLIC = {
    "force_element_parameters": "contactlib_parameters",
    "rolling_memory": "contactlib_rolling_memory",
    "lateral_memory": "contactlib_lateral_memory",
    "force_element_input": "contactlib_input",
    "force_element_output": "contactlib_output",
    "slip_memory": "contactlib_memory",
    "model_values": "contactlib_element",
}
KEPT_FROM_IT = re.compile(
    r"^#ifndef ONE_FILE_KERNEL\n.*?^#endif /\* ONE_FILE_KERNEL \*/\n", re.DOTALL | re.MULTILINE
)


def export_kernel(model: Model, folder: str | os.PathLike[str]) -> Path:
    """Write the creep force of `model` as C source, for programs that do not import FMUs.

    The folder then holds ``contactlib.c``, ``contactlib.h`` and ``example.c``. The code is C99 and
    C++, reads no file, allocates nothing, and gives the numbers of the model's force element FMU.
    ``Contactlib.cs`` calls it from C#.

    Parameters
    ----------
    model : Model
        Gives table and parameters; the force is that of one wheel.
    folder : path
        Where to write; made if it is missing.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    files = kernel_files(describe(model, "force_element", True, False))
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        write_whole(folder / name, text.encode("ascii", "replace"))
    return folder


def kernel_files(description: Description) -> dict[str, str]:
    """Text of each file, by its name."""
    templates = {path.name: path.read_text() for path in sorted((ASSETS / "kernel").iterdir())}
    structs, sources = joined()
    checks, start = _limits_and_start(description)
    smallest = re.findall(r"#define MIN_FRICTION_SCALE (\S+)", _source("force_element.h"))
    filled = {
        # Neither end nor begin a comment in a comment.
        "text": printable_line(description.text).replace("*/", "* /").replace("/*", "/ *"),
        "version": version(),
        "carriers": description.carriers,
        "tolerance": re.findall(r"DEFAULT_TOLERANCE = ([\w-]+)", _source("component.c"))[0],
        "csharp": _csharp(),
        "structs": structs.replace("MIN_FRICTION_SCALE", smallest[0]),
        "kernel": sources,
        "data": _data(description),
        "start": start,
        "shape": _shape_checks(description.element),
        **checks,
    }
    return {
        name: re.sub(r"@(\w+)@", lambda match: filled[match[1]], text)
        for name, text in templates.items()
    }


# ---- the sources ---------------------------------------------------------------------------------


def joined() -> tuple[str, str]:
    """The structs of the interface under its names, and the sources behind them."""
    seen = {"export.h"}
    text = "".join(line for name in SOURCES for line in _lines(name, seen))
    functions = r"(?m)^(?:CONTACTLIB_API |(?=(?:void |double |const char \*)\w+\())"
    text = re.sub(functions, "static ", text)
    structs = []
    for name, public in PUBLIC.items():
        comment = r"(?:/\*(?:(?!\*/).)*\*/\n)?"
        pattern = re.compile(rf"{comment}typedef struct \{{[^}}]*\}} {name};", re.DOTALL)
        structs += pattern.findall(text)
        text = pattern.sub(f"typedef {public} {name};", text)
    *shown, _ = (
        re.sub(rf"\b{name};$", f"{public};\n", struct)
        for struct, (name, public) in zip(structs, PUBLIC.items(), strict=True)
    )
    inside = re.compile(r"\b(rolling|lateral)_memory (?=\w+;)")
    return inside.sub(r"contactlib_\1_memory ", "\n".join(shown)), text


def _source(name: str) -> str:
    (path,) = c_sources(name)
    return path.read_text(encoding="ascii")


def _lines(name: str, seen: set[str]) -> Iterator[str]:
    """Lines of a source, in which each include becomes the lines of its file, once."""
    for line in KEPT_FROM_IT.sub("", _source(name)).splitlines(keepends=True):
        included = re.match(r'#include ["<](.*)[">]', line)
        if included is None:
            yield line
        elif included[1] not in seen:
            seen.add(included[1])
            yield from [line] if "<" in line else _lines(included[1], seen)


def _csharp() -> str:
    """The structs in C#. They are doubles throughout, so that nothing is copied in a call."""
    structs = []
    for name in ("force_element_parameters", "force_element_input", "force_element_output"):
        text = f"public double {', '.join(_doubles(name))};"
        members = "\n".join(wrap(text, 98, initial_indent=8 * " ", subsequent_indent=12 * " "))
        public = name.removeprefix("force_element_").capitalize()
        structs.append(f"    public struct {public} {{\n{members}\n    }}\n")
    size = kernel.ffi.sizeof("slip_memory")
    layout = f"[StructLayout(LayoutKind.Sequential, Size = {size})]"
    structs.append(
        f"    {layout}\n    public struct Memory {{\n        public double known;\n    }}\n"
    )
    return "\n".join(structs)


def _doubles(struct: str) -> Iterator[str]:
    """Names of the numbers of a struct, with those of an array counted from zero."""
    for field, (kind, *_) in (kernel.struct_dtype(struct).fields or {}).items():
        count = int(np.prod(kind.shape, dtype=int))
        yield from [field] if not kind.shape else (f"{field}_{i}" for i in range(count))


def _members(kind: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Names of a struct's numbers, and where they are in it, such as `memory.held_force`."""
    for name, member in kind.fields:
        if member.type.kind == "struct":
            yield from _members(member.type, f"{path}{name}.")
        else:
            yield name, f"{path}{name}"


# ---- the model -----------------------------------------------------------------------------------


def _limits_and_start(description: Description) -> tuple[dict[str, str], str]:
    """Checks of parameters, inputs and what else is given, by their place; and start values."""
    structs = {"p": "force_element_parameters", "in": "force_element_input", "e": "model_values"}
    checks: dict[str, list[str]] = {struct: [] for struct in structs}
    start = []
    for v in kernel.model_variables("force_element"):
        if v.role not in kernel.GIVEN:
            continue
        members = {s: dict(_members(kernel.ffi.typeof(name))) for s, name in structs.items()}
        struct = next((s for s in ("p", "in") if v.name in members[s]), "e")
        member = members[struct][v.name]
        low, high, value = v.limits.at_least, v.limits.at_most, f"{struct}->{member}"
        fits, either = f"{value} >= {low!r} && {value} <= {high!r}", ""
        if v.name in (*MEMORY, "softening_temperature", "layer_compliance"):
            fits, either = f"{value} == 0.0 || ({fits})", "0 or "
        checks[struct].append(
            f"    if (!({fits}))\n"
            f'        return "{v.name} must be {either}from {low:g} to {high:g}";'
        )
        place = {"p": "contact.", "in": "input.", "e": ""}[struct]
        start.append(f"    element->{place}{member} = {description.start_values[v.name]!r};")
    return {f"limits_{s}": "\n".join(lines) for s, lines in checks.items()}, "\n".join(start)


def _shape_checks(element: ForceElement) -> str:
    """Checks of what the constants hold for one contact only, as in fmu/fmi/component.c."""
    contact = element.contact
    stiffness = contact.tangential_modulus / contact.contact_modulus
    held = [
        ("elliptic", "p->elliptic", element.parameters["elliptic"]),
        ("softening", "p->softening", element.parameters["softening"]),
        ("poisson_ratio", "p->poisson_ratio", contact.poisson_ratio),
        ("contact_modulus over body_modulus", "p->contact_modulus / p->body_modulus", stiffness),
    ]
    if isinstance(contact, EllipticContact):
        shape = "p->semi_width / p->transverse_half_length"
        aspect = contact.semi_axis_x / contact.semi_axis_y
        held.append(("semi_width over transverse_half_length", shape, aspect))
    lines = []
    for i, (name, value, expected) in enumerate(held):
        if_used = "" if i < 2 else "p->memory > 0.0 && "
        lines.append(
            f"    if ({if_used}!(fabs({value} - {expected!r}) <= {1e-9 * abs(expected)!r}))\n"
            f'        return "{name} must be {expected:.10g}, that of the exported contact";'
        )
    return "\n".join(lines)


def _data(description: Description) -> str:
    """The table, and its data for lateral and spin force, as constants."""
    element, struct = description.element, description.native_contact.struct
    layers = element.table.layer_bytes
    table = element.table.data[HEADER_SIZE:].removesuffix(layers)
    numbers = {"TABLE_DATA": table, "LATERAL_SPIN_DATA": b""}
    if description.spins:
        count = 8 * kernel.library().LATERAL_SPIN_COEFFICIENTS
        numbers["LATERAL_SPIN_DATA"] = element.lateral_spin_data[-count:]
    names = {name: name if data else "NULL" for name, data in numbers.items()}
    arrays = "".join(_array(name, data) for name, data in numbers.items() if data)
    names["LAYER_DATA"] = "NULL"
    if layers:
        names["LAYER_DATA"] = "LAYER_DATA"
        arrays += _array("LAYER_DATA", layers, np.float32)
    contact = _initializer(struct.lateral_spin[0], {"coefficients": names["LATERAL_SPIN_DATA"]})
    known = {
        "coefficients": names["TABLE_DATA"],
        "layer_coefficients": names["LAYER_DATA"],
        "lateral_spin": "&LATERAL_SPIN",
        "bodies": "NULL",
        "rails": "NULL",
    }
    return (
        f"{arrays}static const lateral_spin_contact LATERAL_SPIN = {contact};\n\n"
        f"static const creep_table TABLE = {_initializer(struct[0], known)};\n"
    )


def _array(name: str, data: bytes, kind: type[np.floating[Any]] = np.float64) -> str:
    """An array of doubles or floats, in the fewest digits that keep every bit."""
    numbers, short = np.frombuffer(data, kind), kind is np.float32
    text = ", ".join(f"{v!s}{'f' * short}" for v in numbers)
    lines = wrap(text, 98, break_long_words=False, break_on_hyphens=False)
    c_type = "float" if short else "double"
    return f"static const {c_type} {name}[{numbers.size}] = {{\n" + "\n".join(lines) + "};\n\n"


def _initializer(struct: Any, pointers: dict[str, str]) -> str:
    """A struct of the kernel with its numbers; its pointers have these values."""
    values = []
    for name, field in kernel.ffi.typeof(struct).fields:
        if field.type.kind == "pointer":
            values.append(pointers[name])
        elif field.type.kind == "struct":
            values.append(_initializer(getattr(struct, name), pointers))
        elif field.type.kind == "array":
            values.append(f"{{{', '.join(map(repr, getattr(struct, name)))}}}")
        else:
            values.append(repr(getattr(struct, name)))
    return f"{{{', '.join(values)}}}"
