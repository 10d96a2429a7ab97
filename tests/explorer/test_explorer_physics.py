"""The explorer page's analysis against Python's: torque curve, fold, gains, clearing."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from explorer_page import ExplorerPage
from explorer_vehicle import changed, random_wheelset, vehicle_of

import contactlib as cl
from contactlib.contact.scales import saturation_creepage
from contactlib.stability import (
    Clearing,
    Fold,
    clearing,
    creep_control_gain,
    delay_limit,
    find_fold,
    proportional_window,
    quasi_steady_torque,
    s_curve,
    steady_states,
)

pytestmark = pytest.mark.tools

# Of one place: (plant, place, physics) goes to what a function says of it.
PLACES = """async (places) => {
  const { kernel } = await contactlib.ready;
  const say = SAY;
  return places.map((place) =>
    say(new contactlib.plant.Plant(kernel, place.vehicle, place.load), place, contactlib));
}"""


class Place(NamedTuple):
    """A wheelset at a speed, under a load and with friction times a factor."""

    wheelset: cl.Wheelset
    speed: float
    load: float
    friction: float = 1.0

    @property
    def inputs(self) -> dict[str, Any]:
        return {
            "speed": self.speed,
            "normal_load": self.load,
            "friction_scale": self.friction,
        }

    def held_friction(self, creepage: float) -> bool:
        """Whether the force is held at static friction there."""
        there = self.wheelset.element.at_creepage(creepage, **self.inputs)
        return bool(there["force_limited"])


@pytest.fixture(scope="module")
def places() -> list[Place]:
    """Any wheelsets, low loads and fast trains among them."""
    rng = np.random.default_rng(20)
    found = []
    for _ in range(60):
        wheelset = random_wheelset(rng)
        load = wheelset.element.normal_load * 10.0 ** rng.uniform(-1.5, 0.3)
        speed = 10.0 ** rng.uniform(-0.5, 1.8)
        found.append(Place(wheelset, float(speed), float(load), float(rng.uniform(0.3, 1.3))))
    return found


@pytest.fixture(scope="module")
def folds(places: list[Place]) -> list[Fold | None]:
    """Python's folds there."""
    return [fold_of(place) for place in places]


def fold_of(place: Place) -> Fold | None:
    """Python's fold; None where it finds none."""
    try:
        return find_fold(place.wheelset, **place.inputs)
    except ValueError:
        return None


def say(
    page: ExplorerPage, places: list[Place], what: str, more: list[dict[str, Any]] | None = None
) -> Any:
    """What the page says of each place."""
    given = [
        {"vehicle": vehicle_of(at.wheelset), **at._asdict(), "wheelset": None, **extra}
        for at, extra in zip(places, more or [{}] * len(places), strict=True)
    ]
    return page.call(PLACES.replace("SAY", what), given)


def shipped(rig: cl.Model, locomotive: cl.Model) -> list[Place]:
    return [Place(m.wheelset, 10.0, 220.65e3) for m in (rig, locomotive)]


def test_parameters_are_those_of_python(page: ExplorerPage, places: list[Place]) -> None:
    found = say(
        page,
        places,
        """(_, { vehicle }, { vehicle: of }) => ({
          contact: of.forceParameters(vehicle), body: of.wheelsetParameters(vehicle),
          scale: of.saturationCreepage(vehicle), modulus: of.contactModulus(vehicle) })""",
    )
    for at, its in zip(places, found, strict=True):
        element = at.wheelset.element
        expected = {**element.parameters, "relaxation_length": 0.0}
        assert its["contact"] == pytest.approx(expected, rel=1e-13)
        assert its["body"] == pytest.approx(at.wheelset.parameters, rel=1e-13)
        assert its["modulus"] == pytest.approx(element.contact.contact_modulus, rel=1e-14)
        zeta0 = saturation_creepage(
            element.contact, element.friction, slope_reduction=element.slope_reduction
        )
        assert its["scale"] == pytest.approx(zeta0, rel=1e-13)


