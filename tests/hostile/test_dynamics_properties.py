"""Identities that any vehicle, torque and speed must keep: random ones are tried."""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, magnitude, number

import contactlib as cl
from contactlib import stability
from contactlib.files.scenario import ControllerDesign
from contactlib.traction import stacked


@cache
def train() -> cl.Wheelset:
    return cl.load_model("models/locomotive.toml").wheelset


@cache
def scenario() -> cl.Scenario:
    shipped = cl.load_scenario("dry_wet_dry.toml")
    every = {kind: ControllerDesign(kind, {}) for kind in cl.CONTROLLERS}
    return dataclasses.replace(shipped, controllers={**every, **shipped.controllers})


RESISTANCES = (train().resistance, cl.Resistance(), cl.Resistance(linear=5e3))


@st.composite
def wheelsets(draw: st.DrawFn, *, held: bool | None = None, lightest: float = 100.0) -> Any:
    """The locomotive's contact under light and heavy vehicles, friction that falls or does not."""
    element = train().element
    if draw(st.booleans()):
        fall: dict[str, Any]
        if draw(st.booleans()):
            fall = {"softening_temperature": draw(number(300.0, 1500.0))}
        else:
            rate = draw(number(0.1, 1.0))
            fall = {"slip_rate_residual": draw(number(0.3, 0.9)), "slip_rate_decay": rate}
        friction = dataclasses.replace(element.friction, **fall)
        element = dataclasses.replace(element, friction=friction)
    free = not (draw(st.booleans()) if held is None else held)
    return dataclasses.replace(
        train(),
        element=element,
        inertia=draw(magnitude(30.0, 1e3)),
        mass=draw(magnitude(lightest, 2e5)) if free else None,
        damping=draw(st.sampled_from([0.0, 5.0, 50.0])),
        resistance=draw(st.sampled_from(RESISTANCES)),
    )


# ---- fold and steady states -----------------------------------------------------------------


def fold_of(body: cl.Wheelset, **inputs: Any) -> cl.Fold | None:
    try:
        return cl.find_fold(body, **inputs)
    except ValueError as error:
        if "no maximum" not in str(error):
            raise
        return None


@pytest.mark.parametrize("static", [0.22, 0.25, 0.27])
@pytest.mark.filterwarnings("ignore::contactlib.ProcessZoneWarning")
def test_fold_of_a_plateau_is_its_beginning(static: float) -> None:
    # The law's peak is above static friction, where the force is held.
    contact = train().element.contact
    friction = cl.friction_with_k_hat(contact, k_hat=0.6, static=static, kinetic=0.21)
    element = dataclasses.replace(train().element, friction=friction)
    body = dataclasses.replace(train(), element=element, mass=None, damping=0.0)
    fold = cl.find_fold(body, speed=10.0)
    highest = static * element.normal_load
    assert fold.drive_torque == pytest.approx(body.radius * highest, rel=1e-14)
    near = fold.creepage * np.array([1.0 - 1e-9, 1.0, 1.0 + 1e-9])
    assert (element.at_creepage(near, speed=10.0)["force_limited"] > 0).tolist() == [
        False,
        True,
        True,
    ]


# ---- basin and clearing ---------------------------------------------------------------------


def border_case(
    body: cl.Wheelset, speed: float, part: float, outer: float
) -> tuple[float, Any] | None:
    """Torque and basin, or None if there is no fold or no grip."""
    fold = fold_of(body, speed=speed, resistance_force=outer)
    if fold is None:
        return None
    torque = part * fold.drive_torque
    try:
        return torque, cl.basin(body, drive_torque=torque, speed=speed, resistance_force=outer)
    except ValueError as error:
        named = f"drive_torque = {torque!r}", f"speed = {speed!r}"
        text = str(error)
        if not (all(name in text for name in named) and "holds it by grip" in text):
            raise
        return None


def reaches_grip(
    body: cl.Wheelset, torque: float, start: float, grip: float, border: float, **inputs: float
) -> bool:
    """Whether a run comes much nearer to grip than the border is; it may run away after that."""
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(torque)),
        initial_creepage=start,
        initial_speed=inputs["speed"],
        resistance_force=inputs["outer"],
        duration=20.0,
        slip_away_creepage=2.0 * abs(border),
        stop_at=["slip_away", "standstill"],
    )
    return bool((np.abs(run["creepage"] - grip) < 0.3 * abs(border - grip)).any())


