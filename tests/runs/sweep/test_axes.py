"""Parameters that the axes of a sweep reach, and mistakes in them."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import pytest
from sweep_files import HEAD, RANDOM, axis_values, scenarios_of, write_sweep

import contactlib as cl


def test_paths_reach_every_section(tmp_path: Path) -> None:
    def of(parameter: str, values: str) -> list[cl.Scenario]:
        return axis_values(tmp_path, f'parameter = "{parameter}"\nvalues = [{values}]')

    loads = of("vehicle.contact.wheel_load", '"180 kN", 220e3')
    assert [s.drivetrain.wheelset.element.contact.wheel_load for s in loads] == [180e3, 220e3]
    grades = of("vehicle.resistance.grade", '"1 %", 0.02')
    assert [s.drivetrain.wheelset.resistance.grade for s in grades] == [0.01, 0.02]
    assert [s.drivetrain.motor.lag for s in of("motor.lag", '"5 ms", 0.02')] == [0.005, 0.02]
    powers = of("motor.power", '"900 kW", 1e6')
    assert [s.drivetrain.motor.power for s in powers] == [9e5, 1e6]
    assert [s.demand.value for s in of("demand.torque[1]", '"9 kN.m"')] == [(10e3, 9e3)]
    assert [s.sensors.seed for s in of("sensors.seed", "3, 4")] == [3.0, 4.0]
    assert [s.duration for s in of("run.duration", "0.5, 1.0")] == [0.5, 1.0]
    references = of("controllers.creep_pi.reference", '"1 %", 0.02')
    assert [s.controller("creep_pi").reference for s in references] == [0.01, 0.02]  # type: ignore[union-attr]


def test_one_axis_sets_several_parameters(tmp_path: Path) -> None:
    patch = 'parameter = ["track.friction[1]", "track.friction[2]"]\nvalues = [0.4]'
    (scenario,) = axis_values(tmp_path, patch)
    assert scenario.track.friction_left.value == (1.0, 0.4, 0.4, 1.0)


def test_a_factor_multiplies_what_the_file_has(tmp_path: Path) -> None:
    half, all_of_it = axis_values(tmp_path, 'factor_on = "demand.torque"\nvalues = [0.5, 1.0]')
    assert half.demand.value == (5e3, 11.5e3)
    assert all_of_it.demand.value == (10e3, 23e3)
    (inertia,) = axis_values(tmp_path, 'factor_on = "vehicle.wheelset.inertia"\nvalues = [0.5]')
    assert inertia.drivetrain.wheelset.inertia == 185.0  # half of 130, and the rotor
    designed = cl.load_sweep(write_sweep(tmp_path)).scenario.controller("creep_pi")
    axis = 'factor_on = "controllers.creep_pi.proportional_gain"\nvalues = [2.0]'
    (changed,) = axis_values(tmp_path, axis)
    gain = changed.controller("creep_pi").proportional_gain  # type: ignore[union-attr]
    assert gain == 2.0 * designed.proportional_gain  # type: ignore[union-attr]


def test_controllers_do_not_know_what_varies_unless_redesigned(tmp_path: Path) -> None:
    axis = '[axes.x]\nparameter = "vehicle.wheelset.inertia"\nvalues = [65.0, 130.0]\n'
    once = scenarios_of(cl.load_sweep(write_sweep(tmp_path, HEAD + axis)))
    anew = scenarios_of(cl.load_sweep(write_sweep(tmp_path, "redesign = true\n" + HEAD + axis)))
    (a, b), (c, d) = (
        [s.controller("creep_pi").proportional_gain for s in scenarios]  # type: ignore[union-attr]
        for scenarios in (once, anew)
    )
    assert a == b == d
    assert c != d


CASES = {
    'parameter = "vehicle.wheelset.inertai"\nvalues = [1.0]': "did you mean 'inertia'",
    'parameter = "wheelset.inertia"\nvalues = [1.0]': "'wheelset' is not known",
    'parameter = "inertia"\nvalues = [1.0]': "not a path such as",
    'parameter = "track.friction[\u0661]"\nvalues = [1.0]': "not a path such as",
    'parameter = "vehicle.law.kind"\nvalues = [1.0]': "'kind' is not known",
    'parameter = "demand.torque"\nvalues = [1.0]': "is a list of 2",
    'parameter = "demand.torque[2]"\nvalues = [1.0]': "only 2 entries",
    'parameter = "motor.lag[0]"\nvalues = [1.0]': "a number, not a list",
    'parameter = "track.time[0]"\nvalues = [1.0]': "no list of this name",
    'factor_on = "motor.lag"\nvalues = [1.0]': "does not give the number",
    'parameter = "controllers.pi.reference"\nvalues = [1.0]': "'pi' is not known",
    'parameter = "controllers.threshold.sample_time"\nvalues = [0.1]': "does not run",
    'factor_on = "vehicle.wheelset.inertia"\nvalues = [-1.0]': "-1.0 times 130.0 is out of range",
    'parameter = "vehicle.wheelset.inertia"\nvalues = ["1 kN"]': "number in kg.m2",
    'parameter = "vehicle.wheelset.inertia"\nvalues = [0.0]': "inertia = 0.0 is out of range",
    'parameter = "vehicle.wheelset.inertia"\nvalues = [2.0, 2.0]': "a number twice",
    'parameter = "vehicle.wheelset.inertia"\nfrom = 1.0\nto = 2.0\ncount = 0': "count = 0",
    'parameter = "vehicle.wheelset.inertia"\nfrom = 1.0\nto = 1.0\ncount = 2': "would be the same",
    'parameter = "motor.lag"\nfrom = 0.0\nto = 1.0\ncount = 2\nspacing = "log"': "above zero",
    'parameter = "motor.lag"\nfrom = 0.0\nto = 1.0\ncuont = 2': "did you mean 'count'",
    'paramter = "motor.lag"\nvalues = [1.0]': "did you mean 'parameter'",
    'parameter = "motor.lag"\ndistribution = "uniform"\nfrom = 0.0\nto = 1.0': (
        "distribution on a grid needs sampling.runs"
    ),
    'parameter = "wheelset_changes.wheelset.inertia"\nvalues = [1.0]': (
        "use vehicle.wheelset.inertia"
    ),
    'parameter = ["motor.lag", "run.initial_speed"]\nvalues = [1.0]': "different units",
    'parameter = "motor.lag"\nfactor_on = "motor.lag"\nvalues = [1.0]': "exactly one of them",
    'parameter = "vehicle.friction.weakening_length"\nvalues = [1e-6]': "exactly one of them",
    'parameter = "vehicle.friction.kinetic"\nvalues = [0.46]': "kinetic",
    'parameter = "vehicle.law.slip_reduction"\nvalues = [0.5]': "accepts no other key",
}


ANY = {  # of a random sample
    'distribution = "normal"\nmean = 1.0': "standard_deviation is missing",
    'distribution = "normal"\nmean = 1.0\nstandard_deviation = 9.0': "is out of range",
    'distribution = "log_uniform"\nfrom = 0.0\nto = 2.0': "must be > 0",
    'distribution = "whole"\nfrom = 0.5\nto = 2.0': "must be whole numbers",
    "from = 3.0\nto = 2.0": "must be < to",
    "from = 1.0\nto = 2.0\nmean = 1.0": "mean is for a normal distribution, not for 'uniform'",
    "from = 1.0\nto = 2.0\ncount = 3": "count is for a grid, and this axis is of random",
}


@pytest.mark.parametrize(("kind", "axis"), [*product(["grid"], CASES), *product(["random"], ANY)])
def test_a_wrong_axis_is_one_line_that_names_it(tmp_path: Path, kind: str, axis: str) -> None:
    text = HEAD
    if kind == "random":
        text += RANDOM.format("monte_carlo", 50, 1)
        axis, expected = f'parameter = "vehicle.wheelset.inertia"\n{axis}', ANY[axis]
    else:
        expected = CASES[axis]
    path = write_sweep(tmp_path, f"{text}[axes.x]\n{axis}\n")
    with pytest.raises(cl.ModelError) as caught:
        cl.load_sweep(path)
    message = str(caught.value)
    assert expected in message
    assert message.startswith(f"{path}: ")
    assert re.search(r"axes\.x: |run \d+ \(x = ", message)
    assert "\n" not in message
