"""Friction over distance from a CSV file that a scenario names."""

from __future__ import annotations

import os
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.files.track_map import MAX_MAP_BYTES
from contactlib.vehicle.available_force import track_levels

TEXT = (
    (package_folder("models") / "split_friction.toml")
    .read_text()
    .replace("duration = 20.0", "duration = 8.0")
)
HEAD, TRACK, TAIL = TEXT.partition("[track]\n")
LISTS, REST = TAIL[: TAIL.index("[sensors]")], TAIL[TAIL.index("[sensors]") :]


def scenario(folder: Path, track: str, csv: str | bytes = "") -> Path:
    """File of a scenario with this section [track], beside a map."""
    (folder / "map.csv").write_bytes(csv if isinstance(csv, bytes) else csv.encode())
    path = folder / "scenario.toml"
    path.write_text(f"{HEAD}{TRACK}{track}\n{REST}")
    return path


def test_a_map_is_the_lists_in_a_file(tmp_path: Path) -> None:
    """The same bits, in the columns' units, separators and order."""
    at, left, right = (80.0, 80.0, 130.1), (1.0, 0.1 + 0.2, 1.0), (0.7, 0.1, 1 / 3)
    lists = f"distance = {list(at)}\nfriction_left = {list(left)}\nfriction_right = {list(right)}"
    expected = cl.load_scenario(scenario(tmp_path, lists)).track
    rows = [*zip(at, right, left, strict=True)]
    plain = "".join(f"{a!r},{b!r},{c!r}\n" for a, b, c in rows)
    for csv in (
        f"distance,friction_right,friction_left\n{plain}",
        f"# measured\ndistance [m],friction_right [1],friction_left\n\n{plain}",
        f"distance;friction_right;friction_left\n{plain.replace(',', ';').replace('.', ',')}",
        f"\ufeffdistance\tfriction_right\tfriction_left\n{plain}".replace(",", "\t"),
    ):
        case = cl.load_scenario(scenario(tmp_path, 'map = "map.csv"', csv))
        assert case.track == expected
    windows = "distance [m];grade [\u2030];friction \u2030\n0;5;400\n"  # a sign of cp1252
    for encoding in ("utf-8", "utf-16", "cp1252"):
        path = scenario(tmp_path, 'map = "map.csv"', windows.encode(encoding))
        line = cl.load_scenario(path).track
        assert (line.grade.value, line.friction_left.value) == ((0.005,), (0.4,))
    times = "time = [0.0, 5.0]\nfriction_over_time = [1.0, 0.5]"
    path = scenario(tmp_path, f'map = "map.csv"\n{times}', "distance [km],friction [%]\n0.5,40\n")
    assert cl.load_scenario(path).track == cl.Track.from_breakpoints(
        distance=(500.0,), friction=(0.4,), time=(0.0, 5.0), friction_over_time=(1.0, 0.5)
    )


@pytest.mark.slow
def test_runs_are_those_of_the_lists_and_a_flat_map_is_none(tmp_path: Path) -> None:
    runs = {}
    for name, track, csv in (
        ("lists", "distance = [20.0, 50.0]\nfriction = [1.0, 0.5]", ""),
        ("map", 'map = "map.csv"', "distance,friction\n20.0,1.0\n50.0,0.5\n"),
        ("flat", 'map = "map.csv"', "distance,friction,slope\n0,1,1\n"),
        ("none", "", ""),
    ):
        case = cl.load_scenario(scenario(tmp_path, track, csv))
        leaves = pytest.warns(
            cl.InputWarning, match=r"from 0 to .*, leaves the map map\.csv, which"
        )
        with leaves if name == "map" else nullcontext():
            runs[name] = cl.run_scenario(case, "creep_pi")
    for first, other in (("lists", "map"), ("flat", "none")):
        for signal in ("speed", "omega_left", "creep_force"):
            assert np.array_equal(runs[first][signal], runs[other][signal]), (first, signal)
    assert not np.array_equal(runs["map"]["speed"], runs["none"]["speed"])


