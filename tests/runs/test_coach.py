"""A coach that brakes on contaminated rails, with wheel-slide protection and without radar."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import contactlib as cl
from contactlib.base.units import STANDARD_GRAVITY

WITHIN = 0.05  # of the speed: limit of the estimate's error


def coach(duration: float, *, slippery: bool = False, locks: bool = False) -> cl.Scenario:
    """The shipped scenario; with a radar if its wheels may lock, as no axle is then let free."""
    scenario = replace(cl.load_scenario("coach_braking.toml"), duration=duration)
    if slippery:
        track = cl.Track.from_breakpoints(distance=(0.0,), friction=(0.08,), unit="coefficient")
        scenario = replace(scenario, track=track)
    if locks:
        radar = replace(scenario.sensors, acceleration_limit=None, trial_time=None)
        scenario = replace(scenario, sensors=radar)
    return scenario


@pytest.mark.parametrize(
    ("braked", "train", "grade"), [("", 0.0, 0.0), ("braked = [1, 2, 4]", 20e3, -0.012)]
)
def test_a_stop_in_the_terms_of_braking_is_that_of_a_point_mass(
    tmp_path: Path, braked: str, train: float, grade: float
) -> None:
    """Brakes of a vehicle without resistance that build up to 95 % in 2 s, after 0.4 s."""
    text = Path("models/coach_braking.toml").read_text().split("[track]")[0]
    free = "[wheelset_changes.wheelset]\ndamping = 0.0\n"
    free += "[wheelset_changes.resistance]\nconstant = 0.0\nquadratic = 0.0\n"
    free += f"grade = {grade}"
    for old, new in (
        ("[demand]", f"{free}\n[demand]"),
        ("[vehicle]", f"[vehicle]\ntrain_mass = {train}\n{braked}"),
        ('"250 ms"', "0.25\npressure = '3.8 bar'\ntorque = 6e3"),
        ("fill_time = 0.25", "build_up_time = 2.0"),
        ('"40 ms"', "0.4"),
        ("duration = 45.0", "duration = 65.0"),
        ('"wet"', '"dry"'),
        ('time = [0.5, 1.5]\ntorque = [0.0, "-5.7 kN.m"]', "time = [0.5, 0.5]\nDEMAND"),
    ):
        assert old in text
        text = text.replace(old, new)
    open_loop = '[sensors]\n[controllers.open_loop]\nkind = "open_loop"\n'
    lag, first, v = 2.0 / np.log(20.0), 0.5 + 0.4, 160.0 / 3.6
    mass, inertia, r, n = 45e3 + train, 4 * 110.0, 0.46, 3 if braked else 4
    full = 0.9 * (mass + inertia / r**2)  # N
    terms = {
        "deceleration": 0.9,
        "brake_force": full,
        "pressure": full * r / n / 6e3 * 3.8e5,
        "torque": -full * r / n,
    }
    cases = dict[str, cl.Scenario]()
    for name, value in terms.items():
        file = tmp_path / "stop.toml"
        file.write_text(text.replace("DEMAND", f"{name} = [0.0, {value!r}]") + open_loop)
        cases[name] = cl.load_scenario(file)
        assert cases[name].demand.value[1] == pytest.approx(terms["torque"], rel=1e-12)
    run = cl.run_scenario(cases["pressure"], "open_loop", tolerance=1e-5)
    # v = b t + a (s - lag (1 - exp(-s/lag))) at s after the delay, with the last term gone.
    b = STANDARD_GRAVITY * grade * mass * 0.9 / full
    s = (v - b * first + 0.9 * lag) / (0.9 + b)
    t = first + s
    way = v * t - 0.5 * b * t**2 - 0.9 * (0.5 * s**2 - lag * s + lag**2)
    assert run["distance"][-1, 0] == pytest.approx(way, rel=2e-3)
    assert run["cylinder_pressure"].max() == pytest.approx(terms["pressure"], rel=1e-6)
    assert "cylinder_pressure" in run.units


def test_a_demand_of_braking_acts_against_the_motion(tmp_path: Path) -> None:
    """A motor's by its sign, on the axles that are named, however often."""
    brake = Path("models/coach_braking.toml").read_text()
    motor = re.sub(r"\[brake\].*?\n\n", "", brake, flags=re.DOTALL)
    found = []
    for text, speed, braked in (
        (brake, "-160 km/h", "[1, 2]"),
        (motor, "160 km/h", "[1, 1, 2]"),
        (motor, "-160 km/h", "[2, 1]"),
    ):
        text = text.replace('torque = [0.0, "-5.7 kN.m"]', 'brake_force = [0.0, "10 kN"]')
        text = text.replace("160 km/h", speed).replace("[vehicle]", f"[vehicle]\nbraked = {braked}")
        (tmp_path / "stop.toml").write_text(text)
        found.append(cl.load_scenario(tmp_path / "stop.toml").demand.value[1])
    assert found == pytest.approx([-2300.0, -2300.0, 2300.0], rel=1e-12)


