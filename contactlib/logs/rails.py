"""What a log tells about the rails, with its uncertainty, and what it cannot tell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, Limits, Quantity, checked_number, checked_whole
from contactlib.base.writing import write_whole
from contactlib.files.scenario import Scenario
from contactlib.logs.conflict import Conflict, conflicts
from contactlib.logs.friction import (
    GRID,
    Rails,
    cleaned_before,
    cleaned_places,
    first_guess,
    force_errors,
    free_speed,
    likelihoods,
    means,
    slip_works,
)
from contactlib.logs.log import Log
from contactlib.logs.motion import LogErrors, LogPriors, Motion, Rows
from contactlib.runs import run_scenario
from contactlib.runs.result import Result
from contactlib.vehicle.track import UNCHANGED, Profile

if TYPE_CHECKING:
    from xarray import Dataset

SPACING = Quantity("m", above=0.0, at_most=100.0)
DRAWS = Limits(at_least=4, at_most=1000)
LOW, HIGH = 0.05, 0.95  # ends of an interval
NARROW = np.log(1.5)  # width of an interval of friction that tells something: high over low
CONFLICT = 0.025  # probability that a constant of a right log is so far off
TOGETHER = 0.95  # correlation of constants that cannot be separated
NARROWED = 50.0  # narrowing of a prior from which the log shows a constant [%]
WRONG = 1.5  # root mean square of what is measured less what is found, over the errors


@dataclass(frozen=True, eq=False)
class RailsEstimate:
    """Friction along the rails behind a log.

    Attributes
    ----------
    scenario : Scenario
        The vehicle with the slope and decay that were found, its mass as it was given, and the
        track without its friction.
    place : ndarray, shape (n,)
        Middles of sections of the rails [m].
    low, median, high : ndarray, shape (n,)
        Factor on friction: 5, 50 and 95 % quantiles [1].
    low_by_axle, median_by_axle, high_by_axle : ndarray, shape (n, axles)
        The same from what each axle met by itself, after those in front have cleaned the rails.
    met : ndarray, shape (n, axles)
        Whether the axle was there.
    draws : ndarray, shape (draws, n)
        Factors that are as probable as the log makes them: maps for other runs.
    constants : mapping
        Estimate and standard deviation by name, ``radius_1`` ... and the others of `LogPriors`, of
        each constant that was not known: logarithms of factors [1], and the delay [s].
    priors : mapping
        Their standard deviations before the log was known.
    correlations : ndarray, shape (constants, constants)
        Of the constants, in this order.
    rows : Rows
        The log as it was used.
    innovations : ndarray, shape (rows, axles + 1)
        Measured less found angular velocities and vehicle speed, over their errors.
    conflicts : sequence of Conflict
        Axles that met other rails than the others at the same places.
    errors : LogErrors
        What was assumed.
    """

    scenario: Scenario
    place: FloatArray
    low: FloatArray
    median: FloatArray
    high: FloatArray
    low_by_axle: FloatArray
    median_by_axle: FloatArray
    high_by_axle: FloatArray
    met: NDArray[np.bool_]
    draws: FloatArray
    constants: Mapping[str, tuple[float, float]]
    priors: Mapping[str, float]
    correlations: FloatArray
    rows: Rows
    innovations: FloatArray
    conflicts: tuple[Conflict, ...]
    errors: LogErrors

    @property
    def informative(self) -> NDArray[np.bool_]:
        """Whether the interval is narrow: the upper end at most 1.5 times the lower one."""
        return np.asarray(np.log(self.high / self.low) < NARROW)

    def scenario_on(self, factor: FloatArray | None = None) -> Scenario:
        """The scenario on the estimated rails, or on those of a draw.

        Parameters
        ----------
        factor : ndarray, shape (n,), optional
            Factors on friction at the places, such as one of `draws`. Default: the medians.
        """
        values = self.median if factor is None else np.asarray(factor, dtype=np.float64)
        track = replace(
            self.scenario.track,
            unit="factor",
            friction_left=Profile(tuple(self.place.tolist()), tuple(values.tolist())),
            friction_right=None,
            friction_over_time=UNCHANGED,
        )
        return replace(self.scenario, track=track, variation=None)

    def replayed(self, controller: str | None = None) -> Result:
        """Run of the scenario on the estimated rails, under a controller of its own.

        Parameters
        ----------
        controller : str, optional
            Name of the controller. Default: the scenario's first.
        """
        name = controller or next(iter(self.scenario.controllers))
        return run_scenario(self.scenario_on(), name)

    def to_xarray(self) -> Dataset:
        """Quantiles by distance and axle; needs xarray."""
        xarray = optional_library("xarray")
        axle = np.arange(1, self.met.shape[1] + 1)
        one, each = ("distance",), ("distance", "axle")
        made: Dataset = xarray.Dataset(
            {
                "median": (one, self.median),
                "low": (one, self.low),
                "high": (one, self.high),
                "informative": (one, self.informative),
                "median_by_axle": (each, self.median_by_axle),
                "low_by_axle": (each, self.low_by_axle),
                "high_by_axle": (each, self.high_by_axle),
                "met": (each, self.met),
                "draws": (("draw", "distance"), self.draws),
            },
            coords={"distance": ("distance", self.place, {"units": "m"}), "axle": axle},
        )
        return made

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Sentences on what does not fit: a wrong vehicle, law or log."""
        found = []
        others = max(len(self.constants) - 1, 1)
        for name, (value, spread) in self.constants.items():
            prior = self.priors[name]
            # Half of the probability is the torque's, which masses and brakes move.
            share = 0.5 if name == "torque" else 0.5 / others
            most = -float(ndtri(0.5 * share * CONFLICT))
            # What a log is expected to move a constant by: the variance that it takes away.
            far = abs(value) / np.sqrt(max(prior**2 - spread**2, (0.1 * prior) ** 2))
            if far > most:
                off = f"{value:+.3f} s" if name == "delay" else f"{100.0 * np.expm1(value):+.1f} %"
                found.append(
                    f"{name} is {off} off, {far:.1f} times what was expected: a mass, a brake or a "
                    "wheel is another"
                )
        if self.conflicts:
            worst = max(self.conflicts, key=lambda one: one.fall)
            axles = ", ".join(f"axle {one.axle}" for one in self.conflicts)
            found.append(
                f"{axles} met other rails than the other axles at the same places, most clearly "
                f"from {worst.start:.0f} to {worst.end:.0f} m: a torque does not act as logged, "
                "columns are mixed, or the contact has another law"
            )
        names = [*(f"omega_{i}" for i in range(1, self.innovations.shape[1])), "speed"]
        for name, wrong in zip(names, self.innovations.T, strict=True):
            known = wrong[np.isfinite(wrong)]
            if known.size < 100:
                continue
            size = float(np.sqrt(np.mean(known**2)))
            if size > WRONG:
                found.append(
                    f"{name} is {size:.2g} times its error away from the motion that was found: "
                    "its error is larger, or the scenario lacks something"
                )
        return tuple(found)

    def summary(self) -> str:
        """What the log tells, in words."""
        known = self.informative
        lines = [
            f"{self.place[0]:.0f} to {self.place[-1]:.0f} m: the log gives friction to within a "
            f"factor of 1.5 on {100.0 * known.mean():.0f} % of the way, elsewhere a lower bound at "
            "most."
        ]
        if known.any():
            least = int(np.where(known, self.median, np.inf).argmin())
            kinetic = self.scenario.drivetrain.wheelset.element.friction.kinetic
            lines.append(
                f"The lowest known friction is {self.median[least] * kinetic:.3f} (90 %: "
                f"{self.low[least] * kinetic:.3f} to {self.high[least] * kinetic:.3f}) at "
                f"{self.place[least]:.0f} m."
            )
        table = list(self._table())
        for name, unit, prior, value, spread, narrowed in table:
            lines.append(
                f"{name} [{unit}]: {value:.4f} +- {spread:.4f}, before the log +- {prior:.4f}, "
                f"narrowed by {narrowed:.0f} %"
            )
        for i, j in zip(*np.triu_indices(len(table), 1), strict=True):
            together = self.correlations[i, j]
            if abs(together) > TOGETHER and max(table[i][-1], table[j][-1]) <= NARROWED:
                lines.append(
                    f"{table[i][0]} and {table[j][0]} cannot be separated (correlation "
                    f"{together:.2f}): the log shows only what they do together; "
                    "measure one of them"
                )
        return "\n".join([*lines, *(f"Doubt: {doubt}." for doubt in self.doubts)])

    def _table(self) -> Iterator[tuple[str, str, float, float, float, float]]:
        """Of each constant name, unit, prior, estimate, standard deviation, narrowing [%]."""
        for name, (value, spread) in self.constants.items():
            prior, delay = self.priors[name], name == "delay"
            estimate = value if delay else float(np.exp(value))
            yield name, "s" if delay else "1", prior, estimate, spread, 100 * (1 - spread / prior)

    def write(self, folder: Path) -> None:
        """Write ``rails.csv``, ``constants.csv``, the map ``track.csv`` and ``rails.txt``."""
        folder.mkdir(parents=True, exist_ok=True)
        rows = ["distance [m],axle,friction,low,high,informative"]
        quantiles = (self.median_by_axle, self.low_by_axle, self.high_by_axle)
        for axle in range(self.met.shape[1]):
            parts = [part[:, axle] for part in quantiles]
            narrow = np.log(parts[2] / parts[1]) < NARROW
            rows += [
                f"{place:.10g},{axle + 1},{m:.6g},{a:.6g},{b:.6g},{int(known)}"
                for place, m, a, b, known, there in zip(
                    self.place, *parts, narrow, self.met[:, axle], strict=True
                )
                if there
            ]
        write_whole(folder / "rails.csv", ("\n".join(rows) + "\n").encode())
        track = ["distance [m],friction"]
        track += [f"{x:.10g},{m:.6g}" for x, m in zip(self.place, self.median, strict=True)]
        write_whole(folder / "track.csv", ("\n".join(track) + "\n").encode())
        table = ["name,unit,prior,estimate,standard_deviation,narrowed [%]"]
        table += [
            f"{name},{unit}," + ",".join(f"{number:.6g}" for number in numbers)
            for name, unit, *numbers in self._table()
        ]
        write_whole(folder / "constants.csv", ("\n".join(table) + "\n").encode())
        write_whole(folder / "rails.txt", (self.summary() + "\n").encode())


