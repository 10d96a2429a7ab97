"""How long a patch of low friction may be: analysed, and searched for by simulation."""

from __future__ import annotations

import math
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from contactlib.controllers import TorqueControl
from contactlib.figures.setting import setting
from contactlib.figures.stability.common import THREE, plain_log
from contactlib.figures.style import STYLE, add_caption, new_figure
from contactlib.parameters import FloatArray
from contactlib.profile import Profile
from contactlib.simulation import simulate
from contactlib.stability import clearing, find_fold
from contactlib.wheelset import Wheelset

LOADS = (0.25, 0.5, 0.75)  # torques, on the way from return to fold
WORST = 0.1  # friction of the patch at which a line begins
SIMULATED = (2, 8, 14)  # points of the middle torque's line that are simulated
PATCH = 0.5  # friction of the patch whose length is drawn
SPEEDS = np.geomspace(0.2, 4.0, 12)  # over the model's
CLOSE = 1.02  # ratio of the two simulated times that enclose the critical one


def clearing_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Critical duration over the friction of the patch, critical length over speed."""
    with mpl.rc_context(STYLE):
        figure, (left, right) = new_figure(11.0, 4.8, ncols=2)
        _durations(left, wheelset, speed)
        _lengths(right, wheelset, speed)
        add_caption(
            figure,
            "Below its line a patch of low friction is left in time, and a constant torque comes "
            "back to grip; above it the wheelset runs away. Torques are given between those of "
            f"return and fold on good friction. {setting(wheelset, speed)}",
        )
    return figure


def torque_between(wheelset: Wheelset, speed: float, part: float) -> float:
    """Torque on the way from return to fold [N.m]."""
    fold = find_fold(wheelset, speed=speed)
    return fold.return_torque + part * (fold.drive_torque - fold.return_torque)


def simulated_clearing(wheelset: Wheelset, speed: float, torque: float, friction: float) -> float:
    """Critical duration of a patch by bisection of runs [s]."""
    found = clearing(wheelset, drive_torque=torque, speed=speed, friction_scale=friction)
    away = 2.0 * found.border.highest

    def comes_back(time: float) -> bool:
        run = simulate(
            wheelset,
            TorqueControl(Profile.of(torque)),
            initial_speed=speed,
            initial_creepage=found.border.creepage,
            friction_scale=Profile((0.0, time, time), (friction, friction, 1.0)),
            duration=time + 2.0,
            output_interval=1.0,
            slip_away_creepage=away,
            stop_at=["slip_away"],
            tolerance=1e-8,
        )
        return run.first("slip_away") is None

    low, high = 0.5 * found.time, 2.0 * found.time
    if comes_back(high) or not comes_back(low):
        raise RuntimeError(f"simulation and analysis differ by a factor at friction {friction:g}")
    while high > CLOSE * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if comes_back(middle) else (low, middle)
    return math.sqrt(low * high)


def _frictions(wheelset: Wheelset, speed: float, torque: float) -> FloatArray:
    """Frictions of a patch, close near the one that holds the torque for good."""

    def short(friction: float) -> float:
        return find_fold(wheelset, speed=speed, friction_scale=friction).drive_torque - torque

    holds = brentq(short, WORST, 1.0)
    close = np.geomspace(0.2, 2e-3, 14)
    return np.asarray(holds - (holds - WORST) * np.append(np.linspace(1.0, 0.25, 12), close))


def _durations(axes: Axes, wheelset: Wheelset, speed: float) -> None:
    for part, (color, width) in zip(LOADS, THREE, strict=True):
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
    chosen = _frictions(wheelset, speed, torque)[list(SIMULATED)]
    points = [simulated_clearing(wheelset, speed, torque, float(m)) for m in chosen]
    line: dict[str, Any] = {
        "color": "black",
        "mfc": "white",
        "ls": "none",
        "marker": "o",
        "zorder": 4,
    }
    name = f"simulated, {1e-3 * torque:.4g} kN m"
    axes.plot(chosen, 1e3 * np.array(points), label=name, **line)
    axes.set_xlim(0.0, 1.0)
    axes.set_yscale("log")
    plain_log(axes.yaxis, 1.0, 3.0)
    axes.set_xlabel("friction of the patch, over good friction  [1]")
    axes.set_ylabel("critical duration  [ms]")
    axes.set_title(f"Longest duration, at {speed:.3g} m/s", loc="left")
    axes.legend(loc="upper left")


def _lengths(axes: Axes, wheelset: Wheelset, speed: float) -> None:
    speeds = speed * SPEEDS
    for part, (color, width) in zip(LOADS, THREE, strict=True):
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
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        plain_log(axis, 1.0, 3.0)
    axes.set_xlabel(r"speed $V$  [m/s]")
    axes.set_ylabel("critical length  [m]")
    axes.set_title(f"Longest patch, its friction {PATCH:g} of the good one", loc="left")
    axes.legend(loc="upper left")
