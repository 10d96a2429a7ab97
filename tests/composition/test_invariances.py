"""What must not matter to a run, with every feature of a scenario: each pair of them in some case.

A case is a wheelset or a vehicle with some features, under one controller, as the files that a user
writes. An invariance changes the files in a way that changes the signals in a known one.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.base.units import UNITS
from contactlib.files.scenario import KINDS, SECTIONS
from contactlib.files.sections import VEHICLE_SECTIONS

pytestmark = pytest.mark.filterwarnings("ignore::contactlib.base.quantities.InputWarning")

Sections = dict[str, dict[str, Any]]


class Case(NamedTuple):
    """Features of a scenario, its controller, and the axles of its vehicle; 0 for a wheelset."""

    features: tuple[str, ...]
    controller: str
    axles: int

    @property
    def name(self) -> str:
        return " + ".join((f"{self.axles} axles" if self.axles else "wheelset", *self.features))


# ---- the files --------------------------------------------------------------------------------

WHEELSET: Sections = {
    "contact": {
        "radius_x": 0.5,
        "radius_y": 0.3,
        "wheel_load": 110e3,
        "youngs_modulus": 210e9,
        "poisson_ratio": 0.3,
    },
    "friction": {"static": 0.45, "kinetic": 0.21, "k_hat": 0.3},
    "wheelset": {
        "radius": 0.5,
        "inertia": 250.0,
        "wheels": 2,
        "mass": 30e3,
        "damping": 5.0,
        "saturation_creepage": 0.015,
        "minimum_speed": 0.1,
    },
    "resistance": {"constant": 500.0, "linear": 20.0, "quadratic": 1.0},
}
SCENARIO: Sections = {
    "run": {"initial_speed": 10.0, "duration": 0.8},
    "demand": {"time": [0.2, 0.5], "torque": [4e3, 28e3]},
}
AXLES = {  # positions and axles of a bogie, by the number of axles
    4: ([0.0, 2.5, 9.0, 11.5], 2),
    6: ([0.0, 1.9, 4.0, 9.0, 10.9, 13.0], 3),
    1: ([0.0], 1),
}
VEHICLE = {
    "bogie_mass": 12e3,
    "wheelset_mass": 2.5e3,
    "body_height": 1.8,
    "bogie_height": 0.6,
    "pivot_height": 0.5,
    "coupler_height": 1.0,
    "pitch_inertia": 100.0,
    "load_lag": 0.03,
}
PATCH = {"distance": [-6.0, 3.13, 3.13, 7.0], "friction_left": [1.0, 0.8, 0.4, 0.6]}
RIGHT = {"friction_right": [0.9, 1.0, 0.4, 0.5]}
FEATURES: Mapping[str, Sections] = {
    "memory": {"contact": {"memory": True}},
    "layer": {"wheelset": {"layer_compliance": 1e-13, "saturation_creepage": None}},
    "falling": {"friction": {"slip_rate_residual": 0.857, "slip_rate_decay": 0.6}},
    "axle": {"axle": {"stiffness": 6e6, "damping": 400.0, "drive_share": 0.7}},
    "motor": {"motor": {"lag": 0.01, "power": 4e5, "torque_rate": 3e5}},
    "brake": {
        "brake": {
            "delay": 0.04,
            "fill_time": 0.15,
            "vent_time": 0.1,
            "pressure": 3e5,
            "torque": 2e4,
            "pad_speed": [0.0, 30.0, 30.0, 0.0],
            "pad_pressure": [0.0, 0.0, 4e5, 4e5],
            "pad_friction": [1.3, 1.1, 0.8, 1.0],
            "pad_scale": 0.9,
        },
        "demand": {"torque": [-4e3, -22e3]},
    },
    "rails": {"track": {**PATCH, **RIGHT}},
    "peaks": {
        "track": {
            "distance": [-6.0, 3.13, 3.13, 7.0],
            "friction_left": [0.3, 0.2, 0.1, 0.15],
            "friction_right": [0.2, 0.25, 0.1, 0.12],
            "unit": "adhesion",
        }
    },
    "sanding": {"sanding": {"friction": 1.4, "slope": 0.9, "axles": [1]}},
    "map": {"track": {**PATCH, **RIGHT, "map": "map.csv", "start": 0.0}},
    "conditions": {
        "friction": {"condition": "dry"},
        "track": {"distance": [-6.0, 4.0, 4.0], "condition": ["dry", "dry", "wet"]},
    },
    "line": {
        "track": {
            **PATCH,
            **RIGHT,
            "slope": [1.0, 0.9, 0.5, 0.4],
            "grade": [0.01, 0.02, -0.01, 0.0],
            "speed_limit": [14.0, 14.0, 10.2, 10.2],
        }
    },
    "driver": {
        "track": {
            **PATCH,
            **RIGHT,
            "grade": [-0.02, -0.02, 0.01, 0.0],
            "speed_limit": [14.0, 14.0, 9.9, 9.9],
        },
        "driver": {"deceleration": 0.6},
    },
    "cleaning": {"track": {**PATCH, **RIGHT, "cleaning": 1e-4}},
    "errors": {
        "sensors": {"vehicle_speed_bias": 0.01, "wheel_diameter_error": -4e-3, "delay": 0.01}
    },
    "encoder": {"sensors": {"encoder_pulses": 200.0, "vehicle_speed_drift": 0.02}},
    "estimate": {"sensors": {"acceleration_limit": 0.6}},
    "released": {"run": {"start": "released"}},
    "load": {"dynamic_load": {"time": [0.3, 0.6, 0.9], "factor": [1.0, 0.8, 1.1]}},
    "some axles": {"vehicle": {"driven": [1, 3], "braked": [1, 2]}},
}
ONLY = {"load": False, "some axles": True, "sanding": True}  # for a wheelset, for a vehicle
ONE_OF = [
    {"rails", "peaks", "map", "conditions", "line", "driver", "cleaning"},
    {"errors", "estimate"},
    {"encoder", "estimate"},
    {"layer", "conditions"},
    {"falling", "conditions"},
]
CONTROLLERS = ("open_loop", "threshold", "creep_pi", "slope_seeking", "wsp")


def cases() -> list[Case]:
    """Cases of at most nine features in which any two meet that can."""
    found: list[Case] = []
    rng = np.random.default_rng(4)
    for vehicle in (False, True):
        names = sorted(name for name in FEATURES if ONLY.get(name, vehicle) is vehicle)
        apart = {pair for one in ONE_OF for pair in combinations(sorted(one), 2)}
        left = {*combinations(names, 2)} - apart
        while left:
            tries = []
            for _ in range(100):
                chosen: list[str] = []
                for name in rng.permutation(names).tolist():
                    fits = not any(tuple(sorted((name, other))) in apart for other in chosen)
                    chosen += [name] * (fits and len(chosen) < 9)
                tries.append(tuple(sorted(chosen)))
            best = max(tries, key=lambda one: len(left & {*combinations(one, 2)}))
            left -= {*combinations(best, 2)}
            axles = [*AXLES][len(found) % len(AXLES)] if vehicle else 0
            found.append(Case(best, CONTROLLERS[len(found) % len(CONTROLLERS)], axles))
    return found


def merged(*parts: Mapping[str, Mapping[str, Any]]) -> Sections:
    """Sections with the keys of all parts; a key that a later part sets to None is left out."""
    whole: Sections = {}
    for part in parts:
        for section, keys in part.items():
            whole[section] = {**whole.get(section, {}), **deepcopy(dict(keys))}
    return {name: {k: v for k, v in keys.items() if v is not None} for name, keys in whole.items()}


def sections_of(case: Case) -> Sections:
    """Contents of both files of a case."""
    parts = [FEATURES[name] for name in case.features]
    vehicle: Sections = {}
    if case.axles:
        position, per_bogie = AXLES[case.axles]
        masses = {"body_mass": 14e3 * case.axles, "train_mass": 15e3 * case.axles}
        share = {"position": position, "axles_per_bogie": per_bogie, **masses, **VEHICLE}
        vehicle = {"vehicle": share, "wheelset": {"mass": 30e3}}
    kind: Sections = {"controllers.tested": {"kind": case.controller}}
    whole = merged(WHEELSET, SCENARIO, vehicle, *parts, kind)
    for key in ("driven", "braked"):
        if key in whole.get("vehicle", {}):
            numbers = whole["vehicle"][key]
            whole["vehicle"][key] = [number for number in numbers if number <= case.axles]
    return whole


def written(folder: Path, sections: Sections) -> Path:
    """The files of a case: its wheelset, the map if it has one, and the scenario."""
    folder.mkdir(exist_ok=True)
    sections = deepcopy(sections)
    text = {"name": "case", "source": "test"}

    def write(name: str, parts: Mapping[str, Any]) -> Path:
        lines = [f"{k} = {json.dumps(v)}" for k, v in text.items()]
        for section, keys in parts.items():
            lines += [f"[{section}]", *(f"{k} = {json.dumps(v)}" for k, v in keys.items())]
        (folder / name).write_text("\n".join(lines) + "\n")
        return folder / name

    body = {name: sections.pop(name) for name in list(sections) if name in WHEELSET}
    write("wheelset.toml", body)
    track = sections.get("track", {})
    if "map" in track:
        lists = {k: track.pop(k) for k in list(track) if isinstance(track[k], list)}
        with (folder / track["map"]).open("w", newline="") as file:
            csv.writer(file).writerows([lists, *zip(*lists.values(), strict=True)])
    text["wheelset"] = "wheelset.toml"
    return write("scenario.toml", sections)


class Run(NamedTuple):
    """Time [s], signals of shape (rows, axles), and their units."""

    time: np.ndarray
    signals: dict[str, np.ndarray]
    units: Mapping[str, str]
    friction: float  # kinetic friction coefficient times load [N]


def run_of(folder: Path, sections: Sections, **options: Any) -> Run:
    scenario = cl.load_scenario(written(folder, sections))
    options = {"tolerance": 1e-7, **options}
    result = cl.run_scenario(scenario, "tested", **options)
    element = scenario.drivetrain.wheelset.element
    rows, axles = result.time.size, result.axles
    signals = {
        name: np.broadcast_to(result[name].reshape(rows, -1), (rows, axles))
        for name in result.units
    }
    return Run(result.time, signals, result.units, element.friction.kinetic * element.axle_load)


def agree(
    first: Run, second: Run, names: Sequence[str], tolerance: float, factor: float = 1.0
) -> None:
    """Signals of two runs agree, within parts of friction or of the signal's own size."""
    for name in names:
        one, other = first.signals[name], factor * second.signals[name]
        size = first.friction if first.units[name] == "N" else np.abs(one).max()
        assert_allclose(other, one, rtol=0.0, atol=tolerance * max(float(size), 1e-9), err_msg=name)


