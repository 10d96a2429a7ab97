"""The relaxed contact: its exact step, and what it comes to."""

from __future__ import annotations

import numpy as np
import pytest
from native_models import SIGMA, difference_quotient, native
from scipy.integrate import solve_ivp

import contactlib as cl
from contactlib.export.description import Description


def test_relaxation_over_a_step_is_exact(rig: cl.Model) -> None:
    description = Description(rig, "force_element", relaxation_length=SIGMA, whole_wheelset=True)
    rng = np.random.default_rng(2)
    radius, zeta0 = rig.wheelset.radius, rig.wheelset.element.saturation_creepage
    for _ in range(120):
        speed = rng.choice([-1.0, 0.0, 1.0]) * 10 ** rng.uniform(-3.0, 1.0)
        slip = rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-4.0, 0.5)
        start = zeta0 * rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-2.0, 2.0)
        step = 10 ** rng.uniform(-4.0, -1.0)
        given = {"omega": (speed + slip) / radius, "speed": speed, "relaxed_creepage": start}

        def rate(_: float, y: np.ndarray) -> list[float]:
            length = SIGMA * min(1.0, zeta0 / abs(y[0]))
            decay = abs(speed)  # noqa: B023
            if abs(y[0]) > zeta0:  # where the growth must end, far from all that matters
                decay = max(decay, 1e-6 * abs(slip) / zeta0)  # noqa: B023
            return [(slip - decay * y[0]) / length]  # noqa: B023

        solved = solve_ivp(rate, (0.0, step), [start], method="LSODA", rtol=1e-10, atol=1e-13)
        whole, halves = native(description, **given), native(description, **given)
        whole.advance(step)
        halves.advance(0.5 * step)
        halves.advance(0.5 * step)
        (exact,) = whole.get("relaxed_creepage")
        assert exact == pytest.approx(solved.y[0, -1], rel=1e-7, abs=1e-7 * zeta0)
        assert exact == pytest.approx(halves.get("relaxed_creepage")[0], rel=1e-10, abs=1e-13)


def test_force_follows_by_one_minus_one_over_e_in_a_relaxation_length(rig: cl.Model) -> None:
    creepage, speed = 1e-6, 7.0
    omega = (1.0 + creepage) * speed / rig.wheelset.radius
    model = native(
        Description(rig, "force_element", relaxation_length=SIGMA, whole_wheelset=True),
        omega=omega,
        speed=speed,
    )
    model.advance(SIGMA / speed)
    whole = float(rig.wheelset.element.force(omega=omega, speed=speed))
    assert model.get("creep_force")[0] / whole == pytest.approx(1.0 - np.exp(-1.0), rel=1e-4)


@pytest.mark.parametrize("creepage", [-0.5, -0.01, 0.012, 0.03, 3.0])
def test_relaxed_force_comes_to_that_of_the_element(rig: cl.Model, creepage: float) -> None:
    element, speed = rig.wheelset.element, 2.0
    omega = (1.0 + creepage) * speed / element.radius
    model = native(
        Description(rig, "force_element", relaxation_length=SIGMA, whole_wheelset=True),
        omega=omega,
        speed=speed,
    )
    model.advance(1.0)
    expected = float(element.force(omega=omega, speed=speed))
    assert model.get("creep_force")[0] == pytest.approx(expected, rel=1e-9)


def test_relaxed_wheel_holds_its_force_at_standstill(rig: cl.Model) -> None:
    description = Description(rig, "force_element", relaxation_length=SIGMA, whole_wheelset=True)
    model = native(description, omega=0.0, speed=0.0, relaxed_creepage=0.01)
    before = model.get("creep_force", "relaxed_creepage")
    model.advance(100.0)
    assert model.get("creep_force", "relaxed_creepage") == before
    assert before[0] > 0.9 * rig.wheelset.element.friction.kinetic * 220e3


def test_wheel_that_spins_at_standstill_winds_up_no_spring(rig: cl.Model) -> None:
    # Turned back, it must give its force up within microns, however long it span.
    description = Description(rig, "force_element", relaxation_length=SIGMA, whole_wheelset=True)
    element = rig.wheelset.element
    model = native(description, omega=2.0, speed=0.0)
    model.advance(10.0)
    (sliding,) = model.get("creep_force")
    assert sliding == pytest.approx(element.friction.kinetic * 220.65e3, rel=1e-6)
    model.set(omega=-2.0)
    back = 20.0 * SIGMA * element.saturation_creepage  # in metres of slip
    model.advance(back / (2.0 * element.radius))
    assert model.get("creep_force")[0] < 0.0


