"""Untrusted files: what every reader must do with them, and ways to break a good one."""

from __future__ import annotations

import datetime
import json
import tomllib
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import contactlib as cl
from contactlib.base.text import LONGEST_LINE
from contactlib.base.writing import package_folder
from contactlib.element.force_element import RangeWarning
from contactlib.logs import Log, read_log

LONGEST = LONGEST_LINE + 200  # with a path before it
MODELS = package_folder("models")


def log_of_a_wheelset(path: Path) -> Log:
    return read_log(path, cl.load_scenario("dry_wet_dry.toml"))


READERS: dict[str, Callable[[Path], object]] = {
    "model": cl.load_model,
    "scenario": cl.load_scenario,
    "sweep": cl.load_sweep,
    "csv": cl.TractionData.from_csv,
    "log": log_of_a_wheelset,
    "table": cl.CreepForceTable.load,
}


def kind_of(path: Path) -> str:
    """Name of the reader of a shipped file."""
    if path.suffix == ".csv":
        return "csv"
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    return "sweep" if "axes" in data else "scenario" if "demand" in data else "model"


def refusal(kind: str, path: Path) -> str | None:
    """Read a file: None, or the message with which it was refused.

    Any other exception, and any warning but that of the physics, is the reader's defect.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", RangeWarning)
        warnings.simplefilter("ignore", cl.InputWarning)
        try:
            READERS[kind](path)
        except (ValueError, OSError) as error:
            message = str(error)
            lines = getattr(error, "lines", [message])
            for line in lines:  # one for each mistake
                assert line.isprintable(), repr(line)
                assert len(line) <= LONGEST + len(str(path))
                assert path.name in line, line
            return message
    return None


def places(data: object, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Where in a file's contents something stands."""
    if path:
        yield path
    if isinstance(data, dict):
        for key, value in data.items():
            yield from places(value, (*path, key))
    elif isinstance(data, list):
        for number, value in enumerate(data):
            yield from places(value, (*path, number))


def changed(data: dict[str, Any], path: tuple[str | int, ...], how: str, value: object) -> None:
    """Change in place what stands somewhere: replace, drop, rename or nest it."""
    *above, last = path
    holder: Any = data
    for step in above:
        holder = holder[step]
    if how == "replace":
        holder[last] = value
    elif how == "drop":
        del holder[last]
    elif how == "nest":
        holder[last] = {str(last): holder[last]}
    elif how == "rename" and isinstance(holder, dict):
        holder[str(value)] = holder.pop(last)


def toml(value: object) -> str:
    """A value in TOML, tables in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    assert isinstance(value, (int, float))
    return repr(value)


def toml_file(data: dict[str, Any]) -> str:
    """A whole file, a line for each key."""
    return "".join(f"{json.dumps(key)} = {toml(value)}\n" for key, value in data.items())
