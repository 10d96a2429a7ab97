"""The law of lateral force with its table: CONTACT, reference solver, symmetries, derivatives."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from half_space import rolling_forces
from half_space_cases import contact_cases, creepages_of, forces_of
from lateral_spin_building import coefficients, samples, weakening_length

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.table import lateral_spin_table
from contactlib.table.lateral_spin_table import (
    ASPECTS,
    lateral_spin_coefficients,
    lateral_spin_scales,
)
from contactlib.table.law_tables import carter_griffith_table

LIMIT_LAW = carter_griffith_table("elliptic").native


def law_forces(
    a_over_b: float,
    nu: float,
    creepages: FloatArray,
    k_hat: float = 0.0,
    *,
    static_ratio: float = 11.0 / 7.0,
    law: kernel.NativeTable = LIMIT_LAW,
    layer_ratio: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Forces and derivatives, with the coefficients cubic in ln(a/b) over four knots."""
    place = math.log(a_over_b / ASPECTS[0]) / math.log(ASPECTS[1] / ASPECTS[0])
    first = min(max(math.floor(place) - 1, 0), len(ASPECTS) - 4)
    knots = np.arange(first, first + 4)
    weights = [np.prod([(place - m) / (k - m) for m in knots if m != k]) for k in knots]
    mixed = np.tensordot(weights, lateral_spin_coefficients(nu)[knots], 1)
    return kernel.lateral_spin_forces(
        law,
        a_over_b,
        nu,
        creepages,
        k_hat,
        mixed,
        static_ratio=static_ratio,
        layer_ratio=layer_ratio,
    )


def random_creepages(count: int, smallest: float = 0.01, largest: float = 10.0) -> FloatArray:
    """Directions without preference, sizes evenly spread in their logarithm."""
    rng = np.random.default_rng(1)
    creepages = rng.normal(size=(count, 3))
    creepages /= np.linalg.norm(creepages, axis=1, keepdims=True)
    sizes = np.exp(rng.uniform(math.log(smallest), math.log(largest), (count, 1)))
    return np.asarray(creepages * sizes)


@pytest.fixture(scope="module")
def of_contact() -> tuple[FloatArray, FloatArray, Any]:
    """Forces of the law and of CONTACT at all cases without weakening, and the cases' groups."""
    rows, forces = contact_cases("coulomb"), []
    for case, kalkers in zip(rows, creepages_of(rows), strict=True):
        creepages = -kalkers * lateral_spin_scales(case["a_over_b"], case["nu"])
        forces.append(law_forces(case["a_over_b"], case["nu"], creepages[np.newaxis])[0][0])
    return np.array(forces), forces_of(rows), rows["group"]


@pytest.mark.parametrize("group", ["lin", "long", "comb30", "comb90"])
def test_agreement_with_contact_without_spin(
    of_contact: tuple[FloatArray, FloatArray, Any], group: str
) -> None:
    forces, expected, groups = of_contact
    chosen = groups == group
    if group == "lin":  # a third of them with spin
        assert np.abs(forces - expected)[chosen].max() < 0.001
        return
    (x, y, moment), (true_x, true_y, true_moment) = forces[chosen].T, expected[chosen].T
    magnitude = np.hypot(x, y) - np.hypot(true_x, true_y)
    assert np.abs(magnitude).max() < (0.003 if group == "long" else 0.004)
    turned = np.angle((x + 1j * y) / (true_x + 1j * true_y), deg=True)
    assert np.abs(turned).max() < 1.0
    assert np.abs(moment - true_moment).max() < 0.01


@pytest.mark.parametrize("group", ["spin", "longspin", "latspin", "random"])
def test_agreement_with_contact_with_spin(
    of_contact: tuple[FloatArray, FloatArray, Any], group: str
) -> None:
    forces, expected, groups = of_contact
    error = (forces - expected)[groups == group]
    assert np.abs(error).max() < 0.03
    assert np.sqrt(np.mean(error**2, axis=0)).max() < 0.008


