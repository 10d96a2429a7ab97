"""What each feature does in each use: the cells of the guide's page on what works together.

A feature is a change of a vehicle or of a scenario, a use a way to use it. It checks the
feature by a second way and raises AssertionError if the two differ by more than its statement
allows. A ValueError is a refusal, a SteadyRollingWarning the remark that the answer is one of
steady rolling.
"""

from __future__ import annotations

import itertools
import json
import math
import tomllib
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest
from brake_pads import held_by
from explorer_page import ExplorerPage
from exported_fmu import exported
from fmu_instance import Instance
from one_file_kernel import Library, compiler, compiler_flags
from scipy.integrate import solve_ivp

import contactlib as cl
from contactlib import figures, kernel, stability
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.base.writing import package_folder
from contactlib.element.force_element import RangeWarning
from contactlib.laws.formula import formula_laws

Changes = Mapping[str, Mapping[str, Any]]


# ---- features -----------------------------------------------------------------------------------


class Feature(NamedTuple):
    """What is added to a plain scenario."""

    changes: Changes = MappingProxyType({})  # of the vehicle's sections
    sections: Changes = MappingProxyType({})  # of the scenario
    vehicle: str = "locomotive.toml"
    lateral: bool = False  # lateral slip and spin are inputs, not keys


CURVE = "creepage,traction_coefficient\n" + "\n".join(
    f"{slip},{mu}"
    for slip, mu in zip(
        (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3),
        (0.1, 0.2, 0.28, 0.3, 0.26, 0.22, 0.2),
        strict=True,
    )
)
OF_VEHICLE: dict[str, Feature] = {
    "layer": Feature({"wheelset": {"layer_compliance": 1e-13, "saturation_creepage": None}}),
    "memory": Feature({"contact": {"memory": True}}),
    "heat": Feature({"friction": {"softening_temperature": 700.0}}),
    "slip-rate fall": Feature({"friction": {"slip_rate_residual": 0.857, "slip_rate_decay": 0.6}}),
    "measured curve": Feature({"law": {"kind": "measured", "file": "curve.csv"}}),
    "cohesive law": Feature({"law": {"kind": "cohesive"}}, vehicle="roller_rig.toml"),
    **{
        f"{kind} law": Feature({"law": {"kind": kind, **law.example}})
        for kind, law in formula_laws().items()
    },
    "lateral slip and spin": Feature(lateral=True),
    "several wheels": Feature({"wheelset": {"wheels": 4}}),
}
OF_SCENARIO: dict[str, Feature] = {
    "elastic axle": Feature(
        sections={"axle": {"stiffness": 6.17e6, "damping": 391.0, "drive_share": 0.8}}
    ),
    "shaft": Feature(
        sections={
            "motor": {"rotor_inertia": 7.5, "gear_ratio": 4.0, "shaft_stiffness": 1.5e6},
        }
    ),
    "brake": Feature(sections={"brake": {"delay": 0.04, "fill_time": 0.25, "vent_time": 0.12}}),
    "friction of brake pads": Feature(
        sections={
            "brake": {
                "delay": 0.04,
                "fill_time": 0.25,
                "vent_time": 0.12,
                "pads": "pads.csv",
                "pad_scale": 0.9,
            }
        }
    ),
    "sanding": Feature(sections={"sanding": {"friction": 1.5, "slope": 0.8}}),
    "map": Feature(sections={"track": {"map": "map.csv", "start": 1000.0}}),
    "largest traction coefficients": Feature(
        sections={
            "track": {"distance": [0.0, 2.0, 3.0], "friction": [0.2, 0.2, 0.1], "unit": "adhesion"}
        }
    ),
    "cleaning": Feature(
        sections={
            "track": {
                "distance": [0.0, 2.0, 2.0],
                "friction": [0.6, 0.6, 0.5],
                "unit": "factor",
                "cleaning": 1e-4,
            }
        }
    ),
    "variation": Feature(
        sections={"track.variation": {"standard_deviation": 0.1, "correlation_length": 2.0}}
    ),
}
FEATURES = {"nothing else": Feature(), **OF_VEHICLE, **OF_SCENARIO}
PADS = "speed [km/h],friction\n0,1.3\n36,1.0\n100,0.6\n"
MAP = "distance,friction\n1000,1.0\n1001,0.6\n1003,0.8\n"


