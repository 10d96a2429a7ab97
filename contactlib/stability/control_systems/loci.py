"""Root locus of the closed loop, and Nyquist curve with the count of unstable poles."""

from __future__ import annotations

import math
import warnings
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from contactlib.base.quantities import (
    FINITE,
    POSITIVE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    derived,
    shown,
)

if TYPE_CHECKING:
    from control import StateSpace

ComplexArray = NDArray[np.complex128]

POINTS = 2000  # frequencies, between which a cubic spline gives the margins
BEYOND = 300.0  # factor of the frequency range beyond the slowest and the fastest pole


class RootLocus(NamedTuple):
    """Closed-loop poles over the gain.

    Attributes
    ----------
    gains : ndarray, shape (n,)
        Factors on the open loop, rising.
    poles : ndarray, shape (n, order)
        One row per gain, one column per branch [1/s], or in z if sampled.
    growth : ndarray, shape (n,)
        Growth rate of the least stable pole [1/s].
    critical_gains : tuple of float
        Gains at which the growth changes sign.
    """

    gains: FloatArray
    poles: ComplexArray
    growth: FloatArray
    critical_gains: tuple[float, ...]


def growth_rate(poles: ArrayLike, sample_time: float = 0.0) -> float:
    """Largest growth rate of the poles [1/s]: Re s, or log|z|/h of a sampled loop."""
    roots = np.asarray(poles, dtype=np.complex128)
    if roots.size == 0 or not np.isfinite(roots).all():
        raise ValueError(f"poles = {shown(poles)} must be finite numbers, at least one")
    sample_time = checked_number("sample_time", sample_time, Limits(at_least=0.0))
    if sample_time == 0.0:
        return float(roots.real.max())
    size = float(np.abs(roots).max())
    if size == 0.0:
        return -math.inf
    largest = math.log(size)
    return derived(
        "growth rate", lambda: largest / sample_time, {"sample_time": sample_time}, FINITE
    )


def root_locus(loop: StateSpace, gains: ArrayLike) -> RootLocus:
    """Closed-loop poles for factors on an open loop.

    Parameters
    ----------
    loop : control.StateSpace
        Open loop; with `proportional_gain` 1 the factors are gains [N.m].
    gains : array_like, shape (n,)
        Positive rising factors. Stability lost and regained between two of them is not noticed.

    Raises
    ------
    ValueError
        If a gain is not positive, or the gains do not rise.
    """
    import control

    factors = np.atleast_1d(checked("gains", gains, POSITIVE))
    if factors.ndim != 1 or factors.size == 0 or (np.diff(factors) <= 0.0).any():
        raise ValueError(f"gains = {shown(factors)} must be one row that rises")

    def growth(gain: float) -> float:
        """Growth rate from eigenvalues: roots of a polynomial are inaccurate near z = 1."""
        return growth_rate(control.feedback(gain * loop, 1.0).poles(), loop.dt)

    found = control.root_locus_map(loop, factors)
    rates = np.array([growth(gain) for gain in factors])
    critical = [
        float(brentq(growth, a, b, xtol=1e-12 * a))
        for (a, b), (at_a, at_b) in zip(pairwise(factors), pairwise(rates), strict=True)
        if at_a * at_b < 0.0
    ]
    return RootLocus(factors, found.loci, rates, tuple(critical))


def frequencies(loop: StateSpace) -> FloatArray:
    """Angular frequencies that cover the poles of a loop and of its closed loop [rad/s].

    Zeros are left out: some are lost to rounding, and far beyond the fastest pole they turn no
    curve near -1.
    """
    import control

    features = np.concatenate([loop.poles(), control.feedback(loop, 1.0).poles()])
    if loop.dt:
        features = np.log(features[np.abs(features) > 1e-9]) / loop.dt
    sizes = np.abs(features)
    sizes = sizes[sizes > 1e-9 * sizes.max()]
    slowest, fastest = sizes.min() / BEYOND, sizes.max() * BEYOND
    if loop.dt:
        fastest = math.pi / loop.dt
    return np.geomspace(min(slowest, 0.1 * fastest), fastest, POINTS)


class Nyquist(NamedTuple):
    """Nyquist curve of an open loop: Z = N + P.

    Attributes
    ----------
    frequency : ndarray, shape (n,)
        Angular frequency along the upper half of the contour [rad/s].
    response : ndarray, shape (n,)
        Response of the open loop [1].
    encirclements : int
        N, the clockwise encirclements of -1.
    unstable_poles : int
        P, the unstable poles of the open loop.
    unstable_closed_loop_poles : int
        Z, the unstable poles of the closed loop, from the encirclements.
    """

    frequency: FloatArray
    response: ComplexArray
    encirclements: int
    unstable_poles: int
    unstable_closed_loop_poles: int

    @property
    def stable(self) -> bool:
        """Whether the closed loop is stable."""
        return self.unstable_closed_loop_poles == 0


def nyquist(loop: StateSpace) -> Nyquist:
    """Nyquist curve and its encirclements of -1.

    A pole on the stability boundary, such as an integrator, is left on the stable side.

    Raises
    ------
    ValueError
        If the curve passes too close to -1 to count its encirclements.
    """
    import control

    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", DeprecationWarning)  # not about the curve
        (curve,) = control.nyquist_response([loop], np.append(0.0, frequencies(loop)))
    if doubts:
        raise ValueError(f"the encirclements of -1 cannot be counted: {doubts[0].message}")
    poles = loop.poles()
    unstable = int((poles.real > 0.0).sum() if loop.dt == 0.0 else (np.abs(poles) > 1.0).sum())
    contour = np.asarray(curve.contour, dtype=np.complex128)
    frequency = contour.imag if loop.dt == 0.0 else np.angle(contour) / loop.dt
    return Nyquist(
        frequency, np.asarray(curve.response), curve.count, unstable, curve.count + unstable
    )
