"""The explorer page's analysis against Python's: memory, gains, clearing, traction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from explorer_page import ExplorerPage
from explorer_vehicle import SAMPLE, changed, vehicle_of, with_memory
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.stability import clearing, delay_limit, find_fold, proportional_window
from contactlib.vehicle.creep_curve import Fold

pytestmark = pytest.mark.tools

# Of one place: (plant, place, physics) becomes what a function returns for it, or its error.
PLACES = """async (places) => {
  await contactlib.ready;
  return places.map((place) => {
    try {
      return (FUNCTION)(new contactlib.plant.Plant(place.vehicle, place.load), place, contactlib);
    } catch (error) { return error.message; }
  });
}"""


class Place(NamedTuple):
    """A wheelset at a speed, under a load and with friction times a factor."""

    wheelset: cl.Wheelset
    speed: float = 10.0
    load: float = 220.65e3
    friction: float = 1.0

    @property
    def inputs(self) -> dict[str, Any]:
        return {"speed": self.speed, "axle_load": self.load, "friction_scale": self.friction}


@pytest.fixture(scope="module")
def places(rig: cl.Model) -> list[Place]:
    """Wheelsets of any shape and fall of friction, low loads and fast trains among them."""
    rng = np.random.default_rng(20)
    falls = [{"decay": 0.0}, {"residual": 0.4, "decay": 0.7}, {"heat": 1.0 / 600.0}]
    return [
        Place(
            changed(rig.wheelset, {"k_hat": k_hat, "inertia": inertia, **fall}, ellipse),
            speed=float(10.0 ** rng.uniform(-0.5, 1.8)),
            load=float(220.65e3 * 10.0 ** rng.uniform(-1.5, 0.3)),
            friction=float(rng.uniform(0.3, 1.3)),
        )
        for ellipse in (False, True)
        for k_hat, inertia in ((0.02, 60.0), (0.1, 250.0), (0.3, 900.0))
        for fall in falls
    ]


def fold_of(place: Place) -> Fold | None:
    """Python's fold; None where it finds none."""
    try:
        return find_fold(place.wheelset, **place.inputs)
    except ValueError:
        return None


def call(
    page: ExplorerPage, places: list[Place], what: str, more: list[dict[str, Any]] | None = None
) -> Any:
    """What a function of the page returns for each place."""
    given = [
        {"vehicle": vehicle_of(at.wheelset), **at._asdict(), "wheelset": None, **extra}
        for at, extra in zip(places, more or [{}] * len(places), strict=True)
    ]
    return page.call(PLACES.replace("FUNCTION", what), given)


def test_memory_is_that_of_python(page: ExplorerPage, places: list[Place]) -> None:
    remembering = [at._replace(wheelset=with_memory(at.wheelset)) for at in places]
    for at, its in zip(
        remembering, call(page, remembering, "(plant) => plant.rolling"), strict=True
    ):
        expected = at.wheelset.element.rolling_parameters
        assert expected["memory"] == 1.0
        assert {key: its[key] for key in expected} == pytest.approx(expected, rel=1e-12)


# ---- gains and delays -----------------------------------------------------------------------


def of_loop(page: ExplorerPage, function: str, points: Sequence[tuple[float, ...]]) -> list[float]:
    code = (
        f"(points) => points.map(([p, g, x]) => new contactlib.stability.Loop(p, g).{function}(x))"
    )
    return list(page.call(code, points))


def test_largest_gain_of_a_sampled_loop(page: ExplorerPage) -> None:
    poles = [-300.0, -30.0, -1e-3, 0.0, 1e-3, 0.5, 7.0, 70.0, 500.0, 3000.0]
    points = [(p, 2e-4, n) for p in poles for n in (0, 1, 2, 5, 20, 71, 300)]
    expected = [
        proportional_window(p, g, delay=n * SAMPLE, sample_time=SAMPLE).highest
        for p, g, n in points
    ]
    assert of_loop(page, "largestGain", points) == pytest.approx(expected, rel=1e-7)


