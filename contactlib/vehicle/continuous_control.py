"""Continuous controllers of the drive torque for `simulate`: torque control and creep control.

A continuous controller maps (reference, true creepage, memory) to a torque and the rate of its
memory. References are `Profile` objects, so that an integrator can stop at every corner. Sampled
controllers, which see measured speeds in a scenario, are in `contactlib.traction`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, NamedTuple, Protocol

from contactlib.base.quantities import Parameters, Quantity
from contactlib.vehicle.track import Profile


class Command(NamedTuple):
    """A controller's answer and its partial derivatives.

    Attributes
    ----------
    torque : float
        Drive torque [N.m].
    torque_by_creepage, torque_by_memory : float
        Partial derivatives [N.m, 1].
    memory_rate : float
        Rate of the controller's memory [N.m/s].
    rate_by_creepage, rate_by_memory : float
        Partial derivatives [N.m/s, 1/s].
    """

    torque: float
    torque_by_creepage: float = 0.0
    torque_by_memory: float = 0.0
    memory_rate: float = 0.0
    rate_by_creepage: float = 0.0
    rate_by_memory: float = 0.0


class ContinuousController(Protocol):
    """Interface of a continuous controller for `simulate` and `cosimulate`."""

    asks_for: ClassVar[Literal["drive_torque", "creepage"]]

    @property
    def reference(self) -> Profile:
        """Reference value over time: a torque [N.m] or a creepage [1]."""

    def start(self, torque: float) -> float:
        """Memory that gives `torque` while creepage and reference agree."""

    def command(self, reference: float, creepage: float, memory: float) -> Command:
        """Torque and memory rate."""


@dataclass(frozen=True)
class TorqueControl:
    """Prescribed drive torque ("load control").

    Parameters
    ----------
    reference : Profile
        Drive torque over time [N.m].
    """

    asks_for: ClassVar[Literal["drive_torque", "creepage"]] = "drive_torque"

    reference: Profile

    def start(self, torque: float) -> float:
        """Memory, which is not used."""
        return 0.0

    def command(self, reference: float, creepage: float, memory: float) -> Command:
        """The reference is the torque."""
        return Command(reference)


@dataclass(frozen=True, kw_only=True)
class CreepControl(Parameters):
    """PI control of the creepage, with torque limits and anti-windup by back-calculation.

    T = Kp e + I, held within the limits, and dI/dt = Ki e + (Ki/Kp)(T - (Kp e + I)),
    e = zeta_ref - zeta: at a limit the memory I follows the torque within the time Kp/Ki.

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

    asks_for: ClassVar[Literal["drive_torque", "creepage"]] = "creepage"

    reference: Profile
    proportional_gain: Annotated[float, Quantity("N.m", above=0.0)]
    integral_gain: Annotated[float, Quantity("N.m/s", at_least=0.0)] = 0.0
    torque_min: Annotated[float, Quantity("N.m")]
    torque_max: Annotated[float, Quantity("N.m")]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.torque_min >= self.torque_max:
            raise ValueError(
                f"CreepControl.torque_min = {self.torque_min!r} is out of range: "
                f"must be < torque_max = {self.torque_max!r}"
            )

    def start(self, torque: float) -> float:
        """Memory that gives `torque` while creepage and reference agree."""
        return min(max(torque, self.torque_min), self.torque_max)

    def command(self, reference: float, creepage: float, memory: float) -> Command:
        """Torque and memory rate."""
        error = reference - creepage
        wanted = self.proportional_gain * error + memory
        torque = min(max(wanted, self.torque_min), self.torque_max)
        tracking = self.integral_gain / self.proportional_gain
        rate = self.integral_gain * error + tracking * (torque - wanted)
        if torque == wanted:
            return Command(torque, -self.proportional_gain, 1.0, rate, -self.integral_gain, 0.0)
        # At a limit Ki e - (Ki/Kp)(Kp e + I) = -(Ki/Kp) I depends on the memory alone.
        return Command(torque, 0.0, 0.0, rate, 0.0, -tracking)
