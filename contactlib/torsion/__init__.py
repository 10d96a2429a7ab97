"""Wheels that vibrate against each other on an elastic axle."""

from contactlib.torsion.limit_cycles import (
    AntiphaseForce,
    LimitCycle,
    TorsionalState,
    bistable_range,
    effective_slope,
    torsional_state,
)
from contactlib.torsion.linear import (
    antiphase_eigenvalues,
    torsional_jacobian,
    torsional_threshold,
)

__all__ = [
    "AntiphaseForce",
    "LimitCycle",
    "TorsionalState",
    "antiphase_eigenvalues",
    "bistable_range",
    "effective_slope",
    "torsional_jacobian",
    "torsional_state",
    "torsional_threshold",
]
