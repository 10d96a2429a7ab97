"""The creepages from which the wheel re-adheres at constant torque: phase portraits, runs."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactlib.base.quantities import FloatArray
from contactlib.figures.style import (
    DASHED,
    add_caption,
    arrow,
    by_stability,
    dot,
    labelled,
    new_figure,
    note,
    paint,
    percent,
    setting,
    styled,
)
from contactlib.runs.result import Result
from contactlib.runs.simulation import simulate
from contactlib.stability import (
    Basin,
    basin,
    find_fold,
    quasi_steady_torque,
    separatrix,
    steady_states,
)
from contactlib.vehicle.continuous_control import TorqueControl
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.track import Profile
from contactlib.vehicle.wheelset import Wheelset

LOAD = 0.97  # torque / fold torque
STARTS = (0.1, 0.5, 0.8, 0.95, 1.05, 1.2, 1.6)  # initial creepages / creepage of the border
SPANS = ((0.7, 1.6), (0.95, 1.1), (0.99, 1.02))  # of the axis of speed / the model's
ENOUGH = 6  # of the speeds that have a border, for an axis
FAR = 3.0  # end of the creepage axis / creepage of the border


def phase_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Phase portrait at constant torque over creepage (and speed), and simulated runs."""
    torque = LOAD * find_fold(wheelset, speed=speed).drive_torque
    border = basin(wheelset, drive_torque=torque, speed=speed)
    with styled(paint.hatched):
        figure, (left, right) = new_figure(9.2, 5.0, ncols=2)
        if wheelset.speed_held:
            _rate(left, wheelset, torque, speed, border)
        else:
            _plane(left, wheelset, torque, speed, border)
        _runs(right, wheelset, torque, speed, border)
        add_caption(
            figure,
            f"Drive torque {1e-3 * torque:.4g} kN m, {100.0 * LOAD:g} % of the fold's. From the "
            "hatched creepages the wheelset returns to grip; beyond the border (the unstable state "
            "or its separatrix) it slips away. Thin lines are simulated. "
            f"Rolling is taken as steady. {setting(wheelset, speed)}",
        )
    return figure


def _rate(axes: Axes, wheelset: Wheelset, torque: float, speed: float, border: Basin) -> None:
    """Rate of change of the creepage over creepage, for a held speed."""
    far = FAR * border.highest
    zeta = np.unique(np.append(np.linspace(0.0, far, 1501), [border.creepage, border.highest]))
    lever = wheelset.radius / (wheelset.inertia * speed)
    rate = 100.0 * lever * (torque - quasi_steady_torque(wheelset, zeta, speed=speed))
    stable = CreepCurve(wheelset, speed=speed).pole(zeta) < 0.0
    axes.axvspan(0.0, border.highest, facecolor=paint.shade, hatch="//", lw=0.0, zorder=0)
    axes.axhline(0.0, color=paint.ink, lw=0.9)
    labels = ("small changes decay", "small changes grow")
    by_stability(axes, zeta, rate, stable, labels=labels)
    dot(axes, border.creepage, 0.0, stable=True)
    dot(axes, border.highest, 0.0, stable=False)
    around = 1.5 * float(np.abs(rate[zeta > border.creepage]).max())
    for text, at, ha in (("grip", border.creepage, "right"), ("border", border.highest, "left")):
        axes.annotate(
            f"{text}\n{percent(at)}",
            (at, 0.0),
            xytext=(at, -0.32 * around),
            ha=ha,
            va="top",
            arrowprops={"arrowstyle": "-", "color": paint.ink, "lw": 0.8, "shrinkB": 4.0},
        )
    middle = 0.5 * (border.creepage + border.highest)
    ways = ((0.3, 0.7, border.creepage), (1.0, 0.0, 0.0), (1.15, 1.65, border.highest))
    for start, end, scale in ways:
        tail, tip = start * scale, end * scale
        if scale == 0.0:
            half = 0.3 * (border.highest - border.creepage)
            tail, tip = middle + half, middle - half
        arrow(axes, (tail, 0.0), (tip, 0.0), lw=1.6, mutation_scale=15)
    rate_label = r"rate of change of creepage $\mathrm{d}\zeta/\mathrm{d}t$  [%/s]"
    limits: dict[str, Any] = {"xlim": (0.0, far), "ylim": (-0.75 * around, around)}
    labelled(axes, "creepage", rate_label, "Where the creepage goes", legend={}, **limits)


