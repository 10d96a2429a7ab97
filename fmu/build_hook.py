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
import importlib.util
import os
import platform
import runpy
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

SOURCES = Path(__file__).resolve().parent
FOLDERS = ("kernel", "fmi")
source_token = runpy.run_path(str(SOURCES / "source_token.py"))["source_token"]
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
        *(f"-I{SOURCES / folder}" for folder in FOLDERS),
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
    """Run the compiler for a target in Zig's notation, in the folder of the sources."""
    environment = dict(os.environ)
    if os.name == "posix" and not os.access(environment.get("HOME", ""), os.W_OK):
        # Zig keeps its cache in the home folder, which is missing here.
        environment.setdefault("ZIG_GLOBAL_CACHE_DIR", private_cache())
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *arguments]
    subprocess.run(command, check=True, env=environment, cwd=SOURCES)


def compile_library(name: str, library: Path, *extra_flags: str) -> None:
    """Compile all sources for platform tuple `name` into the file `library`.

    Each is compiled by itself, which the compiler's cache knows again unless something changed that
    it includes; so only the FMI shell gets the token, which every change of a source changes.
    """
    flags, kind = [*compiler_flags(), *extra_flags], ["-shared", "-s"]
    token = f'-DCONTACTLIB_TOKEN="{source_token()}"'
    if TARGETS[name].suffix == ".so":
        # Link-time optimisation makes a force a fifth faster; Zig supports it only for these
        # systems. The wide functions gain nothing by it, and are most of what there is to do.
        # -Bsymbolic: the library uses its own functions whatever else a tool has loaded.
        flags.append("-fPIC")
        kind += ["-nostdlib", "-lc", "-lm", "-flto", "-Wl,-Bsymbolic"]
    if TARGETS[name].suffix == ".dylib":
        # The default name is the path where the library was built.
        kind += ["-Wl,-install_name,@rpath/contactlib.dylib"]

    def compiled(source: Path) -> str:
        made, wide = str(Path(scratch, source.stem).with_suffix(".o")), "simd_" in source.name
        own = [token] if source.parent.name == "fmi" else []
        own += ["-flto"] if "-flto" in kind and not wide else []
        zig_cc(name, *flags, *own, "-c", str(source), "-o", made)
        return made

    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(os.cpu_count()) as pool:
        sources = [path for folder in FOLDERS for path in (SOURCES / folder).glob("*.c")]
        slow_first = sorted(sources, key=lambda path: ("simd_" not in path.name, path.name))
        objects = sorted(pool.map(compiled, slow_first))
        zig_cc(name, *kind, *flags, *objects, "-o", str(library.resolve()))


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
    """Compile for this machine with warnings as errors, and against FMI's own headers."""
    import fmpy

    strict = [*compiler_flags(), "-Werror", '-DCONTACTLIB_TOKEN=""']
    headers = Path(fmpy.__file__).parent / "c-code"
    with tempfile.TemporaryDirectory() as scratch:
        # The compiler warns before it optimises, which takes most of the time.
        quickly = ("-O0", "-fno-sanitize=undefined")
        compile_library(host(), Path(scratch) / "checked", "-Werror", *quickly)
        for name in ("fmi2", "fmi3"):
            # As system headers, since they have warnings of their own.
            standard = (f"-isystem{headers}", "-include", f"{name}Functions.h")
            made = str(Path(scratch) / name)
            zig_cc(host(), *strict, *standard, "-c", f"fmi/{name}.c", "-o", made)


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
        for target in named(sys.argv[1:] or [host()]):
            print(build_library(target))
