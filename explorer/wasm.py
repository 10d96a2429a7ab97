"""Compile the kernel's own sources to the WebAssembly module of the explorer page."""

from __future__ import annotations

import runpy
import tempfile
from pathlib import Path

from contactlib.base.writing import package_folder

SOURCE = Path(__file__).resolve().parent
FMU = package_folder("fmu")

C_SOURCES = (
    "checked_file.c",
    "creep_table.c",
    "creep_curve.c",
    "drivetrain_one_lane.c",
    "force_element.c",
    "half_space.c",
    "hertz.c",
    "lateral_spin_force.c",
    "wheelset_run.c",
)
FUNCTIONS = (
    "creep_table_evaluate",
    "creep_table_coordinate",
    "force_element_evaluate",
    "force_element_scales",
    "creep_curve_points",
    "creep_curve_steady",
    "creep_curve_fold",
    "creep_curve_grip",
    "creep_curve_peak",
    "half_space_scales_of",
    "hertz_semi_axes",
    "new_doubles",  # from here on module.c's
    "new_table",
    "open_packed_table",
    "new_train",
    "train_configure",
    "train_lay_patch",
    "train_advance",
    "train_evaluate",
    "train_settle",
    "train_pass",
)
STACK = 65536  # bytes, from address 0 up: what overflows it is a trap


def compile_kernel() -> bytes:
    """The module, by the compiler and the flags of the native library."""
    hook = runpy.run_path(str(FMU / "build_hook.py"))
    flags = [*hook["compiler_flags"](), "-Werror", "-s", "-mexec-model=reactor"]
    exports = (f"--export={name}" for name in FUNCTIONS)
    link = ["--no-entry", f"-z,stack-size={STACK}", *exports]
    sources = [SOURCE / "module.c", *(FMU / "kernel" / name for name in C_SOURCES)]
    with tempfile.TemporaryDirectory() as scratch:
        built = Path(scratch) / "kernel.wasm"
        arguments = [*flags, *(f"-Wl,{part}" for part in link), *map(str, sources)]
        hook["zig_cc_target"]("wasm32-wasi", *arguments, "-o", str(built))
        return built.read_bytes()
