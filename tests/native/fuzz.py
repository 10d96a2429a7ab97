"""Fuzz what reads untrusted bytes in C: ``python tests/native/fuzz.py [TARGET ...] --seconds N``.

Each target is compiled with libFuzzer under the address and the undefined-behaviour sanitizers and
started from the inputs of seeds.py. Printed are executions, how many per second, and edges of the
program that were reached. An input that breaks the program is kept in the folder and named; then
the command ends with an error.

The functions of many points and drivetrains are left out: they take no bytes, and the same formulas
are in here for one point at a time.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import contactlib as cl
from contactlib.base.writing import package_folder

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from fmu_instance import EXPORTS
from native_programs import NATIVE, flags, run
from seeds import write_seeds

# Sources of the targets, and how a target is made of one.
TARGETS = {
    "table": ("fuzz_table.c",),
    "start_values": ("fuzz_start_values.c",),
    "fmi2": ("fuzz_program.c", "-DFMI_VERSION=2"),
    "fmi3": ("fuzz_program.c", "-DFMI_VERSION=3"),
}
LONGEST = {"table": 8192, "start_values": 1024, "fmi2": 1024, "fmi3": 1024}  # input [bytes]
SANITIZERS = ("-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all")
# What reads bytes: of these the fuzzer is told what is compared with what, of arithmetic it is not.
READERS = {"checked_file", "component", "creep_table", "resource"}


class Found(NamedTuple):
    """What a run of libFuzzer says of itself."""

    executions: int
    per_second: int
    edges: int
    crashed: bool
    log: str


def tool(name: str) -> str | None:
    """A program of LLVM, by its plain name or that with a version."""
    names = [name, *(f"{name}-{version}" for version in range(21, 12, -1))]
    return next(filter(None, map(shutil.which, names)), None)


def can_fuzz(folder: Path) -> bool:
    """Whether there is a clang here that has the runtimes."""
    if (clang := tool("clang")) is None:
        return False
    source = folder / "nothing.c"
    source.write_text("int LLVMFuzzerTestOneInput(void) { return 0; }")
    command = [clang, *SANITIZERS, str(source), "-o", str(folder / "nothing")]
    return subprocess.run(command, capture_output=True).returncode == 0


def sources() -> list[Path]:
    """The kernel and the shells without the functions of many points or drivetrains."""
    paths = sorted(package_folder("fmu").glob("*.c"))
    return [path for path in paths if not path.name.startswith(("wide", "drivetrain"))]


def compiled(source: Path, made: Path, *way: str) -> Path:
    """Object file of one source."""
    way = tuple(flag.replace("=fuzzer", "=fuzzer-no-link") for flag in way)
    if source.parent != NATIVE and source.stem not in READERS:
        way = (*way, "-fno-sanitize-coverage=trace-cmp")
    run(tool("clang"), *flags(), "-O1", *way, "-c", source, "-o", made)
    return made


def link(objects: Iterable[Path], program: Path, *way: str) -> Path:
    """Program of these object files."""
    run(tool("clang"), *way, *objects, "-lm", "-o", program)
    return program


def build(targets: Iterable[str], folder: Path) -> dict[str, Path]:
    """Compile and link the targets; the object files of the kernel stay in the folder."""
    way = SANITIZERS

    def target(name: str) -> Path:
        source, *options = TARGETS[name]
        return compiled(NATIVE / source, folder / f"fuzz_{name}.o", *way, *options)

    def part(source: Path) -> Path:
        return compiled(source, folder / f"{source.stem}.o", *way)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        kernel_objects = list(pool.map(part, sources()))
        return {
            name: link([made, *kernel_objects], folder / name, *way)
            for name, made in zip(targets, pool.map(target, targets), strict=True)
        }


def export_resources(folder: Path) -> Path:
    """Resources of an FMU of every kind, in folders of their names; one folder more to write in."""
    model = cl.load_model("models/locomotive.toml")
    for name, options in EXPORTS.items():
        fmu = cl.export_fmu(model, folder / "x.fmu", fmi_version=3, **options)
        (folder / name).mkdir()
        with zipfile.ZipFile(fmu) as archive:
            for file in archive.namelist():
                if file.startswith("resources/") and file.endswith(".bin"):
                    (folder / name / Path(file).name).write_bytes(archive.read(file))
        fmu.unlink()
    table = model.wheelset.element.table.data
    (folder / "wheelset_body" / "creep_table.bin").write_bytes(table)  # not read
    (folder / "scratch").mkdir()
    for name, file in (
        ("force_element", "plane_contact.bin"),
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
        found = re.findall(pattern, done.stderr)
        return int(found[-1]) if found else 0

    return Found(
        last(r"stat::number_of_executed_units:\s*(\d+)"),
        last(r"stat::average_exec_per_sec:\s*(\d+)"),
        last(r"\bcov: (\d+)"),
        done.returncode != 0,
        done.stderr,
    )


def fuzz(target: str, seconds: int, corpus: Path, scratch: Path) -> bool:
    """Fuzz one target and print what came of it; whether nothing broke it."""
    folder = scratch / target
    folder.mkdir()
    corpus.mkdir(parents=True, exist_ok=True)
    resources, seeds = scratch / "resources", scratch / "seeds" / target
    program = build([target], folder)[target]
    crashes = corpus.parent / f"{target}-crashes"
    found = fuzzed(
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
        f"{target}: {found.executions} executions, {found.per_second} per second, "
        f"{found.edges} edges, {len(list(corpus.iterdir()))} inputs, "
        f"{'CRASHED' if found.crashed else 'no crash'}",
        flush=True,
    )
    if found.crashed:
        print(found.log[-4000:])
    return not found.crashed


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
            fuzz(target, given.seconds, (given.corpus / target).resolve(), scratch)
            for target in targets
        ]
    return 0 if all(fine) else 1


if __name__ == "__main__":
    raise SystemExit(main())