def time_off(result: cl.Result) -> float:
    """Time for which the estimated speed errs by more than 5 % [s]."""
    speed, estimate = result["speed"], result["measured_speed"][:, 0]
    off = np.abs(estimate - speed) > WITHIN * speed
    return float(off[speed > 0.1].sum() * (result.time[1] - result.time[0]))


def speed_after(result: cl.Result) -> float:
    """Speed of the vehicle once its last axle leaves the contaminated rails [m/s]."""
    return float(result["speed"][np.searchsorted(result["distance"][:, 3], 300.0)])


def check(seeds: int, duration: float) -> None:
    cases = [coach(duration)] * seeds
    own = {"off": time_off, "after": speed_after}
    protected = cl.run_many(cases, "wsp", ["locked_time"], metrics=own)
    assert not protected["failed"].any()
    assert protected["locked_time"].max() < 0.4
    assert protected["off"].max() < 1.0
    (locked,) = cl.run_many([coach(9.0, locks=True)], "open_loop", metrics={"after": speed_after})[
        "after"
    ]
    assert protected["after"].max() < locked - 0.7


def test_no_axle_locks_and_the_estimate_holds_on_contaminated_rails() -> None:
    check(3, 9.0)


@pytest.mark.slow
def test_the_same_of_ten_whole_stops() -> None:
    check(10, 45.0)


@pytest.mark.slow
def test_locked_wheels_do_not_stop_where_protected_ones_do() -> None:
    """On rails that are contaminated all along."""
    names = ["stopping_distance", "distance", "locked_time"]
    wsp, locked = (
        cl.run_many([coach(70.0, slippery=True, locks=name == "open_loop")], name, names)
        for name in ("wsp", "open_loop")
    )
    assert wsp["locked_time"] == 0.0
    assert wsp["stopping_distance"] < 1500.0 < locked["distance"]
    assert np.isinf(locked["stopping_distance"])
    assert locked["locked_time"] > 50.0


@pytest.mark.slow
def test_locked_wheels_stop_sooner_where_friction_does_not_fall(tmp_path: Path) -> None:
    """All friction acts on them at all times, with the resistances, as on a point mass."""
    text = Path("models/coach_braking.toml").read_text()
    for old, new in (
        ('condition = "wet"', "slip_rate_residual = 1.0\nstatic = 0.5\nkinetic = 0.5"),
        ("distance = [300.0, 300.0]\nfriction = [0.08, 0.55]", "distance = [0]\nfriction = [0.08]"),
        ("acceleration_limit = 1.3\ntrial_time = 1.0\n", ""),
        ("160 km/h", "72 km/h"),
        ("[0.5, 1.5]", "[0.0, 0.1]"),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "stop.toml").write_text(text)
    case = cl.load_scenario(tmp_path / "stop.toml")
    names = ["stopping_distance", "locked_time"]
    locked, held = (cl.run_many([case], name, names) for name in ("open_loop", "wsp"))
    assert held["locked_time"] == 0.0
    assert locked["locked_time"] > 20.0
    force, quadratic = 0.08 * 45e3 * STANDARD_GRAVITY + 4.0 * 170.0, 4.0 * 0.9
    way = 45e3 / (2.0 * quadratic) * np.log(1.0 + quadratic * 20.0**2 / force)
    assert 1.0 < locked["stopping_distance"] / way < 1.02  # the brake fills first
    assert held["stopping_distance"] > 1.03 * locked["stopping_distance"]


