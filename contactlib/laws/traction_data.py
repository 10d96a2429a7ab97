"""Measured traction: creepage against traction coefficient, from arrays or a CSV file."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.csv_columns import (
    cell_number,
    csv_numbers,
    csv_rows,
    decoded,
    name_and_unit,
    preamble_of,
    unit_factor,
    units_below,
)
from contactlib.base.quantities import (
    FINITE,
    POSITIVE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    shown,
    warn,
)
from contactlib.base.text import known_names, printable_line
from contactlib.base.units import unit_value
from contactlib.base.writing import read_small
from contactlib.laws.hertz import WHEEL_LOAD
from contactlib.laws.zero_offset import zero_offset

SI = {"creepage": "1", "traction_coefficient": "1", "speed": "m/s"}
COLUMNS = tuple(SI)
ABOUT_ZERO = 0.1  # scatter of a traction coefficient there, over the largest
LARGEST = Limits(at_least=-5.0, at_most=5.0)  # traction coefficients; tyres on strips have 5
HALF = 0.05  # creepage beyond which no real contact still has less than half of its traction
LOWEST = 0.005  # of the largest traction coefficients that rails have
ONE_SIGN = "both are positive in traction and negative in braking"


@dataclass(frozen=True, eq=False, init=False)
class TractionData:
    """Points measured on a creep curve.

    Parameters
    ----------
    creepage : array_like
        zeta [1], one number per point, of either sign.
    traction_coefficient : array_like
        Q/P [1], one number per point.
    speed : array_like, optional
        Running speed V [m/s], one number per point or one for all; needed only for friction that
        falls with slip speed.

    Raises
    ------
    ValueError
        If a number is not finite, a traction coefficient is beyond 5, a speed is not above zero,
        there is no point, the lengths differ,
        or a creepage and its traction coefficient are of opposite sign, unless the coefficient is
        about zero, that is within a tenth of the largest one, or all points run through zero at
        another creepage.

    Examples
    --------
    >>> data = TractionData([0.005, 0.01, 0.02], [0.15, 0.25, 0.24], speed=10.0)
    >>> data.speed.tolist()
    [10.0, 10.0, 10.0]
    """

    creepage: FloatArray
    traction_coefficient: FloatArray
    speed: FloatArray | None = None

    def __init__(
        self,
        creepage: ArrayLike,
        traction_coefficient: ArrayLike,
        speed: ArrayLike | None = None,
    ) -> None:
        columns = [
            checked("TractionData.creepage", creepage, FINITE),
            checked("TractionData.traction_coefficient", traction_coefficient, LARGEST),
        ]
        if speed is not None:
            columns.append(checked("TractionData.speed", speed, POSITIVE))
            if columns[2].ndim == 0:
                columns[2] = np.full(columns[0].shape, columns[2])
        shapes = {column.shape for column in columns}
        if columns[0].ndim != 1 or columns[0].size == 0 or len(shapes) > 1:
            raise ValueError(
                "TractionData needs one-dimensional columns of one length, at least 1: the shapes "
                "are " + ", ".join(f"{n} {c.shape}" for n, c in zip(COLUMNS, columns, strict=False))
            )
        bad = _against(*columns[:2])
        if bad is not None:
            raise ValueError(
                f"TractionData: point {bad + 1}: the traction coefficient {columns[1][bad]:.4g} "
                f"and the creepage {columns[0][bad]:.4g} have opposite signs: {ONE_SIGN}"
            )
        self._keep(columns)

    def _keep(self, columns: Sequence[FloatArray]) -> None:
        for name, column in zip(COLUMNS, columns, strict=False):
            column.flags.writeable = False
            object.__setattr__(self, name, column)

    def _changed(self, *columns: FloatArray) -> TractionData:
        data = object.__new__(TractionData)
        data._keep(columns)
        return data

    def shifted(self, by: float) -> TractionData:
        """The points at creepages larger by `by` [1], whatever their signs then are."""
        by = checked_number("by", by, FINITE)
        columns = self.creepage + by, self.traction_coefficient, self.speed
        return self._changed(*(column for column in columns if column is not None))

    def mirrored(self) -> TractionData:
        """The points that have a creepage, those below zero mirrored at the origin."""
        moved = self.creepage != 0.0
        side = np.sign(self.creepage[moved])
        columns = [side * self.creepage[moved], side * self.traction_coefficient[moved]]
        if self.speed is not None:
            columns.append(self.speed[moved])
        return self._changed(*columns)

    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        *,
        columns: Sequence[str | int] | None = None,
        creepage_unit: str | None = None,
        speed: ArrayLike | None = None,
        load: Annotated[float | None, WHEEL_LOAD] = None,
    ) -> TractionData:
        """Read a CSV file as it is.

        The first line names the columns; other columns are ignored. Commas, semicolons, tabs or
        blanks separate the columns, numbers have a decimal point or a decimal comma, and cells may
        be quoted. Empty lines and lines that begin with ``#`` are skipped. A unit may follow a
        name, as in ``slip [%]``, or be in a row of units below the names; cells of this row may be
        empty.

        Parameters
        ----------
        path : path
            The file.
        columns : sequence of str or int, optional
            Columns of creepage, traction coefficient and, optionally, speed: each by its name, as
            ``["slip_percent", "mu"]``, or by its number, counted from 1. Numbers are needed if no
            line names the columns. Default: creepage, traction_coefficient and, if there is one,
            speed.
        creepage_unit : str, optional
            ``"1"`` or ``"%"``. Default: the unit that the file gives, behind the column's name, as
            in ``slip [%]``, or in a row below the names; or else ``"1"``.
        speed : array_like, optional
            Running speed [m/s], if no column gives it.
        load : float, optional
            Vertical load of the wheel or wheels whose force was measured [N]: of one wheel if the
            force acts on one wheel, of the axle if it acts on the axle. The second of the
            `columns` is then this force, in N or in the unit that the file gives; default:
            creep_force.

        Raises
        ------
        ValueError
            If the file has another content; the message is one line that names file, line and
            column.
        OSError
            If the file cannot be read.

        Warns
        -----
        InputWarning
            If creepage or traction coefficient are so large that they seem to be in per cent: a
            creepage whose unit nothing declares also if half of the largest traction takes more
            than 0.05.
        """
        if creepage_unit not in (None, "1", "%"):
            raise ValueError(f"creepage_unit = {shown(creepage_unit)} must be '1' or '%'")
        if columns is not None:
            _check_columns(columns)
        if load is not None:
            load = checked_number("load", load, POSITIVE)
        place = os.fspath(path)
        try:
            text = decoded(read_small(Path(path)))
            numbers, lines, declared = _read_columns(text, columns, creepage_unit, load)
            if "speed" in numbers and speed is not None:
                raise ValueError("the file has a speed column, so speed must not be given")
        except ValueError as error:
            raise ValueError(f"{place}: {printable_line(str(error))}") from None
        for name, maximum, how in (
            ("creepage", 2.0, "creepage_unit = '%'"),
            ("traction_coefficient", 1.5, "the column's name, as in 'mu [%]'"),
        ):
            worst = int(np.abs(numbers[name]).argmax())
            largest = float(np.abs(numbers[name][worst]))
            hint = f"if it is in per cent, declare it with {how}"
            if name == "traction_coefficient":
                if load is not None:
                    hint = f"does load = {load:g} N carry as many wheels as the force drives?"
                if not LARGEST.allow(largest):
                    raise ValueError(
                        f"{place}: line {lines[worst]}: {name} = {largest:g} is out of range: must "
                        f"be {LARGEST}; {hint}"
                    )
            if largest > maximum:
                warn(
                    f"{place}: line {lines[worst]}: {name} = {largest:g}, and above {maximum:g} is "
                    f"unusual; {hint}"
                )
            elif name == "creepage" and not declared:
                mu = np.abs(numbers["traction_coefficient"])
                half = float(np.abs(numbers[name])[mu >= 0.5 * mu.max()].min())
                if half > HALF:
                    warn(
                        f"{place}: half of the largest traction takes a creepage of {half:g}, and "
                        f"above {HALF:g} is unusual; {hint}, else with creepage_unit = '1'"
                    )
        highest = float(np.abs(numbers["traction_coefficient"]).max())
        if load is not None and highest < LOWEST:
            warn(
                f"{place}: the largest force is {highest:.2g} of load = {load:g} N, and below "
                f"{LOWEST:g} is unusual; does the file lack the force's unit?"
            )
        return cls(
            numbers["creepage"], numbers["traction_coefficient"], numbers.get("speed", speed)
        )


def _against(creepage: FloatArray, traction: FloatArray) -> int | None:
    """First point whose traction coefficient and creepage have opposite signs, if any.

    Points between zero creepage and the creepage at which all points run through zero are not.
    """
    bad = -traction * np.sign(creepage) > ABOUT_ZERO * np.abs(traction).max()
    if not bad.any():
        return None
    places = np.flatnonzero(bad)
    zero = zero_offset(creepage, traction, int(places[0]) if places.size == 1 else None)
    if zero is not None and np.all((creepage[bad] / zero > 0.0) & (creepage[bad] / zero < 1.0)):
        return None
    return int(places[0])


def _check_columns(columns: Sequence[str | int]) -> None:
    names = [] if isinstance(columns, str) else list(columns)
    right = all(
        isinstance(c, (str, int)) and not isinstance(c, bool) and (isinstance(c, str) or c >= 1)
        for c in names
    )
    if not right or len(names) not in (2, 3) or len(set(names)) < len(names):
        raise ValueError(
            f"columns = {shown(columns)} must be two or three different names, or numbers from 1 "
            "on: creepage, traction coefficient and, optionally, speed"
        )


def _read_columns(
    text: str,
    columns: Sequence[str | int] | None,
    creepage_unit: str | None,
    load: float | None,
) -> tuple[dict[str, FloatArray], list[int], bool]:
    """Columns in SI units by the names of `COLUMNS`, the lines of the points, and a flag.

    The flag is whether the file or `creepage_unit` declares the unit of the creepage.
    """
    rows = list(csv_rows(text))
    if not rows:
        raise ValueError("line 1: the file is empty: it needs a line that names the columns")
    line, head = rows[0]
    names = [name_and_unit(cell)[0] for cell in head]
    headless = any(cell_number(cell) is not None for cell in head)
    if columns is None:
        columns = [COLUMNS[0], COLUMNS[1] if load is None else "creep_force"]
        columns += ["speed"] if "speed" in names else []
    if preamble := preamble_of(text, columns):
        raise ValueError(preamble)
    places = [_place(line, head, names, column, headless) for column in columns]
    units = ["" if headless else name_and_unit(head[place])[1] for place in places]
    body = rows if headless else rows[1:]
    if body and not headless:
        below = units_below(body[0][1], places, (*SI.values(), "N"))
        units, body = (below, body[1:]) if below else (units, body)
    if not body:
        raise ValueError(f"line {line}: no data after the columns' names")
    for name in ("axle_load", "friction_scale"):  # of a table for several
        at = names.index(name) if name in names else 0
        if name in names and len({cells[at] for _, cells in body if at < len(cells)}) > 1:
            raise ValueError(
                f"line {line}: {name} varies, but a creep curve is of one: keep its rows"
            )
    shown_names = [f"column {p + 1}" if headless else head[p] for p in places]
    table = csv_numbers(body, len(head), places, shown_names)
    numbers: dict[str, FloatArray] = {}
    for kind, name, unit, column in zip(COLUMNS, shown_names, units, table.T, strict=False):
        if kind == "creepage" and creepage_unit is not None:
            if unit and unit_value(unit, "1") != unit_value(creepage_unit, "1"):
                raise ValueError(
                    f"line {line}: {name} is in {unit!r}, but creepage_unit = {creepage_unit!r}"
                )
            unit = creepage_unit
        elif (
            kind == "creepage" and not unit and re.search("per ?mill|promill", name, re.IGNORECASE)
        ):
            raise ValueError(
                f"line {line}: is {name} in per mille? then write its unit, as in 'slip [permille]'"
            )
        elif (
            kind == "creepage"
            and not unit
            and re.search("percent|prozent|pct", name, re.IGNORECASE)
        ):
            raise ValueError(f"line {line}: is {name} in per cent? then set creepage_unit = '%'")
        force = kind == "traction_coefficient" and load is not None
        si = "N" if force else SI[kind]
        factor = unit_factor(line, name, unit, si)
        if force and load is not None:
            factor /= load
        limits = POSITIVE if kind == "speed" else FINITE
        bad = np.flatnonzero(~limits.allows(factor * column))
        if bad.size:
            number, value = body[int(bad[0])][0], float(column[bad[0]])
            raise ValueError(f"line {number}: {name} = {value!r} is out of range: must be {limits}")
        numbers[kind] = factor * column
    lines = [number for number, _ in body]
    against = _against(numbers["creepage"], numbers["traction_coefficient"])
    if against is not None:
        raise ValueError(
            f"line {lines[against]}: {shown_names[1]} = {float(table[against, 1])!r} and "
            f"{shown_names[0]} = {float(table[against, 0])!r} have opposite signs: {ONE_SIGN}"
        )
    return numbers, lines, bool(units[0] or creepage_unit)


def _place(
    line: int, head: Sequence[str], names: Sequence[str], column: str | int, headless: bool
) -> int:
    """Where a column stands, from zero."""
    if isinstance(column, int):
        if column > len(head):
            raise ValueError(f"line {line}: column {column} does not exist: there are {len(head)}")
        return column - 1
    if headless:
        raise ValueError(
            f"line {line}: the first row contains numbers, not the columns' names; choose the "
            "columns, such as columns = [1, 2] for creepage and traction coefficient"
        )
    places = [p for p, cell in enumerate(head) if column in (cell, names[p])]
    if not places:
        hint = "; select one with columns" if column in COLUMNS else ""
        raise ValueError(f"line {line}: no column {column!r}; {known_names(column, names)}{hint}")
    if len(places) > 1:
        raise ValueError(f"line {line}: {len(places)} columns {column!r}: select one by its number")
    return places[0]
