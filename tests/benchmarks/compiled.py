"""The rivals in C: compiled once per process, and called with numpy arrays."""

from __future__ import annotations

import atexit
import re
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from cffi import FFI
from numpy.typing import NDArray

from contactlib import CreepForceTable, ForceElement, Polach
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder
from contactlib.contact import kernel
from contactlib.contact.laws.polach import GRADIENT

HERE = Path(__file__).parent
# The kernel's arithmetic and instructions, but the newest mathematical functions of this machine.
FLAGS = ["-std=c99", "-O2", "-mcpu=baseline", "-ffp-contract=off", "-fno-math-errno"]
FLAGS += ["-fno-trapping-math", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]


@cache
def ffi() -> Any:
    """Declarations of rivals.h beside those of the kernel."""
    kernel.library()
    found = FFI()
    found.include(kernel.ffi)
    text = (HERE / "rivals.h").read_text(encoding="ascii")
    found.cdef(re.sub(r"^#.*$", "", text, flags=re.MULTILINE))
    return found


@cache
def rivals() -> Any:
    """The compiled rivals.c."""
    scratch = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
    atexit.register(scratch.cleanup)
    path = Path(scratch.name) / "rivals.so"
    library = ["-shared", str(HERE / "rivals.c"), f"-I{package_folder('fmu')}", "-o", str(path)]
    if sys.platform != "win32":
        library += ["-fPIC", "-lm"]
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *FLAGS, *library], check=True)
    return ffi().dlopen(str(path))


def pointer(array: FloatArray) -> Any:
    """Address of a contiguous array."""
    return ffi().cast("double *", array.ctypes.data)


class CPolach:
    """Polach's force in C of the contact in which the normalized creepage x is the creepage.

    With zeta0 = 1, mu = 1 and P = 1 his gradient G pi a b c11/4 is (3/16) pi**2.
    """

    def __init__(self, law: Polach, *, residual: float = 1.0, decay: float = 0.0) -> None:
        self._law = ffi().new(
            "polach *",
            (law.adhesion_reduction, law.slip_reduction, GRADIENT, 1.0, residual, decay),
        )

    def __call__(self, x: FloatArray, slip_speed: FloatArray, force: FloatArray) -> None:
        """Fill in the forces."""
        rivals().polach_each(
            self._law, x.size, pointer(x), pointer(slip_speed), 1.0, pointer(force)
        )


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


def fastsim(rate: FloatArray, force: FloatArray, *, strips: int, elements: int) -> None:
    """Fill in longitudinal forces over mu P of longitudinal rates; see rivals.c."""
    rivals().fastsim_each(rate.size, strips, elements, pointer(rate), pointer(force))


def fastsim_force(rates: tuple[float, float, float], *, strips: int, elements: int) -> FloatArray:
    """Both forces over mu P at one triple of rates."""
    force = np.empty(2)
    given = np.array(rates)
    rivals().fastsim(strips, elements, pointer(given), pointer(force))
    return force


class KernelOneByOne:
    """The kernel's function of one point, called for each through a pointer."""

    def __init__(self, table: CreepForceTable) -> None:
        self._table = table.native

    def __call__(
        self, x: FloatArray, k_hat: FloatArray, ratio: FloatArray, slope: FloatArray
    ) -> None:
        """Fill in traction ratios and slopes."""
        rivals().table_each(
            kernel.library().creep_table_evaluate,
            self._table.struct,
            x.size,
            pointer(x),
            pointer(k_hat),
            int(k_hat.size > 1),
            pointer(ratio),
            pointer(slope),
        )


class ElementOneByOne:
    """The kernel's force element, called for each point through a pointer."""

    def __init__(self, element: ForceElement) -> None:
        self._table = element.table.native
        self._parameters = ffi().new("force_element_parameters *", element.parameters)

    def __call__(self, inputs: NDArray[np.void], force: FloatArray) -> None:
        """Fill in creep forces of input records."""
        rivals().element_each(
            kernel.library().force_element_evaluate,
            self._table.struct,
            self._parameters,
            inputs.size,
            ffi().cast("force_element_input *", inputs.ctypes.data),
            pointer(force),
        )
