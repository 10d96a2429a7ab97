"""A coach that brakes on contaminated rails, with wheel-slide protection and without radar."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contactlib as cl
from contactlib.runs import VehicleResult

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


def time_off(result: VehicleResult) -> float:
    """Time for which the estimated speed errs by more than 5 % [s]."""
    speed, estimate = (result[name][:, 0] for name in ("speed", "measured_speed"))
    off = np.abs(estimate - speed) > WITHIN * speed
    return float(off[speed > 0.1].sum() * (result.time[1] - result.time[0]))


def speed_after(result: VehicleResult) -> float:
    """Speed of the vehicle once its last axle leaves the contaminated rails [m/s]."""
    return float(result["speed"][np.searchsorted(result["distance"][:, 3], 300.0), 0])


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
        cl.run_many([coach(66.0, slippery=True, locks=name == "open_loop")], name, names)
        for name in ("wsp", "open_loop")
    )
    assert wsp["locked_time"] == 0.0
    assert wsp["stopping_distance"] < 1500.0 < locked["distance"]
    assert np.isnan(locked["stopping_distance"])
    assert locked["locked_time"] > 50.0
