"""Figures 1 to 6 of the paper, drawn from the package's laws.

Source: Ciavarella, Romano & Barber, "Rolling of a cylinder with slip-dependent friction: the
Carter solution revisited". Equation numbers are theirs.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder
from contactlib.figures import patch
from contactlib.figures.style import (
    DASHED,
    DOTTED,
    add_caption,
    labelled,
    mark,
    new_figure,
    paint,
    styled,
)
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.cohesive import CohesiveZone
from contactlib.laws.fit import fit
from contactlib.laws.polach import Polach
from contactlib.laws.traction_data import TractionData

# The paper's parameters; it does not give static friction, which is chosen.
K_HAT, KINETIC, SATURATION = 0.3, 0.21, 0.015
STATIC = 0.45
MEASURED = "Engel, Beck & Alders 1998, 10 m/s"
CARTER, GRIFFITH, COHESIVE = "Carter", "Carter-Griffith", "cohesive zone"
COHESIVE_LAW = CohesiveZone(k_hat=K_HAT, static_to_kinetic=STATIC / KINETIC)

CAPTIONS = {
    1: "Shear traction over the contact, with the stick boundary at c/a = -0.5. If friction "
    f"weakens over a vanishing length (k_hat {K_HAT}), the traction is unbounded there; if it "
    f"weakens over a finite length (same k_hat, f_s/f_d = {STATIC}/{KINETIC}), static friction "
    "bounds it. The figure shows the paper's Eq. (16); the first term of its Eq. (11) lacks a "
    "minus sign.",
    2: "Creep force over the stick boundary. Each force above kinetic friction belongs to two "
    "states; the one with less stick is unstable at constant load. Eq. (18), drawn here, ignores "
    "static friction, which no force exceeds; where f_s/f_d is below 1.135, it cuts the peak off.",
    3: "Creepage over the stick boundary. By Eq. (19), Carter's stick zone vanishes at zeta0; with "
    "falling friction a stick zone remains at any creepage. The dot marks the peak creep force.",
    4: "Creep force over creepage. Beyond the peak a contact slips away at constant load; a "
    "prescribed creepage holds it. Sec. 5 of the paper says that the curve starts more steeply "
    "than Carter's. By Eqs. (18) and (19) both start with slope 2, and only the secant is larger.",
    5: "Creep force over creepage for a line contact and, by strip theory, for an ellipse. Sec. 4 "
    "of the paper says that the maximum of the ellipse is clearly lower. By Eqs. (23) and (24) it "
    "is slightly higher, and occurs at a smaller creepage.",
    6: "Traction coefficient over creepage: the laws with the paper's parameters beside "
    "measurements on the Eurosprinter locomotive. The paper compares with other measurements, to "
    f"which its parameters (k_hat {K_HAT}, f_d {KINETIC}, zeta0 {SATURATION}) belong; the cohesive "
    f"zone has f_s {STATIC}. Only Polach's law, with friction that falls with slip speed, is "
    "fitted to these points.",
}


class LineStates(NamedTuple):
    """Steady states of a line contact: stick boundary c/a, creepage x, traction ratio q."""

    stick_boundary: FloatArray
    creepage: FloatArray
    traction_ratio: FloatArray


def line_states(law: CarterGriffith) -> LineStates:
    """States of a line contact that partly sticks, from zero creepage on, including the peak.

    They are spaced evenly in t/(1 + t), t = ((1 + c/a)/(1 - c/a))**(1/4), where all is smooth.
    """
    u = np.linspace(0.0, 0.99, 1000)
    t = u / (1.0 - u)
    peak = law.peak.normalized_creepage
    x = np.union1d(t**4 / (1.0 + t**4) + law.k_hat * t, [peak])  # Eq. (19)
    return LineStates(law.stick_boundary(x), x, law.traction_ratio(x))


def creepage_of(law: CarterGriffith | CohesiveZone, stick_boundary: float) -> float:
    """Normalized creepage at which a line contact's stick boundary is c/a."""

    def off(x: float) -> float:
        return float(law.stick_boundary(x)) - stick_boundary

    return float(brentq(off, 1e-9, 10.0, xtol=1e-15, rtol=1e-15))


