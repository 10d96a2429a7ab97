"""Relaxation lengths in full stick: identities of their solver, closed limits, shipped table."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial.chebyshev import chebvander
from stick_rolling import influence, stick_lengths

import contactlib as cl

COARSE, FINE = 8, 12  # degrees: right to 1e-4 in 0.1 s, and to 1e-5 in 0.5 s
LIMIT = 1.0 + math.log(4.0), 1.0 + math.log(4.0), 19.0 / 6.0 - math.log(4.0)


def test_across_is_along_at_another_poissons_ratio() -> None:
    """Turning the tractions by 90 degrees turns the kernel of nu into that of -nu/(1-nu)."""
    on_ellipse = influence(1.5, COARSE)
    for nu in (0.0, 0.28, 0.5):
        along, _, _ = stick_lengths(on_ellipse, -nu / (1.0 - nu))
        _, across, _ = stick_lengths(on_ellipse, nu)
        assert across == pytest.approx(along, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("g", [0.3, 3.0])
def test_solver_converges(g: float) -> None:
    degrees = [stick_lengths(influence(g, degree), 0.5) for degree in (6, COARSE, FINE)]
    rough, coarse = (np.abs(np.divide(of, degrees[-1]) - 1.0).max() for of in degrees[:-1])
    assert coarse < 0.5 * rough
    assert coarse < 5e-5


@pytest.mark.slow
def test_limit_of_a_short_contact() -> None:
    g = 1e-3
    on_ellipse = influence(g, 10)
    for nu in (0.0, 0.25, 0.5):
        found = stick_lengths(on_ellipse, nu)[:2]
        expected = [
            8.0 / (3.0 * math.pi) * (math.log(16.0 / g) - 2.0 + e) for e in (nu / (1.0 - nu), -nu)
        ]
        assert found == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_limit_of_a_long_contact() -> None:
    """What lacks is of second order in 1/L, with a factor that hardly depends on a/b."""
    factors = []
    for g in (1e2, 1e3):
        on_ellipse = influence(g, COARSE)
        for nu in (0.0, 0.25, 0.5):
            across = math.log(16.0 * g * g) + 2.0 * nu / (1.0 - nu)
            big = np.array([math.log(16.0 * g * g) - 2.0 * nu, across, across])
            ratio = stick_lengths(on_ellipse, nu) / np.array([2.0 / 3.0, 2.0 / 3.0, 1.0])
            factors.append((ratio - 1.0 - LIMIT / big) * big**2)
    np.testing.assert_allclose(factors, np.broadcast_to([3.68, 3.66, 2.9], (6, 3)), rtol=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(("a_over_b", "nu"), [(0.05, 0.5), (0.33, 0.1), (1.3, 0.3), (20.0, 0.0)])
def test_shipped_lengths_are_what_the_solver_gives(a_over_b: float, nu: float) -> None:
    expected = stick_lengths(influence(a_over_b, FINE), nu)
    found = [float(value) for value in cl.laws.relaxation_lengths(a_over_b, nu)]
    assert found == pytest.approx(expected, rel=5e-5)


def test_of_many_ellipses() -> None:
    g, nu = np.geomspace(0.05, 20.0, 40)[:, np.newaxis], np.linspace(0.0, 0.5, 6)
    found = np.array(cl.laws.relaxation_lengths(g, nu))
    assert found.shape == (3, 40, 6)
    assert (np.diff(found, axis=1) < 0.0).all()
    assert found.min() > 2.0 / 3.0
    np.testing.assert_allclose(found[0, :, 0], found[1, :, 0], rtol=1e-6)
    with pytest.raises(ValueError, match=r"a_over_b = 0\.04 is out of range"):
        cl.laws.relaxation_lengths(0.04, 0.3)
    with pytest.raises(ValueError, match="the shapes must broadcast together"):
        cl.laws.relaxation_lengths([1.0, 2.0], [0.1, 0.2, 0.3])


@pytest.mark.parametrize(("a", "held"), [(7e-3, 1.4), (5e-5, 0.05)])
def test_of_an_elliptic_contact(a: float, held: float) -> None:
    contact = cl.EllipticContact.from_semi_axes(
        semi_axis_x=a, semi_axis_y=5e-3, wheel_load=75e3, contact_modulus=115e9, poisson_ratio=0.28
    )
    expected = cl.laws.relaxation_lengths(held, 0.28)
    assert contact.relaxation_lengths == pytest.approx(list(map(float, expected)), rel=1e-9)


def of_line_by_collocation(length: float, nu: float, along: bool) -> float:
    """Solve for p sqrt(1 - x**2) as a polynomial times 1 - x, with the mean over the length.

    The kernel is the mean of (1-nu)/r + nu d**2/r**3 along, or of 1/r - nu d**2/r**3 across.
    """
    one, square = (1.0 - nu, nu) if along else (1.0, -nu)
    terms, points = 18, 1000
    s = np.cos((np.arange(points) + 0.5) * np.pi / points)
    x = np.cos((np.arange(4 * terms) + 0.5) * np.pi / (4 * terms))[:, np.newaxis]
    d = np.abs(x - s) / length
    root = np.hypot(1.0, d)
    smooth = one * (np.log(length * (1.0 + root)) - root + d) + square * (root - d)
    logarithm = np.pi * chebvander(x[:, 0], terms) / np.maximum(np.arange(terms + 1), 1)
    logarithm[:, 0] *= np.log(2.0)
    kernel = smooth @ chebvander(s, terms) * np.pi / points + one * logarithm
    factor = np.eye(terms + 1, terms)
    factor -= 0.5 * (np.eye(terms + 1, terms, -1) + np.eye(terms + 1, terms, 1))
    factor[1, 0] = -1.0
    system = np.column_stack((kernel @ factor, -np.ones(x.size)))

    def force(u: np.ndarray) -> tuple[float, float]:
        *tractions, f = np.linalg.lstsq(system, u[:, 0], rcond=1e-13)[0]
        return float(factor[0] @ tractions), float(f)

    steady, f = force(x)
    return -force(0.5 * x * x + f * x)[0] / steady


@pytest.mark.parametrize(("ratio", "error"), [(4.0, 0.045), (10.0, 0.009), (100.0, 1e-4)])
def test_of_a_line_contact(ratio: float, error: float) -> None:
    for nu in (0.0, 0.28, 0.5):
        contact = cl.LineContact(
            normal_load_per_length=1e6, radius=0.5, contact_modulus=115e9, poisson_ratio=nu
        )
        scaled = cl.LineContact(
            normal_load_per_length=1e6,
            radius=0.5,
            contact_modulus=115e9,
            poisson_ratio=nu,
            length=ratio * (1.0 + 1e-12) * contact.semi_width,
        )
        found = scaled.relaxation_lengths
        for value, along in ((found.longitudinal, True), (found.lateral, False)):
            assert value == pytest.approx(of_line_by_collocation(ratio, nu, along), rel=error)
        assert found.spin == 0.0


def test_a_line_contact_must_be_longer_than_wide() -> None:
    contact = cl.LineContact(
        normal_load_per_length=1e6, radius=0.5, contact_modulus=115e9, length=5e-3
    )
    with pytest.raises(ValueError, match=r"length/semi_width = 2\.1.* is out of range"):
        _ = contact.relaxation_lengths
