"""The dynamic wheel load: its history, and the statistics of a random one."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.signal import welch

from contactlib.vehicle import DynamicLoad

FREQUENCY = (0.5, 1.0, 1.0, 3.0, 3.2, 8.0)  # a jump at 1 Hz, a steep fall from 3 Hz on
DENSITY = (0.0, 0.02, 0.005, 0.005, 0.0005, 0.0)
VARIANCE = np.trapezoid(DENSITY, FREQUENCY)


def test_a_history_is_its_profile() -> None:
    load = DynamicLoad(time=(0.0, 1.0, 1.0), factor=(1.0, 1.5, 0.5))
    assert load([-1.0, 0.5, 1.0, 2.0]).tolist() == [1.0, 1.25, 0.5, 0.5]


@pytest.mark.slow
def test_the_power_lies_where_the_density_does() -> None:
    time = np.arange(0.0, 400.0, 0.02)
    power = np.zeros(513)
    for seed in range(30):
        load = DynamicLoad(frequency=FREQUENCY, density=DENSITY, seed=seed)
        frequency, density = welch(load(time) - 1.0, 50.0, nperseg=1024)
        power += density / 30.0
    edges = [0.3, 0.9, 1.1, 2.0, 3.0, 3.4, 5.0, 10.0]
    for low, high in pairwise(edges):
        fine = np.linspace(low, high, 20001)
        expected = np.trapezoid(np.interp(fine, FREQUENCY, DENSITY, 0.0, 0.0), fine)
        inside = (frequency >= low) & (frequency < high)
        part = power[inside].sum() * frequency[1]
        assert part == pytest.approx(expected, rel=0.1, abs=0.01 * VARIANCE)


def test_a_load_depends_on_seed_and_time_alone() -> None:
    load = DynamicLoad(frequency=FREQUENCY, density=DENSITY, seed=2)
    times = np.linspace(0.0, 700.0, 300)
    for size in (1, 2, 7, 300):  # a time alone has the bits that it has among many
        parts = [load(times[i : i + size]) for i in range(0, 300, size)]
        np.testing.assert_array_equal(np.concatenate(parts), load(times))
    assert [float(load(t)) for t in times] == load(times).tolist()
    again = DynamicLoad(frequency=FREQUENCY, density=DENSITY, seed=2)
    other = DynamicLoad(frequency=FREQUENCY, density=DENSITY, seed=3)
    time = np.linspace(0.0, 9.0, 50)
    np.testing.assert_array_equal(load(time), again(time))
    np.testing.assert_allclose(load(time), [float(load(t)) for t in time], rtol=1e-14)
    assert np.abs(load(time) - other(time)).max() > 0.1
    assert load(time.reshape(5, 10)).shape == (5, 10)


def test_a_load_is_never_negative() -> None:
    factor = DynamicLoad(frequency=(1.0, 2.0), density=(1.0, 1.0))(np.linspace(0.0, 99.0, 9999))
    assert factor.min() == 0.0
    assert factor.max() > 2.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, r"give exactly one of these pairs, not nothing"),
        ({"time": (0.0,)}, r"not time$"),
        (
            {"time": (0.0,), "factor": (1.0,), "frequency": (1.0,), "density": (1.0,)},
            r"not time and factor and frequency and density",
        ),
        ({"time": (0.0, 1.0), "factor": (1.0,)}, r"time has 2 and factor 1 entries"),
        ({"time": (1.0, 0.0), "factor": (1.0, 1.0)}, r"time = .* must be increasing"),
        ({"frequency": (1.0, 0.5), "density": (1.0, 1.0)}, r"frequency = .* must be increasing"),
        ({"frequency": (1.0,), "density": (1.0,)}, r"density = .* must have a part above zero"),
        ({"frequency": (1.0, 2.0), "density": (0.0, 0.0)}, r"density = .* a part above zero"),
        ({"time": [[0.0]], "factor": (1.0,)}, r"DynamicLoad\.time = .* one row of numbers"),
    ],
)
def test_a_load_that_is_none_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        DynamicLoad(**given)
