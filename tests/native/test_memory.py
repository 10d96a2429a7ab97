"""A contact with memory: what its states come to, and how they move."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from native_models import native, with_memory
from scipy.integrate import solve_ivp

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.element import roll
from contactlib.export.description import Description

# States, their rates and, with omega and speed, the columns of the rates' derivatives.
MEMORY = ("held_force", "unslipped", "outer_force", "held_lateral", "outer_lateral")
RATES = ("held_rate", "unslipped_rate", "outer_rate", "lateral_rate", "outer_lateral_rate")
COLUMNS = ("omega", "speed", *MEMORY)
OUTER_STRENGTH, RELEASE = 0.1567, 1e4  # see memory.h


@pytest.fixture(scope="module")
def elements(
    rig: cl.Model,
    locomotive: cl.Model,
    cohesive_table: cl.CreepForceTable,
    layered_cohesive_table: cl.CreepForceTable,
) -> dict[str, cl.ForceElement]:
    """An element with memory for each kind of law."""
    line, ellipse = rig.wheelset.element, locomotive.wheelset.element
    hot = replace(ellipse.friction, softening_temperature=300.0)
    falling = replace(line.friction, slip_rate_residual=0.4, slip_rate_decay=0.5)
    constant = replace(line.friction, static=line.friction.kinetic, weakening_length=0.0)
    made = {
        "line": line,
        "ellipse": ellipse,
        "cohesive": replace(line, table=cohesive_table),
        "layer": replace(line, table=layered_cohesive_table, layer_compliance=1e-13),
        "hot": replace(ellipse, friction=hot),
        "falling": replace(line, friction=falling),
        "constant": replace(line, friction=constant),
    }
    return {name: replace(element, memory=True) for name, element in made.items()}


LAWS = ["line", "ellipse", "cohesive", "layer", "hot", "falling", "constant"]
SAME_AT_ANY_SPEED = ["line", "ellipse", "cohesive", "layer", "constant"]


def evaluated(element: cl.ForceElement, **given: Any) -> Any:
    """Outputs of the kernel, at nominal load if none is given."""
    given = {"normal_load": element.axle_load, "friction_scale": 1.0, **given}
    inputs = np.zeros(
        np.broadcast_shapes(*map(np.shape, given.values())),
        kernel.struct_dtype("force_element_input"),
    )
    for name, value in given.items():
        inputs[name] = value
    contact = kernel.NativeForceElement(element.native_contact, element.rolling_parameters)
    return contact.evaluate(inputs)


def zones(
    element: cl.ForceElement, given: dict[str, FloatArray], part: FloatArray
) -> dict[str, FloatArray]:
    """Forces of outer zone and core as parts of what static friction lets them hold."""
    most = element.friction.static * given["normal_load"] * given["friction_scale"]
    outer, core = OUTER_STRENGTH * most * part[0], (1.0 - OUTER_STRENGTH) * most * part[1]
    return {"outer_force": outer, "held_force": outer + core}


def random_states(element: cl.ForceElement, count: int, seed: int) -> dict[str, FloatArray]:
    """Inputs all over both branches, with force along and against the creepage."""
    rng = np.random.default_rng(seed)
    sign = rng.choice([-1.0, 1.0], (2, count))
    speed = sign[0] * 10.0 ** rng.uniform(-3.0, 1.7, count)
    creepage = element.saturation_creepage * sign[1] * 10.0 ** rng.uniform(-2.0, 1.5, count)
    given = {
        "omega": (speed + np.abs(speed) * creepage) / element.radius,
        "speed": speed,
        "normal_load": element.axle_load * rng.uniform(0.3, 2.0, count),
        "friction_scale": rng.uniform(0.5, 1.2, count),
        "unslipped": rng.uniform(-0.05, 1.05, count),
    }
    given |= zones(element, given, rng.uniform(-1.2, 1.2, (2, count)))
    return given


def model_of(model: cl.Model, **start: float) -> kernel.NativeModel:
    description = Description(with_memory(model), "force_element", whole_wheelset=True)
    return native(description, **start)


@pytest.mark.parametrize("law", LAWS)
def test_steady_force_is_that_of_the_law(elements: dict[str, cl.ForceElement], law: str) -> None:
    element = elements[law]
    given = random_states(element, 2000, seed=1)
    first = evaluated(element, **given)
    given |= {"held_force": first["steady_force"], "unslipped": first["sticking"]}
    given |= {"outer_force": first["steady_outer"]}
    out = evaluated(element, **given)
    pace = np.abs(given["speed"]) / element.memory_scales.relaxation_length
    pace *= 1.0 + np.abs(out["normalized_creepage"])  # a sliding contact follows faster
    force = element.friction.static * given["normal_load"] * given["friction_scale"]
    for rate in RATES:
        # Rounding of a force that friction just holds is lost at the rate of memory.h.
        size, lost = (pace, 0.0) if rate == "unslipped_rate" else (pace * force, np.spacing(force))
        assert np.all(np.abs(out[rate]) <= 1e-12 * size + 2.0 * RELEASE * lost), rate
    steady = replace(element, memory=False)
    inputs = {name: given[name] for name in ("omega", "speed", "friction_scale")}
    fast = np.abs(given["speed"]) >= element.minimum_speed
    expected = np.asarray(steady.force(**inputs, axle_load=given["normal_load"]))[fast]
    np.testing.assert_allclose(out["creep_force"][fast], expected, rtol=1e-12)


@pytest.mark.parametrize("creepage", [-0.5, -0.01, 0.0, 0.004, 0.012, 0.03, 3.0])
def test_rolling_on_comes_to_the_force_of_the_law(rig: cl.Model, creepage: float) -> None:
    element, speed = rig.wheelset.element, 2.0
    omega = (1.0 + creepage) * speed / element.radius
    expected = float(element.force(omega=omega, speed=speed))
    for start in (-0.3 * element.axle_load, 0.0, 0.4 * element.axle_load):
        for unslipped in (0.0, 1.0):
            model = model_of(rig, omega=omega, speed=speed, held_force=start, unslipped=unslipped)
            model.advance(2.0, 1e-9)  # more than 300 relaxation lengths
            largest = element.friction.static * element.axle_load
            assert model.get("creep_force")[0] == pytest.approx(expected, abs=1e-9 * largest)


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("law", LAWS)
def test_jacobian_of_the_rates_is_exact(
    elements: dict[str, cl.ForceElement], law: str, across: bool
) -> None:
    element = elements[law]
    given = random_states(element, 3000, seed=4)
    slip = np.abs(element.radius * given["omega"] - given["speed"])
    rng = np.random.default_rng(5)
    aside = zones(element, given, 0.6 * rng.uniform(-1.0, 1.0, (2, slip.size)))
    given["held_lateral"], given["outer_lateral"] = aside["held_force"], aside["outer_force"]
    force = 0.1 * element.friction.static * given["normal_load"] * given["friction_scale"]
    if across:
        lateral, spin = slip * rng.choice([-1.0, 1.0], (2, slip.size))
        given["lateral_velocity"] = lateral * 10.0 ** rng.uniform(-1.0, 1.0, slip.size)
        spin *= 10.0 ** rng.uniform(-1.0, 0.0, slip.size) / element.contact.semi_width
        given["spin_velocity"] = np.where(rng.uniform(size=slip.size) < 0.5, spin, 0.0)
    out = evaluated(element, **given)
    rooms = {
        "omega": slip / element.radius,
        "speed": np.minimum(slip, np.abs(given["speed"])),
        **{name: np.full_like(slip, 0.1) if name == "unslipped" else force for name in MEMORY},
    }
    clear_of = {}
    for column, by in enumerate(COLUMNS):
        sides = []
        for factor in (1e-4, -1e-4, 0.5e-4, -0.5e-4):
            moved = given[by] + factor * rooms[by]
            there = evaluated(element, **{**given, by: moved})
            change = moved - given[by]
            sides.append({r: (there[r] - out[r]) / change for r in RATES})
        for row, rate in enumerate(RATES):
            a, b, c, d = (side[rate] for side in sides)
            found = (4.0 * (c + d) - (a + b)) / 6.0
            exact = out["memory_by"][:, row, column]
            size = np.abs(out[rate]) / rooms[by] + np.abs(exact)
            # Where branches meet, the difference quotients of both sides differ too.
            smooth = np.abs((a - b) - 2.0 * (c - d)) < 1e-5 * size
            smooth &= np.abs(a - b) < 0.05 * size
            clear_of[rate, by] = float(smooth.mean())
            wrong = smooth & (np.abs(found - exact) > 1e-6 * size + 1e-300)
            assert not wrong.any(), (rate, by, {k: v[wrong][:2] for k, v in given.items()})
    assert min(clear_of.values()) > 0.85, clear_of


@pytest.mark.parametrize("law", ["line", "ellipse"])
def test_steps_are_the_integral_of_the_rates(rig: cl.Model, locomotive: cl.Model, law: str) -> None:
    model = rig if law == "line" else locomotive
    element = replace(model.wheelset.element, memory=True)
    rng = np.random.default_rng(2)
    for _ in range(6):
        speed = float(rng.choice([-1.0, 0.0, 1.0]) * 10 ** rng.uniform(-3.0, 1.0))
        slip = float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-4.0, 0.0))
        force = element.friction.static * element.axle_load
        core, outer = rng.uniform(-0.9, 0.9, 2) * [1.0 - OUTER_STRENGTH, OUTER_STRENGTH] * force
        start = [core + outer, rng.uniform(0.0, 1.0), outer]
        path = 10 ** rng.uniform(-3.0, 0.5) * element.memory_scales.relaxation_length
        step = path / (abs(speed) + abs(slip) / element.saturation_creepage)
        given = {"omega": (speed + slip) / element.radius, "speed": speed}

        def rates(_: float, y: FloatArray, given: dict[str, float] = given) -> FloatArray:
            out = evaluated(element, **given, **dict(zip(MEMORY[:3], y, strict=True)))
            return np.array([out[rate] for rate in RATES[:3]])

        solved = solve_ivp(
            rates,
            (0.0, step),
            start,
            method="Radau",
            rtol=1e-9,
            atol=1e-11 * np.array([force, 1.0, force]),
        )
        stepped = model_of(
            model,
            **given,
            normal_load=element.axle_load,
            **dict(zip(MEMORY[:3], start, strict=True)),
        )
        stepped.advance(step, 1e-9)
        error = np.array(stepped.get(*MEMORY[:3])) - solved.y[:, -1]
        assert np.abs(error / [force, 1.0, force]).max() < 1e-6, given


@pytest.mark.parametrize("law", SAME_AT_ANY_SPEED)
def test_speed_only_scales_time(elements: dict[str, cl.ForceElement], law: str) -> None:
    element = elements[law]
    distance = np.linspace(0.0, 0.06, 121)
    creepage = 2.0 * element.saturation_creepage * np.sin(200.0 * distance)
    contact = kernel.NativeForceElement(element.table.native, element.rolling_parameters)
    force = contact.roll(creepage, distance, 1.0, 1e-8)
    for speed in (0.01, 50.0):
        other = contact.roll(creepage, distance, speed, 1e-8)
        np.testing.assert_allclose(other, force, atol=1e-6 * np.abs(force).max())


@pytest.mark.parametrize("law", LAWS)
def test_mirrored_histories_give_mirrored_forces(
    elements: dict[str, cl.ForceElement], law: str
) -> None:
    element = elements[law]
    distance = np.linspace(0.0, 0.05, 101)
    creepage = 2.0 * element.saturation_creepage * np.sin(150.0 * distance + 0.3)
    if law != "hot":  # a faster wheel carries off more heat
        there = roll(element, creepage=creepage, distance=distance)
        back = roll(element, creepage=-creepage, distance=distance)
        np.testing.assert_allclose(back, -there, rtol=1e-9, atol=1e-9 * there.max())
    given = random_states(element, 500, seed=7)
    out = evaluated(element, **given)
    for name in ("omega", "speed", "held_force", "outer_force"):
        given[name] = -given[name]
    turned = evaluated(element, **given)
    np.testing.assert_array_equal(turned["held_rate"], -out["held_rate"])
    np.testing.assert_array_equal(turned["outer_rate"], -out["outer_rate"])
    np.testing.assert_array_equal(turned["unslipped_rate"], out["unslipped_rate"])


def test_wheel_holds_its_force_at_standstill(rig: cl.Model) -> None:
    load = rig.wheelset.element.axle_load
    model = model_of(rig, omega=0.0, speed=0.0, held_force=0.15 * load, outer_force=0.05 * load)
    (before,) = model.get("creep_force")
    model.advance(100.0)
    assert model.get("creep_force")[0] == pytest.approx(before, rel=0.01)


@pytest.mark.parametrize("law", ["line", "ellipse", "constant"])
def test_force_at_standstill_begins_with_the_stiffness_of_mindlin(
    elements: dict[str, cl.ForceElement], law: str
) -> None:
    element = elements[law]
    memory = element.memory_scales
    slips = np.array([-1e-3, 1e-5, 1e-3, 1.0])
    out = evaluated(element, omega=slips / element.radius, speed=0.0, unslipped=1.0)
    grown = out["held_rate"] * memory.relaxation_length * element.saturation_creepage
    slope = memory.standing_stiffness * memory.initial_slope * element.friction.kinetic
    slope *= element.axle_load
    np.testing.assert_allclose(grown / slips, slope, rtol=1e-3)


@pytest.mark.parametrize("spinning", [0.1, 10.0, 1000.0])
def test_wheel_that_spins_at_standstill_winds_up_no_spring(rig: cl.Model, spinning: float) -> None:
    # Turned back, it must give its force up within microns, however long it span.
    element = rig.wheelset.element
    model = model_of(rig, omega=2.0, speed=0.0)
    load = model.get("normal_load")[0]
    forces = []
    for time in (1e-5, 1e-4, 1e-3, spinning):
        model.advance(time)
        forces.append(model.get("creep_force")[0] / load)
    assert max(forces) <= element.friction.static
    assert forces[-1] == pytest.approx(element.friction.kinetic, rel=1e-5)
    model.set(omega=-2.0)
    length = element.memory_scales.relaxation_length * element.saturation_creepage
    model.advance(2.0 * length / (2.0 * element.radius))
    assert model.get("creep_force")[0] < 0.0


def test_wheel_that_lifts_off_returns_without_memory(rig: cl.Model) -> None:
    element, speed, creepage = rig.wheelset.element, 5.0, 0.01
    omega = (1.0 + creepage) * speed / element.radius
    model = model_of(rig, omega=omega, speed=speed)
    (load,) = model.get("normal_load")
    model.advance(1.0)
    (steady,) = model.get("creep_force")
    model.set(normal_load=-10.0)
    model.evaluate()
    assert model.get("creep_force") == [0.0]
    model.advance(2e-3)  # 20 of the times in which it forgets
    held, unslipped, outer = model.get(*MEMORY[:3])
    assert abs(held) + abs(outer) < 1e-6 * steady
    assert unslipped == pytest.approx(1.0, abs=1e-6)
    model.set(normal_load=load)
    model.evaluate()
    assert abs(model.get("creep_force")[0]) < 1e-6 * steady
    model.advance(1.0)
    assert model.get("creep_force")[0] == pytest.approx(steady, rel=1e-6)


@pytest.mark.parametrize("factor", [1e-8, 1e-3, 0.1, 0.9, 1.1, 10.0, 1e3])
def test_load_may_jump(rig: cl.Model, factor: float) -> None:
    """The contact keeps its force up to what friction holds under the other load."""
    element, speed, creepage = rig.wheelset.element, 5.0, 0.01
    omega = (1.0 + creepage) * speed / element.radius
    model = model_of(rig, omega=omega, speed=speed)
    (load,) = model.get("normal_load")
    model.advance(1.0)
    held, outer = model.get("held_force", "outer_force")
    largest = element.friction.static * factor * load
    model.set(normal_load=factor * load)
    model.evaluate()
    kept = min(outer, OUTER_STRENGTH * largest)
    kept += min(held - outer, (1.0 - OUTER_STRENGTH) * largest)
    assert model.get("creep_force")[0] == pytest.approx(kept)
    for _ in range(50):
        model.advance(1e-3)
        assert abs(model.get("creep_force")[0]) <= largest * (1.0 + 1e-12)
    model.advance(10.0)
    expected = float(element.force(omega=omega, speed=speed, axle_load=factor * load))
    assert model.get("creep_force")[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("kind", ["force_element", "wheelset"])
@pytest.mark.parametrize("models", [10, pytest.param(60, marks=pytest.mark.slow)])
def test_nothing_diverges_at_any_step_or_speed(
    rig: cl.Model, locomotive: cl.Model, kind: str, models: int
) -> None:
    rng = np.random.default_rng(6)
    for i in range(models):
        made = with_memory(rig if i % 2 else locomotive)
        radius, friction = made.wheelset.radius, made.wheelset.element.friction
        model = native(Description(made, kind), speed=0.0, omega=0.0)
        (load,) = model.get("normal_load")
        for _ in range(12):
            speed = float(rng.choice([-1.0, 0.0, 1.0]) * 10 ** rng.uniform(-8.0, 2.0))
            slip = float(rng.choice([-1.0, 0.0, 1.0]) * 10 ** rng.uniform(-8.0, 2.0))
            given = {"normal_load": load * float(rng.choice([0.0, 1e-6, 0.5, 1.0, 3.0]))}
            if kind == "force_element":
                aside = slip * float(rng.choice([0.0, 0.1, 1.0]))
                given |= {"omega": (speed + slip) / radius, "speed": speed}
                given |= {"lateral_velocity": aside}
            else:
                given |= {"drive_torque": float(rng.uniform(-3e4, 3e4))}
            model.set(**given)
            model.evaluate()
            model.advance(float(10 ** rng.uniform(-9.0, 1.0)))
            force = model.get("creep_force", "lateral_force")
            most = friction.static * given["normal_load"]
            assert math.hypot(*force) <= most * (1.0 + 1e-12)
            (unslipped,) = model.get("unslipped")
            assert -1e-2 < unslipped < 1.01
            assert np.isfinite(model.get("omega", "speed", "creep_force")).all()


@pytest.mark.parametrize("torque", [5.0e3, 1.0e4])
def test_the_error_under_a_torque_that_jumps_is_a_thousandth_of_the_tolerance(
    rig: cl.Model, torque: float
) -> None:
    made = with_memory(rig)
    friction = made.wheelset.element.friction.kinetic * made.wheelset.element.axle_load
    forces = []
    for tolerance in (1e-6, 1e-10):
        model = native(Description(made, "wheelset"))
        for i in range(300):  # the start is forgotten
            model.set(drive_torque=torque * (1.0 + 0.02 * (-1.0) ** i))
            model.advance(1e-3, tolerance)
        model.evaluate()
        forces.append(model.get("creep_force")[0])
    assert forces[0] == pytest.approx(forces[1], abs=1e-3 * 1e-6 * friction)


@pytest.mark.parametrize("law", LAWS)
def test_parameters_of_memory_do_nothing_without_it(
    elements: dict[str, cl.ForceElement], law: str
) -> None:
    element = replace(elements[law], memory=False)
    given = random_states(element, 500, seed=9)
    forgotten = dict.fromkeys(MEMORY, 0.0)
    expected = evaluated(element, **{**given, **forgotten})
    parameters = {**element.parameters, **element.memory_parameters, "memory": 0.0}
    inputs = np.zeros(500, kernel.struct_dtype("force_element_input"))
    for name, value in given.items():
        inputs[name] = value
    out = kernel.NativeForceElement(element.native_contact, parameters).evaluate(inputs)
    assert np.array_equal(out, expected)
    assert not any(out[rate].any() for rate in RATES)
    steady = evaluated(elements[law], **given)  # what does not depend on it
    fast = np.abs(given["speed"]) >= element.minimum_speed
    for name in ("creepage", "steady_force", "k_hat", "force_gradient", "contact_temperature"):
        np.testing.assert_array_equal(steady[name][fast], out[name][fast], err_msg=name)


@pytest.mark.parametrize("method", ["Radau", "BDF", "LSODA"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_solvers_pass_through_lift_off(rig: cl.Model, method: Any, tolerance: float) -> None:
    element = with_memory(rig).wheelset.element
    native, speed, load = element.rolling_native, 10.0, element.axle_load
    friction = element.friction.kinetic * load

    def rates(t: float, y: FloatArray) -> list[float]:
        under = load * float(np.interp(t, [0.05, 0.1, 0.13, 0.18], [1.0, -0.3, -0.3, 1.0]))
        out = native.evaluate_one(1.002 * speed / element.radius, speed, under, 1.0, *y)
        return [out.held_rate, out.unslipped_rate, out.outer_rate]

    allowed = tolerance * np.array([friction, 1.0, friction])
    run = solve_ivp(rates, (0.0, 0.3), [0.0, 1.0, 0.0], method=method, rtol=tolerance, atol=allowed)
    assert run.success
    assert run.t.size < 3000
    steady = float(element.force(omega=1.002 * speed / element.radius, speed=speed))
    assert run.y[0, -1] == pytest.approx(steady, rel=10.0 * tolerance)
    lifted = run.y[:, np.argmin(np.abs(run.t - 0.125))]
    assert np.abs(lifted - [0.0, 1.0, 0.0]).max() < 1e-3 * friction


@pytest.mark.parametrize("substeps", [1, 2, 3, 10, 30])
def test_bounded_work_stays_within_friction(rig: cl.Model, substeps: int) -> None:
    """Errors against a step without a bound, on a torque ramp and a slippery place."""
    exact, bounded = (
        model_of(rig, speed=10.0, omega=20.0, max_substeps=count) for count in (0.0, substeps)
    )
    element, omega, errors = rig.wheelset.element, 10.0 / rig.wheelset.radius, []
    largest = element.friction.static * element.axle_load
    for i in range(900):
        friction = 0.4 if 600 < i < 750 else 1.0
        for model in (exact, bounded):
            model.set(omega=omega, friction_scale=friction)
            model.evaluate()
            model.advance(1e-3)
            model.evaluate()
        forces = [model.get("creep_force")[0] for model in (exact, bounded)]
        assert abs(forces[1]) <= friction * largest * (1.0 + 1e-12)
        errors.append((forces[1] - forces[0]) / (element.friction.kinetic * element.axle_load))
        omega += 1e-3 * (min(30.0 * i, 1.2e4) - element.radius * forces[0]) / 125.0
    assert np.sqrt(np.mean(np.square(errors))) < (0.02 if substeps < 3 else 0.01)
