"""The cohesive-zone law against CONTACT, its own balances and the limits that are known."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import gamma
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from contactlib import CarterGriffith, CohesiveZone, Friction
from contactlib.base.quantities import FloatArray
from contactlib.laws import EXPONENTIAL, ConvergenceError, cohesive_zone
from contactlib.laws.cohesive import MIN_K_HAT, find_state
from contactlib.laws.cohesive_zone import enough_nodes, solve_cohesive_zones, weakening_length
from contactlib.laws.friction import Weakening

RATIO = 0.33 / 0.21
CONTACT = np.genfromtxt(
    Path(__file__).with_name("contact_slip_weakening_2d.csv"),
    delimiter=",",
    names=True,
    skip_header=3,
)
# (k_hat, static_to_kinetic): zones much shorter and much longer than the contact
STATES = [(0.01, RATIO), (0.06, 3.0), (0.3, RATIO), (1.0, 1.5), (1.0, 6.0), (2.0, 1.05)]
EITHER = CarterGriffith | CohesiveZone


@pytest.fixture(scope="module")
def ellipse() -> CohesiveZone:
    return CohesiveZone(k_hat=0.3, static_to_kinetic=RATIO, contact="elliptic")


def order(size: FloatArray | list[float], error: FloatArray | list[float]) -> float:
    """Slope of the error over the size, both logarithmic."""
    return float(np.polyfit(np.log(size), np.log(np.abs(error)), 1)[0])


def nodes(n: int) -> tuple[FloatArray, FloatArray]:
    """Gauss's rule on 0 < t < pi/2."""
    place, weight = np.polynomial.legendre.leggauss(n)
    return 0.25 * np.pi * (place + 1.0), 0.25 * np.pi * weight


# --- against the half-space code CONTACT --------------------------------------------------------


def contact_curve(f_s: float, k_hat: float, size: float) -> tuple[FloatArray, FloatArray]:
    """Creepages, and by how much CONTACT's traction ratio is above the law's."""
    here = (CONTACT["f_s"] == f_s) & (CONTACT["k_hat"] == k_hat) & (CONTACT["element_size"] == size)
    rows = np.sort(CONTACT[here], order="normalized_creepage")
    x = rows["normalized_creepage"]
    assert x.size == 11
    law: EITHER = CarterGriffith(k_hat=0.0)
    if k_hat > 0.0:
        law = CohesiveZone(k_hat=k_hat, static_to_kinetic=f_s / 0.21)
    return x, rows["traction_ratio"] - law.traction_ratio(x)


@pytest.mark.parametrize(
    ("f_s", "k_hat", "size", "within"),
    [
        (0.33, 0.3, 0.005, 0.004),
        # CONTACT errs in proportion to its element size: twice of it where that is a/100.
        (0.33, 0.06, 0.01, 0.008),
        (0.45, 0.3, 0.01, 0.008),
        (0.21, 0.0, 0.02, 0.016),  # Carter's law, which has a closed form
    ],
)
def test_contact(f_s: float, k_hat: float, size: float, within: float) -> None:
    assert np.abs(contact_curve(f_s, k_hat, size)[1]).max() <= within


def test_contact_converges_to_the_law_with_its_own_first_order() -> None:
    sizes = [0.02, 0.01, 0.005]
    x, _ = contact_curve(0.33, 0.3, 0.005)
    errors = np.array([contact_curve(0.33, 0.3, size)[1] for size in sizes])
    # Where both the slip zone and the stick zone span many elements: at x = 1.3 the stick length
    # is 0.018 a, fewer than four of the finest.
    law = CohesiveZone(k_hat=0.3, static_to_kinetic=RATIO)
    wide = (1.0 - law.stick_boundary(x) > 0.1) & (1.0 + law.stick_boundary(x) > 0.5)
    assert wide.sum() == 8  # x from 0.4 to 1.1
    assert order(sizes, errors[:, wide].mean(axis=1)) == pytest.approx(1.0, abs=0.2)
    extrapolated = 2.0 * errors[2] - errors[1]
    assert np.abs(extrapolated[wide]).max() < 0.002  # of errors up to 0.0075
    assert np.abs(extrapolated).max() < 0.0035


