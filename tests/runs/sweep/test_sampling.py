"""Grids and random samples."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from contactlib.runs.sweep.sampling import MAX_RUNS, Spread, draw

INF = math.inf
SPREADS: list[tuple[Spread, Any]] = [
    (Spread("uniform", (2.0, 5.0)), stats.uniform(2.0, 3.0)),
    (Spread("log_uniform", (0.01, 10.0)), stats.loguniform(0.01, 10.0)),
    (Spread("normal", (3.0, 0.5, -INF, INF)), stats.norm(3.0, 0.5)),
    (Spread("normal", (3.0, 0.5, 2.0, 3.2)), stats.truncnorm(-2.0, 0.4, 3.0, 0.5)),
    (Spread("normal", (3.0, 0.5, 6.0, 7.0)), stats.truncnorm(6.0, 8.0, 3.0, 0.5)),
    (Spread("whole", (3.0, 5.0)), stats.randint(3, 6)),
]


def test_grid_is_every_combination_with_the_last_axis_fastest() -> None:
    spreads = [Spread("values", (0.5, 0.9)), Spread("values", (200.0, 250.0, 300.0))]
    values = draw(spreads, "grid", 0, 0)
    assert values[:, 0].tolist() == [0.5] * 3 + [0.9] * 3
    assert values[:, 1].tolist() == [200.0, 250.0, 300.0] * 2
    with pytest.raises(ValueError, match=f"the grid has 16000000 points: at most {MAX_RUNS}"):
        draw([Spread("values", tuple(range(4000)))] * 2, "grid", 0, 0)


def test_draws_are_the_same_at_every_point_of_a_grid() -> None:
    grid = [Spread("values", (0.5, 0.9)), Spread("values", (200.0, 250.0, 300.0))]
    drawn = [spread for spread, _ in SPREADS[:3]]
    spreads = [grid[0], *drawn[:2], grid[1], drawn[2]]
    few, many = (draw(spreads, "grid", runs, 3).reshape(6, runs, 5) for runs in (4, 2000))
    assert np.array_equal(few, many[:, :4])  # more draws begin with the same
    assert np.array_equal(many[:, 0][:, [0, 3]], draw(grid))
    assert (many == many[0])[:, :, [1, 2, 4]].all()
    for place, (_, law) in zip((1, 2, 4), SPREADS, strict=False):
        assert stats.kstest(many[0, :, place], law.cdf).pvalue > 1e-3
    assert np.abs(stats.spearmanr(many[0][:, [1, 2, 4]]).statistic - np.eye(3)).max() < 0.08


@pytest.mark.parametrize("runs", [1, 7, 64])
def test_latin_hypercube_has_one_sample_in_each_stratum(runs: int) -> None:
    spreads = [Spread("uniform", (200.0, 300.0)), Spread("uniform", (2e5, 3e5))]
    values = draw(spreads, "latin_hypercube", runs, 3)
    strata = np.floor((values / [200.0, 2e5] - 1.0) * 2.0 * runs)
    assert np.array_equal(np.sort(np.minimum(strata, runs - 1), axis=0).T, [range(runs)] * 2)


@pytest.mark.parametrize("kind", ["latin_hypercube", "monte_carlo"])
def test_random_samples_are_of_their_seed(kind: Any) -> None:
    first, again, other = (draw([SPREADS[0][0]], kind, 9, seed) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize(("spread", "law"), SPREADS)
def test_samples_have_the_distribution_that_they_name(spread: Spread, law: Any) -> None:
    values = draw([spread], "latin_hypercube", 20_000, 1)[:, 0]
    points = law.ppf(np.linspace(0.05, 0.95, 19))
    shares = (values[:, None] <= points).mean(axis=0)
    assert shares == pytest.approx(law.cdf(points), abs=1e-4)


def test_values_are_equally_likely() -> None:
    values = draw([Spread("values", (7.0, 1.0, 2.0))], "latin_hypercube", 600, 1)
    assert np.unique(values, return_counts=True)[1].tolist() == [200, 200, 200]


@settings(derandomize=True, deadline=None)
@given(st.floats(0.0, 1.0))
def test_no_value_leaves_its_range(part: float) -> None:
    for spread, _ in SPREADS:
        value = float(spread.at(part))
        assert math.isfinite(value)
        assert spread.numbers[-2] <= value <= spread.numbers[-1]
        assert spread.kind != "whole" or value in (3.0, 4.0, 5.0)
    assert float(Spread("values", (7.0, 1.0)).at(part)) in (7.0, 1.0)
