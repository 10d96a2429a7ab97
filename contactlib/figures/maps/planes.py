"""Maps of an outcome over two parameters, with one panel per controller and a common scale.

Cells hold a colour, a category (the best controller; whether the demand is held) or, where there is
no number, a hatching.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.figures.maps.layout import (
    CONTROLLER,
    ROUND,
    Case,
    Layout,
    along,
    controllers,
    frame,
    in_rows,
    label_outside,
    panels,
    title_of,
)
from contactlib.figures.maps.meaning import (
    finite,
    geometric,
    meaning,
    wide,
    words,
)
from contactlib.figures.scenario import run_name
from contactlib.figures.style import DASHED, paint, plain_log, sized, styled
from contactlib.runs.analysis import MARGIN
from contactlib.runs.outcomes import Outcome

if TYPE_CHECKING:
    from xarray import DataArray

ZERO, NO_VALUE, FAILED = "#E4E4E4", "#C8C8C8", "#8A8A8A"
COLOURS = "viridis"  # perceptually uniform, and from dark to light in grey
# Categories from light to dark, so that they differ in grey.
SHADES = ("white", "#F0E442", "#56B4E9", "#D55E00", "#004B70", "black")
ALIKE = 0.05  # difference that does not count / range of the values
CELLS = 4000  # number of cells above which an SVG holds a panel as a picture
LEVELS = 7  # lines of equal value
FINE = 6  # values of both axes above which lines of equal value replace numbers
ROOM = 10  # numbers side by side that can be read
CALM = "Lines show the median over 3 by 3 cells."


def cell_edges(centres: FloatArray) -> FloatArray:
    """Edges of the cells around the values of an axis."""
    if geometric(centres):
        return np.asarray(np.exp(cell_edges(np.log(centres))))
    middle = 0.5 * (centres[1:] + centres[:-1])
    ends = 2.0 * centres[[0, -1]] - middle[[0, -1]]
    return np.asarray(np.concatenate([ends[:1], middle, ends[1:]]))


def mark_cells(axes: Axes, edges: list[FloatArray], case: Case, means: Outcome) -> dict[str, Any]:
    """Hatch infinite cells, grey those without value or run; return handles for the legend."""
    values = case.values
    zero = (values == 0.0) if means.zero else np.zeros(values.shape, bool)
    kinds = {
        means.infinite: (np.isinf(values), "white", "///"),
        means.zero: (zero, ZERO, "..."),
        means.missing: (np.isnan(values) & ~case.failed, NO_VALUE, ""),
        "failed": (case.failed, FAILED, "xxx"),
    }
    handles: dict[str, Any] = {}
    for name, (where, face, hatch) in kinds.items():
        if where.any():
            look: dict[str, Any] = {"fc": face, "ec": "black", "hatch": hatch, "lw": 0.0}
            axes.add_collection(PolyCollection(_bars(edges, where), **look), autolim=False)
            handles[name] = Patch(fc=face, ec="black", lw=0.6, hatch=hatch, label=name)
    return handles


def _bars(edges: list[FloatArray], where: NDArray[np.bool_]) -> list[FloatArray]:
    """Corners of the stretches of marked cells in each row, which are far fewer than the cells."""
    x, y = edges
    bars = []
    for row, marked in enumerate(where):
        ends = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
        for start, stop in x[ends].reshape(-1, 2):
            low, high = y[row : row + 2]
            bars.append(np.array([[start, low], [stop, low], [stop, high], [start, high]]))
    return bars


def best(outcome: DataArray) -> DataArray | None:
    """Number of the best controller, from 1; 0 if the best two are alike, nan without a value.

    Logarithms are compared where the map's scale is logarithmic. Returns None for an outcome
    without a preferred direction, for a single controller, or if all are alike everywhere.
    """
    better, names = meaning(outcome.name).better, controllers(outcome)
    known = finite(outcome.values)
    if not better or not known.size or not 2 <= len(names) < len(SHADES):
        return None
    outcome = outcome.transpose(CONTROLLER, ...)
    level, ends = outcome.values, np.array([known.min(), known.max()])
    if wide(known):
        level, ends = np.log(level), np.log(ends)
    gains = np.where(np.isnan(level), -np.inf, better * level)
    second, first = np.sort(gains, axis=0)[-2:]
    runs = np.isfinite(first)
    lead = np.subtract(first, second, where=runs, out=np.zeros(runs.shape))
    number = np.where(lead > ALIKE * np.ptp(ends), 1.0 + gains.argmax(axis=0), 0.0)
    if not number.any():
        return None
    return outcome.isel({CONTROLLER: 0}, drop=True).copy(data=np.where(runs, number, np.nan))


def draw_categories(
    axes: Axes, edges: list[FloatArray], values: FloatArray, names: list[str]
) -> dict[str, Any]:
    """Colour cells by category, numbered from 0; return handles for the legend."""
    colours = ListedColormap(SHADES[: len(names)])
    cells = axes.pcolormesh(*edges, values, cmap=colours, vmin=-0.5, vmax=len(names) - 0.5)
    cells.set_rasterized(values.size > CELLS)
    look: dict[str, Any] = {"ec": paint.ink, "lw": 0.6}
    there = [index for index in range(len(names)) if np.any(values == index)]
    return {names[i]: Patch(fc=SHADES[i], label=names[i], **look) for i in there}


class Scale(NamedTuple):
    """Colour scale of all panels, and the values at which lines are drawn."""

    norm: Normalize
    levels: FloatArray


def plane_figure(chosen: Layout, *, title: str, caption: str) -> Figure:
    """An outcome over two parameters, in a panel for each controller and further value."""
    outcome, (x, y) = chosen.outcome, chosen.axes
    names, shown, means = controllers(outcome), words(outcome), meaning(outcome.name)
    first = best(outcome) if chosen.further is None else None
    count = len(chosen.cases) + (first is not None)
    columns = len(names) if chosen.further is not None and len(names) > 1 else in_rows(count)
    at = [words(v).factor * v.values for v in (x, y)]
    edges = [cell_edges(v) for v in at]
    scale = _scale(shown.factor * finite(outcome.values), means)
    with styled({"axes.grid": False, "hatch.linewidth": 0.5}):
        figure, drawn = panels(count, columns, 3.4, 2.7)
        along(drawn[0], "x", x)
        along(drawn[0], "y", y)
        handles: dict[str, Any] = {}
        for axes, case in zip(drawn, chosen.cases, strict=False):
            if means.yes_or_no:
                handles |= draw_categories(axes, edges, 1.0 - case.values, [*means.yes_or_no])
            else:
                _values(axes, at, edges, shown.factor * case.values, scale, noisy=bool(names))
            handles |= mark_cells(axes, edges, case, means)
            handles |= _borders(axes, at, case, means)
            axes.set_title(title_of(case), fontsize=sized(10))
        if first is not None:
            over = first.transpose(y.name, x.name).values
            handles |= _winners(drawn[-1], edges, over, outcome)
        label_outside(drawn, columns, words(x).label, words(y).lines(26))
        if not means.yes_or_no:
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
    """Draw colours, and lines of equal value or the values themselves."""
    cells = axes.pcolormesh(*edges, values, cmap=COLOURS, norm=scale.norm)
    cells.set_rasterized(values.size > CELLS)
    if min(values.shape) >= FINE:
        # Sensor noise differs from run to run; an analysis has none.
        _lines(axes, at, _calm(values) if noisy else values, scale)
    elif values.shape[1] <= ROOM:
        _numbers(axes, at, values, scale)


def _winners(
    axes: Axes, edges: list[FloatArray], first: FloatArray, outcome: DataArray
) -> dict[str, Any]:
    """Draw which controller does best in each cell."""
    word = "maximum" if meaning(outcome.name).better > 0 else "minimum"
    axes.set_title(f"controller with the {word}", fontsize=sized(10))
    texts = [f"best two within {100.0 * ALIKE:g} % of the scale"]
    texts += [f"{word}: {run_name(name)}" for name in controllers(outcome)]
    return draw_categories(axes, edges, first, texts)


def _scale(values: FloatArray, means: Outcome) -> Scale:
    """Colour scale, logarithmic for values that span decades; zeros with a mark do not count."""
    if means.zero:
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
    """Draw lines of equal value, with the value."""
    numbers = np.ma.masked_invalid(np.where(_coloured(values, scale), values, np.nan))
    if not numbers.count() or not np.ptp(numbers.compressed()):
        return
    others = scale.levels[scale.levels != 0.0]  # _borders draws zero
    look: dict[str, Any] = {"colors": "white", "linewidths": 1.0, "linestyles": "-"}
    lines = axes.contour(*at, numbers, levels=others, **look)
    lines.set_path_effects([withStroke(linewidth=1.8, foreground="#00000080")])
    look = {"fontsize": sized(8), "inline_spacing": 1, "fmt": lambda value: f"{value:g}"}
    taken: list[Any] = []  # by labels, which may meet where lines lie close together
    for text in axes.clabel(lines, **look):
        text.set_rotation(0.0)
        text.set_path_effects([withStroke(linewidth=1.8, foreground="black")])
        box = text.get_window_extent()
        if any(box.overlaps(other) for other in taken):
            text.remove()
        else:
            taken.append(box)


def _calm(values: FloatArray) -> FloatArray:
    """Median of each value and its neighbours."""
    known = np.isfinite(values)
    padded = np.pad(np.where(known, values, np.nan), 1, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, (3, 3)).reshape(*values.shape, 9)
    calm = values.copy()
    calm[known] = np.nanmedian(around[known], axis=-1)
    return calm


def _numbers(axes: Axes, at: list[FloatArray], values: FloatArray, scale: Scale) -> None:
    """Write the values into the cells."""
    for row, column in np.argwhere(_coloured(values, scale)):
        value = values[row, column]
        dark = float(scale.norm(value)) < 0.6
        look: dict[str, Any] = {"color": "white" if dark else "black", "fontsize": sized(7)}
        place: dict[str, Any] = {"ha": "center", "va": "center"}
        axes.text(at[0][column], at[1][row], f"{value:#.3g}".rstrip("."), **place, **look)


def _coloured(values: FloatArray, scale: Scale) -> Any:
    return np.isfinite(values) & ((values > 0.0) | (not isinstance(scale.norm, LogNorm)))


def _borders(axes: Axes, at: list[FloatArray], case: Case, means: Outcome) -> dict[str, Any]:
    """Draw where the demand equals the critical torque, and where the outcome changes sign."""
    handles: dict[str, Any] = {}
    kinds = ((case.margin, meaning(MARGIN).border, "-"), (case.values, means.border, DASHED))
    for values, text, dashes in kinds:
        numbers = np.ma.masked_invalid(np.nan if values is None else values)
        if min(case.values.shape) > 1 and numbers.count() and numbers.min() < 0.0 < numbers.max():
            axes.contour(*at, numbers, levels=[0.0], colors=paint.paper, linewidths=4.0)
            look: dict[str, Any] = {"colors": paint.ink, "linewidths": 2.2, "linestyles": [dashes]}
            axes.contour(*at, numbers, levels=[0.0], **look)
            handles[text] = Line2D([], [], color=paint.ink, lw=2.2, ls=dashes, label=text)
    return handles


def _bar(figure: Figure, drawn: list[Axes], scale: Scale, label: str) -> None:
    colours = ScalarMappable(scale.norm, COLOURS)
    bar = figure.colorbar(colours, ax=drawn, label=label, pad=0.015, aspect=28)
    bar.outline.set_visible(False)
    if isinstance(scale.norm, LogNorm):
        plain_log(bar.ax.yaxis, 1.0, 3.0)