def _quantile(probability: FloatArray, part: float) -> FloatArray:
    """Factors below which a part of the probability is, within the cells of the grid."""
    below = np.cumsum(probability, axis=-1)
    below = np.concatenate([np.zeros_like(below[..., :1]), below / below[..., -1:]], axis=-1)
    half = 0.5 * (GRID[1] - GRID[0])
    edges = np.append(GRID - half, GRID[-1] + half)
    k = np.clip((below <= part).sum(axis=-1) - 1, 0, GRID.size - 1)
    lower = np.take_along_axis(below, k[..., np.newaxis], -1)[..., 0]
    upper = np.take_along_axis(below, k[..., np.newaxis] + 1, -1)[..., 0]
    share = (part - lower) / np.maximum(upper - lower, 1e-300)
    return np.asarray(np.exp(edges[k] + 2.0 * half * share))


def estimate_rails(
    log: Log,
    scenario: Scenario,
    *,
    errors: LogErrors | None = None,
    priors: LogPriors | None = None,
    spacing: float = 1.0,
    draws: int = 32,
    seed: int = 0,
    progress: Callable[[float], object] = lambda part: None,
) -> RailsEstimate:
    """Estimate friction along the rails from the log of a run.

    Parameters
    ----------
    log : Log
        Torques, wheel speeds and vehicle speed.
    scenario : Scenario
        The vehicle, its contact, and the grades and cleaning of the track. Its friction along the
        way is not used.
    errors : LogErrors, optional
        Errors of the sensors and the model.
    priors : LogPriors, optional
        What is known of radii, torque, mass and others. Default: radii to 0.5 %, the torque to 2 %,
        the others exactly.
    spacing : float, optional
        Length of the sections of the rails [m].
    draws : int, optional
        Number of maps to draw; the constants are drawn as often.
    seed : int, optional
        Seed of these draws.
    progress : callable, optional
        Called with the part that is done.

    Raises
    ------
    ValueError
        If a value is out of range, or log and scenario do not fit.

    Notes
    -----
    The force of an axle is what its torque leaves after turning it; the law gives the friction at
    which it has this force at its creepage. The torque's gain follows from the vehicle's mass, the
    radii from where the wheels hardly slip. A contact is taken as steady, without memory.
    """
    spacing = checked_number("spacing", spacing, SPACING)
    count = checked_whole("draws", draws, DRAWS)
    errors, priors = errors or LogErrors(), priors or LogPriors()
    motion = Motion(scenario, log.rows(scenario), errors, priors)
    behind = np.array(scenario.position)
    progress(0.0)
    motion.solve(*first_guess(motion, behind))
    progress(0.5)
    a, track = motion.axles, scenario.rails
    at = means(motion.rows, motion.states[:, :a], free_speed(motion), behind)
    rails = Rails(at, errors, spacing)
    rng = np.random.default_rng(seed)
    places = cleaned_places(track, slip_works(motion, at, rails))
    found = np.zeros((rails.place.size, 1 + a, GRID.size))  # of all axles, and of each by itself
    maps = np.empty((count, rails.place.size))
    unsure = force_errors(motion, at, motion.constants)
    chosen = rng.multivariate_normal(motion.constants, motion.covariance, size=count)
    for i, constants in enumerate(chosen):
        met = likelihoods(motion, at, constants, unsure)
        clean = rails.collected(cleaned_before(places, met)).sum(axis=1, keepdims=True)
        ahead = rails.ahead(np.concatenate([clean, rails.collected(met)], axis=1))
        found += rails.smoothed(ahead)
        maps[i] = np.exp(rails.drawn(ahead[:, 0], rng))
        progress(0.5 + 0.5 * (i + 1) / count)
    met = likelihoods(motion, at, motion.constants, unsure)
    common = rails.collected(cleaned_before(places, met))
    there = np.ones(at.time.size)
    unknown, covariance = motion.unknown, motion.covariance
    spreads = np.sqrt(np.diag(covariance))[unknown]
    names = np.array(list(priors.by_name(a)))[unknown].tolist()
    values = motion.constants[unknown].tolist()
    low, median, high = (_quantile(found, part) for part in (LOW, 0.5, HIGH))
    return RailsEstimate(
        scenario=motion.found_in(scenario),
        place=rails.place,
        low=low[:, 0],
        median=median[:, 0],
        high=high[:, 0],
        low_by_axle=low[:, 1:],
        median_by_axle=median[:, 1:],
        high_by_axle=high[:, 1:],
        met=np.stack([rails.mean_of(there, axle) > 0.0 for axle in range(a)], axis=1),
        draws=maps,
        constants=dict(zip(names, zip(values, spreads.tolist(), strict=True), strict=True)),
        priors=dict(zip(names, motion.spread[unknown].tolist(), strict=True)),
        correlations=covariance[np.ix_(unknown, unknown)] / np.outer(spreads, spreads),
        rows=motion.rows,
        innovations=motion.innovations,
        conflicts=tuple(conflicts(rails, common)),
        errors=errors,
    )
