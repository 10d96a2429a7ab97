"""What long runs of an FMU leave behind: ``python tests/native/endurance.py cycles|day [COUNT]``.

``cycles``: every kind of FMU, in both versions of the standard, is made an instance of, stepped,
saved, restored and freed COUNT times (100000), with two attempts that fail each time and all
messages on. Prints how much bytes allocated, pages in memory and open files grew after the first
hundred.

``day``: the FMU of models/locomotive.toml, of kind wheelset, makes COUNT trips (144) of ten minutes
in steps of 1 ms through its C interface: a start, a pull at 97 % of the critical torque, coasting,
braking to rest, standstill, then the same backward. Prints the time it took, the energy that is
missing, how the trips differ (after the first, which starts from rest and not from what a brake
leaves, all are one: every value on the way is the same to the last bit), how memory grew, and what
became of the time, which the tool adds up step by step.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import contactlib as cl

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from exported_fmu import fitting
from fmu_instance import EXPORTS, Subject
from native_programs import NATIVE, Fmu, standalone

STEPS_PER_TRIP, STEP = 600_000, 1e-3
REFERENCES = (
    *("drive_torque", "omega", "speed", "creep_force"),
    *("radius", "minimum_speed", "inertia", "inverse_mass", "damping"),
    *("constant_resistance", "linear_resistance", "quadratic_resistance"),
)


class Trip(NamedTuple):
    """What endurance.c prints for a trip."""

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


class Growth(NamedTuple):
    """What there is more at the end than after the first cycles."""

    allocated: int
    pages: int
    files: int


def program(folder: Path) -> Path:
    return standalone(NATIVE / "endurance.c", folder)


def numbers_of(command: Path, what: str, fmu: Fmu, *arguments: object) -> list[list[str]]:
    """Words of the lines that the program prints."""
    words = (command, what, fmu.version, fmu.library, fmu.location, fmu.token, *arguments)
    done = subprocess.run([*map(str, words)], check=True, stdout=subprocess.PIPE, text=True)
    return [line.split() for line in done.stdout.splitlines()]


def growths(model: cl.Model, folder: Path, cycles: int) -> Iterator[tuple[str, Growth]]:
    """Of so many cycles of every kind of FMU in both versions."""
    command = program(folder)
    for subject in (Subject(name, version) for name in EXPORTS for version in (2, 3)):
        fmu = Fmu(fitting(model, subject.name), folder / str(subject), **subject.arguments)
        first, last = numbers_of(command, "cycles", fmu, cycles)
        yield str(subject), Growth(*(int(b) - int(a) for a, b in zip(first, last, strict=True)))


def run(model: cl.Model, folder: Path, trips: int, points: str = "added") -> Day:
    """So many trips; communication points are ``added`` up or ``counted``."""
    fmu = Fmu(model, folder / "locomotive", kind="wheelset")
    torque = 0.97 * cl.find_fold(model.wheelset, speed=10.0).drive_torque
    references = ",".join(str(fmu.references[name]) for name in REFERENCES)
    rows = numbers_of(program(folder), "trips", fmu, trips, points, repr(torque), references)
    *lines, times = rows
    return Day([trip_of(line) for line in lines], *map(float.fromhex, times))


def trip_of(line: list[str]) -> Trip:
    """From the words of a line."""
    digest, omega, speed, *rest = line
    numbers: Any = map(float, rest)
    return Trip(digest, float.fromhex(omega), float.fromhex(speed), *numbers)


def print_cycles(model: cl.Model, folder: Path, cycles: int) -> None:
    print(f"growth from cycle 100 to cycle {cycles}")
    print(f"{'':30s}{'bytes':>10s}{'pages':>10s}{'files':>10s}")
    for subject, grown in growths(model, folder, cycles):
        print(f"{subject:30s}" + "".join(f"{number:10d}" for number in grown), flush=True)


def print_day(model: cl.Model, folder: Path, trips: int) -> None:
    begun = time.perf_counter()
    day = run(model, folder, trips)
    steps, first = trips * STEPS_PER_TRIP, day.trips[0]
    print(f"{steps} steps of {STEP} s in {time.perf_counter() - begun:.0f} s")
    print(f"speeds from {first.fastest_backward} to {first.fastest} m/s")
    print(f"energy missing {day.energy_defect:.1e} of the drive's work")
    print(f"different trips after the first: {len({t.digest for t in day.trips[1:]})}")
    print(f"growth of memory after the first: {day.trips[-1].pages - first.pages} pages")
    print(f"tool's time - exact time {day.tool_time - steps * STEP:.2e} s")
    print(f"FMU's time - tool's time {day.fmu_time - day.tool_time:.2e} s")


if __name__ == "__main__":
    what, *count = sys.argv[1:]
    default, task = {"cycles": (100_000, print_cycles), "day": (144, print_day)}[what]
    with tempfile.TemporaryDirectory() as scratch:
        task(cl.load_model("locomotive.toml"), Path(scratch), int(*count) if count else default)
