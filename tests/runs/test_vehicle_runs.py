"""Runs of a vehicle: against wheelsets by themselves, another solver, and balances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from plain_scenario import of_axles
from scipy.integrate import cumulative_simpson, solve_ivp

import contactlib as cl
from contactlib import kernel
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.runs import OUTCOMES
from contactlib.traction import Measurement, Sensors
from contactlib.vehicle import Drivetrain, DynamicLoad, Track


@cache
def shipped(**changes: Any) -> cl.Scenario:
    return replace(cl.load_scenario("four_axles.toml"), duration=6.0, **changes)


def test_equal_axles_without_load_transfer_are_wheelsets() -> None:
    """On uniform friction, under one controller without noise."""
    scenario = shipped(track=Track(), sensors=Sensors())
    assert scenario.vehicle is not None
    wheelset = scenario.drivetrain.wheelset
    low: dict[str, Any] = dict.fromkeys(
        ("body_height", "bogie_height", "pivot_height", "coupler_height"), 0.0
    )
    body = 4.0 * wheelset.element.axle_load / STANDARD_GRAVITY - 26e3
    vehicle = replace(scenario.vehicle, **low, wheelset_mass=0.0, body_mass=body)
    drivetrain = replace(
        scenario.drivetrain, wheelset=replace(wheelset, mass=vehicle.mass / vehicle.axles)
    )
    scenario = replace(scenario, vehicle=vehicle, drivetrain=drivetrain)
    together = cl.run_scenario(scenario, "creep_pi", tolerance=1e-9)
    alone = cl.run_scenario(replace(scenario, vehicle=None), "creep_pi", tolerance=1e-9)
    friction = alone["available_force"].max()
    for axle in together.by_axle:
        assert_allclose(axle["creep_force"], alone["creep_force"], atol=1e-9 * friction)
        assert_allclose(axle["available_force"], alone["available_force"], rtol=1e-8)
        assert_allclose(axle["speed"], alone["speed"], rtol=1e-9)


def test_the_axles_share_their_speed_as_in_another_solver() -> None:
    """Four different axles with memory, by SciPy's Radau on the system as a whole."""
    wheelset = shipped().drivetrain.wheelset
    element, n = wheelset.element, 4
    friction, torque = np.array([0.5, 1.0, 0.6, 1.0]), np.array([1.5e4, 2.4e4, 2e4, 1e4])
    load = np.array([0.9, 1.1, 0.95, 1.05]) * element.axle_load
    inputs = np.zeros((1, n), kernel.drivetrain_dtype("input"))
    states = np.zeros(n, kernel.drivetrain_dtype("state"))
    inputs["slope"] = 1.0
    inputs["friction_left"] = inputs["friction_right"] = friction
    inputs["load_left"] = inputs["load_right"] = 0.5 * load
    inputs["commanded_torque"] = torque
    states["speed"], states["omega_left"], states["omega_right"] = 10.0, 20.05, 20.05
    states["unslipped_left"] = states["unslipped_right"] = 0.5
    fleet = kernel.NativeFleet([Drivetrain(wheelset).member()] * n, axles=n)
    native = element.rolling_native

    def rates(_: float, y: np.ndarray) -> list[float]:
        speed, omega, memory = y[0], y[1 : 1 + n], y[1 + n :].reshape(n, 3)
        found: list[Any] = []
        for i in range(n):
            contact = native.evaluate_one(omega[i], speed, load[i], friction[i], *memory[i])
            moves = wheelset.native.motion(omega[i], speed, torque[i], 0.0, contact)
            remembers = contact.held_rate, contact.unslipped_rate, contact.outer_rate
            found.append((moves.speed_rate, moves.omega_rate, remembers))
        speeds, omegas, memories = zip(*found, strict=True)
        return [np.mean(speeds), *omegas, *np.ravel(memories)]

    start = [10.0, *states["omega_left"], *[0.0, 0.5, 0.0] * n]
    known = solve_ivp(rates, (0.0, 0.1), start, "Radau", rtol=1e-8, atol=1e-8)
    for row in range(20):
        fleet.advance(inputs[0], states, 0.005 * row, 0.005, 1e-9, np.zeros(n))
    assert_allclose(states["speed"], known.y[0, -1], rtol=1e-9)
    assert_allclose(states["omega_left"], known.y[1 : 1 + n, -1], rtol=1e-7)


