"""Wheelsets in the hands of python-control: loops, margins, and the nonlinear system.

Nothing here solves what that library solves; it hands over the plant, asks, and refuses the answers
that are none.
"""

from contactlib.control_systems.loci import Nyquist, RootLocus, growth_rate, nyquist, root_locus
from contactlib.control_systems.loops import closed_loop, creep_loop, open_loop, sampled_loop
from contactlib.control_systems.margins import Margins, margins
from contactlib.control_systems.nonlinear import (
    creep_control_system,
    operating_point,
    phase_plane_system,
)
from contactlib.control_systems.response import response

__all__ = [
    "Margins",
    "Nyquist",
    "RootLocus",
    "closed_loop",
    "creep_control_system",
    "creep_loop",
    "growth_rate",
    "margins",
    "nyquist",
    "open_loop",
    "operating_point",
    "phase_plane_system",
    "response",
    "root_locus",
    "sampled_loop",
]
