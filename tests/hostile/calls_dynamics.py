"""Good calls of the dynamics: stability, control, torsion, traction, wheelsets, runs, sweeps."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from hostile import Call

import contactlib as cl
from contactlib import stability, traction
from contactlib.stability import control_systems, torsion


@cache
def table() -> cl.CreepForceTable:
    return cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")


@cache
def rig() -> cl.Wheelset:
    """Speed held."""
    return cl.load_model("models/roller_rig.toml", table=table()).wheelset


@cache
def train() -> cl.Wheelset:
    """Free."""
    return cl.load_model("models/locomotive.toml").wheelset


@cache
def drivetrain() -> cl.Drivetrain:
    return cl.Drivetrain(
        rig(), axle=cl.Axle(stiffness=6e6, damping=100.0), motor=cl.Motor(lag=0.01)
    )


@cache
def scenario() -> cl.Scenario:
    return dataclasses.replace(cl.load_scenario("dry_wet_dry.toml"), duration=0.05)


@cache
def point() -> cl.OperatingPoint:
    return rig().balanced(creepage=0.024, speed=10.0)


@cache
def loop() -> Any:
    return control_systems.creep_loop(rig(), point(), proportional_gain=5e5)


@cache
def nonlinear() -> Any:
    return rig().to_nlsys(speed=10.0)


CREEPAGES = np.array([-0.01, 0.004, 0.012, 0.02, 0.03, 0.2])
SPEEDS = np.array([1.0, 4.0, 10.0, 20.0])
CONTACT: dict[str, Any] = {"speed": 10.0, "normal_load": 2e5, "friction_scale": 0.9}
INPUTS = {**CONTACT, "resistance_force": 10.0}
TORQUE = 19e3  # of a point on the rising branch


def made(function: Callable[..., Any], **given: Any) -> Callable[[], tuple[Any, dict[str, Any]]]:
    """What a `Call` makes of numbers alone, with nothing to build."""
    return lambda: (
        function,
        {k: v.copy() if isinstance(v, np.ndarray) else v for k, v in given.items()},
    )


def of_curve(
    name: str, arrays: tuple[str, ...] = (), *, free: bool = False, **changes: Any
) -> Call:
    """Call of an analysis of a wheelset at one speed."""
    given = {"creepage": CREEPAGES, **changes} if "creepage" in arrays else changes
    numbers = tuple(key for key in given if key not in arrays)
    function = getattr(cl, name, None) or getattr(stability, name.removeprefix("stability."))
    return Call(
        name=name if not free else f"{name} free",
        make=lambda: (
            function,
            {
                "wheelset": train() if free else rig(),
                **{k: v.copy() if k in arrays else v for k, v in given.items()},
            },
        ),
        arrays=arrays,
        numbers=numbers,
        optional=("normal_load", *(("creepage",) if name == "s_curve" else ())),
        infinite=name in ("basin", "separatrix", "clearing", "slip_away_time", "s_curve")
        or name == "find_fold"
        or name == "stability.slip_away_estimate",
        slow=name in ("clearing", "basin", "separatrix"),
    )


def of_vehicle(name: str) -> Callable[[], tuple[Any, dict[str, Any]]]:
    """A traction controller's design for a vehicle."""
    kind = getattr(cl, name)
    return lambda: (
        kind.for_drivetrain,
        {"drivetrain": drivetrain(), "speed": 10.0, "sensors": cl.Sensors()},
    )


def fields_of(name: str, **given: float) -> Call:
    """Call of a class of declared quantities."""
    kind = getattr(cl, name.partition(" ")[0])
    missing = {field.name for field in dataclasses.fields(kind) if field.default is None}
    return Call(
        name=name,
        make=lambda: (kind, dict(given)),
        numbers=tuple(given),
        optional=tuple(k for k in given if k in missing),
    )


