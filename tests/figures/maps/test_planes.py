"""Maps over two axes."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_checks import check_all
from map_data import (
    CONTROLLERS,
    FRICTION,
    LOAD,
    analysed,
    cells,
    compared,
    grid,
    legend_texts,
    maps_of,
    marked,
    numbers,
    torque,
    utilisation,
)
from matplotlib.colors import LogNorm
from matplotlib.contour import QuadContourSet
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from contactlib.figures import map_figure
from contactlib.figures.maps.planes import ALIKE, FAILED, NO_VALUE, ZERO, best


def corners(path: Any) -> NDArray[np.float64]:
    return numbers(path.vertices)


def test_map_shows_the_values(tmp_path: Path) -> None:
    figure = map_figure(analysed(), "critical_torque")
    check_all(figure, tmp_path)
    (axes,) = maps_of(figure)
    mesh = cells(axes)
    load, friction = np.meshgrid(LOAD, FRICTION, indexing="ij")
    assert_allclose(numbers(mesh.get_array()), 1e-3 * torque(friction, load))
    edges = numbers(mesh.get_coordinates())
    middles = 0.5 * (edges[:-1, :-1] + edges[1:, 1:])
    assert_allclose(middles[..., 0], friction)
    assert_allclose(middles[..., 1], 1e-3 * load)
    (title,) = [figure.get_suptitle()]
    assert title == "Critical torque: Wet patches"
    caption = figure.legends[0].get_title().get_text()
    assert "Torque at which the wheel slips away in a slow ramp." in caption.replace("\n", " ")
    assert r"5 \$ a run." in caption.replace("\n", " ")


def test_lines_of_equal_value_are_where_the_value_is() -> None:
    (axes,) = maps_of(map_figure(analysed(), "critical_torque"))
    lines = next(c for c in axes.collections if isinstance(c, QuadContourSet))
    assert numbers(lines.levels).size >= 3
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        x, y = corners(path).T
        # Linear between points of a function that is bilinear.
        assert_allclose(1e-3 * torque(x, 1e3 * y), level, rtol=2e-3)
    assert [float(text.get_text()) for text in lines.labelTexts]


def test_lines_are_calm_where_runs_are_noisy() -> None:
    rng = np.random.default_rng(3)
    friction, length = np.linspace(0.3, 0.9, 31), np.linspace(10.0, 130.0, 25)

    def noisy(f: Any, s: Any) -> Any:
        smooth = f + s / 120.0
        return [smooth, smooth + rng.normal(0.0, 0.05, f.shape)]

    figure = map_figure(
        grid({"adhesion_utilisation": noisy}, friction=friction, length=length),
        "adhesion_utilisation",
    )
    smooth, loud = maps_of(figure)[:2]
    assert "median over 3 by 3" in figure.legends[0].get_title().get_text().replace("\n", " ")
    for axes, error in ((smooth, 0.01), (loud, 0.05)):
        lines = next(c for c in axes.collections if isinstance(c, QuadContourSet))
        for level, path in zip(numbers(lines.levels), lines.get_paths(), strict=True):
            x, y = corners(path).T
            off = np.abs(x + y / 120.0 - level / 100.0)
            assert off.mean() < error
            assert len(path.to_polygons(closed_only=False)) <= 2


def test_labels_of_lines_that_lie_close_together_do_not_meet() -> None:
    friction, length = np.linspace(0.3, 0.9, 31), np.linspace(10.0, 130.0, 25)
    steep = {"clearing_time": lambda f, s: 1e-3 * (10.0 + np.tanh(60.0 * (f - 0.6)) + s / 100.0)}
    figure = map_figure(grid(steep, friction=friction, length=length), "clearing_time")
    (axes,) = maps_of(figure)
    shown = [text.get_window_extent() for text in axes.texts]
    assert shown
    assert not any(one.overlaps(other) for one, other in combinations(shown, 2))


def test_border_is_where_the_demand_is_critical() -> None:
    for outcome in ("critical_torque", "clearing_time", "stable"):
        figure = map_figure(analysed(), outcome)
        (axes,) = maps_of(figure)
        border = [c for c in axes.collections if isinstance(c, QuadContourSet)][-1]
        assert_allclose(numbers(border.levels), 0.0)
        (path,) = border.get_paths()
        assert_allclose(corners(path)[:, 1], 205.0)
        assert "demand = critical torque" in legend_texts(figure)


def test_zero_is_a_border() -> None:
    made = grid(
        {"worst_pole": lambda f, p: 100.0 * (f - 0.5) + 0.0 * p}, friction=FRICTION, load=LOAD
    )
    made["worst_pole"] = made["worst_pole"] + 1e-9 * made["load"]  # so that both axes matter
    made["worst_pole"].attrs = {"units": "1/s"}
    figure = map_figure(made, "worst_pole")
    (axes,) = maps_of(figure)
    border = [c for c in axes.collections if isinstance(c, QuadContourSet)][-1]
    (path,) = border.get_paths()
    assert_allclose(corners(path)[:, 0], 0.5, atol=1e-4)
    assert any(text.startswith("zero") for text in legend_texts(figure))


def test_what_is_no_number_is_marked(tmp_path: Path) -> None:
    made = analysed().copy(deep=True)
    made["clearing_time"][0, -1] = np.nan
    times = made["clearing_time"].values
    figure = map_figure(made, "clearing_time")
    check_all(figure, tmp_path)
    (axes,) = maps_of(figure)
    for name, colour, where in (
        ("survives any length", "white", np.isinf(times)),
        ("not held even before the patch", ZERO, times == 0.0),
        ("no value", NO_VALUE, np.isnan(times)),
    ):
        assert name in legend_texts(figure)
        assert where.any()
        assert_array_equal(marked(axes, colour, FRICTION, 1e-3 * LOAD), where.T)


def test_yes_or_no_has_no_colour_bar(tmp_path: Path) -> None:
    figure = map_figure(analysed(), "stable")
    check_all(figure, tmp_path)
    assert len(figure.axes) == 1
    assert {"held", "not held"} <= set(legend_texts(figure))
    assert_array_equal(
        numbers(cells(figure.axes[0]).get_array()), 1.0 - analysed()["stable"].values.T
    )


@pytest.mark.slow
def test_controllers_share_one_scale(tmp_path: Path) -> None:
    figure = map_figure(compared(), "slip_work")
    check_all(figure, tmp_path)
    *panels, last = maps_of(figure)
    assert [axes.get_title(loc="left") for axes in panels] == [
        "open loop",
        "cut and re-apply",
        "PI creep control",
    ]
    norms = [cells(axes).norm for axes in panels]
    known = 1e-3 * compared()["slip_work"].values.ravel()
    known = known[np.isfinite(known)]
    for norm in norms:
        assert isinstance(norm, LogNorm)
        assert (norm.vmin, norm.vmax) == pytest.approx((known.min(), known.max()))
    for axes, name in zip(panels, CONTROLLERS, strict=True):
        values = 1e-3 * compared()["slip_work"].sel(controller=name).values.T
        assert_allclose(numbers(cells(axes).get_array()), values)
    assert last.get_title(loc="left") == "controller with the minimum"
    assert axes.get_xscale() == "linear"
    assert axes.get_yscale() == "log"
    for axes, flags in zip(panels, compared()["failed"].values, strict=True):
        shown = marked(axes, FAILED, FRICTION, compared()["length"])
        assert_array_equal(shown, flags.T > 0)
    assert "failed" in legend_texts(figure)
    assert "no value" not in legend_texts(figure)
    edges = numbers(cells(panels[0]).get_coordinates())[:, 0, 1]
    assert_allclose(np.sqrt(edges[1:] * edges[:-1]), compared()["length"])


def test_the_best_is_the_best() -> None:
    for name, sign in (("adhesion_utilisation", 1.0), ("recovery_time", -1.0)):
        outcome = compared()[name]
        first = best(outcome)
        assert first is not None
        level = outcome.values if name == "adhesion_utilisation" else np.log(outcome.values)
        values = level[np.isfinite(level)]
        seen = set()
        for place in np.ndindex(first.shape):
            here = sign * level[(slice(None), *place)]
            here = np.where(np.isnan(here), -np.inf, here)
            order = np.argsort(here)
            alike = here[order[-1]] - here[order[-2]] <= ALIKE * np.ptp(values)
            assert first.values[place] == (0 if alike else 1 + order[-1])
            seen.add(float(first.values[place]))
        assert {0.0, 2.0} <= seen
    assert best(compared()["adhesion_utilisation"].rename("energy_defect")) is None
    assert best(compared()["adhesion_utilisation"].isel(controller=[0])) is None
    alike = compared()["adhesion_utilisation"].isel(controller=[0, 0])
    assert best(alike) is None


@pytest.mark.slow
def test_coarse_maps_have_their_numbers(tmp_path: Path) -> None:
    made = compared().isel(length=slice(0, 4))
    figure = map_figure(made, "adhesion_utilisation")
    check_all(figure, tmp_path)
    axes = maps_of(figure)[1]
    shown = {text.get_position(): float(text.get_text()) for text in axes.texts}
    values = made["adhesion_utilisation"].sel(controller="threshold")
    assert len(shown) == values.size
    for (x, y), value in shown.items():
        assert value == pytest.approx(100.0 * float(values.sel(friction=x, length=y)), abs=0.05)


@pytest.mark.slow
def test_further_axes_make_rows_of_maps(tmp_path: Path) -> None:
    made = grid(
        {
            "adhesion_utilisation": lambda f, s, p: np.array(utilisation(f, s)) * p / 265e3,
            "critical_torque": lambda f, s, p: torque(f, p) + s,
        },
        friction=FRICTION,
        length=np.linspace(10.0, 130.0, 6),
        load=LOAD[::2],
    )
    figure = map_figure(made, "adhesion_utilisation")
    check_all(figure, tmp_path)
    titles = [axes.get_title(loc="left") for axes in maps_of(figure)]
    assert len(titles) == 9
    assert titles[0] == "open loop, axle load 177\u00a0kN"
    assert titles[-1] == "PI creep control, axle load 265\u00a0kN"
    alone = map_figure(made, "critical_torque")
    check_all(alone, tmp_path)
    assert len(maps_of(alone)) == LOAD[::2].size


@pytest.mark.slow
@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_a_map_of_nothing_can_be_drawn(value: float, tmp_path: Path) -> None:
    made = grid(
        {"clearing_time": lambda f, p: np.where((f == f.min()) & (p == p.min()), 0.1, value)},
        friction=FRICTION,
        load=LOAD,
    )
    check_all(map_figure(made, "clearing_time"), tmp_path)
    made["clearing_time"][:] = value
    check_all(map_figure(made, "clearing_time"), tmp_path)
