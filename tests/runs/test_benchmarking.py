"""The benchmark of controllers: its runs, its scores, and what it rests on."""

from __future__ import annotations

import csv
import hashlib
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from own_controller import SlipPI

import contactlib as cl
from contactlib.runs import Benchmark, benchmark, benchmarking
from contactlib.runs.benchmarking import VERSION, WHOLE, Extent
from contactlib.runs.tuning import UNSEEN

INPUTS = {
    1: "0275785d57562fd5de74453a41ddd2d6b6880ae3ea98949e2d5671363f1cbfac"
}  # digest of what a version runs


def test_what_the_benchmark_runs_changes_with_its_version() -> None:
    """Scores of one version can be compared: a change of a scenario needs a new version."""
    files = (*WHOLE.files, "locomotive")
    texts = [Path(cl.files.model_path(f"{one}.toml")).read_text() for one in files]
    whole = json.dumps([*map(tomllib.loads, texts), WHOLE], sort_keys=True)
    assert INPUTS[VERSION] == hashlib.sha256(whole.encode()).hexdigest()


def short(file: str) -> cl.Scenario:
    """The scenario of a file, which ends while its demand is beyond the rails."""
    return replace(cl.load_scenario(file), duration=6.0)


@pytest.fixture(scope="module")
def found() -> Benchmark:
    """One scenario of each error of two, with two noises, and a controller of one's own."""
    with pytest.MonkeyPatch.context() as patch:
        errors = "as in the file", "delay + 10 ms"
        patch.setattr(benchmarking, "SMALL", Extent(("torque_step",), errors, 2))
        patch.setattr(benchmarking, "load_scenario", short)
        return benchmark({"own": SlipPI()}, small=True)


def test_each_run_is_that_of_its_scenario(found: Benchmark) -> None:
    assert found.outcomes.shape == (4, 1, 2, 2, 2)
    scenario = short("torque_step.toml")
    names = ["limited_utilisation", "adhesion_utilisation"]
    late = replace(scenario.sensors, delay=scenario.sensors.delay + 0.01)
    for k, sensors in enumerate((scenario.sensors, late)):
        case = replace(scenario, sensors=sensors)
        for name in ("threshold", "own"):
            control = SlipPI() if name == "own" else scenario.controller(name)
            run = cl.run_many([case], control, names, index=[UNSEEN + 1])
            mine = found.outcomes[found.controllers.index(name), 0, k, 1]
            assert mine.tolist() == [run[outcome][0] for outcome in names]


def test_a_score_is_the_mean_of_the_runs(found: Benchmark) -> None:
    runs = found.outcomes[1].mean(axis=-1)
    score = found.score("creep_pi")
    assert score.mean == pytest.approx(runs.mean())
    assert score.minimum == runs.min()
    half = (runs[..., 1].mean() - runs[..., 0].mean()) / 2.0  # of two noises
    assert score.standard_error == pytest.approx(abs(half))
    assert found.score("creep_pi", "Torque step on dry rails") == score


def test_all_is_written(found: Benchmark, tmp_path: Path) -> None:
    found.write(tmp_path / "new")
    assert (tmp_path / "new" / "benchmark.txt").read_text() == found.table() + "\n"
    assert found.table().startswith(f"contactlib benchmark {VERSION} (small): 4 runs each\n")
    about = json.loads((tmp_path / "new" / "benchmark.json").read_text())
    assert about["benchmark"] == found.title
    assert about["scores"]["own"]["mean"] == found.score("own").mean
    with (tmp_path / "new" / "benchmark.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 16
    mine = [float(row["limited_utilisation"]) for row in rows if row["controller"] == "own"]
    assert mine == found.outcomes[3, ..., 0].ravel().tolist()


def test_a_run_that_fails_scores_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmarking, "SHIPPED", ("threshold",))
    monkeypatch.setattr(benchmarking, "SMALL", Extent(("torque_step",), ("as in the file",), 2))
    started = short("torque_step.toml")
    monkeypatch.setattr(
        benchmarking, "load_scenario", lambda _: replace(started, demand=cl.Profile.of(9e4))
    )
    assert np.array_equal(benchmark(small=True).outcomes, np.zeros((1, 1, 1, 2, 2)))


def test_a_controller_that_cannot_take_part_is_refused() -> None:
    with pytest.raises(ValueError, match="'threshold' is a shipped one"):
        benchmark({"threshold": SlipPI()})
    with pytest.raises(ValueError, match="is not a controller"):
        benchmark({"mine": object()})  # type: ignore[dict-item]
