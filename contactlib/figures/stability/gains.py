"""Which gains of creep control hold the falling branch, with what delay."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactlib.figures.setting import setting
from contactlib.figures.stability.common import SHADE, THREE, plain_log
from contactlib.figures.style import (
    BLUE,
    DASHED,
    DOTTED,
    GREY,
    ORANGE,
    STYLE,
    add_caption,
    new_figure,
    percent_axis,
)
from contactlib.parameters import FloatArray
from contactlib.stability import (
    ReducedPlant,
    Window,
    creep_control_gain,
    find_fold,
    proportional_window,
    reduced_plant,
    sampled_delay,
    worst_pole,
)
from contactlib.wheelset import OperatingPoint, Wheelset

RATIOS = np.linspace(0.01, 0.999, 80)  # p tau
ROBUST = 0.3
SAMPLED_RATIOS = np.linspace(0.04, 0.999, 33)
FAR = 5.0  # creepages of the axis, in saturation creepages


def gains_figure(wheelset: Wheelset, speed: float) -> Figure:
    """The window of gains over the delay, and over the creepage that is to be held."""
    worst = worst_pole(wheelset, speed=speed)
    plant = reduced_plant(wheelset, worst.creepage, speed=speed)
    with mpl.rc_context({**STYLE, "hatch.linewidth": 0.6, "hatch.color": "#BDBDBD"}):
        figure, (left, right) = new_figure(11.0, 5.0, ncols=2)
        _over_delay(left, plant)
        _over_creepage(right, wheelset, speed)
        add_caption(
            figure,
            "$T=T_0+K_p(\\zeta_{ref}-\\zeta)$. Left: gains that hold the steepest point of "
            f"the falling branch, {100.0 * worst.creepage:.3g} %, with pole $p$ "
            f"{plant.pole:.3g} 1/s and $g=r/(JV)$ = {plant.gain:.3g} 1/(N\u00a0m\u00a0s). Sampled: "
            "each reading acts one sample later, $\\tau$ is 1.5 samples. The left and the largest "
            "gains take the vehicle's speed as held: $g/(s-p)$. "
            f"{setting(wheelset, speed)}",
        )
    return figure


def sampled_window(plant: ReducedPlant, ratio: float) -> Window:
    """Window of a loop that acts one sample after it reads, at a p tau of its whole delay."""
    step = ratio / plant.pole / sampled_delay(delay=1.0, sample_time=1.0)
    return proportional_window(plant.pole, plant.gain, delay=step, sample_time=step)


def gain_bounds(wheelset: Wheelset, point: OperatingPoint) -> tuple[float, float]:
    """Gains at which determinant and trace of the closed loop vanish [N.m], from its matrices.

    A - Kp B C: both are linear in Kp. For a held speed, with one state, they are the same.
    """
    linear = wheelset.linearize(point)
    column, row = linear.B[:, :1], linear.C[2:3]
    by_determinant = 1.0 / float((row @ np.linalg.solve(linear.A, column)).item())
    return by_determinant, float(np.trace(linear.A) / (row @ column).item())


def _over_delay(axes: Axes, plant: ReducedPlant) -> None:
    unit = 1e-3  # kN.m
    windows = [
        proportional_window(plant.pole, plant.gain, delay=float(r) / plant.pole) for r in RATIOS
    ]
    low, high = (unit * np.array(ends) for ends in zip(*windows, strict=True))
    axes.fill_between(RATIOS, low, high, facecolor=SHADE, hatch="//", lw=0.0)
    axes.plot(RATIOS, high, color=BLUE, label="largest gain")
    axes.plot(RATIOS, low, color="black", label="smallest gain")
    sampled = unit * np.array([sampled_window(plant, float(r)).highest for r in SAMPLED_RATIOS])
    axes.plot(SAMPLED_RATIOS, sampled, color=ORANGE, ls=DASHED, label="largest gain, sampled")
    axes.axvline(ROBUST, color=GREY, lw=1.4, ls=DOTTED)
    top = 20.0 * float(low[0])
    axes.annotate(
        rf"robust below $p\tau$ = {ROBUST}",
        (ROBUST, 0.7 * top),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
    )
    axes.annotate(
        "holds",
        (0.12, 1.8 * float(low[0])),
        ha="center",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 2.0},
    )
    axes.set_xlim(0.0, 1.0)
    axes.set_yscale("log")
    axes.set_ylim(0.6 * float(low[0]), top)
    plain_log(axes.yaxis, 1.0, 2.0, 5.0)
    in_ms = 1e3 / plant.pole
    axes.set_xlabel(rf"pole times delay $p\tau$  [1];  1 is a delay of {in_ms:.3g} ms")
    axes.set_ylabel(r"gain $K_p$  [kN m]")
    axes.set_title("Gains that hold the steepest fall", loc="left")
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 0.84))


def _over_creepage(axes: Axes, wheelset: Wheelset, speed: float) -> None:
    scale = wheelset.element.saturation_creepage
    zeta = np.linspace(find_fold(wheelset, speed=speed).creepage, FAR * scale, 201)
    points = [wheelset.balanced(creepage=float(z), speed=speed) for z in zeta]
    least = np.array([creep_control_gain(wheelset, point) for point in points])
    axes.plot(zeta, 1e-3 * least, color="black", label="smallest gain")
    if not wheelset.speed_held:
        bounds: FloatArray = 1e-3 * np.array([gain_bounds(wheelset, point) for point in points])
        names = ("determinant vanishes", "trace vanishes")
        for values, name, style in zip(bounds.T, names, (DASHED, DOTTED), strict=True):
            axes.plot(zeta, values, color=ORANGE, lw=1.4, ls=style, label=name)
    steepest = worst_pole(wheelset, speed=speed).pole
    for ratio, (color, width) in zip((0.3, 0.6, 0.9), THREE, strict=True):
        delay = ratio / steepest
        largest = [
            proportional_window(*reduced_plant(wheelset, float(z), speed=speed), delay=delay)
            for z in zeta
        ]
        values = 1e-3 * np.array([window.highest for window in largest])
        axes.plot(zeta, values, color=color, lw=width, label=f"largest, delay {1e3 * delay:.2g} ms")
    axes.set_xlim(float(zeta[0]), float(zeta[-1]))
    axes.set_yscale("log")
    axes.set_ylim(2e-5 * float(least.max()), 40e-3 * float(least.max()))
    plain_log(axes.yaxis, 1.0, 3.0)
    percent_axis(axes.xaxis)
    axes.set_xlabel(r"creepage to be held $\zeta$  [%]")
    axes.set_ylabel(r"gain $K_p$  [kN m]")
    axes.set_title("Smallest gain, and largest with a delay", loc="left")
    axes.legend(loc="upper right", ncols=2, fontsize=9)
