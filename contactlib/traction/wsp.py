"""Wheel-slide protection of a pneumatic brake: vent, hold or fill the brake cylinder.

The scheme that UIC 541-05 and EN 15595 test, and the baseline of braking here. A dump valve has
three positions and no other access to the pressure. Two measures choose among them: the slip, by
which the wheel is slower than the estimated train speed, and the wheel's own deceleration.

    slip            wheel decelerates hard   neither   wheel recovers
    below release   vent                     fill      fill
    between         vent                     hold      hold
    above           vent                     vent      hold

L. Pugi, M. Malvezzi, A. Tarasconi, A. Palazzolo, G. Cocci, M. Violani, "HIL simulation of WSP
systems on MI-6 test rig", Vehicle System Dynamics 44 (2006) S843-S852, describe such tables.

After a slide it can fill in pulses, so that the pressure rises in steps and the wheel shows whether
the rail carries each. A watchdog ends a long venting, as a failed sensor must not take the brake
away: UIC 541-05 and EN 15595 require one that acts after 5 to 10 s (from memory; its time here, and
the times of the pulses, are chosen).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple, Self

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
    plausible,
)
from contactlib.traction.search import Ranges, around_design
from contactlib.traction.sensors import SPEED_NOISE, Sensors
from contactlib.traction.threshold import CLEAR, check_release
from contactlib.vehicle.drivetrain import LAG, Drivetrain

PULSE = Quantity("s", above=0.0, usual=(0.01, 1.0))
FILLED, PAUSE = 0.2, 0.2  # of the design: pulse / fill_time, and pause [s]
FULL = 0.95  # pressure / demand at which the brake counts as applied again
EMPTY = 0.02  # pressure / demand at which the cylinder counts as empty
ACCELERATION = Quantity("m/s2", above=0.0, usual=(0.01, 100.0))


class WspMemory(NamedTuple):
    """Memory of the scheme.

    Attributes
    ----------
    vehicle : Tracked
        Filtered vehicle speed.
    wheel_speed : ndarray
        Filtered wheel speed [m/s].
    pressure : ndarray
        Pressure in the brake cylinder, as the brake torque at nominal friction of its pads [N.m].
    slid : ndarray of bool
        Whether the pressure has not reached the demand since it was vented.
    filled, vented : ndarray
        Number of samples since filling began, and since venting did.
    """

    vehicle: Tracked
    wheel_speed: FloatArray
    pressure: FloatArray
    slid: Any
    filled: FloatArray
    vented: FloatArray


@dataclass(frozen=True, kw_only=True)
class WheelSlideProtection(Parameters):
    """Sampled controller that vents, holds or fills a brake cylinder; driving is not controlled.

    To hold, it commands the pressure that it expects from its own commands and the times of the
    brake: a closed valve needs no measured pressure. Without a brake in the scenario both times are
    zero, and the motor's torque is held.

    Parameters
    ----------
    sample_time : float, optional
        Sample time [s].
    slip_threshold : float, optional
        Creepage, as a positive number, above which it vents unless the wheel recovers [1].
    slip_release : float, optional
        Creepage, as a positive number, below which it fills [1].
    deceleration_threshold : float, optional
        Wheel deceleration above which it vents at any slip [m/s2].
    recovery_threshold : float, optional
        Wheel acceleration above which the wheel recovers, so that it does not vent [m/s2].
    low_speed : float, optional
        Vehicle speed below which the thresholds are slip speeds [m/s].
    minimum_slip : float, optional
        Minimum slip speed above which it vents, above the noise [m/s].
    speed_filter_time : float, optional
        Time constant of the filter on the vehicle speed [s].
    wheel_filter_time : float, optional
        Time constant of the filter on the wheel speed and its acceleration [s].
    fill_time : float, optional
        Time constant with which the brake fills [s].
    vent_time : float, optional
        Time constant with which the brake vents [s].
    fill_pulse : float, optional
        Time for which it fills after a slide before each pause [s]; whole samples, at least one.
        The design takes a fifth of `fill_time`.
    fill_pause : float, optional
        Time for which it then holds [s], in whole samples; in turn with pulses until the pressure
        has reached the demand. Zero: it fills steadily. The design takes 0.2 s if there is a brake.
    watchdog_time : float, optional
        Time of uninterrupted venting, or holding of an empty cylinder, after which it fills until
        the scheme would no longer vent [s].
    """

    sample_time: Annotated[float, SAMPLE_TIME] = 0.01
    slip_threshold: Annotated[float, Quantity("1", above=0.0)] = 0.15
    slip_release: Annotated[float, Quantity("1", above=0.0)] = 0.05
    deceleration_threshold: Annotated[float, ACCELERATION] = 4.0
    recovery_threshold: Annotated[float, ACCELERATION] = 1.0
    low_speed: Annotated[float, LOW_SPEED] = 2.0
    minimum_slip: Annotated[float, SPEED_NOISE] = 0.0
    speed_filter_time: Annotated[float, FILTER_TIME] = 0.25
    wheel_filter_time: Annotated[float, FILTER_TIME] = 0.03
    fill_time: Annotated[float, LAG] = 0.0
    vent_time: Annotated[float, LAG] = 0.0
    fill_pulse: Annotated[float, PULSE] = 0.05
    fill_pause: Annotated[float, FILTER_TIME] = 0.0
    watchdog_time: Annotated[float, Quantity("s", above=0.0, usual=(1.0, 20.0))] = 10.0

    @property
    def search_ranges(self) -> Ranges:
        """Settings that `tune` searches."""
        return around_design(
            self,
            "slip_threshold",
            "slip_release",
            "deceleration_threshold",
            "recovery_threshold",
            "speed_filter_time",
            "wheel_filter_time",
            "fill_pulse",
            "fill_pause",
        )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_release(self)

    @cached_property
    def _tracker_gains(self) -> tuple[float, float]:
        return tracker_gains(self.sample_time, self.speed_filter_time)

    @cached_property
    def _gains(self) -> tuple[float, float, float]:
        """Gains per sample of the filter on the wheel speed, of filling and of venting."""
        times = self.wheel_filter_time, self.fill_time, self.vent_time
        wheel, fill, vent = (first_order_gain(self.sample_time, t) for t in times)
        return wheel, fill, vent

    @cached_property
    def _samples(self) -> tuple[float, float, float]:
        """Samples of a pulse, of a pulse with its pause, and until the watchdog acts."""
        pulse = max(1.0, round(self.fill_pulse / self.sample_time))
        pause = round(self.fill_pause / self.sample_time)
        return float(pulse), float(pulse + pause), self.watchdog_time / self.sample_time

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Take the times of the brake, and set thresholds clear of the sensors' noise."""
        checked_number("speed", speed, POSITIVE)
        designed, brake = cls(**given), drivetrain.brake
        slip, deceleration = designed.noise(sensors)
        known = {
            "minimum_slip": CLEAR * slip,
            "deceleration_threshold": max(designed.deceleration_threshold, CLEAR * deceleration),
        }
        if brake is not None:
            known |= {
                "fill_time": brake.fill_time,
                "vent_time": brake.vent_time,
                "fill_pulse": FILLED * brake.fill_time,
                "fill_pause": PAUSE,
            }
        return cls(**{**known, **given})

    def noise(self, sensors: Sensors) -> tuple[float, float]:
        """Standard deviations of slip [m/s] and deceleration [m/s2] by sensor noise."""
        gains = self._gains[0], self._gains[0]  # one filter for both
        return filtered_noise(sensors, self.sample_time, self.speed_filter_time, gains)

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> WspMemory:
        """Memory of a brake at `torque` [N.m]."""
        known = plausible(measurement)
        vehicle, none = known.vehicle_speed, 0.0 * known.vehicle_speed
        pressure = maximum(where(vehicle < 0.0, torque + none, -(torque + none)), 0.0)
        tracked = Tracked(vehicle, none)
        return WspMemory(tracked, known.wheel_speed, pressure, none > 0.0, none, none)

    def sample(
        self, measurement: Measurement[FloatArray], memory: WspMemory
    ) -> tuple[FloatArray, WspMemory]:
        """Torque [N.m] and new memory."""
        known = plausible(measurement)
        wheel_gain, fill_gain, vent_gain = self._gains
        vehicle = track(memory.vehicle, known.vehicle_speed, self._tracker_gains)
        change = wheel_gain * (known.wheel_speed - memory.wheel_speed)
        wheel = memory.wheel_speed + change
        backward = vehicle.speed < 0.0
        slower, gained = vehicle.speed - wheel, change / self.sample_time
        slip, acceleration = where(backward, -slower, slower), where(backward, -gained, gained)

        scale = maximum(abs(vehicle.speed), self.low_speed)
        high = maximum(self.slip_threshold * scale, self.minimum_slip)
        dives = acceleration < -self.deceleration_threshold
        recovers = acceleration > self.recovery_threshold
        vents = dives | ((slip > high) & negated(recovers))
        fills = (slip < self.slip_release / self.slip_threshold * high) & negated(dives)

        demand = maximum(where(backward, known.demand, -known.demand), 0.0)
        pulse, period, patience = self._samples
        filled = where(fills, memory.filled + 1.0, 0.0)
        empty = negated(fills) & (memory.pressure < EMPTY * demand)
        vented = where(vents | empty, memory.vented + 1.0, 0.0)
        slid = (memory.slid | vents) & (memory.pressure < FULL * demand)
        overdue = vented > patience
        pulses = negated(slid) | ((filled - 1.0) % period < pulse)
        target = where((fills & pulses) | overdue, demand, minimum(memory.pressure, demand))
        target = where(vents & negated(overdue), 0.0 * demand, target)
        gain = where(target > memory.pressure, fill_gain, vent_gain)
        pressure = memory.pressure + gain * (target - memory.pressure)
        torque = where(demand > 0.0, where(backward, target, -target), known.demand)
        return torque, WspMemory(vehicle, wheel, pressure, slid, filled, vented)
