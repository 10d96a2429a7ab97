"""The page of a braking or traction run: what is drawn and stated, against the run."""

from __future__ import annotations

from dataclasses import replace

import figure_checks as checks
import numpy as np
import pytest
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.figures import run_diagram
from contactlib.figures.diagram import _course, _heading
from contactlib.runs import Metrics

BRAKE = cl.vehicle.Brake(fill_time=0.1, vent_time=0.1, pressure=4e5, torque=1e4)
NONE = Metrics(*[0.0] * len(Metrics._fields))


def stop(scenario: cl.Scenario, *, to: float = 0.0) -> cl.Result:
    """From 20 m/s, at 2 m/s2 from the first demand at 1 s on."""
    time = np.linspace(0.0, 14.0, 2801)
    braked = np.maximum(time - 1.0, 0.0)
    names = cl.run_scenario(replace(scenario, track=cl.Track(), duration=0.02), "open_loop").units
    speed = np.maximum(20.0 - 2.0 * braked, to)
    signals = {name: np.ones_like(time) for name in names} | {
        "speed": speed,
        "demand": np.where(time < 1.0, 0.0, -1e4),
        "distance": np.cumsum(speed) * time[1],
        "omega_left": speed / scenario.drivetrain.wheelset.radius,
        "omega_right": 0.5 * speed / scenario.drivetrain.wheelset.radius,
    }
    return cl.Result(time, signals, names)


def test_a_heading_is_that_of_constant_deceleration() -> None:
    case = cl.load_scenario("wheel_slide_protection.toml")
    page = run_diagram(stop(case), NONE, case, "wsp", file="mine.toml")
    name, what, course, _ = page.get_suptitle().splitlines()
    assert (name, what) == (case.name, "a wheelset with 22.5 t; wheel-slide protection")
    of_stop = "72.0 km/h to standstill: 100 m in 10.0 s from the first demand"
    assert course == f"{of_stop}, mean deceleration 2 m/s$^2$"
    settings, foot = page.get_supxlabel().splitlines()
    assert foot == f"contactlib {cl.__version__}   mine.toml"
    rails = "Rails: factor on friction 0.35, 0.2 from 200 m, 0.35 from 300 m"
    assert settings == f"{rails}; brake: 0.04 s of delay, then 95 % in 0.749 s."
    run = stop(case, to=10.0)
    _, _, course, _ = _heading(run, NONE, case, "wsp", _course(run, case)).splitlines()
    assert course.startswith("72.0 km/h to 36.0 km/h, no stop: 155 m in 13.0 s")
    held = {**run.signals, "speed": -1e-9 * run["speed"]}  # a brake holds it on a grade
    assert not _course(cl.Result(run.time, held, run.units), case).brakes


def test_a_page_has_all_signals_of_all_axles() -> None:
    coach = cl.load_scenario("coach_braking.toml")
    train = replace(coach.drivetrain, brake=BRAKE)
    case = replace(coach, drivetrain=train, initial_speed=2.0, duration=4.5)
    run = cl.run_scenario(case, "wsp", tolerance=1e-4)
    of_run = run, cl.metrics(run, train), case, "wsp"
    with pytest.raises(ValueError, match=r"slip_limits = \[1\.0\] must be two numbers"):
        run_diagram(*of_run, slip_limits=(1.0,))
    page = run_diagram(*of_run, caption="A coach.", slip_limits=(1.0, 2.0))
    for check in (checks.check_axes, checks.check_layout, checks.check_styles):
        check(page)
    assert page.get_size_inches() * 25.4 == pytest.approx((210.0, 297.0), abs=0.1)
    speed, slip, pressure, *strips, air = page.axes
    time, vehicle, _ = checks.lines(speed, "vehicle")
    rows = slice(time.size)
    assert_allclose(vehicle, 3.6 * run["speed"][rows])
    assert vehicle[-1] < 0.36 <= vehicle[-2]  # 0.1 m/s is a stop
    (band,) = slip.patches
    assert_allclose(band.get_extents().transformed(slip.transData.inverted()).intervaly, (3.6, 7.2))
    for number, strip in enumerate(strips, start=1):
        name, axle = f"axle {number}", run.axle(number)
        assert_allclose(checks.lines(slip, name)[1], 3.6 * np.abs(axle["slip_velocity"][rows]))
        assert_allclose(checks.lines(pressure, name)[1], 40e-5 * axle["brake_torque"][rows])
        used = checks.lines(strip, f"{name} used")[1] * axle["axle_load"][rows]
        assert_allclose(used, np.abs(axle["creep_force"][rows]))
    assert checks.lines(pressure, "demand")[1].max() == pytest.approx(40e-5 * 5.7e3)
    stopped = cl.Result(time, {n: y[rows] for n, y in run.signals.items()}, run.units)
    vented = cl.metrics(stopped, train).air_used
    assert checks.lines(air, "vented")[1][-1] == pytest.approx(vented, abs=1e-12)
