"""The benchmark of traction controllers: fixed scenarios, sensor errors, noise and one number.

Every controller runs in every scenario with every sensor error of `all_errors`, under the same
sequences of noise, which `tune` has not seen. The score of a run is the mean of limited and
adhesion utilisation, which `tune` maximises as well; where friction never limits it is the latter,
and zero for a run that failed. The score of a controller is the mean over all of its runs.

`VERSION` changes with everything that changes a score on purpose: scenario files, errors, number of
runs, metric. Two scores of one version can be compared.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.text import fixed_width, version
from contactlib.base.writing import write_whole
from contactlib.files.scenario import Scenario, load_scenario
from contactlib.runs.sweep.execution import default_workers
from contactlib.runs.tuning import OBJECTIVE, UNSEEN, all_errors, objectives
from contactlib.traction.interface import Controller, checked_controller

VERSION = 1
SAMPLE_TIME = 0.01  # the errors delay the measurement by one or two of these [s]
SHIPPED = ("threshold", "creep_pi", "slope_seeking")


class Extent(NamedTuple):
    """Runs of a form of the benchmark: scenario files, sensor errors (empty: all), and noises."""

    files: tuple[str, ...]
    errors: tuple[str, ...]
    noises: int


WHOLE = Extent(
    ("dry_wet_dry", "soft_patch", "braking", "sanding", "split_friction", "torque_step"), (), 10
)
SMALL = Extent(
    WHOLE.files[:3],
    ("as in the file", "vehicle speed +1 %", "delay + 10 ms", "speed of the wheels alone"),
    2,
)


class Score(NamedTuple):
    """Score of a controller, or of its runs in one scenario.

    Attributes
    ----------
    mean : float
        Mean over the runs: the score [1].
    standard_error : float
        Standard error of this mean, from the sequences of noise [1].
    spread : float
        Standard deviation of the runs [1].
    minimum : float
        Score of the worst run [1].
    """

    mean: float
    standard_error: float
    spread: float
    minimum: float


@dataclass(frozen=True)
class Benchmark:
    """Outcomes of the benchmark.

    Attributes
    ----------
    title : str
        Name with version and form, to be cited with a score.
    controllers, scenarios, errors : tuple of str
        Names of the controllers, scenarios and sensor errors.
    outcomes : ndarray
        Limited and adhesion utilisation [1] by controller, scenario, error and noise: shape
        (controllers, scenarios, errors, noises, 2).
    """

    title: str
    controllers: tuple[str, ...]
    scenarios: tuple[str, ...]
    errors: tuple[str, ...]
    outcomes: FloatArray

    def score(self, controller: str, scenario: str | None = None) -> Score:
        """Score of a controller, of all runs or of those in one scenario."""
        runs = self.outcomes[self.controllers.index(controller)].mean(axis=-1)
        if scenario is not None:
            runs = runs[[self.scenarios.index(scenario)]]
        by_noise = runs.mean(axis=(0, 1))
        error = by_noise.std(ddof=1) / np.sqrt(by_noise.size)
        return Score(*map(float, (runs.mean(), error, runs.std(), runs.min())))

    def table(self) -> str:
        """Scores of all controllers, and their means in each scenario, as text."""
        rows = [["controller", "score", "+-", "spread", "minimum"]]
        rows += [
            [name, *(f"{x:.4f}" if i < 2 else f"{x:.3f}" for i, x in enumerate(self.score(name)))]
            for name in self.controllers
        ]
        parts = [["scenario", *self.controllers]]
        parts += [
            [scenario, *(f"{self.score(name, scenario).mean:.4f}" for name in self.controllers)]
            for scenario in self.scenarios
        ]
        runs = self.outcomes[0].size // len(OBJECTIVE)
        about = f"{self.title}: {runs} runs each"
        return "\n".join([about, fixed_width(rows), "", fixed_width(parts)])

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write the table, the scores and the outcomes of every run to a folder.

        Parameters
        ----------
        folder : path
            It gets benchmark.txt, benchmark.json and benchmark.csv, and is created if missing.

        Raises
        ------
        OSError
            If the folder cannot be created or written.
        """
        output = Path(folder)
        lines = io.StringIO()
        writer = csv.writer(lines, lineterminator="\n")
        writer.writerow(["controller", "scenario", "error", "noise", *OBJECTIVE])
        for place in np.ndindex(self.outcomes.shape[:-1]):
            *which, noise = place
            parts = zip((self.controllers, self.scenarios, self.errors), which, strict=True)
            names = (labels[i] for labels, i in parts)
            writer.writerow([*names, noise, *map(repr, self.outcomes[place].tolist())])
        scores = {
            name: {
                **self.score(name)._asdict(),
                "scenarios": {one: self.score(name, one)._asdict() for one in self.scenarios},
            }
            for name in self.controllers
        }
        about = {
            "benchmark": self.title,
            "contactlib": version(),
            "errors": self.errors,
            "noises": self.outcomes.shape[3],
            "scores": scores,
        }
        output.mkdir(parents=True, exist_ok=True)
        for suffix, content in (
            ("txt", self.table() + "\n"),
            ("csv", lines.getvalue()),
            ("json", json.dumps(about, indent=2) + "\n"),
        ):
            write_whole(output / f"benchmark.{suffix}", content.encode())