def test_loads_are_those_of_statics_and_energy_closes() -> None:
    scenario = shipped(sensors=Sensors())
    result = cl.run_scenario(scenario, "creep_pi")
    vehicle, wheelset = scenario.vehicle, scenario.drivetrain.wheelset
    assert vehicle is not None
    rest = vehicle.loads([0.0] * 4, acceleration=0.0, radius=wheelset.radius)
    steady = slice(-40, None)  # 0.2 s, of ten lags
    statics = vehicle.loads(
        result["creep_force"][steady],
        acceleration=result["acceleration"][steady],
        radius=wheelset.radius,
    )
    assert_allclose(result["axle_load"][steady], statics, rtol=1e-3)
    assert_allclose(result["axle_load"].sum(axis=1), rest.sum(), rtol=1e-12)
    work = result.total("drive_work")[-1]
    assert np.abs(result.total("energy_defect")).max() < 1e-9 * work
    assert_array_equal(result["distance"][0], -np.array(vehicle.position))


@pytest.mark.parametrize("lag", [0.0, 0.06, 0.4])
def test_loads_follow_statics_with_their_lag(lag: float) -> None:
    """dP/dt = (P_statics - P)/lag by SciPy, with statics from the run's own forces."""
    jump = cl.Profile(at=(0.3, 0.4), value=(0.0, 26e3))
    scenario = shipped(track=Track(), sensors=Sensors(), demand=jump)
    assert scenario.vehicle is not None
    vehicle = replace(scenario.vehicle, load_lag=lag)
    scenario = replace(scenario, vehicle=vehicle, duration=1.5)
    run, time = cl.run_scenario(scenario, "open_loop", step=0.0025), np.arange(0.0, 1.45, 0.05)
    statics = vehicle.loads(
        run["creep_force"],
        acceleration=run["acceleration"],
        radius=scenario.drivetrain.wheelset.radius,
    )
    assert np.ptp(statics[:, 0]) > 1e4
    for axle in range(4):

        def static(t: Any, axle: int = axle) -> Any:
            return np.interp(t, run.time, statics[:, axle])

        def rate(t: float, load: np.ndarray, known: Any = static) -> Any:
            return (known(t) - load) / lag

        known = static(time)
        if lag > 0.0:
            start, end = [static(0.0)], (0.0, run.time[-1])
            known = solve_ivp(rate, end, start, t_eval=time, rtol=1e-8, max_step=0.01).y[0]
        load = np.interp(time, run.time, run["axle_load"][:, axle])
        assert_allclose(load, known, rtol=0.0, atol=5e-4 * np.ptp(statics[:, axle]))


def test_a_vehicle_of_one_axle_is_a_wheelset_under_its_weight() -> None:
    one = of_axles(1, duration=1.0, demand=cl.Profile((0.0, 0.8), (1e4, 3e4)))
    factor = one.static_load / one.drivetrain.wheelset.element.axle_load
    assert factor > 1.5
    load = DynamicLoad(time=(0.0, 1.0), factor=(factor, factor))
    run, alone = (
        cl.run_scenario(case, "creep_pi", step=0.005, tolerance=1e-7)
        for case in (one, replace(one, vehicle=None, dynamic_load=load))
    )
    assert_allclose(run["axle_load"], one.static_load, rtol=1e-14)
    assert run.units == alone.units
    for name in ("speed", "creep_force", "available_force", "measured_speed"):
        assert_allclose(run[name], alone[name], rtol=1e-9, atol=1e-6)
    both = [one, replace(one, vehicle=None)]  # which do not change each other's bits
    used = cl.run_many(both, "creep_pi", ["utilisation"], index=[7, 7])["utilisation"]
    for i, case in enumerate(both):
        assert cl.run_many([case], "creep_pi", ["utilisation"], index=[7])["utilisation"] == used[i]


