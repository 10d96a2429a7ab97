"""The FMU under a tool's own solver, against its own steps and against Python.

FMPy brings CVode: a multistep method with error control and roots, which shares nothing with the
FMU's integrator or by `contactlib.simulate`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from exported_fmu import exported, fitting
from fmpy.sundials import CVodeSolver
from fmu_instance import Subject

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.export.description import Description

TOLERANCE = 1e-8  # of every solver
INTERVAL, STOP = 0.01, 5.0

# A torque that the contact can hold, one that it cannot, and one that lets it stick again; held
# between the jumps, so that all see the same.
TORQUE_TIME = (0.0, 1.0, 1.0, 2.5, 2.5, STOP)
TORQUE = (24e3, 24e3, 29e3, 29e3, 15e3, 15e3)


SUBJECTS = [Subject(name, v) for name in ("wheelset", "wheelset-memory") for v in (2, 3)]


@pytest.fixture(scope="module", params=SUBJECTS, ids=str)
def subject(request: pytest.FixtureRequest) -> Subject:
    chosen: Subject = request.param
    return chosen


@pytest.fixture(scope="module")
def fmu(subject: Subject, locomotive: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fmu") / "subject.fmu"
    return cl.export_fmu(fitting(locomotive, subject.name), path, **subject.arguments)


def slip_away(fmu: Path, model: cl.Model, interface: str, tolerance: float, **given: float) -> Any:
    """The run under the torque above, or under other inputs."""
    inputs = Description(model, "wheelset").of_role("input")
    names = ["time", *(v.name for v in inputs)]
    signals = np.empty(len(TORQUE), [(name, np.float64) for name in names])
    for variable in inputs:
        signals[variable.name] = given.get(variable.name, variable.start)
    signals["time"] = TORQUE_TIME
    if not given:
        signals["drive_torque"] = TORQUE
    return fmpy.simulate_fmu(
        str(fmu),
        fmi_type=interface,
        solver="CVode",
        input=signals,
        relative_tolerance=tolerance,
        stop_time=STOP,
        output_interval=INTERVAL,
    )


@pytest.fixture(scope="module")
def exchanged(fmu: Path, locomotive: cl.Model) -> Any:
    return slip_away(fmu, locomotive, "ModelExchange", TOLERANCE)


@pytest.fixture(scope="module")
def stepped(fmu: Path, locomotive: cl.Model) -> Any:
    return slip_away(fmu, locomotive, "CoSimulation", TOLERANCE)


def on_grid(time: FloatArray, values: FloatArray) -> FloatArray:
    """Values at the multiples of the interval, without interpolation: the last at each time."""
    grid = INTERVAL * np.arange(round(STOP / INTERVAL) + 1)
    last = np.searchsorted(time, grid + 1e-9, side="right") - 1
    np.testing.assert_allclose(time[last], grid, rtol=0.0, atol=1e-9)
    return values[last]


def difference(values: FloatArray, expected: FloatArray) -> float:
    """Largest, over the largest magnitude."""
    return float(np.abs(values - expected).max() / np.abs(expected).max())


def test_solver_and_steps_of_the_fmu_give_one_trajectory(exchanged: Any, stepped: Any) -> None:
    # CVode bounds the error of each step; over the slip-away and the return they add up: 41 times
    # the tolerance was seen, at the return, where the wheel sticks within milliseconds.
    assert np.max(stepped["creepage"]) > 1.0
    for name in ("omega", "speed"):
        solved = on_grid(exchanged["time"], exchanged[name])
        assert difference(solved, stepped[name]) < 100.0 * TOLERANCE


def test_braked_wheel_locks_and_stays_locked(fmu: Path, locomotive: cl.Model) -> None:
    brake = {"brake_torque": 2e4, "friction_scale": 0.3}
    interfaces = ("CoSimulation", "ModelExchange")
    runs = [slip_away(fmu, locomotive, name, 1e-6, **brake) for name in interfaces]
    for run in runs:
        assert run["speed"][-1] > 5.0
        assert np.abs(run["omega"][run["time"] > 2.0]).max() < 1e-4
    assert runs[0]["speed"][-1] == pytest.approx(runs[1]["speed"][-1], rel=1e-5)


def test_steps_of_the_fmu_follow_the_tolerance(
    fmu: Path, locomotive: cl.Model, stepped: Any
) -> None:
    errors = {
        tolerance: difference(
            slip_away(fmu, locomotive, "CoSimulation", tolerance)["omega"], stepped["omega"]
        )
        for tolerance in (1e-6, 1e-4)
    }
    assert all(error < tolerance for tolerance, error in errors.items())
    assert errors[1e-4] > 10.0 * errors[1e-6]


def test_truth_values_change_at_events_only(exchanged: Any) -> None:
    time, falling = exchanged["time"], exchanged["falling_branch"].astype(bool)
    flips = np.flatnonzero(falling[1:] != falling[:-1])
    assert flips.size == 2  # over the peak and back
    # An event has two rows, before and after.
    assert (time[flips] == time[flips + 1]).all()
    events = np.flatnonzero(time[1:] == time[:-1])
    assert events.size == 4  # with the two jumps of the torque
    for name in ("speed_regularized", "k_hat_limited", "force_limited"):
        assert not exchanged[name].any()


WAVE = 0.4 * np.sin(4.0 * np.pi * np.linspace(0.0, 0.2, 1001))
MOVING = {
    "force_element-memory": {"omega": 20.5 + WAVE},
    "wheelset-memory": {"drive_torque": 32e3 + 0.0 * WAVE, "normal_load": 2e5 * (1.0 + WAVE)},
}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", MOVING)
def test_inputs_that_move_with_memory(
    locomotive: cl.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, version: int
) -> None:
    """FMPy holds them between the steps of its solver: docs/reference/tools.md says what to do."""
    folder, given = exported(locomotive, tmp_path, name, version), MOVING[name]
    names, columns = ("time", *given), [np.linspace(0.0, 0.2, WAVE.size), *given.values()]
    signals = np.array(list(zip(*columns, strict=True)), [(key, np.float64) for key in names])

    def run(interface: str, tolerance: float, interval: float = 1e-2) -> Any:
        how: dict[str, Any] = {
            "relative_tolerance": tolerance,
            "output_interval": interval,
            "stop_time": 0.2,
        }
        how |= {"input": signals, "output": ["creep_force"]}
        rows = fmpy.simulate_fmu(str(folder), fmi_type=interface, **how)
        return np.interp(np.linspace(0.0, 0.2, 21), rows["time"], rows["creep_force"])

    steps = run("CoSimulation", 1e-6, 1e-4)
    assert difference(run("ModelExchange", 1e-5, 1e-3), steps) < 1e-3
    held = CVodeSolver.f

    def prompt(self: Any, t: float, *given: Any) -> int:
        self.input.apply(t)
        return int(held(self, t, *given))

    monkeypatch.setattr(CVodeSolver, "f", prompt)
    assert difference(run("ModelExchange", 1e-6), steps) < 5e-4
