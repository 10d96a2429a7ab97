"""Models of the kernel, as an FMU steps them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from contactlib import kernel
from contactlib.export.description import Description

SIGMA = 8e-3  # relaxation length [m]


def native(description: Description, **start: float) -> kernel.NativeModel:
    contact = description.native_contact
    values = {**description.start_values, **start}
    return kernel.NativeModel(description.kind, contact, values)


def difference_quotient(
    model: kernel.NativeModel, unknowns: list[str], name: str, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of the unknowns by Richardson's extrapolation, and how far its last two differ."""
    middle = model.get(name)[0]

    def at(value: float) -> np.ndarray:
        model.set(**{name: value})
        model.evaluate()
        return np.array(model.get(*unknowns))

    rows = []
    for h in step * 0.5 ** np.arange(4):
        rows.append((at(middle + h) - at(middle - h)) / (2.0 * h))
    at(middle)
    for order in (4.0, 16.0):
        rows = [(order * b - a) / (order - 1.0) for a, b in pairwise(rows)]
    return rows[-1], np.abs(rows[-1] - rows[-2])
