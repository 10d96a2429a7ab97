"""Estimate of the error of the measured creepage, while the wheel sticks.

A bias of the vehicle speed and a wrong wheel diameter shift every measured creepage by their
difference d, often half a per cent, and the peak of the creep force is at about one per cent: a
controller cannot use the raw creepage. Under low torque T the wheel sticks on any rail, and its
creepage is c T with the compliance c of the sticking contact, so the forward slip speed gives d:

    r omega - V = (d + c T sign V) |V|

A Kalman filter with one state estimates d from such samples, and its variance determines when d has
to be measured again. If d is unknown when a controller has to limit the torque, the controller
removes the torque until d is known.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlib.base.elementwise import maximum, minimum, where
from contactlib.base.quantities import FloatArray

KNOWN = 6e-4  # standard deviation of the error at which it counts as known [1]
SHARE = 0.25  # standard deviation of the slip that counts as known / by noise
FORGOTTEN = 3.0  # times as much: the error is measured again
FORGETTING = 60.0  # time from known to forgotten [s]
MODEL = 5e-4  # standard deviation of what else shifts a sample [1]
SETTLING = 0.06  # time of calm slip before samples are used [s]
CALM = 2.0  # acceleration of the slip that counts as calm, above the noise [m/s2]
MAX_ERROR = 0.05  # maximum error that is accepted [1]


class CreepageBias(NamedTuple):
    """Estimated error of the measured creepage.

    Attributes
    ----------
    error, variance : ndarray
        Estimate, and its variance [1].
    slip : ndarray
        Forward slip speed as last measured [m/s].
    calm : ndarray
        Time for which the wheel has stuck [s].
    looking : ndarray of bool
        Whether the torque is taken away to learn the error.
    """

    error: FloatArray
    variance: FloatArray
    slip: FloatArray
    calm: FloatArray
    looking: NDArray[np.bool_]


def start_creepage_bias(slip: FloatArray, uncertainty: Any) -> CreepageBias:
    """Estimate of zero with a standard deviation `uncertainty` [1], at a slip speed [m/s]."""
    none = 0.0 * slip
    return CreepageBias(none, none + uncertainty * uncertainty, slip, none, none > 0.0)


def learn(
    bias: CreepageBias,
    *,
    slip: FloatArray,
    vehicle_speed: FloatArray,
    scale: FloatArray,
    torque: FloatArray,
    limiting: NDArray[np.bool_],
    sample_time: Any,
    noise: Any,
    stick_torque: Any,
    stick_compliance: Any,
) -> CreepageBias:
    """Estimate with one more sample.

    Parameters
    ----------
    bias : CreepageBias
        Estimate so far.
    slip, vehicle_speed, scale : ndarray
        Measured forward slip speed, vehicle speed and reference speed of the creepage [m/s].
    torque : ndarray
        Torque since the last sample, forward [N.m].
    limiting : ndarray of bool
        Whether the torque is limited so much that the error matters.
    sample_time, noise : ndarray
        Sample time [s], and standard deviation of the slip by noise [m/s].
    stick_torque, stick_compliance : ndarray
        Torque up to which the wheel sticks [N.m], and creepage / torque then [1/(N.m)].
    """
    sticks = abs(torque) <= stick_torque * (1.0 + 1e-9)
    sticks = sticks & (abs(slip - bias.slip) <= CALM * sample_time + 5.0 * noise)
    calm = where(sticks, bias.calm + sample_time, 0.0)
    grown = (FORGOTTEN * FORGOTTEN - 1.0) * KNOWN * KNOWN / FORGETTING * sample_time
    variance = bias.variance + grown * (bias.variance > 0.0)
    # Kalman's filter, with the vehicle speed as the factor from the state to what is measured; near
    # standstill that is noise, and the error does not matter.
    spread = noise * noise + MODEL * MODEL * scale * scale
    speed = where(2.0 * abs(vehicle_speed) < scale, 0.0, vehicle_speed)
    gain = variance * speed / (variance * speed * speed + spread) * (calm > SETTLING)
    surprise = slip - stick_compliance * torque * abs(speed) - bias.error * speed
    error = minimum(maximum(bias.error + gain * surprise, -MAX_ERROR), MAX_ERROR)
    variance = variance * (1.0 - gain * speed)

    left = variance * speed * speed
    enough = maximum(KNOWN * scale, SHARE * noise) ** 2
    looking = where(bias.looking, left > enough, left > FORGOTTEN * FORGOTTEN * enough)
    return CreepageBias(error, variance, slip, calm, looking & limiting)
