"""Doubts about a log: columns with another unit, sign, scale or clock than the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from scipy.signal import savgol_filter

from contactlib.base.quantities import FloatArray
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.files.scenario import Scenario
from contactlib.logs.friction import SLIDING
from contactlib.logs.motion import Rows
from contactlib.vehicle.wheelset import davis

SLOWEST = 1.0  # speed above which a log shows creepage [m/s]
LITTLE = 0.01  # creep force over load that is about none
FEW = 100  # rows from which a mean is clear
MISTAKEN = {"km/h": 3.6, "1/min": 30.0 / np.pi}  # numbers for 1 in SI units
SCALE, QUANTUM, LATE = 0.02, 0.1, 0.035  # of speeds [1] and [m/s], of clocks [s]
SLOPES = (0.8, 1.25)  # of the forces that the motion takes over those of the torques
OF_TRAIN = 0.5  # window in which its motion is a straight line [s]
USED = 0.005  # deviation of forces over weight from which their slope is clear
LAGS, BLOCK = 0.5, 0.1  # largest shift of a clock; time over which speeds are averaged [s]
EXACT, CLEAR = 1e-4, 8.0  # error of such means [m/s]; logarithm of a ratio of likelihoods


def smooth(values: FloatArray, step: float, window: float, derivative: int = 0) -> FloatArray:
    """Columns, or their derivatives, by straight lines fitted in a window around each row."""
    width = min(2 * max(1, round(0.5 * window / step)) + 1, (len(values) - 1) | 1)
    return np.asarray(savgol_filter(values, width, 1, deriv=derivative, delta=step, axis=0))


def doubts(
    scenario: Scenario,
    rows: Rows,
    columns: Mapping[str, FloatArray],
    force: FloatArray,
    speed: FloatArray,
) -> Iterator[str]:
    """Sentences on what seems wrong in a log, each with the column and what to do.

    Beside its rows these need the numbers in the columns while the vehicle runs, the creep forces
    that the torques leave [N], and the smooth speed of the vehicle [m/s].
    """
    body, step = scenario.drivetrain.wheelset, float(rows.time[1] - rows.time[0])
    yield from _numbers(columns, body.radius, scenario.shares_of_demand.max(axis=0))
    rim = body.radius * rows.omega
    speeds = {f"omega_{k}": one for k, one in enumerate(rim.T, start=1)} | {"speed": rows.speed}
    seen = rows.speed > SLOWEST
    for unit, value in MISTAKEN.items():
        for factor in (value, 1.0 / value):
            ratios = {
                name: _median((one / factor)[seen] / rows.speed[seen])
                for name, one in speeds.items()
            }
            if wrong := [name for name, ratio in ratios.items() if 0.9 < ratio < 1.1]:
                yield (
                    f"{', '.join(wrong)}: the rim speed is {factor:.3g} times the vehicle's, as if "
                    f"one of them were in {unit}; give the columns their units"
                )
                return
    free = (np.abs(force) < LITTLE * rows.load).all(axis=1) & (speed > SLOWEST)
    yield from _scales({name: _median(one[free] / speed[free]) for name, one in speeds.items()})
    if body.mass is None or not seen.any():
        return  # wheels alone do not show how a sliding vehicle moves
    own = body.resistance
    given = rows.torque.mean(axis=1) / body.radius / body.mass
    needed = davis(own, speed)[0] / body.mass
    needed = needed + STANDARD_GRAVITY * (rows.grade + own.grade)
    needed += given - force.mean(axis=1) / body.mass  # what turns the axles
    turns = ~(np.abs(rim) < SLIDING).any(axis=1)  # else a brake holds a part of its torque
    gain = smooth(speed, step, OF_TRAIN, derivative=1)
    sides = (smooth(one, step, OF_TRAIN)[turns] for one in (given, needed + gain))
    yield from _slope(*sides)
    yield from _clocks(step, step * np.cumsum(given), speed + step * np.cumsum(needed))


def _median(values: FloatArray) -> float:
    """Median of the values that are known; nan of too few."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size >= FEW else np.nan


def _numbers(columns: Mapping[str, FloatArray], radius: float, acting: FloatArray) -> Iterator[str]:
    """Columns that never change or are quantised coarsely."""
    for name, values in columns.items():
        kind, _, number = name.rpartition("_")
        steps = np.unique(values)
        idle = kind == "drive_torque" and not acting[int(number) - 1]
        if steps.size == 1 < values.size and not idle:
            yield (
                f"{name} is {steps[0]:g} in all {values.size} rows while the vehicle runs; leave "
                "the column out if nothing measured it"
            )
        if (name == "speed" or kind == "omega") and 2 < steps.size < 0.5 * values.size:
            quantum = float(np.diff(steps).min()) * (1.0 if name == "speed" else radius)
            if quantum > QUANTUM:
                yield (
                    f"{name} has steps of {quantum:.2g} m/s, and creepage needs at most "
                    f"{QUANTUM:g} m/s; export it with more digits"
                )


def _scales(ratios: Mapping[str, float]) -> Iterator[str]:
    """The speed that differs most from the others, by their ratios to one of them in coasting."""
    known = {name: ratio for name, ratio in ratios.items() if np.isfinite(ratio)}
    for name, ratio in known.items() if len(known) > 1 else ():
        known[name] = ratio / float(np.median([ratios[n] for n in known if n != name]))
    name = max(known, key=lambda one: abs(known[one] - 1.0), default="")
    if len(known) > 1 and abs(known[name] - 1.0) > SCALE:
        yield (
            f"{name} is {known[name]:.3f} times the other speeds while the vehicle coasts; correct "
            "the column's scale or that wheel's radius"
        )


def _slope(given: FloatArray, needed: FloatArray) -> Iterator[str]:
    """Torques that do not accelerate the vehicle as it is [m/s2]."""
    if given.size < FEW:
        return
    (xx, xy), (_, yy) = np.cov(given, needed)
    clear = max(xx, yy) > (USED * STANDARD_GRAVITY) ** 2 and xy**2 > 0.6 * xx * yy
    if clear and not SLOPES[0] < xy / xx < SLOPES[1]:
        yield (
            f"drive_torque: mass and resistance of the vehicle take {xy / xx:.2g} times its force; "
            "correct the sign or unit of the torques, or the scenario's masses"
        )


def _clocks(step: float, given: FloatArray, moved: FloatArray) -> Iterator[str]:
    """A speed that follows the torques' [m/s], up to a factor and a drift, at another time.

    Wheel speeds do not show their clock: they lead, as creepage grows with the force.
    """
    most, each = round(LAGS / step), max(1, round(BLOCK / step))
    blocks = (moved.size - 2 * most) // each
    if blocks * each < FEW:
        return

    def means(values: FloatArray, late: int = 0) -> FloatArray:
        some = values[most - late : most - late + blocks * each]
        return np.asarray(some.reshape(blocks, each).mean(axis=1))

    now = means(moved)
    wrong = np.empty(2 * most + 1)
    for late in range(-most, most + 1):
        basis = np.stack([np.ones(blocks), np.arange(blocks), means(given, late)], axis=1)
        rest = now - basis @ np.linalg.lstsq(basis, now)[0]
        wrong[most + late] = np.mean(rest**2) + EXACT**2
    shift = step * (int(wrong.argmin()) - most)
    if abs(shift) > LATE and 0.5 * blocks * np.log(wrong[most] / wrong.min()) > CLEAR:
        yield (
            f"speed follows drive_torque {abs(shift):.2g} s too "
            f"{'late' if shift > 0.0 else 'early'}; shift the time of one of these columns"
        )