FORWARD = ("speed", "omega_left", "omega_right", "creep_force_left", "creep_force_right")
EITHER = ("axle_load", "friction_scale_left", "friction_scale_right", "creep_work")
ALL = cases()


def each(keep: Callable[[Case], bool] = lambda case: True) -> pytest.MarkDecorator:
    """Cases of a test; every other vehicle is one of the slow tests."""
    chosen = [case for case in ALL if keep(case)]
    slow = [case.axles > 0 and i % 2 == 1 for i, case in enumerate(chosen)]
    return pytest.mark.parametrize(
        "case",
        [
            pytest.param(case, id=case.name, marks=[pytest.mark.slow] * late)
            for case, late in zip(chosen, slow, strict=True)
        ],
    )


# ---- mirror ----------------------------------------------------------------------------------


def mirrored(sections: Sections) -> Sections:
    """The same run in reverse: the picture of everything in a mirror across the track."""
    sections = deepcopy(sections)
    sections["run"]["initial_speed"] *= -1.0
    length = 0.0
    if vehicle := sections.get("vehicle"):
        length, axles = vehicle["position"][-1], len(vehicle["position"])
        vehicle["position"] = [length - place for place in vehicle["position"][::-1]]
        for key in ("driven", "braked"):
            if key in vehicle:
                vehicle[key] = [axles + 1 - number for number in vehicle[key]]
        for sanding in [sections["sanding"]] if "sanding" in sections else []:
            sanding["axles"] = [axles + 1 - number for number in sanding["axles"]]
    if "brake" not in sections:  # which acts against any motion
        sections["demand"]["torque"] = [-torque for torque in sections["demand"]["torque"]]
    if "vehicle_speed_drift" in sections.get("sensors", {}):
        sections["sensors"]["vehicle_speed_drift"] *= -1.0
    track = sections.get("track", {})
    for key in [key for key in track if isinstance(track[key], list)]:
        track[key] = track[key][::-1]
        if key == "distance":
            track[key] = [-place - length for place in track[key]]
        if key == "grade":
            track[key] = [-grade for grade in track[key]]
    return sections


