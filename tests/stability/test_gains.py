"""Gains that hold the falling branch, and whether any does, against eigenvalues and runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from falling_friction import with_falling
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import examples, magnitude, number
from wheelsets import BODIES, made_wheelset

import contactlib as cl
from contactlib import stability
from contactlib.vehicle import Resistance


@examples(200)
@given(
    pole=number(-300.0, 500.0),
    gain=magnitude(1e-6, 1e-2),
    loop=number(-100.0, 2000.0),
    integral=number(-1e3, 1e5),
    lag=st.one_of(st.just(0.0), magnitude(1e-4, 1.0)),
)
def test_routh_agrees_with_eigenvalues(
    pole: float, gain: float, loop: float, integral: float, lag: float
) -> None:
    # States: creepage, integral of its error, and (if it lags) the torque over the gain.
    matrix = np.array([[pole - loop, integral], [-1.0, 0.0]])
    if lag > 0.0:
        matrix = np.array([[pole, 0.0, 1.0], [-1.0, 0.0, 0.0], [-loop, integral, -1.0]])
        matrix[2] /= lag
    worst = float(np.linalg.eigvals(matrix).real.max())
    if abs(worst) < 1e-9 * np.abs(matrix).max():
        return  # undecided
    assert stability.pi_stable(pole, gain, loop / gain, integral / gain, lag) == (worst < 0.0)


@examples(200)
@given(pole=number(-300.0, 500.0), part=number(0.01, 2.0), lag=magnitude(1e-4, 1e-1))
def test_routh_at_its_border(pole: float, part: float, lag: float) -> None:
    loop = abs(pole) * (1.0 + part) + 1.0
    largest = (1.0 - pole * lag) * (loop - pole) / lag
    for factor, stable in ((1.0 - 1e-6, pole * lag < 1.0), (1.0 + 1e-6, False)):
        assert stability.pi_stable(pole, 1.0, loop, factor * largest, lag) == stable
    polynomial = [lag, 1.0 - pole * lag, loop - pole, largest]
    swing = np.roots(polynomial).real  # on the border: a pair on the imaginary axis
    assert np.abs(swing).min() < 1e-7 * np.abs(np.roots(polynomial)).max()


def test_without_integral_action_the_lag_alone_counts() -> None:
    assert stability.pi_stable(10.0, 1.0, [9.99, 10.01], 0.0, 0.0999).tolist() == [False, True]
    assert not stability.pi_stable(10.0, 1.0, [11.0, 1e6], 0.0, 0.1).any()


@pytest.mark.parametrize(
    ("pole", "delay", "step", "verdict"),
    [
        (20.0, 0.0, 0.0, "holds"),
        (20.0, 0.99 * stability.delay_limit(20.0, robust=True), 0.0, "holds"),
        (20.0, 1.1 * stability.delay_limit(20.0, robust=True), 0.0, "not robust"),
        (20.0, 0.99 * stability.delay_limit(20.0), 0.0, "not robust"),
        (20.0, stability.delay_limit(20.0), 0.0, "impossible"),
        (-5.0, 1.0, 0.1, "holds"),
        (1.0, 0.95 / 1.5, 0.95 / 1.5, "not robust"),  # one sample of delay allows p h < log(2),
        (1.0, 0.7, 0.7, "impossible"),  # not a p tau < 1
    ],
)
def test_verdicts_are_those_of_the_window(
    pole: float, delay: float, step: float, verdict: str
) -> None:
    assert cl.controllability(pole, delay=delay, sample_time=step).verdict == verdict


def test_p_tau_counts_the_delay_and_half_a_sample() -> None:
    step = 0.95 / 1.5
    assert cl.controllability(1.0, delay=step, sample_time=step).p_tau == pytest.approx(0.95)
    sampled = cl.controllability(1.0, sample_time=2.0)
    assert sampled.p_tau == 1.0
    assert not sampled.window.empty  # and yet there is a gain


def test_verdict_names_its_numbers() -> None:
    answer = cl.controllability(70.0, gain=2e-4, delay=2e-3, lag=1e-3, sample_time=4e-3)
    assert answer.window == stability.proportional_window(
        70.0, 2e-4, delay=2e-3, lag=1e-3, sample_time=4e-3
    )
    for part in (
        "pole 70 1/s",
        "delay 2 ms",
        "lag 1 ms",
        "sampling 4 ms",
        f"p tau {70.0 * 5e-3:.2f}",
        f"{answer.window.highest * 2e-4:.4g} 1/s",
    ):
        assert part in answer.text
    assert "\n" not in answer.text


@pytest.mark.parametrize(
    ("name", "value"), [("delay", -1e-3), ("lag", math.inf), ("sample_time", -1.0)]
)
def test_times_must_be_times(name: str, value: float) -> None:
    given: dict[str, Any] = {name: value}
    with pytest.raises(ValueError, match=name):
        cl.controllability(10.0, **given)
    with pytest.raises(ValueError, match="gain"):
        stability.proportional_window(10.0, 0.0)


def test_reduced_plant_has_the_gain_bound_of_creep_control(rig: cl.Model) -> None:
    body = rig.wheelset
    for creepage in (0.018, 0.022, 0.03):
        plant = stability.reduced_plant(body, creepage, speed=12.0)
        point = body.balanced(creepage=creepage, speed=12.0)
        assert plant.pole == pytest.approx(point.eigenvalues[0], rel=1e-12)
        bound = cl.creep_control_gain(body, point)
        assert plant.pole / plant.gain == pytest.approx(bound, rel=1e-12)


V = 10.0  # [m/s]


@examples(40)
@given(
    body=BODIES,
    speed=magnitude(1.0, 60.0),
    x=number(0.1, 4.0),
    held=st.booleans(),
    damped=st.booleans(),
    resisted=st.booleans(),
    residual=st.sampled_from([1.0, 0.4, 0.0]),
)
def test_creep_control_gain_is_the_least(
    body: dict[str, Any],
    speed: float,
    x: float,
    held: bool,
    damped: bool,
    resisted: bool,
    residual: float,
) -> None:
    body = body | ({"mass": None} if held else {}) | ({} if damped else {"damping": 0.0})
    wheelset = made_wheelset(**body if resisted else body | {"resistance": Resistance()})
    wheelset = with_falling(wheelset, residual, 0.6)
    point = wheelset.balanced(creepage=x * wheelset.element.saturation_creepage, speed=speed)
    gain = cl.creep_control_gain(wheelset, point)
    neutral = residual == 1.0 and not (held or resisted)  # nothing meets a common acceleration
    if neutral and damped and point.creep_force_slope < 0.0:
        assert gain == math.inf
    assume(1.0 < gain < math.inf)
    system = wheelset.linearize(point)
    creepage = system.C[system.output_labels.index("creepage")]
    for factor, stable in ((0.999, False), (1.001, True)):
        closed = system.A - factor * gain * np.outer(system.B[:, 0], creepage)
        if neutral:
            values = np.linalg.eigvals(closed)
            assert np.abs(values).min() < 1e-9 * np.abs(closed).max()
            assert (values.real.sum() < 0.0) == stable
        else:
            assert (np.linalg.eigvals(closed).real.max() < 0.0) == stable
