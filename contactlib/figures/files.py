"""Files of figures: their formats, and legends that leave every text legible."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox, ScaledTranslation

from contactlib.base.writing import write_whole
from contactlib.figures.style import sized, styled

PICTURES = ("png", "svg")  # default formats of the figures that commands write
# Metadata that leaves the date out of a file: a figure always gives the same bytes.
UNDATED: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
PLACES: tuple[Any, ...] = (  # of a legend
    *("upper right", "upper left", "lower right", "lower left"),
    *("center right", "center left", "upper center", "lower center"),
)


def save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure to `path`; the suffix sets the format, any that matplotlib writes, or csv.

    Files in png, svg and pdf hold no date: the same figure gives the same bytes. A CSV file has the
    numbers of the figure's lines, a row for each point: panel, line, x and y; if it has coloured
    areas, also their points, with the value that their colour shows in a fifth column.

    Raises
    ------
    ValueError
        If matplotlib writes no format of that suffix.
    OSError
        If the file cannot be written.
    """
    return _write(figure, [Path(path)])[0]


def file_formats(listed: str, what: str = "formats") -> tuple[str, ...]:
    """Formats that are listed with commas, if matplotlib writes them all or they are csv.

    Raises
    ------
    ValueError
        If it does not write one; `what` names it in the message.
    """
    known = {*FigureCanvasAgg.get_supported_filetypes(), "csv"}
    formats = tuple(name.strip().lower() for name in listed.split(","))
    for name in formats:
        if name not in known:
            raise ValueError(f"{what} = {name!r} must be one of: {', '.join(sorted(known))}")
    return formats


def save_pictures(
    figure: Figure, folder: Path, name: str, formats: Sequence[str] = PICTURES
) -> list[Path]:
    """Write a figure in some formats."""
    return _write(figure, [folder / f"{name}.{kind}" for kind in formats])


def _write(figure: Figure, paths: Sequence[Path]) -> list[Path]:
    """Write a figure to some files; the layout, half of the work, is computed once."""
    kinds = [file_formats(path.suffix[1:], f"{path}: the suffix")[0] for path in paths]
    engine, written = figure.get_layout_engine(), []
    clear_legends(figure)
    # No engine, whatever the user's settings: "none" would put one there that makes it draw twice.
    with mpl.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
        figure.set_layout_engine(None)
        for path, kind in zip(paths, kinds, strict=True):
            buffer = io.BytesIO()
            with styled():
                if kind == "csv":
                    buffer.write(_points(figure).encode())
                else:
                    figure.savefig(buffer, format=kind, metadata=UNDATED.get(kind))
            written.append(write_whole(path, buffer.getvalue()))
    figure.set_layout_engine(engine)
    return written


def _points(figure: Figure) -> str:
    """CSV of all lines and coloured areas of a figure, in the order in which they were drawn.

    Areas add a column for what their colours show.
    """
    bars = [axes.get_ylabel() for axes in figure.axes if axes.get_label() == "<colorbar>"]
    rows: list[list[Any]] = []
    for number, axes in enumerate(figure.axes, start=1):
        panel = axes.get_title() or axes.get_title("left") or f"{number}"
        x, y = _label(axes, "x"), _label(axes, "y")
        for line in axes.lines:
            if line.get_transform() != axes.transData:  # at a place of the axes: it has no numbers
                continue
            label = str(line.get_label())
            name = f"{y} over {x}" if label.startswith("_") else label
            rows += [[panel, name, *point] for point in np.asarray(line.get_xydata()).tolist()]
        meshes = [part for part in axes.collections if isinstance(part, QuadMesh)]
        for mesh in meshes if bars and axes.get_label() != "<colorbar>" else []:
            places = np.asarray(mesh.get_coordinates())
            values: Any = np.ma.array(mesh.get_array(), np.float64)
            if values.size < places[..., 0].size:  # of the areas between the places
                places = 0.5 * (places[1:] + places[:-1])
                places = 0.5 * (places[:, 1:] + places[:, :-1])
            known = np.ma.filled(values, np.nan).ravel()
            points = np.column_stack([places.reshape(-1, 2), known]).tolist()
            rows += [[panel, bars[0], *point] for point in points]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["panel", "line", "x", "y", *["colour"] * bool(bars)])
    writer.writerows([*(" ".join(name.split()) for name in row[:2]), *row[2:]] for row in rows)
    return text.getvalue()


def _label(axes: Axes, which: str) -> str:
    """Label of an axis, or of one with which it is shared."""
    shared = axes.get_shared_x_axes() if which == "x" else axes.get_shared_y_axes()
    labels = (getattr(one, f"get_{which}label")() for one in (axes, *shared.get_siblings(axes)))
    return next(filter(None, labels), which)


def clear_legends(figure: Figure) -> None:
    """Lay a figure out, and move legends that cover texts or lines of their axes."""
    figure.draw_without_rendering()
    moved = [_clear_legend(axes) for axes in figure.axes]
    if any(moved):
        figure.draw_without_rendering()


def _clear_legend(axes: Axes) -> bool:
    """Move a legend that covers a text or a line to where it covers none, or below."""
    legend, figure = axes.get_legend(), axes.get_figure(root=True)
    if legend is None or figure is None:
        return False
    # Of a note only its words: the legend may cover its arrow.
    words = [Text.get_window_extent(text) for text in axes.texts if text.get_text()]
    ticks = [*axes.get_xticklabels(), *axes.get_yticklabels(), axes.title]
    words += [text.get_window_extent() for text in ticks if text.get_visible() and text.get_text()]
    paths = [line.get_transform().transform_path(line.get_path()) for line in axes.lines]

    def covers(box: Bbox) -> bool:
        lines = (path.intersects_bbox(box, filled=False) for path in paths)
        return bool(box.count_overlaps(words)) or any(lines)

    box = legend.get_window_extent()
    if not covers(box) and figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1:
        return False
    for place in PLACES if box.width < axes.bbox.width else ():
        legend.set_loc(place)
        if not covers(legend.get_window_extent()):
            return True
    below = ScaledTranslation(0.0, -sized(40) / 72.0, figure.dpi_scale_trans)  # the axis's labels
    legend.set_loc("upper center")
    legend.set_bbox_to_anchor((0.5, 0.0), transform=axes.transAxes + below)
    return True
