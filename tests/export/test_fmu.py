"""The FMU as a tool sees it, through FMPy: both versions of the standard, both interfaces."""

from __future__ import annotations

import ctypes
import io
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from exported_fmu import described, exported, fitting
from fmpy.fmi1 import FMICallException
from fmu_instance import EXPORTS, Instance
from native_models import with_memory, with_shift

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.export.description import Description
from contactlib.export.package import longest_step, reference_run

VERSIONS = (2, 3)
BOOLEANS = (
    "falling_branch",
    "speed_regularized",
    "k_hat_limited",
    "force_limited",
    "length_limited",
    "unloaded",
)


def warns(tool: Instance, words: str) -> str:
    """Text of the one message of an FMU, a warning with these words."""
    ((category, text),) = tool.log
    assert category == "logStatusWarning"
    assert words in text
    return text


@pytest.fixture(scope="module")
def fmu(rig: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return cl.export_fmu(rig, tmp_path_factory.mktemp("fmu") / "CreepForceElement.fmu")


@pytest.fixture(scope="module", params=VERSIONS)
def unpacked(
    request: pytest.FixtureRequest, rig: cl.Model, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The force element in a folder whose URI must be encoded."""
    folder = tmp_path_factory.mktemp("unpacked") / "a folder, 100% \u00e4"
    folder.mkdir()
    return exported(rig, folder, version=request.param)


@pytest.fixture
def tool(unpacked: Path) -> Iterator[Instance]:
    with Instance(unpacked) as made:
        yield made


# ---- the file -----------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_fmu_holds_all_that_a_person_or_a_tool_looks_for(
    rig: cl.Model, tmp_path: Path, version: int
) -> None:
    path = cl.export_fmu(rig, tmp_path / "x.fmu", fmi_version=version)
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        assert archive.read("resources/creep_table.bin") == rig.wheelset.element.table.data
    always = {
        "documentation/licenses/license.txt",
        "documentation/README.txt",
        "documentation/reference_run.csv",
        "resources/creep_table.csv",
        f"sources/fmi{version}.c",
    }
    extras = {
        2: {"model.png", "binaries/linux64/CreepForceElement.so"},
        3: {"terminalsAndIcons/icon.png", "binaries/x86_64-linux/CreepForceElement.so"},
    }
    if kernel.platform_name() != "x86_64-linux":
        extras = {v: {n for n in files if "binaries" not in n} for v, files in extras.items()}
    assert always | extras[version] <= names
    assert f"sources/fmi{5 - version}.c" not in names


def test_fmus_that_differ_have_tokens_that_differ(rig: cl.Model, locomotive: cl.Model) -> None:
    # Else a tool takes the one for the other.
    descriptions = [
        Description(rig, "force_element"),
        Description(rig, "wheelset"),
        Description(rig, "force_element", implicit=True),
        Description(with_memory(rig), "force_element"),
        Description(locomotive, "force_element"),
    ]
    tokens = {d.token for d in descriptions}
    assert len(tokens) == len(descriptions)
    assert all(token.startswith(kernel.token()) for token in tokens)


# ---- values -------------------------------------------------------------------------------------


def test_outputs_at_initialisation_are_the_kernel_s(tool: Instance, rig: cl.Model) -> None:
    tool.initialize()
    tool.set(omega=20.2)
    record = replace(rig.wheelset.element, wheels=1).evaluate(omega=20.2, speed=10.0)
    names = [n for n in tool.references if n in (record.dtype.names or ())]
    reals = [n for n in names if n not in BOOLEANS]
    assert tool.get(*reals) == [float(record[n]) for n in reals]
    assert reals


def test_indicators_give_the_booleans(tool: Instance) -> None:
    tool.start()
    indicators = [
        f"{n}_indicator" for n in ("falling", "speed", "k_hat", "force", "length", "load")
    ]
    seen = set()
    usual = [(20.0, 10.0, 1e5), (20.5, 10.0, 1e5), (2.003, 1.0, 5e2)]
    for omega, speed, load in (*usual, (1, 0, 4.5), (1, 0, 0), (1, 0, -9)):
        tool.set(omega=omega, speed=speed, normal_load=load)
        flags = [bool(v) for v in tool.get(*BOOLEANS)]
        assert [z > 0.0 for z in tool.get(*indicators)] == flags
        seen |= set(enumerate(flags))
    assert len(seen) == 11  # each is both true and false, but the one of a contact with memory


@pytest.mark.parametrize("version", VERSIONS)
def test_truth_values_may_be_real_numbers(rig: cl.Model, tmp_path: Path, version: int) -> None:
    plain, typed = (
        exported(rig, tmp_path, version=version, booleans=booleans) for booleans in (False, True)
    )
    with Instance(plain) as real, Instance(typed) as boolean:
        assert real.booleans == set()
        assert boolean.booleans == {*BOOLEANS, "elliptic", "implicit", "parallel_exchange"}
        real.initialize().set(implicit=1.0)
        with real.refused():
            real.set(implicit=0.5)
        with real.refused():  # of the type that it has not
            real.fmu.getBoolean([real.references["unloaded"]])
        with boolean.refused():
            boolean.start()._get([boolean.references["unloaded"]])
        real.set(implicit=0.0)
        real.fmu.exitInitializationMode()
        for omega in (20.0, 20.5, -3.0):
            for each in (real, boolean):
                each.set(omega=omega, normal_load=1e3 * omega)
            assert real.get(*BOOLEANS) == boolean.get(*BOOLEANS)


def test_static_friction_below_the_kinetic_one_is_refused_and_forgotten(tool: Instance) -> None:
    tool.start()
    tool.set(omega=24.0)
    sliding = tool.get("creep_force")
    tool.set(static_friction=0.2)
    with tool.refused("static_friction = 0.2", "at least kinetic_friction = 0.21"):
        tool.get("creep_force")
    tool.set(static_friction=0.45)
    assert tool.get("creep_force") == sliding


def test_cohesive_table_holds_its_friction_ratio(
    cohesive_table: cl.CreepForceTable, tmp_path: Path
) -> None:
    model = cl.load_model("models/roller_rig.toml", table=cohesive_table)
    with Instance(exported(model, tmp_path)).start() as tool:
        tool.set(omega=20.2, static_friction=0.9)
        with tool.refused("must be 2.142857143"):
            tool.get("creep_force")
        tool.set(kinetic_friction=0.42)
        assert tool.get("creep_force")[0] > 0.0


# ---- derivatives --------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", EXPORTS)
def test_directional_derivatives_are_the_kernel_s(
    locomotive: cl.Model, tmp_path: Path, name: str, version: int
) -> None:
    options = {n: v for n, v in EXPORTS[name].items() if n != "implicit"}
    description = described(fitting(locomotive, name), **options)
    point = {"omega": 20.25, "drive_torque": 2e4, "held_force": 2e4, "unslipped": 0.6}
    point = {n: v for n, v in point.items() if n in description.start_values}
    start = {**description.start_values, **point}
    native = kernel.NativeModel(description.kind, description.native_contact, start)
    with pytest.raises(KeyError, match=r"2\]"):
        native.set(**{f"{next(iter(start))}[2]": 1.0})  # of a wheel that is not there
    unknowns = [
        v.name
        for v in description.of_role("output", "derivative", "indicator", "state")
        if not v.boolean
    ]
    knowns = [v.name for v in description.of_role(*kernel.GIVEN) if not v.boolean]
    rng = np.random.default_rng(4)
    seed = dict(zip(knowns, rng.normal(size=len(knowns)).tolist(), strict=True))
    states = {v.name for v in description.of_role("state")}
    expected = [seed[n] if n in states else native.tangent([n], seed)[0] for n in unknowns]
    if "implicit" in name:  # as both were made with, but the hint has no limit then
        expected[unknowns.index("step_size_hint")] = 0.0
    with Instance(exported(locomotive, tmp_path, name, version)).initialize() as tool:
        tool.set(**{n: v for n, v in point.items() if n in tool.references})
        derivatives = tool.derivative(unknowns, knowns, list(seed.values()))
        assert derivatives == expected
        for n, value in zip(unknowns, derivatives, strict=True):
            assert tool.derivative([n], knowns, list(seed.values())) == [value], n
        if version == 2:
            return
        weights = rng.normal(size=len(unknowns))
        # Second derivatives of the law are differences along the given direction.
        second = ("force_gradient", "step_size_hint", "falling_indicator")
        exact = np.array([n not in second for n in unknowns])
        for weight, tolerance in ((weights * exact, 1e-11), (weights, 1e-7)):
            adjoint = tool.derivative(unknowns, knowns, weight.tolist(), adjoint=True)
            size = np.abs(np.multiply(adjoint, list(seed.values()))).sum()
            difference = np.dot(adjoint, list(seed.values())) - np.dot(weight, derivatives)
            assert abs(difference) < tolerance * size


# ---- bad input ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value", "limit"),
    [
        ("normal_load", 2e12, "to 1e+12"),
        ("normal_load", np.nan, "from -1e+12 to"),
        ("omega", np.inf, "from -1e"),
        ("friction_scale", -0.1, "from -1e-06 to"),
        ("slope_reduction", 2e6, "to 1e+06"),
        ("radius", 0.6, "after initialization"),
        ("creep_force", 1.0, "it is calculated"),
        ("time", 1.0, "it is calculated"),
    ],
)
def test_bad_values_are_refused_and_forgotten(
    tool: Instance, name: str, value: float, limit: str
) -> None:
    # Discard means that the FMU is as it was before the call, whatever else was to be set.
    tool.start()
    before = tool.get("lateral_velocity", "creep_force")
    in_range = name not in ("radius", "creep_force", "time")
    with tool.refused(name, limit, f"{value:g}" if in_range else "", status=2 if in_range else 3):
        tool.set(lateral_velocity=0.2, **{name: value})
    assert tool.log[-1][0] == ("logStatusDiscard" if in_range else "logStatusError")
    tool.step(0.0, 1e-3)
    assert tool.get("lateral_velocity", "creep_force") == before


def test_discard_comes_only_where_fmi_2_has_it(tool: Instance) -> None:
    # In co-simulation that is for values that are set and for steps; FMI 3 has it everywhere.
    tool.initialize().set(static_friction=0.1)
    for call in (tool.fmu.exitInitializationMode, lambda: tool.get("creep_force")):
        with tool.refused(status=3 if tool.version == 2 else 2):
            call()
    tool.set(static_friction=0.45)
    tool.fmu.exitInitializationMode()
    tool.set(static_friction=0.1)
    with tool.refused(status=2):
        tool.step(0.0, 1e-3)


@pytest.mark.parametrize(
    ("point", "step", "message"),
    [
        (0.5, 1e-3, "communication point"),
        (0.0, 0.0, "step size"),
        (0.0, -1e-3, "step size"),
        (0.0, np.inf, "step size"),
        (np.nan, 1e-3, "step size"),
        (-1e-3, 1e-3, "communication point"),
        (0.0, 1.5, "stop time"),
    ],
)
def test_bad_steps_are_refused(tool: Instance, point: float, step: float, message: str) -> None:
    tool.initialize(stopTime=1.0).fmu.exitInitializationMode()
    with tool.refused(message):
        tool.step(point, step)
    tool.step(0.0, 1e-3)


@pytest.mark.parametrize("name", EXPORTS)
def test_single_precision_clock_is_followed_with_one_warning(
    locomotive: cl.Model, tmp_path: Path, name: str
) -> None:
    # Time and step sizes of some game engines are floats, added up or counted; far from zero such
    # a clock may even stand still. No model depends on time, so the bits are those of an exact
    # clock with the same steps.
    clocks = [(0.02, 0.0, False), (1 / 60, 3e3, True), (1e-3, 7e4, False)]
    folders = [exported(locomotive, tmp_path, name, version) for version in VERSIONS]
    for folder, (step, start, counts) in product(folders, clocks):
        float_step, time, end = np.float32(step), np.float32(start), start + 120 * step
        with Instance(folder) as game, Instance(folder) as exact:
            for tool in (game, exact):
                tool.initialize(start, stopTime=end).fmu.exitInitializationMode()
            for k in range(120):
                counted = np.float32(start) + np.float32(k) * float_step
                time = counted if counts or k == 0 else np.float32(time + float_step)
                game.step(float(time), float(float_step))
                assert game.get("time") == [float(time) + float(float_step)]
                exact.step(exact.get("time")[0], float(float_step))
            names = [n for n in game.references if n != "time"]
            assert game.get(*names) == exact.get(*names)
            assert "only in single precision" in warns(game, "communication point")
            assert not exact.log
            far = 0.6 * step + 2e-7 * end
            for wrong in (-far, far):
                with game.refused("communication point", status=3):
                    game.step(game.get("time")[0] + wrong, step)


@pytest.mark.parametrize("version", VERSIONS)
def test_step_that_cannot_be_done_is_discarded(rig: cl.Model, tmp_path: Path, version: int) -> None:
    # A wheel with memory swings almost undamped where it is held at rest: a minute of it gives the
    # mean and a warning. Beyond friction the wheel spins without limit, and nothing changes.
    folder = exported(rig, tmp_path, "wheelset-memory", version)
    with Instance(folder).start(speed=0.0, omega=0.0, damping=0.0) as tool:
        tool.set(drive_torque=1e4)
        tool.step(0.0, 60.0)
        warns(tool, "swings too often on its contact")
        omega, torque = tool.get("omega", "wheel_torque")
        assert abs(omega) < 1e-6
        assert torque == pytest.approx(-1e4, rel=1e-6)
    with Instance(folder).start(speed=0.0, omega=-1.5, damping=0.0, max_substeps=1.0) as tool:
        tool.set(drive_torque=1e4)
        tool.step(0.0, 0.1)
        warns(tool, "max_substeps = 1 is too small for a tolerance of 1e-06")
    with Instance(folder).start(speed=0.0, omega=-1.5, damping=0.0) as tool:
        tool.set(drive_torque=1e6)
        tool.step(0.0, 1e-3)
        before = tool.get("omega", "speed", "creep_force", "time")
        tool.set(drive_torque=1e12)
        with tool.refused("a state leaves its range", status=2):
            tool.step(1e-3, 1.0)
        tool.set(drive_torque=1e6)
        assert tool.get("omega", "speed", "creep_force", "time") == before
        tool.step(1e-3, 1e3)
        assert tool.get("omega") != before[:1]


def test_step_that_memory_allows_does_not_depend_on_speed(rig: cl.Model, tmp_path: Path) -> None:
    with Instance(exported(rig, tmp_path, "force_element-memory")).start() as tool:
        hints = []
        for speed in (0.0, 1e-3, 1.0):
            tool.set(speed=speed, omega=speed / rig.wheelset.radius)
            hints += tool.get("step_size_hint")
        gradient, inverse_mass = tool.get("force_gradient", "effective_inverse_mass")
    memory = rig.wheelset.element.memory_scales
    kappa = max(memory.standing_stiffness, 1.0)  # it may be less in rolling
    stiffness = kappa * gradient * inverse_mass * speed
    assert hints == pytest.approx([np.sqrt(memory.relaxation_length / stiffness)] * 3, rel=1e-6)


@pytest.mark.parametrize("version", VERSIONS)
def test_state_that_ran_off_by_too_long_steps_is_refused_with_the_step_that_holds(
    rig: cl.Model, tmp_path: Path, version: int
) -> None:
    folder = exported(rig, tmp_path, "force_element-memory", version)

    def run(step: float) -> list[tuple[str, str]]:
        with Instance(folder, exchange=True).start(omega=20.2) as tool:
            call, state, rate = tool.fmu, (ctypes.c_double * 5)(), (ctypes.c_double * 5)()
            event, rates = {
                2: ("newDiscreteStates", "getDerivatives"),
                3: ("updateDiscreteStates", "getContinuousStateDerivatives"),
            }[version]
            getattr(call, event)()
            call.enterContinuousTimeMode()
            with suppress(FMICallException):
                for _ in range(2000):
                    call.getContinuousStates(state, 5)
                    getattr(call, rates)(rate, 5)
                    for i in range(5):
                        state[i] += step * rate[i]
                    call.setContinuousStates(state, 5)
            return tool.log

    ((category, text),) = run(5e-3)
    assert category == "logStatusDiscard"
    match = re.search(r"steps are longer than ([\d.e-]+) s: take shorter", text)
    assert match
    assert run(0.98 * float(match[1])) == []


@pytest.mark.parametrize("version", VERSIONS)
def test_setters_set_states_in_continuous_time_mode_alone(
    locomotive: cl.Model, tmp_path: Path, version: int
) -> None:
    folder = exported(locomotive, tmp_path, "wheelset-memory", version)
    description = Description(with_memory(locomotive), "wheelset")
    names = [v.name for v in description.of_role("state")]
    read = [v.name for v in description.of_role("output", "derivative", "indicator")]
    state = (20.25, 10.0, 0.7, 2e4, 0.6, 5e3, 1e3, 1e2)[: len(names)]
    readings = []
    for by_name in (True, False):
        with Instance(folder, exchange=True).start(drive_torque=2e4) as tool:
            getattr(tool.fmu, {2: "newDiscreteStates", 3: "updateDiscreteStates"}[version])()
            tool.fmu.enterContinuousTimeMode()
            if by_name:
                tool.set(**dict(zip(names, state, strict=True)))
            else:
                tool.fmu.setContinuousStates((ctypes.c_double * len(state))(*state), len(state))
            assert tool.get(*names) == list(state)
            readings.append([value.hex() for value in tool.get(*read)])
    assert readings[0] == readings[1]
    for exchange in (True, False):  # event mode and co-simulation
        tool = Instance(folder, exchange=exchange).start()
        with tool, tool.refused("omega cannot be set after initialization", status=3):
            tool.set(omega=20.25)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"time": np.nan}, "start time = nan"),
        ({"time": 1.0, "stopTime": 0.5}, "stop time = 0.5"),
        ({"tolerance": -1.0}, "tolerance = -1"),
    ],
)
def test_bad_experiments_are_refused(
    tool: Instance, options: dict[str, float], message: str
) -> None:
    with tool.refused(message):
        tool.initialize(**options)


def test_calls_out_of_order_are_refused(tool: Instance) -> None:
    with tool.refused("DoStep is not allowed"):
        tool.step(0.0, 1e-3)
    tool.start()
    with tool.refused():
        tool.fmu.exitInitializationMode()
    tool.fmu.terminate()
    with tool.refused():
        tool.set(omega=1.0)
    assert len(tool.get("creep_force")) == 1  # what it came to may still be read


@pytest.mark.parametrize("debugging", [False, True])
def test_long_weakening_zone_is_a_warning(unpacked: Path, debugging: bool) -> None:
    with Instance(unpacked, logging=debugging).start(static_friction=0.3) as tool:
        category, text = tool.log[-1]
    assert category == "logStatusWarning"
    assert "above 0.5" in text


SLIP = {"force_element": {"omega": 20.2}, "wheelset": {"drive_torque": 1e3}}
SLIP |= {"force_element-implicit": SLIP["force_element"], "creep_forces": {"spin": 0.1}}
SLIP["vehicle"] = {"motor_torque": 1e3}  # whose load is no input


@pytest.mark.parametrize(
    ("name", "missing"),
    [*product(SLIP, ["friction_scale"]), *product([*SLIP][:-1], ["normal_load"])],
)
def test_a_wheel_that_slips_without_load_or_friction_is_reported_once(
    locomotive: cl.Model, tmp_path: Path, name: str, missing: str
) -> None:
    # As a tool gives them that sets inputs to zero which are not connected.
    inputs, force = SLIP[name], "force_y" if name == "creep_forces" else "creep_force"
    with Instance(exported(locomotive, tmp_path, name)).start(**{missing: 0.0}) as tool:
        tool.step(0.0, 1e-3)  # it rolls
        assert tool.log == []
        tool.set(**inputs)
        for i in range(1, 4):
            tool.step(1e-3 * i, 1e-3)
            assert tool.get(force) == [0.0]
        warns(tool, f"as {missing} = 0 since the start: is this input connected?")


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(  # a vehicle's axles lift off in test_vehicle_fmu.py
    "name", [n for n in EXPORTS if n not in ("wheelset_body", "vehicle")]
)
def test_wheel_lifts_off_and_comes_back(
    locomotive: cl.Model, tmp_path: Path, name: str, version: int
) -> None:
    pair = name == "creep_forces"
    force = "force_x" if pair else "creep_force"

    def under(load: float, friction: float = 1.0) -> dict[str, float]:
        grip = {"normal_load": load, "friction_scale": friction}
        if not pair:
            return grip | ({"omega": 20.2} if "force" in name else {})
        growth = np.cbrt(max(load, 0.0) / 1e5)  # Hertz
        return grip | {"semi_axis_x": 6e-3 * growth, "semi_axis_y": 5e-3 * growth}

    loads = [*1e5 * np.cos(0.2 * np.arange(60)), 1e-18, 0.0, 1e-6, 1e5]
    with Instance(exported(locomotive, tmp_path, name, version)).start() as tool:
        if pair:
            tool.set(creepage_x=-0.002)
        for i, load in enumerate(loads):
            tool.set(**under(load))
            tool.step(1e-3 * i, 1e-3)
            (value,) = tool.get(force)
            assert abs(value) <= max(load, 0.0)
            if not pair:
                assert tool.get("unloaded") == [load <= 0.0]
        assert value != 0.0
        for i, friction in enumerate((0.0, 1e-9, -1e-9, -1e-6)):  # a tool may probe at zero
            tool.set(**under(1e5, friction))
            tool.step(1e-3 * (len(loads) + i), 1e-3)
            assert tool.get(force) == [0.0]
        assert tool.log == []


@pytest.mark.parametrize("version", VERSIONS)
def test_axes_are_zero_only_without_load(
    locomotive: cl.Model, tmp_path: Path, version: int
) -> None:
    # A tool may set the axes before the load, so that they do not fit for a while.
    pair = cl.CreepForces.of(locomotive.wheelset.element)
    air = {"semi_axis_x": 0.0, "semi_axis_y": 0.0, "normal_load": 0.0}
    with Instance(exported(locomotive, tmp_path, "creep_forces", version)).start() as tool:
        tool.set(creepage_x=-0.002, semi_axis_x=6e-3, semi_axis_y=5e-3, normal_load=9e4)
        (before,) = tool.get("force_x")
        assert (
            before
            == pair.evaluate(
                semi_axis_x=6e-3, semi_axis_y=5e-3, normal_load=9e4, creepage_x=-0.002
            )["force_x"]
        )
        tool.set(semi_axis_x=0.0)
        tool.set(normal_load=0.0)
        assert tool.get("force_x", "utilisation") == [0.0, 0.0]
        tool.set(**air)
        unknowns, knowns = ["force_x", "force_y", "utilisation"], ["creepage_x", *air]
        assert tool.derivative(unknowns, knowns, [1.0] * 4) == [0.0] * 3
        for axis, given in product(("x", "y"), (0.0, 1e-10)):
            bad = air | {"semi_axis_x": 6e-3, "semi_axis_y": 6e-3, "normal_load": 5.0}
            bad[f"semi_axis_{axis}"] = given
            message = f"semi_axis_{axis} = {given:g} is out of range: must be at least 1e-09"
            tool.set(**bad)
            with tool.refused(message, "normal_load, here 5", status=2):
                tool.step(0.0, 1e-3)
            with pytest.raises(ValueError, match=f"^{message} where there is a normal_load, here"):
                pair.evaluate(**bad)


# ---- resources ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("spelling", "works"),
    [
        (lambda p: p.as_uri(), True),
        (lambda p: p.as_uri() + "/", True),
        (lambda p: "file:" + p.as_uri().removeprefix("file://"), True),
        (lambda p: p.as_uri().replace("file:///", "file://localhost/"), True),
        (lambda p: p.as_uri().replace("file:///", "file:////"), True),
        (lambda p: "file://" + str(p).replace("%", "%25"), True),  # not encoded, as many do it
        (lambda p: str(p), True),
        (lambda p: f"{p}/", True),
        (lambda p: p.as_uri().replace("file:///", "file://elsewhere/"), False),
        (lambda p: p.as_uri() + "%zz", False),
        (lambda p: p.parent.as_uri(), True),  # the FMU's folder in place of its resources
        (lambda p: str(p.parent) + "/", True),
        (lambda p: str(p / "nowhere"), False),
        (lambda p: None, False),
    ],
)
def test_resource_locations(
    unpacked: Path, spelling: Callable[[Path], str | None], works: bool
) -> None:
    tool = Instance(unpacked)
    location = spelling(unpacked / "resources")
    given = None if location is None else location.encode()
    tool.log.clear()
    name, token = b"x", tool.description.guid.encode()
    library, callback = tool.fmu, getattr(tool.fmu, "logMessage", None)
    if tool.version == 2:
        made = library.fmi2Instantiate(name, 1, token, given, tool.callbacks, 0, 0)
    else:
        made = library.fmi3InstantiateModelExchange(
            name, token, given, False, False, None, callback
        )
    assert bool(made) == works
    if made:
        (library.fmi2FreeInstance if tool.version == 2 else library.fmi3FreeInstance)(made)
    else:
        assert tool.message.startswith("resource creep_table.bin: ")
    tool.fmu.freeInstance()


def test_wrong_token_is_refused(unpacked: Path) -> None:
    guid = fmpy.read_model_description(str(unpacked)).guid
    for token in ("{other}", "", kernel.token(), f"{kernel.token()}-car-1", guid + 80 * "x"):
        log: list[tuple[str, str]] = []
        with pytest.raises(Exception, match="instantiate"):
            Instance(unpacked, token=token, log=log)
        assert kernel.token() in log[-1][1]


# ---- steps and states ---------------------------------------------------------------------------


@pytest.mark.parametrize(("step", "count"), [(0.1, 1000000), (0.01, 360000), (1e-5, 10000000)])
def test_summed_steps_may_pass_the_stop_time_by_their_rounding(
    tool: Instance, step: float, count: int
) -> None:
    stop = step * count
    time = float(np.cumsum(np.full(count - 1, step))[-1])  # one after the other, as tools do
    assert time + step > stop
    tool.initialize(time, stopTime=stop).fmu.exitInitializationMode()
    tool.step(time, step)
    with tool.refused("after the stop time"):
        tool.step(time + step, step)


def test_state_of_another_fmu_is_refused(
    rig: cl.Model, locomotive: cl.Model, tmp_path: Path
) -> None:
    first, other = (Instance(exported(model, tmp_path)).start() for model in (rig, locomotive))
    with first, other:
        saved = first.fmu.serializeFMUstate(first.fmu.getFMUState())
        first.fmu.deSerializeFMUstate(saved)
        with other.refused("belongs to another FMU"):
            other.fmu.deSerializeFMUstate(saved)
        with first.refused("checksum"):
            first.fmu.deSerializeFMUstate(saved[:-1] + bytes([saved[-1] ^ 1]))


def test_reset_gives_the_start_values_back(tool: Instance) -> None:
    tool.start()
    before = tool.get("omega", "creep_force")
    tool.set(omega=25.0)
    tool.fmu.terminate()
    tool.fmu.reset()
    assert tool.start().get("omega", "creep_force") == before


def test_instances_do_not_see_each_other(unpacked: Path, tool: Instance) -> None:
    before = tool.start().get("creep_force")
    with Instance(unpacked).start() as other:
        other.set(omega=22.0)
        assert tool.get("creep_force") == before
    assert tool.get("creep_force") == before


@pytest.mark.tools
@pytest.mark.skipif(
    shutil.which("gcc") is None or not kernel.platform_name().endswith("linux"),
    reason="needs gcc on Linux, where a tool may make the names of all libraries global",
)
def test_fmu_calls_its_own_functions_whatever_is_loaded(fmu: Path, tmp_path: Path) -> None:
    source, other = tmp_path / "other.c", tmp_path / "other.so"
    source.write_text('const char *creep_table_open(void) { return "of another release"; }\n')
    subprocess.run(["gcc", "-shared", "-fPIC", str(source), "-o", str(other)], check=True)
    script = (
        "import ctypes, sys, fmpy\n"
        "ctypes.CDLL(sys.argv[1], mode=ctypes.RTLD_GLOBAL)\n"
        "fmpy.simulate_fmu(sys.argv[2], stop_time=0.01)\n"
    )
    run = [sys.executable, "-c", script, str(other), str(fmu)]
    assert subprocess.run(run, check=False, capture_output=True).returncode == 0


# ---- in the loop --------------------------------------------------------------------------------


def coupled(
    tool: Instance,
    wheelset: cl.Wheelset,
    *,
    speed: float,
    step: float,
    parallel: bool,
    torques: Sequence[float] = (18e3, 29e3, 9e3),
    count: int = 300,
) -> FloatArray:
    """Step a wheelset and the force element of a wheel, one after the other or both at once.

    The torques follow each other, by default so that it slips away and comes back. Returns the
    angular velocities.
    """
    omegas = np.full(count + 1, speed / wheelset.radius)
    omega = float(omegas[0])
    (force,) = tool.get("creep_force")
    for i in range(count):
        torque = torques[len(torques) * i // count]
        before = force
        tool.set(omega=omega, speed=speed)
        tool.step(i * step, step)
        (force,) = tool.get("creep_force")
        applied = before if parallel else force  # of each wheel
        contact = kernel.ffi.new(
            "force_element_output *", {"creep_force": wheelset.element.wheels * applied}
        )
        rates = wheelset.native.motion(omega, speed, torque, 0.0, contact)
        omega, speed = omega + step * rates.omega_rate, speed + step * rates.speed_rate
        omegas[i + 1] = omega
    return omegas


@pytest.mark.parametrize(
    ("name", "parallel", "shift"),
    [
        ("force_element", False, 0.0),
        ("force_element", False, 1e-3),
        ("force_element", False, 4e-3),
        ("force_element", True, 0.0),
        ("force_element-memory", False, 0.0),
        ("force_element-memory", True, 0.0),
    ],
)
def test_a_force_that_swings_in_too_long_steps_is_reported_once(
    rig: cl.Model, tmp_path: Path, name: str, parallel: bool, shift: float
) -> None:
    model, speed = with_shift(rig, shift), 10.0
    limit = longest_step(
        Description(fitting(model, name), "force_element", parallel_exchange=parallel)
    )
    folder = exported(model, tmp_path, name, parallel_exchange=parallel)
    wheelset, rng = model.wheelset, np.random.default_rng(3)
    torque = 0.15 * wheelset.radius * wheelset.element.axle_load
    given: dict[str, Any] = {"speed": speed, "parallel": parallel, "torques": [torque]}
    rolling = {"omega": speed / wheelset.radius, "speed": speed}
    with Instance(folder).start(**rolling) as tool:
        for i in range(300):  # a replay
            tool.set(omega=rolling["omega"] * (1.0 + rng.choice([0.1, 0.002]) * rng.normal()))
            tool.step(3.0 * limit * i, 3.0 * limit)
        assert tool.log == []
    for wild in (1.0, 1e6):
        with Instance(folder).start(**rolling) as tool:
            coupled(tool, wheelset, step=0.4 * limit, **given)
            assert tool.log == []
            tool.fmu.terminate()
            tool.fmu.reset()
            tool.initialize(-3.0 * limit)
            tool.set(omega=wild * rolling["omega"], speed=speed)
            tool.fmu.exitInitializationMode()
            tool.step(-3.0 * limit, 3.0 * limit)
            coupled(tool, wheelset, step=3.0 * limit, **given)
            warns(tool, f"are longer than the largest stable one of {limit:.2g}"[:-1])


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("name", EXPORTS)
def test_reference_run_is_silent(
    locomotive: cl.Model, tmp_path: Path, name: str, parallel: bool
) -> None:
    mode = parallel and "force_element" in name
    model, options = fitting(locomotive, name), {**EXPORTS[name], "parallel_exchange": mode}
    csv = io.StringIO(reference_run(described(model, **options)).decode())
    rows: Any = np.genfromtxt(csv, delimiter=",", names=True, dtype=np.float64)
    folder = exported(locomotive, tmp_path, name, parallel_exchange=mode)
    with Instance(folder).start() as tool:
        inputs = [v.name for v in tool.description.modelVariables if v.causality == "input"]
        for row, following in pairwise(rows):
            tool.set(**{n: float(row[n]) for n in inputs})
            tool.step(float(row["time"]), float(following["time"] - row["time"]))
        assert tool.log == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fmi_version": 1}, "fmi_version = 1 must be 2 or 3"),
        ({"platforms": ["pdp11-unix"]}, "'pdp11-unix' must be one of: x86_64-linux"),
        ({"kind": "car"}, "kind = 'car' must be one of"),
        ({"implicit": True, "kind": "wheelset"}, "implicit = True needs"),
        ({"parallel_exchange": True, "kind": "wheelset"}, "parallel_exchange = True needs"),
    ],
)
def test_export_refuses_what_it_cannot_do(
    rig: cl.Model, tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    exports = (cl.export_fmu,) if "kind" in options else (cl.export_fmu, cl.export_ssp)
    for export in exports:
        with pytest.raises(ValueError, match=message):
            export(rig, tmp_path / "x", **options)
    assert not list(tmp_path.iterdir())


def test_kinds_of_model() -> None:
    with pytest.raises(ValueError, match=r"kind = 'bogie' must be one of: force_element"):
        kernel.model_variables("bogie")


@pytest.mark.parametrize("version", VERSIONS)
def test_an_ellipse_beyond_the_checked_range_is_reported_once(
    locomotive: cl.Model, tmp_path: Path, version: int
) -> None:
    with Instance(exported(locomotive, tmp_path, "creep_forces", version)).start() as tool:
        tool.get("force_x")
        assert tool.log == []
        tool.set(semi_axis_y=1e-4)
        for _ in range(2):
            tool.get("force_x")
            tool.set(semi_axis_x=1.1e-2)
        warns(tool, "semi_axis_x / semi_axis_y = ")


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    "fall",
    [{"slip_rate_residual": 0.4, "slip_rate_decay": 0.6}, {"softening_temperature": 500.0}],
    ids=["speed", "heat"],
)
def test_creep_forces_take_the_speed_where_friction_falls_with_it(
    locomotive: cl.Model, tmp_path: Path, version: int, fall: dict[str, Any]
) -> None:
    whole = locomotive.wheelset.element
    element = replace(whole, friction=replace(whole.friction, **fall))
    model = replace(locomotive, wheelset=replace(locomotive.wheelset, element=element))
    given = {"creepage_x": -0.03, "creepage_y": 0.01, "speed": 30.0}
    with Instance(exported(model, tmp_path, "creep_forces", version)).start(**given) as tool:
        sizes = {n: tool.get(n)[0] for n in ("semi_axis_x", "semi_axis_y", "normal_load")}
        expected = cl.CreepForces.of(element).evaluate(**sizes, **given)
        names = ["force_x", "force_y", "spin_moment"]
        known = [*names, "utilisation"]
        assert tool.get(*known) == [expected[name] for name in known]
        assert set(fall) <= set(tool.references)
        slopes = tool.derivative(names, ["speed"], [1.0])
        ends = []
        for speed in (30.01, 29.99):
            tool.set(speed=speed)
            ends.append(np.array(tool.get(*names)))
        np.testing.assert_allclose(slopes, (ends[0] - ends[1]) / 0.02, rtol=1e-5)
    with Instance(exported(locomotive, tmp_path, "creep_forces", version)) as tool:
        assert not {"speed", *fall} & set(tool.references)


def test_a_line_answers_for_no_other_contact(rig: cl.Model, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="need a contact that is an ellipse on the half-space"):
        cl.export_fmu(rig, tmp_path / "x.fmu", kind="creep_forces")
    description = Description(rig, "force_element")
    assert "spin_velocity" not in description.by_name
    assert "lateral_velocity" in description.by_name
