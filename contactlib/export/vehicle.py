"""The FMU of a vehicle: what a scenario describes, without its controllers, sensors and driver."""

from __future__ import annotations

from dataclasses import fields

from contactlib import kernel
from contactlib.files.model import Model
from contactlib.files.scenario import Scenario

SLOWEST = 1e-3  # speed at which the description begins that of a standing vehicle [m/s]


def parts_of(scenario: Scenario, brake_pressure: bool) -> tuple[Model, dict[str, float], bytes]:
    """The model of an axle of a scenario's vehicle, start values of its FMU, and its rails.

    Raises
    ------
    ValueError
        If the scenario has no vehicle, or one that an FMU cannot have.
    """
    vehicle, train, speed = scenario.vehicle, scenario.drivetrain, scenario.initial_speed
    if vehicle is None:
        raise ValueError(
            "scenario.vehicle = None: kind = 'vehicle' needs a scenario with [vehicle]; the FMU of "
            "one wheelset is that of its model file with kind = 'wheelset'"
        )
    if train.axle is not None:
        raise ValueError(
            "scenario.drivetrain.axle is elastic: axles of an FMU are rigid; leave out [axle]"
        )
    if train.motor.shaft_stiffness is not None:
        raise ValueError(
            "scenario.drivetrain.motor has an elastic shaft: shafts of an FMU are rigid; leave out "
            "rotor and shaft of [motor]"
        )
    if train.brake is not None and train.brake.pads is not None:
        raise ValueError(
            "scenario.drivetrain.brake has pads: in an FMU their friction is nominal; leave out "
            "the keys of [brake] that begin with pad, and let the tool multiply its input "
            "brake_torque or brake_pressure"
        )
    if brake_pressure and (train.brake is None or train.brake.pressure is None):
        raise ValueError(
            "brake_pressure = True needs [brake] with pressure, and torque at that pressure"
        )
    if train.sanding is not None:
        raise ValueError(
            "scenario.drivetrain.sanding: an FMU has no sand of its own; leave out [sanding], and "
            "set its input friction_scale"
        )
    if vehicle.load_lag == 0.0:
        raise ValueError(
            "vehicle.load_lag = 0.0 must be > 0 in an FMU, where loads are states: a suspension "
            "has a lag, such as 0.02 s"
        )
    if scenario.track.unit == "adhesion":
        raise ValueError(
            "scenario.track.unit = 'adhesion': the factors on friction are those of one contact, "
            "whose numbers the tool of an FMU may change; give the rails as factors or with "
            "track.unit = 'coefficient'"
        )
    track, n = scenario.rails, vehicle.axles
    if vehicle.length and vehicle.train_mass and len(set(track.grade.value)) > 1:
        raise ValueError(
            f"vehicle.length = {vehicle.length!r}: the train of an FMU is on the grades under the "
            "vehicle's axles; leave out length, or give each of its grades as the input grade"
        )
    numbers = {f.name: getattr(vehicle, f.name) for f in fields(vehicle)}
    named = {v.name for v in kernel.model_variables("vehicle")}
    starts = {name: float(value) for name, value in numbers.items() if name in named - {"position"}}
    starts |= train.member().drivetrain
    starts |= {"axles": float(n), "position": 0.0, "speed": speed}
    if n > 1:
        starts |= {f"position[{i}]": at for i, at in enumerate(vehicle.position, start=1)}
    contact = {"held_force": 0.0, "unslipped": 1.0, "outer_force": 0.0}
    starts |= {f"{name}_{side}": v for name, v in contact.items() for side in ("left", "right")}
    held = brake_pressure and train.brake and 1.0 / train.brake.pressure_per_torque
    starts |= {"torque_per_pressure": held or 0.0, "brake_pressure": 0.0}
    zero = "motor_torque", "acting_motor_torque", "acting_brake_torque", "grade", "distance"
    starts |= dict.fromkeys((*zero, "front_coupler_force", "rear_coupler_force"), 0.0)
    starts |= {"omega": speed / train.wheelset.radius, "axle_load": scenario.static_load}
    starts |= {"pads": (speed > 0.0) - (speed < 0.0) if train.brake else 1.0}
    model = Model(
        name=scenario.name,
        source=scenario.source,
        wheelset=train.wheelset,
        initial_speed=max(abs(speed), SLOWEST),
    )
    cleaned = {"cleaning": track.cleaning, "recovered": track.recovered}
    rails = kernel.rails_file(track.native.profiles, **cleaned, length=vehicle.position[-1])
    return model, starts, rails
