"""Wheels that vibrate against each other: threshold, limit cycles, two states for one torque.

The references are the kernel's drivetrain, which tests/vehicle/test_drivetrain.py compares with
another solver, and the difference of both wheels about a mean that does not move. Creep control
holds the mean creepage of the drivetrain, as the describing function takes for granted.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest
from plain_scenario import controls
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import contactlib as cl
from contactlib import kernel
from contactlib.stability import SteadyRollingWarning, reduced_frequency, torsion
from contactlib.stability.poles import STEADY_ROLLING
from contactlib.stability.torsion import AntiphaseForce
from contactlib.vehicle import Axle, Drivetrain, Motor, OperatingPoint

FREQUENCY, DAMPING_RATIO = 50.0, 0.01  # of the axle: chosen
SPEED = 10.0


@pytest.fixture(scope="module")
def held(locomotive: cl.Model) -> cl.Wheelset:
    """The locomotive's at a held speed."""
    return replace(locomotive.wheelset, mass=None)


def on_axle(
    wheelset: cl.Wheelset, damping_ratio: float = DAMPING_RATIO, frequency: float = FREQUENCY
) -> Drivetrain:
    omega = 2.0 * math.pi * frequency
    damping = 0.25 * (2.0 * damping_ratio * omega * wheelset.inertia - wheelset.damping)
    axle = Axle(stiffness=0.25 * omega**2 * wheelset.inertia, damping=damping)
    made = Drivetrain(wheelset, axle=axle)
    assert made.torsional_frequency == pytest.approx(omega)
    assert made.torsional_damping_ratio == pytest.approx(damping_ratio)
    return made


def rows_at(point: OperatingPoint, count: int) -> tuple[Any, Any]:
    """Inputs and states of drivetrains whose wheels and rotors turn as at a point."""
    given, state = (np.zeros(count, kernel.drivetrain_dtype(kind)) for kind in ("input", "state"))
    for side in ("left", "right"):
        given[f"load_{side}"], given[f"friction_{side}"] = 0.5 * point.axle_load, 1.0
        state[f"omega_{side}"] = point.omega
    given["slope"], state["speed"], state["motor_omega"] = 1.0, point.speed, point.omega
    return given, state


def amplitudes(
    drivetrain: Drivetrain,
    point: OperatingPoint,
    kicks: list[float],
    cycles: int,
    *,
    gains: tuple[float, float] | None = None,
    tolerance: float = 1e-6,
) -> np.ndarray:
    """Largest |zeta_left - zeta_right|/2 of each cycle at held speed, a column for each kick.

    A kick is the amplitude that the first twist makes. Gains are those of a PI controller of the
    mean creepage, renewed 200 times a cycle. Without them a proportional one halves the error in
    each step; its bandwidth, 0.5 over the step, is eight times the ripple's 2 omega_t.
    """
    body, rows = drivetrain.wheelset, 200
    step = 2.0 * math.pi / drivetrain.torsional_frequency / rows
    stiff = 0.5 * body.inertia * point.speed / (body.radius * step)
    proportional, integral = gains or (stiff, 0.0)
    given, state = rows_at(point, len(kicks))
    twist = 2.0 * point.speed / (body.radius * drivetrain.torsional_frequency)
    state["twist"] = twist * np.array(kicks)
    substep, memory, sizes = np.zeros(len(kicks)), np.zeros(len(kicks)), []
    fleet = kernel.NativeFleet([drivetrain.member()] * len(kicks))
    for _ in range(cycles * rows):
        left, right = (body.radius * state[f"omega_{x}"] / point.speed for x in ("left", "right"))
        sizes.append(0.5 * np.abs(left - right))
        error = point.creepage - (0.5 * (left + right) - 1.0)
        given["commanded_torque"] = point.drive_torque + proportional * error + memory
        memory += integral * step * error
        fleet.advance(given, state, 0.0, step, tolerance, substep)
    return np.asarray(np.reshape(sizes, (cycles, rows, len(kicks))).max(axis=1))


