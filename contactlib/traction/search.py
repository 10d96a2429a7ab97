"""The settings of a controller that `tune` may search: it declares them in `search_ranges`.

The search creates a controller with other settings from the arguments of its class, which it stores
under their names; ``__init__`` then updates derived values.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from contactlib.base.quantities import Parameters, as_number, shown
from contactlib.base.text import USERS_ERRORS, explained, known_names
from contactlib.traction.interface import Controller

WIDEST = 4.0  # factor on a designed setting, or its inverse
EXAMPLE = {"gain": (1e3, 1e4)}
Ranges = Mapping[str, tuple[float, float]]


def around_design(control: Parameters, *names: str) -> dict[str, tuple[float, float]]:
    """Range of each setting: from a quarter to four times its value, within its limits.

    A setting of zero stays zero.
    """
    ranges = {}
    for name in names:
        value, limits = getattr(control, name), type(control).quantities()[name]
        low, high = sorted((value / WIDEST, value * WIDEST))
        if low < high:
            largest = min(limits.at_most, math.nextafter(limits.below, 0.0))
            ranges[name] = (max(low, limits.at_least), min(high, largest))
    return ranges


class Searched:
    """A controller and the settings of it that may be searched.

    Parameters
    ----------
    where : str
        The controller in messages.
    control : SampledController or TractionController
        The controller.

    Attributes
    ----------
    control : SampledController or TractionController
        The controller.
    arguments : dict
        Arguments of its class that make it.
    ranges : dict
        Lowest and highest value of each setting.

    Raises
    ------
    ValueError
        If it declares no settings, or cannot be made with others.
    """

    def __init__(self, where: str, control: Controller) -> None:
        self.control, self._kind = control, type(control).__name__
        self.arguments = _arguments(control)
        ranges: Any = getattr(control, "search_ranges", None)
        if not ranges and isinstance(control, Parameters):
            raise ValueError(f"{where} is an {self._kind}, which has no settings to search")
        if not isinstance(ranges, Mapping) or not ranges:
            raise ValueError(
                f"{where}: the class {self._kind} declares no settings to search: write into it "
                f"search_ranges = {self._example()}, the lowest and the highest value of each"
            )
        self.ranges = {name: self._range(where, name, ends) for name, ends in ranges.items()}
        made = self.changed(dict.fromkeys(self.ranges, 1.0))
        for name, value in self.arguments.items():
            kept: Any = getattr(made, name, None)
            if not np.array_equal(kept, value):
                raise ValueError(
                    f"{where}: {self._kind}({name}={shown(value)}) keeps {name} = "
                    f"{shown(kept)}: it must keep the argument as it is, as a "
                    "search makes the controller anew for all settings that it tries"
                )

    def _example(self) -> dict[str, tuple[float, float]]:
        """Declaration for the class: of its arguments that are positive numbers."""
        numbers = {name: as_number(value) for name, value in self.arguments.items()}
        settings = {
            name: (value / WIDEST, value * WIDEST)
            for name, value in numbers.items()
            if value is not None and 0.0 < value < math.inf and name != "sample_time"
        }
        return settings or EXAMPLE

    def _range(self, where: str, name: str, ends: object) -> tuple[float, float]:
        what = f"{where}: {self._kind}.search_ranges"
        if name not in self.arguments:
            known = known_names(str(name), self.arguments)
            raise ValueError(f"{what}: {shown(name)} is not an argument of the class; {known}")
        given = (*ends, self.arguments[name]) if isinstance(ends, tuple | list) else ()
        numbers = [number for number in map(as_number, given) if number is not None]
        if len(given) == len(numbers) == 3:
            low, high, value = numbers
            if low <= value <= high and low < high and 0.0 < low * high < math.inf:
                return low, high
        raise ValueError(
            f"{what}[{name!r}] = {shown(ends)} must be the lowest and the highest value, two "
            f"numbers of one sign, and {name} = {shown(self.arguments[name])} between them"
        )

    def factors(self, name: str) -> tuple[float, float]:
        """Smallest and largest factor on a setting."""
        value = self.arguments[name]
        low, high = sorted(end / value for end in self.ranges[name])
        return low, high

    def changed(self, factors: Mapping[str, float]) -> Any:
        """The controller with settings multiplied, or None if they contradict each other."""
        given = {}
        for name, factor in factors.items():
            low, high = self.ranges[name]
            given[name] = min(max(self.arguments[name] * factor, low), high)
        try:
            return type(self.control)(**{**self.arguments, **given})
        except ValueError:
            return None
        except USERS_ERRORS as error:
            raise explained(f"{self._kind} with {given}", error) from error


def _arguments(control: Controller) -> dict[str, Any]:
    """Arguments of the class that make the controller once more."""
    kind: Any = type(control)
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    given = inspect.signature(kind).parameters.values()
    names = [parameter.name for parameter in given if parameter.kind in kinds]
    for name in names:
        if not hasattr(control, name):
            raise ValueError(
                f"{kind.__name__} must keep its argument {name} as self.{name}, as a search makes "
                "the controller anew for all settings that it tries"
            )
    return {name: getattr(control, name) for name in names}
