"""The figures of scenarios: what is drawn, read back from the lines, against the run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import figure_checks as checks
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib.cli.report import track_text
from contactlib.figures import Units, comparison, run_name, scenario_run
from contactlib.figures.style import drivetrain_setting, setting
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
def metrics_of(wet: cl.Scenario, runs: Mapping[str, cl.Result]) -> dict[str, Metrics]:
    return {name: cl.metrics(run, wet.drivetrain) for name, run in runs.items()}


def drawn(axes: Axes, style: str) -> list[np.ndarray]:
    """Values of the lines of a style that are coloured."""
    kept = [line for line in axes.lines if line.get_color() != "black"]
    return [np.asarray(line.get_ydata()) for line in kept if checks.style_of(line) == style]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["open_loop", "threshold", "creep_pi"])
def test_run_can_be_read(
    runs: Mapping[str, cl.Result], metrics_of: dict[str, Metrics], tmp_path: Path, name: str
) -> None:
    figure = scenario_run(
        runs[name], metrics_of[name], title=f"Wet patch: {run_name(name)}", caption=CAPTION
    )
    checks.check_axes(figure)
    checks.check_layout(figure)
    checks.check_saved(figure, tmp_path)
    force, creepage, torque, speed, _ = figure.axes
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
    runs: Mapping[str, cl.Result], metrics_of: dict[str, Metrics], tmp_path: Path
) -> None:
    assert runs["open_loop"]["creepage"].max() > 3.0
    figure = comparison(runs, metrics_of, title="Wet patch", caption=CAPTION)
    checks.check_axes(figure)
    checks.check_layout(figure)
    checks.check_saved(figure, tmp_path)
    grid = np.array(figure.axes).reshape(4, 3)
    assert [axes.get_ylim()[1] for axes in grid[1]] == [100.0] * 3
    largest = 100.0 * runs["open_loop"]["creepage"].max()
    assert [text.get_text() for text in grid[1, 0].texts] == [f"up to {largest:.0f} %"]
    assert not grid[1, 1].texts
    titles = [axes.get_title(loc="left").splitlines()[0] for axes in grid[0]]
    assert titles == ["open loop", "cut and re-apply", "PI creep control"]
    single = scenario_run(
        runs["open_loop"], metrics_of["open_loop"], title="Wet patch: open loop", caption=CAPTION
    )
    speed = single.axes[3]
    rim = float((runs["open_loop"]["speed"] + runs["open_loop"]["slip_velocity"]).max())
    assert [text.get_text() for text in speed.texts] == [f"rim: up to {rim:.0f} m/s"]
    # Of a wheel that no drive would turn so fast, the slip work does not stand alone.
    for (name, metrics), axes in zip(metrics_of.items(), grid[0], strict=True):
        _, used, work = axes.get_title(loc="left").splitlines()
        assert used == f"{100.0 * metrics.limited_utilisation:.1f} % used where friction limits"
        assert work.endswith(f"rim up to {rim:.0f} m/s") == (name == "open_loop")
    assert speed.get_ylim()[1] == pytest.approx(2.5 * runs["open_loop"]["speed"].max())


def test_friction_itself_is_drawn_on_one_scale(
    runs: Mapping[str, cl.Result], metrics_of: dict[str, Metrics]
) -> None:
    """Also where it is constant, or its largest value differs from run to run."""
    names = ("friction_scale_left", "friction_scale_right")
    low = {name: np.full_like(runs["creep_pi"].time, 0.3) for name in names}
    constant = cl.Result(
        runs["creep_pi"].time, {**runs["creep_pi"].signals, **low}, runs["creep_pi"].units
    )
    both = {"threshold": runs["threshold"], "creep_pi": constant}
    of_time, along = (
        comparison(both, metrics_of, title="", caption="", over=over)
        for over in ("time", "distance")
    )
    for figure, places in ((of_time, None), (along, "distance")):
        for axes, run in zip(figure.axes[-2:], both.values(), strict=True):
            (line,) = axes.lines
            assert_allclose(np.asarray(line.get_ydata()), run["friction_scale_left"])
            assert_allclose(
                np.asarray(line.get_xdata()), run.time if places is None else run[places]
            )
            (band,) = axes.collections
            assert band.get_datalim(axes.transData).y1 == run["friction_scale_left"].max()
        assert len({axes.get_ylim() for axes in figure.axes[-2:]}) == 1
        assert not any(axes.patches for axes in figure.axes)
    assert along.axes[-1].get_xlabel() == "distance  [m]"
    assert along.axes[-1].get_xlim() == (0.0, max(run["distance"].max() for run in both.values()))


def test_an_unknown_axis_is_refused(
    runs: Mapping[str, cl.Result], metrics_of: dict[str, Metrics]
) -> None:
    with pytest.raises(ValueError, match="over = 'place' must be one of: time, distance"):
        scenario_run(runs["creep_pi"], metrics_of["creep_pi"], title="", caption="", over="place")


def test_wheels_and_slope_have_factors_of_their_own(wet: cl.Scenario) -> None:
    track = cl.Track(
        friction_left=cl.Profile((2.0, 2.0), (1.0, 0.5)),
        friction_right=cl.Profile((3.0, 3.0), (1.0, 1.2)),
        slope=cl.Profile((2.0, 2.0), (1.0, 0.3)),
    )
    case = replace(wet, track=track, duration=0.5)
    run = cl.run_scenario(case, "open_loop")
    figure = scenario_run(run, cl.metrics(run, case.drivetrain), title="", caption=CAPTION)
    names = ("friction_scale_left", "friction_scale_right", "slope_scale")
    for line, name in zip(figure.axes[-1].lines, names, strict=True):
        assert_allclose(np.asarray(line.get_ydata()), run[name])
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend[-3:] == [
        "friction factor, left wheel",
        "friction factor, right wheel",
        "slope factor",
    ]
    checks.check_styles(figure)


def made_up(wet: cl.Scenario, time: np.ndarray, **given: np.ndarray) -> cl.Result:
    """A result of these signals [in SI units]; the others are plain."""
    plain, names = np.zeros_like(time), cl.run_scenario(replace(wet, duration=0.02), "open_loop")
    factors = dict.fromkeys(("friction_scale_left", "friction_scale_right", "slope_scale"), 1.0)
    signals = dict.fromkeys(names.units, plain)
    signals |= {name: plain + value for name, value in factors.items()}
    signals |= {"speed": plain + 10.0, "demand": plain + 2e4, **given}
    return cl.Result(time, MappingProxyType(signals), MappingProxyType(dict(names.units)))


def test_axes_have_the_units_of_the_file(wet: cl.Scenario) -> None:
    coach = cl.load_scenario("coach_braking.toml")
    assert (coach.speed_unit, coach.track.unit, wet.speed_unit) == ("km/h", "coefficient", "m/s")
    time = np.linspace(0.0, 10.0, 101)
    factor = np.where(time < 4.0, 0.25, 1.0)
    sides = {f"friction_scale_{side}": factor for side in ("left", "right")}
    run = made_up(wet, time, speed=20.0 - time, slip_velocity=50.0 * (time == 5.0), **sides)
    metrics = cl.metrics(run, wet.drivetrain)
    figure = scenario_run(run, metrics, title="", caption="", units=Units("km/h", 3.6, 0.3))
    *_, speed, friction = figure.axes
    assert speed.get_ylabel() == "speed  [km/h]"
    assert_allclose(checks.lines(speed, "vehicle")[1], 3.6 * run["speed"])
    assert [text.get_text() for text in speed.texts] == ["rim: up to 234 km/h"]
    assert_allclose(np.asarray(friction.lines[0].get_ydata()), 0.3 * factor)
    assert [text.get_text() for text in friction.texts] == ["0.075", "0.3"]


def test_a_brake_acts_on_what_stands_or_rolls_back(wet: cl.Scenario) -> None:
    """Its demand, which is negative, is drawn on the side on which it acts; a motor's as it is."""
    time = np.linspace(0.0, 9.0, 901)
    motor = time >= 6.0
    run = made_up(
        wet,
        time,
        speed=np.select([time < 3.0, time < 6.0], [0.0, -1.0], 10.0),
        demand=np.full_like(time, -2e4),
        drive_torque=np.where(motor, -2e4, 1e4),
        creep_force=np.where(motor, -4e4, 2e4),
        available_force=np.full_like(time, 5e4),
    )
    metrics = {name: cl.metrics(run, wet.drivetrain) for name in "ab"}
    figure = comparison({"a": run, "b": run}, metrics, title="", caption="")
    force, _, torque, speed = np.array(figure.axes).reshape(4, 2)[:, 0]
    for axes, size in ((force, 50.0), (torque, 20.0)):
        assert_allclose(np.asarray(axes.lines[0].get_ydata()), np.where(motor, -size, size))
    assert_allclose(checks.lines(speed, "vehicle")[1], run["speed"])  # it rolls back
    assert not any(axes.get_legend() for axes in figure.axes)
    assert {"wheel rim", "vehicle"} < {text.get_text() for text in figure.legends[0].get_texts()}


