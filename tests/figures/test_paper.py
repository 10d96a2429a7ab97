"""The figures of the paper: what is drawn, read back from the lines, against the equations.

Equation numbers are those of Ciavarella, Romano & Barber; they are written again here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder
from contactlib.figures import CONTACT_PATCH, PAPER_FIGURES

K = 0.3
STATIC, KINETIC = 0.45, 0.21
STABLE, UNSTABLE, CARTER = "Carter-Griffith", "unstable", "Carter,"


class Curve(NamedTuple):
    x: FloatArray
    y: FloatArray


def curve(axes: Axes, label: str) -> Curve:
    """The line of the axes with that label, or the only one whose label begins like that."""
    labels = [str(line.get_label()) for line in axes.lines]
    (found,) = [i for i, name in enumerate(labels) if name == label] or [
        i for i, name in enumerate(labels) if name.startswith(label)
    ]
    return Curve(*np.asarray(axes.lines[found].get_xydata()).T)


def whole(axes: Axes) -> Curve:
    """The Carter-Griffith law, stable and unstable."""
    stable, unstable = curve(axes, STABLE), curve(axes, UNSTABLE)
    assert (stable.x[-1], stable.y[-1]) == (unstable.x[0], unstable.y[0])  # they meet
    return Curve(*(np.append(s, u[1:]) for s, u in zip(stable, unstable, strict=True)))


def equation_18(c: FloatArray) -> FloatArray:
    return np.asarray(1.0 - (1.0 - c) ** 2 / 4.0 + K * (1.0 - c) ** 0.75 * (1.0 + c) ** 0.25)


def equation_19(c: FloatArray) -> FloatArray:
    return np.asarray((1.0 + c) / 2.0 + K * ((1.0 + c) / (1.0 - c)) ** 0.25)


def initial_slope(drawn: Curve) -> float:
    """Of the parabola through the origin and the first two points beyond it."""
    (x1, x2), (y1, y2) = drawn.x[1:3], drawn.y[1:3]
    assert drawn.x[0] == drawn.y[0] == 0.0
    return float((y1 / x1 * x2 - y2 / x2 * x1) / (x2 - x1))


@pytest.fixture(scope="module")
def figures() -> dict[int, Figure]:
    return {number: figure.draw() for number, figure in PAPER_FIGURES.items()}


@pytest.fixture(scope="module")
def axes(figures: dict[int, Figure]) -> dict[int, Axes]:
    return {number: figure.axes[0] for number, figure in figures.items()}


@pytest.mark.slow
def test_figure_1_is_equation_16_at_the_stick_boundary(axes: dict[int, Axes]) -> None:
    c, (xi, traction) = -0.5, curve(axes[1], STABLE)
    away = np.abs(xi - c) > 1e-6
    assert_allclose(xi[[0, -1]], [-1.0, 1.0])
    lead, behind = 1.0 - xi[away], np.maximum(xi[away] - c, 0.0)
    expected = np.sqrt(1.0 - xi[away] ** 2) - np.sqrt(lead * behind)
    intensity = K * (1.0 - c * c) ** 0.25  # Eq. (17)
    with np.errstate(divide="ignore"):
        singular = np.where(behind > 0.0, intensity * np.sqrt(lead / behind / (1.0 - c)), 0.0)
    assert_allclose(traction[away], expected + singular, atol=1e-9)
    # The square-root singularity, and sliding friction on its other side.
    near = (xi > c + 1e-9) & (xi < c + 1e-6)
    assert near.sum() > 10
    assert_allclose(traction[near] * np.sqrt(xi[near] - c), intensity, rtol=4e-3)
    slips = xi < c - 1e-9
    assert_allclose(traction[slips], np.sqrt(1.0 - xi[slips] ** 2), atol=1e-12)


@pytest.mark.slow
def test_figure_1_of_carter_and_of_a_finite_length_is_continuous(axes: dict[int, Axes]) -> None:
    pressure_there = np.sqrt(0.75)
    for label, largest in ((CARTER, 1.0), ("cohesive zone", STATIC / KINETIC)):
        xi, traction = curve(axes[1], label)
        at = int(np.argmax(traction))
        assert xi[at] == pytest.approx(-0.5, abs=1e-6)
        assert traction[at] == pytest.approx(largest * pressure_there, rel=1e-3)
        assert np.all(traction <= largest * np.sqrt(1.0 - xi**2) + 1e-9)
        step = np.abs(np.diff(traction))[np.abs(xi[1:] + 0.5) < 1e-6]
        assert step.max() < 1e-2


def test_figure_1_holds_the_creep_force(axes: dict[int, Axes]) -> None:
    law = cl.CohesiveZone(k_hat=K, static_to_kinetic=STATIC / KINETIC)
    x = float(brentq(lambda v: float(law.stick_boundary(v)) + 0.5, 0.1, 1.0))
    # P is half of pi a p0.
    for label, force in (("cohesive", law.traction_ratio(x)), (CARTER, 1.0 - 0.75**2)):
        xi, traction = curve(axes[1], label)
        assert 2.0 / np.pi * np.trapezoid(traction, xi) == pytest.approx(float(force), rel=1e-3)


def test_figure_2_is_equation_18_with_two_states_above_one(axes: dict[int, Axes]) -> None:
    c, q = whole(axes[2])
    assert_allclose(q, equation_18(c), rtol=1e-6)
    assert q.max() == pytest.approx(1.135026, abs=1e-6)
    assert f"below {q.max():.3f}, it cuts the peak off" in PAPER_FIGURES[2].caption
    rising, falling = curve(axes[2], STABLE), curve(axes[2], UNSTABLE)
    assert np.all(np.diff(rising.y) > 0.0)
    assert np.all(np.diff(falling.y) < 0.0)
    # Where Eq. (18) is 1 on the way up: 2 K t (1 + t**4) = 1.
    t = brentq(lambda v: 2.0 * K * v * (1.0 + v**4) - 1.0, 0.0, 2.0)
    assert np.interp(1.0, rising.y, rising.x) == pytest.approx(1.0 - 2.0 / (1.0 + t**4), abs=1e-4)
    states = np.array([np.interp(1.1, rising.y, rising.x), np.interp(-1.1, -falling.y, falling.x)])
    assert np.diff(states) > 0.1
    assert_allclose(equation_18(states), 1.1, atol=1e-5)
    c, q = curve(axes[2], CARTER)
    assert_allclose(q, 1.0 - (1.0 - c) ** 2 / 4.0, atol=1e-12)
    assert (c[-1], q[-1]) == (1.0, 1.0)


def test_figure_3_is_equation_19_and_diverges(axes: dict[int, Axes]) -> None:
    c, x = curve(axes[3], STABLE)
    assert np.all(np.diff(c) > 0.0)
    well = c < 1.0 - 1e-6  # short of cancellation in 1 - c
    assert_allclose(x[well], equation_19(c[well]), rtol=1e-9, atol=1e-9)
    assert x[-1] > 10.0
    law = (x[-1] - 1.0) * (1.0 - c[-1]) ** 0.25
    assert law == pytest.approx(K * 2.0**0.25, rel=1e-6)
    c, x = curve(axes[3], CARTER)
    assert_allclose(x, (1.0 + c) / 2.0, atol=1e-12)
    assert x[-1] == 1.0


def test_figure_4_peaks_and_starts_like_carter(axes: dict[int, Axes]) -> None:
    x, q = whole(axes[4])
    top = int(np.argmax(q))
    assert (x[top], q[top]) == pytest.approx((1.131634, 1.135026), abs=1e-6)
    assert curve(axes[4], UNSTABLE).x[0] == x[top]
    t = np.sqrt(np.maximum(q - 1.0 + (1.0 - x) ** 2, 0.0)) / K  # q = 1 - (1 - x)**2 + (K t)**2
    assert_allclose(t**4 / (1.0 + t**4) + K * t, x, rtol=1e-6, atol=1e-6)
    carter = curve(axes[4], CARTER)
    assert initial_slope(Curve(x, q)) == pytest.approx(2.0, rel=1e-6)
    assert initial_slope(carter) == pytest.approx(2.0, rel=1e-6)
    x, q = x[1:], q[1:]
    assert np.all(q > np.interp(x, *carter))  # the secant, not the tangent
    assert np.all(carter.y[carter.x < 1.0] < 1.0)
    assert_allclose(carter.y[carter.x >= 1.0], 1.0)


def test_figure_5_ellipse_is_the_higher_one(axes: dict[int, Axes]) -> None:
    griffith = "Carter-Griffith, $\\hat K$ = 0.3"
    x, q = curve(axes[5], f"{griffith}, ellipse")
    assert_allclose(
        np.interp([0.3, 0.6, 2.0], x, q), [0.6279806187, 0.9979130894, 1.0135093774], rtol=1e-9
    )
    assert (x[np.argmax(q)], q.max()) == pytest.approx((1.0079, 1.15162), abs=1e-4)
    line = curve(axes[5], f"{griffith}, line")
    assert (line.x[np.argmax(line.y)], line.y.max()) == pytest.approx(
        (1.131634, 1.135026), abs=1e-6
    )
    for name in (griffith, "Carter, $\\hat K$ = 0"):
        assert initial_slope(curve(axes[5], f"{name}, ellipse")) == pytest.approx(
            0.75 * np.pi, rel=2e-3
        )
        assert initial_slope(curve(axes[5], f"{name}, line")) == pytest.approx(2.0, rel=2e-3)


def test_figure_6_has_the_papers_parameters(figures: dict[int, Figure]) -> None:
    for axes in figures[6].axes:
        zeta, mu = curve(axes, "Carter-Griffith")
        top = int(np.argmax(mu))
        assert (zeta[top], mu[top]) == pytest.approx((0.015 * 1.131634, 0.21 * 1.135026), rel=1e-6)
        carter = curve(axes, "Carter")
        expected = 0.21 * (1.0 - np.maximum(1.0 - zeta / 0.015, 0.0) ** 2)
        assert_allclose(carter.y, expected, rtol=1e-9)
        assert_allclose(curve(axes, "Coulomb").y, 0.21)
        cohesive = curve(axes, "cohesive zone").y
        assert cohesive.max() < mu.max()
        far = zeta > 0.075
        assert np.all(cohesive[far] > mu[far])  # the true tail of the falling branch
        assert np.all(cohesive[far] < STATIC)


def test_figure_6_shows_the_points_and_polachs_fit(figures: dict[int, Figure]) -> None:
    data = cl.TractionData.from_csv(package_folder("models") / "eurosprinter_engel1998.csv")
    axes = figures[6].axes[1]
    points = curve(axes, "Engel")
    assert_allclose(points.x, data.creepage)
    assert_allclose(points.y, data.traction_coefficient)
    zeta, mu = curve(axes, "Polach")
    residuals = np.interp(data.creepage, zeta, mu) - data.traction_coefficient
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(0.0246, rel=0.01)
    # Polach's formula with the known fit; G and p0 are those of the file.
    w = 10.0 * zeta
    friction = 0.353 * ((1.0 - 0.227) * np.exp(-0.386 * w) + 0.227)
    load, area = 106.7e3, np.pi * 6.304e-3 * 12.61e-3
    eps = 82e9 * area * 3.7 * zeta / (4.0 * load * friction)
    a, s = 0.866 * eps, 0.363 * eps
    assert_allclose(mu, 2.0 * friction / np.pi * (a / (1.0 + a * a) + np.arctan(s)), rtol=0.01)


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (1, "Eq. (11) lacks a minus sign"),
        (2, "static friction, which no force exceeds"),
        (4, "both start with slope 2"),
        (5, "it is slightly higher"),
        (6, "The paper compares with other measurements"),
    ],
)
def test_captions_say_where_the_text_differs(number: int, said: str) -> None:
    assert said in PAPER_FIGURES[number].caption


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6, None])
def test_caption_is_under_the_figure_and_nothing_is_covered(
    figures: dict[int, Figure], number: int | None
) -> None:
    kind = CONTACT_PATCH if number is None else PAPER_FIGURES[number]
    figure = CONTACT_PATCH.draw() if number is None else figures[number]
    assert kind.caption.startswith(kind.title)
    first = kind.caption.split()[:3]
    assert figure.get_supxlabel().split()[:3] == first
    figure.draw_without_rendering()
    page = figure.bbox
    for text in figure.texts:
        box = text.get_window_extent()
        assert page.x0 <= box.x0 < box.x1 <= page.x1
        assert page.y0 <= box.y0
        assert all(box.y1 <= axes.get_tightbbox().y0 + 1.0 for axes in figure.axes)  # type: ignore[union-attr]
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend is None:
            continue
        box = legend.get_window_extent()
        for line in axes.lines:
            path = line.get_transform().transform_path(line.get_path())
            assert not path.intersects_bbox(box, filled=False), line.get_label()
        assert page.x0 <= box.x0 < box.x1 <= page.x1
