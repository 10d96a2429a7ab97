"""Logs of runs: from a run, from a CSV file in any spelling, their rows, and doubts about them."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plain_scenario import plain_scenario

import contactlib as cl
from contactlib.logs.log import Log, read_log
from contactlib.vehicle import Brake, Drivetrain

COLUMNS = ("time", "drive_torque", "omega", "speed", "distance")
SHIPPED = pytest.mark.parametrize("name", ["dry_wet_dry", "four_axles"])


@cache
def run(name: str) -> tuple[cl.Scenario, cl.Result]:
    """A shipped scenario, here uphill: coasting, traction on dry and wet rails, or braking."""
    case = cl.load_scenario(f"{name}.toml")
    track = replace(case.track, grade=cl.Profile((0.0, 60.0), (0.0, 0.04)))
    slow = case.vehicle and replace(case.vehicle, load_lag=0.3)
    duration = 15.0 if "wsp" in case.controllers else 5.0
    case = replace(case, duration=duration, track=track, vehicle=slow)
    return case, cl.run_scenario(case, "creep_pi")


@cache
def braked() -> cl.Scenario:
    """One wheelset with a wheel of 0.5 m and a brake of 2 kN.m/bar."""
    brake = Brake(fill_time=0.1, vent_time=0.1, pressure=3e5, torque=6e3)
    wheelset = cl.load_scenario("dry_wet_dry.toml").drivetrain.wheelset
    return plain_scenario(Drivetrain(wheelset, brake=brake))


T, OMEGA = np.arange(4) * 0.01, np.array([20.0, 21.0, 22.0, -23.0])
RPM, TORQUE = OMEGA * 30.0 / math.pi, np.array([0.0, -2e3, -4e3, 4e3])
PLAIN = {"time": T, "omega": OMEGA, "drive_torque": TORQUE, "speed": 10.0 + T}
OWN_UNITS = {"time": "s", "omega": "rad/s", "drive_torque": "N.m", "speed": ""}
BRAKING = np.abs(TORQUE)


def written(folder: Path, changed: Mapping[str, Any], *, sign: str = ",") -> Path:
    """A CSV file of columns: new values of a plain one, or others in its place."""
    columns = dict[str, Any]()
    for name, values in PLAIN.items():
        new = changed.get(name, values)
        columns |= new if isinstance(new, dict) else {name: new}
    text = "\n".join(sign.join(map(str, row)) for row in zip(*columns.values(), strict=True))
    text = text if sign == "," else text.replace(".", ",").replace("N,m", "N.m")
    folder.mkdir(exist_ok=True)
    path = folder / "log.csv"
    path.write_text(f"{sign.join(columns)}\n{text}\n")
    return path


def assert_same(log: Log, expected: Log) -> None:
    for name in COLUMNS:
        ours, theirs = (np.array(getattr(one, name), dtype=float) for one in (log, expected))
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, err_msg=name)


@SHIPPED
def test_the_table_of_a_run_is_its_log(tmp_path: Path, name: str) -> None:
    case, result = run(name)
    assert_same(read_log(result.to_csv(tmp_path / "run.csv"), case), Log.of(result))


@pytest.mark.parametrize("sign", [",", ";"])
@pytest.mark.parametrize(
    ("changed", "columns"),
    [
        ({"omega": {"omega_1 [rpm]": RPM}}, {}),
        ({"omega": {"n_WSP1 [1/min]": RPM}}, {"omega_1": "n_WSP1 [1/min]"}),
        ({"omega": {"n_WSP1": RPM}}, {"omega": "n_WSP1 [min^-1]"}),
        ({"omega": {"wheel_speed_1 [km/h]": OMEGA * 1.8}}, {}),
        ({"drive_torque": {"drive_torque_1 [kNm]": TORQUE / 1e3}}, {}),
        ({"drive_torque": {"brake_torque [N.m]": np.where(BRAKING, BRAKING, -50.0)}}, {}),
        ({"drive_torque": {"cylinder_pressure_1 [bar]": BRAKING / 2e3}}, {}),
        ({"drive_torque": {"brake_torque": 0.5 * BRAKING, "motor_torque": 0.5 * TORQUE}}, {}),
        ({"time": {"time [ms]": 1e3 * T}, "speed": {"v": 36.0 + 3.6 * T}}, {"speed": "v [km/h]"}),
        ({name: [unit, *PLAIN[name]] for name, unit in OWN_UNITS.items()}, {}),
    ],
)
def test_each_name_and_unit_gives_the_same_log(
    tmp_path: Path, changed: Mapping[str, Any], columns: Mapping[str, str], sign: str
) -> None:
    """The wheel turns backward in the last row."""
    expected = Log(
        **{**PLAIN, "omega": OMEGA[:, np.newaxis], "drive_torque": TORQUE[:, np.newaxis]}
    )
    assert_same(read_log(written(tmp_path, changed, sign=sign), braked(), columns), expected)


def line(time: Any = None) -> Any:
    """Motion of four axles under a constant acceleration, at 5 ms."""
    time = 0.005 * np.arange(401) if time is None else time
    speed, four = 10.0 + 0.5 * time, np.ones((1, 4))
    columns = {"speed": speed, "omega": 2.0 * speed[:, np.newaxis] * four}
    return Log(**{"time": time, "drive_torque": time[:, np.newaxis] * four, **columns})


@pytest.mark.filterwarnings("ignore::contactlib.InputWarning")  # it is no vehicle's motion
def test_rows_are_even_and_gaps_have_no_speeds() -> None:
    """Straight lines stay straight over stamps with jitter, and where rows were dropped."""
    stamps = 0.005 * np.arange(401) + np.random.default_rng(1).uniform(-0.001, 0.001, 401)
    torn = line(np.delete(stamps, [100, 101, 102, 200, 201, *range(240, 250)]))  # 20, 15, 55 ms
    omega, torque = torn.omega.copy(), torn.drive_torque.copy()
    omega[100:120, 1] = torque[100:120, 2] = np.nan
    rows = replace(torn, omega=omega, drive_torque=torque).rows(run("four_axles")[0])
    inner = slice(1, -1)  # the first and last means are of half a row
    t = rows.time[inner]
    expected = line(t)
    assert np.diff(rows.time) == pytest.approx(0.01)
    assert rows.torque[inner] == pytest.approx(expected.drive_torque)
    for found, true, blank in (
        (rows.speed, expected.speed, (1.2, 1.3)),
        (rows.omega[:, 0], expected.omega[:, 0], (1.2, 1.3)),
        *(
            (rows.omega[:, k], expected.omega[:, k], (torn.time[100], torn.time[119]))
            for k in (1, 2)
        ),
    ):
        known = np.isfinite(found[inner])
        assert found[inner][known] == pytest.approx(true[known])
        assert t[~known].min() == pytest.approx(blank[0], abs=0.015)
        assert (t[~known] < 1.31).all()
    way = 10.0 * (t - torn.time[0]) + 0.25 * t**2
    assert rows.distance[inner] == pytest.approx(way, abs=2e-3)
    assert np.diff(line().rows(run("four_axles")[0], period=0.1).time) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("lost", "of_load", "of_way"),
    [((), 4e-3, 0.02), (COLUMNS[4:], 4e-3, 0.02), (COLUMNS[3:], 0.01, 0.6)],
)
def test_rows_have_loads_places_and_grades_of_the_run(
    lost: tuple[str, ...], of_load: float, of_way: float
) -> None:
    """Without distance that of the speed; without speed that of the wheel that slips least."""
    (case, result), true = run("four_axles"), slice(None, None, 2)
    without: dict[str, Any] = dict.fromkeys(lost)
    rows = replace(Log.of(result), **without).rows(case)
    assert rows.load == pytest.approx(result["axle_load"][true], rel=of_load)
    assert rows.distance == pytest.approx(result["distance"][true, 0], abs=of_way)
    assert rows.grade == pytest.approx(result["grade"][true].mean(axis=1), abs=of_way / 1e3)


@pytest.mark.filterwarnings("ignore::contactlib.InputWarning")  # it is no vehicle's motion
def test_limit_of_acceleration_and_grades_under_the_train() -> None:
    """Moments about the rail; grades that grow evenly, in the middle of vehicle and train."""
    four, log = run("four_axles")[0], line()
    body, radius = four.vehicle, four.drivetrain.wheelset.radius
    assert body is not None
    every = []
    for limit in (None, 0.2):
        case = replace(
            four, sensors=replace(four.sensors, vehicle_speed_noise=0.0, acceleration_limit=limit)
        )
        every.append(replace(log, speed=None).rows(case).load[100])
    arm = 2.0 * body.bogie_mass * body.bogie_height + 4.0 * body.wheelset_mass * radius
    arm += (body.body_mass - body.own_mass) * body.body_height
    assert (every[1] - every[0]) @ body.position == pytest.approx(-0.3 * arm, rel=1e-4)
    grade = cl.Profile((-1e3, 1e3), (-0.1, 0.1))
    long, track = replace(body, length=200.0), replace(four.track, grade=grade)
    rows = log.rows(replace(four, vehicle=long, track=track))
    under, behind = (rows.distance - x for x in (np.mean(body.position), 0.5 * (12.9 + 200.0)))
    mean = (body.own_mass * under + body.train_mass * behind) / body.mass
    assert rows.grade == pytest.approx(1e-4 * mean)


def noisy(name: str) -> Any:
    """The log of a run with the noise of its sensors."""
    log: Any = Log.of(run(name)[1])
    rng = np.random.default_rng(2)  # its clock seems shifted by 30 ms
    omega = log.omega + rng.normal(0.0, 0.02, log.omega.shape)
    return replace(log, omega=omega, speed=log.speed + rng.normal(0.0, 0.02, log.time.shape))


def changed(name: str, change: Callable[[np.ndarray], Any], axle: Any = slice(None)) -> Any:
    """A fault of a column: of one axle, or of all."""

    def fault(log: Log) -> Log:
        values = np.array(getattr(log, name))
        values.T[axle] = change(values.T[axle])
        return replace(log, **{name: values})

    return fault


FAULTS: Mapping[str, Callable[[Log], Log]] = {
    "omega_1.* is 3.6 times .* km/h; give the columns": changed("omega", lambda x: 3.6 * x),
    "omega_1.* is 0.278 times .* km/h": changed("speed", lambda x: 3.6 * x),
    "omega_1.* is 9.55 times .* 1/min": changed("omega", lambda x: 30.0 / math.pi * x),
    "drive_torque: .* take -(1|0.9.) times .*sign": changed("drive_torque", lambda x: -x),
    "drive_torque: .* take 0.(5|49) times its force": changed("drive_torque", lambda x: 2.0 * x),
    "drive_torque: .* take (1e.03|9.9e.02) times": changed("drive_torque", lambda x: 1e-3 * x),
    "omega_1 is 20 in all 1001 rows": changed("omega", lambda x: 0.0 * x + 20.0, 0),
    "(omega_1|speed) is .* times .* coasts; correct": changed("omega", lambda x: 1.03 * x, 0),
    "speed has steps of 0.15 m/s.*export": changed("speed", lambda x: np.round(x / 0.15) * 0.15),
    "speed follows drive_torque 0.0[78] s too early": changed(
        "drive_torque", lambda x: np.hstack([x[:, :16], x[:, :-16]])
    ),
}


@SHIPPED
@pytest.mark.parametrize("doubt", FAULTS)
def test_a_fault_is_doubted(name: str, doubt: str) -> None:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        FAULTS[doubt](Log.of(run(name)[1])).rows(run(name)[0])
    texts = [str(one.message) for one in found]
    assert [text for text in texts if re.match(doubt, text)], texts
    assert {one.filename for one in found} == {__file__}


@pytest.mark.parametrize("name", ["dry_wet_dry", "four_axles", "wheel_slide_protection"])
def test_a_clean_log_is_not_doubted(name: str) -> None:
    """Nor one without radar, whose times count from 1970, or whose wheels turn up unbraked."""
    log, other = noisy(name), Log.of(run(name)[1])
    for one in (log, other, replace(log, speed=None), replace(log, time=log.time + 1.7e9)):
        one.rows(run(name)[0])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"time": [0.0, 0.02, 0.02, 0.03]}, "line 4: time = 0.02 s must be > 0.02 s, that of the"),
        ({"time": [0.0, 0.02, 0.01, 0.03]}, "line 4: time = 0.01 s must be > 0.02 s"),
        ({"time": [0.0, "", 0.01, 0.03]}, "line 3: time = nan is out of range: must be finite"),
        ({"omega": [1.0, 2.0, "2e10", 4.0]}, "line 4: omega = 20000000000.0 is out of range: must"),
        ({"omega": {"omega_2": OMEGA}}, "line 1: omega_2, but the scenario has 1 axles"),
        ({"omega": {f"omega_{'9' * 5000}": OMEGA}}, "line 1: omega_999"),
        ({"omega": {f"x_{k}": OMEGA for k in range(10_000)}}, "10003 columns: must be <= 10000"),
        ({"omega": {"omega [km]": OMEGA}}, "omega_1 is in 'km', which is not a unit in rad/s"),
        ({"time": {"t": T}}, "line 1: no column 'time'; columns are t, omega"),
        ({"drive_torque": {}}, "axle 1 of 1 has no torque: give one of drive_torque_1, motor_"),
        ({"drive_torque": {"brake_torque": TORQUE}}, "line 3: the brake of axle 1 has -2000 N.m"),
        ({"drive_torque": [""] * 4}, "Log.drive_torque_1 has no number"),
        ({"omega": {}, "speed": {}}, "neither omega nor speed has a number"),
    ],
)
def test_refusals_of_files(tmp_path: Path, changed: Mapping[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"log.csv: .*{re.escape(message)}"):
        read_log(written(tmp_path, changed), braked())


def test_other_refusals(tmp_path: Path) -> None:
    case, four = braked(), run("four_axles")[0]
    path, log = written(tmp_path, {}), line()
    brake = case.drivetrain.brake
    assert brake is not None
    worn = replace(brake, pad_scale=0.5)
    pads = replace(case, drivetrain=replace(case.drivetrain, brake=worn))
    pressed = written(tmp_path / "pressure", {"drive_torque": {"cylinder_pressure": BRAKING}})
    calls: Mapping[str, Callable[[], object]] = {
        "no column is 'omga'; did you mean 'omega": lambda: read_log(path, case, {"omga": "x"}),
        "line 1: 0 columns 'x' in time, omega": lambda: read_log(path, case, {"omega": "x"}),
        "gives no torque where the pads' friction changes": lambda: read_log(pressed, pads),
        "axle 1 of 4 has no torque": lambda: read_log(path, four),
        "the log has 4 axles, and the scenario 1": lambda: log.rows(case),
        "row 2: time = 1.995 s must be > 2 s": lambda: replace(log, time=log.time[::-1]),
        "Log.speed has the shape (400,)": lambda: replace(log, speed=log.speed[1:]),
        "runs backward, at -10 m/s": lambda: replace(log, speed=-log.speed).rows(four),
        "never runs faster than 1 m/s": lambda: replace(log, speed=log.speed / 20).rows(four),
        "rows of 0.01 s: must be": lambda: replace(log, time=[*log.time[:-1], 1e9]).rows(four),
    }
    for message, call in calls.items():
        with pytest.raises(ValueError, match=re.escape(message)):
            call()
