"""All axes of a sweep together."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from contactlib.scenario import ControllerDesign, ScenarioContents
from contactlib.scenario.reading import in_file, subsection
from contactlib.sweep.axis import Axis, read_axis
from contactlib.sweep.outcomes import OUTCOMES
from contactlib.sweep.target import Target
from contactlib.traction import TractionController

# Names of what else a dataset has, and of the dimensions of characters in its file.
TAKEN = re.compile(r"controller|run|failed|string\d+")


def read_axes(
    sections: object,
    contents: ScenarioContents,
    controllers: Mapping[str, TractionController | ControllerDesign],
    *,
    grid: bool,
) -> Iterator[Axis]:
    """Axes of a sweep file, in its order; no two of them set the same number.

    Raises
    ------
    ValueError
        If a name, key, path, unit or value is wrong.
    """
    table = subsection("axes", sections)
    if not table:
        raise ValueError("axes: give at least one, [axes.NAME]")
    owner: dict[tuple[Any, ...], str] = {}
    for name, section in table.items():
        known = TAKEN.fullmatch(name) or name in OUTCOMES
        if known or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", name):
            raise ValueError(
                f"axes.{name!r} is not a name for an axis: it must be of 1 to 64 ASCII letters, "
                "digits and _, begin with a letter, and not be that of an outcome nor "
                "controller, run, failed, string1, string2, ..., which the results have themselves"
            )
        with in_file(f"axes.{name}"):
            axis = read_axis(name, section, contents, grid=grid)
            targets = tuple(_of_controllers(t, controllers, axis.factor) for t in axis.targets)
            for target in targets:
                for index in (
                    range(len(target.base or (0,))) if target.whole_list else [target.index]
                ):
                    place = (target.section, target.key, index)
                    if place in owner:
                        raise ValueError(f"{target.path} is set by axes.{owner[place]} already")
                    owner[place] = name
        yield replace(axis, targets=targets)


def _of_controllers(
    target: Target,
    controllers: Mapping[str, TractionController | ControllerDesign],
    factor: bool,
) -> Target:
    """The target; in a controller that runs, with the number that was designed."""
    if target.section[0] != "controllers":
        return target
    name = target.section[1]
    if name not in controllers:
        raise ValueError(f"{target.path}: the controller {name} does not run in this sweep")
    controller = controllers[name]
    if not isinstance(controller, ControllerDesign):
        designed = getattr(controller, target.key)
        target = replace(target, base=None if designed is None else (float(designed),))
    if factor and target.base is None:
        raise ValueError(f"{target.path}: nothing gives the number that the factor is on")
    return target
