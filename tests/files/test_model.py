"""Model files: what is read, and how mistakes are reported."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import done, refused

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.export.description import Description

SHIPPED = [package_folder("models") / name for name in ("locomotive.toml", "roller_rig.toml")]


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_models_load(path: Path) -> None:
    model = cl.load_model(path)
    assert model.source
    assert model.wheelset.element.k_hat == pytest.approx(0.3, rel=1e-12)
    assert model.wheelset.element.saturation_creepage == pytest.approx(0.015, rel=1e-12)


def test_roller_rig_is_the_wheel_of_the_paper(rig: cl.Model) -> None:
    element = rig.wheelset.element
    assert element.radius == 0.5
    assert element.contact.semi_width == pytest.approx(5e-3)
    assert element.axle_load == pytest.approx(22.5e3 * 9.80665, rel=1e-4)
    assert element.friction.kinetic == 0.21
    assert cl.laws.saturation_creepage(element.contact, element.friction) == pytest.approx(0.0021)
    assert rig.wheelset.speed_held


def test_locomotive_rolls_on_a_60e1_rail(locomotive: cl.Model) -> None:
    element = locomotive.wheelset.element
    contact = element.contact
    assert isinstance(contact, cl.EllipticContact)
    assert (contact.radius_x, contact.radius_y) == (locomotive.wheelset.radius, 0.3)
    assert contact.semi_axis_y < 10e-3  # half the width of the crown's arc
    assert element.axle_load == pytest.approx(22.5e3 * 9.80665, rel=1e-4)
    assert contact.theory == "half_space"
    assert element.table is cl.carter_griffith_table("elliptic")


@pytest.mark.parametrize("wagon_axles", [6, 0], ids=["train", "standstill"])
def test_resistance_is_davis_1926(locomotive: cl.Model, wagon_axles: int) -> None:
    wheelset = locomotive.wheelset
    if not wagon_axles:
        wheelset = cl.load_scenario("standstill.toml").drivetrain.wheelset
        assert wheelset.mass == 22.5e3
    pound, mile_per_hour, short_ton = 4.4482216152605, 0.44704, 907.18474
    loco_axle, wagon_axle = 22.5e3 / short_ton, 20e3 / short_ton
    constant = (1.3 * loco_axle + 29.0) + wagon_axles * (1.3 * wagon_axle + 29.0)
    linear = 0.03 * loco_axle + wagon_axles * 0.045 * wagon_axle
    quadratic = (0.0024 * 120.0 + wagon_axles * 0.0005 * 90.0) / 4.0
    resistance = wheelset.resistance
    assert resistance.constant == pytest.approx(constant * pound, rel=1e-3)
    assert resistance.linear == pytest.approx(linear * pound / mile_per_hour, rel=1e-3)
    assert resistance.quadratic == pytest.approx(quadratic * pound / mile_per_hour**2, rel=2e-3)


STATIC, K_HAT, SEMI_WIDTH = "static = 0.45", "k_hat = 0.3", 'semi_width = "5 mm"'
TIMES = "time = [0.0, 2.0, 10.0, 20.0]"


def load_changed(
    tmp_path: Path, table: cl.CreepForceTable | None, changes: dict[str, str]
) -> cl.Model:
    """The roller rig with these changes to the text of its file."""
    text = cl.files.model_path("roller_rig.toml").read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "changed.toml"
    path.write_text(text)
    return cl.load_model(path, table=table)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (STATIC, "statc = 0.45", r"friction\.statc is not a known key; did you mean 'static'"),
        (STATIC, "static = 0.1", r"friction\.static = 0\.1 .*>= kinetic = 0\.21"),
        (
            "radius =",
            "radius_x =",
            r"contact\.semi_width and radius, or .*one of these pairs, not semi_width and radius_x",
        ),
        (
            SEMI_WIDTH,
            'semi_axis_x = "5 mm"\nsemi_axis_y = "5 mm"',
            r"contact\.semi_width and radius, or .*one of these pairs, not radius and semi_axis_x",
        ),
        (SEMI_WIDTH, f'{SEMI_WIDTH}\ntheory = "strips"', r"theory = 'strips' is for an ellipse"),
        ("wheels = 2", "wheels = 2\nslope_reduction = 0.5", r"slope_reduction: give at most one"),
        ("wheels = 2", "wheels = 2\nlayer_compliance = 1e-13", r"must be 0 with a saturation"),
        (SEMI_WIDTH, "", r"contact\.semi_width and radius, or .*one of these pairs, not radius"),
        (K_HAT, "", r"friction\.weakening_length and k_hat: give exactly one"),
        (K_HAT, "k_hat = 0.3\nweakening_length = 1e-6", "exactly one of them, not 2"),
        (
            "saturation_creepage = 0.015",
            "saturation_creepage = 0.001",
            r"wheelset\.saturation_creepage = 0\.001 .*0\.0021",
        ),
        (
            "[resistance]",
            "[resistence]",
            r"resistence is not a known key; did you mean 'resistance'",
        ),
        (STATIC, "static = 0,45", r"line 17.*decimal comma\? a number has a decimal point"),
        ("name =", "name = 3 #", "name = 3 must be a string"),
        ("[run]", "[run", "at line"),
    ],
)
def test_a_mistake_is_one_clear_line(
    old: str, new: str, message: str, tmp_path: Path, table: cl.CreepForceTable
) -> None:
    with pytest.raises(cl.ModelError, match=rf"changed\.toml: .*{message}") as caught:
        load_changed(tmp_path, table, {old: new})
    assert "\n" not in str(caught.value)


FRICTION = f"[friction]\n{STATIC}\nkinetic = 0.21\n{K_HAT}\n"
SHAPE = 'radius = "500 mm"\nsemi_width = "5 mm"'
MEASURED = f"""[contact]
{SHAPE}
wheel_load = 9e4
youngs_modulus = 2.1e11
poisson_ratio = 0.3
[wheelset]
radius = 0.5
"""


def test_elliptic_contact_by_semi_axes_or_radii(tmp_path: Path) -> None:
    axes = {SHAPE: 'semi_axis_x = "12 mm"\nsemi_axis_y = "20 mm"'}
    by_axes = load_changed(tmp_path, None, axes).wheelset.element.contact
    assert isinstance(by_axes, cl.EllipticContact)
    assert (by_axes.semi_axis_x, by_axes.semi_axis_y) == pytest.approx((12e-3, 20e-3), rel=1e-13)
    assert by_axes.wheel_load == 110.325e3
    radii = {SHAPE: f"radius_x = {by_axes.radius_x!r}\nradius_y = {by_axes.radius_y!r}"}
    with pytest.warns(cl.InputWarning, match=r"radius_x = 3\.6.* m and wheelset\.radius"):
        element = load_changed(tmp_path, None, radii).wheelset.element
    assert element.table is cl.carter_griffith_table("elliptic")
    assert element.contact == by_axes
    assert element.k_hat == pytest.approx(0.3, rel=1e-12)
    assert element.saturation_creepage == pytest.approx(0.015, rel=1e-12)


@pytest.mark.parametrize("name", ["roller_rig.toml", "locomotive.toml"])
def test_a_contact_with_memory_has_the_lengths_of_its_shape(tmp_path: Path, name: str) -> None:
    text = cl.files.model_path(name).read_text(encoding="ascii")
    (tmp_path / "it.toml").write_text(text.replace("[contact]", "[contact]\nmemory = true"))
    element = cl.load_model(tmp_path / "it.toml").wheelset.element
    plain = cl.load_model(name).wheelset.element
    assert (element.memory, plain.memory) == (True, False)
    assert plain.rolling_parameters == element.parameters  # steady rolling is the same
    contact, scales = element.contact, element.memory_scales
    assert element.rolling_parameters == {**element.parameters, **element.memory_parameters}
    length = scales.relaxation_length / contact.semi_width
    assert length == pytest.approx(contact.relaxation_lengths.longitudinal, rel=1e-12)
    record = element.evaluate(omega=element.minimum_speed / element.radius, speed=10.0 * 0.01)
    scale = element.friction.kinetic * element.axle_load / element.saturation_creepage
    slope = record["force_gradient"] * element.minimum_speed / scale
    assert scales.initial_slope == pytest.approx(slope, rel=1e-6)


POLACH = """
[law]
kind = "polach"
adhesion_reduction = 0.9
slip_reduction = 0.4
"""


def test_the_radius_of_the_contact_is_not_that_of_the_wheel(tmp_path: Path, rig: cl.Model) -> None:
    changes = {'[wheelset]\nradius = "500 mm"': "[wheelset]\nradius = 0.43"}
    with pytest.warns(cl.InputWarning, match=r"radius = 0\.5 m and wheelset\.radius = 0\.43 m"):
        wheelset = load_changed(tmp_path, None, changes).wheelset
    assert (wheelset.radius, wheelset.element.radius) == (0.43, 0.43)
    assert wheelset.element.contact == rig.wheelset.element.contact


def test_a_wheel_on_a_roller_is_flatter_and_bears_no_more_than_its_mass(tmp_path: Path) -> None:
    for roller in (0.3, 1.5, math.inf):  # 1/radius is that of the wheel plus that of the roller
        shape = SHAPE.replace('"500 mm"', repr(1.0 / (1.0 / 0.5 + 1.0 / roller)))
        load_changed(tmp_path, None, {SHAPE: shape, "wheels = 2": "wheels = 2\nmass = 22.5e3"})
    with pytest.warns(cl.InputWarning, match=r"mass = 2250 kg is .* wheels carry, 2\.25e\+04 kg"):
        load_changed(tmp_path, None, {"wheels = 2": "wheels = 2\nmass = 2250.0"})


def test_law_by_its_name(tmp_path: Path) -> None:
    line = load_changed(tmp_path, None, {}).wheelset.element
    assert line.table is cl.carter_griffith_table("line")
    law = {"\n[run]": POLACH + "\n[run]"}
    with pytest.raises(cl.ModelError, match=r"law\.kind = 'polach' is the law of an ellipse"):
        load_changed(tmp_path, None, law)
    law[SHAPE] = 'semi_axis_x = "6 mm"\nsemi_axis_y = "8 mm"'
    polach = load_changed(tmp_path, None, law).wheelset.element
    expected_law = cl.Polach(adhesion_reduction=0.9, slip_reduction=0.4)
    zeta = np.linspace(-0.1, 0.1, 41)
    ratio = expected_law.traction_ratio(zeta / polach.saturation_creepage)
    coefficient = polach.at_creepage(zeta, speed=10.0)["traction_coefficient"]
    np.testing.assert_allclose(coefficient, polach.friction.kinetic * ratio, atol=1e-8)


STEEP = "creepage,traction_coefficient\n" + "".join(
    f"{z},{0.6 * np.tanh(z / 2e-4) * np.exp(-z / 0.05)}\n" for z in np.geomspace(1e-5, 0.2, 60)
)


@pytest.mark.parametrize("shape", [SHAPE, 'semi_axis_x = "6 mm"\nsemi_axis_y = "4 mm"'])
def test_a_measured_curve_is_reproduced_as_measured(tmp_path: Path, shape: str) -> None:
    # It is steeper than clean Hertzian steel, and its peak is above `static`.
    (tmp_path / "steep.csv").write_text(STEEP)
    law = '\n[law]\nkind = "measured"\nfile = "steep.csv"\n\n[run]'
    with pytest.warns(cl.InputWarning, match=r"friction and wheelset\.saturation_creepage"):
        element = load_changed(tmp_path, None, {SHAPE: shape, "\n[run]": law}).wheelset.element
    curve = cl.MeasuredCurve.from_csv(tmp_path / "steep.csv")
    assert curve.peak.traction_ratio * curve.kinetic > 0.45  # of the file's [friction]
    zeta = np.concatenate([-np.geomspace(1e-5, 0.2, 50), np.geomspace(1e-5, 0.2, 50)])
    for speed in (0.5, 40.0):
        outputs = element.at_creepage(zeta, speed=speed)
        np.testing.assert_allclose(
            outputs["traction_coefficient"], curve.traction_coefficient(zeta), atol=1e-7
        )
        for name in ("force_limited", "k_hat", "process_zone_ratio"):
            assert not outputs[name].any()


def test_semi_axes_that_do_not_fit_the_load_are_warned_of(tmp_path: Path) -> None:
    axes = 'semi_axis_x = "6.3 mm"\nsemi_axis_y = "5 mm"'
    load_changed(tmp_path, None, {SHAPE: axes})
    with pytest.warns(cl.InputWarning, match=r"110325 N .* relative radius_x of 294\.7 m: 0\.005"):
        load_changed(tmp_path, None, {SHAPE: axes.replace("mm", "cm")})


def test_a_curve_that_no_table_follows_is_reported_in_the_users_words(tmp_path: Path) -> None:
    rows = zip(np.geomspace(1e-4, 1.0, 40), 0.5 * np.exp(-np.linspace(0.0, 9.0, 40)), strict=True)
    text = "\n".join(f"{zeta},{mu}" for zeta, mu in rows)
    (tmp_path / "steep.csv").write_text(f"creepage,traction_coefficient\n{text}\n")
    law = '\n[law]\nkind = "measured"\nfile = "steep.csv"\n\n[run]'
    with pytest.raises(cl.ModelError, match=r"too abrupt for a table: steep\.csv: 40 points, "):
        load_changed(tmp_path, None, {"\n[run]": law})


def test_load_and_friction_stretch_a_measured_curve(tmp_path: Path) -> None:
    (tmp_path / "steep.csv").write_text(STEEP)
    curve = cl.MeasuredCurve.from_csv(tmp_path / "steep.csv")
    zeta = np.linspace(-0.01, 0.01, 41)
    for key, power in (("", 0.5), ("\nload_exponent = 0.0", 0.0)):
        law = f'[law]\nkind = "measured"\nfile = "steep.csv"{key}\n'
        (tmp_path / "force.toml").write_text(MEASURED + law)
        element = cl.load_model(tmp_path / "force.toml").wheelset.element
        for load, scale in ((3.6e5, 1.0), (9e4, 0.5), (1e4, 0.7)):
            stretch = scale * (load / 9e4) ** power
            outputs = element.at_creepage(zeta, speed=9.0, axle_load=load, friction_scale=scale)
            expected = scale * curve.traction_coefficient(zeta / stretch)
            np.testing.assert_allclose(outputs["traction_coefficient"], expected, atol=1e-7)


FORCE = """
[contact]
radius_x = 0.46
radius_y = 0.3
wheel_load = "90 kN"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[wheelset]
radius = 0.46
[friction]
static = 0.4
kinetic = 0.3
weakening_length = 0.0
"""


def test_a_force_needs_no_vehicle(tmp_path: Path) -> None:
    import fmpy

    (tmp_path / "force.toml").write_text(FORCE)
    model = cl.load_model(tmp_path / "force.toml")
    assert (model.name, model.initial_speed) == ("force", 10.0)
    for version in (2, 3):
        fmu = cl.export_fmu(model, tmp_path / "it.fmu", fmi_version=version)
        start = {"omega": 10.2 / 0.46, "speed": 10.0}
        run = fmpy.simulate_fmu(str(fmu), stop_time=0.01, start_values=start)
        force = model.wheelset.element.force(omega=10.2 / 0.46, speed=10.0)
        assert run["creep_force"][-1] == pytest.approx(float(force), rel=1e-12)


def test_a_run_needs_what_a_force_does_not_need(tmp_path: Path) -> None:
    (tmp_path / "force.toml").write_text(FORCE)
    model = cl.load_model(tmp_path / "force.toml")
    with pytest.raises(cl.ModelError, match="needs inertia: the file"):
        cl.find_fold(model.wheelset, speed=10.0)
    with pytest.raises(cl.ModelError, match="needs inertia: the file"):
        cl.export_fmu(model, tmp_path / "it.fmu", kind="wheelset")


def test_a_wheelset_has_one_wheel_unless_the_file_says_otherwise(tmp_path: Path) -> None:
    """As the reference states; with inertia and mass no inverse mass is assumed."""
    body = 'inertia = "120 kg.m2"\nmass = "11 t"\n'
    inverse_masses = []
    for wheels in ("", "wheels = 1\n"):
        text = FORCE.replace("[wheelset]\n", f"[wheelset]\n{body}{wheels}")
        assert text != FORCE
        (tmp_path / "wheel.toml").write_text(text)
        model = cl.load_model(tmp_path / "wheel.toml")
        inverse_masses.append(Description(model, "force_element").effective_inverse_mass)
        assert (model.wheelset.element.wheels, model.wheelset.mass) == (1, 11e3)
    radius = model.wheelset.radius
    first, second = inverse_masses
    assert first == second == pytest.approx(radius**2 / 120.0 + 1.0 / 11e3, rel=1e-12)


def test_the_rotor_turns_with_the_wheelset(tmp_path: Path, rig: cl.Model) -> None:
    def geared(keys: str) -> cl.Wheelset:
        inertia = {"inertia = 250.0": f"inertia = 100.0\n{keys}"}
        return load_changed(tmp_path, rig.wheelset.element.table, inertia).wheelset

    wheelset = geared('gear_ratio = 5.0\nrotor_inertia = "0.006 t m2"')
    assert wheelset.inertia == 250.0
    assert cl.worst_pole(wheelset, speed=10.0) == cl.worst_pole(rig.wheelset, speed=10.0)
    for key in ("gear_ratio", "rotor_inertia"):
        message = (
            rf"changed\.toml: wheelset\.rotor_inertia and gear_ratio go together; given is {key}$"
        )
        with pytest.raises(cl.ModelError, match=message):
            geared(f"{key} = 5.0")


def test_wheels_share_the_load(tmp_path: Path) -> None:
    one, two, six = (
        load_changed(tmp_path, None, {"wheels = 2": f"wheels = {n}"}).wheelset.element
        for n in (1, 2, 6)
    )
    assert two.axle_load == pytest.approx(22.5e3 * 9.80665, rel=1e-4)
    for load, scale in ((1e5, 1.0), (2e4, 0.6)):
        given: dict[str, Any] = {
            "omega": np.linspace(19.0, 23.0, 21),
            "speed": 10.0,
            "friction_scale": scale,
        }
        single = one.force(axle_load=load, **given)
        np.testing.assert_allclose(two.force(axle_load=2 * load, **given), 2 * single, rtol=1e-14)
        np.testing.assert_allclose(six.force(axle_load=6 * load, **given), 6 * single, rtol=1e-14)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ('kind = "kalker"', r"law.kind = 'kalker' must be one of: carter_griffith, cohesive"),
        (
            'kind = "measured"',
            r"law.kind = 'measured' accepts the keys file, load_exponent",
        ),
        ('file = "x.csv"', r"law.kind = 'carter_griffith' accepts no other key"),
        (
            'kind = "measured"\nfile = "eurosprinter_engel1998.csv"\ncolumns = ["slip", "mu"]',
            r"law\.file = 'eurosprinter_engel1998\.csv': line \d+: no column 'slip'; known",
        ),
        ('kind = "measured"\nfile = "no_such.csv"', "no_such.csv"),
    ],
)
def test_bad_laws_are_refused(tmp_path: Path, section: str, message: str) -> None:
    with pytest.raises((cl.ModelError, FileNotFoundError), match=message):
        load_changed(tmp_path, None, {"\n[run]": f"\n[law]\n{section}\n\n[run]", FRICTION: ""})


@pytest.mark.parametrize("name", ["elsewhere/roller_rig.toml", "no_such.toml"])
def test_no_shipped_model_stands_in_for_a_missing_file(name: str) -> None:
    with pytest.raises(FileNotFoundError, match=re.escape(name)):
        cl.load_model(name)


def test_numbers_that_no_formula_can_bring_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def overflows(*given: Any, **more: Any) -> None:
        raise OverflowError("math range error")

    monkeypatch.setattr("contactlib.files.model.contact_of", overflows)
    with pytest.raises(cl.ModelError, match=r"locomotive\.toml: its numbers are too far apart"):
        cl.load_model("locomotive.toml")


def test_the_model_file_s_cohesive_law(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, table: cl.CreepForceTable
) -> None:
    calls: list[Any] = []

    def built(*given: Any, layers: bool) -> cl.CreepForceTable:
        assert not layers
        calls.extend(given[:2])
        given[-1](0.5)
        return table  # any will do

    monkeypatch.setattr("contactlib.files.sections.cohesive_table", built)
    text = cl.files.model_path("roller_rig.toml").read_text() + '\n[law]\nkind = "cohesive"\n'
    (tmp_path / "x.toml").write_text(text)
    shown = done("table", tmp_path / "x.toml", "-o", tmp_path / "t.bin")
    assert calls == ["line", pytest.approx(0.45 / 0.21)]
    assert "... Building the table of the law: 50% done, about 0 s left\n" in shown.output
    assert (tmp_path / "t.bin").read_bytes() == table.data


def test_a_number_that_no_vehicle_has_warns_once(tmp_path: Path, table: cl.CreepForceTable) -> None:
    hot = {K_HAT: 'k_hat = 0.3\nsoftening_temperature = "1600 K"'}
    expected = "friction.softening_temperature = 1600 K .* steel melts at 1480 K above$"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load_changed(tmp_path, table, hot)
    messages = [str(w.message) for w in caught if w.category is cl.InputWarning]
    assert len(messages) == 1
    assert re.match(rf"{re.escape(str(tmp_path))}.*changed\.toml: {expected}", messages[0])
    assert {w.filename for w in caught if w.category is cl.InputWarning} == {__file__}


def test_a_forgotten_unit_is_named_before_what_follows_from_it(
    tmp_path: Path, table: cl.CreepForceTable
) -> None:
    with pytest.raises(cl.ModelError) as caught:
        load_changed(tmp_path, table, {"kinetic = 0.21": "kinetic = 21.0"})
    doubt, error = caught.value.lines
    assert "friction.kinetic = 21 is implausible: 0.005 to 2 is usual; is its unit" in doubt
    assert "friction.static = 0.45 is out of range: must be >= kinetic = 21.0" in error


def test_all_mistakes_come_at_once_in_the_order_of_the_file(
    tmp_path: Path, table: cl.CreepForceTable
) -> None:
    changes = {
        'wheel_load = "110.325 kN"': 'wheel_load = "22.5 t"',
        "static = 0.45": "statc = 0.45",
        "k_hat = 0.3": 'k_hat = "big"',
        "[resistance]": "[resistence]",
        "wheels = 2": "wheels = 2\ninertia = -1.0 # twice",
        "inertia = 250.0": "",
    }
    with pytest.raises(cl.ModelError) as caught:
        load_changed(tmp_path, table, changes)
    lines = [line.partition("changed.toml: ")[2] for line in caught.value.lines]
    assert str(caught.value).split("\n") == list(caught.value.lines)
    expected = [
        r"contact\.wheel_load = '22\.5 t' is a mass; its weight is \"220\.6 kN\"",
        r"friction\.statc is not a known key; did you mean 'static'\?",
        r"friction\.k_hat = 'big' does not begin with a number",
        r"wheelset\.inertia = -1\.0 is out of range: must be finite and > 0",
        r"resistence is not a known key; did you mean 'resistance'\?",
    ]
    assert len(lines) == len(expected), lines
    for line, pattern in zip(lines, expected, strict=True):
        assert re.match(pattern, line), line


def test_a_measured_law_with_a_mistake_still_needs_no_friction(tmp_path: Path) -> None:
    path = tmp_path / "wheel.toml"
    path.write_text(
        "[contact]\nradius_x = 0.5\nradius_y = 0.3\nwheel_load = 1e5\nyoungs_modulus = 210e9\n"
        'poisson_ratio = 0.3\n[wheelset]\nradius = 0.5\n[law]\nkind = "measured"\n'
        'fle = "curve.csv"\n'
    )
    with pytest.raises(cl.ModelError, match=r"law.fle is not a known key") as caught:
        cl.load_model(path)
    assert len(caught.value.lines) == 1


def test_friction_in_per_cent_is_an_error(tmp_path: Path, table: cl.CreepForceTable) -> None:
    changes = {"static = 0.45": "static = 45", "kinetic = 0.21": "kinetic = 21"}
    with pytest.raises(
        cl.ModelError, match=r"friction\.static = 45\.0 is .* <= 5; if it is in per"
    ):
        load_changed(tmp_path, table, changes)


def test_a_flood_of_mistakes_ends(tmp_path: Path) -> None:
    path = tmp_path / "flood.toml"
    path.write_text("".join(f"x{i} = {i}\n" for i in range(20_000)))
    with pytest.raises(cl.ModelError) as caught:
        cl.load_model(path)
    assert len(caught.value.lines) == 51
    assert caught.value.lines[-1] == f"{path}: there are more mistakes"


def test_a_measured_force_is_divided_by_its_load(tmp_path: Path) -> None:
    zeta = np.geomspace(1e-3, 0.1, 20)
    mu = 0.3 * np.tanh(zeta / 0.01) * (0.6 + 0.4 * np.exp(-zeta / 0.05))
    rows = zip(100.0 * zeta, mu, 220.0 * mu, strict=True)
    points = "\n".join(f"{z};{m};{force}" for z, m, force in rows).replace(".", ",")
    (tmp_path / "rig.csv").write_text(f"slip;mu;Q\n%;;kN\n{points}\n")
    coefficients = []
    for columns, load in ((["slip", "mu"], ""), (["slip", "Q"], 'load = "220 kN"')):
        law = f'[law]\nkind = "measured"\nfile = "rig.csv"\ncolumns = {columns!r}\n{load}\n'
        (tmp_path / "mine.toml").write_text(MEASURED + law)
        element = cl.load_model(tmp_path / "mine.toml").wheelset.element
        coefficients.append(element.at_creepage(zeta, speed=10.0)["traction_coefficient"])
    np.testing.assert_allclose(coefficients[1], coefficients[0], rtol=1e-9)


def test_a_curve_in_place_of_a_model_reports_it(tmp_path: Path) -> None:
    (tmp_path / "rig.csv").write_text("slip,mu\n1,0.2\n")
    error = refused("fmu", tmp_path / "rig.csv")
    assert re.search(r'rig\.csv: is a CSV file: .*\[law\] .* file = "rig\.csv"; ', error)
