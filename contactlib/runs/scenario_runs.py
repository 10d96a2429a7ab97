"""Runs of scenarios: one with all of its rows, or the outcomes of many."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlib.base.quantities import (
    FINITE,
    POSITIVE,
    FloatArray,
    as_number,
    checked,
    checked_number,
    checked_whole,
    shown,
    warn,
)
from contactlib.base.text import USERS_ERRORS, explained
from contactlib.files.scenario import Scenario
from contactlib.runs.accumulators import DerivedRows, DrivetrainArrays, Stop
from contactlib.runs.damage import warn_of_damage
from contactlib.runs.outcomes import OUTCOMES, accumulators, extended, extension
from contactlib.runs.plant import (
    TOLERANCE,
    Runs,
    Timing,
    checked_creepage,
    default_step,
    follows,
    timing,
)
from contactlib.runs.result import Result
from contactlib.runs.signals import SHARED, UNITS, Block, checked_signals
from contactlib.runs.simulation import simulate
from contactlib.traction import stacked, structure
from contactlib.traction.interface import Controller, checked_controller
from contactlib.traction.sensors import INDEX, checked_indices
from contactlib.vehicle.available_force import available_force
from contactlib.vehicle.continuous_control import ContinuousController

DEFAULT_TOLERANCE = 1e-4
LONGEST_STEP = 10e-3  # default limit of the time between rows of many runs [s]
FLEET = 2048  # runs side by side: their states and memories fit into a core's cache
KEPT = 500_000  # rows of runs side by side that are kept for metrics, of 0.2 kB each
FAILED = "failed"
Metric = Callable[[Any], float]  # of a Result


class Kept:
    """Keeps all signals of all rows of runs of vehicles with so many axles."""

    def __init__(self, when: Timing, units: Mapping[str, str], axles: int) -> None:
        self._when, self._done, self._units, self._axles = when, 0, units, axles
        self._parts: dict[str, list[FloatArray]] = {name: [] for name in units}

    def add(self, block: Block) -> float:
        """Add the next rows; return the fraction of all rows that there are."""
        for name, parts in self._parts.items():
            parts.append(np.array(block[name]))
        self._done += block.time.size
        return self._done / self._when.rows

    def results(self, last: Sequence[int]) -> Iterator[Result]:
        """Result of each run, to its last row if that is not the end (-1)."""
        whole = {}
        for name, parts in self._parts.items():
            rows = np.concatenate(parts)
            if name in SHARED or self._axles == 1:
                whole[name] = rows[:, :: self._axles].T.copy()
            else:
                by_axle = rows.reshape(len(rows), -1, self._axles)
                whole[name] = by_axle.swapaxes(0, 1).copy()
        for i in range(len(whole["speed"])):
            count = self._done if last[i] < 0 else last[i] + 1
            signals = {name: values[i][:count] for name, values in whole.items()}
            yield Result(self._when.times(0, count), signals, self._units)


def run_scenario(
    scenario: Scenario,
    controller: str | Controller | ContinuousController,
    *,
    initial_creepage: float | None = None,
    index: int = 0,
    step: float | None = None,
    signals: Collection[str] = (),
    tolerance: float | None = None,
    until_stop: bool = False,
    progress: Callable[[float], object] = lambda part: None,
) -> Result:
    """Run a scenario under one controller, which each axle of a vehicle has a copy of.

    Parameters
    ----------
    scenario : Scenario
        Wheelset or vehicle, track, demand and sensors.
    controller : str, SampledController, TractionController, TorqueControl or CreepControl
        Name of one of the scenario's controllers, or an object of your own; the run works on a copy
        of it. The last two are continuous: `simulate` runs them and determines the rows.
    initial_creepage : float, optional
        Creepage at the start [1]. Default: steady under the first torque, which is the demand or
        zero, as the scenario's `start` says; zero at standstill.
    index : int, optional
        Index of the run among many; the sensors' noise is drawn from their seed and this index.
    step : float, optional
        Time between rows, over which torques and dynamic loads are held [s]; rounded down to a
        whole fraction of the sample time. Default: 5 ms, or less: a twentieth of the period of a
        vibration of axle or shaft, a tenth of the shortest period of the dynamic load. For a
        continuous controller: the output interval of `simulate`.
    signals : collection of str, optional
        More signals of the result, such as ``["k_hat", "contact_temperature_left"]``: those of
        `contactlib.runs.signals.of_contacts`, of both wheels or of one. Any other run computes none
        of them.
    tolerance : float, optional
        Relative error of each of the integrator's substeps [1]. Default: 1e-7, for vehicles of
        several axles 1e-5; under a continuous controller 1e-9, as for `simulate`.
    until_stop : bool, optional
        Whether the run ends in the row in which the vehicle has stopped: it has braked and is
        slower than 0.1 m/s. A continuous controller has no such end.
    progress : callable, optional
        Called with the fraction of the duration that is done, from 0 to 1.

    Returns
    -------
    Result
        Signals of `contactlib.runs.signals.UNITS`, to the last whole step of the duration.
        Rows are `step` apart; torques are those of the following step. A continuous controller
        also gives the signals and events of `simulate`, in its rows.

    Raises
    ------
    ValueError
        If a value is out of range, the scenario has no controller of this name, the delay is not a
        whole number of samples, no steady state holds the first demand, or the controller's torque
        is not what it must be.
    RuntimeError
        If the integrator gives up, or the controller raises an error.

    Warns
    -----
    InputWarning
        If the run's rim speed, slip work or creepage would destroy a vehicle, or it leaves the map
        of its track or never meets it, or its load makes a line contact with memory shorter than
        four semi-widths.

    Notes
    -----
    The integrator's own substeps follow loads, rails and wheels within a row; torques alone are
    held over it. With the default tolerance, rows of 5 ms differ from rows of 0.25 ms by 1e-4 of
    friction at most and by 6e-7 in the mean (shipped vehicles), on rails that the axles clean by
    3e-4 and 2e-6 (`four_axles.toml`), and the energy closes to 1e-9 of the work. The rails keep
    the slip work at nodes 0.1 m apart: nodes 0.01 m apart change that vehicle's creep forces by
    0.022 of friction at most, where an axle slips away, and by 5e-5 in the mean.
    """
    _check_scenario(scenario)
    given = scenario.any_controller(controller) if isinstance(controller, str) else controller
    if isinstance(given, ContinuousController):
        fine = 1e-9 if tolerance is None else tolerance
        return _continuous_run(scenario, given, initial_creepage, step, signals, fine, progress)
    control = _chosen(scenario, controller)
    if tolerance is None:
        tolerance = 1e-7 if scenario.axles == 1 else 1e-5
    tolerance = checked_number("tolerance", tolerance, TOLERANCE)
    index = checked_whole("index", index, INDEX)
    initial_creepage = checked_creepage([scenario], initial_creepage)
    more = checked_signals(signals, [scenario.drivetrain.wheelset.element])
    when = timing(scenario, control.sample_time, step)
    whole = stacked([control] * scenario.axles)
    runs = Runs(
        [scenario], whole, when, index=[index], tolerance=tolerance, creepage=initial_creepage
    )
    for place, error in runs.refused.items():
        raise error if scenario.axles == 1 else ValueError(f"axle {place + 1}: {error}")
    kept = Kept(when, {**runs.units, **more}, scenario.axles)
    drivetrains = DrivetrainArrays.of(runs.trains, runs.axles)
    stop = Stop(drivetrains)
    for block in runs.blocks():
        if runs.failed[0]:
            name = f"torque of {type(control).__name__} before {block.time[-1]:.6g} s"
            checked(name, block["commanded_torque"], FINITE)
            raise RuntimeError(f"the integrator gave up before {block.time[-1]:.6g} s")
        progress(kept.add(block))
        if until_stop:
            stop.add(DerivedRows(block, drivetrains))
            if stop.last[0] >= 0:
                break
    result = next(kept.results(stop.last.tolist()))
    for axle in result.by_axle:
        warn_of_damage(axle)
    distance, load = result["distance"], float(result["axle_load"].max())
    for warning in (
        scenario.rails.warning(float(distance.min()), float(distance.max())),
        scenario.drivetrain.wheelset.element.warning(load),
        *(runs.creeping if stop.last[0] < 0 else ()),
    ):
        if warning:
            warn(warning)
    return result


def _continuous_run(
    scenario: Scenario,
    controller: ContinuousController,
    creepage: float | None,
    step: float | None,
    signals: Collection[str],
    tolerance: float,
    progress: Callable[[float], object],
) -> Result:
    """Run a scenario under a continuous controller, with the signals of other runs and more."""
    scenario.check_continuous("controller")
    wheelset = scenario.drivetrain.wheelset
    result = simulate(
        wheelset,
        controller,
        initial_speed=scenario.initial_speed,
        duration=scenario.duration,
        initial_creepage=creepage,
        output_interval=step,
        signals=signals,
        tolerance=tolerance,
        progress=progress,
    )
    conditions = {name: result[name] for name in ("speed", "axle_load", "friction_scale")}
    known = {
        **result.signals,
        "available_force": available_force(wheelset.element, **conditions),
        "brake_torque": np.zeros_like(result.time),
        "measured_speed": result["speed"].copy(),  # it uses the true state
    }
    units = {**UNITS, **result.units}
    return Result(result.time, {name: known[name] for name in units}, units, result.events)


def _check_scenario(scenario: object) -> None:
    if not isinstance(scenario, Scenario):
        raise ValueError(
            f"scenario: expected a Scenario, got {shown(scenario)}; contactlib.load_scenario reads "
            "one from a file"
        )


def _chosen(scenario: Scenario, controller: object) -> Controller:
    """Return the scenario's controller of a name, or the given one."""
    _check_scenario(scenario)
    if isinstance(controller, str):
        return scenario.controller(controller)
    return checked_controller("controller", controller)


