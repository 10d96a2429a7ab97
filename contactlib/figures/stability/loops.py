"""Creep control on the falling branch: stabilising gains, root locus and Nyquist curve."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray
from contactlib.figures.stability.steepest import steepest_fall
from contactlib.figures.style import (
    DASHED,
    DOTTED,
    add_caption,
    arrow,
    by_stability,
    end_of_curve,
    labelled,
    new_figure,
    note,
    paint,
    setting,
    sized,
    styled,
)
from contactlib.stability import (
    ReducedPlant,
    Window,
    creep_control_gain,
    find_fold,
    proportional_window,
    reduced_plant,
    sampled_delay,
)
from contactlib.stability.control_systems import (
    Margins,
    creep_loop,
    frequencies,
    margins,
)
from contactlib.vehicle.conditions import OperatingPoint
from contactlib.vehicle.wheelset import Wheelset

if TYPE_CHECKING:
    from control import StateSpace

RATIOS = np.linspace(0.01, 0.999, 80)  # p tau
ROBUST = 0.3
SAMPLED_RATIOS = np.linspace(0.04, 0.999, 33)
DELAY_RATIO = 0.2  # p tau of the loop whose locus is drawn
GAINS = np.geomspace(0.2, 8.0, 400)  # gains of the locus / the loop's gain


def gains_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Window of stabilising gains over the delay, and over the creepage to be held.

    If the resistance does not grow with speed, the speed of a free vehicle has no restoring force,
    so the figure assumes that it is constant.
    """
    given = wheelset
    if not (wheelset.speed_held or wheelset.resistance.linear or wheelset.resistance.quadratic):
        wheelset = replace(wheelset, mass=None)
    worst = steepest_fall(wheelset, speed)
    plant = reduced_plant(wheelset, worst.creepage, speed=speed)
    with styled(paint.hatched):
        figure, (left, right) = new_figure(11.0, 5.0, ncols=2)
        _over_delay(left, plant)
        _over_creepage(right, wheelset, speed)
        add_caption(
            figure,
            "$T=T_0+K_p(\\zeta_{ref}-\\zeta)$. Left: gains that hold the steepest point of "
            f"the falling branch, {100.0 * worst.creepage:.3g} %, with pole $p$ "
            f"{plant.pole:.3g} 1/s and $g=r/(JV)$ = {plant.gain:.3g} 1/(N\u00a0m\u00a0s). Sampled: "
            "each reading acts one sample later, so $\\tau$ is 1.5 samples. The left panel and the "
            f"{'' if wheelset is given else 'smallest and '}largest gains assume a constant "
            "vehicle speed: $g/(s-p)$. Rolling is taken as steady. "
            f"{setting(given, speed)}",
        )
    return figure


def sampled_window(plant: ReducedPlant, ratio: float) -> Window:
    """Window of a sampled loop that acts one sample after it reads, for p tau = `ratio`."""
    step = ratio / plant.pole / sampled_delay(delay=1.0, sample_time=1.0)
    return proportional_window(*plant, delay=step, sample_time=step)


def gain_bounds(wheelset: Wheelset, point: OperatingPoint) -> tuple[float, float]:
    """Gains at which determinant and trace of the closed loop A - Kp B C vanish [N.m].

    Both are linear in Kp. For a held speed, with one state, the two gains are the same.
    """
    linear = wheelset.linearize(point)
    column, row = linear.B[:, :1], linear.C[2:3]
    by_determinant = 1.0 / float((row @ np.linalg.solve(linear.A, column)).item())
    return by_determinant, float(np.trace(linear.A) / (row @ column).item())


def _over_delay(axes: Axes, plant: ReducedPlant) -> None:
    unit = 1e-3  # kN.m
    windows = [proportional_window(*plant, delay=float(r) / plant.pole) for r in RATIOS]
    low, high = (unit * np.array(ends) for ends in zip(*windows, strict=True))
    axes.fill_between(RATIOS, low, high, facecolor=paint.shade, hatch="//", lw=0.0)
    axes.plot(RATIOS, high, color=paint.blue, label="largest gain")
    axes.plot(RATIOS, low, color=paint.ink, label="smallest gain")
    sampled = unit * np.array([sampled_window(plant, float(r)).highest for r in SAMPLED_RATIOS])
    axes.plot(SAMPLED_RATIOS, sampled, color=paint.orange, ls=DASHED, label="largest gain, sampled")
    axes.axvline(ROBUST, color=paint.grey, lw=1.4, ls=DOTTED)
    top = 20.0 * float(low[0])
    note(axes, rf"robust below $p\tau$ = {ROBUST}", (ROBUST, 0.7 * top), (6, 0), va="center")
    axes.annotate(
        "holds",
        (0.12, 1.8 * float(low[0])),
        ha="center",
        bbox={"facecolor": paint.paper, "edgecolor": "none", "pad": 2.0},
    )
    product = rf"pole times delay $p\tau$  [1];  1 means a delay of {1e3 / plant.pole:.3g} ms"
    limits: dict[str, Any] = {"xlim": (0.0, 1.0), "ylim": (0.6 * float(low[0]), top)}
    scale: dict[str, Any] = {"log": "y", "steps": (1.0, 2.0, 5.0), "legend": {}}
    labelled(axes, product, "gain", "Gains that hold the steepest point", **limits, **scale)


