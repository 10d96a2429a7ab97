"""Stopping distances of a catalogue: every draw, and what can be promised."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from contactlib.figures.maps import Handles, _frame, _plain, _sentences
from contactlib.figures.scenario import run_name
from contactlib.figures.style import DASHED, new_figure, paint, sized, styled, wrapped
from contactlib.runs.stops import CONFIDENCE, Stop, quantile
from contactlib.runs.sweep import Sweep

PROMISED = 0.95  # of the stops are shorter than the quantile that is drawn
GOLDEN = 0.618034  # spreads points evenly
READING = (
    f"Bars: {100.0 * CONFIDENCE:g} % confidence intervals of the quantiles, by order statistics. "
    "An arrow marks an unknown end"
)


def stopping_distances(sweep: Sweep, stops: Sequence[Stop]) -> Figure:
    """Stopping distances of the stops of a catalogue, a panel for each value of its first axis.

    Parameters
    ----------
    sweep : Sweep
        The sweep, for title, source and names of the axes.
    stops : sequence of Stop
        From `contactlib.runs.stops.stops_of`.
    """
    labels = {axis.name: _plain(axis.label) for axis in sweep.plan.axes}
    first, *others = [labels.get(name, "") for name in stops[0].conditions] or [""]
    groups = dict[str, list[Stop]]()
    for stop in stops:
        groups.setdefault(next(iter(stop.conditions.values()), ""), []).append(stop)
    columns = 2 if len(groups) in (2, 4) else min(len(groups), 3)
    rows = -(-len(groups) // columns)
    high = max(1.6, 0.42 * max(map(len, groups.values())) + 0.9)
    with styled():
        figure, grid = new_figure(9.6, rows * high + 1.4, nrows=rows, ncols=columns, squeeze=False)
        handles: Handles = {}
        for number, (axes, name) in enumerate(zip(grid.flat, groups, strict=False)):
            handles |= _panel(axes, groups[name], labels=number % columns == 0)
            axes.set_title(f"{first} {name}", fontsize=sized(10))
            axes.set_ylabel(
                wrapped(", ".join(filter(None, others)), 30) if number % columns == 0 else ""
            )
            axes.set_xlabel("stopping distance [m]" if number + columns >= len(groups) else "")
        for axes in grid.flat[len(groups) :]:
            axes.remove()
    _frame(figure, _plain(sweep.name), handles, _sentences(_plain(sweep.source), READING))
    return figure


def _panel(axes: Axes, group: Sequence[Stop], *, labels: bool) -> Handles:
    """Draw the stops of a panel, the first one on top; return handles of the legend."""
    handles: Handles = {}
    every = np.concatenate([[stop.limit, *stop.distance] for stop in group])
    finite = every[np.isfinite(every)] if np.isfinite(every).any() else np.array([0.0, 1.0])
    low, end = finite.min(), finite.max() + 0.06 * (np.ptp(finite) or finite.max())

    def draw(name: str, x: Any, y: Any, **look: Any) -> None:
        axes.plot(x, y, **look)
        handles[name] = Line2D([], [], label=name, **look)

    for row, stop in enumerate(group):
        spread = 0.22 * (2.0 * (np.arange(stop.distance.size) * GOLDEN % 1.0) - 1.0)
        points: dict[str, Any] = {
            "marker": "o",
            "ms": 3.0,
            "mew": 0.0,
            "alpha": 0.6,
            "color": paint.blue,
        }
        draw("one stop", stop.distance, row + spread, ls="none", **points)
        look: dict[str, Any]
        for name, part, look in (
            ("median", 0.5, {"color": paint.ink, "marker": "|", "ms": 13, "mew": 2.0}),
            (f"{100.0 * PROMISED:g} % quantile", PROMISED, {"color": paint.orange, "marker": "D"}),
        ):
            value, left, right = quantile(stop.distance, part)
            ends = [max(left, low), min(right, end)]
            axes.plot(ends, [row, row], color=look["color"], lw=1.8, solid_capstyle="butt")
            if np.isinf(right):
                axes.plot(end, row, color=look["color"], marker=">", ms=5, clip_on=False)
            draw(name, value, row, **{"ms": 5, "zorder": 4, "lw": 1.8, **look})
        if np.isfinite(stop.limit):
            limit, at = [stop.limit, stop.limit], [row - 0.4, row + 0.4]
            draw("limit", limit, at, color=paint.ink, lw=1.2, ls=DASHED)
        if without := np.isinf(stop.distance).sum():
            text = f"{without} without a stop"
            axes.text(end, row - 0.25, text, ha="right", va="bottom", fontsize=sized(7.5))
    rest = [[*stop.conditions.values()][1:] for stop in group]
    names = [", ".join(map(run_name, values)) if labels else "" for values in rest]
    axes.set_yticks(np.arange(len(group)), names, fontsize=sized(8.5))
    axes.set(ylim=(len(group) - 0.45, -0.55), xlim=(low - 0.03 * (end - low), end))
    axes.grid(visible=False, axis="y")
    return handles
