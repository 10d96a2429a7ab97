"""Colours, lines, axes, captions and sizes that the figures share."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray, Parameters, declared
from contactlib.element.force_element import ForceElement
from contactlib.kernel import process_zone_limit
from contactlib.laws.friction import EXPONENTIAL
from contactlib.laws.hertz import Contact, EllipticContact
from contactlib.laws.scales import process_zone_ratio
from contactlib.runs.result import Result
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.wheelset import Wheelset

DASHED, DOTTED = (0, (4, 1.5)), (0, (1, 1.5))
AT_CONSTANT_TORQUE = ("stable at constant torque", "unstable at constant torque")
# Captions are plain text; under a figure their symbols are typeset as on its axes.
SYMBOLS = {
    "k_hat": r"$\hat{K}$",
    "zeta0": r"$\zeta_0$",
    "f_s": "$f_s$",
    "f_d": "$f_d$",
    "c/a": "$c/a$",
}
LABELS = {  # of axes, by what stands there
    "creepage": r"creepage $\zeta$  [%]",
    "normalized creepage": r"creepage $\zeta/\zeta_0$  [1]",
    "traction ratio": r"traction ratio $Q/(f_d P)$  [1]",
    "traction coefficient": r"traction coefficient $Q/P$  [1]",
    "torque": "drive torque  [kN m]",
    "speed": r"speed $V$  [m/s]",
    "gain": r"gain $K_p$  [kN m]",
    "stick boundary": "stick boundary $c/a$  [1]: full stick at -1, full slip at 1",
}
SHOWN = {  # parameters in captions: symbol, factor and unit, if not those of the declaration
    "inertia": ("$J$", 1.0, "kg m$^2$"),
    "mass": ("$M$", 1e-3, "t"),
    "damping": ("$b$", 1.0, "N m s"),
    "constant": ("$A$", 1.0, "N"),
    "linear": ("$B$", 1.0, "N s/m"),
    "quadratic": ("$C$", 1.0, "N s$^2$/m$^2$"),
    "grade": ("grade", 100.0, "%"),
    "lag": ("motor lag", 1e3, "ms"),
    "power": ("power", 1e-3, "kW"),
    "torque_rate": ("torque rate", 1e-3, "kN m/s"),
    "trip_speed": ("trip at", 1.0, "m/s"),
    "fill_time": ("brake fill", 1.0, "s"),
    "vent_time": ("brake vent", 1.0, "s"),
    "delay": ("brake delay", 1e3, "ms"),
    "pad_scale": ("pad friction", 100.0, "%"),
}
DEFAULTS = declared(ForceElement)
NAMED = 1.04  # where names of lines stand / width of their panel
SLIDES = {"16:9": "13.333x7.5", "4:3": "10x7.5"}  # sizes by name [in]
# Colours that colour-blind readers can distinguish (Okabe & Ito): blue, orange, green.
CYCLE = ("#0072B2", "#D55E00", "#009E73")
STYLE: dict[Any, Any] = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.linewidth": 0.8,
    "legend.edgecolor": "none",
    "lines.linewidth": 2.0,
    "savefig.dpi": 150,
    "svg.fonttype": "none",
    "svg.hashsalt": "contactlib",
}


def _unchanged(name: Any) -> bool:
    return bool(mpl.rcParams[name] == mpl.rcParamsDefault[name])


@contextmanager
def styled(more: Mapping[str, Any] | None = None) -> Iterator[None]:
    """The style of contactlib, and `more`; settings that the user has changed have priority."""
    own = {**STYLE, "grid.color": paint.mixed(28), "axes.titlesize": sized(11)}
    if to_rgb(mpl.rcParams["grid.color"]) == to_rgb(paint.ink):
        own["grid.alpha"] = 0.2  # as in dark_background, which draws no grid by itself
    own |= more or {}
    with mpl.rc_context({name: value for name, value in own.items() if _unchanged(name)}):
        yield


class _Paint:
    """Colours in the present style: black and white are the colours of text and axes."""

    @property
    def ink(self) -> str:
        return str(mpl.rcParams["text.color"])

    @property
    def paper(self) -> str:
        return str(mpl.rcParams["axes.facecolor"])

    @property
    def blue(self) -> str:
        return self._cycle(0)

    @property
    def orange(self) -> str:
        return self._cycle(1)

    @property
    def green(self) -> str:
        return self._cycle(2)

    @property
    def grey(self) -> str:
        return self.mixed(145)

    @property
    def shade(self) -> str:
        return self.mixed(18)

    @property
    def three(self) -> tuple[tuple[str, float], ...]:
        """Colour and width of three lines, so that they differ in grey."""
        return ((self.blue, 1.2), (self.orange, 2.0), (self.green, 2.9))

    @property
    def hatched(self) -> dict[str, Any]:
        """Settings of a figure whose shades are hatched."""
        return {"hatch.linewidth": 0.6, "hatch.color": self.mixed(66)}

    def mixed(self, part: int) -> str:
        """Ink, `part` of 255, on paper."""
        ink, paper = np.array(to_rgb(self.ink)), np.array(to_rgb(self.paper))
        share = part / 255.0
        if paper.sum() < ink.sum():
            share **= 0.7  # a little light on a dark ground is seen less
        return to_hex(paper + share * (ink - paper)).upper()

    def _cycle(self, number: int) -> str:
        colours = mpl.rcParams["axes.prop_cycle"].by_key().get("color", CYCLE)
        if _unchanged("axes.prop_cycle"):
            colours = CYCLE
        return to_hex(colours[number % len(colours)]).upper()


paint = _Paint()


def sized(size: float) -> float:
    """A size of text, as drawn where matplotlib's ``font.size`` is 10, in the size that holds."""
    return 0.1 * size * float(mpl.rcParams["font.size"])


