"""Figures of a scenario: one run, of a wheelset or of axles, or a comparison of the controllers.

Lines are solid where the creep force rises with creepage, and dashed on the falling branch, where
the wheelset is unstable at constant torque. A signal that vibrates too fast to be seen as a line is
drawn as its envelope, whose edges have the look of the samples that they touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

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
    drawn_creepage,
    line_length,
    new_columns,
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

WINDOWS = 200  # of the longest run, each with one minimum and maximum in an envelope
SAMPLES = 4  # a window has more of them than this
SWINGS, MANY = 3.0, 0.2  # an envelope needs so many crossings per window, in this part of them
MIN_CREEPAGE = 1e-4  # lowest on a logarithmic axis [1]
MAX_CREEPAGE = 1.0  # end of the common creepage axis if only some runs go beyond it [1]
FASTEST_RIM = 2.5  # top of the speed axis / highest speed of the vehicle

STOPPED = 0.01  # speed of a vehicle that has stopped [m/s]
HELD = 0.05  # mean torque / demand of braking above which a brake holds a vehicle
WRITTEN = 0.025  # part of an axis that a character of a number takes
EVEN = 0.05  # change / top of the axis below which friction is even
EVENTFUL = 0.01  # change of a signal that is seen / its range
MARGIN = 0.04  # of the time in which the vehicle stands, shown / time in which it does not
OF_ALL = "Forces and torques are sums; creepage, branch and friction are the worst of the axles."
LARGEST = ("creepage", "creepage_left", "creepage_right", "slip_velocity")  # of a whole vehicle
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


class Units(NamedTuple):
    """Units of a scenario's file: that of speeds, its number in 1 m/s, and that of friction."""

    speed: str = "m/s"
    per_speed: float = 1.0
    friction: float = 1.0  # at the factor 1: a coefficient if the file gives coefficients, else 1
    peaks: bool = False  # whether the file gives largest traction coefficients


IN_SI = Units()
SLOPE = "slope factor"
GRAINS: dict[str, Any] = {"hatch": "...", "fc": "none", "ec": paint.ink, "lw": 0.0}  # of sand


class _Drawn(NamedTuple):
    """A run, where its rows lie along the axis of its figure, and an envelope's window [s]."""

    result: Result
    at: FloatArray
    creepage: FloatArray
    window: float
    units: Units


AXES = {"time": "time  [s]", "distance": "distance  [m]"}


def scenario_run(
    result: Result,
    metrics: Metrics | Sequence[Metrics],
    *,
    title: str,
    caption: str,
    over: str = "time",
    minimum_speed: float = 0.0,
    units: Units = IN_SI,
) -> Figure:
    """Force, creepage, torque, speed and friction over the time or the distance of one run.

    A vehicle has a column for each axle, on common axes, with the load in place of the creepage.

    Parameters
    ----------
    result : Result
        Result of `run_scenario`.
    metrics : Metrics or sequence of Metrics
        `contactlib.metrics` of the run, or of each axle of a vehicle, for the headings.
    title, caption : str
        Title, and caption below the figure.
    over : str, optional
        "time", or "distance", which is that of each axle: axles pass a place of the track at one
        point of their axes.
    minimum_speed : float, optional
        Lowest speed at which a creepage is drawn [m/s].
    units : Units, optional
        Units of speeds and friction.
    """
    every = [metrics] if isinstance(metrics, Metrics) else metrics
    runs = _drawn(result.by_axle, over, minimum_speed, units)
    alone = len(runs) == 1
    headings = [_summary(run, one) for run, one in zip(runs, every, strict=True)]
    if not alone:
        headings = [f"axle {i}\n{heading}" for i, heading in enumerate(headings, start=1)]
    panels = [_force, _creepage if alone else _load, _torque, _speed]
    panels += [_axle_torque] * bool(np.any(result["axle_torque"]))
    return _figure(runs, panels, headings, title, caption, over, alone=alone)


