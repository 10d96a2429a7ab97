"""The explorer: one HTML page that shows a wheelset's stability live, in any browser, offline.

The page runs the same kernel and tables as everything else, compiled to WebAssembly. It is built
from the sources in the folder ``explorer``; the package only writes it, and opens it.
"""

from __future__ import annotations

import json
import os
import sys
import webbrowser
from pathlib import Path

from contactlib.base.writing import PACKAGE, write_whole
from contactlib.files.mistakes import ModelError
from contactlib.files.model import Missing, load_model
from contactlib.files.reading import in_file, model_path, parse

PAGE = PACKAGE / "export" / "explorer.html"
PLACE = '<script type="application/json" id="given-model">{}</script>'  # of a model's text


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
    page = PAGE.read_bytes()
    if model is not None:
        # Without "<" the text cannot end its element.
        text = json.dumps(_checked_text(model)).replace("<", r"\u003c")
        empty, filled = (PLACE.format(part).encode() for part in ("null", text))
        if page.count(empty) != 1:
            raise RuntimeError(f"{PAGE} must have exactly one place for a model")
        page = page.replace(empty, filled)
    return write_whole(path, page)


def _checked_text(model: str | os.PathLike[str]) -> str:
    """Text of a model file that the page can show."""
    file = model_path(model)
    with in_file(model):
        law = parse(file).get("law", {})
        kind = law.get("kind", "carter_griffith") if isinstance(law, dict) else None
        if isinstance(kind, str) and kind != "carter_griffith":
            raise ValueError(f"law.kind = {kind!r}: the page shows 'carter_griffith' only")
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
