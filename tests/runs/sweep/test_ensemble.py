"""Results of a sweep: outcomes, failures, the report and the dataset."""

from __future__ import annotations

import dataclasses
import importlib.util
import inspect
import json
import math
import re
import sys
import tomllib
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import call, done
from own_controller import SlipPI, largest_slip
from scipy.io import netcdf_file
from sweep_files import AXES, HEAD, RANDOM, SCENARIO, SWEEP, one_axis, write_sweep

import contactlib as cl
from contactlib.runs import sweep as sweeps
from contactlib.runs.analysis import SWEEP_OUTCOMES
from contactlib.runs.scenario_runs import DEFAULT_TOLERANCE
from contactlib.runs.sweep.loading import with_own


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["", "common", "independent"])
@pytest.mark.parametrize("kind", ["grid", "monte_carlo"])
def test_every_run_can_be_made_once_more(tmp_path: Path, kind: str, noise: str) -> None:
    text = SWEEP.replace('"critical_torque", "clearing_time"', '"jerk", "largest_creepage"')
    text = f'noise = "{noise}"\n{text}' if noise else text
    if kind != "grid":
        text = text.partition("[axes")[0] + RANDOM.format(kind, 6, 2) + AXES
    sweep, mine = cl.load_sweep(write_sweep(tmp_path, text)), SlipPI()
    added: dict[str, Any] = {"controllers": {"mine": mine}, "metrics": {"largest": largest_slip}}
    results = cl.ensemble(sweep, chunk=4, **added)
    common = noise == "common" or (not noise and kind == "grid")
    for name, control in (("creep_pi", "creep_pi"), ("open_loop", "open_loop"), ("mine", mine)):
        for j in range(sweep.runs):
            assert sweep.plan.index_of(j) == (0 if common else j)
            scenario, given = sweep.scenario_of(j), {"step": 0.01, "tolerance": DEFAULT_TOLERANCE}
            run = cl.run_scenario(scenario, control, index=0 if common else j, **given)  # type: ignore[arg-type]
            again = cl.metrics(run, scenario.drivetrain)
            here = results.sel(controller=name)
            assert here["largest"].values.flat[j] == largest_slip(run)
            for outcome in sweep.plan.outcomes:
                assert here[outcome].values.flat[j] == getattr(again, outcome), (name, j, outcome)


def test_a_run_that_fails_is_nan_and_reports_it(tmp_path: Path) -> None:
    axis = 'factor_on = "demand.torque"\nvalues = [1.0, 3.0]'  # the first demand is too much
    scenario = SCENARIO.replace('"10 kN.m", "23 kN.m"', '"20 kN.m", "23 kN.m"')
    path = one_axis(tmp_path, axis, scenario)
    results = cl.ensemble(path)
    assert results["failed"].values.tolist() == [[0, 1], [0, 1]]
    assert np.isnan(results["slip_work"].values).tolist() == [[False, True], [False, True]]
    assert np.isfinite(results["critical_torque"].values).all()
    result = done("sweep", path, "-o", tmp_path / "out", "--no-maps")
    assert re.search(r"^failed +1 +1 +1$", result.output, re.MULTILINE)
    assert "run 1 (x = 3) under creep_pi: " in result.output


def test_parameters_that_do_not_go_together_fail_where_they_meet(tmp_path: Path) -> None:
    # Found only inside: both ends of the axis are valid, the middle is not a whole number.
    axis = 'parameter = "sensors.seed"\nvalues = [1.0, 1.5, 2.0]'
    results = cl.ensemble(one_axis(tmp_path, axis))
    assert results["failed"].values.tolist() == [[0, 1, 0], [0, 1, 0]]
    assert np.isnan(results["critical_torque"].values).tolist() == [False, True, False]


def test_a_sweep_of_which_nothing_came_is_an_error(tmp_path: Path) -> None:
    axis = 'parameter = ["demand.torque[0]", "demand.torque[1]"]\nvalues = [{}]'
    head = HEAD.replace(', "critical_torque", "clearing_time"', "")
    for values, status in (('"23 kN.m", "90 kN.m"', 0), ('"80 kN.m", "90 kN.m"', 1)):
        path = write_sweep(tmp_path, f"{head}[axes.x]\n{axis.format(values)}\n")
        result = call("sweep", path, "-o", tmp_path / f"out{status}")
        assert result.exit_code == status, result.output
        assert (result.stderr == "contactlib: all runs failed\n") == bool(status)


