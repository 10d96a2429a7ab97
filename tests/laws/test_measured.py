"""A measured curve has one peak, keeps its scales, and smooths no more than measurements bear."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contactlib as cl
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


def creep_curve(zeta: FloatArray, kinetic: float = 0.33, fall: float = 0.35) -> FloatArray:
    """A curve through zero that saturates at 1 % and falls, at creepages of either sign."""
    x = np.abs(zeta) / 0.01
    q = 1.0 - np.maximum(1.0 - x, 0.0) ** 2
    return np.asarray(np.sign(zeta) * kinetic * q * (1.0 - fall * (1.0 - np.exp(-x / 6.0))))


def doubts(zeta: FloatArray, mu: FloatArray, speed: FloatArray | None = None) -> list[str]:
    """Texts of the warnings of a measured curve."""
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always", InputWarning)
        MeasuredCurve(zeta, mu, speed=speed, name="my")
    return [str(warning.message) for warning in warned]


ONE_SIDE = 1e-2 * np.geomspace(0.1, 8.0, 20)
BOTH_SIDES = np.concatenate([-ONE_SIDE[::-1], ONE_SIDE])
FROM_ZERO = np.linspace(0.0, 0.08, 32)


@pytest.mark.parametrize("points", [FROM_ZERO, BOTH_SIDES])
@pytest.mark.parametrize("scatter", [0.0, 0.003, 0.008])
@pytest.mark.parametrize("offset", [-0.003, -0.0015, 0.0009, 0.002])
def test_an_offset_is_doubted_with_the_shift_that_removes_it(
    points: FloatArray, scatter: float, offset: float
) -> None:
    rng = np.random.default_rng(5)
    mu = creep_curve(points) + rng.normal(0.0, scatter, points.size)
    (text,) = doubts(points + offset, mu)
    what = "subtract" if offset > 0.0 else "add"
    match = re.search(rf"my: the points do not run through zero: .* {what} ([0-9.]+) %", text)
    assert match is not None, text
    assert float(match[1]) == pytest.approx(100.0 * abs(offset), rel=0.1, abs=0.02)
    assert doubts(points, mu) == []


def test_an_offset_of_points_on_one_side_is_doubted() -> None:
    for offset in (0.0015, 0.0025):
        (text,) = doubts(ONE_SIDE + offset, creep_curve(ONE_SIDE))
        assert f"subtract {100 * offset:.2g} %" in text, text
    zeta = np.array([0.15, 0.40, 0.66, 0.91, 1.16, 1.42, 1.67, 1.92, 2.4, 3.4, 5.0, 8.0]) / 100.0
    mu = [0.01935, 0.1376, 0.2074, 0.2694, 0.3, 0.317, 0.318, 0.316, 0.31, 0.29, 0.26, 0.21]
    (text,) = doubts(zeta, np.array(mu))  # the wheel's diameter is 0.1 % off
    assert re.search(r"subtract 0\.1[0-3]* %", text)


@pytest.mark.parametrize("scatter", [0.0, 0.003, 0.01])
def test_curves_that_differ_by_side_speed_or_place_are_doubted(scatter: float) -> None:
    rng = np.random.default_rng(6)
    noise = rng.normal(0.0, scatter, 40)
    speed = np.repeat([5.56, 22.2], 20)
    mixed = rng.permutation(40)
    twice = np.tile(ONE_SIDE, 2)
    for ratio in (0.8, 1.25):
        mu = np.append(creep_curve(ONE_SIDE), creep_curve(ONE_SIDE, 0.33 * ratio)) + noise
        side = np.append(np.ones(20), -np.ones(20))
        for lines, groups in (
            (doubts(side * twice, side * mu), "in traction are .*, those in braking"),
            (doubts(twice[mixed], mu[mixed], speed[mixed]), r"at 5\.56 m/s are .*at 22\.2 m/s"),
            (
                doubts(np.repeat(ONE_SIDE, 2), mu.reshape(2, -1).T.ravel()),
                "of the odd rows .*even rows",
            ),
            (doubts(twice, mu), "of the first half of the rows are .*, those of the second half"),
        ):
            (text,) = lines
            off = re.search(rf"systematic: the points {groups} ([-+][0-9.]+) %; are they", text)
            assert off is not None, text
            assert float(off[1]) == pytest.approx(100 * (ratio - 1) / (ratio + 1), abs=2.0)
    fallen = np.append(creep_curve(ONE_SIDE), creep_curve(ONE_SIDE, fall=0.7)) + noise
    assert "slip speed by cl.fit(..., slip_rate=True)" in doubts(twice, fallen, speed)[0]
    assert doubts(twice, np.tile(creep_curve(ONE_SIDE), 2) + noise, speed) == []


def test_the_summary_says_what_the_speed_does(tmp_path: Path) -> None:
    rows = zip(np.linspace(4.0, 20.0, 20), ONE_SIDE, creep_curve(ONE_SIDE), strict=True)
    path = tmp_path / "rig.csv"
    path.write_text("v,s [%],mu\n" + "".join(f"{v},{100 * z},{mu}\n" for v, z, mu in rows))
    curve = MeasuredCurve.from_csv(path, columns=("s", "mu", "v"))
    assert curve.summary.endswith("; the speeds, 4 to 20 m/s, do not enter it")
    assert "speeds" not in MeasuredCurve.from_csv(path, columns=("s", "mu")).summary


def test_a_fit_has_the_same_doubts() -> None:
    zeta, speed = np.tile(ONE_SIDE, 2), np.repeat([5.0, 20.0], 20)
    mu = np.append(creep_curve(ONE_SIDE), creep_curve(ONE_SIDE, 0.25))
    given: dict[str, Any] = {"k_hat": 0.0, "contact": "line"}
    fitted = cl.fit(CarterGriffith, TractionData(zeta, mu, speed), **given)
    assert any("systematic: the points at 5 m/s" in text for text in fitted.doubts)
    assert set(fitted.doubts) <= set(fitted.caveats)
    shifted = TractionData(BOTH_SIDES + 0.002, creep_curve(BOTH_SIDES, fall=0.0))
    assert "subtract 0.2 % from" in cl.fit(CarterGriffith, shifted, **given).doubts[0]
    right = TractionData(BOTH_SIDES, creep_curve(BOTH_SIDES, fall=0.0))
    assert cl.fit(CarterGriffith, right, **given).doubts == ()
