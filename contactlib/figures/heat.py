"""A contact that slip warms: what happens along it, and its creep curves at several speeds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from contactlib.base.quantities import POSITIVE, checked
from contactlib.contact.hot_contact import HotContact
from contactlib.contact.traction_data import TractionData
from contactlib.figures.style import (
    DASHED,
    add_caption,
    new_figure,
    paint,
    percent,
    percent_axis,
    styled,
)

ALONG = (
    "Shear traction and temperature along the middle of a contact at {speed:g} m/s. Surfaces enter "
    "at the right, stick, and slip behind the stick boundary; there friction bounds the traction "
    "and warms the surface, and friction is lower where it is warmer. The dashed line is the bound "
    "of cold friction."
)
CURVES = (
    "Traction coefficient over creepage at several speeds, with the same constants. At the same "
    "creepage a faster wheel slips more metres per second, but its surfaces are together for a "
    "shorter time: temperature grows like the root of the speed. Dashed: without heat."
)


def hot_strips(contact: HotContact, creepages: Sequence[float], *, speed: float) -> Figure:
    """Shear traction and temperature along the middle strip, by the local solution.

    Parameters
    ----------
    contact : HotContact
        The contact.
    creepages : sequence of float
        One to three creepages [1], not 0.
    speed : float
        V [m/s].

    Raises
    ------
    ValueError
        If a number is out of range, or there are more than three creepages.
    """
    if not 1 <= len(creepages) <= len(paint.three):
        raise ValueError(f"creepages has {len(creepages)} numbers: must be 1 to 3")
    with styled():
        figure, (left, right) = new_figure(9.6, 4.6, ncols=2)
        xi = np.linspace(-1.0, 1.0, 401)
        bound = contact.friction.kinetic * 1e-6 * contact.heat.contact.peak_pressure
        left.plot(xi, bound * np.sqrt(1.0 - xi**2), color=paint.grey, lw=1.0, ls=DASHED)
        for creepage, (color, width) in zip(creepages, paint.three, strict=False):
            strip = contact.strip(creepage, speed)
            look = {"color": color, "lw": width, "label": f"creepage {percent(abs(creepage))}"}
            left.plot(strip.position, 1e-6 * np.abs(strip.shear_traction), **look)
            right.plot(strip.position, strip.temperature, **look)
        left.set_ylabel("shear traction  [MPa]")
        right.set_ylabel("temperature above ambient  [K]")
        for axes in (left, right):
            axes.set_xlim(-1.0, 1.0)
            axes.set_ylim(bottom=0.0)
            axes.set_xlabel("position $x/a$  [1], leading edge at 1")
        right.set_ylim(top=1.3 * right.get_ylim()[1])  # room for the legend
        right.legend(loc="upper right")
        add_caption(figure, ALONG.format(speed=speed))
    return figure


def hot_curves(
    contact: HotContact,
    speeds: Sequence[float],
    *,
    data: TractionData | None = None,
    largest_creepage: float = 0.25,
) -> Figure:
    """Creep curves at several speeds, by the closed form.

    Parameters
    ----------
    contact : HotContact
        The contact.
    speeds : sequence of float
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
            axes.plot(
                data.creepage,
                data.traction_coefficient,
                "o",
                color=paint.mixed(71),
                ms=3.0,
                label="measured",
            )
        cold = contact.traction_coefficient(zeta, 1e-9)  # nothing is warmed
        axes.plot(zeta, cold, color=paint.grey, lw=1.0, ls=DASHED)
        for i, speed in enumerate(values):
            share = i / max(len(values) - 1, 1)
            axes.plot(
                zeta,
                contact.traction_coefficient(zeta, speed),
                color=(paint.blue, paint.orange, paint.green)[i % 3],
                lw=0.9 + 1.8 * share,
                label=f"{speed:g} m/s",
            )
        axes.set_xlim(0.0, far)
        axes.set_ylim(bottom=0.0)
        percent_axis(axes.xaxis)
        axes.set_xlabel(r"creepage $\zeta$  [%]")
        axes.set_ylabel("traction coefficient $Q/P$  [1]")
        axes.legend(loc="lower right", ncols=2)
        add_caption(figure, CURVES)
    return figure
