"""Warnings of runs that would destroy a vehicle, which the equations of motion do not prevent.

Without limits of the drive a wheel slips for as long as the torque lasts. So a warning after the
run names the excessive quantity and the parameter to change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contactlib.base.quantities import warn
from contactlib.runs.result import Result

if TYPE_CHECKING:
    from xarray import Dataset

# Of the rim [m/s]. No train has run faster than 160 m/s, and the hoop stress of a rotating ring of
# steel, density * speed**2, reaches 227 MPa, which the rim of a wheel does not endure.
MAX_RIM_SPEED = 170.0
# Slip work [J] beyond what cooling carries off. It heats the rims of both wheels, some 300 kg of
# steel with 0.5 kJ/(kg.K), by 670 K: near the temperature at which the structure of steel changes.
MAX_HEAT = 100e6
COOLING = 100e3  # continuous heating power that two wheels endure, as of tread brakes downhill [W]
# Creepage [1] of a vehicle that moves. A drive with over-speed protection at 55 m/s (198 km/h) does
# not reach it; near standstill any wheel that spins passes it.
MAX_CREEPAGE, MOVES = 10.0, 5.0  # [1, m/s]
CURE = (
    "no vehicle survives that; lower the torque, let a controller hold the creepage, limit the "
    "drive (power and trip_speed of a scenario's [motor]), or end the run earlier"
)


def warn_of_damage(result: Result) -> None:
    """Warn of a run whose rim speed, slip work or creepage would destroy a vehicle."""
    if not result.time.size:
        return
    speed = result["speed"]
    rim = float(np.max(np.abs(result["slip_velocity"] + speed)))
    heat = float(abs(result["creep_work"][-1] - result["creep_work"][0]))
    creepage = float(np.max(np.abs(result["creepage"]), initial=0.0, where=np.abs(speed) > MOVES))
    damage = []
    if rim > MAX_RIM_SPEED:
        damage.append(f"a rim speed of {rim:.4g} m/s")
    if heat > MAX_HEAT + COOLING * (result.time[-1] - result.time[0]):
        damage.append(f"a slip work of {1e-6 * heat:.3g} MJ")
    if creepage > MAX_CREEPAGE:
        damage.append(f"a creepage of {100.0 * creepage:.4g} %")
    if damage:
        warn(f"the run reaches {', '.join(damage)}: {CURE}")


def warn_of_damaged_runs(dataset: Dataset, duration: float) -> None:
    """Warn of such runs of a sweep, of a mean duration [s], by its outcomes."""
    limits = {
        "largest_slip_speed": (MAX_RIM_SPEED, 1.0, "m/s"),
        "slip_work": (MAX_HEAT + COOLING * duration, 1e-6, "MJ"),
    }
    damage = []
    for name, (limit, factor, unit) in limits.items():
        values = dataset[name].values if name in dataset else np.zeros(0)
        if count := int(np.sum(values > limit)):
            largest = f"{factor * np.nanmax(values):.4g} {unit}"
            what = name.removeprefix("largest_").replace("_", " ")
            damage.append(f"{count} of {values.size} runs reach a {what} of up to {largest}")
    if damage:
        warn(f"{', '.join(damage)}: {CURE}")
