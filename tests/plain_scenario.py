"""Scenarios that a test changes where it must."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any, cast

import contactlib as cl
from contactlib.files.scenario import ControllerDesign
from contactlib.traction import OpenLoop, Sensors
from contactlib.vehicle import Brake, Drivetrain, Motor, Vehicle


def of_axles(axles: int, **changes: Any) -> cl.Scenario:
    """The shipped scenario of four axles, with so many under the same body."""
    four = cl.load_scenario("four_axles.toml")
    assert four.vehicle is not None
    position = four.vehicle.position if axles == 4 else tuple(9.9 * i for i in range(axles))
    vehicle = replace(four.vehicle, position=position, axles_per_bogie=2 if axles == 4 else 1)
    wheelset = replace(four.drivetrain.wheelset, mass=vehicle.mass / axles)
    drivetrain = replace(four.drivetrain, wheelset=wheelset)
    return replace(four, vehicle=vehicle, drivetrain=drivetrain, **changes)


def plain_scenario(vehicle: cl.Wheelset | Drivetrain, **changes: Any) -> cl.Scenario:
    """Two seconds from 10 m/s under a steady demand, without control."""
    train = Drivetrain(vehicle) if isinstance(vehicle, cl.Wheelset) else vehicle
    given: dict[str, Any] = {
        "name": "test",
        "source": "chosen",
        "drivetrain": train,
        "demand": cl.Profile.of(2.0e4),
        "held_speed": cl.Profile.of(10.0) if train.wheelset.speed_held else None,
        "initial_speed": 10.0,
        "design_speed": 10.0,
        "duration": 2.0,
        "sensors": Sensors(),
        "controllers": {"open_loop": OpenLoop(sample_time=0.01)},
        **changes,
    }
    return cl.Scenario(**given)


def braked_vehicle(wheelset: cl.Wheelset, n: int, **changes: Any) -> cl.Scenario:
    """A braked vehicle of so many axles, each of that wheelset, on rails that slip cleans."""
    vehicle = Vehicle(
        position=tuple(2.5 * i + 5.0 * (i // 2) for i in range(n)), body_mass=18e3 * n,
        bogie_mass=1e3, wheelset_mass=1.5e3, train_mass=1e4, body_height=1.6, bogie_height=0.5,
        pivot_height=0.6, coupler_height=1.0, pitch_inertia=50.0,
        axles_per_bogie=2 if n > 2 and n % 2 == 0 else 1, **changes,
    )  # fmt: skip
    body = replace(wheelset, mass=vehicle.mass / n)
    brake = Brake(fill_time=0.25, vent_time=0.12, pressure=3e5, torque=1.5e4)
    track = cl.Track(friction_left=cl.Profile((3.0, 3.0), (1.0, 0.5)), cleaning=1e-4)
    train = Drivetrain(body, brake=brake, motor=Motor(lag=0.01))
    return replace(plain_scenario(train), vehicle=vehicle, track=track)


def wet_patch(sensors: Sensors | Mapping[str, Any] | None = None, **changes: Any) -> cl.Scenario:
    """The shipped scenario of a wet patch with every kind of controller.

    A mapping changes the file's sensors.
    """
    shipped = cl.load_scenario("dry_wet_dry.toml")
    kinds = {kind: ControllerDesign(kind, {}) for kind in cl.CONTROLLERS}
    changes = {"controllers": {**kinds, **shipped.controllers}, **changes}
    if not isinstance(sensors, Sensors):
        sensors = replace(shipped.sensors, **(sensors or {}))
    return replace(shipped, sensors=sensors, **changes)


@cache
def controls(name: str) -> tuple[cl.TorqueControl, cl.CreepControl]:
    """Continuous controllers of the shipped scenarios, for the rig or the locomotive."""
    shipped = {"rig": "torque_or_creep_rig.toml", "locomotive": "torque_or_creep.toml"}
    scenario = cl.load_scenario(shipped[name])
    chosen = [scenario.any_controller(key) for key in ("torque", "creep")]
    return cast(tuple[cl.TorqueControl, cl.CreepControl], tuple(chosen))
