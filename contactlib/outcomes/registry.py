"""Every outcome of a run: its unit, what it is, and how it is summed up."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from contactlib.outcomes.jerk import Jerk
from contactlib.outcomes.recovery import Recovery
from contactlib.outcomes.rows import Seen, Vehicles
from contactlib.outcomes.sums import Ends, Extremes, HeldIntegral, Integral, Observer, Together
from contactlib.parameters import FloatArray
from contactlib.simulation import WORKS


class Outcome(NamedTuple):
    """One number of a run.

    Attributes
    ----------
    unit, description : str
        For people.
    observe : callable
        Makes what sums it up for vehicles.
    """

    unit: str
    description: str
    observe: Callable[[Vehicles], Observer]


def observers(names: Sequence[str], vehicles: Vehicles) -> dict[str, Observer]:
    """What sums up outcomes, by their names.

    Raises
    ------
    ValueError
        If there is no outcome of a name.
    """
    for name in names:
        if name not in OUTCOMES:
            raise ValueError(f"outcome = {name!r} must be one of: {', '.join(OUTCOMES)}")
    return {name: OUTCOMES[name].observe(vehicles) for name in names}


def _signal(name: str) -> Callable[[Seen], FloatArray]:
    return lambda rows: rows[name]


def _larger(left: str, right: str) -> Callable[[Seen], FloatArray]:
    return lambda rows: np.maximum(np.abs(rows[left]), np.abs(rows[right]))


def _share(part: FloatArray, whole: FloatArray) -> FloatArray:
    """Part over whole, nan where there is none."""
    nothing = np.full(whole.shape, np.nan)
    return np.asarray(np.divide(part, whole, out=nothing, where=whole > 0.0))


def _utilisation(vehicles: Vehicles) -> Observer:
    return Together(
        lambda used, possible: _share(used.value(), possible.value()),
        Integral(lambda rows: np.minimum(*rows.transmittable), demanded=True),
        Integral(lambda rows: rows.transmittable[1], demanded=True),
    )


def _largest_slip_speed(vehicles: Vehicles) -> Observer:
    def slip(rows: Seen) -> FloatArray:
        left, right = (
            np.abs(vehicles.radius * rows[f"omega_{side}"] - rows["speed"])
            for side in ("left", "right")
        )
        return np.maximum(left, right)

    return Extremes(slip)


def _slip_share(vehicles: Vehicles) -> Observer:
    return Together(
        lambda work, rail: _share(work.change(), rail.value()),
        Ends(_signal("creep_work")),
        Integral(lambda rows: np.abs(rows["creep_force"] * rows["speed"])),
    )


def _torsional_peak(vehicles: Vehicles) -> Observer:
    return Together(
        lambda largest: np.where(vehicles.rigid, np.nan, largest.value()),
        Extremes(lambda rows: np.abs(rows["axle_torque"])),
    )


def _energy_defect(vehicles: Vehicles) -> Observer:
    def share(defect: Extremes, *energies: Extremes) -> FloatArray:
        largest = np.max([energy.range() for energy in energies], axis=0)
        return np.nan_to_num(_share(defect.value(), largest))

    energies = (Extremes(_signal(name)) for name in (*WORKS, "stored_energy"))
    return Together(share, Extremes(lambda rows: np.abs(rows["energy_defect"])), *energies)


def _change(name: str) -> Callable[[Vehicles], Observer]:
    return lambda vehicles: Together(lambda ends: ends.change(), Ends(_signal(name)))


def _mean(summed: type[Integral | HeldIntegral], name: str) -> Callable[[Vehicles], Observer]:
    return lambda vehicles: Together(
        lambda integral, time: integral.value() / time.change(),
        summed(_signal(name)),
        Ends(lambda rows: rows.time[:, np.newaxis]),
    )


OUTCOMES: Mapping[str, Outcome] = MappingProxyType(
    {
        "adhesion_utilisation": Outcome(
            "1", "force used of what could be transmitted while there is a demand", _utilisation
        ),
        "largest_creepage": Outcome(
            "1",
            "largest size of a wheel's creepage",
            lambda vehicles: Extremes(_larger("creepage_left", "creepage_right")),
        ),
        "largest_slip_speed": Outcome(
            "m/s", "largest size of a wheel's slip speed", _largest_slip_speed
        ),
        "recovery_time": Outcome(
            "s", "longest time until the force is back after a change", Recovery
        ),
        "slip_work": Outcome("J", "work that friction turns into heat", _change("creep_work")),
        "slip_share": Outcome("1", "slip work over the work at the rail", _slip_share),
        "jerk": Outcome("m/s3", "largest change of the vehicle's acceleration", Jerk),
        "torsional_peak": Outcome("N.m", "largest size of the axle's torque", _torsional_peak),
        "distance": Outcome("m", "travelled", _change("distance")),
        "energy_defect": Outcome("1", "largest lack of the energy balance", _energy_defect),
        "final_speed": Outcome(
            "m/s", "vehicle speed at the end", lambda vehicles: Ends(_signal("speed"))
        ),
        "mean_creep_force": Outcome(
            "N", "creep force of both wheels, mean over time", _mean(Integral, "creep_force")
        ),
        "falling_share": Outcome(
            "1",
            "part of the time with a wheel on the falling branch",
            _mean(HeldIntegral, "falling_branch"),
        ),
        "drive_work": Outcome("J", "work of the drive", _change("drive_work")),
    }
)
