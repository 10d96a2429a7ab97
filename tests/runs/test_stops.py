"""Stops of a catalogue: their quantiles, their file, and each of them once more."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import done, refused

import contactlib as cl
from contactlib.runs import stops as of_stops
from contactlib.runs.stops import quantile, share

SCENARIO = """name = "Quick stop"
source = "chosen"
wheelset = "wheelset.toml"

[wheelset_changes.wheelset]
mass = "21 t"

[brake]
fill_time = 0.2
vent_time = 0.1

[run]
initial_speed = "9 km/h"
duration = 5.0

[demand]
time = [0.1, 0.1]
deceleration = [0.0, 0.6]

[track]
distance = [0.0, 1.0, 1.0]
friction = [0.3, 0.3, 0.2]
unit = "factor"

[controllers.open_loop]
kind = "open_loop"

[controllers.valve]
kind = "wsp"
"""


def test_an_interval_contains_the_quantile_as_often_as_it_says() -> None:
    rng, part, n = np.random.default_rng(2), 0.9, 60
    low, high = (int(k) for k in quantile(np.arange(1.0, n + 1.0), part)[1:])  # ranks
    below = [math.comb(n, k) * part**k * (1.0 - part) ** (n - k) for k in range(n + 1)]
    assert sum(below[low:high]) >= 0.95
    assert sum(below[: low + 1]) > 0.025  # none of the ends can be closer
    assert sum(below[high - 1 :]) > 0.025
    sorted_draws = np.sort(rng.exponential(size=(20_000, n)), axis=1)
    hits = (sorted_draws[:, low - 1] <= -math.log(1.0 - part)) & (
        sorted_draws[:, high - 1] > -math.log(1.0 - part)
    )
    assert hits.mean() == pytest.approx(sum(below[low:high]), abs=0.006)


def test_an_interval_is_that_of_the_bootstrap() -> None:
    rng = np.random.default_rng(3)
    draws = rng.gumbel(900.0, 30.0, 400)
    for part in (0.5, 0.9):
        again = np.quantile(rng.choice(draws, (4000, draws.size)), part, axis=1)
        value, low, high = quantile(draws, part)
        assert value == np.quantile(draws, part, method="inverted_cdf")
        expected = np.quantile(again, (0.025, 0.975))
        assert (low, high) == pytest.approx(tuple(expected), abs=0.2 * (high - low))


def test_what_does_not_stop_is_longer_than_any_other() -> None:
    draws = [*range(90), *[math.inf] * 5, *[math.nan] * 5]
    assert quantile(draws, 0.5) == quantile(range(100), 0.5)
    assert quantile(draws, 0.9).value == 89.0
    assert quantile(draws, 0.9).high == quantile(draws, 0.95).value == math.inf
    low, high = share(10, 100)[1:]  # the tails of Clopper and Pearson, by their definition
    for bound, ks in ((low, range(10, 101)), (high, range(11))):
        tail = sum(math.comb(100, k) * bound**k * (1.0 - bound) ** (100 - k) for k in ks)
        assert tail == pytest.approx(0.025, rel=1e-9)


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_catalogue_is_written_run_and_each_stop_repeated(tmp_path: Path) -> None:
    (tmp_path / "stop.toml").write_text(SCENARIO)
    wheelset = Path("models/locomotive.toml").read_text()
    (tmp_path / "wheelset.toml").write_text(wheelset)
    folder, start = tmp_path / "out", ["stops", str(tmp_path / "stop.toml"), "--draws", "4"]
    written = done(*start, "-o", folder, "--format", "csv").output
    path = folder / "stop_stops.toml"
    sweep = cl.load_sweep(path)
    assert (folder / "wheelset.toml").read_text() == wheelset
    assert (sweep.shape, list(sweep.plan.controllers)) == ((4, 4, 1, 1, 1, 4), ["valve"])
    table = rows_of(folder / "stop_stops.csv")
    for run in (0, 37, 63):  # to the last bit, with any number of workers
        scenario = sweep.scenario_of(run)
        again = cl.run_scenario(scenario, "valve", **sweep.plan.settings_of(run, scenario))
        (row,) = (row for row in table if row["run [1]"] == str(run))
        found = cl.metrics(again, scenario.drivetrain)
        assert float(row["stopping_distance [m]"]) == found.stopping_distance
        assert float(row["air_used [1]"]) == found.air_used
        assert float(row["line [1]"]) == scenario.variation.seed  # type: ignore[union-attr]
    distances = np.array([float(row["stopping_distance [m]"]) for row in table]).reshape(16, 4)
    assert (np.diff(distances.reshape(4, 4, 4), axis=0) > 0.0).all()  # each draw, with speed
    assert f"{np.sort(distances[5])[1]:.4g} (unknown to unknown)" in written
    known = cl.ensemble(sweep, output=folder)
    assert cl.ensemble(sweep, workers=8, chunk=7).identical(known)
    done("stops", path, "--repeat", "37", "-o", folder, "--format", "csv")
    (metrics,) = rows_of(folder / "run37" / "metrics.csv")
    assert float(metrics["stopping_distance [m]"]) == distances.ravel()[37]
    limited = path.read_text().replace("# limit = [L1, L2, L3, L4]", "limit = [1.0, 2.0, 2.0, 0.1]")
    short = re.sub(r'("run.duration"\nvalues = ).*', r"\g<1>[2.0]", limited)
    assert short != limited != path.read_text()
    path.write_text(short)  # too short for the fast ones
    sweep = cl.load_sweep(path)
    stops = list(of_stops.stops_of(sweep, cl.ensemble(sweep)))
    text = of_stops.summary_text(sweep, stops)
    assert [stop.numbers["not stopped"] for stop in stops[12:]] == [4] * 4
    assert stops[15].numbers["exceed it"] == share(4, 4)
    assert "100 % (39.8 to 100)" in text
    assert "unknown (unknown to unknown)" in text
    assert "another content" in refused(*start, "-o", folder)


def test_a_catalogue_without_a_track_has_slippery_rails(tmp_path: Path) -> None:
    file = tmp_path / "stop.toml"
    file.write_text(re.sub(r"\[track\](.*\n)+?\n", "", SCENARIO))
    (tmp_path / "wheelset.toml").write_text(Path("models/locomotive.toml").read_text())
    sweep = cl.load_sweep(of_stops.write_stops(file, tmp_path / "out", 2))
    elements = [sweep.scenario_of(run).drivetrain.wheelset.element for run in range(0, 8, 2)]
    frictions = [element.friction.kinetic for element in elements]
    assert frictions[:3] == pytest.approx([0.05, 0.07, 0.1], rel=5e-3)  # three digits of a factor
    assert frictions[3] == cl.load_scenario(file).drivetrain.wheelset.element.friction.kinetic
