"""Shear traction along the contact in the explorer page, against Python's law."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from explorer_page import ExplorerPage
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.base.quantities import FloatArray

pytestmark = pytest.mark.tools

CREEPAGES = np.geomspace(1e-3, 20.0, 7)
K_HATS = (0.0, 0.02, 0.3, 1.0, 2.0)
STRIPS, POINTS = 31, 40

PATCHES = """async ({ contact, creepages, kHat, strips, points }) => {
  const { ready, patch } = globalThis.contactlib;
  const { kernel } = await ready;
  const plain = (found) => ({
    position: [...found.position],
    traction: [...found.shear_traction],
    boundary: found.stick_boundary,
  });
  return creepages.map((x) => {
    const line = contact === "line";
    const found = line
      ? { eta: [0], strips: [patch.linePatch(kernel, x, kHat, points)] }
      : patch.ellipsePatch(kernel, x, kHat, strips, points);
    return { eta: [...found.eta], strips: found.strips.map(plain) };
  });
}"""


def patches(page: ExplorerPage, contact: str, creepages: Any, k_hat: float) -> Any:
    given = {
        "contact": contact,
        "creepages": np.asarray(creepages).tolist(),
        "kHat": k_hat,
        "strips": STRIPS,
        "points": POINTS,
    }
    return page.call(PATCHES, given)


def columns(found: Any) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Positions and tractions with a row per strip; boundaries and eta as columns."""
    position = np.array([strip["position"] for strip in found["strips"]])
    traction = np.array([strip["traction"] for strip in found["strips"]])
    boundary = np.array([strip["boundary"] for strip in found["strips"]])
    return position, traction, boundary[:, None], np.array(found["eta"])[:, None]


@pytest.mark.parametrize("contact", ["line", "elliptic"])
@pytest.mark.parametrize("k_hat", K_HATS)
def test_traction_and_stick_are_the_law_s(page: ExplorerPage, contact: Any, k_hat: float) -> None:
    law = cl.CarterGriffith(k_hat=k_hat, contact=contact)
    for x, found in zip(CREEPAGES, patches(page, contact, CREEPAGES, k_hat), strict=True):
        position, traction, boundary, eta = columns(found)
        assert position.shape == (eta.size, POINTS)
        assert_allclose(boundary, law.stick_boundary(x, eta), rtol=0.0, atol=1e-12)
        # A position has 16 digits, of which its distance to a singular point has fewer; that of a
        # zone without length has none.
        width = np.sqrt((1.0 - eta) * (1.0 + eta)) if contact == "elliptic" else 1.0
        away = np.minimum(np.abs(position - boundary), np.abs(width - np.abs(position)))
        clear = away > 1e-10
        expected = law.shear_traction(position, x, eta)
        allowed = 1e-10 + 1e-15 * np.abs(traction) / np.maximum(away, 1e-300)
        assert np.all(np.abs(traction - expected)[clear] <= allowed[clear])
        assert np.mean(clear) > 0.4


@pytest.mark.parametrize("contact", ["line", "elliptic"])
@pytest.mark.parametrize("k_hat", [0.0, 0.3, 1.0])
def test_traction_holds_the_force(page: ExplorerPage, contact: Any, k_hat: float) -> None:
    """Its integral is the traction ratio; the singular part is integrated in the square root."""
    law = cl.CarterGriffith(k_hat=k_hat, contact=contact)
    creepages = [0.3, 0.8, 1.5]
    for x, found in zip(creepages, patches(page, contact, creepages, k_hat), strict=True):
        position, traction, boundary, eta = columns(found)
        slips = position <= boundary
        behind = np.sqrt(np.abs(position - boundary))
        area = np.where(slips, traction, 2.0 * behind * traction)
        along = np.where(slips, position, behind)
        half = POINTS // 2
        strip = np.trapezoid(area[:, :half], along[:, :half]) + np.trapezoid(
            area[:, half:], along[:, half:]
        )
        if contact == "line":
            force = 2.0 / np.pi * strip[0]
        else:
            force = 1.5 / np.pi * np.trapezoid(strip, eta[:, 0])
        assert force == pytest.approx(float(law.traction_ratio(x)), rel=0.02)


def test_a_patch_is_denser_where_the_traction_bends(page: ExplorerPage) -> None:
    (found,) = patches(page, "line", [0.8], 0.3)
    position, _, boundary, _ = columns(found)
    steps = np.diff(position[0])
    assert np.all(steps > 0.0)
    assert position[0, [0, -1]] == pytest.approx([-1.0, 1.0])
    near = np.argmin(np.abs(position[0] - boundary))
    assert max(steps[0], steps[near], steps[-1]) < 0.2 * steps.max()


def test_without_creepage_there_is_no_traction_and_braking_is_the_mirror(
    page: ExplorerPage,
) -> None:
    for contact in ("line", "elliptic"):
        rest, forward, backward = patches(page, contact, [0.0, 0.7, -0.7], 0.3)
        assert np.all(columns(rest)[1] == 0.0)
        assert np.all(columns(forward)[0] == columns(backward)[0])
        assert np.all(columns(forward)[1] == -columns(backward)[1])
        assert columns(forward)[1].max() > 1.0


def test_a_picture_of_the_ellipse_is_quick(page: ExplorerPage) -> None:
    cost = page.call(
        """async () => {
          const { ready, patch } = globalThis.contactlib;
          const { kernel } = await ready;
          const times = [];
          for (let i = 0; i < 100; i++) {
            const start = performance.now();
            for (let j = 0; j < 10; j++) patch.ellipsePatch(kernel, 0.5 + 0.01 * i, 0.3, 31, 41);
            times.push((performance.now() - start) / 10);
          }
          return times.sort((a, b) => a - b)[50];
        }"""
    )
    assert 0.0 < cost < 2.0  # ms
