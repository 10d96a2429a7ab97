"""The benchmark of traction controllers: drawn tracks, sensor errors, noise and one number.

Every controller runs in every scenario with every sensor error of `all_errors`. Each of these runs
has a track of its own, drawn from `RANGES` by a seed, and noise that `tune` has not seen. All
controllers meet the same tracks. A torque that is planned in advance, without a sensor, cannot suit
them all.

The score of a run is the mean of both utilisations, which `tune` maximises as well;
where friction never limits it is the latter, and zero for a run that failed. The score of a
controller is the mean over all of its runs. Slip work and jerk, and the number of trials in which
the controller was tuned, stand beside it.

`VERSION` changes with everything that changes a score on purpose: scenario files, ranges, errors,
number of runs, metric. Two scores of one version and one seed can be compared.
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

from contactlib.base.quantities import SEED, FloatArray, Limits, checked_whole
from contactlib.base.text import fixed_width, version
from contactlib.base.writing import write_whole
from contactlib.files.scenario import Scenario, load_scenario
from contactlib.runs.scenario_runs import run_many
from contactlib.runs.sweep.execution import default_workers
from contactlib.runs.tuning import OBJECTIVE, UNSEEN, all_errors, counted
from contactlib.traction.interface import Controller, checked_controller
from contactlib.vehicle.track import Profile

VERSION = 2
SAMPLE_TIME = 0.01  # the errors delay the measurement by one or two of these [s]
SHIPPED = ("threshold", "creep_pi", "slope_seeking")
OUTCOMES = (*OBJECTIVE, "slip_work", "jerk")
TRIED = Limits(at_least=0.0, at_most=1e9)
Range = tuple[float, float]


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


class Ranges(NamedTuple):
    """Ranges from which the tracks are drawn, each number evenly and by itself.

    Distances are given by the time that the vehicle needs for them at its initial speed. Friction
    is a factor on that of dry rails, as in the files.

    Attributes
    ----------
    first, length, gap : tuple of float
        Begin of the first of two patches, length of each, and distance between them [s].
    friction : tuple of float
        Friction on each patch [1].
    slope : tuple of float
        Factor on the initial slope on each patch of soft_patch.toml [1].
    sanding, rise : tuple of float
        Begin of sanding, and the time until friction has risen [s].
    slippery, sanded : tuple of float
        Friction before and after sanding [1].
    step, held : tuple of float
        Time of the torque step, and how long it lasts [s].
    rails : tuple of float
        Friction on the rails of torque_step.toml [1].
    """

    first: Range = (1.0, 4.0)
    length: Range = (3.0, 8.0)
    gap: Range = (1.0, 4.0)
    friction: Range = (0.25, 0.8)
    slope: Range = (0.29, 1.0)
    sanding: Range = (5.0, 15.0)
    rise: Range = (1.0, 5.0)
    slippery: Range = (0.25, 0.5)
    sanded: Range = (0.6, 0.9)
    step: Range = (3.0, 6.0)
    held: Range = (2.0, 5.0)
    rails: Range = (0.5, 1.0)


RANGES = Ranges()


def benchmark_scenarios(seed: int = 1, *, small: bool = False) -> list[list[Scenario]]:
    """Draw the tracks of the benchmark.

    To tune a controller for the benchmark, or let one learn on it, take other seeds than the one
    with which you score it.

    Parameters
    ----------
    seed : int, optional
        Seed of the tracks.
    small : bool, optional
        Whether to draw those of the small form.

    Returns
    -------
    list of list of Scenario
        For each scenario file its runs, by sensor error and then by noise. They have the sensors of
        the file, without the error, and its designed controllers.

    Raises
    ------
    ValueError
        If the seed is not a whole number from 0.

    Examples
    --------
    >>> import contactlib as cl
    >>> first = cl.runs.benchmark_scenarios(seed=7, small=True)[0][0]
    >>> track = first.track.friction_left  # two patches
    >>> [round(place) for place in track.at], [round(factor, 2) for factor in track.value]
    ([29, 29, 104, 104, 120, 120, 165, 165], [1.0, 0.68, 0.68, 1.0, 1.0, 0.73, 0.73, 1.0])
    """
    extent = SMALL if small else WHOLE
    seed = checked_whole("seed", seed, SEED)
    whole = []
    for file in extent.files:
        scenario = load_scenario(f"{file}.toml")
        runs = len(extent.errors or all_errors(scenario.sensors, SAMPLE_TIME)) * extent.noises
        generator = np.random.default_rng([seed, WHOLE.files.index(file)])
        whole.append([_drawn(file, scenario, generator) for _ in range(runs)])
    return whole


def _drawn(file: str, scenario: Scenario, generator: np.random.Generator) -> Scenario:
    """A scenario with numbers from the ranges in place of those of the file."""

    def drawn(limits: Range) -> float:
        return float(generator.uniform(*limits))

    track, demand = scenario.track, scenario.demand
    if file == "sanding":
        start = drawn(RANGES.sanding)
        times, factors = (start, start + drawn(RANGES.rise)), (RANGES.slippery, RANGES.sanded)
        sanded = Profile(times, tuple(map(drawn, factors)))
        return replace(scenario, track=replace(track, friction_over_time=sanded))
    if file == "torque_step":
        start = drawn(RANGES.step)
        end = start + drawn(RANGES.held)
        stepped = Profile((*demand.at[:2], start, start, end, end), demand.value)
        rails = Profile.of(drawn(RANGES.rails))
        return replace(scenario, demand=stepped, track=replace(track, friction_left=rails))
    soft = track.lowest[1] < 1.0
    at: tuple[float, ...] = ()
    friction, slope, end = at, at, 0.0
    for before in (RANGES.first, RANGES.gap):
        start = end + scenario.initial_speed * drawn(before)
        end = start + scenario.initial_speed * drawn(RANGES.length)
        wet, softer = drawn(RANGES.friction), drawn(RANGES.slope) if soft else 1.0
        at += (start, start, end, end)
        friction += (1.0, wet, wet, 1.0)
        slope += (1.0, softer, softer, 1.0)
    patches = replace(track, friction_left=Profile(at, friction), slope=Profile(at, slope))
    return replace(scenario, track=patches)


class Score(NamedTuple):
    """Score of a controller, or of its runs in one scenario.

    Attributes
    ----------
    mean : float
        Mean over the runs: the score [1].
    standard_error : float
        Standard error of this mean, from the tracks and the noise [1].
    spread : float
        Standard deviation of the runs [1].
    minimum : float
        Score of the worst run [1].
    slip_work : float
        Mean work that friction turns into heat in a run that did not fail [J]; nan if all failed.
    jerk : float
        Mean of the largest jerk in a run, likewise [m/s3].
    """

    mean: float
    standard_error: float
    spread: float
    minimum: float
    slip_work: float
    jerk: float


@dataclass(frozen=True)
class Benchmark:
    """Outcomes of the benchmark.

    Attributes
    ----------
    title : str
        Name with version, form and seed, to be cited with a score.
    controllers, scenarios, errors : tuple of str
        Names of the controllers, scenarios and sensor errors.
    trials : tuple of int or None
        Number of trials in which each controller was tuned; None if it is not stated.
    outcomes : ndarray
        Both utilisations [1], slip work [J] and jerk [m/s3] by controller, scenario,
        error and noise: shape (controllers, scenarios, errors, noises, 4). Nan for runs that
        failed; limited utilisation also where friction never limits.
    """

    title: str
    controllers: tuple[str, ...]
    scenarios: tuple[str, ...]
    errors: tuple[str, ...]
    trials: tuple[int | None, ...]
    outcomes: FloatArray

    def score(self, controller: str, scenario: str | None = None) -> Score:
        """Score of a controller, of all runs or of those in one scenario."""
        outcomes = self.outcomes[self.controllers.index(controller)]
        if scenario is not None:
            outcomes = outcomes[[self.scenarios.index(scenario)]]
        limited, used, *costs = np.moveaxis(outcomes, -1, 0)
        runs = counted(limited, used).mean(axis=0)
        error = np.sqrt(runs.var(axis=-1, ddof=1).mean() / runs.size)
        finished = ~np.isnan(used)
        means = (cost[finished].mean() if finished.any() else np.nan for cost in costs)
        return Score(*map(float, (runs.mean(), error, runs.std(), runs.min(), *means)))

    def table(self) -> str:
        """Scores of all controllers, and their means in each scenario, as text."""
        head = "controller", "score", "+-", "spread", "minimum", "slip work", "jerk", "trials"
        rows = [head, ("", "1", "1", "1", "1", "kJ", "m/s3", "")]
        for name, trials in zip(self.controllers, self.trials, strict=True):
            score = self.score(name)
            numbers = f"{score.mean:.3f}", f"{score.standard_error:.3f}", f"{score.spread:.3f}"
            costs = f"{1e-3 * score.slip_work:.0f}", f"{score.jerk:.1f}"
            known = "not stated" if trials is None else str(trials)
            rows.append((name, *numbers, f"{score.minimum:.3f}", *costs, known))
        parts = [["scenario", *self.controllers]]
        parts += [
            [scenario, *(f"{self.score(name, scenario).mean:.3f}" for name in self.controllers)]
            for scenario in self.scenarios
        ]
        runs = self.outcomes[0].size // len(OUTCOMES)
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
        writer.writerow(["controller", "scenario", "error", "noise", *OUTCOMES])
        for place in np.ndindex(self.outcomes.shape[:-1]):
            *which, noise = place
            parts = zip((self.controllers, self.scenarios, self.errors), which, strict=True)
            names = (labels[i] for labels, i in parts)
            writer.writerow([*names, noise, *map(repr, self.outcomes[place].tolist())])
        scores = {
            name: {
                **_known(self.score(name)),
                "trials": trials,
                "scenarios": {
                    scenario: _known(self.score(name, scenario)) for scenario in self.scenarios
                },
            }
            for name, trials in zip(self.controllers, self.trials, strict=True)
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
            ("json", json.dumps(about, indent=2, allow_nan=False) + "\n"),
        ):
            write_whole(output / f"benchmark.{suffix}", content.encode())


def _known(score: Score) -> dict[str, float | None]:
    """Numbers of a score by name; None in place of nan, which JSON does not have."""
    return {name: None if np.isnan(x) else x for name, x in score._asdict().items()}


def benchmark(
    controllers: Mapping[str, Controller] | None = None,
    *,
    trials: Mapping[str, int] | None = None,
    seed: int = 1,
    small: bool = False,
    progress: Callable[[float], object] = lambda part: None,
) -> Benchmark:
    """Run the shipped controllers, and your own, in the benchmark of traction control.

    Parameters
    ----------
    controllers : mapping, optional
        Controllers of your own by name.
    trials : mapping, optional
        For these, the number of settings that were tried when tuning, or of episodes in which a
        policy learned. The shipped controllers have the settings of their design: 0 trials.
    seed : int, optional
        Seed of the tracks.
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
        delay; if a number of trials or the seed is not a whole number from 0, or `trials` names
        no controller of your own.
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
    stated: dict[str, int | None] = dict.fromkeys(SHIPPED, 0) | dict.fromkeys(own)
    for name, count in (trials or {}).items():
        if name not in own:
            raise ValueError(f"trials: {name!r} must be one of controllers: {', '.join(own)}")
        stated[name] = checked_whole(f"trials[{name!r}]", count, TRIED)
    scenarios = [load_scenario(f"{file}.toml") for file in extent.files]
    drawn = benchmark_scenarios(seed, small=small)
    labels = extent.errors or tuple(all_errors(scenarios[0].sensors, SAMPLE_TIME))
    jobs = [
        (runs, own.get(name) or scenario.controller(name))
        for name in stated
        for scenario, runs in zip(scenarios, drawn, strict=True)
    ]

    def outcomes(job: tuple[list[Scenario], Controller]) -> FloatArray:
        runs, control = job
        erring = all_errors(runs[0].sensors, SAMPLE_TIME)
        sensors = [erring[label] for label in labels for _ in range(extent.noises)]
        cases = [
            replace(run, sensors=erroneous, controllers={"tried": control})
            for run, erroneous in zip(runs, sensors, strict=True)
        ]
        index = [*range(UNSEEN, UNSEEN + extent.noises)] * len(labels)
        columns = run_many(cases, "tried", OUTCOMES, index=index)
        return np.stack([columns[name].reshape(len(labels), -1) for name in OUTCOMES], axis=-1)

    done: list[FloatArray] = []
    progress(0.0)
    pool = ThreadPoolExecutor(default_workers())  # the kernel releases the GIL while it steps
    try:
        for outcome in pool.map(outcomes, jobs):
            done.append(outcome)
            progress(len(done) / len(jobs))
    finally:
        pool.shutdown(cancel_futures=True)
    whole = np.reshape(done, (-1, len(scenarios), *done[0].shape))
    form = " (small)" if small else ""
    title = f"contactlib benchmark {VERSION}{form}, seed {seed}"
    names = tuple(scenario.name for scenario in scenarios)
    return Benchmark(title, tuple(stated), names, labels, tuple(stated.values()), whole)