@pytest.mark.parametrize("decay", [0.0, 0.5])
@pytest.mark.parametrize("load", [0.0, 1e3, 220e3])
def test_relaxation_of_a_wheel_that_spins_at_standstill_has_its_derivatives(
    rig: cl.Model, load: float, decay: float
) -> None:
    # Where its decay is by the slip, as there is no speed.
    description = Description(rig, "wheelset", relaxation_length=SIGMA)
    given = {"slip_rate_decay": decay, "slip_rate_residual": 0.4, "relaxed_creepage": 9.0}
    model = native(description, omega=3.0, speed=0.0, normal_load=load, **given)
    unknowns = ["der(relaxed_creepage)"]
    names = ["omega", "speed", "relaxed_creepage", "radius", "kinetic_friction", "slip_rate_decay"]
    for name in [*names, "normal_load"] if load > 0.0 else names:
        step = 1e-4 * load if name == "normal_load" else 1e-6  # too short for the speed to count
        found, _ = difference_quotient(model, unknowns, name, step)
        (exact,) = model.tangent(unknowns, {name: 1.0})
        size = abs(model.get(*unknowns)[0])
        assert exact == pytest.approx(found[0], rel=1e-5, abs=1e-6 * size), name


@pytest.mark.parametrize(
    ("omega", "load", "torque"), [(0.0, 0.0, 6e3), (-0.945, 1e3, 6e3), (-1.0, 1.0, -2e4)]
)
def test_relaxed_wheelset_spins_at_standstill_with_next_to_no_load(
    rig: cl.Model, omega: float, load: float, torque: float
) -> None:
    # An inexact Jacobian would need more substeps than there may be.
    description = Description(rig, "wheelset", relaxation_length=SIGMA)
    model = native(
        description, omega=omega, speed=0.0, normal_load=load, drive_torque=torque, damping=0.0
    )
    model.advance(0.5)
    away = 0.5 * rig.wheelset.element.friction.static * load / rig.wheelset.inertia
    expected = omega + 0.5 * torque / rig.wheelset.inertia
    assert model.get("omega")[0] == pytest.approx(expected, abs=0.5 * away + 1e-6)


@pytest.mark.parametrize(
    ("sigma", "step", "speed", "omega", "creepage", "torque", "inertia", "inverse_mass", "load"),
    [
        (6.5e-3, 1.38, 0.0174, 0.0458, 2.12e-3, 319.0, 29.2, 2.9e-5, 46e3),
        (5.2e-3, 1.54, 0.0, -0.00588, -7.1e-2, 2519.0, 26.5, 0.0, 63.6e3),
        (2.5e-3, 0.94, 0.0033, -0.5, -5.2e-2, 1072.0, 22.0, 0.0, 63.3e3),
        (12.9e-3, 1.6, 0.0091, 0.0157, 1.6e-4, -8283.0, 16.6, 1e-5, 189e3),
    ],
)
def test_long_step_of_a_wheel_that_swings_on_its_contact_keeps_the_mean(
    locomotive: cl.Model,
    sigma: float,
    step: float,
    speed: float,
    omega: float,
    creepage: float,
    torque: float,
    inertia: float,
    inverse_mass: float,
    load: float,
) -> None:
    # Hundreds of swings, hardly damped: too many to follow them all in one step.
    description = Description(locomotive, "wheelset", relaxation_length=sigma)
    start = {"omega": omega, "speed": speed, "relaxed_creepage": creepage, "normal_load": load}
    body = {"drive_torque": torque, "inertia": inertia, "inverse_mass": inverse_mass}
    whole, parts = (native(description, **start, **body) for _ in range(2))
    whole.advance(step)
    assert whole.held_tolerance > 1e-6
    slips = []
    for _ in range(1009):
        parts.advance(step / 1009)
        assert parts.held_tolerance == 1e-6
        turned, rolled = parts.get("omega", "speed")
        slips.append(turned * locomotive.wheelset.radius - rolled)
    turned, rolled = whole.get("omega", "speed")
    assert rolled == pytest.approx(parts.get("speed")[0], rel=1e-3)
    swing = np.ptp(slips[-250:])
    assert turned * locomotive.wheelset.radius - rolled == pytest.approx(
        float(np.mean(slips[-250:])), abs=0.6 * swing
    )