def test_a_heading_says_where_a_stop_is_counted_from(wet: cl.Scenario) -> None:
    time = np.linspace(0.0, 12.0, 1201)
    for demand, last, text in (
        (-1e4, 0.0, "\nstops 61 m from the demand,\n70 m from the start"),
        (-1e4, 2.0, "\ndoes not stop within 12 s"),
        (1e4, 2.0, ""),  # the drive has tripped, and friction in the bearings slows the wheel
    ):
        speed = np.maximum(10.0 - np.maximum(time - 2.0, 0.0), last)
        slowed = {"demand": np.full_like(time, demand), "creep_force": np.full_like(time, -1e4)}
        run = made_up(wet, time, speed=speed, **slowed)
        whole = Metrics(*[math.nan] * len(Metrics._fields))
        whole = whole._replace(distance=70.0, stopping_distance=61.0, slip_work=0.0)
        axes = comparison({"a": run}, {"a": whole}, title="", caption="").axes[0]
        assert axes.get_title("left").endswith(f"slip work 0 J{text}")


@pytest.mark.parametrize("over", ["time", "distance"])
def test_a_vibration_is_its_envelope_and_a_slow_cycle_a_line(wet: cl.Scenario, over: str) -> None:
    time = np.linspace(0.0, 10.0, 20001)
    swinging = np.where(time > 4.013, 3.0 * np.sin(2.0 * np.pi * 47.0 * time), 0.0)
    slow = 5.0 * np.sign(np.sin(2.0 * np.pi * 1.0 * time))
    noise = 0.05 * np.random.default_rng(1).standard_normal(time.size)
    run = made_up(
        wet,
        time,
        axle_torque=1e3 * (8.0 + np.minimum(swinging, 2.0)),
        drive_torque=1e3 * (20.0 + slow + noise),
        creep_force=1e3 * (40.0 + time + noise),
        falling_branch=np.where(swinging < 0.0, 1.0, 0.0),
        distance=3.0 * time**2,
    )
    figure = scenario_run(
        run, cl.metrics(run, wet.drivetrain), title="A vibration", caption=CAPTION, over=over
    )
    force, _, torque, _, axle = figure.axes
    for axes in (force, torque):
        assert not axes.collections
        assert max(len(line.get_ydata()) for line in axes.lines) == time.size  # type: ignore[arg-type]
    (band,) = (c for c in axle.collections if isinstance(c, PolyCollection))
    assert band.get_label() == "envelope over 50 ms"
    assert band.get_label() in [text.get_text() for text in figure.legends[0].get_texts()]
    # The signal lies in the band, and the band nowhere beyond the signal.
    values, at = 1e-3 * run["axle_torque"], run.time if over == "time" else run["distance"]
    low, high = 8.0 - 3.0, 8.0 + 2.0
    assert_allclose(band.get_datalim(axle.transData).intervaly, [low, high], rtol=1e-3)
    (path,) = band.get_paths()
    first = np.asarray(path.vertices)[:, 0].min()
    covered = at >= first
    assert time[covered][0] > 4.013 - 0.05
    inside = path.contains_points(np.column_stack([at, values])[covered], radius=1e-3)
    assert inside.mean() > 0.99
    # Before it the signal itself is drawn; its edges are dashed only where they fall.
    shown, *_, edges = (
        [drawn(axle, style)[i] for style in ("-", "--")] for i in range(len(drawn(axle, "-")))
    )
    assert_allclose(shown[0][~covered & (swinging >= 0.0)], 8.0)
    lower = [drawn(axle, style)[1] for style in ("-", "--")]
    assert not np.isfinite(lower[0]).any()  # the minima lie on the falling branch
    assert_allclose(lower[1][np.isfinite(lower[1])], low, rtol=1e-3)
    assert_allclose(edges[0][np.isfinite(edges[0])], high, rtol=1e-3)
    assert not np.isfinite(edges[1]).any()
    checks.check_layout(figure)


