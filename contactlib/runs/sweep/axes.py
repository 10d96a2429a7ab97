"""Axes of a sweep: which numbers of scenario and vehicle file vary, and over which values."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from contactlib.base.quantities import FloatArray, Parameter, Parameters, Quantity, declared
from contactlib.base.text import known_names
from contactlib.files.mistakes import Mistakes
from contactlib.files.reading import (
    check_keys,
    in_file,
    number,
    read_section,
    subsection,
    text,
)
from contactlib.files.scenario import KINDS, SECTIONS, ControllerDesign, ScenarioContents
from contactlib.files.sections import VEHICLE_SECTIONS, Keys
from contactlib.runs.analysis import SWEEP_OUTCOMES
from contactlib.runs.sweep.sampling import Spread, points, sample, values_of
from contactlib.traction.interface import Controller

PATH = re.compile(r"([A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)+)(?:\[([0-9]+)\])?")
EXAMPLES = "vehicle.wheelset.inertia, track.friction[1] or controllers.creep_pi.reference"
# Names that a dataset uses itself, and the names of dimensions of strings in its file.
TAKEN = re.compile(r"controller|run|draw|failed|string\d+")
# Keys that define the values of an axis of a grid (True) and of a random sample (False).
WAYS: dict[bool, tuple[Callable[..., Spread], ...]] = {
    True: (values_of, points),
    False: (values_of, sample),
}


@dataclass(frozen=True, kw_only=True)
class AxisKeys(Parameters):
    """Keys of every axis.

    Parameters
    ----------
    parameter : str
        Path of the number that gets the axis's value, or a list of paths.
    factor_on : str
        Path of the number, or list of numbers, that the axis multiplies. Give exactly one of
        `parameter` and `factor_on`.
    label : str
        Label of the axis in figures.
    """

    parameter: str | None = None
    factor_on: str | None = None
    label: str | None = None


Controllers = Mapping[str, Controller | ControllerDesign]


@dataclass(frozen=True)
class Target:
    """One number of a file, or all numbers of a list.

    Attributes
    ----------
    path : str
        Section and key as in the sweep file; paths into the wheelset's file begin with ``vehicle``.
    section : tuple of str
        ``vehicle``, ``controllers`` or, for the scenario, nothing; and the section there.
    key : str
        Key in the section.
    places : tuple of int or None
        Positions in a list, from zero; None for a number.
    quantity : Quantity
        Unit and limits.
    base : tuple of float or None
        The numbers in the file in SI units; None if it has none.
    """

    path: str
    section: tuple[str, str]
    key: str
    places: tuple[int, ...] | None
    quantity: Quantity
    base: tuple[float, ...] | None

    def put(self, table: dict[str, Any], value: float, *, factor: bool) -> None:
        """Set the numbers in a section to a value or a multiple; a list is copied."""
        numbers = [value * base for base in self.base or ()] if factor else [value]
        if self.places is None:
            table[self.key] = numbers[0]
        else:
            table[self.key] = list(table[self.key])
            for place, number in zip(self.places, numbers, strict=True):
                table[self.key][place] = number


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
    match = PATH.fullmatch(path)
    if match is None:
        raise ValueError(f"{path!r} is not a path such as {EXAMPLES}")
    *names, key = match[1].split(".")
    # A vehicle's own numbers stand in the scenario: vehicle.body_mass.
    where = names.pop(0) if names[0] in ("vehicle", "controllers") and names[1:] else ""
    section = where, ".".join(names)
    keys, table = _section(path, *section, contents)
    quantities = {
        name: parameter.quantity for name, parameter in keys.items() if parameter.quantity
    }
    if key not in quantities:
        raise _unknown(path, key, quantities)
    quantity, places, base = quantities[key], None, None
    if keys[key].many:
        places, base = _of_list(path, match[2], table.get(key), quantity)
        if match[2] is None and not factor:
            raise ValueError(
                f"{path} is a list of {len(base)}: name one entry, from {path}[0] on, or use "
                "factor_on for all of them"
            )
    elif match[2] is not None:
        raise ValueError(f"{path}: {match[1]} is a number, not a list")
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
    return Target(path, section, key, places, quantity, base)


def _of_list(
    path: str, index: str | None, given: object, quantity: Quantity
) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Place of an entry or, without an index, of all entries of a list, and the numbers there."""
    if not isinstance(given, list) or not given:
        raise ValueError(f"{path}: the scenario has no list of this name")
    if index is not None and int(index) >= len(given):
        raise ValueError(f"{path}: the list has only {len(given)} entries, counted from zero")
    places = tuple(range(len(given))) if index is None else (int(index),)
    return places, tuple(number(path, given[place], quantity) for place in places)


