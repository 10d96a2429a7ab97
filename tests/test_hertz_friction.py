"""The normal problem and friction: closed forms and refusals."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, trapezoid

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


def ellipse(radius_x: float, radius_y: float, load: float = 1e5) -> cl.EllipticContact:
    return cl.EllipticContact(
        normal_load=load, radius_x=radius_x, radius_y=radius_y, contact_modulus=MODULUS
    )


def test_equal_radii_are_the_sphere() -> None:
    ball = ellipse(0.4, 0.4)
    a = (3.0 * 1e5 * 0.4 / (4.0 * MODULUS)) ** (1.0 / 3.0)
    assert ball.semi_axis_x == pytest.approx(a, rel=1e-13)
    assert ball.semi_axis_y == pytest.approx(a, rel=1e-13)
    assert ball.semi_width == ball.semi_axis_x
    pressure = (6.0 * 1e5 * MODULUS**2 / (math.pi**3 * 0.4**2)) ** (1.0 / 3.0)
    assert ball.peak_pressure == pytest.approx(pressure, rel=1e-13)


@pytest.mark.parametrize("aspect", [1e-7, 1e-6, 1e-3, 0.3, 0.999999, 1.0, 1.7, 20.0, 1e4, 1e7])
def test_semi_axes_given_or_found(aspect: float) -> None:
    contact = cl.EllipticContact.from_semi_axes(
        semi_axis_x=5e-3, semi_axis_y=5e-3 * aspect, normal_load=1e5, contact_modulus=MODULUS
    )
    assert contact.semi_axis_x == pytest.approx(5e-3, rel=1e-13)
    assert contact.semi_axis_y == pytest.approx(5e-3 * aspect, rel=1e-13)
    turned = ellipse(contact.radius_y, contact.radius_x)
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


@pytest.mark.parametrize(
    ("degrees", "m", "n"), [(30, 2.731, 0.493), (45, 1.926, 0.604), (60, 1.486, 0.717)]
)
def test_hertz_s_own_table(degrees: float, m: float, n: float) -> None:
    # Hertz 1881: cos(theta) = (B - A)/(A + B), axes m and n times (3 P/(4 E* (A + B)))^(1/3).
    mean, cosine = 3.0, math.cos(math.radians(degrees))
    contact = ellipse(1.0 / (mean * (1.0 - cosine)), 1.0 / (mean * (1.0 + cosine)))
    unit = (3.0 * 1e5 / (4.0 * MODULUS * mean)) ** (1.0 / 3.0)
    assert contact.semi_axis_x / unit == pytest.approx(m, abs=6e-4)
    assert contact.semi_axis_y / unit == pytest.approx(n, abs=6e-4)


def test_long_ellipse_is_a_line_contact_at_its_middle() -> None:
    aspects = np.array([1e2, 1e3, 1e4])
    errors = []
    for aspect in aspects:
        contact = cl.EllipticContact.from_semi_axes(
            semi_axis_x=5e-3, semi_axis_y=5e-3 * aspect, normal_load=1e5, contact_modulus=MODULUS
        )
        line = cl.LineContact(
            normal_load_per_length=0.5 * math.pi * 5e-3 * contact.peak_pressure,
            radius=contact.radius_x,
            contact_modulus=MODULUS,
        )
        errors.append(line.semi_width / 5e-3 - 1.0)
        assert line.peak_pressure * line.semi_width == pytest.approx(contact.peak_pressure * 5e-3)
    assert np.all(np.abs(errors) < 10.0 * np.log(aspects) / aspects**2)


def test_semi_axes_and_pressure_grow_like_the_cube_root_of_load() -> None:
    loads = np.geomspace(1e3, 1e7, 5)
    contacts = [ellipse(0.46, 2.0, load) for load in loads]
    for name in ("semi_axis_x", "semi_axis_y", "peak_pressure"):
        values = [getattr(contact, name) for contact in contacts]
        order = np.polyfit(np.log(loads), np.log(values), 1)[0]
        assert order == pytest.approx(cl.EllipticContact.load_exponent, abs=1e-12)


def test_eurosprinter_s_peak_pressure() -> None:
    contact = cl.EllipticContact.from_semi_axes(
        semi_axis_x=6.304e-3, semi_axis_y=12.61e-3, normal_load=106.7e3, contact_modulus=114e9
    )
    rounding = 0.0005 / 6.304 + 0.005 / 12.61 + 0.05 / 106.7
    assert contact.peak_pressure == pytest.approx(640.7e6, rel=rounding)


def test_scales_of_an_elliptic_contact() -> None:
    contact = ellipse(0.46, 2.0)
    friction = cl.friction_with_k_hat(
        contact, k_hat=0.4, static=0.5, kinetic=0.3, slip_rate_residual=0.4, slip_rate_decay=0.6
    )
    assert (friction.slip_rate_residual, friction.slip_rate_decay) == (0.4, 0.6)
    a, p0, length = contact.semi_axis_x, contact.peak_pressure, friction.weakening_length
    eq_17 = math.sqrt(MODULUS * 0.2 * length / (math.pi * 0.3**2 * a * p0))
    assert eq_17 == pytest.approx(0.4, rel=1e-13)
    assert cl.k_hat(contact, friction) == pytest.approx(0.4, rel=1e-13)
    zeta0 = 2.0 * 0.3 * p0 / MODULUS
    assert cl.saturation_creepage(contact, friction) == pytest.approx(zeta0, rel=1e-14)


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
        (lambda: ellipse(3.039706942284076e221, 0.3), "radius_y/radius_x = .* given radius_x = 3"),
        (lambda: ellipse(0.5, -1.0), r"EllipticContact.radius_y = -1.0 .* > 0"),
        (
            lambda: cl.EllipticContact.from_semi_axes(
                semi_axis_x=1e-3, semi_axis_y=0.0, normal_load=1.0, contact_modulus=1.0
            ),
            "semi_axis_y = 0.0",
        ),
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
    np.testing.assert_allclose(phi.slope(v), cl.EXPONENTIAL.slope(v), atol=1e-9)
    np.testing.assert_allclose(phi.fraction(v), cl.EXPONENTIAL.fraction(v), atol=1e-14)


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
    assert plain.weakening is cl.EXPONENTIAL
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
        ([1e-7, 1e-6], [0.4, 0.3], "must begin with 0 and rise"),
        ([0.0, 1e-6, 1e-6], [0.4, 0.3, 0.2], "must begin with 0 and rise"),
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


def test_parameters_are_frozen_and_keyword_only() -> None:
    friction = cl.Friction(static=0.3, kinetic=0.2, weakening_length=1e-6)
    with pytest.raises(AttributeError):
        friction.static = 0.5  # type: ignore[misc]
    with pytest.raises(TypeError):
        cl.Friction(0.3, 0.2, 1e-6)  # type: ignore[call-arg]
