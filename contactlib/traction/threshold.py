"""Slip protection by thresholds: cut the torque when the wheel slips, and apply it again.

The classical scheme of locomotives, and the baseline here; P. Pichlik, J. Zdenek, "Overview of slip
control methods used in locomotives", Transactions on Electrical Engineering 3 (2014), compare it
with others. It detects slip by slip speed and wheel acceleration, cuts the torque fast, waits until
the wheel has recovered, restores a part of the torque fast, and continues with a ramp. It hunts
about the peak. The defaults are rounded results of ``contactlib tune dry_wet_dry.toml --also
soft_patch.toml``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from contactlib.base.elementwise import maximum, minimum, negated, where
from contactlib.base.quantities import POSITIVE, FloatArray, Parameters, Quantity, checked_number
from contactlib.traction.filters import (
    Tracked,
    filtered_noise,
    first_order_gain,
    track,
    tracker_gains,
)
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

CLEAR = 5.0  # standard deviations below the thresholds: one false cut in hours


class ThresholdMemory(NamedTuple):
    """Memory of the scheme.

    Attributes
    ----------
    vehicle : Tracked
        Filtered vehicle speed.
    slip, wheel_speed : ndarray
        Filtered forward slip speed, filtered wheel speed [m/s].
    torque, cut_torque : ndarray
        Limit in the demand's direction, and the torque at the last cut [N.m].
    cutting, limiting, backward : ndarray of bool
        Whether the torque is being cut; was below the demand; and whether the demand was backward.
    """

    vehicle: Tracked
    slip: FloatArray
    wheel_speed: FloatArray
    torque: FloatArray
    cut_torque: FloatArray
    cutting: NDArray[np.bool_]
    limiting: NDArray[np.bool_]
    backward: NDArray[np.bool_]


def check_release(control: Any) -> None:
    """Check that slip ends an action of the controller at or below the slip that starts it.

    Raises
    ------
    ValueError
        If it does not.
    """
    if control.slip_release > control.slip_threshold:
        raise ValueError(
            f"{type(control).__name__}.slip_release = {control.slip_release!r} is out of range: "
            f"must be <= slip_threshold = {control.slip_threshold!r}"
        )


@dataclass(frozen=True, kw_only=True)
class ThresholdControl(Parameters):
    """Sampled controller that cuts and restores the torque at thresholds of the slip.

    Parameters
    ----------
    sample_time : float, optional
        Sample time [s].
    slip_threshold : float, optional
        Creepage that starts a cut [1].
    slip_release : float, optional
        Creepage below which a cut ends [1].
    acceleration_threshold : float, optional
        Wheel acceleration in the demand's direction that starts a cut [m/s2].
    cut_fraction : float, optional
        Torque after / before the cut [1]. If the wheel does not recover, the rest is cut within
        `ramp_time`.
    cut_time : float, optional
        Time in which the whole demand would be cut [s].
    reapply_fraction : float, optional
        Torque restored fast / torque at the cut [1].
    reapply_time : float, optional
        Time in which the whole demand would be restored fast [s].
    ramp_time : float, optional
        Time in which the following slow ramp would restore the whole demand [s]. Rates refer to
        the demand, as the torque at a cut may be zero, from which a rate would never recover.
    low_speed : float, optional
        Vehicle speed below which the thresholds are slip speeds [m/s].
    minimum_slip : float, optional
        Minimum slip speed that starts a cut, above the noise [m/s].
    speed_filter_time : float, optional
        Time constant of the filter on the vehicle speed [s].
    slip_filter_time : float, optional
        Time constant of the filter on the slip [s].
    acceleration_filter_time : float, optional
        Time constant of the filter on the wheel's acceleration [s].
    """

    sample_time: Annotated[float, SAMPLE_TIME] = 0.01
    slip_threshold: Annotated[float, Quantity("1", above=0.0)] = 0.11
    slip_release: Annotated[float, Quantity("1", above=0.0)] = 0.07
    acceleration_threshold: Annotated[float, Quantity("m/s2", above=0.0, usual=(0.01, 100.0))] = 3.4
    cut_fraction: Annotated[float, Quantity("1", at_least=0.0, below=1.0)] = 0.26
    cut_time: Annotated[float, Quantity("s", above=0.0, usual=(1e-4, 5.0))] = 0.009
    reapply_fraction: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = 0.84
    reapply_time: Annotated[float, Quantity("s", above=0.0, usual=(1e-4, 5.0))] = 0.008
    ramp_time: Annotated[float, Quantity("s", above=0.0, usual=(1e-2, 60.0))] = 3.0
    low_speed: Annotated[float, LOW_SPEED] = 2.0
    minimum_slip: Annotated[float, SPEED_NOISE] = 0.0
    speed_filter_time: Annotated[float, FILTER_TIME] = 0.25
    slip_filter_time: Annotated[float, FILTER_TIME] = 0.04
    acceleration_filter_time: Annotated[float, Quantity("s", above=0.0, usual=(1e-4, 5.0))] = 0.022

    @property
    def search_ranges(self) -> Ranges:
        """Settings that `tune` searches."""
        return around_design(
            self,
            "slip_threshold",
            "slip_release",
            "acceleration_threshold",
            "cut_fraction",
            "cut_time",
            "reapply_fraction",
            "reapply_time",
            "ramp_time",
            "slip_filter_time",
            "acceleration_filter_time",
            "speed_filter_time",
        )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_release(self)

    @cached_property
    def _tracker_gains(self) -> tuple[float, float]:
        return tracker_gains(self.sample_time, self.speed_filter_time)

    @cached_property
    def _filter_gains(self) -> tuple[float, float]:
        """Gains of the filters on slip and wheel speed per sample."""
        slip, acceleration = self.slip_filter_time, self.acceleration_filter_time
        time = self.sample_time
        return first_order_gain(time, slip), first_order_gain(time, acceleration)

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Set thresholds clear of the sensors' noise; the wheelset does not matter."""
        checked_number("speed", speed, POSITIVE)
        designed = cls(**given)
        slip, acceleration = designed.noise(sensors)
        known = {
            "minimum_slip": CLEAR * slip,
            "acceleration_threshold": max(designed.acceleration_threshold, CLEAR * acceleration),
        }
        return cls(**{**known, **given})

    def noise(self, sensors: Sensors) -> tuple[float, float]:
        """Standard deviations of filtered slip [m/s] and acceleration [m/s2] by sensor noise."""
        gains = self._filter_gains
        return filtered_noise(sensors, self.sample_time, self.speed_filter_time, gains)

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> ThresholdMemory:
        """Memory of a drive at `torque` [N.m]."""
        known = plausible(measurement)
        vehicle, wheel, none = known.vehicle_speed, known.wheel_speed, 0.0 * known.vehicle_speed
        size = abs(torque + none)
        limiting = size < abs(known.demand)
        return ThresholdMemory(
            Tracked(vehicle, none),
            none,
            wheel,
            size,
            where(limiting, size, none),
            limiting & negated(limiting),
            limiting,
            is_backward(known.demand, vehicle),
        )

    def sample(
        self, measurement: Measurement[FloatArray], memory: ThresholdMemory
    ) -> tuple[FloatArray, ThresholdMemory]:
        """Torque [N.m] and new memory."""
        known = plausible(measurement)
        slip_gain, speed_gain = self._filter_gains
        vehicle = track(memory.vehicle, known.vehicle_speed, self._tracker_gains)
        backward, demand = is_backward(known.demand, vehicle.speed), abs(known.demand)
        forward = known.wheel_speed - vehicle.speed
        forward = memory.slip + slip_gain * (forward - memory.slip)
        slip = where(backward, -forward, forward)
        change = speed_gain * (known.wheel_speed - memory.wheel_speed)
        acceleration = where(backward, -change, change) / self.sample_time
        scale = maximum(abs(vehicle.speed), self.low_speed)

        # Unless limiting, the limit is the demand.
        limiting = memory.limiting & (backward == memory.backward)
        torque = where(limiting, minimum(memory.torque, demand), demand)
        limit = maximum(self.slip_threshold * scale, self.minimum_slip)
        slipping = (slip > limit) | (acceleration > self.acceleration_threshold)
        back = slip < self.slip_release / self.slip_threshold * limit
        back = back & (acceleration < self.acceleration_threshold)
        starts = slipping & negated(memory.cutting)
        cutting = (slipping | memory.cutting) & negated(back)
        # The drive may give less than was commanded last; a cut begins at what it gives.
        given = maximum(where(backward, -known.torque, known.torque), 0.0)
        less = (given < memory.torque) & (backward == memory.backward) & (starts | cutting)
        torque = where(less, minimum(torque, given), torque)
        cut_torque = where(starts, torque, memory.cut_torque)

        step = self.sample_time * demand
        low, high = self.cut_fraction * cut_torque, self.reapply_fraction * cut_torque
        slow = step / self.ramp_time
        down = where(torque > low, maximum(torque - step / self.cut_time, low), torque - slow)
        up = where(torque < high, minimum(torque + step / self.reapply_time, high), torque + slow)
        torque = where(cutting, down, where(limiting, up, demand))
        torque = minimum(maximum(torque, 0.0), demand)
        return where(backward, -torque, torque), ThresholdMemory(
            vehicle,
            forward,
            memory.wheel_speed + change,
            torque,
            cut_torque,
            cutting,
            torque < demand,
            backward,
        )
