"""Metrics of made-up runs, whose numbers are known."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from plain_scenario import plain_scenario

import contactlib as cl
from contactlib.runs.accumulators import WINDOW as JERK_WINDOW
from contactlib.runs.accumulators import DerivedRows, DrivetrainArrays, OneRun, Recovery, _known
from contactlib.runs.outcomes import (
    Metrics,
    comparison_table,
    metrics,
    write_comparison,
)
from contactlib.runs.signals import WORKS
from contactlib.vehicle import Axle, Drivetrain, Resistance

BOTH = ("omega", "creepage", "friction_scale")
MOTIONS = ("speed", "acceleration", "distance")
ENERGIES = (*WORKS, "stored_energy", "energy_defect")
LEVEL = 40e3  # force that all of these runs could transmit [N]


def run_of(time: ArrayLike, **signals: ArrayLike) -> cl.Result:
    """A run with these signals; both wheels do the same, and what is not given is zero.

    The demand is commanded.
    """
    t = np.asarray(time, dtype=np.float64)
    given: dict[str, Any] = {"available_force": LEVEL, "friction_scale": 1.0, **signals}
    given.setdefault("commanded_torque", given.get("demand", 0.0))
    given.setdefault("falling_branch", 0.0)
    given.setdefault("measured_speed", given.get("speed", 0.0))
    for side in ("left", "right"):
        force = 0.5 * np.asarray(given.get("creep_force", 0.0))
        given.setdefault(f"creep_force_{side}", force)
    for name in BOTH:
        for side in ("left", "right"):
            given.setdefault(f"{name}_{side}", given.get(name, 0.0))
    names = *MOTIONS, "demand", "creep_force", "axle_torque", "brake_torque", *ENERGIES
    columns = {name: np.broadcast_to(given.get(name, 0.0), t.shape) for name in (*given, *names)}
    columns = {name: np.array(column, dtype=np.float64) for name, column in columns.items()}
    return cl.Result(t, columns, dict.fromkeys(columns, "1"))


def transmittable(run: cl.Result, drivetrain: Drivetrain) -> tuple[Any, Any]:
    """Creep force in the demand's direction, and what could be transmitted [N]."""
    return DerivedRows(OneRun(run), DrivetrainArrays.of([drivetrain])).transmittable


@pytest.fixture(scope="module")
def lossless(locomotive: cl.Model) -> Drivetrain:
    """A free drivetrain without damping and resistance."""
    wheelset = replace(locomotive.wheelset, damping=0.0, resistance=Resistance())
    return Drivetrain(wheelset)


@pytest.fixture(scope="module")
def held(rig: cl.Model) -> Drivetrain:
    """A drivetrain without damping at a held speed, whose force at the demand is demand/r."""
    return Drivetrain(replace(rig.wheelset, damping=0.0))


TIME = np.linspace(0.0, 10.0, 101)
EARLY = TIME < 5.0


@pytest.mark.parametrize(
    ("force", "demand", "expected"),
    [
        # Trapezoid: the drop takes one interval, and half of it counts.
        (np.where(EARLY, 1.0, 0.5), 1e6, 0.75 - 0.0025),
        # The demand is less than friction allows: that is all that can be used.
        (0.3, 0.5 * LEVEL * 0.3, 1.0),
        # Half of the time there is no demand, which does not count.
        (0.6, np.where(EARLY, 1e6, 0.0), 0.6),
        (1.0, 0.0, math.nan),
        # Force beyond the demand does not make up for what was lost.
        (np.where(EARLY, 0.2, 0.4), 0.5 * 0.3 * LEVEL, 0.5 * (0.2 / 0.3 + 1.0) + 0.005 / 3.0),
        # Force against the demand is not used.
        (-0.8, -1e6, 0.8),
        (-0.8, 1e6, -0.8),
    ],
)
def test_utilisation_is_the_part_of_what_could_be_transmitted(
    held: Drivetrain, force: ArrayLike, demand: ArrayLike, expected: float
) -> None:
    run = run_of(TIME, creep_force=LEVEL * np.asarray(force), demand=demand)
    utilisation = metrics(run, held).utilisation
    assert utilisation == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_limited_utilisation_is_that_of_the_time_in_which_friction_limits(
    held: Drivetrain,
) -> None:
    # Half of the time the demand is a tenth of what is available, and is met; for a tenth
    # of the time it is zero; else friction limits, and three quarters are used.
    time = TIME
    demand = np.select([time < 4.95, time < 8.95], [0.5 * 0.1 * LEVEL, 1e6], 0.0)
    force = np.where(time < 4.95, 0.1, 0.75) * LEVEL
    outcomes = metrics(run_of(time, creep_force=force, demand=demand), held)
    assert outcomes.limited_utilisation == pytest.approx(0.75, rel=1e-12)
    # 4.95 s at a tenth (the trapezoid's last interval ends at 1), 4 s at the level.
    assert outcomes.utilisation > 0.775
    # A wheel that is braked and yet driven loses as much as one that transmits nothing, and more.
    against = run_of(time, creep_force=-0.5 * LEVEL, demand=1e6)
    assert metrics(against, held).limited_utilisation == pytest.approx(-0.5, rel=1e-12)
    unlimited = run_of(time, creep_force=0.1 * LEVEL, demand=0.5 * 0.1 * LEVEL)
    assert math.isnan(metrics(unlimited, held).limited_utilisation)


