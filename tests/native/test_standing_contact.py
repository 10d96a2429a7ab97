"""A contact with memory that stands still, against Masing's rule with Mindlin's curve."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from native_models import native, with_memory
from scipy.optimize import brentq

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.export.description import Description

STATES = ("held_force", "unslipped", "outer_force", "held_lateral", "outer_lateral")
SLIP = 0.01  # [m/s]


class Standing:
    """An ellipse with Coulomb friction, moved by displacements in units of the elastic one at
    breakaway, so that Mindlin's force over friction is 1 - (1 - d/1.5)^1.5."""

    def __init__(self, model: kernel.NativeModel, element: cl.ForceElement) -> None:
        scales = element.memory_scales
        stiffness = scales.standing_stiffness * scales.initial_slope / scales.relaxation_length
        self.model, self.radius = model, element.radius
        self.unit = element.saturation_creepage / stiffness  # [m]
        self.most = element.friction.static * element.axle_load

    def move(self, displacement: float) -> float:
        """Force over friction after a displacement."""
        time = abs(displacement) * self.unit / SLIP
        self.model.set(speed=0.0, omega=np.copysign(SLIP, displacement) / self.radius)
        if time > 0.0:
            self.model.advance(time, 1e-8)
        self.model.set(omega=0.0)
        self.model.evaluate()
        return self.force

    @property
    def force(self) -> float:
        return self.model.get("creep_force")[0] / self.most

    def load(self, force: float) -> float:
        """Displacement that changes the force to this one."""
        before = dict(zip(STATES, self.model.get(*STATES), strict=True))
        end = 3.0 * float(np.sign(force - self.force))

        def missing(displacement: float) -> float:
            self.model.set(**before)
            return self.move(displacement) - force

        found = float(brentq(missing, 0.0, end, xtol=1e-9))
        self.model.set(**before)
        self.move(found)
        return found

    def roll(self, distance: float) -> None:
        """Roll without creepage, by a distance in m."""
        self.model.set(speed=1.0, omega=1.0 / self.radius)
        self.model.advance(distance)
        self.model.set(speed=0.0, omega=0.0)


def coulomb(locomotive: cl.Model, **changes: Any) -> cl.Model:
    element = locomotive.wheelset.element
    friction = replace(element.friction, static=element.friction.kinetic, weakening_length=0.0)
    changed = replace(element, friction=friction, **changes)
    return with_memory(replace(locomotive, wheelset=replace(locomotive.wheelset, element=changed)))


@pytest.fixture(scope="module")
def standing(locomotive: cl.Model) -> Any:
    """A new one, which holds no force."""
    description = Description(coulomb(locomotive), "force_element", whole_wheelset=True)

    def made() -> Standing:
        return Standing(native(description, omega=0.0, speed=0.0), description.element)

    return made


class Springs:
    """Parallel springs that slip at their strengths; their loops close (Masing)."""

    def __init__(self, stiffness: FloatArray, strength: FloatArray) -> None:
        self.stiffness, self.strength = stiffness, strength
        self.held = np.zeros_like(strength)

    def move(self, displacement: float) -> float:
        moved = self.held + self.stiffness * displacement
        self.held = np.clip(moved, -self.strength, self.strength)
        return float(self.held.sum())


def zones() -> Springs:
    """The two of memory.h."""
    return Springs(np.array([0.3774, 0.6226]), np.array([0.1567, 0.8433]))


def mindlin() -> Springs:
    """Many, which follow Mindlin's curve."""
    at = np.linspace(0.0, 1.5, 3001)
    stiffness = -np.diff(np.sqrt(1.0 - at / 1.5))
    return Springs(stiffness, stiffness * 0.5 * (at[1:] + at[:-1]))


@pytest.mark.parametrize(
    ("mean", "amplitude"),
    [
        (0.37, 0.15),
        (0.66, 0.15),
        (0.2, 0.1),
        (0.5, 0.45),
        (0.0, 0.9),
        (0.45, 0.02),
        (0.8, 0.1),
    ],
)
def test_loops_of_a_standing_contact_close(standing: Any, mean: float, amplitude: float) -> None:
    contact, moved = standing(), []
    contact.load(mean + amplitude)
    for _ in range(5):
        moved.append((contact.load(mean - amplitude), contact.load(mean + amplitude)))
    down, up = np.array(moved).T
    assert np.abs(down + up)[1:].max() < 0.01 * up.min()  # drift of a cycle
    width = 3.0 * (1.0 - (1.0 - amplitude) ** (2.0 / 3.0))
    assert up[1:] == pytest.approx(np.full(4, width), rel=0.1)


def test_a_standing_wheel_does_not_walk(standing: Any) -> None:
    """A hundred cycles, and another hundred after it rolled: all after the first together less
    than 2 % of a cycle's width."""
    contact = standing()
    for distance in (0.0, 0.05):
        contact.roll(distance)
        contact.load(0.6)
        sums = [contact.load(0.4) + contact.load(0.6) for _ in range(100)]
        assert abs(sum(sums[1:])) < 0.02 * 0.2


