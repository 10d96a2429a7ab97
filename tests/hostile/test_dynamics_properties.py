"""Identities that any vehicle, torque and speed must keep: random ones are tried."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contactlib as cl
from contactlib import stability
from contactlib.files.scenario import ControllerDesign
from contactlib.traction import Measurement, stacked
from contactlib.vehicle import Resistance


@cache
def train() -> cl.Wheelset:
    return cl.load_model("models/locomotive.toml").wheelset


@cache
def scenario() -> cl.Scenario:
    shipped = cl.load_scenario("dry_wet_dry.toml")
    every = {kind: ControllerDesign(kind, {}) for kind in cl.CONTROLLERS}
    return replace(shipped, controllers={**every, **shipped.controllers})


# ---- fold and steady states -----------------------------------------------------------------


@pytest.mark.parametrize("static", [0.22, 0.25, 0.27])
@pytest.mark.filterwarnings("ignore::contactlib.element.ProcessZoneWarning")
def test_fold_of_a_plateau_is_its_beginning(static: float) -> None:
    # The law's peak is above static friction, where the force is held.
    contact = train().element.contact
    friction = cl.friction_with_k_hat(contact, k_hat=0.6, static=static, kinetic=0.21)
    element = replace(train().element, friction=friction)
    body = replace(train(), element=element, mass=None, damping=0.0)
    fold = cl.find_fold(body, speed=10.0)
    highest = static * element.axle_load
    assert fold.drive_torque == pytest.approx(body.radius * highest, rel=1e-14)
    near = fold.creepage * np.array([1.0 - 1e-9, 1.0, 1.0 + 1e-9])
    assert (element.at_creepage(near, speed=10.0)["force_limited"] > 0).tolist() == [
        False,
        True,
        True,
    ]


# ---- basin and clearing ---------------------------------------------------------------------


def test_zero_demand_comes_back_from_any_creepage() -> None:
    # A wheel that spins backward at four times a light vehicle's speed: it brakes the vehicle to
    # standstill as fast as it comes back itself, which once was taken for a border.
    body = replace(train(), mass=3e3, damping=0.0)
    for speed in (0.3, 1.07, 2.5):
        basin = cl.stability.basin(body, drive_torque=0.0, speed=speed)
        assert (basin.lowest, basin.highest) == (-math.inf, math.inf)
        run = cl.simulate(
            body,
            cl.TorqueControl(cl.Profile.of(0.0)),
            initial_speed=speed,
            initial_creepage=-4.5,
            duration=2.0,
        )
        assert abs(run["slip_velocity"][-1]) < 1e-3 * speed


# ---- scenarios ------------------------------------------------------------------------------

OUTCOMES = ("slip_work", "final_speed", "largest_creepage", "utilisation")


@examples(20)
@given(
    rows=st.lists(
        st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 4), min_size=3, max_size=3
    ),
    name=st.sampled_from(list(cl.CONTROLLERS)),
)
def test_torque_is_between_zero_and_the_demand_whatever_is_measured(
    rows: list[tuple[float, float, float, float]], name: str
) -> None:
    control = stacked([scenario().controller(name)])
    measured = [
        Measurement(np.array([demand]), np.array([wheel]), np.array([vehicle]), np.array([torque]))
        for demand, wheel, vehicle, torque in rows
    ]
    memory = control.start(measured[0], 0.0)
    for measurement in measured:
        torque, memory = control.sample(measurement, memory)
        demand = measurement.demand
        assert np.isfinite(torque).all()
        assert (np.abs(torque) <= np.abs(demand)).all()
        assert ((torque == 0.0) | (np.sign(torque) == np.sign(demand))).all()


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
    ("name", "time", "sample_time"), [("delay", 10.001, 1e-3), ("lag", 1e3, 1e-7)]
)
def test_a_loop_much_slower_than_its_samples_is_refused(
    name: str, time: float, sample_time: float
) -> None:
    given: dict[str, Any] = {name: time, "sample_time": sample_time}
    with pytest.raises(ValueError, match=rf"{name} = .* must be <= \S+ times sample_time"):
        stability.proportional_window(70.0, **given)


def test_a_patch_on_which_a_vehicle_stops_is_refused() -> None:
    line = cl.load_model("models/roller_rig.toml").wheelset.element
    friction = replace(line.friction, slip_rate_residual=0.8243, slip_rate_decay=0.7136)
    element = replace(line, friction=friction)
    body = replace(train(), element=element, mass=22.88e3, damping=0.0, resistance=Resistance())
    torque = -0.98386 * cl.find_fold(body, speed=0.75).drive_torque
    with pytest.raises(ValueError, match=r"speed = 0.75, friction_scale = 0.98.* may end: speed"):
        cl.clearing(body, drive_torque=torque, speed=0.75, friction_scale=0.98377)