def test_report_is_one_table_with_true_medians(tmp_path: Path) -> None:
    results = cl.ensemble(sweep := cl.load_sweep(write_sweep(tmp_path)))
    results["slip_work"].values[0] = [[1.0, 2.0, 4.0], [8.0, math.inf, math.nan]]
    results["failed"].values[1, 0] = 1
    results["clearing_time"].values[:] = math.nan
    lines = sweeps.report(sweep, results)
    table = [re.split(r" {2,}", line.strip()) for line in lines[-5:]]
    assert table[0] == ["outcome", "unit", "creep_pi", "open_loop", "wheelset"]
    assert table[1][:3] == ["slip work", "J", "4 (1, inf), 1 inf, 1 nan"]
    critical = results["critical_torque"].values
    middle, low, high = (f"{f(critical):.4g}" for f in (np.median, np.min, np.max))
    assert table[2] == ["critical torque", "N.m", f"{middle} ({low}, {high})"]
    assert table[3] == ["clearing time", "s", "-"]
    assert table[4] == ["failed", "1", "0", "3"]
    results["slip_work"].values[0] = [[1.0, 2.0, 4.0], [8.0, 16.0, 32.0]]
    assert "6 (1, 32)" in sweeps.report(sweep, results)[-4]  # between the two in the middle


def test_a_sweep_of_vehicles_says_where_its_controllers_misjudge_the_speed(tmp_path: Path) -> None:
    sweep = write_sweep(
        tmp_path,
        'name = "x"\nsource = "x"\nscenario = "coach_braking.toml"\noutcomes = ["speed_error"]\n'
        '[axes.wheel]\nparameter = "sensors.wheel_diameter_error"\nvalues = [0.0, 0.06]\n'
        '[axes.end]\nparameter = "run.duration"\nvalues = [0.3]\n',
    )
    found = cl.ensemble(sweep).isel(end=0)
    off = found["speed_error"] > 0.05 * 160.0 / 3.6
    assert off.values.tolist() == [[False, True]] * 2
    # An open loop makes no use of the speed.
    for name, expected in (("wsp", [0.0, 1.0]), ("open_loop", [0.0, 0.0])):
        assert found["speed_misjudged"].sel(controller=name).values.tolist() == expected


def test_dataset_is_labelled_and_its_file_opens_everywhere(tmp_path: Path) -> None:
    import xarray

    path = write_sweep(tmp_path)
    results = cl.ensemble(path, output=tmp_path / "out")
    assert results["slip_work"].dims == ("controller", "patch", "inertia")
    assert results["critical_torque"].dims == ("patch", "inertia")
    assert results["controller"].values.tolist() == ["creep_pi", "open_loop"]
    for name in ("slip_work", "critical_torque", "clearing_time"):
        assert results[name].attrs["units"] == SWEEP_OUTCOMES[name].unit
        assert results[name].attrs["long_name"] == SWEEP_OUTCOMES[name].description
    assert results["inertia"].attrs == {"units": "kg.m2", "long_name": "vehicle.wheelset.inertia"}
    assert results["patch"].attrs["units"] == "1"
    assert results.attrs["sweep_file"] == path.read_text()
    assert "seed" not in results.attrs
    settings_of_runs = {key: results.attrs[key] for key in ("step", "tolerance", "redesign")}
    assert settings_of_runs == {
        "step": "default",
        "tolerance": DEFAULT_TOLERANCE,
        "redesign": "false",
    }
    assert json.loads(results.attrs["scenario"]) == tomllib.loads(SCENARIO)
    assert json.loads(results.attrs["vehicle"])["wheelset"]["inertia"] == 130.0
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["quick_sweep.nc"]
    with xarray.open_dataset(tmp_path / "out" / "quick_sweep.nc") as read:
        xarray.testing.assert_identical(read.load(), results)
    with netcdf_file(tmp_path / "out" / "quick_sweep.nc", mmap=False) as plain:
        assert vars(plain.variables["slip_work"])["units"] == b"J"
        assert plain.variables["slip_work"].shape == (2, 2, 3)


# ---- controllers and metrics of a user's own ----------------------------------------------

ANALYSED = SWEEP.replace('controllers = ["creep_pi", "open_loop"]\n', "").replace(
    '"slip_work", ', ""
)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sweep(tmp_path_factory.mktemp("sweep"))


def sampled_each(time: float) -> SlipPI:
    controller = SlipPI()
    controller.sample_time = time
    return controller


def test_own_controllers_and_metrics_stand_beside_the_shipped(path: Path) -> None:
    same = {"mine": SlipPI(), "creep_pi": SlipPI()}
    metrics = {
        "largest": largest_slip,
        "half": lambda result: np.float32(0.5) if result.time.size else None,
        "slipped": lambda result: result["creepage"].max() > 1e-3,
    }
    results = cl.ensemble(path, controllers=same, metrics=metrics, chunk=5)
    assert (results["half"] == 0.5).all()
    assert (results["slipped"] == 1.0).all()
    assert results.controller.values.tolist() == ["creep_pi", "open_loop", "mine"]
    assert results["largest"].dims == results["slip_work"].dims
    assert results["largest"].attrs == {"units": "m/s", "long_name": "Largest slip speed"}
    work, without = results["slip_work"], cl.ensemble(path, workers=1)["slip_work"]
    assert (work.sel(controller="creep_pi") == work.sel(controller="mine")).all()
    shipped = {"controller": "open_loop"}
    assert (work.sel(shipped) == without.sel(shipped)).all()


