"""PI creep control: what a spinning wheel is left with."""

from __future__ import annotations

import numpy as np
import pytest

import contactlib as cl
from contactlib.traction import Measurement


def test_a_limiter_does_not_wind_up_against_its_drive() -> None:
    limiter = cl.traction.CreepPI(
        reference=0.01, proportional_gain=1e3, integral_gain=1e5, creepage_error=0.0
    )
    demand, vehicle = np.array(2e4), np.array(10.0)

    def integral(creepage: float, given: float) -> float:
        """I after a second in which the drive gives a torque that nobody commands."""
        wheel = 10.0 + 10.0 * np.array(creepage)
        memory = limiter.start(Measurement(demand, wheel, vehicle, np.array(1e4)), 1e4)
        for _ in range(100):
            seen = Measurement(demand, wheel, vehicle, np.array(given))
            _, memory = limiter.sample(seen, memory)
        return float(memory.integral)

    assert integral(0.0, 0.0) == 1e4  # a drive that has tripped
    assert integral(0.02, 2e4) == 1e4  # one that is slow to cut
    assert integral(0.02, 0.0) < 1e4 < integral(0.0, 2e4)  # what it gives is not the limit


def test_a_spinning_wheel_loses_its_torque_and_a_slow_one_does_not() -> None:
    # At five times the reference, and with no integral gain, within four recovery times.
    limiter = cl.traction.CreepPI(
        reference=0.01,
        proportional_gain=1.0,
        integral_gain=0.0,
        recovery_time=0.2,
        creepage_error=0.0,
    )

    def left(creepage: float) -> float:
        torque, seen = np.array(2e4), (np.array(10.0 + 10.0 * creepage), np.array(10.0))
        memory = limiter.start(Measurement(torque, *seen, torque), torque)
        for _ in range(80):
            torque, memory = limiter.sample(Measurement(np.array(2e4), *seen, torque), memory)
        return float(memory.integral)

    assert left(0.05) == pytest.approx(0.0, abs=1.0)
    assert left(0.045) == pytest.approx(1e4, rel=0.01)
    assert left(0.039) == 2e4
