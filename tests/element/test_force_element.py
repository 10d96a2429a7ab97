"""The force element: signs, limits, derivatives, scaling with load and friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from falling_friction import falling

import contactlib as cl

SPEED = 10.0


@pytest.fixture(scope="module")
def element(rig: cl.Model) -> cl.ForceElement:
    return rig.wheelset.element


def test_agrees_with_the_law(element: cl.ForceElement) -> None:
    # The law in Python is independent of the kernel: a second solution for the whole chain.
    zeta = np.linspace(-0.1, 0.1, 501)
    record = element.at_creepage(zeta, speed=SPEED)
    law = cl.CarterGriffith(k_hat=0.3)
    expected = 0.21 * 220.65e3 * law.traction_ratio(zeta / 0.015)
    np.testing.assert_allclose(record["creep_force"], expected, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(record["traction_coefficient"] * 220.65e3, record["creep_force"])
    np.testing.assert_allclose(record["wheel_torque"], -0.5 * record["creep_force"])
    np.testing.assert_array_equal(record["falling_branch"], law.slope(zeta / 0.015) < 0.0)


def test_sign_convention(element: cl.ForceElement) -> None:
    assert element.force(omega=1.01 * SPEED / 0.5, speed=SPEED) > 0.0
    assert element.force(omega=0.99 * SPEED / 0.5, speed=SPEED) < 0.0
    assert element.force(omega=SPEED / 0.5, speed=SPEED) == 0.0


def test_no_load_no_force(element: cl.ForceElement) -> None:
    record = element.evaluate(omega=[0.0, 30.0], speed=[0.0, 10.0], axle_load=0.0)
    np.testing.assert_array_equal(record["creep_force"], 0.0)
    np.testing.assert_array_equal(record["force_gradient"], 0.0)
    for name in record.dtype.names or ():
        assert np.isfinite(record[name]).all()
    tiny, tinier = element.evaluate(omega=30.0, speed=10.0, axle_load=[1e-90, 1e-300])
    assert 0.0 < tiny["creep_force"] < 1e-89
    assert tinier["creep_force"] == 0.0  # next to no load counts as zero


def test_speed_is_regularised_twice_differentiably(element: cl.ForceElement) -> None:
    # Over the border at minimum_speed value and gradient of the creepage join.
    v, h = element.minimum_speed, 1e-9
    for field in ("creep_force", "force_by_omega", "force_by_speed"):
        low, high = (
            element.evaluate(omega=2.0 * v * 1.002, speed=v + side * h)[field] for side in (-1, 1)
        )
        assert low == pytest.approx(float(high), rel=1e-4)
    flags = element.evaluate(omega=1.0, speed=[0.0, 0.09, 0.1, -0.2])["speed_regularized"]
    np.testing.assert_array_equal(flags, [1.0, 1.0, 0.0, 0.0])
    assert np.isfinite(element.force(omega=3.0, speed=0.0))


def test_k_hat_is_held_at_the_table_s_end_and_reports_it(element: cl.ForceElement) -> None:
    record = element.evaluate(omega=20.1, speed=10.0, axle_load=220.65e3 * np.array([1.0, 1e-3]))
    np.testing.assert_allclose(record["k_hat"], [0.3, 2.0])
    np.testing.assert_array_equal(record["k_hat_limited"], [0.0, 1.0])


def test_arguments_broadcast(element: cl.ForceElement) -> None:
    omega, load = 20.0 + 0.1 * np.arange(4.0)[:, np.newaxis], np.array([1e5, 2e5, 3e5])
    force = element.force(omega=omega, speed=10.0, axle_load=load)
    assert force.shape == (4, 3)
    expected = [[element.force(omega=w, speed=10.0, axle_load=p) for p in load] for (w,) in omega]
    np.testing.assert_array_equal(force, expected)
    with pytest.raises(ValueError, match="broadcast"):
        element.force(omega=np.zeros(2), speed=np.ones(3))
    assert element.force(omega=20, speed=10).shape == ()
    assert element.force(omega=np.zeros((0,)), speed=10.0).shape == (0,)


@pytest.mark.parametrize("residual", [1.0, 0.4, 0.0])
@pytest.mark.parametrize("kind", ["line", "ellipse", "layer", "measured"])
def test_a_force_has_the_same_bits_alone_among_many_and_among_the_outputs(
    element: cl.ForceElement, locomotive: cl.Model, kind: str, residual: float
) -> None:
    if kind == "layer":
        element = replace(locomotive.wheelset.element, layer_compliance=1e-13)
    elif kind == "ellipse":
        element = locomotive.wheelset.element
    elif kind == "measured":
        if residual != 1.0:
            pytest.skip("a measured curve contains the fall of its friction")
        zeta = np.linspace(0.001, 0.1, 41)
        curve = cl.MeasuredCurve(zeta, 0.3 * np.tanh(zeta / 0.01) * np.exp(-zeta / 0.2))
        element = cl.ForceElement.from_curve(curve, element.contact, radius=element.radius)
    element = falling(element, residual) if residual < 1.0 else element
    random = np.random.default_rng(3)
    omega, speed = random.uniform(-30.0, 30.0, 200), random.uniform(-15.0, 15.0, 200)
    omega[100:] = speed[100:] / element.radius * random.uniform(0.97, 1.03, 100)
    load, scale = random.uniform(0.0, 3e5, 200), random.uniform(1e-6, 2.0, 200)
    load[0] = 0.0
    one_by_one = [
        element.force(omega=w, speed=v, axle_load=p, friction_scale=s)
        for w, v, p, s in zip(*(a.tolist() for a in (omega, speed, load, scale)), strict=True)
    ]
    assert all(type(force) is np.ndarray and force.shape == () for force in one_by_one)
    given = {"omega": omega, "speed": speed, "axle_load": load, "friction_scale": scale}
    together = element.force(**given)
    assert np.array(one_by_one).tobytes() == together.tobytes()
    outputs = element.evaluate(**given)
    assert outputs["creep_force"].tobytes() == together.tobytes()


def test_k_hat_beyond_the_table_is_refused(table: cl.CreepForceTable) -> None:
    contact = cl.LineContact(normal_load_per_length=4.5e6, radius=0.5, contact_modulus=115e9)
    friction = cl.friction_with_k_hat(contact, k_hat=1.25, static=0.9, kinetic=0.21)
    friction = replace(friction, weakening_length=4.0 * friction.weakening_length)
    with pytest.raises(ValueError, match=r"k_hat = 2\.\d+.*<= 2\.0"):
        cl.ForceElement(contact, friction, table=table, radius=0.5)


NO_FALL = (1.0, 0.0)
SLIP_RATES = [(0.4, 0.6), (0.05, 3.0), (1e-3, 20.0)]


@pytest.mark.parametrize(("residual", "decay"), [(1.0, 0.6), (0.4, 0.0)])
def test_no_fall_with_slip_speed_changes_nothing(
    element: cl.ForceElement, residual: float, decay: float
) -> None:
    random = np.random.default_rng(7)
    omega, speed = random.uniform(-60.0, 60.0, 5000), random.uniform(-20.0, 20.0, 5000)
    there = element.evaluate(omega=omega, speed=speed)
    here = falling(element, residual, decay).evaluate(omega=omega, speed=speed)
    np.testing.assert_array_equal(here, there)


@pytest.mark.parametrize(("residual", "decay"), SLIP_RATES)
def test_slip_speed_scales_force_creepage_and_k_hat(
    element: cl.ForceElement, residual: float, decay: float
) -> None:
    # Q = f_d g P q(x/g, K/sqrt(g)), by the law in Python.
    weak = falling(element, residual, decay)
    for zeta in (-0.03, 0.001, 0.01, 0.017, 0.1, 3.0):
        record = weak.at_creepage(zeta, speed=SPEED)
        g = (1.0 - residual) * np.exp(-decay * abs(zeta) * SPEED) + residual
        k_hat = min(0.3 / np.sqrt(g), 2.0)
        law = cl.CarterGriffith(k_hat=float(k_hat))
        limited = min(abs(law.traction_ratio(zeta / 0.015 / g)), element.friction.ratio)
        expected = np.copysign(0.21 * g * 220.65e3 * limited, zeta)
        np.testing.assert_allclose(record["creep_force"], expected, rtol=1e-9)
        assert record["k_hat"] == pytest.approx(k_hat)
        assert record["saturation_creepage"] == pytest.approx(0.015 * g)
        assert weak.friction.slip_rate_factor(zeta * SPEED) == pytest.approx(g, rel=1e-14)


@pytest.mark.parametrize(("residual", "decay"), [NO_FALL, *SLIP_RATES])
@pytest.mark.parametrize("speed", [10.0, -10.0, 0.3, 0.05, -0.02, 0.0])
@pytest.mark.filterwarnings("ignore::contactlib.element.ProcessZoneWarning")
def test_partial_derivatives(speed: float, residual: float, decay: float) -> None:
    # Low static friction and a wide range of loads: both limits are met, and the elastic range.
    contact = cl.EllipticContact.from_semi_axes(
        semi_axis_x=6e-3, semi_axis_y=9e-3, wheel_load=1e5, contact_modulus=115e9
    )
    friction = cl.friction_with_k_hat(contact, k_hat=0.7, static=0.33, kinetic=0.21)
    table = cl.carter_griffith_table("elliptic")
    element = cl.ForceElement(contact, friction, table=table, radius=0.5)
    element, random, n = falling(element, residual, decay), np.random.default_rng(9), 3000
    slip = 10.0 ** random.uniform(-4.0, 1.0, n) * random.choice([-1.0, 1.0], n)
    slip *= max(abs(speed), 0.1)
    load = 10.0 ** random.uniform(0.0, 6.0, n)
    given = {"omega": (speed + slip) / 0.5, "speed": np.full(n, speed), "axle_load": load}
    here = element.evaluate(**given)
    assert {0.0, 1.0} == set(here["k_hat_limited"]) == set(here["force_limited"])
    force = np.maximum(np.abs(here["creep_force"]), 1e-3 * 0.21 * load)
    for name, size in (("omega", slip / 0.5), ("speed", slip), ("axle_load", load)):
        h = 1e-4 * np.abs(size)
        sides = [element.evaluate(**{**given, name: given[name] + i * h}) for i in (-2, -1, 1, 2)]
        f = [side["creep_force"] for side in sides]
        difference = (f[0] - 8.0 * f[1] + 8.0 * f[2] - f[3]) / (12.0 * h)
        smooth = np.ones(n, bool)  # neither limit begins nor ends between the points
        for flag in ("k_hat_limited", "force_limited"):
            smooth &= (sides[0][flag] == here[flag]) & (sides[-1][flag] == here[flag])
        derivative = here[f"force_by_{name.removeprefix('axle_')}"]
        error = np.abs(derivative - difference) * h / (1e-4 * force)
        assert smooth.mean() > 0.95
        assert error[smooth].max() < 1e-6
    np.testing.assert_allclose(here["force_by_omega"], 0.5 * here["force_gradient"], rtol=1e-14)
    np.testing.assert_array_equal(here["falling_branch"], here["force_gradient"] < 0.0)
