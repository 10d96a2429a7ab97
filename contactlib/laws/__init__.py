"""Creep force laws: normalized creepage to traction ratio."""

from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.cohesive import CohesiveZone
from contactlib.laws.measured import MeasuredCurve
from contactlib.laws.peak import Peak
from contactlib.laws.polach import Polach
from contactlib.laws.slip_zone import ConvergenceError

__all__ = ["CarterGriffith", "CohesiveZone", "ConvergenceError", "MeasuredCurve", "Peak", "Polach"]
