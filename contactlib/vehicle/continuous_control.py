"""Continuous controllers of the drive torque for `simulate`: torque control and creep control.

A continuous controller maps (reference, true creepage, integral torque) to a torque and the rate of
that integral; the law is the kernel's. References are `Profile` objects, so an integrator stops
at every corner. Sampled controllers, which see measured speeds in a scenario, are in
`contactlib.traction`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from contactlib import kernel
from contactlib.base.quantities import Parameters, Quantity, checks_call
from contactlib.vehicle.track import TIME, Profile, Values, profile_of


@dataclass(frozen=True)
class TorqueControl:
    """Prescribed drive torque ("load control").

    Parameters
    ----------
    reference : Profile
        Drive torque over time [N.m].
    """

    prescribes: ClassVar[Literal["drive_torque", "creepage"]] = "drive_torque"

    reference: Profile

    @property
    def native(self) -> kernel.NativeLaw:
        """The control law: the reference is the torque."""
        return kernel.NativeLaw()

    def start(self, torque: float) -> float:
        """Memory, which is not used."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class CreepControl(Parameters):
    """PI control of the creepage, with torque limits and anti-windup by back-calculation.

    T = Kp e + I, held within the limits, and dI/dt = Ki e + (Ki/Kp)(T - (Kp e + I)),
    e = zeta_ref - zeta: at a limit the integral torque I follows the torque within the time Kp/Ki.

    Parameters
    ----------
    reference : Profile
        Creepage over time [1].
    proportional_gain : float
        Kp [N.m].
    integral_gain : float, optional
        Ki [N.m/s].
    torque_min : float
        Lowest drive torque [N.m].
    torque_max : float
        Highest drive torque [N.m].

    Raises
    ------
    ValueError
        If a gain is out of range or the limits are not in order.
    """

    prescribes: ClassVar[Literal["drive_torque", "creepage"]] = "creepage"

    reference: Profile
    proportional_gain: Annotated[float, Quantity("N.m", above=0.0, usual=(1.0, 1e8))]
    integral_gain: Annotated[float, Quantity("N.m/s", at_least=0.0, usual=(0.0, 1e10))] = 0.0
    torque_min: Annotated[float, Quantity("N.m", usual=(-3e5, 3e5))]
    torque_max: Annotated[float, Quantity("N.m", usual=(-3e5, 3e5))]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.torque_min >= self.torque_max:
            raise ValueError(
                f"CreepControl.torque_min = {self.torque_min!r} is out of range: "
                f"must be < torque_max = {self.torque_max!r}"
            )

    @property
    def native(self) -> kernel.NativeLaw:
        """The control law."""
        names = "proportional_gain", "integral_gain", "torque_min", "torque_max"
        return kernel.NativeLaw(of_creepage=1, **{name: getattr(self, name) for name in names})

    def start(self, torque: float) -> float:
        """Memory that gives `torque` while creepage and reference agree."""
        return min(max(torque, self.torque_min), self.torque_max)


ContinuousController = TorqueControl | CreepControl


@checks_call
def creepage_over_time(
    *,
    time: Annotated[Values, TIME],
    creepage: Annotated[Values, Quantity("1", above=-1.0, percent=True, usual=(-1.0, 1.0))],
) -> Profile:
    """Reference of creep control.

    Parameters
    ----------
    time : tuple of float
        Breakpoints of the reference [s].
    creepage : tuple of float
        Reference creepage at the breakpoints [1].
    """
    return profile_of(time=time, creepage=creepage)
