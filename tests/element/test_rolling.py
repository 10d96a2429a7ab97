"""Rolling that is not steady, against half-spaces whose particles are followed."""

import functools
import itertools
import math
import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from transient_rolling import GRIDS, history
from transient_rolling import contact as reference_contact

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.kernel.library import ffi, library, struct_dtype

KINETIC, LOAD = 0.3, 80e3
OUTER_STIFFNESS, OUTER_STRENGTH = 0.3774, 0.1567  # of the zone that slips first, see memory.h
COARSE = (16, 32)  # the reference's grids here; see test_a_finer_reference_gives_the_same_errors


@functools.cache
def element(
    aspect: float = 1.4,
    nu: float = 0.28,
    excess: float = 0.0,
    k_hat: float = 0.0,
    layer: float = 0.0,
) -> cl.ForceElement:
    """An ellipse; `k_hat` and the ratio of the layer are those of strips, as in the reference."""
    contact = cl.EllipticContact.from_semi_axes(
        wheel_load=LOAD,
        semi_axis_x=6e-3,
        semi_axis_y=6e-3 / aspect,
        contact_modulus=1.15e11,
        poisson_ratio=nu,
    )
    drop, length = excess * KINETIC, 0.0
    if excess:
        length = math.pi * (k_hat * KINETIC) ** 2 * contact.semi_axis_x * contact.peak_pressure
        length /= contact.contact_modulus * drop
    friction = cl.Friction(static=KINETIC + drop, kinetic=KINETIC, weakening_length=length)
    table = cl.carter_griffith_table("elliptic")
    with warnings.catch_warnings():  # the weakening zone is long; see test_weakening_friction
        warnings.simplefilter("ignore")
        return cl.ForceElement(
            contact,
            friction,
            table=table,
            radius=0.46,
            memory=True,
            layer_compliance=layer * 2.0 * contact.semi_width / contact.contact_modulus,
        )


def strips_zeta0(of: cl.ForceElement) -> float:
    """zeta0 of strips, the reference's unit of creepage."""
    return 2.0 * KINETIC * of.contact.peak_pressure / of.contact.contact_modulus


def rolled(of: cl.ForceElement, s: FloatArray, x: FloatArray, speed: float = 10.0) -> FloatArray:
    distance = s * of.contact.semi_width
    force = cl.roll(of, creepage=x * strips_zeta0(of), distance=distance, speed=speed)
    return force / (KINETIC * of.contact.wheel_load)


def errors(
    x: Callable[[float], float],
    end: float,
    aspect: float,
    nu: float,
    excess: float = 0.0,
    k_hat: float = 0.0,
    layer: float = 0.0,
    line: cl.ForceElement | None = None,
    grids: tuple[int, int] = COARSE,
) -> FloatArray:
    """Errors of q at the reference's distances; a step at zero takes 1e-6 a."""
    of = line or element(aspect, nu, excess, k_hat, layer)
    s, q = history(
        x,
        end,
        a_over_b=aspect,
        poisson_ratio=nu,
        excess=excess,
        k_hat=k_hat,
        layer=layer,
        line=line is not None,
        grids=grids,
    )
    fine = np.r_[0.0, 1e-6, np.linspace(0.0, end, 40 * s.size)[1:]]
    found = rolled(of, fine, np.array([x(0.0), *map(x, fine[1:])]))
    return np.interp(s, fine, found)[1:] - q[1:]


def step(before: float, after: float) -> Callable[[float], float]:
    return lambda s: after if s > 0.0 else before


def ramp(rate: float) -> Callable[[float], float]:
    return lambda s: rate * s


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


STEPS = [(0.0, 0.3), (0.0, 1.2), (0.4, 0.8), (1.2, 0.4), (3.0, 0.0), (0.8, -0.8)]


@pytest.mark.parametrize(
    ("aspect", "nu", "layer"),
    [(1.4, 0.28, 0.0), (0.5, 0.28, 0.0), (2.0, 0.28, 0.0), (1.0, 0.5, 0.0), (1.4, 0.28, 0.4)],
)
def test_steps_of_constant_friction(aspect: float, nu: float, layer: float) -> None:
    more = 1.0 + 2.5 * layer  # a layer slides at larger creepages
    steps = [step(more * a, more * b) for a, b in STEPS]
    found = [errors(x, 5.0, aspect, nu, layer=layer) for x in steps]
    every = np.concatenate(found)
    assert rms(every) < 0.03
    assert np.abs(every).max() < 0.14


