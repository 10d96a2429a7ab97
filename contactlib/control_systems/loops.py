"""The loop of linear creep control: wheelset, delay, motor, PI controller.

Open loops lead from ``creepage_error`` to ``creepage``, closed ones from ``creepage_reference``;
the blocks between are joined by the names of their signals. Everything is linearised about one
operating point, so signals are deviations from it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlib.parameters import Limits, checked_number
from contactlib.stability.delay import NO_TIME, TIMES
from contactlib.wheelset import OperatingPoint, Wheelset

if TYPE_CHECKING:
    from control import StateSpace

GAINS = Limits(at_least=1e-12, at_most=1e15)  # [N.m]
INTEGRAL_GAINS = Limits(at_least=0.0, at_most=1e15)  # [N.m/s]
SAMPLE_TIMES = Limits(at_least=1e-9, at_most=1e6)  # [s]
MOST_SAMPLES = 1000  # of delay: as many states
PADE_ORDERS = Limits(at_least=1.0, at_most=12.0)  # beyond, its coefficients overflow the poles


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
        The plant and where it is linearised.
    proportional_gain, integral_gain : float
        Kp [N.m], Ki [N.m/s].
    lag : float, optional
        Time constant with which the motor's torque follows [s].
    delay : float, optional
        Delay of the loop [s], as a Pade approximant.
    pade_order : int, optional
        Its order, 1 to 12.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    import control

    proportional_gain = checked_number("proportional_gain", proportional_gain, GAINS)
    integral_gain = checked_number("integral_gain", integral_gain, INTEGRAL_GAINS)
    delay = checked_number("delay", delay, TIMES)
    order = checked_number("pade_order", pade_order, PADE_ORDERS)
    if order != int(order):
        raise ValueError(f"pade_order = {pade_order!r} must be a whole number")
    controller = _proportional(proportional_gain)
    if integral_gain > 0.0:
        integral = control.tf([proportional_gain, integral_gain], [1.0, 0.0])
        controller = control.ss(integral, inputs="creepage_error", outputs="command")
    wait = _unit("command", "delayed")
    if delay > NO_TIME:
        approximant = control.tf(*control.pade(delay, int(order)))
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
        The plant and where it is linearised.
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
    import control

    sample_time = checked_number("sample_time", sample_time, SAMPLE_TIMES)
    proportional_gain = checked_number("proportional_gain", proportional_gain, GAINS)
    integral_gain = checked_number("integral_gain", integral_gain, INTEGRAL_GAINS)
    delay = checked_number("delay", delay, TIMES)
    samples = round(delay / sample_time)
    if samples > MOST_SAMPLES:
        raise ValueError(
            f"delay = {delay!r} is out of range: must be <= {MOST_SAMPLES} times "
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
    """Any linear controller in front of a plant, from ``creepage_error`` to ``creepage``.

    Parameters
    ----------
    plant : control.StateSpace
        With an input ``drive_torque`` and an output ``creepage``, such as `Wheelset.linearize`
        gives.
    controller : control.StateSpace or control.TransferFunction
        From the creepage error to the torque.

    Raises
    ------
    ValueError
        If one is continuous and the other sampled, or their sample times differ.
    """
    import control

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
    """Creepage over its reference with the loop closed, from the open loop."""
    import control

    closed = control.feedback(loop, 1.0)
    return control.ss(closed, inputs="creepage_reference", outputs="creepage", name="closed_loop")


def _driven(wheelset: Wheelset, point: OperatingPoint, lag: float) -> StateSpace:
    """Linear wheelset behind its motor, from ``drive_torque`` (as asked for) to ``creepage``."""
    import control

    lag = checked_number("lag", lag, TIMES)
    plant = wheelset.linearize(point)[["creepage"], ["drive_torque"]]
    if lag <= NO_TIME:
        return plant
    motor = control.ss([[-1.0 / lag]], [[1.0 / lag]], [[1.0]], [[0.0]])
    axle = control.ss(plant, inputs="axle_torque", outputs="creepage")
    motor = control.ss(motor, inputs="drive_torque", outputs="axle_torque")
    return _chain([motor, axle], "creepage", source="drive_torque")


def _proportional(gain: float, dt: float = 0.0) -> StateSpace:
    import control

    given = {"inputs": "creepage_error", "outputs": "command", "dt": dt}
    return control.ss([], [], [], [[gain]], **given)


def _unit(source: str, sink: str, dt: float = 0.0) -> StateSpace:
    import control

    return control.ss([], [], [], [[1.0]], inputs=source, outputs=sink, dt=dt)


def _chain(blocks: list[Any], sink: str, source: str = "creepage_error") -> StateSpace:
    """Blocks joined by the names of their signals, as a plain state space."""
    import control

    joined = control.interconnect(blocks, inputs=[source], outputs=[sink])
    return control.ss(
        joined.A, joined.B, joined.C, joined.D, joined.dt, inputs=[source], outputs=[sink]
    )
