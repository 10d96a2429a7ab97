"""A measured curve has one peak, keeps its scales, and smooths no more than measurements bear."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contactlib import CarterGriffith, InputWarning, MeasuredCurve, TractionData
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder

EUROSPRINTER = package_folder("models") / "eurosprinter_engel1998.csv"
X = np.concatenate([np.geomspace(1e-6, 1e6, 4001), [1e12]])


@pytest.fixture(scope="module")
def locomotive() -> MeasuredCurve:
    return MeasuredCurve.from_csv(EUROSPRINTER)


def in_measured_terms(curve: MeasuredCurve, zeta: FloatArray) -> FloatArray:
    return np.asarray(curve.kinetic * curve.traction_ratio(zeta / curve.saturation_creepage))


@pytest.mark.filterwarnings("ignore:.*still rise")
@pytest.mark.parametrize("seed", range(8))
def test_one_peak_whatever_the_scatter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    zeta = rng.uniform(0.0, 0.1, 40)
    mu = 0.3 * CarterGriffith(k_hat=0.5).traction_ratio(zeta / 0.01) + rng.normal(0.0, 0.1, 40)
    mu = np.abs(mu)
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
    with pytest.warns(InputWarning, match="still rise at 5 %.* no peak and levels off at 0.83"):
        curve = MeasuredCurve(zeta, zeta / (zeta + 0.01))
    assert curve.peak.normalized_creepage == np.inf
    assert curve.peak.traction_ratio == pytest.approx(float(curve.traction_ratio(1e15)))


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


@pytest.mark.slow
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
        ({"cells": 2.5}, r"cells = 2\.5 must be a whole number"),
        ({"kinetic": 1e-310}, r"kinetic = 1e-310 is too small"),
    ],
)
def test_bad_options_are_refused_and_name_the_file(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=rf"engel1998\.csv: MeasuredCurve\.{message}"):
        MeasuredCurve.from_csv(EUROSPRINTER, **options)


def test_bad_points_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least 4 points"):
        MeasuredCurve([0.0, 0.1, 0.2, 0.3], [0.1] * 4)
    with pytest.raises(ValueError, match="not stay above zero"):
        MeasuredCurve([0.1, 0.2, 0.3, 0.4], [0.0] * 4)
    with pytest.raises(FileNotFoundError):
        MeasuredCurve.from_csv(tmp_path / "none.csv")


ZETA = np.array([0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.6, 2.5, 4.0, 6.0, 10.0, 15.0]) / 100.0
MU = 0.335 * np.tanh(ZETA / 0.004) * (0.75 + 0.25 * np.exp(-ZETA / 0.03))


@pytest.mark.parametrize("last", [8, 9, 10, 13])
def test_beyond_the_points_it_levels_off_where_they_end(last: int) -> None:
    curve = MeasuredCurve(ZETA[:last], MU[:last])
    beyond = curve.traction_coefficient(np.geomspace(ZETA[last - 1], 100.0, 50))
    assert (np.diff(beyond) <= 1e-15).all()
    assert beyond[-1] == pytest.approx(MU[last - 1], rel=0.015)


def test_a_steep_end_does_not_fall_below_zero() -> None:
    zeta = [0.002, 0.004, 0.006, 0.01, 0.015, 0.02, 0.03, 0.05]
    mu = np.array([0.1, 0.2, 0.28, 0.33, 0.3, 0.2, 0.09, 0.02])
    assert MeasuredCurve(zeta, mu).traction_coefficient(1e3) > 0.005
    dense = np.linspace(0.001, 0.05, 60)
    plunge = 0.3 * np.tanh(dense / 0.003) * (1.0 - (dense / 0.051) ** 2) ** 2
    with pytest.raises(ValueError, match=r"not stay above zero beyond .* 0\.0004524 at 5 %"):
        MeasuredCurve(dense, plunge)


def test_the_summary_reports_how_far_the_curve_is_from_the_points() -> None:
    curve = MeasuredCurve(np.append(0.0, ZETA), np.append(0.0, MU), name="my.csv")
    miss = curve.traction_coefficient(ZETA) - MU
    worst = np.abs(miss).argmax()
    assert curve.summary.startswith("my.csv: 14 points, 0 to 15 %; ")
    assert f"by at most {np.abs(miss[worst]):.2g} (at {100 * ZETA[worst]:.3g} %)" in curve.summary
    assert f"rms {np.sqrt(np.mean(miss**2)):.2g}; beyond 15 % it levels off" in curve.summary


@pytest.mark.parametrize("place", range(len(ZETA)))
def test_one_point_in_error_is_named(place: int) -> None:
    mu = MU.copy()
    mu[place] /= 10.0
    with pytest.warns(InputWarning, match=rf"my: the point of {mu[place]:.4g} at .* a typing"):
        MeasuredCurve(ZETA, mu, name="my")


@pytest.mark.parametrize("seed", range(5))
def test_scatter_is_no_error(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for scatter in (0.003, 0.01, 0.02):
        zeta = np.sort(rng.uniform(0.001, 0.12, 40))
        mu = 0.3 * np.tanh(zeta / 0.008) * (0.55 + 0.45 * np.exp(-zeta / 0.05))
        MeasuredCurve(zeta, np.abs(mu + rng.normal(0.0, scatter, zeta.size)))


def test_a_point_against_its_creepage_is_refused() -> None:
    mu = MU.copy()
    mu[6] = -mu[6]
    with pytest.raises(ValueError, match=r"point 7: the traction coefficient -0\.3.* 0\.012"):
        MeasuredCurve(ZETA, mu)
