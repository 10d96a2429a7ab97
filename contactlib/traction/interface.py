"""Interface of sampled traction controllers, the open loop, and stacking for many wheelsets.

A stacked controller has arrays in place of fields that differ, one element for each wheelset. As
controllers are elementwise, its torques equal those of the single ones to the last bit. Derived
values are stacked too instead of being computed again.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, cached_property
from typing import Annotated, Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import POSITIVE, FloatArray, Parameters, Quantity, checked_number
from contactlib.traction.sensors import Sensors
from contactlib.vehicle.drivetrain import Drivetrain

FASTEST = 300.0  # limit of measured speeds [m/s]
STRONGEST = 1e7  # limit of the demand [N.m]


class Measurement(NamedTuple):
    """Inputs of a controller at a sample; arrays of one shape.

    Attributes
    ----------
    demand : ndarray
        The driver's demand of axle torque [N.m]; negative in braking.
    wheel_speed : ndarray
        Measured radius times angular velocity, mean of the wheels [m/s].
    vehicle_speed : ndarray
        Measured vehicle speed [m/s].
    """

    demand: FloatArray
    wheel_speed: FloatArray
    vehicle_speed: FloatArray


class TractionController(Protocol):
    """Interface of a sampled controller: measurement and memory give the torque of the next sample.

    A controller is pure: its state is in the memory. All arrays have the shape (n,) of many
    wheelsets, or (), and their elements are independent of each other.
    """

    @property
    def sample_time(self) -> float:
        """Sample time [s]."""

    def start(self, measurement: Measurement, torque: ArrayLike) -> Any:
        """Memory of a drive at a steady `torque` [N.m]."""

    def sample(self, measurement: Measurement, memory: Any) -> tuple[FloatArray, Any]:
        """Torque [N.m], of the demand's sign and at most of its size, and the new memory."""

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Design the controller for a vehicle.

        Parameters
        ----------
        drivetrain : Drivetrain
            The drivetrain, of which at most constants and linearisation are used.
        speed : float
            Speed for which the gains are designed [m/s].
        sensors : Sensors
            Sensors of the controller.
        **given
            Fields of the controller that are not designed.
        """


def plausible(measurement: Measurement) -> Measurement:
    """Limit a measurement to what is possible for a vehicle, so that arithmetic cannot overflow."""
    return Measurement(
        np.minimum(np.maximum(measurement.demand, -STRONGEST), STRONGEST),
        np.minimum(np.maximum(measurement.wheel_speed, -FASTEST), FASTEST),
        np.minimum(np.maximum(measurement.vehicle_speed, -FASTEST), FASTEST),
    )


class NoMemory(NamedTuple):
    """Empty memory."""


@dataclass(frozen=True, kw_only=True)
class OpenLoop(Parameters):
    """Sampled controller without control: the torque is the demand.

    Parameters
    ----------
    sample_time : float, optional
        Sample time [s].
    """

    sample_time: Annotated[float, Quantity("s", above=0.0)] = 0.01

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Return the controller as given; there is nothing to design."""
        checked_number("speed", speed, POSITIVE)
        return cls(**given)

    def start(self, measurement: Measurement, torque: ArrayLike) -> NoMemory:
        """Empty memory."""
        return NoMemory()

    def sample(self, measurement: Measurement, memory: NoMemory) -> tuple[FloatArray, NoMemory]:
        """The demand, and the empty memory."""
        return np.array(measurement.demand, dtype=np.float64), memory


def structure(value: Any) -> Hashable:
    """Key that is equal for values that can be stacked: everything but their numbers."""
    kind: Any = type(value)
    if kind is float or value is None:
        return (kind,)
    if isinstance(value, tuple):
        return kind, *map(structure, value)
    if is_dataclass(value):
        return kind, *map(structure, _parts(value).values())
    return value if isinstance(value, Hashable) else id(value)


def stacked(controllers: Sequence[TractionController]) -> TractionController:
    """Stack the controllers of many wheelsets into one.

    Parameters
    ----------
    controllers : sequence of TractionController
        Checked controllers of one `structure` and one sample time.
    """
    first = controllers[0]
    whole: TractionController = _stacked(controllers)
    if whole is not first:
        object.__setattr__(whole, "sample_time", first.sample_time)
    return whole


def _stacked(values: Sequence[Any]) -> Any:
    first = values[0]
    if all(value is first for value in values):
        return first
    if isinstance(first, float):
        same = all(value == first for value in values)
        return first if same else np.array(values, dtype=np.float64)
    if isinstance(first, tuple):
        return tuple(_stacked(parts) for parts in zip(*values, strict=True))
    if is_dataclass(first):
        whole: Any = object.__new__(type(first))
        parts = [_parts(value) for value in values]
        for name in parts[0]:
            # Bypass the checks, which refuse arrays: each element has been checked.
            whole.__dict__[name] = _stacked([part[name] for part in parts])
        return whole
    return first


def _parts(value: Any) -> dict[str, Any]:
    """Fields and derived values of a dataclass, by name."""
    kind: Any = type(value)
    return {name: getattr(value, name) for name in _names(kind)}


@cache
def _names(kind: Any) -> tuple[str, ...]:
    derived = {
        name
        for base in kind.__mro__
        for name, member in vars(base).items()
        if isinstance(member, cached_property)
    }
    return *(field.name for field in fields(kind)), *sorted(derived)