@pytest.mark.slow
@examples(14)
@given(
    body=wheelsets(held=False, lightest=3e3),  # lighter ones hardly ever have a border
    speed=magnitude(0.15, 8.0),
    part=number(0.8, 0.99),
    braking=st.booleans(),
    outer=st.sampled_from([0.0, -1e4, 1e4]),
)
def test_the_border_of_light_and_slow_vehicles_is_that_of_runs(
    body: cl.Wheelset, speed: float, part: float, braking: bool, outer: float
) -> None:
    case = border_case(body, speed, -0.95 * part if braking else part, outer)
    if case is None:
        return
    torque, basin = case
    border = basin.lowest if braking else basin.highest
    if math.isinf(border):
        return
    inputs = {"speed": speed, "outer": outer}
    for factor, back in ((0.99, True), (1.01, False)):
        start = basin.creepage + factor * (border - basin.creepage)
        assert reaches_grip(body, torque, start, basin.creepage, border, **inputs) == back


def test_zero_demand_comes_back_from_any_creepage() -> None:
    # A wheel that spins backward at four times a light vehicle's speed: it brakes the vehicle to
    # standstill as fast as it comes back itself, which once was taken for a border.
    body = dataclasses.replace(train(), mass=3e3, damping=0.0)
    for speed in (0.3, 1.07, 2.5):
        found = cl.basin(body, drive_torque=0.0, speed=speed)
        assert (found.lowest, found.highest) == (-math.inf, math.inf)
        run = cl.simulate(
            body,
            cl.TorqueControl(cl.Profile.of(0.0)),
            initial_speed=speed,
            initial_creepage=-4.5,
            duration=2.0,
        )
        assert abs(run["slip_velocity"][-1]) < 1e-3 * speed


# ---- runs -----------------------------------------------------------------------------------


@st.composite
def torque_runs(draw: st.DrawFn) -> dict[str, Any]:
    times = (0.0, 0.1, 0.2, 0.3)
    torques = tuple(draw(st.lists(number(-3.2e4, 3.2e4), min_size=4, max_size=4)))
    return {
        "torque": cl.Profile(times, torques),
        "initial_speed": draw(st.sampled_from([-1.0, 1.0])) * draw(magnitude(0.05, 40.0)),
        "initial_creepage": draw(number(-0.05, 0.05)),
        "friction_scale": cl.Profile((0.0, 0.15, 0.15), (1.0, 1.0, draw(number(0.2, 1.0)))),
    }


def driven(body: cl.Wheelset, torque: cl.Profile, **given: Any) -> cl.Result:
    return cl.simulate(body, cl.TorqueControl(torque), duration=0.3, **given)


@examples(5)
@given(body=wheelsets(lightest=1e3), run=torque_runs())
def test_energy_is_kept_and_friction_takes_it(body: cl.Wheelset, run: dict[str, Any]) -> None:
    result = driven(body, **run)
    assert all(np.isfinite(values).all() for values in result.signals.values())
    works = [np.abs(result[name]).max() for name in ("drive_work", "creep_work", "stored_energy")]
    assert np.abs(result["energy_defect"]).max() < 1e-6 * max(works)
    power = result["creep_force"] * result["slip_velocity"]
    assert power.min() >= 0.0
    assert np.diff(result["creep_work"]).min() > -1e-7 * max(works)
    most = body.element.friction.static * result["friction_scale"] * result["normal_load"]
    assert (np.abs(result["creep_force"]) <= most * (1.0 + 1e-14)).all()


# ---- scenarios ------------------------------------------------------------------------------

CONTROLLERS = list(cl.CONTROLLERS)


@st.composite
def scenarios(draw: st.DrawFn) -> cl.Scenario:
    """The scenario of a wet patch with other vehicles, noise and demands, some extreme."""
    case = scenario()
    body = dataclasses.replace(
        case.drivetrain.wheelset,
        mass=draw(magnitude(1e3, 2e5)),
        inertia=draw(magnitude(30.0, 1e3)),
    )
    axle = cl.Axle(stiffness=draw(magnitude(1e5, 1e8)), damping=50.0)
    drivetrain = dataclasses.replace(
        case.drivetrain,
        wheelset=body,
        axle=axle if draw(st.booleans()) else None,
        motor=cl.Motor(lag=draw(st.sampled_from([0.0, 0.02]))),
    )
    demand = cl.Profile((0.0, 0.1), (0.0, draw(number(-1e5, 1e5))))
    noise = draw(st.sampled_from([0.0, 0.05]))
    return dataclasses.replace(
        case,
        drivetrain=drivetrain,
        demand=demand,
        duration=0.4,
        initial_speed=draw(magnitude(1.0, 60.0)),
        sensors=cl.Sensors(wheel_speed_noise=noise, seed=float(draw(st.integers(0, 99)))),
    )