@pytest.mark.parametrize("k_hat", [0.0, 0.3])
def test_longitudinal_creepage_alone_is_todays_law(k_hat: float) -> None:
    x = np.linspace(-3.0, 3.0, 51)
    forces, _ = law_forces(1.3, 0.28, np.array([x, 0 * x, 0 * x]).T, k_hat)
    c = kernel.half_space_scales(1.3, 0.28).softening_x
    size, begin = np.abs(x), 1 / (1 - c) - 0.5
    t = np.clip(size - begin, 0.0, 1.0)
    left = 1 - c * (np.minimum(size, begin) + t - t**3 + t**4 / 2)
    expected, _ = LIMIT_LAW.evaluate(size * left, k_hat * np.sqrt(left))
    assert forces[:, 0] == pytest.approx(np.sign(x) * expected, abs=1e-14)
    assert not forces[:, 1:].any()


@pytest.mark.parametrize("k_hat", [0.0, 0.1, 0.4, 1.5])
@pytest.mark.parametrize("nu", [0.0, 0.28, 0.5])
@pytest.mark.parametrize("a_over_b", [0.25, 0.7, 1.0, 1.4, 4.0])
def test_creep_power_is_not_negative_and_force_within_friction(
    a_over_b: float, nu: float, k_hat: float
) -> None:
    """But for the splines' errors force stays within friction."""
    creepages = random_creepages(400, largest=30.0)
    forces, _ = law_forces(a_over_b, nu, creepages, k_hat)
    powers = forces * creepages / lateral_spin_scales(a_over_b, nu)
    assert np.all(powers.sum(axis=1) > 0.1 * np.abs(powers).sum(axis=1))
    if k_hat == 0.0:
        assert np.hypot(forces[:, 0], forces[:, 1]).max() < 1.006


def test_weakening_adds_nothing_to_spin_where_friction_does_not_fall() -> None:
    creepages = random_creepages(50)
    same, _ = law_forces(1.3, 0.28, creepages, 0.3, static_ratio=1.0)
    nearly, _ = law_forces(1.3, 0.28, creepages, 0.3, static_ratio=1.0 + 1e-9)
    assert nearly == pytest.approx(same, abs=1e-8)
    without, _ = law_forces(1.3, 0.28, creepages, 1e-9)
    assert without == pytest.approx(law_forces(1.3, 0.28, creepages)[0], abs=1e-7)


@pytest.mark.slow
def test_spline_of_few_samples() -> None:
    """Made again on another ellipse than the file's it gives the same forces."""
    u, forces = samples(1.4, 0.28, 200)
    assert len(u) >= 198
    of_weakening = np.zeros(lateral_spin_table.stored_shapes()[1])
    made_again = lateral_spin_table.coefficient_sets(
        coefficients(u, forces, 1.4, 0.28), of_weakening
    )
    creepages = u / (1.0 - np.sum(u**2, axis=1, keepdims=True))
    by_own, _ = kernel.lateral_spin_forces(LIMIT_LAW, 1.4, 0.28, creepages, 0.0, made_again)
    by_file, _ = law_forces(1.4, 0.28, creepages)
    for computed, of in ((by_own, forces), (by_file, forces), (by_file, by_own)):
        error = computed - of
        assert np.abs(error).max() < 0.03
        assert np.sqrt(np.mean(error**2)) < 0.005