def figure_1() -> Figure:
    """Shear traction over the contact."""
    c = -0.5
    near = c + np.geomspace(1e-7, 0.1, 200)
    xi = np.unique(np.concatenate([np.linspace(-1.0, 1.0, 801), near]))
    laws = (
        (CarterGriffith(k_hat=K_HAT), GRIFFITH, paint.orange, "-", 2.0),
        (COHESIVE_LAW, COHESIVE, paint.blue, "-", 1.1),
        (CarterGriffith(k_hat=0.0), CARTER, paint.ink, DASHED, 1.6),
    )
    with styled():
        figure, axes = new_figure(7.2, 5.0)
        for law, name, color, style, width in laws:
            traction = law.shear_traction(xi, creepage_of(law, c))
            axes.plot(xi, traction, color=color, ls=style, lw=width, label=_named(name, law))
        axes.axvline(c, color=paint.grey, lw=0.8, ls=DOTTED)
        axes.set(xlim=(-1.05, 1.05), ylim=(0.0, 2.4))
        for text, x in (("slip", -0.75), ("stick", 0.25)):
            axes.text(x, 0.08, text, ha="center", color=paint.grey)
        axes.annotate(
            "rolling direction",
            (0.98, 1.35),
            xytext=(0.42, 1.35),
            va="center",
            color=paint.grey,
            arrowprops={"arrowstyle": "-|>", "color": paint.grey, "lw": 1.3},
        )
        place = r"position $\xi/a$  [1], leading edge at 1"
        traction_label = r"shear traction $q(\xi)/(f_d\,p_0)$  [1]"
        _finish(axes, 1, place, traction_label, legend="upper right")
    return figure


def figure_2() -> Figure:
    """Creep force over the stick boundary."""
    with styled():
        figure, axes = new_figure(7.2, 4.8)
        carter, griffith = CarterGriffith(k_hat=0.0), CarterGriffith(k_hat=K_HAT)
        states, look = line_states(carter), {"color": paint.grey, "lw": 1.2}
        label = _named(CARTER, carter)
        axes.plot(states.stick_boundary, states.traction_ratio, label=label, **look)
        states = line_states(griffith)
        _branches(axes, states.stick_boundary, states, griffith)
        axes.axhline(1.0, color=paint.grey, lw=0.8, ls=DOTTED)
        axes.set(xlim=(-1.0, 1.05), ylim=(0.0, 1.25))
        _finish(axes, 2, "stick boundary", "traction ratio", legend="lower right")
    return figure


def figure_3() -> Figure:
    """Creepage over the stick boundary."""
    with styled():
        figure, axes = new_figure(7.2, 4.8)
        for k_hat, name, color, width in (
            (0.0, CARTER, paint.grey, 1.2),
            (K_HAT, GRIFFITH, paint.blue, 2.0),
        ):
            law = CarterGriffith(k_hat=k_hat)
            states, look = line_states(law), {"color": color, "lw": width}
            axes.plot(states.stick_boundary, states.creepage, label=_named(name, law), **look)
        peak = law.peak.normalized_creepage
        mark(axes, float(law.stick_boundary(peak)), peak, "peak force", (-9, 4), ha="right")
        axes.set(xlim=(-1.0, 1.05), ylim=(0.0, 2.5))
        _finish(axes, 3, "stick boundary", "normalized creepage", legend="upper left")
    return figure


def figure_4() -> Figure:
    """Creep force over creepage."""
    far = 3.0
    with styled():
        figure, axes = new_figure(7.2, 4.8)
        carter, griffith = CarterGriffith(k_hat=0.0), CarterGriffith(k_hat=K_HAT)
        x = np.append(line_states(carter).creepage, far)
        axes.plot(
            x, carter.traction_ratio(x), color=paint.grey, lw=1.2, label=_named(CARTER, carter)
        )
        states = line_states(griffith)
        _branches(axes, states.creepage, states, griffith)
        axes.plot([0.0, 0.6], [0.0, 1.2], color=paint.ink, lw=1.0, ls=DOTTED, label="slope 2")
        axes.set(xlim=(0.0, far), ylim=(0.0, 1.25))
        _finish(axes, 4, "normalized creepage", "traction ratio", legend="lower right")
    return figure


