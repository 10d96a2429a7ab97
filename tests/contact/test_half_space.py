"""The half-space witness: closed forms, symmetries, energy, order, and the values of CONTACT."""

from __future__ import annotations

import csv
import functools
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from half_space import Grid, rolling_forces
from numpy.typing import NDArray
from scipy.integrate import quad

import contactlib as cl

QUICK = ((15, 6), (23, 6))
SPIN_AND_CREEPAGES = np.array([-0.3, 0.1, 0.15])


@functools.cache
def grid(columns: int) -> Grid:
    return Grid(2.0, 0.28, columns, 6)


@pytest.mark.parametrize(("a_over_b", "nu"), [(0.3, 0.0), (1.0, 0.28), (3.0, 0.5)])
def test_full_slip_strains_like_the_closed_form(a_over_b: float, nu: float) -> None:
    """Hertz's traction makes du/dx linear in x: at the edge the creepage of full slip."""
    of = Grid(a_over_b, nu, 11, 6)
    none = np.zeros_like(of.hertz)
    for direction, factor in enumerate((lambda c2: 1 - nu + nu * c2, lambda c2: 1 - nu * c2)):

        def strain(t: float, factor=factor) -> float:  # type: ignore[no-untyped-def]
            c2, s2 = math.cos(t) ** 2, math.sin(t) ** 2
            return float(factor(c2) * s2 / (c2 + a_over_b**2 * s2) ** 1.5)

        edge = 1.5 / math.pi * a_over_b**2 * quad(strain, 0, math.pi)[0]
        tractions = np.roll([of.hertz, none], direction, axis=0)
        strains = (of.influence_ahead @ tractions.ravel()).reshape(2, -1)
        ahead = of.rigid_ahead[2, of.hertz.size :]
        assert strains[direction] == pytest.approx(edge * ahead / math.sqrt(a_over_b), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("a_over_b", "nu"), [(0.3, 0.5), (1.0, 0.28), (3.0, 0.0)])
def test_small_creepages_converge_to_kalkers_coefficients(a_over_b: float, nu: float) -> None:
    """To first order only: the traction of full stick is singular at the trailing edge."""
    c11, c22, c23, c33 = cl.kalker_coefficients(a_over_b, nu)
    expected = np.array([[-c11, 0, 0], [0, -c22, c23], [0, -c23, -c33]])
    coarse, fine = (
        [
            1e4 * of.solve(case).forces - slope
            for case, slope in zip(1e-4 * np.eye(3), expected, strict=True)
        ]
        for of in (Grid(a_over_b, nu, 7, 4), Grid(a_over_b, nu, 15, 8))
    )
    for k in range(3):
        assert np.linalg.norm(fine[k]) < 0.03 * np.linalg.norm(expected[k])
        assert np.linalg.norm(fine[k]) < 0.7 * np.linalg.norm(coarse[k])


@pytest.mark.slow
def test_order_in_the_interval() -> None:
    """Between 3/2, for the root at the edge of stick, and 2; from much stick to full slip."""
    cases = [
        (-0.8, 0.0, 0.4),
        (-0.15, 0.05, 0.0),
        (-0.3, 0.1, 0.15),
        (0.0, 0.0, 0.3),
        (0.2, 0.3, 0.0),
    ]
    forces = [[grid(columns).solve(c).forces for c in cases] for columns in (9, 19, 39)]
    coarse, fine = (np.linalg.norm(np.subtract(*pair)) for pair in itertools.pairwise(forces))
    assert 1.4 < math.log2(coarse / fine) < 2.5


@pytest.mark.parametrize("static_ratio", [1.0, 1.6])
def test_mirror_images(static_ratio: float) -> None:
    """Mirrored across the rolling direction, and turned round."""
    mirror = np.array([1, -1, -1])
    forces = rolling_forces(
        SPIN_AND_CREEPAGES * [[1, 1, 1], mirror, [-1, -1, -1]],
        a_over_b=2.0,
        poisson_ratio=0.28,
        static_ratio=static_ratio,
        weakening_length=0.1,
        grids=QUICK,
    )
    assert forces[1] == pytest.approx(forces[0] * mirror, abs=1e-6)
    assert forces[2] == pytest.approx(-forces[0], abs=1e-6)


@pytest.mark.parametrize("static_ratio", [1.0, 1.6])
def test_isotropy_without_poissons_effect(static_ratio: float) -> None:
    """At nu = 0 displacement is parallel to traction, on any ellipse."""
    angle = np.linspace(0, math.pi, 5)
    forces = rolling_forces(
        -0.3 * np.array([np.cos(angle), np.sin(angle), 0 * angle]).T,
        a_over_b=2.0,
        poisson_ratio=0.0,
        static_ratio=static_ratio,
        weakening_length=0.1,
        grids=QUICK,
    )
    along = (forces[:, 0] + 1j * forces[:, 1]) * np.exp(-1j * angle)
    assert along == pytest.approx(np.full(5, along[0].real), abs=1e-6)
    assert 0.5 < along[0].real < 1.0
    assert forces[:, 2] == pytest.approx(forces[2, 2] * np.sin(angle), abs=1e-6)


