"""A single wheelset: rotation and forward motion, driven by a torque through the creep force.

    J domega/dt = T - r Q - b omega
    M dV/dt     = Q - F(V) - F_outer,      F(V) = A + B V + C V**2 + M g grade

The kernel has the right-hand side and its Jacobian (fmu/kernel/wheelset_law.h).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import (
    FINITE,
    POSITIVE,
    FloatArray,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checks_call,
    derived,
)
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.element.force_element import ForceElement
from contactlib.laws.scales import SLOPE_REDUCTION
from contactlib.vehicle.conditions import (
    Conditions,
    GivenConditions,
    GivenInputs,
    OperatingPoint,
)

if TYPE_CHECKING:
    from control import NonlinearIOSystem, StateSpace

INERTIA = Quantity("kg.m2", above=0.0, usual=(1e-4, 2e4))
ROTOR_INERTIA = Quantity("kg.m2", above=0.0, at_most=1e6, usual=(1e-6, 200.0))
GEAR_RATIO = Quantity("1", above=0.0, at_most=1e3, usual=(0.5, 20.0))
STATES = ("omega", "speed", "held_force", "unslipped")
# Part by which a state of the memory is put to one side of steady rolling.
PERTURBATION = 1e-9
SIGNALS_IN = ("drive_torque", "axle_load", "friction_scale", "resistance_force")
SIGNALS_OUT = ("omega", "speed", "creepage", "creep_force")


@dataclass(frozen=True, kw_only=True)
class Resistance(Parameters):
    """Running resistance A + B V + C V**2 (Davis) and grade.

    Parameters
    ----------
    constant : float, optional
        A, the part of the resistance that is the same at every speed [N].
    linear : float, optional
        B, the part that grows with speed, over speed [N.s/m].
    quadratic : float, optional
        C, the part that grows with speed squared, over that square [N.s2/m2].
    grade : float, optional
        Rise over distance, positive uphill [1].
    """

    constant: Annotated[float, Quantity("N", at_least=0.0, usual=(0.0, 1e6))] = 0.0
    linear: Annotated[float, Quantity("N.s/m", at_least=0.0, usual=(0.0, 1e5))] = 0.0
    quadratic: Annotated[float, Quantity("N.s2/m2", at_least=0.0, usual=(0.0, 1e4))] = 0.0
    grade: Annotated[float, Quantity("1", at_least=-0.5, at_most=0.5)] = 0.0


def davis(own: Resistance, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Running resistance F at speeds far from zero [N], and its slope F' [N.s/m]."""
    size = np.abs(speed)
    force = own.constant * np.sign(speed) + (own.linear + own.quadratic * size) * speed
    return force, own.linear + 2.0 * own.quadratic * size


