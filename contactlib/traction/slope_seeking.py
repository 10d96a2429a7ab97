"""Sampled creep control that finds the peak of the creep force for any friction.

Where only friction changes, the peak moves along a ray of constant creepage / creep force, as both
zeta0 and f_d P are proportional to f_d. So the reference creepage, a compliance times the observed
load torque, follows without delay. It is constant below a minimum load: otherwise a reference that
is too small would lower the torque, the torque would lower the reference, and both would tend to
zero.

Where a layer on the rail lowers the slope of the creep force as well, as Polach found on wet rails,
the compliance of the peak is several times larger. It is found by climbing the slope of the creep
force, as in A. Kawamura, M. Cao et al., "Measurement of tractive force in the creep region and
maximum adhesion control of high speed railway systems"; a small dither of the reference reveals the
slope. The search is fast where the slope is clear, and a wheel that slips far beyond the reference
lowers it. Load torque and slope are observed by `contactlib.traction.filters`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple, Self

from contactlib.base.elementwise import maximum, minimum, negated, where
from contactlib.base.quantities import FloatArray, Quantity
from contactlib.element.force_element import RADIUS
from contactlib.traction.creep_pi import LimiterMemory, SlipLimiter
from contactlib.traction.design import minimum_slip, slip_gains, sticking
from contactlib.traction.filters import (
    LoadObserver,
    Moments,
    Observed,
    add_sample,
    elasticity,
    slip_noise,
)
from contactlib.traction.interface import Measurement, plausible
from contactlib.traction.search import Ranges, around_design
from contactlib.traction.sensors import DELAY, SPEED_NOISE, Sensors
from contactlib.vehicle.drivetrain import LAG, Drivetrain
from contactlib.vehicle.wheelset import INERTIA

HELD = 0.3  # largest deviation of the creepage / reference at which the slope is used
RANGE = (0.7, 10.0)  # limits of the compliance / first compliance; see `for_drivetrain`
STEEP = 0.2  # elasticity from which a wheel that slows down is on a rising branch
NOISES = 2.0  # standard deviations of the slip by which it has to slow down
AT_PEAK = 1.35  # gain / that of `slip_gains`, which allows for a pole that the peak has not
FIRST = 2.7  # first compliance / that of the sticking contact
CLEAR = (-0.1, 0.7)  # elasticity below and above which the slope is clear
FAST = 4.0  # rate of the search where it is clear / rate elsewhere
BEYOND = (1.5, 3.5)  # creepage / reference from which, and up to which, it lowers the compliance
LOWERING = 0.9  # relative rate of that for every reference of creepage [1/s]
MIN_TORQUE = 1e-9  # of any least load [N.m]: the reference must not be zero
MIN_TRACTION = 0.06  # traction coefficient of the least load: half of that of very slippery rails


class SeekingMemory(NamedTuple):
    """Memory of the controller.

    Attributes
    ----------
    limiter : LimiterMemory
        Memory of the inner loop.
    observed : Observed
        State of the load observer.
    moments : Moments
        Moments of forward load and creepage, as the demand may turn.
    gain : ndarray
        Compliance / first compliance [1].
    phase : ndarray
        Phase of the dither, 0 to 1.
    """

    limiter: LimiterMemory
    observed: Observed
    moments: Moments
    gain: FloatArray
    phase: FloatArray


@dataclass(frozen=True, kw_only=True)
class SlopeSeeking(SlipLimiter):
    """Sampled controller that limits the demand to hold the peak of the creep force.

    The parameters that are not listed here are those of `traction.SlipLimiter`, which holds the
    reference creepage that is sought.

    Parameters
    ----------
    radius : float
        Rolling radius of the wheelset [m].
    inertia : float
        Moment of inertia of the wheelset with its drive [kg.m2].
    delay : float, optional
        Delay of the sensors, a whole number of samples [s].
    motor_lag : float, optional
        Lag of the motor [s].
    brake_lag : float, optional
        Lag of braking [s].
    first_compliance : float
        Initial reference creepage / load torque [1/(N.m)].
    minimum_load : float, optional
        Load torque below which the reference is constant [N.m].
    largest_reference : float, optional
        Bound of the reference creepage [1].
    seeking_rate : float, optional
        Relative rate of the compliance for an elasticity of one above the target [1/s]; four times
        as much where the elasticity is above 0.7 or below -0.1.
    target_elasticity : float, optional
        Elasticity at which the search settles [1]; the peak has zero. At 0.2 the last per cent of
        creepage, and so of slip work, still gives 0.2 per cent of force, and a broad peak is not
        climbed to the top.
    dither : float, optional
        Amplitude of the dither / reference [1].
    dither_period : float, optional
        Period of the dither [s].
    memory_time : float, optional
        Time over which the slope is estimated [s].
    observer_time : float, optional
        Time constant of the load observer [s].
    slip_noise : float, optional
        Standard deviation of the slip from the load observer [m/s].
    """

    radius: Annotated[float, RADIUS]
    inertia: Annotated[float, INERTIA]
    delay: Annotated[float, DELAY] = 0.0
    motor_lag: Annotated[float, LAG] = 0.0
    brake_lag: Annotated[float, LAG] = 0.0
    first_compliance: Annotated[float, Quantity("1/(N.m)", above=0.0)]
    minimum_load: Annotated[float, Quantity("N.m", at_least=0.0, usual=(0.0, 3e5))] = 0.0
    largest_reference: Annotated[float, Quantity("1", at_least=1e-4, percent=True)] = 0.08
    seeking_rate: Annotated[float, Quantity("1/s", at_least=0.0, usual=(0.0, 20.0))] = 0.36
    target_elasticity: Annotated[float, Quantity("1", at_least=-0.5, at_most=0.5)] = 0.28
    dither: Annotated[float, Quantity("1", at_least=1e-3, at_most=0.5)] = 0.037
    dither_period: Annotated[float, Quantity("s", above=0.0, usual=(1e-2, 20.0))] = 0.58
    memory_time: Annotated[float, Quantity("s", above=0.0, usual=(1e-3, 20.0))] = 0.2
    observer_time: Annotated[float, Quantity("s", above=0.0, usual=(1e-4, 5.0))] = 0.034
    slip_noise: Annotated[float, SPEED_NOISE] = 0.0

    @property
    def search_ranges(self) -> Ranges:
        """Settings that `tune` searches."""
        return {
            **around_design(
                self,
                "first_compliance",
                "seeking_rate",
                "target_elasticity",
                "dither",
                "dither_period",
                "memory_time",
                "observer_time",
            ),
            **super().search_ranges,
        }

    def __post_init__(self) -> None:
        super().__post_init__()
        self.observer.delayed_samples  # noqa: B018 - refuses a delay that is not whole

    @cached_property
    def observer(self) -> LoadObserver:
        """Observer of the load torque."""
        return LoadObserver(
            sample_time=self.sample_time,
            radius=self.radius,
            inertia=self.inertia,
            delay=self.delay,
            motor_lag=self.motor_lag,
            brake_lag=self.brake_lag,
            filter_time=self.observer_time,
        )

    @cached_property
    def _gains(self) -> tuple[float, float]:
        """Gains of the slow means and of the moments per sample."""
        step = self.sample_time
        return (
            -math.expm1(-step / (0.5 * self.dither_period)),
            -math.expm1(-step / self.memory_time),
        )

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Design from constants of drive, sensors and contact stiffness, without friction.

        The gains are those of `slip_gains` for the largest pole for which it is robust, the
        proportional one 1.35 times as large. The first compliance is 2.7 times that of the sticking
        contact, and the search stays between 1.9 and 27 times. Both factors are what `tune` found,
        rounded. Laws with k_hat from 0 to 2 have their peak at 2.0 to 1.5 (line contact) and 2.4 to
        1.5 (ellipse) times the sticking compliance. So the search begins beyond it, with some 96 %
        of the largest force at k_hat = 0.3, and at its lower end all give 96 % or more. A layer
        with 0.29 of the slope moves the peak of the shipped locomotive from 2.2 to 7.5 times.
        """
        wheelset, sample_time = drivetrain.wheelset, given.get("sample_time", cls.sample_time)
        filter_time = given.get("speed_filter_time", cls.speed_filter_time)
        gains = slip_gains(drivetrain, pole=math.inf, sensors=sensors, sample_time=sample_time)
        gains["proportional_gain"] *= AT_PEAK
        if "proportional_gain" in given:
            gains["brake_share"] = 1.0
        stick = sticking(wheelset, speed, sensors)
        known = {
            "radius": wheelset.radius,
            "inertia": wheelset.inertia,
            "delay": sensors.delay,
            "motor_lag": drivetrain.motor.lag,
            "brake_lag": min(drivetrain.brake_lag, LAG.at_most),
            **gains,
            "minimum_slip": minimum_slip(sensors, sample_time, filter_time),
            "first_compliance": FIRST * stick["stick_compliance"],
            "minimum_load": MIN_TRACTION * wheelset.radius * wheelset.element.axle_load,
            **stick,
        }
        designed = cls(**{**known, **given})
        if "slip_noise" in given:
            return designed
        noise = slip_noise(
            sensors, designed.sample_time, designed.speed_filter_time, designed.observer.gains[0]
        )
        return cls(**{**known, **given, "slip_noise": noise})

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> SeekingMemory:
        """Memory of a drive at `torque` [N.m]."""
        known = plausible(measurement)
        limiter = self.start_limiter(known, torque)
        slip, _ = self.slip(known, limiter)
        none = 0.0 * slip.speed
        return SeekingMemory(
            limiter,
            self.observer.start(torque, known.wheel_speed, slip.sign * slip.speed),
            Moments(torque + none, slip.sign * maximum(slip.speed / slip.scale, 0.0), none, none),
            none + 1.0,
            none,
        )

    def sample(
        self, measurement: Measurement[FloatArray], memory: SeekingMemory
    ) -> tuple[FloatArray, SeekingMemory]:
        """Torque [N.m] and new memory."""
        known = plausible(measurement)
        slip, vehicle = self.slip(known, memory.limiter)
        observed, load, slipped = self.observer.observe(
            memory.observed,
            known.torque,
            known.wheel_speed,
            slip.sign * slip.speed,
            braking=slip.braking,
        )
        load, creepage = slip.sign * load, slip.sign * slipped / slip.scale
        last = memory.moments.turned(slip.sign)
        # What the noise allows at least is not below the reference: else the gain would wind up.
        minimum_load = maximum(self.minimum_load, MIN_TORQUE)
        first = self.first_compliance * maximum(load, minimum_load)
        audible = minimum(self.minimum_slip / (slip.scale * first), 1.0)
        gain = maximum(memory.gain, audible)
        reference = minimum(gain * first, self.largest_reference)

        expected = self.dither * self.dither * reference * reference
        away = creepage - reference
        away = away * away
        # A load that changes more than the creepage indicates other rails, not a slope.
        change = (load - last.load) / maximum(last.load, minimum_load)
        moved = change * reference
        moments = add_sample(
            last,
            load,
            creepage,
            away=maximum(away, moved * moved),
            expected=expected,
            gains=self._gains,
        )
        slope = elasticity(
            moments,
            noise=self.slip_noise * self.slip_noise / (slip.scale * slip.scale),
            expected=expected,
            minimum_load=1e-3 * slip.demand + 1.0,
        )
        limiting = memory.limiter.limiting
        near = HELD * HELD * reference * reference
        # A wheel that slows down towards the reference and takes the load along is on a rising
        # branch: the reference is too small. The moments exclude such samples.
        before = last.creepage
        slowing = before - creepage
        falling = (slowing > NOISES * self.slip_noise / slip.scale) & (creepage > reference)
        falling = falling & (-change * before > STEEP * slowing)
        slope = where(falling, 1.0, slope)
        seeking = limiting & ((away < near) | falling)
        clear = (slope < CLEAR[0]) | (slope > CLEAR[1])
        rate = self.seeking_rate * where(clear, FAST, 1.0) * seeking
        beyond = minimum(maximum(creepage / reference, BEYOND[0]), BEYOND[1]) - BEYOND[0]
        lowering = LOWERING * beyond * (limiting & negated(falling))
        rise = rate * (slope - self.target_elasticity) - lowering
        gain = gain * (1.0 + self.sample_time * rise)
        gain = minimum(maximum(gain, RANGE[0]), RANGE[1])

        phase = (memory.phase + self.sample_time / self.dither_period) % 1.0
        wave = 4.0 * abs(phase - 0.5) - 1.0  # triangle, -1 to 1
        torque, limiter = self.limit(
            slip, vehicle, reference * (1.0 + self.dither * wave), memory.limiter
        )
        moments = moments.turned(slip.sign)
        return torque, SeekingMemory(limiter, observed, moments, gain, phase)