def _plane(axes: Axes, wheelset: Wheelset, torque: float, speed: float, border: Basin) -> None:
    """Creepage and speed of a free wheelset, with the separatrix."""
    for ends in SPANS:
        speeds, edge = _bordered(wheelset, torque, speed * np.linspace(*ends, 19))
        if speeds.size > ENOUGH:
            break
    far = FAR * border.highest
    axes.fill_betweenx(speeds, 0.0, edge, facecolor=paint.shade, hatch="//", lw=0.0, zorder=0)
    axes.plot(edge, speeds, color=paint.ink, lw=1.8, ls=DASHED, label="separatrix")
    grip, rest = [], []
    for v in speeds:
        states = steady_states(wheelset, drive_torque=torque, speed=float(v))
        inside = states.creepage[states.creepage < far]
        grip.append(inside[0])
        rest.append(inside[1] if inside.size > 1 else np.nan)
    axes.plot(grip, speeds, color=paint.ink, lw=1.8, label="grip, quasi-steady")
    for v in speeds[0] + np.array([1.0, 6.0, 11.0]) / 18.0 * (speeds[-1] - speeds[0]):
        own = float(np.interp(v, speeds, edge))
        for part in (0.1, 0.9, 1.1):
            run = _run(wheelset, torque, float(v), part * own, 0.4 * speed, far)
            last = np.flatnonzero(run["speed"] <= speeds[-1])[-1]  # that is shown
            away = bool(run["creepage"][last] > np.interp(run["speed"][last], speeds, edge))
            line = _look(away)
            axes.plot(run["creepage"], run["speed"], lw=1.1, **line)
            axes.plot(run["creepage"][0], run["speed"][0], ".", color=line["color"], ms=7)
            _arrow(axes, run["creepage"], run["speed"], line["color"], far)
    limits: dict[str, Any] = {"xlim": (0.0, far), "ylim": (speeds[0], speeds[-1])}
    labelled(axes, "creepage", "speed", "Creepage and speed", legend={}, **limits)


def _bordered(
    wheelset: Wheelset, torque: float, speeds: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The speeds at which a state grips under the torque and slips away from a border; these."""
    edges = np.full(speeds.shape, np.nan)
    for i, v in enumerate(speeds):
        with suppress(ValueError):  # nothing grips
            edges[i] = separatrix(wheelset, drive_torque=torque, speed=float(v))
    known = np.isfinite(edges)
    return speeds[known], edges[known]


def _runs(axes: Axes, wheelset: Wheelset, torque: float, speed: float, border: Basin) -> None:
    """Creepage over time, from both sides of the border."""
    far = FAR * border.highest
    pole = float(CreepCurve(wheelset, speed=speed).pole(border.highest))
    end = 10.0 / pole
    axes.axhspan(0.0, border.highest, facecolor=paint.shade, hatch="//", lw=0.0, zorder=0)
    axes.axhline(border.highest, color=paint.ink, lw=1.1, ls=DASHED)
    note(
        axes, f"border {percent(border.highest)}", (1e3 * end, border.highest), (-4, 5), ha="right"
    )
    axes.axhline(border.creepage, color=paint.ink, lw=1.1)
    for part in STARTS:
        run = _run(wheelset, torque, speed, part * border.highest, end, far)
        name = {0.5: "returns to grip", 1.2: "slips away"}.get(part)
        axes.plot(1e3 * run.time, run["creepage"], lw=1.4, label=name, **_look(part > 1.0))
    title = f"Runs from both sides of the border, at {speed:.3g} m/s"
    limits: dict[str, Any] = {"xlim": (0.0, 1e3 * end), "ylim": (0.0, far)}
    labelled(axes, "time  [ms]", "creepage", title, legend={}, **limits)


def _run(
    wheelset: Wheelset, torque: float, speed: float, creepage: float, duration: float, far: float
) -> Result:
    return simulate(
        wheelset,
        TorqueControl(Profile.of(torque)),
        initial_speed=speed,
        initial_creepage=creepage,
        duration=duration,
        output_interval=duration / 200.0,
        slip_away_creepage=1.2 * far,
        stop_at=["slip_away"],
        tolerance=1e-8,
    )


def _look(away: bool) -> dict[str, Any]:
    """Colour and dashes of a run."""
    return {"color": paint.orange, "ls": DASHED} if away else {"color": paint.blue}


def _arrow(axes: Axes, x: FloatArray, y: FloatArray, color: str, far: float) -> None:
    """Mark the direction of a run, in the middle of its visible part."""
    middle = 0.5 * (x[0] + min(float(x[-1]), far))
    i = min(int(np.abs(x - middle).argmin()), x.size - 2)
    arrow(axes, (x[i], y[i]), (x[i + 1], y[i + 1]), color=color, lw=1.1)
