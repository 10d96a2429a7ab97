"""The loaded library, its structs as numpy dtypes, and arrays as C pointers."""

from __future__ import annotations

import platform
import re
import runpy
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from cffi import FFI
from numpy.typing import NDArray

from contactlib.base.writing import PACKAGE, c_sources, package_folder

HEADERS = (
    "variable.h",
    "creep_table.h",
    "force_element.h",
    "half_space.h",
    "hertz.h",
    "lateral_spin_law.h",
    "creep_forces.h",
    "wheelset.h",
    "wheelset_step.h",
    "track.h",
    "vehicle.h",
    "rails.h",
    "drivetrain.h",
    "creep_curve.h",
    "wheelset_run.h",
    "model.h",
    "token.h",
)
SUFFIXES = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}

ffi: Any = FFI()
_LOADING = Lock()


def platform_name() -> str:
    """FMI 3 platform tuple of this machine, such as ``x86_64-linux``."""
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    return f"{machine}-{platform.system().lower()}"


def library_path(name: str) -> Path:
    """File of the native library for the platform tuple `name`; it need not exist."""
    suffix = SUFFIXES.get(name.partition("-")[2], ".so")
    return PACKAGE / "_native" / name / f"contactlib{suffix}"


@cache
def library() -> Any:
    """The native library, which is loaded once for all threads.

    Raises
    ------
    ImportError
        If it was not built for this machine, or was built from other C sources.
    """
    with _LOADING:
        return _load()


@cache
def _load() -> Any:
    for header in HEADERS:
        (source,) = c_sources(header)
        text = source.read_text(encoding="ascii")
        text = re.sub(r"^#.*$", "", text, flags=re.MULTILINE)
        ffi.cdef(text.replace("CONTACTLIB_API ", ""), override=True)
    path, sources = library_path(platform_name()), package_folder("fmu")
    inside, hook = sources.parent == PACKAGE, sources / "build_hook.py"
    remedy = "install the package again" if inside else f"'python {hook}' builds it"
    if not path.is_file():
        raise ImportError(
            f"contactlib has no native library for {platform_name()} at {path}; {remedy}"
        )
    found = ffi.dlopen(str(path))
    if _token(found) != runpy.run_path(str(sources / "source_token.py"))["source_token"]():
        raise ImportError(
            f"{path} was built from other C sources than those in {sources}; {remedy}"
        )
    return found


def _token(found: Any) -> str:
    return str(ffi.string(found.contactlib_token()).decode())


def token() -> str:
    """Digest of the C sources from which the library was built."""
    return _token(library())


def pointer(array: NDArray[Any], kind: str) -> Any:
    """C array of type `kind` that shares a contiguous array's memory and keeps it alive."""
    return ffi.from_buffer(f"{kind}[]", array)


@cache
def struct_dtype(name: str) -> np.dtype[np.void]:
    """Structured dtype of a C struct of doubles."""
    library()
    return checked_dtype(list(_fields(ffi.typeof(name))), name)


def _fields(kind: Any, side: str = "") -> Iterator[tuple[str, type, tuple[int, ...]]]:
    """Names, types and shapes of a struct's doubles.

    Those of a struct inside it keep their names, or get those of the side: ``held_force_left``.
    """
    for name, of in kind.fields:
        if of.type.kind == "struct":
            yield from _fields(of.type, f"_{name}" if name in ("left", "right") else side)
        else:
            yield f"{name}{side}", np.float64, _shape(of.type)


def _shape(kind: Any) -> tuple[int, ...]:
    """Shape of an array of doubles; that of a single one is empty."""
    return (kind.length, *_shape(kind.item)) if kind.kind == "array" else ()


def checked_dtype(fields: list[tuple[Any, ...]], struct_name: str) -> np.dtype[np.void]:
    """Structured dtype of these fields, which must have the size of the C struct.

    Raises
    ------
    ImportError
        If it has another size.
    """
    found = np.dtype(fields)
    if found.itemsize != ffi.sizeof(struct_name):
        raise ImportError(f"{struct_name} of the native library is not laid out as expected")
    return found