OUTCOMES = ("slip_work", "final_speed", "largest_creepage", "adhesion_utilisation")


@examples(4)
@given(case=scenarios(), name=st.sampled_from(CONTROLLERS))
def test_equal_wheels_stay_equal_and_energy_is_kept(case: cl.Scenario, name: str) -> None:
    track = dataclasses.replace(case.track, friction_right=None)
    case = dataclasses.replace(case, track=track)
    run = cl.run_scenario(case, name)
    assert all(np.isfinite(values).all() for values in run.signals.values())
    wheels = run["creepage_left"], run["creepage_right"]  # the first twist is one of rounding
    np.testing.assert_allclose(*wheels, rtol=1e-9, atol=1e-13)
    assert cl.metrics(run, case.drivetrain).energy_defect < 1e-6


@examples(20)
@given(
    rows=st.lists(
        st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 4), min_size=3, max_size=3
    ),
    name=st.sampled_from(CONTROLLERS),
)
def test_torque_is_between_zero_and_the_demand_whatever_is_measured(
    rows: list[tuple[float, float, float, float]], name: str
) -> None:
    control = stacked([scenario().controller(name)])
    measured = [cl.Measurement(*(np.array([value]) for value in row)) for row in rows]
    memory = control.start(measured[0], 0.0)
    for measurement in measured:
        torque, memory = control.sample(measurement, memory)
        demand = measurement.demand
        assert np.isfinite(torque).all()
        assert (np.abs(torque) <= np.abs(demand)).all()
        assert ((torque == 0.0) | (np.sign(torque) == np.sign(demand))).all()


# ---- torsion --------------------------------------------------------------------------------


# ---- refusals -------------------------------------------------------------------------------


@pytest.mark.parametrize("index", [0.5, -1, 2**63, [0, 1]])
def test_a_place_of_a_run_is_a_whole_number(index: Any) -> None:
    with pytest.raises(ValueError, match="index = "):
        cl.run_scenario(scenario(), "open_loop", index=index)
    with pytest.raises(ValueError, match="index = "):
        cl.run_many([scenario()], "open_loop", OUTCOMES, index=[index])


def test_a_torque_that_the_sliding_wheel_holds_has_no_time_to_slip_away() -> None:
    wheel = {"radius": 0.5, "inertia": 250.0, "speed": 10.0, "overload": 0.1, "peak_force": 5e4}
    curve = {"peak_curvature": 1e8, "peak_creepage": 0.02, "end_creepage": 0.021}
    assert stability.slip_away_formula(**wheel, **curve, sliding_force=5.4e4) > 0.0
    with pytest.raises(ValueError, match=r"must be finite and > 0; given .*sliding_force = 56000"):
        stability.slip_away_formula(**wheel, **curve, sliding_force=5.6e4)


@pytest.mark.parametrize(
    ("name", "time", "sample_time"),
    [("delay", 10.001, 1e-3), ("lag", 1e3, 1e-7), ("relaxation", 1e3, 1e-7)],
)
def test_a_loop_much_slower_than_its_samples_is_refused(
    name: str, time: float, sample_time: float
) -> None:
    with pytest.raises(ValueError, match=rf"{name} = .* must be <= \S+ times sample_time"):
        stability.proportional_window(70.0, **{name: time}, sample_time=sample_time)


def test_a_patch_on_which_a_vehicle_stops_is_refused() -> None:
    line = cl.load_model("models/roller_rig.toml").wheelset.element
    friction = dataclasses.replace(line.friction, slip_rate_residual=0.8243, slip_rate_decay=0.7136)
    element = dataclasses.replace(line, friction=friction)
    body = dataclasses.replace(
        train(), element=element, mass=22.88e3, damping=0.0, resistance=cl.Resistance()
    )
    torque = -0.98386 * cl.find_fold(body, speed=0.75).drive_torque
    with pytest.raises(ValueError, match=r"speed = 0.75, friction_scale = 0.98.* may end: speed"):
        cl.clearing(body, drive_torque=torque, speed=0.75, friction_scale=0.98377)
