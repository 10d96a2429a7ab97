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
    TERMS,
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

DISTANCE, FAILED = "stopping_distance", "failed"
CONFIDENCE, SHARE = 0.95, Limits(above=0.0, below=1.0)
QUANTILES = {"median": 0.5, "95 %": 0.95, "99 %": 0.99}
READING = f"""
Stopping distances in m: quantile ({100.0 * CONFIDENCE:g} % confidence interval by order statistics)
of {{0}} draws, the same for all stops. Runs that did not stop within their duration, or failed,
count as longer than any other; a quantile or an end that falls there is unknown. Shares have the
interval of Clopper and Pearson; other outcomes: mean (maximum).
"""


class Estimate(NamedTuple):
    """A number estimated from draws, and its confidence interval."""

    value: float
    low: float
    high: float

    def text(self, digits: int = 4, unit: str = "") -> str:
        """The numbers in words; what is infinite is unknown."""
        value, low, high = (f"{x:.{digits}g}" if math.isfinite(x) else "unknown" for x in self)
        return f"{value}{unit} ({low} to {high})"


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
    Estimate(value=99.0, low=97.0, high=inf)
    """
    from scipy.stats import binom  # imported late, as it takes a third of a worker's start

    part = checked_number("part", part, SHARE)
    tail = 0.5 * (1.0 - checked_number("confidence", confidence, SHARE))
    draws = np.asarray(values, dtype=np.float64).ravel()
    n = draws.size
    # Of n draws k ~ B(n, part) lie below the quantile: k >= low and k < high, each but for a tail.
    low, high = int(binom.ppf(tail, n, part)), int(binom.ppf(1.0 - tail, n, part)) + 1
    place = max(math.ceil(n * part * (1.0 - 1e-12)), 1)
    ordered = np.sort(np.where(np.isnan(draws), np.inf, draws))
    ends = np.concatenate([[-np.inf], ordered, [np.inf]])
    return Estimate(*ends[[place, low, min(high, n + 1)]].tolist())


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
    conditions : mapping
        Values of the axes that vary in the catalogue, with units, and the controller if several
        run, by name.
    limit : float
        Distance that no stop should exceed [m], or nan.
    draws : mapping
        Draws of the outcomes of the sweep, and of ``failed``, by name. Stopping distances are
        infinite without a stop within the run, or if the run failed.
    """

    conditions: Mapping[str, str]
    limit: float
    draws: Mapping[str, Any]

    @property
    def distance(self) -> Any:
        """Stopping distances [m]."""
        return self.draws[DISTANCE]

    @property
    def numbers(self) -> dict[str, float | Estimate]:
        """What is known of the stop, by name; shares from 0 to 1."""
        failed, without = int(self.draws[FAILED].sum()), int(np.isinf(self.distance).sum())
        found: dict[str, float | Estimate] = {
            name: quantile(self.distance, part) for name, part in QUANTILES.items()
        }
        found |= {"not stopped": without - failed, FAILED: failed}
        if not math.isnan(self.limit):
            over = share(int((self.distance > self.limit).sum()), self.distance.size)
            found |= {"limit": self.limit, "exceed it": over}
        return found


def check_stops(sweep: Sweep) -> None:
    """Refuse a sweep without draws at the points of a grid, or without stopping distances."""
    if not sweep.plan.draws or DISTANCE not in sweep.plan.outcomes:
        raise ValueError(
            "stops need axes with a distribution on a grid, as in the file that contactlib stops "
            f"writes for a scenario, and the outcome {DISTANCE}"
        )