def last_cycle_about_a_held_mean(
    drivetrain: Drivetrain, point: OperatingPoint, kick: float, cycles: int
) -> tuple[float, float, float]:
    """Amplitude [1], frequency [Hz] and k times twist [N.m] if the mean creepage does not move."""
    body, axle = drivetrain.wheelset, drivetrain.axle
    assert axle is not None
    element, r, inertia, speed = body.element.native, body.radius, 0.5 * body.inertia, point.speed

    def rates(_: float, state: np.ndarray) -> list[float]:
        half = 0.5 * state[0]  # of (omega_left - omega_right)
        ahead, behind = (
            element.evaluate_one(point.omega + w, speed, point.axle_load, 1.0).creep_force
            for w in (half, -half)
        )
        drag = 0.5 * body.damping * half + 2.0 * axle.damping * half + axle.stiffness * state[1]
        return [-2.0 * (0.25 * r * (ahead - behind) + drag) / inertia, state[0]]

    def upward(_: float, state: np.ndarray) -> float:
        return float(state[1])

    upward.direction = 1.0  # type: ignore[attr-defined]
    period = 2.0 * math.pi / drivetrain.torsional_frequency
    solution: Any = solve_ivp(
        rates,
        (0.0, cycles * period),
        [2.0 * speed * kick / r, 0.0],
        method="LSODA",
        rtol=1e-9,
        atol=1e-12,
        max_step=0.05 * period,
        events=upward,
        dense_output=True,
    )
    assert solution.success
    begin, end = solution.t_events[0][-2:]
    difference, twist = np.abs(solution.sol(np.linspace(begin, end, 2001))).max(axis=1)
    return 0.5 * r * difference / speed, 1.0 / (end - begin), axle.stiffness * twist


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("creepage", [0.008, 0.02, 0.04])
def test_antiphase_and_common_eigenvalues(
    locomotive: cl.Model, held: bool, creepage: float
) -> None:
    body = replace(locomotive.wheelset, mass=None) if held else locomotive.wheelset
    drivetrain, point = on_axle(body), body.balanced(creepage=creepage, speed=SPEED)
    whole = np.sort_complex(np.linalg.eigvals(torsion.torsional_jacobian(drivetrain, point)))
    parts = np.concatenate([torsion.antiphase_eigenvalues(drivetrain, point), point.eigenvalues])
    np.testing.assert_allclose(whole, np.sort_complex(parts), rtol=1e-7, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("damping_ratio", [0.005, 0.02])
def test_threshold_is_where_a_small_vibration_neither_grows_nor_decays(
    held: cl.Wheelset, damping_ratio: float
) -> None:
    # Over the creepage, on the tail of the falling branch.
    drivetrain = on_axle(held, damping_ratio)

    def growth(creepage: float) -> float:
        point = held.balanced(creepage=creepage, speed=SPEED)
        sizes = amplitudes(drivetrain, point, [5e-5], 20, tolerance=1e-10)
        return math.log(sizes[-1, 0] / sizes[4, 0])

    threshold = brentq(growth, 0.025, 0.045, xtol=2e-5)
    slope = 0.5 * held.balanced(creepage=threshold, speed=SPEED).creep_force_slope
    assert slope == pytest.approx(torsion.torsional_threshold(drivetrain, speed=SPEED), rel=1e-2)
    # r^2 |Q1'|/(J_w V) = 2 D omega_t
    rate = held.radius**2 * -slope / (0.5 * held.inertia * SPEED)
    assert rate == pytest.approx(2.0 * damping_ratio * 2.0 * math.pi * FREQUENCY, rel=1e-2)


def test_describing_function_is_the_first_harmonic(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    point = body.balanced(creepage=0.035, speed=SPEED)
    force = AntiphaseForce(body, point)
    sizes = np.array([1e-4, 0.005, 0.02, 0.05])
    ours = torsion.effective_slope(body, point, sizes)
    assert ours[0] == pytest.approx(0.5 * point.creep_force_slope, rel=1e-2)
    assert torsion.effective_slope(body, point, 0.0) == 0.5 * point.creep_force_slope
    for size, slope in zip(sizes, ours, strict=True):
        integral, _ = quad(
            lambda phi, a=size: float(force(a * math.sin(phi))) * math.sin(phi),
            0.0,
            0.5 * math.pi,
            epsabs=0.0,
            epsrel=1e-8,
            limit=200,
        )
        assert slope == pytest.approx(4.0 * integral / (math.pi * size), rel=1e-5)
    numerical = control.describing_function(force, sizes, num_points=1000, try_method=False)
    np.testing.assert_allclose(ours, numerical.real, rtol=1e-3)
    assert np.abs(numerical.imag).max() < 1e-9 * np.abs(numerical.real).max()


@pytest.mark.slow
@pytest.mark.parametrize("creepage", [0.02, 0.03, 0.04, 0.045])
@pytest.mark.parametrize("control_of_mean", ["stiff", "as in the model"])
def test_wheels_swing_with_the_amplitude_of_the_describing_function(
    locomotive: cl.Model, creepage: float, control_of_mean: str
) -> None:
    body, (_, control) = replace(locomotive.wheelset, mass=None), controls("locomotive")
    drivetrain, point = on_axle(body), body.balanced(creepage=creepage, speed=SPEED)
    state = torsion.torsional_state(drivetrain, point)
    *edges, cycle = state.limit_cycles
    assert cycle.stable
    assert state.bistable == (creepage > 0.035)
    small = torsion.antiphase_eigenvalues(drivetrain, point).real.max()
    assert (small < 0.0) == state.bistable
    rest, kept = [], [0.1 * cycle.amplitude, 1.1 * cycle.amplitude]
    gains, tolerance = None, 0.01
    if control_of_mean == "as in the model":  # the mean creepage ripples
        gains, tolerance = (control.proportional_gain, control.integral_gain), 0.03
    if state.bistable:  # the kick decides
        (edge,) = edges
        assert not edge.stable
        rest, kept[0] = [0.95 * edge.amplitude], 1.05 * edge.amplitude
    sizes = amplitudes(drivetrain, point, rest + kept, 120, gains=gains)[-1]
    np.testing.assert_allclose(sizes[len(rest) :], cycle.amplitude, rtol=tolerance)
    assert (sizes[: len(rest)] < 0.03 * cycle.amplitude).all()
    # k times twist, twist = 2 V a/(r omega_t)
    axle = drivetrain.axle
    assert axle is not None
    twist = 2.0 * SPEED * cycle.amplitude / (body.radius * drivetrain.torsional_frequency)
    assert cycle.axle_torque == pytest.approx(axle.stiffness * twist)


@pytest.mark.slow
def test_two_states_coexist_at_two_to_three_times_the_peak(held: cl.Wheelset) -> None:
    drivetrain = on_axle(held)
    creepages = torsion.bistable_range(drivetrain, speed=SPEED)
    assert creepages is not None
    low, high = creepages
    peak = 0.015 * cl.CarterGriffith(k_hat=0.3).peak.normalized_creepage
    assert 1.9 < low / peak < 2.1
    assert 3.0 < high / peak < 3.3
    check_bistable_between_the_ends(drivetrain, SPEED)
    for creepage, cycles in ((0.99 * low, 1), (1.01 * high, 0)):
        state = torsion.torsional_state(drivetrain, held.balanced(creepage=creepage, speed=SPEED))
        assert len(state.limit_cycles) == cycles
        assert state.equilibrium_stable == (cycles == 0)
    # Beyond the range a vibration as large as the last cycle dies out.
    last = torsion.torsional_state(drivetrain, held.balanced(creepage=0.99 * high, speed=SPEED))
    gone = held.balanced(creepage=1.05 * high, speed=SPEED)
    assert amplitudes(drivetrain, gone, [last.limit_cycles[-1].amplitude], 60)[-1] < 0.01


def check_bistable_between_the_ends(drivetrain: Drivetrain, speed: float) -> None:
    body, limit = drivetrain.wheelset, torsion.torsional_threshold(drivetrain, speed=speed)
    ends = torsion.bistable_range(drivetrain, speed=speed)
    assert ends is not None
    low, high = ends
    for creepage in (1.002 * low, 0.97 * high, 0.998 * high):
        point = body.balanced(creepage=creepage, speed=speed)
        state = torsion.torsional_state(drivetrain, point)
        assert state.bistable, creepage
        edge, last = (cycle.amplitude for cycle in state.limit_cycles)
        # Between the two an amplitude grows; below and above both it decays.
        below, between, above = torsion.effective_slope(
            body, point, [0.99 * edge, 0.5 * (edge + last), 1.01 * last]
        )
        assert between < limit < min(below, above)
    for creepage in (0.998 * low, 1.002 * high):
        point = body.balanced(creepage=creepage, speed=speed)
        assert not torsion.torsional_state(drivetrain, point).bistable, creepage
    # Beyond the range nothing grows, however closely one looks about the last that did.
    sizes = np.linspace(0.9 * edge, 1.1 * last, 200)
    assert torsion.effective_slope(body, point, sizes).min() > limit


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "frequency", "damping_ratio", "changes"),
    [
        (4.0, 60.0, 0.005, {"inertia": 200.0, "damping": 10.0}),
        (2.0, 50.0, 0.01, {}),
        (3.0, 80.0, 0.03, {}),
        (15.0, 30.0, 0.002, {}),
    ],
)
def test_bistable_up_to_both_ends_of_the_range(
    locomotive: cl.Model,
    speed: float,
    frequency: float,
    damping_ratio: float,
    changes: dict[str, Any],
) -> None:
    body = replace(locomotive.wheelset, mass=None, **changes)
    check_bistable_between_the_ends(on_axle(body, damping_ratio, frequency), speed)