def run_many(
    scenarios: Sequence[Scenario],
    controller: str | Controller,
    outcomes: Sequence[str] = (),
    *,
    metrics: Mapping[str, Metric] | None = None,
    signals: Collection[str] = (),
    index: Sequence[int] | None = None,
    step: float | Sequence[float] | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    until_stop: bool = False,
    progress: Callable[[float], object] = lambda part: None,
) -> dict[str, FloatArray]:
    """Run many scenarios, each under its controller of the given name or a copy of the given one.

    Scenarios may differ in every parameter. The result of a run does not depend on the other runs,
    to the last bit. Runs with equal sample time, step, duration, sensor delay, table of the law,
    states of the drivetrain and kind of controller are integrated side by side, which is fast if
    there are many of them.

    Parameters
    ----------
    scenarios : sequence of Scenario
        n scenarios; shared parts, such as a drivetrain, are processed once.
    controller : str, SampledController or TractionController
        Name of a controller that every scenario has, or an object of your own.
    outcomes : sequence of str, optional
        Names of `contactlib.runs.outcomes.OUTCOMES`; only the signals they need are computed.
    metrics : mapping, optional
        Outcomes of your own by name: functions of a `Result` that return one number. They need all
        signals of a run, which takes longer.
    signals : collection of str, optional
        More signals of the results that the metrics get, as for `run_scenario`.
    index : sequence of int, optional
        Indices of the runs; the noise of a run is drawn from its seed and index. Default: 0 to
        n - 1.
    step : float or sequence of float, optional
        Longest time between rows [s], of all runs or of each; rounded down to a whole fraction of
        the sample time. Default: 10 ms, or less: a twentieth of the axle's vibration period, a
        tenth of the shortest period of the dynamic load. A metric that depends on it can only be
        compared between controllers of different sample times if they get a step that is a fraction
        of both.
    tolerance : float, optional
        Relative error of each of the integrator's substeps [1]. With the default, a run on a wet
        patch under creep control is accurate to 1e-5 at 10 m/s and to 1e-3 at 1 m/s.
    until_stop : bool, optional
        Whether each run ends when its vehicle has stopped, as for `run_scenario`: outcomes and
        metrics are those of the rows until then.
    progress : callable, optional
        Called with the fraction of the work that is done, from 0 to 1.

    Returns
    -------
    dict
        Outcomes and metrics by name, shape (n,), nan for failed runs; and ``"failed"``, one for
        runs for which no steady state holds the first demand, the integrator gave up, or numbers
        overflowed.

    Raises
    ------
    ValueError
        If an outcome is unknown, a value is out of range, a scenario has no such controller, the
        numbers of indices and scenarios differ, or a controller or metric returns what it must not.
    RuntimeError
        If a controller or metric of your own raises an error.

    Warns
    -----
    InputWarning
        If runs leave the map of their track or never meet it.

    Examples
    --------
    >>> import dataclasses
    >>> import contactlib as cl
    >>> case = dataclasses.replace(cl.load_scenario("dry_wet_dry.toml"), duration=8.0)
    >>> weak = dataclasses.replace(case, demand=cl.Profile.of(10e3))
    >>> found = cl.run_many([case, weak], "creep_pi", ["utilisation", "final_speed"])
    >>> found["utilisation"].round(2), found["failed"]
    (array([0.91, 1.  ]), array([0., 0.]))
    """
    tolerance = checked_number("tolerance", tolerance, TOLERANCE)
    accumulators(outcomes, DrivetrainArrays.of([]))
    metrics = checked_metrics(metrics, (*OUTCOMES, FAILED))
    if isinstance(scenarios, Scenario):
        raise ValueError("scenarios must be a list, such as [scenario]")
    index = range(len(scenarios)) if index is None else checked_indices(index)
    steps: list[float | None]
    if isinstance(step, (list, tuple)):
        steps = [checked_number("step", number, POSITIVE) for number in step]
    else:
        longest = None if step is None else checked_number("step", step, POSITIVE)
        steps = [longest] * len(scenarios)
    for name, given in (("index", index), ("step", steps)):
        if len(given) != len(scenarios):
            raise ValueError(
                f"{name} = {list(given)!r} must have {len(scenarios)} entries, a scenario each"
            )
    columns = {name: np.full(len(scenarios), np.nan) for name in (*outcomes, *metrics)}
    columns[FAILED] = np.zeros(len(scenarios))
    controls = [_chosen(scenario, controller) for scenario in scenarios]
    more = checked_signals(signals, [case.drivetrain.wheelset.element for case in scenarios])
    groups = list(_groups(scenarios, controls, steps, KEPT if metrics else None))
    work = sum(when.rows * sum(scenarios[i].axles for i in places) for when, places in groups)
    done, extensions = 0, extended(outcomes)
    work *= 2 if extensions else 1  # the runs on uniform friction take as long
    noted: list[str] = []

    def report(rows: int) -> None:
        nonlocal done
        done += rows
        progress(done / work)

    for when, places in groups:
        axles = scenarios[places[0]].axles
        runs = Runs(
            [scenarios[i] for i in places],
            stacked([controls[i] for i in places for _ in range(axles)]),
            when,
            index=[index[i] for i in places],
            tolerance=tolerance,
        )
        kept = Kept(when, {**runs.units, **more}, axles) if metrics else None
        found, last = _watch(runs, outcomes, kept, report, noted, until_stop=until_stop)
        failed = runs.failed & (last < 0)
        for name, values in found.items():
            columns[name][places] = np.where(failed, np.nan, values)
        columns[FAILED][places] = failed
        for i, result in enumerate(kept.results(last.tolist()) if kept else ()):
            for name, metric in metrics.items() if not failed[i] else ():
                columns[name][places[i]] = _measured(name, metric, result)
        del runs, kept  # free the memory before the next group
    if extensions:
        uniform = run_many(
            [scenario.on_uniform_friction for scenario in scenarios],
            controller,
            list(extensions.values()),
            index=index,
            step=step,
            tolerance=tolerance,
            until_stop=until_stop,
            progress=lambda part: progress(0.5 + 0.5 * part),
        )
        for name, of in extensions.items():
            columns[name] = extension(columns[name], uniform[of])
    if noted:
        others = f" (and so {len(noted) - 1} other runs)" if len(noted) > 1 else ""
        warn(f"{noted[0]}{others}")
    return columns


