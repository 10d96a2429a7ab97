"""Runs of many scenarios: each as it would be by itself, and right."""

from __future__ import annotations

import dataclasses
import math
import tracemalloc
from functools import partial
from typing import Any

import numpy as np
import pytest
from own_controller import SlipPI, largest_slip

import contactlib as cl
from contactlib.files.scenario import ControllerDesign
from contactlib.runs import scenario_runs as ensemble_run
from contactlib.runs.accumulators import STOPPED_SPEED
from contactlib.runs.outcomes import OUTCOMES
from contactlib.runs.scenario_runs import DEFAULT_TOLERANCE, FAILED, run_many
from contactlib.traction import Measurement, OpenLoop, Sensors, ThresholdControl, stacked, structure
from contactlib.vehicle import Axle, Drivetrain, DynamicLoad, Motor

WORK = ["slip_work"]
SHORT = 1.6  # of most of these runs [s]


def varied(rng: np.random.Generator, i: int) -> cl.Scenario:
    """A scenario that differs from the others in all that it may."""
    shipped = cl.load_scenario("dry_wet_dry.toml")
    element = shipped.drivetrain.wheelset.element
    fall: dict[str, Any] = {
        "slip_rate_residual": rng.uniform(0.3, 0.9),
        "slip_rate_decay": rng.uniform(0.1, 1.0),
    }
    if i % 3 == 0:
        fall = {"slip_rate_decay": 0.0}
        if i % 2:
            fall["softening_temperature"] = rng.uniform(300.0, 900.0)
    friction = dataclasses.replace(element.friction, **fall)
    radius = rng.uniform(0.4, 0.6)
    body = dataclasses.replace(
        shipped.drivetrain.wheelset,
        element=dataclasses.replace(element, friction=friction, radius=radius, memory=i % 4 == 2),
        inertia=rng.uniform(150.0, 300.0),
        mass=None if i % 4 == 1 else rng.uniform(5e4, 1.5e5),
    )
    speed = rng.uniform(2.0, 20.0)
    held, estimated = body.mass is None, i % 5 == 3
    wet = rng.uniform(0.4, 0.9)
    patch = cl.Profile((4.0, 4.0, 9.0, 9.0 + i % 2), (1.0, wet, wet, 1.0))
    rain = cl.Profile((0.0, 1.0), (1.0, 0.9)) if i % 5 == 4 else cl.Profile.of(1.0)
    torque = rng.uniform(0.5, 0.9) * cl.find_fold(body, speed=speed).drive_torque
    demand = cl.Profile.of(torque)
    if i % 3 == 2:
        demand = cl.Profile((0.3, 0.3, 0.8), (0.8 * torque, torque, 0.9 * torque))
    return dataclasses.replace(
        shipped,
        drivetrain=Drivetrain(
            body,
            axle=Axle(stiffness=6e6, damping=500.0, drive_share=0.4) if i == 6 else None,
            motor=Motor(
                lag=rng.uniform(0.005, 0.02) if i % 2 else 0.0,
                power=0.95 * torque * speed / radius if i % 5 == 4 else None,
                torque_rate=3.0 * torque if i % 4 > 1 else None,
                trip_speed=1.3 * speed if i % 3 == 1 else None,
                rotor_inertia=70.0 if i in (6, 7) else None,
                shaft_stiffness=1.5e6 if i in (6, 7) else None,
            ),
        ),
        track=cl.Track(
            friction_left=patch,
            friction_right=cl.Profile.of(0.95) if i % 4 == 3 else None,
            friction_over_time=rain,
            slope=cl.Profile((4.0, 5.0, 9.0, 9.0), (1.0, 0.3, 0.3, 1.0))
            if i % 3
            else cl.Profile.of(1.0),
        ),
        dynamic_load=DynamicLoad(frequency=(1.0, 9.0), density=(0.01, 0.0), seed=float(i))
        if i % 5 in (1, 2)
        else None,
        demand=demand,
        held_speed=cl.Profile((0.0, 5.0), (speed, speed + 3.0)) if held else None,
        initial_speed=speed,
        design_speed=max(speed, 5.0),
        duration=SHORT if i % 6 else 1.3,
        sensors=Sensors(
            vehicle_speed_bias=0.0 if estimated else 0.002 * (i % 3 - 1),
            vehicle_speed_drift=0.0 if estimated else 0.003 * (i % 2),
            wheel_diameter_error=0.002 * (i % 5 - 2),
            encoder_pulses=100.0 * (i % 4),
            wheel_speed_noise=rng.uniform(0.0, 0.02) if i % 3 else 0.0,
            vehicle_speed_noise=0.0 if estimated else rng.uniform(0.0, 0.02),
            acceleration_limit=0.3 if estimated else None,
            delay=0.01 * (i % 2),
            seed=float(i),
        ),
        controllers={
            **{kind: ControllerDesign(kind, {}) for kind in cl.CONTROLLERS},
            **shipped.controllers,
        },
    )