@each()
def test_reverse_is_the_mirror_of_forward(case: Case, tmp_path: Path) -> None:
    sections = sections_of(case)
    ahead = run_of(tmp_path / "ahead", sections)
    back = run_of(tmp_path / "back", mirrored(sections))
    back = back._replace(signals={name: rows[:, ::-1] for name, rows in back.signals.items()})
    agree(ahead, back, FORWARD, 1e-5, -1.0)
    agree(ahead, back, EITHER, 1e-5)


# ---- order -----------------------------------------------------------------------------------


@each(lambda case: not case.axles)
def test_left_and_right_may_be_exchanged(case: Case, tmp_path: Path) -> None:
    sections = sections_of(case)
    other = deepcopy(sections)
    if "axle" in other:
        other["axle"]["drive_share"] = 1.0 - other["axle"]["drive_share"]
    track = other.get("track", {})
    if "friction_left" in track:
        sides = track["friction_left"], track["friction_right"]
        track["friction_right"], track["friction_left"] = sides
    first, second = run_of(tmp_path / "one", sections), run_of(tmp_path / "other", other)
    for name in FORWARD[1:] + EITHER:
        side = name.replace("left", "RIGHT").replace("right", "left").replace("RIGHT", "right")
        second.signals[f"exchanged {name}"] = second.signals[side]
        first.signals[f"exchanged {name}"] = first.signals[name]
    names = [f"exchanged {name}" for name in FORWARD[1:] + EITHER]
    units = {f"exchanged {name}": unit for name, unit in first.units.items()}
    agree(first._replace(units=units), second, names, 1e-7)