def comparison(
    results: Mapping[str, Result],
    metrics: Mapping[str, Metrics],
    *,
    title: str,
    caption: str,
    over: str = "time",
    minimum_speed: float = 0.0,
    units: Units = IN_SI,
) -> Figure:
    """Force, creepage, torque and friction, with one column per controller and common axes.

    Forces and torques of a vehicle are sums; creepage, branch and friction are the worst of its
    axles, and the distance is that of the first one. Speeds are drawn, too, if a vehicle starts,
    stops or turns.

    Parameters
    ----------
    results, metrics : mapping
        Results of `run_scenario`, and `contactlib.metrics` of each, by name.
    title, caption, over, minimum_speed, units
        As for `scenario_run`.
    """
    every = [_whole(result) for result in results.values()]
    if any(result.axles > 1 for result in results.values()):
        caption = f"{OF_ALL} {caption}"
    runs = _drawn(every, over, minimum_speed, units)
    headings = [
        f"{run_name(name)}\n{_summary(run, metrics[name])}"
        for name, run in zip(results, runs, strict=True)
    ]
    panels = [_force, _creepage, _torque, *[_speed] * any(map(_stands, every))]
    return _figure(runs, panels, headings, title, caption, over)


def _whole(result: Result) -> Result:
    """A vehicle's signals as those of one wheelset."""
    if result.axles == 1:
        return result
    rows, worst = np.arange(result.time.size), np.abs(result["slip_velocity"]).argmax(axis=1)
    signals = {**result.axle(1).signals, **result.totals}
    signals |= {name: result[name][rows, worst] for name in LARGEST}
    signals |= {name: result[name].sum(axis=1) for name in ("demand", "commanded_torque")}
    for name in ("friction_scale_left", "friction_scale_right", "slope_scale"):
        signals[name] = result[name].min(axis=1)
    for name in {"falling_branch", "sand"} & {*result.units}:
        signals[name] = result[name].max(axis=1)
    return Result(result.time, signals, result.units)


def _figure(
    runs: Sequence[_Drawn],
    panels: Sequence[Callable[[Axes, _Drawn], object]],
    headings: Sequence[str],
    title: str,
    caption: str,
    over: str,
    *,
    alone: bool = False,
) -> Figure:
    """Draw the panels of each run in a column, on common axes, and the friction below them."""
    varies = _friction_varies(runs)
    rows, long = len(panels), 0.2 * max(len(caption) / 120.0 - 4.0, 0.0)  # a caption of many lines
    with styled():
        if alone:
            size = 8.0, 1.7 * rows + 1.4 + varies
            heights = [1.0] * rows + [0.4] * varies
            look: dict[str, Any] = {"nrows": len(heights), "height_ratios": heights}
            figure, grid = new_figure(*size, sharex=True, squeeze=False, **look)
        else:
            figure, grid = new_columns(len(runs), rows, varies, long)
        for column, run, heading in zip(grid.T, runs, headings, strict=True):
            for axes, panel in zip(column, panels, strict=False):
                panel(axes, run)
            column[0].set_title(heading, fontsize=sized(9))
            column[-1].set(xlabel=AXES[over], xlim=_limits(runs, over))
            if not alone:
                column[-1].xaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
        if _creepage in panels:
            _trim_creepage(list(grid[panels.index(_creepage)]), runs)
        if varies:
            _friction(grid[-1], runs)
        if alone:
            figure.align_ylabels(grid)
        else:
            _label_first(figure)
        lines = grid[panels.index(_speed), 0].lines if _speed in panels else ()
        _legend(figure, runs, caption, (*keys(), *lines))
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left")
    return figure


def _label_first(figure: Figure) -> None:
    """Leave the labels of vertical axes to the first column, with the unit in a second line."""
    for axes in figure.axes:
        spec, label = axes.get_subplotspec(), axes.get_ylabel()
        first = spec is not None and spec.is_first_col()
        axes.set_ylabel(label.replace("  [", "\n[") if first else "")
    figure.align_ylabels()


def _drawn(
    results: Sequence[Result], over: str, minimum_speed: float, units: Units = IN_SI
) -> list[_Drawn]:
    window = max(float(np.ptp(result.time)) for result in results) / WINDOWS
    return [
        _Drawn(result, along(result, over), drawn_creepage(result, minimum_speed), window, units)
        for result in results
    ]


