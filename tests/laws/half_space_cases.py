"""Values of the half-space code CONTACT in three dimensions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contactlib.base.quantities import FloatArray


def contact_cases(name: str, **chosen: float | str) -> Any:
    """Rows of CONTACT's values, "coulomb" or "slip_weakening", as a record array."""
    path = Path(__file__).with_name(f"contact_3d_{name}.csv")
    rows = np.genfromtxt(
        path, delimiter=",", names=True, dtype=None, encoding="ascii", skip_header=7
    )
    for column, value in chosen.items():
        rows = rows[rows[column] == value]
    assert rows.size
    return rows


def forces_of(rows: Any) -> FloatArray:
    """f_x, f_y and m_z of rows, in the variables of the solver in tools/half_space.py."""
    return np.stack([rows["fx"], rows["fy"], rows["mz"]], axis=1)


def creepages_of(rows: Any) -> FloatArray:
    """Creepages and spin of rows, in the same variables."""
    kinetic = rows["mu" if "mu" in rows.dtype.names else "f_d"]
    unit, side = rows["G"] * rows["a"] * rows["b"] / (kinetic * rows["N"]), side_of(rows)
    return np.stack([unit * rows["cksi"], unit * rows["ceta"], unit * side * rows["cphi"]], axis=1)


def side_of(rows: Any) -> FloatArray:
    """Unit of length, sqrt(a b) [m]."""
    return np.asarray(np.sqrt(rows["a"] * rows["b"]))
