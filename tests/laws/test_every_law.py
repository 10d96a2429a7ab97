"""What holds for the curve of every law: odd, of any shape, with its slope, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import pytest

from contactlib import CarterGriffith, CohesiveZone, MeasuredCurve, Polach
from contactlib.base.writing import package_folder
from contactlib.laws.formula import FormulaLaw, formula_laws

Law = CarterGriffith | CohesiveZone | MeasuredCurve | FormulaLaw
RATIO = 0.33 / 0.21
K_HATS = [0.0, 1e-6, 1e-3, 0.03, 0.1, 0.3, 0.5, 1.0, 2.0]
# (k_hat, static_to_kinetic): zones much shorter and much longer than the contact
STATES = [(0.01, RATIO), (0.06, 3.0), (0.3, RATIO), (1.0, 1.5), (1.0, 6.0), (2.0, 1.05)]
COHESIVE: dict[str, Any] = {"k_hat": 0.3, "static_to_kinetic": RATIO}


class Curve(NamedTuple):
    """A law, and how well difference quotients of step h give its slope off a corner."""

    make: Callable[[], Law]
    h: float
    off: float
    atol: float
    secant: float  # relative error of that at the origin


CURVES = {
    **{
        f"Carter-Griffith, line, {k}": Curve(
            partial(CarterGriffith, k_hat=k), 1e-5, 0.3 if k < 1e-2 else 0.05, 1e-9, 1e-11
        )
        for k in K_HATS
    },
    **{
        f"Carter-Griffith, ellipse, {k}": Curve(
            partial(CarterGriffith, k_hat=k, contact="elliptic"), 1e-5, 0.05, 1e-9, 1e-11
        )
        for k in K_HATS
    },
    **{
        f"cohesive, line, {k}, {ratio:.3g}": Curve(
            partial(CohesiveZone, k_hat=k, static_to_kinetic=ratio),
            1e-4,
            0.3 if k < 0.1 else 0.01,
            1e-6,
            1e-7,
        )
        for k, ratio in STATES
    },
    "cohesive, ellipse": Curve(
        partial(CohesiveZone, **COHESIVE, contact="elliptic"),
        1e-3,
        0.1,
        5e-7,
        1e-7,
    ),
    "Polach, dry": Curve(Polach.dry, 1e-4, 0.0, 1e-9, 1e-10),
    **{
        f"{kind}, example": Curve(partial(law, **law.example), 1e-4, 0.0, 1e-9, 1e-10)
        for kind, law in formula_laws().items()
    },
    "measured": Curve(
        partial(MeasuredCurve.from_csv, package_folder("models") / "eurosprinter_engel1998.csv"),
        1e-5,
        0.0,
        1e-6,
        1e-10,
    ),
}


@cache
def law_of(name: str) -> Law:
    return CURVES[name].make()


@pytest.mark.parametrize("name", CURVES)
def test_odd_and_shape_preserving(name: str) -> None:
    law = law_of(name)
    x = np.array([0.0, 1e-300, 0.3, 1.2]).reshape(2, 1, 2)
    q = law.traction_ratio(x)
    assert q.shape == law.slope(x).shape == x.shape
    assert q[0, 0, 0] == 0.0
    np.testing.assert_array_equal(law.traction_ratio(-x), -q)
    np.testing.assert_array_equal(law.slope(-x), law.slope(x))
    assert law.traction_ratio(1).shape == ()
    assert law.traction_ratio(np.empty((0, 2))).shape == (0, 2)


@pytest.mark.parametrize("name", CURVES)
def test_slope_is_the_derivative(name: str) -> None:
    curve, law = CURVES[name], law_of(name)
    initial = float(law.slope(0.0))
    if not isinstance(law, MeasuredCurve | FormulaLaw):  # the elastic one, whatever weakens
        assert initial == pytest.approx(2.0 if law.contact == "line" else 0.75 * np.pi, rel=1e-15)
    assert law.traction_ratio(1e-12) / 1e-12 == pytest.approx(initial, rel=curve.secant)
    corner = law.sliding_creepage if isinstance(law, CohesiveZone) and law.k_hat > 0.1 else 1.0
    x, h = np.random.default_rng(4).uniform(0.05, 4.0, 60), curve.h
    x = x[np.abs(x - corner) > curve.off]
    q = [law.traction_ratio(x + i * h) for i in (-2, -1, 1, 2)]
    five_point = (q[0] - 8.0 * q[1] + 8.0 * q[2] - q[3]) / (12.0 * h)
    np.testing.assert_allclose(law.slope(x), five_point, atol=curve.atol)
