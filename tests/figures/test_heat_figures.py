"""Figures of a contact that slip warms: the curves are those of the contact, and can be read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from falling_friction import with_falling
from figure_checks import check_all, lines
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.figures import stability_over_speed, thermal_curves
from contactlib.laws import ContactHeat, Softening, ThermalContact


@pytest.fixture(scope="module")
def contact() -> ThermalContact:
    ellipse = cl.EllipticContact.from_semi_axes(
        semi_axis_x=6e-3, semi_axis_y=9e-3, normal_load=1e5, contact_modulus=115.4e9
    )
    return ThermalContact(
        heat=ContactHeat(contact=ellipse),
        friction=cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0),
        softening=Softening.linear(700.0),
    )


def test_curves_are_those_of_the_contact(contact: ThermalContact, tmp_path: Path) -> None:
    data = cl.TractionData([0.01, 0.1], [0.28, 0.22])
    speeds = (5.0, 10.0, 20.0, 40.0, 60.0)
    figure = thermal_curves(contact, speeds, data=data)
    (axes,) = figure.axes
    looks = {(line.get_color(), line.get_linestyle()) for line in axes.lines}
    assert len(looks) == len(axes.lines)
    for speed in speeds:
        zeta, mu, _ = lines(axes, f"{speed:g} m/s")
        assert_allclose(mu, contact.traction_coefficient(zeta, speed), rtol=1e-12)
    cold = max(float(np.max(np.asarray(line.get_ydata()))) for line in axes.lines)
    assert cold == pytest.approx(0.3, rel=1e-6)
    assert_allclose(lines(axes, "measured")[1], [0.28, 0.22])
    check_all(figure, tmp_path)


def test_stability_is_that_of_the_wheelsets(locomotive: cl.Model, tmp_path: Path) -> None:
    warm = with_falling(locomotive.wheelset, 0.0)
    speeds = [5.0, 20.0]
    figure = stability_over_speed({"cold": locomotive.wheelset, "warm": warm}, speeds)
    torque, growth, times = figure.axes
    for name, wheelset in {"cold": locomotive.wheelset, "warm": warm}.items():
        for i, speed in enumerate(speeds):
            fold = cl.find_fold(wheelset, speed=speed).drive_torque
            pole = cl.stability.worst_pole(wheelset, speed=speed).pole
            cleared = cl.clearing(
                wheelset, speed=speed, friction_scale=0.5, drive_torque=0.95 * fold
            )
            expected = 1e-3 * fold, 1e3 / pole, 1e3 * cleared.time
            drawn = (lines(axes, name)[1][i] for axes in (torque, growth, times))
            assert_allclose(list(drawn), expected)
    check_all(figure, tmp_path)


def test_bad_input_is_refused(contact: ThermalContact) -> None:
    with pytest.raises(ValueError, match=r"speeds = 0\.0"):
        thermal_curves(contact, (10.0, 0.0))
    with pytest.raises(ValueError, match=r"largest_creepage = -1\.0"):
        thermal_curves(contact, (10.0,), largest_creepage=-1.0)
    with pytest.raises(ValueError, match="wheelsets has 0 members: must have 1 to 3"):
        stability_over_speed({}, (10.0,))
