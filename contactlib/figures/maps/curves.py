"""Lines of an outcome over one parameter, one per controller or value of a second parameter."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from contactlib.base.quantities import FloatArray
from contactlib.figures.maps.layout import (
    Layout,
    along,
    controllers,
    frame,
    in_rows,
    label_outside,
    panels,
    title_of,
)
from contactlib.figures.maps.meaning import finite, meaning, wide, words
from contactlib.figures.scenario import run_name
from contactlib.figures.style import DASHED, DOTTED, paint, plain_log, sized, styled
from contactlib.runs.analysis import MARGIN

LOOKS = 4  # lines that differ


def look_of(number: int) -> dict[str, Any]:
    """Look of a line by its number: its dashes and marks differ as well as its colour."""
    looks: tuple[dict[str, Any], ...] = (
        {"color": paint.blue, "ls": "-", "marker": "o"},
        {"color": paint.orange, "ls": DASHED, "marker": "s"},
        {"color": paint.green, "ls": (0, (6, 1.5, 1, 1.5)), "marker": "^"},
        {"color": paint.ink, "ls": DOTTED, "marker": "D"},
    )
    return looks[number % LOOKS]


def curve_figure(chosen: Layout, *, title: str, caption: str) -> Figure:
    """An outcome over one parameter; if there is a second, each controller has a panel."""
    shown, (x,) = words(chosen.outcome), chosen.axes
    names, means = controllers(chosen.outcome), meaning(chosen.outcome.name)
    apart = bool(names) and chosen.further is not None
    count = len(names) if apart else 1
    columns = in_rows(count)
    with styled({"lines.markersize": 4.5}):
        figure, drawn = panels(count, columns, 3.4 if apart else 6.4, 2.9)
        along(drawn[0], "x", x)
        handles: dict[str, Any] = {}
        for index, case in enumerate(chosen.cases):
            panel, turn = (index % count, index // count) if apart else (0, index)
            look = look_of(turn) | {"lw": 2.0 if turn < LOOKS else 1.0}
            text = case.further if apart or case.controller is None else title_of(case)
            axes, at = drawn[panel], words(x).factor * x.values
            values = shown.factor * case.values
            axes.plot(at, np.where(np.isfinite(values), values, np.nan), label=text, **look)
            if text:
                handles[text] = Line2D([], [], label=text, **look)
            handles |= _beyond(axes, at[np.isposinf(values)], means.infinite, look, 1.0)
            handles |= _beyond(axes, at[case.failed], "failed", look, 0.0)
            if apart:
                axes.set_title(run_name(names[panel]), fontsize=sized(10))
        _height(drawn, shown.factor * finite(chosen.outcome.values), means.yes_or_no)
        label_outside(drawn, columns, words(x).label, shown.lines(30))
        if chosen.further is None:
            handles |= _border(drawn, words(x).factor * x.values, chosen.cases[0].margin)
        frame(figure, title, handles, caption)
    return figure


def _beyond(
    axes: Axes, at: FloatArray, name: str, look: dict[str, Any], height: float
) -> dict[str, Any]:
    """Mark points without a finite value at the edge of the axes."""
    if not at.size:
        return {}
    mark: dict[str, Any] = {"ls": "none", "marker": 6 if height else "x", "ms": 7}
    across = axes.get_xaxis_transform()
    edge = np.full(at.shape, height)
    axes.plot(at, edge, color=look["color"], transform=across, clip_on=False, **mark)
    return {name: Line2D([], [], color=paint.ink, label=name, **mark)}


def _border(drawn: list[Axes], at: FloatArray, margin: FloatArray | None) -> dict[str, Any]:
    """Mark where the demand equals the critical torque."""
    if margin is None or not np.isfinite(margin).all():
        return {}
    changes = np.flatnonzero(margin[1:] * margin[:-1] < 0.0)
    if not changes.size:
        return {}
    look: dict[str, Any] = {"color": paint.grey, "lw": 1.4, "ls": DOTTED}
    for i in changes:
        part = margin[i] / (margin[i] - margin[i + 1])
        for axes in drawn:
            axes.axvline(at[i] + part * (at[i + 1] - at[i]), **look)
    border = meaning(MARGIN).border
    return {border: Line2D([], [], label=border, **look)}


def _height(drawn: list[Axes], values: FloatArray, yes_or_no: tuple[str, str] | None) -> None:
    """Set the scale of the outcome, common to all panels."""
    if yes_or_no:
        drawn[0].set_yticks([1.0, 0.0], yes_or_no)
        for line in drawn[0].lines:
            line.set_drawstyle("steps-mid")
    elif wide(values):
        drawn[0].set_yscale("log")
        plain_log(drawn[0].yaxis, 1.0, 3.0)
    elif values.size and values.min() < 0.0 < values.max():
        for axes in drawn:
            axes.axhline(0.0, color=paint.grey, lw=1.0, zorder=1)
