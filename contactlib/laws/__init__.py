"""Creep force laws: normalized creepage to traction ratio."""

from contactlib.laws.carter_griffith import CarterGriffith, Peak

__all__ = ["CarterGriffith", "Peak"]