LIMITER = {
    "sample_time": 0.01,
    "proportional_gain": 1e4,
    "integral_gain": 1e5,
    "low_speed": 2.0,
    "least_slip": 0.02,
    "speed_filter_time": 0.25,
    "recovery_time": 0.2,
    "creepage_error": 0.01,
    "speed_noise": 0.02,
    "stick_torque": 3e3,
    "stick_compliance": 3e-7,
}
PLANT = {"pole": 70.0, "gain": 2e-4}
DELAYS = {"delay": 2e-3, "lag": 1e-3, "relaxation": 1e-3, "sample_time": 1e-3}


def command(kind: str) -> Callable[[], tuple[Any, dict[str, Any]]]:
    control: Any = (
        cl.TorqueControl(cl.Profile.of(TORQUE))
        if kind == "torque"
        else cl.CreepControl(
            reference=cl.Profile.of(0.02), proportional_gain=1e6, torque_min=0.0, torque_max=3e4
        )
    )
    return lambda: (control.command, {"reference": 0.02, "creepage": 0.01, "memory": TORQUE})


def run() -> Callable[[], tuple[Any, dict[str, Any]]]:
    return lambda: (
        cl.simulate,
        {
            "wheelset": rig(),
            "controller": cl.TorqueControl(cl.Profile.of(TORQUE)),
            "initial_speed": 10.0,
            "initial_creepage": 0.005,
            "duration": 0.01,
            "normal_load": 2e5,
            "friction_scale": 1.0,
            "resistance_force": 0.0,
            "slip_away_creepage": 0.1,
            "output_interval": 0.01,
            "tolerance": 1e-6,
        },
    )


def cosimulation() -> tuple[Any, dict[str, Any]]:
    return cl.cosimulate, {
        "wheelset": rig(),
        "source": cl.KernelSource(rig().element),
        "controller": cl.TorqueControl(cl.Profile.of(TORQUE)),
        "duration": 1e-3,
        "step": 1e-4,
        "initial_speed": 10.0,
        "initial_creepage": 0.005,
    }


def driven() -> tuple[Any, dict[str, Any]]:
    return cl.run_scenario, {
        "scenario": scenario(),
        "controller": "creep_pi",
        "initial_creepage": 0.005,
        "index": 1,
        "step": 5e-3,
        "tolerance": 1e-6,
    }


def fleet() -> tuple[Any, dict[str, Any]]:
    return cl.run_many, {
        "scenarios": [scenario()] * 4,
        "controller": "creep_pi",
        "outcomes": ["slip_work", "final_speed"],
        "index": [0, 1, 2, 3],
        "step": 5e-3,
        "tolerance": 1e-4,
    }


def searched() -> tuple[Any, dict[str, Any]]:
    given = {"scenarios": [scenario()], "controller": "creep_pi"}
    return cl.tune, {**given, "trials": 60, "seeds": 1, "seed": 1}


def erring() -> tuple[Any, dict[str, Any]]:
    one = scenario()
    return cl.sensor_errors, {
        "scenarios": [one],
        "controllers": {"pi": [one.controller("creep_pi")]},
        "noises": 1,
    }


@cache
def result() -> cl.Result:
    return cl.run_scenario(scenario(), "creep_pi")


def answered() -> tuple[Any, dict[str, Any]]:
    return control_systems.response, {
        "system": nonlinear(),
        "inputs": {
            "drive_torque": TORQUE,
            "normal_load": 2e5,
            "friction_scale": 1.0,
            "resistance_force": 0.0,
        },
        "initial_state": np.array([20.1]),
        "duration": 0.01,
        "output_interval": 1e-3,
        "tolerance": 1e-6,
    }


def read_by(**given: Any) -> Any:
    return traction.SensorReader(**given).read(SPEEDS, SPEEDS, SPEEDS)


def read_speeds() -> tuple[Any, dict[str, Any]]:
    reader = cl.Sensors(wheel_speed_noise=0.1).reader(4, 0.01)
    names = ("wheel_speed", "vehicle_speed", "demand")
    return reader.read, {name: SPEEDS.copy() for name in names}


