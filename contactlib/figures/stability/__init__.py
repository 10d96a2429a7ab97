"""Figures of the stability of one wheelset: slip-away and its control.

Stable branches are solid and unstable ones dashed; a stable state is a filled dot, an unstable one
a hollow dot.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from matplotlib.figure import Figure

from contactlib.figures.runs import creep_curve
from contactlib.figures.stability.bode import bode_figure
from contactlib.figures.stability.loops import gains_figure, loop_figure
from contactlib.figures.stability.phase import phase_figure
from contactlib.figures.stability.s_curve import poles_figure, s_curve_figure
from contactlib.figures.stability.slip_away import clearing_figure, slip_away_figure
from contactlib.figures.stability.torsion import torsion_figure
from contactlib.stability.poles import steady_rolling
from contactlib.vehicle.wheelset import Wheelset

__all__ = ["STABILITY_FIGURES", "StabilityFigure"]


class StabilityFigure(NamedTuple):
    """A function that draws a wheelset at a speed [m/s], and the title of its figure."""

    draw: Callable[[Wheelset, float], Figure]
    title: str


def _creep_curve(wheelset: Wheelset, speed: float) -> Figure:
    return creep_curve(wheelset, speed=speed)


def _steady(draw: Callable[[Wheelset, float], Figure]) -> Callable[[Wheelset, float], Figure]:
    """Draw a figure of analyses that take rolling as steady; with memory this gives a warning."""

    def drawn(wheelset: Wheelset, speed: float) -> Figure:
        name = f"stability_{draw.__name__.removesuffix('_figure')}"
        return draw(steady_rolling(wheelset, name, wheelset.conditions(speed=speed)), speed)

    return drawn


STABILITY_FIGURES = {
    "creep_curve": StabilityFigure(
        _creep_curve, "Creep curve, and where a constant torque holds the wheelset"
    ),
    "s_curve": StabilityFigure(s_curve_figure, "Steady creepages over drive torque"),
    "poles": StabilityFigure(
        poles_figure, "Fast pole, and the delays at which a gain can still hold it"
    ),
    "bode": StabilityFigure(
        bode_figure, "Frequency response to the torque, with the contact's memory and without it"
    ),
    "phase": StabilityFigure(
        _steady(phase_figure), "Basin of grip, and runs on either side of its border"
    ),
    "slip_away": StabilityFigure(_steady(slip_away_figure), "Time to slip-away under an overload"),
    "clearing": StabilityFigure(
        _steady(clearing_figure), "How long a patch of low friction may be"
    ),
    "gains": StabilityFigure(
        _steady(gains_figure), "Gains of creep control that hold the falling branch"
    ),
    "loop": StabilityFigure(loop_figure, "Root locus and Nyquist curve of creep control"),
    "torsion": StabilityFigure(
        _steady(torsion_figure), "Vibrations of the wheels against each other"
    ),
}
