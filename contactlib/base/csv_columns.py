"""Reading the columns of CSV files as measuring systems and spreadsheets write them."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import chain

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.units import not_in, unit_value

PREAMBLE = 200  # lines that may come before the columns
GAPS = 8  # lines that a message names
MAX_COLUMNS = 10_000  # of a file


def decoded(data: bytes) -> str:
    """Text in UTF-8, or in the other encodings that spreadsheets write; UTF-16 needs its mark."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", errors="replace").lstrip("\ufeff")
    if b"\0" in data:
        raise ValueError(
            "line 1: the file is in UTF-16 without a byte order mark: save it as UTF-8"
        )
    try:
        return data.decode("utf-8").lstrip("\ufeff")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def csv_rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of each row, without comments and empty rows."""
    lines = text.splitlines()
    kept = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip(" \t;,") and not line.lstrip().startswith(("#", "sep="))
    ]
    if not kept:
        return
    bare = re.sub('"[^"]*"', "", kept[0][1])
    sign = next((sign for sign in "\t;," if sign in bare), " ")
    for number, line in kept:
        try:
            line = line.strip() if sign == " " else line
            row = line.split(sign)  # a tenth of the reader's time
            if sign == " " or '"' in line:
                row = next(csv.reader([line], delimiter=sign, skipinitialspace=True, strict=True))
        except csv.Error as error:
            raise ValueError(f"line {number}: {error}") from None
        if len(row) > MAX_COLUMNS:
            raise ValueError(f"line {number}: {len(row)} columns: must be <= {MAX_COLUMNS}")
        yield number, [cell.strip() for cell in row]


def name_and_unit(cell: str) -> tuple[str, str]:
    """Name and unit of a column: ``slip [%]`` and ``slip %`` are slip in per cent."""
    match = re.fullmatch(r"(.*\S)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|\s([%\u2030]))", cell)
    return (match[1], match[2] or match[3] or match[4] or "") if match else (cell, "")


def units_below(
    cells: Sequence[str], places: Sequence[int], known: Iterable[str]
) -> list[str] | None:
    """Units of some columns in a row below the names; None if the row is not one of units.

    `known` has the SI units of the columns. A cell may be empty.
    """
    below = [cells[place] if place < len(cells) else "" for place in places]
    units, si = [cell.strip("[]()") for cell in below], set(known)
    named = any(cell and cell_number(cell) is None for cell in below)  # 1 alone may be a number
    right = all(not unit or any(unit_value(unit, one) for one in si) for unit in units)
    return units if named and right else None


def unit_factor(line: int, name: str, unit: str, si: str) -> float:
    """Factor on a column in a unit, which may be empty, for its numbers in SI units."""
    factor = unit_value(unit, si) if unit else 1.0
    if factor is None:
        raise ValueError(f"line {line}: {name} {not_in(unit, si)}")
    return factor


def cell_number(cell: str) -> float | None:
    """Number in a cell, with a decimal point or a decimal comma, or None."""
    try:  # Python also reads 1_0, and the digits of any script
        return float(cell.replace(",", ".", 1)) if cell.isascii() and "_" not in cell else None
    except ValueError:
        return None


def preamble_of(text: str, columns: Sequence[str | int]) -> str | None:
    """Message on lines before the one that names the columns, or has their numbers; else None."""
    known = {column for column in columns if isinstance(column, str)}
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines()[:PREAMBLE], start=1)
        if line.strip(" \t;,") and not line.lstrip().startswith(("#", "sep="))
    ]
    for skipped, (number, line) in enumerate(lines):
        if not all(name in line for name in known):
            continue
        for sign in "\t;, ":
            cells = [cell.strip().strip('"') for cell in line.split(None if sign == " " else sign)]
            names = {*cells, *(name_and_unit(cell)[0] for cell in cells)}
            if known and known <= names:
                return _preamble(lines[:skipped], number, "names the columns")
            if not known and all(
                place <= len(cells) and cell_number(cells[place - 1]) is not None
                for place in columns
                if isinstance(place, int)
            ):  # after a row of names, and perhaps one of units
                before = lines[: skipped - 1] if skipped > 2 else []
                return _preamble(before, number, "has the first numbers")
    return None


def _preamble(lines: Sequence[tuple[int, str]], number: int, what: str) -> str | None:
    if not lines:
        return None
    first, last = lines[0][0], lines[-1][0]
    before = f"line {first} is" if first == last else f"lines {first} to {last} are"
    return (
        f"line {first}: line {number} {what}, so {before} a preamble: begin each line of it with "
        "#, or delete it"
    )


def csv_numbers(
    body: Sequence[tuple[int, list[str]]],
    width: int,
    places: Sequence[int],
    names: Sequence[str],
    blank: str = "",
) -> FloatArray:
    """Numbers of the chosen columns, a row for each line; a blank cell is the number `blank`."""
    whole = "".join(chain.from_iterable(cells for _, cells in body))
    if whole.isascii() and set(whole).isdisjoint("_,") and {len(c) for _, c in body} == {width}:
        with suppress(ValueError):  # a tenth of the time of what follows, which names the cell
            return np.array([[float(cells[p] or blank) for p in places] for _, cells in body])
    table = np.empty((len(body), len(places)))
    signs: dict[str, int] = {}  # line of the first decimal sign of each kind
    for i, (line, cells) in enumerate(body):
        if len(cells) < width or any(cells[width:]):
            hint = "; are there decimal commas? they need another separator than the comma"
            raise ValueError(
                f"line {line}: {len(cells)} values for {width} columns"
                + (hint if len(cells) == 2 * width else "")
            )
        for j, (place, name) in enumerate(zip(places, names, strict=True)):
            value = cell_number(cells[place] or blank)
            if value is None:
                others = _others(body[i:], places, blank)
                raise ValueError(f"line {line}: {name} = {cells[place]!r} is not a number{others}")
            for sign in ".,":
                if sign in cells[place]:
                    signs.setdefault(sign, line)
            if len(signs) > 1:
                raise ValueError(
                    f"line {line}: {name} = {cells[place]!r}, but line {min(signs.values())} has "
                    "another decimal sign"
                )
            table[i, j] = value
    return table


def _others(body: Sequence[tuple[int, list[str]]], places: Sequence[int], blank: str) -> str:
    """End of a message on the first of the lines without a number, which names the others."""
    lines = [
        str(line)
        for line, cells in body[1:]
        if any(p < len(cells) and cell_number(cells[p] or blank) is None for p in places)
    ]
    if not lines:
        return ""
    more = f" and {len(lines) - GAPS} more" if len(lines) > GAPS else ""
    several = "s" if len(lines) > 1 else ""
    return f"; the same in line{several} {', '.join(lines[:GAPS])}{more}"
