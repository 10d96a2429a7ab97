"""Contact with thermal softening: its creep curves, and stability at several speeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from contactlib.base.quantities import POSITIVE, checked
from contactlib.figures.style import (
    DASHED,
    add_caption,
    labelled,
    new_figure,
    paint,
    setting,
    styled,
    thermal_setting,
)
from contactlib.laws.thermal_contact import ThermalContact
from contactlib.laws.traction_data import TractionData
from contactlib.stability import clearing, find_fold, worst_pole
from contactlib.vehicle.wheelset import Wheelset

CURVES = (
    "Traction coefficient over creepage at several speeds, with the same constants. At the same "
    "creepage a faster wheel slips more metres per second, but its surfaces are together for a "
    "shorter time: temperature grows like the root of the speed. Dashed: without heat."
)
TORQUE = "critical torque  [kN m]"
OVER_SPEED = (
    "What a constant torque meets at each speed: above the critical torque the wheel slips away, "
    "and a deviation on the steepest fall grows e-fold in the time constant. At 5 % below the "
    "critical torque it slips away on a patch of half the friction that lasts longer than the "
    "clearing time."
)
STYLES = ("-", "-.", ":")  # each for three colours


def thermal_curves(
    contact: ThermalContact,
    speeds: ArrayLike,
    *,
    data: TractionData | None = None,
    largest_creepage: float = 0.25,
) -> Figure:
    """Creep curves at several speeds, by the closed form.

    Parameters
    ----------
    contact : ThermalContact
        The contact.
    speeds : array_like
        V [m/s], each above 0.
    data : TractionData, optional
        Measured points to draw beneath them.
    largest_creepage : float, optional
        End of the axis [1], above 0. Default: 0.25.

    Raises
    ------
    ValueError
        If a number is out of range.
    """
    values = checked("speeds", speeds, POSITIVE)
    far = float(checked("largest_creepage", largest_creepage, POSITIVE))
    zeta = far * np.linspace(0.0, 1.0, 801) ** 2
    with styled():
        figure, axes = new_figure(7.8, 4.8)
        if data is not None:
            points: dict[str, Any] = {"color": paint.mixed(71), "ms": 3.0, "label": "measured"}
            axes.plot(data.creepage, data.traction_coefficient, "o", **points)
        cold = contact.traction_coefficient(zeta, 1e-9)  # nothing is warmed
        axes.plot(zeta, cold, color=paint.grey, lw=1.0, ls=DASHED)
        for i, speed in enumerate(values):
            share = i / max(len(values) - 1, 1)
            mu, look = contact.traction_coefficient(zeta, speed), {"lw": 0.9 + 1.8 * share}
            color, style = (paint.blue, paint.orange, paint.green)[i % 3], STYLES[i // 3 % 3]
            axes.plot(zeta, mu, color=color, ls=style, label=f"{speed:g} m/s", **look)
        limits: dict[str, Any] = {"xlim": (0.0, far), "ylim": (0.0, None)}
        legend = {"loc": "lower right", "ncols": 2}
        labelled(axes, "creepage", "traction coefficient", legend=legend, **limits)
        add_caption(figure, f"{CURVES} {thermal_setting(contact)}")
    return figure


def stability_over_speed(wheelsets: Mapping[str, Wheelset], speeds: ArrayLike) -> Figure:
    """Critical torque, time constant of slip-away and clearing time over speed.

    The clearing time is that of a torque 5 % below the critical one, on half of the friction.

    Parameters
    ----------
    wheelsets : mapping
        One to three wheelsets, by their names in the legend.
    speeds : array_like
        V [m/s], above 0 and strictly increasing.

    Raises
    ------
    ValueError
        If a number is out of range, there are more than three wheelsets, or one of them has no
        critical torque.
    """
    values = checked("speeds", speeds, POSITIVE)
    if not 1 <= len(wheelsets) <= len(paint.three):
        raise ValueError(f"wheelsets has {len(wheelsets)} members: must have 1 to 3")
    with styled():
        figure, axes = new_figure(9.6, 4.9, ncols=3)
        for (name, wheelset), (color, width) in zip(wheelsets.items(), paint.three, strict=False):
            folds = [find_fold(wheelset, speed=v).drive_torque for v in values]
            growth = [1.0 / worst_pole(wheelset, speed=v).pole for v in values]
            times = [
                clearing(wheelset, speed=v, drive_torque=0.95 * fold, friction_scale=0.5).time
                for v, fold in zip(values, folds, strict=True)
            ]
            look = {"color": color, "lw": width, "label": name}
            for place, rows in zip(axes, (folds, growth, times), strict=True):
                place.plot(values, (1e-3 if place is axes[0] else 1e3) * np.array(rows), **look)
        low, high = axes[0].get_ylim()
        limits = ((low - 0.5 * (high - low), high), (0.0, None), (0.0, None))  # legend below
        names = "time constant of slip-away  [ms]", "clearing time  [ms]"
        for place, name, ylim in zip(axes, (TORQUE, *names), limits, strict=True):
            labelled(place, "speed", name, xlim=(0.0, values[-1]), ylim=ylim)
        axes[0].legend(loc="lower left")
        each = (f"{name}: {setting(wheelset)}" for name, wheelset in wheelsets.items())
        add_caption(figure, " ".join([OVER_SPEED, *each]))
    return figure