def test_a_sweep_varies_the_places_of_a_map(tmp_path: Path) -> None:
    scenario(tmp_path, 'map = "map.csv"', "distance,friction\n20,1\n50,0.5\n")
    sweep = tmp_path / "sweep.toml"
    sweep.write_text(
        'name = "Map"\nsource = "chosen"\nscenario = "scenario.toml"\noutcomes = ["slip_work"]\n'
        'controllers = ["creep_pi"]\n[axes.f]\nparameter = "track.friction[1]"\n'
        "values = [0.4, 1.0]\n"
    )
    with pytest.warns(cl.InputWarning, match=r"the run, from 0 to .*, leaves the map map\.csv"):
        work = cl.ensemble(cl.load_sweep(sweep), workers=1)["slip_work"].values.ravel()
    assert work[0] != work[1]


@pytest.mark.parametrize(
    ("csv", "message"),
    [
        (
            "distance,friction\n0,1\n5,-0.1\n",
            r"line 3: friction = -0.1 is out of range: must .* > 0",
        ),
        (
            "distance [km],friction\n0,1\n\n4,2\n3,1\n",
            r"line 5: distance = 3000.0 m must be >= 4000",
        ),
        (
            "distance,friction\n2,1\n2,2\n2,1\n",
            r"line 4: distance = 2.0 m must be > 2.0 m, .* twice",
        ),
        ("distance,friction\n0,x\n", r"line 2: friction = 'x' is not a number"),
        ("distance,friction\n0,nan\n", r"line 2: friction = nan is out of range"),
        ("distance,friction\n0,1,2\n", r"line 2: 3 values for 2 columns"),
        ("distance,frction\n0,1\n", r"line 1: no column is 'frction'; did you mean 'friction'\?"),
        ("distance,distance\n0,1\n", r"line 1: 2 columns 'distance'"),
        ("distance,friction [kN]\n0,1\n", r"line 1: friction is in 'kN', which is not a unit in 1"),
        (
            "Survey 3\ndistance,friction\n0,1\n",
            r"line 1: line 2 names the columns, so line 1 is a pre",
        ),
        ("distance,friction_left\n0,1\n", r"distance must go with slope, grade, .*given are"),
        ("distance,grade [km/h]\n0,1\n", r"line 1: grade is in 'km/h', which is not a unit in 1"),
        (
            "distance,grade [permille]\n0,700\n",
            r"line 2: grade \[permille\] = 700.0 is out of range",
        ),
        ("distance,speed_limit [km/h]\n0,0\n", r"line 2: speed_limit .* = 0.0 is out of range"),
        ("distance,speed_limit\n0,9\n5,20\n5,30\n", r"distance = 5.0 has the values 20.0 and 30.0"),
        (
            "distance,slope [permille]\n0,25\n",
            r"line 1: slope \[permille\] has a unit; .* is grade",
        ),
        ("distance,slope [%]\n0,2.5\n", r"line 1: slope \[%\] has a unit; .* that is grade"),
        ("distance,slope\n0,12\n5,-3\n", r"line 3: slope = -3.0 is out of range: .* is grade"),
        ("distance,condition\n0,wett\n", r"condition = 'wett' is not known; did you mean 'wet'"),
        ("distance,condition,slope\n0,wet,1\n", r"condition replaces slope: give either"),
        ("condition\nwet\n", r"distance has 0 and condition 1 entries"),
        ("distance,condition\n0,\n", r"line 2: condition is blank; .* track.between = 'steps'"),
        ("distance,grade [1 in x]\n0,9\n1,0\n", r"line 3: grade .* must not be 0; write 'level'"),
        ("position,distance\n0,1\n", r"line 1: 2 columns 'distance'"),
        ("distance,friction\n", r"line 1: no data"),
        ("0,1\n1,1\n", r"line 1: it must name the columns; known are distance, friction, "),
        ("", r"line 1: it must name the columns"),
        (b"\xff\xfe\x00", r"line 1: "),
        ("distance,friction\n0,1\n".encode("utf-16-le"), r"line 1: the file is in UTF-16 without"),
        pytest.param(
            b"#" * (MAX_MAP_BYTES + 1),
            r"the file is too large: it must have <= 10 MB",
            id="too large",
        ),
    ],
)
def test_mistakes_in_a_map_are_named(tmp_path: Path, csv: str | bytes, message: str) -> None:
    path = scenario(tmp_path, 'map = "map.csv"', csv)
    with pytest.raises(
        cl.ModelError, match=rf"scenario.toml: track.map map.csv: {message}"
    ) as raised:
        cl.load_scenario(path)
    assert len(raised.value.lines) == 1


