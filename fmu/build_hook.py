"""Compile the kernel and the FMI shell into one shared library when the package is built.

The compiler is Zig's C compiler from the `ziglang` package, so no machine needs one of its own,
and every platform's library can be built on any other:

    python fmu/build_hook.py                      # this machine's library
    python fmu/build_hook.py x86_64-windows ...   # others; 'all' stands for all of them
    python fmu/build_hook.py --check              # only compile, and take warnings for errors

Two environment variables make a wheel into a release: CONTACTLIB_PLATFORMS names platforms whose
libraries it carries beside its own, and CONTACTLIB_HOST the one that it is for.
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

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCES = Path(__file__).resolve().parent
NATIVE = SOURCES.parent / "contactlib" / "_native"


class Target(NamedTuple):
    """What a platform calls itself: for the compiler, its libraries, its wheels."""

    zig: str
    suffix: str
    wheel_tag: str


# Keys are FMI 3 platform tuples. The versions are the oldest systems that are served.
TARGETS = {
    "x86_64-linux": Target("x86_64-linux-gnu.2.17", ".so", "manylinux_2_17_x86_64"),
    "aarch64-linux": Target("aarch64-linux-gnu.2.17", ".so", "manylinux_2_17_aarch64"),
    "x86_64-windows": Target("x86_64-windows-gnu", ".dll", "win_amd64"),
    "aarch64-darwin": Target("aarch64-macos.11.0", ".dylib", "macosx_11_0_arm64"),
    "x86_64-darwin": Target("x86_64-macos.10.15", ".dylib", "macosx_10_15_x86_64"),
}


def known(name: str) -> str:
    """`name`, if it is a platform tuple that a library can be built for."""
    if name not in TARGETS:
        raise SystemExit(f"no library can be built for {name!r}; known: {', '.join(TARGETS)}, all")
    return name


def named(names: Iterable[str]) -> list[str]:
    """Each of these platform tuples once, where ``all`` stands for all of them."""
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
    """Digest of the C sources: what ties an FMU's description to its binary."""
    digest = hashlib.sha256()
    for path in sorted(SOURCES.glob("*.[ch]")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:32]


def compiler_flags() -> list[str]:
    """Flags that any C99 compiler takes; strict IEEE arithmetic, so all platforms agree."""
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
    """Flags of what only the shared library holds: the FMI shell and the sources' digest."""
    return [
        f'-DCONTACTLIB_TOKEN="{source_token()}"',
        f"-isystem{fmi_headers()}",  # their warnings are not ours
    ]


def zig_cc(name: str, *arguments: str) -> None:
    """Run the compiler for platform tuple `name`."""
    zig_cc_target(TARGETS[name].zig, *arguments)


@cache
def private_cache() -> str:
    """A folder for as long as this process, in which nobody else can put anything."""
    folder = tempfile.mkdtemp(prefix="zig-cache-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def zig_cc_target(target: str, *arguments: str) -> None:
    """Run the compiler for one of its own targets."""
    environment = dict(os.environ)
    if os.name == "posix" and not os.access(environment.get("HOME", ""), os.W_OK):
        # Without a home folder Zig has no place for its cache.
        environment.setdefault("ZIG_GLOBAL_CACHE_DIR", private_cache())
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *arguments]
    subprocess.run(command, check=True, env=environment)


def compile_library(name: str, library: Path, *extra_flags: str) -> None:
    """Compile all sources for platform tuple `name` into the file `library`."""
    sources = [str(path) for path in sorted(SOURCES.glob("*.c"))]
    kind = ["-shared", "-s"]
    if TARGETS[name].suffix == ".so":
        # Linked in time it is a fifth faster, and Zig can do so on these systems only.
        # It keeps to its own functions whatever else a tool has loaded.
        kind += ["-fPIC", "-lm", "-flto", "-Wl,-Bsymbolic"]
    if TARGETS[name].suffix == ".dylib":
        # Else the library's name is the path it was built at.
        kind += ["-Wl,-install_name,@rpath/contactlib.dylib"]
    flags = [*kind, *compiler_flags(), *library_flags(), *extra_flags]
    zig_cc(name, *flags, *sources, "-o", str(library))


def build_library(name: str) -> Path:
    """Compile for platform tuple `name` into the package; return the library's path."""
    library = NATIVE / name / f"contactlib{TARGETS[name].suffix}"
    library.parent.mkdir(parents=True, exist_ok=True)
    # On the same disk, as a rename must be; two builds at once have a folder each.
    with tempfile.TemporaryDirectory(dir=library.parent) as scratch:
        built = Path(scratch) / library.name
        compile_library(name, built)
        built.chmod(0o644)
        built.replace(library)  # one in use keeps its file; the new one takes the name
    return library


def check_sources() -> None:
    """Compile for this machine with warnings as errors; keep nothing."""
    with tempfile.TemporaryDirectory() as scratch:
        compile_library(host(), Path(scratch) / "checked", "-Werror")


class NativeLibraryHook(BuildHookInterface[Any]):
    """Hatchling's hook: a wheel is for one platform and carries at least that one's library."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile before the wheel (or the editable install) is put together."""
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
