"""The default experiment and the reference run of an FMU."""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from exported_fmu import described, fitting
from fmu_instance import EXPORTS
from native_models import native, with_memory
from plain_scenario import braked_vehicle

import contactlib as cl
from contactlib.export.description import Description
from contactlib.export.package import experiment, reference_run
from contactlib.traction import OpenLoop


def golden(description: Description) -> Any:
    """The reference run as an array with a field for each column."""
    text = io.StringIO(reference_run(description).decode())
    return np.genfromtxt(text, delimiter=",", names=True, deletechars="", dtype=np.float64)


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("speed", [0.2, 10.0, 60.0])
@pytest.mark.parametrize("memory", [False, True])
def test_step_of_a_held_force_is_stable_at_the_start_and_through_the_reference_run(
    locomotive: cl.Model, memory: bool, speed: float, parallel: bool
) -> None:
    model = with_memory(locomotive) if memory else locomotive
    description = Description(
        replace(model, initial_speed=speed), "force_element", parallel_exchange=parallel
    )
    stop, step = experiment(description)
    # The hint is half of the largest stable step.
    assert step <= native(description).get("step_size_hint")[0]
    run = golden(description)
    assert (step <= 2.0 * run["step_size_hint"]).all()
    assert run["time"][-1] == pytest.approx(stop, rel=1e-12)
    assert f"{step:.0e}"[0] in "125"
    assert step == pytest.approx(float(f"{step:.0e}"), rel=1e-12)
    lag = description.element.memory_scales.relaxation_length if memory else 0.0
    builds_up = stop * speed > 5.0 * lag
    assert builds_up or (speed == 0.2 and parallel)
    if builds_up:
        assert {*run["falling_branch"].tolist()} == {0.0, 1.0}


@pytest.mark.parametrize("speed", [1.0, 10.0])
@pytest.mark.parametrize("name", EXPORTS)
def test_explicit_solver_follows_the_reference_run(
    locomotive: cl.Model, name: str, speed: float
) -> None:
    # In the same steps; where the contact remembers, in those that an FMU's messages advise up to
    # twice the saturation creepage, from some of the rows to the next.
    vehicle = replace(fitting(locomotive, name), initial_speed=speed)
    description = described(vehicle, **EXPORTS[name])
    run = golden(description)
    step, substeps = experiment(description).step, 1
    inputs = [v.name for v in description.of_role("input")]
    states = [v.name for v in description.of_role("state")]
    rates = [v.name for v in description.of_role("derivative")]
    model, rows = native(description), np.arange(run.size - 1)
    if description.remembers:
        substeps = math.ceil(step / (0.5 * model.explicit_step()))
        rises = np.abs(run["creepage"]) < 2.0 * description.element.saturation_creepage
        rows = np.flatnonzero(rises[1:] & rises[:-1])[::4]
    solved, y = [], np.array(model.get(*states))
    for row in run[rows]:
        if description.remembers:
            y = np.array([row[name] for name in states])
        for _ in range(substeps):
            model.set(**dict(zip(states, y.tolist(), strict=True)), **{n: row[n] for n in inputs})
            model.evaluate()
            y = y + step / substeps * np.array(model.get(*rates))
        solved.append(y)
    assert len(solved) > 15
    for name, values in zip(states, np.array(solved).T, strict=True):
        expected = run[name][rows + 1]
        assert np.abs(values - expected).max() <= 0.1 * np.ptp(run[name]), name


