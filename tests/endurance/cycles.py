"""Memory of an FMU whose instances come and go: ``python tests/endurance/cycles.py [CYCLES]``.

Every kind of FMU, in both versions of the standard, is made an instance of, stepped, saved,
restored and freed CYCLES times (100000), with two attempts that fail each time and all messages
on. Prints how much bytes allocated, pages in memory and open files grew after the first hundred.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import contactlib as cl

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from fmu_instance import EXPORTS, Subject
from native_programs import Fmu, driver


class Growth(NamedTuple):
    """What there is more at the end than after the first cycles."""

    allocated: int
    pages: int
    files: int


def growth(program: Path, fmu: Fmu, cycles: int) -> Growth:
    """Of so many cycles of an FMU."""
    done = subprocess.run(
        [program, fmu.version, fmu.library, fmu.location, fmu.token, str(cycles)],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    first, last = ([int(word) for word in line.split()] for line in done.stdout.splitlines())
    return Growth(*(after - before for before, after in zip(first, last, strict=True)))


def each(model: cl.Model, folder: Path, cycles: int) -> Iterator[tuple[str, Growth]]:
    """Of every kind of FMU in both versions."""
    program = driver(folder, Path(__file__).with_suffix(".c"))
    for name in EXPORTS:
        for version in (2, 3):
            subject = Subject(name, version)
            fmu = Fmu(model, folder / str(subject), **subject.arguments)
            yield str(subject), growth(program, fmu, cycles)


def main() -> None:
    """Run all and print a table."""
    cycles = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    print(f"growth from cycle 100 to cycle {cycles}")
    print(f"{'':30s}{'bytes':>10s}{'pages':>10s}{'files':>10s}")
    with tempfile.TemporaryDirectory() as scratch:
        for subject, grown in each(cl.load_model("locomotive.toml"), Path(scratch), cycles):
            print(f"{subject:30s}" + "".join(f"{number:10d}" for number in grown), flush=True)


if __name__ == "__main__":
    main()
