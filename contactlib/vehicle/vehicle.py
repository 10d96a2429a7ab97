"""A rail vehicle: axles behind one another under bogies and body; the kernel has its statics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.quantities import (
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
)
from contactlib.vehicle.track import Values

MASS = Quantity("kg", at_least=0.0, at_most=1e8, usual=(0.0, 3e6))
BODY_MASS = Quantity("kg", above=0.0, at_most=1e8, usual=(1e3, 3e5))
HEIGHT = Quantity("m", at_least=0.0, at_most=10.0, usual=(0.0, 3.0))
ALLOWED = Limits(at_least=-1e12, at_most=1e12)  # forces and accelerations, in SI units
ROLLING = Limits(at_least=1e-6, at_most=1e3)  # radius [m]
MAX_AXLES = 8  # as in fmu/kernel/drivetrain.h, which has a lane for each
NUMBER = Quantity("1", whole=True, at_least=1, at_most=8)


@dataclass(frozen=True, kw_only=True)
class Vehicle(Parameters):
    """Axles of one vehicle, which share its speed.

    Each axle is the wheelset of the vehicle's model file, with its own motor or brake, sensors,
    controller and contacts. `loads` gives the loads of the axles by statics of rigid bodies in the
    vertical plane: equal springs on all axles of a bogie and under both ends of the body.

    Parameters
    ----------
    position : tuple of float
        Distance of each axle behind the first one, from zero on [m]; 1 to 8 axles.
    axles_per_bogie : float, optional
        Number of axles of each bogie, whose pivot is in the middle of them; a single axle has a
        bogie of its own. Default: 2.
    body_mass : float
        Mass of the body [kg].
    bogie_mass : float
        Mass of one bogie without its wheelsets [kg].
    wheelset_mass : float
        Mass of one wheelset [kg].
    train_mass : float, optional
        Mass of the train behind the coupler [kg]. Default: 0.
    length : float, optional
        Length of vehicle and train behind the first axle [m]. A lower speed limit holds until the
        tail has passed, and the train, evenly along its length, is on the grades behind the last
        axle. Default: up to the last axle; the train is on the grades under the axles.
    body_height : float
        Height of the body's centre of mass above the rail [m].
    bogie_height : float
        Height of a bogie's centre of mass, without its wheelsets, above the rail [m].
    pivot_height : float
        Height above the rail at which the bogies pull the body [m].
    coupler_height : float
        Height of the coupler above the rail [m].
    pitch_inertia : float, optional
        Angular momentum of wheelset and rotor over the wheelset's angular velocity [kg.m2]: that of
        the wheelset less ``gear_ratio`` times that of a rotor that turns the other way. A wheelset
        that slips away lifts its bogie's front by it. Default: 0.
    load_lag : float, optional
        Time constant with which the loads follow the forces, that of the suspension [s]. Default:
        0.02.
    driven : tuple of float, optional
        Numbers of the axles, from 1, to which a demand of traction applies. Default: all.
    braked : tuple of float, optional
        Numbers of the axles, from 1, to which a demand of braking applies. Default: all.

    Raises
    ------
    ValueError
        If a value is out of range, the positions are not increasing from zero, or the axles do not
        fill the bogies.

    Notes
    -----
    A bogie under the forces Q_i of its axles at the rails, with the acceleration a, pulls the body
    by H = sum Q_i - m a, and its axles' loads differ by the moment

        H pivot_height + m_bogie a bogie_height + m_wheelsets a r + pitch_inertia sum domega/dt,

    which a bogie of one axle hands to the body. The body's pivots differ by the moment of the
    coupler's force, of its own inertia and of the vehicle's resistance about the pivots' height.
    Vehicle and train share the resistance, sum Q - m a, in proportion to their masses; the
    vehicle's acts at the height of the body's centre of mass. On a grade, a contains the weight's
    part along the track. A vehicle of one axle has nothing that carries a moment: the load is its
    weight.

    Examples
    --------
    >>> four = Vehicle(
    ...     position=(0.0, 3.0, 9.9, 12.9), body_mass=53.6e3, bogie_mass=13e3, wheelset_mass=2.6e3,
    ...     train_mass=480e3, body_height=1.8, bogie_height=0.6, pivot_height=0.4,
    ...     coupler_height=1.04)
    >>> (four.loads([50e3] * 4, acceleration=0.2, radius=0.5) / 1e3).round(1).tolist()
    [199.9, 227.0, 214.3, 241.4]
    """

    position: Annotated[Values, Quantity("m", at_least=0.0, at_most=100.0)]
    axles_per_bogie: Annotated[float, NUMBER] = 2
    body_mass: Annotated[float, BODY_MASS]
    bogie_mass: Annotated[float, MASS]
    wheelset_mass: Annotated[float, MASS]
    train_mass: Annotated[float, MASS] = 0.0
    length: Annotated[float | None, Quantity("m", above=0.0, at_most=1e4)] = None
    body_height: Annotated[float, HEIGHT]
    bogie_height: Annotated[float, HEIGHT]
    pivot_height: Annotated[float, HEIGHT]
    coupler_height: Annotated[float, HEIGHT]
    pitch_inertia: Annotated[float, Quantity("kg.m2", at_least=-1e5, at_most=1e5)] = 0.0
    load_lag: Annotated[float, Quantity("s", at_least=0.0, at_most=10.0)] = 0.02
    driven: Annotated[Values, NUMBER] = ()
    braked: Annotated[Values, NUMBER] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        n = self.axles
        if not 1 <= n <= MAX_AXLES:
            raise ValueError(f"position has {n} entries: a vehicle has 1 to {MAX_AXLES} axles")
        if self.position[0] != 0.0 or (np.diff(self.position) <= 0.0).any():
            raise ValueError(
                f"position = {self.position!r} must start with 0 and be strictly increasing: it is "
                "the distance of each axle behind the first one"
            )
        if self.length is not None and self.length < self.position[-1]:
            raise ValueError(
                f"length = {self.length!r} is out of range: must be >= {self.position[-1]!r}, the "
                "last axle's position"
            )
        if n > 1 and (n % self.axles_per_bogie or n == self.axles_per_bogie):
            raise ValueError(
                f"axles_per_bogie = {self.axles_per_bogie:g} must give two or more bogies of "
                f"{n} axles"
            )
        for name in ("driven", "braked"):
            if any(not number <= n for number in getattr(self, name)):
                given = ", ".join(f"{number:g}" for number in getattr(self, name))
                raise ValueError(f"{name} = [{given}] must be numbers from 1 to {n}")

    @property
    def axles(self) -> int:
        """Number of axles."""
        return len(self.position)

    @property
    def own_mass(self) -> float:
        """Mass of the vehicle without its train [kg]."""
        bogies = self.axles / min(self.axles_per_bogie, self.axles)
        return self.body_mass + bogies * self.bogie_mass + self.axles * self.wheelset_mass

    @property
    def mass(self) -> float:
        """Mass of vehicle and train [kg]."""
        return self.own_mass + self.train_mass

    def loads(
        self,
        creep_force: ArrayLike,
        *,
        acceleration: ArrayLike,
        radius: float,
        omega_rate: ArrayLike | None = None,
    ) -> FloatArray:
        """Load of each axle by statics, at least zero [N].

        Parameters
        ----------
        creep_force : array_like, shape (..., n)
            Creep force of each axle, positive in traction [N].
        acceleration : array_like, shape (...)
            Acceleration of the vehicle plus g times the grade [m/s2].
        radius : float
            Height of the wheelsets' centres above the rail [m].
        omega_rate : array_like, optional
            Angular acceleration of each wheelset, of the shape of `creep_force` [rad/s2]. Default:
            that of rolling without a change of slip.

        Raises
        ------
        ValueError
            If a value is out of range or there is not a force for each axle.
        """
        force = checked("creep_force", creep_force, ALLOWED)
        a = checked("acceleration", acceleration, ALLOWED)
        if force.shape[-1:] != (self.axles,):
            raise ValueError(
                f"creep_force has the shape {force.shape}: its last axis must have {self.axles} "
                "entries, one for each axle"
            )
        radius = checked_number("radius", radius, ROLLING)
        turning = a[..., np.newaxis] / radius * np.ones(self.axles)
        if omega_rate is not None:
            turning = checked("omega_rate", omega_rate, ALLOWED)
        force, turning = np.broadcast_arrays(force + 0.0 * a[..., np.newaxis], turning)
        a = np.broadcast_to(a, force.shape[:-1])
        return kernel.vehicle_loads(vars(self), radius, force, a, turning)