def test_torque_slope_pole_and_gain(page: ExplorerPage, places: list[Place]) -> None:
    zeta = np.geomspace(1e-4, 10.0, 30)
    found = say(
        page,
        places,
        """(plant, { speed, friction, zeta }) => zeta.map((z) => {
          const { drive_torque, slope, pole } = plant.balance(z, speed, friction);
          const least = contactlib.stability.creepControlGain(plant, z, speed, friction);
          return [drive_torque, slope, pole, plant.gain(speed), least];
        })""",
        [{"zeta": zeta.tolist()}] * len(places),
    )
    for at, rows in zip(places, found, strict=True):
        torque, slope, pole, gain, least = np.array(rows).T
        steepest = float(np.abs(slope).max())  # what cancels is of this size
        rate = at.wheelset.radius / (at.wheelset.inertia * at.speed)
        np.testing.assert_allclose(
            torque,
            quasi_steady_torque(at.wheelset, zeta, **at.inputs),
            rtol=1e-10,
            atol=1e-13 * float(np.abs(torque).max()),
        )
        np.testing.assert_allclose(
            slope,
            cl.CreepCurve(at.wheelset, **at.inputs).slope(zeta),
            rtol=1e-12,
            atol=1e-13 * steepest,
        )
        np.testing.assert_allclose(
            pole,
            cl.CreepCurve(at.wheelset, **at.inputs).pole(zeta),
            rtol=1e-12,
            atol=1e-13 * steepest * rate,
        )
        assert gain == pytest.approx(rate, rel=1e-15)
        points = [at.wheelset.balanced(creepage=float(z), **at.inputs) for z in zeta]
        expected = [creep_control_gain(at.wheelset, point) for point in points]
        np.testing.assert_allclose(least, expected, rtol=1e-9, atol=1e-12 * steepest)


def test_folds_are_those_of_python(
    page: ExplorerPage, places: list[Place], folds: list[Fold | None]
) -> None:
    found = say(
        page,
        places,
        "(plant, at, { stability }) => stability.sCurve(plant, at.speed, at.friction).fold",
    )
    plateaus = 0
    for at, expected, its in zip(places, folds, found, strict=True):
        assert (its is None) == (expected is None)
        if expected is None:
            continue
        # A curve held flat at static friction turns where that begins. Python says the next node
        # of its grid, of which 571 make a decade.
        plateau = at.held_friction(its["creepage"] * (1.0 + 1e-9)) and at.wheelset.damping == 0.0
        if plateau and at.wheelset.speed_held:
            plateaus += 1
            assert not at.held_friction(its["creepage"] * (1.0 - 1e-9))
            assert 1.0 <= expected.creepage / its["creepage"] <= 10.0 ** (1.0 / 570.0)
            its["creepage"] = expected.creepage
        assert its == pytest.approx(expected._asdict(), rel=1e-9)
    assert plateaus > 0
    assert any(fold is not None and math.isfinite(fold.return_creepage) for fold in folds)


def test_the_rig_folds_where_it_is_known_to(
    page: ExplorerPage, rig: cl.Model, locomotive: cl.Model
) -> None:
    what = "(plant, at, { stability }) => stability.sCurve(plant, at.speed).fold"
    fold = say(page, shipped(rig, locomotive), what)[0]
    assert fold["creepage"] == pytest.approx(0.0169818, rel=1e-5)
    assert fold["drive_torque"] == pytest.approx(27313.54, rel=1e-6)
    assert fold["return_creepage"] == pytest.approx(0.0591455, rel=1e-5)
    assert fold["return_torque"] == pytest.approx(24242.12, rel=1e-6)


def rig_with(rig: cl.Model, k_hat: float, damping: float) -> cl.Wheelset:
    return changed(rig.wheelset, {"k_hat": k_hat, "damping": damping}, ellipse=False)


def test_there_is_no_fold_where_damping_outweighs_the_fall(
    page: ExplorerPage, rig: cl.Model
) -> None:
    wheelsets = [
        rig_with(rig, k_hat, damping)
        for k_hat in (0.0, 1e-3, 1e-2, 0.1, 0.3)
        for damping in (1e-3, 0.1, 10.0, 1e3, 1e4, 1e5)
    ]
    places = [Place(wheelset, 10.0, 220.65e3) for wheelset in wheelsets]
    found = say(
        page, places, "(plant, at, { stability }) => stability.sCurve(plant, at.speed).fold"
    )
    # The slope at least, on a grid that is fine where the law is.
    near = np.geomspace(1e-6, 1e3, 20001)
    zeta = 0.015 * np.concatenate([1.0 - near[near < 1.0][::-1], 1.0 + near])
    for at, its in zip(places, found, strict=True):
        least = float(cl.CreepCurve(at.wheelset, speed=10.0).slope(zeta).min())
        assert (its is not None) == (least < 0.0)
    assert 5 < sum(its is None for its in found) < len(found) - 5


