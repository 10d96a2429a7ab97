"""Interfaces of sampled traction controllers, of one wheelset and of many, and the open loop."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Generic, NamedTuple, Protocol, Self, TypeVar

from contactlib.base.elementwise import maximum, minimum
from contactlib.base.quantities import (
    POSITIVE,
    FloatArray,
    Parameters,
    Quantity,
    checked_number,
    shown,
)
from contactlib.traction.sensors import Sensors
from contactlib.vehicle.drivetrain import Drivetrain

SAMPLE_TIME = Quantity("s", above=0.0, usual=(1e-5, 1.0))
FILTER_TIME = Quantity("s", at_least=0.0, usual=(0.0, 5.0))
LOW_SPEED = Quantity("m/s", above=0.0, usual=(0.01, 20.0))
FASTEST = 300.0  # limit of measured speeds [m/s]
STRONGEST = 1e7  # limit of demand and torque [N.m]


Number = TypeVar("Number")


class Measurement(NamedTuple, Generic[Number]):
    """Inputs of a controller at a sample.

    Attributes
    ----------
    demand : float or ndarray
        The driver's demand of axle torque, at most what the drive's power allows at the vehicle's
        speed [N.m]. It is that of the torque on the axle: forward if positive, so a demand against
        the motion brakes.
    wheel_speed : float or ndarray
        Measured radius times angular velocity, mean of the wheels [m/s].
    vehicle_speed : float or ndarray
        Measured or estimated vehicle speed [m/s].
    torque : float or ndarray
        Torque that the drive has been commanded since the last sample [N.m]: the controller's last
        output, within the limits of the drive.
    wheel_speeds : tuple of float or of ndarray
        Measured wheel speeds of all axles of the vehicle, the first axle first [m/s]; a wheelset
        without a vehicle has its own alone. Default: empty, for measurements that you make.
    axle : int or ndarray
        Number of the controller's axle in the vehicle, from 1.

    Examples
    --------
    A controller that vents the brake of an axle that is slower than the fastest one:

    >>> import contactlib as cl
    >>> class Comparing(cl.SampledController):
    ...     sample_time = 0.01
    ...
    ...     def torque(self, measurement):
    ...         fastest = max(measurement.wheel_speeds, key=abs)
    ...         lags = abs(measurement.wheel_speed) < 0.9 * abs(fastest)
    ...         return 0.0 if lags and measurement.demand < 0.0 else measurement.demand
    >>> seen = cl.traction.Measurement(-1e4, 8.0, 10.0, -1e4, (9.9, 8.0, 9.8, 9.9), 2)
    >>> Comparing().torque(seen), Comparing().torque(seen._replace(wheel_speed=9.8))
    (0.0, -10000.0)
    """

    demand: Number
    wheel_speed: Number
    vehicle_speed: Number
    torque: Number
    wheel_speeds: tuple[Number, ...] = ()
    axle: Any = 1

    def each(self, function: Callable[[Number], Any]) -> Measurement[Any]:
        """Measurement with a function applied to each of its numbers or arrays."""
        speeds = tuple(map(function, self.wheel_speeds))
        demand, wheel, vehicle, torque = map(function, self[:4])
        return Measurement(demand, wheel, vehicle, torque, speeds, function(self.axle))


class Command(NamedTuple, Generic[Number]):
    """What a controller may return in place of its torque, where the scenario has sanders.

    Attributes
    ----------
    torque : float or ndarray
        Torque until the next sample [N.m].
    sand : float or ndarray
        Part of all sand that the axle lays until then, from 0 to 1, or a bool.
    """

    torque: Number
    sand: Any = 0.0


class SampledController(ABC):
    """Base class of your own traction controller: numbers in, a number out, state in `self`.

    Every run uses a deep copy of the object, made when the run begins, with copies of its mutable
    class attributes: a run changes neither the object itself nor the state of other runs.

    Attributes
    ----------
    sample_time : float
        Time from one call of `torque` to the next [s]; of the class or of the object.
    search_ranges : mapping, optional
        The settings that `tune` searches: by name the minimum and the maximum value. A setting is
        an argument of `__init__`, which stores it under its name.

    Examples
    --------
    >>> import contactlib as cl
    >>> class Cautious(cl.SampledController):
    ...     sample_time = 0.01
    ...
    ...     def torque(self, measurement):
    ...         slip = measurement.wheel_speed - measurement.vehicle_speed
    ...         return measurement.demand if abs(slip) < 0.2 else 0.1 * measurement.demand
    >>> run = cl.run_scenario(cl.load_scenario("dry_wet_dry.toml"), Cautious())
    >>> f"{run['creepage'].max():.2f}"
    '0.09'
    """

    sample_time: float
    search_ranges: ClassVar[Mapping[str, tuple[float, float]]]

    def reset(self, measurement: Measurement[float], torque: float) -> None:  # noqa: B027
        """Begin a run; the default keeps the state that `__init__` has set.

        Parameters
        ----------
        measurement : Measurement
            The first measurement, which `torque` then gets again.
        torque : float
            Torque that the drive has been giving [N.m].
        """

    @abstractmethod
    def torque(self, measurement: Measurement[float]) -> float | Command[float]:
        """Torque until the next sample [N.m], from zero to the demand; or a `Command`."""

    def __repr__(self) -> str:
        given = ", ".join(f"{name}={value!r}" for name, value in vars(self).items())
        return f"{type(self).__name__}({given})"


class TractionController(Protocol):
    """Interface of a controller of many wheelsets: a function of measurement and memory.

    A controller is pure: its state is in the memory. All arrays have the shape (n,) of many
    wheelsets, or (), and their elements are independent of each other; what axles of a vehicle
    have to know of each other is in `Measurement.wheel_speeds`. Many runs are several times
    as fast as under a `SampledController`, which Python calls for each wheelset. It may declare
    `search_ranges` as that does.
    """

    @property
    def sample_time(self) -> float:
        """Sample time [s]."""

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> Any:
        """Memory of a drive at a steady `torque` [N.m]."""

    def sample(self, measurement: Measurement[FloatArray], memory: Any) -> tuple[Any, Any]:
        """Torque [N.m], of the demand's sign and at most its size, or a `Command`; new memory."""

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Design the controller for a vehicle.

        Parameters
        ----------
        drivetrain : Drivetrain
            The drivetrain; a design uses at most its constants and linearisation.
        speed : float
            Speed for which the gains are designed [m/s].
        sensors : Sensors
            Sensors of the controller.
        **given
            Fields of the controller that are not designed.
        """


def is_backward(demand: Any, speed: Any) -> Any:
    """Whether a demand [N.m] is backward; one of zero has the direction of the motion [m/s]."""
    return (demand < 0.0) | ((demand == 0.0) & (speed < 0.0))


def plausible(measurement: Measurement[FloatArray]) -> Measurement[FloatArray]:
    """Limit a measurement to what is possible for a vehicle, so that arithmetic cannot overflow."""
    wheel = minimum(maximum(measurement.wheel_speed, -FASTEST), FASTEST)
    speeds = measurement.wheel_speeds
    return Measurement(
        minimum(maximum(measurement.demand, -STRONGEST), STRONGEST),
        wheel,
        minimum(maximum(measurement.vehicle_speed, -FASTEST), FASTEST),
        minimum(maximum(measurement.torque, -STRONGEST), STRONGEST),
        tuple(minimum(maximum(speed, -FASTEST), FASTEST) for speed in speeds)
        if len(speeds) > 1
        else (wheel,),
        measurement.axle,
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

    sample_time: Annotated[float, SAMPLE_TIME] = 0.01

    @classmethod
    def for_drivetrain(
        cls, drivetrain: Drivetrain, *, speed: float, sensors: Sensors, **given: Any
    ) -> Self:
        """Return the controller as given; there is nothing to design."""
        checked_number("speed", speed, POSITIVE)
        return cls(**given)

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> NoMemory:
        """Empty memory."""
        return NoMemory()

    def sample(
        self, measurement: Measurement[FloatArray], memory: NoMemory
    ) -> tuple[FloatArray, NoMemory]:
        """The demand, and the empty memory."""
        return 1.0 * measurement.demand, memory


Controller = SampledController | TractionController


def checked_controller(name: str, candidate: object) -> Controller:
    """Return a sampled controller, or raise a ValueError that names its missing members."""
    kind = candidate.__name__ if isinstance(candidate, type) else type(candidate).__name__
    sampled = isinstance(candidate, SampledController)
    if isinstance(candidate, type):
        raise ValueError(f"{name} is the class {kind}: give an object of it, such as {kind}()")
    if hasattr(candidate, "prescribes"):
        raise ValueError(
            f"{name} is a {kind}, a continuous controller, which run_scenario and simulate run; "
            "expected a sampled one"
        )
    lacking = [key for key in ("start", "sample") if not callable(getattr(candidate, key, None))]
    if lacking and not sampled:
        plain = type(candidate).__repr__ is object.__repr__
        what = getattr(candidate, "__name__", f"object of {kind}" if plain else shown(candidate))
        raise ValueError(
            f"{name} = {what} is not a controller: expected an object of a class derived from "
            "contactlib.SampledController, which has the method torque(self, measurement)"
        )
    if not hasattr(candidate, "sample_time"):
        raise ValueError(
            f"{name}: {kind}.sample_time is missing: it must be a time in seconds, as in "
            "sample_time = 0.01"
        )
    checked_number(f"{kind}.sample_time", candidate.sample_time, POSITIVE)
    for key, given in (("reset", "measurement, torque"), ("torque", "measurement")):
        if not sampled:
            break
        if not callable(getattr(candidate, key)):
            raise ValueError(
                f"{name}: {kind}.{key} must be a method, but self.{key} = "
                f"{shown(getattr(candidate, key))} hides it: rename that attribute"
            )
        try:
            inspect.signature(getattr(candidate, key)).bind(*given.split())
        except TypeError:
            form = f"{key}(self, {given})"
            raise ValueError(f"{name}: {kind}.{key} must be of the form {form}") from None
        except ValueError:  # of a function in C, whose arguments are not available
            continue
    control: Controller = candidate  # type: ignore[assignment]
    return control
