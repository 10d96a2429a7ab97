"""Polach's law against his own formula in dimensions, and what follows from its derivative."""

from __future__ import annotations

import numpy as np
import pytest

from contactlib import EllipticContact, Polach
from contactlib.base.quantities import FloatArray
from contactlib.laws import kalker_coefficients

ASPECT, NU = 6.304 / 12.61, 0.28
C11 = float(kalker_coefficients(ASPECT, NU).c11)


def force(
    zeta: FloatArray, k_a: float, k_s: float, mu0: float, a: float, b: float, speed: float
) -> tuple[FloatArray, FloatArray]:
    """Force over load, Wear 258 (2005) 992-1000, for a locomotive's contact; and its friction."""
    shear, load = 82e9, 106.7e3
    area = np.pi * 6.304e-3 * 12.61e-3
    mu = mu0 * ((1.0 - a) * np.exp(-b * np.abs(zeta) * speed) + a)
    eps = shear * area * C11 * zeta / (4.0 * load * mu)
    return (
        2.0 * mu / np.pi * (k_a * eps / (1.0 + (k_a * eps) ** 2) + np.arctan(k_s * eps)),
        mu,
    )


def saturation_creepage(mu: FloatArray) -> FloatArray:
    """2 mu p0/E*, with the pressure of Hertz's ellipse."""
    pressure = 1.5 * 106.7e3 / (np.pi * 6.304e-3 * 12.61e-3)
    contact = EllipticContact.from_semi_axes(
        semi_axis_x=6.304e-3,
        semi_axis_y=12.61e-3,
        wheel_load=106.7e3,
        contact_modulus=82e9 / (1.0 - NU),
        poisson_ratio=NU,
    )
    return 2.0 * mu * pressure / contact.tangential_modulus


@pytest.mark.parametrize(
    ("law", "numbers"),
    [
        (Polach.dry(), (1.00, 0.40, 0.55, 0.40, 0.60)),
        (Polach.wet(), (0.30, 0.10, 0.30, 0.40, 0.20)),
    ],
)
def test_with_falling_friction_it_is_polachs_force(
    law: Polach, numbers: tuple[float, float, float, float, float]
) -> None:
    zeta = np.concatenate([np.geomspace(1e-6, 1.0, 60), [-0.01, 0.0]])
    for speed in (1.0, 10.0, 40.0):
        expected, mu = force(zeta, *numbers, speed)
        ratio = law.traction_ratio(zeta / saturation_creepage(mu))
        np.testing.assert_allclose(mu * ratio, expected, rtol=1e-12, atol=0.0)


def test_initial_slope_is_the_mean_reduction_of_kalkers_linear_theory() -> None:
    law = Polach(adhesion_reduction=0.8, slip_reduction=0.3)
    mu = np.array(0.4)
    kalker = 82e9 * 6.304e-3 * 12.61e-3 * C11 * saturation_creepage(mu) / (mu * 106.7e3)
    assert float(law.slope(0.0)) == pytest.approx(0.55 * float(kalker), rel=1e-12)


@pytest.mark.parametrize("k_a", [0.1, 0.5, 1.0])
def test_it_falls_nowhere_from_the_twentyfourth_of_pi_on(k_a: float) -> None:
    # dq/dx = 0 is r (1 - r) v^2 - (1 - 2 r - r^2) v + 1 + r = 0 in v = (kA eps)^2, r = kS/kA. Its
    # two roots meet at r = tan(pi/24).
    threshold = np.tan(np.pi / 24.0)
    v = (1.0 - 2.0 * threshold - threshold**2) / (2.0 * threshold * (1.0 - threshold))
    at = np.sqrt(v) / (3.0 / 16.0 * np.pi**2 * k_a)
    for factor, sign in ((1.0 + 1e-6, 1.0), (1.0 - 1e-6, -1.0)):
        law = Polach(
            adhesion_reduction=k_a,
            slip_reduction=threshold * factor * k_a,
        )
        assert np.sign(law.slope(at)) == sign


@pytest.mark.parametrize("slip", [0.001, 0.1, 1.0])
def test_its_largest_value_is_the_limit(slip: float) -> None:
    law = Polach(adhesion_reduction=1.0, slip_reduction=slip)
    assert law.peak == (np.inf, 1.0)
    assert (law.traction_ratio(np.geomspace(1e-3, 1e3, 2000)) < 1.0).all()
    assert float(law.traction_ratio(1e12)) == pytest.approx(1.0, abs=1e-8)
