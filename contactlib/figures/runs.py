"""A wheelset under torque control and under creep control: creep curve, time histories, fold.

Stable branches are solid and unstable ones dashed, so that a figure can be read in grey as well.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.element.force_element import ForceElement
from contactlib.figures.style import (
    AT_CONSTANT_TORQUE,
    DASHED,
    add_caption,
    arrow,
    beyond_zone,
    by_stability,
    drawn_creepage,
    end_of_curve,
    labelled,
    mark,
    new_figure,
    note,
    paint,
    percent,
    setting,
    sized,
    styled,
    typeset,
    wrapped,
)
from contactlib.runs.result import Result
from contactlib.stability import find_fold, quasi_steady_torque
from contactlib.vehicle.creep_curve import CreepCurve, Fold, Peak
from contactlib.vehicle.wheelset import Wheelset


def creep_curve(wheelset: Wheelset, *, speed: float) -> Figure:
    """Traction coefficient over creepage; dashed where it is unstable at constant torque.

    A measured curve ends with the last of its points, which are shown; any other law of line or
    ellipse is shown with Carter's. The title states where the law is beyond its range.
    """
    element, curve = wheelset.element, CreepCurve(wheelset, speed=speed)
    peak, fold = curve.peak, None
    with suppress(ValueError):  # without a fold every creepage is stable
        fold = curve.fold
    far = end_of_curve(element)
    if element.table.points is None and math.isfinite(peak.creepage):
        far = max(far, 1.5 * peak.creepage)
    zeta = np.linspace(0.0, far, 1200)
    zeta = np.union1d(zeta, [peak.creepage] if peak.creepage <= far else [])
    zeta = zeta if fold is None else _with_fold(zeta, fold)
    record = element.at_creepage(zeta, speed=speed)
    mu = record["traction_coefficient"]
    points, top, title = element.table.points, float(mu.max()), "Creep curve"
    with styled():
        figure, axes = new_figure(7.2, 4.4)
        if points is None:
            if not element.table.one_axis:
                title += rf", $\hat K$ = {element.k_hat:.2g}"
            title += rf", $\zeta_0$ = {100 * element.saturation_creepage:.2g} %"
        else:
            measured = points.creepage, points.traction_coefficient
            look: dict[str, Any] = {"color": paint.grey, "ms": 4, "clip_on": False}
            axes.plot(*measured, "o", label="measured points", **look)
            top = max(top, float(points.traction_coefficient.max()))
        stable = np.ones(zeta.shape, np.bool_) if fold is None else _stable(zeta, fold)
        by_stability(
            axes, zeta, mu, stable, labels=AT_CONSTANT_TORQUE if fold else ("stable", None)
        )
        if not element.table.one_axis:
            _beside_carter(axes, element, zeta, speed)
        _mark_ends(axes, zeta, mu, peak, fold)
        limits: dict[str, Any] = {"xlim": (0.0, far), "ylim": (0.0, 1.16 * top), "legend": {}}
        title += f", $V$ = {speed:.3g} m/s{_beyond_law(element, zeta, record)}"
        labelled(axes, "creepage", "traction coefficient", title, **limits)
        add_caption(
            figure,
            "A constant torque holds the rising branch; on the falling branch a little more "
            f"creepage means less force. {setting(wheelset, speed)}",
        )
    return figure


def _mark_ends(axes: Axes, zeta: FloatArray, mu: FloatArray, peak: Peak, fold: Fold | None) -> None:
    """Mark the peak of the force, fold and return of the torque, or point to where they are."""
    far = float(zeta[-1])

    def named(name: str, creepage: float) -> str:
        return f"{name}: {np.interp(creepage, zeta, mu):.3g} at {percent(creepage)}"

    marks = [("peak", peak.creepage)] if peak.creepage < far else []
    if fold is not None:
        if marks and abs(fold.creepage - peak.creepage) < 0.02 * far:
            marks = [("fold", fold.creepage)]
            if percent(fold.creepage) == percent(peak.creepage):
                marks = [("peak and fold", fold.creepage)]
            else:
                axes.plot([peak.creepage], [mu.max()], "o", color=paint.ink, mfc=paint.paper, ms=6)
        elif fold.creepage <= far:
            marks.append(("fold", fold.creepage))
        if fold.return_creepage <= far:
            marks.append(("return", fold.return_creepage))
        elif math.isfinite(fold.return_creepage):
            text = f"return at {percent(fold.return_creepage)} \N{RIGHTWARDS ARROW}"
            note(axes, text, (far, mu[-1]), (0, -29), ha="right")
        else:
            note(axes, "no return", (far, mu[-1]), (0, -29), ha="right")
    for name, creepage in marks:
        height, side = (
            float(np.interp(creepage, zeta, mu)),
            "left" if creepage < 0.2 * far else "center",
        )
        mark(axes, creepage, height, named(name, creepage), (0, 9), ha=side)


def _beyond_law(element: ForceElement, zeta: FloatArray, record: Any) -> str:
    """Line of a title: where the law is used beyond the k_hat or the zone that it is made for."""
    lines = []
    held = record["k_hat_limited"] > 0.0
    if held.any():
        lines.append(
            rf"$\hat K$ is held at {element.table.k_max:g}, the law's largest, from "
            f"{percent(float(zeta[held.argmax()]))} on"
        )
    if text := beyond_zone(element):
        lines.append(text)
    return "".join(f"\n{line}" for line in lines)


def _beside_carter(axes: Axes, element: ForceElement, zeta: FloatArray, speed: float) -> None:
    """Draw Carter's law and the kinetic friction, between which weakening friction lies."""
    friction = element.friction
    kinetic = friction.kinetic * friction.slip_rate_factor(zeta * speed)
    fallen = f", {kinetic[-1]:.3g} at this slip speed" * (friction.slip_rate_decay > 0.0)
    coulomb = replace(element, friction=replace(friction, weakening_length=0.0))
    carter = coulomb.at_creepage(zeta, speed=speed)["traction_coefficient"]
    # Over the curve, which it meets at either end, and thin enough to leave it visible.
    look: dict[str, Any] = {"color": paint.ink, "lw": 0.9, "zorder": 4}
    axes.plot(zeta, carter, label="Carter (Coulomb friction)", **look)
    axes.plot(zeta, kinetic, color=paint.grey, lw=0.8, ls=":")
    text, grey = f"kinetic friction $f_d$ = {friction.kinetic:.3g}{fallen}", {"color": paint.grey}
    note(axes, text, (zeta[-1], kinetic[-1]), (0, -15), ha="right", **grey)