@pytest.mark.parametrize(
    ("force", "rim", "speed", "share"),
    [
        (2e4, 12.0, 10.0, 2.0 / 12.0),  # drives
        (-2e4, 8.0, 10.0, 2.0 / 10.0),  # brakes
        (-2e4, 0.0, 10.0, 1.0),  # locked
        (2e4, 9.0, 0.0, 1.0),  # spins beside a vehicle that stands
        (-2e4, -4.0, 10.0, 1.0),  # turns backward: both put work into the contact
        (2e4, -8.0, -10.0, 2.0 / 10.0),  # brakes while rolling backward
        (2e4, 300.0, 2.0, 298.0 / 300.0),
        (0.0, 10.0, 10.0, math.nan),
    ],
)
def test_slip_share_is_the_part_of_the_work_that_becomes_heat(
    held: Drivetrain, force: float, rim: float, speed: float, share: float
) -> None:
    time = np.linspace(0.0, 2.0, 21)
    heat = force * (rim - speed)
    omega = rim / held.wheelset.radius
    run = run_of(time, creep_force=force, omega=omega, speed=speed, creep_work=heat * time)
    assert metrics(run, held).slip_share == pytest.approx(share, rel=1e-12, nan_ok=True)


def test_slip_share_of_a_wheel_that_slips_away_stays_below_one() -> None:
    scenario = replace(cl.load_scenario("dry_wet_dry.toml"), duration=6.0)
    run = cl.run_scenario(scenario, "open_loop")
    outcomes = metrics(run, scenario.drivetrain)
    at_rail = np.trapezoid(np.abs(run["creep_force"] * run["speed"]), run.time)
    assert outcomes.slip_work > at_rail
    assert outcomes.slip_share == pytest.approx(
        outcomes.slip_work / (outcomes.slip_work + at_rail), rel=0.02
    )


@pytest.mark.parametrize("creepage", [1e-4, 0.004, 0.012])
def test_demanded_force_is_that_of_a_steady_wheelset(creepage: float, lossless: Drivetrain) -> None:
    wheelset = lossless.wheelset
    force = float(wheelset.element.at_creepage(creepage, speed=10.0)["creep_force"])
    torque = cl.stability.quasi_steady_torque(wheelset, creepage, speed=10.0)
    assert wheelset.mass is not None
    signals = {"creep_force": force, "acceleration": force / wheelset.mass, "speed": 10.0}
    run = run_of([0.0, 1.0], demand=torque, available_force=1e9, **signals)
    used, possible = transmittable(run, lossless)
    turning = wheelset.inertia / (wheelset.mass * wheelset.radius**2)
    # The two differ by the creepage in what turns the wheelset along with the vehicle.
    assert possible[0] / used[0] - 1.0 == pytest.approx(creepage * turning / (1.0 + turning))


def test_damping_takes_its_part_of_the_demand(rig: cl.Model) -> None:
    drivetrain, point = (
        Drivetrain(rig.wheelset),
        rig.wheelset.balanced(creepage=0.0, speed=20.0),
    )
    run = run_of([0.0, 1.0], demand=point.drive_torque, speed=20.0)
    _, possible = transmittable(run, drivetrain)
    np.testing.assert_allclose(possible, 0.0, atol=1e-9)


