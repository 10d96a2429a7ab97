"""Model files and addresses in the explorer page, held against Python's own reading of a file."""

from __future__ import annotations

import copy
import json
import math
import re
import tomllib
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from explorer_page import ExplorerPage, explorer_page
from explorer_vehicle import vehicle_of

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.element.force_element import RangeWarning
from contactlib.files.rail_conditions import SLOPE, condition_names, load_condition
from contactlib.vehicle import CreepCurve

pytestmark = pytest.mark.tools

MODELS = {
    name: (package_folder("models") / f"{name}.toml").read_text(encoding="utf-8")
    for name in ("roller_rig", "locomotive")
}
RIG: dict[str, Any] = tomllib.loads(MODELS["roller_rig"])
ANSWER = """(name, calls) => calls.map((given) => {
  try {
    return [contactlib.files[name](...given), null];
  } catch (error) {
    return [null, `${error.name}: ${error.message}`];
  }
})"""


def call_all(page: ExplorerPage, name: str, calls: list[tuple[Any, ...]]) -> list[Any]:
    answers = page.call(ANSWER, name, [list(given) for given in calls])
    assert not [error for _, error in answers if error is not None]
    return [value for value, _ in answers]


def call(page: ExplorerPage, name: str, *given: object) -> Any:
    return call_all(page, name, [given])[0]


def presets_of(page: ExplorerPage) -> Any:
    return page.call("() => contactlib.files.PRESETS")


def refusals(page: ExplorerPage, *texts: str) -> list[str | None]:
    """The lines with which the page refuses model files; None for one that it takes."""
    errors = [error for _, error in page.call(ANSWER, "readModel", [[text] for text in texts])]
    for error in errors:
        assert error is None or re.fullmatch(r"ModelError: .+", error), error
    return [error and error.removeprefix("ModelError: ") for error in errors]


def pick(rng: np.random.Generator, options: Sequence[Any]) -> Any:
    return options[int(rng.integers(len(options)))]


def toml(data: Any) -> str:
    """A TOML file of sections of numbers, texts and lists, which JSON writes alike."""
    heads = [f"{k} = {json.dumps(v)}" for k, v in data.items() if not isinstance(v, dict)]
    for name, section in data.items():
        if isinstance(section, dict):
            heads += [f"[{name}]", *(f"{k} = {json.dumps(v)}" for k, v in section.items())]
    return "\n".join(heads).replace("Infinity", "inf").replace("NaN", "nan") + "\n"


SHAPES = {
    f"{shape}_{axis}": {f"{shape}_{other}": size}
    for shape, size in (("radius", 0.5), ("semi_axis", 5e-3))
    for axis, other in ("xy", "yx")
}


def changed(where: str, value: object) -> dict[str, Any]:
    """The roller rig's file with one key changed, or with it left out if the value is None."""
    data = copy.deepcopy(RIG)
    section, key = where.split(".")
    others = {"weakening_length": "k_hat", "slope_reduction": "saturation_creepage"}
    if key in SHAPES:
        del data["contact"]["semi_width"], data["contact"]["radius"]
        data["contact"].update(SHAPES[key])
    data[section].pop(others.get(key), None)
    data[section].pop(key, None)
    if value is not None:
        data[section][key] = value
    return data


def loaded(path: Path, text: str) -> cl.Model | str:
    """What Python makes of a file, or the line with which it refuses it."""
    path.write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RangeWarning)
        warnings.simplefilter("ignore", cl.InputWarning)
        try:
            return cl.load_model(path)
        except cl.ModelError as error:
            lines = [line.removeprefix(f"{path}: ") for line in error.lines]
            # The page does not doubt numbers.
            return "\n".join(line for line in lines if " is implausible: " not in line)


def assert_same(vehicle: dict[str, Any], model: cl.Model | str) -> None:
    """The page's vehicle is Python's wheelset."""
    assert isinstance(model, cl.Model)
    expected = vehicle_of(model.wheelset, model.initial_speed)
    assert (vehicle["name"], vehicle["source"]) == (model.name, model.source)
    for name in ("contact", "theory", "mass"):
        assert vehicle[name] == expected[name]
    others = {"name", "source", "contact", "theory", "mass", "youngs_modulus", "poisson_ratio"}
    for name in expected.keys() - others:
        assert vehicle[name] == pytest.approx(expected[name], rel=1e-12, abs=0.0), name
    modulus = vehicle["youngs_modulus"] / (2.0 * (1.0 - vehicle["poisson_ratio"] ** 2))
    assert modulus == pytest.approx(model.wheelset.element.contact.contact_modulus, rel=1e-12)


