"""The creep curve of a force element as a small inline SVG picture.

The page in an FMU shows its curve without matplotlib or scripts, and in the reader's colour scheme;
the page's style sheet defines the classes used here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.element.force_element import ForceElement
from contactlib.laws.traction_data import TractionData
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.wheelset import Wheelset

WIDTH, HEIGHT = 640, 360  # in the picture's units
LEFT, RIGHT, TOP, BOTTOM = 64, 20, 18, 52  # margins around the axes
WORDS = 200.0  # more than the width of a text beside the curve
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

    def traction(creepage: FloatArray) -> FloatArray:
        record = element.at_creepage(creepage, speed=speed)
        return np.asarray(record["traction_coefficient"])

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
    return TractionCurve(creepage, traction(creepage), peak, measured)


def curve_svg(curve: TractionCurve, level_name: str, level_value: float) -> str:
    """Draw a curve with ticks, a level, its peak marked and its falling branch dashed."""
    percent = 100.0 * curve.creepage
    x_ticks = _ticks(float(percent[-1]))
    highest = float(curve.traction_coefficient.max())
    if curve.points is not None:
        highest = max(highest, float(curve.points.traction_coefficient.max()))
    y_ticks = _ticks(1.12 * highest)
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT

    def across(x: Any) -> Any:
        return LEFT + (right - LEFT) * x / x_ticks[-1]

    def up(y: Any) -> Any:
        return bottom - (bottom - TOP) * y / y_ticks[-1]

    def path(kind: str, part: slice) -> str:
        points = zip(percent[part], curve.traction_coefficient[part], strict=True)
        data = "M" + "L".join(f"{across(x):.3f} {up(y):.3f}" for x, y in points)
        return f'<path class="{kind}" d="{data}"/>'

    dots = np.empty((0, 2))
    if curve.points is not None:
        measured = 100.0 * curve.points.creepage, curve.points.traction_coefficient
        dots = np.column_stack([across(measured[0]), np.minimum(up(measured[1]), bottom)])
        # Of points that cover each other one is enough.
        dots = dots[np.sort(np.unique(dots.round(), axis=0, return_index=True)[1])]

    def heights(x: float, wide: float, *more: float) -> list[float]:
        """Heights on the picture of `more` and of the points above or below a text."""
        return [*dots[(dots[:, 0] > x) & (dots[:, 0] < x + wide), 1], *more]

    def parts() -> Iterator[str]:
        for x in x_ticks:
            yield f'<path class="grid" d="M{across(x):.3f} {bottom}V{TOP}"/>'
            yield f'<text class="tick x" x="{across(x):.3f}" y="{bottom + 18}">{x:g}</text>'
        for y in y_ticks:
            yield f'<path class="grid" d="M{LEFT} {up(y):.3f}H{right}"/>'
            yield f'<text class="tick y" x="{LEFT - 8}" y="{up(y):.3f}" dy="4">{y:g}</text>'
        yield f'<path class="axis" d="M{LEFT} {TOP}V{bottom}H{right}"/>'
        yield (
            f'<text class="label" x="{(LEFT + right) / 2}" y="{HEIGHT - 10}">'
            "creepage &#950; [%]</text>"
        )
        yield (
            f'<text class="label" transform="translate(16 {(TOP + bottom) / 2}) rotate(-90)">'
            "traction coefficient Q/P [1]</text>"
        )
        level = up(level_value)
        yield f'<path class="level" d="M{LEFT} {level:.3f}H{right}"/>'
        yield (
            f'<text class="note" x="{right - 4}" '
            f'y="{max(heights(right - WORDS, WORDS + 1.0, level)) + 16:.3f}" text-anchor="end">'
            f"{level_name} {level_value:.4g}</text>"
        )
        if dots.size:
            data = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in dots)
            yield f'<path class="points" d="{data}"/>'
        last = len(percent) if curve.peak is None else curve.peak + 1
        yield path("rising", slice(0, last))
        if curve.peak is not None:
            x, y = float(percent[curve.peak]), float(curve.traction_coefficient[curve.peak])
            yield path("falling", slice(curve.peak, None))
            yield f'<circle class="peak" cx="{across(x):.3f}" cy="{up(y):.3f}" r="4.5"/>'
            over = min(heights(across(x), WORDS, up(y)))
            yield (
                f'<text class="note strong" x="{across(x) + 12:.3f}" y="{over - 6:.3f}">'
                f"peak {y:.4g} at {x:.3g} %</text>"
            )

    title = "Traction coefficient over creepage at nominal load"
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{title}">'
        f"<title>{title}</title>{''.join(parts())}</svg>"
    )


def _ticks(reach: float) -> list[float]:
    """At most seven round numbers from zero to `reach` or the next one above."""
    power = 10.0 ** math.floor(math.log10(reach / 6.0))
    step = next(power * n for n in (1.0, 2.0, 5.0, 10.0) if 6.0 * power * n >= reach * (1 - 1e-12))
    count = math.ceil(reach / step * (1.0 - 1e-12))
    return [round(i * step, 12) for i in range(count + 1)]