def test_longest_delay_is_the_last_that_leaves_a_gain(page: ExplorerPage) -> None:
    g = 2e-4
    points = [(p, g, m * p / g) for p in (0.5, 20.0, 65.0, 900.0) for m in (1.0, 1.4)]
    points += [(-30.0, g, 40.0 / g), (-1e-3, g, 5.0 / g)]  # of a free wheelset
    for (p, _, smallest), delay in zip(points, of_loop(page, "longestDelay", points), strict=True):
        last, beyond = (
            proportional_window(p, g, delay=delay + more * SAMPLE, sample_time=SAMPLE).highest
            for more in (0, 1)
        )
        assert last > smallest * (1.0 + 1e-12) >= beyond * (1.0 - 1e-9)
        assert delay <= delay_limit(p)
    none = [(-30.0, g, 20.0 / g), (-30.0, g, 0.0), (70.0, g, 1e5 / g)]
    assert of_loop(page, "longestDelay", none) == pytest.approx(
        [math.inf, math.inf, math.nan], nan_ok=True
    )


# ---- clearing -------------------------------------------------------------------------------

Patch = tuple[Place, float, float]  # where, drive torque, friction on the patch
CLEARING = """(plant, at, { clearing }) =>
  clearing.clearing(plant, at.torque, at.speed, at.patch)"""


def deviations_of(page: ExplorerPage, patches: list[Patch]) -> list[float]:
    """Relative deviations of the finite clearing times from Python's."""
    given = [{"torque": torque, "patch": patch} for _, torque, patch in patches]
    answers = call(page, [at for at, _, _ in patches], CLEARING, given)
    deviations = []
    for (at, torque, patch), its in zip(patches, answers, strict=True):
        with suppress(ValueError, RuntimeError):  # no border within reach
            inputs = at.inputs | {"friction_scale": patch}
            expected = clearing(at.wheelset, drive_torque=torque, **inputs)
            assert its["start"] == pytest.approx(expected.border.creepage, rel=1e-9)
            assert math.isfinite(its["time"]) == math.isfinite(expected.time)
            if math.isfinite(expected.time):
                deviations.append(abs(its["time"] / expected.time - 1.0))
                ways = its["distance"] / its["time"], expected.distance / expected.time
                assert ways[0] == pytest.approx(ways[1], rel=1e-3)
    return deviations


def between(rng: np.random.Generator, fold: Fold, low: float, high: float) -> float:
    """A torque part of the way from that of the return to that of the fold."""
    return fold.return_torque + rng.uniform(low, high) * (fold.drive_torque - fold.return_torque)


def test_clearing_of_a_held_speed(page: ExplorerPage, rig: cl.Model, places: list[Place]) -> None:
    rng = np.random.default_rng(3)
    patches = [(Place(rig.wheelset), 0.9 * 27313.54, patch) for patch in (0.5, 0.95, 1.0)]
    for at in places:
        good = at._replace(friction=1.0)
        fold = fold_of(good)
        if fold is not None:
            patches.append((good, between(rng, fold, -0.1, 0.98), float(rng.uniform(0.3, 0.95))))
    deviations = deviations_of(page, patches)
    assert len(deviations) > 6
    assert max(deviations) < 1e-6
    assert len(patches) - len(deviations) > 2  # survived at any length


def test_clearing_of_a_free_speed(page: ExplorerPage, locomotive: cl.Model) -> None:
    patches = [
        (Place(locomotive.wheelset, speed, load), share * 26.5e3 * load / 220e3, patch)
        for speed in (3.0, 30.0)
        for load in (150e3, 220e3)
        for share in (0.92, 0.96)
        for patch in (0.4, 0.8)
    ][::3]
    deviations = deviations_of(page, patches)
    assert len(deviations) > 2
    assert max(deviations) < 1e-4


def test_clearing_of_light_vehicles(page: ExplorerPage, rig: cl.Model) -> None:
    """The speed changes while the border is approached: good to half a per cent, as a rule."""
    rng, patches = np.random.default_rng(8), list[Patch]()
    for mass in (6e3, 2e4, 6e4):
        for speed in (5.0, 20.0):
            at = Place(replace(rig.wheelset, mass=mass), speed)
            fold = fold_of(at)
            assert fold is not None
            patches.append((at, between(rng, fold, 0.2, 0.9), float(rng.uniform(0.3, 0.9))))
    deviations = deviations_of(page, patches)
    assert len(deviations) > 2
    assert float(np.quantile(deviations, 0.9)) < 5e-3
    assert max(deviations) < 5e-2


