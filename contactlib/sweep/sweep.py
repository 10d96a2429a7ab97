"""A sweep that was read: what varies, and in which runs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contactlib.parameters import FloatArray
from contactlib.scenario import Scenario
from contactlib.sweep.plan import Plan, ScenarioBuilder
from contactlib.sweep.sampling import grid_shape


@dataclass(frozen=True)
class Sweep:
    """Many runs that differ in some parameters.

    Attributes
    ----------
    name, source : str
        What it is, and where its numbers come from.
    stem : str
        Of the sweep's file, and so of the results'.
    text : str
        The file.
    kind : str
        ``grid``, ``latin_hypercube`` or ``monte_carlo``.
    seed : int
        Of the two random kinds.
    scenario : Scenario
        As its file has it.
    plan : Plan
        What is the same for all runs.
    values : ndarray
        Of the axes in each run, shape (runs, axes), in SI units.
    """

    name: str
    source: str
    stem: str
    text: str
    kind: str
    seed: int
    scenario: Scenario
    plan: Plan
    values: FloatArray

    def scenario_of(self, run: int) -> Scenario:
        """Scenario of a run, with the controllers that it has in the sweep.

        With ``index=sweep.plan.index_of(run)`` and the sweep's step and tolerance,
        `contactlib.run_scenario` makes the run once more.

        Raises
        ------
        IndexError
            If there is no such run.
        ValueError
            If its parameters are not a valid scenario.
        """
        return self._builder.build(self.values[range(self.runs)[run]].tolist())

    @cached_property
    def _builder(self) -> ScenarioBuilder:
        return ScenarioBuilder(self.plan)

    @property
    def runs(self) -> int:
        """Number of runs under each controller."""
        return len(self.values)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the outcomes: of the grid, or the number of runs."""
        return grid_shape(self.plan.axes) if self.kind == "grid" else (self.runs,)

    @property
    def simulated_time(self) -> float:
        """Of all runs together [s]; zero if nothing runs."""
        if not self.plan.controllers:
            return 0.0
        each = np.full(self.runs, self.scenario.duration)
        for axis, column in zip(self.plan.axes, self.values.T, strict=True):
            if "run.duration" in [target.path for target in axis.targets]:
                each = each * column if axis.factor else column
        return len(self.plan.controllers) * float(each.sum())

    @property
    def summary(self) -> str:
        """What is to be done, in words."""
        names = ", ".join(self.plan.controllers)
        what = f" of {self.scenario.duration:g} s under each of {names}" if names else ""
        return f"{self.runs} runs{what}"

    def describe(self, run: int) -> str:
        """Values of the axes in a run, in words."""
        axes = self.plan.axes
        return ", ".join(
            f"{axis.name} = {value:.6g}{'' if axis.unit == '1' else ' ' + axis.unit}"
            for axis, value in zip(axes, self.values[run], strict=True)
        )