def along(result: Result, over: str) -> FloatArray:
    """Times or distances of the rows, or a ValueError for any other axis."""
    if over not in AXES:
        raise ValueError(f"over = {over!r} must be one of: {', '.join(AXES)}")
    return result["distance"] if over == "distance" else result.time


def _limits(runs: Sequence[_Drawn], over: str) -> tuple[float, float]:
    """Limits of the common axis; a vehicle that stands takes little of one of time."""
    if over == "distance":
        low, high = min(run.at.min() for run in runs), max(run.at.max() for run in runs)
        return (low, high) if low < high else (low, low + 1.0)
    first, last = min(run.at[0] for run in runs), max(run.at[-1] for run in runs)
    ends = [_eventful(run.result) for run in runs]
    start, end = min(start for start, _ in ends), max(end for _, end in ends)
    margin = MARGIN * (end - start)
    return max(first, start - margin), min(last, end + margin)


def _moves(result: Result) -> NDArray[np.bool_]:
    """Whether the vehicle moves or its wheels turn, in each row."""
    fastest = np.abs(np.stack([result["speed"], _rim_and_top(result)[0]])).max(axis=0)
    return np.asarray(fastest > STOPPED)


def _eventful(result: Result) -> tuple[float, float]:
    """Times between which a vehicle moves, or a line of its figure does; all if it never does."""
    moves = _moves(result)
    lines = np.stack([result[name] for name in ("speed", "creep_force", "drive_torque")])
    small = EVENTFUL * np.ptp(lines, axis=1)[:, np.newaxis]
    head, tail = (
        np.flatnonzero(moves | (np.abs(lines - lines[:, [row]]) > small).any(axis=0))
        for row in (0, -1)
    )
    if head.size == 0 or tail.size == 0:
        return float(result.time[0]), float(result.time[-1])
    return float(result.time[head[0]]), float(result.time[tail[-1]])


def _summary(run: _Drawn, metrics: Metrics) -> str:
    result, units = run.result, run.units
    used, limited = metrics.utilisation, metrics.limited_utilisation
    share = "" if math.isnan(used) else f"{100.0 * used:.1f} % of demanded force used\n"
    if not math.isnan(limited):
        share = f"{100.0 * limited:.1f} % used where friction limits\n"
    rim, top = _rim_and_top(result)
    fastest = f", rim up to {units.per_speed * rim.max():.0f} {units.speed}"
    beyond = fastest if rim.max() > top > 0.0 else ""
    return f"{share}slip work {_energy(metrics.slip_work)}{beyond}{_stop(result, metrics)}"


def _stop(result: Result, metrics: Metrics) -> str:
    """Line on a stop, from the begin of the run and of its demand; empty if none is demanded."""
    begin, end = np.abs(result["speed"][[0, -1]])
    if end < STOPPED < begin:
        of_demand = metrics.stopping_distance
        first = f"{of_demand:.0f} m from the demand,\n" if math.isfinite(of_demand) else ""
        return f"\nstops {first}{abs(metrics.distance):.0f} m from the start"
    brakes = result["demand"][-1] * result["speed"][-1] < 0.0
    return f"\ndoes not stop within {np.ptp(result.time):g} s" if brakes else ""


def _stands(result: Result) -> bool:
    """Whether the vehicle stands at some time of a run in which it moves."""
    speed = result["speed"]
    return bool(speed.min() < STOPPED < np.abs(speed).max())


def _rim_and_top(result: Result) -> tuple[FloatArray, float]:
    """Rim speed, and the top of its axis, beyond which a wheel has slipped away."""
    return result["speed"] + result["slip_velocity"], FASTEST_RIM * float(result["speed"].max())


def _energy(work: float) -> str:
    units = (1e9, "GJ"), (1e6, "MJ"), (1e3, "kJ")
    size, unit = next((one for one in units if abs(work) >= one[0]), (1.0, "J"))
    return f"{work / size:.3g} {unit}"