# --- limits ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_papers_limit_is_reached_like_the_square_of_the_process_zone() -> None:
    x = np.array([0.4, 0.6, 0.8, 1.0, 1.2])
    limit = CarterGriffith(k_hat=0.3)
    ratios = np.array([3.0, 6.0, 12.0, 24.0])
    zones = 2.0 * np.pi * (0.3 / (ratios - 1.0)) ** 2  # 0.14 to 0.001 of a
    laws = [CohesiveZone(k_hat=0.3, static_to_kinetic=r) for r in ratios]
    distance = np.array([law.traction_ratio(x) - limit.traction_ratio(x) for law in laws])
    assert (distance < 0.0).all()  # the singularity's release is the larger one
    assert np.abs(distance[0]).max() < 0.003
    orders = np.array([order(zones[i : i + 2], np.abs(distance[i : i + 2, 2])) for i in range(3)])
    assert (np.diff(orders) > 0.0).all()  # 1.56, 1.84, 1.95
    np.testing.assert_allclose([order(zones[2:], e) for e in distance[2:].T], 2.0, atol=0.08)
    peaks = [law.peak.traction_ratio - limit.peak.traction_ratio for law in laws]
    assert order(zones[2:], peaks[2:]) == pytest.approx(2.0, abs=0.07)


def test_small_k_hat_tends_to_the_papers_limit() -> None:
    k_hats = [1e-2, 1e-3, 1e-4]
    near, whole = np.linspace(1.1, 1.6, 20), np.linspace(0.05, 2.0, 400)
    laws = [CohesiveZone(k_hat=k, static_to_kinetic=RATIO) for k in k_hats]
    limits = [CarterGriffith(k_hat=k) for k in k_hats]

    def distance(x: FloatArray | float) -> list[float]:
        return [
            float(np.abs(law.traction_ratio(x) - limit.traction_ratio(x)).max())
            for law, limit in zip(laws, limits, strict=True)
        ]

    worst = distance(whole)  # next to x = 1
    assert worst[1:] == pytest.approx([6e-7, 6e-9], rel=0.1)
    assert order(k_hats, worst) == pytest.approx(2.0, abs=0.05)
    # Beyond it the slip over the whole contact, not at a stick boundary, makes the difference.
    assert order(k_hats[1:], distance(near)[1:]) == pytest.approx(3.0, abs=0.03)
    # Before it the process zone counts, of the order k_hat**2: k_hat times its square.
    assert 4.5 < order(k_hats[:2], distance(0.5)[:2]) < 5.0


@pytest.mark.parametrize("contact", ["line", "elliptic"])
def test_below_the_smallest_k_hat_the_law_is_the_limit(contact: str) -> None:
    x, k_hat = np.linspace(-3.0, 3.0, 41), 0.99 * MIN_K_HAT[contact]
    law = CohesiveZone(k_hat=k_hat, static_to_kinetic=2.0, contact=contact)  # type: ignore[arg-type]
    limit = CarterGriffith(k_hat=k_hat, contact=contact)  # type: ignore[arg-type]
    np.testing.assert_array_equal(law.traction_ratio(x), limit.traction_ratio(x))
    np.testing.assert_array_equal(law.slope(x), limit.slope(x))
    np.testing.assert_array_equal(law.stick_boundary(x), limit.stick_boundary(x))
    assert law.peak == limit.peak
    assert law.sliding_creepage == np.inf
    assert law.corner is None
    with pytest.raises(ValueError, match=r"CohesiveZone\.k_hat = .* too small .* >= "):
        law.shear_traction(0.0, 0.5)
    with pytest.raises(ValueError, match=r"CohesiveZone\.k_hat = .* too small .* >= "):
        law.slip_rate(0.0, 0.5)


def test_at_the_smallest_k_hat_the_step_to_the_limit_cannot_be_seen() -> None:
    k_hat = MIN_K_HAT["line"]
    x = np.concatenate([np.linspace(0.05, 0.95, 10), 1.0 + np.geomspace(1e-8, 1.0, 30)])
    law, limit = CohesiveZone(k_hat=k_hat, static_to_kinetic=RATIO), CarterGriffith(k_hat=k_hat)
    np.testing.assert_allclose(law.traction_ratio(x), limit.traction_ratio(x), atol=1e-11)


