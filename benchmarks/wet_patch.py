"""The scenario that runs are timed on: a wet patch under sampled creep control."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import contactlib as cl
from contactlib.traction import Sensors
from contactlib.vehicle import Drivetrain

CONTROLLER = "creep"
STEP = 1e-3  # [s]


def wet_patch(
    speed: float, *, duration: float = 10.0, friction: float = 0.545, torque: float = 23.5e3
) -> cl.Scenario:
    """A locomotive's wheelset that meets a wet patch after a fifth of its way.

    Its contact is the roller rig's line, whose law the rivals solve.

    Parameters
    ----------
    speed : float
        At the start [m/s].
    duration : float, optional
        [s].
    friction : float, optional
        Factor on friction in the patch [1].
    torque : float, optional
        Demand [N.m].
    """
    line = cl.load_model("roller_rig.toml").wheelset.element
    drivetrain = Drivetrain(replace(cl.load_model("locomotive.toml").wheelset, element=line))
    sensors = Sensors()
    controller = cl.traction.CreepPI.for_drivetrain(
        drivetrain,
        speed=speed,
        sensors=sensors,
        creepage_error=0.0,  # the rivals have exact sensors, too
    )
    way = speed * duration
    places = (0.2 * way, 0.2 * way, 0.6 * way, 0.6 * way)
    return replace(
        cl.load_scenario("dry_wet_dry.toml"),
        drivetrain=drivetrain,
        track=cl.Track(friction_left=cl.Profile(places, (1.0, friction, friction, 1.0))),
        sensors=sensors,
        demand=cl.Profile.of(torque),
        initial_speed=speed,
        design_speed=speed,
        duration=duration,
        controllers={CONTROLLER: controller},
    )


def many(n: int, speed: float, *, duration: float = 10.0) -> list[cl.Scenario]:
    """Scenarios of one vehicle that differ in the patch's friction and in the demand."""
    random = np.random.default_rng(0)
    first = wet_patch(speed, duration=duration)
    found = []
    for friction, torque in random.uniform((0.4, 22e3), (0.7, 24.5e3), (n, 2)).tolist():
        places = first.track.friction_left.at
        track = cl.Track(friction_left=cl.Profile(places, (1.0, friction, friction, 1.0)))
        found.append(replace(first, track=track, demand=cl.Profile.of(torque)))
    return found
