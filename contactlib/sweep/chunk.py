"""Some runs of a sweep, side by side: what a worker does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contactlib.ensemble_run import FAILED, run_many
from contactlib.parameters import FloatArray
from contactlib.scenario import Scenario
from contactlib.sweep.outcomes import analyse, of_runs
from contactlib.sweep.plan import Plan, ScenarioBuilder


class StoppedError(RuntimeError):
    """Somebody asked to stop."""


def go_on() -> bool:
    """Nobody asks to stop."""
    return False


def run_chunk(
    plan: Plan, first: int, values: FloatArray, stopped: Callable[[], bool] = go_on
) -> dict[str, FloatArray]:
    """Outcomes of some runs: a pure function, whoever calls it.

    Parameters
    ----------
    plan : Plan
        Of the sweep.
    first : int
        Index of the first run among all of the sweep.
    values : ndarray
        Values of the axes, shape (n, axes).
    stopped : callable, optional
        Asked now and then whether to give up.

    Returns
    -------
    dict
        Outcomes of runs of shape (controllers, n), of analysis (n,); nan where a run failed or
        its parameters are not a valid scenario. ``failed`` says where with ones.

    Raises
    ------
    RuntimeError
        If contactlib is another one here than where the plan was made.
    StoppedError
        If asked to.
    """
    plan.check_machine()

    def go_on_or_stop(part: float) -> None:
        if stopped():
            raise StoppedError

    builder, n, runs = ScenarioBuilder(plan), len(values), of_runs(plan.outcomes)
    shape = (len(plan.controllers), n) if runs else (n,)
    found = {name: np.full(shape if name in runs else n, np.nan) for name in plan.outcomes}
    found[FAILED] = np.zeros(shape)
    scenarios: list[Scenario | None] = []
    for i, row in enumerate(values):
        go_on_or_stop(0.0)
        try:
            scenarios.append(scenario := builder.build(row.tolist()))
        except ValueError:
            scenarios.append(None)
            found[FAILED][..., i] = 1.0
            continue
        for name, value in analyse(scenario, plan.outcomes).items():
            found[name][i] = value
    valid = [scenario for scenario in scenarios if scenario is not None]
    if not runs or not valid:
        return found
    # One that is not valid keeps its place.
    filled = [valid[0] if scenario is None else scenario for scenario in scenarios]
    for j, controller in enumerate(plan.controllers):
        by_name = run_many(
            filled,
            controller,
            runs,
            index=[plan.index_of(first + i) for i in range(n)],
            step=plan.step,
            tolerance=plan.tolerance,
            progress=go_on_or_stop,
        )
        failed = (found[FAILED][j] == 1.0) | (by_name[FAILED] == 1.0)
        found[FAILED][j] = failed
        for name in runs:
            found[name][j] = np.where(failed, np.nan, by_name[name])
    return found
