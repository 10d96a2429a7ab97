"""Outcomes of a run: unit, meaning and accumulator of each; and metrics of runs side by side."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import FloatArray
from contactlib.base.text import fixed_width
from contactlib.base.writing import write_whole
from contactlib.runs.accumulators import (
    Accumulator,
    Combined,
    DerivedRows,
    DrivetrainArrays,
    Ends,
    Extremes,
    Falls,
    HeldIntegral,
    Integral,
    Jerk,
    Locked,
    OneRun,
    Recovery,
    Rows,
    Stop,
)
from contactlib.runs.result import Result
from contactlib.runs.signals import WORKS
from contactlib.vehicle.drivetrain import Drivetrain

NO_STOP = "does not stop within the run"
MISJUDGED = "speed_misjudged"
# Largest error of the speed that controllers get / highest speed [1]: at this slip wheel-slide
# protection releases by default, so beyond it a wheel that rolls passes for one that slides.
MAX_SPEED_ERROR = 0.05


@dataclass(frozen=True)
class Outcome:
    """Declaration of one number of a run or of an analysis, for reports and figures.

    Attributes
    ----------
    unit, description : str
        SI unit, and one line of description.
    observe : callable or None
        Makes the accumulator that reduces the rows of a run; None for an outcome of the analysis.
    analyse : callable or None
        Computes the number from a `contactlib.runs.analysis.Analysis`; None if controllers have
        to run for it.
    extends : str
        Outcome that is compared with the same run on uniform friction: its value there is 1, and
        only the excess is given. Empty for others.
    percent : bool
        Whether values are shown in per cent.
    infinite, missing : str
        Meaning of an infinite and of a missing value.
    zero : str
        Meaning of zero, where zero differs in kind from a small value; else empty.
    border : str
        Meaning of the border at which the sign changes.
    yes_or_no : tuple of str
        Meaning of 1 and 0, if these are the only values.
    """

    unit: str
    description: str
    observe: Callable[[DrivetrainArrays], Accumulator] | None = None
    analyse: Callable[[Any], float] | None = None
    extends: str = ""
    percent: bool = False
    infinite: str = "infinite"
    missing: str = "no value"
    zero: str = ""
    border: str = "zero"
    yes_or_no: tuple[str, str] | None = None

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the outcome's variable in a dataset."""
        shown = {"display_units": "%"} if self.percent else {}
        return {"units": self.unit, "long_name": self.description, **shown}


def accumulators(names: Sequence[str], drivetrains: DrivetrainArrays) -> dict[str, Accumulator]:
    """Observers of outcomes of runs, by name.

    Raises
    ------
    ValueError
        If a name is unknown.
    """
    observers = {}
    for name in names:
        row = OUTCOMES.get(name)
        if row is None or row.observe is None:
            raise ValueError(f"outcome = {name!r} must be one of: {', '.join(OUTCOMES)}")
        observers[name] = row.observe(drivetrains)
    return observers


def extended(names: Iterable[str]) -> dict[str, str]:
    """Which of the outcomes are extensions, and what each extends."""
    return {name: OUTCOMES[name].extends for name in names if OUTCOMES[name].extends}


def extension(value: ArrayLike, uniform: ArrayLike) -> FloatArray:
    """Value / that on uniform friction - 1, nan where the latter is zero or infinite."""
    least = np.where(np.isfinite(uniform), uniform, 0.0)
    return np.where(np.isinf(value), np.inf, _share(np.asarray(value), least) - 1.0)


def _signal(name: str) -> Callable[[DerivedRows], FloatArray]:
    return lambda rows: rows[name]


def _share(part: FloatArray, whole: FloatArray) -> FloatArray:
    """Part / whole, nan where the whole is zero."""
    nothing = np.full(whole.shape, np.nan)
    return np.asarray(np.divide(part, whole, out=nothing, where=whole > 0.0))


def _largest(quantity: Callable[[DerivedRows], FloatArray], v: DrivetrainArrays) -> Accumulator:
    return Combined(lambda extremes: v.largest(extremes.value()), Extremes(quantity))


def _in_a_lock(amount: Callable[[DerivedRows], FloatArray], v: DrivetrainArrays) -> Accumulator:
    return Combined(lambda largest: v.largest(largest.value()), Locked(amount))


def _totals(v: DrivetrainArrays) -> Callable[[Accumulator, Accumulator], FloatArray]:
    """Function that gives the share of one accumulator's totals in another's."""
    return lambda part, whole: _share(v.total(part.value()), v.total(whole.value()))


