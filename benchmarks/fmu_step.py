"""Time per call of the FMUs in co-simulation: ``python benchmarks/fmu_step.py``.

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

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.contact import kernel

sys.path += [str(Path(__file__).parents[1] / "tests" / name) for name in ("", "export", "native")]

from fmu_instance import EXPORTS, Subject
from native_programs import Fmu, flags

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


def nanoseconds(program: Path, fmu: Fmu, name: str, tolerance: float) -> list[float]:
    """Per call of: step; set; set and step; set, step and get."""
    moved, least, most = RANGES[name]
    inputs = [v.name for v in fmu.description.modelVariables if v.causality == "input"]
    inputs.sort(key=lambda name: name != moved)
    outputs = OUTPUTS.get(EXPORTS[name]["kind"], STATES)
    named = [",".join(str(fmu.references[name]) for name in names) for names in (inputs, outputs)]
    words = (program, fmu.version, fmu.library, fmu.location, fmu.token, CALLS, REPETITIONS)
    command = [str(word) for word in (*words, *named, least, most, tolerance)]
    run = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return [float(word) for word in run.stdout.split()]


def each(scratch: Path, names: Iterable[str]) -> Iterator[tuple[str, list[float]]]:
    """Times of the exports of these names, in both versions of FMI."""
    program, source = scratch / "fmu_step.exe", Path(__file__).with_suffix(".c")
    hook = runpy.run_path(str(package_folder("fmu") / "build_hook.py"))
    hook["zig_cc"](kernel.platform_name(), "-O2", *flags(), str(source), "-o", str(program))
    for name in names:
        for version in (2, 3):
            subject = Subject(name, version)
            ellipse = name == "creep_forces"
            model = cl.load_model("locomotive.toml" if ellipse else "roller_rig.toml")
            fmu = Fmu(model, scratch / str(subject), **subject.arguments)
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
