"""Gains that delay, lag and sampling leave, against eigenvalues and stepped loops."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import minimize_scalar
from scipy.special import lambertw
from strategies import examples, magnitude, number

from contactlib import stability
from contactlib.stability.delay import _memory, sampled_loop


def delayed_eigenvalues(pole: float, loop: float, delay: float, lag: float, n: int) -> np.ndarray:
    """Rightmost roots by collocation of the history over one delay (Chebyshev), not by phases."""
    if lag > 0.0:
        now = np.array([[pole, 1.0], [0.0, -1.0 / lag]])
        then = np.array([[0.0, 0.0], [-loop / lag, 0.0]])
    else:
        now, then = np.array([[pole]]), np.array([[-loop]])
    x = np.cos(np.pi * np.arange(n + 1) / n)  # from 1 (now) to -1 (a delay ago)
    weight = np.where(np.arange(n + 1) % n == 0, 2.0, 1.0) * (-1.0) ** np.arange(n + 1)
    difference = np.subtract.outer(x, x) + np.eye(n + 1)
    slope = np.outer(weight, 1.0 / weight) / difference
    slope -= np.diag(slope.sum(axis=1))
    size = len(now)
    generator = np.kron(slope * 2.0 / delay, np.eye(size))
    generator[:size] = 0.0
    generator[:size, :size], generator[:size, -size:] = now, then
    return np.linalg.eigvals(generator)


def sampled_radius(
    pole: float, loop: float, delay: float, step: float, *, lag: float = 0.0
) -> float:
    """Spectral radius of one sample, stepped through with the exact flow of plant and torque."""
    size = 1 + (lag > 0.0)  # creepage; the late torque of the motor; the command
    rates = np.zeros((size + 1, size + 1))
    rates[0, :2] = pole, 1.0
    if lag > 0.0:
        rates[1, 1:] = -1.0 / lag, 1.0 / lag
    whole = int(delay / step + 1e-9)
    part = delay - whole * step
    first, rest = expm(rates * part), expm(rates * (step - part))
    columns = []
    for unit in np.eye(size + whole + 1):
        state, sent = unit[:size], unit[size:]  # commands of earlier samples, newest first
        sent = np.append(-loop * state[0], sent)
        for flow, command in ((first, sent[whole + 1]), (rest, sent[whole])):
            state = (flow @ np.append(state, command))[:size]
        columns.append(np.append(state, sent[:-1]))
    return float(np.abs(np.linalg.eigvals(np.array(columns).T)).max())


@pytest.mark.parametrize(
    ("pole", "lag", "delay", "step"),
    [
        *itertools.product([-40.0, 0.0, 5.0, 30.0, 90.0], [0.0, 1e-3], [0.01], [0.0]),
        *itertools.product([-20.0, 3.0, 25.0], [0.0, 4e-3], [0.0, 2e-3, 5e-3, 1e-2, 13e-3], [5e-3]),
    ],
)
def test_ends_of_the_window(pole: float, lag: float, delay: float, step: float) -> None:
    gain = 3e-4
    window = stability.proportional_window(pole, gain, delay=delay, lag=lag, sample_time=step)
    assert window.lowest == pytest.approx(pole / gain)
    assert not window.empty
    inside = 1e-3 * (window.highest - window.lowest)
    for end, side in ((window.lowest, 1.0), (window.highest, -1.0)):
        for kp, stable in ((end + side * inside, True), (end - side * inside, False)):
            if step == 0.0:
                eigenvalues = delayed_eigenvalues(pole, gain * kp, delay, lag, 40)
                assert (eigenvalues.real.max() < 0.0) == stable
            else:
                assert (sampled_radius(pole, gain * kp, delay, step, lag=lag) < 1.0) == stable


@examples(200)
@given(p_tau=number(-3.0, 0.99).filter(lambda p_tau: abs(p_tau) > 1e-6), delay=magnitude(1e-4, 1.0))
def test_ends_of_the_window_are_roots_of_the_characteristic_equation(
    p_tau: float, delay: float
) -> None:
    # s = p - k exp(-s tau) has the roots s = p + W(-k tau exp(-p tau))/tau, W of all branches.
    pole = p_tau / delay
    window = stability.proportional_window(pole, delay=delay)
    for loop in window:
        branches = np.arange(-3, 4)
        roots = pole + lambertw(-loop * delay * np.exp(-p_tau), branches) / delay
        assert roots.real.max() * delay == pytest.approx(0.0, abs=1e-6 if loop == pole else 1e-9)
    if p_tau > 0.0:  # closed form p tau = theta/tan(theta), g Kp = p/cos(theta)
        theta = math.acos(pole / window.highest)
        assert theta / math.tan(theta) == pytest.approx(p_tau, rel=1e-6)


def test_no_gain_beyond_the_limit() -> None:
    pole = 25.0
    limit = stability.delay_limit(pole)
    assert limit == 1.0 / pole
    assert stability.proportional_window(pole, delay=limit).empty
    assert not stability.proportional_window(pole, delay=0.999 * limit).empty
    assert stability.proportional_window(pole, delay=0.4 * limit, lag=0.6 * limit).empty
    assert not stability.proportional_window(pole, delay=0.4 * limit, lag=0.59 * limit).empty
    assert stability.proportional_window(pole, lag=limit).empty
    assert stability.proportional_window(pole, lag=0.999 * limit).highest == math.inf
    assert stability.delay_limit(-1.0) == math.inf


def test_a_tiny_delay_ends_a_window_of_a_lag_near_the_limit() -> None:
    """Where it turns the phase by p/w - 1/(w lag), at w**2 = (1/lag - p)/delay."""
    pole, lag, delay = 50.0, (1.0 - 5e-8) / 50.0, 1.1e-12
    w = math.sqrt((1.0 / lag - pole) / delay)
    highest = math.hypot(pole, w) * math.hypot(1.0, w * lag)
    window = stability.proportional_window(pole, delay=delay, lag=lag)
    assert window.highest == pytest.approx(highest, rel=1e-2)


def test_more_delay_leaves_fewer_gains() -> None:
    ends = [
        stability.proportional_window(30.0, delay=delay, lag=2e-3, sample_time=2e-3).highest
        for delay in np.arange(0.0, 0.035, 1e-3)
    ]
    assert (np.diff(ends) <= 0.0).all()
    assert ends[-1] == 30.0  # none is left


def test_the_robust_limit_has_a_sensitivity_of_two() -> None:
    frequency = np.geomspace(1e-3, 1e3, 20_001)

    def sensitivity(loop: float, p_tau: float) -> float:
        delayed = loop * np.exp(-1j * frequency)
        plain = 1j * frequency - p_tau
        return float(np.abs(plain / (plain + delayed)).max())

    def best(p_tau: float) -> float:
        ends = stability.proportional_window(p_tau, delay=1.0)
        return float(minimize_scalar(sensitivity, args=(p_tau,), bounds=ends).fun)

    assert best(0.3) == pytest.approx(2.0, rel=0.03)
    assert best(0.2) < 1.6 < 2.5 < best(0.4)
    assert stability.delay_limit(2.0, robust=True) == 0.15


@examples(200)
@given(p_h=number(-2.0, 3.0).filter(lambda p_h: abs(p_h) > 1e-3), step=magnitude(1e-4, 1.0))
def test_sampled_closed_forms(p_h: float, step: float) -> None:
    # z = a - gamma k, and z**2 - a z + gamma k by Jury
    pole, a = p_h / step, math.exp(p_h)
    gamma = math.expm1(p_h) / pole
    without = stability.proportional_window(pole, sample_time=step)
    assert without.highest == pytest.approx((a + 1.0) / gamma, rel=1e-9)
    late = stability.proportional_window(pole, sample_time=step, delay=step)
    if a < 2.0 - 1e-6:
        assert late.highest == pytest.approx(1.0 / gamma, rel=1e-9)
    elif a > 2.0 + 1e-6:
        assert late.empty


@pytest.mark.parametrize("whole", [1, 2, 7, 500])
def test_whole_samples_of_delay_have_an_exact_limit(whole: int) -> None:
    # z**n (z - a) + gamma k has its two rightmost roots meet at z = 1 where a = 1 + 1/n.
    step = 0.05 / whole
    limit = math.log1p(1.0 / whole) / step
    for part, held in ((0.999, True), (1.001, False)):
        answer = stability.controllability(part * limit, delay=0.05, sample_time=step)
        assert (answer.verdict != "impossible") == held
    pole = 0.4 * limit
    felt = stability.sampled_delay(delay=0.05, sample_time=step)
    sampled = stability.proportional_window(pole, delay=0.05, sample_time=step).highest
    alike = stability.proportional_window(pole, delay=felt).highest
    assert sampled == pytest.approx(alike, rel=0.5 / whole**2)


@pytest.mark.parametrize("times", [{}, {"delay": 0.3}, {"lag": 0.1}, {"delay": 2.0, "lag": 3.0}])
@pytest.mark.parametrize("pole", [50.0, 720.0, 1e4, 1e9])
def test_no_gain_holds_a_pole_that_outruns_the_samples(pole: float, times: dict[str, Any]) -> None:
    answer = stability.controllability(pole, sample_time=1.0, **times)
    assert answer.verdict == "impossible"
    assert answer.window == (pole, pole)


def test_pulse_transfer_function_of_an_integrator() -> None:
    numerator, denominator = sampled_loop(0.0, _memory((), ()), 0.0, 0.0, 0.1)
    z = 1.7
    assert np.polyval(numerator, z) / np.polyval(denominator, z) == pytest.approx(0.1 / (z - 1.0))


def test_a_hold_delays_by_half_a_sample() -> None:
    pole, delay = 20.0, 0.012
    steps = np.array([1e-3, 5e-4, 2.5e-4])
    errors = []
    for step in steps:
        exact = stability.proportional_window(pole, delay=delay, sample_time=step).highest
        felt = stability.sampled_delay(delay=delay, sample_time=step)
        assert felt == delay + 0.5 * step
        errors.append(abs(stability.proportional_window(pole, delay=felt).highest / exact - 1.0))
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.2)
    assert errors[0] < 0.005


@examples(120)
@given(
    pole=st.floats(5.0, 300.0),
    lag=st.floats(1e-4, 1e-2),
    sample_time=st.floats(5e-4, 1e-2),
    samples=st.integers(0, 4),
)
def test_a_sampled_window_contains_all_gains_that_hold(
    pole: float, lag: float, sample_time: float, samples: int
) -> None:
    delay = samples * sample_time
    window = stability.proportional_window(pole, delay=delay, lag=lag, sample_time=sample_time)

    def radius(gain: float) -> float:
        return sampled_radius(pole, gain, delay, sample_time, lag=lag)

    if window.empty:
        assert min(radius(gain) for gain in pole * np.geomspace(1.001, 30.0, 40)) > 1.0 - 1e-6
    elif window.highest > 1.01 * window.lowest:
        assert radius(math.sqrt(window.lowest * window.highest)) < 1.0
        assert radius(0.999 * window.lowest) > 1.0
        assert radius(1.001 * window.highest) > 1.0
