"""Grids and random samples."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from sweep_files import AXES, RANDOM, SWEEP, write_sweep

import contactlib as cl
from contactlib.runs.sweep.sampling import Choice, Distribution, LogUniform, Normal, Uniform, Whole


def test_a_grid_has_only_so_many_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactlib.runs.sweep.sampling.MOST_RUNS", 5)
    with pytest.raises(ValueError, match="the grid has 6 points: at most 5"):
        cl.load_sweep(write_sweep(tmp_path))


def test_grid_is_every_combination_with_the_last_axis_fastest(tmp_path: Path) -> None:
    sweep = cl.load_sweep(write_sweep(tmp_path))
    assert sweep.shape == (2, 3)
    assert sweep.runs == 6
    assert sweep.values[:, 0].tolist() == [0.5] * 3 + [0.9] * 3
    assert sweep.values[:, 1].tolist() == [200.0, 250.0, 300.0] * 2


@pytest.mark.parametrize("runs", [1, 7, 64])
def test_latin_hypercube_has_one_sample_in_each_stratum(tmp_path: Path, runs: int) -> None:
    axes = AXES + AXES.replace("axes.x", "axes.y").replace("inertia", "mass").replace("00.0", "e5")
    text = SWEEP.partition("[axes")[0] + RANDOM.format("latin_hypercube", runs, 3) + axes
    values = cl.load_sweep(write_sweep(tmp_path, text)).values
    for column, (start, end) in zip(values.T, ((200.0, 300.0), (2e5, 3e5)), strict=True):
        strata = np.floor((column - start) / (end - start) * runs)
        assert sorted(np.minimum(strata, runs - 1)) == list(range(runs))


def test_random_samples_are_of_their_seed(tmp_path: Path) -> None:
    head = SWEEP.partition("[axes")[0]
    for kind in ("latin_hypercube", "monte_carlo"):
        first, again, other = (
            cl.load_sweep(write_sweep(tmp_path, head + RANDOM.format(kind, 9, seed) + AXES))
            for seed in (1, 1, 2)
        )
        assert (first.values == again.values).all()
        assert (first.values != other.values).any()
        assert first.plan.digest(first.values) == again.plan.digest(again.values)
        assert first.plan.digest(first.values) != first.plan.digest(other.values)


SPREADS: list[tuple[Distribution, Any]] = [
    (Uniform(2.0, 5.0), stats.uniform(2.0, 3.0)),
    (LogUniform(0.01, 10.0), stats.loguniform(0.01, 10.0)),
    (Normal(3.0, 0.5), stats.norm(3.0, 0.5)),
    (Normal(3.0, 0.5, 2.0, 3.2), stats.truncnorm(-2.0, 0.4, 3.0, 0.5)),
    (Normal(3.0, 0.5, 6.0, 7.0), stats.truncnorm(6.0, 8.0, 3.0, 0.5)),
    (Normal(3.0, 0.5, -1.0, 0.0), stats.truncnorm(-8.0, -6.0, 3.0, 0.5)),
]


@pytest.mark.parametrize(("spread", "known"), SPREADS)
def test_distributions_are_those_of_scipy(spread: Distribution, known: Any) -> None:
    parts = np.linspace(0.001, 0.999, 999)
    assert spread.at(parts) == pytest.approx(known.ppf(parts), rel=1e-9)


@settings(derandomize=True, deadline=None)
@given(st.floats(0.0, 1.0))
def test_no_value_leaves_its_range(part: float) -> None:
    for spread, _ in SPREADS:
        value = float(spread.at(part))
        assert math.isfinite(value)
        assert getattr(spread, "start", -math.inf) <= value <= getattr(spread, "end", math.inf)
    assert float(Whole(3.0, 5.0).at(part)) in (3.0, 4.0, 5.0)
    assert float(Choice((7.0, 1.0)).at(part)) in (7.0, 1.0)


def test_whole_numbers_and_choices_are_equally_likely() -> None:
    parts = (np.arange(600) + 0.5) / 600
    for values in (Whole(3.0, 5.0).at(parts), Choice((7.0, 1.0, 2.0)).at(parts)):
        assert np.unique(values, return_counts=True)[1].tolist() == [200, 200, 200]
