"""What rails from a log are worth: ``python benchmarks/rails_from_logs.py 1000 logs.csv``.

Logs of vehicles, controllers, rails and noise that are drawn at random, whose rails, radii and
torque are known, go through `contactlib.logs`. Each adds a line to the file, so that a run can be
resumed; all lines together are summed up. ``--mistake brake`` makes logs of a vehicle that is not
the scenario's, or mixes their columns; ``--predict`` compares the stopping distance under another
controller, on draws of the rails, with the true one.
"""

from __future__ import annotations

import argparse
import csv
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.files.scenario import ControllerDesign
from contactlib.laws import Polach
from contactlib.logs import Log, LogPriors, RailsEstimate, estimate_rails
from contactlib.vehicle import Variation

VEHICLES: Mapping[str, tuple[str, ...]] = {  # with the controllers of their logs
    "dry_wet_dry.toml": ("threshold", "creep_pi", "slope_seeking"),
    "four_axles.toml": ("creep_pi", "threshold", "slope_seeking"),
    "coach_braking.toml": ("wsp",),
}
STOPPED, STOPS_FROM = "coach_braking.toml", (8.0, 14.0)  # speeds of predicted stops [m/s]
PERIOD, DURATION = 0.01, 15.0  # of a log [s]
RADIUS, GAIN, DELAY = 0.005, 0.02, 0.02  # standard deviations [1], largest delay of torques [s]
PRIORS = LogPriors(radius=RADIUS, torque=GAIN, delay=DELAY)
WHEEL, RADAR = 0.01, 0.02  # noise of speeds [m/s]
SAME = 1e-3  # difference of stopping distances that are the same, as where no wheel slides
TENTHS, USED = 10, 0.8  # parts of the friction that is used; beyond it the median's error counts
Line: TypeAlias = dict[str, Any]
MISTAKES = ("law", "mass", "brake", "swapped")


class Case(NamedTuple):
    """A log with the scenario of its vehicle, and what is true of it."""

    scenario: cl.Scenario
    controller: str
    run: cl.Result
    log: Log
    constants: list[float]  # logarithms of radii and torque over those of scenario and log