APART = 20.0  # distance of axles that never come to each other's rails [m]


@each(lambda case: case.axles > 1 and not {"map", "conditions"} & set(case.features))
def test_the_order_of_axles_does_not_matter_where_nothing_couples_them(
    case: Case, tmp_path: Path
) -> None:
    """Each on rails of its own, without heights, so that only their common speed couples them."""
    sections = sections_of(case)
    low = {key: 0.0 for key in VEHICLE if key.endswith(("height", "inertia"))}
    n = case.axles
    far = [APART * i for i in range(n)]
    sections["vehicle"] |= {"position": far, **low, "wheelset_mass": 0.0}
    sections["vehicle"].pop("train_mass")
    order = np.r_[1:n:2, 0:n:2][::-1]  # the axle that each place has then
    runs: list[Run] = []
    for places in (np.arange(n), order):
        there = deepcopy(sections)
        for section, key in (("vehicle", "driven"), ("vehicle", "braked"), ("sanding", "axles")):
            if key in there.get(section, {}):
                numbers = there[section][key]
                there[section][key] = [i + 1 for i in range(n) if places[i] + 1 in numbers]
        if track := there.get("track"):
            lists = {k: v for k, v in track.items() if isinstance(v, list) and k != "distance"}
            edges = [0.5 * APART - place for place in far[:0:-1]]
            track["distance"] = [edge for edge in edges for _ in range(2)]
            for key, values in lists.items():
                levels = [values[place % len(values)] for place in places[::-1]]
                track[key] = [v for pair in pairwise(levels) for v in pair]
            track.pop("grade", None)  # that of the train is the mean
        runs.append(run_of(tmp_path / f"{len(runs)}", there))
    first, second = runs
    first = first._replace(signals={k: rows[:, order] for k, rows in first.signals.items()})
    agree(first, second, FORWARD + EITHER, 1e-5)


# ---- places, units, similarity -----------------------------------------------------------------


@each(lambda case: any("track" in FEATURES[name] for name in case.features))
def test_it_does_not_matter_how_places_are_counted(case: Case, tmp_path: Path) -> None:
    """Against the direction of travel, from somewhere else: left and right change with it."""
    sections = sections_of(case)
    moved = deepcopy(sections)
    track = moved["track"]
    track |= {"start": 12345.5, "direction": "decreasing"}
    track["distance"] = [12345.5 - place for place in track["distance"]]
    sides = {"friction_left": "friction_right", "friction_right": "friction_left"}
    lists = {key: value for key, value in track.items() if isinstance(value, list)}
    track |= {sides.get(key, key): values[::-1] for key, values in lists.items()}
    if "grade" in track:
        track["grade"] = [-grade for grade in track["grade"]]
    first, second = run_of(tmp_path / "one", sections), run_of(tmp_path / "other", moved)
    agree(first, second, FORWARD + EITHER, 1e-5)


def quantity_of(section: str, key: str, sections: Sections) -> Any:
    """Declaration of a key of either file."""
    if section.startswith("controllers"):
        keys = KINDS[sections[section]["kind"]]
    else:
        keys = SECTIONS.get(section) or VEHICLE_SECTIONS[section]
    return keys[key].quantity if key in keys else None


def each_number(sections: Sections, change: Callable[[Any, float], Any]) -> Sections:
    """Sections with each number that has a unit changed by a function of its declaration."""
    changed = deepcopy(sections)
    for section, keys in changed.items():
        for key, value in keys.items():
            quantity = quantity_of(section, key, sections)
            if quantity is None or isinstance(value, bool):
                continue
            many = isinstance(value, list)
            new = [change(quantity, number) for number in (value if many else [value])]
            keys[key] = new if many else new[0]
    return changed


