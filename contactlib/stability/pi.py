"""PI creep control of the reduced plant g/(s - p), whose actuator lags.

From the drive torque to the creepage a wheelset is g/(s - p) but for what the vehicle's speed
does slowly, with g = r/(J V) and p the fast pole.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib.parameters import FINITE, Limits, checked
from contactlib.stability.threshold import fast_pole
from contactlib.wheelset import Wheelset


class ReducedPlant(NamedTuple):
    """Creepage over drive torque, g/(s - p), about an operating point.

    Attributes
    ----------
    pole, gain : float
        p [1/s] and g [1/(N.m.s)].
    """

    pole: float
    gain: float


def reduced_plant(
    wheelset: Wheelset,
    creepage: float,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
) -> ReducedPlant:
    """Fast pole at an operating point, and g = r/(J V). Exact for a held speed."""
    pole = fast_pole(
        wheelset, creepage, speed=speed, normal_load=normal_load, friction_scale=friction_scale
    )
    return ReducedPlant(float(pole), wheelset.radius / (wheelset.inertia * speed))


def pi_stable(
    pole: ArrayLike,
    gain: ArrayLike,
    proportional: ArrayLike,
    integral: ArrayLike = 0.0,
    lag: ArrayLike = 0.0,
) -> NDArray[np.bool_]:
    """Whether Kp + Ki/s with a first-order lag tau holds the plant g/(s - p); all broadcast.

    The characteristic polynomial is tau s**3 + (1 - p tau) s**2 + (g Kp - p) s + g Ki, so by
    Routh it takes p tau < 1, g Kp > p and 0 < g Ki < (1 - p tau)(g Kp - p)/tau. Without integral
    action the last condition is void.

    Parameters
    ----------
    pole, gain : array_like
        p [1/s], g [1/(N.m.s)], the latter above zero.
    proportional, integral : array_like
        Kp [N.m], Ki [N.m/s]; without a minus sign they drive the creepage to its reference.
    lag : array_like
        tau [s].

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    p, kp = checked("pole", pole, FINITE), checked("proportional", proportional, FINITE)
    g, ki = checked("gain", gain, Limits(above=0.0)), checked("integral", integral, FINITE)
    tau = checked("lag", lag, Limits(at_least=0.0))
    room = (1.0 - p * tau) * (g * kp - p) > tau * g * ki
    return np.asarray((p * tau < 1.0) & (g * kp > p) & (ki >= 0.0) & room)
