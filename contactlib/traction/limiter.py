"""PI control of the slip speed as a limiter of the demand: what both creep controllers share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib.parameters import FloatArray, Parameters, Quantity
from contactlib.traction.interface import Measurement
from contactlib.traction.speed_tracker import Tracked, track, tracker_gains

BAND = 0.15  # of the reference: what the creepage is below it by before that counts as far
CUT = 0.5  # pace at which a spinning wheel's torque is taken away, of that at which it is given


class LimiterMemory(NamedTuple):
    """What the limiter keeps.

    Attributes
    ----------
    vehicle : Tracked
        Filtered vehicle speed.
    integral : ndarray
        I, torque in the demand's direction [N.m].
    limiting : ndarray of bool
        Whether the last torque was below the demand.
    braking : ndarray of bool
        Whether the last demand was negative.
    """

    vehicle: Tracked
    integral: FloatArray
    limiting: NDArray[np.bool_]
    braking: NDArray[np.bool_]


class Slip(NamedTuple):
    """How the wheel slips, seen in the demand's direction.

    Attributes
    ----------
    braking : ndarray of bool
        Whether the demand is negative.
    sign : ndarray
        Minus one if it is, else one.
    demand : ndarray
        Its size [N.m].
    speed : ndarray
        Slip speed [m/s].
    scale : ndarray
        Speed that creepage is counted in: the vehicle's, at least `low_speed` [m/s].
    """

    braking: NDArray[np.bool_]
    sign: FloatArray
    demand: FloatArray
    speed: FloatArray
    scale: FloatArray


@dataclass(frozen=True, kw_only=True)
class SlipLimiter(Parameters):
    """Lets the demand through until the creepage reaches a reference, then holds it there.

    In the demand's direction, with the slip speed w = r omega - V as measured and the filtered
    vehicle speed V,

        e = max(zeta_ref max(|V|, low_speed), least_slip) - w
        u = Kp e + I,    T = u held within [0, demand]

    While u is beyond the demand, I is the demand itself, so that T follows it at once and the
    first slip beyond the reference takes torque away; else dI/dt = Ki e, held within [0, demand],
    and faster where the creepage is far below the reference, or beyond four times it.

    Parameters
    ----------
    sample_time : float, optional
        [s].
    proportional_gain, integral_gain : float
        Kp, Ki on slip speed [N.s, N]: on creepage that is Kp V, scheduled with speed as the
        plant's gain r/(J V) asks for.
    low_speed : float, optional
        Below it the reference is a slip speed [m/s].
    least_slip : float, optional
        The reference is never a smaller slip speed: what is within the noise is not slip [m/s].
    speed_filter_time : float, optional
        Time constant of the filter on the vehicle speed [s].
    recovery_time : float, optional
        Time in which the demand would be given back at no creepage at all; at five times the
        reference it would be taken away in twice that [s].
    """

    sample_time: Annotated[float, Quantity("s", above=0.0)] = 0.01
    proportional_gain: Annotated[float, Quantity("N.s", above=0.0)]
    integral_gain: Annotated[float, Quantity("N", at_least=0.0)]
    low_speed: Annotated[float, Quantity("m/s", above=0.0)] = 2.0
    least_slip: Annotated[float, Quantity("m/s", at_least=0.0)] = 0.0
    speed_filter_time: Annotated[float, Quantity("s", at_least=0.0)] = 0.25
    recovery_time: Annotated[float, Quantity("s", above=0.0)] = 0.2

    @cached_property
    def _tracker_gains(self) -> tuple[float, float]:
        return tracker_gains(self.sample_time, self.speed_filter_time)

    def start_limiter(self, measurement: Measurement, torque: ArrayLike) -> LimiterMemory:
        """Memory that goes on from `torque` [N.m]."""
        vehicle = np.array(measurement.vehicle_speed, dtype=np.float64)
        size = np.abs(torque) + np.zeros_like(vehicle)
        return LimiterMemory(
            Tracked(vehicle, np.zeros_like(vehicle)),
            np.asarray(size),
            np.asarray(size < np.abs(measurement.demand)),
            np.asarray(np.asarray(measurement.demand) < 0.0),
        )

    def slip(self, measurement: Measurement, vehicle: Tracked) -> tuple[Slip, Tracked]:
        """Slip as measured now, and the vehicle speed that it is counted from."""
        vehicle = track(vehicle, measurement.vehicle_speed, self._tracker_gains)
        braking = measurement.demand < 0.0
        sign = np.where(braking, -1.0, 1.0)
        return (
            Slip(
                braking,
                sign,
                sign * measurement.demand,
                sign * (measurement.wheel_speed - vehicle.speed),
                np.maximum(np.abs(vehicle.speed), self.low_speed),
            ),
            vehicle,
        )

    def limit(
        self, slip: Slip, vehicle: Tracked, reference: FloatArray, memory: LimiterMemory
    ) -> tuple[FloatArray, LimiterMemory]:
        """Torque [N.m] that keeps to a reference creepage [1]."""
        demand = slip.demand
        limiting = memory.limiting & (slip.braking == memory.braking)
        integral = np.where(limiting, np.minimum(memory.integral, demand), demand)
        target = np.maximum(reference * slip.scale, self.least_slip)
        error = target - slip.speed
        wanted = self.proportional_gain * error + integral
        size = np.minimum(np.maximum(wanted, 0.0), demand)
        # The rising branch is stiff: torque moves the creepage little there, and Ki alone would
        # take seconds to give the torque back. A wheel that spins was given too much by far;
        # to cut at less, as it passes the peak and comes back, would make it hunt.
        share = error / target
        ease = np.maximum(np.minimum(share, 1.0), BAND) - BAND
        ease = ease - CUT * np.maximum(np.minimum(-share, 4.0) - 3.0, 0.0)
        step = self.sample_time
        integral = integral + (
            (self.integral_gain * step) * error + (step / self.recovery_time) * demand * ease
        )
        return slip.sign * size, LimiterMemory(
            vehicle,
            np.minimum(np.maximum(integral, 0.0), demand),
            wanted < demand,
            slip.braking,
        )
