"""Linear creep control (wheelset, delay, motor, PI controller) and the margins of its loop.

Open loops lead from ``creepage_error`` to ``creepage``, closed ones from ``creepage_reference``;
the blocks are connected by the names of their signals. All systems are linearised about one
operating point, and signals are deviations from it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    Limits,
    checked_number,
    checked_whole,
    derived,
    shown,
)
from contactlib.stability.delay import NO_TIME, TIMES
from contactlib.vehicle.conditions import OperatingPoint
from contactlib.vehicle.wheelset import Wheelset

if TYPE_CHECKING:
    from control import StateSpace

GAINS = Limits(at_least=1e-12, at_most=1e15)  # [N.m]
INTEGRAL_GAINS = Limits(at_least=0.0, at_most=1e15)  # [N.m/s]
SAMPLE_TIMES = Limits(at_least=1e-9, at_most=1e6)  # [s]
PADE_ORDERS = Limits(at_least=1.0, at_most=12.0)  # for higher orders the coefficients overflow
MAX_SAMPLES = 1000  # of delay: each is a state of the loop
POINTS = 2000  # frequencies, between which a cubic spline gives the margins
BEYOND = 300.0  # factor of the frequency range beyond the slowest and the fastest pole


class Margins(NamedTuple):
    """Stability margins of a loop.

    Attributes
    ----------
    gain_lower, gain_upper : float
        Factors on the gain between which the loop stays stable [1]. The lower one is above zero if
        the loop holds an unstable point.
    phase : float
        Smallest phase lag that ends stability [rad].
    crossover : float
        Angular frequency at which the loop gain is one, for the delay margin [rad/s].
    delay : float
        Smallest additional delay that ends stability [s].
    sensitivity_peak : float
        M_s = max |1/(1 + L)|, the inverse of the smallest distance to -1 [1].
    disk : float
        Disk margin alpha of (S - T)/2 [1].
    disk_gain, disk_phase : float
        Factor by which the gain may rise or fall [1], and phase by which it may turn at the same
        time [rad].
    """

    gain_lower: float
    gain_upper: float
    phase: float
    crossover: float
    delay: float
    sensitivity_peak: float
    disk: float
    disk_gain: float
    disk_phase: float


def growth_rate(poles: ArrayLike, sample_time: float = 0.0) -> float:
    """Largest growth rate of the poles [1/s]: Re s, or log|z|/h of a sampled loop."""
    roots = np.asarray(poles, dtype=np.complex128)
    if roots.size == 0 or not np.isfinite(roots).all():
        raise ValueError(f"poles = {shown(poles)} must be finite numbers, at least one")
    sample_time = checked_number("sample_time", sample_time, Limits(at_least=0.0))
    if sample_time == 0.0:
        return float(roots.real.max())
    size = float(np.abs(roots).max())
    if size == 0.0:
        return -math.inf
    largest = math.log(size)
    return derived(
        "growth rate", lambda: largest / sample_time, {"sample_time": sample_time}, FINITE
    )


def frequencies(loop: StateSpace) -> FloatArray:
    """Angular frequencies that cover the poles of a loop and of its closed loop [rad/s].

    python-control's own choice misses slow poles, such as the speed of a free wheelset, and the
    phase of delays. Put 0 in front of them for `control.nyquist_response`, which goes around the
    pole of an integrator there.

    Parameters
    ----------
    loop : control.StateSpace
        Open loop.

    Returns
    -------
    ndarray, shape (2000,)
        Rising, up to half the sampling frequency if the loop is sampled.

    Notes
    -----
    Zeros are left out: some are lost to rounding, and far beyond the fastest pole they turn no
    curve near -1.
    """
    control = optional_library("control")

    features = np.concatenate([loop.poles(), control.feedback(loop, 1.0).poles()])
    if loop.dt:
        features = np.log(features[np.abs(features) > 1e-9]) / loop.dt
    sizes = np.abs(features)
    sizes = sizes[sizes > np.finfo(np.float64).eps * sizes.max()]
    slowest, fastest = sizes.min() / BEYOND, sizes.max() * BEYOND
    if loop.dt:
        fastest = math.pi / loop.dt
    return np.geomspace(min(slowest, 0.1 * fastest), fastest, POINTS)


def margins(loop: StateSpace) -> Margins:
    """Margins of an open loop, on a grid of frequencies that covers all its poles.

    Notes
    -----
    python-control computes them from the frequency response. Its alternative, the coefficients of
    the transfer function, misses crossovers of a sampled loop.

    Raises
    ------
    ValueError
        If the closed loop is not stable, and so has no margins.
    """
    control = optional_library("control")

    growth = growth_rate(control.feedback(loop, 1.0).poles(), loop.dt)
    if growth >= 0.0:
        raise ValueError(
            f"the closed loop is not stable, so it has no margins: a pole grows by {growth:.6g} 1/s"
        )
    omega = frequencies(loop)
    response = control.frd(loop, omega, smooth=True)
    listed = control.stability_margins(response, returnall=True)
    gains, phases, distances, _, crossovers, _ = map(np.ravel, listed)  # one is a scalar
    ends = np.array([loop(1.0 if loop.dt else 0.0, warn_infinite=False)])
    if loop.dt:
        ends = np.append(ends, loop(-1.0))  # at half the sampling frequency
    reached = np.isfinite(ends) & (ends.real < 0.0)
    gains = np.append(gains, -1.0 / ends.real[reached])
    lags = np.mod(np.radians(phases), 2.0 * math.pi)  # to -1, clockwise
    delays = lags / crossovers
    first = int(np.argmin(delays)) if delays.size else 0
    to_minus_one = control.disk_margins(loop, omega, skew=1.0)[0]  # skew 1 gives the distance
    distances = np.append(np.append(distances, np.abs(1.0 + ends[np.isfinite(ends)])), to_minus_one)
    disk, disk_gain, disk_phase = control.disk_margins(loop, np.append(0.0, omega))
    return Margins(
        gain_lower=float(gains[gains < 1.0].max(initial=0.0)),
        gain_upper=float(gains[gains > 1.0].min(initial=math.inf)),
        phase=float(lags.min(initial=math.inf)),
        crossover=float(crossovers[first]) if delays.size else math.nan,
        delay=float(delays[first]) if delays.size else math.inf,
        sensitivity_peak=1.0 / float(distances.min()),
        disk=float(disk),
        disk_gain=float(control.db2mag(disk_gain)),
        disk_phase=math.radians(float(disk_phase)),
    )


def creep_loop(
    wheelset: Wheelset,
    point: OperatingPoint,
    *,
    proportional_gain: float,
    integral_gain: float = 0.0,
    lag: float = 0.0,
    delay: float = 0.0,
    pade_order: int = 6,
) -> StateSpace:
    """Open loop of continuous PI creep control, from ``creepage_error`` to ``creepage``.

    Parameters
    ----------
    wheelset, point
        The plant, and the point about which it is linearised.
    proportional_gain, integral_gain : float
        Kp [N.m], Ki [N.m/s].
    lag : float, optional
        Time constant with which the motor's torque follows [s].
    delay : float, optional
        Delay of the loop [s], as a Pade approximant.
    pade_order : int, optional
        Order of the approximant, 1 to 12.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    control = optional_library("control")

    proportional_gain = checked_number("proportional_gain", proportional_gain, GAINS)
    integral_gain = checked_number("integral_gain", integral_gain, INTEGRAL_GAINS)
    delay = checked_number("delay", delay, TIMES)
    order = checked_whole("pade_order", pade_order, PADE_ORDERS)
    controller = _proportional(proportional_gain)
    if integral_gain > 0.0:
        integral = control.tf([proportional_gain, integral_gain], [1.0, 0.0])
        controller = control.ss(integral, inputs="creepage_error", outputs="command")
    wait = _unit("command", "delayed")
    if delay > NO_TIME:
        approximant = control.tf(*control.pade(delay, order))
        wait = control.ss(approximant, inputs="command", outputs="delayed")
    return open_loop(_driven(wheelset, point, lag), _chain([controller, wait], "delayed"))


