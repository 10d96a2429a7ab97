"""Observer of the load torque."""

from __future__ import annotations

import numpy as np
import pytest

from contactlib.traction.filters import LoadObserver

STEP, RADIUS, INERTIA = 0.01, 0.5, 250.0


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_load_is_what_does_not_accelerate_whatever_the_drive_gives(delay: int) -> None:
    """A torque that is held from sample to sample, a steady load, and speeds that come late."""
    rng, load = np.random.default_rng(2), 7e3
    torque = np.concatenate([np.full(5, 1e4), rng.uniform(-2e4, 2e4, 200)])
    omega = 20.0 + np.concatenate([[0.0], np.cumsum(torque - load)]) * STEP / INERTIA
    observer = LoadObserver(
        sample_time=STEP,
        radius=RADIUS,
        inertia=INERTIA,
        delay=delay * STEP,
        motor_lag=0.0,
        brake_lag=0.0,
        filter_time=0.04,
    )
    speed = RADIUS * np.concatenate([np.full(delay, omega[0]), omega])
    state, loads = observer.start(torque[0], speed[0], np.zeros(())), []
    for given, seen in zip(torque, speed[1:], strict=False):
        state, observed, _ = observer.observe(state, given, seen, np.zeros(()))
        loads.append(float(observed))
    np.testing.assert_allclose(loads[120:], load, rtol=1e-6)
