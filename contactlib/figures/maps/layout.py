"""Layout of a sweep's figures: assignment of parameters to axes, panels, labels and legend."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.figures.maps.meaning import geometric, words
from contactlib.figures.scenario import run_name
from contactlib.figures.style import (
    line_length,
    new_figure,
    page_size,
    plain_log,
    sized,
    typeset,
    wrapped,
)
from contactlib.runs.analysis import MARGIN

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

CONTROLLER, RUN, FAILED = "controller", "run", "failed"
FEW = 4  # a parameter with fewer values becomes lines or panels, not an axis of a map
PANELS, WIDEST = 9, 3  # largest number of panels, and of panels side by side
FEW_TICKS = 6  # number of values up to which an axis labels each
ROUND = (1, 2, 5, 10)  # steps between tick labels
CAPTION_LINES, LINE = (
    3,
    0.17,
)  # lines of a caption that need no more height, and that of a line [in]
CHARACTERS = 12.5  # characters of a title or legend in an inch


class Case(NamedTuple):
    """Outcome of one controller at one value of the further axis: a line, or a map.

    Attributes
    ----------
    controller : str or None
        None for an outcome that needs no controller.
    further : str
        Name and value of the further axis; empty without one.
    values : array
        Values over the axes of the layout in reverse order, in SI units.
    failed : array of bool
        Where the run failed.
    margin : array or None
        Torque margin, if the sweep has it [1].
    """

    controller: str | None
    further: str
    values: FloatArray
    failed: NDArray[np.bool_]
    margin: FloatArray | None


class Layout(NamedTuple):
    """How an outcome is drawn.

    Attributes
    ----------
    outcome : DataArray
        The part that is drawn, sorted along its axes.
    axes : tuple of DataArray
        One axis for lines, two (across, up) for a map.
    further : DataArray or None
        The axis that has a line or a map for each of its values.
    note : str
        The other parameters of the sweep, with the values shown; may be empty.
    cases : tuple of Case
        Lines or maps; the controllers of one value of the further axis are adjacent.
    """

    outcome: DataArray
    axes: tuple[DataArray, ...]
    further: DataArray | None
    note: str
    cases: tuple[Case, ...]


def layout(dataset: Dataset, outcome: str) -> Layout:
    """Choose axes and panels for an outcome on a grid: long axes first, in the file's order.

    An axis on which the outcome does not depend is omitted.
    """
    needed = set(dataset[outcome].dims)
    there = [name for name in (FAILED, MARGIN) if name in dataset and name != outcome]
    beside = [name for name in there if set(dataset[name].dims) <= needed]
    data = dataset[[outcome, *beside]]
    names = [str(name) for name in dataset[outcome].dims if name != CONTROLLER]
    data = data.sortby(names)
    matters = [name for name in names if _matters(data, name)] or names[:1]
    long = [name for name in matters if data.sizes[name] >= FEW]
    axes = tuple(long[:2] or matters[:1])
    rest = sorted((n for n in matters if n not in axes), key=long.__contains__)
    held = []
    for name in (n for n in names if n not in (*axes, *rest[:1])):
        data = data.isel({name: data.sizes[name] // 2})
        if name in matters:
            held.append(_at(data[name]))
    idle = [words(data[n]).name for n in names if n not in matters and dataset.sizes[n] > 1]
    if rest:
        limit = PANELS if len(axes) == 2 and CONTROLLER not in needed else FEW - 1
        data = data.isel({rest[0]: _spread(data.sizes[rest[0]], limit)})
    parts = (("Shown at", held), ("Does not depend on", idle))
    return Layout(
        data[outcome],
        tuple(data[name] for name in axes),
        data[rest[0]] if rest else None,
        " ".join(f"{text} {', '.join(words)}." for text, words in parts if words),
        tuple(_cases(data, outcome, axes, rest[:1])),
    )


def _matters(data: Dataset, name: str) -> bool:
    """Whether anything varies along an axis."""
    first = data.isel({name: 0}, drop=True)
    return any(not first.equals(data.isel({name: i}, drop=True)) for i in range(data.sizes[name]))


def controllers(outcome: DataArray) -> list[str]:
    """Names of the controllers; empty for an outcome that needs no controller."""
    return [str(name) for name in outcome[CONTROLLER].values] if CONTROLLER in outcome.dims else []


def _cases(
    data: Dataset, outcome: str, axes: tuple[str, ...], further: list[str]
) -> Iterator[Case]:
    data, names = data.transpose(*further, ..., *reversed(axes)), controllers(data[outcome])
    panels = {name: data.sizes[name] for name in further} | (
        {CONTROLLER: len(names)} if names else {}
    )
    for place in np.ndindex(*panels.values()):
        one = data.isel(dict(zip(panels, place, strict=True)))
        values, name = one[outcome].values, names[place[-1]] if names else None
        failed = one[FAILED].values > 0.0 if FAILED in one else np.zeros(values.shape, bool)
        margin = one[MARGIN].values if MARGIN in one else None
        yield Case(name, _at(one[further[0]]) if further else "", values, failed, margin)


def title_of(case: Case) -> str:
    """Title of a panel."""
    return ", ".join(filter(None, (case.controller and run_name(case.controller), case.further)))


def _at(coordinate: DataArray) -> str:
    """Name and value of a coordinate that has a single value."""
    of_axis = words(coordinate)
    return f"{of_axis.name} {of_axis.number(float(coordinate))}"


def _spread(count: int, limit: int) -> list[int]:
    """At most `limit` evenly spaced indices, from the first to the last."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, limit)).tolist()})