def _over_creepage(axes: Axes, wheelset: Wheelset, speed: float) -> None:
    fold, end = find_fold(wheelset, speed=speed), end_of_curve(wheelset.element)
    zeta = np.linspace(fold.creepage, end, 201)
    points = [wheelset.balanced(creepage=float(z), speed=speed) for z in zeta]
    smallest = np.array([creep_control_gain(wheelset, point) for point in points])
    axes.plot(zeta, 1e-3 * smallest, color=paint.ink, label="smallest gain")
    if not wheelset.speed_held:
        bounds: FloatArray = 1e-3 * np.array([gain_bounds(wheelset, point) for point in points])
        names = ("determinant vanishes", "trace vanishes")
        for values, name, style in zip(bounds.T, names, (DASHED, DOTTED), strict=True):
            axes.plot(zeta, values, color=paint.orange, lw=1.4, ls=style, label=name)
    steepest = steepest_fall(wheelset, speed).pole
    for ratio, (color, width) in zip((0.3, 0.6, 0.9), paint.three, strict=True):
        delay = ratio / steepest
        largest = [
            proportional_window(*reduced_plant(wheelset, float(z), speed=speed), delay=delay)
            for z in zeta
        ]
        values = 1e-3 * np.array([window.highest for window in largest])
        axes.plot(zeta, values, color=color, lw=width, label=f"largest, delay {1e3 * delay:.2g} ms")
    labels = r"creepage to be held $\zeta$  [%]", "gain", "Gains that hold it, for three delays"
    largest_minimum = float(smallest.max())
    ylim, legend = (
        (2e-5 * largest_minimum, 40e-3 * largest_minimum),
        {"ncols": 2, "fontsize": sized(9)},
    )
    labelled(axes, *labels, log="y", xlim=(zeta[0], zeta[-1]), ylim=ylim, legend=legend)


