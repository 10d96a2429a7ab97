"""Axes of a sweep: which numbers of scenario and vehicle file vary, and over which values."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contactlib.base.quantities import FloatArray, Parameters, Quantity
from contactlib.base.text import known_names
from contactlib.files.mistakes import Mistakes
from contactlib.files.model import VEHICLE_SECTIONS
from contactlib.files.reading import check_keys, in_file, number, subsection, text
from contactlib.files.scenario import ControllerDesign, ScenarioContents
from contactlib.files.sections import (
    DemandSection,
    HeldSpeedSection,
    RelaxationSection,
    ScenarioRunSection,
    TrackSection,
)
from contactlib.runs.analysis import SWEEP_OUTCOMES
from contactlib.runs.sweep.sampling import Spread
from contactlib.traction import CONTROLLERS, Sensors
from contactlib.traction.interface import Controller
from contactlib.vehicle.drivetrain import Axle, Motor
from contactlib.vehicle.wheel_load import WheelLoad

SECTIONS: dict[str, type[Parameters]] = {
    "axle": Axle,
    "motor": Motor,
    "contact_relaxation": RelaxationSection,
    "run": ScenarioRunSection,
    "demand": DemandSection,
    "track": TrackSection,
    "wheel_load": WheelLoad,
    "held_speed": HeldSpeedSection,
    "sensors": Sensors,
}
PATH = re.compile(r"([A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)+)(?:\[([0-9]+)\])?")
EXAMPLES = "vehicle.wheelset.inertia, track.friction[1] or controllers.creep_pi.reference"
# Names that a dataset uses itself, and those of the dimensions of strings in its file.
TAKEN = re.compile(r"controller|run|failed|string\d+")
MOST_POINTS = 1_000_000
COMMON = ("parameter", "factor_on", "label")  # keys of every axis
# Further keys of an axis of a grid (True) and of a random sample (False).
KEYS: dict[bool, tuple[str, ...]] = {
    True: ("values", "from", "to", "count", "spacing"),
    False: ("values", "distribution", "from", "to", "mean", "standard_deviation"),
}
SPACINGS: dict[str, Callable[..., FloatArray]] = {"linear": np.linspace, "log": np.geomspace}
# Needed and optional keys of each distribution.
DISTRIBUTIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "uniform": (("from", "to"), ()),
    "log_uniform": (("from", "to"), ()),
    "whole": (("from", "to"), ()),
    "normal": (("mean", "standard_deviation"), ("from", "to")),
}
Controllers = Mapping[str, Controller | ControllerDesign]


@dataclass(frozen=True)
class Target:
    """One number of a file, or a whole list.

    Attributes
    ----------
    path : str
        Section and key as in the sweep file; paths into the vehicle's file begin with ``vehicle``.
    section : tuple of str
        ``vehicle``, ``controllers`` or, for the scenario, nothing; and the section there.
    key : str
        Key in the section.
    index : int or None
        Position in a list, from zero; None for a number or a whole list.
    whole_list : bool
        Whether the target is a whole list.
    quantity : Quantity
        Unit and limits.
    base : tuple of float or None
        Value in the file in SI units, one number or the list; None if it has none.
    """

    path: str
    section: tuple[str, str]
    key: str
    index: int | None
    whole_list: bool
    quantity: Quantity
    base: tuple[float, ...] | None

    @property
    def scaled(self) -> tuple[float, ...]:
        """The numbers that a factor multiplies."""
        numbers = self.base or ()
        return numbers if self.index is None else numbers[self.index : self.index + 1]

    def scale(self, factor: float) -> float | list[float]:
        """Value of the target times a factor."""
        numbers = [factor * number for number in self.scaled]
        return numbers if self.whole_list else numbers[0]


def find_target(
    path: str, contents: ScenarioContents, controllers: Controllers | None, *, factor: bool
) -> Target:
    """Find the number that a path names.

    Parameters
    ----------
    path : str
        Path such as ``track.friction[1]``.
    contents : ScenarioContents
        Contents of the sweep's scenario.
    controllers : mapping or None
        Controllers of the sweep; None as long as they are not designed.
    factor : bool
        Whether the number is multiplied instead of set: then the file or the controller's design
        must give it, and it may be a whole list.

    Raises
    ------
    ValueError
        If there is no such number; the message names the path.
    """
    found = PATH.fullmatch(path)
    if found is None:
        raise ValueError(f"{path!r} is not a path such as {EXAMPLES}")
    *names, key = found[1].split(".")
    index = None if found[2] is None else int(found[2])
    where = names.pop(0) if names[0] in ("vehicle", "controllers") else ""
    section = where, ".".join(names)
    kind, table = _section(path, *section, contents)
    quantities = kind.quantities()
    if key not in quantities:
        raise _unknown(path, key, quantities)
    quantity, base = quantities[key], None
    whole_list = key in kind.list_names() and index is None
    if key in kind.list_names():
        numbers = table.get(key)
        if not isinstance(numbers, list) or not numbers:
            raise ValueError(f"{path}: the scenario has no list of this name")
        base = tuple(number(path, entry, quantity) for entry in numbers)
        if whole_list and not factor:
            raise ValueError(
                f"{path} is a list of {len(base)}: name one entry, from {path}[0] on, or use "
                "factor_on for all of them"
            )
        if index is not None and index >= len(base):
            raise ValueError(f"{path}: the list has only {len(base)} entries, counted from zero")
    elif index is not None:
        raise ValueError(f"{path}: {found[1]} is a number, not a list")
    elif key in table:
        base = (number(path, table[key], quantity),)
    if where == "controllers" and controllers is not None:
        if section[1] not in controllers:
            raise ValueError(f"{path}: the controller {section[1]} does not run in this sweep")
        control = controllers[section[1]]
        if not isinstance(control, ControllerDesign):
            designed = getattr(control, key)
            base = None if designed is None else (float(designed),)
    if factor and base is None and not (where == "controllers" and controllers is None):
        raise ValueError(f"{path}: the file does not give the number that the factor is on")
    return Target(path, section, key, index, whole_list, quantity, base)


def _section(
    path: str, where: str, name: str, contents: ScenarioContents
) -> tuple[type[Any], dict[str, Any]]:
    """Class of a section, and its contents in the file."""
    if where == "controllers":
        controllers = subsection("controllers", contents.data["controllers"])
        if name not in controllers:
            raise _unknown(path, name, controllers)
        table = subsection(f"controllers.{name}", controllers[name])
        return CONTROLLERS[text(f"controllers.{name}.kind", table.get("kind"))], table
    if not where and name.split(".")[0] == "vehicle_changes":
        meant = path.replace("vehicle_changes", "vehicle", 1)
        raise ValueError(f"{path}: say {meant}, which includes the scenario's changes")
    known: Mapping[str, Any] = VEHICLE_SECTIONS if where else SECTIONS
    if name not in known:
        raise _unknown(path, name, known if where else [*known, "vehicle", "controllers"])
    data = contents.vehicle if where else contents.data
    return known[name], subsection(name, data.get(name, {}))


def _unknown(path: str, word: str, known: Collection[str]) -> ValueError:
    return ValueError(f"{path}: {word!r} is not known; {known_names(word, known)}")


def change(table: dict[str, Any], target: Target, value: float | list[float]) -> None:
    """Set a number or list in a section; a list of which one number is set is copied."""
    if target.index is None:
        table[target.key] = value
    else:
        table[target.key] = list(table[target.key])
        table[target.key][target.index] = value


@dataclass(frozen=True)
class Axis:
    """Numbers that vary together, and their values.

    Attributes
    ----------
    name, label : str
        Name of the coordinate, and its description.
    targets : tuple of Target
        Numbers that are set to the axis's value, or multiplied by it.
    factor : bool
        Whether the value multiplies.
    spread : Spread
        Distribution of the values; on a grid its points.
    """

    name: str
    label: str
    targets: tuple[Target, ...]
    factor: bool
    spread: Spread

    @property
    def unit(self) -> str:
        """SI unit of the values."""
        return "1" if self.factor else self.targets[0].quantity.unit

    @property
    def percent(self) -> bool:
        """Whether the values are shown in per cent."""
        return not self.factor and self.targets[0].quantity.percent

    def check(self, values: FloatArray) -> None:
        """Refuse values that are out of range for any of the targets; names the first."""
        for target in self.targets:
            for base in target.scaled if self.factor else (1.0,):
                bad = ~target.quantity.allows(base * values)
                if bad.any():
                    value = float(values[bad][0])
                    what = f"{value!r} times {base!r}" if self.factor else f"{value!r}"
                    raise ValueError(
                        f"axes.{self.name}: {target.path} = {what} is out of range: must be "
                        f"{target.quantity}"
                    )


def read_axis(
    name: str,
    section: object,
    contents: ScenarioContents,
    controllers: Controllers | None,
    *,
    grid: bool,
) -> Axis:
    """Read an axis of a sweep file; a ValueError names the key, path, unit or value."""
    table = subsection("it", section)
    for key in [k for k in table if k in KEYS[not grid] and k not in KEYS[grid]]:
        raise ValueError(
            f"{key} is for {'random samples' if grid else 'a grid'}, and this sweep is of "
            f"{'a grid' if grid else 'random samples'}: see sampling.kind"
        )
    check_keys("", table, [*COMMON, *KEYS[grid]], [])
    given = [key for key in ("parameter", "factor_on") if key in table]
    if len(given) != 1:
        raise ValueError(f"parameter and factor_on: give exactly one of them, not {len(given)}")
    factor = given[0] == "factor_on"
    paths = table[given[0]]
    paths = paths if isinstance(paths, list) and paths else [paths]
    paths = [text(given[0], path) for path in paths]
    targets = tuple(find_target(path, contents, controllers, factor=factor) for path in paths)
    units = {target.quantity.unit for target in targets}
    if len(units) > 1 and not factor:
        raise ValueError(f"{', '.join(paths)} have different units: {', '.join(sorted(units))}")
    default = f"{'factor on ' if factor else ''}{', '.join(paths)}"
    label = text("label", table.get("label", default))
    # Without limits: `Axis.check` holds the values against those of the targets.
    quantity = Quantity("1" if factor else targets[0].quantity.unit)
    if "values" in table:
        spread = Spread("values", _values(table, quantity))
    else:
        spread = _points(table, quantity) if grid else _distribution(table, quantity)
    return Axis(name, label, targets, factor, spread)


def _points(table: Mapping[str, Any], quantity: Quantity) -> Spread:
    check_keys("", table, [*COMMON, "from", "to", "count", "spacing"], ["from", "to", "count"])
    start, end = (number(key, table[key], quantity) for key in ("from", "to"))
    count = whole("count", table["count"], 1, MOST_POINTS)
    spacing = choice("spacing", table.get("spacing", "linear"), SPACINGS)
    if spacing == "log" and min(start, end) <= 0.0:
        raise ValueError(f"from = {start!r}, to = {end!r}: log spacing needs both above zero")
    if count > 1 and start == end:
        raise ValueError(f"from = to = {start!r}: {count} points would be the same")
    return Spread("values", tuple(SPACINGS[spacing](start, end, count).tolist()))


def _distribution(table: Mapping[str, Any], quantity: Quantity) -> Spread:
    kind = choice("distribution", table.get("distribution", "uniform"), DISTRIBUTIONS)
    needed, optional = DISTRIBUTIONS[kind]
    check_keys("", table, [*COMMON, "distribution", *needed, *optional], needed)
    limits = {"standard_deviation": replace(quantity, above=0.0)}
    given = {"from": -np.inf, "to": np.inf}
    for key in [key for key in (*needed, *optional) if key in table]:
        given[key] = number(key, table[key], limits.get(key, quantity))
    start, end = given.pop("from"), given.pop("to")
    if start >= end:
        raise ValueError(f"from = {start!r} must be < to = {end!r}")
    if kind == "whole" and (start != int(start) or end != int(end)):
        raise ValueError(f"from = {start!r}, to = {end!r} must be whole numbers")
    if kind == "log_uniform" and start <= 0.0:
        raise ValueError(f"from = {start!r} must be > 0: log_uniform is of ratios")
    return Spread(kind, (*given.values(), start, end))


def _values(table: Mapping[str, Any], quantity: Quantity) -> tuple[float, ...]:
    check_keys("", table, [*COMMON, "values"], [])
    values = table["values"]
    if not isinstance(values, list) or not values:
        raise ValueError(f"values = {values!r} must be a list of at least one number")
    numbers = tuple(number("values", value, quantity) for value in values)
    if len(set(numbers)) < len(numbers):
        raise ValueError(f"values = {values!r} has a number twice")
    return numbers


def whole(name: str, value: object, least: int, most: int) -> int:
    """Return a TOML value if it is a whole number within limits, or raise."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise ValueError(f"{name} = {value!r} must be a whole number from {least} to {most}")
    return value