def test_an_envelope_never_exceeds_the_demand(wet: cl.Scenario) -> None:
    """A torque that vibrates below a falling demand, which limits it."""
    time = np.linspace(0.0, 10.0, 20001)
    demand = 1e3 * (25.0 - 2.0 * time)
    torque = np.minimum(demand, demand - 2e3 + 3e3 * np.sin(2.0 * np.pi * 83.0 * time))
    run = made_up(wet, time, demand=demand, drive_torque=torque)
    axes = scenario_run(run, cl.metrics(run, wet.drivetrain), title="", caption="").axes[2]
    (band,) = (c for c in axes.collections if isinstance(c, PolyCollection))
    for path in band.get_paths():
        x, y = np.asarray(path.vertices).T
        # Within a window of 50 ms and a row the demand falls by 0.101 kN m.
        assert (y <= np.interp(x, time, 1e-3 * demand) + 0.101 + 1e-9).all()


@pytest.mark.parametrize("stands", [(0.0, 6.0), (9.0, 0.0), (4.0, 4.0)])
def test_standstill_takes_little_of_the_axis(wet: cl.Scenario, stands: tuple[float, float]) -> None:
    before, after = stands
    time = np.linspace(0.0, before + 10.0 + after, 4001)
    speed = np.interp(time, (before, before + 5.0, before + 10.0), (0.0, 8.0, 0.0))
    run = made_up(wet, time, speed=speed, distance=np.cumsum(speed) * time[1])
    metrics = cl.metrics(run, wet.drivetrain)
    for figure in (
        scenario_run(run, metrics, title="", caption=""),
        comparison({"a": run, "b": run}, {"a": metrics, "b": metrics}, title="", caption=""),
    ):
        low, high = figure.axes[-1].get_xlim()
        assert low <= before <= low + 0.5
        assert high - 0.5 <= before + 10.0 <= high


