"""Friction of a brake's pads from a CSV file that a scenario names, such as one of a test bench."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from contactlib.base.csv_columns import (
    csv_numbers,
    csv_rows,
    decoded,
    name_and_unit,
    preamble_of,
    unit_factor,
)
from contactlib.base.text import known_names
from contactlib.base.writing import read_small
from contactlib.files.reading import file_beside, in_file, note_warning, subsection, text
from contactlib.vehicle.drivetrain import Brake

COLUMNS = ("speed", "pressure", "friction")
COEFFICIENT = 0.55  # of pads on their discs, at most
MAX_BYTES = 1_000_000


def with_pads(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Contents of a scenario file in `folder`, with the table that `pads` of its brake names."""
    brake = subsection("brake", data.get("brake", {}))
    if "pads" not in brake:
        return data
    name = text("brake.pads", brake["pads"])
    if lists := [key for key in map("pad_{}".format, COLUMNS) if key in brake]:
        raise ValueError(
            f"brake.pads = {name!r} replaces {' and '.join(lists)}: give either the file or the "
            "lists"
        )
    with in_file(f"brake.pads {name}"):
        table = _read(file_beside("pads", name, folder, "the scenario"))
    return {**data, "brake": {**table, **brake}}


def _read(path: Path) -> dict[str, list[float]]:
    """Columns of a CSV file, which is written as for `TractionData.from_csv`, by key of a brake."""
    content, keys = decoded(read_small(path, MAX_BYTES)), Brake.quantities()
    if preamble := preamble_of(content, ("friction",)):
        raise ValueError(preamble)
    rows = list(csv_rows(content))
    if len(rows) < 2:
        raise ValueError(f"line 1: it must name the columns {', '.join(COLUMNS)}; rows follow")
    line, head = rows[0]
    columns = csv_numbers(rows[1:], len(head), range(len(head)), head).T
    table = dict[str, list[float]]()
    for (name, unit), column in zip(map(name_and_unit, head), columns, strict=True):
        if name not in COLUMNS:
            raise ValueError(f"line {line}: no column is {name!r}; {known_names(name, COLUMNS)}")
        if f"pad_{name}" in table:
            raise ValueError(f"line {line}: two columns {name!r}")
        si = keys[f"pad_{name}"].unit
        factor = unit_factor(line, name, unit, si)
        table[f"pad_{name}"] = (factor * column).tolist()
    return table


def brake_of(*, pads: str | None = None, **given: Any) -> Brake:
    """Brake of a file's section, with doubts about what the friction of its pads is.

    Parameters
    ----------
    pads : str, optional
        CSV file with the columns speed, pressure and friction of the pads, in place of the lists:
        it lies beside the scenario or below its folder.
    """
    brake = Brake.from_times(**given)
    largest = brake.pad_scale * max(brake.pad_friction, default=1.0)
    if "pad_scale" not in given and largest <= COEFFICIENT:
        note_warning(
            "brake.pad_friction",
            f"brake: the pads' friction is at most {largest:g}, and 1 is the nominal one; are they "
            "friction coefficients? then set brake.pad_scale = 1 / the nominal coefficient, else 1",
        )
    return brake
