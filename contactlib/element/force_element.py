"""The force element: creep force of a wheel from its velocities and load, by the kernel.

Sign: rolling is along +x with omega > 0; creepage and creep force are positive when the wheel
drives the vehicle forward.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib import kernel
from contactlib.base.quantities import (
    FINITE,
    POSITIVE,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
    common_shape,
    derived,
    records,
    shown,
)
from contactlib.element.lateral_spin import SPINNING, lateral_spin_contact, spinning_aspect
from contactlib.laws.friction import Friction
from contactlib.laws.hertz import Contact, EllipticContact
from contactlib.laws.relaxation import LINE
from contactlib.laws.scales import (
    LAYER_COMPLIANCE,
    SLOPE_REDUCTION,
    contact_parameters,
    k_hat,
    process_zone_ratio,
    saturation_creepage,
)
from contactlib.table.creep_force_table import CreepForceTable

if TYPE_CHECKING:
    from contactlib.laws.measured import MeasuredCurve


class RangeWarning(UserWarning):
    """The law is used outside the range for which it was checked."""


class ProcessZoneWarning(RangeWarning):
    """The weakening zone is too long for the law's limit of a vanishing one."""


class AspectWarning(RangeWarning):
    """The ratio of an ellipse's axes is outside the range for which the law was checked."""


RADIUS = Quantity("m", above=0.0, usual=(0.01, 2.0))  # of a wheel
NUMBERS = frozenset((float, int, np.float64))  # types that need no array
REFERENCE_SPEED = "max(|initial_speed|, minimum_speed)"  # for the initial creepage of a run


def creepage_limits(element: ForceElement, speed: float, name: str = "speed") -> Limits:
    """Limits of the creepage at a speed [m/s], from the kernel's limit of the angular velocity."""
    largest = kernel.force_input_limits()["omega"].at_most * element.radius / speed
    return Limits(at_least=-1.0 - largest, at_most=largest - 1.0, given=(name, speed))


def check_layer(name: str, compliance: float, table: CreepForceTable) -> None:
    """Refuse the compliance `name` of a layer that the table's law does not have."""
    if compliance > 0.0 and not table.layered:
        reason = "has no layers"
        if table.one_axis:
            reason = "contains the layer of the rail on which it was measured, if it is a curve"
        elif table.static_to_kinetic:
            reason += (
                "; build it with cohesive_table(..., layers=True), or give the model file itself a "
                "layer_compliance above 0"
            )
        raise ValueError(f"{name} = {compliance!r} must be 0: the table of {table.law!r} {reason}")


