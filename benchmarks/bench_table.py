"""The table from Python, beside SciPy's interpolators: ``python benchmarks/bench_table.py``.

Each rival is made as coarse as the same error allows, so that none is slower than it has to be.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline
from timing import Call, compare, one_core

import contactlib as cl
from contactlib.base.quantities import FloatArray

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


def bivariate_spline() -> RectBivariateSpline:
    """scipy's RectBivariateSpline, bicubic; right to `ERROR`."""
    x, k_hat = (np.linspace(*ends, n) for ends, n in zip(((0.0, END), K_HATS), GRID, strict=True))
    values = np.array([cl.CarterGriffith(k_hat=k).traction_ratio(x) for k in k_hat]).T
    return RectBivariateSpline(x, k_hat, values)


def main(points: int = 1_000_000, **how: Any) -> None:
    """Time them."""
    random = np.random.default_rng(0)
    x, k_hat = random.uniform(0.0, END, points), random.uniform(*K_HATS, points)
    line, ellipse = cl.carter_griffith_table("line"), cl.carter_griffith_table("elliptic")
    law = cl.CarterGriffith(k_hat=K_HAT)
    spline, surface = cubic_spline(law), bivariate_spline()
    for order, given in {"random": x, "sorted": np.sort(x)}.items():
        subjects: dict[str, Call] = {
            "line table": partial(line.evaluate, given, K_HAT),
            "elliptic table": partial(ellipse.evaluate, given, K_HAT),
            "CubicSpline, value": partial(spline, given),
        }
        compare(f"value and slope at {points} {order} x", points, "ns", subjects, **how)
    compare(
        f"value and slope at {points} random x and k_hat",
        points,
        "ns",
        {
            "line table": lambda: line.evaluate(x, k_hat),
            "elliptic table": lambda: ellipse.evaluate(x, k_hat),
            "RectBivariateSpline.ev, value": lambda: surface.ev(x, k_hat),
        },
        **how,
    )
    element = cl.load_model("roller_rig.toml").wheelset.element
    nodes = np.linspace(0.0, END, 513)
    values = law.traction_ratio(nodes)
    compare(
        "one call from Python",
        1.0,
        "us",
        {
            "table.traction_ratio": lambda: line.traction_ratio(0.7, 0.3),
            "element.force": lambda: element.force(omega=20.1, speed=10.0),
            "np.interp": lambda: np.interp(0.7, nodes, values),
        },
        **how,
    )


if __name__ == "__main__":
    with one_core():
        main()
