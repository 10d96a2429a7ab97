"""Frequency response of a wheelset to its torque, with the contact's memory and without it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray
from contactlib.figures.stability.steepest import steepest_fall
from contactlib.figures.style import (
    DASHED,
    DOTTED,
    add_caption,
    labelled,
    new_figure,
    note,
    paint,
    percent,
    setting,
    styled,
)
from contactlib.stability import find_fold
from contactlib.vehicle.conditions import OperatingPoint
from contactlib.vehicle.wheelset import STATES, Wheelset

RISING = 0.25  # creepage of the point on the rising branch / that of the fold
BEYOND, POINTS = 10.0, 400  # factor of the frequencies beyond poles and memories; their number
SIZE = 1e5  # creepage in % over torque in kN.m


def bode_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Bode plots from drive torque to creepage at one point of each branch.

    The vehicle's speed is constant, so that the speed of the rim follows the creepage.
    """
    held = replace(wheelset, mass=None)
    steady = held.without_memory()
    bodies = replace(held, element=replace(held.element, memory=True)), steady
    chosen = {
        "Rising branch": RISING * find_fold(steady, speed=speed).creepage,
        "Falling branch": steepest_fall(steady, speed).creepage,
    }
    points = [
        [body.balanced(creepage=zeta, speed=speed) for body in bodies] for zeta in chosen.values()
    ]
    rates = [abs(rate) for lags, follows in points for rate in (_rate(lags), *follows.eigenvalues)]
    omega = np.geomspace(min(rates) / BEYOND, max(rates) * BEYOND, POINTS)
    looks = (("with memory", paint.blue, 2.0), ("without memory", paint.ink, 1.0))
    with styled():
        figure, grid = new_figure(11.0, 6.2, nrows=2, ncols=2, sharex=True, sharey="row")
        for (upper, lower), name, pair in zip(grid.T, chosen, points, strict=True):
            for body, point, (label, color, width) in zip(bodies, pair, looks, strict=True):
                size, phase = _response(body, point, omega)
                ls = "-" if point.stable else DASHED
                for axes, values in ((upper, SIZE * size), (lower, phase)):
                    hertz = omega / (2.0 * math.pi)
                    axes.plot(hertz, values, color=color, lw=width, ls=ls, label=label)
            lags, follows = pair
            frequency = _rate(lags) / (2.0 * math.pi)
            for axes in (upper, lower):
                axes.axvline(frequency, color=paint.grey, lw=1.2, ls=DOTTED)
            shown = f"{frequency:.3g} Hz" if frequency < 1e3 else f"{1e-3 * frequency:.3g} kHz"
            text = f"$V/(2\\pi L)$ = {shown},\n$L$ {1e3 * speed / _rate(lags):.2g} mm"
            at = {"xycoords": ("data", "axes fraction"), "ha": "right", "va": "bottom"}
            note(upper, text, (frequency, 0.04), (-5, 0), **at)
            pole = float(follows.eigenvalues[0].real)
            title = f"{name}, {percent(lags.creepage)}; pole {pole:.3g} 1/s"
            labelled(upper, title=title, log="xy", steps=(1.0,))
            labelled(lower, "frequency  [Hz]", log="x", steps=(1.0,))
        labelled(grid[0, 0], y="creepage/torque\n[%/(kN m)]")
        labelled(grid[1, 0], y="phase  [deg]", legend={"loc": "upper right"})
        grid[1, 0].yaxis.set_major_locator(MultipleLocator(45.0))
        ways = partial(np.multiply, 1e-2 * speed), partial(np.multiply, 1e2 / speed)
        rim = grid[0, 1].secondary_yaxis("right", functions=ways)
        rim.set_ylabel("rim speed/torque\n[(m/s)/(kN m)]")
        add_caption(
            figure,
            "A contact with memory follows its creepage with the rate $V/L$, the dotted line; $L$, "
            "the relaxation length at the point, is short where the contact slides. Linearised for "
            "motions towards larger creepage. Dashed: unstable at constant torque. "
            f"{'Constant vehicle speed. ' * (not wheelset.speed_held)}{setting(wheelset, speed)}",
        )
    return figure


def _rate(point: OperatingPoint) -> float:
    """Rate V/L with which the force of a contact with memory follows its creepage [1/s]."""
    force = STATES.index("held_force") - len(STATES)  # from the end, as the speed may be held
    return -float(point.jacobian[force, force])


def _response(
    body: Wheelset, point: OperatingPoint, omega: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Size [1/(N.m)] and phase [deg] of the creepage over the drive torque."""
    control = optional_library("control")

    system = body.linearize(point)[["creepage"], ["drive_torque"]]
    response = control.frequency_response(system, omega).frdata[0, 0]
    phase = np.degrees(np.unwrap(np.angle(response)))
    return np.abs(response), phase - 360.0 * np.round((phase[0] + 90.0) / 360.0)
