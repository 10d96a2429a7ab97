"""What holds for every controller and any measurement."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from designed import LIMITED, designed
from own_controller import SlipPI

import contactlib as cl
from contactlib.traction import (
    Measurement,
    OpenLoop,
    SlopeSeeking,
    ThresholdControl,
    TractionController,
)
from contactlib.traction.interface import plausible

GAINS = {"proportional_gain": 1e4, "integral_gain": 1e4}


def sequence(count: int, samples: int, seed: int) -> list[Measurement[Any]]:
    """Measurements all over: slip and skid, both directions, through standstill."""
    rng = np.random.default_rng(seed)
    demand = 3e4 * np.sin(0.02 * np.arange(samples)[:, None] + rng.uniform(0.0, 6.0, count))
    vehicle = 15.0 * np.sin(0.011 * np.arange(samples)[:, None] + rng.uniform(0.0, 6.0, count))
    slip = rng.standard_normal((samples, count)) * 10.0 ** rng.uniform(-3.0, 0.5, (samples, 1))
    rows = zip(demand, vehicle + slip, vehicle, np.zeros_like(vehicle), strict=True)
    return [Measurement(*row) for row in rows]


def torques(
    controller: TractionController,
    measurements: Sequence[Measurement[Any]],
    start: float = 0.5,
) -> list[np.ndarray]:
    """Torques of a controller whose drive gives what it commands."""
    torque = start * measurements[0].demand
    memory, given = controller.start(measurements[0], torque), []
    for measurement in measurements:
        torque, memory = controller.sample(measurement._replace(torque=torque), memory)
        given.append(torque)
    return given


@pytest.mark.parametrize("name", ["open_loop", *LIMITED])  # a brake's demand is never positive
def test_the_other_way_is_the_mirror_image_within_the_demand(
    name: str, locomotive: cl.Model
) -> None:
    controller, rows = designed(name, locomotive), sequence(20, 500, seed=4)
    mirrored = [row.each(np.negative) for row in rows]
    there, back = np.array(torques(controller, rows)), np.array(torques(controller, mirrored))
    assert (there == -back).all()
    demand = np.array([row.demand for row in rows])
    assert (np.abs(there) <= np.abs(demand)).all()
    assert (there * demand >= 0.0).all()


@pytest.mark.parametrize("name", LIMITED)
def test_a_gripping_wheel_gets_the_demand(name: str, locomotive: cl.Model) -> None:
    # Also when the demand jumps or turns round.
    rows = [
        Measurement(np.array([demand]), np.array([10.02]), np.array([10.0]), np.zeros(1))
        for demand in (1e3, 24e3, 5e3, 26e3, 0.0, 20e3)
        for _ in range(5)
    ]
    commanded = torques(designed(name, locomotive), rows, start=1.0)
    assert np.array(commanded).tolist() == [row.demand.tolist() for row in rows]


@pytest.mark.parametrize(
    ("kind", "given", "message"),
    [
        (
            ThresholdControl,
            {"slip_threshold": 0.01},
            "slip_release = 0.07 is out of range",
        ),
        (
            SlopeSeeking,
            {"radius": 0.5, "inertia": 250.0, "first_compliance": 1e-6, "delay": 0.012, **GAINS},
            "not a whole number of samples",
        ),
    ],
)
def test_parameters_report_what_is_wrong(
    kind: Callable[..., object], given: dict[str, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        kind(**given)


class NoTime(cl.SampledController):
    def torque(self, measurement: Measurement[float]) -> float:
        return measurement.demand


class Hidden(SlipPI):
    def __init__(self) -> None:
        self.torque = 0.0  # type: ignore[method-assign,assignment]


class Apart(SlipPI):
    def torque(self, demand: float, wheel: float, vehicle: float) -> float:  # type: ignore[override]
        return demand


class NotDerived:
    sample_time = 0.01


def timed(sample_time: Any) -> SlipPI:
    control = SlipPI()
    control.sample_time = sample_time
    return control


def torque_of(measurement: Measurement[float]) -> float:
    return measurement.demand


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (SlipPI, r" is the class SlipPI: give an object of it, such as SlipPI\(\)$"),
        (OpenLoop, r" is the class OpenLoop: give an object"),
        (
            torque_of,
            r" = torque_of is not a controller: .* derived from .*SampledController",
        ),
        (3.0, r" = 3.0 is not a controller"),
        (None, r" = None is not a controller"),
        (cl.TorqueControl(cl.Profile.of(1e4)), r" is (a TorqueControl, a )?continuous"),
        (NoTime(), r": NoTime.sample_time is missing: .* as in sample_time = 0.01"),
        (timed(0.0), r"SlipPI.sample_time = 0.0 is out of range"),
        (timed("10 ms"), r"SlipPI.sample_time = '10 ms' is not a number"),
        (Apart(), r": Apart.torque must be of the form torque\(self, measurement\)"),
        (NotDerived(), r" = object of NotDerived is not a controller"),
        (Hidden(), r": Hidden.torque must be a method, but self.torque = 0.0 hides it"),
    ],
)
def test_what_is_no_controller_is_one_line(given: Any, message: str) -> None:
    scenario = cl.load_scenario("dry_wet_dry.toml")
    calls: list[tuple[str, Callable[[], object]]] = [
        ("controller", lambda: cl.run_scenario(scenario, given)),
        ("controller", lambda: cl.run_many([scenario], given, ["distance"])),
        ("controllers.mine", lambda: dataclasses.replace(scenario, controllers={"mine": given})),
    ]
    for name, call in calls:
        with pytest.raises(ValueError, match=message) as caught:
            call()
        assert str(caught.value).startswith((name, "SlipPI.sample_time"))
        assert "\n" not in str(caught.value)


def test_a_controller_without_torque_cannot_be_made() -> None:
    class Empty(cl.SampledController):
        sample_time = 0.01

    with pytest.raises(TypeError, match="abstract method"):
        Empty()  # type: ignore[abstract]


def short_vehicle() -> cl.Scenario:
    return dataclasses.replace(cl.load_scenario("four_axles.toml"), duration=0.5)


class Watching(cl.SampledController):
    """Sampled controller that keeps what it sees in a list of the module."""

    sample_time = 0.01

    def torque(self, measurement: Measurement[float]) -> float:
        SEEN.append(measurement)
        return measurement.demand


class WatchingMany:
    """The same of many wheelsets."""

    sample_time = 0.01

    def start(self, measurement: Measurement[Any], torque: Any) -> None:
        return None

    def sample(self, measurement: Measurement[Any], memory: Any) -> tuple[Any, Any]:
        SEEN.append(measurement)
        return measurement.demand, memory


SEEN: list[Measurement[Any]] = []


@pytest.mark.parametrize("kind", [Watching, WatchingMany])
def test_controllers_see_the_wheel_speeds_of_all_axles(kind: Any) -> None:
    """Each of its own axle's sensors; controllers of many get arrays of the shape (n,)."""
    SEEN.clear()
    run = cl.run_scenario(short_vehicle(), kind())
    if kind is WatchingMany:
        assert {np.shape(part) for seen in SEEN for part in seen.wheel_speeds} == {(4,)}
        speeds = np.array([seen.wheel_speeds for seen in SEEN])
        assert (speeds == speeds[:, :, :1]).all()
        assert (SEEN[0].axle == [1, 2, 3, 4]).all()
        own, all_of_them = np.array([seen.wheel_speed for seen in SEEN]), speeds[:, :, 0]
        measured = np.array([seen.vehicle_speed for seen in SEEN])
    else:
        assert [seen.axle for seen in SEEN[:4]] == [1, 2, 3, 4]
        assert {type(part) for seen in SEEN for part in (*seen.wheel_speeds, seen.axle)} == {
            float,
            int,
        }
        own = np.reshape([seen.wheel_speed for seen in SEEN], (-1, 4))
        all_of_them = np.array([seen.wheel_speeds for seen in SEEN[::4]])
        measured = np.reshape([seen.vehicle_speed for seen in SEEN], (-1, 4))
    assert (own == all_of_them).all()
    assert (own[:, 0] != own[:, 1]).all()  # noise of their own
    assert (run["measured_speed"][::2] == measured).all()  # two rows a sample


def test_a_wheelset_without_a_vehicle_sees_its_own_wheel_speed() -> None:
    SEEN.clear()
    cl.run_scenario(
        dataclasses.replace(cl.load_scenario("dry_wet_dry.toml"), duration=0.1), Watching()
    )
    assert all(seen.wheel_speeds == (seen.wheel_speed,) and seen.axle == 1 for seen in SEEN)


def test_implausible_wheel_speeds_of_other_axles_are_limited() -> None:
    given: Measurement[Any] = Measurement(1e4, 10.0, 10.0, 0.0, (10.0, 1e300), 2)
    assert plausible(given) == given._replace(wheel_speeds=(10.0, 300.0))
