"""Distributions of random samples and what they depend on."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_checks import check_all
from map_data import CONTROLLERS, DESCRIBED, legend_texts, numbers, sampled
from matplotlib.patches import Rectangle
from numpy.testing import assert_allclose

from contactlib.figures import map_figure
from contactlib.figures.maps.samples import rank_correlation


def test_sample_shows_the_distribution(tmp_path: Path) -> None:
    figure = map_figure(sampled(), "adhesion_utilisation")
    check_all(figure, tmp_path)
    axes = figure.axes[0]
    curves = [line for line in axes.lines if line.get_linestyle() != "None"]
    points = [line for line in axes.lines if line.get_linestyle() == "None"]
    for curve, point, name in zip(curves, points, CONTROLLERS, strict=False):
        values = 100.0 * sampled()["adhesion_utilisation"].sel(controller=name).dropna("run").values
        x, share = map(numbers, curve.get_data())
        assert_allclose(
            share, [100.0 * np.mean(values <= at) for at in x], atol=100.0 / values.size
        )
        at, part = map(numbers, point.get_data())
        for value, percent in zip(at, part, strict=True):
            assert np.mean(values <= value) >= percent / 100.0 > np.mean(values < value)
    assert any("3 failed" in text for text in legend_texts(figure))


def test_share_without_limit_is_missing_at_the_top(tmp_path: Path) -> None:
    figure = map_figure(sampled(), "clearing_time")
    check_all(figure, tmp_path)
    endless = float(np.isinf(sampled()["clearing_time"]).mean())
    top = numbers(figure.axes[0].lines[0].get_ydata()).max()
    assert float(top) == pytest.approx(100.0 * (1.0 - endless), abs=0.51)
    (text, _) = legend_texts(figure)
    assert f"{100.0 * endless:.3g} %: survives any length" in text


def test_strongest_parameter_comes_first() -> None:
    figure = map_figure(sampled(), "adhesion_utilisation")
    bars, scatter = figure.axes[1], figure.axes[2]
    assert bars.get_yticklabels()[0].get_text().replace("\n", " ") == DESCRIBED["friction"][1]
    assert scatter.get_xlabel().startswith(DESCRIBED["friction"][1])
    upper, lower = (container[0].get_width() for container in bars.containers)
    friction = sampled()["friction"].values
    for width, name in ((upper, "open_loop"), (lower, "threshold")):
        values = sampled()["adhesion_utilisation"].sel(controller=name).values
        known = ~np.isnan(values)
        d = np.argsort(np.argsort(friction[known])) - np.argsort(np.argsort(values[known]))
        n = int(known.sum())
        assert width == pytest.approx(1.0 - 6.0 * np.sum(d**2) / (n * (n**2 - 1.0)))
    assert upper > 0.9
    assert lower < -0.5


def test_a_rise_and_fall_is_not_seen_and_that_is_reported() -> None:
    x = np.linspace(-1.0, 1.0, 201)
    assert abs(rank_correlation(x, x**2)) < 1e-2
    assert rank_correlation(x, x**3) == pytest.approx(1.0)
    figure = map_figure(sampled(), "clearing_time")
    assert figure.axes[1].get_xlabel() == "rank correlation  [1]"
    caption = figure.legends[0].get_title().get_text().replace("\n", " ")
    assert "A rank correlation shows rising or falling dependence only" in caption


def test_chance_stays_in_its_band() -> None:
    bars = map_figure(sampled(), "clearing_time").axes[1]
    boxes = [patch for patch in bars.patches if isinstance(patch, Rectangle)]
    (limit,) = (box.get_width() / 2.0 for box in boxes if box.get_height() == 1.0)
    rng = np.random.default_rng(2)
    found = [abs(rank_correlation(rng.random(200), rng.random(200))) for _ in range(2000)]
    assert np.mean(np.array(found) < limit) == pytest.approx(
        0.99, abs=4.0 * math.sqrt(0.0099 / 2000)
    )
    assert math.isnan(rank_correlation(rng.random(9), np.ones(9)))
