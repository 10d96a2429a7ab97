"""The figures of scenarios: what is drawn, read back from the lines, against the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import figure_checks as checks
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.figures import comparison, run_name, scenario_run
from contactlib.figures.style import drivetrain_setting
from contactlib.runs import Metrics
from contactlib.vehicle import Axle, Brake, Drivetrain, Motor

CAPTION = "$J$ 250 kg m$^2$, $r$ 0.5 m. Sensors: delay 10 ms."


@pytest.fixture(scope="module")
def wet() -> cl.Scenario:
    return replace(cl.load_scenario("dry_wet_dry.toml"), duration=6.0)


@pytest.fixture(scope="module")
def runs(wet: cl.Scenario) -> Mapping[str, cl.Result]:
    chosen = ("open_loop", "threshold", "creep_pi")
    return {name: cl.run_scenario(wet, name) for name in chosen}


@pytest.fixture(scope="module")
def found(wet: cl.Scenario, runs: Mapping[str, cl.Result]) -> dict[str, Metrics]:
    return {name: cl.metrics(run, wet.drivetrain) for name, run in runs.items()}


def drawn(axes: Axes, style: str) -> list[np.ndarray]:
    """Values of the lines of a style that are coloured."""
    kept = [line for line in axes.lines if line.get_color() != "black"]
    return [np.asarray(line.get_ydata()) for line in kept if checks.style_of(line) == style]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["open_loop", "threshold", "creep_pi"])
def test_run_can_be_read(
    runs: Mapping[str, cl.Result], found: dict[str, Metrics], tmp_path: Path, name: str
) -> None:
    figure = scenario_run(
        runs[name], found[name], title=f"Wet patch: {run_name(name)}", caption=CAPTION
    )
    checks.check_axes(figure)
    checks.check_layout(figure)
    checks.check_saved(figure, tmp_path)
    force, creepage, torque, speed = figure.axes
    falls = runs[name]["falling_branch"] > 0.0
    assert falls.any()
    assert not falls.all()
    for axes, values in (
        (force, 1e-3 * runs[name]["creep_force"]),
        (creepage, 100.0 * np.maximum(np.abs(runs[name]["creepage"]), 1e-4)),
        (torque, 1e-3 * runs[name]["drive_torque"]),
    ):
        (solid,), (dashed,) = drawn(axes, "-"), drawn(axes, "--")
        assert_allclose(solid[~falls], values[~falls])
        assert np.isnan(solid[falls]).all()
        assert_allclose(dashed[falls], values[falls])
    _, rim, _ = checks.lines(speed, "wheel rim")
    assert_allclose(rim, runs[name]["speed"] + runs[name]["slip_velocity"])
    low, high = torque.get_ylim()
    assert -0.06 * high < low <= 0.0  # from zero, with a margin if the torque gets there


@pytest.mark.slow
def test_slip_away_does_not_stretch_the_axes(
    runs: Mapping[str, cl.Result], found: dict[str, Metrics], tmp_path: Path
) -> None:
    assert runs["open_loop"]["creepage"].max() > 3.0
    figure = comparison(runs, found, title="Wet patch", caption=CAPTION)
    checks.check_axes(figure)
    checks.check_layout(figure)
    checks.check_saved(figure, tmp_path)
    grid = np.array(figure.axes).reshape(3, 3)
    assert [axes.get_ylim()[1] for axes in grid[1]] == [100.0] * 3
    largest = 100.0 * runs["open_loop"]["creepage"].max()
    assert [text.get_text() for text in grid[1, 0].texts] == [f"up to {largest:.0f} %"]
    assert not grid[1, 1].texts
    titles = [axes.get_title(loc="left").splitlines()[0] for axes in grid[0]]
    assert titles == ["open loop", "cut and re-apply", "PI creep control"]
    alone = scenario_run(
        runs["open_loop"], found["open_loop"], title="Wet patch: open loop", caption=CAPTION
    )
    speed = alone.axes[3]
    rim = float((runs["open_loop"]["speed"] + runs["open_loop"]["slip_velocity"]).max())
    assert [text.get_text() for text in speed.texts] == [f"rim: up to {rim:.0f} m/s"]
    # Of a wheel that no drive would turn so fast, the slip work does not stand alone.
    for (name, metrics), axes in zip(found.items(), grid[0], strict=True):
        _, used, work = axes.get_title(loc="left").splitlines()
        assert used == f"{100.0 * metrics.limited_utilisation:.1f} % used where friction limits"
        assert work.endswith(f"rim up to {rim:.0f} m/s") == (name == "open_loop")
    assert speed.get_ylim()[1] == pytest.approx(2.5 * runs["open_loop"]["speed"].max())


def test_low_friction_is_shaded_where_it_is(
    runs: Mapping[str, cl.Result], found: dict[str, Metrics]
) -> None:
    run = runs["threshold"]
    (patch,) = scenario_run(run, found["threshold"], title="", caption="").axes[0].patches
    box = patch.get_path().get_extents(patch.get_patch_transform())
    low = run["friction_scale_left"] < 0.99
    assert box.x0 == pytest.approx(run.time[low.argmax()])
    assert run.time[low][-1] <= box.x1 <= run.time[low][-1] + 0.01


def test_a_low_slope_is_shaded_as_well(wet: cl.Scenario) -> None:
    slope = cl.Profile((2.0, 2.0), (1.0, 0.3))
    case = replace(wet, track=cl.Track(slope=slope), duration=0.5)
    run = cl.run_scenario(case, "open_loop")
    figure = scenario_run(run, cl.metrics(run, case.drivetrain), title="", caption=CAPTION)
    (patch,) = figure.axes[0].patches
    box = patch.get_path().get_extents(patch.get_patch_transform())
    assert box.x0 == pytest.approx(run.time[(run["slope_scale"] < 1.0).argmax()])


def test_a_vibration_is_a_band_and_a_slow_cycle_a_line(wet: cl.Scenario) -> None:
    time = np.linspace(0.0, 10.0, 20001)
    plain = np.zeros_like(time)
    swinging = np.where(time > 4.0, 3.0 * np.sin(2.0 * np.pi * 50.0 * time), 0.0)
    slow = 5.0 * np.sign(np.sin(2.0 * np.pi * 1.0 * time))
    noise = 0.05 * np.random.default_rng(1).standard_normal(time.size)
    names = cl.run_scenario(replace(wet, duration=0.02), "open_loop").units
    signals = dict.fromkeys(names, plain) | {
        "axle_torque": 1e3 * (8.0 + swinging),
        "drive_torque": 1e3 * (20.0 + slow + noise),
        "creep_force": 1e3 * (40.0 + time + noise),
        "speed": plain + 10.0,
        "falling_branch": np.where(time > 4.0, 1.0, 0.0),
        "friction_scale_left": plain + 1.0,
        "friction_scale_right": plain + 1.0,
        "slope_scale": plain + 1.0,
        "demand": plain + 2e4,
    }
    run = cl.Result(time, MappingProxyType(signals), MappingProxyType(names))
    figure = scenario_run(
        run, cl.metrics(run, wet.drivetrain), title="A vibration", caption=CAPTION
    )
    force, _, torque, _, axle = figure.axes
    bands = [c for c in axle.collections if isinstance(c, PolyCollection)]
    assert len(bands) == 1
    for axes in (force, torque):
        assert not axes.collections
        assert max(len(line.get_ydata()) for line in axes.lines) == time.size  # type: ignore[arg-type]
    low, high = (values[np.isfinite(values)] for values in drawn(axle, "--"))
    assert_allclose([low[5:].mean(), high[5:].mean()], [5.0, 11.0], atol=0.1)
    for values in drawn(axle, "-"):
        assert_allclose(values[np.isfinite(values)], 8.0)
    checks.check_layout(figure)


def test_runs_have_names_in_words() -> None:
    assert run_name("creep_pi") == "PI creep control"
    assert run_name("below_peak") == "below peak"


def test_a_comparison_shows_the_longest_run_to_its_end(
    runs: Mapping[str, cl.Result], found: dict[str, Metrics]
) -> None:
    names = list(runs)[:2]
    first, second = (runs[name] for name in names)
    half = second.time.size // 2
    short = cl.Result(
        second.time[:half], {n: v[:half] for n, v in second.signals.items()}, second.units
    )
    figure = comparison(dict(zip(names, (first, short), strict=True)), found, title="", caption="")
    for axes in figure.axes:
        assert axes.get_xlim()[1] == first.time[-1]


def test_a_stop_shows_speeds_and_its_distance() -> None:
    case = replace(cl.load_scenario("wheel_slide_protection.toml"), initial_speed=4.0, duration=9.0)
    stops = {name: cl.run_scenario(case, name) for name in ("open_loop", "wsp")}
    found = {name: cl.metrics(run, case.drivetrain) for name, run in stops.items()}
    figure = comparison(stops, found, title="", caption="")
    assert len(figure.axes) == 8
    for axes, (name, run) in zip(figure.axes[6:], stops.items(), strict=True):
        _, rim, _ = checks.lines(axes, "wheel rim")
        assert_allclose(rim, run["speed"] + run["slip_velocity"])
        title = figure.axes[list(stops).index(name)].get_title("left")
        assert f"stops after {run['distance'][-1]:.0f} m" in title
    checks.check_layout(figure)


def test_a_caption_has_what_is_driven(locomotive: cl.Model) -> None:
    wheelset = locomotive.wheelset
    drivetrain = Drivetrain(
        replace(wheelset, element=replace(wheelset.element, memory=True)),
        axle=Axle(stiffness=6e6, damping=500.0, drive_share=0.4),
        motor=Motor(lag=0.01, power=1.6e6, torque_rate=1e5, trip_speed=45.0),
        brake=Brake(fill_time=0.25, vent_time=0.1, delay=0.04),
    )
    setting = drivetrain_setting(drivetrain).replace("\u00a0", " ")
    hertz = drivetrain.torsional_frequency / (2.0 * np.pi)
    limits = "power 1600 kW, torque rate 100 kN m/s, trip at 45 m/s"
    limits += ", brake: delay 40 ms, fill 0.25 s, vent 0.1 s"
    assert f"Motor lag 10 ms, {limits}, axle {hertz:.3g} Hz, " in setting
    assert setting.endswith("% of critical.")
    assert Drivetrain(locomotive.wheelset).torsional_damping_ratio == 0.0
