"""Figures of a sweep: one for each outcome, drawn by xarray.

An outcome over one parameter is drawn as lines, over two as a map, over three as maps side by
side; random samples are drawn as a distribution, with the parameters on which it depends.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from cycler import Cycler, cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray
from scipy.stats import spearmanr

from contactlib.base.quantities import FloatArray
from contactlib.figures.files import PICTURES, save_pictures
from contactlib.figures.scenario import run_name
from contactlib.figures.style import (
    DASHED,
    DOTTED,
    labelled,
    line_length,
    new_figure,
    paint,
    sized,
    styled,
    typeset,
    wrapped,
)
from contactlib.runs.analysis import MARGIN, SWEEP_OUTCOMES
from contactlib.runs.outcomes import MISJUDGED, Outcome

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

__all__ = ["draw_maps", "map_figure"]

Handles = dict[str, Artist]  # of the legend, by their text

CONTROLLER, RUN, DRAW, FAILED = "controller", "run", "draw", "failed"
OFF = SWEEP_OUTCOMES[MISJUDGED].yes_or_no[0]  # type: ignore[index]
FEW = 4  # a parameter with fewer values gives lines or panels, not an axis of a map
PANELS = 3  # maximum number of values of a parameter that has a panel for each
WIDE = 30.0  # largest / smallest value above which a scale is logarithmic
CELLS, MANY = 4000, 300  # numbers of cells and points above which an SVG holds them as a picture
STEPS, POINTS, BARS = 400, 1000, 5  # largest numbers that are drawn of many runs and parameters
QUANTILES = (0.05, 0.5, 0.95)
CHANCE = 2.58  # standard deviations on both sides that contain 99 % of a normal distribution
COLOURS = "viridis"  # perceptually uniform, and from dark to light in grey
YES_OR_NO = ("#004B70", "white")  # colours of no and yes
HATCHES = ("", "///", "...", "xxx")
MARKED = (
    "Marks and key: the median (5th to 95th percentile). "
    "A rank correlation shows rising or falling dependence only, not a rise and fall."
)
MAPS = {"axes.grid": False, "hatch.linewidth": 0.5}
# Units that take a prefix, largest first.
LARGE, SMALL = ((1e9, "G"), (1e6, "M"), (1e3, "k")), ((1.0, ""), (1e-3, "m"))
PREFIXES = {"N": LARGE, "N.m": LARGE, "J": LARGE, "W": LARGE, "s": SMALL, "m": SMALL}
LINES = {"lines.markersize": 4.5}


def draw_maps(
    dataset: Dataset, folder: str | os.PathLike[str], formats: Sequence[str] = PICTURES
) -> list[Path]:
    """Draw each outcome of a sweep.

    Parameters
    ----------
    dataset : xarray.Dataset
        As for `map_figure`.
    folder : path
        Folder for the files, created if missing. A file has the name of its outcome.
    formats : sequence of str, optional
        Suffixes of the files, each a format that matplotlib writes. Default: PNG and SVG.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ValueError
        If an outcome's name is not an identifier, or matplotlib does not write a format.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for outcome, values in dataset.data_vars.items():
        if outcome != FAILED and values.dims:
            if not str(outcome).isidentifier():  # it may come from any file
                raise ValueError(f"outcome {outcome!r} must be an identifier: it names a file")
            figure = map_figure(dataset, str(outcome))
            written += save_pictures(figure, folder, str(outcome), formats)
    return written


def map_figure(dataset: Dataset, outcome: str) -> Figure:
    """Draw one outcome of a sweep.

    Parameters
    ----------
    dataset : xarray.Dataset
        Outcomes over the axes of a grid, or over ``run`` with the sampled parameters as
        coordinates; outcomes of runs also have the dimension ``controller``. Of the draws at the
        points of a grid, along ``draw``, the median is drawn. Outcomes and coordinates have
        ``units`` and ``long_name``. A variable ``failed`` is not zero where a run failed. The
        attributes ``title`` and ``source`` go into title and caption.
    outcome : str
        Name of a variable of the dataset.

    Returns
    -------
    Figure
        Infinite outcomes, outcomes without a value, failed runs and those whose controllers get
        a speed that is off by more than 5 % have marks of their own. Of
        more than three parameters the others have their middle value, which the caption names.

    Raises
    ------
    ValueError
        If there is no such outcome, or it is a single number.
    """
    if outcome not in dataset.data_vars or not dataset[outcome].dims:
        known = [str(name) for name, values in dataset.data_vars.items() if values.dims]
        raise ValueError(f"outcome = {outcome!r} must be one of: {', '.join(known)}")
    dataset = _without_draws(dataset)
    data, sweep = _readable(dataset, outcome), _plain(dataset.attrs.get("title", ""))
    name = str(data[outcome].attrs["long_name"])
    title = f"{name[:1].upper()}{name[1:]}{': ' if sweep else ''}{sweep}"
    about = dataset[outcome].attrs.get("long_name", ""), dataset.attrs.get("source", "")
    draw = _sample_figure if RUN in dataset[outcome].dims else _grid_figure
    figure, handles, note = draw(data, outcome, SWEEP_OUTCOMES.get(outcome, Outcome("1", "")))
    _frame(figure, title, handles, _sentences(*map(_plain, about), note))
    return figure


