"""Compile the kernel and the FMI shell into one shared library when the package is built.

The compiler is Zig's C compiler from the `ziglang` package, so no compiler has to be installed, and
each platform's library can be built on any other:

    python fmu/build_hook.py                      # this machine's library
    python fmu/build_hook.py x86_64-windows ...   # others; 'all' means all of them
    python fmu/build_hook.py --check              # only compile, with warnings as errors

For release wheels, CONTACTLIB_HOST names the wheel's platform, and CONTACTLIB_PLATFORMS names
further platforms whose libraries the wheel contains. An installed package compiles others by the
same functions, for which it needs no hatchling.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

SOURCES = Path(__file__).resolve().parent
NATIVE = SOURCES.parent / "contactlib" / "_native"


class Target(NamedTuple):
    """A platform's name for the compiler, suffix of its libraries, and tag of its wheels."""

    zig: str
    suffix: str
    wheel_tag: str


# Keys are FMI 3 platform tuples. The versions are those of the oldest supported systems.
TARGETS = {
    "x86_64-linux": Target("x86_64-linux-gnu.2.17", ".so", "manylinux_2_17_x86_64"),
    "aarch64-linux": Target("aarch64-linux-gnu.2.17", ".so", "manylinux_2_17_aarch64"),
    "x86_64-windows": Target("x86_64-windows-gnu", ".dll", "win_amd64"),
    "aarch64-darwin": Target("aarch64-macos.11.0", ".dylib", "macosx_11_0_arm64"),
    "x86_64-darwin": Target("x86_64-macos.10.15", ".dylib", "macosx_10_15_x86_64"),
}


def known(name: str) -> str:
    """Return `name`, or exit if it is not a known platform tuple."""
    if name not in TARGETS:
        raise SystemExit(f"no library can be built for {name!r}; known: {', '.join(TARGETS)}, all")
    return name


def named(names: Iterable[str]) -> list[str]:
    """Return the named platform tuples without duplicates; ``all`` means all of them."""
    each = (TARGETS if name == "all" else [known(name)] for name in names)
    return list(dict.fromkeys(chain.from_iterable(each)))


def host() -> str:
    """Platform tuple of this machine, or the one in CONTACTLIB_HOST."""
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    return known(os.environ.get("CONTACTLIB_HOST") or f"{machine}-{platform.system().lower()}")


def fmi_headers() -> Path:
    """Folder of the FMI headers, which come with FMPy (found without importing it)."""
    spec = importlib.util.find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise RuntimeError("the FMI headers come with the package fmpy, which is not installed")
    return Path(spec.origin).parent / "c-code"


def source_token() -> str:
    """Digest of the C sources, which ties an FMU's description to its binary."""
    digest = hashlib.sha256()
    for path in sorted(SOURCES.glob("*.[ch]")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:32]


def compiler_flags() -> list[str]:
    """Flags for any C99 compiler; strict IEEE arithmetic makes all platforms agree."""
    return [
        "-std=c99",
        "-O2",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-fvisibility=hidden",
        "-ffp-contract=off",
        "-fno-math-errno",
        "-fno-trapping-math",
    ]


def library_flags() -> list[str]:
    """Further flags for the shared library: the FMI shell and the sources' digest."""
    return [
        f'-DCONTACTLIB_TOKEN="{source_token()}"',
        f"-isystem{fmi_headers()}",  # suppresses warnings about these headers
    ]


def zig_cc(name: str, *arguments: str) -> None:
    """Run the compiler for platform tuple `name`."""
    zig_cc_target(TARGETS[name].zig, *arguments)


@cache
def private_cache() -> str:
    """Create a folder that only this user can write to and that is deleted at exit."""
    folder = tempfile.mkdtemp(prefix="zig-cache-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def zig_cc_target(target: str, *arguments: str) -> None:
    """Run the compiler for a target in Zig's notation."""
    environment = dict(os.environ)
    if os.name == "posix" and not os.access(environment.get("HOME", ""), os.W_OK):
        # Zig keeps its cache in the home folder, which is missing here.
        environment.setdefault("ZIG_GLOBAL_CACHE_DIR", private_cache())
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *arguments]
    subprocess.run(command, check=True, env=environment)


def compile_library(name: str, library: Path, *extra_flags: str) -> None:
    """Compile all sources for platform tuple `name` into the file `library`."""
    sources = [str(path) for path in sorted(SOURCES.glob("*.c"))]
    kind = ["-shared", "-s"]
    if TARGETS[name].suffix == ".so":
        # Link-time optimisation makes it a fifth faster; Zig supports it only for these systems.
        # -Bsymbolic: the library uses its own functions whatever else a tool has loaded.
        kind += ["-fPIC", "-lm", "-flto", "-Wl,-Bsymbolic"]
    if TARGETS[name].suffix == ".dylib":
        # The default name is the path where the library was built.
        kind += ["-Wl,-install_name,@rpath/contactlib.dylib"]
    flags = [*kind, *compiler_flags(), *library_flags(), *extra_flags]
    zig_cc(name, *flags, *sources, "-o", str(library))


def build_library(name: str) -> Path:
    """Compile for platform tuple `name` into the package; return the library's path."""
    library = NATIVE / name / f"contactlib{TARGETS[name].suffix}"
    library.parent.mkdir(parents=True, exist_ok=True)
    # On the same disk, as replace() needs; a folder of its own, as two builds may run at once.
    with tempfile.TemporaryDirectory(dir=library.parent) as scratch:
        built = Path(scratch) / library.name
        compile_library(name, built)
        built.chmod(0o644)
        built.replace(library)  # programs that use the old library keep their file
    return library


def check_sources() -> None:
    """Compile for this machine with warnings as errors; keep nothing."""
    with tempfile.TemporaryDirectory() as scratch:
        compile_library(host(), Path(scratch) / "checked", "-Werror")


if importlib.util.find_spec("hatchling") is not None:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface

    class NativeLibraryHook(BuildHookInterface[Any]):
        """Hatchling's hook: a wheel is for one platform and contains at least its library."""

        def initialize(self, version: str, build_data: dict[str, Any]) -> None:
            """Compile before the wheel (or the editable install) is assembled."""
            beside = os.environ.get("CONTACTLIB_PLATFORMS", "").replace(",", " ").split()
            for name in named([host(), *beside]):
                library = build_library(name)
                build_data["artifacts"].append(library.relative_to(NATIVE.parent.parent).as_posix())
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{TARGETS[host()].wheel_tag}"


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        check_sources()
    else:
        for wanted in named(sys.argv[1:] or [host()]):
            print(build_library(wanted))
