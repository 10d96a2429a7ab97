"""Slip-away time of a wheelset above the fold, and critical length of a slippery patch.

Each time is computed by the analysis and found by simulation.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray
from contactlib.figures.style import (
    DASHED,
    add_caption,
    by_stability,
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
    clearing,
    find_fold,
    slip_away_estimate,
    slip_away_time,
    steady_states,
)
from contactlib.vehicle.continuous_control import TorqueControl
from contactlib.vehicle.track import Profile
from contactlib.vehicle.wheelset import Wheelset

FAR = 10.0  # creepage at the end of a run, in saturation creepages
OVERLOADS = np.geomspace(3e-3, 0.5, 31)  # torque / fold torque - 1
LONGEST = 4.0  # end of a run / time at constant vehicle speed
SIMULATED = (0.005, 0.01, 0.03, 0.1, 0.3)
SHOWN = (0.01, 0.03, 0.1)

LOADS = (0.25, 0.5, 0.75)  # torques, as fractions of the way from return to fold
WORST = 0.1  # lowest friction of the patch
CLEARED = (2, 8, 14)  # points of the middle torque's line that are simulated
PATCH = 0.5  # friction of the patch whose length is drawn
SPEEDS = np.geomspace(0.2, 4.0, 12)  # speeds / the model's
CLOSE = 1.02  # ratio of the two simulated times that enclose the critical one


def slip_away_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Creepage over time at three overloads, and the time over the overload."""
    far = FAR * wheelset.element.saturation_creepage
    # Where damping would hold a small overload before, the runs end at the return.
    fold = find_fold(wheelset, speed=speed)
    states = steady_states(wheelset, drive_torque=fold.drive_torque, speed=speed).creepage
    early = bool(((states > fold.return_creepage) & (states < far)).any())
    end, what = (fold.return_creepage, "the return") if early else (far, f"{FAR:g} zeta0")
    with styled():
        figure, (left, right) = new_figure(11.0, 4.8, ncols=2)
        _histories(left, wheelset, speed, end)
        _times(right, wheelset, speed, end)
        add_caption(
            figure,
            f"From rolling without creepage to {percent(end)} ({what}) at a constant torque "
            "above that of the fold. The smaller the overload, the longer the creepage lingers "
            f"near the peak. Rolling is taken as steady. {setting(wheelset, speed)}",
        )
    return figure


def _histories(axes: Axes, wheelset: Wheelset, speed: float, end: float) -> None:
    fold = find_fold(wheelset, speed=speed)
    for overload, (color, width) in zip(SHOWN, paint.three, strict=True):
        run = _run(wheelset, speed, overload, end)
        zeta, labels = run["creepage"], (f"{100.0 * overload:g} % overload", None)
        grips = zeta <= fold.creepage
        by_stability(axes, 1e3 * run.time, zeta, grips, color=color, labels=labels, lw=width)
    axes.axhline(fold.creepage, color=paint.ink, lw=0.9, ls=":")
    look: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "ha": "right"}
    note(axes, f"fold {percent(fold.creepage)}", (1.0, fold.creepage), (-2, -13), **look)
    limits: dict[str, Any] = {"xlim": (0.0, None), "ylim": (0.0, end)}
    labelled(axes, "time  [ms]", "creepage", "Runs; dashed beyond the fold", legend={}, **limits)


def _times(axes: Axes, wheelset: Wheelset, speed: float, end: float) -> None:
    highest = find_fold(wheelset, speed=speed).drive_torque
    torques = highest * (1.0 + OVERLOADS)
    exact = [
        slip_away_time(wheelset, drive_torque=float(t), speed=speed, start=0.0, end=end)
        for t in torques
    ]
    closed = [
        slip_away_estimate(wheelset, drive_torque=float(t), speed=speed, end=end) for t in torques
    ]
    simulated = [float(_run(wheelset, speed, part, end).time[-1]) for part in SIMULATED]
    ms = 1e3
    axes.plot(OVERLOADS, ms * np.array(exact), color=paint.blue, label="integral")
    line: dict[str, Any] = {"color": paint.grey, "ls": DASHED, "lw": 1.6}
    axes.plot(OVERLOADS, ms * np.array(closed), label="closed form", **line)
    points = SIMULATED, ms * np.array(simulated)
    axes.plot(*points, "o", color=paint.ink, mfc=paint.paper, label="simulated")
    labels = "overload: torque above that of the fold  [%]", "slip-away time  [ms]"
    labelled(axes, *labels, "Time to slip-away", log="xy", steps=(1.0, 2.0, 5.0), legend={})