def by_branch(axes: Axes, run: _Drawn, values: FloatArray) -> None:
    """Draw a signal of a run; where it vibrates, its envelope over windows of time."""
    rises = (run.result["falling_branch"] == 0.0) | ~_moves(run.result)
    edges = _windows(run)
    vibrates = _vibrates(values, edges)
    shown = values.copy()
    for first, last in zip(edges[:-1][vibrates], edges[1:][vibrates], strict=True):
        shown[first + 1 : last] = np.nan
    by_stability(axes, run.at, shown, rises, lw=1.3)
    if not vibrates.any():
        return
    # Each window has both of its ends, between which the signal is linear: it contains the signal.
    parts = [slice(first, last + 1) for first, last in pairwise(edges)]
    lowest, highest = (
        np.array([part.start + find(values[part]) for part in parts])
        for find in (np.argmin, np.argmax)
    )
    at, drawn = run.at[np.repeat(edges, 2)[1:-1]], np.repeat(vibrates, 2)
    low, high = (np.repeat(values[rows], 2) for rows in (lowest, highest))
    look: dict[str, Any] = {"color": paint.mixed(48), "lw": 0.0, "label": _envelope(run)}
    axes.fill_between(at, low, high, where=drawn.tolist(), **look)
    for edge, rows in ((low, lowest), (high, highest)):
        by_stability(axes, at, np.where(drawn, edge, np.nan), np.repeat(rises[rows], 2), lw=0.9)


def _envelope(run: _Drawn) -> str:
    """Name of an envelope."""
    return f"envelope over {1e3 * run.window:.3g} ms"


def _windows(run: _Drawn) -> NDArray[np.int_]:
    """Rows at which the windows of an envelope begin and end."""
    time = run.result.time
    starts = np.searchsorted(time, np.arange(time[0], time[-1], run.window or 1.0))
    return np.unique(np.append(starts, time.size - 1))


def _vibrates(values: FloatArray, edges: NDArray[np.int_]) -> NDArray[np.bool_]:
    """Windows in which a signal oscillates with an amplitude above that of noise; many or none."""
    none = np.zeros(edges.size - 1, dtype=np.bool_)
    if values.size <= SAMPLES * WINDOWS or none.size == 0:
        return none
    parts = [values[first : last + 1] for first, last in pairwise(edges)]
    widths, ways = np.array([(np.ptp(part), np.abs(np.diff(part)).sum()) for part in parts]).T
    usual = float(np.ptp(np.quantile(values, [0.01, 0.99])))  # without single peaks
    swings = np.divide(ways, widths, out=np.zeros_like(ways), where=widths > 0.0)
    vibrates = (swings > SWINGS) & (widths > 0.15 * usual)
    return vibrates if vibrates.mean() > MANY else none


def _force(axes: Axes, run: _Drawn) -> None:
    result, way = run.result, _way(run.result)
    available = np.where(way == 0.0, np.nan, way) * result["available_force"]
    axes.plot(run.at, 1e-3 * available, color=paint.ink, lw=1.2, ls=DOTTED)
    by_branch(axes, run, 1e-3 * result["creep_force"])
    _from_zero(axes)
    axes.set_ylabel("creep force  [kN]")


def _way(result: Result) -> FloatArray:
    """Sign with which a demand acts: a brake also acts forward, on what stands or rolls back."""
    demand, torque, way = result["demand"], result["drive_torque"], np.sign(result["demand"])
    held = (demand < 0.0) & (result["speed"] < STOPPED)
    for rows in np.split(np.arange(held.size), np.flatnonzero(np.diff(held)) + 1):
        if held[rows[0]] and torque[rows].mean() > -HELD * demand[rows].mean():
            way[rows] = 1.0
    return way


def _creepage(axes: Axes, run: _Drawn) -> None:
    by_branch(axes, run, 100.0 * np.maximum(np.abs(run.creepage), MIN_CREEPAGE))
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    steps = (1.0,) if high > 300.0 * low else (1.0, 2.0, 5.0) if high > 5.0 * low else range(1, 10)
    plain_log(axes.yaxis, *steps)
    axes.set_ylabel("|creepage|  [%]")


def _load(axes: Axes, run: _Drawn) -> None:
    axes.plot(run.at, 1e-3 * run.result["axle_load"], color=paint.ink, lw=1.3)
    axes.set_ylabel("axle load  [kN]")


