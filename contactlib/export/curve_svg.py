"""The creep curve of a force element as a small inline SVG picture.

The page in an FMU shows its curve without matplotlib or scripts, and in the reader's colour scheme;
the page's style sheet defines the classes used here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.contact.element import ForceElement

WIDTH, HEIGHT = 640, 360  # in the picture's units
LEFT, RIGHT, TOP, BOTTOM = 64, 20, 18, 52  # margins around the axes
FAR = 5.0  # least creepage at the end of the picture / creepage of the peak


class CreepCurve(NamedTuple):
    """Traction coefficient Q/P over creepage [1]; `peak` is the peak's index, if there is one."""

    creepage: FloatArray
    traction_coefficient: FloatArray
    peak: int | None


def sample_curve(element: ForceElement, *, speed: float) -> CreepCurve:
    """Points of an element's curve at nominal load and a speed [m/s], computed by the kernel.

    The points include the peak and extend past it, or past saturation if there is no peak.
    """

    def traction(creepage: FloatArray) -> FloatArray:
        record = element.at_creepage(creepage, speed=speed)
        return np.asarray(record["traction_coefficient"])

    scale = element.saturation_creepage
    places = scale * np.geomspace(1e-2, 1e3, 500)
    for _ in range(4):  # each round is 250 times finer
        values = traction(places)
        top = int(np.argmax(values))
        summit, height = float(places[top]), float(values[top])
        around = places[max(top - 1, 0) : top + 2]
        places = np.linspace(float(around[0]), float(around[-1]), 501)
    has_peak = height > float(traction(np.array([1e3 * scale]))[0]) * (1.0 + 1e-9)
    reach = _ticks(FAR * (summit if has_peak else scale))[-1]
    fine = np.linspace(0.0, 2.0 * scale / reach, 61)
    creepage = np.unique(np.concatenate([fine, np.linspace(0.0, 1.0, 121)]).round(9)) * reach
    if has_peak:
        creepage = np.union1d(creepage, [summit])
    peak = int(np.searchsorted(creepage, summit)) if has_peak else None
    return CreepCurve(creepage, traction(creepage), peak)


def curve_svg(curve: CreepCurve, level_name: str, level_value: float) -> str:
    """Draw a curve with ticks, a level, its peak marked and its falling branch dashed."""
    percent = 100.0 * curve.creepage
    x_ticks = _ticks(float(percent[-1]))
    y_ticks = _ticks(1.12 * float(curve.traction_coefficient.max()))
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT

    def across(x: float) -> float:
        return LEFT + (right - LEFT) * x / x_ticks[-1]

    def up(y: float) -> float:
        return bottom - (bottom - TOP) * y / y_ticks[-1]

    def path(kind: str, part: slice) -> str:
        points = zip(percent[part], curve.traction_coefficient[part], strict=True)
        data = "M" + "L".join(f"{across(x):.3f} {up(y):.3f}" for x, y in points)
        return f'<path class="{kind}" d="{data}"/>'

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
            f'<text class="note" x="{right - 4}" y="{level + 16:.3f}" text-anchor="end">'
            f"{level_name} {level_value:.4g}</text>"
        )
        last = len(percent) if curve.peak is None else curve.peak + 1
        yield path("rising", slice(0, last))
        if curve.peak is not None:
            x, y = float(percent[curve.peak]), float(curve.traction_coefficient[curve.peak])
            yield path("falling", slice(curve.peak, None))
            yield f'<circle class="peak" cx="{across(x):.3f}" cy="{up(y):.3f}" r="4.5"/>'
            yield (
                f'<text class="note strong" x="{across(x) + 12:.3f}" y="{up(y) - 6:.3f}">'
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