@pytest.mark.parametrize(("k_hat", "ratio"), STATES[1:])  # the first has rounding left at 1e5
def test_tail_of_the_force_falls_like_creepage_to_minus_three_halves(
    k_hat: float, ratio: float
) -> None:
    law = CohesiveZone(k_hat=k_hat, static_to_kinetic=ratio)
    length = float(weakening_length(np.array(k_hat), ratio))
    x = max(length, 1.0) * np.array([1e3, 1e4, 1e5])
    above = law.traction_ratio(x) - 1.0
    assert order(x, above) == pytest.approx(-1.5, abs=1e-3)
    assert law.tail_decay == 1.5
    # Laplace: u = x s behind the leading edge, where the pressure is sqrt(2 s).
    laplace = (2.0 / np.pi) * (ratio - 1.0) * np.sqrt(2.0) * gamma(1.5) * (length / x) ** 1.5
    ends = above / laplace
    assert ends[0] == pytest.approx(1.0, abs=5e-3)
    assert ends[1] == pytest.approx(1.0, abs=5e-4)


# --- states ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("k_hat", "ratio"), STATES)
def test_stick_ends_without_a_step(k_hat: float, ratio: float) -> None:
    law = CohesiveZone(k_hat=k_hat, static_to_kinetic=ratio)
    end = law.sliding_creepage
    below, above = end * (1.0 - 1e-9), end * (1.0 + 1e-9)
    assert law.stick_boundary(below) < 1.0
    assert law.stick_boundary(above) == 1.0
    q = law.traction_ratio([below, above])
    assert q[0] == pytest.approx(q[1], abs=1e-8)
    slope = law.slope(end * np.array([1.0 - 1e-6, 1.0 + 1e-6]))
    assert slope[0] == pytest.approx(slope[1], abs=1e-5)
    # Each creepage has one state, and the stick zone shrinks with it.
    x = np.unique(np.concatenate([np.linspace(0.01, 1.5 * end, 300), end + np.geomspace(1e-9, 9)]))
    boundary = law.stick_boundary(x)
    assert (np.diff(boundary[x < end]) > 0.0).all()
    np.testing.assert_array_equal(boundary[x >= end], 1.0)
    top = law.peak
    assert law.slope(top.normalized_creepage) == pytest.approx(0.0, abs=1e-9)
    assert top.traction_ratio < ratio


@pytest.mark.slow
def test_twice_the_nodes_change_nothing() -> None:
    rng = np.random.default_rng(1)
    for i in range(240):
        k_hat, ratio = float(np.exp(rng.uniform(np.log(1e-6), np.log(2.0)))), rng.uniform(1.05, 6.0)
        length = min(1.0, float(weakening_length(np.array(k_hat), ratio)))
        size = float(np.exp(rng.uniform(np.log(0.01 * length), np.log(1.999))))
        state = ((2.0 - size, size, 0.0), (size, 2.0 - size, 0.0), (0.0, 2.0, 5.0 * size))[i % 3]
        n, q = enough_nodes(k_hat, ratio, EXPONENTIAL), []
        for used in (n, 2 * n):
            zones = solve_cohesive_zones(
                *(np.array([v]) for v in state),
                k_hat=np.array([k_hat]),
                static_to_kinetic=ratio,
                weakening=EXPONENTIAL,
                nodes=used,
            )
            stick = state[0]
            q.append(float((1.0 - 0.25 * stick**2 + stick * zones.release + zones.excess)[0]))
        assert q[0] == pytest.approx(q[1], abs=1e-9), (k_hat, ratio, state)


