"""Colours, style and files that all figures share."""

from __future__ import annotations

import io
import os
import re
import textwrap
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from contactlib.files import write_whole

# Colours that colour-blind readers can tell apart (Okabe & Ito).
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#6E6E6E"
DASHED, DOTTED = (0, (4, 1.5)), (0, (1, 1.5))
# Captions are plain text; under a figure their symbols are set as on its axes.
SYMBOLS = {
    "k_hat": r"$\hat{K}$",
    "zeta0": r"$\zeta_0$",
    "f_s": "$f_s$",
    "f_d": "$f_d$",
    "c/a": "$c/a$",
}
# Formats of files, and what leaves the date out of them: the same bytes every day.
UNDATED: dict[str, dict[str, None]] = {
    "png": {},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "lines.linewidth": 2.0,
    "svg.fonttype": "none",
    "svg.hashsalt": "contactlib",
}


def save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure to `path`; its ending (png, svg, pdf) tells the format.

    Raises
    ------
    ValueError
        If the ending is another.
    OSError
        If the file cannot be written.
    """
    path, buffer = Path(path), io.BytesIO()
    kind = path.suffix[1:].lower()
    if kind not in UNDATED:
        raise ValueError(f"{path}: the file's ending must be one of: {', '.join(UNDATED)}")
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format=kind, dpi=150, metadata=UNDATED[kind])
    return write_whole(path, buffer.getvalue())


def save_pictures(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG, laid out once for both: that is half of the work."""
    png = save(figure, folder / f"{name}.png")
    engine = figure.get_layout_engine()
    figure.set_layout_engine("none")
    svg = save(figure, folder / f"{name}.svg")
    figure.set_layout_engine(engine)
    return [png, svg]


def new_figure(width: float, height: float, **grid: Any) -> tuple[Figure, Any]:
    """A figure of so many inches, and its axes."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(**grid)


def percent_axis(axis: Any) -> None:
    """Label an axis of numbers in per cent."""
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{100.0 * v:g}"))


def mark(
    axes: Axes, x: float, y: float, text: str, offset: tuple[float, float], **style: Any
) -> None:
    """Mark a point and name it."""
    axes.plot([x], [y], "o", color="black", ms=6, zorder=5)
    axes.annotate(text, (x, y), xytext=offset, textcoords="offset points", **style)


def typeset(figure: Figure, caption: str) -> str:
    """A caption in lines that fit under a figure, its symbols set as on the axes."""
    lines = textwrap.fill(caption, width=int(14.5 * figure.get_figwidth()))
    return re.sub("|".join(SYMBOLS), lambda found: SYMBOLS[found.group()], lines)


def add_caption(figure: Figure, caption: str) -> None:
    """Set a text under a figure."""
    figure.supxlabel(typeset(figure, caption), x=0.01, ha="left", size=9, linespacing=1.4)