def choice(name: str, value: object, known: Collection[str]) -> str:
    """Return a TOML value if it is one of the known words, or raise."""
    if text(name, value) not in known:
        raise ValueError(f"{name} = {value!r} must be one of: {', '.join(known)}")
    return str(value)


def read_axes(
    sections: object, contents: ScenarioContents, controllers: Controllers | None, *, grid: bool
) -> tuple[Axis, ...]:
    """Read the axes of a sweep file in order; no two of them may set the same number.

    Raises
    ------
    ValueError
        If a name, key, path, unit or value is wrong.
    """
    table = subsection("axes", sections)
    if not table:
        raise ValueError("axes: give at least one, [axes.NAME]")
    owner: dict[tuple[Any, ...], str] = {}

    def read(name: str, section: object) -> Axis:
        known = TAKEN.fullmatch(name) or name in SWEEP_OUTCOMES
        if known or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", name):
            raise ValueError(
                f"axes.{name!r} is not a name for an axis: it must be of 1 to 64 ASCII letters, "
                "digits and _, begin with a letter, and not be that of an outcome nor "
                "controller, run, failed, string1, string2, ..., which the results have themselves"
            )
        with in_file(f"axes.{name}"):
            axis = read_axis(name, section, contents, controllers, grid=grid)
            for target in axis.targets:
                size = len(target.base or (0,))
                for index in range(size) if target.whole_list else [target.index]:
                    place = (target.section, target.key, index)
                    if place in owner:
                        raise ValueError(f"{target.path} is set by axes.{owner[place]} already")
                    owner[place] = name
        return axis

    with Mistakes(table) as mistakes:
        return tuple(mistakes.of(read, name, section) for name, section in table.items())
