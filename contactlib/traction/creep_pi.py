"""Creep control: the demand is limited by a PI controller of the creepage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import FloatArray, Quantity
from contactlib.stability import fast_pole, worst_pole
from contactlib.traction.design import least_slip, peak_creepage, slip_gains, total_delay
from contactlib.traction.interface import Measurement, plausible
from contactlib.traction.limiter import LimiterMemory, SlipLimiter
from contactlib.traction.sensors import Sensors
from contactlib.wheelset import checked_conditions

BELOW_PEAK = 0.8  # of the nominal peak's creepage: on the side that needs no holding
SHARES = (0.2, 2.0)  # the reference stays within these shares of the given one


@dataclass(frozen=True, kw_only=True)
class CreepPI(SlipLimiter):
    """Limits the demand so that the creepage does not exceed a reference.

    Its designer has to know the nominal friction: reference and gains come from its creep force
    curve. Only the torque that the reference follows tells it of another.

    Parameters
    ----------
    reference : float
        Creepage to hold [1].
    reference_torque : float, optional
        Torque that this creepage belongs to [N.m]. If it is given, the reference is in proportion
        to the holding torque, the integral part: on a rail of half the friction half of the torque
        is left, and the peak is at half the creepage, as the initial slope of the creep force does
        not depend on friction. If it is not, the reference is constant, and right for one friction
        only.
    proportional_gain, integral_gain : float
        Kp, Ki on slip speed [N.s, N].
    sample_time, low_speed, least_slip, speed_filter_time, recovery_time : float, optional
        As of `SlipLimiter`.
    """

    reference: Annotated[float, Quantity("1", above=0.0)]
    reference_torque: Annotated[float | None, Quantity("N.m", above=0.0)] = None

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Gains by `slip_gains` for the steepest fall or the reference, whichever is worse.

        The reference is just below the nominal peak, with the torque there; a reference that is
        given without a torque is constant.

        Raises
        ------
        ValueError
            If the delay is too long for any gain to hold the reference on nominal friction.
        """
        wheelset, sample_time = drivetrain.wheelset, given.get("sample_time", cls.sample_time)
        speed = checked_conditions(wheelset, speed=speed)["speed"]
        if "reference" not in given:
            reference = BELOW_PEAK * peak_creepage(wheelset, speed)
            force = wheelset.balanced(creepage=reference, speed=speed).creep_force
            given = {
                "reference": reference,
                "reference_torque": wheelset.radius * force,
                **given,
            }
        reference = given["reference"]
        delay = total_delay(drivetrain, sensors, sample_time)
        pole = float(fast_pole(wheelset, reference, speed=speed))
        if pole * delay >= 1.0:
            raise ValueError(
                f"reference = {reference!r} cannot be held at {speed!r} m/s: its pole of "
                f"{pole:.4g} 1/s needs a delay below {1.0 / pole:.4g} s, but the loop has "
                f"{delay:.4g} s"
            )
        pole = max(pole, worst_pole(wheelset, speed=speed).pole)
        gains = slip_gains(drivetrain, pole=pole, sensors=sensors, sample_time=sample_time)
        filter_time = given.get("speed_filter_time", cls.speed_filter_time)
        known = {
            "proportional_gain": gains[0],
            "integral_gain": gains[1],
            "least_slip": least_slip(sensors, sample_time, filter_time),
        }
        return cls(**{**known, **given})

    def start(self, measurement: Measurement, torque: ArrayLike) -> LimiterMemory:
        """Memory that goes on from `torque` [N.m]."""
        return self.start_limiter(plausible(measurement), torque)

    def sample(
        self, measurement: Measurement, memory: LimiterMemory
    ) -> tuple[FloatArray, LimiterMemory]:
        """Torque [N.m] and new memory."""
        slip, vehicle = self.slip(plausible(measurement), memory.vehicle)
        reference = np.asarray(self.reference)
        if self.reference_torque is not None:
            share = memory.integral / self.reference_torque
            reference = reference * np.minimum(np.maximum(share, SHARES[0]), SHARES[1])
        return self.limit(slip, vehicle, reference, memory)
