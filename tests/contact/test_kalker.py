"""Kalker's coefficients: the solver's identities, the shipped table, CONTACT and closed limits."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import elliprd

import contactlib as cl
from contactlib.contact.kalker import half_space_scales
from contactlib.contact.stick_rolling import influence, stick_coefficients

DEGREE = 8  # fast, and accurate to 1e-4


def test_force_of_spin_is_moment_of_lateral_creepage() -> None:
    """Reciprocity, which nothing in the solver knows of."""
    for g in (0.2, 5.0):
        c = stick_coefficients(influence(g, DEGREE), 0.28)
        assert c.c32 == pytest.approx(c.c23, rel=2e-4)


def test_coefficients_without_poissons_effect() -> None:
    """At nu = 0 both directions have one kernel, and c23 a closed form.

    A punch that is tilted about the y axis has the traction x/sqrt(1 - x**2/a**2 - y**2/b**2),
    which is odd in x: its work with the unknown displacements f(y) vanishes, so reciprocity gives
    the moment of lateral creepage.
    """
    for g in (0.1, 1.0, 6.0):
        c = stick_coefficients(influence(g, DEGREE), 0.0)
        assert c.c22 == pytest.approx(c.c11, rel=1e-10)
        assert c.c23 == pytest.approx(math.pi / elliprd(0.0, 1.0 / g, g), rel=1e-5)


def test_table_is_what_the_solver_gives() -> None:
    g, nu = 1.3, 0.3
    solved = stick_coefficients(influence(g, 12), nu)
    assert list(cl.kalker_coefficients(g, nu)) == pytest.approx(
        [solved.c11, solved.c22, solved.c23, solved.c33], rel=2e-5
    )


def test_agreement_with_contact() -> None:
    with open(Path(__file__).with_name("contact_3d_coulomb.csv")) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    linear = [row for row in rows if row.pop("group") == "lin"]
    assert len(linear) == 9
    for row in linear:
        v = {key: float(text) for key, text in row.items()}
        c11, c22, c23, c33 = cl.kalker_coefficients(v["a_over_b"], v["nu"])
        unit = v["G"] * v["a"] * v["b"] / (v["mu"] * v["N"])
        spin = v["cphi"] * math.sqrt(v["a"] * v["b"])
        expected = {
            "fx": -unit * c11 * v["cksi"],
            "fy": -unit * (c22 * v["ceta"] + c23 * spin),
            "mz": unit * (c23 * v["ceta"] - c33 * spin),
        }
        for key, value in expected.items():
            assert v[key] == pytest.approx(value, abs=float(3e-3 * abs(value) + 1e-5))


def test_scales_of_the_half_space() -> None:
    """Values that were found with CONTACT's coefficients."""
    scales = np.array([half_space_scales(g, 0.28) for g in (0.3, 0.5, 1.0, 1.5, 2.0)]).T
    np.testing.assert_allclose(scales[2], [0.013, 0.027, 0.054, 0.071, 0.082], atol=1.5e-3)
    np.testing.assert_allclose(scales[3], [0.032, 0.051, 0.081, 0.095, 0.104], atol=1.5e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, 0.3), "a_over_b = 0.0 is out of range: must be finite and >= 0.05 and <= 20"),
        ((1.0, 0.6), "poisson_ratio = 0.6 is out of range: must be finite and >= 0 and <= 0.5"),
        (([1.0, 2.0], [0.1, 0.2, 0.3]), "the shapes must broadcast together"),
    ],
)
def test_refusals(arguments: tuple[object, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cl.kalker_coefficients(*arguments)  # type: ignore[arg-type]
