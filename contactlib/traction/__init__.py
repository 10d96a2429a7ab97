"""Speed sensors and sampled traction controllers, as in a vehicle's computer.

Traction controllers run in scenarios (`run_scenario`, `run_many`). Their inputs are the driver's
demand, a measured wheel speed, a measured or estimated vehicle speed and the last commanded torque,
but not the friction, the load or the true creepage. The shipped ones are pure functions of arrays,
so that many wheelsets run at once; for your own controller, derive a class from
`SampledController`, which is easier. The continuous controllers for `simulate`, which use the true
creepage, are in `vehicle.continuous_control`.
"""

from collections.abc import Mapping
from types import MappingProxyType

from contactlib.traction.batching import stacked, structure
from contactlib.traction.creep_pi import CreepPI, SlipLimiter
from contactlib.traction.design import total_delay
from contactlib.traction.interface import (
    Command,
    Measurement,
    OpenLoop,
    SampledController,
    TractionController,
)
from contactlib.traction.sensors import SensorReader, Sensors
from contactlib.traction.slope_seeking import SlopeSeeking
from contactlib.traction.threshold import ThresholdControl
from contactlib.traction.wsp import WheelSlideProtection

CONTROLLERS: Mapping[str, type[TractionController]] = MappingProxyType(
    {
        "open_loop": OpenLoop,
        "threshold": ThresholdControl,
        "creep_pi": CreepPI,
        "slope_seeking": SlopeSeeking,
        "wsp": WheelSlideProtection,
    }
)

__all__ = [
    "CONTROLLERS",
    "Command",
    "CreepPI",
    "Measurement",
    "OpenLoop",
    "SampledController",
    "SensorReader",
    "Sensors",
    "SlipLimiter",
    "SlopeSeeking",
    "ThresholdControl",
    "TractionController",
    "WheelSlideProtection",
    "stacked",
    "structure",
    "total_delay",
]