def merged(first: Changes, second: Changes) -> dict[str, dict[str, Any]]:
    return {name: {**first.get(name, {}), **second.get(name, {})} for name in [*first, *second]}


def together(first: Feature, second: Feature) -> Feature:
    """Both features in one vehicle."""
    return Feature(
        merged(first.changes, second.changes),
        merged(first.sections, second.sections),
        max(first.vehicle, second.vehicle),  # the rig's, which has a coarse cohesive table
        first.lateral or second.lateral,
    )


class Case:
    """A feature in files of its own, and what is read from them."""

    def __init__(self, feature: Feature, folder: Path) -> None:
        self.feature, self.folder = feature, folder
        (folder / "curve.csv").write_text(CURVE)
        (folder / "map.csv").write_text(MAP)
        (folder / "pads.csv").write_text(PADS)
        vehicle = tomllib.loads((package_folder("models") / feature.vehicle).read_text())
        if "law" in feature.changes and feature.changes["law"]["kind"] == "measured":
            del vehicle["friction"], vehicle["wheelset"]["saturation_creepage"]
        self.vehicle = {
            **vehicle,
            **merged({k: v for k, v in vehicle.items() if isinstance(v, dict)}, feature.changes),
        }
        self.write("vehicle.toml", self.vehicle)
        self.write_scenario("scenario.toml")

    def write(self, name: str, data: Mapping[str, Any]) -> Path:
        data = {key: value for key, value in data.items() if value is not None}
        lines = [f"{k} = {json.dumps(v)}" for k, v in data.items() if not isinstance(v, dict)]
        for section, keys in data.items():
            if isinstance(keys, dict):
                given = {k: v for k, v in keys.items() if v is not None}
                lines += [f"[{section}]", *(f"{k} = {json.dumps(v)}" for k, v in given.items())]
        path = self.folder / name
        path.write_text("\n".join(lines) + "\n")
        return path

    def write_scenario(
        self, name: str, sections: Mapping[str, Any] | None = None, **changes: Mapping[str, Any]
    ) -> Path:
        """A second at 10 m/s, whose torque rises at once after 0.2 s."""
        sign = -0.5 if "brake" in self.feature.sections else 1.0
        speed = {"held_speed": {"time": [0.0], "speed": [10.0]}, "run": {"duration": 1.0}}
        if "mass" in self.vehicle["wheelset"]:
            speed = {"run": {"duration": 1.0, "initial_speed": 10.0}}
        contents: dict[str, Any] = {
            "name": "a feature",
            "source": "a test",
            "wheelset": "vehicle.toml",
            **speed,
            "demand": {"time": [0.2, 0.2], "torque": [sign * 6e3, sign * 16e3]},
            "controllers.open_loop": {"kind": "open_loop"},
            **self.feature.sections,
            **(sections or {}),
            **{f"wheelset_changes.{section}": keys for section, keys in changes.items()},
        }
        return self.write(name, contents)

    def without_folder(self, message: object) -> str:
        return str(message).replace(f"{self.folder}/", "")

    @cached_property
    def model(self) -> cl.Model:
        return cl.load_model(self.folder / "vehicle.toml")

    @cached_property
    def scenario(self) -> cl.Scenario:
        return cl.load_scenario(self.folder / "scenario.toml")

    @property
    def wheelset(self) -> cl.Wheelset:
        return self.model.wheelset

    @property
    def element(self) -> cl.ForceElement:
        return self.wheelset.element

    @property
    def wheel(self) -> cl.ForceElement:
        """One of the element's wheels: that of an FMU of a force element and of the kernel file."""
        return replace(self.element, wheels=1)

    def wheel_inputs(self, count: int) -> Any:
        return self.inputs(count, self.wheel)

    def inputs(self, count: int, element: cl.ForceElement | None = None) -> Any:
        """Random states and inputs of the contact, with those of its memory."""
        rng, element = np.random.default_rng(41), element or self.element
        given = np.zeros(count, kernel.struct_dtype("force_element_input"))
        given["speed"] = 10.0 ** rng.uniform(0.0, 1.7, count)
        creepage = rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-4.0, -0.6, count)
        given["omega"] = (1.0 + creepage) * given["speed"] / element.radius
        given["normal_load"] = element.axle_load * rng.uniform(0.3, 1.7, count)
        given["friction_scale"] = rng.uniform(0.4, 1.2, count)
        if self.feature.lateral:
            given["lateral_velocity"] = rng.uniform(-0.01, 0.01, count) * given["speed"]
            given["spin_velocity"] = rng.uniform(-0.3, 0.3, count) * given["speed"]
        if element.memory:
            friction = element.friction.static * given["friction_scale"] * given["normal_load"]
            for name in ("held_force", "outer_force"):
                given[name] = rng.uniform(-0.15, 0.15, count) * friction
            if self.feature.lateral:
                for name in ("held_lateral", "outer_lateral"):
                    given[name] = rng.uniform(-0.15, 0.15, count) * friction
            given["unslipped"] = rng.uniform(0.2, 0.9, count)
        return given


