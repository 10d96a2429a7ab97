"""Controllers designed for the locomotive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import contactlib as cl
from contactlib.traction import Measurement, Sensors, TractionController
from contactlib.vehicle import Drivetrain

SENSORS = Sensors(wheel_speed_noise=0.01, vehicle_speed_noise=0.02, delay=0.015, seed=1)
STEP = 0.005
LIMITED = tuple(name for name in cl.CONTROLLERS if name not in ("open_loop", "wsp"))  # driving


def designed(
    name: str,
    model: cl.Model,
    speed: float = 10.0,
    sensors: Sensors = SENSORS,
    **given: Any,
) -> TractionController:
    drivetrain = Drivetrain(model.wheelset)
    values = {"sample_time": STEP, **given}
    return cl.CONTROLLERS[name].for_drivetrain(drivetrain, speed=speed, sensors=sensors, **values)


def answers(controller: TractionController, seen: Sequence[Measurement[Any]]) -> np.ndarray:
    """Torques of a controller that is shown these measurements, a row for each."""
    memory, torques = controller.start(seen[0], seen[0].demand), []
    for measurement in seen:
        torque, memory = controller.sample(measurement, memory)
        torques.append(torque)
    return np.array(torques)
