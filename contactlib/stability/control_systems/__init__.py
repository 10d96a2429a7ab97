"""Wheelsets as systems of python-control: loops, margins, and the nonlinear system.

The solvers are those of the library; this package builds the systems and rejects invalid answers.
"""

from contactlib.stability.control_systems.loops import (
    Margins,
    closed_loop,
    creep_loop,
    frequencies,
    growth_rate,
    margins,
    open_loop,
    sampled_loop,
)
from contactlib.stability.control_systems.nonlinear import (
    creep_control_system,
    operating_point,
    phase_plane_system,
)

__all__ = [
    "Margins",
    "closed_loop",
    "creep_control_system",
    "creep_loop",
    "frequencies",
    "growth_rate",
    "margins",
    "open_loop",
    "operating_point",
    "phase_plane_system",
    "sampled_loop",
]