# --- along the contact ---------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("k_hat", "ratio"), STATES)
def test_traction_is_below_static_friction_and_slip_goes_forward(
    k_hat: float, ratio: float
) -> None:
    law = CohesiveZone(k_hat=k_hat, static_to_kinetic=ratio)
    end = law.sliding_creepage
    for x in (0.01, 0.3, 0.9 * end, end, 1.05 * end, 3.0 * end, 20.0):
        c = float(law.stick_boundary(x))
        apart = np.geomspace(1e-10, 1.0, 200)
        xi = np.unique(np.concatenate([c - apart * (1.0 + c), c + apart * (1.0 - c)]))
        xi = xi[np.abs(xi) < 1.0]
        pressure = np.sqrt(1.0 - xi**2)
        traction, rate = law.shear_traction(xi, x), law.slip_rate(xi, x)
        assert (traction <= ratio * pressure * (1.0 + 1e-9)).all()
        assert (traction >= 0.0).all()
        assert (rate >= 0.0).all()
        sticks = xi > c + 1e-9
        np.testing.assert_array_equal(rate[sticks], 0.0)
        # Where it slips the traction is friction, at the slip there.
        slips = xi < c - 1e-9
        friction = 1.0 + (ratio - 1.0) * np.exp(-law.slip(xi, x))
        np.testing.assert_allclose(traction[slips], (pressure * friction)[slips], rtol=1e-12)
        np.testing.assert_array_equal(law.shear_traction(xi, -x), -traction)
    np.testing.assert_array_equal(law.shear_traction([-1.5, 1.5], 0.5), 0.0)


