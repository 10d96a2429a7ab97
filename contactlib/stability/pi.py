"""PI creep control of the reduced plant g/(s - p), whose actuator lags.

From the drive torque to the creepage a wheelset is g/(s - p) but for what the vehicle's speed
does slowly, with g = r/(J V) and p the fast pole.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib.parameters import FINITE, checked, checked_number, common_shape
from contactlib.stability import ranges
from contactlib.stability.threshold import fast_pole
from contactlib.wheelset import CONTACT, Wheelset, checked_conditions


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
    inputs = checked_conditions(
        wheelset, speed=speed, normal_load=normal_load, friction_scale=friction_scale
    )
    zeta = checked_number("creepage", creepage, FINITE)
    pole = fast_pole(wheelset, zeta, **{name: inputs[name] for name in CONTACT})
    return ReducedPlant(float(pole), wheelset.radius / (wheelset.inertia * inputs["speed"]))


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
    p, kp = (
        checked(name, value, ranges.REAL)
        for name, value in (("pole", pole), ("proportional", proportional))
    )
    g, ki = checked("gain", gain, ranges.POSITIVE), checked("integral", integral, ranges.REAL)
    tau = checked("lag", lag, ranges.NOT_NEGATIVE)
    common_shape({"pole": p, "gain": g, "proportional": kp, "integral": ki, "lag": tau})
    room = (1.0 - p * tau) * (g * kp - p) > tau * g * ki
    return np.asarray((p * tau < 1.0) & (g * kp > p) & (ki >= 0.0) & room)
