"""Creep control: the demand is limited by a PI controller of the creepage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import FloatArray, Quantity
from contactlib.traction.design import (
    fast_pole,
    peak_creepage,
    slip_gains,
    steepest_fall,
    total_delay,
)
from contactlib.traction.interface import Measurement, plausible
from contactlib.traction.limiter import LimiterMemory, SlipLimiter
from contactlib.traction.sensors import Sensors

BELOW_PEAK = 0.65  # of the nominal peak's creepage: what is left of the peak where friction halves


@dataclass(frozen=True, kw_only=True)
class CreepPI(SlipLimiter):
    """Limits the demand so that the creepage does not exceed a reference.

    Parameters
    ----------
    reference : float
        Creepage to hold [1]. One number cannot suit all friction: the peak's creepage is
        proportional to it.
    proportional_gain, integral_gain : float
        Kp, Ki on slip speed [N.s, N].
    sample_time : float, optional
        [s].
    low_speed : float, optional
        Below it the reference is a slip speed [m/s].
    speed_filter_time : float, optional
        Time constant of the filter on the vehicle speed [s].
    """

    reference: Annotated[float, Quantity("1", above=0.0)]

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Gains by `slip_gains` for the steepest fall or the reference, whichever is worse.

        Raises
        ------
        ValueError
            If the delay is too long for any gain to hold the reference on nominal friction.
        """
        wheelset, sample_time = drivetrain.wheelset, given.get("sample_time", cls.sample_time)
        reference = given.setdefault("reference", BELOW_PEAK * peak_creepage(wheelset, speed))
        delay = total_delay(drivetrain, sensors, sample_time)
        pole = fast_pole(wheelset, reference, speed)
        if pole * delay >= 1.0:
            raise ValueError(
                f"reference = {reference!r} cannot be held at {speed!r} m/s: its pole of "
                f"{pole:.4g} 1/s needs a delay below {1.0 / pole:.4g} s, but the loop has "
                f"{delay:.4g} s"
            )
        pole = max(pole, fast_pole(wheelset, steepest_fall(wheelset, speed), speed))
        gains = slip_gains(drivetrain, pole=pole, sensors=sensors, sample_time=sample_time)
        for name, gain in zip(("proportional_gain", "integral_gain"), gains, strict=True):
            given.setdefault(name, gain)
        return cls(**given)

    def start(self, measurement: Measurement, torque: ArrayLike) -> LimiterMemory:
        """Memory that goes on from `torque` [N.m]."""
        return self.start_limiter(plausible(measurement), torque)

    def sample(
        self, measurement: Measurement, memory: LimiterMemory
    ) -> tuple[FloatArray, LimiterMemory]:
        """Torque [N.m] and new memory."""
        slip, vehicle = self.slip(plausible(measurement), memory.vehicle)
        return self.limit(slip, vehicle, np.asarray(self.reference), memory)