def checked_metrics(
    metrics: Mapping[str, Metric] | None, taken: Collection[str]
) -> Mapping[str, Metric]:
    """Return metrics of a user, or raise a ValueError if a name is taken or cannot be one."""
    if not isinstance(metrics or {}, Mapping):
        raise ValueError("metrics must be functions by name, such as {'comfort': function}")
    for name, metric in (metrics or {}).items():
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", name) or name in taken:
            raise ValueError(
                f"metrics: {name!r} is not a name for a metric: it must have 1 to 64 ASCII "
                "letters, digits or _, begin with a letter, and not name an outcome or axis"
            )
        if not callable(metric):
            raise ValueError(
                f"metrics: {name} = {shown(metric)} must be a function of a contactlib.Result"
            )
    return metrics or {}


def _measured(name: str, metric: Metric, result: Result) -> float:
    try:
        answer: object = metric(result)
    except USERS_ERRORS as error:
        raise explained(f"metric {name}", error) from error
    number = as_number(answer, "biuf")
    if number is None:
        hint = "; a return is missing" if answer is None else ""
        raise ValueError(
            f"metric {name} returned {shown(answer)}: it must return one number, nan if there is "
            f"none{hint}"
        )
    return number


def _watch(
    runs: Runs,
    outcomes: Sequence[str],
    kept: Kept | None,
    report: Callable[[int], object],
    noted: list[str],
    *,
    until_stop: bool,
) -> tuple[dict[str, FloatArray], NDArray[np.intp]]:
    """Run to the end and return the outcomes, and the last row of each run if that is not the end.

    Adds warnings of its end.
    """
    drivetrains = DrivetrainArrays.of(runs.trains, runs.axles)
    watching, stop = accumulators(outcomes, drivetrains), Stop(drivetrains)
    at_stop = {name: np.full(stop.last.size, np.nan) for name in outcomes}
    low = high = largest = np.zeros(len(runs.trains))
    with np.errstate(all="ignore"):  # failed runs become nan anyway
        for block in runs.blocks():
            first, count, ends = stop.rows, block.time.size, {block.time.size}
            if until_stop:
                stop.add(DerivedRows(block, drivetrains))
                ends |= {row + 1 - first for row in stop.last.tolist() if row >= first}
            for start, end in pairwise(sorted({0, *ends})):
                rows = DerivedRows(block, drivetrains, slice(start, end))
                for accumulator in watching.values():
                    accumulator.add(rows)
                if (over := stop.last == first + end - 1).any():
                    for name, accumulator in watching.items():
                        at_stop[name][over] = accumulator.value()[over]
            distance = block["distance"]
            low = np.minimum(low, distance.min(axis=0))
            high = np.maximum(high, distance.max(axis=0))
            largest = np.maximum(largest, block["axle_load"].max(axis=0))
            if kept is not None:
                kept.add(block)
            report(count * len(runs.trains))
            runs.end(over := stop.last >= 0)
            if over.all():
                break
    ends_of = zip(runs.tracks, low.tolist(), high.tolist(), strict=True)
    of_maps = [track.warning(*place) for track, *place in ends_of]
    loaded = zip(runs.trains, largest.tolist(), strict=True)
    of_loads = [train.wheelset.element.warning(load) for train, load in loaded]
    failed = np.tile(np.repeat(runs.failed & (stop.last < 0), runs.axles), 2)
    noted += [
        text for text, fails in zip(of_maps + of_loads, failed, strict=True) if text and not fails
    ]
    noted += runs.creeping
    found = {
        name: np.where(stop.last < 0, accumulator.value(), at_stop[name])
        for name, accumulator in watching.items()
    }
    return found, stop.last


