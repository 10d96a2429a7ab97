"""The force element: longitudinal creep force, and lateral force with spin."""

from contactlib.element.creep_forces import CreepForces
from contactlib.element.force_element import AspectWarning, ForceElement, ProcessZoneWarning
from contactlib.element.rolling import roll

__all__ = [
    "AspectWarning",
    "CreepForces",
    "ForceElement",
    "ProcessZoneWarning",
    "roll",
]
