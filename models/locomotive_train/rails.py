"""Friction under each wheel: of the track, and what the axles in front have made of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

import contactlib as cl
from contactlib.base.quantities import FloatArray, Parameters, Quantity

from .vehicle import AXLES

CELL = 0.1  # length of rail with one friction [m]
DRY = cl.Profile.of(1.0)


@dataclass(frozen=True, kw_only=True)
class Rails(Parameters):
    """Friction scale over distance, and its recovery by the slip work of the axles.

    A wheel that slides on rails where the axles in front have done the work W per length finds the
    friction scale

        s + (recovered - s) (1 - exp(-cleaning W)),    s < recovered

    The form is that of Meli, Ridolfi & Rindi [1]_, who apply it to the sliding wheel, too;
    Voltr & Lata [2]_ measured such transitions. Here a wheel changes the rails for others only.

    Parameters
    ----------
    friction : Profile, optional
        Friction scale of both rails over distance [m], before the first axle [1].
    recovered : float, optional
        Friction scale that much slip work leaves [1].
    cleaning : float, optional
        Inverse of the slip work per length of one rail for 63 % of the recovery [m/J]. Default: no
        wheel changes the rails.

    References
    ----------
    .. [1] E. Meli, A. Ridolfi, A. Rindi, "An innovative degraded adhesion model for railway
       vehicles", Meccanica 49 (2014) 919-937.
    .. [2] P. Voltr, M. Lata, "Transient wheel-rail adhesion characteristics under the cleaning
       effect of sliding", Vehicle System Dynamics 53 (2015) 605-618.
    """

    friction: cl.Profile = DRY
    recovered: Annotated[float, Quantity("1", above=0.0)] = 1.0
    cleaning: Annotated[float | None, Quantity("m/J", at_least=0.0)] = None


class RailState:
    """Slip work on each cell of the rails by each axle.

    Parameters
    ----------
    rails : Rails
        The rails.
    distance : ndarray
        Distances of the axles at the start [m].
    reach : float
        Distance that no axle comes to [m].
    """

    def __init__(self, rails: Rails, distance: FloatArray, reach: float) -> None:
        self._rails, self._start = rails, float(distance.min()) - 1.0
        self._work = np.zeros((int((reach - self._start) / CELL) + 2, AXLES, 2))  # [J/m]
        self._last = self._cells(distance)
        self.cleans = rails.cleaning is not None

    def friction(self, distance: FloatArray) -> FloatArray:
        """Friction scale under each wheel at the axles' distances [m]."""
        scale = np.repeat(self._rails.friction(distance)[:, None], 2, axis=1)
        if self._rails.cleaning is None:
            return scale
        before = np.cumsum(self._work[self._cells(distance)], axis=1)
        done = np.stack([np.zeros(2), *(before[i, i - 1] for i in range(1, AXLES))])
        gain = np.maximum(self._rails.recovered - scale, 0.0)
        return np.asarray(scale - gain * np.expm1(-self._rails.cleaning * done))

    def slide(self, distance: FloatArray, work: FloatArray) -> None:
        """Note the slip work per length [J/m] of wheels that come to the axles' distances [m]."""
        if not self.cleans:
            return
        now = self._cells(distance)
        for axle, (last, cell) in enumerate(zip(self._last, now, strict=True)):
            self._work[last : cell + 1, axle] = work[axle]
        self._last = now

    def _cells(self, distance: FloatArray) -> FloatArray:
        return np.asarray((distance - self._start) / CELL, dtype=np.intp)