ELLIPTIC: list[dict[str, Any]] = [
    {"radius_x": "500 mm", "radius_y": 0.3},
    {"radius_x": 0.46, "radius_y": 0.46},
    {"radius_x": 0.01, "radius_y": "1 km"},
    {"semi_axis_x": "6 mm", "semi_axis_y": "4.5 mm"},
]
ALTERNATIVES: list[dict[str, dict[str, Any]]] = [
    *({"contact": {**shape, "semi_width": None, "radius": None}} for shape in ELLIPTIC),
    {"friction": {"k_hat": None, "weakening_length": "1.3 um"}},
    {"friction": {"k_hat": 0, "static": 0.21}},
    {"friction": {"k_hat": 0, "static": 0.21, "slip_rate_residual": 0.4, "slip_rate_decay": 0.6}},
    {"friction": {"softening_temperature": "900 K", "thermal_effusivity": 13e3}},
    {"friction": {"k_hat": None, "weakening_length": "1.3 um", "static": 0.21}},
    {"wheelset": {"saturation_creepage": None, "layer_compliance": "130 um/GPa"}},
    {"wheelset": {"rotor_inertia": 7.5, "gear_ratio": 4}},
    {"wheelset": {"saturation_creepage": None, "slope_reduction": 0.4, "mass": "12 t"}},
    {"resistance": {"constant": "1.8 kN", "grade": "-1 %"}, "run": {"initial_speed": "72 km/h"}},
    {"law": {"kind": "carter_griffith"}},
    *(
        {"friction": {"condition": name, "k_hat": None, **given}, "wheelset": dict.fromkeys(SLOPE)}
        for name in condition_names()
        for given in ({"static": None, "kinetic": None}, {}, {"softening_temperature": "900 K"})
        if "static" not in given or "static" in load_condition(name).friction
    ),
    {"contact": {"memory": True}},
    {"contact": {**ELLIPTIC[1], "semi_width": None, "radius": None, "memory": True}},
]


def with_sections(changes: dict[str, dict[str, Any]]) -> str:
    data = copy.deepcopy(RIG)
    for section, keys in changes.items():
        merged = {**data.get(section, {}), **keys}
        data[section] = {key: value for key, value in merged.items() if value is not None}
    return toml(data)


@pytest.mark.parametrize("text", [*MODELS.values(), *map(with_sections, ALTERNATIVES)])
def test_page_reads_a_file_as_python_does_and_writes_it_back(
    page: ExplorerPage, tmp_path: Path, text: str
) -> None:
    path = tmp_path / "model.toml"
    vehicle, model = call(page, "readModel", text), loaded(path, text)
    assert_same(vehicle, model)
    assert isinstance(model, cl.Model)
    control = call(page, "settingsOf", vehicle, "roller_rig")["control"]
    curve = CreepCurve(model.wheelset, speed=model.initial_speed)
    assert 0.0 < curve.grip(control["drive_torque"]) < control["creepage"]
    smallest = float(curve.minimum_gain(control["creepage"]))
    assert smallest < control["proportional_gain"] or math.isinf(
        smallest
    )  # no gain: the train speeds up
    assert curve.torque(control["creepage"]) < control["torque_max"]
    written = call(page, "writeModel", vehicle, vehicle["axle_load"])
    assert_same(vehicle, loaded(path, written))
    again = call(page, "readModel", written)
    for name, value in vehicle.items():
        close = pytest.approx(value, rel=1e-12, abs=0.0) if isinstance(value, float) else value
        assert again[name] == close, name


