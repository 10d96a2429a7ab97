"""A single wheelset: rotation and forward motion, driven by a torque through the creep force.

    J domega/dt = T - r Q - b omega
    M dV/dt     = Q - F(V) - F_outer,      F(V) = A + B V + C V**2 + M g grade

The right-hand side and its Jacobian are the kernel's (fmu/wheelset.c). The linearisation is handed
on as a `control.StateSpace`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from contactlib import kernel
from contactlib.element import ForceElement
from contactlib.parameters import (
    FINITE,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
)

if TYPE_CHECKING:
    from control import NonlinearIOSystem, StateSpace

GRAVITY = 9.80665  # standard gravity [m/s2]
FASTEST = 1e3  # equilibria are looked for up to this speed [m/s]
SIGNALS_IN = ("drive_torque", "normal_load", "friction_scale", "resistance_force")
CONTACT = ("speed", "normal_load", "friction_scale")  # what the creep force depends on
SIGNALS_OUT = ("omega", "speed", "creepage", "creep_force")


@dataclass(frozen=True, kw_only=True)
class Resistance(Parameters):
    """Running resistance (Davis) and grade.

    Parameters
    ----------
    constant, linear, quadratic : float, optional
        A [N], B [N.s/m] and C [N.s2/m2].
    grade : float, optional
        Rise over distance, positive uphill [1].
    """

    constant: Annotated[float, Quantity("N", at_least=0.0)] = 0.0
    linear: Annotated[float, Quantity("N.s/m", at_least=0.0)] = 0.0
    quadratic: Annotated[float, Quantity("N.s2/m2", at_least=0.0)] = 0.0
    grade: Annotated[float, Quantity("1", at_least=-0.5, at_most=0.5)] = 0.0


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """A state at rest: with these inputs neither creepage nor speed changes.

    Attributes
    ----------
    omega, speed, creepage : float
        State [rad/s, m/s, 1].
    drive_torque, resistance_force, normal_load, friction_scale : float
        Inputs [N.m, N, N, 1].
    creep_force : float
        Q [N].
    creep_force_slope : float
        Q' = dQ/dzeta at fixed speed [N].
    creep_force_speed_slope : float
        dQ/dV at fixed creepage [N.s/m]: zero, but for friction that falls with slip speed.
    resistance_slope : float
        F' = dF/dV [N.s/m].
    jacobian : ndarray
        Of (omega, speed), or of omega alone if the speed is held [1/s, ...].
    """

    omega: float
    speed: float
    creepage: float
    drive_torque: float
    resistance_force: float
    normal_load: float
    friction_scale: float
    creep_force: float
    creep_force_slope: float
    creep_force_speed_slope: float
    resistance_slope: float
    jacobian: FloatArray

    @property
    def eigenvalues(self) -> FloatArray:
        """Of the Jacobian, by falling real part [1/s]."""
        values = np.linalg.eigvals(self.jacobian)
        if not values.imag.any():  # as of NumPy 2.5 they are complex numbers even then
            values = values.real
        return np.asarray(values[np.argsort(-values.real)])

    @property
    def stable(self) -> bool:
        """Whether a constant drive torque can hold this point."""
        return bool(np.max(self.eigenvalues.real) < 0.0)


@dataclass(frozen=True, eq=False)
class Wheelset(Parameters):
    """Wheelset with its drive, on rails or on a roller rig.

    Parameters
    ----------
    element : ForceElement
        The contact of the whole wheelset.
    inertia : float
        J about the axle, with the drive's inertia [kg.m2].
    mass : float, optional
        M moved by this wheelset [kg]. Left out, the speed is held, as on a roller rig.
    damping : float, optional
        b, drive torque lost per angular velocity [N.m.s/rad].
    resistance : Resistance, optional
        Running resistance and grade; none if left out.
    """

    element: ForceElement
    _: KW_ONLY
    inertia: Annotated[float, Quantity("kg.m2", above=0.0)]
    mass: Annotated[float | None, Quantity("kg", above=0.0)] = None
    damping: Annotated[float, Quantity("N.m.s/rad", at_least=0.0)] = 0.0
    resistance: Resistance = Resistance()

    @property
    def radius(self) -> float:
        """Rolling radius [m]."""
        return self.element.radius

    @property
    def speed_held(self) -> bool:
        """Whether the forward speed is prescribed."""
        return self.mass is None

    @property
    def effective_inverse_mass(self) -> float:
        """Slip acceleration per creep force: r**2/J + 1/M, or r**2/J if V is held [1/kg]."""
        return self.radius**2 / self.inertia + (0.0 if self.mass is None else 1.0 / self.mass)

    @cached_property
    def parameters(self) -> dict[str, float]:
        """What the kernel's equations of motion need to know, in SI units."""
        return {
            "radius": self.radius,
            "inertia": self.inertia,
            "inverse_mass": 0.0 if self.mass is None else 1.0 / self.mass,
            "damping": self.damping,
            "constant_resistance": self.resistance.constant,
            "linear_resistance": self.resistance.linear,
            "quadratic_resistance": self.resistance.quadratic,
            "grade_acceleration": GRAVITY * self.resistance.grade,
            "minimum_speed": self.element.minimum_speed,
        }

    @cached_property
    def native(self) -> kernel.NativeWheelset:
        """The kernel's equations of motion."""
        return kernel.NativeWheelset(self.parameters)

    def rates(
        self,
        omega: float,
        speed: float,
        drive_torque: float,
        normal_load: float,
        friction_scale: float,
        resistance_force: float,
    ) -> tuple[Any, Any]:
        """Kernel structs (rates, contact) of one state. Checks nothing: for integrators."""
        contact = self.element.native.evaluate_one(omega, speed, normal_load, friction_scale)
        return self.native.motion(omega, speed, drive_torque, resistance_force, contact), contact

    def balanced(
        self,
        *,
        creepage: float,
        speed: float,
        normal_load: float | None = None,
        friction_scale: float = 1.0,
    ) -> OperatingPoint:
        """Operating point at a creepage: the torque and outer resistance that hold it there.

        Raises
        ------
        ValueError
            If a value is out of range; the speed must be at least the element's minimum speed.
        """
        given = checked_conditions(
            self, speed=speed, normal_load=normal_load, friction_scale=friction_scale
        )
        speed, load, friction_scale, _ = given.values()
        creepage = checked_number("creepage", creepage, FINITE)
        record = self.element.at_creepage(
            creepage, speed=speed, normal_load=load, friction_scale=friction_scale
        )
        omega, force = (1.0 + creepage) * speed / self.radius, float(record["creep_force"])
        free, contact = self.rates(omega, speed, 0.0, load, friction_scale, 0.0)
        jacobian = np.array([list(row) for row in free.jacobian])
        by_speed = 0.0  # of a difference rounding would be left where there is nothing
        if self.element.friction.falls_with_slip_speed:
            by_speed = contact.force_by_speed + (1.0 + creepage) * contact.force_gradient
        return OperatingPoint(
            omega=omega,
            speed=float(speed),
            creepage=float(creepage),
            drive_torque=-self.inertia * free.omega_rate,
            resistance_force=0.0 if self.mass is None else self.mass * free.speed_rate,
            normal_load=load,
            friction_scale=float(friction_scale),
            creep_force=force,
            creep_force_slope=contact.force_gradient * abs(speed),
            creep_force_speed_slope=by_speed,
            resistance_slope=0.0 if self.mass is None else free.resistance_slope,
            jacobian=jacobian[:1, :1] if self.mass is None else jacobian,
        )

    def equilibria(
        self,
        *,
        drive_torque: float,
        speed: float | None = None,
        normal_load: float | None = None,
        friction_scale: float = 1.0,
        resistance_force: float = 0.0,
    ) -> list[OperatingPoint]:
        """All operating points of a drive torque, by rising creepage, on both branches.

        Parameters
        ----------
        drive_torque : float
            [N.m].
        speed : float, optional
            Held forward speed [m/s]; needed if, and only if, the wheelset has no mass. A free
            wheelset finds its own, where the creep force meets the resistance.
        normal_load, friction_scale, resistance_force : float, optional
            Further inputs [N, 1, N].

        Raises
        ------
        ValueError
            If a value is out of range or `speed` is missing or not wanted.
        """
        drive_torque = checked_torque(drive_torque)
        if (speed is None) == self.speed_held:
            wanted = "is needed: the speed is held" if speed is None else "is found, not given"
            raise ValueError(f"speed = {speed!r}: the speed of this wheelset {wanted}")

        given = checked_conditions(
            self,
            speed=self.element.minimum_speed if speed is None else speed,
            normal_load=normal_load,
            friction_scale=friction_scale,
            resistance_force=resistance_force,
        )
        at_speed, load, friction_scale, resistance_force = given.values()
        speed = None if speed is None else at_speed
        scale = self.element.saturation_creepage_at(normal_load=load, friction_scale=friction_scale)

        def point(x: float) -> OperatingPoint | None:
            creepage, at = x * scale, speed
            if at is None:
                at = self._free_speed(creepage, load, friction_scale, resistance_force)
            if at is None:
                return None
            return self.balanced(
                creepage=creepage, speed=at, normal_load=load, friction_scale=friction_scale
            )

        def excess(x: float) -> float:
            found = point(x)
            return np.nan if found is None else found.drive_torque - drive_torque

        positive = np.geomspace(1e-9, 1e7, 1601)
        grid = np.concatenate([-positive[::-1], [0.0], positive])
        values = np.array([excess(x) for x in grid])
        turns = _turning_points(excess, grid, values)
        place = np.searchsorted(grid, turns)
        grid = np.insert(grid, place, turns)
        values = np.insert(values, place, [excess(x) for x in turns])
        found = [point(x) for x, value in zip(grid, values, strict=True) if value == 0.0]
        for i in np.flatnonzero(values[:-1] * values[1:] < 0.0):
            found.append(point(float(brentq(excess, grid[i], grid[i + 1], xtol=1e-15, rtol=1e-14))))
        return sorted((p for p in found if p is not None), key=lambda p: p.creepage)

    def _free_speed(
        self, creepage: float, load: float, friction_scale: float, resistance_force: float
    ) -> float | None:
        """Speed at which the resistance takes up the creep force; None if there is none."""

        def surplus(speed: float) -> float:
            omega = (1.0 + creepage) * speed / self.radius
            rates, _ = self.rates(omega, speed, 0.0, load, friction_scale, resistance_force)
            return float(rates.speed_rate)

        slowest = self.element.minimum_speed
        if surplus(slowest) * surplus(FASTEST) > 0.0:
            return None
        return float(brentq(surplus, slowest, FASTEST, xtol=1e-13, rtol=1e-14))

    def linearize(self, point: OperatingPoint) -> StateSpace:
        """Linear model about an operating point.

        States ``omega`` and, unless held, ``speed``; inputs ``drive_torque`` and
        ``resistance_force``; outputs ``omega``, ``speed``, ``creepage``, ``creep_force``.
        """
        import control

        _, contact = self.rates(
            point.omega,
            point.speed,
            point.drive_torque,
            point.normal_load,
            point.friction_scale,
            point.resistance_force,
        )
        n = len(point.jacobian)
        inverse_mass = 0.0 if self.mass is None else 1.0 / self.mass
        by_state = [
            [1.0, 0.0],
            [0.0, 1.0],
            [contact.creepage_by_omega, contact.creepage_by_speed],
            [contact.force_by_omega, contact.force_by_speed],
        ]
        return control.ss(
            point.jacobian,
            np.array([[1.0 / self.inertia, 0.0], [0.0, -inverse_mass]])[:n],
            np.array(by_state)[:, :n],
            np.zeros((4, 2)),
            states=["omega", "speed"][:n],
            inputs=["drive_torque", "resistance_force"],
            outputs=list(SIGNALS_OUT),
        )

    def to_nlsys(self, *, speed: float | None = None) -> NonlinearIOSystem:
        """The equations of motion for python-control.

        States ``omega`` and, unless held, ``speed``; inputs ``drive_torque``, ``normal_load``,
        ``friction_scale`` and ``resistance_force``, in that order and all to be given; outputs
        ``omega``, ``speed``, ``creepage``, ``creep_force``.

        Parameters
        ----------
        speed : float, optional
            Held forward speed [m/s], the parameter ``speed`` of the system; needed if, and only
            if, the wheelset has no mass.

        Raises
        ------
        ValueError
            If `speed` is missing or not wanted; and by the system, if a load or friction scale is
            out of range: python-control feeds zero where an input is forgotten.
        """
        import control

        if (speed is None) == self.speed_held:
            wanted = "is needed: the speed is held" if speed is None else "is a state, not given"
            raise ValueError(f"speed = {speed!r}: the speed of this wheelset {wanted}")
        limits = kernel.force_input_limits()

        def at(x: FloatArray, u: FloatArray, given: Mapping[str, float]) -> tuple[Any, Any, float]:
            at_speed = given["speed"] if self.speed_held else x[1]
            for name, value in zip(SIGNALS_IN[1:3], u[1:3], strict=True):
                checked(name, value, limits[name])
            return *self.rates(x[0], at_speed, *u), at_speed

        def update(_: float, x: FloatArray, u: FloatArray, given: Mapping[str, float]) -> Any:
            rates, _, _ = at(x, u, given)
            return np.array([rates.omega_rate, rates.speed_rate])[: len(x)]

        def output(_: float, x: FloatArray, u: FloatArray, given: Mapping[str, float]) -> Any:
            _, contact, at_speed = at(x, u, given)
            return np.array([x[0], at_speed, contact.creepage, contact.creep_force])

        return control.nlsys(
            update,
            output,
            name="wheelset",
            states=["omega"] if self.speed_held else ["omega", "speed"],
            inputs=list(SIGNALS_IN),
            outputs=list(SIGNALS_OUT),
            params={"speed": checked_number("speed", speed, FINITE)} if speed is not None else {},
        )


