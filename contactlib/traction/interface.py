"""What a vehicle's computer measures, and what every sampled controller answers."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import FloatArray
from contactlib.traction.sensors import Sensors

FASTEST = 300.0  # a measured speed beyond it is taken for this much [m/s]
STRONGEST = 1e7  # likewise a demand [N.m]


class Measurement(NamedTuple):
    """What is known at a sample; arrays of one shape.

    Attributes
    ----------
    demand : ndarray
        Torque at the axle that the driver asks for [N.m]; negative in braking.
    wheel_speed : ndarray
        Radius times angular velocity, mean of the wheels, as measured [m/s].
    vehicle_speed : ndarray
        As measured [m/s].
    """

    demand: FloatArray
    wheel_speed: FloatArray
    vehicle_speed: FloatArray


class TractionController(Protocol):
    """A rule from measurement and memory to the torque of the next sample time.

    It is pure: all that changes is in the memory. Arrays have the shape (n,) of many wheelsets
    throughout, or (), and no element of them depends on another.
    """

    @property
    def sample_time(self) -> float:
        """[s]."""

    def start(self, measurement: Measurement, torque: ArrayLike) -> Any:
        """Memory of a drive that has been giving `torque` [N.m]."""

    def sample(self, measurement: Measurement, memory: Any) -> tuple[FloatArray, Any]:
        """Torque to give [N.m], of the demand's sign and no more than it, and the new memory."""

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """The controller as its designer would set it for a vehicle.

        Parameters
        ----------
        drivetrain : Drivetrain
            What is driven; its constants and its linearisation are used, if at all.
        speed : float
            Speed that the gains are designed at [m/s].
        sensors : Sensors
            What the controller will see through.
        **given
            Fields of the controller that are not to be worked out.
        """


def plausible(measurement: Measurement) -> Measurement:
    """The measurement, held within what a vehicle can do: arithmetic with it cannot overflow."""
    return Measurement(
        np.minimum(np.maximum(measurement.demand, -STRONGEST), STRONGEST),
        np.minimum(np.maximum(measurement.wheel_speed, -FASTEST), FASTEST),
        np.minimum(np.maximum(measurement.vehicle_speed, -FASTEST), FASTEST),
    )
