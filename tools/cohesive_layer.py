"""The cohesive law with a layer, from a state of `laws.cohesive_layer` for each strip: a reference.

It takes 0.1 s for a creepage of a line contact, and some seconds for one of an ellipse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray, Quantity
from contactlib.laws import layer
from contactlib.laws.cohesive import MAX_X, Along, CohesiveZone
from contactlib.laws.cohesive_layer import FINE, Zones
from contactlib.laws.cohesive_layer import solve_zones as states_at
from contactlib.laws.cohesive_zone import weakening_length
from contactlib.laws.friction import Weakening
from contactlib.laws.strips import split_at

STEP = 1e-3  # in ln t, for slopes


def solve_zones(
    log_t: float, k_hat: float, lam: float, static_to_kinetic: float, weakening: Weakening
) -> Zones:
    """State of a line contact at a stick boundary."""
    return states_at(log_t, np.array([k_hat]), lam, static_to_kinetic, weakening)[0]


def along_zones(
    position: FloatArray,
    log_t: float,
    k_hat: float,
    lam: float,
    static_to_kinetic: float,
    weakening: Weakening,
) -> Along:
    """Traction and slip at places xi/a of a contact, (n,)."""
    grid = layer.panels(*FINE.grid)
    state = solve_zones(log_t, k_hat, lam, static_to_kinetic, weakening)
    m, s, _ = (float(v) for v in split_at(np.exp(log_t), 0.0))
    ahead, behind = position - (m - s), (m - s) - position
    sticks, slips = (ahead >= 0.0) & (position <= 1.0), (behind > 0.0) & (position >= -1.0)
    along = np.zeros((3, position.size))
    along[0, sticks] = layer.between_nodes(
        state.stuck, ahead[sticks] / (2.0 * s), (1.0 - position[sticks]) / (2.0 * s), grid
    )
    place = behind[slips] / (2.0 * m), (1.0 + position[slips]) / (2.0 * m)
    slip = np.maximum(layer.between_nodes(state.slip, *place, grid), 0.0)
    pressure = np.sqrt((1.0 - position[slips]) * (1.0 + position[slips]))
    along[0, slips] = pressure * (1.0 + (static_to_kinetic - 1.0) * weakening.fraction(slip))
    length = float(weakening_length(np.array(k_hat), static_to_kinetic))
    along[1, slips] = layer.between_nodes(state.slip, *place, grid, 1) * length / (2.0 * m)
    along[2, slips] = slip
    return Along(*along)


@dataclass(frozen=True, kw_only=True)
class CohesiveZoneWithLayer(CohesiveZone):
    """The law of `CohesiveZone` with a layer of ``layer_ratio`` lam = L E*/(2 a) [1].

    Raises
    ------
    ConvergenceError
        On use, if a state has no solution that the iteration finds, or a layer would snap inside
        the slip zone, which the exponential never causes.
    """

    layer_ratio: Annotated[float, Quantity("1", at_least=1e-7, at_most=100.0)]

    _limit = None
    sliding_creepage = np.inf  # some stick always remains
    carter_at_zero = False
    corner = None

    def _zones(self, log_t: float, w: float = 1.0) -> Zones:
        of_strip = self.k_hat / w, self.layer_ratio / w
        return solve_zones(log_t, *of_strip, self.static_to_kinetic, self.weakening)

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self.contact == "elliptic":
            return layer.ellipse_with_layer(x, self.k_hat, self.layer_ratio, self._strips)
        return self._strips(x, np.array(self.k_hat), np.array(self.layer_ratio))

    def _strips(
        self, x: FloatArray, k_hat: FloatArray, lam: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Values of strips at their own creepages."""
        ratio, slope = np.zeros(x.shape), np.empty(x.shape)
        widths = np.broadcast_to(self.layer_ratio / lam, x.shape)
        for i, size in np.ndenumerate(x):
            w = float(widths[i])
            if size == 0.0:
                slope[i] = 2.0 * layer.full_stick(np.array(0.5 * self.layer_ratio / w))[0]
                continue
            log_t = self._log_t(size * w, w)
            low, at, high = (self._zones(log_t + step, w) for step in (-STEP, 0.0, STEP))
            ratio[i] = at.ratio
            slope[i] = (high.ratio - low.ratio) / (high.creepage - low.creepage)
        return ratio, slope

    def _log_t(self, x: float, w: float) -> float:
        """State of a strip of relative half-width w, ln t of `laws.layer`."""
        size, of_limit = min(abs(x), MAX_X) / w, (self.k_hat / w, self.layer_ratio / w)

        def beyond(log_t: float) -> float:
            return float(np.log(self._zones(log_t, w).creepage / size))

        low = high = float(layer.solve_layer(np.array([size]), *of_limit)[0])
        while beyond(low) > 0.0:
            low -= 0.3
        while beyond(high) < 0.0:
            high += 0.3
        return float(brentq(beyond, low, high, xtol=1e-11)) if low < high else low

    def _stick_length(self, x: FloatArray, w: FloatArray) -> FloatArray:
        pairs = zip(x.flat, w.flat, strict=True)
        log_t = np.array([self._log_t(*pair) for pair in pairs])
        return (2.0 * split_at(np.exp(log_t), 0.0).s).reshape(x.shape)

    def _along_strip(self, position: FloatArray, x: float, w: float) -> Along:
        log_t, ratio = self._log_t(x, w), self.static_to_kinetic
        lam = self.layer_ratio / w
        return along_zones(position, log_t, self.k_hat / w, lam, ratio, self.weakening)
