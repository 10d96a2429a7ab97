"""Steady creepage over drive torque (the S-curve), and growth rates of slip-away."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from contactlib.figures.stability.steepest import steepest_fall
from contactlib.figures.style import (
    AT_CONSTANT_TORQUE,
    DASHED,
    add_caption,
    arrow,
    by_stability,
    dot,
    end_of_curve,
    labelled,
    new_figure,
    note,
    paint,
    percent,
    plain_log,
    setting,
    sized,
    styled,
)
from contactlib.stability import (
    SCurve,
    delay_limit,
    fast_pole,
    find_fold,
    s_curve,
    steady_states,
    worst_pole,
)
from contactlib.vehicle.creep_curve import Fold
from contactlib.vehicle.wheelset import Wheelset

BETWEEN = 0.6  # torque whose states are shown: fraction of the way from return to fold
LOWEST = 0.3  # lowest creepage on the axis / stable creepage at the return torque
FRICTIONS = (1.0, 0.75, 0.5)
RANGE = (0.1, 6.0)  # speeds of the axis / the model's
DELAYS = (1e-3, 3e-3, 10e-3, 30e-3, 0.1, 0.3)  # candidates; the figure marks two [s]


def s_curve_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Steady creepages over torque, at one speed; then at three speeds and three frictions."""
    fold = find_fold(wheelset, speed=speed)
    curve = s_curve(wheelset, speed=speed)
    with styled():
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
        held = [m for m in FRICTIONS if _k_hat_held(wheelset, speed, m)]
        beyond = (
            rf"; $\hat K$ is held at {wheelset.element.table.k_max:g} from {max(held):g} down"
            if held
            else ""
        )
        _family(grid[1, 1], of_friction, f"Friction factor{beyond}")
        add_caption(
            figure,
            "A slow torque ramp follows the lower branch to the fold, jumps up, and re-adheres "
            "only below the return torque. Between the two there are three steady states, and "
            f"the middle one is the border of the basin of grip. {setting(wheelset, speed)}",
        )
    return figure


def _k_hat_held(wheelset: Wheelset, speed: float, friction: float) -> bool:
    """Whether k_hat exceeds the largest value of the law at a factor on friction."""
    creepage = wheelset.element.saturation_creepage
    record = wheelset.element.at_creepage(creepage, speed=speed, friction_scale=friction)
    return bool(record["k_hat_limited"])


def _annotated(axes: Axes, wheelset: Wheelset, speed: float, curve: SCurve, fold: Fold) -> None:
    torque, zeta = 1e-3 * curve.drive_torque, curve.creepage
    highest, back = 1e-3 * fold.drive_torque, 1e-3 * fold.return_torque
    rising = zeta <= fold.creepage
    # The fold itself is unstable, and the end of the stable branch.
    by_stability(axes, torque, zeta, curve.stable | rising, labels=AT_CONSTANT_TORQUE)
    low = LOWEST * float(np.interp(back, torque[rising], zeta[rising]))
    top = 1.5 * float(zeta[-1])
    width = highest - back
    ends = (("fold", highest, fold.creepage, 10), ("return", back, fold.return_creepage, -10))
    for name, at, height, offset in ends:
        axes.plot([at, at], [low, min(height, top)], color=paint.grey, lw=0.9, ls=":")
        there = math.isfinite(height)
        if there:
            axes.plot([at], [height], "D", color=paint.ink, ms=6, zorder=5)
        note(
            axes,
            f"{name}\n{at:.4g} kN m\n{percent(height)}"
            if there
            else f"no return\nat any creepage\nabove {at:.4g} kN m",
            (at, min(height, top)),
            (offset, 0),
            ha="left" if offset > 0 else "right",
            va="center" if there else "top",
        )
    level = 1.45 * low
    ends_at = {"shrinkA": 0.0, "shrinkB": 0.0}
    arrow(axes, (highest, level), (back, level), arrowstyle="<|-|>", lw=1.1, **ends_at)
    note(
        axes,
        f"hysteresis {100.0 * fold.hysteresis:.1f} %",
        (0.5 * (back + highest), level),
        (0, 4),
        ha="center",
    )
    chosen = fold.return_torque + BETWEEN * (fold.drive_torque - fold.return_torque)
    states = steady_states(wheelset, drive_torque=chosen, speed=speed)
    axes.plot([1e-3 * chosen] * 2, [2.2 * low, top], color=paint.grey, lw=0.9)
    for z, stable in zip(states.creepage, states.stable, strict=True):
        if low < z < top:
            dot(axes, 1e-3 * chosen, float(z), stable=bool(stable))
            note(
                axes,
                percent(float(z)),
                (1e-3 * chosen, z),
                (-8 if stable else 8, 7),
                ha="right" if stable else "left",
            )
    title = f"At {speed:.3g} m/s; dots: the steady states at {1e-3 * chosen:.4g} kN m"
    xlim, ylim = (max(0.0, back - 1.0 * width), highest + 0.55 * width), (low, top)
    limits: dict[str, Any] = {"xlim": xlim, "ylim": ylim, "legend": {}}
    labelled(axes, "torque", "creepage", title, log="y", steps=(1.0,), **limits)


