"""Wheelsets with a motor, an axle and two wheels, stepped by the kernel."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from brake_pads import held_by
from scipy.integrate import cumulative_simpson, solve_ivp

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.vehicle import Axle, Brake, Drivetrain, Motor

FILL = 0.1
BRAKE = Brake(fill_time=FILL, vent_time=0.05)
PADS = dataclasses.replace(  # friction 1.2 - 0.02 u - 0.3 p + 0.01 u p of u in m/s and p in bar
    BRAKE,
    pressure=1e5,
    torque=1.2e5,
    pad_speed=(0.0, 40.0, 40.0, 0.0),
    pad_pressure=(0.0, 1e5, 0.0, 1e5),
    pad_friction=(1.2, 0.5, 0.4, 0.9),
)
STEEP = dataclasses.replace(PADS, torque=3e4, pad_speed=(7.0, 8.5, 8.5, 7.0))
AXLE = Axle(stiffness=6.0e6, damping=500.0, drive_share=0.3)
SHAFT = Motor(rotor_inertia=7.5, gear_ratio=4.0, shaft_stiffness=1.5e6, shaft_damping=200.0)
SPLIT = {"friction_left": 1.0, "friction_right": 0.6, "load_left": 1.2e5, "load_right": 1.0e5}
EVEN = {"friction_left": 0.9, "friction_right": 0.9, "load_left": 1.1e5, "load_right": 1.1e5}


def made_rows(kind: str, count: int, **values: Any) -> Any:
    """States or inputs of drivetrains: zero but for these values, and a slope of 1."""
    rows = np.zeros(count, kernel.drivetrain_dtype(kind))
    for name, value in (values if kind == "state" else {"slope": 1.0, **values}).items():
        rows[name] = value
    return rows


def rolling(count: int, speed: Any, omega: Any) -> Any:
    omegas = dict.fromkeys(("omega_left", "omega_right", "motor_omega"), omega)
    return made_rows("state", count, speed=speed, **omegas)


class Steps(NamedTuple):
    """What a run of steps went through."""

    time: FloatArray
    states: Any
    outputs: Any

    @property
    def energy_defect(self) -> FloatArray:
        s, stored = self.states, self.outputs["stored_energy"]
        works = s["creep_work"] + s["resistance_work"] + s["loss_work"]
        return np.asarray(s["drive_work"] - (stored - stored[0]) - works)


def drive(
    train: Drivetrain,
    torque: Callable[[float], float],
    *,
    speed: float,
    creepage: float = 0.0,
    duration: float,
    step: float = 1e-3,
    tolerance: float = 1e-8,
    pads: float = 0.0,
    **held: float,
) -> Steps:
    """Step one drivetrain; the torque of each step is that of its middle."""
    state = rolling(1, speed, (1.0 + creepage) * speed / train.wheelset.radius)
    state["pads_left"] = state["pads_right"] = pads
    given = made_rows("input", 1, **held)
    steps, substep = round(duration / step), np.zeros(1)
    states, inputs = [], []
    for i in range(steps + 1):
        given["commanded_torque"] = torque((i + 0.5) * step)
        states.append(state.copy())
        inputs.append(given.copy())
        if i < steps:
            train.native.advance(given, state, i * step, step, tolerance, substep)
    gone = np.concatenate(states)
    return Steps(
        step * np.arange(steps + 1, dtype=np.float64),
        gone,
        train.native.evaluate(np.concatenate(inputs), gone),
    )


def written_again(
    train: Drivetrain,
    torque: float,
    *,
    speed: float,
    creepage: float,
    duration: float,
    acceleration: float = 0.0,
    **held: float,
) -> FloatArray:
    """End of a run by another solver, from the equations as a textbook has them."""
    body, axle = train.wheelset, train.axle
    rotor = 0.0 if train.motor.rotor_inertia is None else 4.0**2 * 7.5
    r, half_j, half_b = body.radius, 0.5 * (body.inertia - rotor), 0.5 * body.damping
    contact = kernel.NativeForceElement(
        body.element.table.native,
        body.element.rolling_parameters,
    )
    sides = ("left", "right")

    def rates(_: float, y: FloatArray) -> list[float]:
        v, left, right, twist, turning, turned, *memory = y[:12].tolist()
        motor, pressure, pads_left, pads_right = y[12:].tolist()
        if train.motor.lag == 0.0:
            motor = torque
        share = 1.0 if axle is None else axle.drive_share
        ahead = turning - share * left - (1.0 - share) * right
        driven = 1.5e6 * turned + 200.0 * ahead if rotor else motor  # through the shaft
        given = np.zeros(2, kernel.struct_dtype("force_element_input"))
        given["omega"], given["speed"] = (left, right), v
        given["normal_load"] = [2.0 * held[f"load_{side}"] for side in sides]
        given["friction_scale"] = [held[f"friction_{side}"] for side in sides]
        given["held_force"], given["unslipped"] = memory[:2], memory[2:4]
        given["outer_force"] = memory[4:]
        out = contact.evaluate(given)
        q_left, q_right = (0.5 * out["creep_force"]).tolist()
        pads = held_by(pads_left, r * left), held_by(pads_right, r * right)
        rubbing = [1.0, 1.0]
        if train.brake is PADS:
            bar, rim = pressure / 1.2e5, (r * abs(left), r * abs(right))
            rubbing = [1.2 - 0.02 * u - 0.3 * bar + 0.01 * u * bar for u in rim]
        braking = [pressure * mu * part for mu, (part, _) in zip(rubbing, pads, strict=True)]
        davis = body.resistance
        pull = davis.constant * np.sign(v) + davis.linear * v + davis.quadratic * v * abs(v)
        dv = acceleration if body.mass is None else (q_left + q_right - pull) / body.mass
        if axle is None:
            both = driven - braking[0] - r * (q_left + q_right) - 2.0 * half_b * left
            both /= 2.0 * half_j
            dleft, dright, dtwist = both, both, 0.0
        else:
            through = axle.stiffness * twist + axle.damping * (left - right)
            torque_left = share * driven - 0.5 * braking[0]  # the gear does not split the brake
            torque_right = (1.0 - share) * driven - 0.5 * braking[1]
            dleft = (torque_left - r * q_left - half_b * left - through) / half_j
            dright = (torque_right - r * q_right - half_b * right + through) / half_j
            dtwist = left - right
        lag = (torque - motor) / train.motor.lag if train.motor.lag else 0.0
        return [
            dv,
            dleft,
            dright,
            dtwist,
            (motor - driven) / rotor if rotor else 0.0,
            ahead if rotor else 0.0,
            *out["held_rate"].tolist(),
            *out["unslipped_rate"].tolist(),
            *out["outer_rate"].tolist(),
            lag,
            0.0 if train.brake is None else (held["commanded_brake"] - pressure) / FILL,
            *(rate if train.brake else 0.0 for _, rate in pads),
        ]

    omega = (1.0 + creepage) * speed / r
    start = [speed, omega, omega, 0.0, omega, *[0.0] * 11]
    solution: Any = solve_ivp(rates, (0.0, duration), start, method="LSODA", rtol=1e-9, atol=1e-12)
    assert solution.success
    return np.asarray(solution.y[:, -1])


MEMORY = ("held_force", "unslipped", "outer_force")  # states of each contact with memory
VARIANTS = {
    "rigid": ({}, EVEN),
    "rigid, split": ({}, SPLIT),
    "motor": ({"motor": Motor(lag=0.03)}, EVEN),
    "elastic": ({"axle": AXLE}, SPLIT),
    "elastic, motor": ({"axle": AXLE, "motor": Motor(lag=0.03)}, SPLIT),
    "brake": ({"brake": BRAKE, "motor": Motor(lag=0.03)}, {**SPLIT, "commanded_brake": 6e4}),
    "elastic, brake": ({"axle": AXLE, "brake": BRAKE}, {**EVEN, "commanded_brake": 6e4}),
    "memory": ({}, SPLIT),
    "memory, all": ({"axle": AXLE, "motor": dataclasses.replace(SHAFT, lag=0.03)}, SPLIT),
    "pads": ({"brake": PADS, "motor": Motor(lag=0.03)}, {**SPLIT, "commanded_brake": 6e4}),
    "elastic, pads": ({"axle": AXLE, "brake": PADS}, {**EVEN, "commanded_brake": 8e4}),
    "shaft, brake": ({"brake": BRAKE, "motor": SHAFT}, {**SPLIT, "commanded_brake": 4e3}),
}


def remembering(body: cl.Wheelset, variant: str) -> cl.Wheelset:
    """The wheelset, with memory in the variants that are called so."""
    memory = variant.startswith("memory")
    return dataclasses.replace(body, element=dataclasses.replace(body.element, memory=memory))


@pytest.mark.parametrize(
    ("variant", "held_speed"),
    [
        pytest.param(variant, held, marks=[pytest.mark.slow] if (i + held) % 2 else [])
        for i, variant in enumerate(VARIANTS)
        for held in (False, True)
    ],
)
def test_steps_are_the_equations_of_motion(
    rig: cl.Model, locomotive: cl.Model, variant: str, held_speed: bool
) -> None:
    options, held = VARIANTS[variant]
    body = remembering(rig.wheelset if held_speed else locomotive.wheelset, variant)
    train = Drivetrain(body, **options)  # type: ignore[arg-type]
    if held_speed:
        held = {**held, "acceleration": 0.7}
    # More torque than the contact holds: the run passes the peak and slips away.
    start = {"speed": 8.0, "creepage": 0.005}
    run = drive(train, lambda t: 2.6e4, duration=0.4, **start, **held)
    exact = written_again(train, 2.6e4, duration=0.4, **start, **held)
    end = run.states[-1]
    names = ["speed", "omega_left", "omega_right", "twist", "motor_omega", "shaft_twist"]
    names += [f"{name}_{side}" for name in MEMORY for side in ("left", "right")]
    for name, value in zip(names, exact, strict=False):
        if name.startswith(MEMORY) and not body.element.memory:
            continue
        assert end[name] == pytest.approx(value, rel=2e-6, abs=1e-9), name
    assert np.abs(run.outputs["creepage_left"]).max() > 0.03  # far beyond the peak


@pytest.mark.parametrize("variant", VARIANTS)
def test_works_are_the_integrals_of_powers(locomotive: cl.Model, variant: str) -> None:
    options, held = VARIANTS[variant]
    train = Drivetrain(remembering(locomotive.wheelset, variant), **options)  # type: ignore[arg-type]
    run = drive(train, lambda t: 2.6e4, speed=8.0, creepage=0.005, duration=0.4, step=2e-4, **held)
    s, out = run.states, run.outputs
    body, axle = train.wheelset, train.axle
    share = 0.5 if axle is None else AXLE.drive_share
    torque, left, right = out["drive_torque"], s["omega_left"], s["omega_right"]
    mean = share * left + (1.0 - share) * right
    ahead = s["motor_omega"] - mean if train.motor.rotor_inertia else 0.0 * left
    motor = s["drive_torque"] if train.motor.lag else np.full(left.shape, 2.6e4)
    davis = body.resistance
    pull = davis.constant + davis.linear * s["speed"] + davis.quadratic * s["speed"] ** 2
    powers = {
        "distance": s["speed"],
        "drive_work": torque * mean + motor * ahead,
        "creep_work": out["creep_force_left"] * (body.radius * left - s["speed"])
        + out["creep_force_right"] * (body.radius * right - s["speed"]),
        "resistance_work": pull * s["speed"],
        "loss_work": 0.5 * body.damping * (left**2 + right**2)
        + (0.0 if axle is None else axle.damping * (left - right) ** 2)
        + train.motor.shaft_damping * ahead**2,
    }
    for name, power in powers.items():
        work = cumulative_simpson(power, x=run.time, initial=0.0)
        np.testing.assert_allclose(s[name], work, rtol=1e-4, atol=1e-5 * np.abs(work).max())
    assert np.abs(run.energy_defect).max() < 1e-9 * np.abs(s["drive_work"]).max()


@pytest.mark.parametrize(
    ("options", "torque", "known"),
    [
        ({"motor": SHAFT}, 2e4, "omega_left twist shaft_twist drive_work creep_work loss_work"),
        ({"brake": STEEP}, 0.0, "brake_torque drive_work creep_work"),
    ],
)
def test_third_order(
    locomotive: cl.Model, options: dict[str, Any], torque: float, known: str
) -> None:
    """The order falls to one where the Jacobian is not exact."""
    train, names = Drivetrain(locomotive.wheelset, axle=AXLE, **options), known.split()
    held = {**SPLIT, "commanded_brake": 1.5e4, "pads": 1.0}

    def end(step: float) -> FloatArray:
        run = drive(
            train, lambda t: torque, speed=8.0, duration=0.08, step=step, tolerance=1e9, **held
        )
        return np.array([run.states[n][-1] for n in names])

    exact = end(1e-5)
    errors = np.array([np.abs(end(h) - exact) for h in (2e-4, 1e-4, 5e-5)])
    orders = np.log2(errors[:-1] / errors[1:])
    np.testing.assert_allclose(orders[:, : len(names) // 2], 3.0, atol=0.15)
    assert (orders > 2.8).all()


def test_a_stiff_shaft_is_one_mass(locomotive: cl.Model) -> None:
    """To the second order in the period, under a torque that rises smoothly."""
    ends = []
    for k in (1e7, 4e7, 1.6e8, None):
        motor = Motor() if k is None else dataclasses.replace(SHAFT, shaft_stiffness=k)
        train, when = Drivetrain(locomotive.wheelset, motor=motor), {"speed": 8.0, "duration": 0.2}
        run = drive(train, lambda t: 1e4 * (1.0 - float(np.cos(np.pi * t / 0.2))), **when, **EVEN)
        ends.append([run.states[n][-1] for n in ("speed", "omega_left", "creep_work")])
    errors = np.abs(np.subtract(ends[:-1], ends[-1]))
    np.testing.assert_allclose(errors[:-1] / errors[1:], 4.0, rtol=0.1)


def test_sides_change_places_and_signs_turn(locomotive: cl.Model) -> None:
    train = Drivetrain(locomotive.wheelset, axle=AXLE)
    mirrored = Drivetrain(
        locomotive.wheelset,
        axle=dataclasses.replace(AXLE, drive_share=1.0 - AXLE.drive_share),
    )
    other_side = {
        "friction_left": SPLIT["friction_right"],
        "friction_right": SPLIT["friction_left"],
        "load_left": SPLIT["load_right"],
        "load_right": SPLIT["load_left"],
    }
    run = drive(train, lambda t: 2.4e4, speed=8.0, duration=0.3, **SPLIT)
    turned = drive(mirrored, lambda t: 2.4e4, speed=8.0, duration=0.3, **other_side)
    np.testing.assert_allclose(run.states["omega_left"], turned.states["omega_right"], rtol=1e-11)
    np.testing.assert_allclose(run.states["twist"], -turned.states["twist"], atol=1e-13)
    back = drive(train, lambda t: -2.4e4, speed=-8.0, duration=0.3, **SPLIT)
    for name in ("speed", "omega_left", "twist", "distance"):
        assert np.array_equal(back.states[name], -run.states[name]), name
    assert np.array_equal(back.states["creep_work"], run.states["creep_work"])


@pytest.mark.parametrize("slope", [0.29, 1.7])
def test_slope_stretches_the_creepage_axis(locomotive: cl.Model, slope: float) -> None:
    """Force at zeta/slope under the slope is that at zeta without it; the peak moves so as well."""
    train = Drivetrain(locomotive.wheelset)
    zeta = np.linspace(-0.2, 0.2, 801)
    forces = {}
    for factor in (1.0, slope):
        inputs = made_rows("input", zeta.size, **SPLIT, slope=factor)
        states = rolling(zeta.size, 10.0, 10.0 * (1.0 + zeta / factor) / train.wheelset.radius)
        out = kernel.NativeFleet([train.member()] * zeta.size).evaluate(inputs, states)
        forces[factor] = out["creep_force_left"] + out["creep_force_right"]
    largest = np.abs(forces[1.0]).max()
    np.testing.assert_allclose(forces[slope], forces[1.0], rtol=1e-11, atol=1e-11 * largest)


def test_many_are_one_by_one(locomotive: cl.Model) -> None:
    train = Drivetrain(locomotive.wheelset, axle=AXLE, motor=Motor(lag=0.02))
    rng = np.random.default_rng(5)
    n = 20
    speed = rng.uniform(-1.0, 30.0, n)
    states = rolling(n, speed, speed / 0.5)
    states["omega_left"] *= rng.uniform(0.98, 1.05, n)
    inputs = made_rows("input", n, commanded_torque=rng.uniform(-3e4, 3e4, n))
    for side in ("left", "right"):
        inputs[f"load_{side}"] = rng.uniform(0.0, 1.3e5, n)
        inputs[f"friction_{side}"] = rng.uniform(0.2, 1.2, n)
    inputs["slope"] = rng.uniform(0.2, 1.2, n)
    states["speed"][0], states["omega_left"][0], states["omega_right"][0] = 0.0, -0.0, 0.0
    together, substeps = states.copy(), np.zeros(n)
    fleet = kernel.NativeFleet([train.member()] * n)
    for _ in range(50):
        fleet.advance(inputs, together, 0.0, 2e-3, 1e-7, substeps)
    for i in range(n):
        single, substep = states[i : i + 1].copy(), np.zeros(1)
        for _ in range(50):
            train.native.advance(inputs[i : i + 1].copy(), single, 0.0, 2e-3, 1e-7, substep)
        assert single[0] == together[i]


def test_a_failed_step_leaves_the_state(locomotive: cl.Model) -> None:
    train = Drivetrain(locomotive.wheelset)
    states = rolling(2, 10.0, 20.1)
    inputs = made_rows("input", 2, **EVEN, commanded_torque=(0.0, np.nan))
    before = states.copy()
    fleet = kernel.NativeFleet([train.member()] * 2)
    with pytest.raises(RuntimeError, match=r"drivetrain 1: the tolerance is not met"):
        fleet.advance(inputs, states, 0.0, 1e-3, 1e-6, np.zeros(2))
    assert states[1] == before[1]
    assert states[0] != before[0]
