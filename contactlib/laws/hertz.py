"""The normal contact problem: Hertzian contact of a wheel on a rail or roller.

Equation numbers are those of Ciavarella, Romano & Barber, "Rolling of a cylinder with
slip-dependent friction: the Carter solution revisited".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Literal

from contactlib import kernel
from contactlib.base.quantities import (
    Limits,
    Parameters,
    Quantity,
    checks_call,
    derived,
)
from contactlib.laws.kalker import POISSON_RATIO, HalfSpaceScales, half_space_scales
from contactlib.laws.relaxation import LINE, RelaxationLengths

AXES = Limits(at_least=1e-30, at_most=1e30)  # ratio of an ellipse's axes
WHEEL_LOAD = Quantity("N", above=0.0, usual=(500.0, 1e6))  # of one wheel
SEMI_AXIS = Quantity("m", above=0.0, usual=(1e-5, 0.1))
Theory = Literal["half_space", "strips"]
ROLLING = Limits(above=0.0, at_most=20.0 * (1.0 + 1e-9))  # a/b of an ellipse on a half-space
RADII = Limits(at_least=1e-60, at_most=1e60)  # ratio of the principal radii


@dataclass(frozen=True, kw_only=True)
class Material(Parameters):
    """Isotropic elastic material.

    Parameters
    ----------
    youngs_modulus : float
        Young's modulus E [Pa].
    poisson_ratio : float
        Poisson's ratio nu [1], from 0 to 0.5.

    Examples
    --------
    >>> steel = Material(youngs_modulus=210e9, poisson_ratio=0.3)
    >>> round(steel.contact_modulus_with(steel) / 1e9, 3)
    115.385
    """

    youngs_modulus: Annotated[float, Quantity("Pa", above=0.0, usual=(1e6, 1e12))]
    poisson_ratio: Annotated[float, POISSON_RATIO]

    def contact_modulus_with(self, other: Material) -> float:
        """Composite contact modulus E* of two bodies [Pa], Eq. (4)."""
        bodies = (self, other)
        given = {
            f"{name} of body {i}": getattr(body, name)
            for i, body in enumerate(bodies, start=1)
            for name in ("youngs_modulus", "poisson_ratio")
        }

        def modulus() -> float:  # Eq. (4)
            return 1.0 / sum((1.0 - b.poisson_ratio**2) / b.youngs_modulus for b in bodies)

        return derived("contact modulus", modulus, given)


@dataclass(frozen=True, kw_only=True)
class LineContact(Parameters):
    """Line contact of one wheel: a cylinder of finite length, with one state along its length.

    Parameters
    ----------
    normal_load_per_length : float
        P at the nominal state, of one wheel [N/m].
    radius : float
        R, relative radius of the two surfaces of a line contact [m].
    contact_modulus : float
        E*, Eq. (4) [Pa].
    length : float, optional
        Length of the contact across the rolling direction [m]. Default: 1, which makes force and
        force per length the same number.
    poisson_ratio : float, optional
        nu of both bodies [1], from 0 to 0.5; it enters the stiffness across rolling only. Default:
        0.3, steel's.

    Notes
    -----
    Away from the nominal load, semi-width and peak pressure grow like the load to the power
    `load_exponent`.
    """

    normal_load_per_length: Annotated[float, Quantity("N/m", above=0.0)]
    radius: Annotated[float, Quantity("m", above=0.0, usual=(0.005, 5.0))]
    contact_modulus: Annotated[float, Quantity("Pa", above=0.0)]
    length: Annotated[float, Quantity("m", above=0.0)] = 1.0
    poisson_ratio: Annotated[float, POISSON_RATIO] = 0.3

    load_exponent = 0.5
    initial_slope = 2.0  # of Carter's law
    softening = lateral_softening = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_derived("wheel_load", "semi_width", "peak_pressure")

    @classmethod
    @checks_call
    def from_semi_width(
        cls,
        *,
        semi_width: Annotated[float, SEMI_AXIS],
        radius: float,
        contact_modulus: float,
        wheel_load: Annotated[float, WHEEL_LOAD],
        poisson_ratio: float = poisson_ratio,
    ) -> LineContact:
        """Make the contact from its semi-width; the other numbers are the fields of the class.

        Parameters
        ----------
        semi_width : float
            Half-width a of a line contact in the rolling direction, under the nominal load [m].
        wheel_load : float
            Nominal load P of one wheel [N]. All scales follow the load of a run from here.

        Examples
        --------
        >>> contact = LineContact.from_semi_width(
        ...     semi_width=5e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=110e3)
        >>> round(contact.semi_width, 12), round(contact.wheel_load, 6)
        (0.005, 110000.0)
        """
        given = {
            "semi_width": semi_width,
            "radius": radius,
            "contact_modulus": contact_modulus,
            "wheel_load": wheel_load,
        }
        per_length = derived(  # Eq. (5) for P
            "normal_load_per_length",
            lambda: math.pi * contact_modulus * semi_width**2 / (4.0 * radius),
            given,
        )
        return cls(
            normal_load_per_length=per_length,
            radius=radius,
            contact_modulus=contact_modulus,
            length=derived("length", lambda: wheel_load / per_length, given),
            poisson_ratio=poisson_ratio,
        )

    @property
    def wheel_load(self) -> float:
        """Nominal load of one wheel [N]."""
        return self.normal_load_per_length * self.length

    @property
    def semi_width(self) -> float:
        """Half the contact width at the nominal load, a [m]."""
        load_radius = self.normal_load_per_length * self.radius
        return 2.0 * math.sqrt(load_radius / (math.pi * self.contact_modulus))  # Eq. (5)

    @property
    def peak_pressure(self) -> float:
        """Largest pressure at the nominal load, p0 [Pa]."""
        return 2.0 * self.normal_load_per_length / (math.pi * self.semi_width)  # Eq. (5)

    @property
    def transverse_half_length(self) -> float:
        """Half the contact's length across rolling [m]."""
        return 0.5 * self.length

    @property
    def tangential_modulus(self) -> float:
        """Modulus of the stiffness against creepage: E* [Pa]."""
        return self.contact_modulus

    @property
    def lateral_stiffness_ratio(self) -> float:
        """Stiffness against creepage across rolling over that along it [1]."""
        return 1.0 - self.poisson_ratio

    @property
    def relaxation_lengths(self) -> RelaxationLengths:
        """Relaxation lengths over `semi_width` [1]; 0 for spin, which is not modelled.

        With one state along the length L, the mean displacement over L and a = `semi_width`,

            l + k (l + 5/3),    l = ln(4 L/a) - 3/2 + e,    k = 8 a c/(pi**2 L)

        where e = nu/(1-nu) and c = (1 - 2 nu)/(1-nu) along rolling, -nu and 1 + nu across it. The
        error is of the order of (a/L)**2: 4 % at L = 4 a, and 1 % at 10 a. Raises ValueError if
        the length is less than 4 semi-widths.
        """
        memory = self.memory()
        return RelaxationLengths(memory.relaxation_length, memory.lateral_relaxation_length, 0.0)

    @property
    def standing_stiffness(self) -> float:
        """Tangential stiffness at standstill over that of a lag of `relaxation_lengths` [1].

        Mindlin's problem: q grows by 2/(ln(4 L/a) - 1 + nu/(1-nu)) of the displacement over
        `semi_width` zeta0, and by 2/`relaxation_lengths`.longitudinal of it in a first-order lag.
        """
        memory = self.memory()
        return float(memory.standing_stiffness * memory.relaxation_length / self.initial_slope)

    def memory(self, **layer: float) -> Any:
        """Struct `contact_memory` of the kernel at the nominal load; arguments name its layer."""
        given = {"length": self.length, "semi_width": self.semi_width}
        ratio = derived("length/semi_width", lambda: self.length / self.semi_width, given, LINE)
        return kernel.contact_memory(False, 2.0 / ratio, self.poisson_ratio, **layer)