def _family(axes: Axes, curves: dict[str, SCurve], title: str) -> None:
    folds = [curve.fold for curve in curves.values() if curve.fold is not None]
    for (name, curve), (color, width) in zip(curves.items(), paint.three, strict=True):
        torque = 1e-3 * curve.drive_torque
        look: dict[str, Any] = {"color": color, "labels": (name, None), "lw": width}
        by_stability(axes, torque, curve.creepage, curve.stable, **look)
    lowest = min(fold.return_torque for fold in folds)
    highest = max(fold.drive_torque for fold in folds)
    left = 1e-3 * max(0.0, lowest - 0.9 * (highest - lowest))
    right = 1e-3 * (highest + 0.1 * (highest - lowest))
    top = 1.5 * max(float(curve.creepage[-1]) for curve in curves.values())
    ylim = 0.2 * min(fold.creepage for fold in folds), top
    limits: dict[str, Any] = {"xlim": (left, right), "ylim": ylim, "legend": {"fontsize": sized(9)}}
    labelled(axes, "torque", "creepage", title, log="y", steps=(1.0,), **limits)


def poles_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Fast pole over creepage, and the longest delay of a loop over speed."""
    steepest_fall(wheelset, speed)  # without which there is nothing to hold
    with styled():
        figure, (left, right) = new_figure(9.2, 5.0, ncols=2)
        _over_creepage(left, wheelset, [factor * speed for factor in (0.3, 1.0, 3.0)])
        _over_speed(right, wheelset, RANGE[0] * speed, RANGE[1] * speed)
        add_caption(
            figure,
            "A control loop whose delay and lag, $\\tau$ together, exceed $1/p$ cannot hold the "
            "steepest point of the falling branch with any gain; a peak sensitivity of about 2 "
            f"needs $\\tau$ below $0.3/p$. {setting(wheelset)}",
        )
    return figure


def _over_creepage(axes: Axes, wheelset: Wheelset, speeds: list[float]) -> None:
    zeta = np.linspace(0.0, end_of_curve(wheelset.element), 1501)
    highest = max(worst_pole(wheelset, speed=v).pole for v in speeds)
    for v, (color, width) in zip(speeds, paint.three, strict=True):
        pole = fast_pole(wheelset, zeta, speed=v)
        labels = (f"{v:.3g} m/s", None)
        by_stability(axes, zeta, pole, pole < 0.0, color=color, labels=labels, lw=width)
    top = 1.25 * highest
    axes.axhspan(0.0, top, color=paint.shade, lw=0.0, zorder=0)
    axes.axhline(0.0, color=paint.ink, lw=0.9)
    axes.text(
        0.98, 0.97, "slips away at constant torque", transform=axes.transAxes, ha="right", va="top"
    )
    title, limits = "Growth rate of a small change in creepage", (0.0, float(zeta[-1]))
    pole_label = r"fast pole $p$  [1/s]"
    labelled(axes, "creepage", pole_label, title, xlim=limits, ylim=(-top, top), legend={})


def _over_speed(axes: Axes, wheelset: Wheelset, slowest: float, fastest: float) -> None:
    speeds = np.geomspace(max(slowest, wheelset.element.minimum_speed), fastest, 40)

    def limit(v: float, robust: bool = False) -> float:
        return delay_limit(worst_pole(wheelset, speed=v).pole, robust=robust)

    delays = np.array([limit(float(v)) for v in speeds])
    sound = np.array([limit(float(v), robust=True) for v in speeds])
    held = ~np.isfinite(delays)  # where every creepage is stable at constant torque
    delays[held], sound[held] = np.nan, np.nan
    low, high = 0.5e3 * float(np.nanmin(sound)), 2.5e3 * float(np.nanmax(delays))
    axes.fill_between(speeds, 1e3 * delays, high, color=paint.shade, lw=0.0, zorder=0)
    axes.plot(speeds, 1e3 * delays, color=paint.ink, label=r"$1/p$: no gain holds above")
    axes.plot(speeds, 1e3 * sound, color=paint.blue, ls=DASHED, label=r"$0.3/p$: robust below")
    first, last = float(speeds[len(speeds) * 2 // 5]), float(speeds[-1])  # leaves room for the text
    for delay in [d for d in DELAYS if limit(first) < d < limit(last)][:2]:
        v = brentq(lambda v, d=delay: limit(v) - d, first, last)
        axes.axhline(1e3 * delay, color=paint.grey, lw=0.9, ls=":")
        axes.plot([v], [1e3 * delay], "o", color=paint.ink, ms=6, zorder=5)
        look: dict[str, Any] = {"ha": "right", "fontsize": sized(9)}
        note(axes, f"no gain below {v:.2g} m/s", (v, 1e3 * delay), (-9, 4), **look)
    limits: dict[str, Any] = {"xlim": (speeds[0], speeds[-1]), "ylim": (low, high)}
    labels = "speed", r"delay of the loop $\tau$  [ms]", "Delays at which a gain can hold it"
    labelled(axes, *labels, log="xy", legend={}, **limits)
    poles = axes.secondary_yaxis("right", functions=(_inverse, _inverse))
    plain_log(poles.yaxis, 1.0, 3.0)
    poles.set_ylabel(r"worst pole $p$, at $1/p$  [1/s]")


def _inverse(milliseconds: object) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.asarray(1e3 / np.asarray(milliseconds, dtype=np.float64))
