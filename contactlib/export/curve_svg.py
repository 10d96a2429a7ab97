"""The creep curve of a force element as a small inline SVG picture.

The page's style sheet defines the classes used here, so that the picture has the reader's colours.
Importing matplotlib for one line would take half as long again as the export of an FMU.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.element.force_element import ForceElement
from contactlib.laws.traction_data import TractionData
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.wheelset import Wheelset

LEFT, RIGHT, TOP, BOTTOM = 64, 620, 18, 308  # of the axes, in a picture of 640 by 360
FAR = 5.0  # minimum creepage at the end of the picture / creepage of the peak


class TractionCurve(NamedTuple):
    """Traction coefficient Q/P over creepage [1]; `peak` is the peak's index, if there is one.

    `points` are those of a measured curve.
    """

    creepage: FloatArray
    traction_coefficient: FloatArray
    peak: int | None
    points: TractionData | None


def sample_curve(element: ForceElement, *, speed: float) -> TractionCurve:
    """Points of an element's curve at nominal load and a speed [m/s], computed by the kernel.

    They include the peak and extend past it, or past saturation if there is no peak; of a measured
    curve they end with the last measured point.
    """
    scale = element.saturation_creepage
    summit, highest = CreepCurve(Wheelset(element, inertia=1.0), speed=speed).peak
    far = float(element.at_creepage(1e3 * scale, speed=speed)["creep_force"])
    has_peak = math.isfinite(summit) and highest > far * (1.0 + 1e-9)  # not a plateau
    measured = element.table.points
    reach = _ticks(FAR * (summit if has_peak else scale))[-1]
    if measured is not None:
        reach = float(measured.creepage.max())
        has_peak = has_peak and summit <= reach
    fine = np.linspace(0.0, min(1.0, 2.0 * scale / reach), 61)
    creepage = np.unique(np.concatenate([fine, np.linspace(0.0, 1.0, 121)]).round(9)) * reach
    if has_peak:
        creepage = np.union1d(creepage, [summit])
    peak = int(np.searchsorted(creepage, summit)) if has_peak else None
    traction = np.asarray(element.at_creepage(creepage, speed=speed)["traction_coefficient"])
    return TractionCurve(creepage, traction, peak, measured)


def curve_svg(curve: TractionCurve) -> str:
    """Draw a curve with ticks, its peak marked and its falling branch dashed."""
    percent, traction, points = 100.0 * curve.creepage, curve.traction_coefficient, curve.points
    measured = np.empty(0) if points is None else points.traction_coefficient
    x_ticks, y_ticks = _ticks(percent[-1]), _ticks(1.12 * np.max([*traction, *measured]))

    def across(x: float) -> str:
        return f"{LEFT + (RIGHT - LEFT) * x / x_ticks[-1]:.3f}"

    def up(y: float) -> str:
        return f"{BOTTOM - (BOTTOM - TOP) * y / y_ticks[-1]:.3f}"

    def places(x: Iterable[float], y: Iterable[float]) -> list[str]:
        return [f"{across(a)} {up(b)}" for a, b in zip(x, y, strict=True)]

    def path(kind: str, data: str) -> str:
        return f'<path class="{kind}" d="{data}"/>'

    parts = [path("grid", f"M{across(x)} {BOTTOM}V{TOP}") for x in x_ticks]
    parts += [path("grid", f"M{LEFT} {up(y)}H{RIGHT}") for y in y_ticks]
    parts.append(path("axis", f"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}"))
    parts += [f'<text class="tick x" x="{across(x)}" y="326">{x:g}</text>' for x in x_ticks]
    parts += [f'<text class="tick y" x="56" y="{up(y)}" dy="4">{y:g}</text>' for y in y_ticks]
    parts.append('<text class="label" x="342" y="350">creepage &#950; [%]</text>')
    turned = 'transform="translate(16 163) rotate(-90)"'
    parts.append(f'<text class="label" {turned}>traction coefficient Q/P [1]</text>')
    if points is not None:
        dots = places(100.0 * points.creepage, np.maximum(measured, 0.0))
        parts.append(path("points", "".join(f"M{place}h0" for place in dots)))
    line = places(percent, traction)
    last = len(line) if curve.peak is None else curve.peak + 1
    parts.append(path("rising", "M" + "L".join(line[:last])))
    if curve.peak is not None:
        x, y = line[curve.peak].split()
        parts.append(path("falling", "M" + "L".join(line[curve.peak :])))
        parts.append(f'<circle class="peak" cx="{x}" cy="{y}" r="4.5"/>')
    title = "Traction coefficient over creepage at nominal load"
    return (
        f'<svg viewBox="0 0 640 360" role="img" aria-label="{title}">'
        f"<title>{title}</title>{''.join(parts)}</svg>"
    )


def _ticks(reach: float) -> list[float]:
    """At most seven round numbers from zero to `reach` or the next one above."""
    power = 10.0 ** math.floor(math.log10(reach / 6.0))
    step = next(power * n for n in (1.0, 2.0, 5.0, 10.0) if 6.0 * power * n >= reach * (1 - 1e-12))
    count = math.ceil(reach / step * (1.0 - 1e-12))
    return [round(i * step, 12) for i in range(count + 1)]
