"""Loops, their margins and their delays against simulation."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import control
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from native_models import with_memory
from scipy.optimize import brentq
from strategies import examples, magnitude, number
from wheelsets import BODIES, encirclements, falling, made_wheelset, unstable, unstable_open

import contactlib as cl
from contactlib.stability import (
    control_systems,
    delay_limit,
    proportional_window,
    reduced_plant,
)
from contactlib.vehicle import OperatingPoint

SPEED = 10.0


def test_a_sampled_controller_needs_a_sampled_plant(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, gain = falling(body)
    plant = body.linearize(point)[["creepage"], ["drive_torque"]]
    sampled = control.tf([2.0 * gain, -1.9 * gain], [1.0, -1.0], 0.01)
    with pytest.raises(ValueError, match=r"sample the plant first, control\.sample_system\(plant"):
        control_systems.open_loop(plant, sampled)
    ready = control.sample_system(plant, 0.01, "zoh")
    ready = control.ss(ready, inputs="drive_torque", outputs="creepage")
    loop = control_systems.open_loop(ready, sampled)
    ours = control_systems.sampled_loop(
        body, point, sample_time=0.01, proportional_gain=1.9 * gain, integral_gain=10.0 * gain
    )
    z = np.exp(1j * np.linspace(0.1, 3.0, 7))
    np.testing.assert_allclose(loop(z), ours(z), rtol=1e-9)


def test_margins_of_a_proportional_loop_are_those_on_paper(rig: cl.Model) -> None:
    # L = f p/(s - p): leaves -1 for f -> 1, |L| = 1 at p sqrt(f^2 - 1), phase acos(1/f)
    body = rig.wheelset
    point, pole, gain = falling(body)
    for f, delay in ((1.3, 2e-12), (2.0, 1e-10), (5.0, 1e-7)):
        margins = control_systems.margins(
            control_systems.creep_loop(body, point, proportional_gain=f * gain)
        )
        crossover = pole * math.sqrt(f**2 - 1.0)
        assert margins.gain_lower == pytest.approx(1.0 / f, rel=1e-6)
        assert margins.gain_upper == math.inf
        assert margins.crossover == pytest.approx(crossover, rel=1e-6)
        assert margins.phase == pytest.approx(math.acos(1.0 / f), rel=1e-6)
        assert margins.delay == pytest.approx(math.acos(1.0 / f) / crossover, rel=1e-6)
        # A tiny delay uses that much of the margin, and its fast poles hide no slower one.
        late = control_systems.creep_loop(body, point, proportional_gain=f * gain, delay=delay)
        rest = control_systems.margins(late).delay
        assert rest + delay == pytest.approx(margins.delay, rel=1e-6)
        # |1 + L| is f - 1 at rest and rises or falls to 1.
        assert margins.sensitivity_peak == pytest.approx(max(1.0 / (f - 1.0), 1.0), rel=1e-4)


@pytest.mark.parametrize("name", ["rig", "locomotive"])
@pytest.mark.parametrize("sample_time", [None, 1e-3])
def test_a_loop_is_stable_from_the_gain_of_creep_control(
    name: str, sample_time: float | None, request: pytest.FixtureRequest
) -> None:
    body = request.getfixturevalue(name).wheelset
    point, pole, bound = falling(body)
    if sample_time is None:
        loop = control_systems.creep_loop(body, point, proportional_gain=2.0 * bound)
    else:
        loop = control_systems.sampled_loop(
            body, point, sample_time=sample_time, proportional_gain=2.0 * bound
        )
    margins = control_systems.margins(loop)
    assert 2.0 * margins.gain_lower == pytest.approx(1.0, rel=1e-6)
    if sample_time is None:
        assert margins.gain_upper == math.inf
    elif body.speed_held:  # z = exp(p h) - (K/K0)(exp(p h) - 1) passes -1
        late = 1.0 + 2.0 / math.expm1(pole * sample_time)
        assert 2.0 * margins.gain_upper == pytest.approx(late, rel=1e-6)
    growth = [
        control_systems.growth_rate(
            control_systems.closed_loop(factor * margins.gain_lower * loop).poles(), loop.dt
        )
        for factor in (0.3, 0.999, 1.001)
    ]
    assert growth[0] > growth[1] > 0.0 > growth[2]


@pytest.mark.parametrize("name", ["rig", pytest.param("locomotive", marks=pytest.mark.slow)])
def test_nyquist_counts_on_both_sides_of_every_bound(
    name: str, request: pytest.FixtureRequest
) -> None:
    body = request.getfixturevalue(name).wheelset
    point, _, bound = falling(body)
    given: dict[str, Any] = {"lag": 1e-3, "delay": 2e-3, "proportional_gain": 2.0 * bound}
    loops = [
        control_systems.creep_loop(body, point, proportional_gain=2.0 * bound),
        control_systems.creep_loop(body, point, integral_gain=20.0 * bound, **given),
        control_systems.sampled_loop(
            body, point, sample_time=1e-3, integral_gain=20.0 * bound, **given
        ),
    ]
    for loop, bounds in zip(loops, (1, 2, 2), strict=True):
        margins = control_systems.margins(loop)
        ends = [end for end in (margins.gain_lower, margins.gain_upper) if math.isfinite(end)]
        assert len(ends) == bounds
        for end in ends:
            sides = [factor * end * loop for factor in (0.98, 1.02)]
            assert (unstable(sides[0]) == 0) != (unstable(sides[1]) == 0)
            for side in sides:
                assert unstable_open(side) == 1  # P
                assert encirclements(side) == unstable(side) - 1  # N = Z - P


class BruteForce(NamedTuple):
    """Nyquist curve from the equations of motion, on a grid far beyond all poles.

    The delay is exact, and nothing is shared with the systems under test but the linearisation's
    slope of the creep force.
    """

    unstable_closed_loop_poles: int
    gain_lower: float
    gain_upper: float
    phase: float
    delay: float
    sensitivity_peak: float


def brute_force(
    body: cl.Wheelset,
    point: OperatingPoint,
    kp: float,
    ki: float,
    lag: float,
    delay: float,
) -> BruteForce:
    r, j, b, v = body.radius, body.inertia, body.damping, point.speed
    m = math.inf if body.mass is None else body.mass
    kappa, stretch = point.creep_force_slope / v, 1.0 + point.creepage
    matrix = np.array(
        [
            [-(b + r**2 * kappa) / j, r * kappa * stretch / j],
            [r * kappa / m, -(kappa * stretch + point.resistance_slope) / m],
        ]
    )

    def loop(s: Any) -> Any:
        rest = s - matrix[1, 1]
        both = (s - matrix[0, 0]) * rest - matrix[0, 1] * matrix[1, 0]
        plant = (r / v * rest - stretch / v * matrix[1, 0]) / (j * both)
        return (kp + ki / s) * np.exp(-s * delay) / (1.0 + lag * s) * plant

    omega = np.geomspace(1e-9, min(1e6, 300.0 / max(delay, 1e-9)), 60_000)
    arc = loop(omega[0] * np.exp(0.5j * math.pi * np.linspace(0.0, 1.0, 2000)))
    curve = loop(1j * omega)
    whole = 1.0 + np.append(arc, curve)
    turns = np.angle(whole[1:] / whole[:-1]).sum() / math.pi  # of the whole curve
    assert abs(turns - round(turns)) < 0.05

    def crossings(sign: Any, *values: Any) -> list[Any]:
        """Values where `sign` changes, each at the first point behind."""
        (at,) = np.nonzero(np.diff(np.sign(sign)))
        return [value[at + 1] for value in values]

    (real,) = crossings(whole.imag, whole.real - 1.0)
    if ki == 0.0:
        real = np.append(real, arc[0].real)
    gains = -1.0 / real[real < 0.0]
    at_one, frequency = crossings(np.log(np.abs(curve)), curve, omega)
    lags = np.mod(np.angle(-at_one), 2.0 * math.pi)
    return BruteForce(
        int((np.linalg.eigvals(matrix).real > 0.0).sum()) - round(turns),
        gains[gains < 1.0].max(initial=0.0),
        gains[gains > 1.0].min(initial=math.inf),
        lags.min(initial=math.inf),
        (lags / frequency).min(initial=math.inf),
        float((1.0 / np.abs(whole)).max()),
    )


def assert_margins(loop: Any, exact: BruteForce) -> None:
    margins = control_systems.margins(loop)
    for name in BruteForce._fields[1:]:
        assert getattr(margins, name) == pytest.approx(getattr(exact, name), rel=0.01), name


@pytest.mark.slow
@pytest.mark.parametrize("free", [True, False])
@examples(20)
@given(
    made=BODIES,
    speed=number(2.0, 40.0),
    beyond=number(1.0, 1.3),
    factor=number(0.5, 6.0),
    lag=st.just(0.0) | magnitude(1e-4, 2e-2),
    delay=st.just(0.0) | magnitude(1e-4, 2e-2),
    reset=st.just(0.0) | magnitude(0.05, 20.0),
)
def test_margins_gains_and_verdicts_are_those_of_a_brute_force_nyquist_curve(
    free: bool,
    made: dict[str, Any],
    speed: float,
    beyond: float,
    factor: float,
    lag: float,
    delay: float,
    reset: float,
) -> None:
    body = made_wheelset(**made | {"mass": made["mass"] if free else None})
    creepage = beyond * cl.worst_pole(body, speed=speed).creepage
    point = body.balanced(creepage=creepage, speed=speed)
    lowest = cl.creep_control_gain(body, point)
    assume(0.0 < lowest < math.inf and abs(factor - 1.0) > 0.01)  # undecided on the border
    kp = factor * lowest
    exact = brute_force(body, point, kp, reset * kp, lag, delay)
    assume(exact.sensitivity_peak < 100.0)
    loop = control_systems.creep_loop(
        body, point, proportional_gain=kp, integral_gain=reset * kp, lag=lag, delay=delay
    )
    held = exact.unstable_closed_loop_poles == 0
    assert (encirclements(loop) == -unstable_open(loop)) == held
    if not held:
        with pytest.raises(ValueError, match="not stable, so it has no margins"):
            control_systems.margins(loop)
        return
    assert_margins(loop, exact)


def test_margins_of_the_locomotive(locomotive: cl.Model) -> None:
    # rounding gives this loop a zero at 8e20 rad/s
    body = locomotive.wheelset
    point = body.balanced(creepage=0.024, speed=SPEED)
    lowest = cl.creep_control_gain(body, point)
    loop = control_systems.creep_loop(
        body, point, proportional_gain=2.0 * lowest, integral_gain=4.0 * lowest, delay=1e-3
    )
    assert_margins(loop, brute_force(body, point, 2.0 * lowest, 4.0 * lowest, 0.0, 1e-3))


def test_disk_margin_bounds_gain_and_phase(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, gain = falling(body)
    loop = control_systems.creep_loop(body, point, proportional_gain=1.8 * gain, delay=3e-3)
    margins = control_systems.margins(loop)
    assert 1.0 / margins.disk_gain > margins.gain_lower * (1.0 - 1e-3)
    assert margins.disk_gain < margins.gain_upper
    assert margins.disk_phase < margins.phase
    assert margins.sensitivity_peak > 1.0
    for factor in (0.99 * margins.disk_gain, 1.01 / margins.disk_gain):
        assert unstable(factor * loop) == 0


def test_pade_orders_converge_to_the_delay(rig: cl.Model) -> None:
    body = rig.wheelset
    point, pole, gain = falling(body)
    delay = 0.3 / pole
    # K exp(-j w tau) p/(j w - p) = -1: w = p tan(w tau), K/K0 = sqrt(1 + (w/p)^2)
    omega = brentq(lambda w: w - pole * math.tan(w * delay), 0.1 / delay, 1.57 / delay)
    exact = math.hypot(1.0, omega / pole)
    errors = []
    for order in (1, 2, 3):
        given: dict[str, Any] = {"delay": delay, "pade_order": order}
        loop = control_systems.creep_loop(body, point, proportional_gain=1.2 * gain, **given)
        errors.append(abs(1.2 * control_systems.margins(loop).gain_upper / exact - 1.0))
    assert errors[1] < 0.1 * errors[0]
    assert errors[2] < 0.03 * errors[1]
    final = control_systems.margins(
        control_systems.creep_loop(body, point, proportional_gain=1.2 * gain, delay=delay)
    )
    assert 1.2 * final.gain_upper == pytest.approx(exact, rel=1e-6)


def test_sampled_loop_against_a_sampled_simulation(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, bound = falling(body)
    h, wait, ki = 2e-3, 2, 5.0  # ki over kp [1/s]
    loop = control_systems.sampled_loop(
        body,
        point,
        sample_time=h,
        proportional_gain=1.0,
        integral_gain=ki,
        delay=wait * h,
    )
    margins = control_systems.margins(2.0 * bound * loop)
    low, high = 2.0 * bound * margins.gain_lower, 2.0 * bound * margins.gain_upper

    def growth(gain: float) -> float:
        omega, total, pending = point.omega * (1.0 + 1e-7), 0.0, [point.drive_torque] * wait
        sizes = []
        for _ in range(450):
            error = point.creepage - (body.radius * omega / SPEED - 1.0)
            total += ki * h * error
            pending.append(point.drive_torque + gain * (error + total))
            torque = pending.pop(0)
            for _ in range(4):  # Heun's method within a sample
                before, _ = body.rates(omega, SPEED, torque, point.axle_load, 1.0, 0.0)
                ahead = omega + 0.25 * h * before.omega_rate
                after, _ = body.rates(ahead, SPEED, torque, point.axle_load, 1.0, 0.0)
                omega += 0.125 * h * (before.omega_rate + after.omega_rate)
            sizes.append(abs(error))
        return max(sizes[-150:]) / max(sizes[150:300])

    assert growth(0.98 * high) < 1.0 < growth(1.02 * high)
    assert growth(1.05 * low) < 1.0 < growth(0.95 * low)


def test_fast_sampling_is_the_continuous_loop(rig: cl.Model) -> None:
    body = rig.wheelset
    point, _, gain = falling(body)
    given: dict[str, Any] = {
        "proportional_gain": 2.0 * gain,
        "integral_gain": 20.0 * gain,
        "lag": 2e-3,
        "delay": 2e-3,
    }
    frequency = np.array([10.0, 60.0, 200.0])
    exact = control_systems.creep_loop(body, point, **given)(1j * frequency)
    errors = []
    for h in (1e-3, 5e-4, 2.5e-4):
        loop = control_systems.sampled_loop(body, point, sample_time=h, **given)
        # The hold delays by half a sample.
        errors.append(np.abs(loop(np.exp(1j * frequency * h)) / exact - 1.0))
    order = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(order, 1.0, atol=0.1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"delay": 1.5e-3}, r"delay = 0\.0015 must be a whole number of samples"),
        ({"proportional_gain": 0.0}, r"proportional_gain = 0\.0 is out of range"),
        ({"integral_gain": -1.0}, r"integral_gain = -1\.0 is out of range"),
        ({"lag": -1.0}, r"lag = -1\.0 is out of range"),
        ({"sample_time": 0.0}, r"sample_time = 0\.0 is out of range"),
    ],
)
def test_bad_values_are_named(rig: cl.Model, changes: dict[str, float], message: str) -> None:
    point, _, gain = falling(rig.wheelset)
    given: dict[str, Any] = {"sample_time": 1e-3, "proportional_gain": gain, **changes}
    with pytest.raises(ValueError, match=message):
        control_systems.sampled_loop(rig.wheelset, point, **given)


@pytest.mark.parametrize("speed", [10.0, 1.0, 0.3])
@pytest.mark.parametrize("part", [0.2, 0.8])  # of the longest delay
def test_windows_with_memory_are_those_of_the_loops(
    locomotive: cl.Model, speed: float, part: float
) -> None:
    body = replace(with_memory(locomotive).wheelset, mass=None)
    creepage = cl.worst_pole(body, speed=speed).creepage
    point = body.balanced(creepage=creepage, speed=speed)
    plant = reduced_plant(body, creepage, speed=speed)
    assert len(plant.zeros) == len(plant.poles) == 1
    delay = part * delay_limit(plant.pole, plant.zeros, plant.poles)
    step = 0.25 * delay
    continuous = proportional_window(*plant, delay=delay)
    sampled = proportional_window(*plant, delay=delay, lag=step, sample_time=step)
    least = cl.stability.creep_control_gain(body, point)
    for window in (continuous, sampled):
        assert window.lowest == pytest.approx(least, rel=1e-6)
    given: dict[str, float] = {"delay": delay, "lag": step, "sample_time": step}

    def growths(gain: float) -> list[float]:
        held = control_systems.sampled_loop(body, point, proportional_gain=gain, **given)
        delayed = control_systems.creep_loop(
            body, point, proportional_gain=gain, delay=delay, pade_order=10
        )
        poles = (control_systems.closed_loop(loop).poles() for loop in (delayed, held))
        return [
            control_systems.growth_rate(next(poles)),
            control_systems.growth_rate(next(poles), step),
        ]

    for i, window in enumerate((continuous, sampled)):
        for edge, inwards in zip(window, (2e-4, -2e-4), strict=True):
            assert growths(edge * (1.0 + inwards))[i] < 0.0 or window.empty
            assert growths(edge * (1.0 - inwards))[i] > 0.0
    longer = proportional_window(*plant, delay=1.001 / part * delay)
    assert longer.empty
    assert not proportional_window(*plant, delay=0.999 / part * delay).empty