def loop_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Closed-loop poles over the gain; Nyquist curve of one gain, with its margins.

    A free vehicle hardly changes its speed on the time scale of the loop: the speed is constant
    here.
    """
    control = optional_library("control")

    given, wheelset = wheelset, replace(wheelset, mass=None)
    worst = steepest_fall(wheelset, speed)
    plant = reduced_plant(wheelset, worst.creepage, speed=speed)
    delay = DELAY_RATIO / plant.pole
    window = proportional_window(*plant, delay=delay)
    gain = math.sqrt(window.lowest * window.highest)
    point = wheelset.balanced(creepage=worst.creepage, speed=speed)
    loop = creep_loop(wheelset, point, proportional_gain=gain, delay=delay)
    with styled():
        figure, (left, right) = new_figure(11.0, 5.4, ncols=2)
        robustness = margins(loop)
        _locus(left, loop, gain, plant.pole, robustness)
        curve = control.nyquist_response(loop, np.append(0.0, frequencies(loop)))
        _nyquist(right, curve.response, robustness, complex(loop(0.0)).real)
        add_caption(
            figure,
            f"Proportional creep control of {100.0 * worst.creepage:.3g} %, the steepest point of "
            f"the falling branch: open-loop pole $p$ {plant.pole:.3g} 1/s, delay "
            f"{1e3 * delay:.3g} ms ($p\\tau$ {DELAY_RATIO:g}, Pade approximant of order 6), gain "
            f"{1e-3 * gain:.3g} kN m. Unstable poles: {(loop.poles().real > 0.0).sum()}, "
            f"encirclements of -1, counter-clockwise: {-curve.count}; phase margin "
            f"{math.degrees(robustness.phase):.0f} deg, delay margin "
            f"{1e3 * robustness.delay:.2g} ms. "
            f"{'' if given.speed_held else 'Constant vehicle speed. '}"
            f"{setting(given, speed)}",
        )
    return figure


def gains_around_breaks(loop: StateSpace) -> FloatArray:
    """Gains of the locus, closer where poles leave the real axis and move fast with the gain."""
    control = optional_library("control")

    oscillating = (np.abs(control.root_locus_map(loop, GAINS).loci.imag) > 0.0).sum(axis=1)
    extra = [
        np.linspace(GAINS[i], GAINS[i + 1], 80) for i in np.flatnonzero(np.diff(oscillating) != 0)
    ]
    return np.unique(np.concatenate([GAINS, *extra]))


def _locus(axes: Axes, loop: StateSpace, gain: float, pole: float, robustness: Margins) -> None:
    control = optional_library("control")

    gains = gains_around_breaks(loop)
    loci = control.root_locus_map(loop, gains).loci
    left, right, top = -8.0 * pole, 5.0 * pole, 8.0 * pole
    axes.axvspan(0.0, right, color=paint.shade, lw=0.0, zorder=0)
    axes.axvline(0.0, color=paint.ink, lw=0.9)
    stable = (gains > robustness.gain_lower) & (gains < robustness.gain_upper)
    labels = ("gains that hold", "gains that do not")
    for i, branch in enumerate(loci.T):
        shown = (branch.real > 1.3 * left) & (np.abs(branch.imag) < 1.3 * top)
        y = np.where(shown, branch.imag, np.nan)
        by_stability(axes, branch.real, y, stable, labels=(None, None) if i else labels)
    axes.plot([pole], [0.0], "x", color=paint.ink, ms=9, mew=2.0, zorder=5)
    note(axes, "open loop", (pole, 0.0), (6, 8))
    for root in loci[int(np.abs(gains - 1.0).argmin())]:
        if root.real > left and abs(root.imag) < top:
            axes.plot([root.real], [root.imag], "o", color=paint.ink, ms=6, zorder=5)
    for critical in (robustness.gain_lower, robustness.gain_upper):
        at_critical = control.feedback(critical * loop, 1.0).poles()
        root = min(at_critical[at_critical.imag >= 0.0], key=lambda pole: abs(pole.real))
        axes.plot([0.0], [root.imag], "o", color=paint.ink, mfc=paint.paper, ms=7, zorder=5)
        text = f"{1e-3 * critical * gain:.4g} kN m"
        offset = (8, -4) if root.imag > 0.1 * top else (-8, -16)
        note(axes, text, (0.0, root.imag), offset, ha="left" if offset[0] > 0 else "right")
    limits: dict[str, Any] = {"xlim": (left, right), "ylim": (-top, top), "legend": {}}
    title = "Root locus; dots: the chosen gain"
    labelled(axes, "real part  [1/s]", "imaginary part  [1/s]", title, **limits)


def _nyquist(
    axes: Axes, response: NDArray[np.complex128], robustness: Margins, start: float
) -> None:
    reach = 1.25 * max(1.0, abs(start))
    axes.plot(response.real, response.imag, color=paint.blue, label="loop, rising frequency")
    axes.plot(response.real, -response.imag, color=paint.blue, lw=0.9)
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(np.cos(angle), np.sin(angle), color=paint.grey, lw=0.9, ls=":", label="unit circle")
    distance = 1.0 / robustness.sensitivity_peak
    circle: dict[str, Any] = {"color": paint.orange, "lw": 1.1, "ls": "--"}
    name = f"distance to -1: $1/M_s$ = {distance:.2f}"
    axes.plot(distance * np.cos(angle) - 1.0, distance * np.sin(angle), label=name, **circle)
    _direction(axes, response)
    axes.plot([-1.0], [0.0], "+", color=paint.ink, ms=11, mew=2.0, zorder=5)
    upper = 1.0 / robustness.gain_upper if math.isfinite(robustness.gain_upper) else 0.0
    line: dict[str, Any] = {"arrowstyle": "-", "color": paint.ink, "lw": 0.8}
    fall = f"the gain may fall to\n{robustness.gain_lower:.2g} times its value"
    rise = f"rise to\n{robustness.gain_upper:.2g} times"
    for x, text, place in ((-1.0 / robustness.gain_lower, fall, 1.45), (-upper, rise, -1.45)):
        axes.plot([x], [0.0], "o", color=paint.ink, ms=6, zorder=5)
        side, start = ("left", 0.0) if place > 0.0 else ("center", 0.5)
        line["relpos"] = (start, 0.0 if place > 0.0 else 1.0)
        look: dict[str, Any] = {"ha": side, "va": "center", "fontsize": sized(9)}
        axes.annotate(text, (x, 0.0), xytext=(x, place), arrowprops=line, **look)
    half, legend = 0.5 * (reach + 1.6), {"fontsize": sized(9)}
    limits: dict[str, Any] = {"aspect": "equal", "xlim": (-reach, 1.6), "ylim": (-half, half)}
    labels = "real part of the loop gain  [1]", "imaginary part  [1]"
    labelled(axes, *labels, "Nyquist curve: the point is held", legend=legend, **limits)


def _direction(axes: Axes, response: NDArray[np.complex128]) -> None:
    size = np.abs(response)
    i = int(np.abs(size - 0.75 * size.max()).argmin())
    j = min(i + 5, response.size - 1)
    tail, tip = ((at.real, at.imag) for at in response[[i, j]])
    arrow(axes, tail, tip, color=paint.blue, lw=1.5, mutation_scale=16)