@pytest.mark.parametrize("changes", [{}, ALTERNATIVES[0]])
@pytest.mark.parametrize("share", [0.5, 1.3])
def test_another_load_is_written_as_the_contact_under_it(
    page: ExplorerPage, tmp_path: Path, changes: dict[str, Any], share: float
) -> None:
    vehicle = call(page, "readModel", with_sections(changes))
    load = share * vehicle["axle_load"]
    before, after = (
        loaded(tmp_path / "model.toml", text)
        for text in (with_sections(changes), call(page, "writeModel", vehicle, load))
    )
    assert isinstance(before, cl.Model)
    assert isinstance(after, cl.Model)
    omega = np.linspace(20.0, 22.0, 101)
    there = before.wheelset.element.evaluate(omega=omega, speed=10.0, axle_load=load)
    nominal = after.wheelset.element.evaluate(omega=omega, speed=10.0)
    for name in ("creep_force", "k_hat", "saturation_creepage"):
        np.testing.assert_allclose(nominal[name], there[name], rtol=1e-11)


ANY_NUMBER = [0.0, -1.0, 0.3, 1e3, math.inf, -math.inf, math.nan]
NO_NUMBER: list[object] = [None, True, "", "5", "x y", "1 furlong", [], {}]
# Keys with their units and bounds: needed, with a default, and given in place of another.
KEYS: dict[str, tuple[str, list[float]]] = {
    "contact.wheel_load": ("N", [0.0]),
    "contact.poisson_ratio": ("1", [0.0, 0.5]),
    "contact.semi_axis_x": ("m", [0.0]),
    "friction.k_hat": ("1", [0.0, 2.0]),
    "friction.weakening_length": ("m", [0.0]),
    "wheelset.mass": ("kg", [0.0]),
    "wheelset.slope_reduction": ("1", [0.0, 1.0]),
    "wheelset.minimum_speed": ("m/s", [0.0]),
    "resistance.grade": ("1", [-0.5, 0.5]),
    "run.initial_speed": ("m/s", [0.0]),
}


# Units in other spellings: right for some keys, and refused for the others.
SPELT = "2kNm|2 kN * m|2 kN m|3 \u00b5m|3um|50 cm|80kph|9 km / h|1.5%|-|1,5 m|m 1|1 m m|2 t"
SPELT += "|2 tonnes|7 sec|1e3 N|1e 3|.5 s|5. s"


def cases_of(where: str) -> Iterator[tuple[object, str]]:
    """Values of a key, and the roller rig's file with each of them."""
    unit, bounds = KEYS[where]
    edges = [bound + way for bound in bounds for way in (0.0, 1e-9, -1e-9)]
    for value in (*ANY_NUMBER, *edges, *NO_NUMBER, *SPELT.split("|"), f"1 {unit}", f"1_0  {unit}"):
        yield value, toml(changed(where, value))


def test_a_value_is_refused_where_python_refuses_it(page: ExplorerPage, tmp_path: Path) -> None:
    cases = [(where, *case) for where in KEYS for case in cases_of(where)]
    lines = refusals(page, *(text for _, _, text in cases))
    ranges = 0
    for (where, value, text), line in zip(cases, lines, strict=True):
        python = loaded(tmp_path / "model.toml", text)
        assert (line is None) == isinstance(python, cl.Model), (where, value, line, python)
        # If it is this key's own range that is broken: the same key, value and bounds.
        if line is None or not isinstance(python, str) or not isinstance(value, float):
            continue
        if python.startswith(f"{where} = ") and "must be finite" in python:
            ranges += 1
            assert line.startswith(f"{where} = ")
            assert line.partition(" must ")[2] == python.partition(" must ")[2]
            if math.isfinite(value):
                assert float(line.split(" ")[2]) == value
    assert ranges > 40
    assert 40 < lines.count(None) < len(lines) - 40


