"""Many wheelsets at once: how they start, their rows, their signals and their largest forces."""

from contactlib.fleet.driving import Runs
from contactlib.fleet.signals import UNITS, Block
from contactlib.fleet.timing import Timing, timing

__all__ = ["UNITS", "Block", "Runs", "Timing", "timing"]