@pytest.mark.slow
@pytest.mark.parametrize(("excess", "k_hat"), [(0.0, 0.0), (4 / 7, 0.3)])
def test_a_finer_reference_gives_the_same_errors(excess: float, k_hat: float) -> None:
    for before, after in STEPS:
        coarse, fine = (
            errors(step(before, after), 5.0, 1.4, 0.28, excess, k_hat, grids=grids)
            for grids in (COARSE, GRIDS)
        )
        assert rms(coarse - fine[1::2]) < 0.002


@pytest.mark.slow
@pytest.mark.parametrize("length", [6.0, 24.0])
def test_steps_of_a_line_contact(length: float) -> None:
    contact = cl.LineContact(
        normal_load_per_length=7e6,
        radius=0.46,
        contact_modulus=1.15e11,
        poisson_ratio=0.28,
    )
    contact = replace(contact, length=length * contact.semi_width)
    friction = cl.Friction(static=KINETIC, kinetic=KINETIC, weakening_length=0.0)
    table = cl.carter_griffith_table("line")
    of = cl.ForceElement(contact, friction, table=table, radius=0.46, memory=True)
    found = [errors(step(a, b), 8.0, 2.0 / length, 0.28, line=of) for a, b in STEPS]
    assert rms(np.concatenate(found)) < 0.03
    assert np.abs(np.concatenate(found)).max() < 0.11


@pytest.mark.parametrize("rate", [0.1, 0.3, 1.0])
def test_ramps_of_constant_friction(rate: float) -> None:
    found = errors(ramp(rate), 2.0 / rate, 1.4, 0.28)
    assert rms(found) < 0.027
    assert np.abs(found).max() < 0.12


def under_load(
    of: cl.ForceElement, x: float, load: Callable[[float], float], s: FloatArray
) -> FloatArray:
    """Force over f_d times the nominal load at a constant creepage, from steady rolling."""
    parameters = {**of.parameters, **of.memory_parameters}
    table, contact = kernel.NativeForceElement(of.native_contact, parameters).structs
    now, out = ffi.new("force_element_input *"), ffi.new("force_element_output *")
    now.speed, now.friction_scale, now.normal_load = 10.0, 1.0, load(0.0) * LOAD
    now.omega = now.speed * (1.0 + x * strips_zeta0(of)) / of.radius
    library().force_element_evaluate(table, contact, now, out)
    now.memory = out.steady_force, out.sticking, out.steady_outer
    forces = [out.steady_force]
    for begin, end in itertools.pairwise(s):
        for part in (0.125, 0.375, 0.625, 0.875):
            now.normal_load = load(begin + part * (end - begin)) * LOAD
            task = ffi.new("wheelset_task *", {"contact": contact, "input": now[0]})
            task.tolerance = 1e-6
            step = 0.25 * (end - begin) * of.contact.semi_width / now.speed
            assert not library().wheelset_advance(table, task, step)
            now = ffi.new("force_element_input *", task.input)
        library().force_element_evaluate(table, contact, now, out)
        forces.append(out.creep_force)
    return np.array(forces) / (KINETIC * LOAD)


@pytest.mark.parametrize(
    ("x", "length", "rms_error"),
    [(0.4, 1.0, 0.06), (0.4, 3.0, 0.024), (0.4, 8.0, 0.008), (1.5, 3.0, 0.009), (0.1, 3.0, 0.012)],
)
def test_load_that_swings_by_thirty_percent(x: float, length: float, rms_error: float) -> None:
    """Over a length in semi-widths, under constant friction."""
    of = element()

    def load(s: float) -> float:
        return float(1.0 + 0.3 * math.cos(2.0 * math.pi * s / length)) / 1.3

    s, q = history(lambda s: x, max(2.0 * length, 4.0), grids=COARSE, load=load)
    assert rms((under_load(of, x, load, s) - q)[1:]) < rms_error


@pytest.mark.parametrize(("before", "after", "rms_error"), [(1.0, 0.6, 0.011), (0.6, 1.0, 0.016)])
def test_step_of_the_load(before: float, after: float, rms_error: float) -> None:
    of = element()

    def load(s: float) -> float:
        return before if s <= 0.0 else after

    s, q = history(lambda s: 0.4, 4.0, grids=COARSE, load=load)
    assert rms((under_load(of, 0.4, load, s) - q)[1:]) < rms_error


@pytest.mark.slow
@pytest.mark.parametrize("excess", [4 / 7, 8 / 7])
def test_weakening_friction(excess: float) -> None:
    """Part of the error is that of the steady law, whose weakening zone is not short here."""
    steps = np.concatenate([errors(step(a, b), 5.0, 1.4, 0.28, excess, 0.3) for a, b in STEPS])
    assert rms(steps) < 0.045
    assert np.abs(steps).max() < 0.2
    ramps = np.concatenate(
        [errors(ramp(r), 2.0 / r, 1.4, 0.28, excess, 0.3) for r in (0.1, 0.3, 1.0)]
    )
    assert rms(ramps) < 0.04


