"""The largest creep force: closed forms, and a search over all creepages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from falling_friction import falling

import contactlib as cl

POLACH = cl.Polach(adhesion_reduction=0.9, slip_reduction=0.4)


def searched(element: cl.ForceElement, *, speed: float, load: float, scale: float) -> float:
    """Largest force of two million creepages."""
    zeta0 = element.saturation_creepage_at(normal_load=load, friction_scale=scale)
    near, far = np.linspace(0.0, 3.0, 1_500_001), np.geomspace(3.0, 1e8, 500_000)
    return max(
        float(
            element.at_creepage(zeta0 * x, speed=speed, normal_load=load, friction_scale=scale)[
                "creep_force"
            ].max()
        )
        for x in np.array_split(np.concatenate([near, far]), 20)
    )


@pytest.mark.parametrize("scale", [0.3, 1.0, 1.2])
@pytest.mark.parametrize("load", [0.5, 1.0, 1.4])
def test_it_is_the_laws_peak_where_friction_does_not_fall(
    rig: cl.Model, load: float, scale: float
) -> None:
    element = rig.wheelset.element
    weight = load * element.normal_load
    law = cl.CarterGriffith(k_hat=element.k_hat / np.sqrt(load * scale))
    expected = scale * element.friction.kinetic * weight * law.peak.traction_ratio
    found = cl.available_force(
        element, speed=[-3.0, 0.0, 0.01, 20.0], normal_load=weight, friction_scale=scale
    )
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_it_never_exceeds_static_friction(locomotive: cl.Model) -> None:
    element = locomotive.wheelset.element
    friction = cl.friction_with_k_hat(element.contact, k_hat=0.5, static=0.231, kinetic=0.21)
    with pytest.warns(cl.ProcessZoneWarning):
        limited = replace(element, friction=friction)
    found = cl.available_force(limited, speed=10.0)
    assert found == pytest.approx(friction.static * element.normal_load, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["line", "elliptic", "polach"])
def test_it_is_the_largest_of_many_where_friction_falls(law: str, locomotive: cl.Model) -> None:
    element = locomotive.wheelset.element
    if law == "polach":
        element = replace(element, table=cl.CreepForceTable.from_law(POLACH))
    elif law == "elliptic":
        contact = cl.EllipticContact.from_semi_axes(
            semi_axis_x=6e-3, semi_axis_y=9e-3, normal_load=110e3, contact_modulus=115e9
        )
        friction = cl.friction_with_k_hat(contact, k_hat=0.1, static=0.5, kinetic=0.25)
        table = cl.carter_griffith_table("elliptic")
        element = cl.ForceElement(contact, friction, table=table, radius=0.46, slope_reduction=0.3)
    rng = np.random.default_rng(5)
    for _ in range(3):
        case = {
            "speed": rng.uniform(0.2, 50.0),
            "load": element.normal_load * rng.uniform(0.5, 1.3),
            "scale": rng.uniform(0.3, 1.2),
        }
        residual = float(rng.choice([0.0, rng.uniform(0.1, 0.9)]))  # heat leaves none
        changed = falling(element, residual=residual, decay=rng.uniform(0.0, 2.0))
        found = cl.available_force(
            changed,
            speed=case["speed"],
            normal_load=case["load"],
            friction_scale=case["scale"],
        )
        expected = searched(changed, **case)
        assert found == pytest.approx(expected, rel=1e-9)
        assert found >= expected * (1.0 - 1e-12)


def test_faster_is_less_if_friction_falls_with_slip_speed(locomotive: cl.Model) -> None:
    for residual in (0.4, 0.0):
        element = falling(locomotive.wheelset.element, residual)
        found = cl.available_force(element, speed=np.array([[0.1, 1.0], [10.0, 40.0]]))
        assert found.shape == (2, 2)
        assert (np.diff(found.ravel()) < 0.0).all()


def test_braking_has_the_same_peak(locomotive: cl.Model) -> None:
    element = falling(locomotive.wheelset.element)
    zeta = -np.linspace(0.0, 0.05, 400_001)
    braking = element.at_creepage(zeta, speed=12.0)["creep_force"]
    found = cl.available_force(element, speed=12.0)
    assert found == pytest.approx(-braking.min(), rel=1e-9)


def test_a_law_that_rises_forever_has_its_limit(locomotive: cl.Model) -> None:
    law = cl.Polach(adhesion_reduction=0.5, slip_reduction=0.5)
    element = replace(locomotive.wheelset.element, table=cl.CreepForceTable.from_law(law))
    limit = element.friction.kinetic * element.normal_load
    assert cl.available_force(element, speed=10.0) == pytest.approx(limit, rel=1e-7)


def test_no_load_is_no_force_and_less_is_an_error(locomotive: cl.Model) -> None:
    element = locomotive.wheelset.element
    assert cl.available_force(element, speed=10.0, normal_load=0.0) == 0.0
    with pytest.raises(ValueError, match=r"normal_load = -1\.0 .*>= 0"):
        cl.available_force(element, speed=10.0, normal_load=-1.0)


@pytest.mark.parametrize("other", [0.3, 0.545, 0.9])
def test_wheels_that_turn_equally_are_not_both_at_their_peaks(rig: cl.Model, other: float) -> None:
    element = rig.wheelset.element
    found = cl.available_force(element, speed=12.0, other_friction_scale=other)
    creepage = np.linspace(0.0, 0.1, 400_001)
    sides = [
        element.at_creepage(creepage, speed=12.0, friction_scale=friction)["creep_force"]
        for friction in (1.0, other)
    ]
    assert found == pytest.approx(0.5 * (sides[0] + sides[1]).max(), rel=1e-9)
    assert found < 0.5 * (sides[0].max() + sides[1].max())
    assert found == cl.available_force(
        element, speed=12.0, friction_scale=other, other_friction_scale=1.0
    )
