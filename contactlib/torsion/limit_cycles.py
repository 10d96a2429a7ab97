"""Wheelset on an elastic axle: vibrations of its wheels against each other that keep their size.

The antiphase vibration of `contactlib.torsion.linear` with an amplitude a of either wheel's
creepage, zeta_l = zeta_m + a sin(omega t), grows by half of

    rate(a) = -(r^2/(J_w V)) N(a) - 2 D omega_t

with N(a), the describing function of z -> (Q1(zeta_m + z) - Q1(zeta_m - z))/2; N(0) = Q1'. N is
real, so a limit cycle, rate(a) = 0, has the frequency omega_t. The mean creepage zeta_m is taken as
held: creep control sees to it, but for a ripple at 2 omega_t that the mean force has besides.

The creepage is a sine if it grows little within a cycle, |rate(a)| << omega_t for all a up to the
cycle's; the error is of second order in that ratio. Equations of motion with the mean creepage held
exactly, for the wheelset of models/locomotive.toml on an axle of 50 Hz and D = 0.01 and at the
steepest fall of its creep force, differ from the describing function by

    speed     rate(0)/omega_t    amplitude a    frequency    axle torque
    10 m/s    0.20               +0.02 %        -0.2 %       +0.2 %
     5 m/s    0.43               +0.1 %         -0.7 %       +1.0 %
     2 m/s    1.09               +0.5 %         -4.5 %       +6.3 %

A ripple of the mean creepage matters more: a torque of (1200 1/s) J V/r times the error, sampled
every 0.25 ms, leaves one with which a is larger by 2.8 % at 10 m/s and by 17 % at 2 m/s.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from contactlib.drivetrain import Drivetrain
from contactlib.element import creepage_limits
from contactlib.parameters import FloatArray, Limits, checked
from contactlib.torsion.linear import checked_axle, torsional_threshold
from contactlib.wheelset import OperatingPoint, Wheelset

PHASES = 256  # over a quarter of a cycle
SMALLEST = 1e-6  # amplitude, over zeta0, of which rounding leaves a slope
AMPLITUDES = 241  # among which maxima and minima of the rate are bracketed


class AntiphaseForce:
    """z -> (Q1(zeta_m + z) - Q1(zeta_m - z))/2 for python-control's describing functions [N].

    Parameters
    ----------
    wheelset : Wheelset
        Both wheels together.
    point : OperatingPoint
        Its creepage is zeta_m; speed, load and friction are held.
    """

    def __init__(self, wheelset: Wheelset, point: OperatingPoint) -> None:
        self._wheelset, self._point = wheelset, point
        limits = creepage_limits(wheelset.element, point.speed)
        self._largest = min(limits.at_most - point.creepage, point.creepage - limits.at_least)
        self._scale = wheelset.element.saturation_creepage_at(
            normal_load=point.normal_load, friction_scale=point.friction_scale
        )

    def __call__(self, deviation: ArrayLike) -> Any:
        """Value at any deviations z of the creepage [1]."""
        z = checked("deviation", deviation, Limits(at_least=-self._largest, at_most=self._largest))
        ahead, behind = self._force(self._point.creepage + np.stack([z, -z]))
        return 0.25 * (ahead - behind)  # half a difference of halves

    def _force(self, creepage: FloatArray) -> FloatArray:
        record = self._wheelset.element.at_creepage(
            creepage,
            speed=self._point.speed,
            normal_load=self._point.normal_load,
            friction_scale=self._point.friction_scale,
        )
        return np.asarray(record["creep_force"])

    @cached_property
    def _cycle(self) -> FloatArray:
        """Sines at the midpoints of a quarter of a cycle: the rest mirrors them."""
        return np.sin(0.5 * np.pi * (np.arange(PHASES) + 0.5) / PHASES)

    def describing_function(self, amplitude: ArrayLike) -> FloatArray:
        """N(a) = (1/(pi a)) int f(a sin phi) sin phi dphi over a cycle [N]; N(0) = Q1'."""
        limits = Limits(at_least=0.0, at_most=self._largest)
        size, sines = checked("amplitude", amplitude, limits), self._cycle
        still = size <= SMALLEST * self._scale
        first = 2.0 * np.mean(self(size[..., np.newaxis] * sines) * sines, axis=-1)
        small = 0.5 * self._point.creep_force_slope
        return np.where(still, small, first / np.where(still, 1.0, size))

    def _isstatic(self) -> bool:
        return True


def effective_slope(wheelset: Wheelset, point: OperatingPoint, amplitude: ArrayLike) -> FloatArray:
    """N(a), the slope of one wheel's creep force that an amplitude of creepage feels [N].

    Parameters
    ----------
    wheelset, point
        Both wheels together, and where they vibrate.
    amplitude : array_like
        Amplitude a of the creepage against the mean, at least zero [1].
    """
    import control

    size = checked("amplitude", amplitude, Limits(at_least=0.0))
    return np.asarray(control.describing_function(AntiphaseForce(wheelset, point), size).real)


class LimitCycle(NamedTuple):
    """Vibration of the wheels against each other that neither grows nor decays.

    Attributes
    ----------
    amplitude : float
        Of either wheel's creepage against the mean [1].
    frequency : float
        [Hz].
    axle_torque : float
        Amplitude of stiffness times twist, 2 k V a/(r omega_t) [N.m].
    stable : bool
        Whether neighbouring vibrations run into it.
    """

    amplitude: float
    frequency: float
    axle_torque: float
    stable: bool


