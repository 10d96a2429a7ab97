"""Rails with names: each condition against its source, in model files and along a track."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from command_line import done
from scipy.optimize import brentq
from sweep_files import SCENARIO, axis_values, one_axis

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder
from contactlib.files import RailCondition, condition_names, load_condition

LOCOMOTIVE = (package_folder("models") / "locomotive.toml").read_text()
UP_TO = np.concatenate([np.linspace(2e-4, 0.02, 60), np.linspace(0.021, 0.25, 100)])
WET = """static = 0.3
kinetic = 0.3
k_hat = 0.0
slip_rate_residual = 0.4
slip_rate_decay = 0.2
"""
PATCH = "distance = [2.0, 2.0, 3.0, 3.0]\n"


def polach(condition: RailCondition, zeta: FloatArray) -> FloatArray:
    """Traction coefficient by Eqs. (4), (9) and (11) of Polach 2005."""
    contact, speed = condition.element.contact, condition.compared.speed
    assert isinstance(contact, cl.EllipticContact)
    a, b, nu = contact.semi_axis_x, contact.semi_axis_y, contact.poisson_ratio
    shear_modulus = condition.contact["youngs_modulus"] / (2.0 * (1.0 + nu))
    mu0, residual = condition.friction["static"], condition.friction["slip_rate_residual"]
    decay = condition.friction["slip_rate_decay"]
    mu = mu0 * ((1.0 - residual) * np.exp(-decay * zeta * speed) + residual)
    c11 = float(cl.laws.kalker_coefficients(a / b, nu).c11)
    eps = shear_modulus * math.pi * a * b * c11 * zeta / (4.0 * contact.wheel_load * mu)
    k_a, k_s = condition.law["adhesion_reduction"], condition.law["slip_reduction"]
    stick = k_a * eps / (1.0 + (k_a * eps) ** 2)
    return np.asarray(2.0 * mu / math.pi * (stick + np.arctan(k_s * eps)))


def griffith(condition: RailCondition, zeta: FloatArray) -> FloatArray:
    """Traction coefficient by Eqs. (18) and (19) with the numbers of Fig. 6."""
    k, kinetic, zeta0 = 0.3, 0.21, 0.015

    def stick(x: float) -> float:
        def too_far(c: float) -> float:
            return float(0.5 * (1.0 + c) + k * ((1.0 + c) / (1.0 - c)) ** 0.25 - x)

        return float(brentq(too_far, -1.0, 1.0 - 1e-12, xtol=1e-15))

    c = np.array([stick(x) for x in zeta / zeta0])
    q = 1.0 - 0.25 * (1.0 - c) ** 2 + k * (1.0 - c) ** 0.75 * (1.0 + c) ** 0.25
    return np.asarray(kinetic * q)


FORMULAS = {"dry": polach, "wet": polach, "griffith": griffith}


def curve(element: cl.ForceElement, zeta: FloatArray, speed: float) -> FloatArray:
    return np.asarray(element.at_creepage(zeta, speed=speed)["traction_coefficient"])


def model(folder: Path, friction: str, law: str = "", wheelset: str = "") -> cl.Model:
    """The shipped locomotive on other rails; its own slope is left out."""
    text = re.sub(r"\[friction\].*?\n\n", f"[friction]\n{friction}\n\n", LOCOMOTIVE, flags=re.S)
    text = re.sub(r"saturation_creepage.*\n", wheelset + "\n", text)
    path = folder / "m.toml"
    path.write_text(f"{text}\n{law}")
    return cl.load_model(path)


def scenario(folder: Path, track: str, changes: str = 'condition = "dry"') -> cl.Scenario:
    text = re.sub(r"slip_rate_residual.*\nslip_rate_decay.*\n", f"{changes}\n", SCENARIO)
    text = re.sub(r"\[track\]\n.*?\n\n", f"[track]\n{track}\n\n", text, flags=re.S)
    (folder / "s.toml").write_text(text)
    return cl.load_scenario(folder / "s.toml")


@pytest.mark.parametrize("name", condition_names())
def test_a_condition_deviates_from_its_source_as_its_file_says(name: str) -> None:
    condition = load_condition(name)
    zeta, source = UP_TO, FORMULAS.get(name)
    if condition.points is not None:
        zeta, expected = condition.points.creepage, condition.points.traction_coefficient
    else:
        assert source is not None
        expected = source(condition, zeta)
    found = curve(condition.element, zeta, condition.compared.speed)
    largest = float(np.abs(found - expected).max())
    assert largest <= condition.compared.deviation
    assert largest >= 0.9 * condition.compared.deviation or name == "griffith"
    for text in (condition.source, condition.table, condition.read_in, condition.fitted):
        assert len(text) > 5


@pytest.mark.parametrize("name", ["dry", "wet"])
def test_polachs_law_with_a_condition_is_his_formula(name: str, tmp_path: Path) -> None:
    condition = load_condition(name)
    element = model(tmp_path, f'condition = "{name}"', '[law]\nkind = "polach"').wheelset.element
    assert (element.layer_compliance, element.slope_reduction) == (0.0, 1.0)
    of_source = cl.ForceElement(
        condition.element.contact, element.friction, table=element.table, radius=0.625
    )
    found = curve(of_source, UP_TO, condition.compared.speed)
    np.testing.assert_allclose(found, polach(condition, UP_TO), atol=1e-6)


def test_a_condition_is_its_keys_written_out(tmp_path: Path) -> None:
    """The same bits, whatever is given beside it."""
    for beside, keys, wheelset in (
        ("", WET, "layer_compliance = 4.9e-13"),
        ("static = 0.4", WET.replace("static = 0.3", "static = 0.4"), "layer_compliance = 4.9e-13"),
        (
            "softening_temperature = 600.0",
            f"{WET.partition('slip_rate')[0]}softening_temperature = 600.0",
            "layer_compliance = 4.9e-13",
        ),
        (
            "static = 0.4\nweakening_length = 1e-6",
            WET.replace("static = 0.3", "static = 0.4").replace(
                "k_hat = 0.0", "weakening_length = 1e-6"
            ),
            "layer_compliance = 4.9e-13",
        ),
    ):
        named = model(tmp_path, f'condition = "wet"\n{beside}').wheelset
        written = model(tmp_path, keys, wheelset=wheelset).wheelset
        assert named.element.parameters == written.element.parameters
        assert curve(named.element, UP_TO, 10.0).tobytes() == (
            curve(written.element, UP_TO, 10.0).tobytes()
        )


@pytest.mark.parametrize(
    "slope", ["slope_reduction = 0.5", "layer_compliance = 1e-13", "saturation_creepage = 0.03"]
)
def test_a_slope_beside_a_condition_wins(slope: str, tmp_path: Path) -> None:
    named = model(tmp_path, 'condition = "wet"', wheelset=slope).wheelset.element
    written = model(tmp_path, WET, wheelset=slope).wheelset.element
    assert named.parameters == written.parameters


@pytest.mark.parametrize(
    ("friction", "law", "message"),
    [
        (
            'condition = "wett"',
            "",
            r"friction\.condition = 'wett' is not known; did you mean 'wet'\?",
        ),
        ('condition = "griffith"', "", r"friction\.static is missing: the source of the condition"),
        ("condition = 3", "", r"friction\.condition = 3 must be a string"),
        ('condition = "wet"\nkinetik = 0.2', "", r"friction\.kinetik is not a known key; did you"),
        (
            'condition = "eurosprinter_layer"',
            '[law]\nkind = "polach"',
            r"law\.kind = 'polach' accepts the keys adhesion_reduction, slip_reduction, not \[\]",
        ),
    ],
)
def test_mistakes_are_named(friction: str, law: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(cl.ModelError, match=message) as error:
        model(tmp_path, friction, law)
    assert len(error.value.lines) == 1


def test_a_measured_curve_needs_no_condition(tmp_path: Path) -> None:
    law = '[law]\nkind = "measured"\nfile = "eurosprinter_engel1998.csv"'
    with pytest.warns(cl.InputWarning, match="makes no use of friction"):
        wheelset = model(tmp_path, 'condition = "wet"', law).wheelset
    with pytest.warns(cl.InputWarning, match="makes no use of friction"):
        assert wheelset.element.parameters == model(tmp_path, WET, law).wheelset.element.parameters


def test_a_changed_condition_replaces_the_vehicles_rails(tmp_path: Path) -> None:
    """Its static friction, k_hat and saturation creepage are those of other rails."""
    changed = scenario(tmp_path, "").drivetrain.wheelset.element
    written = model(tmp_path, 'condition = "dry"').wheelset.element
    assert changed.parameters == written.parameters
    own = scenario(tmp_path, "", 'condition = "dry"\nstatic = 0.6').drivetrain.wheelset.element
    assert (own.friction.static, own.friction.kinetic) == (0.6, 0.55)


def test_a_tracks_conditions_are_its_factors_written_out(tmp_path: Path) -> None:
    stated = (
        r"track\.condition = 'wet': .* have the vehicle's slip_rate_decay = 0.6 in place of 0.2"
    )
    with pytest.warns(cl.InputWarning, match=stated):
        named = scenario(tmp_path, PATCH + 'condition = ["dry", "wet", "wet", "dry"]')
    friction, slope = named.rails.friction_left.value, named.rails.slope.value
    assert friction == (1.0, 0.3 / 0.55, 0.3 / 0.55, 1.0)
    assert slope[0] == slope[3] == 1.0
    dry = named.drivetrain.wheelset.element
    wet = model(tmp_path, 'condition = "wet"').wheelset.element
    tiny = np.array([1e-7])
    assert slope[1] == pytest.approx((curve(wet, tiny, 10.0) / curve(dry, tiny, 10.0))[0], rel=1e-4)
    lists = f"friction = {list(friction)}\nslope = {list(slope)}"
    written = scenario(tmp_path, PATCH + lists)
    assert named.track.friction_left == written.track.friction_left
    runs = [cl.run_scenario(case, "creep_pi") for case in (named, written)]
    assert runs[0]["creep_force"].tobytes() == runs[1]["creep_force"].tobytes()


def test_nothing_is_stated_where_a_track_gives_all(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rails = scenario(tmp_path, PATCH + 'condition = ["dry", "dry", "dry", "dry"]').rails
    assert rails.slope.value == rails.friction_left.value == (1.0,) * 4


def test_the_slope_of_polachs_rails_is_that_of_his_reductions(tmp_path: Path) -> None:
    changes = 'condition = "dry"\n\n[wheelset_changes.law]\nkind = "polach"'
    with pytest.warns(cl.InputWarning, match="slip_rate_decay"):
        rails = scenario(
            tmp_path, PATCH + 'condition = ["dry", "wet", "wet", "dry"]', changes
        ).rails
    np.testing.assert_allclose(rails.slope.value, [1.0, 0.4 / 1.4, 0.4 / 1.4, 1.0], rtol=1e-6)


@pytest.mark.parametrize(
    ("track", "message"),
    [
        (
            PATCH + 'condition = ["dry", "wett", "wet", "dry"]',
            "condition = 'wett' is not known; did",
        ),
        (PATCH + 'condition = ["dry", 3, "wet", "dry"]', "condition = '3' is not known"),
        (PATCH + 'condition = ["dry", ["wet"], "wet", "dry"]', r"condition = \"\['wet'\]\" is not"),
        (PATCH + 'condition = ["dry", "wet"]', "distance has 4 and condition 2 entries"),
        ('condition = ["dry", "wet"]', "distance has 0 and condition 2 entries"),
        (PATCH + 'condition = "dry"', "condition = 'dry' must be a list"),
        (
            PATCH + 'condition = ["dry", "wet", "wet", "dry"]\nslope = [1.0, 1.0, 1.0, 1.0]',
            "condition replaces slope",
        ),
    ],
)
def test_mistakes_of_a_track_are_named(track: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(cl.ModelError, match=rf"s\.toml: track\.{message}"):
        scenario(tmp_path, track)


def test_laws_that_a_condition_cannot_change_are_refused(tmp_path: Path) -> None:
    track = PATCH + 'condition = ["wet", "eurosprinter_heat", "wet", "wet"]'
    polachs = 'condition = "wet"\n\n[wheelset_changes.law]\nkind = "polach"'
    with pytest.raises(
        cl.ModelError, match=r"'eurosprinter_heat' needs another law\.kind: its source"
    ):
        scenario(tmp_path, track, polachs)
    measured = '\n[wheelset_changes.law]\nkind = "measured"\nfile = "eurosprinter_engel1998.csv"'
    with pytest.raises(cl.ModelError, match=r"'wet' needs another law\.kind: a measured curve"):
        scenario(tmp_path, track, measured)


def test_sweeps_vary_the_numbers_of_a_condition(tmp_path: Path) -> None:
    on_dry = re.sub(r"slip_rate_residual.*\nslip_rate_decay.*\n", 'condition = "dry"\n', SCENARIO)
    axis = 'factor_on = "vehicle.friction.slip_rate_decay"\nvalues = [0.5, 1.0]'
    cases = axis_values(tmp_path, axis, on_dry)
    decays = [case.drivetrain.wheelset.element.friction.slip_rate_decay for case in cases]
    assert decays == [0.3, 0.6]
    rails = re.sub(r"friction = \[.*\n", 'condition = ["dry", "wet", "wet", "dry"]\n', on_dry)
    axis = 'parameter = "vehicle.friction.kinetic"\nvalues = [0.3, 0.5]'
    with pytest.warns(cl.InputWarning, match="slip_rate_decay"):
        cases = axis_values(tmp_path, axis, rails)
    factors = [case.rails.friction_left.value[1] for case in cases]
    assert factors == [1.0, 0.3 / 0.5]
    with pytest.raises(cl.ModelError, match=r"track\.condition: 'condition' is not known"):
        cl.load_sweep(one_axis(tmp_path, 'parameter = "track.condition"\nvalues = [1.0]', rails))


OWN = """name = "Our test track after rain"
source = "Runs of May"
[friction]
static = 0.28
kinetic = 0.25
k_hat = 0.0
[wheelset]
layer_compliance = 3e-13
"""


def test_a_file_of_your_own_is_a_condition_like_the_shipped_ones(tmp_path: Path) -> None:
    """In a model, a scenario's changes, along a track and in a map, from the folder of each."""
    (tmp_path / "rails").mkdir()
    (tmp_path / "rails" / "rain.toml").write_text(OWN)
    own = 'condition = "rails/rain.toml"'
    numbers = "static = 0.28\nkinetic = 0.25\nk_hat = 0.0"
    by_name, by_numbers = (
        model(tmp_path, own),
        model(tmp_path, numbers, "", "layer_compliance=3e-13"),
    )
    assert by_name.wheelset.element.friction == by_numbers.wheelset.element.friction
    assert by_name.wheelset.element.layer_compliance == 3e-13
    listed = done("conditions", str(tmp_path / "rails" / "rain.toml")).output
    assert "rain.toml: Our test track after rain" in listed
    assert "layer_compliance = 3e-13" in listed
    assert "deviation" not in listed

    along = 'condition = ["dry", "rails/rain.toml", "rails/rain.toml", "dry"]\n'
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cl.InputWarning)  # k_hat is that of the vehicle
        track = scenario(tmp_path, PATCH + along).track
        changed = scenario(tmp_path, PATCH + along, own).drivetrain.wheelset.element
    dry = load_condition("dry")
    assert track.friction_left.value[1] == pytest.approx(0.25 / dry.friction["kinetic"])
    assert changed.friction == by_name.wheelset.element.friction

    with pytest.raises(ValueError, match=r"condition none\.toml: no such file"):
        model(tmp_path, 'condition = "none.toml"')


