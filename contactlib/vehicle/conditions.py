"""Conditions and operating points of a wheelset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from contactlib.base.quantities import FloatArray


class GivenInputs(TypedDict, total=False):
    """Keyword arguments of `Wheelset.conditions` except the speed."""

    axle_load: float | None
    friction_scale: float
    resistance_force: float


class GivenConditions(GivenInputs, total=False):
    """Keyword arguments of `Wheelset.conditions`, which describes them."""

    speed: float


class ContactConditions(TypedDict):
    """The conditions that the creep force depends on."""

    speed: float
    axle_load: float
    friction_scale: float


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Conditions of a wheelset, made and checked by `Wheelset.conditions`.

    Attributes
    ----------
    speed : float
        Forward speed V [m/s].
    axle_load : float
        Load P of all wheels together [N].
    friction_scale : float
        Factor on both friction coefficients [1].
    resistance_force : float
        Force of the train on the vehicle, against the motion [N].
    """

    speed: float
    axle_load: float
    friction_scale: float
    resistance_force: float

    @property
    def contact(self) -> ContactConditions:
        """The part that the creep force depends on, as keyword arguments of a `ForceElement`."""
        return {
            "speed": self.speed,
            "axle_load": self.axle_load,
            "friction_scale": self.friction_scale,
        }


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """An equilibrium: with these inputs neither creepage nor speed changes.

    Attributes
    ----------
    omega, speed, creepage : float
        State [rad/s, m/s, 1].
    drive_torque, resistance_force, axle_load, friction_scale : float
        Inputs [N.m, N, N, 1].
    creep_force : float
        Q [N].
    creep_force_slope : float
        Q' = dQ/dzeta at fixed speed [N].
    creep_force_speed_slope : float
        dQ/dV at fixed creepage [N.s/m]; zero unless friction falls with slip speed.
    resistance_slope : float
        F' = dF/dV [N.s/m].
    jacobian : ndarray
        Jacobian over `Wheelset.states`: omega and, unless it is held, speed; with memory the held
        force and the unslipped part, too [1/s, ...].
    """

    omega: float
    speed: float
    creepage: float
    drive_torque: float
    resistance_force: float
    axle_load: float
    friction_scale: float
    creep_force: float
    creep_force_slope: float
    creep_force_speed_slope: float
    resistance_slope: float
    jacobian: FloatArray

    @property
    def eigenvalues(self) -> FloatArray:
        """Eigenvalues of the Jacobian, by falling real part [1/s]."""
        values = np.linalg.eigvals(self.jacobian)
        if not values.imag.any():  # from NumPy 2.5 on, real eigenvalues are complex numbers too
            values = values.real
        return np.asarray(values[np.argsort(-values.real)])

    @property
    def stable(self) -> bool:
        """Whether the point is stable under a constant drive torque."""
        return bool(np.max(self.eigenvalues.real) < 0.0)