def test_carter_without_damping_has_a_plateau(page: ExplorerPage, rig: cl.Model) -> None:
    place = Place(rig_with(rig, 0.0, 0.0), 10.0, 220.65e3)
    what = "(plant, at, { stability }) => stability.sCurve(plant, at.speed).fold"
    (fold,) = say(page, [place], what)
    limit = 0.5 * 0.21 * 220.65e3
    assert fold["creepage"] == pytest.approx(0.015, rel=1e-9)
    assert fold["drive_torque"] == pytest.approx(limit, rel=1e-12)
    assert fold["return_torque"] == pytest.approx(limit, rel=1e-12)
    assert fold["return_creepage"] == math.inf


def test_s_curve(page: ExplorerPage, places: list[Place]) -> None:
    found = say(
        page,
        places[:30],
        """(plant, at, { stability }) => {
          const { fold, states } = stability.sCurve(plant, at.speed, at.friction);
          const keys = ["creepage", "drive_torque", "pole"];
          return { fold, rows: keys.map((key) => [...states[key]]) };
        }""",
    )
    closed = 0
    for at, its in zip(places, found, strict=False):
        zeta, torque, pole = np.array(its["rows"])
        expected = s_curve(at.wheelset, creepage=zeta, **at.inputs)
        np.testing.assert_allclose(torque, expected.drive_torque, rtol=1e-12, atol=1e-11)
        size = float(np.abs(pole).max())
        close = np.isclose(pole, expected.pole, rtol=1e-12, atol=1e-13 * size)
        assert (
            np.count_nonzero(~close) <= 1
        )  # the last bit says on which side of a corner a point is
        assert zeta[0] == 0.0
        assert np.all(np.diff(zeta) > 0.0)
        assert 395 <= zeta.size <= 405
        fold = its["fold"]
        if fold is None:
            continue
        assert fold["creepage"] in zeta
        assert fold["drive_torque"] in torque
        if math.isfinite(fold["return_creepage"]):
            assert fold["return_creepage"] in zeta
            closed += bool(torque[-1] == pytest.approx(1.15 * fold["drive_torque"], rel=1e-9))
    assert closed > 3


def test_steady_states(page: ExplorerPage, places: list[Place], folds: list[Fold | None]) -> None:
    chosen = [(at, fold) for at, fold in zip(places, folds, strict=True) if fold][:20]
    shares = (-0.5, 0.3, 0.97, 1.02)  # of the way from the return's torque to the fold's
    wanted = [
        [fold.return_torque + share * (fold.drive_torque - fold.return_torque) for share in shares]
        for _, fold in chosen
    ]
    found = say(
        page,
        [at for at, _ in chosen],
        """(plant, at, { stability }) => at.torques.map((torque) =>
          stability.steadyStates(plant, torque, at.speed, at.friction))""",
        [{"torques": torques} for torques in wanted],
    )
    several = 0
    for (at, _), torques, rows in zip(chosen, wanted, found, strict=True):
        for torque, its in zip(torques, rows, strict=True):
            expected = steady_states(at.wheelset, drive_torque=torque, **at.inputs)
            traction = expected.creepage >= 0.0
            assert [s["creepage"] for s in its] == pytest.approx(
                expected.creepage[traction].tolist(), rel=1e-9
            )
            assert [s["stable"] for s in its] == expected.stable[traction].tolist()
            assert [s["drive_torque"] for s in its] == pytest.approx([torque] * len(its), rel=1e-9)
            assert [s["pole"] for s in its] == pytest.approx(
                expected.pole[traction].tolist(), rel=1e-6
            )
            several += len(its) > 2
    assert several > 5


