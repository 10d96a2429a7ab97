"""Lines over one axis."""

from __future__ import annotations

from pathlib import Path

import figure_checks as checks
import numpy as np
from map_data import (
    CONTROLLERS,
    FRICTION,
    analysed,
    compared,
    described,
    legend_texts,
    numbers,
)
from numpy.testing import assert_allclose

from contactlib.figures import map_figure
from contactlib.figures.maps.meaning import words


def test_lines_show_the_values(tmp_path: Path) -> None:
    made = compared().isel(length=-1, drop=True)
    made["torque_margin"] = described("torque_margin", "friction", FRICTION - 0.456)
    figure = map_figure(made, "recovery_time")
    checks.check_all(figure, tmp_path)
    (axes,) = figure.axes
    factor = words(compared()["recovery_time"]).factor
    for name, text in zip(
        CONTROLLERS, ("open loop", "cut and re-apply", "PI creep control"), strict=True
    ):
        x, y, _ = checks.lines(axes, text)
        values = made["recovery_time"].sel(controller=name).values
        assert_allclose(x, FRICTION)
        assert_allclose(y, factor * np.where(np.isfinite(values), values, np.nan))
    of_open_loop = made["recovery_time"].sel(controller="open_loop").values
    for marker, where in ((6, np.isinf(of_open_loop)), ("x", made["failed"][0].values > 0)):
        (marks,) = [line for line in axes.lines if line.get_marker() == marker]
        assert where.any()
        assert_allclose(numbers(marks.get_xdata()), FRICTION[where])
    assert {"does not recover", "failed", "demand = critical torque"} <= set(legend_texts(figure))
    (border,) = [line for line in axes.lines if numbers(line.get_xdata()).size == 2]
    assert_allclose(numbers(border.get_xdata()), 0.456)


def test_few_values_of_a_second_axis_are_lines(tmp_path: Path) -> None:
    made = compared().isel(length=[0, 2, 5])
    figure = map_figure(made, "adhesion_utilisation")
    checks.check_all(figure, tmp_path)
    assert len(figure.axes) == 3
    for axes, name in zip(figure.axes, CONTROLLERS, strict=True):
        for length in made["length"].values:
            _, y, _ = checks.lines(axes, f"length of the patch {length:.4g}\u00a0m")
            expected = made["adhesion_utilisation"].sel(controller=name, length=length)
            assert_allclose(y, 100.0 * expected)


def test_one_line_of_yes_or_no(tmp_path: Path) -> None:
    figure = map_figure(analysed()[["stable"]].isel(friction=3, drop=True), "stable")
    checks.check_all(figure, tmp_path)
    (axes,) = figure.axes
    assert {text.get_text() for text in axes.get_yticklabels()} == {"held", "not held"}