def test_rows_are_equally_far_apart_under_all_controllers(path: Path) -> None:
    fast = sampled_each(0.0025)
    spacing = {"spacing": lambda result: np.diff(result.time).mean()}
    results = cl.ensemble(path, controllers={"fast": fast, "mine": SlipPI()}, metrics=spacing)
    assert np.ptp(results["spacing"].values) < 1e-12
    assert results["spacing"].values.flat[0] == pytest.approx(0.0025)
    sweep = cl.load_sweep(path)
    assert sweep.plan.step_of(sweep.scenario_of(0)) == 0.01


@pytest.mark.slow
def test_own_controllers_go_to_processes_and_results_to_a_file(path: Path, tmp_path: Path) -> None:
    added: dict[str, Any] = {
        "controllers": {"mine": SlipPI()},
        "metrics": {"largest": largest_slip},
    }
    with sweeps.process_workers(2) as pool:
        results = cl.ensemble(path, executor=pool, chunk=2, output=tmp_path, **added)
    assert results.identical(cl.ensemble(path, workers=1, **added))
    again = cl.ensemble(path, output=tmp_path, **added)  # as read from the file
    assert again.identical(results)


@pytest.mark.slow
def test_what_processes_cannot_import_is_reported(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sweeps.process_workers(1) as pool:
        metrics = {"local": lambda result: 1.0}
        with pytest.raises(ValueError, match=r"cannot be sent to processes: .* top of a module"):
            cl.ensemble(path, executor=pool, metrics=metrics)
        # As from a notebook: the worker has no such class in its own main module.
        monkeypatch.setattr(sys.modules["__main__"], "SlipPI", SlipPI, raising=False)
        monkeypatch.delattr(sys.modules["__main__"], "__file__", raising=False)
        monkeypatch.setattr(SlipPI, "__module__", "__main__")
        with pytest.raises(RuntimeError, match=r"cannot import what a notebook .* in a module"):
            cl.ensemble(path, executor=pool, controllers={"mine": SlipPI()})


class Dying(ProcessPoolExecutor):
    """Processes that die when they begin, as those of a script without a guard."""

    def submit(self, *given: Any, **named: Any) -> Any:
        raise BrokenProcessPool


def test_a_script_that_starts_processes_without_a_guard_is_reported(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "mine.py"
    monkeypatch.setattr(sys.modules["__main__"], "__file__", str(script), raising=False)
    for text, why in (
        ("cl.ensemble(path)", r"mine.py lacks the line if __name__ == '__main__':"),
        ("if __name__ == '__main__':\n    cl.ensemble(path)", "perhaps for lack of memory"),
    ):
        script.write_text(text)
        with Dying(1) as pool, pytest.raises(RuntimeError, match=why):
            cl.ensemble(path, executor=pool)


def test_samples_are_along_one_dimension_and_can_be_cut_short(tmp_path: Path) -> None:
    text = HEAD + RANDOM.format("latin_hypercube", 6, 2) + AXES
    results = cl.ensemble(sweep := cl.load_sweep(write_sweep(tmp_path, text)), workers=1)
    assert results.attrs["seed"] == 2
    assert results["slip_work"].dims == ("controller", "run")
    assert results["x"].dims == ("run",)
    assert results["x"].values.tolist() == sweep.values[:, 0].tolist()
    short = dataclasses.replace(sweep, values=sweep.values[:2])
    assert cl.ensemble(short, workers=1).equals(results.isel(run=[0, 1]))


def test_metrics_alone_need_no_outcome_of_runs(tmp_path: Path) -> None:
    path = write_sweep(tmp_path, ANALYSED)
    results = cl.ensemble(path, controllers={"mine": SlipPI()}, metrics={"largest": largest_slip})
    assert results["largest"].dims[0] == "controller"
    assert results["critical_torque"].dims == ("patch", "inertia")
    assert (results["largest"] > 0.0).all()
    with pytest.raises(ValueError, match="no controller runs"):
        cl.ensemble(path, controllers={"mine": SlipPI()})
    with pytest.raises(ValueError, match="metrics: no controller runs in this sweep"):
        cl.ensemble(path, metrics={"largest": largest_slip})


def no_such_signal(result: cl.Result) -> float:
    return float(result["creepge"].max())


AT_FAULT = r"metric m: KeyError: .*no signal 'creepge'; did you mean 'creepage'.* \(test_ensem"
TWO = r"controllers\.m\.sample_time = .*: take 0\.01 s, or"


@pytest.mark.parametrize(
    ("what", "value", "message"),
    [
        ("metrics", {"m": lambda result: result["speed"]}, r"m returned array\(.* one number"),
        ("metrics", {"m": lambda result: None}, "metric m returned None.*; a return is"),
        ("metrics", {"m": no_such_signal}, AT_FAULT),
        ("metrics", {"m": 3.0}, "metrics: m = 3.0 must be a function"),
        ("metrics", {"jerk": largest_slip}, "metrics: 'jerk' is not a name"),
        ("metrics", {"inertia": largest_slip}, "metrics: 'inertia' is not a name"),
        ("metrics", {"a/b": largest_slip}, "metrics: 'a/b' is not a name"),
        ("controllers", {"mine": SlipPI}, r"controllers\['mine'\] is the class"),
        ("controllers", {"a b": SlipPI()}, r"controllers\.'a b' is not a name"),
        ("controllers", {"m": sampled_each(0.007)}, TWO),
        ("workers", 0, "workers = 0 is out of range"),
        ("chunk", 0, "chunk = 0 is out of range"),
    ],
)
def test_mistakes_are_one_line(path: Path, what: str, value: Any, message: str) -> None:
    error = RuntimeError if message == AT_FAULT else ValueError
    with pytest.raises(error, match=message) as caught:
        cl.ensemble(path, **{what: value})
    assert "\n" not in str(caught.value)


def test_an_axis_of_a_controller_that_is_replaced_is_refused(tmp_path: Path) -> None:
    axis = '\n[axes.held]\nparameter = "controllers.creep_pi.reference"\nvalues = [0.01, 0.02]\n'
    path = write_sweep(tmp_path, SWEEP + axis)
    with pytest.raises(ValueError, match=r"an axis varies controllers\.creep_pi\.reference"):
        cl.ensemble(path, controllers={"creep_pi": SlipPI()})


def test_a_controller_in_the_scenario_of_a_sweep_is_not_ignored(path: Path) -> None:
    sweep = cl.load_sweep(path)
    for name in ("mine", "creep_pi"):
        every = {**sweep.scenario.controllers, name: SlipPI()}
        scenario = dataclasses.replace(sweep.scenario, controllers=every)
        with pytest.raises(ValueError, match=rf"ensemble\(sweep, controllers={{'{name}': \.\.\.}}"):
            dataclasses.replace(sweep, scenario=scenario)


@pytest.mark.slow
def test_a_sweep_goes_on_with_the_same_controller_and_no_other(path: Path, tmp_path: Path) -> None:
    def start(slip: float, **given: Any) -> Any:
        controllers = {"mine": SlipPI(slip)}
        return cl.ensemble(path, output=tmp_path, workers=1, controllers=controllers, **given)

    start(0.3)
    others: list[tuple[float, dict[str, Any], str]] = [
        (0.2, {}, "controller mine"),
        (0.3, {"key": "a"}, "controller mine"),
        (0.3, {"metrics": {"largest": largest_slip}}, "metric largest"),
    ]
    for slip, given, name in others:
        with pytest.raises(ValueError, match=f"of another plan: not the same: {name};"):
            start(slip, **given)
    parts: list[float] = []
    start(0.3, progress=parts.append)
    assert parts[0] == 1.0
    changed = start(0.2, restart=True)
    assert changed.identical(cl.ensemble(path, controllers={"mine": SlipPI(0.2)}, workers=1))


def digest(path: Path, controller: Any, **given: Any) -> str:
    sweep = with_own(cl.load_sweep(path), {"mine": controller}, {}, **given)
    return sweep.plan.digest(sweep.values)


@pytest.mark.slow
def test_own_controllers_count_by_numbers_and_file_or_by_key(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def of_file(text: str, slip: float = 0.3) -> Any:
        file = tmp_path / "own_copy.py"
        file.write_text(text)
        spec = importlib.util.spec_from_file_location("own_copy", file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "own_copy", module)
        spec.loader.exec_module(module)
        return module.SlipPI(slip)

    text = Path(inspect.getfile(SlipPI)).read_text()
    for given, differ in (({}, True), ({"key": "1"}, False)):
        known = digest(path, of_file(text), **given)
        assert digest(path, of_file(text), **given) == known
        assert (digest(path, of_file(text, 0.2), **given) != known) == differ
        assert (digest(path, of_file(text + "# changed"), **given) != known) == differ
    monkeypatch.setattr(SlipPI, "__module__", "__main__")  # which cannot be read, as in a notebook
    assert digest(path, SlipPI()) != digest(path, SlipPI())
    assert digest(path, SlipPI(), key="1") == digest(path, SlipPI(), key="1")