def test_largest_gain_of_a_sampled_loop(page: ExplorerPage) -> None:
    poles = [-300.0, -30.0, -1e-3, 0.0, 1e-3, 0.5, 7.0, 70.0, 500.0, 3000.0]
    asked = [(p, 2e-4, n, 2e-4) for p in poles for n in (0, 1, 2, 5, 20, 71, 300)]
    found = page.call(
        """async (asked) => {
          await contactlib.ready;
          return asked.map((given) => contactlib.stability.largestGain(...given));
        }""",
        asked,
    )
    windows = 0
    for (p, g, samples, step), highest in zip(asked, found, strict=True):
        expected = proportional_window(p, g, delay=samples * step, sample_time=step)
        assert highest == pytest.approx(expected.highest, rel=1e-7)
        windows += not expected.empty
    assert windows > 50


def test_longest_delay_is_the_last_that_leaves_a_gain(page: ExplorerPage) -> None:
    step, gain = 2e-4, 2e-4
    asked = [
        (p, gain, over * p / gain, step) for p in (0.5, 20.0, 65.0, 900.0) for over in (1.0, 1.4)
    ]
    found = page.call(
        """async (asked) => {
          await contactlib.ready;
          return asked.map((given) => contactlib.stability.longestDelay(...given));
        }""",
        asked,
    )
    for (p, g, least, _), longest in zip(asked, found, strict=True):
        highest = [
            proportional_window(p, g, delay=longest + more * step, sample_time=step).highest
            for more in (0, 1)
        ]
        assert highest[0] > least * (1.0 + 1e-12) >= highest[1] * (1.0 - 1e-9)
        assert longest <= delay_limit(p)


CLEARING = """(plant, at, { clearing }) =>
  clearing.clearing(plant, at.torque, at.speed, at.patch)"""


Patch = tuple[Place, float, float]  # where, drive torque, friction on the patch


def python_clearing(at: Place, torque: float, patch: float) -> Clearing:
    return clearing(
        at.wheelset,
        drive_torque=torque,
        speed=at.speed,
        normal_load=at.load,
        friction_scale=patch,
    )


def deviations_of(page: ExplorerPage, asked: list[Patch], known: list[Clearing]) -> list[float]:
    """Relative deviations of the finite clearing times from Python's."""
    found = say(
        page,
        [at for at, _, _ in asked],
        CLEARING,
        [{"torque": torque, "patch": patch} for _, torque, patch in asked],
    )
    deviations = []
    for its, expected in zip(found, known, strict=True):
        assert its["start"] == pytest.approx(expected.border.creepage, rel=1e-9)
        assert math.isfinite(its["time"]) == math.isfinite(expected.time)
        if math.isfinite(expected.time):
            deviations.append(abs(its["time"] / expected.time - 1.0))
            ways = its["distance"] / its["time"], expected.distance / expected.time
            assert ways[0] == pytest.approx(ways[1], rel=1e-3)
    return deviations


def test_clearing_of_a_held_speed(page: ExplorerPage, rig: cl.Model, places: list[Place]) -> None:
    rng = np.random.default_rng(3)
    asked = [(Place(rig.wheelset, 10.0, 220.65e3), 0.9 * 27313.54, m) for m in (0.5, 0.95, 1.0)]
    for at in places:
        good = at._replace(friction=1.0)
        fold = fold_of(good)
        if fold is None or not at.wheelset.speed_held:
            continue
        share = rng.uniform(-0.1, 0.98)  # of the way from the return's torque to the fold's
        torque = fold.return_torque + share * (fold.drive_torque - fold.return_torque)
        asked.append((good, float(torque), float(rng.uniform(0.3, 0.95))))
    deviations = deviations_of(page, asked, [python_clearing(*case) for case in asked])
    assert len(deviations) > 12
    assert max(deviations) < 1e-6
    assert len(asked) - len(deviations) > 2  # survived at any length


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_clearing_of_a_free_speed(page: ExplorerPage, locomotive: cl.Model, every: int) -> None:
    asked = [
        (Place(locomotive.wheelset, speed, load), share * torque * load / 220e3, patch)
        for speed, torque in ((3.0, 26.5e3), (30.0, 26.5e3))
        for load in (150e3, 220e3)
        for share in (0.92, 0.96)
        for patch in (0.4, 0.8)
    ][::every]
    deviations = deviations_of(page, asked, [python_clearing(*case) for case in asked])
    assert len(deviations) > 7 / every
    assert max(deviations) < 1e-4


