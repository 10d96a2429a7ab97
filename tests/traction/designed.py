"""Controllers designed for the locomotive."""

from __future__ import annotations

from typing import Any

import contactlib as cl
from contactlib.traction import TractionController

SENSORS = cl.Sensors(wheel_speed_noise=0.01, vehicle_speed_noise=0.02, delay=0.015, seed=1)
STEP = 0.005
LIMITED = tuple(name for name in cl.CONTROLLERS if name != "open_loop")


def designed(
    name: str, model: cl.Model, speed: float = 10.0, sensors: cl.Sensors = SENSORS, **given: Any
) -> TractionController:
    drivetrain = cl.Drivetrain(model.wheelset)
    values = {"sample_time": STEP, **given}
    return cl.CONTROLLERS[name].for_drivetrain(drivetrain, speed=speed, sensors=sensors, **values)
