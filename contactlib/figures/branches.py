"""Signals of a run over time, by the branch that it is on.

Solid where the creep force rises with creepage; dashed on the falling branch. What vibrates too
fast to be seen as a line becomes the band that it fills.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from contactlib.figures.style import BLUE, DASHED, ORANGE
from contactlib.parameters import FloatArray
from contactlib.simulation import Result

BAND_COLOR = "#CFCFCF"
BINS = 200  # of a band
SWINGS, MANY = 3.0, 0.2  # a line becomes one if it crosses its width so often in so many of them


def by_branch(axes: Axes, result: Result, values: FloatArray) -> None:
    """Draw a signal that has the rows of `result`."""
    falls = result["falling_branch"] > 0.0
    starts = np.linspace(0, values.size, BINS, endpoint=False).astype(int)
    if values.size > 4 * BINS and _vibrates(values, starts):
        _band(axes, result.time, values, falls, starts)
    else:
        _line(axes, result.time, values, falls)


def _vibrates(values: FloatArray, starts: NDArray[np.int_]) -> bool:
    """Whether a signal swings to and fro within many bins, and by more than noise does."""
    widths = np.maximum.reduceat(values, starts) - np.minimum.reduceat(values, starts)
    ways = np.add.reduceat(np.abs(np.diff(values, append=values[-1])), starts)
    usual = float(np.ptp(np.quantile(values, [0.01, 0.99])))  # without what happens once
    swings = np.divide(ways, widths, out=np.zeros_like(ways), where=widths > 0.0)
    return float(np.mean((swings > SWINGS) & (widths > 0.15 * usual))) > MANY


def _band(
    axes: Axes,
    time: FloatArray,
    values: FloatArray,
    falls: NDArray[np.bool_],
    starts: NDArray[np.int_],
) -> None:
    """Lowest and highest value in each bin, and what lies between."""
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    at, fallen = time[starts], np.maximum.reduceat(falls, starts)
    at[-1] = time[-1]
    axes.fill_between(at, low, high, color=BAND_COLOR, lw=0.0)
    for edge in (low, high):
        _line(axes, at, edge, fallen)


def _line(axes: Axes, time: FloatArray, values: FloatArray, falls: NDArray[np.bool_]) -> None:
    # A row beside a change of branch belongs to both lines, so that they meet.
    meets = falls | np.append(falls[1:], False) | np.append(False, falls[:-1])
    axes.plot(time, np.where(falls, np.nan, values), color=BLUE, lw=1.3)
    axes.plot(time, np.where(meets, values, np.nan), color=ORANGE, lw=1.3, ls=DASHED)