def on_axle(function: Callable[..., Any], **given: Any) -> Callable[[], tuple[Any, Any]]:
    return lambda: (function, {"drivetrain": drivetrain(), **given})


def on_rig(function: Callable[..., Any]) -> Callable[[], tuple[Any, Any]]:
    return lambda: (function, {"wheelset": rig(), "creepage": CREEPAGES.copy(), **INPUTS})


def at_point(function: Callable[..., Any], **given: Any) -> Callable[[], tuple[Any, Any]]:
    return lambda: (function, {"wheelset": rig(), "point": point(), **given})


def exported(function: Callable[..., Any]) -> Callable[[], tuple[Any, dict[str, Any]]]:
    """Export to a folder that goes away."""

    def to_folder(**given: Any) -> None:
        with TemporaryDirectory() as folder:
            model = cl.load_model("models/roller_rig.toml", table=table())
            suffix = "fmu" if function is cl.export_fmu else "ssp"
            function(model, Path(folder) / f"rig.{suffix}", **given)

    return lambda: (to_folder, {"fmi_version": 2, "relaxation_length": 0.1})


LOOKUP = {
    "normal_load": 2e5,
    "speed": 10.0,
    "friction_scale": 0.9,
    "largest_creepage": 0.5,
    "error": 0.01,
}
SEEKING = {
    "radius": 0.5,
    "inertia": 250.0,
    "delay": 0.01,
    "motor_lag": 0.01,
    "first_compliance": 1e-6,
    "least_load": 6e3,
    "largest_reference": 0.05,
    "seeking_rate": 0.35,
    "target_elasticity": 0.2,
    "dither": 0.1,
    "dither_period": 0.6,
    "memory_time": 0.6,
    "observer_time": 0.04,
    "slip_noise": 0.0,
}
THRESHOLDS = {
    "slip_threshold": 0.05,
    "slip_release": 0.035,
    "acceleration_threshold": 2.0,
    "cut_fraction": 0.15,
    "cut_time": 0.02,
    "reapply_fraction": 0.85,
    "reapply_time": 0.02,
    "ramp_time": 2.0,
    "slip_filter_time": 0.02,
    "acceleration_filter_time": 0.01,
}
RULES = ("sample", "start")

