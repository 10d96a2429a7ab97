"""The elliptic Carter-Griffith law against adaptive quadrature of the line contact's."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from contactlib import CarterGriffith

K_HATS = [0.0, 1e-6, 1e-3, 0.03, 0.3, 1.0, 2.0]


def test_values_at_k_hat_0_3() -> None:
    law = CarterGriffith(k_hat=0.3, contact="elliptic")
    expected = [0.6279806187, 0.9979130894, 1.0135093774, 1.0002692898]
    np.testing.assert_allclose(law.traction_ratio([0.3, 0.6, 2.0, 5.0]), expected, atol=1e-10)
    assert law.peak.normalized_creepage == pytest.approx(1.0079, abs=5e-5)
    assert law.peak.traction_ratio == pytest.approx(1.15162, abs=5e-6)


@pytest.mark.parametrize("k_hat", K_HATS)
def test_initial_slope_is_that_of_linear_strip_theory(k_hat: float) -> None:
    law = CarterGriffith(k_hat=k_hat, contact="elliptic")
    assert law.slope(0.0) == pytest.approx(0.75 * np.pi, rel=1e-15)
    assert law.traction_ratio(1e-13) / 1e-13 == pytest.approx(0.75 * np.pi, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("k_hat", [1e-3, 0.03, 0.3, 2.0])
@pytest.mark.parametrize("x", [0.05, 0.5, 0.97, 1.0, 1.2, 4.0])
def test_sum_of_strips(k_hat: float, x: float) -> None:
    # Eqs. (23) and (24) strip by strip: here the root is sought, in the law the width is.
    def strip(angle: float, slope: bool) -> float:
        w = np.cos(angle)
        line = CarterGriffith.__new__(CarterGriffith)  # strips at the rim exceed k_hat = 2
        object.__setattr__(line, "k_hat", k_hat / w)
        object.__setattr__(line, "contact", "line")
        if slope:
            return float(w**2 * line.slope(x / w))
        return float(w**3 * line.traction_ratio(x / w))

    law = CarterGriffith(k_hat=k_hat, contact="elliptic")
    layer = np.arccos(min(x, 1.0))
    ends = sorted({0.0, max(layer - 0.1, 0.0), layer, min(layer + 0.1, 1.55), np.pi / 2})
    for slope, value in ((False, law.traction_ratio(x)), (True, law.slope(x))):
        total = sum(
            quad(strip, a, b, args=(slope,), epsabs=2e-12, epsrel=1e-12, limit=400)[0]
            for a, b in pairwise(ends)
        )
        assert 1.5 * total == pytest.approx(float(value), abs=2e-11)


@pytest.mark.parametrize("k_hat", K_HATS[1:])
def test_slope_is_the_derivative(k_hat: float) -> None:
    law = CarterGriffith(k_hat=k_hat, contact="elliptic")
    x, h = np.random.default_rng(3).uniform(0.05, 4.0, 200), 1e-5
    x = x[np.abs(x - 1.0) > 0.05]  # where the third derivative grows with 1/k_hat
    q = [law.traction_ratio(x + i * h) for i in (-2, -1, 1, 2)]
    five_point = (q[0] - 8.0 * q[1] + 8.0 * q[2] - q[3]) / (12.0 * h)
    np.testing.assert_allclose(law.slope(x), five_point, atol=1e-9)


def test_small_k_hat_tends_to_coulomb_friction() -> None:
    x = np.linspace(0.02, 3.0, 400)
    carter = CarterGriffith(k_hat=0.0, contact="elliptic")
    k_hats = np.array([1e-2, 1e-3, 1e-4, 1e-5])
    distance = [
        np.abs(
            CarterGriffith(k_hat=k, contact="elliptic").traction_ratio(x) - carter.traction_ratio(x)
        ).max()
        for k in k_hats
    ]
    # The excess of a strip at its creepage is (k_hat t)**2: second order, but for a thin layer.
    assert np.polyfit(np.log(k_hats), np.log(distance), 1)[0] == pytest.approx(2.0, abs=0.05)
    # The closed form of no k_hat is the quadrature's limit.
    smallest = CarterGriffith(k_hat=1e-12, contact="elliptic")
    np.testing.assert_allclose(smallest.traction_ratio(x), carter.traction_ratio(x), atol=3e-12)
    np.testing.assert_allclose(smallest.slope(x), carter.slope(x), atol=1e-9)


def test_odd_any_shape_and_the_ends_of_the_range() -> None:
    law = CarterGriffith(k_hat=0.3, contact="elliptic")
    x = np.array([[0.0, 1e-300, 1e-12], [1.0, 1e6, 1e300]])
    np.testing.assert_array_equal(law.traction_ratio(-x), -law.traction_ratio(x))
    np.testing.assert_array_equal(law.slope(-x), law.slope(x))
    assert law.traction_ratio(0.5).shape == ()
    assert law.traction_ratio(np.empty((0, 2))).shape == (0, 2)
    np.testing.assert_allclose(law.traction_ratio(x)[1, 1:], 1.0, rtol=1e-15)


@pytest.mark.parametrize("x", [0.4, 1.1])
def test_shear_traction_integrates_to_the_force(x: float) -> None:
    law = CarterGriffith(k_hat=0.3, contact="elliptic")
    angle, weight = np.polynomial.legendre.leggauss(60)
    angle, weight = 0.25 * np.pi * (angle + 1.0), 0.25 * np.pi * weight
    phi = (np.arange(64) + 0.5) * np.pi / 64
    total = 0.0
    for theta, share in zip(angle, weight, strict=True):
        eta, w = np.sin(theta), np.cos(theta)
        c = float(law.stick_boundary(x, eta))
        # The stick zone over its angle: the square root at its end turns smooth.
        stick = 0.5 * (w + c) + 0.5 * (w - c) * np.cos(phi)
        added = law.shear_traction(stick, x, eta) - np.sqrt(w**2 - stick**2)
        strip = 0.5 * np.pi * w**2 + (added * 0.5 * (w - c) * np.sin(phi)).sum() * np.pi / 64
        total += 2.0 * share * w * strip
    # P = 2 pi a b p0/3.
    assert 1.5 / np.pi * total == pytest.approx(float(law.traction_ratio(x)), abs=1e-9)


def test_stick_zone_of_coulomb_friction_mirrors_the_leading_edge() -> None:
    x, eta = 0.6, np.linspace(-1.0, 1.0, 41)
    w = np.sqrt((1.0 - eta) * (1.0 + eta))
    c = CarterGriffith(k_hat=0.0, contact="elliptic").stick_boundary(x, eta)
    np.testing.assert_allclose(c, np.where(w > x, 2.0 * x - w, w), atol=1e-14)
    # With weakening, stick lasts along the whole leading edge.
    weak = CarterGriffith(k_hat=0.3, contact="elliptic").stick_boundary(x, eta[1:-1])
    assert (weak < w[1:-1]).all()
    np.testing.assert_allclose(weak, weak[::-1], atol=1e-15)


def test_lateral_position_is_checked() -> None:
    law = CarterGriffith(k_hat=0.3, contact="elliptic")
    with pytest.raises(ValueError, match=r"lateral_position = 1.5 .* <= 1"):
        law.stick_boundary(0.5, 1.5)
    with pytest.raises(ValueError, match="'line' or 'elliptic'"):
        CarterGriffith(k_hat=0.3, contact="round")  # type: ignore[arg-type]