def sampled_loop(
    wheelset: Wheelset,
    point: OperatingPoint,
    *,
    sample_time: float,
    proportional_gain: float,
    integral_gain: float = 0.0,
    lag: float = 0.0,
    delay: float = 0.0,
) -> StateSpace:
    """Open loop of sampled PI creep control, exact in z, from ``creepage_error`` to ``creepage``.

    The torque is held over a sample, and the controller is
    T_k = Kp e_k + Ki h (e_0 + ... + e_k).

    Parameters
    ----------
    wheelset, point
        The plant, and the point about which it is linearised.
    sample_time : float
        h [s].
    proportional_gain, integral_gain, lag
        As in `creep_loop`.
    delay : float, optional
        Delay of the loop [s], a whole number of samples.

    Raises
    ------
    ValueError
        If a value is out of range, or `delay` is not a whole number of samples.
    """
    control = optional_library("control")

    sample_time = checked_number("sample_time", sample_time, SAMPLE_TIMES)
    proportional_gain = checked_number("proportional_gain", proportional_gain, GAINS)
    integral_gain = checked_number("integral_gain", integral_gain, INTEGRAL_GAINS)
    delay = checked_number("delay", delay, TIMES)
    samples = round(delay / sample_time)
    if samples > MAX_SAMPLES:
        raise ValueError(
            f"delay = {delay!r} is out of range: must be <= {MAX_SAMPLES} times "
            f"sample_time = {sample_time!r}"
        )
    if not math.isclose(samples * sample_time, delay, rel_tol=1e-9, abs_tol=1e-12):
        raise ValueError(
            f"delay = {delay!r} must be a whole number of samples of sample_time = {sample_time!r}"
        )
    plant = control.sample_system(_driven(wheelset, point, lag), sample_time, method="zoh")
    plant = control.ss(plant, inputs="drive_torque", outputs="creepage")
    controller = _proportional(proportional_gain, sample_time)
    if integral_gain > 0.0:
        step = integral_gain * sample_time
        given = {"inputs": "creepage_error", "outputs": "command", "dt": sample_time}
        controller = control.ss([[1.0]], [[step]], [[1.0]], [[proportional_gain + step]], **given)
    shift = _unit("command", "delayed", sample_time)
    if samples:
        shift = control.ss(
            np.eye(samples, k=-1),
            np.eye(samples)[:, :1],
            np.eye(samples)[-1:],
            [[0.0]],
            inputs="command",
            outputs="delayed",
            dt=sample_time,
        )
    return open_loop(plant, _chain([controller, shift], "delayed"))


