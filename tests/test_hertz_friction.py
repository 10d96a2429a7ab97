"""The normal problem and friction: closed forms and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

import contactlib as cl

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


def test_semi_width_given_or_found() -> None:
    line = cl.LineContact.from_semi_width(
        semi_width=5e-3, radius=0.5, contact_modulus=MODULUS, normal_load=220e3
    )
    assert line.semi_width == pytest.approx(5e-3, rel=1e-14)
    assert line.normal_load == pytest.approx(220e3, rel=1e-14)


def test_semi_width_and_pressure_grow_like_the_root_of_load() -> None:
    loads = np.geomspace(1e5, 1e7, 5)
    widths = [contact(load).semi_width for load in loads]
    order = np.polyfit(np.log(loads), np.log(widths), 1)[0]
    assert order == pytest.approx(cl.LineContact.load_exponent, abs=1e-12)


def test_scales_are_those_of_the_paper() -> None:
    line = contact()
    friction = cl.Friction(static=0.45, kinetic=0.21, weakening_length=1.5e-6)
    a, p0 = line.semi_width, line.peak_pressure
    eq_17 = math.sqrt(MODULUS * 0.24 * 1.5e-6 / (math.pi * 0.21**2 * a * p0))
    assert cl.k_hat(line, friction) == pytest.approx(eq_17, rel=1e-14)
    assert cl.saturation_creepage(line, friction) == pytest.approx(0.21 * a / 0.5, rel=1e-14)
    zone = 2.0 * math.pi * eq_17**2 * (0.21 / 0.24) ** 2
    assert cl.process_zone_ratio(line, friction) == pytest.approx(zone, rel=1e-14)
    coulomb = cl.Friction(static=0.21, kinetic=0.21, weakening_length=1e-6)
    assert cl.k_hat(line, coulomb) == 0.0
    assert cl.process_zone_ratio(line, coulomb) == 0.0


def test_friction_made_for_a_k_hat_has_it() -> None:
    for wanted in (0.0, 0.06, 0.3, 1.7):
        friction = cl.friction_with_k_hat(contact(), k_hat=wanted, static=0.45, kinetic=0.21)
        assert cl.k_hat(contact(), friction) == pytest.approx(wanted, rel=1e-14)
    with pytest.raises(ValueError, match="needs static > kinetic"):
        cl.friction_with_k_hat(contact(), k_hat=0.3, static=0.21, kinetic=0.21)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: cl.Friction(static=-0.1, kinetic=0.2, weakening_length=0.0), "static = -0.1"),
        (lambda: cl.Friction(static=0.1, kinetic=0.2, weakening_length=0.0), ">= Friction.kinetic"),
        (lambda: cl.Friction(static=0.3, kinetic=math.nan, weakening_length=0.0), "kinetic = nan"),
        (lambda: cl.Friction(static=0.3, kinetic="a", weakening_length=0.0), "not a number"),  # type: ignore[arg-type]
        (lambda: cl.Material(youngs_modulus=1e9, poisson_ratio=0.6), "<= 0.5"),
        (lambda: contact(0.0), r"normal_load_per_length = 0.0 .* > 0"),
        (
            lambda: cl.LineContact.from_semi_width(
                semi_width=-1.0, radius=1.0, contact_modulus=1.0, normal_load=1.0
            ),
            "semi_width = -1.0",
        ),
    ],
)
def test_bad_values_are_refused(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]


def test_parameters_are_frozen_and_keyword_only() -> None:
    friction = cl.Friction(static=0.3, kinetic=0.2, weakening_length=1e-6)
    with pytest.raises(AttributeError):
        friction.static = 0.5  # type: ignore[misc]
    with pytest.raises(TypeError):
        cl.Friction(0.3, 0.2, 1e-6)  # type: ignore[call-arg]