@pytest.mark.parametrize("axles", [1, 2, 4])
def test_a_plant_under_the_torques_of_a_run_is_that_run(axles: int) -> None:
    """To the last bit, by itself and beside another vehicle."""
    case = of_axles(axles, duration=0.5, demand=cl.Profile((0.0, 0.4), (1e4, 3e4)))
    run = cl.run_scenario(case, "creep_pi", index=3, tolerance=1e-5)
    other = replace(case, initial_speed=12.0)
    slips = cl.Plant(case, initial_creepage=0.01)
    assert_allclose(slips["creepage"], 0.01, rtol=1e-12)
    single, double = cl.Plant(case, tolerance=1e-5), cl.Plant([case, other], tolerance=1e-5)
    seen, both = single.reset(3), double.reset(3)
    shape = () if axles == 1 else (axles,)
    for i in range(40):
        torque = run["commanded_torque"][2 * i]
        assert_array_equal(both.wheel_speed[0], seen.wheel_speed)
        seen, both = single.step(torque), double.step(np.stack([torque, 0.5 * torque]))
        assert np.shape(seen.torque) == shape == both.torque.shape[1:]
        for name in ("speed", "creep_force", "axle_load", "measured_speed", "creep_work"):
            assert_array_equal(single[name], run[name][2 * i + 2])
            assert_array_equal(double[name][0], single[name])
    assert_array_equal(double.step([1e4, 2e4]).torque.T, np.broadcast_to([1e4, 2e4], (*shape, 2)))


def ramp(torque: float) -> cl.Profile:
    return cl.Profile(at=(0.5, 1.5), value=(0.0, torque))


def test_axles_behind_use_the_rails_that_those_in_front_have_cleaned() -> None:
    """Forward the last axle finds most friction; in reverse the first one does."""
    track = Track.from_breakpoints(distance=(0.0,), friction=(0.5,), cleaning=1e-3)
    pulling = shipped(track=track, sensors=Sensors(), demand=ramp(26e3))
    forward = cl.run_scenario(pulling, "creep_pi")["friction_scale_left"][-1]
    assert (np.diff(forward) > 0.01).all()
    backward = replace(pulling, initial_speed=-10.0, demand=ramp(-26e3))
    reverse = cl.run_scenario(backward, "creep_pi")["friction_scale_left"][-1]
    assert (np.diff(reverse) < -0.01).all()


def test_sensors_of_the_axles_err_independently_and_repeat() -> None:
    class Listens(cl.SampledController):
        sample_time = 0.01

        def torque(self, measurement: Measurement[float]) -> float:
            return measurement.demand * min(0.02 * measurement.wheel_speed, 1.0)

    first, again = (cl.run_scenario(shipped(), Listens()) for _ in range(2))
    torque = first["commanded_torque"]
    assert_array_equal(torque, again["commanded_torque"])
    noise = np.diff(torque[400::2], axis=0)
    assert np.abs(np.corrcoef(noise.T) - np.eye(4)).max() < 0.2
    error = np.abs(first["measured_speed"].T - first["speed"]).max()
    assert cl.metrics(first, shipped().drivetrain).speed_error == error


@pytest.mark.parametrize("direction", [1.0, -1.0], ids=["forward", "in reverse"])
def test_driven_and_braked_axles(direction: float) -> None:
    """Each has its part of the demand, by its sign in the direction of motion."""
    demand = cl.Profile(at=(0.0, 1.0, 1.0), value=(1e4 * direction, 1e4 * direction, -direction))
    scenario = shipped(initial_speed=8.0 * direction, demand=demand)
    assert scenario.vehicle is not None
    half = replace(scenario.vehicle, driven=(1, 2), braked=(3, 4))
    scenario = replace(scenario, vehicle=half, duration=2.0, track=Track())
    run = cl.run_scenario(scenario, "open_loop")
    expected = np.array([[1e4, 1e4, 0.0, 0.0], [0.0, 0.0, -1.0, -1.0]])
    assert_array_equal(run["commanded_torque"][[100, -1]], direction * expected)


