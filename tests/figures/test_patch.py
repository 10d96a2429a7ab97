"""The contact patch: what is drawn, against the law's force and the bounds of friction."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.figures import contact_patches
from contactlib.figures.patch import patch_traction

K = 0.3


@pytest.mark.parametrize("x", [0.3, 0.8, 1.5])
def test_patch_of_carter_holds_the_force(x: float) -> None:
    law = cl.CarterGriffith(k_hat=0.0, contact="elliptic")
    patch = patch_traction(law, x)
    strips = np.trapezoid(patch.shear_traction, patch.position, axis=1)
    eta = patch.lateral_position[:, 0]
    w = np.sqrt((1.0 - eta) * (1.0 + eta))
    assert_allclose(patch.position[:, 0], -w, atol=1e-9)
    assert_allclose(patch.position[:, -1], w, atol=1e-9)
    # P is 2/3 of pi a b p0.
    force = 1.5 / np.pi * np.trapezoid(strips, eta)
    assert force == pytest.approx(float(law.traction_ratio(x)), rel=2e-3)
    # The stick zone is bounded by the leading edge, mirrored and displaced.
    sticks = w > x + 1e-9
    assert_allclose((patch.stick_boundary + w)[sticks], 2.0 * x, rtol=1e-9)


def test_patch_of_a_finite_length_stays_below_static_friction() -> None:
    r = 0.45 / 0.21
    law = cl.CohesiveZone(k_hat=K, static_to_kinetic=r, contact="elliptic")
    patch = patch_traction(law, 0.6)
    pressure = np.sqrt(np.maximum(1.0 - patch.position**2 - patch.lateral_position**2, 0.0))
    assert np.all(patch.shear_traction <= r * pressure + 1e-7)
    slips = patch.position < patch.stick_boundary[:, None]
    assert np.all(patch.shear_traction[slips] >= pressure[slips] - 1e-7)
    assert_allclose(patch.shear_traction, patch.shear_traction[::-1])


def test_patches_name_what_they_show() -> None:
    figure = contact_patches(cl.CarterGriffith(k_hat=K, contact="elliptic"))
    *panels, bar = figure.axes
    titles = [axes.get_title(loc="left") for axes in panels]
    for title, heading in zip(titles, ("Before", "At", "Past"), strict=True):
        assert title.startswith(heading)
    assert "1.01" in titles[1]  # the peak of the ellipse
    for axes in panels:
        assert {"slip", "stick", "leading edge", "rolling"} <= {t.get_text() for t in axes.texts}
    assert "clipped at 2.2" in bar.get_ylabel()
    assert bar.get_ylim() == (0.0, 2.2)


def test_patch_without_stick_or_singularity_reports_it() -> None:
    figure = contact_patches(cl.CarterGriffith(k_hat=0.0, contact="elliptic"), axes_ratio=1.5)
    *_, axes, bar = figure.axes  # past the peak
    assert "stick" not in {text.get_text() for text in axes.texts}
    assert "clipped" not in bar.get_ylabel()
    top = np.asarray(axes.lines[-1].get_ydata()).max()
    assert top == pytest.approx(1.5)


def test_patch_of_a_line_is_refused() -> None:
    with pytest.raises(ValueError, match=r"law\.contact = 'line' must be 'elliptic'"):
        contact_patches(cl.CarterGriffith(k_hat=K))


def test_patch_needs_numbers_above_zero() -> None:
    law = cl.CarterGriffith(k_hat=K, contact="elliptic")
    with pytest.raises(ValueError, match=r"normalized_creepage = .* > 0"):
        patch_traction(law, 0.0)
    for name, value in {"axes_ratio": 0.0, "clip": -1.0}.items():
        with pytest.raises(ValueError, match=f"{name} = .* > 0"):
            contact_patches(law, **{name: value})
