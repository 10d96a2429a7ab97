"""Dynamic wheel load: a factor on the static load over time, given or random with a spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import (
    SEED,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
)
from contactlib.vehicle.track import TIME, Profile, Values, profile_of

WAVES = 100  # of a random load: their sum is nearly Gaussian
STREAM = 2**63  # of random numbers, which no run's sensors use
MOMENT = Limits(at_least=-1e12, at_most=1e12)


@dataclass(frozen=True, kw_only=True)
class DynamicLoad(Parameters):
    """Factor on the static load of both wheels: a history, or random with a power spectrum.

    Give `time` and `factor`, or `frequency` and `density`. A random factor is one plus a sum of 100
    cosines of equal variance, each with a random phase and a frequency drawn from its share of the
    spectrum, so it does not repeat. It depends on the seed alone. Negative values are set to zero:
    the wheel lifts off.

    Parameters
    ----------
    time : tuple of float, optional
        Breakpoints of the factor, as in a `Profile` [s].
    factor : tuple of float, optional
        Factor at these [1].
    frequency : tuple of float, optional
        Breakpoints of the spectrum, linear between and zero outside [Hz].
    density : tuple of float, optional
        One-sided power spectral density of the factor at these [1/Hz]. Its integral over the
        frequency is the factor's variance.
    seed : float, optional
        Seed of the random phases and frequencies. Default: 0.

    Raises
    ------
    ValueError
        If a value is out of range, neither or both pairs are given, a pair's lengths differ, its
        places are not increasing, or the spectrum is zero.

    Examples
    --------
    >>> rough = DynamicLoad(frequency=(0.5, 2.0, 10.0), density=(0.01, 0.01, 0.0))
    >>> rough([0.0, 0.1, 0.2]).round(3).tolist()
    [0.782, 1.215, 1.238]
    """

    time: Annotated[Values, TIME] = ()
    factor: Annotated[Values, Quantity("1", at_least=0.0, usual=(0.0, 3.0))] = ()
    frequency: Annotated[Values, Quantity("Hz", at_least=0.0, at_most=1e4, usual=(0.0, 200.0))] = ()
    density: Annotated[Values, Quantity("1/Hz", at_least=0.0, at_most=1e4, usual=(0.0, 1.0))] = ()
    seed: Annotated[float, SEED] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        names = ("time", "factor", "frequency", "density")
        pair = tuple(name for name in names if getattr(self, name))
        if pair not in (names[:2], names[2:]):
            raise ValueError(
                "time and factor, or frequency and density: give exactly one of these pairs, not "
                f"{' and '.join(pair) or 'nothing'}"
            )
        profile_of(**{name: getattr(self, name) for name in pair})
        if self.frequency and not self._power[-1] > 0.0:
            raise ValueError(f"density = {self.density!r} must have a part above zero")

    @property
    def highest_frequency(self) -> float:
        """Upper end of the spectrum [Hz]; 0 for a history."""
        return max(self.frequency, default=0.0)

    @cached_property
    def _power(self) -> FloatArray:
        """Variance of the factor up to each frequency [1]."""
        mean = 0.5 * (np.array(self.density[1:]) + self.density[:-1])
        return np.concatenate([[0.0], np.cumsum(mean * np.diff(self.frequency))])

    @cached_property
    def _waves(self) -> tuple[FloatArray, FloatArray, float]:
        """Frequency [Hz] and phase [turns] of each cosine, and the amplitude of all [1]."""
        key = np.array([int(self.seed), STREAM], dtype=np.uint64)
        share, phase = np.random.Generator(np.random.Philox(key=key)).uniform(size=(2, WAVES))
        frequency, density, total = (
            np.array(self.frequency),
            np.array(self.density),
            self._power[-1],
        )
        below = total * (np.arange(WAVES) + share) / WAVES  # power below each wave's frequency
        below = np.minimum(below, np.nextafter(total, 0.0))
        i = np.searchsorted(self._power, below, side="right") - 1
        rest, rise = below - self._power[i], np.diff(density)[i] / np.diff(frequency)[i]
        # The power from f_i on is S_i x + rise x**2/2; this root of it has no cancellation.
        sum_of_roots = density[i] + np.sqrt(np.maximum(density[i] ** 2 + 2.0 * rise * rest, 0.0))
        beyond = np.divide(2.0 * rest, sum_of_roots, out=np.zeros(WAVES), where=sum_of_roots > 0.0)
        return frequency[i] + beyond, phase, math.sqrt(2.0 * total / WAVES)

    def __call__(self, time: ArrayLike) -> FloatArray:
        """Factors at any times [s]."""
        time = checked("time", time, MOMENT, copy=False)
        if self.time:
            return Profile(self.time, self.factor)(time)
        frequency, phase, amplitude = self._waves
        turns = np.multiply.outer(frequency, time)
        turns += phase.reshape(-1, *[1] * time.ndim)
        turns -= np.floor(turns)  # so that far times cost no accuracy of the cosine
        # Unlike a sum, a running one adds in the same order however many times there are.
        waves = np.cumsum(np.cos(2.0 * math.pi * turns), axis=0)[-1]
        factor = 1.0 + amplitude * waves
        return np.asarray(np.maximum(factor, 0.0))