def same(first: Any, second: Any, tolerance: float, scale: float = 0.0) -> None:
    np.testing.assert_allclose(first, second, rtol=tolerance, atol=tolerance * scale)


RECORD = kernel.struct_dtype("force_element_output").names or ()


def outputs_of(variables: Iterable[Any]) -> list[str]:
    """Outputs that are in the kernel's record; Booleans change in events only."""
    numbers = [v.name for v in variables if v.causality == "output" and v.type != "Boolean"]
    return [name for name in numbers if name in RECORD]


# ---- uses --------------------------------------------------------------------------------------


def in_python(case: Case) -> None:
    """A batch is its points one by one; derivatives are differences; friction bounds the force."""
    element, given = case.element, case.inputs(40)
    native = element.rolling_native
    together = native.evaluate(given)
    single = np.concatenate([native.evaluate(given[i : i + 1]) for i in range(given.size)])
    bound = given["friction_scale"] * given["normal_load"]
    for name in together.dtype.names or ():
        same(together[name], single[name], 1e-12, float(np.abs(single[name]).max()))
    for name, of in (("omega", "force_by_omega"), ("speed", "force_by_speed")):
        size, moved = 1e-6 * np.abs(given[name]), [given.copy(), given.copy()]
        for sign, there in zip((-1.0, 1.0), moved, strict=True):
            there[name] += sign * size
        low, high = (native.evaluate(there)["creep_force"] for there in moved)
        same(
            0.5 * (high - low) / size, together[of], 1e-4, 1e-3 * float(np.abs(together[of]).max())
        )
    if not element.table.points:
        force = np.hypot(together["creep_force"], together["lateral_force"])
        assert (force <= element.friction.static * bound * (1.0 + 1e-12)).all()
    else:
        points = element.table.points
        force = element.at_creepage(points.creepage, speed=10.0)["traction_coefficient"]
        same(force, points.traction_coefficient, 0.03)


def braked_run(case: Case) -> None:
    """Under the torque that the brake has in a run, a wheelset's FMU moves as in the run."""
    run = cl.run_scenario(case.scenario, "open_loop", step=1e-3)
    folder, start = exported(case.model, case.folder, "wheelset", 3), {"omega": run["omega"][0]}
    with Instance(folder).start(**start) as tool:
        for time, ends in zip(run.time, itertools.pairwise(-run["drive_torque"]), strict=False):
            tool.set(brake_torque=float(np.mean(ends)))
            tool.step(float(time), 1e-3)
        same(tool.get("omega", "speed"), [run[name][-1] for name in ("omega", "speed")], 1e-6)


