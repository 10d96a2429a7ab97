"""Time per call of the FMUs in co-simulation: ``python tests/benchmarks/fmu_step.py``.

A step is timed alone and with inputs set before it. With the same inputs a force element that
remembers nothing has nothing to do in a step; what it has to do is in set and step together.
"""

from __future__ import annotations

import importlib.metadata
import platform
import re
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import fmpy

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.contact import kernel

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from fmu_instance import EXPORTS, Subject

CALLS, REPETITIONS = 200_000, 5

# The first input takes values in this range: from stick over the peak into slip, but for the
# implicit element, which takes jumps of the velocity for what they are: accelerations.
RANGES = {
    "force_element": ("omega", 20.0, 20.6),
    "force_element-relaxed": ("omega", 20.0, 20.6),
    "force_element-implicit": ("omega", 20.1, 20.101),
    "wheelset": ("drive_torque", 2.0e4, 2.2e4),
    "wheelset-relaxed": ("drive_torque", 2.0e4, 2.2e4),
    "wheelset_body": ("drive_torque", 2.0e4, 2.2e4),
    "creep_forces": ("creepage_x", -4e-3, 4e-3),
}
OUTPUTS = {
    "force_element": ["creep_force", "wheel_torque"],
    "creep_forces": ["force_x", "force_y", "spin_moment"],
}
TOLERANCES = (1e-6, 1e-4)  # the FMU's default, and that of `run_scenario`
STATES = ["omega", "speed"]


def processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text() if cpuinfo.is_file() else ""
    found = re.search(r"model name\s*: (.*)", text)
    return found[1] if found else platform.processor() or platform.machine()


def compile_program(program: Path) -> None:
    hook = runpy.run_path(str(package_folder("fmu") / "build_hook.py"))
    hook["zig_cc"](
        kernel.platform_name(),
        *("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"),
        *("-isystem", str(Path(fmpy.__file__).parent / "c-code")),
        str(Path(__file__).with_suffix(".c")),
        *("-o", str(program)),
    )


def nanoseconds(program: Path, fmu: Path, name: str, tolerance: float) -> list[float]:
    """Per call of: step; set; set and step; set, step and get."""
    folder = fmu.with_suffix("")
    fmpy.extract(str(fmu), unzipdir=str(folder))
    description = fmpy.read_model_description(str(fmu))
    references = {v.name: str(v.valueReference) for v in description.modelVariables}
    moved, least, most = RANGES[name]
    inputs = [v.name for v in description.modelVariables if v.causality == "input"]
    inputs.sort(key=lambda name: name != moved)
    outputs = OUTPUTS.get(EXPORTS[name]["kind"], STATES)
    version = description.fmiVersion[0]
    resources = folder / "resources"
    suffix = kernel.library_path(kernel.platform_name()).suffix
    (library,) = (folder / "binaries").glob(f"*/*{suffix}")
    run = subprocess.run(
        [
            *(str(program), version, str(library)),
            resources.as_uri() if version == "2" else f"{resources}/",
            description.guid or description.instantiationToken,
            *(str(CALLS), str(REPETITIONS)),
            ",".join(references[name] for name in inputs),
            ",".join(references[name] for name in outputs),
            *(str(least), str(most), str(tolerance)),
        ],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    return [float(word) for word in run.stdout.split()]


def each(scratch: Path, names: Iterable[str]) -> Iterator[tuple[str, list[float]]]:
    """Times of the exports of these names, in both versions of FMI."""
    program = scratch / "fmu_step.exe"
    compile_program(program)
    for name in names:
        for version in (2, 3):
            subject = Subject(name, version)
            ellipse = name == "creep_forces"
            model = cl.load_model("locomotive.toml" if ellipse else "roller_rig.toml")
            fmu = cl.export_fmu(model, scratch / f"{subject}.fmu", **subject.arguments)
            for tolerance in TOLERANCES[: 2 if name.startswith("wheelset") else 1]:
                times = nanoseconds(program, fmu, name, tolerance)
                yield f"{subject}, {tolerance:g}", times


def main() -> None:
    """Time all that can be exported and print a table."""
    versions = [f"{name} {importlib.metadata.version(name)}" for name in ("contactlib", "ziglang")]
    print(f"{processor()}, {kernel.platform_name()}, {', '.join(versions)}")
    print(
        "nanoseconds per call; steps of 1 ms, by tolerance; "
        f"best of {REPETITIONS} times {CALLS} calls"
    )
    columns = ("step", "set", "set+step", "set+step+get")
    print(f"{'':30s}" + "".join(f"{name:>14s}" for name in columns))
    with tempfile.TemporaryDirectory() as scratch:
        for subject, times in each(Path(scratch), EXPORTS):
            print(f"{subject:30s}" + "".join(f"{t:14.1f}" for t in times))


if __name__ == "__main__":
    main()