def _sometimes(quantity: Callable[[DerivedRows], FloatArray]) -> Accumulator:
    """Largest value above zero of what is -inf where it does not apply; nan if it never does."""
    return Combined(
        lambda found: np.where(found.value() == -np.inf, np.nan, np.maximum(found.value(), 0.0)),
        Extremes(quantity),
    )


def _overspeed(v: DrivetrainArrays) -> Accumulator:
    return _sometimes(lambda rows: np.abs(v.first(rows["speed"])) - v.first(rows["speed_limit"]))


def _largest_creepage(v: DrivetrainArrays) -> Accumulator:
    def size(rows: DerivedRows) -> FloatArray:
        sizes = np.maximum(np.abs(rows["creepage_left"]), np.abs(rows["creepage_right"]))
        return v.largest(np.where(rows.moves, sizes, -np.inf))

    return _sometimes(size)


def _speed_error(v: DrivetrainArrays) -> Accumulator:
    return Extremes(lambda rows: v.largest(np.abs(rows["measured_speed"] - rows["speed"])))


def _misjudged(v: DrivetrainArrays) -> Accumulator:
    def exceeds(error: Extremes, speed: Extremes) -> FloatArray:
        return np.where(error.value() > MAX_SPEED_ERROR * speed.value(), 1.0, 0.0)

    return Combined(exceeds, _speed_error(v), Extremes(lambda rows: np.abs(v.first(rows["speed"]))))


def _utilisation(drivetrains: DrivetrainArrays) -> Accumulator:
    return Combined(
        _totals(drivetrains),
        Integral(lambda rows: np.minimum(*rows.transmittable), demanded=True),
        Integral(lambda rows: rows.transmittable[1], demanded=True),
    )


def _limited_utilisation(drivetrains: DrivetrainArrays) -> Accumulator:
    return Combined(
        _totals(drivetrains),
        HeldIntegral(lambda rows: np.minimum(*rows.transmittable) * rows.limited),
        HeldIntegral(lambda rows: rows["available_force"] * rows.limited),
    )


def _largest_slip_speed(drivetrains: DrivetrainArrays) -> Accumulator:
    def slip(rows: DerivedRows) -> FloatArray:
        left, right = (
            np.abs(drivetrains.radius * rows[f"omega_{side}"] - rows["speed"])
            for side in ("left", "right")
        )
        return np.maximum(left, right)

    return _largest(slip, drivetrains)


def _slip_share(drivetrains: DrivetrainArrays) -> Accumulator:
    def passed_on(rows: DerivedRows) -> FloatArray:
        """Power that contacts pass on, to the vehicle or to a wheel that is braked [W]."""
        power = np.zeros_like(rows["speed"])
        for side in ("left", "right"):
            force, rim = rows[f"creep_force_{side}"], drivetrains.radius * rows[f"omega_{side}"]
            power += np.maximum(force * rows["speed"], 0.0) + np.maximum(-force * rim, 0.0)
        return power

    def share(work: Ends, rest: Integral) -> FloatArray:
        slip = drivetrains.total(work.change())
        return _share(slip, slip + drivetrains.total(rest.value()))

    return Combined(share, Ends(_signal("creep_work")), Integral(passed_on))


def _torsional_peak(drivetrains: DrivetrainArrays) -> Accumulator:
    return Combined(
        lambda largest: drivetrains.largest(np.where(drivetrains.rigid, np.nan, largest.value())),
        Extremes(lambda rows: np.abs(rows["axle_torque"])),
    )


def _energy_defect(drivetrains: DrivetrainArrays) -> Accumulator:
    def total(name: str) -> Callable[[DerivedRows], FloatArray]:
        return lambda rows: drivetrains.total(rows[name])

    def share(defect: Extremes, *energies: Extremes) -> FloatArray:
        largest = np.max(np.stack([energy.range() for energy in energies]), axis=0)
        return np.nan_to_num(_share(defect.value(), largest))

    energies = (Extremes(total(name)) for name in (*WORKS, "stored_energy"))
    defect = total("energy_defect")
    return Combined(share, Extremes(lambda rows: np.abs(defect(rows))), *energies)


def _change(name: str) -> Callable[[DrivetrainArrays], Accumulator]:
    return lambda v: Combined(lambda ends: v.total(ends.change()), Ends(_signal(name)))


def _mean(integral: Integral | HeldIntegral) -> Accumulator:
    return Combined(
        lambda integral, time: integral.value() / time.change(),
        integral,
        Ends(lambda rows: rows.time[:, np.newaxis]),
    )