def _axle_torque(axes: Axes, run: _Drawn) -> None:
    by_branch(axes, run, 1e-3 * run.result["axle_torque"])
    axes.set_ylabel("axle torque  [kN m]")


def _torque(axes: Axes, run: _Drawn) -> None:
    demand = _way(run.result) * np.abs(run.result["demand"])
    axes.plot(run.at, 1e-3 * demand, color=paint.ink, lw=1.2, ls=DOTTED)
    by_branch(axes, run, 1e-3 * run.result["drive_torque"])
    _from_zero(axes)
    axes.set_ylabel("drive torque  [kN m]")


def _speed(axes: Axes, run: _Drawn) -> None:
    (rim, top), speed, per = _rim_and_top(run.result), run.result["speed"], run.units.per_speed
    rim, top, speed = per * rim, per * top, per * speed
    axes.plot(run.at, rim, color=paint.orange, lw=0.9, label="wheel rim")
    axes.plot(run.at, speed, color=paint.ink, lw=1.3, label="vehicle")
    if "speed_limit" in run.result.units:
        limit = per * run.result["speed_limit"]
        axes.plot(run.at, limit, color=paint.grey, lw=0.8, label="limit", scaley=False)
    if rim.max() > top > 0.0:
        axes.set_ylim(min(0.0, 1.05 * float(speed.min())), top)
        _leaves(axes, run, rim > top, f"rim: up to {rim.max():.0f} {run.units.speed}")
    axes.set_ylabel(f"speed  [{run.units.speed}]")


def _trim_creepage(row: list[Axes], runs: Sequence[_Drawn]) -> None:
    """Limit the common creepage axis if only some runs slip away."""
    creepages = [np.abs(run.creepage) for run in runs]
    largest = [float(np.nanmax(creepage, initial=0.0)) for creepage in creepages]
    if not min(largest) < MAX_CREEPAGE < max(largest):
        return
    row[0].set_ylim(top=100.0 * MAX_CREEPAGE)
    for axes, run, creepage, highest in zip(row, runs, creepages, largest, strict=True):
        if highest > 1.01 * MAX_CREEPAGE:
            _leaves(axes, run, creepage > MAX_CREEPAGE, f"up to {100.0 * highest:.0f} %")


def _leaves(axes: Axes, run: _Drawn, beyond: Any, text: str) -> None:
    """Write the maximum of a line beyond the top of its axes, where it leaves them."""
    first = run.at[beyond.argmax()]
    early = first < 0.5 * (run.at.min() + run.at.max())
    side, offset = ("left", (6, -4)) if early else ("right", (-6, -4))
    look: dict[str, Any] = {
        "xycoords": ("data", "axes fraction"),
        "ha": side,
        "va": "top",
        "fontsize": sized(9),
    }
    look["bbox"] = {"facecolor": paint.paper, "edgecolor": "none", "pad": 1.0}
    note(axes, text, (first, 1.0), offset, **look)


def _from_zero(axes: Axes) -> None:
    """Start the axis of a quantity that keeps its sign at zero."""
    low, high = axes.get_ylim()
    if low > 0.0:
        axes.set_ylim(bottom=0.0, auto=None)  # what shares the axis may need more
    elif high < 0.0:
        axes.set_ylim(top=0.0, auto=None)


def _factors(runs: Sequence[_Drawn]) -> list[tuple[str, dict[str, Any], list[FloatArray]]]:
    """Name, look and values in each run of the factors on friction and slope."""
    results = [run.result for run in runs]
    left, right, slope = (
        [result[name] for result in results]
        for name in ("friction_scale_left", "friction_scale_right", "slope_scale")
    )
    solid: dict[str, Any] = {"color": paint.ink, "ls": "-", "lw": 1.2}
    if any(run.units.peaks for run in runs):
        pairs = ((result["available_force"], result["axle_load"]) for result in results)
        peaks = [np.divide(q, p, out=np.zeros_like(p), where=p > 0.0) for q, p in pairs]
        return [("largest traction coefficient", solid, peaks)]
    factors = [("friction factor", solid, left)]
    if not all(map(np.array_equal, left, right)):
        other = ("friction factor, right wheel", {**solid, "ls": DASHED}, right)
        factors = [("friction factor, left wheel", solid, left), other]
    if any((values != 1.0).any() for values in slope):
        factors.append((SLOPE, {**solid, "color": paint.green}, slope))
    return factors


