"""Poles at given torque: closed forms against eigenvalues."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from falling_friction import with_falling
from hypothesis import assume, example, given
from hypothesis import strategies as st
from native_models import with_memory
from scipy.optimize import brentq, minimize_scalar
from strategies import examples, magnitude, number
from wheelsets import BODIES, made_wheelset

import contactlib as cl
from contactlib import stability
from contactlib.vehicle import CreepCurve, Resistance

V = 10.0  # [m/s]


@examples(40)
@given(
    body=BODIES,
    speed=magnitude(1.0, 60.0),
    scale=number(0.3, 1.0),
    held=st.booleans(),
    damped=st.booleans(),
    residual=st.sampled_from([1.0, 0.4, 0.0]),
)
@example(  # two complex eigenvalues cross zero together
    body={
        "k_hat": 0.5,
        "radius": 0.5,
        "load": 4e4,
        "kinetic": 0.375,
        "slope": 1.0,
        "inertia": np.exp(4.0),
        "mass": np.exp(8.0),
        "damping": 1.0,
        "resistance": Resistance(linear=np.exp(3.0)),
    },
    speed=1.0,
    scale=1.0,
    held=False,
    damped=True,
    residual=0.4,
)
def test_the_eigenvalue_of_an_element_crosses_zero_at_the_threshold(
    body: dict[str, Any], speed: float, scale: float, held: bool, damped: bool, residual: float
) -> None:
    body = body | ({"mass": None} if held else {}) | ({} if damped else {"damping": 0.0})
    wheelset = with_falling(made_wheelset(**body), residual, 0.6)
    at: dict[str, Any] = {"speed": speed, "friction_scale": scale}

    def margin(creepage: float) -> float:
        point = wheelset.balanced(creepage=creepage, **at)
        return point.creep_force_slope - cl.stability.slope_threshold(wheelset, point)

    worst = cl.worst_pole(wheelset, **at)
    assume(worst.pole > 1e-3)  # else damping outweighs the fall
    peak = cl.find_fold(replace(wheelset, damping=0.0, mass=None), **at).creepage
    creepage = brentq(margin, 0.9 * peak, worst.creepage, xtol=1e-18, rtol=1e-15)
    point = wheelset.balanced(creepage=creepage, **at)
    threshold = cl.stability.slope_threshold(wheelset, point)

    def leading(zeta: float) -> float:
        return float(stability.poles(wheelset, zeta, **at)[..., 0].real)

    crossing = brentq(leading, 0.9 * peak, worst.creepage, xtol=1e-18, rtol=1e-15)
    slope = wheelset.balanced(creepage=crossing, **at).creep_force_slope
    # The floor is what rounding does to a slope that was so much larger at the start.
    initial = wheelset.balanced(creepage=0.0, **at).creep_force_slope
    assert slope == pytest.approx(threshold, rel=1e-9, abs=4e-12 * initial)


@examples(40)
@given(body=BODIES, speed=magnitude(1.0, 60.0), x=number(-3.0, 5.0), held=st.booleans())
def test_poles_are_the_eigenvalues_of_the_jacobian(
    body: dict[str, Any], speed: float, x: float, held: bool
) -> None:
    wheelset = made_wheelset(**(body | {"mass": None} if held else body))
    creepage = x * wheelset.element.saturation_creepage
    point = wheelset.balanced(creepage=creepage, speed=speed)
    poles = stability.poles(wheelset, creepage, speed=speed)
    for residual in (1.0, 0.4, 0.0):
        falls = with_falling(wheelset, residual, 0.6)
        matrix = falls.linearize(falls.balanced(creepage=creepage, speed=speed)).A
        of_matrix = np.linalg.eigvals(matrix)
        apart = np.subtract.outer(stability.poles(falls, creepage, speed=speed), of_matrix)
        assert (np.abs(apart).min(axis=-1) < 1e-9 * np.abs(of_matrix).max()).all()
    size = np.abs(point.eigenvalues).max()
    np.testing.assert_allclose(poles, point.eigenvalues, rtol=1e-9, atol=1e-12 * size)
    fast = cl.stability.fast_pole(wheelset, creepage, speed=speed)
    about = stability.approximate_pole(
        radius=wheelset.radius,
        inertia=wheelset.inertia,
        creep_force_slope=point.creep_force_slope,
        speed=speed,
    )
    # What damping, resistance and a mass that is not endless add to the closed form
    added = wheelset.damping / wheelset.inertia
    if wheelset.mass is not None:
        ratio = wheelset.inertia * (1.0 + creepage) / (wheelset.mass * wheelset.radius**2)
        added += 1.01 * ratio * abs(float(about)) + 2.0 * point.resistance_slope / wheelset.mass
    assert abs(fast - about) <= 1.01 * added + 1e-9 * size


def test_poles_broadcast(locomotive: cl.Model) -> None:
    creepage, speed = np.array([[0.005], [0.02], [0.03]]), np.array([2.0, 10.0, 40.0, 80.0])
    poles = cl.stability.fast_pole(locomotive.wheelset, creepage, speed=speed)
    assert poles.shape == (3, 4)
    assert (poles[0] < 0.0).all()
    assert (poles[1:] > 0.0).all()
    pole = cl.stability.fast_pole(locomotive.wheelset, 0.02, speed=40.0)
    assert pole.shape == ()
    assert pole == poles[1, 2]
    # Nearly inversely proportional to the speed
    np.testing.assert_allclose(poles[1] * speed, poles[1, 0] * speed[0], rtol=0.03)
    with pytest.raises(ValueError, match="speed"):
        stability.poles(locomotive.wheelset, 0.01, speed=[1.0, 0.01])


@pytest.mark.parametrize(("slope_reduction", "pole"), [(0.14, 70.0), (1.0, 500.0)])
def test_worst_pole(rig: cl.Model, slope_reduction: float, pole: float) -> None:
    element = replace(rig.wheelset.element, slope_reduction=slope_reduction)
    body = replace(rig.wheelset, element=element, damping=0.0)
    law = cl.CarterGriffith(k_hat=element.k_hat)
    steepest = minimize_scalar(lambda x: float(law.slope(x)), bounds=(1.2, 2.0))
    zeta0 = element.saturation_creepage
    fall = steepest.fun * 0.21 * element.axle_load / zeta0
    expected = stability.approximate_pole(
        radius=0.5, inertia=250.0, creep_force_slope=fall, speed=V
    )
    worst = cl.worst_pole(body, speed=V)
    assert worst.pole == pytest.approx(float(expected), rel=1e-6)
    assert worst.creepage == pytest.approx(zeta0 * steepest.x, rel=1e-3)
    assert worst.pole == pytest.approx(pole, rel=0.01)


def test_worst_pole_of_friction_that_never_falls_is_the_creepage_s(locomotive: cl.Model) -> None:
    element = locomotive.wheelset.element
    coulomb = cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0)
    body = replace(locomotive.wheelset, element=replace(element, friction=coulomb))
    worst = cl.worst_pole(body, speed=V)
    zeta = element.saturation_creepage * np.geomspace(1e-2, 1e5, 2001)
    # The table's slope is certified to 1e-8, which the search may find on the flat part.
    flat = 1e-8 * abs(float(cl.stability.fast_pole(body, 0.0, speed=V)))
    assert worst.pole == pytest.approx(cl.stability.fast_pole(body, zeta, speed=V).max(), abs=flat)
    assert worst.pole == pytest.approx(-body.damping / body.inertia, abs=flat)  # it slides
    assert worst.pole == pytest.approx(float(cl.stability.fast_pole(body, worst.creepage, speed=V)))


def test_pole_of_a_held_speed_is_that_of_the_curve(rig: cl.Model) -> None:
    creepage = np.array([0.004, 0.016, 0.02, 0.04])
    held = cl.stability.fast_pole(rig.wheelset, creepage, speed=V)
    np.testing.assert_allclose(
        cl.s_curve(rig.wheelset, speed=V, creepage=creepage).pole, held, rtol=1e-12
    )


@pytest.mark.parametrize(("damping", "residual"), [(0.0, 1.0), (400.0, 0.4)])
def test_the_threshold_of_a_free_wheelset_that_nothing_resists(
    rig: cl.Model, damping: float, residual: float
) -> None:
    body = replace(
        with_falling(rig.wheelset, residual, 0.6),
        damping=damping,
        mass=22.5e3,
        resistance=Resistance(),
    )
    peak = cl.find_fold(replace(body, damping=0.0, mass=None), speed=8.0).creepage

    def margin(creepage: float) -> float:
        point = body.balanced(creepage=creepage, speed=8.0)
        return point.creep_force_slope - cl.stability.slope_threshold(body, point)

    predicted = brentq(margin, 0.9 * peak, 1.25 * peak, xtol=1e-15)
    below, above = (
        body.balanced(creepage=predicted * (1.0 + side * 1e-6), speed=8.0) for side in (-1, 1)
    )
    assert not above.stable
    assert above.eigenvalues[0].imag == 0.0  # a saddle, no oscillation
    if damping > 0.0:
        assert below.stable
    else:  # nothing meets a common acceleration: one eigenvalue stays zero
        assert below.eigenvalues == pytest.approx([0.0, below.jacobian.trace()], abs=1e-9)
        assert below.jacobian.trace() < 0.0 < above.jacobian.trace()


def test_threshold_without_damping_is_the_peak(rig: cl.Model) -> None:
    body = replace(rig.wheelset, damping=0.0)
    point = body.balanced(creepage=0.02, speed=10.0)
    assert cl.stability.slope_threshold(body, point) == 0.0
    assert not point.stable
    # Fast pole r^2 |Q'|/(J V)
    pole = 0.25 * -point.creep_force_slope / (250.0 * 10.0)
    assert point.eigenvalues[0] == pytest.approx(pole, rel=1e-12)


@pytest.mark.parametrize("speed", [10.0, 1.0, 0.3])
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("layer", [0.0, 2e-14])
def test_poles_with_memory_are_the_growth_of_a_simulation(
    locomotive: cl.Model, layer: float, held: bool, speed: float
) -> None:
    body = with_memory(locomotive).wheelset
    element = replace(body.element, layer_compliance=layer)
    body = replace(body, element=element, mass=None if held else body.mass)
    worst = cl.worst_pole(body, speed=speed)
    at: dict[str, Any] = {"creepage": worst.creepage, "speed": speed}
    point = body.balanced(**at)
    assert worst.pole == pytest.approx(body.linearize(point).poles().real.max(), rel=1e-9)
    assert worst.pole == pytest.approx(float(stability.fast_pole(body, **at)), rel=1e-9)
    frozen = CreepCurve(body, speed=speed).pole(worst.creepage)
    assert float(frozen) == pytest.approx(worst.pole, rel=1e-12 if held else 1e-4)
    steady = cl.worst_pole(body.without_memory(), speed=speed).pole
    assert worst.pole < (1.0 if layer or speed == 10.0 else 0.93) * steady

    assert growth(body, worst.creepage, speed) == pytest.approx(worst.pole, rel=1e-3)


def growth(body: cl.Wheelset, creepage: float, speed: float) -> float:
    """Growth of a slip-away that begins 1e-8 beyond a point of steady rolling [1/s]."""
    point = body.balanced(creepage=creepage, speed=speed)
    pole = float(stability.fast_pole(body, creepage, speed=speed))
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(point.drive_torque)),
        resistance_force=point.resistance_force,
        initial_speed=speed,
        initial_creepage=creepage * (1.0 + 1e-8),
        duration=8.0 / pole,
        tolerance=1e-12,
    )
    late = run.time > 5.0 / pole
    away = np.abs(run["omega"] - point.omega)
    return float(np.polyfit(run.time[late], np.log(away[late]), 1)[0])


@pytest.mark.parametrize("speed", [10.0, 1.0, 0.3])
def test_a_slip_away_that_still_sticks_grows_with_its_unslipped_part(
    rig: cl.Model, speed: float
) -> None:
    """Where friction falls with slip speed too, part of the contact sticks as the force falls."""
    body = with_falling(with_memory(rig).wheelset, 0.4, 30.0 / speed)
    creepage = 1.05 * cl.find_fold(body.without_memory(), speed=speed).creepage
    given = {"speed": speed, "axle_load": body.element.axle_load}
    frozen = np.linalg.eigvals(body.jacobians(creepage, **given)[:2, :2]).real.max()
    pole = float(stability.fast_pole(body, creepage, speed=speed))
    assert growth(body, creepage, speed) == pytest.approx(pole, rel=1e-3)
    assert frozen < 0.7 * pole


@pytest.mark.parametrize("part", [0.5, 1.05])  # of the peak's creepage
def test_the_jacobian_of_memory_is_that_towards_larger_creepage(rig: cl.Model, part: float) -> None:
    body, speed = with_falling(with_memory(rig).wheelset, 0.4, 30.0), 1.0
    native, load = body.element.rolling_native, body.element.axle_load
    creepage = part * cl.find_fold(body.without_memory(), speed=speed).creepage
    omega = (1.0 + creepage) * speed / body.radius
    steady = native.evaluate_one(omega, speed, load, 1.0)
    falls = steady.falling_branch > 0.0
    assert falls == (part > 1.0)
    assert 0.0 < steady.sticking < 1.0
    size = np.array([omega, steady.steady_force, 1.0])
    at = np.array([omega, steady.steady_force, steady.sticking])
    at += 1e-6 * np.array([0.0, steady.steady_force, 1.0 if falls else -1.0])

    def rates(x: np.ndarray) -> np.ndarray:
        found = native.evaluate_one(x[0], speed, load, 1.0, x[1], x[2], steady.steady_outer)
        slowed = -(body.radius * found.creep_force + body.damping * x[0]) / body.inertia
        return np.array([slowed, found.held_rate, found.unslipped_rate])

    steps = 1e-8 * np.diag(size)
    columns = [
        (rates(at + h) - rates(at - h)) / (2e-8 * s) for h, s in zip(steps, size, strict=True)
    ]
    jacobian = body.jacobians(creepage, speed=speed, axle_load=load)
    scale = np.abs(jacobian) @ size
    np.testing.assert_allclose(
        np.array(columns).T * size / scale[:, np.newaxis],
        jacobian * size / scale[:, np.newaxis],
        atol=1e-4,
    )


def test_poles_with_memory_become_those_of_steady_rolling(rig: cl.Model) -> None:
    body, creepage = with_memory(rig).wheelset, np.array([0.018, 0.022])
    missing = []
    for speed in (20.0, 80.0):
        found, steady = (
            stability.fast_pole(b, creepage, speed=speed) for b in (body, rig.wheelset)
        )
        missing.append(np.abs(found / steady - 1.0))
    np.testing.assert_allclose(missing[0] / missing[1], 16.0, rtol=0.02)
    assert (missing[1] < 1e-3).all()


def test_the_falling_branch_begins_at_the_same_creepage_with_memory(rig: cl.Model) -> None:
    """Where an eigenvalue is zero, nothing changes, and the contact rolls steadily."""
    body = with_memory(rig).wheelset
    pole = CreepCurve(rig.wheelset, speed=0.5).pole
    peak = brentq(lambda creepage: float(pole(creepage)), 0.012, 0.03, xtol=1e-14)
    near = peak + 1e-7 * np.array([-1.0, 1.0])
    assert CreepCurve(body, speed=0.5).states(near).stable.tolist() == [True, False]
    assert np.sign(stability.fast_pole(body, near, speed=0.5)).tolist() == [-1.0, 1.0]
    assert (stability.fast_pole(body, [0.0, 1e-9, 1e-4], speed=0.5) < -20.0).all()


STEADY_ONLY: dict[str, dict[str, float]] = {
    "basin": {"speed": 1.0, "drive_torque": 26e3},
    "separatrix": {"speed": 1.0, "drive_torque": 26e3},
    "slip_away_estimate": {"speed": 1.0, "drive_torque": 28e3, "end": 0.5},
    "slip_away_time": {"speed": 1.0, "drive_torque": 28e3, "start": 0.0, "end": 0.5},
}
WITH_MEMORY = {  # exactly, or of points of steady rolling
    "clearing",
    "creep_control_gain",
    "fast_pole",
    "find_fold",
    "poles",
    "quasi_steady_torque",
    "reduced_frequency",
    "reduced_plant",
    "s_curve",
    "slope_threshold",
    "steady_states",
    "worst_pole",
}


def test_each_analysis_contains_memory_or_warns(rig: cl.Model) -> None:
    taking = {
        name
        for name in stability.__all__
        if "wheelset" in getattr(getattr(stability, name), "__annotations__", {})
    }
    assert taking == WITH_MEMORY | STEADY_ONLY.keys()
    body = with_memory(rig).wheelset
    for name, arguments in STEADY_ONLY.items():
        function = getattr(stability, name)
        with pytest.warns(stability.SteadyRollingWarning, match=f"{name} .*p a/V = ") as caught:
            analysed = function(body, **arguments)
        assert len(caught) == 1
        assert caught[0].filename == __file__
        assert analysed == function(rig.wheelset, **arguments)


def test_reduced_frequency_is_the_rate_over_that_of_rolling_a_semi_width(
    locomotive: cl.Model,
) -> None:
    body, a = locomotive.wheelset, locomotive.wheelset.element.contact.semi_width
    frequencies = stability.reduced_frequency(body, [30.0, -60.0], speed=15.0)
    assert frequencies == pytest.approx([2.0 * a, 4.0 * a])
    heavy = 8.0 * body.element.axle_load  # whose ellipse is twice as long
    assert stability.reduced_frequency(body, 60.0, speed=15.0, axle_load=heavy) == (
        pytest.approx(8.0 * a)
    )
