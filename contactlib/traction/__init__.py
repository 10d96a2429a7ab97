"""What a vehicle's computer does: speed sensors and sampled traction controllers.

The controllers see a driver's demand, a measured wheel speed and a measured vehicle speed, and
never the friction, the load or the true creepage. They are pure functions of arrays: many
wheelsets run side by side.
"""

from collections.abc import Mapping
from types import MappingProxyType

from contactlib.traction.creep_pi import CreepPI
from contactlib.traction.design import total_delay
from contactlib.traction.interface import Measurement, TractionController
from contactlib.traction.open_loop import OpenLoop
from contactlib.traction.sensors import SensorReader, Sensors
from contactlib.traction.slope_seeking import SlopeSeeking
from contactlib.traction.stacking import stacked, structure
from contactlib.traction.threshold import ThresholdControl

CONTROLLERS: Mapping[str, type[TractionController]] = MappingProxyType(
    {
        "open_loop": OpenLoop,
        "threshold": ThresholdControl,
        "creep_pi": CreepPI,
        "slope_seeking": SlopeSeeking,
    }
)

__all__ = [
    "CONTROLLERS",
    "CreepPI",
    "Measurement",
    "OpenLoop",
    "SensorReader",
    "Sensors",
    "SlopeSeeking",
    "ThresholdControl",
    "TractionController",
    "stacked",
    "structure",
    "total_delay",
]
