"""A figure of a run: the slip-away through the axles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrow, Rectangle

from .run import Run

FORCE = 2.5 / 5e4  # length of an arrow over its force [m/N]
NORM = LogNorm(1e-3, 3.0)


def film_strip(run: Run, times: Sequence[float]) -> Figure:
    """Side views at some times [s]: creepage as colour and number, creep force as an arrow.

    The body's pitch is shown 10 times as large.
    """
    figure = Figure(figsize=(7.0, 1.2 * len(times)))
    axes = np.atleast_1d(figure.subplots(len(times), 1, sharex=True))
    for one, time in zip(axes, times, strict=True):
        _side_view(one, run, int(np.argmin(np.abs(run.time - time))))
        one.text(-13.3, 2.5, f"{time:.1f} s", va="center", fontsize=11)
    bar = figure.colorbar(_shades(axes[0]), ax=list(axes), label="creepage [%]", fraction=0.03)
    bar.ax.yaxis.set_major_formatter(lambda value, place: f"{100.0 * value:g}")
    return figure


def _shades(axes: Axes) -> Any:
    return axes.scatter([], [], c=[], cmap="YlOrRd", norm=NORM)


def _side_view(axes: Axes, run: Run, row: int) -> None:
    v, radius = run.locomotive.vehicle, run.locomotive.wheelset.radius
    tilt = -10.0 * run.coordinates[row, 4]
    style = {"facecolor": "#DDE6EE", "edgecolor": "#555555", "lw": 0.8}
    turned = {"angle": np.degrees(tilt), "rotation_point": "center"}
    axes.add_patch(Rectangle((-9.0, 1.5), 18.0, 2.2, **style, **turned))  # type: ignore[arg-type]
    for end in (1.0, -1.0):
        pivot = end * v.half_pivot_distance
        frame = Rectangle((pivot - 2.1, 0.55), 4.2, 0.35, facecolor="#888888")
        axes.add_patch(frame)
    places = [e * v.half_pivot_distance + w * v.half_wheelbase for e in (1, -1) for w in (1, -1)]
    shade = _shades(axes)
    for axle, x in enumerate(places):
        creepage, force = float(run.creepage[row, axle]), float(run.creep_force[row, axle])
        colour = shade.to_rgba(max(creepage, 1e-3))
        axes.add_patch(Circle((x, radius), 1.25 * radius, facecolor=colour, edgecolor="k", lw=0.8))
        style = {"width": 0.16, "head_width": 0.5, "head_length": 0.4, "color": "#0072B2"}
        axes.add_patch(
            FancyArrow(x, -0.55, FORCE * force, 0.0, length_includes_head=True, **style)  # type: ignore
        )
        percent = 100.0 * creepage
        shown = f"{percent:.0f} %" if percent >= 10.0 else f"{percent:.1f} %"
        axes.text(x, 2.4, shown, ha="center", va="center", fontsize=10)
        on = "white" if creepage > 0.5 else "black"
        axes.text(x, radius, str(axle + 1), ha="center", va="center", fontsize=8, color=on)
    axes.axhline(-0.13, color="k", lw=1.0)
    axes.set(xlim=(-13.5, 9.8), ylim=(-0.9, 4.1), aspect="equal")
    axes.axis("off")
