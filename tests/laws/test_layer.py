"""A thin layer between wheel and rail: exact relations, limits, energy, and another program."""

from __future__ import annotations

import numpy as np
import pytest
from half_space import rolling_forces
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.laws import layer
from contactlib.laws.layer import behind, between_nodes, line_state, panels, states
from contactlib.table.lateral_spin_table import lateral_spin_scales

NU = 0.28
X = np.array([1e-3, 0.1, 0.5, 0.9, 1.0, 1.3, 3.0, 20.0])
# Line contact under Coulomb friction by another program, a panel method with an error below 1e-7:
# lam, c, sigma(lam/d), X0, q0.
COULOMB = [
    (0.03, -0.9989880123, 0.941697465, 0.003321666, 0.006255035),
    (0.2, -0.9989880123, 0.746910643, 0.009356350, 0.013975447),
    (0.2, 0.2585923401, 0.535553581, 0.916701732, 0.878798147),
    (1, 0.9833695295, 0.005265763, 11.917630535, 0.999678254),
    (1, 0.9242673642, 0.023538546, 6.014038298, 0.996862915),
    (3, 0.9886711796, 0.001200582, 40.746242392, 0.999818874),
    (10, -0.6055033758, 0.048615980, 5.202461831, 0.540378311),
]


def with_layer(k_hat: float, ratio: float, contact: str = "line") -> cl.CarterGriffith:
    return cl.CarterGriffith(k_hat=k_hat, contact=contact, layer_ratio=ratio)  # type: ignore[arg-type]


@pytest.mark.parametrize("lam_over_d", [1e-4, 0.01, 0.3, 4.0, 1e3])
def test_traction_at_the_stick_boundary_follows_from_energy(lam_over_d: float) -> None:
    state = states(lam_over_d, np.array([0.5]))
    (edge,) = between_nodes(state.full_stick, np.array([0.0]), np.array([1.0]))
    assert edge**2 == pytest.approx(np.pi * state.stiffness / lam_over_d, rel=2e-8)


@pytest.mark.parametrize(("lam", "c", "sigma", "creepage", "ratio"), COULOMB)
def test_another_program_gives_the_same(
    lam: float, c: float, sigma: float, creepage: float, ratio: float
) -> None:
    state = states(lam / (1.0 - c), np.array([0.5 * np.arccos(-c)]))
    assert state.stiffness == pytest.approx(sigma, abs=1e-8)
    assert state.creepage[0] == pytest.approx(creepage, rel=1e-8, abs=1e-8)
    assert 1.0 - state.slipped[0] == pytest.approx(ratio, abs=1e-8)
    q = with_layer(0.0, lam).traction_ratio(creepage)
    assert q == pytest.approx(ratio, abs=5e-8)  # by the interpolation of all states


