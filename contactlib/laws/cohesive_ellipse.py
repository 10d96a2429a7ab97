"""Elliptic contact with a cohesive zone: the sum of the strips of `laws.cohesive_line`.

A strip of relative half-width w is a line contact with x/w and k_hat/w. At given states the curves
of line contacts are smooth in k_hat. So panels of curves, each from one power of e to the next,
give the curve of any strip of any ellipse by interpolation. Gauss's rule sums the strips, over
parts that end where a panel ends and at the strip that just begins to slip entirely, where the
law's second derivative is not continuous.

At small k_hat the layers of the Carter-Griffith law are too thin for that. There the strips of this
law, whose sum `laws.strips` computes, are subtracted, and the rest is smooth and small.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss

from contactlib.base.quantities import FloatArray
from contactlib.laws.cohesive_line import SlipCurve, State, find_points
from contactlib.laws.friction import Weakening
from contactlib.laws.strips import griffith_ellipse, line_values, solve_split

LOWEST, HIGHEST = -10, 5  # powers of e at which the first and the last panel begin
LIMIT_UP_TO = 0  # power of e up to which the Carter-Griffith law is subtracted
MIN_K_HAT = float(np.exp(LOWEST))  # below it the limit's ellipse differs by less than 2e-9
# Curves of a panel and their accuracy. From a k_hat of e on only strips narrower than 2/k_hat need
# them, whose share of the force is k_hat**-4; the last panel extends to infinity.
CURVES = {-3: 12, -2: 12, -1: 14, 0: 14, 1: 14, 2: 12, 3: 10, 4: 8, 5: 8}
FEWEST_CURVES = 8


def _tolerance(power: int) -> float:
    if power < -3:  # the Carter-Griffith law is subtracted, and the rest is small
        return 1e-9
    return 1e-11 * float(np.exp(4.0 * max(0, power)))


def _gauss(wide: float) -> int:
    """Number of nodes in a part of the strips up to the half-width `wide`."""
    return 20 if wide > 0.35 else 12 if wide > 0.1 else 6 if wide > 0.03 else 2


class _Panel(NamedTuple):
    """Curves from k_hat = e**power on, which have the same panels in creepage."""

    power: int
    to_series: FloatArray  # from values at the curves' k_hats to Chebyshev series, (n, n)
    shape: SlipCurve  # the first curve, whose panels all curves have
    coefficients: FloatArray  # (p, n, 2 (DEGREE + 1))
    borders: FloatArray  # creepages between the panels, (n, p - 1)
    sliding: FloatArray  # creepage at which full slip begins, (n,)

    def basis(self, k_hat: FloatArray) -> FloatArray:
        """Value of each curve's interpolation polynomial at k_hats, (..., n)."""
        place = _place(self.power, k_hat)
        return np.asarray(chebyshev.chebvander(place, len(self.to_series) - 1) @ self.to_series)

    def at(self, x: FloatArray, k_hat: FloatArray) -> State:
        """Points of the curves at `k_hat` and creepages x > 0, (m,)."""
        basis = self.basis(k_hat)
        zero, infinity = np.zeros((x.size, 1)), np.full((x.size, 1), np.inf)
        ends = np.hstack([zero, basis @ self.borders, infinity])
        panel = (x[:, np.newaxis] >= ends[:, 1:-1]).sum(axis=1)
        series = np.empty((self.coefficients.shape[2], x.size))
        for i in np.unique(panel):
            here = panel == i
            series[:, here] = self.coefficients[i].T @ basis[here].T
        row = np.arange(x.size)
        return find_points(
            self.shape.kind[panel],
            self.shape.low[panel],
            self.shape.high[panel],
            series.reshape(-1, 2, x.size),
            (ends[row, panel], ends[row, panel + 1]),
            x,
        )


def _place(power: int, k_hat: FloatArray) -> FloatArray:
    """Coordinate of a k_hat in its panel, in [-1, 1]."""
    if power == HIGHEST:
        return np.asarray(2.0 * np.exp(HIGHEST) / k_hat - 1.0)
    return np.asarray(2.0 * (np.log(k_hat) - power) - 1.0)


