"""The force element across rolling and in spin: linear theory, symmetries, power, continuity."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import contactlib as cl
from contactlib.element import AspectWarning

E, NU, A, B, LOAD, RADIUS, SPEED = 210e9, 0.28, 7.0e-3, 5.0e-3, 100e3, 0.5, 20.0
G = E / (2.0 * (1.0 + NU))


def element_of(nu: float = NU, k_hat: float = 0.3, **friction: float) -> cl.ForceElement:
    contact = cl.EllipticContact.from_semi_axes(
        semi_axis_x=A,
        semi_axis_y=B,
        wheel_load=LOAD,
        contact_modulus=E / (2.0 * (1.0 - NU**2)),
        poisson_ratio=nu,
    )
    made = cl.friction_with_k_hat(contact, k_hat=k_hat, static=0.45, kinetic=0.21, **friction)
    return cl.ForceElement(contact, made, table=cl.carter_griffith_table("elliptic"), radius=RADIUS)


def cases(n: int = 500) -> dict[str, Any]:
    random = np.random.default_rng(7)
    speed = random.choice([-1.0, 1.0], n) * 10.0 ** random.uniform(-2.0, 1.7, n)
    slip = np.maximum(np.abs(speed), 0.1)
    return {
        "omega": (speed + 4e-3 * slip * random.normal(size=n)) / RADIUS,
        "speed": speed,
        "axle_load": LOAD * random.uniform(0.1, 2.0, n),
        "friction_scale": random.uniform(0.3, 1.2, n),
        "lateral_velocity": 4e-3 * slip * random.normal(size=n),
        "spin_velocity": 0.5 * slip * random.normal(size=n),
    }


def test_small_slip_gives_kalkers_linear_theory() -> None:
    c = cl.laws.kalker_coefficients(A / B, NU)
    xi, eta, phi = -2e-9, 3e-9, 4e-7  # Kalker's signs
    outputs = element_of().evaluate(
        omega=(1.0 - xi) * SPEED / RADIUS,
        speed=SPEED,
        lateral_velocity=eta * SPEED,
        spin_velocity=phi * SPEED,
    )
    ab, root = A * B, (A * B) ** 1.5
    expected = {
        "creep_force": -G * ab * c.c11 * xi,
        "lateral_force": -G * (ab * c.c22 * eta + root * c.c23 * phi),
        "spin_moment": G * (root * c.c23 * eta - ab**2 * c.c33 * phi),
    }
    for name, value in expected.items():
        assert outputs[name] == pytest.approx(value, rel=5e-3)  # of the spline


FALLS = [{"slip_rate_residual": 0.4, "slip_rate_decay": 0.6}, {"softening_temperature": 500.0}]


@pytest.mark.parametrize("fall", FALLS)
def test_mirror_images_and_backward_rolling_are_exact(
    fall: dict[str, float],
) -> None:
    element, given = element_of(**fall), cases()
    here = element.evaluate(**given)
    side = {name: -given[name] for name in ("lateral_velocity", "spin_velocity")}
    back = {name: -given[name] for name in ("omega", "speed", "lateral_velocity")}
    for changed, signs in ((side, (1, -1, -1)), (back, (-1, -1, 1))):
        there = element.evaluate(**{**given, **changed})
        for name, sign in zip(("creep_force", "lateral_force", "spin_moment"), signs, strict=True):
            np.testing.assert_array_equal(there[name], sign * here[name])


@pytest.mark.parametrize("fall", FALLS)
def test_slip_loses_power_and_force_stays_below_static_friction(
    fall: dict[str, float],
) -> None:
    element, given = element_of(**fall), cases(20000)
    out = element.evaluate(**given)
    power = (
        out["creep_force"] * (RADIUS * given["omega"] - given["speed"])
        - out["lateral_force"] * given["lateral_velocity"]
        - out["spin_moment"] * given["spin_velocity"]
    )
    assert (power >= 0.0).all()
    size = np.hypot(out["creep_force"], out["lateral_force"])
    assert (size <= 0.45 * given["friction_scale"] * given["axle_load"] * (1.0 + 1e-12)).all()


def test_friction_falls_with_the_magnitude_of_slip() -> None:
    element = element_of(k_hat=0.0, slip_rate_residual=0.4, slip_rate_decay=0.6)
    slip, angle = np.array([1.0, 2.0, 5.0]), 0.7
    out = element.evaluate(
        omega=(SPEED + slip * np.cos(angle)) / RADIUS,
        speed=SPEED,
        lateral_velocity=-slip * np.sin(angle),
    )
    expected = 0.21 * LOAD * (0.6 * np.exp(-0.6 * slip) + 0.4)
    np.testing.assert_allclose(np.hypot(out["creep_force"], out["lateral_force"]), expected)
    # Spin alone slips, too: at the root mean square distance from the centre.
    fast = element.evaluate(omega=SPEED / RADIUS, speed=SPEED, spin_velocity=300.0)
    slow = element.evaluate(omega=SPEED / RADIUS, speed=SPEED, spin_velocity=1e-6)
    rubbing = 300.0 * np.sqrt((A**2 + B**2) / 5.0)
    fall = 0.6 * np.exp(-0.6 * rubbing) + 0.4
    assert fast["saturation_creepage"] / slow["saturation_creepage"] == pytest.approx(fall)


@pytest.mark.parametrize("fall", FALLS)
@pytest.mark.parametrize("k_hat", [0.0, 0.3])
def test_lateral_and_spin_force_begins_smoothly(k_hat: float, fall: dict[str, float]) -> None:
    element = element_of(k_hat=k_hat, **fall)
    zeta = element.saturation_creepage * np.array([-3.0, -0.5, 0.2, 0.9, 1.2, 4.0])
    without: Any = element.at_creepage(zeta, speed=SPEED)
    for tiny in (1e-7, -1e-7):
        with_it: Any = element.at_creepage(
            zeta, speed=SPEED, lateral_velocity=tiny, spin_velocity=100.0 * tiny
        )
        for name in without.dtype.fields or ():
            if not name.startswith(("lateral", "spin")):
                scale = np.abs(without[name]).max()
                np.testing.assert_allclose(with_it[name], without[name], atol=1e-4 * scale)
        assert (np.abs(with_it["lateral_force"]) < 1e-3 * LOAD).all()


def test_no_load_no_friction_and_no_slip_are_finite() -> None:
    element = element_of()
    moving = {"lateral_velocity": 0.1, "spin_velocity": 1.0}
    for given in (
        {"omega": 40.0, "speed": 20.0, "axle_load": 0.0},
        {"omega": 40.0, "speed": 20.0, "friction_scale": 1e-6},
        {"omega": 0.0, "speed": 0.0},
        {"omega": 1.0, "speed": 0.5, "axle_load": 1e-90},
    ):
        out = element.evaluate(**given, **moving)
        assert all(np.isfinite(out[name]).all() for name in out.dtype.fields or ())
    # A load that begins rubs in the direction of the slip.
    begins = element.evaluate(omega=40.1, speed=20.0, axle_load=0.0, lateral_velocity=-0.05)
    light = element.evaluate(omega=40.1, speed=20.0, axle_load=1e-3, lateral_velocity=-0.05)
    assert light["creep_force"] / 1e-3 == pytest.approx(begins["force_by_load"], rel=1e-3)
    assert light["lateral_force"] == pytest.approx(light["creep_force"], rel=1e-3)


def test_a_line_has_lateral_slip_but_no_spin(rig: cl.Model) -> None:
    element = rig.wheelset.element
    slip = 1e-6 * SPEED * element.saturation_creepage
    out = element.evaluate(omega=SPEED / RADIUS, speed=SPEED, lateral_velocity=-slip)
    along = element.force(omega=(SPEED + slip) / RADIUS, speed=SPEED)
    assert out["lateral_force"] == pytest.approx(0.7 * along)  # 1 - nu
    wild = element.evaluate(omega=SPEED / RADIUS, speed=SPEED, lateral_velocity=-5.0)
    assert wild["lateral_force"] == pytest.approx(0.21 * element.axle_load, rel=1e-3)
    with pytest.raises(ValueError, match=r"spin_velocity = 1\.0 must be 0: it needs an ellipse"):
        element.evaluate(omega=SPEED / RADIUS, speed=SPEED, spin_velocity=1.0)


def test_an_ellipse_beyond_the_checked_range_warns() -> None:
    contact = cl.EllipticContact.from_semi_axes(
        semi_axis_x=1e-3, semi_axis_y=9e-3, wheel_load=LOAD, contact_modulus=1e11
    )
    friction = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    with pytest.warns(AspectWarning, match=r"semi_axis_x/semi_axis_y = 0\.1111, outside 1/8"):
        cl.ForceElement(contact, friction, table=cl.carter_griffith_table("elliptic"), radius=0.5)


def test_an_ellipse_of_eight_to_rounding_does_not_warn() -> None:
    contacts = (
        cl.EllipticContact.from_semi_axes(
            semi_axis_x=8.0 * b, semi_axis_y=b, wheel_load=12e3, contact_modulus=189e9
        )
        for b in np.linspace(1e-3, 4e-3, 200).tolist()
    )
    contact = next(
        ellipse for ellipse in contacts if ellipse.semi_axis_x / ellipse.semi_axis_y > 8.0
    )
    axes = {"semi_axis_x": contact.semi_axis_x, "semi_axis_y": contact.semi_axis_y}
    friction = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    table = cl.carter_griffith_table("elliptic")
    element = cl.ForceElement(contact, friction, table=table, radius=0.5)
    assert element.evaluate(omega=20.0, speed=10.0, spin_velocity=1.0)["spin_moment"] != 0.0
    outputs = cl.CreepForces.of(element).evaluate(**axes, normal_load=12e3)
    assert outputs["aspect_limited"] == 0.0