def _without_draws(dataset: Dataset) -> Dataset:
    """Medians of the draws at the points of a grid; of a single point the draws as a sample."""
    if DRAW not in dataset.dims:
        return dataset
    plain = dataset.drop_vars(RUN)
    points = {
        str(name): size for name, size in plain.sizes.items() if name not in (CONTROLLER, DRAW)
    }
    if max(points.values(), default=1) == 1:
        return plain.isel(dict.fromkeys(points, 0), drop=True).rename_dims({DRAW: RUN})
    medians = plain.median(DRAW, keep_attrs=True)
    for name, values in medians.data_vars.items():
        if DRAW in plain[name].dims:
            values.attrs["long_name"] = f"median of the {values.attrs.get('long_name', name)}"
    return medians.assign({FAILED: plain[FAILED].max(DRAW)})


def _looks() -> Cycler[str, Any]:
    """Looks of lines: their dashes and marks differ as well as their colours."""
    lines = cycler(
        color=[paint.blue, paint.orange, paint.green, paint.ink],
        linestyle=["-", DASHED, (0, (6, 1.5, 1, 1.5)), DOTTED],
        marker=["o", "s", "^", "D"],
    )
    return cycler(linewidth=[2.0, 1.0]) * lines


def _plain(text: object) -> str:
    """Text from a file, with dollar signs kept from starting a formula."""
    return str(text).replace("$", r"\$")


def _sentences(*texts: str) -> str:
    """Join the texts that are not empty into a caption; each ends with one full stop."""
    given = (" ".join(text.split()).rstrip(" .") for text in texts)
    return " ".join(f"{text[:1].upper()}{text[1:]}." for text in given if text)


def _readable(dataset: Dataset, outcome: str) -> Dataset:
    """The outcome and what belongs to it, in units in which numbers are short, with labels."""
    dims = set(dataset[outcome].dims)
    beside = [name for name in (MARGIN, FAILED, MISJUDGED) if name in dataset]
    data = dataset[[outcome, *(name for name in beside if set(dataset[name].dims) <= dims)]]
    data = data.assign(
        {FAILED: data[FAILED] > 0 if FAILED in data else data[outcome].isnull() & False}
    )
    if CONTROLLER in data.coords:
        names = [run_name(str(name)) for name in data[CONTROLLER].values]
        data = data.assign_coords({CONTROLLER: names})
    for name in (outcome, *data.coords):
        if np.issubdtype(data[name].dtype, np.number):
            data = data.assign({name: _scaled(data[name])})
    return data


def _scaled(array: DataArray) -> tuple[tuple[Any, ...], FloatArray, dict[str, str]]:
    """Dimensions, values and label of a quantity; an outcome's ``long_name`` is a sentence."""
    unit, values = str(array.attrs.get("units", "1")), np.abs(_finite(array))
    typical = np.exp(np.log(values).mean()) if _wide(values) else values.max(initial=0.0)
    fitting = [pair for pair in PREFIXES.get(unit, ()) if pair[0] <= typical]
    size, prefix = fitting[0] if fitting else (1.0, "")
    if array.attrs.get("display_units") == "%":
        size, unit = 0.01, "%"
    described = array.attrs.get("long_name") if array.name in array.coords else None
    unit = re.sub(r"([a-z])(\d)", r"\1$^\2$", unit.replace(".", " "))
    name = _plain(described or str(array.name).replace("_", " "))
    return array.dims, array.values / size, {"long_name": name, "units": prefix + unit}


def _label(array: DataArray, width: int = 30) -> str:
    """Name and unit of an axis, wrapped to a width in characters."""
    return wrapped("{long_name} [{units}]".format(**array.attrs), width)


