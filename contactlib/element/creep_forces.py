"""Creep forces as a vehicle tool needs them: from the contact ellipse and Kalker's creepages.

The ellipse, the load and the friction may differ at every point, as they do when a wheel moves
across a rail. The law is that of `ForceElement` for an ellipse on a half-space, with lateral force
and spin moment. `fmu/kernel/lateral_spin_formula.h` has the formulas, `fmu/kernel/creep_forces.h`
the signs.
"""

from __future__ import annotations

import warnings
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib import kernel
from contactlib.base.quantities import (
    Parameters,
    Quantity,
    records,
)
from contactlib.element.force_element import AspectWarning, ForceElement, check_layer
from contactlib.laws.friction import Friction
from contactlib.laws.hertz import EllipticContact
from contactlib.laws.kalker import POISSON_RATIO
from contactlib.laws.scales import LAYER_COMPLIANCE
from contactlib.table.creep_force_table import CreepForceTable
from contactlib.table.lateral_spin_table import lateral_spin_coefficients
from contactlib.table.law_tables import carter_griffith_table

# An ellipse with a shorter axis [m] is no contact and may not bear more than this load [N], as in
# fmu/kernel/creep_forces.h.
MIN_SEMI_AXIS = 1e-9
MAX_LOAD_OF_NO_CONTACT = 1e-6


