"""How long it takes to run away above the fold: simulated, integrated, and in closed form."""

from __future__ import annotations

import math
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactlib.controllers import TorqueControl
from contactlib.figures.setting import setting
from contactlib.figures.stability.common import THREE, percent, plain_log
from contactlib.figures.style import (
    BLUE,
    DASHED,
    GREY,
    STYLE,
    add_caption,
    new_figure,
    percent_axis,
)
from contactlib.profile import Profile
from contactlib.simulation import Result, simulate
from contactlib.stability import find_fold, slip_away_estimate, slip_away_time
from contactlib.wheelset import Wheelset

FAR = 10.0  # the end of a run, in saturation creepages
OVERLOADS = np.geomspace(3e-3, 0.5, 31)  # torque above the fold's, over it
SIMULATED = (0.005, 0.01, 0.03, 0.1, 0.3)
SHOWN = (0.01, 0.03, 0.1)


def slip_away_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Creepage over time at three overloads, and the time over the overload."""
    end = FAR * wheelset.element.saturation_creepage
    with mpl.rc_context(STYLE):
        figure, (left, right) = new_figure(11.0, 4.8, ncols=2)
        _histories(left, wheelset, speed, end)
        _times(right, wheelset, speed, end)
        add_caption(
            figure,
            f"From rolling without creepage to {percent(end)} ({FAR:g} zeta0) at a constant torque "
            "above that of the fold. The creepage waits beside the peak, the longer the smaller "
            f"the overload. {setting(wheelset, speed)}",
        )
    return figure


def _histories(axes: Axes, wheelset: Wheelset, speed: float, end: float) -> None:
    fold = find_fold(wheelset, speed=speed)
    for overload, (color, width) in zip(SHOWN, THREE, strict=True):
        run = _run(wheelset, speed, overload, end)
        falls = run["creepage"] > fold.creepage
        name = f"{100.0 * overload:g} % overload"
        before, after = (np.where(part, run["creepage"], np.nan) for part in (~falls, falls))
        axes.plot(1e3 * run.time, before, color=color, lw=width, label=name)
        axes.plot(1e3 * run.time, after, color=color, lw=width, ls=DASHED)
    axes.axhline(fold.creepage, color="black", lw=0.9, ls=":")
    axes.annotate(
        f"fold {percent(fold.creepage)}",
        (1.0, fold.creepage),
        xycoords=("axes fraction", "data"),
        xytext=(-2, -13),
        textcoords="offset points",
        ha="right",
    )
    axes.set_xlim(left=0.0)
    axes.set_ylim(0.0, end)
    percent_axis(axes.yaxis)
    axes.set_xlabel("time  [ms]")
    axes.set_ylabel(r"creepage $\zeta$  [%]")
    axes.set_title("Runs; dashed beyond the fold", loc="left")
    axes.legend(loc="upper left")


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
    axes.plot(100.0 * OVERLOADS, ms * np.array(exact), color=BLUE, label="integral")
    line: dict[str, Any] = {"color": GREY, "ls": DASHED, "lw": 1.6}
    axes.plot(100.0 * OVERLOADS, ms * np.array(closed), label="closed form", **line)
    points = 100.0 * np.array(SIMULATED)
    axes.plot(points, ms * np.array(simulated), "o", color="black", mfc="white", label="simulated")
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        plain_log(axis, 1.0, 2.0, 5.0)
    axes.set_xlabel("overload: torque above the fold's  [%]")
    axes.set_ylabel("slip-away time  [ms]")
    axes.set_title("Time to run away", loc="left")
    axes.legend(loc="upper right")


def _run(wheelset: Wheelset, speed: float, overload: float, end: float) -> Result:
    """Run from zero creepage that stops at `end`."""
    torque = (1.0 + overload) * find_fold(wheelset, speed=speed).drive_torque
    longest = 3.0 * slip_away_estimate(wheelset, drive_torque=torque, speed=speed, end=end)
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
    if not math.isclose(run["creepage"][-1], end, rel_tol=1e-6):
        raise RuntimeError(f"the run at an overload of {overload:g} did not reach {end:g}")
    return run