def test_creepage_is_drawn_only_where_it_is_slip_over_speed(wet: cl.Scenario) -> None:
    """Below the minimum speed the reference of the creepage is not the vehicle's speed."""
    body = wet.drivetrain.wheelset.without_memory()
    steady = replace(wet.drivetrain, wheelset=body)
    slow = replace(wet, drivetrain=steady, initial_speed=0.0, design_speed=10.0, duration=2.0)
    demand = cl.Profile((0.0, 0.5, 1.0), (0.0, 0.0, 20e3))
    run = cl.run_scenario(replace(slow, demand=demand), "open_loop")
    minimum = wet.drivetrain.wheelset.element.minimum_speed
    axes = scenario_run(run, cl.metrics(run, wet.drivetrain), title="", caption="").axes[1]
    lines = np.array([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines[:2]])
    shown = np.isfinite(lines).any(axis=0)
    below = np.abs(run["speed"]) < 0.9 * minimum
    assert np.abs(run["creepage"])[below].max() > 1e-3
    assert not shown[below].any()
    remembers = cl.run_scenario(
        replace(slow, drivetrain=wet.drivetrain, demand=demand), "open_loop"
    )
    metrics = cl.metrics(remembers, wet.drivetrain)
    figure = scenario_run(remembers, metrics, title="", caption="", minimum_speed=minimum)
    lines = np.array([np.asarray(line.get_ydata(), float) for line in figure.axes[1].lines[:2]])
    drawn_at = np.isfinite(lines).any(axis=0)
    assert drawn_at.tolist() == (np.abs(remembers["speed"]) >= minimum).tolist()
    assert shown[np.abs(run["speed"]) >= minimum].all()
    assert 0.0 < below.mean() < 1.0


def test_runs_have_names_in_words() -> None:
    assert run_name("creep_pi") == "PI creep control"
    assert run_name("below_peak") == "below peak"


def test_a_comparison_shows_the_longest_run_to_its_end(
    runs: Mapping[str, cl.Result], metrics_of: dict[str, Metrics]
) -> None:
    names = list(runs)[:2]
    first, second = (runs[name] for name in names)
    half = second.time.size // 2
    short = cl.Result(
        second.time[:half], {n: v[:half] for n, v in second.signals.items()}, second.units
    )
    figure = comparison(
        dict(zip(names, (first, short), strict=True)), metrics_of, title="", caption=""
    )
    for axes in figure.axes:
        assert axes.get_xlim()[1] == first.time[-1]


@pytest.mark.slow
def test_a_stop_shows_speeds_and_its_distance() -> None:
    case = replace(cl.load_scenario("wheel_slide_protection.toml"), initial_speed=4.0, duration=9.0)
    stops = {name: cl.run_scenario(case, name) for name in ("open_loop", "wsp")}
    metrics = {name: cl.metrics(run, case.drivetrain) for name, run in stops.items()}
    figure = comparison(stops, metrics, title="", caption="")
    assert len(figure.axes) == 10
    for axes, (name, run) in zip(figure.axes[6:8], stops.items(), strict=True):
        _, rim, _ = checks.lines(axes, "wheel rim")
        assert_allclose(rim, run["speed"] + run["slip_velocity"])
        title = figure.axes[list(stops).index(name)].get_title("left")
        assert title.endswith(f"\n{run['distance'][-1]:.0f} m from the start")
    checks.check_layout(figure)


