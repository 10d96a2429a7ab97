"""How the load torque grows with the creepage, from samples of both: d ln(rQ)/d ln(zeta).

It is one for a stiff contact and zero at the peak of the creep force, on any rail. Estimated is the
least-squares slope of load over creepage, both less their slow means, with exponential forgetting.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contactlib.parameters import FloatArray
from contactlib.traction.sensors import Sensors
from contactlib.traction.speed_tracker import tracked_variance

UNMOVED = 0.125  # share of the expected variance below which the creepage counts as not moved
DOUBT = 0.04  # weight of what that tells, as a share of the expected variance
FLOOR = 0.01  # share of the expected variance that gives no slope


class Moments(NamedTuple):
    """What is kept of the samples.

    Attributes
    ----------
    load, creepage : ndarray
        Slow means [N.m, 1].
    covariance, variance : ndarray
        Of load and creepage [N.m], and of the creepage [1].
    """

    load: FloatArray
    creepage: FloatArray
    covariance: FloatArray
    variance: FloatArray


def add_sample(
    moments: Moments,
    load: FloatArray,
    creepage: FloatArray,
    *,
    away: FloatArray,
    expected: FloatArray,
    gains: tuple[float, float],
) -> Moments:
    """Moments with one more sample.

    Parameters
    ----------
    moments : Moments
        So far.
    load, creepage : ndarray
        The sample [N.m, 1].
    away : ndarray
        Square of the distance from where the creepage should be [1].
    expected : ndarray
        Square of the movement that is meant to tell the slope [1]. Samples that are much further
        away are of a transient: they weigh less, or one of them would rule for seconds.
    gains : tuple of float
        Of the means and of the moments, per sample.
    """
    slow, forget = gains
    off_load, off_creepage = load - moments.load, creepage - moments.creepage
    squared = off_creepage * off_creepage
    weight = forget * expected / (expected + np.maximum(squared, away))
    keep = 1.0 - forget
    return Moments(
        moments.load + slow * off_load,
        moments.creepage + slow * off_creepage,
        keep * moments.covariance + weight * off_creepage * off_load,
        keep * moments.variance + weight * squared,
    )


def elasticity(
    moments: Moments, *, noise: FloatArray, expected: FloatArray, least_load: FloatArray
) -> FloatArray:
    """Estimate of d ln(rQ)/d ln(zeta), held within -1 and 1 [1].

    Noise of the creepage, of the given variance, would flatten the slope and is taken off. A
    creepage that does not move, although it should by the square root of `expected`, is that of
    a stiff contact: so the estimate then goes to one.
    """
    moved = np.maximum(moments.variance - noise, 0.0)
    stiff = DOUBT * np.maximum(expected - moved / UNMOVED, 0.0)
    rise = moments.covariance * moments.creepage / np.maximum(moments.load, least_load)
    estimate = (rise + stiff) / (moved + stiff + FLOOR * expected)
    return np.asarray(np.minimum(np.maximum(estimate, -1.0), 1.0))


def slip_noise(sensors: Sensors, sample_time: float, filter_time: float, gain: float) -> float:
    """Standard deviation that the sensors' noise gives the slip that is sampled here [m/s].

    A first-order filter of this gain leaves gain/(2 - gain) of white variance, the mean of two
    neighbours 1 - gain/2 of that; of what the tracking filter leaves the slow means take about
    half.
    """
    tracked = tracked_variance(sample_time, filter_time)
    return math.sqrt(
        0.5 * gain * sensors.wheel_speed_noise**2 + 0.5 * tracked * sensors.vehicle_speed_noise**2
    )
