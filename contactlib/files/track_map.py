"""Friction and grade over distance from a CSV file that a scenario names, such as a survey's."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from contactlib.base.csv_columns import (
    cell_number,
    csv_numbers,
    csv_rows,
    decoded,
    name_and_unit,
    preamble_of,
    unit_factor,
)
from contactlib.base.quantities import declared
from contactlib.base.text import known_names
from contactlib.base.writing import read_small
from contactlib.files.rail_conditions import found_condition, placeholder_lists
from contactlib.files.reading import file_beside, in_file, note_warning, text
from contactlib.vehicle.track import FACTOR, GRADIENT, LISTS, RAILS, Track

COLUMNS = ("distance", *LISTS, "condition")
ALIASES = {"position": "distance", "gradient": "grade"}
ONE_IN = re.compile(r"1\s*(?:in|:)\s*[a-z]?")  # unit of a grade by the length of a rise of 1
COEFFICIENT = 0.5  # of dry rails, at most
FASTEST = 50.0  # a speed limit above this without a unit is probably in km/h [m/s]
MAX_MAP_BYTES = 10_000_000  # some 500 000 rows, which Python reads in a few seconds


def read_track_map(path: Path, *, sections: bool = False) -> dict[str, Any]:
    """Read the breakpoints of a track.

    Parameters
    ----------
    path : Path
        A CSV file, written as for `TractionData.from_csv`. Its first line names the columns, which
        are those lists of `Track.from_breakpoints` that are over distance, and `condition`.
        ``position`` and ``gradient`` are other names of distance and grade, which may be in
        ``1 in x``.
    sections : bool, optional
        Whether each row begins a section, so that a blank cell has the value of the row before.

    Returns
    -------
    dict
        The lists by name [m, 1, m/s]; and that they are factors if a column of friction has a unit.

    Raises
    ------
    ValueError
        If the file has another content; the message is one line that names line and column.
    OSError
        If the file cannot be read.
    """
    content = decoded(read_small(path, MAX_MAP_BYTES))
    for first in ("distance", "position"):
        if preamble := preamble_of(content, (first,)):
            raise ValueError(preamble)
    rows = list(csv_rows(content))
    head = rows[0][1] if rows else []
    if not head or any(cell_number(cell) is not None for cell in head):
        raise ValueError(f"line 1: it must name the columns; known are {', '.join(COLUMNS)}")
    line, body = rows[0][0], rows[1:]
    names = [ALIASES.get(name, name) for name, _ in map(name_and_unit, head)]
    for name in names:
        if name not in COLUMNS:
            raise ValueError(f"line {line}: no column is {name!r}; {known_names(name, COLUMNS)}")
        if names.count(name) > 1:
            raise ValueError(f"line {line}: {names.count(name)} columns {name!r}")
    if not body:
        raise ValueError(f"line {line}: no data after the columns' names")
    whole = [row for row in body if len(row[1]) >= len(head)]  # csv_numbers names another one
    _fill_blanks(whole, names, sections)
    by_length = {i for i, cell in enumerate(head) if names[i] == "grade" and _is_one_in(cell)}
    for i, (_, cells) in product(by_length, whole):
        if cells[i].lower() == "level":
            cells[i] = "inf"
    places = [i for i, name in enumerate(names) if name != "condition"]
    table = csv_numbers(body, len(head), places, [head[i] for i in places])
    keys = {key: parameter.quantity for key, parameter in declared(Track.from_breakpoints).items()}
    values, known = dict[str, Any](), dict[str, str]()
    for i, column in zip(places, table.T, strict=True):
        cell, name = head[i], names[i]
        limits, unit, given = keys[name] or FACTOR, name_and_unit(cell)[1], column.tolist()
        if i in by_length:
            if not column.all():
                zero = body[int(np.flatnonzero(column == 0.0)[0])][0]
                raise ValueError(f"line {zero}: {cell} must not be 0; write 'level' where it is")
            column, unit = 1.0 / column, ""
        factor = unit_factor(line, name, unit, limits.unit)
        if name == "slope" and factor != 1.0:
            raise ValueError(f"line {line}: {cell} has a unit; {GRADIENT}")
        if name == "speed_limit" and not unit:
            _check_plausible_limits(f"line {line}: ", given)
        bad = np.flatnonzero(~limits.allows(factor * column))
        if bad.size:
            place = int(bad[0])
            raise ValueError(
                f"line {body[place][0]}: {cell} = {given[place]!r} is out of range: must "
                f"be {limits}" + (f"; {limits.hint}" if limits.hint else "")
            )
        values[name] = (factor * column).tolist()
        if unit and name.startswith("friction"):
            known["unit"] = "factor"
    at = values.get("distance", [])
    for i in range(1, len(at)):
        twice = i > 1 and at[i] == at[i - 2]
        if at[i] < at[i - 1] or twice:
            raise ValueError(
                f"line {body[i][0]}: distance = {at[i]!r} m must be {'>' if twice else '>='} "
                f"{at[i - 1]!r} m, that of the line before, and each place at most twice"
            )
    if "condition" in names:
        named = [cells[names.index("condition")] for _, cells in body]
        found = {name: found_condition(name, path.parent) for name in dict.fromkeys(named)}
        conditions = [found[name] for name in named]
        Track.from_breakpoints(**placeholder_lists(conditions, {**known, **values}))
        return {**values, "condition": conditions}
    Track.from_breakpoints(**values)
    return {**known, **values}


def _is_one_in(cell: str) -> bool:
    return bool(ONE_IN.fullmatch(name_and_unit(cell)[1].strip()))


def _fill_blanks(
    body: Sequence[tuple[int, list[str]]], names: Sequence[str], sections: bool
) -> None:
    """Give blank cells of a table of sections the values of the row before."""
    before = [""] * len(names)
    for line, cells in body:
        for i, name in enumerate(names):
            if cells[i] or name == "distance":
                continue
            if not sections:
                raise ValueError(
                    f"line {line}: {name} is blank; if it is that of the line before, the rows "
                    "are sections: set track.between = 'steps'"
                )
            if not before[i]:
                raise ValueError(f"line {line}: {name} is blank in the first section")
            cells[i] = before[i]
        before = cells


def with_track_map(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Contents of a scenario file in `folder`, with the lists of the map that its track names."""
    track = data.get("track")
    if not isinstance(track, Mapping):
        return data
    limits = values if isinstance(values := track.get("speed_limit"), list) else []
    _check_plausible_limits("track.", [value for value in limits if isinstance(value, float | int)])
    if "map" not in track:
        names = track.get("condition", [])
        if not isinstance(names, list):
            return data
        found = [found_condition(name, folder) for name in names]
        return {**data, "track": {**track, **({"condition": found} if found else {})}}
    name = text("track.map", track["map"])
    if lists := [key for key in COLUMNS if key in track]:
        raise ValueError(
            f"track.map = {name!r} replaces {' and '.join(lists)}: give either the map or the lists"
        )
    with in_file(f"track.map {name}"):
        path = file_beside("map", name, folder, "the scenario")
        columns = read_track_map(path, sections=track.get("between") == "steps")
    return {**data, "track": {**columns, **track}}


