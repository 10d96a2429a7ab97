"""Which axis of a grid goes where on paper, and at what value the others are held."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlib.figures.maps.meaning import MARGIN
from contactlib.figures.maps.words import words
from contactlib.figures.scenario import run_name
from contactlib.parameters import FloatArray

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

CONTROLLER, RUN, FAILED = "controller", "run", "failed"
FEW = 4  # an axis of fewer values is drawn as lines or panels, not as an axis of a map
PANELS = 9  # most panels


class Case(NamedTuple):
    """What one controller gave at one value of a further axis: a line, or a map.

    Attributes
    ----------
    controller : str or None
        None for an outcome that needs none.
    further : str
        The value of the further axis, in words; empty if there is none.
    values : array
        Over the axes of the layout, the last of them first, in SI units.
    failed : array of bool
        Where the run failed.
    margin : array or None
        What is left of the critical torque, if the sweep has it [1].
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
        What is drawn of it, sorted along its axes.
    axes : tuple of DataArray
        One axis for lines, two (across, up) for a map.
    further : DataArray or None
        The axis of which each value is a line or a map of its own.
    note : str
        What else varies in the sweep, and at what value it is shown; empty if nothing.
    cases : tuple of Case
        The controllers of one value of the further axis stand together.
    """

    outcome: DataArray
    axes: tuple[DataArray, ...]
    further: DataArray | None
    note: str
    cases: tuple[Case, ...]


def layout(dataset: Dataset, outcome: str) -> Layout:
    """Choose axes and panels for an outcome on a grid: long axes first, in the file's order.

    An axis that does not matter is left out.
    """
    wanted = set(dataset[outcome].dims)
    there = [name for name in (FAILED, MARGIN) if name in dataset and name != outcome]
    beside = [name for name in there if set(dataset[name].dims) <= wanted]
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
        most = PANELS if len(axes) == 2 and CONTROLLER not in wanted else FEW - 1
        data = data.isel({rest[0]: _spread(data.sizes[rest[0]], most)})
    parts = (("Shown at", held), ("Does not depend on", idle))
    return Layout(
        data[outcome],
        tuple(data[name] for name in axes),
        data[rest[0]] if rest else None,
        " ".join(f"{text} {', '.join(words)}." for text, words in parts if words),
        tuple(_cases(data, outcome, axes, rest[:1])),
    )


def _matters(data: Dataset, name: str) -> bool:
    """Whether anything differs along an axis."""
    first = data.isel({name: 0}, drop=True)
    return any(not first.equals(data.isel({name: i}, drop=True)) for i in range(data.sizes[name]))


def controllers(outcome: DataArray) -> list[str]:
    """Names of the controllers; none for an outcome that needs none."""
    return [str(name) for name in outcome[CONTROLLER].values] if CONTROLLER in outcome.dims else []


def _cases(
    data: Dataset, outcome: str, axes: tuple[str, ...], further: list[str]
) -> Iterator[Case]:
    data = data.transpose(*further, ..., *reversed(axes))
    for third in range(data.sizes[further[0]]) if further else [0]:
        part = data.isel(dict.fromkeys(further, third))
        text = _at(part[further[0]]) if further else ""
        names: list[str | None] = [*controllers(data[outcome])]
        for name in names or [None]:
            one = part if name is None else part.sel({CONTROLLER: name})
            values = one[outcome].values
            failed = one[FAILED].values > 0.0 if FAILED in one else np.zeros(values.shape, bool)
            margin = one[MARGIN].values if MARGIN in one else None
            yield Case(name, text, values, failed, margin)


def title_of(case: Case) -> str:
    """Of a panel."""
    return ", ".join(filter(None, (case.controller and run_name(case.controller), case.further)))


def _at(coordinate: DataArray) -> str:
    """The one value of a coordinate, in words."""
    of_axis = words(coordinate)
    return f"{of_axis.name} {of_axis.number(float(coordinate))}"


def _spread(count: int, most: int) -> list[int]:
    """At most so many indices, from the first to the last, evenly."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, most)).tolist()})
