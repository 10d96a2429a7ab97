"""Wheel-slide protection: the three positions of its valve, and stops on slippery rails."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import contactlib as cl
from contactlib.traction import Measurement, Sensors, WheelSlideProtection
from contactlib.vehicle import Brake, Drivetrain

BRAKE = Brake(fill_time=0.25, vent_time=0.12)
QUICK = {"wheel_filter_time": 0.0, "speed_filter_time": 0.0}
DEMAND = -1e4


def wsp(locomotive: cl.Model, **given: float) -> WheelSlideProtection:
    train = Drivetrain(locomotive.wheelset, brake=BRAKE)
    return WheelSlideProtection.for_drivetrain(train, speed=20.0, sensors=Sensors(), **given)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("slip", "acceleration", "position"),
    [
        (0.01, -9.0, "vent"),
        (0.01, 0.0, "fill"),
        (0.01, 3.0, "fill"),
        (0.10, -9.0, "vent"),
        (0.10, 0.0, "hold"),
        (0.10, 3.0, "hold"),
        (0.30, -9.0, "vent"),
        (0.30, 0.0, "vent"),
        (0.30, 3.0, "hold"),
    ],
)
def test_the_valve_has_three_positions(
    locomotive: cl.Model, slip: float, acceleration: float, position: str, way: float
) -> None:
    """The table of the module's docstring, in either direction of travel."""
    control = wsp(locomotive, **QUICK)
    vehicle, step = 20.0, control.sample_time

    def seen(wheel: float) -> Measurement[Any]:
        return Measurement(way * DEMAND, way * wheel, way * vehicle, 0.4 * way * DEMAND)

    wheel = (1.0 - slip) * vehicle
    memory = control.start(seen(wheel - acceleration * step), 0.4 * way * DEMAND)
    torque, memory = control.sample(seen(wheel), memory)
    torque = way * torque
    expected = {"vent": 0.0, "hold": 0.4 * DEMAND, "fill": DEMAND}[position]
    assert torque == pytest.approx(expected)
    time = {"vent": BRAKE.vent_time, "hold": np.inf, "fill": BRAKE.fill_time}[position]
    followed = expected + (0.4 * DEMAND - expected) * np.exp(-step / time)
    assert -memory.pressure == pytest.approx(followed)


def commanded(control: WheelSlideProtection, slips: list[float]) -> list[float]:
    """Torque / demand under one slip after another at 20 m/s, from a full cylinder on."""

    def seen(slip: float) -> Measurement[Any]:
        return Measurement(DEMAND, 20.0 * (1.0 - slip), 20.0, DEMAND)

    memory, shares = control.start(seen(slips[0]), DEMAND), []
    for slip in slips:
        torque, memory = control.sample(seen(slip), memory)
        shares.append(float(torque) / DEMAND)
    return shares


def test_after_a_slide_the_pressure_rises_in_steps(locomotive: cl.Model) -> None:
    """Each pulse fills the same part of what is missing, until the pressure is that demanded."""
    control = wsp(locomotive, **QUICK, fill_pulse=0.05, fill_pause=0.15)
    vents, sticks = [0.3] * 200, [0.0] * 300
    shares = commanded(control, [*sticks, *vents, *sticks])
    assert shares[:300] == [1.0] * 300  # before a slide there are no pulses
    assert shares[300:500] == [0.0] * 200
    after, missing = np.array(shares[500:]), 1.0
    for pulse in range(15):
        period = after[20 * pulse : 20 * pulse + 20]
        missing *= np.exp(-0.05 / BRAKE.fill_time)
        if missing < 0.05:
            assert (period[5:] == 1.0).all()  # it has reached the demand
            break
        assert (period[:5] == 1.0).all()
        np.testing.assert_allclose(period[5:], 1.0 - missing, atol=1e-6)
    assert pulse == 14
    assert commanded(replace(control, fill_pause=0.0), [*vents, *sticks])[200:] == [1.0] * 300


def test_a_watchdog_ends_a_long_venting(locomotive: cl.Model) -> None:
    """Also one with holding in between, once the cylinder is empty; not one that filling ends."""
    control = wsp(locomotive, **QUICK, watchdog_time=2.0, fill_pause=0.0)
    assert commanded(control, [0.3] * 300) == [0.0] * 200 + [1.0] * 100
    held = commanded(control, [0.3] * 60 + [0.1] * 140 + [0.3] * 100)
    assert max(held[:200]) < 0.01
    assert held[200:] == [1.0] * 100
    filled = commanded(control, [0.3] * 150 + [0.0] + [0.3] * 150)
    assert filled[:150] + filled[151:] == [0.0] * 300
    again = commanded(control, [0.3] * 250 + [0.0] * 50 + [0.3] * 100)
    assert again[300:] == [0.0] * 100