def fmu_step(case: Case) -> None:
    """Steps at constant inputs end at the outputs of Python in steady rolling."""
    if "brake" in case.feature.sections:
        braked_run(case)
        return
    folder, rows = exported(case.model, case.folder, "force_element", 3), case.wheel_inputs(4)
    with Instance(folder) as tool:
        variables = tool.description.modelVariables
        names = outputs_of(variables)
        tool.start()
        for i, row in enumerate(rows):
            tool.set(**{v.name: float(row[v.name]) for v in variables if v.causality == "input"})
            for k in range(20):
                tool.step(i + 0.05 * k, 0.05)
            steady = case.wheel.native.evaluate(rows[i : i + 1])
            same(tool.get(*names), [steady[name].item() for name in names], 1e-6, 1e-6)


def fmu_exchange(case: Case) -> None:
    """Outputs and rates at random states are those of Python."""
    folder, rows = exported(case.model, case.folder, "wheelset", 3), case.inputs(5)
    expected = case.element.rolling_native.evaluate(rows)
    with Instance(folder, exchange=True) as tool:
        variables = tool.description.modelVariables
        names = outputs_of(variables)
        given = [n for n in tool.references if n in (rows.dtype.names or ())]
        tool.start()
        tool.fmu.updateDiscreteStates()
        tool.fmu.enterContinuousTimeMode()
        for row, contact in zip(rows, expected, strict=True):
            rim = case.wheelset.radius * row["omega"]
            part, carried = held_by(0.3, rim)
            torque = {"drive_torque": 7e3, "brake_torque": 2e3, "pads": 0.3}
            tool.set(**{name: float(row[name]) for name in given}, **torque)
            values = [float(contact[name]) for name in names]
            same(tool.get(*names), values, 1e-11, max(map(abs, values)))
            motion = case.wheelset.native.motion(
                row["omega"],
                row["speed"],
                7e3 - 2e3 * part,
                0.0,
                kernel.ffi.new("force_element_output *", {"creep_force": contact["creep_force"]}),
            )
            same(tool.get("der(omega)", "der(pads)"), [motion.omega_rate, carried], 1e-10)
            if case.element.memory:
                rates = ("held_rate", "unslipped_rate", "outer_rate")
                rated = tool.get("der(held_force)", "der(unslipped)", "der(outer_force)")
                same(rated, [float(contact[name]) for name in rates], 1e-9)


def kernel_file(case: Case) -> None:
    """The compiled file's outputs are those of Python."""
    library = Library(
        cl.export_kernel(case.model, case.folder / "kernel"),
        *compiler("gcc"),
        *compiler_flags(),
        "-O0",
    )
    rows = case.wheel_inputs(40)
    expected = case.wheel.rolling_native.evaluate(rows)
    fields = [name for name, _ in library.ffi.typeof("contactlib_output").fields]
    names = [name for name in fields if name in RECORD and expected[name].ndim == 1]
    for row, contact in zip(rows, expected, strict=True):
        library.set(**{name: float(row[name]) for name in rows.dtype.names})
        assert library.force() == ""
        same(library.get(*names), [float(contact[name]) for name in names], 1e-12)