TURNS = {
    "shrinking": np.array([2.0, -1.2, 1.0, -0.8, 0.6, -0.45, 0.3, -0.15, 0.05, 0.9, -1.1]),
    "random": np.random.default_rng(8).uniform(-1.4, 1.4, 40),
    "small": 0.5 + np.random.default_rng(9).uniform(-0.5, 0.5, 40),
}


@pytest.mark.parametrize("name", TURNS)
def test_turning_points_of_changing_size_follow_masing(standing: Any, name: str) -> None:
    """Each reversal adds twice the 0.03 by which two zones miss Mindlin's curve."""
    models, forces = (standing(), zones(), mindlin()), []
    for change in np.repeat(np.diff(TURNS[name], prepend=0.0) / 8.0, 8):
        forces.append([model.move(change) for model in models])
    found, two, exact = np.array(forces).T
    assert np.abs(found - two).max() < 0.02 * np.ptp(two)
    assert np.abs(found - exact).max() < 0.1 * np.ptp(exact)


@pytest.mark.parametrize("rolled", [0.0, 1e-4, 3e-3])
def test_closed_displacements_yield_no_energy(standing: Any, rolled: float) -> None:
    rng = np.random.default_rng(12)
    for _ in range(12):
        corners = 10.0 ** rng.uniform(-1.0, 0.3) * rng.uniform(-1.0, 1.0, rng.integers(5, 13))
        changes = np.diff(corners, append=corners[0])
        contact = standing()
        before = contact.move(corners[0])
        for _ in range(3):  # the last one begins as it ends
            work = 0.0
            for change in changes:
                for _ in range(10):
                    after = contact.move(change / 10.0)
                    work += 0.05 * (before + after) * change
                    before = after
                if rolled:
                    contact.roll(rolled)
                    before = contact.force
        assert work > -1e-6 * np.ptp(corners) ** 2


# ---- load -----------------------------------------------------------------------------------


def test_a_load_that_is_lost_takes_the_force_with_it(standing: Any) -> None:
    contact = standing()
    (load,) = contact.model.get("normal_load")
    contact.load(0.6)
    contact.model.set(normal_load=0.0)
    contact.model.evaluate()
    assert contact.force == 0.0
    contact.model.advance(0.3)
    contact.model.set(normal_load=load)
    contact.model.evaluate()
    assert abs(contact.force) < 1e-12


def test_friction_that_falls_limits_the_force_at_once(standing: Any) -> None:
    contact = standing()
    contact.load(0.6)
    contact.model.set(friction_scale=0.2)
    contact.model.evaluate()
    assert 0.0 < contact.force <= 0.2 * (1.0 + 1e-12)
    assert contact.model.get("force_limited") == [1.0]
    contact.model.advance(0.01)
    contact.model.set(friction_scale=1.0)
    contact.model.evaluate()
    assert contact.force <= 0.2 * (1.0 + 1e-6)  # what was lost stays lost
    assert contact.model.get("force_limited") == [0.0]


@pytest.mark.parametrize("outer", [True, False])
def test_one_zone_beyond_friction_is_a_limited_force(standing: Any, outer: bool) -> None:
    """The force then is less than the states hold, although friction could carry their sum."""
    contact = standing()
    zone = 0.3 * contact.most if outer else 0.0  # the outer zone carries up to 0.157 of it
    contact.model.set(held_force=zone if outer else 0.9 * contact.most, outer_force=zone)
    contact.model.evaluate()
    (held,) = contact.model.get("held_force")
    assert contact.force < 0.99 * held / contact.most < 0.99
    assert contact.model.get("force_limited") == [1.0]


def test_a_contact_that_slips_is_not_limited(standing: Any) -> None:
    """Without weakening its zones lie on their limits, up to rounding."""
    contact = standing()
    contact.model.set(speed=1.0, omega=1.05 / contact.radius)
    for _ in range(40):
        contact.model.advance(1e-3)
        contact.model.evaluate()
        assert contact.model.get("force_limited") == [0.0]
    assert contact.force > 0.999


@pytest.mark.parametrize("factor", [0.7, 0.9, 1.1, 2.0])
def test_particles_keep_their_force_when_the_load_changes(standing: Any, factor: float) -> None:
    contact = standing()
    (load,) = contact.model.get("normal_load")
    contact.load(0.2)  # below the strength of either zone under any of the loads
    contact.load(0.1)
    before = contact.force
    for part in np.linspace(1.0, factor, 11):
        contact.model.set(normal_load=part * load)
        contact.model.evaluate()
        assert contact.force == pytest.approx(before, rel=1e-6)
        contact.model.advance(1e-3)
