"""A day of a locomotive in an FMU, by steps of 1 ms: ``python tests/endurance/day.py [TRIPS]``.

The FMU of models/locomotive.toml, of kind wheelset, makes trips of ten minutes through its C
interface (144, if not told otherwise: 86 400 000 steps): a start, a pull at 97 % of the critical
torque, coasting, braking to rest, standstill, then the same backward. Prints the time it took, the
energy that is missing, how the trips differ (after the first, which starts from rest and not from
what a brake leaves, all are one: every value on the way is the same to the last bit), how memory
grew, and what became of the time, which the tool adds up step by step.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import contactlib as cl

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from native_programs import Fmu, driver

STEPS_PER_TRIP, STEP = 600_000, 1e-3
REFERENCES = (
    *("drive_torque", "omega", "speed", "creep_force"),
    *("radius", "minimum_speed", "inertia", "inverse_mass", "damping"),
    *("constant_resistance", "linear_resistance", "quadratic_resistance"),
)


class Trip(NamedTuple):
    """What day.c says of a trip."""

    digest: str
    omega: float
    speed: float
    fastest: float
    fastest_backward: float
    drive: float
    creep: float
    resistance: float
    damping: float
    throughput: float
    stored: float
    pages: float


class Day(NamedTuple):
    """Trips, and the time at the end as the tool and the FMU have it."""

    trips: list[Trip]
    tool_time: float
    fmu_time: float

    @property
    def energy_defect(self) -> float:
        """Drive work that is neither stored nor spent, as a part of all that went in and out."""
        spent = sum(t.creep + t.resistance + t.damping for t in self.trips)
        missing = sum(t.drive for t in self.trips) - spent - self.trips[-1].stored
        return abs(missing) / sum(t.throughput for t in self.trips)


def compiled(folder: Path) -> Path:
    """The program."""
    return driver(folder, Path(__file__).with_suffix(".c"))


def run(model: cl.Model, folder: Path, trips: int, points: str = "added") -> Day:
    """So many trips; communication points are ``added`` up or ``counted``."""
    fmu = Fmu(model, folder / "locomotive", kind="wheelset")
    torque = 0.97 * cl.find_fold(model.wheelset, speed=10.0).drive_torque
    references = ",".join(str(fmu.references[name]) for name in REFERENCES)
    where = (compiled(folder), fmu.library, fmu.location, fmu.token)
    done = subprocess.run(
        [*map(str, where), points, str(trips), repr(torque), references],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    *lines, times = (line.split() for line in done.stdout.splitlines())
    tool_time, fmu_time = map(float.fromhex, times)
    return Day([trip_of(line) for line in lines], tool_time, fmu_time)


def trip_of(line: list[str]) -> Trip:
    """From the words of a line."""
    digest, omega, speed, *rest = line
    numbers: Any = map(float, rest)
    return Trip(digest, float.fromhex(omega), float.fromhex(speed), *numbers)


def main() -> None:
    """Run a day and print what became of it."""
    trips = int(sys.argv[1]) if len(sys.argv) > 1 else 144
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as scratch:
        day = run(cl.load_model("locomotive.toml"), Path(scratch), trips)
    steps = trips * STEPS_PER_TRIP
    spent = time.perf_counter() - start
    first = day.trips[0]
    print(f"{steps} steps of {STEP} s in {spent:.0f} s")
    print(f"speeds from {first.fastest_backward} to {first.fastest} m/s")
    print(f"energy missing {day.energy_defect:.1e} of the drive's work")
    print(f"different trips after the first: {len({t.digest for t in day.trips[1:]})}")
    print(f"growth of memory after the first: {day.trips[-1].pages - first.pages} pages")
    print(f"tool's time - exact time {day.tool_time - steps * STEP:.2e} s")
    print(f"FMU's time - tool's time {day.fmu_time - day.tool_time:.2e} s")


if __name__ == "__main__":
    main()