def logged(
    case: cl.Scenario,
    run: cl.Result,
    rng: np.random.Generator,
    *,
    delay: float = 0.0,
    faulty: bool = False,
) -> tuple[Log, list[float]]:
    """The log of a run with the errors of sensors, and its logarithms of radii and torque.

    Faulty ones lack samples and a second of one wheel, at uneven times, and have coarse speeds.
    """
    true, n = Log.of(run), int(run.time[-1] / PERIOD) + 1
    time: FloatArray = PERIOD * np.arange(n, dtype=np.float64)
    if faulty:
        time[1:-1] += rng.uniform(-0.2, 0.2, n - 2) * PERIOD
        time = np.delete(time, rng.choice(np.arange(1, n - 1), n // 50, replace=False))
    axles, radius = case.axles, case.drivetrain.wheelset.radius
    larger, gain = rng.normal(0.0, RADIUS, axles), float(rng.normal(0.0, GAIN))

    def at(times: FloatArray, values: FloatArray, noise: float = 0.0) -> FloatArray:
        table = values.reshape(run.time.size, -1).T
        found = np.stack([np.interp(times, run.time, column) for column in table], axis=1)
        found += rng.normal(0.0, noise, found.shape) if noise else 0.0
        return found.reshape(times.size, *values.shape[1:])

    omega = at(time, true.omega, WHEEL / radius) * np.exp(-larger)
    assert true.speed is not None
    speed = at(time, true.speed, RADAR)
    if faulty:
        omega, speed = np.round(omega / 0.02) * 0.02, np.round(speed / 0.01) * 0.01
        start = rng.uniform(0.2, 0.7) * time[-1]
        omega[(start < time) & (time < start + 1.0), rng.integers(axles)] = np.nan
    torque = at(time - delay, true.drive_torque) * np.exp(-gain)
    return Log(time=time, drive_torque=torque, omega=omega, speed=speed), [*larger.tolist(), gain]


def scenario_of(name: str, rng: np.random.Generator) -> cl.Scenario:
    """A scenario on other rails: of one level, or of sections; that vary, uphill or downhill."""
    case = cl.load_scenario(name)
    body = case.drivetrain.wheelset
    needed = max(abs(t) for t in case.demand.value) / body.radius / case.static_load
    needed /= body.element.friction.kinetic
    sections = 1 if rng.random() < 0.5 else 8
    places = np.cumsum(rng.uniform(15.0, 60.0, sections))
    levels = needed * rng.uniform(0.5, 1.1, sections)
    track = cl.Track(
        friction_left=cl.Profile.steps((0.0, *places), (1.0, *levels)),
        grade=cl.Profile.of(rng.uniform(-0.005, 0.005)),
        cleaning=case.track.cleaning,
    )
    variation = Variation(
        standard_deviation=rng.uniform(0.05, 0.3),
        correlation_length=rng.uniform(10.0, 60.0),
        seed=float(rng.integers(1_000_000)),
    )
    kinds = dict.fromkeys(one for several in VEHICLES.values() for one in several)
    return replace(
        case,
        track=track,
        variation=variation,
        initial_speed=rng.uniform(12.0, 22.0) if name == STOPPED else rng.uniform(6.0, 14.0),
        duration=DURATION,
        controllers={"open_loop": ControllerDesign(kind="open_loop", given={})}
        | {kind: ControllerDesign(kind=kind, given={}) for kind in kinds},
    )


def of_another_law(case: cl.Scenario) -> cl.Scenario:
    """With Polach's law, as he published it for wet rails or dry ones."""
    body = case.drivetrain.wheelset
    law = Polach.wet() if body.element.layer_compliance else Polach.dry()
    table = cl.CreepForceTable.from_law(law, contact="elliptic")
    element = replace(body.element, table=table, layer_compliance=0.0)
    return replace(
        case, drivetrain=replace(case.drivetrain, wheelset=replace(body, element=element))
    )


def heavier(case: cl.Scenario) -> cl.Scenario:
    """With a tenth more mass, of the train if there is one."""
    body, vehicle = case.drivetrain.wheelset, case.vehicle
    assert body.mass is not None
    if vehicle is not None:
        part = "train_mass" if vehicle.train_mass else "body_mass"
        vehicle = replace(vehicle, **{part: getattr(vehicle, part) + 0.1 * vehicle.mass})
    mass = vehicle.mass / vehicle.axles if vehicle else 1.1 * body.mass
    drivetrain = replace(case.drivetrain, wheelset=replace(body, mass=mass))
    return replace(case, drivetrain=drivetrain, vehicle=vehicle)


def idle(case: cl.Scenario, axle: int) -> cl.Scenario:
    """With an axle that neither motor nor brake turns."""
    assert case.vehicle is not None
    others = tuple(k for k in range(1, case.axles + 1) if k != axle)
    return replace(case, vehicle=replace(case.vehicle, driven=others, braked=others))


def drawn(seed: int, mistake: str = "") -> Case:
    """The case of a seed: right, or whose log is another vehicle's or has mixed columns."""
    rng = np.random.default_rng(seed)
    names = list(VEHICLES)[mistake in ("brake", "swapped") :]  # those with several axles
    name = names[seed % len(names)]
    case = scenario_of(name, rng)
    controller, axle = str(rng.choice(VEHICLES[name])), int(rng.integers(case.axles))
    true = case
    if mistake == "law":
        true = of_another_law(case)
    elif mistake == "mass":
        true = heavier(case)
    elif mistake == "brake":
        true = idle(case, axle + 1)
    run = cl.run_scenario(true, controller, index=seed)
    delay, faulty = rng.uniform(0.0, DELAY), bool(rng.random() < 0.5)
    log, constants = logged(case, run, rng, delay=delay, faulty=faulty)
    torque, omega = log.drive_torque.copy(), log.omega.copy()
    if mistake == "brake":
        brake, motor = case.drivetrain.brake, case.drivetrain.motor
        lag = brake.delay + brake.fill_time if brake else motor.lag
        torque[:, axle] = case.demand(log.time - lag) * np.exp(-constants[-1])
    elif mistake == "swapped":  # of the axles that slip most and least
        slip = np.abs(run["slip_velocity"]).mean(axis=0)
        two = [int(slip.argmax()), int(slip.argmin())]
        omega[:, two] = omega[:, two[::-1]]
    return Case(case, controller, run, replace(log, drive_torque=torque, omega=omega), constants)


def used(run: cl.Result, place: FloatArray) -> FloatArray:
    """Largest share of the friction that an axle used in each place."""
    shares = []
    for k in range(run.axles):
        one = run.axle(k + 1)
        share = np.abs(one["creep_force"]) / one["available_force"]
        shares.append(np.interp(place, one["distance"], share))
    return np.asarray(np.max(shares, axis=0))


def doubted(case: Case, draws: int) -> tuple[RailsEstimate, list[str]]:
    """The estimate from a log, and what was doubted of it."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", cl.InputWarning)
        estimate = estimate_rails(case.log, case.scenario, priors=PRIORS, draws=draws)
    return estimate, [*(str(one.message) for one in caught), *estimate.doubts]


def rails_line(seed: int, mistake: str = "", draws: int = 16) -> Line:
    """How the estimate of a log does against the truth."""
    case = drawn(seed, mistake)
    estimate, doubts = doubted(case, draws)
    there = estimate.met.any(axis=1)
    place, low, high, median = (
        part[there] for part in (estimate.place, estimate.low, estimate.high, estimate.median)
    )
    true = case.scenario.rails.friction_scale(place, 0.0)[:, 0]
    inside, share = (low <= true) & (true <= high), used(case.run, place)
    tenth = np.clip((TENTHS * share).astype(int), 0, TENTHS - 1)
    places = np.bincount(tenth, minlength=TENTHS)
    insides = np.bincount(tenth, weights=inside, minlength=TENTHS)
    found = np.array(list(estimate.constants.values()))[: len(case.constants)]  # without the delay
    scores = np.abs(found[:, 0] - case.constants) / found[:, 1]
    return {
        "vehicle": case.scenario.name,
        "controller": case.controller,
        **{f"places_{i}": int(n) for i, n in enumerate(places)},
        **{f"inside_{i}": int(n) for i, n in enumerate(insides)},
        "square_error": float(np.sum(np.log(median / true)[share > USED] ** 2)),
        "used_places": int(np.sum(share > USED)),
        "radii": scores.size - 1,
        "radii_inside": int(np.sum(scores[:-1] < 1.645)),
        "gain_inside": int(scores[-1] < 1.645),
        "doubts": " | ".join(doubts),
    }


def stop_line(seed: int, draws: int = 20) -> Line:
    """The stopping distance of a seed under another controller, on rails from its log."""
    rng = np.random.default_rng(seed)
    case = scenario_of(STOPPED, rng)
    controllers = {"open_loop": ControllerDesign(kind="open_loop", given={})}
    for name in ("wsp", "other"):
        slip = rng.uniform(0.05, 0.2)
        given = {"slip_threshold": slip, "slip_release": 0.5 * slip}
        controllers[name] = ControllerDesign(kind="wsp", given=given)
    speed = rng.uniform(*STOPS_FROM)
    case = replace(case, initial_speed=speed, duration=60.0, controllers=controllers)
    controller = str(rng.choice(["open_loop", "wsp"]))
    run = cl.run_scenario(case, controller, index=seed, until_stop=True)
    log, _ = logged(case, run, rng, delay=rng.uniform(0.0, DELAY), faulty=bool(rng.random() < 0.5))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cl.InputWarning)
        estimate = estimate_rails(log, case, priors=PRIORS, draws=draws)
    cases = [case, *map(estimate.scenario_on, estimate.draws)]
    index = [seed + 1, *range(draws)]
    stops = cl.run_many(cases, "other", ["stopping_distance"], until_stop=True, index=index)
    true, *others = stops["stopping_distance"].tolist()
    # By this method the interval has, on average over the draws, 90 % of the probability.
    low, median, high = np.quantile(others, (0.05, 0.5, 0.95), method="weibull").tolist()
    found = {"true": true, "low": low, "median": median, "high": high}
    return {"controller": controller, **found}


def lines_of(path: Path, seeds: Sequence[int], line_of: Callable[[int], Line]) -> list[Line]:
    """Lines of seeds in a file, to which those that are missing are added."""
    read = list(csv.DictReader(path.open())) if path.exists() else []
    made: dict[int, Line] = {int(line["seed"]): line for line in read}
    for seed in seeds:
        if seed not in made:
            made[seed] = {"seed": seed, **line_of(seed)}
            with path.open("a", newline="") as file:
                writer = csv.DictWriter(file, list(made[seed]))
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerow(made[seed])
    return [made[seed] for seed in seeds]


def sums_of_rails(lines: Sequence[Line]) -> dict[str, float]:
    """Shares inside the 90 % intervals, errors, and share of the logs that are doubted."""

    def total(name: str) -> float:
        return sum(float(line[name]) for line in lines)

    places, insides = (
        np.array([total(f"{name}_{i}") for i in range(TENTHS)]) for name in ("places", "inside")
    )
    found = {"inside": float(insides.sum() / places.sum())}
    found |= {f"inside_{i}": float(insides[i] / n) for i, n in enumerate(places) if n}
    return found | {
        "rms": float(np.sqrt(total("square_error") / max(total("used_places"), 1.0))),
        "radii_inside": total("radii_inside") / total("radii"),
        "gain_inside": total("gain_inside") / len(lines),
        "doubted": sum(bool(line["doubts"]) for line in lines) / len(lines),
    }


def sums_of_stops(lines: Sequence[Line]) -> dict[str, float]:
    """Share of the stops inside the 90 % interval, and root mean square error of the median."""
    true, low, median, high = (
        np.array([float(line[name]) for line in lines])
        for name in ("true", "low", "median", "high")
    )
    inside = ((1.0 - SAME) * low <= true) & (true <= (1.0 + SAME) * high)
    return {
        "inside": float(inside.mean()),
        "rms": float(np.sqrt(np.mean((median / true - 1.0) ** 2))),
        "width": float(np.mean((high - low) / true)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int, help="number of logs")
    parser.add_argument("file", type=Path, help="CSV file with a line for each log")
    parser.add_argument("--mistake", choices=MISTAKES, default="")
    parser.add_argument("--predict", action="store_true", help="stopping distances")
    given = parser.parse_args()
    line_of = stop_line if given.predict else partial(rails_line, mistake=given.mistake)
    lines = lines_of(given.file, range(given.count), line_of)
    for name, value in (sums_of_stops if given.predict else sums_of_rails)(lines).items():
        print(f"{name:14} {value:.3g}")


if __name__ == "__main__":
    main()
