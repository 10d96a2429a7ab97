"""Load torque of a drive from its wheel speed and its own torque.

From J domega/dt = T - r Q, with derivative and torque under one and the same first-order filter,
    r Q_filtered = T_filtered - (J/r) d(r omega)_filtered/dt,
the disturbance observer of K. Ohishi, K. Nakano, I. Miyashita and S. Yasukawa, "Anti-slip control
of electric motor coach based on disturbance observer", 5th International Workshop on Advanced
Motion Control, 1998. The torque that meets a measured speed is that of `delay` before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib.parameters import FloatArray, Parameters, Quantity
from contactlib.traction.sensors import Sensors


class Observed(NamedTuple):
    """State of the observer.

    Attributes
    ----------
    sent : tuple of ndarray
        Torques that were sent and whose effect is not measured yet, oldest first [N.m].
    motor_torque, torque : ndarray
        What the motor made of them, and that filtered [N.m].
    wheel_speed, slip : ndarray
        Filtered [m/s]; the slip in the demand's direction.
    """

    sent: tuple[FloatArray, ...]
    motor_torque: FloatArray
    torque: FloatArray
    wheel_speed: FloatArray
    slip: FloatArray


@dataclass(frozen=True, kw_only=True)
class LoadObserver(Parameters):
    """What the observer knows of the drive.

    Parameters
    ----------
    sample_time : float
        [s].
    radius, inertia : float
        Of the wheelset with its drive [m, kg.m2].
    delay, motor_lag : float
        Of the sensors, in whole samples, and of the motor [s].
    filter_time : float
        Time constant [s].
    """

    sample_time: Annotated[float, Quantity("s", above=0.0)]
    radius: Annotated[float, Quantity("m", above=0.0)]
    inertia: Annotated[float, Quantity("kg.m2", above=0.0)]
    delay: Annotated[float, Quantity("s", at_least=0.0)]
    motor_lag: Annotated[float, Quantity("s", at_least=0.0)]
    filter_time: Annotated[float, Quantity("s", above=0.0)]

    @cached_property
    def delayed_samples(self) -> int:
        """Delay in samples."""
        return Sensors(delay=self.delay).samples_of_delay(self.sample_time)

    @cached_property
    def gains(self) -> tuple[float, float]:
        """Per sample: of the filter, of the motor."""
        lag = self.motor_lag
        motor = -math.expm1(-self.sample_time / lag) if lag > 0.0 else 1.0
        return -math.expm1(-self.sample_time / self.filter_time), motor

    def start(self, torque: ArrayLike, wheel_speed: FloatArray, slip: FloatArray) -> Observed:
        """State of a drive that has been giving `torque` [N.m] at a steady speed [m/s]."""
        steady = np.asarray(np.asarray(torque) + np.zeros_like(wheel_speed))
        line = (steady,) * (self.delayed_samples + 1)
        return Observed(line, steady, steady, np.array(wheel_speed), np.array(slip))

    def observe(
        self, last: Observed, wheel_speed: FloatArray, slip: FloatArray
    ) -> tuple[Observed, FloatArray, FloatArray]:
        """New state, and load torque [N.m] and slip [m/s] of the middle of the sample time.

        The derivative is that of the middle anyhow; with a slip of the same time, white noise of
        the wheel speed gives the two no covariance.
        """
        gain, motor = self.gains
        given = last.motor_torque + motor * (last.sent[0] - last.motor_torque)
        torque = last.torque + gain * (given - last.torque)
        change, slipped = gain * (wheel_speed - last.wheel_speed), gain * (slip - last.slip)
        load = torque - self.inertia / (self.radius * self.sample_time) * change
        new = Observed(last.sent, given, torque, last.wheel_speed + change, last.slip + slipped)
        return new, load, last.slip + 0.5 * slipped

    def send(self, observed: Observed, torque: FloatArray) -> Observed:
        """State with the torque [N.m] that is sent now."""
        return Observed((*observed.sent[1:], torque), *observed[1:])