def benchmark(
    controllers: Mapping[str, Controller] | None = None,
    *,
    small: bool = False,
    progress: Callable[[float], object] = lambda part: None,
) -> Benchmark:
    """Run the shipped controllers, and your own, in the benchmark of traction control.

    Parameters
    ----------
    controllers : mapping, optional
        Controllers of your own by name.
    small : bool, optional
        Whether to run the small form, of 24 runs for each controller, not the whole one of 840.
    progress : callable, optional
        Called with the fraction of the work that is done, from 0 to 1.

    Returns
    -------
    Benchmark
        The outcomes of every run. They do not depend on the other controllers.

    Raises
    ------
    ValueError
        If a controller is invalid, has the name of a shipped one, or cannot have the sensors'
        delay.
    RuntimeError
        If a controller of your own raises an error.

    Examples
    --------
    >>> import contactlib as cl
    >>> found = cl.runs.benchmark(small=True)
    >>> max(found.controllers, key=lambda name: found.score(name).mean)
    'slope_seeking'
    """
    extent = SMALL if small else WHOLE
    own = dict(controllers or {})
    for name, control in own.items():
        if name in SHIPPED:
            raise ValueError(f"controllers: {name!r} is a shipped one: take another name")
        checked_controller(f"controllers[{name!r}]", control)
    scenarios = [load_scenario(f"{file}.toml") for file in extent.files]
    index = range(UNSEEN, UNSEEN + extent.noises)
    jobs = [
        (scenario, own.get(name) or scenario.controller(name))
        for name in (*SHIPPED, *own)
        for scenario in scenarios
    ]
    labels = extent.errors or tuple(all_errors(scenarios[0].sensors, SAMPLE_TIME))

    def outcomes(job: tuple[Scenario, Controller]) -> FloatArray:
        scenario, control = job
        erring = all_errors(scenario.sensors, SAMPLE_TIME)
        cases = [(replace(scenario, sensors=erring[label]), control) for label in labels]
        return objectives(cases, index)

    found: list[FloatArray] = []
    progress(0.0)
    pool = ThreadPoolExecutor(default_workers())  # the kernel releases the GIL while it steps
    try:
        for one in pool.map(outcomes, jobs):
            found.append(np.moveaxis(one, 0, -1))
            progress(len(found) / len(jobs))
    finally:
        pool.shutdown(cancel_futures=True)
    whole = np.reshape(found, (-1, len(scenarios), *found[0].shape))
    title = f"contactlib benchmark {VERSION}{' (small)' if small else ''}"
    names = tuple(scenario.name for scenario in scenarios)
    return Benchmark(title, (*SHIPPED, *own), names, labels, whole)
