"""A law with a corner, sampled for a table once, whatever the table's grid is.

At a corner, whose place u* in the table's coordinate u depends on k_hat, a law is not smooth. On
both sides of it the law is smooth in

    p = sqrt(1 - u/u*) below the corner,    p = 1 - sqrt((1 - u)/(1 - u*)) beyond it,

because the half powers and logarithms at the corner, and the half powers of the tail, become powers
and logarithms of p of twice the order. At given p it is smooth in k_hat too. So Chebyshev series on
a few panels of both sides, and along a coordinate that is dense at small k_hat, approximate it
everywhere; the table's certificate, which compares with the law itself, covers their error.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray

DEGREE = 19
K_PANELS, BELOW, BEYOND = 4, 6, 4  # along sqrt(k_hat), and in u below and beyond the corner
LOWEST = 0.007  # sqrt(k_hat) from which on the series hold: above it laws have their corner

_PLACES = chebyshev.chebpts1(DEGREE + 1)
_TO_SERIES = np.linalg.inv(chebyshev.chebvander(_PLACES, DEGREE))


class CornerRow(NamedTuple):
    """The corner's place u* and a function at the nodes below and beyond it."""

    place: float
    below: FloatArray
    beyond: FloatArray


def _nodes(panels: int) -> FloatArray:
    return ((np.arange(panels)[:, np.newaxis] + 0.5 * (1.0 + _PLACES)) / panels).ravel()


def _cut(p: FloatArray, panels: int) -> tuple[NDArray[np.intp], FloatArray]:
    """Panel of each 0 <= p <= 1, and Chebyshev's polynomials there, (n,) and (n, DEGREE + 1)."""
    panel = np.minimum((panels * p).astype(np.intp), panels - 1)
    return panel, np.asarray(chebyshev.chebvander(2.0 * (panels * p - panel) - 1.0, DEGREE))


def nodes(place: float) -> tuple[FloatArray, FloatArray]:
    """Coordinates u of the nodes below and beyond a corner at u*."""
    return place * (1.0 - _nodes(BELOW) ** 2), 1.0 - (1.0 - place) * (1.0 - _nodes(BEYOND)) ** 2


def root_k_nodes(largest: float) -> FloatArray:
    """Where the rows are sampled: sqrt(k_hat), dense at small values."""
    return np.asarray(LOWEST + (largest - LOWEST) * _nodes(K_PANELS) ** 2)


class CornerSamples:
    """A function of u and sqrt(k_hat) from its rows at `root_k_nodes`."""

    def __init__(self, rows: list[CornerRow], largest: float) -> None:
        self._rows = np.array([np.concatenate([[r.place], r.below, r.beyond]) for r in rows])
        self._cuts, self._largest = (1, 1 + rows[0].below.size), largest

    def at(self, root_k: float) -> CornerRow:
        """The row at one sqrt(k_hat), from `LOWEST` on."""
        part = np.array([(root_k - LOWEST) / (self._largest - LOWEST)])
        panel, basis = _cut(np.sqrt(part), K_PANELS)
        rows = self._rows.reshape(K_PANELS, DEGREE + 1, -1)[panel[0]]
        place, below, beyond = np.split(basis[0] @ _TO_SERIES @ rows, self._cuts)
        return CornerRow(float(place[0]), below, beyond)


def value(row: CornerRow, u: FloatArray) -> FloatArray:
    """The function at coordinates 0 <= u < 1 of a row."""
    found = np.empty_like(u)
    before = u < row.place
    sides = (
        (before, np.sqrt(1.0 - u[before] / row.place), row.below, BELOW),
        (~before, 1.0 - np.sqrt((1.0 - u[~before]) / (1.0 - row.place)), row.beyond, BEYOND),
    )
    for here, p, values, panels in sides:
        panel, basis = _cut(p, panels)
        series = _TO_SERIES @ values.reshape(panels, -1).T
        found[here] = (basis * series.T[panel]).sum(axis=1)
    return found
