"""The law against closed forms, the paper's integral equations and 60-digit arithmetic."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from contactlib import CarterGriffith


@pytest.mark.parametrize(
    ("k_hat", "x", "q", "steepest", "at"),
    [
        (0.1, 1.04685, 1.025098, -0.1014, 1.179),
        (0.3, 1.131634, 1.135026, -0.2264, 1.441),
        (0.5, 1.22503, 1.286131, -0.3191, 1.679),
        (1.0, 1.5, 1.75, -0.4819, 2.245),
    ],
)
def test_peak_and_steepest_fall(
    k_hat: float, x: float, q: float, steepest: float, at: float
) -> None:
    law = CarterGriffith(k_hat=k_hat)
    assert law.peak.normalized_creepage == pytest.approx(x, abs=6e-6)
    assert law.peak.traction_ratio == pytest.approx(q, abs=6e-7)
    assert law.traction_ratio(law.peak.normalized_creepage) == pytest.approx(q, abs=6e-7)
    grid = np.linspace(at - 0.05, at + 0.05, 2001)
    slope = law.slope(grid)
    assert slope.min() == pytest.approx(steepest, abs=6e-5)
    assert grid[slope.argmin()] == pytest.approx(at, abs=6e-4)


def test_zero_k_hat_is_carter() -> None:
    x = np.linspace(0.0, 3.0, 1001)
    carter = np.where(x < 1.0, 1.0 - (1.0 - np.minimum(x, 1.0)) ** 2, 1.0)
    law = CarterGriffith(k_hat=0.0)
    np.testing.assert_allclose(law.traction_ratio(x), carter, rtol=0.0, atol=4e-16)
    np.testing.assert_array_equal(law.slope(x[x >= 1.0]), 0.0)
    assert law.peak == (1.0, 1.0)


def exact(x: float, k_hat: float) -> tuple[float, float]:
    """Traction ratio and slope by bisection in 60 digits, in the paper's own variables."""
    with mpmath.workdps(60):
        k, target = mpmath.mpf(k_hat), mpmath.mpf(x)

        def creepage(log_t: mpmath.mpf) -> mpmath.mpf:
            fourth = mpmath.exp(4 * log_t)
            return fourth / (1 + fourth) + k * mpmath.exp(log_t)

        low, high = mpmath.log(mpmath.mpf("1e-20")), mpmath.log(target / k) + 1
        for _ in range(220):
            middle = (low + high) / 2
            if creepage(middle) > target:
                high = middle
            else:
                low = middle
        t = mpmath.exp(low)
        c = (t**4 - 1) / (t**4 + 1)
        q = 1 - (1 - c) ** 2 / 4 + k * (1 - c) ** mpmath.mpf("0.75") * (1 + c) ** mpmath.mpf("0.25")
        s = (1 - c) / 2
        return float(q), float(2 * (1 - target) + 2 * k**2 * t / (k + 4 * t**3 * s**2))


@pytest.mark.slow
@pytest.mark.parametrize("k_hat", [1e-9, 1e-4, 0.03, 0.3, 1.0, 2.0])
def test_thirteen_digits_from_the_smallest_creepage_to_the_far_tail(k_hat: float) -> None:
    law = CarterGriffith(k_hat=k_hat)
    near_one = 1.0 + np.array([-0.1, -1e-3, -1e-7, 0.0, 1e-7, 1e-3, 0.1])
    x = np.concatenate([np.geomspace(1e-12, 1e6, 37), near_one, [2.0, 3.0]])
    reference = np.array([exact(float(v), k_hat) for v in x])
    np.testing.assert_allclose(law.traction_ratio(x), reference[:, 0], rtol=1e-13)
    np.testing.assert_allclose(law.slope(x), reference[:, 1], rtol=0.0, atol=1e-13)


def integrals_of_shear_traction(law: CarterGriffith, x: float) -> tuple[float, list[float]]:
    """Integral of Eq. (16), and its Cauchy integral over pi at points of the stick zone.

    Of the sliding part sqrt(1 - xi^2) they are pi/2 and xi. What the stick zone adds is integrated
    over phi, with xi = middle + half cos(phi): there it is smooth and even, so the midpoint rule
    converges geometrically, also to the principal value if that is taken halfway between nodes.
    """
    c = float(law.stick_boundary(x))
    middle, half, n = 0.5 * (1.0 + c), 0.5 * (1.0 - c), 64
    phi = (np.arange(n) + 0.5) * np.pi / n
    stick = middle + half * np.cos(phi)
    added = law.shear_traction(stick, x) - np.sqrt(1.0 - stick**2)
    share = added * half * np.sin(phi) * np.pi / n
    inside = middle + half * np.cos(np.array([n // 7, n // 3, n // 2, 4 * n // 5]) * np.pi / n)
    cauchy = [float(at + (share / (at - stick)).sum() / np.pi) for at in inside]
    return float(0.5 * np.pi + share.sum()), cauchy


@pytest.mark.parametrize(
    ("k_hat", "x"),
    [(k, x) for k in (0.0, 0.1, 0.3, 1.0, 2.0) for x in (0.2, 0.6, 0.9)]
    + [(k, x) for k in (0.1, 0.3, 1.0, 2.0) for x in (1.3, 1.6)],  # Carter has no stick there
)
def test_shear_traction_integrates_to_force_and_creepage(k_hat: float, x: float) -> None:
    law = CarterGriffith(k_hat=k_hat)
    force, cauchy = integrals_of_shear_traction(law, x)
    # Eq. (18): P = pi a p0/2, so Q/(f_d P) is 2/pi times the integral.
    assert 2.0 / np.pi * force == pytest.approx(float(law.traction_ratio(x)), abs=1e-12)
    # Eq. (19): everywhere in the stick zone the surface strain is the creepage.
    assert cauchy == pytest.approx([x] * 4, abs=1e-11)


def test_shear_traction_is_that_of_sliding_outside_the_stick_zone() -> None:
    law = CarterGriffith(k_hat=0.3)
    c = float(law.stick_boundary(0.8))
    xi = np.linspace(-1.0, c - 1e-9, 50)
    np.testing.assert_allclose(law.shear_traction(xi, 0.8), np.sqrt(1.0 - xi**2))
    np.testing.assert_array_equal(law.shear_traction([-1.5, 1.0, 1.5], 0.8), 0.0)
    np.testing.assert_array_equal(law.shear_traction(xi, -0.8), -law.shear_traction(xi, 0.8))
