"""The kernel's models as an FMU holds them: derivatives, relaxation, integrator, implicit steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contactlib as cl
from contactlib import kernel
from contactlib.export.description import Description

SIGMA = 8e-3


def native(description: Description, **start: float) -> kernel.NativeModel:
    table = description.model.wheelset.element.table
    values = {**description.start_values, **start}
    return kernel.NativeModel(description.kind, table.native, values)


# ---- directional derivatives --------------------------------------------------------------------


@pytest.fixture(scope="module")
def models(rig: cl.Model, cohesive_table: cl.CreepForceTable) -> dict[str, cl.Model]:
    """A model for each kind of table."""
    wheelset = rig.wheelset
    polach = cl.Polach.dry(kalker_coefficient=3.7, poisson_ratio=0.28)
    elliptic = cl.EllipticContact.from_semi_axes(
        semi_axis_x=5e-3, semi_axis_y=9e-3, normal_load=90e3, contact_modulus=115e9
    )
    friction = cl.friction_with_k_hat(elliptic, k_hat=0.3, static=0.45, kinetic=0.21)
    elements = {
        "line": wheelset.element,
        "cohesive": _element(wheelset.element, cohesive_table),
        "polach": _element(wheelset.element, cl.CreepForceTable.from_law(polach)),
        "elliptic": cl.ForceElement(
            elliptic, friction, table=cl.carter_griffith_table("elliptic"), radius=0.5
        ),
    }
    return {name: _model(rig, element) for name, element in elements.items()}


def _element(element: cl.ForceElement, table: cl.CreepForceTable) -> cl.ForceElement:
    return cl.ForceElement(
        element.contact,
        element.friction,
        table=table,
        radius=element.radius,
        slope_reduction=element.slope_reduction,
    )


def _model(rig: cl.Model, element: cl.ForceElement) -> cl.Model:
    wheelset = cl.Wheelset(
        element,
        inertia=250.0,
        mass=2e4,
        damping=50.0,
        resistance=cl.Resistance(constant=1800.0, linear=66.0, quadratic=3.1, grade=0.01),
    )
    return cl.Model(
        name=rig.name,
        source=rig.source,
        wheelset=wheelset,
        torque_control=rig.torque_control,
        creep_control=rig.creep_control,
        initial_speed=10.0,
    )


def random_points(description: Description, count: int, seed: int) -> Iterator[dict[str, float]]:
    """Start values all over both branches, in traction and braking, at speeds from zero on."""
    rng = np.random.default_rng(seed)
    element = description.model.wheelset.element
    ratio = element.friction.ratio

    def sign() -> float:
        return float(rng.choice([-1.0, 1.0]))

    for i in range(count):
        speed = 0.0 if i % 8 == 0 else sign() * 10 ** rng.uniform(-2.0, 1.7)
        at_rest = 0.5 * element.minimum_speed
        creepage = element.saturation_creepage * sign() * 10 ** rng.uniform(-1.5, 1.0)
        point = {
            "omega": (speed + max(abs(speed), at_rest) * creepage) / element.radius,
            "speed": speed,
            "normal_load": element.contact.normal_load * rng.uniform(0.3, 2.0),
            "friction_scale": rng.uniform(0.5, 1.2),
            "slip_rate_residual": rng.uniform(0.3, 0.9),
            "slip_rate_decay": rng.uniform(0.1, 0.8),
            "relaxed_creepage": element.saturation_creepage * sign() * 10 ** rng.uniform(-1.5, 1.0),
            "drive_torque": rng.uniform(-3e4, 3e4),
            "resistance_force": rng.uniform(-1e3, 1e3),
            "weakening_length": element.friction.weakening_length * rng.uniform(0.5, 1.5),
            "creep_force": rng.uniform(-4e4, 4e4),
            "static_friction": 0.4 * ratio,
            "kinetic_friction": 0.4,
        }
        known = description.start_values
        yield {name: value for name, value in point.items() if name in known}


def difference_quotient(
    model: kernel.NativeModel, unknowns: list[str], name: str, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of the unknowns by Richardson's extrapolation, and how far its last two differ."""
    middle = model.get(name)[0]

    def at(value: float) -> np.ndarray:
        model.set(**{name: value})
        model.evaluate()
        return np.array(model.get(*unknowns))

    rows = []
    for h in step * 0.5 ** np.arange(4):
        rows.append((at(middle + h) - at(middle - h)) / (2.0 * h))
    at(middle)
    for order in (4.0, 16.0):
        rows = [(order * b - a) / (order - 1.0) for a, b in pairwise(rows)]
    return rows[-1], np.abs(rows[-1] - rows[-2])


