"""Maps: an outcome over two parameters, a panel for each controller, on one scale."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from contactlib.figures.maps.best import best, draw_best
from contactlib.figures.maps.layout import Layout, controllers, title_of
from contactlib.figures.maps.panels import along, in_rows, label_outside, legend, panels
from contactlib.figures.maps.words import finite, geometric, wide, words
from contactlib.figures.stability.common import plain_log
from contactlib.figures.style import STYLE
from contactlib.parameters import FloatArray

COLOURS = "viridis"  # uniform to the eye, and from dark to light in grey
NO_VALUE, FAILED = "#C4C4C4", "#6E6E6E"
LEVELS = 7


class Scale(NamedTuple):
    """Colours of all panels, and the values at which lines are drawn."""

    norm: Normalize
    levels: FloatArray


def plane_figure(chosen: Layout, *, title: str, caption: str) -> Figure:
    """An outcome over two parameters, in a panel for each controller and each third value."""
    shown, names = words(chosen.outcome), controllers(chosen.outcome)
    first = best(chosen.outcome) if chosen.further is None else None
    count = len(chosen.cases) + (first is not None)
    columns = len(names) if chosen.further is not None and len(names) > 1 else in_rows(count)
    x, y = chosen.axes
    at = [v.values * words(v).factor for v in (x, y)]
    edges = [_edges(v) for v in at]
    scale = _scale(shown.factor * finite(chosen.outcome.values))
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        figure, drawn = panels(count, columns, 3.4, 2.7)
        handles: dict[str, Any] = {}
        for axes, case in zip(drawn, chosen.cases, strict=False):
            values = shown.factor * case.values.values
            axes.pcolormesh(*edges, values, cmap=COLOURS, norm=scale.norm)
            handles |= _without_number(axes, edges, values, case.failed)
            handles |= _lines(axes, at, values, scale)
            axes.set_title(title_of(case), loc="left", fontsize=10)
        if first is not None:
            handles |= draw_best(drawn[-1], edges, first.transpose(y.name, x.name).values, names)
        along(drawn[0], "x", x)
        along(drawn[0], "y", y)
        label_outside(drawn, columns, words(x).label, words(y).lines(26))
        _bar(figure, drawn, scale, shown.lines(34))
        figure.suptitle(title, x=0.01, ha="left")
        legend(figure, handles, caption)
    return figure


def _edges(centres: FloatArray) -> FloatArray:
    """Borders of the cells around the values of an axis."""
    if centres.size == 1:
        return np.asarray(centres[0] + np.array([-0.5, 0.5]))
    if geometric(centres):
        return np.asarray(np.exp(_edges(np.log(centres))))
    middle = 0.5 * (centres[1:] + centres[:-1])
    ends = 2.0 * centres[[0, -1]] - middle[[0, -1]]
    return np.asarray(np.concatenate([ends[:1], middle, ends[1:]]))


def _scale(values: FloatArray) -> Scale:
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    if wide(values):
        decades = np.arange(math.floor(math.log10(low)), math.log10(high))
        steps = (1.0, 2.0, 5.0) if decades.size < 3 else (1.0, 3.0) if decades.size < 5 else (1.0,)
        levels = np.outer(10.0**decades, steps).ravel()
        norm: Normalize = LogNorm(low, high)
    else:
        levels = np.asarray(MaxNLocator(LEVELS).tick_values(low, high))
        norm = Normalize(low, high if high > low else low + (abs(low) or 1.0))
    return Scale(norm, levels[(levels > low) & (levels < high)])


def _without_number(
    axes: Axes, edges: list[FloatArray], values: FloatArray, failed: NDArray[np.bool_]
) -> dict[str, Any]:
    """Hatch what has no end, and grey what has no value or no run."""
    kinds = {
        "no limit": (np.isinf(values), "white", "///"),
        "no value": (np.isnan(values) & ~failed, NO_VALUE, ""),
        "failed": (failed, FAILED, "xx"),
    }
    handles: dict[str, Any] = {}
    for name, (where, face, hatch) in kinds.items():
        if where.any():
            cells = np.ma.masked_array(np.ones(values.shape), ~where)
            look: dict[str, Any] = {"hatch": hatch, "edgecolor": "black", "linewidth": 0.0}
            axes.pcolor(*edges, cells, cmap=ListedColormap([face]), **look)
            handles[name] = Patch(fc=face, ec="black", lw=0.6, hatch=hatch, label=name)
    return handles


def _lines(axes: Axes, at: list[FloatArray], values: FloatArray, scale: Scale) -> dict[str, Any]:
    """Lines of equal value; the one of zero, if the sign changes, is a border."""
    numbers = np.ma.masked_invalid(values)
    if min(values.shape) < 3 or numbers.count() < 4 or np.ptp(numbers.compressed()) == 0.0:
        return {}
    others = scale.levels[scale.levels != 0.0]
    drawn = axes.contour(*at, numbers, levels=others, colors="white", linewidths=1.0)
    axes.clabel(drawn, fontsize=8, fmt=lambda v: f"{v:g}")
    drawn.set_path_effects([withStroke(linewidth=1.8, foreground="#00000080")])
    for text in drawn.labelTexts:
        text.set_path_effects([withStroke(linewidth=1.8, foreground="black")])
    if not numbers.min() < 0.0 < numbers.max():
        return {}
    axes.contour(*at, numbers, levels=[0.0], colors="black", linewidths=2.4)
    return {"zero": Line2D([], [], color="black", lw=2.4, label="zero")}


def _bar(figure: Figure, drawn: list[Axes], scale: Scale, label: str) -> None:
    bar = figure.colorbar(
        ScalarMappable(scale.norm, COLOURS), ax=drawn, label=label, pad=0.015, aspect=28
    )
    bar.outline.set_visible(False)
    if isinstance(scale.norm, LogNorm):
        plain_log(bar.ax.yaxis, 1.0, 3.0)
