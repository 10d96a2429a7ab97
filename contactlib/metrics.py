"""What a traction study reports of a run; `contactlib.outcomes` says how it is worked out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactlib.drivetrain import Drivetrain
from contactlib.outcomes import OUTCOMES, Seen, Vehicles, observers
from contactlib.parameters import FloatArray
from contactlib.simulation import Result


class Metrics(NamedTuple):
    """Numbers of one run; nan where one does not apply. Their units stand in `UNITS`.

    Attributes
    ----------
    adhesion_utilisation : float
        int min(s Q, Q_t) dt / int Q_t dt over the time in which the demand is not zero [1]; s Q and
        Q_t are those of `contactlib.outcomes`. Force
        beyond what is asked for, of a wheel that spins down, does not make up for what was lost.
    largest_creepage : float
        Largest |zeta| of a wheel [1].
    largest_slip_speed : float
        Largest |r omega - V| of a wheel [m/s].
    recovery_time : float
        After a change of friction or demand, from the first moment at which s Q lacks more than a
        tenth of Q_t, and than a hundredth of the grip f_d P, until it has come back for a second at
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


UNITS = {name: OUTCOMES[name].unit for name in Metrics._fields}


class _OneRun:
    """A result as the rows of one run."""

    def __init__(self, result: Result) -> None:
        self._result = result

    @property
    def time(self) -> FloatArray:
        return self._result.time

    def __getitem__(self, name: str) -> FloatArray:
        return self._result[name][:, np.newaxis]


def metrics(result: Result, drivetrain: Drivetrain) -> Metrics:
    """Metrics of a run of a scenario.

    Parameters
    ----------
    result : Result
        With the signals of a drivetrain's run.
    drivetrain : Drivetrain
        What ran.
    """
    vehicles = Vehicles.of([drivetrain])
    rows, found = Seen(_OneRun(result), vehicles), observers(Metrics._fields, vehicles)
    for observer in found.values():
        observer.see(rows)
    return Metrics(**{name: float(observer.value()[0]) for name, observer in found.items()})


def transmittable_force(result: Result, drivetrain: Drivetrain) -> tuple[FloatArray, FloatArray]:
    """Creep force in the demand's direction s Q, and what can be transmitted Q_t [N]."""
    force, wanted = Seen(_OneRun(result), Vehicles.of([drivetrain])).transmittable
    return force[:, 0], wanted[:, 0]
