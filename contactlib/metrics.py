"""What a traction study reports of a run.

Time integrals are trapezoidal over the rows; a row's demand holds until the next row. Q is the
creep force of both wheels, s the direction that the demand asks for, and

    Q_d = (T_d - b V/r + F J/(M r))/(r + J/(M r))     (held speed: (T_d - b V/r - V' J/r)/r)
    Q_t = min(Q_max, |Q_d|)

Q_d is the force that the demanded torque T_d would give if the wheelset rolled against the
resistance F: what is left after the drive's damping b and after what turns the wheelset along with
the vehicle. Q_max is the largest force that friction allows there and then, at one creepage of both
wheels; so Q_t is what can be transmitted.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from contactlib.drivetrain import Drivetrain
from contactlib.parameters import FloatArray
from contactlib.simulation import WORKS, Result

JERK_WINDOW = 0.1  # time over which the acceleration is averaged [s]
RECOVERED = 0.9  # part of what can be transmitted that counts as all of it [1]
STAYS = 1.0  # after this time without a lack it is a new one [s]
JUMP = 0.05  # part of a signal's range: what changes by more from row to row jumps [1]
NEGLIGIBLE = 0.01  # part of the largest force of a run that does not count [1]

UNITS = {
    "adhesion_utilisation": "1",
    "largest_creepage": "1",
    "largest_slip_speed": "m/s",
    "recovery_time": "s",
    "slip_work": "J",
    "slip_share": "1",
    "jerk": "m/s3",
    "torsional_peak": "N.m",
    "distance": "m",
    "energy_defect": "1",
}


class Metrics(NamedTuple):
    """Numbers of one run; nan where one does not apply. Their units stand in `UNITS`.

    Attributes
    ----------
    adhesion_utilisation : float
        int min(s Q, Q_t) dt / int Q_t dt over the time in which the demand is not zero [1]. Force
        beyond what is asked for, of a wheel that spins down, does not make up for what was lost.
    largest_creepage : float
        Largest |zeta| of a wheel [1].
    largest_slip_speed : float
        Largest |r omega - V| of a wheel [m/s].
    recovery_time : float
        After a change of friction or demand, from the first moment at which s Q lacks more than a
        tenth of Q_t and a hundredth of its largest value until it has come back for a second at
        least; the longest of the run [s]. A change is a jump, or where a ramp begins. Who still
        lacks it at the next change is waited for on. Infinite if the run ends so; nan if nothing
        changes.
    slip_work : float
        int Q (r omega - V) dt, what friction turns into heat [J].
    slip_share : float
        Slip work over int |Q V| dt, the work that the vehicle gets or gives; nan if that is zero
        [1].
    jerk : float
        Largest |V(t) - 2 V(t + W) + V(t + 2 W)|/W**2: change of the acceleration from one window
        W of 0.1 s to the next [m/s3]; nan if the speed is held.
    torsional_peak : float
        Largest |axle torque| [N.m]; nan if the axle is rigid.
    distance : float
        Travelled, backward is negative [m].
    energy_defect : float
        Largest lack of the energy balance over the largest of all works and changes of the stored
        energy [1].
    """

    adhesion_utilisation: float
    largest_creepage: float
    largest_slip_speed: float
    recovery_time: float
    slip_work: float
    slip_share: float
    jerk: float
    torsional_peak: float
    distance: float
    energy_defect: float


def metrics(result: Result, drivetrain: Drivetrain) -> Metrics:
    """Metrics of a run of a scenario.

    Parameters
    ----------
    result : Result
        With the signals of a drivetrain's run.
    drivetrain : Drivetrain
        What ran.
    """
    wheelset = drivetrain.wheelset
    slip = [
        wheelset.radius * result[f"omega_{side}"] - result["speed"] for side in ("left", "right")
    ]
    creepage = [result["creepage_left"], result["creepage_right"]]
    force, wanted = transmittable_force(result, drivetrain)
    slip_work = float(result["creep_work"][-1] - result["creep_work"][0])
    work = float(trapezoid(np.abs(result["creep_force"] * result["speed"]), result.time))
    return Metrics(
        adhesion_utilisation=_utilisation(result, force, wanted),
        largest_creepage=float(np.max(np.abs(creepage))),
        largest_slip_speed=float(np.max(np.abs(slip))),
        recovery_time=_recovery_time(result, force, wanted),
        slip_work=slip_work,
        slip_share=slip_work / work if work > 0.0 else math.nan,
        jerk=math.nan if wheelset.speed_held else _jerk(result.time, result["speed"]),
        torsional_peak=(
            math.nan if drivetrain.axle is None else float(np.max(np.abs(result["axle_torque"])))
        ),
        distance=float(result["distance"][-1] - result["distance"][0]),
        energy_defect=_energy_defect(result),
    )


def transmittable_force(result: Result, drivetrain: Drivetrain) -> tuple[FloatArray, FloatArray]:
    """Creep force in the demand's direction s Q, and what can be transmitted Q_t [N]."""
    wheelset = drivetrain.wheelset
    r, turning = wheelset.radius, wheelset.inertia / wheelset.radius
    left = result["demand"] - wheelset.damping * result["speed"] / r
    if wheelset.mass is None:
        demanded = (left - turning * result["acceleration"]) / r
    else:
        resistance = result["creep_force"] - wheelset.mass * result["acceleration"]
        light = turning / wheelset.mass
        demanded = (left + light * resistance) / (r + light)
    wanted = np.minimum(result["available_force"], np.abs(demanded))
    return np.sign(demanded) * result["creep_force"], wanted