def checked_torque(value: ArrayLike) -> float:
    """A drive torque [N.m], or a ValueError that names it."""
    return checked_number("drive_torque", value, kernel.wheelset_limits()["drive_torque"])


def checked_conditions(
    wheelset: Wheelset,
    *,
    speed: float,
    normal_load: float | None = None,
    friction_scale: float = 1.0,
    resistance_force: float = 0.0,
) -> dict[str, Any]:
    """What a wheelset stands under, each one number within its limits, by name.

    Raises
    ------
    ValueError
        If a value is out of range; the speed must be at least the element's minimum speed.
    """
    limits = _condition_limits(wheelset.element.minimum_speed)
    given = {
        "speed": speed,
        "normal_load": wheelset.element.contact.normal_load if normal_load is None else normal_load,
        "friction_scale": friction_scale,
        "resistance_force": resistance_force,
    }
    return {name: checked_number(name, value, limits[name]) for name, value in given.items()}


@cache
def _condition_limits(minimum_speed: float) -> dict[str, Limits]:
    limits = kernel.wheelset_limits()
    return {
        **limits,
        "speed": replace(limits["speed"], at_least=minimum_speed),
    }


def _turning_points(
    curve: Callable[[float], float], grid: FloatArray, values: FloatArray
) -> list[float]:
    """Where a curve turns back between nodes, so near zero that it may have met zero twice."""
    found = []
    size, sign = np.abs(values), np.sign(values)
    # It turns below the least of three nodes by no more than it rises from there to the others.
    near = (size[1:-1] <= np.minimum(size[:-2], size[2:])) & (
        3.0 * size[1:-1] <= size[:-2] + size[2:]
    )
    alike = (sign[1:-1] == sign[:-2]) & (sign[1:-1] == sign[2:])
    for i in np.flatnonzero(near & alike) + 1:
        turn = minimize_scalar(
            lambda x, way=sign[i]: way * curve(x),
            bounds=(grid[i - 1], grid[i + 1]),
            method="bounded",
            options={"xatol": 1e-9 * abs(grid[i])},
        )
        found.append(float(turn.x))
    return found
