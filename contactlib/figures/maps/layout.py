"""Which axis of a grid goes where on paper, and at what value the others are held."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlib.figures.maps.words import words
from contactlib.figures.scenario import run_name

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
    values : DataArray
        Over the axes of the layout, in SI units.
    failed : array of bool
        Where the run failed.
    """

    controller: str | None
    further: str
    values: DataArray
    failed: NDArray[np.bool_]


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
    held : str
        What else varies in the sweep and at what value it is held, in words; empty if nothing.
    cases : tuple of Case
        The controllers of one value of the further axis stand together.
    """

    outcome: DataArray
    axes: tuple[DataArray, ...]
    further: DataArray | None
    held: str
    cases: tuple[Case, ...]


def layout(dataset: Dataset, outcome: str) -> Layout:
    """Choose axes and panels for an outcome on a grid: long axes first, in the file's order."""
    of_runs = CONTROLLER in dataset[outcome].dims
    data = dataset[[outcome, FAILED] if of_runs and FAILED in dataset else [outcome]]
    names = [str(name) for name in dataset[outcome].dims if name != CONTROLLER]
    data = data.sortby(names)
    several = [name for name in names if data.sizes[name] > 1] or names[:1]
    long = [name for name in several if data.sizes[name] >= FEW]
    axes = tuple(long[:2] or several[:1])
    rest = sorted((n for n in several if n not in axes), key=long.__contains__)
    parts = []
    for name in (n for n in names if n not in (*axes, *rest[:1])):
        data = data.isel({name: data.sizes[name] // 2})
        parts.append(_at(data[name]))
    if rest:
        most = PANELS if len(axes) == 2 and not of_runs else FEW - 1
        data = data.isel({rest[0]: _spread(data.sizes[rest[0]], most)})
    return Layout(
        data[outcome],
        tuple(data[name] for name in axes),
        data[rest[0]] if rest else None,
        ", ".join(parts),
        tuple(_cases(data, outcome, axes, rest[:1])),
    )


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
            flags = one[FAILED].values if FAILED in one else np.zeros(one[outcome].shape)
            yield Case(name, text, one[outcome], flags > 0.0)


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