_panels: dict[tuple[int, float, Weakening], _Panel] = {}
_locks: defaultdict[tuple[int, float, Weakening], Lock] = defaultdict(Lock)


def _panel(power: int, static_to_kinetic: float, weakening: Weakening) -> _Panel:
    """A panel, solved once; other threads that need it wait."""
    key = (power, static_to_kinetic, weakening)
    with _locks[key]:
        if key not in _panels:
            _panels[key] = _solve_panel(*key)
    return _panels[key]


def _solve_panel(power: int, static_to_kinetic: float, weakening: Weakening) -> _Panel:
    n = CURVES.get(power, FEWEST_CURVES)
    places = chebyshev.chebpts1(n)
    last = power == HIGHEST
    k_hats = np.exp(power) * (2.0 / (1.0 + places) if last else np.exp(0.5 * (1.0 + places)))
    curves = SlipCurve.solve(k_hats, static_to_kinetic, weakening, _tolerance(power))
    coefficients = np.stack([c.coefficients.reshape(len(c.kind), -1) for c in curves], axis=1)
    return _Panel(
        power,
        np.asarray(np.linalg.inv(chebyshev.chebvander(places, n - 1)), dtype=np.float64),
        curves[0],
        coefficients,
        np.array([curve.borders() for curve in curves]),
        np.array([curve.sliding_creepage for curve in curves]),
    )


def cohesive_ellipse(
    x: FloatArray, k_hat: float, static_to_kinetic: float, weakening: Weakening
) -> tuple[FloatArray, FloatArray]:
    """Traction ratio and slope of an ellipse at creepages x > 0, (n,).

    `k_hat` is at least `MIN_K_HAT`.
    """
    ratio, slope = np.zeros_like(x), np.zeros_like(x)
    inner = k_hat / np.exp(LIMIT_UP_TO)  # half-width of the narrowest strip that is subtracted
    if inner < 1.0:
        middle, rim = solve_split(x, k_hat), solve_split(x / inner, np.exp(LIMIT_UP_TO))
        ratio, slope = griffith_ellipse(x, k_hat, middle, (inner, rim))
    for power in range(max(LOWEST, int(np.floor(np.log(k_hat)))), HIGHEST + 1):
        panel = _panel(power, static_to_kinetic, weakening)
        narrow = 0.0 if power == HIGHEST else k_hat / np.exp(power + 1)
        wide = min(1.0, k_hat / np.exp(power))
        border = np.arccos(_last_to_stick(x, k_hat, panel, narrow, wide))
        ends = (np.full_like(x, np.arccos(wide)), border, np.full_like(x, np.arccos(narrow)))
        for low, high in pairwise(ends):
            part = np.flatnonzero(high - low > 1e-12)
            if not part.size:
                continue
            place, weight = leggauss(_gauss(wide))
            half = 0.5 * (high - low)[part, np.newaxis]
            w = np.cos(low[part, np.newaxis] + half * (1.0 + place))  # w = cos(angle)
            strip_x, strip_k = (x[part, np.newaxis] / w).ravel(), (k_hat / w).ravel()
            state = panel.at(strip_x, strip_k)
            value, rise = state.traction_ratio, state.slope
            if power < LIMIT_UP_TO:
                limit = line_values(solve_split(strip_x, strip_k))
                value, rise = value - limit[0], rise - limit[1]
            share = 1.5 * half * weight * w * w
            ratio[part] += np.sum(share * w * value.reshape(w.shape), axis=1)  # as in Eq. (24)
            slope[part] += np.sum(share * rise.reshape(w.shape), axis=1)
    return ratio, slope


def _last_to_stick(
    x: FloatArray, k_hat: float, panel: _Panel, narrow: float, wide: float
) -> FloatArray:
    """Half-width of the narrowest strip of a panel with any stick, by bisection."""
    low, high = np.full_like(x, narrow), np.full_like(x, wide)
    for _ in range(24):
        w = 0.5 * (low + high)
        sticks = panel.basis(k_hat / w) @ panel.sliding * w > x
        low, high = np.where(sticks, low, w), np.where(sticks, w, high)
    # If one of the bounds has not moved, the panel's end is not a border of stick.
    return np.where(low == narrow, narrow, high)
