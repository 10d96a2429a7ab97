"""Figures of a scenario: one run, or a comparison of the controllers.

Lines are solid where the creep force rises with creepage, and dashed on the falling branch, where
the wheelset is unstable at constant torque. A signal that vibrates too fast to be seen as a line is
drawn as the band that it fills.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.figures.style import (
    DASHED,
    DOTTED,
    by_stability,
    labelled,
    new_figure,
    note,
    paint,
    plain_log,
    sized,
    styled,
    typeset,
)
from contactlib.runs.outcomes import Metrics
from contactlib.runs.result import Result

BINS = 200  # time intervals in which a band is drawn
SWINGS, MANY = 3.0, 0.2  # a band needs so many crossings per bin, in this fraction of the bins
MIN_CREEPAGE = 1e-4  # lowest on a logarithmic axis [1]
MAX_CREEPAGE = 1.0  # end of the common creepage axis if only some runs go beyond it [1]
FASTEST_RIM = 2.5  # top of the speed axis / highest speed of the vehicle

STOPPED = 0.01  # speed of a vehicle that has stopped [m/s]
GIVEN = "available (force), demanded (torque)"  # what a dotted line shows
NAMES = {
    "open_loop": "open loop",
    "threshold": "cut and re-apply",
    "creep_pi": "PI creep control",
    "slope_seeking": "slope seeking",
    "wsp": "wheel-slide protection",
    "torque": "torque control",
    "creep": "creep control",
}


def run_name(key: str) -> str:
    """Name of a run in a title."""
    return NAMES.get(key, key.replace("_", " "))


def scenario_run(result: Result, metrics: Metrics, *, title: str, caption: str) -> Figure:
    """Force, creepage, torque and speed over the time of one run."""
    twisted = bool(np.any(result["axle_torque"]))
    with styled():
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
        figure.align_ylabels(grid)
        grid[-1].set(xlabel="time  [s]", xlim=(time[0], time[-1]))
        grid[0].set_title(_summary(result, metrics), fontsize=sized(9))
        _legend(figure, result, caption)
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left")
    return figure


def comparison(
    results: Mapping[str, Result], metrics: Mapping[str, Metrics], *, title: str, caption: str
) -> Figure:
    """Force, creepage and torque over time, with one column per controller and common axes.

    Speeds are drawn, too, if a vehicle stops.
    """
    count, stops = len(results), any(map(_stops, results.values()))
    with styled():
        common: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
        figure, grid = new_figure(
            max(5.0, 3.1 * count), 9.0 if stops else 7.2, nrows=3 + stops, ncols=count, **common
        )
        for column, (name, result) in enumerate(results.items()):
            _force(grid[0, column], result)
            _creepage(grid[1, column], result)
            _torque(grid[2, column], result)
            if stops:
                _speed(grid[3, column], result)
            for axes in grid[:, column]:
                _shade_low_friction(axes, result)
            heading = f"{run_name(name)}\n{_summary(result, metrics[name])}"
            grid[0, column].set_title(heading, fontsize=sized(9))
            end = max(run.time[-1] for run in results.values())
            grid[-1, column].set(xlabel="time  [s]", xlim=(0.0, end))
            grid[-1, column].xaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
        _trim_creepage(list(grid[1]), list(results.values()))
        figure.align_ylabels(grid[:, 0])
        for axes in grid[:, 1:].flat:
            axes.set_ylabel("")
        _legend(figure, next(iter(results.values())), caption)
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left")
    return figure


def _summary(result: Result, metrics: Metrics) -> str:
    used, limited = metrics.adhesion_utilisation, metrics.limited_utilisation
    share = "" if math.isnan(used) else f"{100.0 * used:.1f} % of demanded force used\n"
    if not math.isnan(limited):
        share = f"{100.0 * limited:.1f} % used where friction limits\n"
    rim, top = _rim_and_top(result)
    beyond = f", rim up to {rim.max():.0f} m/s" if rim.max() > top > 0.0 else ""
    stop = f", stops after {metrics.distance:.0f} m" if _stops(result) else ""
    return f"{share}slip work {_energy(metrics.slip_work)}{beyond}{stop}"


def _stops(result: Result) -> bool:
    """Whether the vehicle stops and stays where it is."""
    return bool(abs(result["speed"][-1]) < STOPPED < abs(result["speed"][0]))


def _rim_and_top(result: Result) -> tuple[FloatArray, float]:
    """Rim speed, and the top of its axis, beyond which a wheel has slipped away."""
    return result["speed"] + result["slip_velocity"], FASTEST_RIM * float(result["speed"].max())


def _energy(work: float) -> str:
    size, unit = next((p for p in ((1e9, "GJ"), (1e6, "MJ")) if abs(work) >= p[0]), (1e3, "kJ"))
    return f"{work / size:.3g} {unit}"


def by_branch(axes: Axes, result: Result, values: FloatArray) -> None:
    """Draw a signal of a run, as lines or as a band."""
    rises = result["falling_branch"] == 0.0
    starts = np.linspace(0, values.size, BINS, endpoint=False).astype(int)
    if values.size <= 4 * BINS or not _vibrates(values, starts):
        by_stability(axes, result.time, values, rises, lw=1.3)
        return
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    at, all_rise = result.time[starts], np.minimum.reduceat(rises, starts)
    at[-1] = result.time[-1]
    axes.fill_between(at, low, high, color=paint.mixed(48), lw=0.0)
    for edge in (low, high):
        by_stability(axes, at, edge, all_rise, lw=1.3)


def _vibrates(values: FloatArray, starts: NDArray[np.int_]) -> bool:
    """Whether a signal oscillates within many bins, with an amplitude above that of noise."""
    widths = np.maximum.reduceat(values, starts) - np.minimum.reduceat(values, starts)
    ways = np.add.reduceat(np.abs(np.diff(values, append=values[-1])), starts)
    usual = float(np.ptp(np.quantile(values, [0.01, 0.99])))  # without single peaks
    swings = np.divide(ways, widths, out=np.zeros_like(ways), where=widths > 0.0)
    return float(np.mean((swings > SWINGS) & (widths > 0.15 * usual))) > MANY


def _force(axes: Axes, result: Result) -> None:
    sign = np.sign(result["demand"])
    available = np.where(sign == 0.0, np.nan, sign) * result["available_force"]
    axes.plot(result.time, 1e-3 * available, color=paint.ink, lw=1.2, ls=DOTTED)
    by_branch(axes, result, 1e-3 * result["creep_force"])
    _from_zero(axes)
    axes.set_ylabel("creep force  [kN]")


def _creepage(axes: Axes, result: Result) -> None:
    by_branch(axes, result, 100.0 * np.maximum(np.abs(result["creepage"]), MIN_CREEPAGE))
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    steps = (1.0,) if high > 300.0 * low else (1.0, 2.0, 5.0) if high > 5.0 * low else range(1, 10)
    plain_log(axes.yaxis, *steps)
    axes.set_ylabel("|creepage|  [%]")


def _torque(axes: Axes, result: Result) -> None:
    axes.plot(result.time, 1e-3 * result["demand"], color=paint.ink, lw=1.2, ls=DOTTED)
    by_branch(axes, result, 1e-3 * result["drive_torque"])
    _from_zero(axes)
    axes.set_ylabel("drive torque  [kN m]")


def _speed(axes: Axes, result: Result) -> None:
    (rim, top), speed = _rim_and_top(result), result["speed"]
    axes.plot(result.time, rim, color=paint.orange, lw=0.9, label="wheel rim")
    axes.plot(result.time, speed, color=paint.ink, lw=1.3, label="vehicle")
    if rim.max() > top > 0.0:
        axes.set_ylim(min(0.0, 1.05 * float(speed.min())), top)
        _leaves(axes, result, rim > top, f"rim: up to {rim.max():.0f} m/s")
    labelled(axes, y="speed  [m/s]", legend={"loc": "best"})


def _trim_creepage(row: list[Axes], results: list[Result]) -> None:
    """Limit the common creepage axis if only some runs slip away."""
    largest = [float(np.abs(result["creepage"]).max()) for result in results]
    if not min(largest) < MAX_CREEPAGE < max(largest):
        return
    row[0].set_ylim(top=100.0 * MAX_CREEPAGE)
    for axes, result, highest in zip(row, results, largest, strict=True):
        if highest > MAX_CREEPAGE:
            beyond = np.abs(result["creepage"]) > MAX_CREEPAGE
            _leaves(axes, result, beyond, f"up to {100.0 * highest:.0f} %")


def _leaves(axes: Axes, result: Result, beyond: Any, text: str) -> None:
    """Write the maximum of a line beyond the top of its axes, where it leaves them."""
    time = result.time
    early = time[beyond.argmax()] < 0.5 * (time[0] + time[-1])
    side, offset = ("left", (6, -4)) if early else ("right", (-6, -4))
    look = {"xycoords": ("data", "axes fraction"), "ha": side, "va": "top", "fontsize": sized(9)}
    note(axes, text, (time[beyond.argmax()], 1.0), offset, **look)


def _from_zero(axes: Axes) -> None:
    """Start the axis of a quantity that keeps its sign at zero."""
    low, high = axes.get_ylim()
    if low > 0.0:
        axes.set_ylim(bottom=0.0)
    elif high < 0.0:
        axes.set_ylim(top=0.0)


def _low_friction(result: Result) -> NDArray[np.bool_]:
    """Whether a wheel has less friction, or both a lower slope, than their highest in the run."""
    friction = np.minimum(result["friction_scale_left"], result["friction_scale_right"])
    slope = result["slope_scale"]
    return np.asarray((friction < 0.99 * friction.max()) | (slope < 0.99 * slope.max()))


def _shade_low_friction(axes: Axes, result: Result) -> None:
    low = np.concatenate([[False], _low_friction(result), [False]])
    edges = np.flatnonzero(np.diff(low.astype(int)))
    for start, end in edges.reshape(-1, 2):
        until = result.time[min(end, result.time.size - 1)]
        axes.axvspan(result.time[start], until, color=paint.shade, zorder=0, lw=0)


def _legend(figure: Figure, result: Result, caption: str) -> None:
    """Caption under the figure, and a key to the lines below it."""
    handles: list[Any] = [
        Line2D([], [], color=paint.blue, label="rising branch"),
        Line2D([], [], color=paint.orange, ls=DASHED, label="falling branch"),
        Line2D([], [], color=paint.ink, ls=DOTTED, lw=1.2, label=GIVEN),
    ]
    if _low_friction(result).any():
        slope = " or slope" if np.ptp(result["slope_scale"]) > 0.0 else ""
        handles.append(Patch(color=paint.shade, label=f"low friction{slope}"))
    figure.legend(
        handles=handles,
        loc="outside lower left",
        ncols=len(handles) if figure.get_figwidth() > 7.0 else 2,
        title=typeset(figure, caption),
        title_fontsize=sized(9),
        alignment="left",
    )