@dataclass(frozen=True, kw_only=True)
class EllipticContact(Parameters):
    """Elliptic contact of one wheel, with its axes along and across rolling.

    Parameters
    ----------
    wheel_load : float
        Nominal load P of one wheel [N]. All scales follow the load of a run from here.
    radius_x : float
        Relative radius of the two surfaces in the rolling direction x [m].
    radius_y : float
        Relative radius across the rolling direction [m].
    contact_modulus : float
        E*, Eq. (4) [Pa].
    poisson_ratio : float, optional
        nu of both bodies [1], from 0 to 0.5; it enters the stiffness against creepage only.
        Default: 0.3, steel's.
    theory : str, optional
        Theory of an ellipse. ``"half_space"``: stiffness of an elastic half-space, see
        `half_space_scales`. ``"strips"``: uncoupled strips along the rolling direction, as in the
        paper; the ratio of the axes then has no effect.

    Notes
    -----
    The pressure p0 sqrt(1 - (x/a)**2 - (y/b)**2) must flatten both curvatures:

        1/R_x = P R_D(0, b**2, a**2)/(pi E*),    1/R_y = P R_D(0, a**2, b**2)/(pi E*)

    with Carlson's complete elliptic integral R_D, which is accurate for any ellipse and needs no
    distinction of the longer axis. Away from the nominal load, semi-axes and peak pressure grow
    like the load to the power `load_exponent`.

    Examples
    --------
    >>> ball = EllipticContact(
    ...     wheel_load=100e3, radius_x=0.5, radius_y=0.5, contact_modulus=115.4e9)
    >>> round(1e3 * ball.semi_axis_x, 3), round(1e3 * ball.semi_axis_y, 3)
    (6.875, 6.875)
    """

    wheel_load: Annotated[float, WHEEL_LOAD]
    radius_x: Annotated[float, Quantity("m", above=0.0, usual=(0.005, 5.0))]
    radius_y: Annotated[float, Quantity("m", above=0.0, usual=(0.005, 1e3))]
    contact_modulus: Annotated[float, Quantity("Pa", above=0.0)]
    poisson_ratio: Annotated[float, POISSON_RATIO] = 0.3
    theory: Theory = "half_space"

    load_exponent = 1.0 / 3.0
    initial_slope = 0.75 * math.pi  # of Carter's law in strips

    def __post_init__(self) -> None:
        super().__post_init__()
        radii = {"radius_x": self.radius_x, "radius_y": self.radius_y}
        derived("radius_y/radius_x", lambda: self.radius_y / self.radius_x, radii, RADII)
        self._check_derived("semi_axis_x", "semi_axis_y", "peak_pressure")
        if self.theory == "half_space":
            name = "semi_axis_x/semi_axis_y on a half-space"
            derived(name, lambda: self.semi_axis_x / self.semi_axis_y, radii, ROLLING)
        self._check_derived("tangential_modulus")

    @classmethod
    @checks_call
    def from_semi_axes(
        cls,
        *,
        semi_axis_x: Annotated[float, SEMI_AXIS],
        semi_axis_y: Annotated[float, SEMI_AXIS],
        wheel_load: float,
        contact_modulus: float,
        poisson_ratio: float = poisson_ratio,
        theory: Theory = theory,
    ) -> EllipticContact:
        """Make the contact from its semi-axes; the other numbers are the fields of the class.

        Parameters
        ----------
        semi_axis_x : float
            Semi-axis a of an ellipse in the rolling direction, under the nominal load [m].
        semi_axis_y : float
            Semi-axis b of an ellipse across the rolling direction, under the nominal load [m].

        Examples
        --------
        >>> contact = EllipticContact.from_semi_axes(
        ...     semi_axis_x=6.304e-3, semi_axis_y=12.61e-3, wheel_load=106.7e3,
        ...     contact_modulus=113.9e9)
        >>> round(contact.semi_axis_y, 12), round(contact.peak_pressure / 1e6, 1)
        (0.01261, 640.9)
        """
        given = {
            "semi_axis_x": semi_axis_x,
            "semi_axis_y": semi_axis_y,
            "wheel_load": wheel_load,
            "contact_modulus": contact_modulus,
        }
        derived("semi_axis_y/semi_axis_x", lambda: semi_axis_y / semi_axis_x, given, AXES)

        def radius(along: float, across: float) -> float:
            stiffness = math.pi * contact_modulus / wheel_load
            return stiffness / kernel.hertz_integral(along, across)

        return cls(
            wheel_load=wheel_load,
            radius_x=derived("radius_x", lambda: radius(semi_axis_x, semi_axis_y), given),
            radius_y=derived("radius_y", lambda: radius(semi_axis_y, semi_axis_x), given),
            contact_modulus=contact_modulus,
            poisson_ratio=poisson_ratio,
            theory=theory,
        )

    @cached_property
    def _semi_axes(self) -> tuple[float, float]:
        """Semi-axes a and b at the nominal load [m]."""
        compliance = self.wheel_load / (math.pi * self.contact_modulus)
        return kernel.hertz_semi_axes(self.radius_x, self.radius_y, compliance)

    @property
    def semi_axis_x(self) -> float:
        """Semi-axis in the rolling direction at the nominal load, a [m]."""
        return self._semi_axes[0]

    @property
    def semi_axis_y(self) -> float:
        """Semi-axis across the rolling direction at the nominal load, b [m]."""
        return self._semi_axes[1]

    @property
    def semi_width(self) -> float:
        """Half the contact width in the rolling direction, a [m]: `semi_axis_x`."""
        return self.semi_axis_x

    @property
    def peak_pressure(self) -> float:
        """Largest pressure at the nominal load, p0 [Pa]."""
        return 1.5 * self.wheel_load / (math.pi * self.semi_axis_x * self.semi_axis_y)  # Eq. (20)

    @property
    def transverse_half_length(self) -> float:
        """Half the contact's length across rolling: `semi_axis_y` [m]."""
        return self.semi_axis_y

    @cached_property
    def _scales(self) -> HalfSpaceScales:
        if self.theory == "strips":
            return HalfSpaceScales(1.0, 1.0, 0.0, 0.0)
        return half_space_scales(self.semi_axis_x / self.semi_axis_y, self.poisson_ratio)

    @property
    def tangential_modulus(self) -> float:
        """E* times the stiffness of the rolling ellipse over that of its strips [Pa]."""
        return self.contact_modulus * self._scales.stiffness_x

    @property
    def softening(self) -> float:
        """Part of that stiffness that is lost as the stick area shrinks, up to saturation [1]."""
        return self._scales.softening_x

    @property
    def lateral_stiffness_ratio(self) -> float:
        """Stiffness against creepage across rolling over that along it, c22/c11 [1]."""
        scales = self._scales
        return (1.0 - self.poisson_ratio) * scales.stiffness_y / scales.stiffness_x

    @property
    def lateral_softening(self) -> float:
        """`softening` across rolling [1]."""
        return self._scales.softening_y

    @property
    def relaxation_lengths(self) -> RelaxationLengths:
        """Relaxation lengths over `semi_axis_x` on a half-space, whatever the theory [1].

        Beyond the range of `relaxation_lengths` those of its nearest end.
        """
        ratio = self.semi_axis_x / self.semi_axis_y
        return RelaxationLengths(*kernel.relaxation_lengths(ratio, self.poisson_ratio))

    @property
    def standing_stiffness(self) -> float:
        """Tangential stiffness at standstill over that of a lag of `relaxation_lengths` [1].

        Mindlin's problem of a half-space, whatever the theory: 0.8 for a circle of steel.
        """
        memory, steady = self.memory(), self.initial_slope * self._scales.stiffness_x
        return float(memory.standing_stiffness * memory.relaxation_length / steady)

    def memory(self, **layer: float) -> Any:
        """Struct `contact_memory` of the kernel at the nominal load; arguments name its layer."""
        ratio = self.semi_axis_x / self.semi_axis_y
        return kernel.contact_memory(True, ratio, self.poisson_ratio, **layer)


Contact = LineContact | EllipticContact
