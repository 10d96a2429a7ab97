"""Colours, lines, axes, captions and file output that the figures share."""

from __future__ import annotations

import io
import math
import os
import re
import textwrap
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import write_whole
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.wheelset import Wheelset

# Colours that colour-blind readers can tell apart (Okabe & Ito).
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#6E6E6E"
SHADE = "#EDEDED"
DASHED, DOTTED = (0, (4, 1.5)), (0, (1, 1.5))
# Three lines that differ in width as well, so that they can be told apart in grey.
THREE = ((BLUE, 1.2), (ORANGE, 2.0), (GREEN, 2.9))
AT_CONSTANT_TORQUE = ("stable at constant torque", "unstable at constant torque")
# Captions are plain text; under a figure their symbols are typeset as on its axes.
SYMBOLS = {
    "k_hat": r"$\hat{K}$",
    "zeta0": r"$\zeta_0$",
    "f_s": "$f_s$",
    "f_d": "$f_d$",
    "c/a": "$c/a$",
}
# File formats, and the metadata that leaves out the date: a figure always gives the same bytes.
UNDATED: dict[str, dict[str, None]] = {
    "png": {},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "lines.linewidth": 2.0,
    "svg.fonttype": "none",
    "svg.hashsalt": "contactlib",
}
HATCHED: dict[Any, Any] = {**STYLE, "hatch.linewidth": 0.6, "hatch.color": "#BDBDBD"}


def save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure to `path`; the suffix (png, svg, pdf) sets the format.

    Raises
    ------
    ValueError
        If the suffix is none of these.
    OSError
        If the file cannot be written.
    """
    path, buffer = Path(path), io.BytesIO()
    kind = path.suffix[1:].lower()
    if kind not in UNDATED:
        raise ValueError(f"{path}: the suffix must be one of: {', '.join(UNDATED)}")
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format=kind, dpi=150, metadata=UNDATED[kind])
    return write_whole(path, buffer.getvalue())


def save_pictures(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG; the layout, half of the work, is computed once."""
    png = save(figure, folder / f"{name}.png")
    engine = figure.get_layout_engine()
    figure.set_layout_engine("none")
    svg = save(figure, folder / f"{name}.svg")
    figure.set_layout_engine(engine)
    return [png, svg]


def new_figure(width: float, height: float, **grid: Any) -> tuple[Figure, Any]:
    """Make a figure of a width and height in inches; return it and its axes."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(**grid)


def percent_axis(axis: Any) -> None:
    """Label an axis of fractions in per cent."""
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{100.0 * v:g}"))


def plain_log(axis: Axis, *steps: float) -> None:
    """Label a logarithmic axis with plain numbers, at these steps of each decade."""
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axis.set_minor_formatter(NullFormatter())


def percent(creepage: float) -> str:
    """A creepage in per cent, to three digits."""
    if creepage >= 10.0:
        return f"{100.0 * creepage:.0f} %"
    return f"{100.0 * creepage:#.3g}".rstrip(".") + " %"


def by_stability(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    stable: NDArray[np.bool_],
    *,
    color: str | None = None,
    labels: tuple[str | None, str | None] = (None, None),
    **style: Any,
) -> None:
    """Draw a curve solid where it is stable and dashed elsewhere, in one colour or in two."""
    # A point beside a change belongs to both lines, so that they meet.
    meets = ~stable | np.append(~stable[1:], False) | np.append(False, ~stable[:-1])
    axes.plot(x, np.where(stable, y, np.nan), color=color or BLUE, label=labels[0], **style)
    dashed: dict[str, Any] = {"color": color or ORANGE, "ls": DASHED, "label": labels[1]}
    axes.plot(x, np.where(meets, y, np.nan), **dashed, **style)


def dot(axes: Axes, x: float, y: float, *, stable: bool) -> None:
    """Mark a state: filled if it is stable, hollow if it is not."""
    axes.plot([x], [y], "o", color="black", mfc="black" if stable else "white", ms=6.5, zorder=5)


def mark(
    axes: Axes, x: float, y: float, text: str, offset: tuple[float, float], **style: Any
) -> None:
    """Mark a point and name it."""
    axes.plot([x], [y], "o", color="black", ms=6, zorder=5)
    axes.annotate(text, (x, y), xytext=offset, textcoords="offset points", **style)


def typeset(figure: Figure, caption: str) -> str:
    """Wrap a caption to the figure's width and typeset its symbols as on the axes."""
    width = int(14.5 * figure.get_figwidth())
    lines = textwrap.fill(caption, width, break_on_hyphens=False)
    return re.sub("|".join(SYMBOLS), lambda found: SYMBOLS[found.group()], lines)


def add_caption(figure: Figure, caption: str) -> None:
    """Set a caption under a figure."""
    figure.supxlabel(typeset(figure, caption), x=0.01, ha="left", size=9, linespacing=1.4)


def setting(wheelset: Wheelset, speed: float | None = None) -> str:
    """Parameters of a wheelset, for a caption."""
    element, friction = wheelset.element, wheelset.element.friction
    parts = [] if element.table.one_axis else [f"k_hat {element.k_hat:.3g}"]
    parts += [
        f"zeta0 {100.0 * element.saturation_creepage:.3g} %",
        f"f_d {friction.kinetic:.3g}",
        f"$P$ {1e-3 * element.contact.normal_load:.4g} kN",
        f"$r$ {wheelset.radius:.3g} m",
        f"$J$ {wheelset.inertia:.4g} kg m$^2$",
        f"$b$ {wheelset.damping:.3g} N m s",
    ]
    if friction.slip_rate_decay > 0.0:
        parts += [
            f"slip-rate residual {friction.slip_rate_residual:.3g}",
            f"decay {friction.slip_rate_decay:.3g} s/m",
        ]
    if wheelset.mass is not None:
        parts.append(f"$M$ {1e-3 * wheelset.mass:.4g} t")
    if speed is not None:
        parts.append(f"$V$ {speed:.3g} m/s{' (held)' if wheelset.speed_held else ''}")
    elif wheelset.speed_held:
        parts.append("$V$ held")
    return _listed(parts)


def drivetrain_setting(drivetrain: Drivetrain) -> str:
    """Parameters of a drivetrain, for a caption."""
    parts = []
    if drivetrain.motor_lag > 0.0:
        parts.append(f"motor lag {1e3 * drivetrain.motor_lag:.3g} ms")
    if drivetrain.relaxation_length > 0.0:
        parts.append(f"relaxation length {1e3 * drivetrain.relaxation_length:.3g} mm")
    if drivetrain.axle is not None:
        hertz = drivetrain.torsional_frequency / (2.0 * math.pi)
        damping = 100.0 * drivetrain.torsional_damping_ratio
        parts.append(f"axle {hertz:.3g} Hz, {damping:.2g} % of critical")
    more = _listed(parts) if parts else ""
    return f"{setting(drivetrain.wheelset)} {more[:1].upper()}{more[1:]}".rstrip()


def _listed(parts: list[str]) -> str:
    """Join parameters; no-break spaces keep a number and its unit on one line."""
    return ", ".join(part.replace(" ", "\u00a0") for part in parts) + "."