def _air_used(v: DrivetrainArrays) -> Accumulator:
    def share(falls: Falls, demand: Extremes) -> FloatArray:
        return _share(v.total(falls.value()), v.total(demand.value()))

    largest = Extremes(lambda rows: rows.brake_demand)
    return Combined(share, Falls(lambda rows: rows.applied), largest)


OUTCOMES: Mapping[str, Outcome] = MappingProxyType(
    {
        "utilisation": Outcome(
            "1",
            "force used / force that could be transmitted, while there is a demand",
            _utilisation,
            percent=True,
            missing="no demand",
        ),
        "limited_utilisation": Outcome(
            "1",
            "force used / available force, while the demand exceeds the available force",
            _limited_utilisation,
            percent=True,
            missing="friction never limits",
        ),
        "largest_creepage": Outcome(
            "1",
            "largest size of a wheel's creepage while the speed is at least the minimum speed",
            _largest_creepage,
            percent=True,
            missing="always slower than the minimum speed",
        ),
        "largest_slip_speed": Outcome(
            "m/s", "largest size of a wheel's slip speed", _largest_slip_speed
        ),
        "recovery_time": Outcome(
            "s",
            "longest time from a lack of force by slip or its control until it is back and stays",
            lambda v: Combined(lambda recovery: v.largest(recovery.value()), Recovery(v)),
            infinite="does not recover",
            zero="force never lacks",
        ),
        "slip_work": Outcome("J", "work that friction turns into heat", _change("creep_work")),
        "slip_share": Outcome(
            "1", "slip work / work that enters the contacts", _slip_share, percent=True
        ),
        "jerk": Outcome(
            "m/s3",
            "largest change of the vehicle's acceleration",
            lambda v: Combined(lambda jerk: v.first(jerk.value()), Jerk(v)),
            missing="speed is held",
        ),
        "torsional_peak": Outcome(
            "N.m",
            "largest size of the axle's torque",
            _torsional_peak,
            missing="rigid axle",
        ),
        "distance": Outcome(
            "m",
            "distance travelled",
            lambda v: Combined(lambda ends: v.first(ends.change()), Ends(_signal("distance"))),
        ),
        "energy_defect": Outcome("1", "largest error of the energy balance", _energy_defect),
        "final_speed": Outcome(
            "m/s", "vehicle speed at the end", lambda v: Ends(lambda rows: v.first(rows["speed"]))
        ),
        "mean_creep_force": Outcome(
            "N",
            "creep force of all wheels, mean over time",
            lambda v: _mean(Integral(lambda rows: v.total(rows["creep_force"]))),
        ),
        "falling_share": Outcome(
            "1",
            "share of the time with a wheel on the falling branch",
            lambda v: _mean(HeldIntegral(lambda rows: v.largest(rows["falling_branch"]))),
            percent=True,
        ),
        "drive_work": Outcome("J", "work of the drive", _change("drive_work")),
        "stopping_distance": Outcome(
            "m",
            "distance from the first demand of braking to standstill",
            Stop,
            infinite=NO_STOP,
            missing="nothing brakes",
        ),
        "stopping_extension": Outcome(
            "1",
            "stopping distance / that of the same run on the friction of the wheelset's file - 1",
            Stop,
            extends="stopping_distance",
            percent=True,
            infinite=NO_STOP,
            missing="no stop to compare",
        ),
        "speed_error": Outcome(
            "m/s",
            "largest error of the vehicle speed that the controllers get",
            _speed_error,
        ),
        MISJUDGED: Outcome(
            "1",
            f"whether that error exceeds {MAX_SPEED_ERROR:.0%} of the vehicle's highest speed",
            _misjudged,
            yes_or_no=(f"speed estimate off by > {100.0 * MAX_SPEED_ERROR:g} %", "within that"),
        ),
        "overspeed": Outcome(
            "m/s",
            "largest excess of the vehicle's speed over the limit of the track",
            _overspeed,
            missing="no limit",
            zero="the limit is kept",
        ),
        "locked_time": Outcome(
            "s",
            "longest time for which a wheel is locked above 5 km/h",
            lambda v: _in_a_lock(lambda rows: rows.time[:, np.newaxis], v),
            zero="no wheel is locked",
        ),
        "locked_work": Outcome(
            "J",
            "largest slip work of an axle from locking above 5 km/h to turning again",
            lambda v: _in_a_lock(_signal("creep_work"), v),
            zero="no wheel is locked",
        ),
        "sand_used": Outcome(
            "kg",
            "sand laid by all axles",
            lambda v: Combined(
                lambda sand: v.total(sand.value()), HeldIntegral(_signal("sand_rate"))
            ),
            zero="no sand, or of an unknown rate",
        ),
        "locked_axles": Outcome(
            "1",
            "share of the axles with a wheel that is locked above 5 km/h",
            lambda v: Combined(
                lambda largest: v.total(np.where(largest.value() > 0.0, 1.0, 0.0)) / v.axles,
                Locked(lambda rows: rows.time[:, np.newaxis]),
            ),
            percent=True,
            zero="no wheel is locked",
        ),
        "air_used": Outcome(
            "1",
            "air vented from the brake cylinders / air of one full application",
            _air_used,
            missing="no demand of a brake",
        ),
    }
)


