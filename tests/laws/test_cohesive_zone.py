"""The collocation of the slip zone against integrals in closed form."""

from __future__ import annotations

import numpy as np
from scipy.integrate import quad

from contactlib.laws.cohesive_zone import _rules, between_nodes


def test_integrals_of_functions_that_end_like_a_root() -> None:
    y = _rules(48).place
    ending = np.sqrt((1.0 - y) * (1.0 + y))
    # PV int_{-1}^{1} sqrt(1 - s^2)/(s - y) ds = -pi y
    np.testing.assert_allclose(_rules(48).principal @ ending, -y, atol=1e-11)
    np.testing.assert_allclose(
        _rules(48).running @ ending, 0.5 * (y * ending + np.arcsin(y)), atol=1e-14
    )
    assert abs(_rules(48).weight @ ending - 0.25 * np.pi) < 1e-14


def test_a_kink_at_the_stick_boundary_costs_no_digits() -> None:
    # (1 - |s|)^3 is a polynomial in the collocation's variable, though not in y.
    rules = _rules(12)
    integrals = rules.principal @ (1.0 - rules.place) ** 3
    for y, value in zip(rules.place[2:-1], integrals[2:-1], strict=True):
        exact = quad(
            lambda s, y=y: (1.0 - s) ** 3 * 2.0 * y / (s + y), 0.0, 1.0, weight="cauchy", wvar=y
        )[0]
        assert abs(value - exact / np.pi) < 1e-10


def test_between_the_nodes() -> None:
    y = _rules(48).place
    place = np.linspace(0.0, 1.0, 333)
    values = between_nodes(place, np.stack([y**2.5, np.sqrt((1.0 - y) * (1.0 + y))]))
    np.testing.assert_allclose(
        values, [place**2.5, np.sqrt((1.0 - place) * (1.0 + place))], atol=1e-8
    )
