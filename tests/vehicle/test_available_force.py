"""The largest creep force: closed forms; test_creep_curve.py has it on dense grids."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import contactlib as cl
from contactlib import kernel
from contactlib.vehicle import Drivetrain


@pytest.mark.parametrize("scale", [0.3, 1.0, 1.2])
@pytest.mark.parametrize("load", [0.5, 1.0, 1.4])
def test_it_is_the_laws_peak_where_friction_does_not_fall(
    rig: cl.Model, load: float, scale: float
) -> None:
    element = rig.wheelset.element
    weight = load * element.axle_load
    law = cl.CarterGriffith(k_hat=element.k_hat / np.sqrt(load * scale))
    expected = scale * element.friction.kinetic * weight * law.peak.traction_ratio
    force = cl.vehicle.available_force(
        element, speed=[-3.0, 0.0, 0.01, 20.0], axle_load=weight, friction_scale=scale
    )
    np.testing.assert_allclose(force, expected, rtol=1e-9)


def test_a_law_that_rises_forever_has_its_limit(locomotive: cl.Model) -> None:
    law = cl.Polach(adhesion_reduction=0.5, slip_reduction=0.5)
    element = replace(locomotive.wheelset.element, table=cl.CreepForceTable.from_law(law))
    limit = element.friction.kinetic * element.axle_load
    assert cl.vehicle.available_force(element, speed=10.0) == pytest.approx(limit, rel=1e-7)


MEASURED = """name = "measured"
source = "drawn"
[contact]
radius_x = 0.5
radius_y = 0.3
wheel_load = 110e3
youngs_modulus = 210e9
poisson_ratio = 0.3
[law]
kind = "measured"
file = "curve.csv"
[wheelset]
radius = 0.5
wheels = 2
inertia = 250.0
"""


@pytest.mark.filterwarnings("ignore:.*curve.csv")
@pytest.mark.parametrize("seed", range(5))
def test_dips_and_plateaus_of_a_measured_curve_hide_no_higher_part(
    seed: int, tmp_path: Path
) -> None:
    """Against a dense grid; rounding on a plateau is no turn, however often it changes sign."""
    creepage = [0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3]
    higher = np.random.default_rng(seed).uniform(0.1, 0.22, 3).round(3).tolist()
    coefficient = [0.12, 0.16, 0.17, 0.165, *(sorted(higher) if seed < 3 else higher)]
    lines = [f"{z},{mu}" for z, mu in zip(creepage, coefficient, strict=True)]
    (tmp_path / "curve.csv").write_text("\n".join(["creepage,traction_coefficient", *lines]))
    (tmp_path / "model.toml").write_text(MEASURED)
    wheelset = cl.load_model(tmp_path / "model.toml").wheelset
    grid = np.geomspace(1e-4, 1e6, 40_001)
    dense = wheelset.element.at_creepage(grid, speed=10.0)["creep_force"]
    force = cl.vehicle.available_force(wheelset.element, speed=10.0)
    assert force == pytest.approx(dense.max(), rel=1e-6)
    curve = cl.vehicle.CreepCurve(wheelset, speed=10.0)
    assert curve.turns.size <= 4
    assert curve.peak.creep_force == pytest.approx(float(force), rel=1e-14)


def test_no_load_is_no_force_and_less_is_an_error(locomotive: cl.Model) -> None:
    element = locomotive.wheelset.element
    assert cl.vehicle.available_force(element, speed=10.0, axle_load=0.0) == 0.0
    with pytest.raises(ValueError, match=r"axle_load = -1\.0 .*>= 0"):
        cl.vehicle.available_force(element, speed=10.0, axle_load=-1.0)


@pytest.mark.parametrize("other", [0.3, 0.545, 0.9])
def test_wheels_that_turn_equally_are_not_both_at_their_peaks(rig: cl.Model, other: float) -> None:
    element = rig.wheelset.element
    force = cl.vehicle.available_force(element, speed=12.0, other_friction_scale=other)
    creepage = np.linspace(0.0, 0.1, 400_001)
    sides = [
        element.at_creepage(creepage, speed=12.0, friction_scale=friction)["creep_force"]
        for friction in (1.0, other)
    ]
    assert force == pytest.approx(0.5 * (sides[0] + sides[1]).max(), rel=1e-9)
    assert force < 0.5 * (sides[0].max() + sides[1].max())
    assert force == cl.vehicle.available_force(
        element, speed=12.0, friction_scale=other, other_friction_scale=1.0
    )


@pytest.mark.parametrize("model", ["locomotive.toml", "rig", "polach", "heat"])
def test_neighbouring_peaks_have_the_bits_of_single_ones(model: str, rig: cl.Model) -> None:
    """Along drifting load, friction, slope and speed, with jumps and other wheels in between."""
    wheelset = (rig if model == "rig" else cl.load_model("locomotive.toml")).wheelset
    if model == "polach":
        law = cl.Polach(adhesion_reduction=0.5, slip_reduction=0.5)
        changed = replace(wheelset.element, table=cl.CreepForceTable.from_law(law))
        wheelset = replace(wheelset, element=changed)
    elif model == "heat":
        friction = wheelset.element.friction
        softens = replace(friction, slip_rate_decay=0.0, softening_temperature=500.0)
        wheelset = replace(wheelset, element=replace(wheelset.element, friction=softens))
    n, rng = 400, np.random.default_rng(2)
    load, scale, slope, speed = np.exp(np.clip(rng.normal(0.0, 0.05, (4, n)).cumsum(1), -2, 1))
    inputs = np.zeros(n, kernel.drivetrain_dtype("input"))
    inputs["load_left"] = inputs["load_right"] = 0.5 * wheelset.element.axle_load * load
    inputs["friction_left"], inputs["slope"] = scale, slope
    inputs["friction_right"] = scale * np.where(np.arange(n) % 100 < 20, 0.7, 1.0)
    inputs["load_left"][250:] *= 0.2
    member = Drivetrain(wheelset).member()
    fleet, one = kernel.NativeFleet([member]), np.zeros(1, dtype=np.intp)
    together = fleet.peak(inputs, 10.0 * speed, np.zeros(n, dtype=np.intp))
    alone = [fleet.peak(inputs[i : i + 1], 10.0 * speed[i : i + 1], one)[0] for i in range(n)]
    np.testing.assert_array_equal(together, alone)