def _check_plausible_limits(where: str, bare: Sequence[float]) -> None:
    """Doubt speed limits that a file gives without a unit."""
    largest = max(bare, default=0.0)
    if largest > FASTEST:
        note_warning(
            "track.speed_limit",
            f"{where}speed_limit = {largest:g} has no unit, so it is in m/s, where up to "
            f"{FASTEST:g} is usual; is it in km/h? then write the unit",
        )


def track_of(condition: Sequence[str] = (), **given: Any) -> Track:
    """Track of a file's section, with doubts about what its lists are."""
    given = placeholder_lists(condition, given) if condition else given
    track = Track.from_breakpoints(**given)
    sides = track.friction_left, track.friction_right or track.friction_left
    largest = max(max(side.value) for side in sides)
    if "unit" not in given and largest <= COEFFICIENT:
        note_warning(
            "track.friction",
            f"track: the factors on friction are at most {largest:g}, and 1 is the vehicle's own "
            "friction; are they friction coefficients? then set track.unit = 'coefficient', or "
            "'adhesion' for the largest traction coefficients; else 'factor'",
        )
    if "slope" in given and not any(key in given for key in RAILS[:3]):
        note_warning("track.slope", f"track: slope without friction: {GRADIENT}")
    ramps = [key for key in LISTS if _ramps(given.get("distance", ()), given.get(key, ()))]
    if "between" not in given and "speed_limit" in ramps[1:]:
        note_warning(
            "track.between",
            f"track: speed_limit changes in steps, {' and '.join(ramps[:-1])} linearly between "
            "places; is it a table of sections? then set track.between = 'steps', else 'linear'",
        )
    return track


def _ramps(at: Sequence[float], values: Sequence[float]) -> bool:
    """Whether values change from one place to another, and not only at places given twice."""
    rows = pairwise(zip(at, values, strict=False))
    return any(a != b and v != w for (a, v), (b, w) in rows)