def room_of(model: kernel.NativeModel, name: str) -> float:
    """How far a variable can be changed before something passes zero."""
    size = abs(model.get(name)[0])
    if name not in ("omega", "speed", "radius"):
        return size or 1.0
    omega, speed, radius = model.get("omega", "speed", "radius")
    slip = abs(radius * omega - speed)
    rooms = {"omega": slip / radius, "speed": slip, "radius": slip / abs(omega or 1.0)}
    return float(min(max(size, 0.02), rooms[name]))


@pytest.mark.parametrize("law", ["line", "elliptic", "cohesive", "polach"])
@pytest.mark.parametrize("relaxed", [False, True])
@pytest.mark.parametrize("kind", kernel.MODEL_KINDS)
def test_tangent_is_the_derivative(
    models: dict[str, cl.Model], kind: str, relaxed: bool, law: str
) -> None:
    if kind == "wheelset_body" and (relaxed or law != "line"):
        return
    description = Description(models[law], kind, relaxation_length=SIGMA if relaxed else 0.0)
    unknowns = [
        v.name for v in description.of_role("output", "derivative", "indicator") if not v.boolean
    ]
    knowns = [v for v in description.of_role(*kernel.GIVEN) if not v.boolean]
    branches, compared, unclear = set(), 0, 0
    for point in random_points(description, 16, seed=3):
        model = native(description, **point)
        if description.has_contact:
            branches.add(model.get("falling_branch")[0])
        values = np.abs(model.get(*unknowns))
        for known in knowns:
            scale = room_of(model, known.name)
            found, doubt = difference_quotient(model, unknowns, known.name, 2e-3 * scale)
            exact = np.array(model.tangent(unknowns, {known.name: 1.0}))
            allowed = 1e-6 * np.maximum(np.abs(exact), values / scale) + 1e-12
            clear = doubt < 0.3 * allowed  # else a kink or rounding is in the way
            compared += int(clear.sum())
            unclear += int((~clear).sum())
            wrong = clear & (np.abs(found - exact) > allowed)
            assert not wrong.any(), (known.name, np.array(unknowns)[wrong], point)
    assert unclear < 0.05 * compared
    if description.has_contact and law != "polach":
        assert branches == {0.0, 1.0}


@pytest.mark.parametrize("law", ["line", "polach"])
@pytest.mark.parametrize("relaxed", [False, True])
@pytest.mark.parametrize("kind", kernel.MODEL_KINDS)
def test_declared_dependencies_are_those_that_there_are(
    models: dict[str, cl.Model], kind: str, relaxed: bool, law: str
) -> None:
    if kind == "wheelset_body" and relaxed:
        return
    description = Description(models[law], kind, relaxation_length=SIGMA if relaxed else 0.0)
    unknowns = [
        v for v in description.of_role("output", "derivative", "indicator") if not v.boolean
    ]
    names = [v.name for v in unknowns]
    found: dict[str, set[str]] = {name: set() for name in names}
    for point in random_points(description, 60, seed=8):
        model = native(description, **point)
        for known in description.of_role(*kernel.GIVEN):
            changes = model.tangent(names, {known.name: 1.0})
            for name, change in zip(names, changes, strict=True):
                if change != 0.0:
                    found[name].add(known.name)
    for unknown in description.unknowns(unknowns, initial=True):
        # Truth values, which choose what the hint is, have no derivative.
        declared = {n for n in unknown.dependencies if not description.by_name[n].boolean}
        # Polach's force never comes near the bound that static friction is; a measured one may.
        spare = {"static_friction"} if law == "polach" else set()
        there = found[unknown.variable.name]
        assert there <= declared <= there | spare, unknown.variable.name


# ---- relaxation ---------------------------------------------------------------------------------


