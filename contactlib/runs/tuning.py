"""Tuning of controllers for scenarios, and their performance with sensor errors.

A comparison of a tuned controller with an untuned one is not fair. So `tune` searches the settings
of every controller in the same way, with the same budget: it multiplies the settings in
`search_ranges` by factors, which `scipy.optimize.differential_evolution` chooses. The design itself
is one of the first trials.

Controllers are designed for the sensors of the scenario's file. The search, and the assessment by
`sensor_errors`, use these sensors and sensor errors that the controllers cannot correct.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, Limits, checked_whole, shown
from contactlib.files.scenario import ControllerDesign, Scenario
from contactlib.runs.scenario_runs import run_many
from contactlib.traction.interface import Controller
from contactlib.traction.search import Searched
from contactlib.traction.sensors import INDEX, Sensors

if TYPE_CHECKING:
    import xarray as xr

OBJECTIVE = ("limited_utilisation", "utilisation")  # their mean
POPULATION = 30  # settings of a generation
TRIALS = Limits(at_least=2.0 * POPULATION, at_most=1e6)
SEEDS = Limits(at_least=1.0, at_most=1e4)
UNSEEN = 1_000_000  # index of the first run on which the settings found are judged
BIASES = (-0.02, -0.01, -0.005, 0.005, 0.01, 0.02)  # of the vehicle speed [1]
DIAMETERS = (-0.01, 0.01)  # errors of the wheel's [1]
LATE = (1, 2)  # samples of further delay
NOISES = (0.0, 2.0)  # times the noise
TRAIN = 0.5  # acceleration of a train at most, where its speed is estimated from the wheels [m/s2]


@dataclass(frozen=True)
class Tuning:
    """Settings that a search found for one controller.

    Attributes
    ----------
    factors : dict
        Factor on each setting of the design [1].
    controllers : tuple of SampledController or TractionController
        The controller with these settings, one for each scenario.
    designed, tuned : ndarray
        Outcomes with the settings of the design and with those found, of noise that the search has
        not seen: shape (scenarios, 2, noises), limited utilisation first and then adhesion
        utilisation.
    trials : int
        Settings that were tried.
    """

    factors: dict[str, float]
    controllers: tuple[Controller, ...]
    designed: FloatArray
    tuned: FloatArray
    trials: int

    def section(self, name: str, design: object) -> str:
        """Section of a scenario file with these settings, to four digits.

        A file cannot name your own controller: a comment describes how to create it.

        Parameters
        ----------
        name : str
            Name of the controller.
        design : ControllerDesign, SampledController or TractionController
            What the scenario has under this name; of a design, kind and other fields are kept.
        """
        control: Any = self.controllers[0]
        kind = type(control)
        settings = {key: float(f"{getattr(control, key):.4g}") for key in self.factors}
        if isinstance(design, ControllerDesign):
            if "reference" in settings and control.reference_torque is not None:
                settings["reference_torque"] = float(
                    f"{control.reference_torque:.4g}"
                )  # else constant
            lines = [f"[controllers.{name}]", f'kind = "{design.kind}"']
            given = {**design.given, **settings}
            return "\n".join([*lines, *(f"{key} = {v!r}" for key, v in given.items())]) + "\n"
        if type(design) is not kind:
            raise ValueError(
                f"design = {shown(design)} must be what the scenario has as {name}: a "
                f"ControllerDesign or a {kind.__name__}"
            )
        given = {**Searched(name, control).arguments, **settings}
        call = ", ".join(f"{key}={shown(value)}" for key, value in given.items())
        return f"# {name} is a controller of your own: {kind.__name__}({call})\n"


def searched(scenarios: Sequence[Scenario], controller: str) -> list[Searched]:
    """The controller of each scenario, and its settings to search.

    Raises
    ------
    ValueError
        If a scenario has no such controller, it declares no settings, or it is of another class
        than in the first scenario.
    """
    where = f"controller = {shown(controller)}"
    designs = [Searched(where, scenario.controller(controller)) for scenario in scenarios]
    kinds = dict.fromkeys(type(design.control).__name__ for design in designs)
    if len(kinds) > 1:
        raise ValueError(f"{where} must be of one class in all scenarios: {', '.join(kinds)}")
    return designs


def tune(
    scenarios: Sequence[Scenario],
    controller: str,
    *,
    trials: int = 600,
    seeds: int = 1,
    seed: int = 1,
    progress: Callable[[float], object] = lambda part: None,
) -> Tuning:
    """Search settings of a controller that suit all of the scenarios at once.

    The settings of `search_ranges` are searched: those that a controller of your own declares; of a
    shipped controller those of its design, from a quarter of their value to four times.

    The objective is the mean of both utilisations, of all scenarios, of all sensors
    of `erring` and sequences of noise. So force that is lost while friction limits counts, and so
    does force that is lost afterwards. On one known track even a torque that reads no sensor can be
    tuned well, so give several, such as some of `benchmark_scenarios`.

    Parameters
    ----------
    scenarios : sequence of Scenario
        Scenarios with a controller of this name.
    controller : str
        Name of the controller.
    trials : int, optional
        Settings to try, at least 60; rounded down to a multiple of 30, a generation.
    seeds : int, optional
        Sequences of noise with which each is tried, for each of the sensors.
    seed : int, optional
        Seed of the search, which is the same each time.
    progress : callable, optional
        Called with the fraction of the work that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If a value is out of range, or a scenario lacks this controller, or it declares no
        settings.
    RuntimeError
        If a controller of your own raises an error.

    Examples
    --------
    >>> import contactlib as cl
    >>> scenario = cl.load_scenario("dry_wet_dry.toml")
    >>> found = tune([scenario], "threshold", trials=60, seeds=1)
    >>> sorted(found.factors)[:3]
    ['acceleration_filter_time', 'acceleration_threshold', 'cut_fraction']
    """
    if isinstance(scenarios, Scenario) or not scenarios:
        raise ValueError("scenarios must be a list of at least one, such as [scenario]")
    generations = checked_whole("trials", trials, TRIALS) // POPULATION
    seeds = checked_whole("seeds", seeds, SEEDS)
    seed = checked_whole("seed", seed, INDEX)
    designs = searched(scenarios, controller)
    names = [name for name in designs[0].ranges if all(name in design.ranges for design in designs)]
    ends = np.log([[design.factors(name) for name in names] for design in designs])
    low, high = ends[..., 0].max(axis=0), ends[..., 1].min(axis=0)  # that suit all designs
    done = 0
    cases = [
        (replace(scenario, sensors=sensors), design)
        for scenario, design in zip(scenarios, designs, strict=True)
        for sensors in erring(scenario.sensors, design.control.sample_time).values()
    ]

    def objective(logs: Any) -> Any:  # many at once, which SciPy's types do not cover
        nonlocal done
        outcomes = _outcomes(cases, names, np.exp(logs.T), range(seeds))
        done += len(logs.T)
        progress(min(1.0, done / (generations * POPULATION)))
        return -outcomes.mean(axis=(1, 2, 3))

    from scipy.stats import qmc  # imported late, as it takes longer than all else here

    # The design is the first of a population that fills the space evenly.
    even = qmc.Sobol(len(names), rng=seed).random_base2(math.ceil(math.log2(POPULATION)))
    start = low + (high - low) * even[:POPULATION]
    start[0] = 0.0
    best = differential_evolution(
        objective,
        Bounds(low, high),
        init=start,
        maxiter=generations - 1,
        tol=0.0,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=seed,
    )
    factors = dict(zip(names, np.exp(best.x).tolist(), strict=True))
    both = np.exp(np.stack([np.zeros(len(names)), best.x]))
    unseen = range(UNSEEN, UNSEEN + max(seeds, 10))
    plain = list(zip(scenarios, designs, strict=True))
    designed, tuned = _outcomes(plain, names, both, unseen)
    settled = tuple(design.changed(factors) for design in designs)
    return Tuning(factors, settled, designed, tuned, generations * POPULATION)


def _outcomes(
    cases: Sequence[tuple[Scenario, Searched]],
    names: Sequence[str],
    factors: FloatArray,
    index: Sequence[int],
) -> FloatArray:
    """Outcomes of every row of factors on the designs: shape (rows, cases, `OBJECTIVE`, noises)."""
    tried, places = [], []
    for row, some in enumerate(factors.tolist()):
        given = dict(zip(names, some, strict=True))
        controls = {design: design.changed(given) for design in {design for _, design in cases}}
        for place, (scenario, design) in enumerate(cases):
            if (control := controls[design]) is not None:
                tried.append((scenario, control))
                places.append((row, place))
    whole = np.zeros((len(factors), len(cases), len(OBJECTIVE), len(index)))
    for (row, place), *values in zip(places, *counted(*_run(tried, OBJECTIVE, index)), strict=True):
        whole[row, place] = values
    return whole


def counted(limited: FloatArray, used: FloatArray) -> FloatArray:
    """Both utilisations as a search counts them when it takes their mean.

    Where friction never limits, the second counts twice; a run that failed counts as zero.
    """
    return np.asarray(np.nan_to_num([np.where(np.isnan(limited), used, limited), used]))


def _run(
    tried: Sequence[tuple[Scenario, Any]], names: Sequence[str], index: Sequence[int]
) -> FloatArray:
    """Outcomes of scenarios under controllers: shape (names, scenarios, noises)."""
    cases = [replace(scenario, controllers={"tried": control}) for scenario, control in tried]
    many = [case for case in cases for _ in index]
    outcomes = run_many(many, "tried", names, index=list(index) * len(cases))
    return np.stack([outcomes[name].reshape(len(cases), len(index)) for name in names])


def all_errors(sensors: Sensors, sample_time: float) -> dict[str, Sensors]:
    """The sensors of `erring`; in the last case none measures the vehicle speed."""
    variants = erring(sensors, sample_time)
    variants["speed of the wheels alone"] = replace(
        sensors,
        vehicle_speed_bias=0.0,
        vehicle_speed_drift=0.0,
        vehicle_speed_noise=0.0,
        acceleration_limit=TRAIN,
    )
    return variants


def erring(sensors: Sensors, sample_time: float) -> dict[str, Sensors]:
    """The sensors with one error at a time, by what it is; first as they are."""
    variants = {"as in the file": sensors}

    def add(name: str, **errors: float) -> None:
        variants[name] = replace(sensors, **errors)

    for bias in BIASES:
        add(
            f"vehicle speed {100.0 * bias:+g} %",
            vehicle_speed_bias=sensors.vehicle_speed_bias + bias,
        )
    for error in DIAMETERS:
        diameter = sensors.wheel_diameter_error + error
        add(f"wheel diameter {100.0 * error:+g} %", wheel_diameter_error=diameter)
    for times in NOISES:
        add(
            f"noise x {times:g}",
            wheel_speed_noise=times * sensors.wheel_speed_noise,
            vehicle_speed_noise=times * sensors.vehicle_speed_noise,
        )
    for samples in LATE:
        later = sensors.delay + samples * sample_time
        add(f"delay + {1e3 * samples * sample_time:g} ms", delay=later)
    return variants


def check_distinct(scenarios: Sequence[Scenario]) -> None:
    """Reject scenarios with equal names."""
    twice = [name for name, n in Counter(scenario.name for scenario in scenarios).items() if n > 1]
    if twice:
        raise ValueError(f"two of the scenarios have the name {twice[0]!r}: give each its own")


def sensor_errors(
    scenarios: Sequence[Scenario],
    controllers: Mapping[str, Sequence[Controller]],
    *,
    noises: int = 10,
    progress: Callable[[float], object] = lambda part: None,
) -> xr.DataArray:
    """Limited utilisation of controllers with sensor errors that they cannot correct.

    The sensors have the errors of `erring`; in the last case none measures the vehicle speed, which
    is estimated from the wheels.

    Parameters
    ----------
    scenarios : sequence of Scenario
        Scenarios, whose names differ.
    controllers : mapping
        By name, the controller of each scenario.
    noises : int, optional
        Sequences of noise of each run; none is one of those that `tune` has seen.
    progress : callable, optional
        Called with the fraction of the work that is done, from 0 to 1.

    Returns
    -------
    xarray.DataArray
        Limited utilisation [1] by scenario, controller, error and noise. Where friction never
        limits it is nan.
    """
    xarray = optional_library("xarray")

    noises = checked_whole("noises", noises, SEEDS)
    check_distinct(scenarios)
    index = range(UNSEEN, UNSEEN + noises)
    whole, labels = [], []
    work = len(scenarios) * len(controllers)
    for place, scenario in enumerate(scenarios):
        for done, many in enumerate(controllers.values(), place * len(controllers)):
            control = many[place]
            sensors = all_errors(scenario.sensors, control.sample_time)
            labels = list(sensors)
            cases = [(replace(scenario, sensors=s), control) for s in sensors.values()]
            whole.append(_run(cases, OBJECTIVE[:1], index)[0])
            progress((done + 1) / work)
    errors: xr.DataArray = xarray.DataArray(
        np.reshape(whole, (len(scenarios), len(controllers), len(labels), noises)),
        dims=("scenario", "controller", "error", "noise"),
        coords={
            "scenario": [scenario.name for scenario in scenarios],
            "controller": list(controllers),
            "error": labels,
        },
        name=OBJECTIVE[0],
        attrs={"units": "1"},
    )
    return errors
