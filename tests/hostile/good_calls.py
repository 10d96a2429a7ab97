"""How everything public is called well: a good value of each argument, by the argument's name.

The signatures show what takes numbers, and which. Here are the values, objects to call a method
of, and what a function needs beside them; and for each public name without a call, why.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from functools import cache, cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import contactlib as cl
from contactlib import stability, traction
from contactlib.laws import ContactHeat, FitResult, Softening, ThermalContact
from contactlib.laws.polach import Polach
from contactlib.runs import KernelSource
from contactlib.stability import control_systems, torsion
from contactlib.traction import Sensors
from contactlib.vehicle import Axle, CreepCurve, Drivetrain, Motor, OperatingPoint, WheelLoad

MODULES = (
    *(cl, cl.laws, cl.table, cl.element, cl.vehicle, stability, torsion, control_systems),
    *(traction, cl.files, cl.runs, cl.export),
)
POSITION = 4  # in a row, of the number that a call takes where it needs one
NUMERIC = re.compile(r"(Annotated\[)?(float|int|ArrayLike|Axis|Values|Sequence\[int|tuple\[float)")
CONDITIONS = ("speed", "normal_load", "friction_scale", "resistance_force")  # `GivenConditions`


def row(*numbers: float) -> NDArray[np.float64]:
    return np.array(numbers)


CREEPAGES = np.linspace(0.001, 0.06, 12)  # of measurements
COEFFICIENTS = 0.3 * np.tanh(CREEPAGES / 0.01)
SPEEDS = row(0.05, 1.0, 4.0, 20.0, 10.0, 30.0)
SCALES = row(0.1, 0.3, 0.5, 0.8, 0.9, 1.5)
X = row(-2.0, -0.4, 0.0, 0.3, 1.0, 1.6)  # normalized creepages
XI = row(-1.0, -0.9, -0.3, 0.0, 0.6, 1.0)  # places in the contact
FALLING: dict[str, Any] = {"slip_rate_residual": 0.6, "slip_rate_decay": 0.1}
TORQUE = 19e3  # of a point on the rising branch

# Numbers by the argument's name; in place of a row a call may take one of its numbers.
GOOD: dict[str, Any] = {
    "a_over_b": np.geomspace(0.05, 20.0, 6),
    "adhesion_reduction": 1.0,
    "amplitude": row(0.0, 0.1, 1.0, 0.02, 0.01, 0.5),
    "cleaning": 1e-4,
    "coefficient": 0.4 - SCALES / 10.0,
    "conductivity": 50.0,
    "contact_modulus": 115.4e9,
    "count": 4,
    "creep_force_slope": row(1e6, -1e5, 3.0, 0.0, 1e5, 2.0),
    "creepage": row(-0.01, 0.004, 0.012, 0.03, 0.02, 0.2),
    "creepage_x": np.linspace(-3e-3, 3e-3, 6),
    "creepage_y": np.linspace(2e-3, -1e-3, 6),
    "damping": 100.0,
    "delay": 1e-3,
    "density": 7850.0,
    "deviation": row(0.0, 0.01, -0.01, 0.5, 0.02, -0.2),
    "distance": X,
    "drive_torque": TORQUE,
    "duration": 0.01,
    "end": 0.5,
    "fill_time": 0.3,
    "first": 2,
    "friction_coefficient": 0.3,
    "friction_scale": SCALES,
    "gain": 2e-4,
    "heat_capacity": 460.0,
    "inertia": 250.0,
    "initial_creepage": 0.005,
    "initial_speed": 10.0,
    "integral_gain": 1e5,
    "k_hat": row(0.0, 0.05, 0.4, 1.0, 0.3, 1.6),
    "layer_ratio": row(0.0, 0.01, 0.1, 1.0, 0.5, 30.0),
    "kinetic": 0.21,
    "lag": 0.01,
    "lateral_position": 0.9 * XI,
    "normal_load": row(1.0, 1e4, 1e5, 3e5, 2e5, 5e4),
    "normal_load_per_length": 1e6,
    "normalized_creepage": X,
    "omega": 2.02 * SPEEDS,
    "other_friction_scale": SCALES[::-1].copy(),
    "poisson_ratio": np.linspace(0.0, 0.5, 6),
    "pole": 70.0,
    "position": XI,
    "proportional_gain": 1e6,
    "radius": 0.5,
    "radius_x": 0.5,
    "radius_y": 0.3,
    "rail_temperature": 20.0,
    "reach": 200.0,
    "recovered": 0.9,
    "reference": 0.02,
    "resistance_force": 10.0,
    "sample_time": 1e-3,
    "semi_axis_x": np.linspace(4e-3, 8e-3, 6),
    "semi_axis_y": np.linspace(8e-3, 4e-3, 6),
    "semi_width": 5e-3,
    "shear_modulus": 82e9,
    "slip": row(0.0, 1e-7, 1e-6, 3e-6, 1e-5, 1e-3),
    "slip_rate_decay": 0.1,
    "slip_rate_residual": 0.6,
    "slip_reduction": 0.4,
    "slip_speed": row(-20.0, 0.0, 0.05, 1.0, 10.0, 30.0),
    "slope": 0.5,
    "slope_reduction": 0.8,
    "softening_temperature": 800.0,
    "speed": SPEEDS,
    "spin": np.linspace(-0.5, 1.0, 6),
    "static": 0.45,
    "static_to_kinetic": 1.6,
    "step": 5e-3,
    "stiffness": 6e6,
    "temperature": row(0.0, 10.0, 100.0, 300.0, 500.0, 1e5),
    "time": row(-1.0, 0.0, 0.7, 3.0, 1.0, 20.0),
    "torque_max": 3e4,
    "torque_min": 0.0,
    "vent_time": 0.12,
    "weakening_length": 1e-6,
    "wheel_temperature": 60.0,
    "work": row(0.0, 1.0, 1e3, 5e3, 2e4, 1e9),
    "youngs_modulus": 210e9,
}


@cache
def line() -> cl.LineContact:
    return cl.LineContact.from_semi_width(
        semi_width=5e-3, radius=0.5, contact_modulus=115.4e9, normal_load=220e3
    )


@cache
def ellipse() -> cl.EllipticContact:
    return cl.EllipticContact(normal_load=1e5, radius_x=0.5, radius_y=0.3, contact_modulus=115.4e9)


def friction(**changes: Any) -> cl.Friction:
    given = {"static": 0.45, "kinetic": 0.21, "weakening_length": 1e-6, **FALLING}
    return cl.Friction(**given | changes)


@cache
def samples() -> cl.Friction:
    return cl.Friction.from_samples(GOOD["slip"], GOOD["coefficient"])


@cache
def element(elliptic: bool = False) -> cl.ForceElement:
    table = cl.carter_griffith_table("elliptic" if elliptic else "line")
    return cl.ForceElement(ellipse() if elliptic else line(), friction(), table=table, radius=0.5)


@cache
def measured() -> cl.MeasuredCurve:
    return cl.MeasuredCurve(CREEPAGES, COEFFICIENTS)


@cache
def fitted() -> FitResult:
    return cl.fit(cl.CarterGriffith, cl.TractionData(CREEPAGES, COEFFICIENTS), k_hat=0.0)


@cache
def heat(elliptic: bool = False) -> ContactHeat:
    return ContactHeat(contact=ellipse() if elliptic else line())


@cache
def hot(elliptic: bool = False) -> ThermalContact:
    softening = Softening([0.0, 200.0, 700.0], [1.0, 0.9, 0.2])
    coulomb = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    return ThermalContact(heat=heat(elliptic), friction=coulomb, softening=softening)


@cache
def rig() -> cl.Wheelset:
    """Speed held."""
    return cl.load_model("models/roller_rig.toml").wheelset


@cache
def train() -> cl.Wheelset:
    """Free."""
    return cl.load_model("models/locomotive.toml").wheelset


@cache
def drivetrain() -> Drivetrain:
    axle = Axle(stiffness=6e6, damping=100.0)
    return Drivetrain(rig(), axle=axle, motor=Motor(lag=0.01))


@cache
def scenario() -> cl.Scenario:
    return dataclasses.replace(cl.load_scenario("dry_wet_dry.toml"), duration=0.05)


@cache
def point() -> OperatingPoint:
    return rig().balanced(creepage=0.024, speed=10.0)


def torque_control() -> cl.TorqueControl:
    return cl.TorqueControl(cl.Profile.of(TORQUE))


def creep_control() -> cl.CreepControl:
    limits = {"torque_min": 0.0, "torque_max": 3e4}
    return cl.CreepControl(reference=cl.Profile.of(0.02), proportional_gain=1e6, **limits)


def noisy() -> Sensors:
    return Sensors(wheel_speed_noise=0.1, encoder_pulses=9.0, delay=0.02)


def loop() -> Any:
    return control_systems.creep_loop(rig(), point(), proportional_gain=5e5)


# Objects by the argument's name, made at their use.
OBJECTS: dict[str, Callable[[], Any]] = {
    "contact": line,
    "controller": lambda: "creep_pi",
    "controllers": lambda: {"pi": [scenario().controller("creep_pi")]},
    "curve": lambda: cl.CreepForceTable.from_law(measured()),
    "data": lambda: cl.TractionData(CREEPAGES, COEFFICIENTS, 10.0),
    "drivetrain": drivetrain,
    "element": element,
    "friction": friction,
    "heat": heat,
    "inputs": lambda: {
        "drive_torque": TORQUE,
        "normal_load": 2e5,
        "friction_scale": 1.0,
        "resistance_force": 0.0,
    },
    "law": lambda: Polach(adhesion_reduction=1.0, slip_reduction=0.4),
    "loop": loop,
    "model": element,
    "point": point,
    "scenario": scenario,
    "scenarios": lambda: [scenario()],
    "sensors": lambda: Sensors(),
    "softening": lambda: Softening.linear(800.0),
    "source": lambda: KernelSource(rig().element),
    "system": lambda: rig().to_nlsys(speed=10.0),
    "table": lambda: cl.carter_griffith_table("line"),
    "track": lambda: cl.Track(cleaning=1e-4),
    "wheelset": rig,
}

# What a class's methods are called of, by a name for the case.
RECEIVERS: dict[str, dict[str, Callable[[], Any]]] = {
    "CarterGriffith": {
        "": lambda: cl.CarterGriffith(k_hat=0.3),
        "Coulomb": lambda: cl.CarterGriffith(k_hat=0.0),
        "smallest": lambda: cl.CarterGriffith(k_hat=5e-324),
        "elliptic": lambda: cl.CarterGriffith(k_hat=0.3, contact="elliptic"),
    },
    "CohesiveZone": {
        "": lambda: cl.CohesiveZone(k_hat=0.3, static_to_kinetic=1.6),
        "elliptic": lambda: cl.CohesiveZone(k_hat=0.3, static_to_kinetic=1.6, contact="elliptic"),
    },
    "ContactHeat": {"": heat, "elliptic": partial(heat, True)},
    "CreepForceTable": {
        "": lambda: cl.carter_griffith_table("line"),
        "elliptic": lambda: cl.carter_griffith_table("elliptic"),
    },
    "CreepForces": {
        "": lambda: cl.CreepForces(
            friction(slip_rate_residual=1.0), shear_modulus=82e9, poisson_ratio=0.28
        )
    },
    "CreepCurve": {
        "": lambda: CreepCurve(rig(), speed=10.0),
        "free": lambda: CreepCurve(train(), speed=10.0, resistance_force=10.0),
    },
    "FitResult": {"": fitted},
    "ForceElement": {"": element, "elliptic": partial(element, True)},
    "Friction": {
        "": friction,
        "Coulomb": lambda: cl.Friction(static=0.4, kinetic=0.3, weakening_length=0.0),
        "short": lambda: cl.Friction(static=0.4, kinetic=0.3, weakening_length=5e-324),
        "samples": samples,
    },
    "ThermalContact": {"": hot, "elliptic": partial(hot, True)},
    "MeasuredCurve": {"": measured},
    "Polach": {
        "": lambda: Polach(adhesion_reduction=1.0, slip_reduction=0.4),
        "soft": lambda: Polach(adhesion_reduction=1.0, slip_reduction=5e-324),
    },
    "Plant": {"": lambda: cl.Plant(scenario())},
    "Profile": {"": lambda: cl.Profile((0.0, 0.5), (1.0, 2.0))},
    "Sensors": {"": noisy},
    "Softening": {"": lambda: Softening.linear(800.0)},
    "Track": {"": lambda: cl.Track(friction_left=cl.Profile((0.0, 0.5), (1.0, 2.0)))},
    "TractionData": {"": lambda: cl.TractionData(CREEPAGES, COEFFICIENTS)},
    "WheelLoad": {"": lambda: WheelLoad(frequency=(0.5, 9.0), density=(0.02, 0.01))},
    "Wheelset": {"": rig},
    "AntiphaseForce": {"": lambda: torsion.AntiphaseForce(rig(), point())},
    "SensorReader": {"": lambda: noisy().reader(6, 0.01, radius=0.5)},
}


def to_folder(export: Callable[..., object], suffix: str) -> Callable[..., None]:
    """Export to a folder that goes away."""

    def exported(*, fmi_version: int = 2) -> None:
        with TemporaryDirectory() as folder:
            model = cl.load_model("models/roller_rig.toml")
            path = Path(folder) / f"rig.{suffix}"
            export(model, path, fmi_version=fmi_version)

    return exported


def read_by(
    sensors: list[Sensors],
    sample_time: float,
    index: Sequence[int],
    radius: ArrayLike | None,
) -> Any:
    reader = traction.SensorReader(sensors, sample_time, index, radius=radius)
    return reader.read(SPEEDS, SPEEDS, SPEEDS)


def friction_of_level(level: float) -> cl.Friction:
    return cl.Friction.from_function(lambda u: level if u > 1e-6 else 0.4)


def fit_between(low: float, high: float, level: float, **fixed: Any) -> FitResult:
    return cl.fit(
        cl.CarterGriffith, OBJECTS["data"](), level=level, ranges={"kinetic": (low, high)}, **fixed
    )


# What is called in place of a public function, so that what it is given are numbers.
INSTEAD: dict[str, Callable[..., Any]] = {
    "Friction.from_function level": friction_of_level,
    "Scenario": lambda **given: dataclasses.replace(scenario(), **given),
    "export_fmu": to_folder(cl.export_fmu, "fmu"),
    "export_ssp": to_folder(cl.export_ssp, "ssp"),
    "fit": fit_between,
    "SensorReader": read_by,
}

PAIRS = {"creepage": CREEPAGES, "traction_coefficient": COEFFICIENTS}
LIMITER = {"proportional_gain": 1e4, "sample_time": 0.01}
LOOP = {"proportional_gain": 5e5, "integral_gain": 1e6, "lag": 1e-3}
FREE = {"wheelset": train}
MEASURED = ("wheel_speed", "vehicle_speed", "demand")

# Arguments of one function that differ from those above; after a space, another case of the same.
# A function without arguments makes the value.
OVERRIDES: dict[str, dict[str, Any]] = {
    "CarterGriffith elliptic": {"contact": "elliptic"},
    "CreepControl": {"reference": lambda: cl.Profile.of(0.02)},
    "CreepForces.evaluate": {"speed": None},
    "CreepPI": {**LIMITER, "reference_torque": 1e4},
    "Drivetrain": {"motor": lambda: Motor()},
    "RailState": {"distance": lambda: row(20.0, 5.0)},
    "benchmark_scenarios": {"small": True},
    "ForceElement.at_creepage": {"normal_load": 1e5, "friction_scale": 0.9},
    "ForceElement.evaluate elliptic": {
        "lateral_velocity": 2e-3 * SPEEDS,
        "spin_velocity": -0.3 * SPEEDS,
    },
    "ForceElement.from_curve": {"radius": 0.5, "minimum_speed": 0.1, "load_exponent": 0.3},
    "Friction": {"softening_temperature": None},
    "Friction.from_function": {
        "f": lambda u: 0.2 + 0.2 / (1.0 + u / 1e-6) ** 3,
        "kinetic": 0.2,
        **FALLING,
    },
    "Friction.from_function level": {"level": 0.2},
    "Friction.from_samples": FALLING,
    "ThermalContact": {"friction": lambda: friction(slip_rate_residual=1.0, slip_rate_decay=0.0)},
    "MeasuredCurve": {**PAIRS, "kinetic": 0.3, "saturation_creepage": 0.02, "speed": 10.0},
    "Polach rising": {"adhesion_reduction": 0.2, "slip_reduction": 0.9},
    "Profile": {"at": CREEPAGES, "value": COEFFICIENTS},
    "Profile.__call__": {"at": X},
    "Profile.of": {"value": 0.3},
    "Profile.on": {"start": 0.1, "end": 0.4},
    "Scenario": {"initial_speed": 10.0, "design_speed": 10.0, "duration": 1.0},
    "Sensors.reader": {"sample_time": 0.01},
    "SlopeSeeking": {
        **LIMITER,
        "delay": 0.01,
        "first_compliance": 1e-6,
        "minimum_load": 6e3,
        "largest_reference": 0.05,
    },
    "Track.from_breakpoints": {
        "distance": XI,
        "friction": None,
        "friction_left": SPEEDS,
        "friction_right": SPEEDS,
        "time": SPEEDS.cumsum(),
        "friction_over_time": SPEEDS,
        "slope": SPEEDS,
    },
    "Track.doubt": {"low": -1.0, "high": 9.0},
    "TractionData.shifted": {"by": 1e-3},
    "TractionData": {**PAIRS, "speed": 1.0 + CREEPAGES},
    "WheelLoad": {"time": (), "frequency": (0.5, 9.0), "density": (0.02, 0.01)},
    "basin free": FREE,
    "clearing free": FREE,
    "cohesive_table": {"contact": "line"},
    "creep_loop": LOOP,
    "creep_control_system": {"controller": creep_control},
    "growth_rate": {"poles": row(-1.0, 0.5, 0.2, 3.0)},
    "operating_point": {"creepage": 0.005, "resistance_force": None},
    "phase_plane_system": FREE,
    "sampled_loop": LOOP,
    "cosimulate": {"controller": torque_control, "duration": 1e-3, "step": 1e-4},
    "fit": {"low": 0.1, "high": 1.0, "level": 0.95, "k_hat": 0.0, "saturation_creepage": 0.02},
    "friction_with_k_hat": FALLING,
    "lookup_table": {"speed": 10.0, "largest_creepage": 0.5, "error": 0.01},
    "poles free": FREE,
    "roll": {"speed": 10.0},
    "Plant.step": {"torque": 1e3},
    "quasi_steady_torque free": FREE,
    "run_many": {
        "scenarios": lambda: [scenario()] * 4,
        "outcomes": ["slip_work"],
        "tolerance": 1e-4,
    },
    "run_scenario": {"tolerance": 1e-6},
    "simulate": {"controller": torque_control, "output_interval": 0.01, "tolerance": 1e-6},
    "reduced_frequency": {"rate": 70.0},
    "slip_away_time": {"drive_torque": 4e4, "start": 0.0},
    "pi_stable": {
        "pole": row(1.0, 70.0, -5.0, 0.0, 2.0, 9.0),
        "proportional": 1e6,
        "integral": 1e5,
    },
    "proportional_window continuous": {"sample_time": 0.0},
    "slip_away_estimate": {"drive_torque": 4e4},
    "slip_away_formula": {
        "overload": 0.1,
        "peak_force": 5e4,
        "peak_curvature": 1e8,
        "peak_creepage": 0.02,
        "end_creepage": 0.5,
        "sliding_force": 4e4,
    },
    "SensorReader": {
        "sensors": lambda: [noisy()] * 6,
        "index": np.arange(6),
        "radius": np.full(6, 0.5),
    },
    "SensorReader.read": dict.fromkeys(MEASURED, SPEEDS),
    "tune": {"trials": 60},
}

# Functions whose arrays must be rows, of one length where there are several.
ROWS = {
    *("Friction.from_samples", "FitResult.traction_coefficient", "MeasuredCurve", "Profile"),
    *("Softening", "Track.from_breakpoints", "TractionData", "WheelLoad"),
    "growth_rate",
    *("SensorReader", "SensorReader.read", "roll"),
}
# What a function takes as it is.
UNCHECKED = {
    "growth_rate": {"poles"},
    "SensorReader.read": set(MEASURED),
}
# Names under which an error reports an argument, if it is not the argument's.
REPORTED_AS = {
    ("Friction.from_function", "level"): "f|kinetic",
    ("Scenario", "design_speed"): "speed",
    ("operating_point", "friction_scale"): "friction_scale|drive_torque",
    # Its length over its semi-width may be too small for relaxation lengths.
    ("LineContact", "normal_load_per_length"): "normal_load_per_length|semi_width",
    ("LineContact", "radius"): "radius|semi_width",
    ("LineContact", "contact_modulus"): "contact_modulus|semi_width",
    ("LineContact.from_semi_width", "radius"): "radius|length",
    ("LineContact.from_semi_width", "contact_modulus"): "contact_modulus|length",
    ("LineContact.from_semi_width", "normal_load"): "normal_load|length",
    ("fit", "low"): "kinetic",
    ("fit", "high"): "kinetic",
}
# An answer may be infinite; it may have nan, which then stands for "none".
INFINITE = {
    *("CarterGriffith", "CohesiveZone", "CohesiveZone.slip", "Drivetrain", "Polach", "Wheelset"),
    *("basin", "clearing"),
    *("controllability", "separatrix", "slip_away_time", "delay_limit"),
    *("proportional_window", "slip_away_estimate"),
}
NOT_A_NUMBER = {"fit", "run_many", "sensor_errors"}
EVERY_STEP = "called at every step of an integrator: checks nothing"

# Public names that take numbers and have no call, and why.
EXEMPT: dict[str, str] = {
    **dict.fromkeys(("FitResult", "OperatingPoint", "Tuning"), "what an analysis answers"),
    **dict.fromkeys(
        (
            "CreepControl.start",
            *("TorqueControl.start", "Wheelset.rates", "KernelSource.exchange"),
            "FmuSource.exchange",
            "RailState.friction",
        ),
        EVERY_STEP,
    ),
    "benchmark": "its seed is that of benchmark_scenarios, which is called",
    "Wheelset.jacobians": "of points that its caller has checked: stability/test_poles.py",
    "Conditions": "made and checked by Wheelset.conditions",
    "FmuSource": "has a file: export/test_interop.py",
    "MeasuredCurve.from_csv": "has a file: laws/test_measured.py",
    "Model": "takes objects that are checked: made by load_model",
    "SampledController.reset": "of a base class: traction/test_stacking.py",
    "TractionData.from_csv": "has a file: laws/test_traction_data.py",
    "SlipLimiter": "the base of CreepPI and SlopeSeeking, which are called",
    **dict.fromkeys(
        ("Sweep", "Sweep.describe", "Sweep.scenario_of", "ensemble"), "of a file: runs/sweep"
    ),
}


def is_method(member: object) -> bool:
    return inspect.isroutine(member) and not isinstance(member, cached_property)


def public() -> dict[str, Any]:
    """Everything public that takes numbers, by name: functions, classes, and their methods.

    Exceptions, named tuples, which are answers, and protocols are left out.
    """
    found: dict[str, Any] = {}
    for module in MODULES:
        for name in dir(cl) if module is cl else module.__all__:
            value = getattr(module, name)
            answers = inspect.isclass(value) and (
                issubclass(value, BaseException | tuple) or getattr(value, "_is_protocol", False)
            )
            if callable(value) and not answers and not any(value is v for v in found.values()):
                found[name] = value
    for name, value in list(found.items()):
        if inspect.isclass(value):
            for method, attribute in inspect.getmembers(value, is_method):
                named = method == "__call__" or not method.startswith("_")
                if named and not getattr(attribute, "__qualname__", "").startswith("Parameters."):
                    found[f"{name}.{method}"] = attribute
    return {name: value for name, value in found.items() if takes_numbers(name, value)}


def takes_numbers(name: str, value: Any) -> bool:
    """Whether a signature or a table above shows it."""
    texts = [str(p.annotation) for p in inspect.signature(value).parameters.values()]
    return name in OVERRIDES or any(NUMERIC.match(t) or "Unpack" in t for t in texts)


class Call:
    """One way to call something public."""

    def __init__(self, name: str, case: str, function: Any, receiver: Any) -> None:
        self.covers, self.name = name, f"{name} {case}".strip()
        self.receiver = receiver
        self.function = INSTEAD.get(self.name, INSTEAD.get(name, function))
        given = OVERRIDES.get(self.name, {})
        if self.name not in INSTEAD:
            given = OVERRIDES.get(name, {}) | given
        self.arguments, self.arrays, self.optional = dict(given), set[str](), set[str]()
        self.made = {key for key, value in given.items() if is_maker(value)}
        self.numbers = [key for key, value in given.items() if is_number(value)]
        signature = inspect.signature(self.function).parameters
        for key, parameter in signature.items():
            self._take(key, parameter)
        self.optional |= set(given) - set(signature)
        self.numbers = [key for key in self.numbers if key not in UNCHECKED.get(name, ())]

    def _take(self, key: str, parameter: inspect.Parameter) -> None:
        """Arguments of one parameter."""
        text = str(parameter.annotation)
        if parameter.kind is inspect.Parameter.VAR_KEYWORD:
            for name in CONDITIONS if "GivenConditions" in text else CONDITIONS[1:]:
                if "Unpack" in text and name not in self.numbers:
                    self.numbers.append(name)
                    self.arguments.setdefault(name, GOOD[name])
                    self.optional |= {"normal_load"}
            return
        if NUMERIC.match(text):
            if key not in self.numbers:
                self.numbers.append(key)
            if "ArrayLike" in text:
                self.arrays.add(key)
            if "None" in text:
                self.optional.add(key)
            if key in GOOD:
                self.arguments.setdefault(key, GOOD[key])
        elif parameter.default is parameter.empty and key not in {"self", *self.arguments}:
            self.arguments[key] = OBJECTS[key]
            self.made.add(key)

    def good(self) -> dict[str, Any]:
        """Good arguments, made afresh."""
        found = {}
        for key, value in self.arguments.items():
            if key in self.made:
                value = value()
            elif isinstance(value, np.ndarray):
                value = value.copy() if self.takes_rows(key) else float(value[POSITION])
            found[key] = value
        return {key: value for key, value in found.items() if value is not None}

    def takes_rows(self, key: str) -> bool:
        """Whether an argument must be a row."""
        return self.covers in ROWS or key not in self.numbers

    def __call__(self, **arguments: Any) -> Any:
        """The answer."""
        if self.receiver is None:
            return self.function(**arguments)
        return self.function(self.receiver(), **arguments)


def is_maker(value: object) -> bool:
    """Whether it is a function that makes the argument."""
    return callable(value) and not inspect.signature(value).parameters


def is_number(value: object) -> bool:
    return isinstance(value, int | float | tuple | np.ndarray) and not isinstance(value, bool)


def calls() -> Iterator[Call]:
    """All of them."""
    for name, function in public().items():
        if name in EXEMPT:
            continue
        owner = name.rpartition(".")[0]
        of_object = inspect.isfunction(function) and owner in RECEIVERS
        receivers = RECEIVERS[owner] if of_object else {"": None}
        cases = [key.partition(" ")[2] for key in OVERRIDES if key.partition(" ")[0] == name]
        for case in dict.fromkeys(["", *receivers, *cases]):
            yield Call(name, case, function, receivers.get(case, receivers.get("")))