def figure_5() -> Figure:
    """Creep force over creepage for an ellipse and a line contact."""
    with styled():
        figure, axes = new_figure(7.2, 4.8)
        for k_hat, name, color in ((0.0, CARTER, paint.ink), (K_HAT, GRIFFITH, paint.blue)):
            ellipse = CarterGriffith(k_hat=k_hat, contact="elliptic")
            line = CarterGriffith(k_hat=k_hat, contact="line")
            for law, shape, style in ((ellipse, "ellipse", "-"), (line, "line", DASHED)):
                x = np.union1d(np.linspace(0.0, 3.0, 1201), [law.peak.normalized_creepage])
                label = f"{_named(name, law)}, {shape}"
                axes.plot(x, law.traction_ratio(x), color=color, ls=style, lw=1.6, label=label)
            if k_hat > 0.0:
                for peak, offset, side in (
                    (ellipse.peak, (-6, 5), "right"),
                    (line.peak, (-3, -16), "left"),
                ):
                    mark(axes, *peak, f"{peak.traction_ratio:.4f}", offset, ha=side)
        axes.set(xlim=(0.0, 3.0), ylim=(0.0, 1.25))
        _finish(axes, 5, "normalized creepage", "traction ratio", legend="lower right")
    return figure


def figure_6() -> Figure:
    """Traction coefficient over creepage, with measured points."""
    path = package_folder("models") / "eurosprinter_engel1998.csv"
    data = TractionData.from_csv(path, speed=10.0)
    polach = fit(
        Polach,
        data,
        slip_rate=True,
        saturation_creepage=0.00364,  # 2 mu0 p0/E* of the measured ellipse at the fitted mu0
    )
    far = 0.22
    griffith = CarterGriffith(k_hat=K_HAT)
    zeta = np.union1d(
        np.geomspace(1e-5, far, 2000), [SATURATION, SATURATION * griffith.peak.normalized_creepage]
    )

    def of(law: CarterGriffith | CohesiveZone) -> FloatArray:
        return np.asarray(KINETIC * law.traction_ratio(zeta / SATURATION))

    fitted = polach.traction_coefficient(zeta, 10.0)
    curves = (
        ("Polach, fitted to the points", fitted, paint.green, "-", 2.0),
        (GRIFFITH, of(griffith), paint.orange, "-", 2.0),
        (COHESIVE, of(COHESIVE_LAW), paint.blue, DASHED, 1.6),
        (CARTER, of(CarterGriffith(k_hat=0.0)), paint.ink, DASHED, 1.2),
        ("Coulomb", np.full(zeta.shape, KINETIC), paint.ink, DOTTED, 1.2),
    )
    with styled():
        figure, grid = new_figure(9.6, 5.2, ncols=2, sharey=True)
        for axes, shown, title in zip(
            grid, (0.05, far), ("Small creepages", "All creepages"), strict=True
        ):
            points: dict[str, Any] = {"color": paint.mixed(71), "ms": 3.5, "label": MEASURED}
            axes.plot(data.creepage, data.traction_coefficient, "o", **points)
            for name, mu, color, style, width in curves:
                axes.plot(zeta, mu, color=color, ls=style, lw=width, label=name)
            labelled(axes, "creepage", "", title, xlim=(0.0, shown))
            axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        labelled(grid[0], y="traction coefficient", ylim=(0.0, 0.36))
        grid[1].legend(loc="lower right")
        add_caption(figure, CAPTIONS[6])
    return figure


def _finish(axes: Axes, number: int, x: str, y: str, *, legend: Any) -> None:
    """Label the axes, and set legend and caption of a figure."""
    labelled(axes, x, y, legend={"loc": legend})
    add_caption(axes.figure, CAPTIONS[number])  # type: ignore[arg-type]


def _named(name: str, law: CarterGriffith | CohesiveZone) -> str:
    return rf"{name}, $\hat K$ = {law.k_hat:g}"


def _branches(axes: Axes, x: FloatArray, states: LineStates, law: CarterGriffith) -> None:
    """Force of a law, solid up to the peak and dashed where a constant load slips away."""
    peak = law.peak.normalized_creepage
    parts = (
        (states.creepage <= peak, paint.blue, "-", _named(GRIFFITH, law)),
        (states.creepage >= peak, paint.orange, DASHED, "unstable at constant load"),
    )
    for part, color, style, label in parts:
        axes.plot(x[part], states.traction_ratio[part], color=color, ls=style, label=label)


class PaperFigure(NamedTuple):
    """A function that draws a figure, and the caption under it."""

    draw: Callable[[], Figure]
    caption: str

    @property
    def title(self) -> str:
        """The caption's first sentence."""
        return self.caption.partition(". ")[0] + "."


PAPER_FIGURES = {
    number: PaperFigure(draw, CAPTIONS[number])
    for number, draw in enumerate(
        (figure_1, figure_2, figure_3, figure_4, figure_5, figure_6), start=1
    )
}
CONTACT_PATCH = PaperFigure(
    partial(patch.contact_patches, CarterGriffith(k_hat=K_HAT, contact="elliptic")), patch.CAPTION
)