_captions: ContextVar[bool] = ContextVar("captions", default=True)
_page: ContextVar[tuple[float, float] | None] = ContextVar("page", default=None)


@contextmanager
def captions(shown: bool) -> Iterator[None]:
    """Draw figures in the ``with`` statement with or without their captions.

    Parameters
    ----------
    shown : bool
        Without captions if false.

    Examples
    --------
    >>> with captions(False):
    ...     figure = new_figure(4.0, 3.0)[0]
    ...     add_caption(figure, "A caption.")
    >>> figure.get_supxlabel()
    ''
    """
    token = _captions.set(bool(shown))
    try:
        yield
    finally:
        _captions.reset(token)


@contextmanager
def page_size(size: str | None) -> Iterator[None]:
    """Draw figures in the ``with`` statement on pages of one size, which do not grow with the text.

    Parameters
    ----------
    size : str or None
        Width and height in inches, such as "13.33x7.5"; "16:9" or "4:3", a slide; None, the size
        that each figure has by itself.

    Raises
    ------
    ValueError
        If the size has another form, or a side is not from 2 to 100 inches long.

    Examples
    --------
    >>> with page_size("16:9"):
    ...     figure = new_figure(4.0, 3.0)[0]
    >>> figure.get_size_inches().round(2).tolist()
    [13.33, 7.5]
    """
    token = _page.set(None if size is None else _inches(size))
    try:
        yield
    finally:
        _page.reset(token)


def _inches(size: str) -> tuple[float, float]:
    match = re.fullmatch(r"([0-9.]{1,9})x([0-9.]{1,9})", SLIDES.get(size, str(size)))
    try:
        width, height = (float(side) for side in match.groups()) if match else (0.0, 0.0)
    except ValueError:
        width = height = 0.0
    if 2.0 <= min(width, height) <= max(width, height) <= 100.0:
        return width, height
    raise ValueError(
        f"size = {size!r} is not a page: must be {', '.join(SLIDES)} or a width and a height in "
        "inches from 2 to 100, such as 13.33x7.5"
    )