def with_others(part: Any) -> dict[str, Any]:
    """The part with another value of each declared number."""
    values = {}
    for name, quantity in part.quantities().items():
        value, usual = getattr(part, name), quantity.usual or (0.0, quantity.at_most)
        values[name] = 1.02 * value if value else 0.02 * usual[1]
    return {name: replace(part, **{name: value}) for name, value in values.items()}


def changed(wheelset: cl.Wheelset) -> dict[str, cl.Wheelset]:
    """The wheelset with another value of each parameter that a run depends on."""
    element, friction, contact = (
        wheelset.element,
        wheelset.element.friction,
        wheelset.element.contact,
    )
    of_element: dict[str, Any] = {
        "layer_compliance": 2e-13,
        "wheels": 4,
        "memory": True,
        "minimum_speed": 0.2,
        "load_exponent": 0.2,
        "radius": 0.46,
        "slope_reduction": 0.5,
    }
    of_friction: dict[str, Any] = {
        "static": 0.46,
        "kinetic": 0.2,
        "weakening_length": 1e-6,
        "slip_rate_decay": 0.5,
        "softening_temperature": 600.0,
    }
    of_contact: dict[str, Any] = {
        "wheel_load": 9e4,
        "radius_y": 0.4,
        "poisson_ratio": 0.28,
        "theory": "strips",
    }
    others = {name: replace(element, **{name: value}) for name, value in of_element.items()}
    for name, value in of_friction.items():
        others[name] = replace(element, friction=replace(friction, **{name: value}))
    for name, value in of_contact.items():
        others[name] = replace(element, contact=replace(contact, **{name: value}))
    wheelsets = {name: replace(wheelset, element=other) for name, other in others.items()}
    wheelsets["held"] = replace(wheelset, mass=None)
    wheelsets |= with_others(wheelset)
    for name, other in with_others(wheelset.resistance).items():
        wheelsets[name] = replace(wheelset, resistance=other)
    return wheelsets


@pytest.mark.filterwarnings("ignore:process zone")
def test_a_caption_has_every_parameter(locomotive: cl.Model) -> None:
    captions = {name: setting(body) for name, body in changed(locomotive.wheelset).items()}
    assert len({setting(locomotive.wheelset), *captions.values()}) == len(captions) + 1
    shown = {
        "layer_compliance": "layer 0.2 um/MPa",
        "memory": "memory",
        "grade": "grade 1 %",
        "wheels": "4 wheels of $P$ 110.3 kN",
        "static": "f_s 0.46",
    }
    for name, text in shown.items():
        assert text in captions[name].replace("\u00a0", " ")


def test_a_report_has_what_no_line_shows(wet: cl.Scenario) -> None:
    case = replace(
        wet,
        track=replace(wet.track, cleaning=2e-3, recovered=0.8),
        dynamic_load=cl.vehicle.DynamicLoad(time=(0.0, 1.0), factor=(0.9, 1.2)),
    )
    cleaned = "Cleaning 0.002 m/J up to the factor 0.8"
    assert track_text(case) == f"{cleaned}; wheel load of the static one, times 0.9 to 1.2."
    assert track_text(wet) == ""


def test_a_caption_has_what_is_driven(locomotive: cl.Model) -> None:
    wheelset = locomotive.wheelset
    drivetrain = Drivetrain(
        replace(wheelset, element=replace(wheelset.element, memory=True)),
        axle=Axle(stiffness=6e6, damping=500.0, drive_share=0.4),
        motor=Motor(lag=0.01, power=1.6e6, torque_rate=1e5, trip_speed=45.0),
        brake=Brake(fill_time=0.25, vent_time=0.1, delay=0.04),
    )
    of_drive = drivetrain_setting(drivetrain).replace("\u00a0", " ")
    hertz = drivetrain.torsional_frequency / (2.0 * np.pi)
    limits = "power 1600 kW, torque rate 100 kN m/s, trip at 45 m/s"
    limits += ", brake fill 0.25 s, brake vent 0.1 s, brake delay 40 ms"
    assert f"Motor lag 10 ms, {limits}, axle {hertz:.3g} Hz, " in of_drive
    assert of_drive.endswith("% of critical, drive share 0.4.")
    assert Drivetrain(locomotive.wheelset).torsional_damping_ratio == 0.0