def test_many_are_one_by_one() -> None:
    cases = [shipped(), shipped(sensors=Sensors()), shipped(demand=cl.Profile.of(2e4))]
    names = [name for name, outcome in OUTCOMES.items() if outcome.observe]
    own = {"last": lambda result: result["creep_work"][-1, 3]}
    many = cl.run_many(cases, "creep_pi", names, metrics=own, step=0.01, index=[4, 5, 6])
    assert not many["failed"].any()
    for i, case in enumerate(cases):
        run = cl.run_scenario(case, "creep_pi", index=4 + i, step=0.01, tolerance=1e-4)
        alone = cl.metrics(run, case.drivetrain)
        for name, value in alone._asdict().items():
            assert_array_equal(many[name][i], value, err_msg=name)
        assert many["last"][i] == run["creep_work"][-1, 3]


def test_result() -> None:
    result = cl.run_scenario(replace(shipped(), duration=1.0), "open_loop")
    assert result.axles == 4
    assert repr(result).endswith(f"{len(result.units)} signals of 4 axles>")
    data, frame = result.to_xarray(), result.to_pandas()
    assert (data.creep_force.dims, data.speed.dims) == (("time", "axle"), ("time",))
    assert data.axle.values.tolist() == [1, 2, 3, 4]
    assert_array_equal(data.creep_force.sum("axle"), result.total("creep_force"))
    third = result.axle(3)
    assert third == result.by_axle[2] != result.axle(2)
    assert {values.shape for values in third.signals.values()} == {result.time.shape}
    assert_array_equal(frame["creep_force_3"], third["creep_force"])
    assert frame.attrs["units"]["creep_force_3"] == "N"
    assert third.axle(1) == third
    assert_array_equal(third.totals["creep_work"], third["creep_work"])
    assert "axle" not in third.to_xarray().dims
    with pytest.raises(ValueError, match=r"number = 5\.0 is out of range: must be .*<= 4"):
        result.axle(5)
    with pytest.raises(KeyError, match="no total of 'creepage': there are creep_force"):
        result.total("creepage")


REFUSED: Mapping[str, tuple[Any, str]] = {
    "Plant": (
        lambda: cl.Plant([shipped(), cl.load_scenario("dry_wet_dry.toml")]),
        r"scenarios have \[1, 4\] axles: what is stepped together must have equally many",
    ),
    "step": (
        lambda: cl.Plant([shipped()] * 2).step([[1.0] * 4]),
        r"torque has the shape \(1, 4\): must be \(\) or \(2,\) or \(2, 4\)",
    ),
    "mass": (
        lambda: replace(shipped(), vehicle=replace(shipped().vehicle, train_mass=0.0)),  # type: ignore[type-var]
        "must be the vehicle's mass over its number of axles",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_refused(what: str) -> None:
    call, message = REFUSED[what]
    with pytest.raises(ValueError, match=message):
        call()


def test_acceleration_is_that_of_the_vehicle() -> None:
    """Not that of an axle's own force: the speed is the integral, also while one axle slips."""
    fine = cl.run_scenario(replace(shipped(), duration=5.0), "open_loop", step=1e-3)
    gained = cumulative_simpson(fine["acceleration"], x=fine.time, initial=0.0)
    assert_allclose(fine["speed"] - fine["speed"][0], gained, atol=5e-5)


def test_a_held_vehicle_starts_without_rolling_back() -> None:
    """Further than pads and contacts give; the air of one application is used."""
    start = cl.load_scenario("start_on_grade.toml")
    run = cl.run_scenario(replace(start, duration=12.0), "open_loop")
    assert -3e-4 < run["distance"][:, 0].min() < -1e-4
    assert run["speed"][-1] > 1.0
    assert cl.metrics(run, start.drivetrain).air_used == pytest.approx(1.0, abs=1e-3)
    weight = 9.80665 * 0.02 * start.vehicle.mass if start.vehicle else 0.0
    at = np.searchsorted(run.time, 1.9)
    assert run.total("creep_force")[at] == pytest.approx(weight, rel=1e-4)
