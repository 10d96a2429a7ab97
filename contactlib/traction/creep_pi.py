"""Sampled creep control: a PI controller of the slip speed limits the demand.

`SlipLimiter` is the part that `CreepPI` shares with `SlopeSeeking`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from contactlib.base.elementwise import maximum, minimum, where
from contactlib.base.quantities import FloatArray, Parameters, Quantity
from contactlib.stability import fast_pole, worst_pole
from contactlib.traction.creepage_bias import CreepageBias, learn, start_creepage_bias
from contactlib.traction.design import (
    minimum_slip,
    peak_creepage,
    slip_gains,
    sticking,
    total_delay,
)
from contactlib.traction.filters import Tracked, track, tracker_gains
from contactlib.traction.interface import (
    FILTER_TIME,
    LOW_SPEED,
    SAMPLE_TIME,
    Measurement,
    is_backward,
    plausible,
)
from contactlib.traction.search import Ranges, around_design
from contactlib.traction.sensors import SPEED_NOISE, Sensors
from contactlib.vehicle.drivetrain import Drivetrain

BAND = 0.15  # lack of creepage / reference beyond which the creepage is far below the reference
CUT = 0.25  # rate at which a spinning wheel's torque is reduced / rate at which it is restored
BELOW_PEAK = 0.8  # reference / creepage of the nominal peak: on the stable side
LACK = 0.9  # torque / demand below which an unknown error of the creepage is measured
MAX_SHARE = 2.0  # of the scheduled reference / given reference


class LimiterMemory(NamedTuple):
    """Memory of the limiter.

    Attributes
    ----------
    vehicle : Tracked
        Filtered vehicle speed.
    integral : ndarray
        I, torque in the demand's direction [N.m].
    limiting : ndarray of bool
        Whether the last torque was below the demand.
    backward : ndarray of bool
        Whether the last demand was backward.
    torque : ndarray
        Torque that was requested last [N.m].
    bias : CreepageBias
        Estimated error of the measured creepage.
    """

    vehicle: Tracked
    integral: FloatArray
    limiting: NDArray[np.bool_]
    backward: NDArray[np.bool_]
    torque: FloatArray
    bias: CreepageBias


class Slip(NamedTuple):
    """Slip of the wheel in the demand's direction.

    Attributes
    ----------
    backward, braking : ndarray of bool
        Whether the demand is backward, see `is_backward`, and whether it is against the motion.
    sign : ndarray
        -1 if the demand is backward, else 1.
    demand : ndarray
        Size of the demand [N.m].
    speed : ndarray
        Slip speed without its estimated error [m/s].
    scale : ndarray
        Reference speed of the creepage: the vehicle's, at least `low_speed` [m/s].
    missing : ndarray
        Torque that was commanded last minus what the drive gave, in the demand's direction [N.m].
    bias : CreepageBias
        Estimated error of the measured creepage.
    """

    backward: NDArray[np.bool_]
    braking: NDArray[np.bool_]
    sign: FloatArray
    demand: FloatArray
    speed: FloatArray
    scale: FloatArray
    missing: FloatArray
    bias: CreepageBias


@dataclass(frozen=True, kw_only=True)
class SlipLimiter(Parameters):
    """Passes the demand until the creepage reaches a reference, then holds the creepage there.

    In the demand's direction, with the measured slip speed w = r omega - V and the filtered
    vehicle speed V,

        e = max(zeta_ref max(|V|, low_speed), minimum_slip) - w
        u = Kp e + I,    T = u limited to [0, demand]

    While u exceeds the demand, I is the demand, so that T follows it without delay and any slip
    beyond the reference reduces the torque at once; otherwise dI/dt = Ki e, limited to [0, demand],
    and faster where the creepage is far below the reference or beyond four times the reference. I
    does not rise while the drive gives less than was commanded, nor fall while it gives more.

    The measured creepage has an error; `contactlib.traction.creepage_bias` estimates it, and w is
    corrected by it. If the error is unknown when the torque has to be limited, T is at most
    `stick_torque` for some 0.2 s, until the error is known.

    Parameters
    ----------
    sample_time : float, optional
        Sample time [s].
    proportional_gain : float
        Kp on slip speed [N.s]: on creepage the gain is Kp V, scheduled with speed inversely to the
        plant's gain r/(J V).
    integral_gain : float
        Ki on slip speed [N].
    brake_share : float, optional
        Factor on Kp in braking, whose square multiplies Ki, as a brake follows more slowly than a
        motor [1]. Default: 1, with which a `proportional_gain` that is given holds in braking too.
    low_speed : float, optional
        Vehicle speed below which the reference is a slip speed [m/s].
    minimum_slip : float, optional
        Minimum reference slip speed, above the noise [m/s].
    speed_filter_time : float, optional
        Time constant of the filter on the vehicle speed [s].
    recovery_time : float, optional
        Time in which the whole demand would be restored at zero creepage; at five times the
        reference it would be removed in four times this time [s].
    creepage_error : float, optional
        Standard deviation of the error of the measured creepage at the start [1]: bias of the
        vehicle speed and of the wheel diameter. Zero: no correction. Default: 0.01.
    speed_noise : float, optional
        Standard deviation of the difference of the measured speeds by noise [m/s].
    stick_torque : float, optional
        Torque up to which the wheel sticks on any rail [N.m].
    stick_compliance : float, optional
        Creepage / torque of the sticking wheel [1/(N.m)].
    """

    sample_time: Annotated[float, SAMPLE_TIME] = 0.01
    proportional_gain: Annotated[float, Quantity("N.s", above=0.0, usual=(1.0, 1e8))]
    integral_gain: Annotated[float, Quantity("N", at_least=0.0, usual=(0.0, 1e10))]
    brake_share: Annotated[float, Quantity("1", above=0.0, usual=(1e-3, 1e3))] = 1.0
    low_speed: Annotated[float, LOW_SPEED] = 2.0
    minimum_slip: Annotated[float, SPEED_NOISE] = 0.0
    speed_filter_time: Annotated[float, FILTER_TIME] = 0.25
    recovery_time: Annotated[float, Quantity("s", above=0.0, usual=(1e-3, 20.0))] = 0.35
    creepage_error: Annotated[float, Quantity("1", at_least=0.0, at_most=0.1, percent=True)] = 0.01
    speed_noise: Annotated[float, SPEED_NOISE] = 0.0
    stick_torque: Annotated[float, Quantity("N.m", at_least=0.0, usual=(0.0, 3e5))] = 0.0
    stick_compliance: Annotated[float, Quantity("1/(N.m)", at_least=0.0)] = 0.0

    @property
    def search_ranges(self) -> Ranges:
        """Settings that `tune` searches."""
        return around_design(
            self, "proportional_gain", "integral_gain", "recovery_time", "speed_filter_time"
        )

    @cached_property
    def _tracker_gains(self) -> tuple[float, float]:
        return tracker_gains(self.sample_time, self.speed_filter_time)

    def start_limiter(self, measurement: Measurement[FloatArray], torque: Any) -> LimiterMemory:
        """Memory of a drive at `torque` [N.m]."""
        vehicle, none = measurement.vehicle_speed, 0.0 * measurement.vehicle_speed
        given = torque + none
        size = abs(given)
        return LimiterMemory(
            Tracked(vehicle, none),
            size,
            size < abs(measurement.demand),
            is_backward(measurement.demand, vehicle),
            given,
            start_creepage_bias(measurement.wheel_speed - vehicle, self.creepage_error),
        )

    def slip(
        self, measurement: Measurement[FloatArray], memory: LimiterMemory
    ) -> tuple[Slip, Tracked]:
        """Slip without the estimated error, and the filtered vehicle speed to which it refers."""
        vehicle = track(memory.vehicle, measurement.vehicle_speed, self._tracker_gains)
        backward = is_backward(measurement.demand, vehicle.speed)
        sign = where(backward, -1.0, 1.0)
        scale = maximum(abs(vehicle.speed), self.low_speed)
        limiting = memory.limiting & (backward == memory.backward)
        # The raw speeds, as a filter lags when the torque is taken away and the vehicle coasts.
        bias = learn(
            memory.bias,
            slip=measurement.wheel_speed - measurement.vehicle_speed,
            vehicle_speed=vehicle.speed,
            scale=scale,
            torque=measurement.torque,
            limiting=limiting & (memory.integral < LACK * sign * measurement.demand),
            sample_time=self.sample_time,
            noise=self.speed_noise,
            stick_torque=self.stick_torque,
            stick_compliance=self.stick_compliance,
        )
        forward = measurement.wheel_speed - vehicle.speed - bias.error * vehicle.speed
        missing = sign * (memory.torque - measurement.torque)
        demand = sign * measurement.demand
        braking = sign * vehicle.speed < 0.0
        slip = Slip(backward, braking, sign, demand, sign * forward, scale, missing, bias)
        return slip, vehicle

    def limit(
        self, slip: Slip, vehicle: Tracked, reference: FloatArray, memory: LimiterMemory
    ) -> tuple[FloatArray, LimiterMemory]:
        """Torque [N.m] that holds a reference creepage [1], and the new memory."""
        demand = slip.demand
        limiting = memory.limiting & (slip.backward == memory.backward)
        integral = where(limiting, minimum(memory.integral, demand), demand)
        target = maximum(reference * slip.scale, self.minimum_slip)
        error = target - slip.speed
        share = where(slip.braking, self.brake_share, 1.0)
        requested = self.proportional_gain * share * error + integral
        limit = where(slip.bias.looking, minimum(self.stick_torque, demand), demand)
        size = minimum(maximum(requested, 0.0), limit)
        # The rising branch is stiff: torque changes the creepage little there, and Ki alone would
        # take seconds to restore the torque. Beyond four times the reference the wheel spins; to
        # cut earlier, while it passes the peak and returns, would make it hunt.
        lack = error / target
        ease = maximum(minimum(lack, 1.0), BAND) - BAND
        ease = ease - CUT * maximum(minimum(-lack, 4.0) - 3.0, 0.0)
        step = self.sample_time
        change = (self.integral_gain * share * share * step) * error + (
            step / self.recovery_time
        ) * demand * ease
        change = where(slip.missing > 0.0, minimum(change, 0.0), change)
        change = where(slip.missing < 0.0, maximum(change, 0.0), change)
        integral = integral + change
        torque = slip.sign * size
        return torque, LimiterMemory(
            vehicle,
            minimum(maximum(integral, 0.0), limit),
            (requested < demand) | slip.bias.looking,
            slip.backward,
            torque,
            slip.bias,
        )


@dataclass(frozen=True, kw_only=True)
class CreepPI(SlipLimiter):
    """Sampled controller that limits the demand so that the creepage stays below a reference.

    The design needs the nominal friction, from whose creep force curve reference and gains follow.
    With `reference_torque` the reference adapts to other friction. The parameters that are not
    listed here are those of `traction.SlipLimiter`.

    Parameters
    ----------
    reference : float
        Creepage to hold [1].
    reference_torque : float, optional
        Torque at this creepage [N.m]. If given, the reference is proportional to the holding
        torque, the integral part: on a rail with half the friction, half of the torque is left and
        the peak is at half the creepage, as the initial slope of the creep force does not depend on
        friction. Default: the reference is constant, and right for one friction only.
    minimum_share : float, optional
        Minimum of scheduled reference / given reference [1], so that torque and reference do not
        lower each other to zero.
    """

    reference: Annotated[float, Quantity("1", above=0.0, percent=True)]
    reference_torque: Annotated[float | None, Quantity("N.m", above=0.0, usual=(1.0, 3e5))] = None
    minimum_share: Annotated[float, Quantity("1", above=0.0, at_most=1.0)] = 0.5

    @property
    def search_ranges(self) -> Ranges:
        """Settings that `tune` searches."""
        return {**around_design(self, "reference", "minimum_share"), **super().search_ranges}

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Design gains by `slip_gains` for the larger of the poles at steepest fall and reference.

        The reference is just below the nominal peak, with the torque there; a reference that is
        given without a torque is constant.

        Raises
        ------
        ValueError
            If the delay is too long for any gain to hold the reference on nominal friction.
        """
        wheelset, sample_time = drivetrain.wheelset, given.get("sample_time", cls.sample_time)
        speed = wheelset.conditions(speed=speed).speed
        if "reference" not in given:
            reference = BELOW_PEAK * peak_creepage(wheelset, speed)
            force = wheelset.balanced(creepage=reference, speed=speed).creep_force
            given = {
                "reference": reference,
                "reference_torque": wheelset.radius * force,
                **given,
            }
        reference = given["reference"]
        pole = float(fast_pole(wheelset, reference, speed=speed))
        for braking in (False, True):
            delay = total_delay(drivetrain, sensors, sample_time, braking=braking)
            if pole * delay >= 1.0:
                raise ValueError(
                    f"reference = {reference!r} cannot be held at {speed!r} m/s: its pole of "
                    f"{pole:.4g} 1/s needs a delay below {1.0 / pole:.4g} s, but the loop has "
                    f"{delay:.4g} s{' in braking' if braking else ''}"
                )
        pole = max(pole, worst_pole(wheelset, speed=speed).pole)
        gains = slip_gains(drivetrain, pole=pole, sensors=sensors, sample_time=sample_time)
        if "proportional_gain" in given:
            gains["brake_share"] = 1.0
        filter_time = given.get("speed_filter_time", cls.speed_filter_time)
        known = {
            **gains,
            "minimum_slip": minimum_slip(sensors, sample_time, filter_time),
            **sticking(wheelset, speed, sensors),
        }
        return cls(**{**known, **given})

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> LimiterMemory:
        """Memory of a drive at `torque` [N.m]."""
        return self.start_limiter(plausible(measurement), torque)

    def sample(
        self, measurement: Measurement[FloatArray], memory: LimiterMemory
    ) -> tuple[FloatArray, LimiterMemory]:
        """Torque [N.m] and new memory."""
        slip, vehicle = self.slip(plausible(measurement), memory)
        reference: Any = self.reference
        if self.reference_torque is not None:
            share = memory.integral / self.reference_torque
            reference = reference * minimum(maximum(share, self.minimum_share), MAX_SHARE)
        return self.limit(slip, vehicle, reference, memory)
