"""The rivals in C: compiled once per process, and called with numpy arrays."""

from __future__ import annotations

import atexit
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from cffi import FFI
from numpy.typing import NDArray

from contactlib import CreepForceTable, Polach, kernel
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder
from contactlib.laws.polach import GRADIENT

SOURCE = Path(__file__).with_name("rivals.c")
# The kernel's arithmetic and instructions, but the newest mathematical functions of this machine.
FLAGS = ["-std=c99", "-O2", "-mcpu=baseline", "-ffp-contract=off", "-fno-math-errno"]
FLAGS += ["-fno-trapping-math", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]


@cache
def ffi() -> Any:
    """Declarations of rivals.c beside those of the kernel."""
    kernel.library()
    found = FFI()
    found.include(kernel.ffi)
    declared, *_ = SOURCE.read_text(encoding="ascii").split("\n/* ------")
    found.cdef(re.sub(r"^#.*$", "", declared, flags=re.MULTILINE))
    return found


@cache
def rivals() -> Any:
    """The compiled rivals.c."""
    scratch = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
    atexit.register(scratch.cleanup)
    path = Path(scratch.name) / "rivals.so"
    library = [
        "-shared",
        str(SOURCE),
        f"-I{package_folder('fmu') / 'kernel'}",
        "-o",
        str(path),
    ]
    if sys.platform != "win32":
        library += ["-fPIC", "-lm"]
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *FLAGS, *library], check=True)
    return ffi().dlopen(str(path))


def pointer(array: FloatArray) -> Any:
    """Address of a contiguous array."""
    return ffi().cast("double *", array.ctypes.data)


def polach(law: Polach, x: FloatArray, ratio: FloatArray) -> None:
    """Fill in Polach's traction ratios.

    In units of the contact in which the normalized creepage x is the creepage and zeta0 = 1, his
    gradient G pi a b c11/4 over mu P is (3/16) pi**2.
    """
    factors = law.adhesion_reduction * GRADIENT, law.slip_reduction * GRADIENT
    rivals().polach_each(*factors, x.size, pointer(x), pointer(ratio))


class CHermite:
    """Cubic Hermite table in C through values and slopes at equal steps from zero."""

    def __init__(self, law: Any, *, end: float, cells: int) -> None:
        nodes = np.linspace(0.0, end, cells + 1)
        values, slopes = law.traction_ratio(nodes), law.slope(nodes)
        self._nodes = np.column_stack([values, slopes * (end / cells)]).ravel()
        self._table = ffi().new("hermite *", (cells, cells / end, pointer(self._nodes)))

    def __call__(self, x: FloatArray, value: FloatArray, slope: FloatArray) -> None:
        """Fill in values and slopes."""
        rivals().hermite_each(self._table, x.size, pointer(x), pointer(value), pointer(slope))


def polach_with_spin(contacts: FloatArray) -> FloatArray:
    """Both forces over mu P at contacts of the shape (n, 7); see rivals.c."""
    contacts = np.ascontiguousarray(contacts)
    force = np.empty((len(contacts), 2))
    given = ffi().cast("polach_contact *", contacts.ctypes.data)
    rivals().polach_with_spin_each(len(contacts), given, pointer(force))
    return force


def fastsim(rates: FloatArray, *, strips: int, elements: int) -> FloatArray:
    """Both forces over mu P at rates of the shape (n, 4); see rivals.c."""
    rates = np.ascontiguousarray(rates)
    force = np.empty((len(rates), 2))
    rivals().fastsim_each(len(rates), strips, elements, pointer(rates), pointer(force))
    return force


class CUsetab:
    """Table of forces and moment, multilinear over a/b and normalized creepages, as USETAB is.

    Its values are those of `forces`, which has the creepages (n, 3) and a/b for arguments.
    """

    def __init__(
        self,
        forces: Callable[[FloatArray, float], FloatArray],
        aspects: Sequence[float],
        nodes: tuple[int, int, int],
    ) -> None:
        start = (0.0, 0.0, -1.0, 0.0)
        axes = [np.linspace(low, 1.0, n) for low, n in zip(start[1:], nodes, strict=True)]
        u = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        creepages = u / (1.0 - np.abs(u)).clip(1e-4)
        self._values = np.stack([forces(creepages, g) for g in aspects])
        self._first, self._last = np.log(aspects[0]), np.log(aspects[-1])
        self._table = ffi().new("usetab *", ((len(aspects), *nodes), start, pointer(self._values)))

    def places(self, a_over_b: FloatArray, creepages: FloatArray) -> FloatArray:
        """Arguments of a call, of the shape (n, 4)."""
        share = (np.log(a_over_b) - self._first) / (self._last - self._first)
        return np.column_stack([share, creepages])

    def __call__(self, places: FloatArray) -> FloatArray:
        """Forces and moment of the shape (n, 3)."""
        found = np.empty((len(places), 3))
        rivals().usetab_each(self._table, len(places), pointer(places), pointer(found))
        return found


def kernel_one_by_one(
    table: CreepForceTable, x: FloatArray, k_hat: FloatArray, ratio: FloatArray, slope: FloatArray
) -> None:
    """Fill in traction ratios and slopes by calls of the kernel for each point."""
    of_kernel = kernel.library().creep_table_evaluate, table.native.struct
    arrays = (pointer(array) for array in (x, k_hat, ratio, slope))
    rivals().table_each(*of_kernel, x.size, *arrays)


def forces_one_by_one(
    bodies: kernel.NativeCreepForces, inputs: NDArray[np.void], found: NDArray[np.void]
) -> None:
    """Fill in the kernel's creep forces by calls for each contact."""
    rivals().forces_each(
        kernel.library().creep_forces_evaluate,
        bodies.struct,
        inputs.size,
        ffi().cast("creep_forces_input *", inputs.ctypes.data),
        ffi().cast("creep_forces_output *", found.ctypes.data),
    )
