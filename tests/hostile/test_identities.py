"""What holds of every contact, whatever its material, load, speed and friction."""

from __future__ import annotations

import dataclasses
import math
import warnings
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import examples, magnitude, number

import contactlib as cl
from contactlib.element import ProcessZoneWarning

pytestmark = pytest.mark.filterwarnings(
    "ignore::contactlib.element.AspectWarning"
)  # long ellipses too


class Wheel(NamedTuple):
    """What makes a contact with its friction, in numbers that a law does not change."""

    contact: Any
    friction: dict[str, float]

    def element(self) -> cl.ForceElement:
        made = cl.friction_with_k_hat(self.contact, **self.friction)
        return element_of(self.contact, made)


def element_of(contact: Any, friction: cl.Friction) -> cl.ForceElement:
    shape: Any = "elliptic" if isinstance(contact, cl.EllipticContact) else "line"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ProcessZoneWarning)
        table = cl.carter_griffith_table(shape)
        return cl.ForceElement(contact, friction, table=table, radius=0.5)


lines = st.builds(
    cl.LineContact.from_semi_width,
    semi_width=magnitude(1e-6, 1e-1),
    radius=magnitude(1e-3, 1e2),
    contact_modulus=magnitude(1e6, 1e12),
    wheel_load=magnitude(1e-6, 1e7),
)
ellipses = st.builds(
    cl.EllipticContact,
    wheel_load=magnitude(1e-3, 1e7),
    radius_x=magnitude(1e-3, 1.0),
    radius_y=magnitude(1e-2, 1e2),
    contact_modulus=magnitude(1e6, 1e12),
)
frictions = st.builds(
    lambda kinetic, ratio, k_hat, residual, decay: {
        "static": kinetic * ratio,
        "kinetic": kinetic,
        "k_hat": k_hat,
        "slip_rate_residual": residual,
        "slip_rate_decay": decay,
    },
    magnitude(1e-3, 2.0),
    number(1.001, 10.0),
    st.one_of(st.just(0.0), magnitude(1e-12, 1.9)),
    st.one_of(st.just(1.0), number(0.1, 1.0)),
    st.one_of(st.just(0.0), magnitude(1e-3, 10.0)),
)
wheels = st.builds(Wheel, st.one_of(lines, ellipses), frictions)
signs = st.sampled_from([-1.0, 1.0])
speeds = st.one_of(
    st.sampled_from([0.0, 0.1, -0.1, 5e-324, 1e-12]),
    st.builds(lambda v, sign: v * sign, magnitude(1e-9, 1e3), signs),
)
creepages = st.builds(lambda x, sign: x * sign, magnitude(1e-9, 1e6), signs)  # over zeta0
factors = magnitude(1e-3, 1e3)
shapes = st.sampled_from(["line", "elliptic"])
k_hats = st.one_of(st.just(0.0), magnitude(1e-300, 2.0))
laws = st.builds(cl.CarterGriffith, k_hat=k_hats, contact=shapes)


def omega_at(element: cl.ForceElement, x: float, speed: float) -> float:
    """Angular velocity at about x times the saturation creepage."""
    slip = x * element.saturation_creepage * max(abs(speed), element.minimum_speed)
    return (speed + slip) / element.radius


@examples(40)
@given(wheel=wheels, x=creepages, speed=speeds, load=factors, scale=number(1e-3, 2.0))
def test_odd_bounded_and_dissipative(
    wheel: Wheel, x: float, speed: float, load: float, scale: float
) -> None:
    element = wheel.element()
    omega = omega_at(element, x, speed)
    assume(abs(omega) < 1e9)
    loaded = {"axle_load": load * wheel.contact.wheel_load, "friction_scale": scale}
    force = float(element.force(omega=omega, speed=speed, **loaded))
    assert math.isfinite(force)
    assert float(element.force(omega=-omega, speed=-speed, **loaded)) == -force
    assert force * (omega * element.radius - speed) >= 0.0
    bound = element.friction.static * scale * loaded["axle_load"]
    # The kernel cuts Q/(f_d P) at f_s/f_d, whose product with f_d is f_s but for rounding.
    assert abs(force) <= bound * (1.0 + 4.0 * np.finfo(float).eps)


@examples(40)
@given(
    law=laws,
    x=magnitude(1e-12, 1e12),
    step=magnitude(1e-12, 1e3),
    eta=number(-1.0, 1.0),
)
def test_stick_boundary_never_goes_back(
    law: cl.CarterGriffith, x: float, step: float, eta: float
) -> None:
    low, high = law.stick_boundary([x, x * (1.0 + step)], eta)
    width = math.sqrt((1.0 - eta) * (1.0 + eta)) if law.contact == "elliptic" else 1.0
    assert -width <= low <= high + 1e-15
    assert high <= width


@examples(40)
@given(
    law=laws,
    x=st.one_of(st.sampled_from([0.0, 1.0]), magnitude(1e-12, 1e12)),
    gap=magnitude(1e-300, 1e-6),
)
def test_law_has_no_step(law: cl.CarterGriffith, x: float, gap: float) -> None:
    here, there = x * (1.0 - gap), x + gap * max(x, 1.0)
    (a, b), slopes = law.evaluate([here, there])
    # The slope has one extremum between, at most, and never exceeds that at rest by much.
    assert abs(b - a) <= max(2.5, 2.0 * np.abs(slopes).max()) * (there - here) + 1e-13


