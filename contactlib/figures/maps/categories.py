"""Maps of what is no number: which controller does best, whether a demand is held."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from contactlib.figures.maps.layout import CONTROLLER, controllers
from contactlib.figures.maps.meaning import meaning
from contactlib.parameters import FloatArray

if TYPE_CHECKING:
    from xarray import DataArray

ALIKE = 0.02  # difference of the best two that does not count, over the larger of them
# From light to dark, so that they differ in grey.
SHADES = ("white", "#F0E442", "#56B4E9", "#D55E00", "#004B70", "black")


def best(outcome: DataArray) -> DataArray | None:
    """Number of the controller that does best, from 1; 0 if the best two are alike, nan if none.

    None for an outcome of which it cannot be said, or of one controller.
    """
    wanted, names = meaning(outcome.name).wanted, controllers(outcome)
    if not wanted or not 2 <= len(names) < len(SHADES):
        return None
    gains = (wanted * outcome).fillna(-np.inf).transpose(CONTROLLER, ...)
    ordered = np.sort(gains.values, axis=0)
    runs = np.isfinite(ordered[-1])
    lead = np.subtract(ordered[-1], ordered[-2], where=runs, out=np.zeros(runs.shape))
    size = np.abs(np.where(np.isfinite(ordered[-2:]), ordered[-2:], 0.0)).max(axis=0)
    first = np.where(lead > ALIKE * size, 1.0 + gains.values.argmax(axis=0), 0.0)
    return gains.isel({CONTROLLER: 0}, drop=True).copy(data=np.where(runs, first, np.nan))


def draw_categories(
    axes: Axes, edges: list[FloatArray], values: FloatArray, names: list[str]
) -> dict[str, Any]:
    """Colour whole numbers from 0; returns what is there, for the legend."""
    colours = ListedColormap(SHADES[: len(names)])
    axes.pcolormesh(*edges, values, cmap=colours, vmin=-0.5, vmax=len(names) - 0.5)
    look: dict[str, Any] = {"ec": "black", "lw": 0.6}
    there = [index for index in range(len(names)) if np.any(values == index)]
    return {names[i]: Patch(fc=SHADES[i], label=names[i], **look) for i in there}
