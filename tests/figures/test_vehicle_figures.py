"""The figures of vehicles: what is drawn, read back from the lines, against the run."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import figure_checks as checks
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.figures import comparison, page_size, scenario_run, vehicle_creep_curve
from contactlib.runs import Metrics

CAPTION = "Each of 4 axles at 0, 3, 9.9 and 12.9 m: k_hat 0.3."


@cache
def scenario() -> cl.Scenario:
    return replace(cl.load_scenario("four_axles.toml"), duration=6.0)


@pytest.fixture(scope="module")
def run() -> cl.Result:
    return cl.run_scenario(scenario(), "creep_pi")


@pytest.fixture(scope="module")
def axles(run: cl.Result) -> list[Metrics]:
    return [cl.metrics(axle, scenario().drivetrain) for axle in run.by_axle]


def changed(run: cl.Result, number: int, **given: Any) -> cl.Result:
    """A result whose axle of a number has other signals."""
    signals = {**run.signals, **given}
    for name in given:
        if run[name].ndim > 1:
            signals[name] = run[name].copy()
            signals[name][:, number - 1] = given[name]
    return replace(run, signals=signals)


def panels(figure: Figure) -> np.ndarray:
    """Panels by row and axle of a figure whose four axles stand in two rows."""
    return np.array(figure.axes).reshape(2, -1, 2).swapaxes(0, 1).reshape(-1, 4)


def drawn(axes: Axes) -> np.ndarray:
    """Values of the two coloured lines of a panel, which meet where the branch changes."""
    solid, dashed = (line for line in axes.lines if checks.style_of(line) != ":")
    return np.asarray(np.where(np.isnan(a := solid.get_ydata()), dashed.get_ydata(), a))


@pytest.mark.slow
@pytest.mark.parametrize("over", ["time", "distance"])
def test_axles_can_be_read_on_one_scale(
    run: cl.Result, axles: list[Metrics], over: str, tmp_path: Path
) -> None:
    figure = scenario_run(run, axles, title="Wet: creep control", caption=CAPTION, over=over)
    checks.check_axes(figure)
    checks.check_layout(figure)
    checks.check_saved(figure, tmp_path)
    grid = panels(figure)
    for column, axle, metrics in zip(grid.T, run.by_axle, axles, strict=True):
        force, load, torque, speed, friction = column
        assert_allclose(drawn(force), 1e-3 * axle["creep_force"])
        assert_allclose(np.asarray(load.lines[0].get_ydata()), 1e-3 * axle["axle_load"])
        assert_allclose(drawn(torque), 1e-3 * axle["drive_torque"])
        _, rim, _ = checks.lines(speed, "wheel rim")
        assert_allclose(rim, axle["speed"] + axle["slip_velocity"])
        x, _, _ = checks.lines(speed, "vehicle")
        assert_allclose(x, axle.time if over == "time" else axle["distance"])
        assert_allclose(np.asarray(friction.lines[0].get_ydata()), axle["friction_scale_left"])
        used = f"{100.0 * metrics.limited_utilisation:.1f} % used where friction limits"
        assert used in force.get_title(loc="left")
    for row in grid:
        assert len({axes.get_ylim() for axes in row}) == 1
        assert [axes.get_ylabel() != "" for axes in row] == [True, False] * 2


@pytest.mark.parametrize("size", [None, "16:9", "7x9"])
def test_axles_stand_side_by_side_on_a_slide_alone(
    run: cl.Result, axles: list[Metrics], size: str | None
) -> None:
    """In a text that is 7.3 inches wide their letters keep more than four fifths of their size."""
    wheelset = scenario().drivetrain.wheelset
    with page_size(size):
        whole = scenario_run(run, axles, title="", caption="")
        curve = vehicle_creep_curve(run, wheelset, title="", caption="")
    for figure in (whole, curve):
        places = [axes.get_subplotspec() for axes in figure.axes]
        rows = {place.rowspan.start for place in places if place}
        assert len(places) / len(rows) == (4 if size == "16:9" else 2)
        if size is None:
            assert 7.3 / figure.get_figwidth() > 0.8


def test_no_axle_leaves_the_scale_of_the_first(run: cl.Result, axles: list[Metrics]) -> None:
    """The first axle's torque does not come to zero, and a later one's is larger."""
    for number, torque in ((1, 20e3), (2, 40e3), (3, 30e3), (4, 35e3)):
        held = torque * (1.0 + 0.1 * run.time)
        run = changed(run, number, drive_torque=held, demand=held)
    grid = panels(scenario_run(run, axles, title="", caption=""))
    assert {axes.get_ylim()[0] for axes in grid[2]} == {0.0}
    assert min(axes.get_ylim()[1] for axes in grid[2]) >= 1e-3 * 40e3 * 1.6


def test_a_path_ends_where_the_axle_is(run: cl.Result, tmp_path: Path) -> None:
    wheelset = scenario().drivetrain.wheelset
    figure = vehicle_creep_curve(run, wheelset, title="Wet: creep control", caption=CAPTION)
    checks.check_all(figure, tmp_path)
    assert {axes.get_xscale() for axes in figure.axes} == {"linear"}
    for axes, axle in zip(figure.axes, run.by_axle, strict=True):
        worst, best, *path, end = axes.lines
        ratio = axle["creep_force"] / axle["axle_load"]
        assert checks.place(end) == pytest.approx((axle["creepage"][-1], ratio[-1]))
        values = [np.asarray(line.get_ydata()) for line in path]
        assert_allclose(np.nanmax(values), np.abs(ratio).max())
        low, high = (np.asarray(line.get_ydata()).max() for line in (worst, best))
        # Loads, and with them the peaks, differ by a few per cent from the nominal.
        assert low < np.nanmax(values) < 1.03 * high


def test_a_curve_is_that_of_the_friction_met(run: cl.Result) -> None:
    """Under even friction there is one curve; in braking the force is drawn upward as well."""
    ones = dict.fromkeys(("friction_scale_left", "friction_scale_right"), np.ones_like(run.time))
    signs = {name: -run.axle(1)[name] for name in ("creepage", "creep_force", "slip_velocity")}
    wheelset = scenario().drivetrain.wheelset
    figure = vehicle_creep_curve(
        changed(run, 1, **ones, **signs), wheelset, title="", caption=CAPTION
    )
    curve, *path, _ = figure.axes[0].lines
    assert len(path) == 2
    speed = run["speed"].max()
    zeta = np.asarray(curve.get_xdata(), np.float64)
    record = wheelset.element.at_creepage(zeta, speed=speed)
    assert_allclose(np.asarray(curve.get_ydata()), record["traction_coefficient"])
    assert min(np.nanmin(np.asarray(line.get_ydata())) for line in path) > -1e-3


def test_creepages_of_a_wheel_that_slips_away_are_logarithmic(run: cl.Result) -> None:
    slip = np.where(run.time > 5.0, 3.0, run.axle(2)["creepage"])
    away = changed(run, 2, creepage=slip, slip_velocity=slip * run["speed"])
    figure = vehicle_creep_curve(away, scenario().drivetrain.wheelset, title="", caption="")
    for axes in figure.axes:
        assert axes.get_xscale() == "log"
        assert axes.get_xlim()[1] == pytest.approx(6.0)


def test_a_path_is_drawn_where_it_can_be_read(run: cl.Result) -> None:
    """Down to the contact's minimum speed, without jumps from row to row, thin where it repeats."""
    wheelset = scenario().drivetrain.wheelset
    slow = np.interp(run.time, (0.0, 5.0, 6.0), (1.0, 1.0, 0.0))
    ones = {"speed": slow, "falling_branch": np.zeros_like(slow), "axle_load": 0.0 * slow + 1e5}
    once, often = (0.01 * (0.5 - 0.5 * np.cos(k * np.pi * run.time / 6.0)) for k in (1, 60))
    jumps = np.where(run.time < 2.0, once, 0.019 + 0.0 * once)
    paths = {}
    for number, zeta in enumerate((once, often, jumps), start=1):
        force = {"creepage": zeta, "slip_velocity": zeta * slow, "creep_force": 2e6 * zeta}
        run = changed(run, number, **ones, **force)
    figure = vehicle_creep_curve(run, wheelset, title="", caption="")
    for number, axes in enumerate(figure.axes[:3], start=1):
        *_, path, _, end = axes.lines
        paths[number], x = path, np.asarray(path.get_xdata(), float)
        last = np.flatnonzero(slow >= wheelset.element.minimum_speed)[-1]
        assert np.isnan(x[last + 1 :]).all()
        assert checks.place(end)[0] == x[last]
    drawn_rows = [np.isfinite(np.asarray(p.get_ydata(), float)).sum() for p in paths.values()]
    assert drawn_rows[2] == drawn_rows[0] - 1  # the row after the jump
    assert paths[2].get_linewidth() < 0.5 * paths[1].get_linewidth()


