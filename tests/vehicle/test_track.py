"""The track: friction by place, side and time."""

from __future__ import annotations

import numpy as np
import pytest

import contactlib as cl

PATCH = cl.Profile((50.0, 50.0, 150.0, 150.0), (1.0, 0.5, 0.5, 1.0))


def test_each_side_has_its_own_and_time_multiplies() -> None:
    rain = cl.Profile((10.0, 20.0), (1.0, 0.8))
    track = cl.Track(
        friction_left=PATCH, friction_right=cl.Profile((0.0,), (0.9,)), friction_over_time=rain
    )
    distance = np.array([0.0, 50.0, 149.9, 150.0])
    expected = np.array([[1.0, 0.9], [0.5, 0.9], [0.5, 0.9], [1.0, 0.9]])
    np.testing.assert_allclose(track.friction_scale(distance, 0.0), expected, rtol=1e-15)
    np.testing.assert_allclose(track.friction_scale(distance, 15.0), 0.9 * expected, rtol=1e-15)
    assert track.friction_scale(60.0, 30.0).tolist() == pytest.approx([0.4, 0.72])


def test_the_right_rail_is_as_the_left_one_by_default() -> None:
    scale = cl.Track(friction_left=PATCH).friction_scale(np.linspace(0.0, 200.0, 9), 1.0)
    assert scale.shape == (9, 2)
    np.testing.assert_array_equal(scale[:, 0], scale[:, 1])
    np.testing.assert_array_equal(cl.Track().friction_scale([3.0, 4.0], 5.0), np.ones((2, 2)))


def test_extremes_are_of_any_wheel_and_time() -> None:
    track = cl.Track(
        friction_left=PATCH,
        friction_right=cl.Profile.of(1.2),
        friction_over_time=cl.Profile((0.0, 1.0), (1.0, 0.8)),
        slope=cl.Profile((50.0, 60.0), (1.5, 0.3)),
    )
    assert track.lowest == (0.4, 0.3)
    assert track.highest == (1.2, 1.5)
    assert cl.Track().lowest == cl.Track().highest == (1.0, 1.0)
