"""Rows of many runs as outcomes see them, with what several of them ask for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import FloatArray


class Rows(Protocol):
    """Signals of some rows of n runs."""

    @property
    def time(self) -> FloatArray:
        """Of the rows [s]."""

    def __getitem__(self, name: str) -> FloatArray:
        """One signal, shape (rows, n)."""


class Vehicles(NamedTuple):
    """What outcomes know of the n drivetrains; arrays of shape (n,).

    Attributes
    ----------
    radius, inertia, damping : ndarray
        Of the wheelset [m, kg.m2, N.m.s/rad].
    inverse_mass : ndarray
        Zero if the speed is held [1/kg].
    grip : ndarray
        Kinetic friction times nominal load [N].
    held, rigid : ndarray of bool
        Whether the speed is held; whether the axle is rigid.
    """

    radius: FloatArray
    inertia: FloatArray
    damping: FloatArray
    inverse_mass: FloatArray
    grip: FloatArray
    held: NDArray[np.bool_]
    rigid: NDArray[np.bool_]

    @classmethod
    def of(cls, drivetrains: Sequence[Drivetrain]) -> Self:
        """Those of drivetrains."""
        bodies = [train.wheelset for train in drivetrains]
        elements = [body.element for body in bodies]
        return cls(
            np.array([body.radius for body in bodies]),
            np.array([body.inertia for body in bodies]),
            np.array([body.damping for body in bodies]),
            np.array([0.0 if body.mass is None else 1.0 / body.mass for body in bodies]),
            np.array([one.friction.kinetic * one.contact.normal_load for one in elements]),
            np.array([body.speed_held for body in bodies]),
            np.array([train.axle is None for train in drivetrains]),
        )


class Seen:
    """Rows, and what is derived of them once for all outcomes."""

    def __init__(self, rows: Rows, vehicles: Vehicles) -> None:
        self._rows, self.vehicles = rows, vehicles

    @property
    def time(self) -> FloatArray:
        """Of the rows [s]."""
        return self._rows.time

    def __getitem__(self, name: str) -> FloatArray:
        """One signal, shape (rows, n)."""
        return self._rows[name]

    @cached_property
    def transmittable(self) -> tuple[FloatArray, FloatArray]:
        """Creep force in the demand's direction s Q, and what can be transmitted Q_t [N]."""
        v, force = self.vehicles, self["creep_force"]
        turning = v.inertia / v.radius
        left = self["demand"] - (v.damping / v.radius) * self["speed"]
        # F/M = Q/M - dV/dt; 1/M is zero if the speed is held.
        left = left + turning * (force * v.inverse_mass - self["acceleration"])
        demanded = left / (v.radius + turning * v.inverse_mass)
        wanted = np.minimum(self["available_force"], np.abs(demanded))
        return np.sign(demanded) * force, wanted
