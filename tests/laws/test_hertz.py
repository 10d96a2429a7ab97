"""Hertz contacts: semi-axes, pressures and scales."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import elliprd

import contactlib as cl
from contactlib.laws.hertz import Theory

STEEL = cl.Material(youngs_modulus=210e9, poisson_ratio=0.3)


MODULUS = STEEL.contact_modulus_with(STEEL)


def contact(load: float = 4.5e6) -> cl.LineContact:
    return cl.LineContact(normal_load_per_length=load, radius=0.5, contact_modulus=MODULUS)


def test_contact_modulus_of_equal_and_of_rigid_bodies() -> None:
    assert pytest.approx(210e9 / (2.0 * (1.0 - 0.09))) == MODULUS
    stiff = cl.Material(youngs_modulus=1e30, poisson_ratio=0.3)
    assert STEEL.contact_modulus_with(stiff) == pytest.approx(210e9 / 0.91)


def test_pressure_carries_the_load_and_flattens_the_cylinder() -> None:
    line = contact()
    a, p0 = line.semi_width, line.peak_pressure
    carried, _ = quad(lambda x: p0 * math.sqrt(1.0 - (x / a) ** 2), -a, a)
    assert carried == pytest.approx(line.normal_load_per_length, rel=1e-7)
    # Half-space under the elliptic pressure: curvature 2 p0/(E* a) must undo 1/R.
    assert 2.0 * p0 / (MODULUS * a) == pytest.approx(1.0 / line.radius, rel=1e-14)


def test_ellipse_is_that_of_scipy_s_integrals() -> None:
    rng = np.random.default_rng(7)
    for rx, ry, load in (
        10.0 ** rng.uniform((-3.0, -3.0, 3.0), (3.0, 3.0, 6.0), (100, 3))
    ).tolist():
        ball = cl.EllipticContact(
            wheel_load=load, radius_x=rx, radius_y=ry, contact_modulus=MODULUS, theory="strips"
        )
        a, b, stiffness = ball.semi_axis_x, ball.semi_axis_y, math.pi * MODULUS / load
        assert stiffness / elliprd(0.0, b**2, a**2) == pytest.approx(rx, rel=1e-13)
        assert stiffness / elliprd(0.0, a**2, b**2) == pytest.approx(ry, rel=1e-13)


def test_semi_width_given_or_found() -> None:
    line = cl.LineContact.from_semi_width(
        semi_width=5e-3, radius=0.5, contact_modulus=MODULUS, wheel_load=220e3
    )
    assert line.semi_width == pytest.approx(5e-3, rel=1e-14)
    assert line.wheel_load == pytest.approx(220e3, rel=1e-14)


def ellipse(
    radius_x: float, radius_y: float, load: float = 1e5, theory: Theory = "half_space"
) -> cl.EllipticContact:
    return cl.EllipticContact(
        wheel_load=load,
        radius_x=radius_x,
        radius_y=radius_y,
        contact_modulus=MODULUS,
        theory=theory,
    )


@pytest.mark.parametrize("aspect", [1e-7, 1e-6, 1e-3, 0.3, 0.999999, 1.0, 1.7, 20.0, 1e4, 1e7])
def test_semi_axes_given_or_found(aspect: float) -> None:
    contact = cl.EllipticContact.from_semi_axes(
        semi_axis_x=5e-3,
        semi_axis_y=5e-3 * aspect,
        wheel_load=1e5,
        contact_modulus=MODULUS,
        theory="strips",
    )
    assert contact.semi_axis_x == pytest.approx(5e-3, rel=1e-13)
    assert contact.semi_axis_y == pytest.approx(5e-3 * aspect, rel=1e-13)
    turned = ellipse(contact.radius_y, contact.radius_x, theory="strips")
    assert turned.semi_axis_x == pytest.approx(5e-3 * aspect, rel=1e-13)


@pytest.mark.parametrize(("radius_x", "radius_y"), [(0.5, 0.5), (0.46, 2.0), (3.0, 0.2)])
def test_elliptic_pressure_flattens_both_curvatures(radius_x: float, radius_y: float) -> None:
    contact = ellipse(radius_x, radius_y)
    a, b, p0 = contact.semi_axis_x, contact.semi_axis_y, contact.peak_pressure

    def displacement(x: float, y: float) -> float:
        """Boussinesq's integral over chords through (x, y); along each the pressure is known."""

        def chord(angle: float) -> float:
            c, s = math.cos(angle), math.sin(angle)
            curvature = (c / a) ** 2 + (s / b) ** 2
            slope = x * c / a**2 + y * s / b**2
            square = 1.0 - (x / a) ** 2 - (y / b) ** 2 + slope**2 / curvature
            return 0.5 * math.pi * square / math.sqrt(curvature)

        return p0 / (math.pi * MODULUS) * quad(chord, 0.0, math.pi, epsabs=0.0, epsrel=1e-12)[0]

    deepest = displacement(0.0, 0.0)
    for x, y in ((0.6 * a, 0.0), (0.0, 0.7 * b), (0.5 * a, 0.5 * b)):
        gap = x**2 / (2.0 * radius_x) + y**2 / (2.0 * radius_y)
        assert deepest - displacement(x, y) == pytest.approx(gap, rel=1e-9)


