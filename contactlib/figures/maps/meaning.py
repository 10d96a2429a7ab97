"""Names, units and scales with which the quantities of a sweep appear on axes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FloatArray
from contactlib.figures.style import wrapped
from contactlib.runs.analysis import SWEEP_OUTCOMES
from contactlib.runs.outcomes import Outcome

if TYPE_CHECKING:
    from xarray import DataArray

# Units that take a prefix, largest first.
FORCES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""))
SHORT = ((1.0, ""), (1e-3, "m"))
PREFIXES = {"N": FORCES, "N.m": FORCES, "J": FORCES, "W": FORCES, "s": SHORT, "m": SHORT}
KEY = re.compile(r"[a-z_]+(\.[a-z_]+)+(\[\d+\])?")  # of a file, that is swept without a label
GEOMETRIC = 3.0  # largest / smallest value above which an axis may be logarithmic
WIDE = 30.0  # largest / smallest value above which a scale is logarithmic


class Words(NamedTuple):
    """Name and unit of a quantity, and the factor from SI to that unit."""

    name: str
    unit: str
    factor: float

    @property
    def label(self) -> str:
        """Label of an axis."""
        return f"{self.name}  [{self.unit}]"

    def lines(self, width: int) -> str:
        """Label of a short axis, wrapped to a width in characters."""
        return f"{wrapped(self.name, width)}  [{self.unit}]"

    def number(self, value: float) -> str:
        """A value in SI units, written with the displayed unit."""
        unit = "" if self.unit == "1" else f"\u00a0{self.unit}"
        return f"{value * self.factor:.4g}{unit}"


def words(array: DataArray) -> Words:
    """Name of an outcome or an axis, and the unit in which its numbers are short."""
    given = array.attrs.get("long_name") if array.name in array.coords else None
    name = str(given or str(array.name).replace("_", " "))
    unit = str(array.attrs.get("units", "1"))
    if KEY.fullmatch(name):
        name = re.sub("[._]", " ", name)
    name = name.replace("$", r"\$")
    if unit == "1":
        in_percent = array.attrs.get("display_units") == "%"
        return Words(name, "%", 100.0) if in_percent else Words(name, "1", 1.0)
    values = np.abs(finite(array.values))
    typical = np.exp(np.log(values).mean()) if wide(values) else values.max(initial=0.0)
    if unit == "kg" and typical >= 1e3:
        return Words(name, "t", 1e-3)
    fitting = [pair for pair in PREFIXES.get(unit, ()) if pair[0] <= typical]
    size, prefix = fitting[0] if fitting else (1.0, "")
    text = re.sub(r"([a-z])(\d)", r"\1$^\2$", unit.replace(".", " "))
    return Words(name, prefix + text, 1.0 / size)


def finite(values: ArrayLike) -> FloatArray:
    """The finite values, as a flat array."""
    v = np.asarray(values, dtype=np.float64).ravel()
    return v[np.isfinite(v)]


def geometric(values: FloatArray) -> bool:
    """Whether sorted values of an axis are spaced by a common ratio rather than a difference."""
    if values.size < 3 or values[0] <= 0.0 or values[-1] < GEOMETRIC * values[0]:
        return False
    ratios, steps = np.diff(np.log(values)), np.diff(values)
    return bool(np.ptp(ratios) / ratios.mean() < np.ptp(steps) / steps.mean())


def wide(values: FloatArray) -> bool:
    """Whether finite values are positive and differ by more than a factor of `WIDE`."""
    return bool(values.size and values.min() > 0.0 and values.max() > WIDE * values.min())


def meaning(outcome: object) -> Outcome:
    """Registry entry of an outcome; a neutral one for an unknown name."""
    return SWEEP_OUTCOMES.get(str(outcome), Outcome("1", ""))
