"""The pads of a brake, written again from the docstring of `Brake`."""

from __future__ import annotations

import numpy as np

GIVE = 1e-4  # way of the rim by which pads give [m]


def held_by(pads: float, rim: float) -> tuple[float, float]:
    """Part of the brake's torque that pads in a place give, and their rate; by the rim's speed."""
    u = rim / 5e-3  # the pads' holders damp
    along = np.sign(u) if abs(u) >= 1.0 else 8.0 * u / (3.0 + 6.0 * u**2 - u**4)
    return float(pads + 0.5 * (1.0 - pads**2) * along), (rim - abs(rim) * pads) / GIVE
