"""The cohesive law with a layer: another program, energy, limits, and a layer of some thickness."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cohesive_layer import CohesiveZoneWithLayer, solve_zones
from half_space import rolling_forces
from scipy.optimize import brentq

from contactlib import CarterGriffith, CohesiveZone, kernel
from contactlib.base.quantities import FloatArray
from contactlib.laws import EXPONENTIAL
from contactlib.laws.cohesive_layer import snap
from contactlib.laws.layer import states

RATIO = 11.0 / 7.0
X = np.array([1e-3, 0.1, 0.5, 0.9, 1.0, 1.3, 3.0, 20.0])
# Line contact by another program, a panel method: k_hat, lam, c, x, q at f_s/f_d = 11/7.
ROWS = np.genfromtxt(
    Path(__file__).with_name("layer_slip_weakening.csv"), delimiter=",", names=True, skip_header=2
)


def with_layer(k_hat: float, ratio: float, contact: str = "line") -> CohesiveZoneWithLayer:
    return CohesiveZoneWithLayer(
        k_hat=k_hat,
        static_to_kinetic=RATIO,
        layer_ratio=ratio,
        contact=contact,  # type: ignore[arg-type]
    )


def log_t(c: float) -> float:
    return float(0.25 * np.log((1.0 + c) / (1.0 - c)))


def test_another_program_gives_the_same() -> None:
    for row in ROWS:
        state = solve_zones(log_t(row["c"]), row["k_hat"], row["lam"], RATIO, EXPONENTIAL)
        assert state.creepage == pytest.approx(row["x"], rel=2e-6)
        assert state.ratio == pytest.approx(row["q"], abs=2e-7)


def test_values_are_those_of_states() -> None:
    law = with_layer(0.3, 0.03)
    for at in (-1.7, 0.9, 2.6):
        state = solve_zones(at, 0.3, 0.03, RATIO, EXPONENTIAL)
        assert law.traction_ratio(state.creepage) == pytest.approx(state.ratio, abs=1e-8)
        assert law.stick_boundary(state.creepage) == pytest.approx(np.tanh(2.0 * at), abs=1e-8)
    x, h = np.array([0.5, 1.3]), 1e-3
    rise = law.traction_ratio(x + h) - law.traction_ratio(x - h)
    np.testing.assert_allclose(law.slope(x), rise / (2.0 * h), atol=1e-4)
    assert law.slope(0.0) == pytest.approx(law.traction_ratio(1e-6) / 1e-6, rel=1e-6)


def test_springs_snap_where_energies_are_equal() -> None:
    for softness in (1.01, 1.5, 4.0, 1e4):
        v, strength = snap(softness, EXPONENTIAL)
        released = 1.0 - np.exp(-v) * (1.0 + v)
        assert v**2 / (2.0 * released) == pytest.approx(softness, rel=1e-8)
        assert strength == pytest.approx(np.exp(-v) + v / softness, rel=1e-12)
    assert snap(0.99, EXPONENTIAL) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("k_hat", "lam", "x"), [(0.3, 0.03, 1.2), (0.3, 1.0, 1.0), (0.3, 1.0, 5.0)]
)
def test_work_is_dissipated(k_hat: float, lam: float, x: float) -> None:
    """Creepage times force is the work of sliding and of the sudden slip at c."""
    law = with_layer(k_hat, lam)
    c = float(law.stick_boundary(x))
    nodes, weights = np.polynomial.legendre.leggauss(400)
    v = 0.5 * (1.0 + nodes)
    xi = c - (1.0 + c) * v**3 * (10.0 - 15.0 * v + 6.0 * v**2)  # dense at both ends
    weight = 15.0 * v**2 * (1.0 - v) ** 2 * weights * (1.0 + c)
    sliding = float(np.sum(law.shear_traction(xi, x) * law.slip_rate(xi, x) * weight))
    sudden, edge = float(law.slip(c - 1e-13, x)), np.sqrt((1.0 - c) * (1.0 + c))
    length = 0.5 * np.pi * k_hat**2 / (RATIO - 1.0)
    lost = sliding + length * edge * (sudden - (RATIO - 1.0) * np.expm1(-sudden))
    assert lost == pytest.approx(0.5 * np.pi * x * float(law.traction_ratio(x)), rel=1e-6)


@pytest.mark.slow
def test_a_vanishing_layer_is_none() -> None:
    ratios = np.array([1e-2, 1e-3, 1e-4])
    without = CohesiveZone(k_hat=0.3, static_to_kinetic=RATIO).traction_ratio(X)
    errors = [np.abs(with_layer(0.3, r).traction_ratio(X) - without).max() for r in ratios]
    assert 0.85 < np.polyfit(np.log(ratios), np.log(errors), 1)[0] < 1.05


@pytest.mark.slow
def test_a_zone_that_snaps_as_a_whole_is_the_papers_limit() -> None:
    """Both for a shorter zone and for a softer layer, and fast: like exp(-sqrt(2 S))."""
    for laws in (
        [(0.15, 0.3), (0.05, 0.3), (0.02, 0.3)],
        [(0.15, 0.3), (0.15, 3.0), (0.15, 30.0)],
    ):
        errors = []
        for k_hat, lam in laws:
            limit = CarterGriffith(k_hat=k_hat, layer_ratio=lam).traction_ratio((1.0 + lam) * X)
            errors.append(
                np.abs(with_layer(k_hat, lam).traction_ratio((1.0 + lam) * X) - limit).max()
            )
        assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2]
        assert errors[2] < 1e-5


def thick_layer(r: float, lam: float, thickness: float, c: float, n: int) -> float:
    """Traction ratio at k_hat 0.3, f_s/f_d = r: a layer of the compliance lam tanh(k h)/(k h).

    k is the wave number. It does not snap: traction is continuous, linear between n nodes on each
    side of c.
    """
    step = 1.0 / n
    xi = c - (1.0 + c) + step * np.arange(2 * n + 1)
    apart = xi[:, None] - xi

    def twice(v: FloatArray) -> FloatArray:
        """Twice the integral of ln|v|."""
        return 0.5 * v**2 * (np.log(np.maximum(np.abs(v), 1e-300)) - 1.5)

    log = (twice(apart + step) - 2.0 * twice(apart) + twice(apart - step)) / step
    # The layer's kernel, (lam/(pi h)) ln coth(pi |v|/(4 h)), is a logarithm and a smooth rest.
    v = 0.25 * np.pi * np.abs(apart) / thickness
    rest = np.log(np.where(v > 1e-9, v / np.tanh(np.maximum(v, 1e-9)), 1.0)) * step
    shear = lam / (np.pi * thickness) * (rest - log - np.log(0.25 * np.pi / thickness) * step)
    body = (log[-1] - log) / np.pi
    compliance = (shear - shear[-1] + body)[:-1, :-1]  # displacement since the leading edge
    lead, pressure = 1.0 - xi[:-1], np.sqrt(np.maximum(1.0 - xi[:-1] ** 2, 0.0))
    length, drop = 0.5 * np.pi * 0.3**2 / (RATIO - 1.0), (r - 1.0) * pressure
    # Unknown: slip behind c, x, and the traction ahead of c, where slip is zero.
    slip, x, stuck = np.full(n, 5.0 * length), 3.0, 0.5 * pressure[n + 1 :]
    for _ in range(100):
        left = np.exp(-slip / length)
        behind = pressure[:n] + drop[:n] * left
        q = np.concatenate([behind, [r * pressure[n]], stuck])
        off = x * lead - compliance @ q
        off[:n] -= slip
        matrix = -compliance.copy()
        matrix[:, :n] *= -drop[:n] * left / length
        matrix[np.arange(n), np.arange(n)] -= 1.0
        matrix[:, n] = lead
        change = -np.linalg.solve(matrix, off)
        slip = np.maximum(slip + np.clip(change[:n], -length, np.inf), 0.0)
        x, stuck = x + change[n], stuck + change[n + 1 :]
        if np.abs(change).max() < 1e-10:
            return float(2.0 / np.pi * step * q.sum())
    raise AssertionError("no convergence")


@pytest.mark.slow
def test_a_thin_layer_of_finite_thickness_snaps_as_springs_do() -> None:
    state = solve_zones(0.0, 0.3, 3.0, RATIO, EXPONENTIAL)
    energy = state.ratio - 1.0 + float(states(3.0, np.array([0.25 * np.pi])).slipped[0])
    assert energy == pytest.approx(0.0922, abs=5e-5)  # letting go at f_s p would give 0.173
    off = []
    for thickness in (0.1, 0.05):
        gain = [
            thick_layer(RATIO, 3.0, thickness, 0.0, n) - thick_layer(1.0, 3.0, thickness, 0.0, n)
            for n in (200, 400)
        ]
        off.append((4.0 * gain[1] - gain[0]) / 3.0 - energy)
    np.testing.assert_allclose(off, [0.0018, 0.0006], atol=1e-4)


@pytest.mark.slow
def test_an_ellipse_is_its_strips() -> None:
    law, eta, positions = with_layer(0.3, 1.0, "elliptic"), 0.6, np.array([-0.5, 0.0, 0.5])
    strip = with_layer(0.3 / 0.8, 1.0 / 0.8)
    for name in ("shear_traction", "slip_rate"):
        whole = getattr(law, name)(positions, 1.2, eta)
        of_strip = 0.8 * getattr(strip, name)(positions / 0.8, 1.2 / 0.8)
        np.testing.assert_allclose(whole, of_strip, atol=1e-6)


@pytest.mark.slow
def test_an_ellipse_agrees_with_half_spaces() -> None:
    """With friction that weakens, where springs do not snap: on a grid they let go by strength."""
    nu, k_hat, lam, x = 0.28, 0.3, 0.3, 1.14
    scales = kernel.half_space_scales(1.0, nu)
    (expected, *_) = rolling_forces(
        [-3.0 * (1.0 - nu) / np.pi * x, 0.0, 0.0],
        a_over_b=1.0,
        poisson_ratio=nu,
        layer_ratio=lam,
        static_ratio=RATIO,
        weakening_length=1.5 * (1.0 - nu) * k_hat**2 / (RATIO - 1.0),
        grids=((31, 6), (47, 6)),
    )
    size, stiff = scales.stiffness_x * x, scales.stiffness_x * lam
    end = 1.0 / (1.0 - scales.softening_x)
    v = brentq(lambda v: end * v**2 / (1.0 + v**2) + stiff * v - size, 0.0, 1.0 + size / stiff)
    slips, share = end * v**2 / (1.0 + v**2), 0.5 * stiff / (stiff + 0.14)  # fmu/kernel/stiffness.h
    left = 1.0 - scales.softening_x * (share + (1.0 - share) * slips)
    law = with_layer(k_hat * np.sqrt(scales.stiffness_x * left), stiff * left, "elliptic")
    assert law.traction_ratio(size * left) == pytest.approx(expected, abs=0.005)
