"""Figures of runs: the slip-away through the axles, time histories, and the force used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrow, Rectangle

from .run import Run
from .vehicle import AXLES

COLOURS = ("#D55E00", "#E69F00", "#0072B2", "#56B4E9")  # of the axles from the front
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


def time_histories(run: Run) -> Figure:
    """Torque, creepage, creep force and friction of the four axles over time."""
    figure = Figure(figsize=(7.0, 6.6))
    rows = figure.subplots(4, 1, sharex=True)
    signals = (
        (1e-3 * run.torque, "torque\n[kN m]"),
        (100.0 * np.maximum(run.creepage, 0.05e-2), "creepage\n[%]"),
        (1e-3 * run.creep_force, "creep force\n[kN]"),
        (run.friction.mean(axis=-1), "friction\nscale [1]"),
    )
    for axes, (values, label) in zip(rows, signals, strict=True):
        for axle in range(AXLES):
            axes.plot(run.time, values[:, axle], color=COLOURS[axle], lw=1.1)
        axes.set_ylabel(label)
        axes.set_xlim(0.0, run.time[-1])
    rows[1].set_yscale("log")
    rows[-1].set_xlabel("time [s]")
    lines = rows[0].get_lines()
    names = ["axle 1, leading", "axle 2", "axle 3", "axle 4"]
    figure.legend(lines, names, loc="outside upper center", ncols=AXLES)
    return figure


def bars(shares: Mapping[str, Mapping[str, float]], label: str) -> Figure:
    """Bars of numbers by row and by case."""
    figure = Figure(figsize=(7.0, 4.6))
    axes = figure.subplots()
    cases = list(next(iter(shares.values())))
    height = 0.8 / len(cases)
    for i, (case, colour) in enumerate(zip(cases, ("#6E6E6E", *COLOURS), strict=False)):
        values = [found[case] for found in shares.values()]
        places = np.arange(len(shares)) + (i - 0.5 * (len(cases) - 1)) * height
        drawn = axes.barh(places, values, 0.9 * height, color=colour, label=case)
        axes.bar_label(
            drawn, ["" if np.isnan(v) else f"{v:.2f}" for v in values], padding=2, fontsize=8
        )
    axes.set_axisbelow(True)
    axes.set_yticks(np.arange(len(shares)), list(shares))
    axes.invert_yaxis()
    axes.set(xlabel=label, xlim=(0.0, 1.35))
    axes.grid(visible=False, axis="y")
    figure.legend(loc="outside upper center", ncols=3, fontsize=9)
    return figure