# Texts that Python refuses too, and a part of the page's line.
WRONG: dict[str, tuple[str, str]] = {
    "no TOML": ("name = ", "line 1"),
    "unknown key": (toml(changed("wheelset.inertai", 1.0)), "wheelset.inertai"),
    "unknown section": (MODELS["roller_rig"] + "[brakes]\n", "brakes"),
    "no section": (toml({**RIG, "contact": 1.0}), "contact = 1"),
    "missing section": (toml({k: v for k, v in RIG.items() if k != "contact"}), "contact is"),
    "name": (toml({**RIG, "name": 5}), "name = 5"),
    "sections": ("[[contact]]\n" + MODELS["roller_rig"], ""),
    "two shapes": (toml(changed("contact.radius_x", None)), "radius_x and radius_y"),
    "no name of rails": (toml(changed("friction.condition", "icy")), 'friction.condition = "icy"'),
    "rails by number": (toml(changed("friction.condition", 5)), "friction.condition = 5"),
    "memory": (toml(changed("contact.memory", 1.0)), "contact.memory = 1 must be true or false"),
    "friction rises": (
        toml(changed("friction.static", 0.2)),
        "friction: static = 0.2, kinetic = 0.21",
    ),
    "both": (
        toml({**RIG, "friction": {**RIG["friction"], "weakening_length": 1e-6}}),
        "weakening_length and k_hat",
    ),
    "k_hat": (toml(changed("friction.weakening_length", 1.0)), "k_hat"),
    "clean": (toml(changed("wheelset.saturation_creepage", 1e-3)), "saturation_creepage"),
    "half a rotor": (toml(changed("wheelset.gear_ratio", 4.0)), "given is gear_ratio"),
    "a run": (MODELS["roller_rig"] + "[torque_control]\n", "torque_control"),
    "law": (MODELS["roller_rig"] + '[law]\nkind = "polach"\n', "law.kind"),
    "law's key": (MODELS["roller_rig"] + '[law]\nfile = "x.csv"\n', "law.file"),
    "no size": (
        toml({**RIG, "contact": {**RIG["contact"], "semi_width": 1e300, "radius": 1e-300}}),
        "contact.",
    ),
    "prototype": (MODELS["roller_rig"] + "[__proto__]\nx = 1\n", "__proto__"),
}


def test_other_mistakes_are_pythons(page: ExplorerPage, tmp_path: Path) -> None:
    lines = refusals(page, *(text for text, _ in WRONG.values()))
    for (what, (text, part)), line in zip(WRONG.items(), lines, strict=True):
        assert line is not None, what
        assert part in line, (what, line)
        assert isinstance(loaded(tmp_path / "model.toml", text), str), what


def test_every_shipped_file_opens_or_names_what_to_open(page: ExplorerPage, tmp_path: Path) -> None:
    files = sorted(package_folder("models").glob("*.toml"))
    texts = [file.read_text(encoding="utf-8") for file in files]
    *lines, long = refusals(page, *texts, "#" * 1_000_001)
    opened = [file.name for file, line in zip(files, lines, strict=True) if line is None]
    assert opened == ["coach.toml", "locomotive.toml", "roller_rig.toml"]
    for file, text, line in zip(files, texts, lines, strict=True):
        given = tomllib.loads(text)
        if line is None:
            assert_same(call(page, "readModel", text), cl.load_model(file))
            path = cl.export.write_explorer(tmp_path / "page.html", file)
            with explorer_page(path=path) as other:
                assert call(other, "givenModel") == text
            continue
        assert line.startswith("the page shows one wheelset, and this is ")
        assert f"'contactlib {'sweep' if 'axes' in given else 'simulate'}'" in line
        if "axes" not in given:
            assert line.endswith(f'open the model file of "{given["wheelset"]}"')
        with pytest.raises(cl.ModelError, match=r"is a (scenario|sweep)"):
            cl.export.write_explorer(tmp_path / "page.html", file)
    assert long == "the file has 1000001 characters: must be <= 1000000"


def test_memory_of_a_short_line_contact_is_refused(page: ExplorerPage) -> None:
    short = with_sections({"contact": {"memory": True, "semi_width": "6 mm"}})
    expected = "contact.memory = true needs a line contact of at least 4 semi-widths: "
    assert refusals(page, short) == [expected + "this one has 2.82"]


