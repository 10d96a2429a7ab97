"""A layer in the force element: table, load, vehicles, and exported contacts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.element import CreepForces
from contactlib.export.description import Description
from contactlib.table.creep_force_table import CreepForceTable

L = 1.3e-13  # 20 um of 150 MPa
STRIPS = cl.EllipticContact.from_semi_axes(
    semi_axis_x=6e-3, semi_axis_y=9e-3, wheel_load=90e3, contact_modulus=115e9, theory="strips"
)
FRICTION = cl.friction_with_k_hat(STRIPS, k_hat=0.1, static=0.45, kinetic=0.3)


def wheel_with_layer(contact: cl.EllipticContact = STRIPS, **others: Any) -> cl.ForceElement:
    table = cl.carter_griffith_table("elliptic")
    return cl.ForceElement(
        contact, FRICTION, table=table, radius=0.5, **{"layer_compliance": L, **others}
    )


@pytest.mark.parametrize("contact", ["line", "elliptic"])
def test_shipped_table_is_the_law_with_a_layer(contact: str) -> None:
    table = cl.carter_griffith_table(contact)
    assert 0.0 < table.max_layer_error < 1e-6
    rng = np.random.default_rng(3)
    for _ in range(12):
        k_hat, layer = 2.0 * rng.random() ** 2, 10.0 ** rng.uniform(-6.0, 3.0)
        law = cl.CarterGriffith(k_hat=k_hat, contact=contact, layer_ratio=layer)  # type: ignore[arg-type]
        x = (1.0 + layer) * 10.0 ** rng.uniform(-3.0, 2.0, 30)
        ratio, slope = table.evaluate(x, k_hat, layer)
        assert_allclose(ratio, law.traction_ratio(x), atol=2.0 * table.max_layer_error)
        assert_allclose(slope, law.slope(x), atol=2e-4)
    for k_hat in (0.0, 1e-100, 0.3):
        law = cl.CarterGriffith(k_hat=k_hat, contact=contact, layer_ratio=0.1)  # type: ignore[arg-type]
        assert_allclose(table.slope([0.0, 1e-200, 1e-12], k_hat, 0.1), law.slope(0.0), rtol=1e-5)
    cut = table.without_layers()
    with pytest.raises(ValueError, match="layer_ratio"):
        cut.traction_ratio(0.5, 0.3, 0.1)
    x = np.geomspace(1e-3, 1e3, 50)
    assert_allclose(cut.traction_ratio(x, 0.3), table.traction_ratio(x, 0.3), rtol=0.0, atol=0.0)


def test_layer_ratio_falls_as_the_contact_grows_with_load() -> None:
    element, zeta = wheel_with_layer(), np.geomspace(1e-4, 0.1, 7)
    for share in (0.1, 1.0, 4.0):
        load = share * STRIPS.wheel_load
        a = STRIPS.semi_width * share ** (1.0 / 3.0)
        outputs = element.at_creepage(zeta, speed=10.0, axle_load=load)
        law = cl.CarterGriffith(
            k_hat=float(outputs["k_hat"][0]),
            contact="elliptic",
            layer_ratio=L * STRIPS.tangential_modulus / (2.0 * a),
        )
        ratio = law.traction_ratio(zeta / outputs["saturation_creepage"])
        assert_allclose(outputs["traction_coefficient"], 0.3 * ratio, atol=1e-6)


def test_no_layer_is_the_limit_of_a_thin_one() -> None:
    zeta = np.geomspace(1e-5, 0.1, 30)
    contact = replace(STRIPS, theory="half_space")
    clean = wheel_with_layer(contact, layer_compliance=0.0).at_creepage(zeta, speed=10.0)
    thin = wheel_with_layer(contact, layer_compliance=1e-22).at_creepage(zeta, speed=10.0)
    # The softening counts slip a little differently: smooth at its end, or not.
    assert_allclose(thin["traction_coefficient"], clean["traction_coefficient"], atol=0.3 * 0.002)


def test_layers_need_a_table_with_layers() -> None:
    table = cl.carter_griffith_table("elliptic").without_layers()
    with pytest.raises(ValueError, match=r"layer_compliance = 1\.3e-13 must be 0"):
        cl.ForceElement(STRIPS, FRICTION, table=table, radius=0.5, layer_compliance=L)
    with pytest.raises(ValueError, match=r"CreepForces\.layer_compliance = 1\.3e-13 must be 0"):
        CreepForces(
            FRICTION, shear_modulus=82e9, poisson_ratio=0.28, layer_compliance=L, table=table
        )


@pytest.mark.parametrize(
    ("kind", "keys", "layer", "message"),
    [
        ("measured", "file = 'a.csv'", 1e-13, "the curve contains the layer of the rail on which"),
        ("polach", "adhesion_reduction = 1\nslip_reduction = 0.4", 1e-13, "set slope_reduction in"),
        (
            "cohesive",
            "",
            0.0,
            r"law\.kind = 'cohesive' has k_hat up to 1\.596 .* give 1\.9[0-9]+: ",
        ),
    ],
)
def test_what_a_law_lacks_is_refused_before_its_table_is_built(
    kind: str,
    keys: str,
    layer: float,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def built(*given: object, **named: object) -> None:
        raise AssertionError

    monkeypatch.setattr(CreepForceTable, "from_law", built)
    path = tmp_path / "wheel.toml"
    path.write_text(
        "[contact]\nsemi_axis_x = 0.0063\nsemi_axis_y = 0.0051\nwheel_load = 110e3\n"
        "youngs_modulus = 210e9\npoisson_ratio = 0.28\n"
        "[friction]\nstatic = 0.36\nkinetic = 0.27\nweakening_length = 650e-6\n"
        f"[wheelset]\nradius = 0.46\nlayer_compliance = {layer}\n[law]\nkind = '{kind}'\n{keys}\n"
    )
    with pytest.raises(cl.ModelError, match=message):
        cl.load_model(path)


@pytest.mark.parametrize("compliance", [0.0, 1e-13])
def test_a_model_file_builds_the_cohesive_table_that_it_needs(
    compliance: float,
    cohesive_table: CreepForceTable,
    layered_cohesive_table: CreepForceTable,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def built(*given: object, layers: bool) -> CreepForceTable:
        return layered_cohesive_table if layers else cohesive_table

    monkeypatch.setattr("contactlib.files.sections.cohesive_table", built)
    path = tmp_path / "rig.toml"
    path.write_text(
        "[contact]\nsemi_width = 5e-3\nradius = 0.5\nwheel_load = 110e3\nyoungs_modulus = 210e9\n"
        "poisson_ratio = 0.3\n[friction]\nstatic = 0.45\nkinetic = 0.21\nk_hat = 0.3\n"
        f"[wheelset]\nradius = 0.5\nlayer_compliance = {compliance}\n[law]\nkind = 'cohesive'\n"
    )
    element = cl.load_model(path).wheelset.element
    at = element.at_creepage(0.003, speed=10.0)
    x, table = at["normalized_creepage"], layered_cohesive_table
    ratio = table.traction_ratio(x, element.k_hat, element.layer_ratio)
    assert element.layer_ratio == pytest.approx(compliance * 115.4e9 / 0.01, rel=1e-3)
    assert at["traction_coefficient"] == pytest.approx(0.21 * ratio, rel=1e-12)
    if compliance == 0.0:
        with pytest.raises(ValueError, match=r"has no layers; build it with cohesive_table\("):
            replace(element, layer_compliance=1e-13)


def test_pair_of_bodies_is_the_element() -> None:
    contact = replace(STRIPS, theory="half_space")
    element = wheel_with_layer(contact, slope_reduction=0.7)
    forces = CreepForces.of(element).evaluate(
        semi_axis_x=contact.semi_axis_x,
        semi_axis_y=contact.semi_axis_y,
        normal_load=contact.wheel_load,
        creepage_x=-0.003,
        creepage_y=0.001,
        spin=0.2,
    )
    speed, radius = 10.0, element.radius
    there = element.evaluate(
        omega=speed * 1.003 / radius,
        speed=speed,
        lateral_velocity=0.001 * speed,
        spin_velocity=0.2 * speed,
    )
    assert forces["force_x"] == pytest.approx(there["creep_force"], rel=1e-7)
    assert forces["force_y"] == pytest.approx(there["lateral_force"], rel=1e-7)
    assert forces["spin_moment"] == pytest.approx(there["spin_moment"], rel=1e-6)


def test_an_fmu_contains_layers_only_if_its_contact_has_one() -> None:
    rig = cl.load_model("roller_rig.toml")
    soft = replace(rig.wheelset.element, layer_compliance=L)
    for element, layered in ((rig.wheelset.element, False), (soft, True)):
        model = replace(rig, wheelset=replace(rig.wheelset, element=element))
        description = Description(model, "force_element")
        names = [v.name for v in description.variables]
        assert ("layer_compliance" in names) == layered
        table = description.resources["creep_table.bin"]
        assert (len(table) > 1_000_000) == layered


@pytest.mark.parametrize("layer", [0.03, 0.3, 1.0])
def test_the_fold_of_a_held_wheelset_is_the_peak_of_the_law(layer: float) -> None:
    rig = cl.load_model("roller_rig.toml").wheelset
    element = rig.element
    compliance = 2.0 * layer * element.contact.semi_width / element.contact.tangential_modulus
    soft = replace(element, slope_reduction=1.0, layer_compliance=compliance)
    assert soft.layer_ratio == pytest.approx(layer)
    fold = cl.find_fold(replace(rig, element=soft, damping=0.0), speed=10.0)
    law = cl.CarterGriffith(k_hat=soft.k_hat, layer_ratio=layer)
    assert fold.creepage == pytest.approx(
        law.peak.normalized_creepage * soft.saturation_creepage, rel=1e-3
    )
    force = 0.21 * law.peak.traction_ratio * soft.axle_load
    assert fold.drive_torque == pytest.approx(force * soft.radius, rel=2e-6)


def test_the_fold_of_a_cohesive_law_with_a_layer(
    rig: cl.Model, layered_cohesive_table: CreepForceTable
) -> None:
    element = replace(rig.wheelset.element, table=layered_cohesive_table, layer_compliance=L)
    fold = cl.find_fold(replace(rig.wheelset, element=element, damping=0.0), speed=10.0)
    x = np.linspace(0.3, 12.0, 20001)
    ratio = layered_cohesive_table.traction_ratio(x, element.k_hat, element.layer_ratio)
    force = element.friction.kinetic * ratio.max() * element.axle_load
    assert fold.drive_torque == pytest.approx(force * element.radius, rel=1e-6)
    assert fold.creepage == pytest.approx(x[ratio.argmax()] * element.saturation_creepage, rel=0.01)
    assert ratio.max() < element.friction.ratio