def panels(count: int, columns: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """A figure of `count` panels in rows of `columns`; width and height in inches per panel."""
    rows = math.ceil(count / columns)
    common: dict[str, Any] = {"squeeze": False, "sharex": True, "sharey": True}
    size = max(6.4, width * columns + 1.2), height * rows + 1.5
    figure, grid = new_figure(*size, nrows=rows, ncols=columns, **common)
    for axes in grid.flat[count:]:
        axes.remove()
    return figure, list(grid.flat[:count])


def in_rows(count: int) -> int:
    """Number of columns for `count` panels."""
    return count if count <= WIDEST else WIDEST if count > 4 else 2


def label_outside(drawn: list[Axes], columns: int, x: str, y: str) -> None:
    """Label the left axes, and the lowest panel of each column."""
    for index, axes in enumerate(drawn):
        if index + columns >= len(drawn):
            axes.set_xlabel(x)
            axes.tick_params(labelbottom=True)
        if index % columns == 0:
            axes.set_ylabel(y)


def along(axes: Axes, which: Literal["x", "y"], coordinate: DataArray) -> None:
    """Set the ticks of a parameter's axis, logarithmic if its values are geometric."""
    values = coordinate.values * words(coordinate).factor
    axis = axes.xaxis if which == "x" else axes.yaxis
    if geometric(values):
        axes.set(**{f"{which}scale": "log"})
    if values.size <= FEW_TICKS:
        axis.set_ticks(values, [f"{value:.4g}" for value in values])
        axis.set_ticks([], minor=True)
    elif geometric(values):
        plain_log(axis, *((1.0, 2.0, 5.0) if values[-1] < 100.0 * values[0] else (1.0,)))
    else:
        axis.set_major_locator(MaxNLocator(6, steps=ROUND))


def frame(figure: Figure, title: str, handles: dict[str, Any], caption: str) -> None:
    """Set the title above, and below it the caption and a legend in as many columns as fit."""
    width = line_length(figure, CHARACTERS)
    lines = wrapped(title, width)
    figure.suptitle(lines, x=0.01, ha="left", fontsize=sized(12))
    longest = max((len(text) for text in handles), default=0)
    columns = width // (longest + 5)
    text = typeset(figure, caption)
    if page_size.now is None:  # a long caption does not take the height of the axes
        more = sized(LINE) * max(0, text.count("\n") + 1 - CAPTION_LINES)
        figure.set_figheight(figure.get_figheight() + more)
    figure.legend(
        handles=list(handles.values()),
        loc="outside lower left",
        ncols=min(max(1, columns), max(1, len(handles))),
        title=text,
        title_fontsize=sized(9),
        alignment="left",
        handlelength=1.6,
        columnspacing=1.4,
    )