def _groups(
    scenarios: Sequence[Scenario],
    controls: Sequence[Controller],
    steps: Sequence[float | None],
    rows: int | None,
) -> Iterator[tuple[Timing, list[int]]]:
    """Yield timing and positions of runs that can go side by side.

    At most `FLEET` do, and no more than have this number of rows.
    """
    groups: dict[tuple[float, Timing, int, Hashable], list[int]] = {}
    kinds = {id(control): structure(control) for control in controls}
    delays: dict[Hashable, int] = {}
    whens: dict[Hashable, Timing] = {}
    for i, (scenario, control, step) in enumerate(zip(scenarios, controls, steps, strict=True)):
        step = default_step(scenario, LONGEST_STEP) if step is None else step
        timed = control.sample_time, scenario.duration, step
        if timed not in whens:
            whens[timed] = timing(scenario, control.sample_time, step)
        late = control.sample_time, scenario.sensors.delay
        if late not in delays:
            delays[late] = scenario.sensors.samples_of_delay(control.sample_time)
        falls = scenario.drivetrain.wheelset.element.friction.falls_with_slip_speed
        loads = scenario.loads_change, scenario.axles, follows(scenario)
        kind = scenario.drivetrain.kind, falls, loads, kinds[id(control)]
        key = control.sample_time, whens[timed], delays[late], kind
        groups.setdefault(key, []).append(i)
    for (_, when, *_), places in groups.items():
        side_by_side = FLEET if rows is None else min(FLEET, rows // when.rows)
        limit = max(1, side_by_side // scenarios[places[0]].axles)
        for start in range(0, len(places), limit):
            yield when, places[start : start + limit]