def test_fast_loading_overshoots_and_unloading_sticks_again() -> None:
    of = element(excess=4 / 7, k_hat=0.3)
    x = strips_zeta0(of) / of.saturation_creepage  # of strips, in that of the half-space
    s = np.linspace(0.0, 6.0, 601)
    loaded = rolled(of, s, np.where(s > 0.0, 2.0, 0.0))
    assert 1.2 < loaded.max() < 1.35  # reference: 1.31
    steady = of.at_creepage(2.0 * strips_zeta0(of), speed=10.0)["traction_coefficient"] / KINETIC
    assert_allclose(loaded[-1], steady, rtol=1e-6)
    unloaded = rolled(of, s, np.where(s > 0.0, 0.0, 3.0))
    sigma = of.memory_scales.relaxation_length / of.contact.semi_width
    assert_allclose(unloaded[100:], unloaded[100] * np.exp(-(s[100:] - 1.0) / sigma), rtol=1e-4)
    assert x > 1.0


def test_standstill_is_mindlins_problem() -> None:
    """A displacement of many a zeta0 while the contact hardly rolls, from rest."""
    of, s = element(), np.linspace(0.0, 1e-3, 101)
    x = 1e3
    q = rolled(of, s, np.where(s > 0.0, x, 0.0), speed=0.1)
    k, slid = (
        kernel.contact_memory(True, 1.4, 0.28).standing_stiffness,
        x * np.maximum(s - 0.5 * s[1], 0.0),
    )
    # Two zones follow the curve within 0.0302, where the outer one begins to slip.
    assert_allclose(q, 1.0 - np.maximum(1.0 - k * slid / 1.5, 0.0) ** 1.5, atol=0.0302)
    grid = reference_contact(1.4, 0.28, 64, 6, "x", "x")
    for displacement in (0.1, 0.3):
        state = grid.roll(grid.at_rest(), np.array([displacement / grid.step, 0.0, 0.0]))
        mindlin = 1.0 - (1.0 - k * displacement / 1.5) ** 1.5
        assert_allclose(grid.forces(state)[0], mindlin, atol=0.01)


@pytest.mark.parametrize("aspect", [0.05, 0.5, 1.4, 20.0])
def test_no_state_yields_energy(aspect: float) -> None:
    """x q is at least the growth of the energy of memory.h, so no closed history yields work."""
    of, rng, n, speed = element(aspect, 0.0, 0.6, 0.3), np.random.default_rng(5), 100_000, 10.0
    scales, force = of.memory_scales, KINETIC * LOAD
    given = np.zeros(n, struct_dtype("force_element_input"))
    x = rng.choice([-1, 1], n) * 10.0 ** rng.uniform(-5.0, 3.0, n)
    given["speed"], given["normal_load"], given["friction_scale"] = speed, LOAD, 1.0
    given["omega"] = speed * (1.0 + x * of.saturation_creepage) / of.radius
    given["unslipped"] = rng.uniform(0.0, 1.0, n)
    # Each zone holds at most its share of the strength, with static friction.
    part = rng.uniform(-1.0, 1.0, (2, n)) * 10.0 ** rng.uniform(-3.0, 0.0, (2, n))
    outer, core = part * of.friction.ratio * np.array([[OUTER_STRENGTH], [1.0 - OUTER_STRENGTH]])
    given["outer_force"], given["held_force"] = force * outer, force * (outer + core)
    native = kernel.NativeForceElement(of.native_contact, of.rolling_parameters)
    found = native.evaluate(given)
    q, q_rate = outer + core, found["held_rate"] / force
    outer_rate = found["outer_rate"] / force
    stored = outer * outer_rate / OUTER_STIFFNESS
    stored += core * (q_rate - outer_rate) / (1.0 - OUTER_STIFFNESS)
    stored *= scales.relaxation_length / (speed * scales.standing_stiffness * scales.initial_slope)
    work = found["normalized_creepage"] * q
    assert np.all(work - stored >= -1e-9 * (np.abs(work) + np.abs(stored)))


class InThePlane:
    """Force along and across of a contact that rolls on; creepages are over zeta0 of strips."""

    def __init__(self, of: cl.ForceElement) -> None:
        self.native = kernel.NativeForceElement(of.native_contact, of.rolling_parameters)
        self.input = ffi.new(
            "force_element_input *", {"speed": 10.0, "normal_load": LOAD, "friction_scale": 1.0}
        )
        self.input.memory.unslipped, self.of, self.zeta0 = 1.0, of, strips_zeta0(of)

    def roll(self, x: float, y: float, distance: float) -> FloatArray:
        """Roll at constant creepages over a distance in units of a."""
        now, of = self.input, self.of
        now.omega = now.speed * (1.0 + x * self.zeta0) / of.radius
        now.lateral_velocity = -y * self.zeta0 * now.speed
        step = distance * of.contact.semi_width / now.speed
        table, contact = self.native.structs
        task = ffi.new("wheelset_task *", {"contact": contact, "input": now[0], "tolerance": 1e-6})
        assert not library().wheelset_advance(table, task, step)
        self.input = now = ffi.new("force_element_input *", task.input)
        return np.array([now.memory.held_force, now.lateral.held_lateral]) / (KINETIC * LOAD)