@pytest.mark.slow
def test_whole_vehicles_are_compared_by_sums_and_extremes(run: cl.Result, tmp_path: Path) -> None:
    runs = {"creep_pi": run, "open_loop": cl.run_scenario(scenario(), "open_loop")}
    metrics = {name: cl.metrics(one, scenario().drivetrain) for name, one in runs.items()}
    figure = comparison(runs, metrics, title="Wet rails", caption=CAPTION)
    checks.check_axes(figure)
    checks.check_layout(figure)
    checks.check_saved(figure, tmp_path)
    grid = np.array(figure.axes).reshape(4, 2)
    for column, one in zip(grid.T, runs.values(), strict=True):
        assert_allclose(drawn(column[0]), 1e-3 * one.total("creep_force"))
        largest = np.abs(one["creepage"]).max(axis=-1)
        assert_allclose(drawn(column[1]), 100.0 * np.maximum(largest, 1e-4))
        assert_allclose(drawn(column[2]), 1e-3 * one.total("drive_torque"))
        assert_allclose(
            np.asarray(column[3].lines[0].get_ydata()), one["friction_scale_left"].min(axis=-1)
        )


def test_a_vehicle_that_stands_has_no_path(run: cl.Result) -> None:
    wheelset = scenario().drivetrain.wheelset
    figure = vehicle_creep_curve(run, wheelset, title="", caption="", minimum_speed=100.0)
    for axes in figure.axes:
        _, _, *path, _ = axes.lines
        assert np.isnan([np.asarray(line.get_ydata(), np.float64) for line in path]).all()
        assert axes.get_xlim()[1] == pytest.approx(2.0 * wheelset.element.saturation_creepage)
