"""Threshold control against noise."""

from __future__ import annotations

import numpy as np
import pytest
from designed import STEP, designed

import contactlib as cl


def test_thresholds_are_clear_of_the_noise(locomotive: cl.Model) -> None:
    count, samples = 20, 3000
    wide = cl.Sensors(wheel_speed_noise=0.1, vehicle_speed_noise=0.05, seed=2)
    controller = designed("threshold", locomotive, sensors=wide)
    assert isinstance(controller, cl.ThresholdControl)
    reader = wide.reader(count, STEP)
    demand, rolling = np.full(count, 2e4), np.full(count, 1.0)
    memory, found = None, []
    for _ in range(samples):
        measured = cl.Measurement(demand, *reader.read(rolling, rolling, demand))
        if memory is None:
            memory = controller.start(measured, demand)
        torque, memory = controller.sample(measured, memory)
        found.append((memory.slip, memory.wheel_speed))
        assert (torque == demand).all()
    slip, wheel = np.array(found)[1000:].transpose(1, 0, 2)
    spread = slip.std(), np.diff(wheel, axis=0).std() / STEP
    assert spread == pytest.approx(controller.noise(wide), rel=0.05)
