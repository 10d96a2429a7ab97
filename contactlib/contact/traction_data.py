"""Measured traction: creepage against traction coefficient, from arrays or a CSV file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FINITE, POSITIVE, FloatArray, checked

COLUMNS = ("creepage", "traction_coefficient", "speed")


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
        If a number is not finite, a speed is not above zero, there is no point, or the lengths
        differ.

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
            checked("TractionData.traction_coefficient", traction_coefficient, FINITE),
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
        for name, column in zip(COLUMNS, columns, strict=False):
            column.flags.writeable = False
            object.__setattr__(self, name, column)

    @classmethod
    def from_csv(
        cls, path: str | os.PathLike[str], *, speed: ArrayLike | None = None
    ) -> TractionData:
        """Read a CSV file.

        Lines that begin with ``#`` are comments. The first other line names the columns creepage,
        traction_coefficient and, optionally, speed, in any order.

        Parameters
        ----------
        path : path
            The file.
        speed : array_like, optional
            Running speed [m/s], if the file has no such column.

        Raises
        ------
        ValueError
            If the file has another content; the message is one line that names file and line.
        OSError
            If the file cannot be read.
        """
        place = os.fspath(path)
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
        lines = (
            (number, line)
            for number, line in enumerate(text.splitlines(), start=1)
            if line.strip() and not line.startswith("#")
        )
        number, head = next(lines, (1, ""))
        names = [name.strip() for name in head.split(",")]
        if sorted(names) not in (sorted(COLUMNS[:2]), sorted(COLUMNS)):
            raise ValueError(
                f"{place}: line {number}: the columns are {head!r}; they must be creepage, "
                "traction_coefficient and, optionally, speed"
            )
        if "speed" in names and speed is not None:
            raise ValueError(
                f"{place}: line {number}: the file has a speed column, so speed must not be given"
            )
        rows = list(_rows(place, names, lines))
        if not rows:
            raise ValueError(f"{place}: line {number}: no data after the columns' names")
        columns: dict[str, Any] = dict(zip(names, np.array(rows).T, strict=True))
        return cls(**{"speed": speed, **columns})


def _rows(place: str, names: list[str], lines: Iterator[tuple[int, str]]) -> Iterator[list[float]]:
    for number, line in lines:
        cells = line.split(",")
        if len(cells) != len(names):
            raise ValueError(
                f"{place}: line {number}: {len(cells)} values for {len(names)} columns"
            )
        row = []
        for name, cell in zip(names, cells, strict=True):
            try:
                value = float(cell)
            except ValueError:
                raise ValueError(
                    f"{place}: line {number}: {name} = {cell.strip()!r} is not a number"
                ) from None
            try:
                checked(name, value, POSITIVE if name == "speed" else FINITE)
            except ValueError as error:
                raise ValueError(f"{place}: line {number}: {error}") from None
            row.append(value)
        yield row
