"""Time of a step of the kernel as C source: ``python benchmarks/kernel_step.py [MODEL ...]``.

What a hard real-time target needs is the longest of a million steps, with inputs that change at
each of them; kernel_step.c describes what is run and printed.
"""

from __future__ import annotations

import runpy
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import contactlib as cl
from contactlib import kernel
from contactlib.base.writing import package_folder

MODES = {  # whether the force is implicit and the contact has memory; largest number of substeps
    "implicit": (True, False, 0),
    "implicit, limited": (True, False, 3),
    "implicit, memory": (True, True, 0),
    "memory": (False, True, 0),
}
STEP = "1e-3"  # [s]


def compiled(model: cl.Model, scratch: Path) -> Path:
    """The program with the kernel of a model."""
    wheelset = model.wheelset
    remembering = replace(wheelset.element, memory=True)  # the program can switch it off
    model = replace(model, wheelset=replace(wheelset, element=remembering))
    hook = runpy.run_path(str(package_folder("fmu") / "build_hook.py"))
    source, program = cl.export_kernel(model, scratch) / "contactlib.c", scratch / "kernel_step.exe"
    files = (Path(__file__).with_suffix(".c"), source)
    flags = (*hook["compiler_flags"](), "-Werror", f"-I{scratch}", "-lm")
    hook["zig_cc"](kernel.platform_name(), *flags, *map(str, files), "-o", str(program))
    return program


def times(program: Path, mode: str) -> list[float]:
    """Minimum, median, 99.9th percentile, maximum, and maximum of the minimum times [us].

    Then the 99.9th percentile and maximum of the force's error by the limit, over friction.
    """
    implicit, memory, limit = MODES[mode]
    command = [str(program), STEP, *(str(int(given)) for given in (implicit, memory, limit))]
    return list(map(float, subprocess.check_output(command, text=True).split()))


if __name__ == "__main__":
    print(f"{'steps of 1 ms [us]':38}     min  median   99.9%     max  max of min and errors")
    for name in sys.argv[1:] or ["roller_rig.toml", "locomotive.toml"]:
        with tempfile.TemporaryDirectory() as scratch:
            model = cl.load_model(name)
            program = compiled(model, Path(scratch))
            for mode in MODES:
                row = " ".join(
                    f"{value:7.2g}" if value < 0.1 else f"{value:7.2f}"
                    for value in times(program, mode)
                )
                print(f"{name:18}{mode:20} {row}")
