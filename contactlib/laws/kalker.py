"""Kalker's creep coefficients of an elliptic contact, and its scales relative to strip theory.

The coefficients are those of `tools/stick_rolling.py`, which solves the problem to about
3e-5. The kernel has them as polynomials in ln(a/b) and Poisson's ratio, accurate to 3e-6.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.quantities import FloatArray, Quantity, checked, common_shape

A_OVER_B = Quantity("1", at_least=0.05, at_most=20.0)
POISSON_RATIO = Quantity("1", at_least=0.0, at_most=0.5)


class KalkerCoefficients(NamedTuple):
    """Kalker's creep coefficients, of the shape of the arguments [1]."""

    c11: FloatArray
    c22: FloatArray
    c23: FloatArray
    c33: FloatArray


class HalfSpaceScales(NamedTuple):
    """Corrections of strip theory for an ellipse on a half-space, longitudinal and lateral.

    Stiffness is the initial slope of the force over that of strips; softening is c in
    x_eff = s x (1 - c s x), the creepage at which strips give the force, with s the stiffness.
    """

    stiffness_x: float
    stiffness_y: float
    softening_x: float
    softening_y: float


def kalker_coefficients(a_over_b: ArrayLike, poisson_ratio: ArrayLike) -> KalkerCoefficients:
    """Creep coefficients c11, c22, c23 and c33 of two bodies of one material.

    Parameters
    ----------
    a_over_b : array_like
        Semi-axis of the contact ellipse in the rolling direction over that across it [1], from
        0.05 to 20.
    poisson_ratio : array_like
        nu of both bodies [1], from 0 to 0.5; broadcasts with `a_over_b`.

    Returns
    -------
    KalkerCoefficients
        c11, c22, c23 and c33 [1], each of the common shape of the arguments.

    Raises
    ------
    ValueError
        If an argument is out of range, or the shapes do not broadcast.

    Notes
    -----
    With the shear modulus G and small creepages xi, eta and spin phi, in Kalker's signs:

        F_x = -G a b c11 xi
        F_y = -G a b c22 eta - G (a b)**1.5 c23 phi
        M_z =  G (a b)**1.5 c23 eta - G (a b)**2 c33 phi

    The error is below 1e-4 of each value. With g = a/b, the limit of a short contact, g -> 0, is
    that of strips, which c23 couples:

        c11 = pi**2/(4 (1-nu)),    c23 = pi sqrt(g)/(3 (1-nu)) (1 + nu (ln(16/g) - 5)),
        c22 = pi**2/4,             c33 = pi**2/(16 (1-nu) g)

    For a long one, g -> infinity, with L = ln(16 g**2) and D = (1-nu) L - 2 + 4 nu,

        c11 = 2 pi g/(L - 2 nu - 3 + ln(4)),
        c22 = 2 pi g/((1-nu) (L - 3 + ln(4)) + 2 nu),
        c23 = 2 pi g**1.5/(3 D),   c33 = pi/4 (((1-2 nu) L - 2 + 8 nu)/D)**2

    but for terms of the order of 1/L**2 in c11 and c22, and of L/g**2 in c23 and c33.

    Examples
    --------
    >>> [round(float(value), 3) for value in kalker_coefficients(1.0, 0.28)]
    [4.219, 3.704, 1.484, 1.181]
    """
    g = checked("a_over_b", a_over_b, A_OVER_B)
    nu = checked("poisson_ratio", poisson_ratio, POISSON_RATIO)
    common_shape({"a_over_b": g, "poisson_ratio": nu})
    names = KalkerCoefficients._fields
    each = np.vectorize(partial(_members, names=names), otypes=[float] * len(names))
    return KalkerCoefficients(*map(np.asarray, each(g, nu)))


def half_space_scales(a_over_b: float, poisson_ratio: float) -> HalfSpaceScales:
    """Stiffness and softening of an ellipse relative to strips, by `fmu/kernel/half_space.c`.

    Below a/b = 0.05 they are those of 0.05, whose stiffness is that of strips to 0.2 %.
    """
    return HalfSpaceScales(*_members(a_over_b, poisson_ratio, HalfSpaceScales._fields))


def _members(a_over_b: float, poisson_ratio: float, names: tuple[str, ...]) -> tuple[float, ...]:
    scales = kernel.half_space_scales(a_over_b, poisson_ratio)
    return tuple(getattr(scales, name) for name in names)
