"""Sections of a model file that say what its two runs do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from contactlib.controllers import CreepControl, TorqueControl
from contactlib.parameters import Parameters, Quantity
from contactlib.scenario.reading import profile


@dataclass(frozen=True, kw_only=True)
class TorqueSection(Parameters):
    """``[torque_control]``: breakpoints of the drive torque."""

    time: Annotated[tuple[float, ...], Quantity("s", at_least=0.0)]
    torque: Annotated[tuple[float, ...], Quantity("N.m")]

    def build(self) -> TorqueControl:
        """The controller."""
        return TorqueControl(profile(self, "time", "torque"))


@dataclass(frozen=True, kw_only=True)
class CreepSection(Parameters):
    """``[creep_control]``: breakpoints of the creepage, gains and torque limits."""

    time: Annotated[tuple[float, ...], Quantity("s", at_least=0.0)]
    creepage: Annotated[tuple[float, ...], Quantity("1", above=-1.0)]
    proportional_gain: Annotated[float, Quantity("N.m", above=0.0)]
    integral_gain: Annotated[float, Quantity("N.m/s", at_least=0.0)]
    torque_min: Annotated[float, Quantity("N.m")]
    torque_max: Annotated[float, Quantity("N.m")]

    def build(self) -> CreepControl:
        """The controller."""
        return CreepControl(
            reference=profile(self, "time", "creepage"),
            proportional_gain=self.proportional_gain,
            integral_gain=self.integral_gain,
            torque_min=self.torque_min,
            torque_max=self.torque_max,
        )


@dataclass(frozen=True, kw_only=True)
class RunSection(Parameters):
    """``[run]``: what both controls start from."""

    initial_speed: Annotated[float, Quantity("m/s", above=0.0)]