@pytest.mark.parametrize("count", [5, pytest.param(14, marks=pytest.mark.slow)])
def test_clearing_of_light_vehicles(page: ExplorerPage, count: int) -> None:
    """The speed changes while the border is approached: good to half a per cent, as a rule."""
    rng = np.random.default_rng(8)
    asked: list[Patch] = []
    known: list[Clearing] = []
    while len(asked) < count:
        wheelset = random_wheelset(rng)
        load = wheelset.element.normal_load * float(rng.uniform(0.3, 1.3))
        at = Place(wheelset, float(10.0 ** rng.uniform(0.5, 1.8)), load)
        fold = fold_of(at)
        if fold is None or wheelset.speed_held:
            continue
        share = float(rng.uniform(0.2, 0.9))
        torque = fold.return_torque + share * (fold.drive_torque - fold.return_torque)
        case = at, torque, float(rng.uniform(0.3, 0.9))
        try:
            found = python_clearing(*case)
        except (ValueError, RuntimeError):
            continue
        if math.isinf(found.border.highest):  # no border within reach
            continue
        known.append(found)
        asked.append(case)
    deviations = deviations_of(page, asked, known)
    assert len(deviations) > count / 2
    assert float(np.quantile(deviations, 0.9)) < 5e-3
    assert max(deviations) < 5e-2


def test_no_clearing_where_good_friction_does_not_hold(page: ExplorerPage, rig: cl.Model) -> None:
    at = Place(rig.wheelset, 10.0, 220.65e3)
    more = [{"torque": torque, "patch": 0.5} for torque in (27.4e3, 40e3, -5e3)]
    assert say(page, [at] * 3, CLEARING, more) == [None] * 3


def test_roots(page: ExplorerPage) -> None:
    found, jump, calls, refusal = page.call(
        """async () => {
          await contactlib.ready;
          const { root } = contactlib.roots;
          let calls = 0;
          const counted = (f) => (x) => { calls++; return f(x); };
          const found = [
            root(counted((x) => x * x - 2), 0, 2), root(counted(Math.cos), 1, 2),
            root(counted((x) => Math.exp(x) - 1e5), -20, 40), root(counted((x) => x ** 9), -1, 1.7),
          ];
          const jump = root((x) => (x < 0.3 ? -1 : 1e-9), 0, 1);
          let refusal = "";
          try { root((x) => x, 1, 2); } catch (error) { refusal = error.message; }
          return [found, jump, calls, refusal];
        }"""
    )
    assert found[:3] == pytest.approx(
        [math.sqrt(2.0), 0.5 * math.pi, math.log(1e5)], rel=1e-15, abs=0.0
    )
    assert abs(found[3]) < 1e-30
    assert calls < 250
    assert jump == pytest.approx(0.3, rel=1e-15)
    assert refusal == "no root is enclosed: f(1) = 1, f(2) = 2"


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        (
            "(plant) => plant.force(0.01, 0.05)",
            "speed = 0.05 is out of range: must be finite and >= 0.1",
        ),
        (
            "(plant) => plant.force(0.01, NaN)",
            "speed = NaN is out of range: must be finite and >= 0.1",
        ),
        (
            "(plant, at, { plant: { Plant } }) => new Plant(plant.kernel, at.vehicle, 0)",
            "normalLoad = 0 is out of range: must be finite and > 0",
        ),
        (
            "(plant, at, { vehicle: { weakeningLength } }) =>"
            " weakeningLength({ ...at.vehicle, kinetic_friction: 0.45 })",
            "k_hat = 0.3 needs static_friction = 0.45 above kinetic_friction = 0.45",
        ),
    ],
)
def test_bad_input_is_named(
    page: ExplorerPage, rig: cl.Model, expression: str, message: str
) -> None:
    caught = f"""(...given) => {{
      try {{ ({expression})(...given); return null; }} catch (error) {{ return error.message; }}
    }}"""
    (said,) = say(page, [Place(rig.wheelset, 10.0, 220.65e3)], caught)
    assert (
        said.replace("0.30000000000000004", "0.3").replace("0.29999999999999993", "0.3") == message
    )
