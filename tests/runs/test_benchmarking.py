"""The benchmark of controllers: its runs, its scores, and what it rests on."""

from __future__ import annotations

import csv
import hashlib
import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from own_controller import SlipPI
from tree import ROOT

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.runs import Benchmark, benchmark, benchmark_scenarios, benchmarking
from contactlib.runs.benchmarking import RANGES, SHIPPED, VERSION, WHOLE, Extent, Range, _drawn
from contactlib.runs.tuning import UNSEEN
from contactlib.traction import Measurement

PAGE = ROOT / "docs" / "howto" / "benchmark.md"
INPUTS = {
    2: "730f96fce2267076496b14aa66fc824f697fb1854f8a826c25bd772d883c96a0"
}  # digest of what a version runs


def test_what_the_benchmark_runs_changes_with_its_version() -> None:
    """Scores of one version can be compared: a change of a scenario needs a new version."""
    files = (*WHOLE.files, "locomotive")
    texts = [Path(cl.files.model_path(f"{file}.toml")).read_text() for file in files]
    plain = vars(cl.Track())
    tracks = [
        repr([{k: v for k, v in vars(run.track).items() if v != plain[k]} for run in runs])
        for runs in benchmark_scenarios(small=True)
    ]  # new numbers of all tracks, such as a variation, change nothing as long as nobody gives them
    whole = json.dumps([*map(tomllib.loads, texts), WHOLE, RANGES, tracks], sort_keys=True)
    assert INPUTS[VERSION] == hashlib.sha256(whole.encode()).hexdigest()


def test_tracks_are_drawn_by_seed_within_the_ranges(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmarking, "WHOLE", WHOLE._replace(noises=4))
    whole = dict(zip(WHOLE.files, benchmark_scenarios(3), strict=True))
    assert {len(runs) for runs in whole.values()} == {4 * 14}
    few, others = (benchmark_scenarios(seed, small=True) for seed in (3, 4))
    for runs, same, other in zip(whole.values(), few, others, strict=False):
        tracks = [run.track for run in runs]
        assert len(set(tracks)) == len(tracks)
        assert [run.track for run in same] == tracks[:8]
        assert not {run.track for run in other} & set(tracks)

    def spread(limits: Range, values: Any) -> None:
        """All of the range is drawn from, and nothing beyond it."""
        (low, high), drawn = limits, np.ravel(values)
        margin = 0.1 * (high - low)
        assert low - 1e-9 < drawn.min() <= low + margin
        assert high - margin <= drawn.max() < high + 1e-9

    for file in ("dry_wet_dry", "soft_patch", "braking", "split_friction"):
        tracks = [run.track for run in whole[file]]
        speed = cl.load_scenario(f"{file}.toml").initial_speed
        left = [track.friction_left for track in tracks]
        first, _, end, _, second, _, last, _ = (
            np.transpose([profile.at for profile in left]) / speed
        )
        for limits, times in ((RANGES.first, first), (RANGES.gap, second - end)):
            spread(limits, times)
        spread(RANGES.length, [end - first, last - second])
        spread(RANGES.friction, [profile.value[1:7:4] for profile in left])
        softer = [track.slope.value[1:7:4] for track in tracks]
        spread(RANGES.slope, softer) if file == "soft_patch" else spread((1.0, 1.0), softer)
        right = {track.friction_right for track in tracks}
        assert right == {cl.load_scenario(f"{file}.toml").track.friction_right}
    sand = [run.track.friction_over_time for run in whole["sanding"]]
    start, end = np.transpose([profile.at for profile in sand])
    spread(RANGES.sanding, start)
    spread(RANGES.rise, end - start)
    for place, limits in enumerate((RANGES.slippery, RANGES.sanded)):
        spread(limits, [profile.value[place] for profile in sand])
    spread(RANGES.rails, [run.track.friction_left.value for run in whole["torque_step"]])
    steps = np.transpose([run.demand.at for run in whole["torque_step"]])
    spread(RANGES.step, steps[2])
    spread(RANGES.held, steps[4] - steps[2])


@pytest.mark.skipif(not PAGE.is_file(), reason="the tree that it is of is not here")
def test_the_guide_gives_the_ranges_and_the_version() -> None:
    page = PAGE.read_text()
    rows = [line for line in page.splitlines() if line.startswith("| ") and " to " in line]
    given = [[float(x) for x in row.split("|")[-2].split()[:3:2]] for row in rows]
    kept = [getattr(RANGES, name) for name in RANGES._fields if name != "gap"]  # that of `first`
    assert sorted(map(tuple, given)) == sorted(kept)
    assert RANGES.gap == RANGES.first
    assert f"contactlib benchmark {VERSION}, seed 1: 840 runs each" in page


@dataclass
class Planned:
    """A share of the demand over time, which reads no sensor."""

    share: Callable[[FloatArray], Any]
    sample_time: float = 0.01

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> FloatArray:
        return np.zeros(np.shape(measurement.demand))

    def sample(self, measurement: Measurement[FloatArray], time: FloatArray) -> Any:
        time = time + self.sample_time
        return self.share(time) * measurement.demand, time


def pulsed(period: float, on: float, low: float, high: float) -> Planned:
    """Shares that alternate, the higher one for a fraction of each period."""
    return Planned(lambda time: np.where(time % period < on * period, high, low))