def test_no_clearing_where_good_friction_does_not_hold(page: ExplorerPage, rig: cl.Model) -> None:
    more = [{"torque": torque, "patch": 0.5} for torque in (27.4e3, 40e3, -5e3)]
    assert call(page, [Place(rig.wheelset)] * 3, CLEARING, more) == [None] * 3


# ---- traction along the contact -------------------------------------------------------------

POINTS = 40
PATCHES = """async (contact, creepages, kHat, points, layer) => {
  await contactlib.ready;
  const names = ["eta", "position", "shear_traction", "stick_boundary"];
  return creepages.map((x) => {
    const strips = contactlib.patch.stripsOf(contact, x, kHat, 31, points, layer);
    return names.map((name) => strips.map(({ [name]: found }) =>
      typeof found === "number" ? found : [...found]));
  });
}"""


@pytest.mark.parametrize("contact", ["line", "elliptic"])
@pytest.mark.parametrize("k_hat", [0.0, 0.02, 0.3, 1.0, 2.0])
def test_traction_and_stick_are_the_law_s(page: ExplorerPage, contact: Any, k_hat: float) -> None:
    law = cl.CarterGriffith(k_hat=k_hat, contact=contact)
    creepages = [0.0, *np.geomspace(1e-3, 20.0, 7), -0.7]
    for x, patch in zip(
        creepages, page.call(PATCHES, contact, creepages, k_hat, POINTS), strict=True
    ):
        eta, position, traction, boundary = map(np.array, patch)
        eta, boundary = eta[:, None], boundary[:, None]
        assert position.shape == (eta.size, POINTS)
        assert np.all(np.diff(position[len(position) // 2]) >= 0.0)
        if x == 0.0:
            assert np.all(traction == 0.0)
            continue
        assert_allclose(boundary, law.stick_boundary(abs(x), eta), rtol=0.0, atol=1e-12)
        # A position has 16 digits, its distance to a singular point fewer; that of a
        # zone without length has none.
        width = np.sqrt((1.0 - eta) * (1.0 + eta)) if contact == "elliptic" else 1.0
        away = np.minimum(np.abs(position - boundary), np.abs(width - np.abs(position)))
        clear = away > 1e-10
        expected = np.sign(x) * law.shear_traction(position, abs(x), eta)
        allowed = 1e-10 + 1e-15 * np.abs(traction) / np.maximum(away, 1e-300)
        assert np.all(np.abs(traction - expected)[clear] <= allowed[clear])
        assert np.mean(clear) > 0.4


@pytest.mark.parametrize("contact", ["line", "elliptic"])
@pytest.mark.parametrize(("k_hat", "layer"), [(0.0, 0.05), (0.17, 0.9), (1.0, 0.3), (0.3, 8.0)])
def test_a_layer_s_traction_is_that_of_the_law(
    page: ExplorerPage, contact: Any, k_hat: float, layer: float
) -> None:
    law = cl.CarterGriffith(k_hat=k_hat, contact=contact, layer_ratio=layer)
    creepages = [0.0, 0.01, 0.2, 0.8, 2.0, 30.0, -0.7]
    for x, patch in zip(
        creepages, page.call(PATCHES, contact, creepages, k_hat, POINTS, layer), strict=True
    ):
        strips = list(zip(*patch, strict=True))
        for eta, *parts, boundary in strips[len(strips) // 2 :: 10]:
            position, traction = map(np.array, parts)
            if x == 0.0:
                assert np.all(traction == 0.0)
                continue
            assert boundary == pytest.approx(float(law.stick_boundary(abs(x), eta)), abs=0.01)
            expected = np.sign(x) * law.shear_traction(position, abs(x), eta)
            off = np.where(position == boundary, 0.0, np.abs(traction - expected))  # where it jumps
            assert np.quantile(off, 0.9) < 0.02
            assert np.sum(0.5 * (off[1:] + off[:-1]) * np.diff(position)) < 0.01