def behind_and_ahead(
    c: float, w: float, n: int
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Gauss's rule over the slip zone and over the stick zone of a strip -w < xi < w.

    With xi = c -+ y**2 and y = Y sin(t): both ends are square roots.
    """
    t, weight = nodes(n)

    def rule(size: float, side: float) -> tuple[FloatArray, FloatArray]:
        y = np.sqrt(size) * np.sin(t)
        return c + side * y * y, weight * 2.0 * y * np.sqrt(size) * np.cos(t)

    return rule(w + c, -1.0), rule(max(w - c, 0.0), 1.0)


@pytest.mark.parametrize(("k_hat", "ratio"), STATES)
@pytest.mark.parametrize("x", [0.3, 0.8, 1.1, 2.0])
def test_force_and_energy(k_hat: float, ratio: float, x: float) -> None:
    law = CohesiveZone(k_hat=k_hat, static_to_kinetic=ratio)
    (slip, weight), (stick, stick_weight) = behind_and_ahead(float(law.stick_boundary(x)), 1.0, 80)
    traction = law.shear_traction(np.append(slip, stick), x)
    q = float(law.traction_ratio(x))
    force = float(traction @ np.append(weight, stick_weight))
    assert (2.0 / np.pi) * force == pytest.approx(q, abs=1e-8)
    # What rolling with creepage costs, all of it goes into friction.
    lost = float((weight * traction[: slip.size]) @ law.slip_rate(slip, x))
    assert lost == pytest.approx(0.5 * np.pi * q * x, abs=2e-7)


@pytest.mark.parametrize("k_hat", [0.0, 0.03, 0.3, 1.0, 2.0])
@pytest.mark.parametrize("x", [0.3, 0.8, 1.1, 2.0, 5.0])
def test_energy_of_the_limit_needs_the_fracture_at_the_stick_boundary(
    k_hat: float, x: float
) -> None:
    law = CarterGriffith(k_hat=k_hat)
    c = float(law.stick_boundary(x))
    (slip, weight), _ = behind_and_ahead(c, 1.0, 160)
    lost = float((weight * law.shear_traction(slip, x)) @ law.slip_rate(slip, x))
    fracture = 0.5 * np.pi * k_hat**2 * np.sqrt((1.0 - c) * (1.0 + c))
    assert lost + fracture == pytest.approx(
        0.5 * np.pi * x * float(law.traction_ratio(x)), abs=1e-9
    )


def lost_in_an_ellipse(law: EITHER, x: float, border: float, n: int, m: int) -> float:
    """Energy that friction and fracture take, over that of q = 1: strips on both sides of `border`.

    Strip of half-width w: traction and slip rate are w times those of a line contact, and so is
    xi; at k_hat/w its fracture takes (pi/2) (k_hat/w)**2 sqrt(1 - (c/w)**2) w**3.
    """
    place, weight = np.polynomial.legendre.leggauss(m)
    total = 0.0
    for low, high in pairwise([0.0, border, 0.5 * np.pi]):
        for angle, share in zip(
            0.5 * (high + low) + 0.5 * (high - low) * place,
            0.5 * (high - low) * weight,
            strict=True,
        ):
            eta, w = float(np.sin(angle)), float(np.cos(angle))
            c = float(law.stick_boundary(x, eta))
            (slip, over), _ = behind_and_ahead(c, w, n)
            lost = float((over * law.shear_traction(slip, x, eta)) @ law.slip_rate(slip, x, eta))
            if isinstance(law, CarterGriffith):
                lost += 0.5 * np.pi * law.k_hat**2 * np.sqrt(max(w * w - c * c, 0.0))
            total += 2.0 * share * w * lost
    return 1.5 / np.pi * total


# --- the ellipse ---------------------------------------------------------------------------------


def first_to_slip(law: CohesiveZone, x: float) -> float:
    """Angle of the strip in which stick just ends, w = cos(angle)."""

    def left(w: float) -> float:
        line = cohesive_zone.sliding_creepage(law.k_hat / w, law.static_to_kinetic, law.weakening)
        return w * line - x

    return 0.0 if left(1.0) < 0.0 else float(np.arccos(brentq(left, 0.05, 1.0, xtol=1e-12)))


def cubic(u: float) -> float:
    return 0.21 + 0.12 / (1.0 + u / 2e-6) ** 3


SAMPLES = Friction.from_samples([0.0, 1e-6, 2e-6, 5e-6], [0.33, 0.26, 0.22, 0.21])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("weakening", "k_hat", "x", "within"),
    [
        (EXPONENTIAL, 0.3, 0.6, 1e-8),
        (EXPONENTIAL, 0.3, 1.5, 1e-8),
        (Friction.from_function(cubic).weakening, 0.5, 1.5, 1e-8),
        pytest.param(SAMPLES.weakening, 1.0, 1.5, 3e-6, marks=pytest.mark.reference),
    ],
)
def test_ellipse_is_the_sum_of_its_strips(
    weakening: Weakening, k_hat: float, x: float, within: float
) -> None:
    ellipse = CohesiveZone(
        k_hat=k_hat, static_to_kinetic=RATIO, contact="elliptic", weakening=weakening
    )
    place, weight = np.polynomial.legendre.leggauss(24)
    total = 0.0
    for low, high in pairwise([0.0, first_to_slip(ellipse, x), 0.5 * np.pi]):
        for angle, share in zip(
            0.5 * (high + low) + 0.5 * (high - low) * place,
            0.5 * (high - low) * weight,
            strict=True,
        ):
            if high == low:
                continue
            w = float(np.cos(angle))
            material = {"static_to_kinetic": RATIO, "weakening": weakening}
            stick, edge = find_state(x / w, k_hat=ellipse.k_hat / w, **material)  # type: ignore[arg-type]
            zones = solve_cohesive_zones(
                *(np.array([v]) for v in (stick, 2.0 - stick, edge)),
                k_hat=np.array([ellipse.k_hat / w]),
                **material,  # type: ignore[arg-type]
            )
            q = 1.0 - 0.25 * stick**2 + stick * zones.release[0] + zones.excess[0]
            total += 1.5 * share * w**3 * q  # Eq. (24)
    assert total == pytest.approx(float(ellipse.traction_ratio(x)), abs=within)


@pytest.mark.parametrize(
    ("law", "x", "nodes", "within"),
    [
        *(
            (CarterGriffith(k_hat=k, contact="elliptic"), x, (100, 60), 1e-11)
            for k in (0.3, 1.0)
            for x in (0.5, 1.3)
        ),
        pytest.param(
            CohesiveZone(k_hat=0.3, static_to_kinetic=RATIO, contact="elliptic"),
            0.8,
            (60, 10),
            1e-7,
            marks=pytest.mark.slow,
        ),
    ],
)
def test_energy_of_an_ellipse(law: EITHER, x: float, nodes: tuple[int, int], within: float) -> None:
    border = float(np.arccos(0.5 * min(x, 1.0)))
    if isinstance(law, CohesiveZone):
        border = first_to_slip(law, x)
    lost = lost_in_an_ellipse(law, x, border, *nodes)
    assert lost == pytest.approx(x * float(law.traction_ratio(x)), abs=within)


# --- friction of the user's own ------------------------------------------------------------------


def gaussian(u: float) -> float:
    return 0.21 + 0.12 * float(np.exp(-((0.5 * np.sqrt(np.pi) * u / 1e-6) ** 2)))


@pytest.mark.parametrize("function", [gaussian, cubic])
def test_shape_matters_in_the_tail(function: Callable[[float], float]) -> None:
    friction = Friction.from_function(function, kinetic=0.21)
    assert friction.weakening_length == pytest.approx(1e-6, rel=1e-9)
    weakening = friction.weakening
    law = CohesiveZone(k_hat=0.3, static_to_kinetic=RATIO, weakening=weakening)
    usual = CohesiveZone(k_hat=0.3, static_to_kinetic=RATIO)
    x = np.array([1e3, 1e4, 1e5])
    tails = (law.traction_ratio(x) - 1.0) / (usual.traction_ratio(x) - 1.0)
    # Laplace, with Gamma(3/2) for the exponential.
    moment = quad(lambda s: 2.0 * s * s * float(weakening.fraction(np.array(s * s))), 0.0, 400.0)[0]
    assert abs(moment / gamma(1.5) - 1.0) > 0.15
    assert tails[-1] == pytest.approx(moment / gamma(1.5), abs=5e-4)


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize("contact", ["line", "elliptic"])
def test_no_value_without_convergence(contact: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cohesive_zone, "ITERATIONS", 1)
    law = CohesiveZone(k_hat=0.41, static_to_kinetic=1.77, contact=contact)  # type: ignore[arg-type]
    for use in (law.traction_ratio, law.slope, law.stick_boundary):
        with pytest.raises(ConvergenceError, match=r"k_hat .* static_to_kinetic 1\.77 .*residual"):
            use(0.7)
    with pytest.raises(ConvergenceError, match="does not converge"):
        law.shear_traction(0.0, 0.7)
    monkeypatch.undo()  # nothing of it is kept
    if contact == "line":
        assert 0.9 < law.traction_ratio(0.7) < 1.1


@pytest.mark.parametrize("k_hat", [0.05, 0.3, 2.0])
def test_slope_up_to_the_last_digit_before_stick_ends(k_hat: float) -> None:
    law = CohesiveZone(k_hat=k_hat, static_to_kinetic=RATIO)
    off = np.array([1e-6, 1e-9, 1e-12, 1e-15])
    slope = law.slope(law.sliding_creepage * (1.0 - off))
    np.testing.assert_allclose(slope, law.slope(law.sliding_creepage), atol=2e-5)


@pytest.mark.parametrize("contact", ["line", "elliptic"])
def test_smallest_and_largest_creepages(contact: Any) -> None:
    law = CohesiveZone(k_hat=0.3, static_to_kinetic=RATIO, contact=contact)
    small = np.array([1e-300, 1e-20, 1e-10])
    np.testing.assert_allclose(law.traction_ratio(small), law.slope(0.0) * small, rtol=1e-9)
    np.testing.assert_allclose(law.traction_ratio([1e14, 1e300]), 1.0, atol=1e-15)
    assert np.abs(law.slope([1e14, 1e300])).max() < 1e-20


@pytest.mark.slow
@pytest.mark.parametrize("k_hat", [1e-5, 1e-3])
def test_friction_with_a_long_tail_in_a_short_zone(k_hat: float) -> None:
    weakening = Friction.from_function(cubic).weakening
    law = CohesiveZone(k_hat=k_hat, static_to_kinetic=RATIO, weakening=weakening)
    x = np.array([0.2, 0.5, 0.8, 1.5])
    limit = CarterGriffith(k_hat=k_hat)
    np.testing.assert_allclose(law.traction_ratio(x), limit.traction_ratio(x), atol=1e-8)


@pytest.mark.slow
def test_sampled_friction_gives_the_force_that_more_nodes_give() -> None:
    law = CohesiveZone(k_hat=0.02, static_to_kinetic=RATIO, weakening=SAMPLES.weakening)
    stick, edge = np.array([1.5, 0.7, 0.1, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.1, 2.0])
    zones = solve_cohesive_zones(
        stick,
        2.0 - stick,
        edge,
        k_hat=np.full(5, law.k_hat),
        static_to_kinetic=RATIO,
        weakening=SAMPLES.weakening,
        nodes=364,
    )
    x = 1.0 - 0.5 * stick + edge + zones.release
    q = 1.0 - 0.25 * stick**2 + stick * zones.release + zones.excess
    np.testing.assert_allclose(law.traction_ratio(x), q, atol=2e-6)
