"""The one-file kernel of an export, compiled to a library, and the compilers for it."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from cffi import FFI
from outside_tools import missing

from contactlib.base.writing import package_folder

RULES = re.DOTALL | re.MULTILINE


def compiler_flags() -> list[str]:
    """Those of the FMU's library, which hides what the FMI shell does not export."""
    path = package_folder("fmu") / "build_hook.py"
    spec: Any = importlib.util.spec_from_file_location("build_hook", path)
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    return [flag for flag in build.compiler_flags() if flag != "-fvisibility=hidden"]


def compiler(name: str) -> list[str]:
    if name == "zig":
        if importlib.util.find_spec("ziglang") is None:
            missing("there is no ziglang")
        return [sys.executable, "-m", "ziglang", "cc"]
    if shutil.which(name) is None:
        missing(f"there is no {name}")
    return [name]


def run(*command: object) -> str:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def declarations(folder: Path) -> str:
    """What the header declares."""
    header = (folder / "contactlib.h").read_text(encoding="ascii")
    return re.sub(r"/\*.*?\*/|^#ifdef __cplusplus.*?^#endif|^#.*?$", "", header, flags=RULES)


class Library:
    """The C file of a folder as a library, with what its header declares."""

    def __init__(self, folder: Path, *command: str) -> None:
        path = folder / "library.so"
        if not path.exists():
            run(*command, "-shared", "-fPIC", folder / "contactlib.c", "-lm", "-o", path)
        self.ffi: Any = FFI()
        self.ffi.cdef(declarations(folder))
        self.c: Any = self.ffi.dlopen(str(path))
        self.element: Any = self.ffi.new("contactlib_element *")
        self.start()

    def start(self) -> None:
        self.c.contactlib_start(self.element)

    def _part(self, name: str) -> Any:
        element = self.element
        states = element.input.memory, element.input.lateral
        parts = (element.contact, element.input, *states, element.output, element)
        return next(part for part in parts if hasattr(part, name))

    def set(self, **values: float) -> None:
        for name, value in values.items():
            setattr(self._part(name), name, value)

    def get(self, *names: str) -> list[float]:
        return [float(getattr(self._part(name), name)) for name in names]

    def text_of(self, text: Any) -> str:
        return "" if text == self.ffi.NULL else str(self.ffi.string(text).decode())

    def step(self, step: float, tolerance: float = 1e-6) -> str:
        return self.text_of(self.c.contactlib_step(self.element, step, tolerance))

    def force(self) -> str:
        parts = [self.ffi.addressof(self.element, part) for part in ("contact", "input", "output")]
        return self.text_of(self.c.contactlib_force(*parts))

    @property
    def bytes(self) -> bytes:
        """All of the element."""
        return bytes(self.ffi.buffer(self.element))
