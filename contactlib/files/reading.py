"""Reading TOML files and their sections into checked parameters.

Numbers are in SI units; a string such as ``"5 mm"`` names its unit, which must have the same
dimension. An unknown key, a missing key, a wrong type or a value out of range is a line of a
`ModelError` that names key, value and limit; `in_file` prepends the file. `Mistakes` collects all.

Tried for this: msgspec stops at the first mistake, cattrs names neither value nor limit, and
pydantic, 10 MB, needs as many lines again for units, limits and close names in its messages.
"""

from __future__ import annotations

import codecs
import difflib
import os
import re
import tomllib
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path, PureWindowsPath
from typing import Any, Literal

import numpy as np

from contactlib.base.quantities import Parameter, Quantity, warn
from contactlib.base.text import known_names, printable_line
from contactlib.base.units import in_si
from contactlib.base.writing import package_folder, read_small
from contactlib.files.mistakes import MAX_LINES, Mistakes, ModelError, lines_of

IS_SWEEP = (
    "is a sweep, neither a model nor a scenario: contactlib.load_sweep reads it and the command "
    "'contactlib sweep' runs it"
)
# A key of 10 parts with dots between them. A key cannot begin after a backslash, so that a quote
# inside a string never begins another string, which would make the time quadratic in its length.
PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
LONG_KEY = re.compile(rf"(?<![\w\\-]){PART}(?:[ \t]*+\.[ \t]*+{PART}){{9}}")
# Each part of a table's name costs tomllib 1 kB and 10 us: a file of long ones, 1 GB and 10 s.
DEEP_KEY = re.compile(rf"(?<![\w\\-]){PART}(?:[ \t]*+\.[ \t]*+{PART}){{2,}}")
MAX_DEEP_KEYS = 10_000


def model_path(name: str | os.PathLike[str]) -> Path:
    """Path of a file or, if it does not exist, of a shipped one: ``x.toml`` or ``models/x.toml``.

    Raises
    ------
    FileNotFoundError
        If there is neither; the message names the file of the closest name.
    """
    path = Path(name)
    shipped = package_folder("models") / path.name
    meant = path in (Path(path.name), Path("models") / path.name)
    if meant and not path.exists() and shipped.is_file():
        return shipped
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file{near_files(path.name, path.parent)}")
    return path


def near_files(name: str, folder: Path) -> str:
    """End of a message on a file that is not there: that of the closest name, or nothing."""
    ending = Path(name).suffix or ".toml"
    places = (folder, package_folder("models"))
    known = {file.name for place in places if place.is_dir() for file in place.glob(f"*{ending}")}
    close = difflib.get_close_matches(name, sorted(known), 1)
    return f"; did you mean {close[0]}?" if close else ""


# Doubts about the file that is being read, by key, as a scenario repeats what it changes in its
# vehicle, and a list its mistake; None if no file is being read.
_WARNINGS: ContextVar[dict[str, str] | None] = ContextVar("noted", default=None)


def note_warning(key: str, text: str) -> None:
    """Warn of something once the file that is being read has been read, once for each key."""
    noted = _WARNINGS.get()
    if noted is not None:
        noted.setdefault(key, text)


def drop_warning(key: str) -> None:
    """Forget a warning about the file that is being read, which does not apply where it is used."""
    (_WARNINGS.get() or {}).pop(key, None)


