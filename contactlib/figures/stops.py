"""Stopping distances of a catalogue: every draw, and what can be promised."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

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
READING = (
    f"Bars: {100.0 * CONFIDENCE:g} % confidence intervals of the quantiles, by order statistics. "
    "An arrow marks an unknown end"
)


def stopping_distances(sweep: Sweep, stops: Sequence[Stop]) -> Figure:
    """Stopping distances of the stops of a catalogue, a panel for each value of its first axis.

    Parameters
    ----------
    sweep : Sweep
        The sweep, for title and source.
    stops : sequence of Stop
        From `contactlib.runs.stops.stops_of`.
    """
    ordered = sorted(stops, key=lambda stop: _first(stops, stop))
    panels = [(name, [*group]) for name, group in groupby(ordered, _panel)]
    columns = 2 if len(panels) in (2, 4) else min(len(panels), 3)
    rows = -(-len(panels) // columns)
    labels = {axis.name: _plain(axis.label) for axis in sweep.plan.axes}
    label = [labels[name] for name in stops[0].conditions]
    several = len({stop.controller for stop in stops}) > 1
    with styled({"lines.markersize": 4.5}):
        high = max(1.6, 0.42 * max(len(group) for _, group in panels) + 0.9)
        figure, grid = new_figure(9.6, rows * high + 1.4, nrows=rows, ncols=columns, squeeze=False)
        handles: Handles = {}
        for number, axes in enumerate(grid.flat):
            if number >= len(panels):
                axes.remove()
                continue
            name, group = panels[number]
            handles |= _panel_of(axes, group, labels=number % columns == 0, several=several)
            axes.set_title(" ".join([*label[:1], name]), fontsize=sized(10))
            if number % columns == 0:
                axes.set_ylabel(wrapped(", ".join(label[1:]), 30))
            if number + columns >= len(panels):
                axes.set_xlabel("stopping distance [m]")
    _frame(figure, _plain(sweep.name), handles, _sentences(_plain(sweep.source), READING))
    return figure


def _panel(stop: Stop) -> str:
    """Title of the panel of a stop: the value of the catalogue's first axis."""
    return next(iter(stop.conditions.values()), "")


def _first(stops: Sequence[Stop], stop: Stop) -> int:
    return next(i for i, other in enumerate(stops) if _panel(other) == _panel(stop))


def _panel_of(axes: Axes, group: Sequence[Stop], *, labels: bool, several: bool) -> Handles:
    """Draw the stops of a panel, the first one on top; return handles of the legend."""
    handles: Handles = {}
    finite = np.concatenate([stop.distance[np.isfinite(stop.distance)] for stop in group])
    low, high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
    end = high + 0.06 * (high - low or high)
    for row, stop in enumerate(group):
        shift = 0.22 * (2.0 * (np.arange(stop.distance.size) * 0.618034 % 1.0) - 1.0)  # spread
        points = {"color": paint.blue, "ls": "none", "marker": "o", "ms": 3.0, "mew": 0.0}
        axes.plot(stop.distance, row + shift, alpha=0.6, rasterized=shift.size > 300, **points)
        handles["one stop"] = Line2D([], [], label="one stop", **points | {"ms": 4.0})
        median, promised = quantile(stop.distance, 0.5), quantile(stop.distance, PROMISED)
        for name, found, look in (
            ("median", median, {"color": paint.ink, "marker": "|", "ms": 13, "mew": 2.0}),
            (
                f"{100.0 * PROMISED:g} % quantile",
                promised,
                {"color": paint.orange, "marker": "D", "ms": 5},
            ),
        ):
            bar = max(found.low, low), min(found.high, end)
            axes.plot(bar, (row, row), color=look["color"], lw=1.8, solid_capstyle="butt")
            if np.isinf(found.high):
                axes.plot(end, row, color=look["color"], marker=">", ms=5, clip_on=False)
            axes.plot(found.value, row, ls="none", zorder=4, **look)
            handles[name] = Line2D([], [], label=name, lw=1.8, **look)
        if np.isfinite(stop.limit):
            line = {"color": paint.ink, "lw": 1.2, "ls": DASHED}
            axes.plot((stop.limit, stop.limit), (row - 0.4, row + 0.4), **line)
            handles["limit"] = Line2D([], [], label="limit", **line)
        if left := stop.unstopped + stop.failed:
            look = {"ha": "right", "va": "bottom", "fontsize": sized(7.5), "color": paint.ink}
            axes.text(end, row - 0.25, f"{left} without a stop", **look)
    names = [_row(stop, several) if labels else "" for stop in group]
    axes.set_yticks(np.arange(len(group)), names, fontsize=sized(8.5))
    axes.set(ylim=(len(group) - 0.45, -0.55), xlim=(low - 0.03 * (end - low), end))
    axes.grid(visible=False, axis="y")
    return handles


def _row(stop: Stop, several: bool) -> str:
    rest = ", ".join([*stop.conditions.values()][1:])
    return "\n".join(filter(None, [rest, run_name(stop.controller) if several else ""]))
