"""The law and its table from Python, beside SciPy's interpolators and formulas in Python."""

from __future__ import annotations

from typing import Literal

import numpy as np
import rivals
from compiled import fastsim
from rivals import ERROR, K_HAT, K_HATS
from timing import Case

import contactlib as cl

POINTS = 1_000_000
CONTACTS: tuple[Literal["line"], Literal["elliptic"]] = ("line", "elliptic")
POLACH = cl.Polach.dry()


def check() -> None:
    """Every rival gives the law's values before it is timed.

    Raises
    ------
    AssertionError
        If one does not.
    """
    law, x = cl.CarterGriffith(k_hat=K_HAT), rivals.some_points()
    k_hat = np.random.default_rng(2).uniform(*K_HATS, x.size)
    exact = law.traction_ratio(x)
    for curve in (rivals.linear(law), rivals.cubic_spline(law)):
        np.testing.assert_allclose(curve(x), exact, rtol=0.0, atol=ERROR)
    slope = rivals.cubic_spline(law)(x, 1)
    np.testing.assert_allclose(slope, law.slope(x), rtol=0.0, atol=2e-3)
    both = cl.carter_griffith_table(contact="line").traction_ratio(x, k_hat)
    surface = rivals.bivariate_spline().ev
    np.testing.assert_allclose(surface(x, k_hat), both, rtol=0.0, atol=ERROR)
    formula = rivals.polach_in_python(POLACH)
    found = [formula(v) for v in x.tolist()]
    np.testing.assert_allclose(found, POLACH.traction_ratio(x), rtol=1e-13)


def cases(points: int = POINTS) -> list[Case]:
    """What is timed."""
    curves = [_curve(points, order) for order in ("random", "sorted")]
    return [_law(min(points, 1000)), *curves, _surface(points), _scalar()]


def _law(points: int) -> Case:
    """The law is solved only to make a table; FASTSIM would be solved at every step."""
    x = np.random.default_rng(0).uniform(0.0, 3.0, points)
    rates = np.column_stack([x, np.zeros((points, 3))])
    line, ellipse = (cl.CarterGriffith(k_hat=K_HAT, contact=c) for c in CONTACTS)
    return Case(
        "law, solved in Python",
        points,
        "us",
        {
            "line": lambda: line.evaluate(x),
            "ellipse": lambda: ellipse.evaluate(x),
            "FASTSIM in C, 20 x 20": lambda: fastsim(rates, strips=20, elements=20),
        },
        ours=2,
    )


def _curve(points: int, order: str) -> Case:
    """Over creepage alone."""
    x = np.random.default_rng(0).uniform(0.0, rivals.END, points)
    if order == "sorted":
        x.sort()
    law = cl.CarterGriffith(k_hat=K_HAT)
    line, ellipse = (cl.carter_griffith_table(contact=c) for c in CONTACTS)
    spline, straight = rivals.cubic_spline(law), rivals.linear(law)
    return Case(
        f"value and slope at {points} {order} x, one k_hat",
        points,
        "ns",
        {
            "line table": lambda: line.evaluate(x, K_HAT),
            "elliptic table": lambda: ellipse.evaluate(x, K_HAT),
            "CubicSpline, value": lambda: spline(x),
            "CubicSpline, value and slope": lambda: (spline(x), spline(x, 1)),
            "np.interp, value": lambda: straight(x),
        },
        {"CubicSpline, value": ">= 5"},
        ours=2,
    )


def _surface(points: int) -> Case:
    """Over creepage and k_hat."""
    random = np.random.default_rng(0)
    x, k_hat = random.uniform(0.0, rivals.END, points), random.uniform(*K_HATS, points)
    line, ellipse = (cl.carter_griffith_table(contact=c) for c in CONTACTS)
    spline = rivals.bivariate_spline()
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
    law = cl.CarterGriffith(k_hat=K_HAT)
    table = cl.carter_griffith_table(contact="line")
    element = cl.load_model("roller_rig.toml").wheelset.element
    nodes = np.linspace(0.0, rivals.END, 513)
    values = law.traction_ratio(nodes)
    formula, spline = rivals.polach_in_python(POLACH), rivals.cubic_spline(law)
    return Case(
        "one call from Python",
        1.0,
        "us",
        {
            "table.traction_ratio": lambda: table.traction_ratio(0.7, 0.3),
            "element.force": lambda: element.force(omega=20.1, speed=10.0),
            "law.traction_ratio": lambda: law.traction_ratio(0.7),
            "np.interp": lambda: np.interp(0.7, nodes, values),
            "CubicSpline": lambda: spline(0.7),
            "Polach in Python": lambda: formula(0.7),
        },
        {"np.interp": ">= 1"},
        ours=3,
    )