def time_histories(
    torque_run: Result, creep_run: Result, *, title: str, wheelset: Wheelset | None = None
) -> Figure:
    """Torque, creepage and creep force over time: torque control beside creep control.

    The caption names the parameters of the wheelset, if it is given.
    """
    rows = (
        ("drive_torque", 1e-3, "drive torque  [kN m]"),
        ("creepage", 100.0, "creepage  [%]"),
        ("creep_force", 1e-3, "creep force  [kN]"),
    )
    columns = (
        ("Torque control: the wheelset slips away", torque_run),
        ("Creep control: the wheelset holds", creep_run),
    )
    with styled():
        figure, grid = new_figure(9.6, 6.8, nrows=3, ncols=2, sharex="col")
        for column, (heading, run) in enumerate(columns):
            for row, (name, scale, label) in enumerate(rows):
                axes, rises = grid[row, column], run["falling_branch"] == 0.0
                values = drawn_creepage(run) if name == "creepage" else run[name]
                by_stability(axes, run.time, scale * values, rises, lw=1.6)
                axes.set_ylabel(label)
                event = run.first("peak_passed")
                if event is not None:
                    axes.axvline(event.time, color=paint.ink, lw=1.0, ls=":")
                    if row == 0:
                        late = 2.0 * event.time > run.time[0] + run.time[-1]
                        side, offset = ("right", (-5, 0)) if late else ("left", (5, 0))
                        at = {"xycoords": ("data", "axes fraction"), "ha": side}
                        note(axes, "passes the peak", (event.time, 0.04), offset, **at)
            grid[0, column].set_title(heading)
            grid[2, column].set(xlabel="time  [s]", xlim=(run.time[0], run.time[-1]))
        labelled(grid[1, 0], log="y", steps=(1.0,))
        look: dict[str, Any] = {"color": paint.ink, "lw": 0.9, "label": "reference"}
        grid[1, 1].plot(creep_run.time, 100.0 * creep_run["reference"], **look)
        labelled(grid[1, 1], ylim=(0.0, None), legend={})
        lines = (("rising branch", paint.blue, "-"), ("falling branch", paint.orange, DASHED))
        handles = [Line2D([], [], color=color, ls=ls, label=label) for label, color, ls in lines]
        _key(figure, wheelset, handles=handles)
        figure.suptitle(title, x=0.01, ha="left")
    return figure


