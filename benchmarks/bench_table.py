"""The table from Python, beside SciPy's interpolators.

Each rival is made as coarse as the same error allows, so that none is slower than it has to be.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline
from timing import Case

import contactlib as cl
from contactlib.base.quantities import FloatArray

POINTS = 1_000_000
CONTACTS: tuple[Literal["line"], Literal["elliptic"]] = ("line", "elliptic")
ERROR = 1e-6  # of the traction ratio
END = 5.0  # of normalized creepage
K_HAT = 0.3
K_HATS = (0.1, 1.0)  # of what is interpolated over k_hat too
GRID = (1025, 81)  # nodes along both


def some_points(n: int = 20_000) -> FloatArray:
    """Creepages that are no nodes of any grid."""
    return np.random.default_rng(1).uniform(0.0, END, n)


def cubic_spline(law: Any) -> CubicSpline:
    """scipy's, over the fewest nodes, a power of two, at which it misses the law by `ERROR`."""
    x = some_points()
    exact = law.traction_ratio(x)
    for power in range(4, 18):
        nodes = np.linspace(0.0, END, 2**power + 1)
        found = CubicSpline(nodes, law.traction_ratio(nodes))
        if np.abs(found(x) - exact).max() <= ERROR:
            return found
    raise RuntimeError(f"no grid meets {ERROR}")


@cache
def bivariate_spline() -> RectBivariateSpline:
    """scipy's RectBivariateSpline, bicubic; right to `ERROR`."""
    x, k_hat = (np.linspace(*ends, n) for ends, n in zip(((0.0, END), K_HATS), GRID, strict=True))
    values = np.array([cl.CarterGriffith(k_hat=k).traction_ratio(x) for k in k_hat]).T
    return RectBivariateSpline(x, k_hat, values)


def check() -> None:
    """Every rival gives the law's values before it is timed.

    Raises
    ------
    AssertionError
        If one does not.
    """
    law, x = cl.CarterGriffith(k_hat=K_HAT), some_points()
    k_hat = np.random.default_rng(2).uniform(*K_HATS, x.size)
    exact = law.traction_ratio(x)
    spline = cubic_spline(law)
    np.testing.assert_allclose(spline(x), exact, rtol=0.0, atol=ERROR)
    both = cl.carter_griffith_table(contact="line").traction_ratio(x, k_hat)
    surface = bivariate_spline().ev
    np.testing.assert_allclose(surface(x, k_hat), both, rtol=0.0, atol=ERROR)


def cases(points: int = POINTS) -> list[Case]:
    """What is timed."""
    curves = [_curve(points, order) for order in ("random", "sorted")]
    return [*curves, _surface(points), _scalar()]


def _curve(points: int, order: str) -> Case:
    """Over creepage alone."""
    x = np.random.default_rng(0).uniform(0.0, END, points)
    if order == "sorted":
        x.sort()
    line, ellipse = (cl.carter_griffith_table(contact=c) for c in CONTACTS)
    spline = cubic_spline(cl.CarterGriffith(k_hat=K_HAT))
    return Case(
        f"value and slope at {points} {order} x, one k_hat",
        points,
        "ns",
        {
            "line table": lambda: line.evaluate(x, K_HAT),
            "elliptic table": lambda: ellipse.evaluate(x, K_HAT),
            "CubicSpline, value": lambda: spline(x),
        },
        {"CubicSpline, value": ">= 5"},
        ours=2,
    )


def _surface(points: int) -> Case:
    """Over creepage and k_hat."""
    random = np.random.default_rng(0)
    x, k_hat = random.uniform(0.0, END, points), random.uniform(*K_HATS, points)
    line, ellipse = (cl.carter_griffith_table(contact=c) for c in CONTACTS)
    spline = bivariate_spline()
    return Case(
        f"value and slope at {points} random x and k_hat",
        points,
        "ns",
        {
            "line table": lambda: line.evaluate(x, k_hat),
            "elliptic table": lambda: ellipse.evaluate(x, k_hat),
            "RectBivariateSpline.ev, value": lambda: spline.ev(x, k_hat),
        },
        {"RectBivariateSpline.ev, value": ">= 50"},
        ours=2,
    )


def _scalar() -> Case:
    """One point from Python."""
    table = cl.carter_griffith_table(contact="line")
    element = cl.load_model("roller_rig.toml").wheelset.element
    nodes = np.linspace(0.0, END, 513)
    values = cl.CarterGriffith(k_hat=K_HAT).traction_ratio(nodes)
    return Case(
        "one call from Python",
        1.0,
        "us",
        {
            "table.traction_ratio": lambda: table.traction_ratio(0.7, 0.3),
            "element.force": lambda: element.force(omega=20.1, speed=10.0),
            "np.interp": lambda: np.interp(0.7, nodes, values),
        },
        {"np.interp": ">= 1"},
        ours=2,
    )
