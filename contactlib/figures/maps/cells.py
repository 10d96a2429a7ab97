"""The cells of a map: where they end, and the marks of those that hold no number."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch
from numpy.typing import NDArray

from contactlib.figures.maps.layout import Case
from contactlib.figures.maps.meaning import Meaning
from contactlib.figures.maps.words import geometric
from contactlib.parameters import FloatArray

ZERO, NO_VALUE, FAILED = "#E4E4E4", "#C8C8C8", "#8A8A8A"


def cell_edges(centres: FloatArray) -> FloatArray:
    """Borders of the cells around the values of an axis."""
    if geometric(centres):
        return np.asarray(np.exp(cell_edges(np.log(centres))))
    middle = 0.5 * (centres[1:] + centres[:-1])
    ends = 2.0 * centres[[0, -1]] - middle[[0, -1]]
    return np.asarray(np.concatenate([ends[:1], middle, ends[1:]]))


def mark_cells(axes: Axes, edges: list[FloatArray], case: Case, means: Meaning) -> dict[str, Any]:
    """Hatch what is infinite, and grey what has no value or no run; returns what is there."""
    values = case.values
    zero = (values == 0.0) if means.zero else np.zeros(values.shape, bool)
    kinds = {
        means.infinite: (np.isinf(values), "white", "///"),
        means.zero: (zero, ZERO, "..."),
        means.missing: (np.isnan(values) & ~case.failed, NO_VALUE, ""),
        "failed": (case.failed, FAILED, "xxx"),
    }
    handles: dict[str, Any] = {}
    for name, (where, face, hatch) in kinds.items():
        if where.any():
            look: dict[str, Any] = {"fc": face, "ec": "black", "hatch": hatch, "lw": 0.0}
            axes.add_collection(PolyCollection(_bars(edges, where), **look), autolim=False)
            handles[name] = Patch(fc=face, ec="black", lw=0.6, hatch=hatch, label=name)
    return handles


def _bars(edges: list[FloatArray], where: NDArray[np.bool_]) -> list[FloatArray]:
    """Corners of each row's stretches of marked cells: far fewer than the cells."""
    x, y = edges
    bars = []
    for row, marked in enumerate(where):
        ends = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
        for start, stop in x[ends].reshape(-1, 2):
            low, high = y[row : row + 2]
            bars.append(np.array([[start, low], [stop, low], [stop, high], [start, high]]))
    return bars
