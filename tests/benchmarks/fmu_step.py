"""Time per call of the FMU in co-simulation: ``python tests/benchmarks/fmu_step.py``.

The step itself is what set and step take together beyond set alone: with the same inputs an FMU
that is an algebraic function has nothing to do in a step.
"""

from __future__ import annotations

import importlib.metadata
import platform
import re
import runpy
import subprocess
import tempfile
from pathlib import Path

import fmpy

import contactlib as cl
from contactlib import kernel
from contactlib.files import package_folder

CALLS, REPETITIONS = 2_000_000, 5
# The first input takes values in this range; from stick over the peak into slip.
RANGE = {"omega": (20.0, 20.6), "drive_torque": (2.0e4, 2.2e4)}
OUTPUTS = {"force_element": ["creep_force", "wheel_torque"], "wheelset": ["omega", "speed"]}


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
        *("-isystem", str(hook["fmi_headers"]())),
        str(Path(__file__).with_suffix(".c")),
        *("-o", str(program)),
    )


def nanoseconds(program: Path, fmu: Path, kind: str) -> list[float]:
    """Per call of: set; set and step; set, step and get."""
    folder = fmu.with_suffix("")
    fmpy.extract(str(fmu), unzipdir=str(folder))
    description = fmpy.read_model_description(str(fmu))
    references = {v.name: str(v.valueReference) for v in description.modelVariables}
    inputs = [v.name for v in description.modelVariables if v.causality == "input"]
    inputs.sort(key=lambda name: name not in RANGE)
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
            ",".join(references[name] for name in OUTPUTS[kind]),
            *map(str, RANGE[inputs[0]]),
        ],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    return [float(word) for word in run.stdout.split()]


def main() -> None:
    """Time all that can be exported and print a table."""
    versions = [f"{name} {importlib.metadata.version(name)}" for name in ("contactlib", "ziglang")]
    print(f"{processor()}, {kernel.platform_name()}, {', '.join(versions)}")
    print(f"nanoseconds per call; best of {REPETITIONS} times {CALLS} calls")
    columns = ("set", "set+step", "set+step+get", "step")
    print(f"{'':22s}" + "".join(f"{name:>14s}" for name in columns))
    model = cl.load_model("roller_rig.toml")
    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "fmu_step.exe"
        compile_program(program)
        for kind in OUTPUTS:
            for version in (2, 3):
                fmu = Path(scratch) / f"{kind}{version}.fmu"
                try:
                    cl.export_fmu(model, fmu, kind=kind, fmi_version=version)
                except ValueError as error:
                    print(f"{kind} FMI {version}: {error}")
                    continue
                set_, step, get = nanoseconds(program, fmu, kind)
                row = (set_, step, get, step - set_)
                print(f"{kind + f' FMI {version}':22s}" + "".join(f"{t:14.1f}" for t in row))


if __name__ == "__main__":
    main()
