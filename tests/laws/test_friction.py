"""Friction that weakens with slip: from numbers, functions and samples."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, trapezoid

import contactlib as cl

STEEL = cl.Material(youngs_modulus=210e9, poisson_ratio=0.3)


MODULUS = STEEL.contact_modulus_with(STEEL)


def contact(load: float = 4.5e6) -> cl.LineContact:
    return cl.LineContact(normal_load_per_length=load, radius=0.5, contact_modulus=MODULUS)


def test_friction_made_for_a_k_hat_has_it() -> None:
    for expected in (0.0, 0.06, 0.3, 1.7):
        friction = cl.friction_with_k_hat(contact(), k_hat=expected, static=0.45, kinetic=0.21)
        assert cl.laws.k_hat(contact(), friction) == pytest.approx(expected, rel=1e-14)
    with pytest.raises(ValueError, match="needs static > kinetic"):
        cl.friction_with_k_hat(contact(), k_hat=0.3, static=0.21, kinetic=0.21)


FALL = 1.7e-6


SHAPES: dict[str, tuple[Callable[[float], float], float]] = {
    # f in units of the drop, over slip in units of FALL, and the closed form of its integral
    "exponential": (lambda v: math.exp(-v), 1.0),
    "ramp": (lambda v: max(0.0, 1.0 - v), 0.5),
    "gaussian": (lambda v: math.exp(-(v**2)), 0.5 * math.sqrt(math.pi)),
    "root": (lambda v: math.exp(-math.sqrt(v)), 2.0),
    "hump": (lambda v: (1.0 + 3.0 * v) * math.exp(-v), 4.0),
    "dip": (lambda v: (1.0 - 0.2 * v) * math.exp(-v), 0.8),
    "step": (lambda v: float(v < 1.0), 1.0),
    "cubic tail": (lambda v: 1.0 / (1.0 + v) ** 3, 0.5),
    "square tail": (lambda v: 1.0 / (1.0 + v) ** 2, 1.0),
}


# What rounding leaves of f - f_d cuts a slow tail off where it still holds this much.
TAILS = {"square tail": 1e-7, "cubic tail": 1e-10}


def weakened(shape: Callable[[float], float], fall: float = FALL) -> Callable[[float], float]:
    return lambda u: 0.2 + 0.25 * shape(u / fall)


@pytest.mark.parametrize("fall", [1e-9, FALL, 1e-2])
@pytest.mark.parametrize("name", SHAPES)
def test_weakening_length_of_a_function(name: str, fall: float) -> None:
    shape, integral = SHAPES[name]
    tolerance = TAILS.get(name, 1e-12)
    f = weakened(shape, fall)
    for friction in (cl.Friction.from_function(f), cl.Friction.from_function(f, kinetic=0.2)):
        assert friction.static == pytest.approx(0.45, rel=1e-15)
        assert friction.kinetic == pytest.approx(0.2, rel=1e-15)
        assert friction.weakening_length == pytest.approx(integral * fall, rel=tolerance)
    u = fall * np.array([[0.0, 0.2, 0.7], [1.3, 4.0, 1e3]])
    expected = np.vectorize(f)(u)
    np.testing.assert_allclose(friction.coefficient(u), expected, rtol=1e-7, atol=0.0)


@pytest.mark.parametrize("name", ["exponential", "ramp", "hump", "cubic tail"])
def test_shape_of_a_weakening_is_normalized(name: str) -> None:
    friction = cl.Friction.from_function(weakened(SHAPES[name][0]), name=name)
    phi = friction.weakening
    assert phi.name == name
    assert phi.fraction(np.array(0.0)) == pytest.approx(1.0, rel=1e-15)
    assert phi.fraction(np.array(1e300)) == pytest.approx(0.0, abs=1e-15)
    v = np.append(0.0, np.geomspace(1e-9, 1e7, 400_001))
    assert trapezoid(phi.fraction(v), v) == pytest.approx(1.0, rel=1e-7)
    # The slope is the derivative: its integral gives the shape back.
    v = np.linspace(0.0, 3.0, 3001)
    rise = cumulative_trapezoid(phi.slope(v), v, initial=0)
    tolerance = 1e-3 if name == "ramp" else 1e-5  # of the trapezoidal rule, across a kink or not
    np.testing.assert_allclose(rise, phi.fraction(v) - 1.0, atol=tolerance)


def test_slope_of_a_function_is_that_of_the_exponential() -> None:
    phi = cl.Friction.from_function(weakened(lambda v: math.exp(-v))).weakening
    v = np.append(0.0, np.geomspace(1e-9, 100.0, 200))
    np.testing.assert_allclose(phi.slope(v), cl.laws.EXPONENTIAL.slope(v), atol=1e-9)
    np.testing.assert_allclose(phi.fraction(v), cl.laws.EXPONENTIAL.fraction(v), atol=1e-14)


def test_samples_of_a_function() -> None:
    f = weakened(lambda v: math.exp(-v))
    exact = cl.Friction.from_function(f)
    errors = []
    counts = np.array([20, 40, 80, 160])
    for n in counts:
        u = FALL * 40.0 * np.linspace(0.0, 1.0, n) ** 2
        sampled = cl.Friction.from_samples(u, np.vectorize(f)(u))
        errors.append(abs(sampled.weakening_length / exact.weakening_length - 1.0))
        np.testing.assert_allclose(sampled.coefficient(u), np.vectorize(f)(u), rtol=1e-14)
        assert sampled.coefficient(50.0 * FALL) == sampled.kinetic
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] < -2.5
    assert errors[-1] < 1e-5


def test_two_samples_are_a_ramp() -> None:
    friction = cl.Friction.from_samples([0.0, 2e-6], [0.4, 0.3])
    assert friction.weakening_length == pytest.approx(1e-6, rel=1e-15)
    v = np.array([0.0, 0.5, 1.999, 2.0, 3.0, np.inf])
    np.testing.assert_allclose(friction.weakening.fraction(v), np.maximum(1.0 - v / 2.0, 0.0))
    np.testing.assert_allclose(friction.weakening.slope(v), np.where(v < 2.0, -0.5, 0.0))


def test_frictions_of_equal_fields_are_equal() -> None:
    f = weakened(lambda v: math.exp(-v))
    assert cl.Friction.from_function(f) == cl.Friction.from_function(f)
    assert len({cl.Friction.from_samples([0.0, 1e-6], [0.4, 0.3]) for _ in range(2)}) == 1
    plain = cl.Friction(static=0.4, kinetic=0.3, weakening_length=1e-6)
    assert plain.weakening is cl.laws.EXPONENTIAL
    assert plain != cl.Friction.from_samples([0.0, 2e-6], [0.4, 0.3])


def test_coulomb_friction_has_no_transition() -> None:
    coulomb = cl.Friction(static=0.4, kinetic=0.3, weakening_length=0.0)
    np.testing.assert_array_equal(coulomb.coefficient([0.0, 1e-300, 1.0]), [0.4, 0.3, 0.3])


def test_slip_rate_factor_goes_from_one_to_the_residual() -> None:
    friction = cl.Friction(
        static=0.4, kinetic=0.3, weakening_length=0.0, slip_rate_residual=0.4, slip_rate_decay=0.6
    )
    np.testing.assert_array_equal(friction.slip_rate_factor([0.0, 1e9, -1e9]), [1.0, 0.4, 0.4])
    assert friction.slip_rate_factor(math.log(2.0) / 0.6) == pytest.approx(0.7, rel=1e-15)
    steady = cl.Friction(static=0.4, kinetic=0.3, weakening_length=0.0)
    np.testing.assert_array_equal(steady.slip_rate_factor([0.0, 3.0]), 1.0)


@pytest.mark.parametrize(
    ("f", "kinetic", "message"),
    [
        (lambda u: 0.2 + 0.1 * u / (1e-6 + u), None, r"f\(0\) = 0.2 .*> kinetic = 0.3"),
        (lambda u: 0.3, None, r"f\(0\) = 0.3 .*> kinetic = 0.3"),
        (lambda u: 0.3, 0.4, r"f\(0\) = 0.3 .*> kinetic = 0.4"),
        (lambda u: 0.3, 0.2, "kinetic = 0.2 .* half way"),
        (lambda u: 0.3, -0.2, r"kinetic = -0.2 .*> 0"),
        (lambda u: 0.3 + 0.1 * math.cos(1e6 * u), None, "does not settle"),
        (lambda u: 0.3 + 0.1 / (1.0 + 1e6 * u), None, "does not converge"),
        (lambda u: 0.3 + 0.1 * math.exp(-1e6 * u), 0.29, "does not converge"),
        (lambda u: 0.3 - 1e3 * u, None, r"f\(.*\) = -.*>= 0"),
        (lambda u: math.nan, None, r"f\(0\) = nan .*finite"),
        (lambda u: "much", None, r"f\(0\) = 'much' is not a number"),
        (lambda u: 0.3 + (0.1 - 0.4e6 * u) * math.exp(-1e6 * u), None, "weakening length -"),
    ],
)
def test_bad_functions_are_refused(
    f: Callable[[float], float], kinetic: float | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        cl.Friction.from_function(f, kinetic=kinetic)


@pytest.mark.parametrize(
    ("slip", "coefficient", "message"),
    [
        ([0.0, 1e-6], [0.2, 0.3], r"coefficient\[0\] = 0.2 .*> kinetic = 0.3"),
        ([1e-7, 1e-6], [0.4, 0.3], "must begin with 0 and be strictly increasing"),
        ([0.0, 1e-6, 1e-6], [0.4, 0.3, 0.2], "must begin with 0 and be strictly increasing"),
        ([0.0], [0.4], "at least 2"),
        ([0.0, 1e-6], [0.4, 0.3, 0.2], "of one length"),
        ([0.0, 1e-6], [0.4, math.nan], "coefficient = nan"),
        ([0.0, 1e-6], [0.4, 0.0], r"Friction.kinetic = 0.0 .*> 0"),
        ([0.0, 1e-6, 9e-6, 1e-5], [0.4, 0.1, 0.1, 0.3], "weakening length -"),
    ],
)
def test_bad_samples_are_refused(slip: list[float], coefficient: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cl.Friction.from_samples(slip, coefficient)
