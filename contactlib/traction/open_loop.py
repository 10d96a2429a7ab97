"""No control: the driver's demand is the torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import POSITIVE, FloatArray, Parameters, Quantity, checked_number
from contactlib.traction.interface import Measurement
from contactlib.traction.sensors import Sensors


class NoMemory(NamedTuple):
    """Nothing to remember."""


@dataclass(frozen=True, kw_only=True)
class OpenLoop(Parameters):
    """Torque as demanded.

    Parameters
    ----------
    sample_time : float, optional
        [s].
    """

    sample_time: Annotated[float, Quantity("s", above=0.0)] = 0.01

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """As given: there is nothing to work out."""
        checked_number("speed", speed, POSITIVE)
        return cls(**given)

    def start(self, measurement: Measurement, torque: ArrayLike) -> NoMemory:
        """No memory."""
        return NoMemory()

    def sample(self, measurement: Measurement, memory: NoMemory) -> tuple[FloatArray, NoMemory]:
        """The demand."""
        return np.array(measurement.demand, dtype=np.float64), memory
