"""Sampled controllers of a user: copies with a state of their own, and what breaks the contract."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from designed import answers
from own_controller import SlipPI

import contactlib as cl
from contactlib.traction import Measurement, stacked


def answering(answer: Callable[[Measurement[float]], Any]) -> cl.SampledController:
    """Controller that only answers."""

    class Answering(cl.SampledController):
        sample_time = 0.01

        def torque(self, measurement: Measurement[float]) -> Any:
            return answer(measurement)

    return Answering()


def torques_of(control: cl.SampledController, demand: list[float]) -> list[float]:
    """Torques at the second sample of wheelsets that do not slip."""
    rolling = np.full(len(demand), 10.0)
    seen = Measurement(np.array(demand), rolling, rolling, np.zeros_like(rolling))
    return [float(torque) for torque in answers(stacked([control] * len(demand)), [seen, seen])[1]]


@pytest.mark.parametrize("demand", [2e4, -2e4, 0.0])
def test_any_kind_of_number_from_zero_to_the_demand_is_a_torque(demand: float) -> None:
    for kind in (float, int, np.float64, np.float32, np.array, np.int64):
        control = answering(lambda seen, kind=kind: kind(0.5 * seen.demand))  # type: ignore[misc]
        assert torques_of(control, [demand, demand]) == [0.5 * demand] * 2
    for part in (1e-12, -1e-12):  # rounding is no mistake, and does not get beyond the demand
        beyond = answering(lambda seen, part=part: (1.0 + part) * seen.demand)  # type: ignore[misc]
        assert abs(torques_of(beyond, [demand])[0]) <= abs(demand)


@pytest.mark.parametrize(
    ("answer", "shown"),
    [
        (lambda seen: None, "None"),
        (lambda seen: -1.0, r"-1\.0"),
        (lambda seen: 1.5 * seen.demand, r"30000\.0"),
        (lambda seen: float("nan"), "nan"),
        (lambda seen: float("-inf"), "-inf"),
        (lambda seen: np.array([1.0]), r"array\(\[1\.\]\)"),
        (lambda seen: [1.0, [2.0]], r"\[1\.0, \[2\.0\]\]"),
        (lambda seen: "1", "'1'"),
        (lambda seen: True, "True"),
        (lambda seen: 10**400, "1000"),
    ],
)
def test_what_is_no_torque_is_one_line(answer: Callable[..., Any], shown: str) -> None:
    line = (
        rf"^Answering\.torque at 0 s returned {shown}.*: it must return one number between 0 and "
    )
    with pytest.raises(ValueError, match=line) as caught:
        torques_of(answering(answer), [2e4])
    message = str(caught.value)
    assert "\n" not in message
    assert "the demand, 20000 N.m" in message
    assert message.endswith("; a return is missing") == (shown == "None")


def test_an_error_of_the_user_s_is_reported_with_its_place() -> None:
    def fail(seen: Measurement[float]) -> float:
        raise KeyError("slip")

    with pytest.raises(
        RuntimeError,
        match=r"Answering\.torque at 0 s: KeyError: 'slip' \(test_batching\.py, line \d+",
    ) as caught:
        torques_of(answering(fail), [2e4])
    assert isinstance(caught.value.__cause__, KeyError)


def test_wheelsets_whose_numbers_overflowed_are_not_called() -> None:
    control = answering(lambda seen: seen.demand)
    assert torques_of(control, [2e4, float("nan")]) == [2e4, 0.0]


def test_what_cannot_be_copied_is_reported() -> None:
    control = SlipPI()
    control.lock = threading.Lock()  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=r"SlipPI cannot be copied, and every run works on a copy"):
        torques_of(control, [2e4])


class Listed(cl.SampledController):
    """Keeps its state in a list that stands in the class."""

    sample_time = 0.01
    history: Any = []  # noqa: RUF012 - the mistake

    def torque(self, measurement: Measurement[float]) -> float:
        self.history.append(measurement.wheel_speed)
        return measurement.demand / len(self.history)


class Reset(Listed):
    history: Any = None

    def reset(self, measurement: Measurement[float], torque: float) -> None:
        self.history = self.history or []


def test_what_stands_in_a_class_is_of_each_run_too() -> None:
    for kind in (Listed, Reset):
        assert torques_of(kind(), [2e4, 1e4]) == torques_of(kind(), [2e4, 1e4]) == [1e4, 5e3]
    assert Listed.history == []


class Counts:
    """Impure, against the protocol: counts its samples in itself."""

    sample_time = 0.01
    samples = 0

    def start(self, measurement: Any, torque: Any) -> None:
        return None

    def sample(self, measurement: Measurement[Any], memory: None) -> tuple[Any, None]:
        self.samples += 1
        return measurement.demand / self.samples, None


def test_an_object_that_keeps_something_runs_twice_alike() -> None:
    scenario, control = cl.load_scenario("torque_step.toml"), Counts()
    first, second = (cl.run_scenario(scenario, control) for _ in range(2))  # type: ignore[arg-type]
    assert first == second
    assert control.samples == 0
