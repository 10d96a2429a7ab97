"""Figures of a scenario: one run, or the controllers side by side.

Solid where the creep force rises with creepage, and a constant torque would hold the wheelset;
dashed on the falling branch, where it would not. What vibrates too fast to be seen as a line is
drawn as the band that it fills.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from contactlib.figures.branches import by_branch
from contactlib.figures.style import BLUE, DASHED, DOTTED, ORANGE, STYLE, new_figure, typeset
from contactlib.metrics import Metrics
from contactlib.simulation import Result

LOW_FRICTION = "#EDEDED"
LEAST_CREEPAGE = 1e-4  # lowest on a logarithmic axis [1]
MOST_CREEPAGE = 1.0  # beyond it one run does not stretch the axis of the others [1]
FASTEST_RIM = 2.5  # top of the axis of speed, over the vehicle's highest

NAMES = {
    "open_loop": "open loop",
    "threshold": "cut and re-apply",
    "creep_pi": "PI creep control",
    "slope_seeking": "slope seeking",
    "torque": "torque control",
    "creep": "creep control",
}


def run_name(key: str) -> str:
    """What a run is called in a title."""
    return NAMES.get(key, key.replace("_", " "))


def scenario_run(result: Result, metrics: Metrics, *, title: str, caption: str) -> Figure:
    """Force, creepage, torque and speed over the time of one run."""
    twisted = bool(np.any(result["axle_torque"]))
    with mpl.rc_context(STYLE):
        rows = 5 if twisted else 4
        figure, grid = new_figure(8.0, 1.7 * rows + 1.4, nrows=rows, sharex=True)
        _force(grid[0], result)
        _creepage(grid[1], result)
        _torque(grid[2], result)
        time = result.time
        _speed(grid[3], result)
        if twisted:
            by_branch(grid[4], result, 1e-3 * result["axle_torque"])
            grid[4].set_ylabel("axle torque  [kN m]")
        for axes in grid:
            _shade_low_friction(axes, result)
        _ylabels(grid)
        grid[-1].set_xlabel("time  [s]")
        grid[-1].set_xlim(time[0], time[-1])
        grid[0].set_title(_summary(metrics), loc="left", fontsize=9)
        _legend(figure, result, caption)
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left")
    return figure


def comparison(
    results: Mapping[str, Result], metrics: Mapping[str, Metrics], *, title: str, caption: str
) -> Figure:
    """Force, creepage and torque over time: a column for each controller, on common axes."""
    count = len(results)
    with mpl.rc_context(STYLE):
        common: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
        figure, grid = new_figure(max(5.0, 3.1 * count), 7.2, nrows=3, ncols=count, **common)
        for column, (name, result) in enumerate(results.items()):
            _force(grid[0, column], result)
            _creepage(grid[1, column], result)
            _torque(grid[2, column], result)
            for axes in grid[:, column]:
                _shade_low_friction(axes, result)
            grid[0, column].set_title(
                f"{run_name(name)}\n{_summary(metrics[name])}", loc="left", fontsize=9
            )
            grid[2, column].set_xlabel("time  [s]")
            grid[2, column].set_xlim(0.0, max(run.time[-1] for run in results.values()))
        _trim_creepage(list(grid[1]), list(results.values()))
        _ylabels(grid[:, 0])
        for axes in grid[:, 1:].flat:
            axes.set_ylabel("")
        _legend(figure, next(iter(results.values())), caption)
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left")
    return figure


def _summary(metrics: Metrics) -> str:
    used, work = metrics.adhesion_utilisation, metrics.slip_work
    share = "" if math.isnan(used) else f"{100.0 * used:.1f} % of the force used\n"
    return f"{share}slip work {_energy(work)}"


def _energy(work: float) -> str:
    size, unit = next((p for p in ((1e9, "GJ"), (1e6, "MJ")) if abs(work) >= p[0]), (1e3, "kJ"))
    return f"{work / size:.3g} {unit}"


def _force(axes: Axes, result: Result) -> None:
    sign = np.sign(result["demand"])
    available = np.where(sign == 0.0, np.nan, sign) * result["available_force"]
    axes.plot(result.time, 1e-3 * available, color="black", lw=1.2, ls=DOTTED)
    by_branch(axes, result, 1e-3 * result["creep_force"])
    _from_zero(axes)
    axes.set_ylabel("creep force  [kN]")


def _creepage(axes: Axes, result: Result) -> None:
    by_branch(axes, result, 100.0 * np.maximum(np.abs(result["creepage"]), LEAST_CREEPAGE))
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    steps = (1.0,) if high > 300.0 * low else (1.0, 2.0, 5.0) if high > 5.0 * low else range(1, 10)
    axes.yaxis.set_major_locator(LogLocator(subs=list(steps)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("|creepage|  [%]")


def _torque(axes: Axes, result: Result) -> None:
    axes.plot(result.time, 1e-3 * result["demand"], color="black", lw=1.2, ls=DOTTED)
    by_branch(axes, result, 1e-3 * result["drive_torque"])
    _from_zero(axes)
    axes.set_ylabel("drive torque  [kN m]")


def _speed(axes: Axes, result: Result) -> None:
    rim, speed = result["speed"] + result["slip_velocity"], result["speed"]
    axes.plot(result.time, rim, color=ORANGE, lw=0.9, label="rim of the wheel")
    axes.plot(result.time, speed, color="black", lw=1.3, label="vehicle")
    top = FASTEST_RIM * float(speed.max())
    if rim.max() > top > 0.0:
        axes.set_ylim(min(0.0, 1.05 * float(speed.min())), top)
        _leaves(axes, result, rim > top, f"rim: up to {rim.max():.0f} m/s")
    axes.set_ylabel("speed  [m/s]")
    axes.legend(loc="best")


def _trim_creepage(row: list[Axes], results: list[Result]) -> None:
    """Keep a run that goes away from stretching the common axis of creepage."""
    largest = [float(np.abs(result["creepage"]).max()) for result in results]
    if not min(largest) < MOST_CREEPAGE < max(largest):
        return
    row[0].set_ylim(top=100.0 * MOST_CREEPAGE)
    for axes, result, most in zip(row, results, largest, strict=True):
        if most > MOST_CREEPAGE:
            beyond = np.abs(result["creepage"]) > MOST_CREEPAGE
            _leaves(axes, result, beyond, f"up to {100.0 * most:.0f} %")


def _leaves(axes: Axes, result: Result, beyond: Any, text: str) -> None:
    """Say how far a line goes beyond the top of its axes, where it is beyond."""
    time = result.time
    early = time[beyond.argmax()] < 0.5 * (time[0] + time[-1])
    axes.annotate(
        text,
        (time[beyond.argmax()], 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(6 if early else -6, -4),
        textcoords="offset points",
        ha="left" if early else "right",
        va="top",
        fontsize=9,
    )


def _from_zero(axes: Axes) -> None:
    """Let an axis of a quantity that keeps its sign begin at zero."""
    low, high = axes.get_ylim()
    if low > 0.0:
        axes.set_ylim(bottom=0.0)
    elif high < 0.0:
        axes.set_ylim(top=0.0)


def _shade_low_friction(axes: Axes, result: Result) -> None:
    """Mark the times at which a wheel has less friction than at its best."""
    friction = np.minimum(result["friction_scale_left"], result["friction_scale_right"])
    low = friction < 0.99 * friction.max()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], low, [False]]).astype(int)))
    for start, end in edges.reshape(-1, 2):
        axes.axvspan(
            result.time[start],
            result.time[min(end, result.time.size - 1)],
            color=LOW_FRICTION,
            zorder=0,
            lw=0,
        )


def _ylabels(column: Any) -> None:
    column[0].figure.align_ylabels(column)


def _legend(figure: Figure, result: Result, caption: str) -> None:
    """What the lines are, under the caption."""
    friction = np.minimum(result["friction_scale_left"], result["friction_scale_right"])
    handles: list[Any] = [
        Line2D([], [], color=BLUE, label="rising branch"),
        Line2D([], [], color=ORANGE, ls=DASHED, label="falling branch"),
        Line2D([], [], color="black", ls=DOTTED, lw=1.2, label="available, demanded"),
    ]
    if friction.min() < 0.99 * friction.max():
        handles.append(Patch(color=LOW_FRICTION, label="low friction"))
    figure.legend(
        handles=handles,
        loc="outside lower left",
        ncols=len(handles),
        title=typeset(figure, caption),
        title_fontsize=9,
        alignment="left",
    )
