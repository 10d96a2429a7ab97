"""The explorer page's live run against Python's simulation and analysis."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from explorer_page import ExplorerPage, Found
from explorer_vehicle import SAMPLE, SPEED, fold_of, vehicle_of, with_memory
from numpy.testing import assert_allclose
from scipy.integrate import cumulative_trapezoid

import contactlib as cl

pytestmark = pytest.mark.tools

FALLING = 0.024  # of the roller rig
HOLDING = {"mode": "creep", "torque_max": 40e3}

# Starts a run, does one thing after another, and returns all that is known in the end.
DRIVE = """async ({ vehicle, load, speed, control, fold, interval, steps }) => {
  await contactlib.ready;
  const run = new contactlib.run.Run();
  Object.assign(run.control, control);
  run.start(vehicle, load, speed);
  run.watch(fold);
  run.recordInterval = interval;
  for (const step of steps) {
    if (typeof step === "number") run.advance(step);
    else if (!Array.isArray(step)) Object.assign(run.control, step);
    else if (step[0] === "recordInterval") run.recordInterval = step[1];
    else run[step[0]](...step.slice(1));
  }
  const rows = Object.entries(run.history.window());
  return {
    rows: Object.fromEntries(rows.map(([name, values]) => [name, Array.from(values)])),
    events: run.takeEvents(),
    stopped: run.stopped,
    state: { ...run.motion.drivetrain.state },
    patch: run.motion.patch,
    sample: contactlib.run.SAMPLE,
  };
}"""


def drive(
    page: ExplorerPage,
    wheelset: cl.Wheelset,
    control: dict[str, Any],
    *steps: Any,
    fold: float | None = None,
    interval: float = 2e-3,
    speed: float = SPEED,
    **changes: Any,
) -> Found:
    """A run under a control, with what is done one after another.

    A number lets some time pass [s], a mapping changes the control, and a list names a method of
    the page's run and its arguments.
    """
    given = {
        "vehicle": vehicle_of(wheelset) | changes,
        "load": wheelset.element.axle_load,
        "speed": speed,
        "control": control,
        "fold": fold,
        "interval": interval,
        "steps": steps,
    }
    return Found(**page.call(DRIVE, given))


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_a_wheel_that_stands_holds_a_torque_or_breaks_loose(
    page: ExplorerPage, rig: cl.Model, share: float
) -> None:
    wheelset, duration, rate = with_memory(rig.wheelset), 0.5, 1e5
    torque = share * fold_of(wheelset).drive_torque
    control = {"drive_torque": 0.0, "torque_rate": rate}
    run = drive(page, wheelset, control, {"drive_torque": torque}, duration, speed=0.0)
    ramp = cl.Profile((0.0, torque / rate, 2.0), (0.0, torque, torque))
    other = cl.simulate(wheelset, cl.TorqueControl(ramp), initial_speed=0.0, duration=duration)
    expected = np.interp(run["time"], other.time, other["creep_force"])
    assert_allclose(run["creep_force"], expected, atol=3e-3 * np.abs(expected).max())
    # Below the minimum speed the creepage is the slip velocity over that speed.
    slip = run["creepage"] * wheelset.element.minimum_speed
    expected = np.interp(run["time"], other.time, other["slip_velocity"])
    assert_allclose(slip, expected, atol=3e-2 * np.abs(expected).max())
    moved = cumulative_trapezoid(other["slip_velocity"], other.time, initial=0)
    moved = np.interp(run["time"], other.time, moved)
    assert_allclose(run["displacement"], moved, atol=3e-2 * np.abs(moved).max())
    assert (run["speed"] == 0.0).all()
    assert (abs(slip[-1]) < 1e-3) == (share < 1.0)
    assert run.stopped is None


def test_memory_begins_with_steady_rolling(page: ExplorerPage, rig: cl.Model) -> None:
    """When it is switched on; then a kick finds the force as it was."""
    remembering = vehicle_of(rig.wheelset) | {"memory": True}
    on = ["configure", remembering, rig.wheelset.element.axle_load]
    run = drive(page, rig.wheelset, {"drive_torque": 2e4}, 0.01, on, 0.01, ["kick", 0.01], 0.01)
    _, kicked = (int(i) for i in np.flatnonzero(np.diff(run["time"]) == 0.0))
    force = run["creep_force"]
    assert_allclose(force[: kicked + 2], force[0], rtol=1e-9)
    assert run["creepage"][kicked + 1] > run["creepage"][kicked] + 0.009
    assert abs(force[kicked + 2] / force[kicked] - 1.0) > 0.05


def test_without_an_integral_the_torque_is_the_steady_one_and_the_gain_s(
    page: ExplorerPage, rig: cl.Model
) -> None:
    gain, kick = 1e6, 1e-3
    given = {"creepage": FALLING, "proportional_gain": gain}
    run = drive(page, rig.wheelset, HOLDING | given, ["kick", kick], SAMPLE, interval=SAMPLE)
    steady = rig.wheelset.balanced(creepage=FALLING, speed=SPEED).drive_torque
    assert run["drive_torque"][0] == pytest.approx(steady, rel=1e-12)
    assert run["drive_torque"][-1] == pytest.approx(steady - gain * kick, rel=1e-12)


def test_a_wet_patch_begins_and_ends_between_two_rows(page: ExplorerPage, rig: cl.Model) -> None:
    length = 0.3
    run = drive(
        page,
        rig.wheelset,
        {"drive_torque": 0.5 * fold_of(rig.wheelset).drive_torque},
        ["placePatch", 0.5, length, 0.05],
        0.1,
    )
    assert run.names == ["patch_begins", "patch_ends"]
    lasted = run.first("patch_ends")["time"] - run.first("patch_begins")["time"]
    assert lasted == pytest.approx(length / SPEED, abs=2.0 * SAMPLE)
    assert set(run["friction"].tolist()) == {0.5, 1.0}
    edges = np.flatnonzero(np.diff(run["friction"]))
    assert np.diff(run["time"])[edges] == pytest.approx([SAMPLE, SAMPLE])
    assert run.patch is None


def test_what_is_done_at_once_is_seen_at_once(page: ExplorerPage, rig: cl.Model) -> None:
    run = drive(
        page,
        rig.wheelset,
        {"drive_torque": 2e4},
        0.0102,
        ["kick", 0.003],
        0.0102,
        ["setSpeed", 12.0],
        0.01,
    )
    before, after = (int(i) for i in np.flatnonzero(np.diff(run["time"]) == 0.0))
    kicked = run["creepage"][before + 1] - run["creepage"][before]
    assert kicked == pytest.approx(0.003, abs=1e-15)
    assert run["time"][before] == pytest.approx(0.0102)
    assert run["speed"][[after, after + 1]].tolist() == [10.0, 12.0]
    assert run["creepage"][after + 1] == pytest.approx(run["creepage"][after], abs=1e-15)
    assert np.diff(run["time"]).max() == pytest.approx(2e-3)


def test_the_rate_is_that_of_the_creepage(page: ExplorerPage, locomotive: cl.Model) -> None:
    run = drive(
        page, locomotive.wheelset, {"drive_torque": 2e4}, ["kick", 2e-3], 0.2, interval=SAMPLE
    )
    time, rate = run["time"][1:], run["creepage_rate"][1:]
    gone = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    assert np.ptp(gone) > 1e-3
    assert_allclose(gone, run["creepage"][1:] - run["creepage"][1], atol=1e-3 * np.ptp(gone))


def test_parameters_change_while_it_runs(page: ExplorerPage, rig: cl.Model) -> None:
    load = rig.wheelset.element.axle_load
    heavier = vehicle_of(rig.wheelset) | {"inertia": 500.0, "contact": "elliptic"}
    run = drive(
        page, rig.wheelset, {"drive_torque": 2e4}, 0.1, ["configure", heavier, 0.9 * load], 0.5
    )
    (at,) = np.flatnonzero(np.diff(run["time"]) == 0.0)
    assert run["creepage"][at + 1] == run["creepage"][at]
    assert run["creep_force"][at + 1] != run["creep_force"][at]
    assert run["creepage"][-1] != pytest.approx(run["creepage"][at], rel=1e-3)
    assert run["creepage_rate"][-1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("integral_gain", [0.0, 2e6])
def test_a_change_of_mode_is_no_kick(
    page: ExplorerPage, rig: cl.Model, integral_gain: float
) -> None:
    """Creep control takes over during a slip-away, and gives back later."""
    fold = fold_of(rig.wheelset)
    creep = HOLDING | {"proportional_gain": 1e6, "integral_gain": integral_gain, "creepage": 0.02}
    run = drive(
        page,
        rig.wheelset,
        {"drive_torque": 0.999 * fold.drive_torque, "torque_rate": 1e3},
        {"drive_torque": 1.01 * fold.drive_torque},
        0.239,
        ["recordInterval", SAMPLE],
        0.001,
        creep,
        0.01,
        ["recordInterval", 2e-3],
        3.74,
        ["recordInterval", SAMPLE],
        0.01,
        {"mode": "torque", "drive_torque": 0.8 * fold.drive_torque},
        0.01,
        ["recordInterval", 2e-3],
        2.0,
        fold=fold.creepage,
    )
    torque = run["drive_torque"]
    for when in (0.24, 4.0):
        at = int(np.searchsorted(run["time"], when - 1e-9))
        assert run["time"][at + 1] - run["time"][at] == pytest.approx(SAMPLE)
        largest = 1e3 * SAMPLE if when > 1.0 else 0.0  # of a ramp in one sample
        assert abs(torque[at + 1] - torque[at]) <= largest + 1e-6
        assert run["creepage"][at] > 1.02 * fold.creepage
    assert run["creepage"][at] == pytest.approx(0.02, rel=1e-3)
    assert run.names == ["peak_passed", "returned"]


def test_the_integral_does_not_wind_up_at_a_limit(page: ExplorerPage, rig: cl.Model) -> None:
    """After a large kick the torque is zero on the whole way back, and right again soon after."""
    gains = {"proportional_gain": 1e6, "integral_gain": 4e6, "creepage": 0.02}
    run = drive(page, rig.wheelset, HOLDING | gains, ["kick", 1.0], 4.0)
    idle = run["drive_torque"] == 0.0
    assert np.sum(idle) > 50
    assert run["creepage"].max() == pytest.approx(1.02)
    assert run["creepage"].min() > 0.01
    assert run["creepage"][-1] == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize(
    ("control", "steps", "changes", "message"),
    [
        (
            {"drive_torque": 27e3, "torque_rate": 1e6},
            [{"drive_torque": 60e3}, 5.0],
            {},
            r"the rim runs at 120\.\d m/s, above the limit of 120 m/s",
        ),
        (
            {"drive_torque": 10e3},
            [["kick", -1.2], 0.01],
            {},
            r"the rim runs at -\d\.\d m/s, below the limit of 0 m/s",
        ),
        (
            {"drive_torque": 0.0},
            [["setSpeed", 0.2], 9.0],
            {"mass": 1e4, "constant": 1e3},
            r"the speed is 0\.100 m/s, below the minimum of 0\.1 m/s",
        ),
    ],
)
def test_it_stops_where_it_makes_no_sense(
    page: ExplorerPage,
    rig: cl.Model,
    control: dict[str, float],
    steps: list[Any],
    changes: dict[str, float],
    message: str,
) -> None:
    run = drive(page, rig.wheelset, control, *steps, 1.0, **changes)
    assert run.stopped is not None
    assert re.fullmatch(message, run.stopped)
    assert run["time"][-1] < 9.0


@pytest.mark.parametrize(
    ("control", "steps", "message"),
    [
        ({"drive_torque": 4e4}, [], "control.drive_torque = 40000 .* no grip"),
        ({"torque_rate": -1.0}, [], "control.torque_rate = -1 .* >= 0"),
        ({"delay": 0.6}, [], "control.delay = 0.6 .* <= 0.5"),
        ({}, [["setSpeed", 0.05]], "speed without memory = 0.05 .* >= 0.1"),
        ({}, [["placePatch", 0.0, 1.0, 1.0]], "friction = 0 .* >= 0.001 and <= 1000"),
        ({}, [["placePatch", 0.5, 0.0, 1.0]], "length = 0 "),
        ({}, [["placePatch", 0.5, 1.0, -1.0]], "ahead = -1 "),
        ({}, [["kick", math.nan]], "creepage = NaN "),
        ({}, [["advance", -1.0]], "duration = -1 "),
    ],
)
def test_refusals(
    page: ExplorerPage, rig: cl.Model, control: dict[str, float], steps: list[Any], message: str
) -> None:
    with pytest.raises(Exception, match=message):
        drive(page, rig.wheelset, control, *steps, damping=0.0)


def test_the_history_keeps_the_last_rows(page: ExplorerPage) -> None:
    windows = page.call(
        """() => {
          const { History, COLUMNS } = contactlib.recorder;
          const history = new History(5);
          const seen = [];
          for (let i = 0; i < 13; i++) {
            history.append(Object.fromEntries(COLUMNS.map((name, j) => [name, i + 100 * j])));
            const all = history.window();
            const late = history.window(i - 1.5);
            seen.push([[...all.time], [...all.speed], [...late.time]]);
          }
          return seen;
        }"""
    )
    for i, (time, speed, late) in enumerate(windows):
        first = max(i - 4, 0)
        assert time == list(range(first, i + 1))
        assert speed == [t + 400.0 for t in time]
        assert late == list(range(max(i - 2, 0), i + 1))
