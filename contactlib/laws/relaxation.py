"""Rolled distance by which the force of a contact in full stick lags behind its creepage.

The lengths of an ellipse are those of `tools/stick_rolling.py`, as polynomials in the kernel.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import elliprd, elliprf

from contactlib import kernel
from contactlib.base.quantities import FloatArray, Limits, checked, common_shape
from contactlib.laws.kalker import A_OVER_B, POISSON_RATIO

LINE = Limits(at_least=4.0)  # length of a line contact over its semi-width


class RelaxationLengths(NamedTuple):
    """Relaxation lengths over the semi-axis a along rolling [1].

    `longitudinal` is that of the longitudinal force for longitudinal creepage, `lateral` and
    `spin` are those of the lateral force for lateral creepage and for spin.
    """

    longitudinal: FloatArray | float
    lateral: FloatArray | float
    spin: FloatArray | float


def relaxation_lengths(a_over_b: ArrayLike, poisson_ratio: ArrayLike) -> RelaxationLengths:
    """Rolled distances by which the force lags behind small creepages, over a.

    Parameters
    ----------
    a_over_b : array_like
        Semi-axis a of the contact ellipse in the rolling direction over b across it [1], from
        0.05 to 20.
    poisson_ratio : array_like
        nu of both bodies [1], from 0 to 0.5; broadcasts with `a_over_b`.

    Returns
    -------
    RelaxationLengths
        longitudinal, lateral and spin [1], each of the common shape of the arguments.

    Raises
    ------
    ValueError
        If an argument is out of range, or the shapes do not broadcast.

    Notes
    -----
    The two bodies are half-spaces of one material, and nothing slips. A creepage that changes over
    distances much longer than a has a force that is that of steady rolling, this many semi-axes
    earlier. A first-order lag with this length has the same response to slow changes; its response
    to a step is not exactly the contact's. The lag is shorter where part of the contact slips.

    The error is below 1e-4 of each value. For a short contact, a/b -> 0,

        longitudinal = 8/(3 pi) (ln(16 b/a) - 2 + nu/(1-nu)),
        lateral = 8/(3 pi) (ln(16 b/a) - 2 - nu)

    but for terms of the order of a/b. For a long one, a/b -> infinity, with L = ln(16 (a/b)**2),

        longitudinal = 2/3 (1 + (1 + ln(4))/(L - 2 nu)),
        lateral = 2/3 (1 + (1 + ln(4))/(L + 2 nu/(1-nu))),
        spin = 1 + (19/6 - ln(4))/(L + 2 nu/(1-nu))

    but for terms of the order of 1/L**2.

    Examples
    --------
    >>> [round(float(value), 3) for value in relaxation_lengths(1.0, 0.28)]
    [1.463, 1.239, 1.685]
    """
    g = checked("a_over_b", a_over_b, A_OVER_B)
    nu = checked("poisson_ratio", poisson_ratio, POISSON_RATIO)
    common_shape({"a_over_b": g, "poisson_ratio": nu})
    each = np.vectorize(kernel.relaxation_lengths, otypes=[float] * 3)
    return RelaxationLengths(*map(np.asarray, each(g, nu)))


def of_line(length: float, nu: float) -> RelaxationLengths:
    """Lengths of a line contact whose length is in semi-widths; see `LineContact`.

    The mean over its length of Cerruti's displacement by a line of tractions at the distance d is
    that of the logarithm of 2 length/(e d), which gives l, and of d/length, which gives k.
    """

    def along(e: float, c: float) -> float:
        lag = math.log(4.0 * length) - 1.5 + e
        return lag + 8.0 * c / (math.pi**2 * length) * (lag + 5.0 / 3.0)

    longitudinal = along(nu / (1.0 - nu), (1.0 - 2.0 * nu) / (1.0 - nu))
    return RelaxationLengths(longitudinal, along(-nu, 1.0 + nu), 0.0)


class LayerMemory(NamedTuple):
    """A contact that is a layer alone, of rigid bodies: closed forms.

    In full stick traction grows in proportion to the distance from the leading edge. `length` is
    the relaxation length over a, and `stiffness` what a contact at standstill has of q for a
    displacement over a zeta0, times the layer ratio L E*/(2 a).
    """

    length: float
    stiffness: float


LAYER_LINE = LayerMemory(2.0 / 3.0, 4.0 / math.pi)
LAYER_ELLIPSE = LayerMemory(3.0 * math.pi / 16.0, 1.5)


def standing_stiffness(a_over_b: float, nu: float) -> float:
    """Slope dq/d(x s) of an ellipse that stands still in full stick: Mindlin's problem [1].

    x s is the displacement over a zeta0, zeta0 being that of strips. Tractions grow like one over
    the root of the Hertz pressure, and displace the centre by an integral of 1/r over all angles.
    """
    g = a_over_b * a_over_b
    sine = float(elliprd(0.0, g, 1.0)) / 3.0  # integral of sin^2/sqrt(cos^2 + g sin^2)
    cosine = float(elliprf(0.0, g, 1.0)) - sine
    return 3.0 * (1.0 - nu) / (cosine + (1.0 - nu) * sine)