def _run(wheelset: Wheelset, speed: float, overload: float, end: float) -> Result:
    """Simulate from zero creepage to `end`."""
    torque = (1.0 + overload) * find_fold(wheelset, speed=speed).drive_torque
    # The integral holds for a frozen speed, the closed form only where friction does not fall.
    longest = LONGEST * slip_away_time(
        wheelset, drive_torque=torque, speed=speed, start=0.0, end=end
    )
    run = simulate(
        wheelset,
        TorqueControl(Profile.of(torque)),
        initial_speed=speed,
        initial_creepage=0.0,
        duration=longest,
        output_interval=longest / 600.0,
        slip_away_creepage=end,
        stop_at=["slip_away"],
    )
    if run.first("slip_away") is None:
        raise RuntimeError(
            f"the run with an overload of {100.0 * overload:g} % at {speed:g} m/s did not reach a "
            f"creepage of {percent(end)} within {longest:.3g} s, {LONGEST:g} times the time at "
            "constant vehicle speed"
        )
    return run


def clearing_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Critical duration over the friction of the patch, critical length over speed."""
    with styled():
        figure, (left, right) = new_figure(11.0, 4.8, ncols=2)
        _durations(left, wheelset, speed)
        _lengths(right, wheelset, speed)
        add_caption(
            figure,
            "Below each line the wheelset leaves a patch of low friction in time to regain grip at "
            "constant torque; above the line it slips away. The torques lie between those of "
            "return and fold on good friction. Rolling is taken as steady. "
            f"{setting(wheelset, speed)}",
        )
    return figure


def torque_between(wheelset: Wheelset, speed: float, part: float) -> float:
    """Torque at a fraction of the way from return to fold [N.m]."""
    fold = find_fold(wheelset, speed=speed)
    return fold.return_torque + part * (fold.drive_torque - fold.return_torque)


def simulated_clearing(wheelset: Wheelset, speed: float, torque: float, friction: float) -> float:
    """Critical duration of a patch, by bisection of simulated runs [s]."""
    computed = clearing(wheelset, drive_torque=torque, speed=speed, friction_scale=friction)
    away = 2.0 * computed.border.highest

    def comes_back(time: float) -> bool:
        run = simulate(
            wheelset,
            TorqueControl(Profile.of(torque)),
            initial_speed=speed,
            initial_creepage=computed.border.creepage,
            friction_scale=Profile((0.0, time, time), (friction, friction, 1.0)),
            duration=time + 2.0,
            output_interval=1.0,
            slip_away_creepage=away,
            stop_at=["slip_away"],
            tolerance=1e-8,
        )
        return run.first("slip_away") is None

    low, high = 0.5 * computed.time, 2.0 * computed.time
    if comes_back(high) or not comes_back(low):
        raise RuntimeError(f"simulation and analysis differ by a factor at friction {friction:g}")
    while high > CLOSE * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if comes_back(middle) else (low, middle)
    return math.sqrt(low * high)


def _frictions(wheelset: Wheelset, speed: float, torque: float) -> FloatArray:
    """Frictions of a patch, closely spaced near the one that holds the torque permanently."""

    def short(friction: float) -> float:
        return find_fold(wheelset, speed=speed, friction_scale=friction).drive_torque - torque

    holds = brentq(short, WORST, 1.0)
    close = np.geomspace(0.2, 2e-3, 14)
    return np.asarray(holds - (holds - WORST) * np.append(np.linspace(1.0, 0.25, 12), close))


def _durations(axes: Axes, wheelset: Wheelset, speed: float) -> None:
    for part, (color, width) in zip(LOADS, paint.three, strict=True):
        torque = torque_between(wheelset, speed, part)
        frictions = _frictions(wheelset, speed, torque)
        times = np.array(
            [
                clearing(wheelset, drive_torque=torque, speed=speed, friction_scale=float(m)).time
                for m in frictions
            ]
        )
        name = f"{1e-3 * torque:.4g} kN m"
        axes.plot(frictions, 1e3 * times, color=color, lw=width, label=name)
    torque = torque_between(wheelset, speed, LOADS[1])
    chosen = _frictions(wheelset, speed, torque)[list(CLEARED)]
    points = [simulated_clearing(wheelset, speed, torque, float(m)) for m in chosen]
    hollow: dict[str, Any] = {"color": paint.ink, "mfc": paint.paper, "zorder": 4}
    name = f"simulated, {1e-3 * torque:.4g} kN m"
    axes.plot(chosen, 1e3 * np.array(points), "o", label=name, **hollow)
    labels = "friction of the patch / good friction  [1]", "critical duration  [ms]"
    title = f"Longest duration, at {speed:.3g} m/s"
    labelled(axes, *labels, title, xlim=(0.0, 1.0), log="y", legend={})


def _lengths(axes: Axes, wheelset: Wheelset, speed: float) -> None:
    speeds = speed * SPEEDS
    for part, (color, width) in zip(LOADS, paint.three, strict=True):
        lengths = [
            clearing(
                wheelset,
                drive_torque=torque_between(wheelset, float(v), part),
                speed=float(v),
                friction_scale=PATCH,
            ).distance
            for v in speeds
        ]
        name = f"{100.0 * part:g} % of the way from return to fold"
        axes.plot(speeds, lengths, color=color, lw=width, label=name)
    title = f"Longest patch with {PATCH:g} of the good friction"
    labelled(axes, "speed", "critical length  [m]", title, log="xy", legend={})
