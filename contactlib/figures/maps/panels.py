"""Panels on common axes, with labels at the outside only, and a legend under the caption."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from contactlib.figures.maps.words import geometric, words
from contactlib.figures.stability.common import plain_log
from contactlib.figures.style import new_figure, typeset

if TYPE_CHECKING:
    from xarray import DataArray

WIDEST = 3  # panels side by side
FEW_TICKS = 6  # values of an axis that all have their number
ROUND = (1, 2, 5, 10)  # steps between numbers
CHARACTERS = 12.5  # of a title or legend in an inch


def panels(count: int, columns: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels of so many inches, in rows of `columns`."""
    rows = math.ceil(count / columns)
    common: dict[str, Any] = {"squeeze": False, "sharex": True, "sharey": True}
    size = max(6.4, width * columns + 1.2), height * rows + 1.5
    figure, grid = new_figure(*size, nrows=rows, ncols=columns, **common)
    for axes in grid.flat[count:]:
        axes.remove()
    return figure, list(grid.flat[:count])


def in_rows(count: int) -> int:
    """How many panels of `count` stand side by side."""
    return count if count <= WIDEST else WIDEST if count > 4 else 2


def label_outside(drawn: list[Axes], columns: int, x: str, y: str) -> None:
    """Label the axes at the left and of the lowest panel of each column."""
    for index, axes in enumerate(drawn):
        if index + columns >= len(drawn):
            axes.set_xlabel(x)
            axes.tick_params(labelbottom=True)
        if index % columns == 0:
            axes.set_ylabel(y)


def along(axes: Axes, which: Literal["x", "y"], coordinate: DataArray) -> None:
    """Numbers on the axis of a parameter, logarithmic if its values are."""
    values = coordinate.values * words(coordinate).factor
    axis = axes.xaxis if which == "x" else axes.yaxis
    if geometric(values):
        axes.set(**{f"{which}scale": "log"})
    if values.size <= FEW_TICKS:
        axis.set_ticks(values, [f"{value:.4g}" for value in values])
        axis.set_ticks([], minor=True)
    elif geometric(values):
        plain_log(axis, *((1.0, 2.0, 5.0) if values[-1] < 100.0 * values[0] else (1.0,)))
    else:
        axis.set_major_locator(MaxNLocator(6, steps=ROUND))


def frame(figure: Figure, title: str, handles: dict[str, Any], caption: str) -> None:
    """Title above, and below the caption and what the marks are, in as many columns as fit."""
    lines = textwrap.fill(title, int(CHARACTERS * figure.get_figwidth()))
    figure.suptitle(lines, x=0.01, ha="left", fontsize=12)
    longest = max((len(text) for text in handles), default=0)
    columns = int(CHARACTERS * figure.get_figwidth() / (longest + 5))
    figure.legend(
        handles=list(handles.values()),
        loc="outside lower left",
        ncols=min(max(1, columns), max(1, len(handles))),
        title=typeset(figure, caption),
        title_fontsize=9,
        alignment="left",
        handlelength=1.6,
        columnspacing=1.4,
    )
