"""Figures of sweeps: maps over two axes, lines over one, distributions of random samples."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import figure_checks as checks
import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from map_data import (
    CONTROLLERS,
    DESCRIBED,
    FRICTION,
    LOAD,
    analysed,
    compared,
    grid,
    sampled,
    torque,
    utilisation,
)
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.colors import to_rgba
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import ArrayLike, NDArray
from strategies import examples

from contactlib.figures import draw_maps, map_figure, maps, page_size
from contactlib.runs.outcomes import Outcome

NAMES = ["open loop", "cut and re-apply", "PI creep control"]  # of CONTROLLERS in figures


def numbers(values: Any) -> NDArray[np.float64]:
    """Values of a drawn object; nan where it is masked."""
    return np.asarray(np.ma.asarray(values, dtype=np.float64).filled(np.nan))


def cells(axes: Axes) -> QuadMesh:
    (mesh,) = (c for c in axes.collections if isinstance(c, QuadMesh))
    return mesh


def marked(axes: Axes, colour: str, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
    """Whether points, over (y, x), are marked in a colour."""
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = np.zeros(len(points), dtype=bool)
    for marks in axes.collections:
        faces = numbers(marks.get_facecolor())
        if isinstance(marks, PolyCollection) and np.allclose(faces, to_rgba(colour)):
            for path in marks.get_paths():
                inside |= path.contains_points(points)
    return inside.reshape(np.size(y), np.size(x))


def legend_texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def caption(figure: Figure) -> str:
    return figure.legends[0].get_title().get_text().replace("\n", " ").replace("\u00a0", " ")


def panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]


def titles(figure: Figure) -> list[str]:
    return [axes.get_title(loc="left").replace("\u00a0", " ") for axes in panels(figure)]


# ---- maps --------------------------------------------------------------------------------------


def test_map_shows_the_values(tmp_path: Path) -> None:
    figure = map_figure(analysed().isel(load=slice(None, None, -1)), "critical_torque")
    checks.check_all(figure, tmp_path)
    (axes,) = panels(figure)
    mesh = cells(axes)
    load, friction = np.meshgrid(LOAD, FRICTION, indexing="ij")
    assert_allclose(numbers(mesh.get_array()), 1e-3 * torque(friction, load))
    edges = numbers(mesh.get_coordinates())
    middles = 0.5 * (edges[:-1, :-1] + edges[1:, 1:])
    assert_allclose(middles[..., 0], friction)
    assert_allclose(middles[..., 1], 1e-3 * load)
    assert figure.get_suptitle() == "Critical torque: Wet patches"
    assert "Torque at which the wheel slips away in a slow ramp. Ranges" in caption(figure)
    assert caption(figure).endswith(r"5 \$ a run.")
    assert axes.get_ylabel() == "axle load [kN]"


@examples(60)
@given(st.floats(-3.0, 6.0), st.floats(0.0, 4.0))
def test_colours_change_at_round_values_around_all_values(low: float, span: float) -> None:
    for first in (10.0**low, -(10.0**low)):
        values = np.array([first, first * 10.0**span])
        levels = maps._levels(values, Outcome("1", ""))
        rounding = 1e-10 * np.abs(values).max()
        assert levels[0] - rounding <= values.min() <= values.max() <= levels[-1] + rounding
        assert 2 <= levels.size <= 20
        digits = [float(f"{level:.1e}") for level in levels]
        if first > 0.0 and span > 2.0:
            assert_allclose(digits, levels)
            assert levels[1] > values[0]


def test_controllers_share_one_scale(tmp_path: Path) -> None:
    figure = map_figure(compared(), "slip_work")
    checks.check_all(figure, tmp_path)
    assert titles(figure) == NAMES
    assert len({id(cells(axes).norm) for axes in panels(figure)}) == 1
    length = compared()["length"]
    for axes, name in zip(panels(figure), CONTROLLERS, strict=True):
        case = compared().sel(controller=name)
        assert_allclose(numbers(cells(axes).get_array()), 1e-3 * case["slip_work"].values.T)
        assert axes.get_xscale() == "linear"
        assert axes.get_yscale() == "log"
        assert_array_equal(marked(axes, "#8A8A8A", FRICTION, length), case["failed"].values.T > 0)
        edges = numbers(cells(axes).get_coordinates())[:, 0, 1]
        assert_allclose(np.sqrt(edges[1:] * edges[:-1]), length)
    assert "failed" in legend_texts(figure)
    assert "no value" not in legend_texts(figure)


def test_a_third_axis_has_panels() -> None:
    made = grid(
        {
            "utilisation": lambda f, s, p: np.array(utilisation(f, s)) * p / 265e3,
            "critical_torque": lambda f, s, p: torque(f, p) + s,
        },
        friction=FRICTION,
        length=np.linspace(10.0, 130.0, 6),
        load=LOAD[::2],
    )
    figure = map_figure(made, "utilisation")
    checks.check_axes(figure)
    checks.check_layout(figure)
    loads = [f"axle load {1e-3 * load:.4g} kN" for load in (LOAD[0], *LOAD[2:-1:4], LOAD[-1])]
    shown = titles(map_figure(made, "critical_torque"))
    assert len(shown) == maps.PANELS
    assert {shown[0], shown[-1]} == {loads[0], loads[-1]}
    assert titles(figure) == [f"{name}, {load}" for load in shown for name in NAMES]


def test_long_axes_come_first_and_the_caption_names_the_rest() -> None:
    made = grid(
        {"critical_torque": lambda a, b, c, d, e: a + b + c + d + 0.0 * e},
        length=[1, 2, 3],
        friction=FRICTION,
        damping=[1, 2],
        load=LOAD,
        inertia=[1, 2],
    )
    figure = map_figure(made, "critical_torque")
    assert "Shown at damping of the drive 2 N m s. Does not depend on inertia" in caption(figure)
    assert titles(figure) == [f"length of the patch {i} m" for i in (1, 2, 3)]
    load, friction = np.meshgrid(LOAD, FRICTION, indexing="ij")
    for length, axes in zip((1.0, 2.0, 3.0), panels(figure), strict=True):
        shown = numbers(cells(axes).get_array())
        assert_allclose(shown, 1e-3 * (length + friction + 2.0 + load))


def test_border_is_where_the_demand_is_critical_or_the_outcome_zero() -> None:
    def pole(friction: Any, load: Any) -> Any:
        return 100.0 * (friction - 0.5) + 1e-9 * load  # both axes matter

    zero = grid({"worst_pole": pole}, friction=FRICTION, load=LOAD)
    for data, outcome, number, at, text in (
        (analysed(), "critical_torque", 1, 205.0, "demand = critical torque"),
        (analysed(), "clearing_time", 1, 205.0, "demand = critical torque"),
        (zero, "worst_pole", 0, 0.5, "zero: below it no slip-away"),
    ):
        figure = map_figure(data, outcome)
        (axes,) = panels(figure)
        (border,) = [c for c in axes.collections if isinstance(c, QuadContourSet)]
        (path,) = border.get_paths()
        assert_allclose(numbers(path.vertices)[:, number], at, atol=1e-4)
        assert text in legend_texts(figure)


def test_cells_without_a_number_are_marked(tmp_path: Path) -> None:
    made = analysed().copy(deep=True)
    made["clearing_time"][0, -1] = np.nan
    times = made["clearing_time"].values
    figure = map_figure(made, "clearing_time")
    checks.check_all(figure, tmp_path)
    (axes,) = panels(figure)
    for name, colour, where in (
        ("survives any length", "white", np.isinf(times)),
        ("not held even before the patch", "#E4E4E4", times == 0.0),
        ("no value", "#C8C8C8", np.isnan(times)),
    ):
        assert name in legend_texts(figure)
        assert where.any()
        assert_array_equal(marked(axes, colour, FRICTION, 1e-3 * LOAD), where.T)


def test_yes_or_no_are_named_categories(tmp_path: Path) -> None:
    figure = map_figure(analysed(), "stable")
    checks.check_all(figure, tmp_path)
    (axes,) = figure.axes  # no colour bar
    assert {"held", "not held"} <= set(legend_texts(figure))
    assert_array_equal(numbers(cells(axes).get_array()), analysed()["stable"].values.T)


@pytest.mark.slow
@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_a_map_of_nothing_can_be_drawn(value: float, tmp_path: Path) -> None:
    made = grid(
        {"clearing_time": lambda f, p: np.where((f == f.min()) & (p == p.min()), 0.1, value)},
        friction=FRICTION,
        load=LOAD,
    )
    checks.check_all(map_figure(made, "clearing_time"), tmp_path)
    made["clearing_time"][:] = value
    checks.check_all(map_figure(made, "clearing_time"), tmp_path)


# ---- lines -------------------------------------------------------------------------------------


def test_lines_show_the_values(tmp_path: Path) -> None:
    made = compared().isel(length=-1, drop=True)
    figure = map_figure(made, "recovery_time")
    checks.check_all(figure, tmp_path)
    (axes,) = figure.axes
    for name, text in zip(CONTROLLERS, NAMES, strict=True):
        x, y, _ = checks.lines(axes, text)
        values = made["recovery_time"].sel(controller=name).values
        assert_allclose(x, FRICTION)
        assert_allclose(y, 1e3 * np.where(np.isfinite(values), values, np.nan))
    of_open_loop = made["recovery_time"].sel(controller="open_loop").values
    for marker, where in ((6, np.isinf(of_open_loop)), ("x", made["failed"][0].values > 0)):
        (marks,) = [line for line in axes.lines if line.get_marker() == marker]
        assert where.any()
        assert_allclose(numbers(marks.get_xdata()), FRICTION[where])
    assert legend_texts(figure) == [NAMES[0], "does not recover", "failed", *NAMES[1:]]


def test_few_values_of_a_second_axis_are_lines(tmp_path: Path) -> None:
    made = compared().isel(length=[0, 2, 5])
    figure = map_figure(made, "utilisation")
    checks.check_all(figure, tmp_path)
    for axes, name in zip(figure.axes, CONTROLLERS, strict=True):
        for length in made["length"].values:
            _, y, _ = checks.lines(axes, f"length of the patch {length:.4g}\u00a0m")
            expected = made["utilisation"].sel(controller=name, length=length)
            assert_allclose(y, 100.0 * expected)


def test_a_line_of_yes_or_no_has_words(tmp_path: Path) -> None:
    figure = map_figure(analysed()[["stable"]].isel(friction=3), "stable")
    checks.check_all(figure, tmp_path)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["held", "not held"]


# ---- random samples ----------------------------------------------------------------------------


def test_sample_shows_the_distribution(tmp_path: Path) -> None:
    figure = map_figure(sampled(), "utilisation")
    checks.check_all(figure, tmp_path)
    lines = figure.axes[0].lines
    for curve, points, name in zip(lines[::2], lines[1::2], CONTROLLERS, strict=False):
        values = sampled()["utilisation"].sel(controller=name).dropna("run").values / 0.01
        x, share = (numbers(part)[1:] for part in curve.get_data())
        upto = [np.mean(values <= at) for at in x]
        assert_allclose(share, upto, atol=1.01 / values.size)
        for value, part in zip(*map(numbers, points.get_data()), strict=True):
            assert np.mean(values <= value) >= part > np.mean(values < value)
    assert any("3 failed" in text for text in legend_texts(figure))


def test_infinite_values_are_missing_at_the_top(tmp_path: Path) -> None:
    figure = map_figure(sampled(), "clearing_time")
    checks.check_all(figure, tmp_path)
    infinite = float(np.isinf(sampled()["clearing_time"]).mean())
    x, share = map(numbers, figure.axes[0].lines[0].get_data())
    assert share[np.isfinite(x)].max() == pytest.approx(1.0 - infinite)
    assert f"{100.0 * infinite:.3g} %: survives any length" in legend_texts(figure)[0]


def test_strongest_parameter_comes_first() -> None:
    figure = map_figure(sampled(), "utilisation")
    bars, scatter = figure.axes[1], figure.axes[2]
    assert bars.get_yticklabels()[0].get_text().replace("\n", " ") == DESCRIBED["friction"][1]
    assert scatter.get_xlabel().replace("\n", " ") == f"{DESCRIBED['friction'][1]} [1]"
    widths = [container[0].get_width() for container in bars.containers]
    friction = sampled()["friction"].values
    for width, name in zip(widths, CONTROLLERS, strict=False):
        values = sampled()["utilisation"].sel(controller=name).values
        known = ~np.isnan(values)
        d = np.argsort(np.argsort(friction[known])) - np.argsort(np.argsort(values[known]))
        n = int(known.sum())
        assert width == pytest.approx(1.0 - 6.0 * np.sum(d**2) / (n * (n**2 - 1.0)))
    assert widths[0] > 0.9
    assert widths[1] < -0.5
    assert "A rank correlation shows rising or falling dependence only" in caption(figure)


def test_chance_stays_in_its_band() -> None:
    figure = map_figure(sampled(), "clearing_time")
    rectangles = [p for p in figure.axes[1].patches if isinstance(p, Rectangle)]
    (limit,) = (0.5 * p.get_width() for p in rectangles if p.get_height() == 1.0)
    rng = np.random.default_rng(2)

    def strength(count: int) -> float:
        return maps.rank_correlation(*(xr.DataArray(rng.random(count)) for _ in range(2)))

    strengths = np.abs([strength(200) for _ in range(500)])
    expected = pytest.approx(0.99, abs=4.0 * math.sqrt(0.0099 / 500))
    assert np.mean(strengths < limit) == expected


@pytest.mark.parametrize("axes", [{}, {"friction": FRICTION}])
def test_seeds_are_points(axes: dict[str, Any], tmp_path: Path) -> None:
    """Nothing lies between two seeds, and they have no order."""
    seeds = np.arange(4.0)
    made = grid(
        {"clearing_time": lambda *values: 1.0 + values[0] + np.cos(7.0 * values[-1])},
        **axes,
        seed=seeds,
    )
    figure = map_figure(made, "clearing_time")
    checks.check_saved(figure, tmp_path)
    (panel,) = figure.axes
    assert len(panel.lines) == (len(seeds) if axes else 1)
    assert {(line.get_linestyle(), line.get_marker()) for line in panel.lines} == {("None", "o")}
    assert legend_texts(figure) == (["one seed each"] if axes else [])
    if not axes:
        assert all(float(tick).is_integer() for tick in panel.get_xticks())


def test_outcomes_with_a_wrong_speed_are_marked() -> None:
    made = compared().copy()
    off = (made["friction"] > 0.65) & (made["length"] > 50.0) & made["slip_work"].notnull()
    made["speed_misjudged"] = off.astype(float)
    text = "speed estimate off by > 5 %"
    for part, marker in ((made, "X"), (made.isel(length=-1, drop=True), "o")):
        figure = map_figure(part, "slip_work")
        assert text in legend_texts(figure)
        drawn = [m for axes in panels(figure) for m in checks.marks(axes, marker)]
        found = [m for m in drawn if m.get_linestyle() == "None"]
        counts = [np.size(np.asarray(m.get_xdata())) for m in found]
        assert sum(counts) == int(part["speed_misjudged"].sum())
    assert text not in legend_texts(map_figure(made, "speed_misjudged"))[2:]
    random = sampled().assign(speed_misjudged=("run", np.arange(200.0) < 3.0))
    assert f"; 3: {text}" in legend_texts(map_figure(random, "utilisation"))[0]


# ---- the user's style --------------------------------------------------------------------------


def test_lines_keep_dashes_and_marks_in_the_user_s_colours() -> None:
    made = compared().isel(length=-1, drop=True)
    with mpl.style.context("dark_background"):
        figures = map_figure(made, "recovery_time"), map_figure(sampled(), "utilisation")
        colour = mpl.rcParams["axes.prop_cycle"].by_key()["color"][0]
    for figure in figures:
        checks.check_styles(figure)
    lines = figures[0].axes[0].lines
    assert to_rgba(str(lines[0].get_color())) == to_rgba(colour)
    assert lines[0].get_marker() == figures[1].axes[2].lines[0].get_marker() == "o"


@pytest.mark.slow
def test_maps_fit_on_a_slide() -> None:
    with mpl.rc_context({"font.size": 16.0}), page_size("16:9"):
        checks.check_layout(map_figure(compared(), "slip_work"))


# ---- words and files ---------------------------------------------------------------------------


SIZES = {"": 1.0, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}


@examples(60)
@given(st.floats(-2.0, 11.0), st.sampled_from(["N", "N.m", "J", "s", "m"]))
def test_prefixes_keep_the_quantity(power: float, unit: str) -> None:
    array = xr.DataArray([0.0, -(10.0**power)], name="x", attrs={"units": unit})
    _, values, attrs = maps._scaled(array)
    prefix = attrs["units"].removesuffix(unit.replace(".", " "))
    assert_allclose(values * SIZES[prefix], array.values)
    if -3.0 < power < 12.0 and unit in {"N", "N.m", "J"}:
        assert abs(values[1]) < 1e3 * 1.000001


def test_labels() -> None:
    def label(name: str, unit: str, value: float, **attrs: str) -> str:
        _, _, shown = maps._scaled(xr.DataArray([value], name=name, attrs={"units": unit, **attrs}))
        return f"{shown['long_name']} [{shown['units']}]"

    assert label("largest_creepage", "1", 0.1, display_units="%") == "largest creepage [%]"
    assert label("jerk", "m/s3", 2.0) == "jerk [m/s$^3$]"
    assert label("critical_torque", "N.m", 2e4, long_name="a sentence") == "critical torque [kN m]"
    axis = xr.DataArray([2e4], dims="cost", name="cost", attrs={"long_name": "US$"})
    _, _, shown = maps._scaled(axis.assign_coords(cost=axis)["cost"])
    assert shown["long_name"] == r"US\$"


def test_every_outcome_has_its_files(tmp_path: Path) -> None:
    made = compared().isel(length=0, drop=True)
    made["seed"] = 1.0  # of no axis
    written = draw_maps(made, tmp_path / "new" / "maps")
    expected = ["utilisation", "slip_work", "recovery_time"]
    assert [path.name for path in written] == [
        f"{n}.{kind}" for n in expected for kind in ("png", "svg")
    ]
    assert all(path.stat().st_size > 1000 for path in written)


def test_unknown_outcomes_are_refused() -> None:
    message = "outcome = 'stabel' must be one of: critical_torque, .*stable"
    with pytest.raises(ValueError, match=message):
        map_figure(analysed(), "stabel")


def test_draws_at_the_points_of_a_grid_are_their_median_and_of_one_point_a_sample() -> None:
    plain, rng = compared(), np.random.default_rng(4)
    noise = xr.DataArray(rng.normal(size=41), dims="draw", attrs={"units": "1", "long_name": "x"})
    draws = plain[["slip_work", "failed"]].expand_dims(draw=noise.size, axis=-1).copy(deep=True)
    draws["slip_work"].values[...] *= np.exp(noise.values)
    draws = draws.assign_coords(x=noise, run=(("friction", "length", "draw"), np.zeros((7, 6, 41))))
    (_, *drawn), (_, *known) = (
        [cells(axes).get_array() for axes in panels(map_figure(data, "slip_work"))]
        for data in (draws, plain)
    )
    factor = np.exp(np.median(noise))
    for one, other in zip(drawn, known, strict=True):
        assert_allclose(numbers(one), factor * numbers(other), rtol=1e-12)
    figure = map_figure(draws.isel(friction=[5], length=[2]), "slip_work")
    assert "Distribution over 41 runs" in titles(figure)
    assert "x" in [text.get_text() for text in figure.axes[1].get_yticklabels()]
