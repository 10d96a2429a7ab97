"""Stops of a catalogue: a sweep with draws of what is uncertain, and what of it can be promised.

Quantiles have confidence intervals by order statistics, which hold for any distribution: of n
independent stops the number below a quantile is binomial. H. A. David, H. N. Nagaraja, "Order
Statistics", 3rd ed., Wiley 2003, section 7.1. The interval of a share is that of C. J. Clopper,
E. S. Pearson, Biometrika 26 (1934) 404-413. A stop that does not end within its run is longer than
any other.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import Limits, checked_number
from contactlib.base.text import fixed_width
from contactlib.base.units import in_si
from contactlib.base.writing import package_folder, write_whole
from contactlib.files.reading import loading, model_path, referred_files
from contactlib.files.scenario import (
    Scenario,
    ScenarioContents,
    build_scenario,
    read_contents,
    read_controllers,
)
from contactlib.runs.outcomes import OUTCOMES
from contactlib.runs.sweep.axes import find_target
from contactlib.runs.sweep.plan import Sweep
from contactlib.traction import CONTROLLERS
from contactlib.vehicle.track import RAILS

if TYPE_CHECKING:
    from xarray import Dataset

DISTANCE = "stopping_distance"
CONFIDENCE, SHARE = 0.95, Limits(above=0.0, below=1.0)
QUANTILES = {"median": 0.5, "95 %": 0.95, "99 %": 0.99}
SPEEDS, LEVELS = (0.4, 0.6, 0.8, 1.0), (0.75, 1.0, 1.25, 1.5)  # of the default catalogue
LEVEL = "track.variation.median"
DEMANDS = tuple(f"demand.{term}" for term in ("torque", "deceleration", "brake_force", "pressure"))
BUILD_UP = "brake.fill_time", "brake.build_up_time"
RADII = "vehicle.wheelset.radius", "vehicle.contact.radius_x"  # rolling, and the wheel's
LOWEST = 0.7  # level of friction at which its default distribution is cut
HEAD = """\
# Stops of a catalogue, written for {file}: {count} speeds and rails, each with
# the same {draws} draws of what is uncertain. The ranges are chosen, not measured: put yours in.
# Axes with values make the catalogue, axes with a distribution are drawn. Change and add axes,
# then run it by: contactlib stops {name}
name = {title}
source = "scenario: {file}; ranges chosen"
scenario = "{file}"
controllers = [{controller}]
outcomes = ["stopping_distance", "locked_axles"{air}]
until_stop = true    # a run ends when the vehicle has stopped
# limit = [{limits}]    # distance for each speed that no stop should exceed, in m