def fold_diagram(
    wheelset: Wheelset, torque_run: Result, creep_run: Result, *, speed: float, title: str
) -> Figure:
    """Creepage against drive torque: steady states, fold, hysteresis loop, and creep control.

    In a ramp that falls fast the wheel re-adheres below the return: the inertia of the decelerating
    wheel drives the contact as well, J domega/dt in addition to the torque. The steady states are
    those at `speed`; if the runs leave it, the title states this, and thin lines are the steady
    states at the speed of the run under creep control.
    """
    fold = find_fold(wheelset, speed=speed)
    bottom = 0.2 * min(wheelset.element.saturation_creepage, fold.creepage)
    top = max(10.0, 1.3 * float(torque_run["creepage"].max()))
    zeta = _with_fold(np.geomspace(bottom, top, 2000), fold)
    torque = quasi_steady_torque(wheelset, zeta, speed=speed) / 1e3
    with styled():
        figure, axes = new_figure(7.6, 5.2)
        by_stability(axes, torque, zeta, _stable(zeta, fold), labels=AT_CONSTANT_TORQUE)
        held_speed = float(creep_run["speed"][-1])
        at_speed = ""
        if not math.isclose(held_speed, speed, rel_tol=0.01):
            at_speed = f" at {held_speed:.3g} m/s"
            there = find_fold(wheelset, speed=held_speed)
            zetas = _with_fold(zeta, there)
            torques = 1e-3 * quasi_steady_torque(wheelset, zetas, speed=held_speed)
            thin: dict[str, Any] = {"color": paint.green, "lw": 1.2}
            labels = f"steady states{at_speed}", None
            by_stability(axes, torques, zetas, _stable(zetas, there), labels=labels, **thin)
        shown = torque_run["creepage"] > bottom
        ramp = np.where(shown, torque_run["drive_torque"], np.nan) / 1e3
        look: dict[str, Any] = {"color": paint.grey, "lw": 1.3}
        axes.plot(ramp, torque_run["creepage"], label=_ramped(torque_run["drive_torque"]), **look)
        for part in (0.3, 0.75):
            _arrow(axes, torque_run, part)
        held = creep_run["drive_torque"][-1] / 1e3, creep_run["creepage"][-1]
        hollow: dict[str, Any] = {"color": paint.ink, "mfc": paint.paper, "ms": 6.5, "zorder": 5}
        axes.plot(*held, "o", label=f"held by creep control{at_speed}", **hollow)
        mark(axes, fold.drive_torque / 1e3, fold.creepage, "fold", (9, -5))
        if np.isfinite(fold.return_creepage):
            mark(axes, fold.return_torque / 1e3, fold.return_creepage, "return", (9, -3))
        else:
            text = f"no return at any creepage\nabove {1e-3 * fold.return_torque:.4g} kN m"
            note(axes, text, (1e-3 * fold.return_torque, top), (9, -9), va="top")
        low = min(fold.return_torque, float(torque_run["drive_torque"].min())) / 1e3
        high = max(fold.drive_torque, float(torque_run["drive_torque"].max())) / 1e3
        _lag(axes, torque_run, fold, low)
        margin = 0.06 * (high - low)
        limits: dict[str, Any] = {"xlim": (low - margin, high + margin), "ylim": (bottom, top)}
        labelled(axes, "torque", "creepage", log="y", **limits)
        reached = np.concatenate([torque_run["speed"], creep_run["speed"]])
        smallest, largest = reached.min(), reached.max()
        runs = f"\nruns at $V$ = {smallest:.3g} to {largest:.3g} m/s" * bool(
            largest > 1.01 * smallest
        )
        axes.set_title(f"{title}: steady creepage at $V$ = {speed:.3g} m/s{runs}")
        _key(figure, wheelset)
    return figure