def test_utilisation_of_a_simulated_run_that_does_not_slip(locomotive: cl.Model) -> None:
    wheelset = locomotive.wheelset
    step = cl.TorqueControl(cl.Profile((0.0, 2.0, 2.0), (15e3, 15e3, 22e3)))
    scenario = plain_scenario(wheelset, duration=6.0)
    run = cl.run_scenario(scenario, step)
    outcomes = metrics(run, scenario.drivetrain)
    assert outcomes.utilisation == pytest.approx(1.0, abs=2e-3)
    assert outcomes.recovery_time < 0.05
    assert outcomes.largest_slip_speed == pytest.approx(np.abs(run["slip_velocity"]).max())
    # The force steps by 7 kN.m/r, but for what is left to come after a window.
    turning = wheelset.inertia / wheelset.radius**2
    assert outcomes.jerk == pytest.approx(14e3 / (142.5e3 + turning) / JERK_WINDOW, rel=0.05)


def test_a_wheel_that_rolls_uses_all_of_the_force(locomotive: cl.Model, rig: cl.Model) -> None:
    # Downhill under next to no torque the rail turns the wheelset; so do rollers that speed up.
    hill = Resistance(constant=300.0, linear=20.0, grade=-0.03)
    heavy = replace(locomotive.wheelset, mass=20e3, inertia=300.0, resistance=hill)
    cases = [
        (Drivetrain(heavy), 1e3, None),
        (Drivetrain(rig.wheelset), 15e3, cl.Profile((0.0, 5.0), (10.0, 20.0))),
    ]
    for drivetrain, torque, held_speed in cases:
        case = plain_scenario(
            drivetrain, demand=cl.Profile.of(torque), held_speed=held_speed, duration=4.0
        )
        run = cl.run_scenario(case, "open_loop")
        assert metrics(run, drivetrain).utilisation == pytest.approx(1.0, abs=2e-3)
        assert run["creepage"][0] == pytest.approx(run["creepage"][4], rel=1e-3)  # starts steady


RECOVERY_TIME = np.linspace(0.0, 10.0, 1001)


def recovery_time(held: Drivetrain, lacking: list[tuple[float, float]], part: float = 0.5) -> float:
    """Of a run that has only this part of the force at times."""
    t = RECOVERY_TIME
    lacks = np.any([(t >= a - 1e-9) & (t < b - 1e-9) for a, b in lacking], axis=0)
    force = np.where(lacks, part, 0.95) * LEVEL
    slips = run_of(t, creep_force=force, demand=1e6, falling_branch=np.where(lacks, 1.0, 0.0))
    cut = run_of(t, creep_force=force, demand=1e6, commanded_torque=np.where(lacks, 7.9e5, 1e6))
    time, other = (metrics(run, held).recovery_time for run in (slips, cut))
    assert time == other  # whether the wheel slips or slip control reduces its torque
    return time


def test_a_drive_that_follows_slowly_does_not_begin_a_recovery(held: Drivetrain) -> None:
    """The force lacks from 1 s to 3 s, as a brake fills; from 2 s on the wheel slips."""
    t = RECOVERY_TIME
    demand = 1e6 * np.clip(t - 1.0, 0.0, 0.2)
    force = LEVEL * np.where((t > 1.0) & (t < 3.0), 0.3, 0.95)
    sampled = np.where(t < 1.2, 0.98 * np.roll(demand, 9), demand)  # 90 ms late
    for falling, expected in ((0.0, 0.0), (np.where((t > 2.0) & (t < 2.1), 1.0, 0.0), 0.99)):
        run = run_of(
            t, creep_force=force, demand=demand, commanded_torque=sampled, falling_branch=falling
        )
        assert metrics(run, held).recovery_time == pytest.approx(expected, abs=1e-9)


def test_a_brake_that_fills_on_good_rails_loses_no_force() -> None:
    scenario = cl.load_scenario("wheel_slide_protection.toml")
    rails = cl.Track(friction_left=cl.Profile.of(1.0))
    demand = cl.Profile((0.1, 0.1), (0.0, -10e3))
    case = replace(scenario, track=rails, demand=demand, duration=3.0)
    for name in scenario.controllers:
        run = cl.run_scenario(case, name)
        used, possible = transmittable(run, scenario.drivetrain)
        assert (used < 0.8 * possible).sum() * run.time[1] > 0.2
        assert metrics(run, scenario.drivetrain).recovery_time == 0.0


def dips(start: float, length: float, every: float) -> list[tuple[float, float]]:
    return [(begin, begin + length) for begin in np.arange(start, 9.9, every)]


