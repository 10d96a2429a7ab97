"""Maps: an outcome over two parameters, a panel for each controller, on one scale."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from contactlib.figures.maps.categories import ALIKE, CELLS, best, draw_categories
from contactlib.figures.maps.cells import cell_edges, mark_cells
from contactlib.figures.maps.layout import Case, Layout, controllers, title_of
from contactlib.figures.maps.meaning import BORDER, YES_OR_NO, ZEROS, meaning
from contactlib.figures.maps.panels import ROUND, along, frame, in_rows, label_outside, panels
from contactlib.figures.maps.words import finite, wide, words
from contactlib.figures.scenario import run_name
from contactlib.figures.stability.common import plain_log
from contactlib.figures.style import DASHED, STYLE
from contactlib.parameters import FloatArray

if TYPE_CHECKING:
    from xarray import DataArray

COLOURS = "viridis"  # uniform to the eye, and from dark to light in grey
LEVELS = 7
FINE = 6  # values of both axes from which lines of equal value say more than numbers
CALM = "Lines: of the median over 3 by 3 cells."
ROOM = 10  # numbers side by side that can be read


class Scale(NamedTuple):
    """Colours of all panels, and the values at which lines are drawn."""

    norm: Normalize
    levels: FloatArray


def plane_figure(chosen: Layout, *, title: str, caption: str) -> Figure:
    """An outcome over two parameters, in a panel for each controller and each third value."""
    outcome, (x, y) = chosen.outcome, chosen.axes
    names, shown = controllers(outcome), words(outcome)
    first = best(outcome) if chosen.further is None else None
    count = len(chosen.cases) + (first is not None)
    columns = len(names) if chosen.further is not None and len(names) > 1 else in_rows(count)
    at = [words(v).factor * v.values for v in (x, y)]
    edges = [cell_edges(v) for v in at]
    scale = _scale(shown.factor * finite(outcome.values), str(outcome.name))
    with mpl.rc_context({**STYLE, "axes.grid": False, "hatch.linewidth": 0.5}):
        figure, drawn = panels(count, columns, 3.4, 2.7)
        along(drawn[0], "x", x)
        along(drawn[0], "y", y)
        handles: dict[str, Any] = {}
        for axes, case in zip(drawn, chosen.cases, strict=False):
            if outcome.name in YES_OR_NO:
                yes, no = YES_OR_NO[str(outcome.name)]
                handles |= draw_categories(axes, edges, 1.0 - case.values, [yes, no])
            else:
                _values(axes, at, edges, shown.factor * case.values, scale, noisy=bool(names))
            handles |= mark_cells(axes, edges, case, meaning(outcome.name))
            handles |= _borders(axes, at, case, str(outcome.name))
            axes.set_title(title_of(case), loc="left", fontsize=10)
        if first is not None:
            over = first.transpose(y.name, x.name).values
            handles |= _winners(drawn[-1], edges, over, outcome)
        label_outside(drawn, columns, words(x).label, words(y).lines(26))
        if outcome.name not in YES_OR_NO:
            _bar(figure, drawn, scale, shown.lines(34))
        calmed = names and min(len(v) for v in at) >= FINE
        frame(figure, title, handles, f"{caption} {CALM if calmed else ''}".strip())
    return figure


def _values(
    axes: Axes,
    at: list[FloatArray],
    edges: list[FloatArray],
    values: FloatArray,
    scale: Scale,
    *,
    noisy: bool,
) -> None:
    """Colours, and lines of equal value or the values themselves."""
    cells = axes.pcolormesh(*edges, values, cmap=COLOURS, norm=scale.norm)
    cells.set_rasterized(values.size > CELLS)
    if min(values.shape) >= FINE:
        # Noise of sensors differs from run to run; an analysis has none.
        _lines(axes, at, _calm(values) if noisy else values, scale)
    elif values.shape[1] <= ROOM:
        _numbers(axes, at, values, scale)


def _winners(
    axes: Axes, edges: list[FloatArray], first: FloatArray, outcome: DataArray
) -> dict[str, Any]:
    """Which controller does best where."""
    most = "most" if meaning(outcome.name).wanted > 0 else "least"
    axes.set_title(f"who has the {most}", loc="left", fontsize=10)
    texts = [f"two are within {100.0 * ALIKE:g} % of the scale"]
    texts += [f"{most}: {run_name(name)}" for name in controllers(outcome)]
    return draw_categories(axes, edges, first, texts)


def _scale(values: FloatArray, outcome: str) -> Scale:
    """Colours of the values; logarithmic if they are of many sizes, but for special zeros."""
    if meaning(outcome).zero:
        values = values[values != 0.0]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    if wide(values):
        decades = np.arange(math.floor(math.log10(low)), math.log10(high))
        steps = (1.0, 2.0, 5.0) if decades.size < 3 else (1.0, 3.0) if decades.size < 5 else (1.0,)
        levels = np.outer(10.0**decades, steps).ravel()
        norm: Normalize = LogNorm(low, high)
    else:
        levels = np.asarray(MaxNLocator(LEVELS, steps=ROUND).tick_values(low, high))
        norm = Normalize(low, high if high > low else low + (abs(low) or 1.0))
    return Scale(norm, levels[(levels > low) & (levels < high)])


def _lines(axes: Axes, at: list[FloatArray], values: FloatArray, scale: Scale) -> None:
    """Lines of equal value, with the value."""
    numbers = np.ma.masked_invalid(np.where(_coloured(values, scale), values, np.nan))
    if not numbers.count() or not np.ptp(numbers.compressed()):
        return
    others = scale.levels[scale.levels != 0.0]  # zero is a border
    look: dict[str, Any] = {"colors": "white", "linewidths": 1.0, "linestyles": "-"}
    lines = axes.contour(*at, numbers, levels=others, **look)
    lines.set_path_effects([withStroke(linewidth=1.8, foreground="#00000080")])
    for text in axes.clabel(lines, fontsize=8, inline_spacing=1, fmt=lambda value: f"{value:g}"):
        text.set_rotation(0.0)
        text.set_path_effects([withStroke(linewidth=1.8, foreground="black")])


def _calm(values: FloatArray) -> FloatArray:
    """Median of each number and those around it."""
    known = np.isfinite(values)
    padded = np.pad(np.where(known, values, np.nan), 1, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, (3, 3)).reshape(*values.shape, 9)
    calm = values.copy()
    calm[known] = np.nanmedian(around[known], axis=-1)
    return calm


def _numbers(axes: Axes, at: list[FloatArray], values: FloatArray, scale: Scale) -> None:
    """The values themselves."""
    for row, column in np.argwhere(_coloured(values, scale)):
        value = values[row, column]
        dark = float(scale.norm(value)) < 0.6
        look: dict[str, Any] = {"color": "white" if dark else "black", "fontsize": 7}
        place: dict[str, Any] = {"ha": "center", "va": "center"}
        axes.text(at[0][column], at[1][row], f"{value:#.3g}".rstrip("."), **place, **look)


def _coloured(values: FloatArray, scale: Scale) -> Any:
    return np.isfinite(values) & ((values > 0.0) | (not isinstance(scale.norm, LogNorm)))


def _borders(axes: Axes, at: list[FloatArray], case: Case, outcome: str) -> dict[str, Any]:
    """Where the demand is the critical torque, and where the sign of the outcome changes."""
    handles: dict[str, Any] = {}
    kinds = ((case.margin, BORDER, "-"), (case.values, ZEROS.get(outcome, "zero"), DASHED))
    for values, text, dashes in kinds:
        numbers = np.ma.masked_invalid(np.nan if values is None else values)
        if min(case.values.shape) > 1 and numbers.count() and numbers.min() < 0.0 < numbers.max():
            axes.contour(*at, numbers, levels=[0.0], colors="white", linewidths=4.0)
            look: dict[str, Any] = {"colors": "black", "linewidths": 2.2, "linestyles": [dashes]}
            axes.contour(*at, numbers, levels=[0.0], **look)
            handles[text] = Line2D([], [], color="black", lw=2.2, ls=dashes, label=text)
    return handles


def _bar(figure: Figure, drawn: list[Axes], scale: Scale, label: str) -> None:
    colours = ScalarMappable(scale.norm, COLOURS)
    bar = figure.colorbar(colours, ax=drawn, label=label, pad=0.015, aspect=28)
    bar.outline.set_visible(False)
    if isinstance(scale.norm, LogNorm):
        plain_log(bar.ax.yaxis, 1.0, 3.0)