def runs(case: Case) -> None:
    """SciPy integrates the equations to the same end; of other vehicles the energy closes."""
    run = cl.run_scenario(case.scenario, "open_loop", tolerance=1e-9)
    stored = np.full(run.time.shape, run["stored_energy"][0])
    work = np.abs(run["drive_work"]).max() + np.abs(run["creep_work"]).max()
    defect = cl.runs.signals.energy_defect(run, stored)
    assert np.abs(defect).max() < 1e-6 * max(work, float(stored.max()) * 1e-3)
    if case.feature.sections:
        finer = cl.run_scenario(case.scenario, "open_loop", tolerance=1e-9, step=1e-3)
        same(finer["omega"][-1], run["omega"][-1], 1e-3)
        return
    wheelset, element = case.wheelset, case.element
    names = ["omega", *([] if wheelset.speed_held else ["speed"])]
    held = ("held_force", "unslipped", "outer_force") if element.memory else ()
    rates = ("held_rate", "unslipped_rate", "outer_rate")
    torque = case.scenario.demand.value

    def rate(_: float, x: Any, demand: float) -> list[float]:
        speed = 10.0 if wheelset.speed_held else x[1]
        contact = element.rolling_native.evaluate_one(
            x[0], speed, element.axle_load, 1.0, *x[len(names) :]
        )
        moved = wheelset.native.motion(x[0], speed, demand, 0.0, contact)
        moving = [moved.omega_rate, moved.speed_rate][: len(names)]
        return [*moving, *(getattr(contact, name) for name in rates[: len(held)])]

    state: Any = [run["omega"][0], *([run["speed"][0]] if len(names) > 1 else [])]
    if held:
        start = element.rolling_native.evaluate_one(state[0], 10.0, element.axle_load, 1.0)
        state += [start.steady_force, start.sticking, start.steady_outer]
    for span, demand in (((0.0, 0.2), torque[0]), ((0.2, 1.0), torque[1])):
        found = solve_ivp(rate, span, state, "Radau", args=(demand,), rtol=1e-8, atol=1e-9)
        state = found.y[:, -1]
    same(state[0], run["omega"][-1], 1e-6)


def vehicle(case: Case) -> None:
    """Equal axles under constant loads run as the wheelset by itself; the energy closes."""
    own = case.wheelset.element.axle_load / STANDARD_GRAVITY
    heights = dict.fromkeys(("body_height", "bogie_height", "pivot_height", "coupler_height"), 0.0)
    axles = {
        "position": [0.0, 3.0, 9.9, 12.9],
        "body_mass": 4.0 * own,
        "bogie_mass": 0.0,
        "wheelset_mass": 0.0,
        "train_mass": 12.0 * own,
        **heights,
    }
    rolling = {"held_speed": None, "run": {"duration": 1.0, "initial_speed": 10.0}}
    file = case.write_scenario("axles.toml", {"vehicle": axles, **rolling})
    scenario = cl.load_scenario(file)
    run = cl.run_scenario(scenario, "open_loop", tolerance=1e-9)
    work = np.abs(run.total("drive_work")).max() + np.abs(run.total("creep_work")).max()
    assert np.abs(run.total("energy_defect")).max() < 1e-8 * work
    if any(
        name.startswith("track") for name in case.feature.sections
    ):  # axles that come one after the other
        for axle in run.by_axle:
            if scenario.track.unit == "adhesion":
                number = scenario.track.friction_left(axle["distance"])
                same(axle["available_force"] / axle["axle_load"], number, 0.01)
                continue
            there = scenario.rails.friction_scale(axle["distance"], 0.0)[:, 0]
            clean = scenario.rails.recovered if scenario.rails.cleaning else 0.0
            scale = axle["friction_scale_left"]
            same(np.clip(scale, there, np.maximum(there, clean)), scale, 1e-12)
        return
    alone = cl.run_scenario(replace(scenario, vehicle=None), "open_loop", tolerance=1e-9)
    for axle in run.by_axle:
        same(axle["creep_force"], alone["creep_force"], 1e-8, np.abs(alone["creep_force"]).max())


