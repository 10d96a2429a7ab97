"""Wheelset, drivetrain and track, and the force they can transmit."""

from contactlib.vehicle.available_force import available_force
from contactlib.vehicle.conditions import Conditions, OperatingPoint
from contactlib.vehicle.continuous_control import CreepControl, TorqueControl
from contactlib.vehicle.creep_curve import CreepCurve, Fold, Peak, SteadyStates, WorstPole
from contactlib.vehicle.driver import Driver
from contactlib.vehicle.drivetrain import Axle, Brake, Drivetrain, Motor, Sanding
from contactlib.vehicle.dynamic_load import DynamicLoad
from contactlib.vehicle.track import Profile, Track, Variation
from contactlib.vehicle.vehicle import Vehicle
from contactlib.vehicle.wheelset import Resistance, Wheelset

__all__ = [
    "Axle",
    "Brake",
    "Conditions",
    "CreepControl",
    "CreepCurve",
    "Driver",
    "Drivetrain",
    "DynamicLoad",
    "Fold",
    "Motor",
    "OperatingPoint",
    "Peak",
    "Profile",
    "Resistance",
    "Sanding",
    "SteadyStates",
    "TorqueControl",
    "Track",
    "Variation",
    "Vehicle",
    "Wheelset",
    "WorstPole",
    "available_force",
]
