"""Fuzz what reads untrusted bytes in C: ``python tests/native/fuzz.py [TARGET ...] --seconds N``.

Each target is compiled with libFuzzer under the address and the undefined-behaviour sanitizers and
started from the inputs of seeds.py. Printed are executions, how many per second, and edges of the
program that were reached. An input that breaks the program is kept in the folder and named; then
the command ends with an error.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import contactlib as cl

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from exported_fmu import fitting
from fmu_instance import EXPORTS
from native_programs import SANITIZED, Build, compiler
from seeds import write_seeds

LONGEST = {"table": 8192, "start_values": 4096, "fmi": 1024}  # input of each target [bytes]
TARGETS = tuple(LONGEST)
FUZZER = "-fsanitize=fuzzer"  # for the linker


class Found(NamedTuple):
    """What a run of libFuzzer prints."""

    executions: int
    per_second: int
    edges: int
    crashed: bool
    log: str


def can_fuzz(folder: Path) -> bool:
    """Whether there is a clang here that has the runtimes."""
    source = folder / "nothing.c"
    source.write_text("int LLVMFuzzerTestOneInput(void) { return 0; }")
    name, *way = SANITIZED
    command = [compiler(name), *way, FUZZER, str(source), "-o", str(folder / "nothing")]
    return subprocess.run(command, capture_output=True).returncode == 0


def programs(build: Build, targets: Iterable[str] = TARGETS) -> dict[str, Path]:
    return {target: build.program(f"fuzz_{target}", FUZZER) for target in targets}


def export_resources(folder: Path) -> Path:
    """Resources of an FMU of every kind, in folders of their names; one folder more to write in.

    The vehicle has two axles.
    """
    model = cl.load_model("models/locomotive.toml")
    for name, options in EXPORTS.items():
        given = fitting(model, name, axles=2)
        fmu = cl.export_fmu(given, folder / "x.fmu", fmi_version=3, **options)
        (folder / name).mkdir()
        with zipfile.ZipFile(fmu) as archive:
            for file in archive.namelist():
                if file.startswith("resources/") and file.endswith(".bin"):
                    (folder / name / Path(file).name).write_bytes(archive.read(file))
        fmu.unlink()
    (folder / "scratch").mkdir()
    for file in ("creep_table.bin", "rails.bin"):
        for name in EXPORTS:  # those without such a file do not read it
            (folder / name / file).write_bytes((folder / "vehicle" / file).read_bytes())
    for name, file in (
        ("force_element", "lateral_spin_contact.bin"),
        ("creep_forces", "creep_forces.bin"),
    ):
        (folder / "scratch" / file).write_bytes((folder / name / file).read_bytes())
    return folder


def fuzzed(program: Path, resources: Path, *arguments: str) -> Found:
    """Run a target; what crashes it lands in the working folder."""
    done = subprocess.run(
        [str(program), "-print_final_stats=1", "-timeout=120", *arguments],
        capture_output=True,
        text=True,
        errors="replace",
        cwd=program.parent,
        env={**os.environ, "FUZZ_RESOURCES": str(resources)},
    )

    def last(pattern: str) -> int:
        matches = re.findall(pattern, done.stderr)
        return int(matches[-1]) if matches else 0

    return Found(
        last(r"stat::number_of_executed_units:\s*(\d+)"),
        last(r"stat::average_exec_per_sec:\s*(\d+)"),
        last(r"\bcov: (\d+)"),
        done.returncode != 0,
        done.stderr,
    )


def fuzz(target: str, program: Path, seconds: int, corpus: Path, scratch: Path) -> bool:
    """Fuzz one target and print what came of it; whether nothing broke it."""
    corpus.mkdir(parents=True, exist_ok=True)
    resources, seeds = scratch / "resources", scratch / "seeds" / target
    crashes = corpus.parent / f"{target}-crashes"
    outcome = fuzzed(
        program,
        resources,
        f"-max_total_time={seconds}",
        f"-max_len={LONGEST[target]}",
        "-len_control=0",
        f"-artifact_prefix={crashes}-",
        str(corpus),
        str(seeds),
    )
    print(
        f"{target}: {outcome.executions} executions, {outcome.per_second} per second, "
        f"{outcome.edges} edges, {len(list(corpus.iterdir()))} inputs, "
        f"{'CRASHED' if outcome.crashed else 'no crash'}",
        flush=True,
    )
    if outcome.crashed:
        print(outcome.log[-4000:])
    return not outcome.crashed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    parser.add_argument("--seconds", type=int, default=60, help="of each target")
    parser.add_argument("--corpus", type=Path, default=Path("fuzz_corpus"), help="what is found")
    given = parser.parse_args()
    targets = given.targets or list(TARGETS)
    if unknown := set(targets) - set(TARGETS):
        parser.error(f"{', '.join(sorted(unknown))}: known targets are {', '.join(TARGETS)}")
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        if not can_fuzz(scratch):
            raise SystemExit("there is no clang with libFuzzer and the sanitizers' runtimes")
        (scratch / "resources").mkdir()
        write_seeds(scratch / "seeds", export_resources(scratch / "resources"))
        fine = [
            fuzz(target, program, given.seconds, (given.corpus / target).resolve(), scratch)
            for target, program in programs(Build(scratch, SANITIZED), targets).items()
        ]
    return 0 if all(fine) else 1


if __name__ == "__main__":
    raise SystemExit(main())
