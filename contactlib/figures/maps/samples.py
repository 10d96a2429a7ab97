"""Random samples: the distribution of an outcome, and the parameters on which it depends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.stats import norm, spearmanr

from contactlib.base.quantities import FloatArray
from contactlib.figures.maps.curves import look_of
from contactlib.figures.maps.layout import CONTROLLER, FAILED, RUN, controllers, frame
from contactlib.figures.maps.meaning import Words, finite, meaning, wide, words
from contactlib.figures.scenario import run_name
from contactlib.figures.style import new_figure, paint, plain_log, sized, styled, wrapped
from contactlib.runs.outcomes import Outcome

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

QUANTILES = (0.05, 0.5, 0.95)
CHANCE = 0.99  # probability that the rank correlation of an independent parameter is in the band
STEPS, POINTS, BARS = 400, 1000, 8  # largest numbers that are drawn
MANY = 300  # number of points above which an SVG holds them as a picture
HATCHES = ("", "///", "...", "xxx")


class Group(NamedTuple):
    """Outcome of one controller in all runs.

    Attributes
    ----------
    name : str
        Name of the controller; empty for an outcome that needs no controller.
    values : array, shape (n,)
        Values in the unit of the axis; nan where the sample has none.
    failed : int
        Number of failed runs.
    """

    name: str
    values: FloatArray
    failed: int


def sample_figure(dataset: Dataset, outcome: str, *, title: str, caption: str) -> Figure:
    """Distribution, rank correlations, and the outcome over the two strongest parameters."""
    shown = words(dataset[outcome])
    groups = _groups(dataset, outcome, shown)
    drawn = _drawn(dataset)
    strength = {str(p.name): [rank_correlation(p.values, g.values) for g in groups] for p in drawn}
    drawn.sort(key=lambda p: -np.nan_to_num(np.abs(strength[str(p.name)])).max())
    with styled():
        figure, grid = new_figure(9.6, 7.6, nrows=2, ncols=2)
        handles = _distribution(grid[0, 0], groups, shown, meaning(outcome))
        handles |= _influence(grid[0, 1], drawn[:BARS], strength, groups)
        for axes, parameter in zip(grid[1], drawn, strict=False):
            _scatter(axes, parameter, groups, shown)
        for axes in grid[1, len(drawn) :]:
            axes.remove()
        frame(figure, title, handles, caption)
    return figure


def rank_correlation(parameter: FloatArray, values: FloatArray) -> float:
    """Spearman's rank correlation of the runs that have a value; nan if all values are equal."""
    known = ~np.isnan(values)
    if np.unique(values[known]).size < 2 or np.unique(parameter[known]).size < 2:
        return math.nan
    return float(spearmanr(parameter[known], values[known]).statistic)


def _groups(dataset: Dataset, outcome: str, shown: Words) -> list[Group]:
    array = shown.factor * dataset[outcome]
    names = controllers(array)
    if not names:
        return [Group("", array.values, 0)]
    failed = (dataset[FAILED] > 0.0).sum(RUN) if FAILED in dataset else None
    found = []
    for name in names:
        lost = 0 if failed is None else int(failed.sel({CONTROLLER: name}))
        found.append(Group(run_name(name), array.sel({CONTROLLER: name}).values, lost))
    return found


def _drawn(dataset: Dataset) -> list[DataArray]:
    """Parameters that differ from run to run."""
    sampled = [c for name, c in dataset.coords.items() if c.dims == (RUN,) and name != RUN]
    return [c for c in sampled if np.issubdtype(c.dtype, np.number) and np.unique(c).size > 1]


