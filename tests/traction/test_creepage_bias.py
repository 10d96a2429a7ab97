"""The error of the measured creepage, as a controller learns it."""

from __future__ import annotations

import numpy as np
import pytest
from designed import SENSORS, designed

import contactlib as cl
from contactlib.traction import Measurement
from contactlib.traction.creepage_bias import KNOWN


def learnt(model: cl.Model, error: float, *, speed: float, share: float) -> tuple[float, float]:
    """Estimated error and its standard deviation after 2 s at a share of the sticking torque."""
    controller = designed("creep_pi", model)
    assert isinstance(controller, cl.traction.CreepPI)
    torque = share * controller.stick_torque
    wheel = speed + abs(speed) * controller.stick_compliance * torque + error * speed
    rng, ones = np.random.default_rng(4), np.ones(50)
    memory = None
    for _ in range(400):
        shown = Measurement(
            torque * ones,
            wheel + SENSORS.wheel_speed_noise * rng.standard_normal(50),
            speed + SENSORS.vehicle_speed_noise * rng.standard_normal(50),
            torque * ones,
        )
        memory = memory or controller.start(shown, torque)
        _, memory = controller.sample(shown, memory)
    assert memory is not None
    off = memory.bias.error - error
    return float(np.sqrt(np.mean(off**2))), float(np.sqrt(memory.bias.variance).mean())


@pytest.mark.parametrize("speed", [10.0, -10.0])
@pytest.mark.parametrize("share", [0.0, 0.9, -0.9])
def test_a_sticking_wheel_shows_the_error(locomotive: cl.Model, speed: float, share: float) -> None:
    for error in (-0.02, 0.005):
        off, uncertainty = learnt(locomotive, error, speed=speed, share=share)
        assert off < KNOWN
        assert off == pytest.approx(uncertainty, rel=0.5)  # as uncertain as reported


def test_nothing_is_learnt_at_standstill_nor_from_a_wheel_that_may_slip(
    locomotive: cl.Model,
) -> None:
    for speed, share in ((0.0, 0.5), (10.0, 1.1)):
        off, uncertainty = learnt(locomotive, 0.005, speed=speed, share=share)
        assert off == pytest.approx(0.005)
        assert uncertainty == pytest.approx(0.01, rel=0.01)