def stops_of(sweep: Sweep, dataset: Dataset) -> Iterator[Stop]:
    """The stops of a catalogue from the sweep's results, by controller and point of the grid."""
    plan, points = sweep.plan, sweep.runs // sweep.plan.draws
    limits = np.repeat(sweep.limit or (math.nan,), points // max(len(sweep.limit), 1))
    names = [DISTANCE, FAILED, *(name for name in plan.outcomes if name in OUTCOMES)]
    for j, controller in enumerate(plan.controllers):
        rows = {name: dataset[name].values[j].reshape(points, -1) for name in names}
        rows[DISTANCE] = np.where(np.isnan(rows[DISTANCE]), np.inf, rows[DISTANCE])
        for point, first in enumerate(sweep.values[:: plan.draws].tolist()):
            conditions = {
                axis.name: _shown(value, axis.unit, sweep.scenario)
                for axis, value in zip(plan.axes, first, strict=True)
                if axis.spread.kind == "values" and len(axis.spread.numbers) > 1
            }
            if len(plan.controllers) > 1:
                conditions["controller"] = controller
            draws = {name: values[point] for name, values in rows.items()}
            yield Stop(conditions, float(limits[point]), draws)


def _shown(value: float, unit: str, scenario: Scenario) -> str:
    """A value of an axis with its unit; a speed in that of the scenario's file."""
    if unit == "m/s":
        value, unit = value / in_si(f"1 {scenario.speed_unit}", "m/s"), scenario.speed_unit
    return f"{value:.4g}{'' if unit == '1' else f' {unit}'}"


def summary_text(sweep: Sweep, stops: Sequence[Stop]) -> str:
    """Table of the stops: quantiles, shares and other outcomes."""
    rows = [[*stops[0].conditions, *stops[0].numbers]]
    others = [name for name in stops[0].draws if name not in (DISTANCE, FAILED)]
    rows[0] += [name.replace("_", " ") for name in others]
    for stop in stops:
        cells = [*stop.conditions.values()]
        for name, number in stop.numbers.items():
            if not isinstance(number, Estimate):
                cells.append(f"{number:.4g}")
            elif name in QUANTILES:
                cells.append(number.text())
            else:
                cells.append(Estimate(*(100.0 * x for x in number)).text(3, " %"))
        rows.append([*cells, *(_mean_and_largest(name, stop.draws[name]) for name in others)])
    reading = READING.format(sweep.plan.draws)
    return f"{sweep.name}\n\n{fixed_width(rows)}\n{reading}"


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
    writer = csv.writer(lines, lineterminator="\n")
    for stop in stops:
        flat = dict[str, object](stop.conditions)
        for name, number in stop.numbers.items():
            ends = number if isinstance(number, Estimate) else [number]
            flat |= dict(zip((name, f"{name} low", f"{name} high"), ends, strict=False))
        if stop is stops[0]:
            writer.writerow(flat)
        writer.writerow(flat.values())
    for suffix, content in (("txt", text), ("csv", lines.getvalue())):
        write_whole(Path(folder) / f"{sweep.stem}.summary.{suffix}", content.encode())
    return text


# ---- the default catalogue -------------------------------------------------------------------

SPEEDS, LEVELS = (0.4, 0.6, 0.8, 1.0), (0.75, 1.0, 1.25, 1.5)  # of the file's numbers
SLIPPERY = (0.05, 0.07, 0.1)  # kinetic friction of rails where the file gives only its own
LOWEST = 0.7  # level of friction at which its distribution is cut
HEAD = """\
# Stops of a catalogue, written for {file}.
# Axes with values make the catalogue; axes with a distribution are drawn, with the same draws at
# each of its stops. The ranges are chosen, not measured: put yours in. Change and add axes, then
# run: contactlib stops {stem}.toml
name = {title}
source = "scenario: {file}; ranges chosen"
scenario = "{file}"
controllers = ["{controller}"]
outcomes = ["stopping_distance", "locked_axles"{air}]
until_stop = true    # a run ends when the vehicle has stopped
# limit = [L1, L2, L3, L4]    # distance for each speed that no stop should exceed, in m

[sampling]
runs = {draws}
seed = 1
"""
VARIATION, FRICTION = "track.variation.", ("vehicle.friction.static", "vehicle.friction.kinetic")
NORMAL = "mean", "standard_deviation", "from", "to"
ERROR = (0.0, 0.003, -0.01, 0.01)
DRAWN = (  # factors: name, label, paths, if the files give their numbers, and distribution
    ("pads", "brake torque", tuple(f"demand.{term}" for term in TERMS), (1.0, 0.05, 0.8, 1.2)),
    ("build_up", "build-up", ("brake.fill_time", "brake.build_up_time"), (1.0, 0.1, 0.7, 1.3)),
    ("load", "load", ("vehicle.body_mass",), (1.0, 0.04, 0.9, 1.1)),
    (
        "diameter",
        "wheel diameter",
        ("vehicle.wheelset.radius", "vehicle.contact.radius_x"),
        (0.97, 0.02, 0.93, 1.0),
    ),
)


def write_stops(
    scenario: str | os.PathLike[str], folder: str | os.PathLike[str], draws: int
) -> Path:
    """Write the default catalogue of a scenario as a sweep file; return its path.

    The scenario and the files that it refers to are copied beside it, but for shipped ones.

    Raises
    ------
    ModelError
        If the scenario is not valid, or cannot stop.
    ValueError
        If one of the files exists with another content.
    OSError
        If a file cannot be read or written.
    """
    file, folder = model_path(scenario), Path(folder)
    with loading(scenario), referred_files() as referred:
        contents = read_contents(file)
        wheelset = contents.build_vehicle(None, lambda part: None)
        text = sweep_text(file, contents, build_scenario(contents.data, wheelset), draws)
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


def sweep_text(file: Path, contents: ScenarioContents, scenario: Scenario, draws: int) -> str:
    """Text of the default catalogue: four speeds, four rails, and draws of what the file has."""
    designs = read_controllers(contents.data["controllers"])
    sampled = [name for name, design in designs.items() if design.kind in CONTROLLERS]
    if min(scenario.demand.value) >= 0.0 or scenario.held_speed is not None or not sampled:
        raise ValueError(
            "a stop needs a demand that brakes, a vehicle that is free to stop, and a sampled "
            "controller"
        )

    def given(*paths: str) -> dict[str, tuple[float, ...]]:
        """Paths with the numbers that the files give there."""
        found = {}
        for path in paths:
            with suppress(ValueError):
                found[path] = find_target(path, contents, None, factor=True).base or ()
        return found

    unit, level = scenario.speed_unit, f"{VARIATION}median"
    top = scenario.initial_speed / in_si(f"1 {unit}", "m/s")
    speeds = [f"{part * top:.4g} {unit}" for part in SPEEDS]
    lists = given(*(f"track.{key}" for key in RAILS[:3]))
    lowest = min((min(numbers) for numbers in lists.values()), default=1.0)
    poorest = [f"{p}[{i}]" for p, x in lists.items() for i in range(len(x)) if x[i] == lowest]
    whole = {} if "condition" in contents.data.get("track", {}) else given(*FRICTION)
    friction = _lowest_friction(scenario)
    own = bool(poorest) or friction < max(SLIPPERY)
    levels = LEVELS if own else (*(mu / friction for mu in SLIPPERY), 1.0)
    values = [float(f"{part * lowest:.3g}") for part in levels]
    time, why = _duration(scenario, min(levels) * friction)
    text = HEAD.format(
        file=file.name,
        stem=f"{file.stem}_stops",
        draws=draws,
        title=json.dumps(f"Stops: {scenario.name}", ensure_ascii=False),
        controller=min(sampled, key=lambda name: designs[name].kind != "wsp"),
        air=', "air_used"' if scenario.drivetrain.brake else "",
    )
    text += _axis("speed", "initial speed", "run.initial_speed", values=speeds)
    if poorest:
        text += _axis("rails", "friction of the poorest rails", poorest, values=values)
    else:
        rails = [*whole] or level
        text += _axis("rails", "friction / that of the file", rails, bool(whole), values=values)
    text += f"{why}{_axis('duration', 'duration', 'run.duration', values=[time])}"
    if poorest or whole:
        label = "friction / that of the rails"
        text += _axis("level", label, level, normal=(1.0, 0.1, LOWEST, 1.3))
    if scenario.variation is None:
        for name, label, key, value in (
            ("variation", "deviation along the line", "standard_deviation", 0.15),
            ("length", "correlation length", "correlation_length", "50 m"),
        ):
            text += _axis(name, label, f"{VARIATION}{key}", values=[value])
    text += _axis("line", "seed of the line", f"{VARIATION}seed", whole=(1, 10**9))
    for name, label, paths, normal in DRAWN:
        if known := [*given(*paths)]:
            text += _axis(name, f"{label} / nominal", known, True, normal=normal)
    error = "sensors.wheel_diameter_error"
    return text + _axis("sensors", "error of the assumed wheel diameter", error, normal=ERROR)


def _axis(
    name: str, label: str, paths: str | list[str], factor: bool = False, **values: Sequence[Any]
) -> str:
    """Section of an axis from one list: its values, or numbers of a distribution."""
    ((kind, numbers),) = values.items()
    keys = {"distribution": kind, **dict(zip(NORMAL[-len(numbers) :], numbers, strict=True))}
    given = {
        "label": label,
        "factor_on" if factor else "parameter": paths,
        **(values if kind == "values" else keys),
    }
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in given.items())
    return f"\n[axes.{name}]\n{lines}"


def _lowest_friction(scenario: Scenario) -> float:
    """Kinetic friction of the poorest rails of a scenario."""
    rails = scenario.rails_at(scenario.initial_speed)
    return rails.lowest[0] * scenario.drivetrain.wheelset.element.friction.kinetic


def _duration(scenario: Scenario, friction: float) -> tuple[float, str]:
    """Duration for the slowest stop on rails of a friction [s], and the reason in words."""
    body, lowest = scenario.drivetrain.wheelset, LOWEST * friction
    force = min(-min(scenario.demand.value) / body.radius, lowest * scenario.static_load)
    moved = scenario.axles * (body.mass or math.inf)
    slowest = force * float(scenario.shares_of_demand[1].sum()) / moved
    begin = scenario.demand.at[int(np.argmin(scenario.demand.value))]
    time = 10.0 * math.ceil(0.1 * (begin + 1.5 * abs(scenario.initial_speed) / slowest + 10.0))
    return time, (
        f"\n# The slowest stop decelerates by {slowest:.2g} m/s2, by the demand or on friction of\n"
        f"# {lowest:.2g} all the way; half as long again, and 10 s, for what else delays it."
    )
