"""Which controller does best where."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from contactlib.figures.maps.layout import CONTROLLER, controllers
from contactlib.figures.maps.words import finite
from contactlib.figures.scenario import run_name
from contactlib.parameters import FloatArray

if TYPE_CHECKING:
    from xarray import DataArray

# What one wants of an outcome: much (1) or little (-1). Of others no controller is the best.
WANTED = {
    "adhesion_utilisation": 1,
    "distance": 1,
    "slip_work": -1,
    "slip_share": -1,
    "largest_creepage": -1,
    "largest_slip_speed": -1,
    "recovery_time": -1,
    "jerk": -1,
    "torsional_peak": -1,
}
ALIKE = 0.02  # difference that does not count, over the range of all values
# From light to dark, so that they differ in grey, and colours of one family apart.
SHADES = ("#F0E442", "#56B4E9", "#D55E00", "#004B70", "#000000")
NOBODY = "#FFFFFF"


def best(array: DataArray) -> DataArray | None:
    """Index of the controller that does best; -1 where the best two are alike, nan if none runs.

    None for an outcome of which it cannot be said, or of one controller.
    """
    names = controllers(array)
    if not 2 <= len(names) <= len(SHADES) or array.name not in WANTED:
        return None
    gains = WANTED[str(array.name)] * array
    gains = gains.fillna(-np.inf).transpose(CONTROLLER, ...)
    ordered = np.sort(gains.values, axis=0)
    close = ALIKE * np.ptp(finite(array.values)) if finite(array.values).size else 0.0
    with np.errstate(invalid="ignore"):
        alike = ~(ordered[-1] - ordered[-2] > close)
    first: FloatArray = np.where(alike, -1.0, gains.values.argmax(axis=0))
    first[~np.isfinite(ordered[-1])] = np.nan
    return gains.isel({CONTROLLER: 0}, drop=True).copy(data=first)


def draw_best(
    axes: Axes, edges: list[FloatArray], first: FloatArray, names: list[str]
) -> dict[str, Any]:
    """Colour each point by the best controller there; returns what the colours mean."""
    colours = ListedColormap([NOBODY, *SHADES[: len(names)]])
    axes.pcolormesh(*edges, first, cmap=colours, vmin=-1.5, vmax=len(names) - 0.5)
    axes.set_title("best controller", loc="left", fontsize=10)
    texts = ["alike", *(run_name(name) for name in names)]
    handles: dict[str, Any] = {}
    for index, text in enumerate(texts):
        if np.any(first == index - 1):
            look: dict[str, Any] = {"fc": colours(index), "ec": "black", "lw": 0.6}
            handles[text] = Patch(label=text, **look)
    return handles
