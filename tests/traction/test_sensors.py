"""Sensors: delay, noise and what they refuse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from designed import SENSORS, STEP

from contactlib.traction import SensorReader, Sensors


def test_sensors_delay_by_whole_samples_and_hold_the_first() -> None:
    reader = Sensors(delay=0.015).reader(2, STEP)
    wheel = [reader.read([k, 10.0 + k], [20.0 + k, 0.0], 0.0)[0].tolist() for k in range(6)]
    assert wheel == [[max(k - 3, 0), 10.0 + max(k - 3, 0)] for k in range(6)]
    exact = Sensors().reader(1, STEP)
    read = [exact.read([float(k)], [-float(k)], 0.0) for k in range(3)]
    assert np.array(read).tolist() == [[[k], [-k]] for k in range(3)]


def test_noise_of_a_wheelset_depends_on_no_other() -> None:
    def read(seed: int) -> np.ndarray:
        reader = replace(SENSORS, seed=seed).reader(5, STEP)
        return np.array([reader.read(np.zeros(5), np.zeros(5), 0.0) for _ in range(600)])

    together = read(1)
    assert (together != read(2))[3:].all()
    # The first is held, so what comes after is independent: 5 x 597 values.
    spread = together[3:].std(axis=(0, 2))
    assert spread == pytest.approx([0.01, 0.02], rel=4.0 / np.sqrt(2.0 * 5 * 597))
    correlation = np.corrcoef(together[3:].reshape(-1, 10).T) - np.eye(10)
    assert np.abs(correlation).max() < 4.5 / np.sqrt(597)


def test_sensors_that_are_read_together_have_one_delay() -> None:
    late = [SENSORS, replace(SENSORS, delay=0.0)]
    with pytest.raises(ValueError, match=r"delays of \[0, 3\] samples: they must be equal"):
        SensorReader(late, STEP, (0, 1))


def test_bias_diameter_and_drift_are_systematic() -> None:
    """What two sensors show differs by the errors alone, whatever their noise and delay."""
    wrong = replace(
        SENSORS, vehicle_speed_bias=-0.005, vehicle_speed_drift=0.02, wheel_diameter_error=0.01
    )
    readers = [sensors.reader(2, STEP, radius=0.5) for sensors in (SENSORS, wrong)]
    for k in range(400):
        wheel, vehicle = np.array([10.0 + k, 3.0]), np.array([9.0 + 2.0 * k, -1.0])
        right, shown = (np.array(reader.read(wheel, vehicle, 0.0)) for reader in readers)
        late = max(k - 3, 0)  # samples of SENSORS.delay
        expected = [
            0.01 * np.array([10.0 + late, 3.0]),
            -0.005 * np.array([9.0 + 2.0 * late, -1.0]) + 0.02 * STEP * late,
        ]
        np.testing.assert_allclose(shown - right, expected, rtol=0.0, atol=1e-12)


def test_an_encoder_counts_whole_pulses_and_loses_none() -> None:
    pulses, radius = np.array([80.0, 0.0, 200.0]), np.array([0.5, 0.5, 0.4])
    sensors = [Sensors(encoder_pulses=number) for number in pulses]
    reader = SensorReader(sensors, STEP, range(3), radius=radius)
    speed = 7.0 + 3.0 * np.sin(0.05 * np.arange(500)[:, None] + np.arange(3))
    speed[250:] *= -1.0  # backward, too
    shown = np.array([reader.read(row, row, 0.0)[0] for row in speed])
    pulse = 2.0 * np.pi * radius[::2] / pulses[::2]
    counts = shown[:, ::2] * STEP / pulse
    np.testing.assert_allclose(counts, counts.round(), rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(shown[:, 1], speed[:, 1])  # has no encoder
    # The way shown is never further from the true one than half a pulse.
    means = 0.5 * (speed + np.vstack([speed[:1], speed[:-1]]))
    lacking = np.cumsum(means - shown, axis=0)[:, ::2] * STEP / pulse
    assert np.abs(lacking).max() < 0.5 + 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_without_a_sensor_the_slip_shows_only_as_more_acceleration(sign: float) -> None:
    time = STEP * np.arange(400)
    rolling = 10.0 + sign * 0.2 * time
    slipping = rolling + sign * 3.0 * np.clip(time - 1.0, 0.0, 0.5)
    wheel = np.stack([rolling, slipping, slipping], axis=1)
    demand = np.full_like(wheel, sign * 1e4)
    demand[:, 2] *= -1.0
    reader = Sensors(acceleration_limit=0.5).reader(3, STEP)
    true = np.full(3, np.nan)  # never looked at
    measured = np.array([reader.read(u, true, t)[1] for u, t in zip(wheel, demand, strict=True)])
    assert (measured[:, 0] == rolling).all()  # a wheel that sticks
    late = time > 1.0
    np.testing.assert_allclose(
        measured[late, 1],
        (rolling[~late][-1] + sign * 0.5 * (time[late] - time[~late][-1])),
        rtol=1e-12,
    )
    assert (measured[:201, 1] == slipping[:201]).all()
    assert (measured[:, 2] == slipping).all()  # under the other demand that is no slip


def test_axles_share_the_estimate_of_the_wheel_that_slips_least() -> None:
    """Fastest wheel in braking, slowest in traction, each vehicle by itself."""
    rng = np.random.default_rng(2)
    wheels = 20.0 + rng.normal(0.0, 0.5, (300, 2, 3))
    demand = np.repeat([[-1e4, 0.0, -1e4], [0.0, 2e4, 2e4]], 300, axis=0).reshape(2, 300, 3)
    reader = SensorReader([Sensors(acceleration_limit=2.0)] * 6, STEP, range(6), axles=3)
    alone = Sensors(acceleration_limit=2.0).reader(2, STEP)
    for row, torque in zip(wheels, demand.swapaxes(0, 1), strict=True):
        given = reader.read(row.ravel(), 0.0 * row.ravel(), torque.ravel())
        least = np.array([row[0].max(), row[1].min()])
        expected = alone.read(least, 0.0 * least, np.array([-1.0, 1.0]))[1]
        assert (given[0] == row.ravel()).all()
        assert (given[1] == np.repeat(expected, 3)).all()


def test_a_free_axle_keeps_the_estimate_right() -> None:
    wheel, demand = np.array([30.0, 5.0, 5.0, 5.0]), np.array([0.0, -1e4, -1e4, -1e4])
    reader = SensorReader([Sensors(acceleration_limit=1.0)] * 4, STEP, range(4), axles=4)
    for speed in 30.0 - 0.5 * STEP * np.arange(500):
        wheel[0] = speed
        assert (reader.read(wheel, wheel, demand)[1] == speed).all()


def test_axles_are_let_free_in_turn_while_all_slip() -> None:
    """From the last one on, each for the trial time, until one wheel shows the speed again."""
    sensors = Sensors(acceleration_limit=1.0, trial_time=10 * STEP)
    reader = SensorReader([sensors] * 8, STEP, range(8), axles=4)
    demand, sliding = np.full(8, -1e4), np.full(8, 1.0)
    start = np.full(8, 30.0)
    sliding[4:] = 30.0  # the other vehicle's wheels stick
    reader.read(start, start, demand)
    free = []
    for _ in range(60):
        reader.read(sliding, start, demand)
        free.append(reader.free.copy())
    tried = np.array(free)
    assert not tried[:, 4:].any()
    assert [np.flatnonzero(row[:4]).tolist() for row in tried[::10]] == [
        [],
        [3],
        [2],
        [1],
        [0],
        [3],
    ]
    assert (tried.sum(axis=1)[10:] == 1).all()
    sliding[3] = 29.9  # the free wheel has returned
    estimate = reader.read(sliding, start, demand)[1]
    assert (estimate[:4] == 29.9).all()


@pytest.mark.parametrize(
    ("given_values", "message"),
    [
        ({"delay": 0.012}, "not a whole number of samples"),
        ({"encoder_pulses": 100.0}, "radius is missing"),
        ({"trial_time": 1.0}, "trial_time = 1.0 needs acceleration_limit"),
        ({"trial_time": 1.0, "acceleration_limit": 1.0}, "trial_time is for a vehicle of several"),
        *(
            ({name: 0.01, "acceleration_limit": 0.5}, f"{name} = 0.01 must be 0 with acceleration")
            for name in ("vehicle_speed_bias", "vehicle_speed_drift", "vehicle_speed_noise")
        ),
    ],
)
def test_sensors_report_what_is_wrong(given_values: Mapping[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Sensors(**given_values).reader(1, STEP)