@pytest.mark.parametrize(
    ("given", "other", "message"),
    [
        ("0.28", "-1.0", r"friction\.static = -1\.0"),
        ("0.28", "0.1", r"friction\.static = 0\.1 is out of range: must be >= kinetic = 0\.25"),
        ("k_hat = 0.0", 'condition = "wet"', r"friction\.condition is not a known key"),
        ("static", "statik", r"friction\.statik is not a known key; did you mean 'static'\?"),
    ],
)
def test_a_mistake_in_such_a_file_is_named_once(
    given: str, other: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "bad.toml").write_text(OWN.replace(given, other))
    with pytest.raises(ValueError, match=rf"bad\.toml: {message}"):
        model(tmp_path, 'condition = "bad.toml"')
    with pytest.raises(ValueError, match=rf"^bad\.toml: {message}"):
        load_condition(tmp_path / "bad.toml")


def test_what_such_a_file_lacks_is_given_beside_it_or_refused(tmp_path: Path) -> None:
    (tmp_path / "half.toml").write_text(OWN.replace("kinetic = 0.25\nk_hat = 0.0\n", ""))
    listed = done("conditions", str(tmp_path / "half.toml")).output
    assert "to be given beside it in a model: kinetic, k_hat or weakening_length" in listed
    beside = 'condition = "half.toml"\nkinetic = 0.25\nk_hat = 0.0'
    assert model(tmp_path, beside).wheelset.element.friction.static == 0.28
    along = 'condition = ["dry", "half.toml", "half.toml", "dry"]\n'
    with pytest.raises(cl.ModelError, match=r"'half\.toml' does not give friction\.kinetic"):
        scenario(tmp_path, PATCH + along)


def test_the_command_lists_all_of_them() -> None:
    lines = done("conditions").output.splitlines()
    assert [line.partition(":")[0] for line in lines if not line.startswith(" ")] == (
        condition_names()
    )
    for name in condition_names():
        assert f"  source: {load_condition(name).source}" in lines