@dataclass(frozen=True, eq=False)
class ForceElement(Parameters):
    """Creep force of a wheel.

    Parameters
    ----------
    contact : LineContact or EllipticContact
        Geometry, modulus and nominal load.
    friction : Friction
        Static and kinetic coefficient, weakening length, fall with slip speed. The table contains
        the shape of the weakening.
    table : CreepForceTable
        The law.
    radius : float
        Rolling radius of the wheel [m].
    layer_compliance : float, optional
        L of a thin elastic layer between wheel and rail, its thickness over its shear modulus
        [m/Pa]: 1.3e-13 for 20 um of 150 MPa. It lowers the initial slope and rounds the peak, of a
        small contact more than of a large one: lam = L E*/(2 a). It needs a table with layers:
        that of `carter_griffith_table`, or of `cohesive_table` with `layers`. Default: no layer.
    slope_reduction : float, optional
        The initial slope over that of the bodies with their layer; zeta0 is divided by it [1]. It
        fits a slope without its cause: it stretches the creepage axis alike at any load and leaves
        the peak as high as it is, as no layer does. Default: 1.
    minimum_speed : float, optional
        Speed below which the reference speed of the creepage is regularised and the output
        ``speed_regularized`` is 1 [m/s]. Default: 0.1.
    wheels : int, optional
        Number of equal wheels whose forces the element adds. They share its load; the contact is
        that of one wheel. Default: 1.
    memory : bool, optional
        Whether the force depends on what the contact rolled over: it then follows changes of the
        creepage over the distance rolled, and FMUs and runs have more states. In steady rolling
        nothing changes. Default: no memory, every instant is steady.
    load_exponent : float, optional
        Semi-width and peak pressure, and so zeta0, the scale of the creepage axis, grow like the
        load to this power [1]. 0 keeps the creepage of a measured curve as measured. Default:
        Hertz's, 1/2 for a line contact and 1/3 for an ellipse.

    Warns
    -----
    ProcessZoneWarning
        If the process zone ratio at nominal load is above 0.5 and the law is the limit of a short
        weakening zone.
    AspectWarning
        If the contact is an ellipse on the half-space with a/b outside 1/8 to 8.

    Raises
    ------
    ValueError
        If a value is out of range, or the table's law is for another shape of contact, friction
        ratio or shape of weakening.

    Notes
    -----
    The force never exceeds static friction times load. The Carter-Griffith law does not contain
    f_s, so the element limits its force to this value and sets the output ``force_limited`` to 1.
    The force of the cohesive-zone law is always below it.

    The laws of an ellipse are sums of strips; the contact's `tangential_modulus` and `softening`
    correct them for a half-space; with its `theory` "strips" they are not corrected. For a/b from
    0.5 to 2 and constant friction the error of the corrected q is 0.0015. At k_hat 0.3 the error of
    the cohesive-zone law is 0.006, that of the Carter-Griffith law 0.04, because its weakening zone
    is not short.
    """

    contact: Contact
    friction: Friction
    _: KW_ONLY
    table: CreepForceTable
    radius: Annotated[float, RADIUS]
    layer_compliance: Annotated[float, LAYER_COMPLIANCE] = 0.0
    slope_reduction: Annotated[float, SLOPE_REDUCTION] = 1.0
    minimum_speed: Annotated[float, Quantity("m/s", above=0.0, usual=(1e-4, 5.0))] = 0.1
    wheels: Annotated[
        float, Quantity("1", at_least=1.0, at_most=1000.0, usual=(1.0, 100.0), whole=True)
    ] = 1
    load_exponent: Annotated[float | None, Quantity("1", at_least=0.0, at_most=1.0)] = None
    memory: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_table()
        contact = self.contact
        if (
            isinstance(contact, EllipticContact)
            and contact.theory == "half_space"
            and spinning_aspect(contact) is None
        ):
            aspect = contact.semi_axis_x / contact.semi_axis_y
            warnings.warn(
                f"the ellipse has semi_axis_x/semi_axis_y = {aspect:.4g}, outside 1/8 to 8, where "
                "the law was compared with the half-space",
                AspectWarning,
                stacklevel=3,
            )
        zone = process_zone_ratio(self.contact, self.friction)
        limit = kernel.process_zone_limit()
        if self.table.is_limit and zone > limit:
            warnings.warn(
                f"process zone ratio {zone:.2f} is above {limit}: the law is the limit of a short "
                "weakening zone and is inaccurate in this contact's tail; use the cohesive-zone "
                "law, in a file [law] kind = 'cohesive'",
                ProcessZoneWarning,
                stacklevel=3,
            )

    @classmethod
    def from_curve(
        cls, curve: MeasuredCurve | CreepForceTable, contact: Contact, **others: Any
    ) -> Self:
        """Element that gives a measured curve as it was measured, at the contact's nominal load.

        There the traction coefficient at a creepage is the curve's, at any speed. At another load
        the creepage axis of the curve stretches like zeta0, which grows like the load to the
        `load_exponent`; 0 keeps the axis as measured. `friction_scale` stretches both axes, so that
        the initial slope stays.

        Parameters
        ----------
        curve : MeasuredCurve or CreepForceTable
            The curve, or its table. It contains the friction: there is no k_hat, and `static` is
            the curve's peak.
        contact : LineContact or EllipticContact
            Contact whose nominal load is that of the measurement. Its shape only gives the load
            exponent.
        **others
            `radius`, `minimum_speed`, `wheels` and `load_exponent` of `ForceElement`.

        Raises
        ------
        ValueError
            If a value is out of range, or the table is not that of a measured curve.

        Examples
        --------
        >>> from contactlib.laws.hertz import LineContact
        >>> from contactlib.laws.measured import MeasuredCurve
        >>> contact = LineContact.from_semi_width(
        ...     semi_width=5e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=110e3)
        >>> zeta = np.linspace(0.0, 0.1, 41)
        >>> curve = MeasuredCurve(zeta, 0.3 * np.tanh(zeta / 0.01) * np.exp(-zeta / 0.2))
        >>> element = ForceElement.from_curve(curve, contact, radius=0.5)
        >>> found = element.at_creepage(0.02, speed=10.0)["traction_coefficient"]
        >>> bool(abs(found - curve.traction_coefficient(0.02)) < 1e-8)
        True
        """
        table = curve if isinstance(curve, CreepForceTable) else CreepForceTable.from_law(curve)
        if not {"peak", "kinetic", "zeta0"} <= set(table.options):
            raise ValueError(f"curve: expected a measured curve's table, got {table.law!r}")
        peak, kinetic, zeta0 = (float(table.options[n]) for n in ("peak", "kinetic", "zeta0"))
        # The table's rounding must not reach the limit at which the kernel holds the force.
        friction = Friction(static=peak * (1.0 + 1e-6), kinetic=kinetic, weakening_length=0.0)
        reduction = saturation_creepage(contact, friction) / zeta0
        return cls(contact, friction, table=table, slope_reduction=reduction, **others)

    def _check_table(self) -> None:
        """Refuse a table whose law is not for this contact and friction."""
        table, ratio = self.table, self.friction.ratio
        if not table.one_axis and self.k_hat > table.k_max:
            raise ValueError(
                f"k_hat = {self.k_hat!r} of this contact and friction is out of range: "
                f"must be <= {table.k_max!r} for this table"
            )
        check_layer("ForceElement.layer_compliance", self.layer_compliance, table)
        shape = "elliptic" if isinstance(self.contact, EllipticContact) else "line"
        if table.options.get("contact", shape) != shape:
            raise ValueError(
                f"ForceElement.table is for {table.law!r}, but ForceElement.contact is {shape}"
            )
        if table.static_to_kinetic and not math.isclose(table.static_to_kinetic, ratio):
            raise ValueError(
                f"ForceElement.friction.ratio = {ratio!r} does not fit the table's law: "
                f"must be {table.static_to_kinetic!r}"
            )
        weakening = table.options.get("weakening", "exponential")
        if table.static_to_kinetic and weakening != self.friction.weakening.name:
            raise ValueError(
                f"ForceElement.friction.weakening is {self.friction.weakening.name!r}, "
                f"but the table's law is for {weakening!r}"
            )

    @property
    def _softens(self) -> bool:
        """Only the laws of strips are corrected for the softening of the half-space."""
        return "contact" in self.table.options

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the kernel's force element, by name, in SI units."""
        return {
            "radius": self.radius,
            "minimum_speed": self.minimum_speed,
            **contact_parameters(
                self.contact, self.friction, self.slope_reduction, self.layer_compliance
            ),
            "softening": self.contact.softening if self._softens else 0.0,
            **({} if self.load_exponent is None else {"load_exponent": self.load_exponent}),
            "nominal_load": self.axle_load,
        }

    @property
    def rolling_parameters(self) -> dict[str, float]:
        """`parameters` of the element as it moves: with its memory, if it has one."""
        return {**self.parameters, **(self.memory_parameters if self.memory else {})}

    @cached_property
    def memory_parameters(self) -> dict[str, float]:
        """The kernel's parameters of the contact's memory; it derives `memory_scales` from them."""
        contact = self.contact
        contact.memory()  # a line contact must not be short
        return {
            "memory": 1.0,
            "body_modulus": contact.contact_modulus,
            "poisson_ratio": contact.poisson_ratio,
            "transverse_half_length": contact.transverse_half_length,
        }

    @cached_property
    def memory_scales(self) -> Any:
        """Struct `contact_scales` of the kernel at the nominal load, with those of the memory."""
        parameters = {**self.parameters, **self.memory_parameters}
        return kernel.contact_scales(parameters, self.axle_load, table=self.table.native)

    def warning(self, largest_load: float) -> str | None:
        """Sentence on a load [N] under which a line contact is too short for memory; else None.

        Raises
        ------
        ValueError
            If the load is not finite.
        """
        load = checked_number("largest_load", largest_load, FINITE)
        contact, given = self.contact, self.parameters
        if not self.memory or isinstance(contact, EllipticContact) or load <= 0.0:
            return None
        growth = (load / self.axle_load) ** given["load_exponent"]
        ratio, limit = contact.length / (growth * contact.semi_width), LINE.at_least
        if ratio >= limit * (1.0 - 1e-9):
            return None
        return (
            f"the load reaches {load:.4g} N, under which the line contact is {ratio:.3g} "
            f"semi-widths long: its memory is that of {limit:g} semi-widths"
        )

    @property
    def axle_load(self) -> float:
        """Nominal load of all its wheels together [N]."""
        return self.wheels * self.contact.wheel_load

    @cached_property
    def native(self) -> kernel.NativeForceElement:
        """The kernel's force element, which does not check its input."""
        return kernel.NativeForceElement(self.native_contact, self.parameters)

    @cached_property
    def rolling_native(self) -> kernel.NativeForceElement:
        """The same as the element moves: with its memory, if it has one."""
        return kernel.NativeForceElement(self.native_contact, self.rolling_parameters)

    @property
    def lateral_spin_data(self) -> bytes:
        """Data of the contact for lateral and spin force, as an FMU's resource."""
        return lateral_spin_contact(self.contact, softens=self._softens)

    @cached_property
    def native_contact(self) -> kernel.NativeContact:
        """The kernel's table with `lateral_spin_data`."""
        return kernel.NativeContact(self.table.native, self.lateral_spin_data)

    @property
    def k_hat(self) -> float:
        """k_hat at the nominal load and zero slip speed [1]."""
        return k_hat(self.contact, self.friction)

    @property
    def layer_ratio(self) -> float:
        """Layer ratio L E*/(2 a) at the nominal load [1]."""
        return float(kernel.contact_scales(self.parameters, self.axle_load).layer_ratio)

    @cached_property
    def saturation_creepage(self) -> float:
        """zeta0 at the nominal load and zero slip speed [1]."""
        return saturation_creepage(
            self.contact, self.friction, slope_reduction=self.slope_reduction
        )

    def steepest_gradient(self, speed: float) -> float:
        """Largest gradient of the force by slip velocity at the nominal load [N.s/m].

        It is that without slip, but for a measured curve that rises in an S.

        Parameters
        ----------
        speed : float
            Forward velocity [m/s].

        Raises
        ------
        ValueError
            If the speed is out of range.
        """
        speed = checked_number("speed", speed, kernel.force_input_limits()["speed"])
        return self.native.steepest_gradient(speed)

    def saturation_creepage_at(
        self, *, axle_load: float | None = None, friction_scale: float = 1.0
    ) -> float:
        """zeta0 at a load above zero [N], a friction scale [1] and zero slip speed."""
        load = self.axle_load if axle_load is None else axle_load
        load = checked_number("axle_load", load, POSITIVE)
        scale = checked_number("friction_scale", friction_scale, POSITIVE)
        scales = kernel.contact_scales(self.parameters, load, scale)
        given = {**self.parameters, "axle_load": load, "friction_scale": scale}
        return derived("saturation_creepage", lambda: scales.saturation_creepage, given)

    def evaluate(
        self,
        *,
        omega: ArrayLike,
        speed: ArrayLike,
        axle_load: ArrayLike | None = None,
        friction_scale: ArrayLike = 1.0,
        lateral_velocity: ArrayLike = 0.0,
        spin_velocity: ArrayLike = 0.0,
    ) -> NDArray[np.void]:
        """All outputs of the element; arguments broadcast.

        Parameters
        ----------
        omega : array_like
            Angular velocity [rad/s].
        speed : array_like
            Forward velocity [m/s].
        axle_load : array_like, optional
            Load of all its wheels together [N]. Default: the nominal one.
        friction_scale : array_like, optional
            Factor on both friction coefficients [1]. Default: 1.
        lateral_velocity : array_like, optional
            Velocity of the wheel's surface against the rail across rolling, positive to the left
            [m/s]. Default: 0.
        spin_velocity : array_like, optional
            Angular velocity of the wheel against the rail about the vertical axis, positive upwards
            [rad/s]. It needs an ellipse on the half-space with a/b from 1/8 to 8. Default: 0.

        Returns
        -------
        ndarray
            Structured array with fields ``creep_force``, ``lateral_force``, ``spin_moment``,
            ``creepage``, ``force_gradient``, ...; fmu/kernel/force_element.h describes them.

        Raises
        ------
        ValueError
            If a value is not finite or out of range, such as a negative load, or spin is given for
            a contact without spin.
        """
        given = {
            "omega": omega,
            "speed": speed,
            "axle_load": self.axle_load if axle_load is None else axle_load,
            "friction_scale": friction_scale,
            "lateral_velocity": lateral_velocity,
            "spin_velocity": spin_velocity,
        }
        inputs = records(
            kernel.struct_dtype("force_element_input"),
            given,
            kernel.force_input_limits(),
            kernel.LOAD_IN_KERNEL,
        )
        if inputs["spin_velocity"].any() and spinning_aspect(self.contact) is None:
            raise ValueError(
                f"spin_velocity = {shown(spin_velocity)} must be 0: it needs {SPINNING}, "
                "not the contact of this ForceElement"
            )
        return self.native.evaluate(inputs)

    def force(
        self,
        *,
        omega: ArrayLike,
        speed: ArrayLike,
        axle_load: ArrayLike | None = None,
        friction_scale: ArrayLike = 1.0,
        **others: ArrayLike,
    ) -> FloatArray:
        """Creep force [N], positive when it drives the vehicle forward.

        The arguments are those of `evaluate`.
        """
        native = self.native
        load = native.nominal_load if axle_load is None else axle_load
        types = {type(omega), type(speed), type(load), type(friction_scale)}
        if types <= NUMBERS and not others:
            try:
                force = native.force(omega, speed, load, friction_scale)
            except OverflowError:  # of a whole number
                force = math.nan
            if force == force:  # else an input is out of range
                return np.array(force)
        given = {
            "omega": omega,
            "speed": speed,
            "axle_load": load,
            "friction_scale": friction_scale,
        }
        if others:
            return np.asarray(self.evaluate(**given, **others)["creep_force"])
        limits = kernel.force_input_limits()
        arrays = {n: checked(n, value, limits[n], copy=False) for n, value in given.items()}
        common_shape(arrays)
        return native.forces(*arrays.values())

    def at_creepage(
        self,
        creepage: ArrayLike,
        *,
        speed: float,
        **others: ArrayLike,
    ) -> NDArray[np.void]:
        """All outputs at creepages [1] and one forward speed [m/s], at least `minimum_speed`.

        `others` are the further arguments of `evaluate`.
        """
        fastest = kernel.force_input_limits()["speed"].at_most
        speeds = Limits(at_least=self.minimum_speed, at_most=fastest)
        speed = checked_number("speed", speed, speeds)
        creepages = checked("creepage", creepage, creepage_limits(self, speed))
        omega = (1.0 + creepages) * speed / self.radius
        return self.evaluate(omega=omega, speed=speed, **others)
