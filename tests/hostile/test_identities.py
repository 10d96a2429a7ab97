"""What holds of every contact, whatever its material, load, speed and friction."""

from __future__ import annotations

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
