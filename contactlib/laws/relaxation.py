"""Rolled distance by which the force of a contact in full stick lags behind its creepage.

The lengths of an ellipse are those of `tools/stick_rolling.py`, as polynomials in the kernel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

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