CALLS: list[Call] = [
    # ---- stability
    of_curve("quasi_steady_torque", ("creepage",), **INPUTS),
    of_curve("CreepCurve", **INPUTS),
    *(
        Call(
            name=f"CreepCurve.{name}",
            make=lambda name=name: (  # type: ignore[misc]
                getattr(cl.CreepCurve(train(), **INPUTS), name),
                {"creepage": CREEPAGES.copy()},
            ),
            arrays=("creepage",),
        )
        for name in ("torque", "slope", "pole", "acceleration", "states")
    ),
    *(
        Call(
            name=f"CreepCurve.{name}",
            make=lambda name=name: (  # type: ignore[misc]
                getattr(cl.CreepCurve(train(), **INPUTS), name),
                {"drive_torque": 1e4},
            ),
            numbers=("drive_torque",),
        )
        for name in ("steady", "grip")
    ),
    of_curve("quasi_steady_torque", ("creepage",), free=True, **INPUTS),
    of_curve("stability.poles", ("creepage",), speed=10.0),
    of_curve("stability.poles", ("creepage",), free=True, speed=10.0),
    of_curve("fast_pole", ("creepage",), speed=10.0),
    of_curve("find_fold", **INPUTS),
    of_curve("s_curve", ("creepage",), **INPUTS),
    of_curve("steady_states", drive_torque=TORQUE, **INPUTS),
    of_curve("slip_away_time", drive_torque=4e4, start=0.0, end=0.5, **INPUTS),
    of_curve("stability.slip_away_estimate", drive_torque=4e4, end=0.5, **INPUTS),
    of_curve("basin", drive_torque=TORQUE, **INPUTS),
    of_curve("basin", free=True, drive_torque=TORQUE, **INPUTS),
    of_curve("separatrix", ("speed",), drive_torque=TORQUE, speed=SPEEDS),
    of_curve("clearing", drive_torque=TORQUE, slope=0.5, **INPUTS),
    of_curve("clearing", free=True, drive_torque=TORQUE, **INPUTS),
    of_curve("worst_pole", **CONTACT),
    Call(
        name="stability.reduced_plant",
        make=lambda: (stability.reduced_plant, {"wheelset": rig(), "creepage": 0.02, **CONTACT}),
        numbers=("creepage", *CONTACT),
        optional=("normal_load",),
    ),
    Call(
        name="stability.pi_stable",
        make=made(
            stability.pi_stable,
            pole=np.array([1.0, 70.0, -5.0, 0.0]),
            gain=2e-4,
            proportional=1e6,
            integral=1e5,
            lag=0.01,
        ),
        arrays=("pole",),
        numbers=("gain", "proportional", "integral", "lag"),
    ),
    Call(
        name="stability.approximate_pole",
        make=made(
            stability.approximate_pole,
            radius=0.5,
            inertia=250.0,
            creep_force_slope=np.array([1e6, -1e5, 3.0, 0.0]),
            speed=10.0,
        ),
        arrays=("creep_force_slope",),
        numbers=("radius", "inertia", "speed"),
    ),
    Call(
        name="stability.slip_away_formula",
        make=made(
            stability.slip_away_formula,
            radius=0.5,
            inertia=250.0,
            speed=10.0,
            overload=0.1,
            peak_force=5e4,
            peak_curvature=1e8,
            peak_creepage=0.02,
            end_creepage=0.5,
            sliding_force=4e4,
        ),
        numbers=(
            *("radius", "inertia", "speed", "overload", "peak_force", "peak_curvature"),
            *("peak_creepage", "end_creepage", "sliding_force"),
        ),
    ),
    Call(
        name="stability.proportional_window",
        make=made(stability.proportional_window, **PLANT, **DELAYS),
        numbers=(*PLANT, *DELAYS),
        infinite=True,
    ),
    Call(
        name="stability.proportional_window continuous",
        make=made(stability.proportional_window, **PLANT, **DELAYS | {"sample_time": 0.0}),
        numbers=("pole", "delay", "lag", "relaxation"),
        infinite=True,
    ),
    Call(
        name="controllability",
        make=made(cl.controllability, **PLANT, **DELAYS),
        numbers=(*PLANT, *DELAYS),
        infinite=True,
    ),
    Call(
        name="stability.delay_limit",
        make=made(stability.delay_limit, pole=70.0),
        numbers=("pole",),
        infinite=True,
    ),
    Call(
        name="stability.sampled_delay",
        make=made(stability.sampled_delay, delay=1e-3, lag=1e-3, sample_time=1e-3),
        numbers=("delay", "lag", "sample_time"),
    ),
    Call(name="slope_threshold", make=at_point(cl.slope_threshold)),
    Call(name="creep_control_gain", make=at_point(cl.creep_control_gain)),
    # ---- wheelset and drivetrain
    fields_of("Resistance", constant=1e3, linear=60.0, quadratic=3.0, grade=0.01),
    fields_of("Axle", stiffness=6e6, damping=100.0, drive_share=0.5),
    Call(
        name="Wheelset",
        make=lambda: (
            cl.Wheelset,
            {"element": rig().element, "inertia": 250.0, "mass": 2e4, "damping": 5.0},
        ),
        numbers=("inertia", "mass", "damping"),
        optional=("mass",),
    ),
    Call(
        name="Wheelset.conditions",
        make=lambda: (rig().conditions, dict(INPUTS)),
        numbers=tuple(INPUTS),
        optional=("normal_load",),
    ),
    Call(
        name="Wheelset.with_slope",
        make=lambda: (rig().with_slope, {"slope": 0.5}),
        numbers=("slope",),
    ),
    Call(
        name="WheelLoad",
        make=lambda: (
            cl.WheelLoad,
            {"frequency": (0.5, 9.0), "density": (0.02, 0.01), "seed": 1.0},
        ),
        numbers=("seed",),
    ),
    Call(
        name="WheelLoad.__call__",
        make=lambda: (
            cl.WheelLoad(frequency=(0.5, 9.0), density=(0.02, 0.01)),
            {"time": [-1.0, 0.0, 0.7, 3.0]},
        ),
        arrays=("time",),
    ),
    Call(
        name="Wheelset.balanced",
        make=lambda: (rig().balanced, {"creepage": 0.02, **CONTACT}),
        numbers=("creepage", *CONTACT),
        optional=("normal_load",),
    ),
    Call(
        name="Wheelset.equilibria",
        make=lambda: (rig().equilibria, {"drive_torque": TORQUE, **INPUTS}),
        numbers=("drive_torque", *INPUTS),
        optional=("normal_load",),
        long=True,
    ),
    Call(
        name="Wheelset.to_nlsys",
        make=lambda: (rig().to_nlsys, {"speed": 10.0}),
        numbers=("speed",),
    ),
    Call(name="Wheelset.linearize", make=lambda: (rig().linearize, {"point": point()})),
    Call(
        name="Drivetrain",
        make=lambda: (
            cl.Drivetrain,
            {"wheelset": rig(), "motor": cl.Motor(), "relaxation_length": 0.1},
        ),
        numbers=("relaxation_length",),
    ),
    fields_of("Motor", lag=0.01, power=1e6, torque_rate=1e5, trip_speed=40.0),
    # ---- torsion
    Call(
        name="torsion.torsional_jacobian", make=on_axle(torsion.torsional_jacobian, point=point())
    ),
    Call(
        name="torsion.antiphase_eigenvalues",
        make=on_axle(torsion.antiphase_eigenvalues, point=point()),
    ),
    Call(name="torsion.torsional_state", make=on_axle(torsion.torsional_state, point=point())),
    Call(
        name="torsion.torsional_threshold",
        make=on_axle(torsion.torsional_threshold, speed=10.0),
        numbers=("speed",),
    ),
    Call(
        name="torsion.bistable_range",
        make=on_axle(torsion.bistable_range, **CONTACT),
        numbers=tuple(CONTACT),
        optional=("normal_load",),
        infinite=True,
        long=True,
    ),
    Call(
        name="torsion.effective_slope",
        make=at_point(torsion.effective_slope, amplitude=np.array([0.0, 0.01, 0.1, 1.0])),
        arrays=("amplitude",),
    ),
    Call(name="torsion.AntiphaseForce", make=at_point(torsion.AntiphaseForce)),
    Call(
        name="torsion.AntiphaseForce.__call__",
        make=lambda: (
            torsion.AntiphaseForce(rig(), point()),
            {"deviation": np.array([0.0, 0.01, -0.01, 0.5])},
        ),
        arrays=("deviation",),
    ),
    Call(
        name="torsion.AntiphaseForce.describing_function",
        make=lambda: (
            torsion.AntiphaseForce(rig(), point()).describing_function,
            {"amplitude": 0.01},
        ),
        numbers=("amplitude",),
    ),
    # ---- control
    Call(
        name="control_systems.creep_loop",
        make=at_point(
            control_systems.creep_loop,
            proportional_gain=5e5,
            integral_gain=1e6,
            lag=1e-3,
            delay=1e-3,
            pade_order=6,
        ),
        numbers=("proportional_gain", "integral_gain", "lag", "delay", "pade_order"),
        long=True,
    ),
    Call(
        name="control_systems.sampled_loop",
        make=at_point(
            control_systems.sampled_loop,
            sample_time=1e-3,
            proportional_gain=5e5,
            integral_gain=1e6,
            lag=1e-3,
            delay=1e-3,
        ),
        numbers=("sample_time", "proportional_gain", "integral_gain", "lag", "delay"),
        long=True,
    ),
    Call(
        name="control_systems.closed_loop",
        make=lambda: (control_systems.closed_loop, {"loop": loop()}),
    ),
    Call(
        name="control_systems.margins",
        make=lambda: (control_systems.margins, {"loop": loop()}),
        nan=True,
        infinite=True,
    ),
    Call(
        name="control_systems.frequencies",
        make=lambda: (control_systems.frequencies, {"loop": loop()}),
    ),
    Call(
        name="control_systems.growth_rate",
        make=made(
            control_systems.growth_rate, poles=np.array([-1.0, 0.5, 0.2, 3.0]), sample_time=0.01
        ),
        rows=(),
        numbers=("sample_time",),
    ),
    Call(
        name="control_systems.operating_point",
        make=lambda: (
            control_systems.operating_point,
            {"wheelset": rig(), "drive_torque": TORQUE, "creepage": 0.005, **CONTACT},
        ),
        numbers=("drive_torque", "creepage", *CONTACT),
        optional=("normal_load",),
        long=True,
    ),
    Call(
        name="control_systems.phase_plane_system",
        make=lambda: (
            control_systems.phase_plane_system,
            {
                "wheelset": train(),
                "drive_torque": TORQUE,
                "normal_load": 2e5,
                "friction_scale": 1.0,
                "resistance_force": 0.0,
            },
        ),
        numbers=("drive_torque", "normal_load", "friction_scale", "resistance_force"),
        optional=("normal_load",),
    ),
    Call(
        name="control_systems.creep_control_system",
        make=lambda: (
            control_systems.creep_control_system,
            {"wheelset": rig(), "controller": command("creep")()[0].__self__, "speed": 10.0},
        ),
        numbers=("speed",),
    ),
    Call(
        name="control_systems.response",
        make=answered,
        numbers=("duration", "output_interval", "tolerance"),
        optional=("output_interval",),
        long=True,
    ),
    # ---- controllers
    Call(
        name="CreepControl",
        make=lambda: (
            cl.CreepControl,
            {
                "reference": cl.Profile.of(0.02),
                "proportional_gain": 1e6,
                "integral_gain": 1e5,
                "torque_min": 0.0,
                "torque_max": 3e4,
            },
        ),
        numbers=("proportional_gain", "integral_gain", "torque_min", "torque_max"),
    ),
    fields_of("OpenLoop", sample_time=0.01),
    fields_of("CreepPI", **LIMITER, reference=0.02, reference_torque=1e4, least_share=0.5),
    fields_of(
        "Sensors",
        vehicle_speed_bias=0.01,
        vehicle_speed_drift=0.01,
        wheel_diameter_error=0.01,
        encoder_pulses=100.0,
        wheel_speed_noise=0.1,
        vehicle_speed_noise=0.1,
        delay=0.01,
        seed=3.0,
    ),
    fields_of("Sensors estimating", acceleration_limit=0.5),
    fields_of("SlopeSeeking", **LIMITER, **SEEKING),
    fields_of("ThresholdControl", sample_time=0.01, **THRESHOLDS),
    Call(
        name="Sensors.reader",
        make=lambda: (
            cl.Sensors(wheel_speed_noise=0.1, encoder_pulses=9.0).reader,
            {"count": 4, "sample_time": 0.01, "first": 2, "radius": 0.5},
        ),
        numbers=("count", "sample_time", "first", "radius"),
        optional=("radius",),
    ),
    Call(
        name="traction.SensorReader",
        make=lambda: (
            read_by,
            {
                "sensors": [cl.Sensors(wheel_speed_noise=0.1, encoder_pulses=9.0)] * 4,
                "sample_time": 0.01,
                "index": np.arange(4),
                "radius": np.full(4, 0.5),
            },
        ),
        rows=("index",),
        arrays=("radius",),
        optional=("radius",),
        numbers=("sample_time",),
    ),
    Call(
        name="Scenario",
        make=lambda: (
            partial(dataclasses.replace, scenario()),
            {"initial_speed": 10.0, "design_speed": 10.0, "duration": 1.0},
        ),
        numbers=("initial_speed", "design_speed", "duration"),
        says={"design_speed": "speed"},
    ),
    Call(
        name="Plant",
        make=lambda: (
            partial(cl.Plant, scenario()),
            {"sample_time": 0.01, "step": 5e-3, "tolerance": 1e-8, "initial_creepage": 0.001},
        ),
        numbers=("sample_time", "step", "tolerance", "initial_creepage"),
        optional=("step", "initial_creepage"),
        slow=True,
    ),
    Call(
        name="Plant.reset",
        make=lambda: (cl.Plant(scenario()).reset, {"seed": 3}),
        numbers=("seed",),
        slow=True,
    ),
    Call(
        name="Plant.step",
        make=lambda: (cl.Plant(scenario()).step, {"torque": 1e3}),
        numbers=("torque",),
        slow=True,
    ),
    Call(
        name="Sensors.samples_of_delay",
        make=lambda: (cl.Sensors(delay=0.02).samples_of_delay, {"sample_time": 0.01}),
        numbers=("sample_time",),
    ),
    Call(
        name="traction.total_delay",
        make=lambda: (
            traction.total_delay,
            {"drivetrain": drivetrain(), "sensors": cl.Sensors(), "sample_time": 0.01},
        ),
        numbers=("sample_time",),
    ),
    Call(
        name="traction.SensorReader.read",
        make=read_speeds,
    ),
    *(
        Call(name=f"{name}.for_drivetrain", make=of_vehicle(name), numbers=("speed",))
        for name in ("CreepPI", "SlopeSeeking", "ThresholdControl", "OpenLoop")
    ),
    # ---- runs
    Call(
        name="simulate",
        make=run(),
        numbers=(
            *("initial_speed", "initial_creepage", "duration", "normal_load", "friction_scale"),
            *("resistance_force", "slip_away_creepage", "output_interval", "tolerance"),
        ),
        optional=(
            *("duration", "initial_creepage", "normal_load"),
            *("slip_away_creepage", "output_interval"),
        ),
        long=True,
    ),
    Call(
        name="cosimulate",
        make=cosimulation,
        slow=True,
        numbers=("duration", "step", "initial_speed", "initial_creepage"),
    ),
    Call(
        name="run_scenario",
        make=driven,
        numbers=("initial_creepage", "index", "step", "tolerance"),
        optional=("initial_creepage", "step"),
    ),
    Call(
        name="run_many",
        make=fleet,
        numbers=("step", "tolerance"),
        optional=("step",),
        nan=True,
    ),
    Call(name="tune", make=searched, numbers=("trials", "seeds", "seed")),
    Call(name="sensor_errors", make=erring, numbers=("noises",), nan=True),
    Call(
        name="metrics",
        make=lambda: (cl.metrics, {"result": result(), "drivetrain": scenario().drivetrain}),
        nan=True,
        infinite=True,
    ),
    # ---- files
    Call(
        name="lookup_table",
        make=lambda: (partial(cl.lookup_table, rig().element), dict(LOOKUP)),
        numbers=("normal_load", "speed", "friction_scale", "largest_creepage", "error"),
        optional=("normal_load", "error"),
    ),
    Call(
        name="export_fmu",
        make=exported(cl.export_fmu),
        numbers=("fmi_version", "relaxation_length"),
        optional=("relaxation_length",),
        long=True,
    ),
    Call(
        name="export_ssp",
        make=exported(cl.export_ssp),
        numbers=("fmi_version", "relaxation_length"),
        optional=("relaxation_length",),
        long=True,
    ),
]

