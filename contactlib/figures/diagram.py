"""One page of a braking or traction run, for a file of tests: every wheel and axle, and the stop.

An axle has one look on the whole page, and names stand beside the lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactlib.base.quantities import FloatArray, Limits, checked_row
from contactlib.base.text import version
from contactlib.figures.scenario import AXES, along, run_name
from contactlib.figures.style import (
    DASHED,
    DOTTED,
    name_lines,
    new_figure,
    note,
    page_size,
    paint,
    sized,
    styled,
    typeset,
)
from contactlib.files.scenario import Scenario
from contactlib.runs.accumulators import MIN_LOCK_SPEED, STOPPED_SPEED
from contactlib.runs.outcomes import Metrics
from contactlib.runs.result import Result
from contactlib.runs.signals import SIDES
from contactlib.vehicle.drivetrain import BUILT_UP, Brake
from contactlib.vehicle.track import UNCHANGED, Profile

A4, POINTS = "8.268x11.693", 8.0  # page [in], size of its text
KMH = 3.6  # km/h in 1 m/s
NOTICED = 0.01  # error of the speed that controllers get / highest speed, from which it is drawn
SHOWN = 2.0  # top of the coefficients' axis / largest used ones, without peaks
STRIPS, FEW = 4.6, 5  # height of all coefficients / the air's; axles with labels of two lines
MOST = 8  # points of rails that are listed
SLIPS = Limits(at_least=0.0, at_most=500.0)


class _Course(NamedTuple):
    """Rows of a stop, else of a run, from its first demand on; whether it brakes, and stops."""

    begin: int
    end: int
    brakes: bool
    stops: bool


def run_diagram(
    result: Result,
    metrics: Metrics,
    scenario: Scenario,
    controller: str,
    *,
    caption: str = "",
    file: str = "",
    over: str = "time",
    slip_limits: Sequence[float] = (),
) -> Figure:
    """Diagram of a braking or traction run on one upright page of A4, whatever the `page_size`.

    From top to bottom: speeds of the vehicle and of all wheels; slip speeds; pressure in the brake
    cylinders, or torque where it is not known; for each axle creep force over load, used and
    available; air vented from all cylinders, in full applications of all brakes. Vertical lines are
    at the first demand and at the stop. The heading states speed, distance, time and mean
    deceleration (v0**2 - v1**2)/(2 s) between the two; the foot states rails, brake and
    sanders. The diagram states no verdict.

    Parameters
    ----------
    result, metrics : Result, Metrics
        Result of `run_scenario`, and `contactlib.metrics` of it.
    scenario, controller : Scenario, str
        The scenario, and the name of the controller.
    caption, file : str, optional
        Caption, and name of the scenario's file, at the foot, beside the version of contactlib.
    over : str, optional
        "time", or "distance", which is that of the first axle.
    slip_limits : sequence of float, optional
        Two slip speeds between which a band is drawn [m/s]. Default: no band.

    Raises
    ------
    ValueError
        If `over` is no axis, or the limits are not two numbers in range.
    """
    limits, course = checked_row("slip_limits", slip_limits, SLIPS), _course(result, scenario)
    if len(limits) not in (0, 2):
        raise ValueError(f"slip_limits = {list(limits)} must be two numbers, or none")
    rows = slice(course.end + 1)
    signals = {name: values[rows] for name, values in result.signals.items()}
    result = Result(result.time[rows], signals, result.units)
    axles = result.by_axle
    at, brake = along(axles[0], over), scenario.drivetrain.brake if course.brakes else None
    heights = [3.0, 1.6, 1.6, *[min(STRIPS / len(axles), 1.6)] * len(axles)]
    heights += [1.0] * (brake is not None)
    look: dict[str, Any] = {"nrows": len(heights), "height_ratios": heights, "squeeze": False}
    heading = _heading(result, metrics, scenario, controller, course)
    with mpl.rc_context({"font.size": POINTS, "lines.linewidth": 1.0}), styled(), page_size(A4):
        figure, grid = new_figure(0.0, 0.0, sharex=True, **look)
        speed, slip, actuator, *strips = panels = grid[:, 0]
        _speeds(speed, slip, at, result, scenario)
        if limits:
            slip.axhspan(KMH * limits[0], KMH * limits[1], color=paint.shade, lw=0.0, zorder=0)
            edge = np.full_like(at, KMH * max(limits))
            slip.plot(at, edge, color=paint.grey, lw=0.6, label="limits")
        _actuators(actuator, at, result, brake)
        _coefficients(strips, at, result)
        if brake is not None:
            vented = _vented(result)
            strips[-1].plot(at, vented, color=paint.ink, label="vented")
            strips[-1].set_ylabel("air in full\napplications  [1]")
            heading += f", air of {vented[-1]:.3g} full applications vented"
        for panel in panels:
            panel.tick_params(labelsize=sized(10))  # also of ticks that are made when it is saved
            panel.set_ylim(bottom=None if panel is speed else 0.0)
            for row in (course.begin, *[course.end] * course.stops):
                panel.axvline(at[row], color=paint.grey, lw=0.7, ls=DOTTED)
        beside: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top"}
        note(speed, "first demand", (at[course.begin], 1.0), (3, -2), **beside)
        if course.stops:
            note(speed, "stop", (at[course.end], 1.0), (-3, -2), ha="right", **beside)
        first = "distance of the first axle" if len(axles) > 1 else "distance"
        panels[-1].set_xlabel(AXES[over].replace("distance", first))
        panels[-1].set_xlim(at.min(), max(at.max(), at.min() + 1.0))
        figure.align_ylabels(grid)
        title: dict[str, Any] = {"x": 0.01, "ha": "left", "linespacing": 1.35}
        figure.suptitle(heading, size=sized(11), **title)
        foot = f"contactlib {version()}   {file}".rstrip()
        stated = [typeset(figure, words) for words in (_settings(scenario), caption)]
        text = "\n".join(filter(None, [*stated, foot]))
        figure.supxlabel(text, size=sized(9), **title)
        name_lines(figure)
    return figure


def _course(result: Result, scenario: Scenario) -> _Course:
    """Rows from the first demand of braking, or else of traction, to the stop or the end."""
    speed = result["speed"]
    moving, demand = speed[:, np.newaxis], result["demand"].reshape(speed.size, -1)
    with_brake = scenario.drivetrain.brake is not None
    against = demand < 0.0 if with_brake else demand * moving < 0.0
    braking = (against & (np.abs(moving) >= STOPPED_SPEED)).any(axis=1)
    driving = (demand > 0.0 if with_brake else demand != 0.0).any(axis=1)
    begin = int((braking if braking.any() else driving).argmax())
    stands = np.abs(speed[begin:]) < STOPPED_SPEED
    stops = bool(braking.any() and stands.any())
    end = begin + int(stands.argmax()) if stops else speed.size - 1
    return _Course(begin, end, bool(braking.any()), stops)


def _heading(
    result: Result, metrics: Metrics, scenario: Scenario, controller: str, course: _Course
) -> str:
    """Scenario, vehicle and controller; course from the first demand; slip and locked wheels."""
    vehicle, wheelset = scenario.vehicle, scenario.drivetrain.wheelset
    what = "a wheelset on a roller rig"
    if vehicle is not None:
        what = f"{vehicle.axles} axles, {1e-3 * vehicle.own_mass:.4g} t"
        what += f" and a train of {1e-3 * vehicle.train_mass:.4g} t" * (vehicle.train_mass > 0.0)
    elif wheelset.mass is not None:
        what = f"a wheelset with {1e-3 * wheelset.mass:.4g} t"
    rows, distance = [course.begin, course.end], result["distance"].reshape(result.time.size, -1)
    (first, last), (begin, end) = result["speed"][rows], result.time[rows]
    at_first, at_last = (f"{round(KMH * v, 1) + 0.0:.1f} km/h" for v in (first, last))  # no -0.0
    way = float(distance[course.end, 0] - distance[course.begin, 0])
    to = "standstill" if course.stops else at_last
    to += ", no stop" * (course.brakes and not course.stops)
    rate = (last**2 - first**2) / (2.0 * way) if way else 0.0
    kind, sign = ("deceleration", -1.0) if course.brakes else ("acceleration", 1.0)
    mean = f", mean {kind} {sign * rate:.3g} m/s$^2$" * (wheelset.mass is not None)
    found = f"largest slip speed {KMH * metrics.largest_slip_speed:.3g} km/h"
    if course.brakes:
        time = metrics.locked_time
        locked, lasts = ("a", f" for {time:.3g} s") if time else ("no", "")
        found += f", {locked} wheel locked above {KMH * MIN_LOCK_SPEED:.0f} km/h{lasts}"
    name, rig = scenario.name.replace("$", r"\$"), run_name(controller)
    over = f"{abs(way):.0f} m in {end - begin:.1f} s from the first demand{mean}"
    return f"{name}\n{what}; {rig}\n{at_first} to {to}: {over}\n{found}"


def _settings(scenario: Scenario) -> str:
    """Rails, brake and sanders of a scenario, as far as they are given."""
    track, stated = scenario.track, list[str]()
    names = {"coefficient": "friction", "adhesion": "adhesion", "factor": "factor on friction"}
    sides = (track.friction_left, track.friction_right or track.friction_left)
    for side, profile in zip(("left rail", "right rail"), sides, strict=True):
        if sides[0] == sides[1]:
            side = "rails"
        if profile != UNCHANGED:
            stated.append(f"{side}: {names[track.unit]} {_along_the_way(profile)}")
    if (field := scenario.variation) is not None:
        spread = f"{100.0 * field.standard_deviation:.3g} %"
        stated.append(f"which varies by {spread} over {field.correlation_length:.3g} m")
    if (brake := scenario.drivetrain.brake) is not None:
        times = f"{brake.delay:.3g} s of delay, then 95 % in {BUILT_UP * brake.fill_time:.3g} s"
        stated.append(f"brake: {times}" + ", pads by a table" * (brake.pads is not None))
    if (sand := scenario.drivetrain.sanding) is not None:
        stated.append(f"sand: {sand.friction:.3g} times the friction, laid by {sand.by}")
    text = "; ".join(dict.fromkeys(stated))
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _along_the_way(profile: Profile) -> str:
    """Sections of a profile in words, or its range if it has ramps or many sections."""
    points = list(pairwise(zip(profile.at, profile.value, strict=True)))
    if len(points) > MOST or any(x < y and v != w for (x, v), (y, w) in points):
        return f"{min(profile.value):.3g} to {max(profile.value):.3g}"
    later = (f"{w:.3g} from {y:.4g} m" for (_, v), (y, w) in points if v != w)
    return ", ".join([f"{profile.value[0]:.3g}", *later])


def _named_axles(result: Result) -> Iterator[tuple[str, Result, dict[str, Any]]]:
    """Name, result and look of each axle."""
    for number, axle in enumerate(result.by_axle):
        color, width = paint.three[number % 3]
        ls = ("-", DASHED, DOTTED)[number // 3]
        look = {"color": color, "lw": 0.4 + 0.35 * width, "ls": ls}
        yield f"axle {number + 1}" if result.axles > 1 else "wheelset", axle, look


def _speeds(axes: Axes, slips: Axes, at: FloatArray, result: Result, scenario: Scenario) -> None:
    """Draw the speeds of vehicle and wheels, and the slip speeds of the wheels below."""
    speed, radius = result["speed"], scenario.drivetrain.wheelset.radius
    axes.plot(at, KMH * speed, color=paint.ink, lw=1.6, zorder=3, label="vehicle")
    for name, axle, look in _named_axles(result):
        wheels = {f"{name} {side}": axle[f"omega_{side}"] for side in SIDES}
        if not np.ptp([*wheels.values()], axis=0).any():
            wheels = {name: axle["omega"]}
        for number, (label, omega) in enumerate(wheels.items()):
            line = {**look, "lw": look["lw"] * (0.6 if number else 1.0), "label": label}
            axes.plot(at, KMH * radius * omega, **line)
            slips.plot(at, KMH * np.abs(radius * omega - speed), **line)
    if "speed_limit" in result.units:
        axes.plot(at, KMH * result["speed_limit"], color=paint.grey, label="limit", scaley=False)
    got = result["measured_speed"].reshape(speed.size, -1)[:, 0]
    if np.abs(got - speed).max() > NOTICED * np.abs(speed).max():
        axes.plot(at, KMH * got, color=paint.ink, lw=0.8, ls=DOTTED, label="measured speed")
    low, high = axes.get_ylim()
    axes.set_ylim(low if speed.min() < -STOPPED_SPEED else max(low, 0.0), 1.15 * high)
    axes.set_ylabel("speed  [km/h]")
    slips.set_ylabel("slip speed\n[km/h]")


def _actuators(axes: Axes, at: FloatArray, result: Result, brake: Brake | None) -> None:
    """Draw pressure in the cylinders, else torque of the brakes, or of the drives, and demand."""
    signal, unit, label, demand = "drive_torque", 1e-3, "torque\n[kN m]", np.abs(result["demand"])
    if brake is not None:
        signal, label, demand = "brake_torque", f"brake {label}", np.maximum(-result["demand"], 0.0)
        if brake.pressure is not None:
            signal, unit, label = "cylinder_pressure", 1e-5, "cylinder\npressure  [bar]"
            demand = brake.pressure_per_torque * demand
    demand = demand.reshape(at.size, -1).max(axis=1)
    axes.plot(at, unit * demand, color=paint.ink, ls=DOTTED, label="demand")
    for name, axle, look in _named_axles(result):
        axes.plot(at, unit * np.abs(axle[signal]), **look, label=name)
    axes.set_ylabel(label)


def _coefficients(strips: Sequence[Axes], at: FloatArray, result: Result) -> None:
    """Draw creep force over load, used and available, of each axle in a strip of its own."""
    forces = np.stack([np.abs(result["creep_force"]), result["available_force"]])
    ratio = (forces / np.maximum(result["axle_load"], 1.0)).reshape(2, at.size, -1)
    top = min(1.1 * float(ratio.max()), SHOWN * float(np.quantile(ratio[0], 0.98)))
    lines = zip(strips, ratio.T, _named_axles(result), strict=False)
    for axes, values, (name, _, look) in lines:
        used, available = values.T
        beyond = f" up to {available.max():.2g}" * bool(available.max() > top)
        axes.plot(at, available, color=paint.ink, ls=DOTTED, label=f"available{beyond}")
        axes.plot(at, used, **look, label=f"{name} used")
        axes.set_ylim(0.0, top or 1.0)
        axes.set_ylabel("coefficient\n" * (result.axles <= FEW) + "$Q/P$  [1]")


def _vented(result: Result) -> FloatArray:
    """Falls of all brake torques so far over the sum of their largest demands."""
    rows = result.time.size
    torque, demand = (result[name].reshape(rows, -1) for name in ("brake_torque", "demand"))
    if "pad_friction" in result.units:
        torque = torque / result["pad_friction"].reshape(rows, -1)
    falls = np.maximum(-np.diff(torque, axis=0, prepend=torque[:1]), 0.0).sum(axis=1).cumsum()
    return np.asarray(falls / np.maximum(-demand, 0.0).max(axis=0).sum())