class TorsionalState(NamedTuple):
    """What the wheels can do against each other at one mean creepage.

    Attributes
    ----------
    creepage, speed : float
        [1, m/s].
    equilibrium_stable : bool
        Whether small vibrations decay.
    limit_cycles : tuple of LimitCycle
        By rising amplitude.
    """

    creepage: float
    speed: float
    equilibrium_stable: bool
    limit_cycles: tuple[LimitCycle, ...]

    @property
    def bistable(self) -> bool:
        """Whether it depends on the kick if the wheels come to rest or keep vibrating."""
        return self.equilibrium_stable and any(cycle.stable for cycle in self.limit_cycles)


def torsional_state(drivetrain: Drivetrain, point: OperatingPoint) -> TorsionalState:
    """Stability and limit cycles by the describing function, at the creepage of `point` held.

    Raises
    ------
    ValueError
        If the axle is rigid, or the creep force does not follow the creepage at once.
    """
    rate, amplitudes, rates = _curve(drivetrain, point)
    cycles = []
    for (a, b), (at_a, at_b) in zip(pairwise(amplitudes), pairwise(rates), strict=True):
        if at_a * at_b < 0.0:
            root = float(brentq(rate, a, b, xtol=1e-12))
            cycles.append(_cycle(drivetrain, point, root, stable=bool(at_b < 0.0)))
    return TorsionalState(point.creepage, point.speed, bool(rates[0] < 0.0), tuple(cycles))


def bistable_range(
    drivetrain: Drivetrain,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
) -> tuple[float, float] | None:
    """Mean creepages between which a stable equilibrium and a stable limit cycle coexist [1].

    From where small vibrations decay again, beyond the steepest fall of the creep force, to where
    the cycle meets its unstable neighbour and ends. None if small vibrations never grow, still grow
    at a hundred times the saturation creepage, or no cycle outlasts their growth.

    Raises
    ------
    ValueError
        As `torsional_state`; or if a value is out of range.
    """
    wheelset = drivetrain.wheelset
    given: dict[str, Any] = {
        "speed": speed,
        "normal_load": normal_load,
        "friction_scale": friction_scale,
    }

    def growth(creepage: float) -> float:
        point = wheelset.balanced(creepage=creepage, **given)
        return torsional_threshold(drivetrain, speed=speed) - 0.5 * point.creep_force_slope

    def largest_rate(creepage: float) -> float:
        _, _, rates = _curve(drivetrain, wheelset.balanced(creepage=creepage, **given))
        return float(rates[1:].max())  # over a > 0

    scale = wheelset.element.saturation_creepage_at(
        normal_load=normal_load, friction_scale=friction_scale
    )
    grid = scale * np.geomspace(0.05, 100.0, 601)
    growths = np.array([growth(z) for z in grid])
    unstable = np.flatnonzero(growths > 0.0)
    if unstable.size == 0 or unstable[-1] == grid.size - 1:
        return None
    last = int(unstable[-1])
    low = float(brentq(growth, grid[last], grid[last + 1], xtol=1e-12))
    beyond = [low * (1.0 + 1e-6), *(low * np.geomspace(1.02, 20.0, 60)).tolist()]
    for a, b in pairwise(beyond):
        if largest_rate(b) < 0.0:
            if largest_rate(a) < 0.0:
                return None
            return low, float(brentq(largest_rate, a, b, xtol=1e-7 * low))
    return low, math.inf


def _curve(drivetrain: Drivetrain, point: OperatingPoint) -> tuple[Any, FloatArray, FloatArray]:
    """rate(a) of the module's head, rising amplitudes from zero over all of it, and their rates.

    The curve's maxima and minima are among them: two limit cycles lie on two sides of one, however
    close they are.
    """
    rate, grid = _rate(drivetrain, point)
    rates = rate(grid)
    rises = np.diff(rates)
    turns = 1 + np.flatnonzero(rises[:-1] * rises[1:] <= 0.0)
    found = [_turn(rate, *grid[[i - 1, i + 1]], top=bool(rises[i - 1] > 0.0)) for i in turns]
    at = [rate(a) for a in found]
    amplitudes, rates = np.append(grid, found), np.append(rates, at)
    order = np.argsort(amplitudes)
    return rate, amplitudes[order], rates[order]


def _turn(rate: Any, low: float, high: float, *, top: bool) -> float:
    """Amplitude between two others at which the rate is largest, or else smallest."""
    sense = -1.0 if top else 1.0
    return float(
        minimize_scalar(
            lambda a: sense * rate(a),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-7 * high},
        ).x
    )


def _rate(drivetrain: Drivetrain, point: OperatingPoint) -> tuple[Any, FloatArray]:
    """rate(a), and amplitudes that reach from where N is still Q1' to where the fall is over."""
    axle, wheelset = checked_axle(drivetrain), drivetrain.wheelset
    own, damping = 0.5 * wheelset.inertia, 2.0 * axle.damping + 0.5 * wheelset.damping
    force = AntiphaseForce(wheelset, point)
    scale = wheelset.element.saturation_creepage_at(
        normal_load=point.normal_load, friction_scale=point.friction_scale
    )

    def rate(amplitude: ArrayLike) -> FloatArray:
        slope = force.describing_function(amplitude)
        return -(wheelset.radius**2 * slope / point.speed + damping) / own

    largest = 3.0 * (abs(point.creepage) + 3.0 * scale)
    # Further down rounding makes maxima of its own.
    return rate, np.append(0.0, np.geomspace(1e-2 * scale, largest, AMPLITUDES))


def _cycle(
    drivetrain: Drivetrain, point: OperatingPoint, amplitude: float, *, stable: bool
) -> LimitCycle:
    frequency = drivetrain.torsional_frequency
    twist = 2.0 * point.speed * amplitude / (drivetrain.wheelset.radius * frequency)  # [rad]
    torque = checked_axle(drivetrain).stiffness * twist
    return LimitCycle(amplitude, frequency / (2.0 * math.pi), torque, stable)
