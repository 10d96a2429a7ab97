"""Memory of a contact with a layer: the kernel's closed forms against half-spaces with springs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import elliprd, elliprf
from transient_rolling import Contact

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray

LAYERS = (0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # L E* / (2 a)
LAYER_LENGTH = 3.0 * math.pi / 16.0  # of a layer between rigid bodies that touch in an ellipse


def full_stick(grid: Contact) -> FloatArray:
    """Lag over a and stiffness at standstill with each layer, where nothing slips.

    At the creepage t the traction is `steady` t - `late`. A particle displaces as the one ahead of
    it did a step ago, when the creepage was less by a step, and collects the mean creepage.
    """
    size, found = grid.x.size, []
    ahead = np.eye(size)[grid.ahead]
    ahead[grid.first] = 0.0  # no traction at the leading edge, so a layer is at rest there
    before = ahead @ grid.influence
    before[grid.first] = 0.5 * grid.at_edge
    for layer in LAYERS:
        carried = before + layer * ahead
        system = -(carried + grid.change - layer * np.eye(size))
        steady = np.linalg.solve(system, grid.rolled)
        late = np.linalg.solve(system, grid.step * (0.5 * grid.rolled + carried @ steady))
        standing = np.linalg.solve(grid.influence + layer * np.eye(size), np.ones(size))
        found.append((grid.weight @ late / (grid.weight @ steady), grid.weight @ standing))
    return np.array(found)


def solved(a_over_b: float, nu: float, way: str, columns: int, rows: int, line: bool) -> FloatArray:
    """The same, extrapolated from grids of so many columns and of twice as many."""
    coarse, fine = (
        full_stick(Contact(a_over_b, nu, n, rows, way, way, line=line))
        for n in (columns, 2 * columns)
    )
    return np.asarray(2.0 * fine - coarse)


def closed(a_over_b: float, nu: float, way: str, line: bool) -> FloatArray:
    """Length along or across and stiffness at standstill by the kernel, with each layer."""
    table = cl.carter_griffith_table("line" if line else "elliptic")
    rolling = 1.0 if line else kernel.half_space_scales(a_over_b, nu).stiffness_x
    slopes = [table.slope(0.0, 0.0, rolling * layer) for layer in LAYERS]
    found = [
        kernel.contact_memory(not line, a_over_b, nu, layer, float(slopes[0] / slope) - 1.0)
        for layer, slope in zip(LAYERS, slopes, strict=True)
    ]
    name = "relaxation_length" if way == "x" else "lateral_relaxation_length"
    return np.array([(getattr(one, name), one.standing_stiffness) for one in found])


def errors(
    a_over_b: float, nu: float, way: str, columns: int, rows: int, line: bool = False
) -> FloatArray:
    """Relative errors, layers down, of length and stiffness at standstill with a layer."""
    reference = solved(a_over_b, nu, way, columns, rows, line)
    return np.abs(closed(a_over_b, nu, way, line) / reference - 1.0)[1:]


@pytest.mark.parametrize("aspect", [0.5, 1.7])
def test_of_an_ellipse_with_a_layer(aspect: float) -> None:
    length, standing = errors(aspect, 0.28, "x", 24, 6).T.max(axis=1)
    assert length < 0.01
    assert standing < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("aspect", [0.5, 0.7, 1.0, 1.4, 1.7, 2.0])
@pytest.mark.parametrize("nu", [0.0, 0.28, 0.5])
def test_of_any_ellipse_with_a_layer(aspect: float, nu: float) -> None:
    length, standing = errors(aspect, nu, "x", 48, 8).T.max(axis=1)
    assert length < (0.02 if nu == 0.5 else 0.01)
    assert standing < 0.003
    assert errors(aspect, nu, "y", 48, 8)[:, 0].max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [8.0, 24.0])
def test_of_a_line_contact_with_a_layer(ratio: float) -> None:
    """Part of the errors is that of one state along the length."""
    length, standing = errors(2.0 / ratio, 0.28, "x", 48, 6, line=True).T.max(axis=1)
    assert length < 0.02
    assert standing < 0.015
    assert errors(2.0 / ratio, 0.28, "y", 48, 6, line=True)[:, 0].max() < 0.03


@pytest.mark.parametrize("aspect", [0.05, 0.5, 1.0, 3.0, 20.0])
@pytest.mark.parametrize("nu", [0.0, 0.28, 0.5])
def test_bodies_are_those_of_mindlin(aspect: float, nu: float) -> None:
    found, g = kernel.contact_memory(True, aspect, nu), aspect * aspect
    sine = elliprd(0.0, g, 1.0) / 3.0  # integral of sin^2/sqrt(cos^2 + g sin^2)
    cosine = elliprf(0.0, g, 1.0) - sine
    mindlin = 3.0 * (1.0 - nu) / (cosine + (1.0 - nu) * sine)
    assert found.standing_stiffness == pytest.approx(mindlin, rel=1e-12)
    lengths = kernel.relaxation_lengths(aspect, nu)
    found_lengths = found.relaxation_length, found.lateral_relaxation_length
    assert found_lengths == pytest.approx(lengths[:2], rel=1e-14)


@pytest.mark.parametrize("nu", [0.0, 0.28, 0.5])
@pytest.mark.parametrize("ratio", [4.0, 10.0, 300.0])
def test_bodies_of_a_line_contact(ratio: float, nu: float) -> None:
    found, e = kernel.contact_memory(False, 2.0 / ratio, nu), nu / (1.0 - nu)
    assert 2.0 / found.standing_stiffness == pytest.approx(math.log(4.0 * ratio) - 1.0 + e)
    lag, share = math.log(4.0 * ratio) - 1.5, 8.0 / (math.pi**2 * ratio)
    lag, c = lag - nu, 1.0 + nu
    expected = lag + share * c * (lag + 5.0 / 3.0)
    assert found.lateral_relaxation_length == pytest.approx(expected)


@pytest.mark.parametrize(("elliptic", "stiffness"), [(True, 1.5), (False, 4.0 / math.pi)])
def test_limits_of_a_layer(elliptic: bool, stiffness: float) -> None:
    bodies = kernel.contact_memory(elliptic, 0.5, 0.28)
    stiff = kernel.contact_memory(elliptic, 0.5, 0.28, 1e-12, 1e-12)
    for name in ("relaxation_length", "lateral_relaxation_length", "standing_stiffness"):
        assert getattr(stiff, name) == pytest.approx(getattr(bodies, name), rel=1e-10)
    soft = kernel.contact_memory(elliptic, 0.5, 0.28, 1e6, 1e6)
    length = LAYER_LENGTH if elliptic else 2.0 / 3.0
    assert soft.relaxation_length == pytest.approx(length, rel=1e-5)
    assert soft.lateral_relaxation_length == pytest.approx(length, rel=1e-5)
    assert soft.standing_stiffness * 1e6 == pytest.approx(stiffness, rel=1e-5)
    # What is left is the displacement of the bodies by a uniform traction.
    left = 1.0 / soft.standing_stiffness - 1e6 / stiffness
    fixed = 1.0 / bodies.standing_stiffness
    uniform = 32.0 / (3.0 * math.pi**2) * fixed if elliptic else fixed + 0.75 - math.log(2.0)
    assert left == pytest.approx(uniform, rel=1e-5)


@pytest.mark.parametrize(("elliptic", "limits"), [(True, (0.05, 20.0)), (False, (1e-9, 0.5))])
def test_shapes_are_held_within_their_range(elliptic: bool, limits: tuple[float, float]) -> None:
    def values(a_over_b: float) -> list[float]:
        found = kernel.contact_memory(elliptic, a_over_b, 0.28, 0.3, 0.5)
        return [
            found.relaxation_length,
            found.lateral_relaxation_length,
            found.standing_stiffness,
        ]

    assert values(2.0 * limits[1]) == values(limits[1])
    if elliptic:
        assert values(0.5 * limits[0]) == values(limits[0])


def test_a_softer_layer_yields_more_and_lags_less() -> None:
    for elliptic in (True, False):
        layers = np.geomspace(1e-6, 1e6, 200)
        found = [kernel.contact_memory(elliptic, 0.4, 0.3, lam, 2.0 * lam) for lam in layers]
        for name in ("relaxation_length", "lateral_relaxation_length", "standing_stiffness"):
            assert (np.diff([getattr(one, name) for one in found]) < 0.0).all()
