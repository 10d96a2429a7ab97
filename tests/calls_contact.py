"""Good calls of the contact: laws, tables, friction, geometry, the force element, data and fits."""

from __future__ import annotations

import numpy as np
from hostile import Call

import contactlib as cl

X = np.array([-2.0, -0.4, 0.0, 0.3, 1.0, 1.6])
XI = np.array([-1.0, -0.9, -0.3, 0.0, 0.6, 1.0])

CALLS: list[Call] = [
    Call(
        name="CarterGriffith",
        make=lambda: (cl.CarterGriffith, {"k_hat": 0.3}),
        numbers=("k_hat",),
    ),
    Call(
        name="CarterGriffith.traction_ratio",
        make=lambda: (cl.CarterGriffith(k_hat=0.3).traction_ratio, {"normalized_creepage": X}),
        arrays=("normalized_creepage",),
    ),
]

# Public names without a call, and why.
EXEMPT: dict[str, str] = {}