class Metrics(NamedTuple):
    """Numbers of one run, in the units of `OUTCOMES`; nan where one does not apply.

    Works and forces are sums over the axles of a vehicle; creepage, slip speed, recovery time,
    torsional peak, locked time and locked work are those of the axle with the largest.

    s Q is the creep force in the demand's direction, Q_t the force that could be transmitted: the
    smaller of the available force and the demanded force.

    Attributes
    ----------
    utilisation : float
        int min(s Q, Q_t) dt / int Q_t dt over the time in which the demand is not zero [1]. Force
        beyond Q_t, from a wheel that spins down, does not compensate for force that was lost.
    limited_utilisation : float
        The same over the time in which the demand exceeds the available force Q_a, so that Q_t =
        Q_a: int min(s Q, Q_a) dt / int Q_a dt; nan if friction never limits [1].
    largest_creepage : float
        Largest |zeta| of a wheel while |V| is at least the minimum speed [1]; nan if it never is.
    largest_slip_speed : float
        Largest |r omega - V| of a wheel [m/s].
    recovery_time : float
        Longest recovery of the run [s]; zero if force never lacks. It begins when s Q falls short
        of Q_t by more than a fifth of Q_t and a hundredth of the grip f_d P while a wheel is on the
        falling branch, or slip control commands less than four fifths of the demand of the last
        tenth of a second; so the time in which a brake fills at the start does not count. It ends
        at the first time at which the shortfall is within this limit and so is its mean over the
        next second; late in a run, over the last second. So a short dip of a limit cycle counts by
        itself. Infinite if the mean over the last second is beyond the limit.
    slip_work : float
        int Q (r omega - V) dt, the heat from friction [J]. If a wheel slips away it may exceed the
        work of any real drive, unless `Motor` has limits: only these limit the rim speed.
    slip_share : float
        Slip work / work that enters the contacts, from the drive or from a vehicle that brakes: 0
        without slip, 1 for a locked wheel or one that spins beside a vehicle that stands; nan if
        none enters [1].
    jerk : float
        Largest |V(t) - 2 V(t + W) + V(t + 2 W)|/W**2: change of the acceleration from one window
        W of 0.1 s to the next [m/s3]; nan if the speed is held.
    torsional_peak : float
        Largest |axle torque| [N.m]; nan if the axle is rigid.
    distance : float
        Distance travelled, negative backward [m].
    energy_defect : float
        Largest error of the energy balance / largest of all works and changes of the stored
        energy [1].
    stopping_distance : float
        Distance from the first demand against the motion until the speed is below 0.1 m/s [m];
        infinite if the vehicle does not stop, nan if nothing brakes.
    stopping_extension : float
        Stopping distance / that of the run on uniform friction - 1 [1]; infinite if the vehicle
        does not stop, nan without either.
    speed_error : float
        Largest error of the vehicle speed that the controllers get [m/s].
    locked_time : float
        Longest time for which a wheel's rim is slower than a twentieth of the vehicle's speed while
        that exceeds 5 km/h [s].
    locked_work : float
        Largest slip work of an axle in such a time, which makes flats [J].
    air_used : float
        Sum of all falls of the axles' brake torques / sum of their largest demands [1]: the air
        vented from the brake cylinders, in full applications. nan without a demand of a brake.
    """

    utilisation: float
    limited_utilisation: float
    largest_creepage: float
    largest_slip_speed: float
    recovery_time: float
    slip_work: float
    slip_share: float
    jerk: float
    torsional_peak: float
    distance: float
    energy_defect: float
    stopping_distance: float
    stopping_extension: float
    speed_error: float
    locked_time: float
    locked_work: float
    air_used: float