@pytest.fixture(scope="module")
def scenarios() -> list[cl.Scenario]:
    rng = np.random.default_rng(8)
    return [varied(rng, i) for i in range(10)]


same = partial(np.array_equal, equal_nan=True)


# The quick one has the most memory.
EACH_CONTROLLER = [
    pytest.param(name, marks=() if name == "slope_seeking" else pytest.mark.slow)
    for name in cl.CONTROLLERS
]


@pytest.mark.parametrize("controller", EACH_CONTROLLER)
def test_each_run_is_what_it_would_be_by_itself(
    scenarios: list[cl.Scenario], controller: str
) -> None:
    together = run_many(scenarios, controller, list(OUTCOMES), index=range(3, 13))
    assert not together[FAILED].any()
    for i, scenario in enumerate(scenarios):
        single = run_many([scenario], controller, list(OUTCOMES), index=[3 + i])
        for name, values in together.items():
            assert same(values[[i]], single[name]), (i, name)


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["creep_pi", "slope_seeking"])
def test_one_run_has_the_metrics_of_its_rows(scenarios: list[cl.Scenario], controller: str) -> None:
    for scenario in scenarios:
        many = run_many([scenario], controller, list(OUTCOMES), step=0.01, tolerance=1e-8)
        run = cl.run_scenario(scenario, controller, step=0.01, tolerance=1e-8)
        for name, value in cl.metrics(run, scenario.drivetrain)._asdict().items():
            assert same(many[name], np.array([value])), name
        assert many["final_speed"] == run["speed"][-1]
        assert many["drive_work"] == run["drive_work"][-1]
        mean = np.trapezoid(run["creep_force"], run.time) / run.time[-1]
        assert many["mean_creep_force"] == pytest.approx(mean, rel=1e-12)
        assert many["falling_share"] == pytest.approx(run["falling_branch"][:-1].mean(), rel=1e-9)


def test_who_fails_disturbs_nobody(scenarios: list[cl.Scenario]) -> None:
    good = dataclasses.replace(scenarios[0], sensors=Sensors(), duration=1.0)
    # More torque than friction holds at the start; and more than numbers hold later on.
    greedy = dataclasses.replace(good, demand=cl.Profile.of(1e5))
    wild = dataclasses.replace(good, demand=cl.Profile((0.5, 0.5), (1e4, 1e300)))
    outcomes = run_many([good, greedy, good, wild], "open_loop", list(OUTCOMES))
    assert outcomes[FAILED].tolist() == [0.0, 1.0, 0.0, 1.0]
    single = run_many([good], "open_loop", list(OUTCOMES))
    for name in OUTCOMES:
        assert np.isnan(outcomes[name][1::2]).all()
        assert same(outcomes[name][::2], np.repeat(single[name], 2)), name
    with pytest.raises(ValueError, match="the rising branch ends at"):
        cl.run_scenario(greedy, "open_loop")
    with np.errstate(all="ignore"), pytest.raises(RuntimeError, match="the integrator gave up"):
        cl.run_scenario(wild, "open_loop")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Broken(OpenLoop):
    """Returns nan from some sample on."""

    last: Any

    def start(self, measurement: Measurement[Any], torque: Any) -> Any:
        return np.zeros_like(measurement.demand)

    def sample(self, measurement: Measurement[Any], memory: Any) -> tuple[Any, Any]:
        return np.where(memory > self.last, np.nan, measurement.demand), memory + 1.0