def sweeps(case: Case) -> None:
    """A sweep's numbers are those of a run of each file, to the last bit."""
    inertias = [220.0, 270.0]
    sweep = {
        "name": "two",
        "source": "a test",
        "scenario": "scenario.toml",
        "controllers": ["open_loop"],
        "outcomes": ["slip_work"],
        "axes.inertia": {"parameter": "vehicle.wheelset.inertia", "values": inertias},
    }
    swept = cl.ensemble(case.write("two.toml", sweep))["slip_work"].values.ravel()
    files = [
        case.write_scenario(f"{k}.toml", wheelset={"inertia": inertia})
        for k, inertia in enumerate(inertias)
    ]
    single = cl.run_many([cl.load_scenario(f) for f in files], "open_loop", ["slip_work"])
    np.testing.assert_array_equal(swept, single["slip_work"])


def steady_states(case: Case) -> None:
    """Nothing moves at the steady states of 0.8 of the fold's torque, on both branches."""
    wheelset, element = case.wheelset, case.element
    fold = cl.find_fold(wheelset, speed=10.0)
    curve = cl.s_curve(wheelset, speed=10.0)
    before = curve.drive_torque[curve.creepage <= fold.return_creepage]
    assert fold.drive_torque <= before.max() <= fold.drive_torque * (1.0 + 1e-12)
    speed = {"speed": 10.0} if wheelset.speed_held else {}
    found = wheelset.equilibria(drive_torque=0.8 * fold.drive_torque, **speed)
    assert found
    for at in found:
        rolling = at.omega, at.speed, element.axle_load, 1.0
        contact = element.rolling_native.evaluate_one(*rolling)
        if element.memory:
            held = contact.steady_force, contact.sticking, contact.steady_outer
            contact = element.rolling_native.evaluate_one(*rolling, *held)
            assert abs(contact.held_rate) < 1e-9 * abs(contact.steady_force) * at.speed / 1e-3
        moved = wheelset.native.motion(at.omega, at.speed, at.drive_torque, 0.0, contact)
        assert abs(moved.omega_rate) < 1e-8 * at.drive_torque / wheelset.inertia
        assert abs(moved.speed_rate) < 1e-8 * at.drive_torque


def poles(case: Case) -> None:
    """A slip-away of a simulation grows with the largest pole; none is where no force falls."""
    train = case.scenario.drivetrain
    if train.motor.rotor_inertia is not None:
        point = train.without_rotor.balanced(creepage=0.05, speed=10.0)
        pole, motor = stability.torsion.shaft_pole(train, point), train.motor
        by_torque = train.without_rotor.linearize(point)(pole)[0, 0]
        compliance = by_torque + 1.0 / (motor.inertia_at_axle * pole)
        same(-pole, motor.shaft_stiffness * compliance, 1e-9)
        return
    if train.axle is not None:
        point = train.wheelset.balanced(creepage=0.05, speed=10.0)
        matrix = stability.torsion.torsional_jacobian(train, point)
        closed, eigenvalues = (
            stability.torsion.antiphase_eigenvalues(train, point),
            np.linalg.eigvals(matrix),
        )
        for value in closed:
            assert np.abs(eigenvalues - value).min() < 1e-9 * abs(value)
        return
    wheelset, speed = case.wheelset, 3.0
    worst = cl.worst_pole(wheelset, speed=speed)
    if worst.pole <= 0.0:
        for creepage in np.geomspace(1e-4, 1.0, 30).tolist():
            rolls = wheelset.balanced(creepage=creepage, speed=speed)
            assert wheelset.linearize(rolls).poles().real.max() <= 0.0
        return
    point = wheelset.balanced(creepage=worst.creepage, speed=speed)
    same(wheelset.linearize(point).poles().real.max(), worst.pole, 1e-6)
    run = cl.simulate(
        wheelset,
        cl.TorqueControl(cl.Profile.of(point.drive_torque)),
        resistance_force=point.resistance_force,
        initial_speed=speed,
        initial_creepage=worst.creepage * (1.0 + 1e-7),
        duration=6.0 / worst.pole,
        tolerance=1e-11,
    )
    late = run.time > 4.0 / worst.pole
    away = np.log(np.abs(run["omega"] - point.omega)[late])
    same(np.polyfit(run.time[late], away, 1)[0], worst.pole, 5e-3)