def _key(figure: Figure, wheelset: Wheelset | None, **handles: Any) -> None:
    """Key to the lines below a figure, under a caption of a wheelset's parameters."""
    caption = "" if wheelset is None else typeset(figure, setting(wheelset))
    figure.legend(
        loc="outside lower left" if caption else "outside lower center",
        ncols=2,
        title=caption,
        title_fontsize=sized(9),
        alignment="left" if caption else "center",
        **handles,
    )


def _with_fold(zeta: FloatArray, fold: Fold) -> FloatArray:
    """Creepages with the ends of the branches added, so that the lines meet there."""
    ends = [z for z in (fold.creepage, fold.return_creepage) if z <= zeta[-1]]
    return np.union1d(zeta, ends)


def _stable(zeta: FloatArray, fold: Fold) -> NDArray[np.bool_]:
    """Whether a creepage is stable at constant torque: up to the fold, and from the return on.

    Only damping stabilises the creepages above the return, as its torque rises with the speed.
    """
    return (zeta <= fold.creepage) | (zeta >= fold.return_creepage)


def _ramped(torque: FloatArray) -> str:
    """Name of a run in the legend: the directions of its torque."""
    ways = {"up": torque.max() > torque[0], "down": torque[-1] < torque.max()}
    there = " and ".join(way for way, gone in ways.items() if gone)
    return f"torque ramped {there}" if there else "constant torque"


def _lag(axes: Axes, run: Result, fold: Fold, low: float) -> None:
    """Annotate where the wheel re-adheres under falling torque, if that is below the return."""
    farthest = int(run["creepage"].argmax())
    grips = farthest + int(np.argmax(run["creepage"][farthest:] < fold.creepage))
    torque = 1e-3 * float(run["drive_torque"][grips])
    behind = 1e-3 * fold.return_torque - torque
    if grips == farthest or behind < 0.01 * torque:
        return
    left = behind < torque - low  # there is more room than between ramp and return
    text = f"grip at {torque:.3g}\N{NO-BREAK SPACE}kN\N{NO-BREAK SPACE}m: the spinning wheel lags"
    side, offset, width = ("right", (-6, 0), 14) if left else ("left", (6, 0), 26)
    lines = wrapped(f"{text} behind the ramp", width)
    note(axes, lines, (torque, 3.0 * fold.creepage), offset, ha=side)


def _arrow(axes: Axes, run: Result, part: float) -> None:
    """Mark the direction of a run after a fraction of its time."""
    i = int(np.searchsorted(run.time, part * run.time[-1]))
    j = min(i + 20, run.time.size - 1)
    tail, tip = ((run["drive_torque"][k] / 1e3, run["creepage"][k]) for k in (i, j))
    arrow(axes, tail, tip, color=paint.grey, lw=1.3)