def test_a_controller_that_breaks_fails_its_runs(scenarios: list[cl.Scenario]) -> None:
    cases = [
        dataclasses.replace(scenarios[0], controllers={"broken": Broken(last=last)}, duration=1.0)
        for last in (30.0, math.inf, 99.5)
    ]
    outcomes = run_many(cases, "broken", ["slip_work", "distance"])
    assert outcomes[FAILED].tolist() == [1.0, 0.0, 0.0]
    assert outcomes["distance"][1] == outcomes["distance"][2]
    with pytest.raises(ValueError, match=r"torque of Broken before .* s = nan is out of range"):
        cl.run_scenario(cases[0], "broken")


@pytest.mark.slow
def test_an_own_controller_s_runs_do_not_know_each_other(
    scenarios: list[cl.Scenario], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One object for all, or one for each; many side by side, or few; again and again."""
    given: dict[str, Any] = {"metrics": {"largest": largest_slip}, "step": 5e-3}
    control = SlipPI()
    together = run_many(scenarios, control, ["distance"], **given)
    each = [
        dataclasses.replace(scenario, controllers={"mine": SlipPI(0.1 if i % 2 else 0.3)})
        for i, scenario in enumerate(scenarios)
    ]
    separate = run_many(each, "mine", ["distance"], **given)
    assert (separate["largest"][1::2] != together["largest"][1::2]).any()
    assert (separate["distance"][::2] == together["distance"][::2]).all()
    monkeypatch.setattr(ensemble_run, "KEPT", 300)  # rows: one run or two at a time
    again = run_many(scenarios, control, ["distance"], **given)
    assert all((again[name] == together[name]).all() for name in together)
    for i, scenario in enumerate(scenarios):
        run = cl.run_scenario(scenario, control, index=i, step=5e-3, tolerance=DEFAULT_TOLERANCE)
        assert largest_slip(run) == together["largest"][i]
        assert run["distance"][-1] == together["distance"][i]
    assert repr(control) == "SlipPI(slip=0.3, integral=0.0)"


def test_metrics_of_failed_runs_are_not_computed(scenarios: list[cl.Scenario]) -> None:
    greedy = dataclasses.replace(scenarios[0], demand=cl.Profile.of(1e6))
    measured: list[cl.Result] = []

    def metric(result: cl.Result) -> float:
        measured.append(result)
        return 1.0

    outcomes = run_many([greedy, scenarios[0]], "open_loop", metrics={"one": metric})
    assert list(outcomes) == ["one", FAILED]
    assert same(outcomes["one"], np.array([np.nan, 1.0]))
    assert len(measured) == 1


class Wordy(Broken):
    def sample(self, measurement: Measurement[Any], memory: Any) -> Any:
        return {"nothing": None, "shape": (np.zeros(2), memory)}[self.last]


def test_an_answer_of_a_controller_of_many_is_checked(scenarios: list[cl.Scenario]) -> None:
    for last in ("nothing", "shape"):
        with pytest.raises(ValueError, match=r"^Wordy\.sample returned .* and the memory$"):
            cl.run_scenario(scenarios[0], Wordy(last=last))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"outcomes": ["speed"]}, r"outcome = 'speed' must be one of: utilisation"),
        ({"controller": "pid"}, r"controller = 'pid' must be one of the scenario's"),
        ({"tolerance": 1.0}, r"tolerance = 1.0 is out of range"),
        ({"metrics": [len]}, "metrics must be functions by"),
        ({"index": range(3)}, r"index = .* must have 10 entries"),
        ({"step": [0.01, 0.005]}, r"step = .* must have 10 entries"),
        ({"scenarios": cl.load_scenario("dry_wet_dry.toml")}, r"a list, such as \[scenario\]"),
        ({"scenarios": ["x.toml"]}, "expected a Scenario, got 'x.toml'; contactlib.load_scen"),
    ],
)
def test_refusals(scenarios: list[cl.Scenario], given: dict[str, Any], message: str) -> None:
    settings = {"scenarios": scenarios, "controller": "creep_pi", "outcomes": WORK, **given}
    with pytest.raises(ValueError, match=message):
        run_many(**settings)


def test_no_runs_have_no_outcomes() -> None:
    assert run_many([], "creep_pi", WORK)["slip_work"].shape == (0,)


@pytest.mark.slow
def test_memory_is_bounded(scenarios: list[cl.Scenario], monkeypatch: pytest.MonkeyPatch) -> None:
    """By the number of runs side by side, and not by how long or how many they are."""
    monkeypatch.setattr(ensemble_run, "FLEET", 200)
    peaks = {}
    for runs, duration in ((60, 3.0), (60, 9.0), (200, 0.2), (800, 0.2)):
        many = [dataclasses.replace(scenarios[7], duration=duration)] * runs
        tracemalloc.start()
        run_many(many, "creep_pi", list(OUTCOMES), step=0.01)
        peaks[runs, duration] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peaks[60, 9.0] < 1.02 * peaks[60, 3.0]
    assert peaks[800, 0.2] < 1.2 * peaks[200, 0.2]


def test_every_outcome_has_unit_and_description() -> None:
    for outcome in OUTCOMES.values():
        assert outcome.unit
        assert outcome.description


# ---- stacked controllers --------------------------------------------------------------------


def test_structure_is_all_but_numbers() -> None:
    known: dict[str, Any] = {"proportional_gain": 1e4, "integral_gain": 1e4}
    control = cl.traction.CreepPI(reference=0.01, **known)
    assert structure(control) == structure(cl.traction.CreepPI(reference=0.02, **known))
    with_torque = cl.traction.CreepPI(reference=0.01, reference_torque=1e4, **known)
    assert structure(control) != structure(with_torque)
    assert structure(control) != structure(ThresholdControl())
    assert stacked([control, control]) is control


def test_a_run_until_its_stop_has_the_outcomes_of_the_rows_until_then() -> None:
    level = cl.Track(friction_left=cl.Profile.of(0.6))
    coach = dataclasses.replace(cl.load_scenario("coach_braking.toml"), track=level)
    some = [
        dataclasses.replace(coach, initial_speed=v, design_speed=40.0, duration=2.5)
        for v in (0.8, 1.1, 30.0)
    ]
    names = ["stopping_distance", "air_used", "slip_work", "jerk", "recovery_time"]
    given: dict[str, Any] = {"step": 0.01, "tolerance": DEFAULT_TOLERANCE}
    ended = run_many(some, "wsp", names, metrics={"end": lambda r: r.time[-1]}, until_stop=True)
    whole = run_many(some, "wsp", names)
    assert same(ended["stopping_distance"], whole["stopping_distance"])
    assert np.isinf(ended["stopping_distance"]).tolist() == [False, False, True]
    assert ended["failed"].tolist() == [0.0, 0.0, 0.0]
    assert ended["jerk"][0] != whole["jerk"][0]  # the jerk of the standstill
    for i, scenario in enumerate(some):
        run = cl.run_scenario(scenario, "wsp", index=i, until_stop=True, **given)
        slow = np.abs(run["speed"]) < STOPPED_SPEED
        assert slow.tolist() == [False] * (slow.size - 1) + [i < 2]
        assert ended["end"][i] == run.time[-1]
        again = cl.metrics(run, scenario.drivetrain)
        assert [ended[name][i] for name in names] == [getattr(again, name) for name in names]
