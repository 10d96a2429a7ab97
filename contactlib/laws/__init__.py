"""Creep force laws: normalized creepage to traction ratio."""

from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.measured import MeasuredCurve
from contactlib.laws.peak import Peak
from contactlib.laws.polach import Polach

__all__ = ["CarterGriffith", "MeasuredCurve", "Peak", "Polach"]