def _at(coordinate: DataArray) -> str:
    """A single value of a coordinate, as the title of a panel or a line."""
    if coordinate.name == CONTROLLER:
        return str(coordinate.values)
    unit = coordinate.attrs["units"]
    number = f"{coordinate.attrs['long_name']} {float(coordinate):.4g}"
    return number if unit == "1" else f"{number}\u00a0{unit}"


def _finite(values: ArrayLike) -> FloatArray:
    """The finite values, as a flat array."""
    v = np.asarray(values, dtype=np.float64).ravel()
    return v[np.isfinite(v)]


def _wide(values: FloatArray) -> bool:
    """Whether finite values are positive and differ by more than a factor of `WIDE`."""
    return bool(values.size and values.min() > 0.0 and values.max() > WIDE * values.min())


def _geometric(values: FloatArray) -> bool:
    """Whether the sorted values of an axis are spaced by a ratio rather than a difference."""
    if values.size < FEW or values[0] <= 0.0 or values[-1] < 3.0 * values[0]:
        return False
    ratios, steps = np.diff(np.log(values)), np.diff(values)
    return bool(np.ptp(ratios) / ratios.mean() < np.ptp(steps) / steps.mean())


# ---- a grid: lines and maps --------------------------------------------------------------------


def _grid_figure(data: Dataset, outcome: str, means: Outcome) -> tuple[Figure, Handles, str]:
    """Lines over one parameter or maps over two; with handles of the legend, and a note.

    Long axes come first, in the order of the file, and those without effect not at all. A third
    parameter, and the controllers of a map, have a panel for each value.
    """
    every = [str(name) for name in data[outcome].dims if name != CONTROLLER]
    data = data.sortby(every)
    names = [name for name in every if _has_effect(data, name)] or every[:1]
    names.sort(key=lambda name: (_is_seed(data[name]), data.sizes[name] < FEW))
    fixed = [name for name in every if name not in names[:3]]
    data = data.isel({name: data.sizes[name] // 2 for name in fixed})
    for name in names[2:3]:
        some = np.linspace(0, data.sizes[name] - 1, min(data.sizes[name], PANELS))
        data = data.isel({name: some.round().astype(int)})
    controllers = [CONTROLLER] if CONTROLLER in data[outcome].dims else []
    is_map = len(names) > 1 and data.sizes[names[1]] >= FEW and not _is_seed(data[names[1]])
    apart = names[2:3] + (controllers if names[1:] else [])
    sizes = [data.sizes[name] for name in apart]
    parts = [data.isel(dict(zip(apart, at, strict=True))) for at in np.ndindex(*sizes)]
    columns = sizes[-1] if len(sizes) == 2 else 2 if len(parts) == 4 else min(len(parts), 3)
    rows = math.ceil(len(parts) / columns)
    size = max(6.4, 2.8 * columns + 1.2), 2.8 * rows + 1.5
    common: dict[str, Any] = {"squeeze": False, "sharex": True, "sharey": True}
    with styled(MAPS if is_map else LINES):
        figure, grid = new_figure(*size, nrows=rows, ncols=columns, **common)
        handles: Handles = {}
        norm = BoundaryNorm(_levels(data[outcome].values, means), 256)
        lines = [*names[1:2], *controllers, None][0]
        for number, axes in enumerate(grid.flat):
            if number >= len(parts):
                axes.remove()
                continue
            part = parts[number]
            if is_map:
                handles |= _map(axes, part, outcome, names[:2], means, norm)
            else:
                handles |= _lines(axes, part, outcome, names[0], lines, means)
            titles = (_at(part[name]) for name in reversed(apart))
            axes.set_title(", ".join(titles), fontsize=sized(10))
            lowest = number + columns >= len(parts)
            axes.tick_params(labelbottom=lowest)
            axes.xaxis.label.set_visible(lowest)
            axes.yaxis.label.set_visible(number % columns == 0)
        if is_map and not means.yes_or_no:
            drawn, colours = list(grid.flat[: len(parts)]), ScalarMappable(norm, COLOURS)
            look: dict[str, Any] = {"pad": 0.015, "aspect": 28, "format": "%g"}
            figure.colorbar(colours, ax=drawn, label=_label(data[outcome]), **look)
    shown = ", ".join(_at(data[name]) for name in names[3:])
    idle = [name for name in fixed if name not in names and data[name].attrs]
    without = ", ".join(data[name].attrs["long_name"] for name in idle)
    notes = [shown and f"Shown at {shown}.", without and f"Does not depend on {without}."]
    return figure, handles, " ".join(filter(None, notes))


def _misjudged(part: Dataset, outcome: str) -> NDArray[np.bool_]:
    """Where the controllers get a speed that is so far off that an outcome is in doubt."""
    known = MISJUDGED in part and outcome != MISJUDGED
    return np.asarray(part[MISJUDGED].values == 1.0) if known else np.array(False)


def _is_seed(coordinate: DataArray) -> bool:
    """Whether values are seeds: they have no order, and nothing lies between them."""
    known = f"{coordinate.name} {coordinate.attrs.get('long_name', '')}"
    return "seed" in known.replace("_", " ").split()


def _has_effect(data: Dataset, name: str) -> bool:
    """Whether anything varies along an axis."""
    first = data.isel({name: 0}, drop=True)
    return any(not first.equals(data.isel({name: i}, drop=True)) for i in range(data.sizes[name]))


def _lines(
    axes: Axes, part: Dataset, outcome: str, x: str, name: str | None, means: Outcome
) -> Handles:
    """Draw a line for each value of another dimension; return handles of the legend."""
    values = part[outcome]
    number = values.where(np.isfinite(values))
    axes.set_prop_cycle(_looks())
    number.plot.line(ax=axes, x=x, hue=name, add_legend=False)
    cases = [part] if name is None else [part.isel({name: i}) for i in range(part.sizes[name])]
    handles: Handles = {}
    seeds = name is not None and _is_seed(part[name])
    for line, case in zip(list(axes.lines), cases, strict=True):
        if seeds or _is_seed(part[x]):
            line.set(linestyle="none", marker="o")
        if seeds:  # draws of one distribution look the same
            line.set(color=paint.blue, markersize=4.5, alpha=0.6, label="one seed each")
            handles["one seed each"] = line
        elif name is not None:
            line.set_label(_at(case[name]))
            handles[_at(case[name])] = line
        if means.yes_or_no:
            line.set_drawstyle("steps-mid")
        for text, where, marker, edge in (
            (means.infinite, np.isinf(case[outcome].values), 6, 1.0),
            (means.missing, case[outcome].isnull().values & ~case[FAILED].values, 7, 0.0),
            ("failed", case[FAILED].values, "x", 0.0),
        ):
            if where.any():  # marks at the edge of the axes
                look: dict[str, Any] = {"ls": "none", "marker": marker, "ms": 7}
                handles[text] = Line2D([], [], color=paint.ink, label=text, **look)
                look |= {"transform": axes.get_xaxis_transform(), "clip_on": False}
                at = case[x].values[where]
                axes.plot(at, np.full(at.size, edge), color=line.get_color(), **look)
        if (off := _misjudged(case, outcome)).any():
            rings: dict[str, Any] = {"ls": "none", "marker": "o", "ms": 9, "mfc": "none"}
            axes.plot(case[x].values[off], case[outcome].values[off], color=paint.ink, **rings)
            handles[OFF] = Line2D([], [], color=paint.ink, label=OFF, **rings)
    if _is_seed(part[x]):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if means.yes_or_no:
        axes.set_yticks([1.0, 0.0], means.yes_or_no)
    elif _wide(_finite(values)):
        labelled(axes, log="y")
    if _geometric(part[x].values):
        labelled(axes, log="x")
    return handles


def _levels(values: FloatArray, means: Outcome) -> FloatArray:
    """Borders of the colours, at round values, of decades for values that span them."""
    values = _finite(values)
    if means.yes_or_no:
        return np.array([-0.5, 0.5, 1.5])
    if means.zero:  # which has a mark of its own
        values = values[values != 0.0]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    if not _wide(values):
        return np.asarray(MaxNLocator(14, steps=(1, 2, 5, 10)).tick_values(low, high))
    decades = 10.0 ** np.arange(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1.0)
    steps = (1.0, 2.0, 5.0) if decades.size < 6 else (1.0,)
    levels = np.outer(decades, steps).ravel()
    return levels[np.searchsorted(levels, low, "right") - 1 : np.searchsorted(levels, high) + 1]


def _map(
    axes: Axes, part: Dataset, outcome: str, names: list[str], means: Outcome, norm: BoundaryNorm
) -> Handles:
    """Draw cells in colours, and mark those that have no number; return handles of the legend."""
    x, y = names
    values = part[outcome].transpose(y, x)
    scales = {w: "log" for w, name in (("x", x), ("y", y)) if _geometric(part[name].values)}
    colours = ListedColormap(YES_OR_NO) if means.yes_or_no else COLOURS
    look: dict[str, Any] = {f"{which}scale": scale for which, scale in scales.items()}
    mesh = values.plot.pcolormesh(
        ax=axes, x=x, y=y, cmap=colours, norm=norm, add_colorbar=False, **look
    )
    mesh.set_rasterized(values.size > CELLS)
    labelled(axes, log="".join(scales), steps=(1.0, 2.0, 5.0))
    handles: Handles = {}
    if means.yes_or_no:
        for face, text in zip(YES_OR_NO, reversed(means.yes_or_no), strict=True):
            handles[text] = Patch(fc=face, ec="black", lw=0.6, label=text)
    number, failed = values.values, part[FAILED].transpose(y, x).values
    for text, where, face, hatch in (
        (means.infinite, np.isinf(number), "white", "///"),
        (means.zero, (number == 0.0) & bool(means.zero), "#E4E4E4", "..."),
        (means.missing, np.isnan(number) & ~failed, "#C8C8C8", ""),
        ("failed", failed, "#8A8A8A", "xxx"),
    ):
        if where.any():
            edges = np.moveaxis(mesh.get_coordinates(), -1, 0)
            marked = np.ma.masked_where(~where, where)
            axes.pcolor(*edges, marked, cmap=ListedColormap([face]), hatch=hatch, ec="black", lw=0)
            handles[text] = Patch(fc=face, ec="black", lw=0.6, hatch=hatch, label=text)
    if (off := _misjudged(part.transpose(y, x, ...), outcome)).any():
        at: tuple[Any, ...] = np.broadcast_arrays(part[x].values, part[y].values[:, np.newaxis])
        crosses: dict[str, Any] = {"ls": "none", "marker": "X", "mfc": "white", "mec": "black"}
        axes.plot(at[0][off], at[1][off], ms=5, mew=0.7, **crosses)
        handles[OFF] = Line2D([], [], label=OFF, **crosses)
    borders: list[tuple[DataArray, str, Any]] = [(values, means.border, DASHED)]
    if MARGIN in part:
        borders.append((part[MARGIN].transpose(y, x), SWEEP_OUTCOMES[MARGIN].border, "-"))
    for array, text, dashes in borders:
        known = array.where(np.isfinite(array))
        if known.min() < 0.0 < known.max():
            line: dict[str, Any] = {"colors": paint.ink, "linewidths": 2.2, "linestyles": [dashes]}
            axes.contour(part[x], part[y], known, levels=[0.0], **line)
            handles[text] = Line2D([], [], color=paint.ink, lw=2.2, ls=dashes, label=text)
    return handles


# ---- random samples ----------------------------------------------------------------------------


def _sample_figure(data: Dataset, outcome: str, means: Outcome) -> tuple[Figure, Handles, str]:
    """Distribution, rank correlations, and the outcome over the two strongest parameters."""
    sampled = [c for c in data.coords.values() if c.dims == (RUN,) and c.name != RUN]
    varied = [c for c in sampled if c.dtype.kind in "fiu" and np.ptp(c.values) > 0.0]
    groups = [data]
    if CONTROLLER in data[outcome].dims:
        groups = [data.isel({CONTROLLER: i}) for i in range(data.sizes[CONTROLLER])]
    strength = np.array([[rank_correlation(c, group[outcome]) for c in varied] for group in groups])
    order = np.argsort(-np.abs(np.nan_to_num(strength)).max(axis=0), kind="stable")
    varied, strength = [varied[i] for i in order], strength[:, order[:BARS]]
    with styled(LINES):
        figure, ((left, right), below) = new_figure(
            9.6, 7.6, nrows=2, ncols=2, height_ratios=(1.3, 1.0)
        )
        looks = list(_looks())
        handles: Handles = {}
        for number, group in enumerate(groups):
            look = looks[number % len(looks)]
            values = group[outcome].values
            known, points = values[~np.isnan(values)], look | {"linestyle": "none"}
            if known.size:
                quantiles = np.quantile(known, QUANTILES, method="inverted_cdf")
                shares = np.linspace(0.0, 1.0, min(known.size, STEPS) + 1)
                values_at = np.quantile(known, shares, method="inverted_cdf")
                left.plot(values_at, shares, drawstyle="steps-post", **look | {"marker": ""})
                left.plot(quantiles, QUANTILES, **points)
                text = _summary(group, outcome, means, quantiles)
                handles[text] = Line2D([], [], label=text, **look)
            at = np.arange(strength.shape[1]) + (number + 0.5) * 0.8 / len(groups) - 0.4
            bars: dict[str, Any] = {"height": 0.8 / len(groups), "hatch": HATCHES[number % 4]}
            right.barh(at, strength[number], color=look["color"], ec=paint.paper, lw=0.0, **bars)
            some = slice(None, None, math.ceil(values.size / POINTS))
            finite = np.where(np.isfinite(values), values, np.nan)[some]
            fine = {"ms": 2.5, "alpha": 0.6, "mew": 0.0, "rasterized": finite.size > MANY}
            for axes, parameter in zip(below, varied, strict=False):
                axes.plot(parameter.values[some], finite, **points, **fine)
        left.set(xlabel=_label(data[outcome]), ylim=(0.0, 1.0))
        labelled(left, "", "share of runs [%]", f"Distribution over {data.sizes[RUN]} runs")
        count = int(data[outcome].count(RUN).min())
        chance = "99 % band of chance alone"
        band = CHANCE / math.sqrt(max(CHANCE**2, count - 1))  # the variance is 1/(n - 1)
        handles[chance] = right.axvspan(-band, band, color=paint.shade, lw=0.0, zorder=0)
        handles[chance].set_label(chance)
        right.set_axisbelow(True)
        right.axvline(0.0, color=paint.grey, lw=1.0)
        names = [wrapped(parameter.attrs["long_name"], 28) for parameter in varied[:BARS]]
        right.set_yticks(np.arange(len(names)), names, fontsize=sized(7.5))
        right.invert_yaxis()
        right.grid(visible=False, axis="y")
        labelled(right, "rank correlation [1]", "", "Which parameters matter most")
        right.set(xlim=(-1.0, 1.0), xticks=np.linspace(-1.0, 1.0, 5))
        for axes, parameter in zip(below, varied, strict=False):
            axes.set(xlabel=_label(parameter, 40), ylabel=_label(data[outcome], 18))
            labelled(axes, log="x" if _wide(_finite(parameter)) else "")
        if _wide(_finite(data[outcome])):
            labelled(left, log="x")
            for axes in below:
                labelled(axes, log="y")
        for axes in below[len(varied) :]:
            axes.remove()
    return figure, handles, MARKED


def rank_correlation(parameter: DataArray, outcome: DataArray) -> float:
    """Spearman's rank correlation of the runs that have a value; nan if all values are equal."""
    known = ~np.isnan(outcome.values)
    x, y = parameter.values[known], outcome.values[known]
    varies = x.size and x.min() < x.max() and y.min() < y.max()
    return float(spearmanr(x, y).statistic) if varies else math.nan


def _summary(group: Dataset, outcome: str, means: Outcome, quantiles: FloatArray) -> str:
    """Median and percentiles, with the controller and what has no number."""
    low, middle, high = (f"{v:.3g}" if np.isfinite(v) else "\N{INFINITY}" for v in quantiles)
    name = f"{group[CONTROLLER].values}: " if CONTROLLER in group.coords else ""
    unit = group[outcome].attrs["units"]
    text = f"{name}{middle} ({low} to {high}){'' if unit == '1' else f' {unit}'}"
    infinite = float(np.isinf(group[outcome]).sum() / group[outcome].count())
    text += f"; {100.0 * infinite:.3g} %: {means.infinite}" if infinite else ""
    off, failed = int(_misjudged(group, outcome).sum()), int(group[FAILED].sum())
    text += f"; {off}: {OFF}" if off else ""
    return text + (f"; {failed} failed" if failed else "")


# ---- title, caption and legend -----------------------------------------------------------------


def _frame(figure: Figure, title: str, handles: Handles, caption: str) -> None:
    """Set the title above, and below it the caption and a legend in as many columns as fit."""
    with styled():
        width = line_length(figure, 12.5)
        figure.suptitle(wrapped(title, width), x=0.01, ha="left", fontsize=sized(12))
        longest = max(map(len, handles), default=0)
        figure.legend(
            handles=list(handles.values()),
            loc="outside lower left",
            ncols=max(1, min(width // (longest + 5), len(handles))),
            title=typeset(figure, caption),
            title_fontsize=sized(9),
            alignment="left",
            handlelength=1.6,
            columnspacing=1.4,
        )