@pytest.mark.parametrize("damage", ["short", "bit", "version", "empty"])
def test_damaged_file_is_named(
    damage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = lateral_spin_table.FILE.read_bytes()
    broken = {
        "short": kernel.framed(lateral_spin_table.MAGIC, lateral_spin_table.VERSION, data[24:-4]),
        "bit": data[:1000] + bytes([data[1000] ^ 1]) + data[1001:],
        "version": kernel.framed(
            lateral_spin_table.MAGIC, lateral_spin_table.VERSION + 1, data[24:]
        ),
        "empty": b"",
    }[damage]
    file = tmp_path / "lateral_spin.bin"
    file.write_bytes(broken)
    monkeypatch.setattr(lateral_spin_table, "FILE", file)
    with pytest.raises(ValueError, match=r"lateral_spin\.bin is damaged"):
        lateral_spin_coefficients(0.28)


@pytest.mark.parametrize("nu", [0.1, pytest.param(0.4, marks=pytest.mark.reference)])
@pytest.mark.parametrize(
    "a_over_b",
    [pytest.param(0.7, marks=pytest.mark.slow)]
    + [pytest.param(g, marks=pytest.mark.reference) for g in (0.18, 0.35, 1.4, 2.8, 5.7)],
)
def test_agreement_with_the_reference_between_the_knots(a_over_b: float, nu: float) -> None:
    """Ellipses and Poisson's ratios from which no coefficient was made."""
    creepages = random_creepages(100, 0.05, 5.0)
    true = rolling_forces(
        -creepages / lateral_spin_scales(a_over_b, nu), a_over_b=a_over_b, poisson_ratio=nu
    )
    solved = np.isfinite(true).all(axis=1)
    assert solved.mean() > 0.98
    error = (law_forces(a_over_b, nu, creepages)[0] - true)[solved]
    assert np.abs(error).max() < 0.04  # 0.03 but for lateral force at nu = 0.4
    assert np.sqrt(np.mean(error**2, axis=0)).max() < 0.008


def error_with_weakening(
    a_over_b: float,
    k_hat: float,
    static_ratio: float,
    count: int,
    law: kernel.NativeTable = LIMIT_LAW,
    nu: float = 0.28,
) -> FloatArray:
    """Error of both forces and the moment against the reference solver at random creepages."""
    creepages = random_creepages(count, 0.05, 5.0)
    true = rolling_forces(
        -creepages / lateral_spin_scales(a_over_b, nu),
        a_over_b=a_over_b,
        poisson_ratio=nu,
        static_ratio=static_ratio,
        weakening_length=weakening_length(a_over_b, nu, k_hat, static_ratio),
    )
    solved = np.isfinite(true).all(axis=1)
    assert solved.mean() > 0.98
    forces, _ = law_forces(a_over_b, nu, creepages, k_hat, static_ratio=static_ratio, law=law)
    return (forces - true)[solved]


@pytest.mark.slow
def test_agreement_with_the_reference_if_friction_weakens() -> None:
    """The law of a short process zone adds an error of its own, also without spin."""
    error = error_with_weakening(2.0, 0.35, 11.0 / 7.0, 25)
    assert np.all(np.abs(error).max(axis=0) < (0.05, 0.08, 0.04))
    assert np.all(np.sqrt(np.mean(error**2, axis=0)) < (0.018, 0.022, 0.012))


@pytest.mark.reference
@pytest.mark.parametrize("ratio", [1.2, 11.0 / 7.0, 15.0 / 7.0])
def test_agreement_with_the_reference_for_many_frictions(ratio: float) -> None:
    law = cl.table.cohesive_table("elliptic", ratio).native
    for a_over_b in (0.5, 0.7, 1.0, 1.4, 2.0):
        for k_hat in (0.1, 0.16, 0.35, 0.7):
            error = error_with_weakening(a_over_b, k_hat, ratio, 150, law)
            # The splines of weakening are those of 11/7.
            far = 2.5 if ratio > 2.0 else 1.0
            assert np.all(np.abs(error).max(axis=0) < far * np.array((0.04, 0.12, 0.07)))
            rms = np.sqrt(np.mean(error**2, axis=0))
            assert np.all(rms < far * np.array((0.006, 0.017, 0.01)))


@pytest.mark.slow
@pytest.mark.parametrize(("layer", "largest", "rms"), [(0.1, 0.03, 0.013), (1.0, 0.06, 0.025)])
def test_agreement_with_the_reference_with_a_layer(
    layer: float, largest: float, rms: float
) -> None:
    """Spin acts as with creepages that are smaller by the stiffness lost: an approximation."""
    stiff = layer * kernel.half_space_scales(1.0, 0.28).stiffness_x
    creepages = (1.0 + 1.9 * stiff) * random_creepages(20, 0.1, 3.0)
    true = rolling_forces(
        -creepages / lateral_spin_scales(1.0, 0.28),
        a_over_b=1.0,
        poisson_ratio=0.28,
        layer_ratio=layer,
        grids=((15, 8), (23, 8)),
    )
    error = np.abs(law_forces(1.0, 0.28, creepages, layer_ratio=stiff)[0] - true)
    assert error.max() < largest
    assert np.sqrt(np.mean(error**2)) < rms
