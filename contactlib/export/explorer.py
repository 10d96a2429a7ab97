"""The explorer: one HTML page that shows a wheelset's stability live, in a browser, offline.

The page runs the same kernel as everything else, compiled to WebAssembly, with the same tables.
Page and kernel are built from the sources in the folder ``explorer``; the package puts the kernel,
the tables and a model into the page.
"""

from __future__ import annotations

import json
import os
import sys
import webbrowser
import zlib
from base64 import b64encode
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlib import kernel
from contactlib.base.writing import PACKAGE, write_whole
from contactlib.files.mistakes import ModelError
from contactlib.files.model import Missing, load_model
from contactlib.files.reading import in_file, model_path, parse
from contactlib.table.building import HEADER_SIZE, LAYER_STEP
from contactlib.table.creep_force_table import CreepForceTable
from contactlib.table.law_tables import Shape

PAGE = PACKAGE / "export" / "explorer.html"
KERNEL = PACKAGE / "export" / "explorer.wasm.zlib"  # compressed
DATA = '<script type="application/json" id="{}">{}</script>'  # nothing runs it
SHAPES: tuple[Shape, ...] = ("line", "elliptic")
PLACES = ("kernel", *(f"table-{shape}" for shape in SHAPES), "given-model")  # that are filled here


def write_explorer(
    path: str | os.PathLike[str], model: str | os.PathLike[str] | None = None
) -> Path:
    """Write the explorer page, which needs no other file and no network.

    Parameters
    ----------
    path : path
        The HTML file.
    model : path, optional
        Model file that the page starts with, or the name of a shipped one; the page has the models
        of the roller rig and the locomotive in any case.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ModelError
        If `model` is no model file, its law is not Carter and Griffith's, or its line contact is
        too short for the memory that it has.
    ValueError
        If `path` ends like another kind of file.
    OSError
        If a file cannot be read or written; what stood at `path` is unchanged.
    """
    if Path(path).suffix.lower() not in ("", ".html", ".htm"):
        raise ValueError(f"{path}: the explorer is a page, whose file ends in .html")
    text = None if model is None else _checked_text(model)
    page = PAGE.read_text(encoding="utf-8")
    for name, data in zip(PLACES, (*_kernel_and_tables(), text), strict=True):
        before, empty, after = page.partition(DATA.format(name, "null"))
        if not empty:
            raise RuntimeError(f"{PAGE} must have a place for {name}")
        page = before + DATA.format(name, json_text(data)) + after
    return write_whole(path, page.encode())


def json_text(data: object) -> str:
    """JSON without "<", so that no text ends its element."""
    return json.dumps(data).replace("<", r"\u003c")


def packed_table(data: bytes) -> bytes:
    """Rearrange a table file so that it compresses to a quarter of its size.

    Behind the header are the spline coefficients, then those with a layer: the bits of the former,
    and the latter over their step, as 64-bit integers. Their second differences along each axis
    are close to zero, so these are stored. ``open_packed_table`` in explorer/module.c restores the
    file to the last bit.
    """
    table = CreepForceTable(data)
    end = len(data) - len(table.layer_bytes)
    cells = tuple(n + 3 for n in table.cells) if end > HEADER_SIZE else (0, 0)
    coefficients = np.frombuffer(data[HEADER_SIZE:end], "<i8").reshape(cells[::-1])
    steps = (np.frombuffer(table.layer_bytes, "<f4") / LAYER_STEP).astype("<i8")
    if (steps * LAYER_STEP).astype("<f4").tobytes() != table.layer_bytes:
        raise ValueError("a coefficient with a layer is not a multiple of LAYER_STEP")
    layers = steps.reshape([n + 3 for n in table.layer_cells[::-1]])
    return data[:HEADER_SIZE] + _planes(coefficients) + _planes(layers)


def _planes(numbers: NDArray[Any]) -> bytes:
    """Second differences along all axes: all lowest bytes, then all next ones, to the highest."""
    for axis in 2 * tuple(range(numbers.ndim)):
        numbers = np.diff(numbers, axis=axis, prepend=0)
    unsigned = (numbers << 1) ^ (numbers >> 63)  # 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
    return unsigned.reshape(-1, 1).view(np.uint8).T.tobytes()


@cache
def _kernel_and_tables() -> tuple[str, ...]:
    """The kernel and the tables, compressed and in base64."""
    tables = (packed_table(kernel.shipped_path(shape).read_bytes()) for shape in SHAPES)
    data = (KERNEL.read_bytes(), *(zlib.compress(table, 9) for table in tables))
    return tuple(b64encode(each).decode("ascii") for each in data)


def _checked_text(model: str | os.PathLike[str]) -> str:
    """Text of a model file that the page can show."""
    file = model_path(model)
    with in_file(model):
        data = parse(file)
        law = data.get("law", {})
        kind = law.get("kind", "carter_griffith") if isinstance(law, dict) else None
        if isinstance(kind, str) and kind != "carter_griffith":
            raise ValueError(f"law.kind = {kind!r}: the page shows 'carter_griffith' only")
        friction = data.get("friction", {})
        rails = friction.get("condition", "") if isinstance(friction, dict) else ""
        if str(rails).endswith(".toml"):
            raise ValueError(
                f"friction.condition = {rails!r}: the page knows the shipped rails only; write the "
                "numbers of that file into the model"
            )
    loaded = load_model(model)
    if isinstance(loaded.wheelset, Missing):
        raise ModelError(f"{os.fspath(model)}: {loaded.wheelset.lacking}")
    with in_file(model):
        _ = loaded.wheelset.element.rolling_parameters  # a short line contact has no memory
    return file.read_text(encoding="utf-8-sig")


def open_in_browser(path: str | os.PathLike[str]) -> bool:
    """Show a file in the user's browser; False without a browser or a screen."""
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    if sys.platform not in ("win32", "darwin") and not any(map(os.environ.get, screens)):
        return False  # a browser of text would take over the terminal
    try:
        return webbrowser.open(Path(path).resolve().as_uri())
    except webbrowser.Error:
        return False