def random_settings(rng: np.random.Generator, preset: dict[str, Any]) -> dict[str, Any]:
    settings = copy.deepcopy(preset)
    vehicle, control = settings["vehicle"], settings["control"]
    for part in (vehicle, control, settings["patch"]):
        for name, value in part.items():
            if isinstance(value, int | float) and rng.random() < 0.6:
                part[name] = abs(value) * rng.uniform(0.1, 1.0) or rng.random() / 11.0
    vehicle["static_friction"] = vehicle["kinetic_friction"] * rng.uniform(1.01, 3.0)
    vehicle[pick(rng, ["softening_temperature", "slip_rate_decay"])] = 0
    if vehicle["softening_temperature"] > 0:
        vehicle["softening_temperature"] += 1.0
    vehicle["layer_compliance"] *= 1e-6
    vehicle["wheels"] = pick(rng, [1, 2, 6])
    vehicle["minimum_speed"] = pick(rng, [0.1, 1e-7])
    vehicle["contact"] = pick(rng, ["line", "elliptic"])
    vehicle["memory"] = pick(rng, [False, True])
    vehicle["mass"] = pick(rng, [None, rng.uniform(1e3, 1e5)])
    vehicle["name"] = pick(rng, ["x & y = z", "\u00e9 \U0001f682 <b>#%25", vehicle["name"]])
    control["mode"] = pick(rng, ["torque", "creep"])
    settings["axleLoad"] *= rng.random() + 1e-3
    settings["speed"] = rng.uniform(0.1, 80.0)
    settings["playback"] = pick(rng, [1, 0.1, 1 / 3])
    return settings


def test_address_keeps_every_bit(page: ExplorerPage) -> None:
    rng = np.random.default_rng(7)
    presets = presets_of(page)
    assert list(presets) == list(MODELS)
    for name, preset in presets.items():
        assert call(page, "toAddress", preset) == f"#vehicle={name}"
        held = {**preset, "control": {**preset["control"], "mode": "creep", "delay": 0.012}}
        assert call(page, "toAddress", held) == f"#vehicle={name}&mode=creep&delay=0.012"
        settings = [random_settings(rng, preset) for _ in range(100)]
        addresses = call_all(page, "toAddress", [(each,) for each in settings])
        for address in addresses:
            assert address.isascii()
            assert not set(address) & set(" <>\"'`")
        answers = call_all(page, "fromAddress", [(address,) for address in addresses])
        assert answers == [{"settings": each, "problems": []} for each in settings]


# Addresses that cannot be used, and parts of the error, which is one line.
UNUSABLE = {
    "#vehicle=tram": ["vehicle", "tram", "roller_rig, locomotive"],
    "#k_hat=three": ["k_hat", "three", "not a number"],
    "#k_hat=": ["k_hat", "not a number"],
    "#speed=1e999": ["speed", "Infinity", ">= 0"],
    "#k_hat=2.5": ["k_hat", "2.5", "<= 2"],
    "#speed=0.05": ["speed = 0.05", "minimum_speed"],
    "#speed=0&memory=false": ["speed = 0", "memory = true"],
    "#delay=1": ["delay", "<= 0.5"],
    "#peak_pressure=1e-300": ["peak_pressure = 1e-300", ">= 1000000"],
    "#mass=1e-300": ["mass = 1e-300", ">= 1"],
    "#mode=rocket": ["mode", "rocket", "torque, creep"],
    "#memory=1": ["memory", "false, true"],
    "#mass=some": ["mass", "some", "not a number"],
    "#static_friction=0.1": ["static_friction = 0.1", "kinetic_friction"],
    "#static_friction=0.21": ["k_hat = 0.3", "static_friction = 0.21"],
    "#__proto__=1": ["__proto__", "not a known key"],
    "#constructor=1": ["constructor", "not a known key"],
    "#k_hat=0.3&k_hat=0.4": ["k_hat", "twice"],
    "#k_hat=%": ["k_hat", "%"],
    "#=1": ['"" is not a known key'],
    "#<img src=x onerror=alert(1)>": ["img"],
    "#k_hat=0.3" + "0" * 4000: ["characters", "4000"],
}


def test_what_an_address_cannot_hold_is_named_and_the_rest_is_kept(page: ExplorerPage) -> None:
    rig = presets_of(page)["roller_rig"]
    answers = call_all(page, "fromAddress", [(f"{a}&playback=0.5",) for a in UNUSABLE])
    for (address, parts), its in zip(UNUSABLE.items(), answers, strict=True):
        kept = 1 if len(address) > 4000 else 0.5
        assert its["settings"] == {**rig, "playback": kept}, address
        (problem,) = its["problems"]
        assert "\n" not in problem
        assert all(part in problem for part in parts), problem
