"""Results and what makes them: copied, pickled, shown, and handed on by name."""

from __future__ import annotations

import copy
import dataclasses
import io
import pickle
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from plain_scenario import controls, wet_patch
from sweep_files import write_sweep

import contactlib as cl
from contactlib.runs import Event
from contactlib.runs.signals import CONTINUOUS, SIGNALS, units
from contactlib.traction import OpenLoop


def pickled(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))  # noqa: S301 - of our own making


WAYS = pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, pickled])


@pytest.fixture(scope="module")
def scenario() -> cl.Scenario:
    return wet_patch(duration=0.4)


@pytest.fixture(scope="module")
def run(scenario: cl.Scenario) -> cl.Result:
    return cl.run_scenario(scenario, "creep_pi")


@WAYS
@pytest.mark.parametrize("name", ["roller_rig.toml", "locomotive.toml"])
def test_a_wheelset_travels_after_it_was_used(way: Callable[[Any], Any], name: str) -> None:
    model = cl.load_model(name)
    before = cl.find_fold(model.wheelset, speed=10.0)  # keeps structs of the kernel
    there = way(model)
    assert cl.find_fold(there.wheelset, speed=10.0) == before
    assert (there.name, there.source) == (model.name, model.source)
    assert dataclasses.replace(there.wheelset, damping=1.0).damping == 1.0


@WAYS
@pytest.mark.parametrize("controller", [name for name in cl.CONTROLLERS if name != "wsp"])
def test_a_scenario_travels_after_it_was_run(
    way: Callable[[Any], Any], scenario: cl.Scenario, controller: str
) -> None:
    assert cl.run_scenario(way(scenario), controller) == cl.run_scenario(scenario, controller)
    changed = dataclasses.replace(way(scenario), duration=0.1)
    assert list(changed.controllers) == list(scenario.controllers)
    with pytest.raises(TypeError):
        changed.controllers["creep_pi"] = OpenLoop()


@pytest.mark.slow
@WAYS
def test_a_sweep_travels_after_it_was_run(way: Callable[[Any], Any], tmp_path: Path) -> None:
    sweep = cl.load_sweep(write_sweep(tmp_path))
    known = cl.ensemble(sweep, workers=1)
    assert sweep.scenario_of(3).controllers
    assert cl.ensemble(way(sweep), workers=1).identical(known)


@WAYS
def test_a_result_travels(way: Callable[[Any], Any], run: cl.Result, rig: cl.Model) -> None:
    other = cl.simulate(rig.wheelset, controls("rig")[0], initial_speed=10.0, duration=1.0)
    for result in (run, other):
        there = way(result)
        assert there == result
        assert there.events == result.events
        with pytest.raises(TypeError):
            there.signals["speed"] = there.time
    assert run != other


def test_results_differ_by_any_number(run: cl.Result) -> None:
    speed = run["speed"].copy()
    speed[-1] = np.nan
    other = dataclasses.replace(run, signals={**run.signals, "speed": speed})
    assert other != run
    assert other == copy.deepcopy(other)  # nan is nan
    assert dataclasses.replace(run, units={**run.units, "speed": "km/h"}) != run
    assert run != "a run"


@pytest.mark.parametrize("name", ["time", "axles", "speed", "distance"])
def test_a_name_is_a_signal_or_its_error_says_where_it_is(
    run: cl.Result, scenario: cl.Scenario, name: str
) -> None:
    error = pytest.raises(KeyError, match=rf"no signal '{name}'; it is the attribute \.{name}")
    for owner in (run, cl.Plant(scenario)):
        with error if hasattr(owner, name) else nullcontext():
            assert np.isfinite(owner[name]).all()


def test_pandas_and_xarray_have_every_signal_by_name(run: cl.Result) -> None:
    frame, dataset = run.to_pandas(), run.to_xarray()
    assert frame.index.name == "time"
    assert list(frame) == list(dataset.data_vars) == list(run.signals)
    assert frame.attrs["units"] == {"time": "s", **run.units}
    for name, values in run.signals.items():
        assert (frame[name] == values).all()
        assert (dataset[name].values == values).all()
        assert dataset[name].attrs["units"] == run.units[name]
    assert (frame.index == run.time).all()
    assert dataset["time"].attrs == {"units": "s", "long_name": "time"}
    assert dataset["creep_force_left"].attrs["long_name"] == "creep force, left wheel"
    assert (dataset.to_dataframe() == frame).all(axis=None)


def test_xarray_labels_every_signal_of_each_kind_of_run(run: cl.Result, rig: cl.Model) -> None:
    other = cl.simulate(rig.wheelset, controls("rig")[0], initial_speed=10.0, duration=0.1)
    for result in (run, other):
        data = result.to_xarray()
        names = {name: data[name].attrs["long_name"] for name in result.signals}
        assert len(set(names.values())) == len(names)
        assert {*names} <= {*units(CONTINUOUS, SIGNALS)}
    mine = cl.Result(run.time, {"brake_heat": run.time}, {"brake_heat": "J"})
    assert mine.to_xarray()["brake_heat"].attrs == {"units": "J", "long_name": "brake heat"}


def test_a_result_is_a_line_and_in_a_notebook_a_table(run: cl.Result) -> None:
    event = Event("slip_away", 0.31234, 0.2, 10.0, 2e4)
    shown = dataclasses.replace(run, events=(event,) * 5)
    assert (
        repr(run) == f"<contactlib.Result: 81 rows from 0 to 0.4 s of {len(run.signals)} signals>"
    )
    assert repr(shown).endswith(", slip_away at 0.3123 s" * 3 + ", 2 more events>")
    (table,) = pandas.read_html(io.StringIO(shown._repr_html_()), index_col=0)
    assert list(table.index) == list(run.signals)
    assert list(table) == ["unit", "start", "end", "min", "max"]
    for name, values in run.signals.items():
        numbers = (values[0], values[-1], values.min(), values.max())
        assert table.loc[name, "unit"] == str(run.units[name])
        np.testing.assert_allclose(table.loc[name][1:].astype(float), numbers, rtol=1e-4)
    empty = cl.Result(np.zeros(0), {"<speed>": np.zeros(0)}, {"<speed>": "m/s"})
    assert "&lt;speed&gt;" in empty._repr_html_()
    assert "0 rows of 1 signals" in repr(empty)