def without_memory(drivetrain: Drivetrain) -> Drivetrain:
    """The drivetrain with contacts in which every instant is steady."""
    body = drivetrain.wheelset
    return replace(drivetrain, wheelset=replace(body, element=replace(body.element, memory=False)))


@pytest.mark.slow
def test_bistable_up_to_both_ends_where_friction_falls_with_slip_speed(
    table: cl.CreepForceTable,
) -> None:
    # At more than twenty times the peak's creepage the rate has a narrow top over the amplitude.
    drivetrain = cl.load_scenario("models/torsion.toml", table=table).drivetrain
    check_bistable_between_the_ends(without_memory(drivetrain), 5.0)


@pytest.mark.slow
def test_error_is_of_second_order_in_the_growth_within_a_cycle(held: cl.Wheelset) -> None:
    drivetrain = on_axle(held)
    growths, slower, twisted_more = [], [], []
    for speed in (20.0, 10.0, 5.0):
        steepest = cl.worst_pole(held, speed=speed).creepage
        point = held.balanced(creepage=steepest, speed=speed)
        (cycle,) = torsion.torsional_state(drivetrain, point).limit_cycles
        size, frequency, torque = last_cycle_about_a_held_mean(
            drivetrain, point, cycle.amplitude, 60
        )
        assert size == pytest.approx(cycle.amplitude, rel=1e-3)
        # rate(0) is twice the growth of a small vibration.
        growth = 2.0 * torsion.antiphase_eigenvalues(drivetrain, point).real.max()
        growths.append(growth / drivetrain.torsional_frequency)
        slower.append(1.0 - frequency / cycle.frequency)
        twisted_more.append(torque / cycle.axle_torque - 1.0)
    for errors in (slower, twisted_more):
        order, _ = np.polyfit(np.log(growths), np.log(errors), 1)
        assert order == pytest.approx(2.0, abs=0.2)