def metrics(result: Result, drivetrain: Drivetrain, *, uniform: Result | None = None) -> Metrics:
    """Metrics of a run of a scenario.

    Parameters
    ----------
    result : Result
        Result of `run_scenario`, or of one of its axles.
    drivetrain : Drivetrain
        The scenario's drivetrain, which is that of each axle.
    uniform : Result, optional
        Run of `scenario.on_uniform_friction`, with which a stop is compared.
    """
    drivetrains = DrivetrainArrays.of([drivetrain] * result.axles, result.axles)
    found = _numbers(OneRun(result), Metrics._fields, drivetrains)
    for name, of in extended(found).items():
        least = _numbers(OneRun(uniform), [of], drivetrains)[of] if uniform else math.nan
        found[name] = float(extension(found[name], least))
    return Metrics(**found)


def _numbers(rows: Rows, names: Sequence[str], drivetrains: DrivetrainArrays) -> dict[str, float]:
    """Outcomes of one run by name."""
    observers, derived = accumulators(names, drivetrains), DerivedRows(rows, drivetrains)
    for accumulator in observers.values():
        accumulator.add(derived)
    return {name: float(accumulator.value()[0]) for name, accumulator in observers.items()}


def comparison_table(metrics: Mapping[str, Metrics], *, within: str = "the run") -> str:
    """Format metrics as text: a line for each metric that applies, a column for each run.

    A further line says why a run has no value, or what "never" means: no stop `within` the run.

    Examples
    --------
    >>> none = float("nan")
    >>> run = Metrics(
    ...     0.93, 0.9, 0.02, 0.2, 0.1, 3e4, 0.013, 1.5, none, 120.0, 1e-9, 90.0, 0.2, 0.1, 0.0, 0.0,
    ...     1.1)
    >>> print(comparison_table({"pi": run, "open_loop": run._replace(recovery_time=float("inf"))}))
    metric               unit     pi  open_loop
    utilisation          1      0.93       0.93
    limited utilisation  1       0.9        0.9
    largest creepage     1      0.02       0.02
    largest slip speed   m/s     0.2        0.2
    recovery time        s       0.1      never
    slip work            J     30000      30000
    slip share           1     0.013      0.013
    jerk                 m/s3    1.5        1.5
    distance             m       120        120
    energy defect        1     1e-09      1e-09
    stopping distance    m        90         90
    stopping extension   1       0.2        0.2
    speed error          m/s     0.1        0.1
    locked time          s         0          0
    locked work          J         0          0
    air used             1       1.1        1.1
    - recovery time: does not recover
    """
    rows, why = [["metric", "unit", *metrics]], ""
    for name, *values in zip(Metrics._fields, *metrics.values(), strict=True):
        title, outcome, shown = name.replace("_", " "), OUTCOMES[name], [*map(_shown, values)]
        if {*shown} == {"-"}:
            continue
        rows.append([title, outcome.unit, *shown])
        for sign, meaning in (("-", outcome.missing), ("never", outcome.infinite)):
            why += f"\n- {title}: {meaning}" if sign in shown else ""
    return fixed_width(rows) + why.replace("the run", within)


def write_comparison(
    folder: str | os.PathLike[str],
    metrics: Mapping[str, Metrics],
    *,
    stem: str = "metrics",
    of: str = "controller",
) -> tuple[Path, Path, Path]:
    """Write metrics.txt, metrics.csv and metrics.json to a folder; return their paths.

    The CSV file has a line for each run, with numbers to full precision, "nan" and "inf". In JSON,
    which has neither, a metric that does not apply is null, and an infinite one is "never".

    Parameters
    ----------
    folder : path
        The folder.
    metrics : mapping
        Metrics of each run by name.
    stem : str, optional
        Name of the files, without suffix.
    of : str, optional
        What the names are: the first column of the CSV file.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    units = {name: OUTCOMES[name].unit for name in Metrics._fields}
    writer.writerow([of, *(f"{name} [{unit}]" for name, unit in units.items())])
    writer.writerows([name, *map(repr, run)] for name, run in metrics.items())
    parts = {
        name: {key: {"value": _json(value), "unit": units[key]} for key, value in values.items()}
        for name, values in ((name, run._asdict()) for name, run in metrics.items())
    }
    contents = {
        "txt": comparison_table(metrics) + "\n",
        "csv": lines.getvalue(),
        "json": json.dumps(parts, indent=2, allow_nan=False) + "\n",
    }
    as_text, as_csv, as_json = (
        write_whole(Path(folder) / f"{stem}.{suffix}", content.encode())
        for suffix, content in contents.items()
    )
    return as_text, as_csv, as_json


def _shown(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "never" if math.isinf(value) else f"{value:.5g}"


def _json(value: float) -> float | str | None:
    if math.isnan(value):
        return None
    return "never" if math.isinf(value) else value