@each()
def test_a_file_may_be_written_in_any_unit(case: Case, tmp_path: Path) -> None:
    sections = sections_of(case)
    sections.get("track", {}).pop("map", None)  # whose units are in the names of columns
    rng = np.random.default_rng(1)

    def in_another(quantity: Any, number: float) -> Any:
        units = {quantity.unit: 1.0, **UNITS.get(quantity.unit, {})}
        unit = str(rng.choice(list(units)))
        return number if quantity.unit == "1" else f"{number / units[unit]!r} {unit}"

    other = each_number(sections, in_another)
    texts = [
        re.sub(
            " at 0x[0-9a-f]+|speed_unit='.*?'",  # the unit in which figures show speeds
            "",
            repr(cl.load_scenario(written(tmp_path / str(i), data))),
        )
        for i, data in enumerate((sections, other))
    ]
    number = r"-?[0-9]+(?:\.[0-9]*)?(?:e[-+]?[0-9]+)?"
    assert re.sub(number, "#", texts[0]) == re.sub(number, "#", texts[1])
    first, second = ([float(n) for n in re.findall(number, text)] for text in texts)
    assert_allclose(second, first, rtol=1e-12)
    assert len(first) > 70


DIMENSIONS = {  # powers of mass, length and time
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "Hz": (0, 0, -1),
    "N": (1, 1, -2),
    "Pa": (1, -1, -2),
    "J": (1, 2, -2),
    "W": (1, 2, -3),
}


def powers_of(unit: str) -> np.ndarray:
    """Powers of mass, length and time in a unit such as ``N.s2/m2``."""
    total, over = np.zeros(3), 1.0
    for part in re.split(r"([/.])", unit.replace("(", "").replace(")", "")):
        if part == "/":
            over = -1.0
        elif part != ".":
            name, power = re.fullmatch(r"([A-Za-z]+|1)(\d?)", part).groups()  # type: ignore[union-attr]
            total += over * float(power or 1) * np.array(DIMENSIONS[name])
    return total


# With g, lengths go with the square of time. Controllers and drivers have times and speeds of
# their own, and the map of peaks has fixed speeds, so only the open loop is similar in these; and a
# contact with memory loses the force beyond a friction that jumps within 0.1 ms, whatever the units
# (RELEASE in fmu/kernel/memory.h).
HEAVIER, LONGER = (2.0, 1.0, 1.0), (3.0, 4.0, 2.0)


@each()
def test_similar_vehicles_run_alike(case: Case, tmp_path: Path) -> None:
    """Mass doubled in all units; without control and cells of rails, length and time too."""
    sections = sections_of(case)
    sections["controllers.tested"]["sample_time"] = 0.01
    scales = [HEAVIER]
    own_speeds = {"line", "driver", "conditions", "peaks"} & set(case.features)
    if case.controller == "open_loop" and not own_speeds:
        scales += [LONGER] * (not (case.axles and {"cleaning", "sanding"} & set(case.features)))
    if "conditions" in case.features:
        scales = []  # the layer of a published rail has the stiffness that it has
    for scale in scales:

        def scaled(quantity: Any, number: float, scale: Any = scale) -> float:
            return float(number * np.prod(np.power(scale, powers_of(quantity.unit))))

        first = run_of(tmp_path / "one", sections, step=0.005)
        large = run_of(tmp_path / "other", each_number(sections, scaled), step=0.005 * scale[2])
        for name in FORWARD + EITHER:
            factor = np.prod(np.power(scale, -powers_of(first.units[name])))
            loses = scale is LONGER and "memory" in case.features
            agree(first, large, [name], 5e-4 if loses else 1e-5, float(factor))


# ---- rows and tolerance --------------------------------------------------------------------------


@each(lambda case: ALL.index(case) % 2 == 0)
def test_rows_and_tolerance_converge(case: Case, tmp_path: Path) -> None:
    """Root mean square over friction; loads and clean rails are held over rows of 5 ms."""
    sections = sections_of(case)
    steps = (0.01, 0.005, 0.00125)
    coarse, middle, fine = (run_of(tmp_path, sections, step=step) for step in steps)
    errors = []
    for run in (coarse, middle):
        at = np.searchsorted(fine.time, run.time - 1e-9)
        missing = run.signals["creep_force"] - fine.signals["creep_force"][at]
        errors.append(float(np.sqrt(np.mean((missing / fine.friction) ** 2))))
    assert errors[1] < max(0.6 * errors[0], 2e-4)
    assert errors[1] < 2e-3
    loose = run_of(tmp_path, sections, step=steps[1], tolerance=1e-5)
    agree(middle, loose, ("creep_force",), 2e-3)