@pytest.mark.parametrize("name", [name for name in EXPORTS if "body" not in name])
def test_readme_reports_how_the_rows_of_fmpy_compare(
    locomotive: cl.Model, tmp_path: Path, name: str
) -> None:
    model = fitting(locomotive, name)
    fmu = cl.export_fmu(model, tmp_path / "x.fmu", **EXPORTS[name])
    description = fmpy.read_model_description(str(fmu))
    with zipfile.ZipFile(fmu) as archive:
        text = archive.read("documentation/README.txt").decode("ascii")
        csv = io.StringIO(archive.read("documentation/reference_run.csv").decode())
    assert "$" not in text
    here: Any = np.genfromtxt(csv, delimiter=",", names=True, deletechars="", dtype=np.float64)
    step = float(description.defaultExperiment.stepSize)
    assert f"{here.size - 1} steps of {step:g} s" in text
    inputs = [v.name for v in description.modelVariables if v.causality == "input"]
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    there = fmpy.simulate_fmu(
        str(fmu),
        fmi_type="CoSimulation",
        stop_time=float(here["time"][-1]),
        output_interval=step,
        input=here[["time", *inputs]],
        output=outputs,
    )
    states = {u.variable.derivative.name for u in description.derivatives}
    implicit = "Their rows equal these." in text
    lagging = "they lag by one row" in text
    assert [implicit, bool(states), lagging].count(True) == 1
    assert all(name in text for name in states)
    for output in outputs:
        column = here[output]
        if implicit or output in states:
            expected = column[1:]
        elif lagging:
            expected = column[:-1]
        else:
            continue
        np.testing.assert_allclose(there[output][1:], expected, rtol=1e-9, err_msg=output)


@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.slow), 3])
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[] if n == "force_element" else pytest.mark.slow) for n in EXPORTS],
)
def test_description_names_who_made_what(
    locomotive: cl.Model, tmp_path: Path, name: str, version: int
) -> None:
    options = {**EXPORTS[name], "fmi_version": version}
    author = "\u00c5sa <\u00c5ngstr\u00f6m> & daughter"
    model = fitting(locomotive, name)
    fmu = cl.export_fmu(model, tmp_path / "a.fmu", author=author, version="2.3", **options)
    again = cl.export_fmu(model, tmp_path / "b.fmu", author=author, version="2.3", **options)
    assert again.read_bytes() == fmu.read_bytes()  # no date
    description = fmpy.read_model_description(str(fmu))
    assert (description.author, description.version) == (author, "2.3")
    assert description.generationTool == f"contactlib {metadata.version('contactlib-rail')}"
    plain = fmpy.read_model_description(str(cl.export_fmu(model, tmp_path / "c.fmu", **options)))
    assert (plain.author, plain.version) == (None, None)
    for v in description.modelVariables:
        if v.name == "weakening_length":
            kind = v.declaredType
            assert (kind.unit, kind.displayUnit) == ("m", "um")
            (metre,) = (u for u in description.unitDefinitions if u.name == "m")
            assert {d.name: d.factor for d in metre.displayUnits}["um"] == 1e6


@pytest.mark.parametrize("name", ["author", "version"])
@pytest.mark.parametrize("text", ["", " ", "two\nlines", "\x00", "\ud800", 3])
def test_text_that_xml_cannot_hold_is_refused(
    locomotive: cl.Model, tmp_path: Path, name: str, text: Any
) -> None:
    for export in (cl.export_fmu, cl.export_ssp):
        with pytest.raises(ValueError, match=f"^{name} = .* must be text in one line$"):
            export(locomotive, tmp_path / "x", **{name: text})


def test_default_experiment_of_a_vehicle_is_its_run(locomotive: cl.Model, tmp_path: Path) -> None:
    controls = {"a": OpenLoop(sample_time=0.01), "b": OpenLoop(sample_time=0.003)}
    scenario = braked_vehicle(locomotive.wheelset, 1)
    scenario = replace(scenario, duration=37.0, controllers=controls)
    path = cl.export_fmu(scenario, tmp_path / "x.fmu")
    found = fmpy.read_model_description(str(path)).defaultExperiment
    assert float(found.stopTime) == 37.0
    steps = np.array([0.01, 0.003]) / float(found.stepSize)
    np.testing.assert_allclose(steps, steps.round(), rtol=1e-9)


def test_a_reference_run_that_fails_leaves_an_older_file(
    locomotive: cl.Model, tmp_path: Path
) -> None:
    """From rails that hold any torque onto rails that hold none."""
    rails = cl.Track(friction_left=cl.Profile((0.01, 0.01), (1e3, 1e-6)))
    scenario = replace(braked_vehicle(with_memory(locomotive).wheelset, 2), track=rails)
    (tmp_path / "x.fmu").write_bytes(b"older")
    with pytest.raises(RuntimeError, match=r"^the reference run .* older file stays as it is$"):
        cl.export_fmu(scenario, tmp_path / "x.fmu")
    assert (tmp_path / "x.fmu").read_bytes() == b"older"
