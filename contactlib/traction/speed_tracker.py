"""Vehicle speed from noisy samples of it: a vehicle changes speed slowly, and noise does not.

Two-state tracking filter of speed and acceleration with both poles at one place, the critically
damped g-h filter (E. Brookner, Tracking and Kalman Filtering Made Easy, Wiley 1998). It follows a
constant acceleration without error, so it shifts no creepage on a train that pulls away.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contactlib.parameters import FloatArray


class Tracked(NamedTuple):
    """Speed [m/s], and its change from sample to sample [m/s]."""

    speed: FloatArray
    change: FloatArray


def tracker_gains(sample_time: float, filter_time: float) -> tuple[float, float]:
    """Gains g and h of poles at exp(-sample_time/filter_time); no filter for zero."""
    pole = math.exp(-sample_time / filter_time) if filter_time > 0.0 else 0.0
    return 1.0 - pole**2, (1.0 - pole) ** 2


def tracked_variance(sample_time: float, filter_time: float) -> float:
    """What is left of the variance of white noise, (1 - p)(1 + 4 p + 5 p^2)/(1 + p)^3 [1].

    p is the pole; Brookner's formula for a g-h filter, at the gains of `tracker_gains`.
    """
    p = math.exp(-sample_time / filter_time) if filter_time > 0.0 else 0.0
    return (1.0 - p) * (1.0 + 4.0 * p + 5.0 * p**2) / (1.0 + p) ** 3


def track(tracked: Tracked, measured: FloatArray, gains: tuple[float, float]) -> Tracked:
    """State after one more sample [m/s]."""
    expected = tracked.speed + tracked.change
    surprise = measured - expected
    return Tracked(expected + gains[0] * surprise, tracked.change + gains[1] * surprise)
