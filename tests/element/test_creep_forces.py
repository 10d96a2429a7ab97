"""Creep forces for vehicle tools: identities, symmetries, derivatives, the force element."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import contactlib as cl
from contactlib.element import AspectWarning

COULOMB = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
WEAKENING = cl.Friction(static=0.33, kinetic=0.21, weakening_length=1e-6)
FALLING = replace(WEAKENING, slip_rate_residual=0.4, slip_rate_decay=0.6)
HOT = replace(WEAKENING, softening_temperature=500.0)
G, NU = 82e9, 0.28
FORCES = ("force_x", "force_y", "spin_moment")


def bodies_of(friction: cl.Friction) -> cl.CreepForces:
    return cl.CreepForces(friction, shear_modulus=G, poisson_ratio=NU)


def cases(n: int, **fixed: float) -> dict[str, Any]:
    random = np.random.default_rng(5)
    return {
        "semi_axis_x": random.uniform(4e-3, 8e-3, n),
        "semi_axis_y": random.uniform(4e-3, 8e-3, n),
        "normal_load": random.uniform(3e4, 1e5, n),
        "creepage_x": 2e-3 * random.normal(size=n),
        "creepage_y": 2e-3 * random.normal(size=n),
        "spin": 0.4 * random.normal(size=n),
        **{name: np.full(n, value) for name, value in fixed.items()},
    }


@pytest.mark.parametrize(
    ("friction", "within"), [(COULOMB, 1e-6), (WEAKENING, 1e-6), (FALLING, 1e-5), (HOT, 1e-5)]
)
def test_derivatives_are_those_of_the_forces(friction: cl.Friction, within: float) -> None:
    bodies, given = bodies_of(friction), cases(300)
    given["speed"] = np.random.default_rng(4).uniform(2.0, 60.0, 300)
    here = bodies.evaluate(**given)
    for name, step in (("creepage_x", 1e-7), ("creepage_y", 1e-7), ("spin", 1e-5)):
        ahead, behind = (
            bodies.evaluate(**{**given, name: given[name] + sign * step}) for sign in (1, -1)
        )
        for force in FORCES:
            difference = (ahead[force] - behind[force]) / (2.0 * step)
            derivative = here[f"{force.removeprefix('spin_')}_by_{name}"]
            assert np.abs(derivative - difference).max() < within * np.abs(difference).max()


@pytest.mark.parametrize("friction", [COULOMB, WEAKENING])
def test_a_contact_alone_gives_the_same_bits_as_among_many(friction: cl.Friction) -> None:
    bodies, given = bodies_of(friction), cases(40)
    given["spin"][::3] = 0.0
    given["normal_load"][::7] = 0.0
    singles = [bodies.evaluate(**{name: v[i] for name, v in given.items()}) for i in range(40)]
    assert np.array(singles).tobytes() == bodies.evaluate(**given).tobytes()


def test_nothing_comes_of_nothing() -> None:
    given = cases(10)
    for changed in ({"normal_load": 0.0}, {"friction_scale": 0.0}):
        outputs = bodies_of(WEAKENING).evaluate(**{**given, **changed})
        assert all(not outputs[name].any() for name in FORCES)
    given["semi_axis_x"][2:5] = given["semi_axis_y"][2:5] = given["normal_load"][2:5] = 0.0
    given["friction_scale"] = np.where(np.arange(10) == 7, -1e-9, 1.0)
    outputs, force = bodies_of(WEAKENING).evaluate(**given), np.ones(10, dtype=bool)
    force[[2, 3, 4, 7]] = False  # in the air, and without friction
    assert all(((outputs[name] != 0.0) == force).all() for name in FORCES)
    still = bodies_of(WEAKENING).evaluate(**cases(10, creepage_x=0.0, creepage_y=0.0, spin=0.0))
    assert all(not still[name].any() for name in FORCES)
    assert all(np.isfinite(still[name]).all() for name in still.dtype.names or ())


def test_what_was_not_checked_is_reported() -> None:
    bodies = bodies_of(COULOMB)
    with pytest.warns(AspectWarning, match="outside 1/8"):
        bodies.evaluate(semi_axis_x=9e-3, semi_axis_y=1e-3, normal_load=1e4)
    table = cl.carter_griffith_table("line")
    with pytest.raises(ValueError, match="must be the table of an ellipse"):
        cl.CreepForces(COULOMB, shear_modulus=G, poisson_ratio=NU, table=table)
    falling = cl.Friction(
        static=0.3, kinetic=0.3, weakening_length=0.0, slip_rate_residual=0.4, slip_rate_decay=0.6
    )
    bodies = cl.CreepForces(falling, shear_modulus=G, poisson_ratio=NU)
    with pytest.raises(ValueError, match="speed is missing: friction falls with slip speed"):
        bodies.evaluate(semi_axis_x=5e-3, semi_axis_y=5e-3, normal_load=1e4)


def measured(whole: cl.ForceElement) -> cl.ForceElement:
    zeta = np.linspace(0.002, 0.15, 20)
    mu = 0.3 * np.tanh(zeta / 0.008) * (0.55 + 0.45 * np.exp(-zeta / 0.05))
    curve = cl.MeasuredCurve(zeta, mu, name="my.csv")
    assert isinstance(whole.contact, cl.EllipticContact)
    return cl.ForceElement.from_curve(curve, whole.contact, radius=0.5)


def with_friction(friction: cl.Friction) -> Callable[[cl.ForceElement], cl.ForceElement]:
    return lambda whole: replace(whole, friction=friction, slope_reduction=1.0, wheels=1.0)


ELEMENTS: dict[str, tuple[Callable[[cl.ForceElement], cl.ForceElement], float]] = {
    "Coulomb": (with_friction(COULOMB), 1e-7),
    "weakening": (with_friction(WEAKENING), 1e-7),
    "falls with speed": (with_friction(FALLING), 1e-7),
    "falls with heat": (with_friction(HOT), 1e-7),
    # A third body lowers stiffness but leaves k_hat.
    "third body": (lambda whole: replace(whole, wheels=1.0), 1e-7),
    "measured": (measured, 2e-7),
}


@pytest.mark.parametrize("name", ELEMENTS)
def test_the_bodies_of_an_element_have_its_force(name: str, locomotive: cl.Model) -> None:
    make, within = ELEMENTS[name]
    element, rng, n = make(locomotive.wheelset.element), np.random.default_rng(4), 60
    contact, bodies = element.contact, cl.CreepForces.of(element)
    assert isinstance(contact, cl.EllipticContact)
    assert (element.slope_reduction < 0.5) == (name in ("third body", "measured"))
    load, speed = rng.uniform(0.5, 1.5, n), rng.uniform(2.0, 60.0, n)
    xi, eta, phi = rng.normal(0.0, [[0.02], [0.01], [1.0]], (3, n))
    eta[:10] = phi[:20] = 0.0
    computed = bodies.evaluate(
        semi_axis_x=np.cbrt(load) * contact.semi_axis_x,
        semi_axis_y=np.cbrt(load) * contact.semi_axis_y,
        normal_load=load * contact.wheel_load,
        friction_scale=0.8,
        speed=speed,
        creepage_x=xi,
        creepage_y=eta,
        spin=phi,
    )
    expected = element.evaluate(
        omega=(1.0 - xi) * speed / element.radius,
        speed=speed,
        axle_load=load * contact.wheel_load,
        friction_scale=0.8,
        lateral_velocity=eta * speed,
        spin_velocity=phi * speed,
    )
    for force, output in zip(FORCES, ("creep_force", "lateral_force", "spin_moment"), strict=True):
        size = np.abs(expected[output]).max()
        np.testing.assert_allclose(computed[force], expected[output], atol=within * size)


def test_a_line_has_no_bodies_of_an_ellipse(rig: cl.Model) -> None:
    with pytest.raises(ValueError, match="an ellipse on the half-space"):
        cl.CreepForces.of(rig.wheelset.element)
