"""How fast a wheelset runs away, and the delays with which no controller can hold it."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from contactlib.figures.setting import setting
from contactlib.figures.stability.common import SHADE, THREE, by_stability, plain_log
from contactlib.figures.style import (
    BLUE,
    DASHED,
    GREY,
    STYLE,
    add_caption,
    new_figure,
    percent_axis,
)
from contactlib.stability import delay_limit, fast_pole, worst_pole
from contactlib.wheelset import Wheelset

FAR = 5.0  # creepages of the axis, in saturation creepages
RANGE = (0.1, 6.0)  # speeds of the axis, over the model's
DELAYS = (1e-3, 3e-3, 10e-3, 30e-3, 0.1, 0.3)  # of which two are marked [s]


def poles_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Fast pole over creepage, and the longest delay of a loop over speed."""
    with mpl.rc_context(STYLE):
        figure, (left, right) = new_figure(11.0, 5.0, ncols=2)
        _over_creepage(left, wheelset, [factor * speed for factor in (0.3, 1.0, 3.0)])
        _over_speed(right, wheelset, RANGE[0] * speed, RANGE[1] * speed)
        add_caption(
            figure,
            "A loop whose delay and lag $\\tau$ together are longer than $1/p$ cannot "
            "hold the steepest point of the falling branch, whatever its gain; for a largest "
            f"sensitivity of about 2 it must stay below $0.3/p$. {setting(wheelset)}",
        )
    return figure


def _over_creepage(axes: Axes, wheelset: Wheelset, speeds: list[float]) -> None:
    zeta = wheelset.element.saturation_creepage * np.linspace(0.0, FAR, 1501)
    highest = max(worst_pole(wheelset, speed=v).pole for v in speeds)
    for v, (color, width) in zip(speeds, THREE, strict=True):
        pole = fast_pole(wheelset, zeta, speed=v)
        labels = (f"{v:.3g} m/s", None)
        by_stability(axes, zeta, pole, pole < 0.0, color=color, labels=labels, lw=width)
    top = 1.25 * highest
    axes.axhspan(0.0, top, color=SHADE, lw=0.0, zorder=0)
    axes.axhline(0.0, color="black", lw=0.9)
    axes.text(
        0.98, 0.97, "runs away at constant torque", transform=axes.transAxes, ha="right", va="top"
    )
    axes.set_xlim(0.0, float(zeta[-1]))
    axes.set_ylim(-top, top)
    percent_axis(axes.xaxis)
    axes.set_xlabel(r"creepage $\zeta$  [%]")
    axes.set_ylabel(r"fast pole $p$  [1/s]")
    axes.set_title("Growth of a small change of the creepage", loc="left")
    axes.legend(loc="lower right")


def _over_speed(axes: Axes, wheelset: Wheelset, slowest: float, fastest: float) -> None:
    speeds = np.geomspace(max(slowest, wheelset.element.minimum_speed), fastest, 40)

    def limit(v: float, robust: bool = False) -> float:
        return delay_limit(worst_pole(wheelset, speed=v).pole, robust=robust)

    found = np.array([limit(float(v)) for v in speeds])
    sound = np.array([limit(float(v), robust=True) for v in speeds])
    held = ~np.isfinite(found)  # a constant torque holds every creepage
    found[held], sound[held] = np.nan, np.nan
    low, high = 0.5e3 * float(np.nanmin(sound)), 2.5e3 * float(np.nanmax(found))
    axes.fill_between(speeds, 1e3 * found, high, color=SHADE, lw=0.0, zorder=0)
    axes.plot(speeds, 1e3 * found, color="black", label=r"$1/p$: no gain holds beyond")
    axes.plot(speeds, 1e3 * sound, color=BLUE, ls=DASHED, label=r"$0.3/p$: robust below")
    first, last = float(speeds[len(speeds) * 2 // 5]), float(speeds[-1])  # leaves room for words
    for delay in [d for d in DELAYS if limit(first) < d < limit(last)][:2]:
        v = brentq(lambda v, d=delay: limit(v) - d, first, last)
        axes.axhline(1e3 * delay, color=GREY, lw=0.9, ls=":")
        axes.plot([v], [1e3 * delay], "o", color="black", ms=6, zorder=5)
        axes.annotate(
            f"{1e3 * delay:g} ms: no gain below {v:.2g} m/s",
            (v, 1e3 * delay),
            xytext=(-9, 4),
            textcoords="offset points",
            ha="right",
            fontsize=9,
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(float(speeds[0]), float(speeds[-1]))
    axes.set_ylim(low, high)
    poles = axes.secondary_yaxis("right", functions=(_inverse, _inverse))
    for axis in (axes.xaxis, axes.yaxis, poles.yaxis):
        plain_log(axis, 1.0, 3.0)
    poles.set_ylabel(r"worst pole $p$, at $1/p$  [1/s]")
    axes.set_xlabel(r"speed $V$  [m/s]")
    axes.set_ylabel(r"delay of the loop $\tau$  [ms]")
    axes.set_title("Delays that leave a gain", loc="left")
    axes.legend(loc="upper left")


def _inverse(milliseconds: object) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.asarray(1e3 / np.asarray(milliseconds, dtype=np.float64))