def test_no_range_with_much_damping(locomotive: cl.Model) -> None:
    assert torsion.bistable_range(on_axle(locomotive.wheelset, 0.2), speed=SPEED) is None


def test_what_cannot_vibrate_is_refused(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    with pytest.raises(ValueError, match="rigid axle"):
        torsion.torsional_threshold(Drivetrain(body), speed=SPEED)
    with pytest.raises(ValueError, match="amplitude = -0"):
        torsion.effective_slope(body, body.balanced(creepage=0.03, speed=SPEED), -0.1)


@pytest.mark.slow
def test_the_range_is_of_steady_rolling_and_warns_of_memory(locomotive: cl.Model) -> None:
    body = replace(locomotive.wheelset, mass=None)
    drivetrain = on_axle(replace(body, element=replace(body.element, memory=True)))
    steady = without_memory(drivetrain)
    with pytest.warns(SteadyRollingWarning, match="bistable_range"):
        ends = torsion.bistable_range(drivetrain, speed=SPEED)
    assert ends == torsion.bistable_range(steady, speed=SPEED)


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("memory", [False, True])
def test_the_jacobian_has_the_eigenvalues_of_difference_and_mean(
    locomotive: cl.Model, memory: bool, free: bool
) -> None:
    body = locomotive.wheelset
    element = replace(body.element, memory=memory)
    body = replace(body, element=element, mass=body.mass if free else None)
    drivetrain, point = on_axle(body), body.balanced(creepage=0.03, speed=1.0)
    found = np.linalg.eigvals(torsion.torsional_jacobian(drivetrain, point))
    known = [*torsion.antiphase_eigenvalues(drivetrain, point), *np.linalg.eigvals(point.jacobian)]
    assert len(found) == len(known) + (2 if memory else 0)
    apart = np.abs(np.subtract.outer(known, found)).min(axis=-1)
    assert (apart < 1e-9 * np.abs(known).max()).all()


@pytest.mark.parametrize("speed", [10.0, 5.0, 2.0])
@pytest.mark.parametrize("layer", [0.0, 2e-14])
def test_small_vibrations_with_memory_grow_as_their_first_harmonic(
    held: cl.Wheelset, layer: float, speed: float
) -> None:
    element = replace(held.element, memory=True, layer_compliance=layer)
    body = replace(held, element=element)
    drivetrain, point = on_axle(body), body.balanced(creepage=0.03, speed=speed)
    force = AntiphaseForce(body, point, drivetrain.torsional_frequency)
    slope = float(force.describing_function(0.01 * element.saturation_creepage))
    lost = 2.0 * torsion.checked_axle(drivetrain).damping + 0.5 * body.damping
    growth = -(body.radius**2 * slope / speed + lost) / body.inertia
    found = torsion.antiphase_eigenvalues(drivetrain, point).real.max()
    assert found == pytest.approx(growth, rel=6e-3)


def test_memory_slows_growth_at_low_speed_only(locomotive: cl.Model) -> None:
    """It does by half the lag Delta/zeta of the falling branch in the first order."""
    body = replace(locomotive.wheelset, damping=0.0)
    memory = replace(body, element=replace(body.element, memory=True))
    slowed = []
    for speed in (80.0, 1.0):
        point = body.balanced(creepage=0.02, speed=speed)
        steady, found = (
            torsion.antiphase_eigenvalues(on_axle(one), point).real.max() for one in (body, memory)
        )
        slowed.append(1.0 - found / steady)
    assert abs(slowed[0]) < 1e-3
    assert 0.05 < slowed[1] < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("speed", [5.0, 2.0])
def test_memory_enlarges_limit_cycles_only_where_rolling_is_not_steady(
    held: cl.Wheelset, speed: float
) -> None:
    memory = replace(held, element=replace(held.element, memory=True))
    point = held.balanced(creepage=cl.worst_pole(held, speed=speed).creepage, speed=speed)
    states = (torsion.torsional_state(on_axle(one), point) for one in (held, memory))
    without, found = (state.limit_cycles[-1].amplitude for state in states)
    frequency = reduced_frequency(held, 2.0 * math.pi * FREQUENCY, speed=speed)
    assert (found / without < 1.05) == (frequency < STEADY_ROLLING) == (speed > 3.0)


def test_remembered_describing_function_becomes_the_steady_one(locomotive: cl.Model) -> None:
    memory = replace(locomotive.wheelset, element=replace(locomotive.wheelset.element, memory=True))
    point = locomotive.wheelset.balanced(creepage=0.03, speed=SPEED)
    amplitudes = np.array([0.005, 0.02])
    slow = torsion.AntiphaseForce(memory, point, 2.0 * np.pi * 0.5)
    steady = torsion.AntiphaseForce(locomotive.wheelset, point)
    np.testing.assert_allclose(
        slow.describing_function(amplitudes), steady.describing_function(amplitudes), rtol=2e-3
    )


# ---- motor against wheels -----------------------------------------------------------------------


def on_shaft(
    body: cl.Wheelset, frequency: float = 20.0, damping: float = 0.0, axle: Axle | None = None
) -> Drivetrain:
    """A rotor with 0.48 of the inertia, as the locomotive's."""
    rotor, omega = 0.48 * body.inertia / 16.0, 2.0 * math.pi * frequency
    stiffness = 0.48 * 0.52 * body.inertia * omega**2
    shaft = {"gear_ratio": 4.0, "shaft_stiffness": stiffness, "shaft_damping": damping}
    made = Drivetrain(body, motor=Motor(rotor_inertia=rotor, **shaft), axle=axle)
    assert made.shaft_frequency == pytest.approx(omega)
    return made


def test_light_damping_counts_by_its_part_of_the_energy(held: cl.Wheelset) -> None:
    """Growth, frequency, the threshold and the stiff shaft, each with an error of 1/k."""
    point, errors = held.balanced(creepage=0.02, speed=SPEED), []
    for frequency in (40.0, 80.0, 160.0):
        train = on_shaft(held, frequency, 100.0)
        rotor, wheels = train.motor.inertia_at_axle, train.without_rotor.inertia
        of_wheels = -(held.radius**2 * point.creep_force_slope / SPEED + held.damping) / wheels
        of_shaft = 100.0 * (1.0 / rotor + 1.0 / wheels)
        pole, together = torsion.shaft_pole(train, point), point.eigenvalues[0].real
        poles = np.linalg.eigvals(torsion.torsional_jacobian(train, point))

        def grows(damping: float, at: float = frequency) -> float:
            return torsion.shaft_pole(on_shaft(held, at, damping), point).real

        still = on_shaft(held, frequency, brentq(grows, 100.0, 5000.0))
        ratios = [
            pole.real / (0.5 * (of_wheels * rotor / held.inertia - of_shaft)),
            pole.imag / train.shaft_frequency,
            torsion.shaft_threshold(still, speed=SPEED) / point.creep_force_slope,
            poles[np.abs(poles - together).argmin()].real / together,
        ]
        errors.append(np.abs(np.subtract(ratios, 1.0)))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.2)
    assert np.max(errors[-1]) < 5e-3


