"""Contribution of spin to forces and moment, as the kernel's splines over three creepages.

The file holds the splines' coefficients for some ellipses and, without weakening, for some of
Poisson's ratios; `tools/lateral_spin_building.py` computes it and describes the theory.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import PACKAGE

ASPECTS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # a/b, evenly spaced in its logarithm
POISSON_RATIOS = (0.0, 0.25, 0.5)
MAGIC, VERSION = b"PLANETAB", 2
FILE = PACKAGE / "table" / "data" / "lateral_spin.bin"


def lateral_spin_coefficients(poisson_ratio: float) -> FloatArray:
    """Coefficients of the splines, interpolated over Poisson's ratio.

    Parameters
    ----------
    poisson_ratio : float
        nu of both bodies [1], from 0 to 0.5.

    Returns
    -------
    ndarray, shape (7, LATERAL_SPIN_COEFFICIENTS)
        For each of `ASPECTS` a set of coefficients in the order of
        `fmu/kernel/lateral_spin_law.h`. Read-only.

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
    of_spin, of_weakening = _stored(file)
    sets = coefficient_sets(np.tensordot(weights, of_spin, 1), of_weakening)
    sets.flags.writeable = False
    return sets


def forget_coefficients() -> None:
    """Read the file again when it is needed next."""
    _stored.cache_clear()
    _over_poisson_ratios.cache_clear()


def stored_shapes() -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Shapes of the coefficients for one ellipse, without weakening and of its two terms.

    Along rolling and in spin there is one half, as the other is its mirror image.
    """
    _, cells = kernel.lateral_spin_sizes()
    places = (cells // 2 + 3, cells + 3, cells // 2 + 3)
    return (*places, 3), (*places, 6)


def coefficient_sets(of_spin: FloatArray, of_weakening: FloatArray) -> FloatArray:
    """Sets of coefficients in the kernel's layout, of any number of ellipses.

    Parameters
    ----------
    of_spin, of_weakening : ndarray
        Each of one shape of `stored_shapes`, with the same further axes in front.
    """
    _, cells = kernel.lateral_spin_sizes()
    whole, flat = [], []
    for part in (of_spin.copy(), of_weakening.copy()):
        forces = np.arange(part.shape[-1]) % 3 < 2
        first, middle, last = (part[..., k, :] for k in range(3))
        # Without spin force is the closed form's to the last digit, not only to the file's.
        middle[..., forces] = -0.25 * (first + last)[..., forces]
        moment = ((first + 4.0 * middle + last) / 6.0)[..., ~forces]
        slopes = (0.25 * cells) * (last - first).reshape(*moment.shape, 3)
        numbers = np.concatenate((moment[..., np.newaxis], slopes), axis=-1)
        whole.append(part.reshape(*part.shape[:-4], -1))
        flat.append(numbers.reshape(*part.shape[:-4], -1))
    return np.concatenate(whole + flat, axis=-1)


@lru_cache(maxsize=1)
def _stored(file: Path) -> tuple[FloatArray, FloatArray]:
    data = file.read_bytes()
    values = np.frombuffer(data[24:].ljust(4), "<f4", (len(data) - 24) // 4)
    of_spin, of_weakening = stored_shapes()
    shapes = (len(POISSON_RATIOS), len(ASPECTS), *of_spin), (len(ASPECTS), *of_weakening)
    sizes = [int(np.prod(shape)) for shape in shapes]
    if data != kernel.framed(MAGIC, VERSION, data[24:]) or values.size != sum(sizes):
        raise ValueError(f"{file} is damaged or of another version: install contactlib again")
    first, second = np.split(values.astype(np.float64), sizes[:1])
    return first.reshape(shapes[0]), second.reshape(shapes[1])


def lateral_spin_scales(a_over_b: float, poisson_ratio: float) -> FloatArray:
    """Normalized creepages per creepage along and across rolling and spin, shape (3,).

    Creepages are in units of f_d N/(G a b), spin in that of `spin_scale` in
    `fmu/kernel/half_space.h`. A normalized creepage has the sign of its force, so Kalker's is minus
    this times it.
    """
    scales = kernel.half_space_scales(a_over_b, poisson_ratio)
    unit = 0.75 * np.pi
    return np.array([scales.c11 / unit, scales.c22 / unit, scales.spin_scale])