ANSWER = "what an analysis answers"
EVERY_SAMPLE = "asked at every sample, of any numbers: hostile/test_dynamics_properties.py"
EVERY_STEP = "asked at every step of an integrator: checks nothing"
FILES = "has a file alone: "
LIMITER_RULES = ("limit", "sample", "slip", "start", "start_limiter")

# Public names without a call, and why.
EXEMPT: dict[str, str] = {
    "export_kernel": "takes a model and a folder alone: test_kernel_source.py",
    **dict.fromkeys(
        (
            *(
                "Event",
                "Fold",
                "stability.Peak",
                "Metrics",
                "OperatingPoint",
                "Result",
                "Result.first",
            ),
            *("Result.to_pandas", "Result.to_xarray", "Tuning", "Tuning.section"),
            *("control_systems.Margins", "stability.Basin", "stability.Clearing"),
            *("stability.Controllability", "stability.ReducedPlant", "stability.SCurve"),
            *("stability.SteadyStates", "stability.Window", "stability.WorstPole"),
            *("torsion.LimitCycle", "torsion.TorsionalState", "Measurement", "Sweep"),
        ),
        ANSWER,
    ),
    **dict.fromkeys(
        (
            *(f"{kind}.{rule}" for kind in ("CreepPI", "SlopeSeeking") for rule in LIMITER_RULES),
            *(f"traction.SlipLimiter.{rule}" for rule in LIMITER_RULES if rule not in RULES),
            *(f"{kind}.{rule}" for kind in ("OpenLoop", "ThresholdControl") for rule in RULES),
        ),
        EVERY_SAMPLE,
    ),
    "traction.SlipLimiter": "the base of CreepPI and SlopeSeeking, which are called",
    **dict.fromkeys(
        (
            *("CreepControl.command", "CreepControl.start", "TorqueControl.command"),
            *("TorqueControl.start", "Wheelset.rates", "KernelSource.exchange"),
            "Wheelset.native_curve",
            "FmuSource.exchange",
        ),
        EVERY_STEP,
    ),
    **dict.fromkeys(
        (
            *("TractionController", "TractionController.for_drivetrain"),
            *("TractionController.sample", "TractionController.start"),
        ),
        "a protocol",
    ),
    **dict.fromkeys(
        ("SampledController", "SampledController.reset", "SampledController.torque"),
        "a base class: traction/test_stacking.py",
    ),
    **dict.fromkeys(("load_model", "model_path"), f"{FILES}files/test_model.py"),
    "load_scenario": f"{FILES}files/test_scenario.py",
    "load_sweep": f"{FILES}runs/sweep/test_loading.py",
    "ensemble": "of a sweep's file: runs/sweep/test_execution.py",
    "Sweep.describe": "of a sweep's file: runs/sweep/test_plan.py",
    "Sweep.scenario_of": "of a sweep's file: runs/sweep/test_plan.py",
    "Result.to_csv": f"{FILES}runs/test_simulation.py",
    "write_comparison": f"{FILES}runs/test_outcomes.py",
    "write_explorer": f"{FILES}explorer/test_explorer_files.py",
    "FmuSource": f"{FILES}export/test_interop.py",
    "ModelError": "an exception",
    "Model": "takes objects that are checked: made by load_model",
    "Conditions": "made and checked by Wheelset.conditions",
    "TorqueControl": "takes a Profile alone",
    "KernelSource": "takes an element alone",
    "comparison_table": "takes metrics alone",
    "Drivetrain.member": "takes a track alone",
    "Scenario.controller": "takes a name alone: files/test_scenario.py",
    "ThresholdControl.noise": "takes sensors alone",
    "control_systems.open_loop": "takes systems of python-control alone",
    "traction.stacked": "takes controllers alone",
    "traction.structure": "takes any value",
}
