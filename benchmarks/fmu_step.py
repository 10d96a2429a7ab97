"""Time of set, step and get of the FMUs in co-simulation: ``python benchmarks/fmu_step.py``."""

from __future__ import annotations

import runpy
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

from timing import one_core

import contactlib as cl
from contactlib import kernel
from contactlib.base.writing import package_folder

sys.path += [str(Path(__file__).parents[1] / "tests" / name) for name in ("", "export", "native")]

from native_programs import Fmu, flags

CALLS, REPETITIONS = 100_000, 5

# The first input takes values in this range: from stick over the peak into slip.
RANGES = {"force_element": ("omega", 20.0, 20.6), "wheelset": ("drive_torque", 2.0e4, 2.2e4)}
OUTPUTS = {"force_element": ["creep_force", "wheel_torque"], "wheelset": ["omega", "speed"]}
TOLERANCES = (1e-6, 1e-4)  # the FMU's default, and that of `run_scenario`


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


def main() -> None:
    """Print the times of force element and wheelset."""
    model = cl.load_model("roller_rig.toml")
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        program, source = scratch / "fmu_step.exe", Path(__file__).with_suffix(".c")
        hook = runpy.run_path(str(package_folder("fmu") / "build_hook.py"))
        hook["zig_cc"](kernel.platform_name(), "-O2", *flags(), str(source), "-o", str(program))
        for name, version in product(RANGES, (2, 3)):
            fmu = Fmu(model, scratch / f"{name}-{version}", kind=name, fmi_version=version)
            for tolerance in TOLERANCES[: 2 if name == "wheelset" else 1]:
                spent = nanoseconds(program, fmu, name, tolerance)
                print(f"{name}, FMI {version}, tolerance {tolerance:g}: {spent:.0f} ns")


if __name__ == "__main__":
    with one_core():
        main()
