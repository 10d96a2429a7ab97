"""Time of set, step and get of the FMUs in co-simulation."""

from __future__ import annotations

import platform
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import contactlib as cl
from contactlib import kernel
from contactlib.base.writing import package_folder

sys.path += [str(Path(__file__).parents[1] / "tests" / name) for name in ("", "export", "native")]

from exported_fmu import fitting
from fmu_instance import EXPORTS, Subject
from native_programs import Fmu, flags

CALLS, REPETITIONS = 100_000, 5

# The first input takes values in this range: from stick over the peak into slip.
RANGES = {"force_element": ("omega", 20.0, 20.6), "wheelset": ("drive_torque", 2.0e4, 2.2e4)}
OUTPUTS = {"force_element": ["creep_force", "wheel_torque"], "wheelset": ["omega", "speed"]}
WHEELS = 8  # in one FMU, beside one; as many as a locomotive of four axles has
TOLERANCES = (1e-6, 1e-4)  # the FMU's default, and that of `run_scenario`


def processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text() if cpuinfo.is_file() else ""
    found = re.search(r"model name\s*: (.*)", text)
    return found[1] if found else platform.processor() or platform.machine()


def nanoseconds(program: Path, fmu: Fmu, name: str, tolerance: float) -> float:
    """Of set, step and get."""
    moved, low, high = RANGES[name]
    inputs = [v.name for v in fmu.description.modelVariables if v.causality == "input"]
    inputs.sort(key=lambda name: name.split("[")[0] != moved)
    count = sum(name.split("[")[0] == moved for name in inputs)
    outputs = [n for n in fmu.references if n.split("[")[0] in OUTPUTS[name]]
    named = [",".join(str(fmu.references[name]) for name in names) for names in (inputs, outputs)]
    words = (program, fmu.version, fmu.library, fmu.location, fmu.token, CALLS, REPETITIONS)
    command = [str(word) for word in (*words, *named, count, low, high, tolerance)]
    return float(subprocess.check_output(command, text=True))


def each(scratch: Path) -> Iterator[tuple[str, float]]:
    """Times of force element and wheelset, in both versions of FMI."""
    program, source = scratch / "fmu_step.exe", Path(__file__).with_suffix(".c")
    hook = runpy.run_path(str(package_folder("fmu") / "build_hook.py"))
    hook["zig_cc"](kernel.platform_name(), "-O2", *flags(), str(source), "-o", str(program))
    model = cl.load_model("roller_rig.toml")
    for name in RANGES:
        for version in (2, 3):
            subject = Subject(name, version)
            fmu = Fmu(model, scratch / str(subject), **subject.arguments)
            for tolerance in TOLERANCES[: 2 if name == "wheelset" else 1]:
                yield f"{subject}, {tolerance:g}", nanoseconds(program, fmu, name, tolerance)
    for name in (name for name in EXPORTS if name.split("-")[0] in RANGES):
        subject = Subject(name, 2)
        times = []
        for wheels in (1, WHEELS):
            folder = scratch / f"{name}-{wheels}"
            fmu = Fmu(fitting(model, name), folder, wheels=wheels, **subject.arguments)
            times.append(nanoseconds(program, fmu, name.split("-")[0], TOLERANCES[0]))
        yield f"{subject}, {WHEELS} wheels", times[1]
        yield f"{subject}, {WHEELS} wheels over one [1]", times[1] / times[0]