@pytest.mark.slow
def test_a_torque_that_is_planned_without_a_sensor_loses_to_every_shipped_controller() -> None:
    plans = {
        "clock": Planned(lambda time: np.where((time > 2.9) & (time < 12.2), 0.62, 1.0)),
        "late": Planned(lambda time: np.where((time > 4.0) & (time < 18.0), 0.5, 0.9)),
        **{f"constant {part}": pulsed(1.0, 1.0, 0.0, part) for part in (0.4, 0.5, 0.6, 0.8, 1.0)},
        "pulses": pulsed(0.2, 0.5, 0.0, 1.0),
        "steps": pulsed(2.7, 0.5, 0.45, 0.65),
        "cuts": pulsed(1.0, 0.8, 0.0, 1.0),
    }
    scores = benchmark(plans, small=True)  # type: ignore[arg-type]
    shipped = min(scores.score(name).mean for name in SHIPPED)
    assert all(scores.score(name).mean < shipped - 0.1 for name in plans)


def short(file: str) -> cl.Scenario:
    """The scenario of a file, which ends while its demand is beyond the rails."""
    return replace(cl.load_scenario(file), duration=6.0)


@pytest.fixture(scope="module")
def result() -> Benchmark:
    """One scenario of each error of two, with two noises, and a controller of one's own."""
    with pytest.MonkeyPatch.context() as patch:
        errors = "as in the file", "delay + 10 ms"
        patch.setattr(benchmarking, "SMALL", Extent(("torque_step",), errors, 2))
        patch.setattr(benchmarking, "load_scenario", short)
        return benchmark({"own": SlipPI()}, trials={"own": 7}, seed=5, small=True)


def test_each_run_is_that_of_its_scenario(result: Benchmark) -> None:
    assert result.outcomes.shape == (4, 1, 2, 2, 4)
    designed = short("torque_step.toml")
    names = ["limited_utilisation", "utilisation", "slip_work", "jerk"]
    late = replace(designed.sensors, delay=designed.sensors.delay + 0.01)
    generator = np.random.default_rng([5, WHOLE.files.index("torque_step")])
    drawn = [_drawn("torque_step", designed, generator) for _ in range(4)]
    for k, sensors in enumerate((designed.sensors, late)):
        case = replace(drawn[2 * k + 1], sensors=sensors)
        for name in ("threshold", "own"):
            control = SlipPI() if name == "own" else designed.controller(name)
            run = cl.run_many([case], control, names, index=[UNSEEN + 1])
            mine = result.outcomes[result.controllers.index(name), 0, k, 1]
            assert mine.tolist() == [run[outcome][0] for outcome in names]


def test_a_score_is_the_mean_of_the_runs(result: Benchmark) -> None:
    runs = result.outcomes[1, ..., :2].mean(axis=-1)
    score = result.score("creep_pi")
    assert score.mean == pytest.approx(runs.mean())
    assert score.minimum == runs.min()
    half = (runs[..., 1] - runs[..., 0]) / 2.0  # standard error of each mean of two
    assert score.standard_error == pytest.approx(np.sqrt((half**2).sum()) / half.size)
    costs = result.outcomes[1, ..., 2:].mean(axis=(0, 1, 2))
    assert (score.slip_work, score.jerk) == pytest.approx(tuple(costs))
    assert result.score("creep_pi", "Torque step on dry rails") == score


def test_all_is_written(result: Benchmark, tmp_path: Path) -> None:
    result.write(tmp_path / "new")
    assert (tmp_path / "new" / "benchmark.txt").read_text() == result.table() + "\n"
    title = f"contactlib benchmark {VERSION} (small), seed 5"
    assert result.table().startswith(f"{title}: 4 runs each\n")
    about = json.loads((tmp_path / "new" / "benchmark.json").read_text())
    assert about["benchmark"] == result.title == title
    assert about["scores"]["own"]["mean"] == result.score("own").mean
    assert about["scores"]["own"]["jerk"] == result.score("own").jerk
    trials = {name: score["trials"] for name, score in about["scores"].items()}
    assert trials == {**dict.fromkeys(SHIPPED, 0), "own": 7}
    with (tmp_path / "new" / "benchmark.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 16
    for place, name in enumerate(("limited_utilisation", "slip_work")):
        mine = [float(row[name]) for row in rows if row["controller"] == "own"]
        assert mine == result.outcomes[3, ..., 2 * place].ravel().tolist()


def test_a_run_that_fails_scores_zero(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(benchmarking, "SHIPPED", ("threshold",))
    monkeypatch.setattr(benchmarking, "SMALL", Extent(("torque_step",), ("as in the file",), 2))
    started = short("torque_step.toml")
    beyond = replace(started, demand=cl.Profile(started.demand.at, (9e4,) * 6))
    monkeypatch.setattr(benchmarking, "load_scenario", lambda _: beyond)
    result = benchmark(small=True)
    assert np.isnan(result.outcomes).all()
    score = result.score("threshold")
    assert score[:4] == (0.0, 0.0, 0.0, 0.0)
    assert np.isnan(score[4:]).all()
    result.write(tmp_path)
    scores = json.loads((tmp_path / "benchmark.json").read_text())["scores"]
    assert scores["threshold"]["slip_work"] is None


def test_what_cannot_take_part_is_refused() -> None:
    with pytest.raises(ValueError, match="'threshold' is a shipped one"):
        benchmark({"threshold": SlipPI()})
    with pytest.raises(ValueError, match="is not a controller"):
        benchmark({"mine": object()})  # type: ignore[dict-item]
    with pytest.raises(ValueError, match="trials: 'yours' must be one of controllers: mine"):
        benchmark({"mine": SlipPI()}, trials={"yours": 3})
    with pytest.raises(ValueError, match=r"trials\['mine'\] = 0.5 must be a whole number"):
        benchmark({"mine": SlipPI()}, trials={"mine": 0.5})  # type: ignore[dict-item]
    with pytest.raises(ValueError, match=r"seed = -1.* is out of range"):
        benchmark(seed=-1)
