"""A measured curve has one peak, keeps its scales, and smooths no more than measurements bear."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contactlib import CarterGriffith, MeasuredCurve, TractionData
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder

EUROSPRINTER = package_folder("models") / "eurosprinter_engel1998.csv"
X = np.concatenate([np.geomspace(1e-6, 1e6, 4001), [1e12]])


@pytest.fixture(scope="module")
def locomotive() -> MeasuredCurve:
    return MeasuredCurve.from_csv(EUROSPRINTER)


def in_measured_terms(curve: MeasuredCurve, zeta: FloatArray) -> FloatArray:
    return np.asarray(curve.kinetic * curve.traction_ratio(zeta / curve.saturation_creepage))


@pytest.mark.parametrize("seed", range(8))
def test_one_peak_whatever_the_scatter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    zeta = rng.uniform(0.0, 0.1, 40)
    mu = 0.3 * CarterGriffith(k_hat=0.5).traction_ratio(zeta / 0.01) + rng.normal(0.0, 0.1, 40)
    curve = MeasuredCurve(zeta, mu, smoothing=1e-12)
    q = curve.traction_ratio(X)
    direction = np.sign(np.diff(q))[np.abs(np.diff(q)) > 1e-13]
    assert np.count_nonzero(np.diff(direction)) <= 1
    assert direction[0] > 0.0
    assert curve.peak.traction_ratio >= q.max()
    if np.isfinite(curve.peak.normalized_creepage):
        top = curve.traction_ratio(curve.peak.normalized_creepage)
        assert float(top) == pytest.approx(curve.peak.traction_ratio, rel=1e-12)


def test_a_curve_that_never_falls_peaks_at_infinity() -> None:
    zeta = np.linspace(0.001, 0.05, 30)
    curve = MeasuredCurve(zeta, zeta / (zeta + 0.01))
    assert curve.peak.normalized_creepage == np.inf
    assert curve.peak.traction_ratio == pytest.approx(float(curve.traction_ratio(1e15)))


def test_points_of_such_a_curve_give_the_curve_back(locomotive: MeasuredCurve) -> None:
    zeta = locomotive.saturation_creepage * np.geomspace(0.01, 1000.0, 500)
    mu = in_measured_terms(locomotive, zeta)
    again = MeasuredCurve(
        zeta, mu, saturation_creepage=locomotive.saturation_creepage, smoothing=1e-16
    )
    np.testing.assert_allclose(in_measured_terms(again, zeta), mu, atol=1e-7)


def test_it_follows_a_smooth_law_without_noise() -> None:
    # Carter-Griffith's own bend near x = 1 is sharper than a sixteenth of u: hence not closer.
    law = CarterGriffith(k_hat=0.5)
    zeta = 0.01 * np.geomspace(0.02, 20.0, 200)
    curve = MeasuredCurve(zeta, 0.3 * law.traction_ratio(zeta / 0.01))
    np.testing.assert_allclose(
        in_measured_terms(curve, zeta), 0.3 * law.traction_ratio(zeta / 0.01), atol=0.003
    )


def test_scales(locomotive: MeasuredCurve) -> None:
    data = TractionData.from_csv(EUROSPRINTER)
    # By default the traction ratio at the last point is one, as it is of laws without weakening.
    last = data.creepage.max() / locomotive.saturation_creepage
    assert float(locomotive.traction_ratio(last)) == pytest.approx(1.0)
    other = MeasuredCurve.from_csv(EUROSPRINTER, kinetic=0.3)
    zeta = np.geomspace(1e-4, 1.0, 50)
    np.testing.assert_allclose(
        in_measured_terms(other, zeta), in_measured_terms(locomotive, zeta), rtol=1e-14
    )
    assert other.kinetic == 0.3
    assert (
        MeasuredCurve.from_csv(EUROSPRINTER, saturation_creepage=0.01).saturation_creepage == 0.01
    )


def test_the_default_saturation_creepage_is_carters() -> None:
    zeta = np.linspace(0.0005, 0.05, 100)
    mu = 0.3 * CarterGriffith(k_hat=0.0).traction_ratio(zeta / 0.012)
    curve = MeasuredCurve(zeta, mu)
    assert curve.saturation_creepage == pytest.approx(0.012, rel=0.02)  # of 200 candidates
    assert float(curve.slope(0.0)) == pytest.approx(2.0, rel=0.1)


def test_curvature_is_continuous(locomotive: MeasuredCurve) -> None:
    knots = np.arange(1, 16) / 16.0
    x = knots / (1.0 - knots)
    h = 1e-5 * x
    right = (locomotive.slope(x + h) - locomotive.slope(x)) / h
    left = (locomotive.slope(x) - locomotive.slope(x - h)) / h
    np.testing.assert_allclose(right, left, atol=2e-3 * np.abs(right).max())


def test_slope_is_the_derivative(locomotive: MeasuredCurve) -> None:
    x = np.geomspace(1e-3, 1e3, 200)
    h = 1e-4 * x
    rise = locomotive.traction_ratio(x + h) - locomotive.traction_ratio(x - h)
    np.testing.assert_allclose(rise / (2.0 * h), locomotive.slope(x), atol=1e-6)


def test_odd_exact_at_the_origin_and_shape_preserving(locomotive: MeasuredCurve) -> None:
    x = np.linspace(0.0, 5.0, 24).reshape(2, 3, 4)
    np.testing.assert_array_equal(locomotive.traction_ratio(-x), -locomotive.traction_ratio(x))
    np.testing.assert_array_equal(locomotive.slope(-x), locomotive.slope(x))
    assert locomotive.traction_ratio(x).shape == locomotive.slope(x).shape == x.shape
    assert locomotive.traction_ratio(0.0) == 0.0
    secant = locomotive.traction_ratio(1e-12) / 1e-12
    assert float(secant) == pytest.approx(float(locomotive.slope(0.0)), rel=1e-10)


def test_mirrored_points_and_points_without_creepage_change_nothing() -> None:
    data = TractionData.from_csv(EUROSPRINTER)
    sign = np.where(np.arange(151) % 2, 1.0, -1.0)
    mirrored = MeasuredCurve(
        np.append(sign * data.creepage, 0.0), np.append(sign * data.traction_coefficient, 0.7)
    )
    plain = MeasuredCurve(data.creepage, data.traction_coefficient)
    np.testing.assert_array_equal(mirrored.traction_ratio(X), plain.traction_ratio(X))


def left_out_error(smoothing: float) -> float:
    """Root mean square error at left-out tenths of the measured points."""
    data = TractionData.from_csv(EUROSPRINTER)
    zeta, mu = data.creepage, data.traction_coefficient
    misses = []
    for seed in range(3):
        tenth = np.random.default_rng(seed).permutation(151) % 10
        for out in (tenth == k for k in range(10)):
            curve = MeasuredCurve(zeta[~out], mu[~out], smoothing=smoothing)
            misses.append(mu[out] - in_measured_terms(curve, zeta[out]))
    return float(np.sqrt(np.mean(np.concatenate(misses) ** 2)))


def test_default_smoothing_is_the_strongest_that_costs_nothing(locomotive: MeasuredCurve) -> None:
    data = TractionData.from_csv(EUROSPRINTER)
    miss = data.traction_coefficient - in_measured_terms(locomotive, data.creepage)
    assert float(np.sqrt(np.mean(miss**2))) == pytest.approx(0.0244, abs=1e-4)
    error = {smoothing: left_out_error(smoothing) for smoothing in (1e-9, 1e-7, 1e-5)}
    assert error[1e-7] == pytest.approx(0.0257, abs=3e-4)
    assert error[1e-7] < 1.005 * error[1e-9]
    assert error[1e-5] > 1.03 * error[1e-7]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kinetic": 0.0}, r"kinetic = 0\.0"),
        ({"saturation_creepage": -1.0}, r"saturation_creepage = -1\.0"),
        ({"cells": 1}, r"cells = 1"),
        ({"cells": 2.5}, r"cells = 2\.5 must be a whole number"),
        ({"kinetic": 1e-310}, r"kinetic = 1e-310 is too small"),
        ({"smoothing": 0.0}, r"smoothing = 0\.0"),
    ],
)
def test_bad_options_are_refused_and_name_the_file(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=rf"engel1998\.csv: MeasuredCurve\.{message}"):
        MeasuredCurve.from_csv(EUROSPRINTER, **options)


def test_bad_points_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least 4 points"):
        MeasuredCurve([0.0, 0.1, 0.2, 0.3], [0.1] * 4)
    with pytest.raises(ValueError, match="kinetic = -"):
        MeasuredCurve([0.1, 0.2, 0.3, 0.4], [-0.1] * 4)
    with pytest.raises(FileNotFoundError):
        MeasuredCurve.from_csv(tmp_path / "none.csv")
