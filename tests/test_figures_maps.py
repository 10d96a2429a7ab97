"""The figures of sweeps: what is drawn, read back from the axes, against the dataset."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import figure_checks as checks
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.colors import LogNorm, to_rgba
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import ArrayLike, NDArray

from contactlib.figures import draw_maps, map_figure
from contactlib.figures.maps.categories import ALIKE, best
from contactlib.figures.maps.cells import FAILED, NO_VALUE, ZERO
from contactlib.figures.maps.layout import layout
from contactlib.figures.maps.samples import rank_correlation
from contactlib.figures.maps.words import words

CONTROLLERS = ["open_loop", "threshold", "creep_pi"]
DESCRIBED = {
    "friction": ("1", "friction on the patch over that before it"),
    "load": ("N", "axle load"),
    "length": ("m", "length of the patch"),
    "damping": ("N.m.s", "damping of the drive"),
    "inertia": ("kg.m2", "inertia of wheelset and motor"),
    "critical_torque": ("N.m", "torque at which a slow ramp runs away"),
    "torque_margin": ("1", "critical torque over the largest demand, less one"),
    "clearing_time": ("s", "longest time that the largest demand survives"),
    "worst_pole": ("1/s", "largest pole of the falling branch"),
    "stable": ("1", "whether the largest demand is held"),
    "adhesion_utilisation": ("1", "part of what can be transmitted that is"),
    "slip_work": ("J", "work of slip"),
    "recovery_time": ("s", "longest lack of force"),
}
ABOUT = {"title": "Wet patches", "source": "Ranges: chosen, at 5 $ a run"}


def described(name: str, dims: Any, values: ArrayLike) -> xr.DataArray:
    unit, text = DESCRIBED[name]
    return xr.DataArray(values, dims=dims, name=name, attrs={"units": unit, "long_name": text})


def grid(outcomes: dict[str, Any], **axes: ArrayLike) -> xr.Dataset:
    """Outcomes as functions of the axes; those that give a row more are of the controllers."""
    values = np.meshgrid(*(np.asarray(v, dtype=float) for v in axes.values()), indexing="ij")
    data = xr.Dataset(attrs=ABOUT)
    for name, function in outcomes.items():
        found = np.array(function(*values))
        dims = (*["controller"] * (found.ndim - len(axes)), *axes)
        if name == "failed":
            data[name] = (dims, found)
        else:
            data[name] = described(name, dims, found)
    for name, at in axes.items():
        data = data.assign_coords({name: described(name, name, np.asarray(at, dtype=float))})
    if "controller" in data.dims:
        data = data.assign_coords(controller=CONTROLLERS[: data.sizes["controller"]])
    return data


FRICTION, LOAD = np.linspace(0.3, 0.9, 7), np.linspace(177e3, 265e3, 9)


def torque(friction: Any, load: Any) -> Any:
    return 0.12 * friction * load


def clearing(friction: Any, load: Any) -> Any:
    """Not held, for some time, and for good."""
    margin = load / 205e3 - 1.0
    return np.where(margin < 0.0, 0.0, np.where(friction > 0.75, np.inf, 0.5 * margin * friction))


def utilisation(friction: Any, second: Any) -> Any:
    part = (1.0 - friction) * second / np.max(second)
    return [1.0 - 0.8 * part, 1.0 - 0.3 * part**2, 0.97 - 0.1 * part]


@pytest.fixture(scope="module")
def analysed() -> xr.Dataset:
    return grid(
        {
            "critical_torque": torque,
            "torque_margin": lambda friction, load: load / 205e3 - 1.0 + 0.0 * friction,
            "clearing_time": clearing,
            "stable": lambda friction, load: np.where(torque(friction, load) > 15e3, 1.0, 0.0),
        },
        friction=FRICTION,
        load=LOAD,
    )


@pytest.fixture(scope="module")
def compared() -> xr.Dataset:
    def failed(friction: Any, length: Any) -> Any:
        lost = (friction < 0.35) & (length > 90.0)
        return np.array([lost, 0 * lost, 0 * lost], dtype=np.int8)

    def known(friction: Any, length: Any) -> Any:
        return np.where(failed(friction, length) > 0, np.nan, utilisation(friction, length))

    outcomes = {
        "adhesion_utilisation": known,
        "slip_work": lambda f, s: 1e4 * 10.0 ** (5.0 * (1.0 - known(f, s))),
        "recovery_time": lambda f, s: np.where(
            known(f, s) < 0.6, np.inf, 5.0 * (1.0 - known(f, s))
        ),
        "failed": failed,
    }
    return grid(outcomes, friction=FRICTION, length=np.geomspace(10.0, 130.0, 6))


@pytest.fixture(scope="module")
def sampled() -> xr.Dataset:
    rng = np.random.default_rng(1)
    count = 200
    friction, load, damping = (
        rng.uniform(0.3, 0.9, count),
        rng.normal(2e5, 1e4, count),
        rng.random(count),
    )
    noise = 0.02 * rng.standard_normal((2, count))
    used = np.array([0.6 + 0.3 * friction, 0.95 - 0.1 * friction]) + noise
    used[1, :3] = np.nan
    data = xr.Dataset(attrs=ABOUT)
    data["adhesion_utilisation"] = described("adhesion_utilisation", ("controller", "run"), used)
    data["clearing_time"] = described(
        "clearing_time", "run", np.where(friction > 0.75, np.inf, 0.02 * friction * load / 2e5)
    )
    data["failed"] = (("controller", "run"), np.isnan(used).astype(np.int8))
    coords = {"friction": friction, "load": load, "damping": damping}
    data = data.assign_coords({k: described(k, "run", v) for k, v in coords.items()})
    return data.assign_coords(controller=CONTROLLERS[:2], run=np.arange(count))


def numbers(values: Any) -> NDArray[np.float64]:
    """What a drawn object holds; nan where it is masked."""
    return np.asarray(np.ma.asarray(values, dtype=np.float64).filled(np.nan))


def cells(axes: Axes) -> QuadMesh:
    (mesh,) = (c for c in axes.collections if isinstance(c, QuadMesh))
    return mesh


def corners(path: Any) -> NDArray[np.float64]:
    return numbers(path.vertices)


def marked(axes: Axes, colour: str, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
    """Which points, over (y, x), are marked in a colour."""
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = np.zeros(len(points), dtype=bool)
    for found in axes.collections:
        if not isinstance(found, PolyCollection):
            continue
        if np.allclose(numbers(found.get_facecolor()), to_rgba(colour)):
            for path in found.get_paths():
                inside |= path.contains_points(points)
    return inside.reshape(np.size(y), np.size(x))


def legend_texts(figure: Figure) -> list[str]:
    (found,) = figure.legends
    return [text.get_text() for text in found.get_texts()]


def maps_of(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]


def looks_right(figure: Figure, folder: Path) -> None:
    checks.check_axes(figure)
    checks.check_layout(figure)
    checks.check_styles(figure)
    checks.check_saved(figure, folder)


# What goes where


def test_long_axes_are_those_of_the_map() -> None:
    def outcome(a: Any, b: Any, c: Any, d: Any) -> Any:
        return a + b + c + d

    made = grid(
        {"critical_torque": outcome}, length=[1, 2, 3], friction=FRICTION, damping=[1, 2], load=LOAD
    )
    chosen = layout(made, "critical_torque")
    assert [axis.name for axis in chosen.axes] == ["friction", "load"]
    assert chosen.further is not None
    assert chosen.further.name == "length"
    assert chosen.note == "Shown at damping of the drive 2\u00a0N m s."
    assert [case.further for case in chosen.cases] == [
        f"length of the patch {i}\u00a0m" for i in (1, 2, 3)
    ]
    load, friction = np.meshgrid(LOAD, FRICTION, indexing="ij")
    for length, case in zip((1.0, 2.0, 3.0), chosen.cases, strict=True):
        assert_allclose(case.values, length + friction + 2.0 + load)


def test_an_axis_that_does_not_matter_is_left_out(analysed: xr.Dataset) -> None:
    chosen = layout(analysed[["torque_margin"]], "torque_margin")
    assert [axis.name for axis in chosen.axes] == ["load"]
    assert chosen.note == f"Does not depend on {DESCRIBED['friction'][1]}."
    assert_allclose(chosen.cases[0].values, LOAD / 205e3 - 1.0)


def test_values_are_sorted_and_at_most_nine_maps_are_drawn() -> None:
    length = np.arange(20.0)[::-1]
    made = grid(
        {"critical_torque": lambda f, p, s: f + p + s},
        friction=FRICTION[::-1],
        load=LOAD,
        length=length,
    )
    chosen = layout(made, "critical_torque")
    assert_array_equal(chosen.axes[0], FRICTION)
    assert chosen.further is not None
    assert len(chosen.cases) == 9
    assert_array_equal(chosen.further[[0, -1]], [0.0, 19.0])
    for at, case in zip(chosen.further.values, chosen.cases, strict=True):
        assert_allclose(case.values, FRICTION + LOAD[:, None] + at)


SIZES = {"": 1.0, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}


@settings(derandomize=True, deadline=None, max_examples=60)
@given(st.floats(-2.0, 11.0), st.sampled_from(["N", "N.m", "J", "s", "m"]))
def test_prefixes_keep_the_quantity(power: float, unit: str) -> None:
    array = xr.DataArray([0.0, -(10.0**power)], name="x", attrs={"units": unit})
    found = words(array)
    prefix = found.unit.removesuffix(unit.replace(".", " "))
    assert found.factor * SIZES[prefix] == pytest.approx(1.0)
    if -3.0 < power < 12.0 and unit in {"N", "N.m", "J"}:
        assert 10.0**power * found.factor < 1e3 * 1.000001


def test_labels() -> None:
    def label(name: str, unit: str, value: float, **attrs: str) -> str:
        return words(xr.DataArray([value], name=name, attrs={"units": unit, **attrs})).label

    assert label("largest_creepage", "1", 0.1) == "largest creepage  [%]"
    assert label("jerk", "m/s3", 2.0) == "jerk  [m/s$^3$]"
    assert label("critical_torque", "N.m", 2e4, long_name="a sentence") == "critical torque  [kN m]"
    axis = xr.DataArray([2e4], dims="mass", name="mass", attrs={"units": "kg", "long_name": "US$"})
    assert words(axis.assign_coords(mass=axis)["mass"]).label == r"US\$  [t]"


# Maps


def test_map_shows_the_values(analysed: xr.Dataset, tmp_path: Path) -> None:
    figure = map_figure(analysed, "critical_torque")
    looks_right(figure, tmp_path)
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
    assert "Torque at which a slow ramp runs away." in caption.replace("\n", " ")
    assert r"5 \$ a run." in caption.replace("\n", " ")


def test_lines_of_equal_value_are_where_the_value_is(analysed: xr.Dataset) -> None:
    (axes,) = maps_of(map_figure(analysed, "critical_torque"))
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


def test_border_is_where_the_demand_is_critical(analysed: xr.Dataset) -> None:
    for outcome in ("critical_torque", "clearing_time", "stable"):
        figure = map_figure(analysed, outcome)
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


def test_what_is_no_number_is_marked(analysed: xr.Dataset, tmp_path: Path) -> None:
    made = analysed.copy(deep=True)
    made["clearing_time"][0, -1] = np.nan
    times = made["clearing_time"].values
    figure = map_figure(made, "clearing_time")
    looks_right(figure, tmp_path)
    (axes,) = maps_of(figure)
    for name, colour, where in (
        ("survives any length", "white", np.isinf(times)),
        ("not held even before the patch", ZERO, times == 0.0),
        ("no value", NO_VALUE, np.isnan(times)),
    ):
        assert name in legend_texts(figure)
        assert where.any()
        assert_array_equal(marked(axes, colour, FRICTION, 1e-3 * LOAD), where.T)


def test_yes_or_no_has_no_colour_bar(analysed: xr.Dataset, tmp_path: Path) -> None:
    figure = map_figure(analysed, "stable")
    looks_right(figure, tmp_path)
    assert len(figure.axes) == 1
    assert {"held", "not held"} <= set(legend_texts(figure))
    assert_array_equal(
        numbers(cells(figure.axes[0]).get_array()), 1.0 - analysed["stable"].values.T
    )


def test_controllers_share_one_scale(compared: xr.Dataset, tmp_path: Path) -> None:
    figure = map_figure(compared, "slip_work")
    looks_right(figure, tmp_path)
    *panels, last = maps_of(figure)
    assert [axes.get_title(loc="left") for axes in panels] == [
        "open loop",
        "cut and re-apply",
        "PI creep control",
    ]
    norms = [cells(axes).norm for axes in panels]
    known = 1e-3 * compared["slip_work"].values.ravel()
    known = known[np.isfinite(known)]
    for norm in norms:
        assert isinstance(norm, LogNorm)
        assert (norm.vmin, norm.vmax) == pytest.approx((known.min(), known.max()))
    for axes, name in zip(panels, CONTROLLERS, strict=True):
        values = 1e-3 * compared["slip_work"].sel(controller=name).values.T
        assert_allclose(numbers(cells(axes).get_array()), values)
    assert last.get_title(loc="left") == "who has the least"
    assert axes.get_xscale() == "linear"
    assert axes.get_yscale() == "log"
    for axes, flags in zip(panels, compared["failed"].values, strict=True):
        shown = marked(axes, FAILED, FRICTION, compared["length"])
        assert_array_equal(shown, flags.T > 0)
    assert "failed" in legend_texts(figure)
    assert "no value" not in legend_texts(figure)
    edges = numbers(cells(panels[0]).get_coordinates())[:, 0, 1]
    assert_allclose(np.sqrt(edges[1:] * edges[:-1]), compared["length"])


def test_the_best_is_the_best(compared: xr.Dataset) -> None:
    for name, sign in (("adhesion_utilisation", 1.0), ("recovery_time", -1.0)):
        outcome = compared[name]
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
    assert best(compared["adhesion_utilisation"].rename("energy_defect")) is None
    assert best(compared["adhesion_utilisation"].isel(controller=[0])) is None
    alike = compared["adhesion_utilisation"].isel(controller=[0, 0])
    assert best(alike) is None


def test_coarse_maps_have_their_numbers(compared: xr.Dataset, tmp_path: Path) -> None:
    made = compared.isel(length=slice(0, 4))
    figure = map_figure(made, "adhesion_utilisation")
    looks_right(figure, tmp_path)
    axes = maps_of(figure)[1]
    shown = {text.get_position(): float(text.get_text()) for text in axes.texts}
    values = made["adhesion_utilisation"].sel(controller="threshold")
    assert len(shown) == values.size
    for (x, y), value in shown.items():
        assert value == pytest.approx(100.0 * float(values.sel(friction=x, length=y)), abs=0.05)


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
    looks_right(figure, tmp_path)
    titles = [axes.get_title(loc="left") for axes in maps_of(figure)]
    assert len(titles) == 9
    assert titles[0] == "open loop, axle load 177\u00a0kN"
    assert titles[-1] == "PI creep control, axle load 265\u00a0kN"
    alone = map_figure(made, "critical_torque")
    looks_right(alone, tmp_path)
    assert len(maps_of(alone)) == LOAD[::2].size


# Lines


def test_lines_show_the_values(compared: xr.Dataset, tmp_path: Path) -> None:
    made = compared.isel(length=-1, drop=True)
    made["torque_margin"] = described("torque_margin", "friction", FRICTION - 0.456)
    figure = map_figure(made, "recovery_time")
    looks_right(figure, tmp_path)
    (axes,) = figure.axes
    factor = words(compared["recovery_time"]).factor
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


def test_few_values_of_a_second_axis_are_lines(compared: xr.Dataset, tmp_path: Path) -> None:
    made = compared.isel(length=[0, 2, 5])
    figure = map_figure(made, "adhesion_utilisation")
    looks_right(figure, tmp_path)
    assert len(figure.axes) == 3
    for axes, name in zip(figure.axes, CONTROLLERS, strict=True):
        for length in made["length"].values:
            _, y, _ = checks.lines(axes, f"length of the patch {length:.4g}\u00a0m")
            expected = made["adhesion_utilisation"].sel(controller=name, length=length)
            assert_allclose(y, 100.0 * expected)


def test_one_line_of_yes_or_no(analysed: xr.Dataset, tmp_path: Path) -> None:
    figure = map_figure(analysed[["stable"]].isel(friction=3, drop=True), "stable")
    looks_right(figure, tmp_path)
    (axes,) = figure.axes
    assert {text.get_text() for text in axes.get_yticklabels()} == {"held", "not held"}


# Samples


def test_sample_shows_the_distribution(sampled: xr.Dataset, tmp_path: Path) -> None:
    figure = map_figure(sampled, "adhesion_utilisation")
    looks_right(figure, tmp_path)
    axes = figure.axes[0]
    curves = [line for line in axes.lines if line.get_linestyle() != "None"]
    points = [line for line in axes.lines if line.get_linestyle() == "None"]
    for curve, point, name in zip(curves, points, CONTROLLERS, strict=False):
        values = 100.0 * sampled["adhesion_utilisation"].sel(controller=name).dropna("run").values
        x, share = map(numbers, curve.get_data())
        assert_allclose(
            share, [100.0 * np.mean(values <= at) for at in x], atol=100.0 / values.size
        )
        at, part = map(numbers, point.get_data())
        for value, percent in zip(at, part, strict=True):
            assert np.mean(values <= value) >= percent / 100.0 > np.mean(values < value)
    assert any("3 failed" in text for text in legend_texts(figure))


def test_share_without_limit_is_missing_at_the_top(sampled: xr.Dataset, tmp_path: Path) -> None:
    figure = map_figure(sampled, "clearing_time")
    looks_right(figure, tmp_path)
    endless = float(np.isinf(sampled["clearing_time"]).mean())
    top = numbers(figure.axes[0].lines[0].get_ydata()).max()
    assert float(top) == pytest.approx(100.0 * (1.0 - endless), abs=0.51)
    (text, _) = legend_texts(figure)
    assert f"{100.0 * endless:.3g} %: survives any length" in text


def test_strongest_parameter_comes_first(sampled: xr.Dataset) -> None:
    figure = map_figure(sampled, "adhesion_utilisation")
    bars, scatter = figure.axes[1], figure.axes[2]
    assert bars.get_yticklabels()[0].get_text().replace("\n", " ") == DESCRIBED["friction"][1]
    assert scatter.get_xlabel().startswith(DESCRIBED["friction"][1])
    upper, lower = (container[0].get_width() for container in bars.containers)
    friction = sampled["friction"].values
    for width, name in ((upper, "open_loop"), (lower, "threshold")):
        values = sampled["adhesion_utilisation"].sel(controller=name).values
        known = ~np.isnan(values)
        d = np.argsort(np.argsort(friction[known])) - np.argsort(np.argsort(values[known]))
        n = int(known.sum())
        assert width == pytest.approx(1.0 - 6.0 * np.sum(d**2) / (n * (n**2 - 1.0)))
    assert upper > 0.9
    assert lower < -0.5


def test_a_rise_and_fall_is_not_seen_and_that_is_said(sampled: xr.Dataset) -> None:
    x = np.linspace(-1.0, 1.0, 201)
    assert abs(rank_correlation(x, x**2)) < 1e-2
    assert rank_correlation(x, x**3) == pytest.approx(1.0)
    figure = map_figure(sampled, "clearing_time")
    assert figure.axes[1].get_xlabel() == "rising or falling dependence only  [1]"
    caption = figure.legends[0].get_title().get_text().replace("\n", " ")
    assert "A rank correlation shows rising or falling dependence only" in caption


def test_chance_stays_in_its_band(sampled: xr.Dataset) -> None:
    bars = map_figure(sampled, "clearing_time").axes[1]
    boxes = [patch for patch in bars.patches if isinstance(patch, Rectangle)]
    (limit,) = (box.get_width() / 2.0 for box in boxes if box.get_height() == 1.0)
    rng = np.random.default_rng(2)
    found = [abs(rank_correlation(rng.random(200), rng.random(200))) for _ in range(2000)]
    assert np.mean(np.array(found) < limit) == pytest.approx(
        0.99, abs=4.0 * math.sqrt(0.0099 / 2000)
    )
    assert math.isnan(rank_correlation(rng.random(9), np.ones(9)))


# Files


def test_every_outcome_has_its_files(compared: xr.Dataset, tmp_path: Path) -> None:
    made = compared.isel(length=0, drop=True)
    made["seed"] = 1.0  # of no axis
    written = draw_maps(made, tmp_path / "new" / "maps")
    expected = ["adhesion_utilisation", "slip_work", "recovery_time"]
    assert [path.name for path in written] == [
        f"{n}.{kind}" for n in expected for kind in ("png", "svg")
    ]
    assert all(path.stat().st_size > 1000 for path in written)


def test_unknown_outcomes_are_refused(analysed: xr.Dataset) -> None:
    message = "outcome must be one of critical_torque, .*stable; got 'stabel'"
    with pytest.raises(ValueError, match=message):
        map_figure(analysed, "stabel")


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_a_map_of_nothing_can_be_drawn(value: float, tmp_path: Path) -> None:
    made = grid(
        {"clearing_time": lambda f, p: np.where((f == f.min()) & (p == p.min()), 0.1, value)},
        friction=FRICTION,
        load=LOAD,
    )
    looks_right(map_figure(made, "clearing_time"), tmp_path)
    made["clearing_time"][:] = value
    looks_right(map_figure(made, "clearing_time"), tmp_path)