def test_scales_of_an_elliptic_contact() -> None:
    contact = ellipse(0.46, 2.0)
    friction = cl.friction_with_k_hat(
        contact, k_hat=0.4, static=0.5, kinetic=0.3, slip_rate_residual=0.4, slip_rate_decay=0.6
    )
    assert (friction.slip_rate_residual, friction.slip_rate_decay) == (0.4, 0.6)
    a, p0, length = contact.semi_axis_x, contact.peak_pressure, friction.weakening_length
    eq_17 = math.sqrt(contact.tangential_modulus * 0.2 * length / (math.pi * 0.3**2 * a * p0))
    assert eq_17 == pytest.approx(0.4, rel=1e-13)
    assert cl.laws.k_hat(contact, friction) == pytest.approx(0.4, rel=1e-13)
    zeta0 = 2.0 * 0.3 * p0 / contact.tangential_modulus
    assert cl.laws.saturation_creepage(contact, friction) == pytest.approx(zeta0, rel=1e-14)


def test_scales_are_those_of_the_paper() -> None:
    line = contact()
    friction = cl.Friction(static=0.45, kinetic=0.21, weakening_length=1.5e-6)
    a, p0 = line.semi_width, line.peak_pressure
    eq_17 = math.sqrt(MODULUS * 0.24 * 1.5e-6 / (math.pi * 0.21**2 * a * p0))
    assert cl.laws.k_hat(line, friction) == pytest.approx(eq_17, rel=1e-14)
    assert cl.laws.saturation_creepage(line, friction) == pytest.approx(0.21 * a / 0.5, rel=1e-14)
    zone = 2.0 * math.pi * eq_17**2 * (0.21 / 0.24) ** 2
    assert cl.laws.process_zone_ratio(line, friction) == pytest.approx(zone, rel=1e-14)
    coulomb = cl.Friction(static=0.21, kinetic=0.21, weakening_length=1e-6)
    assert cl.laws.k_hat(line, coulomb) == 0.0
    assert cl.laws.process_zone_ratio(line, coulomb) == 0.0


def test_values_that_do_not_fit_each_other_are_refused() -> None:
    with pytest.raises(ValueError, match=r">= kinetic = 0\.2"):
        cl.Friction(static=0.1, kinetic=0.2, weakening_length=0.0)
    with pytest.raises(ValueError, match=r"radius_y/radius_x = .* given radius_x = 3"):
        ellipse(3.039706942284076e221, 0.3)


def test_parameters_are_frozen_and_keyword_only() -> None:
    friction = cl.Friction(static=0.3, kinetic=0.2, weakening_length=1e-6)
    with pytest.raises(AttributeError):
        friction.static = 0.5  # type: ignore[misc]
    with pytest.raises(TypeError):
        cl.Friction(0.3, 0.2, 1e-6)  # type: ignore[call-arg]
