"""Wheelset on an elastic axle: when small vibrations of its wheels against each other grow.

Each wheel has half of the wheelset's inertia J_w = J/2 and load, and half of its creep force,
Q1 = Q/2, at the same creepage. With the twist theta, k and d of the axle, b/2 on each wheel,

    J_w domega_l/dt = T_l - r Q1(zeta_l) - (b/2) omega_l - k theta - d (omega_l - omega_r)
    J_w domega_r/dt = T_r - r Q1(zeta_r) - (b/2) omega_r + k theta + d (omega_l - omega_r)
    dtheta/dt       = omega_l - omega_r

The mean of the two is a rigid wheelset. The difference is an oscillator of omega_t^2 = 2 k/J_w and
2 D omega_t = (2 d + b/2)/J_w, which a falling creep force drives, whatever the controller of the
mean creepage does.
"""

from __future__ import annotations

import numpy as np

from contactlib import kernel
from contactlib.drivetrain import Axle, Drivetrain
from contactlib.parameters import FloatArray, Limits, checked_number
from contactlib.wheelset import OperatingPoint


def torsional_jacobian(drivetrain: Drivetrain, point: OperatingPoint) -> FloatArray:
    """Matrix of (omega_left, omega_right, twist) and, unless held, speed, about `point`.

    Returns
    -------
    ndarray, shape (3, 3) or (4, 4)
        [1/s, ...].
    """
    axle = checked_axle(drivetrain)
    own = 0.5 * drivetrain.wheelset.inertia
    rigid = point.jacobian
    spring, damper = axle.stiffness / own, axle.damping / own
    matrix = np.zeros((4, 4))
    matrix[:2, :3] = [
        [rigid[0, 0] - damper, damper, -spring],
        [damper, rigid[0, 0] - damper, spring],
    ]
    matrix[2, :2] = 1.0, -1.0
    if drivetrain.wheelset.speed_held:
        return matrix[:3, :3]
    matrix[:2, 3] = rigid[0, 1]
    matrix[3, :2] = 0.5 * rigid[1, 0]
    matrix[3, 3] = rigid[1, 1]
    return matrix


def antiphase_eigenvalues(drivetrain: Drivetrain, point: OperatingPoint) -> FloatArray:
    """The two eigenvalues of the wheels against each other [1/s]: closed form.

    lambda^2 - c lambda + omega_t^2 = 0 with c = -(r^2 Q'/V + b + 4 d)/J, whether the speed is held
    or not.
    """
    axle = checked_axle(drivetrain)
    growth = point.jacobian[0, 0] - 4.0 * axle.damping / drivetrain.wheelset.inertia
    root = np.emath.sqrt(0.25 * growth**2 - drivetrain.torsional_frequency**2)
    return np.asarray([0.5 * growth + root, 0.5 * growth - root])


def torsional_threshold(drivetrain: Drivetrain, *, speed: float) -> float:
    """Slope Q1' of ONE wheel's creep force below which the antiphase vibration grows [N].

    -2 D omega_t J_w V/r^2 = -(2 d + b/2) V/r^2; the stiffness does not matter.
    """
    axle, wheelset = checked_axle(drivetrain), drivetrain.wheelset
    fastest = kernel.wheelset_limits()["speed"].at_most
    v = checked_number("speed", speed, Limits(above=0.0, at_most=fastest))
    return -(2.0 * axle.damping + 0.5 * wheelset.damping) * v / wheelset.radius**2


def checked_axle(drivetrain: Drivetrain) -> Axle:
    """The axle.

    Raises
    ------
    ValueError
        If it is rigid, or the creep force does not follow the creepage at once.
    """
    if drivetrain.axle is None:
        raise ValueError("drivetrain.axle = None: the wheels of a rigid axle do not vibrate")
    if drivetrain.relaxation_length > 0.0:
        raise ValueError(
            f"drivetrain.relaxation_length = {drivetrain.relaxation_length!r}: the analysis takes "
            "the creep force to follow the creepage at once, so it must be 0"
        )
    return drivetrain.axle
