"""The figures of the paper: what is drawn, read back from the lines, is the laws'.

`tests/laws` holds the laws against the paper's equations.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

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
LAW, OF_CARTER = cl.CarterGriffith(k_hat=K), cl.CarterGriffith(k_hat=0.0)
ELLIPSES = [cl.CarterGriffith(k_hat=k, contact="elliptic") for k in (K, 0.0)]
COHESIVE = cl.CohesiveZone(k_hat=K, static_to_kinetic=STATIC / KINETIC)


class Curve(NamedTuple):
    x: FloatArray
    y: FloatArray


def curve(axes: Axes, label: str) -> Curve:
    """The line of the axes with that label, or the only one whose label begins like that."""
    labels = [str(line.get_label()) for line in axes.lines]
    (index,) = [i for i, name in enumerate(labels) if name == label] or [
        i for i, name in enumerate(labels) if name.startswith(label)
    ]
    return Curve(*np.asarray(axes.lines[index].get_xydata()).T)


@pytest.fixture(scope="module")
def figures() -> dict[int, Figure]:
    return {number: figure.draw() for number, figure in PAPER_FIGURES.items()}


def creepage_at(law: Any, stick_boundary: float) -> float:
    return float(brentq(lambda x: float(law.stick_boundary(x)) - stick_boundary, 0.1, 1.0))


def along(law: Any) -> Callable[[FloatArray], FloatArray]:
    x = creepage_at(law, -0.5)
    return lambda xi: np.asarray(law.shear_traction(xi, x))


def of_boundary(values: Callable[[FloatArray], FloatArray]) -> Callable[[FloatArray], FloatArray]:
    """Values over the stick boundary c/a: x = (1 + c)/2 + K t, t = ((1 + c)/(1 - c))**(1/4)."""
    return lambda c: values((1.0 + c) / 2.0 + K * ((1.0 + c) / (1.0 - c)) ** 0.25)


def scaled(law: Any) -> Callable[[FloatArray], FloatArray]:
    return lambda zeta: np.asarray(KINETIC * law.traction_ratio(zeta / 0.015))


GRIFFITH_5, CARTER_5 = "Carter-Griffith, $\\hat K$ = 0.3", "Carter, $\\hat K$ = 0"
# Of each panel: its lines, and what they are of the horizontal axis.
DRAWN: dict[tuple[int, int], dict[str, Callable[[FloatArray], Any]]] = {
    (1, 0): {STABLE: along(LAW), "cohesive zone": along(COHESIVE), CARTER: along(OF_CARTER)},
    (2, 0): {
        STABLE: of_boundary(LAW.traction_ratio),
        UNSTABLE: of_boundary(LAW.traction_ratio),
        CARTER: lambda c: 1.0 - (1.0 - c) ** 2 / 4.0,
    },
    (3, 0): {STABLE: of_boundary(lambda x: x), CARTER: lambda c: (1.0 + c) / 2.0},
    (4, 0): {
        STABLE: LAW.traction_ratio,
        UNSTABLE: LAW.traction_ratio,
        CARTER: OF_CARTER.traction_ratio,
    },
    (5, 0): {
        f"{GRIFFITH_5}, line": LAW.traction_ratio,
        f"{CARTER_5}, line": OF_CARTER.traction_ratio,
        f"{GRIFFITH_5}, ellipse": ELLIPSES[0].traction_ratio,
        f"{CARTER_5}, ellipse": ELLIPSES[1].traction_ratio,
    },
    **{
        (6, panel): {
            "Carter-Griffith": scaled(LAW),
            "cohesive zone": scaled(COHESIVE),
            "Carter": scaled(OF_CARTER),
            "Coulomb": lambda zeta: np.full(zeta.shape, KINETIC),
        }
        for panel in (0, 1)
    },
}


@pytest.mark.parametrize("number", range(1, 7))
def test_lines_are_those_of_the_laws(figures: dict[int, Figure], number: int) -> None:
    for panel, axes in enumerate(figures[number].axes):
        for label, law in DRAWN[number, panel].items():
            x, y = curve(axes, label)
            # Short of cancellation in 1 - c, and beside the singularity at c.
            clear = (x < 1.0 - 1e-6) if number in (2, 3) else np.abs(x + 0.5) > 1e-6
            assert clear.sum() > 300
            assert_allclose(y[clear], law(x[clear]), rtol=1e-6, atol=1e-9, err_msg=label)


@pytest.mark.parametrize("number", [2, 4])
def test_branches_meet_at_the_peak(figures: dict[int, Figure], number: int) -> None:
    (axes,) = figures[number].axes
    rising, falling = curve(axes, STABLE), curve(axes, UNSTABLE)
    assert (rising.x[-1], rising.y[-1]) == (falling.x[0], falling.y[0])
    assert rising.y[-1] == pytest.approx(LAW.peak.traction_ratio, abs=1e-12)
    assert np.all(np.diff(rising.y) > 0.0)
    assert np.all(np.diff(falling.y) < 0.0)
    if number == 2:
        assert (
            f"below {LAW.peak.traction_ratio:.3f}, it cuts the peak off" in PAPER_FIGURES[2].caption
        )


def test_figure_6_shows_the_points_and_the_fit(figures: dict[int, Figure]) -> None:
    data = cl.TractionData.from_csv(package_folder("models") / "eurosprinter_engel1998.csv")
    axes = figures[6].axes[1]
    points = curve(axes, "Engel")
    assert_allclose(points.x, data.creepage)
    assert_allclose(points.y, data.traction_coefficient)
    residuals = np.interp(data.creepage, *curve(axes, "Polach")) - data.traction_coefficient
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(0.0246, rel=0.01)
    zeta, mu = curve(axes, "Carter-Griffith")
    far = zeta > 0.075
    assert np.all(curve(axes, "cohesive zone").y[far] > mu[far])  # the true tail


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
