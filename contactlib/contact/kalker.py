"""Kalker's creep coefficients of an elliptic contact, and what they make of the strips' scales.

The coefficients are those of `contactlib.contact.stick_rolling`, which solves the problem to about
3e-5; its values at Chebyshev points of ln(a/b) and of Poisson's ratio are shipped, and
interpolated here to 1e-6.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FloatArray, Limits, checked, common_shape
from contactlib.base.writing import PACKAGE

TABLE = PACKAGE / "contact" / "tables" / "kalker.csv"
A_OVER_B = Limits(at_least=0.05, at_most=20.0)
POISSON_RATIO = Limits(at_least=0.0, at_most=0.5)
NODES = (24, 12)  # of ln(a/b), from -3 to 3, and of nu
ORDERS = tuple(np.arange(n) for n in NODES)
COS2, SIN2 = (part((np.arange(64) + 0.5) * math.pi / 64) ** 2 for part in (np.cos, np.sin))


class KalkerCoefficients(NamedTuple):
    """Kalker's creep coefficients, of the shape of the arguments [1]."""

    c11: FloatArray
    c22: FloatArray
    c23: FloatArray
    c33: FloatArray


class HalfSpaceScales(NamedTuple):
    """What an ellipse on a half-space changes of strip theory, in rolling direction and across it.

    Stiffness is the initial slope of the force over that of strips; softening is c in
    x_eff = s x (1 - c s x), the creepage at which strips give the force, with s the stiffness.
    """

    stiffness_x: FloatArray
    stiffness_y: FloatArray
    softening_x: FloatArray
    softening_y: FloatArray


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

    The error is below 1e-4 of each value. For a short contact, a/b -> 0, they tend to those of
    independent strips: c11 to pi**2/(4 (1-nu)), c22 to pi**2/4, c33 to
    pi**2/(16 (1-nu) a/b).

    Examples
    --------
    >>> c = kalker_coefficients(1.0, 0.28)
    >>> c.c11.round(3), c.c22.round(3), c.c23.round(3), c.c33.round(3)
    (4.219, 3.704, 1.484, 1.181)
    """
    values, _, _ = _interpolated(a_over_b, poisson_ratio)
    return KalkerCoefficients(*values)


def half_space_scales(a_over_b: ArrayLike, poisson_ratio: ArrayLike) -> HalfSpaceScales:
    """Stiffness and softening of an ellipse against strips; arguments as `kalker_coefficients`.

    Strips have c11 = pi**2/(4 (1-nu)) and c22 = pi**2/4, which gives the stiffnesses s. The
    softening follows from the creepage at which stick vanishes. It is the largest strain of the
    ellipse under the traction of full slip; in units of the strips' zeta0, with g = a/b,

        x_sat = g**2/(2 (1-nu)) int_0^pi (1 - nu sin(t)**2) sin(t)**2/D**3 dt
        y_sat = g**2/2 int_0^pi (1 - nu cos(t)**2) sin(t)**2/D**3 dt
        D**2 = cos(t)**2 + g**2 sin(t)**2

    and x_eff must be 1 there: c = (1 - 1/X)/X with X = s_x x_sat, or s_y y_sat.
    """
    (c11, c22, _, _), g, nu = _interpolated(a_over_b, poisson_ratio)
    stiffness_x, stiffness_y = c11 * (1.0 - nu) * (4.0 / math.pi**2), c22 * (4.0 / math.pi**2)
    # With tan(phi) = sqrt(g) tan(t) the integrands are smooth for any g.
    g = g[..., np.newaxis]
    on_circle = g * COS2 + SIN2  # cos(t)**2 = g cos(phi)**2/on_circle
    weight = g / np.sqrt(on_circle * (COS2 + g * SIN2) ** 3) * (0.5 * SIN2 * math.pi / SIN2.size)
    whole, along = weight.sum(-1), (weight * SIN2 / on_circle).sum(-1)
    at_x = stiffness_x * (whole - nu * along) / (1.0 - nu)
    at_y = stiffness_y * (whole - nu * (whole - along))
    softening = [(1.0 - 1.0 / at) / at for at in (at_x, at_y)]
    return HalfSpaceScales(stiffness_x, stiffness_y, *softening)


def _interpolated(
    a_over_b: ArrayLike, poisson_ratio: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The four coefficients, stacked, and both arguments as arrays of the common shape."""
    g = checked("a_over_b", a_over_b, A_OVER_B)
    nu = checked("poisson_ratio", poisson_ratio, POISSON_RATIO)
    if g.shape != nu.shape:
        shape = common_shape({"a_over_b": g, "poisson_ratio": nu})
        g, nu = np.broadcast_to(g, shape), np.broadcast_to(nu, shape)
    in_g = np.cos(ORDERS[0] * np.arccos(np.log(g) / 3.0)[..., np.newaxis])
    in_nu = np.cos(ORDERS[1] * np.arccos(4.0 * nu - 1.0)[..., np.newaxis])
    of_nu = (in_g @ _series()).reshape(*g.shape, 4, NODES[1])
    logs = (of_nu @ in_nu[..., np.newaxis])[..., 0]
    return np.exp(np.moveaxis(logs, -1, 0)), g, nu


def nodes() -> tuple[FloatArray, FloatArray]:
    """Values of a/b and of nu at which the coefficients are shipped: Chebyshev's points."""
    log_g, in_nu = (np.cos((order + 0.5) * math.pi / order.size) for order in ORDERS)
    return np.exp(3.0 * log_g), 0.25 * (1.0 + in_nu)


@lru_cache
def _series() -> FloatArray:
    """Chebyshev coefficients of the logarithms of the shipped values: rows of ln(a/b)."""
    shipped = np.log(np.loadtxt(TABLE, delimiter=",", skiprows=1)[:, 2:]).reshape(*NODES, 4)
    in_g, in_nu = (
        np.cos(np.outer(order, order + 0.5) * math.pi / order.size)
        * np.where(order == 0, 1.0, 2.0)[:, np.newaxis]
        / order.size
        for order in ORDERS
    )
    return np.asarray(np.einsum("ki,lj,ijc->kcl", in_g, in_nu, shipped).reshape(NODES[0], -1))
