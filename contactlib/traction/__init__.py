"""Traction controllers, sampled as in a vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, Protocol

from contactlib.parameters import FloatArray, Parameters, Quantity


@dataclass(frozen=True, kw_only=True)
class Sensors(Parameters):
    """What a vehicle measures, and how well."""

    wheel_speed_noise: Annotated[float, Quantity("m/s", at_least=0.0)] = 0.0
    vehicle_speed_noise: Annotated[float, Quantity("m/s", at_least=0.0)] = 0.0
    delay: Annotated[float, Quantity("s", at_least=0.0)] = 0.0
    seed: Annotated[float, Quantity("1", at_least=0.0)] = 0.0


class Measurement(NamedTuple):
    """Demand [N.m], wheel speed and vehicle speed [m/s]."""

    demand: FloatArray
    wheel_speed: FloatArray
    vehicle_speed: FloatArray


class TractionController(Protocol):
    """What a run needs of a controller."""

    @property
    def sample_time(self) -> float:
        """[s]."""

    def start(self, measurement: Measurement, torque: FloatArray) -> Any:
        """Memory at the start."""

    def sample(self, measurement: Measurement, memory: Any) -> tuple[FloatArray, Any]:
        """Torque and memory."""


@dataclass(frozen=True, kw_only=True)
class OpenLoop(Parameters):
    """The demand is the torque."""

    sample_time: Annotated[float, Quantity("s", above=0.0)] = 0.01
    reference: Annotated[float, Quantity("1", above=0.0)] = 0.01

    @classmethod
    def for_drivetrain(
        cls, drivetrain: object, *, speed: float, sensors: Sensors, **given: Any
    ) -> OpenLoop:
        """Nothing to design."""
        return cls(**given)

    def start(self, measurement: Measurement, torque: FloatArray) -> None:
        """No memory."""

    def sample(self, measurement: Measurement, memory: None) -> tuple[FloatArray, None]:
        """The demand."""
        return measurement.demand, None


CONTROLLERS: Mapping[str, Any] = dict.fromkeys(
    ("open_loop", "threshold", "creep_pi", "slope_seeking"), OpenLoop
)
