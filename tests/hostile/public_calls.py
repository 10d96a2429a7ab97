"""Everything public that takes numbers, and objects and numbers to call it with.

Signatures name the arguments and limits give numbers; here is what a call needs beyond that.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np

import contactlib as cl
from contactlib import stability, traction
from contactlib.laws import ContactHeat, Softening, ThermalContact
from contactlib.stability import control_systems, torsion
from contactlib.traction import Sensors
from contactlib.vehicle import (
    Axle,
    CreepCurve,
    Drivetrain,
    DynamicLoad,
    Motor,
    OperatingPoint,
    Variation,
)

MODULES = (
    *(cl, cl.laws, cl.table, cl.element, cl.vehicle, stability, torsion, control_systems),
    *(traction, cl.files, cl.runs, cl.export),
)
NUMERIC = re.compile(r"(Annotated\[)?(float|int|ArrayLike|Axis|Values|Sequence\[int|tuple\[float)")
CONDITIONS = ("speed", "axle_load", "friction_scale", "resistance_force")  # `GivenConditions`

CREEPAGES = np.linspace(0.001, 0.06, 12)
COEFFICIENTS = 0.3 * np.tanh(CREEPAGES / 0.01)
# Functions of rows of one length.
PAIRED = (
    *("FitResult.traction_coefficient", "MeasuredCurve", "TractionData", "roll"),
    *("Profile", "Profile.steps"),
)


@cache
def element() -> cl.ForceElement:
    table = cl.carter_griffith_table("elliptic")
    return cl.ForceElement(ellipse(), friction(), table=table, radius=0.5)


def ellipse() -> cl.EllipticContact:
    return cl.EllipticContact(wheel_load=1e5, radius_x=0.5, radius_y=0.3, contact_modulus=115.4e9)


def friction() -> cl.Friction:
    return cl.Friction(static=0.45, kinetic=0.21, weakening_length=1e-6)


def heat() -> ContactHeat:
    return ContactHeat(contact=ellipse())


def hot() -> ThermalContact:
    coulomb = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    return ThermalContact(heat=heat(), friction=coulomb, softening=Softening.linear(800.0))


@cache
def rig() -> cl.Wheelset:
    return cl.load_model("models/roller_rig.toml").wheelset


def drivetrain() -> Drivetrain:
    axle = Axle(stiffness=6e6, damping=100.0)
    motor = Motor(lag=0.01, rotor_inertia=7.5, gear_ratio=4.0, shaft_stiffness=1e6)
    return Drivetrain(rig(), axle=axle, motor=motor)


@cache
def scenario() -> cl.Scenario:
    return dataclasses.replace(cl.load_scenario("dry_wet_dry.toml"), duration=0.05)


def data() -> cl.TractionData:
    return cl.TractionData(CREEPAGES, COEFFICIENTS, 10.0)


def creep_control() -> cl.CreepControl:
    limits = {"torque_min": 0.0, "torque_max": 3e4}
    return cl.CreepControl(reference=cl.Profile.of(0.02), proportional_gain=1e6, **limits)


def point() -> OperatingPoint:
    return rig().balanced(creepage=0.024, speed=10.0)


def encoder() -> Sensors:
    return Sensors(encoder_pulses=9.0)


def two_points() -> cl.Profile:
    return cl.Profile((0.0, 0.5), (1.0, 2.0))


# Objects by the argument's name or the class of a receiver; after a function's name for it alone.
OBJECTS: dict[str, Callable[[], Any]] = {
    "AntiphaseForce": lambda: torsion.AntiphaseForce(rig(), point()),
    "CarterGriffith": lambda: cl.CarterGriffith(k_hat=0.3, contact="elliptic"),
    "CohesiveZone": lambda: cl.CohesiveZone(k_hat=0.3, static_to_kinetic=1.6),
    "ContactHeat": heat,
    "CreepCurve": lambda: CreepCurve(rig(), speed=10.0),
    "CreepForceTable": lambda: cl.carter_griffith_table("elliptic"),
    "CreepForces": lambda: cl.CreepForces(friction(), shear_modulus=82e9, poisson_ratio=0.28),
    "FitResult": lambda: cl.fit(cl.CarterGriffith, data(), k_hat=0.0),
    "ForceElement": element,
    "Friction": friction,
    "MeasuredCurve": lambda: cl.MeasuredCurve(CREEPAGES, COEFFICIENTS),
    "Plant": lambda: cl.Plant(scenario()),
    "Polach": lambda: cl.Polach(adhesion_reduction=1.0, slip_reduction=0.4),
    "Profile": two_points,
    "Result": lambda: cl.run_scenario(scenario(), "creep_pi"),
    "Scenario": scenario,
    "Sensors": encoder,
    "Softening": lambda: Softening.linear(800.0),
    "ThermalContact": hot,
    "Track": lambda: cl.Track(friction_left=two_points()),
    "TractionData": data,
    "DynamicLoad": lambda: DynamicLoad(frequency=(0.5, 9.0), density=(0.02, 0.01)),
    "Variation": lambda: Variation(standard_deviation=0.2, correlation_length=50.0),
    "Vehicle": lambda: cl.load_scenario("four_axles.toml").vehicle,
    "Wheelset": rig,
    "contact": ellipse,
    "cohesive_table contact": lambda: "line",
    "controller": lambda: "creep_pi",
    "simulate controller": lambda: cl.TorqueControl(cl.Profile.of(19e3)),
    "creep_control_system controller": creep_control,
    "curve": lambda: cl.MeasuredCurve(CREEPAGES, COEFFICIENTS),
    "data": data,
    "drivetrain": drivetrain,
    "element": element,
    "f": lambda: lambda u: 0.2 + 0.2 / (1.0 + u / 1e-6) ** 3,
    "friction": friction,
    "heat": heat,
    "law": lambda: cl.CarterGriffith,
    "model": element,
    "export_fmu model": lambda: cl.load_model("models/roller_rig.toml"),
    "export_ssp model": lambda: cl.load_model("models/roller_rig.toml"),
    "path": lambda: Path(gettempdir()) / "never-written.fmu",
    "phase_plane_system wheelset": lambda: cl.load_model("models/locomotive.toml").wheelset,
    "point": point,
    "reference": two_points,
    "scenario": scenario,
    "scenarios": lambda: [scenario()],
    "sensors": Sensors,
    "Scenario controllers": lambda: scenario().controllers,
    "Scenario drivetrain": lambda: scenario().drivetrain,
    "SensorReader sensors": lambda: [encoder()],
    "softening": lambda: Softening.linear(800.0),
    "table": lambda: cl.carter_griffith_table("elliptic"),
    "track": lambda: cl.Track(cleaning=1e-4),
    "wheelset": rig,
}
# Numbers by the argument's name, likewise, where not any within its limits will do.
NUMBERS: dict[str, Any] = {
    "Profile.mean_behind near": 0.0,
    "creepage": 0.012,
    "drive_torque": 19e3,
    "duration": 1e-2,
    "friction_scale": 0.9,
    "initial_speed": 10.0,
    "kinetic": 0.21,
    "axle_load": 1e5,
    "wheel_load": 1e5,
    "normal_load": 1e5,
    "omega": 20.2,
    "radius": 0.5,
    "sample_time": 1e-3,
    "proportional_gain": 1e6,
    "speed": 10.0,
    "static": 0.45,
    "step": 1e-3,
    "torque_max": 3e4,
    **{f"{name} {key}": CREEPAGES for name in PAIRED for key in ("creepage", "at")},
    **{f"{name} traction_coefficient": COEFFICIENTS for name in PAIRED},
    "MeasuredCurve kinetic": None,
    "Vehicle position": (0.0, 3.0, 9.9, 12.9),
    "Vehicle axles_per_bogie": 2.0,
    "Vehicle.loads creep_force": np.zeros(4),
    "Vehicle.loads omega_rate": np.zeros(4),
    "roll distance": np.linspace(0.0, 0.1, 12),
    "SensorReader index": [0],
    "Profile value": COEFFICIENTS,
    "Profile.steps value": COEFFICIENTS,
    "Friction.from_samples slip": np.r_[0.0, CREEPAGES],
    "Friction.from_samples coefficient": np.linspace(0.4, 0.2, 13),
    "Softening temperature": [0.0, 300.0],
    "Softening coefficient": [0.4, 0.1],
}

EVERY_STEP = "called at every step of an integrator: checks nothing"
# Answers may be infinite; they may have nan, which then stands for "none".
INFINITE = {
    *("CarterGriffith", "CohesiveZone", "CohesiveZone.slip", "Drivetrain", "Polach", "Wheelset"),
    *("basin", "bistable_range", "clearing"),
    *("controllability", "separatrix", "slip_away_time", "delay_limit"),
    *("proportional_window", "slip_away_estimate"),
}
NOT_A_NUMBER = {"fit", "run_many", "sensor_errors"}
# Public names that take numbers that they do not check themselves, and why.
EXEMPT: dict[str, str] = {
    **dict.fromkeys(("FitResult", "OperatingPoint", "Tuning"), "what an analysis answers"),
    **dict.fromkeys(
        (*("CreepControl.start", "TorqueControl.start", "Wheelset.rates"),),
        EVERY_STEP,
    ),
    "Conditions": "made and checked by Wheelset.conditions",
    "MeasuredCurve.from_csv": "has a file: laws/test_measured.py",
    "SampledController.reset": "of a base class: traction/test_batching.py",
    "TractionData.from_csv": "has a file: laws/test_traction_data.py",
    "Wheelset.jacobians": "of points that its caller has checked: stability/test_poles.py",
    "growth_rate": "of poles, which are complex: stability/test_delay.py",
    **dict.fromkeys(
        ("Sweep", "Sweep.describe", "Sweep.scenario_of", "ensemble"), "of a file: runs/sweep"
    ),
}


def is_method(member: object) -> bool:
    return inspect.isroutine(member) and not isinstance(member, cached_property)


@cache
def public() -> dict[str, Any]:
    """Everything public that takes numbers, by name: functions, classes, and their methods.

    Exceptions, named tuples, which are answers, and protocols are left out.
    """
    callables: dict[str, Any] = {}
    for module in MODULES:
        for name in dir(cl) if module is cl else module.__all__:
            value = getattr(module, name)
            answers = inspect.isclass(value) and (
                issubclass(value, BaseException | tuple) or getattr(value, "_is_protocol", False)
            )
            if callable(value) and not answers and not any(value is v for v in callables.values()):
                callables[name] = value
    for name, value in list(callables.items()):
        if inspect.isclass(value):
            for method, attribute in inspect.getmembers(value, is_method):
                named = method == "__call__" or not method.startswith("_")
                if named and not getattr(attribute, "__qualname__", "").startswith("Parameters."):
                    callables[f"{name}.{method}"] = attribute
    return {name: value for name, value in callables.items() if numbers_of(value)}


def numbers_of(function: Any) -> list[str]:
    """Names of the arguments that are numbers."""
    names = []
    for name, parameter in inspect.signature(function).parameters.items():
        text = str(parameter.annotation)
        if parameter.kind is inspect.Parameter.VAR_KEYWORD:
            conditions = CONDITIONS if "GivenConditions" in text else CONDITIONS[1:]
            names += [n for n in conditions if "Unpack" in text and n not in names]
        elif NUMERIC.match(text):
            names.append(name)
    return names


def arguments(name: str, function: Any, **given: Any) -> dict[str, Any]:
    """Arguments of a call: those given, and what it needs beside them."""
    made = {}
    for key, parameter in inspect.signature(function).parameters.items():
        makes = OBJECTS.get(f"{name} {key}", OBJECTS.get(key))
        needed = parameter.default is parameter.empty and key != "self"
        variable = parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL)
        if needed and not variable and key not in given:
            made[key] = None if makes is None else makes()
    return made | given


def receiver(name: str, function: Any) -> tuple[Any, ...]:
    """The object that a method is called of, if there is one."""
    owner = name.rpartition(".")[0]
    return (OBJECTS[owner](),) if owner and inspect.isfunction(function) else ()
