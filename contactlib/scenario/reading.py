"""TOML in, checked parameters out.

Numbers are in SI units; a string such as ``"5 mm"`` names its unit, which must measure the same
thing. An unknown key, a missing key, a wrong type or a value out of range is a `ValueError` of one
line that names key, value and limit; `in_file` puts the file before it.
"""

from __future__ import annotations

import difflib
import os
import tomllib
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar

from contactlib.files import package_folder
from contactlib.parameters import Parameters, Quantity
from contactlib.profile import Profile
from contactlib.terminal import harmless_line

# How many SI units one of each unit is, by the SI unit of the quantity.
UNITS = {
    "1": {"%": 1e-2},
    "m": {"km": 1e3, "mm": 1e-3, "um": 1e-6},
    "s": {"ms": 1e-3, "min": 60.0},
    "kg": {"t": 1e3},
    "N": {"kN": 1e3, "MN": 1e6},
    "Pa": {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "m/s": {"km/h": 1.0 / 3.6},
    "s/m": {"h/km": 3.6},
    "N.m": {"kN.m": 1e3},
    "N.s": {"kN.s": 1e3},
    "N.m/s": {"kN.m/s": 1e3},
    "N.m/rad": {"kN.m/rad": 1e3, "MN.m/rad": 1e6},
    "N.m.s/rad": {"kN.m.s/rad": 1e3},
}


IS_SWEEP = (
    "is a sweep, neither a model nor a scenario: contactlib.load_sweep reads it and the command "
    "'contactlib sweep' runs it"
)


class ModelError(ValueError):
    """A model or scenario file that cannot be used; one line says where and why."""


def model_path(name: str | os.PathLike[str]) -> Path:
    """A file of this path or, failing that, a shipped one: ``x.toml`` or ``models/x.toml``."""
    path = Path(name)
    shipped = package_folder("models") / path.name
    meant = path in (Path(path.name), Path("models") / path.name)
    return shipped if meant and not path.exists() and shipped.is_file() else path


@contextmanager
def in_file(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn any ValueError from inside, of TOML, encoding and range alike, into a `ModelError`."""
    try:
        yield
    except ValueError as error:
        raise ModelError(harmless_line(f"{os.fspath(path)}: {error}")) from None
    except ArithmeticError:  # each number is within its limits, but not all together
        raise ModelError(f"{os.fspath(path)}: its numbers are too far apart") from None


def parse(file: Path) -> dict[str, Any]:
    """Contents of a TOML file, which may begin with the mark that some editors write."""
    return parse_text(file.read_bytes().decode("utf-8-sig"))


def parse_text(text: str) -> dict[str, Any]:
    """Contents of TOML."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("its lists or tables are nested too deeply") from None


def is_scenario(path: str | os.PathLike[str]) -> bool:
    """Whether a file has what only a scenario has.

    Raises
    ------
    ModelError, OSError
        If the file is not TOML, or cannot be read.
    """
    with in_file(path):
        return bool(
            {"vehicle", "vehicle_changes", "controllers", "demand"} & set(parse(model_path(path)))
        )


@contextmanager
def named(section: str) -> Iterator[None]:
    """Put the section's name before any ValueError from inside."""
    try:
        yield
    except ValueError as error:
        message = str(error)
        name, dot, rest = message.partition(".")
        if dot and name.isidentifier() and name[0].isupper():  # Class.argument: the key
            message = rest
        raise ValueError(f"{section}.{message}") from None


Section = TypeVar("Section", bound=Parameters)


def read_section(name: str, kind: type[Section], data: Mapping[str, Any]) -> Section:
    """Section `name` of a file, as the parameters `kind`."""
    given = read_given(name, kind, data[name])
    for field in fields(kind):  # type: ignore[arg-type]
        if field.default is MISSING and field.name not in given:
            raise ValueError(f"{name}.{field.name} is missing")
    with named(name):
        return kind(**given)


def read_given(
    name: str, kind: type[Any], table: object, others: Collection[str] = ()
) -> dict[str, Any]:
    """Values of those keys of `kind` that a section gives, checked one by one, in SI units.

    Parameters
    ----------
    name : str
        Of the section.
    kind : type
        Subclass of `Parameters`, whose fields are the keys.
    table : object
        What the file has there.
    others : collection of str, optional
        Further keys, which are left out of the answer.
    """
    table = subsection(name, table)
    declared = [field.name for field in fields(kind)]
    check_keys(f"{name}.", table, [*others, *declared], [])
    quantities, lists = kind.quantities(), kind.list_names()
    values: dict[str, Any] = {}
    for key, value in table.items():
        where = f"{name}.{key}"
        if key in others:
            continue
        if key not in quantities:
            values[key] = text(where, value)
        elif key in lists:
            if not isinstance(value, list) or not value:
                raise ValueError(f"{where} = {value!r} must be a list of at least one number")
            values[key] = tuple(number(where, entry, quantities[key]) for entry in value)
        else:
            values[key] = number(where, value, quantities[key])
    return values


def subsection(name: str, table: object) -> dict[str, Any]:
    """`table`, if it is a section."""
    if not isinstance(table, dict):
        raise ValueError(f"{name} = {table!r} must be a section: [{name}]")
    return table


def check_keys(
    prefix: str, table: Mapping[str, Any], known: Collection[str], needed: Collection[str]
) -> None:
    """Refuse a key that is not known, and the lack of one that is needed."""
    for key in table:
        if key not in known:
            close = difflib.get_close_matches(key, known, 1)
            meant = f"did you mean {close[0]!r}? " if close else ""
            raise ValueError(f"{prefix}{key} is not a known key; {meant}known: {', '.join(known)}")
    for key in needed:
        if key not in table:
            raise ValueError(f"{prefix}{key} is missing")


def text(where: str, value: object) -> str:
    """A TOML value that is a string."""
    if not isinstance(value, str):
        raise ValueError(f"{where} = {value!r} must be a string")
    return value


def number(where: str, value: object, quantity: Quantity) -> float:
    """A TOML value in SI units, within the limits."""
    found: float
    if isinstance(value, str):
        digits, _, unit = value.strip().partition(" ")
        units = {quantity.unit: 1.0, **UNITS.get(quantity.unit, {})}
        if unit not in units:
            raise ValueError(
                f"{where} = {value!r} must be a number in {quantity.unit}, "
                f"or a number and one of: {', '.join(units)}"
            )
        try:
            found = float(digits) * units[unit]
        except ValueError:
            raise ValueError(f"{where} = {value!r} does not begin with a number") from None
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            found = float(value)
        except OverflowError:
            raise ValueError(f"{where} is out of range: must be {quantity}") from None
    else:
        raise ValueError(f"{where} = {value!r} must be a number in {quantity.unit}")
    if not quantity.allow(found):
        raise ValueError(f"{where} = {value!r} is out of range: must be {quantity}")
    return found


def profile(section: Parameters, places: str, values: str) -> Profile:
    """Profile of two keys of a section; what is wrong with it is told by their names."""
    at, value = getattr(section, places), getattr(section, values)
    if len(at) != len(value):
        raise ValueError(
            f"{places} has {len(at)} and {values} {len(value)} entries: both must have as many"
        )
    try:
        return Profile(at, value)
    except ValueError as error:
        raise ValueError(f"{places}{str(error).removeprefix('at')}") from None


def one_of(section: Parameters, *keys: str) -> None:
    """Refuse a section that gives none of the keys, or more than one."""
    given = [key for key in keys if getattr(section, key) is not None]
    if len(given) != 1:
        raise ValueError(f"{' and '.join(keys)}: give exactly one of them, not {len(given)}")