def slip_away(case: Case) -> float | None:
    """The time of a slip-away at a held speed is that of a simulation.

    Returns the relative difference if it is one of steady rolling.
    """
    wheelset = replace(case.wheelset, mass=None)
    fold = cl.find_fold(wheelset, speed=3.0)
    torque, begin, end = 1.02 * fold.drive_torque, 0.5 * fold.creepage, 0.15
    time = stability.slip_away_time(wheelset, drive_torque=torque, start=begin, end=end, speed=3.0)
    run = cl.simulate(
        wheelset,
        cl.TorqueControl(cl.Profile.of(torque)),
        initial_speed=3.0,
        initial_creepage=begin,
        slip_away_creepage=end,
        duration=5.0,
    )
    event = run.first("slip_away")
    assert event is not None
    if wheelset.element.memory:
        return abs(time / event.time - 1.0)
    same(time, event.time, 1e-4)
    return None


def pictures(case: Case) -> None:
    """The curve that is drawn is that of the element, the run that is drawn the run."""
    if case.feature.sections:
        run = cl.run_scenario(case.scenario, "open_loop")
        metrics = cl.metrics(run, case.scenario.drivetrain)
        figure = figures.scenario_run(run, metrics, title="A feature", caption="")
        drawn = np.concatenate([line.get_ydata() for line in figure.axes[0].get_lines()])
        assert np.isclose(drawn, 1e-3 * run["creep_force"][-1]).any()
        return
    figure = figures.creep_curve(case.wheelset, speed=10.0)
    lines = [line for line in figure.axes[0].get_lines() if line.get_linestyle() in ("-", "--")]
    for line in lines[:2]:
        zeta, drawn = (np.asarray(values, dtype=float) for values in line.get_data())
        kept = np.isfinite(drawn)
        curve = case.element.at_creepage(zeta[kept], speed=10.0)["traction_coefficient"]
        same(drawn[kept], curve, 1e-12)


PAGE = """async (text, zeta) => {
  await contactlib.ready;
  try {
    const vehicle = contactlib.files.readModel(text);
    const plant = new contactlib.plant.Plant(vehicle, vehicle.axle_load);
    return [null, zeta.map((z) => plant.at(z, 10.0, 1.0).torque)];
  } catch (error) { return [error.message, null]; }
}"""


def explorer(case: Case, page: ExplorerPage) -> None:
    """The page reads the model file; its torque over creepage is Python's."""
    zeta = np.geomspace(1e-4, 0.5, 20)
    text = (case.folder / "vehicle.toml").read_text()
    refusal, torque = page.call(PAGE, text, zeta.tolist())
    if refusal is not None:
        raise ValueError(refusal)
    same(torque, stability.quasi_steady_torque(case.wheelset, zeta, speed=10.0), 1e-9)


def environment(case: Case) -> None:
    """An episode under the demand is the run without control, to the last bit."""
    rl = pytest.importorskip("contactlib.rl")
    run = cl.run_scenario(case.scenario, "open_loop", step=5e-3, tolerance=1e-7)
    env = rl.TractionEnv(case.scenario, step=5e-3, tolerance=1e-7)
    env.reset(seed=0)
    for creepage in run["creepage"][2::2]:
        *_, info = env.hold(env.measurement.demand)
        assert info["creepage"] == creepage


# ---- cells --------------------------------------------------------------------------------------


class Use(NamedTuple):
    """A column of the page."""

    check: Callable[..., float | None]
    tools: str = ""  # that it needs: gcc, a browser
    takes_scenarios: bool = False
    takes_lateral: bool = False


