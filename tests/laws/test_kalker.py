"""Kalker's coefficients: identities of their solver, CONTACT, closed limits, shipped table."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from half_space_cases import contact_cases, creepages_of, forces_of
from scipy.integrate import quad
from scipy.special import elliprd
from stick_rolling import influence, stick_coefficients

import contactlib as cl
from contactlib.laws.kalker import half_space_scales

COARSE, FINE = 8, 12  # degrees: right to 1e-4 in 0.1 s, and to 3e-5 in 0.5 s


@pytest.mark.parametrize("g", [0.2, 1.0, 5.0])
def test_solver_obeys_reciprocity(g: float) -> None:
    """The force of spin is the moment of lateral creepage; nothing in the solver enforces it."""
    c = stick_coefficients(influence(g, COARSE), 0.28)
    assert c.c32 == pytest.approx(c.c23, rel=1e-4)


@pytest.mark.parametrize("g", [0.1, 1.0, 6.0])
def test_without_poissons_effect(g: float) -> None:
    """At nu = 0 both directions have one kernel, and c23 a closed form.

    A punch tilted about the y axis has the traction x/sqrt(1 - (x/a)**2 - (y/b)**2). It is odd in
    x, so it does no work on the unknown f(y), and reciprocity gives the moment.
    """
    c = stick_coefficients(influence(g, COARSE), 0.0)
    assert c.c22 == pytest.approx(c.c11, rel=1e-10)
    assert c.c23 == pytest.approx(math.pi / elliprd(0.0, 1.0 / g, g), rel=1e-5)


def test_across_is_along_at_another_poissons_ratio() -> None:
    """Turning the tractions by 90 degrees turns the kernel of nu into that of -nu/(1-nu)."""
    on_ellipse = influence(1.5, COARSE)
    for nu in (0.28, 0.5):
        along = stick_coefficients(on_ellipse, -nu / (1.0 - nu)).c11
        across = stick_coefficients(on_ellipse, nu).c22
        assert across == pytest.approx(along / (1.0 - nu), rel=1e-10)


def strips(g: float, nu: float) -> tuple[float, float, float, float]:
    """Limit of the coefficients for a/b -> 0."""
    c11 = math.pi**2 / (4.0 * (1.0 - nu))
    neighbours = 1.0 + nu * (math.log(16.0 / g) - 5.0)
    return (
        c11,
        c11 * (1.0 - nu),
        math.pi * math.sqrt(g) / (3.0 * (1.0 - nu)) * neighbours,
        c11 / (4.0 * g),
    )


def needle(g: float, nu: float) -> tuple[float, float, float, float]:
    """Limit for a/b -> infinity; 0.157 was found with the solver."""
    big = math.log(16.0 * g * g)

    def along(at: float) -> float:
        at -= 3.0 - math.log(4.0)
        return 2.0 * math.pi * g / (at + 0.157 / at)

    below = (1.0 - nu) * big - 2.0 + 4.0 * nu
    return (
        along(big - 2.0 * nu),
        along(big + 2.0 * nu / (1.0 - nu)) / (1.0 - nu),
        2.0 * math.pi * g**1.5 / (3.0 * below),
        0.25 * math.pi * (((1.0 - 2.0 * nu) * big - 2.0 + 8.0 * nu) / below) ** 2,
    )


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "g", "degree"), [(strips, 1e-3, 10), (needle, 1e3, 8)])
def test_closed_limits(
    limit: Callable[[float, float], tuple[float, ...]], g: float, degree: int
) -> None:
    on_ellipse = influence(g, degree)
    for nu in (0.0, 0.25, 0.5):
        c = stick_coefficients(on_ellipse, nu)
        coefficients = (c.c11, c.c22, 0.5 * (c.c23 + c.c32), c.c33)
        assert coefficients == pytest.approx(limit(g, nu), rel=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("a_over_b", "nu"), [(0.05, 0.5), (0.33, 0.1), (1.3, 0.3), (20.0, 0.0)])
def test_shipped_coefficients_are_what_the_solver_gives(a_over_b: float, nu: float) -> None:
    c = stick_coefficients(influence(a_over_b, FINE), nu)
    shipped = [float(value) for value in cl.laws.kalker_coefficients(a_over_b, nu)]
    assert shipped == pytest.approx([c.c11, c.c22, c.c23, c.c33], rel=5e-5)


def test_agreement_with_contact() -> None:
    linear = contact_cases("coulomb", group="lin")
    assert len(linear) == 9
    forces, creepages = forces_of(linear), creepages_of(linear)
    for k in range(0, 9, 3):  # each creepage in turn
        c = cl.laws.kalker_coefficients(linear["a_over_b"][k], linear["nu"][k])
        slopes = forces[k : k + 3] / np.diag(creepages[k : k + 3])[:, np.newaxis]
        rounding = 5e-6 / np.diag(creepages[k : k + 3])
        both = 0.5 * (slopes[1, 2] - slopes[2, 1])  # they differ by up to 0.8 %
        for coefficient, expected, error, left in (
            (-c.c11, slopes[0, 0], 3e-3, rounding[0]),
            (-c.c22, slopes[1, 1], 3e-3, rounding[1]),
            (c.c23, both, 3e-3, rounding[1]),
            (-c.c33, slopes[2, 2], 8e-3, rounding[2]),  # where CONTACT converges slowest
        ):
            assert abs(coefficient - expected) < error * abs(coefficient) + abs(left)


def test_stick_vanishes_at_the_strain_of_full_slip() -> None:
    g, nu = 2.0, 0.3
    scales = half_space_scales(g, nu)
    c = cl.laws.kalker_coefficients(g, nu)
    assert scales.stiffness_x == pytest.approx(4.0 * c.c11 * (1.0 - nu) / math.pi**2)
    assert scales.stiffness_y == pytest.approx(4.0 * c.c22 / math.pi**2)
    for stiffness, softening, factor, part in (
        (scales.stiffness_x, scales.softening_x, 1.0 / (1.0 - nu), math.cos),
        (scales.stiffness_y, scales.softening_y, 1.0, math.sin),
    ):

        def strain(t: float, part: Callable[[float], float] = part) -> float:
            kernel = 1.0 - nu + nu * part(t) ** 2
            return float(
                kernel * math.sin(t) ** 2 / (math.cos(t) ** 2 + (g * math.sin(t)) ** 2) ** 1.5
            )

        x = stiffness * factor * 0.5 * g**2 * quad(strain, 0.0, math.pi, epsabs=1e-13)[0]
        assert x * (1.0 - softening * x) == pytest.approx(1.0, abs=1e-12)


def test_half_space_tends_to_strips_and_stays_monotone() -> None:
    g, nu = np.geomspace(0.05, 20.0, 60), np.linspace(0.0, 0.5, 6)
    each = np.array([[half_space_scales(ratio, v) for v in nu] for ratio in g])
    np.testing.assert_allclose(each[0, :, :2], 1.0, atol=0.01)
    for softening in (each[..., 2], each[..., 3]):
        # x (1 - c x) rises up to 1/(2 c), and reaches 1 before.
        assert softening.shape == (60, 6)
        assert softening.max() < 0.15
        assert np.abs(softening[0]).max() < 0.005


def test_shapes_must_broadcast() -> None:
    with pytest.raises(ValueError, match="the shapes must broadcast together"):
        cl.laws.kalker_coefficients([1.0, 2.0], [0.1, 0.2, 0.3])
