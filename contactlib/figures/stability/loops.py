"""Creep control about the steepest point of the falling branch: root locus and Nyquist curve."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contactlib.control_systems import (
    Margins,
    Nyquist,
    RootLocus,
    creep_loop,
    margins,
    nyquist,
    root_locus,
)
from contactlib.figures.setting import setting
from contactlib.figures.stability.common import SHADE, by_stability
from contactlib.figures.style import BLUE, GREY, ORANGE, STYLE, add_caption, new_figure
from contactlib.stability import proportional_window, reduced_plant, worst_pole
from contactlib.wheelset import Wheelset

if TYPE_CHECKING:
    from control import StateSpace

DELAY_RATIO = 0.2  # p tau of the loop
GAINS = np.geomspace(0.2, 8.0, 400)  # of the locus, over the loop's gain


def loop_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Closed-loop poles over the gain; Nyquist curve of one gain, with its margins."""
    worst = worst_pole(wheelset, speed=speed)
    plant = reduced_plant(wheelset, worst.creepage, speed=speed)
    delay = DELAY_RATIO / plant.pole
    window = proportional_window(plant.pole, plant.gain, delay=delay)
    gain = math.sqrt(window.lowest * window.highest)
    point = wheelset.balanced(creepage=worst.creepage, speed=speed)
    loop = creep_loop(wheelset, point, proportional_gain=gain, delay=delay)
    with mpl.rc_context(STYLE):
        figure, (left, right) = new_figure(11.0, 5.4, ncols=2)
        _locus(left, locus_around_breaks(loop), loop, gain, plant.pole)
        _nyquist(right, nyquist(loop), margins(loop), complex(loop(0.0)).real)
        add_caption(
            figure,
            f"Proportional creep control of {100.0 * worst.creepage:.3g} %, the steepest point of "
            f"the falling branch: open-loop pole $p$ {plant.pole:.3g} 1/s, delay "
            f"{1e3 * delay:.3g} ms ($p\\tau$ {DELAY_RATIO:g}, Pade approximant of order 6), gain "
            f"{1e-3 * gain:.3g} kN m. {setting(wheelset, speed)}",
        )
    return figure


def locus_around_breaks(loop: StateSpace) -> RootLocus:
    """Root locus with many gains where poles leave the real axis, as they move fast there."""
    rough = root_locus(loop, GAINS)
    oscillating = (np.abs(rough.poles.imag) > 0.0).sum(axis=1)
    extra = [
        np.linspace(GAINS[i], GAINS[i + 1], 80) for i in np.flatnonzero(np.diff(oscillating) != 0)
    ]
    return root_locus(loop, np.unique(np.concatenate([GAINS, *extra])))


def _locus(axes: Axes, locus: RootLocus, loop: StateSpace, gain: float, pole: float) -> None:
    left, right, top = -8.0 * pole, 5.0 * pole, 8.0 * pole
    axes.axvspan(0.0, right, color=SHADE, lw=0.0, zorder=0)
    axes.axvline(0.0, color="black", lw=0.9)
    stable = locus.growth < 0.0
    labels = ("gains that hold", "gains that do not")
    for i, branch in enumerate(locus.poles.T):
        shown = (branch.real > 1.3 * left) & (np.abs(branch.imag) < 1.3 * top)
        y = np.where(shown, branch.imag, np.nan)
        by_stability(axes, branch.real, y, stable, labels=(None, None) if i else labels)
    axes.plot([pole], [0.0], "x", color="black", ms=9, mew=2.0, zorder=5)
    axes.annotate(
        "open loop",
        (pole, 0.0),
        xytext=(6, 8),
        textcoords="offset points",
    )
    one = int(np.abs(locus.gains - 1.0).argmin())
    for root in locus.poles[one]:
        if root.real > left and abs(root.imag) < top:
            axes.plot([root.real], [root.imag], "o", color="black", ms=6, zorder=5)
    for critical in locus.critical_gains:
        at_critical = root_locus(loop, [critical]).poles[0]
        root = min(at_critical[at_critical.imag >= 0.0], key=lambda pole: abs(pole.real))
        axes.plot([0.0], [root.imag], "o", color="black", mfc="white", ms=7, zorder=5)
        text = f"{1e-3 * critical * gain:.4g} kN m"
        offset = (8, -4) if root.imag > 0.1 * top else (-8, -16)
        axes.annotate(
            text,
            (0.0, root.imag),
            xytext=offset,
            textcoords="offset points",
            ha="left" if offset[0] > 0 else "right",
        )
    axes.set_xlim(left, right)
    axes.set_ylim(-top, top)
    axes.set_xlabel("real part  [1/s]")
    axes.set_ylabel("imaginary part  [1/s]")
    axes.set_title("Root locus; dots: the chosen gain", loc="left")
    axes.legend(loc="lower left")