def test_what_is_no_file_is_named(tmp_path: Path) -> None:
    path = scenario(tmp_path, 'map = "map.csv"')
    (tmp_path / "map.csv").unlink()
    (tmp_path / "map.csv").mkdir()
    with pytest.raises(cl.ModelError, match=r"track.map map.csv: is a folder, not a file"):
        cl.load_scenario(path)
    (tmp_path / "map.csv").rmdir()
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "map.csv")
        with pytest.raises(cl.ModelError, match=r"track.map map.csv: is a pipe or a device, not"):
            cl.load_scenario(path)


@pytest.mark.parametrize(
    ("track", "message"),
    [
        ('map = "no.csv"', r"track.map no.csv: no such file, neither beside the scenario"),
        ('map = "../map.csv"', r"map must lie beside the scenario or below: .* no '\.\.'"),
        ("map = 3", r"track.map = 3 must be a string"),
        (
            'map = "map.csv"\ndistance = [0.0]\nslope = [1.0]',
            r"track.map = 'map.csv' replaces distance and slope: give either",
        ),
    ],
)
def test_mistakes_in_the_section_are_named(tmp_path: Path, track: str, message: str) -> None:
    with pytest.raises(cl.ModelError, match=message):
        cl.load_scenario(scenario(tmp_path, track, "distance,friction\n0,1\n"))


def test_a_long_map_is_read(tmp_path: Path) -> None:
    left, right = np.random.default_rng(3).integers(60, 63, (2, 20_000)).tolist()
    rows = [
        f"{0.25 * i!r},0.{a},0.{b},1\n" for i, (a, b) in enumerate(zip(left, right, strict=True))
    ]
    head = "distance,friction_left,friction_right,slope\n"
    path = scenario(tmp_path, 'map = "map.csv"', head + "".join(rows))
    case = cl.load_scenario(path)
    run = cl.run_scenario(replace(case, duration=0.5), "open_loop")
    assert set(track_levels(case.track)) >= {(0.6, 0.6, 1.0), (0.62, 0.61, 1.0)}
    assert (run["available_force"] > 0.0).all()