def open_loop(plant: StateSpace, controller: Any) -> StateSpace:
    """Open loop of any linear controller and a plant, from ``creepage_error`` to ``creepage``.

    Parameters
    ----------
    plant : control.StateSpace
        System with an input ``drive_torque`` and an output ``creepage``, such as
        `Wheelset.linearize` returns.
    controller : control.StateSpace or control.TransferFunction
        System from the creepage error to the torque.

    Raises
    ------
    ValueError
        If only one is sampled, or the sample times differ.
    """
    control = optional_library("control")

    if controller.dt != plant.dt:
        sampled = f"control.sample_system(plant, {controller.dt!r}, 'zoh')"
        remedy = f"sample the plant first, {sampled}" if plant.isctime() else "make them equal"
        raise ValueError(
            f"controller.dt = {controller.dt!r} is not the plant's {plant.dt!r} (0 is continuous, "
            f"else the sample time in s): {remedy}"
        )
    front = control.ss(controller, inputs="creepage_error", outputs="drive_torque")
    return _chain([front, plant[["creepage"], ["drive_torque"]]], "creepage")


def closed_loop(loop: StateSpace) -> StateSpace:
    """Close an open loop: system from ``creepage_reference`` to ``creepage``."""
    control = optional_library("control")

    closed = control.feedback(loop, 1.0)
    return control.ss(closed, inputs="creepage_reference", outputs="creepage", name="closed_loop")


def _driven(wheelset: Wheelset, point: OperatingPoint, lag: float) -> StateSpace:
    """Linear wheelset with its motor, from ``drive_torque`` (as commanded) to ``creepage``."""
    control = optional_library("control")

    lag = checked_number("lag", lag, TIMES)
    plant = wheelset.linearize(point)[["creepage"], ["drive_torque"]]
    if lag <= NO_TIME:
        return plant
    motor = control.ss([[-1.0 / lag]], [[1.0 / lag]], [[1.0]], [[0.0]])
    axle = control.ss(plant, inputs="axle_torque", outputs="creepage")
    motor = control.ss(motor, inputs="drive_torque", outputs="axle_torque")
    return _chain([motor, axle], "creepage", source="drive_torque")


def _proportional(gain: float, dt: float = 0.0) -> StateSpace:
    control = optional_library("control")

    given = {"inputs": "creepage_error", "outputs": "command", "dt": dt}
    return control.ss([], [], [], [[gain]], **given)


def _unit(source: str, sink: str, dt: float = 0.0) -> StateSpace:
    control = optional_library("control")

    return control.ss([], [], [], [[1.0]], inputs=source, outputs=sink, dt=dt)


def _chain(blocks: list[Any], sink: str, source: str = "creepage_error") -> StateSpace:
    """Connect blocks by the names of their signals to a plain state space."""
    control = optional_library("control")

    joined = control.interconnect(blocks, inputs=[source], outputs=[sink])
    return control.ss(
        joined.A, joined.B, joined.C, joined.D, joined.dt, inputs=[source], outputs=[sink]
    )
