"""The law of lateral and spin force, at many points."""

from __future__ import annotations

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.kernel.bodies import half_space_scales
from contactlib.kernel.library import ffi, library, pointer
from contactlib.kernel.tables import NativeTable


def lateral_spin_sizes() -> tuple[int, int]:
    """Number of ratios a/b in the table of lateral and spin force, and of cells of its splines."""
    lib = library()
    return lib.LATERAL_SPIN_ASPECTS, lib.LATERAL_SPIN_CELLS


def lateral_spin_forces(
    table: NativeTable,
    a_over_b: float,
    poisson_ratio: float,
    creepages: FloatArray,
    k_hat: float = 0.0,
    coefficients: FloatArray | None = None,
    *,
    static_ratio: float = 1.0,
    layer_ratio: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Force and moment, and their derivatives by the three creepages, ln(k_hat) and ln(lam).

    `creepages` has the shape (points, 3), and the results have (points, 3) and (points, 3, 5).
    Without `coefficients` spin has no effect, and the moment is zero; `static_ratio` is f_s/f_d.
    """
    scales = half_space_scales(a_over_b, poisson_ratio)
    shape = ffi.new("lateral_spin_shape *")
    shape.stiffness_ratio = scales.c22 / scales.c11
    shape.softening_x, shape.softening_y = scales.softening_x, scales.softening_y
    shape.static_ratio = static_ratio
    if coefficients is not None:
        coefficients = np.ascontiguousarray(coefficients, dtype=np.float64)
        shape.coefficients, shape.sets = pointer(coefficients, "double"), 1
        shape.share[0] = 1.0
    value = ffi.new("lateral_spin_value *")
    forces, derivatives = np.empty((len(creepages), 3)), np.empty((len(creepages), 3, 5))
    for i, creepage in enumerate(np.asarray(creepages, dtype=np.float64).tolist()):
        library().lateral_spin_evaluate(table.struct, shape, creepage, k_hat, layer_ratio, value)
        forces[i] = list(value.force)
        derivatives[i, :, :3] = [list(row) for row in value.by_creepage]
        derivatives[i, :, 3] = list(value.by_log_k)
        derivatives[i, :, 4] = list(value.by_log_layer)
    return forces, derivatives