@examples(40)
@given(shape=shapes, x=magnitude(1e-12, 1e6), k=magnitude(1e-12, 1e-9))
def test_small_k_hat_is_coulomb_friction(shape: Any, x: float, k: float) -> None:
    # The difference is like the four fifths power of k_hat at most.
    table = cl.carter_griffith_table(shape)
    coulomb = cl.CarterGriffith(k_hat=0.0, contact=shape)
    solved = cl.CarterGriffith(k_hat=k, contact=shape).traction_ratio(x)
    for ratio in (solved, table.traction_ratio(x, k)):
        assert float(ratio) == pytest.approx(float(coulomb.traction_ratio(x)), abs=8.0 * k**0.8)


@examples(40)
@given(wheel=wheels, speed=speeds, x=creepages, near=magnitude(1e-12, 1e-7))
def test_force_has_no_step_at_rest_at_the_minimum_speed_or_anywhere(
    wheel: Wheel, speed: float, x: float, near: float
) -> None:
    element = wheel.element()
    omega = omega_at(element, x, speed)
    assume(abs(omega) < 1e8)
    zeta0 = element.saturation_creepage * element.friction.slip_rate_residual
    gap = min(near, 0.1 * zeta0) * max(abs(speed), element.minimum_speed)
    ends = element.evaluate(omega=omega, speed=[speed - gap, speed, speed + gap])
    steepest = np.abs(ends["force_gradient"]).max() / element.radius  # of the force by slip
    whole = element.friction.static * wheel.contact.wheel_load
    by_speed = steepest * (1.0 + abs(ends["creepage"][1])) + whole * (
        element.friction.slip_rate_decay + 1.0 / element.minimum_speed
    )
    by_speed += 3.0 * whole / (zeta0 * element.minimum_speed) * (gap / element.minimum_speed)
    steps = np.abs(np.diff(ends["creep_force"]))
    assert steps.max() <= 4.0 * by_speed * gap + 1e-11 * whole


@examples(40)
@given(wheel=wheels, factor=factors, x=creepages, speed=magnitude(0.1, 100.0))
def test_load_scales_the_contact_as_hertz_says(
    wheel: Wheel, factor: float, x: float, speed: float
) -> None:
    element = wheel.element()
    contact = wheel.contact
    name = "wheel_load" if isinstance(contact, cl.EllipticContact) else "normal_load_per_length"
    loaded = dataclasses.replace(contact, **{name: factor * getattr(contact, name)})
    exponent = contact.load_exponent
    k_hat = cl.laws.k_hat(loaded, element.friction)
    assert k_hat == pytest.approx(element.k_hat * factor**-exponent, rel=1e-9)
    zeta0 = cl.laws.saturation_creepage(loaded, element.friction)
    assert zeta0 == pytest.approx(element.saturation_creepage * factor**exponent, rel=1e-9)
    at_load = element.saturation_creepage_at(axle_load=loaded.wheel_load)
    assert at_load == pytest.approx(zeta0, rel=1e-9)
    assume(k_hat <= 1.99)
    other = element_of(loaded, element.friction)
    omega = omega_at(other, x, speed)
    assume(abs(omega) < 1e9)
    force = float(other.force(omega=omega, speed=speed))
    found_force = float(element.force(omega=omega, speed=speed, axle_load=loaded.wheel_load))
    slack = 1e-9 * other.friction.static * loaded.wheel_load
    assert found_force == pytest.approx(force, rel=1e-8, abs=slack)


@examples(40)
@given(wheel=wheels, scale=magnitude(1e-2, 10.0), x=creepages, speed=magnitude(0.1, 100.0))
def test_friction_scale_multiplies_both_coefficients(
    wheel: Wheel, scale: float, x: float, speed: float
) -> None:
    element = wheel.element()
    friction = dataclasses.replace(
        element.friction,
        static=scale * element.friction.static,
        kinetic=scale * element.friction.kinetic,
    )
    assume(cl.laws.k_hat(wheel.contact, friction) <= 1.99)
    other = element_of(wheel.contact, friction)
    omega = omega_at(other, x, speed)
    assume(abs(omega) < 1e9)
    force = float(other.force(omega=omega, speed=speed))
    scaled = float(element.force(omega=omega, speed=speed, friction_scale=scale))
    slack = 1e-10 * friction.static * wheel.contact.wheel_load
    assert scaled == pytest.approx(force, rel=1e-9, abs=slack)


@examples(40)
@given(
    law=laws,
    x=magnitude(1e-6, 1e6),
    near=number(-1e-3, 1e-3),
)
def test_peak_is_the_largest(law: cl.CarterGriffith, x: float, near: float) -> None:
    peak = law.peak
    places = np.array([x, peak.normalized_creepage * (1.0 + near), peak.normalized_creepage])
    ratios = law.traction_ratio(places)
    assert (ratios <= peak.traction_ratio * (1.0 + 1e-13)).all()
    assert ratios[2] == pytest.approx(peak.traction_ratio, rel=1e-13)


@examples(40)
@given(
    k_a=magnitude(1e-300, 1.0),
    slip=magnitude(1e-300, 1.0),
    x=magnitude(1e-12, 1e300),
)
def test_polach_never_exceeds_its_peak(k_a: float, slip: float, x: float) -> None:
    law = cl.Polach(
        adhesion_reduction=k_a,
        slip_reduction=slip,
    )
    ratio, peak = float(law.traction_ratio(x)), law.peak
    assert 0.0 <= ratio <= peak.traction_ratio * (1.0 + 1e-13)
    if math.isfinite(peak.normalized_creepage):
        top = float(law.traction_ratio(peak.normalized_creepage))
        assert top == pytest.approx(peak.traction_ratio, rel=1e-12)