@contextmanager
def in_file(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn any ValueError raised inside (TOML, encoding or range) into a `ModelError`.

    Each of its lines begins with the file. Doubts about numbers come first, as a forgotten unit may
    well be the cause of the mistakes.
    """
    place, outer = os.fspath(path), _WARNINGS.get()
    noted: dict[str, str] = {}
    token = _WARNINGS.set(None if outer is None else noted)
    try:
        yield
    except ValueError as error:
        lines = [*noted.values(), *lines_of(error)]
        if len(lines) > MAX_LINES:
            lines[MAX_LINES:] = ["there are more mistakes"]
        raise ModelError(*(printable_line(f"{place}: {line}") for line in lines)) from None
    except ArithmeticError:  # each number is within its limits, but they do not fit together
        lines = [*noted.values(), "its numbers are too far apart"]
        raise ModelError(*(printable_line(f"{place}: {line}") for line in lines)) from None
    finally:
        _WARNINGS.reset(token)
    if outer is not None:
        for key, text in noted.items():
            outer.setdefault(key, f"{place}: {text}")


@contextmanager
def loading(path: str | os.PathLike[str]) -> Iterator[None]:
    """`in_file` for a function that a user calls: it warns of what is probably not meant.

    Warns
    -----
    InputWarning
        If the file is valid, but a number is implausible for a vehicle, or a key is not used.
    """
    noted: dict[str, str] = {}
    token = _WARNINGS.set(noted)
    try:
        with in_file(path):
            yield
    finally:
        _WARNINGS.reset(token)
    for text in noted.values():
        warn(printable_line(text))


def parse(file: Path) -> dict[str, Any]:
    """Contents of a TOML file, which may begin with a byte order mark."""
    if file.suffix.lower() == ".csv":
        raise ValueError(
            'is a CSV file: a model file names it, in [law] with kind = "measured" and file = '
            f"\"{file.name}\"; 'contactlib new force' writes such a file"
        )
    return parse_text(toml_text(read_small(file)))


def toml_text(data: bytes) -> str:
    """Text of a TOML file, which is in UTF-8 and may begin with a byte order mark."""
    if b"\0" in data:
        raise ValueError("the file is in UTF-16, or no text: save it as UTF-8")
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start)
        sign = data[error.start : error.start + 1].decode("cp1252", errors="replace")
        raise ValueError(f"line {line}: {sign!r} is not in UTF-8: save the file as UTF-8") from None


def parse_text(text: str) -> dict[str, Any]:
    """Contents of TOML text."""
    if LONG_KEY.search(text):  # tomllib's time is quadratic in its length: hours for 0.2 MB
        raise ValueError("its lists or tables are nested too deeply")
    if sum(1 for _ in DEEP_KEY.finditer(text)) > MAX_DEEP_KEYS:
        raise ValueError(f"more than {MAX_DEEP_KEYS} of its keys have three parts or more")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"\(at line (\d+),", str(error))
        line = text.split("\n")[int(place[1]) - 1] if place else ""
        comma = re.search(r"=[^=\"\[]*\d,\d", line)
        hint = ": is there a decimal comma? a number has a decimal point" if comma else ""
        raise ValueError(f"{error}{hint}") from None
    except RecursionError:
        raise ValueError("its lists or tables are nested too deeply") from None


def file_kind(path: str | os.PathLike[str]) -> Literal["model", "scenario", "sweep"]:
    """Kind of a TOML file, from the keys that it has.

    Raises
    ------
    ModelError, OSError
        If the file is not TOML, or cannot be read.
    """
    with in_file(path):
        keys = set(parse(model_path(path)))
    if "axes" in keys:
        return "sweep"
    of_scenario = {"vehicle", "wheelset_changes", "controllers", "demand"}
    return "scenario" if keys & of_scenario else "model"


def shipped_files() -> dict[str, list[str]]:
    """Names of the shipped TOML files by kind: model, scenario or sweep."""
    names: dict[str, list[str]] = {"model": [], "scenario": [], "sweep": []}
    for file in sorted(package_folder("models").glob("*.toml")):
        names[file_kind(file)].append(file.name)
    return names


@contextmanager
def named(section: str) -> Iterator[None]:
    """Prepend the section's name to any ValueError raised inside."""
    try:
        yield
    except ValueError as error:
        lines = []
        for line in lines_of(error):
            name, dot, rest = line.partition(".")
            # Class.argument: the key
            is_class = dot and name.isidentifier() and name[0].isupper()
            lines.append(f"{section}.{rest if is_class else line}")
        raise ModelError(*lines) from None


def read_section(
    name: str,
    keys: Mapping[str, Parameter],
    table: object,
    others: Collection[str] = (),
    *,
    whole: bool = True,
) -> dict[str, Any]:
    """Values that a section gives, checked one by one, in SI units.

    Parameters
    ----------
    name : str
        Name of the section; empty for the whole file.
    keys : mapping
        Declarations of its keys.
    table : object
        The section as parsed.
    others : collection of str, optional
        Further keys that are allowed but not returned.
    whole : bool, optional
        Whether all required keys must be present. Default: True.
    """
    table = subsection(name, table)
    prefix, known = f"{name}." if name else "", [*others, *keys]
    values: dict[str, Any] = {}
    with Mistakes(table) as mistakes:
        for key, value in table.items():
            if key not in known:
                mistakes.of(check_keys, prefix, {key: value}, known, [])
            elif key in keys:
                values[key] = mistakes.of(read_value, prefix + key, value, keys[key])
        needed = [key for key, parameter in keys.items() if parameter.needed and whole]
        mistakes.of(check_keys, prefix, table, table, needed)
    return values


def read_value(where: str, value: object, parameter: Parameter) -> Any:
    """Value of one key, checked, in SI units."""
    quantity, choices = parameter.quantity, parameter.choices
    if not parameter.many:
        if quantity is not None:
            return number(where, value, quantity)
        if True not in choices:
            word = text(where, value)
            if choices and word not in choices:
                raise ValueError(f"{where} = {value!r} must be one of: {', '.join(choices)}")
        elif not isinstance(value, bool):
            raise ValueError(f"{where} = {value!r} must be true or false")
        return value
    of = "name" if quantity is None else "number"
    if not isinstance(value, list) or not value:
        raise ValueError(f"{where} = {value!r} must be a list of at least one {of}")
    if quantity is None:
        return tuple(value)
    if all(type(entry) is float for entry in value) and quantity.is_plain(np.array(value)):
        return tuple(value)  # as below, in a hundredth of the time
    return tuple(number(where, entry, quantity) for entry in value)


def subsection(name: str, table: object) -> dict[str, Any]:
    """Return `table` if it is a section, or raise."""
    if not isinstance(table, dict):
        raise ValueError(f"{name} = {table!r} must be a section: [{name}]")
    return table


def check_keys(
    prefix: str, table: Mapping[str, Any], known: Collection[str], needed: Collection[str]
) -> None:
    """Reject unknown keys and missing required ones."""
    unknown = [key for key in table if key not in known][: MAX_LINES + 1]
    lines = [f"{prefix}{key} is not a known key; {known_names(key, known)}" for key in unknown]
    lines += [f"{prefix}{key} is missing" for key in needed if key not in table]
    if lines:
        raise ModelError(*lines)


def text(where: str, value: object) -> str:
    """Return a TOML value if it is a string, or raise."""
    if not isinstance(value, str):
        raise ValueError(f"{where} = {value!r} must be a string")
    return value


def title(where: str, value: object) -> str:
    """Return a TOML value if it is a string of one line, as it heads reports, or raise."""
    line = text(where, value)
    if "\n" in line:
        raise ValueError(f"{where} = {value!r} must be one line")
    return line


def number(where: str, value: object, quantity: Quantity) -> float:
    """Return a TOML value in SI units, or raise if it breaks the limits."""
    si_value: float
    if isinstance(value, str):
        try:
            si_value = in_si(value, quantity.unit)
        except ValueError as error:
            raise ValueError(f"{where} = {value!r} {error}") from None
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            si_value = float(value)
        except OverflowError:
            raise ValueError(f"{where} is out of range: must be {quantity}") from None
    else:
        raise ValueError(f"{where} = {value!r} must be a number in {quantity.unit}")
    if not quantity.allow(si_value):
        hint = f"; {quantity.hint}" if quantity.hint else ""
        raise ValueError(f"{where} = {value!r} is out of range: must be {quantity}{hint}")
    if quantity.whole and si_value != int(si_value):
        raise ValueError(f"{where} = {value!r} must be a whole number")
    if text := quantity.warning(where, si_value):
        note_warning(".".join(where.split(".")[-2:]), text)
    return si_value


_referred: ContextVar[list[str] | None] = ContextVar("_referred", default=None)


@contextmanager
def referred_files() -> Iterator[list[str]]:
    """List the paths of the files that are found meanwhile beside others or below."""
    found: list[str] = []
    token = _referred.set(found)
    try:
        yield found
    finally:
        _referred.reset(token)


def file_beside(what: str, name: str, folder: Path, of: str) -> Path:
    """Resolve a file that another file refers to; reject paths outside the folder of that file.

    Parameters
    ----------
    what : str
        Key of the file, for messages.
    name : str
        Relative path, with the separators of any system.
    folder : Path
        Folder of the referring file; symbolic links must not lead out of it. If the folder lacks
        the file, a shipped one of this name is used.
    of : str
        Name of the referring file, for messages.

    Raises
    ------
    ValueError
        If there is no regular file of this name, or the path leads outside the folder.
    """
    meant = PureWindowsPath(name)  # handles drives and both kinds of separator
    if meant.anchor or ".." in meant.parts:
        raise ValueError(f"{what} must lie beside {of} or below: no absolute path, no '..'")
    for place in (folder, package_folder("models")):
        if (place / name).is_file():  # not a device or a pipe
            if not (place / name).resolve().is_relative_to(place.resolve()):
                raise ValueError(f"{what} must lie beside {of} or below: a link leads elsewhere")
            if place == folder and (found := _referred.get()) is not None:
                found.append(os.fspath(place / name))
            return place / name
    if (folder / name).exists():
        what = "a folder" if (folder / name).is_dir() else "a pipe or a device"
        raise ValueError(f"is {what}, not a file")
    near = near_files(meant.name, folder)
    raise ValueError(f"no such file, neither beside {of} nor among the shipped models{near}")
