"""Vibrations of a drivetrain: of wheels against each other, and of the motor against them.

On an elastic axle each wheel has half of the wheelset's inertia, J_w = J/2, of its load and, at the
same creepage, of its creep force, Q1 = Q/2. With the twist theta, k and d of the axle, b/2 on each
wheel,

    J_w domega_l/dt = T_l - r Q1(zeta_l) - (b/2) omega_l - k theta - d (omega_l - omega_r)
    J_w domega_r/dt = T_r - r Q1(zeta_r) - (b/2) omega_r + k theta + d (omega_l - omega_r)
    dtheta/dt       = omega_l - omega_r

The mean of both wheels is a rigid wheelset. The difference is an oscillator of omega_t^2 = 2 k/J_w
and 2 D omega_t = (2 d + b/2)/J_w, which a falling creep force drives independently of the
controller of the mean creepage.

An antiphase vibration with the amplitude a of either wheel's creepage, zeta_l = zeta_m +
a sin(omega t), grows at half of

    rate(a) = -(r^2/(J_w V)) N(a) - 2 D omega_t

with N(a), the describing function of z -> (Q1(zeta_m + z) - Q1(zeta_m - z))/2; N(0) = Q1'. N is
real, so a limit cycle, rate(a) = 0, has the frequency omega_t. If the contact has memory, N(a) is
the real part of the first harmonic of the rolled force at omega_t; the imaginary part would shift
the frequency. The mean creepage zeta_m is taken as constant: creep control holds it, up to a ripple
at 2 omega_t that the mean force has.

The creepage is sinusoidal if it grows little within a cycle, |rate(a)| << omega_t for all a up to
the cycle's; the error is of second order in that ratio. Equations of motion with the mean creepage
held exactly, for the wheelset of models/locomotive.toml on an axle of 50 Hz and D = 0.01 at the
steepest fall of its creep force, differ from the describing function by

    speed     rate(0)/omega_t    amplitude a    frequency    axle torque
    10 m/s    0.19               +0.02 %        -0.2 %       +0.2 %
     5 m/s    0.40               +0.1 %         -0.7 %       +1.0 %
     2 m/s    1.03               +0.4 %         -4.6 %       +6.5 %

A ripple of the mean creepage matters more: creep control with a gain of (1200 1/s) J V/r, sampled
every 0.25 ms, leaves a ripple that increases a by 2.6 % at 10 m/s and by 16 % at 2 m/s.

On a shaft of k and d the rotor, of I = i^2 I_m seen from the axle, vibrates against the wheelset,
of J - I without it, with omega_s^2 = k (1/I + 1/(J - I)). The wheels have the part I/J of that
vibration's kinetic energy, so it grows at half of I/J times their own rate,
-(r^2 Q'/V + b)/(J - I), less half of the shaft's d (1/I + 1/(J - I)); the error is of second order
in the ratio of both rates to omega_s. Control of the creepage that is slower than the vibration
does not stop it. Above, J is then that of the wheelset without the rotor.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from contactlib import kernel
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, Limits, checked, checked_number
from contactlib.element.force_element import creepage_limits
from contactlib.stability.poles import steady_rolling
from contactlib.vehicle.conditions import (
    Conditions,
    ContactConditions,
    GivenConditions,
    OperatingPoint,
)
from contactlib.vehicle.drivetrain import Axle, Drivetrain
from contactlib.vehicle.wheelset import Wheelset

__all__ = [
    "AntiphaseForce",
    "LimitCycle",
    "TorsionalState",
    "antiphase_eigenvalues",
    "bistable_range",
    "effective_slope",
    "shaft_pole",
    "shaft_threshold",
    "torsional_jacobian",
    "torsional_state",
    "torsional_threshold",
]

PHASES = 256  # over a quarter of a cycle, or a cycle of a contact with memory
ROLLING_TOLERANCE = 1e-5  # of the held traction over kinetic friction
MIN_AMPLITUDE = 1e-6  # amplitude / zeta0 below which rounding spoils the slope
AMPLITUDES = 241  # grid that brackets maxima and minima of the rate


def torsional_jacobian(drivetrain: Drivetrain, point: OperatingPoint) -> FloatArray:
    """Jacobian of (omega_left, omega_right, twist) and, unless held, speed, about `point`.

    With memory (held_force_left, held_force_right, unslipped_left, unslipped_right) follow, each
    force being that of a contact under twice the load of the wheel, as in the kernel's drivetrain.
    A motor on a shaft adds (motor_omega, shaft_twist) at the end; on a rigid axle its wheels have
    the states of `Wheelset.jacobians`. Of a vehicle's equal axles one vibrates against the others
    as at a held speed, and all together as one that moves its part of the mass.

    Returns
    -------
    ndarray, shape (n, n)
        Jacobian in SI units.

    Raises
    ------
    ValueError
        If the axle is rigid and the motor has no shaft.
    """
    motor, wheelset = drivetrain.motor, drivetrain.without_rotor
    if motor.shaft_stiffness is None:
        return _jacobian_of_wheels(checked_axle(drivetrain), wheelset, point)
    if drivetrain.axle is None:
        wheels, shares = wheelset.jacobians(point.creepage, **_contact_at(wheelset, point)), [1.0]
    else:
        wheels = _jacobian_of_wheels(drivetrain.axle, wheelset, point)
        shares = [drivetrain.axle.drive_share, 1.0 - drivetrain.axle.drive_share]
    share = np.zeros(len(wheels) + 2)
    share[: len(shares)] = shares
    matrix = np.pad(wheels, (0, 2))
    ahead = -share  # d shaft_twist/dt = motor_omega - sum share omega
    ahead[-2] = 1.0
    torque = motor.shaft_damping * ahead
    torque[-1] = motor.shaft_stiffness
    matrix += np.outer(share * len(shares) / wheelset.inertia, torque)
    matrix[-2:] = -torque / motor.inertia_at_axle, ahead
    return matrix


def _jacobian_of_wheels(axle: Axle, wheelset: Wheelset, point: OperatingPoint) -> FloatArray:
    """Jacobian of the wheels of an elastic axle."""
    own = 0.5 * wheelset.inertia
    rigid = wheelset.jacobians(point.creepage, **_contact_at(wheelset, point))
    spring, damper = axle.stiffness / own, axle.damping / own
    moves = 0 if wheelset.speed_held else 1
    memory = len(wheelset.states) - 1 - moves  # states of each wheel's contact
    matrix = np.zeros((3 + moves + 2 * memory,) * 2)
    matrix[:2, :3] = [[-damper, damper, -spring], [damper, -damper, spring]]
    matrix[2, :2] = 1.0, -1.0
    speed = list(range(3, 3 + moves))
    for side in (0, 1):
        places = [side, *speed, *(3 + moves + side + 2 * np.arange(memory))]
        part = rigid.copy()
        if moves:  # the resistance acts once, and each wheel's force is half of a contact's
            part[1] *= 0.5
        matrix[np.ix_(places, places)] += part
    return matrix


def _contact_at(wheelset: Wheelset, point: OperatingPoint) -> ContactConditions:
    at = wheelset.conditions(
        speed=point.speed, axle_load=point.axle_load, friction_scale=point.friction_scale
    )
    return at.contact


def antiphase_eigenvalues(drivetrain: Drivetrain, point: OperatingPoint) -> FloatArray:
    """The two eigenvalues of the antiphase vibration in closed form [1/s].

    lambda^2 - c lambda + omega_t^2 = 0 with c = -(r^2 Q'/V + b + 4 d)/J, for a held and a free
    speed. With memory they are the pair of largest imaginary part, or without vibration the two
    largest, of the equations that are linearised on the side of a slip-away (`Wheelset.jacobians`).
    As both wheels change sides within a cycle, small vibrations grow at a rate that differs by up
    to 0.3 % at 2 m/s and 1 % at 1 m/s (models/locomotive.toml on an axle of 50 Hz).
    """
    axle = checked_axle(drivetrain)
    if drivetrain.wheelset.element.memory:
        return _remembering_eigenvalues(drivetrain, axle, point)
    driven = drivetrain.wheelset.inertia * point.jacobian[0, 0] - 4.0 * axle.damping
    growth = driven / drivetrain.without_rotor.inertia
    root = np.emath.sqrt(0.25 * growth**2 - drivetrain.torsional_frequency**2)
    return np.asarray([0.5 * growth + root, 0.5 * growth - root])


def _remembering_eigenvalues(
    drivetrain: Drivetrain, axle: Axle, point: OperatingPoint
) -> FloatArray:
    """Eigenvalues of half the difference of omega, twist and states of the memory."""
    held, j = replace(drivetrain.without_rotor, mass=None), drivetrain.without_rotor.inertia
    matrix, places = np.zeros((4, 4)), [0, 2, 3]
    matrix[np.ix_(places, places)] = held.jacobians(point.creepage, **_contact_at(held, point))
    matrix[0, 0] -= 4.0 * axle.damping / j
    matrix[0, 1] = -2.0 * axle.stiffness / j
    matrix[1, 0] = 2.0
    eigenvalues = np.linalg.eigvals(matrix)
    order = np.lexsort((-eigenvalues.real, -np.abs(eigenvalues.imag)))
    return np.asarray(eigenvalues[order[:2]])


def torsional_threshold(drivetrain: Drivetrain, *, speed: float) -> float:
    """Slope Q1' of ONE wheel's creep force below which the antiphase vibration grows [N].

    -2 D omega_t J_w V/r^2 = -(2 d + b/2) V/r^2; the stiffness does not matter.
    """
    axle, wheelset, v = checked_axle(drivetrain), drivetrain.wheelset, _checked_speed(speed)
    return -(2.0 * axle.damping + 0.5 * wheelset.damping) * v / wheelset.radius**2


def shaft_pole(drivetrain: Drivetrain, point: OperatingPoint) -> complex:
    """Eigenvalue of the motor's vibration against the wheels: growth and frequency [1/s, rad/s].

    It is that of `torsional_jacobian` which is closest to the undamped one, i omega_s.

    Raises
    ------
    ValueError
        If the motor has no shaft.
    """
    _checked_shaft(drivetrain)
    poles = np.linalg.eigvals(torsional_jacobian(drivetrain, point))
    return complex(poles[np.argmin(np.abs(poles - 1j * drivetrain.shaft_frequency))])


def shaft_threshold(drivetrain: Drivetrain, *, speed: float) -> float:
    """Slope Q' of the creep force below which that vibration grows on a rigid axle [N].

    -(b + d (J/I)^2) V/r^2, if the damping is light; the stiffness does not matter.
    """
    _checked_shaft(drivetrain)
    wheelset, motor, v = drivetrain.wheelset, drivetrain.motor, _checked_speed(speed)
    lever = wheelset.inertia / motor.inertia_at_axle
    return -(wheelset.damping + motor.shaft_damping * lever**2) * v / wheelset.radius**2


def _checked_speed(speed: float) -> float:
    fastest = kernel.wheelset_limits()["speed"].at_most
    return checked_number("speed", speed, Limits(above=0.0, at_most=fastest))


def _checked_shaft(drivetrain: Drivetrain) -> None:
    if drivetrain.motor.shaft_stiffness is None:
        raise ValueError(
            "motor.shaft_stiffness = None: on a rigid shaft the motor does not vibrate"
        )


def checked_axle(drivetrain: Drivetrain) -> Axle:
    """Return the axle of a drivetrain for which this analysis holds.

    Raises
    ------
    ValueError
        If the axle is rigid, or a motor on a shaft turns one of its wheels more than the other.
    """
    axle = drivetrain.axle
    if axle is None:
        raise ValueError("drivetrain.axle = None: the wheels of a rigid axle do not vibrate")
    if drivetrain.motor.shaft_stiffness is not None and axle.drive_share != 0.5:
        raise ValueError(
            f"axle.drive_share = {axle.drive_share!r} must be 0.5 where the motor has a shaft, as "
            "else it moves with the wheels; torsional_jacobian contains both"
        )
    return axle


class AntiphaseForce:
    """z -> (Q1(zeta_m + z) - Q1(zeta_m - z))/2 for python-control's describing functions [N].

    Parameters
    ----------
    wheelset : Wheelset
        Both wheels together.
    point : OperatingPoint
        Operating point with the creepage zeta_m; speed, load and friction are constant.
    frequency : float, optional
        Angular frequency of the vibration [rad/s], on which a contact with memory depends.
    """

    def __init__(
        self, wheelset: Wheelset, point: OperatingPoint, frequency: float | None = None
    ) -> None:
        self._wheelset, self._point, self._frequency = wheelset, point, frequency
        if frequency is not None:
            self._frequency = checked_number("frequency", frequency, Limits(above=0.0))
        limits = creepage_limits(wheelset.element, point.speed)
        self._largest = min(limits.at_most - point.creepage, point.creepage - limits.at_least)
        self._scale = wheelset.element.saturation_creepage_at(
            axle_load=point.axle_load, friction_scale=point.friction_scale
        )

    def __call__(self, deviation: ArrayLike) -> Any:
        """Evaluate at deviations z of the creepage [1]."""
        z = checked("deviation", deviation, Limits(at_least=-self._largest, at_most=self._largest))
        ahead, behind = self._force(self._point.creepage + np.stack([z, -z]))
        return 0.25 * (ahead - behind)  # half a difference of halves

    def _force(self, creepage: FloatArray) -> FloatArray:
        record = self._wheelset.element.at_creepage(
            creepage,
            speed=self._point.speed,
            axle_load=self._point.axle_load,
            friction_scale=self._point.friction_scale,
        )
        return np.asarray(record["creep_force"])

    @cached_property
    def _cycle(self) -> FloatArray:
        """Sines at the midpoints of a quarter of a cycle; the rest follows by symmetry."""
        return np.sin(0.5 * np.pi * (np.arange(PHASES) + 0.5) / PHASES)

    def describing_function(self, amplitude: ArrayLike) -> FloatArray:
        """N(a) = (1/(pi a)) int f(a sin phi) sin phi dphi over a cycle [N]; N(0) = Q1'."""
        limits = Limits(at_least=0.0, at_most=self._largest)
        size, sines = checked("amplitude", amplitude, limits), self._cycle
        if self._wheelset.element.memory and self._frequency is not None:
            each = [self._remembered(a, self._frequency) for a in size.ravel().tolist()]
            return np.array(each).reshape(size.shape)
        still = size <= MIN_AMPLITUDE * self._scale
        first = 2.0 * np.mean(self(size[..., np.newaxis] * sines) * sines, axis=-1)
        small = 0.5 * self._point.creep_force_slope
        return np.where(still, small, first / np.where(still, 1.0, size))

    def _remembered(self, amplitude: float, frequency: float) -> float:
        """Re N(a) of a contact with memory, from one cycle after the transient."""
        element, point = self._wheelset.element, self._point
        size = max(amplitude, 1e-3 * self._scale)
        length = 2.0 * math.pi * point.speed / frequency  # of a cycle
        decay = element.memory_scales.relaxation_length
        cycles = 2 + math.ceil(8.0 * decay / length)
        turn = 2.0 * math.pi * np.arange(cycles * PHASES + 1) / PHASES
        parameters = {**element.parameters, **element.memory_parameters}
        native = kernel.NativeForceElement(element.table.native, parameters)
        ahead, behind = (
            native.roll(
                point.creepage + side * size * np.sin(turn),
                turn * length / (2.0 * math.pi),
                point.speed,
                ROLLING_TOLERANCE,
                point.axle_load,
                point.friction_scale,
            )
            for side in (1.0, -1.0)
        )
        last = slice(-PHASES, None)
        return float(0.5 * np.mean((ahead - behind)[last] * np.sin(turn[last])) / size)

    def _isstatic(self) -> bool:
        return True


def effective_slope(wheelset: Wheelset, point: OperatingPoint, amplitude: ArrayLike) -> FloatArray:
    """Describing function N(a), the effective slope of one wheel's creep force [N].

    Parameters
    ----------
    wheelset, point
        Both wheels together, and their operating point.
    amplitude : array_like
        Amplitude a of the deviation of the creepage from its mean, at least zero [1].
    """
    control = optional_library("control")

    size = checked("amplitude", amplitude, Limits(at_least=0.0))
    return np.asarray(control.describing_function(AntiphaseForce(wheelset, point), size).real)


class LimitCycle(NamedTuple):
    """Antiphase vibration that neither grows nor decays.

    Attributes
    ----------
    amplitude : float
        Amplitude of either wheel's creepage about the mean [1].
    frequency : float
        Frequency [Hz].
    axle_torque : float
        Amplitude of stiffness times twist, 2 k V a/(r omega_t) [N.m].
    stable : bool
        Whether neighbouring vibrations approach it.
    """

    amplitude: float
    frequency: float
    axle_torque: float
    stable: bool


class TorsionalState(NamedTuple):
    """Antiphase stability and limit cycles at one mean creepage.

    Attributes
    ----------
    creepage, speed : float
        Mean creepage and speed [1, m/s].
    equilibrium_stable : bool
        Whether small vibrations decay.
    limit_cycles : tuple of LimitCycle
        Limit cycles by rising amplitude.
    """

    creepage: float
    speed: float
    equilibrium_stable: bool
    limit_cycles: tuple[LimitCycle, ...]

    @property
    def bistable(self) -> bool:
        """Whether the disturbance decides if the wheels come to rest or keep vibrating."""
        return self.equilibrium_stable and any(cycle.stable for cycle in self.limit_cycles)


def torsional_state(drivetrain: Drivetrain, point: OperatingPoint) -> TorsionalState:
    """Stability and limit cycles from the describing function, at the constant creepage of `point`.

    Raises
    ------
    ValueError
        If the axle is rigid.
    """
    rate, amplitudes, rates = _curve(drivetrain, point)
    cycles = []
    for (a, b), (at_a, at_b) in zip(pairwise(amplitudes), pairwise(rates), strict=True):
        if at_a * at_b < 0.0:
            root = float(brentq(rate, a, b, xtol=1e-12))
            cycles.append(_cycle(drivetrain, point, root, stable=bool(at_b < 0.0)))
    return TorsionalState(point.creepage, point.speed, bool(rates[0] < 0.0), tuple(cycles))


def bistable_range(
    drivetrain: Drivetrain, at: Conditions | None = None, **given: Unpack[GivenConditions]
) -> tuple[float, float] | None:
    """Mean creepages between which a stable equilibrium and a stable limit cycle coexist [1].

    The range begins where small vibrations decay again, beyond the steepest fall of the creep
    force, and ends where the cycle merges with its unstable neighbour. It is None if small
    vibrations never grow, still grow at a hundred times the saturation creepage, or no cycle
    exists where they decay.

    Parameters
    ----------
    drivetrain : Drivetrain
        Wheelset on an elastic axle.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.

    Raises
    ------
    ValueError
        As `torsional_state`, or if a value is out of range.
    """
    at = drivetrain.wheelset.conditions(at, **given)
    wheelset = steady_rolling(drivetrain.wheelset, "bistable_range", at)
    drivetrain = replace(drivetrain, wheelset=wheelset)

    def growth(creepage: float) -> float:
        point = wheelset.balanced(at, creepage=creepage)
        return torsional_threshold(drivetrain, speed=at.speed) - 0.5 * point.creep_force_slope

    def largest_rate(creepage: float) -> float:
        rate, grid = _rate(drivetrain, wheelset.balanced(at, creepage=creepage))
        rates = rate(grid)
        highest = float(rates[1:].max())  # over a > 0
        ahead, behind = rates[1:-1] - rates[:-2], rates[1:-1] - rates[2:]
        # Between its neighbours a maximum is no higher above them than they are below it.
        tops = (
            (ahead >= 0.0) & (behind >= 0.0) & (rates[1:-1] + np.maximum(ahead, behind) >= highest)
        )
        for i in np.flatnonzero(tops) + 1:
            highest = max(highest, float(rate(_turn(rate, *grid[[i - 1, i + 1]], top=True))))
        return highest

    scale = wheelset.element.saturation_creepage_at(
        axle_load=at.axle_load, friction_scale=at.friction_scale
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
    """rate(a) of the module docstring, rising amplitudes from zero, and the rates at these.

    The amplitudes include the maxima and minima of the rate, so that they separate even two limit
    cycles that lie close together.
    """
    rate, grid = _rate(drivetrain, point)
    rates = rate(grid)
    rises = np.diff(rates)
    turns = 1 + np.flatnonzero(rises[:-1] * rises[1:] <= 0.0)
    extrema = [_turn(rate, *grid[[i - 1, i + 1]], top=bool(rises[i - 1] > 0.0)) for i in turns]
    at = [rate(a) for a in extrema]
    amplitudes, rates = np.append(grid, extrema), np.append(rates, at)
    order = np.argsort(amplitudes)
    return rate, amplitudes[order], rates[order]


def _turn(rate: Any, low: float, high: float, *, top: bool) -> float:
    """Amplitude between two others at which the rate is largest (`top`) or smallest."""
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
    """rate(a), and amplitudes from where N is still Q1' to the end of the fall."""
    axle, wheelset = checked_axle(drivetrain), drivetrain.without_rotor
    own, damping = 0.5 * wheelset.inertia, 2.0 * axle.damping + 0.5 * wheelset.damping
    force = AntiphaseForce(wheelset, point, drivetrain.torsional_frequency)
    scale = wheelset.element.saturation_creepage_at(
        axle_load=point.axle_load, friction_scale=point.friction_scale
    )

    def rate(amplitude: ArrayLike) -> FloatArray:
        slope = force.describing_function(amplitude)
        return -(wheelset.radius**2 * slope / point.speed + damping) / own

    largest = 3.0 * (abs(point.creepage) + 3.0 * scale)
    # Smaller amplitudes would give spurious maxima by rounding.
    return rate, np.append(0.0, np.geomspace(1e-2 * scale, largest, AMPLITUDES))


def _cycle(
    drivetrain: Drivetrain, point: OperatingPoint, amplitude: float, *, stable: bool
) -> LimitCycle:
    frequency = drivetrain.torsional_frequency
    twist = 2.0 * point.speed * amplitude / (drivetrain.wheelset.radius * frequency)  # [rad]
    torque = checked_axle(drivetrain).stiffness * twist
    return LimitCycle(amplitude, frequency / (2.0 * math.pi), torque, stable)
