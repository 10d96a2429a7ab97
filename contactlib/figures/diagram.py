"""One page of a braking or traction run, for a file of tests: every wheel and axle, and the stop.

An axle has one look on the whole page, and names stand beside the lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
from contactlib.vehicle.drivetrain import Brake

A4, POINTS = "8.268x11.693", 8.0  # page [in], size of its text
KMH = 3.6  # km/h in 1 m/s
NOTICED = 0.01  # error of the speed that controllers get / highest speed, from which it is drawn
SHOWN = 2.0  # top of the coefficients' axis / largest used ones, without peaks
FEW = 5  # axles whose strips have room for a label of two lines
STRIPS = 4.6  # height of the coefficients of all axles / that of the air
BANDS = {  # limits of the limits of a band, by argument
    "slip_limits": Limits(at_least=0.0, at_most=500.0),
    "creepage_limits": Limits(at_least=0.0, at_most=10.0),
}


class _Course(NamedTuple):
    """First and last row of a stop, else of a run from its first demand, and whether it brakes."""

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
    creepage_limits: Sequence[float] = (),
) -> Figure:
    """Diagram of a braking or traction run on one upright page of A4, whatever the `page_size`.

    From top to bottom: speeds of the vehicle and of all wheels; slip speeds; pressure in the brake
    cylinders, or torque where it is not known; coefficient of each axle, creep force used and
    available over load; air vented from all cylinders, in full applications of all brakes. A
    vertical line is at the first demand, another one at the stop. The heading states initial speed,
    distance, time and mean deceleration (v0**2 - v1**2)/(2 s) between the two, the foot the version
    of contactlib. The diagram states no verdict.

    Parameters
    ----------
    result : Result
        Result of `run_scenario`.
    metrics : Metrics
        `contactlib.metrics` of the run.
    scenario : Scenario
        The scenario that was run.
    controller : str
        Name of its controller.
    caption : str, optional
        Caption at the foot.
    file : str, optional
        Name of the scenario's file, for the foot.
    over : str, optional
        "time", or "distance", which is that of the first axle.
    slip_limits : sequence of float, optional
        Two slip speeds between which a band is drawn [m/s]. Default: no band.
    creepage_limits : sequence of float, optional
        Two creepages whose slip speeds at the vehicle's speed are the limits of a band [1].

    Raises
    ------
    ValueError
        If limits are not two rising numbers in range.
    """
    course = _course(result, scenario)
    rows = slice(course.end + 1)
    drawn = {name: values[rows] for name, values in result.signals.items()}
    result = Result(result.time[rows], drawn, result.units)
    axles = result.by_axle
    at = along(axles[0], over)
    bands = [
        (checked_band("slip_limits", slip_limits), np.ones_like(at)),
        (checked_band("creepage_limits", creepage_limits), np.abs(result["speed"])),
    ]
    brake = scenario.drivetrain.brake if course.brakes else None
    vented = None if brake is None else _vented(result)
    strip = min(STRIPS / len(axles), 1.6)
    heights: list[float] = [3.0, 1.6, 1.6, *[strip] * len(axles), *[1.0] * (brake is not None)]
    look: dict[str, Any] = {"nrows": len(heights), "height_ratios": heights, "squeeze": False}
    with mpl.rc_context({"font.size": POINTS, "lines.linewidth": 1.0}), styled(), page_size(A4):
        figure, grid = new_figure(0.0, 0.0, sharex=True, **look)
        speed, slip, actuator, *strips = (panel for (panel,) in grid)
        _speeds(speed, slip, at, result, scenario)
        for ends, factor in bands:
            if ends:
                low, high = (KMH * end * factor for end in ends)
                slip.fill_between(at, low, high, color=paint.shade, lw=0.0, zorder=0)
                slip.plot(at, high, color=paint.grey, lw=0.6, label="limits")
        slip.set_ylim(bottom=0.0)
        _actuators(actuator, at, result, brake)
        coefficients = np.array([_coefficients(axle) for axle in axles])
        usual = float(np.quantile(coefficients[:, 0], 0.98))
        for panel, named in zip(strips, _named_axles(result), strict=False):
            _strip(panel, at, *named, min(1.1 * float(coefficients.max()), SHOWN * usual))
            panel.set_ylabel("coefficient\n" * (len(axles) <= FEW) + "$Q/P$  [1]")
        if vented is not None:
            strips[-1].plot(at, vented, color=paint.ink, label="vented")
            strips[-1].set(ylim=(0.0, None), ylabel="air in full\napplications  [1]")
        for panel in grid[:, 0]:
            panel.tick_params(labelsize=sized(10))  # also of ticks that are made when it is saved
            for row in (course.begin, *[course.end] * course.stops):
                panel.axvline(at[row], color=paint.grey, lw=0.7, ls=DOTTED)
        _name_marks(speed, at, course)
        place = AXES[over].replace("distance", "distance of the first axle")
        grid[-1, 0].set_xlabel(AXES[over] if len(axles) == 1 else place)
        grid[-1, 0].set_xlim(at.min(), max(at.max(), at.min() + 1.0))
        figure.align_ylabels(grid)
        heading = _heading(result, metrics, scenario, controller, course)
        if vented is not None:
            heading += f", air of {vented[-1]:.3g} full applications vented"
        title: dict[str, Any] = {"x": 0.01, "ha": "left", "linespacing": 1.35}
        figure.suptitle(heading, size=sized(11), **title)
        foot = f"contactlib {version()}" + f"   {file}" * bool(file)
        text = "\n".join(filter(None, [typeset(figure, caption), foot]))
        figure.supxlabel(text, size=sized(9), **title)
        name_lines(figure)
    return figure


def checked_band(name: str, given: Sequence[float]) -> tuple[float, ...]:
    """Return the limits of a band, or raise a ValueError that names the argument."""
    ends = checked_row(name, given, BANDS[name])
    if len(ends) not in (0, 2) or ends != tuple(sorted(set(ends))):
        raise ValueError(f"{name} = {list(ends)} must be two rising numbers, or none")
    return ends


def _course(result: Result, scenario: Scenario) -> _Course:
    """Rows from the first demand of braking, or else of traction, to the stop or the end."""
    speed = result["speed"]
    moving, demand = speed[:, np.newaxis], result["demand"].reshape(speed.size, -1)
    against = demand < 0.0 if scenario.drivetrain.brake is not None else demand * moving < 0.0
    braking = (against & (moving != 0.0)).any(axis=1)
    begin = int((braking if braking.any() else demand.any(axis=1)).argmax())
    stands = np.abs(speed[begin:]) < STOPPED_SPEED
    stops = bool(braking.any() and stands.any())
    end = begin + int(stands.argmax()) if stops else speed.size - 1
    return _Course(begin, end, bool(braking.any()), stops)


def _heading(
    result: Result, metrics: Metrics, scenario: Scenario, controller: str, course: _Course
) -> str:
    vehicle, wheelset = scenario.vehicle, scenario.drivetrain.wheelset
    escaped = scenario.name.replace("$", r"\$")
    what = f"a wheelset with {1e-3 * (wheelset.mass or 0.0):.4g} t"
    if vehicle is not None:
        what = f"{vehicle.axles} axles, {1e-3 * vehicle.own_mass:.4g} t"
        what += f" and a train of {1e-3 * vehicle.train_mass:.4g} t" * (vehicle.train_mass > 0.0)
    elif wheelset.speed_held:
        what = "a wheelset on a roller rig"
    rows = [course.begin, course.end]
    first, last = result["speed"][rows]
    time = float(np.diff(result.time[rows])[0])
    way = float(np.diff(result["distance"].reshape(result.time.size, -1)[rows, 0])[0])
    over = f"{abs(way):.0f} m in {time:.1f} s from the first demand"
    end = "to standstill" if course.stops else f"to {KMH * last:.1f} km/h, no stop"
    if not course.brakes:
        end = f"to {KMH * last:.1f} km/h"
    held = ", the speed is held" * wheelset.speed_held
    rate = (last**2 - first**2) / (2.0 * way) if way else 0.0
    mean = f", mean {'deceleration' if course.brakes else 'acceleration'} "
    mean += f"{-rate if course.brakes else rate:.3g} m/s$^2$"
    slip = f"largest slip speed {KMH * metrics.largest_slip_speed:.3g} km/h"
    lock = f"a wheel locked for {metrics.locked_time:.3g} s above {KMH * MIN_LOCK_SPEED:.0f} km/h"
    found = [slip, lock if metrics.locked_time else "no wheel locked"] if course.brakes else [slip]
    return (
        f"{escaped}\n{what}; {run_name(controller)}\n"
        f"{KMH * first:.1f} km/h {end}: {over}{held or mean}\n{', '.join(found)}"
    )


def _look(number: int) -> dict[str, Any]:
    """Colour, width and dashes of an axle, by its number from 0."""
    color, width = paint.three[number % 3]
    return {"color": color, "lw": 0.4 + 0.35 * width, "ls": ("-", DASHED, DOTTED)[number // 3]}


def _named_axles(result: Result) -> Iterator[tuple[str, Result, dict[str, Any]]]:
    """Name, result and look of each axle."""
    for number, axle in enumerate(result.by_axle):
        yield f"axle {number + 1}" if result.axles > 1 else "wheelset", axle, _look(number)


def _speeds(axes: Axes, slips: Axes, at: FloatArray, result: Result, scenario: Scenario) -> None:
    """Draw the speeds of vehicle and wheels, and the slip speeds of the wheels below."""
    speed, radius = result["speed"], scenario.drivetrain.wheelset.radius
    axes.plot(at, KMH * speed, color=paint.ink, lw=1.6, zorder=3, label="vehicle")
    for name, axle, look in _named_axles(result):
        both = [axle[f"omega_{side}"] for side in SIDES]
        wheels = zip(SIDES, both, strict=True) if (both[0] != both[1]).any() else [("", both[0])]
        for side, omega in wheels:
            line = {**look, "lw": look["lw"] * (0.6 if side == "right" else 1.0)}
            line["label"] = f"{name} {side}".rstrip()
            axes.plot(at, KMH * radius * omega, **line)
            slips.plot(at, KMH * np.abs(radius * omega - speed), **line)
    if "speed_limit" in result.units:
        axes.plot(at, KMH * result["speed_limit"], color=paint.grey, label="limit", scaley=False)
    top = KMH * float(np.abs(speed).max())
    if float(np.abs(result["measured_speed"].T - speed).max()) > NOTICED * top / KMH:
        got = result["measured_speed"].reshape(speed.size, -1)[:, 0]
        axes.plot(at, KMH * got, color=paint.ink, lw=0.8, ls=DOTTED, label="measured speed")
    axes.set_ylabel("speed  [km/h]")
    low, high = axes.get_ylim()
    axes.set_ylim(low if speed.min() < -STOPPED_SPEED else max(low, 0.0), 1.15 * high)
    slips.set_ylabel("slip speed\n[km/h]")


def _actuators(axes: Axes, at: FloatArray, result: Result, brake: Brake | None) -> None:
    """Draw pressure in the cylinders, else torque of the brakes, or of the drives, and demand."""
    signal, unit, label = "drive_torque", 1e-3, "torque\n[kN m]"
    demand = np.abs(result["demand"]).reshape(at.size, -1).max(axis=1)
    if brake is not None:
        signal, label = "brake_torque", f"brake {label}"
        demand = np.maximum(-result["demand"], 0.0).reshape(at.size, -1).max(axis=1)
        if brake.pressure is not None:
            signal, unit, label = "cylinder_pressure", 1e-5, "cylinder\npressure  [bar]"
            demand = demand * brake.pressure_per_torque
    axes.plot(at, unit * demand, color=paint.ink, ls=DOTTED, label="demand")
    for name, axle, look in _named_axles(result):
        axes.plot(at, unit * np.abs(axle[signal]), **look, label=name)
    axes.set_ylabel(label)
    axes.set_ylim(bottom=0.0)


def _coefficients(axle: Result) -> FloatArray:
    """Creep force over load, used and available, in two rows."""
    forces = np.stack([np.abs(axle["creep_force"]), axle["available_force"]])
    return np.asarray(forces / np.maximum(axle["axle_load"], 1.0))


def _strip(axes: Axes, at: FloatArray, name: str, axle: Result, look: Any, top: float) -> None:
    """Draw creep force over load, used and available."""
    used, available = _coefficients(axle)
    beyond = f" up to {available.max():.2g}" * bool(available.max() > top)
    axes.plot(at, available, color=paint.ink, ls=DOTTED, label=f"available{beyond}")
    axes.plot(at, used, **look, label=f"{name} used")
    axes.set_ylim(0.0, top or 1.0)


def _vented(result: Result) -> FloatArray:
    """Falls of all brake torques so far over the sum of their largest demands."""
    rows = result.time.size
    torque, demand = (result[name].reshape(rows, -1) for name in ("brake_torque", "demand"))
    falls = np.maximum(-np.diff(torque, axis=0, prepend=torque[:1]), 0.0).sum(axis=1).cumsum()
    return np.asarray(falls / np.maximum(-demand, 0.0).max(axis=0).sum())


def _name_marks(axes: Axes, at: FloatArray, course: _Course) -> None:
    """Name the vertical lines of the demand and the stop."""
    look: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top"}
    note(axes, "first demand", (at[course.begin], 1.0), (3, -2), **look)
    if course.stops:
        note(axes, "stop", (at[course.end], 1.0), (-3, -2), ha="right", **look)
