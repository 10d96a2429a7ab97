"""Sand on the rails of vehicles: where sanders lay it, and what the axles find."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contactlib import kernel
from contactlib.base.elementwise import Numbers
from contactlib.base.quantities import FloatArray
from contactlib.vehicle.drivetrain import Sanding

NODE = kernel.NODE_DISTANCE  # of nodes between which the part of sand is linear [m]
NO_SANDER = (
    "a controller commands sand, and the scenario has no sanding.by = 'controller': add [sanding]"
)


class Delayed:
    """Dead times [s] of n numbers, in whole samples [s]; `first` has been sent so far."""

    def __init__(self, delays: Sequence[float], sample_time: float, first: FloatArray) -> None:
        self._late = np.array([round(delay / sample_time) for delay in delays])
        self._places = np.arange(len(delays))
        self._sent = np.tile(first, (self._late.max() + 1, 1))
        self._samples = 0

    def __call__(self, sent: FloatArray) -> FloatArray:
        """What arrives until the next sample, of what is sent now."""
        size = len(self._sent)
        self._sent[self._samples % size] = sent
        arrived = self._sent[(self._samples - self._late) % size, self._places]
        self._samples += 1
        return np.asarray(arrived)


class Sanders:
    """Sanders of the axles of vehicles, and what they leave on the rails of each.

    Parameters
    ----------
    sandings : sequence of Sanding or None
        Those of each axle.
    axle : ndarray
        Number of each axle in its vehicle, from 1.
    sample_time : float
        Sample time [s].
    distance : ndarray
        Places of the axles at the start [m].
    """

    def __init__(
        self,
        sandings: Sequence[Sanding | None],
        axle: NDArray[np.intp],
        sample_time: float,
        distance: FloatArray,
    ) -> None:
        pairs = zip(sandings, axle, strict=True)
        self._has = np.array([s is not None and (not s.axles or i in s.axles) for s, i in pairs])
        given = [sanding or Sanding(friction=1.0) for sanding in sandings]
        limits = [(s.above, np.inf if s.below is None else s.below, s.rate) for s in given]
        self._above, self._below, self._rate = np.array(limits).T
        self._commanded = np.array([s.by == "controller" for s in given])
        self._delayed = Delayed([s.delay for s in given], sample_time, np.zeros(axle.size))
        self._part, self._last = np.zeros(axle.size), distance
        self._vehicle = np.cumsum(axle == 1) - 1
        rails = self._vehicle[-1] + 1, kernel.rail_nodes(float(np.ptp(distance)))
        self._there = np.zeros(rails)  # parts of sand in a ring of nodes
        self._number = np.full(rails, np.iinfo(np.int64).min)  # of each node

    def command(self, sand: Numbers, speed: FloatArray) -> None:
        """Let the sanders lay parts of all sand after their delay.

        Raises
        ------
        ValueError
            If a controller commands a sander that it does not have.
        """
        if np.any((sand != 0.0) & ~self._commanded):
            raise ValueError(NO_SANDER)
        moving = (np.abs(speed) >= self._above) & (np.abs(speed) <= self._below)
        self._part = self._delayed(np.where(self._commanded, sand, 1.0) * (self._has & moving))

    def meet(self, distance: FloatArray) -> FloatArray:
        """Lay sand on the way to these places [m]; the part of it that axles find there."""
        lays, size = np.flatnonzero(self._part), self._there.shape[1]
        both = np.stack([self._last, distance])[:, lays] / NODE
        last = np.ceil(both.max(axis=0)).astype(np.int64)
        first = np.maximum(np.floor(both.min(axis=0)).astype(np.int64), last - size + 1)
        for k in range(int((last - first).max(initial=-1)) + 1):
            node = np.minimum(first + k, last)
            place = self._vehicle[lays], node % size
            self._there[place] = np.maximum(self._at(node, lays), self._part[lays])
            self._number[place] = node
        self._last = distance.copy()
        low, every = np.floor(distance / NODE).astype(np.int64), np.arange(distance.size)
        behind, ahead = self._at(low, every), self._at(low + 1, every)
        return np.asarray(behind + (distance / NODE - low) * (ahead - behind))

    def _at(self, node: NDArray[np.int64], axle: NDArray[np.intp]) -> FloatArray:
        """Parts of sand at nodes of axles' rails."""
        place = self._vehicle[axle], node % self._there.shape[1]
        return np.where(self._number[place] == node, self._there[place], 0.0)

    @property
    def rate(self) -> FloatArray:
        """Sand that each axle lays now [kg/s]."""
        return np.asarray(self._rate * self._part)
