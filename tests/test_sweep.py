"""Sweeps: what a file says, which runs it makes, and what a mistake in it is told."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
import pickle
import re
import tomllib
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.io import netcdf_file
from sweep_files import SCENARIO, SWEEP, write_sweep

import contactlib as cl
from contactlib import sweep as sweeps
from contactlib.cli import main
from contactlib.ensemble_run import DEFAULT_TOLERANCE
from contactlib.files import package_folder
from contactlib.parameters import FloatArray
from contactlib.scenario import build_scenario, build_wheelset
from contactlib.sweep.distribution import Choice, Distribution, LogUniform, Normal, Uniform, Whole
from contactlib.sweep.outcomes import OUTCOMES, analyse
from contactlib.sweep.plan import ScenarioBuilder

MODELS = package_folder("models").glob("*.toml")
SHIPPED = sorted(path.name for path in MODELS if "axes" in tomllib.loads(path.read_text()))
AXES = '[axes.x]\nparameter = "vehicle.wheelset.inertia"\nfrom = 200.0\nto = 300.0\n'
RANDOM = '[sampling]\nkind = "{}"\nruns = {}\nseed = {}\n'


def scenarios_of(sweep: cl.Sweep) -> list[cl.Scenario]:
    builder = ScenarioBuilder(sweep.plan)
    return [builder.build(row.tolist()) for row in sweep.values]


# ---- samples --------------------------------------------------------------------------------


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


# ---- parameters -----------------------------------------------------------------------------


def axis_values(tmp_path: Path, axis: str, scenario: str = SCENARIO) -> list[cl.Scenario]:
    text = SWEEP.partition("[axes")[0] + f"[axes.x]\n{axis}\n"
    return scenarios_of(cl.load_sweep(write_sweep(tmp_path, text, scenario)))


def test_paths_reach_every_section(tmp_path: Path) -> None:
    def of(parameter: str, values: str) -> list[cl.Scenario]:
        return axis_values(tmp_path, f'parameter = "{parameter}"\nvalues = [{values}]')

    loads = of("vehicle.contact.normal_load", '"180 kN", 220e3')
    assert [s.drivetrain.wheelset.element.contact.normal_load for s in loads] == [180e3, 220e3]
    grades = of("vehicle.resistance.grade", '"1 %", 0.02')
    assert [s.drivetrain.wheelset.resistance.grade for s in grades] == [0.01, 0.02]
    assert [s.drivetrain.motor_lag for s in of("motor.lag", '"5 ms", 0.02')] == [0.005, 0.02]
    assert [s.demand.value for s in of("demand.torque[1]", '"9 kN.m"')] == [(10e3, 9e3)]
    assert [s.sensors.seed for s in of("sensors.seed", "3, 4")] == [3.0, 4.0]
    assert [s.duration for s in of("run.duration", "0.5, 1.0")] == [0.5, 1.0]
    references = of("controllers.creep_pi.reference", '"1 %", 0.02')
    assert [s.controller("creep_pi").reference for s in references] == [0.01, 0.02]  # type: ignore[attr-defined]


def test_one_axis_sets_several_parameters(tmp_path: Path) -> None:
    patch = 'parameter = ["track.friction[1]", "track.friction[2]"]\nvalues = [0.4]'
    (found,) = axis_values(tmp_path, patch)
    assert found.track.friction_left.value == (1.0, 0.4, 0.4, 1.0)


def test_a_factor_multiplies_what_the_file_has(tmp_path: Path) -> None:
    half, all_of_it = axis_values(tmp_path, 'factor_on = "demand.torque"\nvalues = [0.5, 1.0]')
    assert half.demand.value == (5e3, 11.5e3)
    assert all_of_it.demand.value == (10e3, 23e3)
    (inertia,) = axis_values(tmp_path, 'factor_on = "vehicle.wheelset.inertia"\nvalues = [0.5]')
    assert inertia.drivetrain.wheelset.inertia == 125.0
    designed = cl.load_sweep(write_sweep(tmp_path)).scenario.controller("creep_pi")
    axis = 'factor_on = "controllers.creep_pi.proportional_gain"\nvalues = [2.0]'
    (changed,) = axis_values(tmp_path, axis)
    gain = changed.controller("creep_pi").proportional_gain  # type: ignore[attr-defined]
    assert gain == 2.0 * designed.proportional_gain  # type: ignore[attr-defined]


def test_controllers_do_not_know_what_varies_unless_redesigned(tmp_path: Path) -> None:
    axis = '[axes.x]\nparameter = "vehicle.wheelset.inertia"\nvalues = [125.0, 250.0]\n'
    head = SWEEP.partition("[axes")[0]
    once = scenarios_of(cl.load_sweep(write_sweep(tmp_path, head + axis)))
    anew = scenarios_of(cl.load_sweep(write_sweep(tmp_path, "redesign = true\n" + head + axis)))
    (a, b), (c, d) = (
        [s.controller("creep_pi").proportional_gain for s in found]  # type: ignore[attr-defined]
        for found in (once, anew)
    )
    assert a == b == d
    assert c != d


def test_laws_get_the_tables_that_they_need(tmp_path: Path) -> None:
    law = (
        '\n[vehicle_changes.law]\nkind = "polach"\nadhesion_reduction = 1.0\n'
        "slip_reduction = 0.4\nkalker_coefficient = 3.0\n"
    )
    axis = 'parameter = "vehicle.law.slip_reduction"\nvalues = [0.3, 0.4]'
    low, high = (
        s.drivetrain.wheelset.element.table for s in axis_values(tmp_path, axis, SCENARIO + law)
    )
    assert low.traction_ratio(1.0, 0.0) < high.traction_ratio(1.0, 0.0)
    many = '[axes.x]\nparameter = "vehicle.law.slip_reduction"\nfrom = 0.3\nto = 0.4\n'
    text = SWEEP.partition("[axes")[0] + RANDOM.format("monte_carlo", 100, 1) + many
    with pytest.raises(cl.ModelError, match=r"axes\.x: each of 100 values needs a table"):
        cl.load_sweep(write_sweep(tmp_path, text, SCENARIO + law))


# ---- mistakes -------------------------------------------------------------------------------

CASES = {
    'parameter = "vehicle.wheelset.inertai"\nvalues = [1.0]': "did you mean 'inertia'",
    'parameter = "wheelset.inertia"\nvalues = [1.0]': "'wheelset' is not known",
    'parameter = "inertia"\nvalues = [1.0]': "not a path such as",
    'parameter = "vehicle.law.kind"\nvalues = [1.0]': "'kind' is not known",
    'parameter = "demand.torque"\nvalues = [1.0]': "is a list of 2",
    'parameter = "demand.torque[2]"\nvalues = [1.0]': "only 2 entries",
    'parameter = "motor.lag[0]"\nvalues = [1.0]': "a number, not a list",
    'parameter = "track.time[0]"\nvalues = [1.0]': "no list of this name",
    'factor_on = "motor.lag"\nvalues = [1.0]': "does not give the number",
    'parameter = "controllers.pi.reference"\nvalues = [1.0]': "'pi' is not known",
    'parameter = "controllers.threshold.sample_time"\nvalues = [0.1]': "does not run",
    'factor_on = "vehicle.wheelset.inertia"\nvalues = [-1.0]': "-1.0 times 250.0 is out of range",
    'parameter = "vehicle.wheelset.inertia"\nvalues = ["1 kN"]': "number in kg.m2",
    'parameter = "vehicle.wheelset.inertia"\nvalues = [0.0]': "inertia = 0.0 is out of range",
    'parameter = "vehicle.wheelset.inertia"\nvalues = [2.0, 2.0]': "a number twice",
    'parameter = "vehicle.wheelset.inertia"\nvalues = []': "at least one number",
    'parameter = "vehicle.wheelset.inertia"': "from is missing",
    'parameter = "vehicle.wheelset.inertia"\nfrom = 1.0\nto = 2.0\ncount = 0': "count = 0",
    'parameter = "vehicle.wheelset.inertia"\nfrom = 1.0\nto = 1.0\ncount = 2': "would be the same",
    'parameter = "motor.lag"\nfrom = 0.0\nto = 1.0\ncount = 2\nspacing = "log"': "above zero",
    'parameter = "motor.lag"\nfrom = 0.0\nto = 1.0\ncount = 2\nspacing = "x"': "must be one of",
    'parameter = "motor.lag"\nfrom = 0.0\nto = 1.0\ncuont = 2': "did you mean 'count'",
    'paramter = "motor.lag"\nvalues = [1.0]': "did you mean 'parameter'",
    'parameter = "motor.lag"\ndistribution = "uniform"\nfrom = 0.0\nto = 1.0': (
        "distribution is for random samples, and this sweep is of a grid"
    ),
    'parameter = "vehicle_changes.wheelset.inertia"\nvalues = [1.0]': (
        "say vehicle.wheelset.inertia"
    ),
    'parameter = ["motor.lag", "run.initial_speed"]\nvalues = [1.0]': "different units",
    'parameter = "motor.lag"\nfactor_on = "motor.lag"\nvalues = [1.0]': "exactly one of them",
    'parameter = "vehicle.friction.weakening_length"\nvalues = [1e-6]': "exactly one of them",
    'parameter = "vehicle.friction.kinetic"\nvalues = [0.46]': "kinetic",
    'parameter = "vehicle.law.slip_reduction"\nvalues = [0.5]': "takes no other key",
}


@pytest.mark.parametrize("axis", CASES)
def test_a_wrong_axis_is_one_line_that_names_it(tmp_path: Path, axis: str) -> None:
    path = write_sweep(tmp_path, SWEEP.partition("[axes")[0] + f"[axes.x]\n{axis}\n")
    with pytest.raises(cl.ModelError) as caught:
        cl.load_sweep(path)
    message = str(caught.value)
    assert CASES[axis] in message
    assert message.startswith(f"{path}: ")
    assert re.search(r"axes\.x: |run \d+ \(x = ", message)
    assert "\n" not in message


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('scenario = "s.toml"', 'scenario = "t.toml"', "t.toml: no such file"),
        ('scenario = "s.toml"', 'scenario = "../s.toml"', "must lie beside the sweep"),
        ('scenario = "s.toml"', 'scenario = "roller_rig.toml"', "is a model, not a scenario"),
        ('"slip_work"', '"slip_wrok"', "did you mean 'slip_work'"),
        ('"slip_work"', '"distance", "distance"', "a name twice"),
        ('["creep_pi", "open_loop"]', '["pid"]', "'pid' is not known"),
        ("outcomes", "outcome", "outcome is not a known key; did you mean 'outcomes'"),
        ("[axes.inertia]", "[axes.slip_work]", "not be that of an outcome"),
        ("[axes.inertia]", "[axes.run]", "'run' is not a name"),
        ("[axes.inertia]", "[axes.string9]", "'string9' is not a name"),
        ("track.friction[1]", "track.friction[2]", "set by axes.patch already"),
        ("[axes.patch]", '[sampling]\nkind = "gird"\n[axes.patch]', "kind = 'gird' must be"),
        ("[axes.patch]", '[sampling]\nkind = "monte_carlo"\n[axes.patch]', "runs is missing"),
        ("[axes.patch]", "[sampling]\nseed = 1\n[axes.patch]", "seed is not a known key"),
        ('name = "Quick"', 'redesign = 1\nname = "Quick"', "redesign = 1 must be true or false"),
        ('name = "Quick"', 'noise = "white"\nname = "Quick"', "noise = 'white' must be one of"),
        ('name = "Quick"', 'tolerance = 1.0\nname = "Quick"', "tolerance = 1.0 is out of range"),
        ('name = "Quick"', 'step = "1 m"\nname = "Quick"', "step = '1 m' must be a number in s"),
        ("[axes.patch]", "[axes.patch", "at line"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in SWEEP
    path = write_sweep(tmp_path, SWEEP.replace(old, new, 1))
    if said.startswith("set by"):
        path.write_text(SWEEP.replace(old, new))
    with pytest.raises(cl.ModelError) as caught:
        cl.load_sweep(path)
    message = str(caught.value)
    assert said in message
    assert message.startswith(f"{path}: ")


RANDOM_CASES = {
    'distribution = "gauss"\nfrom = 1.0\nto = 2.0': "distribution = 'gauss' must be one of",
    'distribution = "normal"\nmean = 1.0': "standard_deviation is missing",
    'distribution = "normal"\nmean = 1.0\nstandard_deviation = 0.0': "must be finite and > 0",
    'distribution = "normal"\nmean = 1.0\nstandard_deviation = 9.0': "is out of range",
    'distribution = "log_uniform"\nfrom = 0.0\nto = 2.0': "must be > 0",
    'distribution = "whole"\nfrom = 0.5\nto = 2.0': "must be whole numbers",
    "from = 3.0\nto = 2.0": "must be < to",
    "from = 1.0\nto = 2.0\ncount = 3": "count is for a grid, and this sweep is of random",
}


@pytest.mark.parametrize("axis", RANDOM_CASES)
def test_a_wrong_random_axis_is_one_line_that_names_it(tmp_path: Path, axis: str) -> None:
    head = SWEEP.partition("[axes")[0] + RANDOM.format("monte_carlo", 50, 1)
    text = f'{head}[axes.x]\nparameter = "vehicle.wheelset.inertia"\n{axis}\n'
    with pytest.raises(cl.ModelError, match=r"axes\.x: ") as caught:
        cl.load_sweep(write_sweep(tmp_path, text))
    assert RANDOM_CASES[axis] in str(caught.value)


def test_each_kind_of_file_names_its_command() -> None:
    for command, name, said in (
        ("simulate", SHIPPED[0], "'contactlib sweep' runs it"),
        ("table", SHIPPED[0], "'contactlib sweep' runs it"),
        ("sweep", "roller_rig.toml", "is a model, not a sweep: the command 'contactlib simulate'"),
        ("sweep", "sanding.toml", "is a scenario, not a sweep: the command 'contactlib simulate'"),
    ):
        result = CliRunner().invoke(main, [command, name])
        assert result.exit_code == 2
        assert said in result.stderr
        assert result.stderr.count("\n") == 1


# ---- outcomes -------------------------------------------------------------------------------


def test_outcomes_are_those_of_single_runs_and_of_the_analysis(tmp_path: Path) -> None:
    sweep = cl.load_sweep(write_sweep(tmp_path))
    found = cl.ensemble(sweep)
    scenarios = scenarios_of(sweep)
    for i, name in enumerate(sweep.plan.controllers):
        for j, scenario in enumerate(scenarios):
            run = cl.run_scenario(scenario, name, step=0.01, tolerance=DEFAULT_TOLERANCE)
            alone = cl.metrics(run, scenario.drivetrain)
            got = found["slip_work"].values[i].reshape(-1)[j]
            assert got == alone.slip_work
    for j, scenario in enumerate(scenarios):
        wheelset = scenario.drivetrain.wheelset
        given: dict[str, Any] = {"speed": scenario.design_speed}
        fold = cl.find_fold(wheelset, **given).drive_torque
        assert found["critical_torque"].values.reshape(-1)[j] == fold
        patch = min(scenario.track.friction_left.value)
        known = cl.clearing(wheelset, drive_torque=23e3, friction_scale=patch, **given)
        assert found["clearing_time"].values.reshape(-1)[j] == known.time


@pytest.mark.parametrize("noise", ["", "common", "independent"])
@pytest.mark.parametrize("kind", ["grid", "monte_carlo"])
def test_every_run_can_be_made_once_more(tmp_path: Path, kind: str, noise: str) -> None:
    text = SWEEP.replace('"critical_torque", "clearing_time"', '"jerk", "largest_creepage"')
    text = f'noise = "{noise}"\n{text}' if noise else text
    if kind != "grid":
        text = text.partition("[axes")[0] + RANDOM.format(kind, 6, 2) + AXES
    sweep = cl.load_sweep(write_sweep(tmp_path, text))
    found = cl.ensemble(sweep, chunk=4)
    common = noise == "common" or (not noise and kind == "grid")
    for i, name in enumerate(sweep.plan.controllers):
        for j in range(sweep.runs):
            assert sweep.plan.index_of(j) == (0 if common else j)
            scenario = sweep.scenario_of(j)
            run = cl.run_scenario(
                scenario,
                name,
                index=0 if common else j,
                step=0.01,
                tolerance=sweep.plan.tolerance,
            )
            again = cl.metrics(run, scenario.drivetrain)
            for outcome in sweep.plan.outcomes:
                values = found[outcome].values.reshape(2, -1)
                assert values[i, j] == getattr(again, outcome), (name, j, outcome)


def test_runs_with_common_noise_differ_by_their_parameters_alone(tmp_path: Path) -> None:
    axis = '[axes.x]\nparameter = "vehicle.wheelset.inertia"\nvalues = [200.0, {}]\n'
    noises = {"common": 0.02, "independent": 0.02}
    for noise in noises:
        head = f'noise = "{noise}"\n' + SWEEP.partition("[axes")[0]
        path = write_sweep(tmp_path, head + axis.format(200.0 * (1.0 + 1e-9)))
        one, other = cl.ensemble(path)["slip_work"].sel(controller="creep_pi").values
        noises[noise] = abs(other / one - 1.0)
    assert noises["common"] < 1e-5
    assert noises["independent"] > 1e-3


def built_anew(sweep: cl.Sweep, run: int) -> cl.Scenario:
    """Scenario of a run, from changed contents of its files and with nothing kept."""
    contents = sweep.plan.contents
    data, vehicle = copy.deepcopy(contents.data), copy.deepcopy(contents.vehicle)
    designs = dict(sweep.plan.controllers)
    for axis, value in zip(sweep.plan.axes, sweep.values[run].tolist(), strict=True):
        for target in axis.targets:
            new = target.scale(value) if axis.factor else value
            where, *section = target.section
            if where == "controllers":
                known: Any = designs[section[0]]
                designs[section[0]] = dataclasses.replace(known, **{target.key: new})
                continue
            table = vehicle if where == "vehicle" else data
            for name in section if where == "vehicle" else [where]:
                table = table.setdefault(name, {})
            if target.index is None:
                table[target.key] = new
            else:
                table[target.key][target.index] = new
    law = sweep.scenario.drivetrain.wheelset.element.table
    wheelset = build_wheelset(vehicle, Path(), law, print)
    return build_scenario(data, wheelset, designs)


def same(one: Any, other: Any, where: str = "") -> None:
    """Assert that all fields are equal to the last bit."""
    if dataclasses.is_dataclass(one) and not isinstance(one, type):
        assert type(one) is type(other), where
        for field in dataclasses.fields(one):
            pair = getattr(one, field.name), getattr(other, field.name)
            same(*pair, f"{where}.{field.name}")
    elif isinstance(one, Mapping):
        assert list(one) == list(other)
        for key in one:
            same(one[key], other[key], f"{where}[{key!r}]")
    elif isinstance(one, cl.CreepForceTable):
        assert one.data == other.data
    else:
        assert repr(one) == repr(other), where


PARAMETERS = (
    '"vehicle.contact.normal_load"\nvalues = [210e3, 220e3]',
    '"vehicle.friction.kinetic"\nvalues = [0.2, 0.21]',
    '"vehicle.friction.k_hat"\nvalues = [0.2, 0.3]',
    '"vehicle.wheelset.saturation_creepage"\nvalues = [0.01, 0.02]',
    '"vehicle.wheelset.inertia"\nvalues = [200, 250.0]',
    '"vehicle.resistance.grade"\nvalues = [0.0, 0.01]',
    '"track.friction[1]"\nvalues = [0.5, 0.9]',
    '"demand.torque[1]"\nvalues = [20e3, 21e3]',
    '"run.initial_speed"\nvalues = [8.0, 9.0]',
    '"motor.lag"\nvalues = [0.0, 0.01]',
    '"sensors.seed"\nvalues = [1.0, 2.0]',
    '"controllers.creep_pi.reference"\nvalues = [0.01, 0.02]',
)


@pytest.mark.parametrize("first", range(len(PARAMETERS)))
def test_what_is_kept_from_run_to_run_is_what_would_be_built(tmp_path: Path, first: int) -> None:
    # Each parameter alone, and in turn with two others, so that all come and go.
    for count in (1, 3):
        chosen = [PARAMETERS[(first + 4 * i) % len(PARAMETERS)] for i in range(count)]
        axes = "".join(f"[axes.x{i}]\nparameter = {axis}\n" for i, axis in enumerate(chosen))
        text = SWEEP.partition("[axes")[0] + axes
        sweep = cl.load_sweep(write_sweep(tmp_path, text, SCENARIO))
        order = np.random.default_rng(first).permutation(2 * sweep.runs) % sweep.runs
        for run in order.tolist():
            same(sweep.scenario_of(run), built_anew(sweep, run))


def test_runs_share_what_the_axes_leave_alone(tmp_path: Path) -> None:
    one, other = axis_values(tmp_path, 'factor_on = "demand.torque"\nvalues = [0.8, 0.9]')
    assert one.demand != other.demand
    for name in ("drivetrain", "track", "sensors"):
        assert getattr(one, name) is getattr(other, name)
    inertia = 'parameter = "vehicle.wheelset.inertia"\nvalues = [200.0, 210.0]'
    one, other = axis_values(tmp_path, inertia)
    assert one.drivetrain.wheelset.inertia != other.drivetrain.wheelset.inertia
    assert one.drivetrain.wheelset.element is other.drivetrain.wheelset.element
    assert one.demand is other.demand


def test_warnings_at_the_ends_are_counted(tmp_path: Path) -> None:
    # Friction falls far enough at both values of one axis, whatever the other is.
    axes = AXES.replace("from = 200.0\nto = 300.0", "values = [200.0, 300.0]")
    axes += '[axes.y]\nparameter = "vehicle.friction.k_hat"\nvalues = [0.3, 1.5]\n'
    with pytest.warns(cl.ProcessZoneWarning, match="2 of 4 runs at the ends"):
        cl.load_sweep(write_sweep(tmp_path, SWEEP.partition("[axes")[0] + axes))


def test_there_is_no_scenario_of_a_run_that_is_not_there(tmp_path: Path) -> None:
    sweep = cl.load_sweep(write_sweep(tmp_path))
    assert sweep.scenario_of(-1).drivetrain.wheelset.inertia == 300.0
    with pytest.raises(IndexError):
        sweep.scenario_of(6)


def test_analysis_agrees_with_a_second_way(tmp_path: Path) -> None:
    names = list(cl.ANALYSES)
    axis = '[axes.x]\nfactor_on = "demand.torque"\nvalues = [0.5, 1.0, 1.2]\n'
    text = re.sub(r"controllers = .*\n", "", SWEEP.partition("[axes")[0])
    text = re.sub(r"outcomes = .*", f"outcomes = {json.dumps(names)}", text) + axis
    found = cl.ensemble(write_sweep(tmp_path, text))
    assert "controller" not in found.dims
    scenario = cl.load_scenario(tmp_path / "s.toml")
    wheelset, speed = scenario.drivetrain.wheelset, scenario.design_speed
    # Eigenvalues of the steady states against the fold of the torque.
    torque = 23e3 * found["x"].values
    assert (found["stable"].values == (torque < found["critical_torque"].values)).all()
    assert (found["torque_margin"].values > 0.0).tolist() == found["stable"].values.tolist()
    clearing = found["clearing_time"].values
    assert clearing[0] == math.inf  # half of it holds on the patch too
    assert 0.0 < clearing[1] < 0.1
    assert clearing[2] == 0.0  # too much for good friction
    assert found["delay_limit"].values == pytest.approx(1.0 / found["worst_pole"].values)
    creepage = np.linspace(0.001, 0.1, 20001)
    force = wheelset.element.at_creepage(creepage, speed=speed)["creep_force"]
    assert found["available_force"].values == pytest.approx(force.max(), rel=1e-6)
    torques = cl.quasi_steady_torque(wheelset, creepage, speed=speed)
    assert found["critical_torque"].values == pytest.approx(torques.max(), rel=1e-6)
    assert found["critical_creepage"].values == pytest.approx(creepage[torques.argmax()], rel=1e-3)


DAMPING = "\n[vehicle_changes.wheelset]\ndamping = {}\n"


def analysis_of(tmp_path: Path, axis: str, scenario: str = SCENARIO) -> dict[str, FloatArray]:
    """Outcomes of the analysis along one axis."""
    names = list(cl.ANALYSES)
    text = re.sub(r"controllers = .*\n", "", SWEEP.partition("[axes")[0])
    text = re.sub(r"outcomes = .*", f"outcomes = {json.dumps(names)}", text)
    found = cl.ensemble(write_sweep(tmp_path, f"{text}[axes.x]\n{axis}\n", scenario))
    return {name: found[name].values for name in [*names, "x"]}


@pytest.mark.parametrize("damping", [0.0, 20.0, 100.0])
def test_margin_clearing_and_stability_agree_for_either_sign(
    tmp_path: Path, damping: float
) -> None:
    values = np.linspace(-1.4, 1.4, 15).round(2).tolist()
    axis = f'factor_on = "demand.torque"\nvalues = {values}'
    found = analysis_of(tmp_path, axis, SCENARIO + DAMPING.format(damping))
    torque, stable = 23e3 * found["x"], found["stable"] == 1.0
    known = np.isfinite(found["torque_margin"])
    assert known.any()
    assert ((found["torque_margin"] > 0.0) == stable)[known].all()
    for name in (
        "critical_torque",
        "patch_critical_torque",
        "critical_creepage",
        "hysteresis",
        "clearing_time",
    ):
        assert (np.isnan(found[name]) | (torque >= 0.0)).all()
    assert np.isnan(found["torque_margin"][torque < 0.0]).all()
    assert ((found["clearing_time"] > 0.0) == stable)[torque > 0.0].all()
    # Braking against the balance of torques, -r Q(-zeta) = r Q(zeta): damping brakes too.
    wheelset = cl.load_scenario(tmp_path / "s.toml").drivetrain.wheelset
    held = -cl.quasi_steady_torque(wheelset, -np.linspace(0.0, 0.05, 5001), speed=10.0).min()
    assert (stable == (-torque < held))[torque < 0.0].all()
    assert stable[torque < 0.0].any()
    assert not stable.all()


def test_wheels_that_spin_against_their_bearings_are_not_held(tmp_path: Path) -> None:
    axis = 'parameter = "vehicle.contact.normal_load"\nvalues = [1.0, "230 kN"]'
    scenario = SCENARIO + DAMPING.format(5.0)
    found = analysis_of(tmp_path, axis, scenario)
    assert found["stable"].tolist() == [0.0, 1.0]
    assert found["clearing_time"][0] == 0.0
    assert found["clearing_time"][1] > 0.0


def test_maps_of_friction_and_load_are_in_order() -> None:
    sweep = cl.load_sweep("friction_and_load_sweep.toml")
    points = np.arange(sweep.runs).reshape(sweep.shape)[::9, ::4]  # (load, patch friction)
    builder = ScenarioBuilder(sweep.plan)
    found = [
        [analyse(builder.build(sweep.values[i].tolist()), sweep.plan.outcomes) for i in row]
        for row in points
    ]

    def grid(name: str) -> FloatArray:
        return np.array([[point[name] for point in row] for row in found])

    # At one k_hat and semi-width creep force and saturation creepage are of the load alone.
    loads = sweep.values[points[:, 0], 0]
    critical = grid("critical_torque")
    assert critical == pytest.approx(critical[:1] * (loads / loads[0])[:, np.newaxis], rel=5e-3)
    assert (grid("patch_critical_torque") < critical).all()
    assert (np.diff(grid("patch_critical_torque")) > 0.0).all()
    time = grid("clearing_time")
    assert (time[0] == 0.0).all()  # this light it does not hold the demand anywhere
    assert (time[1, 1:] >= time[1, :-1]).all()
    assert 0.0 < time[1, 0] < math.inf


def test_a_run_that_fails_is_nan_and_says_so(tmp_path: Path) -> None:
    axis = 'factor_on = "demand.torque"\nvalues = [1.0, 3.0]'  # the first demand is too much
    scenario = SCENARIO.replace('"10 kN.m", "23 kN.m"', '"20 kN.m", "23 kN.m"')
    path = write_sweep(tmp_path, SWEEP.partition("[axes")[0] + f"[axes.x]\n{axis}\n", scenario)
    found = cl.ensemble(path)
    assert found["failed"].values.tolist() == [[0, 1], [0, 1]]
    assert np.isnan(found["slip_work"].values).tolist() == [[False, True], [False, True]]
    assert np.isfinite(found["critical_torque"].values).all()
    result = CliRunner().invoke(
        main, ["sweep", str(path), "-o", str(tmp_path / "out"), "--no-maps"]
    )
    assert result.exit_code == 0, result.output
    assert re.search(r"^failed +1 +1 +1$", result.output, re.MULTILINE)
    assert "run 1 (x = 3) under creep_pi: " in result.output


def test_a_sweep_of_which_nothing_came_is_an_error(tmp_path: Path) -> None:
    axis = 'parameter = ["demand.torque[0]", "demand.torque[1]"]\nvalues = [{}]'
    head = SWEEP.partition("[axes")[0].replace(', "critical_torque", "clearing_time"', "")
    for values, status in (('"23 kN.m", "90 kN.m"', 0), ('"80 kN.m", "90 kN.m"', 1)):
        path = write_sweep(tmp_path, f"{head}[axes.x]\n{axis.format(values)}\n")
        given = ["sweep", str(path), "-o", str(tmp_path / f"out{status}")]
        result = CliRunner().invoke(main, given)
        assert result.exit_code == status, result.output
        assert (result.stderr == "contactlib: all runs failed\n") == bool(status)


def test_report_is_one_table_with_true_medians(tmp_path: Path) -> None:
    found = cl.ensemble(sweep := cl.load_sweep(write_sweep(tmp_path)))
    found["slip_work"].values[0] = [[1.0, 2.0, 4.0], [8.0, math.inf, math.nan]]
    found["failed"].values[1, 0] = 1
    found["clearing_time"].values[:] = math.nan
    lines = sweeps.report(sweep, found)
    table = [re.split(r" {2,}", line.strip()) for line in lines[-5:]]
    assert table[0] == ["outcome", "unit", "creep_pi", "open_loop", "wheelset"]
    assert table[1][:3] == ["slip work", "J", "4 (1, inf), 1 inf, 1 nan"]
    critical = found["critical_torque"].values
    middle, low, high = (f"{f(critical):.4g}" for f in (np.median, np.min, np.max))
    assert table[2] == ["critical torque", "N.m", f"{middle} ({low}, {high})"]
    assert table[3] == ["clearing time", "s", "-"]
    assert table[4] == ["failed", "1", "0", "3"]
    found["slip_work"].values[0] = [[1.0, 2.0, 4.0], [8.0, 16.0, 32.0]]
    assert "6 (1, 32)" in sweeps.report(sweep, found)[-4]  # between the two in the middle


def test_a_file_may_begin_with_the_mark_of_its_encoding(tmp_path: Path) -> None:
    plain = cl.load_sweep(path := write_sweep(tmp_path))
    for file in (path, tmp_path / "s.toml"):
        file.write_text(file.read_text(), encoding="utf-8-sig")
    marked = cl.load_sweep(path)
    assert marked.text == plain.text
    assert marked.plan.digest(marked.values) == plain.plan.digest(plain.values)


def test_parameters_that_do_not_go_together_fail_where_they_meet(tmp_path: Path) -> None:
    # Found only inside: both ends of the axis are valid, the middle is not a whole number.
    axis = 'parameter = "sensors.seed"\nvalues = [1.0, 1.5, 2.0]'
    found = cl.ensemble(write_sweep(tmp_path, SWEEP.partition("[axes")[0] + f"[axes.x]\n{axis}\n"))
    assert found["failed"].values.tolist() == [[0, 1, 0], [0, 1, 0]]
    assert np.isnan(found["critical_torque"].values).tolist() == [False, True, False]


# ---- the dataset ----------------------------------------------------------------------------


def test_dataset_is_labelled_and_its_file_opens_everywhere(tmp_path: Path) -> None:
    import xarray

    path = write_sweep(tmp_path)
    found = cl.ensemble(path, output=tmp_path / "out")
    assert found["slip_work"].dims == ("controller", "patch", "inertia")
    assert found["critical_torque"].dims == ("patch", "inertia")
    assert found["controller"].values.tolist() == ["creep_pi", "open_loop"]
    for name in ("slip_work", "critical_torque", "clearing_time"):
        assert found[name].attrs["units"] == OUTCOMES[name].unit
        assert found[name].attrs["long_name"] == OUTCOMES[name].description
    assert found["inertia"].attrs == {"units": "kg.m2", "long_name": "vehicle.wheelset.inertia"}
    assert found["patch"].attrs["units"] == "1"
    assert found.attrs["sweep_file"] == path.read_text()
    assert "seed" not in found.attrs
    settings_of_runs = {key: found.attrs[key] for key in ("step", "tolerance", "redesign")}
    assert settings_of_runs == {
        "step": "default",
        "tolerance": DEFAULT_TOLERANCE,
        "redesign": "false",
    }
    assert json.loads(found.attrs["scenario"]) == tomllib.loads(SCENARIO)
    assert json.loads(found.attrs["vehicle"])["wheelset"]["inertia"] == 250.0
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["quick_sweep.nc"]
    with xarray.open_dataset(tmp_path / "out" / "quick_sweep.nc") as read:
        xarray.testing.assert_identical(read.load(), found)
    with netcdf_file(tmp_path / "out" / "quick_sweep.nc", mmap=False) as plain:
        assert vars(plain.variables["slip_work"])["units"] == b"J"
        assert plain.variables["slip_work"].shape == (2, 2, 3)


def test_samples_are_along_one_dimension(tmp_path: Path) -> None:
    head = SWEEP.partition("[axes")[0] + RANDOM.format("latin_hypercube", 4, 1)
    sweep = cl.load_sweep(write_sweep(tmp_path, head + AXES))
    found = cl.ensemble(sweep)
    assert found.attrs["seed"] == 1
    assert found["slip_work"].dims == ("controller", "run")
    assert found["x"].dims == ("run",)
    assert found["x"].values.tolist() == sweep.values[:, 0].tolist()


def test_a_plan_is_small_and_knows_no_folder(tmp_path: Path) -> None:
    sweep = cl.load_sweep(write_sweep(tmp_path))
    pickled = pickle.dumps(sweep.plan)
    assert len(pickled) < 20_000
    assert str(tmp_path).encode() not in pickled
    again = pickle.loads(pickled)  # noqa: S301
    assert again.digest(sweep.values) == sweep.plan.digest(sweep.values)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_sweeps_load_and_their_ends_can_run(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sweep = cl.load_sweep(name)
    assert sweep.source
    assert sweep.runs <= 1000


def test_numbers_of_workers_and_runs_are_checked(tmp_path: Path) -> None:
    path = write_sweep(tmp_path)
    with pytest.raises(ValueError, match="workers = 0 is out of range"):
        cl.ensemble(path, workers=0)
    with pytest.raises(ValueError, match="chunk = 0 is out of range"):
        cl.ensemble(path, chunk=0)