[sampling]
runs = {draws}
seed = {seed}
"""


class Estimate(NamedTuple):
    """A number estimated from draws, and its confidence interval."""

    value: float
    low: float
    high: float


def quantile(values: ArrayLike, part: float, confidence: float = CONFIDENCE) -> Estimate:
    """Quantile of a distribution from independent draws, with a distribution-free interval.

    Parameters
    ----------
    values : array_like
        The draws; infinite and missing ones count as larger than any other.
    part : float
        Part of the distribution below the quantile, between 0 and 1.
    confidence : float, optional
        Probability with which the interval contains the quantile, at least.

    Returns
    -------
    Estimate
        Infinite where the quantile or an end of its interval is unknown.

    Examples
    --------
    >>> quantile(range(1, 101), 0.5)
    Estimate(value=50.0, low=40.0, high=61.0)
    >>> quantile(range(1, 101), 0.99)  # 100 draws do not bound it
    Estimate(value=99.0, low=96.0, high=inf)
    """
    from scipy.stats import binom  # imported late, as it takes a third of a worker's start

    part = checked_number("part", part, SHARE)
    tail = 0.5 * (1.0 - checked_number("confidence", confidence, SHARE))
    draws = np.asarray(values, dtype=np.float64).ravel()
    ordered = np.sort(np.where(np.isnan(draws), np.inf, draws))
    n = ordered.size
    # Of n draws k ~ B(n, part) lie below the quantile: k >= low and k < high, each but for a tail.
    low, high = int(binom.ppf(tail, n, part)), int(binom.ppf(1.0 - tail, n, part)) + 1
    place = max(math.ceil(n * part * (1.0 - 1e-12)), 1)
    sides = np.concatenate([[-np.inf], ordered, [np.inf]])
    return Estimate(*(float(sides[k]) for k in (place, low, min(high, n + 1))))


def share(count: int, of: int, confidence: float = CONFIDENCE) -> Estimate:
    """Probability from the number of draws in which something happens, after Clopper and Pearson.

    Examples
    --------
    >>> [round(number, 4) for number in share(0, 100)]
    [0.0, 0.0, 0.0362]
    """
    from scipy.stats import binomtest

    found = binomtest(count, of).proportion_ci(confidence, method="exact")
    return Estimate(count / of, float(found.low), float(found.high))


class Stop(NamedTuple):
    """One stop of the catalogue under one controller.

    Attributes
    ----------
    controller : str
        Name of the controller.
    conditions : mapping
        Values of the axes that vary in the catalogue, with units, by name.
    runs : ndarray
        Indices of its runs in the sweep.
    distance : ndarray
        Stopping distances [m]; infinite without a stop within the run, or if the run failed.
    failed : int
        Number of runs that failed.
    limit : float
        Distance that no stop should exceed [m]; nan if there is none.
    others : mapping
        Draws of the other outcomes of the sweep, by name.
    """

    controller: str
    conditions: Mapping[str, str]
    runs: Any
    distance: Any
    failed: int
    limit: float
    others: Mapping[str, Any]

    @property
    def unstopped(self) -> int:
        """Number of runs without a stop, and without a failure."""
        return int(np.isinf(self.distance).sum()) - self.failed

    @property
    def exceeding(self) -> Estimate | None:
        """Share of the stops that exceed the limit."""
        if math.isnan(self.limit):
            return None
        return share(int((self.distance > self.limit).sum()), self.distance.size)


def check_stops(sweep: Sweep) -> None:
    """Refuse a sweep without draws at the points of a grid, or without stopping distances."""
    if not sweep.plan.draws or DISTANCE not in sweep.plan.outcomes:
        raise ValueError(
            "stops need axes with a distribution on a grid, as in the file that contactlib stops "
            "writes for a scenario, and the outcome stopping_distance"
        )


def stops_of(sweep: Sweep, dataset: Dataset) -> Iterator[Stop]:
    """The stops of a catalogue from the sweep's results, by controller and point of the grid."""
    each = sweep.plan.draws
    grid = [(i, axis) for i, axis in enumerate(sweep.plan.axes) if axis.spread.kind == "values"]
    varied = [(i, axis) for i, axis in grid if len(axis.spread.numbers) > 1]
    points = sweep.runs // each
    limits = np.repeat(sweep.limit or (math.nan,), points // max(len(sweep.limit), 1))
    names = [name for name in sweep.plan.outcomes if name in dataset and name != DISTANCE]
    for j, controller in enumerate(sweep.plan.controllers):
        for point in range(points):
            runs = np.arange(point * each, (point + 1) * each)
            taken = {
                name: dataset[name].values[j].ravel()[runs]
                for name in (DISTANCE, "failed", *names)
                if dataset[name].dims[0] == "controller"
            }
            distance = np.where(np.isnan(taken[DISTANCE]), np.inf, taken.pop(DISTANCE))
            conditions = {
                axis.name: _shown(float(sweep.values[runs[0], i]), axis.unit, sweep.scenario)
                for i, axis in varied
            }
            failed = int(taken.pop("failed").sum())
            yield Stop(controller, conditions, runs, distance, failed, float(limits[point]), taken)


def _shown(value: float, unit: str, scenario: Scenario) -> str:
    """A value of an axis with its unit; a speed in that of the scenario's file."""
    if unit == "m/s":
        value, unit = value / in_si(f"1 {scenario.speed_unit}", "m/s"), scenario.speed_unit
    return f"{value:.4g}{'' if unit == '1' else f' {unit}'}"


def summary_text(sweep: Sweep, stops: Sequence[Stop]) -> str:
    """Table of the stops: quantiles with confidence intervals, shares, air; and how to repeat one.

    Parameters
    ----------
    sweep : Sweep
        The sweep.
    stops : sequence of Stop
        From `stops_of`.
    """
    several = len({stop.controller for stop in stops}) > 1
    limited = any(stop.exceeding for stop in stops)
    titles = [*stops[0].conditions, *(["controller"] if several else []), *QUANTILES]
    titles += ["not stopped", "failed", *(["limit", "exceed it"] if limited else [])]
    rows = [[*titles, *(name.replace("_", " ") for name in stops[0].others)]]
    for stop in stops:
        row = [*stop.conditions.values(), *([stop.controller] if several else [])]
        row += [_with_interval(quantile(stop.distance, part)) for part in QUANTILES.values()]
        row += [str(stop.unstopped), str(stop.failed)]
        if limited:
            over = stop.exceeding
            row += [f"{stop.limit:.4g}", "-"] if over is None else [f"{stop.limit:.4g}", ""]
            if over is not None:
                row[-1] = _with_interval(Estimate(*(100.0 * x for x in over)), " %", 3)
        for name, values in stop.others.items():
            row.append(_mean_and_largest(name, values))
        rows.append(row)
    first = stops[0].runs
    return "\n".join(
        [
            f"{sweep.name}: {len(stops)} stops with {first.size} draws each, the same for all",
            "",
            fixed_width(rows),
            "",
            f"Stopping distances in m: quantile ({100.0 * CONFIDENCE:g} % confidence interval by",
            "order statistics). Runs that did not stop within their duration, or failed, count as",
            "longer than any other; a quantile or an end that falls there is unknown. Shares have",
            "the interval of Clopper and Pearson; other outcomes: mean (maximum).",
            "",
            f"Repeat stop N of the CSV file's column run, with all signals: contactlib stops "
            f"{sweep.stem}.toml --repeat N",
        ]
    )


def _with_interval(estimate: Estimate, unit: str = "", digits: int = 4) -> str:
    value, low, high = (f"{x:.{digits}g}" if math.isfinite(x) else "unknown" for x in estimate)
    return f"{value}{unit} ({low} to {high})"


def _mean_and_largest(name: str, values: Any) -> str:
    """Mean and maximum, or the share of what is yes or no."""
    outcome, known = OUTCOMES[name], values[np.isfinite(values)]
    if not known.size:
        return "-"
    size, unit = (100.0, " %") if outcome.percent or outcome.yes_or_no else (1.0, "")
    mean, largest = (f"{size * x:.3g}{unit}" for x in (known.mean(), known.max()))
    return mean if outcome.yes_or_no else f"{mean} ({largest})"


def write_summary(folder: str | os.PathLike[str], sweep: Sweep, stops: Sequence[Stop]) -> str:
    """Write NAME.summary.txt, and .csv with numbers to full precision; return the text."""
    text, lines = summary_text(sweep, stops), io.StringIO()
    table = [*stops[0].conditions, "controller", "stops", "not_stopped", "failed"]
    ends = ("", "_low", "_high")
    table += [f"{name.replace(' %', '_percent')}{end} [m]" for name in QUANTILES for end in ends]
    table += ["limit [m]", *(f"exceeding{end}" for end in ends)]
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow([*table, *(f"mean {name}" for name in stops[0].others)])
    for stop in stops:
        numbers = [stop.distance.size, stop.unstopped, stop.failed]
        numbers += [x for part in QUANTILES.values() for x in quantile(stop.distance, part)]
        numbers += [stop.limit, *(stop.exceeding or (math.nan,) * 3)]
        numbers += [float(np.nanmean(values)) for values in stop.others.values()]
        writer.writerow([*stop.conditions.values(), stop.controller, *map(repr, numbers)])
    for suffix, content in (("txt", f"{text}\n"), ("csv", lines.getvalue())):
        write_whole(Path(folder) / f"{sweep.stem}.summary.{suffix}", content.encode())
    return text


# ---- the default catalogue -------------------------------------------------------------------


def write_stops(
    scenario: str | os.PathLike[str], folder: str | os.PathLike[str], draws: int, seed: int
) -> Path:
    """Write the default catalogue of a scenario as a sweep file; return its path.

    The scenario and the files that it refers to are copied beside it, but for shipped ones.

    Raises
    ------
    ModelError
        If the scenario is not valid.
    ValueError
        If it does not brake, or a file that is there already has another content.
    OSError
        If a file cannot be read or written.
    """
    file, folder = model_path(scenario), Path(folder)
    with loading(scenario), referred_files() as referred:
        contents = read_contents(file)
        wheelset = contents.build_vehicle(None, lambda part: None)
        text = sweep_text(file.name, contents, build_scenario(contents.data, wheelset), draws, seed)
    path = folder / f"{file.stem}_stops.toml"
    copies = {path: text.encode()}
    if file.resolve().parent != package_folder("models").resolve():
        sources = [file, *map(Path, referred)]
        copies |= {folder / one.relative_to(file.parent): one.read_bytes() for one in sources}
    for copy, content in copies.items():
        if copy.exists() and copy.read_bytes() != content:
            raise ValueError(
                f"{copy} already exists with another content: to run what is there, contactlib "
                f"stops {path}; or choose another output folder"
            )
    for copy, content in copies.items():
        copy.parent.mkdir(parents=True, exist_ok=True)
        write_whole(copy, content)
    return path


def sweep_text(
    file: str, contents: ScenarioContents, scenario: Scenario, draws: int, seed: int
) -> str:
    """Text of the default catalogue: four speeds, four rails, and draws of what the file has."""
    designs = read_controllers(contents.data["controllers"])
    sampled = [name for name, design in designs.items() if design.kind in CONTROLLERS]
    if min(scenario.demand.value) >= 0.0 or scenario.held_speed is not None or not sampled:
        raise ValueError(
            "a stop needs a demand that brakes, a vehicle that is free to stop, and a sampled "
            "controller"
        )
    chosen = min(sampled, key=lambda name: designs[name].kind != "wsp")
    unit = scenario.speed_unit
    top = scenario.initial_speed / in_si(f"1 {unit}", "m/s")
    speeds = [f"{part * top:.4g} {unit}" for part in SPEEDS]

    def known(*paths: str) -> list[str]:
        """Those paths whose numbers the files give."""
        found = []
        for path in paths:
            with suppress(ValueError):
                found.append(find_target(path, contents, None, factor=True).path)
        return found

    catalogue = [_axis("speed", "initial speed", "run.initial_speed", values=speeds)]
    poorest = _poorest_rails(contents, known(*(f"track.{key}" for key in RAILS[:3])))
    friction = known("vehicle.friction.static", "vehicle.friction.kinetic")
    if poorest:
        label, base, paths = "friction of the poorest rails", *poorest
        levels = [float(f"{level * base:.3g}") for level in LEVELS]
        catalogue.append(_axis("rails", label, paths, values=levels))
    elif friction and "condition" not in contents.data.get("track", {}):
        label = "friction / that of the wheelset's file"
        catalogue.append(_axis("rails", label, friction, factor=True, values=list(LEVELS)))
    else:
        catalogue.append(_axis("rails", "friction / nominal", LEVEL, values=list(LEVELS)))
    duration, why = _duration(scenario)
    catalogue.append(why + _axis("duration", "duration", "run.duration", values=[duration]))
    drawn = []
    if f'"{LEVEL}"' not in "".join(catalogue):
        level = (1.0, 0.1, LOWEST, 1.3)
        drawn.append(_axis("level", "friction / that of the rails", LEVEL, normal=level))
    if scenario.variation is None:
        path = "track.variation."
        drawn += [
            _axis(
                "variation", "deviation along the line", f"{path}standard_deviation", values=[0.15]
            ),
            _axis("length", "correlation length", f"{path}correlation_length", values=["50 m"]),
        ]
    seeds = {"distribution": '"whole"', "from": 1, "to": 1_000_000_000}
    drawn.append(_axis("line", "seed of the line", "track.variation.seed", **seeds))
    for name, label, paths, normal in (
        ("pads", "brake torque / nominal", known(*DEMANDS), (1.0, 0.05, 0.8, 1.2)),
        ("build_up", "build-up time / nominal", known(*BUILD_UP), (1.0, 0.1, 0.7, 1.3)),
        ("load", "load / nominal", known("vehicle.body_mass"), (1.0, 0.04, 0.9, 1.1)),
        ("diameter", "wheel diameter / nominal", known(*RADII), (0.97, 0.02, 0.93, 1.0)),
    ):
        if paths:
            drawn.append(_axis(name, label, paths, factor=True, normal=normal))
    error = "error of the assumed wheel diameter"
    path = "sensors.wheel_diameter_error"
    drawn.append(_axis("sensors", error, path, normal=(0.0, 0.003, -0.01, 0.01)))
    head = HEAD.format(
        file=file,
        count=f"{len(SPEEDS)} x {len(LEVELS)}",
        draws=draws,
        seed=seed,
        name=f"{Path(file).stem}_stops.toml",
        title=json.dumps(f"Stops: {scenario.name}", ensure_ascii=False),
        controller=json.dumps(chosen),
        air=', "air_used"' if scenario.drivetrain.brake else "",
        limits=", ".join(f"L{i}" for i in range(1, len(SPEEDS) + 1)),
    )
    return "\n".join([head, *catalogue, *drawn])


def _axis(
    name: str,
    label: str,
    paths: str | Sequence[str],
    *,
    factor: bool = False,
    normal: Sequence[float] = (),
    **keys: Any,
) -> str:
    """Section of an axis."""
    if normal:
        ends = ("mean", "standard_deviation", "from", "to")
        keys = {"distribution": '"normal"', **dict(zip(ends, normal, strict=True))}
    target = {"factor_on" if factor else "parameter": json.dumps(paths)}
    if "values" in keys:
        keys["values"] = json.dumps(keys["values"])
    given = {"label": json.dumps(label), **target, **keys}
    return f"[axes.{name}]\n" + "".join(f"{key} = {value}\n" for key, value in given.items())


def _poorest_rails(
    contents: ScenarioContents, lists: Sequence[str]
) -> tuple[float, list[str]] | None:
    """Smallest friction in the track's lists, and the paths of the numbers that are so small."""
    given = {path: find_target(path, contents, None, factor=True).base or () for path in lists}
    lowest = min((min(values) for values in given.values()), default=math.nan)
    paths = [
        f"{path}[{i}]"
        for path, values in given.items()
        for i, value in enumerate(values)
        if value == lowest
    ]
    return (lowest, paths) if paths else None


def _duration(scenario: Scenario) -> tuple[float, str]:
    """Duration for the slowest stop [s], and the reason in words."""
    body, friction = scenario.drivetrain.wheelset, scenario.drivetrain.wheelset.element.friction
    lowest = scenario.rails.lowest[0] * friction.kinetic * min(LEVELS) * LOWEST
    force = min(-min(scenario.demand.value) / body.radius, lowest * scenario.static_load)
    moved = scenario.axles * (body.mass or math.inf)
    slowest = force * float(scenario.shares_of_demand[1].sum()) / moved
    begin = scenario.demand.at[int(np.argmin(scenario.demand.value))]
    time = 10.0 * math.ceil(0.1 * (begin + 1.5 * abs(scenario.initial_speed) / slowest + 10.0))
    return time, (
        f"# The slowest stop decelerates by {slowest:.2g} m/s2, by the demand or on friction of\n"
        f"# {lowest:.2g} all the way; half as long again, and 10 s, for what else delays it.\n"
    )