@dataclass(frozen=True, eq=False)
class Wheelset(Parameters):
    """Wheelset with its drive, on rails or on a roller rig.

    Parameters
    ----------
    element : ForceElement
        The contact of all its wheels together.
    inertia : float
        J about the axle, with the drive's inertia [kg.m2].
    mass : float, optional
        Mass M that this wheelset moves [kg]. Default: the speed is held, as on a roller rig.
    damping : float, optional
        b, drive torque lost per angular velocity [N.m.s/rad]. Default: 0.
    resistance : Resistance, optional
        Running resistance and grade. Default: none.
    """

    element: ForceElement
    _: KW_ONLY
    inertia: Annotated[float, INERTIA]
    mass: Annotated[float | None, Quantity("kg", above=0.0, usual=(200.0, 3e6))] = None
    damping: Annotated[float, Quantity("N.m.s/rad", at_least=0.0, usual=(0.0, 1e5))] = 0.0
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
        """Slip acceleration per creep force: r**2/J + 1/M, or r**2/J at held speed [1/kg]."""
        return self.radius**2 / self.inertia + (0.0 if self.mass is None else 1.0 / self.mass)

    @cached_property
    def parameters(self) -> dict[str, float]:
        """Parameters of the kernel's equations of motion, in SI units."""
        return {
            "radius": self.radius,
            "inertia": self.inertia,
            "inverse_mass": 0.0 if self.mass is None else 1.0 / self.mass,
            "damping": self.damping,
            "constant_resistance": self.resistance.constant,
            "linear_resistance": self.resistance.linear,
            "quadratic_resistance": self.resistance.quadratic,
            "grade_acceleration": STANDARD_GRAVITY * self.resistance.grade,
            "minimum_speed": self.element.minimum_speed,
        }

    @cached_property
    def native(self) -> kernel.NativeWheelset:
        """The kernel's equations of motion."""
        return kernel.NativeWheelset(self.parameters)

    def with_slope(self, slope: float) -> Wheelset:
        """Return this wheelset on a rail with a factor on the creep force's initial slope [1]."""
        given = {"slope": checked_number("slope", slope, POSITIVE)}
        if slope == 1.0:
            return self
        known = self.element.slope_reduction
        product = derived("slope_reduction", lambda: slope * known, given, SLOPE_REDUCTION)
        return replace(self, element=replace(self.element, slope_reduction=product))

    def without_memory(self) -> Wheelset:
        """Return this wheelset with contacts that always have the force of steady rolling."""
        if not self.element.memory:
            return self  # a new element would warn of its ranges again
        return replace(self, element=replace(self.element, memory=False))

    def conditions(
        self, at: Conditions | None = None, **given: Unpack[GivenConditions]
    ) -> Conditions:
        """Check and complete conditions for an analysis: those of `at`, with changes.

        Every analysis of a wheelset accepts such conditions, or these keyword arguments.

        Parameters
        ----------
        at : Conditions, optional
            Conditions to start from; needed unless `speed` is given.
        speed : float
            Forward speed, at least the element's minimum speed [m/s].
        axle_load : float, optional
            Load of all wheels together [N]. Default: the nominal one.
        friction_scale : float, optional
            Factor on both friction coefficients [1]. Default: 1.
        resistance_force : float, optional
            Force of the train on the vehicle, against the motion [N]. Default: 0.

        Raises
        ------
        ValueError
            If a value is out of range.
        TypeError
            If the speed is missing, or an argument is not known.
        """
        known: dict[str, Any] = {"friction_scale": 1.0, "resistance_force": 0.0, **given}
        if at is not None:
            if not given and at.speed >= self.element.minimum_speed:
                return at
            known = {**vars(at), **given}
        if "speed" not in known:
            raise TypeError("speed is missing: give it, or conditions that contain it")
        if known.get("axle_load") is None:
            known["axle_load"] = self.element.axle_load
        limits = kernel.wheelset_limits()
        limits = {**limits, "speed": replace(limits["speed"], at_least=self.element.minimum_speed)}
        order = ("speed", "axle_load", "friction_scale", "resistance_force")
        if unknown := set(known) - set(order):
            raise TypeError(f"{min(unknown)} is not a condition: known are {', '.join(order)}")
        return Conditions(**{n: checked_number(n, known[n], limits[n]) for n in order})

    def rates(
        self,
        omega: float,
        speed: float,
        drive_torque: float,
        axle_load: float,
        friction_scale: float,
        resistance_force: float,
    ) -> tuple[Any, Any]:
        """Kernel structs (rates, contact) of one state. Checks nothing: for integrators."""
        contact = self.element.native.evaluate_one(omega, speed, axle_load, friction_scale)
        return self.native.motion(omega, speed, drive_torque, resistance_force, contact), contact

    def balanced(
        self,
        at: Conditions | None = None,
        *,
        creepage: float,
        **given: Unpack[GivenConditions],
    ) -> OperatingPoint:
        """Operating point at a creepage: the torque and outer resistance that balance it.

        Parameters
        ----------
        at, **given
            Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they
            are not nominal.
        creepage : float
            Creepage of the point [1].

        Raises
        ------
        ValueError
            If a value is out of range; the speed must be at least the element's minimum speed.
        """
        at = self.conditions(at, **given)
        speed, load, friction_scale = at.speed, at.axle_load, at.friction_scale
        creepage = checked_number("creepage", creepage, FINITE)
        record = self.element.at_creepage(creepage, **at.contact)
        omega, force = (1.0 + creepage) * speed / self.radius, float(record["creep_force"])
        free, contact = self.rates(omega, speed, 0.0, load, friction_scale, 0.0)
        by_speed = 0.0  # exactly, where the difference below would leave rounding
        if self.element.friction.falls_with_slip_speed:
            by_speed = contact.force_by_speed + (1.0 + creepage) * contact.force_gradient
        return OperatingPoint(
            omega=omega,
            speed=speed,
            creepage=creepage,
            drive_torque=-self.inertia * free.omega_rate,
            resistance_force=0.0 if self.mass is None else self.mass * free.speed_rate,
            axle_load=load,
            friction_scale=friction_scale,
            creep_force=force,
            creep_force_slope=contact.force_gradient * abs(speed),
            creep_force_speed_slope=by_speed,
            resistance_slope=0.0 if self.mass is None else free.resistance_slope,
            jacobian=self.jacobians(creepage, **at.contact),
        )

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the linearised states: ``omega``, ``speed`` unless it is held.

        With memory also ``held_force`` and ``unslipped``; to first order the force of the outer
        zone has no effect on these.
        """
        left_out = {"speed"} if self.speed_held else set()
        left_out |= set() if self.element.memory else {"held_force", "unslipped"}
        return tuple(name for name in STATES if name not in left_out)

    def jacobians(
        self,
        creepage: ArrayLike,
        *,
        speed: ArrayLike,
        axle_load: ArrayLike,
        friction_scale: ArrayLike = 1.0,
    ) -> FloatArray:
        """Jacobians of the equations of motion at points of steady rolling.

        Parameters
        ----------
        creepage, speed, axle_load, friction_scale : array_like
            Points [1, m/s, N, 1]; they broadcast. Checked by the caller.

        Returns
        -------
        ndarray, shape (..., n, n)
            Over the n `states`: angular velocity [rad/s], speed [m/s], creep force [N], unslipped
            part of the contact [1].

        Notes
        -----
        Steady rolling is a kink of the memory's equations (`fmu/kernel/memory.h`): they differ on
        both sides of q = G and of h = m. The derivatives are those on the side of a motion towards
        larger creepage, whose force lags: q > G. Where the steady force falls, such a motion grows,
        with h > m, and its growth is exact: that of a slip-away. Where the force rises, it decays,
        with h < m. Vibrations and control loops change sides, and a motion back to the grip is on
        the other one. It begins slower by 5 % at 1 m/s and 15 % at 0.3 m/s where the whole contact
        slides (models/locomotive.toml), and faster by up to 8 % and 23 % where part of it sticks,
        as friction falls with slip speed too.
        """
        given = np.broadcast_arrays(creepage, speed, axle_load, friction_scale)
        inputs = np.zeros(given[0].shape, kernel.struct_dtype("force_element_input"))
        inputs["omega"] = (1.0 + given[0]) * given[1] / self.radius
        for name, values in zip(("speed", "normal_load", "friction_scale"), given[1:], strict=True):
            inputs[name] = values
        native = self.element.rolling_native
        contact: Any = native.evaluate(inputs)
        if self.element.memory:
            strength = self.element.friction.static * given[3] * given[2]
            held, sticking = contact["steady_force"] * (1.0 + PERTURBATION), contact["sticking"]
            grows = (contact["falling_branch"] > 0.0) & (sticking > 0.0)
            inputs["held_force"] = np.clip(held, -strength, strength)
            inputs["unslipped"] = sticking + np.where(grows, PERTURBATION, -PERTURBATION)
            inputs["outer_force"] = contact["steady_outer"]
            contact = native.evaluate(inputs)
        matrices = np.zeros((*given[0].shape, 4, 4))
        per_mass = 0.0 if self.mass is None else 1.0 / self.mass
        growth = davis(self.resistance, given[1])[1]
        by_memory = contact["force_by_memory"]
        forces = (
            contact["force_by_omega"],
            contact["force_by_speed"],
            *np.moveaxis(by_memory, -1, 0),
        )
        for column, force in enumerate(forces[:4]):
            matrices[..., 0, column] = -self.radius * force / self.inertia
            matrices[..., 1, column] = force * per_mass
        matrices[..., 2:, :] = contact["memory_by"][..., :2, :4]
        matrices[..., 0, 0] -= self.damping / self.inertia
        matrices[..., 1, 1] -= growth * per_mass
        kept = [STATES.index(name) for name in self.states]
        return np.asarray(matrices[..., kept, :][..., kept])

    def equilibria(
        self,
        *,
        drive_torque: float,
        speed: float | None = None,
        **given: Unpack[GivenInputs],
    ) -> list[OperatingPoint]:
        """All operating points of a drive torque, by increasing creepage, on both branches.

        Parameters
        ----------
        drive_torque : float
            Drive torque [N.m].
        speed : float, optional
            Held forward speed [m/s]; needed if, and only if, the wheelset has no mass. A free
            wheelset runs at the speed where the resistance equals the creep force.
        axle_load, friction_scale, resistance_force : float, optional
            See `conditions` [N, 1, N].

        Raises
        ------
        ValueError
            If a value is out of range, or `speed` is missing or must not be given.
        """
        drive_torque = checked_torque(drive_torque)
        if (speed is None) == self.speed_held:
            state = "is needed: the speed is held" if speed is None else "is found, not given"
            raise ValueError(f"speed = {speed!r}: the speed of this wheelset {state}")

        at = self.conditions(speed=self.element.minimum_speed if speed is None else speed, **given)
        curve = self.native_curve(at, balanced=not self.speed_held)
        sides = [curve.steady(drive_torque, side) for side in (-1.0, 1.0)]
        states = np.sort(np.concatenate(sides), order="creepage")
        return [
            self.balanced(replace(at, speed=speed), creepage=creepage)
            for creepage, speed in zip(
                states["creepage"].tolist(), states["speed"].tolist(), strict=True
            )
        ]

    def native_curve(self, at: Conditions, *, balanced: bool = False) -> kernel.NativeCurve:
        """The kernel's curve of steady creep under conditions.

        Parameters
        ----------
        at : Conditions
            Checked conditions.
        balanced : bool, optional
            Whether each creepage has the speed at which the resistance equals the creep force, in
            place of that of the conditions.
        """
        return kernel.NativeCurve(
            self.element.native,
            self.native,
            speed=at.speed,
            normal_load=[at.axle_load] * 2,
            friction_scale=[at.friction_scale] * 2,
            resistance_force=at.resistance_force,
            balanced=float(balanced),
        )

    def linearize(self, point: OperatingPoint) -> StateSpace:
        """Linear model about an operating point, for python-control.

        States as in `states`; inputs ``drive_torque`` and ``resistance_force``; outputs ``omega``,
        ``speed``, ``creepage``, ``creep_force``. Of a contact with memory it is the model of a
        motion towards larger creepage: see `jacobians`.
        """
        control = optional_library("control")

        _, contact = self.rates(
            point.omega,
            point.speed,
            point.drive_torque,
            point.axle_load,
            point.friction_scale,
            point.resistance_force,
        )
        kept = [STATES.index(name) for name in self.states]
        by_input, by_state = np.zeros((4, 2)), np.zeros((4, 4))
        by_input[0, 0] = 1.0 / self.inertia
        by_input[1, 1] = 0.0 if self.mass is None else -1.0 / self.mass
        by_state[0, 0] = by_state[1, 1] = 1.0
        by_state[2, :2] = contact.creepage_by_omega, contact.creepage_by_speed
        if self.element.memory:
            by_state[3, 2] = 1.0
        else:
            by_state[3, :2] = contact.force_by_omega, contact.force_by_speed
        return control.ss(
            point.jacobian,
            by_input[kept],
            by_state[:, kept],
            np.zeros((4, 2)),
            states=list(self.states),
            inputs=["drive_torque", "resistance_force"],
            outputs=list(SIGNALS_OUT),
        )

    def to_nlsys(self, *, speed: float | None = None) -> NonlinearIOSystem:
        """The equations of motion, for python-control.

        States as in `states`, with memory also ``outer_force``; inputs ``drive_torque``,
        ``axle_load``, ``friction_scale`` and ``resistance_force``, all needed in this order;
        outputs ``omega``, ``speed``, ``creepage``, ``creep_force``. For a short pulse of an input
        `control.input_output_response` needs a ``max_step`` in its ``solve_ivp_kwargs``, as it
        steps over the pulse; `simulate` does not.

        Parameters
        ----------
        speed : float, optional
            Held forward speed [m/s], the parameter ``speed`` of the system; needed if, and only
            if, the wheelset has no mass.

        Raises
        ------
        ValueError
            If `speed` is missing or must not be given. The system raises it if a load or friction
            scale is out of range, as python-control uses zero for an input that is forgotten.
        """
        control = optional_library("control")

        if (speed is None) == self.speed_held:
            state = "is needed: the speed is held" if speed is None else "is a state, not given"
            raise ValueError(f"speed = {speed!r}: the speed of this wheelset {state}")
        limits, native = kernel.force_input_limits(), self.element.rolling_native

        def at(x: FloatArray, u: FloatArray, given: Mapping[str, float]) -> tuple[Any, Any, float]:
            at_speed = given["speed"] if self.speed_held else x[1]
            for name, value in zip(SIGNALS_IN[1:3], u[1:3], strict=True):
                checked(name, value, limits[name])
            contact = native.evaluate_one(x[0], at_speed, u[1], u[2], *memory(x))
            return self.native.motion(x[0], at_speed, u[0], u[3], contact), contact, at_speed

        def memory(x: FloatArray) -> tuple[float, ...]:
            return tuple(x[-3:]) if self.element.memory else ()

        def update(_: float, x: FloatArray, u: FloatArray, given: Mapping[str, float]) -> Any:
            rates, contact, _ = at(x, u, given)
            moving = np.array([rates.omega_rate, rates.speed_rate])[: 1 if self.speed_held else 2]
            if not self.element.memory:
                return moving
            held = [contact.held_rate, contact.unslipped_rate, contact.outer_rate]
            return np.append(moving, held)

        def output(_: float, x: FloatArray, u: FloatArray, given: Mapping[str, float]) -> Any:
            _, contact, at_speed = at(x, u, given)
            return np.array([x[0], at_speed, contact.creepage, contact.creep_force])

        return control.nlsys(
            update,
            output,
            name="wheelset",
            states=[*self.states, *(["outer_force"] if self.element.memory else [])],
            inputs=list(SIGNALS_IN),
            outputs=list(SIGNALS_OUT),
            params={"speed": checked_number("speed", speed, FINITE)} if speed is not None else {},
        )


def of_the_motion(matrices: FloatArray) -> FloatArray:
    """Jacobians in which an unslipped part on which no force depends decays the fastest.

    Their eigenvalues, but for the last one, are those of the creepage, the speed and the force.
    """
    alone = (matrices[..., :-1, -1] == 0.0).all(axis=-1)
    moved = matrices.copy()
    fastest = -np.abs(matrices).sum(axis=(-2, -1))
    moved[..., -1, -1] = np.where(alone, fastest, matrices[..., -1, -1])
    return moved


@checks_call
def geared_inertia(
    *,
    inertia: Annotated[float, INERTIA],
    rotor_inertia: Annotated[float | None, ROTOR_INERTIA] = None,
    gear_ratio: Annotated[float | None, GEAR_RATIO] = None,
) -> float:
    """Moment of inertia about the axle with a rotor that turns faster [kg.m2].

    Parameters
    ----------
    inertia : float
        Moment of inertia J about the axle, with the drive's, geared; without the rotor's if the
        next two are given [kg.m2].
    rotor_inertia : float, optional
        Moment of inertia of the motor's rotor about its shaft [kg.m2]. With `gear_ratio` n, the
        wheelset has J = inertia + n^2 rotor_inertia.
    gear_ratio : float, optional
        Speed of the rotor / speed of the wheelset [1].

    Raises
    ------
    ValueError
        If a value is out of range, or only one of the last two is given.
    """
    if (rotor_inertia is None) != (gear_ratio is None):
        given = "rotor_inertia" if gear_ratio is None else "gear_ratio"
        raise ValueError(f"rotor_inertia and gear_ratio go together; given is {given}")
    if rotor_inertia is None or gear_ratio is None:
        return inertia
    return inertia + gear_ratio * gear_ratio * rotor_inertia


def checked_torque(value: ArrayLike) -> float:
    """Check a drive torque [N.m]; a ValueError names it."""
    return checked_number("drive_torque", value, kernel.wheelset_limits()["drive_torque"])
