"""A controller and metrics as a user writes them, in a module that processes can import."""

from __future__ import annotations

import contactlib as cl
from contactlib.traction import Measurement


class SlipPI(cl.SampledController):
    """PI control of the slip speed, with a state."""

    sample_time = 0.01

    def __init__(self, slip: float = 0.3) -> None:
        self.slip, self.integral = slip, 0.0

    def reset(self, measurement: Measurement[float], torque: float) -> None:
        self.integral = abs(torque)

    def torque(self, measurement: Measurement[float]) -> float:
        demand = abs(measurement.demand)
        error = self.slip - abs(measurement.wheel_speed - measurement.vehicle_speed)
        self.integral = min(max(self.integral + 400.0 * error, 0.0), demand)
        size = min(max(self.integral + 5e3 * error, 0.0), demand)
        return size if measurement.demand >= 0.0 else -size


def largest_slip(result: cl.Result) -> float:
    """Largest slip speed."""
    return float(abs(result["slip_velocity"]).max())


largest_slip.units = "m/s"  # type: ignore[attr-defined]