@pytest.mark.parametrize(
    ("lacking", "part", "expected"),
    [
        ([(11.0, 12.0)], 0.5, 0.0),
        ([(2.0, 3.5)], 0.5, 1.5),
        ([(2.0, 2.5), (3.0, 3.5)], 0.5, 1.5),  # in the mean of the next second it is not back
        ([(2.0, 2.5), (3.6, 4.0)], 0.5, 0.5),  # each by itself, the longest
        ([(2.0, 2.5), (2.8, 3.1)], 0.5, 0.5),  # 0.815 in the mean of the next second
        ([(2.0, 2.5), (2.8, 3.2)], 0.5, 1.2),  # 0.77
        ([(2.0, 11.0)], 0.5, math.inf),
        ([(9.0, 9.5)], 0.5, math.inf),  # too late to know: 0.725 in the last second
        ([(9.5, 11.0)], 0.5, math.inf),
        ([(9.9, 11.0)], 0.5, 0.1),  # the end falls into a dip
        ([(2.0, 3.5)], 0.79, 1.5),
        ([(2.0, 3.5)], 0.81, 0.0),
        # The dips of a limit cycle are not one long recovery: 0.86 of the force in the mean.
        ([(2.0, 2.6), *dips(2.8, 0.04, 0.2)], 0.5, 0.6),
        # With 0.725 in the mean, they are a loss that does not end.
        ([(2.0, 2.6), *dips(2.8, 0.1, 0.2)], 0.5, math.inf),
    ],
)
def test_recovery_time(
    held: Drivetrain, lacking: list[tuple[float, float]], part: float, expected: float
) -> None:
    assert recovery_time(held, lacking, part) == pytest.approx(expected, abs=1e-9)


def test_a_short_dip_more_or_less_does_not_decide_the_recovery(held: Drivetrain) -> None:
    short = dips(2.9, 0.03, 0.4)
    for i in range(len(short)):
        lacking = [(2.0, 2.6), *short[:i], *short[i + 1 :]]
        assert recovery_time(held, lacking) == pytest.approx(0.6)


def test_cut_and_reapply_recovers_from_each_of_its_cuts() -> None:
    scenario = cl.load_scenario("dry_wet_dry.toml")
    run = cl.run_scenario(scenario, "threshold")
    used, possible = transmittable(run, scenario.drivetrain)
    cuts = np.count_nonzero(np.diff((used < 0.8 * possible).astype(int), axis=0) == 1)
    assert cuts > 15
    outcomes = metrics(run, scenario.drivetrain)
    assert 0.0 < outcomes.recovery_time < 1.5
    assert outcomes.limited_utilisation < outcomes.utilisation - 0.03


def test_without_demand_no_force_is_lacking(held: Drivetrain) -> None:
    idle = run_of(RECOVERY_TIME, creep_force=0.0, demand=0.0)
    assert metrics(idle, held).recovery_time == 0.0


def test_recovery_does_not_depend_on_how_rows_come(held: Drivetrain) -> None:
    t, rng = RECOVERY_TIME, np.random.default_rng(5)
    demand = 1e6 + 2e5 * rng.standard_normal(t.size)
    run = run_of(
        t,
        creep_force=rng.uniform(0.5, 1.2, t.size) * LEVEL,
        demand=demand,
        commanded_torque=rng.uniform(0.5, 1.0, t.size) * demand,
    )
    drivetrains = DrivetrainArrays.of([held])
    observer = Recovery(drivetrains)
    for part in np.split(np.arange(t.size), [1, 2, 90, 91, 400]):
        signals = {name: values[part] for name, values in run.signals.items()}
        piece = cl.Result(t[part], signals, dict.fromkeys(signals, "1"))
        observer.add(DerivedRows(OneRun(piece), drivetrains))
    assert observer.value()[0] == metrics(run, held).recovery_time > 0.0


def test_jerk_is_the_second_difference_of_speed(lossless: Drivetrain) -> None:
    t = np.linspace(0.0, 4.0, 4001)
    smooth = run_of(t, speed=5.0 + 2.0 * t + 0.5 * 1.7 * t**2)
    assert metrics(smooth, lossless).jerk == pytest.approx(1.7, rel=1e-9)
    step = run_of(t, speed=5.0 + 0.3 * np.maximum(t - 2.0, 0.0))
    assert metrics(step, lossless).jerk == pytest.approx(0.3 / JERK_WINDOW, rel=1e-9)
    short = run_of([0.0, 1.9 * JERK_WINDOW], speed=5.0)
    assert math.isnan(metrics(short, lossless).jerk)