USES: dict[str, Use] = {
    "Python": Use(in_python, takes_lateral=True),
    "FMU, CS": Use(fmu_step, takes_lateral=True),
    "FMU, ME": Use(fmu_exchange, takes_lateral=True),
    "kernel file": Use(kernel_file, "gcc", takes_lateral=True),
    "runs": Use(runs, takes_scenarios=True),
    "vehicle": Use(vehicle, takes_scenarios=True),
    "sweeps": Use(sweeps, takes_scenarios=True),
    "steady states": Use(steady_states),
    "poles, loops": Use(poles),
    "slip-away": Use(slip_away),
    "figures": Use(pictures, takes_scenarios=True),
    "page": Use(explorer, "browser"),
    "gym": Use(environment, takes_scenarios=True),
}
# Uses of one wheelset that have a part of a run.
HAVE_PART: dict[str, tuple[Callable[..., Any], ...]] = {
    "axle": (poles,),
    "motor": (poles,),
    "brake": (fmu_step, fmu_exchange),
}
NOT_OF_A_WHEELSET = "It belongs to a run; this takes one wheelset."
STEADY = (
    "Computed for steady rolling, here at 3 m/s: the error grows with p a/V, as "
    "[memory](../explanation/memory.md#where-it-matters) shows. It warns with p a/V and names the "
    "simulation that is exact."
)
NOT_LATERAL = (
    "The model of a wheelset moves along the track. Lateral slip and spin are inputs of the force "
    "element, which a vehicle tool sets."
)


class Cell(NamedTuple):
    """What a feature does in a use: a word, and the reason if it is not "right"."""

    word: str
    reason: str = ""


def cell_of(case: Case, use: Use, *tools: ExplorerPage) -> Cell:
    """Check a feature in a use.

    Raises
    ------
    AssertionError
        If its two ways differ.
    """
    parts = () if use.takes_scenarios else case.feature.sections
    if any(use.check not in HAVE_PART.get(part, ()) for part in parts):
        return Cell("-", NOT_OF_A_WHEELSET)
    if case.feature.lateral and not use.takes_lateral:
        return Cell("-", NOT_LATERAL)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("ignore", RangeWarning)
        warnings.simplefilter("always", cl.InputWarning)
        try:
            difference = use.check(case, *tools)
        except ValueError as refusal:
            return Cell("refused", case.without_folder(refusal))
    unused = [w.message for w in warned if "makes no use of" in str(w.message)]
    if unused:
        return Cell("not used", case.without_folder(unused[0]))
    if difference is None:
        return Cell("right")
    return Cell(f"within {rounded_up(difference)}", STEADY)


def rounded_up(value: float) -> str:
    """To one digit, in per cent."""
    size = 10.0 ** math.floor(math.log10(100.0 * value))
    return f"{math.ceil(100.0 * value / size) * size:.1g} %"


# ---- the page -----------------------------------------------------------------------------------

PAIRED = (in_python, fmu_exchange, runs)  # uses of two features together


def pair_of(case: Case) -> Cell:
    """Check two features together in several uses; the first refusal is that of the pair."""
    for check in PAIRED[: 2 if case.feature.lateral else None]:
        cell = cell_of(case, Use(check, takes_lateral=True))
        if cell.word != "right":
            return cell
    return Cell("right")


def table(rows: Mapping[str, Mapping[str, Cell]]) -> str:
    """A Markdown table of cells, and below it the reasons by number."""
    columns = list(dict.fromkeys(name for row in rows.values() for name in row))
    reasons: dict[str, int] = {}
    lines = [f"| | {' | '.join(columns)} |", "|---|" + "---|" * len(columns)]
    for name, row in rows.items():
        words = []
        for column in columns:
            cell = row.get(column, Cell(""))
            number = reasons.setdefault(cell.reason, len(reasons) + 1) if cell.reason else 0
            words.append(f"{cell.word} [{number}]" if number else cell.word)
        lines.append(f"| {name} | {' | '.join(words)} |")
    notes = [f"{number}. {reason}" for reason, number in reasons.items()]
    return "\n".join([*lines, "", *notes])