def test_relaxation_over_a_step_is_exact(rig: cl.Model) -> None:
    description = Description(rig, "force_element", relaxation_length=SIGMA)
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
        Description(rig, "force_element", relaxation_length=SIGMA), omega=omega, speed=speed
    )
    model.advance(SIGMA / speed)
    whole = float(rig.wheelset.element.force(omega=omega, speed=speed))
    assert model.get("creep_force")[0] / whole == pytest.approx(1.0 - np.exp(-1.0), rel=1e-4)


@pytest.mark.parametrize("creepage", [-0.5, -0.01, 0.012, 0.03, 3.0])
def test_relaxed_force_comes_to_that_of_the_element(rig: cl.Model, creepage: float) -> None:
    element, speed = rig.wheelset.element, 2.0
    omega = (1.0 + creepage) * speed / element.radius
    model = native(
        Description(rig, "force_element", relaxation_length=SIGMA), omega=omega, speed=speed
    )
    model.advance(1.0)
    expected = float(element.force(omega=omega, speed=speed))
    assert model.get("creep_force")[0] == pytest.approx(expected, rel=1e-9)


def test_relaxed_wheel_holds_its_force_at_standstill(rig: cl.Model) -> None:
    description = Description(rig, "force_element", relaxation_length=SIGMA)
    model = native(description, omega=0.0, speed=0.0, relaxed_creepage=0.01)
    before = model.get("creep_force", "relaxed_creepage")
    model.advance(100.0)
    assert model.get("creep_force", "relaxed_creepage") == before
    assert before[0] > 0.9 * rig.wheelset.element.friction.kinetic * 220e3


def test_wheel_that_spins_at_standstill_winds_up_no_spring(rig: cl.Model) -> None:
    # Turned back, it must give its force up within microns, however long it span.
    description = Description(rig, "force_element", relaxation_length=SIGMA)
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
    # An inexact Jacobian would ask for more substeps than there may be.
    description = Description(rig, "wheelset", relaxation_length=SIGMA)
    model = native(
        description, omega=omega, speed=0.0, normal_load=load, drive_torque=torque, damping=0.0
    )
    model.advance(0.5)
    away = 0.5 * rig.wheelset.element.friction.static * load / rig.wheelset.inertia
    expected = omega + 0.5 * torque / rig.wheelset.inertia
    assert model.get("omega")[0] == pytest.approx(expected, abs=0.5 * away + 1e-6)


# ---- wheelset -----------------------------------------------------------------------------------


@pytest.mark.parametrize("relaxed", [False, True])
def test_wheelset_is_integrated_with_third_order(locomotive: cl.Model, relaxed: bool) -> None:
    description = Description(locomotive, "wheelset", relaxation_length=SIGMA if relaxed else 0.0)
    (radius,) = (locomotive.wheelset.radius,)

    def slip(steps: int) -> float:
        model = native(description, drive_torque=26e3, omega=20.1)
        for _ in range(steps):
            model.advance(0.02 / steps, tolerance=1e9)  # each step in one
        omega, speed = model.get("omega", "speed")
        return radius * omega - speed

    steps = np.array([40, 80, 160, 320])
    exact = slip(20480)
    errors = [abs(slip(n) - exact) for n in steps.tolist()]
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order > 2.75