def new_figure(width: float, height: float, **grid: Any) -> tuple[Figure, Any]:
    """Make a figure of this size in inches at a text size of 10 points; return it and its axes.

    It grows with the text, so that texts do not overlap at any text size, unless a `page_size`
    applies.
    """
    inches = _page.get() or (sized(width), sized(height))
    figure = Figure(figsize=inches, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(**grid)


def new_columns(count: int, rows: int, low: bool, below: float = 0.0) -> tuple[Figure, Any]:
    """Make a figure with a column of panels for each run; return it and its axes, by row and run.

    A column has `rows` panels and perhaps a low one; `below` [in] is for a long caption. Side by
    side stand all columns on a `page_size` that is wider than high, else at most three, so that
    texts are legible in the width of a page.
    """
    width, height = _page.get() or (0.0, 0.0)
    down = 1 if width > height else math.ceil(count / 3)
    across = math.ceil(count / down)
    heights = [1.0] * rows + [0.4] * low
    block = 1.8 * rows + low if down == 1 else 1.0 + rows + 0.7 * low
    figure, grid = new_figure(
        min(max(5.0, 3.1 * count), 8.4),
        1.8 + below + block * down,
        nrows=len(heights) * down,
        ncols=across,
        height_ratios=heights * down,
        sharex=True,
        squeeze=False,
    )
    blocks = grid.reshape(down, len(heights), across).swapaxes(0, 1)
    columns, unused = np.split(blocks.reshape(len(heights), -1), [count], axis=1)
    for axes in unused.flat:
        axes.remove()
    for (_, number), axes in np.ndenumerate(columns):
        axes.tick_params(labelleft=number % across == 0)
    for first, *others in columns:
        for axes in others:
            axes.sharey(first)
    for axes in columns[-1]:
        axes.tick_params(labelbottom=True)
    return figure, columns


def percent_axis(axis: Any) -> None:
    """Label an axis of fractions in per cent."""
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{100.0 * v:g}"))


def labelled(
    axes: Axes,
    x: str = "",
    y: str = "",
    title: str = "",
    *,
    log: str = "",
    steps: tuple[float, ...] = (1.0, 3.0),
    legend: Mapping[str, Any] | None = None,
    **settings: Any,
) -> None:
    """Finish a panel: its scales, limits, labels, title and legend.

    Parameters
    ----------
    axes : Axes
        The panel.
    x, y, title : str, optional
        Labels, each a name of `LABELS` or a text, and title. Default: those that are there.
        An axis labelled "[%]" is one of fractions: its ticks are in per cent.
    log : str, optional
        The axes that are logarithmic with plain numbers: "x", "y" or "xy".
    steps : tuple of float, optional
        Labels of each decade there.
    legend : mapping, optional
        Options of a legend. Default: no legend.
    **settings
        Others of `Axes.set`, such as ``xlim``.
    """
    axes.set(**{f"{which}scale": "log" for which in log}, **settings)
    for which, axis, name in (("x", axes.xaxis, x), ("y", axes.yaxis, y)):
        label = LABELS.get(name, name)
        if label:
            axis.set_label_text(label)
        if which in log:
            plain_log(axis, *steps)
        if label.endswith("[%]"):
            percent_axis(axis)
    if title:
        axes.set_title(title)
    if legend is not None:
        axes.legend(**legend)


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
    axes.plot(x, np.where(stable, y, np.nan), color=color or paint.blue, label=labels[0], **style)
    dashed: dict[str, Any] = {"color": color or paint.orange, "ls": DASHED, "label": labels[1]}
    axes.plot(x, np.where(meets, y, np.nan), **dashed, **style)


def dot(axes: Axes, x: float, y: float, *, stable: bool) -> None:
    """Mark a state: filled if it is stable, hollow if it is not."""
    face = paint.ink if stable else paint.paper
    axes.plot([x], [y], "o", color=paint.ink, mfc=face, ms=6.5, zorder=5)


def note(
    axes: Axes, text: str, point: tuple[Any, Any], offset: tuple[float, float], **style: Any
) -> None:
    """Write a text beside a point, at an offset in points."""
    axes.annotate(text, point, xytext=offset, textcoords="offset points", **style)


def mark(
    axes: Axes, x: float, y: float, text: str, offset: tuple[float, float], **style: Any
) -> None:
    """Mark a point and name it."""
    axes.plot([x], [y], "o", color=paint.ink, ms=6, zorder=5)
    note(axes, text, (x, y), offset, **style)


def arrow(axes: Axes, tail: tuple[Any, Any], tip: tuple[Any, Any], **look: Any) -> None:
    """Draw an arrow between two points."""
    axes.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": paint.ink} | look)


def name_lines(figure: Figure) -> None:
    """Write the name of each line that has one beside its right end, none over another."""
    named: list[tuple[Axes, list[tuple[float, Line2D, Text]]]] = []
    for axes in figure.axes:
        ends: list[tuple[float, Line2D]] = []
        for line in axes.lines:
            points = np.asarray(line.get_xydata(), np.float64)
            shown = points[np.isfinite(points[:, 1]) & (points[:, 0] <= axes.get_xlim()[1])]
            if not str(line.get_label()).startswith("_") and shown.size:
                _, height = (axes.transData - axes.transAxes).transform(shown[-1])
                ends.append((float(np.clip(height, 0.0, 1.0)), line))
        ends.sort(key=lambda one: -round(one[0], 2))
        look: dict[str, Any] = {"transform": axes.transAxes, "va": "center"}
        texts = [axes.text(NAMED, y, str(line.get_label()), **look) for y, line in ends]
        named.append((axes, [(*end, text) for end, text in zip(ends, texts, strict=True)]))
    figure.draw_without_rendering()
    for axes, rows in named:
        heights = [float(t.get_window_extent().height) / axes.bbox.height for *_, t in rows]
        free = math.inf
        for number, (y, line, text) in enumerate(rows):
            below, half = sum(heights[number + 1 :]), 0.5 * heights[number]
            place = min(max(y, below), free - half)
            free = place - half
            text.set(y=place, color=line.get_color())
            lead = Line2D([], [])
            lead.update_from(line)
            lead.set(transform=axes.transAxes, clip_on=False, label="")
            lead.set_data(np.array([1.0, NAMED - 0.005]), np.array([y, place]))
            figure.add_artist(lead)


def line_length(figure: Figure, per_inch: float) -> int:
    """Characters in a line across a figure; an inch holds so many in the usual size."""
    return int(per_inch * figure.get_figwidth() / sized(1.0))


def wrapped(text: str, width: int) -> str:
    """Break a text into lines of a width in characters, between words only."""
    return textwrap.fill(text, width, break_long_words=False, break_on_hyphens=False)


def typeset(figure: Figure, caption: str) -> str:
    """Wrap a caption to the figure's width and typeset its symbols; empty if captions are off."""
    if not _captions.get():
        return ""
    lines = wrapped(caption, line_length(figure, 14.5))
    return re.sub("|".join(SYMBOLS), lambda match: SYMBOLS[match.group()], lines)


def add_caption(figure: Figure, caption: str) -> None:
    """Set a caption under a figure."""
    if _captions.get():
        look: dict[str, Any] = {"ha": "left", "size": sized(9), "linespacing": 1.4}
        figure.supxlabel(typeset(figure, caption), x=0.01, **look)


def drawn_creepage(result: Result, minimum_speed: float = 0.0) -> FloatArray:
    """Creepage of a run; nan near standstill.

    That is below the minimum speed [m/s], and where the reference speed is not the vehicle's.
    """
    creepage, speed, slip = (result[name] for name in ("creepage", "speed", "slip_velocity"))
    true = np.isclose(np.abs(creepage * speed), np.abs(slip), rtol=1e-6, atol=1e-9)
    slowest = np.abs(speed[~true]).max(initial=0.0)
    shown = (np.abs(speed) > slowest) & (np.abs(speed) >= minimum_speed)
    return np.where(shown, creepage, np.nan)


def end_of_curve(element: ForceElement) -> float:
    """Creepage at which a creep curve's axis ends: five zeta0, or the last measured point [1]."""
    points = element.table.points
    return 5.0 * element.saturation_creepage if points is None else float(points.creepage.max())


def beyond_zone(element: ForceElement) -> str:
    """Whether the weakening zone is too long for the law of a short one; empty if it is not."""
    zone, limit = process_zone_ratio(element.contact, element.friction), process_zone_limit()
    if not element.table.is_limit or zone <= limit:
        return ""
    return f"process zone ratio {zone:.2g} > {limit:g}: beyond the law of a short zone"


def setting(wheelset: Wheelset, speed: float | None = None) -> str:
    """Parameters of a wheelset, for a caption: all that differ from their defaults."""
    parts = [*_contact_setting(wheelset.element), *_friction_setting(wheelset.element)]
    parts.append(f"$r$ {wheelset.radius:.3g} m")
    parts += [*_numbers_of(wheelset), *_numbers_of(wheelset.resistance)]
    if speed is not None:
        parts.append(f"$V$ {speed:.3g} m/s{' (held)' if wheelset.speed_held else ''}")
    elif wheelset.speed_held:
        parts.append("$V$ held")
    return _listed(parts)


def _numbers_of(part: Parameters) -> list[str]:
    """Declared numbers of a part that differ from their defaults."""
    kind: Any = type(part)
    texts = []
    for name, key in declared(kind).items():
        value = getattr(part, name)
        if key.quantity is not None and not key.many and value != key.default:
            plain = (name.replace("_", " "), 1.0, key.quantity.unit.replace(".", " "))
            symbol, factor, unit = SHOWN.get(name, plain)
            texts.append(f"{symbol} {factor * value:.4g} {unit}")
    return texts


def _contact_setting(element: ForceElement) -> list[str]:
    """Law, contact and layer of an element."""
    table, contact = element.table, element.contact
    law, *options = table.law.split()
    parts = []
    if table.points is not None:
        parts.append(f"Curve measured up to {100.0 * end_of_curve(element):.3g} %")
    elif law != "CarterGriffith":
        parts.append(" ".join([f"law {law}", *(options if table.one_axis else [])]))
    if not table.one_axis:
        parts.append(f"k_hat {element.k_hat:.3g}")
    parts.append(f"zeta0 {100.0 * element.saturation_creepage:.3g} %")
    parts += _shape_setting(contact)
    if text := beyond_zone(element):
        parts.append(text)
    if element.layer_compliance:
        parts.append(f"layer {1e12 * element.layer_compliance:.3g} um/MPa")
    if element.load_exponent is not None:
        parts.append(f"load exponent {element.load_exponent:.3g}")
    if element.memory:
        parts.append("memory")
    wheels = f"{element.wheels:g} wheels of " * (element.wheels > 1)
    parts.append(f"{wheels}$P$ {1e-3 * contact.wheel_load:.4g} kN")
    if element.minimum_speed != DEFAULTS["minimum_speed"].default:
        parts.append(f"minimum speed {element.minimum_speed:.3g} m/s")
    return parts


def _shape_setting(contact: Contact) -> list[str]:
    """Shape and modulus of a contact."""
    if not isinstance(contact, EllipticContact):
        sides = f"{1e3 * contact.semi_width:.3g} mm, length {1e3 * contact.length:.3g} mm"
        return [f"semi-width {sides}", f"$E^*$ {1e-9 * contact.contact_modulus:.4g} GPa"]
    axes = f"{1e3 * contact.semi_axis_x:.3g} x {1e3 * contact.semi_axis_y:.3g} mm"
    uncoupled = f" of {contact.theory}" * (contact.theory != "half_space")
    return [
        f"semi-axes {axes}{uncoupled}",
        f"$E^*$ {1e-9 * contact.contact_modulus:.4g} GPa",
        f"Poisson {contact.poisson_ratio:.3g}",
    ]


def _friction_setting(element: ForceElement) -> list[str]:
    """Friction of an element; a measured curve contains it."""
    friction, parts = element.friction, []
    if element.table.points is None:
        parts += [f"f_s {friction.static:.3g}", f"f_d {friction.kinetic:.3g}"]
        if friction.weakening != EXPONENTIAL and not element.table.one_axis:
            parts.append(f"weakening {friction.weakening.name}")
    if friction.slip_rate_decay > 0.0:
        parts += [
            f"slip-rate residual {friction.slip_rate_residual:.3g}",
            f"decay {friction.slip_rate_decay:.3g} s/m",
        ]
    if friction.softens_with_heat:
        parts += [
            f"softening temperature {friction.softening_temperature:.4g} K",
            f"effusivity {1e-3 * friction.thermal_effusivity:.4g} kW s$^{{0.5}}$/(m$^2$ K)",
        ]
    return parts


def drivetrain_setting(drivetrain: Drivetrain) -> str:
    """Parameters of a drivetrain, for a caption."""
    parts = _numbers_of(drivetrain.motor)
    if drivetrain.brake is not None:
        parts += _numbers_of(drivetrain.brake)
    if drivetrain.axle is not None:
        hertz = drivetrain.torsional_frequency / (2.0 * math.pi)
        damping = 100.0 * drivetrain.torsional_damping_ratio
        parts.append(f"axle {hertz:.3g} Hz, {damping:.2g} % of critical")
        if (share := drivetrain.axle.drive_share) != 0.5:
            parts.append(f"drive share {share:.3g}")
    more = _listed(parts) if parts else ""
    return f"{setting(drivetrain.wheelset)} {more[:1].upper()}{more[1:]}".rstrip()


def _listed(parts: list[str]) -> str:
    """Join parameters; no-break spaces keep a number and its unit on one line."""
    return ", ".join(part.replace(" ", "\u00a0") for part in parts) + "."
