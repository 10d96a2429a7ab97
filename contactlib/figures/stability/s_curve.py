"""Creepage over drive torque: the S-curve, its fold, and the states of one torque."""

from __future__ import annotations

import math

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from contactlib.figures.setting import setting
from contactlib.figures.stability.common import (
    STABLE,
    THREE,
    UNSTABLE,
    by_stability,
    dot,
    percent,
)
from contactlib.figures.style import GREY, STYLE, add_caption, new_figure, percent_axis
from contactlib.stability import Fold, SCurve, find_fold, s_curve, steady_states
from contactlib.wheelset import Wheelset

BETWEEN = 0.6  # the torque whose states are shown, on the way from return to fold
LOWEST = 0.3  # creepage on the axis, over that of the stable state at the return torque
FRICTIONS = (1.0, 0.75, 0.5)


def s_curve_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Steady creepages of a torque, at one speed; then at three speeds and on three frictions."""
    fold = find_fold(wheelset, speed=speed)
    curve = s_curve(wheelset, speed=speed)
    with mpl.rc_context(STYLE):
        figure, grid = new_figure(11.0, 6.2, nrows=2, ncols=2, width_ratios=[1.7, 1.0])
        for axes in grid[:, 0]:
            axes.remove()
        whole = figure.add_subplot(grid[0, 0].get_gridspec()[:, 0])
        _annotated(whole, wheelset, speed, curve, fold)
        speeds = [factor * speed for factor in (0.3, 1.0, 3.0)]
        of_speed = {f"{v:.3g} m/s": s_curve(wheelset, speed=v) for v in speeds}
        _family(grid[0, 1], of_speed, "Speed")
        of_friction = {
            f"{m:g}": s_curve(wheelset, speed=speed, friction_scale=m) for m in FRICTIONS
        }
        _family(grid[1, 1], of_friction, "Factor on friction")
        add_caption(
            figure,
            "A slow torque ramp follows the lower branch to the fold, jumps up, and comes back "
            "only below the return. Between the two a torque has three states, and the middle one "
            f"is the border of the basin. {setting(wheelset, speed)}",
        )
    return figure


def _annotated(axes: Axes, wheelset: Wheelset, speed: float, curve: SCurve, fold: Fold) -> None:
    torque, zeta = 1e-3 * curve.drive_torque, curve.creepage
    by_stability(axes, torque, zeta, curve.stable, labels=(STABLE, UNSTABLE))
    highest, back = 1e-3 * fold.drive_torque, 1e-3 * fold.return_torque
    rising = zeta <= fold.creepage
    low = LOWEST * float(np.interp(back, torque[rising], zeta[rising]))
    top = 1.5 * float(zeta[-1])
    width = highest - back
    ends = (("fold", highest, fold.creepage, 10), ("return", back, fold.return_creepage, -10))
    for name, at, height, offset in ends:
        axes.plot([at, at], [low, min(height, top)], color=GREY, lw=0.9, ls=":")
        if math.isfinite(height):
            axes.plot([at], [height], "D", color="black", ms=6, zorder=5)
            axes.annotate(
                f"{name}\n{at:.4g} kN m\n{percent(height)}",
                (at, height),
                xytext=(offset, 0),
                textcoords="offset points",
                ha="left" if offset > 0 else "right",
                va="center",
            )
    level = 1.45 * low
    arrow = {"arrowstyle": "<|-|>", "color": "black", "lw": 1.1, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (back, level), (highest, level), arrowprops=arrow)
    axes.annotate(
        f"hysteresis {100.0 * fold.hysteresis:.1f} %",
        (0.5 * (back + highest), level),
        xytext=(0, 4),
        textcoords="offset points",
        ha="center",
    )
    chosen = fold.return_torque + BETWEEN * (fold.drive_torque - fold.return_torque)
    states = steady_states(wheelset, drive_torque=chosen, speed=speed)
    axes.plot([1e-3 * chosen] * 2, [2.2 * low, top], color=GREY, lw=0.9)
    for z, stable in zip(states.creepage, states.stable, strict=True):
        if low < z < top:
            dot(axes, 1e-3 * chosen, float(z), stable=bool(stable))
            axes.annotate(
                percent(float(z)),
                (1e-3 * chosen, z),
                xytext=(-8 if stable else 8, 7),
                textcoords="offset points",
                ha="right" if stable else "left",
            )
    axes.set_xlim(max(0.0, back - 1.0 * width), highest + 0.55 * width)
    axes.set_yscale("log")
    axes.set_ylim(low, top)
    _creepage_axis(axes)
    axes.set_title(f"At {speed:.3g} m/s, with the states of {1e-3 * chosen:.4g} kN m", loc="left")
    axes.legend(loc="upper left")


def _family(axes: Axes, curves: dict[str, SCurve], title: str) -> None:
    folds = [curve.fold for curve in curves.values() if curve.fold is not None]
    for (name, curve), (color, width) in zip(curves.items(), THREE, strict=True):
        torque = 1e-3 * curve.drive_torque
        by_stability(
            axes,
            torque,
            curve.creepage,
            curve.stable,
            color=color,
            labels=(name, None),
            lw=width,
        )
    lowest = min(fold.return_torque for fold in folds)
    highest = max(fold.drive_torque for fold in folds)
    axes.set_xlim(
        1e-3 * max(0.0, lowest - 0.9 * (highest - lowest)),
        1e-3 * (highest + 0.1 * (highest - lowest)),
    )
    axes.set_yscale("log")
    tops = [curve.creepage[-1] for curve in curves.values()]
    axes.set_ylim(0.2 * min(fold.creepage for fold in folds), 1.5 * float(np.max(tops)))
    _creepage_axis(axes)
    axes.set_title(title, loc="left")
    axes.legend(loc="upper left", fontsize=9)


def _creepage_axis(axes: Axes) -> None:
    axes.yaxis.set_major_locator(LogLocator())
    axes.yaxis.set_minor_formatter(NullFormatter())
    percent_axis(axes.yaxis)
    axes.set_xlabel("drive torque  [kN m]")
    axes.set_ylabel(r"creepage $\zeta$  [%]")