@pytest.mark.slow
def test_a_stop_is_longer_than_on_uniform_friction() -> None:
    """On a rising grade with a map's friction: uniform friction keeps the grade, as run apart."""
    rails = cl.Track.from_breakpoints(distance=(0.0,), friction=(0.07,), unit="coefficient")
    track = replace(rails, grade=cl.Profile.of(0.004), cleaning=1e-5, recovered=2.0)
    bad = replace(coach(5.5), initial_speed=2.0, track=track)
    uniform = replace(bad, track=cl.Track(grade=track.grade))
    names = ["stopping_distance", "stopping_extension", "speed_error", "speed_misjudged"]
    found = cl.run_many([bad, uniform], "wsp", names, index=[3, 3], step=0.005, tolerance=1e-6)
    assert found["speed_misjudged"].tolist() == (found["speed_error"] > WITHIN * 2.0).tolist()
    stop, least = found["stopping_distance"]
    assert 1.1 * least < stop
    assert found["stopping_extension"].tolist() == [stop / least - 1.0, 0.0]
    run, even = (
        cl.run_scenario(case, "wsp", index=3, step=0.005, tolerance=1e-6) for case in (bad, uniform)
    )
    own = cl.metrics(run, bad.drivetrain, uniform=even)
    assert own.stopping_extension == pytest.approx(stop / least - 1.0, rel=1e-12)
    error = np.abs(run["measured_speed"].T - run["speed"]).max()
    assert own.speed_error == error == found["speed_error"][0]
    assert np.isnan(cl.metrics(run, bad.drivetrain).stopping_extension)


def test_a_wheelset_stops_later_on_wet_rails() -> None:
    """The error of its speed is that of its sensor."""
    track = cl.Track(friction_left=cl.Profile.of(0.4))
    wet = replace(cl.load_scenario("braking.toml"), initial_speed=2.0, duration=15.0, track=track)
    wet = replace(wet, sensors=cl.traction.Sensors(vehicle_speed_bias=-0.03))
    names = ["stopping_distance", "stopping_extension", "speed_error", "speed_misjudged"]
    found = cl.run_many([wet, replace(wet, track=cl.Track())], "threshold", names)
    stop, least = found["stopping_distance"]
    assert stop > least
    assert found["stopping_extension"].tolist() == [stop / least - 1.0, 0.0]
    assert found["speed_error"][0] == pytest.approx(0.03 * 2.0, rel=1e-9)
    assert found["speed_misjudged"][0] == 0.0
    creeps = replace(wet, initial_speed=0.05, duration=1.2)  # counts as stopped
    at_once = cl.run_many([creeps], "threshold", names[:2])
    assert at_once["stopping_distance"] == 0.0
    assert np.isnan(at_once["stopping_extension"])


def test_a_lock_turns_the_force_over_its_way_into_heat() -> None:
    """The slip work of each axle is that of its creep force on the way that the wheel slides."""
    case = replace(coach(4.5, slippery=True, locks=True), initial_speed=20.0)
    run = cl.run_scenario(case, "open_loop")
    found = cl.metrics(run, case.drivetrain)
    speed = run["speed"][:, np.newaxis]
    locked = np.abs(case.drivetrain.wheelset.radius * run["omega"]) < 0.05 * speed
    starts, every = locked.argmax(axis=0), np.arange(4)
    assert locked[-1].all()
    assert (locked.sum(axis=0) == run.time.size - starts).all()  # each locks once and stays
    work, way = (run[name][-1] - run[name][starts, every] for name in ("creep_work", "distance"))
    assert found.locked_work == pytest.approx(work.max(), rel=1e-14)
    assert found.locked_time == pytest.approx(run.time[-1] - run.time[starts.min()], rel=1e-12)
    lasts = run.time[-1] - run.time[starts]
    for later in lasts:  # the end of a run in which fewer axles lock
        part = replace(case, duration=float(case.duration - later))
        share = cl.run_many([part], "open_loop", ["locked_axles"], step=0.005)["locked_axles"]
        assert share == np.mean(lasts > later)
    np.testing.assert_allclose(work, -run["creep_force"][-200:].mean(axis=0) * way, rtol=0.02)


def test_the_estimate_backward_is_that_forward() -> None:
    """A brake acts against the motion, so the fastest wheel counts both ways."""
    forward = replace(
        coach(4.0, slippery=True),
        initial_speed=15.0,
        sensors=cl.traction.Sensors(acceleration_limit=1.0),
    )
    backward = replace(forward, initial_speed=-15.0)
    ahead, back = (cl.run_scenario(case, "open_loop") for case in (forward, backward))
    assert ahead["slip_velocity"].min() < -10.0
    for name in ("speed", "measured_speed"):
        np.testing.assert_allclose(back[name], -ahead[name], atol=3e-3)  # steady only forward
