"""Sensors: delay, noise and what they refuse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from designed import SENSORS, STEP

import contactlib as cl


def test_sensors_delay_by_whole_samples_and_hold_the_first() -> None:
    reader = cl.Sensors(delay=0.015).reader(2, STEP)
    wheel = [reader.read([k, 10.0 + k], [20.0 + k, 0.0])[0].tolist() for k in range(6)]
    assert wheel == [[max(k - 3, 0), 10.0 + max(k - 3, 0)] for k in range(6)]
    exact = cl.Sensors().reader(1, STEP)
    read = [exact.read([float(k)], [-float(k)]) for k in range(3)]
    assert np.array(read).tolist() == [[[k], [-k]] for k in range(3)]


def test_noise_of_a_wheelset_knows_no_other() -> None:
    def read(count: int, first: int = 0, seed: int = 1) -> np.ndarray:
        reader = replace(SENSORS, seed=seed).reader(count, STEP, first=first)
        return np.array([reader.read(np.zeros(count), np.zeros(count)) for _ in range(600)])

    together = read(5)
    assert all((together[:, :, [i]] == read(1, first=i)).all() for i in range(5))
    assert (together != read(5, seed=2))[3:].all()
    # The first is held, so what comes after is independent: 5 x 597 values.
    spread = together[3:].std(axis=(0, 2))
    assert spread == pytest.approx([0.01, 0.02], rel=4.0 / np.sqrt(2.0 * 5 * 597))
    correlation = np.corrcoef(together[3:].reshape(-1, 10).T) - np.eye(10)
    assert np.abs(correlation).max() < 4.5 / np.sqrt(597)


def test_sensors_that_differ_are_read_together() -> None:
    seeds, scales, index = (1, 1, 7, 2), (0.01, 0.0, 0.03, 0.02), (4, 5, 4, 0)
    sensors = [
        replace(SENSORS, seed=float(seed), wheel_speed_noise=scale)
        for seed, scale in zip(seeds, scales, strict=True)
    ]
    still = np.zeros(4)
    reader = cl.traction.SensorReader(sensors, STEP, index)
    together = np.array([reader.read(still, still) for _ in range(300)])
    for i, (one, place) in enumerate(zip(sensors, index, strict=True)):
        alone = one.reader(1, STEP, first=place)
        expected = [alone.read(np.zeros(1), np.zeros(1)) for _ in range(300)]
        np.testing.assert_array_equal(together[:, :, [i]], expected)
    late = [SENSORS, replace(SENSORS, delay=0.0)]
    with pytest.raises(ValueError, match=r"delays of \[0, 3\] samples: they must be equal"):
        cl.traction.SensorReader(late, STEP, (0, 1))


@pytest.mark.parametrize(
    ("given_values", "message"),
    [
        ({"delay": 0.012}, "not a whole number of samples"),
        ({"seed": 0.5}, "must be a whole number"),
        ({"wheel_speed_noise": -1.0}, "out of range"),
    ],
)
def test_sensors_say_what_is_wrong(given_values: Mapping[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cl.Sensors(**given_values).reader(1, STEP)
