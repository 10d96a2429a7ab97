"""Threshold control against noise, and with a drive that gives less than is commanded."""

from __future__ import annotations

import numpy as np
import pytest
from designed import STEP, designed

import contactlib as cl
from contactlib.traction import Measurement, Sensors, ThresholdControl


def test_thresholds_are_clear_of_the_noise(locomotive: cl.Model) -> None:
    count, samples = 20, 3000
    wide = Sensors(wheel_speed_noise=0.1, vehicle_speed_noise=0.05, seed=2)
    controller = designed("threshold", locomotive, sensors=wide)
    assert isinstance(controller, ThresholdControl)
    reader = wide.reader(count, STEP)
    demand, rolling = np.full(count, 2e4), np.full(count, 1.0)
    memory, signals = None, []
    for _ in range(samples):
        measured = Measurement(demand, *reader.read(rolling, rolling, demand), demand)
        if memory is None:
            memory = controller.start(measured, demand)
        torque, memory = controller.sample(measured, memory)
        signals.append((memory.slip, memory.wheel_speed))
        assert (torque == demand).all()
    slip, wheel = np.array(signals)[1000:].transpose(1, 0, 2)
    spread = slip.std(), np.diff(wheel, axis=0).std() / STEP
    assert spread == pytest.approx(controller.noise(wide), rel=0.05)


def test_a_cut_begins_at_what_the_drive_gives(locomotive: cl.Model) -> None:
    controller = designed("threshold", locomotive, cut_fraction=0.2, cut_time=1e-4)
    demand, vehicle = np.array(2e4), np.array(10.0)
    for given in (2e4, 8e3):  # all of the demand, and a drive that is still raising its torque
        rolling = Measurement(demand, vehicle, vehicle, np.array(given))
        torque, memory = controller.sample(rolling, controller.start(rolling, 2e4))
        assert torque == demand
        for _ in range(5):
            torque, memory = controller.sample(rolling._replace(wheel_speed=vehicle + 2.0), memory)
            if torque < demand:
                break
        assert float(torque) == pytest.approx(0.2 * given)
