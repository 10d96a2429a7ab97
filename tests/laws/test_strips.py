"""The elliptic Carter-Griffith law against adaptive quadrature of the line contact's."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from contactlib import CarterGriffith


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
