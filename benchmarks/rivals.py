"""What a Python program would take instead of the table: SciPy's interpolators, and formulas.

Each is made as coarse as the same error allows, so that none is slower than it has to be.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicSpline, RectBivariateSpline

from contactlib import CarterGriffith, Polach
from contactlib.base.quantities import FloatArray
from contactlib.contact.laws.polach import GRADIENT

ERROR = 1e-6  # of the traction ratio
END = 5.0  # of normalized creepage
K_HAT = 0.3
K_HATS = (0.1, 1.0)  # of what is interpolated over k_hat too
GRID = (1025, 81)  # nodes along both

Curve = Callable[[FloatArray], FloatArray]


def some_points(n: int = 20_000) -> FloatArray:
    """Creepages that are no nodes of any grid."""
    return np.random.default_rng(1).uniform(0.0, END, n)


def coarsest(build: Callable[[FloatArray, FloatArray], Curve], law: Any) -> Curve:
    """Interpolator of the law over the fewest nodes, a power of two, that misses by `ERROR`."""
    x = some_points()
    exact = law.traction_ratio(x)
    for power in range(4, 18):
        nodes = np.linspace(0.0, END, 2**power + 1)
        found = build(nodes, law.traction_ratio(nodes))
        if np.abs(found(x) - exact).max() <= ERROR:
            return found
    raise RuntimeError(f"no grid meets {ERROR}")


def linear(law: Any) -> Curve:
    """np.interp."""
    return coarsest(lambda nodes, values: lambda x: np.interp(x, nodes, values), law)


def cubic_spline(law: Any) -> CubicSpline:
    """scipy's CubicSpline."""
    found: Any = coarsest(CubicSpline, law)
    return found  # type: ignore[no-any-return]


@cache
def grid(nodes: int, rows: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Creepages, k_hats and the line law's traction ratios at them."""
    x, k_hat = np.linspace(0.0, END, nodes), np.linspace(*K_HATS, rows)
    return x, k_hat, np.array([CarterGriffith(k_hat=k).traction_ratio(x) for k in k_hat]).T


@cache
def bivariate_spline() -> RectBivariateSpline:
    """scipy's RectBivariateSpline, bicubic; right to `ERROR`."""
    return RectBivariateSpline(*grid(*GRID))


def polach_in_python(law: Polach) -> Callable[[float], float]:
    """Polach's traction ratio of one float, with nothing but `math`."""
    adhesion, slip = law.adhesion_reduction * GRADIENT, law.slip_reduction * GRADIENT

    def traction_ratio(x: float) -> float:
        y = adhesion * x
        return 2.0 / math.pi * (y / (1.0 + y * y) + math.atan(slip * x))

    return traction_ratio


def simplified_theory(rate: float) -> float:
    """Force over mu P of Kalker's simplified theory in pure longitudinal creepage, exactly.

    A strip of half-length w sticks from its leading edge until rate (w - xi) meets the bound
    w**2 - xi**2, so at xi = rate - w, and slides behind. Integrated along the strip that is
    2 rate w**2 - rate**2 w + rate**3/6, or 4 w**3/3 where nothing sticks.
    """

    def strip(eta: float) -> float:
        w = math.sqrt(max(0.0, 1.0 - eta * eta))
        if rate >= 2.0 * w:
            return 4.0 / 3.0 * w**3
        return 2.0 * rate * w**2 - rate**2 * w + rate**3 / 6.0

    # The strips beyond this one slide as a whole.
    sliding = math.sqrt(max(0.0, 1.0 - 0.25 * rate**2))
    parts = [(0.0, sliding), (sliding, 1.0)]
    return 4.0 / math.pi * sum(quad(strip, *part, epsabs=1e-13)[0] for part in parts)
