"""PI creep control: what a spinning wheel is left with."""

from __future__ import annotations

import numpy as np
import pytest

import contactlib as cl


def test_a_spinning_wheel_loses_its_torque_and_a_slow_one_does_not() -> None:
    # At five times the reference, and with no integral gain, within four recovery times.
    limiter = cl.CreepPI(
        reference=0.01,
        proportional_gain=1.0,
        integral_gain=0.0,
        recovery_time=0.2,
        creepage_error=0.0,
    )

    def left(creepage: float) -> float:
        measured = cl.Measurement(np.array(2e4), np.array(10.0 + 10.0 * creepage), np.array(10.0))
        memory = limiter.start(measured, 2e4)
        for _ in range(80):
            _, memory = limiter.sample(measured, memory)
        return float(memory.integral)

    assert left(0.05) == pytest.approx(0.0, abs=1.0)
    assert left(0.045) == pytest.approx(1e4, rel=0.01)
    assert left(0.039) == 2e4