def test_it_expects_the_brake_s_torque(locomotive: cl.Model) -> None:
    """The pressure in its memory is that of the brake after the dead time, so it can hold it."""
    case = cl.load_scenario("wheel_slide_protection.toml")
    brake, plant = case.drivetrain.brake, cl.Plant(case)
    assert brake is not None
    control, late = case.controller("wsp"), round(brake.delay / 0.01)
    assert isinstance(control, WheelSlideProtection)
    measured = plant.reset()
    memory = control.start(measured, 0.0)
    expected, actual = [], []
    for _ in range(800):
        expected.append(float(memory.pressure))
        actual.append(-plant["drive_torque"])
        torque, memory = control.sample(measured, memory)
        measured = plant.step(torque)
    np.testing.assert_allclose(actual[late:], expected[:-late], atol=5.0)
    assert np.ptp(expected) > 5e3


def test_thresholds_are_clear_of_the_noise(locomotive: cl.Model) -> None:
    wide = Sensors(wheel_speed_noise=0.1, vehicle_speed_noise=0.05, seed=2)
    train = Drivetrain(locomotive.wheelset, brake=BRAKE)
    control = WheelSlideProtection.for_drivetrain(train, speed=1.0, sensors=wide)
    reader = wide.reader(20, control.sample_time)
    demand, rolling = np.full(20, DEMAND), np.full(20, 1.0)
    memory, signals = None, []
    for _ in range(2000):
        measured = Measurement(demand, *reader.read(rolling, rolling, demand), demand)
        memory = memory or control.start(measured, demand)
        torque, memory = control.sample(measured, memory)
        signals.append((memory.vehicle.speed - memory.wheel_speed, memory.wheel_speed))
        assert (torque == demand).all()
    slip, wheel = np.array(signals)[500:].transpose(1, 0, 2)
    spread = slip.std(), np.diff(wheel, axis=0).std() / control.sample_time
    assert spread == pytest.approx(control.noise(wide), rel=0.05)


def test_driving_is_not_controlled(locomotive: cl.Model) -> None:
    control = wsp(locomotive)
    seen: Measurement[Any] = Measurement(2e4, 15.0, 10.0, 2e4)
    assert control.sample(seen, control.start(seen, 2e4))[0] == 2e4


@pytest.mark.slow
def test_it_stops_earlier_than_locked_wheels_and_keeps_them_turning() -> None:
    """Friction falls with slip speed; the brake, the rails and the noise are those of the file."""
    case = cl.load_scenario("wheel_slide_protection.toml")
    runs = {name: cl.run_scenario(case, name) for name in ("open_loop", "wsp")}
    for run in runs.values():
        assert abs(run["speed"][-1]) < 1e-6
        assert run["omega"].min() > -0.05  # for the tenth of a millimetre that the pads give
        assert np.abs(run["energy_defect"]).max() < 1e-6 * abs(run["drive_work"][-1])
    locked = runs["open_loop"]["distance"][-1]
    assert runs["wsp"]["distance"][-1] < 0.88 * locked
    fast = runs["wsp"]["speed"] > 2.0
    assert runs["wsp"]["creepage"][fast].min() > -0.3
    sliding = runs["open_loop"]["creepage"][runs["open_loop"]["speed"] > 2.0]
    assert np.mean(sliding < -0.9) > 0.9
    works = [cl.metrics(run, case.drivetrain).slip_work for run in runs.values()]
    assert works[1] < 0.03 * works[0]


def test_metrics_do_not_count_the_time_after_the_stop() -> None:
    """A brake that is still applied then demands nothing of the rail."""
    case = cl.load_scenario("wheel_slide_protection.toml")
    slow = replace(case, initial_speed=12.0)
    runs = [cl.run_scenario(replace(slow, duration=end), "wsp") for end in (22.0, 30.0)]
    assert abs(runs[0]["speed"][-1]) < 1e-9
    short, long = (cl.metrics(run, case.drivetrain) for run in runs)
    assert short.limited_utilisation == long.limited_utilisation
    assert short.utilisation == long.utilisation


def test_limits() -> None:
    with pytest.raises(ValueError, match=r"slip_release = 0.2 is out of range: must be <= slip_th"):
        WheelSlideProtection(slip_release=0.2)
