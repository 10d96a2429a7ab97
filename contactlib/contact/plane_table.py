"""What spin adds to the force in the plane, as the kernel's spline over three creepages.

The file holds the spline's coefficients for some ellipses and Poisson's ratios;
`contactlib.contact.plane_table_building` makes it and has the theory.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import PACKAGE
from contactlib.contact import kernel
from contactlib.contact.kalker import kalker_coefficients

ASPECTS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # a/b, evenly spaced in its logarithm
POISSON_RATIOS = (0.0, 0.25, 0.5)
CELLS = 16  # of each creepage, PLANE_CELLS in fmu/plane_law.h
# Along rolling and in spin the file has one half, as the other is its mirror image.
SHAPE = (CELLS // 2 + 3, CELLS + 3, CELLS // 2 + 3, 3)
MAGIC, VERSION = b"PLANETAB", 1
FILE = PACKAGE / "contact" / "tables" / "plane.bin"


def plane_coefficients(poisson_ratio: float) -> FloatArray:
    """Coefficients of the spline, interpolated over Poisson's ratio.

    Parameters
    ----------
    poisson_ratio : float
        nu of both bodies [1], from 0 to 0.5.

    Returns
    -------
    ndarray, shape (7, 11, 19, 11, 3)
        For each of `ASPECTS`, over the creepages along and across rolling and the spin, the
        coefficients of force along and across and of the moment. Read-only.

    Raises
    ------
    ValueError
        If the file is damaged or of another version.
    OSError
        If it cannot be read.
    """
    return _over_poisson_ratios(float(poisson_ratio), FILE)


@lru_cache(maxsize=8)
def _over_poisson_ratios(nu: float, file: Path) -> FloatArray:
    knots, weights = np.array(POISSON_RATIOS), []
    for i, knot in enumerate(knots):
        others = np.delete(knots, i)
        weights.append(np.prod((nu - others) / (knot - others)))
    mixed = np.tensordot(weights, _stored(file), 1)
    # Without spin force is the closed form's to the last digit, not only to the file's.
    mixed[..., 1, :2] = -0.25 * (mixed[..., 0, :2] + mixed[..., 2, :2])
    mixed.flags.writeable = False
    return mixed


@lru_cache(maxsize=1)
def _stored(file: Path) -> FloatArray:
    data = file.read_bytes()
    values = np.frombuffer(data[24:].ljust(4), "<f4", (len(data) - 24) // 4)
    shape = (len(POISSON_RATIOS), len(ASPECTS), *SHAPE)
    if data != kernel.framed(MAGIC, VERSION, data[24:]) or values.size != np.prod(shape):
        raise ValueError(f"{file} is damaged or of another version: install contactlib again")
    return values.reshape(shape).astype(np.float64)


def spin_scale(a_over_b: float, poisson_ratio: float) -> float:
    """Normalized spin per spin in units of f_d N/(G (a b)**1.5).

    Spin weighs as much as the mean of the creepages that it makes half a semi-axis away from
    the centre.
    """
    c = kalker_coefficients(a_over_b, poisson_ratio)
    mean = np.sqrt((c.c11**2 / a_over_b + c.c22**2 * a_over_b) / 2.0)
    return float(mean / (0.75 * np.pi) / 2.0)


def plane_scales(a_over_b: float, poisson_ratio: float) -> FloatArray:
    """Normalized creepages per creepage along and across rolling and spin, shape (3,).

    Creepages are in units of f_d N/(G a b), spin in that of `spin_scale`. A normalized creepage
    has the sign of its force, so Kalker's is minus this times it.
    """
    c = kalker_coefficients(a_over_b, poisson_ratio)
    spin = spin_scale(a_over_b, poisson_ratio)
    return np.array([c.c11 / (0.75 * np.pi), c.c22 / (0.75 * np.pi), spin])