@pytest.mark.parametrize(
    ("aspect", "excess", "k_hat"), [(1.4, 4 / 7, 0.2), (0.5, 0.0, 0.0), (2.0, 0.0, 0.0)]
)
def test_lateral_steps(aspect: float, excess: float, k_hat: float) -> None:
    every = []
    for before, after in STEPS:
        place = InThePlane(element(aspect, 0.28, excess, k_hat))
        if before:
            place.roll(0.0, before, 100.0)
        s, q = history(
            step(before, after),
            5.0,
            a_over_b=aspect,
            excess=excess,
            k_hat=k_hat,
            component="y",
            grids=COARSE,
        )
        found = [place.roll(0.0, after, ds)[1] for ds in np.diff(s)]
        every.append(np.array(found) - q[1:])
    assert rms(np.concatenate(every)) < 0.05
    assert np.abs(np.concatenate(every)).max() < 0.24


@pytest.mark.slow
def test_force_of_a_sliding_contact_turns() -> None:
    """By the compliance of the whole contact, although the force along follows at once."""
    grid = reference_contact(1.4, 0.28, 32, 6)
    place, state = InThePlane(element()), grid.at_rest()
    place.roll(1.5, 0.0, 100.0)
    for _ in range(round(3.0 / grid.step)):
        state = grid.roll(state, np.array([1.5, 0.0, 0.0]))
    for _ in range(round(2.0 / grid.step)):
        state = grid.roll(state, np.array([1.5, 0.5, 0.0]))
        found = place.roll(1.5, 0.5, grid.step)
        assert_allclose(found, grid.forces(state)[:2], atol=0.04)


@pytest.mark.parametrize("aspect", [0.2, 1.4, 5.0])
def test_closed_histories_in_the_plane_dissipate(aspect: float) -> None:
    rng, of = np.random.default_rng(3), element(aspect, 0.28, 0.6, 0.3)
    for _ in range(60):
        place, corners = InThePlane(of), rng.integers(2, 6)
        at = 10.0 ** rng.uniform(-2.0, 0.7) * rng.normal(size=(corners, 2))
        distance = 10.0 ** rng.uniform(-1.5, 0.7, corners) / 12.0
        for _ in range(3):  # the last one begins as it ends
            work, before = 0.0, place.roll(at[0, 0], at[0, 1], 1e-9)
            for i, ds in enumerate(distance):
                for part in np.linspace(0.5, 11.5, 12) / 12.0:
                    creepage = at[i] + part * (at[(i + 1) % corners] - at[i])
                    after = place.roll(creepage[0], creepage[1], ds)
                    work += float(0.5 * (before + after) @ creepage) * ds
                    before = after
        assert work > 0.0


def test_small_creepages_lag_and_the_falling_branch_does_not() -> None:
    of = element(excess=4 / 7, k_hat=0.3)
    a, k = of.contact.semi_width, 0.3
    s = np.linspace(0.0, 10 * math.pi / k, 4001)
    last = s > 8.0 * math.pi / k

    def response(x0: float) -> complex:
        q = rolled(of, s, x0 + 0.005 * np.sin(k * s))[last]
        turn = np.exp(-1j * (k * s[last] - 0.5 * math.pi))
        return complex(2.0 * np.mean(q * turn) / 0.005)

    sigma = of.memory_scales.relaxation_length / a
    slow = response(0.0)
    assert -slow.imag / slow.real / k == pytest.approx(sigma, rel=0.15)
    falling = response(1.0)
    assert falling.real < -0.1
    assert abs(falling.imag) < 0.1 * abs(falling.real)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"creepage": [0.0, 0.1], "distance": [0.0, 0.0]}, "strictly increasing"),
        ({"creepage": [0.0, 0.1], "distance": [0.0]}, "the same length"),
        ({"creepage": [0.0, math.nan], "distance": [0.0, 1.0]}, "creepage"),
        ({"creepage": [0.0, 0.1], "distance": [0.0, 1.0], "speed": 0.0}, "speed"),
    ],
)
def test_bad_histories_are_named(given: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cl.roll(element(), **given)  # type: ignore[arg-type]