@pytest.mark.parametrize("chainage", [12_400.0, 87_650.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_map_may_begin_anywhere_and_run_either_way(
    tmp_path: Path, chainage: float, sign: float
) -> None:
    at, left, right = (0.0, 3.0, 3.0, 400.0), (1.0, 1.0, 0.5, 0.5), (0.9, 0.9, 0.8, 0.7)
    lists = f"distance = {list(at)}\nfriction_left = {list(left)}\nfriction_right = {list(right)}"
    plain = replace(cl.load_scenario(scenario(tmp_path, lists)), duration=0.6)
    expected = cl.run_scenario(plain, "creep_pi")
    assert expected["friction_scale_left"][-1] == 0.5
    columns = ("left", "right") if sign > 0.0 else ("right", "left")
    rows = [
        f"{(chainage + sign * place) / 1e3!r},{a!r},{b!r}\n"
        for place, a, b in zip(at, left, right, strict=True)
    ]
    head = f"distance [km],friction_{columns[0]},friction_{columns[1]}\n"
    csv = head + "".join(rows if sign > 0.0 else rows[::-1])
    way = "increasing" if sign > 0.0 else "decreasing"
    track = f'map = "map.csv"\nstart = "{chainage / 1e3!r} km"\ndirection = "{way}"'
    case = replace(cl.load_scenario(scenario(tmp_path, track, csv)), duration=0.6)
    run = cl.run_scenario(case, "creep_pi")
    np.testing.assert_allclose(run["speed"], expected["speed"], rtol=1e-6)
    np.testing.assert_allclose(run["omega_left"], expected["omega_left"], rtol=1e-4)
    lost = cl.load_scenario(scenario(tmp_path, 'map = "map.csv"', csv))
    lost = replace(lost, duration=0.2)
    message = r"the run, from 0 to 1?[0-9.]+ m, never meets the map map\.csv, which covers .*start"
    with pytest.warns(cl.InputWarning, match=message):
        cl.run_scenario(lost, "open_loop")
    with pytest.warns(cl.InputWarning, match=rf"{message}.* \(and so 2 other runs\)"):
        cl.run_many([lost] * 3, "open_loop")
    back = replace(case, initial_speed=-5.0, duration=0.2, demand=cl.Profile.of(0.0))
    with pytest.warns(cl.InputWarning, match="leaves the map"):
        cl.run_scenario(back, "open_loop")


def test_friction_coefficients_are_doubted_as_factors_and_taken_as_such(tmp_path: Path) -> None:
    csv = "distance,friction\n0,0.3\n40,0.15\n1000,0.15\n"
    doubt = r"track: the factors on friction are at most 0\.3, .*unit = 'coefficient'"
    with pytest.warns(cl.InputWarning, match=doubt):
        cl.load_scenario(scenario(tmp_path, 'map = "map.csv"', csv))
    with pytest.warns(cl.InputWarning, match=doubt):
        cl.load_scenario(scenario(tmp_path, "distance = [0.0, 40.0]\nfriction = [0.3, 0.15]"))
    cl.load_scenario(scenario(tmp_path, 'map = "map.csv"\nunit = "factor"', csv))
    in_per_cent = csv.replace("friction", "friction [%]").replace("0.", "")
    cl.load_scenario(scenario(tmp_path, 'map = "map.csv"', in_per_cent))
    case = cl.load_scenario(scenario(tmp_path, 'map = "map.csv"\nunit = "coefficient"', csv))
    case = replace(case, duration=0.3)
    element = case.drivetrain.wheelset.element
    run = cl.run_scenario(case, "creep_pi")
    scale = np.interp(run["distance"], (0.0, 40.0), (0.3, 0.15)) / element.friction.kinetic
    np.testing.assert_allclose(run["friction_scale_right"], scale, rtol=1e-9)
    other = replace(element.friction, kinetic=0.8 * element.friction.kinetic)
    wheelset = replace(case.drivetrain.wheelset, element=replace(element, friction=other))
    changed = replace(case, drivetrain=replace(case.drivetrain, wheelset=wheelset))
    assert changed.rails.lowest[0] == pytest.approx(0.15 / other.kinetic)


def test_a_map_of_a_line_has_rails_grades_and_limits(tmp_path: Path) -> None:
    """The lists of the scenario, in the units of the columns."""
    lists = (
        "distance = [0.0, 200.0, 200.0]\ncondition = ['dry', 'dry', 'wet']\n"
        "grade = [0.0, 0.012, -0.005]\nspeed_limit = [20.0, 20.0, 10.0]"
    )
    with pytest.warns(cl.InputWarning, match="a track changes friction"):
        expected = cl.load_scenario(scenario(tmp_path, lists)).rails
    csv = (
        "distance [km],grade [permille],speed_limit [km/h],condition\n"
        "0,0,72,dry\n0.2,12,72,dry\n0.2,-5,36,wet\n"
    )
    with pytest.warns(cl.InputWarning, match="a track changes friction"):
        found = cl.load_scenario(scenario(tmp_path, 'map = "map.csv"', csv)).rails
    assert found == expected
    assert found.grade == cl.Profile((0.0, 200.0, 200.0), (0.0, 0.012, -0.005))
    assert found.speed_limit == cl.Profile((0.0, 200.0, 200.0), (20.0, 20.0, 10.0))
    assert found.friction_left.value[2] < found.friction_left.value[1]
    beside = 'map = "map.csv"\ncondition = ["dry"]'
    with pytest.raises(cl.ModelError, match=r"track.map = 'map.csv' replaces condition"):
        cl.load_scenario(scenario(tmp_path, beside, csv))


def test_a_table_of_a_line_says_what_changes_in_its_own_units(tmp_path: Path) -> None:
    """The same table with all cells, in SI units."""
    sparse = "position [miles],gradient [1 in x],speed_limit [mph]\n"
    sparse += "0,Level,60\n0.3,-80,\n1.2,,40\n"
    whole = "distance,grade,speed_limit\n"
    whole += "0,0,26.8224\n482.8032,-0.0125,26.8224\n1931.2128,-0.0125,17.8816\n"
    section = 'map = "map.csv"\nbetween = "steps"'
    first, other = (
        cl.load_scenario(scenario(tmp_path, section, csv)).track for csv in (sparse, whole)
    )
    for name in ("grade", "speed_limit"):
        np.testing.assert_allclose(getattr(first, name).at, getattr(other, name).at)
        np.testing.assert_allclose(getattr(first, name).value, getattr(other, name).value)
    for unit in ("permil", "mm/m", "per mill"):
        same = f"distance,gradient [{unit}]\n0,-12.5\n"
        assert cl.load_scenario(scenario(tmp_path, section, same)).track.grade(0.0) == -0.0125
    for rows, message in (
        ("distance,friction,slope\n0,,1\n", "line 2: friction is blank in the first section"),
        ("distance,gradient [1 in x],friction\n0,9,1\n5,8\n", "line 3: 2 values for 3 columns"),
        ("distance,friction,slope\n0,1,1\n5,1\n9,,\n", "line 3: 2 values for 3 columns"),
    ):
        with pytest.raises(cl.ModelError, match=message):
            cl.load_scenario(scenario(tmp_path, section, rows))


@pytest.mark.parametrize(("sign", "way"), [(1.0, "increasing"), (-1.0, "decreasing")])
def test_a_table_of_sections_holds_each_value_to_the_next_place(
    tmp_path: Path, sign: float, way: str
) -> None:
    at, values = (0.0, 500.0, 1200.0), np.array([80.0, 40.0, 60.0])
    csv = "distance,speed_limit [m/s],grade [permille],friction [%]\n"
    csv += "".join(f"{a},{v},{v},{v}\n" for a, v in zip(at, values, strict=True))
    section = f'map = "map.csv"\nstart = 300.0\ndirection = "{way}"\n'
    place, held = np.array([-9.0, 499.0, 501.0, 1199.0, 1201.0]), values[[0, 0, 1, 1, 2]]
    track = cl.load_scenario(scenario(tmp_path, section + 'between = "steps"', csv)).track
    run = sign * (place - 300.0)  # a limit belongs to its place, whatever the direction of travel
    np.testing.assert_allclose(cl.Profile.of(track.speed_limit or 0.0)(run), held)
    np.testing.assert_allclose(1e3 * sign * track.grade(run), held)
    np.testing.assert_allclose(100.0 * track.friction_left(run), held)
    doubt = r"speed_limit changes in steps, friction and grade linearly .*track.between = 'steps'"
    with pytest.warns(cl.InputWarning, match=doubt):
        linear = cl.load_scenario(scenario(tmp_path, section, csv)).track
    assert linear.speed_limit == track.speed_limit
    np.testing.assert_allclose(100 * linear.friction_left(run), np.interp(place, at, values))


def test_steps_between_doubled_places_are_a_piecewise_linear_profile() -> None:
    rows = (0.2, 0.2, 0.5, 0.9, 0.9, 2.0), (30.0, 40.0, 40.0, 40.0, 60.0, 60.0)
    places = np.arange(-0.105, 2.2, 0.01)
    np.testing.assert_array_equal(cl.Profile.steps(*rows)(places), cl.Profile(*rows)(places))


@pytest.mark.parametrize(
    ("track", "doubt"),
    [
        ("distance = [0, 9]\nfriction = [1, 1]\nslope = [12, 14]", r"slope = 12 .* that is grade"),
        ("distance = [0, 9]\nslope = [2, 3]", r"track: slope without friction: .* is grade"),
        ("distance = [0, 9]\nspeed_limit = ['216 km/h', 60]", r"speed_limit = 60 has no unit"),
        ('map = "map.csv"', r"line 1: speed_limit = 80 has no unit"),
    ],
)
def test_numbers_that_mean_another_thing_are_doubted(
    tmp_path: Path, track: str, doubt: str
) -> None:
    with pytest.warns(cl.InputWarning, match=doubt):
        cl.load_scenario(scenario(tmp_path, track, "distance,speed_limit\n0,80\n"))