@pytest.mark.parametrize("step", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("torque", [20e3, 26e3, 30e3])
def test_wheelset_moves_as_the_stiff_solver_says(
    locomotive: cl.Model, torque: float, step: float
) -> None:
    # From the rising branch, close below the peak, and in a run-away.
    wheelset = locomotive.wheelset
    control = cl.TorqueControl(cl.Profile.of(torque))
    exact = cl.simulate(
        wheelset, control, duration=2.0, initial_speed=3.0, initial_creepage=0.0, tolerance=1e-11
    )
    description = Description(locomotive, "wheelset")
    model = native(description, drive_torque=torque, omega=3.0 / wheelset.radius, speed=3.0)
    for _ in range(round(2.0 / step)):
        model.advance(step, tolerance=1e-8)
    omega, speed = model.get("omega", "speed")
    assert omega == pytest.approx(exact["omega"][-1], rel=1e-6)
    assert speed == pytest.approx(exact["speed"][-1], rel=1e-6)


@pytest.mark.parametrize(
    ("speed", "relaxed"),
    # With relaxation a wheel at rest is a mass on a spring, which nothing damps.
    [(0.0, False), (0.01, False), (1.0, False), (100.0, False), (1.0, True), (100.0, True)],
)
def test_wheelset_takes_any_step_at_any_speed(rig: cl.Model, speed: float, relaxed: bool) -> None:
    # L-stable: however stiff, a long step ends where the slip is at rest.
    description = Description(rig, "wheelset", relaxation_length=SIGMA if relaxed else 0.0)
    model = native(description, drive_torque=9e3, speed=speed, omega=1.001 * speed / 0.5)
    for _ in range(3):
        model.advance(10.0)
    (rate,) = model.get("der(omega)")
    assert abs(rate) < 1e-6 * 9e3 / rig.wheelset.inertia


# ---- coupling -----------------------------------------------------------------------------------


def coupled(
    model: cl.Model,
    *,
    speed: float,
    torque: float | Callable[[float], float],
    step: float | Callable[[int], float],
    count: int,
    creepage: float = 0.0,
    mass_factor: float = 1.0,
    relaxed: bool = False,
    implicit: bool = True,
    parallel: bool = False,
) -> np.ndarray:
    """Slip velocity and force of a body and the force element that exchange step by step."""
    wheelset = model.wheelset
    description = Description(
        model,
        "force_element",
        relaxation_length=SIGMA if relaxed else 0.0,
        implicit=implicit,
        parallel_exchange=parallel,
    )
    omega = (1.0 + creepage) * speed / wheelset.radius
    start = {"omega": omega, "speed": speed, "relaxed_creepage": creepage if relaxed else 0.0}
    inverse_mass = mass_factor * description.start_values["effective_inverse_mass"]
    element = native(description, **start, effective_inverse_mass=inverse_mass)
    (force,) = element.get("creep_force")
    rows, time = [], 0.0
    for i in range(count):
        before = force
        length = step(i) if callable(step) else step
        drive = torque(time) if callable(torque) else torque
        element.set(omega=omega, speed=speed)
        element.evaluate()
        if not (implicit or relaxed):
            (force,) = element.get("creep_force")
        element.advance(length)
        if implicit or relaxed:
            (force,) = element.get("creep_force")
        rows.append((wheelset.radius * omega - speed, force))
        contact = kernel.contact_with_force(before if parallel else force)
        rates = wheelset.native.motion(omega, speed, drive, 0.0, contact)
        omega, speed = omega + length * rates.omega_rate, speed + length * rates.speed_rate
        time += length
    return np.array(rows)


def settles(run: np.ndarray) -> bool:
    """Whether the force comes to rest."""
    tail = run[-len(run) // 10 :, 1]
    return bool(np.ptp(tail) < 1e-3 * abs(tail.mean()))


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("speed", [0.01, 0.1, 1.0, 10.0])
def test_implicit_steps_are_stable_at_any_speed(
    rig: cl.Model, speed: float, parallel: bool
) -> None:
    for step in (1e-3, 1e-2):
        run = coupled(rig, speed=speed, torque=20e3, step=step, count=2000, parallel=parallel)
        assert settles(run)
        # Where the wheel's own balance is: T = r Q + b omega.
        balance = 20e3 - 0.5 * run[-1, 1] - 50.0 * (run[-1, 0] + speed) / 0.5
        assert abs(balance) < 1e-6 * 20e3


def test_held_steps_are_not(rig: cl.Model) -> None:
    assert settles(coupled(rig, speed=10.0, torque=20e3, step=1e-3, count=500, implicit=False))
    assert not settles(coupled(rig, speed=1.0, torque=20e3, step=1e-3, count=500, implicit=False))


@pytest.mark.parametrize(
    ("parallel", "stable", "unstable"),
    [(False, (0.78, 1.0, 10.0), (0.72,)), (True, (0.83, 1.0, 1.2), (0.77, 1.3))],
)
def test_implicit_steps_need_the_inverse_mass_this_well(
    rig: cl.Model, parallel: bool, stable: tuple[float, ...], unstable: tuple[float, ...]
) -> None:
    # In the stiff limit: above 3/4 of the true one; between 4/5 and 5/4 if both step at once.
    for factor in stable + unstable:
        run = coupled(
            rig,
            speed=0.01,
            torque=9e3,
            step=1e-2,
            count=2000,
            mass_factor=factor,
            parallel=parallel,
        )
        assert settles(run) == (factor in stable), factor


@pytest.mark.parametrize(
    ("parallel", "growth", "stable"),
    [(False, 100.0, True), (True, 2.0, True), (True, 3.5, False)],
)
def test_implicit_steps_may_grow_this_much(
    rig: cl.Model, parallel: bool, growth: float, stable: bool
) -> None:
    # A parallel force is made for as long a step as the last; what slip there was is multiplied
    # by 1 - growth in the stiff limit, and by 1 - 1/growth in the shorter step that follows.
    run = coupled(
        rig,
        speed=0.01,
        torque=9e3,
        step=lambda i: 1e-2 if i % 2 else 1e-2 / growth,
        count=2000,
        parallel=parallel,
    )
    assert settles(run) == stable


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("step", [1e-9, 1e-3])
@pytest.mark.parametrize("load", [1e-60, 1e-9, 1e-3])
def test_implicit_force_stays_below_static_friction_at_any_load(
    rig: cl.Model, load: float, step: float, parallel: bool
) -> None:
    # It is a small difference of momenta, whose rounding may be larger than a small load.
    description = Description(rig, "force_element", implicit=True, parallel_exchange=parallel)
    model = native(description, omega=1020.0, normal_load=load)
    for i in range(20):
        model.set(omega=1020.0 + 100.0 * np.sin(i))
        model.evaluate()
        model.advance(step)
        force, coefficient = model.get("creep_force", "traction_coefficient")
        most = rig.wheelset.element.friction.static * (1.0 + 1e-12)
        assert abs(coefficient) <= most
        assert abs(force) <= most * load


@pytest.mark.parametrize("parallel", [False, True])
def test_implicit_exchange_converges_with_first_order(locomotive: cl.Model, parallel: bool) -> None:
    # Up a ramp of torque, so that what drives the slip changes.
    wheelset, duration = locomotive.wheelset, 0.4
    ramp = cl.Profile((0.0, duration), (15e3, 25e3))
    exact = cl.simulate(
        wheelset,
        cl.TorqueControl(ramp),
        initial_speed=10.0,
        initial_creepage=0.006,
        tolerance=1e-11,
    )
    end = wheelset.radius * exact["omega"][-1] - exact["speed"][-1]
    counts = np.array([1000, 2000, 4000])
    errors = []
    for n in counts.tolist():
        run = coupled(
            locomotive,
            speed=10.0,
            creepage=0.006,
            torque=lambda time: 15e3 + 25e3 * time,
            step=duration / n,
            count=n + 1,
            parallel=parallel,
        )
        errors.append(abs(run[-1, 0] - end))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("relaxed", [False, True])
def test_twice_the_hint_is_the_stable_step(rig: cl.Model, parallel: bool, relaxed: bool) -> None:
    speed, creepage = 2.0, 0.002
    point = rig.wheelset.balanced(creepage=creepage, speed=speed)
    description = Description(
        rig,
        "force_element",
        relaxation_length=SIGMA if relaxed else 0.0,
        parallel_exchange=parallel,
    )
    at = {"omega": point.omega, "speed": speed, "relaxed_creepage": creepage if relaxed else 0.0}
    model = native(description, **at)
    limit = 2.0 * model.get("step_size_hint")[0]
    pole = model.get("force_gradient")[0] * rig.wheelset.radius**2 / rig.wheelset.inertia

    def grows(step: float) -> bool:
        run = coupled(
            rig,
            speed=speed,
            torque=point.drive_torque,
            step=step,
            count=2000,
            creepage=creepage * (1.0 + 1e-6),
            implicit=False,
            parallel=parallel,
            relaxed=relaxed,
        )
        away = np.abs(run[:, 0] - creepage * speed)
        return bool(away[-40:].max() > 10.0 * away[0])

    assert not grows(0.97 * limit)
    if relaxed and not parallel:
        # The hint is on the safe side of h pole tanh(V h / (2 sigma)) = 2.
        steps = np.linspace(limit, 3.0 * limit, 20001)
        exact = steps[np.argmax(steps * pole * np.tanh(speed * steps / (2.0 * SIGMA)) > 2.0)]
        assert not grows(0.97 * exact)
        limit = float(exact)
    assert grows(1.05 * limit)
