"""Sampling of a law with a corner, against functions that are known in full."""

from __future__ import annotations

import numpy as np
import pytest

from contactlib.base.quantities import FloatArray
from contactlib.table.corner_sampling import (
    LOWEST,
    CornerRow,
    CornerSamples,
    nodes,
    root_k_nodes,
    value,
)


def known(u: FloatArray, root_k: float, power: float) -> FloatArray:
    """A corner that moves with root_k, and the tail's half power."""
    z = np.maximum(corner(root_k) - u, 0.0)
    singular = z**power * np.log(np.where(z > 0.0, z, 1.0))
    return np.asarray((1.0 - u) ** 2.5 * np.cos(u + root_k) + singular)


def corner(root_k: float) -> float:
    return 1.0 / (1.0 + root_k)


@pytest.mark.parametrize("power", [2.0, 2.5])
def test_samples_give_a_function_with_a_corner_everywhere(power: float) -> None:
    largest = np.sqrt(2.0)
    rows = []
    for root_k in root_k_nodes(largest):
        below, beyond = (known(u, root_k, power) for u in nodes(corner(root_k)))
        rows.append(CornerRow(corner(root_k), below, beyond))
    samples = CornerSamples(rows, largest)
    u = np.linspace(0.0, 1.0, 1001, endpoint=False)
    for root_k in (LOWEST, 0.02, 0.3, 0.9, 1.3, largest):
        row = samples.at(root_k)
        assert row.place == pytest.approx(corner(root_k), abs=1e-13)
        np.testing.assert_allclose(value(row, u), known(u, root_k, power), atol=2e-10)
        either = corner(root_k) + 1e-9 * np.array([-1.0, 1.0])
        np.testing.assert_allclose(value(row, either), known(either, root_k, power), atol=2e-10)
