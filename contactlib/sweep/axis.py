"""Axes of a sweep: what varies, and over which values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contactlib.parameters import FloatArray, Quantity
from contactlib.scenario import ScenarioContents
from contactlib.scenario.reading import check_keys, number, subsection, text
from contactlib.sweep.distribution import (
    Choice,
    Distribution,
    LogUniform,
    Normal,
    Uniform,
    Whole,
)
from contactlib.sweep.target import Target, find_target

MOST_POINTS = 1_000_000
WHAT = ("parameter", "factor_on", "label")
# Keys that an axis may have by whether it is of a grid.
KEYS: dict[bool, tuple[str, ...]] = {
    True: ("values", "from", "to", "count", "spacing"),
    False: ("values", "distribution", "from", "to", "mean", "standard_deviation"),
}
SPACINGS: dict[str, Callable[..., FloatArray]] = {"linear": np.linspace, "log": np.geomspace}
# Keys that each distribution needs, and may have.
DISTRIBUTIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "uniform": (("from", "to"), ()),
    "log_uniform": (("from", "to"), ()),
    "whole": (("from", "to"), ()),
    "normal": (("mean", "standard_deviation"), ("from", "to")),
}


@dataclass(frozen=True)
class Axis:
    """What varies together, and how.

    Attributes
    ----------
    name, label : str
        Of the coordinate, and what it is in words.
    targets : tuple of Target
        Numbers that get the axis's value, or that it multiplies.
    factor : bool
        Whether it multiplies.
    spread : Choice, ..., Normal
        Its values: on a grid a `Choice`, whose values are the points.
    """

    name: str
    label: str
    targets: tuple[Target, ...]
    factor: bool
    spread: Distribution

    @property
    def unit(self) -> str:
        """SI unit of its values."""
        return "1" if self.factor else self.targets[0].quantity.unit

    def check(self, values: FloatArray) -> None:
        """Refuse values that any of the targets does not allow.

        Raises
        ------
        ValueError
            If there are any; the message names the first.
        """
        for target in self.targets:
            bases = target.scaled if self.factor else (1.0,)
            for base in bases:
                bad = ~target.quantity.allows(base * values)
                if bad.any():
                    value = float(values[bad][0])
                    what = f"{value!r} times {base!r}" if self.factor else f"{value!r}"
                    raise ValueError(
                        f"{target.path} = {what} is out of range: must be {target.quantity}"
                    )


def read_axis(name: str, section: object, contents: ScenarioContents, *, grid: bool) -> Axis:
    """An axis of a sweep file.

    Raises
    ------
    ValueError
        If a key, path, unit or value is wrong; the message names it.
    """
    table = subsection("it", section)
    for key in [k for k in table if k in KEYS[not grid] and k not in KEYS[grid]]:
        raise ValueError(
            f"{key} is for {'random samples' if grid else 'a grid'}, and this sweep is of "
            f"{'a grid' if grid else 'random samples'}: see sampling.kind"
        )
    check_keys("", table, [*WHAT, *KEYS[grid]], [])
    given = [key for key in ("parameter", "factor_on") if key in table]
    if len(given) != 1:
        raise ValueError(f"parameter and factor_on: give exactly one of them, not {len(given)}")
    factor = given[0] == "factor_on"
    paths = table[given[0]]
    paths = paths if isinstance(paths, list) and paths else [paths]
    paths = [text(given[0], path) for path in paths]
    targets = tuple(find_target(path, contents, factor=factor) for path in paths)
    units = {target.quantity.unit for target in targets}
    if len(units) > 1 and not factor:
        raise ValueError(f"{', '.join(paths)} have different units: {', '.join(sorted(units))}")
    label = text("label", table["label"]) if "label" in table else _label(paths, factor)
    # Limits are those of the numbers themselves, and are checked with these.
    quantity = Quantity("1" if factor else targets[0].quantity.unit)
    read = _points if grid else _distribution
    return Axis(name, label, targets, factor, read(table, quantity))


def _label(paths: list[str], factor: bool) -> str:
    return f"{'factor on ' if factor else ''}{', '.join(paths)}"


def _points(table: Mapping[str, Any], quantity: Quantity) -> Choice:
    if "values" in table:
        return _values(table, quantity)
    check_keys("", table, [*WHAT, "from", "to", "count", "spacing"], ["from", "to", "count"])
    start, end = (number(key, table[key], quantity) for key in ("from", "to"))
    count = whole("count", table["count"], 1, MOST_POINTS)
    spacing = text("spacing", table.get("spacing", "linear"))
    if spacing not in SPACINGS:
        raise ValueError(f"spacing = {spacing!r} must be one of: {', '.join(SPACINGS)}")
    if spacing == "log" and min(start, end) <= 0.0:
        raise ValueError(f"from = {start!r}, to = {end!r}: log spacing needs both above zero")
    if count > 1 and start == end:
        raise ValueError(f"from = to = {start!r}: {count} points would be the same")
    return Choice(tuple(SPACINGS[spacing](start, end, count).tolist()))


def _distribution(table: Mapping[str, Any], quantity: Quantity) -> Distribution:
    if "values" in table:
        return _values(table, quantity)
    kind = text("distribution", table.get("distribution", "uniform"))
    if kind not in DISTRIBUTIONS:
        raise ValueError(f"distribution = {kind!r} must be one of: {', '.join(DISTRIBUTIONS)}")
    needed, optional = DISTRIBUTIONS[kind]
    check_keys("", table, [*WHAT, "distribution", *needed, *optional], needed)
    known = {key: number(key, table[key], quantity) for key in ("from", "to") if key in table}
    start, end = known.get("from", -np.inf), known.get("to", np.inf)
    if start >= end:
        raise ValueError(f"from = {start!r} must be < to = {end!r}")
    if kind == "normal":
        mean = number("mean", table["mean"], quantity)
        width = number(
            "standard_deviation", table["standard_deviation"], replace(quantity, above=0.0)
        )
        return Normal(mean, width, start, end)
    if kind == "whole":
        if start != int(start) or end != int(end):
            raise ValueError(f"from = {start!r}, to = {end!r} must be whole numbers")
        return Whole(start, end)
    if kind == "log_uniform":
        if start <= 0.0:
            raise ValueError(f"from = {start!r} must be > 0: log_uniform is of ratios")
        return LogUniform(start, end)
    return Uniform(start, end)


def _values(table: Mapping[str, Any], quantity: Quantity) -> Choice:
    check_keys("", table, [*WHAT, "values"], [])
    values = table["values"]
    if not isinstance(values, list) or not values:
        raise ValueError(f"values = {values!r} must be a list of at least one number")
    numbers = tuple(number("values", value, quantity) for value in values)
    if len(set(numbers)) < len(numbers):
        raise ValueError(f"values = {values!r} has a number twice")
    return Choice(numbers)


def whole(name: str, value: object, least: int, most: int) -> int:
    """A TOML value that is a whole number within limits."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise ValueError(f"{name} = {value!r} must be a whole number from {least} to {most}")
    return value
