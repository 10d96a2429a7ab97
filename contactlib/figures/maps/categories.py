"""Maps of what is no number: which controller does best, whether a demand is held."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from contactlib.figures.maps.layout import CONTROLLER, controllers
from contactlib.figures.maps.meaning import meaning
from contactlib.figures.maps.words import finite, wide
from contactlib.parameters import FloatArray

if TYPE_CHECKING:
    from xarray import DataArray

ALIKE = 0.05  # difference that does not count, over that of the largest and smallest value
CELLS = 4000  # of a panel, from which an SVG holds them as a picture
# From light to dark, so that they differ in grey.
SHADES = ("white", "#F0E442", "#56B4E9", "#D55E00", "#004B70", "black")


def best(outcome: DataArray) -> DataArray | None:
    """Number of the controller that does best, from 1; 0 if the best two are alike, nan if none.

    Differences are those of logarithms where the map's scale is logarithmic. None for an outcome
    of which it cannot be said, or of one controller, or if they are alike everywhere.
    """
    wanted, names = meaning(outcome.name).wanted, controllers(outcome)
    known = finite(outcome.values)
    if not wanted or not known.size or not 2 <= len(names) < len(SHADES):
        return None
    outcome = outcome.transpose(CONTROLLER, ...)
    level, ends = outcome.values, np.array([known.min(), known.max()])
    if wide(known):
        level, ends = np.log(level), np.log(ends)
    gains = np.where(np.isnan(level), -np.inf, wanted * level)
    second, first = np.sort(gains, axis=0)[-2:]
    runs = np.isfinite(first)
    lead = np.subtract(first, second, where=runs, out=np.zeros(runs.shape))
    number = np.where(lead > ALIKE * np.ptp(ends), 1.0 + gains.argmax(axis=0), 0.0)
    if not number.any():
        return None
    return outcome.isel({CONTROLLER: 0}, drop=True).copy(data=np.where(runs, number, np.nan))


def draw_categories(
    axes: Axes, edges: list[FloatArray], values: FloatArray, names: list[str]
) -> dict[str, Any]:
    """Colour whole numbers from 0; returns what is there, for the legend."""
    colours = ListedColormap(SHADES[: len(names)])
    cells = axes.pcolormesh(*edges, values, cmap=colours, vmin=-0.5, vmax=len(names) - 0.5)
    cells.set_rasterized(values.size > CELLS)
    look: dict[str, Any] = {"ec": "black", "lw": 0.6}
    there = [index for index in range(len(names)) if np.any(values == index)]
    return {names[i]: Patch(fc=SHADES[i], label=names[i], **look) for i in there}