@pytest.mark.parametrize("static_ratio", [1.0, 1.6])
def test_creep_power_is_dissipated(static_ratio: float) -> None:
    """The power of forces and creepages is what friction takes up on the grid, to second order."""
    rng = np.random.default_rng(5)
    missing = []
    for _ in range(6):
        creepage = rng.normal(size=3) * rng.choice([0.1, 0.3, 1.0])
        errors = []
        for columns in (9, 19):
            state = grid(columns).solve(creepage, static_ratio=static_ratio, weakening_length=0.2)
            work = (state.traction * state.slip).sum(axis=0)
            assert work.max() < 1e-4
            assert math.hypot(*state.forces[:2]) <= static_ratio
            power = -float(state.forces @ creepage)
            errors.append(abs(power + grid(columns).weight @ work) / power)
        missing.append(errors)
    coarse, fine = np.mean(missing, axis=0)
    assert fine < 0.05
    assert fine < 0.5 * coarse


def test_friction_that_never_weakens_is_static() -> None:
    common = {"a_over_b": 2.0, "poisson_ratio": 0.28, "grids": QUICK}
    strong = rolling_forces(SPIN_AND_CREEPAGES, static_ratio=1.6, weakening_length=1e9, **common)  # type: ignore[arg-type]
    coulomb = rolling_forces(SPIN_AND_CREEPAGES / 1.6, **common)  # type: ignore[arg-type]
    assert strong == pytest.approx(1.6 * coulomb, abs=1e-6)


def test_creepages_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match=r"creepage is .*nan.*: it must be finite"):
        grid(9).solve([math.nan, 0.0, 0.0])


Cases = list[dict[str, float]]


def contact_cases(name: str) -> Cases:
    with open(Path(__file__).with_name(name)) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    groups = {"": 0.0}
    return [
        {
            key: groups.setdefault(text, float(len(groups))) if key == "group" else float(text)
            for key, text in row.items()
        }
        for row in rows
    ]


def errors(cases: Cases, grids: tuple[tuple[int, int], tuple[int, int]]) -> NDArray[np.float64]:
    """Largest error of fx, fy and mz in each case; cases of one ellipse and friction."""
    first = cases[0]
    kinetic = first.get("mu", first.get("f_d", 0.0))
    unit = first["G"] * first["a"] * first["b"] / (kinetic * first["N"])
    side = math.sqrt(first["a"] * first["b"])
    forces = rolling_forces(
        [[unit * c["cksi"], unit * c["ceta"], unit * side * c["cphi"]] for c in cases],
        a_over_b=first["a_over_b"],
        poisson_ratio=first["nu"],
        static_ratio=first.get("f_s", kinetic) / kinetic,
        weakening_length=first.get("delta", 1.0) * unit / side,
        grids=grids,
    )
    expected = [[c["fx"], c["fy"], c["mz"]] for c in cases]
    return np.asarray(np.abs(forces - expected).max(axis=1))


@pytest.mark.slow
def test_agreement_with_contact() -> None:
    """A sample on quick grids."""
    coulomb = [c for c in contact_cases("contact_3d_coulomb.csv") if c["a_over_b"] == 1.0]
    assert errors([c for c in coulomb if c["cphi"] == 0.0], QUICK).max() < 0.004
    weak = [
        c
        for c in contact_cases("contact_3d_slip_weakening.csv")
        if (c["a_over_b"], c["f_s"], c["k_hat"]) == (1.0, 0.33, 0.3)
    ]
    assert len(weak) == 12
    assert errors(weak, QUICK).max() < 0.006


@pytest.mark.reference
@pytest.mark.parametrize("a_over_b", [0.5, 1.0, 2.0])
def test_agreement_with_all_cases_of_contact(a_over_b: float) -> None:
    """Without spin within CONTACT's own uncertainty and as much again; with spin see the module."""
    cases = [c for c in contact_cases("contact_3d_coulomb.csv") if c["a_over_b"] == a_over_b]
    assert len(cases) == 74
    error = errors(cases, ((23, 12), (31, 16)))
    uncertainty = np.array([c["uncertainty"] for c in cases])
    plain = np.array([c["cphi"] == 0.0 for c in cases])
    assert np.all(error[plain] <= 2.0 * uncertainty[plain])
    assert error[~plain].max() < 0.008
    assert math.sqrt(np.mean(error[~plain] ** 2)) < 0.002


@pytest.mark.reference
@pytest.mark.parametrize("a_over_b", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(
    ("static", "k_hat"), [(0.33, 0.15), (0.33, 0.3), (0.45, 0.15), (0.45, 0.3)]
)
def test_agreement_with_slip_weakening_of_contact(
    a_over_b: float, static: float, k_hat: float
) -> None:
    cases = [
        c
        for c in contact_cases("contact_3d_slip_weakening.csv")
        if (c["a_over_b"], c["f_s"], c["k_hat"]) == (a_over_b, static, k_hat)
    ]
    assert len(cases) == 12
    # The process zone is 0.11 a long in one of the four, and 0.4 a or more in the others.
    limit = 0.007 if (static, k_hat) == (0.45, 0.15) else 0.0025
    assert errors(cases, ((47, 8), (71, 8))).max() < limit
