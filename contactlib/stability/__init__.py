"""Stability of a wheelset: slip-away under torque control, and its prevention by control."""

from contactlib.stability.basin import Basin, basin, separatrix
from contactlib.stability.clearing import Clearing, clearing
from contactlib.stability.delay import Window, delay_limit, proportional_window, sampled_delay
from contactlib.stability.gains import (
    Controllability,
    ReducedPlant,
    controllability,
    creep_control_gain,
    pi_stable,
    reduced_plant,
)
from contactlib.stability.poles import (
    SteadyRollingWarning,
    approximate_pole,
    fast_pole,
    poles,
    reduced_frequency,
    slope_threshold,
    worst_pole,
)
from contactlib.stability.s_curve import (
    SCurve,
    find_fold,
    quasi_steady_torque,
    s_curve,
    steady_states,
)
from contactlib.stability.slip_away import slip_away_estimate, slip_away_formula, slip_away_time

__all__ = [
    "Basin",
    "Clearing",
    "Controllability",
    "ReducedPlant",
    "SCurve",
    "SteadyRollingWarning",
    "Window",
    "approximate_pole",
    "basin",
    "clearing",
    "controllability",
    "creep_control_gain",
    "delay_limit",
    "fast_pole",
    "find_fold",
    "pi_stable",
    "poles",
    "proportional_window",
    "quasi_steady_torque",
    "reduced_frequency",
    "reduced_plant",
    "s_curve",
    "sampled_delay",
    "separatrix",
    "slip_away_estimate",
    "slip_away_formula",
    "slip_away_time",
    "slope_threshold",
    "steady_states",
    "worst_pole",
]