def _section(
    path: str, where: str, name: str, contents: ScenarioContents
) -> tuple[Keys, dict[str, Any]]:
    """Keys of a section, and its contents in the file."""
    if where == "controllers":
        controllers = subsection("controllers", contents.data["controllers"])
        if name not in controllers:
            raise _unknown(path, name, controllers)
        table = subsection(f"controllers.{name}", controllers[name])
        return KINDS[text(f"controllers.{name}.kind", table.get("kind"))], table
    if not where and name.split(".")[0] == "wheelset_changes":
        meant = path.replace("wheelset_changes", "vehicle", 1)
        raise ValueError(f"{path}: use {meant}, which includes the scenario's changes")
    known = VEHICLE_SECTIONS if where else SECTIONS
    if name not in known:
        raise _unknown(path, name, known if where else [*known, "vehicle", "controllers"])
    data = contents.vehicle if where else contents.data
    return known[name], subsection(name, data.get(name, {}))


def _unknown(path: str, word: str, known: Collection[str]) -> ValueError:
    return ValueError(f"{path}: {word!r} is not known; {known_names(word, known)}")


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
            for base in (target.base or ()) if self.factor else (1.0,):
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
    grid = grid and "distribution" not in table  # a drawn axis of a grid
    common, (one_by_one, spaced), (_, other) = declared(AxisKeys), WAYS[grid], WAYS[not grid]
    known = [*common, *declared(one_by_one), *declared(spaced)]
    for key in [key for key in table if key in declared(other) and key not in known]:
        raise ValueError(
            f"{key} is for {'random samples' if grid else 'a grid'}, and this axis is of "
            f"{'a grid' if grid else 'random samples'}: see sampling.kind and distribution"
        )
    check_keys("", table, known, [])
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
    make = one_by_one if "values" in table else spaced
    # The values are held against the limits of the targets by `Axis.check`.
    unit = "1" if factor else targets[0].quantity.unit
    keys = {key: _in_unit(parameter, unit) for key, parameter in declared(make).items()}
    settings = read_section("", keys, table, common)
    spread = make(**{keys[key].name: value for key, value in settings.items()})
    return Axis(name, label, targets, factor, spread)


def _in_unit(parameter: Parameter, unit: str) -> Parameter:
    if parameter.quantity is None or parameter.quantity.whole:
        return parameter
    return replace(parameter, quantity=replace(parameter.quantity, unit=unit))


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
                f"axes.{name!r} is not a name for an axis: it must have 1 to 64 ASCII letters, "
                "digits or _, begin with a letter, and not be the name of an outcome or one of the "
                "results': controller, run, draw, failed, string1, string2, ..."
            )
        with in_file(f"axes.{name}"):
            axis = read_axis(name, section, contents, controllers, grid=grid)
            for target in axis.targets:
                for index in target.places or (0,):
                    place = (target.section, target.key, index)
                    if place in owner:
                        raise ValueError(f"{target.path} is set by axes.{owner[place]} already")
                    owner[place] = name
        return axis

    with Mistakes(table) as mistakes:
        return tuple(mistakes.of(read, name, section) for name, section in table.items())