@dataclass(frozen=True, eq=False)
class CreepForces(Parameters):
    """Creep forces and spin moment of contact ellipses, in Kalker's signs.

    Parameters
    ----------
    friction : Friction
        Static and kinetic coefficient and weakening length. If it falls with slip speed or its
        heat, `evaluate` needs the speed.
    shear_modulus : float
        G of both bodies [Pa].
    poisson_ratio : float
        nu of both bodies [1], from 0 to 0.5.
    layer_compliance : float, optional
        L of a thin elastic layer between them [m/Pa], as in `ForceElement`. Default: no layer.
    table : CreepForceTable, optional
        Law of an elliptic contact, or one curve such as a measured one, which then applies to any
        ellipse. Default: Carter and Griffith's.

    Raises
    ------
    ValueError
        If a value is out of range, or the table is that of a line contact.

    Notes
    -----
    The guide's page on lateral and spin force lists the errors against half-space solvers.

    Examples
    --------
    >>> steel = Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    >>> bodies = CreepForces(steel, shear_modulus=82e9, poisson_ratio=0.28)
    >>> found = bodies.evaluate(
    ...     semi_axis_x=6e-3, semi_axis_y=6e-3, normal_load=75e3, creepage_x=-0.001, spin=0.2)
    >>> [int(found[name].round()) for name in ("force_x", "force_y")]
    [9633, -4976]
    """

    friction: Friction
    _: KW_ONLY
    shear_modulus: Annotated[float, Quantity("Pa", above=0.0)]
    poisson_ratio: Annotated[float, POISSON_RATIO]
    layer_compliance: Annotated[float, LAYER_COMPLIANCE] = 0.0
    table: CreepForceTable = field(default_factory=lambda: carter_griffith_table("elliptic"))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.table.options.get("contact") != "elliptic" and not self.table.one_axis:
            raise ValueError(
                f"CreepForces.table = {self.table.law!r} must be the table of an ellipse"
            )
        check_layer("CreepForces.layer_compliance", self.layer_compliance, self.table)

    @classmethod
    def of(cls, element: ForceElement) -> CreepForces:
        """The pair of bodies of a force element, whose contact is an ellipse on the half-space.

        Its moduli contain the element's slope reduction, and its weakening length keeps k_hat.

        Raises
        ------
        ValueError
            If the element's contact or law is another one.
        """
        contact, reduction = element.contact, element.slope_reduction
        if not isinstance(contact, EllipticContact) or contact.theory != "half_space":
            raise ValueError(
                "creep forces of any ellipse need a contact that is an ellipse on the half-space"
            )
        friction = replace(
            element.friction, weakening_length=element.friction.weakening_length / reduction
        )
        return cls(
            friction,
            shear_modulus=contact.contact_modulus * (1.0 - contact.poisson_ratio) * reduction,
            poisson_ratio=contact.poisson_ratio,
            layer_compliance=element.layer_compliance / reduction,
            table=element.table,
        )

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the kernel's bodies, by name, in SI units."""
        return {
            "shear_modulus": self.shear_modulus,
            "poisson_ratio": self.poisson_ratio,
            "static_friction": self.friction.static,
            "kinetic_friction": self.friction.kinetic,
            "weakening_length": self.friction.weakening_length,
            "slip_rate_residual": self.friction.slip_rate_residual,
            "slip_rate_decay": self.friction.slip_rate_decay,
            "softening_temperature": self.friction.softening_temperature,
            "thermal_effusivity": self.friction.thermal_effusivity,
            "layer_compliance": self.layer_compliance,
        }

    @property
    def data(self) -> bytes:
        """The kernel's data for any ellipse, as an FMU's resource."""
        nu = self.poisson_ratio
        return kernel.framed(b"CREEPAIR", 1, np.append(nu, lateral_spin_coefficients(nu)).tobytes())

    @cached_property
    def native(self) -> kernel.NativeCreepForces:
        """The kernel's pair of bodies, which does not check its input."""
        coefficients = lateral_spin_coefficients(self.poisson_ratio)
        return kernel.NativeCreepForces(self.table.native, coefficients, self.parameters)

    def evaluate(
        self,
        *,
        semi_axis_x: ArrayLike,
        semi_axis_y: ArrayLike,
        normal_load: ArrayLike,
        creepage_x: ArrayLike = 0.0,
        creepage_y: ArrayLike = 0.0,
        spin: ArrayLike = 0.0,
        friction_scale: ArrayLike = 1.0,
        speed: ArrayLike | None = None,
    ) -> NDArray[np.void]:
        """Forces on the wheel, their use of friction and their derivatives; arguments broadcast.

        Parameters
        ----------
        semi_axis_x, semi_axis_y : array_like
            a along rolling and b across it [m]; both are 0 for a wheel that has lifted off, which
            has no load.
        normal_load : array_like
            N [N]; there is no force without load.
        creepage_x, creepage_y : array_like, optional
            xi = (V - omega r)/V and eta = v_y/V of the wheel's surface against the rail [1];
            xi < 0 is traction. Default: 0.
        spin : array_like, optional
            phi = omega_z/V [1/m], with z up. Default: 0.
        friction_scale : array_like, optional
            Factor on both friction coefficients [1]. Default: 1.
        speed : array_like, optional
            V [m/s], where friction falls with slip speed.

        Returns
        -------
        ndarray
            Structured array with fields ``force_x``, ``force_y`` [N], ``spin_moment`` [N.m],
            ``utilisation`` [1] and the derivatives, as fmu/kernel/creep_forces.h describes them.

        Raises
        ------
        ValueError
            If a value is not finite or out of range, the shapes do not broadcast, or the speed is
            missing.

        Warns
        -----
        AspectWarning
            If a/b is outside 1/8 to 8; the shape of the force is then that of the nearer end.
        """
        if speed is None and self.friction.falls_with_slip_speed:
            raise ValueError("speed is missing: friction falls with slip speed")
        given = {
            "speed": 0.0 if speed is None else speed,
            "semi_axis_x": semi_axis_x,
            "semi_axis_y": semi_axis_y,
            "normal_load": normal_load,
            "friction_scale": friction_scale,
            "creepage_x": creepage_x,
            "creepage_y": creepage_y,
            "spin": spin,
        }
        inputs = records(
            kernel.struct_dtype("creep_forces_input"), given, kernel.creep_forces_limits()
        )
        loaded = inputs[inputs["normal_load"] > MAX_LOAD_OF_NO_CONTACT]
        for name in ("semi_axis_x", "semi_axis_y"):
            short = loaded[loaded[name] < MIN_SEMI_AXIS]
            if short.size:
                raise ValueError(
                    f"{name} = {short[name][0]:g} is out of range: must be at least "
                    f"{MIN_SEMI_AXIS:g} where there is a normal_load, here "
                    f"{short['normal_load'][0]:g}; only a wheel without load has no contact"
                )
        outputs = self.native.evaluate(inputs)
        if outputs["aspect_limited"].any():
            warnings.warn(
                "semi_axis_x/semi_axis_y is outside 1/8 to 8: the shape of the force is that of "
                "the nearer end",
                AspectWarning,
                stacklevel=2,
            )
        return outputs