def _distribution(axes: Axes, groups: list[Group], shown: Words, means: Outcome) -> dict[str, Any]:
    """Share of runs up to each value; infinite outcomes stay below 100 %."""
    handles: dict[str, Any] = {}
    for index, group in enumerate(groups):
        known = group.values[~np.isnan(group.values)]
        if not known.size:
            continue
        look = look_of(index) | {"marker": None}
        shares = np.linspace(0.0, 1.0, min(known.size, STEPS) + 1)
        at = np.quantile(known, shares, method="inverted_cdf")
        inside = np.isfinite(at)
        axes.plot(at[inside], 100.0 * shares[inside], drawstyle="steps-post", **look)
        marks = np.quantile(known, QUANTILES, method="inverted_cdf")
        inside = np.isfinite(marks)
        marker = look_of(index) | {"ls": "none"}
        axes.plot(marks[inside], 100.0 * np.array(QUANTILES)[inside], **marker)
        low, middle, high = (f"{v:.3g}" if np.isfinite(v) else "\N{INFINITY}" for v in marks)
        text = f"{middle} ({low} to {high}){'' if shown.unit == '1' else f' {shown.unit}'}"
        text = f"{group.name}: {text}" if group.name else text
        endless = float(np.isinf(known).mean())
        text += f"; {100.0 * endless:.3g} %: {means.infinite}" if endless else ""
        text += f"; {group.failed} failed" if group.failed else ""
        handles[text] = Line2D([], [], **{**look, "marker": marker["marker"]}, label=text)
    axes.set(xlabel=shown.label, ylabel="runs up to this value  [%]", ylim=(0.0, 100.0))
    axes.set_title(f"Distribution over {groups[0].values.size} runs")
    _log(axes, "x", np.concatenate([g.values for g in groups]))
    return handles


def _influence(
    axes: Axes, drawn: list[DataArray], strength: dict[str, list[float]], groups: list[Group]
) -> dict[str, Any]:
    """Rank correlations as bars, the strongest on top, and the band that chance would give."""
    count = min(int(np.count_nonzero(~np.isnan(group.values))) for group in groups)
    # For independent quantities the variance is 1/(n - 1).
    chance = min(1.0, float(norm.ppf(0.5 + 0.5 * CHANCE)) / math.sqrt(max(1, count - 1)))
    axes.axvspan(-chance, chance, color=paint.shade, lw=0.0, zorder=0)
    height = 0.8 / len(groups)
    for index, _ in enumerate(groups):
        at = np.arange(len(drawn)) + (index - 0.5 * (len(groups) - 1)) * height
        bars = np.nan_to_num([strength[str(parameter.name)][index] for parameter in drawn])
        look = {"color": look_of(index)["color"], "ec": paint.paper, "lw": 0.0}
        axes.barh(at, bars, height=height, hatch=HATCHES[index % len(HATCHES)], **look)
    names = [
        wrapped(words(parameter).name, 24, max_lines=2, placeholder=" ...") for parameter in drawn
    ]
    axes.set_yticks(np.arange(len(drawn)), names, fontsize=sized(8))
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_axisbelow(True)
    axes.axvline(0.0, color=paint.grey, lw=1.0)
    ticks = [-1.0, -0.5, 0.0, 0.5, 1.0]
    axes.set(xlim=(-1.0, 1.0), xticks=ticks, xlabel="rank correlation  [1]")
    axes.set_title("Which parameters matter most")
    text = f"{100.0 * CHANCE:.0f} % band of chance alone"
    return {text: Patch(color=paint.shade, label=text)}


def _scatter(axes: Axes, parameter: DataArray, groups: list[Group], shown: Words) -> None:
    of_axis = words(parameter)
    x = of_axis.factor * parameter.values
    every = max(1, math.ceil(x.size / POINTS))
    for index, group in enumerate(groups):
        look = look_of(index)
        point: dict[str, Any] = {"ls": "none", "marker": look["marker"], "color": look["color"]}
        point["rasterized"] = x.size > MANY
        y = np.where(np.isfinite(group.values), group.values, np.nan)
        axes.plot(x[::every], y[::every], ms=2.5, alpha=0.6, mew=0.0, **point)
    axes.set(xlabel=of_axis.label, ylabel=shown.lines(30))
    _log(axes, "x", x)
    _log(axes, "y", np.concatenate([g.values for g in groups]))


def _log(axes: Axes, which: str, values: FloatArray) -> None:
    if wide(finite(values)):
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
        plain_log(axes.xaxis if which == "x" else axes.yaxis, 1.0, 3.0)