WHEELS = Axle(stiffness=6e6, damping=400.0, drive_share=0.7)


@pytest.mark.parametrize(
    ("axle", "memory", "axles"),
    [(None, False, 1), (WHEELS, False, 1), (None, True, 1), (WHEELS, True, 1), (WHEELS, False, 4)],
)
def test_the_motor_vibrates_in_simulations_as_by_its_pole(
    locomotive: cl.Model, axle: Axle | None, memory: bool, axles: int
) -> None:
    """Of four axles two vibrate against each other, as at a held speed."""
    element = replace(locomotive.wheelset.element, memory=memory)
    body = replace(locomotive.wheelset, element=element)
    train, point = on_shaft(body, axle=axle), body.balanced(creepage=0.02, speed=SPEED)
    one = train if axles == 1 else replace(train, wheelset=replace(body, mass=None))
    values, shapes = np.linalg.eig(torsion.torsional_jacobian(one, point))
    pole = torsion.shaft_pole(one, point)
    at = np.abs(values - pole).argmin()
    both = ("left", "right") if axle else ("left",)
    names = [f"omega_{side}" for side in both] + ["twist"] * bool(axle) + ["speed"] * (axles == 1)
    names += [f"{name}_{side}" for name in ("held_force", "unslipped") for side in both if memory]
    names += ["motor_omega", "shaft_twist"]

    given, state = rows_at(point, axles)
    torque, share = point.drive_torque, 0.5 if axle is None else axle.drive_share
    given["commanded_torque"], given["resistance_force"] = torque, point.resistance_force
    state["shaft_twist"] = torque / (train.motor.shaft_stiffness or 1.0)
    state["twist"] = (share - 0.5) * torque / WHEELS.stiffness
    fleet = kernel.NativeFleet([train.member()] * axles, axles)
    fleet.settle(given, state)
    steady = np.array([state[name][0] for name in names])
    for name, part in zip(names, 1e-5 * shapes[:, at].real, strict=True):
        state[name][:2] += np.array([part, -part])[:axles]
        if axle is None and name.endswith("left"):
            state[name.replace("left", "right")] = state[name]
    substep, time, moved = np.zeros(axles), 4.0 * math.pi / pole.imag, []
    for _ in range(101):
        moved.append(np.linalg.inv(shapes)[at] @ (np.array([state[n][0] for n in names]) - steady))
        fleet.advance(given, state, 0.0, 0.01 * time, 1e-11, substep)
    found = pole + np.log(moved[-1] / moved[0] * np.exp(-pole * time)) / time
    parts, exact = (found.real, found.imag), (pole.real, pole.imag)
    assert parts == pytest.approx(exact, rel=5e-3 if memory else 1e-5)


def test_a_shaft_is_needed_and_moves_alone(held: cl.Wheelset) -> None:
    point = held.balanced(creepage=0.02, speed=SPEED)
    with pytest.raises(ValueError, match=r"shaft_stiffness = None: on a rigid shaft"):
        torsion.shaft_pole(Drivetrain(held), point)
    with pytest.raises(ValueError, match=r"drive_share = 0\.7 must be 0\.5 where the motor has"):
        torsion.antiphase_eigenvalues(on_shaft(held, axle=WHEELS), point)
    middle = on_shaft(held, axle=replace(WHEELS, drive_share=0.5))
    poles = np.linalg.eigvals(torsion.torsional_jacobian(middle, point))
    alone = torsion.shaft_pole(on_shaft(held), point)
    for pole in (*torsion.antiphase_eigenvalues(middle, point), alone):
        assert np.abs(poles - pole).min() < 1e-9 * abs(pole)
