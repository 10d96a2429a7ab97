"""Runs of many scenarios, of which no more than a few numbers each is kept."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence

import numpy as np

from contactlib.fleet import Runs, Timing, timing
from contactlib.outcomes import Seen, Vehicles, observers
from contactlib.parameters import FloatArray, checked_number
from contactlib.scenario import Scenario
from contactlib.traction import TractionController, stacked, structure
from contactlib.traction.sensors import checked_indices
from contactlib.traction_run import TOLERANCE

FLEET = 2048  # runs at once: their states and memories stay in a core's own cache
FAILED = "failed"
LONGEST_STEP = 10e-3  # of rows if nothing else is asked for [s]
DEFAULT_TOLERANCE = 1e-4


def run_many(
    scenarios: Sequence[Scenario],
    controller: str,
    outcomes: Sequence[str],
    *,
    index: Sequence[int] | None = None,
    step: float | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[float], object] = lambda part: None,
) -> dict[str, FloatArray]:
    """Drive many scenarios, each under its controller of one name.

    Scenarios may differ in everything. A run comes out the same to the last bit whichever others
    there are. Runs alike in sample time, step, duration, sensors' delay, table of the law, states
    of the drivetrain and kind of controller go side by side: many of them are fast, few are not.

    Parameters
    ----------
    scenarios : sequence of Scenario
        n of them; what they share, such as a drivetrain, is worked out once.
    controller : str
        Name of one of the controllers of each.
    outcomes : sequence of str
        Some of `contactlib.outcomes.OUTCOMES`. Only what they need is worked out.
    index : sequence of int, optional
        The sensors' noise of a run is drawn from its seed and index; 0 to n - 1 if left out.
    step : float, optional
        Longest time between rows [s]; the sample time, but at most 10 ms and a twentieth of the
        axle's vibration, if left out.
    tolerance : float, optional
        Relative error of each of the integrator's substeps [1]. With what stands here a run on a
        wet patch under creep control is right to 1e-5 at 10 m/s and to 1e-3 at 1 m/s.
    progress : callable, optional
        Is told the part of the work that is done, from 0 to 1.

    Returns
    -------
    dict
        Outcomes by name, shape (n,), nan for runs that failed; and ``"failed"``, one for those: no
        steady state has the first demand, the integrator gave up, or numbers overflowed.

    Raises
    ------
    ValueError
        If an outcome is not known, a value is out of range, a scenario has no such controller, or
        there are not as many indices as scenarios.

    Examples
    --------
    >>> import dataclasses
    >>> import contactlib as cl
    >>> case = dataclasses.replace(cl.load_scenario("dry_wet_dry.toml"), duration=8.0)
    >>> weak = dataclasses.replace(case, demand=cl.Profile.of(10e3))
    >>> found = cl.run_many([case, weak], "creep_pi", ["adhesion_utilisation", "final_speed"])
    >>> found["adhesion_utilisation"].round(2), found["failed"]
    (array([0.98, 1.  ]), array([0., 0.]))
    """
    tolerance = checked_number("tolerance", tolerance, TOLERANCE)
    observers(outcomes, Vehicles.of([]))
    index = range(len(scenarios)) if index is None else checked_indices(index)
    if len(index) != len(scenarios):
        raise ValueError(f"index has {len(index)} entries for {len(scenarios)} scenarios")
    found = {name: np.full(len(scenarios), np.nan) for name in outcomes}
    found[FAILED] = np.zeros(len(scenarios))
    controls = [one.controller(controller) for one in scenarios]
    groups = list(_groups(scenarios, controls, step))
    work = sum(when.rows * len(places) for when, places in groups)
    done = 0

    def told(rows: int) -> None:
        nonlocal done
        done += rows
        progress(done / work)

    for when, places in groups:
        runs = Runs(
            [scenarios[i] for i in places],
            stacked([controls[i] for i in places]),
            when,
            index=[index[i] for i in places],
            tolerance=tolerance,
        )
        for name, values in _watch(runs, outcomes, told).items():
            found[name][places] = np.where(runs.failed, np.nan, values)
        found[FAILED][places] = runs.failed
        del runs  # before the next ones are set up beside them
    return found


def _watch(
    runs: Runs, outcomes: Sequence[str], told: Callable[[int], object]
) -> dict[str, FloatArray]:
    """Outcomes of runs, which are driven for them."""
    vehicles = Vehicles.of(runs.trains)
    watching = observers(outcomes, vehicles)
    with np.errstate(all="ignore"):  # of runs that fail, which are nan anyway
        for block in runs.blocks():
            rows = Seen(block, vehicles)
            for observer in watching.values():
                observer.see(rows)
            told(block.time.size * len(runs.trains))
    return {name: observer.value() for name, observer in watching.items()}


def _groups(
    scenarios: Sequence[Scenario], controls: Sequence[TractionController], step: float | None
) -> Iterator[tuple[Timing, list[int]]]:
    """Timing and places of runs that can go side by side, no more than `FLEET` of them."""
    groups: dict[tuple[float, Timing, int, Hashable], list[int]] = {}
    kinds = {id(control): structure(control) for control in controls}
    delays: dict[Hashable, int] = {}
    whens: dict[Hashable, Timing] = {}
    for i, (one, control) in enumerate(zip(scenarios, controls, strict=True)):
        timed = control.sample_time, one.duration, one.drivetrain.torsional_frequency
        if timed not in whens:
            whens[timed] = timing(one, control, step, longest=LONGEST_STEP)
        late = control.sample_time, one.sensors.delay
        if late not in delays:
            delays[late] = one.sensors.samples_of_delay(control.sample_time)
        falls = one.drivetrain.wheelset.element.friction.falls_with_slip_speed
        kind = one.drivetrain.kind, falls, kinds[id(control)]
        key = control.sample_time, whens[timed], delays[late], kind
        groups.setdefault(key, []).append(i)
    for (_, when, *_), places in groups.items():
        for start in range(0, len(places), FLEET):
            yield when, places[start : start + FLEET]
