"""The curve of steady creep: the drive torque that balances each creepage of a wheelset.

With the speed frozen, the creepage of a wheelset under a drive torque T moves by

    dzeta/dt = (r/(J V)) (T - T_s(zeta)),    T_s = r Q + b omega + (J/r)(1 + zeta) dV/dt,

exactly, as J domega/dt = T - r Q - b omega and zeta = (r omega - V)/V. The curve of T_s, the
quasi-steady torque, gives the steady creepages, their stability and the time between two of them.
The kernel searches it (fmu/kernel/creep_curve.c).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar

from contactlib.base.quantities import FloatArray, checked
from contactlib.element.force_element import creepage_limits
from contactlib.vehicle.conditions import Conditions, GivenConditions
from contactlib.vehicle.wheelset import Wheelset, checked_torque, of_the_motion


class Peak(NamedTuple):
    """The largest creep force in traction.

    Attributes
    ----------
    creepage : float
        Smallest creepage with this force [1]; infinite if the force rises forever.
    creep_force : float
        The force, or its limit [N].
    """

    creepage: float
    creep_force: float


class Fold(NamedTuple):
    """Points at which a slow torque ramp leaves the stable branch and returns to it.

    Attributes
    ----------
    creepage, drive_torque : float
        The fold [1, N.m]: above this torque there are operating points only far out in the tail.
        On a plateau, its beginning.
    return_creepage, return_torque : float
        End of the slipping branch under a falling torque [1, N.m]; the creepage is infinite where
        the torque falls to its limit without a minimum. A limit below 0 counts as 0: the wheel does
        not re-adhere under any driving torque.
    """

    creepage: float
    drive_torque: float
    return_creepage: float
    return_torque: float

    @property
    def hysteresis(self) -> float:
        """Torque drop needed to return / critical torque [1]."""
        return 1.0 - self.return_torque / self.drive_torque


class WorstPole(NamedTuple):
    """The largest pole at one speed.

    Attributes
    ----------
    pole : float
        The pole [1/s]; zero or less if every creepage is stable at constant torque.
    creepage : float
        Its creepage [1].
    """

    pole: float
    creepage: float


@dataclass(frozen=True, kw_only=True)
class SteadyStates:
    """Quasi-steady states at one speed, in order of increasing creepage.

    Attributes
    ----------
    creepage, drive_torque, pole : ndarray, shape (n,)
        Creepages [1], the torque that holds each [N.m], and the growth rate of a small deviation,
        `CreepCurve.pole` [1/s].
    stable : ndarray of bool, shape (n,)
        Whether the pole is negative, so that the creepage is stable at constant torque.
    """

    creepage: FloatArray
    drive_torque: FloatArray
    pole: FloatArray
    stable: NDArray[np.bool_]


class CreepCurve:
    """Steady creep of a wheelset under given conditions: torque, peak, fold, steady states, poles.

    Parameters
    ----------
    wheelset : Wheelset
        Wheelset on rails, whose speed may be changing, or on a roller rig.
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> import contactlib as cl
    >>> curve = cl.vehicle.CreepCurve(cl.load_model("roller_rig.toml").wheelset, speed=10.0)
    >>> curve.torque([0.01, 0.02]).round(-2)
    array([23300., 26800.])
    >>> fold = curve.fold
    >>> round(fold.drive_torque), round(fold.creepage, 4), round(fold.hysteresis, 3)
    (27314, 0.017, 0.112)
    >>> curve.steady(26e3).stable
    array([ True, False,  True])
    """

    def __init__(
        self, wheelset: Wheelset, at: Conditions | None = None, **given: Unpack[GivenConditions]
    ) -> None:
        self.wheelset = wheelset
        self.at = wheelset.conditions(at, **given)
        self._native = wheelset.native_curve(self.at)

    def torque(self, creepage: ArrayLike) -> FloatArray:
        """Drive torque that keeps creepages unchanged while the vehicle accelerates [N.m].

        T_s = r Q + b omega + (J/r)(1 + zeta) dV/dt. The last term accelerates the rotation along
        with the vehicle; it vanishes if the speed is held.
        """
        return np.asarray(self._points(creepage)["torque"])

    def slope(self, creepage: ArrayLike) -> FloatArray:
        """Derivative of `torque` with respect to the creepage, at fixed speed [N.m]."""
        return np.asarray(self._points(creepage)["slope"])

    def pole(self, creepage: ArrayLike) -> FloatArray:
        """Pole of the creepage about its quasi-steady state, with the speed frozen [1/s].

        -(r/(J V)) dT_s/dzeta: negative where the torque rises. For a held speed it is the pole of
        the wheelset; for a free one it is the fast pole up to terms of the size of F'/M. Of a
        contact with memory it is the largest real part of the eigenvalues, which has the same sign,
        on the side of a slip-away (`Wheelset.jacobians`).
        """
        return self._pole(self._points(creepage))

    def acceleration(self, creepage: ArrayLike) -> FloatArray:
        """Vehicle acceleration dV/dt at creepages [m/s2]: zero if the speed is held."""
        return np.asarray(self._points(creepage)["acceleration"])

    def minimum_gain(self, creepage: ArrayLike) -> FloatArray:
        """Smallest proportional gain of creep control that holds creepages [N.m].

        With memory too: see `contactlib.stability.creep_control_gain`.
        """
        return np.asarray(self._points(creepage)["minimum_gain"])

    @cached_property
    def turns(self) -> FloatArray:
        """Creepages of traction at which the torque has a maximum or a minimum [1].

        Of a plateau, its beginning.
        """
        return np.asarray(self._native.turns(1.0)["creepage"][:-1])

    @cached_property
    def turns_in_braking(self) -> FloatArray:
        """The same in braking, from zero outward [1]."""
        return np.asarray(self._native.turns(-1.0)["creepage"][:-1])

    @cached_property
    def peak(self) -> Peak:
        """The largest creep force in traction."""
        return Peak(*self._native.peak())

    @cached_property
    def fold(self) -> Fold:
        """Fold of the torque in traction.

        Raises
        ------
        ValueError
            If the torque has no maximum: the law does not fall, or damping outweighs its fall.
        """
        points = self._native.fold()
        if points.size == 0:
            at = self.at
            raise ValueError(
                f"speed = {at.speed!r}, axle_load = {at.axle_load!r}, "
                f"friction_scale = {at.friction_scale!r}, damping = {self.wheelset.damping!r}: the "
                "torque has no maximum over creepage, so there is no fold; "
                f"{flattening(self.wheelset)}"
            )
        fold, back = (points[["creepage", "torque"]][i].item() for i in range(2))
        return Fold(*fold, *back)

    def steady(self, drive_torque: float) -> SteadyStates:
        """All states, on all branches, in which a torque [N.m] holds the creepage."""
        torque = checked_torque(drive_torque)
        sides = [np.sort(self._native.steady(torque, s), order="creepage") for s in (-1.0, 1.0)]
        return self._states(np.concatenate(sides))

    def grip(self, drive_torque: float) -> float:
        """Creepage on the rising branch that a drive torque [N.m] holds [1].

        Raises
        ------
        ValueError
            If the torque is above the peak of the branch.
        """
        creepage, limit = self._native.grip(checked_torque(drive_torque))
        if math.isnan(creepage):
            raise ValueError(beyond_grip(drive_torque, limit))
        return creepage

    @cached_property
    def worst_pole(self) -> WorstPole:
        """Largest `fast_pole` over the creepages of traction, and its creepage."""
        worst = self._native.worst()
        if worst.pole <= 0.0 or not self.wheelset.element.memory:
            return WorstPole(worst.pole, worst.creepage)
        # Sliding contacts follow the sooner the faster they slide, which moves it outward.
        places = worst.creepage * np.geomspace(0.2, 50.0, 241)
        best = int(self._growth(places).argmax())
        low, high = places[max(best - 1, 0)], places[min(best + 1, places.size - 1)]
        minimum = minimize_scalar(
            lambda creepage: -float(self._growth(np.array(creepage))),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-7 * high},
        )
        return WorstPole(-float(minimum.fun), float(minimum.x))

    def _growth(self, creepage: FloatArray) -> FloatArray:
        """Largest real part of the eigenvalues at creepages [1/s]."""
        matrices = of_the_motion(self.wheelset.jacobians(creepage, **self.at.contact))
        return np.asarray(np.linalg.eigvals(matrices).real.max(axis=-1))

    def states(self, creepage: ArrayLike) -> SteadyStates:
        """States at increasing creepages."""
        return self._states(self._points(creepage))

    def _points(self, creepage: ArrayLike) -> NDArray[np.void]:
        limits = creepage_limits(self.wheelset.element, self.at.speed)
        return self._native.points(checked("creepage", creepage, limits))

    def _pole(self, points: NDArray[np.void]) -> FloatArray:
        body = self.wheelset
        if not body.element.memory:
            return np.asarray(-body.radius * points["slope"] / (body.inertia * self.at.speed))
        creepage = points["creepage"]
        matrices = of_the_motion(body.jacobians(creepage, **self.at.contact))
        if not body.speed_held:  # of the slip velocity, which the vehicle's acceleration changes
            rolling = (1.0 + creepage[..., np.newaxis]) / body.radius
            matrices[..., 0, :] -= rolling * matrices[..., 1, :]
            matrices = np.delete(np.delete(matrices, 1, axis=-1), 1, axis=-2)
        return np.asarray(np.linalg.eigvals(matrices).real.max(axis=-1))

    def _states(self, points: NDArray[np.void]) -> SteadyStates:
        pole = self._pole(points)
        return SteadyStates(
            creepage=np.array(points["creepage"]),
            drive_torque=np.array(points["torque"]),
            pole=pole,
            stable=pole < 0.0,
        )


def flattening(wheelset: Wheelset) -> str:
    """Why the torque may not fall with creepage, and what to change in the model."""
    element = wheelset.element
    friction = element.friction
    if friction.ratio == 1.0 and not friction.falls_with_slip_speed:
        return (
            f"friction does not fall, as static = kinetic = {friction.kinetic!r}: it needs "
            "friction.static > friction.kinetic"
        )
    less = [
        f"a lower wheelset.{name} (it is {value:g})"
        for name, value in (
            ("layer_compliance", element.layer_compliance),
            ("damping", wheelset.damping),
        )
        if value > 0.0
    ]
    if element.table.one_axis:
        more = ["a law whose force falls more"]
    else:
        more = ["a higher friction.static or friction.weakening_length (k_hat)"]
    return f"it needs {' or '.join([*less, *more])}"


def beyond_grip(drive_torque: float, limit: float) -> str:
    """Message for a torque beyond the end of the rising branch [N.m]."""
    return f"drive_torque = {drive_torque!r} is out of range: the rising branch ends at {limit:.6g}"
