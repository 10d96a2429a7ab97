"""Why a wheelset runs away under torque control, and what it takes to hold it."""

from contactlib.stability.fold import Fold, find_fold, quasi_steady_torque
from contactlib.stability.gains import creep_control_gain
from contactlib.stability.threshold import slope_threshold

__all__ = [
    "Fold",
    "creep_control_gain",
    "find_fold",
    "quasi_steady_torque",
    "slope_threshold",
]
