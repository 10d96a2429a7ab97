"""A table of the creep force in the formats that other tools read."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.io import savemat

from contactlib.base.text import harmless_line
from contactlib.base.writing import write_whole
from contactlib.export.lookup import AXES, FIELDS

if TYPE_CHECKING:
    from xarray import Dataset


def write_lookup_table(table: Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a table of `contactlib.lookup_table`, in the format that the ending names.

    Parameters
    ----------
    table : xarray.Dataset
        The table.
    path : path
        ``.csv`` for text with a row for each point, below comments that state the error; ``.mat``,
        ``.npz`` or ``.nc`` (NetCDF) for arrays.

    Raises
    ------
    ValueError
        If the ending is another one.
    OSError
        If the file cannot be written.
    """
    return write_whole(path, FORMATS[known_format(path)](table))


def known_format(path: str | os.PathLike[str]) -> str:
    """Ending of a file, one of `FORMATS`, or a ValueError that names the file."""
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        raise ValueError(
            f"{os.fspath(path)}: the ending must be one of: {', '.join(FORMATS)}, .bin"
        )
    return ending


def _arrays(table: Dataset) -> dict[str, Any]:
    names = [*(name for name in AXES if name in table.coords), *FIELDS]
    dimensions = ", ".join(map(str, table["creep_force"].dims))
    arrays = {name: table[name].values for name in names}
    units = ", ".join(f"{name} {table[name].attrs['units']}" for name in names)
    return {**arrays, "dimensions": dimensions, "units": units, **table.attrs}


def _csv(table: Dataset) -> bytes:
    text = io.StringIO()
    fixed = [name for name in AXES if table[name].ndim == 0]
    for name, value in table.attrs.items():
        text.write(f"# {name}: {harmless_line(str(value))}\n")
    for name in fixed:
        text.write(f"# {name}: {float(table[name])!r} {table[name].attrs['units']}\n")
    columns = {name: table[name] for name in AXES if name not in fixed}
    columns |= {name: table[name] for name in ("traction_coefficient", "creep_force", "slope")}
    units = ", ".join(f"{name} {column.attrs['units']}" for name, column in columns.items())
    text.write(f"# units: {units}\n")
    like = table["creep_force"]
    rows = [column.broadcast_like(like).transpose(*like.dims).values for column in columns.values()]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(map(repr, row.ravel().tolist()) for row in rows), strict=True))
    return text.getvalue().encode()


def _mat(table: Dataset) -> bytes:
    buffer = io.BytesIO()
    file: Any = buffer  # some versions of SciPy's types accept only paths
    savemat(file, _arrays(table), oned_as="column")
    head = (
        b"MATLAB 5.0 MAT-file, by contactlib"  # without SciPy's date: the same table, the same file
    )
    return head.ljust(116) + buffer.getvalue()[116:]


def _npz(table: Dataset) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **_arrays(table))
    return buffer.getvalue()


def _nc(table: Dataset) -> bytes:
    return bytes(table.to_netcdf(engine="scipy"))


FORMATS = {".csv": _csv, ".mat": _mat, ".npz": _npz, ".nc": _nc}