def _nyquist(axes: Axes, curve: Nyquist, found: Margins, start: float) -> None:
    response = curve.response
    reach = 1.25 * max(1.0, abs(start))
    axes.plot(response.real, response.imag, color=BLUE, label="loop, rising frequency")
    axes.plot(response.real, -response.imag, color=BLUE, lw=0.9)
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(np.cos(angle), np.sin(angle), color=GREY, lw=0.9, ls=":", label="unit circle")
    distance = 1.0 / found.sensitivity_peak
    circle: dict[str, Any] = {"color": ORANGE, "lw": 1.1, "ls": "--"}
    name = f"distance to -1: $1/M_s$ = {distance:.2f}"
    axes.plot(distance * np.cos(angle) - 1.0, distance * np.sin(angle), label=name, **circle)
    _direction(axes, response)
    axes.plot([-1.0], [0.0], "+", color="black", ms=11, mew=2.0, zorder=5)
    upper = 1.0 / found.gain_upper if math.isfinite(found.gain_upper) else 0.0
    line: dict[str, Any] = {"arrowstyle": "-", "color": "black", "lw": 0.8}
    for x, text, place in (
        (-1.0 / found.gain_lower, f"the gain may fall to\n{found.gain_lower:.2g} of it", 1.45),
        (-upper, f"rise to\n{found.gain_upper:.2g} times", -1.45),
    ):
        axes.plot([x], [0.0], "o", color="black", ms=6, zorder=5)
        side, start = ("left", 0.0) if place > 0.0 else ("center", 0.5)
        line["relpos"] = (start, 0.0 if place > 0.0 else 1.0)
        axes.annotate(
            text, (x, 0.0), xytext=(x, place), ha=side, va="center", fontsize=9, arrowprops=line
        )
    axes.text(
        0.98,
        0.02,
        f"unstable poles: {curve.unstable_poles}, encirclements of -1,\n"
        f"counter-clockwise: {-curve.encirclements}, so the point is "
        f"{'held' if curve.stable else 'not held'}\n"
        f"phase margin {math.degrees(found.phase):.0f} deg, "
        f"delay margin {1e3 * found.delay:.2g} ms",
        transform=axes.transAxes,
        ha="right",
        va="bottom",
        fontsize=9,
    )
    axes.set_aspect("equal")
    axes.set_xlim(-reach, 1.6)
    half = 0.5 * (reach + 1.6)
    axes.set_ylim(-1.05 * half, 0.95 * half)
    axes.set_xlabel("real part of the loop gain  [1]")
    axes.set_ylabel("imaginary part  [1]")
    axes.set_title("Nyquist curve", loc="left")
    axes.legend(loc="upper right", fontsize=9)


def _direction(axes: Axes, response: NDArray[np.complex128]) -> None:
    size = np.abs(response)
    i = int(np.abs(size - 0.75 * size.max()).argmin())
    j = min(i + 5, response.size - 1)
    arrow = {"arrowstyle": "-|>", "color": BLUE, "lw": 1.5, "mutation_scale": 16}
    tip, tail = response[j], response[i]
    axes.annotate("", (tip.real, tip.imag), (tail.real, tail.imag), arrowprops=arrow)