@pytest.mark.parametrize("k_hat", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("contact", ["line", "elliptic"])
def test_slope_is_the_derivative(k_hat: float, contact: str) -> None:
    law = with_layer(k_hat, 0.4, contact)
    h = 1e-3 * X
    at = [law.traction_ratio(X + n * h) for n in (-2, -1, 1, 2)]
    assert_allclose(
        law.slope(X), (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * h), atol=2e-7
    )
    assert law.slope(0.0) == pytest.approx(law.traction_ratio(1e-9) / 1e-9, rel=1e-7)
    assert_allclose(law.traction_ratio(-X), -law.traction_ratio(X), rtol=0.0)


@pytest.mark.parametrize("contact", ["line", "elliptic"])
def test_a_vanishing_layer_is_none(contact: str) -> None:
    """The difference falls with the layer, but for a logarithm."""
    ratios = np.array([1e-3, 1e-4, 1e-5])
    for k_hat in (0.0, 0.3):
        without = cl.CarterGriffith(k_hat=k_hat, contact=contact).traction_ratio(X)  # type: ignore[arg-type]
        differences = [
            np.abs(with_layer(k_hat, r, contact).traction_ratio(X) - without).max() for r in ratios
        ]
        order = np.polyfit(np.log(ratios), np.log(differences), 1)[0]
        assert 0.6 < order < 1.1, (k_hat, differences)


def winkler(x: FloatArray, lam: float) -> FloatArray:
    """Springs alone: q = x (1 - xi)/lam where the surface sticks."""
    angle = np.arctan(x / lam)  # as x d/lam = p(c), d = 2 cos(angle)**2
    d = 2.0 * np.cos(angle) ** 2
    sliding = 2.0 * angle + 0.5 * np.sin(4.0 * angle) * -1.0  # twice the area of p behind c
    return np.asarray((0.5 * sliding + 0.5 * np.sin(2.0 * angle) * d) * 2.0 / np.pi)


def test_a_soft_layer_is_springs() -> None:
    ratios = np.array([1.0, 10.0, 100.0])
    differences = []
    for lam in ratios:
        x = lam * np.array([0.1, 1.0, 5.0])
        differences.append(np.abs(with_layer(0.0, lam).traction_ratio(x) - winkler(x, lam)).max())
    order = -np.polyfit(np.log(ratios), np.log(differences), 1)[0]
    assert 0.8 < order < 1.2, differences


@pytest.mark.parametrize(
    ("x", "k_hat", "lam"), [(0.3, 0.0, 0.3), (0.7, 0.3, 0.3), (1.5, 0.3, 0.03), (20.0, 0.3, 10.0)]
)
def test_work_is_dissipated(x: float, k_hat: float, lam: float) -> None:
    """Creepage times force is the work of sliding, of the sudden slip at c and of fracture."""
    law = with_layer(k_hat, lam)
    state = line_state(x, k_hat, lam)
    nodes, weights = np.polynomial.legendre.leggauss(300)
    v = 0.5 * (1.0 + nodes)
    place = v**3 * (10.0 - 15.0 * v + 6.0 * v**2)  # dense at both ends
    weight = 15.0 * v**2 * (1.0 - v) ** 2 * weights * (1.0 + state.c)
    xi = state.c - (1.0 + state.c) * place
    sliding = float(np.sum(law.shear_traction(xi, x) * law.slip_rate(xi, x) * weight))
    edge = np.sqrt((1.0 - state.c) * (1.0 + state.c))
    jump = float(law.shear_traction(state.c + 1e-12, x)) - edge
    assert jump == pytest.approx(k_hat * np.sqrt(np.pi * edge / lam), abs=1e-5)
    lost = sliding + edge * lam * jump + 0.5 * lam * jump**2
    assert lost == pytest.approx(0.5 * np.pi * x * float(law.traction_ratio(x)), rel=1e-5)


def test_traction_adds_up_to_the_force() -> None:
    grid = panels()
    for x, k_hat, lam in ((0.3, 0.0, 0.3), (2.0, 0.5, 1.0)):
        law = with_layer(k_hat, lam)
        c = float(law.stick_boundary(x))
        force = sum(
            (end - start)
            * float(law.shear_traction(start + (end - start) * grid.start, x) @ grid.weight)
            for start, end in ((-1.0, c - 1e-12), (c, 1.0))
        )
        assert force == pytest.approx(0.5 * np.pi * float(law.traction_ratio(x)), rel=1e-6)


@pytest.mark.parametrize("k_hat", [0.0, 0.05, 0.3])
def test_an_ellipse_is_its_strips(k_hat: float) -> None:
    """Summed by the midpoint rule over the width, as a vehicle tool would do it."""
    eta = (np.arange(4000) + 0.5) / 4000
    w = np.sqrt(1.0 - eta**2)
    for lam in (0.01, 0.5):
        for x in (0.2, 1.4):
            strips, _ = layer.line_with_layer(x / w, k_hat / w, lam / w)
            force = 1.5 * np.mean(w**2 * strips)
            law = with_layer(k_hat, lam, "elliptic")
            assert law.traction_ratio(x) == pytest.approx(force, abs=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_an_ellipse_agrees_with_half_spaces(aspect: float) -> None:
    """Along, across and obliquely, with the stiffness of the ellipse and what is lost of it."""
    table = cl.carter_griffith_table("elliptic").native
    scales = lateral_spin_scales(aspect, NU)
    for lam in (0.1, 0.3, 1.0, 5.0):
        x = (1.0 + 3.0 * lam) * np.array([0.1, 0.3, 0.6, 1.3])
        for angle, error in ((0.0, 0.003), (90.0, 0.003), (45.0, 0.007)):
            direction = [np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle)), 0.0]
            creepages = np.outer(x * 3.0 * (1.0 - NU) / np.pi, direction)
            forces = rolling_forces(
                -creepages,
                a_over_b=aspect,
                poisson_ratio=NU,
                layer_ratio=lam,
                grids=((15, 6), (23, 6)),
            )
            stiffness = kernel.half_space_scales(aspect, NU).stiffness_x
            computed, _ = kernel.lateral_spin_forces(
                table, aspect, NU, creepages * scales, layer_ratio=stiffness * lam
            )
            off = np.linalg.norm((computed - forces)[:, :2], axis=1).max()
            assert off <= error, (lam, angle, off)


def test_a_layer_flattens_and_lowers_the_curve() -> None:
    for contact in ("line", "elliptic"):
        laws = [with_layer(0.3, ratio, contact) for ratio in (0.0, 0.1, 1.0, 10.0)]
        slopes = [float(law.slope(0.0)) for law in laws]
        peaks = [law.peak for law in laws]
        assert (np.diff(slopes) < 0.0).all()
        assert (np.diff([p.normalized_creepage for p in peaks]) > 0.0).all()
        assert (np.diff([p.traction_ratio for p in peaks]) < 0.0).all()
        assert peaks[-1].traction_ratio > 1.0
    assert with_layer(0.0, 1.0).peak == (np.inf, 1.0)


def test_panels_integrate_what_they_are_made_for() -> None:
    grid = panels()
    assert grid.weight.sum() == pytest.approx(1.0, rel=1e-14)
    # (1/pi) int ln|(1-s)/(t-s)| ds and int ds/(s + h) in closed form
    t, rest = grid.start, grid.end
    exact = -(t * np.log(t) + rest * np.log(rest)) / np.pi
    assert_allclose(grid.potential.sum(axis=1), exact, atol=1e-13)
    h = np.array([1e-12, 1e-3, 1.0, 50.0])
    assert_allclose(behind(np.ones(t.size), h), np.log1p(1.0 / h), rtol=1e-12)
    assert layer.interpolants() is layer.interpolants()