def test_extremes_sums_and_what_does_not_apply(held: Drivetrain, lossless: Drivetrain) -> None:
    run = run_of(
        [0.0, 1.0, 2.0],
        speed=10.0,
        omega_left=[20.0, 20.4, 20.0],
        omega_right=[20.0, 18.0, 20.0],
        creepage_left=[0.0, 0.02, 0.0],
        creepage_right=[0.0, -0.1, 0.0],
        axle_torque=[0.0, -7e3, 5e3],
        distance=[5.0, 15.0, 25.0],
        creep_work=[1e3, 2e3, 6e3],
        drive_work=[0.0, 5e3, -2e4],
        energy_defect=[0.0, -3e-4, 1e-4],
    )
    rigid = metrics(run, held)
    assert rigid.largest_slip_speed == pytest.approx(1.0)
    assert rigid.largest_creepage == 0.1
    assert rigid.slip_work == 5e3
    assert rigid.slip_share == 1.0  # nothing is transmitted
    assert rigid.distance == 20.0
    assert rigid.energy_defect == pytest.approx(3e-4 / 2.5e4)
    assert math.isnan(rigid.jerk)
    assert math.isnan(rigid.torsional_peak)
    elastic = replace(lossless, axle=Axle(stiffness=6e6))
    assert metrics(run, elastic).torsional_peak == 7e3
    assert metrics(run_of([0.0, 1.0]), held).energy_defect == 0.0


def test_a_wheel_beside_a_vehicle_that_stands_has_no_creepage(held: Drivetrain) -> None:
    """Its slip over almost no speed is any number; a run that stands has none."""
    slowest = held.wheelset.element.minimum_speed
    for speed, largest in (([10.0, slowest, 0.9 * slowest], 0.5), (0.0, math.nan)):
        run = run_of([0.0, 1.0, 2.0], speed=speed, creepage_left=[0.0, -0.5, -310.0])
        assert metrics(run, held).largest_creepage == pytest.approx(largest, nan_ok=True)


def test_an_outcome_without_rows_has_no_value() -> None:
    with pytest.raises(ValueError, match="there is no row yet"):
        _known(None)


NUMBERS = 0.9312345678, 0.9, 0.02, 0.2, math.inf, 3e4, 0.01, 1.5, math.nan, 120.0, 1e-9
RUN = Metrics(*NUMBERS, 90.0, 0.2, 0.1, 0.0, 0.0, 1.1)


def test_comparison_files_hold_every_number(tmp_path: Path) -> None:
    runs = {"creep, PI": RUN, "open_loop": RUN._replace(recovery_time=0.25)}
    paths = write_comparison(tmp_path, runs)
    assert [path.name for path in paths] == ["metrics.txt", "metrics.csv", "metrics.json"]
    assert paths[0].read_text() == comparison_table(runs) + "\n"
    with paths[1].open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:2] == ["controller", "utilisation [1]"]
    assert [row[0] for row in rows] == list(runs)
    for row, run in zip(rows, runs.values(), strict=True):
        np.testing.assert_array_equal([float(cell) for cell in row[1:]], list(run))
    written = json.loads(paths[2].read_text())
    assert written["creep, PI"]["recovery_time"] == {"value": "never", "unit": "s"}
    assert written["creep, PI"]["torsional_peak"] == {"value": None, "unit": "N.m"}
    assert written["open_loop"]["utilisation"]["value"] == RUN.utilisation


def test_table_has_a_line_for_each_metric_that_applies() -> None:
    *lines, why = comparison_table({"a": RUN, "b": RUN}).splitlines()
    assert why == "- recovery time: does not recover"
    names = [name for name in Metrics._fields if name != "torsional_peak"]
    assert [line.split("  ")[0].replace(" ", "_") for line in lines[1:]] == names
    assert {len(line) for line in lines} == {len(lines[0])}
    elastic = RUN._replace(torsional_peak=7e3)
    assert "- torsional peak: rigid axle" in comparison_table({"a": RUN, "b": elastic})


@pytest.mark.parametrize(
    ("demand", "last", "way"), [(2e4, 8.0, math.nan), (-2e4, 0.0, 15.0), (-2e4, 8.0, math.inf)]
)
def test_only_a_run_that_brakes_has_a_stop(
    held: Drivetrain, demand: float, last: float, way: float
) -> None:
    given = {"demand": [0.0, demand, demand], "speed": [10.0, 10.0, last]}
    found = metrics(run_of([0.0, 1.0, 3.0], distance=[0.0, 10.0, 25.0], **given), held)
    assert found.stopping_distance == pytest.approx(way, nan_ok=True)
    text = comparison_table({"a": found}, within="3 s")
    assert ("- stopping distance: does not stop within 3 s" in text) == math.isinf(way)
    assert ("stopping distance" in text) == (demand < 0.0)
    assert "air used" not in text  # there is no brake
