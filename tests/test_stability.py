"""Where torque control loses a wheelset, how fast, and from where it comes back.

Closed forms and quadratures against eigenvalues and against runs of the equations of motion.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

import contactlib as cl
from contactlib import stability

QUICK = settings(derandomize=True, deadline=None, max_examples=40)
TABLE = cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")
V = 10.0  # [m/s]


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_subnormal=False)


def magnitude(low: float, high: float) -> st.SearchStrategy[float]:
    return number(math.log(low), math.log(high)).map(math.exp)


def variant(wheelset: cl.Wheelset, **changes: Any) -> cl.Wheelset:
    return dataclasses.replace(wheelset, **changes)


def made_wheelset(
    k_hat: float, radius: float, load: float, kinetic: float, slope: float, **body: Any
) -> cl.Wheelset:
    """A wheelset with a line contact whose friction does not fall with slip speed."""
    contact = cl.LineContact.from_semi_width(
        semi_width=5e-3, radius=radius, contact_modulus=115.4e9, normal_load=load
    )
    static = 4.0 * kinetic  # far above, so that the process zone stays short
    friction = cl.friction_with_k_hat(contact, k_hat=k_hat, static=static, kinetic=kinetic)
    element = cl.ForceElement(contact, friction, table=TABLE, radius=radius, slope_reduction=slope)
    return cl.Wheelset(element, **body)


BODIES = st.fixed_dictionaries(
    {
        "k_hat": number(0.1, 0.8),
        "radius": number(0.3, 0.7),
        "load": number(4e4, 3e5),
        "kinetic": number(0.05, 0.4),
        "slope": number(0.1, 1.0),
        "inertia": magnitude(30.0, 1000.0),
        "mass": magnitude(2e3, 2e5),
        "damping": magnitude(1.0, 500.0),
        "resistance": st.builds(
            cl.Resistance,
            constant=number(0.0, 2000.0),
            linear=magnitude(10.0, 2000.0),
            quadratic=number(0.0, 10.0),
        ),
    }
)


# ---- threshold ------------------------------------------------------------------------------


@QUICK
@given(
    r=number(0.3, 0.7),
    j=magnitude(30.0, 1000.0),
    m=magnitude(1e3, 3e5),
    b=magnitude(1.0, 500.0),
    growth=magnitude(10.0, 3000.0),
    speed=magnitude(0.5, 100.0),
    zeta=number(-0.5, 3.0),
)
def test_eigenvalues_cross_zero_at_the_threshold(
    r: float, j: float, m: float, b: float, growth: float, speed: float, zeta: float
) -> None:
    threshold = -speed / (r**2 / b + (1.0 + zeta) / growth)

    def eigenvalues(slope: float) -> np.ndarray:
        kappa, stretch = slope / speed, 1.0 + zeta
        matrix = [
            [-(b + r**2 * kappa) / j, r * kappa * stretch / j],
            [r * kappa / m, -(kappa * stretch + growth) / m],
        ]
        return np.linalg.eigvals(np.array(matrix)).astype(complex)

    for factor, stable in ((1.0 - 1e-9, True), (1.0 + 1e-9, False)):
        found = eigenvalues(factor * threshold)
        assert not found.imag.any()  # a saddle, never a pair of complex ones
        found = found.real
        assert found.sum() < 0.0
        assert (found.max() < 0.0) == stable
        assert (found.prod() > 0.0) == stable


@QUICK
@given(body=BODIES, speed=magnitude(1.0, 60.0), scale=number(0.3, 1.0), held=st.booleans())
def test_the_eigenvalue_of_an_element_crosses_zero_at_the_threshold(
    body: dict[str, Any], speed: float, scale: float, held: bool
) -> None:
    wheelset = made_wheelset(**(body | {"mass": None} if held else body))
    at: dict[str, Any] = {"speed": speed, "friction_scale": scale}

    def margin(creepage: float) -> float:
        point = wheelset.balanced(creepage=creepage, **at)
        return point.creep_force_slope - cl.slope_threshold(wheelset, point)

    worst = cl.worst_pole(wheelset, **at)
    assume(worst.pole > 1e-3)  # else damping outweighs the fall
    peak = cl.find_fold(variant(wheelset, damping=0.0, mass=None), **at).creepage
    creepage = brentq(margin, 0.9 * peak, worst.creepage, xtol=1e-18, rtol=1e-15)
    point = wheelset.balanced(creepage=creepage, **at)
    threshold = cl.slope_threshold(wheelset, point)

    def leading(zeta: float) -> float:
        return float(stability.poles(wheelset, zeta, **at)[..., 0].real)

    crossing = brentq(leading, 0.9 * peak, worst.creepage, xtol=1e-18, rtol=1e-15)
    slope = wheelset.balanced(creepage=crossing, **at).creep_force_slope
    # The floor is what rounding does to a slope that was so much larger at the start.
    initial = wheelset.balanced(creepage=0.0, **at).creep_force_slope
    assert slope == pytest.approx(threshold, rel=1e-9, abs=1e-12 * initial)
    found = stability.poles(wheelset, creepage, **at)
    assert (found.imag == 0.0).all()
    assert found.real.sum() < 0.0 or held


@QUICK
@given(body=BODIES, speed=magnitude(1.0, 60.0), x=number(-3.0, 5.0), held=st.booleans())
def test_poles_are_the_eigenvalues_of_the_jacobian(
    body: dict[str, Any], speed: float, x: float, held: bool
) -> None:
    wheelset = made_wheelset(**(body | {"mass": None} if held else body))
    creepage = x * wheelset.element.saturation_creepage
    point = wheelset.balanced(creepage=creepage, speed=speed)
    found = stability.poles(wheelset, creepage, speed=speed)
    size = np.abs(point.eigenvalues).max()
    np.testing.assert_allclose(found, point.eigenvalues, rtol=1e-9, atol=1e-12 * size)
    fast = cl.fast_pole(wheelset, creepage, speed=speed)
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
    found = cl.fast_pole(locomotive.wheelset, creepage, speed=speed)
    assert found.shape == (3, 4)
    assert (found[0] < 0.0).all()
    assert (found[1:] > 0.0).all()
    one = cl.fast_pole(locomotive.wheelset, 0.02, speed=40.0)
    assert one.shape == ()
    assert one == found[1, 2]
    # Nearly inversely proportional to the speed
    np.testing.assert_allclose(found[1] * speed, found[1, 0] * speed[0], rtol=0.03)
    with pytest.raises(ValueError, match="speed"):
        stability.poles(locomotive.wheelset, 0.01, speed=[1.0, 0.01])


@pytest.mark.parametrize(("slope_reduction", "pole"), [(0.14, 70.0), (1.0, 500.0)])
def test_worst_pole(rig: cl.Model, slope_reduction: float, pole: float) -> None:
    element = dataclasses.replace(rig.wheelset.element, slope_reduction=slope_reduction)
    body = variant(rig.wheelset, element=element, damping=0.0)
    law = cl.CarterGriffith(k_hat=element.k_hat)
    steepest = minimize_scalar(lambda x: float(law.slope(x)), bounds=(1.2, 2.0))
    zeta0 = element.saturation_creepage
    fall = steepest.fun * 0.21 * element.contact.normal_load / zeta0
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
    body = variant(locomotive.wheelset, element=dataclasses.replace(element, friction=coulomb))
    worst = cl.worst_pole(body, speed=V)
    zeta = element.saturation_creepage * np.geomspace(1e-2, 1e5, 2001)
    assert worst.pole == pytest.approx(cl.fast_pole(body, zeta, speed=V).max(), rel=1e-6)
    assert worst.pole == pytest.approx(-body.damping / body.inertia, rel=1e-6)  # it slides
    assert worst.pole == pytest.approx(float(cl.fast_pole(body, worst.creepage, speed=V)))


def test_creepage_pole_is_the_frozen_rate(rig: cl.Model, locomotive: cl.Model) -> None:
    creepage = np.array([0.004, 0.016, 0.02, 0.04])
    held = cl.fast_pole(rig.wheelset, creepage, speed=V)
    np.testing.assert_allclose(
        cl.s_curve(rig.wheelset, speed=V, creepage=creepage).pole, held, rtol=1e-12
    )
    curve = cl.s_curve(locomotive.wheelset, speed=V, creepage=creepage)
    step = 1e-6
    ends = [
        cl.quasi_steady_torque(locomotive.wheelset, creepage + side * step, speed=V)
        for side in (-1.0, 1.0)
    ]
    slope = (ends[1] - ends[0]) / (2.0 * step)
    np.testing.assert_allclose(curve.pole, -0.5 * slope / (250.0 * V), rtol=1e-6, atol=1e-4)


# ---- S-curve --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rig", "locomotive"])
def test_s_curve_changes_stability_at_fold_and_return(
    name: str, request: pytest.FixtureRequest
) -> None:
    body = request.getfixturevalue(name).wheelset
    curve = cl.s_curve(body, speed=V)
    fold = cl.find_fold(body, speed=V)
    assert curve.fold == fold
    falls = (curve.creepage > fold.creepage) & (curve.creepage < fold.return_creepage)
    rises = (curve.creepage < fold.creepage) | (curve.creepage > fold.return_creepage)
    assert not curve.stable[falls].any()
    assert curve.stable[rises].all()
    assert fold.creepage in curve.creepage
    assert fold.return_creepage in curve.creepage
    assert curve.creepage[0] == 0.0
    assert curve.drive_torque[-1] > fold.drive_torque  # the run-away branch, followed to the end
    assert (np.diff(curve.creepage) > 0.0).all()


def test_s_curve_of_braking_is_the_mirror_image_without_damping(rig: cl.Model) -> None:
    body = variant(rig.wheelset, damping=0.0)
    curve, ahead = (cl.s_curve(body, speed=V, braking=side) for side in (True, False))
    assert curve.creepage[0] == -1.0  # locked
    count = int((ahead.creepage < 1.0).sum())
    np.testing.assert_allclose(curve.creepage[1 : count + 1], -ahead.creepage[count - 1 :: -1])
    for name in ("creepage", "drive_torque"):
        behind = -getattr(curve, name)[count::-1][:count]
        np.testing.assert_allclose(behind, getattr(ahead, name)[:count], rtol=1e-12, atol=1e-9)
    assert (curve.stable[count::-1][:count] == ahead.stable[:count]).all()


def test_s_curve_without_weakening_has_no_fold(rig: cl.Model) -> None:
    body = made_wheelset(0.0, 0.5, 2e5, 0.2, 0.14, inertia=250.0, damping=10.0)
    curve = cl.s_curve(body, speed=V)
    assert curve.fold is None
    assert curve.stable.all()
    with pytest.raises(ValueError, match="friction_scale"):
        cl.s_curve(body, speed=V, friction_scale=-1.0)


@pytest.mark.parametrize("part", [0.6, 0.93, 0.99, 1.0 - 1e-6, 1.0 - 1e-11, 1.1])
def test_steady_states_are_the_equilibria_of_a_held_speed(rig: cl.Model, part: float) -> None:
    torque = part * cl.find_fold(rig.wheelset, speed=V).drive_torque
    states = cl.steady_states(rig.wheelset, drive_torque=torque, speed=V)
    points = rig.wheelset.equilibria(drive_torque=torque, speed=V)
    # Near the fold what rounds the torque moves the creepage by more.
    near = max(1e-9, 1e-14 / math.sqrt(abs(1.0 - part)))
    assert [p.creepage for p in points] == pytest.approx(states.creepage.tolist(), rel=near)
    assert len(points) == (3 if part > 0.9 and part < 1.0 else 1)
    assert [p.stable for p in points] == states.stable.tolist()
    assert [p.eigenvalues[0] for p in points] == pytest.approx(states.pole.tolist(), rel=1e-5)
    np.testing.assert_allclose(states.drive_torque, torque, rtol=1e-9)


def test_steady_states_of_an_accelerating_train(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    torque = 0.95 * cl.find_fold(body, speed=V).drive_torque
    states = cl.steady_states(body, drive_torque=torque, speed=V)
    ahead = states.creepage > 0.0
    assert states.stable[ahead].tolist() == [True, False, True]
    for creepage in states.creepage[ahead][:2]:
        omega = (1.0 + creepage) * V / body.radius
        rates, _ = body.rates(omega, V, torque, 220.65e3, 1.0, 0.0)
        assert rates.speed_rate > 0.0
        # zeta = r omega/V - 1 does not change
        change = body.radius * (rates.omega_rate / V - omega * rates.speed_rate / V**2)
        assert abs(change) < 1e-9


# ---- basin ----------------------------------------------------------------------------------


def slips_away(body: cl.Wheelset, torque: float, creepage: float, speed: float = V) -> bool:
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(torque)),
        initial_speed=speed,
        initial_creepage=creepage,
        duration=3.0,
        output_interval=1.0,
        stop_at=["slip_away"],
    )
    away = run.first("slip_away") is not None
    assert away or abs(run["creepage"][-1]) < 0.017  # either beyond, or back at grip
    return away


PATCHES = [0.3, 0.6, 0.85]  # their friction over that before them
MASSES = [None, 142.5e3, 22.5e3, 8e3]  # held, with a train, alone, a light one


def of_mass(locomotive: cl.Model, mass: float | None) -> cl.Wheelset:
    return variant(locomotive.wheelset, mass=mass)


@pytest.mark.parametrize("mass", MASSES)
@pytest.mark.parametrize("part", [0.92, 0.98])
def test_the_basin_ends_where_it_says(
    locomotive: cl.Model, mass: float | None, part: float
) -> None:
    body = of_mass(locomotive, mass)
    for sign in (1.0, -1.0):
        # Braking slows the vehicle, which turns the wheelset back too: a little less torque.
        torque = (
            sign * part * cl.find_fold(body, speed=V).drive_torque * (1.0 if sign > 0 else 0.97)
        )
        found = cl.basin(body, drive_torque=torque, speed=V)
        border, other = found.highest, found.lowest
        if sign < 0.0:
            border, other = other, border
        assert math.isinf(other)
        assert abs(border) > abs(found.creepage)
        assert not slips_away(body, torque, (1.0 - 1e-3) * border)
        assert slips_away(body, torque, (1.0 + 1e-3) * border)
        line = cl.separatrix(body, drive_torque=torque, speed=[V])
        assert line.tolist() == [border]


def test_the_separatrix_of_a_light_vehicle_is_not_the_unstable_branch(
    locomotive: cl.Model,
) -> None:
    body = of_mass(locomotive, 8e3)
    fold = cl.find_fold(body, speed=V)
    torque = 0.995 * fold.drive_torque
    states = cl.steady_states(body, drive_torque=torque, speed=V)
    frozen = float(states.creepage[~states.stable & (states.creepage > 0.0)][0])
    border = cl.basin(body, drive_torque=torque, speed=V).highest
    apart = abs(border / frozen - 1.0)
    assert apart > 3e-5
    assert not slips_away(body, torque, (1.0 - 0.2 * apart) * border)
    assert slips_away(body, torque, (1.0 + 0.2 * apart) * border)


def test_the_separatrix_is_a_motion(locomotive: cl.Model) -> None:
    # Three points of it: the equations of motion lead from the first along the others.
    body = of_mass(locomotive, 22.5e3)
    torque = 0.97 * cl.find_fold(body, speed=V).drive_torque
    speeds = np.array([10.0, 10.1, 10.2])
    line = cl.separatrix(body, drive_torque=torque, speed=speeds)
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(torque)),
        initial_speed=10.0,
        initial_creepage=float(line[0]),
        duration=0.11,
        output_interval=1e-3,
        tolerance=1e-12,
    )
    assert run["speed"][-1] > speeds[-1]
    along = np.interp(speeds, run["speed"], run["creepage"])
    # What is left of the trace's error grows by exp(p t), 1e3 here.
    np.testing.assert_allclose(line, along, rtol=1e-4)
    assert line[2] != pytest.approx(line[0], rel=1e-4)


def test_a_saddle_lies_on_its_separatrix(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    point = next(
        p for p in body.equilibria(drive_torque=25.5e3) if 0.0 < p.creepage < 1.0 and not p.stable
    )
    assert (point.eigenvalues < 0.0).tolist() == [False, True]
    values, vectors = np.linalg.eig(point.jacobian)
    omega, speed = vectors[:, values.argmin()]
    for side in (-0.5, 0.5):  # its stable manifold leaves along the eigenvector
        at = point.speed + side
        border = cl.basin(body, drive_torque=25.5e3, speed=at).highest
        tangent = point.omega + side * omega / speed
        assert border == pytest.approx(body.radius * tangent / at - 1.0, rel=2e-3)
        assert border != pytest.approx(point.creepage, rel=1e-5)
    there = cl.basin(body, drive_torque=25.5e3, speed=point.speed).highest
    assert there == pytest.approx(point.creepage, rel=1e-8)


def test_no_border_and_no_grip(rig: cl.Model) -> None:
    fold = cl.find_fold(rig.wheelset, speed=V)
    low = cl.basin(rig.wheelset, drive_torque=0.999 * fold.return_torque, speed=V)
    assert (low.lowest, low.highest) == (-math.inf, math.inf)
    assert not slips_away(variant(rig.wheelset), 0.9 * fold.return_torque, 0.1)
    with pytest.raises(ValueError, match="no creepage holds it by grip"):
        cl.basin(rig.wheelset, drive_torque=1.001 * fold.drive_torque, speed=V)


def test_a_branch_that_is_lost_too_soon_has_no_border(locomotive: cl.Model) -> None:
    # So light a vehicle is soon so fast that friction that falls with slip speed no longer grips.
    element = locomotive.wheelset.element
    friction = dataclasses.replace(element.friction, slip_rate_residual=0.4, slip_rate_decay=0.6)
    light = variant(
        locomotive.wheelset, mass=200.0, element=dataclasses.replace(element, friction=friction)
    )
    torque = 0.7 * cl.find_fold(light, speed=5.0).drive_torque
    border = cl.basin(light, drive_torque=torque, speed=5.0).highest
    for part, comes_back in ((0.999, True), (1.001, False)):
        run = cl.simulate(
            light,
            cl.TorqueControl(cl.Profile.of(torque)),
            initial_speed=5.0,
            initial_creepage=part * border,
            duration=0.1,
        )
        assert (run["creepage"][-1] < 0.01) == comes_back
    with pytest.raises(ValueError, match=r"speed = 40.0, .* is lost before .* takes >= 8"):
        cl.basin(light, drive_torque=torque, speed=40.0)


# ---- slip-away ------------------------------------------------------------------------------


def simulated_time(body: cl.Wheelset, torque: float, start: float, end: float) -> float:
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(torque)),
        initial_speed=V,
        initial_creepage=start,
        duration=100.0,
        output_interval=100.0,
        slip_away_creepage=end,
        stop_at=["slip_away"],
    )
    event = run.first("slip_away")
    assert event is not None
    return event.time


@pytest.mark.parametrize("damping", [0.0, 50.0])
@pytest.mark.parametrize("overload", [1e-4, 1e-2, 0.3])
@pytest.mark.parametrize("end", [0.15, 1.0])
def test_slip_away_time_of_a_held_speed(
    rig: cl.Model, damping: float, overload: float, end: float
) -> None:
    body = variant(rig.wheelset, damping=damping)
    torque = (1.0 + overload) * cl.find_fold(body, speed=V).drive_torque
    time = cl.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=end)
    assert time == pytest.approx(simulated_time(body, torque, 0.0, end), rel=1e-6)


@pytest.mark.parametrize(("mass", "tolerance"), [(142.5e3, 0.006), (22.5e3, 0.04)])
def test_slip_away_time_of_a_free_wheelset(
    locomotive: cl.Model, mass: float, tolerance: float
) -> None:
    # Its speed is frozen: the error is about half of what the speed gains meanwhile.
    body = of_mass(locomotive, mass)
    fold = cl.find_fold(body, speed=V)
    for overload in (0.01, 0.1):
        torque = (1.0 + overload) * fold.drive_torque
        time = cl.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=0.15)
        assert time == pytest.approx(simulated_time(body, torque, 0.0, 0.15), rel=tolerance)
        # Without the vehicle's motion in the torque it would be far off at the same torque.
        as_held = variant(body, mass=None)
        wrong = cl.slip_away_time(as_held, drive_torque=torque, speed=V, start=0.0, end=0.15)
        if mass == 22.5e3:
            assert wrong != pytest.approx(time, rel=tolerance)


@pytest.mark.parametrize("overload", [1e-4, 1e-3, 1e-2, 0.03, 0.1])
@pytest.mark.parametrize("end", [0.15, 1.0])
def test_slip_away_formula(rig: cl.Model, overload: float, end: float) -> None:
    body = variant(rig.wheelset, damping=0.0)
    law, zeta0 = cl.CarterGriffith(k_hat=0.3), body.element.saturation_creepage
    peak, sliding = law.peak, 0.21 * body.element.contact.normal_load
    h = 1e-4
    ends = law.slope(peak.normalized_creepage + np.array([-h, h]))
    time = stability.slip_away_formula(
        radius=0.5,
        inertia=250.0,
        speed=V,
        overload=overload,
        peak_force=sliding * peak.traction_ratio,
        peak_curvature=sliding * float(ends[0] - ends[1]) / (2.0 * h * zeta0**2),
        peak_creepage=zeta0 * peak.normalized_creepage,
        end_creepage=end,
        sliding_force=sliding,
    )
    torque = (1.0 + overload) * 0.5 * sliding * peak.traction_ratio
    assert time == pytest.approx(simulated_time(body, torque, 0.0, end), rel=0.15)
    estimate = stability.slip_away_estimate(body, drive_torque=torque, speed=V, end=end)
    assert estimate == pytest.approx(time, rel=1e-3)


def test_slip_away_formula_is_best_at_the_peak(rig: cl.Model) -> None:
    # To pass a peak takes the time of a parabola, the more so the less the overload.
    body = variant(rig.wheelset, damping=0.0)
    fold = cl.find_fold(body, speed=V)
    overloads = np.array([1e-2, 1e-3, 1e-4, 1e-5])
    misses = []
    for overload in overloads:
        torque = (1.0 + overload) * fold.drive_torque
        exact = cl.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=0.15)
        estimate = stability.slip_away_estimate(body, drive_torque=torque, speed=V, end=0.15)
        misses.append(abs(estimate / exact - 1.0))
    assert (np.diff(misses) < 0.0).all()
    assert misses[-1] < 0.005


@pytest.mark.parametrize("below", [1e-3, 1e-6, 1e-9, 1e-12, 0.0])
def test_no_slip_away_below_the_fold(rig: cl.Model, below: float) -> None:
    fold = cl.find_fold(rig.wheelset, speed=V)
    body, torque = rig.wheelset, (1.0 - below) * fold.drive_torque
    assert cl.slip_away_time(body, drive_torque=torque, speed=V, start=0.0, end=0.1) == math.inf
    assert stability.slip_away_estimate(body, drive_torque=torque, speed=V, end=0.1) == math.inf
    assert cl.slip_away_time(body, drive_torque=torque, speed=V, start=0.1, end=0.1) == 0.0


@pytest.mark.parametrize("overload", [1e-14, 1e-12, 1e-10, 1e-8])
def test_slip_away_time_grows_without_end_towards_the_fold(rig: cl.Model, overload: float) -> None:
    # The squeeze past the peak goes as one over the root of the overload; the rest does not grow.
    fold = cl.find_fold(rig.wheelset, speed=V)
    given: dict[str, Any] = {"drive_torque": (1.0 + overload) * fold.drive_torque, "speed": V}
    found = cl.slip_away_time(rig.wheelset, start=0.0, end=1.0, **given)
    asked = stability.slip_away_estimate(rig.wheelset, end=1.0, **given)
    rounding = 4e-16 / overload * asked  # of the torque
    assert found == pytest.approx(asked, rel=0.0, abs=0.3 + rounding)


def test_time_to_recover(rig: cl.Model) -> None:
    body = rig.wheelset
    torque = 0.9 * cl.find_fold(body, speed=V).return_torque
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(torque)),
        initial_speed=V,
        initial_creepage=0.5,
        duration=1.0,
    )
    arrived = np.flatnonzero(run["creepage"] <= 0.02)[0]
    end = float(run["creepage"][arrived])
    time = cl.slip_away_time(body, drive_torque=torque, speed=V, start=0.5, end=end)
    assert time == pytest.approx(float(run.time[arrived]), rel=1e-6)
    back = cl.slip_away_time(body, drive_torque=torque, speed=V, start=end, end=0.5)
    assert back == math.inf


# ---- clearing -------------------------------------------------------------------------------


def survives(body: cl.Wheelset, torque: float, scale: float, creepage: float, time: float) -> bool:
    patch = cl.Profile((0.0, time, time), (scale, scale, 1.0))
    run = cl.simulate(
        body,
        cl.TorqueControl(cl.Profile.of(torque)),
        initial_speed=V,
        initial_creepage=creepage,
        friction_scale=patch,
        duration=time + 2.0,
        output_interval=1.0,
        stop_at=["slip_away"],
    )
    return run.first("slip_away") is None


@pytest.mark.parametrize(
    ("mass", "scale"),
    [
        pytest.param(mass, scale, marks=() if i % len(PATCHES) == j else pytest.mark.slow)
        for i, mass in enumerate(MASSES)
        for j, scale in enumerate(PATCHES)
    ],
)
def test_clearing_time(locomotive: cl.Model, mass: float | None, scale: float) -> None:
    body = of_mass(locomotive, mass)
    torque = 0.95 * cl.find_fold(body, speed=V).drive_torque
    found = cl.clearing(body, drive_torque=torque, speed=V, friction_scale=scale)
    start = found.border.creepage
    low, high = 0.5 * found.time, 2.0 * found.time
    assert survives(body, torque, scale, start, low)
    assert not survives(body, torque, scale, start, high)
    while high > 1.001 * low:
        middle = math.sqrt(low * high)
        if survives(body, torque, scale, start, middle):
            low = middle
        else:
            high = middle
    assert found.time == pytest.approx(math.sqrt(low * high), rel=0.002)
    assert found.distance == pytest.approx(V * found.time, rel=1e-12 if mass is None else 0.02)
    given: dict[str, Any] = {"drive_torque": torque, "speed": V, "friction_scale": scale}
    # With the speed frozen, the integral alone is near for anything that pulls a train.
    frozen = cl.slip_away_time(body, start=start, end=found.border.highest, **given)
    if mass is None:
        assert frozen == found.time
    elif mass >= 22.5e3:
        assert frozen == pytest.approx(found.time, rel=0.01)


def test_a_patch_that_holds_the_torque_may_be_of_any_length(rig: cl.Model) -> None:
    body, scale = rig.wheelset, 0.9
    held = cl.find_fold(body, speed=V, friction_scale=scale).drive_torque
    for part, held_there in ((0.999, True), (1.0 - 3e-7, True), (1.001, False)):
        given: dict[str, Any] = {"drive_torque": part * held, "speed": V, "friction_scale": scale}
        found = cl.clearing(body, **given)
        assert (found.time == math.inf) == held_there
        assert (found.distance == math.inf) == held_there
    low = 0.99 * cl.find_fold(body, speed=V).return_torque  # comes back from anywhere
    assert cl.clearing(body, drive_torque=low, speed=V, friction_scale=0.2).time == math.inf


def test_clearing_time_of_braking(rig: cl.Model) -> None:
    body = variant(rig.wheelset, damping=0.0)
    torque = 0.95 * cl.find_fold(body, speed=V).drive_torque
    times = [
        cl.clearing(body, drive_torque=sign * torque, speed=V, friction_scale=0.6).time
        for sign in (1.0, -1.0)
    ]
    assert times[0] == pytest.approx(times[1], rel=1e-8)


# ---- creep control --------------------------------------------------------------------------


@QUICK
@given(
    body=BODIES,
    speed=magnitude(1.0, 60.0),
    x=number(0.1, 4.0),
    held=st.booleans(),
    damped=st.booleans(),
    resisted=st.booleans(),
)
def test_creep_control_gain_is_the_least(
    body: dict[str, Any], speed: float, x: float, held: bool, damped: bool, resisted: bool
) -> None:
    body = body | ({"mass": None} if held else {}) | ({} if damped else {"damping": 0.0})
    wheelset = made_wheelset(**body if resisted else body | {"resistance": cl.Resistance()})
    point = wheelset.balanced(creepage=x * wheelset.element.saturation_creepage, speed=speed)
    gain = cl.creep_control_gain(wheelset, point)
    neutral = not (held or resisted)  # nothing meets a common acceleration
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


@pytest.mark.parametrize(
    ("mass", "linear", "time"),
    # The determinant decides; the trace does, with a pair of poles; there is only one pole.
    [(22.5e3, 1e5, 8.0), (2e3, 2e3, 20.0), (None, 0.0, 20.0)],
)
@pytest.mark.parametrize("factor", [1.0 - 1e-3, 1.0 + 1e-3])
def test_linear_and_nonlinear_run_agree_on_the_gain(
    rig: cl.Model, mass: float | None, linear: float, time: float, factor: float
) -> None:
    body = variant(rig.wheelset, mass=mass, resistance=cl.Resistance(linear=linear))
    point = body.balanced(creepage=0.022, speed=V)
    gain = factor * cl.creep_control_gain(body, point)
    load = body.element.contact.normal_load
    control = cl.CreepControl(
        reference=cl.Profile.of(0.022),
        proportional_gain=gain,
        torque_min=-1e6,
        torque_max=1e6,
    )
    run = cl.simulate(
        body,
        control,
        initial_speed=V,
        resistance_force=point.resistance_force,
        normal_load=cl.Profile(
            (1e-3, 1e-3, 2e-3, 2e-3), (load, (1.0 + 1e-6) * load, (1.0 + 1e-6) * load, load)
        ),
        duration=time,
        output_interval=time / 50.0,
        tolerance=1e-12,
    )
    system = body.linearize(point)
    creepage = system.C[system.output_labels.index("creepage")]
    closed = system.A - gain * np.outer(system.B[:, 0], creepage)
    stable = bool((np.linalg.eigvals(closed).real < 0.0).all())
    assert stable == (factor > 1.0)
    states = np.array([run["omega"] - point.omega, run["speed"] - V])[: len(closed)]
    begin, end = np.searchsorted(run.time, [0.2 * time, 0.98 * time])
    flow = expm(closed * (run.time[end] - run.time[begin]))
    np.testing.assert_allclose(
        states[:, end], flow @ states[:, begin], rtol=1e-2, atol=1e-2 * np.abs(states).max()
    )
