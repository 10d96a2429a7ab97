"""Scenarios that a sweep makes."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweep_files import HEAD, RANDOM, SCENARIO, axis_values, write_sweep

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.files.model import build_wheelset
from contactlib.files.scenario import build_scenario
from contactlib.runs import Sweep


def test_laws_get_the_tables_that_they_need(tmp_path: Path) -> None:
    law = '\n[wheelset_changes.law]\nkind = "polach"\nadhesion_reduction = 1.0\n'
    law += "slip_reduction = 0.4\n"
    contact = 'radius = "500 mm"\nsemi_width = "5 mm"', "semi_axis_x = 6e-3\nsemi_axis_y = 8e-3"
    vehicle = (package_folder("models") / "locomotive.toml").read_text().replace(*contact)
    (tmp_path / "ellipse.toml").write_text(vehicle)
    scenario = SCENARIO.replace("locomotive.toml", "ellipse.toml") + law
    axis = 'parameter = "vehicle.law.slip_reduction"\nvalues = [0.3, 0.4]'
    low, high = (s.drivetrain.wheelset.element.table for s in axis_values(tmp_path, axis, scenario))
    assert low.traction_ratio(1.0, 0.0) < high.traction_ratio(1.0, 0.0)
    many = '[axes.x]\nparameter = "vehicle.law.slip_reduction"\nfrom = 0.3\nto = 0.4\n'
    text = HEAD + RANDOM.format("monte_carlo", 100, 1) + many
    with pytest.raises(cl.ModelError, match=r"axes\.x: each of 100 values needs its own table"):
        cl.load_sweep(write_sweep(tmp_path, text, scenario))


def built_anew(sweep: Sweep, run: int) -> cl.Scenario:
    """Scenario of a run, from changed contents of its files and with nothing kept."""
    contents = sweep.plan.contents
    parts: dict[str, Any] = {
        "": copy.deepcopy(contents.data),
        "vehicle": copy.deepcopy(contents.vehicle),
        "controllers": dict(sweep.plan.controllers),
    }
    for axis, value in zip(sweep.plan.axes, sweep.values[run].tolist(), strict=True):
        for target in axis.targets:
            where, name = target.section
            given: dict[str, Any] = {}
            of_controller = where == "controllers"
            table = given if of_controller else parts[where].setdefault(name, {})
            target.put(table, value, factor=axis.factor)
            if of_controller:
                parts[where][name] = dataclasses.replace(parts[where][name], **given)
    law = sweep.scenario.drivetrain.wheelset.element.table
    wheelset = build_wheelset(parts["vehicle"], Path(), law, print)
    return build_scenario(parts[""], wheelset, parts["controllers"])


def structure(part: Any) -> Any:
    """All fields, to the last bit."""
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        names = [field.name for field in dataclasses.fields(part)]
        return type(part), [(name, structure(getattr(part, name))) for name in names]
    if isinstance(part, Mapping):
        return [(key, structure(value)) for key, value in part.items()]
    return part.data if isinstance(part, cl.CreepForceTable) else repr(part)


PARAMETERS = (
    '"vehicle.contact.wheel_load"\nvalues = [210e3, 220e3]',
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
        text = HEAD + axes
        sweep = cl.load_sweep(write_sweep(tmp_path, text, SCENARIO))
        order = np.random.default_rng(first).permutation(2 * sweep.runs) % sweep.runs
        for run in order.tolist():
            assert structure(sweep.scenario_of(run)) == structure(built_anew(sweep, run))


def test_runs_share_what_the_axes_leave_alone(tmp_path: Path) -> None:
    first, other = axis_values(tmp_path, 'factor_on = "demand.torque"\nvalues = [0.8, 0.9]')
    assert first.demand != other.demand
    for name in ("drivetrain", "track", "sensors"):
        assert getattr(first, name) is getattr(other, name)
    inertia = 'parameter = "vehicle.wheelset.inertia"\nvalues = [200.0, 210.0]'
    first, other = axis_values(tmp_path, inertia)
    assert first.drivetrain.wheelset.inertia != other.drivetrain.wheelset.inertia
    assert first.drivetrain.wheelset.element is other.drivetrain.wheelset.element
    assert first.demand is other.demand


def test_there_is_no_scenario_of_a_run_that_is_not_there(tmp_path: Path) -> None:
    sweep = cl.load_sweep(write_sweep(tmp_path))
    assert sweep.scenario_of(-1).drivetrain.wheelset.inertia == 420.0
    with pytest.raises(IndexError):
        sweep.scenario_of(6)


def test_a_plan_names_no_folder(tmp_path: Path) -> None:
    sweep = cl.load_sweep(write_sweep(tmp_path))
    pickled = pickle.dumps(sweep.plan)
    assert str(tmp_path).encode() not in pickled
    again = pickle.loads(pickled)  # noqa: S301
    assert again.digest(sweep.values) == sweep.plan.digest(sweep.values)