def _utilisation(result: Result, force: FloatArray, wanted: FloatArray) -> float:
    step = np.where(result["demand"][:-1] != 0.0, np.diff(result.time), 0.0)
    used, possible = (
        float(np.sum(step * (y[1:] + y[:-1]))) for y in (np.minimum(force, wanted), wanted)
    )
    return used / possible if possible > 0.0 else math.nan


def _recovery_time(result: Result, force: FloatArray, wanted: FloatArray) -> float:
    lack = np.maximum((1.0 - RECOVERED) * wanted, NEGLIGIBLE * np.max(wanted))
    recovered = (wanted - force <= lack) | (result["demand"] == 0.0)
    names = ("friction_scale_left", "friction_scale_right", "demand")
    changes = np.unique(np.concatenate([_changes(result[name]) for name in names]))
    changes = changes[changes < result.time.size - 1]  # nobody can answer to the last row
    if changes.size == 0:
        return math.nan
    longest, since = 0.0, math.nan
    for start, end in pairwise([*changes, result.time.size]):
        lacking = start + np.flatnonzero(~recovered[start:end])
        if lacking.size and math.isnan(since):
            since = float(result.time[lacking[0]])
        stays = np.flatnonzero(np.diff(result.time[lacking]) > STAYS)
        last = stays[0] if stays.size else -1  # lack before it has come back to stay
        again = int(lacking[last]) + 1 if lacking.size else start
        if again < end and not math.isnan(since):
            longest, since = max(longest, float(result.time[again]) - since), math.nan
    return longest if math.isnan(since) else math.inf


def _changes(values: FloatArray) -> NDArray[np.intp]:
    """Rows that jump, and rows that differ from the one before, which did not."""
    step = np.abs(np.diff(values, prepend=values[:1]))
    moves, jumps = step != 0.0, step > JUMP * np.ptp(values)
    return np.flatnonzero((moves[1:] & ~moves[:-1]) | jumps[1:]) + 1


def _jerk(time: FloatArray, speed: FloatArray) -> float:
    starts = time[time + 2.0 * JERK_WINDOW <= time[-1]]
    if starts.size == 0:
        return math.nan
    v0, v1, v2 = (np.interp(starts + i * JERK_WINDOW, time, speed) for i in range(3))
    return float(np.max(np.abs(v0 - 2.0 * v1 + v2))) / JERK_WINDOW**2


def _energy_defect(result: Result) -> float:
    sizes = [np.ptp(result[name]) for name in (*WORKS, "stored_energy")]
    largest = float(np.max(sizes))
    return float(np.max(np.abs(result["energy_defect"]))) / largest if largest > 0.0 else 0.0
