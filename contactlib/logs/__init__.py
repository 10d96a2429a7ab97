"""From the log of a run to the rails: friction along the way, with its uncertainty."""

from contactlib.logs.log import Log, read_log
from contactlib.logs.motion import LogErrors, LogPriors
from contactlib.logs.rails import RailsEstimate, estimate_rails

__all__ = ["Log", "LogErrors", "LogPriors", "RailsEstimate", "estimate_rails", "read_log"]