def _friction_varies(runs: Sequence[_Drawn]) -> bool:
    """Whether a factor on friction or slope is not 1 in a run."""
    return any((wheel != 1.0).any() for _, _, values in _factors(runs) for wheel in values)


def _friction(row: Sequence[Axes], runs: Sequence[_Drawn]) -> None:
    """Draw the factors on friction and slope, on one scale for all runs."""
    factors = _factors(runs)
    peaks = runs[0].units.peaks
    one = runs[0].units.friction if len(factors) == 1 else 1.0  # a slope has a factor only
    top = 0.0 if peaks else one
    for number, (axes, run) in enumerate(zip(row, runs, strict=True)):
        lines = [(look, one * values[number]) for _, look, values in factors]
        friction = [values[number] for name, _, values in factors if name != SLOPE]
        lowest = one * np.min(friction, axis=0)
        axes.fill_between(run.at, 0.0, lowest, color=paint.shade, lw=0.0)
        if "sand" in run.result.units:
            laid, whole = run.result["sand"] > 0.0, axes.get_xaxis_transform()
            axes.fill_between(run.at, 0.9, 1.0, laid, transform=whole, label="sand", **GRAINS)
        for look, values in lines:
            axes.plot(run.at, values, **look)
        top = max(top, *(float(values.max()) for _, values in lines))
        _number_plateaus(axes, run.at, lowest)
    what = "factor" if one == 1.0 else "$f_d$"
    label = "largest\n$Q/P$ [1]" if peaks else f"friction\n{what} [1]"
    row[0].set(ylim=(0.0, 1.45 * top))
    for axes in row:
        axes.set_ylabel(label)


def _number_plateaus(axes: Axes, at: FloatArray, values: FloatArray) -> None:
    """Write the value of a band above it where it is even for the length of the number."""
    levels = np.round(values / (EVEN * (values.max() or 1.0)))
    for rows in np.split(np.arange(at.size), np.flatnonzero(np.diff(levels)) + 1):
        begin, end, value = at[rows[0]], at[rows[-1]], float(np.median(values[rows]))
        if abs(end - begin) > WRITTEN * len(text := f"{value:.3g}") * np.ptp(at):
            place = 0.5 * (begin + end), float(values[rows].max())
            note(axes, text, place, (0, 2), ha="center", fontsize=sized(7.5))


def keys() -> list[Line2D]:
    """Keys to the lines of the figures: rising and falling branch, and what is given."""
    return [
        Line2D([], [], color=paint.blue, label="rising branch"),
        Line2D([], [], color=paint.orange, ls=DASHED, label="falling branch"),
        Line2D([], [], color=paint.ink, ls=DOTTED, lw=1.2, label=GIVEN),
    ]


def _legend(figure: Figure, runs: Sequence[_Drawn], caption: str, given: Sequence[Line2D]) -> None:
    """Caption under the figure, and a key to the lines below it."""
    handles: list[Any] = list(given)
    bands = {band.get_label() for axes in figure.axes for band in axes.collections}
    for name in bands & set(map(_envelope, runs)):
        handles.append(Patch(color=paint.mixed(48), label=name))
    if "sand" in bands:
        handles.append(Patch(label="sand", **GRAINS))
    factors = _factors(runs)
    if len(factors) > 1:
        handles += [Line2D([], [], label=label, **look) for label, look, _ in factors]
    sizes = [len(handle.get_label()) + 6 for handle in handles]
    width = line_length(figure, 12.0)
    columns = len(handles) if sum(sizes) <= width else width // max(sizes)
    figure.legend(
        handles=handles,
        loc="outside lower left",
        ncols=min(max(2, columns), len(handles)),
        title=typeset(figure, caption),
        title_fontsize=sized(9),
        alignment="left",
    )
