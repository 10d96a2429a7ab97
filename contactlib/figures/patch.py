"""The elliptic contact seen from above: shear traction, stick and slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from contactlib.base.quantities import POSITIVE, FloatArray, checked
from contactlib.figures.style import add_caption, new_figure, paint, styled
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.cohesive import CohesiveZone

Law = CarterGriffith | CohesiveZone

STRIPS = 61
COLOURS = "viridis"
CAPTION = (
    "Shear traction on a contact ellipse, seen from above, before, at and past the peak of the "
    "creep force. The surface sticks in the hatched zone at the leading edge and slips behind it. "
    "Past the peak little or no stick zone is left, and the traction approaches sliding friction."
)


class Patch(NamedTuple):
    """Shear traction / (f_d p0) at points of an ellipse; each row is a strip."""

    position: FloatArray
    lateral_position: FloatArray
    shear_traction: FloatArray
    stick_boundary: FloatArray


def patch_traction(law: Law, normalized_creepage: float) -> Patch:
    """Traction on strips from edge to edge, with points on both sides of the stick boundary.

    Raises
    ------
    ValueError
        If the law's contact is not an ellipse, or the creepage is not above zero.
    """
    checked("normalized_creepage", normalized_creepage, POSITIVE)
    if law.contact != "elliptic":
        raise ValueError(f"law.contact = {law.contact!r} must be 'elliptic'")
    theta = np.linspace(0.0, 0.5 * np.pi, (STRIPS + 1) // 2)
    eta, w = np.sin(theta)[:, None], np.cos(theta)[:, None]
    eta[-1], w[-1] = 1.0, 0.0
    c = law.stick_boundary(normalized_creepage, eta)
    # Denser towards the edges and, from both sides, the stick boundary, where the traction jumps.
    even = np.linspace(0.0, 1.0, 60)
    beyond = np.maximum(even * even * (3.0 - 2.0 * even), 1e-9)
    xi = np.hstack([c - beyond[::-1] * (c + w), c + beyond * (w - c)])
    traction = law.shear_traction(xi, normalized_creepage, eta)
    eta = np.broadcast_to(eta, xi.shape)

    def mirrored(half: FloatArray, sign: float = 1.0) -> FloatArray:
        return np.vstack([sign * half[:0:-1], half])

    return Patch(mirrored(xi), mirrored(eta, -1.0), mirrored(traction), mirrored(c)[:, 0])


def contact_patches(law: Law, *, axes_ratio: float = 2.0, clip: float = 2.2) -> Figure:
    """Shear traction on the contact ellipse before, at and past the peak of the creep force.

    The creepages are 0.6, 1 and 1.6 times that of the law's peak.

    Parameters
    ----------
    law : CarterGriffith or CohesiveZone
        A law of an elliptic contact.
    axes_ratio : float, optional
        b/a, width across the rolling direction / length along it [1]; strip theory assumes that it
        is large.
    clip : float, optional
        Traction / (f_d p0) at the end of the colour scale [1]; the traction of the limit law is
        infinite at the stick boundary.

    Raises
    ------
    ValueError
        If the law's contact is not an ellipse, or a number is not above zero.
    """
    headings = {0.6: "Before the peak", 1.0: "At the peak", 1.6: "Past the peak"}
    creepages = [share * law.peak.normalized_creepage for share in headings]
    with styled({"hatch.linewidth": 0.5}):
        figure, grid = new_figure(9.6, 5.9, ncols=3, sharey=True)
        _draw(figure, grid, law, creepages, axes_ratio, clip)
        for axes, heading, x in zip(grid, headings.values(), creepages, strict=True):
            axes.set_title(rf"{heading}: $\zeta/\zeta_0$ = {x:.2f}")
        add_caption(figure, f"{CAPTION} k_hat {law.k_hat:g}, $b/a$ {axes_ratio:g}.")
    return figure


def _draw(
    figure: Figure,
    grid: Sequence[Axes],
    law: Law,
    creepages: Sequence[float],
    axes_ratio: float,
    clip: float,
) -> None:
    checked("axes_ratio", axes_ratio, POSITIVE)
    checked("clip", clip, POSITIVE)
    patches = [patch_traction(law, x) for x in creepages]
    largest = max(float(patch.shear_traction.max()) for patch in patches)
    for axes, patch in zip(grid, patches, strict=True):
        colours = _draw_patch(axes, patch, axes_ratio, min(largest, clip))
        axes.set_xlabel("along rolling $x/a$  [1]")
    grid[0].set_ylabel("across rolling $y/a$  [1]")
    label = r"shear traction $q(\xi, \eta)/(f_d\,p_0)$  [1]"
    clipped = largest > clip
    if clipped:
        label += f"\nclipped at {clip:g}; larger beside the stick boundary"
    figure.colorbar(
        colours, ax=list(grid), label=label, shrink=0.8, extend="max" if clipped else "neither"
    )


def _draw_patch(axes: Axes, patch: Patch, axes_ratio: float, largest: float) -> QuadMesh:
    y = axes_ratio * patch.lateral_position
    colours = axes.pcolormesh(
        patch.position,
        y,
        np.minimum(patch.shear_traction, largest),
        shading="gouraud",
        cmap=COLOURS,
        norm=Normalize(0.0, largest),
        rasterized=True,
    )
    trail, lead, across = patch.position[:, 0], patch.position[:, -1], y[:, 0]
    sticks = patch.stick_boundary < lead - 1e-3
    shown = np.convolve(sticks, np.ones(3), "same") > 0.0  # and the neighbouring strips
    edge = np.where(shown, patch.stick_boundary, np.nan)
    axes.fill_betweenx(across, edge, lead, facecolor="none", edgecolor="white", hatch="//", lw=0.0)
    axes.plot(edge, across, color="white", lw=1.6, label="stick boundary")
    rim = np.append(trail, lead[::-1]), np.append(across, across[::-1])
    axes.plot(*rim, color=paint.ink, lw=1.2)
    axes.set(aspect="equal", xlim=(-1.4, 1.4), ylim=(-1.35 * axes_ratio, 1.2 * axes_ratio))
    axes.grid(visible=False)
    at = int(np.searchsorted(across, 0.4 * axes_ratio))
    for text, x, place in (
        ("slip", 0.5 * (trail[at] + patch.stick_boundary[at]), -1.2),
        ("stick", 0.5 * (edge[at] + lead[at]), 0.85),
    ):
        if np.isfinite(x):
            line = {"arrowstyle": "-", "color": paint.ink, "shrinkB": 0.0}
            label = place, 0.95 * axes_ratio
            axes.annotate(text, (x, across[at]), label, textcoords="data", arrowprops=line)
    axes.text(1.08, 0.0, "leading edge", rotation=-90, va="center")
    tail, tip = ((x, -1.2 * axes_ratio) for x in (-0.9, 0.9))
    look = {"arrowstyle": "-|>", "color": paint.grey, "lw": 1.3}
    axes.annotate("rolling", tip, tail, va="center", color=paint.grey, arrowprops=look)
    return colours
