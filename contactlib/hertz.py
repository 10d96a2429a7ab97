"""The normal contact problem: Hertzian contact of a wheel on a rail or roller.

Equations (4) and (5) are those of Ciavarella, Romano & Barber, "Rolling of a cylinder with
slip-dependent friction: the Carter solution revisited"; they are Hertz's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from contactlib.parameters import POSITIVE, Parameters, Quantity, checked


@dataclass(frozen=True, kw_only=True)
class Material(Parameters):
    """Isotropic elastic material.

    Parameters
    ----------
    youngs_modulus : float
        E [Pa].
    poisson_ratio : float
        nu [1], from 0 to 0.5.

    Examples
    --------
    >>> steel = Material(youngs_modulus=210e9, poisson_ratio=0.3)
    >>> round(steel.contact_modulus_with(steel) / 1e9, 3)
    115.385
    """

    youngs_modulus: Annotated[float, Quantity("Pa", above=0.0)]
    poisson_ratio: Annotated[float, Quantity("1", at_least=0.0, at_most=0.5)]

    def contact_modulus_with(self, other: Material) -> float:
        """Composite contact modulus E* of two bodies [Pa], Eq. (4)."""
        compliance = sum(
            (1.0 - body.poisson_ratio**2) / body.youngs_modulus for body in (self, other)
        )
        return 1.0 / compliance  # Eq. (4)


@dataclass(frozen=True, kw_only=True)
class LineContact(Parameters):
    """Cylinder of finite length on a half-space; conditions are the same along its length.

    Parameters
    ----------
    normal_load_per_length : float
        P at the nominal state [N/m].
    radius : float
        R, relative radius of the two surfaces [m].
    contact_modulus : float
        E*, Eq. (4) [Pa].
    length : float, optional
        Length of the contact across the rolling direction [m]; it turns the force per length
        into a force. The default 1 m makes the two numbers equal.

    Notes
    -----
    Away from the nominal load, semi-width and peak pressure grow like the load to the power
    `load_exponent`.
    """

    normal_load_per_length: Annotated[float, Quantity("N/m", above=0.0)]
    radius: Annotated[float, Quantity("m", above=0.0)]
    contact_modulus: Annotated[float, Quantity("Pa", above=0.0)]
    length: Annotated[float, Quantity("m", above=0.0)] = 1.0

    load_exponent = 0.5

    @classmethod
    def from_semi_width(
        cls, *, semi_width: float, radius: float, contact_modulus: float, normal_load: float
    ) -> LineContact:
        """Make the contact that is `semi_width` (a) [m] wide each way under `normal_load` [N].

        Examples
        --------
        >>> contact = LineContact.from_semi_width(
        ...     semi_width=5e-3, radius=0.5, contact_modulus=115.4e9, normal_load=220e3)
        >>> round(contact.semi_width, 12), round(contact.normal_load, 6)
        (0.005, 220000.0)
        """
        arguments = {
            "semi_width": semi_width,
            "radius": radius,
            "contact_modulus": contact_modulus,
            "normal_load": normal_load,
        }
        for name, value in arguments.items():
            checked(name, value, POSITIVE)
        per_length = math.pi * contact_modulus * semi_width**2 / (4.0 * radius)  # Eq. (5) for P
        return cls(
            normal_load_per_length=per_length,
            radius=radius,
            contact_modulus=contact_modulus,
            length=normal_load / per_length,
        )

    @property
    def normal_load(self) -> float:
        """Total nominal load [N]."""
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
